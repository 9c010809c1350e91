//! Evaluates the matrix and the functions over a range of the parameter.

use super::error::IntervalError;
use crate::stability::sign_functions::{Measure, shifted_determinant};
use nalgebra::DMatrix;
use std::rc::Rc;

/// A value is significant above this many times its change under perturbations: four random ones may miss the worst
/// direction.
const TRUST: f64 = 4.0;
/// The shortest piece, relative to its position; it contains a pole.
pub(super) const SHORTEST: f64 = 1e-10;
/// The fraction at which a piece is split; not ½, to avoid poles at round numbers.
pub(super) const SPLIT: f64 = 0.4957;
/// The largest number of evaluations. Three modes over about fifty periods, with all their crossings, need a sixth of
/// it.
const MAX_EVALUATIONS: usize = 200_000;

/// The functions at one value of the parameter.
#[derive(Clone, Debug)]
pub(super) struct Sample {
    pub(super) at: f64,
    pub(super) matrix: DMatrix<f64>,
    /// The scale of the rounding errors of each entry, over the surrounding piece.
    pub(super) scale: Rc<DMatrix<f64>>,
    pub(super) functions: Vec<f64>,
    pub(super) radius: f64,
}

/// The matrix could not be computed; its error is kept outside the search.
#[derive(Clone, Copy, Debug)]
pub(super) struct Withheld;

/// The error that ends a search early.
pub(super) type Failure = IntervalError<Withheld>;

/// The matrix as a function of the parameter. A trait object, so that the search is compiled only once.
pub(super) type Matrix<'m> = &'m mut dyn FnMut(f64) -> Result<DMatrix<f64>, Withheld>;

/// The search over one range.
pub(super) struct Search<'m> {
    matrix: Matrix<'m>,
    pub(super) measure: Measure,
    pub(super) size: usize,
    evaluations: usize,
    /// In ascending order once the range is resolved.
    pub(super) samples: Vec<Sample>,
    /// The points where a function touches zero or is unresolved.
    pub(super) touches: Vec<f64>,
}

impl<'m> Search<'m> {
    /// A search without samples.
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
        if self.evaluations >= MAX_EVALUATIONS {
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
        self.sample_of(at, matrix, scale)
    }

    /// The sample of a matrix that was evaluated.
    pub(super) fn sample_of(
        &self,
        at: f64,
        matrix: DMatrix<f64>,
        scale: &Rc<DMatrix<f64>>,
    ) -> Result<Sample, Failure> {
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

    /// The error bound of the value of a function at a sample.
    pub(super) fn noise_of(&self, sample: &Sample, function: usize) -> f64 {
        let measure = self.measure;
        let one = |a: &DMatrix<f64>| match measure {
            Measure::Reciprocal if function == 0 => Some(shifted_determinant(a, -1.0)),
            Measure::Reciprocal if function == 1 => Some(shifted_determinant(a, 1.0)),
            _ => measure.of(a).map(|(functions, _)| functions[function]),
        };
        TRUST * Measure::noise(&sample.matrix, &sample.scale, one)
    }

    /// Whether the spectral radius exceeds one by more than `least`; `None` if the excess is within rounding error.
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
