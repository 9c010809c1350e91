//! Periodic orbits: elements over one period, assembled and closed, and the Floquet multipliers of the solution.
//!
//! ```text
//! δy_{e+1} − A_e δy_e − C_e δT = r_e ,   e = 0 … E − 1 ;      y_E = y_0 ;      one condition of phase if T is unknown
//! ```
//!
//! (`docs/theory.md`, (T-81)–(T-83)). The system is solved by structured orthogonal elimination: its cost is linear in the number E of
//! elements, and growing and decaying directions do not disturb each other. The multipliers are the eigenvalues of A_E ⋯ A_1; they come from
//! a periodic Schur decomposition of the matrices of the elements ([`crate::periodic_schur`]), never from the product, so that a multiplier of
//! 10⁻¹² keeps its digits beside one of 10¹².

mod family;
mod hybrid;
pub(crate) mod orbit;
pub(crate) mod problem;

pub use family::Orbits;
#[cfg(feature = "sparse")]
pub use family::{FamilyOrbit, FamilyPeriodicOrbit};
pub use hybrid::{HybridOrbit, HybridOrbits};
pub use orbit::{Exponent, Orbit, Verdict};

use crate::assembly::{Assembly, AssemblyError, Control, Curve, Iterate, Mesh, MeshError};
use crate::error::RunErrorKind;
use crate::motion::Motion;
use crate::periodic_schur::PeriodicSchurError;
use crate::simulation::Simulation;
use problem::{Global, Periodic};
use std::fmt;
use tfe_runtime::length::Declared;
use tfe_runtime::{Element, LegendreError, Mixed, Model, State, StepError, constrained, legendre};

/// Which of the orbits of an autonomous model is meant: they differ in where the time begins.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub enum Phase {
    /// Each correction is orthogonal to the flow, ∫ ẏ·δy dt = 0: the phase stays that of the guess.
    #[default]
    Orthogonal,
    /// A coordinate has this value at the start. The flow must cross it: q̇ ≠ 0 there.
    Coordinate {
        /// Which coordinate.
        index: usize,
        /// Its value.
        value: f64,
    },
    /// A momentum has this value at the start; zero for a turning point of a coordinate with a momentum of its own.
    Momentum {
        /// Which momentum.
        index: usize,
        /// Its value.
        value: f64,
    },
}

/// The period of an orbit: known, or a first guess.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Period {
    Missing,
    Known(f64),
    Guess(f64),
}

impl Period {
    fn checked(self) -> Result<f64, OrbitError> {
        match self {
            Self::Missing => Err(OrbitError::NoPeriod),
            Self::Known(period) | Self::Guess(period) if period.is_finite() && period > 0.0 => {
                Ok(period)
            }
            Self::Known(period) | Self::Guess(period) => Err(OrbitError::Period { period }),
        }
    }
}

/// Where Newton's method starts.
enum Guess<'m, const N: usize> {
    Rest,
    Curve(Curve<'m, N>),
    Start(State<N>),
}

