//! The transition matrix is the derivative of the step: for every element, as Lagrangian and Hamiltonian, on a
//! nonlinear, damped and driven model.

use crate::differences::difference_over;
use nalgebra::DMatrix;
use std::ops::Range;
use tfe::prelude::*;

/// A mass that depends on the position, a gyroscopic coupling, a time-dependent potential and force, and nonlinear
/// damping.
#[dynamics(
    coordinates(x, y),
    lagrangian = (1 + x^2/4)*dot(x)^2/2 + dot(y)^2/2 + x*y*dot(y)/3 - x^4/4 - cos(y)*(1 + sin(t)/5) - x*y/3,
    force(x) = -c*dot(x)*(1 + y^2) + cos(2*t)/4,
    force(y) = -c*dot(y)^3,
)]
struct ByLagrangian {
    c: f64,
}

/// The same as a Hamiltonian: p_x = (1 + x²/4) ẋ, p_y = ẏ + xy/3.
#[dynamics(
    coordinates(x, y), momenta(px, py),
    hamiltonian = px^2/(2*(1 + x^2/4)) + (py - x*y/3)^2/2 + x^4/4 + cos(y)*(1 + sin(t)/5) + x*y/3,
    force(x) = -c*dot(x)*(1 + y^2) + cos(2*t)/4,
    force(y) = -c*dot(y)^3,
)]
struct ByHamiltonian {
    c: f64,
}

fn elements(nodes: usize) -> Vec<Element> {
    vec![
        Element::primal(nodes),
        Element::primal(nodes).reduced(),
        Element::primal(nodes).lobatto(),
        Element::primal(nodes).quadrature(nodes + 2),
        Element::mixed(nodes),
        Element::mixed(nodes).quadrature(nodes),
        Element::energy_conserving(nodes),
        Element::energy_conserving(nodes).quadrature(3 * nodes),
        Element::radau(nodes),
        Element::radau(nodes).quadrature(nodes),
    ]
}

/// The spacing δ of differences.
const DELTA: f64 = 1e-3;

/// The derivative of the end of a run by its initial state, in the order (p, q), by differences.
pub(crate) fn difference<M: Model<2>>(
    simulation: &Simulation<'_, M, 2>,
    start: State<2>,
    span: Range<f64>,
) -> DMatrix<f64> {
    let mut derivative = DMatrix::zeros(4, 4);
    for column in 0..4 {
        let end = |offset: f64| {
            let mut start = start;
            match column {
                0 | 1 => start.p[column] += offset,
                _ => start.q[column - 2] += offset,
            }
            let motion = simulation.run(start, span.clone()).expect("a run");
            let State { q, p } = motion.last().state();
            [p[0], p[1], q[0], q[1]]
        };
        let slopes = difference_over(DELTA, end, 0.0);
        for (row, slope) in slopes.into_iter().enumerate() {
            derivative[(row, column)] = slope;
        }
    }
    derivative
}

#[track_caller]
fn check<M: Model<2>>(model: &M, start: State<2>, declared_by: &str) {
    for nodes in 2..=5 {
        for element in elements(nodes) {
            // Forwards and backwards in time.
            for h in [0.3, -0.2] {
                let a = stability::transition_matrix(model, element, &start, 0.7, h)
                    .unwrap_or_else(|error| panic!("{element} by {declared_by}: {error}"));
                let simulation = Simulation::new(model).element(element).step(h);
                let expected = difference(&simulation, start, 0.7..0.7 + h);
                let error = (a - expected).amax();
                // The rounding error of the differences is a few times 1e-16/δ.
                assert!(
                    error <= 1e-11,
                    "{element} by {declared_by}, h = {h}: {error:.1e}"
                );
            }
        }
    }
}

#[test]
fn the_transition_matrix_is_the_derivative_of_the_step() {
    let (by_l, by_h) = (ByLagrangian { c: 0.3 }, ByHamiltonian { c: 0.3 });
    let start = by_l.state([0.4, 0.9], [0.5, -0.2]);
    check(&by_l, start, "L");
    check(&by_h, start, "H");
}
