//! What a fit has found.

use crate::motion::Motion;
use crate::numbers::{digits, norm};
use nalgebra::DMatrix;
use std::fmt;
use tfe_runtime::State;

/// A model with the parameters that were found, from [`Fit::solve`](super::Fit::solve).
#[derive(Clone, Debug)]
pub struct Fitted<M, const N: usize> {
    pub(super) model: M,
    pub(super) motion: Motion<N>,
    pub(super) names: Vec<String>,
    pub(super) values: Vec<f64>,
    pub(super) first: Vec<f64>,
    pub(super) covariance: DMatrix<f64>,
    pub(super) deviations: Vec<f64>,
    pub(super) residuals: Vec<f64>,
    pub(super) trials: Vec<Trial>,
}

/// A run on the way.
#[derive(Clone, Debug, PartialEq)]
pub struct Trial {
    /// The unknowns, in the order of [`Fitted::names`].
    pub values: Vec<f64>,
    /// The root of the mean square of (y − m)/σ; infinite where the run failed.
    pub deviation: f64,
}

impl<M, const N: usize> Fitted<M, N> {
    /// The model with the parameters that were found.
    pub fn model(&self) -> &M {
        &self.model
    }

    /// Its motion over the measurements.
    pub fn motion(&self) -> &Motion<N> {
        &self.motion
    }

    /// The state at the start, found or given.
    pub fn start(&self) -> State<N> {
        self.motion.states()[0].state()
    }

    /// What was looked for: parameters, then of a start that was not known all momenta and all coordinates, as `momentum of theta at the start` and `theta at the start`.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// The values found, in this order.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// The value of one; `None` where it was not looked for.
    pub fn value(&self, name: &str) -> Option<f64> {
        Some(self.values[self.place(name)?])
    }

    /// The standard deviation of one, the root of its [covariance](Self::covariance) with itself.
    pub fn deviation(&self, name: &str) -> Option<f64> {
        Some(self.deviations[self.place(name)?])
    }

    /// The covariance of the values,
    ///
    /// ```text
    /// s² (JᵀJ)⁻¹ ,     s² = Σ r² / (values − unknowns) ,     J = ∂r/∂(unknowns) ,     r = (y − m)/σ                (T-126)
    /// ```
    ///
    /// to first order; with as many values as unknowns s is one.
    pub fn covariance(&self) -> &DMatrix<f64> {
        &self.covariance
    }

    /// (y − m)/σ for every value, in the order in which they were given.
    pub fn residuals(&self) -> &[f64] {
        &self.residuals
    }

    /// The runs on the way, how each unknown was moved.
    pub fn trials(&self) -> &[Trial] {
        &self.trials
    }

    fn place(&self, name: &str) -> Option<usize> {
        self.names.iter().position(|own| own == name)
    }
}

/// A line for each unknown: first value, value, deviation; then the deviation of the measurements.
impl<M, const N: usize> fmt::Display for Fitted<M, N> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let widest = self.names.iter().map(String::len).max().unwrap_or(0);
        for (place, name) in self.names.iter().enumerate() {
            let deviation = self.deviations[place];
            writeln!(
                f,
                "{name:<widest$}  {:>12} -> {:>14} ± {deviation:.2e}",
                digits(self.first[place], 6),
                digits(self.values[place], 8)
            )?;
        }
        let mean = norm(&self.residuals) / (self.residuals.len().max(1) as f64).sqrt();
        write!(
            f,
            "{} values, deviation {mean:.3e}, {} runs",
            self.residuals.len(),
            self.trials.len()
        )
    }
}
