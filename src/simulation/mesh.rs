//! The elements of a run: where each begins and ends.

use crate::error::RunErrorKind;
use std::ops::Range;
use tfe_runtime::step::Impulse;

/// Times between two breaks, cut into equal steps; the last one may be shorter.
#[derive(Clone, Debug, PartialEq)]
struct Segment {
    start: f64,
    end: f64,
    /// Signed.
    step: f64,
    steps: usize,
    /// Whether the last step is as long as the others.
    whole: bool,
    /// Whether it begins and ends at a break.
    at_break: (bool, bool),
}

/// What was asked of the elements of a run.
pub struct Grid<'a, I> {
    pub(crate) step: Option<f64>,
    pub(crate) nodes: Option<&'a [f64]>,
    pub(crate) breaks: &'a [f64],
    pub(crate) impulses: &'a [I],
}

impl<I> Grid<'_, I> {
    /// The elements of a span, with impulses that act inside them.
    pub(crate) fn mesh<const N: usize>(
        &self,
        span: &Range<f64>,
        impulses: &[Impulse<N>],
    ) -> Result<Mesh<N>, RunErrorKind> {
        if let Some(nodes) = self.nodes {
            return Mesh::through(span, nodes, self.breaks, impulses);
        }
        let step = self.step.unwrap_or((span.end - span.start).abs() / 1000.0);
        Mesh::new(span, step, self.breaks, impulses)
    }
}

/// All elements of a span.
#[derive(Clone, Debug)]
pub struct Mesh<const N: usize> {
    times: Times,
    /// In the order in which the run meets them.
    impulses: Vec<Impulse<N>>,
}

impl<const N: usize> Mesh<N> {
    /// Cuts `span` into steps of size `|step|` that end at every break inside it.
    pub(crate) fn new(
        span: &Range<f64>,
        step: f64,
        breaks: &[f64],
        impulses: &[Impulse<N>],
    ) -> Result<Self, RunErrorKind> {
        check_span(span, step)?;
        Ok(Self {
            impulses: in_order(impulses, span)?,
            times: Times::new(span, step, breaks)?,
        })
    }

    /// The elements between nodes; of impulses those that act there.
    pub(crate) fn of_nodes(
        nodes: &[f64],
        breaks: &[f64],
        impulses: &[Impulse<N>],
    ) -> Result<Self, RunErrorKind> {
        let (start, end) = ends(nodes);
        let impulses = acting(start, end, impulses);
        Self::through(&(start..end), nodes, breaks, &impulses)
    }

    /// The parts between `cuts`, in the order of the run, each in equal steps of at most `step`; of impulses those that act there. Some of the cuts may be `breaks`.
    pub(crate) fn even(
        cuts: &[f64],
        step: f64,
        breaks: &[f64],
        impulses: &[Impulse<N>],
    ) -> Result<Self, RunErrorKind> {
        let (start, end) = ends(cuts);
        let span = start..end;
        check_span(&span, end - start)?;
        Ok(Self {
            impulses: in_order(&acting(start, end, impulses), &span)?,
            times: Times::even(cuts, step, breaks)?,
        })
    }

    /// The elements between given nodes, which begin and end with the span, cut at every break besides.
    pub(crate) fn through(
        span: &Range<f64>,
        nodes: &[f64],
        breaks: &[f64],
        impulses: &[Impulse<N>],
    ) -> Result<Self, RunErrorKind> {
        check_span(span, span.end - span.start)?;
        Ok(Self {
            impulses: in_order(impulses, span)?,
            times: Times::through(span, nodes, breaks)?,
        })
    }

    /// The end of the last element.
    pub(crate) fn end(&self) -> Option<f64> {
        self.times.segments.last().map(|segment| segment.end)
    }

    /// How many elements there are.
    pub(crate) fn steps(&self) -> usize {
        self.times.steps()
    }

