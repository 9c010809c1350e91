//! The only call that the iteration of models of run-time length makes to a model, so that everything else is compiled
//! once and not for every model.

use super::model::Model;
use super::running::Running;
use crate::lanes::Lanes;
#[cfg(all(feature = "simd", target_arch = "x86_64"))]
use crate::registers::quad::Quad;
#[cfg(all(feature = "simd", target_arch = "x86_64"))]
use pulp::x86::V3;

/// L_q (or H_q) and Q at four points, by the kernel of a model.
pub(super) trait Kernel {
    /// In registers of AVX2.
    #[cfg(all(feature = "simd", target_arch = "x86_64"))]
    fn in_quads(&self, isa: V3, t: Quad, running: &mut Running<'_, Quad, V3>);

    /// With plain numbers.
    fn in_lanes(&self, t: Lanes<4>, running: &mut Running<'_, Lanes<4>, ()>);
}

impl<M: Model> Kernel for M {
    #[cfg(all(feature = "simd", target_arch = "x86_64"))]
    fn in_quads(&self, isa: V3, t: Quad, running: &mut Running<'_, Quad, V3>) {
        isa.vectorize(InRegisters {
            model: self,
            t,
            running,
        });
    }

    fn in_lanes(&self, t: Lanes<4>, running: &mut Running<'_, Lanes<4>, ()>) {
        self.forces_in_strides(t, running);
    }
}

/// The same in code for one instruction set.
#[cfg(all(feature = "simd", target_arch = "x86_64"))]
struct InRegisters<'a, 'b, M> {
    model: &'a M,
    t: Quad,
    running: &'a mut Running<'b, Quad, V3>,
}

#[cfg(all(feature = "simd", target_arch = "x86_64"))]
impl<M: Model> pulp::NullaryFnOnce for InRegisters<'_, '_, M> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        self.model.forces_in_strides(self.t, self.running);
    }
}
