//! The times of elements: equal steps between breaks, or between given nodes.

use crate::error::RunErrorKind;
use crate::motion::{
    MAX_STEPS, MIN_ROUNDINGS, breaks_within, count_steps, direction_of, is_same_time, leads_to_end,
    sort_times,
};
use std::ops::Range;
use tfe_runtime::{Element, Family, Rule};

/// A time interval divided into equal steps; the last one may be shorter.
#[derive(Clone, Debug, PartialEq)]
struct Segment {
    start: f64,
    end: f64,
    /// With sign.
    step: f64,
    steps: usize,
    /// Whether the last step is as long as the others.
    whole: bool,
    /// Whether the interval begins and ends at a break.
    at_break: (bool, bool),
    at_ends: AtEnds,
}

/// What an element evaluates at its ends, where a break may be.
///
/// There it must see what is on one side of the break. Its length is not changed for that, because the time that is left
/// out at each of many breaks would add up: all its times are moved by a few ulps instead.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum AtEnds {
    /// Nothing.
    Nothing,
    /// Forces at the end, not at the start (Radau).
    LastPoint,
    /// Forces (Lobatto) or constraints at both ends.
    Both,
}

impl AtEnds {
    /// What this element evaluates at its ends.
    pub(crate) fn of(element: Element, is_constrained: bool) -> Self {
        match (element.rule(), element.family()) {
            (Rule::Lobatto(_), _) => Self::Both,
            _ if is_constrained => Self::Both,
            (_, Family::Radau) => Self::LastPoint,
            _ => Self::Nothing,
        }
    }

    /// How far the times at which an element from `start` to `end` is evaluated are moved, if it begins or ends at a
    /// break.
    fn shift(self, at_break: (bool, bool), (start, end): (f64, f64)) -> f64 {
        let few = beside(start, end);
        match (self, at_break) {
            (Self::Nothing, _) | (_, (false, false)) => 0.0,
            (Self::LastPoint, _) | (Self::Both, (false, true)) => -few,
            (Self::Both, (true, _)) => few,
        }
    }

    /// The time that an element from `start` to `end` leaves out: no shift keeps both ends between two breaks.
    fn left_out(self, at_break: (bool, bool), (start, end): (f64, f64)) -> f64 {
        match (self, at_break) {
            (Self::Both, (true, true)) => 2.0 * beside(start, end),
            _ => 0.0,
        }
    }
}

/// Refuses an invalid span, and a step that cannot divide it.
pub(super) fn check_span(span: &Range<f64>, step: f64) -> Result<(), RunErrorKind> {
    let Range { start, end } = *span;
    // Also the difference of two finite times may overflow.
    if !(end - start).is_finite() {
        return Err(RunErrorKind::Span { start, end });
    }
    if !(step.is_finite() && step != 0.0) && start != end {
        return Err(RunErrorKind::Step { step });
    }
    Ok(())
}

/// The times of the elements of a span.
#[derive(Clone, Debug)]
pub(super) struct Times {
    segments: Vec<Segment>,
    /// 1, or −1 in backward integration.
    pub(super) direction: f64,
    has_breaks: bool,
}

impl Times {
    /// Steps of size `|step|` that end at every break inside the span.
    pub(super) fn new(span: &Range<f64>, step: f64, breaks: &[f64]) -> Result<Self, RunErrorKind> {
        let Range { start, end } = *span;
        let direction = direction_of(span);
        let mut segments = Vec::new();
        let mut from = start;
        for to in breaks_within(span, breaks).into_iter().chain([end]) {
            if to != from {
                let mut segment = Segment::new(from, to, direction * step.abs())?;
                segment.at_break = (from != start, to != end);
                segments.push(segment);
            }
            from = to;
        }
        let is_at = |time: f64| breaks.iter().any(|one| is_same_time(*one, time));
        if let Some(first) = segments.first_mut() {
            first.at_break.0 = is_at(start);
        }
        if let Some(last) = segments.last_mut() {
            last.at_break.1 = is_at(end);
        }
        Ok(Self {
            segments,
            direction,
            has_breaks: !breaks.is_empty(),
        })
    }

