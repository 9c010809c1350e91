//! Sensitivities: derivatives of motions with respect to the parameters of their model and to their start.

pub(crate) mod hessian;
pub(crate) mod inside;
pub(crate) mod loss;
pub(crate) mod names;
#[cfg(feature = "sparse")]
pub(crate) mod run_time;
pub(crate) mod slopes;
pub(crate) mod varied;

use crate::length::{FixedLength, Length};
use crate::motion::{AtError, Motion, Node};
use inside::{Between, Inside};
use nalgebra::DMatrix;
use names::place_of;
use std::fmt;

pub use hessian::LossHessian;
pub use loss::{Loss, LossGradient};

/// A motion together with its derivatives with respect to the parameters of its model and to its start (forward
/// sensitivities), from [`Simulation::run_sensitive`](crate::Simulation::run_sensitive).
///
/// With y = (p, q), A_e the derivative of the end of element e with respect to its start, and C_e that with respect to
/// the parameters a,
///
/// ```text
/// ∂y_{e+1}/∂a = A_e ∂y_e/∂a + C_e ,      ∂y_{e+1}/∂y₀ = A_e ∂y_e/∂y₀                              (T-123)
/// ```
///
/// These are derivatives of the computed motion, by implicit differentiation of its elements, and exact up to
/// rounding. If an [event](crate::Simulation::on) cuts an element, the derivatives include the change of the event's
/// time, and that of what is done there (T-124).
///
/// The start is the state (q, p), which does not depend on parameters, even if it was made from velocities: those
/// momenta would change with a mass.
///
/// ```
/// use tfe::prelude::*;
///
/// #[dynamics(coordinates(y), lagrangian = m/2*dot(y)^2 - m*g*y, force(y) = -c*dot(y), output(height) = y)]
/// struct Ball { m: f64, g: f64, c: f64 }
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let ball = Ball { m: 1.0, g: 9.81, c: 0.0 };
/// let s = Simulation::new(&ball).step(0.1).run_sensitive(ball.state([1.0], [0.5]), 0.0..2.0)?;
/// // y = 1 + v₀ t − g t²/2,   p = m v₀ − m g t
/// assert!((s.by("g").last().q[0] + 2.0).abs() < 1e-13);
/// assert!((s.by("g").last().p[0] + 2.0).abs() < 1e-13);
/// assert!((s.by_start().last().q_by_p()[(0, 0)] - 2.0).abs() < 1e-13);
/// assert_eq!(s.by("g").output("height").map(|values| values.len()), Some(21));
/// // Without drag the mass does not matter to a velocity, but it does to a momentum.
/// assert!((s.by("m").last().q[0] + 1.0).abs() < 1e-13); // the momentum 0.5 is kept
/// # Ok(())
/// # }
/// ```
#[derive(Clone)]
pub struct Sensitive<const N: usize, L: Length<N> = FixedLength> {
    motion: Motion<N, L>,
    parameters: Vec<String>,
    nodes: Vec<Slopes>,
    /// The derivatives between the nodes, if they were kept.
    inside: Vec<Inside>,
    events: Vec<(usize, Vec<f64>)>,
}

/// The derivatives at a node: a column for each of the 2N components of the start, in the order (p, q), then for each
/// parameter.
#[derive(Clone, Debug)]
pub(crate) struct Slopes {
    /// The derivatives of (p, q).
    pub(crate) state: DMatrix<f64>,
    /// The derivatives of the velocities.
    pub(crate) velocity: DMatrix<f64>,
    /// The derivatives of the outputs.
    pub(crate) outputs: DMatrix<f64>,
}

impl<const N: usize, L: Length<N>> Sensitive<N, L> {
    pub(crate) fn new(
        motion: Motion<N, L>,
        parameters: Vec<String>,
        nodes: Vec<Slopes>,
        events: Vec<(usize, Vec<f64>)>,
    ) -> Self {
        Self {
            motion,
            parameters,
            nodes,
            inside: Vec::new(),
            events,
        }
    }

    /// Adds derivatives between the nodes.
    pub(crate) fn with_inside(self, inside: Vec<Inside>) -> Self {
        Self { inside, ..self }
    }

    /// The derivatives along the elements, or their pieces, if they were kept.
    pub(crate) fn inside(&self) -> &[Inside] {
        &self.inside
    }

    /// The number of coordinates.
    fn coordinates(&self) -> usize {
        self.motion.last().q.as_ref().len()
    }

    /// The motion.
    pub fn motion(&self) -> &Motion<N, L> {
        &self.motion
    }

    /// The names of the parameters, `m` or `k[2]`, in the order of the fields of the struct.
    pub fn parameters(&self) -> &[String] {
        &self.parameters
    }

