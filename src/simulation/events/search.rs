//! All changes of sign of functions along an element, in their order.

use tfe_runtime::__private::root;

/// A function changes its sign.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Root {
    /// Which one.
    pub(super) function: usize,
    /// Where in the element.
    pub(super) tau: f64,
    /// Whether from below zero to above.
    pub(super) rises: bool,
}

/// Where a function is on no side at first it is looked at closer to the start, in parts of the first sample of 4⁻¹, 4⁻², …
const CLOSER: i32 = 12;

/// Whether all functions stay on their sides: in five places they are further from zero than they move along the element.
pub(super) fn stays_off(sides: &[f64], values: &impl Fn(f64, &mut Vec<f64>)) -> bool {
    const PLACES: [f64; 5] = [1.0, 0.0, 0.5, 0.25, 0.75];
    let mut row = Vec::with_capacity(sides.len());
    let mut bounds = vec![(f64::INFINITY, f64::NEG_INFINITY); sides.len()];
    for tau in PLACES {
        row.clear();
        values(tau, &mut row);
        for ((side, value), (least, largest)) in sides.iter().zip(&row).zip(&mut bounds) {
            let value = side * value;
            *least = value.min(*least);
            *largest = value.max(*largest);
            if !(value > 0.0 && *largest < 2.0 * *least) {
                return false;
            }
        }
    }
    true
}

/// The changes of sign of the functions that `values` gives at τ, and the sides on which they are at the end. Each is on one of `sides` at the start; zero where that is
/// not known. The signs are looked at in `samples` equal parts, and at the vertex of a parabola where a function comes near zero between them; a change between two parts
/// belongs to the later one.
pub(super) fn crossings(
    sides: &[f64],
    samples: usize,
    resolution: f64,
    values: impl Fn(f64, &mut Vec<f64>),
) -> (Vec<Root>, Vec<f64>) {
    let part = 1.0 / samples as f64;
    let mut times = vec![0.0];
    if sides.contains(&0.0) {
        times.extend((1..=CLOSER).rev().map(|k| part * 4.0_f64.powi(-k)));
    }
    times.extend((1..samples).map(|k| k as f64 * part));
    times.push(1.0);
    let row = |tau: &f64| {
        let mut row = Vec::with_capacity(sides.len());
        values(*tau, &mut row);
        row
    };
    let rows: Vec<Vec<f64>> = times.iter().map(row).collect();
    let (mut roots, mut ends) = (Vec::new(), Vec::new());
    for (function, side) in sides.iter().enumerate() {
        let column: Vec<f64> = rows.iter().map(|row| row[function]).collect();
        let mut value = |tau: f64| row(&tau)[function];
        let mut side = *side;
        let mut from = 0.0;
        let mut change = |from: f64, to: f64, side: &mut f64| {
            let rises = *side < 0.0;
            let tau = root(from..to, *side, 0.25 * resolution, &mut value);
            roots.push(Root {
                function,
                tau,
                rises,
            });
            *side = -*side;
        };
        // What is left of a zero at the start is rounding.
        let rounding = if side == 0.0 {
            4.0 * column[0].abs()
        } else {
            0.0
        };
        let starts_off =
            column[0].abs() > 1e-12 * column.iter().fold(0.0, |a: f64, b| a.max(b.abs()));
        for k in 0..times.len() {
            let here = column[k];
            let is_known = side != 0.0 || starts_off || here.abs() > rounding;
            if here == 0.0 || here.is_nan() || !is_known {
                continue;
            }
            if side == 0.0 {
                side = here.signum();
            } else if side * here < 0.0 {
                change(from, times[k], &mut side);
            } else if k >= 2 {
                // Over and back again between the samples, seen at the one before.
                let [a, b] = [k - 2, k - 1];
                if let Some(tau) = vertex(&times[a..=k], &column[a..=k], side)
                    && tau > times[a]
                    && side * row(&tau)[function] < 0.0
                {
                    let begin = if tau < times[b] { times[a] } else { times[b] };
                    change(begin, tau, &mut side);
                    change(tau, times[k], &mut side);
                }
            }
            from = times[k];
        }
        ends.push(side);
    }
    roots.sort_by(|a, b| a.tau.total_cmp(&b.tau));
    (roots, ends)
}

