//! Where kernels are evaluated, in a step or kept from step to step.

use crate::lanes::Lanes;
use crate::model::First;
use crate::real::Real;
use crate::registers::four::Four;
#[cfg(all(feature = "simd", target_arch = "x86_64"))]
use crate::registers::quad::Quad;

/// Where a kernel is evaluated, and what it writes there. Entries that are always zero are never written, so one serves for all points of a step: with many coordinates it takes as
/// long to fill them with zeros as to evaluate a kernel.
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

/// Coordinates up to which a place is made anew in each step: in registers, as far as these go.
pub(super) const FEW: usize = 8;

/// Where kernels are evaluated at four points, in the numbers of the processor.
#[derive(Clone, Debug)]
pub(super) enum Places<const N: usize> {
    None,
    Lanes(Evaluation<Lanes<4>, N>),
    #[cfg(all(feature = "simd", target_arch = "x86_64"))]
    Quads(Evaluation<Quad, N>),
}

/// Numbers of such a place.
pub(super) trait Placed: Four {
    /// The place for these numbers; all zero where there was none.
    fn place<const N: usize>(self, kept: &mut Places<N>) -> &mut Evaluation<Self, N>;
}

/// The place in a variant.
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
