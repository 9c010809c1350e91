//! The cost of events: times of runs that look for an event, one that never happens or one that happens now and then,
//! relative to runs that look for none.

use std::hint::black_box;
use std::time::Instant;
use tfe::prelude::*;

#[dynamics(
    coordinates(theta),
    lagrangian = m*l^2/2*dot(theta)^2 + m*g*l*cos(theta),
    event(turned_over) = theta - 3,
    event(fast) = dot(theta) - 100,
    event(upright) = cos(theta) + 0.999,
    event(bottom) = theta,
)]
struct Pendulum {
    m: f64,
    l: f64,
    g: f64,
}

#[dynamics(
    coordinates(a, b),
    lagrangian = dot(a)^2 + dot(b)^2/2 + dot(a)*dot(b)*cos(a - b) + g*(2*cos(a) + cos(b)),
    event(turned_over) = a - 3,
    event(fast) = dot(a) - 100,
    event(upright) = cos(a) + 0.999,
    event(bottom) = a,
)]
struct DoublePendulum {
    g: f64,
}

#[dynamics(
    coordinates(x, y),
    momenta(px, py),
    hamiltonian = (px^2 + py^2 + x^2 + y^2)/2 + x^2*y - y^3/3,
    event(turned_over) = x - 3,
    event(fast) = px - 100,
    event(upright) = cos(x) + 0.999,
    event(bottom) = x,
)]
struct HenonHeiles;

/// The smallest times per step in nanoseconds. All kinds of runs are measured in turn, so that they see the same
/// machine.
fn nanoseconds(mut runs: Vec<Box<dyn FnMut() -> usize + '_>>, steps: f64) -> Vec<f64> {
    let mut best = vec![f64::INFINITY; runs.len()];
    for _ in 0..30 {
        for (run, best) in runs.iter_mut().zip(&mut best) {
            let start = Instant::now();
            black_box(run());
            *best = best.min(start.elapsed().as_secs_f64() * 1e9 / steps);
        }
    }
    best
}

fn measure<M: Model<N> + Send + Sync, const N: usize>(
    name: &str,
    plain: &Simulation<'_, M, N>,
    start: State<N>,
) {
    const STEPS: u32 = 10_000;
    const STEP: f64 = 0.05;
    const EVENTS: [&str; 4] = ["turned_over", "fast", "upright", "bottom"];
    for every in [1, 1000] {
        let plain = plain.clone().step(STEP).record_every(every);
        let events = EVENTS.map(|event| plain.clone().on(event, Crossing::Rising, |_| Act::Record));
        let runs = [&plain].into_iter().chain(&events);
        let runs = runs.map(|simulation| -> Box<dyn FnMut() -> usize> {
            Box::new(|| {
                let motion = simulation.run(start, 0.0..STEP * f64::from(STEPS));
                motion.map_or(0, |motion| motion.events().len())
            })
        });
        let times = nanoseconds(runs.collect(), f64::from(STEPS));
        print!("{name:16} every {every:4}: {:5.0} ns a step;", times[0]);
        for (event, time) in EVENTS.iter().zip(&times[1..]) {
            print!(" {event} {:.2}", time / times[0]);
        }
        println!();
    }
}

fn main() {
    println!(
        "Times of runs that look for an event, relative to runs that look for none; every n-th node is recorded."
    );
    println!("The first three never happen, the last one does.");
    let pendulum = Pendulum {
        m: 1.0,
        l: 1.0,
        g: 9.81,
    };
    let simulation = Simulation::new(&pendulum);
    measure("pendulum", &simulation, pendulum.state([1.0], [0.0]));
    let double = DoublePendulum { g: 9.81 };
    let simulation = Simulation::new(&double);
    measure(
        "double pendulum",
        &simulation,
        double.state([0.5, 0.3], [0.0, 0.0]),
    );
    let start = State {
        q: [0.0, 0.1],
        p: [0.25, 0.1],
    };
    measure("Hénon–Heiles", &Simulation::new(&HenonHeiles), start);
}
