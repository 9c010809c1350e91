//! The definition of a periodic orbit to be found, and of how it is solved.

use super::error::OrbitError;
use super::kind::Closed;
use super::orbit::Orbit;
use super::phase::{Period, Phase};
use super::problem::{Global, Periodic, inertia_of};
use super::rest::{Extent, is_at_rest, may_rest};
use crate::assembly::{
    Assembly, AssemblyError, Control, Curve, HalvedCorrection, Iterate, Mesh, MeshWarning,
    crossed_kinks,
};
use crate::length::{Declared, FixedLength, Length};
use crate::motion::Motion;
use crate::simulation::Simulation;
use tfe_runtime::{Element, LegendreError, Mixed, Model, Statistics, constrained, legendre};

/// A curve t ↦ (q, dq/dt).
type ClosedCurve<'m, V> = Box<dyn Fn(f64) -> (V, V) + 'm>;

/// The first guess of Newton's method.
pub(super) enum Guess<'m, const N: usize, L: Length<N>> {
    Rest,
    Curve(ClosedCurve<'m, L::Vector>),
    Start(L::State),
}

/// The search for a periodic orbit of a model.
///
/// - *Forced*: the model depends on time, and its [`period`](Self::period) T is known. The default guess, rest, is
///   enough for linear models. At resonance without damping there is no orbit: [`AssemblyError::Singular`].
/// - *Autonomous, with damping or forces*: orbits are isolated (limit cycles). T is unknown
///   ([`unknown_period`](Self::unknown_period)), and a [`Phase`] condition is chosen.
/// - *Conservative*: orbits come in families. Give the period, or make it unknown and give the
///   [`energy`](Self::energy) (by default that of the guess). An unfolding force γ v, which vanishes in the solution,
///   makes the equations regular ([`Orbit::unfolding`]).
///
/// A search for an orbit of an autonomous model that ends at an equilibrium is an error, [`OrbitError::AtRest`]. For
/// the multipliers of an equilibrium, give the period and a guess that does not move.
///
/// Defaults: element `Mixed::<4>` (order 6), 40 equal elements, a solution up to rounding.
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
///
/// # Models of run-time length
/// With the feature `sparse`, periodic orbits of models of run-time length are found by multiple shooting: each
/// element is a step from its node, with its derivative by implicit differentiation (`stability::TransitionOperator`).
///
/// ```text
/// δy_{e+1} − A_e δy_e − C_e δγ = Y_e(y_e, γ) − y_{e+1} ,   e = 0 … E − 1 ;      y_E = y_0                    (theory.md, (T-81), (T-82))
/// ```
///
/// The matrices A_e are dense, 2n × 2n, and so are the equations that close the chain. Memory is E (2n)² numbers, and
/// an iteration takes on the order of 10 E (2n)³ operations. Tens of coordinates are quick, two hundred take minutes.
///
/// A Lagrangian may have any kinetic energy; a Hamiltonian must have ½ Σ p²/m. [`advance`](Self::advance) is not
/// supported.
#[cfg_attr(feature = "sparse", doc = include_str!("family.md"))]
pub struct PeriodicOrbit<'m, M, const N: usize, L: Length<N> = FixedLength> {
    pub(super) model: &'m M,
    pub(super) element: Element,
    pub(super) elements: usize,
    pub(super) weights: Vec<f64>,
    pub(super) start: f64,
    pub(super) period: Period,
    pub(super) guess: Guess<'m, N, L>,
    pub(super) phase: Phase,
    pub(super) energy: Option<f64>,
    /// `None`: zeros.
    pub(super) advance: Option<L::Vector>,
    pub(super) control: Control,
}

impl<'m, M, const N: usize, L: Length<N>> PeriodicOrbit<'m, M, N, L> {
    /// A search for an orbit of `model`, with the defaults. A model of run-time length needs the feature `sparse`.
    pub fn of(model: &'m M) -> Self
    where
        M: Declared<N, Length = L>,
        L: Closed<M, N>,
    {
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
            advance: None,
            control: Control::default(),
        }
    }

    /// Sets the element: `Mixed::<6>`, `Element::primal(n)`, …
    #[must_use]
    pub fn element(mut self, element: impl Into<Element>) -> Self {
        self.element = element.into();
        self
    }

    /// Sets the number of elements in the period, all of the same length. Of this call and [`graded`](Self::graded)
    /// the last one counts.
    #[must_use]
    pub fn elements(mut self, elements: usize) -> Self {
        self.elements = elements;
        self.weights.clear();
        self
    }

