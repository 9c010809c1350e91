//! Records the numbers by which runs are compared.

use super::repeatable::{Arrived, Repeatable, Stepping};
use crate::accuracy::Trace;
use crate::error::RunErrorKind;
use crate::simulation::progress::Bar;
use crate::simulation::times::Times;
use std::ops::ControlFlow;

/// The recorded numbers of a run.
pub(super) struct Watcher {
    pub(super) trace: Trace,
    /// Buffer for one row.
    pub(super) row: Vec<f64>,
}

impl Watcher {
    /// Creates a watcher that has recorded the start, at which the stepper is.
    pub(super) fn new(run: &dyn Repeatable, stepper: &mut dyn Stepping) -> Self {
        let trace = run.given().trace();
        let mut watcher = Self {
            row: vec![0.0; trace.width()],
            trace,
        };
        watcher.pass(stepper, 0, false);
        watcher
    }

    /// Records a place of the run, after a number of events; it becomes a row of the trace if `keeps`.
    pub(super) fn pass(&mut self, arrived: &mut (impl Arrived + ?Sized), acts: usize, keeps: bool) {
        arrived.row(&mut self.row);
        self.trace.pass(&self.row, acts, keeps);
    }
}

/// Why, when and in which state a run has failed.
pub(super) type Stop = Box<(RunErrorKind, f64, Vec<f64>)>;

/// Runs over a mesh with a stepper at the start, and keeps only the rows at `times`.
pub(super) fn follow(
    run: &dyn Repeatable,
    stepper: &mut dyn Stepping,
    mesh: &Times,
    times: &[f64],
) -> Result<Trace, Stop> {
    let given = run.given();
    let mut watcher = Watcher::new(run, stepper);
    let mut times = times.iter().peekable();
    if given.has_events {
        let passed = stepper.record(mesh, false, &mut |at| {
            let keeps = times.next_if_eq(&&at.t).is_some();
            watcher.pass(at.arrived, at.acts, keeps);
            ControlFlow::Continue(())
        });
        let (t0, start) = &given.start;
        return match passed {
            Ok(()) => Ok(watcher.trace),
            Err(kind) => Err(Box::new((kind, *t0, start.clone()))),
        };
    }
    let mut bar = Bar::new(given.progress, mesh.steps());
    for (element, (t, next, h)) in mesh.elements().enumerate() {
        if let Err(source) = stepper.advance(mesh, (t, next, h)) {
            let kind = run.failed(element, (t, h), source);
            return Err(Box::new((kind, t, stepper.state())));
        }
        let keeps = times.next_if_eq(&&next).is_some();
        watcher.pass(stepper, 0, keeps);
        bar.advance();
    }
    Ok(watcher.trace)
}