/// A periodic orbit to be found.
///
/// - *Forced*: the model depends on time, its [`period`](Self::period) T is known. The default guess, rest, is enough for linear models.
/// - *Autonomous with damping or forces*: isolated orbits; T is unknown ([`unknown_period`](Self::unknown_period)) and a [`Phase`] is chosen.
/// - *Conservative*: orbits come in families. Give the period, or with an unknown one the [`energy`](Self::energy) (that of the guess if none
///   is given). The equations are made regular by an unfolding force γ v, which vanishes in the solution ([`Orbit::unfolding`]).
///
/// Defaults: `Mixed::<4>` (order 6), 40 equal elements, a solution to round-off.
///
/// ```
/// use std::f64::consts::TAU;
/// use tfe::prelude::*;
///
/// #[dynamics(coordinates(x), lagrangian = dot(x)^2/2 - alpha/2*x^2 - beta/4*x^4,
///            force(x) = f*cos(omega*t) - delta*dot(x))]
/// struct Duffing { alpha: f64, beta: f64, delta: f64, f: f64, omega: f64 }
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let duffing = Duffing { alpha: 1.0, beta: 1.0, delta: 0.2, f: 0.3, omega: 1.4 };
/// let orbit = PeriodicOrbit::of(&duffing)
///     .element(Mixed::<6>)
///     .elements(40)
///     .period(TAU / duffing.omega)
///     .guess(|t| ([-0.3 * (1.4 * t).cos()], [0.42 * (1.4 * t).sin()]))
///     .solve()?;
/// assert!((orbit.start().q[0] + 0.3096102638785593).abs() < 1e-12);
/// assert!((orbit.multipliers()[0].norm().powi(2) - (-0.2 * orbit.period()).exp()).abs() < 1e-12);
/// assert!(orbit.is_stable());
/// # Ok(())
/// # }
/// ```
pub struct PeriodicOrbit<'m, M, const N: usize> {
    model: &'m M,
    element: Element,
    elements: usize,
    weights: Vec<f64>,
    start: f64,
    period: Period,
    guess: Guess<'m, N>,
    phase: Phase,
    energy: Option<f64>,
    advance: [f64; N],
    control: Control,
}

