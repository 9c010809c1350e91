//! The endless sequence of states.

use super::mesh::{self, Endless};
use crate::error::RunErrorKind;
use crate::motion::Node;
use tfe_runtime::step::{Impulse, Stepper};
use tfe_runtime::{Model, State, Statistics};

/// The endless sequence of states of [`Simulation::steps`](crate::Simulation::steps).
#[derive(Debug)]
pub struct Steps<'m, M, const N: usize> {
    course: Result<Course<'m, M, N>, Option<RunErrorKind>>,
    state: State<N>,
    /// Of the last node, from where the next is looked for.
    velocity: [f64; N],
    element: usize,
    impulses: Vec<Impulse<N>>,
    statistics: Statistics,
}

/// What goes on until a step fails.
type Course<'m, M, const N: usize> = (Stepper<'m, M, N>, Endless);

impl<'m, M: Model<N>, const N: usize> Steps<'m, M, N> {
    pub(super) fn new(
        course: Result<Course<'m, M, N>, RunErrorKind>,
        start: State<N>,
        t0: f64,
        impulses: Vec<Impulse<N>>,
    ) -> Self {
        let node =
            |(stepper, _): &Course<'m, M, N>| Node::new(stepper.model(), t0, &start, &[0.0; N]);
        let velocity = course.as_ref().map_or([0.0; N], |course| node(course).v);
        Self {
            course: course.map_err(Some),
            state: start,
            velocity,
            element: 0,
            impulses,
            statistics: Statistics::default(),
        }
    }

    /// What the steps so far have cost.
    pub fn statistics(&self) -> Statistics {
        match &self.course {
            Ok((stepper, _)) => *stepper.statistics(),
            Err(_) => self.statistics,
        }
    }
}

impl<M: Model<N>, const N: usize> Iterator for Steps<'_, M, N> {
    type Item = Result<Node<N>, RunErrorKind>;

    fn next(&mut self) -> Option<Self::Item> {
        let (stepper, elements) = match &mut self.course {
            Ok(course) => course,
            Err(failure) => return failure.take().map(Err),
        };
        let (t, next, h, begin) = elements.element();
        let acts = |impulse: &&Impulse<N>| mesh::within(impulse.time, t, next);
        let impulses: Vec<_> = self.impulses.iter().filter(acts).copied().collect();
        if let Err(source) = stepper.advance(begin, h, &mut self.state, &impulses) {
            self.statistics = *stepper.statistics();
            self.course = Err(None);
            return Some(Err(RunErrorKind::Solve {
                element: self.element,
                time: t,
                step: h,
                source,
            }));
        }
        elements.advance();
        self.element += 1;
        let node = Node::new(stepper.model(), next, &self.state, &self.velocity);
        self.velocity = node.v;
        Some(Ok(node))
    }
}
