//! The division of the range into pieces on which polynomials resolve the functions, and the samples at their critical
//! points.

use super::error::IntervalError;
use super::search::{Failure, Matrix, SHORTEST, SPLIT, Sample, Search};
use crate::stability::chebyshev::{DEGREE, Series, points};
use crate::stability::sign_functions::{Measure, scale_of};
use std::ops::Range;
use std::rc::Rc;

/// The relative truncation error at which an interpolant is resolved.
const RESOLVED: f64 = 1e-12;
/// The relative error below which a piece is no longer split if splitting does not reduce it.
const STAGNANT: f64 = 1e-7;
/// A critical value this small, relative to the largest value of its piece, is examined in a smaller piece.
const MAGNIFY_BELOW: f64 = 1e-7;
/// The length of the smaller piece, relative to the piece.
const MAGNIFICATION: f64 = 1e-2;
/// The number of successive magnifications: 10⁻² to this power is below the resolution of `f64` in a piece between h
/// and 2h.
const MAGNIFICATIONS: u32 = 5;
/// The start of the first piece next to zero, relative to the far end of the range.
const NEAREST_ZERO: f64 = 1.0 / (1_u64 << 40) as f64;
/// The ratio of the lengths of successive first pieces. Not 2, so that no piece ends at a round number, where poles
/// often are.
const GROWTH: f64 = 1.93;

/// A piece of the range that is still to be interpolated.
#[derive(Clone, Debug)]
pub(super) struct Piece {
    start: f64,
    end: f64,
    /// The number of magnifications.
    zoom: u32,
    /// The relative errors of the interpolants on the piece from which it was split.
    before: Vec<f64>,
}

/// Pieces that grow with the distance from zero, on both sides, so that the parameter varies by a moderate ratio in
/// each.
fn first(start: f64, end: f64) -> Vec<Piece> {
    let nearest = NEAREST_ZERO * start.abs().max(end.abs());
    let mut pieces = Vec::new();
    let mut outward = |near: f64, far: f64, sign: f64| {
        let mut near = near.max(f64::MIN_POSITIVE);
        while near < far {
            let next = if near < nearest {
                nearest.min(far)
            } else {
                GROWTH * near
            };
            // A separate last piece would be short.
            let next = if next * (1.0 + 1e-2) >= far {
                far
            } else {
                next
            };
            let (low, high) = if sign > 0.0 {
                (near, next)
            } else {
                (-next, -near)
            };
            pieces.push(Piece {
                start: low,
                end: high,
                zoom: 0,
                before: Vec::new(),
            });
            near = next;
        }
    };
    if end > 0.0 {
        outward(if start > 0.0 { start } else { nearest }, end, 1.0);
    }
    if start < 0.0 {
        outward(if end < 0.0 { -end } else { nearest }, -start, -1.0);
    }
    pieces
}

/// The interpolant of a function on a piece.
struct Interpolant {
    series: Series,
    largest: f64,
    /// The truncation error or the rounding error, whichever is larger.
    error: f64,
    /// The error relative to the largest value.
    relative: f64,
    is_resolved: bool,
}

impl<'m> Search<'m> {
    /// Samples the range until every function is resolved.
    pub(super) fn over(matrix: Matrix<'m>, range: &Range<f64>) -> Result<Self, Failure> {
        let Range { start, end } = *range;
        if !(start.is_finite() && end.is_finite() && (end - start).is_finite() && start < end) {
            return Err(IntervalError::Range { start, end });
        }
        let mut search = Self::new(matrix);
        // Irregular fractions, denser near the start, where transition matrices vary most.
        const PROBES: [f64; 6] = [0.0023, 0.0171, 0.0673, 0.2137, 0.5519, 0.9043];
        let probes = PROBES
            .iter()
            .map(|fraction| search.matrix_at(start + fraction * (end - start)))
            .collect::<Result<Vec<_>, _>>()?;
        search.measure = Measure::suiting(&probes);
        let mut waiting = first(start, end);
        while let Some(piece) = waiting.pop() {
            search.resolve(piece, range, &mut waiting)?;
        }
        search.samples.sort_by(|a, b| a.at.total_cmp(&b.at));
        search.samples.dedup_by(|a, b| a.at == b.at);
        Ok(search)
    }
}

