//! Which times are one, and which come first.

use std::ops::Range;

/// Whether two times are one but for rounding: an element between them would be rounding. No time is the same as an infinite one.
pub(crate) fn is_same_time(a: f64, b: f64) -> bool {
    let size = a.abs().max(b.abs());
    size < f64::INFINITY && (a - b).abs() <= 8.0 * f64::EPSILON * size
}

/// A step of fewer roundings of the time has points that share times.
pub(crate) const LEAST_ROUNDINGS: f64 = 64.0;

/// Whether no step leads from one time to the other: they are one but for rounding, or so near that it would not be resolved.
pub(crate) fn is_unresolved(a: f64, b: f64) -> bool {
    let size = a.abs().max(b.abs());
    size < f64::INFINITY && (a - b).abs() <= LEAST_ROUNDINGS * f64::EPSILON * size
}

/// Of times at which a run is looked at those that can be nodes beside what is `known` of its nodes, in their order. The others are as near to one of these as roundings of sums of times are.
pub(crate) fn looked_at(times: impl IntoIterator<Item = f64>, known: &[f64]) -> Vec<f64> {
    let mut known = known.to_vec();
    known.sort_by(f64::total_cmp);
    let is_beside = |time: f64| {
        let after = known.partition_point(|one| *one < time);
        let near = &known[after.saturating_sub(1)..known.len().min(after + 1)];
        let mut near = near.iter();
        near.any(|one| is_unresolved(*one, time) && !is_same_time(*one, time))
    };
    let mut times: Vec<f64> = times.into_iter().filter(|time| !is_beside(*time)).collect();
    times.sort_by(f64::total_cmp);
    times.dedup_by(|a, b| is_unresolved(*a, *b));
    times
}

/// A count of steps beyond this is a mistake in units rather than a run: it would take years.
pub(crate) const MOST_STEPS: f64 = 1e15;

/// The step of a run that is given none.
pub(crate) fn default_step(span: &Range<f64>) -> f64 {
    (span.end - span.start).abs() / 1000.0
}

/// How many steps there are in a span, whose sign the step has, and whether the last one is as long as the others: but for a rounding of the quotient, as 10 / 0.01 may be
/// 1000.0000000000001, or of the times, which far from zero is more. Such a rounding is no step of its own: it may be no time at all.
pub(crate) fn count_steps(span: &Range<f64>, step: f64) -> (f64, bool) {
    let ratio = (span.end - span.start) / step;
    let nearest = ratio.round();
    let is_whole = (ratio - nearest).abs() <= 1e-9 * nearest.max(1.0)
        || (nearest >= 1.0 && leads_to_end(span, step, nearest));
    let steps = if is_whole { nearest } else { ratio.ceil() };
    (steps.max(1.0), is_whole)
}

/// Whether so many steps lead from the start of a span to its end but for rounding.
pub(crate) fn leads_to_end(span: &Range<f64>, step: f64, steps: f64) -> bool {
    let rounding = 4.0 * f64::EPSILON * span.start.abs().max(span.end.abs());
    ((span.end - span.start) - steps * step).abs() <= rounding
}

/// One, or minus one where a run goes back in time.
pub(crate) fn direction_of(span: &Range<f64>) -> f64 {
    if span.end < span.start { -1.0 } else { 1.0 }
}

/// Puts times in the order in which a run meets them. Not generic, so that it is compiled once.
pub(crate) fn sort_times(times: &mut [f64], direction: f64) {
    times.sort_by(|a, b| (direction * a).total_cmp(&(direction * b)));
}

/// Breaks inside a span, in the order of the run; none is the same as another one or as an end.
pub(crate) fn breaks_within(span: &Range<f64>, breaks: &[f64]) -> Vec<f64> {
    let Range { start, end } = *span;
    let direction = direction_of(span);
    let mut within = breaks.to_vec();
    within.retain(|&time| {
        let is_inside = direction * start < direction * time && direction * time < direction * end;
        is_inside && !is_same_time(time, start) && !is_same_time(time, end)
    });
    sort_times(&mut within, direction);
    within.dedup_by(|a, b| is_same_time(*a, *b));
    within
}
