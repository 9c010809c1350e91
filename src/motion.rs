//! The result of a run: nodes, dense output, energy, observables, statistics.

mod arcs;
mod at_error;
mod checkpoint;
mod event;
pub(crate) mod family;
mod warning;

pub use at_error::AtError;
pub use checkpoint::{Checkpoint, FamilyCheckpoint};
pub use event::Event;
pub use warning::Warning;

pub(crate) use checkpoint::Reached;

pub use arcs::{MotionArc, Setting};

use crate::constraints::{ConstraintResidual, Reactions};
use crate::csv;
use crate::numbers::larger;
use crate::velocity::velocity_from;
use arcs::Arcs;
use std::fmt;
use std::io;
use std::ops::Range;
use std::path::Path;
use tfe_runtime::quadrature::Quadrature;
use tfe_runtime::step::DenseElement;
use tfe_runtime::{CoordinateName, Form, Model, State, Statistics, constrained, legendre};

/// A state with its time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Node<const N: usize> {
    /// Time.
    pub t: f64,
    /// Generalized coordinates.
    pub q: [f64; N],
    /// Generalized momenta p = ∂L/∂v.
    pub p: [f64; N],
    /// Velocities dq/dt: those of the state at nodes, NaN where no velocity belongs to the momentum; between nodes the derivative of the polynomial.
    pub v: [f64; N],
}

impl<const N: usize> Node<N> {
    /// A state of a model, whose velocities are looked for from `guess` on.
    pub(crate) fn new<M: Model<N>>(model: &M, t: f64, state: &State<N>, guess: &[f64; N]) -> Self {
        Self {
            t,
            q: state.q,
            p: state.p,
            v: velocity_from(model, t, state, guess),
        }
    }

    /// The point of phase space, without the time.
    pub fn state(&self) -> State<N> {
        State {
            q: self.q,
            p: self.p,
        }
    }
}

/// The observables that a model declares by `output(name) = …`, one column each, one row a recorded node.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Outputs {
    names: Vec<CoordinateName>,
    values: Vec<f64>,
}

impl Outputs {
    /// The names, in the order of declaration.
    pub fn names(&self) -> &[CoordinateName] {
        &self.names
    }

    /// The values of one observable at the recorded nodes; `None` where the model declares no such name.
    pub fn column(&self, name: &str) -> Option<Vec<f64>> {
        let is_it = |candidate: &CoordinateName| candidate.to_string() == name;
        let at = self.names.iter().position(is_it)?;
        Some(
            self.values
                .iter()
                .skip(at)
                .step_by(self.names.len())
                .copied()
                .collect(),
        )
    }

    /// All observables at one recorded node, in the order of [`names`](Self::names).
    pub fn row(&self, node: usize) -> Option<&[f64]> {
        self.values
            .get(node * self.names.len()..(node + 1) * self.names.len())
    }
}

/// A recorded motion of a model with `N` coordinates.
///
/// The nodes are the ends of the elements (every one, or every k-th after
/// [`record_every`](crate::Simulation::record_every)); between nodes, [`at`](Self::at) evaluates the element's own polynomial.
#[derive(Clone)]
pub struct Motion<const N: usize> {
    nodes: Vec<Node<N>>,
    velocities: Vec<[f64; N]>,
    energies: Vec<f64>,
    outputs: Outputs,
    reactions: Reactions,
    residual: ConstraintResidual,
    elements: Vec<DenseElement<N>>,
    statistics: Statistics,
    warnings: Vec<Warning>,
    names: Vec<CoordinateName>,
    checkpoint: Option<Box<Checkpoint<N>>>,
    events: Vec<Event<N>>,
    arcs: Arcs,
}

impl<const N: usize> Motion<N> {
    /// The motion of a model that has only its start.
    pub(crate) fn from_start<M: Model<N>>(model: &M, t: f64, start: &State<N>) -> Self {
        let mut motion = Self::empty(model);
        motion.record(model, t, start);
        motion
    }

