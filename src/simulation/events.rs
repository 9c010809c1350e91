//! Events of runs: where an output changes its sign, and what is done there (T-122).

mod search;

use crate::error::RunErrorKind;
use crate::sensitivity::slopes::momentum_by;
use crate::velocity::velocity_from;
use search::Course;
use std::cell::RefCell;
use std::fmt;
use std::ops::Deref;
use std::sync::Arc;
use tfe_runtime::dual::Dual;
use tfe_runtime::enclosure::Enclosure;
use tfe_runtime::step::{Control, DenseElement, Impulse, Stepper};
use tfe_runtime::{Arguments, Element, Form, Model, Real, State, constrained};

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
    fn counts(self, rises: bool) -> bool {
        match self {
            Self::Rising => rises,
            Self::Falling => !rises,
            Self::Either => true,
        }
    }
}

/// What is done at an event.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Act<const N: usize> {
    /// The event is recorded, as all are, and the run goes on as if nothing had happened, with the same bits.
    Record,
    /// The run ends at the event.
    Stop,
    /// The element ends at the event, and the run goes on from this state.
    Restart(State<N>),
    /// The same with momenta that are larger by an impulse.
    Impulse([f64; N]),
}

/// An event that was met, with the state before anything is done.
#[derive(Clone, Debug, PartialEq)]
pub struct Event<const N: usize> {
    /// The output that changed its sign.
    pub name: String,
    /// When.
    pub t: f64,
    /// Generalized coordinates.
    pub q: [f64; N],
    /// Velocities dq/dt.
    pub v: [f64; N],
    /// Generalized momenta.
    pub p: [f64; N],
    /// Whether it went from below zero to above.
    pub rises: bool,
}

impl<const N: usize> Event<N> {
    /// The point of phase space, without the time.
    pub fn state(&self) -> State<N> {
        State {
            q: self.q,
            p: self.p,
        }
    }
}

/// An event while it happens: an [`Event`] that knows its model.
pub struct Occurrence<'a, const N: usize> {
    event: &'a Event<N>,
    momenta: &'a dyn Fn([f64; N]) -> [f64; N],
}

impl<const N: usize> Occurrence<'_, N> {
    /// The state at the same coordinates with other velocities; its momenta are NaN where none belong to them, and the run then ends with an error.
    pub fn state_with_velocity(&self, v: [f64; N]) -> State<N> {
        State {
            q: self.event.q,
            p: (self.momenta)(v),
        }
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
pub(super) struct On<'m, const N: usize> {
    pub(super) name: String,
    pub(super) crossing: Crossing,
    pub(super) act: Action<'m, N>,
}

impl<const N: usize> fmt::Debug for On<'_, N> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {:?}", self.name, self.crossing)
    }
}

/// Looks for the events of a run.
pub(super) struct Events<'a, 'm, M, const N: usize> {
    model: &'m M,
    /// With the columns of their outputs.
    watched: Vec<(usize, &'a On<'m, N>)>,
    /// Sides on which the outputs were seen last; 0 where this is not known.
    sides: Vec<f64>,
    element: Element,
    control: Control,
    rooms: Rooms,
    /// Finds the times of events, apart from the run.
    probe: Option<Stepper<'m, M, N>>,
    pub(super) met: Vec<Event<N>>,
    /// Cuts in this step.
    cuts: u32,
    /// Length of this step.
    step: f64,
    /// When an event last cut an element, and which.
    last: Option<(f64, usize)>,
}

/// Room for all outputs: numbers, bounds, and bounds with their slopes.
struct Rooms {
    values: RefCell<Vec<f64>>,
    bounds: RefCell<Vec<Enclosure>>,
    slopes: RefCell<Vec<Dual<Enclosure>>>,
}

impl Rooms {
    fn new(columns: usize) -> Self {
        let zero = Dual::new(Enclosure::ZERO, Enclosure::ZERO);
        Self {
            values: RefCell::new(vec![0.0; columns]),
            bounds: RefCell::new(vec![Enclosure::ZERO; columns]),
            slopes: RefCell::new(vec![zero; columns]),
        }
    }
}

