//! The time of each family of elements at equal error, relative to that of mixed elements. For each error to be
//! reached, the fastest number of nodes and step size of each family are taken among those whose shorter steps reach it,
//! too: where an error changes its sign, single runs are accurate by chance.

use std::time::Duration;
use tfe::prelude::*;
use tfe::work_precision::{Curve, Measurements, PhasePoint, Point, Subject};

#[dynamics(coordinates(theta), lagrangian = dot(theta)^2/2 + cos(theta))]
struct Pendulum;

#[dynamics(
    coordinates(a, b),
    lagrangian = dot(a)^2 + dot(b)^2/2 + dot(a)*dot(b)*cos(a - b) + g*(2*cos(a) + cos(b)),
)]
struct DoublePendulum {
    g: f64,
}

#[dynamics(
    coordinates(x, y),
    momenta(px, py),
    hamiltonian = (px^2 + py^2 + x^2 + y^2)/2 + x^2*y - y^3/3,
)]
struct HenonHeiles;

#[dynamics(coordinates(x), lagrangian = dot(x)^2/2 - x^4/4, force(x) = -d*dot(x) + f*cos(t))]
struct Duffing {
    d: f64,
    f: f64,
}

/// A family: its name, and a function that makes an element with a number of nodes.
type Made = fn(usize) -> Element;

const FAMILIES: [(&str, Made); 6] = [
    ("mixed", Element::mixed),
    ("primal", Element::primal),
    ("primal, Lobatto", |nodes| Element::primal(nodes).lobatto()),
    ("three-field", Element::three_field),
    ("energy-conserving", Element::energy_conserving),
    ("Radau", Element::radau),
];

const ERRORS: [f64; 4] = [1e-4, 1e-6, 1e-8, 1e-10];

/// Prints the smallest times of the families relative to that of mixed elements.
fn report<M, S>(name: &str, model: &M, start: S, span: std::ops::Range<f64>, longest: f64)
where
    M: Subject<S>,
    S: PhasePoint,
{
    let elements = FAMILIES.map(|(_, made)| (2..=9).map(made));
    let steps = (0..56).map(|i| longest * 0.93_f64.powi(i));
    let measured: Measurements = WorkPrecision::new(model, start, span)
        .elements(elements.into_iter().flatten())
        .steps(steps)
        .tolerances([1e-6, 1e-9, 1e-12, 1e-15])
        .repeat_for(Duration::from_millis(5))
        .run()
        .expect("the reference converges");
    let times = FAMILIES.map(|(_, made)| {
        let curves = measured.only(|curve| curve.element() == made(curve.element().nodes()));
        ERRORS.map(|error| {
            let point = fastest(&curves, error)?;
            Some((point.element, point.measured()?.seconds))
        })
    });
    println!("\n{name}");
    for ((family, _), row) in FAMILIES.iter().zip(&times) {
        print!("{family:>20}");
        for (one, mixed) in row.iter().zip(&times[0]) {
            match (one, mixed) {
                (Some((element, seconds)), Some((_, mixed))) => {
                    print!("{:>10.2} ({})", seconds / mixed, element.nodes());
                }
                _ => print!("{:>14}", "—"),
            }
        }
        println!();
    }
}

/// The fastest run whose error, and that of all shorter steps of its curve, is at most `error`.
fn fastest(curves: &Measurements, error: f64) -> Option<&Point> {
    let uncertainty = curves.reference().uncertainty();
    let reaches = |point: &&Point| {
        point
            .error()
            .is_some_and(|one| one.max(uncertainty) <= error)
    };
    let seconds = |point: &Point| point.measured().map_or(f64::INFINITY, |one| one.seconds);
    // From the shortest step on.
    let reliable = |curve| Curve::points(curve).iter().rev().take_while(reaches);
    let runs = curves.curves().iter().flat_map(reliable);
    runs.min_by(|one, other| seconds(one).total_cmp(&seconds(other)))
}

fn main() {
    println!(
        "time over that of mixed elements at errors of {ERRORS:?}, with the fastest number of nodes"
    );
    let start = Pendulum.state([2.0], [0.0]);
    report("pendulum", &Pendulum, start, 0.0..50.0, 2.0);
    let start = HenonHeiles.state([0.1, 0.2], [0.3, 0.2]);
    report("Hénon–Heiles", &HenonHeiles, start, 0.0..50.0, 2.0);
    let double = DoublePendulum { g: 9.81 };
    let start = double.state([1.0, 0.5], [0.0, 0.0]);
    report("double pendulum", &double, start, 0.0..10.0, 0.4);
    let duffing = Duffing { d: 0.1, f: 0.5 };
    let start = duffing.state([1.0], [0.0]);
    report("Duffing's oscillator", &duffing, start, 0.0..30.0, 1.5);
}
