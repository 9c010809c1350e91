//! Periodic orbits with their derivatives by parameters.

use super::error::OrbitError;
use super::moving;
use super::orbit::{Orbit, multipliers_of};
use super::problem::{Global, Periodic};
use super::setup::PeriodicOrbit;
use crate::assembly::{Assembly, By, Iterate, derivatives};
use crate::length::{FixedLength, Length};
use crate::periodic_schur::Multiplier;
use crate::sensitivity::names::place_of;
use nalgebra::Complex;
use tfe_runtime::{Element, Model, State};

impl<'m, M: Model<N>, const N: usize> PeriodicOrbit<'m, M, N> {
    /// Finds the orbit as [`solve`](Self::solve) does, and the derivatives of its period, its start and its
    /// multipliers with respect to each parameter of the model.
    ///
    /// Period and states are differentiated exactly, as solutions of the discrete equations (`docs/theory.md`,
    /// (T-156)). What was prescribed stays: a known period, the [energy](Self::energy) (that of the guess if none was
    /// given), the [phase condition](Self::phase). The derivatives of multipliers are differences of eighth order of
    /// the matrices along that change (T-157).
    ///
    /// ```
    /// use tfe::prelude::*;
    ///
    /// #[dynamics(coordinates(x), lagrangian = m*dot(x)^2/2 - k*x^2/2)]
    /// struct Oscillator { m: f64, k: f64 }
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// let oscillator = Oscillator { m: 1.0, k: 4.0 };
    /// let orbit = PeriodicOrbit::of(&oscillator)
    ///     .unknown_period(3.1)
    ///     .guess_from(oscillator.state([1.0], [0.0]))
    ///     .solve_sensitive()?;
    /// // T = 2π √(m/k)
    /// let period = orbit.orbit().period();
    /// assert!((orbit.by("k").period() + period / 8.0).abs() < 1e-7);
    /// assert!((orbit.by("m").period() - period / 2.0).abs() < 1e-7);
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    /// As from [`solve`](Self::solve).
    pub fn solve_sensitive(&self) -> Result<SensitiveOrbit<Orbit<'m, M, N>, N>, OrbitError> {
        let (problem, iterate, assembly, halved) = self.solved()?;
        let element = self.method().0;
        let warnings = self.doubts((&problem, &iterate), halved);
        let orbit = Orbit::new(element, &problem, iterate.clone(), &assembly)?;
        let orbit = orbit.with_warnings(warnings);
        let indices: Vec<usize> = (0..self.model.parameters()).collect();
        let mut by: Vec<By> = indices.iter().copied().map(By::Parameter).collect();
        if !problem.globals.contains(&Global::Period) {
            by.push(By::Length);
        }
        let changes = derivatives(element, &problem, &iterate, problem.dense(), &by)?;
        let slopes = by.iter().zip(changes).map(|(by, change)| {
            let period = match by {
                By::Length => 1.0,
                By::Parameter(_) | By::Row(_) => global(&problem, &change, Global::Period),
            };
            let moving = Moving {
                element,
                problem: &problem,
                iterate: &iterate,
                change: &change,
                period,
            };
            OrbitSlopes {
                period,
                start: change.nodes[0],
                multipliers: moving.by(*by, &orbit),
            }
        });
        let mut slopes: Vec<_> = slopes.collect();
        let by_period = slopes.split_off(indices.len()).pop();
        let names = indices
            .iter()
            .map(|index| self.model.parameter_name(*index));
        Ok(SensitiveOrbit {
            parameters: names.map(|name| name.to_string()).collect(),
            orbit,
            slopes,
            by_period,
        })
    }
}

/// The derivative of one of the globals; zero if it is given.
fn global<M, const N: usize>(
    problem: &Periodic<'_, M, N>,
    change: &Iterate<N>,
    global: Global,
) -> f64 {
    let place = problem.globals.iter().position(|own| *own == global);
    place.map_or(0.0, |place| change.globals[place])
}

/// The family of orbits along a parameter, or along the period.
struct Moving<'a, 'm, M, const N: usize> {
    element: Element,
    problem: &'a Periodic<'m, M, N>,
    iterate: &'a Iterate<N>,
    change: &'a Iterate<N>,
    /// ∂T/∂a.
    period: f64,
}

