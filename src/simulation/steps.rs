//! The endless sequence of states.

use super::course::{Course, Leg};
use super::mesh::{self, Endless};
use crate::error::RunErrorKind;
use crate::motion::Node;
use tfe_runtime::step::{Impulse, Stepper};
use tfe_runtime::{Model, State, Statistics};

/// The endless sequence of states of [`Simulation::steps`](crate::Simulation::steps).
#[derive(Debug)]
pub struct Steps<'m, M, const N: usize> {
    course: Course<Stepper<'m, M, N>>,
    state: State<N>,
    /// Of the last node, from where the next is looked for.
    velocity: [f64; N],
    impulses: Vec<Impulse<N>>,
    /// Of a course that has ended.
    statistics: Statistics,
}

impl<'m, M: Model<N>, const N: usize> Steps<'m, M, N> {
    pub(super) fn new(
        way: Result<(Stepper<'m, M, N>, Endless), RunErrorKind>,
        start: State<N>,
        t0: f64,
        impulses: Vec<Impulse<N>>,
    ) -> Self {
        let course = Course::new(way);
        let node = |stepper: &Stepper<'m, M, N>| Node::new(stepper.model(), t0, &start, &[0.0; N]);
        let velocity = course.stepper().map_or([0.0; N], |stepper| node(stepper).v);
        Self {
            course,
            state: start,
            velocity,
            impulses,
            statistics: Statistics::default(),
        }
    }

    /// The model, unless the steps have ended.
    pub(super) fn model(&self) -> Option<&M> {
        self.course.stepper().map(Stepper::model)
    }

    /// The node from which the next step goes, unless the steps have ended.
    pub(super) fn node(&self) -> Option<Node<N>> {
        let t = self.course.time()?;
        Some(Node {
            t,
            q: self.state.q,
            p: self.state.p,
            v: self.velocity,
        })
    }

    /// What the steps so far have cost.
    pub fn statistics(&self) -> Statistics {
        match self.course.stepper() {
            Some(stepper) => *stepper.statistics(),
            None => self.statistics,
        }
    }
}

impl<M: Model<N>, const N: usize> Iterator for Steps<'_, M, N> {
    type Item = Result<Node<N>, RunErrorKind>;

    fn next(&mut self) -> Option<Self::Item> {
        let Self {
            course,
            state,
            velocity,
            impulses,
            statistics,
        } = self;
        let advance = |stepper: &mut Stepper<'_, M, N>, leg: Leg| {
            let (t, next) = leg.nodes;
            let acts = |impulse: &&Impulse<N>| mesh::within(impulse.time, t, next);
            let impulses: Vec<_> = impulses.iter().filter(acts).copied().collect();
            stepper.advance(leg.begin, leg.h, state, &impulses)?;
            let node = Node::new(stepper.model(), next, state, velocity);
            *velocity = node.v;
            Ok(node)
        };
        course.next(advance, |stepper| *statistics = *stepper.statistics())
    }
}
