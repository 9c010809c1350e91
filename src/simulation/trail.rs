//! What a run of a model of run-time length leaves behind for its derivatives.

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

/// What has no derivatives.
pub(super) const LONG_STEPS: &str =
    "models of run-time length where steps were so long that they were cut";

/// An element that was passed; whoever solves it once more needs the feature `sparse`.
#[cfg_attr(not(feature = "sparse"), expect(dead_code))]
pub(super) struct Element {
    /// Where it was begun.
    pub(super) t: f64,
    pub(super) h: f64,
    pub(super) before: FamilyState,
    after: FamilyState,
    /// An impulse before it, of a model with constraints.
    pub(super) kicked: Option<Kicked>,
}

/// Where impulses acted on a model with constraints, which take up a part of them at once.
#[cfg_attr(not(feature = "sparse"), expect(dead_code))]
pub(super) struct Kicked {
    /// The state before.
    pub(super) before: FamilyState,
    /// Its momentum with the impulses, none of them taken up yet.
    pub(super) with: FamilyState,
}

impl Element {
    /// The state of the node where it begins: before impulses.
    #[cfg(feature = "sparse")]
    pub(super) fn node(&self) -> &FamilyState {
        self.kicked
            .as_ref()
            .map_or(&self.before, |kicked| &kicked.before)
    }

    /// Whether it ends where it did, now that it is solved once more; it was left at a tolerance.
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

/// Whether elements that are solved once more, from the first state, end in the second as they did, to many more digits than two roots of their equations have in common. The first one tells, too, of what
/// roundings are a part: a motion may come to rest at the end, or pass its origin. Iterations may leave a tolerance of either.
pub(super) fn is_same<const N: usize, L: Length<N>>(
    again: &L::State,
    (start, end): (&L::State, &L::State),
    tolerance: f64,
) -> bool {
    const SAME: f64 = 1e-9;
    /// Of the tolerance: both are off by one, and it is that of a larger number beside them.
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

/// The elements passed so far, and the recorded nodes.
#[derive(Default)]
pub(super) struct Trail {
    pub(super) elements: Vec<Element>,
    /// With how many elements there were before them; kept where they are asked for.
    pub(super) nodes: Vec<(usize, Node<0, RunTimeLength>)>,
    keeps_nodes: bool,
    /// An event has ended an element.
    is_cut: bool,
    /// The impulses of a model with constraints, and the state at the last node.
    impulses: Vec<(f64, Vec<f64>)>,
    last: FamilyState,
}

impl Trail {
    /// One that keeps recorded nodes.
    pub(super) fn with_nodes() -> Self {
        Self {
            keeps_nodes: true,
            ..Self::default()
        }
    }

    /// The impulses at the node where an element begins.
    fn kicked(&mut self, passed: &Passed<'_, 0, RunTimeLength>) -> Option<Kicked> {
        let before = std::mem::replace(&mut self.last, passed.after.clone());
        let mut with = before.clone();
        let at = (passed.start, passed.h);
        acting::kick(&self.impulses, at, &mut with.p).then_some(Kicked { before, with })
    }

    /// Why a call has no derivatives of this motion: its elements are not those that are solved once more.
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
    /// Runs over the span and leaves a trail, for a call that solves the elements once more.
    ///
    /// # Errors
    /// Those of the run, and [`RunErrorKind::Unsupported`] where that call has no derivatives.
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
