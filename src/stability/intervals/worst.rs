//! The largest spectral radius of an unstable interval.

use super::search::{Failure, Search};
use super::{IntervalError, UnstableInterval};
use std::ops::Range;

/// From this spectral radius on the maximum is a pole and reported as infinite.
const POLE: f64 = 1e8;

impl Search<'_> {
    /// The largest spectral radius in an unstable interval, by golden-section search around the largest samples.
    pub(super) fn worst_in(
        &mut self,
        start: f64,
        end: f64,
        range: &Range<f64>,
    ) -> Result<UnstableInterval, Failure> {
        /// The number of local maxima among the samples that are refined.
        const STARTS: usize = 3;
        let inside = self
            .samples
            .iter()
            .filter(|sample| start <= sample.at && sample.at <= end);
        let mut known: Vec<(f64, f64)> = inside.map(|sample| (sample.at, sample.radius)).collect();
        // At an end inside the range the spectral radius is one.
        if start != range.start {
            known.insert(0, (start, 1.0));
        }
        if end != range.end {
            known.push((end, 1.0));
        }
        let value = |i: usize| known.get(i).map_or(f64::NEG_INFINITY, |k| k.1);
        let mut peaks: Vec<usize> = (0..known.len())
            .filter(|&i| value(i) >= value(i + 1) && (i == 0 || value(i) >= value(i - 1)))
            .collect();
        peaks.sort_by(|&i, &j| value(j).total_cmp(&value(i)));
        let mut best = peaks.first().map_or((start, 1.0), |&peak| known[peak]);
        for &peak in peaks.iter().take(STARTS) {
            let low = known[peak.saturating_sub(1)].0;
            let high = known[(peak + 1).min(known.len() - 1)].0;
            let found = self.highest_between(low, high)?;
            if found.1 > best.1 {
                best = found;
            }
        }
        let radius = if best.1 > POLE { f64::INFINITY } else { best.1 };
        Ok(UnstableInterval {
            start,
            end,
            radius,
            worst: best.0,
        })
    }

    /// A local maximum (h, ρ) by golden-section search; h is accurate to the square root of the rounding error.
    fn highest_between(&mut self, mut low: f64, mut high: f64) -> Result<(f64, f64), Failure> {
        const GOLDEN: f64 = 0.381_966_011_250_105_1;
        let tolerance = f64::EPSILON.sqrt() * (high - low);
        let radius_at = |search: &mut Self, at: f64| match search.matrix_at(at) {
            Ok(matrix) => {
                let (_, radius) = search
                    .measure
                    .of(&matrix)
                    .ok_or(IntervalError::Eigenvalues { at })?;
                Ok((at, radius))
            }
            Err(IntervalError::NotFinite { .. }) => Ok((at, f64::INFINITY)),
            Err(error) => Err(error),
        };
        let mut left = radius_at(self, low + GOLDEN * (high - low))?;
        let mut right = radius_at(self, high - GOLDEN * (high - low))?;
        while high - low > tolerance
            && left.1.max(right.1) <= POLE
            && low < left.0
            && left.0 < right.0
            && right.0 < high
        {
            if left.1 >= right.1 {
                (high, right) = (right.0, left);
                left = radius_at(self, low + GOLDEN * (high - low))?;
            } else {
                (low, left) = (left.0, right);
                right = radius_at(self, high - GOLDEN * (high - low))?;
            }
        }
        Ok(if left.1 >= right.1 { left } else { right })
    }
}
