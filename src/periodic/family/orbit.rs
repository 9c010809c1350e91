//! A periodic orbit of a model of run-time length, solved.

use super::super::error::OrbitError;
use super::super::orbit::{Exponent, Verdict, sort, trivial_of};
use super::shooting::Shooting;
use crate::length::RunTimeLength;
use crate::motion::{Motion, Node};
use crate::numbers::larger;
use crate::periodic_schur::{self, Multiplier};
use nalgebra::{Complex, DMatrix};
use tfe_runtime::Statistics;
use tfe_runtime::family::{FamilyModel, FamilyState, FamilyTransition};

/// A periodic orbit of a model of run-time length with its Floquet multipliers: what [`Orbit`](crate::Orbit) is for models of fixed size, by the
/// same names.
#[derive(Clone, Debug)]
pub struct FamilyOrbit<'m, M> {
    shooting: Shooting<'m, M>,
    floquet: Vec<Multiplier>,
    multipliers: Vec<Complex<f64>>,
}

impl<'m, M: FamilyModel> FamilyOrbit<'m, M> {
    pub(super) fn new(shooting: Shooting<'m, M>) -> Result<Self, OrbitError> {
        let floquet = periodic_schur::multipliers(&shooting.transitions);
        let mut floquet = floquet.map_err(OrbitError::Multipliers)?;
        sort(&mut floquet);
        Ok(Self {
            shooting,
            multipliers: floquet.iter().map(Multiplier::to_complex).collect(),
            floquet,
        })
    }

    /// The period T, as given or as found.
    pub fn period(&self) -> f64 {
        self.shooting.period
    }

    /// The state at the start of the period.
    pub fn start(&self) -> &FamilyState {
        &self.shooting.nodes[0]
    }

    /// The ends of the elements, in order; the last one is the first one a period later.
    pub fn nodes(&self) -> Vec<Node<0, RunTimeLength>> {
        let shooting = &self.shooting;
        let times = shooting.mesh.times(shooting.start, shooting.period);
        let nodes = times.zip(&shooting.nodes);
        nodes
            .map(|(t, state)| Node::new(shooting.model, t, state, &state.p))
            .collect()
    }

    /// The transition matrices A_e of the elements in order, 2n × 2n, ordered (p, q).
    pub fn transitions(&self) -> &[DMatrix<f64>] {
        &self.shooting.transitions
    }

    /// The monodromy matrix A_E ⋯ A_1, 2n × 2n, ordered (p, q): the derivative of the state after a period by that before.
    ///
    /// Small multipliers of this matrix drown in the round-off of the large ones; [`multipliers`](Self::multipliers) do not come from it.
    pub fn monodromy(&self) -> DMatrix<f64> {
        let size = 2 * self.start().q.len();
        self.transitions()
            .iter()
            .fold(DMatrix::identity(size, size), |product, matrix| {
                matrix * product
            })
    }

    /// The Floquet multipliers μ, the largest modulus first, each to a relative accuracy of its own.
    ///
    /// An autonomous model has the trivial one, μ = 1, a conservative one has it twice; see [`trivial`](Self::trivial).
    pub fn multipliers(&self) -> &[Complex<f64>] {
        &self.multipliers
    }

    /// The multipliers as logarithm of the modulus and argument, in the same order: also where the modulus is no `f64`.
    pub fn floquet(&self) -> &[Multiplier] {
        &self.floquet
    }

    /// The exponents ln μ / T, in the same order.
    pub fn exponents(&self) -> Vec<Exponent> {
        let exponent = |multiplier: &Multiplier| Exponent {
            growth: multiplier.log_modulus / self.period(),
            frequency: multiplier.argument / self.period(),
        };
        self.floquet.iter().map(exponent).collect()
    }

    /// The trivial multipliers: the places, among [`multipliers`](Self::multipliers), of the one nearest to 1 for an autonomous model, of the two
    /// nearest for a conservative one; empty for a forced one.
    pub fn trivial(&self) -> Vec<usize> {
        trivial_of(&self.floquet, self.shooting.trivial())
    }

    /// Whether neighbours stay near: [`verdict`](Self::verdict) is not unstable.
    pub fn is_stable(&self) -> bool {
        !matches!(self.verdict(), Verdict::Unstable { .. })
    }

    /// Stability, from all but the trivial multipliers, with its margin.
    pub fn verdict(&self) -> Verdict {
        let trivial = self.trivial();
        let others = (0..self.floquet.len()).filter(|place| !trivial.contains(place));
        let moduli = others.map(|place| self.floquet[place].modulus());
        Verdict::of(moduli.fold(0.0, larger))
    }

    /// The force γ v that had to be added to close an orbit of an autonomous model whose period or energy was given: as small as
    /// the discretization makes it. `None` for other orbits.
    pub fn unfolding(&self) -> Option<f64> {
        self.shooting.unfolding()
    }

    /// What the solution cost: iterations of Newton's method, elements stepped, sparse factorisations for their derivatives.
    pub fn statistics(&self) -> &Statistics {
        &self.shooting.statistics
    }

    /// The motion over one period, with dense output: the polynomials of the elements.
    pub fn motion(&self) -> Motion<0, RunTimeLength> {
        let shooting = &self.shooting;
        let (start, first) = (shooting.start, &shooting.nodes[0]);
        let mut motion = Motion::from_start(shooting.model, start, first);
        motion.set_statistics(shooting.statistics);
        // Each element begins where the one before ends, to the last bit.
        let mut places = Vec::with_capacity(shooting.mesh.elements());
        let mut t = shooting.start;
        for e in 0..shooting.mesh.elements() {
            let h = shooting.mesh.share(e) * shooting.period;
            places.push((t, h));
            t += h;
        }
        let steps = places.iter().zip(&shooting.nodes);
        let steps = steps.map(|((t, h), node)| (*t, *h, node));
        let mut e = 0;
        let each = |transition: FamilyTransition| {
            let dense = transition.into_dense();
            e += 1;
            let (end, node) = (dense.end(), &shooting.nodes[e]);
            motion.record(shooting.model, end, node);
            motion.keep_element(dense);
        };
        // These steps have been done before: they cannot fail now, and a motion that ends early would show it.
        let _ = FamilyTransition::of_steps(
            shooting.model,
            shooting.element,
            shooting.unfolding,
            steps,
            each,
        );
        motion
    }
}