/// An element that is to be looked into.
pub(super) struct Passage<'a, const N: usize> {
    pub(super) t: f64,
    pub(super) h: f64,
    pub(super) before: &'a State<N>,
    pub(super) after: &'a State<N>,
    pub(super) dense: &'a DenseElement<N>,
    pub(super) impulses: &'a [Impulse<N>],
}

/// An element that ends at an event.
pub(super) struct Cut<'a, 'm, const N: usize> {
    pub(super) t: f64,
    pub(super) at: State<N>,
    pub(super) inside: Option<DenseElement<N>>,
    /// None where the run ends there.
    pub(super) after: Option<State<N>>,
    /// Its length.
    length: f64,
    on: &'a On<'m, N>,
    /// The output, among all.
    column: usize,
}

/// The same beside the element that was to be.
pub(super) struct Severed<'a, 'm, const N: usize> {
    /// Where the element begins.
    pub(super) start: f64,
    pub(super) length: f64,
    /// What its length was to be.
    pub(super) step: f64,
    pub(super) before: &'a State<N>,
    pub(super) impulses: &'a [Impulse<N>],
    /// False where the event is at the start.
    pub(super) inside: bool,
    pub(super) on: &'a On<'m, N>,
    pub(super) column: usize,
    pub(super) event: &'a Event<N>,
    /// The place of the event among all.
    pub(super) number: usize,
    pub(super) goes_on: bool,
}

/// A place near an event, and a parameter that is a little larger there.
pub(super) struct Near<const N: usize> {
    pub(super) t: f64,
    pub(super) state: State<N>,
    /// What the parameter adds to the velocity.
    pub(super) velocity: [f64; N],
    /// The parameter, among all, and by how much it is larger.
    pub(super) parameter: Option<(usize, f64)>,
}

/// What an act makes of a state near that of its event; none where it lets the run end or go on as it was.
pub(super) fn state_after<M: Model<N>, const N: usize>(
    model: &M,
    on: &On<'_, N>,
    event: &Event<N>,
    near: &Near<N>,
) -> Option<State<N>> {
    let (t, state) = (near.t, &near.state);
    let mut velocity = velocity_from(model, t, state, &event.v);
    for (v, more) in velocity.iter_mut().zip(near.velocity) {
        *v += more;
    }
    let event = Event {
        name: event.name.clone(),
        t,
        q: state.q,
        p: state.p,
        v: velocity,
        rises: event.rises,
    };
    let momenta = |v: [f64; N]| {
        let mut p = momenta_of(model, &event, v);
        if let Some((parameter, larger)) = near.parameter {
            let slopes = momentum_by(model, t, (&event.q, &v, &p), parameter);
            for (p, slope) in p.iter_mut().zip(slopes) {
                *p += larger * slope;
            }
        }
        p
    };
    let act = (on.act)(&Occurrence {
        event: &event,
        momenta: &momenta,
    });
    match act {
        Act::Restart(state) => Some(state),
        Act::Impulse(impulse) => Some(kicked(state, &impulse)),
        Act::Record | Act::Stop => None,
    }
}

/// What is to be done at an event.
fn act<M: Model<N>, const N: usize>(model: &M, on: &On<'_, N>, event: &Event<N>) -> Act<N> {
    let momenta = |v: [f64; N]| momenta_of(model, event, v);
    (on.act)(&Occurrence {
        event,
        momenta: &momenta,
    })
}

/// The momenta of velocities at an event; NaN where there are none.
fn momenta_of<M: Model<N>, const N: usize>(model: &M, event: &Event<N>, v: [f64; N]) -> [f64; N] {
    tfe_runtime::__private::state(model, event.t, event.q, v).p
}

/// The state with momenta that are larger by an impulse.
fn kicked<const N: usize>(state: &State<N>, impulse: &[f64; N]) -> State<N> {
    let mut kicked = *state;
    for (p, more) in kicked.p.iter_mut().zip(impulse) {
        *p += more;
    }
    kicked
}

