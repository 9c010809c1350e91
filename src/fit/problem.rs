//! The least-squares problem of a fit, as the library that solves it wants it.

use super::data::{Column, Observed};
use super::error::FitError;
use super::fitted::{Fitted, Trial};
use super::setup::Fit;
use crate::numbers::{largest, norm};
use crate::sensitivity::Sensitive;
use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt, TerminationReason};
use nalgebra::DMatrix;
use std::cell::RefCell;
use std::ops::Range;
use tfe_runtime::{Model, State};

/// What is looked for: parameters, then the numbers of the start, ordered (p, q).
#[derive(Clone, Debug)]
pub(super) struct Unknowns<const N: usize> {
    names: Vec<String>,
    /// The parameters, by their index among all of the model.
    parameters: Vec<usize>,
    ways: Vec<Way>,
    /// The first values.
    first: Vec<f64>,
    start: State<N>,
    start_is_known: bool,
}

/// How a value with bounds x follows from a number without, u.
#[derive(Clone, Copy, Debug)]
enum Way {
    /// x = u
    Free,
    /// x = end ± unit (√(u² + 1) − 1)
    Beyond { end: f64, unit: f64 },
    /// x = low + width (1 + sin u)/2
    Between { low: f64, width: f64 },
}

impl Way {
    fn new(low: f64, high: f64, value: f64) -> Self {
        let unit = |end: f64| match (value - end).abs().max(end.abs()) {
            0.0 => 1.0,
            size => size,
        };
        match (low.is_finite(), high.is_finite()) {
            (false, false) => Self::Free,
            (true, false) => Self::Beyond {
                end: low,
                unit: unit(low),
            },
            (false, true) => Self::Beyond {
                end: high,
                unit: -unit(high),
            },
            (true, true) => Self::Between {
                low,
                width: high - low,
            },
        }
    }

    /// x and dx/du.
    fn value(self, u: f64) -> (f64, f64) {
        match self {
            Self::Free => (u, 1.0),
            Self::Beyond { end, unit } => {
                let root = u.hypot(1.0);
                (end + unit * (root - 1.0), unit * u / root)
            }
            Self::Between { low, width } => {
                let (sin, cos) = u.sin_cos();
                (low + 0.5 * width * (1.0 + sin), 0.5 * width * cos)
            }
        }
    }

    /// u of x; a little inside of a bound, where x does not move with u.
    fn number(self, x: f64) -> f64 {
        const INSIDE: f64 = 1e-2;
        match self {
            Self::Free => x,
            Self::Beyond { end, unit } => {
                let root = 1.0 + (x - end) / unit;
                (root * root - 1.0).max(0.0).sqrt().max(INSIDE)
            }
            Self::Between { low, width } => {
                let sin = 2.0 * (x - low) / width - 1.0;
                sin.clamp(INSIDE - 1.0, 1.0 - INSIDE).asin()
            }
        }
    }
}

impl<const N: usize> Unknowns<N> {
    pub(super) fn new<M: Model<N>>(
        model: &M,
        (names, bounds): (&[String], &[(String, f64, f64)]),
        (start, start_is_known): (State<N>, bool),
    ) -> Result<Self, FitError> {
        let mut unknowns = Self {
            names: Vec::new(),
            parameters: Vec::new(),
            ways: Vec::new(),
            first: Vec::new(),
            start,
            start_is_known,
        };
        for name in names {
            let index = model.find_parameter(name);
            let index = index.filter(|index| !unknowns.parameters.contains(index));
            let index = index.ok_or_else(|| FitError::NoParameter {
                name: name.clone(),
                known: (0..model.parameters())
                    .map(|at| model.parameter_name(at).to_string())
                    .collect(),
            })?;
            let value = model.parameter(index);
            if model.with_parameter(index, value).is_none() {
                return Err(FitError::NotCopied);
            }
            let own = bounds.iter().rev().find(|(own, ..)| own == name);
            let (low, high) = own.map_or((f64::NEG_INFINITY, f64::INFINITY), |one| (one.1, one.2));
            if !(low < high && (low..=high).contains(&value)) {
                return Err(FitError::Bounds {
                    name: name.clone(),
                    low,
                    high,
                    value,
                });
            }
            unknowns.parameters.push(index);
            unknowns.push(name.clone(), Way::new(low, high, value), value);
        }
        let stray = bounds.iter().find(|(own, ..)| !names.contains(own));
        if let Some((name, low, high)) = stray {
            return Err(FitError::Bounds {
                name: name.clone(),
                low: *low,
                high: *high,
                value: f64::NAN,
            });
        }
        if !start_is_known {
            for a in 0..N {
                let name = format!("momentum of {} at the start", M::coordinate_name(a));
                unknowns.push(name, Way::Free, start.p[a]);
            }
            for a in 0..N {
                let name = format!("{} at the start", M::coordinate_name(a));
                unknowns.push(name, Way::Free, start.q[a]);
            }
        }
        if unknowns.names.is_empty() {
            return Err(FitError::NothingUnknown);
        }
        Ok(unknowns)
    }

