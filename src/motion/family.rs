//! The result of a run of a model of run-time length.

use super::at_error::AtError;
use super::checkpoint::FamilyCheckpoint;
use super::energy_scale;
use super::warning::Warning;
use crate::csv;
use crate::numbers::larger;
use std::fmt;
use std::io;
use std::path::Path;
use tfe_runtime::family::{self, FamilyDense, FamilyError, FamilyModel, FamilyState};
use tfe_runtime::{CoordinateName, Form, Statistics};

/// A state of a family with its time.
#[derive(Clone, Debug, PartialEq)]
pub struct FamilyNode {
    /// Time.
    pub t: f64,
    /// Generalized coordinates.
    pub q: Vec<f64>,
    /// Generalized momenta p = ∂L/∂v.
    pub p: Vec<f64>,
    /// Velocities dq/dt: those of the state at nodes, NaN where no velocity belongs to the momentum; between nodes the derivative of the polynomial.
    pub v: Vec<f64>,
}

impl FamilyNode {
    pub(crate) fn new(t: f64, state: FamilyState, velocity: Result<Vec<f64>, FamilyError>) -> Self {
        let FamilyState { q, p } = state;
        let v = velocity.unwrap_or_else(|_| vec![f64::NAN; q.len()]);
        Self { t, q, p, v }
    }

    /// The point of phase space, without the time.
    pub fn state(&self) -> FamilyState {
        FamilyState {
            q: self.q.clone(),
            p: self.p.clone(),
        }
    }
}

/// What a run of a family leaves of its constraints.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FamilyResidual {
    /// max |φ|
    pub position: f64,
    /// max |A v + a|
    pub velocity: f64,
}

/// The observables that a family declares by `output(name) = …` or `output(name[i in a..b]) = …`: one column each, or one for each site, `strain[0]`, `strain[1]`, …; one row a
/// recorded node.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FamilyOutputs {
    names: Vec<CoordinateName>,
    values: Vec<f64>,
}

impl FamilyOutputs {
    /// The names of the columns, in the order of declaration and of sites.
    pub fn names(&self) -> &[CoordinateName] {
        &self.names
    }

    /// The values of one column, `"extension"` or `"strain[2]"`, at the recorded nodes; `None` where there is no such column.
    pub fn column(&self, name: &str) -> Option<Vec<f64>> {
        let is_it = |candidate: &CoordinateName| candidate.to_string() == name;
        let at = self.names.iter().position(is_it)?;
        let values = self.values.iter().skip(at);
        Some(values.step_by(self.names.len()).copied().collect())
    }

    /// All columns at one recorded node, in the order of [`names`](Self::names).
    pub fn row(&self, node: usize) -> Option<&[f64]> {
        let columns = self.names.len();
        self.values.get(node * columns..(node + 1) * columns)
    }
}

/// A recorded motion of a model of run-time length: what [`Motion`](crate::Motion) is for models of fixed size, by the same names.
///
/// A node keeps 4 n numbers for n coordinates, the polynomial of an element of s stages 2 s n more: for long chains and long runs,
/// [`record_every`](crate::family::FamilySimulation::record_every) leaves nodes and polynomials out.
#[derive(Clone)]
pub struct FamilyMotion {
    nodes: Vec<FamilyNode>,
    velocities: Vec<Vec<f64>>,
    energies: Vec<f64>,
    outputs: FamilyOutputs,
    residual: (f64, f64),
    elements: Vec<FamilyDense>,
    statistics: Statistics,
    names: Vec<CoordinateName>,
    checkpoint: Option<Box<FamilyCheckpoint>>,
    warnings: Vec<Warning>,
}

impl FamilyMotion {
    /// The motion that has only its start, which is as long as the model.
    pub(crate) fn from_start<M: FamilyModel>(
        model: &M,
        t: f64,
        start: &FamilyState,
        velocity: Result<Vec<f64>, FamilyError>,
    ) -> Self {
        let mut motion = Self::empty(model, t, start);
        motion.nodes.clear();
        motion.names = (0..model.len()).map(|a| model.coordinate_name(a)).collect();
        let columns = 0..model.columns();
        motion.outputs.names = columns.map(|at| model.column_name(at)).collect();
        motion.record(model, t, start, velocity);
        motion
    }