    /// Divides each part between `cuts`, in the order of the run, into equal steps of at most `step`. Some of the cuts
    /// may be `breaks`.
    pub(super) fn even(cuts: &[f64], step: f64, breaks: &[f64]) -> Result<Self, RunErrorKind> {
        let (start, end) = ends(cuts);
        check_span(&(start..end), end - start)?;
        let direction = direction_of(&(start..end));
        let mut breaks = breaks.to_vec();
        sort_times(&mut breaks, direction);
        // At the other cuts the length must not change: an ulp at each of many cuts would add up.
        let is_break = |time: f64| is_among(&breaks, time, direction);
        let segment = |pair: &[f64]| {
            let steps = ((pair[1] - pair[0]).abs() / step).ceil().max(1.0);
            let mut segment = Segment::new(pair[0], pair[1], (pair[1] - pair[0]) / steps)?;
            segment.at_break = (is_break(pair[0]), is_break(pair[1]));
            Ok(segment)
        };
        Ok(Self {
            segments: cuts
                .windows(2)
                .map(segment)
                .collect::<Result<_, RunErrorKind>>()?,
            direction,
            has_breaks: !breaks.is_empty(),
        })
    }

    /// The elements between given nodes; breaks are added to these.
    pub(super) fn of_nodes(nodes: &[f64], breaks: &[f64]) -> Result<Self, RunErrorKind> {
        let (start, end) = ends(nodes);
        let span = start..end;
        check_span(&span, end - start)?;
        Self::through(&span, nodes, breaks)
    }

    /// The elements between given nodes, which begin and end with the span; breaks are added to the nodes.
    pub(super) fn through(
        span: &Range<f64>,
        nodes: &[f64],
        breaks: &[f64],
    ) -> Result<Self, RunErrorKind> {
        let Range { start, end } = *span;
        let direction = direction_of(span);
        let has_breaks = !breaks.is_empty();
        // An interval of a few ulps is dropped.
        Self::new(span, end - start, &[])?;
        check_nodes(span, nodes, direction)?;
        let mut nodes = nodes.to_vec();
        let mut breaks = breaks.to_vec();
        sort_times(&mut breaks, direction);
        let mut new = breaks_within(span, &breaks);
        new.retain(|time| !is_among(&nodes, *time, direction));
        nodes.extend(new);
        sort_times(&mut nodes, direction);
        nodes.dedup();
        let mut segments = single_steps(&nodes);
        for segment in &mut segments {
            let Segment { start, end, .. } = *segment;
            segment.at_break = (
                is_among(&breaks, start, direction),
                is_among(&breaks, end, direction),
            );
            segment.check_resolution()?;
        }
        Ok(Self {
            segments,
            direction,
            has_breaks,
        })
    }

    /// The same elements for what is evaluated at their ends; without this call, nothing.
    pub(super) fn with(mut self, at_ends: AtEnds) -> Self {
        for segment in &mut self.segments {
            segment.at_ends = at_ends;
        }
        self.has_breaks &= at_ends != AtEnds::Nothing;
        self
    }

    /// The end of the last element.
    pub(super) fn end(&self) -> Option<f64> {
        self.segments.last().map(|segment| segment.end)
    }

    /// The number of elements.
    pub(super) fn steps(&self) -> usize {
        self.elements().len()
    }

    /// The ends of the elements that a run from `start` passes after `last`.
    pub(super) fn ends_behind(&self, last: f64, start: f64) -> Vec<f64> {
        let ends = self.elements().map(|(_, next, _)| next);
        let is_ahead = |next: &f64| (next - last) * (next - start).signum() > 0.0;
        ends.filter(is_ahead).collect()
    }

    /// Start, end and length of each element. An element ends exactly where the next one starts. Lengths of equal steps
    /// are equal to the bit, unlike differences of times, so that one factorisation serves many elements.
    pub(super) fn elements(&self) -> Elements<'_> {
        Elements {
            segments: &self.segments,
            done: 0,
        }
    }

    /// The time from which the times of the points of the element from `t` to `t + h` are counted: `t`, or a few ulps
    /// before or after it if a break is at an end of the element at which something is evaluated.
    #[inline]
    pub(super) fn begin(&self, t: f64, h: f64) -> f64 {
        if self.has_breaks {
            self.beside_breaks(t, h)
        } else {
            t
        }
    }

    fn beside_breaks(&self, t: f64, h: f64) -> f64 {
        let is_behind = |segment: &Segment| self.direction * segment.start <= self.direction * t;
        let behind = self.segments.partition_point(is_behind);
        let Some(segment) = behind.checked_sub(1).and_then(|k| self.segments.get(k)) else {
            return t;
        };
        let at_start = segment.at_break.0 && segment.start == t;
        let at_end = segment.at_break.1 && is_same_time(t + h, segment.end);
        t + segment.at_ends.shift((at_start, at_end), (t, t + h))
    }
}

