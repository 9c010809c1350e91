//! Models with inputs, whose values are given at run time.

use crate::model::{By, First, Model, Second};
use crate::real::Real;

/// The most inputs that a model can have.
pub const MAX_INPUTS: usize = 16;

/// The kernels of a model with inputs u: L(q, v, t, u) or H(q, p, t, u), forces Q(q, z, t, u) and observables.
///
/// `#[dynamics]` implements it for declarations with `input(…)`. The model itself, as a [`Model`], is the one all of
/// whose inputs are zero. Each kernel is that of [`Model`] with the inputs as an additional argument before the others,
/// in the order of [`INPUTS`](Self::INPUTS); further entries are not read.
pub trait Controlled<const N: usize>: Model<N> + Send + Sync {
    /// The names of the inputs, in order.
    const INPUTS: &'static [&'static str];

    /// L(q, v, t, u), or H(q, p, t, u).
    fn energy_function_with<R: Real>(
        &self,
        inputs: &[R; MAX_INPUTS],
        t: R,
        q: &[R; N],
        z: &[R; N],
    ) -> R;

    /// Its first derivatives, and the generalized force.
    fn first_with<R: Real>(
        &self,
        inputs: &[R; MAX_INPUTS],
        t: R,
        q: &[R; N],
        z: &[R; N],
        first: &mut First<R, N>,
    );

    /// The first derivatives and ∂²/∂z∂z.
    fn first_and_mass_with<R: Real>(
        &self,
        inputs: &[R; MAX_INPUTS],
        t: R,
        q: &[R; N],
        z: &[R; N],
        first: &mut First<R, N>,
        zz: &mut [[R; N]; N],
    );

    /// First and second derivatives together.
    fn second_with<R: Real>(
        &self,
        inputs: &[R; MAX_INPUTS],
        t: R,
        q: &[R; N],
        z: &[R; N],
        first: &mut First<R, N>,
        second: &mut Second<R, N>,
    );

    /// The partial derivatives of everything that [`first_with`](Self::first_with) gives by a parameter or by the time,
    /// at fixed inputs.
    fn first_by_with<R: Real>(
        &self,
        _by: By,
        _inputs: &[R; MAX_INPUTS],
        _t: R,
        _q: &[R; N],
        _z: &[R; N],
        _first: &mut First<R, N>,
    ) {
    }

    /// The observables, one value for each column.
    fn observables_with<R: Real>(
        &self,
        _inputs: &[R; MAX_INPUTS],
        _t: R,
        _q: &[R; N],
        _z: &[R; N],
        _values: &mut [R],
    ) {
    }
}
