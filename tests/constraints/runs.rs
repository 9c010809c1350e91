//! Helpers: runs that must not fail, and their errors.

use crate::common::{distance, larger};
use tfe::RunError;
use tfe::prelude::*;

/// The motion from `start` over `0..time`.
#[track_caller]
pub fn run<M: Model<N>, const N: usize>(
    model: &M,
    element: impl Into<Element>,
    step: f64,
    start: State<N>,
    time: f64,
) -> Motion<N> {
    let element = element.into();
    let run = Simulation::new(model).element(element).step(step);
    made(run.run(start, 0.0..time), (element, step))
}

/// The motion of a run that must not fail.
#[track_caller]
fn made<const N: usize>(
    run: Result<Motion<N>, RunError<N>>,
    (element, step): (Element, f64),
) -> Motion<N> {
    run.unwrap_or_else(|error| panic!("{element}, h = {step}: {error}"))
}

/// The velocities at the last node.
pub fn last_velocities<const N: usize>(motion: &Motion<N>) -> [f64; N] {
    *motion
        .velocities()
        .last()
        .expect("a motion has its start at least")
}

/// The largest difference of coordinates and of momenta over corresponding nodes.
pub fn differences<const N: usize>(one: &Motion<N>, other: &Motion<N>) -> (f64, f64) {
    assert_eq!(one.states().len(), other.states().len());
    one.states()
        .iter()
        .zip(other.states())
        .fold((0.0, 0.0), |(q, p): (f64, f64), (a, b)| {
            (
                larger(q, distance(&a.q, &b.q)),
                larger(p, distance(&a.p, &b.p)),
            )
        })
}
