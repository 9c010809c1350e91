//! The actions at events, and the data of an event that the caller receives.

use super::model::EventModel;
use super::searched::Searched;
use super::settings::Settings;
use super::value::{Function, Value};
use crate::error::RunErrorKind;
use crate::length::{FixedLength, Length};
pub use crate::motion::Event;
use crate::numbers::{larger, largest};
use std::cell::Cell;
use std::fmt;
use std::ops::Deref;
use std::sync::Arc;

/// Which changes of sign count as an event. The direction is as the run sees it: what rises in a run forwards in time
/// falls in a run backwards.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Crossing {
    /// From negative to positive.
    Rising,
    /// From positive to negative.
    Falling,
    /// Both directions.
    Either,
}

impl Crossing {
    pub(super) fn counts(self, rises: bool) -> bool {
        match self {
            Self::Rising => rises,
            Self::Falling => !rises,
            Self::Either => true,
        }
    }
}

/// What a run does at an event.
#[derive(Clone, Debug, PartialEq)]
pub enum Act<const N: usize, L: Length<N> = FixedLength> {
    /// Record the event, as every event is, and continue as if nothing had happened, with the same bits.
    Record,
    /// End the run at the event. The last node has the state of the event; if an impulse at a node has caused the
    /// event, the node before it has the same time and the momentum before the impulse.
    Stop,
    /// End the element at the event, and continue from this state.
    Restart(L::State),
    /// End the element at the event, and add an impulse J (one number for each coordinate) to the momenta. Constraints
    /// react at once to the part of the impulse that violates them: the run continues with the velocity v and the
    /// momentum L_v(q, v) of
    ///
    /// ```text
    /// L_v(q, v) + Aᵀν = p + J ,     A v + a = 0                        (T-74)
    /// ```
    Impulse(L::Vector),
    /// End the element at the event, and continue with new values of parameters, and from another state if the
    /// [`Settings`] contain one.
    Set(Settings<N, L>),
}

/// An event at the moment when it happens, passed to the function given to [`Simulation::on`](crate::Simulation::on):
/// an [`Event`] (by dereference) that knows its model.
pub struct Occurrence<'a, const N: usize, L: Length<N> = FixedLength> {
    event: &'a Event<N, L>,
    model: &'a dyn EventModel<N, L>,
    value: &'a Value<'a, L::Vector>,
    /// A parameter and an increment, for a parameter that cannot be changed in the model itself.
    larger: Option<(usize, f64)>,
    /// The speed at which the surface was hit, if the state after an impact was asked for; otherwise zero.
    impact: Cell<f64>,
}

impl<'a, const N: usize, L: Length<N>> Occurrence<'a, N, L> {
    fn new(
        event: &'a Event<N, L>,
        model: &'a dyn EventModel<N, L>,
        value: &'a Value<'a, L::Vector>,
    ) -> Self {
        Self {
            event,
            model,
            value,
            larger: None,
            impact: Cell::new(0.0),
        }
    }

    /// The state with the same coordinates and other velocities. Its momenta are NaN if no momentum belongs to these
    /// velocities; the run then ends with an error.
    pub fn state_with_velocity(&self, v: L::Vector) -> L::State {
        L::state(self.event.q.clone(), self.momenta(&v))
    }

    /// The state after a frictionless impact on the surface g(t, q) = 0, where g is the function of this event, with
    /// coefficient of restitution e (1 for an elastic impact, 0 for a perfectly plastic one):
    ///
    /// ```text
    /// L_v(q, v⁺) = L_v(q, v⁻) + g_qᵀ λ + Aᵀ μ ,     ġ⁺ = −e ġ⁻ ,     A v⁺ + a = 0 .                        (T-139)
    /// ```
    ///
    /// with constraint Jacobian A. The impulse acts along the normal of the surface and along the normals of the
    /// model's constraints, which hold after the impact as before. With e = 1 the energy is conserved if neither the
    /// surface nor the constraints move. The state is NaN, and the run ends with an error, if g depends on velocities
    /// or if the constraints allow no motion along the normal of the surface.
    ///
    /// Nothing holds the motion on the surface afterwards. If e is zero, or so small that the rebound cannot be
    /// resolved, and the forces press the motion onto the surface, the motion has come to rest there, and the run ends
    /// with [`RunErrorKind::EventsWithoutEnd`].
    ///
    /// ```
    /// use tfe::prelude::*;
    ///
    /// /// A double pendulum beside a wall that its tip can hit.
    /// #[dynamics(
    ///     coordinates(a, b),
    ///     let x = sin(a) + sin(b),
    ///     let y = -cos(a) - cos(b),
    ///     lagrangian = (dot(sin(a))^2 + dot(cos(a))^2 + dot(x)^2 + dot(y)^2)/2 - g*(y - cos(a)),
    ///     event(wall) = 1 - x,
    /// )]
    /// struct DoublePendulum { g: f64 }
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// let pendulum = DoublePendulum { g: 9.81 };
    /// let motion = Simulation::new(&pendulum)
    ///     .step(0.01)
    ///     .on("wall", Crossing::Falling, |event| Act::Restart(event.after_impact(1.0)))
    ///     .run(pendulum.state([0.0, -0.5], [1.5, 2.5]), 0.0..5.0)?;
    /// assert!(motion.events().len() > 2 && motion.energy_error() < 1e-7);
    /// # Ok(())
    /// # }
    /// ```
    pub fn after_impact(&self, restitution: f64) -> L::State {
        self.rebound(restitution)
            .unwrap_or_else(|| L::state(self.event.q.clone(), L::unknown(&self.event.q)))
    }

