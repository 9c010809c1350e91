//! Which times are one, and which come first.

use std::ops::Range;

/// Whether two times are one but for rounding: an element between them would be rounding. No time is the same as an infinite one.
pub(crate) fn is_same_time(a: f64, b: f64) -> bool {
    let size = a.abs().max(b.abs());
    size < f64::INFINITY && (a - b).abs() <= 8.0 * f64::EPSILON * size
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