    /// Sets one element for each weight, with lengths proportional to the weights: short elements where the motion is
    /// fast.
    #[must_use]
    pub fn graded(mut self, weights: impl IntoIterator<Item = f64>) -> Self {
        self.weights = weights.into_iter().collect();
        self.elements = self.weights.len();
        self
    }

    /// Sets the time at which the period begins, which matters for forced models; 0 by default.
    #[must_use]
    pub fn start_time(mut self, time: f64) -> Self {
        self.start = time;
        self
    }

    /// Sets the period, if it is known.
    #[must_use]
    pub fn period(mut self, period: f64) -> Self {
        self.period = Period::Known(period);
        self
    }

    /// Makes the period an unknown; the search begins at `guess`.
    #[must_use]
    pub fn unknown_period(mut self, guess: f64) -> Self {
        self.period = Period::Guess(guess);
        self
    }

    /// Sets the first guess: a curve t ↦ (q, dq/dt) near the orbit.
    #[must_use]
    pub fn guess(mut self, curve: impl Fn(f64) -> (L::Vector, L::Vector) + 'm) -> Self {
        self.guess = Guess::Curve(Box::new(curve));
        self
    }

    /// Sets the first guess: the motion that starts at this state, over one (guessed) period.
    #[must_use]
    pub fn guess_from(mut self, state: L::State) -> Self {
        self.guess = Guess::Start(state);
        self
    }

    /// Sets the phase condition, for autonomous models: it selects one of the orbits that differ only in their phase.
    #[must_use]
    pub fn phase(mut self, phase: Phase) -> Self {
        self.phase = phase;
        self
    }

    /// Sets the energy of the orbit, for conservative models with unknown period. For other orbits the energy is not
    /// free, and the call is an error, [`OrbitError::Unsupported`].
    #[must_use]
    pub fn energy(mut self, energy: f64) -> Self {
        self.energy = Some(energy);
        self
    }

    /// Sets by how much the coordinates grow over a period, for example a full turn of an angle that rotates; zero by
    /// default.
    #[must_use]
    pub fn advance(mut self, advance: L::Vector) -> Self {
        self.advance = Some(advance);
        self
    }

    /// Sets when the iteration is finished: when the last correction, relative to the orbit, is at most this; 10⁻¹³ by
    /// default. That correction is still applied.
    ///
    /// Coordinates are measured relative to the largest coordinate, momenta relative to the largest momentum.
    /// Components that are much smaller, such as an angle beside a distance, are corrected by up to six more
    /// iterations for as long as these improve them.
    #[must_use]
    pub fn tolerance(mut self, tolerance: f64) -> Self {
        self.control.tolerance = tolerance;
        self
    }

    /// Sets the largest number of iterations of Newton's method, 50 by default.
    #[must_use]
    pub fn max_iterations(mut self, iterations: u32) -> Self {
        self.control.max_iterations = iterations;
        self
    }

    /// Refuses numbers that are not finite, and tolerances that are none.
    pub(super) fn check_numbers(&self) -> Result<(), OrbitError> {
        self.control.check()?;
        let phase = match self.phase {
            Phase::Coordinate { value, .. } | Phase::Momentum { value, .. } => value,
            Phase::Orthogonal => 0.0,
        };
        let given = [
            ("time of the start", self.start),
            ("energy", self.energy.unwrap_or(0.0)),
            ("value of the phase condition", phase),
        ];
        if let Some(advance) = &self.advance {
            check_advance(advance.as_ref())?;
        }
        let wrong = given.into_iter().find(|(_, value)| !value.is_finite());
        wrong.map_or(Ok(()), |(what, value)| {
            Err(OrbitError::Number { what, value })
        })
    }

    /// Refuses a prescribed energy for models in which other conditions determine it.
    pub(super) fn check_energy(&self, conservative: bool) -> Result<(), OrbitError> {
        let of = match (self.energy, self.period) {
            (None, _) => return Ok(()),
            (Some(_), Period::Known(_)) => "orbits of a known period",
            (Some(_), _) if conservative => return Ok(()),
            (Some(_), _) => "orbits of models with forces or dissipation",
        };
        let call = "energy";
        Err(OrbitError::Unsupported { call, of })
    }

    pub(super) fn checked_phase(&self, coordinates: usize) -> Result<Phase, OrbitError> {
        match self.phase {
            Phase::Coordinate { index, .. } | Phase::Momentum { index, .. }
                if index >= coordinates =>
            {
                Err(OrbitError::Phase { index })
            }
            phase => Ok(phase),
        }
    }
}

