//! The endless sequence of states.

mod family;

use super::checks::conserves_energy;
use super::course::{Course, Leg};
use super::follow::{Follow, Passed};
use super::kind::Stepped;
use super::mesh::{self, Endless};
use super::pieces::{Left, Observe, Piece, Pieces, Planned, Side};
use super::watch::resolution::{Again, Examined, Resolution};
use super::watch::{Recorded, Watch};
use crate::error::RunErrorKind;
use crate::length::FixedLength;
use crate::motion::Warning;
use crate::motion::{Event, Node};
use std::collections::VecDeque;
use std::fmt;
use tfe_runtime::step::{Impulse, Stepper};
use tfe_runtime::transition::TransitionError;
use tfe_runtime::{Model, Share, State, Statistics};

/// The endless sequence of states of [`Simulation::steps`](crate::Simulation::steps).
pub struct Steps<'m, M: 'm, const N: usize, L: Stepped<M, N> = FixedLength> {
    pub(super) way: Way<'m, M, N, L>,
    /// Of the last node, from where the next is looked for.
    velocity: L::Vector,
    /// Nodes at events that are to be told yet.
    nodes: VecDeque<Result<Node<N, L>, RunErrorKind>>,
    pub(super) watch: Watch,
    /// Of models of fixed size.
    resolution: Option<Resolution<'m, M, N>>,
}

impl<'m, M, const N: usize, L: Stepped<M, N>> fmt::Debug for Steps<'m, M, N, L> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Steps")
            .field("time", &self.way.course.time())
            .field("state", &self.way.state)
            .finish_non_exhaustive()
    }
}

/// A stepper with its state on an endless course.
pub(super) struct Way<'m, M: 'm, const N: usize, L: Stepped<M, N> = FixedLength> {
    /// As it was at first.
    model: L::Held<'m, M>,
    pub(super) course: Course<L::Stepper<'m>>,
    pub(super) state: L::State,
    pub(super) impulses: Vec<L::Impulse>,
    /// None where no events are looked for.
    pub(super) pieces: Option<Box<Pieces<'m, M, N>>>,
    /// Of a course that has ended.
    statistics: Statistics,
}

/// The beginning of a course: a stepper, its elements, and what looks for events.
pub(super) type Beginning<'m, M, const N: usize> =
    Result<(Stepper<'m, M, N>, Endless, Option<Pieces<'m, M, N>>), RunErrorKind>;

impl<'m, M: Model<N>, const N: usize> Way<'m, M, N> {
    pub(super) fn new(
        model: Share<'m, M>,
        beginning: Beginning<'m, M, N>,
        start: State<N>,
        impulses: Vec<Impulse<N>>,
    ) -> Self {
        let (way, pieces) = match beginning {
            Ok((stepper, elements, pieces)) => (Ok((stepper, elements)), pieces.map(Box::new)),
            Err(kind) => (Err(kind), None),
        };
        Self {
            pieces,
            ..Self::along(model, Course::new(way), start, impulses)
        }
    }

    /// The next element, looked into for events; none after the end.
    pub(super) fn pass(
        &mut self,
        observer: &mut impl Observe<'m, M, N>,
    ) -> Option<Result<(Left, f64), RunErrorKind>> {
        let Self {
            model,
            course,
            state,
            impulses,
            pieces,
            statistics,
        } = self;
        let Some(pieces) = pieces.as_mut() else {
            return course.failure().map(Err);
        };
        pieces.events.met.clear();
        let advance = |stepper: &mut Stepper<'m, M, N>, leg: &Leg| {
            let impulses = acting(impulses, leg);
            let (t, next) = leg.nodes;
            let planned = Planned {
                number: leg.number,
                t,
                next,
                h: leg.h,
                begin: leg.begin,
                impulses: &impulses,
            };
            let left = model.guarded(|| pieces.pass(stepper, planned, state, observer));
            let left = left.map_err(|_| RunErrorKind::panicked(t))?;
            left.map(|left| (left, next)).map_err(|broken| broken.kind)
        };
        let passed = course.next(advance, |stepper| *statistics = *stepper.statistics());
        if let Some(Ok((Left::Stopped, _))) = passed {
            course.stop(|stepper| *statistics = *stepper.statistics());
        }
        passed
    }
}