/// The iterator of [`Times::elements`].
#[derive(Clone)]
pub(crate) struct Elements<'a> {
    /// The current segment and those to come.
    segments: &'a [Segment],
    /// The number of elements of the current segment that are done.
    done: usize,
}

impl ExactSizeIterator for Elements<'_> {}

impl Iterator for Elements<'_> {
    type Item = (f64, f64, f64);

    #[inline]
    fn next(&mut self) -> Option<Self::Item> {
        self.nth(0)
    }

    fn size_hint(&self) -> (usize, Option<usize>) {
        let steps: usize = self.segments.iter().map(|segment| segment.steps).sum();
        let left = steps - self.done;
        (left, Some(left))
    }

    #[inline]
    fn nth(&mut self, mut left_out: usize) -> Option<Self::Item> {
        while let [segment, rest @ ..] = self.segments {
            let k = self.done;
            if left_out < segment.steps - k {
                let k = k + left_out;
                self.done = k + 1;
                return Some((segment.node(k), segment.node(k + 1), segment.length(k)));
            }
            left_out -= segment.steps - k;
            (self.segments, self.done) = (rest, 0);
        }
        None
    }
}

/// The elements of an endless run.
#[derive(Clone, Debug)]
pub(crate) struct Endless {
    /// The segments up to the last break, and an unlimited one after it.
    segments: Vec<Segment>,
    segment: usize,
    /// The number of elements of the current segment that are done.
    done: usize,
}

impl Endless {
    pub(crate) fn new(start: f64, step: f64, breaks: &[f64]) -> Result<Self, RunErrorKind> {
        if !(step.is_finite() && step != 0.0) {
            return Err(RunErrorKind::Step { step });
        }
        let direction = step.signum();
        let is_ahead = |time: &f64| {
            time.is_finite() && direction * start < direction * time && !is_same_time(*time, start)
        };
        let mut ahead: Vec<f64> = breaks.iter().copied().filter(is_ahead).collect();
        sort_times(&mut ahead, direction);
        let last = ahead.last().copied().unwrap_or(start);
        let span = start..last;
        check_span(&span, step)?;
        let mut segments = Times::new(&span, step, breaks)?.segments;
        check_resolution(last, step)?;
        segments.push(Segment {
            start: last,
            end: direction * f64::INFINITY,
            step,
            steps: usize::MAX,
            whole: true,
            at_break: (breaks.iter().any(|one| is_same_time(*one, last)), false),
            at_ends: AtEnds::Nothing,
        });
        Ok(Self {
            segments,
            segment: 0,
            done: 0,
        })
    }

    /// The same elements for what is evaluated at their ends; see [`Times::with`].
    pub(crate) fn with(mut self, at_ends: AtEnds) -> Self {
        for segment in &mut self.segments {
            segment.at_ends = at_ends;
        }
        self
    }

    /// Start, end and length of the next element, and the time from which those of its points are counted; see
    /// [`Times::begin`].
    pub(crate) fn element(&self) -> (f64, f64, f64, f64) {
        let (segment, k) = (&self.segments[self.segment], self.done);
        let (t, next, h) = (segment.node(k), segment.node(k + 1), segment.length(k));
        let shift = segment.at_ends.shift(segment.breaks_of(k), (t, t + h));
        (t, next, h, t + shift)
    }

    pub(crate) fn advance(&mut self) {
        self.done += 1;
        if self.done == self.segments[self.segment].steps {
            (self.segment, self.done) = (self.segment + 1, 0);
        }
    }
}

/// The first and the last of at least two times.
fn ends(times: &[f64]) -> (f64, f64) {
    match times {
        [start, .., end] => (*start, *end),
        _ => (0.0, 0.0),
    }
}

/// The length of a trial step that ends at a break: a few ulps shorter, so that an element with a point at its end sees
/// the force before the break.
pub(crate) fn up_to_break(start: f64, end: f64) -> f64 {
    (end - start) - beside(start, end)
}

/// Whether a time is one of a list in the order of the run, up to rounding.
fn is_among(times: &[f64], time: f64, direction: f64) -> bool {
    let after = times.partition_point(|one| direction * one < direction * time);
    let near = &times[after.saturating_sub(1)..times.len().min(after + 1)];
    near.iter().any(|one| is_same_time(*one, time))
}

