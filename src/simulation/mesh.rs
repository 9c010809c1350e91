//! The mesh of a run: its elements and the impulses that act in them.

use super::times::{AtEnds, Elements, Times, check_span};
use crate::error::RunErrorKind;
use crate::motion::{default_step, direction_of};
use std::ops::Range;
use tfe_runtime::step::Impulse;

/// The options that determine the mesh of a run.
pub struct Grid<'a, I> {
    pub(crate) step: Option<f64>,
    pub(crate) nodes: Option<&'a [f64]>,
    pub(crate) breaks: &'a [f64],
    pub(crate) impulses: &'a [I],
}

impl<I> Grid<'_, I> {
    /// The mesh of a span, with the impulses that act inside it.
    pub(crate) fn mesh<const N: usize>(
        &self,
        span: &Range<f64>,
        impulses: &[Impulse<N>],
    ) -> Result<Mesh<N>, RunErrorKind> {
        if let Some(nodes) = self.nodes {
            return Mesh::through(span, nodes, self.breaks, impulses);
        }
        let step = self.step.unwrap_or_else(|| default_step(span));
        Mesh::new(span, step, self.breaks, impulses)
    }
}

/// The elements of a span.
#[derive(Clone, Debug)]
pub struct Mesh<const N: usize> {
    times: Times,
    impulses: Ordered<N>,
    /// The step size, if the steps are equal.
    step: Option<f64>,
}

impl<const N: usize> Mesh<N> {
    /// Divides `span` into steps of size `|step|` that end at every break inside it.
    pub(crate) fn new(
        span: &Range<f64>,
        step: f64,
        breaks: &[f64],
        impulses: &[Impulse<N>],
    ) -> Result<Self, RunErrorKind> {
        check_span(span, step)?;
        Ok(Self {
            impulses: Ordered::new(impulses, span)?,
            times: Times::new(span, step, breaks)?,
            step: (step != 0.0).then_some(step.abs()),
        })
    }

    /// Given elements of a run, and all of its impulses.
    pub(super) fn of(times: &Times, impulses: &Ordered<N>) -> Self {
        Self {
            times: times.clone(),
            impulses: impulses.clone(),
            step: None,
        }
    }

    /// The elements between given nodes, which begin and end with the span; breaks are added to the nodes.
    pub(crate) fn through(
        span: &Range<f64>,
        nodes: &[f64],
        breaks: &[f64],
        impulses: &[Impulse<N>],
    ) -> Result<Self, RunErrorKind> {
        check_span(span, span.end - span.start)?;
        Ok(Self {
            impulses: Ordered::new(impulses, span)?,
            times: Times::through(span, nodes, breaks)?,
            step: None,
        })
    }

    /// The same elements for what is evaluated at their ends; see [`Times::with`].
    pub(crate) fn with(self, at_ends: AtEnds) -> Self {
        Self {
            times: self.times.with(at_ends),
            ..self
        }
    }

    /// The step size, if the steps are equal; elements that end at breaks may be shorter.
    pub(crate) fn step(&self) -> Option<f64> {
        self.step
    }

    /// 1, or −1 in backward integration.
    pub(crate) fn direction(&self) -> f64 {
        self.times.direction
    }

    /// The times of the elements.
    pub(super) fn times(&self) -> &Times {
        &self.times
    }

    /// The number of elements.
    pub(crate) fn steps(&self) -> usize {
        self.times.steps()
    }

    /// The length of the first element.
    pub(crate) fn first_step(&self) -> Option<f64> {
        self.elements().next().map(|(.., h)| h)
    }

    /// Start, end and length of each element; see [`Times::elements`].
    pub(crate) fn elements(&self) -> Elements<'_> {
        self.times.elements()
    }

    /// The time from which those of the points of an element are counted; see [`Times::begin`].
    pub(crate) fn begin(&self, t: f64, h: f64) -> f64 {
        self.times.begin(t, h)
    }

    /// The impulses that act in an element; see [`Ordered::within`].
    pub(crate) fn impulses_in(&self, t: f64, next: f64, last: bool) -> &[Impulse<N>] {
        self.impulses.within(t, next, last)
    }
}

