//! How multipliers move with a parameter (T-157).

use crate::periodic_schur::Multiplier;
use nalgebra::Complex;
use std::f64::consts::PI;

/// What a difference moves of whatever moves most, as a part of its size: roundings of 1e-15 leave some 1e-12 of a derivative, the ninth power of this less.
const PART: f64 = 4e-3;

/// The largest difference between two orders of a derivative with which it counts as known; the better one is nearer.
const KNOWN: f64 = 1e-7;

/// That with which no better one is looked for.
const WELL_KNOWN: f64 = 1e-9;

/// The distance of differences by a parameter of this value, where unit steps of it move things by such parts of their sizes.
pub(super) fn distance(value: f64, parts: impl IntoIterator<Item = f64>) -> f64 {
    let of_itself = if value == 0.0 { 0.0 } else { 1.0 / value.abs() };
    let largest = parts.into_iter().fold(of_itself, f64::max);
    match largest > 0.0 && largest.is_finite() {
        true => PART / largest,
        false => PART,
    }
}

/// Weights of central differences of eighth and of sixth order, for ±1 … ±4 distances.
pub(super) const EIGHTH: [f64; 4] = [4.0 / 5.0, -1.0 / 5.0, 4.0 / 105.0, -1.0 / 280.0];
const SIXTH: [f64; 4] = [3.0 / 4.0, -3.0 / 20.0, 1.0 / 60.0, 0.0];

/// The places of a central difference, and what values there count.
pub(super) fn stencil(weights: [f64; 4], distance: f64) -> impl Iterator<Item = (f64, f64)> {
    (1..).zip(weights).flat_map(move |(k, weight)| {
        let place = f64::from(k) * distance;
        [(place, weight / distance), (-place, -weight / distance)]
    })
}

/// The derivatives of multipliers, from those at places near by, at first `distance` apart, then nearer where that does not tell them; none where it never does, as where multipliers meet.
/// Trivial ones stay.
pub(super) fn derivatives(
    multipliers: &[Multiplier],
    trivial: &[usize],
    distance: f64,
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
    for nearer in [1.0, 0.25, 0.0625] {
        let distance = nearer * distance;
        let found = differences(multipliers, distance, &at);
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

/// A derivative of a logarithm, and what two orders of differences are apart, as a part of it or of one that moves it by as much as whatever moves most.
#[derive(Clone, Copy)]
struct Known {
    logarithm: Complex<f64>,
    off: f64,
}

fn differences(
    multipliers: &[Multiplier],
    distance: f64,
    at: &impl Fn(f64) -> Option<Vec<Multiplier>>,
) -> Vec<Known> {
    let zero = Complex::new(0.0, 0.0);
    let mut sums = vec![[zero; 2]; multipliers.len()];
    for ((shift, eighth), sixth) in stencil(EIGHTH, distance).zip(stencil(SIXTH, distance)) {
        let found = at(shift).unwrap_or_default();
        for (own, sum) in multipliers.iter().zip(&mut sums) {
            let change = nearest(own, &found);
            sum[0] += change * eighth;
            sum[1] += change * sixth.1;
        }
    }
    let known = |[eighth, sixth]: [Complex<f64>; 2]| Known {
        logarithm: eighth,
        off: (eighth - sixth).norm() / eighth.norm().max(PART / distance),
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
