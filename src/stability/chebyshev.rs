//! Polynomial interpolation at Chebyshev points, its critical points, and bracketed roots.

use std::convert::Infallible;
use std::f64::consts::PI;

/// Degree of the interpolants.
pub(super) const DEGREE: usize = 16;

/// The number of trailing coefficients that estimate the truncation error: two, since every other coefficient of an
/// even or odd function is zero.
const TAIL: usize = 2;

/// cos(jπ/n) for j = 0..2n, for the points and the cosine transform.
fn cosines() -> [f64; 2 * DEGREE] {
    std::array::from_fn(|j| (PI * j as f64 / DEGREE as f64).cos())
}

/// The n + 1 Chebyshev points of [start, end] in ascending order; both ends are exact.
pub(super) fn points(start: f64, end: f64) -> [f64; DEGREE + 1] {
    let cosines = cosines();
    let (middle, half) = (f64::midpoint(start, end), 0.5 * (end - start));
    std::array::from_fn(|j| match j {
        0 => start,
        DEGREE => end,
        _ => middle - half * cosines[j],
    })
}

/// A Chebyshev series Σ c_k T_k(x) on [start, end]; x in [−1, 1] is the affine image of the argument.
#[derive(Clone, Debug)]
pub(super) struct Series {
    start: f64,
    end: f64,
    coefficients: Vec<f64>,
}

impl Series {
    /// The interpolant of degree n through values at [`points`].
    ///
    /// ```text
    /// c_k = (2/n) Σ″ f_j cos(jkπ/n),   first and last term of the sum halved, c_0 and c_n halved
    /// ```
    pub(super) fn through(start: f64, end: f64, values: &[f64; DEGREE + 1]) -> Self {
        let cosines = cosines();
        let coefficients = (0..=DEGREE)
            .map(|k| {
                let sum: f64 = (0..=DEGREE)
                    .map(|j| {
                        // The points ascend, but the transform counts them from +1 downward.
                        let term = values[DEGREE - j] * cosines[(j * k) % (2 * DEGREE)];
                        if j == 0 || j == DEGREE {
                            0.5 * term
                        } else {
                            term
                        }
                    })
                    .sum();
                let scale = if k == 0 || k == DEGREE { 1.0 } else { 2.0 };
                scale * sum / DEGREE as f64
            })
            .collect();
        Self {
            start,
            end,
            coefficients,
        }
    }

    /// The largest of the last coefficients: an estimate of the truncation error.
    pub(super) fn tail(&self) -> f64 {
        self.coefficients
            .iter()
            .rev()
            .take(TAIL)
            .fold(0.0, |most, c| c.abs().max(most))
    }

    /// The value at a point of the interval.
    pub(super) fn evaluate(&self, at: f64) -> f64 {
        let x = (2.0 * at - self.start - self.end) / (self.end - self.start);
        clenshaw(&self.coefficients, x.clamp(-1.0, 1.0))
    }

    /// The points inside the interval where the derivative changes its sign, ascending.
    ///
    /// Trailing coefficients below `noise` are dropped first: they are rounding errors and would give spurious points.
    pub(super) fn critical_points(&self, noise: f64) -> Vec<f64> {
        let significant = self
            .coefficients
            .iter()
            .rposition(|c| c.abs() > noise)
            .map_or(0, |last| last + 1);
        let derivative = derivative(&self.coefficients[..significant]);
        let (middle, half) = (
            f64::midpoint(self.start, self.end),
            0.5 * (self.end - self.start),
        );
        sign_changes(derivative)
            .into_iter()
            .map(|x| middle + half * x)
            .collect()
    }
}

/// Σ c_k T_k(x) by Clenshaw's recurrence.
fn clenshaw(coefficients: &[f64], x: f64) -> f64 {
    let (mut next, mut after) = (0.0, 0.0);
    for &c in coefficients.iter().skip(1).rev() {
        (next, after) = (2.0 * x * next - after + c, next);
    }
    x * next - after + coefficients.first().unwrap_or(&0.0)
}

/// The derivative in x: d_{k−1} = d_{k+1} + 2k c_k, d_0 halved.
fn derivative(coefficients: &[f64]) -> Vec<f64> {
    let degree = coefficients.len().saturating_sub(1);
    let mut result = vec![0.0; degree];
    for k in (1..=degree).rev() {
        let above = result.get(k + 1).copied().unwrap_or(0.0);
        result[k - 1] = above + 2.0 * k as f64 * coefficients[k];
    }
    if let Some(first) = result.first_mut() {
        *first *= 0.5;
    }
    result
}

/// All sign changes of a series in (−1, 1), ascending.
///
/// The sign changes of each derivative divide [−1, 1] into intervals on which the preceding derivative is monotonic and
/// has at most one root. Starting from the linear derivative, no root can be missed, however close two of them are.
fn sign_changes(series: Vec<f64>) -> Vec<f64> {
    let mut derivatives = vec![series];
    while let Some(last) = derivatives.last().filter(|last| last.len() > 2) {
        derivatives.push(derivative(last));
    }
    let mut roots: Vec<f64> = Vec::new();
    for series in derivatives.iter().rev() {
        let ends: Vec<f64> = [-1.0].into_iter().chain(roots).chain([1.0]).collect();
        roots =
            ends.windows(2)
                .filter_map(|piece| {
                    let (left, right) = (
                        (piece[0], clenshaw(series, piece[0])),
                        (piece[1], clenshaw(series, piece[1])),
                    );
                    (left.1 * right.1 < 0.0 || (left.1 != 0.0 && right.1 == 0.0 && right.0 < 1.0))
                        .then(|| {
                            let Ok(root) = bracketed_root(
                                |x| Ok::<_, Infallible>(clenshaw(series, x)),
                                left,
                                right,
                            );
                            root
                        })
                })
                .collect();
    }
    roots
}

