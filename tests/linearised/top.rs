//! The linearised upright spinning top: section 13 of the theory, (T-87) to (T-89).

use crate::common::{count, list, matrix, number, reference, word};
use nalgebra::DMatrix;
use tfe::prelude::*;

/// Small tilts φ = φ₁ + iφ₂ of a top that spins upright at Ω:
///
/// ```text
/// p = J_t φ̇ − ½iJ_aΩ φ ,      J_t φ̈ − iJ_aΩ φ̇ − mgd φ = 0                                          (T-84)
/// ```
///
/// so that p₁ = J_t φ̇₁ + ½J_aΩ φ₂ and p₂ = J_t φ̇₂ − ½J_aΩ φ₁.
#[dynamics(
    coordinates(phi1, phi2),
    lagrangian = jt/2*(dot(phi1)^2 + dot(phi2)^2) + ja*omega/2*(phi2*dot(phi1) - phi1*dot(phi2)) + mgd/2*(phi1^2 + phi2^2),
)]
#[derive(Clone, Copy, Debug)]
pub struct Top {
    pub jt: f64,
    pub ja: f64,
    pub mgd: f64,
    pub omega: f64,
}

impl Top {
    /// Ω_c = (2/J_a) √(mgd J_t): the exact top is stable above.
    pub fn critical_speed(&self) -> f64 {
        2.0 / self.ja * (self.mgd * self.jt).sqrt()
    }

    /// σ = mgd h²/J_t.
    pub fn sigma(&self, h: f64) -> f64 {
        self.mgd * h * h / self.jt
    }

    /// The transition matrix of one element about the upright position, in the order (p₁, p₂, φ₁, φ₂).
    #[track_caller]
    pub fn transition(&self, element: Element, h: f64) -> DMatrix<f64> {
        let upright = State {
            q: [0.0; 2],
            p: [0.0; 2],
        };
        stability::transition_matrix(self, element, &upright, 0.0, h)
            .unwrap_or_else(|error| panic!("{element}, {self:?}, h = {h}: {error}"))
    }
}

/// A complex 2 × 2 matrix over (p, φ) as a real one over (p₁, p₂, φ₁, φ₂): [[Re, −Im], [Im, Re]] for each entry.
fn real_form(re: &DMatrix<f64>, im: &DMatrix<f64>) -> DMatrix<f64> {
    DMatrix::from_fn(4, 4, |row, column| {
        let entry = (row / 2, column / 2);
        match (row % 2, column % 2) {
            (0, 1) => -im[entry],
            (1, 0) => im[entry],
            _ => re[entry],
        }
    })
}

#[test]
fn every_matrix_and_radius_of_the_table() {
    let table = reference("top");
    let mut compared = 0;
    for row in list(&table["values"]) {
        let top = Top {
            jt: number(&row["J_t"]),
            ja: number(&row["J_a"]),
            mgd: number(&row["mgd"]),
            omega: number(&row["Omega"]),
        };
        let (nodes, h) = (count(&row["n"]), number(&row["dt"]));
        let element = match (word(&row["form"]), word(&row["quadrature"])) {
            ("primal", "full") => Element::primal(nodes),
            ("primal", "reduced") => Element::primal(nodes).reduced(),
            ("mixed", _) => Element::mixed(nodes),
            other => panic!("no element is called {other:?}"),
        };
        let what = format!("{element}, {top:?}, h = {h}");
        let actual = top.transition(element, h);
        let expected = real_form(&matrix(&row["A_re"]), &matrix(&row["A_im"]));
        // Relative to the largest entry: the small entries are differences with cancellation (a₁₂ vanishes at Ω_c,
        // where both the centrifugal and the gravitational part of the stiffness are large).
        let error = (&actual - &expected).amax() / expected.amax();
        assert!(
            error <= 1e-12,
            "{what}: error {error:.1e}\n{actual}{expected}"
        );
        // At 1 % from Ω_c two eigenvalues are 0.1 apart in phase or modulus: they lose one digit, whereas defective
        // ones would lose eight.
        let (radius, exact) = (
            stability::spectral_radius(&actual),
            number(&row["spectral_radius"]),
        );
        assert!(
            (radius - exact).abs() <= 1e-12 * exact,
            "{what}: radius {radius}, expected {exact}"
        );
        compared += 1;
    }
    assert_eq!(compared, 54, "the table lost rows");
}
