//! Calls that models of run-time length do not have: one typed error, [`RunErrorKind::Unsupported`], that says which.

use super::setup::Simulation;
use crate::driven::Interpolation;
use crate::error::RunErrorKind;
use crate::length::RunTimeLength;
use std::convert::Infallible;
use tfe_runtime::family::{self, FamilyState};

impl<M: family::Model> Simulation<'_, M, 0, RunTimeLength> {
    /// Refused: models of run-time length have no inputs. The run that is asked for then is an error.
    #[must_use]
    pub fn input(mut self, _: &str, _: impl Fn(f64) -> f64) -> Self {
        self.refusal = Some(RunErrorKind::run_time_length("input"));
        self
    }

    /// Refused, as [`input`](Self::input) is.
    #[must_use]
    pub fn table(
        mut self,
        _: &str,
        _: impl AsRef<[f64]>,
        _: impl AsRef<[f64]>,
        _: Interpolation,
    ) -> Self {
        self.refusal = Some(RunErrorKind::run_time_length("table"));
        self
    }

    /// Refused: models of run-time length have no inputs that could be held. [`steps`](Self::steps) makes one step after the other.
    ///
    /// # Errors
    /// [`RunErrorKind::Unsupported`], in any case.
    pub fn hold(self, _: FamilyState, _: f64) -> Result<Infallible, RunErrorKind> {
        Err(RunErrorKind::run_time_length("hold"))
    }
}
