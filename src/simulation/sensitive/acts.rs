//! Derivatives of the actions of events, by difference quotients (T-124).

use super::jump::Jump;
use crate::differences::{SIXTH, derivative, derivative_of_either};
use crate::error::RunErrorKind;
use crate::length::Length;
use crate::numbers::{larger, largest};
use crate::sensitivity::slopes::Change;
use crate::simulation::events::Watched;
use crate::simulation::events::act::{Act, Near, Occurrence, On, state_after};
use nalgebra::DMatrix;
use std::sync::{Arc, Mutex, PoisonError};
use tfe_runtime::StepError;
use tfe_runtime::transition::TransitionError;

/// The relative step of difference quotients. Their truncation error is below the rounding error, which is about 1e-13.
pub(super) const DISTANCE: f64 = 2e-3;

/// An event with the derivatives of its state and of its time before the action.
pub(super) struct Acting<'a, 'm, const N: usize, L: Length<N>> {
    pub(super) jump: &'a Jump<'a, 'm, N, L>,
    /// The derivatives of the state at the event, a column for each component of the start and each parameter.
    pub(super) at: &'a DMatrix<f64>,
    /// The derivatives of its time.
    pub(super) times: &'a [f64],
}

/// How an event moves with a quantity, such as that of one column.
pub(super) struct EventMotion<const N: usize, L: Length<N>> {
    pub(super) change: Change<N, L>,
    pub(super) time: f64,
    /// The index of the parameter, if the quantity is one.
    pub(super) parameter: Option<usize>,
    /// The change of the velocity due to the parameter.
    pub(super) velocity: L::Vector,
    /// The step of difference quotients.
    pub(super) distance: f64,
    /// A longer step, which is tried first for a parameter alone: an action may add numbers of the size of 1 to it.
    pub(super) longer: Option<f64>,
}

/// A positive scale for changes.
fn scale(size: f64) -> f64 {
    if size > 0.0 { size } else { 1.0 }
}

impl<const N: usize, L: Length<N>> Jump<'_, '_, N, L> {
    /// No motion.
    pub(super) fn still(&self) -> EventMotion<N, L> {
        let event = self.severed.event;
        EventMotion {
            change: Change::by(None, &event.q),
            time: 0.0,
            parameter: None,
            velocity: L::zero(&event.v),
            distance: DISTANCE,
            longer: None,
        }
    }

    /// The size of a change relative to the state at the event.
    fn size(&self, change: &Change<N, L>) -> f64 {
        let (q, p) = self.scales();
        larger(
            largest(change.q.as_ref()) / q,
            largest(change.p.as_ref()) / p,
        )
    }

    /// A motion along a change and in time.
    pub(super) fn towards(&self, change: Change<N, L>, time: f64) -> EventMotion<N, L> {
        EventMotion {
            distance: DISTANCE / scale(self.size(&change)),
            change,
            time,
            ..self.still()
        }
    }

    /// The effect of a parameter alone, with a longer step of differences.
    pub(super) fn by_parameter(&self, index: usize) -> (EventMotion<N, L>, f64) {
        let size = scale(self.model.parameter_value(index).abs());
        let change = Change::by(Some(index), &self.severed.event.q);
        let motion = EventMotion {
            parameter: Some(index),
            velocity: (self.velocity)(&change),
            distance: DISTANCE * size,
            ..self.still()
        };
        (motion, DISTANCE * size.max(1.0))
    }

    /// The scales of coordinates and of momenta. At an event something vanishes, possibly the only coordinate; the
    /// change over a step is then the better scale.
    fn scales(&self) -> (f64, f64) {
        let (event, step) = (self.severed.event, self.severed.step.abs());
        let of = |values: &L::Vector, rate: &L::Vector| {
            let values = largest(values.as_ref());
            scale(larger(values, step * largest(rate.as_ref())))
        };
        (of(&event.q, &self.rate.q), of(&event.p, &self.rate.p))
    }

    /// The state after the action for an event that has moved by `s`, in the order (p, q).
    pub(super) fn moved(
        &self,
        motion: &EventMotion<N, L>,
        s: f64,
    ) -> Result<Vec<f64>, TransitionError> {
        let by = (&self.severed.watched.on, &self.severed.watched.value);
        let found = state_after(self.model, by, self.severed.event, &self.near(motion, s));
        let found = found.filter(|found| self.model.check_start(found).is_ok());
        let found = found.ok_or(TransitionError::from(StepError::NonFinite))?;
        let (q, p) = L::parts(&found);
        Ok([p.as_ref(), q.as_ref()].concat())
    }

    /// The derivative, along one quantity, of a number that depends on the state after the action, which is given in
    /// the order (p, q).
    pub(super) fn derivative(
        &self,
        motion: &EventMotion<N, L>,
        longer: f64,
        of: &dyn Fn(&[f64]) -> f64,
    ) -> Result<f64, TransitionError> {
        let slope = derivative_of_either([longer, motion.distance], |s| {
            let numbers = self.moved(motion, s);
            numbers.map_or(f64::NAN, |numbers| of(&numbers))
        });
        match slope.is_finite() {
            true => Ok(slope),
            false => Err(StepError::NonFinite.into()),
        }
    }