impl<'m, M, const N: usize> PeriodicOrbit<'m, M, N> {
    /// An orbit of `model`, with the defaults: this type for a model of fixed size, `FamilyPeriodicOrbit` (with the feature `sparse`) for one of
    /// run-time length, which has methods of the same names.
    pub fn of(model: &'m M) -> <M::Length as Orbits<M, N>>::Orbit<'m>
    where
        M: Declared<N, Length: Orbits<M, N>>,
    {
        M::Length::with_defaults(model)
    }
}

impl<'m, M: Model<N>, const N: usize> PeriodicOrbit<'m, M, N> {
    fn with_defaults(model: &'m M) -> Self {
        Self {
            model,
            element: Mixed::<4>.into(),
            elements: 40,
            weights: Vec::new(),
            start: 0.0,
            period: Period::Missing,
            guess: Guess::Rest,
            phase: Phase::default(),
            energy: None,
            advance: [0.0; N],
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

    /// The time at which the period begins; 0 by default. What counts is where a forced model is then.
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
    pub fn guess(mut self, curve: impl Fn(f64) -> ([f64; N], [f64; N]) + 'm) -> Self {
        self.guess = Guess::Curve(Box::new(curve));
        self
    }

    /// Where to begin: the motion that starts here, over one (guessed) period.
    #[must_use]
    pub fn guess_from(mut self, state: State<N>) -> Self {
        self.guess = Guess::Start(state);
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

    /// How much the coordinates grow over a period: a full turn for an angle that rotates. Zero by default.
    #[must_use]
    pub fn advance(mut self, advance: [f64; N]) -> Self {
        self.advance = advance;
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
    pub fn solve(&self) -> Result<Orbit<'m, M, N>, OrbitError> {
        let (problem, iterate, assembly) = self.solved()?;
        let unfolded = problem.globals.contains(&Global::Unfolding);
        let unfolding = unfolded.then_some(problem.unfolding);
        Orbit::new(self.element, &problem, iterate, &assembly, unfolding)
    }

    /// The equations and their solution.
    pub(crate) fn solved(&self) -> Result<Solved<'m, M, N>, OrbitError> {
        let period = self.period.checked()?;
        let autonomous = !M::FACTS.time_dependent;
        let conservative = autonomous && !M::FACTS.forced;
        let mut problem = Periodic {
            model: self.model,
            mesh: Mesh::new(self.elements, &self.weights)?,
            start: self.start,
            period,
            unfolding: 0.0,
            globals: Vec::new(),
            advance: self.advance,
            phase: None,
            energy: None,
        };
        let curve = self.curve(period)?;
        let at_rest = autonomous
            && matches!(self.period, Period::Known(_))
            && self.is_constant(&curve, period);
        if matches!(self.period, Period::Guess(_)) {
            if !autonomous {
                return Err(OrbitError::ForcedPeriod);
            }
            problem.globals.push(Global::Period);
        }
        if autonomous && !at_rest {
            problem.phase = Some(self.checked_phase()?);
            if conservative || problem.globals.is_empty() {
                problem.globals.push(Global::Unfolding);
            }
            if problem.globals.len() == 2 {
                problem.energy = Some(self.energy_of(&curve)?);
            }
        }
        let globals: Vec<f64> = problem
            .globals
            .iter()
            .map(|global| match global {
                Global::Period => period,
                Global::Unfolding => 0.0,
            })
            .collect();
        let mut assembly =
            Assembly::new::<M>(self.element, self.elements, globals.len(), problem.dense())
                .map_err(AssemblyError::Element)?;
        let mut iterate = assembly
            .along(&problem, &curve, globals)
            .map_err(AssemblyError::Legendre)?;
        assembly.solve(&mut problem, &mut iterate, self.control)?;
        problem.check()?;
        Ok((problem, iterate, assembly))
    }

    /// The element, and how a solution is iterated.
    pub(crate) fn method(&self) -> (Element, Control) {
        (self.element, self.control)
    }

    fn checked_phase(&self) -> Result<Phase, OrbitError> {
        match self.phase {
            Phase::Coordinate { index, .. } | Phase::Momentum { index, .. } if index >= N => {
                Err(OrbitError::Phase { index })
            }
            phase => Ok(phase),
        }
    }

    /// The guess as a curve.
    fn curve(&self, period: f64) -> Result<Curve<'_, N>, OrbitError> {
        Ok(match &self.guess {
            Guess::Rest => {
                let (advance, start) = (self.advance, self.start);
                Box::new(move |t| {
                    let turn = (t - start) / period;
                    (advance.map(|a| a * turn), advance.map(|a| a / period))
                })
            }
            Guess::Curve(curve) => Box::new(curve),
            Guess::Start(state) => {
                let motion = Simulation::new(self.model)
                    .element(self.element)
                    .step(period / self.elements as f64)
                    .run(*state, self.start..self.start + period)
                    .map_err(|error| OrbitError::Guess(error.kind().clone()))?;
                let model = self.model;
                Box::new(move |t| along_motion(model, &motion, t))
            }
        })
    }

    /// Whether the guess does not move: an equilibrium, whose multipliers are asked for.
    fn is_constant(&self, curve: &Curve<'_, N>, period: f64) -> bool {
        let (first, _) = curve(self.start);
        (0..=16).all(|k| {
            let (q, v) = curve(self.start + period * f64::from(k) / 16.0);
            q == first && v == [0.0; N]
        }) && self.advance == [0.0; N]
    }

    fn energy_of(&self, curve: &Curve<'_, N>) -> Result<f64, OrbitError> {
        if let Some(energy) = self.energy {
            return Ok(energy);
        }
        let (q, v) = curve(self.start);
        let energy = legendre::state(self.model, self.start, &q, &v)
            .and_then(|state| legendre::energy(self.model, self.start, &state.q, &state.p))
            .map_err(AssemblyError::Legendre)?;
        Ok(energy)
    }
}

/// The equations of an orbit, their solution and the memory that it took.
pub(crate) type Solved<'m, M, const N: usize> = (Periodic<'m, M, N>, Iterate<N>, Assembly<N>);

/// Coordinates and velocities of a motion; its last ones beyond its end.
pub(crate) fn along_motion<M: Model<N>, const N: usize>(
    model: &M,
    motion: &Motion<N>,
    t: f64,
) -> ([f64; N], [f64; N]) {
    let node = motion.at(t).unwrap_or(*motion.last());
    let velocity = constrained::velocity(model, t, &node.q, &node.p, &[0.0; N]);
    (node.q, velocity.unwrap_or([0.0; N]))
}

/// Why there is no orbit.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum OrbitError {
    /// No period was given, neither a known one nor a guess.
    NoPeriod,
    /// The period is not positive: as given, or as found.
    Period {
        /// Its value.
        period: f64,
    },
    /// The model depends on time: the period of its orbits is that of the forcing (or a multiple), not an unknown.
    ForcedPeriod,
    /// The mesh makes no sense.
    Mesh(MeshError),
    /// The condition of phase names a coordinate that does not exist.
    Phase {
        /// Which.
        index: usize,
    },
    /// The run that was to give the guess failed.
    Guess(RunErrorKind),
    /// A motion of an orbit with events failed.
    Run(RunErrorKind),
    /// An event stopped a motion before its period had passed.
    Stopped {
        /// When.
        time: f64,
    },
    /// Corrections no longer bring the end of a motion with events nearer to its start.
    Stalled {
        /// How far they are apart, in parts of the motion.
        residual: f64,
        /// Corrections so far.
        iterations: u32,
    },
    /// Orbits with events are not found for models with constraints: minimal coordinates are needed.
    HybridConstraints,
    /// The assembled equations were not solved.
    Assembly(AssemblyError),
    /// An autonomous model has no orbit of this period: the equations can only be met with an additional force γ v.
    NoFamily {
        /// The γ that would be needed.
        unfolding: f64,
    },
    /// The constraints do not span the same motions at all nodes, or the model has no velocity at one.
    Constraints(StepError),
    /// The multipliers could not be computed.
    Multipliers(PeriodicSchurError),
    /// A model of run-time length does not fit together, or its steps cannot be differentiated.
    #[cfg(feature = "sparse")]
    Family(tfe_runtime::family::FamilyTransitionError),
}

