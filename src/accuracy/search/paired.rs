//! Runs in pairs: two elements of successive orders over the same steps, abandoned as soon as their difference is too
//! large.
//!
//! If Newton's method solves every step, runs are expensive, and a step at the start of the motion says little about
//! the rest. There is no probe then, and no comparison of runs with different steps: two elements run side by side from
//! the first step on. Their difference is the error of the lower one (T-98), and steps that are too long, or much too
//! short, are detected during the run.

use super::super::estimated::{Attempt, Picked};
use super::super::pilot::corners;
use super::super::trace::difference;
use super::runs::{
    AIM, Asked, Climbed, FIRST, Found, MAX_RUNS, PairComparison, PairRun, RESOLVED, ROUNDINGS,
    RunSettings, Runner, TIGHTEST, largest, next,
};
use crate::error::RunErrorKind;
use crate::numbers::larger;
use std::ops::ControlFlow;
use tfe_runtime::{Element, Statistics};

/// Safety factor of the error, since the more accurate run has an error, too.
const SAFE: f64 = 1.1;
/// The largest accuracy aimed at: with a larger difference both elements may be wrong.
const LOOSEST: f64 = 0.01;
/// The tolerance of the more accurate run, relative to that of the other one, so that the comparison is not affected.
const SECOND_TOLERANCE: f64 = 0.01;
/// The fraction of the span after which a run is no longer abandoned for longer steps.
const EARLY: f64 = 0.35;
/// The fraction of the span before which a run is not yet abandoned for longer steps.
const NOT_EARLIER: f64 = 0.1;
/// The largest cost of a run with longer steps, relative to that of completing this one, for which it is abandoned.
const WORTH: f64 = 0.8;
/// The largest increase of the step at once.
const MAX_INCREASE: f64 = 3.0;
/// The largest reduction of the step at once.
const MAX_REDUCTION: f64 = 0.3;
/// The reduction of a step that failed, or whose difference is meaningless.
const FAILED: f64 = 0.5;
/// The smallest reduction of the step.
const MIN_REDUCTION: f64 = 0.87;
/// A run is abandoned if its error, extrapolated to the end of the span, exceeds the accuracy by this factor.
const FORESEEN: f64 = 4.0;
/// The fractions of the span from which on linear growth of the error, and growth with its measured power, are
/// extrapolated.
const FORESEEN_FROM: [f64; 2] = [0.1, 0.4];
/// The power of time with which errors are assumed to grow if it was not measured.
const GROWTH: f64 = 1.5;
/// The largest measured power that is trusted: for the next step size, and after a good part of the span.
const MAX_GROWTH: [f64; 2] = [2.0, 4.0];
/// Large reductions of the step are raised by this additional power: with long steps errors decrease more slowly than
/// their order says.
const EXTRAPOLATED: f64 = 0.1;
/// The largest number of attempts, including those abandoned early; so many halvings leave no step.
const MAX_ATTEMPTS: usize = 40;
/// The number of times that shorter steps have not reduced the difference, after which the search ends.
const MAX_FLOORS: u32 = 3;

/// The element for steps solved by Newton's method. The cost of a step grows faster than its number of points, so that
/// fewer points are best than with fixed-point iteration. On the mechanisms of `tests/constraints/small_steps.rs`
/// these, or those with one node less, are fastest in most cases.
pub(super) fn element_for(accuracy: f64) -> Element {
    let nodes = match accuracy {
        a if a > 3e-5 => 4,
        a if a > 3e-8 => 5,
        a if a > 3e-11 => 6,
        _ => 8,
    };
    Element::mixed(nodes)
}

/// The reason why a run was abandoned, with the factor of the next step.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Verdict {
    Shorter(f64),
    Longer(f64),
}

/// Judges two runs while they are made.
struct PairCriterion {
    accuracy: f64,
    order: f64,
    /// The largest increase of the step.
    max_increase: f64,
    /// Whether the run is completed in any case.
    is_last: bool,
    /// The largest magnitude of each kind over all runs.
    sizes: Vec<f64>,
    error: f64,
    /// The completed fraction of the span.
    done: f64,
    /// The completed fraction and the error, at every node so far.
    passed: Vec<(f64, f64)>,
}