impl<'m, M: Model<N>, const N: usize> PeriodicOrbit<'m, M, N> {
    /// Finds the orbit and its Floquet multipliers.
    ///
    /// # Errors
    /// For invalid settings [`OrbitError::NoPeriod`], [`Period`](OrbitError::Period), [`Number`](OrbitError::Number),
    /// [`ForcedPeriod`](OrbitError::ForcedPeriod), [`Mesh`](OrbitError::Mesh), [`Phase`](OrbitError::Phase) or
    /// [`Unsupported`](OrbitError::Unsupported); [`Guess`](OrbitError::Guess) if the run of the guess fails.
    /// [`Assembly`](OrbitError::Assembly), [`NoFamily`](OrbitError::NoFamily) or [`AtRest`](OrbitError::AtRest) if no orbit
    /// is found from the guess (`Assembly` also for an invalid model or element);
    /// [`NotRepeated`](OrbitError::NotRepeated) if the state closes after the period, but the model is another one then;
    /// [`Constraints`](OrbitError::Constraints) or [`Multipliers`](OrbitError::Multipliers) if the orbit is found, but not
    /// its multipliers.
    pub fn solve(&self) -> Result<Orbit<'m, M, N>, OrbitError> {
        let (problem, iterate, assembly, halved) = self.solved()?;
        let warnings = self.doubts((&problem, &iterate), halved);
        let orbit = Orbit::new(self.element, &problem, iterate, &assembly)?;
        Ok(orbit.with_warnings(warnings))
    }

    /// The warnings for an orbit; `known` is its correction on elements of half the length, if that was made.
    pub(super) fn doubts(
        &self,
        (problem, iterate): (&Periodic<'_, M, N>, &Iterate<N>),
        known: Option<HalvedCorrection>,
    ) -> Vec<MeshWarning> {
        // The element is valid: there is a solution with it.
        let halved = known.or_else(|| self.halved_correction(problem, iterate).ok().flatten());
        let mut warnings = halved.map_or(Vec::new(), |halved| halved.doubts(self.elements));
        let times = problem.mesh.times(problem.start, problem.period);
        let nodes = times.zip(iterate.nodes.iter().copied());
        let crossed = crossed_kinks(self.model, nodes);
        warnings.extend(crossed.map(|time| MeshWarning::KinksCrossed { time }));
        warnings
    }

    /// The correction of an orbit on elements of half the length, if there is one.
    fn halved_correction(
        &self,
        problem: &Periodic<'_, M, N>,
        iterate: &Iterate<N>,
    ) -> Result<Option<HalvedCorrection>, AssemblyError> {
        let motion = self.motion_of(problem, iterate);
        let along = |t: f64| along_motion(self.model, &motion, t);
        let fine = (&problem.halved(), 2 * self.elements);
        let unknowns = (iterate.globals.clone(), problem.dense());
        Assembly::halved_correction(self.element, fine, unknowns, along)
    }

    /// Solves the equations.
    pub(crate) fn solved(&self) -> Result<Solved<'m, M, N>, OrbitError> {
        self.model.check().map_err(AssemblyError::Model)?;
        let period = self.period.checked()?;
        self.check_numbers()?;
        let autonomous = !M::FACTS.time_dependent;
        let conservative = autonomous && !M::FACTS.forced;
        let mut problem = Periodic {
            model: self.model,
            mesh: Mesh::new(self.elements, &self.weights)?,
            start: self.start,
            period,
            unfolding: 0.0,
            inertia: 1.0,
            globals: Vec::new(),
            advance: self.advances(),
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
        self.check_energy(conservative)?;
        if autonomous && !at_rest {
            problem.phase = Some(self.checked_phase(N)?);
            if conservative || problem.globals.is_empty() {
                problem.globals.push(Global::Unfolding);
                problem.inertia = self.inertia_along(&curve, period)?;
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
        let guess = extent_of(&iterate);
        let mut solved = assembly.solve(&mut problem, &mut iterate, self.control);
        let mut halved = None;
        if !autonomous {
            solved = (solved.map_err(|error| assembly.explained(error))).and_then(|()| {
                halved = self.doubtful_correction(&problem, &iterate, &assembly)?;
                // At resonance, elements of half the length do not confirm the orbit.
                assembly.check_resolved(halved)
            });
        }
        let solved = (solved.map_err(OrbitError::from)).and_then(|()| problem.check());
        // If a phase condition is given, an equilibrium is not accepted.
        if problem.phase.is_some()
            && may_rest(&solved)
            && is_at_rest(extent_of(&iterate), &guess, || {
                self.motion_of(&problem, &iterate)
            })
        {
            return Err(OrbitError::AtRest);
        }
        solved?;
        problem.check_repeats(&iterate)?;
        Ok((problem, iterate, assembly, halved))
    }

    /// The correction on elements of half the length, if the equations are close to singular.
    fn doubtful_correction(
        &self,
        problem: &Periodic<'_, M, N>,
        iterate: &Iterate<N>,
        assembly: &Assembly<N>,
    ) -> Result<Option<HalvedCorrection>, AssemblyError> {
        match assembly.is_doubtful() {
            true => self.halved_correction(problem, iterate),
            false => Ok(None),
        }
    }

    /// The motion of an iterate, with the polynomials of its elements.
    fn motion_of(&self, problem: &Periodic<'_, M, N>, iterate: &Iterate<N>) -> Motion<N> {
        let iterate = iterate.clone();
        let solution = problem.solution(self.element, iterate, Vec::new(), Statistics::NONE);
        solution.motion()
    }

    /// The element and the stopping criteria.
    pub(crate) fn method(&self) -> (Element, Control) {
        (self.element, self.control)
    }

    fn advances(&self) -> [f64; N] {
        self.advance.unwrap_or([0.0; N])
    }

    /// The guess as a curve.
    fn curve(&self, period: f64) -> Result<Curve<'_, N>, OrbitError> {
        Ok(match &self.guess {
            Guess::Rest => {
                let (advance, start) = (self.advances(), self.start);
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

    /// Whether the guess is constant: an equilibrium whose multipliers are asked for.
    fn is_constant(&self, curve: &Curve<'_, N>, period: f64) -> bool {
        let (first, _) = curve(self.start);
        (0..=16).all(|k| {
            let (q, v) = curve(self.start + period * f64::from(k) / 16.0);
            q == first && v == [0.0; N]
        }) && self.advances() == [0.0; N]
    }

    fn inertia_along(&self, curve: &Curve<'_, N>, period: f64) -> Result<f64, OrbitError> {
        const PLACES: u32 = 16;
        let (mut momenta, mut velocities) = (Vec::new(), Vec::new());
        for k in 0..PLACES {
            let t = self.start + period * f64::from(k) / f64::from(PLACES);
            let (q, v) = curve(t);
            let state = legendre::state(self.model, t, &q, &v);
            momenta.extend(state.map_err(AssemblyError::Legendre)?.p);
            velocities.extend(v);
        }
        Ok(inertia_of(&momenta, &velocities))
    }

    fn energy_of(&self, curve: &Curve<'_, N>) -> Result<f64, OrbitError> {
        if let Some(energy) = self.energy {
            return Ok(energy);
        }
        let (q, v) = curve(self.start);
        let state = legendre::state(self.model, self.start, &q, &v);
        let p = state.map_err(AssemblyError::Legendre)?.p;
        let energy = legendre::energy_at(self.model, self.start, &q, &p, &v);
        if !energy.is_finite() {
            return Err(AssemblyError::Legendre(LegendreError::NonFinite).into());
        }
        Ok(energy)
    }
}

/// Refuses an advance that is not finite.
pub(super) fn check_advance(advance: &[f64]) -> Result<(), OrbitError> {
    let wrong = advance.iter().copied().find(|value| !value.is_finite());
    wrong.map_or(Ok(()), |value| {
        let what = "advance";
        Err(OrbitError::Number { what, value })
    })
}

/// The least and the largest coordinates of the nodes.
fn extent_of<const N: usize>(iterate: &Iterate<N>) -> Extent {
    Extent::of(iterate.nodes.iter().map(|node| &node.q[..]))
}

/// The equations of an orbit, their solution, the workspace, and the correction on elements of half the length, if that
/// was made.
pub(crate) type Solved<'m, M, const N: usize> = (
    Periodic<'m, M, N>,
    Iterate<N>,
    Assembly<N>,
    Option<HalvedCorrection>,
);

/// Coordinates and velocities of a motion; beyond its end, the last ones.
pub(crate) fn along_motion<M: Model<N>, const N: usize>(
    model: &M,
    motion: &Motion<N>,
    t: f64,
) -> ([f64; N], [f64; N]) {
    let node = motion.at(t).unwrap_or(*motion.last());
    let velocity = constrained::velocity(model, t, &node.q, &node.p, &[0.0; N]);
    (node.q, velocity.unwrap_or([0.0; N]))
}