    /// Start, end and length of each element. One ends where the next one starts, to the bit; lengths are equal to the bit, which differences of times
    /// are not, so that what was factored for one element serves the next.
    pub(crate) fn elements(&self) -> Elements<'_> {
        Elements {
            segments: &self.times.segments,
            done: 0,
        }
    }

    /// Where the force is first felt in the element that begins at `t` and has the length `h`: at `t`, or beyond it by roundings where that is a break, so that an
    /// element with a point at its start finds the force after the break there.
    pub(crate) fn begin(&self, t: f64, h: f64) -> f64 {
        if self.times.has_breaks {
            self.times.begin(t, h)
        } else {
            t
        }
    }

    /// The impulses that act in the element from `t` to `next`: one at a node belongs to the element that it starts, at the end of the span to the last.
    pub(crate) fn impulses_in(&self, t: f64, next: f64, last: bool) -> &[Impulse<N>] {
        if self.impulses.is_empty() {
            return &[];
        }
        let direction = self.times.direction;
        let before = |limit: f64| {
            self.impulses
                .partition_point(|impulse| direction * impulse.time < direction * limit)
        };
        let end = if last {
            self.impulses.len()
        } else {
            before(next)
        };
        &self.impulses[before(t)..end]
    }
}

/// Refuses a span that is none, and a step with which it cannot be cut.
fn check_span(span: &Range<f64>, step: f64) -> Result<(), RunErrorKind> {
    let Range { start, end } = *span;
    if !(start.is_finite() && end.is_finite()) {
        return Err(RunErrorKind::Span { start, end });
    }
    if !(step.is_finite() && step != 0.0) && start != end {
        return Err(RunErrorKind::Step { step });
    }
    Ok(())
}

/// One, or minus one where a run goes back in time.
fn direction_of(span: &Range<f64>) -> f64 {
    if span.end < span.start { -1.0 } else { 1.0 }
}

/// Impulses in the order in which a run meets them.
fn in_order<const N: usize>(
    impulses: &[Impulse<N>],
    span: &Range<f64>,
) -> Result<Vec<Impulse<N>>, RunErrorKind> {
    let direction = direction_of(span);
    let within = |time: f64| {
        direction * span.start <= direction * time && direction * time <= direction * span.end
    };
    for impulse in impulses {
        if !(within(impulse.time) && impulse.value.iter().all(|value| value.is_finite())) {
            return Err(RunErrorKind::Impulse { time: impulse.time });
        }
    }
    let times: Vec<f64> = impulses.iter().map(|impulse| impulse.time).collect();
    let places = order(&times, direction).into_iter();
    Ok(places.map(|place| impulses[place]).collect())
}

/// When the elements of a span begin and end, whatever they are of.
#[derive(Clone, Debug)]
struct Times {
    segments: Vec<Segment>,
    direction: f64,
    has_breaks: bool,
}