    /// The current value of a parameter of the model, including changes that earlier events have [set](Act::Set);
    /// `None` if the model has no parameter of this name.
    pub fn parameter(&self, name: &str) -> Option<f64> {
        let names = self.model.parameter_names();
        let index = names.iter().position(|own| own.is(name))?;
        let larger = self.larger.filter(|(own, _)| *own == index);
        Some(self.model.parameter_value(index) + larger.map_or(0.0, |(_, larger)| larger))
    }

    /// The momenta of given velocities at the event.
    fn momenta(&self, v: &L::Vector) -> L::Vector {
        let Event { t, q, .. } = self.event;
        let p = self.model.momenta(*t, q, v);
        let Some((parameter, larger)) = self.larger else {
            return p;
        };
        let slopes = self.model.momenta_by(*t, q, (v, &p), parameter);
        let (p, slopes) = (p.as_ref(), slopes.as_ref());
        L::from_fn(q, |a| p[a] + larger * slopes[a])
    }

    /// The state after an impact; `None` if there is none.
    fn rebound(&self, restitution: f64) -> Option<L::State> {
        let Event { t, q, p, v, .. } = self.event;
        if self.larger.is_some() {
            return None;
        }
        let (normal, drift) = self.value.normal(self.model, self.event)?;
        let rate = |v: &L::Vector| {
            let products = normal.as_ref().iter().zip(v.as_ref());
            drift + products.map(|(n, v)| n * v).sum::<f64>()
        };
        let velocity = |lambda: f64| {
            let p = L::from_fn(q, |a| p.as_ref()[a] + lambda * normal.as_ref()[a]);
            let state = L::state(q.clone(), p);
            self.model.allowed_velocity(*t, &state, v)
        };
        let aim = -restitution * rate(v);
        // The equation is linear in λ if the kinetic energy is quadratic; then the second secant step solves it up to
        // rounding error.
        const MAX_SECANTS: u32 = 20;
        // The size of λ at which the impulse is as large as the momentum.
        let size = |values: &L::Vector| largest(values.as_ref());
        let first = larger(size(p), f64::MIN_POSITIVE.sqrt()) / size(&normal);
        let (mut before, mut next) = ((0.0, rate(v) - aim), first);
        let (mut least, mut steepest) = (f64::INFINITY, 0.0_f64);
        let mut after = None;
        for _ in 0..MAX_SECANTS {
            let Some(found) = velocity(next) else {
                break;
            };
            let here = (next, rate(&found) - aim);
            if here.1.abs() < least {
                (least, after) = (here.1.abs(), Some(found));
            }
            let slope = (here.1 - before.1) / (here.0 - before.0);
            let change = -here.1 / slope;
            // The last two values differ by rounding only.
            if here.1 == 0.0
                || !change.is_finite()
                || change.abs() <= 2.0 * f64::EPSILON * next.abs()
            {
                break;
            }
            steepest = steepest.max(slope.abs());
            (before, next) = (here, next + change);
        }
        // The rounding error that the momenta cause.
        let roundings = 16.0 * f64::EPSILON * steepest * first;
        let after = after.filter(|_| least <= 1e-9 * rate(v).abs() + roundings)?;
        if restitution >= 0.0 {
            self.impact.set(rate(v).abs());
        }
        Some(L::state(q.clone(), self.model.momenta(*t, q, &after)))
    }
}

impl<const N: usize, L: Length<N>> Deref for Occurrence<'_, N, L> {
    type Target = Event<N, L>;

    fn deref(&self) -> &Event<N, L> {
        self.event
    }
}

impl<const N: usize, L: Length<N>> fmt::Debug for Occurrence<'_, N, L> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.event.fmt(f)
    }
}

/// What is called at an event, without its type.
pub(crate) type Action<'m, const N: usize, L> =
    Arc<dyn Fn(&Occurrence<'_, N, L>) -> Act<N, L> + Send + Sync + 'm>;

/// An event to be watched: its function, its direction and its action.
#[derive(Clone)]
pub(in crate::simulation) struct On<'m, const N: usize, L: Length<N> = FixedLength> {
    pub(in crate::simulation) name: String,
    /// `None` for the output with this name.
    pub(in crate::simulation) function: Option<Function<'m, L::Vector>>,
    pub(in crate::simulation) crossing: Crossing,
    pub(in crate::simulation) act: Action<'m, N, L>,
}

