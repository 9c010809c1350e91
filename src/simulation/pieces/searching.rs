//! Passes an element in which events are looked for. What is done there sees the model and the observer of the run
//! through [`Passing`]: it is compiled once for a number of coordinates, and not for every model.

use super::{Broken, Left, Observe, Pieces, Planned, Side, Solver, left};
use crate::error::RunErrorKind;
use crate::length::Length;
use crate::simulation::acting;
use crate::simulation::events::act::After;
use crate::simulation::events::model::EventModel;
use crate::simulation::events::searched::Searched;
use crate::simulation::events::{Cut, Events, Origin, Passage, Severed};
use crate::simulation::kind::Simulated;
use std::ops::ControlFlow;
use tfe_runtime::dual::Dual;
use tfe_runtime::enclosure::Enclosure;
use tfe_runtime::step::Impulse;
use tfe_runtime::transition::TransitionError;

/// A run that passes an element, with its observer, without the type of its model.
trait Passing<'m, const N: usize, L: Length<N>>: Searched<N, L> {
    /// Advances a state over a piece.
    fn advance(&mut self, piece: &Planned<'_, N>, state: &mut L::State)
    -> Result<(), RunErrorKind>;

    /// The polynomial of the piece that was solved last.
    fn inside(&mut self, piece: &Planned<'_, N>) -> L::Polynomial;

    /// Applies those of the impulses, from the first on, that act at a time; returns their number.
    fn kick_at(&self, impulses: &[Impulse<N>], at: (f64, f64), state: &mut L::State) -> usize;

    /// Continues with the model made last, in which these parameters were set.
    fn go_on_with(&mut self, values: &[(usize, f64)]) -> Result<(), RunErrorKind>;

    /// Whether the observer takes the polynomial of every piece.
    fn keeps(&self) -> bool;

    /// Gives the observer the polynomial of a piece.
    fn keep(&mut self, dense: L::Polynomial);

    /// Reuses the memory of a polynomial that is no longer needed.
    fn reuse(&mut self, dense: L::Polynomial);

    /// Tells the observer of a piece that was not cut, with the states at its ends.
    fn tell(
        &mut self,
        piece: &Planned<'_, N>,
        ends: (&L::State, &L::State),
    ) -> Result<(), RunErrorKind>;

    /// Tells the observer of an event that only records.
    fn tell_met(&mut self, severed: &Severed<'_, 'm, N, L>) -> Result<(), TransitionError>;

    /// Tells the observer of an event that cuts the element.
    fn tell_cut(&mut self, severed: &Severed<'_, 'm, N, L>) -> Result<(), TransitionError>;

    /// Tells the observer of the node on one side of an event.
    fn tell_node(&mut self, side: Side, at: (f64, &L::State));

    /// Tells the observer of the end of the element; returns whether the run continues.
    fn tell_end(&mut self, t: f64, state: &L::State) -> ControlFlow<()>;
}

/// The [`Passing`] of a model.
struct Run<'p, 'm, M: 'm, const N: usize, L: Length<N>> {
    solver: &'p mut Solver<'m, M, N, L>,
    stepper: &'p mut L::Stepper<'m, M>,
    observer: &'p mut dyn Observe<'m, M, N, L>,
}

impl<M, const N: usize, L> Searched<N, L> for Run<'_, '_, M, N, L>
where
    M: Simulated<N, L>,
    L: Length<N>,
{
    fn model(&self) -> &dyn EventModel<N, L> {
        &*self.solver.model
    }

    fn remodel(&mut self, values: &[(usize, f64)]) -> bool {
        let Solver { model, remodel, .. } = &*self.solver;
        self.solver.next = remodel.and_then(|remodel| remodel(model, values));
        self.solver.next.is_some()
    }

    fn next_model(&self) -> &dyn EventModel<N, L> {
        let Solver { model, next, .. } = &*self.solver;
        &**next.as_ref().unwrap_or(model)
    }

    fn reach(&mut self, bounds: &mut Vec<(f64, f64)>) -> bool {
        M::reach(self.stepper, bounds)
    }

    fn reaches_within(&mut self, bounds: &[(f64, f64)]) -> bool {
        M::reaches_within(self.stepper, bounds)
    }

    fn outputs_within(&self, bounds: &[Enclosure], values: &mut [Enclosure]) -> bool {
        self.solver.model.outputs_within(bounds, values)
    }

    fn outputs_along(&self, piece: &L::Polynomial, values: &mut [Enclosure]) {
        self.solver.model.outputs_along(piece, values);
    }

    fn outputs_over(
        &self,
        piece: &L::Polynomial,
        part: (f64, f64),
        values: &mut [Dual<Enclosure>],
    ) {
        self.solver.model.outputs_over(piece, part, values);
    }

    fn solved(
        &mut self,
        element: (f64, f64),
        before: &L::State,
        impulses: &[Impulse<N>],
        nodes: (f64, f64),
    ) -> Option<(L::State, L::Polynomial)> {
        let solver = &mut *self.solver;
        let mut probe = match solver.probe.take() {
            Some(probe) => probe,
            None => M::stepper(solver.model.clone(), solver.chosen).ok()?,
        };
        let mut state = before.clone();
        M::advance(&mut probe, element, &mut state, impulses).ok()?;
        let inside = M::inside(&mut probe, None, nodes);
        solver.probe = Some(probe);
        Some((state, inside))
    }
}

