//! All numbers of the paper (Borri, Bottasso, Mantegazza 1992) that concern one element, from models declared with the
//! macro. Where a printed number is wrong, the corrected one of `docs/theory.md` is used.

#![allow(missing_docs)] // what models and helpers mean is said where they are

#[path = "../common/mod.rs"]
mod common;

mod bubbles;
mod energy;
mod equivalent_system;
mod one_step;
mod orders;
mod oscillator;

use nalgebra::DMatrix;
use tfe::prelude::*;

/// The oscillator of the paper's numerical studies, m q̈ + c q̇ + k q = 0.
#[dynamics(coordinates(x), lagrangian = m/2*dot(x)^2 - k/2*x^2, dissipation = c/2*dot(x)^2)]
#[derive(Clone, Copy)]
pub struct Oscillator {
    pub m: f64,
    pub c: f64,
    pub k: f64,
}

impl Oscillator {
    /// ρ = ω Δt and ξ = c / (2 √(k m)), with m = 1 and Δt = `h`.
    pub fn scaled(rho: f64, xi: f64, h: f64) -> Self {
        let omega = rho / h;
        Self {
            m: 1.0,
            c: 2.0 * xi * omega,
            k: omega * omega,
        }
    }

    /// The transition matrix of one element, order (p, q).
    #[track_caller]
    pub fn transition(&self, element: impl Into<Element>, h: f64) -> DMatrix<f64> {
        let rest = self.state([0.0], [0.0]);
        stability::transition_matrix(self, element, &rest, 0.0, h)
            .expect("the oscillator has a transition matrix")
    }
}

/// The element of a row of the tables: form `primal` or `mixed`, quadrature `full` or `reduced`.
pub fn element(form: &str, quadrature: &str, nodes: usize) -> Element {
    match (form, quadrature) {
        ("primal", "full") => Element::primal(nodes),
        ("primal", "reduced") => Element::primal(nodes).reduced(),
        ("mixed", _) => Element::mixed(nodes),
        other => panic!("no element is called {other:?}"),
    }
}
