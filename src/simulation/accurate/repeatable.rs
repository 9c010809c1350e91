//! What a search asks of a run.

use crate::error::RunErrorKind;
use crate::simulation::mesh::Mesh;
use std::ops::ControlFlow;
use tfe_runtime::constrained::Trail;
use tfe_runtime::step::Control;
use tfe_runtime::{Element, Solve, Statistics, StepError};

/// A place of a run.
pub(crate) struct At<'a, M, S> {
    /// With the parameters that hold there.
    pub(crate) model: &'a M,
    pub(crate) t: f64,
    pub(crate) state: &'a S,
    /// How many events have changed the motion so far.
    pub(crate) acts: usize,
}

/// A run that can be made with other elements and steps.
pub(crate) trait Repeatable<const N: usize> {
    type Model;
    type State: Clone;
    type Stepper;
    type Motion;

    /// The element; the default one where none was chosen.
    fn element(&self) -> Element;
    fn control(&self) -> Control;
    /// Whether progress is to be shown.
    fn progress(&self) -> bool;
    fn coordinates(&self) -> usize;
    /// How many outputs there are.
    fn columns(&self) -> usize;
    /// The names of all outputs.
    fn outputs(&self) -> Vec<String>;
    /// A stepper; the inside of its steps is asked for only if they are to be recorded.
    fn stepper(
        &self,
        element: Element,
        control: Control,
        is_recorded: bool,
    ) -> Result<Self::Stepper, RunErrorKind>;
    /// One element of the mesh: its start, end and length.
    fn advance(
        &self,
        stepper: &mut Self::Stepper,
        element: (f64, f64, f64),
        mesh: &Mesh<N>,
        state: &mut Self::State,
    ) -> Result<(), StepError>;
    /// Adds the last element of a stepper to a trail, where that is of use.
    fn leave(stepper: &Self::Stepper, trail: &mut Trail);
    /// Has an element of a stepper, its start and length, start from what a trail says.
    fn foresee(stepper: &mut Self::Stepper, trail: &Trail, step: (f64, f64));
    /// Why an element could not be solved.
    fn failed(&self, element: usize, at: (f64, f64), source: StepError) -> RunErrorKind;
    fn set_tolerance(stepper: &mut Self::Stepper, tolerance: f64);
    fn statistics(stepper: &Self::Stepper) -> Statistics;
    /// The same since the last call.
    fn take_statistics(stepper: &mut Self::Stepper) -> Statistics;
    /// The model as it was given.
    fn model(&self) -> &Self::Model;
    /// A place before which no event has changed anything.
    fn at<'a>(&'a self, t: f64, state: &'a Self::State) -> At<'a, Self::Model, Self::State> {
        At {
            model: self.model(),
            t,
            state,
            acts: 0,
        }
    }
    /// Coordinates, momenta and outputs, one after the other. The stepper has the model of the place.
    fn row(
        &self,
        stepper: &mut Self::Stepper,
        at: &At<'_, Self::Model, Self::State>,
        row: &mut [f64],
    );
    /// The steps of a mesh as motion; every end of an element is shown to `passed`.
    fn record(
        &self,
        stepper: &mut Self::Stepper,
        mesh: &Mesh<N>,
        start: (f64, &Self::State),
        passed: &mut Passing<'_, Self::Model, Self::Stepper, Self::State>,
    ) -> Result<Self::Motion, Broken<Self::Motion>>;
    /// Whether the run looks for events, so that elements alone do not make it.
    fn has_events(&self) -> bool;
    /// Whether steps go across kinks or jumps of forces, so that errors need not fall with the order of the element.
    fn crosses_kinks(&self) -> bool;
    /// A motion of the start and one other state.
    fn part(&self, start: (f64, &Self::State), end: (f64, &Self::State)) -> Self::Motion;
    /// A mesh of equal parts between times.
    fn even(&self, cuts: &[f64], step: f64) -> Result<Mesh<N>, RunErrorKind>;
    /// A mesh of given nodes.
    fn through(&self, nodes: &[f64]) -> Result<Mesh<N>, RunErrorKind>;
    /// The nodes that were given.
    fn nodes(&self) -> Option<&[f64]>;
}

/// Is shown the end of every element, with the stepper. Says whether the run goes on.
pub(crate) type Passing<'a, M, T, S> = dyn FnMut(&mut T, &At<'_, M, S>) -> ControlFlow<()> + 'a;

/// Why a recorded run has stopped, and what there is of it.
pub(crate) type Broken<T> = Box<(RunErrorKind, T)>;

/// Runs that are compared with better ones need no other evidence: a step with another root is told by the comparison, and one that was cut on one side alone would
/// spoil it.
pub(super) fn trusting(control: Control) -> Control {
    let solve = match control.solve {
        Solve::Auto => Solve::Trusting,
        solve => solve,
    };
    Control { solve, ..control }
}
