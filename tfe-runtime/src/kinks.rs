//! Event location inside steps: steps are cut where forces have kinks or jumps (T-119).
//!
//! `select`, `abs`, `sign`, `min` and `max` choose a branch by the sign of a switching function g(t, q, z). In an
//! element in which no g changes its sign, the equations are smooth and the element has its full order. Where a g
//! changes its sign, the step is made of arcs that end at the roots.

mod search;
mod watched;

use crate::constrained::velocity_of;
use crate::cut::{Halving, Instant, is_of_newton};
use crate::error::StepError;
use crate::model::{Form, Model};
use alloc::vec::Vec;
use search::{Crossing, begins_on_root, first_crossing};
use watched::Origin;
pub(crate) use watched::{Log, Watched};

/// All arcs of a step together may take this many trials,
const MAX_WORK: usize = 1000;

/// and this many more for each switching function that changes its sign in the step.
const WORK_OF_ONE: usize = 16;

/// The largest number of short arcs that may end at roots of the same functions: a motion that chatters does so faster
/// and faster without end, whereas many sites may reach their roots at almost the same time.
const MAX_SHORT: u32 = 20;

/// The largest number of lengths tried for one arc.
const MAX_TRIALS: u32 = 100;

/// Arcs shorter than this, relative to the step, are assumed to have no further roots.
const SHORT: f64 = 0.02;

/// An arc shorter than this, relative to the step, only moves the state to the other side of a root nearby.
const SHORTEST: f64 = 1e-6;

/// The error of lengths of arcs, relative to the step; far from t = 0 differences of times have larger errors.
const DIGITS: f64 = 1e-12;

/// How far beyond an arc its polynomial is used, relative to the length of the arc.
const BEYOND: f64 = 1e-3;

/// A stepper whose elements can be evaluated inside.
pub(crate) trait Kinked:
    Halving<State: Clone, Kicks = Vec<<Self as Halving>::Kick>>
{
    /// Dense output of one step.
    type Inside;

    /// Dense output of the last step.
    fn inside(&self) -> Self::Inside;

    /// The state inside a step, or slightly beyond its end.
    fn at(&self, inside: &Self::Inside, tau: f64) -> Self::State;

    /// Makes the next step start without continuing the last polynomial.
    fn forget(&mut self);

    /// Appends the values of all switching functions; false, with nothing appended, where the velocity that they need
    /// does not exist.
    fn switches(&mut self, t: f64, state: &Self::State, values: &mut Vec<f64>) -> bool;

    /// The number of points of an element, and whether some of them lie at its ends.
    fn points(&self) -> (usize, bool);

    /// Counts a crossing of a kink.
    fn crossed(&mut self);

    /// Whether steps that fail are cut, whether or not there are kinks.
    fn cuts(&self) -> bool;

    /// With `all`, accept any root to which an iteration converges.
    fn trust(&mut self, all: bool);
}

/// Appends the values of the switching functions of a model; false, with nothing appended, where there is no velocity.
pub(crate) fn switches<M, const N: usize>(
    model: &M,
    t: f64,
    state: &crate::State<N>,
    values: &mut Vec<f64>,
) -> bool
where
    M: Model<N>,
{
    let z = match M::FORM {
        Form::Lagrangian => {
            let velocity = velocity_of(model, t, &state.q, &state.p, &[0.0; N]);
            let Ok(velocity) = velocity else {
                return false;
            };
            velocity
        }
        Form::Hamiltonian => state.p,
    };
    let log = Log::new(core::mem::take(values));
    let mut first = crate::First::zero();
    let (q, z) = (watch(&state.q, &log), watch(&z, &log));
    model.first(Watched::new(t, &log), &q, &z, &mut first);
    let origin = deciding(&log, &first);
    *values = log.decisive(origin);
    true
}

/// The numbers, with a log of their comparisons.
fn watch<'a, const N: usize>(numbers: &[f64; N], log: &'a Log) -> [Watched<'a>; N] {
    numbers.map(|number| Watched::new(number, log))
}

/// The switching functions that have decided the derivatives of a model.
fn deciding<const N: usize>(log: &Log, first: &crate::First<Watched<'_>, N>) -> Origin {
    log.deciding(first.z.iter().chain(&first.q).chain(&first.force))
}

