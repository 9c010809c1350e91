//! Boundary values are found for models of fixed size.

use tfe::prelude::*;

#[dynamics(coordinates(q[n]), lagrangian = sum(i in 0..n, dot(q[i])^2/2))]
struct Chain { n: usize }

fn main() {
    let chain = Chain { n: 3 };
    let _ = BoundaryValue::of(&chain);
}
