//! Ensembles: thousands of initial states, computed one by one, eight at a time in SIMD lanes, and on all cores.
//!
//! The models are a pendulum released at rest from 4096 angles, declared by a Lagrangian and by a Hamiltonian, 4096
//! orbits of the Hénon–Heiles system (M. Hénon, C. Heiles, The applicability of the third integral of motion,
//! Astronomical Journal 69 (1964) 73–79), and a double pendulum, whose mass matrix depends on the configuration. Units
//! are natural ones.
//!
//! The table shows nanoseconds per step, the speed-up of each way over the way before it, and the largest difference
//! between the ends of the runs in lanes and of single runs. Times are the smallest of seven, with all ways measured in
//! turn; the ratios depend on the processor and its load. The last line compares an ensemble of parameter sets with one
//! of initial states.

use std::error::Error;
use std::time::{Duration, Instant};
use tfe::prelude::*;

#[dynamics(coordinates(theta), lagrangian = dot(theta)^2/2 + cos(theta))]
struct Pendulum;

#[dynamics(coordinates(theta), momenta(p), hamiltonian = p^2/2 - cos(theta))]
struct PendulumH;

#[dynamics(
    coordinates(x, y), momenta(px, py),
    hamiltonian = (px^2 + py^2)/2 + (x^2 + y^2)/2 + x^2*y - y^3/3,
)]
struct HenonHeiles;

#[dynamics(
    coordinates(theta1, theta2),
    lagrangian = dot(theta1)^2 + dot(theta2)^2/2 + dot(theta1)*dot(theta2)*cos(theta1 - theta2)
               + 2*cos(theta1) + cos(theta2),
)]
struct DoublePendulum;

/// A double pendulum whose masses and lengths are parameters; SI units.
#[dynamics(
    coordinates(theta1, theta2),
    let x1 = l1 * sin(theta1),
    let y1 = -l1 * cos(theta1),
    let x2 = x1 + l2 * sin(theta2),
    let y2 = y1 - l2 * cos(theta2),
    lagrangian = m1/2 * (dot(x1)^2 + dot(y1)^2) + m2/2 * (dot(x2)^2 + dot(y2)^2) - g * (m1*y1 + m2*y2),
)]
struct Links {
    m1: f64,
    m2: f64,
    l1: f64,
    l2: f64,
    g: f64,
}

// Without optimisation, times are not meaningful: one run is enough.
const STARTS: usize = if cfg!(debug_assertions) { 256 } else { 4096 };
const ROUNDS: usize = if cfg!(debug_assertions) { 1 } else { 7 };
const STEP: f64 = 0.1;
const END: f64 = 5.0;

fn main() -> Result<(), Box<dyn Error>> {
    println!("nanoseconds per step, and the speed-up over the column before");
    println!(
        "{:<18} {:>10} {:>10} {:>6} {:>10} {:>6} {:>11}",
        "model", "one by one", "in lanes", "", "all cores", "", "difference"
    );
    let angles = starts(|f| Pendulum.state([2.5 * f], [0.0]));
    compare("pendulum by L", &Pendulum, &angles)?;
    compare("pendulum by H", &PendulumH, &angles)?;
    let orbits = starts(|f| HenonHeiles.state([0.3 * f, 0.1], [0.2, 0.1]));
    compare("Hénon–Heiles", &HenonHeiles, &orbits)?;
    let angles = starts(|f| DoublePendulum.state([0.5 * f, 0.1], [0.0, 0.1]));
    compare("double pendulum", &DoublePendulum, &angles)?;
    study()
}

/// Compares the time for many parameter sets with that for as many initial states of one model; both use lanes.
fn study() -> Result<(), Box<dyn Error>> {
    const SETS: u32 = if cfg!(debug_assertions) {
        1000
    } else {
        100_000
    };
    let links = |f: f64| Links {
        m1: 1.0,
        m2: 0.5 + f,
        l1: 1.0,
        l2: 1.2 - 0.4 * f,
        g: 9.81,
    };
    let models: Vec<_> = (0..SETS)
        .map(|k| links(f64::from(k) / f64::from(SETS)))
        .collect();
    let one = links(0.5);
    let starts = vec![one.state([0.5, 0.3], [0.0, 0.0]); models.len()];
    let same = Ensemble::new(&one).element(Mixed::<6>).step(0.02);
    let varied = Ensemble::of_models(&models).element(Mixed::<6>).step(0.02);
    let mut best = [Duration::MAX; 2];
    for _ in 0..ROUNDS.min(3) {
        let clock = Instant::now();
        same.run(&starts, 0.0..1.0)?;
        best[0] = best[0].min(clock.elapsed());
        let clock = Instant::now();
        let ends = varied.run(&starts, 0.0..1.0)?;
        best[1] = best[1].min(clock.elapsed());
        assert_eq!(ends.failures().count(), 0);
    }
    let [same, varied] = best.map(|time| time.as_secs_f64());
    println!(
        "\n{SETS} parameter sets of a double pendulum: {varied:.2} s, {:.2} times the time of one model from as many initial states",
        varied / same
    );
    Ok(())
}

fn starts<const N: usize>(start: impl Fn(f64) -> State<N>) -> Vec<State<N>> {
    (0..STARTS)
        .map(|k| start(k as f64 / STARTS as f64))
        .collect()
}

fn compare<M, const N: usize>(
    name: &str,
    model: &M,
    starts: &[State<N>],
) -> Result<(), Box<dyn Error>>
where
    M: Model<N> + Sync,
{
    let one_core = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    let ensemble = Ensemble::new(model).element(Mixed::<6>).step(STEP);
    let simulation = Simulation::new(model).element(Mixed::<6>).step(STEP);
    // Only the end states, as an ensemble returns them.
    let simulation = simulation.record_every(usize::MAX);
    let mut best = [Duration::MAX; 3];
    let mut difference = 0.0_f64;
    for _ in 0..ROUNDS {
        let clock = Instant::now();
        let mut single = Vec::with_capacity(STARTS);
        for start in starts {
            single.push(*simulation.run(*start, 0.0..END)?.last());
        }
        best[0] = best[0].min(clock.elapsed());

        let clock = Instant::now();
        let in_lanes = one_core.install(|| ensemble.run(starts, 0.0..END))?;
        best[1] = best[1].min(clock.elapsed());

        let clock = Instant::now();
        let on_all = ensemble.run(starts, 0.0..END)?;
        best[2] = best[2].min(clock.elapsed());

        assert_eq!(
            in_lanes, on_all,
            "the number of cores must not change the results"
        );
        for (end, single) in in_lanes.iter().zip(&single) {
            let end = end.as_ref().map_err(Clone::clone)?;
            for a in 0..N {
                let off = [end.q[a] - single.q[a], end.p[a] - single.p[a]].map(f64::abs);
                // `max` would ignore a NaN.
                assert!(!off[0].is_nan() && !off[1].is_nan(), "{end:?}");
                difference = difference.max(off[0]).max(off[1]);
            }
        }
    }
    let [one, lanes, all] = best.map(|time| time.as_secs_f64());
    let per_step = 1e9 / (STARTS as f64 * (END / STEP).round());
    println!(
        "{name:<18} {:>10.0} {:>10.0} {:>6.2} {:>10.0} {:>6.2} {difference:>11.0e}",
        one * per_step,
        lanes * per_step,
        one / lanes,
        all * per_step,
        lanes / all
    );
    assert!(
        difference <= 1e-13,
        "runs in lanes must agree with single runs"
    );
    Ok(())
}