impl Times {
    fn new(span: &Range<f64>, step: f64, breaks: &[f64]) -> Result<Self, RunErrorKind> {
        let Range { start, end } = *span;
        let direction = direction_of(span);
        let within = |time: f64| {
            direction * start <= direction * time && direction * time <= direction * end
        };
        let is_inside = |&time: &f64| within(time) && !is_same(time, start) && !is_same(time, end);
        let mut cuts: Vec<f64> = breaks.iter().copied().filter(is_inside).collect();
        sort(&mut cuts, direction);
        cuts.dedup_by(|a, b| is_same(*a, *b));
        let mut segments = Vec::new();
        let mut from = start;
        for to in cuts.into_iter().chain([end]) {
            if to != from {
                let mut segment = Segment::new(from, to, direction * step.abs())?;
                segment.at_break = (from != start, to != end);
                segments.push(segment);
            }
            from = to;
        }
        let is_at = |time: f64| breaks.iter().any(|one| is_same(*one, time));
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

    fn even(cuts: &[f64], step: f64, breaks: &[f64]) -> Result<Self, RunErrorKind> {
        let (start, end) = ends(cuts);
        let direction = direction_of(&(start..end));
        let mut breaks = breaks.to_vec();
        sort(&mut breaks, direction);
        // Elsewhere nothing may be lost: a rounding at each of many cuts would add up.
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

    fn through(span: &Range<f64>, nodes: &[f64], breaks: &[f64]) -> Result<Self, RunErrorKind> {
        let Range { start, end } = *span;
        let direction = direction_of(span);
        let has_breaks = !breaks.is_empty();
        // A span of roundings is none.
        Self::new(span, end - start, &[])?;
        check_nodes(span, nodes, direction)?;
        let mut nodes = nodes.to_vec();
        let ahead =
            |time: &f64| direction * start < direction * time && direction * time < direction * end;
        let mut breaks: Vec<f64> = breaks.iter().copied().filter(ahead).collect();
        sort(&mut breaks, direction);
        breaks.dedup_by(|a, b| is_same(*a, *b));
        let is_new = |time: &&f64| !is_among(&nodes, **time, direction);
        let new: Vec<f64> = breaks.iter().filter(is_new).copied().collect();
        nodes.extend(new);
        sort(&mut nodes, direction);
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

    fn steps(&self) -> usize {
        self.segments.iter().map(|segment| segment.steps).sum()
    }

    /// [`Mesh::begin`], where there are breaks.
    fn begin(&self, t: f64, h: f64) -> f64 {
        let is_before = |segment: &Segment| self.direction * segment.start < self.direction * t;
        let segment = self.segments.get(self.segments.partition_point(is_before));
        match segment {
            Some(segment) if segment.start == t && segment.at_break.0 => t + rounding(t, h),
            _ => t,
        }
    }
}

/// Elements one after the other: [`Mesh::elements`].
#[derive(Clone)]
pub(crate) struct Elements<'a> {
    /// With those to come.
    segments: &'a [Segment],
    /// Elements of the first of them that are behind.
    done: usize,
}

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

/// The elements of a run without an end.
#[derive(Clone, Debug)]
pub(crate) struct Endless {
    /// Up to the last break, and a last one beyond it.
    segments: Vec<Segment>,
    segment: usize,
    /// Elements of this segment that are behind.
    done: usize,
}

impl Endless {
    pub(crate) fn new(start: f64, step: f64, breaks: &[f64]) -> Result<Self, RunErrorKind> {
        if !(step.is_finite() && step != 0.0) {
            return Err(RunErrorKind::Step { step });
        }
        let direction = step.signum();
        let is_ahead = |time: &f64| {
            time.is_finite() && direction * start < direction * time && !is_same(*time, start)
        };
        let mut ahead: Vec<f64> = breaks.iter().copied().filter(is_ahead).collect();
        sort(&mut ahead, direction);
        let last = ahead.last().copied().unwrap_or(start);
        let span = start..last;
        check_span(&span, step)?;
        let mut segments = Times::new(&span, step, breaks)?.segments;
        segments.push(Segment {
            start: last,
            end: direction * f64::INFINITY,
            step,
            steps: usize::MAX,
            whole: true,
            at_break: (breaks.iter().any(|one| is_same(*one, last)), false),
        });
        Ok(Self {
            segments,
            segment: 0,
            done: 0,
        })
    }

    /// Start, end and length of the next element, and where the force is first felt in it.
    pub(crate) fn element(&self) -> (f64, f64, f64, f64) {
        let (segment, k) = (&self.segments[self.segment], self.done);
        let (t, next, h) = (segment.node(k), segment.node(k + 1), segment.length(k));
        let is_after_break = segment.at_break.0 && k == 0;
        let begin = if is_after_break {
            t + rounding(t, h)
        } else {
            t
        };
        (t, next, h, begin)
    }

    pub(crate) fn advance(&mut self) {
        self.done += 1;
        if self.done == self.segments[self.segment].steps {
            (self.segment, self.done) = (self.segment + 1, 0);
        }
    }
}

fn ends(times: &[f64]) -> (f64, f64) {
    match times {
        [start, .., end] => (*start, *end),
        _ => (0.0, 0.0),
    }
}

/// The impulses between two times.
fn acting<const N: usize>(start: f64, end: f64, impulses: &[Impulse<N>]) -> Vec<Impulse<N>> {
    let inside =
        |impulse: &&Impulse<N>| start.min(end) <= impulse.time && impulse.time <= start.max(end);
    impulses.iter().filter(inside).copied().collect()
}

/// The length of an element that ends at a break: shorter by roundings, so that an element with a point at its end finds the force before the break there.
pub(crate) fn up_to_break(start: f64, end: f64) -> f64 {
    (end - start) - rounding(end, end - start)
}

/// Whether two times are one but for rounding.
pub(super) fn is_same(a: f64, b: f64) -> bool {
    (a - b).abs() <= 8.0 * f64::EPSILON * a.abs().max(b.abs())
}

/// Whether a time is one of some in the order of a run, but for rounding.
fn is_among(times: &[f64], time: f64, direction: f64) -> bool {
    let after = times.partition_point(|one| direction * one < direction * time);
    let near = &times[after.saturating_sub(1)..times.len().min(after + 1)];
    near.iter().any(|one| is_same(*one, time))
}

/// Some roundings of the time, in the direction of the run.
fn rounding(t: f64, h: f64) -> f64 {
    h.signum() * 4.0 * f64::EPSILON * t.abs().max(h.abs())
}

/// Refuses nodes that are not those of a run over the span.
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

/// A segment for each element. Where lengths in a row differ by roundings alone they are made equal to the bit, without changing their sum.
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
        }));
        from += count;
    }
    segments
}

