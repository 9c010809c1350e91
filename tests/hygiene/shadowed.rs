//! Names of the standard library and the prelude that are redefined here.

#![allow(dead_code)]

/// Hides `core::result::Result`.
pub struct Result;
/// Hides `core::option::Option`.
pub struct Option;
/// Hides `f64`, in the namespace of modules.
pub mod core {}
/// Hides `std`.
pub mod std {}
/// A trait with methods of the same names as those of the scalar type.
pub trait Real {
    /// Hides the sine.
    fn sin(&self) {}
}
impl Real for f64 {}
/// Hides the constructor.
pub struct Ok;
/// Hides the scalar parameter.
pub struct R;
/// Hides the constructor.
pub struct Some;
/// Hides the constructor.
pub struct None;
/// Hides the constructor.
pub struct Err;
/// Hides `alloc::vec::Vec`.
pub struct Vec;
/// Hides `alloc::string::String`.
pub struct String;
/// Hides `alloc::boxed::Box`.
pub struct Box;
/// Hides `core::default::Default`.
pub struct Default;
/// Hides `core::clone::Clone`.
pub struct Clone;
/// Hides `core::convert::Into`.
pub struct Into;
/// Hides `core::iter::Iterator`.
pub struct Iterator;
/// Hides the primitive type, in the namespace of modules.
pub mod f64 {}

#[tfe::dynamics(
    coordinates(x),
    lagrangian = m/2*dot(x)^2 - k*(1 - cos(x)),
    force(x) = select(x < 1, -x, sqrt(abs(x))),
    output(elongation) = x,
    solver(Solver, Mixed::<3>),
    model(Small, truncated(2)),
)]
/// A model among these names.
pub struct First {
    /// Mass.
    pub m: f64,
    /// Stiffness.
    pub k: f64,
}

/// Constraints on positions and velocities, and sensitivities to parameters.
#[tfe::dynamics(
    coordinates(x, y),
    lagrangian = m/2*(dot(x)^2 + dot(y)^2) - w[1]*y,
    constraint(rod) = x^2 + y^2 - 1,
    constraint(blade) = dot(x)*sin(t) - dot(y)*cos(t),
    sensitivity(m, w[1]),
    model(Soft, elastic(rod = k)),
)]
pub struct Second {
    /// Mass.
    pub m: f64,
    /// Weights.
    pub w: [f64; 3],
}

/// A model of run-time length with constraints and outputs at each site.
#[tfe::dynamics(
    coordinates(q[n]),
    lagrangian = sum(i in 0..n, dot(q[i])^2/2) - q[n-2]^2/2,
    constraint(rod[i in 0..n-1]) = (q[i+1] - q[i])^2 - 1,
    output(gap[i in 0..n-1]) = q[i+1] - q[i],
    output(last) = q[n-1],
)]
pub struct Third {
    /// Length.
    pub n: usize,
}

/// A model with a const length and an index that is checked at compile time.
#[tfe::dynamics(coordinates(q[N]), lagrangian = sum(i in 0..N, dot(q[i])^2/2) - q[N-2]^2/2)]
pub struct Fourth<const N: usize> {}
