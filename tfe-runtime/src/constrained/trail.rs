//! A trail: the solutions of the elements of one run, as initial guesses for another run of the same motion.

use crate::basis::{MAX_NODES, legendre, legendre_slopes};
use crate::constrained::layout::Layout;
use crate::legendre::largest;
use crate::model::{Constraint, Model};
use crate::scheme::{MAX_RATES, SchemeRef};
use alloc::vec::Vec;

/// The polynomials of rates and multipliers of the elements of a run; written by
/// [`Stepper::leave`](crate::step::Stepper::leave), read by [`Stepper::foresee`](crate::step::Stepper::foresee).
#[derive(Clone, Debug, Default)]
pub struct Trail {
    /// Start and length of each element.
    spans: Vec<(f64, f64)>,
    /// For each element the Legendre coefficients of the rates, the interior multipliers, and the multipliers of the
    /// nodes; one element after the other.
    numbers: Vec<f64>,
    /// The degree of the elements.
    degree: usize,
}

/// The dimensions of a model.
#[derive(Clone, Copy)]
pub(crate) struct Of<'a> {
    coordinates: usize,
    constraints: &'a [Constraint],
}

impl Of<'static> {
    pub(crate) const fn model<M: Model<N>, const N: usize>() -> Self {
        Self {
            coordinates: N,
            constraints: M::CONSTRAINTS,
        }
    }
}

impl Of<'_> {
    /// The layout of the unknowns of its elements.
    fn layout(self, scheme: &SchemeRef<'_>) -> Layout {
        Layout::new(&scheme.element, self.coordinates, self.constraints.len())
    }
}

/// The initial guess of a coming step.
#[derive(Clone, Debug, Default)]
pub(crate) struct Foreseen {
    /// The start and length of that step.
    step: Option<(f64, f64)>,
    unknowns: Vec<f64>,
}

impl Foreseen {
    /// Finds the guess for a step; without a step, there is none.
    pub(crate) fn look(
        &mut self,
        trail: &Trail,
        scheme: &SchemeRef<'_>,
        of: Of<'_>,
        step: (f64, f64),
    ) {
        self.unknowns.resize(of.layout(scheme).size(), 0.0);
        let is_known = trail.foresee(scheme, of, step, &mut self.unknowns);
        self.step = is_known.then_some(step);
    }

    /// Writes the guess for a step, except for the velocity at its end; false if there is none.
    pub(crate) fn take(
        &mut self,
        scheme: &SchemeRef<'_>,
        of: Of<'_>,
        step: (f64, f64),
        unknowns: &mut [f64],
    ) -> bool {
        if self.step.take() != Some(step) {
            return false;
        }
        let layout = of.layout(scheme);
        let (end, node) = (layout.end(0), layout.node(0));
        unknowns[..end].copy_from_slice(&self.unknowns[..end]);
        unknowns[node..layout.size()].copy_from_slice(&self.unknowns[node..]);
        true
    }
}

/// An element of a trail.
#[derive(Clone, Copy)]
struct Found<'a> {
    span: (f64, f64),
    numbers: &'a [f64],
    degree: usize,
}

impl Trail {
    /// A trail without elements.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Forgets all elements.
    pub fn clear(&mut self) {
        self.spans.clear();
        self.numbers.clear();
    }

    /// The time at which the trail ends; `None` without elements.
    #[must_use]
    pub fn end(&self) -> Option<f64> {
        self.spans.last().map(|(start, length)| start + length)
    }

    /// Adds an element with Gauss points; if its degree differs from that of the elements before, it replaces them.
    pub(crate) fn push(
        &mut self,
        scheme: &SchemeRef<'_>,
        of: Of<'_>,
        span: (f64, f64),
        unknowns: &[f64],
    ) {
        let (layout, n) = (of.layout(scheme), of.coordinates);
        let degree = layout.degree();
        if self.degree != degree {
            self.clear();
            self.degree = degree;
        }
        let sum = |weights: &[f64], place: &dyn Fn(usize) -> usize| {
            let pairs = weights.iter().enumerate();
            pairs.map(|(l, weight)| weight * unknowns[place(l)]).sum()
        };
        let rows = scheme.rate.chunks_exact(scheme.unknowns());
        for weights in rows.clone() {
            for a in 0..n {
                self.numbers.push(sum(weights, &|l| l * n + a));
            }
        }
        for (j, weights) in rows.enumerate() {
            for (c, constraint) in of.constraints.iter().enumerate() {
                let number = if constraint.kind.is_holonomic() {
                    unknowns[layout.inside(j, c)]
                } else {
                    sum(weights, &|l| layout.inside(l, c))
                };
                self.numbers.push(number);
            }
        }
        for c in 0..of.constraints.len() {
            self.numbers.push(unknowns[layout.node(c)]);
        }
        self.spans.push(span);
    }