/// Whether `time` belongs to the element from `t` to `next`.
pub(crate) fn within(time: f64, t: f64, next: f64) -> bool {
    if t <= next {
        t <= time && time < next
    } else {
        t >= time && time > next
    }
}

impl Segment {
    /// A count of steps beyond this is a mistake in units rather than a run: it would take years.
    const MOST_STEPS: f64 = 1e15;

    /// A step of fewer roundings of the time has points that share times.
    const LEAST_ROUNDINGS: f64 = 64.0;

    fn new(start: f64, end: f64, step: f64) -> Result<Self, RunErrorKind> {
        let ratio = (end - start) / step;
        if !(ratio <= Self::MOST_STEPS) {
            return Err(RunErrorKind::TooManySteps {
                span: end - start,
                step,
            });
        }
        // 10 / 0.01 is 1000 steps although the quotient may be 1000.0000000000001.
        let nearest = ratio.round();
        let whole = (ratio - nearest).abs() <= 1e-9 * nearest.max(1.0);
        let steps = if whole { nearest } else { ratio.ceil() }.max(1.0);
        // A step that leads to the end but for rounding stays as it was given, so that runs to different ends have the same nodes.
        let rounding = 4.0 * f64::EPSILON * start.abs().max(end.abs());
        let is_exact = ((end - start) - steps * step).abs() <= rounding;
        let step = if whole && !is_exact {
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
        };
        segment.check_resolution()?;
        Ok(segment)
    }

    /// Refuses steps that are roundings of the time: nodes would share times, and points of an element, too.
    fn check_resolution(&self) -> Result<(), RunErrorKind> {
        let time = self.start.abs().max(self.end.abs());
        let least = Self::LEAST_ROUNDINGS * f64::EPSILON * time;
        if self.step.abs() < least {
            return Err(RunErrorKind::StepUnresolved {
                time,
                step: self.step,
                least,
            });
        }
        Ok(())
    }

    /// The length of the k-th element.
    fn length(&self, k: usize) -> f64 {
        let mut length = if self.whole || k + 1 < self.steps {
            self.step
        } else {
            self.end - self.node(k)
        };
        if self.at_break.0 && k == 0 {
            length -= rounding(self.start, length);
        }
        if self.at_break.1 && k + 1 == self.steps {
            length -= rounding(self.end, length);
        }
        length
    }