impl<'m, M, const N: usize, L> Passing<'m, N, L> for Run<'_, 'm, M, N, L>
where
    M: Simulated<N, L>,
    L: Length<N>,
{
    fn advance(
        &mut self,
        piece: &Planned<'_, N>,
        state: &mut L::State,
    ) -> Result<(), RunErrorKind> {
        self.solver.advance(self.stepper, piece, state)
    }

    fn inside(&mut self, piece: &Planned<'_, N>) -> L::Polynomial {
        self.solver.inside(self.stepper, piece)
    }

    fn kick_at(&self, impulses: &[Impulse<N>], at: (f64, f64), state: &mut L::State) -> usize {
        self.solver.model.kick_at(impulses, at, state)
    }

    fn go_on_with(&mut self, values: &[(usize, f64)]) -> Result<(), RunErrorKind> {
        let Some(model) = self.solver.next.take() else {
            return Ok(());
        };
        self.observer.set(&model)?;
        M::exchange(self.stepper, model.clone())?;
        self.solver.exchange = Some(M::exchange);
        self.solver.probe = None;
        self.observer.changed(&model, values);
        self.solver.model = model;
        Ok(())
    }

    fn keeps(&self) -> bool {
        self.observer.keeps()
    }

    fn keep(&mut self, dense: L::Polynomial) {
        self.observer.inside(dense);
    }

    fn reuse(&mut self, dense: L::Polynomial) {
        self.solver.spare = Some(dense);
    }

    fn tell(
        &mut self,
        piece: &Planned<'_, N>,
        ends: (&L::State, &L::State),
    ) -> Result<(), RunErrorKind> {
        Pieces::tell(self.stepper, piece, ends, self.observer)
    }

    fn tell_met(&mut self, severed: &Severed<'_, 'm, N, L>) -> Result<(), TransitionError> {
        self.observer.met(severed)
    }

    fn tell_cut(&mut self, severed: &Severed<'_, 'm, N, L>) -> Result<(), TransitionError> {
        self.observer.cut(severed)
    }

    fn tell_node(&mut self, side: Side, at: (f64, &L::State)) {
        self.observer
            .at_event(self.stepper, &self.solver.model, side, at);
        if side != Side::After {
            self.observer.acted();
        }
    }

    fn tell_end(&mut self, t: f64, state: &L::State) -> ControlFlow<()> {
        self.observer.reached(self.stepper, t, state)
    }
}

impl<'m, M, const N: usize, L> Pieces<'m, M, N, L>
where
    M: Simulated<N, L>,
    L: Length<N>,
{
    /// Advances a state to the end of an element, or to the event that ends the run; looks for events.
    pub(in crate::simulation) fn pass_searching(
        &mut self,
        stepper: &mut L::Stepper<'m, M>,
        planned: Planned<'_, N>,
        state: &mut L::State,
        observer: &mut dyn Observe<'m, M, N, L>,
    ) -> Result<Left, Box<Broken<N, L>>> {
        let mut run = Run {
            solver: &mut self.solver,
            stepper,
            observer,
        };
        pass(&mut self.events, &mut run, planned, state)
    }
}

