//! What is done at events, and what a caller is told of them.

use super::remodel::{Changed, Remodel};
use super::settings::{Settings, momenta_of};
use super::value::{Function, Value};
use crate::error::RunErrorKind;
use crate::evaluate::Evaluate;
pub use crate::motion::Event;
use crate::sensitivity::slopes::momentum_by;
use std::fmt;
use std::ops::Deref;
use std::sync::Arc;
use tfe_runtime::{Model, State, constrained};

/// Which changes of sign count.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Crossing {
    /// From below zero to above.
    Rising,
    /// From above zero to below.
    Falling,
    /// Both.
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

/// What is done at an event.
#[derive(Clone, Debug, PartialEq)]
pub enum Act<const N: usize> {
    /// The event is recorded, as all are, and the run goes on as if nothing had happened, with the same bits.
    Record,
    /// The run ends at the event.
    Stop,
    /// The element ends at the event, and the run goes on from this state.
    Restart(State<N>),
    /// The same with momenta that are larger by an impulse. What of it is against constraints, these take up at once: the run goes on with the velocity that is left,
    /// L_v(q, v) + Aᵀν = p + J, A v + a = 0 (T-74).
    Impulse([f64; N]),
    /// The same with other values of parameters, and from another state if one is given with them: [`Settings`].
    Set(Settings<N>),
}

/// An event while it happens: an [`Event`] that knows its model.
pub struct Occurrence<'a, const N: usize> {
    event: &'a Event<N>,
    model: &'a dyn Knows<N>,
}

/// What an event can be asked about its model.
trait Knows<const N: usize> {
    fn momenta(&self, v: [f64; N]) -> [f64; N];
    fn after_impact(&self, restitution: f64) -> State<N>;
    fn parameter(&self, name: &str) -> Option<f64>;
}

impl<const N: usize> Occurrence<'_, N> {
    /// The state at the same coordinates with other velocities; its momenta are NaN where none belong to them, and the run then ends with an error.
    pub fn state_with_velocity(&self, v: [f64; N]) -> State<N> {
        State {
            q: self.event.q,
            p: self.model.momenta(v),
        }
    }

    /// The state after an impact without friction on the surface g(t, q) = 0 of the event, with a coefficient of restitution e,
    ///
    /// ```text
    /// L_v(q, v⁺) = L_v(q, v⁻) + g_qᵀ λ + Aᵀ μ ,     ġ⁺ = −e ġ⁻ ,     A v⁺ + a = 0 .                        (T-139)
    /// ```
    ///
    /// The impulse acts along the normal of the surface and those of the constraints of the model, which hold after it as before. With e = 1 the energy is kept where neither surface nor
    /// constraints move. NaN, with which the run ends, where g depends on velocities, or where the constraints leave no motion along its normal.
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
    pub fn after_impact(&self, restitution: f64) -> State<N> {
        self.model.after_impact(restitution)
    }

    /// The value that a parameter of the model has when the event happens, after all that earlier events have [set](Act::Set); `None` for a name that is none.
    pub fn parameter(&self, name: &str) -> Option<f64> {
        self.model.parameter(name)
    }
}

impl<const N: usize> Deref for Occurrence<'_, N> {
    type Target = Event<N>;

    fn deref(&self) -> &Event<N> {
        self.event
    }
}

impl<const N: usize> fmt::Debug for Occurrence<'_, N> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.event.fmt(f)
    }
}

type Action<'m, const N: usize> = Arc<dyn Fn(&Occurrence<'_, N>) -> Act<N> + Send + Sync + 'm>;

/// What a run is to look for.
#[derive(Clone)]
pub(in crate::simulation) struct On<'m, const N: usize> {
    pub(in crate::simulation) name: String,
    /// None for an output of this name.
    pub(in crate::simulation) function: Option<Function<'m, N>>,
    pub(in crate::simulation) crossing: Crossing,
    pub(in crate::simulation) act: Action<'m, N>,
}

impl<const N: usize> fmt::Debug for On<'_, N> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {:?}", self.name, self.crossing)
    }
}

/// An event with its model.
struct Knowing<'a, 'm, M, const N: usize> {
    model: &'a M,
    event: &'a Event<N>,
    value: &'a Value<'m, N>,
    /// A parameter that the model cannot have another value of, and by how much it is larger.
    larger: Option<(usize, f64)>,
}

impl<M: Model<N>, const N: usize> Knows<N> for Knowing<'_, '_, M, N> {
    fn momenta(&self, v: [f64; N]) -> [f64; N] {
        let mut p = momenta_of(self.model, self.event, v);
        if let Some((parameter, larger)) = self.larger {
            let Event { t, q, .. } = self.event;
            let slopes = momentum_by(self.model, *t, (q, &v, &p), parameter);
            for (p, slope) in p.iter_mut().zip(slopes) {
                *p += larger * slope;
            }
        }
        p
    }