impl From<AssemblyError> for OrbitError {
    fn from(error: AssemblyError) -> Self {
        Self::Assembly(error)
    }
}

impl From<MeshError> for OrbitError {
    fn from(error: MeshError) -> Self {
        Self::Mesh(error)
    }
}

impl From<LegendreError> for OrbitError {
    fn from(error: LegendreError) -> Self {
        Self::Assembly(error.into())
    }
}

impl fmt::Display for OrbitError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoPeriod => {
                f.write_str("no period: give `.period(T)`, or `.unknown_period(guess)` for an autonomous model")
            }
            Self::Period { period } => write!(f, "the period is {period}, it must be positive"),
            Self::ForcedPeriod => f.write_str(
                "the model depends on time, so its orbits have the period of the forcing: give it with `.period(T)`",
            ),
            Self::Mesh(error) => error.fmt(f),
            Self::Phase { index } => {
                write!(f, "the condition of phase names coordinate {index}, which does not exist")
            }
            Self::Guess(error) => write!(f, "the motion that was to be the guess: {error}"),
            Self::Run(error) => write!(f, "a motion on the way to the orbit: {error}"),
            Self::Stopped { time } => {
                write!(f, "an event ends the motion at t = {time}, before a period has passed")
            }
            Self::Stalled {
                residual,
                iterations,
            } => write!(
                f,
                "no orbit near the guess: after {iterations} corrections end and start are {residual:.1e} of the motion apart"
            ),
            Self::HybridConstraints => f.write_str(
                "orbits with events are found for models without constraints only: declare minimal coordinates",
            ),
            Self::Assembly(error) => error.fmt(f),
            Self::NoFamily { unfolding } => write!(
                f,
                "no orbit of this period near the guess: only an additional force {unfolding:.1e} v closes it; \
                 if the model has an isolated orbit, give `.unknown_period(guess)`"
            ),
            Self::Constraints(error) => write!(f, "the constraints: {error}"),
            Self::Multipliers(error) => write!(f, "the multipliers: {error}"),
            #[cfg(feature = "sparse")]
            Self::Family(error) => error.fmt(f),
        }
    }
}

impl std::error::Error for OrbitError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::Mesh(error) => Some(error),
            Self::Guess(error) | Self::Run(error) => Some(error),
            Self::Assembly(error) => error.source(),
            Self::Multipliers(error) => Some(error),
            #[cfg(feature = "sparse")]
            Self::Family(error) => error.source(),
            _ => None,
        }
    }
}