impl PairCriterion {
    /// Returns a verdict if the error is or will be too large, or unnecessarily small.
    fn look(&mut self, done: f64, comparison: &PairComparison<'_>) -> Option<Verdict> {
        self.sizes.resize(comparison.sizes.len(), 0.0);
        let mut error = self.error;
        for ((size, now), differences) in self
            .sizes
            .iter_mut()
            .zip(comparison.sizes)
            .zip(comparison.differences)
        {
            *size = size.max(*now);
            if *differences != 0.0 {
                error = larger(error, differences / *size);
            }
        }
        (self.error, self.done) = (error, done);
        self.passed.push((done, error));
        if self.is_last {
            return None;
        }
        let [early, late] = FORESEEN_FROM;
        let foreseen = if done >= late {
            self.foreseen(MAX_GROWTH[1])
        } else if done >= early {
            error / done
        } else {
            0.0
        };
        if !(error <= self.accuracy && foreseen <= FORESEEN * self.accuracy) {
            return Some(Verdict::Shorter(self.shorter()));
        }
        // Quadratic growth is assumed, since the motion may be slow at the start.
        let end = larger(error, f64::EPSILON) / (done * done);
        let longer = (self.accuracy / end).powf(1.0 / self.order) / AIM;
        let longer = longer.min(self.max_increase);
        let is_early = (NOT_EARLIER..=EARLY).contains(&done);
        (is_early && 1.0 / longer < WORTH * (1.0 - done)).then_some(Verdict::Longer(longer))
    }

    /// The factor by which steps must be shorter.
    fn shorter(&self) -> f64 {
        if !(self.error <= RESOLVED) {
            return FAILED;
        }
        let factor = (self.accuracy / self.foreseen(MAX_GROWTH[0])).powf(1.0 / self.order);
        (factor.powf(1.0 + EXTRAPOLATED) / AIM).clamp(MAX_REDUCTION, MIN_REDUCTION)
    }

    /// Extrapolates the error to the end of the span, with the power of time by which it has grown; the power is
    /// limited to between 1 and `most`.
    fn foreseen(&self, most: f64) -> f64 {
        let Self { error, done, .. } = *self;
        let half = self.passed.partition_point(|(then, _)| *then < 0.5 * done);
        let Some(&(then, before)) = self.passed.get(half).filter(|(then, _)| *then < done) else {
            return error * done.powf(-GROWTH);
        };
        let power = (error / before).ln() / (done / then).ln();
        // If the error was zero or NaN.
        let power = if power.is_finite() {
            power.clamp(1.0, most)
        } else {
            GROWTH
        };
        error * done.powf(-power)
    }
}

/// Makes runs in pairs until one meets the accuracy.
///
/// # Errors
/// A failure that does not depend on the step size.
pub(super) fn climb(
    asked: &Asked,
    settings: RunSettings<'_>,
    run: &mut dyn Runner,
    most_steps: f64,
) -> Result<Option<Climbed>, RunErrorKind> {
    let Some(better) = next(settings.element) else {
        return Ok(None);
    };
    let mut cuts = vec![asked.span.start];
    cuts.extend(corners(&asked.span, &asked.breaks));
    let mut search = PairSearch::new(
        asked,
        RunSettings {
            cuts: &cuts,
            keeps: true,
            ..settings
        },
    );
    for _ in 0..MAX_ATTEMPTS {
        let step = search.settings.step;
        if search.length / step > most_steps {
            let attempts = search.attempts;
            return Ok(Some(Climbed::TooMany { attempts, step }));
        }
        search.begin();
        if search.attempt(better, run)?.is_break() {
            break;
        }
    }
    search.found().map(Some)
}

/// The search for the step with which the lower of two elements meets the accuracy.
struct PairSearch<'a> {
    asked: &'a Asked,
    /// The settings of the next run.
    settings: RunSettings<'a>,
    /// The length of the span, and the longest step.
    length: f64,
    longest: f64,
    /// The shortest step that was too long.
    too_long: f64,
    attempts: Vec<Attempt>,
    criterion: PairCriterion,
    /// The failure of the last run that failed.
    failure: Option<RunErrorKind>,
    /// Times and errors of the last run that was completed, and whether it meets the accuracy.
    completed: Option<(Vec<f64>, Vec<Vec<f64>>, bool)>,
    /// The extrapolated error of the previous run, which had longer steps.
    before: Option<f64>,
    /// How often shorter steps have not reduced the difference, and by what tolerances were reduced for that reason.
    floors: u32,
    tightened: f64,
    /// The number of runs that were not abandoned early.
    runs: usize,
}

impl<'a> PairSearch<'a> {
    fn new(asked: &'a Asked, mut settings: RunSettings<'a>) -> Self {
        let (length, longest) = settings.lengths(asked);
        settings.step = longest.min(length / FIRST);
        Self {
            asked,
            length,
            longest,
            too_long: f64::INFINITY,
            attempts: Vec::new(),
            criterion: PairCriterion {
                accuracy: (asked.accuracy / SAFE).min(LOOSEST),
                order: settings.element.order() as f64,
                max_increase: 1.0,
                is_last: false,
                sizes: Vec::new(),
                error: 0.0,
                done: 0.0,
                passed: Vec::new(),
            },
            settings,
            failure: None,
            completed: None,
            before: None,
            floors: 0,
            tightened: 1.0,
            runs: 0,
        }
    }