    fn after_impact(&self, restitution: f64) -> State<N> {
        let Event { t, q, p, v, .. } = self.event;
        let unknown = State {
            q: *q,
            p: [f64::NAN; N],
        };
        if self.larger.is_some() {
            return unknown;
        }
        let Some((normal, drift)) = self.value.normal(self.model, self.event) else {
            return unknown;
        };
        let rate = |v: &[f64; N]| drift + normal.iter().zip(v).map(|(n, v)| n * v).sum::<f64>();
        let velocity = |lambda: f64| {
            let p = std::array::from_fn(|a| p[a] + lambda * normal[a]);
            constrained::velocity(self.model, *t, q, &p, v).ok()
        };
        let aim = -restitution * rate(v);
        // Linear in λ where the kinetic energy is quadratic: the second secant is then the last one that changes anything.
        const MAX_SECANTS: u32 = 20;
        let (mut before, mut lambda) = ((0.0, rate(v) - aim), f64::NAN);
        // Of the size that an energy ½ v·p has.
        let size = |values: &[f64; N]| values.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        let mut next = size(p).max(f64::MIN_POSITIVE.sqrt()) / size(&normal);
        for _ in 0..MAX_SECANTS {
            let Some(found) = velocity(next) else {
                return unknown;
            };
            let here = (next, rate(&found) - aim);
            lambda = next;
            let change = -here.1 * (here.0 - before.0) / (here.1 - before.1);
            if here.1 == 0.0 || change.abs() <= 2.0 * f64::EPSILON * next.abs() {
                break;
            }
            (before, next) = (here, next + change);
        }
        let Some(v) = velocity(lambda) else {
            return unknown;
        };
        if !((rate(&v) - aim).abs() <= 1e-9 * rate(&self.event.v).abs()) {
            return unknown;
        }
        State {
            q: *q,
            p: momenta_of(self.model, self.event, v),
        }
    }

    fn parameter(&self, name: &str) -> Option<f64> {
        let index = self.model.find_parameter(name)?;
        let larger = self.larger.filter(|(own, _)| *own == index);
        Some(self.model.parameter(index) + larger.map_or(0.0, |(_, larger)| larger))
    }
}

/// A place near an event, and a parameter that is a little larger there.
pub(in crate::simulation) struct Near<const N: usize> {
    pub(in crate::simulation) t: f64,
    pub(in crate::simulation) state: State<N>,
    /// What the parameter adds to the velocity.
    pub(in crate::simulation) velocity: [f64; N],
    /// The parameter, among all, and by how much it is larger.
    pub(in crate::simulation) parameter: Option<(usize, f64)>,
}

/// What an act makes of a state near that of its event; none where it lets the run end or go on as it was.
pub(in crate::simulation) fn state_after<M: Model<N>, const N: usize>(
    model: &M,
    (on, value): (&On<'_, N>, &Value<'_, N>),
    event: &Event<N>,
    near: &Near<N>,
) -> Option<State<N>> {
    let (t, state) = (near.t, &near.state);
    let other = near
        .parameter
        .and_then(|(index, larger)| model.with_parameter(index, model.parameter(index) + larger));
    let (model, larger) = match &other {
        Some(other) => (other, None),
        None => (model, near.parameter),
    };
    let found = model.velocity(t, state, &event.v);
    let mut velocity = found.unwrap_or([f64::NAN; N]);
    if larger.is_some() {
        for (v, more) in velocity.iter_mut().zip(near.velocity) {
            *v += more;
        }
    }
    let event = Event {
        name: event.name.clone(),
        t,
        q: state.q,
        p: state.p,
        v: velocity,
        rises: event.rises,
    };
    let act = (on.act)(&Occurrence {
        event: &event,
        model: &Knowing {
            model,
            event: &event,
            value,
            larger,
        },
    });
    match act {
        Act::Restart(state) => Some(state),
        Act::Impulse(impulse) => Some(kicked(model, t, state, &impulse)),
        Act::Set(settings) => settings.state_nearby(model, &event),
        Act::Record | Act::Stop => None,
    }
}

/// What is to be done at an event.
pub(super) fn act<M: Model<N>, const N: usize>(
    model: &M,
    (on, value): (&On<'_, N>, &Value<'_, N>),
    event: &Event<N>,
) -> Act<N> {
    (on.act)(&Occurrence {
        event,
        model: &Knowing {
            model,
            event,
            value,
            larger: None,
        },
    })
}

/// With what a run goes on after an event.
pub(in crate::simulation) struct After<'m, M, const N: usize> {
    pub(in crate::simulation) state: State<N>,
    /// The model with other parameters, if any were set, and these by their numbers.
    pub(in crate::simulation) model: Option<Changed<'m, M>>,
}

/// What an act lets a run go on with; none where it ends.
pub(super) fn after<'m, M: Model<N>, const N: usize>(
    model: &M,
    remodel: Option<Remodel<'m, M>>,
    event: &Event<N>,
    act: Act<N>,
) -> Result<Option<After<'m, M, N>>, RunErrorKind> {
    let state = match act {
        Act::Record | Act::Stop => return Ok(None),
        Act::Restart(state) => state,
        Act::Impulse(impulse) => kicked(model, event.t, &event.state(), &impulse),
        Act::Set(settings) => {
            let (model, values) = settings.applied(model, remodel)?;
            let state = settings.state(&*model, event);
            return Ok(Some(After {
                state,
                model: Some((model, values)),
            }));
        }
    };
    Ok(Some(After { state, model: None }))
}

/// The state with momenta that are larger by an impulse, as far as constraints let it act.
fn kicked<M: Model<N>, const N: usize>(
    model: &M,
    t: f64,
    state: &State<N>,
    impulse: &[f64; N],
) -> State<N> {
    let mut kicked = *state;
    for (p, more) in kicked.p.iter_mut().zip(impulse) {
        *p += more;
    }
    if const { !M::CONSTRAINTS.is_empty() }
        && let Ok(v) = constrained::velocity(model, t, &kicked.q, &kicked.p, &[0.0; N])
    {
        kicked = tfe_runtime::__private::state(model, t, kicked.q, v);
    }
    kicked
}