/// What has come of a search for the time of an event.
struct Met<const N: usize> {
    length: f64,
    state: State<N>,
    velocity: [f64; N],
    inside: Option<DenseElement<N>>,
}

impl<const N: usize> Met<N> {
    /// Of the polynomial alone, where no element can end there.
    fn between(dense: &DenseElement<N>, t: f64, length: f64) -> Self {
        Self {
            length,
            state: dense.at_time(t + length),
            velocity: dense.velocity_at_time(t + length),
            inside: None,
        }
    }
}

impl<'a, 'm, M: Model<N>, const N: usize> Events<'a, 'm, M, N> {
    /// So many events within one step are a motion that comes to rest by ever more of them.
    const MAX_CUTS: u32 = 1000;

    /// As is one that comes again so soon, relative to the step: a little later its way is lost in roundings.
    const SOON: f64 = 1e-6;

    pub(super) fn new(
        model: &'m M,
        on: &'a [On<'m, N>],
        (element, control): (Element, Control),
    ) -> Result<Self, RunErrorKind> {
        let known = || (0..model.columns()).map(|at| model.column_name(at).to_string());
        let column = |one: &'a On<'m, N>| match known().position(|name| name == one.name) {
            Some(column) => Ok((column, one)),
            None => Err(RunErrorKind::NoEvent {
                name: one.name.clone(),
                known: known().collect(),
            }),
        };
        let watched: Vec<_> = on.iter().map(column).collect::<Result<_, _>>()?;
        Ok(Self {
            model,
            sides: vec![0.0; watched.len()],
            watched,
            element,
            control,
            rooms: Rooms::new(model.columns()),
            probe: None,
            met: Vec::new(),
            cuts: 0,
            step: 0.0,
            last: None,
        })
    }

    pub(super) fn is_empty(&self) -> bool {
        self.watched.is_empty()
    }

    /// A new step of the run.
    pub(super) fn begin(&mut self, step: f64) {
        (self.cuts, self.step) = (0, step);
    }

    /// Does what is to be done at the events inside an element, in their order, up to the first that ends it.
    pub(super) fn look(
        &mut self,
        arc: &Passage<'_, N>,
    ) -> Result<Option<Cut<'a, 'm, N>>, RunErrorKind> {
        let Passage { t, h, dense, .. } = *arc;
        if self.stays_off(dense) {
            return Ok(None);
        }
        let resolution = 4.0 * f64::EPSILON * t.abs().max((t + h).abs()).max(h.abs());
        let samples = (2 * dense.degree()).clamp(8, 24);
        let value = |tau: f64, row: &mut Vec<f64>| {
            let time = t + tau * h;
            let inside = 0.0 < tau && tau < 1.0;
            let (state, v) = if inside {
                (dense.at_time(time), velocity_of_form::<M, N>(dense, time))
            } else if matches!(M::FORM, Form::Hamiltonian) {
                (*if tau == 0.0 { arc.before } else { arc.after }, [0.0; N])
            } else {
                // Two elements agree at a node.
                let (time, state) = if tau == 0.0 {
                    (t, arc.before)
                } else {
                    (dense.end(), arc.after)
                };
                let v = constrained::velocity_of(self.model, time, &state.q, &state.p, &[0.0; N]);
                (*state, v.unwrap_or([f64::NAN; N]))
            };
            self.outputs(time, &state, &v, row);
        };
        let course = |function, part| self.course(dense, function, part);
        let resolution_of_tau = resolution / h.abs();
        let (found, sides) =
            search::crossings(&self.sides, samples, resolution_of_tau, value, course);
        for (number, root) in found.iter().enumerate() {
            let (column, on) = self.watched[root.function];
            if !on.crossing.counts(root.rises) {
                continue;
            }
            let met = self.locate(arc, root, resolution);
            let met = met.unwrap_or_else(|| Met::between(dense, t, root.tau * h));
            let time = if (h - met.length).abs() <= resolution {
                dense.end()
            } else {
                t + met.length
            };
            let event = Event {
                name: on.name.clone(),
                t: time,
                q: met.state.q,
                v: met.velocity,
                p: met.state.p,
                rises: root.rises,
            };
            let act = act(self.model, on, &event);
            let name = event.name.clone();
            self.met.push(event);
            let after = match act {
                Act::Record => continue,
                Act::Stop => None,
                Act::Restart(state) => Some(state),
                Act::Impulse(impulse) => Some(kicked(&met.state, &impulse)),
            };
            self.cuts += 1;
            let is_soon = |(last, function): (f64, usize)| {
                function == root.function && (time - last).abs() < Self::SOON * self.step.abs()
            };
            let returns = after.is_some() && self.last.is_some_and(is_soon);
            self.last = Some((time, root.function));
            if returns || self.cuts > Self::MAX_CUTS {
                return Err(RunErrorKind::EventsWithoutEnd { name, time });
            }
            self.forget_sides(&found[number..], root.tau, resolution_of_tau);
            return Ok(Some(Cut {
                t: time,
                at: met.state,
                inside: met.inside,
                after,
                length: met.length,
                on,
                column,
            }));
        }
        self.sides = sides;
        Ok(None)
    }

    /// The last cut, with all that derivatives need.
    pub(super) fn severed<'c>(
        &'c self,
        arc: &Passage<'c, N>,
        cut: &Cut<'c, 'm, N>,
        impulses: &'c [Impulse<N>],
    ) -> Option<Severed<'c, 'm, N>> {
        let event = self.met.last()?;
        let before = |impulse: &&Impulse<N>| (impulse.time - arc.t).abs() < cut.length.abs();
        let count = impulses.iter().take_while(before).count();
        Some(Severed {
            start: arc.t,
            length: cut.length,
            step: self.step,
            before: arc.before,
            impulses: &impulses[..count],
            inside: cut.inside.is_some(),
            on: cut.on,
            column: cut.column,
            event,
            number: self.met.len() - 1,
            goes_on: cut.after.is_some(),
        })
    }

    /// After a jump of the state outputs are on new sides, but for those that are to cross at the same time.
    fn forget_sides(&mut self, found: &[search::Root], tau: f64, resolution: f64) {
        let mut sides = vec![0.0; self.sides.len()];
        for root in &found[1..] {
            if root.tau - tau <= 16.0 * resolution && root.function != found[0].function {
                sides[root.function] = if root.rises { -1.0 } else { 1.0 };
            }
        }
        self.sides = sides;
    }

    /// The values of what is watched.
    fn outputs(&self, t: f64, state: &State<N>, v: &[f64; N], row: &mut Vec<f64>) {
        let z = match M::FORM {
            Form::Lagrangian => v,
            Form::Hamiltonian => &state.p,
        };
        let mut values = self.rooms.values.borrow_mut();
        self.model.observables(t, &state.q, z, &mut values);
        row.extend(self.watched.iter().map(|(column, _)| values[*column]));
    }

    /// All outputs of bounds of what they are functions of.
    fn bounded<R: Real>(&self, over: &Arguments<R, N>, values: &mut [R]) {
        let z = match M::FORM {
            Form::Lagrangian => &over.v,
            Form::Hamiltonian => &over.p,
        };
        self.model.observables(over.t, &over.q, z, values);
    }

    /// Whether it is proved that nothing that is watched comes to zero in an element. Sides that were not known are known then.
    fn stays_off(&mut self, dense: &DenseElement<N>) -> bool {
        for piece in dense.pieces() {
            let mut values = self.rooms.bounds.borrow_mut();
            self.bounded(&piece.bounds(M::FORM), &mut values);
            for ((column, _), known) in self.watched.iter().zip(&mut self.sides) {
                let side = values[*column].side();
                if side == 0.0 || *known == -side {
                    return false;
                }
                *known = side;
            }
        }
        true
    }

    /// What is known of an output that is watched in a part of an element.
    fn course(&self, dense: &DenseElement<N>, function: usize, part: (f64, f64)) -> Course {
        let length = dense.end() - dense.start();
        // The piece that holds the part, if one holds all of it.
        let place = |piece: &DenseElement<N>| {
            let from = (piece.start() - dense.start()) / length;
            let to = (piece.end() - dense.start()) / length;
            ((part.0 - from) / (to - from), (part.1 - from) / (to - from))
        };
        let holds = |(from, to): &(f64, f64)| *from >= 0.0 && *to <= 1.0;
        let mut pieces = dense.pieces().iter().map(|piece| (piece, place(piece)));
        let Some((piece, within)) = pieces.find(|(_, within)| holds(within)) else {
            return Course::Bent;
        };
        let mut values = self.rooms.slopes.borrow_mut();
        self.bounded(&piece.bounds_over(within), &mut values);
        let Dual { value, slope, .. } = values[self.watched[function].0];
        if value.side() != 0.0 || slope.side() != 0.0 {
            Course::Plain
        } else if value == Enclosure::WHOLE {
            Course::Unknown
        } else {
            Course::Bent
        }
    }

    /// The length of the element that ends at the event: nodes are more accurate than the polynomial between them, which tells where to begin. None where such an element
    /// cannot be solved.
    fn locate(
        &mut self,
        arc: &Passage<'_, N>,
        root: &search::Root,
        resolution: f64,
    ) -> Option<Met<N>> {
        /// Corrections of the length; each leaves the square of what was off.
        const MAX_TRIALS: u32 = 8;

        let Passage { t, h, dense, .. } = *arc;
        let mut length = root.tau * h;
        let mut probe = match self.probe.take() {
            Some(probe) => probe,
            None => Stepper::new(self.model, self.element, self.control).ok()?,
        };
        let mut last = f64::INFINITY;
        let mut met = None;
        for _ in 0..MAX_TRIALS {
            let mut state = *arc.before;
            let mut inside = None;
            if length.abs() > resolution {
                let before = |impulse: &&Impulse<N>| (impulse.time - t).abs() < length.abs();
                let impulses: Vec<_> = arc.impulses.iter().filter(before).copied().collect();
                probe.advance(t, length, &mut state, &impulses).ok()?;
                inside = Some(probe.dense(t, t + length));
            }
            let guess = dense.velocity_at_time(t + length);
            let velocity =
                constrained::velocity_of(self.model, t + length, &state.q, &state.p, &guess)
                    .ok()?;
            let mut row = Vec::new();
            self.outputs(t + length, &state, &velocity, &mut row);
            let value = row[root.function];
            met = Some(Met {
                length,
                state,
                velocity,
                inside,
            });
            let change = -value / self.slope(arc, root.function, length);
            let next = (length + change) * h.signum();
            if !(change.abs() < last && next >= 0.0 && next <= h.abs() + resolution)
                || change.abs() <= 0.25 * resolution
            {
                break;
            }
            last = change.abs();
            length = next.min(h.abs()) * h.signum();
        }
        self.probe = Some(probe);
        met
    }

    /// dg/dt on the polynomial.
    fn slope(&self, arc: &Passage<'_, N>, function: usize, length: f64) -> f64 {
        const NEAR: f64 = 1e-4;
        let Passage { t, h, dense, .. } = *arc;
        let value = |length: f64| {
            let (state, v) = (
                dense.at_time(t + length),
                dense.velocity_at_time(t + length),
            );
            let mut row = Vec::new();
            self.outputs(t + length, &state, &v, &mut row);
            row[function]
        };
        let (from, to) = (
            (length / h - NEAR).max(0.0) * h,
            (length / h + NEAR).min(1.0) * h,
        );
        (value(to) - value(from)) / (to - from)
    }
}

/// The velocity that observables of a Lagrangian are functions of; those of a Hamiltonian are of the momentum, and need none.
fn velocity_of_form<M: Model<N>, const N: usize>(dense: &DenseElement<N>, time: f64) -> [f64; N] {
    match M::FORM {
        Form::Lagrangian => dense.velocity_at_time(time),
        Form::Hamiltonian => [0.0; N],
    }
}
