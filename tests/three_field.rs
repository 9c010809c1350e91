//! The three-field element, and the two other forms that are its special cases.

#[path = "common/largest.rs"]
mod largest;

use largest::larger;
use tfe::prelude::*;

/// A damped pendulum on an elastic rod.
#[dynamics(
    coordinates(r, phi),
    lagrangian = (dot(r)^2 + r^2*dot(phi)^2)/2 + g*r*cos(phi) - k/2*(r - 1)^2,
    force(phi) = -c*dot(phi)*r^2,
)]
struct Spring {
    g: f64,
    k: f64,
    c: f64,
}

/// The same as a Hamiltonian.
#[dynamics(
    coordinates(r, phi),
    momenta(pr, pphi),
    hamiltonian = (pr^2 + pphi^2/r^2)/2 - g*r*cos(phi) + k/2*(r - 1)^2,
    force(phi) = -c*pphi,
)]
struct SpringByMomenta {
    g: f64,
    k: f64,
    c: f64,
}

/// A rotor described by unit quaternions: the kinetic energy does not depend on the rate of change of |e|, so that its
/// second derivative is singular.
#[dynamics(
    coordinates(e[4]),
    let w = body_rate(e),
    lagrangian = (j1*w[0]^2 + j2*w[1]^2 + j3*w[2]^2)/2,
    constraint(unit) = inner(e, e) - 1,
)]
struct Rotor {
    j1: f64,
    j2: f64,
    j3: f64,
}

const SPRING: Spring = Spring {
    g: 9.81,
    k: 30.0,
    c: 0.1,
};
const BY_MOMENTA: SpringByMomenta = SpringByMomenta {
    g: 9.81,
    k: 30.0,
    c: 0.1,
};

/// The largest difference between two motions at their ends, relative to the largest number there.
fn difference<M: Model<2>, L: Model<2>>(
    (one, with): (&M, Element),
    (other, with_other): (&L, Element),
) -> f64 {
    let start = SPRING.state([1.1, 0.8], [0.3, -0.4]);
    let run = Simulation::new(one)
        .element(with)
        .step(0.05)
        .run(start, 0.0..2.0);
    let same = Simulation::new(other)
        .element(with_other)
        .step(0.05)
        .run(start, 0.0..2.0);
    let (run, same) = (run.unwrap(), same.unwrap());
    let numbers = |node: &Node<2>| [node.q, node.p].concat();
    let pairs = numbers(run.last()).into_iter().zip(numbers(same.last()));
    pairs.map(|(a, b)| (a - b).abs()).fold(0.0, larger) / 2.0
}

/// If its velocity is the rate of the coordinates it is the primal form with the same quadrature; with n − 1 points it
/// is the mixed form.
#[test]
fn primal_and_mixed_are_special_cases() {
    for n in 2..=6 {
        let element = Element::three_field(n);
        // The equations are the same except for the order of sums; 40 steps.
        let cases = [
            (Element::mixed(n), element),
            (Element::primal(n), element.quadrature(n)),
            (Element::primal(n).lobatto(), element.lobatto()),
        ];
        for (special, three_field) in cases {
            let found = difference((&SPRING, three_field), (&SPRING, special));
            assert!(found < 1e-13, "{three_field} {special}: {found:e}");
        }
        // For a Hamiltonian, velocities become unknowns and momenta follow point by point.
        let found = difference((&BY_MOMENTA, element), (&SPRING, Element::mixed(n)));
        assert!(found < 1e-12, "{element} by momenta: {found:e}");
    }
}

/// A singular mass matrix that becomes regular with the constraint: Euler's free body conserves its angular momentum in
/// space and its energy.
#[test]
fn a_singular_mass_matrix_runs() {
    let rotor = Rotor {
        j1: 1.0,
        j2: 2.0,
        j3: 3.0,
    };
    // ė = ½ e ∘ ω at e = 1.
    let start = rotor.state([1.0, 0.0, 0.0, 0.0], [0.0, 0.05, 1.0, 0.05]);
    let motion = Simulation::new(&rotor)
        .element(ThreeField::<5>)
        .step(0.05)
        .run(start, 0.0..20.0)
        .unwrap();
    assert!(motion.constraint_residual().position < 1e-14);
    // The energy error of an element of order 8 with this step.
    assert!(motion.energy_error() < 1e-9, "{:e}", motion.energy_error());
    let same = Simulation::new(&rotor)
        .element(Mixed::<5>)
        .step(0.05)
        .run(start, 0.0..20.0);
    let same = same.unwrap();
    for (a, b) in motion.last().q.iter().zip(same.last().q) {
        assert!((a - b).abs() < 1e-12);
    }
}

/// Linearised about an equilibrium it has the stability of the mixed element.
#[test]
fn stable_at_every_step() {
    let rest = SPRING.state([1.0 + 9.81 / 30.0, 0.0], [0.0, 0.0]);
    let undamped = Spring { c: 0.0, ..SPRING };
    let gaps = stability::unstable_intervals(&undamped, ThreeField::<3>, &rest, 0.0..3.0).unwrap();
    assert!(gaps.is_empty(), "{gaps:?}");
}
