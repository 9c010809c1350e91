//! A parameter that is there in some configurations only.

use tfe::prelude::*;

#[dynamics(coordinates(x), lagrangian = m/2*dot(x)^2 - k/2*x^2)]
struct Model {
    m: f64,
    #[cfg(all())]
    k: f64,
}

fn main() {}
