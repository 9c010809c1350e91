//! Warnings about the runs of an ensemble that reached their ends.

use crate::evaluate::Evaluate;
use crate::length::Length;
use crate::motion::Node;
use crate::simulation::is_jump;
use std::fmt;

/// How many runs of an ensemble may be wrong although they reached their ends, by the kind of
/// [`Warning`](crate::Warning) that a single run would give; from [`Ends::warnings`](super::Ends::warnings).
///
/// Energies are compared at the ends of the span only: what a run loses and regains in between is not noticed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct WarningCounts {
    /// Runs that end with an energy that is not finite: [`Warning::EnergyNotFinite`](crate::Warning::EnergyNotFinite).
    pub energy_not_finite: usize,
    /// Runs that end with another energy than they began with, although the model conserves it:
    /// [`Warning::EnergyJump`](crate::Warning::EnergyJump).
    pub energy_jump: usize,
}

impl WarningCounts {
    /// The warnings of one run, from the energies at its start and its end; `rounding` returns the rounding error of
    /// the energy.
    pub(super) fn of(
        is_conserved: bool,
        before: Energy,
        after: Energy,
        rounding: &dyn Fn() -> f64,
    ) -> Self {
        let kinetic = before.kinetic.max(after.kinetic);
        let is_lost = !after.energy.is_finite();
        let jumps = is_conserved
            && before.energy.is_finite()
            && !is_lost
            && is_jump([before.energy, after.energy], kinetic, rounding);
        Self {
            energy_not_finite: usize::from(is_lost),
            energy_jump: usize::from(jumps),
        }
    }

    pub(super) fn add(&mut self, other: Self) {
        self.energy_not_finite += other.energy_not_finite;
        self.energy_jump += other.energy_jump;
    }

    /// Whether no run has a warning.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }
}

impl fmt::Display for WarningCounts {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} with an energy that is not finite, {} with a jump of an energy that is conserved",
            self.energy_not_finite, self.energy_jump
        )
    }
}

/// The energy at a state.
#[derive(Clone, Copy, Debug)]
pub(super) struct Energy {
    energy: f64,
    /// Half of p·v, as a scale, for every Hamiltonian.
    kinetic: f64,
}

impl Energy {
    /// The energy of an invalid state.
    pub(super) const UNKNOWN: Self = Self {
        energy: f64::NAN,
        kinetic: 0.0,
    };

    /// The energy at a state; NaN if no velocity belongs to the momentum.
    pub(super) fn of<M, L, const N: usize>(model: &M, t: f64, state: &L::State) -> Self
    where
        M: Evaluate<N, L>,
        L: Length<N>,
    {
        let (_, p) = L::parts(state);
        Self::at(model, &Node::new(model, t, state, &L::zero(p)))
    }

    /// The energy at a node, whose velocity is known.
    pub(super) fn at<M, L, const N: usize>(model: &M, node: &Node<N, L>) -> Self
    where
        M: Evaluate<N, L>,
        L: Length<N>,
    {
        Self {
            energy: model.energy(node.t, (&node.q, &node.p), &node.v),
            kinetic: 0.5 * node.action().abs(),
        }
    }
}
