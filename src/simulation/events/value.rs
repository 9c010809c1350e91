//! What changes its sign at an event.

use crate::motion::Event;
use crate::sensitivity::slopes::{Along, Change};
use std::sync::Arc;
use tfe_runtime::dual::{Dual, duals};
use tfe_runtime::{Form, Model};

/// A function of time, coordinates and velocities.
pub(super) type Function<'m, const N: usize> =
    Arc<dyn Fn(f64, &[f64; N], &[f64; N]) -> f64 + Send + Sync + 'm>;

/// An output of the model, or a function.
#[derive(Clone)]
pub(in crate::simulation) enum Value<'m, const N: usize> {
    /// The output's place among all.
    Column(usize),
    Function(Function<'m, N>),
}

/// Weights of the differences over 1, 2 and 3 distances on both sides: a derivative of sixth order.
pub(in crate::simulation) const WEIGHTS: [f64; 3] = [45.0 / 60.0, -9.0 / 60.0, 1.0 / 60.0];

/// A derivative at zero by differences over a distance.
fn derivative(distance: f64, f: impl Fn(f64) -> f64) -> f64 {
    let differences = (1..).zip(WEIGHTS).map(|(k, weight)| {
        let s = f64::from(k) * distance;
        weight * (f(s) - f(-s))
    });
    differences.sum::<f64>() / distance
}

fn largest<const N: usize>(values: &[f64; N]) -> f64 {
    values.iter().fold(0.0, |m: f64, x| m.max(x.abs()))
}

/// A distance for differences, relative to what is changed: their error is below roundings, and these are some 1e-13.
const DISTANCE: f64 = 2e-3;

impl<const N: usize> Value<'_, N> {
    /// The gradient g_q, and g_t; none where g depends on velocities.
    pub(super) fn normal<M: Model<N>>(
        &self,
        model: &M,
        event: &Event<N>,
    ) -> Option<([f64; N], f64)> {
        let unit = |a: usize| std::array::from_fn(|b| if a == b { 1.0 } else { 0.0 });
        let still = [0.0; N];
        match self {
            Self::Column(column) => {
                let z = match M::FORM {
                    Form::Lagrangian => &event.v,
                    Form::Hamiltonian => &event.p,
                };
                let mut values = vec![Dual::ZERO; model.columns()];
                let mut slope = |dt: f64, dq: &[f64; N], dz: &[f64; N]| {
                    let time = Dual::new(event.t, dt);
                    model.observables(time, &duals(&event.q, dq), &duals(z, dz), &mut values);
                    values[*column].slope
                };
                let of_velocity = (0..N).any(|a| slope(0.0, &still, &unit(a)) != 0.0);
                let normal = std::array::from_fn(|a| slope(0.0, &unit(a), &still));
                (!of_velocity).then(|| (normal, slope(1.0, &still, &still)))
            }
            Self::Function(function) => {
                let size = |one: f64| if one > 0.0 { one } else { 1.0 };
                let moved = |from: &[f64; N], a: usize, s: f64| {
                    let mut to = *from;
                    to[a] += s;
                    to
                };
                let Event { t, q, v, .. } = event;
                let (at_q, at_v) = (DISTANCE * size(largest(q)), DISTANCE * size(largest(v)));
                let here = function(*t, q, v);
                let of_velocity = (0..N).any(|a| function(*t, q, &moved(v, a, at_v)) != here);
                let normal =
                    std::array::from_fn(|a| derivative(at_q, |s| function(*t, &moved(q, a, s), v)));
                let drift = derivative(DISTANCE, |s| function(t + s, q, v));
                (!of_velocity).then_some((normal, drift))
            }
        }
    }

    /// The change of it, where the velocity changes by `velocity`.
    pub(in crate::simulation) fn slope<M: Model<N>>(
        &self,
        along: &Along<'_, M, N>,
        event: &Event<N>,
        change: &Change<N>,
        velocity: &[f64; N],
    ) -> f64 {
        match self {
            Self::Column(column) => along.outputs(change, velocity)[*column],
            Self::Function(function) => {
                let Event { t, q, v, .. } = event;
                let part = |change: &[f64; N], of: &[f64; N]| {
                    largest(change) / if largest(of) > 0.0 { largest(of) } else { 1.0 }
                };
                let size = part(&change.q, q)
                    .max(part(velocity, v))
                    .max(change.t.abs());
                if size == 0.0 {
                    return 0.0;
                }
                let moved = |from: &[f64; N], by: &[f64; N], s: f64| {
                    std::array::from_fn(|a| from[a] + s * by[a])
                };
                derivative(DISTANCE / size, |s| {
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