/// Impulses in the order in which a run passes them.
#[derive(Clone, Debug)]
pub(super) struct Ordered<const N: usize> {
    impulses: Vec<Impulse<N>>,
    /// 1, or −1 in backward integration.
    direction: f64,
}

impl<const N: usize> Ordered<N> {
    /// The impulses of a run over a span.
    ///
    /// # Errors
    /// An impulse outside the span, or one that is not finite.
    fn new(impulses: &[Impulse<N>], span: &Range<f64>) -> Result<Self, RunErrorKind> {
        for impulse in impulses {
            check_within(span, impulse.time, &impulse.value)?;
        }
        Ok(Self::of(impulses, span))
    }

    /// The impulses of a run over a span, all of which are known to lie in it.
    pub(super) fn of(impulses: &[Impulse<N>], span: &Range<f64>) -> Self {
        let direction = direction_of(span);
        Self {
            impulses: in_order(impulses, |impulse| impulse.time, direction),
            direction,
        }
    }

    /// The impulses that act in the element from `t` to `next`. An impulse at a node belongs to the element that starts
    /// there; at the end of a mesh, to its last element.
    pub(super) fn within(&self, t: f64, next: f64, last: bool) -> &[Impulse<N>] {
        if self.impulses.is_empty() {
            return &[];
        }
        let place = |impulse: &Impulse<N>| self.direction * impulse.time;
        let (start, end) = (self.direction * t, self.direction * next);
        let is_before = |impulse: &Impulse<N>| place(impulse) < start;
        let acts = |impulse: &Impulse<N>| place(impulse) < end || (last && place(impulse) <= end);
        let from = self.impulses.partition_point(is_before);
        &self.impulses[from..self.impulses.partition_point(acts)]
    }
}

/// Refuses an impulse outside a span, or one that is not finite.
fn check_within(span: &Range<f64>, time: f64, impulse: &[f64]) -> Result<(), RunErrorKind> {
    let direction = direction_of(span);
    let [start, at, end] = [span.start, time, span.end].map(|time| direction * time);
    if start <= at && at <= end && impulse.iter().all(|value| value.is_finite()) {
        return Ok(());
    }
    Err(RunErrorKind::Impulse { time })
}

/// Whether `time` belongs to the element from `t` to `next`.
pub(crate) fn within(time: f64, t: f64, next: f64) -> bool {
    if t <= next {
        t <= time && time < next
    } else {
        t >= time && time > next
    }
}

/// Impulses of any kind in the order in which a run in this direction passes them.
pub(super) fn in_order<I: Clone>(impulses: &[I], time: fn(&I) -> f64, direction: f64) -> Vec<I> {
    let (mut times, mut ordered) = (Vec::new(), Vec::with_capacity(impulses.len()));
    for impulse in impulses {
        times.push(time(impulse));
    }
    for place in order(&times, direction) {
        ordered.push(impulses[place].clone());
    }
    ordered
}

/// The indices of times in the order in which a run passes them; the order of equal times is kept.
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

    /// 9 steps end one ulp before 1e9 + 0.009; a tenth step would have no length.
    #[test]
    fn roundings_of_the_times_are_no_steps() {
        for (start, step) in [(1e9, 1e-3), (-1e9, 1e-3), (1.7e9, 0.01)] {
            for count in 1..100_u32 {
                let end = start + f64::from(count) * step;
                for span in [start..end, end..start] {
                    let mesh = Mesh::<1>::new(&span, step, &[], &[]).expect("a good mesh");
                    assert_eq!(mesh.steps(), count as usize, "{span:?}");
                    let mut lengths = mesh.elements().map(|(.., h)| h.abs());
                    assert!(lengths.all(|length| length == step), "{span:?}");
                }
            }
        }
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
