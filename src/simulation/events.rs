//! Events of runs: where an output changes its sign, and what is done there (T-122).

pub(super) mod act;
mod clear;
pub(super) mod on;
pub(super) mod remodel;
mod search;
pub(super) mod settings;
pub(super) mod value;
pub(super) mod watching;

use super::acting;
use super::kind::{Chosen, Simulated};
use crate::error::RunErrorKind;
use crate::length::{FixedLength, Length, Polynomial};
use crate::motion::{LastCut, Seen};
use act::{Act, After, Event, On};
use clear::Clear;
use remodel::Remodel;
use search::Course;
use std::cell::RefCell;
use std::fmt;
use tfe_runtime::Share;
use tfe_runtime::dual::Dual;
use tfe_runtime::enclosure::Enclosure;
use tfe_runtime::step::Impulse;
use value::Value;

/// An event that is looked for.
pub struct Watched<'m, const N: usize, L: Length<N> = FixedLength> {
    pub(super) on: On<'m, N, L>,
    pub(super) value: Value<'m, L::Vector>,
}

/// [`Events::look`], or nothing.
type Look<'m, M, const N: usize, L> = fn(
    &mut Events<'m, M, N, L>,
    &Passage<'_, N, L>,
) -> Result<Option<Cut<'m, M, N, L>>, RunErrorKind>;

/// [`Events::keep_off`], or nothing.
type KeepOff<'m, M, const N: usize, L> =
    fn(&mut Events<'m, M, N, L>, &mut <L as Length<N>>::Stepper<'m, M>, (f64, f64)) -> bool;

/// Looks for the events of a run.
pub(super) struct Events<'m, M: 'm, const N: usize, L: Length<N> = FixedLength> {
    model: Share<'m, M>,
    remodel: Option<Remodel<'m, M>>,
    look: Look<'m, M, N, L>,
    keep_off: KeepOff<'m, M, N, L>,
    watched: Vec<Watched<'m, N, L>>,
    pub(super) seen: Seen,
    /// Of the steps that look for the times of events, as of those of the run.
    chosen: Chosen,
    rooms: Rooms,
    clear: Clear,
    /// Finds the times of events, apart from the run.
    probe: Option<L::Stepper<'m, M>>,
    pub(super) met: Vec<Event<N, L>>,
    /// Events of the element looked into last that did not end it.
    recorded: Vec<Place>,
    /// Cuts in this step.
    cuts: u32,
    /// Length of this step.
    step: f64,
}

impl<M, const N: usize, L: Length<N>> fmt::Debug for Events<'_, M, N, L> {
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
pub(super) struct Passage<'a, const N: usize, L: Length<N> = FixedLength> {
    pub(super) t: f64,
    /// Where the force is first felt: at `t`, or beyond it by roundings where that is a break.
    pub(super) begin: f64,
    pub(super) h: f64,
    pub(super) before: &'a L::State,
    pub(super) after: &'a L::State,
    pub(super) dense: &'a L::Polynomial,
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
pub(super) struct Cut<'m, M: 'm, const N: usize, L: Length<N> = FixedLength> {
    pub(super) t: f64,
    pub(super) at: L::State,
    pub(super) inside: Option<L::Polynomial>,
    /// None where the run ends there.
    pub(super) after: Option<After<'m, M, N, L>>,
    place: Place,
}

/// The same beside the element that was to be.
pub struct Severed<'a, 'm, const N: usize, L: Length<N> = FixedLength> {
    /// Where the element begins.
    pub(super) start: f64,
    /// Where the force is first felt: at its start, or beyond it by roundings where that is a break.
    pub(super) begin: f64,
    pub(super) length: f64,
    /// What its length was to be.
    pub(super) step: f64,
    pub(super) before: &'a L::State,
    pub(super) impulses: &'a [Impulse<N>],
    /// False where the event is at the start.
    pub(super) inside: bool,
    pub(super) watched: &'a Watched<'m, N, L>,
    /// The place of what is watched among all.
    pub(super) which: usize,
    pub(super) event: &'a Event<N, L>,
    /// The place of the event among all.
    pub(super) number: usize,
    pub(super) goes_on: bool,
}

