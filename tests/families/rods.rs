//! A chain of rods, hanging from the first one, beside a wall.

use tfe::prelude::*;

#[dynamics(
    coordinates(x[n], y[n]),
    lagrangian = sum(i in 0..n, (dot(x[i])^2 + dot(y[i])^2)/2 - g*y[i]),
    constraint(first) = x[0]^2 + y[0]^2 - l^2,
    constraint(rod[i in 0..n-1]) = (x[i+1] - x[i])^2 + (y[i+1] - y[i])^2 - l^2,
    event(wall) = 1 - x[n-1],
)]
pub struct Rods {
    pub n: usize,
    pub g: f64,
    pub l: f64,
}

impl Rods {
    /// Of length one, with a gravity of one.
    #[cfg(feature = "sparse")]
    pub fn of_unit_length(n: usize) -> Self {
        Self { n, g: 1.0, l: 1.0 }
    }
}