    /// The k-th node: a product, not a sum, and the end of the segment exactly.
    fn node(&self, k: usize) -> f64 {
        if k == self.steps {
            self.end
        } else {
            self.start + k as f64 * self.step
        }
    }
}

/// Puts times in the order in which a run meets them. Not generic, so that it is compiled once.
fn sort(times: &mut [f64], direction: f64) {
    times.sort_by(|a, b| (direction * a).total_cmp(&(direction * b)));
}

/// The places of times in the order in which a run meets them; of equal ones the first comes first.
fn order(times: &[f64], direction: f64) -> Vec<usize> {
    let mut places: Vec<usize> = (0..times.len()).collect();
    places.sort_by(|&a, &b| (direction * times[a]).total_cmp(&(direction * times[b])));
    places
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn nodes(span: Range<f64>, step: f64, breaks: &[f64]) -> Vec<f64> {
        let mesh = Mesh::<1>::new(&span, step, breaks, &[]).expect("a good mesh");
        let elements: Vec<_> = mesh.elements().collect();
        assert_eq!(elements.len(), mesh.steps());
        for k in 0..=elements.len() {
            let mut rest = mesh.elements();
            assert_eq!(rest.size_hint().0, elements.len());
            assert_eq!(rest.nth(k), elements.get(k).copied());
            assert_eq!(rest.size_hint().0, elements.len().saturating_sub(k + 1));
        }
        for pair in elements.windows(2) {
            assert_eq!(pair[0].1.to_bits(), pair[1].0.to_bits());
        }
        let mut nodes: Vec<_> = elements.first().map(|e| e.0).into_iter().collect();
        nodes.extend(elements.iter().map(|e| e.1));
        nodes
    }

    #[test]
    fn ends_exactly_at_the_end() {
        assert_eq!(
            nodes(0.0..1.0, 0.3, &[]),
            [0.0, 0.3, 0.6, 0.8999999999999999, 1.0]
        );
        let many = nodes(0.0..10.0, 0.01, &[]);
        assert_eq!((many.len(), many[1000]), (1001, 10.0));
    }

    #[test]
    fn backward_and_empty_spans() {
        assert_eq!(nodes(1.0..0.0, 0.5, &[]), [1.0, 0.5, 0.0]);
        assert!(nodes(2.0..2.0, 0.5, &[]).is_empty());
    }

    #[test]
    fn elements_end_at_breaks() {
        assert_eq!(nodes(0.0..1.0, 0.5, &[0.75, 7.0]), [0.0, 0.5, 0.75, 1.0]);
    }

    #[test]
    fn bad_spans_and_steps_are_errors() {
        let check = |span: Range<f64>, step| Mesh::<1>::new(&span, step, &[], &[]).err();
        assert!(matches!(
            check(0.0..1.0, 0.0),
            Some(RunErrorKind::Step { .. })
        ));
        assert!(matches!(
            check(0.0..1.0, f64::NAN),
            Some(RunErrorKind::Step { .. })
        ));
        assert!(matches!(
            check(0.0..f64::INFINITY, 0.1),
            Some(RunErrorKind::Span { .. })
        ));
        assert!(matches!(
            check(0.0..1.0, 1e-300),
            Some(RunErrorKind::TooManySteps { .. })
        ));
    }

    #[test]
    fn an_impulse_at_a_node_belongs_to_the_element_it_starts() {
        let impulse = |time| Impulse { time, value: [1.0] };
        let impulses = [impulse(1.0), impulse(0.5), impulse(0.0), impulse(0.7)];
        let mesh = Mesh::new(&(0.0..1.0), 0.5, &[], &impulses).expect("a good mesh");
        let times = |t, next, last| {
            mesh.impulses_in(t, next, last)
                .iter()
                .map(|i| i.time)
                .collect::<Vec<_>>()
        };
        assert_eq!(times(0.0, 0.5, false), [0.0]);
        assert_eq!(times(0.5, 1.0, true), [0.5, 0.7, 1.0]);
    }
}
