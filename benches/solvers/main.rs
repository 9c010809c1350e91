//! Steps of emitted solvers, and of the general stepper.
//!
//! `cargo bench --bench solvers` prints the table; `cargo bench --bench solvers -- pendulum` one scene of it.

mod scenes;

use scenes::*;
use std::hint::black_box;
use std::time::Instant;
use tfe::prelude::*;
use tfe::runtime::step::{Control, Stepper};

type Failure = Box<dyn std::error::Error>;

/// Nanoseconds a step, iterations a step and the end of one stepper.
struct Run<const N: usize> {
    time: f64,
    iterations: f64,
    end: State<N>,
}

/// The best of several runs, taken in turn.
fn best<const N: usize>(
    steps: u32,
    runs: &mut [&mut dyn FnMut() -> Result<(State<N>, u64), Failure>],
) -> Result<Vec<Run<N>>, Failure> {
    let mut best: Vec<Run<N>> = Vec::new();
    for turn in 0..30 {
        for (k, run) in runs.iter_mut().enumerate() {
            let start = Instant::now();
            let (end, iterations) = run()?;
            let time = start.elapsed().as_secs_f64() * 1e9 / f64::from(steps);
            if turn == 0 {
                let iterations = iterations as f64 / f64::from(steps);
                best.push(Run {
                    time,
                    iterations,
                    end,
                });
            }
            best[k].time = best[k].time.min(time);
        }
    }
    Ok(best)
}

fn show<const N: usize>(name: &str, element: Element, runs: &[Run<N>]) {
    let [general, emitted, ..] = runs else {
        return;
    };
    println!(
        "{name:<16} {:<10} {:>5.2} {:>9.0} {:>9.0} {:>7.2} {}",
        element.to_string(),
        emitted.iterations,
        general.time,
        emitted.time,
        emitted.time / general.time,
        if general.end == emitted.end {
            "same"
        } else {
            "DIFFER"
        },
    );
}

macro_rules! scene {
    ($name:literal, $model:expr, $start:expr, $($solver:ident $nodes:literal, $h:expr);*) => {{
        if std::env::args().skip(1).all(|a| a.starts_with('-') || a == $name) {
            let (model, start) = (&$model, $start);
            $({
                let element: Element = Mixed::<$nodes>.into();
                let h: f64 = $h;
                const STEPS: u32 = 2000;
                let runs = best(STEPS, &mut [
                    &mut || {
                        let mut stepper = Stepper::new(model, element, Control::default())?.ends_only();
                        let mut state = black_box(start);
                        for step in 0..STEPS {
                            stepper.advance(h * f64::from(step), h, &mut state, &[])?;
                        }
                        Ok((state, stepper.statistics().iterations))
                    },
                    &mut || {
                        let mut solver = $solver::new(model, h);
                        let mut state = black_box(start);
                        for _ in 0..STEPS {
                            solver.advance(&mut state)?;
                        }
                        Ok((state, solver.statistics().iterations))
                    },
                ])?;
                show($name, element, &runs);
            })*
        }
    }};
}

fn main() -> Result<(), Failure> {
    println!("scene            element    iter.   general   emitted  ratio");
    let model = Pendulum {};
    scene!("pendulum", model, model.state([1.5], [0.0]), Pendulum4 4, 0.1; Pendulum9 9, 1.0);
    let model = DoublePendulum { g: 9.81 };
    scene!("double-pendulum", model, model.state([0.5, -0.3], [0.0, 0.0]), DoublePendulum4 4, 0.01; DoublePendulum9 9, 0.1);
    let model = Kepler {};
    scene!("kepler", model, model.state([0.4, 0.0], [0.0, 2.0]), Kepler4 4, 0.02; Kepler9 9, 0.2);
    let model = HenonHeiles {};
    let start = State {
        q: [0.1, 0.0],
        p: [0.0, 0.5],
    };
    scene!("henon-heiles", model, start, HenonHeiles4 4, 0.1; HenonHeiles9 9, 1.0);
    let model = VanDerPol { mu: 1.0 };
    scene!("van-der-pol", model, model.state([2.0], [0.0]), VanDerPol4 4, 0.02; VanDerPol9 9, 0.2);
    let model = HeavyTop {
        a: 1.4,
        c: 0.6,
        w: 5.0,
    };
    scene!("heavy-top", model, model.state([0.0, 0.7, 0.0], [0.5, 0.0, 12.0]), HeavyTop4 4, 0.01; HeavyTop9 9, 0.1);
    let model = Fput { alpha: 0.25 };
    let mut q = [0.0; 32];
    for (i, q) in q.iter_mut().enumerate() {
        *q = (std::f64::consts::PI * (i + 1) as f64 / 33.0).sin();
    }
    scene!("fput", model, model.state(q, [0.0; 32]), Fput4 4, 0.05; Fput9 9, 0.5);
    Ok(())
}
