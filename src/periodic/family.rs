//! Periodic orbits of models of run-time length.

mod orbit;
mod shooting;

pub use orbit::FamilyOrbit;

use super::error::OrbitError;
use super::phase::{Period, Phase};
use super::problem::Global;
use crate::assembly::{Control, Mesh};
use crate::simulation::Simulation;
use shooting::Shooting;
use tfe_runtime::family::{self, FamilyModel, FamilyState};
use tfe_runtime::{Element, Mixed};

/// A curve t ↦ (q, dq/dt).
type LongCurve<'m> = Box<dyn Fn(f64) -> (Vec<f64>, Vec<f64>) + 'm>;

/// Where Newton's method starts.
enum LongGuess<'m> {
    Rest,
    Curve(LongCurve<'m>),
    Start(FamilyState),
}

/// A periodic orbit of a model of run-time length, to be found; made by [`PeriodicOrbit::of`](crate::PeriodicOrbit::of), whose methods and rules are the same.
///
/// Elements are stepped from all nodes, with their derivatives by implicit differentiation of the step ([`FamilyTransition`](crate::stability::FamilyTransition)):
/// multiple shooting.
///
/// ```text
/// δy_{e+1} − A_e δy_e − C_e δγ = Y_e(y_e, γ) − y_{e+1} ,   e = 0 … E − 1 ;      y_E = y_0                    (theory.md, (T-81), (T-82))
/// ```
///
/// The matrices A_e are dense, 2n × 2n, and so are the equations that close the chain and the multipliers: E (2n)² numbers of memory and of the order of
/// 10 E (2n)³ operations an iteration. Tens of coordinates are quick, two hundred take minutes.
///
/// The kinetic energy may be any of a Lagrangian; that of a Hamiltonian has to be ½ Σ p²/m. Constraints are not supported.
///
/// ```
/// use std::f64::consts::TAU;
/// use tfe::prelude::*;
///
/// #[dynamics(
///     coordinates(q[n]),
///     lagrangian = sum(i in 0..n, dot(q[i])^2/2 - q[i]^2/2) - sum(i in 0..n-1, (q[i+1]-q[i])^2/2 + (q[i+1]-q[i])^4/4),
///     dissipation = sum(i in 0..n, c/2*dot(q[i])^2),
///     force(q[0]) = f*cos(omega*t),
/// )]
/// struct Row { n: usize, c: f64, f: f64, omega: f64 }
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let row = Row { n: 8, c: 0.2, f: 0.3, omega: 1.3 };
/// let orbit = PeriodicOrbit::of(&row).elements(20).period(TAU / row.omega).solve()?;
/// assert!(orbit.is_stable());
/// // Damping c shrinks volumes of phase space by e^(−cT) a coordinate.
/// let volume: f64 = orbit.floquet().iter().map(|multiplier| multiplier.log_modulus).sum();
/// assert!((volume + 8.0 * 0.2 * orbit.period()).abs() < 1e-4);
/// # Ok(())
/// # }
/// ```
pub struct FamilyPeriodicOrbit<'m, M> {
    model: &'m M,
    element: Element,
    elements: usize,
    weights: Vec<f64>,
    start: f64,
    period: Period,
    guess: LongGuess<'m>,
    phase: Phase,
    energy: Option<f64>,
    control: Control,
}

impl<'m, M: FamilyModel> FamilyPeriodicOrbit<'m, M> {
    /// An orbit of `model` with the defaults: what [`PeriodicOrbit::of`](crate::PeriodicOrbit::of) gives, for code that is generic over the model.
    pub fn new(model: &'m M) -> Self {
        Self {
            model,
            element: Mixed::<4>.into(),
            elements: 40,
            weights: Vec::new(),
            start: 0.0,
            period: Period::Missing,
            guess: LongGuess::Rest,
            phase: Phase::default(),
            energy: None,
            control: Control::default(),
        }
    }

    /// The element: `Mixed::<6>`, `Element::primal(n)`, …
    #[must_use]
    pub fn element(mut self, element: impl Into<Element>) -> Self {
        self.element = element.into();
        self
    }

    /// The number of elements, equally long unless [`graded`](Self::graded).
    #[must_use]
    pub fn elements(mut self, elements: usize) -> Self {
        self.elements = elements;
        self
    }

    /// One element a weight, each as long as its weight says beside the others: short where much happens.
    #[must_use]
    pub fn graded(mut self, weights: impl IntoIterator<Item = f64>) -> Self {
        self.weights = weights.into_iter().collect();
        self.elements = self.weights.len();
        self
    }

    /// The time at which the period begins; 0 by default.
    #[must_use]
    pub fn start_time(mut self, time: f64) -> Self {
        self.start = time;
        self
    }

