//! Events of runs: where an output changes its sign, and what is done there (T-122).

pub(super) mod act;
pub(super) mod on;
pub(super) mod remodel;
mod search;
pub(super) mod settings;
pub(super) mod value;
pub(super) mod watching;

use crate::error::RunErrorKind;
use act::{Act, After, Event, On};
use remodel::Remodel;
use search::Course;
use std::cell::RefCell;
use std::fmt;
use tfe_runtime::dual::Dual;
use tfe_runtime::enclosure::Enclosure;
use tfe_runtime::step::{Control, DenseElement, Impulse, Stepper};
use tfe_runtime::{Arguments, Element, Form, Model, Real, Share, State, constrained};
use value::Value;

/// An event that is looked for.
pub(super) struct Watched<'m, const N: usize> {
    pub(super) on: On<'m, N>,
    pub(super) value: Value<'m, N>,
}

/// [`Events::look`], or nothing.
type Look<'m, M, const N: usize> =
    fn(&mut Events<'m, M, N>, &Passage<'_, N>) -> Result<Option<Cut<'m, M, N>>, RunErrorKind>;

/// Looks for the events of a run.
pub(super) struct Events<'m, M, const N: usize> {
    model: Share<'m, M>,
    remodel: Option<Remodel<'m, M>>,
    look: Look<'m, M, N>,
    watched: Vec<Watched<'m, N>>,
    /// Sides on which the values were seen last; 0 where this is not known.
    sides: Vec<f64>,
    element: Element,
    control: Control,
    /// Whether steps are cut at kinks, those that look for the times of events as well.
    at_kinks: bool,
    rooms: Rooms,
    /// Finds the times of events, apart from the run.
    probe: Option<Stepper<'m, M, N>>,
    pub(super) met: Vec<Event<N>>,
    /// Events of the element looked into last that did not end it.
    recorded: Vec<Place>,
    /// Cuts in this step.
    cuts: u32,
    /// Length of this step.
    step: f64,
    /// When an event last cut an element, and which.
    last: Option<(f64, usize)>,
}

impl<M: fmt::Debug, const N: usize> fmt::Debug for Events<'_, M, N> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let names = self.watched.iter().map(|watched| &watched.on);
        f.debug_list().entries(names).finish()
    }
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

/// An event in an element.
#[derive(Clone, Copy, Debug)]
struct Place {
    /// Among those that are looked for.
    watched: usize,
    /// Among those met.
    met: usize,
    /// The length of the element that ends at it.
    length: f64,
    /// False where it is at the start of the element.
    inside: bool,
}

/// An element that ends at an event.
pub(super) struct Cut<'m, M, const N: usize> {
    pub(super) t: f64,
    pub(super) at: State<N>,
    pub(super) inside: Option<DenseElement<N>>,
    /// None where the run ends there.
    pub(super) after: Option<After<'m, M, N>>,
    place: Place,
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
    pub(super) watched: &'a Watched<'m, N>,
    /// The place of what is watched among all.
    pub(super) which: usize,
    pub(super) event: &'a Event<N>,
    /// The place of the event among all.
    pub(super) number: usize,
    pub(super) goes_on: bool,
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

impl<'m, M: Model<N>, const N: usize> Events<'m, M, N> {
    /// So many events within one step are a motion that comes to rest by ever more of them.
    const MAX_CUTS: u32 = 1000;

    /// As is one that comes again so soon, relative to the step: a little later its way is lost in roundings.
    const SOON: f64 = 1e-6;

    /// Goes on with another model.
    pub(super) fn set_model(&mut self, model: Share<'m, M>) {
        (self.model, self.probe) = (model, None);
    }

    pub(super) fn is_empty(&self) -> bool {
        self.watched.is_empty()
    }

    /// A new step of the run.
    pub(super) fn begin(&mut self, step: f64) {
        (self.cuts, self.step) = (0, step);
    }

