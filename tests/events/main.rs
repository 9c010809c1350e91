//! Events: the times at which they are found, and what is done there.

mod acts;
mod clear;
mod derivatives;
#[path = "../common/differences.rs"]
mod differences;
mod jumps;
#[path = "../common/largest.rs"]
mod largest;
mod meeting;
mod near;
mod parts;
#[path = "../../examples/events_beside_scans.rs"]
mod scans;
mod setting;
mod undefined;

use differences::difference_over;
use nalgebra::DMatrix;
use std::f64::consts::PI;
use tfe::RunErrorKind;
use tfe::prelude::*;

#[dynamics(coordinates(y), lagrangian = m/2*dot(y)^2 - m*g*y, event(height) = y, output(rate) = dot(y))]
struct Ball {
    m: f64,
    g: f64,
}

const BALL: Ball = Ball { m: 0.3, g: 9.81 };

/// A mass on a spring: x = cos t from rest at 1, if both are one.
#[dynamics(
    coordinates(x),
    lagrangian = m/2*dot(x)^2 - k/2*x^2,
    event(middle) = x,
    output(above) = x - level,
    output(place) = x,
    output(speed) = dot(x),
    output(stiffness) = k,
    output(potential) = k/2*x^2,
)]
struct Oscillator {
    m: f64,
    k: f64,
    level: f64,
}

const fn oscillator(level: f64) -> Oscillator {
    let (m, k) = (1.0, 1.0);
    Oscillator { m, k, level }
}

const fn spring(k: f64) -> Oscillator {
    let (m, level) = (1.0, 0.0);
    Oscillator { m, k, level }
}

#[dynamics(
    coordinates(x, y),
    momenta(px, py),
    hamiltonian = (px^2 + py^2 + x^2 + y^2)/2 + x^2*y - y^3/3,
    output(section) = x,
)]
struct HenonHeiles;

#[dynamics(
    coordinates(a, b),
    let x1 = sin(a),
    let y1 = -cos(a),
    let x2 = x1 + sin(b),
    let y2 = y1 - cos(b),
    lagrangian = (dot(x1)^2 + dot(y1)^2 + dot(x2)^2 + dot(y2)^2)/2 - g*(y1 + y2),
    event(wall) = w - x2,
    output(line) = a + b - 1,
)]
struct TwoLinks {
    g: f64,
    w: f64,
}

/// Momenta and coordinates in one list.
fn numbers<const N: usize>(state: &State<N>) -> Vec<f64> {
    [state.p, state.q].concat()
}

/// The derivative of the end of a run by a number of its start, ordered (p, q), by differences.
fn by_start<const N: usize>(
    (start, distance): (State<N>, f64),
    column: usize,
    end: impl Fn(State<N>) -> State<N>,
) -> Vec<f64> {
    let changed = |s: f64| {
        let mut moved = start;
        match column.checked_sub(N) {
            None => moved.p[column] += s,
            Some(a) => moved.q[a] += s,
        }
        numbers(&end(moved))
    };
    difference_over(distance, changed, 0.0)
}

/// Compares columns of the derivative of the end of a run by its start with differences.
#[track_caller]
fn check_columns<const N: usize>(
    product: &DMatrix<f64>,
    columns: impl IntoIterator<Item = usize>,
    start: (State<N>, f64),
    end: impl Fn(State<N>) -> State<N>,
) {
    for column in columns {
        for (row, expected) in by_start(start, column, &end).iter().enumerate() {
            let found = product[(row, column)];
            assert!(
                (found - expected).abs() < 1e-8 * product.amax(),
                "({row}, {column}): {found} for {expected}"
            );
        }
    }
}
