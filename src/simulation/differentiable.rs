//! The interface between calls that need derivatives of runs and the two kinds of length of models.

use super::kind::Simulated;
use super::setup::Simulation;
use crate::constraints::ConsistentState;
use crate::error::RunError;
use crate::length::{FixedLength, Length};
use crate::linearised::Linearised;
use crate::motion::Node;
use crate::sensitivity::Sensitive;
use crate::sensitivity::varied::Varied;
use std::ops::Range;
use tfe_runtime::{Model, State};
#[cfg(feature = "sparse")]
use {
    crate::length::RunTimeLength,
    tfe_runtime::family::{self, FamilyState},
};

/// A model whose runs have derivatives: every [`Model`] and, with the feature `sparse`, every
/// [`family::Model`](tfe_runtime::family::Model); internal.
#[cfg_attr(
    not(feature = "sparse"),
    diagnostic::on_unimplemented(
        message = "derivatives of runs of models of run-time length need the feature `sparse`"
    )
)]
pub trait Differentiable<const N: usize, L: Length<N>>: Simulated<N, L> {
    /// Whether the equations of motion contain the time.
    const DEPENDS_ON_TIME: bool;

    /// Whether functions or tables give the inputs of the model.
    const GIVEN_INPUTS: bool;

    /// The state with all coordinates and momenta zero.
    fn zero_state(&self) -> L::State;

    /// The nearest state that satisfies the constraints; the state itself if none is found.
    fn nearest_allowed(&self, t: f64, state: &L::State) -> L::State;

    /// dp/dt at a node.
    fn momentum_rate(&self, node: &Node<N, L>) -> L::Vector;

    /// [`run_linearised`](Simulation::run_linearised)
    ///
    /// # Errors
    /// As from that call.
    fn linearised(
        simulation: &Simulation<'_, Self, N, L>,
        start: L::State,
        span: Range<f64>,
    ) -> Result<Linearised<N, L>, RunError<N, L>>;

    /// [`run_sensitive`](Simulation::run_sensitive)
    ///
    /// # Errors
    /// As from that call.
    fn sensitive(
        simulation: &Simulation<'_, Self, N, L>,
        start: L::State,
        span: Range<f64>,
    ) -> Result<Sensitive<N, L>, RunError<N, L>>;
}

impl<M: Model<N>, const N: usize> Differentiable<N, FixedLength> for M {
    const DEPENDS_ON_TIME: bool = M::FACTS.time_dependent;
    const GIVEN_INPUTS: bool = M::GIVEN_INPUTS;

    fn zero_state(&self) -> State<N> {
        State {
            q: [0.0; N],
            p: [0.0; N],
        }
    }

    fn nearest_allowed(&self, t: f64, state: &State<N>) -> State<N> {
        if const { M::CONSTRAINTS.is_empty() } {
            return *state;
        }
        let guess = [0.0; N];
        let v = Simulated::<N, FixedLength>::allowed_velocity(self, t, state, &guess);
        let found = v.and_then(|v| self.consistent_state_at(t, state.q, v).ok());
        found.map_or(*state, |found| found.state)
    }

    fn momentum_rate(&self, node: &Node<N>) -> [f64; N] {
        self.push(node)
    }

    fn linearised(
        simulation: &Simulation<'_, M, N>,
        start: State<N>,
        span: Range<f64>,
    ) -> Result<Linearised<N>, RunError<N>> {
        simulation.run_linearised(start, span)
    }

    fn sensitive(
        simulation: &Simulation<'_, M, N>,
        start: State<N>,
        span: Range<f64>,
    ) -> Result<Sensitive<N>, RunError<N>> {
        simulation.run_sensitive(start, span)
    }
}

#[cfg(feature = "sparse")]
impl<M: family::Model> Differentiable<0, RunTimeLength> for M {
    const DEPENDS_ON_TIME: bool = M::FACTS.time_dependent || M::MOMENTA_MOVE;
    const GIVEN_INPUTS: bool = M::GIVEN_INPUTS;

    fn zero_state(&self) -> FamilyState {
        let zeros = || vec![0.0; self.len()];
        FamilyState {
            q: zeros(),
            p: zeros(),
        }
    }

    fn nearest_allowed(&self, t: f64, state: &FamilyState) -> FamilyState {
        let length = self.len();
        // The run reports the lengths.
        let fits = state.q.len() == length && state.p.len() == length && self.check().is_ok();
        if !(M::CONSTRAINED && fits) {
            return state.clone();
        }
        family::nearest(self, t, state).unwrap_or_else(|_| state.clone())
    }

    fn momentum_rate(&self, node: &Node<0, RunTimeLength>) -> Vec<f64> {
        self.push(node)
    }

    fn linearised(
        simulation: &Simulation<'_, M, 0, RunTimeLength>,
        start: FamilyState,
        span: Range<f64>,
    ) -> Result<Linearised<0, RunTimeLength>, RunError<0, RunTimeLength>> {
        simulation.run_linearised(start, span)
    }

    fn sensitive(
        simulation: &Simulation<'_, M, 0, RunTimeLength>,
        start: FamilyState,
        span: Range<f64>,
    ) -> Result<Sensitive<0, RunTimeLength>, RunError<0, RunTimeLength>> {
        simulation.run_sensitive(start, span)
    }
}