impl<'m, M, const N: usize, L: Stepped<M, N>> Way<'m, M, N, L> {
    /// Without a look for events.
    pub(super) fn along(
        model: L::Held<'m, M>,
        course: Course<L::Stepper<'m>>,
        state: L::State,
        impulses: Vec<L::Impulse>,
    ) -> Self {
        Self {
            model,
            course,
            state,
            impulses,
            pieces: None,
            statistics: Statistics::default(),
        }
    }

    pub(super) fn statistics(&self) -> Statistics {
        match self.course.stepper() {
            Some(stepper) => *L::statistics(stepper),
            None => self.statistics,
        }
    }
}

/// The impulses that act in an element.
fn acting<const N: usize>(impulses: &[Impulse<N>], leg: &Leg) -> Vec<Impulse<N>> {
    let (t, next) = leg.nodes;
    let acts = |impulse: &&Impulse<N>| mesh::within(impulse.time, t, next);
    impulses.iter().filter(acts).copied().collect()
}

impl<'m, M, const N: usize, L: Stepped<M, N>> Steps<'m, M, N, L> {
    /// What the steps so far have cost.
    pub fn statistics(&self) -> Statistics {
        self.way.statistics()
    }
}

impl<'m, M: Model<N>, const N: usize> Steps<'m, M, N> {
    pub(super) fn new(
        model: Share<'m, M>,
        beginning: Beginning<'m, M, N>,
        start: State<N>,
        t0: f64,
        impulses: Vec<Impulse<N>>,
        again: Again<'m, M>,
    ) -> Self {
        let way = Way::new(model, beginning, start, impulses);
        let mut watch = Watch::new(again.element);
        let mut velocity = [0.0; N];
        if let Some(stepper) = way.course.stepper() {
            let node = Node::new(stepper.model(), t0, &start, &velocity);
            velocity = node.v;
            watch.pass(Recorded::of(stepper.model(), &node, false));
            watch.weigh(stepper.model(), t0, (&node.q, &node.v));
        }
        Self {
            way,
            velocity,
            nodes: VecDeque::new(),
            watch,
            resolution: Some(Resolution::new(again)),
        }
    }

    /// The model, unless the steps have ended.
    pub(super) fn model(&self) -> Option<&M> {
        self.way.course.stepper().map(Stepper::model)
    }

    /// The node from which the next step goes, unless the steps have ended.
    pub(super) fn node(&self) -> Option<Node<N>> {
        let t = self.way.course.time()?;
        Some(Node {
            t,
            q: self.way.state.q,
            p: self.way.state.p,
            v: self.velocity,
        })
    }

    /// What is doubtful about the steps so far without being an error, as [`Motion::warnings`](crate::Motion::warnings) tells it of a run. Where events are looked for, neither jumps of
    /// the energy nor unstable steps are.
    pub fn warnings(&self) -> Vec<Warning> {
        let mut warnings = self.watch.warnings().to_vec();
        let resolution = self.resolution.as_ref();
        warnings.extend(resolution.and_then(|one| one.warning(&self.way.state)));
        warnings
    }

    /// The [events](crate::Simulation::on) met in the step that led to the node given last, in their order. Where a step has several nodes, because events changed the state, they come
    /// with the first of them.
    pub fn events(&self) -> &[Event<N>] {
        (self.way.pieces.as_ref()).map_or(&[], |pieces| &pieces.events.met)
    }

    /// A step that is looked into for events.
    fn look(&mut self) {
        let mut observer = Nodes {
            nodes: &mut self.nodes,
            velocity: &mut self.velocity,
            last: f64::NAN,
            watch: &mut self.watch,
            resolution: self.resolution.as_mut(),
        };
        match self.way.pass(&mut observer) {
            None | Some(Ok((Left::Stopped, _))) => {}
            Some(Err(kind)) => self.nodes.push_back(Err(kind)),
            Some(Ok((Left::Done, next))) => {
                if observer.last != next
                    && let Some(stepper) = self.way.course.stepper()
                {
                    let state = self.way.state;
                    observer.push(stepper.model(), next, &state);
                }
            }
        }
    }
}

