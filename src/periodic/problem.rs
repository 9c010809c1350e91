//! The equations of a periodic orbit.

use super::error::OrbitError;
use super::phase::Phase;
use super::repeats::check_repeats;
use crate::assembly::{ClosureMut, DenseMut, Iterate, Mesh, Problem, Solution};
use crate::motion::Node;
use crate::numbers::norm;
use crate::sensitivity::varied::Varied;
use tfe_runtime::condenser::Direction;
use tfe_runtime::dual::{Dual, duals};
use tfe_runtime::{
    Element, First, Form, LegendreError, Model, State, Statistics, StepError, constrained, legendre,
};

/// A global unknown of an orbit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Global {
    /// The period T.
    Period,
    /// The coefficient of the force γ v that unfolds the families of a conservative model; zero in the solution up to
    /// the discretisation error.
    Unfolding,
}

impl Global {
    /// The scale relative to which corrections are measured.
    pub(crate) fn scale(self, period: f64, inertia: f64) -> f64 {
        match self {
            Self::Period => period,
            // A force that would act strongly within a period.
            Self::Unfolding => inertia / period,
        }
    }
}

/// The chain of elements over one period, closed by periodicity.
#[derive(Clone, Debug)]
pub(crate) struct Periodic<'m, M, const N: usize> {
    pub(crate) model: &'m M,
    pub(crate) mesh: Mesh,
    pub(crate) start: f64,
    pub(crate) period: f64,
    pub(crate) unfolding: f64,
    /// Σ p·v / Σ v·v of the guess, by which γ is scaled.
    pub(crate) inertia: f64,
    pub(crate) globals: Vec<Global>,
    /// The increase of the coordinates over a period.
    pub(crate) advance: [f64; N],
    /// The phase condition; `None` if time or the guess fixes the phase.
    pub(crate) phase: Option<Phase>,
    /// The energy at the start, if it is prescribed.
    pub(crate) energy: Option<f64>,
}

impl<'m, M, const N: usize> Periodic<'m, M, N> {
    /// The elements of an iterate over the period, with their transition matrices, as far as these are known, and what
    /// they have cost.
    pub(crate) fn solution(
        &self,
        element: Element,
        iterate: Iterate<N>,
        transitions: Vec<f64>,
        statistics: Statistics,
    ) -> Solution<'m, M, N> {
        Solution {
            model: self.model,
            element,
            mesh: self.mesh.clone(),
            start: self.start,
            length: self.period,
            end: self.start + self.period,
            damping: self.unfolding,
            iterate,
            transitions,
            statistics,
        }
    }
}

impl<M, const N: usize> Periodic<'_, M, N> {
    /// The same equations on elements of half the length.
    pub(crate) fn halved(&self) -> Self {
        Self {
            model: self.model,
            mesh: self.mesh.halved(),
            globals: self.globals.clone(),
            ..*self
        }
    }
}

impl<M: Model<N>, const N: usize> Periodic<'_, M, N> {
    /// The number of equations over all nodes.
    pub(crate) fn dense(&self) -> usize {
        usize::from(self.phase == Some(Phase::Orthogonal))
    }

    /// Checks that a solution is an orbit.
    pub(crate) fn check(&self) -> Result<(), OrbitError> {
        check(self.period, self.unfolding, self.inertia)
    }

    /// Checks that the model is the same a period later.
    pub(crate) fn check_repeats(&self, iterate: &Iterate<N>) -> Result<(), OrbitError> {
        let times = self.mesh.times(self.start, self.period);
        let nodes: Vec<_> = times.zip(iterate.nodes.iter().copied()).collect();
        check_repeats(self.model, &nodes, self.period, |a| self.advance[a])
    }

    /// The row Σ h_e ẏ_e · δy_e = 0 for few elements, with the flow from the equations of motion.
    fn orthogonal_to_flow_at(&self, nodes: &[State<N>], weights: &mut [f64]) {
        weights.fill(0.0);
        for (element, weights) in weights.chunks_exact_mut(2 * N).enumerate() {
            if element == self.mesh.elements() {
                // The last node is the first one, one period later.
                break;
            }
            let (time, length) = self.place(element);
            let flow = flow_at(self.model, time, &nodes[element]);
            // If there is none, the equations are singular and report it.
            let [by_p, by_q] = flow.unwrap_or([[0.0; N]; 2]);
            for a in 0..N {
                weights[a] = length * by_p[a];
                weights[N + a] = length * by_q[a];
            }
        }
    }

    /// The number of trivial multipliers: zero for a forced orbit, one for an autonomous model, two for a conservative
    /// one.
    pub(crate) fn trivial(&self) -> usize {
        let unfolded = self.globals.contains(&Global::Unfolding);
        usize::from(self.phase.is_some()) * (1 + usize::from(unfolded))
    }
}

