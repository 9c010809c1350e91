//! Transition matrices (47), (48), and all cases of the table for 2 to 6 nodes.

use crate::common::{assert_matrix, count, list, matrix, number, reference, word};
use crate::{Oscillator, element};
use nalgebra::DMatrix;
use tfe::prelude::*;

const CASES: [(f64, f64); 8] = [
    (0.1, 0.0),
    (0.5, 0.0),
    (1.0, 0.05),
    (2.5, 0.1),
    (3.4, 0.0),
    (6.0, 0.5),
    (0.75, 1.0),
    (2.0, 1.5),
];

/// The rounding errors of solving a 2 × 2 system: a few units in the last place of entries up to 10.
const TOLERANCE: f64 = 1e-13;

#[test]
fn primal_two_nodes_is_equation_47() {
    for (rho, xi) in CASES {
        let (m, h) = (1.0, 0.7);
        let denominator = rho * rho + 6.0 * rho * xi + 6.0;
        let expected = DMatrix::from_row_slice(
            2,
            2,
            &[
                -2.0 * rho * rho - 6.0 * rho * xi + 6.0,
                0.5 * (rho * rho - 12.0) * rho * rho * m / h,
                6.0 * h / m,
                -2.0 * rho * rho + 6.0 * rho * xi + 6.0,
            ],
        ) / denominator;
        let actual = Oscillator::scaled(rho, xi, h).transition(Primal::<2>, h);
        assert_matrix(
            &actual,
            &expected,
            TOLERANCE,
            &format!("(47) at ρ = {rho}, ξ = {xi}"),
        );
    }
}

#[test]
fn mixed_two_nodes_is_equation_48() {
    for (rho, xi) in CASES {
        let (m, h) = (1.0, 0.7);
        let denominator = rho * rho + 4.0 * rho * xi + 4.0;
        let expected = DMatrix::from_row_slice(
            2,
            2,
            &[
                -rho * rho - 4.0 * rho * xi + 4.0,
                -4.0 * rho * rho * m / h,
                4.0 * h / m,
                -rho * rho + 4.0 * rho * xi + 4.0,
            ],
        ) / denominator;
        let actual = Oscillator::scaled(rho, xi, h).transition(Mixed::<2>, h);
        assert_matrix(
            &actual,
            &expected,
            TOLERANCE,
            &format!("(48) at ρ = {rho}, ξ = {xi}"),
        );
    }
}

#[test]
fn transition_matrices_for_two_to_six_nodes() {
    let table = reference("sdof_transition");
    let mut compared = 0;
    for case in list(&table["cases"]) {
        let (form, quadrature, nodes) = (
            word(&case["form"]),
            case["quadrature"].as_str().unwrap_or("full"),
            count(&case["n"]),
        );
        for value in list(&case["values"]) {
            let (rho, xi) = (number(&value["rho"]), number(&value["xi"]));
            let actual =
                Oscillator::scaled(rho, xi, 1.0).transition(element(form, quadrature, nodes), 1.0);
            let what = format!("{form} {quadrature}, {nodes} nodes, ρ = {rho}, ξ = {xi}");
            assert_matrix(&actual, &matrix(&value["A"]), 1e-12, &what);
            compared += 1;
        }
    }
    assert!(compared >= 80, "the table lost rows: {compared}");
}

#[test]
fn nothing_breaks_where_the_interior_block_is_singular() {
    // Three nodes: ρ² = 10; four nodes: ρ² = 10 and 42. The step itself is regular there.
    for (nodes, rho_squared) in [(3, 10.0), (4, 10.0), (4, 42.0_f64)] {
        let at =
            |rho: f64| Oscillator::scaled(rho, 0.0, 1.0).transition(Element::primal(nodes), 1.0);
        let rho = rho_squared.sqrt();
        let (here, beside) = (at(rho), at(rho * (1.0 + 1e-9)));
        // The derivatives of the entries by ρ are below 100 there.
        assert_matrix(
            &here,
            &beside,
            1e-6,
            &format!("{nodes} nodes at ρ² = {rho_squared}"),
        );
        assert!((here.determinant() - 1.0).abs() < 1e-12);
    }
}
