//! Derivatives by central differences, for functions without exact derivatives.

/// Weights of the values at ±1, ±2 and ±3 steps, sixth order.
pub(crate) const SIXTH: [f64; 3] = [45.0 / 60.0, -9.0 / 60.0, 1.0 / 60.0];

/// Weights of the values at ±1 … ±4 steps, eighth order.
const EIGHTH: [f64; 4] = [4.0 / 5.0, -1.0 / 5.0, 4.0 / 105.0, -1.0 / 280.0];

/// The step of an eighth-order difference, relative to the scale on which the fastest quantity changes. A rounding
/// error of 1e-15 gives an error of about 1e-12 of the derivative, and the truncation error is smaller.
pub(crate) const PART: f64 = 4e-3;

/// The relative difference of two orders below which no shorter step is tried.
pub(crate) const WELL_KNOWN: f64 = 1e-9;

/// The steps that are tried, relative to the first.
pub(crate) const NEARER: [f64; 3] = [1.0, 0.25, 0.0625];

/// Whether the value of a parameter is so small that its relative changes have no effect, as a drag coefficient of
/// 1e-20: setting it to zero would change a quantity of the given size by `moved`, and fractions of this are rounding
/// errors.
pub(crate) fn is_next_to_zero(parameter: f64, (moved, size): (f64, f64)) -> bool {
    const SEEN: f64 = 1e-4;

    parameter != 0.0 && moved <= SEEN * size
}

/// Weights of the values at ±1 and ±2 steps, fourth order.
const FOURTH: [f64; 2] = [8.0 / 12.0, -1.0 / 12.0];

/// The derivative at zero by sixth-order differences; the step is reduced if fourth order disagrees, as for a function
/// that varies much within it.
pub(crate) fn derivative(distance: f64, mut f: impl FnMut(f64) -> f64) -> f64 {
    estimated(distance, &mut f).1
}

/// The same with a long step, suited to functions that add numbers of order one to a small argument, or with a short
/// one, a fraction of that argument, whichever has the smaller rounding error.
pub(crate) fn derivative_of_either(distances: [f64; 2], mut f: impl FnMut(f64) -> f64) -> f64 {
    of_either(distances, &mut f)
}

/// [`derivative_of_either`], compiled once for all functions.
fn of_either([long, short]: [f64; 2], f: &mut dyn FnMut(f64) -> f64) -> f64 {
    /// The largest estimated relative error of a derivative that is more than rounding error.
    const KNOWN: f64 = 1e-3;

    let (error, slope) = estimated(long, f);
    let is_shorter = short > 0.0 && short < long;
    if error <= WELL_KNOWN * slope.abs() || !is_shorter {
        return slope;
    }
    let (nearer_error, nearer) = estimated(short, f);
    // Relative to the derivative: for a function that oscillates within the long step, absolute differences are small.
    let (part, nearer_part) = (error / slope.abs(), nearer_error / nearer.abs());
    let is_better = nearer_part < KNOWN && nearer_part < part;
    if is_better || !slope.is_finite() {
        nearer
    } else {
        slope
    }
}

/// The step closest to a given one that is exact at a time, at least one ulp of the time: at large times steps are
/// rounded, and so are differences.
pub(crate) fn resolved(distance: f64, time: f64) -> f64 {
    let moved = (time + distance) - time;
    if moved == 0.0 {
        time.next_up() - time
    } else {
        moved
    }
}

/// The derivative of a function of time that may vary on any time scale. Steps, the first of which is about `first`
/// near time one, decrease until two successive ones agree: a single one may be a multiple of the period of the
/// function, which would then seem constant.
pub(crate) fn derivative_by_time(first: f64, time: f64, f: &mut dyn FnMut(f64) -> f64) -> f64 {
    /// The ratio of successive steps; not a simple fraction either.
    const NEXT: f64 = 0.291;
    /// Down to about 1e-12 of the first step.
    const TRIALS: i32 = 24;
    /// The relative difference of two derivatives that agree.
    const SAME: f64 = 1e-6;

    if !time.is_finite() {
        return f64::NAN;
    }
    // At large times the argument is rounded inside the function.
    let first = first * time.abs().max(1.0).cbrt();
    let (mut known, mut best) = (None, (f64::INFINITY, f64::NAN));
    for shorter in 0..TRIALS {
        let distance = resolved(first * NEXT.powi(shorter), time);
        let Difference {
            sixth,
            off,
            roundings,
        } = Difference::over(distance, &mut |s| f(time + s));
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

/// The derivative at zero by sixth-order differences, its difference from fourth order, and its rounding error.
struct Difference {
    sixth: f64,
    off: f64,
    roundings: f64,
}

impl Difference {
    fn over(distance: f64, f: &mut dyn FnMut(f64) -> f64) -> Self {
        /// The relative rounding error of a function that is assumed in differences.
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

/// An error estimate of a derivative, and the derivative.
fn estimated(distance: f64, f: &mut dyn FnMut(f64) -> f64) -> (f64, f64) {
    /// The number of steps that are tried, each a quarter of the previous one, down to 1e-12 of the first.
    const SHORTER: i32 = 20;

    let mut best = (f64::INFINITY, f64::NAN);
    for shorter in 0..=SHORTER {
        let distance = distance * 0.25_f64.powi(shorter);
        let Difference {
            sixth,
            off,
            roundings,
        } = Difference::over(distance, f);
        if off <= (WELL_KNOWN * sixth.abs()).max(roundings) {
            return (off.max(roundings), sixth);
        }
        if off < best.0 || best.1.is_nan() {
            best = (off, sixth);
        }
    }
    best
}

/// A point at which the function is evaluated, with the weights of the value in the derivatives of eighth and of sixth
/// order.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place {
    pub(crate) shift: f64,
    pub(crate) eighth: f64,
    pub(crate) sixth: f64,
}

/// The points of differences with a given step.
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

    /// Waves of a second and of a microsecond, at early times and at 1e9 s; and a jump closer than any usual step.
    #[test]
    fn derivatives_by_the_time_are_those_of_its_own_scale() {
        let pi = std::f64::consts::PI;
        for (rate, time, allowed) in [
            (1.0, 0.3, 1e-11),
            (1.0, 1e9 + 0.5, 1e-9),
            (500.0 * pi, 0.3, 1e-10),
            (2e6 * pi, 3.2e-7, 1e-9),
            // The phase 3e6 has a rounding error of about 3e-10.
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
            // With the step 1e-10, the rounding error of a number close to eight gives 1e-5.
            assert!((found - slope).abs() < 1e-4, "{found} for {slope}");
        }
        let constant = |time: f64, value: f64| derivative_by_time(1e-3, time, &mut |_| value);
        assert_eq!(constant(2.0, 1.0), 0.0);
        assert!(constant(f64::NAN, 1.0).is_nan() && constant(1.0, f64::NAN).is_nan());
    }
}
