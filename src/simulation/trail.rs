//! What a run of a model of run-time length leaves behind for its derivatives.

use super::events::Severed;
use super::follow::{Follow, Passed};
use super::setup::Simulation;
use crate::error::{RunError, RunErrorKind};
use crate::length::RunTimeLength;
use crate::motion::{Motion, Node};
use std::convert::identity;
use std::ops::Range;
use tfe_runtime::family::{self, FamilyState};
use tfe_runtime::transition::TransitionError;

/// The elements passed so far, and the recorded nodes.
#[derive(Default)]
pub(super) struct Trail {
    /// Start, length, and the state before.
    pub(super) elements: Vec<(f64, f64, FamilyState)>,
    /// With how many elements there were before them; kept where they are asked for.
    pub(super) nodes: Vec<(usize, Node<0, RunTimeLength>)>,
    keeps_nodes: bool,
    /// An event has ended an element.
    is_cut: bool,
}

impl Trail {
    /// One that keeps recorded nodes.
    pub(super) fn with_nodes() -> Self {
        Self {
            keeps_nodes: true,
            ..Self::default()
        }
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
            "models of run-time length where steps were so long that they were cut"
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
            return Err(refused("models of run-time length with constraints"));
        }
        let motion = self.drive(start, span, identity, &mut trail)?;
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
        let element = (passed.start, passed.h, passed.before.clone());
        self.elements.push(element);
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
