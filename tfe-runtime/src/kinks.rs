//! Steps that are cut where forces have kinks or jumps (T-119).
//!
//! `select`, `abs`, `sign`, `min` and `max` choose by the sign of a switching function g(t, q, z). Over an element in which no g changes its sign all is smooth, and the
//! element has its order; where one does, the step is made of arcs that end at the roots.

mod search;
mod watched;

use crate::constrained::velocity_of;
use crate::cut::{Halving, Instant};
use crate::error::StepError;
use crate::model::{Form, Model};
use alloc::vec::Vec;
use search::{Crossing, begins_on_root, first_crossing};
pub(crate) use watched::{Log, Watched};

/// All arcs of a step may cost so many trials,
const MAX_WORK: usize = 1000;

/// and so many more for every switching function that changes its sign in it.
const WORK_OF_ONE: usize = 16;

/// So many arcs may be short that end where others have: a motion that goes to and fro without end does so faster and faster, while many sites may come to their roots at all but one time.
const MAX_SHORT: u32 = 20;

/// Lengths that are tried for one arc.
const MAX_TRIALS: u32 = 100;

/// Arcs shorter than that, relative to the step, have no other roots.
const SHORT: f64 = 0.02;

/// An arc shorter than that, relative to the step, only gets to the other side of a root nearby.
const SHORTEST: f64 = 1e-6;

/// What lengths of arcs may be off by, relative to the step: far from zero differences of times are off by more.
const DIGITS: f64 = 1e-12;

/// How far behind an arc its polynomial is taken for the motion, relative to the arc.
const BEYOND: f64 = 1e-3;

/// What moves over elements and can be looked into.
pub(crate) trait Kinked:
    Halving<State: Clone, Kicks = Vec<<Self as Halving>::Kick>>
{
    /// The inside of a step.
    type Inside;

    /// The inside of the last step.
    fn inside(&self) -> Self::Inside;

    /// The state in a step or a little behind it.
    fn at(inside: &Self::Inside, tau: f64) -> Self::State;

    /// The next step continues none.
    fn forget(&mut self);

    /// Adds the values of all switching functions; false, with nothing added, where there is no velocity to know them by.
    fn switches(&mut self, t: f64, state: &Self::State, values: &mut Vec<f64>) -> bool;

    /// Points of an element; whether there are some at its ends.
    fn points(&self) -> (usize, bool);

    /// Counts a crossing.
    fn crossed(&mut self);

    /// Whether steps that fail are cut, kinks or not.
    fn cuts(&self) -> bool;

    /// Whether whatever an iteration converges to is to be taken.
    fn trust(&mut self, all: bool);
}

/// The values of the switching functions of a model; false, with nothing added, where there is no velocity.
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
    let watched = |value| Watched::new(value, &log);
    let mut first = crate::First::zero();
    model.first(
        watched(t),
        &state.q.map(watched),
        &z.map(watched),
        &mut first,
    );
    let results = first.z.iter().chain(&first.q).chain(&first.force);
    let origin = log.deciding(results);
    *values = log.decisive(origin);
    true
}

/// What all arcs of a step have cost.
#[derive(Default)]
struct Effort {
    trials: usize,
    /// Why the first one failed that did.
    failed: Option<StepError>,
}

/// How an arc has ended.
enum Arc {
    /// The whole rest of the step, or as much of it as could be done at once.
    Smooth { length: f64 },
    /// At the root of a switching function, or by `margin` before it.
    Crossing {
        length: f64,
        switch: usize,
        margin: f64,
    },
}