    /// The same of a model that cannot be evaluated there.
    pub(crate) fn unknown<M: Model<N>>(model: &M, t: f64, start: &State<N>) -> Self {
        let mut motion = Self::empty(model);
        let v = [f64::NAN; N];
        let State { q, p } = *start;
        motion.nodes.push(Node { t, q, p, v });
        motion.velocities.push(v);
        motion.energies.push(f64::NAN);
        motion.outputs.values = vec![f64::NAN; model.columns()];
        motion.reactions.values = vec![f64::NAN; M::CONSTRAINTS.len()];
        motion
    }

    fn empty<M: Model<N>>(model: &M) -> Self {
        Self {
            nodes: Vec::new(),
            velocities: Vec::new(),
            energies: Vec::new(),
            outputs: Outputs {
                names: (0..model.columns())
                    .map(|at| model.column_name(at))
                    .collect(),
                values: Vec::new(),
            },
            reactions: Reactions {
                names: M::CONSTRAINTS.iter().map(|one| one.name).collect(),
                values: Vec::new(),
            },
            residual: ConstraintResidual {
                position: 0.0,
                velocity: 0.0,
                rank: M::CONSTRAINTS.len(),
            },
            elements: Vec::new(),
            statistics: Statistics::default(),
            warnings: Vec::new(),
            names: (0..N).map(M::coordinate_name).collect(),
            checkpoint: None,
            events: Vec::new(),
            arcs: Arcs::default(),
        }
    }

    /// The same of a run that goes on, whose velocity at the start is known.
    pub(crate) fn from_checkpoint<M: Model<N>>(model: &M, checkpoint: &Checkpoint<N>) -> Self {
        let (t, start) = (checkpoint.time(), &checkpoint.state);
        let mut motion = Self::from_start(model, t, start);
        motion.nodes.clear();
        motion.velocities.clear();
        motion.energies.clear();
        motion.outputs.values.clear();
        motion.reactions.values.clear();
        motion.record_with(model, t, start, checkpoint.velocity);
        motion
    }

    pub(crate) fn set_checkpoint(&mut self, checkpoint: Checkpoint<N>) {
        self.checkpoint = Some(Box::new(checkpoint));
    }

    /// Where the run ended, with all that [`Simulation::resume`](crate::Simulation::resume) needs to go on as if it had never stopped; `None` where the run failed, or
    /// was made of several ([`accuracy`](crate::Simulation::accuracy)).
    pub fn checkpoint(&self) -> Option<&Checkpoint<N>> {
        self.checkpoint.as_deref()
    }

    /// Appends a node, with its velocity, energy and observables. Where the Legendre transform has no solution at the node they are
    /// recorded as NaN: the state itself is good, and its momentum may well belong to no velocity (a singular mass matrix).
    pub(crate) fn record<M: Model<N>>(&mut self, model: &M, t: f64, state: &State<N>) {
        let guess = self.velocities.last().copied().unwrap_or([0.0; N]);
        let velocity = velocity_from(model, t, state, &guess);
        self.record_with(model, t, state, velocity);
    }

    /// The same where the velocity is known.
    fn record_with<M: Model<N>>(
        &mut self,
        model: &M,
        t: f64,
        state: &State<N>,
        velocity: [f64; N],
    ) {
        let energy = legendre::energy_at(model, t, &state.q, &state.p, &velocity);
        self.nodes.push(Node {
            t,
            q: state.q,
            p: state.p,
            v: velocity,
        });
        if const { !M::CONSTRAINTS.is_empty() } {
            self.record_constraints(model, t, state, &velocity);
        }
        self.velocities.push(velocity);
        self.energies.push(energy);
        let columns = model.columns();
        if columns > 0 {
            let z = if matches!(M::FORM, Form::Lagrangian) {
                &velocity
            } else {
                &state.p
            };
            let start = self.outputs.values.len();
            self.outputs.values.resize(start + columns, 0.0);
            model.observables(t, &state.q, z, &mut self.outputs.values[start..]);
        }
    }

