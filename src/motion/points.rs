//! The quadrature points for integrals of functions along a motion.

use super::at_error::AtError;
use crate::evaluate::Evaluate;
use crate::length::{Length, Polynomial};
use tfe_runtime::quadrature::Quadrature;

/// A quadrature point of an element, or of a piece of one that was cut.
pub(crate) struct Point<const N: usize, L: Length<N>> {
    /// The position in the element, between 0 and 1.
    pub(crate) tau: f64,
    pub(crate) t: f64,
    /// The quadrature weight times the length of the element.
    pub(crate) weight: f64,
    pub(crate) state: L::State,
    /// The velocity that belongs to the momentum, if outputs are functions of velocities.
    pub(crate) velocity: L::Vector,
}

/// The s Gauss points of every element, where s is the degree of its polynomial.
pub(crate) struct Points<const N: usize, L: Length<N>> {
    rule: Quadrature,
    /// The last velocity, the first guess for the next.
    velocity: L::Vector,
}

impl<const N: usize, L: Length<N>> Points<N, L> {
    pub(crate) fn new(velocity: L::Vector) -> Self {
        Self {
            rule: Quadrature::gauss(1),
            velocity,
        }
    }

    /// Calls `each` with the points of a piece, in order.
    pub(crate) fn of<M: Evaluate<N, L>, E: From<AtError>>(
        &mut self,
        model: &M,
        piece: &L::Polynomial,
        mut each: impl FnMut(Point<N, L>) -> Result<(), E>,
    ) -> Result<(), E> {
        let degree = piece.degree().max(1);
        if self.rule.len() != degree {
            self.rule = Quadrature::gauss(degree);
        }
        let (from, length) = (piece.start(), piece.length());
        for number in 0..self.rule.len() {
            let tau = self.rule.node(number);
            let (t, state) = (from + tau * length, piece.at(tau));
            if const { M::NEEDS_VELOCITY } {
                let found = model.velocity(t, &state, &self.velocity);
                self.velocity = found.ok_or(AtError::NoVelocity { time: t })?;
            }
            each(Point {
                tau,
                t,
                weight: self.rule.weight(number) * length,
                state,
                velocity: self.velocity.clone(),
            })?;
        }
        Ok(())
    }
}
