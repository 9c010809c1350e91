//! The same kernels as an expert would write them: common factors and trigonometry simplified on paper, every symmetric
//! entry computed once.

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

/// Kernels with the arguments, results and guarantees of `Model::first` and `Model::second`: all entries that can be
/// non-zero are written, and none is read.
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