    /// The start of a run that never began: nothing of the model is asked.
    pub(crate) fn empty<M: FamilyModel>(_: &M, t: f64, start: &FamilyState) -> Self {
        Self {
            nodes: vec![FamilyNode::new(t, start.clone(), Ok(Vec::new()))],
            velocities: Vec::new(),
            energies: Vec::new(),
            outputs: FamilyOutputs::default(),
            residual: (0.0, 0.0),
            elements: Vec::new(),
            statistics: Statistics::default(),
            names: Vec::new(),
            checkpoint: None,
            warnings: Vec::new(),
        }
    }

    /// Appends a node, with its energy and observables; NaN where no velocity belongs to the momentum.
    pub(crate) fn record<M: FamilyModel>(
        &mut self,
        model: &M,
        t: f64,
        state: &FamilyState,
        velocity: Result<Vec<f64>, FamilyError>,
    ) {
        let velocity = velocity.unwrap_or_else(|_| vec![f64::NAN; state.q.len()]);
        self.energies
            .push(family::energy(model, t, state, &velocity));
        let columns = self.outputs.names.len();
        if columns > 0 {
            let z = match M::FORM {
                Form::Lagrangian => &velocity,
                Form::Hamiltonian => &state.p,
            };
            let start = self.outputs.values.len();
            self.outputs.values.resize(start + columns, 0.0);
            model.observables(t, &state.q, z, &mut self.outputs.values[start..]);
        }
        if M::CONSTRAINED {
            let (position, velocity) = family::constraint_residual(model, t, &state.q, &velocity);
            let before = self.residual;
            self.residual = (larger(before.0, position), larger(before.1, velocity));
        }
        self.nodes
            .push(FamilyNode::new(t, state.clone(), Ok(velocity.clone())));
        self.velocities.push(velocity);
    }

    pub(crate) fn keep_element(&mut self, element: FamilyDense) {
        self.elements.push(element);
    }

    pub(crate) fn set_statistics(&mut self, statistics: Statistics) {
        self.statistics = statistics;
    }

    pub(crate) fn set_warnings(&mut self, warnings: Vec<Warning>) {
        self.warnings = warnings;
    }

    pub(crate) fn add_warning(&mut self, warning: Warning) {
        self.warnings.push(warning);
    }

    /// The energy at the last node, and p·v there.
    pub(crate) fn last_energy(&self) -> (f64, f64) {
        let velocity = self.velocities.last();
        let products = velocity.into_iter().flatten().zip(&self.last().p);
        (
            self.energies.last().copied().unwrap_or(f64::NAN),
            products.map(|(v, p)| v * p).sum(),
        )
    }

    pub(crate) fn set_checkpoint(&mut self, checkpoint: FamilyCheckpoint) {
        self.checkpoint = Some(Box::new(checkpoint));
    }

    /// Where the run ended, with all that [`FamilySimulation::resume`](crate::family::FamilySimulation::resume) needs to go on as if it had never stopped; `None` where the run
    /// failed, or was made of several.
    pub fn checkpoint(&self) -> Option<&FamilyCheckpoint> {
        self.checkpoint.as_deref()
    }

    /// The last recorded node: the end of the span after a complete run.
    pub fn last(&self) -> &FamilyNode {
        self.nodes.last().expect("a motion is made with its start")
    }

    /// The recorded nodes, in the order of time.
    pub fn states(&self) -> &[FamilyNode] {
        &self.nodes
    }

    /// The velocities dq/dt at the recorded nodes.
    pub fn velocities(&self) -> &[Vec<f64>] {
        &self.velocities
    }

    /// The energy H = p·v − L at the recorded nodes.
    pub fn energies(&self) -> &[f64] {
        &self.energies
    }