/// Σ p·v / Σ v·v over samples of a guess, given as concatenated momenta and velocities; one if the guess is at rest.
pub(crate) fn inertia_of(p: &[f64], v: &[f64]) -> f64 {
    let speed = norm(v);
    let action: f64 = p.iter().zip(v).map(|(p, v)| p * (v / speed)).sum();
    let inertia = (action / speed).abs();
    if inertia > 0.0 && inertia.is_finite() {
        inertia
    } else {
        1.0
    }
}

/// Checks that a solution is an orbit.
pub(crate) fn check(period: f64, unfolding: f64, inertia: f64) -> Result<(), OrbitError> {
    if !(period > 0.0) {
        return Err(OrbitError::Period { period });
    }
    // Damping that takes one percent of the motion over a period is more than a discretisation error.
    if !(unfolding.abs() * period < 1e-2 * inertia) {
        return Err(OrbitError::NoFamily { unfolding });
    }
    Ok(())
}

/// Writes the rows of periodicity: y_E − y_0 = (0, advance).
pub(crate) fn close_periodically<const N: usize>(
    advance: &[f64; N],
    iterate: &Iterate<N>,
    closure: &mut ClosureMut<'_>,
) {
    let (Some(first), Some(last)) = (iterate.nodes.first(), iterate.nodes.last()) else {
        return;
    };
    for row in 0..2 * N {
        closure.first[row * 2 * N + row] = -1.0;
        closure.last[row * 2 * N + row] = 1.0;
        closure.right[row] = match row.checked_sub(N) {
            None => first.p[row] - last.p[row],
            Some(a) => first.q[a] + advance[a] - last.q[a],
        };
    }
}

/// The least number of elements for which the two neighbours of a node differ, so that their difference approximates
/// the flow.
pub(crate) const NEIGHBOURED: usize = 3;

/// The row Σ h_e ẏ_e · δy_e = 0: the correction is orthogonal to the flow, so that the phase of the guess is kept.
///
/// The flow is approximated by the difference of the neighbours; a phase condition need not be exact.
fn orthogonal_to_flow<const N: usize>(advance: &[f64; N], nodes: &[State<N>], weights: &mut [f64]) {
    let last = nodes.len() - 1;
    for e in 0..last {
        let previous = if e == 0 {
            &nodes[last - 1]
        } else {
            &nodes[e - 1]
        };
        let next = &nodes[e + 1];
        for a in 0..N {
            let turn = if e == 0 { advance[a] } else { 0.0 };
            weights[e * 2 * N + a] = next.p[a] - previous.p[a];
            weights[e * 2 * N + N + a] = next.q[a] - previous.q[a] + turn;
        }
    }
    weights[last * 2 * N..].fill(0.0);
}

/// The flow ẏ = (ṗ, q̇) at a state, from the equations of motion, in the order (p, q); `None` if no velocity belongs to
/// the momentum, or there are no reactions.
fn flow_at<M: Model<N>, const N: usize>(
    model: &M,
    t: f64,
    state: &State<N>,
) -> Option<[[f64; N]; 2]> {
    let v = velocity_of(model, t, state).ok()?;
    let node: Node<N> = Node::of(t, state, v);
    let push = model.push(&node);
    push.iter()
        .all(|push| push.is_finite())
        .then_some([push, v])
}

/// The velocity of a momentum; if the kinetic energy does not determine it, the one that the constraints determine.
fn velocity_of<M: Model<N>, const N: usize>(
    model: &M,
    t: f64,
    state: &State<N>,
) -> Result<[f64; N], LegendreError> {
    let found = constrained::velocity_of(model, t, &state.q, &state.p, &[0.0; N]);
    found.map_err(|error| match error {
        StepError::Legendre(error) => error,
        StepError::NonFinite => LegendreError::NonFinite,
        _ => LegendreError::Singular { coordinate: 0 },
    })
}