/// A root between two points (x, f(x)) of opposite signs, by Brent's method, to full precision.
///
/// An end at which f is zero is returned itself.
pub(crate) fn bracketed_root<E>(
    mut function: impl FnMut(f64) -> Result<f64, E>,
    start: (f64, f64),
    end: (f64, f64),
) -> Result<f64, E> {
    // The names are those of Brent (1973): b is the best point, a the previous one, c the point on the other side of
    // the root.
    let ((mut a, mut fa), (mut b, mut fb)) = (start, end);
    let (mut c, mut fc) = (a, fa);
    let (mut step, mut before) = (b - a, b - a);
    for _ in 0..MAX_STEPS {
        if (fb > 0.0) == (fc > 0.0) && fc != 0.0 {
            (c, fc) = (a, fa);
            step = b - a;
            before = step;
        }
        if fc.abs() < fb.abs() {
            (a, fa, b, fb, c, fc) = (b, fb, c, fc, b, fb);
        }
        let tolerance = 2.0 * f64::EPSILON * b.abs() + f64::MIN_POSITIVE;
        let half = 0.5 * (c - b);
        if half.abs() <= tolerance || fb == 0.0 {
            break;
        }
        if before.abs() < tolerance || fa.abs() <= fb.abs() {
            (step, before) = (half, half);
        } else {
            let s = fb / fa;
            let (mut p, q) = if a == c {
                (2.0 * half * s, 1.0 - s)
            } else {
                let (q, r) = (fa / fc, fb / fc);
                (
                    s * (2.0 * half * q * (q - r) - (b - a) * (r - 1.0)),
                    (q - 1.0) * (r - 1.0) * (s - 1.0),
                )
            };
            let q = if p > 0.0 { -q } else { q };
            p = p.abs();
            if 2.0 * p < (3.0 * half * q - (tolerance * q).abs()).min((before * q).abs()) {
                (before, step) = (step, p / q);
            } else {
                (step, before) = (half, half);
            }
        }
        (a, fa) = (b, fb);
        b += if step.abs() > tolerance {
            step
        } else {
            tolerance.copysign(half)
        };
        fb = function(b)?;
    }
    Ok(b)
}

/// Limit of the steps. Brent's method usually needs about a dozen; in the worst case it could need about a thousand.
const MAX_STEPS: usize = 200;

#[cfg(test)]
mod tests {
    use super::*;

    fn series(start: f64, end: f64, f: impl Fn(f64) -> f64) -> Series {
        Series::through(start, end, &points(start, end).map(f))
    }

    #[test]
    fn interpolates_what_it_resolves_and_says_so() {
        let smooth = series(1.0, 3.0, |x| (2.0 * x).sin());
        assert!(smooth.tail() < 1e-12);
        assert!((smooth.evaluate(2.345) - 4.69_f64.sin()).abs() < 1e-12);
        assert!((smooth.evaluate(1.0) - 2.0_f64.sin()).abs() < 1e-14);
        assert!(series(1.0, 3.0, |x| (x - 2.1).abs()).tail() > 1e-3);
        assert!(series(-1.0, 1.0, |x| 1.0 / (1.0 + 100.0 * x * x)).tail() > 1e-3);
    }

    #[test]
    fn finds_every_critical_point() {
        let found = series(0.0, 5.0, |x| (x * x - 5.0 * x).sin()).critical_points(1e-12);
        // x² − 5x = −π/2, −3π/2, and the middle.
        let roots = |c: f64| [2.5 - (6.25 + c).sqrt(), 2.5 + (6.25 + c).sqrt()];
        let mut expected: Vec<f64> = [-0.5 * PI, -1.5 * PI]
            .into_iter()
            .flat_map(roots)
            .chain([2.5])
            .collect();
        expected.sort_by(f64::total_cmp);
        assert_eq!(found.len(), 5);
        for (found, expected) in found.iter().zip(expected) {
            assert!((found - expected).abs() < 1e-3, "{found} {expected}"); // degree 16 does not resolve this one fully
        }
    }

    #[test]
    fn separates_critical_points_that_nearly_coincide() {
        let gap = 1e-4;
        let found = series(-1.0, 1.0, |x| x * x * x / 3.0 - gap * gap * x).critical_points(1e-14);
        assert_eq!(found.len(), 2);
        assert!((found[0] + gap).abs() < 1e-9 && (found[1] - gap).abs() < 1e-9);
    }

    #[test]
    fn constants_have_no_critical_points() {
        assert!(series(0.0, 1.0, |_| 3.0).critical_points(1e-14).is_empty());
        assert!(series(0.0, 1.0, |_| 0.0).critical_points(0.0).is_empty());
    }

    #[test]
    fn roots_to_the_last_digits() {
        let cube = |x: f64| Ok::<_, Infallible>(x * x * x - 2.0);
        let Ok(root) = bracketed_root(cube, (0.0, -2.0), (5.0, 123.0));
        assert!((root - 2.0_f64.cbrt()).abs() <= 4.0 * f64::EPSILON);
        let Ok(flat) = bracketed_root(
            |x: f64| Ok::<_, Infallible>((x - 1.0).powi(9)),
            (0.0, -1.0),
            (4.0, 3.0_f64.powi(9)),
        );
        assert!((flat - 1.0).abs() < 1e-12);
        assert_eq!(
            bracketed_root(|_| Err::<f64, _>("broken"), (0.0, -1.0), (1.0, 1.0)),
            Err("broken")
        );
    }
}