impl<'m, M: Model<N>, const N: usize> Moving<'_, 'm, M, N> {
    fn by(&self, by: By, orbit: &Orbit<'m, M, N>) -> Vec<Option<Complex<f64>>> {
        let model = self.problem.model;
        let value = match by {
            By::Parameter(index) => model.parameter(index),
            By::Length | By::Row(_) => self.problem.period,
        };
        let distances = moving::distances(value, self.parts());
        let (own, trivial) = (orbit.floquet(), orbit.trivial());
        moving::derivatives(own, &trivial, &distances, |shift| match by {
            By::Parameter(index) => {
                let model = model.with_parameter(index, value + shift)?;
                self.multipliers(&model, shift)
            }
            By::Length | By::Row(_) => self.multipliers(model, shift),
        })
    }

    /// The relative changes of states and period per unit of the parameter.
    fn parts(&self) -> [f64; 3] {
        let part = |of: fn(&State<N>) -> &[f64; N]| {
            let all = |iterate: &'_ Iterate<N>| -> Vec<f64> {
                iterate.nodes.iter().flat_map(of).copied().collect()
            };
            moving::part(&all(self.change), &all(self.iterate))
        };
        [
            part(|state| &state.q),
            part(|state| &state.p),
            self.period.abs() / self.problem.period,
        ]
    }

    /// The multipliers if the parameter is shifted and the orbit moves with it to first order.
    fn multipliers(&self, model: &M, shift: f64) -> Option<Vec<Multiplier>> {
        let moved = self.iterate.plus(shift, self.change);
        let unfolding = global(self.problem, self.change, Global::Unfolding);
        let problem = Periodic {
            model,
            mesh: self.problem.mesh.clone(),
            period: self.problem.period + shift * self.period,
            unfolding: self.problem.unfolding + shift * unfolding,
            globals: Vec::new(),
            phase: None,
            energy: None,
            ..*self.problem
        };
        let elements = problem.mesh.elements();
        let mut assembly = Assembly::new::<M>(self.element, elements, 0, 0).ok()?;
        assembly.link(&problem, &moved).ok()?;
        multipliers_of(&problem, &moved.nodes, assembly.transitions()).ok()
    }
}

/// An orbit ([`Orbit`] or [`HybridOrbit`](super::HybridOrbit)) with its derivatives with respect to the parameters of
/// its model; made by [`PeriodicOrbit::solve_sensitive`] and
/// [`HybridOrbits::solve_sensitive`](super::HybridOrbits::solve_sensitive).
#[derive(Clone, Debug)]
pub struct SensitiveOrbit<O, const N: usize, L: Length<N> = FixedLength> {
    pub(super) orbit: O,
    pub(super) parameters: Vec<String>,
    pub(super) slopes: Vec<OrbitSlopes<N, L>>,
    pub(super) by_period: Option<OrbitSlopes<N, L>>,
}

impl<O, const N: usize, L: Length<N>> SensitiveOrbit<O, N, L> {
    /// The orbit.
    pub fn orbit(&self) -> &O {
        &self.orbit
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
    pub fn by(&self, name: &str) -> &OrbitSlopes<N, L> {
        &self.slopes[place_of(name, &self.parameters)]
    }

    /// The derivatives with respect to a parameter; `None` if no parameter has this name.
    pub fn get(&self, name: &str) -> Option<&OrbitSlopes<N, L>> {
        let place = self.parameters.iter().position(|own| own == name)?;
        self.slopes.get(place)
    }

    /// The derivatives with respect to the period T, if that was given. A parameter on which the period depends, such
    /// as the frequency ω of a force with T(ω) = 2π/ω, changes the orbit in total by `by("omega")` plus dT/dω times
    /// these.
    pub fn by_period(&self) -> Option<&OrbitSlopes<N, L>> {
        self.by_period.as_ref()
    }
}

/// The derivatives of an orbit with respect to one parameter a.
#[derive(Clone, Debug)]
pub struct OrbitSlopes<const N: usize, L: Length<N> = FixedLength> {
    pub(super) period: f64,
    pub(super) start: L::State,
    pub(super) multipliers: Vec<Option<Complex<f64>>>,
}

impl<const N: usize, L: Length<N>> OrbitSlopes<N, L> {
    /// ∂T/∂a; zero if the period is given.
    pub fn period(&self) -> f64 {
        self.period
    }

    /// ∂q/∂a and ∂p/∂a at the start of the period.
    pub fn start(&self) -> L::State {
        self.start.clone()
    }

    /// ∂μ/∂a in the order of [`Orbit::multipliers`], with a relative error of about 1e-10; zero for trivial ones,
    /// which stay at 1. `None` if differences cannot determine it: where two multipliers meet, or if the model cannot
    /// be copied with another parameter.
    pub fn multipliers(&self) -> &[Option<Complex<f64>>] {
        &self.multipliers
    }
}
