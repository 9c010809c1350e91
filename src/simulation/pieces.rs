//! Passes one element of the grid of a run; events may cut it into pieces.

mod searching;

use super::events::Events;
use super::events::remodel::Remodel;
use super::follow::{Follow, Passed};
use super::kind::{Chosen, Simulated};
use super::mesh::Mesh;
use crate::error::RunErrorKind;
use crate::length::{FixedLength, Length};
use std::ops::ControlFlow;
use tfe_runtime::Share;
use tfe_runtime::step::Impulse;
use tfe_runtime::transition::TransitionError;

/// An element of the grid that is to be solved.
#[derive(Clone, Copy)]
pub(super) struct Planned<'a, const N: usize> {
    pub(super) number: usize,
    /// The times of its nodes.
    pub(super) t: f64,
    pub(super) next: f64,
    pub(super) h: f64,
    /// The start from which the times of points are counted.
    pub(super) begin: f64,
    pub(super) impulses: &'a [Impulse<N>],
}

impl<const N: usize> Planned<'_, N> {
    /// What a follower returned, as a result of the run: without a transition matrix it cannot follow further.
    fn followed(&self, told: Result<(), TransitionError>) -> Result<(), RunErrorKind> {
        told.map_err(|source| RunErrorKind::Transition {
            element: self.number,
            time: self.t,
            step: self.h,
            source,
        })
    }
}

/// The elements of a mesh, after those that are done.
pub(super) fn planned<const N: usize>(
    mesh: &Mesh<N>,
    done: usize,
) -> impl Iterator<Item = Planned<'_, N>> {
    let count = mesh.steps();
    let elements = mesh.elements().enumerate().skip(done);
    elements.map(move |(number, (t, next, h))| Planned {
        number,
        t,
        next,
        h,
        begin: mesh.begin(t, h),
        impulses: mesh.impulses_in(t, next, number + 1 == count),
    })
}

/// Which side of an event a node is on.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Side {
    /// Before an event after which the run continues.
    Before,
    After,
    /// At the event that ends the run.
    Last,
}

/// An observer of what happens in an element.
pub(super) trait Observe<'m, M: 'm, const N: usize, L: Length<N> = FixedLength>:
    Follow<'m, M, N, L>
{
    /// Whether the observer takes the polynomial of every piece.
    fn keeps(&self) -> bool;

    /// Called after a piece that was not cut.
    fn whole(&mut self, _stepper: &L::Stepper<'m, M>, _passed: &Passed<'_, N, L>) {}

    /// Called with the polynomial of a piece if [`keeps`](Self::keeps).
    fn inside(&mut self, _dense: L::Polynomial) {}

    /// Called at the nodes before and after an event.
    fn at_event(
        &mut self,
        stepper: &mut L::Stepper<'m, M>,
        model: &M,
        side: Side,
        at: (f64, &L::State),
    );

    /// Called with the parameters, by their indices, that were set at the time of the next node.
    fn changed(&mut self, _model: &Share<'m, M>, _values: &[(usize, f64)]) {}
}

/// How an element was left.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Left {
    /// At its end.
    Done,
    /// At an event that ends the run, or at its end if a follower ends the run there.
    Stopped,
}

fn left(goes_on: ControlFlow<()>) -> Left {
    match goes_on {
        ControlFlow::Continue(()) => Left::Done,
        ControlFlow::Break(()) => Left::Stopped,
    }
}

/// The failure of an element.
#[derive(Debug)]
pub(super) struct Broken<const N: usize, L: Length<N> = FixedLength> {
    pub(super) kind: RunErrorKind,
    /// Start, length and initial state of the piece that failed; `None` if a state after an event cannot be used.
    pub(super) piece: Option<(f64, f64, L::State)>,
}

impl<const N: usize, L: Length<N>> Broken<N, L> {
    /// The failure of no known piece.
    fn elsewhere(kind: RunErrorKind) -> Box<Self> {
        Box::new(Self { kind, piece: None })
    }

    /// The failure of a piece, given by its start and length, and its initial state.
    fn in_piece(kind: RunErrorKind, (start, h): (f64, f64), before: L::State) -> Box<Self> {
        let piece = Some((start, h, before));
        Box::new(Self { kind, piece })
    }

    /// How an element from `t` on was left; `None` stands for a user function that has panicked in it.
    pub(super) fn unless_panicked(
        passed: Option<Result<Left, Box<Self>>>,
        t: f64,
    ) -> Result<Left, Box<Self>> {
        passed.unwrap_or_else(|| Err(Self::elsewhere(RunErrorKind::panicked(t))))
    }
}

/// [`Pieces::pass_searching`]; called through a pointer, so that the search for events is only compiled for models that
/// are used with events.
pub(super) type Search<'m, M, const N: usize, L> = fn(
    &mut Pieces<'m, M, N, L>,
    &mut <L as Length<N>>::Stepper<'m, M>,
    Planned<'_, N>,
    &mut <L as Length<N>>::State,
    &mut dyn Observe<'m, M, N, L>,
) -> Result<Left, Box<Broken<N, L>>>;

/// [`Simulated::exchange`]; called through a pointer for the same reason.
type Exchange<'m, M, const N: usize, L> =
    fn(&mut <L as Length<N>>::Stepper<'m, M>, Share<'m, M>) -> Result<(), RunErrorKind>;

