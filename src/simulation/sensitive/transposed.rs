//! The transposed jump at an event, for gradients that go backwards (T-166).

use super::acts::{DISTANCE, EventMotion};
use super::jump::Jump;
use crate::differences::derivative_by_time;
use crate::length::RunTimeLength;
use crate::sensitivity::slopes::Change;
use crate::simulation::events::value::{DISTANCE_IN_TIME, Value};
use tfe_runtime::family::{self, Allowed, OperatorError};
use tfe_runtime::transition::TransitionError;
use tfe_runtime::{Partials, StepError};

/// The derivatives of a number by what an action is given.
pub(in crate::simulation) struct Given {
    /// By the state, in the order (p, q).
    pub(in crate::simulation) by_state: Vec<f64>,
    pub(in crate::simulation) by_time: f64,
    pub(in crate::simulation) by_parameters: Vec<f64>,
}

/// A motion of an event, with a longer step of differences.
type Longer = (EventMotion<0, RunTimeLength>, f64);

impl Jump<'_, '_, 0, RunTimeLength> {
    /// λ S_y, λ S_t and λ S_a of the row λ = `lambda`, the derivatives by the state after the action in the order
    /// (p, q).
    ///
    /// With constraints S is a function of states that satisfy them. Its derivatives are taken along changes that they
    /// allow, and the result is that of a function of all states which has these derivatives.
    ///
    /// # Errors
    /// [`StepError::NonFinite`] if the action has no state nearby.
    pub(in crate::simulation) fn given<M: family::Model>(
        &self,
        model: &M,
        lambda: &[f64],
    ) -> Result<Given, TransitionError> {
        let parameters: Vec<usize> = (0..model.parameters()).collect();
        if lambda.iter().all(|weight| *weight == 0.0) {
            return Ok(Given {
                by_state: vec![0.0; lambda.len()],
                by_time: 0.0,
                by_parameters: vec![0.0; parameters.len()],
            });
        }
        let allowed = self.allowed(model, &parameters)?;
        let allowed = allowed.as_ref();
        let of = |numbers: &[f64]| product(lambda, numbers);
        let along = |(way, longer): Longer| self.derivative(&way, longer, &of);
        let components = (0..lambda.len()).map(|row| along(self.component(row, allowed)));
        let by_state = components.collect::<Result<Vec<_>, _>>()?;
        let by_parameters = parameters.iter().map(|index| match allowed {
            None => along(self.by_parameter(*index)),
            Some(allowed) => {
                let change = &allowed.by_parameters()[*index];
                let both = along(self.with_parameter(*index, change))?;
                Ok(both - product(&by_state, change))
            }
        });
        let by_parameters = by_parameters.collect::<Result<Vec<_>, TransitionError>>()?;
        let by_time = match allowed {
            None => self.by_time(&of)?,
            Some(_) => {
                let way = self.towards(self.rate.clone(), 1.0);
                let longer = way.distance;
                let rate = [&self.rate.p[..], &self.rate.q].concat();
                along((way, longer))? - product(&by_state, &rate)
            }
        };
        Ok(Given {
            by_state,
            by_time,
            by_parameters,
        })
    }

    /// The changes that the constraints allow at the event; `None` without constraints.
    fn allowed<M: family::Model>(
        &self,
        model: &M,
        parameters: &[usize],
    ) -> Result<Option<Allowed>, TransitionError> {
        if !M::CONSTRAINED {
            return Ok(None);
        }
        let event = self.severed.event;
        let allowed = Allowed::of(model, event.t, &event.state(), parameters);
        let allowed = allowed.map_err(|error| match error {
            OperatorError::Step(error) => error,
            _ => StepError::NonFinite,
        })?;
        Ok(Some(allowed))
    }

    /// The derivative by the time at a fixed state, of a number that depends on the state after the action.
    fn by_time(&self, of: &dyn Fn(&[f64]) -> f64) -> Result<f64, TransitionError> {
        let time = self.severed.event.t;
        let later = EventMotion {
            time: 1.0,
            ..self.still()
        };
        let slope = derivative_by_time(DISTANCE_IN_TIME, time, &mut |t| {
            let numbers = self.moved(&later, t - time);
            numbers.map_or(f64::NAN, |numbers| of(&numbers))
        });
        match slope.is_finite() {
            true => Ok(slope),
            false => Err(StepError::NonFinite.into()),
        }
    }

    /// A change of one component of the state, in the order (p, q), as far as constraints allow it.
    fn component(&self, row: usize, allowed: Option<&Allowed>) -> Longer {
        let event = self.severed.event;
        let n = event.q.len();
        let (value, rate) = match row.checked_sub(n) {
            None => (event.p[row], self.rate.p[row]),
            Some(a) => (event.q[a], self.rate.q[a]),
        };
        let mut change = vec![0.0; 2 * n];
        change[row] = 1.0;
        if let Some(allowed) = allowed {
            allowed.apply(&mut change);
        }
        let way = self.towards(of_state(&change), 0.0);
        // A component may be much smaller than the others of its kind.
        let own = value.abs().max((self.severed.step * rate).abs());
        let longer = way.distance;
        let distance = longer.min(DISTANCE * own);
        (EventMotion { distance, ..way }, longer)
    }

    /// The effect of a parameter together with that of a change of the state, with which the constraints stay
    /// satisfied.
    fn with_parameter(&self, index: usize, change: &[f64]) -> Longer {
        let (own, longer) = self.by_parameter(index);
        if change.iter().all(|one| *one == 0.0) {
            return (own, longer);
        }
        let way = self.towards(of_state(change), 0.0);
        let distance = way.distance.min(own.distance);
        let change = way.change;
        let both = EventMotion {
            change,
            distance,
            ..own
        };
        (both, distance)
    }

    /// The derivatives of κ t*, with the time t* of the event and κ = `by_time`, by coordinates, velocities and outputs
    /// at the event; `None` if the time is that of the start of the element.
    ///
    /// # Errors
    /// [`StepError::NonFinite`] if g only touches zero.
    pub(in crate::simulation) fn of_time(
        &self,
        by_time: f64,
    ) -> Result<Option<Partials>, TransitionError> {
        let Some(slope) = self.slope else {
            return Ok(None);
        };
        let factor = -by_time / slope;
        if !factor.is_finite() {
            return Err(StepError::NonFinite.into());
        }
        let (event, value) = (self.severed.event, &self.severed.watched.value);
        let n = event.q.len();
        let mut partials = Partials::none(n, self.model.output_count());
        if let Value::Column(column) = value {
            partials.outputs[*column] = factor;
            return Ok(Some(partials));
        }
        let still = vec![0.0; n];
        for a in 0..n {
            let mut unit = still.clone();
            unit[a] = 1.0;
            let of_velocity = Change::by(None, &event.q);
            partials.v[a] = factor * value.slope(self.model, event, &of_velocity, &unit);
            let of_place = Change {
                q: unit,
                ..Change::by(None, &event.q)
            };
            partials.q[a] = factor * value.slope(self.model, event, &of_place, &still);
        }
        Ok(Some(partials))
    }
}

/// A change of the state alone, given in the order (p, q).
fn of_state(change: &[f64]) -> Change<0, RunTimeLength> {
    let (p, q) = change.split_at(change.len() / 2);
    Change {
        t: 0.0,
        q: q.to_vec(),
        p: p.to_vec(),
        parameter: None,
    }
}

fn product(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
