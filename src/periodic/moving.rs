//! How multipliers move with a parameter (T-157).

use crate::differences::{NEARER, PART, WELL_KNOWN, is_next_to_zero, places};
use crate::numbers::largest;
use crate::periodic_schur::Multiplier;
use nalgebra::Complex;
use std::f64::consts::PI;

/// The largest difference between two orders of a derivative with which it counts as known; the better one is nearer.
const KNOWN: f64 = 1e-7;

/// The distance of differences by a parameter of this value, where unit steps of it move things by such parts of their sizes.
fn distance(value: f64, parts: impl IntoIterator<Item = f64>) -> f64 {
    let of_itself = if value == 0.0 { 0.0 } else { 1.0 / value.abs() };
    let largest = parts.into_iter().fold(of_itself, f64::max);
    match largest > 0.0 && largest.is_finite() {
        true => PART / largest,
        false => PART,
    }
}

/// The distance of differences by a period that so many elements make up: ends move by a small part of an element, however often the motion goes to and fro in a period.
pub(super) fn distance_of_period(period: f64, elements: usize) -> f64 {
    distance(period, [elements as f64 / period])
}

/// The distances that are tried: that by a parameter, after that by one that is zero where nothing sees the size of the parameter, in parts of which multipliers change by roundings.
pub(super) fn distances(value: f64, parts: [f64; 3]) -> Vec<f64> {
    let own = distance(value, parts);
    let largest = parts.into_iter().fold(0.0, f64::max);
    match is_next_to_zero(value, (largest * value.abs(), 1.0)) {
        true => vec![distance(0.0, parts), own],
        false => vec![own],
    }
}

/// The largest of some changes, in parts of the largest of what changes; zero where that is.
pub(super) fn part(changes: &[f64], of: &[f64]) -> f64 {
    let size = largest(of);
    if size > 0.0 {
        largest(changes) / size
    } else {
        0.0
    }
}

/// The derivatives of multipliers, from those at places near by, at first as far apart as the first distance says, then nearer where that does not tell them; none where it never does, as where
/// multipliers meet. Trivial ones stay.
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
    // By the first distance, so that nearer ones are not judged more mildly.
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

/// A derivative of a logarithm, and what two orders of differences are apart, with roundings of the logarithms, as a part of it or of one that moves it by as much as whatever moves most.
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

/// The logarithm of the multiplier nearest to one, over it; NaN where there is none.
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