    /// Does what is to be done at the events inside an element, in their order, up to the first that ends it.
    pub(super) fn pass(
        &mut self,
        arc: &Passage<'_, N>,
    ) -> Result<Option<Cut<'m, M, N>>, RunErrorKind> {
        (self.look)(self, arc)
    }

    fn look(&mut self, arc: &Passage<'_, N>) -> Result<Option<Cut<'m, M, N>>, RunErrorKind> {
        let Passage { t, h, dense, .. } = *arc;
        self.recorded.clear();
        if self.stays_off(dense) {
            return Ok(None);
        }
        let resolution = 4.0 * f64::EPSILON * t.abs().max((t + h).abs()).max(h.abs());
        let samples = (2 * dense.degree()).clamp(8, 24);
        let value = |tau: f64, row: &mut Vec<f64>| {
            let time = t + tau * h;
            let inside = 0.0 < tau && tau < 1.0;
            let (state, v) = if inside {
                (dense.at_time(time), self.velocity_inside(dense, time))
            } else if !self.needs_velocity() {
                (*if tau == 0.0 { arc.before } else { arc.after }, [0.0; N])
            } else {
                // Two elements agree at a node.
                let (time, state) = if tau == 0.0 {
                    (t, arc.before)
                } else {
                    (dense.end(), arc.after)
                };
                let v = constrained::velocity_of(&*self.model, time, &state.q, &state.p, &[0.0; N]);
                (*state, v.unwrap_or([f64::NAN; N]))
            };
            self.outputs(time, &state, &v, row);
        };
        let course = |function, part| self.course(dense, function, part);
        let resolution_of_tau = resolution / h.abs();
        let (found, sides) =
            search::crossings(&self.sides, samples, resolution_of_tau, value, course);
        for (number, root) in found.iter().enumerate() {
            let on = &self.watched[root.function].on;
            if !on.crossing.counts(root.rises) {
                continue;
            }
            let name = on.name.clone();
            let met = self.locate(arc, root, resolution);
            let met = met.unwrap_or_else(|| Met::between(dense, t, root.tau * h));
            let time = if (h - met.length).abs() <= resolution {
                dense.end()
            } else {
                t + met.length
            };
            let event = Event {
                name: name.clone(),
                t: time,
                q: met.state.q,
                v: met.velocity,
                p: met.state.p,
                rises: root.rises,
            };
            let watched = &self.watched[root.function];
            let act = act::act(&*self.model, (&watched.on, &watched.value), &event);
            let goes_by = act == Act::Record;
            let after = act::after(&*self.model, self.remodel, &event, act);
            let place = Place {
                watched: root.function,
                met: self.met.len(),
                length: met.length,
                inside: met.inside.is_some(),
            };
            self.met.push(event);
            let after = after?;
            if goes_by {
                self.recorded.push(place);
                continue;
            }
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
                place,
            }));
        }
        self.sides = sides;
        Ok(None)
    }

    /// A cut, with all that derivatives need.
    pub(super) fn severed<'c>(
        &'c self,
        arc: &Passage<'c, N>,
        cut: &Cut<'m, M, N>,
    ) -> Severed<'c, 'm, N> {
        self.place(arc, &cut.place, cut.after.is_some())
    }

    /// The events that did not end the element looked into last.
    pub(super) fn gone_by<'c>(
        &'c self,
        arc: &Passage<'c, N>,
    ) -> impl Iterator<Item = Severed<'c, 'm, N>> {
        (self.recorded.iter()).map(|place| self.place(arc, place, true))
    }

    fn place<'c>(
        &'c self,
        arc: &Passage<'c, N>,
        place: &Place,
        goes_on: bool,
    ) -> Severed<'c, 'm, N> {
        let before = |impulse: &&Impulse<N>| (impulse.time - arc.t).abs() < place.length.abs();
        let count = arc.impulses.iter().take_while(before).count();
        Severed {
            start: arc.t,
            length: place.length,
            step: self.step,
            before: arc.before,
            impulses: &arc.impulses[..count],
            inside: place.inside,
            watched: &self.watched[place.watched],
            which: place.watched,
            event: &self.met[place.met],
            number: place.met,
            goes_on,
        }
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

    /// Whether anything that is watched is a function of velocities; those of a Hamiltonian are of momenta.
    fn needs_velocity(&self) -> bool {
        matches!(M::FORM, Form::Lagrangian) || self.has_functions()
    }

    fn has_functions(&self) -> bool {
        let is_function = |one: &Watched<'m, N>| matches!(one.value, Value::Function(_));
        self.watched.iter().any(is_function)
    }

    /// The velocity in an element, where it is needed.
    fn velocity_inside(&self, dense: &DenseElement<N>, time: f64) -> [f64; N] {
        if self.needs_velocity() {
            dense.velocity_at_time(time)
        } else {
            [0.0; N]
        }
    }

    /// The values of what is watched.
    fn outputs(&self, t: f64, state: &State<N>, v: &[f64; N], row: &mut Vec<f64>) {
        let z = match M::FORM {
            Form::Lagrangian => v,
            Form::Hamiltonian => &state.p,
        };
        let mut values = self.rooms.values.borrow_mut();
        self.model.observables(t, &state.q, z, &mut values);
        row.extend(self.watched.iter().map(|watched| match &watched.value {
            Value::Column(column) => values[*column],
            Value::Function(function) => function(t, &state.q, v),
        }));
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
        if self.has_functions() {
            return false;
        }
        for piece in dense.pieces() {
            let mut values = self.rooms.bounds.borrow_mut();
            self.bounded(&piece.bounds(M::FORM), &mut values);
            for (watched, known) in self.watched.iter().zip(&mut self.sides) {
                let Value::Column(column) = watched.value else {
                    return false;
                };
                let side = values[column].side();
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
        let Value::Column(column) = self.watched[function].value else {
            return Course::Unknown;
        };
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
        let Dual { value, slope, .. } = values[column];
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
            None => {
                let probe =
                    Stepper::sharing(self.model.clone(), self.element, self.control).ok()?;
                if self.at_kinks {
                    probe.at_kinks()
                } else {
                    probe
                }
            }
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
                constrained::velocity_of(&*self.model, t + length, &state.q, &state.p, &guess)
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
