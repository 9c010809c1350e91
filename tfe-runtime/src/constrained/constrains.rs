//! A model with constraints without its type: code that takes it so is compiled once for a number of coordinates, and
//! not for every model.

#[cfg(feature = "std")]
use crate::enclosure::Enclosure;
use crate::error::LegendreError;
use crate::legendre::{lagrangian_view_from, velocity};
use crate::model::{Constraint, ConstraintSecond, First, Form, Model};

/// A model with constraints without its type.
pub(crate) trait Constrains<const N: usize> {
    /// The constraints, in order.
    fn declared(&self) -> &'static [Constraint];

    /// The function by which the model is declared.
    fn form(&self) -> Form;

    /// Whether that function is quadratic in z.
    fn is_quadratic(&self) -> bool;

    /// A, a and φ.
    fn values_at(
        &self,
        t: f64,
        q: &[f64; N],
        rows: &mut [[f64; N]],
        numbers: (&mut [f64], &mut [f64]),
    );

    /// ψ_q, Ȧ and the second derivatives weighted by multipliers.
    fn second_at(
        &self,
        t: f64,
        q: &[f64; N],
        v: &[f64; N],
        mu: &[f64],
        second: &mut ConstraintSecond<'_, f64, N>,
    );

    /// Bounds of the rounding errors of φ: the formulas evaluated with enclosures.
    #[cfg(feature = "std")]
    fn bounds_at(&self, t: f64, q: &[f64; N], bounds: &mut [Enclosure]);

    /// The second derivative by z of the declared function: L_vv, or H_pp.
    fn mass_at(&self, t: f64, q: &[f64; N], z: &[f64; N]) -> [[f64; N]; N];

    /// L_v and L_vv. Of a Hamiltonian, `momentum` is a guess of the momentum, which replaces it.
    ///
    /// # Errors
    /// [`LegendreError`] if the model is a Hamiltonian and no momentum is found.
    fn momentum_and_mass(
        &self,
        t: f64,
        q: &[f64; N],
        v: &[f64; N],
        momentum: &mut [f64; N],
    ) -> Result<([f64; N], [[f64; N]; N]), LegendreError>;

    /// The velocity of a momentum without regard to the constraints.
    ///
    /// # Errors
    /// [`LegendreError`] if the model is a Lagrangian and no velocity is found.
    fn free_velocity(
        &self,
        t: f64,
        q: &[f64; N],
        p: &[f64; N],
        guess: &[f64; N],
    ) -> Result<[f64; N], LegendreError>;
}

impl<M: Model<N>, const N: usize> Constrains<N> for M {
    fn declared(&self) -> &'static [Constraint] {
        M::CONSTRAINTS
    }

    fn form(&self) -> Form {
        M::FORM
    }

    fn is_quadratic(&self) -> bool {
        M::FACTS.quadratic_in_z
    }

    fn values_at(
        &self,
        t: f64,
        q: &[f64; N],
        rows: &mut [[f64; N]],
        (drift, values): (&mut [f64], &mut [f64]),
    ) {
        self.constraint_rows(t, q, rows, drift);
        self.constraint_values(t, q, values);
    }

    fn second_at(
        &self,
        t: f64,
        q: &[f64; N],
        v: &[f64; N],
        mu: &[f64],
        second: &mut ConstraintSecond<'_, f64, N>,
    ) {
        self.constraint_second(t, q, v, mu, second);
    }

    #[cfg(feature = "std")]
    fn bounds_at(&self, t: f64, q: &[f64; N], bounds: &mut [Enclosure]) {
        let exactly = |x: f64| Enclosure::between(x, x);
        self.constraint_values(exactly(t), &q.map(exactly), bounds);
    }

    fn mass_at(&self, t: f64, q: &[f64; N], z: &[f64; N]) -> [[f64; N]; N] {
        let (mut first, mut zz) = (First::ZERO, [[0.0; N]; N]);
        self.first_and_mass(t, q, z, &mut first, &mut zz);
        zz
    }

    fn momentum_and_mass(
        &self,
        t: f64,
        q: &[f64; N],
        v: &[f64; N],
        momentum: &mut [f64; N],
    ) -> Result<([f64; N], [[f64; N]; N]), LegendreError> {
        if const { M::FORM.is_lagrangian() } {
            let (mut first, mut zz) = (First::ZERO, [[0.0; N]; N]);
            self.first_and_mass(t, q, v, &mut first, &mut zz);
            Ok((first.z, zz))
        } else {
            let view = lagrangian_view_from(self, t, q, v, momentum)?;
            *momentum = view.p;
            Ok((view.p, view.second.zz))
        }
    }

    fn free_velocity(
        &self,
        t: f64,
        q: &[f64; N],
        p: &[f64; N],
        guess: &[f64; N],
    ) -> Result<[f64; N], LegendreError> {
        velocity(self, t, q, p, guess)
    }
}