/// The trials that all arcs of a step have taken.
#[derive(Default)]
struct Effort {
    trials: usize,
    /// Why the first failing arc failed.
    failed: Option<StepError>,
}

/// How an arc ended.
enum Arc {
    /// At the end of the step, or as far as the step could be made at once, without a root.
    Smooth { length: f64 },
    /// At a root of a switching function, or `margin` before it.
    Crossing {
        length: f64,
        switch: usize,
        margin: f64,
    },
}

/// Moves `state` from t to t + h in smooth arcs. On return, the stepper may still accept any root (see
/// [`Kinked::trust`]).
///
/// # Errors
/// [`StepError`]; `state` is then the end of the last arc.
pub(crate) fn in_arcs<S: Kinked + ?Sized>(
    stepper: &mut S,
    (t, h): (f64, f64),
    state: &mut S::State,
    kicks: &[S::Kick],
) -> Result<(), StepError> {
    let end = t + h;
    // What remains of the step is kept separately, because far from t = 0 it has more correct digits than differences
    // of times.
    let (mut now, mut left, mut kicks) = (t, h, kicks.to_vec());
    let (mut begins_at_root, mut short) = (false, 0);
    let (mut effort, mut crossings) = (Effort::default(), 0);
    // The functions that have changed their signs.
    let mut seen: Vec<usize> = Vec::new();
    while effort.trials < MAX_WORK + WORK_OF_ONE * seen.len() {
        // Friction ends at velocity zero, relative to which all increments are large.
        stepper.trust(begins_at_root);
        let (from, kicked) = ((now, begins_at_root), &kicks);
        let rest = rest_of(end - now, left, h);
        let arc = arc(stepper, from, (end, rest, h), state, kicked, &mut effort)?;
        let (Arc::Smooth { length } | Arc::Crossing { length, .. }) = arc;
        match arc {
            Arc::Crossing { switch, .. } if !seen.contains(&switch) => seen.push(switch),
            _ => short += u32::from(length.abs() < SHORTEST * h.abs()),
        }
        if short > MAX_SHORT {
            return Err(StepError::Slides);
        }
        let is_last = length == rest || now + length == end;
        let until = if is_last { end } else { now + length };
        let (later, done) =
            (kicks.into_iter()).partition(|kick| is_later(kick, until, h) && !is_last);
        if let (Arc::Smooth { .. }, true, true) = (&arc, is_last, now == t) {
            return Ok(());
        }
        stepper.passed(now, length, done);
        (now, left, kicks) = (until, left - length, later);
        begins_at_root = matches!(arc, Arc::Crossing { .. });
        if let Arc::Crossing { switch, margin, .. } = arc {
            stepper.crossed();
            crossings += 1;
            stepper.trust(true);
            if slides(stepper, (now, length), h, switch, state) {
                return Err(StepError::Slides);
            }
            let over = 2.0 * margin.copysign(h);
            // A step that the time cannot resolve is skipped.
            let is_step = margin > 0.0 && now + over != now;
            if is_step && over.abs() < 0.5 * (end - now).abs() {
                // A step across a jump may have no solution: each side leads back to the other.
                let crossed = stepper.whole(now, over, state, &[]);
                crossed.map_err(|_| StepError::Slides)?;
                stepper.passed(now, over, Vec::new());
                (now, left) = (now + over, left - over);
            }
        }
        if is_last {
            // The longer arcs did not fail because of kinks.
            return match effort.failed {
                Some(error) if crossings == 0 && !stepper.cuts() => Err(error),
                _ => Ok(()),
            };
        }
    }
    Err(StepError::TooManyKinks)
}

/// What remains of a step h after arcs that leave `left` of it: the difference `between` the times, where it has the
/// digits of the step.
fn rest_of(between: f64, left: f64, h: f64) -> f64 {
    let is_rounded = (left - between).abs() > DIGITS * h.abs();
    let is_ahead = if h > 0.0 { left > 0.0 } else { left < 0.0 };
    if is_rounded && is_ahead {
        left
    } else {
        between
    }
}

/// Whether something acts after a time.
fn is_later<K: Instant>(kick: &K, time: f64, h: f64) -> bool {
    if h > 0.0 {
        kick.time() >= time
    } else {
        kick.time() <= time
    }
}

