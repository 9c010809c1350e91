//! The record of a run of a model of run-time length, from which its derivatives are computed.

use super::acting;
use super::events::Severed;
use super::follow::{Follow, Passed};
use super::setup::Simulation;
use crate::error::{RunError, RunErrorKind};
use crate::length::{Length, RunTimeLength};
use crate::motion::{Motion, Node};
use std::convert::identity;
use std::ops::Range;
use tfe_runtime::family::{self, FamilyState};
use tfe_runtime::transition::TransitionError;

/// The part of an error message about runs that have no derivatives.
pub(super) const LONG_STEPS: &str =
    "models of run-time length where steps were so long that they were cut";

/// An element of the run; the feature `sparse` is needed to solve it again.
#[cfg_attr(not(feature = "sparse"), expect(dead_code))]
pub(super) struct Element {
    /// The start of the element as solved; a few ulps after a break.
    pub(super) t: f64,
    pub(super) h: f64,
    pub(super) before: FamilyState,
    after: FamilyState,
    /// The impulse at its start, for a model with constraints.
    pub(super) kicked: Option<Kicked>,
}

/// The states around an impulse on a model with constraints, which react to a part of it at once.
#[cfg_attr(not(feature = "sparse"), expect(dead_code))]
pub(super) struct Kicked {
    /// The state before the impulse.
    pub(super) before: FamilyState,
    /// The state with the whole impulse added to its momentum.
    pub(super) with: FamilyState,
}

impl Element {
    /// The state of the node at which the element begins, before impulses.
    #[cfg(feature = "sparse")]
    pub(super) fn node(&self) -> &FamilyState {
        self.kicked
            .as_ref()
            .map_or(&self.before, |kicked| &kicked.before)
    }

    /// Checks that the element, solved again, ends where it did, within the tolerance of the iteration.
    #[cfg(feature = "sparse")]
    pub(super) fn check(
        &self,
        again: &FamilyState,
        tolerance: f64,
    ) -> Result<(), family::OperatorError> {
        match is_same::<0, RunTimeLength>(again, (&self.before, &self.after), tolerance) {
            true => Ok(()),
            false => Err(family::OperatorError::Cut),
        }
    }
}

/// Whether an element or a motion that was solved again from `start` ends at `end` as before. The agreement asked for
/// is far closer than that of two different solutions. Differences are relative to the larger one of start and end,
/// since the motion may come to rest or pass the origin; both solutions may have the error of the tolerance.
pub(super) fn is_same<const N: usize, L: Length<N>>(
    again: &L::State,
    (start, end): (&L::State, &L::State),
    tolerance: f64,
) -> bool {
    const SAME: f64 = 1e-9;
    /// In tolerances: both solutions have an error, and the tolerance may be relative to a larger component.
    const LEFT: f64 = 4.0;

    let same = SAME.max(LEFT * tolerance);
    let near = |again: &L::Vector, start: &L::Vector, end: &L::Vector| {
        let (again, start, end) = (again.as_ref(), start.as_ref(), end.as_ref());
        let both = start.iter().chain(end);
        let largest = both.fold(0.0_f64, |m, x| m.max(x.abs()));
        let mut pairs = again.iter().zip(end);
        pairs.all(|(a, b)| (a - b).abs() <= same * largest.max(1e-6))
    };
    let (again, start, end) = (L::parts(again), L::parts(start), L::parts(end));
    near(again.0, start.0, end.0) && near(again.1, start.1, end.1)
}

/// The elements so far, and the recorded nodes.
#[derive(Default)]
pub(super) struct Trail {
    pub(super) elements: Vec<Element>,
    /// Nodes with the number of elements before them, if they are kept.
    pub(super) nodes: Vec<(usize, Node<0, RunTimeLength>)>,
    keeps_nodes: bool,
    /// Whether an event has ended an element.
    is_cut: bool,
    /// The impulses on a model with constraints, and the state at the last node.
    impulses: Vec<(f64, Vec<f64>)>,
    last: FamilyState,
}

impl Trail {
    /// A trail that keeps the recorded nodes.
    pub(super) fn with_nodes() -> Self {
        Self {
            keeps_nodes: true,
            ..Self::default()
        }
    }

    /// The states around the impulses at the start of an element, if there are any.
    fn kicked(&mut self, passed: &Passed<'_, 0, RunTimeLength>) -> Option<Kicked> {
        let before = std::mem::replace(&mut self.last, passed.after.clone());
        let mut with = before.clone();
        let at = (passed.start, passed.h);
        acting::kick(&self.impulses, at, &mut with.p).then_some(Kicked { before, with })
    }

    /// The error of a call for derivatives of this motion, if its elements cannot be solved again in the same way.
    fn refusal(
        &self,
        motion: &Motion<0, RunTimeLength>,
        call: &'static str,
    ) -> Option<RunErrorKind> {
        let of = if self.is_cut || motion.arcs().count() > 1 {
            "models of run-time length whose events change the state or end the run"
        } else if motion.statistics().cuts > 0 {
            LONG_STEPS
        } else if motion.statistics().kinks > 0 {
            "models of run-time length whose steps are cut at kinks"
        } else {
            return None;
        };
        Some(RunErrorKind::Unsupported { call, of })
    }
}

impl<M: family::Model> Simulation<'_, M, 0, RunTimeLength> {
    /// Runs over the span and records the elements, for a call that solves them again.
    ///
    /// # Errors
    /// Those of the run, and [`RunErrorKind::Unsupported`] if the call has no derivatives of this motion.
    pub(super) fn trailed(
        &self,
        call: &'static str,
        start: FamilyState,
        span: &Range<f64>,
        mut trail: Trail,
    ) -> Result<(Motion<0, RunTimeLength>, Trail), RunError<0, RunTimeLength>> {
        let refused = |of: &'static str| {
            let motion = Motion::unasked(span.start, &start);
            RunError::new(RunErrorKind::Unsupported { call, of }, motion)
        };
        if !cfg!(feature = "sparse") {
            let of = "models of run-time length without the feature `sparse`";
            return Err(refused(of));
        }
        if const { M::CONSTRAINED } {
            trail.impulses.clone_from(&self.impulses);
            trail.last.clone_from(&start);
        }
        let motion = self.drive(start, span, identity, Some(&mut trail))?;
        match trail.refusal(&motion, call) {
            Some(kind) => Err(RunError::new(kind, motion)),
            None => Ok((motion, trail)),
        }
    }
}

impl<'m, M: family::Model + 'm> Follow<'m, M, 0, RunTimeLength> for Trail {
    fn passed(
        &mut self,
        _: &mut family::Stepper<'m, M>,
        passed: &Passed<'_, 0, RunTimeLength>,
    ) -> Result<(), TransitionError> {
        let kicked = if self.impulses.is_empty() {
            None
        } else {
            self.kicked(passed)
        };
        self.elements.push(Element {
            t: passed.begin,
            h: passed.h,
            before: passed.before.clone(),
            after: passed.after.clone(),
            kicked,
        });
        Ok(())
    }

    fn cut(&mut self, _: &Severed<'_, 'm, 0, RunTimeLength>) -> Result<(), TransitionError> {
        self.is_cut = true;
        Ok(())
    }

    fn recorded(&mut self, node: &Node<0, RunTimeLength>) {
        if self.keeps_nodes {
            self.nodes.push((self.elements.len(), node.clone()));
        }
    }
}
