//! A wrong model with outputs: their uses type-check, so that only the mistake itself is reported.

use tfe::prelude::*;

#[dynamics(
    coordinates(q[n]),
    lagrangian = sum(i in 0..n, dot(q[i])^2/2 - k*q[i]^2),
    output(strain[i in 0..n]) = q[i+1] - q[i],
    output(first) = q[0],
)]
struct Chain { n: usize, k: f64 }

fn main() -> Result<(), tfe::family::ModelError> {
    let chain = Chain { n: 3, k: 1.0 };
    let strain: Vec<f64> = chain.strain(0.0, &[0.0; 3], &[0.0; 3])?;
    let first: f64 = chain.first(0.0, &[0.0; 3], &[0.0; 3])?;
    println!("{strain:?} {first}");
    Ok(())
}
