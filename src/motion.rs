//! Motions, the results of runs: nodes, dense output, energy, outputs, events, statistics.

mod arcs;
mod at_error;
mod checkpoint;
mod event;
pub(crate) mod points;
mod time;
mod warning;

pub use at_error::AtError;
pub use checkpoint::Checkpoint;
pub use event::Event;
pub use warning::Warning;

pub(crate) use checkpoint::{LastCut, Reached, Seen};
pub(crate) use time::{
    LEAST_ROUNDINGS, MOST_STEPS, breaks_within, count_steps, default_step, direction_of,
    is_same_time, is_unresolved, leads_to_end, looked_at, sort_times,
};

pub use arcs::{MotionArc, Setting};

use crate::constraints::{ConstraintResidual, Reactions};
use crate::csv::{self, Column};
use crate::evaluate::Evaluate;
use crate::length::{FixedLength, Length, Polynomial};
use crate::numbers::{larger, row_of};
use arcs::Arcs;
use points::Points;
use std::fmt;
use std::io;
use std::ops::Range;
use std::path::Path;
use tfe_runtime::{CoordinateName, Statistics};

/// A state with its time and its velocities. The vectors are arrays for models of fixed size, and `Vec`s for models of
/// run-time length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Node<const N: usize, L: Length<N> = FixedLength> {
    /// Time t, in the unit of the model.
    pub t: f64,
    /// Generalized coordinates q.
    pub q: L::Vector,
    /// Generalized momenta p = ∂L/∂v.
    pub p: L::Vector,
    /// Velocities dq/dt. At a node they are the velocities that belong to the momenta, or NaN if there are none;
    /// between nodes the derivative of the element's polynomial.
    pub v: L::Vector,
}

impl<const N: usize, L: Length<N>> Node<N, L> {
    /// A node from a state and its velocity.
    #[inline(always)]
    pub(crate) fn of(t: f64, state: &L::State, v: L::Vector) -> Self {
        let (q, p) = L::parts(state);
        let (q, p) = (q.clone(), p.clone());
        Self { t, q, p, v }
    }

    /// A node of a model; the velocity is found by iteration from `guess`.
    #[inline(always)]
    pub(crate) fn new<M>(model: &M, t: f64, state: &L::State, guess: &L::Vector) -> Self
    where
        M: Evaluate<N, L>,
    {
        let velocity = model.velocity(t, state, guess);
        Self::of(t, state, velocity.unwrap_or_else(|| L::unknown(guess)))
    }

    /// The state (q, p), without the time.
    pub fn state(&self) -> L::State {
        L::state(self.q.clone(), self.p.clone())
    }

    /// The product p·v.
    pub(crate) fn action(&self) -> f64 {
        action(self.v.as_ref(), self.p.as_ref())
    }
}

/// The values of the observables that a model declares by `output(name) = …` or, with one column for each site, by
/// `output(name[i in a..b]) = …`: a table with one row for each recorded node.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Outputs {
    names: Vec<CoordinateName>,
    values: Vec<f64>,
}

impl Outputs {
    /// The names of the columns, in the order of declaration; outputs with sites are called `strain[0]`, `strain[1]`,
    /// …
    pub fn names(&self) -> &[CoordinateName] {
        &self.names
    }

    /// The values of one output at the recorded nodes; `None` if the model declares no output of this name.
    pub fn column(&self, name: &str) -> Option<Vec<f64>> {
        let is_it = |candidate: &CoordinateName| candidate.to_string() == name;
        let at = self.names.iter().position(is_it)?;
        let values = self.values.iter().skip(at);
        Some(values.step_by(self.names.len()).copied().collect())
    }

    /// The values of all outputs at one recorded node, in the order of [`names`](Self::names); `None` if there is no
    /// such node and the model has outputs.
    pub fn row(&self, node: usize) -> Option<&[f64]> {
        row_of(&self.values, self.names.len(), node)
    }
}

