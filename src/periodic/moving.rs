//! Derivatives of Floquet multipliers by a parameter, from difference quotients (T-157).

use crate::differences::{NEARER, PART, WELL_KNOWN, is_next_to_zero, places};
use crate::numbers::{larger, largest};
use crate::periodic_schur::Multiplier;
use nalgebra::Complex;
use std::f64::consts::PI;

/// The largest relative difference between the estimates of two orders for which a derivative is returned; that of
/// higher order is more accurate.
const KNOWN: f64 = 1e-7;

/// The difference step for a parameter of a given value; `parts` are relative changes per unit of the parameter.
fn distance(value: f64, parts: impl IntoIterator<Item = f64>) -> f64 {
    let of_itself = if value == 0.0 { 0.0 } else { 1.0 / value.abs() };
    let largest = parts.into_iter().fold(of_itself, larger);
    match largest > 0.0 && largest.is_finite() {
        true => PART / largest,
        false => PART,
    }
}

/// The difference step for a period of a number of elements: ends move by a small fraction of an element, however often
/// the motion oscillates in a period.
pub(super) fn distance_of_period(period: f64, elements: usize) -> f64 {
    distance(period, [elements as f64 / period])
}

/// The difference steps to try. For a parameter so small that its relative changes affect the multipliers only by
/// rounding errors, the step for the value zero is tried first.
pub(super) fn distances(value: f64, parts: [f64; 3]) -> Vec<f64> {
    let own = distance(value, parts);
    let largest = parts.into_iter().fold(0.0, larger);
    match is_next_to_zero(value, (largest * value.abs(), 1.0)) {
        true => vec![distance(0.0, parts), own],
        false => vec![own],
    }
}

/// The largest change relative to the largest value; zero if all values are zero.
pub(super) fn part(changes: &[f64], of: &[f64]) -> f64 {
    let size = largest(of);
    if size > 0.0 {
        largest(changes) / size
    } else {
        0.0
    }
}

/// The derivatives of the multipliers from their values at shifted parameters `at`, with decreasing difference steps
/// until two orders agree; `None` if they never do, for example where multipliers coincide. Trivial multipliers stay
/// one.
pub(super) fn derivatives(
    multipliers: &[Multiplier],
    trivial: &[usize],
    distances: &[f64],
    at: impl Fn(f64) -> Option<Vec<Multiplier>>,
) -> Vec<Option<Complex<f64>>> {
    let none = Known {
        logarithm: Complex::new(0.0, 0.0),
        off: f64::INFINITY,
    };
    let mut best = vec![none; multipliers.len()];
    for place in trivial {
        best[*place].off = 0.0;
    }
    // Relative to the first step, so that shorter steps are not judged less strictly.
    let unit = PART / distances.first().copied().unwrap_or(PART);
    let tried = distances.iter();
    for distance in tried.flat_map(|distance| NEARER.map(|nearer| nearer * distance)) {
        let found = differences(multipliers, (distance, unit), &at);
        for (best, found) in best.iter_mut().zip(found) {
            if found.off < best.off {
                *best = found;
            }
        }
        if best.iter().all(|one| one.off < WELL_KNOWN) {
            break;
        }
    }
    let all = multipliers.iter().zip(best);
    all.map(|(own, known)| (known.off < KNOWN).then(|| own.to_complex() * known.logarithm))
        .collect()
}

/// The derivative of the logarithm of a multiplier, and its error: the difference of two orders plus rounding error,
/// relative to the derivative or to the fastest relative change.
#[derive(Clone, Copy)]
struct Known {
    logarithm: Complex<f64>,
    off: f64,
}

fn differences(
    multipliers: &[Multiplier],
    (distance, unit): (f64, f64),
    at: &impl Fn(f64) -> Option<Vec<Multiplier>>,
) -> Vec<Known> {
    let zero = Complex::new(0.0, 0.0);
    let mut sums = vec![[zero; 2]; multipliers.len()];
    for place in places(distance) {
        let found = at(place.shift).unwrap_or_default();
        for (own, sum) in multipliers.iter().zip(&mut sums) {
            let change = nearest(own, &found);
            sum[0] += change * place.eighth;
            sum[1] += change * place.sixth;
        }
    }
    let known = |[eighth, sixth]: [Complex<f64>; 2]| Known {
        logarithm: eighth,
        off: ((eighth - sixth).norm() + f64::EPSILON / distance) / eighth.norm().max(unit),
    };
    sums.into_iter().map(known).collect()
}

/// The logarithm of the ratio of the closest multiplier in a list to a given one; NaN if the list is empty.
fn nearest(own: &Multiplier, others: &[Multiplier]) -> Complex<f64> {
    let turned = |other: &Multiplier| {
        let angle = other.argument - own.argument;
        let turns = (angle / (2.0 * PI)).round();
        let of = other.log_modulus - own.log_modulus;
        Complex::new(of, angle - 2.0 * PI * turns)
    };
    let distances = others.iter().map(turned);
    let nearest = distances.min_by(|a, b| a.norm().total_cmp(&b.norm()));
    nearest.unwrap_or(Complex::new(f64::NAN, f64::NAN))
}