    fn record_constraints<M: Model<N>>(
        &mut self,
        model: &M,
        t: f64,
        state: &State<N>,
        velocity: &[f64; N],
    ) {
        let reactions = constrained::reactions(model, t, state, velocity);
        let reactions = reactions.unwrap_or_else(|_| vec![f64::NAN; M::CONSTRAINTS.len()]);
        self.reactions.values.extend(reactions);
        for one in constrained::residuals(model, t, &state.q, velocity, 1.0) {
            let largest = &mut self.residual;
            largest.position = larger(largest.position, one.position.abs());
            largest.velocity = larger(largest.velocity, one.velocity.abs());
        }
        let independent = constrained::independent(model, t, &state.q);
        let rank = independent.into_iter().filter(|one| *one).count();
        self.residual.rank = self.residual.rank.min(rank);
    }

    pub(crate) fn keep_element(&mut self, element: DenseElement<N>) {
        self.elements.push(element);
    }

    pub(crate) fn set_statistics(&mut self, statistics: Statistics) {
        self.statistics = statistics;
    }

    pub(crate) fn set_warnings(&mut self, warnings: Vec<Warning>) {
        self.warnings = warnings;
    }

    /// The last recorded node: the end of the span after a complete run.
    pub fn last(&self) -> &Node<N> {
        self.nodes.last().expect("a motion is made with its start")
    }

    /// The place of the recorded node that is nearest to a time.
    pub(crate) fn nearest(&self, time: f64) -> usize {
        let direction = if self.last().t < self.nodes[0].t {
            -1.0
        } else {
            1.0
        };
        let after = (self.nodes).partition_point(|node| direction * node.t < direction * time);
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

    /// The recorded nodes, in the order of time.
    pub fn states(&self) -> &[Node<N>] {
        &self.nodes
    }

    /// The velocities dq/dt at the recorded nodes.
    pub fn velocities(&self) -> &[[f64; N]] {
        &self.velocities
    }

    /// Energy and p·v at the last recorded node.
    pub(crate) fn last_energy(&self) -> (f64, f64) {
        let (node, velocity) = (self.last(), self.velocities.last());
        let products = velocity
            .into_iter()
            .flatten()
            .zip(&node.p)
            .map(|(v, p)| v * p);
        (
            self.energies.last().copied().unwrap_or(f64::NAN),
            products.sum(),
        )
    }

    /// The energy H = p·v − L at the recorded nodes.
    pub fn energies(&self) -> &[f64] {
        &self.energies
    }

    /// The state at a time between the nodes, from the element's own polynomial.
    ///
    /// The polynomial starts at one node and ends at the next, so the result is continuous; between nodes its error is of order hⁿ for an
    /// element of n nodes, while the nodes themselves are accurate to the order of the element. So it is with constraints: at nodes they hold to round-off,
    /// between them to the order hⁿ; [`consistent_state_at`](crate::ConsistentState::consistent_state_at) projects such a state where that matters.
    ///
    /// # Errors
    /// [`AtError::Outside`] beyond the span, [`AtError::NotRecorded`] where `record_every` left the element out.
    pub fn at(&self, time: f64) -> Result<Node<N>, AtError> {
        let (start, end) = (self.nodes[0].t, self.last().t);
        if !((start.min(end)..=start.max(end)).contains(&time)) {
            return Err(AtError::Outside { time, start, end });
        }
        let direction = if end < start { -1.0 } else { 1.0 };
        let node = self
            .nodes
            .partition_point(|node| direction * node.t < direction * time);
        if let Some(node) = self.nodes.get(node).filter(|node| node.t == time) {
            return Ok(*node);
        }
        let after = self
            .elements
            .partition_point(|element| direction * element.start() <= direction * time);
        let element = after.checked_sub(1).and_then(|at| self.elements.get(at));
        match element {
            Some(element) if direction * element.end() >= direction * time => {
                let state = element.at_time(time);
                Ok(Node {
                    t: time,
                    q: state.q,
                    p: state.p,
                    v: element.velocity_at_time(time),
                })
            }
            _ => Err(AtError::NotRecorded { time }),
        }
    }

    /// The integral of an output from the start to every recorded node,
    ///
    /// ```text
    /// ∫ y(t, q, q̇) dt ,     by the s Gauss points of every element, s the degree of its polynomial                   (T-109)
    /// ```
    ///
    /// An element of collocation meets the equations of motion at these points, so the integral is as accurate as the nodes: as if it had been one more
    /// coordinate. So the angle comes back that `model(Name, routh(phi))` ignores, whose velocity is the output `phi_rate`; so does the work of a force.
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
    /// [`AtError::NoOutput`] for a name that is none, [`AtError::NotRecorded`] where `record_every` left elements out, [`AtError::NoVelocity`] where a
    /// momentum belongs to no velocity.
    pub fn integral<M: Model<N>>(&self, model: &M, output: &str) -> Result<Vec<f64>, AtError> {
        let names: Vec<String> = (0..model.columns())
            .map(|at| model.column_name(at).to_string())
            .collect();
        let mut values = vec![0.0; names.len()];
        let Some(column) = names.iter().position(|name| name == output) else {
            return Err(AtError::NoOutput {
                output: output.to_owned(),
                known: names,
            });
        };
        let mut velocity = self.velocities[0];
        let (mut sum, mut integrals) = (0.0, vec![0.0]);
        let mut rule = Quadrature::gauss(1);
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
            if rule.len() != element.degree().max(1) {
                rule = Quadrature::gauss(element.degree());
            }
            for piece in element.pieces() {
                let (from, length) = (piece.start(), piece.end() - piece.start());
                for point in 0..rule.len() {
                    let (node, weight) = (rule.node(point), rule.weight(point));
                    let (t, state) = (from + node * length, piece.at(node));
                    let z = match M::FORM {
                        Form::Hamiltonian => state.p,
                        Form::Lagrangian => {
                            let found =
                                constrained::velocity_of(model, t, &state.q, &state.p, &velocity);
                            velocity = found.map_err(|_| AtError::NoVelocity { time: t })?;
                            velocity
                        }
                    };
                    model.observables(t, &state.q, &z, &mut values);
                    sum += weight * length * values[column];
                }
            }
            integrals.push(sum);
        }
        if integrals.len() < self.nodes.len() {
            let time = self.nodes[integrals.len() - 1].t;
            return Err(AtError::NotRecorded { time });
        }
        Ok(integrals)
    }