/// Advances a state to the end of an element, or to the event that ends the run.
fn pass<'m, const N: usize, L: Length<N>>(
    events: &mut Events<'m, N, L>,
    run: &mut dyn Passing<'m, N, L>,
    planned: Planned<'_, N>,
    state: &mut L::State,
) -> Result<Left, Box<Broken<N, L>>> {
    let Planned { t, next, h, .. } = planned;
    events.begin(h);
    // The rest of the element behind its last event.
    let (mut from, mut length) = (t, h);
    // The number of impulses that have acted. Those at the start act here, so that events see their effect; except
    // under constraints, which react to them inside the element.
    let mut acted = match run.model().is_constrained() {
        true => 0,
        false => run.kick_at(planned.impulses, (t, h), state),
    };
    loop {
        if from != t {
            acted = acted.max(acting::behind(planned.impulses, from, h));
        }
        let piece = Planned {
            t: from,
            h: length,
            begin: from + (planned.begin - t),
            impulses: &planned.impulses[acted..],
            ..planned
        };
        let before = state.clone();
        let is_due = events.has_due();
        let cut = match is_due {
            true => pass_due(events, run, piece, state),
            false => pass_piece(events, run, piece, state),
        };
        let cut = match cut {
            Ok(cut) => cut,
            Err(kind) => return Err(Broken::in_piece(kind, (from, length), before)),
        };
        let Some(cut) = cut else {
            if is_due && from != next {
                continue;
            }
            return Ok(left(run.tell_end(next, state)));
        };
        let passed = cut.length_from(from, h);
        let Cut {
            t: time,
            at,
            inside,
            after,
            ..
        } = cut;
        if let Some(dense) = inside.filter(|_| run.keeps()) {
            run.keep(dense);
        }
        let side = match after {
            Some(_) => Side::Before,
            None => Side::Last,
        };
        run.tell_node(side, (time, &at));
        let Some(After {
            state: mut after,
            set,
        }) = after
        else {
            *state = at;
            return Ok(Left::Stopped);
        };
        if let Some(values) = set {
            let changed = run.go_on_with(&values);
            changed.map_err(Broken::<N, L>::elsewhere)?;
            events.forget_bounds();
        }
        let good = run.model().check_restart(time, length, &after);
        good.map_err(Broken::<N, L>::elsewhere)?;
        if time == next {
            // Impulses at the end of the run have no later piece to act in.
            acted = acted.max(acting::behind(planned.impulses, next, h));
            let ahead = &planned.impulses[acted..];
            acted += run.kick_at(ahead, (next, h), &mut after);
        }
        run.tell_node(Side::After, (time, &after));
        *state = after;
        if time != next {
            length -= passed;
        } else if !events.has_due() {
            return Ok(left(run.tell_end(next, state)));
        }
        from = time;
    }
}

/// Meets the events that are due at the start of a piece, after another event has cut the element, up to the first that
/// ends a piece.
fn pass_due<'m, const N: usize, L: Length<N>>(
    events: &mut Events<'m, N, L>,
    run: &mut dyn Passing<'m, N, L>,
    piece: Planned<'_, N>,
    state: &L::State,
) -> Result<Option<Cut<N, L>>, RunErrorKind> {
    let cut = events.meet_due(run, piece.t, state)?;
    let origin = Origin {
        t: piece.t,
        begin: piece.t,
        before: state,
        impulses: &[],
    };
    tell_of_events(events, run, &piece, &origin, cut.as_ref())?;
    Ok(cut)
}

/// Advances a state to the end of a piece, or to the event that cuts it.
fn pass_piece<'m, const N: usize, L: Length<N>>(
    events: &mut Events<'m, N, L>,
    run: &mut dyn Passing<'m, N, L>,
    piece: Planned<'_, N>,
    state: &mut L::State,
) -> Result<Option<Cut<N, L>>, RunErrorKind> {
    let Planned { t, h, .. } = piece;
    let before = state.clone();
    run.advance(&piece, state)?;
    let keeps = run.keeps();
    let looks = !events.stays_clear(run, (t, h));
    // Before the transition matrix is computed, which uses the same memory.
    let dense = match keeps || looks {
        true => Some(run.inside(&piece)),
        false => None,
    };
    if let Some(dense) = dense.as_ref().filter(|_| looks) {
        let arc = Passage {
            t,
            begin: piece.begin,
            h,
            before: &before,
            after: state,
            dense,
            impulses: piece.impulses,
        };
        let cut = events.pass(run, &arc)?;
        tell_of_events(events, run, &piece, &arc.origin(), cut.as_ref())?;
        if cut.is_some() {
            return Ok(cut);
        }
    }
    run.tell(&piece, (&before, state))?;
    match dense {
        Some(dense) if keeps => run.keep(dense),
        Some(unneeded) => run.reuse(unneeded),
        None => {}
    }
    Ok(None)
}

/// Tells the observer of the events in a piece: those that did not end it, and that which has cut it.
fn tell_of_events<'m, const N: usize, L: Length<N>>(
    events: &Events<'m, N, L>,
    run: &mut dyn Passing<'m, N, L>,
    piece: &Planned<'_, N>,
    origin: &Origin<'_, N, L>,
    cut: Option<&Cut<N, L>>,
) -> Result<(), RunErrorKind> {
    for severed in events.gone_by(origin) {
        piece.followed(run.tell_met(&severed))?;
    }
    match cut {
        Some(cut) => piece.followed(run.tell_cut(&events.severed(origin, cut))),
        None => Ok(()),
    }
}
