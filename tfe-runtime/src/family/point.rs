//! A model of run-time length at one point of an element.

use crate::scheme::MAX_RATES;

/// The model at one point of the element.
#[derive(Clone, Debug)]
pub(super) struct Point {
    pub(super) q: Vec<f64>,
    pub(super) v: Vec<f64>,
    /// L_v
    pub(super) momentum: Vec<f64>,
    /// F
    pub(super) force: Vec<f64>,
    /// A
    pub(super) rows: Vec<f64>,
    pub(super) phi: Vec<f64>,
    /// μ̇
    pub(super) mu_rate: Vec<f64>,
    /// P_j′ there, which takes multipliers to μ̇.
    pub(super) slopes: [f64; MAX_RATES],
}

impl Point {
    pub(super) fn new(n: usize, rows: usize, constraints: usize, slopes: [f64; MAX_RATES]) -> Self {
        Self {
            q: vec![0.0; n],
            v: vec![0.0; n],
            momentum: vec![0.0; n],
            force: vec![0.0; n],
            rows: vec![0.0; rows],
            phi: vec![0.0; constraints],
            mu_rate: vec![0.0; constraints],
            slopes,
        }
    }
}
