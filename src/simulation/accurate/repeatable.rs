//! The interface between the search for an accuracy and the runs that it makes.

use crate::error::RunErrorKind;
use crate::simulation::mesh::Mesh;
use std::ops::ControlFlow;
use tfe_runtime::constrained::Trail;
use tfe_runtime::step::Control;
use tfe_runtime::{Element, Solve, Statistics, StepError};

/// The situation at a time of a run.
pub(crate) struct At<'a, M, S> {
    /// The model with its parameters at this time.
    pub(crate) model: &'a M,
    pub(crate) t: f64,
    pub(crate) state: &'a S,
    /// The number of events so far that have changed the motion.
    pub(crate) acts: usize,
}

/// A run that can be made with other elements and steps.
pub(crate) trait Repeatable<const N: usize> {
    type Model;
    type State: Clone;
    type Stepper;
    type Motion;

    /// Whether the steps of a run with an accuracy may vary; if not, nothing that grades them is compiled.
    const MAY_VARY: bool;

    /// The element; the default if none was chosen.
    fn element(&self) -> Element;
    fn control(&self) -> Control;
    /// Whether progress is to be shown.
    fn progress(&self) -> bool;
    fn coordinates(&self) -> usize;
    /// The number of outputs.
    fn columns(&self) -> usize;
    /// The names of all outputs.
    fn outputs(&self) -> Vec<String>;
    /// Creates a stepper; `true` if the polynomials inside its elements will be recorded.
    fn stepper(
        &self,
        element: Element,
        control: Control,
        is_recorded: bool,
    ) -> Result<Self::Stepper, RunErrorKind>;
    /// Solves one element of the mesh, given by its start, end and length.
    fn advance(
        &self,
        stepper: &mut Self::Stepper,
        element: (f64, f64, f64),
        mesh: &Mesh<N>,
        state: &mut Self::State,
    ) -> Result<(), StepError>;
    /// Appends the last element of a stepper to a trail, if the kind of model uses trails as first guesses.
    fn leave(stepper: &Self::Stepper, trail: &mut Trail);
    /// Takes the first guess for the next element, given by its start and length, from a trail.
    fn foresee(stepper: &mut Self::Stepper, trail: &Trail, step: (f64, f64));
    /// The error of a run whose element could not be solved.
    fn failed(&self, element: usize, at: (f64, f64), source: StepError) -> RunErrorKind;
    fn set_tolerance(stepper: &mut Self::Stepper, tolerance: f64);
    fn statistics(stepper: &Self::Stepper) -> Statistics;
    /// The work of a stepper since the last call.
    fn take_statistics(stepper: &mut Self::Stepper) -> Statistics;
    /// The model as it was given, before any event.
    fn model(&self) -> &Self::Model;
    /// The situation at a time before any event.
    fn at<'a>(&'a self, t: f64, state: &'a Self::State) -> At<'a, Self::Model, Self::State> {
        At {
            model: self.model(),
            t,
            state,
            acts: 0,
        }
    }
    /// Writes coordinates, momenta and outputs into one row. The model is that of `at`, as in the stepper.
    fn row(
        &self,
        stepper: &mut Self::Stepper,
        at: &At<'_, Self::Model, Self::State>,
        row: &mut [f64],
    );
    /// Runs over a mesh and returns the motion; calls `passed` at the end of every element.
    fn record(
        &self,
        stepper: &mut Self::Stepper,
        mesh: &Mesh<N>,
        start: (f64, &Self::State),
        passed: &mut Passing<'_, Self::Model, Self::Stepper, Self::State>,
    ) -> Result<Self::Motion, Broken<Self::Motion>>;
    /// Whether the run looks for events, which may cut elements.
    fn has_events(&self) -> bool;
    /// Whether steps may contain kinks or jumps of the force, so that the error may not fall with the order of the
    /// element.
    fn crosses_kinks(&self) -> bool;
    /// A motion of only two states, for a run that failed.
    fn part(&self, start: (f64, &Self::State), end: (f64, &Self::State)) -> Self::Motion;
    /// A mesh of equal steps between given times.
    fn even(&self, cuts: &[f64], step: f64) -> Result<Mesh<N>, RunErrorKind>;
    /// A mesh of given nodes.
    fn through(&self, nodes: &[f64]) -> Result<Mesh<N>, RunErrorKind>;
    /// The nodes that the caller gave.
    fn nodes(&self) -> Option<&[f64]>;
}

/// Called at the end of every element with the stepper; the result says whether the run continues.
pub(crate) type Passing<'a, M, T, S> = dyn FnMut(&mut T, &At<'_, M, S>) -> ControlFlow<()> + 'a;

/// The error of a recorded run, with the motion up to there.
pub(crate) type Broken<T> = Box<(RunErrorKind, T)>;

/// Turns off the checks of single steps: runs that are compared with more accurate ones need no other evidence. The
/// comparison detects a step with a wrong root, and a step cut in only one of the two runs would spoil it.
pub(super) fn trusting(control: Control) -> Control {
    let solve = match control.solve {
        Solve::Auto => Solve::Trusting,
        solve => solve,
    };
    Control { solve, ..control }
}
