//! The reference with which runs are compared.

use super::error::WorkPrecisionError;
use super::grid::Grid;
use super::subject::{PhasePoint, Subject};
use crate::error::RunErrorKind;
use crate::motion::is_same_time;
use crate::numbers::{Short, distance, larger, norm};
use std::fmt;
use tfe_runtime::step::Control;
use tfe_runtime::{Element, Mixed, Solve};

/// The reference of a comparison: how it was found, and how accurate it is.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Reference {
    /// It was given by the caller.
    Given {
        /// Its relative error, as given by the caller, but at least the rounding unit 2⁻⁵².
        uncertainty: f64,
    },
    /// It is a run with short steps, checked against one with steps twice as long.
    Computed {
        /// The element.
        element: Element,
        /// The longest step of the finer run, in units of time. Other steps are shorter, because the run has nodes at
        /// all times at which runs are compared.
        step: f64,
        /// The estimated relative error: the difference of both runs at the end of the span, the larger one of
        /// coordinates (divided by the largest |q|) and momenta (divided by the largest |p|), but at least the rounding
        /// unit or the value given by the caller.
        uncertainty: f64,
    },
}

impl Reference {
    /// The relative error of the reference at the end of the span. Smaller errors of runs cannot be measured.
    pub fn uncertainty(&self) -> f64 {
        match self {
            Self::Given { uncertainty } | Self::Computed { uncertainty, .. } => *uncertainty,
        }
    }
}

impl fmt::Display for Reference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Given { uncertainty } => {
                write!(f, "given values, known to {uncertainty:.1e}")
            }
            Self::Computed {
                element,
                step,
                uncertainty,
            } => write!(
                f,
                "`{element}` with steps of at most {step}, known to {uncertainty:.1e} (the difference from twice the step)",
                step = Short(*step)
            ),
        }
    }
}

/// The exact state at a time.
type Function<'m, S> = dyn Fn(f64) -> S + 'm;

/// The source of the reference.
pub(super) enum Source<'m, S> {
    Computed,
    End(S),
    Function(Box<Function<'m, S>>),
}

/// The reference at all times at which runs are compared with it.
pub(super) struct Known<S> {
    /// In the order of time.
    states: Vec<(f64, S)>,
    scale: Scale,
    summary: Reference,
}

/// The largest |q| and |p| of a motion.
#[derive(Clone, Copy, Debug)]
struct Scale {
    q: f64,
    p: f64,
}

impl Scale {
    fn of<'s, S: PhasePoint + 's>(states: impl Iterator<Item = &'s S>) -> Self {
        let mut scale = Self { q: 0.0, p: 0.0 };
        for state in states {
            scale.q = scale.q.max(norm(state.q()));
            scale.p = scale.p.max(norm(state.p()));
        }
        let or_one = |value: f64| if value > 0.0 { value } else { 1.0 };
        Self {
            q: or_one(scale.q),
            p: or_one(scale.p),
        }
    }

    /// The relative distances of coordinates and of momenta.
    fn distances<S: PhasePoint>(self, a: &S, b: &S) -> (f64, f64) {
        (
            distance(a.q(), b.q()) / self.q,
            distance(a.p(), b.p()) / self.p,
        )
    }
}

impl<S: PhasePoint> Known<S> {
    /// The relative error at the end that the exact motion would seem to have.
    pub(super) fn uncertainty(&self) -> f64 {
        self.summary.uncertainty()
    }

    /// The number of coordinates.
    pub(super) fn length(&self) -> usize {
        self.states.first().map_or(0, |(_, state)| state.q().len())
    }

    pub(super) fn summary(&self) -> &Reference {
        &self.summary
    }

    pub(super) fn into_summary(self) -> Reference {
        self.summary
    }

    /// The relative errors of q and p, if there is a reference at this time.
    pub(super) fn errors(&self, time: f64, state: &S) -> Option<(f64, f64)> {
        let distance = |known: &f64| (known - time).abs();
        let nearest = self
            .states
            .iter()
            .min_by(|a, b| distance(&a.0).total_cmp(&distance(&b.0)))?;
        let (known, reference) = nearest;
        is_same_time(time, *known).then(|| self.scale.distances(state, reference))
    }
}

