//! The least-squares problem of a fit, as the library that solves it wants it; of no model, so that it is compiled once.

use super::error::FitError;
use super::fitted::Trial;
use super::unknowns::Unknowns;
use crate::numbers::{digits, largest, norm};
use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt, TerminationReason};
use nalgebra::{DMatrix, DVector, Dyn, U1, VecStorage};

/// Residuals and their derivatives as functions of the unknowns.
pub(super) trait Compare {
    /// Those of some values; always as many.
    ///
    /// # Errors
    /// Why there are none.
    fn compare(&mut self, values: &[f64]) -> Result<Compared, FitError>;
}

/// What was measured beside a motion.
pub(super) struct Compared {
    pub(super) residuals: Vec<f64>,
    /// By the values, a row for each residual.
    pub(super) slopes: DMatrix<f64>,
}

impl Compared {
    /// Whether no unknown alone makes the sum of squares less: the residuals are perpendicular to their derivatives.
    fn is_stationary(&self) -> bool {
        /// Of the cosine, far above what noise leaves at a least sum.
        const PERPENDICULAR: f64 = 1e-4;

        let unit = |numbers: &[f64]| {
            let size = norm(numbers);
            // Products of numbers of any size vanish or overflow, of their parts they do not.
            DVector::from_iterator(
                numbers.len(),
                numbers
                    .iter()
                    .map(|x| if size > 0.0 { x / size } else { 0.0 }),
            )
        };
        let residuals = unit(&self.residuals);
        let mut columns = self.slopes.column_iter();
        columns.all(|column| unit(column.as_slice()).dot(&residuals).abs() <= PERPENDICULAR)
    }

    /// s² (JᵀJ)⁻¹ (T-126), and the roots of its diagonal, whose squares may be less than any number.
    fn covariance(&self, names: &[String]) -> Result<(DMatrix<f64>, Vec<f64>), FitError> {
        /// Singular values below this part of the largest, of columns of length one, are roundings of the motion.
        const TOLD: f64 = 1e-11;

        let mut slopes = self.slopes.clone();
        let (rows, columns) = slopes.shape();
        let mut lengths = Vec::with_capacity(columns);
        for mut column in slopes.column_iter_mut() {
            let length = norm(column.as_slice());
            if length > 0.0 {
                column.apply(|slope| *slope /= length);
            }
            lengths.push(length);
        }
        let svd = slopes.svd(false, true);
        let (largest, least) = (svd.singular_values.max(), svd.singular_values.imin());
        let undetermined = |place: usize| FitError::Undetermined {
            name: names[place].clone(),
        };
        let Some(right) = svd.v_t.filter(|_| largest > 0.0) else {
            return Err(undetermined(0));
        };
        if svd.singular_values[least] < TOLD * largest {
            return Err(undetermined(right.row(least).iamax_full().1));
        }
        // s
        let deviation = match rows - columns {
            0 => 1.0,
            free => norm(&self.residuals) / (free as f64).sqrt(),
        };
        let inverse = DMatrix::from_diagonal(&svd.singular_values.map(|one| 1.0 / (one * one)));
        let scaled = right.transpose() * inverse * right;
        let covariance = DMatrix::from_fn(columns, columns, |a, b| {
            scaled[(a, b)] * (deviation / lengths[a]) * (deviation / lengths[b])
        });
        if !covariance.iter().all(|entry| entry.is_finite()) {
            return Err(FitError::NotFinite);
        }
        let deviation_of = |a: usize| scaled[(a, a)].sqrt() * (deviation / lengths[a]);
        Ok((covariance, (0..columns).map(deviation_of).collect()))
    }
}

/// Residuals as functions of numbers without bounds, at the last ones that were tried.
pub(super) struct Least<'r> {
    runs: &'r mut dyn Compare,
    unknowns: &'r Unknowns,
    shows: bool,
    numbers: DVector<f64>,
    /// None where the run failed.
    here: Option<Compared>,
    /// Why the last trial that failed has.
    failure: Option<FitError>,
    /// Of residuals.
    count: usize,
    trials: Vec<Trial>,
    /// A power of two near the largest residual at the beginning: the library that solves the problem forms squares, of units in which they neither vanish nor overflow.
    unit: f64,
    /// The sum of squares at the beginning, in this unit.
    first: f64,
}

/// What has come of it.
pub(super) struct Solved {
    pub(super) values: Vec<f64>,
    pub(super) covariance: DMatrix<f64>,
    pub(super) deviations: Vec<f64>,
    pub(super) residuals: Vec<f64>,
    pub(super) trials: Vec<Trial>,
}

impl<'r> Least<'r> {
    pub(super) fn new(
        runs: &'r mut dyn Compare,
        unknowns: &'r Unknowns,
        shows: bool,
    ) -> Result<Self, FitError> {
        let mut least = Self {
            runs,
            unknowns,
            shows,
            numbers: DVector::from_vec(unknowns.numbers()),
            here: None,
            failure: None,
            count: 0,
            trials: Vec::new(),
            unit: 1.0,
            first: 0.0,
        };
        let start = least.compare()?;
        least.count = start.residuals.len();
        least.unit = unit_of(&start);
        least.first = (norm(&start.residuals) / least.unit).powi(2);
        least.here = Some(start);
        least.note();
        Ok(least)
    }

