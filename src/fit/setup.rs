//! The definition of a fit: the model, the unknowns and the measurements.

use super::data::{Column, Measured};
use super::error::FitError;
use crate::length::breaks_of;
use crate::simulation::Simulation;
use std::ops::{Bound, RangeBounds};
use tfe_runtime::{Element, Model, State};

/// Fits parameters of a model to measured values m_i of its outputs y, by least squares:
///
/// ```text
/// Σ ((y(t_i; a, y₀) − m_i)/σ_i)² → min                                                       (T-125)
/// ```
///
/// over the parameters a and, if unknown, the start y₀, by the method of Levenberg and Marquardt. The derivatives of
/// every run are exact up to rounding ([`Simulation::run_sensitive`]). Elements end at the times of the measurements.
///
/// ```
/// use tfe::prelude::*;
///
/// #[dynamics(coordinates(y), lagrangian = m/2*dot(y)^2 - m*g*y, force(y) = -c*dot(y), output(height) = y)]
/// struct Ball { m: f64, g: f64, c: f64 }
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// // Measured: a motion with g = 9.81, c = 0.3.
/// let truth = Ball { m: 1.0, g: 9.81, c: 0.3 };
/// let times: Vec<f64> = (0..=20).map(|k| 0.1 * f64::from(k)).collect();
/// let motion = Simulation::new(&truth).step(0.1).run(truth.state([1.0], [4.0]), 0.0..2.0)?;
/// let measured: Vec<f64> = motion.states().iter().map(|node| node.q[0]).collect();
///
/// let ball = Ball { m: 1.0, g: 9.0, c: 0.1 };
/// let fit = Fit::new(&ball)
///     .start(ball.state([1.0], [4.0]), 0.0)
///     .step(0.1)
///     .parameters(["g", "c"])
///     .output("height", &times, &measured)
///     .solve()?;
/// assert!((fit.value("g").ok_or("named")? - 9.81).abs() < 1e-9);
/// assert!((fit.value("c").ok_or("named")? - 0.3).abs() < 1e-9);
/// println!("{fit}");
/// # Ok(())
/// # }
/// ```
///
/// The method finds the nearest minimum. For motions that oscillate, the first parameters must therefore keep the
/// phase right over all measurements. If they do not, first fit a few oscillations, and use the result to begin a fit
/// of all, as in `examples/pendulum_fit.rs`.
///
/// Models with inputs are fitted as [`Driven`](crate::Driven), with the inputs that acted during the measurements.
///
/// Without a [`start`](Self::start), the state at the first time is unknown, too, and the iteration begins with rest
/// at zero; [`start_near`](Self::start_near) gives a better guess.
#[derive(Debug)]
pub struct Fit<'m, M, const N: usize> {
    pub(super) model: &'m M,
    pub(super) element: Option<Element>,
    pub(super) step: Option<f64>,
    pub(super) start: Start<N>,
    pub(super) parameters: Vec<String>,
    pub(super) bounds: Vec<(String, f64, f64)>,
    pub(super) measured: Vec<Measured>,
    pub(super) breaks: Vec<f64>,
    pub(super) progress: bool,
}

/// What is known about the start.
#[derive(Clone, Copy, Debug)]
pub(super) enum Start<const N: usize> {
    Known(State<N>, f64),
    Near(State<N>, f64),
    Unknown,
}

impl<'m, M: Model<N>, const N: usize> Fit<'m, M, N> {
    /// A fit of this model. Parameters that are not fitted keep its values; those that are begin there.
    pub fn new(model: &'m M) -> Self {
        Self {
            model,
            element: None,
            step: None,
            start: Start::Unknown,
            parameters: Vec::new(),
            bounds: Vec::new(),
            measured: Vec::new(),
            breaks: breaks_of([model]),
            progress: false,
        }
    }

    /// Sets the known state at the time `t0`.
    #[must_use]
    pub fn start(mut self, start: State<N>, t0: f64) -> Self {
        self.start = Start::Known(start, t0);
        self
    }

    /// Sets a guess of the state at the time `t0`, which is fitted together with the parameters.
    #[must_use]
    pub fn start_near(mut self, guess: State<N>, t0: f64) -> Self {
        self.start = Start::Near(guess, t0);
        self
    }

    /// Sets the element of all runs, as [`Simulation::element`] does.
    #[must_use]
    pub fn element(mut self, element: impl Into<Element>) -> Self {
        self.element = Some(element.into());
        self
    }