impl Search<'_> {
    /// Interpolates all functions on a piece; adds samples at the Chebyshev points and the relevant critical points, or
    /// splits the piece.
    fn resolve(
        &mut self,
        piece: Piece,
        range: &Range<f64>,
        waiting: &mut Vec<Piece>,
    ) -> Result<(), Failure> {
        /// The points at which the interpolant is compared with the function.
        const CHECKS: [f64; 2] = [0.1371, 0.8193];
        let Piece {
            start,
            end,
            zoom,
            before,
        } = piece;
        let width = end - start;
        let matrices = points(start, end)
            .into_iter()
            .chain(CHECKS.map(|fraction| start + fraction * width))
            .map(|at| Ok((at, self.matrix_at(at)?)))
            .collect::<Result<Vec<_>, _>>()?;
        let scale = Rc::new(scale_of(
            matrices.iter().map(|(_, matrix)| matrix),
            self.size,
        ));
        let mut samples = Vec::with_capacity(matrices.len());
        for (at, matrix) in matrices {
            let (functions, radius) = self
                .measure
                .of(&matrix)
                .ok_or(IntervalError::Eigenvalues { at })?;
            samples.push(Sample {
                at,
                matrix,
                scale: Rc::clone(&scale),
                functions,
                radius,
            });
        }

        let count = samples[0].functions.len();
        let interpolants: Vec<Interpolant> = (0..count)
            .map(|function| {
                let before = before.get(function).copied().unwrap_or(f64::INFINITY);
                self.interpolant(&samples, function, before)
            })
            .collect();
        if interpolants
            .iter()
            .any(|interpolant| !interpolant.is_resolved)
        {
            let middle = start + SPLIT * width;
            if zoom == 0 && width > SHORTEST * start.abs().max(end.abs()) {
                let before: Vec<f64> = interpolants
                    .iter()
                    .map(|interpolant| interpolant.relative)
                    .collect();
                waiting.push(Piece {
                    start,
                    end: middle,
                    zoom,
                    before: before.clone(),
                });
                waiting.push(Piece {
                    start: middle,
                    end,
                    zoom,
                    before,
                });
                return Ok(());
            }
            self.touches.push(f64::midpoint(start, end));
            self.samples.extend(samples);
            return Ok(());
        }

        let mut is_magnified = false;
        for (function, interpolant) in interpolants.iter().enumerate() {
            for at in interpolant.series.critical_points(interpolant.error) {
                let value = interpolant.series.evaluate(at);
                let is_small = value.abs() <= MAGNIFY_BELOW * interpolant.largest;
                // A critical value of the same sign as its neighbours, and far from zero, does not separate roots.
                let after = samples[..=DEGREE]
                    .partition_point(|sample| sample.at <= at)
                    .clamp(1, DEGREE);
                let flips = |sample: &Sample| (sample.functions[function] > 0.0) != (value > 0.0);
                if !is_small && !flips(&samples[after - 1]) && !flips(&samples[after]) {
                    continue;
                }
                let critical = self.sample(at, &scale)?;
                self.samples.push(critical);
                if is_small && zoom < MAGNIFICATIONS {
                    is_magnified = true;
                    let half = 0.5 * MAGNIFICATION * width;
                    let zoomed = ((at - half).max(range.start), (at + half).min(range.end));
                    // Not across zero, where the matrix may not exist.
                    if zoomed.0 * zoomed.1 > 0.0 && zoomed.0 < zoomed.1 {
                        waiting.push(Piece {
                            start: zoomed.0,
                            end: zoomed.1,
                            zoom: zoom + 1,
                            before: Vec::new(),
                        });
                    }
                } else if is_small {
                    self.touches.push(at);
                }
            }
        }
        if zoom > 0 && !is_magnified {
            self.touches.push(f64::midpoint(start, end));
        }
        self.samples.extend(samples);
        Ok(())
    }

    /// The interpolant of a function through the first samples, compared with the function at the last ones.
    ///
    /// `before` is the relative error on a piece twice as long. Halving the piece reduces a truncation error by a
    /// factor of thousands. An error that does not decrease is rounding error of the matrix, larger than estimated
    /// (near a pole, for example), and splitting does not help.
    fn interpolant(&self, samples: &[Sample], function: usize, before: f64) -> Interpolant {
        let values: [f64; DEGREE + 1] = std::array::from_fn(|j| samples[j].functions[function]);
        let series = Series::through(samples[0].at, samples[DEGREE].at, &values);
        let largest = values
            .iter()
            .fold(0.0, |most: f64, value| most.max(value.abs()));
        let difference = samples[DEGREE + 1..]
            .iter()
            .fold(series.tail(), |most, sample| {
                // The error at the check points may be ten times the tail, since it contains a full rounding error,
                // while the coefficients average over the points.
                most.max(0.1 * (series.evaluate(sample.at) - sample.functions[function]).abs())
            });
        let relative = if largest > 0.0 {
            difference / largest
        } else {
            0.0
        };
        let resolved = |error: f64, is_resolved: bool| Interpolant {
            series,
            largest,
            error,
            relative,
            is_resolved,
        };
        if relative <= RESOLVED {
            return resolved(RESOLVED * largest, true);
        }
        if relative <= STAGNANT && relative > 0.1 * before {
            return resolved(difference, true);
        }
        let noise = [0, DEGREE / 2, DEGREE]
            .iter()
            .fold(RESOLVED * largest, |most, &j| {
                most.max(self.noise_of(&samples[j], function))
            });
        resolved(noise, difference <= noise)
    }
}
