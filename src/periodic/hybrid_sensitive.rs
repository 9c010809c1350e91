//! Periodic orbits with events, with their derivatives by parameters.

use super::closing::{Closing, Correction, moved, scales};
use super::error::OrbitError;
use super::hybrid::{HybridOrbit, HybridOrbits};
use super::moving;
use super::orbit::sort;
use super::phase::Period;
use super::sensitive::{OrbitSlopes, SensitiveOrbit};
use crate::differences::places;
use crate::length::Length;
use crate::motion::Node;
use crate::numbers::largest;
use crate::periodic_schur::Multiplier;
use crate::simulation::Differentiable;
use nalgebra::DVector;

impl<'m, M, const N: usize, L> HybridOrbits<'m, M, N, L>
where
    M: Differentiable<N, L> + Send + Sync + 'm,
    L: Length<N>,
{
    /// Finds the orbit as [`solve`](Self::solve) does, and the derivatives of its start, its period and its
    /// multipliers with respect to each parameter of the model.
    ///
    /// Start and period are differentiated across events, as in [`run_sensitive`](crate::Simulation::run_sensitive);
    /// of the changes that keep the orbit closed the shortest is taken, and a period that was given stays
    /// (`docs/theory.md`, (T-142)). Derivatives of multipliers are differences of eighth order (T-157). If the
    /// function of an event reads numbers that are not parameters of the model, the dependence on them is not
    /// differentiated.
    ///
    /// # Errors
    /// As from [`solve`](Self::solve); also [`OrbitError::Run`] if an event has no derivative.
    pub fn solve_sensitive(&self) -> Result<SensitiveOrbit<HybridOrbit<N, L>, N, L>, OrbitError> {
        let orbit = self.solve()?;
        let (start, period) = (orbit.start(), orbit.period());
        let end = self.start + period;
        let run = self.simulation.clone().record_every(1);
        let run = run.step(period / self.elements as f64);
        let s = M::sensitive(&run, start.clone(), self.start..end);
        let s = s.map_err(|error| {
            let error = error.of_call("run_sensitive", "solve_sensitive");
            OrbitError::Run(error.kind().clone())
        })?;
        let scales = scales(orbit.motion());
        let is_free = matches!(self.period, Period::Guess(_));
        let by_length = self.by_length(&start, period)?;
        let closing = Closing {
            product: s.by_start().last(),
            rate: is_free.then(|| by_length.clone()),
            scales: &scales,
            period,
        };
        let slopes = |by_end: DVector<f64>, parameter: Option<usize>| {
            let residual = DVector::from_fn(by_end.len(), |row, _| by_end[row] / scales.of(row));
            let Correction {
                start: change,
                stretch,
                ..
            } = closing.shortest(&residual)?;
            let (q, _) = L::parts(&start);
            let still = L::state(L::zero(q), L::zero(q));
            let change = moved::<N, L>(&still, |row| change[row] * scales.of(row));
            let stretch = if parameter.is_some() { stretch } else { 1.0 };
            Ok(OrbitSlopes {
                period: stretch,
                multipliers: self.moving(&orbit, (&change, stretch), parameter),
                start: change,
            })
        };
        let by_parameter = s
            .parameters()
            .iter()
            .enumerate()
            .map(|(index, name)| slopes(components(&s.by(name).last()), Some(index)));
        let by_parameter = by_parameter.collect::<Result<Vec<_>, OrbitError>>()?;
        let by_period = match is_free {
            true => None,
            false => Some(slopes(by_length, None)?),
        };
        Ok(SensitiveOrbit {
            parameters: s.parameters().to_vec(),
            slopes: by_parameter,
            by_period,
            orbit,
        })
    }

    /// The derivative of the end by the period, in the order (p, q), all elements being stretched: a difference of
    /// eighth order.
    fn by_length(&self, start: &L::State, period: f64) -> Result<DVector<f64>, OrbitError> {
        let (q, _) = L::parts(start);
        let mut sum = DVector::zeros(2 * q.as_ref().len());
        for place in places(moving::distance_of_period(period, self.elements)) {
            let run = self.run(start, period + place.shift)?;
            sum += components(run.motion().last()) * place.eighth;
        }
        Ok(sum)
    }

    /// The derivatives of the multipliers, given those of start and period, by a parameter or by the period alone.
    fn moving(
        &self,
        orbit: &HybridOrbit<N, L>,
        (by_start, by_period): (&L::State, f64),
        parameter: Option<usize>,
    ) -> Vec<Option<nalgebra::Complex<f64>>> {
        let model = self.simulation.model();
        let (start, period) = (orbit.start(), orbit.period());
        let value = parameter.map_or(period, |index| model.parameter_value(index));
        let scales = scales(orbit.motion());
        let (by_q, by_p) = L::parts(by_start);
        let (by_q, by_p) = (by_q.as_ref(), by_p.as_ref());
        let parts = [
            largest(by_q) / scales.q,
            largest(by_p) / scales.p,
            by_period.abs() / period,
        ];
        let at = |shift: f64| -> Option<Vec<Multiplier>> {
            let own;
            let orbits = match parameter {
                None => self,
                Some(index) => {
                    own = self.of(self.simulation.with_parameter(index, value + shift)?);
                    &own
                }
            };
            let moved = moved::<N, L>(&start, |row| match row.checked_sub(by_p.len()) {
                None => shift * by_p[row],
                Some(a) => shift * by_q[a],
            });
            let run = orbits.run(&moved, period + shift * by_period).ok()?;
            let mut found = run.multipliers().ok()?;
            sort(&mut found);
            Some(found)
        };
        let distances = moving::distances(value, parts);
        moving::derivatives(orbit.floquet(), &orbit.trivial(), &distances, at)
    }
}

/// The momenta and coordinates of a node, in this order.
fn components<const N: usize, L: Length<N>>(node: &Node<N, L>) -> DVector<f64> {
    let (p, q) = (node.p.as_ref(), node.q.as_ref());
    DVector::from_iterator(2 * q.len(), p.iter().chain(q).copied())
}
