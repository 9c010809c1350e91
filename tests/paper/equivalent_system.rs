//! The equivalent discrete system S̃ = dA/dh A⁻¹, corrected (63), and (64), with the analogues for three nodes.

use crate::Oscillator;
use crate::common::assert_matrix;
use nalgebra::DMatrix;
use tfe::prelude::*;

/// dA/dh A⁻¹ by central differences of order six.
fn equivalent(oscillator: &Oscillator, element: Element, h: f64) -> DMatrix<f64> {
    let a = |h: f64| oscillator.transition(element, h);
    let d = 0.02 * h;
    let derivative = (a(h + d) - a(h - d)) * 45.0 - (a(h + 2.0 * d) - a(h - 2.0 * d)) * 9.0
        + (a(h + 3.0 * d) - a(h - 3.0 * d));
    let inverse = a(h).try_inverse().expect("a transition matrix is regular");
    derivative / (60.0 * d) * inverse
}

/// The truncation error is 0.02⁶ ~ 6e-11 times derivatives of order one, the rounding error 1e-16/0.02.
const TOLERANCE: f64 = 1e-8;

const CASES: [(f64, f64); 4] = [(0.3, 1.0), (1.0, 1.0), (1.0, 2.5), (2.0, 0.7)];

#[test]
fn two_nodes() {
    for (h, k) in CASES {
        let oscillator = Oscillator { m: 1.0, c: 0.0, k };
        let (w, rho) = (k.sqrt(), k.sqrt() * h);
        let d = (6.0 + rho * rho).powi(2);
        let diagonal = -3.0 * w * rho.powi(3) / d;
        let primal = DMatrix::from_row_slice(
            2,
            2,
            &[
                diagonal,
                -k * (36.0 + 3.0 * rho.powi(2) + rho.powi(4)) / d,
                (36.0 + 12.0 * rho * rho) / d,
                -diagonal,
            ],
        );
        assert_matrix(
            &equivalent(&oscillator, Primal::<2>.into(), h),
            &primal,
            TOLERANCE,
            "(63)",
        );
        let mixed = DMatrix::from_row_slice(2, 2, &[0.0, -k, 1.0, 0.0]) * (4.0 / (4.0 + rho * rho));
        assert_matrix(
            &equivalent(&oscillator, Mixed::<2>.into(), h),
            &mixed,
            TOLERANCE,
            "(64)",
        );
    }
}

#[test]
fn three_nodes() {
    for (h, k) in CASES {
        let oscillator = Oscillator { m: 1.0, c: 0.0, k };
        let (w, r) = (k.sqrt(), k.sqrt() * h);
        let d = (r.powi(4) + 16.0 * r * r + 240.0).powi(2);
        let even = r.powi(4) + 16.0 * r * r + 240.0;
        let diagonal = -8.0 * w * r.powi(5) * (r * r - 20.0) / d;
        let primal = DMatrix::from_row_slice(
            2,
            2,
            &[
                diagonal,
                -k * (even - 8.0 * r.powi(3)) * (even + 8.0 * r.powi(3)) / d,
                24.0 * (3.0 * r * r + 20.0) * (r.powi(4) - 2.0 * r * r + 120.0) / d,
                -diagonal,
            ],
        );
        assert_matrix(
            &equivalent(&oscillator, Primal::<3>.into(), h),
            &primal,
            TOLERANCE,
            "primal, three nodes",
        );
        let factor = 12.0 * (r * r + 12.0) / (r.powi(4) + 12.0 * r * r + 144.0);
        let mixed = DMatrix::from_row_slice(2, 2, &[0.0, -k, 1.0, 0.0]) * factor;
        assert_matrix(
            &equivalent(&oscillator, Mixed::<3>.into(), h),
            &mixed,
            TOLERANCE,
            "mixed, three nodes",
        );
    }
}
