//! Steps of linear models with constant coefficients, by one product with a matrix (propagator) that is the same in
//! every step.
//!
//! A step of length h is affine, y₁ = y₀ + D y₀ + c with y = (p, q). D is stored instead of A = 1 + D, because its
//! entries, and with them their rounding errors, are small with h. The sum is compensated as that of any other step.

use alloc::vec;
use alloc::vec::Vec;

use crate::error::StepError;
use crate::model::State;
use crate::precise::Precise;
use crate::real::Real;

/// A power of two so large that, for a start of that size, the constant part of the increment does not spoil the digits
/// of the linear part.
fn far(constant: &[f64]) -> f64 {
    const FAR: i32 = 40;
    const FARTHEST: i32 = 900;
    let size = constant
        .iter()
        .fold(1.0, |size: f64, one| size.max(one.abs()));
    Real::powi(2.0, (FAR + exponent(size)).min(FARTHEST))
}

/// The exponent e of 2ᵉ ≤ size < 2ᵉ⁺¹, for a size of at least one.
fn exponent(size: f64) -> i32 {
    const BITS: u32 = f64::MANTISSA_DIGITS - 1;
    const BIAS: i32 = f64::MAX_EXP - 1;
    (size.to_bits() >> BITS) as i32 - BIAS
}

/// The increment of a step as a function of its start.
#[derive(Clone, Debug)]
pub(crate) struct Propagator<const N: usize> {
    /// The length of the step for which it was made.
    h: f64,
    /// The columns of D, 2N of 2N numbers each, and c as the last column.
    columns: Vec<f64>,
    #[cfg(all(feature = "simd", target_arch = "x86_64"))]
    isa: Option<pulp::x86::V3>,
}

impl<const N: usize> Propagator<N> {
    /// Builds the propagator from increments of steps; `step` gives the increment for a start.
    pub(crate) fn of(
        h: f64,
        step: &mut dyn FnMut(&State<N>) -> Result<State<N>, StepError>,
    ) -> Result<Self, StepError> {
        let mut columns = vec![0.0; 2 * N * (2 * N + 1)];
        let constant = step(&State::ZERO)?;
        let (far_p, far_q) = (far(&constant.p), far(&constant.q));
        let (matrix, last) = columns.split_at_mut(4 * N * N);
        last[..N].copy_from_slice(&constant.p);
        last[N..].copy_from_slice(&constant.q);
        for (k, column) in matrix.chunks_exact_mut((2 * N).max(1)).enumerate() {
            let mut start = State::ZERO;
            let (number, far) = match k.checked_sub(N) {
                None => (&mut start.p[k], far_p),
                Some(a) => (&mut start.q[a], far_q),
            };
            *number = far;
            let increment = step(&start)?;
            for a in 0..N {
                column[a] = (increment.p[a] - constant.p[a]) / far;
                column[N + a] = (increment.q[a] - constant.q[a]) / far;
            }
        }
        Ok(Self {
            h,
            columns,
            #[cfg(all(feature = "simd", target_arch = "x86_64"))]
            isa: pulp::x86::V3::try_new(),
        })
    }

    /// Whether it was made for this step length.
    pub(crate) fn is_of(&self, h: f64) -> bool {
        self.h == h
    }

    /// Moves a state with rounding error `low`, both in place; false, with both unchanged, where the end is not finite.
    pub(crate) fn advance(&self, state: &mut State<N>, low: &mut State<N>) -> bool {
        #[cfg(all(feature = "simd", target_arch = "x86_64"))]
        if let Some(isa) = self.isa {
            struct Job<'a, const N: usize>(&'a Propagator<N>, &'a mut State<N>, &'a mut State<N>);
            impl<const N: usize> pulp::NullaryFnOnce for Job<'_, N> {
                type Output = bool;
                #[inline(always)]
                fn call(self) -> bool {
                    self.0.moved(self.1, self.2)
                }
            }
            return isa.vectorize(Job(self, state, low));
        }
        self.moved(state, low)
    }

    #[inline(always)]
    fn moved(&self, state: &mut State<N>, low: &mut State<N>) -> bool {
        let mut change = State::ZERO;
        let (matrix, last) = self.columns.split_at(4 * N * N);
        change.p.copy_from_slice(&last[..N]);
        change.q.copy_from_slice(&last[N..]);
        let (momenta, coordinates) = matrix.split_at(2 * N * N);
        add(momenta, &state.p, &mut change);
        add(coordinates, &state.q, &mut change);
        let (mut end, mut end_low) = (State::ZERO, State::ZERO);
        let mut zero = 0.0;
        for a in 0..N {
            (end.q[a], end_low.q[a]) = state.q[a].exact_sum(change.q[a] + low.q[a]);
            zero += 0.0 * end.q[a];
        }
        for a in 0..N {
            (end.p[a], end_low.p[a]) = state.p[a].exact_sum(change.p[a] + low.p[a]);
            zero += 0.0 * end.p[a];
        }
        // Zero times an infinity or a NaN is not zero.
        if zero != 0.0 || zero.is_nan() {
            return false;
        }
        (*state, *low) = (end, end_low);
        true
    }
}

/// Adds columns times factors, four columns at a time, so that each partial sum is loaded once for four products.
#[inline(always)]
fn add<const N: usize>(columns: &[f64], factors: &[f64; N], sum: &mut State<N>) {
    let halves = columns.as_chunks::<N>().0;
    let (fours, rest) = halves.as_chunks::<8>();
    let (by_four, by_one) = factors.as_chunks::<4>();
    for ([p0, q0, p1, q1, p2, q2, p3, q3], f) in fours.iter().zip(by_four) {
        for a in 0..N {
            sum.p[a] += (p0[a] * f[0] + p1[a] * f[1]) + (p2[a] * f[2] + p3[a] * f[3]);
        }
        for a in 0..N {
            sum.q[a] += (q0[a] * f[0] + q1[a] * f[1]) + (q2[a] * f[2] + q3[a] * f[3]);
        }
    }
    for ([by_p, by_q], factor) in rest.as_chunks::<2>().0.iter().zip(by_one) {
        for a in 0..N {
            sum.p[a] += by_p[a] * factor;
            sum.q[a] += by_q[a] * factor;
        }
    }
}