    pub(super) fn solve(self) -> Result<Solved, FitError> {
        /// Relative changes of the sum of squares and of the unknowns that end the iteration: far below what noise does to them.
        const TOLERANCE: f64 = 1e-12;
        /// Those that decide at the end, and the run that is gone back to.
        const LAST_TRIALS: usize = 3;

        let method = LevenbergMarquardt::new()
            .with_ftol(TOLERANCE)
            .with_xtol(TOLERANCE)
            .with_gtol(TOLERANCE)
            // First steps of the size of the unknowns, not a hundred times as long.
            .with_stepbound(1.0);
        let (done, report) = method.minimize(self);
        use TerminationReason::{Converged, NoImprovementPossible, Orthogonal, ResidualsZero};
        let Self {
            unknowns,
            numbers,
            here,
            failure,
            trials,
            ..
        } = done;
        let values = unknowns.values(numbers.as_slice()).0;
        let reason = report.termination;
        let converged = matches!(
            reason,
            ResidualsZero | Orthogonal | Converged { .. } | NoImprovementPossible(_)
        );
        // Steps that became short because trials failed, not because there is nothing to gain.
        let failure = failure.filter(|_| {
            let mut last = trials.iter().rev().take(LAST_TRIALS);
            last.any(|one| one.deviation.is_infinite())
                && here.as_ref().is_some_and(|one| !one.is_stationary())
        });
        let is_found = converged && failure.is_none();
        let Some(compared) = here.filter(|_| is_found) else {
            let least = trials.iter().fold(None, |least: Option<&Trial>, one| {
                let is_less = least.is_none_or(|least| one.deviation < least.deviation);
                if is_less { Some(one) } else { least }
            });
            return Err(FitError::NotConverged {
                best: least.map_or(values, |one| one.values.clone()),
                deviation: least.map_or(f64::INFINITY, |one| one.deviation),
                runs: trials.len(),
                why: match failure {
                    Some(FitError::Run(kind)) => format!("runs nearby fail, {kind}"),
                    Some(_) => "outputs nearby are not finite".to_owned(),
                    None => format!("{reason:?}"),
                },
            });
        };
        let (covariance, deviations) = compared.covariance(&unknowns.names)?;
        Ok(Solved {
            values,
            covariance,
            deviations,
            residuals: compared.residuals,
            trials,
        })
    }

    /// A run with the current numbers.
    fn compare(&mut self) -> Result<Compared, FitError> {
        let (values, _) = self.unknowns.values(self.numbers.as_slice());
        let compared = self.runs.compare(&values)?;
        let mut all = compared.residuals.iter().chain(compared.slopes.iter());
        if all.all(|number| number.is_finite()) {
            Ok(compared)
        } else {
            Err(FitError::NotFinite)
        }
    }

    /// Keeps the trial, and shows it.
    fn note(&mut self) {
        let (values, _) = self.unknowns.values(self.numbers.as_slice());
        let deviation = self.here.as_ref().map_or(f64::INFINITY, |one| {
            norm(&one.residuals) / (one.residuals.len() as f64).sqrt()
        });
        if self.shows {
            let named = self.unknowns.names.iter().zip(&values);
            let named: Vec<_> = named
                .map(|(name, x)| format!("{name} {}", digits(*x, 6)))
                .collect();
            eprintln!(
                "run {}: deviation {deviation:.3e}, {}",
                self.trials.len() + 1,
                named.join(", ")
            );
        }
        self.trials.push(Trial { values, deviation });
    }
}

/// A power of two near the largest residual; near the largest slope where all residuals are zero.
fn unit_of(start: &Compared) -> f64 {
    let sizes = [&start.residuals[..], start.slopes.as_slice()].map(largest);
    let size = sizes.into_iter().find(|size| *size > 0.0);
    // Neither it nor what is divided by it is beyond what a number can be.
    let exponent = size.unwrap_or(1.0).log2().round().clamp(-1000.0, 1000.0);
    exponent.exp2()
}

impl LeastSquaresProblem<f64, Dyn, Dyn> for Least<'_> {
    type ResidualStorage = VecStorage<f64, Dyn, U1>;
    type JacobianStorage = VecStorage<f64, Dyn, Dyn>;
    type ParameterStorage = VecStorage<f64, Dyn, U1>;

    fn set_params(&mut self, numbers: &DVector<f64>) {
        if self.numbers == *numbers && self.here.is_some() {
            return;
        }
        self.numbers.copy_from(numbers);
        self.here = match self.compare() {
            Ok(compared) => Some(compared),
            Err(error) => {
                self.failure = Some(error);
                None
            }
        };
        self.note();
    }

    fn params(&self) -> DVector<f64> {
        self.numbers.clone()
    }

    /// Where the run fails they are so large that the trial is refused.
    fn residuals(&self) -> Option<DVector<f64>> {
        Some(match &self.here {
            Some(here) => DVector::from_column_slice(&here.residuals) / self.unit,
            None => DVector::from_element(self.count, 1e6 * (1.0 + self.first)),
        })
    }

    fn jacobian(&self) -> Option<DMatrix<f64>> {
        let here = self.here.as_ref()?;
        let (_, rates) = self.unknowns.values(self.numbers.as_slice());
        let (rows, columns) = here.slopes.shape();
        Some(DMatrix::from_fn(rows, columns, |row, column| {
            here.slopes[(row, column)] / self.unit * rates[column]
        }))
    }
}
