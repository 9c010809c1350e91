//! Event location inside steps: steps are cut where forces or constraints have kinks or jumps (T-119).
//!
//! `select`, `abs`, `sign`, `min` and `max` choose a branch by the sign of a switching function g(t, q, z). In an
//! element in which no g changes its sign, the equations are smooth and the element has its full order. Where a g
//! changes its sign, the step is made of arcs that end at the roots.

mod arc;
mod kinked;
mod root;
mod search;
mod switches;
mod watched;

use crate::error::StepError;
use alloc::vec::Vec;
use arc::{Arc, arc, is_of_the_iteration};
pub(crate) use kinked::Kinked;
use kinked::{BEYOND, Effort, SHORTEST, is_later};
pub(crate) use root::{Change, Root};
use search::past_root;
pub use switches::switching_functions;
pub(crate) use switches::{are_constraints_chosen, switches};
pub(crate) use watched::{Log, Origin, Watched};

/// All arcs of a step together may take this many trials,
const MAX_WORK: usize = 1000;

/// and this many more for each switching function that changes its sign in the step.
const WORK_OF_ONE: usize = 16;

/// The largest number of short arcs that may end at roots of the same functions: a motion that chatters does so faster
/// and faster without end, whereas many sites may reach their roots at almost the same time.
const MAX_SHORT: u32 = 20;

/// The number of roundings of the time after which a start behind a root counts as behind it.
const DISTINCT: f64 = 16.0;

/// The error of lengths of arcs, relative to the step; far from t = 0 differences of times have larger errors.
const DIGITS: f64 = 1e-12;

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
        let arc = arc(stepper, from, (end, rest, h), state, kicked, &mut effort);
        let arc = arc.map_err(
            |error| match begins_at_root && is_of_the_iteration(&error) {
                true => StepError::Slides,
                false => error,
            },
        )?;
        let (Arc::Smooth { length } | Arc::Crossing { length, .. }) = arc;
        match arc {
            Arc::Crossing { switch, .. } if !seen.contains(&switch) => seen.push(switch),
            _ => short += u32::from(length.abs() < SHORTEST * h.abs()),
        }
        if short > MAX_SHORT {
            return Err(StepError::Slides);
        }
        let mut is_last = length == rest || now + length == end;
        let until = if is_last { end } else { now + length };
        let (later, done) =
            (kicks.into_iter()).partition(|kick| is_later(kick, until, h) && !is_last);
        stepper.begin_behind(false);
        if let (Arc::Smooth { .. }, true, true) = (&arc, is_last, now == t) {
            return Ok(());
        }
        stepper.passed(now, length, done);
        (now, left, kicks) = (until, left - length, later);
        begins_at_root = matches!(arc, Arc::Crossing { .. });
        if let Arc::Crossing { switch, margin, .. } = arc {
            stepper.crossed(switch);
            crossings += 1;
            stepper.trust(true);
            let inside = stepper.inside();
            if slides(stepper, &inside, (now, length), h, switch, state) {
                return Err(StepError::Slides);
            }
            let over = 2.0 * margin.copysign(h);
            // A step that the time cannot resolve is skipped.
            let is_step = margin > 0.0 && now + over != now;
            let is_short = over.abs() < 0.5 * (end - now).abs();
            if is_step && (is_short || stepper.has_constraint_kinks()) {
                let place = (now, length);
                let over = step_over(stepper, &inside, place, (switch, over), state)?;
                (now, left) = (now + over, left - over);
                is_last |= h.signum() * now >= h.signum() * end;
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

/// Leads over the root of a switching function, which lies `over`/2 behind the last piece of this length, or nearer; returns
/// how far.
///
/// # Errors
/// [`StepError::Slides`] if there is no element that leads over it.
fn step_over<S: Kinked + ?Sized>(
    stepper: &mut S,
    inside: &S::Inside,
    (now, length): (f64, f64),
    (switch, over): (usize, f64),
    state: &mut S::State,
) -> Result<f64, StepError> {
    if stepper.has_constraint_kinks() {
        // Where constraints jump there is no element from one side to the other: the velocity at one of its ends would
        // not be allowed. The next element has an impulse at its start.
        let roundings = DISTINCT * f64::EPSILON * now.abs().max(length.abs());
        let least = 0.5 * over.abs() + roundings;
        let part = past_root(least / length.abs(), switch, &mut |part, row| {
            let ahead = stepper.ahead(inside, part, state);
            stepper.switches(now + part * length, &ahead, row);
        });
        *state = stepper.ahead(inside, part, state);
        stepper.begin_behind(true);
        return Ok(part * length);
    }
    // A step across a jump may have no solution: each side leads back to the other.
    let crossed = stepper.whole(now, over, state, &[]);
    crossed.map_err(|_| StepError::Slides)?;
    stepper.passed(now, over, Vec::new());
    stepper.stepped_over();
    Ok(over)
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

/// Whether the motion returns at once to the surface that it has crossed (Filippov): beyond the surface, the function
/// decreases again.
///
/// The polynomial of the arc is extended beyond the surface by a small part of the arc; a much smaller step from there
/// tells how the motion continues on that side.
fn slides<S: Kinked + ?Sized>(
    stepper: &mut S,
    inside: &S::Inside,
    (time, length): (f64, f64),
    h: f64,
    switch: usize,
    state: &S::State,
) -> bool {
    if length.abs() < SHORTEST * h.abs() {
        return false;
    }
    let value = |stepper: &mut S, t: f64, state: &S::State| {
        let mut row = Vec::new();
        stepper.switches(t, state, &mut row);
        row.get(switch).copied().unwrap_or(f64::NAN)
    };
    let mut behind = stepper.at(inside, 1.0 + BEYOND);
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
