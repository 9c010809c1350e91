//! The order of the unknowns of an element with constraints.

use crate::constrained::scaled::{factor_scaled, scale_of_constraints};
use crate::element::Element;
use crate::error::ConstraintError;
use crate::lu;
use crate::model::Constraint;

/// The unknowns and, in the same order, the equations: rates, interior multipliers, velocity at the end, multipliers of
/// the nodes.
///
/// With s = n − 1, N coordinates and m constraints these are (s + 1)(N + m) numbers. All multipliers are divided by h,
/// so that they have the size of reactions.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Layout {
    unknowns: usize,
    degree: usize,
    coordinates: usize,
    constraints: usize,
}

impl Layout {
    pub(crate) const fn new(element: &Element, coordinates: usize, constraints: usize) -> Self {
        Self {
            unknowns: element.unknowns(),
            degree: element.degree(),
            coordinates,
            constraints,
        }
    }

    /// The number of unknowns.
    pub(crate) const fn size(&self) -> usize {
        self.node(self.constraints)
    }

    /// The end of the rates.
    pub(crate) const fn rates(&self) -> usize {
        self.unknowns * self.coordinates
    }

    /// The place of multiplier j < s of a constraint. For holonomic constraints, j = 0 is the multiplier at the start
    /// and the others are the coefficients of P_j′; for velocity constraints it is the multiplier of stage j.
    pub(crate) const fn inside(&self, j: usize, constraint: usize) -> usize {
        self.rates() + j * self.constraints + constraint
    }

    /// The place of a component of the velocity at the end.
    pub(crate) const fn end(&self, coordinate: usize) -> usize {
        self.rates() + self.degree * self.constraints + coordinate
    }

    /// The place of the multiplier of a constraint at the end; for velocity constraints that of the start, which is its
    /// negative.
    pub(crate) const fn node(&self, constraint: usize) -> usize {
        self.end(self.coordinates) + constraint
    }

    /// Factors the tangent. Rows of constraints have another unit than those of momenta, which is that of masses.
    pub(crate) fn factor(
        &self,
        tangent: &mut [f64],
        pivots: &mut [usize],
    ) -> Result<(), lu::Singular> {
        let (rates, end, node, size) = (self.rates(), self.end(0), self.node(0), self.size());
        let is_constraint =
            |equation: usize| (rates <= equation && equation < end) || node <= equation;
        let scale = scale_of_constraints(size, tangent, end..node, node..size);
        factor_scaled(size, tangent, pivots, (scale, &is_constraint))
    }

    /// The ranges of the multipliers, one for each constraint.
    pub(crate) fn multipliers(&self) -> impl Iterator<Item = core::ops::Range<usize>> + use<> {
        let Self { constraints, .. } = *self;
        let starts = (0..self.degree).map({
            let layout = *self;
            move |j| layout.inside(j, 0)
        });
        (starts.chain([self.node(0)])).map(move |start| start..start + constraints)
    }

    /// Marks the constraints that have multipliers in these unknowns, if there are such: of dependent ones those have to
    /// be chosen again.
    #[cfg(feature = "alloc")]
    pub(crate) fn mark_used(&self, unknowns: &[f64], marks: &mut [usize]) {
        let is_used = |c: usize| {
            self.multipliers()
                .any(|range| unknowns[range.start + c] != 0.0)
        };
        if (0..marks.len()).any(is_used) {
            for (c, mark) in marks.iter_mut().enumerate() {
                *mark = usize::from(is_used(c));
            }
        }
    }

    /// Sets the multipliers to those of constant reactions λ, μ = −λ t; zero where the reactions are unknown.
    #[cfg(feature = "alloc")]
    pub(crate) fn guess(
        &self,
        declared: &[Constraint],
        nodes: &[f64],
        reactions: Option<&[f64]>,
        unknowns: &mut [f64],
    ) {
        for (c, constraint) in declared.iter().enumerate() {
            let lambda = reactions.map_or(0.0, |reactions| reactions[c]);
            let lambda = if lambda.is_finite() { lambda } else { 0.0 };
            for j in 0..self.degree {
                unknowns[self.inside(j, c)] = match (constraint.kind.is_holonomic(), j) {
                    (false, _) => -lambda * (nodes[j] - 0.5),
                    // A single point does not determine the rate of μ: half of the impulse acts at either end.
                    (true, 0) if self.degree == 1 => -0.5 * lambda,
                    (true, 1) => -lambda,
                    (true, _) => 0.0,
                };
            }
            unknowns[self.node(c)] = match (constraint.kind.is_holonomic(), self.degree) {
                (false, _) => 0.5 * lambda,
                (true, 1) => -0.5 * lambda,
                (true, _) => 0.0,
            };
        }
    }

    /// s
    pub(crate) const fn degree(&self) -> usize {
        self.degree
    }
}

/// Refuses an element that cannot enforce one of the constraints.
pub(crate) fn check_element(
    declared: &'static [Constraint],
    element: Element,
) -> Result<(), ConstraintError> {
    match (declared.iter()).find(|constraint| !element.holds(constraint.kind.is_holonomic())) {
        Some(constraint) => Err(ConstraintError::Element {
            element,
            constraint: constraint.name,
        }),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unknowns_follow_one_another() {
        let layout = Layout::new(&Element::mixed(4), 3, 2);
        assert_eq!(layout.rates(), 9);
        assert_eq!(layout.inside(2, 1) + 1, layout.end(0));
        assert_eq!(layout.end(2) + 1, layout.node(0));
        assert_eq!(layout.size(), 4 * (3 + 2));
    }

    #[test]
    fn who_admits_what() {
        for (element, holonomic, velocity) in [
            (Element::mixed(4), true, true),
            (Element::mixed(4).quadrature(5), false, false),
            (Element::primal(4), true, false),
            (Element::primal(4).reduced(), true, true),
            (Element::primal(4).lobatto(), true, false),
            (Element::three_field(4), true, true),
            (Element::three_field(4).quadrature(5), true, false),
            (Element::radau(4), false, false),
            (Element::energy_conserving(4), false, false),
        ] {
            assert_eq!(element.holds(true), holonomic, "{element}");
            assert_eq!(element.holds(false), velocity, "{element}");
        }
    }
}