    fn push(&mut self, name: String, way: Way, value: f64) {
        self.names.push(name);
        self.ways.push(way);
        self.first.push(value);
    }

    pub(super) fn len(&self) -> usize {
        self.names.len()
    }

    /// The values of numbers without bounds, and their rates.
    fn values(&self, numbers: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let ways = self.ways.iter().zip(numbers);
        ways.map(|(way, u)| way.value(*u)).unzip()
    }

    fn numbers(&self) -> Vec<f64> {
        let ways = self.ways.iter().zip(&self.first);
        ways.map(|(way, x)| way.number(*x)).collect()
    }

    /// The start of a run with these values.
    fn start(&self, values: &[f64]) -> State<N> {
        if self.start_is_known {
            return self.start;
        }
        let own = &values[self.parameters.len()..];
        State {
            p: std::array::from_fn(|a| own[a]),
            q: std::array::from_fn(|a| own[N + a]),
        }
    }

    /// The model with these values.
    fn model<M: Model<N>>(&self, model: &M, values: &[f64]) -> Result<M, FitError> {
        let mut made = None;
        for (index, value) in self.parameters.iter().zip(values) {
            let from = made.as_ref().unwrap_or(model);
            made = Some(
                from.with_parameter(*index, *value)
                    .ok_or(FitError::NotCopied)?,
            );
        }
        match made {
            Some(made) => Ok(made),
            // Only the start is looked for: a copy, by way of any parameter.
            None => model
                .with_parameter(0, model.parameter(0))
                .ok_or(FitError::NotCopied),
        }
    }
}

/// Residuals and their derivatives as functions of the unknowns.
pub(super) struct Least<'f, M, const N: usize> {
    fit: &'f Fit<'f, M, N>,
    columns: Vec<Column<'f>>,
    unknowns: Unknowns<N>,
    span: Range<f64>,
    times: Vec<f64>,
    numbers: nalgebra::DVector<f64>,
    here: RefCell<Option<Evaluated<N>>>,
    trials: RefCell<Vec<Trial>>,
    /// A power of two near the largest residual at the beginning: the library that solves the problem forms squares, of units in which they neither vanish nor overflow.
    unit: f64,
    /// The sum of squares at the beginning, in this unit.
    first: f64,
}

/// A run with its residuals.
#[derive(Clone)]
struct Evaluated<const N: usize> {
    sensitive: Sensitive<N>,
    residuals: Vec<f64>,
    /// By the values, a row for each residual.
    slopes: DMatrix<f64>,
}

