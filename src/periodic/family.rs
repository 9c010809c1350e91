//! Periodic orbits of models of run-time length.

mod chain;
mod sensitive;
mod shooting;

use super::error::OrbitError;
use super::kind::Chained;
use super::orbit::Orbit;
use super::phase::Period;
use super::problem::Global;
use super::repeats::check_repeats;
use super::rest::{Extent, is_at_rest, may_rest};
use super::setup::{Guess, PeriodicOrbit};
use crate::assembly::Mesh;
use crate::length::RunTimeLength;
use crate::simulation::Simulation;
use shooting::Shooting;
use tfe_runtime::family::{self, FamilyState};

impl<'m, M: family::Model> PeriodicOrbit<'m, M, 0, RunTimeLength> {
    /// Finds the orbit and its Floquet multipliers.
    ///
    /// # Errors
    /// As for models of fixed size; also [`OrbitError::Family`] for a model that is invalid or not supported, or steps that
    /// cannot be differentiated, and [`OrbitError::Unsupported`] with [`advance`](Self::advance).
    pub fn solve(&self) -> Result<Orbit<'m, M, 0, RunTimeLength>, OrbitError> {
        orbit_of(self.solved()?)
    }

    /// Solves the equations.
    fn solved(&self) -> Result<Shooting<'m, M>, OrbitError> {
        let period = self.period.checked()?;
        self.check_numbers()?;
        if self.advance.is_some() {
            return Err(OrbitError::Unsupported {
                call: "advance",
                of: "models of run-time length",
            });
        }
        self.model
            .check()
            .map_err(|error| OrbitError::Family(error.into()))?;
        let autonomous = !(M::FACTS.time_dependent || M::MOMENTA_MOVE);
        let conservative = autonomous && !M::FACTS.forced;
        let known = matches!(self.period, Period::Known(_));
        if !(autonomous || known) {
            return Err(OrbitError::ForcedPeriod);
        }
        self.check_energy(conservative)?;
        let mesh = Mesh::new(self.elements, &self.weights)?;
        let nodes = self.nodes(&mesh, period)?;
        let mut shooting =
            Shooting::new(self.model, self.element, mesh, (self.start, period), nodes);
        let at_rest = autonomous && known && shooting.is_at_rest();
        if !known {
            shooting.globals.push(Global::Period);
        }
        if autonomous && !at_rest {
            shooting.phase = Some(self.checked_phase(self.model.len())?);
            if conservative || known {
                shooting.globals.push(Global::Unfolding);
            }
            if shooting.globals.len() == 2 {
                let energy = self.energy.or_else(|| shooting.energy_of_start());
                shooting.energy = energy;
            }
        }
        let extent = |shooting: &Shooting<'_, M>| {
            let places = shooting.nodes.iter().map(|node| &node.q[..]);
            Extent::of(places)
        };
        let guess = extent(&shooting);
        let solved = shooting.solve(self.control);
        // If a phase condition is given, an equilibrium is not accepted.
        if shooting.phase.is_some()
            && may_rest(&solved)
            && is_at_rest(extent(&shooting), &guess, || shooting.motion())
        {
            return Err(OrbitError::AtRest);
        }
        solved?;
        let times = shooting.mesh.times(shooting.start, shooting.period);
        let nodes: Vec<_> = times.zip(shooting.nodes.iter().cloned()).collect();
        check_repeats(self.model, &nodes, shooting.period, |_| 0.0)?;
        Ok(shooting)
    }

    /// The states of the first guess at the nodes.
    fn nodes(&self, mesh: &Mesh, period: f64) -> Result<Vec<FamilyState>, OrbitError> {
        let n = self.model.len();
        let state = |t: f64, (q, v): (Vec<f64>, Vec<f64>)| {
            let p = family::momenta(self.model, t, &q, &v);
            let p = p.map_err(|error| OrbitError::Family(error.into()))?;
            Ok(FamilyState { q, p })
        };
        let mut times = mesh.times(self.start, period);
        match &self.guess {
            Guess::Rest => times
                .map(|t| state(t, (vec![0.0; n], vec![0.0; n])))
                .collect(),
            Guess::Curve(curve) => times.map(|t| state(t, curve(t))).collect(),
            Guess::Start(start) => {
                let simulation = Simulation::new(self.model)
                    .element(self.element)
                    .step(period / self.elements as f64);
                let motion = simulation
                    .run(start.clone(), self.start..self.start + period)
                    .map_err(|error| OrbitError::Guess(error.kind().clone()))?;
                let last = motion.last().t;
                times.try_fold(Vec::new(), |mut nodes, t| {
                    let node = motion.at(t.min(last));
                    nodes.push(node.map_or_else(|_| motion.last().state(), |node| node.state()));
                    Ok(nodes)
                })
            }
        }
    }
}

/// The orbit of a solution, with its multipliers.
fn orbit_of<M: family::Model>(
    shooting: Shooting<'_, M>,
) -> Result<Orbit<'_, M, 0, RunTimeLength>, OrbitError> {
    let at = (&shooting.nodes[..], shooting.period);
    let floquet = shooting.floquet_of(&shooting.transitions, at, shooting.model)?;
    let (trivial, unfolding) = (shooting.trivial(), shooting.unfolding());
    let warnings = shooting.doubts();
    let orbit = Orbit::of_solution(shooting, floquet, trivial, unfolding);
    Ok(orbit.with_warnings(warnings))
}
