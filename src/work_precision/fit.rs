//! Fits a power law to a curve of errors.

use crate::numbers::larger;

/// The observed order of convergence: the power k of the step size h by which the error e falls.
///
/// It is fitted by least squares to the logarithms, log e = c + k log h, over the points that follow a power law:
/// below a tenth of the scale, well above the [floor](super::Curve::floor) and above the uncertainty of the reference.
/// The coarsest of them are left out until the line fits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slope {
    /// The exponent k of error ~ hᵏ.
    pub exponent: f64,
    /// The number of points of the fit. With two, the exponent is a quotient rather than a fit.
    pub points: usize,
    /// The largest distance of a point from the line, in powers of ten.
    pub residual: f64,
}

/// Runs with larger errors have lost the motion.
const LOST: f64 = 0.1;
/// The highest floor: above this, a curve is flat because steps do not resolve the motion.
const HIGHEST_FLOOR: f64 = 1e-3;
/// The least ratio of errors of the power law to the floor.
const ABOVE_FLOOR: f64 = 10.0;
/// The largest deviation of a point from the line, in decades.
const STRAIGHT: f64 = 0.1;

/// The error floor that shorter steps do not reduce: the least error from where the errors decrease more slowly than √h
/// to every later point. `errors`: (step, error), the longest step first.
pub(super) fn floor(errors: &[(f64, f64)]) -> Option<f64> {
    let (start, _) = plateau(errors)?;
    errors[start..]
        .iter()
        .map(|(_, error)| *error)
        .reduce(f64::min)
}

/// The index at which the plateau begins, and the error there.
fn plateau(errors: &[(f64, f64)]) -> Option<(usize, f64)> {
    let is_flat = |i: usize| {
        let (h, error) = errors[i];
        let later = &errors[i + 1..];
        error <= HIGHEST_FLOOR
            && !later.is_empty()
            && later
                .iter()
                .all(|(shorter, later)| *later >= error * (shorter / h).sqrt())
    };
    (0..errors.len())
        .find(|i| is_flat(*i))
        .map(|i| (i, errors[i].1))
}

/// The slope of a curve whose reference has the error `uncertainty`. `errors`: (step, error), the longest step first.
pub(super) fn slope(errors: &[(f64, f64)], uncertainty: f64) -> Option<Slope> {
    let (end, level) = plateau(errors).unwrap_or((errors.len(), 0.0));
    let least = ABOVE_FLOOR * level.max(uncertainty);
    let logarithms: Vec<(f64, f64)> = errors[..end]
        .iter()
        .filter(|(_, error)| *error > least && *error < LOST)
        .map(|(h, error)| (h.log10(), error.log10()))
        .collect();
    let mut points = logarithms.as_slice();
    loop {
        let slope = line(points)?;
        if slope.residual <= STRAIGHT || points.len() <= 3 {
            return Some(slope);
        }
        points = &points[1..];
    }
}

/// The least-squares line; `None` for fewer than two different steps.
fn line(points: &[(f64, f64)]) -> Option<Slope> {
    let count = points.len() as f64;
    let mean = |part: fn(&(f64, f64)) -> f64| points.iter().map(part).sum::<f64>() / count;
    let (x, y) = (mean(|point| point.0), mean(|point| point.1));
    let products = points.iter().map(|point| (point.0 - x) * (point.1 - y));
    let squares = points.iter().map(|point| (point.0 - x).powi(2));
    let exponent = products.sum::<f64>() / squares.sum::<f64>();
    let distance = |point: &(f64, f64)| (point.1 - y - exponent * (point.0 - x)).abs();
    let residual = points.iter().map(distance).fold(0.0, larger);
    (points.len() >= 2 && exponent.is_finite()).then_some(Slope {
        exponent,
        points: points.len(),
        residual,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn halved(count: i32) -> impl Iterator<Item = f64> {
        (0..count).map(|k| 0.5_f64.powi(k))
    }

    #[test]
    fn a_power_above_a_floor() {
        // 0.3 h⁴ down to 1e-10, where rounding errors dominate.
        let errors: Vec<_> = halved(14)
            .map(|h| (h, 0.3 * h.powi(4) + 1e-10 / h.sqrt().sqrt()))
            .collect();
        let slope = slope(&errors, 1e-16).unwrap();
        assert!((slope.exponent - 4.0).abs() < 0.02, "{slope:?}");
        assert!(slope.points >= 4);
        let floor = floor(&errors).unwrap();
        assert!((1e-10..1e-9).contains(&floor), "{floor:e}");
    }

    #[test]
    fn without_a_floor_or_a_power() {
        let errors: Vec<_> = halved(6).map(|h| (h, 0.05 * h * h)).collect();
        assert_eq!(floor(&errors), None);
        let found = slope(&errors, 0.0).unwrap();
        assert!((found.exponent - 2.0).abs() < 1e-12 && found.points == 6);
        // Below the uncertainty of the reference, and where the motion is lost, nothing can be fitted.
        assert_eq!(slope(&errors, 1.0), None);
        let lost: Vec<_> = halved(6).map(|h| (h, 0.7)).collect();
        assert_eq!((slope(&lost, 0.0), floor(&lost)), (None, None));
        assert_eq!((slope(&[], 0.0), floor(&[])), (None, None));
        assert_eq!(slope(&[(0.1, 1e-3), (0.1, 1e-3)], 0.0), None);
    }

    #[test]
    fn coarse_points_off_the_line_are_left_out() {
        let mut errors: Vec<_> = halved(7).map(|h| (h, 0.01 * h.powi(6))).collect();
        errors[0].1 = 0.09;
        let slope = slope(&errors, 1e-18).unwrap();
        assert!((slope.exponent - 6.0).abs() < 1e-9 && slope.points == 6);
    }
}
