//! Comparison, ordering and resolution of times.

use std::ops::Range;

/// Whether two times are equal up to rounding, so that an element between them would be meaningless. Infinite times are
/// equal to none.
pub(crate) fn is_same_time(a: f64, b: f64) -> bool {
    let size = a.abs().max(b.abs());
    size < f64::INFINITY && (a - b).abs() <= 8.0 * f64::EPSILON * size
}

/// The shortest step in ulps of the time; in a shorter one, points of the element would have equal times.
pub(crate) const MIN_ROUNDINGS: f64 = 64.0;

/// Whether no step leads from one time to the other: they are equal up to rounding, or too close for a step to be
/// resolved.
pub(crate) fn is_unresolved(a: f64, b: f64) -> bool {
    let size = a.abs().max(b.abs());
    size < f64::INFINITY && (a - b).abs() <= MIN_ROUNDINGS * f64::EPSILON * size
}

/// Those of the given times that can be nodes in addition to the `known` ones, in their order. The others are within
/// rounding of one of these.
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

/// The largest number of steps. A larger one is a mistake in units: such a run would take years.
pub(crate) const MAX_STEPS: f64 = 1e15;

/// The default step size of a run: one thousandth of the span; the whole span if that is too short to be divided.
pub(crate) fn default_step(span: &Range<f64>) -> f64 {
    let length = (span.end - span.start).abs();
    let step = length / 1000.0;
    if step == 0.0 { length } else { step }
}

/// The number of steps in a span, whose sign the step has, and whether the last one is as long as the others. Rounding
/// errors do not add a step: those of the quotient, as 10 / 0.01 may be 1000.0000000000001, and those of the times,
/// which are larger far from zero.
pub(crate) fn count_steps(span: &Range<f64>, step: f64) -> (f64, bool) {
    let ratio = (span.end - span.start) / step;
    let nearest = ratio.round();
    let is_whole = (ratio - nearest).abs() <= 1e-9 * nearest.max(1.0)
        || (nearest >= 1.0 && leads_to_end(span, step, nearest));
    let steps = if is_whole { nearest } else { ratio.ceil() };
    (steps.max(1.0), is_whole)
}

/// Whether a number of steps leads from the start of a span to its end, up to rounding.
pub(crate) fn leads_to_end(span: &Range<f64>, step: f64, steps: f64) -> bool {
    let rounding = 4.0 * f64::EPSILON * span.start.abs().max(span.end.abs());
    ((span.end - span.start) - steps * step).abs() <= rounding
}

/// 1, or −1 in backward integration.
pub(crate) fn direction_of(span: &Range<f64>) -> f64 {
    if span.end < span.start { -1.0 } else { 1.0 }
}

/// Sorts times in the order in which a run passes them. Not generic, so that it is compiled only once.
pub(crate) fn sort_times(times: &mut [f64], direction: f64) {
    times.sort_by(|a, b| (direction * a).total_cmp(&(direction * b)));
}

/// The breaks inside a span, in the order of the run, without duplicates and without the ends.
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
