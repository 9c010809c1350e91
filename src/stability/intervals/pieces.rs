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

impl Piece {
    fn width(&self) -> f64 {
        self.end - self.start
    }

    fn middle(&self) -> f64 {
        f64::midpoint(self.start, self.end)
    }

    /// The two parts in which interpolants are tried next; `None` for pieces that are short, or magnified.
    fn halves(&self, interpolants: &[Interpolant]) -> Option<[Self; 2]> {
        let Self {
            start, end, zoom, ..
        } = *self;
        if zoom > 0 || self.width() <= SHORTEST * start.abs().max(end.abs()) {
            return None;
        }
        let before: Vec<f64> = interpolants.iter().map(|one| one.relative).collect();
        let middle = start + SPLIT * self.width();
        Some([(start, middle), (middle, end)].map(|(start, end)| Self {
            start,
            end,
            zoom,
            before: before.clone(),
        }))
    }

    /// A smaller piece about a critical point; `None` if it would contain zero, where the matrix may not exist.
    fn magnified(&self, at: f64, range: &Range<f64>) -> Option<Self> {
        let half = 0.5 * MAGNIFICATION * self.width();
        let (start, end) = ((at - half).max(range.start), (at + half).min(range.end));
        (start * end > 0.0 && start < end).then(|| Self {
            start,
            end,
            zoom: self.zoom + 1,
            before: Vec::new(),
        })
    }
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

impl Interpolant {
    /// Whether the value at a critical point is so small that it may be a double root.
    fn is_small(&self, at: f64) -> bool {
        self.series.evaluate(at).abs() <= MAGNIFY_BELOW * self.largest
    }

    /// The critical points that may separate roots of the function with this number: not those whose values are far from
    /// zero and have the sign of the samples beside them.
    fn critical_points(&self, function: usize, samples: &[Sample]) -> Vec<f64> {
        let mut points = self.series.critical_points(self.error);
        points.retain(|&at| {
            let value = self.series.evaluate(at);
            let after = samples[..=DEGREE]
                .partition_point(|sample| sample.at <= at)
                .clamp(1, DEGREE);
            let flips = |sample: &Sample| (sample.functions[function] > 0.0) != (value > 0.0);
            self.is_small(at) || flips(&samples[after - 1]) || flips(&samples[after])
        });
        points
    }
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
        let samples = self.samples_on(&piece)?;
        let count = samples[0].functions.len();
        let interpolants: Vec<Interpolant> = (0..count)
            .map(|function| {
                let before = piece.before.get(function).copied();
                self.interpolant(&samples, function, before.unwrap_or(f64::INFINITY))
            })
            .collect();
        if !interpolants.iter().all(|one| one.is_resolved) {
            if let Some(halves) = piece.halves(&interpolants) {
                waiting.extend(halves);
                return Ok(());
            }
            self.touches.push(piece.middle());
            self.samples.extend(samples);
            return Ok(());
        }
        let scale = Rc::clone(&samples[0].scale);
        let mut is_magnified = false;
        for (function, interpolant) in interpolants.iter().enumerate() {
            for at in interpolant.critical_points(function, &samples) {
                let critical = self.sample(at, &scale)?;
                self.samples.push(critical);
                if !interpolant.is_small(at) {
                    continue;
                }
                if piece.zoom < MAGNIFICATIONS {
                    is_magnified = true;
                    waiting.extend(piece.magnified(at, range));
                } else {
                    self.touches.push(at);
                }
            }
        }
        if piece.zoom > 0 && !is_magnified {
            self.touches.push(piece.middle());
        }
        self.samples.extend(samples);
        Ok(())
    }

    /// Samples at the Chebyshev points of a piece, and then at two points at which interpolants are compared with the
    /// functions.
    fn samples_on(&mut self, piece: &Piece) -> Result<Vec<Sample>, Failure> {
        const CHECKS: [f64; 2] = [0.1371, 0.8193];
        let Piece { start, end, .. } = *piece;
        let checks = CHECKS.map(|fraction| start + fraction * (end - start));
        let matrices = (points(start, end).into_iter().chain(checks))
            .map(|at| Ok((at, self.matrix_at(at)?)))
            .collect::<Result<Vec<_>, _>>()?;
        let all = matrices.iter().map(|(_, matrix)| matrix);
        let scale = Rc::new(scale_of(all, self.size));
        let sample = |(at, matrix)| self.sample_of(at, matrix, &scale);
        matrices.into_iter().map(sample).collect()
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
