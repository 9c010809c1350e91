//! Models of run-time length with velocities as unknowns: kinetic energies of any kind.

use crate::common::larger;
use tfe::prelude::*;

/// n point masses on massless rods of length one, in angles from the downward vertical: a dense mass matrix that
/// depends on the configuration.
#[dynamics(
    coordinates(theta[n]),
    lagrangian = sum(i in 0..n, (n - i)/2*dot(theta[i])^2 + g*(n - i)*cos(theta[i]))
        + sum(i in 0..n-1, sum(j in i+1..n, (n - j)*dot(theta[i])*dot(theta[j])*cos(theta[i] - theta[j]))),
    force(theta[0]) = -c*dot(theta[0]),
)]
struct Links {
    n: usize,
    g: f64,
    c: f64,
}

#[dynamics(
    coordinates(theta[3]),
    lagrangian = sum(i in 0..3, (3 - i)/2*dot(theta[i])^2 + g*(3 - i)*cos(theta[i]))
        + sum(i in 0..2, sum(j in i+1..3, (3 - j)*dot(theta[i])*dot(theta[j])*cos(theta[i] - theta[j]))),
    force(theta[0]) = -c*dot(theta[0]),
)]
struct ThreeLinks {
    g: f64,
    c: f64,
}

#[test]
fn links_move_as_those_of_fixed_size() {
    let (links, three) = (
        Links {
            n: 3,
            g: 9.81,
            c: 0.3,
        },
        ThreeLinks { g: 9.81, c: 0.3 },
    );
    let (q, v) = ([0.5, -0.3, 0.8], [0.1, 0.0, -0.4]);
    for element in [
        Element::mixed(2),
        Element::mixed(4),
        Element::primal(3),
        Element::primal(4).lobatto(),
        Element::mixed(3).quadrature(4),
        Element::radau(3),
        Element::energy_conserving(3),
    ] {
        let run = Simulation::new(&links).element(element).step(0.05);
        let one = run
            .run(links.state(q, v), 0.0..2.0)
            .unwrap_or_else(|error| panic!("{element}: {error}"));
        let run = Simulation::new(&three)
            .element(element)
            .step(0.05)
            .solver(Solve::Newton);
        let other = run.run(three.state(q, v), 0.0..2.0).expect("a run");
        for time in [0.31, 1.234, 2.0] {
            let (one, other) = (
                one.at(time).expect("inside"),
                other.at(time).expect("inside"),
            );
            for a in 0..3 {
                // The rounding errors of forty steps, for momenta of order ten.
                assert!((one.q[a] - other.q[a]).abs() < 1e-12, "{element} {time}");
                assert!((one.p[a] - other.p[a]).abs() < 3e-11, "{element} {time}");
            }
        }
        for (one, other) in one.velocities().iter().zip(other.velocities()) {
            for a in 0..3 {
                assert!((one[a] - other[a]).abs() < 1e-11, "{element}");
            }
        }
    }
}

/// A relativistic chain: momenta depend nonlinearly on velocities.
#[dynamics(
    coordinates(q[n]),
    lagrangian = sum(i in 0..n, -sqrt(1 - dot(q[i])^2)) - sum(i in 0..n-1, k/2*(q[i+1] - q[i])^2),
)]
struct Relativistic {
    n: usize,
    k: f64,
}

#[test]
fn kinetic_energies_need_not_be_quadratic() {
    let chain = Relativistic { n: 5, k: 1.0 };
    let v = [0.9, -0.5, 0.0, 0.3, 0.2];
    let start = chain.state(vec![0.0; 5], v);
    let motion = Simulation::new(&chain)
        .element(Mixed::<6>)
        .step(0.05)
        .run(start, 0.0..10.0)
        .expect("a run");
    assert!(motion.energy_error() < 1e-11, "{}", motion.energy_error());
    for (found, given) in motion.velocities()[0].iter().zip(v) {
        assert!((found - given).abs() < 1e-14);
    }
}

/// The order for a nonlinear model is 2 (n − 1).
#[test]
fn the_order_is_that_of_the_element() {
    let links = Links {
        n: 4,
        g: 9.81,
        c: 0.0,
    };
    let start = links.state([0.5, 0.3, 0.2, 0.1], [0.0; 4]);
    let end = |element: Element, step: f64| {
        let run = Simulation::new(&links).element(element).step(step);
        let motion = run.run(start.clone(), 0.0..1.0).expect("a run");
        motion.last().q.clone()
    };
    let exact = end(Element::mixed(8), 0.02);
    let error = |element: Element, step: f64| {
        let q = end(element, step);
        let off = q.iter().zip(&exact).map(|(q, exact)| (q - exact).abs());
        off.fold(0.0, larger)
    };
    for n in 2..=4 {
        let element = Element::mixed(n);
        let order = (error(element, 0.05) / error(element, 0.025)).log2();
        let expected = 2.0 * (n as f64 - 1.0);
        assert!((order - expected).abs() < 0.25, "{n}: {order}");
    }
}
