//! The eigenvalues of a 2 × 2 block.

use super::arithmetic::{Scaled, exponent, times_power_of_two};
use super::chain::Chain;
use super::error::PeriodicSchurError;
use nalgebra::Complex;

type C = Complex<f64>;

const ZERO: C = C::new(0.0, 0.0);

/// The largest number of QR steps; two are usual.
const STEPS: u32 = 60;

/// The two eigenvalues of the 2 × 2 block that starts at this row: conjugate with the positive argument first, or both
/// real.
///
/// Computed from the trace of the product they would lose their arguments if the product is much larger than its
/// eigenvalues. Therefore unitary rotations make the block triangular in all factors, as the orthogonal transformations
/// do for the whole chain.
pub(super) fn eigenvalues(chain: &Chain, row: usize) -> Result<[Scaled; 2], PeriodicSchurError> {
    let mut blocks: Vec<[[C; 2]; 2]> = (0..=chain.last())
        .map(|factor| {
            [0, 1].map(|i| [0, 1].map(|j| C::new(chain.at(factor, row + i, row + j), 0.0)))
        })
        .collect();
    let Some((last, triangular)) = blocks.split_last_mut() else {
        return Err(PeriodicSchurError::Empty);
    };
    let mut iterations = 0;
    while size(last[1][0]) > f64::EPSILON * (size(last[0][0]) + size(last[1][1])) {
        if iterations == STEPS {
            return Err(PeriodicSchurError::NoConvergence {
                first: row,
                last: row + 1,
                iterations,
            });
        }
        iterations += 1;
        step(last, triangular);
    }
    let products = [0, 1].map(|i| {
        let mut product = Scaled {
            exponent: chain.exponent(),
            ..Scaled::ONE
        };
        for block in &blocks {
            product.multiply(block[i][i]);
        }
        product
    });
    Ok(conjugates_or_reals(products))
}

/// The two eigenvalues of a real matrix, corrected for rounding errors to be exactly conjugate or real.
fn conjugates_or_reals(products: [Scaled; 2]) -> [Scaled; 2] {
    let common = products
        .iter()
        .map(|z| z.exponent + exponent(size(z.mantissa)))
        .max()
        .unwrap_or(0);
    let [z, w] = products.map(|z| z.mantissa_for(common));
    if size(z - w.conj()) <= 0.5 * size(z - w) {
        let mean = (z + w.conj()) * 0.5;
        let upper = C::new(mean.re, mean.im.abs());
        return [upper, upper.conj()].map(|mantissa| Scaled {
            mantissa,
            exponent: common,
        });
    }
    products.map(|z| {
        let modulus = z.mantissa.re.hypot(z.mantissa.im).copysign(z.mantissa.re);
        Scaled {
            mantissa: C::new(modulus, 0.0),
            ..z
        }
    })
}

/// One QR step; the shift is the eigenvalue of the product closest to its last entry.
fn step(last: &mut [[C; 2]; 2], triangular: &mut [[[C; 2]; 2]]) {
    let [[a, b], [c, d]] = product(last, triangular);
    let half = (a - d) * 0.5;
    let root = (half * half + b * c).sqrt();
    let denominator = if size(half + root) >= size(half - root) {
        half + root
    } else {
        half - root
    };
    let shift = if denominator == ZERO {
        d
    } else {
        d - b * c / denominator
    };
    let mut rotation = Unitary::new(a - shift, c).0;
    rotation.rows(last);
    for block in triangular {
        rotation.columns(block);
        let (next, r) = Unitary::new(block[0][0], block[1][0]);
        next.rows(block);
        (block[0][0], block[1][0]) = (r, ZERO);
        rotation = next;
    }
    rotation.columns(last);
}

/// A multiple of the product.
fn product(last: &[[C; 2]; 2], triangular: &[[[C; 2]; 2]]) -> [[C; 2]; 2] {
    // The columns of the product of the triangular blocks, each with an exponent.
    let mut columns = [
        ([C::new(1.0, 0.0), ZERO], 0i64),
        ([ZERO, C::new(1.0, 0.0)], 0),
    ];
    let rescale = |(u, shift): &mut ([C; 2], i64)| {
        let most = size(u[0]).max(size(u[1]));
        if most > 0.0 && !(1e-6..1e2).contains(&most) {
            let e = exponent(most);
            *u = u.map(|u| C::new(times_power_of_two(u.re, -e), times_power_of_two(u.im, -e)));
            *shift += e;
        }
    };
    let multiply = |block: &[[C; 2]; 2], u: &mut [C; 2]| {
        *u = [0, 1].map(|i| block[i][0] * u[0] + block[i][1] * u[1]);
    };
    for block in triangular.iter().chain([last]) {
        for column in &mut columns {
            multiply(block, &mut column.0);
            rescale(column);
        }
    }
    let common = columns
        .iter()
        .map(|(u, shift)| shift + exponent(size(u[0]).max(size(u[1]))))
        .max()
        .unwrap_or(0);
    let [[a, c], [b, d]] = columns
        .map(|(u, exponent)| u.map(|mantissa| Scaled { mantissa, exponent }.mantissa_for(common)));
    [[a, b], [c, d]]
}

/// The larger modulus of real and imaginary part: within √2 of the modulus, and safe from overflow.
fn size(z: C) -> f64 {
    z.re.abs().max(z.im.abs())
}

/// The unitary matrix (x −ȳ; y x̄) with |x|² + |y|² = 1.
#[derive(Clone, Copy)]
struct Unitary {
    x: C,
    y: C,
}

impl Unitary {
    /// The matrix whose adjoint maps (x, y) to (r, 0), and r.
    fn new(x: C, y: C) -> (Self, C) {
        let most = size(x).max(size(y));
        if y == ZERO || most == 0.0 {
            return (
                Self {
                    x: C::new(1.0, 0.0),
                    y: ZERO,
                },
                x,
            );
        }
        let (x, y) = (x / most, y / most);
        let norm = (x.norm_sqr() + y.norm_sqr()).sqrt();
        (
            Self {
                x: x / norm,
                y: y / norm,
            },
            C::new(norm * most, 0.0),
        )
    }

    /// Multiplies by the adjoint from the left.
    fn rows(self, block: &mut [[C; 2]; 2]) {
        for j in 0..2 {
            let (p, q) = (block[0][j], block[1][j]);
            block[0][j] = self.x.conj() * p + self.y.conj() * q;
            block[1][j] = self.x * q - self.y * p;
        }
    }

    /// Multiplies from the right.
    fn columns(self, block: &mut [[C; 2]; 2]) {
        for row in block {
            let [p, q] = *row;
            *row = [
                self.x * p + self.y * q,
                self.x.conj() * q - self.y.conj() * p,
            ];
        }
    }
}
