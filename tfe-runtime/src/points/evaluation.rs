//! Arguments and results of kernels, made anew in each step or kept from step to step.

use crate::lanes::Lanes;
use crate::model::First;
use crate::real::Real;
use crate::registers::four::Four;
#[cfg(all(feature = "simd", target_arch = "x86_64"))]
use crate::registers::quad::Quad;

/// The arguments and results of a kernel. Entries that are always zero are never written, so that one object serves all
/// points of a step: with many coordinates, filling it with zeros takes as long as evaluating a kernel.
#[derive(Clone, Debug)]
pub(crate) struct Evaluation<V, const N: usize> {
    pub(crate) q: [V; N],
    pub(crate) z: [V; N],
    pub(crate) first: First<V, N>,
}

impl<V: Real, const N: usize> Evaluation<V, N> {
    #[inline(always)]
    pub(crate) fn zero(like: V) -> Self {
        let zero = [like.like(0.0); N];
        Self {
            q: zero,
            z: zero,
            first: First {
                z: zero,
                q: zero,
                force: zero,
            },
        }
    }
}

/// Up to this number of coordinates, it is made anew in each step, in registers as far as possible.
pub(super) const FEW: usize = 8;

/// The arguments and results of kernels at four points, in the numbers of the processor.
#[derive(Clone, Debug)]
pub(super) enum Places<const N: usize> {
    None,
    Lanes(Evaluation<Lanes<4>, N>),
    #[cfg(all(feature = "simd", target_arch = "x86_64"))]
    Quads(Evaluation<Quad, N>),
}

/// The scalar types for which they can be kept.
pub(super) trait Placed: Four {
    /// The object for these numbers; all zero if there was none.
    fn place<const N: usize>(self, kept: &mut Places<N>) -> &mut Evaluation<Self, N>;
}

/// Implements it for one variant.
macro_rules! placed {
    ($numbers:ty, $variant:ident) => {
        impl Placed for $numbers {
            #[inline(always)]
            fn place<const N: usize>(self, kept: &mut Places<N>) -> &mut Evaluation<Self, N> {
                loop {
                    match kept {
                        Places::$variant(place) => return place,
                        _ => *kept = Places::$variant(Evaluation::zero(self)),
                    }
                }
            }
        }
    };
}
placed!(Lanes<4>, Lanes);
#[cfg(all(feature = "simd", target_arch = "x86_64"))]
placed!(Quad, Quads);
