//! The specification of a search, the runs that it makes, and its tuned constants.

use super::super::estimated::{Attempt, Picked};
use super::super::grading::Grading;
use super::super::trace::{Lost, Trace};
use crate::error::RunErrorKind;
use crate::numbers::larger;
use std::ops::{ControlFlow, Range};
use tfe_runtime::{Element, Solve, StepError};

/// The specification of a search.
#[derive(Clone, Debug)]
pub(crate) struct Asked {
    pub(crate) accuracy: f64,
    pub(crate) span: Range<f64>,
    /// The names of the outputs.
    pub(crate) outputs: Vec<String>,
    /// Times at which elements must end.
    pub(crate) breaks: Vec<f64>,
    /// The element, if it was chosen by the caller.
    pub(crate) element: Option<Element>,
    /// The longest step allowed.
    pub(crate) longest: Option<f64>,
    /// Whether steps can be solved by fixed-point iteration.
    pub(crate) may_iterate: bool,
    /// The solver for steps that are not.
    pub(crate) solve: Solve,
    /// The grading of steps; `None` for equal steps.
    pub(crate) graded: Option<Graded>,
    /// Whether runs are made in pairs of successive orders: if Newton's method solves all steps, and no event changes
    /// the motion.
    pub(crate) in_pairs: bool,
}

impl Asked {
    /// The tolerance of the iterations of a run of so many steps.
    pub(super) fn tolerance(&self, steps: f64) -> f64 {
        let tolerance = ITERATION * self.accuracy / steps.max(1.0);
        if self.accuracy > ROUGH {
            tolerance.max(1.1e-3 * ROUGH)
        } else {
            tolerance
        }
    }
}

/// The result of a pilot run.
#[derive(Clone, Debug)]
pub(crate) struct Graded {
    pub(crate) grading: Grading,
    /// The element to use with it.
    pub(crate) element: Element,
    /// An estimate of the factor.
    pub(crate) factor: f64,
}

/// The settings of one run.
#[derive(Clone, Debug)]
pub(crate) struct RunSettings<'a> {
    pub(crate) element: Element,
    pub(crate) tolerance: f64,
    /// Whether only the fixed-point iteration is used, so that a step without convergence fails.
    pub(crate) by_iteration: bool,
    /// The longest step, positive; with a grading, the factor.
    pub(crate) step: f64,
    /// The start, the times of comparison and the end. Between two of them steps are equal, in time or in s(t).
    pub(crate) cuts: &'a [f64],
    pub(crate) grading: Option<&'a Grading>,
    /// Whether the run is recorded, since it may be the result.
    pub(crate) keeps: bool,
}

/// The result of a run.
#[derive(Clone, Debug)]
pub(crate) struct Ran {
    pub(crate) trace: Trace,
    /// Whether the fixed-point iteration converged in every step. Steps are then short relative to all time scales of
    /// the model, and errors decrease with the order of the element.
    pub(crate) contracts: bool,
}

/// Makes the pilot run, given its first step; `None` if equal steps are as good.
pub(crate) type Pilot<'r> = dyn FnMut(f64) -> Option<Graded> + 'r;

/// Makes the runs of a search.
pub(crate) trait Runner {
    /// Makes one run.
    fn run(&mut self, settings: &RunSettings<'_>) -> Result<Ran, Failed>;
    /// Makes a recorded run, and beside it another one over the same steps, until `observer` ends both.
    fn run_pair(
        &mut self,
        settings: &RunSettings<'_>,
        better: &RunSettings<'_>,
        observer: &mut PairObserver<'_>,
    ) -> Result<PairRun, Failed>;
}

/// Called at every node that both runs have reached; the result says whether they continue.
pub(crate) type PairObserver<'j> = dyn FnMut(&PairComparison<'_>) -> ControlFlow<()> + 'j;

/// The comparison of two runs at a node.
pub(crate) struct PairComparison<'a> {
    pub(crate) time: f64,
    /// The largest difference of each kind.
    pub(crate) differences: &'a [f64],
    /// The largest magnitude of each kind so far.
    pub(crate) sizes: &'a [f64],
}

/// The result of two runs.
#[derive(Clone, Debug)]
pub(crate) struct PairRun {
    pub(crate) traces: [Trace; 2],
    /// The times of the nodes.
    pub(crate) times: Vec<f64>,
    /// Whether the end of the span was reached.
    pub(crate) is_complete: bool,
}

/// The failure of a run.
#[derive(Clone, Debug)]
pub(crate) struct Failed {
    pub(crate) kind: RunErrorKind,
    /// Whether runs fail there with every step size.
    pub(crate) is_final: bool,
}

impl Failed {
    /// Whether runs fail with every step size, judging by this failure and the previous one. A user function for an
    /// input that has failed twice will always fail; once may be a single point that other steps avoid.
    pub(crate) fn is_final_after(&self, before: Option<&RunErrorKind>) -> bool {
        let of_input = |kind: &RunErrorKind| matches!(kind, RunErrorKind::Input(_));
        self.is_final || of_input(&self.kind) && before.is_some_and(of_input)
    }

