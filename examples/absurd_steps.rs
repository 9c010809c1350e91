//! Tests that steps that are far too long give an error or a warning, and not a wrong result without either.
//!
//! Random states of six models are run for two steps with elements of all families; the step size is random, from 0.01
//! (sensible) to 2 (absurd). Each run is compared with one of very short steps. The table counts for each element:
//!
//! * `runs`: runs made;
//! * `cut`: runs in which steps were cut into shorter ones;
//! * `warned`: runs that ended with a warning; `needless`: those among them whose error was below 1 % of the path;
//! * `refused`: runs that ended with an error;
//! * `wrong`: runs without error or warning whose end is off by more than half of the length of the path. If there are
//!   any, the program fails.
//!
//! `cargo run --release --example absurd_steps -- 100000` makes as many runs; a second number is the seed of the random
//! numbers.

use std::collections::BTreeMap;
use std::error::Error;
use tfe::Model;
use tfe::prelude::*;

#[dynamics(
    coordinates(a, b),
    lagrangian = dot(a)^2 + dot(b)^2/2 + cos(a - b)*dot(a)*dot(b) + 9.81*(2*cos(a) + cos(b))
)]
struct DoublePendulum;

#[dynamics(coordinates(x, y), lagrangian = (dot(x)^2 + dot(y)^2)/2 + 1/sqrt(x^2 + y^2))]
struct Kepler;

#[dynamics(
    coordinates(x, y),
    momenta(px, py),
    hamiltonian = (px^2 + py^2 + x^2 + y^2)/2 + x^2*y - y^3/3
)]
struct HenonHeiles;

#[dynamics(
    coordinates(r, phi),
    lagrangian = (dot(r)^2 + r^2*dot(phi)^2)/2 + 9.81*r*cos(phi) - 40*(r - 1)^2/2
)]
struct SpringPendulum;

#[dynamics(
    coordinates(x, y),
    lagrangian = (dot(x)^2 + dot(y)^2)/2 - 9.81*y,
    constraint(rod) = x^2 + y^2 - 1
)]
struct Rod;

#[dynamics(
    coordinates(x),
    lagrangian = dot(x)^2/2 + x^2/2 - x^4/4,
    force(x) = 0.3*cos(1.2*t) - 0.2*dot(x)
)]
struct Duffing;

/// Uniform random numbers between 0 and 1, the same in every run of the program.
struct Random(u64);