/// The result of a run: the recorded motion of a model with `N` coordinates, or of a model of run-time length.
///
/// The nodes are the ends of the elements (every one, or every k-th after
/// [`record_every`](crate::Simulation::record_every)). Between the nodes, [`at`](Self::at) evaluates the element's own
/// polynomial (dense output).
///
/// For a model of run-time length with n coordinates each node takes 4 n numbers of memory, and the polynomial of an
/// element with s stages 2 s n more. For long chains and long runs, use `record_every` to keep fewer nodes and no
/// polynomials.
#[derive(Clone)]
pub struct Motion<const N: usize, L: Length<N> = FixedLength> {
    nodes: Vec<Node<N, L>>,
    velocities: Vec<L::Vector>,
    energies: Vec<f64>,
    outputs: Outputs,
    reactions: Reactions<L::ConstraintName>,
    residual: ConstraintResidual,
    elements: Vec<L::Polynomial>,
    statistics: Statistics,
    warnings: Vec<Warning>,
    names: Vec<CoordinateName>,
    checkpoint: Option<Box<Checkpoint<N, L>>>,
    /// Whether an event has ended the motion.
    is_stopped: bool,
    events: Vec<Event<N, L>>,
    arcs: Arcs,
}

impl<const N: usize, L: Length<N>> Motion<N, L> {
    /// A motion that consists of its start.
    pub(crate) fn from_start<M>(model: &M, t: f64, start: &L::State) -> Self
    where
        M: Evaluate<N, L>,
    {
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
        let mut motion = Self::empty(model);
        let (_, p) = L::parts(start);
        let v = L::unknown(p);
        motion.nodes.push(Node::of(t, start, v.clone()));
        motion.velocities.push(v);
        motion.energies.push(f64::NAN);
        motion.outputs.values = vec![f64::NAN; motion.outputs.names.len()];
        motion.reactions.values = vec![f64::NAN; motion.reactions.names.len()];
        motion
    }

