//! Numbers with a separate exponent, reflections and rotations.

use crate::numbers::norm;
use nalgebra::Complex;
use std::f64::consts::{FRAC_1_SQRT_2, LN_2};
use std::ops::Range;

/// x · 2^exponent, without intermediate overflow.
pub(crate) fn times_power_of_two(mut x: f64, exponent: i64) -> f64 {
    // A factor of 2^±2200 takes every finite number to zero or infinity.
    let mut left = exponent.clamp(-2200, 2200);
    while left != 0 {
        let part = left.clamp(-1000, 1000);
        x *= power_of_two(part);
        left -= part;
    }
    x
}

/// 2^exponent, limited to normal numbers.
pub(crate) fn power_of_two(exponent: i64) -> f64 {
    f64::from_bits(((1023 + exponent.clamp(-1022, 1023)) as u64) << 52)
}

/// The integer e with 2^e ≤ |x| < 2^(e+1) of a finite number; −1075 for zero, less than for every other number.
pub(crate) fn exponent(x: f64) -> i64 {
    let bits = |x: f64| (x.to_bits() >> 52 & 0x7ff) as i64;
    match bits(x) {
        _ if x == 0.0 => -1075,
        0 => bits(x * f64::from_bits((1023 + 60) << 52)) - 1023 - 60,
        biased => biased - 1023,
    }
}

/// The largest modulus of several numbers; zero if there are none.
pub(super) fn largest<'a>(values: impl IntoIterator<Item = &'a f64>) -> f64 {
    values.into_iter().fold(0.0, |most, x| x.abs().max(most))
}

/// max √|a_ij a_ji| of a square matrix of n rows, including the diagonal: a size that does not depend on the units of
/// the coordinates.
pub(super) fn size_in_all_units(a: &[f64], n: usize) -> f64 {
    let root = |row: usize, column: usize| a[row + column * n].abs().sqrt();
    let pairs = (0..n).flat_map(|i| (0..=i).map(move |j| (i, j)));
    pairs
        .map(|(i, j)| root(i, j) * root(j, i))
        .fold(0.0, f64::max)
}

/// The complex number mantissa · 2^exponent.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scaled {
    pub(super) mantissa: Complex<f64>,
    pub(super) exponent: i64,
}

impl Scaled {
    /// One.
    pub(super) const ONE: Self = Self {
        mantissa: Complex::new(1.0, 0.0),
        exponent: 0,
    };

    /// Multiplies by a finite number.
    pub(super) fn multiply(&mut self, factor: Complex<f64>) {
        let (factor, exponent) = normalized(factor);
        let (mantissa, more) = normalized(self.mantissa * factor);
        self.mantissa = mantissa;
        self.exponent += exponent + more;
    }

    /// The mantissa that belongs to another exponent.
    pub(super) fn mantissa_for(&self, exponent: i64) -> Complex<f64> {
        let shift = self.exponent - exponent;
        Complex::new(
            times_power_of_two(self.mantissa.re, shift),
            times_power_of_two(self.mantissa.im, shift),
        )
    }

    /// The natural logarithm of the modulus; for a modulus close to one it is as accurate as the modulus.
    pub(super) fn ln_modulus(&self) -> f64 {
        let z = self.mantissa;
        let modulus = if z.im == 0.0 {
            z.re.abs()
        } else {
            z.re.hypot(z.im)
        };
        if modulus == 0.0 {
            return f64::NEG_INFINITY;
        }
        // The mantissa is between √½ and √2, so that the two terms do not cancel.
        let mut shift = exponent(modulus);
        let mut mantissa = times_power_of_two(modulus, -shift);
        if mantissa > 2.0 * FRAC_1_SQRT_2 {
            mantissa *= 0.5;
            shift += 1;
        }
        mantissa.ln() + (self.exponent + shift) as f64 * LN_2
    }
}

/// A number as m · 2^e, with e = 0 unless a product of two such numbers could overflow or underflow.
fn normalized(z: Complex<f64>) -> (Complex<f64>, i64) {
    let size = z.re.abs().max(z.im.abs());
    if size == 0.0 || (1e-90..1e90).contains(&size) {
        return (z, 0);
    }
    let e = exponent(size);
    (
        Complex::new(times_power_of_two(z.re, -e), times_power_of_two(z.im, -e)),
        e,
    )
}

/// Overwrites x by the vector v of the reflection I − τ v vᵀ that takes x to β e₁; returns (τ, β).
///
/// v₁ = 1. If x is a multiple of e₁ already, the reflection is the identity: τ = 0, β = x₁.
pub(crate) fn reflection(x: &mut [f64]) -> (f64, f64) {
    let Some(&alpha) = x.first() else {
        return (0.0, 0.0);
    };
    if x[1..].iter().all(|&x| x == 0.0) {
        x[0] = 1.0;
        return (0.0, alpha);
    }
    let beta = -norm(x).copysign(alpha);
    for entry in &mut x[1..] {
        *entry /= alpha - beta;
    }
    x[0] = 1.0;
    ((beta - alpha) / beta, beta)
}

/// Reflects rows `row..row + v.len()` of a column-major matrix with n rows, in some of its columns.
pub(super) fn reflect_rows(
    a: &mut [f64],
    n: usize,
    row: usize,
    v: &[f64],
    tau: f64,
    columns: Range<usize>,
) {
    for column in columns {
        let start = column * n + row;
        let x = &mut a[start..start + v.len()];
        let projection = tau * x.iter().zip(v).map(|(x, v)| x * v).sum::<f64>();
        for (x, v) in x.iter_mut().zip(v) {
            *x -= projection * v;
        }
    }
}

/// Reflects columns `column..column + v.len()` of a column-major matrix with n rows, in some of its rows.
pub(super) fn reflect_columns(
    a: &mut [f64],
    n: usize,
    column: usize,
    v: &[f64],
    tau: f64,
    rows: Range<usize>,
) {
    let a = &mut a[column * n..(column + v.len()) * n];
    for row in rows {
        let projection = tau
            * a[row..]
                .iter()
                .step_by(n)
                .zip(v)
                .map(|(x, v)| x * v)
                .sum::<f64>();
        for (x, v) in a[row..].iter_mut().step_by(n).zip(v) {
            *x -= projection * v;
        }
    }
}

/// The plane rotation (c s; −s c).
#[derive(Clone, Copy, Debug)]
pub(super) struct Rotation {
    c: f64,
    s: f64,
}

impl Rotation {
    /// The rotation that takes (x, y) to (r, 0), and r; the identity if y is zero.
    pub(super) fn new(x: f64, y: f64) -> (Self, f64) {
        if y == 0.0 {
            return (Self { c: 1.0, s: 0.0 }, x);
        }
        let r = norm(&[x, y]);
        (Self { c: x / r, s: y / r }, r)
    }

    /// Rotates rows `row` and `row + 1` in some columns.
    pub(super) fn rows(self, a: &mut [f64], n: usize, row: usize, columns: Range<usize>) {
        for column in columns {
            if let [x, y] = &mut a[column * n + row..column * n + row + 2] {
                (*x, *y) = (self.c * *x + self.s * *y, self.c * *y - self.s * *x);
            }
        }
    }

    /// Rotates columns `column` and `column + 1` in some rows.
    pub(super) fn columns(self, a: &mut [f64], n: usize, column: usize, rows: Range<usize>) {
        let (left, right) = a[column * n..(column + 2) * n].split_at_mut(n);
        for (x, y) in left[rows.clone()].iter_mut().zip(&mut right[rows]) {
            (*x, *y) = (self.c * *x + self.s * *y, self.c * *y - self.s * *x);
        }
    }
}
