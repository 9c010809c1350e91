//! A chain of any length beside three of its masses with fixed size.

use tfe::prelude::*;

/// Masses on a line between walls, joined to their neighbours; the first one is tied to its place.
#[dynamics(
    coordinates(q[n]),
    lagrangian = sum(i in 0..n, dot(q[i])^2/2) - sum(i in 0..n-1, (q[i+1] - q[i])^2/2 + a/4*(q[i+1] - q[i])^4) - q[0]^2/2,
    event(first) = q[0],
    event(wall[i in 0..n]) = 0.8 - q[i],
    output(speed) = dot(q[0]),
    output(power) = q[0]*dot(q[0]),
)]
pub struct Chain {
    pub n: usize,
    pub a: f64,
}

/// The same three masses with fixed size.
#[dynamics(
    coordinates(x, y, z),
    lagrangian = (dot(x)^2 + dot(y)^2 + dot(z)^2)/2 - (y - x)^2/2 - a/4*(y - x)^4 - (z - y)^2/2 - a/4*(z - y)^4 - x^2/2,
    event(first) = x,
    event(wall) = 0.8 - z,
    output(speed) = dot(x),
    output(power) = x*dot(x),
)]
pub struct Three {
    pub a: f64,
}

pub const CHAIN: Chain = Chain { n: 3, a: 0.5 };
pub const THREE: Three = Three { a: 0.5 };
