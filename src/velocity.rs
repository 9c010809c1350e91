//! Velocities of states.

use crate::evaluate::Evaluate;
use crate::length::{FixedLength, Length, RunTimeLength};
use tfe_runtime::family::{self, FamilyState};
use tfe_runtime::{Model, State};

/// Computes the velocities dq/dt that belong to the momenta of a state.
pub trait Velocity<const N: usize, L: Length<N> = FixedLength>: Evaluate<N, L> {
    /// The velocity dq/dt of a state at the time t: the v with ∂L/∂v = p, or ∂H/∂p.
    ///
    /// If the mass matrix is singular, it is the velocity that the constraints determine (theory.md (T-74)). It is NaN
    /// if they do not determine it, if the iteration for v of a kinetic energy that is not quadratic fails, if the
    /// model does not pass its [check](tfe_runtime::Model::check), or (with the length of the state) if the lengths of
    /// state and model differ.
    ///
    /// ```
    /// use tfe::prelude::*;
    ///
    /// #[dynamics(coordinates(r, phi), lagrangian = m/2*(dot(r)^2 + r^2*dot(phi)^2) + mu/r)]
    /// struct Planet { m: f64, mu: f64 }
    ///
    /// let planet = Planet { m: 2.0, mu: 1.0 };
    /// let state = planet.state([3.0, 0.0], [0.25, 0.5]);
    /// assert_eq!(state.p, [0.5, 9.0]);
    /// assert_eq!(planet.velocity(0.0, &state), [0.25, 0.5]);
    ///
    /// #[dynamics(
    ///     coordinates(q[n]),
    ///     lagrangian = sum(i in 0..n, m*dot(q[i])^2/2) - sum(i in 0..n-1, k*(q[i+1] - q[i])^2/2)
    /// )]
    /// struct Chain { n: usize, m: f64, k: f64 }
    ///
    /// let chain = Chain { n: 3, m: 2.0, k: 1.0 };
    /// let state = chain.state([0.0, 0.1, 0.3], [0.5, 0.0, -1.0]);
    /// assert_eq!(chain.velocity(0.0, &state), [0.5, 0.0, -1.0]);
    /// ```
    fn velocity(&self, t: f64, state: &L::State) -> L::Vector;
}

impl<M: Model<N>, const N: usize> Velocity<N> for M {
    fn velocity(&self, t: f64, state: &State<N>) -> [f64; N] {
        let fits = self.check().is_ok();
        let found = fits.then(|| Evaluate::velocity(self, t, state, &[0.0; N]));
        found.flatten().unwrap_or([f64::NAN; N])
    }
}

impl<M: family::Model> Velocity<0, RunTimeLength> for M {
    fn velocity(&self, t: f64, state: &FamilyState) -> Vec<f64> {
        let n = self.len();
        let fits = self.check().is_ok() && (state.q.len(), state.p.len()) == (n, n);
        let found = fits.then(|| Evaluate::velocity(self, t, state, &state.p));
        // If the length is wrong, there may not be enough memory for a vector.
        let unknown = || vec![f64::NAN; state.q.len()];
        found.flatten().unwrap_or_else(unknown)
    }
}
