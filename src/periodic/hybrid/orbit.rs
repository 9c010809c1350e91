//! Periodic orbits with events that were found.

use crate::assembly::MeshWarning;
use crate::length::{FixedLength, Length};
use crate::motion::Motion;
use crate::periodic::orbit::{Verdict, trivial_of};
use crate::periodic_schur::Multiplier;
use nalgebra::{Complex, DMatrix};

/// A periodic orbit with events, and its Floquet multipliers; made by [`HybridOrbits::solve`](super::HybridOrbits::solve).
#[derive(Clone, Debug)]
pub struct HybridOrbit<const N: usize, L: Length<N> = FixedLength> {
    pub(super) start: L::State,
    pub(super) period: f64,
    pub(super) floquet: Vec<Multiplier>,
    pub(super) multipliers: Vec<Complex<f64>>,
    pub(super) trivial: usize,
    pub(super) motion: Motion<N, L>,
    pub(super) transitions: Vec<DMatrix<f64>>,
    pub(super) iterations: u32,
    pub(super) warnings: Vec<MeshWarning>,
}

impl<const N: usize, L: Length<N>> HybridOrbit<N, L> {
    /// The period T, as given or as found.
    pub fn period(&self) -> f64 {
        self.period
    }

    /// The state at the start of the period.
    pub fn start(&self) -> L::State {
        self.start.clone()
    }

    /// The motion over one period, with its [events](Motion::events) and dense output.
    pub fn motion(&self) -> &Motion<N, L> {
        &self.motion
    }

    /// What makes the orbit doubtful: whether steps of half the length change its start or its period, by one correction
    /// of Newton's method. The [motion](Self::motion) has warnings of its own.
    pub fn warnings(&self) -> &[MeshWarning] {
        &self.warnings
    }

    /// The transition matrices of the elements, in order and across events: 2N × 2N each, ordered (p, q).
    pub fn transitions(&self) -> &[DMatrix<f64>] {
        &self.transitions
    }

    /// The monodromy matrix, 2N × 2N, ordered (p, q): the derivative of the state after a period with respect to the
    /// state at its start, including the effect of events on the state and the change of their times. Entries beyond
    /// 10³⁰⁸ are infinite or NaN.
    pub fn monodromy(&self) -> DMatrix<f64> {
        let (_, p) = L::parts(&self.start);
        let size = 2 * p.as_ref().len();
        let identity = DMatrix::identity(size, size);
        (self.transitions.iter()).fold(identity, |product, matrix| matrix * product)
    }

    /// The Floquet multipliers, in order of decreasing modulus; computed from the matrices of the elements, not from
    /// their product.
    pub fn multipliers(&self) -> &[Complex<f64>] {
        &self.multipliers
    }

    /// The same as logarithm of the modulus and argument.
    pub(in crate::periodic) fn floquet(&self) -> &[Multiplier] {
        &self.floquet
    }

    /// The index of the trivial multiplier, which is one because the model does not depend on time. Empty for a forced
    /// model, for an equilibrium, and if the period was given and no multiplier is within 10⁻⁴ of one.
    pub fn trivial(&self) -> Vec<usize> {
        trivial_of(&self.floquet, self.trivial)
    }

    /// Whether the orbit is not unstable, according to [`verdict`](Self::verdict), so that neighbouring motions stay
    /// near.
    pub fn is_stable(&self) -> bool {
        !matches!(self.verdict(), Verdict::Unstable { .. })
    }

    /// The stability of the orbit, from all multipliers except the trivial one, with its margin.
    pub fn verdict(&self) -> Verdict {
        Verdict::of(&self.floquet, &self.trivial())
    }

    /// The number of Newton's corrections.
    pub fn iterations(&self) -> u32 {
        self.iterations
    }
}
