//! One rung: a model of the system, behind an interface without its type.

use crate::error::RunErrorKind;
use crate::work_precision::grid::Grid;
use crate::work_precision::measure::{Discretisation, advance};
use crate::work_precision::{PhasePoint, Subject};
use std::time::Duration;
use tfe_runtime::Statistics;

/// A model with its start.
pub(super) struct Scene<'m, M, S> {
    pub(super) model: &'m M,
    pub(super) start: S,
}

/// The outputs that are recorded in a run, and when.
#[derive(Clone, Copy, Debug)]
pub(super) struct Outputs<'c> {
    /// Their columns among the outputs of the model.
    pub(super) columns: &'c [usize],
    /// The number of equal parts of the span; every mesh has a whole number of steps in each.
    pub(super) parts: usize,
}

/// The record of a run.
#[derive(Clone, Debug)]
pub(super) struct Seen {
    /// A row at the start, and one at the end of each part.
    pub(super) rows: Vec<Vec<f64>>,
    /// The computing time of the steps.
    pub(super) time: Duration,
    pub(super) statistics: Statistics,
}

/// The interface of a rung. The timed loop itself is compiled for the type of the model.
pub(super) trait Runs {
    /// The names of the outputs.
    fn names(&self) -> Result<Vec<String>, RunErrorKind>;

    /// Refuses a start at which no run can begin.
    fn check_start(&self, grid: &Grid) -> Result<(), RunErrorKind>;

    /// Makes a run and records it; the clock is stopped while outputs are evaluated.
    fn look(&self, scheme: Discretisation<'_>, outputs: Outputs<'_>) -> Result<Seen, RunErrorKind>;

    /// Makes a run without recording it.
    fn time(&self, scheme: Discretisation<'_>) -> Result<Duration, RunErrorKind>;
}

impl<M: Subject<S>, S: PhasePoint> Scene<'_, M, S> {
    fn stepper(&self, scheme: Discretisation<'_>) -> Result<M::Stepper<'_>, RunErrorKind> {
        self.model.stepper(scheme.element, scheme.control)
    }
}

impl<M: Subject<S>, S: PhasePoint> Runs for Scene<'_, M, S> {
    fn names(&self) -> Result<Vec<String>, RunErrorKind> {
        self.model.output_names()
    }

    fn check_start(&self, grid: &Grid) -> Result<(), RunErrorKind> {
        let (t, next, h) = grid.element(0);
        self.model.check_start(&self.start, t..next, h)
    }

    fn look(&self, scheme: Discretisation<'_>, outputs: Outputs<'_>) -> Result<Seen, RunErrorKind> {
        let mut stepper = self.stepper(scheme)?;
        let (grid, mut state, mut time) = (scheme.grid, self.start.clone(), Duration::ZERO);
        let steps = grid.steps() / outputs.parts;
        let mut rows = Vec::with_capacity(outputs.parts + 1);
        for part in 0..=outputs.parts {
            let node = part * steps;
            let from = node.saturating_sub(steps);
            time += advance::<M, S>(&mut stepper, grid, from..node, &mut state)?;
            let all = self.model.outputs(&mut stepper, grid.node(node), &state);
            rows.push(outputs.columns.iter().map(|at| all[*at]).collect());
        }
        Ok(Seen {
            rows,
            time,
            statistics: M::statistics(&stepper),
        })
    }

    fn time(&self, scheme: Discretisation<'_>) -> Result<Duration, RunErrorKind> {
        let (grid, mut state) = (scheme.grid, self.start.clone());
        advance::<M, S>(
            &mut self.stepper(scheme)?,
            grid,
            0..grid.steps(),
            &mut state,
        )
    }
}
