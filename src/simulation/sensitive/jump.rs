//! The jump of derivatives at an event (T-124).

use crate::length::Length;
use crate::motion::Node;
use crate::sensitivity::slopes::Change;
use crate::sensitivity::varied::{Varied, Velocity};
use crate::simulation::events::Severed;
use crate::simulation::events::model::EventModel;
use nalgebra::DMatrix;
use tfe_runtime::StepError;
use tfe_runtime::transition::TransitionError;

/// A model whose runs have derivatives, without its type; implemented for every such model.
pub(in crate::simulation) trait VariedModel<const N: usize, L: Length<N>>:
    EventModel<N, L> + Varied<N, L>
{
}

impl<M, const N: usize, L> VariedModel<N, L> for M
where
    M: EventModel<N, L> + Varied<N, L>,
    L: Length<N>,
{
}

/// The derivative of the state after an event by the state before it at a fixed time, and by parameters.
///
/// ```text
/// δt* = −(g_y δy + g_a δa) / ġ ,     δy* = δy + ẏ δt* ,     δy₊ = S_y δy* + S_t δt* + S_a δa            (T-124)
/// ```
pub(in crate::simulation) struct Jump<'a, 'm, const N: usize, L: Length<N>> {
    pub(super) model: &'a dyn EventModel<N, L>,
    pub(super) severed: &'a Severed<'a, 'm, N, L>,
    /// The change of the velocity for a change at the event.
    pub(super) velocity: Velocity<'a, N, L>,
    /// The motion at the event, (1, ẏ).
    pub(super) rate: Change<N, L>,
    /// ġ; `None` if g has jumped over zero at the start of an element, by an impulse or an action: the time of the
    /// event is then that of the start.
    pub(super) slope: Option<f64>,
}

impl<'a, 'm, const N: usize, L: Length<N>> Jump<'a, 'm, N, L> {
    /// The jump at an event with its node before the action, where ẏ is the only column of `rate`.
    pub(in crate::simulation) fn at(
        model: &'a dyn VariedModel<N, L>,
        severed: &'a Severed<'a, 'm, N, L>,
        node: &'a Node<N, L>,
        rate: &DMatrix<f64>,
    ) -> Self {
        /// The least distance of g from zero after a jump, relative to its change in a step.
        const JUMPED: f64 = 1e-6;

        let rate = Change {
            t: 1.0,
            ..Change::<N, L>::of_column(&node.q, rate, 0)
        };
        let mut jump = Self {
            model,
            severed,
            velocity: model.velocity_along(node),
            rate,
            slope: None,
        };
        let slope = jump.along(&jump.rate);
        let left = severed.watched.value.at(model, severed.event);
        let has_jumped = !severed.inside && left.abs() > JUMPED * (severed.step * slope).abs();
        jump.slope = (!has_jumped).then_some(slope);
        jump
    }

    /// The derivative of g along a change.
    fn along(&self, change: &Change<N, L>) -> f64 {
        let velocity = (self.velocity)(change);
        let value = &self.severed.watched.value;
        value.slope(self.model, self.severed.event, change, &velocity)
    }

    /// The derivatives of the time of the event, from those of the state at a fixed time; `start` has those of the time
    /// of the start of the element, and `parameter` tells the index of the parameter of a column.
    ///
    /// # Errors
    /// [`StepError::NonFinite`] if g only touches zero.
    pub(super) fn times(
        &self,
        at: &DMatrix<f64>,
        start: Option<&[f64]>,
        parameter: &dyn Fn(usize) -> Option<usize>,
    ) -> Result<Vec<f64>, TransitionError> {
        let columns = at.ncols();
        let Some(slope) = self.slope else {
            return Ok(start.map_or_else(|| vec![0.0; columns], <[f64]>::to_vec));
        };
        let time = |column| {
            let change = Change {
                parameter: parameter(column),
                ..Change::<N, L>::of_column(&self.severed.event.q, at, column)
            };
            -self.along(&change) / slope
        };
        let times: Vec<f64> = (0..columns).map(time).collect();
        match times.iter().all(|dt| dt.is_finite()) {
            true => Ok(times),
            false => Err(StepError::NonFinite.into()),
        }
    }
}
