//! The record of a run of a model of run-time length, from which its derivatives are computed.

use super::acting;
use super::events::{Severed, Watched};
use super::follow::{Follow, Passed};
use super::rounding::roundings;
use super::setup::Simulation;
use crate::error::{RunError, RunErrorKind};
use crate::evaluate::Evaluate;
use crate::length::{Length, RunTimeLength};
use crate::motion::{Event, Motion, Node};
use crate::numbers::{larger, largest};
use std::convert::identity;
use std::ops::{ControlFlow, Range};
use tfe_runtime::Share;
use tfe_runtime::family::{self, FamilyState};
use tfe_runtime::transition::TransitionError;

/// The part of an error message about runs that have no derivatives.
pub(super) const LONG_STEPS: &str =
    "models of run-time length where steps were so long that they were cut";

/// An element of the run, or the part of one up to an event; the feature `sparse` is needed to solve it again.
#[cfg_attr(not(feature = "sparse"), expect(dead_code))]
pub(super) struct Element {
    /// The index of the element of the grid.
    pub(super) number: usize,
    /// The start of the element as solved; a few ulps after a break.
    pub(super) t: f64,
    pub(super) h: f64,
    /// The times of its start and its end.
    pub(super) nodes: (f64, f64),
    pub(super) before: FamilyState,
    after: FamilyState,
    /// Whether an event precedes the element, and whether one ends it, so that its start or its end moves in time.
    pub(super) moves: (bool, bool),
}

/// The states around impulses on a model with constraints, which react to a part of them at once.
#[cfg_attr(not(feature = "sparse"), expect(dead_code))]
pub(super) struct Kicked {
    /// The start of the element at which they act, as solved.
    pub(super) t: f64,
    /// The state before them.
    pub(super) before: FamilyState,
    /// The state with the whole impulses added to its momentum.
    pub(super) with: FamilyState,
}

impl Element {
    /// Checks that the element, solved again, ends where it did, within the tolerance of the iteration.
    #[cfg(feature = "sparse")]
    pub(super) fn check<M: family::Model>(
        &self,
        model: &M,
        again: &FamilyState,
        tolerance: f64,
    ) -> Result<(), family::OperatorError> {
        let (place, ends) = ((self.t, self.h), (&self.before, &self.after));
        match is_same::<M, 0, RunTimeLength>(model, place, again, ends, tolerance) {
            true => Ok(()),
            false => Err(family::OperatorError::Cut),
        }
    }
}

/// Whether an element or a motion over a time `h` that was solved again from `start` ends at `end` as before. The
/// agreement asked for is far closer than that of two different solutions. Differences are relative to the larger one
/// of start and end, since the motion may come to rest or pass the origin; both solutions may have the error of the
/// tolerance. In an equilibrium all numbers may be rounding errors of forces.
pub(super) fn is_same<M, const N: usize, L>(
    model: &M,
    (t, h): (f64, f64),
    again: &L::State,
    (start, end): (&L::State, &L::State),
    tolerance: f64,
) -> bool
where
    M: Evaluate<N, L>,
    L: Length<N>,
{
    const SAME: f64 = 1e-9;
    /// In tolerances: both solutions have an error, and the tolerance may be relative to a larger component.
    const LEFT: f64 = 4.0;

    let same = SAME.max(LEFT * tolerance);
    let near = |again: &L::Vector, start: &L::Vector, end: &L::Vector, least: f64| {
        let (again, start, end) = (again.as_ref(), start.as_ref(), end.as_ref());
        let most = larger(same * larger(largest(start), largest(end)), least);
        let mut pairs = again.iter().zip(end);
        pairs.all(|(a, b)| (a - b).abs() <= most)
    };
    let both = |(least_q, least_p): (f64, f64)| {
        let (again, start, end) = (L::parts(again), L::parts(start), L::parts(end));
        near(again.0, start.0, end.0, least_q) && near(again.1, start.1, end.1, least_p)
    };
    both((0.0, 0.0)) || both(roundings::<M, N, L>(model, (t, h), start))
}

/// An event that has cut an element: an owned copy of [`Severed`].
#[cfg_attr(not(feature = "sparse"), expect(dead_code))]
pub(super) struct Cut<'m> {
    /// The index of the element of the grid.
    pub(super) element: usize,
    start: f64,
    begin: f64,
    length: f64,
    step: f64,
    before: FamilyState,
    inside: bool,
    watched: Watched<'m, 0, RunTimeLength>,
    which: usize,
    event: Event<0, RunTimeLength>,
    number: usize,
    goes_on: bool,
}

impl<'m> Cut<'m> {
    fn of(severed: &Severed<'_, 'm, 0, RunTimeLength>, element: usize) -> Self {
        Self {
            element,
            start: severed.start,
            begin: severed.begin,
            length: severed.length,
            step: severed.step,
            before: severed.before.clone(),
            inside: severed.inside,
            watched: severed.watched.clone(),
            which: severed.which,
            event: severed.event.clone(),
            number: severed.number,
            goes_on: severed.goes_on,
        }
    }