/// An arc that ends before a root.
#[derive(Clone, Copy)]
struct Landing {
    length: f64,
    switch: usize,
    /// The distance to the root.
    change: f64,
}

impl Landing {
    /// Whether that distance is small relative to the step.
    fn is_near(&self, h: f64) -> bool {
        self.change.abs() < SHORTEST * h.abs()
    }

    fn arc(&self, h: f64, margin: f64) -> Arc {
        let margin = if margin > 0.0 || self.is_near(h) && self.change > 0.0 {
            self.change.max(margin)
        } else {
            0.0
        };
        Arc::Crossing {
            length: self.length.copysign(h),
            switch: self.switch,
            margin,
        }
    }
}

/// Computes one arc, to the end of the step or to the first root of a switching function.
///
/// Lengths are tried until an arc ends at a root. Each trial that crosses a root tells where it is; each trial that
/// ends before one gives an estimate from the slope there. Where the iteration for a long arc fails, because forces
/// jump within it, a shorter arc is extended to the root.
fn arc<S: Kinked + ?Sized>(
    stepper: &mut S,
    (now, begins_at_root): (f64, bool),
    (end, rest, h): (f64, f64, f64),
    state: &mut S::State,
    kicks: &[S::Kick],
    effort: &mut Effort,
) -> Result<Arc, StepError> {
    let rest = rest.abs();
    let resolution = 4.0 * f64::EPSILON * now.abs().max(end.abs()).max(rest);
    let (points, has_ends) = stepper.points();
    let samples = (2 * points).clamp(8, 24);
    let start = state.clone();
    // Points at the ends of an element have to lie on the same side of the root as its inside.
    let margin = if has_ends { 4.0 * resolution } else { 0.0 };
    let mut length = rest;
    // The function at whose root the arc is to end, and the last correction of its length.
    let mut target: Option<usize> = None;
    let mut last_change = f64::INFINITY;
    // The longest arc without a root, and the shortest one that failed.
    let (mut good, mut bad) = (0.0_f64, f64::INFINITY);
    // The arc that came nearest to a root without crossing it; it is used if none comes nearer.
    let mut nearest: Option<Landing> = None;
    let mut is_to_settle = false;
    // A length that is accepted without a search.
    let mut only = None;
    for trial in 0..MAX_TRIALS {
        effort.trials += 1;
        if trial > 0 {
            *state = start.clone();
            stepper.forget();
        }
        if target.is_some() {
            stepper.trust(true);
        }
        if let (true, Some(landing)) = (is_to_settle, nearest) {
            length = landing.length;
        }
        let signed = length.copysign(h);
        let inner: Vec<S::Kick> = (kicks.iter())
            .filter(|kick| length == rest || !is_later(*kick, now + signed, h))
            .cloned()
            .collect();
        if let Err(error) = stepper.whole(now, signed, state, &inner) {
            effort.failed.get_or_insert(error);
            bad = length;
            if !is_of_the_iteration(&error) || bad < 2.0 * resolution || is_to_settle {
                return Err(error);
            }
            is_to_settle = nearest.is_some() && bad - good < 2.0 * resolution;
            length = if bad <= good {
                0.5 * bad
            } else if good > 0.0 {
                good + 0.5 * (bad - good)
            } else {
                bad * if bad > SHORTEST * h.abs() { 0.5 } else { 0.1 }
            };
            if length < SHORT * h.abs() {
                stepper.trust(true);
            }
            continue;
        }
        if let (true, Some(landing)) = (is_to_settle, nearest) {
            return Ok(landing.arc(h, margin));
        }
        if only == Some(length) {
            return Ok(Arc::Smooth { length: signed });
        }
        let inside = stepper.inside();
        let mut values = |tau: f64, row: &mut Vec<f64>| {
            let here = stepper.at(&inside, tau);
            stepper.switches(now + tau * signed, &here, row);
        };
        // A root at the end of a step that has a point there: on which side it lies is decided by rounding.
        let beyond = if has_ends && length == rest {
            resolution / length
        } else {
            0.0
        };
        let found = first_crossing(0.0..1.0 + beyond, samples, resolution / length, &mut values);
        if found.is_none() {
            good = good.max(length);
        }
        let change = match (found, target) {
            (Some(Crossing { switch, tau }), _) => {
                target = Some(switch);
                (tau - 1.0) * length
            }
            (None, Some(switch)) => {
                let mut value = |tau: f64| {
                    let mut row = Vec::new();
                    values(tau, &mut row);
                    row.get(switch).copied().unwrap_or(f64::NAN)
                };
                let at_end = value(1.0);
                let slope = (at_end - value(1.0 - BEYOND)) / (BEYOND * length);
                -at_end / slope
            }
            (None, None) => {
                let until = (bad / length).min(2.0);
                let ahead = (bad.is_finite())
                    .then(|| first_crossing(1.0..until, 4, resolution / length, &mut values));
                let Some(Crossing { switch, tau }) = ahead.flatten() else {
                    let is_first = trial == 0 && !begins_at_root && length == rest;
                    if is_first && has_ends && begins_on_root(resolution / length, &mut values) {
                        // The point at the start may lie on the other side.
                        length = margin;
                        only = Some(margin);
                        continue;
                    }
                    return Ok(Arc::Smooth { length: signed });
                };
                target = Some(switch);
                (tau - 1.0) * length
            }
        };
        let Some(switch) = target else { continue };
        if found.is_none() && change < -4.0 * resolution {
            // The motion has turned away from the root again.
            return Ok(Arc::Smooth { length: signed });
        }
        // The rest is then the rounding error of the function.
        let is_settled =
            change.abs() <= resolution || trial > 4 && change.abs() >= 0.5 * last_change;
        let here = Landing {
            length,
            switch,
            change,
        };
        let is_right = if has_ends {
            found.is_none() && change.abs() <= 4.0 * margin
        } else {
            is_settled
        };
        if is_right || !change.is_finite() {
            return Ok(here.arc(h, margin));
        }
        if found.is_none() {
            match nearest {
                Some(one) if one.change <= change => {
                    is_to_settle = one.is_near(h) || trial > MAX_TRIALS / 2;
                }
                _ => nearest = Some(here),
            }
        }
        last_change = change.abs();
        let wanted = length + change - margin;
        length = if wanted >= bad {
            good + 0.5 * (bad - good)
        } else if wanted >= rest {
            // The root is not in this step.
            target = None;
            rest
        } else {
            wanted.max(resolution)
        };
    }
    // The result is no worse than any other step across a kink.
    *state = start;
    stepper.forget();
    stepper.whole(now, rest.copysign(h), state, kicks)?;
    Ok(Arc::Smooth {
        length: rest.copysign(h),
    })
}