    /// The element at a time, or the nearest one.
    fn at(&self, t: f64) -> Option<Found<'_>> {
        let is_before = |(start, h): &(f64, f64)| (t - start) * h.signum() >= 0.0;
        let number = self.spans.partition_point(is_before).saturating_sub(1);
        let size = self.numbers.len() / self.spans.len().max(1);
        Some(Found {
            span: *self.spans.get(number)?,
            numbers: &self.numbers[number * size..(number + 1) * size],
            degree: self.degree,
        })
    }

    /// Writes the unknowns of an element with Gauss points from t to t + h, except for the velocity at its end; false,
    /// with nothing written, where the trail does not reach that far.
    fn foresee(
        &self,
        scheme: &SchemeRef<'_>,
        of: Of<'_>,
        (t, h): (f64, f64),
        unknowns: &mut [f64],
    ) -> bool {
        /// The fraction of an element that may lie beyond the end of the trail.
        const BEYOND: f64 = 0.1;
        let n = of.coordinates;
        let reaches = |(start, length): &(f64, f64)| {
            ((t + h) - (start + length)) * length.signum() <= BEYOND * h.abs()
        };
        let Some(middle) = self.at(t + 0.5 * h) else {
            return false;
        };
        let ends = [self.at(t), self.at(t + h)].into_iter().flatten();
        if !(self.spans.last().is_some_and(reaches)
            && ends.chain([middle]).all(|one| one.is_resolved(n)))
        {
            return false;
        }
        for (i, node) in scheme.unknown_nodes.iter().enumerate() {
            let t = t + h * node;
            let found = self.at(t).unwrap_or(middle);
            for a in 0..n {
                unknowns[i * n + a] = found.legendre_sum(t, |j| j * n + a);
            }
        }
        let layout = of.layout(scheme);
        for (c, constraint) in of.constraints.iter().enumerate() {
            let place = Multipliers {
                of: c,
                first: middle.degree * n,
                count: of.constraints.len(),
            };
            middle.multipliers(constraint, place, (t, h), scheme, |j, number| {
                let at = match j {
                    Some(j) => layout.inside(j, c),
                    None => layout.node(c),
                };
                unknowns[at] = number;
            });
        }
        true
    }
}

/// The places of the multipliers of a constraint.
#[derive(Clone, Copy)]
struct Multipliers {
    of: usize,
    first: usize,
    count: usize,
}

impl Multipliers {
    /// The interior multipliers; after the last of them, that of the node.
    fn inside(&self, j: usize) -> usize {
        self.first + j * self.count + self.of
    }
}

impl Found<'_> {
    /// The place of a time in the element.
    fn place(&self, t: f64) -> f64 {
        (t - self.span.0) / self.span.1
    }

    /// Whether the last Legendre coefficient of the rates is small relative to the others. A wrong root, of a step that
    /// is too long, must not be used as a guess: another element started from it might find a root near it, and the two
    /// would agree.
    fn is_resolved(&self, coordinates: usize) -> bool {
        /// Relative to the largest coefficient.
        const SMALL: f64 = 0.01;
        let rates = &self.numbers[..self.degree * coordinates];
        largest(&rates[(self.degree - 1) * coordinates..]) <= SMALL * largest(rates)
    }

    /// The sum of Legendre polynomials at a time.
    fn legendre_sum(&self, t: f64, place: impl Fn(usize) -> usize) -> f64 {
        let mut values = [0.0; MAX_NODES];
        legendre(self.place(t), &mut values);
        let values = values.iter().take(self.degree).enumerate();
        values
            .map(|(j, value)| value * self.numbers[place(j)])
            .sum()
    }

    /// Passes to `show` the multipliers of a constraint for another element, interior ones with their number and that
    /// of the node without one: those that give the same reactions there.
    fn multipliers(
        &self,
        constraint: &Constraint,
        place: Multipliers,
        (t, h): (f64, f64),
        scheme: &SchemeRef<'_>,
        mut show: impl FnMut(Option<usize>, f64),
    ) {
        let degree = scheme.element.degree();
        if !constraint.kind.is_holonomic() {
            // μ/h, normalised such that the mean of both ends vanishes.
            let at = |t: f64| self.legendre_sum(t, |j| place.inside(j)) * self.span.1 / h;
            let mean = 0.5 * (at(t) + at(t + h));
            for (l, node) in scheme.unknown_nodes.iter().enumerate() {
                show(Some(l), at(t + h * node) - mean);
            }
            return show(None, at(t) - mean);
        }
        // μ̇ at the points, and its components along each P_j′, which are orthogonal with weight 1 − x².
        show(Some(0), self.numbers[place.inside(0)]);
        show(None, self.numbers[place.inside(self.degree)]);
        let mut parts = [0.0; MAX_RATES];
        for (node, weight) in scheme.unknown_nodes.iter().zip(scheme.weights) {
            let rates = legendre_slopes(self.place(t + h * node), self.degree);
            let rate: f64 = (1..self.degree)
                .map(|k| rates[k] * self.numbers[place.inside(k)])
                .sum();
            let x = 2.0 * node - 1.0;
            let weight = 2.0 * weight * (1.0 - x * x) * rate;
            for (part, slope) in parts.iter_mut().zip(legendre_slopes(*node, degree)) {
                *part += weight * slope;
            }
        }
        for (j, part) in parts.iter().enumerate().take(degree).skip(1) {
            let length = (2 * j * (j + 1)) as f64 / (2 * j + 1) as f64;
            show(Some(j), part / length);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_that_are_not_numbers_are_not_resolved() {
        let is_resolved = |numbers: &[f64]| {
            let found = Found {
                span: (0.0, 1.0),
                numbers,
                degree: 2,
            };
            found.is_resolved(2)
        };
        assert!(is_resolved(&[1.0, 2.0, 1e-3, 0.0]));
        assert!(!is_resolved(&[1.0, 2.0, 0.1, 0.0]));
        assert!(!is_resolved(&[1.0, 2.0, 1e-3, f64::NAN]));
        assert!(!is_resolved(&[f64::NAN, 2.0, 1e-3, 0.0]));
    }
}
