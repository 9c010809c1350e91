//! Finds all zero crossings of functions along an element, in the order of time.

use tfe_runtime::__private::root;

/// A zero crossing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Root {
    /// The index of the function.
    pub(super) function: usize,
    /// The position in the element, between 0 and 1.
    pub(super) tau: f64,
    /// Whether the function rises.
    pub(super) rises: bool,
}

impl Root {
    /// Whether the function has jumped over zero at the start and, by this slope, moves back: its next zero is a
    /// different root.
    pub(super) fn is_left_at_once(&self, slope: f64) -> bool {
        self.tau == 0.0 && self.is_crossed_with(-slope)
    }

    /// Whether a slope has the direction of this crossing.
    pub(super) fn is_crossed_with(&self, slope: f64) -> bool {
        let on = if self.rises { slope } else { -slope };
        on > 0.0
    }
}

/// What a search along an element has found.
#[derive(Debug, PartialEq)]
pub(super) struct Crossings {
    /// In the order of time.
    pub(super) roots: Vec<Root>,
    /// The signs of the functions at the end; zero if unknown.
    pub(super) sides: Vec<f64>,
    /// The positions from which on functions are NaN up to the end.
    pub(super) undefined: Vec<Option<f64>>,
}

/// If the sign at the start is unknown, the function is also sampled close to the start, at 4⁻¹, 4⁻², … of the first
/// sample.
const CLOSER: i32 = 12;

/// The smallest part of an element that is examined.
const NARROWEST: f64 = 1.0 / 1_048_576.0;

/// The largest number of parts in which bounds of a function are asked for.
const MAX_QUESTIONS: u32 = 128;

/// The price of an answer without any bounds, in answers.
const COST_OF_SILENCE: u32 = 8;

/// What bounds prove about a function in a part of an element.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum ZeroProof {
    /// It has no zero, or it is monotonic: the signs at the ends tell all.
    AtMostOne,
    /// Neither of these is proved.
    Unproved,
    /// There are no bounds.
    Unbounded,
}

/// Divides an element into parts in each of which a function crosses zero at most once; returns the ends of the parts.
/// This is proved for all parts but the narrowest, and those left after [`MAX_QUESTIONS`], which are no wider than one
/// of `samples` equal parts.
fn places(samples: usize, proof: &mut dyn FnMut((f64, f64)) -> ZeroProof) -> Vec<f64> {
    let wide = 1.0 / samples as f64;
    let (mut ends, mut level) = (Vec::new(), vec![(0.0, 1.0)]);
    let mut questions = MAX_QUESTIONS;
    while !level.is_empty() {
        let mut next = Vec::new();
        for (from, to) in level {
            let answer = match (to - from <= NARROWEST, questions) {
                (true, _) => ZeroProof::AtMostOne,
                (false, 0) if to - from <= wide => ZeroProof::AtMostOne,
                (false, 0) => ZeroProof::Unbounded,
                (false, _) => proof((from, to)),
            };
            let cost = match answer {
                ZeroProof::Unbounded => COST_OF_SILENCE,
                _ => 1,
            };
            questions = questions.saturating_sub(cost);
            if answer == ZeroProof::AtMostOne {
                ends.push(to);
            } else {
                let middle = 0.5 * (from + to);
                next.extend([(from, middle), (middle, to)]);
            }
        }
        level = next;
    }
    ends.sort_by(f64::total_cmp);
    ends
}