    /// Whether the failure is that the time does not resolve the step; this says nothing about the failure of longer
    /// steps.
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

/// The result of a search.
#[derive(Clone, Debug)]
pub(crate) struct Found {
    pub(crate) picked: Picked,
    pub(crate) times: Vec<f64>,
    /// A list for each kind, with an error for every time.
    pub(crate) errors: Vec<Vec<f64>>,
    /// Whether the accuracy is met.
    pub(crate) is_met: bool,
}

/// The error of the iterations, of all steps together, relative to the accuracy; it tends to have the same sign in
/// every step.
const ITERATION: f64 = 0.1;
/// The smallest tolerance of iterations.
pub(super) const TIGHTEST: f64 = 1e-17;
/// For accuracies above this, rounding errors do not matter, and compensated summation is not needed.
const ROUGH: f64 = 0.99e-11;
/// The ratio of the steps of the first and the second run; the first then costs two thirds of the second.
pub(super) const COARSER: f64 = 1.5;
/// If the error of a run exceeds this, comparing it with one of shorter steps is meaningless.
pub(super) const RESOLVED: f64 = 0.1;
/// The number of meaningless comparisons after which the search ends. Steps have become a hundred times shorter by
/// then, and their local errors smaller than rounding errors: the motion is chaotic.
pub(super) const MAX_UNRESOLVED: u32 = 5;
/// The largest number of runs over the whole span.
pub(super) const MAX_RUNS: usize = 14;
/// The largest number of runs that fail. Steps have become 200 000 times shorter by then.
pub(super) const MAX_FAILURES: usize = 24;
/// The largest number of steps of a run. The nodes of more would take gigabytes, and a search that asks for them has
/// errors that do not decrease with the order of its element.
pub(super) const MAX_STEPS: f64 = 1e7;
/// The number of steps between two times of comparison; large enough that the step size can be chosen finely.
pub(super) const STEPS_BETWEEN: f64 = 12.0;
pub(super) const MAX_TIMES: f64 = 64.0;
/// The limits of the factor between successive step sizes.
pub(super) const MIN_FACTOR: f64 = 0.4;
pub(super) const MAX_FACTOR: f64 = 0.87;
/// The first step that is tried is the span divided by this.
pub(super) const FIRST: f64 = 8.0;
/// If the run will have more steps than this, another probe is cheap.
pub(super) const MANY_TO_PROBE: f64 = 24.0;
/// Orders above this are high.
pub(super) const HIGH: f64 = 10.0;
/// The largest factor by which the error is assumed to decrease from one run to the next.
pub(super) const MAX_GAIN: f64 = 150.0;
/// The same if the iterations of both runs have about the same tolerance: their errors may have been amplified, and do
/// not decrease.
pub(super) const MAX_GAIN_MEASURED: f64 = 30.0;
/// Safety factor of the step: by the estimate, a step longer by this factor must suffice. Errors do not decrease
/// smoothly, for example if the steps near a pericentre are placed differently.
pub(super) const LONGER: f64 = 1.2;
/// The same if the order of convergence was measured.
pub(super) const LONGER_MEASURED: f64 = 1.1;
/// An allowance for iteration errors that two runs have in common, relative to the accuracy; it is added to estimates.
pub(super) const LEFT: f64 = 0.1;
/// Safety factor of the next step.
pub(super) const AIM: f64 = 1.13;
/// The ratio of two steps below which their runs are not compared.
pub(super) const SAME: f64 = 1.01;
/// Differences below this that do not decrease are rounding errors.
pub(super) const ROUNDINGS: f64 = 1e-6;

/// The result of runs with decreasing steps.
pub(super) enum Climbed {
    Found(Box<Found>),
    /// More steps would be needed than allowed.
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

/// Whether the failure occurs with every step size.
fn slides(kind: &RunErrorKind) -> bool {
    let source = StepError::Slides;
    matches!(kind, RunErrorKind::Solve { source: found, .. } if *found == source)
}

/// The largest error.
pub(super) fn largest(errors: &[Vec<f64>]) -> f64 {
    errors.iter().flatten().copied().fold(0.0, larger)
}

/// A runner that remembers why runs fail.
pub(super) struct Noting<'r> {
    runner: &'r mut dyn Runner,
    /// The first failure, or the first because the motion slides.
    failure: Option<RunErrorKind>,
    /// The output that was not finite in the last run, and the time.
    lost: Option<(Lost, f64)>,
}

impl<'r> Noting<'r> {
    pub(super) fn new(runner: &'r mut dyn Runner) -> Self {
        Self {
            runner,
            failure: None,
            lost: None,
        }
    }