    /// The start of a run that never began. The model is not evaluated, since its lengths may be inconsistent.
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
        let zero;
        let guess = match self.velocities.last() {
            Some(guess) => guess,
            None => {
                let (_, p) = L::parts(state);
                zero = L::zero(p);
                &zero
            }
        };
        self.record_node(model, Node::new(model, t, state, guess));
    }

    /// The same if the velocity is known.
    #[inline(always)]
    pub(crate) fn record_node<M: Evaluate<N, L>>(&mut self, model: &M, node: Node<N, L>) {
        let reactions = match M::IS_CONSTRAINED {
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
        let place = self.nodes.len();
        self.nodes.push(node);
        let node = &self.nodes[place];
        let (t, at) = (node.t, (&node.q, &node.p));
        self.energies.push(model.energy(t, at, &node.v));
        let columns = self.outputs.names.len();
        if columns > 0 {
            let start = self.outputs.values.len();
            self.outputs.values.resize(start + columns, 0.0);
            let values = &mut self.outputs.values[start..];
            model.outputs(t, at, &node.v, values);
        }
        if M::IS_CONSTRAINED {
            let residual = model.residual(t, &node.q, &node.v);
            let largest = &mut self.residual;
            largest.position = larger(largest.position, residual.position);
            largest.velocity = larger(largest.velocity, residual.velocity);
            largest.rank = largest.rank.min(residual.rank);
            self.reactions.values.extend(reactions);
        }
        self.velocities.push(node.v.clone());
    }

    pub(crate) fn add_warning(&mut self, warning: Warning) {
        self.warnings.push(warning);
    }

    pub(crate) fn set_checkpoint(&mut self, checkpoint: Checkpoint<N, L>) {
        self.checkpoint = Some(Box::new(checkpoint));
    }

    /// Records that an event has ended the run.
    pub(crate) fn set_stopped(&mut self) {
        self.is_stopped = true;
    }

    pub(crate) fn is_stopped(&self) -> bool {
        self.is_stopped
    }

    /// The end of the run, with everything that [`Simulation::resume`](crate::Simulation::resume) needs to continue
    /// with the same bits as an uninterrupted run. `None` if the run failed, if an event ended it or set parameters,
    /// or if the motion is made of several runs ([`accuracy`](crate::Simulation::accuracy)).
    pub fn checkpoint(&self) -> Option<&Checkpoint<N, L>> {
        self.checkpoint.as_deref()
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

    /// The last recorded node. After a complete run, this is the end of the span.
    pub fn last(&self) -> &Node<N, L> {
        self.nodes.last().expect("a motion is made with its start")
    }

    /// −1 for a motion backward in time, otherwise 1.
    pub(crate) fn direction(&self) -> f64 {
        match self.last().t < self.nodes[0].t {
            true => -1.0,
            false => 1.0,
        }
    }

    /// The number of recorded nodes before a time.
    pub(crate) fn nodes_before(&self, time: f64) -> usize {
        let direction = self.direction();
        (self.nodes).partition_point(|node| direction * node.t < direction * time)
    }

    /// The index of the recorded node closest to a time.
    pub(crate) fn nearest(&self, time: f64) -> usize {
        let after = self.nodes_before(time);
        let before = after.saturating_sub(1);
        let far = |node: usize| {
            self.nodes
                .get(node)
                .map_or(f64::INFINITY, |n| (n.t - time).abs())
        };
        if far(before) < far(after) {
            before
        } else {
            after
        }
    }

    /// The recorded nodes, in the order of the run. Times decrease in a run backwards in time.
    pub fn states(&self) -> &[Node<N, L>] {
        &self.nodes
    }

    /// The velocities dq/dt at the recorded nodes.
    pub fn velocities(&self) -> &[L::Vector] {
        &self.velocities
    }

    /// The energy and p·v at the last recorded node.
    pub(crate) fn last_energy(&self) -> (f64, f64) {
        let energy = self.energies.last().copied();
        (energy.unwrap_or(f64::NAN), self.last().action())
    }

    /// The energy H = p·v − L at the recorded nodes.
    pub fn energies(&self) -> &[f64] {
        &self.energies
    }

    /// The state at any time within the span (dense output), from the polynomial of the element that contains it.
    ///
    /// The polynomial starts at one node and ends at the next, so the result is continuous, except for the momenta at
    /// nodes where impulses act: there it shows the momenta before the impulse. Between the nodes the error is of
    /// order hⁿ for an element of n nodes, while the nodes themselves have the order of the element. In the same way,
    /// constraints hold to rounding at the nodes, and with an error of order hⁿ between them;
    /// [`consistent_state_at`](crate::ConsistentState::consistent_state_at) projects a state onto the constraints
    /// where that matters.
    ///
    /// # Errors
    /// [`AtError::Outside`] if the time is outside the span, [`AtError::NotRecorded`] if `record_every` left out the
    /// element.
    pub fn at(&self, time: f64) -> Result<Node<N, L>, AtError> {
        let (start, end) = (self.nodes[0].t, self.last().t);
        if !((start.min(end)..=start.max(end)).contains(&time)) {
            return Err(AtError::Outside { time, start, end });
        }
        let node = self.nodes.get(self.nodes_before(time));
        if let Some(node) = node.filter(|node| node.t == time) {
            return Ok(node.clone());
        }
        let direction = self.direction();
        let after = self
            .elements
            .partition_point(|element| direction * element.start() <= direction * time);
        let element = after.checked_sub(1).and_then(|at| self.elements.get(at));
        match element {
            Some(element) if direction * element.end() >= direction * time => {
                let velocity = element.velocity_at_time(time);
                Ok(Node::of(time, &element.at_time(time), velocity))
            }
            _ => Err(AtError::NotRecorded { time }),
        }
    }

    /// The polynomials of the elements between the recorded nodes.
    pub(crate) fn elements(&self) -> &[L::Polynomial] {
        &self.elements
    }

    /// The integral of an output from the start to every recorded node,
    ///
    /// ```text
    /// ∫ y(t, q, q̇) dt ,     by the s Gauss points of every element, s the degree of its polynomial                   (T-164)
    /// ```
    ///
    /// The Gauss points of a collocation element are the points at which it satisfies the equations of motion. The
    /// integral is therefore as accurate as the nodes, as if it had been one more coordinate. Use it for the work of a
    /// force, or for the angle that `model(Name, routh(phi))` eliminates, whose velocity is the output `phi_rate`:
    ///
    /// ```
    /// use tfe::prelude::*;
    ///
    /// /// A planet; without its angle a motion in the radius alone.
    /// #[dynamics(
    ///     coordinates(r, phi),
    ///     lagrangian = (dot(r)^2 + r^2*dot(phi)^2)/2 + mu/r,
    ///     model(Radial, routh(phi)),
    /// )]
    /// struct Planet { mu: f64 }
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// let planet = Planet { mu: 1.0 };
    /// let (radial, start) = Radial::of_state(&planet, &planet.state([1.0, 0.0], [0.0, 1.2]));
    /// let motion = Simulation::new(&radial).element(Mixed::<6>).step(0.1).run(start, 0.0..5.0)?;
    /// let angle = motion.integral(&radial, "phi_rate")?;
    /// // The same as with the angle as a coordinate.
    /// let both = Simulation::new(&planet).element(Mixed::<6>).step(0.1).run(planet.state([1.0, 0.0], [0.0, 1.2]), 0.0..5.0)?;
    /// assert!((angle[50] - both.last().q[1]).abs() < 1e-12);
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    /// [`AtError::NoOutput`] if the model declares no such output, [`AtError::NotRecorded`] if `record_every` left out
    /// elements, [`AtError::NoVelocity`] if no velocity belongs to a momentum.
    pub fn integral<M>(&self, model: &M, output: &str) -> Result<Vec<f64>, AtError>
    where
        M: Evaluate<N, L>,
    {
        let names: Vec<String> = (model.output_names().iter())
            .map(ToString::to_string)
            .collect();
        let mut values = vec![0.0; names.len()];
        let Some(column) = names.iter().position(|name| name == output) else {
            return Err(AtError::NoOutput {
                output: output.to_owned(),
                known: names,
            });
        };
        let mut points = Points::new(self.nodes[0].v.clone());
        let (mut sum, mut integrals) = (0.0, vec![0.0]);
        let mut elements = self.elements.iter();
        let mut changed = None;
        for (node, pair) in self.nodes.windows(2).enumerate() {
            let (from, to) = (pair[0].t, pair[1].t);
            // The states before and after an event.
            if from == to {
                integrals.push(sum);
                let now = changed.as_ref().unwrap_or(model);
                changed = self.arcs.model_from(now, node + 1).or(changed);
                continue;
            }
            let model = changed.as_ref().unwrap_or(model);
            let Some(element) = elements.next() else {
                break;
            };
            if (element.start(), element.end()) != (from, to) {
                return Err(AtError::NotRecorded { time: from });
            }
            for piece in element.pieces() {
                points.of(model, piece, |point| {
                    let at = L::parts(&point.state);
                    model.outputs(point.t, at, &point.velocity, &mut values);
                    sum += point.weight * values[column];
                    Ok::<_, AtError>(())
                })?;
            }
            integrals.push(sum);
        }
        if integrals.len() < self.nodes.len() {
            let time = self.nodes[integrals.len() - 1].t;
            return Err(AtError::NotRecorded { time });
        }
        Ok(integrals)
    }

    /// The largest change of the energy over the recorded nodes, relative to the energy at the start (absolute if that
    /// is zero, or no more than a rounding error of p·v):
    ///
    /// ```text
    /// max |H(t) − H(t₀)| / |H(t₀)|
    /// ```
    ///
    /// If [events](crate::Simulation::on) changed the state or parameters, each node is compared with the start of its
    /// [arc](Self::arcs).
    ///
    /// For a model that is forced, damped or depends on time, this is a property of the motion and not an error.
    pub fn energy_error(&self) -> f64 {
        let Some(&start) = self.energies.first() else {
            return 0.0;
        };
        let actions = self.nodes.iter().map(|node| node.action().abs());
        let scale = energy_scale(start, actions.fold(0.0, larger));
        let of_arc = |nodes: Range<usize>| {
            let energies = self.energies.get(nodes).unwrap_or_default();
            let start = energies.first().copied().unwrap_or_default();
            energies.iter().map(move |energy| (energy - start).abs())
        };
        let changes = self.arcs.nodes(self.nodes.len()).flat_map(of_arc);
        changes.map(|change| change / scale).fold(0.0, larger)
    }

    /// What the run cost: counts of steps, iterations, evaluations and factorisations.
    pub fn statistics(&self) -> &Statistics {
        &self.statistics
    }

    /// Signs that the motion may be wrong although no element failed. Each warning can be printed, and says what to
    /// do.
    ///
    /// The absence of warnings does not prove that the motion is right: [`Warning`] says what is checked, and how
    /// often.
    pub fn warnings(&self) -> &[Warning] {
        &self.warnings
    }

    pub(crate) fn set_events(&mut self, events: Vec<Event<N, L>>) {
        self.events = events;
    }

    /// The events that [`Simulation::on`](crate::Simulation::on) asked for, in the order in which they happened.
    pub fn events(&self) -> &[Event<N, L>] {
        &self.events
    }

    /// The arcs of the motion: its parts between events that changed the state or parameters. Without such events
    /// there is one.
    pub fn arcs(&self) -> impl Iterator<Item = MotionArc> {
        self.arcs.all(self.nodes.len(), self.statistics)
    }

    /// The parameters that events have set, in the order in which they were set.
    pub fn settings(&self) -> &[Setting] {
        self.arcs.settings()
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

    /// The outputs of the model at the recorded nodes.
    pub fn outputs(&self) -> &Outputs {
        &self.outputs
    }

    /// The reactions (Lagrange multipliers λ) of the constraints at the recorded nodes; NaN where the mass matrix is
    /// singular for motions that the constraints allow.
    pub fn reactions(&self) -> &Reactions<L::ConstraintName> {
        &self.reactions
    }

    /// The largest violation of the constraints over the recorded nodes.
    pub fn constraint_residual(&self) -> ConstraintResidual {
        self.residual
    }

    /// Writes the recorded nodes as CSV: time, coordinates, velocities, momenta, energy, outputs, reactions, with a
    /// header line. Numbers are written so that they read back exactly.
    ///
    /// With a time transformation the first column is `tau`, and `t` is among the coordinates. If the model has an
    /// output called `energy`, that output keeps the name, and the energy is the column `energy_`; the same holds for
    /// other names that a coordinate or an output already has.
    ///
    /// # Errors
    /// Those of the file system.
    pub fn write_csv(&self, path: impl AsRef<Path>) -> io::Result<()> {
        let is_coordinate = self.names.iter().any(|name| name.to_string() == "t");
        let time = if is_coordinate { "tau" } else { "t" };
        let (q, outputs, constraints) = (&self.names, &self.outputs.names, &self.reactions.names);
        let mut header = vec![Column::Table(time.to_owned())];
        header.extend(q.iter().map(|name| Column::Model(name.to_string())));
        header.extend(q.iter().map(|name| Column::Table(format!("{name}_dot"))));
        header.extend(q.iter().map(|name| Column::Table(format!("p_{name}"))));
        header.push(Column::Table("energy".to_owned()));
        header.extend(outputs.iter().map(|name| Column::Model(name.to_string())));
        header.extend(
            constraints
                .iter()
                .map(|name| Column::Table(format!("lambda_{name}"))),
        );
        let rows = self.nodes.iter().enumerate().map(|(k, node)| {
            let mut row = vec![node.t];
            for values in [&node.q, &node.v, &node.p] {
                row.extend(values.as_ref());
            }
            row.extend(self.energies.get(k));
            row.extend(self.outputs.row(k).unwrap_or_default());
            row.extend(self.reactions.row(k).unwrap_or_default());
            row
        });
        csv::write(path.as_ref(), &header, rows)
    }
}

/// The product p·v.
pub(crate) fn action(velocities: &[f64], momenta: &[f64]) -> f64 {
    let products = velocities.iter().zip(momenta);
    products.map(|(v, p)| v * p).sum()
}

/// The scale for changes of the energy: its value at the start, or one if that is zero or within the rounding error of
/// the largest product of momenta and velocities.
pub(crate) fn energy_scale(start: f64, largest_action: f64) -> f64 {
    const ROUNDING: f64 = 1e-12;
    if start == 0.0 || start.abs() <= ROUNDING * largest_action {
        1.0
    } else {
        start.abs()
    }
}

impl<const N: usize, L: Length<N>> fmt::Debug for Motion<N, L> {
    /// The extent of the motion, without its thousands of numbers.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Motion")
            .field("first", &self.nodes.first())
            .field("last", &self.nodes.last())
            .field("nodes", &self.nodes.len())
            .field("statistics", &self.statistics)
            .field("warnings", &self.warnings)
            .finish_non_exhaustive()
    }
}
