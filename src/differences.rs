//! Central differences, where a derivative cannot be had otherwise.

/// Weights of values at ±1, ±2 and ±3 distances: of sixth order.
pub(crate) const SIXTH: [f64; 3] = [45.0 / 60.0, -9.0 / 60.0, 1.0 / 60.0];

/// Weights of values at ±1 … ±4 distances: of eighth order.
const EIGHTH: [f64; 4] = [4.0 / 5.0, -1.0 / 5.0, 4.0 / 105.0, -1.0 / 280.0];

/// What a difference of eighth order moves of whatever moves most, as a part of its size: roundings of 1e-15 leave some 1e-12 of a derivative, and what higher derivatives leave is less.
pub(crate) const PART: f64 = 4e-3;

/// How near two orders of a derivative have to be for no shorter distance to be tried.
pub(crate) const WELL_KNOWN: f64 = 1e-9;

/// The distances that are tried, in parts of the first.
pub(crate) const NEARER: [f64; 3] = [1.0, 0.25, 0.0625];

/// Weights of values at ±1 and ±2 distances: of fourth order.
const FOURTH: [f64; 2] = [8.0 / 12.0, -1.0 / 12.0];

/// A derivative at zero by differences of sixth order over a distance; a shorter one where fourth order gives something else, as of a function that changes much within it.
pub(crate) fn derivative(distance: f64, f: impl FnMut(f64) -> f64) -> f64 {
    estimated(distance, f).1
}

/// The same over a long distance, which serves functions that hold numbers of the size of one beside a small value, or over a short one, a part of that value, where roundings leave less of it.
pub(crate) fn derivative_of_either([long, short]: [f64; 2], mut f: impl FnMut(f64) -> f64) -> f64 {
    /// What an error is less than, as a part of the derivative, where that is more than roundings.
    const KNOWN: f64 = 1e-3;

    let (error, slope) = estimated(long, &mut f);
    let is_shorter = short > 0.0 && short < long;
    if error <= WELL_KNOWN * slope.abs() || !is_shorter {
        return slope;
    }
    let (nearer_error, nearer) = estimated(short, f);
    // As parts: a function that goes up and down within the long distance has small differences there.
    let (part, nearer_part) = (error / slope.abs(), nearer_error / nearer.abs());
    let is_better = nearer_part < KNOWN && nearer_part < part;
    if is_better || !slope.is_finite() {
        nearer
    } else {
        slope
    }
}

/// The nearest distance from a time to one that there is, and at least to the next: beside large times distances are rounded, and with them differences.
pub(crate) fn resolved(distance: f64, time: f64) -> f64 {
    let moved = (time + distance) - time;
    if moved == 0.0 {
        time.next_up() - time
    } else {
        moved
    }
}

/// An estimate of the error of a derivative, and the derivative.
fn estimated(distance: f64, mut f: impl FnMut(f64) -> f64) -> (f64, f64) {
    /// Distances that are tried, each a quarter of the one before: down to 1e-12 of the first.
    const SHORTER: i32 = 20;
    /// Roundings of a function, of which the differences of both orders are made.
    const ROUNDINGS: f64 = 64.0 * f64::EPSILON;

    let mut best = (f64::INFINITY, f64::NAN);
    for shorter in 0..=SHORTER {
        let distance = distance * 0.25_f64.powi(shorter);
        let mut largest = 0.0_f64;
        let differences: [f64; 3] = std::array::from_fn(|k| {
            let s = (k + 1) as f64 * distance;
            let (ahead, behind) = (f(s), f(-s));
            largest = largest.max(ahead.abs()).max(behind.abs());
            ahead - behind
        });
        let of = |weights: &[f64]| {
            let terms = weights
                .iter()
                .zip(differences)
                .map(|(w, change)| w * change);
            terms.sum::<f64>() / distance
        };
        let (sixth, fourth) = (of(&SIXTH), of(&FOURTH));
        let off = (sixth - fourth).abs();
        let roundings = ROUNDINGS * largest / distance;
        if off <= (WELL_KNOWN * sixth.abs()).max(roundings) {
            return (off.max(roundings), sixth);
        }
        if off < best.0 || best.1.is_nan() {
            best = (off, sixth);
        }
    }
    best
}

/// Where a function is evaluated, and what the value there counts in the derivative of eighth order and in that of sixth.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place {
    pub(crate) shift: f64,
    pub(crate) eighth: f64,
    pub(crate) sixth: f64,
}

/// The places of differences over a distance.
pub(crate) fn places(distance: f64) -> impl Iterator<Item = Place> {
    let sixth = SIXTH.into_iter().chain([0.0]);
    (1..)
        .zip(EIGHTH)
        .zip(sixth)
        .flat_map(move |((k, eighth), sixth)| {
            [1.0, -1.0].map(|sign| Place {
                shift: sign * f64::from(k) * distance,
                eighth: sign * eighth / distance,
                sixth: sign * sixth / distance,
            })
        })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn derivatives_of_functions_of_any_width() {
        for (found, expected) in [
            (derivative(2e-3, |s| (0.3 + s).sin()), 0.3_f64.cos()),
            (derivative(2e-3, |s| 1.0 / (1e-6 + s)), -1e12),
            (derivative(2e-3, |s| (1e5 * s).sin()), 1e5),
            (derivative(2e-3, |s| (1e-4 + s).ln()), 1e4),
            (derivative(2e-3, |s| 1.0 + 1e-6 * s), 1e-6),
        ] {
            let roundings = 1e-9 * expected.abs().max(1e-3);
            assert!((found - expected).abs() < roundings, "{found} {expected}");
        }
        for size in [1e-6, 1e-15, 1e-150] {
            let near =
                |f: &dyn Fn(f64) -> f64| derivative_of_either([2e-3, 2e-3 * size], |s| f(size + s));
            for (found, expected) in [
                (near(&|x| 0.5 * x * x), size),
                (near(&|x| (x / size).sin()), 1.0_f64.cos() / size),
                (near(&|x| 0.5 * (x - 1.0).powi(2)), size - 1.0),
                (near(&|x| (x + 1e6).powi(2) * 1e-6), 2.0),
            ] {
                let roundings = 1e-7 * expected.abs();
                assert!((found - expected).abs() < roundings, "{found} {expected}");
            }
            assert_eq!(near(&|_| 1.0), 0.0);
        }
        assert_eq!(derivative(2e-3, |_| 1.0), 0.0);
        assert!(derivative(2e-3, |_| f64::NAN).is_nan());
    }
}
