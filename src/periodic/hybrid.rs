//! Periodic orbits of motions with events that change the state, such as impacts and switches (single shooting).

mod orbit;

use super::closing::{Closing, Correction, Scales, moved, scales};
use super::error::OrbitError;
use super::orbit::sort;
use super::phase::Period;
use super::repeats::{check_repeats, rate};
use super::rest::{Extent, is_at_rest};
use super::setup::{PeriodicOrbit, check_advance};
use crate::assembly::{HalvedCorrection, MeshError, MeshWarning, check_tolerance, size};
use crate::error::RunErrorKind;
use crate::length::{FixedLength, Length};
use crate::linearised::Linearised;
use crate::motion::{Motion, Node, Setting};
use crate::numbers::largest;
use crate::periodic_schur::Multiplier;
use crate::simulation::{Differentiable, Simulation};
use nalgebra::{DMatrix, DVector};
use tfe_runtime::family::ModelError;

pub use orbit::HybridOrbit;

impl<'m, M, const N: usize, L: Length<N>> PeriodicOrbit<'m, M, N, L> {
    /// A periodic orbit of a simulation with [events](Simulation::on) that change the state (a hybrid system): an
    /// oscillator that hits a wall, a machine that switches. Model, element and events are those of the simulation;
    /// the step sizes follow from the number of elements in a period. A model of run-time length needs the feature
    /// `sparse`.
    ///
    /// ```
    /// use std::f64::consts::TAU;
    /// use tfe::prelude::*;
    ///
    /// /// A ball on a table that shakes: height above the table, with the table's acceleration −a ω² sin ωt.
    /// #[dynamics(
    ///     coordinates(y),
    ///     lagrangian = dot(y)^2/2 - (g - a*omega^2*sin(omega*t))*y,
    ///     event(impact) = y,
    /// )]
    /// struct Table { g: f64, a: f64, omega: f64 }
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// let table = Table { g: 9.81, a: 0.002, omega: 50.0 };
    /// let bounce = |event: &tfe::Occurrence<'_, 1>| Act::Restart(event.after_impact(0.8));
    /// let simulation = Simulation::new(&table).element(Mixed::<8>).on("impact", Crossing::Falling, bounce);
    /// let period = TAU / 50.0;
    /// // Half way up: the ball flies for one period, thrown by a table that moves at (1 − e)/(1 + e) g T/2.
    /// let w = 0.2 / 1.8 * 9.81 * period / 2.0;
    /// let phase = (w / (0.002 * 50.0)).acos();
    /// let start = table.state([9.81 * period * period / 8.0], [w]);
    /// let orbit = PeriodicOrbit::of_simulation(&simulation)
    ///     .start_time(phase / 50.0 + 0.5 * period)
    ///     .period(period)
    ///     .guess_from(start)
    ///     .solve()?;
    /// assert_eq!(orbit.motion().events().len(), 1);
    /// let product = orbit.multipliers()[0] * orbit.multipliers()[1];
    /// assert!((product.re - 0.64).abs() < 1e-9); // e²
    /// # Ok(())
    /// # }
    /// ```
    #[cfg_attr(feature = "sparse", doc = include_str!("hybrid.md"))]
    pub fn of_simulation(simulation: &Simulation<'m, M, N, L>) -> HybridOrbits<'m, M, N, L>
    where
        M: Differentiable<N, L>,
    {
        HybridOrbits {
            simulation: simulation.clone(),
            elements: 40,
            start: 0.0,
            period: Period::Missing,
            guess: None,
            advance: None,
            tolerance: 1e-13,
            max_iterations: 50,
        }
    }
}

/// The search for a periodic orbit with events; made by [`PeriodicOrbit::of_simulation`].
///
/// Newton's method (single shooting) for the state at the start, and for the period if that is unknown:
///
/// ```text
/// y(T; y₀) − y₀ = (0, advance) ,     (A − 1) δy₀ + ẏ(T) δT = −r                                         (T-142)
/// ```
///
/// with A the monodromy matrix across the events, from [`run_linearised`](Simulation::run_linearised). If orbits come
/// in families, several corrections solve the equation, and the shortest is taken; corrections that make the residual
/// r larger are halved.
///
/// The motion from the guess should meet the events of the orbit, and should not start at an event. If no correction
/// reduces r, but r is larger than rounding errors, there is no orbit: the model has none of this period, or the
/// elements are too coarse for a conservative model.
///
/// With constraints, a motion satisfies them from its first element on, so that the equation holds for all components;
/// guess and corrected starts are moved to the nearest states that satisfy them.
#[derive(Debug)]
pub struct HybridOrbits<'m, M, const N: usize, L: Length<N> = FixedLength> {
    pub(super) simulation: Simulation<'m, M, N, L>,
    pub(super) elements: usize,
    pub(super) start: f64,
    pub(super) period: Period,
    guess: Option<L::State>,
    /// `None`: zeros.
    advance: Option<L::Vector>,
    tolerance: f64,
    max_iterations: u32,
}