    /// Prepares the criterion and the tolerance for the next run.
    fn begin(&mut self) {
        let step = self.settings.step;
        let criterion = &mut self.criterion;
        // A run that was abandoned early does not count.
        self.runs += usize::from(criterion.done >= NOT_EARLIER);
        criterion.is_last = self.runs + 1 >= MAX_RUNS || self.floors == MAX_FLOORS;
        // At most the geometric mean with the shortest step that was too long.
        criterion.max_increase =
            (MAX_INCREASE.min(self.longest / step)).min((self.too_long / step).sqrt());
        (criterion.error, criterion.done) = (0.0, 0.0);
        criterion.passed.clear();
        let tolerance = self.tightened * self.asked.tolerance(self.length / step);
        self.settings.tolerance = tolerance.max(TIGHTEST);
    }

    /// Makes a run, and chooses the step of the next one unless the search ends with this one.
    ///
    /// # Errors
    /// A failure that does not depend on the step size.
    fn attempt(
        &mut self,
        better: Element,
        run: &mut dyn Runner,
    ) -> Result<ControlFlow<()>, RunErrorKind> {
        let Self {
            asked,
            settings,
            criterion,
            ..
        } = self;
        let second = RunSettings {
            element: better,
            tolerance: (SECOND_TOLERANCE * settings.tolerance).max(TIGHTEST),
            ..settings.clone()
        };
        let (taken, length) = (settings.taken(), self.length);
        let mut verdict = None;
        let ran = run.run_pair(settings, &second, &mut |comparison| {
            let done = settings.between(asked.span.start, comparison.time) / length;
            verdict = criterion.look(done, comparison);
            match verdict {
                Some(_) => ControlFlow::Break(()),
                None => ControlFlow::Continue(()),
            }
        });
        let mut told = Attempt {
            step: taken,
            error_estimate: None,
        };
        let ran = match ran {
            Err(failed) if failed.is_final_after(self.failure.as_ref()) => return Err(failed.kind),
            Err(failed) if self.failure.is_some() && failed.is_unresolved() => {
                return Ok(ControlFlow::Break(()));
            }
            Err(failed) => {
                self.attempts.push(told);
                self.failure = Some(failed.kind);
                self.shorten(FAILED, taken);
                return Ok(ControlFlow::Continue(()));
            }
            Ok(ran) => ran,
        };
        let is_complete = ran.is_complete && verdict.is_none();
        told.error_estimate = Some(if is_complete {
            self.complete(ran)
        } else {
            self.criterion.error
        });
        self.attempts.push(told);
        let error = told.error_estimate.unwrap_or(f64::NAN);
        let is_enough = error <= self.criterion.accuracy || self.criterion.is_last;
        if is_complete && !is_enough {
            verdict = Some(Verdict::Shorter(self.criterion.shorter()));
        }
        Ok(self.follow(verdict, taken))
    }

    /// Keeps the errors of a run that was completed; returns the largest one.
    fn complete(&mut self, ran: PairRun) -> f64 {
        let [first, second] = &ran.traces;
        let errors = difference(first, second);
        let error = largest(&errors);
        let is_met = error <= self.asked.accuracy / SAFE;
        self.completed = Some((ran.times, errors, is_met));
        error
    }

    /// Changes the step as a verdict says; without one the search ends.
    fn follow(&mut self, verdict: Option<Verdict>, taken: f64) -> ControlFlow<()> {
        match verdict {
            Some(Verdict::Longer(factor)) => {
                self.settings.step = (factor * taken).min(self.longest);
            }
            Some(Verdict::Shorter(factor)) => {
                let foreseen = self.criterion.foreseen(MAX_GROWTH[0]);
                let is_floor = self.before.is_some_and(|before| foreseen > 0.5 * before);
                if is_floor && self.criterion.error < ROUNDINGS {
                    self.floors += 1;
                    self.tightened *= 1e-2;
                }
                self.before = Some(foreseen);
                self.shorten(factor, taken);
            }
            None => return ControlFlow::Break(()),
        }
        ControlFlow::Continue(())
    }

    /// Makes the next step shorter than the one taken by a factor.
    fn shorten(&mut self, factor: f64, taken: f64) {
        self.too_long = taken;
        self.settings.step = factor * taken;
    }

    /// The last run that was completed.
    ///
    /// # Errors
    /// The failure of the last run, if none was completed.
    fn found(self) -> Result<Climbed, RunErrorKind> {
        let Self {
            asked,
            mut settings,
            mut attempts,
            completed,
            failure,
            ..
        } = self;
        let Some((times, errors, is_met)) = completed else {
            let step = settings.step;
            let span = asked.span.end - asked.span.start;
            return Err(failure.unwrap_or(RunErrorKind::TooManySteps { span, step }));
        };
        let extremes = settings.measure(&mut attempts);
        Ok(Climbed::Found(Box::new(Found {
            is_met,
            picked: Picked {
                element: settings.element,
                step: extremes.1,
                shortest: extremes.0,
                tolerance: settings.tolerance,
                solve: asked.solve,
                accuracy: asked.accuracy,
                error_estimate: largest(&errors),
                attempts,
                work: Statistics::NONE,
            },
            times,
            errors,
        })))
    }
}