impl<'f, M: Model<N>, const N: usize> Least<'f, M, N> {
    pub(super) fn new(
        fit: &'f Fit<'f, M, N>,
        columns: Vec<Column<'f>>,
        unknowns: Unknowns<N>,
        t0: f64,
    ) -> Result<Self, FitError> {
        let mut times: Vec<f64> = columns.iter().flat_map(|one| one.times).copied().collect();
        times.sort_by(f64::total_cmp);
        times.dedup();
        let last = times.last().copied().unwrap_or(t0);
        let numbers = nalgebra::DVector::from_vec(unknowns.numbers());
        let mut least = Self {
            fit,
            columns,
            unknowns,
            span: t0..last,
            times,
            numbers,
            here: RefCell::new(None),
            trials: RefCell::new(Vec::new()),
            unit: 1.0,
            first: 0.0,
        };
        let start = least.evaluate()?;
        least.unit = unit_of(&start);
        least.first = (norm(&start.residuals) / least.unit).powi(2);
        least.note(Some(&start));
        *least.here.borrow_mut() = Some(start);
        Ok(least)
    }

    pub(super) fn solve(self) -> Result<Fitted<M, N>, FitError> {
        /// Relative changes of the sum of squares and of the unknowns that end the iteration: far below what noise does to them.
        const TOLERANCE: f64 = 1e-12;

        let method = LevenbergMarquardt::new()
            .with_ftol(TOLERANCE)
            .with_xtol(TOLERANCE)
            .with_gtol(TOLERANCE)
            // First steps of the size of the unknowns, not a hundred times as long.
            .with_stepbound(1.0);
        let (done, report) = method.minimize(self);
        use TerminationReason::{Converged, NoImprovementPossible, Orthogonal, ResidualsZero};
        let values = done.unknowns.values(done.numbers.as_slice()).0;
        let trials = done.trials.take();
        let reason = report.termination;
        let evaluated = done.here.take();
        let converged = matches!(
            reason,
            ResidualsZero | Orthogonal | Converged { .. } | NoImprovementPossible(_)
        );
        let (Some(evaluated), true) = (evaluated, converged) else {
            let least = trials.iter().fold(None, |least: Option<&Trial>, one| {
                let is_less = least.is_none_or(|least| one.deviation < least.deviation);
                if is_less { Some(one) } else { least }
            });
            return Err(FitError::NotConverged {
                best: least.map_or(values, |one| one.values.clone()),
                deviation: least.map_or(f64::INFINITY, |one| one.deviation),
                runs: trials.len(),
                why: format!("{reason:?}"),
            });
        };
        let (covariance, deviations) = done.covariance(&evaluated)?;
        Ok(Fitted {
            model: done.unknowns.model(done.fit.model, &values)?,
            motion: evaluated.sensitive.motion().clone(),
            names: done.unknowns.names,
            values,
            first: done.unknowns.first,
            covariance,
            deviations,
            residuals: evaluated.residuals,
            trials,
        })
    }

    /// The run at the current numbers.
    fn evaluate(&self) -> Result<Evaluated<N>, FitError> {
        let (values, _) = self.unknowns.values(self.numbers.as_slice());
        let model = self.unknowns.model(self.fit.model, &values)?;
        let start = self.unknowns.start(&values);
        let run = self.fit.simulation(&model, &self.times);
        let parameters = &self.unknowns.parameters;
        let sensitive = run.run_sensitive_by(start, self.span.clone(), parameters);
        let sensitive = sensitive.map_err(|error| FitError::Run(error.kind().clone()))?;
        let count = self.columns.iter().map(|one| one.times.len()).sum();
        let mut residuals = Vec::with_capacity(count);
        let mut slopes = DMatrix::zeros(count, self.unknowns.len());
        let motion = sensitive.motion();
        for column in &self.columns {
            for (t, measured) in column.times.iter().zip(column.values) {
                // Elements end there.
                let node = motion.nearest(*t);
                let (value, by_parameters, by_start) = match column.place {
                    Observed::Output(place) => sensitive.output_at(node, place),
                    Observed::Coordinate(a) => sensitive.coordinate_at(node, a),
                };
                let row = residuals.len();
                residuals.push((value - measured) / column.deviation);
                let all = by_parameters.iter().chain(&by_start);
                for (place, slope) in (0..self.unknowns.len()).zip(all) {
                    slopes[(row, place)] = slope / column.deviation;
                }
            }
        }
        let all_finite = residuals.iter().chain(slopes.iter()).all(|x| x.is_finite());
        if !all_finite {
            return Err(FitError::NotFinite);
        }
        Ok(Evaluated {
            sensitive,
            residuals,
            slopes,
        })
    }

