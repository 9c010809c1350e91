//! Energy coefficients and invariants, (49) to (54).

use crate::Oscillator;
use tfe::prelude::*;

const RHOS: [f64; 6] = [0.1, 0.5, 1.0, 2.0, 3.0, 5.0];

/// (p₁, q₁) of one element from (p₀, q₀).
fn step(
    oscillator: &Oscillator,
    element: impl Into<Element>,
    h: f64,
    p: f64,
    q: f64,
) -> (f64, f64) {
    let end = Simulation::new(oscillator)
        .element(element)
        .step(h)
        .run(State { q: [q], p: [p] }, 0.0..h)
        .expect("one step of the oscillator");
    (end.last().p[0], end.last().q[0])
}

#[test]
fn mixed_and_reduced_primal_elements_conserve_the_energy() {
    // (49), and (54): the stiffness of the invariant is k itself.
    for nodes in 2..=6 {
        for element in [Element::mixed(nodes), Element::primal(nodes).reduced()] {
            for rho in RHOS {
                let h = 0.3;
                let oscillator = Oscillator::scaled(rho, 0.0, h);
                let energy = |p: f64, q: f64| p * p / 2.0 + oscillator.k / 2.0 * q * q;
                let (p, q) = step(&oscillator, element, h, 0.7, -0.4);
                let change = energy(p, q) / energy(0.7, -0.4) - 1.0;
                assert!(change.abs() < 1e-13, "{element} at ρ = {rho}: {change:e}");
            }
        }
    }
}

#[test]
fn energy_coefficients_of_the_two_node_primal_element() {
    // (50): p₁²/2m + k q₁²/2 = 𝒜 p₀²/2m + ℬ k q₀²/2 + 𝒞 p₀ q₀
    for rho in RHOS {
        let h = 0.3;
        let oscillator = Oscillator::scaled(rho, 0.0, h);
        let (k, omega) = (oscillator.k, rho / h);
        let d = (12.0 + 2.0 * rho * rho).powi(2);
        let a = (144.0 + 48.0 * rho.powi(2) + 16.0 * rho.powi(4)) / d;
        let b = (144.0 + 48.0 * rho.powi(2) - 8.0 * rho.powi(4) + rho.powi(6)) / d;
        let c = omega * (12.0 * rho.powi(3) - 4.0 * rho.powi(5)) / d;
        for (p0, q0) in [(1.0, 0.0), (0.0, 1.0), (0.7, -0.4)] {
            let (p, q) = step(&oscillator, Primal::<2>, h, p0, q0);
            let actual = p * p / 2.0 + k / 2.0 * q * q;
            let expected = a * p0 * p0 / 2.0 + b * k / 2.0 * q0 * q0 + c * p0 * q0;
            let scale = p0 * p0 / 2.0 + k / 2.0 * q0 * q0;
            assert!(
                (actual - expected).abs() < 1e-13 * scale * a.max(b).max(1.0),
                "ρ = {rho}: {actual} {expected}"
            );
        }
    }
}

#[test]
fn the_primal_elements_keep_an_energy_of_changed_stiffness() {
    // (52), (53) for two nodes; theory.md for three and four. Positive definite where the element is stable.
    type Stiffness = fn(f64) -> f64;
    let cases: [(usize, Stiffness); 3] = [
        (2, |r| 1.0 - r / 12.0),
        (3, |r| {
            (1.0 - r / 12.0) * (1.0 - r / 60.0) / (1.0 - r / 10.0)
        }),
        (4, |r| {
            (1.0 - r / 60.0) * (1.0 - 180.0 * r / 1680.0 + r * r / 1680.0)
                / ((1.0 - r / 10.0) * (1.0 - r / 42.0))
        }),
    ];
    for (nodes, stiffness) in cases {
        for rho in [0.1, 0.5, 1.0, 2.0, 3.0] {
            let h = 0.3;
            let oscillator = Oscillator::scaled(rho, 0.0, h);
            let k = oscillator.k * stiffness(rho * rho);
            let invariant = |p: f64, q: f64| p * p / 2.0 + k / 2.0 * q * q;
            let (p, q) = step(&oscillator, Element::primal(nodes), h, 0.7, -0.4);
            let change = invariant(p, q) / invariant(0.7, -0.4) - 1.0;
            assert!(
                change.abs() < 1e-12,
                "{nodes} nodes at ρ = {rho}: {change:e}"
            );
        }
    }
}
