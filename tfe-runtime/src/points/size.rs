//! The size of what a step starts with, and whether its end is finite: in registers where there are many coordinates.

use super::evaluation::FEW;
use crate::legendre::larger;
use crate::model::State;
use crate::registers::four::{Four, block};

/// What sizes are at least, so that changes of zero are zero relative to them.
pub(super) const MIN_SIZE: f64 = f64::MIN_POSITIVE;

/// The largest magnitude, or [`MIN_SIZE`].
#[inline(always)]
pub(super) fn largest<V: Four, const N: usize>(like: V, numbers: &[f64; N]) -> f64 {
    let mut largest = MIN_SIZE;
    if const { N > FEW } {
        let mut lanes = like.like(MIN_SIZE);
        for at in (0..N).step_by(4) {
            lanes = block(like, numbers, at).abs().larger(lanes);
        }
        for size in lanes.lanes() {
            largest = larger(largest, size);
        }
        return largest;
    }
    for a in 0..N {
        let size = numbers[a].abs();
        largest = if largest < size { size } else { largest };
    }
    largest
}

/// Whether all numbers of a state are finite.
#[inline(always)]
pub(super) fn is_finite<V: Four, const N: usize>(like: V, state: &State<N>) -> bool {
    // Zero times a number that is not finite is NaN.
    let mut zero = 0.0;
    if const { N > FEW } {
        let (nothing, mut lanes) = (like.like(0.0), like.like(0.0));
        for at in (0..N).step_by(4) {
            lanes = nothing.times_plus(block(like, &state.q, at), lanes);
            lanes = nothing.times_plus(block(like, &state.p, at), lanes);
        }
        for lane in lanes.lanes() {
            zero += lane;
        }
        return zero == 0.0;
    }
    for a in 0..N {
        zero += 0.0 * state.q[a] + 0.0 * state.p[a];
    }
    zero == 0.0
}

#[cfg(all(test, feature = "alloc"))]
mod tests {
    use super::*;
    use crate::lanes::Lanes;

    /// With the largest number, a NaN or an infinite number at each place, in the last block of two as well.
    fn sizes_of<const N: usize>() {
        let like = Lanes([0.0; 4]);
        let mut numbers = [0.0; N];
        for a in 0..N {
            numbers[a] = (3.7 * a as f64).sin();
        }
        for a in 0..N {
            for (value, size) in [(-2.5, 2.5), (f64::INFINITY, f64::INFINITY)] {
                let mut changed = numbers;
                changed[a] = value;
                assert_eq!(largest(like, &changed).to_bits(), f64::to_bits(size));
            }
            for (value, expected) in [(-2.5, true), (f64::INFINITY, false), (f64::NAN, false)] {
                let (q, mut p) = (numbers, numbers);
                p[a] = value;
                for state in [State { q, p }, State { q: p, p: q }] {
                    assert_eq!(is_finite(like, &state), expected, "{a}: {value}");
                }
            }
        }
        assert_eq!(largest(like, &[0.0; N]).to_bits(), MIN_SIZE.to_bits());
    }

    #[test]
    fn sizes_are_found_at_every_place() {
        sizes_of::<1>();
        sizes_of::<3>();
        sizes_of::<18>();
    }
}
