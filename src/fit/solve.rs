//! Solves a fit.

use super::error::FitError;
use super::fitted::Fitted;
use super::problem::{Least, Solved};
use super::runs::Runs;
use super::setup::Fit;
use super::unknowns::Unknowns;
use tfe_runtime::Model;

impl<M: Model<N>, const N: usize> Fit<'_, M, N> {
    /// Fits the parameters.
    ///
    /// # Errors
    /// If something is missing or invalid [`FitError::NothingUnknown`], [`NothingMeasured`](FitError::NothingMeasured),
    /// [`NoParameter`](FitError::NoParameter), [`NotCopied`](FitError::NotCopied), [`NoOutput`](FitError::NoOutput),
    /// [`Measured`](FitError::Measured), [`Bounds`](FitError::Bounds), [`Early`](FitError::Early),
    /// [`StartOfConstraints`](FitError::StartOfConstraints) or [`TooFew`](FitError::TooFew). [`Run`](FitError::Run) or
    /// [`NotFinite`](FitError::NotFinite) if the first run fails, [`NotConverged`](FitError::NotConverged) if no minimum is
    /// found, [`Undetermined`](FitError::Undetermined) if the measured values do not determine all unknowns.
    pub fn solve(&self) -> Result<Fitted<M, N>, FitError> {
        let columns = self.columns()?;
        let (t0, guess, start_is_known) = self.first(&columns)?;
        let unknowns = Unknowns::new(
            self.model,
            (&self.parameters, &self.bounds),
            (&guess, start_is_known),
        )?;
        let count: usize = columns.iter().map(|one| one.times.len()).sum();
        if count < unknowns.len() {
            return Err(FitError::TooFew {
                values: count,
                unknowns: unknowns.len(),
            });
        }
        let start = start_is_known.then_some(guess);
        let mut runs = Runs::new(self, columns, &unknowns, (t0, start));
        let solved = Least::new(&mut runs, &unknowns, self.progress)?.solve()?;
        let Solved {
            values,
            covariance,
            deviations,
            residuals,
            trials,
        } = solved;
        // The last run is the one with the fitted values.
        let motion = runs.motion().cloned().ok_or(FitError::NotFinite)?;
        let model = runs.model(&values)?;
        Ok(Fitted {
            model,
            motion,
            names: unknowns.names,
            values,
            first: unknowns.first,
            covariance,
            deviations,
            residuals,
            trials,
        })
    }
}
