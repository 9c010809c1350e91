//! The endless sequence of nodes of a run.

use super::follow::{Follow, Passed};
use super::kind::Simulated;
use super::mesh::in_order;
use super::pieces::{Left, Observe, Pieces, Planned, Side};
use super::resolution::{Again, Resolution};
use super::sequence::ElementSequence;
use super::times::Endless;
use super::watch::{Recorded, Watch};
use crate::error::RunErrorKind;
use crate::length::{FixedLength, Length};
use crate::motion::{Event, Node, Warning};
use std::collections::VecDeque;
use std::fmt;
use tfe_runtime::Share;
use tfe_runtime::Statistics;

/// An endless iterator over the nodes of a motion, made by [`Simulation::steps`](crate::Simulation::steps). Each item
/// is a [`Node`], or the [`RunErrorKind`] after which it ends.
pub struct Steps<'m, M: 'm, const N: usize, L: Length<N> = FixedLength> {
    endless: EndlessRun<'m, M, N, L>,
    /// The velocity of the last node: the first guess for that of the next.
    velocity: L::Vector,
    /// Nodes at events that are still to be returned.
    nodes: VecDeque<Result<Node<N, L>, RunErrorKind>>,
    rows: Rows,
    watch: Watch,
    resolution: Resolution<'m, M, N, L>,
}

impl<M, const N: usize, L: Length<N>> fmt::Debug for Steps<'_, M, N, L> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Steps")
            .field("time", &self.endless.sequence.time())
            .field("state", &self.endless.state)
            .finish_non_exhaustive()
    }
}

/// A stepper and its state in an endless run.
pub(super) struct EndlessRun<'m, M: 'm, const N: usize, L: Length<N> = FixedLength> {
    /// The model at the start.
    model: Share<'m, M>,
    pub(super) sequence: ElementSequence<L::Stepper<'m, M>>,
    pub(super) state: L::State,
    /// In the order in which the run passes them.
    impulses: Vec<L::Impulse>,
    /// `None` if no events are looked for.
    pub(super) pieces: Option<Box<Pieces<'m, M, N, L>>>,
    /// The work of a run that has ended.
    statistics: Statistics,
}

/// The beginning of an endless run: its stepper, its elements, and the search for events.
pub(super) type Beginning<'m, M, const N: usize, L> = Result<
    (
        <L as Length<N>>::Stepper<'m, M>,
        Endless,
        Option<Pieces<'m, M, N, L>>,
    ),
    RunErrorKind,
>;

impl<'m, M, const N: usize, L> EndlessRun<'m, M, N, L>
where
    M: Simulated<N, L>,
    L: Length<N>,
{
    pub(super) fn new(
        model: Share<'m, M>,
        beginning: Beginning<'m, M, N, L>,
        start: L::State,
        mut impulses: Vec<L::Impulse>,
    ) -> Self {
        if let Ok((_, elements, _)) = &beginning {
            let (.., h, _) = elements.element();
            impulses = in_order(&impulses, M::time_of, h.signum());
        }
        let (endless, pieces) = match beginning {
            Ok((stepper, elements, pieces)) => (Ok((stepper, elements)), pieces.map(Box::new)),
            Err(kind) => (Err(kind), None),
        };
        Self {
            model,
            sequence: ElementSequence::new(endless),
            state: start,
            impulses,
            pieces,
            statistics: Statistics::default(),
        }
    }

    /// Solves the next element and looks for events in it; `None` after the end.
    pub(super) fn pass(
        &mut self,
        observer: &mut dyn Observe<'m, M, N, L>,
    ) -> Option<Result<(Left, f64), RunErrorKind>> {
        let Self {
            model,
            sequence,
            state,
            impulses,
            pieces,
            ..
        } = self;
        let Some(pieces) = pieces.as_mut() else {
            return sequence.failure().map(Err);
        };
        pieces.events.met.clear();
        let Some((stepper, element)) = sequence.begin() else {
            return sequence.failure().map(Err);
        };
        let (t, next) = element.nodes;
        pieces.model().kick(impulses, (t, element.h), state);
        let impulses = M::acting(impulses, element.nodes);
        let planned = Planned {
            number: element.number,
            t,
            next,
            h: element.h,
            begin: element.begin,
            impulses: &impulses,
        };
        let left = model.guarded(|| pieces.pass(stepper, planned, state, observer));
        let passed = match left {
            Some(Ok(left)) => Ok((left, next)),
            Some(Err(broken)) => Err(broken.kind),
            None => Err(RunErrorKind::panicked(t)),
        };
        self.end(matches!(passed, Ok((Left::Done, _))));
        Some(passed)
    }

    /// Goes on to the next element, or ends the sequence.
    fn end(&mut self, goes_on: bool) {
        if !goes_on && let Some(stepper) = self.sequence.stepper() {
            self.statistics = *M::statistics(stepper);
        }
        self.sequence.end(goes_on);
    }

    pub(super) fn statistics(&self) -> Statistics {
        match self.sequence.stepper() {
            Some(stepper) => *M::statistics(stepper),
            None => self.statistics,
        }
    }
}

