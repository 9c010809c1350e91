//! Polynomials on the unit interval: shifted Legendre polynomials and Lagrange shape functions.
//!
//! The Legendre polynomials P_j(2τ − 1) are orthogonal on \[0, 1\] with ∫ P_j² dτ = 1/(2j + 1). Trial
//! and test spaces of an element are written in them, because their inertia matrix
//! ∫ P_j P_i' dτ has integer entries; shape functions serve the nodal forms.

use crate::double_double::DoubleDouble;

/// The largest number of nodes of an element.
pub const MAX_NODES: usize = 12;

/// The largest number of coefficients of a rate: degree s − 1 ≤ 10.
pub const MAX_RATES: usize = MAX_NODES - 1;

/// An upper bound of |∫₀^τ P_k(2σ − 1) dσ|: 1/(2k + 1), because |P_{k+1} − P_{k−1}| ≤ 2.
#[cfg(feature = "alloc")]
pub(crate) const INTEGRAL_BOUNDS: [f64; MAX_NODES] = {
    let mut most = [1.0; MAX_NODES];
    let mut k = 1;
    while k < MAX_NODES {
        most[k] = 1.0 / (2 * k + 1) as f64;
        k += 1;
    }
    most
};

/// Fills `values[j]` with P_j(2τ − 1).
pub const fn legendre(tau: f64, values: &mut [f64]) {
    let x = 2.0 * tau - 1.0;
    let (mut before, mut value) = (0.0, 1.0);
    let mut j = 0;
    while j < values.len() {
        values[j] = value;
        let degree = j as f64;
        let next = ((2.0 * degree + 1.0) * x * value - degree * before) / (degree + 1.0);
        before = value;
        value = next;
        j += 1;
    }
}

/// Fills `values[j]` with ∫₀^τ P_j(2σ − 1) dσ.
///
/// ∫ P_j = (P_{j+1} − P_{j−1})/(2(2j + 1)), with P_{−1} = −1: all but the first vanish at τ = 1.
pub fn legendre_integrals(tau: f64, values: &mut [f64]) {
    let x = 2.0 * tau - 1.0;
    let (mut before, mut value) = (-1.0, 1.0);
    for (j, slot) in values.iter_mut().enumerate() {
        let degree = j as f64;
        // The recurrence multiplies P_{−1} by zero: its value does not matter there.
        let next = ((2.0 * degree + 1.0) * x * value - degree * before) / (degree + 1.0);
        *slot = (next - before) / (2.0 * (2.0 * degree + 1.0));
        before = value;
        value = next;
    }
}

/// P_j′(2τ − 1) for j below `degree`, the derivatives by the argument; those by τ are twice as large.
///
/// P_j′ = P_{j−2}′ + (2j − 1) P_{j−1}
#[must_use]
pub fn legendre_slopes(tau: f64, degree: usize) -> [f64; MAX_RATES] {
    let x = 2.0 * tau - 1.0;
    let (mut values, mut slopes) = ([1.0, x], [0.0; MAX_RATES]);
    for j in 1..degree.min(MAX_RATES) {
        let before = if j >= 2 { slopes[j - 2] } else { 0.0 };
        slopes[j] = before + (2 * j - 1) as f64 * values[0];
        let next = ((2 * j + 1) as f64 * x * values[1] - j as f64 * values[0]) / (j + 1) as f64;
        values = [values[1], next];
    }
    slopes
}

/// Fills `values[i]` with the shape function of node i at τ: Π_{j≠i} (τ − τ_j)/(τ_i − τ_j).
///
/// The nodes must differ from one another; they need not lie in the interval.
pub fn shape_functions(nodes: &[f64], tau: f64, values: &mut [f64]) {
    for (i, slot) in values.iter_mut().enumerate().take(nodes.len()) {
        *slot = 1.0;
        for (j, node) in nodes.iter().enumerate() {
            if j != i {
                *slot *= (tau - node) / (nodes[i] - node);
            }
        }
    }
}

/// Fills `slopes[i]` with the derivative dN_i/dτ of the shape function of node i.
pub fn shape_slopes(nodes: &[f64], tau: f64, slopes: &mut [f64]) {
    for (i, slot) in slopes.iter_mut().enumerate().take(nodes.len()) {
        // The product rule, term by term: no division by τ − τ_j, hence valid at nodes too.
        *slot = 0.0;
        for m in 0..nodes.len() {
            if m == i {
                continue;
            }
            let mut term = 1.0 / (nodes[i] - nodes[m]);
            for (j, node) in nodes.iter().enumerate() {
                if j != i && j != m {
                    term *= (tau - node) / (nodes[i] - node);
                }
            }
            *slot += term;
        }
    }
}

/// P_{j+1} at x from P_j and P_{j−1}, in twice the precision: (j + 1) P_{j+1} = (2j + 1) x P_j − j P_{j−1}.
pub(crate) const fn next_legendre(
    j: usize,
    x: DoubleDouble,
    value: DoubleDouble,
    before: DoubleDouble,
) -> DoubleDouble {
    DoubleDouble::integer(2 * j + 1)
        .times(x.times(value))
        .minus(DoubleDouble::integer(j).times(before))
        .over(DoubleDouble::integer(j + 1))
}

