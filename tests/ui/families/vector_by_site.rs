//! One equation a site.

use tfe::prelude::*;

#[dynamics(
    coordinates(x[n], y[n]),
    lagrangian = sum(i in 0..n, dot(x[i])^2 + dot(y[i])^2),
    constraint(joint[i in 0..n-1]) = [x[i+1] - x[i], y[i+1] - y[i]],
)]
struct Chain { n: usize }

fn main() {}
