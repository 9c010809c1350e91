//! The same for models of run-time length.

use super::super::checks::conserves_energies;
use super::super::course::{Course, Leg};
use super::super::family::{kick, node};
use super::super::mesh::Endless;
use super::super::setup::Simulation;
use super::super::watch::{Recorded, Watch};
use super::{Steps, Way};
use crate::error::RunErrorKind;
use crate::length::RunTimeLength;
use crate::motion::{Node, Warning};
use std::collections::VecDeque;
use tfe_runtime::family::{FamilyModel, FamilyState, FamilyStepper};

impl<'m, M: FamilyModel> Simulation<'m, M, 0, RunTimeLength> {
    /// The states that follow `start`, one a step, without end and in constant memory. After an error the iterator is finished.
    pub fn steps(&self, start: FamilyState, t0: f64) -> Steps<'m, M, 0, RunTimeLength> {
        let mut watch = Watch::new(self.chosen_element());
        let step = self.step.unwrap_or(f64::NAN);
        let stepper = self.stepper(t0, &start).and_then(|(stepper, velocity)| {
            if !t0.is_finite() {
                let (start, end) = (t0, f64::INFINITY);
                return Err(RunErrorKind::Span { start, end });
            }
            let node = Node::of(t0, &start, velocity);
            watch.pass(Recorded::of(self.model, &node, false));
            Ok((stepper, Endless::new(t0, step, &self.breaks)?))
        });
        let (course, impulses) = (Course::new(stepper), self.impulses.clone());
        Steps {
            way: Way::along(self.model, course, start, impulses),
            velocity: Vec::new(),
            nodes: VecDeque::new(),
            watch,
            resolution: None,
        }
    }
}

impl<M: FamilyModel> Steps<'_, M, 0, RunTimeLength> {
    /// What is doubtful about the steps so far without being an error, as [`Motion::warnings`](crate::Motion::warnings) tells it of a run.
    pub fn warnings(&self) -> Vec<Warning> {
        self.watch.warnings().to_vec()
    }
}

impl<M: FamilyModel> Iterator for Steps<'_, M, 0, RunTimeLength> {
    type Item = Result<Node<0, RunTimeLength>, RunErrorKind>;

    fn next(&mut self) -> Option<Self::Item> {
        let Way {
            model,
            course,
            state,
            impulses,
            statistics,
            ..
        } = &mut self.way;
        let watch = &mut self.watch;
        let advance = |stepper: &mut FamilyStepper<'_, M>, leg: &Leg| {
            let (begin, next) = leg.nodes;
            let is_kicked = kick(impulses, begin, state);
            stepper
                .advance(leg.begin, leg.h, state)
                .map_err(|source| leg.failed(source))?;
            let node = node(stepper, next, state);
            let is_conserved = !is_kicked && const { conserves_energies::<M>() };
            watch.pass(Recorded::of(*model, &node, is_conserved));
            Ok(node)
        };
        course.next(advance, |stepper| *statistics = *stepper.statistics())
    }
}
