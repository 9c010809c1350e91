//! The search for the first root of the switching functions along a step.

use super::kinked::BEYOND;
use crate::root::root;
use alloc::vec::Vec;
use core::ops::Range;

/// A sign change of a switching function.
#[derive(Clone, Copy, Debug)]
pub(super) struct Crossing {
    /// The index of the function.
    pub(super) switch: usize,
    /// The place in the step.
    pub(super) tau: f64,
}

/// Values below this fraction of the largest one in the step are rounding errors.
const ROUNDING: f64 = 1e-13;

/// Finds the first sign change of any of the functions that `values` gives at τ. The signs are compared at the ends of
/// `samples` equal parts of the range, and where a function comes close to zero between two of them. Roots are found to
/// within `resolution`; a root within that distance of the start has already been passed. Places without values are
/// skipped.
pub(super) fn first_crossing(
    range: Range<f64>,
    samples: usize,
    resolution: f64,
    values: &mut dyn FnMut(f64, &mut Vec<f64>),
) -> Option<Crossing> {
    let part = (range.end - range.start) / samples as f64;
    let mut rows = Vec::with_capacity(samples + 1);
    let mut times = Vec::with_capacity(samples + 1);
    for k in 0..=samples {
        let tau = if k == samples {
            range.end
        } else {
            range.start + k as f64 * part
        };
        let mut row = Vec::new();
        values(tau, &mut row);
        rows.push(row);
        times.push(tau);
    }
    // How much a function may change within the resolution of the start, relative to its change in the first part.
    let passed = (16.0 * resolution / part).max(ROUNDING);
    let count = rows.iter().map(Vec::len).max()?;
    let mut first: Option<Crossing> = None;
    // All functions at the first root, computed on first use.
    let mut there = Vec::new();
    for switch in 0..count {
        let column: Vec<f64> = rows.iter().map(|row| value_in(row, switch)).collect();
        let found = bracket(&times, &column, passed, &mut |tau| {
            value(values, switch, tau)
        });
        let Some((side, bracket)) = found else {
            continue;
        };
        if let Some(first) = first {
            if first.tau <= bracket.start {
                continue;
            }
            if there.is_empty() {
                values(first.tau, &mut there);
            }
            let on_side = there.get(switch).is_some_and(|value| side * value > 0.0);
            if first.tau < bracket.end && on_side {
                continue;
            }
        }
        let tau = root(bracket, side, resolution, &mut |tau| {
            value(values, switch, tau)
        });
        if first.is_none_or(|first| tau < first.tau) {
            first = Some(Crossing { switch, tau });
            there.clear();
        }
    }
    first
}

/// One of the functions.
fn value(values: &mut dyn FnMut(f64, &mut Vec<f64>), switch: usize, tau: f64) -> f64 {
    let mut row = Vec::new();
    values(tau, &mut row);
    value_in(&row, switch)
}

/// One of the values at a place; NaN, which has no sign, if there are none.
fn value_in(row: &[f64], switch: usize) -> f64 {
    row.get(switch).copied().unwrap_or(f64::NAN)
}

/// The part of the length of a piece, at least `least`, after which a function, given by its index, has changed its sign
/// behind the end of the piece. `values` gives the functions on the polynomial of the piece, from its end.
pub(super) fn past_root(
    least: f64,
    switch: usize,
    values: &mut dyn FnMut(f64, &mut Vec<f64>),
) -> f64 {
    let side = value(values, switch, -BEYOND);
    let (mut past, mut more) = (least, f64::EPSILON);
    // The times and coordinates may have fewer digits than the part.
    while past < BEYOND && side * value(values, switch, past) > 0.0 {
        past += more;
        more *= 2.0;
    }
    past
}

/// Whether any of the functions is zero at the start, up to its change within the resolution, and non-zero soon after.
pub(super) fn begins_on_root(resolution: f64, values: &mut dyn FnMut(f64, &mut Vec<f64>)) -> bool {
    const SOON: f64 = 1e-3;
    let (mut start, mut soon) = (Vec::new(), Vec::new());
    values(0.0, &mut start);
    values(SOON, &mut soon);
    (start.iter().zip(&soon)).any(|(start, soon)| {
        let moved = (soon - start).abs();
        moved > 0.0 && start.abs() <= 2.0 * resolution / SOON * moved
    })
}

