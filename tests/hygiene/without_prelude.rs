//! Without the prelude of Rust, and with the name of the crate taken by something else.

#![no_implicit_prelude]

/// Hides the crate.
pub mod tfe {}

/// Pairs of bodies whose forces cancel, enough to remain loops. Parameters are named like variables of these loops.
#[::tfe::dynamics(
    coordinates(x[18]),
    lagrangian = sum(i in 0..18, sums/2*dot(x[i])^2) + sum(i in 0..18, sum(j in 0..i, sum_*column*cos(x[i] - x[j]))),
    output(spread) = row*(x[17] - x[0]),
)]
pub struct Ring {
    /// Mass.
    pub sums: f64,
    /// Stiffness.
    pub sum_: f64,
    /// A factor.
    pub column: f64,
    /// Another factor.
    pub row: f64,
}

/// The same model with run-time length.
#[::tfe::dynamics(
    coordinates(x[N]),
    lagrangian = sum(i in 0..N, dot(x[i])^2/2) + sum(i in 0..N, sum(j in 0..i, k*cos(x[i] - x[j]))),
)]
pub struct AnyRing<const N: usize> {
    /// Stiffness.
    pub k: f64,
}

/// Forces in one loop that is executed in strides. Parameters and outputs are named like the variables in it.
#[::tfe::dynamics(
    coordinates(q[n]),
    lagrangian = sum(i in 0..n, dot(q[i])^2/2) - sum(i in 0..n-1, __to/2*(q[i+1] - q[i])^2 + __end*(q[i+1] - q[i])^4),
    output(forces_inline) = q[n-1],
)]
pub struct Chain {
    /// Length.
    pub n: usize,
    /// Stiffness.
    pub __to: f64,
    /// Hardening.
    pub __end: f64,
}

/// A solver, and a model derived from this one.
#[::tfe::dynamics(
    coordinates(x, y),
    lagrangian = (dot(x)^2 + dot(y)^2)/2 - k*select(y < 1, y^2, 2*y - 1),
    constraint(still) = x - 1,
    solver(Bare, Mixed::<3>),
    model(Soft, elastic(still = original)),
)]
pub struct Held {
    /// Stiffness.
    pub k: f64,
}
