//! Many coordinates: the lattice of Fermi, Pasta, Ulam and Tsingou.

use crate::Outcome;
use crate::runs::Scene;
use tfe::prelude::*;

/// Unit masses between walls, 33 springs of force δ + a δ².
#[dynamics(
    coordinates(q[32]),
    lagrangian = sum(i in 0..32, dot(q[i])^2/2)
        - sum(i in 0..31, (q[i+1] - q[i])^2/2 + a/3*(q[i+1] - q[i])^3)
        - q[0]^2/2 - a/3*q[0]^3 - q[31]^2/2 + a/3*q[31]^3,
)]
struct Lattice {
    a: f64,
}

/// From rest, with all modes at work.
pub fn scene() -> Outcome {
    let model = Lattice { a: 0.25 };
    let mut q = [0.0; 32];
    for (i, q) in (1..).zip(&mut q) {
        *q = 0.5 * (1.7 * f64::from(i)).sin();
    }
    let problem = WorkPrecision::new(&model, model.state(q, [0.0; 32]), 0.0..20.0)
        .steps([1.0, 0.5, 0.25, 0.1, 0.05]);
    Ok(Scene::measure("FPUT lattice, N = 32", problem)?)
}
