//! Motions, the results of runs: nodes, dense output, energy, outputs, events, statistics.

mod arcs;
mod at_error;
mod checkpoint;
mod event;
mod integral;
mod node;
mod outputs;
pub(crate) mod points;
mod recording;
mod table;
mod time;
mod warning;

pub use at_error::AtError;
pub use checkpoint::Checkpoint;
pub use event::Event;
pub use node::Node;
pub use outputs::Outputs;
pub use warning::Warning;

pub(crate) use checkpoint::{LastCut, Reached, Seen};
pub(crate) use node::action;
pub(crate) use time::{
    MAX_STEPS, MIN_ROUNDINGS, breaks_within, count_steps, default_step, direction_of, is_same_time,
    is_unresolved, leads_to_end, looked_at, sort_times,
};

pub use arcs::{MotionArc, Setting};

use crate::constraints::{ConstraintResidual, Reactions};
use crate::length::{FixedLength, Length, Polynomial};
use crate::numbers::larger;
use arcs::Arcs;
use std::fmt;
use std::ops::Range;
use tfe_runtime::{CoordinateName, Statistics};

/// The result of a run: the recorded motion of a model with `N` coordinates, or of a model of run-time length.
///
/// The nodes are the ends of the elements (every one, or every k-th after
/// [`record_every`](crate::Simulation::record_every)). Between the nodes, [`at`](Self::at) evaluates the element's own
/// polynomial (dense output). All numbers are in the units of the model.
///
/// ```
/// use tfe::prelude::*;
///
/// #[dynamics(coordinates(x), lagrangian = (dot(x)^2 - x^2)/2, output(potential) = x^2/2)]
/// struct Oscillator;
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let simulation = Simulation::new(&Oscillator).element(Mixed::<6>).step(0.1);
/// let motion = simulation.run(Oscillator.state([1.0], [0.0]), 0.0..10.0)?;
/// assert_eq!(motion.states().len(), 101);
/// assert!((motion.last().q[0] - 10.0_f64.cos()).abs() < 1e-12);
/// assert!((motion.at(0.55)?.q[0] - 0.55_f64.cos()).abs() < 1e-7); // between two nodes
/// assert!(motion.energy_error() < 1e-13);
/// let potential = motion.outputs().column("potential").ok_or("the model declares it")?;
/// assert!((potential[0] - 0.5).abs() < 1e-15);
/// # Ok(())
/// # }
/// ```
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
    pub(crate) fn is_stopped(&self) -> bool {
        self.is_stopped
    }

    /// The end of the run, with everything that [`Simulation::resume`](crate::Simulation::resume) needs to continue
    /// with the same bits as an uninterrupted run. `None` if the run failed, if an event ended it or set parameters,
    /// or if the motion is made of several runs ([`accuracy`](crate::Simulation::accuracy)).
    pub fn checkpoint(&self) -> Option<&Checkpoint<N, L>> {
        self.checkpoint.as_deref()
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

    /// The state at any time within the span (dense output), from the polynomial of the element that contains it
    /// (T-69).
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
