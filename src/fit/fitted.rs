//! The result of a fit.

use crate::motion::Motion;
use crate::numbers::{digits, norm};
use nalgebra::DMatrix;
use std::fmt;
use tfe_runtime::State;

/// The result of a fit: the model with the fitted parameters, their covariance and the residuals; from
/// [`Fit::solve`](super::Fit::solve).
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

/// One run during the iteration of a fit.
#[derive(Clone, Debug, PartialEq)]
pub struct Trial {
    /// The values of the unknowns, in the order of [`Fitted::names`].
    pub values: Vec<f64>,
    /// The root mean square of the weighted residuals (y − m)/σ; infinite if the run failed.
    pub deviation: f64,
}

impl<M, const N: usize> Fitted<M, N> {
    /// The model with the fitted parameters.
    pub fn model(&self) -> &M {
        &self.model
    }

    /// The motion of the fitted model over the time of the measurements.
    pub fn motion(&self) -> &Motion<N> {
        &self.motion
    }

    /// The state at the start, fitted or given.
    pub fn start(&self) -> State<N> {
        self.motion.states()[0].state()
    }

    /// The names of the unknowns: the parameters, then, if the start was unknown, all momenta and all coordinates, as
    /// `momentum of theta at the start` and `theta at the start`.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// The fitted values of the unknowns, in the order of [`names`](Self::names).
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// The fitted value of one unknown; `None` if there is no unknown of this name.
    pub fn value(&self, name: &str) -> Option<f64> {
        Some(self.values[self.place(name)?])
    }

    /// The standard deviation of one unknown, the square root of its variance in the [covariance](Self::covariance);
    /// `None` if there is no unknown of this name.
    pub fn deviation(&self, name: &str) -> Option<f64> {
        Some(self.deviations[self.place(name)?])
    }

    /// The covariance matrix of the unknowns,
    ///
    /// ```text
    /// s² (JᵀJ)⁻¹ ,     s² = Σ r² / (values − unknowns) ,     J = ∂r/∂(unknowns) ,     r = (y − m)/σ                (T-126)
    /// ```
    ///
    /// to first order; s is one if there are as many values as unknowns. Rows and columns are in the order of
    /// [`names`](Self::names).
    pub fn covariance(&self) -> &DMatrix<f64> {
        &self.covariance
    }

    /// The weighted residuals (y − m)/σ of all measured values, in the order in which they were given.
    pub fn residuals(&self) -> &[f64] {
        &self.residuals
    }

    /// The runs of the iteration, which show how each unknown moved.
    pub fn trials(&self) -> &[Trial] {
        &self.trials
    }

    fn place(&self, name: &str) -> Option<usize> {
        self.names.iter().position(|own| own == name)
    }
}

/// A line for each unknown: first value, value, standard deviation; then the deviation of the measurements.
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
