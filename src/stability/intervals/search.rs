//! Sampling a matrix over a range of its parameter.

use super::error::IntervalError;
use crate::stability::sign_functions::{Measure, shifted_determinant};
use nalgebra::DMatrix;
use std::rc::Rc;

/// A quantity is trusted at this many times the change under a perturbation: four random ones may miss the worst direction.
const TRUST: f64 = 4.0;
/// A piece is not split below this length relative to its position: a pole sits there.
pub(super) const SHORTEST: f64 = 1e-10;
/// Where a piece is split, for the same reason not at ½.
pub(super) const SPLIT: f64 = 0.4957;
/// The budget: three modes over some fifty periods, with all their crossings, need a sixth of it.
const MOST_EVALUATIONS: usize = 200_000;

/// What is known at one value of the parameter.
#[derive(Clone, Debug)]
pub(super) struct Sample {
    pub(super) at: f64,
    pub(super) matrix: DMatrix<f64>,
    /// What round-off in each entry is relative to, in the piece around.
    pub(super) scale: Rc<DMatrix<f64>>,
    pub(super) functions: Vec<f64>,
    pub(super) radius: f64,
}

/// The matrix could not be computed: the error stays with who computes it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Withheld;

/// Why a search ends early.
pub(super) type Failure = IntervalError<Withheld>;

/// The matrix at a value of the parameter: a pointer to a function, so that the search is compiled once and not for every model.
pub(super) type Matrix<'m> = &'m mut dyn FnMut(f64) -> Result<DMatrix<f64>, Withheld>;

/// The search through one range.
pub(super) struct Search<'m> {
    matrix: Matrix<'m>,
    pub(super) measure: Measure,
    pub(super) size: usize,
    evaluations: usize,
    /// Ascending once the range is resolved.
    pub(super) samples: Vec<Sample>,
    /// Where a function touches zero, or is unresolved.
    pub(super) touches: Vec<f64>,
}

impl<'m> Search<'m> {
    /// Nothing sampled yet.
    pub(super) fn new(matrix: Matrix<'m>) -> Self {
        Self {
            matrix,
            measure: Measure::General,
            size: 0,
            evaluations: 0,
            samples: Vec::new(),
            touches: Vec::new(),
        }
    }

    pub(super) fn matrix_at(&mut self, at: f64) -> Result<DMatrix<f64>, Failure> {
        if self.evaluations >= MOST_EVALUATIONS {
            return Err(IntervalError::Unresolved {
                near: at,
                evaluations: self.evaluations,
            });
        }
        self.evaluations += 1;
        let matrix = (self.matrix)(at).map_err(|source| IntervalError::Matrix { at, source })?;
        let (rows, columns) = matrix.shape();
        if rows != columns || rows == 0 || (self.size != 0 && rows != self.size) {
            return Err(IntervalError::Shape { at, rows, columns });
        }
        self.size = rows;
        if matrix.iter().any(|entry| !entry.is_finite()) {
            return Err(IntervalError::NotFinite { at });
        }
        Ok(matrix)
    }

    pub(super) fn sample(&mut self, at: f64, scale: &Rc<DMatrix<f64>>) -> Result<Sample, Failure> {
        let matrix = self.matrix_at(at)?;
        let (functions, radius) = self
            .measure
            .of(&matrix)
            .ok_or(IntervalError::Eigenvalues { at })?;
        Ok(Sample {
            at,
            matrix,
            scale: Rc::clone(scale),
            functions,
            radius,
        })
    }

    /// How far the value of a function at a sample can be wrong.
    pub(super) fn noise_of(&self, sample: &Sample, function: usize) -> f64 {
        let measure = self.measure;
        let one = |a: &DMatrix<f64>| match measure {
            Measure::Reciprocal if function == 0 => Some(shifted_determinant(a, -1.0)),
            Measure::Reciprocal if function == 1 => Some(shifted_determinant(a, 1.0)),
            _ => measure.of(a).map(|(functions, _)| functions[function]),
        };
        TRUST * Measure::noise(&sample.matrix, &sample.scale, one)
    }

    /// Whether the spectral radius exceeds one by more than `least`; none if by no more than round-off.
    pub(super) fn is_unstable(&self, sample: &Sample, least: f64) -> Option<bool> {
        let excess = sample.radius - 1.0;
        let measure = self.measure;
        let radius = |a: &DMatrix<f64>| measure.of(a).map(|(_, radius)| radius);
        if excess <= least {
            return Some(false);
        }
        (excess > TRUST * Measure::noise(&sample.matrix, &sample.scale, radius)).then_some(true)
    }
}