/// H and its gradient (H_p, H_q).
pub(crate) fn energy_slopes<M: Model<N>, const N: usize>(
    model: &M,
    t: f64,
    state: &State<N>,
) -> Result<(f64, [f64; N], [f64; N]), LegendreError> {
    let mut first = First::ZERO;
    if M::FORM == Form::Hamiltonian {
        model.first(t, &state.q, &state.p, &mut first);
        let energy = model.energy_function(t, &state.q, &state.p);
        return Ok((energy, first.z, first.q));
    }
    let v = velocity_of(model, t, state)?;
    model.first(t, &state.q, &v, &mut first);
    let energy = legendre::energy_at(model, t, &state.q, &state.p, &v);
    Ok((energy, v, first.q.map(|slope| -slope)))
}

/// ∂H/∂a at fixed coordinates and momenta; equal to −∂L/∂a at fixed velocities.
fn energy_by<M: Model<N>, const N: usize>(
    model: &M,
    t: f64,
    state: &State<N>,
    parameter: usize,
) -> Result<f64, LegendreError> {
    let (z, sign) = match M::FORM {
        Form::Hamiltonian => (state.p, 1.0),
        Form::Lagrangian => (velocity_of(model, t, state)?, -1.0),
    };
    let time = Dual::new(t, 0.0).by_parameter(Some(parameter));
    let still = |values: &[f64; N]| duals(values, &[0.0; N]);
    Ok(sign
        * model
            .energy_function(time, &still(&state.q), &still(&z))
            .slope)
}

impl<M: Model<N>, const N: usize> Problem<N> for Periodic<'_, M, N> {
    type Model = M;

    fn model(&self) -> &M {
        self.model
    }

    fn place(&self, element: usize) -> (f64, f64) {
        self.mesh.place(element, self.start, self.period)
    }

    fn directions(&self, element: usize, directions: &mut [Direction]) {
        for (direction, global) in directions.iter_mut().zip(&self.globals) {
            *direction = match global {
                Global::Period => self.stretched(element),
                Global::Unfolding => Direction {
                    damping: 1.0,
                    ..Direction::default()
                },
            };
        }
    }

    fn stretched(&self, element: usize) -> Direction {
        self.mesh.stretched(element)
    }

    fn damping(&self) -> f64 {
        self.unfolding
    }

    fn scale(&self, global: usize) -> f64 {
        self.globals[global].scale(self.period, self.inertia)
    }

    fn set_globals(&mut self, globals: &[f64]) {
        for (global, value) in self.globals.iter().zip(globals) {
            match global {
                Global::Period => self.period = *value,
                Global::Unfolding => self.unfolding = *value,
            }
        }
    }

    fn close(
        &self,
        iterate: &Iterate<N>,
        mut closure: ClosureMut<'_>,
    ) -> Result<(), LegendreError> {
        closure.clear();
        close_periodically(&self.advance, iterate, &mut closure);
        let Some(first) = iterate.nodes.first() else {
            return Ok(());
        };
        let mut row = 2 * N;
        match self.phase {
            Some(Phase::Coordinate { index, value }) => {
                closure.first[row * 2 * N + N + index] = 1.0;
                closure.right[row] = value - first.q[index];
                row += 1;
            }
            Some(Phase::Momentum { index, value }) => {
                closure.first[row * 2 * N + index] = 1.0;
                closure.right[row] = value - first.p[index];
                row += 1;
            }
            Some(Phase::Orthogonal) | None => {}
        }
        if let Some(energy) = self.energy {
            let (present, by_p, by_q) = energy_slopes(self.model, self.start, first)?;
            let slopes = &mut closure.first[row * 2 * N..(row + 1) * 2 * N];
            slopes[..N].copy_from_slice(&by_p);
            slopes[N..].copy_from_slice(&by_q);
            closure.right[row] = energy - present;
        }
        Ok(())
    }

    fn close_by(
        &self,
        parameter: usize,
        iterate: &Iterate<N>,
        right: &mut [f64],
    ) -> Result<(), LegendreError> {
        // The equation of the energy is the last one.
        if let (Some(_), Some(right), Some(first)) =
            (self.energy, right.last_mut(), iterate.nodes.first())
        {
            *right = -energy_by(self.model, self.start, first, parameter)?;
        }
        Ok(())
    }

    fn span(&self, _k: usize, iterate: &Iterate<N>, dense: DenseMut<'_>) {
        if self.mesh.elements() < NEIGHBOURED {
            self.orthogonal_to_flow_at(&iterate.nodes, dense.nodes);
        } else {
            orthogonal_to_flow(&self.advance, &iterate.nodes, dense.nodes);
        }
        dense.global.fill(0.0);
        *dense.right = 0.0;
    }
}