/// Whether the motion returns at once to the surface that it has crossed (Filippov): beyond the surface, the function
/// decreases again.
///
/// The polynomial of the arc is extended beyond the surface by a small part of the arc; a much smaller step from there
/// tells how the motion continues on that side.
fn slides<S: Kinked + ?Sized>(
    stepper: &mut S,
    (time, length): (f64, f64),
    h: f64,
    switch: usize,
    state: &S::State,
) -> bool {
    if length.abs() < SHORTEST * h.abs() {
        return false;
    }
    let inside = stepper.inside();
    let value = |stepper: &mut S, t: f64, state: &S::State| {
        let mut row = Vec::new();
        stepper.switches(t, state, &mut row);
        row.get(switch).copied().unwrap_or(f64::NAN)
    };
    let mut behind = stepper.at(&inside, 1.0 + BEYOND);
    let (ahead, short) = (BEYOND * length, BEYOND * BEYOND * length);
    let before = value(stepper, time, state);
    let first = value(stepper, time + ahead, &behind);
    stepper.forget();
    let moved = stepper.whole(time + ahead, short, &mut behind, &[]).is_ok();
    let second = value(stepper, time + ahead + short, &behind);
    stepper.forget();
    // The slopes of the function before and beyond the surface.
    let (arriving, leaving) = (first - before, (second - first) / BEYOND);
    moved && leaving * arriving < -BEYOND * arriving * arriving
}

/// Whether a shorter arc may succeed.
fn is_of_the_iteration(error: &StepError) -> bool {
    is_of_newton(error)
        || matches!(
            error,
            StepError::FixedPointStalled { .. } | StepError::Legendre(_)
        )
}