impl<S: PhasePoint> Source<'_, S> {
    /// Computes the reference at all times at which runs on the meshes are compared with it.
    pub(super) fn find<M: Subject<S>>(
        &self,
        model: &M,
        start: (f64, &S),
        grids: &[Grid],
        uncertainty: Option<f64>,
    ) -> Result<Known<S>, WorkPrecisionError> {
        let believed = uncertainty.unwrap_or(0.0).abs().max(f64::EPSILON);
        let times = times(grids);
        let states = match self {
            Self::Computed => return computed(model, start, grids, &times, believed),
            Self::End(state) => {
                let end = times.last().copied();
                end.map(|time| (time, state.clone())).into_iter().collect()
            }
            Self::Function(exact) => {
                let state = |time: f64| (time, exact(time));
                times.into_iter().map(state).collect::<Vec<_>>()
            }
        };
        for (time, state) in &states {
            check(*time, state, start.1.q().len())?;
        }
        Ok(Known {
            scale: Scale::of(states.iter().map(|(_, state)| state).chain([start.1])),
            states,
            summary: Reference::Given {
                uncertainty: believed,
            },
        })
    }
}

/// Refuses a state of a given reference whose size differs from that of the model, or that is not finite.
fn check<S: PhasePoint>(time: f64, state: &S, expected: usize) -> Result<(), WorkPrecisionError> {
    for (vector, values) in [("q", state.q()), ("p", state.p())] {
        let length = values.len();
        if length != expected {
            return Err(WorkPrecisionError::ReferenceLength {
                vector,
                time,
                length,
                expected,
            });
        }
        if !values.iter().all(|value| value.is_finite()) {
            return Err(WorkPrecisionError::ReferenceValue { time });
        }
    }
    Ok(())
}

/// The times at which any of the runs is compared, in the order of the runs.
fn times(grids: &[Grid]) -> Vec<f64> {
    let mut times: Vec<f64> = grids.iter().flat_map(Grid::compared).collect();
    times.sort_by(f64::total_cmp);
    times.dedup_by(|a, b| is_same_time(*a, *b));
    if let Some(grid) = grids.first() {
        let end = grid.node(grid.steps());
        if end < grid.node(0) {
            times.reverse();
        }
        // Of times that differ by rounding only, the end is kept.
        if let Some(last) = times.last_mut() {
            *last = end;
        }
    }
    times
}

/// Makes runs with halved steps, until the result no longer changes.
fn computed<M: Subject<S>, S: PhasePoint>(
    model: &M,
    start: (f64, &S),
    grids: &[Grid],
    times: &[f64],
    believed: f64,
) -> Result<Known<S>, WorkPrecisionError> {
    let element = Element::from(Mixed::<8>);
    let steps = || grids.iter().map(Grid::step);
    let longest = steps().fold(0.0, larger);
    let shortest = steps().fold(f64::INFINITY, f64::min);
    let halving = Halving {
        longest,
        least: (shortest / 4.0).min(longest / 64.0),
        enough: believed,
    };
    let scale = |states: &[S]| Scale::of(states.iter().chain([start.1]));
    let settled = halving.settle(
        |halvings| run(model, element, start, times, (longest, halvings)),
        |coarse: &Vec<S>, fine| difference(scale(fine), coarse, fine),
    );
    let settled = settled.map_err(|failure| match failure {
        Some(kind) => WorkPrecisionError::ReferenceRun(kind),
        // The loop makes at least two runs; if there is nothing to compare, one of them failed.
        None => WorkPrecisionError::NoSteps,
    })?;
    Ok(Known {
        scale: scale(&settled.run),
        states: times.iter().copied().zip(settled.run).collect(),
        summary: Reference::Computed {
            element,
            step: settled.step,
            uncertainty: settled.uncertainty.max(believed),
        },
    })
}

