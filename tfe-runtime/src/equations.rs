//! The interface that the velocity form and the phase-space form of the element equations share.

use crate::error::StepError;
use crate::legendre::larger;
use crate::lu;
use crate::model::State;
use crate::scheme::SchemeRef;
use crate::statistics::Statistics;

/// The equations of one element for its unknown rates x.
pub(crate) trait Equations {
    /// Whether only Newton's method solves them. It then starts from a continued polynomial, not from the result of a
    /// failed fixed-point iteration.
    fn is_by_newton_alone(&self) -> bool {
        false
    }

    /// The increment of the fixed-point iteration at x, which is not applied: the next iterate is x + `step`.
    ///
    /// With `refresh`, the mass matrices are evaluated anew.
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

    /// Factors the tangent.
    #[inline(always)]
    fn factor(
        &self,
        size: usize,
        tangent: &mut [f64],
        pivots: &mut [usize],
    ) -> Result<(), lu::Singular> {
        lu::factor(size, tangent, pivots)
    }

    /// The size of an increment of x, relative to the state.
    fn measure(&self, x: &[f64], step: &[f64]) -> Increment;

    /// The same relative to the size of each coordinate; `None` where none is small beside the largest one.
    fn measure_own(&self, x: &[f64], step: &[f64]) -> Option<f64>;

    /// After Newton's method, updates to the final x what the end of the step depends on.
    fn finish(&mut self, x: &[f64], scratch: &mut [f64]) -> Result<(), StepError>;

    /// The increment, measured beside what the reactions of constraints alone would move, if it is a rounding error of
    /// that (T-168).
    #[cfg(feature = "alloc")]
    fn measure_at_rest(&self, _x: &[f64], _step: &[f64]) -> Option<Increment> {
        None
    }

    /// The counts of evaluations and iterations.
    fn statistics(&mut self) -> &mut Statistics;
}

/// The size of an increment relative to the state: h |δx| divided by the largest component.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Increment {
    /// The larger of the values for coordinates and for momenta.
    pub(crate) relative: f64,
    /// The value for the coordinates alone.
    pub(crate) position: f64,
}

/// One element of a step: its start, its length, and the impulses in it.
#[derive(Clone, Copy)]
pub(crate) struct Span<'a, const N: usize> {
    pub(crate) t: f64,
    pub(crate) h: f64,
    pub(crate) start: &'a State<N>,
    /// The rounding error of the start (compensated summation): the start is the sum of both.
    pub(crate) low: &'a State<N>,
    /// The contributions of impulses to the rows.
    pub(crate) kicks: &'a [[f64; N]],
    /// The factor γ of an additional force γ v; zero in ordinary steps.
    pub(crate) damping: f64,
}

/// What the equations of an element keep from one iteration to the next.
pub(crate) struct Kept<'a, const N: usize> {
    /// L_q + Q at the points; in phase form the velocities.
    pub(crate) forces: &'a mut [[f64; N]],
    /// The momenta at the points: the initial guesses of the Legendre transform.
    pub(crate) momenta: &'a mut [[f64; N]],
    /// The LU factors of the mass matrices of the rows; in phase form H_pp at the stages.
    pub(crate) masses: &'a mut [f64],
    /// The row exchanges of these factors.
    pub(crate) mass_pivots: &'a mut [usize],
}

/// What follows from rates as unknowns, whatever the model.
impl<const N: usize> Span<'_, N> {
    /// Time, coordinates and velocities at a point.
    #[inline(always)]
    pub(crate) fn place(
        &self,
        scheme: &SchemeRef<'_>,
        l: usize,
        rates: &[[f64; N]],
    ) -> (f64, [f64; N], [f64; N]) {
        let Self {
            t, h, start, low, ..
        } = *self;
        let row = l * rates.len()..(l + 1) * rates.len();
        let rate = weighted(
            &scheme.position[row.clone()],
            &scheme.position_low[row.clone()],
            rates,
        );
        let q = moved(&start.q, &low.q, h, &rate);
        let v = if scheme.collocated {
            rates[l]
        } else {
            combination(&scheme.velocity[row], rates)
        };
        (t + scheme.nodes[l] * h, q, v)
    }

    /// Subtracts p₀ and the impulse of forces and kicks from the rows.
    #[inline(always)]
    pub(crate) fn subtract_impulse(
        &self,
        scheme: &SchemeRef<'_>,
        forces: &[[f64; N]],
        rows: &mut [[f64; N]],
    ) {
        let Self {
            h,
            start,
            low,
            kicks,
            ..
        } = *self;
        let points = scheme.points();
        for (i, row) in rows.iter_mut().enumerate() {
            let range = i * points..(i + 1) * points;
            let impulse = weighted(
                &scheme.force[range.clone()],
                &scheme.force_low[range],
                forces,
            );
            for a in 0..N {
                row[a] = (row[a] - start.p[a]) - (h * impulse[a] + (kicks[i][a] + low.p[a]));
            }
        }
    }

    /// The size of an increment of the rates x.
    pub(crate) fn measure_rates(&self, x: &[f64], step: &[f64]) -> Increment {
        let position = relative(self.h, &self.start.q, x, step);
        // The momentum at the end is as accurate as the velocities, whatever the step. The rest of an increment affects
        // it through the forces only, hence the factor.
        let velocity = 0.25 * relative(1.0, &[], x, step);
        let relative = if (velocity + position).is_nan() {
            f64::NAN
        } else {
            larger(velocity, position)
        };
        Increment { relative, position }
    }
}

/// Σ weight · row.
#[inline(always)]
pub(crate) fn combination<const N: usize>(weights: &[f64], rows: &[[f64; N]]) -> [f64; N] {
    let mut sum = [0.0; N];
    for (weight, row) in weights.iter().zip(rows) {
        for a in 0..N {
            sum[a] += weight * row[a];
        }
    }
    sum
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

/// start + (h · rate + low): the small terms are added first.
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

/// The largest |h δ| divided by the largest of |start| and |h x|; 0/0 counts as zero, and NaN stays NaN.
pub(crate) fn relative(h: f64, start: &[f64], x: &[f64], step: &[f64]) -> f64 {
    let mut scale = 0.0_f64;
    for value in start {
        scale = larger(scale, value.abs());
    }
    let (mut rate, mut increment, mut sum) = (0.0_f64, 0.0_f64, 0.0);
    for (value, step) in x.iter().zip(step) {
        rate = larger(rate, value.abs());
        increment = larger(increment, step.abs());
        // Maxima ignore a NaN; this sum does not, and turns infinities into one.
        sum += 0.0 * step;
    }
    if sum != 0.0 {
        return f64::NAN;
    }
    let scale = larger(scale, h.abs() * rate);
    if increment == 0.0 {
        0.0
    } else {
        h.abs() * increment / scale
    }
}