    #[cfg(feature = "sparse")]
    pub(super) fn severed(&self) -> Severed<'_, 'm, 0, RunTimeLength> {
        Severed {
            start: self.start,
            begin: self.begin,
            length: self.length,
            step: self.step,
            before: &self.before,
            impulses: &[],
            inside: self.inside,
            watched: &self.watched,
            which: self.which,
            event: &self.event,
            number: self.number,
            goes_on: self.goes_on,
        }
    }
}

/// A record of what happened between two elements.
#[cfg_attr(not(feature = "sparse"), expect(dead_code))]
pub(super) enum Between<'m, M> {
    /// A recorded node, by its index in [`Motion::states`].
    Node(usize),
    /// Impulses at the start of the next element.
    Kicked(Box<Kicked>),
    /// An event that cut the element before it, or that fell on the start of the next element.
    Cut(Box<Cut<'m>>),
    /// The action at that event has been performed.
    Acted,
    /// The model whose parameters were set at that event.
    Set(Share<'m, M>),
}

/// The elements so far, and the records between them.
pub(super) struct Trail<'m, M> {
    pub(super) elements: Vec<Element>,
    /// Records with the number of elements before them. Nodes are recorded only if they are asked for.
    pub(super) between: Vec<(usize, Between<'m, M>)>,
    keeps_nodes: bool,
    /// The number of nodes so far.
    nodes: usize,
    /// The number of elements of the grid so far.
    reached: usize,
    /// Whether an event precedes the next element.
    is_moved: bool,
    /// Whether an event fell on the end of the last element of the grid.
    ends_moved: bool,
    /// The impulses, and the state at the last node, which is kept only for a model with constraints.
    impulses: Vec<(f64, Vec<f64>)>,
    last: FamilyState,
}

impl<'m, M: family::Model> Trail<'m, M> {
    pub(super) fn new() -> Self {
        Self {
            elements: Vec::new(),
            between: Vec::new(),
            keeps_nodes: false,
            nodes: 0,
            reached: 0,
            is_moved: false,
            ends_moved: false,
            impulses: Vec::new(),
            last: FamilyState::default(),
        }
    }

    /// A trail that tells where the recorded nodes are.
    pub(super) fn with_nodes() -> Self {
        Self {
            keeps_nodes: true,
            ..Self::new()
        }
    }

    /// Refuses impulses at the start of an element if an event fell on the same node, since the time of the event
    /// changes and that of the impulse does not.
    fn check_kick(
        &mut self,
        element: (f64, f64),
        before: &FamilyState,
    ) -> Result<(), TransitionError> {
        if !std::mem::take(&mut self.ends_moved) {
            return Ok(());
        }
        let mut p = before.p.clone();
        match acting::kick(&self.impulses, element, &mut p) {
            true => Err(TransitionError::MovedImpulse { time: element.0 }),
            false => Ok(()),
        }
    }

    fn add(&mut self, between: Between<'m, M>) {
        self.between.push((self.elements.len(), between));
    }

    /// Records the impulses at the start of an element of the grid that is solved from time `t` on, if there are any.
    fn add_kick(&mut self, element: (f64, f64), t: f64) {
        // Behind an event there are none.
        if self.is_moved || !self.reacts() {
            return;
        }
        let mut with = self.last.clone();
        if acting::kick(&self.impulses, element, &mut with.p) {
            let before = self.last.clone();
            self.add(Between::Kicked(Box::new(Kicked { t, before, with })));
        }
    }

    /// Whether there are constraints that react to impulses.
    fn reacts(&self) -> bool {
        M::CONSTRAINED && !self.impulses.is_empty()
    }

    /// The error of a call for derivatives of this motion, if its elements cannot be solved again in the same way.
    fn refusal(motion: &Motion<0, RunTimeLength>, call: &'static str) -> Option<RunErrorKind> {
        let of = if motion.statistics().cuts > 0 {
            LONG_STEPS
        } else if motion.statistics().kinks > 0 {
            "models of run-time length whose steps are cut at kinks"
        } else {
            return None;
        };
        Some(RunErrorKind::Unsupported { call, of })
    }
}

impl<'m, M: family::Model> Simulation<'m, M, 0, RunTimeLength> {
    /// Runs over the span and records the elements, for a call that solves them again.
    ///
    /// # Errors
    /// Those of the run, and [`RunErrorKind::Unsupported`] if the call has no derivatives of this motion.
    pub(super) fn trailed(
        &self,
        call: &'static str,
        start: FamilyState,
        span: &Range<f64>,
        mut trail: Trail<'m, M>,
    ) -> Result<(Motion<0, RunTimeLength>, Trail<'m, M>), RunError<0, RunTimeLength>> {
        let refused = |of: &'static str| {
            let motion = Motion::unasked(span.start, &start);
            RunError::new(RunErrorKind::Unsupported { call, of }, motion)
        };
        if !cfg!(feature = "sparse") {
            let of = "models of run-time length without the feature `sparse`";
            return Err(refused(of));
        }
        trail.impulses.clone_from(&self.impulses);
        if const { M::CONSTRAINED } {
            trail.last.clone_from(&start);
        }
        let mut motion = self.drive(start, span, identity, Some(&mut trail))?;
        self.warn_of_kinks(&mut motion);
        match Trail::<M>::refusal(&motion, call) {
            Some(kind) => Err(RunError::new(kind, motion)),
            None => Ok((motion, trail)),
        }
    }
}

