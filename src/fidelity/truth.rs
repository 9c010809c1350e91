//! The reference with which the outputs of all runs are compared.

use super::error::FidelityError;
use super::rung::{Outputs, Runs};
use crate::numbers::raise;
use crate::work_precision::Reference;
use crate::work_precision::grid::Grid;
use crate::work_precision::measure::Discretisation;
use crate::work_precision::reference::{Halving, uncut};
use std::ops::Range;
use tfe_runtime::{Element, Mixed};

/// The outputs of the last rung.
pub(super) struct Truth {
    /// A row at the start, and one at the end of each part.
    rows: Vec<Vec<f64>>,
    /// The largest |y| of each output; one if all are zero.
    scales: Vec<f64>,
    summary: Reference,
}

impl Truth {
    /// Makes runs of the last rung, halving the step until two agree to a tenth of the smallest accuracy, or no longer
    /// approach each other.
    pub(super) fn find(
        rung: &dyn Runs,
        outputs: Outputs<'_>,
        (span, grids): (&Range<f64>, &[Grid]),
        smallest: f64,
    ) -> Result<Self, FidelityError> {
        let element = Element::from(Mixed::<9>);
        let (Some(coarse), Some(fine)) = (grids.first(), grids.last()) else {
            return Err(FidelityError::NoRungs);
        };
        rung.check_start(fine).map_err(FidelityError::Reference)?;
        let halving = Halving {
            longest: coarse.step(),
            // One step size more than the other runs have, but at least two runs.
            least: fine.step() / 2.0 * 0.75,
            enough: (0.1 * smallest).max(f64::EPSILON),
        };
        let run = |halvings: u32| {
            let step = coarse.step() * 0.5_f64.powi(halvings as i32);
            let grid = Grid::new(span, step);
            // Half the step of an existing mesh.
            let grid = &grid.unwrap_or_else(|_| fine.clone());
            let scheme = Discretisation {
                element,
                control: uncut(),
                grid,
            };
            rung.look(scheme, outputs).map(|seen| seen.rows)
        };
        let settled = halving.settle(run, |coarse, fine| distance(coarse, fine, &scales_of(fine)));
        let settled = settled.map_err(|failure| match failure {
            Some(kind) => FidelityError::Reference(kind),
            None => FidelityError::ReferenceValue,
        })?;
        if !settled.uncertainty.is_finite() {
            return Err(FidelityError::ReferenceValue);
        }
        Ok(Self {
            scales: scales_of(&settled.run),
            rows: settled.run,
            summary: Reference::Computed {
                element,
                step: settled.step,
                uncertainty: settled.uncertainty.max(f64::EPSILON),
            },
        })
    }

    pub(super) fn summary(&self) -> &Reference {
        &self.summary
    }

    /// The error of outputs (T-110).
    pub(super) fn error(&self, rows: &[Vec<f64>]) -> f64 {
        self.distance(rows, &self.rows)
    }

    /// The largest difference of two runs, on the scale of errors.
    pub(super) fn distance(&self, a: &[Vec<f64>], b: &[Vec<f64>]) -> f64 {
        distance(a, b, &self.scales)
    }
}

/// The largest |y| of each output; one if all are zero.
fn scales_of(rows: &[Vec<f64>]) -> Vec<f64> {
    let count = rows.first().map_or(0, Vec::len);
    let mut scales = vec![0.0; count];
    for row in rows {
        for (scale, value) in scales.iter_mut().zip(row) {
            raise(scale, value.abs());
        }
    }
    for scale in &mut scales {
        if *scale == 0.0 {
            *scale = 1.0;
        }
    }
    scales
}

/// max |a − b| / scale; NaN if a number is NaN.
fn distance(a: &[Vec<f64>], b: &[Vec<f64>], scales: &[f64]) -> f64 {
    let mut most = 0.0;
    for (a, b) in a.iter().zip(b) {
        for ((a, b), scale) in a.iter().zip(b).zip(scales) {
            raise(&mut most, (a - b).abs() / scale);
        }
    }
    most
}