/// Moves `state` from t to t + h in smooth arcs; the stepper may be left trusting.
///
/// # Errors
/// [`StepError`]; `state` is then where the last arc has ended.
pub(crate) fn in_arcs<S: Kinked>(
    stepper: &mut S,
    (t, h): (f64, f64),
    state: &mut S::State,
    kicks: &[S::Kick],
) -> Result<(), StepError> {
    let end = t + h;
    // How much of the step is left, also where roundings of the times are more than its digits.
    let (mut now, mut left, mut kicks) = (t, h, kicks.to_vec());
    let (mut begins_at_root, mut short) = (false, 0);
    let (mut effort, mut crossings) = (Effort::default(), 0);
    // The functions that have changed their signs.
    let mut seen: Vec<usize> = Vec::new();
    while effort.trials < MAX_WORK + WORK_OF_ONE * seen.len() {
        // Friction ends with a velocity of zero, relative to which all increments are large.
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
            // What the time does not resolve is no step.
            let is_step = margin > 0.0 && now + over != now;
            if is_step && over.abs() < 0.5 * (end - now).abs() {
                // A step across a jump that has no solution: each side leads back to the other.
                let crossed = stepper.whole(now, over, state, &[]);
                crossed.map_err(|_| StepError::Slides)?;
                stepper.passed(now, over, Vec::new());
                (now, left) = (now + over, left - over);
            }
        }
        if is_last {
            // It was not kinks that made longer arcs fail.
            return match effort.failed {
                Some(error) if crossings == 0 && !stepper.cuts() => Err(error),
                _ => Ok(()),
            };
        }
    }
    Err(StepError::TooManyKinks)
}

/// The rest of a step h, of which so much is `left`: the difference `between` the times, where it has the digits of the step.
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
    /// How far before it.
    change: f64,
}

impl Landing {
    /// Whether what is left is little beside the step.
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

/// One arc: to the end, or to the first root of a switching function.
///
/// Lengths are tried until one ends at a root: each trial that crosses one tells where it is, each that ends before one tells how far it is by the slope there. Where the
/// iteration of a long arc fails, because forces jump within it, a shorter one is continued to the root.
fn arc<S: Kinked>(
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
    // Points at the ends of an element have to be on the side of its inside.
    let margin = if has_ends { 4.0 * resolution } else { 0.0 };
    let mut length = rest;
    // The function at whose root the arc is to end, and the last correction of its length.
    let mut target: Option<usize> = None;
    let mut last_change = f64::INFINITY;
    // The longest arc without a root, and the shortest one that failed.
    let (mut good, mut bad) = (0.0_f64, f64::INFINITY);
    // What came next to a root without crossing it; to be taken when nothing else comes nearer.
    let mut nearest: Option<Landing> = None;
    let mut is_to_settle = false;
    // A length that is to be taken without a search.
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
            let here = S::at(&inside, tau);
            stepper.switches(now + tau * signed, &here, row);
        };
        // A root at the end of a step that has a point there: on which side is a matter of rounding.
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
                        // The point at the start may be on the other side.
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
            // It went away from the root again.
            return Ok(Arc::Smooth { length: signed });
        }
        // What is left of it then is the rounding of the function.
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
            // Not in this step.
            target = None;
            rest
        } else {
            wanted.max(resolution)
        };
    }
    // No worse than any other step across a kink.
    *state = start;
    stepper.forget();
    stepper.whole(now, rest.copysign(h), state, kicks)?;
    Ok(Arc::Smooth {
        length: rest.copysign(h),
    })
}

/// Whether the motion comes back at once to where it has crossed (Filippov): behind the surface the function falls.
///
/// The polynomial of the arc goes on behind the surface by some part of the arc; a much smaller step from there tells where the motion goes on that side.
fn slides<S: Kinked>(
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
    let mut behind = S::at(&inside, 1.0 + BEYOND);
    let (ahead, short) = (BEYOND * length, BEYOND * BEYOND * length);
    let before = value(stepper, time, state);
    let first = value(stepper, time + ahead, &behind);
    stepper.forget();
    let moved = stepper.whole(time + ahead, short, &mut behind, &[]).is_ok();
    let second = value(stepper, time + ahead + short, &behind);
    stepper.forget();
    // Slopes of the function before and behind the surface.
    let (arriving, leaving) = (first - before, (second - first) / BEYOND);
    moved && leaving * arriving < -BEYOND * arriving * arriving
}

/// Whether a shorter arc may go well.
fn is_of_the_iteration(error: &StepError) -> bool {
    matches!(
        error,
        StepError::Unproven { .. }
            | StepError::EnergyJump { .. }
            | StepError::NonFinite
            | StepError::SingularTangent { .. }
            | StepError::NewtonStalled { .. }
            | StepError::FixedPointStalled { .. }
            | StepError::Legendre(_)
    )
}
