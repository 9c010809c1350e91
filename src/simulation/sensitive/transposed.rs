//! The transposed jump at an event, for gradients that go backwards (T-127).

use super::acts::{DISTANCE, Way};
use super::jump::Jump;
use crate::differences::derivative_by_time;
use crate::length::Length;
use crate::sensitivity::slopes::Change;
use crate::simulation::events::value::{DISTANCE_IN_TIME, Value};
use crate::simulation::kind::Simulated;
use tfe_runtime::transition::TransitionError;
use tfe_runtime::{Partials, StepError};

/// The derivatives of a number by what an action is given.
pub(in crate::simulation) struct Given {
    /// By the state, in the order (p, q).
    pub(in crate::simulation) by_state: Vec<f64>,
    pub(in crate::simulation) by_time: f64,
    pub(in crate::simulation) by_parameters: Vec<f64>,
}

impl<M, const N: usize, L> Jump<'_, '_, M, N, L>
where
    M: Simulated<N, L>,
    L: Length<N>,
{
    /// λ S_y, λ S_t and λ S_a of the row λ = `lambda`, the derivatives by the state after the action in the order (p, q).
    ///
    /// # Errors
    /// [`StepError::NonFinite`] if the action has no state nearby.
    pub(in crate::simulation) fn given(&self, lambda: &[f64]) -> Result<Given, TransitionError> {
        let product = |numbers: &[f64]| -> f64 {
            let terms = numbers.iter().zip(lambda);
            terms.map(|(number, weight)| number * weight).sum()
        };
        let parameters = self.model.parameter_names().len();
        if lambda.iter().all(|weight| *weight == 0.0) {
            return Ok(Given {
                by_state: vec![0.0; lambda.len()],
                by_time: 0.0,
                by_parameters: vec![0.0; parameters],
            });
        }
        let along = |(way, longer): (Way<N, L>, f64)| self.derivative(&way, longer, product);
        let components = (0..lambda.len()).map(|row| along(self.component(row)));
        let by_parameters = (0..parameters).map(|index| along(self.by_parameter(index)));
        let time = self.severed.event.t;
        let later = Way {
            time: 1.0,
            ..self.still()
        };
        let by_time = derivative_by_time(DISTANCE_IN_TIME, time, &mut |t| {
            let numbers = self.moved(&later, t - time);
            numbers.map_or(f64::NAN, |numbers| product(&numbers))
        });
        if !by_time.is_finite() {
            return Err(StepError::NonFinite.into());
        }
        Ok(Given {
            by_state: components.collect::<Result<_, _>>()?,
            by_time,
            by_parameters: by_parameters.collect::<Result<_, _>>()?,
        })
    }

    /// A change of one component of the state, in the order (p, q), with a longer step of differences.
    fn component(&self, row: usize) -> (Way<N, L>, f64) {
        let event = self.severed.event;
        let (none, (of_q, of_p)) = (L::zero(&event.q), self.scales());
        let one = |at: usize| L::from_fn(&event.q, |a| if a == at { 1.0 } else { 0.0 });
        let at = |values: &L::Vector, a: usize| values.as_ref()[a];
        let (change, value, rate, scale) = match row.checked_sub(none.as_ref().len()) {
            None => (
                (none, one(row)),
                at(&event.p, row),
                at(&self.rate.p, row),
                of_p,
            ),
            Some(a) => ((one(a), none), at(&event.q, a), at(&self.rate.q, a), of_q),
        };
        let own = value.abs().max((self.severed.step * rate).abs());
        let (q, p) = change;
        let way = Way {
            change: Change {
                q,
                p,
                t: 0.0,
                parameter: None,
            },
            distance: DISTANCE * own,
            ..self.still()
        };
        (way, DISTANCE * scale)
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
        let (like, still) = (&event.q, L::zero(&event.q));
        let n = like.as_ref().len();
        let mut partials = Partials::none(n, self.model.output_count());
        if let Value::Column(column) = value {
            partials.outputs[*column] = factor;
            return Ok(Some(partials));
        }
        for a in 0..n {
            let unit = L::from_fn(like, |b| if a == b { 1.0 } else { 0.0 });
            let of_velocity = Change::by(None, like);
            partials.v[a] = factor * value.slope(self.model, event, &of_velocity, &unit);
            let of_place = Change {
                q: unit,
                ..Change::by(None, like)
            };
            partials.q[a] = factor * value.slope(self.model, event, &of_place, &still);
        }
        Ok(Some(partials))
    }
}
