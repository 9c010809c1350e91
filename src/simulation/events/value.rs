//! The function whose zeros are the events.

use super::model::EventModel;
use crate::differences::{derivative_by_time, derivative_of_either, resolved};
use crate::length::Length;
use crate::motion::Event;
use crate::numbers::largest;
use crate::sensitivity::slopes::Change;
use std::sync::Arc;
use tfe_runtime::dual::Dual;

/// A function of time, coordinates and velocities.
pub(super) type Function<'m, V> = Arc<dyn Fn(f64, &V, &V) -> f64 + Send + Sync + 'm>;

/// An output of the model, or a function given by the user.
#[derive(Clone)]
pub(in crate::simulation) enum Value<'m, V> {
    /// The index of the output.
    Column(usize),
    Function(Function<'m, V>),
}

/// The relative step of difference quotients. Their truncation error is below the rounding error, which is about 1e-13.
const DISTANCE: f64 = 2e-3;

/// The same in time; not a simple fraction of common periods.
pub(in crate::simulation) const DISTANCE_IN_TIME: f64 = 1.570_796e-3;

impl<V: AsRef<[f64]> + Clone> Value<'_, V> {
    /// The gradients g_q and g_t; `None` if g depends on velocities.
    pub(super) fn normal<L: Length<N, Vector = V>, const N: usize>(
        &self,
        model: &dyn EventModel<N, L>,
        event: &Event<N, L>,
    ) -> Option<(V, f64)> {
        let Event { t, q, v, .. } = event;
        match self {
            Self::Column(column) => {
                let unit = |a: usize| L::from_fn(q, |b| if a == b { 1.0 } else { 0.0 });
                let (still, coordinates) = (L::zero(q), q.as_ref().len());
                let z = if model.needs_velocity() { v } else { &event.p };
                let mut values = vec![Dual::ZERO; model.output_count()];
                let mut slope = |dt: f64, dq: &V, dz: &V| {
                    model.outputs_towards(Dual::new(*t, dt), (q, dq), (z, dz), &mut values);
                    values[*column].slope
                };
                let of_velocity = (0..coordinates).any(|a| slope(0.0, &still, &unit(a)) != 0.0);
                let normal = L::from_fn(q, |a| slope(0.0, &unit(a), &still));
                (!of_velocity).then(|| (normal, slope(1.0, &still, &still)))
            }
            Self::Function(function) => normal_of::<L, N>(function, *t, (q, v)),
        }
    }
}

/// The same for a function given by the user, by difference quotients.
fn normal_of<L: Length<N>, const N: usize>(
    function: &Function<'_, L::Vector>,
    t: f64,
    (q, v): (&L::Vector, &L::Vector),
) -> Option<(L::Vector, f64)> {
    let size = |one: f64| if one > 0.0 { one } else { 1.0 };
    let moved = |from: &L::Vector, a: usize, s: f64| {
        let part = |b: usize| from.as_ref()[b] + if a == b { s } else { 0.0 };
        L::from_fn(from, part)
    };
    let sizes = [1.0, 0.0].map(|least| largest(q.as_ref()).max(least));
    let at_q = sizes.map(|size| DISTANCE * size);
    let at_v = DISTANCE * size(largest(v.as_ref()));
    let here = function(t, q, v);
    let of_velocity = (0..q.as_ref().len()).any(|a| function(t, q, &moved(v, a, at_v)) != here);
    let slope = |a| derivative_of_either(at_q, |s| function(t, &moved(q, a, s), v));
    let normal = L::from_fn(q, slope);
    let drift = derivative_by_time(DISTANCE_IN_TIME, t, &mut |t| function(t, q, v));
    (!of_velocity).then_some((normal, drift))
}

impl<V: AsRef<[f64]> + Clone> Value<'_, V> {
    /// The value of g at an event.
    pub(in crate::simulation) fn at<L: Length<N, Vector = V>, const N: usize>(
        &self,
        model: &dyn EventModel<N, L>,
        event: &Event<N, L>,
    ) -> f64 {
        let Event { t, q, p, v, .. } = event;
        match self {
            Self::Column(column) => {
                let mut values = vec![0.0; model.output_count()];
                model.outputs(*t, (q, p), v, &mut values);
                values[*column]
            }
            Self::Function(function) => function(*t, q, v),
        }
    }

    /// The derivative of g along a change, whose change of the velocity is `velocity`.
    pub(in crate::simulation) fn slope<L: Length<N, Vector = V>, const N: usize>(
        &self,
        model: &dyn EventModel<N, L>,
        event: &Event<N, L>,
        change: &Change<N, L>,
        velocity: &V,
    ) -> f64 {
        match self {
            Self::Column(column) => {
                let Event { t, q, p, v, .. } = event;
                output_slopes(model, (*t, q, p, v), change, velocity)[*column]
            }
            Self::Function(function) => {
                let Event { t, q, v, .. } = event;
                // An event is at a zero, possibly of the only coordinate: a scale taken from the rounding errors around
                // it would be meaningless.
                let part = |change: &V, of: &V, least: f64| {
                    let size = largest(of.as_ref()).max(least);
                    largest(change.as_ref()) / if size > 0.0 { size } else { 1.0 }
                };
                let size = |least: f64| {
                    let of_state = part(&change.q, q, least).max(part(velocity, v, least));
                    of_state.max(change.t.abs())
                };
                if size(0.0) == 0.0 {
                    return 0.0;
                }
                let distances = [1.0, 0.0].map(|least| {
                    let distance = DISTANCE / size(least);
                    let rate = change.t.abs();
                    match rate == 0.0 {
                        true => distance,
                        false => resolved(distance * rate, *t) / rate,
                    }
                });
                let moved = |from: &V, by: &V, s: f64| {
                    let by = by.as_ref();
                    L::from_fn(from, |a| from.as_ref()[a] + s * by[a])
                };
                derivative_of_either(distances, |s| {
                    function(
                        t + s * change.t,
                        &moved(q, &change.q, s),
                        &moved(v, velocity, s),
                    )
                })
            }
        }
    }
}

/// The changes of all outputs at a point of a motion, given the change of the velocity.
pub(in crate::simulation) fn output_slopes<L: Length<N>, const N: usize>(
    model: &dyn EventModel<N, L>,
    (t, q, p, v): (f64, &L::Vector, &L::Vector, &L::Vector),
    change: &Change<N, L>,
    velocity: &L::Vector,
) -> Vec<f64> {
    let time = Dual::new(t, change.t).by_parameter(change.parameter);
    let z = match model.needs_velocity() {
        true => (v, velocity),
        false => (p, &change.p),
    };
    let mut values = vec![Dual::ZERO; model.output_count()];
    model.outputs_towards(time, (q, &change.q), z, &mut values);
    values.iter().map(|value| value.slope).collect()
}
