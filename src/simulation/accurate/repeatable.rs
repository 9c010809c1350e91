//! The interface between the search for an accuracy and the runs that it makes. The model and the number of its
//! coordinates are behind it, so that the search is compiled once, and not for every model.

use crate::accuracy::Trace;
use crate::error::RunErrorKind;
use crate::simulation::times::{AtEnds, Times};
use std::ops::ControlFlow;
use tfe_runtime::constrained::Trail;
use tfe_runtime::step::Control;
use tfe_runtime::{Element, Solve, Statistics, StepError};

/// The settings of a run that is made with other elements and steps. States are rows: coordinates, then momenta.
pub(super) struct Given<'r> {
    /// The element; the default if none was chosen.
    pub(super) element: Element,
    pub(super) control: Control,
    /// Whether progress is to be shown.
    pub(super) progress: bool,
    /// The number of coordinates.
    pub(super) coordinates: usize,
    /// The names of all outputs.
    pub(super) outputs: Vec<String>,
    /// The time and the state at the start.
    pub(super) start: (f64, Vec<f64>),
    pub(super) breaks: &'r [f64],
    /// The nodes that the caller gave.
    pub(super) nodes: Option<&'r [f64]>,
    /// Whether the model has constraints.
    pub(super) is_constrained: bool,
    /// Whether the run looks for events, which may cut elements.
    pub(super) has_events: bool,
    /// Whether steps may contain kinks or jumps of the force, so that the error may not fall with the order of the
    /// element.
    pub(super) crosses_kinks: bool,
}

impl Given<'_> {
    /// Elements of equal steps between given times.
    pub(super) fn even(
        &self,
        element: Element,
        cuts: &[f64],
        step: f64,
    ) -> Result<Times, RunErrorKind> {
        Ok(self.for_element(element, Times::even(cuts, step, self.breaks)?))
    }

    /// The elements between given nodes.
    pub(super) fn through(&self, element: Element, nodes: &[f64]) -> Result<Times, RunErrorKind> {
        Ok(self.for_element(element, Times::of_nodes(nodes, self.breaks)?))
    }

    fn for_element(&self, element: Element, times: Times) -> Times {
        times.with(AtEnds::of(element, self.is_constrained))
    }

    /// A trace without rows.
    pub(super) fn trace(&self) -> Trace {
        Trace::new(self.coordinates, self.outputs.len())
    }
}

/// A run that can be made with other elements and steps.
pub(super) trait Repeatable {
    fn given(&self) -> &Given<'_>;
    /// Creates a stepper at the start of the run; `true` if the polynomials inside its elements will be recorded.
    fn stepper(
        &self,
        element: Element,
        control: Control,
        is_recorded: bool,
    ) -> Result<Box<dyn Stepping + '_>, RunErrorKind>;
    /// The error of a run whose element could not be solved.
    fn failed(&self, element: usize, at: (f64, f64), source: StepError) -> RunErrorKind;
}

/// A stepper at a place that a run has reached.
pub(super) trait Arrived {
    /// Writes coordinates, momenta and outputs into one row.
    fn row(&mut self, row: &mut [f64]);
    /// Appends the last element to a trail, if the kind of model uses trails as first guesses.
    fn leave(&self, trail: &mut Trail);
    /// Takes the first guess for the next element, given by its start and length, from a trail.
    fn foresee(&mut self, trail: &Trail, step: (f64, f64));
}

/// A stepper with a state of its own, for the model as it was given, before any event.
pub(super) trait Stepping: Arrived {
    /// Places the stepper in a state.
    fn place(&mut self, t: f64, state: &[f64]);
    /// The state that is reached.
    fn state(&self) -> Vec<f64>;
    /// Solves one element of the mesh, given by its start, end and length.
    fn advance(&mut self, mesh: &Times, element: (f64, f64, f64)) -> Result<(), StepError>;
    /// Makes a run over a mesh from the start of the run, without regard to the own state; calls `passed` at the end of
    /// every element. If the motion `may_be_kept`, it replaces earlier ones; one that fails, only if there is none.
    fn record(
        &mut self,
        mesh: &Times,
        may_be_kept: bool,
        passed: &mut Passing<'_>,
    ) -> Result<(), RunErrorKind>;
    fn set_tolerance(&mut self, tolerance: f64);
    fn statistics(&self) -> Statistics;
    /// The work since the last call.
    fn take_statistics(&mut self) -> Statistics;
}

/// The end of an element of a recorded run.
pub(super) struct At<'a> {
    pub(super) t: f64,
    /// The number of events so far that have changed the motion.
    pub(super) acts: usize,
    pub(super) arrived: &'a mut dyn Arrived,
}

/// Called at the end of every element; the result says whether the run continues.
pub(super) type Passing<'a> = dyn FnMut(&mut At<'_>) -> ControlFlow<()> + 'a;

/// Turns off the checks of single steps: runs that are compared with more accurate ones need no other evidence. The
/// comparison detects a step with a wrong root, and a step cut in only one of the two runs would spoil it.
pub(super) fn trusting(control: Control) -> Control {
    let solve = match control.solve {
        Solve::Auto => Solve::Trusting,
        solve => solve,
    };
    Control { solve, ..control }
}