/// The sign with which the function begins, and the first part of the step in which it changes.
fn bracket(
    times: &[f64],
    column: &[f64],
    passed: f64,
    value: &mut dyn FnMut(f64) -> f64,
) -> Option<(f64, Range<f64>)> {
    let largest = (column.iter()).fold(0.0_f64, |largest, value| largest.max(value.abs()));
    let moved = (column[1] - column[0]).abs();
    let on_surface = (passed * moved).max(ROUNDING * largest);
    let begins = if column[0].abs() > on_surface { 0 } else { 1 };
    let begins = begins + (column[begins..].iter()).position(|value| value.abs() > 0.0)?;
    let side = column[begins].signum();
    for k in begins + 1..column.len() {
        let here = side * column[k];
        if here < 0.0 {
            return Some((side, times[k - 1]..times[k]));
        }
        // The function goes down and up again between the samples.
        if k + 1 == column.len() {
            break;
        }
        let (before, after) = (side * column[k - 1], side * column[k + 1]);
        if here < before && here <= after && after >= 0.0 {
            let bend = before - 2.0 * here + after;
            let vertex = (0.5 * (before - after) / bend).clamp(-1.0, 1.0);
            let tau = times[k] + vertex * (times[k + 1] - times[k]);
            if side * value(tau) < 0.0 {
                return Some((side, times[k - 1]..tau));
            }
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    fn crossing(f: impl Fn(f64) -> f64) -> Option<f64> {
        let mut values = |tau: f64, row: &mut Vec<f64>| row.push(f(tau));
        first_crossing(0.0..1.0, 8, 1e-15, &mut values).map(|crossing| crossing.tau)
    }

    #[test]
    fn roots_are_found_to_round_off() {
        let found = crossing(|tau| (3.0 * tau).cos() - 0.1).expect("a root");
        assert!((found - 0.1_f64.acos() / 3.0).abs() < 1e-15, "{found}");
        let steep = crossing(|tau| (200.0 * (tau - 0.777)).tanh()).expect("a root");
        assert!((steep - 0.777).abs() < 1e-14, "{steep}");
    }

    #[test]
    fn pairs_between_samples_are_found() {
        let found = crossing(|tau| (tau - 0.5).powi(2) - 1e-4).expect("a root");
        assert!((found - 0.49).abs() < 1e-14, "{found}");
    }

    #[test]
    fn a_root_at_the_start_is_none() {
        assert_eq!(crossing(|tau| tau), None);
        assert_eq!(crossing(|tau| tau - 1e-15), None);
        assert!(crossing(|tau| tau - 1e-12).is_some());
        let second = crossing(|tau| tau * (tau - 0.6)).expect("the other root");
        assert!((second - 0.6).abs() < 1e-14);
    }

    #[test]
    fn the_first_of_several_is_taken() {
        let mut values = |tau: f64, row: &mut Vec<f64>| row.extend([tau - 0.7, 0.3 - tau, 1.0]);
        let found = first_crossing(0.0..1.0, 8, 1e-15, &mut values).expect("a root");
        assert_eq!(found.switch, 1);
        assert!((found.tau - 0.3).abs() < 1e-15);
    }

    #[test]
    fn a_place_without_values_hides_no_root() {
        let mut values = |tau: f64, row: &mut Vec<f64>| {
            if tau != 0.5 {
                row.push(0.3 - tau);
            }
        };
        let found = first_crossing(0.0..1.0, 8, 1e-15, &mut values).expect("a root");
        assert!((found.tau - 0.3).abs() < 1e-15);
    }

    #[test]
    fn what_has_no_sign_has_no_root() {
        assert_eq!(crossing(|_| 0.0), None);
        assert_eq!(crossing(|_| f64::NAN), None);
    }
}