/// What has come of a search for the time of an event.
struct Met<const N: usize, L: Length<N>> {
    length: f64,
    state: L::State,
    velocity: L::Vector,
    inside: Option<L::Polynomial>,
}

impl<const N: usize, L: Length<N>> Met<N, L> {
    /// Of the polynomial alone, where no element can end there.
    fn between(dense: &L::Polynomial, t: f64, length: f64) -> Self {
        Self {
            length,
            state: dense.at_time(t + length),
            velocity: dense.velocity_at_time(t + length),
            inside: None,
        }
    }
}

impl<'m, M, const N: usize, L> Events<'m, M, N, L>
where
    M: Simulated<N, L>,
    L: Length<N>,
{
    /// So many events within one step are a motion that comes to rest by ever more of them.
    const MAX_CUTS: u32 = 1000;

    /// As is one that comes again so soon, relative to the step: a little later its way is lost in roundings.
    const SOON: f64 = 1e-6;

    /// Goes on with another model.
    pub(super) fn set_model(&mut self, model: Share<'m, M>) {
        (self.model, self.probe) = (model, None);
        self.clear.forget();
    }

    /// What the model is given from outside is another: sides stay those that were seen, and what has jumped over zero is met at once.
    pub(super) fn set_inputs(&mut self) {
        self.clear.forget();
    }

    pub(super) fn is_empty(&self) -> bool {
        self.watched.is_empty()
    }

    /// A new step of the run.
    pub(super) fn begin(&mut self, step: f64) {
        (self.cuts, self.step) = (0, step);
    }

    /// Whether it is proved, for less than the polynomial of the element takes that was done last, that nothing that is watched vanishes there.
    pub(super) fn stays_clear(
        &mut self,
        stepper: &mut L::Stepper<'m, M>,
        element: (f64, f64),
    ) -> bool {
        (self.keep_off)(self, stepper, element)
    }

    fn keep_off(&mut self, stepper: &mut L::Stepper<'m, M>, element: (f64, f64)) -> bool {
        let within = |bounds: &[(f64, f64)]| M::reaches_within(stepper, bounds);
        (self.clear.holds(element, within) || self.look_about(stepper, element))
            && self.clear.agree(&mut self.seen.sides)
    }

    #[cold]
    fn look_about(&mut self, stepper: &mut L::Stepper<'m, M>, element: (f64, f64)) -> bool {
        if self.has_functions() {
            return false;
        }
        let (model, watched) = (&self.model, &self.watched);
        let mut values = self.rooms.bounds.borrow_mut();
        self.clear.look(
            element,
            &mut |reached| M::reach(stepper, reached),
            &mut |bounds, sides| {
                if !model.outputs_within(bounds, &mut values) {
                    return false;
                }
                sides.extend(watched.iter().map(|watched| match watched.value {
                    Value::Column(column) => values[column].side(),
                    Value::Function(_) => 0.0,
                }));
                true
            },
        )
    }

    /// Does what is to be done at the events inside an element, in their order, up to the first that ends it.
    pub(super) fn pass(
        &mut self,
        arc: &Passage<'_, N, L>,
    ) -> Result<Option<Cut<'m, M, N, L>>, RunErrorKind> {
        (self.look)(self, arc)
    }

    fn look(&mut self, arc: &Passage<'_, N, L>) -> Result<Option<Cut<'m, M, N, L>>, RunErrorKind> {
        let Passage { t, h, dense, .. } = *arc;
        self.recorded.clear();
        if self.stays_off(dense) {
            return Ok(None);
        }
        let resolution = 4.0 * f64::EPSILON * t.abs().max((t + h).abs()).max(h.abs());
        let samples = (2 * dense.degree()).clamp(8, 24);
        let value = |tau: f64, row: &mut Vec<f64>| {
            let time = t + tau * h;
            if 0.0 < tau && tau < 1.0 {
                let state = dense.at_time(time);
                let v = self.velocity_inside(dense, time, &state);
                self.outputs(time, &state, &v, row);
                return;
            }
            let state = if tau == 0.0 { arc.before } else { arc.after };
            let (q, _) = L::parts(state);
            if !self.needs_velocity() {
                self.outputs(time, state, &L::zero(q), row);
                return;
            }
            // Two elements agree at a node.
            let time = if tau == 0.0 { t } else { dense.end() };
            let v = self.model.velocity(time, state, &L::zero(q));
            let v = v.unwrap_or_else(|| L::unknown(q));
            self.outputs(time, state, &v, row);
        };
        let mut course = |function, part| self.course(dense, function, part);
        let resolution_of_tau = resolution / h.abs();
        let (found, sides) = search::crossings(
            &self.seen.sides,
            samples,
            resolution_of_tau,
            &value,
            &mut course,
        );
        for (number, root) in found.iter().enumerate() {
            let on = &self.watched[root.function].on;
            if !on.crossing.counts(root.rises) {
                continue;
            }
            let name = on.name.clone();
            let met = self.locate(arc, root, resolution);
            let met = met.unwrap_or_else(|| Met::between(dense, t, root.tau * h));
            if self.is_seen_again(root, t + met.length) {
                continue;
            }
            let time = if (h - met.length).abs() <= resolution {
                dense.end()
            } else {
                t + met.length
            };
            let (q, p) = L::parts(&met.state);
            let event = Event {
                name: name.clone(),
                t: time,
                q: q.clone(),
                v: met.velocity,
                p: p.clone(),
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
            let returns = after.is_some() && self.comes_soon(root, time).is_some();
            let is_idle =
                |after: &After<'m, M, N, L>| after.model.is_none() && after.state == met.state;
            self.seen.last = Some(LastCut {
                time,
                function: root.function,
                rises: root.rises,
                is_idle: after.as_ref().is_some_and(is_idle),
            });
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
        self.seen.sides = sides;
        Ok(None)
    }

    /// Whether this is the event that has cut the element before, where nothing was done: its polynomial has another velocity than the node at which this one begins.
    fn is_seen_again(&self, root: &search::Root, time: f64) -> bool {
        let is_last = |last: LastCut| last.is_idle && last.rises == root.rises;
        self.comes_soon(root, time).is_some_and(is_last)
    }

    /// The last cut, where this event made it and comes again too soon.
    fn comes_soon(&self, root: &search::Root, time: f64) -> Option<LastCut> {
        let soon = Self::SOON * self.step.abs();
        let is_soon =
            |last: &LastCut| last.function == root.function && (time - last.time).abs() < soon;
        self.seen.last.filter(is_soon)
    }

    /// A cut, with all that derivatives need.
    pub(super) fn severed<'c>(
        &'c self,
        arc: &Passage<'c, N, L>,
        cut: &Cut<'m, M, N, L>,
    ) -> Severed<'c, 'm, N, L> {
        self.place(arc, &cut.place, cut.after.is_some())
    }

    /// The events that did not end the element looked into last.
    pub(super) fn gone_by<'c>(
        &'c self,
        arc: &Passage<'c, N, L>,
    ) -> impl Iterator<Item = Severed<'c, 'm, N, L>> {
        (self.recorded.iter()).map(|place| self.place(arc, place, true))
    }

    fn place<'c>(
        &'c self,
        arc: &Passage<'c, N, L>,
        place: &Place,
        goes_on: bool,
    ) -> Severed<'c, 'm, N, L> {
        let count = acting::within(arc.impulses, arc.t, place.length);
        Severed {
            start: arc.t,
            begin: arc.begin,
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
        let mut sides = vec![0.0; self.seen.sides.len()];
        for root in &found[1..] {
            if root.tau - tau <= 16.0 * resolution && root.function != found[0].function {
                sides[root.function] = if root.rises { -1.0 } else { 1.0 };
            }
        }
        self.seen.sides = sides;
    }

    /// Whether anything that is watched is a function of velocities; those of a Hamiltonian are of momenta.
    fn needs_velocity(&self) -> bool {
        M::NEEDS_VELOCITY || self.has_functions()
    }

    fn has_functions(&self) -> bool {
        let is_function = |one: &Watched<'m, N, L>| matches!(one.value, Value::Function(_));
        self.watched.iter().any(is_function)
    }

    /// The velocity in an element, where it is needed.
    fn velocity_inside(&self, dense: &L::Polynomial, time: f64, state: &L::State) -> L::Vector {
        if self.needs_velocity() {
            dense.velocity_at_time(time)
        } else {
            let (q, _) = L::parts(state);
            L::zero(q)
        }
    }

    /// The values of what is watched.
    fn outputs(&self, t: f64, state: &L::State, v: &L::Vector, row: &mut Vec<f64>) {
        let mut values = self.rooms.values.borrow_mut();
        self.model.outputs(t, L::parts(state), v, &mut values);
        let (q, _) = L::parts(state);
        row.extend(self.watched.iter().map(|watched| match &watched.value {
            Value::Column(column) => values[*column],
            Value::Function(function) => function(t, q, v),
        }));
    }

    /// Whether it is proved that nothing that is watched comes to zero in an element. Sides that were not known are known then.
    fn stays_off(&mut self, dense: &L::Polynomial) -> bool {
        if self.has_functions() {
            return false;
        }
        for piece in dense.pieces() {
            let mut values = self.rooms.bounds.borrow_mut();
            self.model.outputs_along(piece, &mut values);
            for (watched, known) in self.watched.iter().zip(&mut self.seen.sides) {
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
    fn course(&self, dense: &L::Polynomial, function: usize, part: (f64, f64)) -> Course {
        let Value::Column(column) = self.watched[function].value else {
            return Course::Unknown;
        };
        let length = dense.end() - dense.start();
        // The piece that holds the part, if one holds all of it.
        let place = |piece: &L::Polynomial| {
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
        self.model.outputs_over(piece, within, &mut values);
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
        arc: &Passage<'_, N, L>,
        root: &search::Root,
        resolution: f64,
    ) -> Option<Met<N, L>> {
        /// Corrections of the length; each leaves the square of what was off.
        const MAX_TRIALS: u32 = 8;

        let Passage {
            t, begin, h, dense, ..
        } = *arc;
        let mut length = root.tau * h;
        let mut probe = match self.probe.take() {
            Some(probe) => probe,
            None => M::stepper(self.model.clone(), self.chosen).ok()?,
        };
        let mut last = f64::INFINITY;
        let mut met = None;
        for _ in 0..MAX_TRIALS {
            let mut state = arc.before.clone();
            let mut inside = None;
            if length.abs() > resolution {
                let impulses = &arc.impulses[..acting::within(arc.impulses, t, length)];
                M::advance(&mut probe, (begin, length), &mut state, impulses).ok()?;
                inside = Some(M::inside(&mut probe, None, (t, t + length)));
            }
            let guess = dense.velocity_at_time(t + length);
            let velocity = self.model.velocity(t + length, &state, &guess)?;
            let mut row = Vec::new();
            self.outputs(t + length, &state, &velocity, &mut row);
            let value = row[root.function];
            met = Some(Met {
                length,
                state,
                velocity,
                inside,
            });
            let slope = self.slope(arc, root.function, length);
            let change = -value / slope;
            let next = (length + change) * h.signum();
            if root.is_left_at_once(slope * h.signum())
                || !(change.abs() < last && next >= 0.0 && next <= h.abs() + resolution)
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
    fn slope(&self, arc: &Passage<'_, N, L>, function: usize, length: f64) -> f64 {
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