    /// The state at a time between the nodes, from the element's own polynomial.
    ///
    /// # Errors
    /// [`AtError::Outside`] beyond the span, [`AtError::NotRecorded`] where `record_every` left the element out.
    pub fn at(&self, time: f64) -> Result<FamilyNode, AtError> {
        let (start, end) = (self.nodes[0].t, self.last().t);
        if !((start.min(end)..=start.max(end)).contains(&time)) {
            return Err(AtError::Outside { time, start, end });
        }
        let direction = if end < start { -1.0 } else { 1.0 };
        let before = |t: f64| direction * t < direction * time;
        let node = self.nodes.partition_point(|node| before(node.t));
        if let Some(node) = self.nodes.get(node).filter(|node| node.t == time) {
            return Ok(node.clone());
        }
        let after = self.elements.partition_point(|one| before(one.start()));
        let element = after.checked_sub(1).and_then(|at| self.elements.get(at));
        match element {
            Some(element) if direction * element.end() >= direction * time => {
                let velocity = element.velocity_at_time(time);
                Ok(FamilyNode::new(time, element.at_time(time), Ok(velocity)))
            }
            _ => Err(AtError::NotRecorded { time }),
        }
    }

    /// Largest change of the energy over the recorded nodes, relative to the energy at the start (absolute where that is zero, or not more than a rounding beside p·v):
    ///
    /// ```text
    /// max |H(t) − H(t₀)| / |H(t₀)|
    /// ```
    pub fn energy_error(&self) -> f64 {
        let Some(&start) = self.energies.first() else {
            return 0.0;
        };
        let nodes = self.nodes.iter().zip(&self.velocities);
        let scale = energy_scale(start, nodes.map(|(node, v)| (&node.p[..], &v[..])));
        let changes = self.energies.iter().map(|energy| (energy - start).abs());
        changes.map(|change| change / scale).fold(0.0, larger)
    }

    /// What the run leaves of its constraints: the largest |φ| and |A v + a| over all recorded nodes; zeros for models without any.
    pub fn constraint_residual(&self) -> FamilyResidual {
        let (position, velocity) = self.residual;
        FamilyResidual { position, velocity }
    }

    /// What is doubtful about the motion although the run came to its end, or to where it failed: energies that are not finite ([`Warning::EnergyNotFinite`]), or that jump although the
    /// model conserves them ([`Warning::EnergyJump`]); in runs with an estimate of their error, that steps go across kinks ([`Warning::KinksCrossed`]).
    pub fn warnings(&self) -> &[Warning] {
        &self.warnings
    }

    /// What the run cost.
    pub fn statistics(&self) -> &Statistics {
        &self.statistics
    }

    /// The observables at the recorded nodes.
    pub fn outputs(&self) -> &FamilyOutputs {
        &self.outputs
    }

    /// Writes the recorded nodes as CSV: time, coordinates, velocities, momenta, energy, observables, with a header line. Numbers are written
    /// so that they read back exactly.
    ///
    /// # Errors
    /// Those of the file system.
    pub fn write_csv(&self, path: impl AsRef<Path>) -> io::Result<()> {
        let mut header = vec!["t".to_owned()];
        header.extend(self.names.iter().map(ToString::to_string));
        header.extend(self.names.iter().map(|name| format!("{name}_dot")));
        header.extend(self.names.iter().map(|name| format!("p_{name}")));
        header.push("energy".to_owned());
        header.extend(self.outputs.names.iter().map(ToString::to_string));
        let rows = self.nodes.iter().enumerate().map(|(k, node)| {
            let mut row = vec![node.t];
            row.extend(&node.q);
            row.extend(self.velocities.get(k).into_iter().flatten());
            row.extend(&node.p);
            row.extend(self.energies.get(k));
            row.extend(self.outputs.row(k).unwrap_or_default());
            row
        });
        csv::write(path.as_ref(), &header, rows)
    }
}

impl fmt::Debug for FamilyMotion {
    /// The extent of the motion, not its thousands of numbers.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("FamilyMotion")
            .field("coordinates", &self.nodes[0].q.len())
            .field("nodes", &self.nodes.len())
            .field("start", &self.nodes[0].t)
            .field("end", &self.last().t)
            .field("statistics", &self.statistics)
            .field("warnings", &self.warnings)
            .finish_non_exhaustive()
    }
}