    /// Largest change of the energy over the recorded nodes, relative to the energy at the start (absolute where that is zero, or not more than a rounding beside p·v):
    ///
    /// ```text
    /// max |H(t) − H(t₀)| / |H(t₀)|
    /// ```
    ///
    /// Where [events](crate::Simulation::on) changed the state or parameters, H(t) − H of the start of its [arc](Self::arcs).
    ///
    /// Of a model that is forced, damped or depends on time it measures physics, not error.
    pub fn energy_error(&self) -> f64 {
        let Some(&start) = self.energies.first() else {
            return 0.0;
        };
        let nodes = self.nodes.iter().zip(&self.velocities);
        let scale = energy_scale(start, nodes.map(|(node, v)| (&node.p[..], &v[..])));
        let of_arc = |nodes: Range<usize>| {
            let energies = self.energies.get(nodes).unwrap_or_default();
            let start = energies.first().copied().unwrap_or_default();
            energies.iter().map(move |energy| (energy - start).abs())
        };
        let changes = self.arcs.nodes(self.nodes.len()).flat_map(of_arc);
        changes.map(|change| change / scale).fold(0.0, larger)
    }

    /// What the run cost.
    pub fn statistics(&self) -> &Statistics {
        &self.statistics
    }

    /// What is doubtful about the motion although no element failed, in the order of time; each can be printed.
    ///
    /// None is no proof that the motion is right: [`Warning`] says what is looked for, and how often.
    pub fn warnings(&self) -> &[Warning] {
        &self.warnings
    }

