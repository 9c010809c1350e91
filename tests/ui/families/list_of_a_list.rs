//! An entry of a list as the place in another.

use tfe::prelude::*;

#[dynamics(
    coordinates(q[n]),
    lagrangian = sum(i in 0..n, dot(q[i])^2/2) - sum(i in 0..n, k*q[left[right[i]]]^2),
)]
struct Network { n: usize, k: f64, left: Vec<usize>, right: Vec<usize> }

fn main() {}
