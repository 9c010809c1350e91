//! A rod more than there are gaps.

use tfe::prelude::*;

#[dynamics(
    coordinates(q[n]),
    lagrangian = sum(i in 0..n, m/2*dot(q[i])^2),
    constraint(rod[i in 0..n]) = q[i+1] - q[i] - l,
)]
struct Chain { n: usize, m: f64, l: f64 }

fn main() {
    let chain = Chain { n: 3, m: 1.0, l: 0.5 };
    let _ = chain.state([0.0; 3], [0.0; 3]);
}