    /// The period, known.
    #[must_use]
    pub fn period(mut self, period: f64) -> Self {
        self.period = Period::Known(period);
        self
    }

    /// The period is to be found, near `guess`.
    #[must_use]
    pub fn unknown_period(mut self, guess: f64) -> Self {
        self.period = Period::Guess(guess);
        self
    }

    /// Where to begin: a curve t ↦ (q, dq/dt), roughly the orbit.
    #[must_use]
    pub fn guess(mut self, curve: impl Fn(f64) -> (Vec<f64>, Vec<f64>) + 'm) -> Self {
        self.guess = LongGuess::Curve(Box::new(curve));
        self
    }

    /// Where to begin: the motion that starts here, over one (guessed) period.
    #[must_use]
    pub fn guess_from(mut self, state: FamilyState) -> Self {
        self.guess = LongGuess::Start(state);
        self
    }

    /// Which of the orbits that differ in phase; for autonomous models.
    #[must_use]
    pub fn phase(mut self, phase: Phase) -> Self {
        self.phase = phase;
        self
    }

    /// The energy of the orbit of a conservative model with unknown period.
    #[must_use]
    pub fn energy(mut self, energy: f64) -> Self {
        self.energy = Some(energy);
        self
    }

    /// When the iteration is done: the relative size of the last correction, 10⁻¹³ by default. The correction that meets it is applied.
    #[must_use]
    pub fn tolerance(mut self, tolerance: f64) -> Self {
        self.control.tolerance = tolerance;
        self
    }

    /// The most iterations of Newton's method, 50 by default.
    #[must_use]
    pub fn max_iterations(mut self, iterations: u32) -> Self {
        self.control.max_iterations = iterations;
        self
    }

    /// Finds the orbit and its multipliers.
    ///
    /// # Errors
    /// [`OrbitError`]: what was asked for makes no sense, or there is no solution near the guess.
    pub fn solve(&self) -> Result<FamilyOrbit<'m, M>, OrbitError> {
        let period = self.period.checked()?;
        self.model
            .check()
            .map_err(|error| OrbitError::Family(error.into()))?;
        let autonomous = !(M::FACTS.time_dependent || M::MOMENTA_MOVE);
        let conservative = autonomous && !M::FACTS.forced;
        let known = matches!(self.period, Period::Known(_));
        if !(autonomous || known) {
            return Err(OrbitError::ForcedPeriod);
        }
        let mesh = Mesh::new(self.elements, &self.weights)?;
        let nodes = self.nodes(&mesh, period)?;
        let mut shooting =
            Shooting::new(self.model, self.element, mesh, (self.start, period), nodes);
        let at_rest = autonomous && known && shooting.is_at_rest();
        if !known {
            shooting.globals.push(Global::Period);
        }
        if autonomous && !at_rest {
            shooting.phase = Some(self.checked_phase()?);
            if conservative || known {
                shooting.globals.push(Global::Unfolding);
            }
            if shooting.globals.len() == 2 {
                let energy = self.energy.or_else(|| shooting.energy_of_start());
                shooting.energy = energy;
            }
        }
        shooting.solve(self.control)?;
        FamilyOrbit::new(shooting)
    }

    fn checked_phase(&self) -> Result<Phase, OrbitError> {
        let n = self.model.len();
        match self.phase {
            Phase::Coordinate { index, .. } | Phase::Momentum { index, .. } if index >= n => {
                Err(OrbitError::Phase { index })
            }
            phase => Ok(phase),
        }
    }

    /// The states of the guess at the nodes.
    fn nodes(&self, mesh: &Mesh, period: f64) -> Result<Vec<FamilyState>, OrbitError> {
        let n = self.model.len();
        let state = |t: f64, (q, v): (Vec<f64>, Vec<f64>)| {
            let p = family::momenta(self.model, t, &q, &v);
            let p = p.map_err(|error| OrbitError::Family(error.into()))?;
            Ok(FamilyState { q, p })
        };
        let mut times = mesh.times(self.start, period);
        match &self.guess {
            LongGuess::Rest => times
                .map(|t| state(t, (vec![0.0; n], vec![0.0; n])))
                .collect(),
            LongGuess::Curve(curve) => times.map(|t| state(t, curve(t))).collect(),
            LongGuess::Start(start) => {
                let simulation = Simulation::new(self.model)
                    .element(self.element)
                    .step(period / self.elements as f64);
                let motion = simulation
                    .run(start.clone(), self.start..self.start + period)
                    .map_err(|error| OrbitError::Guess(error.kind().clone()))?;
                let last = motion.last().t;
                times.try_fold(Vec::new(), |mut nodes, t| {
                    let node = motion.at(t.min(last));
                    nodes.push(node.map_or_else(|_| motion.last().state(), |node| node.state()));
                    Ok(nodes)
                })
            }
        }
    }
}
