//! The derivative of the velocity by the state, the time and parameters.

use super::held_velocity::HeldVelocity;
use crate::dual::{Dual, duals};
use crate::lu::Block;
use crate::model::{First, Form, Model};

/// How the velocity at a point of a motion changes with the point and with parameters: for a Lagrangian by
///
/// ```text
/// L_vv δv = δp − ∂L_v ,     p = L_v(q, v, t) ,
/// ```
///
/// where ∂ denotes the change by time, coordinates and parameters at a fixed velocity; by [`HeldVelocity`] if constraints
/// determine the velocity; and for a Hamiltonian by v = H_p.
#[derive(Clone, Debug)]
pub struct VelocitySlope<'a, M, const N: usize> {
    model: &'a M,
    v: [f64; N],
    by: By<N>,
}

/// What determines the velocity.
#[derive(Clone, Debug)]
enum By<const N: usize> {
    /// H_p.
    Momenta,
    /// The LU factors of L_vv.
    Mass(Block<N>),
    /// Constraints as well, because L_vv is singular.
    Constraints(HeldVelocity<N>),
    /// Nothing.
    Unknown,
}

impl<'a, M: Model<N>, const N: usize> VelocitySlope<'a, M, N> {
    /// At coordinates q with momenta p and velocities v.
    #[must_use]
    pub fn new(model: &'a M, t: f64, (q, p): (&[f64; N], &[f64; N]), v: &[f64; N]) -> Self {
        let by = if const { matches!(M::FORM, Form::Hamiltonian) } {
            By::Momenta
        } else {
            match HeldVelocity::of(model, t, (q, p), v) {
                Ok(Some(held)) => By::Constraints(held),
                Ok(None) => {
                    let (mut first, mut zz) = (First::ZERO, [[0.0; N]; N]);
                    model.first_and_mass(t, q, v, &mut first, &mut zz);
                    Block::of(&zz).map_or(By::Unknown, By::Mass)
                }
                Err(_) => By::Unknown,
            }
        };
        Self { model, v: *v, by }
    }

    /// δv, where the time carries its slope and the parameter, and coordinates and momenta carry their slopes; NaN if the
    /// mass matrix is singular. With constraints, for changes that these allow.
    #[must_use]
    pub fn along(&self, t: Dual, (q, p): (&[Dual; N], &[Dual; N])) -> [f64; N] {
        let mut first = First::zero();
        if let By::Momenta = self.by {
            self.model.first(t, q, p, &mut first);
            return first.z.map(|velocity| velocity.slope);
        }
        self.model
            .first(t, q, &duals(&self.v, &[0.0; N]), &mut first);
        let mut right: [f64; N] = core::array::from_fn(|a| p[a].slope - first.z[a].slope);
        match &self.by {
            By::Mass(mass) => mass.solve(&mut right),
            By::Constraints(held) => right = held.slope(self.model, (t, q), &self.v, &right),
            By::Momenta | By::Unknown => right = [f64::NAN; N],
        }
        right
    }
}
