//! Tests the detection of events: counts events that are missed, and events that are reported but do not exist.
//!
//! Random motions of two models are run with one of several event functions. The result is compared with a scan, which
//! evaluates the event function of the motion at 8000 equally spaced times and looks for changes of sign. The printed
//! tally counts the runs, the events found, the `pairs` of events closer together than the spacing of the scan could
//! resolve, and the `missed` and `invented` events; the program fails if there are any of the last two. All step sizes
//! resolve the motion. If they did not, the velocities of the interpolating polynomials would jump at the nodes, and
//! the polynomials would differ from the elements that end at the events.
//!
//! `cargo run --release --example events_beside_scans -- 100000` makes as many runs.

use std::error::Error;
use tfe::prelude::*;

#[dynamics(
    coordinates(x, y),
    momenta(px, py),
    hamiltonian = (px^2 + py^2 + x^2 + y^2)/2 + x^2*y - y^3/3,
    event(linear) = a*x + b*py + c*y + d/4,
    event(wave) = sin(20*a*(x + b*y)) + c,
    event(product) = (x - a/2)*(y - b/2) + c*px/8,
    event(distance) = sqrt((x - a/2)^2 + (y - b/2)^2) - abs(c)/2,
    event(jump) = select(x < a/4, y - b/4, px - c/4),
    event(clock) = cos(9*a*t) + b*x + c*exp(y),
    event(angle) = atan2(y - a/8, x - b/8) - 2*c,
)]
struct HenonHeiles {
    a: f64,
    b: f64,
    c: f64,
    d: f64,
}

#[dynamics(
    coordinates(u, w),
    lagrangian = dot(u)^2 + dot(w)^2/2 + dot(u)*dot(w)*cos(u - w) + 2*cos(u) + cos(w),
    event(linear) = a*dot(u) + b*dot(w) + c*u + d*w,
    event(wave) = cos(3*w) - sin(u) + a,
    event(product) = dot(u)*dot(w) - a*u*w + b/8,
    event(distance) = (sin(u) + sin(w) - a)^2 + (cos(u) + cos(w) - 2*b)^2 - c^2,
    event(jump) = max(dot(u) - a/2, w - b/2),
    event(clock) = tanh(sin(5*t) + a*u) - b/2,
    event(angle) = abs(u - w) - a^2/4,
)]
struct DoublePendulum {
    a: f64,
    b: f64,
    c: f64,
    d: f64,
}

const EVENTS: [&str; 7] = [
    "linear", "wave", "product", "distance", "jump", "clock", "angle",
];

/// The counts of a number of runs.
#[derive(Clone, Copy, Debug, Default)]
pub struct Tally {
    /// Runs.
    pub runs: usize,
    /// Events found.
    pub events: usize,
    /// Of these, pairs of successive events closer than twice the spacing of the scan.
    pub pairs: usize,
    /// Changes of sign between two times of the scan, without an event between them.
    pub missed: usize,
    /// Events between two times of the scan, without a change of sign.
    pub invented: usize,
}

/// Uniform random numbers between −1 and 1.
pub struct Random(pub u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = (self.0)
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    fn four(&mut self) -> [f64; 4] {
        [0; 4].map(|_| self.next())
    }
}

/// Runs one of the models with one of its events, compares with a scan, and adds to the tally.
pub fn run(number: usize, random: &mut Random, tally: &mut Tally) -> Result<(), Box<dyn Error>> {
    let [a, b, c, d] = random.four();
    let [q0, q1, p0, p1] = random.four();
    let start = State {
        q: [0.3 * q0, 0.3 * q1],
        p: [0.3 * p0, 0.3 * p1],
    };
    let event = EVENTS[number / 2 % EVENTS.len()];
    if number.is_multiple_of(2) {
        let model = HenonHeiles { a, b, c, d };
        compare(
            &Simulation::new(&model),
            start,
            (number, event),
            tally,
            |node, row| {
                model.observables(node.t, &node.q, &node.p, row);
            },
        )
    } else {
        let model = DoublePendulum { a, b, c, d };
        let start = State {
            q: start.q.map(|q| 6.0 * q),
            p: start.p.map(|p| 6.0 * p),
        };
        compare(
            &Simulation::new(&model),
            start,
            (number, event),
            tally,
            |node, row| {
                model.observables(node.t, &node.q, &node.v, row);
            },
        )
    }
}

fn compare<M: Model<2> + Send + Sync>(
    simulation: &Simulation<'_, M, 2>,
    start: State<2>,
    (number, event): (usize, &str),
    tally: &mut Tally,
    outputs: impl Fn(&tfe::Node<2>, &mut [f64]),
) -> Result<(), Box<dyn Error>> {
    const END: f64 = 10.0;
    const PLACES: usize = 8000;
    /// Times of the scan closer than this to an event are skipped: an event is found by an element that ends there,
    /// which differs slightly from the interpolating polynomial that is scanned.
    const NEAR: f64 = 0.01;

    let step = [0.05, 0.1, 0.2][number % 3];
    let motion = simulation
        .clone()
        .element(Mixed::<9>)
        .step(step)
        .on(event, Crossing::Either, |_| Act::Record)
        .run(start, 0.0..END)?;
    let column = EVENTS.iter().position(|name| *name == event).unwrap_or(0);
    let value = |t: f64| {
        let mut row = [0.0; EVENTS.len()];
        outputs(&motion.at(t)?, &mut row);
        Ok::<f64, tfe::AtError>(row[column])
    };
    let met: Vec<f64> = motion.events().iter().map(|event| event.t).collect();
    tally.runs += 1;
    tally.events += met.len();
    let spacing = END / PLACES as f64;
    tally.pairs += met
        .windows(2)
        .filter(|two| two[1] - two[0] < 2.0 * spacing)
        .count();
    // Compare successive times of the scan, without those near an event.
    let mut last: Option<(f64, usize)> = None;
    for k in 0..=PLACES {
        let t = spacing * k as f64;
        let before = met.partition_point(|time| *time < t);
        let nearest = [before.checked_sub(1), Some(before)].into_iter().flatten();
        let is_near = |at: usize| met.get(at).is_some_and(|time| (time - t).abs() < NEAR);
        let here = value(t)?;
        if nearest.into_iter().any(is_near) || here.abs() < 1e-6 || !here.is_finite() {
            continue;
        }
        if let Some((there, count)) = last {
            let changes = here * there < 0.0;
            let between = &met[count..before];
            match (changes, between.len() % 2) {
                (true, 0) => tally.missed += 1,
                (false, 1) => tally.invented += 1,
                _ => {}
            }
            // Two events without a change of sign outside: between them the sign must be opposite.
            for two in between.as_chunks::<2>().0 {
                let inside = value(0.5 * (two[0] + two[1]))?;
                let is_it = there * inside < 0.0 || inside.abs() < 1e-4;
                tally.invented += usize::from(!changes && between.len() == 2 && !is_it);
            }
        }
        last = Some((here, before));
    }
    Ok(())
}

#[allow(
    dead_code,
    reason = "a test includes this file and calls the other functions"
)]
fn main() -> Result<(), Box<dyn Error>> {
    let count = match std::env::args().nth(1) {
        Some(count) => count.parse()?,
        None => 2000,
    };
    let (mut random, mut tally) = (Random(1), Tally::default());
    for number in 0..count {
        run(number, &mut random, &mut tally)?;
        if number % 10_000 == 9999 {
            eprintln!("{tally:?}");
        }
    }
    println!("{tally:?}");
    match tally.missed + tally.invented {
        0 => Ok(()),
        wrong => Err(format!("{wrong} events are missed or do not exist").into()),
    }
}
