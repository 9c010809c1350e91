//! Periodic orbits of models of run-time length with their derivatives by parameters.

use super::super::error::OrbitError;
use super::super::moving;
use super::super::orbit::Orbit;
use super::super::problem::Global;
use super::super::sensitive::{OrbitSlopes, SensitiveOrbit};
use super::super::setup::PeriodicOrbit;
use super::orbit_of;
use super::shooting::{Shooting, component, step_failed};
use crate::assembly::{AssemblyError, Chain};
use crate::differences::places;
use crate::length::RunTimeLength;
use crate::periodic::phase::Phase;
use crate::periodic_schur::Multiplier;
use nalgebra::Complex;
use tfe_runtime::Form;
use tfe_runtime::dual::Dual;
use tfe_runtime::family::{self, FamilyState};

impl<'m, M: family::Model> PeriodicOrbit<'m, M, 0, RunTimeLength> {
    /// Finds the orbit as [`solve`](Self::solve) does, and the derivatives of its period, its start and its
    /// multipliers with respect to each parameter, as for models of fixed size. Each parameter costs one more solution
    /// and, for the multipliers, the transition matrices of eight to twenty-four neighbouring orbits.
    ///
    /// # Errors
    /// As from [`solve`](Self::solve).
    pub fn solve_sensitive(
        &self,
    ) -> Result<SensitiveOrbit<Orbit<'m, M, 0, RunTimeLength>, 0, RunTimeLength>, OrbitError> {
        let orbit = orbit_of(self.solved()?)?;
        let shooting = &orbit.solution;
        let changes = shooting.changes()?;
        let parameters = self.model.parameters();
        let slopes = changes.iter().enumerate().map(|(place, change)| {
            let parameter = (place < parameters).then_some(place);
            let start = &change.nodes[0];
            OrbitSlopes {
                period: change.period,
                start: start.clone(),
                multipliers: shooting.moving(&orbit, change, parameter),
            }
        });
        let mut slopes: Vec<_> = slopes.collect();
        let by_period = slopes.split_off(parameters).pop();
        let names = (0..parameters).map(|index| self.model.parameter_name(index));
        Ok(SensitiveOrbit {
            parameters: names.map(|name| name.to_string()).collect(),
            orbit,
            slopes,
            by_period,
        })
    }
}

/// The derivative of a solution by a quantity.
struct Change {
    nodes: Vec<FamilyState>,
    period: f64,
    unfolding: f64,
}

impl<'m, M: family::Model> Shooting<'m, M> {
    /// The derivatives by all parameters, and by the period if it is given.
    fn changes(&self) -> Result<Vec<Change>, OrbitError> {
        let (model, n) = (self.model, self.model.len());
        let elements = self.mesh.elements();
        let parameters: Vec<usize> = (0..model.parameters()).collect();
        let by_period = !self.globals.contains(&Global::Period);
        let sides = parameters.len() + usize::from(by_period);
        if sides == 0 {
            return Ok(Vec::new());
        }
        let dense = usize::from(self.phase == Some(Phase::Orthogonal));
        let mut chain = Chain::with_right_sides(2 * n, self.globals.len(), elements, dense, sides);
        let places = self.places(self.period);
        let steps = places.iter().zip(&self.nodes);
        let steps = steps.map(|((t, h), node)| (*t, *h, node));
        let mut e = 0;
        let each = |transition: family::TransitionOperator| {
            self.link(&mut chain, e, &transition);
            for (side, by) in transition.by_parameters().iter().enumerate() {
                let right = &mut chain.right_side_mut(side).links;
                right[e * 2 * n..(e + 1) * 2 * n].copy_from_slice(by);
            }
            e += 1;
            Ok(())
        };
        let asked = (self.unfolding, &parameters[..]);
        let stepped =
            family::TransitionOperator::of_steps_by(model, self.element, asked, steps, each);
        stepped.map_err(|failed| step_failed(failed, &places))?;
        self.close(&mut chain)?;
        for side in 0..sides {
            let right = chain.right_side_mut(side);
            right.closure.fill(0.0);
            right.dense.fill(0.0);
            // The equation of the energy is the last one.
            if let (Some(_), Some(parameter)) = (self.energy, parameters.get(side))
                && let Some(right) = right.closure.last_mut()
            {
                *right = -self.energy_by(*parameter)?;
            }
        }
        if by_period {
            chain.right_side_mut(parameters.len()).links = self.ends_by_period()?;
        }
        let iterations = 0;
        (chain.solve()).map_err(|_| AssemblyError::Singular { iterations })?;
        let global = |side: usize, of: Global| {
            let place = self.globals.iter().position(|own| *own == of);
            place.map_or(0.0, |place| chain.globals_of(side)[place])
        };
        let change = |side: usize| Change {
            nodes: (0..=elements)
                .map(|e| {
                    let (p, q) = chain.node_of(side, e).split_at(n);
                    let (p, q) = (p.to_vec(), q.to_vec());
                    FamilyState { q, p }
                })
                .collect(),
            period: match side < parameters.len() {
                true => global(side, Global::Period),
                false => 1.0,
            },
            unfolding: global(side, Global::Unfolding),
        };
        Ok((0..sides).map(change).collect())
    }

