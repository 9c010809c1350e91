//! Motions as they are recorded: from their start, node by node.

use super::arcs::Arcs;
use super::{Checkpoint, Event, Motion, Node, Outputs, Reached, Seen, Setting, Warning};
use crate::constraints::{ConstraintResidual, Reactions};
use crate::evaluate::Evaluate;
use crate::length::Length;
use tfe_runtime::{CoordinateName, Statistics};

impl<const N: usize, L: Length<N>> Motion<N, L> {
    /// A motion that consists of its start; of a model that does not pass its check nothing but the start is known.
    pub(crate) fn from_start<M>(model: &M, t: f64, start: &L::State) -> Self
    where
        M: Evaluate<N, L>,
    {
        if model.checked().is_err() {
            return Self::unasked(t, start);
        }
        let (_, p) = L::parts(start);
        let node = Node::new(model, t, start, &L::zero(p));
        Self::starting(model, node)
    }

    /// The same for a start whose velocity is known.
    pub(crate) fn starting<M: Evaluate<N, L>>(model: &M, node: Node<N, L>) -> Self {
        let mut motion = Self::empty(model);
        motion.record_node(model, node);
        motion
    }

    /// The same for a start whose reactions are known as well.
    pub(crate) fn starting_with<M>(model: &M, node: Node<N, L>, reactions: Vec<f64>) -> Self
    where
        M: Evaluate<N, L>,
    {
        let mut motion = Self::empty(model);
        motion.record_all(model, node, reactions);
        motion
    }

    /// The same for a model that cannot be evaluated at the start.
    pub(crate) fn unknown<M: Evaluate<N, L>>(model: &M, t: f64, start: &L::State) -> Self {
        Self::empty(model).with_unknown(t, start)
    }

    /// A motion without nodes with a first one of which only the state is known.
    fn with_unknown(mut self, t: f64, start: &L::State) -> Self {
        let (_, p) = L::parts(start);
        let v = L::unknown(p);
        self.nodes.push(Node::of(t, start, v.clone()));
        self.velocities.push(v);
        self.energies.push(f64::NAN);
        self.outputs.values = vec![f64::NAN; self.outputs.names.len()];
        self.reactions.values = vec![f64::NAN; self.reactions.names.len()];
        self
    }

    /// The start of a run that never began. The model is not evaluated, since its lengths or indices may not fit.
    pub(crate) fn unasked(t: f64, start: &L::State) -> Self {
        let (_, p) = L::parts(start);
        let nodes = vec![Node::of(t, start, L::unknown(p))];
        Self {
            nodes,
            ..Self::without_nodes(Vec::new(), Vec::new(), Vec::new())
        }
    }

    fn empty<M: Evaluate<N, L>>(model: &M) -> Self {
        Self::without_nodes(
            model.coordinate_names(),
            model.output_names(),
            model.constraint_names(),
        )
    }

    fn without_nodes(
        names: Vec<CoordinateName>,
        outputs: Vec<CoordinateName>,
        constraints: Vec<L::ConstraintName>,
    ) -> Self {
        Self {
            nodes: Vec::new(),
            velocities: Vec::new(),
            energies: Vec::new(),
            outputs: Outputs {
                names: outputs,
                values: Vec::new(),
            },
            residual: ConstraintResidual {
                position: 0.0,
                velocity: 0.0,
                rank: constraints.len(),
            },
            reactions: Reactions {
                names: constraints,
                values: Vec::new(),
            },
            elements: Vec::new(),
            statistics: Statistics::default(),
            warnings: Vec::new(),
            names,
            checkpoint: None,
            is_stopped: false,
            events: Vec::new(),
            arcs: Arcs::default(),
        }
    }

    /// Appends a node with its velocity, energy and outputs. These are NaN if the Legendre transform has no solution
    /// (singular mass matrix); the state itself is still valid.
    pub(crate) fn record<M: Evaluate<N, L>>(&mut self, model: &M, t: f64, state: &L::State) {
        let guess = self.guess(state);
        self.record_node(model, Node::new(model, t, state, &guess));
    }

    /// A guess of the velocity of a state: that of the last node.
    fn guess(&self, state: &L::State) -> L::Vector {
        match self.velocities.last() {
            Some(velocity) => velocity.clone(),
            None => L::zero(L::parts(state).1),
        }
    }

    /// The same if the velocity is known.
    #[inline(always)]
    pub(crate) fn record_node<M: Evaluate<N, L>>(&mut self, model: &M, node: Node<N, L>) {
        let reactions = match const { M::IS_CONSTRAINED } {
            true => model.reactions(node.t, (&node.q, &node.p), &node.v),
            false => Vec::new(),
        };
        self.record_all(model, node, reactions);
    }

    /// The same if the reactions are known as well.
    #[inline(always)]
    pub(crate) fn record_all<M>(&mut self, model: &M, node: Node<N, L>, reactions: Vec<f64>)
    where
        M: Evaluate<N, L>,
    {
        let place = self.push(node);
        let node = &self.nodes[place];
        let (t, at) = (node.t, (&node.q, &node.p));
        self.energies.push(model.energy(t, at, &node.v));
        if let Some(values) = self.outputs.new_row() {
            model.outputs(t, at, &node.v, values);
        }
        if const { M::IS_CONSTRAINED } {
            let residual = model.residual(t, &node.q, &node.v);
            self.hold(residual, reactions);
        }
    }

    /// Appends a node with its velocity; returns its index.
    fn push(&mut self, node: Node<N, L>) -> usize {
        self.velocities.push(node.v.clone());
        self.nodes.push(node);
        self.nodes.len() - 1
    }

    /// Records the violation of the constraints at the last node, and their reactions.
    fn hold(&mut self, residual: ConstraintResidual, reactions: Vec<f64>) {
        self.residual.include(residual);
        self.reactions.values.extend(reactions);
    }

    pub(crate) fn add_warning(&mut self, warning: Warning) {
        self.warnings.push(warning);
    }

    /// Keeps what a continuation from the last node needs.
    pub(crate) fn leave_checkpoint(&mut self, reached: Reached, stepper: L::Suspended, seen: Seen) {
        let last = self.last();
        let checkpoint = Checkpoint {
            reached,
            state: last.state(),
            velocity: last.v.clone(),
            stepper,
            seen,
        };
        self.checkpoint = Some(Box::new(checkpoint));
    }

    /// Records that an event has ended the run.
    pub(crate) fn set_stopped(&mut self) {
        self.is_stopped = true;
    }

    pub(crate) fn keep_element(&mut self, element: L::Polynomial) {
        self.elements.push(element);
    }

    pub(crate) fn set_statistics(&mut self, statistics: Statistics) {
        self.statistics = statistics;
    }

    pub(crate) fn set_warnings(&mut self, warnings: Vec<Warning>) {
        self.warnings = warnings;
    }

    pub(crate) fn set_events(&mut self, events: Vec<Event<N, L>>) {
        self.events = events;
    }

    /// Begins a new arc at the last node.
    pub(crate) fn begin_arc(&mut self, so_far: Statistics) {
        self.arcs.begin(self.nodes.len() - 1, so_far);
    }

    /// Records that parameters, given by their indices, are set at the next node, which has the time of the last one.
    pub(crate) fn set_parameters(&mut self, names: &[CoordinateName], values: &[(usize, f64)]) {
        let (t, node) = (self.last().t, self.nodes.len());
        for (number, value) in values {
            let parameter = names.get(*number).map(ToString::to_string);
            self.arcs.set(Setting {
                t,
                node,
                parameter: parameter.unwrap_or_default(),
                value: *value,
            });
        }
    }
}
