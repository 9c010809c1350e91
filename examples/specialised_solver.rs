//! An emitted solver compared with the general stepper: results, time per step, memory.
//!
//! `solver(Name, Mixed::<4>)` emits a stepper for one model and one element. Its sizes and tables are constants and all
//! of its memory is in the struct itself, so that it needs no allocator. The table shows the size of the struct, the
//! nanoseconds per step of both and their ratio, and the difference of the end states, which is at most rounding. Times
//! are the smallest of many repetitions, with both measured in turn.

use std::error::Error;
use std::hint::black_box;
use std::time::{Duration, Instant};
use tfe::prelude::*;
use tfe::runtime::step::{Control, Stepper};

#[dynamics(
    coordinates(theta1, theta2),
    lagrangian = dot(theta1)^2 + dot(theta2)^2/2 + dot(theta1)*dot(theta2)*cos(theta1 - theta2)
               + g*(2*cos(theta1) + cos(theta2)),
    solver(TwoNodes, Mixed::<2>),
    solver(FourNodes, Mixed::<4>),
)]
struct DoublePendulum {
    g: f64,
}

const STEPS: usize = 1000;
const STEP: f64 = 0.01;

fn main() -> Result<(), Box<dyn Error>> {
    let model = DoublePendulum { g: 9.81 };
    let start = model.state([0.5, -0.3], [0.0, 0.0]);
    println!(
        "{:<12} {:>8} {:>14} {:>14} {:>7} {:>10}",
        "element", "bytes", "generic ns", "emitted ns", "ratio", "difference"
    );

    let mut generic = [Duration::MAX; 2];
    let mut emitted = [Duration::MAX; 2];
    let mut ends = [[start; 2]; 2];
    for _ in 0..200 {
        for (k, element) in [Element::mixed(2), Element::mixed(4)]
            .into_iter()
            .enumerate()
        {
            let mut stepper = Stepper::new(&model, element, Control::default())?;
            let mut state = black_box(start);
            let clock = Instant::now();
            for step in 0..STEPS {
                stepper.advance(step as f64 * STEP, STEP, &mut state, &[])?;
            }
            generic[k] = generic[k].min(clock.elapsed());
            ends[k][0] = state;
        }
        let mut state = black_box(start);
        let mut solver = TwoNodes::new(&model, STEP);
        let clock = Instant::now();
        for _ in 0..STEPS {
            solver.advance(&mut state)?;
        }
        emitted[0] = emitted[0].min(clock.elapsed());
        ends[0][1] = state;

        let mut state = black_box(start);
        let mut solver = FourNodes::new(&model, STEP);
        let clock = Instant::now();
        for _ in 0..STEPS {
            solver.advance(&mut state)?;
        }
        emitted[1] = emitted[1].min(clock.elapsed());
        ends[1][1] = state;
    }
    let names = [
        (Element::mixed(2), TwoNodes::BYTES),
        (Element::mixed(4), FourNodes::BYTES),
    ];
    for (k, (element, bytes)) in names.into_iter().enumerate() {
        let per_step = |time: Duration| time.as_secs_f64() * 1e9 / STEPS as f64;
        let [a, b] = ends[k];
        let difference = (a.q[0] - b.q[0]).hypot(a.q[1] - b.q[1]);
        println!(
            "{:<12} {bytes:>8} {:>14.0} {:>14.0} {:>7.2} {difference:>10.0e}",
            element.to_string(),
            per_step(generic[k]),
            per_step(emitted[k]),
            emitted[k].as_secs_f64() / generic[k].as_secs_f64()
        );
        assert!(
            difference <= 1e-13,
            "the emitted solver must agree with the general stepper"
        );
    }
    Ok(())
}
