//! Records the numbers by which runs are compared.

use super::repeatable::{At, Repeatable};
use crate::accuracy::Trace;
use crate::error::RunErrorKind;
use crate::simulation::mesh::Mesh;
use crate::simulation::progress::Bar;
use std::ops::ControlFlow;

/// The recorded numbers of a run.
pub(super) struct Watcher {
    pub(super) trace: Trace,
    /// Buffer for one row.
    pub(super) row: Vec<f64>,
}

impl Watcher {
    /// Creates a watcher that has recorded the start.
    pub(super) fn new<R: Repeatable<N>, const N: usize>(
        run: &R,
        stepper: &mut R::Stepper,
        (t, start): (f64, &R::State),
    ) -> Self {
        let trace = Trace::new(run.coordinates(), run.columns());
        let mut watcher = Self {
            row: vec![0.0; trace.width()],
            trace,
        };
        watcher.pass(run, stepper, &run.at(t, start), false);
        watcher
    }

    pub(super) fn pass<R: Repeatable<N>, const N: usize>(
        &mut self,
        run: &R,
        stepper: &mut R::Stepper,
        at: &At<'_, R::Model, R::State>,
        keeps: bool,
    ) {
        run.row(stepper, at, &mut self.row);
        self.trace.pass(&self.row, at.acts, keeps);
    }
}

/// Why, when and in which state a run has failed.
pub(super) type Stop<S> = (RunErrorKind, f64, S);

/// Runs over a mesh and keeps only the rows at `times`.
pub(super) fn follow<R: Repeatable<N>, const N: usize>(
    run: &R,
    stepper: &mut R::Stepper,
    (t0, start): (f64, &R::State),
    mesh: &Mesh<N>,
    times: &[f64],
) -> Result<Trace, Stop<R::State>> {
    let mut watcher = Watcher::new(run, stepper, (t0, start));
    let mut times = times.iter().peekable();
    if run.has_events() {
        let passed = run.record(stepper, mesh, (t0, start), &mut |stepper, at| {
            let keeps = times.next_if_eq(&&at.t).is_some();
            watcher.pass(run, stepper, at, keeps);
            ControlFlow::Continue(())
        });
        return match passed {
            Ok(_) => Ok(watcher.trace),
            Err(broken) => Err((broken.0, t0, start.clone())),
        };
    }
    let mut state = start.clone();
    let mut bar = Bar::new(run.progress(), mesh.steps());
    for (element, (t, next, h)) in mesh.elements().enumerate() {
        if let Err(source) = run.advance(stepper, (t, next, h), mesh, &mut state) {
            let kind = run.failed(element, (t, h), source);
            return Err((kind, t, state));
        }
        let keeps = times.next_if_eq(&&next).is_some();
        watcher.pass(run, stepper, &run.at(next, &state), keeps);
        bar.advance();
    }
    Ok(watcher.trace)
}