    /// The derivatives with respect to the parameter of this name.
    ///
    /// # Panics
    /// If no parameter has this name; [`get`](Self::get) returns `None` instead.
    #[track_caller]
    pub fn by(&self, name: &str) -> ByParameter<'_, N, L> {
        ByParameter {
            of: self,
            column: 2 * self.coordinates() + place_of(name, &self.parameters),
        }
    }

    /// The derivatives with respect to a parameter; `None` if no parameter has this name.
    pub fn get(&self, name: &str) -> Option<ByParameter<'_, N, L>> {
        let place = self.parameters.iter().position(|own| own == name)?;
        Some(ByParameter {
            of: self,
            column: 2 * self.coordinates() + place,
        })
    }

    /// The derivatives with respect to the start.
    pub fn by_start(&self) -> ByStart<'_, N, L> {
        ByStart { of: self }
    }

    /// An output at a node, with its derivatives by the parameters and by the start, in the order (p, q).
    #[cfg(feature = "fit")]
    pub(crate) fn output_at(&self, node: usize, output: usize) -> (f64, Vec<f64>, Vec<f64>) {
        let values = self.motion.outputs().row(node);
        let value = values.and_then(|row| row.get(output)).copied();
        let slopes = &self.nodes[node].outputs;
        self.parted(value.unwrap_or(f64::NAN), slopes, output)
    }

    /// The same for a coordinate.
    #[cfg(feature = "fit")]
    pub(crate) fn coordinate_at(&self, node: usize, a: usize) -> (f64, Vec<f64>, Vec<f64>) {
        let value = self.motion.states()[node].q.as_ref()[a];
        self.parted(value, &self.nodes[node].state, self.coordinates() + a)
    }

    #[cfg(feature = "fit")]
    fn parted(&self, value: f64, slopes: &DMatrix<f64>, row: usize) -> (f64, Vec<f64>, Vec<f64>) {
        let all: Vec<f64> = slopes.row(row).iter().copied().collect();
        let (by_start, by_parameters) = all.split_at(2 * self.coordinates());
        (value, by_parameters.to_vec(), by_start.to_vec())
    }

    /// The derivatives of (p, q) at a node, a column for each component of the start and each parameter.
    pub(crate) fn state_slopes(&self, node: usize) -> &DMatrix<f64> {
        &self.nodes[node].state
    }

    /// The derivatives of the time of the last node, if an event has stopped the run.
    pub(crate) fn end_times(&self) -> Option<&[f64]> {
        let (_, times) = self.events.last()?;
        self.motion.is_stopped().then_some(times)
    }

    /// The derivatives of (p, q) and of the velocities at a time of the motion; at an event, those before it.
    fn between(&self, time: f64) -> Result<Between, AtError> {
        self.motion.at(time)?;
        if self.moves(time) {
            // The derivatives at the node include the motion of the event in time; here the time is fixed.
            let mut inside = self.inside.iter();
            match inside.find(|inside| inside.times.1 == time) {
                Some(before) => return Ok(before.at(time)),
                None if self.inside.is_empty() => return Err(AtError::NotRecorded { time }),
                None => {}
            }
        }
        let number = self.motion.nodes_before(time);
        if (self.motion.states().get(number)).is_some_and(|node| node.t == time) {
            let Slopes {
                state, velocity, ..
            } = self.nodes[number].clone();
            return Ok(Between { state, velocity });
        }
        let direction = self.motion.direction();
        let begun = |inside: &Inside| direction * inside.times.0 <= direction * time;
        let after = self.inside.partition_point(begun);
        let inside = after.checked_sub(1).map(|at| &self.inside[at]);
        inside
            .map(|inside| inside.at(time))
            .ok_or(AtError::NotRecorded { time })
    }

    /// Whether this is the time of an event, which depends on the start and the parameters.
    fn moves(&self, time: f64) -> bool {
        let events = self.motion.events();
        let mut own = self.events.iter().filter_map(|(at, _)| events.get(*at));
        own.any(|event| event.t == time)
    }

    /// The derivatives at the last node.
    fn last(&self) -> &Slopes {
        self.nodes.last().expect("a run is recorded from its start")
    }

    /// The index of an output.
    fn output(&self, name: &str) -> Option<usize> {
        let names = self.motion.outputs().names();
        names.iter().position(|own| own.is(name))
    }
}

impl<const N: usize, L: Length<N>> fmt::Debug for Sensitive<N, L> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Sensitive")
            .field("parameters", &self.parameters)
            .field("nodes", &self.nodes.len())
            .finish_non_exhaustive()
    }
}

/// The derivatives of a motion with respect to one parameter a.
#[derive(Clone, Copy, Debug)]
pub struct ByParameter<'s, const N: usize, L: Length<N> = FixedLength> {
    of: &'s Sensitive<N, L>,
    column: usize,
}

