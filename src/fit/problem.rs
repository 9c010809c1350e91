//! The least-squares problem of a fit, for the solver library; independent of the type of the model, so that it is
//! compiled only once.

use super::error::FitError;
use super::fitted::Trial;
use super::unknowns::Unknowns;
use crate::numbers::{digits, largest, norm};
use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt, TerminationReason};
use nalgebra::{DMatrix, DVector, Dyn, U1, VecStorage};

/// Computes residuals and their derivatives from the unknowns.
pub(super) trait Compare {
    /// The residuals for given unknowns; their number is always the same.
    ///
    /// # Errors
    /// Why they cannot be computed.
    fn compare(&mut self, values: &[f64]) -> Result<Compared, FitError>;
}

/// The measured values compared with a motion.
pub(super) struct Compared {
    pub(super) residuals: Vec<f64>,
    /// The derivatives by the unknowns, a row for each residual.
    pub(super) slopes: DMatrix<f64>,
}

impl Compared {
    /// Whether no unknown alone reduces the sum of squares: the residuals are orthogonal to their derivatives.
    fn is_stationary(&self) -> bool {
        /// The largest cosine of the angle between them; far above the effect of noise at a minimum.
        const PERPENDICULAR: f64 = 1e-4;

        let unit = |numbers: &[f64]| {
            let size = norm(numbers);
            // Both vectors are normalised first, since their product may overflow or underflow.
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

    /// By how much an unknown alone has to change for the least sum of squares, to first order; zero if that changes the
    /// sum by nothing that counts.
    fn step_of(&self, place: usize) -> f64 {
        /// The least cosine of the angle between residuals and their derivatives that counts.
        const SLANTED: f64 = 1e-4;

        let column = self.slopes.column(place);
        let sizes = [norm(&self.residuals), norm(column.as_slice())];
        if !sizes.iter().all(|size| *size > 0.0) {
            return 0.0;
        }
        let pairs = column.iter().zip(&self.residuals);
        let cosine: f64 = pairs.map(|(s, r)| (s / sizes[1]) * (r / sizes[0])).sum();
        if cosine.abs() > SLANTED {
            -cosine * (sizes[0] / sizes[1])
        } else {
            0.0
        }
    }

    /// The covariance matrix s² (JᵀJ)⁻¹ (T-126), and the square roots of its diagonal, whose squares may underflow.
    fn covariance(&self, names: &[String]) -> Result<(DMatrix<f64>, Vec<f64>), FitError> {
        /// Singular values below this, relative to the largest and for columns normalised to one, are due to rounding
        /// errors of the motion.
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
        // The standard deviation s.
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

/// The residuals as functions of unbounded variables, at the last trial.
pub(super) struct Least<'r> {
    runs: &'r mut dyn Compare,
    unknowns: &'r Unknowns,
    shows: bool,
    numbers: DVector<f64>,
    /// `None` if the run failed.
    here: Option<Compared>,
    /// The error of the last trial that failed.
    failure: Option<FitError>,
    /// The number of residuals.
    count: usize,
    trials: Vec<Trial>,
    /// A power of two close to the largest initial residual. The solver forms squares, which in this unit neither
    /// overflow nor underflow.
    unit: f64,
    /// The initial sum of squares, in this unit.
    first: f64,
}

/// The result of the iteration.
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
        least.release();
        Ok(least)
    }

    /// Moves unknowns at a bound, where the variables have no rate, away from it if that reduces the sum of squares.
    /// Returns whether there were any; if the run there fails, nothing is moved.
    fn release(&mut self) -> bool {
        /// The part of the way to the least sum of squares; the next step goes there.
        const PART: f64 = 0.25;

        let Some(here) = &self.here else {
            return false;
        };
        let values = self.unknowns.values(self.numbers.as_slice()).0;
        let mut numbers = self.numbers.clone();
        let mut is_moved = false;
        for (place, value) in values.into_iter().enumerate() {
            let distance = PART * here.step_of(place);
            if let Some(number) = self.unknowns.released(place, value, distance) {
                numbers[place] = number;
                is_moved = true;
            }
        }
        if !is_moved {
            return false;
        }
        let before = (self.numbers.clone(), self.here.take(), self.failure.take());
        self.set_params(&numbers);
        if self.here.is_none() {
            (self.numbers, self.here, self.failure) = before;
            return false;
        }
        true
    }

    /// The root of the sum of squares; infinite if the last run failed.
    fn size(&self) -> f64 {
        (self.here.as_ref()).map_or(f64::INFINITY, |here| norm(&here.residuals))
    }

    pub(super) fn solve(mut self) -> Result<Solved, FitError> {
        /// The number of times that unknowns are moved away from bounds.
        const RELEASES: u32 = 20;
        /// The least decrease of the residuals for which they are moved once more.
        const GAIN: f64 = 0.995;

        let mut reason = self.minimised();
        for _ in 0..RELEASES {
            let (before, size) = (self.numbers.clone(), self.size());
            let kept = self.failure.clone();
            if !self.release() {
                break;
            }
            let next = self.minimised();
            let is_less = self.size() < size;
            if is_less {
                reason = next;
            } else {
                self.failure = kept;
                self.set_params(&before);
            }
            if !(self.size() < GAIN * size) {
                break;
            }
        }
        self.finished(&reason)
    }

    /// Follows the method of Levenberg and Marquardt from the present unknowns; returns why it ended.
    fn minimised(&mut self) -> TerminationReason {
        /// The relative changes of the sum of squares and of the unknowns at which the iteration ends; far below the
        /// effect of noise.
        const TOLERANCE: f64 = 1e-12;

        let method = LevenbergMarquardt::new()
            .with_ftol(TOLERANCE)
            .with_xtol(TOLERANCE)
            .with_gtol(TOLERANCE)
            // The first steps are of the size of the unknowns, not the default of a hundred times that.
            .with_stepbound(1.0);
        method.minimize(Follower(self)).1.termination
    }

    /// The result of the iteration.
    fn finished(self, reason: &TerminationReason) -> Result<Solved, FitError> {
        /// The number of trials that decide at the end, including the run to which the iteration returns.
        const LAST_TRIALS: usize = 3;

        use TerminationReason::{Converged, NoImprovementPossible, Orthogonal, ResidualsZero};
        let Self {
            unknowns,
            numbers,
            here,
            failure,
            trials,
            ..
        } = self;
        let values = unknowns.values(numbers.as_slice()).0;
        let converged = matches!(
            reason,
            ResidualsZero | Orthogonal | Converged { .. } | NoImprovementPossible(_)
        );
        // The steps became short because trials failed, not because a minimum was reached.
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
                    None => told(reason),
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

    /// Compares a run at the current variables with the measurements.
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

    /// Records the trial, and shows it.
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

/// Why the method of Levenberg and Marquardt ended without a minimum, where no run failed nearby.
fn told(reason: &TerminationReason) -> String {
    match reason {
        TerminationReason::LostPatience => "the largest number of runs is reached".to_owned(),
        TerminationReason::Numerical(what) => format!("{what} is not finite"),
        _ => "the last run failed".to_owned(),
    }
}

/// A power of two close to the largest residual; close to the largest derivative if all residuals are zero.
fn unit_of(start: &Compared) -> f64 {
    let sizes = [&start.residuals[..], start.slopes.as_slice()].map(largest);
    let size = sizes.into_iter().find(|size| *size > 0.0);
    // Neither the unit nor numbers divided by it may overflow.
    let exponent = size.unwrap_or(1.0).log2().round().clamp(-1000.0, 1000.0);
    exponent.exp2()
}

impl Least<'_> {
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
}

/// The problem as the solver library asks for it.
struct Follower<'a, 'r>(&'a mut Least<'r>);

impl LeastSquaresProblem<f64, Dyn, Dyn> for Follower<'_, '_> {
    type ResidualStorage = VecStorage<f64, Dyn, U1>;
    type JacobianStorage = VecStorage<f64, Dyn, Dyn>;
    type ParameterStorage = VecStorage<f64, Dyn, U1>;

    fn set_params(&mut self, numbers: &DVector<f64>) {
        self.0.set_params(numbers);
    }

    fn params(&self) -> DVector<f64> {
        self.0.numbers.clone()
    }

    /// If the run fails, residuals so large that the trial is refused.
    fn residuals(&self) -> Option<DVector<f64>> {
        Some(match &self.0.here {
            Some(here) => DVector::from_column_slice(&here.residuals) / self.0.unit,
            None => DVector::from_element(self.0.count, 1e6 * (1.0 + self.0.first)),
        })
    }

    fn jacobian(&self) -> Option<DMatrix<f64>> {
        let here = self.0.here.as_ref()?;
        let (_, rates) = self.0.unknowns.values(self.0.numbers.as_slice());
        let (rows, columns) = here.slopes.shape();
        Some(DMatrix::from_fn(rows, columns, |row, column| {
            here.slopes[(row, column)] / self.0.unit * rates[column]
        }))
    }
}