/// P_j in twice the precision, for all j below the length of `values`.
pub(crate) const fn exact_legendre(tau: DoubleDouble, values: &mut [DoubleDouble]) {
    let x = tau.plus(tau).minus(DoubleDouble::ONE);
    let (mut before, mut value) = (DoubleDouble::ZERO, DoubleDouble::ONE);
    let mut j = 0;
    while j < values.len() {
        values[j] = value;
        let next = next_legendre(j, x, value, before);
        before = value;
        value = next;
        j += 1;
    }
}

/// ∫₀^τ P_j in twice the precision; needs `polynomials` up to one degree more than `values`.
pub(crate) const fn exact_integrals(polynomials: &[DoubleDouble], values: &mut [DoubleDouble]) {
    let mut j = 0;
    while j < values.len() {
        let before = if j == 0 {
            DoubleDouble::ONE.negated()
        } else {
            polynomials[j - 1]
        };
        values[j] = polynomials[j + 1]
            .minus(before)
            .over(DoubleDouble::integer(2 * (2 * j + 1)));
        j += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quadrature::Quadrature;

    #[test]
    fn legendre_polynomials_are_orthogonal() {
        let rule = Quadrature::gauss(12);
        for i in 0..12 {
            for j in 0..12 {
                let mut sum = 0.0;
                for l in 0..rule.len() {
                    let mut values = [0.0; 12];
                    legendre(rule.node(l), &mut values);
                    sum += rule.weight(l) * values[i] * values[j];
                }
                let exact = if i == j {
                    1.0 / (2 * i + 1) as f64
                } else {
                    0.0
                };
                assert!((sum - exact).abs() < 16.0 * f64::EPSILON);
            }
        }
    }

    #[test]
    fn integrals_are_integrals() {
        let rule = Quadrature::gauss(8);
        for tau in [0.0, 0.2, 0.7, 1.0, 1.6] {
            let mut integrals = [0.0; 9];
            legendre_integrals(tau, &mut integrals);
            for (j, integral) in integrals.iter().enumerate() {
                let mut sum = 0.0;
                for l in 0..rule.len() {
                    let mut values = [0.0; 9];
                    legendre(tau * rule.node(l), &mut values);
                    sum += tau * rule.weight(l) * values[j];
                }
                // Beyond the interval the polynomials grow like (2x)^j.
                assert!((sum - integral).abs() < 1e-14 * (1.0 + 5.0_f64.powi(j as i32) * tau));
            }
        }
    }

    /// P_1′ = 1, P_2′ = 3x, P_3′ = (15x² − 3)/2, P_4′ = (35x³ − 15x)/2, and the values at the ends j(j + 1)/2.
    #[test]
    fn slopes_are_derivatives_of_legendre_polynomials() {
        for tau in [0.0, 0.3, 0.5, 0.9, 1.0, 1.6] {
            let x = 2.0 * tau - 1.0;
            let square = x * x;
            let exact = [
                0.0,
                1.0,
                3.0 * x,
                0.5 * (15.0 * square - 3.0),
                0.5 * x * (35.0 * square - 15.0),
            ];
            let slopes = legendre_slopes(tau, exact.len());
            for (slope, exact) in slopes.iter().zip(exact) {
                // A few roundings of terms of up to 20 within the interval, and of up to 200 beyond it.
                assert!((slope - exact).abs() <= 200.0 * f64::EPSILON * (1.0 + exact.abs()));
            }
            assert!(slopes[exact.len()..].iter().all(|slope| *slope == 0.0));
        }
        let (start, end) = (
            legendre_slopes(0.0, MAX_RATES),
            legendre_slopes(1.0, MAX_RATES),
        );
        for j in 0..MAX_RATES {
            let size = (j * (j + 1)) as f64 / 2.0;
            let sign = if j.is_multiple_of(2) { -1.0 } else { 1.0 };
            assert_eq!((start[j], end[j]), (sign * size, size));
        }
    }

    #[test]
    fn twice_the_precision_agrees_with_once() {
        let tau = DoubleDouble::new(0.3);
        let mut exact = [DoubleDouble::ZERO; 9];
        exact_legendre(tau, &mut exact);
        let mut integrals = [DoubleDouble::ZERO; 8];
        exact_integrals(&exact, &mut integrals);
        let (mut values, mut sums) = ([0.0; 9], [0.0; 8]);
        legendre(0.3, &mut values);
        legendre_integrals(0.3, &mut sums);
        for j in 0..8 {
            assert!((exact[j].high - values[j]).abs() < 4.0 * f64::EPSILON);
            assert!((integrals[j].high - sums[j]).abs() < 4.0 * f64::EPSILON);
        }
    }

    #[test]
    fn shape_functions_interpolate_and_their_slopes_differentiate() {
        let nodes = [0.0, 0.3, 0.55, 1.0];
        for tau in [0.0, 0.3, 0.41, 1.0] {
            let (mut values, mut slopes) = ([0.0; 4], [0.0; 4]);
            shape_functions(&nodes, tau, &mut values);
            shape_slopes(&nodes, tau, &mut slopes);
            let (mut cubic, mut slope) = (0.0, 0.0);
            for i in 0..4 {
                cubic += values[i] * nodes[i].powi(3);
                slope += slopes[i] * nodes[i].powi(3);
            }
            assert!((cubic - tau.powi(3)).abs() < 1e-15);
            assert!((slope - 3.0 * tau * tau).abs() < 1e-14);
        }
    }
}
