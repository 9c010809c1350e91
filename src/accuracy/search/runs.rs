//! What a search is asked for, the runs that it makes, and what all of it goes by.

use super::super::estimated::{Attempt, Picked};
use super::super::grading::Grading;
use super::super::trace::Trace;
use crate::error::RunErrorKind;
use crate::numbers::larger;
use std::ops::{ControlFlow, Range};
use tfe_runtime::{Element, Solve, StepError};

/// What is asked of a run.
#[derive(Clone, Debug)]
pub(crate) struct Asked {
    pub(crate) accuracy: f64,
    pub(crate) span: Range<f64>,
    /// Times at which elements have to end.
    pub(crate) breaks: Vec<f64>,
    /// The element, where it is not to be picked.
    pub(crate) element: Option<Element>,
    /// The longest step allowed.
    pub(crate) longest: Option<f64>,
    /// Whether there is a fixed-point iteration.
    pub(crate) may_iterate: bool,
    /// How elements are solved where it is not.
    pub(crate) solve: Solve,
    /// Where steps are to be long and where short; equal steps without it.
    pub(crate) graded: Option<Graded>,
    /// Whether every run goes beside one of the next order from its start: where Newton's method makes all steps, and no event changes the motion.
    pub(crate) in_pairs: bool,
}

impl Asked {
    /// What the iteration of each of so many steps may leave.
    pub(super) fn tolerance(&self, steps: f64) -> f64 {
        let tolerance = ITERATION * self.accuracy / steps.max(1.0);
        if self.accuracy > ROUGH {
            tolerance.max(1.1e-3 * ROUGH)
        } else {
            tolerance
        }
    }
}

/// What a pilot run has found.
#[derive(Clone, Debug)]
pub(crate) struct Graded {
    pub(crate) grading: Grading,
    /// The element for it.
    pub(crate) element: Element,
    /// A factor that is near.
    pub(crate) factor: f64,
}

/// One way to run.
#[derive(Clone, Debug)]
pub(crate) struct Way<'a> {
    pub(crate) element: Element,
    pub(crate) tolerance: f64,
    /// Whether a step that does not contract counts as one that fails.
    pub(crate) by_iteration: bool,
    /// The longest step, positive; with a grading its factor.
    pub(crate) step: f64,
    /// Start, times of comparison, end; between two of them steps are equal, or equal parts of the grading.
    pub(crate) cuts: &'a [f64],
    pub(crate) grading: Option<&'a Grading>,
    /// Whether it may be the motion that is asked for.
    pub(crate) keeps: bool,
}

/// What has come of a run.
#[derive(Clone, Debug)]
pub(crate) struct Ran {
    pub(crate) trace: Trace,
    /// Whether a fixed-point iteration contracted in every step. Then steps are short beside all times of the model, and errors fall with the order of the element.
    pub(crate) contracts: bool,
}

/// What looks where steps have to be short, given the first one that it tries; nothing where equal steps are as good.
pub(crate) type Pilot<'r> = dyn FnMut(f64) -> Option<Graded> + 'r;

/// What makes runs.
pub(crate) trait Runner {
    /// One run.
    fn run(&mut self, way: &Way<'_>) -> Result<Ran, Failed>;
    /// A run that may be the motion that is asked for, and beside it another one over the same steps, until `judge` has seen enough.
    fn run_beside(
        &mut self,
        way: &Way<'_>,
        better: &Way<'_>,
        judge: &mut Judge<'_>,
    ) -> Result<RanBeside, Failed>;
}

/// Is shown every node that two runs have reached; says whether they go on.
pub(crate) type Judge<'j> = dyn FnMut(&Beside<'_>) -> ControlFlow<()> + 'j;

/// Where two runs are.
pub(crate) struct Beside<'a> {
    pub(crate) time: f64,
    /// How far they are apart, of each kind.
    pub(crate) apart: &'a [f64],
    /// The largest number of each kind so far.
    pub(crate) sizes: &'a [f64],
}

/// What has come of two runs.
#[derive(Clone, Debug)]
pub(crate) struct RanBeside {
    pub(crate) traces: [Trace; 2],
    /// The nodes.
    pub(crate) times: Vec<f64>,
    /// Whether they have gone to their end.
    pub(crate) is_complete: bool,
}

/// Why a run has stopped.
#[derive(Clone, Debug)]
pub(crate) struct Failed {
    pub(crate) kind: RunErrorKind,
    /// Whether steps of any length stop there.
    pub(crate) is_final: bool,
}

impl Failed {
    /// Whether steps of any length stop there, as far as this failure and the last one before it tell: a function given for an input that has failed twice does so whatever the steps. Once may
    /// be a single point, which other steps do not meet.
    pub(crate) fn is_final_after(&self, before: Option<&RunErrorKind>) -> bool {
        let of_input = |kind: &RunErrorKind| matches!(kind, RunErrorKind::Input(_));
        self.is_final || of_input(&self.kind) && before.is_some_and(of_input)
    }