/// The parameters of step halving for a reference run.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Halving {
    /// The first step.
    pub(crate) longest: f64,
    /// The shortest step.
    pub(crate) least: f64,
    /// The difference of two runs at which the halving ends.
    pub(crate) enough: f64,
}

/// The reference run: one that no longer changes, or changes least, when its step is halved.
#[derive(Clone, Debug)]
pub(crate) struct Settled<T> {
    pub(crate) run: T,
    pub(crate) step: f64,
    /// Its distance from the run with twice the step.
    pub(crate) uncertainty: f64,
}

impl Halving {
    /// Makes runs with the first step halved 0, 1, 2, … times, until two of them agree or no longer approach each
    /// other. Returns the finer one of the two that agree best; if there are no two, the last error.
    pub(crate) fn settle<T: Clone>(
        self,
        mut run: impl FnMut(u32) -> Result<T, RunErrorKind>,
        distance: impl Fn(&T, &T) -> f64,
    ) -> Result<Settled<T>, Option<RunErrorKind>> {
        /// Below this, a difference that no longer decreases is rounding error; above it, the motion is not resolved
        /// yet.
        const RESOLVED: f64 = 1e-6;
        /// The largest number of halvings. If this is not enough, the longest steps are too long to be compared.
        const MAX_HALVINGS: u32 = 24;
        let (mut last, mut failure) = (None, None);
        let mut best: Option<Settled<T>> = None;
        for halvings in 0..MAX_HALVINGS {
            let step = self.longest * 0.5_f64.powi(halvings as i32);
            if step < self.least {
                break;
            }
            match run(halvings) {
                Err(kind) => failure = Some(kind),
                Ok(fine) => {
                    let Some(coarse) = last.replace(fine.clone()) else {
                        continue;
                    };
                    let uncertainty = distance(&coarse, &fine);
                    let before = best.as_ref().map(|best| best.uncertainty);
                    if before.is_none_or(|before| uncertainty < before || before.is_nan()) {
                        best = Some(Settled {
                            run: fine,
                            step,
                            uncertainty,
                        });
                    }
                    let settled = before
                        .is_some_and(|before| before < RESOLVED && uncertainty > before / 4.0);
                    if settled || uncertainty <= self.enough {
                        break;
                    }
                }
            }
        }
        best.ok_or(failure)
    }
}

/// The control for steps that are never cut: cut steps have the same pieces in both runs, which then agree whatever
/// their error.
pub(crate) fn uncut() -> Control {
    Control {
        solve: Solve::Trusting,
        ..Control::default()
    }
}

/// The larger relative difference of two runs at the end.
fn difference<S: PhasePoint>(scale: Scale, a: &[S], b: &[S]) -> f64 {
    match (a.last(), b.last()) {
        (Some(a), Some(b)) => {
            let (q, p) = scale.distances(a, b);
            q.max(p)
        }
        _ => f64::INFINITY,
    }
}

/// The states at all times, with steps of at most a given size, each halved a number of times. Halving applies to every
/// step: if the times to be met are so dense that they limit all steps, a smaller limit would not change the run.
fn run<M: Subject<S>, S: PhasePoint>(
    model: &M,
    element: Element,
    (mut t, start): (f64, &S),
    times: &[f64],
    (step, halvings): (f64, u32),
) -> Result<Vec<S>, RunErrorKind> {
    let mut stepper = model.stepper(element, uncut())?;
    let mut state = start.clone();
    let mut states = Vec::with_capacity(times.len());
    let mut done = 0;
    for &time in times {
        let count = ((time - t).abs() / step).ceil().max(1.0) as usize;
        let count = count.saturating_mul(1 << halvings);
        let h = (time - t) / count as f64;
        for k in 0..count {
            let time = t + k as f64 * h;
            let advanced = M::advance(&mut stepper, time, h, &mut state);
            advanced.map_err(|source| RunErrorKind::Solve {
                element: done,
                time,
                step: h,
                source,
            })?;
            done += 1;
        }
        t = time;
        states.push(state.clone());
    }
    Ok(states)
}
