//! The times at which runs are compared, and the measure of steps between them. Steps are measured in time, or, with a
//! grading, in s(t).

use super::super::estimated::Attempt;
use super::super::grading::Grading;
use super::super::pilot::corners;
use super::runs::{Asked, MAX_TIMES, RunSettings, STEPS_BETWEEN};
use crate::numbers::larger;
use std::ops::Range;

impl RunSettings<'_> {
    /// The length of the span and the longest step, in the measure of steps.
    pub(super) fn lengths(&self, asked: &Asked) -> (f64, f64) {
        let length = self.between(asked.span.start, asked.span.end);
        let longest = match self.grading {
            Some(_) => asked.longest.map_or(length, |_| 1.0),
            None => asked.longest.map_or(length, |step| step.abs().min(length)),
        };
        (length, longest)
    }

    /// The distance between two times, in the measure of steps.
    pub(super) fn between(&self, from: f64, to: f64) -> f64 {
        match self.grading {
            Some(grading) => grading.sum(to) - grading.sum(from),
            None => (to - from).abs(),
        }
    }

    /// The longest step if each part between comparisons is divided into equal steps of at most `step`, in the measure
    /// of steps.
    pub(super) fn taken(&self) -> f64 {
        let parts = self.cuts.windows(2);
        parts
            .map(|pair| {
                let length = self.between(pair[0], pair[1]);
                length / (length / self.step).ceil().max(1.0)
            })
            .fold(0.0, larger)
    }

    /// All nodes of a graded mesh.
    pub(crate) fn nodes(&self, grading: &Grading) -> Vec<f64> {
        let mut nodes: Vec<f64> = self.cuts.first().copied().into_iter().collect();
        for pair in self.cuts.windows(2) {
            nodes.extend(grading.nodes(pair[0], pair[1], self.step));
        }
        nodes
    }

    /// Converts the longest steps of attempts, as [taken](Self::taken), to the units of time; returns the shortest and
    /// the longest step of the last one.
    pub(super) fn measure(&mut self, attempts: &mut [Attempt]) -> (f64, f64) {
        let mut extremes = (self.step, self.step);
        for attempt in attempts {
            self.step = again(attempt.step);
            extremes = self.extremes();
            attempt.step = extremes.1;
        }
        extremes
    }

    /// The shortest and the longest step, in time.
    fn extremes(&self) -> (f64, f64) {
        let wider = |(least, most): (f64, f64), length: f64| (least.min(length), most.max(length));
        let none = (f64::INFINITY, 0.0);
        match self.grading {
            Some(grading) => {
                let nodes = self.nodes(grading);
                let lengths = nodes.windows(2).map(|pair| (pair[1] - pair[0]).abs());
                lengths.fold(none, wider)
            }
            None => {
                let parts = self.cuts.windows(2).map(|pair| (pair[1] - pair[0]).abs());
                let lengths = parts.map(|length| length / (length / self.step).ceil().max(1.0));
                lengths.fold(none, wider)
            }
        }
    }
}

/// The step size to ask for such that steps of the length [taken](RunSettings::taken) are taken again: if it were shorter by a
/// rounding error, parts would have one step more.
pub(super) fn again(taken: f64) -> f64 {
    taken * (1.0 + 4.0 * f64::EPSILON)
}

/// The start, the times of comparison including the breaks, and the end.
pub(super) fn cuts(asked: &Asked, grading: Option<&Grading>, step: f64) -> Vec<f64> {
    match grading {
        Some(grading) => graded_cuts(asked, grading, step),
        None => even_cuts(asked, step),
    }
}

/// The same with a grading: well separated both in time and in steps. Fast phases in between affect the later states.
fn graded_cuts(asked: &Asked, grading: &Grading, step: f64) -> Vec<f64> {
    let Range { start, end } = asked.span;
    let differences = (end - start).abs() / MAX_TIMES;
    let mut cuts = vec![start];
    let mut from = start;
    for to in corners(&asked.span, &asked.breaks) {
        let (first, last) = (grading.sum(from), grading.sum(to));
        let parts = ((last - first) / (STEPS_BETWEEN * step)).floor().max(1.0);
        let mut before = from;
        for k in 1..parts as usize {
            let t = grading.time(first + (last - first) * (k as f64 / parts));
            if (t - before).abs() >= differences && (to - t).abs() >= differences {
                cuts.push(t);
                before = t;
            }
        }
        cuts.push(to);
        from = to;
    }
    cuts
}

fn even_cuts(asked: &Asked, step: f64) -> Vec<f64> {
    let Range { start, end } = asked.span;
    let length = (end - start).abs();
    let times = (length / (STEPS_BETWEEN * step)).clamp(1.0, MAX_TIMES);
    let mut cuts = vec![start];
    let mut from = start;
    for to in corners(&asked.span, &asked.breaks) {
        let parts = (times * (to - from).abs() / length).round().max(1.0);
        for k in 1..parts as usize {
            cuts.push(from + (to - from) * (k as f64 / parts));
        }
        cuts.push(to);
        from = to;
    }
    cuts
}
