//! Periodic orbits with events, with their derivatives by parameters.

use super::error::OrbitError;
use super::hybrid::{Closing, Correction, HybridOrbit, HybridOrbits, scales};
use super::moving;
use super::orbit::sort;
use super::phase::Period;
use super::sensitive::{OrbitSlopes, SensitiveOrbit};
use crate::differences::places;
use crate::numbers::largest;
use crate::periodic_schur::Multiplier;
use nalgebra::DVector;
use tfe_runtime::{Model, State};

impl<'m, M: Model<N> + Send + Sync + 'm, const N: usize> HybridOrbits<'m, M, N> {
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
    pub fn solve_sensitive(&self) -> Result<SensitiveOrbit<HybridOrbit<N>, N>, OrbitError> {
        let orbit = self.solve()?;
        let (start, period) = (orbit.start(), orbit.period());
        let end = self.start + period;
        let run = self.simulation.clone().record_every(1);
        let run = run.step(period / self.elements as f64);
        let s = run.run_sensitive(start, self.start..end);
        let s = s.map_err(|error| {
            let error = error.of_call("run_sensitive", "solve_sensitive");
            OrbitError::Run(error.kind().clone())
        })?;
        let scales = scales(orbit.motion());
        let is_free = matches!(self.period, Period::Guess(_));
        let by_length = self.by_length(start, period)?;
        let closing = Closing {
            product: s.by_start().last(),
            rate: is_free.then(|| by_length.clone()),
            scales: &scales,
            period,
        };
        let slopes = |by_end: DVector<f64>, parameter: Option<usize>| {
            let residual = DVector::from_fn(2 * N, |row, _| by_end[row] / scales.of(row));
            let Correction { start, stretch, .. } = closing.shortest(&residual)?;
            let change = |row: usize| start[row] * scales.of(row);
            let moved = State {
                q: std::array::from_fn(|a| change(N + a)),
                p: std::array::from_fn(change),
            };
            let stretch = if parameter.is_some() { stretch } else { 1.0 };
            Ok(OrbitSlopes {
                period: stretch,
                start: moved,
                multipliers: self.moving(&orbit, (moved, stretch), parameter),
            })
        };
        let by_parameter = s.parameters().iter().enumerate().map(|(index, name)| {
            let by = s.by(name).last();
            let by_end = by.p.iter().chain(&by.q).copied();
            slopes(DVector::from_iterator(2 * N, by_end), Some(index))
        });
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
    fn by_length(&self, start: State<N>, period: f64) -> Result<DVector<f64>, OrbitError> {
        let mut sum = DVector::zeros(2 * N);
        for place in places(moving::distance_of_period(period, self.elements)) {
            let run = self.run(&start, period + place.shift)?;
            let last = run.motion().last();
            let end = last.p.iter().chain(&last.q).copied();
            sum += DVector::from_iterator(2 * N, end) * place.eighth;
        }
        Ok(sum)
    }

    /// The derivatives of the multipliers, given those of start and period, by a parameter or by the period alone.
    fn moving(
        &self,
        orbit: &HybridOrbit<N>,
        (by_start, by_period): (State<N>, f64),
        parameter: Option<usize>,
    ) -> Vec<Option<nalgebra::Complex<f64>>> {
        let model = self.simulation.model();
        let (start, period) = (orbit.start(), orbit.period());
        let value = parameter.map_or(period, |index| model.parameter(index));
        let scales = scales(orbit.motion());
        let parts = [
            largest(&by_start.q) / scales.q,
            largest(&by_start.p) / scales.p,
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
            let moved = State {
                q: std::array::from_fn(|a| start.q[a] + shift * by_start.q[a]),
                p: std::array::from_fn(|a| start.p[a] + shift * by_start.p[a]),
            };
            let run = orbits.run(&moved, period + shift * by_period).ok()?;
            let mut found = run.multipliers().ok()?;
            sort(&mut found);
            Some(found)
        };
        let distances = moving::distances(value, parts);
        moving::derivatives(orbit.floquet(), &orbit.trivial(), &distances, at)
    }
}
