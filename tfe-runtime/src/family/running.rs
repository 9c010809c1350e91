//! A kernel of run-time length that runs through its sites, followed closely by the passes of the iteration.

use super::model::{Gradient, Sweep};
use super::space::{Pass, Problem, Sizes, Space, StepInput};
use crate::lanes::Lanes;
use crate::registers::four::Four;
#[cfg(all(feature = "simd", target_arch = "x86_64"))]
use crate::registers::quad::Quad;

/// Runs passes, compiled for one instruction set.
pub(super) trait Passes<V>: Copy {
    fn run(
        self,
        pass: Pass<'_>,
        space: &mut Space<V>,
        problem: &Problem,
        input: StepInput<'_>,
    ) -> Sizes;
}

impl Passes<Lanes<4>> for () {
    fn run(
        self,
        pass: Pass<'_>,
        space: &mut Space<Lanes<4>>,
        problem: &Problem,
        input: StepInput<'_>,
    ) -> Sizes {
        pass.run(space, problem, input)
    }
}

#[cfg(all(feature = "simd", target_arch = "x86_64"))]
impl Passes<Quad> for pulp::x86::V3 {
    fn run(
        self,
        pass: Pass<'_>,
        space: &mut Space<Quad>,
        problem: &Problem,
        input: StepInput<'_>,
    ) -> Sizes {
        self.vectorize(InRegisters {
            space,
            problem,
            input,
            pass,
        })
    }
}

/// What is evaluated in this run.
#[derive(Clone, Copy)]
pub(super) struct Place<'a> {
    pub(super) problem: &'a Problem,
    pub(super) input: StepInput<'a>,
    pub(super) group: usize,
    pub(super) settles: bool,
}

/// A kernel that runs through the sites of a group, and the pass that follows it.
pub(super) struct Running<'a, V, P> {
    space: &'a mut Space<V>,
    passes: P,
    place: Place<'a>,
    /// The number of coordinates whose forces are final.
    settled: usize,
    sizes: Sizes,
}

impl<'a, V: Four, P: Passes<V>> Running<'a, V, P> {
    pub(super) fn new(space: &'a mut Space<V>, passes: P, place: Place<'a>) -> Self {
        Self {
            space,
            passes,
            place,
            settled: 0,
            sizes: Sizes::NONE,
        }
    }

    pub(super) fn finish(mut self) -> Sizes {
        let n = self.space.len();
        self.passed(n);
        self.sizes
    }
}

impl<V: Four, P: Passes<V>> Sweep<V> for Running<'_, V, P> {
    #[inline(always)]
    fn slices(&mut self) -> (&[V], &[V], Gradient<'_, V>) {
        self.space.slices()
    }

    fn passed(&mut self, below: usize) {
        let Place {
            problem,
            input,
            group,
            settles,
        } = self.place;
        if !settles || below <= self.settled {
            return;
        }
        let range = self.settled..below;
        let pass = Pass::Settle { group, range };
        let sizes = self.passes.run(pass, self.space, problem, input);
        self.sizes = self.sizes.and(sizes);
        self.settled = below;
    }
}

/// A pass, compiled for one instruction set.
#[cfg(all(feature = "simd", target_arch = "x86_64"))]
struct InRegisters<'a> {
    space: &'a mut Space<Quad>,
    problem: &'a Problem,
    input: StepInput<'a>,
    pass: Pass<'a>,
}

#[cfg(all(feature = "simd", target_arch = "x86_64"))]
impl pulp::NullaryFnOnce for InRegisters<'_> {
    type Output = Sizes;

    #[inline(always)]
    fn call(self) -> Sizes {
        self.pass.run(self.space, self.problem, self.input)
    }
}
