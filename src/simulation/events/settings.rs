//! Values of parameters that events set.

use super::model::EventModel;
use super::searched::Searched;
use crate::error::RunErrorKind;
use crate::length::{FixedLength, Length};
use crate::motion::Event;
use tfe_runtime::CoordinateName;

/// New values of parameters, for [`Act::Set`](crate::Act::Set). They hold until they are set again or the run ends;
/// the caller's model does not change.
///
/// The coordinates and momenta stay as they are at the event, unless a [state](Self::and_state) or a
/// [velocity](Self::and_velocity) is given. If a mass changes, the same momentum means another velocity.
///
/// The new values may depend on the state at the event. [Transition matrices](crate::Simulation::run_linearised) do
/// not include that dependence and fail with [`RunErrorKind::SetByState`](crate::RunErrorKind::SetByState).
///
/// ```
/// use tfe::Settings;
/// use tfe::prelude::*;
///
/// /// A mass between two springs: a soft one to the left, a stiff one to the right.
/// #[dynamics(coordinates(x), lagrangian = dot(x)^2/2 - k/2*x^2, event(middle) = x, output(stiffness) = k)]
/// struct Springs { k: f64 }
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let springs = Springs { k: 4.0 };
/// let motion = Simulation::new(&springs)
///     .element(Mixed::<8>)
///     .step(0.1)
///     .on("middle", Crossing::Either, |event| {
///         Act::Set(Settings::new("k", if event.rises { 4.0 } else { 1.0 }))
///     })
///     .run(springs.state([1.0], [0.0]), 0.0..20.0)?;
/// // Half a period with either stiffness: (π + π/2) together.
/// let period = 1.5 * std::f64::consts::PI;
/// assert!((motion.at(3.0 * period)?.q[0] - 1.0).abs() < 1e-9);
/// assert_eq!(motion.settings()[0].value, 1.0);
/// assert!(motion.energy_error() < 1e-12); // from each event to the next
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Settings<const N: usize, L: Length<N> = FixedLength> {
    values: Vec<(String, f64)>,
    from: From<N, L>,
}

/// The state from which the run continues.
#[derive(Clone, Debug, PartialEq)]
enum From<const N: usize, L: Length<N>> {
    Here,
    State(L::State),
    Velocity(L::Vector),
}

impl<const N: usize, L: Length<N>> Settings<N, L> {
    /// Sets one parameter: `k`, or `m[2]` for an element of an array, in the units of the model.
    pub fn new(parameter: impl Into<String>, value: f64) -> Self {
        Self {
            values: vec![(parameter.into(), value)],
            from: From::Here,
        }
    }

    /// Sets one more parameter.
    #[must_use]
    pub fn and(mut self, parameter: impl Into<String>, value: f64) -> Self {
        self.values.push((parameter.into(), value));
        self
    }

    /// Continues from this state.
    #[must_use]
    pub fn and_state(mut self, state: L::State) -> Self {
        self.from = From::State(state);
        self
    }

    /// Continues with these velocities; the momenta are computed from them with the new parameters.
    #[must_use]
    pub fn and_velocity(mut self, v: L::Vector) -> Self {
        self.from = From::Velocity(v);
        self
    }

    /// The parameters and their values.
    pub(in crate::simulation) fn values(&self) -> &[(String, f64)] {
        &self.values
    }

    /// Makes the model of a run with these values; returns them with the indices of their parameters.
    pub(super) fn applied(
        &self,
        run: &mut dyn Searched<N, L>,
    ) -> Result<Vec<(usize, f64)>, RunErrorKind> {
        let values = self.numbered(&run.model().parameter_names())?;
        match run.remodel(&values) {
            true => Ok(values),
            false => Err(RunErrorKind::ParametersFixed),
        }
    }

    /// The values with the indices of their parameters.
    fn numbered(&self, names: &[CoordinateName]) -> Result<Vec<(usize, f64)>, RunErrorKind> {
        let number = |(name, value): &(String, f64)| {
            let index = names.iter().position(|own| own.is(name));
            let index = index.ok_or_else(|| RunErrorKind::NoParameter {
                name: name.clone(),
                known: names.iter().map(ToString::to_string).collect(),
            })?;
            if value.is_finite() {
                Ok((index, *value))
            } else {
                Err(RunErrorKind::Parameter {
                    name: name.clone(),
                    value: *value,
                })
            }
        };
        self.values.iter().map(number).collect()
    }

    /// The state from which the run continues, for the model with the new values.
    pub(super) fn state(&self, model: &dyn EventModel<N, L>, event: &Event<N, L>) -> L::State {
        match &self.from {
            From::Here => event.state(),
            From::State(state) => state.clone(),
            From::Velocity(v) => L::state(event.q.clone(), model.momenta(event.t, &event.q, v)),
        }
    }

    /// The same for a model that still has the old values.
    pub(super) fn state_nearby(
        &self,
        model: &dyn EventModel<N, L>,
        event: &Event<N, L>,
    ) -> Option<L::State> {
        if let From::Velocity(_) = self.from {
            let values = self.numbered(&model.parameter_names()).ok()?;
            let made = model.with_values(&values)?;
            return Some(self.state(&*made, event));
        }
        Some(self.state(model, event))
    }
}