impl<'m, M: family::Model + 'm> Follow<'m, M, 0, RunTimeLength> for Trail<'m, M> {
    fn passed(
        &mut self,
        _: &mut family::Stepper<'m, M>,
        passed: &Passed<'_, 0, RunTimeLength>,
    ) -> Result<(), TransitionError> {
        let at = (passed.t, passed.h);
        self.check_kick(at, passed.before)?;
        self.add_kick(at, passed.begin);
        if self.reacts() {
            self.last.clone_from(passed.after);
        }
        self.elements.push(Element {
            number: self.reached,
            t: passed.begin,
            h: passed.h,
            nodes: (passed.t, passed.t + passed.h),
            before: passed.before.clone(),
            after: passed.after.clone(),
            moves: (self.is_moved, false),
        });
        self.is_moved = false;
        Ok(())
    }

    fn cut(&mut self, severed: &Severed<'_, 'm, 0, RunTimeLength>) -> Result<(), TransitionError> {
        let at = (severed.start, severed.step);
        self.check_kick(at, severed.before)?;
        self.add_kick(at, severed.begin);
        if severed.inside {
            self.elements.push(Element {
                number: self.reached,
                t: severed.begin,
                h: severed.length,
                nodes: (severed.start, severed.event.t),
                before: severed.before.clone(),
                after: severed.event.state(),
                moves: (self.is_moved, true),
            });
        }
        self.is_moved = true;
        self.add(Between::Cut(Box::new(Cut::of(severed, self.reached))));
        Ok(())
    }

    fn acted(&mut self) {
        self.add(Between::Acted);
    }

    fn set(&mut self, model: &Share<'m, M>) -> Result<(), RunErrorKind> {
        self.add(Between::Set(model.clone()));
        Ok(())
    }

    fn reached(
        &mut self,
        _: &mut family::Stepper<'m, M>,
        _: f64,
        _: &FamilyState,
    ) -> ControlFlow<()> {
        self.reached += 1;
        self.ends_moved = self.is_moved;
        ControlFlow::Continue(())
    }

    fn recorded(&mut self, _: &Node<0, RunTimeLength>) {
        if self.keeps_nodes {
            self.add(Between::Node(self.nodes));
        }
        self.nodes += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::is_same;
    use crate::length::FixedLength;
    use crate::{State, dynamics};

    /// A body on a spring that is stretched by `lead` where x = 0.
    #[dynamics(coordinates(x), lagrangian = m/2*dot(x)^2 - k/2*(x + lead)^2 + m*g*x)]
    struct Hanging {
        m: f64,
        k: f64,
        lead: f64,
        g: f64,
    }

    fn compare(model: &Hanging, again: [f64; 2], start: [f64; 2], end: [f64; 2]) -> bool {
        let state = |[x, p]: [f64; 2]| State { q: [x], p: [p] };
        let (again, start, end) = (state(again), state(start), state(end));
        is_same::<Hanging, 1, FixedLength>(model, (0.0, 0.1), &again, (&start, &end), 0.0)
    }

    #[test]
    fn other_ends_are_told_in_all_units() {
        let free = Hanging {
            m: 1.0,
            k: 1.0,
            lead: 0.0,
            g: 0.0,
        };
        for size in [1.0, 1e-20, 1e-150, 1e20] {
            let of = |x: f64, p: f64| {
                let (start, end) = ([size, 0.0], [0.5 * size, -0.8 * size]);
                compare(&free, [x * size, p * size], start, end)
            };
            assert!(of(0.5, -0.8) && of(0.5 + 1e-12, -0.8 - 1e-12), "{size:e}");
            assert!(!of(0.5 + 1e-6, -0.8) && !of(0.5, -0.8 + 1e-6), "{size:e}");
            assert!(!of(f64::NAN, -0.8), "{size:e}");
        }
    }

    /// The weight and the spring cancel but for a rounding error, and all numbers are such errors.
    #[test]
    fn equilibria_end_where_they_begin() {
        let hanging = Hanging {
            m: 1.0,
            k: 10.0,
            lead: 0.981,
            g: 9.81,
        };
        for (again, is_same) in [([2e-19, -3e-17], true), ([0.0, 1e-9], false)] {
            let found = compare(&hanging, again, [0.0; 2], [1e-19, 1e-17]);
            assert_eq!(found, is_same, "{again:?}");
        }
    }
}
