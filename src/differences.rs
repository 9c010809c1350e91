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

/// Whether nothing sees the size of a parameter, as of a drag of 1e-20: all of it moves something of some size by so little that parts of it change that by roundings.
pub(crate) fn is_next_to_zero(parameter: f64, (moved, size): (f64, f64)) -> bool {
    const SEEN: f64 = 1e-4;

    parameter != 0.0 && moved <= SEEN * size
}

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

/// The derivative of a function by the time, however fast the function changes. Distances, the first of them at times about one `first`, grow shorter until two that follow each other say the same:
/// one by itself may be a multiple of a period of the function, which seems to be constant then.
pub(crate) fn derivative_by_time(first: f64, time: f64, f: &mut dyn FnMut(f64) -> f64) -> f64 {
    /// The next one, as a part of the one before: no simple part either.
    const NEXT: f64 = 0.291;
    /// Down to some 1e-12 of the first.
    const TRIALS: i32 = 24;
    /// How near to each other two derivatives are that say the same.
    const SAME: f64 = 1e-6;

    if !time.is_finite() {
        return f64::NAN;
    }
    // Beside large times those within a function are rounded.
    let first = first * time.abs().max(1.0).cbrt();
    let (mut known, mut best) = (None, (f64::INFINITY, f64::NAN));
    for shorter in 0..TRIALS {
        let distance = resolved(first * NEXT.powi(shorter), time);
        let Difference {
            sixth,
            off,
            roundings,
        } = Difference::over(distance, |s| f(time + s));
        let roundings = roundings + 4.0 * f64::EPSILON * time.abs() * sixth.abs() / distance;
        let is_same = |known: &f64| (sixth - known).abs() <= SAME * known.abs() + roundings;
        if let Some(known) = known.filter(is_same) {
            return known;
        }
        known = (off <= (WELL_KNOWN * sixth.abs()).max(roundings)).then_some(sixth);
        if off < best.0 || best.1.is_nan() {
            best = (off, sixth);
        }
    }
    best.1
}

/// A derivative at zero by differences of sixth order, how far that of fourth order is off, and what roundings of the function may leave.
struct Difference {
    sixth: f64,
    off: f64,
    roundings: f64,
}

impl Difference {
    fn over(distance: f64, mut f: impl FnMut(f64) -> f64) -> Self {
        /// Roundings of a function, of which the differences of both orders are made.
        const ROUNDINGS: f64 = 64.0 * f64::EPSILON;

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
        Self {
            sixth,
            off: (sixth - fourth).abs(),
            roundings: ROUNDINGS * largest / distance,
        }
    }
}

/// An estimate of the error of a derivative, and the derivative.
fn estimated(distance: f64, mut f: impl FnMut(f64) -> f64) -> (f64, f64) {
    /// Distances that are tried, each a quarter of the one before: down to 1e-12 of the first.
    const SHORTER: i32 = 20;

    let mut best = (f64::INFINITY, f64::NAN);
    for shorter in 0..=SHORTER {
        let distance = distance * 0.25_f64.powi(shorter);
        let Difference {
            sixth,
            off,
            roundings,
        } = Difference::over(distance, &mut f);
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

    /// Waves of a second and of a microsecond, early and at 1e9 s; and a jump that is nearer than any usual distance.
    #[test]
    fn derivatives_by_the_time_are_those_of_its_own_scale() {
        let pi = std::f64::consts::PI;
        for (rate, time, allowed) in [
            (1.0, 0.3, 1e-11),
            (1.0, 1e9 + 0.5, 1e-9),
            (500.0 * pi, 0.3, 1e-10),
            (2e6 * pi, 3.2e-7, 1e-9),
            // Of the phase 3e6 some 3e-10 are rounded.
            (2e6 * pi, 0.5, 1e-6),
            (1e-3, 7e3, 1e-8),
        ] {
            let found = derivative_by_time(1.570_796e-4, time, &mut |t| (rate * t).sin());
            let expected = rate * (rate * time).cos();
            let error = (found - expected).abs() / rate;
            assert!(error < allowed, "{rate} at {time}: {found} {expected}");
        }
        for (ahead, slope) in [(1e-5, 1.0), (1e-9, 1.0), (-1e-9, 3.0)] {
            let bent = |t: f64| if t < 1.0 { t } else { 5.0 + 3.0 * t };
            let found = derivative_by_time(1.570_796e-4, 1.0 - ahead, &mut |t| bent(t));
            // Over 1e-10 the roundings of a number of eight leave 1e-5.
            assert!((found - slope).abs() < 1e-4, "{found} for {slope}");
        }
        let constant = |time: f64, value: f64| derivative_by_time(1e-3, time, &mut |_| value);
        assert_eq!(constant(2.0, 1.0), 0.0);
        assert!(constant(f64::NAN, 1.0).is_nan() && constant(1.0, f64::NAN).is_nan());
    }
}
