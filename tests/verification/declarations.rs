//! The same physics declared in different ways.

use crate::common::assert_close;
use crate::models::DoublePendulum;
use tfe::prelude::*;

/// The Lagrangian of the double pendulum, expanded by hand.
#[dynamics(
    coordinates(theta1, theta2),
    lagrangian = (m1 + m2)/2*l1^2*dot(theta1)^2 + m2/2*l2^2*dot(theta2)^2
               + m2*l1*l2*dot(theta1)*dot(theta2)*cos(theta1 - theta2)
               + (m1 + m2)*g*l1*cos(theta1) + m2*g*l2*cos(theta2),
)]
struct Expanded {
    m1: f64,
    m2: f64,
    l1: f64,
    l2: f64,
    g: f64,
}

/// Its Hamiltonian.
#[dynamics(
    coordinates(theta1, theta2), momenta(p1, p2),
    let d = theta1 - theta2,
    let det = l1^2*l2^2*m2*(m1 + m2*sin(d)^2),
    hamiltonian = (m2*l2^2*p1^2 + (m1 + m2)*l1^2*p2^2 - 2*m2*l1*l2*p1*p2*cos(d))/(2*det)
                - (m1 + m2)*g*l1*cos(theta1) - m2*g*l2*cos(theta2),
)]
struct ByHamiltonian {
    m1: f64,
    m2: f64,
    l1: f64,
    l2: f64,
    g: f64,
}

#[test]
fn three_declarations_of_the_double_pendulum_move_alike() {
    let (m1, m2, l1, l2, g) = (1.3, 0.7, 1.1, 0.8, 9.81);
    let a = DoublePendulum { m1, m2, l1, l2, g };
    let b = Expanded { m1, m2, l1, l2, g };
    let c = ByHamiltonian { m1, m2, l1, l2, g };
    let (q, v) = ([0.9, -0.4], [0.3, 0.8]);
    let start = a.state(q, v);
    assert_close(
        &b.state(q, v).p,
        &start.p,
        1e-14,
        "momenta from the expanded Lagrangian",
    );
    assert_close(
        &c.state(q, v).p,
        &start.p,
        1e-14,
        "momenta from the Hamiltonian",
    );
    for element in [
        Element::mixed(4),
        Element::mixed(3).quadrature(4),
        Element::primal(3),
        Element::primal(4).lobatto(),
        Element::energy_conserving(3),
        Element::radau(3),
    ] {
        let end =
            |motion: Motion<2>| (motion.last().q, motion.last().p, motion.energies().to_vec());
        let run = |e| {
            Simulation::new(&a)
                .element(e)
                .step(0.02)
                .run(start, 0.0..1.0)
                .map(end)
        };
        let (q, p, energy) = run(element).expect("let positions");
        let others = [
            Simulation::new(&b)
                .element(element)
                .step(0.02)
                .run(start, 0.0..1.0)
                .map(end),
            Simulation::new(&c)
                .element(element)
                .step(0.02)
                .run(start, 0.0..1.0)
                .map(end),
        ];
        for (other, by) in others.into_iter().zip(["expanded L", "H"]) {
            let (oq, op, oe) = other.expect("the same motion");
            // The rounding errors of fifty steps, amplified by less than 10 over one second; momenta are of size 10.
            assert_close(&oq, &q, 2e-13, &format!("{element}: q, {by}"));
            assert_close(&op, &p, 2e-12, &format!("{element}: p, {by}"));
            assert_close(&oe, &energy, 2e-12, &format!("{element}: energy, {by}"));
        }
    }
}

/// Forces depend on velocities in L and on momenta in H: Q_p = Q_v H_pp and Q_q|p = Q_q + Q_v H_pq must be right for
/// Newton's method to converge, and for the transition matrix to be the derivative.
#[dynamics(coordinates(x), lagrangian = (1 + x^2)*dot(x)^2/2 - x^4/4, force(x) = -c*dot(x)^3 + x*dot(x)/5)]
struct DampedL {
    c: f64,
}

#[dynamics(coordinates(x), momenta(p), hamiltonian = p^2/(2*(1 + x^2)) + x^4/4,
           force(x) = -c*dot(x)^3 + x*dot(x)/5)]
struct DampedH {
    c: f64,
}