impl Random {
    fn between(&mut self, from: f64, to: f64) -> f64 {
        let Self(state) = self;
        *state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        from + (to - from) * (*state >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// The counts of the runs of one element; the columns of the table.
#[derive(Default)]
struct Count {
    runs: u32,
    cut: u32,
    warned: u32,
    /// Runs with a warning although their error is below 1 % of the path.
    needless: u32,
    refused: u32,
    wrong: u32,
}

/// The number of steps in each run.
const STEPS: f64 = 2.0;

/// Counts one run. It is wrong if its end differs from that of the run with short steps by more than half of the length
/// of the path.
fn examine<M: Model<N>, const N: usize>(
    simulation: &Simulation<'_, M, N>,
    start: State<N>,
    (element, h): (Element, f64),
    count: &mut Count,
) {
    let end = STEPS * h;
    let fine = simulation
        .clone()
        .element(Mixed::<8>)
        .step((h / 40.0).min(0.01));
    // The motion runs into a singularity: there is nothing to compare with.
    let Ok(fine) = fine.run(start, 0.0..end) else {
        return;
    };
    count.runs += 1;
    let motion = match simulation
        .clone()
        .element(element)
        .step(h)
        .run(start, 0.0..end)
    {
        Ok(motion) => motion,
        Err(_) => {
            count.refused += 1;
            return;
        }
    };
    count.cut += u32::from(motion.statistics().cuts > 0);
    let mut way = 0.0;
    for pair in fine.states().windows(2) {
        way += distance(&pair[0].q, &pair[1].q);
    }
    let off = distance(&motion.last().q, &fine.last().q);
    if !motion.warnings().is_empty() {
        count.warned += 1;
        count.needless += u32::from(off < 0.01 * way);
        return;
    }
    // Written such that a NaN counts as wrong.
    if !(off <= 0.5 * way) {
        count.wrong += 1;
        println!(
            "wrong: {element}, h = {h:.3} from {start:?}: {:?} instead of {:?}",
            motion.last().q,
            fine.last().q
        );
    }
}

fn distance<const N: usize>(a: &[f64; N], b: &[f64; N]) -> f64 {
    a.iter()
        .zip(b)
        .map(|(a, b)| (a - b).powi(2))
        .sum::<f64>()
        .sqrt()
}

fn main() -> Result<(), Box<dyn Error>> {
    let runs: u32 = std::env::args()
        .nth(1)
        .map_or(Ok(300), |text| text.parse())?;
    let seed = std::env::args().nth(2).map_or(Ok(1), |text| text.parse())?;
    let mut random = Random(seed);
    let mut counts: BTreeMap<String, Count> = BTreeMap::new();
    for run in 0..runs {
        let nodes = 2 + run as usize / 6 % 5;
        let family = run / 30 % 8;
        let element = match family {
            0 | 1 => Element::mixed(nodes),
            2 => Element::primal(nodes).reduced(),
            3 => Element::radau(nodes),
            4 => Element::energy_conserving(nodes),
            5 => Element::primal(nodes),
            6 => Element::primal(nodes).lobatto(),
            _ => Element::three_field(nodes).quadrature(nodes + 2),
        };
        let h = 10_f64.powf(random.between(-2.0, 0.3));
        let mut near = |middle: f64, width: f64| random.between(middle - width, middle + width);
        let count = counts.entry(format!("{element}")).or_default();
        match run % 6 {
            0 => {
                let start = DoublePendulum.state(
                    [near(0.0, 3.0), near(0.0, 3.0)],
                    [near(0.0, 4.0), near(0.0, 4.0)],
                );
                examine(
                    &Simulation::new(&DoublePendulum),
                    start,
                    (element, h),
                    count,
                );
            }
            1 => {
                let start = Kepler.state([1.0, 0.0], [near(0.0, 0.3), near(0.9, 0.4)]);
                examine(&Simulation::new(&Kepler), start, (element, h), count);
            }
            2 => {
                let start = State {
                    q: [near(0.0, 0.3), near(0.0, 0.3)],
                    p: [near(0.0, 0.3), near(0.0, 0.3)],
                };
                examine(&Simulation::new(&HenonHeiles), start, (element, h), count);
            }
            3 => {
                let start = SpringPendulum.state(
                    [near(1.2, 0.3), near(0.0, 2.0)],
                    [near(0.0, 1.0), near(0.0, 3.0)],
                );
                examine(
                    &Simulation::new(&SpringPendulum),
                    start,
                    (element, h),
                    count,
                );
            }
            4 => {
                let (angle, rate) = (near(0.0, 3.0), near(0.0, 5.0));
                let (s, c) = angle.sin_cos();
                let start = Rod.state([c, s], [-s * rate, c * rate]);
                let element = if matches!(family, 3 | 4) {
                    Element::mixed(nodes)
                } else {
                    element
                };
                examine(&Simulation::new(&Rod), start, (element, h), count);
            }
            _ => {
                let start = Duffing.state([near(0.0, 1.5)], [near(0.0, 1.5)]);
                examine(&Simulation::new(&Duffing), start, (element, h), count);
            }
        }
    }
    println!(
        "{:32} {:>8} {:>8} {:>8} {:>8} {:>8} {:>8}",
        "element", "runs", "cut", "warned", "needless", "refused", "wrong"
    );
    let mut all = Count::default();
    for (element, count) in &counts {
        println!("{}", row(element, count));
        all.runs += count.runs;
        all.cut += count.cut;
        all.warned += count.warned;
        all.needless += count.needless;
        all.refused += count.refused;
        all.wrong += count.wrong;
    }
    println!("{}", row("all", &all));
    match all.wrong {
        0 => Ok(()),
        wrong => Err(format!(
            "{wrong} of {} runs are wrong without an error or a warning",
            all.runs
        )
        .into()),
    }
}

fn row(name: &str, count: &Count) -> String {
    let Count {
        runs,
        cut,
        warned,
        needless,
        refused,
        wrong,
    } = count;
    format!("{name:32} {runs:8} {cut:8} {warned:8} {needless:8} {refused:8} {wrong:8}")
}
