//! The root of a scalar function in a bracket.

use core::ops::Range;

/// The largest number of evaluations for one root.
const MAX_EVALUATIONS: u32 = 100;

/// The root of a function whose sign is `side` at the start of the bracket and different at its end, by false position
/// with halved weights (Illinois), and by bisection where that is slow.
///
/// The result is a place at which the function is zero or has the other sign, within `resolution` of one where its sign
/// is `side`; or the start, if the sign is not `side` there.
pub fn root(
    bracket: Range<f64>,
    side: f64,
    resolution: f64,
    value: &mut dyn FnMut(f64) -> f64,
) -> f64 {
    let Range {
        start: mut from,
        end: mut to,
    } = bracket;
    // The weights of false position: their signs never change.
    let (mut low, mut high) = (side * value(from), side * value(to));
    if !(low > 0.0) {
        return from;
    }
    let mut kept = 0_i32;
    for evaluation in 0..MAX_EVALUATIONS {
        if to - from <= resolution {
            break;
        }
        let guess = from + (to - from) * (low / (low - high));
        let is_slow = evaluation % 8 == 7;
        let tau = if is_slow || !(guess > from && guess < to) {
            0.5 * (from + to)
        } else {
            guess
        };
        if tau == from || tau == to {
            break;
        }
        let here = side * value(tau);
        if here == 0.0 {
            return tau;
        }
        if here > 0.0 {
            (from, low) = (tau, here);
            if kept > 0 {
                high *= 0.5;
            }
            kept = 1;
        } else {
            (to, high) = (tau, here);
            if kept < 0 {
                low *= 0.5;
            }
            kept = -1;
        }
    }
    to
}
