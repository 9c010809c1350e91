//! What both forms of the element equations have in common.

use crate::error::StepError;
use crate::model::State;
use crate::statistics::Statistics;

/// The equations of one element for its unknown rates x.
pub(crate) trait Equations {
    /// Whether Newton's method alone solves them: where it begins is then a continued polynomial, not one that a fixed point has failed from.
    const BY_NEWTON_ALONE: bool = false;

    /// The step of the fixed-point iteration at x, not yet applied: x + `step` is the improvement.
    ///
    /// With `refresh`, mass matrices are evaluated anew.
    fn sweep(&mut self, x: &[f64], step: &mut [f64], refresh: bool) -> Result<(), StepError>;

    /// The residual at x.
    fn residual(&mut self, x: &[f64], residual: &mut [f64]) -> Result<(), StepError>;

    /// The residual at x and its derivative by x, row by row.
    fn tangent(
        &mut self,
        x: &[f64],
        residual: &mut [f64],
        tangent: &mut [f64],
    ) -> Result<(), StepError>;

    /// How large an increment of x is beside the state.
    fn measure(&self, x: &[f64], step: &[f64]) -> Increment;

    /// Brings what the end of the step needs up to the final x, after Newton's method.
    fn finish(&mut self, x: &[f64], scratch: &mut [f64]) -> Result<(), StepError>;

    /// The counts.
    fn statistics(&mut self) -> &mut Statistics;
}

/// An increment beside the state: h |δx| over the largest component.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Increment {
    /// The larger one of coordinates and momenta.
    pub(crate) relative: f64,
    /// Coordinates alone.
    pub(crate) position: f64,
}

impl Increment {
    /// Nothing has changed.
    pub(crate) const NONE: Self = Self {
        relative: 0.0,
        position: 0.0,
    };
}

/// One element of a step: where it starts, and what hits it.
#[derive(Clone, Copy)]
pub(crate) struct Span<'a, const N: usize> {
    pub(crate) t: f64,
    pub(crate) h: f64,
    pub(crate) start: &'a State<N>,
    /// What the start is more than its rounded numbers.
    pub(crate) low: &'a State<N>,
    /// What impulses add to the rows.
    pub(crate) kicks: &'a [[f64; N]],
    /// γ of an additional force γ v; zero in steps.
    pub(crate) damping: f64,
}

/// Σ (high + low) · row.
#[inline(always)]
pub(crate) fn weighted<const N: usize>(high: &[f64], low: &[f64], rows: &[[f64; N]]) -> [f64; N] {
    let (mut sum, mut correction) = ([0.0; N], [0.0; N]);
    for ((high, low), row) in high.iter().zip(low).zip(rows) {
        for a in 0..N {
            sum[a] += high * row[a];
            correction[a] += low * row[a];
        }
    }
    for a in 0..N {
        sum[a] += correction[a];
    }
    sum
}

/// start + (h · rate + low): the small parts meet first.
#[inline(always)]
pub(crate) fn moved<const N: usize>(
    start: &[f64; N],
    low: &[f64; N],
    h: f64,
    rate: &[f64; N],
) -> [f64; N] {
    let mut place = [0.0; N];
    for a in 0..N {
        place[a] = start[a] + (h * rate[a] + low[a]);
    }
    place
}

/// The largest |h δ| over the largest of |start| and |h x|; zero over zero is zero, NaN stays NaN.
pub(crate) fn relative(h: f64, start: &[f64], x: &[f64], step: &[f64]) -> f64 {
    let mut scale = 0.0_f64;
    for value in start {
        scale = scale.max(value.abs());
    }
    let (mut rate, mut increment, mut sum) = (0.0_f64, 0.0_f64, 0.0);
    for (value, step) in x.iter().zip(step) {
        rate = rate.max(value.abs());
        increment = increment.max(step.abs());
        // Maxima ignore a NaN; the sum does not, and infinities give one.
        sum += 0.0 * step;
    }
    if sum != 0.0 {
        return f64::NAN;
    }
    let scale = scale.max(h.abs() * rate);
    if increment == 0.0 {
        0.0
    } else {
        h.abs() * increment / scale
    }
}