    /// The derivatives of the ends of the elements by the period, at fixed start nodes: differences of eighth order.
    fn ends_by_period(&self) -> Result<Vec<f64>, OrbitError> {
        let size = 2 * self.model.len();
        let mut sums = vec![0.0; size * self.mesh.elements()];
        let distance = moving::distance_of_period(self.period, self.mesh.elements());
        for place in places(distance) {
            let places = self.places(self.period + place.shift);
            let mut rows = sums.chunks_exact_mut(size);
            self.stepped(
                self.model,
                (&places, &self.nodes),
                self.unfolding,
                |transition| {
                    let row = rows.next().unwrap_or_default();
                    for (k, sum) in row.iter_mut().enumerate() {
                        *sum += place.eighth * component(transition.end(), k);
                    }
                },
            )?;
        }
        Ok(sums)
    }

    fn stepped(
        &self,
        model: &M,
        (places, nodes): (&[(f64, f64)], &[FamilyState]),
        damping: f64,
        each: impl FnMut(family::TransitionOperator),
    ) -> Result<(), OrbitError> {
        let steps = places.iter().zip(nodes);
        let steps = steps.map(|((t, h), node)| (*t, *h, node));
        let done = family::TransitionOperator::of_steps(model, self.element, damping, steps, each);
        done.map_err(|failed| step_failed(failed, places))
    }

    /// ∂H/∂a at fixed coordinates and momenta; equal to −∂L/∂a at fixed velocities.
    fn energy_by(&self, parameter: usize) -> Result<f64, OrbitError> {
        let (t, first) = (self.start, &self.nodes[0]);
        let velocity = family::velocity(self.model, t, first)
            .map_err(|error| OrbitError::Family(error.into()))?;
        let (z, sign) = match M::FORM {
            Form::Lagrangian => (&velocity, -1.0),
            Form::Hamiltonian => (&first.p, 1.0),
        };
        let still =
            |values: &[f64]| -> Vec<Dual> { values.iter().map(|x| Dual::new(*x, 0.0)).collect() };
        let time = Dual::new(t, 0.0).by_parameter(Some(parameter));
        let energy = self
            .model
            .energy_function(time, &still(&first.q), &still(z));
        Ok(sign * energy.slope)
    }

    /// The derivatives of the multipliers by a parameter, or by the period.
    fn moving(
        &self,
        orbit: &Orbit<'m, M, 0, RunTimeLength>,
        change: &Change,
        parameter: Option<usize>,
    ) -> Vec<Option<Complex<f64>>> {
        let value = parameter.map_or(self.period, |index| self.model.parameter(index));
        let part = |of: fn(&FamilyState) -> &Vec<f64>| {
            let all = |nodes: &[FamilyState]| -> Vec<f64> {
                nodes.iter().flat_map(of).copied().collect()
            };
            moving::part(&all(&change.nodes), &all(&self.nodes))
        };
        let parts = [
            part(|state| &state.q),
            part(|state| &state.p),
            change.period.abs() / self.period,
        ];
        let moved = |shift: f64| -> Vec<FamilyState> {
            let pairs = self.nodes.iter().zip(&change.nodes);
            let sum = |own: &[f64], by: &[f64]| -> Vec<f64> {
                own.iter().zip(by).map(|(x, y)| x + shift * y).collect()
            };
            let state = |(own, by): (&FamilyState, &FamilyState)| FamilyState {
                q: sum(&own.q, &by.q),
                p: sum(&own.p, &by.p),
            };
            pairs.map(state).collect()
        };
        let at = |shift: f64| -> Option<Vec<Multiplier>> {
            let own;
            let model = match parameter {
                None => self.model,
                Some(index) => {
                    own = self.model.with_parameter(index, value + shift)?;
                    &own
                }
            };
            let places = self.places(self.period + shift * change.period);
            let damping = self.unfolding + shift * change.unfolding;
            let mut transitions = Vec::new();
            let each =
                |transition: family::TransitionOperator| transitions.push(transition.matrix());
            let nodes = moved(shift);
            self.stepped(model, (&places, &nodes), damping, each).ok()?;
            let period = self.period + shift * change.period;
            self.floquet_of(&transitions, (&nodes, period), model).ok()
        };
        let distances = moving::distances(value, parts);
        moving::derivatives(orbit.floquet(), &orbit.trivial(), &distances, at)
    }
}