    /// Sets the step size of all runs, as [`Simulation::step`] does; one thousandth of the span by default.
    #[must_use]
    pub fn step(mut self, step: f64) -> Self {
        self.step = Some(step);
        self
    }

    /// Sets the parameters to be fitted: fields of type `f64`, or elements of arrays, `k[2]`.
    #[must_use]
    pub fn parameters<S: Into<String>>(mut self, names: impl IntoIterator<Item = S>) -> Self {
        self.parameters.extend(names.into_iter().map(Into::into));
        self
    }

    /// Keeps a parameter within a range, as in `.bounds("c", 0.0..)`.
    ///
    /// The parameter is expressed as a smooth function of a number without bounds, and that number is fitted.
    /// [`solve`](Self::solve) returns an error if the range is empty or does not contain the first value.
    #[must_use]
    pub fn bounds(mut self, name: impl Into<String>, range: impl RangeBounds<f64>) -> Self {
        let number = |bound: Bound<&f64>, otherwise: f64| match bound {
            Bound::Included(value) | Bound::Excluded(value) => *value,
            Bound::Unbounded => otherwise,
        };
        let low = number(range.start_bound(), f64::NEG_INFINITY);
        let high = number(range.end_bound(), f64::INFINITY);
        self.bounds.push((name.into(), low, high));
        self
    }

    /// Adds measured values of an output of the model, or of a coordinate, with standard deviation 1: all are equally
    /// certain.
    #[must_use]
    pub fn output(
        self,
        name: impl Into<String>,
        times: impl AsRef<[f64]>,
        values: impl AsRef<[f64]>,
    ) -> Self {
        self.output_within(name, times, values, 1.0)
    }

    /// Adds measured values with the standard deviation σ of their errors, in the unit of the output. Use it to weigh
    /// values of different kinds.
    #[must_use]
    pub fn output_within(
        mut self,
        name: impl Into<String>,
        times: impl AsRef<[f64]>,
        values: impl AsRef<[f64]>,
        deviation: f64,
    ) -> Self {
        self.measured.push(Measured {
            name: name.into(),
            times: times.as_ref().to_vec(),
            values: values.as_ref().to_vec(),
            deviation,
        });
        self
    }

    /// Makes elements end at a time, as [`Simulation::break_at`] does: where an input that is given as a function jumps.
    #[must_use]
    pub fn break_at(mut self, time: f64) -> Self {
        self.breaks.push(time);
        self
    }

    /// Shows every run of the iteration on standard error.
    #[must_use]
    pub fn progress(mut self) -> Self {
        self.progress = true;
        self
    }

    /// The measurements, with the indices of their outputs.
    pub(super) fn columns(&self) -> Result<Vec<Column<'_>>, FitError> {
        if self.measured.is_empty() {
            return Err(FitError::NothingMeasured);
        }
        self.measured
            .iter()
            .map(|one| Column::new::<M, N>(self.model, one))
            .collect()
    }

    /// The time and the state at the start, and whether the state is known.
    pub(super) fn first(&self, columns: &[Column<'_>]) -> Result<(f64, State<N>, bool), FitError> {
        let times = || columns.iter().flat_map(|one| one.times);
        let earliest = times().copied().fold(f64::INFINITY, f64::min);
        let (t0, state, is_known) = match self.start {
            Start::Known(state, t0) => (t0, state, true),
            Start::Near(state, t0) => (t0, state, false),
            Start::Unknown => {
                let rest = State {
                    q: [0.0; N],
                    p: [0.0; N],
                };
                (earliest, rest, false)
            }
        };
        if !is_known && !M::CONSTRAINTS.is_empty() {
            return Err(FitError::StartOfConstraints);
        }
        if earliest < t0 || !t0.is_finite() {
            return Err(FitError::Early {
                time: earliest,
                start: t0,
            });
        }
        Ok((t0, state, is_known))
    }

    /// A run of a model over the times of the measurements.
    pub(super) fn simulation<'s>(&self, model: &'s M, times: &[f64]) -> Simulation<'s, M, N> {
        let mut simulation = Simulation::new(model);
        if let Some(element) = self.element {
            simulation = simulation.element(element);
        }
        if let Some(step) = self.step {
            simulation = simulation.step(step);
        }
        let all = times.iter().chain(&self.breaks);
        all.fold(simulation, |run, t| run.break_at(*t))
    }
}