impl<const N: usize, L: Length<N>> ByParameter<'_, N, L> {
    /// ∂q/∂a, ∂p/∂a and ∂v/∂a at the last node, with the time of that node.
    pub fn last(&self) -> Node<N, L> {
        self.of_node(self.of.motion.last().t, self.of.last())
    }

    /// ∂q/∂a, ∂p/∂a and ∂v/∂a at all recorded nodes, in the order of [`Motion::states`].
    pub fn states(&self) -> Vec<Node<N, L>> {
        let nodes = self.of.motion.states().iter().zip(&self.of.nodes);
        nodes
            .map(|(node, slopes)| self.of_node(node.t, slopes))
            .collect()
    }

    /// ∂q/∂a, ∂p/∂a and ∂v/∂a at any time of the motion: the derivatives of what [`Motion::at`] returns (T-154). At the
    /// time of an event, this is the derivative at that fixed time before the event, whereas [`states`](Self::states)
    /// and [`last`](Self::last) follow the event, whose time changes with a.
    ///
    /// ```
    /// use tfe::prelude::*;
    ///
    /// #[dynamics(coordinates(y), lagrangian = m/2*dot(y)^2 - m*g*y)]
    /// struct Ball { m: f64, g: f64 }
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// let ball = Ball { m: 1.0, g: 9.81 };
    /// let s = Simulation::new(&ball).step(0.5).run_sensitive(ball.state([1.0], [0.5]), 0.0..2.0)?;
    /// assert!((s.by("g").at(1.2)?.q[0] + 1.2 * 1.2 / 2.0).abs() < 1e-13);
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    /// As from [`Motion::at`].
    pub fn at(&self, time: f64) -> Result<Node<N, L>, AtError> {
        let Between { state, velocity } = self.of.between(time)?;
        Ok(self.of_columns(time, &state, &velocity))
    }

    /// The derivatives of an output at all recorded nodes; `None` if the model declares no output of this name.
    pub fn output(&self, name: &str) -> Option<Vec<f64>> {
        let row = self.of.output(name)?;
        let values = (self.of.nodes.iter()).map(|one| one.outputs[(row, self.column)]);
        Some(values.collect())
    }

    /// The derivative of the time of an event, by its index in [`Motion::events`]; `None` for events that are only
    /// recorded.
    pub fn event_time(&self, event: usize) -> Option<f64> {
        let found = self.of.events.iter().find(|(own, _)| *own == event);
        found.and_then(|(_, slopes)| slopes.get(self.column).copied())
    }

    fn of_node(&self, t: f64, slopes: &Slopes) -> Node<N, L> {
        self.of_columns(t, &slopes.state, &slopes.velocity)
    }

    fn of_columns(&self, t: f64, state: &DMatrix<f64>, velocity: &DMatrix<f64>) -> Node<N, L> {
        let state = |row: usize| state[(row, self.column)];
        let velocity = |row: usize| velocity[(row, self.column)];
        let (like, n) = (&self.of.motion.last().q, self.of.coordinates());
        Node {
            t,
            q: L::from_fn(like, |a| state(n + a)),
            p: L::from_fn(like, state),
            v: L::from_fn(like, velocity),
        }
    }
}

/// The derivatives of a motion with respect to its start: matrices of 2N × 2N, ordered (p, q), whose blocks have names
/// ([`Blocks`](crate::stability::Blocks)).
#[derive(Clone, Copy, Debug)]
pub struct ByStart<'s, const N: usize, L: Length<N> = FixedLength> {
    of: &'s Sensitive<N, L>,
}

impl<const N: usize, L: Length<N>> ByStart<'_, N, L> {
    /// ∂(p, q)/∂(p₀, q₀) at the last node.
    pub fn last(&self) -> DMatrix<f64> {
        self.matrix(&self.of.last().state)
    }

    /// ∂(p, q)/∂(p₀, q₀) at any time of the motion, as [`ByParameter::at`].
    ///
    /// # Errors
    /// As from [`Motion::at`].
    pub fn at(&self, time: f64) -> Result<DMatrix<f64>, AtError> {
        Ok(self.matrix(&self.of.between(time)?.state))
    }

    /// ∂(p, q)/∂(p₀, q₀) at all recorded nodes, in the order of [`Motion::states`].
    pub fn matrices(&self) -> Vec<DMatrix<f64>> {
        (self
            .of
            .nodes
            .iter()
            .map(|slopes| self.matrix(&slopes.state)))
        .collect()
    }

    /// The gradients of an output with respect to q₀ and p₀, at all recorded nodes; `None` if the model declares no
    /// output of this name.
    pub fn output(&self, name: &str) -> Option<Vec<L::State>> {
        let row = self.of.output(name)?;
        let (like, n) = (&self.of.motion.last().q, self.of.coordinates());
        let gradient = |slopes: &Slopes| {
            let q = L::from_fn(like, |a| slopes.outputs[(row, n + a)]);
            let p = L::from_fn(like, |a| slopes.outputs[(row, a)]);
            L::state(q, p)
        };
        Some(self.of.nodes.iter().map(gradient).collect())
    }

    fn matrix(&self, state: &DMatrix<f64>) -> DMatrix<f64> {
        let size = 2 * self.of.coordinates();
        state.columns(0, size).into_owned()
    }
}