/// A few ulps of the times of an element, in the direction of the run.
fn beside(start: f64, end: f64) -> f64 {
    (end - start).signum() * 4.0 * f64::EPSILON * start.abs().max(end.abs())
}

/// Refuses nodes that do not form a run over the span.
fn check_nodes(span: &Range<f64>, nodes: &[f64], direction: f64) -> Result<(), RunErrorKind> {
    let Range { start, end } = *span;
    let follows = |k: usize| k == 0 || direction * nodes[k - 1] < direction * nodes[k];
    let bad = (0..nodes.len()).find(|&k| !(nodes[k].is_finite() && follows(k)));
    if let Some(node) = bad {
        let time = nodes[node];
        return Err(RunErrorKind::NodeOrder { node, time });
    }
    let (first, last) = (nodes.first().copied(), nodes.last().copied());
    if (first, last) == (Some(start), Some(end)) {
        Ok(())
    } else {
        Err(RunErrorKind::NodeEnds {
            first,
            last,
            start,
            end,
        })
    }
}

/// Refuses steps of a few ulps of the time: nodes, or points of an element, would coincide.
fn check_resolution(time: f64, step: f64) -> Result<(), RunErrorKind> {
    let least = MIN_ROUNDINGS * f64::EPSILON * time.abs();
    if step.abs() < least {
        return Err(RunErrorKind::StepUnresolved { time, step, least });
    }
    Ok(())
}

/// Makes a segment for each element. Successive lengths that differ by rounding only are made equal to the bit, without
/// changing their sum.
fn single_steps(nodes: &[f64]) -> Vec<Segment> {
    let mut segments: Vec<Segment> = Vec::with_capacity(nodes.len().saturating_sub(1));
    let mut from = 0;
    while from + 1 < nodes.len() {
        let first = nodes[from + 1] - nodes[from];
        let alike = |pair: &&[f64]| {
            let rounding = 2.0 * f64::EPSILON * pair[0].abs().max(pair[1].abs());
            (pair[1] - pair[0] - first).abs() <= 2.0 * rounding
        };
        let count = nodes[from..].windows(2).take_while(alike).count().max(1);
        let step = (nodes[from + count] - nodes[from]) / count as f64;
        segments.extend(nodes[from..=from + count].windows(2).map(|pair| Segment {
            start: pair[0],
            end: pair[1],
            step,
            steps: 1,
            whole: true,
            at_break: (false, false),
            at_ends: AtEnds::Nothing,
        }));
        from += count;
    }
    segments
}

impl Segment {
    fn new(start: f64, end: f64, step: f64) -> Result<Self, RunErrorKind> {
        let ratio = (end - start) / step;
        if !(ratio <= MAX_STEPS) {
            return Err(RunErrorKind::TooManySteps {
                span: end - start,
                step,
            });
        }
        let span = start..end;
        let (steps, whole) = count_steps(&span, step);
        // A step that reaches the end up to rounding is kept as given, so that runs to different ends share their
        // nodes.
        let step = if whole && !leads_to_end(&span, step, steps) {
            (end - start) / steps
        } else {
            step
        };
        let segment = Self {
            start,
            end,
            step,
            steps: steps as usize,
            whole,
            at_break: (false, false),
            at_ends: AtEnds::Nothing,
        };
        segment.check_resolution()?;
        Ok(segment)
    }

    fn check_resolution(&self) -> Result<(), RunErrorKind> {
        check_resolution(self.start.abs().max(self.end.abs()), self.step)
    }

    /// Whether the k-th element begins and ends at a break.
    fn breaks_of(&self, k: usize) -> (bool, bool) {
        let (at_start, at_end) = self.at_break;
        (at_start && k == 0, at_end && k + 1 == self.steps)
    }

    /// The length of the k-th element.
    fn length(&self, k: usize) -> f64 {
        let length = if self.whole || k + 1 < self.steps {
            self.step
        } else {
            self.end - self.node(k)
        };
        if self.at_ends == AtEnds::Both {
            let ends = (self.node(k), self.node(k + 1));
            return length - self.at_ends.left_out(self.breaks_of(k), ends);
        }
        length
    }

    /// The k-th node: computed by a product, not a sum; the last one is exactly the end.
    fn node(&self, k: usize) -> f64 {
        if k == self.steps {
            self.end
        } else {
            self.start + k as f64 * self.step
        }
    }
}