/// What solves the elements of a run, and those that end at events.
pub(super) struct Solver<'m, M: 'm, const N: usize, L: Length<N> = FixedLength> {
    /// The model with the parameters set by events so far.
    model: Share<'m, M>,
    /// Creates models with changed parameters, if an event can ask for it.
    remodel: Option<Remodel<'m, M>>,
    /// The model that an event has asked for, until the run continues with it.
    next: Option<Share<'m, M>>,
    /// Known once events have set parameters.
    exchange: Option<Exchange<'m, M, N, L>>,
    /// The element and the control of the steps that locate events; those of the run.
    chosen: Chosen,
    /// The stepper that locates events; separate from that of the run.
    probe: Option<L::Stepper<'m, M>>,
    /// The memory of a polynomial that was not kept.
    spare: Option<L::Polynomial>,
}

/// Solves elements and looks for events in them.
pub(super) struct Pieces<'m, M: 'm, const N: usize, L: Length<N> = FixedLength> {
    solver: Solver<'m, M, N, L>,
    pub(super) events: Events<'m, N, L>,
    /// `None` in a run without events.
    search: Option<Search<'m, M, N, L>>,
}

impl<'m, M, const N: usize, L> Solver<'m, M, N, L>
where
    M: Simulated<N, L>,
    L: Length<N>,
{
    pub(super) fn new(
        model: Share<'m, M>,
        remodel: Option<Remodel<'m, M>>,
        chosen: Chosen,
    ) -> Self {
        Self {
            model,
            remodel,
            next: None,
            exchange: None,
            chosen,
            probe: None,
            spare: None,
        }
    }

    /// Advances a state over a piece.
    fn advance(
        &self,
        stepper: &mut L::Stepper<'m, M>,
        piece: &Planned<'_, N>,
        state: &mut L::State,
    ) -> Result<(), RunErrorKind> {
        let Planned { number, t, h, .. } = *piece;
        M::advance(stepper, (piece.begin, h), state, piece.impulses).map_err(|source| {
            let why = (self.chosen.at_kinks, source);
            self.model.failed(number, (t, h), why)
        })
    }

    /// The polynomial of the piece that was solved last.
    fn inside(&mut self, stepper: &mut L::Stepper<'m, M>, piece: &Planned<'_, N>) -> L::Polynomial {
        M::inside(stepper, self.spare.take(), (piece.t, piece.next))
    }
}

impl<'m, M, const N: usize, L> Pieces<'m, M, N, L>
where
    M: Simulated<N, L>,
    L: Length<N>,
{
    pub(super) fn new(
        solver: Solver<'m, M, N, L>,
        events: Events<'m, N, L>,
        search: Option<Search<'m, M, N, L>>,
    ) -> Self {
        Self {
            solver,
            events,
            search,
        }
    }

    /// The model with the parameters set by events so far.
    pub(super) fn model(&self) -> &Share<'m, M> {
        &self.solver.model
    }

    /// Gives a stepper the model of the start again, if events have set parameters.
    pub(super) fn restore(
        &self,
        stepper: &mut L::Stepper<'m, M>,
        model: &Share<'m, M>,
    ) -> Result<(), RunErrorKind> {
        match self.solver.exchange {
            Some(exchange) => exchange(stepper, model.clone()),
            None => Ok(()),
        }
    }

    /// Advances a state to the end of an element, or to the event that ends the run.
    pub(super) fn pass(
        &mut self,
        stepper: &mut L::Stepper<'m, M>,
        planned: Planned<'_, N>,
        state: &mut L::State,
        observer: &mut dyn Observe<'m, M, N, L>,
    ) -> Result<Left, Box<Broken<N, L>>> {
        if let Some(search) = self.search {
            return search(self, stepper, planned, state, observer);
        }
        let before = state.clone();
        match self.pass_whole(stepper, &planned, &before, state, observer) {
            Ok(()) => Ok(left(observer.reached(stepper, planned.next, state))),
            Err(kind) => Err(Broken::in_piece(kind, (planned.t, planned.h), before)),
        }
    }

    /// Advances a state to the end of an element in which no events are looked for.
    fn pass_whole(
        &mut self,
        stepper: &mut L::Stepper<'m, M>,
        planned: &Planned<'_, N>,
        before: &L::State,
        state: &mut L::State,
        observer: &mut dyn Observe<'m, M, N, L>,
    ) -> Result<(), RunErrorKind> {
        self.solver.advance(stepper, planned, state)?;
        // Before the transition matrix is computed, which uses the same memory.
        let dense = match observer.keeps() {
            true => Some(self.solver.inside(stepper, planned)),
            false => None,
        };
        Self::tell(stepper, planned, (before, state), observer)?;
        if let Some(dense) = dense {
            observer.inside(dense);
        }
        Ok(())
    }

    /// Tells the observer of a piece that was not cut, with the states at its ends.
    fn tell(
        stepper: &mut L::Stepper<'m, M>,
        piece: &Planned<'_, N>,
        (before, after): (&L::State, &L::State),
        observer: &mut dyn Observe<'m, M, N, L>,
    ) -> Result<(), RunErrorKind> {
        let Planned { t, h, begin, .. } = *piece;
        let passed = Passed {
            t,
            begin,
            h,
            before,
            after,
            has_impulses: !piece.impulses.is_empty(),
        };
        piece.followed(observer.passed(stepper, &passed))?;
        observer.whole(stepper, &passed);
        Ok(())
    }
}