    pub(crate) fn set_events(&mut self, events: Vec<Event<N>>) {
        self.events = events;
    }

    /// The events that [`Simulation::on`](crate::Simulation::on) asked for, in the order in which they happened.
    pub fn events(&self) -> &[Event<N>] {
        &self.events
    }

    /// The arcs between the events at which the state or parameters changed; one where there were none.
    pub fn arcs(&self) -> impl Iterator<Item = MotionArc> {
        self.arcs.all(self.nodes.len(), self.statistics)
    }

    /// The parameters that events have set, in the order in which they did.
    pub fn settings(&self) -> &[Setting] {
        self.arcs.settings()
    }

    /// Another arc begins at the last node.
    pub(crate) fn begin_arc(&mut self, so_far: Statistics) {
        self.arcs.begin(self.nodes.len() - 1, so_far);
    }

    /// Parameters are set at the node that is to come, at the time of the last one.
    pub(crate) fn set_parameters<M: Model<N>>(&mut self, model: &M, values: &[(usize, f64)]) {
        let (t, node) = (self.last().t, self.nodes.len());
        for (index, value) in values {
            let parameter = model.parameter_name(*index).to_string();
            self.arcs.set(Setting {
                t,
                node,
                parameter,
                value: *value,
            });
        }
    }

    /// The observables at the recorded nodes.
    pub fn outputs(&self) -> &Outputs {
        &self.outputs
    }

    /// The reactions of the constraints at the recorded nodes; NaN where the kinetic energy is singular for motions that the constraints allow.
    pub fn reactions(&self) -> &Reactions {
        &self.reactions
    }

    /// What the recorded nodes leave of the constraints.
    pub fn constraint_residual(&self) -> ConstraintResidual {
        self.residual
    }

    /// Writes the recorded nodes as CSV: time, coordinates, velocities, momenta, energy, observables, reactions, with a header line. Numbers are
    /// written so that they read back exactly. With a time transformation the first column is `tau`, and `t` is among the coordinates.
    ///
    /// # Errors
    /// Those of the file system.
    pub fn write_csv(&self, path: impl AsRef<Path>) -> io::Result<()> {
        let is_coordinate = self.names.iter().any(|name| name.to_string() == "t");
        let time = if is_coordinate { "tau" } else { "t" };
        let mut header = vec![time.to_owned()];
        header.extend(self.names.iter().map(ToString::to_string));
        header.extend(self.names.iter().map(|name| format!("{name}_dot")));
        header.extend(self.names.iter().map(|name| format!("p_{name}")));
        header.push("energy".to_owned());
        header.extend(self.outputs.names.iter().map(ToString::to_string));
        header.extend(
            self.reactions
                .names
                .iter()
                .map(|name| format!("lambda_{name}")),
        );
        let rows = self.nodes.iter().enumerate().map(|(k, node)| {
            let mut row = vec![node.t];
            row.extend(node.q.iter().chain(&self.velocities[k]).chain(&node.p));
            row.push(self.energies[k]);
            row.extend(self.outputs.row(k).unwrap_or_default());
            row.extend(self.reactions.row(k).unwrap_or_default());
            row
        });
        csv::write(path.as_ref(), &header, rows)
    }
}

/// With what changes of the energy are compared: its value at the start, or one where that is zero, or a rounding beside the largest product of momenta and velocities.
fn energy_scale<'a>(start: f64, nodes: impl Iterator<Item = (&'a [f64], &'a [f64])>) -> f64 {
    const ROUNDING: f64 = 1e-12;
    let action = |(p, v): (&[f64], &[f64])| p.iter().zip(v).map(|(p, v)| p * v).sum::<f64>();
    let largest = nodes.map(|node| action(node).abs()).fold(0.0, larger);
    if start == 0.0 || start.abs() <= ROUNDING * largest {
        1.0
    } else {
        start.abs()
    }
}

impl<const N: usize> fmt::Debug for Motion<N> {
    /// The extent of the motion, not its thousands of numbers.
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
