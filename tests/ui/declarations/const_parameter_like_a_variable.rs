//! A const parameter called like a variable of the kernels.

#![allow(non_upper_case_globals)]

use tfe::prelude::*;

#[dynamics(
    coordinates(x[q]),
    lagrangian = sum(i in 0..q, m/2*dot(x[i])^2 - k/2*x[i]^2),
)]
struct Model<const q: usize> { m: f64, k: f64 }

fn main() {}