impl<M: Model<N>, const N: usize> Iterator for Steps<'_, M, N> {
    type Item = Result<Node<N>, RunErrorKind>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.way.pieces.is_some() {
            if self.nodes.is_empty() {
                self.look();
            }
            return self.nodes.pop_front();
        }
        let Way {
            model,
            course,
            state,
            impulses,
            statistics,
            ..
        } = &mut self.way;
        let (watch, resolution) = (&mut self.watch, self.resolution.as_mut());
        let velocity = &mut self.velocity;
        let advance = |stepper: &mut Stepper<'_, M, N>, leg: &Leg| {
            let impulses = acting(impulses, leg);
            let (before, (t, next)) = (*state, leg.nodes);
            watch.look(stepper.model(), leg.number, (t, leg.h), &before);
            let passed = model.guarded(|| {
                stepper.advance(leg.begin, leg.h, state, &impulses)?;
                Ok(Node::new(stepper.model(), next, state, velocity))
            });
            let node = match passed {
                Ok(Ok(node)) => node,
                Ok(Err(source)) => {
                    watch.examine(stepper.model(), leg.number, (t, leg.h), &before);
                    let at = (t, leg.h);
                    return Err(RunErrorKind::of_element(&**model, leg.number, at, source));
                }
                Err(_) => return Err(RunErrorKind::panicked(t)),
            };
            *velocity = node.v;
            if let Some(resolution) = resolution
                && impulses.is_empty()
            {
                let examined = Examined {
                    t,
                    h: leg.h,
                    before: &before,
                    after: state,
                };
                resolution.look(stepper.statistics(), examined);
            }
            let is_conserved = impulses.is_empty() && const { conserves_energy::<M, N>() };
            watch.pass(Recorded::of(stepper.model(), &node, is_conserved));
            Ok(node)
        };
        course.next(advance, |stepper| *statistics = *stepper.statistics())
    }
}

/// Lines up the nodes of an element.
struct Nodes<'a, 'm, M, const N: usize> {
    nodes: &'a mut VecDeque<Result<Node<N>, RunErrorKind>>,
    velocity: &'a mut [f64; N],
    /// The time of the last one.
    last: f64,
    watch: &'a mut Watch,
    resolution: Option<&'a mut Resolution<'m, M, N>>,
}

impl<M: Model<N>, const N: usize> Nodes<'_, '_, M, N> {
    fn push(&mut self, model: &M, t: f64, state: &State<N>) {
        let node = Node::new(model, t, state, self.velocity);
        // Acts change the energy.
        self.watch.pass(Recorded::of(model, &node, false));
        (*self.velocity, self.last) = (node.v, t);
        self.nodes.push_back(Ok(node));
    }
}

impl<'m, M: Model<N>, const N: usize> Follow<'m, M, N> for Nodes<'_, 'm, M, N> {
    fn passed(
        &mut self,
        _: &mut Stepper<'m, M, N>,
        _: &Passed<'_, N>,
    ) -> Result<(), TransitionError> {
        Ok(())
    }
}

impl<'m, M: Model<N>, const N: usize> Observe<'m, M, N> for Nodes<'_, 'm, M, N> {
    fn keeps(&self) -> bool {
        false
    }

    fn whole(&mut self, stepper: &Stepper<'m, M, N>, piece: &Piece<'_, N>) {
        if !piece.has_impulses {
            let examined = Examined {
                t: piece.start,
                h: piece.h,
                before: piece.before,
                after: piece.after,
            };
            if let Some(resolution) = &mut self.resolution {
                resolution.look(stepper.statistics(), examined);
            }
        }
    }

    fn changed(&mut self, model: &Share<'m, M>, _: &[(usize, f64)]) {
        if let Some(resolution) = &mut self.resolution {
            resolution.set_model(model.clone());
        }
    }

    fn at_event(&mut self, stepper: &Stepper<'m, M, N>, side: Side, t: f64, state: &State<N>) {
        if side == Side::After || self.last != t {
            self.push(stepper.model(), t, state);
        }
    }
}
