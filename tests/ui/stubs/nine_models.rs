//! Nine models with a mistake each: nine messages.

use tfe::prelude::*;

#[dynamics(coordinates(x), lagrangian = m/2*dot(x)^2 - k/2*z^2)]
struct One { m: f64, k: f64 }

#[dynamics(coordinates(x), lagrangian = m/2*dot(x)^2 - k*sine(x))]
struct Two { m: f64, k: f64 }

#[dynamics(coordinates(x), lagrangian = m/2*dot(x)^2 - k/2*x**2)]
struct Three { m: f64, k: f64 }

#[dynamics(coordinates(x), lagrangian = m/2*dot(x)^2 - k/2*x^2, lagrangian = m)]
struct Four { m: f64, k: f64 }

#[dynamics(coordinates(x), hamiltonian = m/2*x^2)]
struct Five { m: f64 }

#[dynamics(coordinates(x, y), lagrangian = m/2*dot(x)^2 - k/2*x^2)]
struct Six { m: f64, k: f64 }

#[dynamics(coordinates(x), lagrangian = m/2*dot(x)^2 - k/2*x^2)]
struct Seven { m: f64, k: f64, c: f64 }

#[dynamics(coordinates(x), lagrangian = m/2*dot(x)^2 - k/2*x^2, solver(Fast, Mixed::<99>))]
struct Eight { m: f64, k: f64 }

#[dynamics(coordinates(x), lagrangian = m/2*dot(x)^2 - k/2*)]
struct Nine { m: f64, k: f64 }

fn main() {
    let one = One { m: 1.0, k: 1.0 }.state([0.0], [1.0]);
    let nine = Nine { m: 1.0, k: 1.0 }.state([0.0], [1.0]);
    println!("{one:?} {nine:?}");
}