#[test]
fn forces_carry_over_between_the_forms() {
    let (l, h) = (DampedL { c: 0.4 }, DampedH { c: 0.4 });
    let start = l.state([0.8], [1.1]);
    for element in [
        Element::mixed(3),
        Element::primal(3),
        Element::energy_conserving(3),
        Element::radau(3),
    ] {
        for solve in [Solve::FixedPoint, Solve::Newton] {
            let run = |end: Result<Motion<1>, _>| {
                let motion: Motion<1> = end.unwrap_or_else(|error: tfe::RunError<1>| {
                    panic!("{element}, {solve:?}: {error}")
                });
                [motion.last().q[0], motion.last().p[0]]
            };
            let by_l = run(Simulation::new(&l)
                .element(element)
                .step(0.05)
                .solver(solve)
                .run(start, 0.0..1.0));
            let by_h = run(Simulation::new(&h)
                .element(element)
                .step(0.05)
                .solver(solve)
                .run(start, 0.0..1.0));
            assert_close(&by_l, &by_h, 1e-13, &format!("{element}, {solve:?}"));
        }
        let a = stability::transition_matrix(&l, element, &start, 0.0, 0.05).expect("from L");
        let b = stability::transition_matrix(&h, element, &start, 0.0, 0.05).expect("from H");
        assert_close(
            a.as_slice(),
            b.as_slice(),
            1e-13,
            &format!("{element}: transition matrices"),
        );
    }
}

/// A chain with its length as const parameter (loops), and the same chain with a literal length.
#[dynamics(coordinates(q[N]),
           lagrangian = sum(i in 0..N, m/2*dot(q[i])^2) - sum(i in 0..N-1, k/2*(q[i+1]-q[i])^2 + a/3*(q[i+1]-q[i])^3)
                      - k/2*(q[0]^2 + q[N-1]^2),
           force(q[i]) = -c*dot(q[i])*(1 + q[i]^2))]
struct Chain<const N: usize> {
    m: f64,
    k: f64,
    a: f64,
    c: f64,
}

#[dynamics(coordinates(q0, q1, q2, q3, q4),
           lagrangian = m/2*(dot(q0)^2 + dot(q1)^2 + dot(q2)^2 + dot(q3)^2 + dot(q4)^2)
                      - k/2*((q1-q0)^2 + (q2-q1)^2 + (q3-q2)^2 + (q4-q3)^2 + q0^2 + q4^2)
                      - a/3*((q1-q0)^3 + (q2-q1)^3 + (q3-q2)^3 + (q4-q3)^3),
           force(q0) = -c*dot(q0)*(1 + q0^2), force(q1) = -c*dot(q1)*(1 + q1^2), force(q2) = -c*dot(q2)*(1 + q2^2),
           force(q3) = -c*dot(q3)*(1 + q3^2), force(q4) = -c*dot(q4)*(1 + q4^2))]
struct Five {
    m: f64,
    k: f64,
    a: f64,
    c: f64,
}

#[test]
fn a_sum_is_what_it_abbreviates() {
    let chain = Chain::<5> {
        m: 1.5,
        k: 2.0,
        a: 0.7,
        c: 0.1,
    };
    let five = Five {
        m: 1.5,
        k: 2.0,
        a: 0.7,
        c: 0.1,
    };
    let (q, v) = ([0.1, -0.3, 0.5, 0.2, -0.1], [0.4, 0.0, -0.2, 0.1, 0.3]);
    let start = five.state(q, v);
    assert_close(&chain.state(q, v).p, &start.p, 1e-15, "momenta");
    for element in [Element::mixed(4), Element::primal(3)] {
        for solve in [Solve::FixedPoint, Solve::Newton] {
            let a = Simulation::new(&chain)
                .element(element)
                .step(0.1)
                .solver(solve)
                .run(start, 0.0..5.0)
                .expect("loops");
            let b = Simulation::new(&five)
                .element(element)
                .step(0.1)
                .solver(solve)
                .run(start, 0.0..5.0)
                .expect("spelled out");
            assert_close(
                &a.last().q,
                &b.last().q,
                1e-13,
                &format!("{element}, {solve:?}"),
            );
        }
        let a = stability::transition_matrix(&chain, element, &start, 0.0, 0.1).expect("loops");
        let b =
            stability::transition_matrix(&five, element, &start, 0.0, 0.1).expect("spelled out");
        assert_close(a.as_slice(), b.as_slice(), 1e-14, "transition matrices");
    }
}