/// The zero crossings of the functions `values` (τ). `sides` are the signs at the start; zero if unknown: then values up to `roundings` have no sign. Signs are compared at the ends of parts in which `course` proves at most one
/// crossing; without bounds, of about `samples` equal parts. A pair of crossings between samples is also found at the
/// vertex of a parabola where a function comes close to zero. A crossing at the boundary of two parts belongs to the
/// later one.
pub(super) fn crossings(
    (sides, roundings): (&[f64], &[f64]),
    samples: usize,
    resolution: f64,
    values: &dyn Fn(f64, &mut Vec<f64>),
    proof: &mut dyn FnMut(usize, (f64, f64)) -> ZeroProof,
) -> Crossings {
    let row = |tau: &f64| {
        let mut row = Vec::with_capacity(sides.len());
        values(*tau, &mut row);
        row
    };
    let (mut roots, mut ends, mut undefined) = (Vec::new(), Vec::new(), Vec::new());
    for (function, side) in sides.iter().enumerate() {
        let mut times = vec![0.0];
        if *side == 0.0 {
            let part = 1.0 / samples as f64;
            times.extend((1..=CLOSER).map(|k| part * 4.0_f64.powi(-k)));
        }
        times.extend(places(samples, &mut |part| proof(function, part)));
        times.sort_by(f64::total_cmp);
        times.dedup();
        let mut value = |tau: f64| row(&tau)[function];
        let column: Vec<f64> = times.iter().map(|tau| value(*tau)).collect();
        undefined.push(undefined_from(&times, &column));
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
        // If the sign is unknown, a small value at the start is rounding error of a zero; unless it is not finite.
        let rounding = if side == 0.0 && column[0].is_finite() {
            (4.0 * column[0].abs()).max(roundings[function])
        } else {
            0.0
        };
        // The rounding error of the time has the same effect, which is large in a short element.
        let rounded = (8.0 * resolution).max(1e-12);
        let finite = column.iter().filter(|value| value.is_finite());
        let largest = finite.fold(0.0, |a: f64, b| a.max(b.abs()));
        let starts_off = column[0].abs() > (rounded * largest).max(roundings[function]);
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
                // A pair of crossings between samples, visible at the previous sample.
                let [a, b] = [k - 2, k - 1];
                let ends = (a == 0, k + 1 == times.len());
                if let Some(tau) = vertex(&times[a..=k], &column[a..=k], side, ends)
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
    Crossings {
        roots,
        sides: ends,
        undefined,
    }
}

/// The time from which on all samples are NaN, if these are two at least: a single one may be a singular point.
fn undefined_from(times: &[f64], column: &[f64]) -> Option<f64> {
    let defined = column.iter().rposition(|value| !value.is_nan());
    let first = defined.map_or(0, |last| last + 1);
    (first + 1 < column.len()).then(|| times[first])
}

/// The minimum of the distance from zero on a parabola through three values of the same sign: about the middle one; if
/// the first or the last sample is an end of the element, also between it and the middle one.
fn vertex(
    times: &[f64],
    column: &[f64],
    side: f64,
    (is_first, is_last): (bool, bool),
) -> Option<f64> {
    let ([t0, t1, t2], [f0, f1, f2]) = (
        <[f64; 3]>::try_from(times).ok()?,
        [side * column[0], side * column[1], side * column[2]],
    );
    let is_about_middle = f1 < f0 && f1 <= f2;
    if !(f0 > 0.0 && f1 > 0.0 && f2 > 0.0 && (is_about_middle || is_first || is_last)) {
        return None;
    }
    let (first, second) = ((f1 - f0) / (t1 - t0), (f2 - f1) / (t2 - t1));
    let bend = (second - first) / (t2 - t0);
    let tau = 0.5 * (t0 + t1) - 0.5 * first / bend;
    let is_at_end = (is_first && t0 < tau && tau < t1) || (is_last && t1 < tau && tau < t2);
    (is_about_middle || bend > 0.0 && is_at_end).then_some(tau)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn taus(side: f64, f: impl Fn(f64) -> f64) -> Vec<f64> {
        let values = |tau: f64, row: &mut Vec<f64>| row.push(f(tau));
        let found = crossings((&[side], &[0.0]), 8, 1e-15, &values, &mut |_, _| {
            ZeroProof::Unbounded
        });
        found.roots.iter().map(|root| root.tau).collect()
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
        assert_eq!(touching, [0.0; 0]);
    }

    /// A root at the start belongs to the previous element, unless the known sign says otherwise.
    #[test]
    fn sides_carry_over() {
        assert_eq!(taus(0.0, |tau| tau), [0.0; 0]);
        assert_eq!(taus(1.0, |tau| tau), [0.0; 0]);
        assert_eq!(taus(-1.0, |tau| tau), [0.0]);
        assert_eq!(taus(1.0, |tau| 1.0 - tau), [0.0; 0]);
        // A short hop from the ground, with a rounding error at its start.
        let hop = taus(0.0, |tau| tau * (1e-3 - tau) - 1e-20);
        assert!(is_near(&hop, &[1e-3]), "{hop:?}");
    }

    /// A function that begins on zero and falls, with rounding errors that first show it above zero.
    #[test]
    fn roundings_at_the_start_have_no_sign() {
        let f = |tau: f64| if tau < 1e-9 { 1e-17 } else { 1e-16 - tau * tau };
        let values = |tau: f64, row: &mut Vec<f64>| row.push(if tau == 0.0 { 0.0 } else { f(tau) });
        let found = |rounding: f64| {
            let mut proof = |_, _: (f64, f64)| ZeroProof::Unbounded;
            crossings((&[0.0], &[rounding]), 8, 1e-15, &values, &mut proof)
        };
        assert_eq!(found(0.0).roots.len(), 1);
        let Crossings { roots, sides, .. } = found(1e-15);
        assert_eq!((roots, sides), (Vec::new(), vec![-1.0]));
    }

    /// A pair of roots that sampling would miss, with bounds of the derivative 2 (τ − 0.3).
    #[test]
    fn what_is_proved_is_found() {
        let near = 0.3 + 1e-7;
        let f = |tau: f64| (tau - 0.3) * (tau - near);
        let values = |tau: f64, row: &mut Vec<f64>| row.push(f(tau));
        let mut questions = 0;
        let mut proof = |_, (from, to): (f64, f64)| {
            questions += 1;
            let turn = 0.5 * (0.3 + near);
            if to < turn || from > turn {
                ZeroProof::AtMostOne
            } else {
                ZeroProof::Unproved
            }
        };
        let Crossings { roots, sides, .. } =
            crossings((&[1.0], &[0.0]), 8, 1e-15, &values, &mut proof);
        let found: Vec<f64> = roots.iter().map(|root| root.tau).collect();
        assert!(is_near(&found, &[0.3, near]), "{found:?}");
        assert_eq!((sides, questions), (vec![1.0], 39));
    }

    /// The same close to the start and close to the end, in the narrowest part there.
    #[test]
    fn pairs_at_the_ends_are_found() {
        for expected in [[1e-7, 2e-7], [1.0 - 2e-7, 1.0 - 1e-7]] {
            let [first, second] = expected;
            let f = |tau: f64| (tau - first) * (tau - second);
            let values = |tau: f64, row: &mut Vec<f64>| row.push(f(tau));
            let mut proof = |_, (from, to): (f64, f64)| {
                let turn = 0.5 * (first + second);
                if to < turn || from > turn {
                    ZeroProof::AtMostOne
                } else {
                    ZeroProof::Unproved
                }
            };
            let Crossings { roots, sides, .. } =
                crossings((&[1.0], &[0.0]), 8, 1e-15, &values, &mut proof);
            let found: Vec<f64> = roots.iter().map(|root| root.tau).collect();
            assert!(is_near(&found, &expected), "{found:?}");
            assert_eq!(sides, vec![1.0]);
        }
    }

    #[test]
    fn parts_are_as_narrow_as_need_be() {
        let plain = places(8, &mut |_| ZeroProof::AtMostOne);
        assert_eq!(plain, [1.0]);
        let unknown = places(10, &mut |_| ZeroProof::Unbounded);
        assert!(unknown.len() == 17 && unknown.windows(2).all(|two| two[0] < two[1]));
        let bent = places(10, &mut |_| ZeroProof::Unproved);
        assert!(
            bent.len() >= 64 && bent.last() == Some(&1.0),
            "{}",
            bent.len()
        );
    }

    /// If a function was infinite or NaN at the start, as 1/t at zero, its sign was never known and its events were
    /// lost.
    #[test]
    fn values_that_are_not_finite_somewhere_hide_no_root() {
        let inverse = taus(0.0, |tau| 1.0 / tau - 1.0 / 0.55);
        assert!(is_near(&inverse, &[0.55]), "{inverse:?}");
        let unknown = taus(0.0, |tau| if tau > 0.0 { 0.55 - tau } else { f64::NAN });
        assert!(is_near(&unknown, &[0.55]), "{unknown:?}");
        let pole = taus(0.0, |tau| (0.55 - tau) / (1.0 - tau).powi(2));
        assert!(is_near(&pole, &[0.55]), "{pole:?}");
    }

    #[test]
    fn what_has_no_sign_has_no_root() {
        assert_eq!(taus(0.0, |_| 0.0), [0.0; 0]);
        assert_eq!(taus(0.0, |_| f64::NAN), [0.0; 0]);
    }

    /// A function that is NaN at the end of an element, and in part of it, is told; a single NaN is not.
    #[test]
    fn functions_that_are_no_number_are_told() {
        let from = |f: fn(f64) -> f64| {
            let values = |tau: f64, row: &mut Vec<f64>| row.push(f(tau));
            let mut proof = |_, _: (f64, f64)| ZeroProof::Unbounded;
            crossings((&[1.0], &[0.0]), 8, 1e-15, &values, &mut proof).undefined[0]
        };
        assert_eq!(from(|_| f64::NAN), Some(0.0));
        let root = from(|tau| (0.55 - tau).sqrt() + 1.0);
        assert!(
            root.is_some_and(|tau| (0.55..0.7).contains(&tau)),
            "{root:?}"
        );
        assert_eq!(from(|tau| if tau == 1.0 { f64::NAN } else { 1.0 }), None);
        assert_eq!(from(|tau| if tau < 0.6 { f64::NAN } else { 1.0 }), None);
    }
}