    /// The result of a search. If no step is short enough, and an output of the last run is not finite, that is why.
    pub(super) fn concluded(
        self,
        found: Result<Found, RunErrorKind>,
        outputs: &[String],
    ) -> Result<Found, RunErrorKind> {
        let is_short_enough = match &found {
            Ok(found) => found.is_met || found.picked.error_estimate.is_finite(),
            Err(RunErrorKind::TooManySteps { .. }) => false,
            Err(_) => true,
        };
        match self.lost {
            Some((Lost { output, .. }, time)) if !is_short_enough => {
                Err(RunErrorKind::OutputNotFinite {
                    output: outputs.get(output).cloned().unwrap_or_default(),
                    time,
                })
            }
            _ => found.map_err(|error| self.explained(error)),
        }
    }

    fn note(&mut self, failed: &Failed) {
        let slid = |known: &RunErrorKind| slides(known) || !slides(&failed.kind);
        if !failed.is_unresolved() && !self.failure.as_ref().is_some_and(slid) {
            self.failure = Some(failed.kind.clone());
        }
    }

    /// The error of a search. Where steps below a rounding of the span would be needed, these are no steps of the
    /// motion: the state does not change in them, as where friction holds a body at rest. Why longer steps fail tells
    /// more.
    fn explained(self, error: RunErrorKind) -> RunErrorKind {
        match (error, self.failure) {
            (RunErrorKind::TooManySteps { span, step }, Some(failure))
                if step.abs() < f64::EPSILON * span.abs() =>
            {
                failure
            }
            (error, _) => error,
        }
    }
}

impl Runner for Noting<'_> {
    fn run(&mut self, settings: &RunSettings<'_>) -> Result<Ran, Failed> {
        let ran = self.runner.run(settings);
        if let Ok(ran) = &ran {
            let time = |lost: Lost| settings.cuts.get(1 + lost.row).copied();
            self.lost = ran
                .trace
                .lost()
                .map(|lost| (lost, time(lost).unwrap_or(f64::NAN)));
        }
        ran.inspect_err(|failed| self.note(failed))
    }

    fn run_pair(
        &mut self,
        settings: &RunSettings<'_>,
        better: &RunSettings<'_>,
        observer: &mut PairObserver<'_>,
    ) -> Result<PairRun, Failed> {
        let ran = self.runner.run_pair(settings, better, observer);
        if let Ok(ran) = &ran {
            let lost = ran.traces.iter().find_map(Trace::lost);
            let time = |lost: Lost| ran.times.get(lost.row).copied();
            self.lost = lost.map(|lost| (lost, time(lost).unwrap_or(f64::NAN)));
        }
        ran.inspect_err(|failed| self.note(failed))
    }
}

#[cfg(test)]
mod tests {
    use super::{
        Failed, Noting, PairObserver, PairRun, Ran, RunErrorKind, RunSettings, Runner, StepError,
    };
    use tfe_runtime::Element;

    /// Every run fails, those of steps below 1 because the motion slides.
    struct Failing;

    impl Runner for Failing {
        fn run(&mut self, settings: &RunSettings<'_>) -> Result<Ran, Failed> {
            Err(Failed::from(RunErrorKind::Solve {
                element: 0,
                time: 0.0,
                step: settings.step,
                source: match settings.step < 1.0 {
                    true => StepError::Slides,
                    false => StepError::TooManyKinks,
                },
            }))
        }

        fn run_pair(
            &mut self,
            settings: &RunSettings<'_>,
            _: &RunSettings<'_>,
            _: &mut PairObserver<'_>,
        ) -> Result<PairRun, Failed> {
            Err(self.run(settings).expect_err("all runs fail"))
        }
    }

    /// The error of a search that made runs with these steps and asks for one of `step` in a span of ten.
    fn explained(steps: &[f64], step: f64) -> RunErrorKind {
        let mut failing = Failing;
        let mut noting = Noting::new(&mut failing);
        for step in steps {
            let settings = RunSettings {
                element: Element::mixed(5),
                tolerance: 1e-9,
                by_iteration: false,
                step: *step,
                cuts: &[],
                grading: None,
                keeps: false,
            };
            assert!(noting.run(&settings).is_err());
        }
        noting.explained(RunErrorKind::TooManySteps { span: 10.0, step })
    }

    #[test]
    fn steps_below_a_rounding_of_the_span_are_explained_by_longer_ones() {
        let source = |kind| match kind {
            RunErrorKind::Solve { source, .. } => Some(source),
            _ => None,
        };
        let slides = Some(StepError::Slides);
        assert_eq!(source(explained(&[2.0, 0.5, 3.0], 4.8e-18)), slides);
        let kinks = Some(StepError::TooManyKinks);
        assert_eq!(source(explained(&[2.0, 3.0], 4.8e-18)), kinks);
        // Steps that the motion may need, or without a reason.
        assert_eq!(source(explained(&[2.0, 0.5], 1e-9)), None);
        assert_eq!(source(explained(&[], 4.8e-18)), None);
    }
}
