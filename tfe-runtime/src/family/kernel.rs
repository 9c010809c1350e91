//! The one thing that the iteration of families asks of a model, so that everything else is compiled once, not once a model.

use super::{FamilyModel, Gradient};
#[cfg(all(feature = "simd", target_arch = "x86_64"))]
use crate::quad::Quad;
use crate::real::{Lanes, Real};
#[cfg(all(feature = "simd", target_arch = "x86_64"))]
use pulp::x86::V3;

/// L_q (or H_q) and Q at four points, by the kernel of a model.
pub(super) trait Kernel {
    /// In registers of AVX2.
    #[cfg(all(feature = "simd", target_arch = "x86_64"))]
    fn in_quads(&self, isa: V3, here: Here<'_, Quad>);

    /// With plain numbers.
    fn in_lanes(&self, here: Here<'_, Lanes<4>>);
}

/// Where the points are, and where derivatives go.
pub(super) struct Here<'a, V> {
    pub(super) t: V,
    pub(super) q: &'a [V],
    pub(super) z: &'a [V],
    /// Zeros.
    pub(super) by_q: &'a mut [V],
    /// Zeros; empty where there are no forces.
    pub(super) force: &'a mut [V],
}

impl<V: Real> Here<'_, V> {
    #[inline(always)]
    fn evaluate<M: FamilyModel>(self, model: &M) {
        let first = Gradient {
            z: &mut [],
            q: self.by_q,
            force: self.force,
        };
        model.forces_inline(self.t, self.q, self.z, first);
    }
}

impl<M: FamilyModel> Kernel for M {
    #[cfg(all(feature = "simd", target_arch = "x86_64"))]
    fn in_quads(&self, isa: V3, here: Here<'_, Quad>) {
        isa.vectorize(InRegisters { model: self, here });
    }

    fn in_lanes(&self, here: Here<'_, Lanes<4>>) {
        here.evaluate(self);
    }
}

/// The same in code for one instruction set.
#[cfg(all(feature = "simd", target_arch = "x86_64"))]
struct InRegisters<'a, M> {
    model: &'a M,
    here: Here<'a, Quad>,
}

#[cfg(all(feature = "simd", target_arch = "x86_64"))]
impl<M: FamilyModel> pulp::NullaryFnOnce for InRegisters<'_, M> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        self.here.evaluate(self.model);
    }
}