    /// The event moved by `s`.
    fn near(&self, motion: &EventMotion<N, L>, s: f64) -> Near<N, L> {
        let event = self.severed.event;
        let moved = |from: &L::Vector, by: &L::Vector| {
            let by = by.as_ref();
            L::from_fn(from, |a| from.as_ref()[a] + s * by[a])
        };
        Near {
            t: event.t + s * motion.time,
            state: L::state(
                moved(&event.q, &motion.change.q),
                moved(&event.p, &motion.change.p),
            ),
            velocity: L::from_fn(&event.v, |a| s * motion.velocity.as_ref()[a]),
            parameter: motion.parameter.map(|index| (index, s)),
        }
    }
}

impl<const N: usize, L: Length<N>> Acting<'_, '_, N, L> {
    /// The derivatives after the action; `parameter` returns the parameter of a column.
    pub(super) fn after(
        &self,
        parameter: &dyn Fn(usize) -> Option<usize>,
    ) -> Result<DMatrix<f64>, TransitionError> {
        let jump = self.jump;
        let mut after = self.at.clone();
        for (column, mut after) in after.column_iter_mut().enumerate() {
            after.fill(0.0);
            for motion in self.motions(column, parameter(column)) {
                if let Some(longer) = motion.longer {
                    for (row, after) in after.iter_mut().enumerate() {
                        *after += jump.derivative(&motion, longer, &|numbers| numbers[row])?;
                    }
                    continue;
                }
                for (k, weight) in (1..).zip(SIXTH) {
                    let s = f64::from(k) * motion.distance;
                    let (high, low) = (jump.moved(&motion, s)?, jump.moved(&motion, -s)?);
                    let pairs = high.iter().zip(&low);
                    for (after, (high, low)) in after.iter_mut().zip(pairs) {
                        *after += weight * (high - low) / motion.distance;
                    }
                }
            }
        }
        Ok(after)
    }

    /// The error of an action that sets a parameter to a value which depends on the state: the later motion also
    /// depends on this value, which transition matrices between states do not contain.
    pub(super) fn dependent(&self) -> Option<RunErrorKind> {
        /// The largest relative change of a value that is attributed to rounding, for a relative change 1 of the state.
        const ROUNDINGS: f64 = 1e-10;

        let Watched { on, value } = self.jump.severed.watched;
        // Records the values that the action sets at each call.
        let seen = Arc::new(Mutex::new(None));
        let (act, sets) = (Arc::clone(&on.act), Arc::clone(&seen));
        let watched = move |event: &Occurrence<'_, N, L>| {
            let act = act(event);
            if let Act::Set(settings) = &act {
                let mut sets = sets.lock().unwrap_or_else(PoisonError::into_inner);
                *sets = Some(settings.values().to_vec());
            }
            act
        };
        let on = On {
            act: Arc::new(watched),
            ..on.clone()
        };
        let set = |motion: &EventMotion<N, L>, s: f64| {
            let near = self.jump.near(motion, s);
            let _ = state_after(
                self.jump.model,
                (&on, value),
                self.jump.severed.event,
                &near,
            );
            seen.lock().unwrap_or_else(PoisonError::into_inner).take()
        };
        let names = self.jump.model.parameter_names();
        for motion in (0..self.times.len()).filter_map(|column| self.motion(column)) {
            for (place, (name, value)) in set(&motion, 0.0)?.into_iter().enumerate() {
                // NaN if the action sets something else nearby.
                let nearby = |s: f64| {
                    let settings = set(&motion, s).unwrap_or_default();
                    let own = settings.get(place).filter(|(other, _)| *other == name);
                    own.map_or(f64::NAN, |(_, value)| *value)
                };
                let change = derivative(motion.distance, nearby) * motion.distance / DISTANCE;
                let known = names.iter().position(|own| own.is(&name));
                let before = known.map_or(0.0, |index| self.jump.model.parameter_value(index));
                let size = larger(value.abs(), before.abs());
                if !(change.abs() <= ROUNDINGS * size) {
                    return Some(RunErrorKind::SetByState {
                        event: self.jump.severed.event.name.clone(),
                        time: self.jump.severed.event.t,
                        parameter: name,
                    });
                }
            }
        }
        None
    }

    /// How the event moves with a column. Motion and parameter are moved together if one step suits both, so that
    /// constraints that contain the parameter stay satisfied; otherwise one after the other.
    fn motions(&self, column: usize, parameter: Option<usize>) -> Vec<EventMotion<N, L>> {
        /// The largest ratio of the two steps. A step shorter than necessary by this factor loses two digits; in a step
        /// suited to a tiny parameter, the state would change by rounding only.
        const TOGETHER: f64 = 100.0;

        let motion = self.motion(column);
        let Some(index) = parameter else {
            return motion.into_iter().collect();
        };
        let (own, longer) = self.jump.by_parameter(index);
        match motion {
            None => vec![own],
            Some(motion) if motion.distance > TOGETHER * own.distance => {
                let longer = Some(longer);
                vec![motion, EventMotion { longer, ..own }]
            }
            Some(motion) => vec![EventMotion {
                change: motion.change,
                time: motion.time,
                distance: motion.distance.min(own.distance),
                ..own
            }],
        }
    }

    /// How the event moves with a column at fixed parameters; `None` if it does not.
    fn motion(&self, column: usize) -> Option<EventMotion<N, L>> {
        let change = Change::<N, L>::of_column(&self.jump.severed.event.q, self.at, column);
        let time = self.times[column];
        let is_moved = self.jump.size(&change) != 0.0 || time != 0.0;
        is_moved.then(|| self.jump.towards(change, time))
    }
}