    /// Whether the time has not the digits for the step: that says nothing of why longer ones have failed.
    pub(super) fn is_unresolved(&self) -> bool {
        matches!(
            self.kind,
            RunErrorKind::StepUnresolved { .. } | RunErrorKind::TooManySteps { .. }
        )
    }
}

impl From<RunErrorKind> for Failed {
    fn from(kind: RunErrorKind) -> Self {
        let is_final = slides(&kind);
        Self { kind, is_final }
    }
}

/// What a search has found.
#[derive(Clone, Debug)]
pub(crate) struct Found {
    pub(crate) picked: Picked,
    pub(crate) times: Vec<f64>,
    /// Of each kind at each time.
    pub(crate) errors: Vec<Vec<f64>>,
    /// Whether the accuracy is met.
    pub(crate) is_met: bool,
}

/// What errors of the iteration may be of what is asked, all steps together: what they leave has the same sign in step after step.
const ITERATION: f64 = 0.1;
/// Iterations do not end earlier with less.
pub(super) const TIGHTEST: f64 = 1e-17;
/// Above it roundings do not show, and what they take needs not be carried along.
const ROUGH: f64 = 0.99e-11;
/// A first step longer than the second one by this factor costs two thirds of it.
pub(super) const COARSER: f64 = 1.5;
/// A comparison with a run of an error above this says nothing about one with shorter steps.
pub(super) const RESOLVED: f64 = 0.1;
/// Steps have become a hundred times shorter then, and errors of each step less than a rounding: it is the motion that lets them grow.
pub(super) const MOST_UNRESOLVED: u32 = 5;
/// Runs over the whole span.
pub(super) const MOST_RUNS: usize = 14;
/// Steps of a run: the nodes of more would take gigabytes, and a search that asks for them meets errors that do not fall with the order of its element.
pub(super) const MOST_STEPS: f64 = 1e7;
/// Steps between two times of comparison: so many that steps can be chosen finely.
pub(super) const STEPS_BETWEEN: f64 = 12.0;
pub(super) const MOST_TIMES: f64 = 64.0;
/// How much shorter the next step may be, and has to be.
pub(super) const LEAST_FACTOR: f64 = 0.4;
pub(super) const MOST_FACTOR: f64 = 0.87;
/// The first step that is tried is this part of the span.
pub(super) const FIRST: f64 = 8.0;
/// Where steps will be more than this, another probe is cheap.
pub(super) const MANY_TO_PROBE: f64 = 24.0;
/// An order is high above it.
pub(super) const HIGH: f64 = 10.0;
/// However much shorter the second step, errors are not believed to fall by more.
pub(super) const MOST_GAIN: f64 = 150.0;
/// The same where iterations of both runs end nearly alike: what they leave may have grown, and does not fall at all.
pub(super) const MOST_GAIN_MEASURED: f64 = 30.0;
/// Errors do not fall smoothly where steps meet a pericentre now here, now there: by the estimate, steps longer by this factor have to be enough too.
pub(super) const LONGER: f64 = 1.2;
/// The same where it was measured how errors fall with the step.
pub(super) const LONGER_MEASURED: f64 = 1.1;
/// What is added to estimates for what iterations leave, which two runs have in common: relative to what is asked.
pub(super) const LEFT: f64 = 0.1;
/// The next step aims a little beyond that.
pub(super) const AIM: f64 = 1.13;
/// Steps that differ by less tell nothing.
pub(super) const SAME: f64 = 1.01;
/// Differences below it that do not fall are of roundings.
pub(super) const ROUNDINGS: f64 = 1e-6;

/// What has come of runs with shorter and shorter steps.
pub(super) enum Climbed {
    Found(Box<Found>),
    /// Steps would be more than they were allowed to be.
    TooMany {
        attempts: Vec<Attempt>,
        step: f64,
    },
}

/// The element of the next higher order of the same kind, if there is one.
pub(crate) fn next(element: Element) -> Option<Element> {
    let nodes = element.nodes() + 1;
    let same = if element == Element::radau(element.nodes()) {
        Element::radau(nodes)
    } else {
        Element::mixed(nodes)
    };
    same.validate().is_ok().then_some(same)
}

/// Whether steps of any length fail.
fn slides(kind: &RunErrorKind) -> bool {
    let source = StepError::Slides;
    matches!(kind, RunErrorKind::Solve { source: found, .. } if *found == source)
}

/// The largest of all.
pub(super) fn largest(errors: &[Vec<f64>]) -> f64 {
    errors.iter().flatten().copied().fold(0.0, larger)
}