impl<'m, M, const N: usize, L> Steps<'m, M, N, L>
where
    M: Simulated<N, L>,
    L: Length<N>,
{
    pub(super) fn new(
        model: Share<'m, M>,
        beginning: Beginning<'m, M, N, L>,
        (t0, start): (f64, L::State),
        impulses: Vec<L::Impulse>,
        again: Again<'m, M>,
    ) -> Self {
        let mut watch = Watch::new(again.chosen.element);
        let (q, _) = L::parts(&start);
        let mut velocity = L::zero(q);
        let mut endless = EndlessRun::new(model, beginning, start, impulses);
        let (model, state) = (&endless.model, &endless.state);
        if let Some(stepper) = endless.sequence.stepper_mut() {
            let node = M::node(stepper, model, (t0, state), &velocity);
            watch.pass(Recorded::of(&**model, &node, false), &|_| 0.0);
            watch.add(model.weigh(&node));
            velocity = node.v;
        }
        Self {
            endless,
            velocity,
            nodes: VecDeque::new(),
            rows: Rows::default(),
            watch,
            resolution: Resolution::new(again),
        }
    }

    /// Signs that the steps so far may be wrong although none failed, as [`Motion::warnings`](crate::Motion::warnings)
    /// gives for a run. If events are looked for, jumps of the energy and unstable step sizes are not checked.
    pub fn warnings(&self) -> Vec<Warning> {
        let mut warnings = self.watch.warnings().to_vec();
        warnings.extend(self.resolution.warning(&self.endless.state));
        if let Some(pieces) = &self.endless.pieces {
            warnings.extend(pieces.events.warnings());
        }
        warnings
    }

    /// The model with the parameters set by events so far.
    pub(super) fn model(&self) -> &M {
        match &self.endless.pieces {
            Some(pieces) => pieces.model(),
            None => &self.endless.model,
        }
    }

    /// The inputs of the model have other values from the next step on.
    pub(super) fn set_inputs(&mut self) {
        if let Some(pieces) = &mut self.endless.pieces {
            pieces.events.forget_bounds();
        }
    }

    /// From now on keeps the outputs of each node until it is returned, beginning with this node.
    pub(super) fn keep_outputs(&mut self, count: usize, node: &Node<N, L>) {
        let mut row = vec![0.0; count];
        if count > 0 {
            write_outputs(self.model(), node, &mut row);
        }
        self.rows.row = row;
    }

    /// Writes the outputs at the node returned last, with the model and the inputs of that time.
    pub(super) fn outputs(&self, last: &Node<N, L>, values: &mut [f64]) {
        match &self.endless.pieces {
            Some(_) => values.copy_from_slice(&self.rows.row),
            None => write_outputs(&*self.endless.model, last, values),
        }
    }

    /// The node at which the next step begins, unless the run has ended.
    pub(super) fn node(&self) -> Option<Node<N, L>> {
        let t = self.endless.sequence.time()?;
        Some(Node::of(t, &self.endless.state, self.velocity.clone()))
    }

    /// Counts of iterations, evaluations and factorisations of the steps so far.
    pub fn statistics(&self) -> Statistics {
        self.endless.statistics()
    }

    /// The [events](crate::Simulation::on) in the step that led to the node returned last, in order of time. If a step
    /// has several nodes because events changed the state, the events are given with the first of these nodes.
    pub fn events(&self) -> &[Event<N, L>] {
        (self.endless.pieces.as_ref()).map_or(&[], |pieces| &pieces.events.met)
    }

    /// Solves a step in which no events are looked for; `None` if the sequence has ended.
    fn pass_whole(&mut self) -> Option<Result<Node<N, L>, RunErrorKind>> {
        let EndlessRun {
            model,
            sequence,
            state,
            impulses,
            ..
        } = &mut self.endless;
        let (stepper, element) = sequence.begin()?;
        let ((t, next), at) = (element.nodes, (element.nodes.0, element.h));
        let is_kicked = model.kick(impulses, at, state);
        let impulses = M::acting(impulses, element.nodes);
        let has_impulses = is_kicked || !impulses.is_empty();
        let before = state.clone();
        model.look(&mut self.watch, element.number, at, &before, false);
        let velocity = &mut self.velocity;
        let passed = model.guarded(|| {
            M::advance(stepper, (element.begin, element.h), state, &impulses)?;
            Ok(M::node(stepper, model, (next, state), velocity))
        });
        let node = match passed {
            Some(Ok(node)) => node,
            Some(Err(source)) => {
                model.look(&mut self.watch, element.number, at, &before, true);
                let why = (self.resolution.chosen().at_kinks, source);
                return Some(Err(model.failed(element.number, at, why)));
            }
            None => return Some(Err(RunErrorKind::panicked(t))),
        };
        velocity.clone_from(&node.v);
        let passed = Passed {
            t,
            begin: element.begin,
            h: element.h,
            before: &before,
            after: state,
            has_impulses,
        };
        self.resolution.look(M::statistics(stepper), &passed);
        let is_conserved = !has_impulses && M::CONSERVES;
        let recorded = Recorded::of(&**model, &node, is_conserved);
        (self.watch).pass(recorded, &|time| model.rounding_at(&node, time));
        Some(Ok(node))
    }

    /// Solves a step and looks for events in it.
    fn look(&mut self) {
        let mut observer = Nodes {
            nodes: &mut self.nodes,
            rows: &mut self.rows,
            velocity: &mut self.velocity,
            last: f64::NAN,
            watch: &mut self.watch,
            resolution: &mut self.resolution,
        };
        match self.endless.pass(&mut observer) {
            None | Some(Ok((Left::Stopped, _))) => {}
            Some(Err(kind)) => self.nodes.push_back(Err(kind)),
            Some(Ok((Left::Done, next))) => {
                let EndlessRun {
                    sequence,
                    pieces,
                    state,
                    model,
                    ..
                } = &mut self.endless;
                let model = pieces.as_ref().map_or(&**model, |pieces| &**pieces.model());
                if observer.last != next
                    && let Some(stepper) = sequence.stepper_mut()
                {
                    observer.push(stepper, model, (next, state));
                }
            }
        }
    }
}

