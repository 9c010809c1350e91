//! Models of run-time length with inputs, whose values are given at run time.

use super::model::{Entries, Gradient, Model, Sweep};
use crate::controlled::MAX_INPUTS;
use crate::real::Real;

/// The kernels of a model of run-time length with inputs u: L(q, v, t, u) or H(q, p, t, u), forces Q(q, z, t, u) and
/// observables.
///
/// `#[dynamics]` implements it for declarations with `input(…)`. The model itself, as a [`Model`], is the one all of
/// whose inputs are zero. Each kernel is that of [`Model`] with the inputs as an additional argument before the others,
/// in the order of [`INPUTS`](Self::INPUTS); further entries are not read.
pub trait Controlled: Model + Send + Sync {
    /// The names of the inputs, in order.
    const INPUTS: &'static [&'static str];

    /// L(q, v, t, u), or H(q, p, t, u).
    fn energy_function_with<R: Real>(&self, inputs: &[R; MAX_INPUTS], t: R, q: &[R], z: &[R]) -> R;

    /// Its first derivatives, and the generalized force.
    fn first_with<R: Real>(
        &self,
        inputs: &[R; MAX_INPUTS],
        t: R,
        q: &[R],
        z: &[R],
        first: Gradient<'_, R>,
    );

    /// As [`Model::forces_inline`].
    fn forces_inline_with<R: Real>(
        &self,
        inputs: &[R; MAX_INPUTS],
        t: R,
        q: &[R],
        z: &[R],
        first: Gradient<'_, R>,
    );

    /// As [`Model::forces_in_strides`].
    #[inline(always)]
    fn forces_in_strides_with<R: Real, S: Sweep<R>>(
        &self,
        inputs: &[R; MAX_INPUTS],
        t: R,
        sweep: &mut S,
    ) {
        let (q, z, first) = sweep.slices();
        self.forces_inline_with(inputs, t, q, z, first);
    }

    /// The contributions to ∂²/∂z∂z.
    fn mass_with<R: Real, E: Entries<R>>(
        &self,
        inputs: &[R; MAX_INPUTS],
        t: R,
        q: &[R],
        z: &[R],
        entries: &mut E,
    );

    /// First derivatives and the contributions to all second ones.
    fn second_with<R: Real, E: Entries<R>>(
        &self,
        inputs: &[R; MAX_INPUTS],
        t: R,
        q: &[R],
        z: &[R],
        first: Gradient<'_, R>,
        entries: &mut E,
    );

    /// The observables, in the order of declaration and of sites.
    fn observables_with<R: Real>(
        &self,
        _inputs: &[R; MAX_INPUTS],
        _t: R,
        _q: &[R],
        _z: &[R],
        _values: &mut [R],
    ) {
    }
}
