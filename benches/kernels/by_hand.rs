//! The same kernels as an expert writes them: common factors and trigonometry worked out on paper, every symmetric entry once.

mod arms;
mod bodies;
mod cart;
mod chain;
mod links;
mod oscillators;
mod rotating;
mod satellite;
mod tops;

use tfe::runtime::{First, Real, Second};

/// Kernels with the arguments, the results and the promises of `Model::first` and `Model::second`: what can be non-zero is written,
/// nothing is read.
pub trait ByHand<const N: usize> {
    /// First derivatives.
    fn first<R: Real>(&self, t: R, q: &[R; N], z: &[R; N], first: &mut First<R, N>);

    /// First and second derivatives.
    fn second<R: Real>(
        &self,
        t: R,
        q: &[R; N],
        z: &[R; N],
        first: &mut First<R, N>,
        second: &mut Second<R, N>,
    );
}