    /// Keeps a trial, and shows it.
    fn note(&self, evaluated: Option<&Evaluated<N>>) {
        let (values, _) = self.unknowns.values(self.numbers.as_slice());
        let deviation = evaluated.map_or(f64::INFINITY, |one| {
            norm(&one.residuals) / (one.residuals.len() as f64).sqrt()
        });
        let mut trials = self.trials.borrow_mut();
        if self.fit.progress {
            let named = self.unknowns.names.iter().zip(&values);
            let named: Vec<_> = named.map(|(name, x)| format!("{name} {x:.6}")).collect();
            eprintln!(
                "run {}: deviation {deviation:.3e}, {}",
                trials.len() + 1,
                named.join(", ")
            );
        }
        trials.push(Trial { values, deviation });
    }

    /// s² (JᵀJ)⁻¹ (T-126), and the roots of its diagonal, whose squares may be less than any number.
    fn covariance(&self, evaluated: &Evaluated<N>) -> Result<(DMatrix<f64>, Vec<f64>), FitError> {
        /// Singular values below this part of the largest, of columns of length one, are roundings of the motion.
        const TOLD: f64 = 1e-11;

        let mut slopes = evaluated.slopes.clone();
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
            name: self.unknowns.names[place].clone(),
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
            free => norm(&evaluated.residuals) / (free as f64).sqrt(),
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

/// A power of two near the largest residual; near the largest slope where all residuals are zero.
fn unit_of<const N: usize>(start: &Evaluated<N>) -> f64 {
    let sizes = [&start.residuals[..], start.slopes.as_slice()].map(largest);
    let size = sizes.into_iter().find(|size| *size > 0.0);
    // Neither it nor what is divided by it is beyond what a number can be.
    let exponent = size.unwrap_or(1.0).log2().round().clamp(-1000.0, 1000.0);
    exponent.exp2()
}

impl<M: Model<N>, const N: usize> LeastSquaresProblem<f64, nalgebra::Dyn, nalgebra::Dyn>
    for Least<'_, M, N>
{
    type ResidualStorage = nalgebra::VecStorage<f64, nalgebra::Dyn, nalgebra::U1>;
    type JacobianStorage = nalgebra::VecStorage<f64, nalgebra::Dyn, nalgebra::Dyn>;
    type ParameterStorage = nalgebra::VecStorage<f64, nalgebra::Dyn, nalgebra::U1>;

    fn set_params(&mut self, numbers: &nalgebra::DVector<f64>) {
        if self.numbers == *numbers && self.here.borrow().is_some() {
            return;
        }
        self.numbers.copy_from(numbers);
        let evaluated = self.evaluate().ok();
        self.note(evaluated.as_ref());
        *self.here.borrow_mut() = evaluated;
    }

    fn params(&self) -> nalgebra::DVector<f64> {
        self.numbers.clone()
    }

    /// Where the run fails they are so large that the trial is refused.
    fn residuals(&self) -> Option<nalgebra::DVector<f64>> {
        let count = self.columns.iter().map(|one| one.times.len()).sum();
        Some(match &*self.here.borrow() {
            Some(here) => nalgebra::DVector::from_column_slice(&here.residuals) / self.unit,
            None => nalgebra::DVector::from_element(count, 1e6 * (1.0 + self.first)),
        })
    }

    fn jacobian(&self) -> Option<nalgebra::DMatrix<f64>> {
        let here = self.here.borrow();
        let here = here.as_ref()?;
        let (_, rates) = self.unknowns.values(self.numbers.as_slice());
        let (rows, columns) = here.slopes.shape();
        Some(nalgebra::DMatrix::from_fn(rows, columns, |row, column| {
            here.slopes[(row, column)] / self.unit * rates[column]
        }))
    }
}