impl<'m, M, const N: usize, L> HybridOrbits<'m, M, N, L>
where
    M: Differentiable<N, L>,
    L: Length<N>,
{
    /// Sets the number of elements in a period, 40 by default; events cut some of them.
    #[must_use]
    pub fn elements(mut self, elements: usize) -> Self {
        self.elements = elements;
        self
    }

    /// Sets the time at which the period begins; 0 by default.
    #[must_use]
    pub fn start_time(mut self, time: f64) -> Self {
        self.start = time;
        self
    }

    /// Sets the period, if it is known: that of the forcing, or a multiple of it.
    #[must_use]
    pub fn period(mut self, period: f64) -> Self {
        self.period = Period::Known(period);
        self
    }

    /// Makes the period an unknown, near `guess`; for models that do not depend on time.
    #[must_use]
    pub fn unknown_period(mut self, guess: f64) -> Self {
        self.period = Period::Guess(guess);
        self
    }

    /// Sets the first guess of the state at the start of the period.
    #[must_use]
    pub fn guess_from(mut self, state: L::State) -> Self {
        self.guess = Some(state);
        self
    }

    /// Sets by how much the coordinates grow over a period, for example a full turn of an angle; zero by default.
    #[must_use]
    pub fn advance(mut self, advance: L::Vector) -> Self {
        self.advance = Some(advance);
        self
    }

    /// Sets when the iteration is finished: when the last correction, relative to the state, is at most this; 10⁻¹³ by
    /// default. It also ends when corrections below 10⁻⁹ no longer shrink.
    #[must_use]
    pub fn tolerance(mut self, tolerance: f64) -> Self {
        self.tolerance = tolerance;
        self
    }

    /// Sets the largest number of iterations of Newton's method, 50 by default.
    #[must_use]
    pub fn max_iterations(mut self, iterations: u32) -> Self {
        self.max_iterations = iterations;
        self
    }

    /// Finds the orbit and its Floquet multipliers.
    ///
    /// # Errors
    /// [`OrbitError`] if a setting is invalid; [`Run`](OrbitError::Run) if a motion fails,
    /// [`Stalled`](OrbitError::Stalled) if no orbit is found from the guess, [`AtRest`](OrbitError::AtRest) if the
    /// search for an unknown period ends at an equilibrium.
    pub fn solve(&self) -> Result<HybridOrbit<N, L>, OrbitError> {
        /// Corrections below this that no longer decrease are rounding errors.
        const ROUNDED: f64 = 1e-9;
        if self.elements == 0 {
            return Err(MeshError::NoElements.into());
        }
        check_tolerance(self.tolerance)?;
        let mut period = self.period.checked()?;
        let is_free = matches!(self.period, Period::Guess(_));
        if is_free && M::DEPENDS_ON_TIME {
            return Err(OrbitError::ForcedPeriod);
        }
        self.check_advance()?;
        let guess = (self.guess.clone()).unwrap_or_else(|| self.simulation.model().zero_state());
        let mut run = self.run(&guess, period)?;
        let guess = Extent::of_nodes(run.motion());
        self.check_moves(&run, &guess)?;
        let mut last = f64::INFINITY;
        let stalled = |residual, iterations| OrbitError::Stalled {
            residual,
            iterations,
        };
        for iterations in 1..=self.max_iterations {
            let (scales, residual, correction) = self.correction(&run, period)?;
            let size = correction.size(period);
            let is_done = size <= self.tolerance || (size < ROUNDED && size > 0.5 * last);
            last = size;
            let off = largest(residual.as_slice());
            let limit = (!is_done).then_some(off);
            let closer = self.corrected(&run, period, (&correction, &scales), limit);
            // The correction is rounding error, so that no step can improve the residual.
            let is_best = closer.is_none() && size < ROUNDED;
            if !is_best {
                (period, run) = closer.ok_or(stalled(off, iterations))?;
                self.check_moves(&run, &guess)?;
            }
            if is_done || is_best {
                // A residual that no correction reduces means that the motion does not close.
                let residual = largest(self.residual(&run, &scales).as_slice());
                if residual <= self.tolerance.max(ROUNDED) * correction.gain.max(1.0) {
                    return self.found(run, period, iterations);
                }
                return Err(stalled(residual, iterations));
            }
        }
        let residual = largest(self.residual(&run, &scales(run.motion())).as_slice());
        Err(stalled(residual, self.max_iterations))
    }

    /// The period and the motion after the largest part of a correction, 1, ½, ¼, …, with which the residual is below a
    /// limit, if there is one.
    fn corrected(
        &self,
        run: &Linearised<N, L>,
        period: f64,
        (correction, scales): (&Correction, &Scales),
        limit: Option<f64>,
    ) -> Option<(f64, Linearised<N, L>)> {
        const MAX_HALVINGS: u32 = 12;
        let start = run.motion().states()[0].state();
        let residual = |run: &_| largest(self.residual(run, scales).as_slice());
        let mut part = 1.0;
        for _ in 0..=MAX_HALVINGS {
            let change = |row: usize| part * correction.start[row] * scales.of(row);
            let period = period + part * correction.stretch;
            if let Ok(run) = self.run(&moved::<N, L>(&start, change), period)
                && limit.is_none_or(|limit| residual(&run) < limit)
            {
                return Some((period, run));
            }
            part *= 0.5;
        }
        None
    }

    /// The correction of a motion over a period, with the scales and the residual from which it is computed.
    fn correction(
        &self,
        run: &Linearised<N, L>,
        period: f64,
    ) -> Result<(Scales, DVector<f64>, Correction), OrbitError> {
        let scales = scales(run.motion());
        let residual = self.residual(run, &scales);
        let is_free = matches!(self.period, Period::Guess(_));
        let rate = rate(self.simulation.model(), run.motion().last());
        let closing = Closing {
            product: run.product(),
            rate: is_free.then_some(rate),
            scales: &scales,
            period,
        };
        let correction = closing.shortest(&residual)?;
        Ok((scales, residual, correction))
    }

    /// The warnings for an orbit, by a correction of its start and its period with steps of half the length. If there is
    /// no correction, there are none.
    fn doubts(&self, start: &L::State, period: f64) -> Vec<MeshWarning> {
        let fine = Self {
            elements: 2 * self.elements,
            ..self.of(self.simulation.clone())
        };
        let corrected = fine.run(start, period).and_then(|run| {
            let (scales, _, correction) = fine.correction(&run, period)?;
            Ok((run, scales, correction))
        });
        let Ok((run, scales, correction)) = corrected else {
            return Vec::new();
        };
        let change = correction.start.iter().enumerate();
        let change: Vec<f64> = change.map(|(row, part)| part * scales.of(row)).collect();
        let none = vec![0.0; change.len()];
        let nodes = run.motion().states().iter().enumerate();
        let nodes = nodes.map(|(k, node)| {
            let change = if k == 0 { &change } else { &none };
            (node.p.as_ref(), node.q.as_ref(), &change[..])
        });
        let nodes: Vec<_> = nodes.collect();
        let matrices = run.transitions().iter().map(DMatrix::transpose);
        let matrices: Vec<f64> = matrices.flat_map(|rows| rows.as_slice().to_vec()).collect();
        let period = [correction.stretch / period];
        let whole = size(nodes.iter().copied(), &matrices, period.into_iter());
        HalvedCorrection::of(whole, &nodes, period).doubts(self.elements)
    }

    /// Refuses an equilibrium if the period is unknown; with a known period it is a valid orbit.
    fn check_moves(&self, run: &Linearised<N, L>, guess: &Extent) -> Result<(), OrbitError> {
        let motion = run.motion();
        let is_free = matches!(self.period, Period::Guess(_));
        if is_free && is_at_rest(Extent::of_nodes(motion), guess, || motion.clone()) {
            return Err(OrbitError::AtRest);
        }
        Ok(())
    }

    /// Refuses an advance of another length than that of the coordinates, or that is not finite.
    fn check_advance(&self) -> Result<(), OrbitError> {
        let Some(advance) = &self.advance else {
            return Ok(());
        };
        let expected = self.simulation.model().coordinates();
        let length = advance.as_ref().len();
        if length == expected {
            return check_advance(advance.as_ref());
        }
        let kind = RunErrorKind::Family(ModelError::StateLength {
            vector: "of the advance",
            length,
            expected,
        });
        Err(OrbitError::Run(kind))
    }

    /// The same problem for another simulation.
    pub(super) fn of(&self, simulation: Simulation<'m, M, N, L>) -> Self {
        Self {
            simulation,
            guess: self.guess.clone(),
            advance: self.advance.clone(),
            ..*self
        }
    }

    /// The motion over a period, from the nearest state that satisfies the constraints.
    pub(super) fn run(
        &self,
        state: &L::State,
        period: f64,
    ) -> Result<Linearised<N, L>, OrbitError> {
        if !(period > 0.0 && period.is_finite()) {
            return Err(OrbitError::Period { period });
        }
        let start = self.simulation.model().nearest_allowed(self.start, state);
        let simulation = self.simulation.clone().record_every(1);
        let simulation = simulation.step(period / self.elements as f64);
        let run = M::linearised(&simulation, start, self.start..self.start + period);
        let run = run.map_err(|error| OrbitError::Run(error.kind().clone()))?;
        let last = run.motion().last().t;
        if last != self.start + period {
            // An event has stopped the run.
            return Err(OrbitError::Stopped { time: last });
        }
        Ok(run)
    }

    /// The growth of a coordinate over a period.
    fn grown(&self, a: usize) -> f64 {
        self.advance.as_ref().map_or(0.0, |all| all.as_ref()[a])
    }

    /// y(T) − y(0) − (0, advance), in the order (p, q), divided by the scales.
    fn residual(&self, run: &Linearised<N, L>, scales: &Scales) -> DVector<f64> {
        let (first, last) = (&run.motion().states()[0], run.motion().last());
        let n = first.q.as_ref().len();
        let change = |of: fn(&Node<N, L>) -> &L::Vector, a: usize| -> f64 {
            of(last).as_ref()[a] - of(first).as_ref()[a]
        };
        DVector::from_fn(2 * n, |row, _| match row.checked_sub(n) {
            None => change(|node| &node.p, row) / scales.of(row),
            Some(a) => (change(|node| &node.q, a) - self.grown(a)) / scales.of(row),
        })
    }

    fn found(
        &self,
        run: Linearised<N, L>,
        period: f64,
        iterations: u32,
    ) -> Result<HybridOrbit<N, L>, OrbitError> {
        if let Some(left) = left_over::<M, L, N>(self.simulation.model(), run.motion().settings()) {
            return Err(OrbitError::ParameterLeft {
                parameter: left.parameter.clone(),
                value: left.value,
            });
        }
        let nodes = run.motion().states().iter();
        let nodes: Vec<_> = nodes.map(|node| (node.t, node.state())).collect();
        let model = self.simulation.model();
        check_repeats(model, &nodes, period, |a| self.grown(a))?;
        let mut floquet = run.multipliers().map_err(OrbitError::Multipliers)?;
        sort(&mut floquet);
        let warnings = self.doubts(&nodes[0].1, period);
        let (motion, transitions) = run.into_parts();
        let trivial = self.trivial(&floquet, &motion);
        Ok(HybridOrbit {
            start: motion.states()[0].state(),
            period,
            multipliers: floquet.iter().map(Multiplier::to_complex).collect(),
            floquet,
            trivial: usize::from(trivial),
            motion,
            transitions,
            iterations,
            warnings,
        })
    }

    /// Whether one multiplier is 1 because the model is autonomous. With a known period this need not be so: actions
    /// may depend on time, and an equilibrium has no such multiplier.
    fn trivial(&self, floquet: &[Multiplier], motion: &Motion<N, L>) -> bool {
        /// The largest distance of that multiplier from 1.
        const NEAR: f64 = 1e-4;
        if matches!(self.period, Period::Guess(_)) {
            return true;
        }
        let mut velocities = motion.states().iter().flat_map(|node| node.v.as_ref());
        let moves = velocities.any(|v| *v != 0.0);
        let is_one = |one: &Multiplier| one.log_modulus.hypot(one.argument) < NEAR;
        !M::DEPENDS_ON_TIME && moves && floquet.iter().any(is_one)
    }
}

/// The first parameter that events have left at another value than at the start: the motion of the next period would
/// differ.
fn left_over<'s, M, L, const N: usize>(model: &M, settings: &'s [Setting]) -> Option<&'s Setting>
where
    M: Differentiable<N, L>,
    L: Length<N>,
{
    let names = model.parameter_names();
    let mut lasting = settings.iter().enumerate().filter(|(place, one)| {
        let later = &settings[place + 1..];
        later.iter().all(|later| later.parameter != one.parameter)
    });
    let left = lasting.find(|(_, one)| {
        let own = names.iter().position(|name| name.is(&one.parameter));
        own.map(|index| model.parameter_value(index)) != Some(one.value)
    });
    left.map(|(_, one)| one)
}