impl<const N: usize, L: Length<N>> fmt::Debug for On<'_, N, L> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {:?}", self.name, self.crossing)
    }
}

/// A perturbed event, for difference quotients.
pub(in crate::simulation) struct Near<const N: usize, L: Length<N>> {
    pub(in crate::simulation) t: f64,
    pub(in crate::simulation) state: L::State,
    /// The change of the velocity due to the parameter.
    pub(in crate::simulation) velocity: L::Vector,
    /// The index of the parameter and its increment.
    pub(in crate::simulation) parameter: Option<(usize, f64)>,
}

/// The state that an action makes of the state at a perturbed event; `None` if the action only records or stops.
pub(in crate::simulation) fn state_after<L: Length<N>, const N: usize>(
    model: &dyn EventModel<N, L>,
    (on, value): (&On<'_, N, L>, &Value<'_, L::Vector>),
    event: &Event<N, L>,
    near: &Near<N, L>,
) -> Option<L::State> {
    let (t, state) = (near.t, &near.state);
    let other = near.parameter.and_then(|(index, larger)| {
        model.with_values(&[(index, model.parameter_value(index) + larger)])
    });
    let (model, larger) = match &other {
        Some(other) => (&**other, None),
        None => (model, near.parameter),
    };
    let found = model.velocity(t, state, &event.v);
    let mut velocity = found.unwrap_or_else(|| L::unknown(&event.v));
    if larger.is_some() {
        let (v, more) = (velocity.as_ref(), near.velocity.as_ref());
        velocity = L::from_fn(&event.v, |a| v[a] + more[a]);
    }
    let (q, p) = L::parts(state);
    let event = Event {
        name: event.name.clone(),
        t,
        q: q.clone(),
        p: p.clone(),
        v: velocity,
        rises: event.rises,
    };
    let act = (on.act)(&Occurrence {
        larger,
        ..Occurrence::new(&event, model, value)
    });
    match act {
        Act::Restart(state) => Some(state),
        Act::Impulse(impulse) => Some(kicked(model, t, state, &impulse)),
        Act::Set(settings) => settings.state_nearby(model, &event),
        Act::Record | Act::Stop => None,
    }
}

/// Calls the action of an event. Also returns the speed at which the surface was hit if the state after an impact was
/// asked for, otherwise zero.
pub(super) fn act<L: Length<N>, const N: usize>(
    model: &dyn EventModel<N, L>,
    (on, value): (&On<'_, N, L>, &Value<'_, L::Vector>),
    event: &Event<N, L>,
) -> (Act<N, L>, f64) {
    let occurrence = Occurrence::new(event, model, value);
    let act = (on.act)(&occurrence);
    let impact = match act {
        Act::Restart(_) => occurrence.impact.get(),
        _ => 0.0,
    };
    (act, impact)
}

/// The state and the parameters with which a run continues after an event.
pub(in crate::simulation) struct After<const N: usize, L: Length<N> = FixedLength> {
    pub(in crate::simulation) state: L::State,
    /// The parameters that were set, by their indices; `None` if none was set.
    pub(in crate::simulation) set: Option<Vec<(usize, f64)>>,
}

/// What comes after an action; `None` if the run ends.
pub(super) fn after<L: Length<N>, const N: usize>(
    run: &mut dyn Searched<N, L>,
    event: &Event<N, L>,
    act: Act<N, L>,
) -> Result<Option<After<N, L>>, RunErrorKind> {
    let state = match act {
        Act::Record | Act::Stop => return Ok(None),
        Act::Restart(state) => state,
        Act::Impulse(impulse) => kicked(run.model(), event.t, &event.state(), &impulse),
        Act::Set(settings) => {
            let values = settings.applied(run)?;
            let state = settings.state(run.next_model(), event);
            let set = Some(values);
            return Ok(Some(After { state, set }));
        }
    };
    Ok(Some(After { state, set: None }))
}

/// The state after an impulse; constraints react to the part of it that violates them.
fn kicked<L: Length<N>, const N: usize>(
    model: &dyn EventModel<N, L>,
    t: f64,
    state: &L::State,
    impulse: &L::Vector,
) -> L::State {
    let (q, p) = L::parts(state);
    let more = impulse.as_ref();
    if more.len() != p.as_ref().len() {
        // Reported as a state that is not finite.
        return L::state(q.clone(), L::unknown(p));
    }
    let p = L::from_fn(p, |a| p.as_ref()[a] + more[a]);
    let kicked = L::state(q.clone(), p);
    if model.is_constrained()
        && let Some(v) = model.allowed_velocity(t, &kicked, &L::zero(q))
    {
        return L::state(q.clone(), model.momenta(t, q, &v));
    }
    kicked
}
