//! Events: the times at which they are found, and what is done there.

mod acts;
mod clear;
mod derivatives;
#[path = "../common/largest.rs"]
mod largest;
mod meeting;
mod near;
mod parts;
#[path = "../../examples/events_beside_scans.rs"]
mod scans;
mod setting;

use std::f64::consts::PI;
use tfe::RunErrorKind;
use tfe::prelude::*;

#[dynamics(coordinates(y), lagrangian = m/2*dot(y)^2 - m*g*y, event(height) = y, output(rate) = dot(y))]
struct Ball {
    m: f64,
    g: f64,
}

const BALL: Ball = Ball { m: 0.3, g: 9.81 };

#[dynamics(
    coordinates(x),
    lagrangian = dot(x)^2/2 - x^2/2,
    output(above) = x - level,
    output(place) = x,
    output(speed) = dot(x),
)]
struct Oscillator {
    level: f64,
}

#[dynamics(
    coordinates(x, y),
    momenta(px, py),
    hamiltonian = (px^2 + py^2 + x^2 + y^2)/2 + x^2*y - y^3/3,
    output(section) = x,
)]
struct HenonHeiles;

#[dynamics(
    coordinates(x),
    lagrangian = m/2*dot(x)^2 - k/2*x^2,
    event(middle) = x,
    output(stiffness) = k,
    output(potential) = k/2*x^2,
)]
struct Springs {
    m: f64,
    k: f64,
}

#[dynamics(
    coordinates(a, b),
    let x1 = sin(a),
    let y1 = -cos(a),
    let x2 = x1 + sin(b),
    let y2 = y1 - cos(b),
    lagrangian = (dot(x1)^2 + dot(y1)^2 + dot(x2)^2 + dot(y2)^2)/2 - g*(y1 + y2),
    event(wall) = w - x2,
)]
struct TwoLinks {
    g: f64,
    w: f64,
}
