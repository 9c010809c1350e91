//! A system with many coordinates: the lattice of Fermi, Pasta, Ulam and Tsingou.

use super::{Start, steps};
use tfe::prelude::*;

/// Unit masses between walls, joined by 33 springs of force δ + a δ².
#[dynamics(
    coordinates(q[32]),
    lagrangian = sum(i in 0..32, dot(q[i])^2/2)
        - sum(i in 0..31, (q[i+1] - q[i])^2/2 + a/3*(q[i+1] - q[i])^3)
        - q[0]^2/2 - a/3*q[0]^3 - q[31]^2/2 + a/3*q[31]^3,
)]
pub struct Lattice {
    pub a: f64,
}

pub const LATTICE: Lattice = Lattice { a: 0.25 };

/// From rest, with energy in all modes.
pub fn lattice_start() -> Start<32> {
    let mut q = [0.0; 32];
    for (i, q) in (1..).zip(&mut q) {
        *q = 0.5 * (1.7 * f64::from(i)).sin();
    }
    Start {
        q,
        v: [0.0; 32],
        end: 20.0,
    }
}

pub fn lattice() -> WorkPrecision<'static, Lattice, State<32>> {
    let Start { q, v, end } = lattice_start();
    WorkPrecision::new(&LATTICE, LATTICE.state(q, v), 0.0..end).steps(steps(end, 10, 400))
}