impl<M, const N: usize, L> Iterator for Steps<'_, M, N, L>
where
    M: Simulated<N, L>,
    L: Length<N>,
{
    type Item = Result<Node<N, L>, RunErrorKind>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.endless.pieces.is_some() {
            if self.nodes.is_empty() {
                self.look();
            }
            let told = self.nodes.pop_front();
            if matches!(told, Some(Ok(_))) {
                self.rows.pop();
            }
            return told;
        }
        match self.pass_whole() {
            Some(passed) => {
                self.endless.end(passed.is_ok());
                Some(passed)
            }
            None => self.endless.sequence.failure().map(Err),
        }
    }
}

/// The outputs of nodes that are still to be returned, if asked for.
#[derive(Default)]
struct Rows {
    /// The rows of outputs, concatenated.
    queued: VecDeque<f64>,
    /// The outputs of the node returned last; empty if outputs are not asked for.
    row: Vec<f64>,
}

impl Rows {
    /// Adds the outputs of a node that is returned after all others.
    fn push<M, const N: usize, L>(&mut self, model: &M, node: &Node<N, L>)
    where
        M: Simulated<N, L>,
        L: Length<N>,
    {
        if !self.row.is_empty() {
            write_outputs(model, node, &mut self.row);
            self.queued.extend(&self.row);
        }
    }

    /// Moves to the next node.
    fn pop(&mut self) {
        for value in &mut self.row {
            *value = self.queued.pop_front().unwrap_or(f64::NAN);
        }
    }
}

/// Writes the outputs at a node; NaN if they cannot be evaluated.
fn write_outputs<M, const N: usize, L>(model: &M, node: &Node<N, L>, values: &mut [f64])
where
    M: Simulated<N, L>,
    L: Length<N>,
{
    let at = (&node.q, &node.p);
    let seen = model.guarded(|| model.outputs(node.t, at, &node.v, values));
    if seen.is_none() {
        values.fill(f64::NAN);
    }
}

/// Collects the nodes of an element.
struct Nodes<'a, 'm, M, const N: usize, L: Length<N>> {
    nodes: &'a mut VecDeque<Result<Node<N, L>, RunErrorKind>>,
    rows: &'a mut Rows,
    velocity: &'a mut L::Vector,
    /// The time of the last node.
    last: f64,
    watch: &'a mut Watch,
    resolution: &'a mut Resolution<'m, M, N, L>,
}

impl<'m, M, const N: usize, L> Nodes<'_, 'm, M, N, L>
where
    M: Simulated<N, L>,
    L: Length<N>,
{
    fn push(&mut self, stepper: &mut L::Stepper<'m, M>, model: &M, at: (f64, &L::State)) {
        let node = M::node(stepper, model, at, self.velocity);
        // Actions change the energy.
        self.watch.pass(Recorded::of(model, &node, false), &|_| 0.0);
        self.velocity.clone_from(&node.v);
        self.last = node.t;
        self.rows.push(model, &node);
        self.nodes.push_back(Ok(node));
    }
}

impl<'m, M, const N: usize, L> Follow<'m, M, N, L> for Nodes<'_, 'm, M, N, L>
where
    M: 'm,
    L: Length<N>,
{
}

impl<'m, M, const N: usize, L> Observe<'m, M, N, L> for Nodes<'_, 'm, M, N, L>
where
    M: Simulated<N, L>,
    L: Length<N>,
{
    fn keeps(&self) -> bool {
        false
    }

    fn whole(&mut self, stepper: &L::Stepper<'m, M>, passed: &Passed<'_, N, L>) {
        self.resolution.look(M::statistics(stepper), passed);
    }

    fn changed(&mut self, model: &Share<'m, M>, _: &[(usize, f64)]) {
        self.resolution.set_model(model.clone());
    }

    fn at_event(
        &mut self,
        stepper: &mut L::Stepper<'m, M>,
        model: &M,
        side: Side,
        (t, state): (f64, &L::State),
    ) {
        if side == Side::After || self.last != t {
            self.push(stepper, model, (t, state));
        }
    }
}