/// Where a parabola through three values on one side of zero comes nearest to it.
fn vertex(times: &[f64], column: &[f64], side: f64) -> Option<f64> {
    let ([t0, t1, t2], [f0, f1, f2]) = (
        <[f64; 3]>::try_from(times).ok()?,
        [side * column[0], side * column[1], side * column[2]],
    );
    if !(f0 > 0.0 && f1 > 0.0 && f2 > 0.0 && f1 < f0 && f1 <= f2) {
        return None;
    }
    let (first, second) = ((f1 - f0) / (t1 - t0), (f2 - f1) / (t2 - t1));
    let bend = (second - first) / (t2 - t0);
    Some(0.5 * (t0 + t1) - 0.5 * first / bend)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn taus(side: f64, f: impl Fn(f64) -> f64) -> Vec<f64> {
        let values = |tau: f64, row: &mut Vec<f64>| row.push(f(tau));
        let (roots, _) = crossings(&[side], 8, 1e-15, values);
        roots.iter().map(|root| root.tau).collect()
    }

    fn is_near(found: &[f64], expected: &[f64]) -> bool {
        let near = |(a, b): (&f64, &f64)| (a - b).abs() < 1e-14;
        found.len() == expected.len() && found.iter().zip(expected).all(near)
    }

    #[test]
    fn all_roots_are_found_in_order() {
        let found = taus(0.0, |tau| (10.0 * tau - 0.5).sin());
        let pi = std::f64::consts::PI;
        let expected: Vec<f64> = (0..4).map(|k| (0.5 + f64::from(k) * pi) / 10.0).collect();
        assert!(
            is_near(&found, &expected[..4]) || is_near(&found, &expected[..3]),
            "{found:?}"
        );
    }

    #[test]
    fn pairs_between_samples_are_found() {
        let found = taus(0.0, |tau| (tau - 0.55).powi(2) - 1e-4);
        assert!(is_near(&found, &[0.54, 0.56]), "{found:?}");
        let touching = taus(0.0, |tau| (tau - 0.55).powi(2) + 1e-9);
        assert_eq!(touching, []);
    }

    /// A root at the start belongs to the part before, unless the side says otherwise.
    #[test]
    fn sides_carry_over() {
        assert_eq!(taus(0.0, |tau| tau), []);
        assert_eq!(taus(1.0, |tau| tau), []);
        assert_eq!(taus(-1.0, |tau| tau), [0.0]);
        assert_eq!(taus(1.0, |tau| 1.0 - tau), []);
        // A short hop from the ground, with a rounding at its start.
        let hop = taus(0.0, |tau| tau * (1e-3 - tau) - 1e-20);
        assert!(is_near(&hop, &[1e-3]), "{hop:?}");
    }

    #[test]
    fn what_is_far_from_zero_is_not_searched() {
        let off = |side: f64, f: fn(f64) -> f64| {
            stays_off(&[side], &|tau: f64, row: &mut Vec<f64>| row.push(f(tau)))
        };
        assert!(off(1.0, |tau| 3.0 + tau) && off(-1.0, |tau| tau - 3.0));
        assert!(!off(1.0, |tau| 0.5 + tau) && !off(-1.0, |tau| 3.0 + tau));
        assert!(!off(0.0, |_| 1.0) && !off(1.0, |_| f64::NAN));
    }

    #[test]
    fn what_has_no_sign_has_no_root() {
        assert_eq!(taus(0.0, |_| 0.0), []);
        assert_eq!(taus(0.0, |_| f64::NAN), []);
    }
}
