//! Derivatives between the nodes and of integrals of outputs: compared with models of fixed size.

use super::gradient::{Chain, chain};
use super::sensitive::{pair, pendula};
use crate::lengths::{Seen, of_heap};
use tfe::family;
use tfe::length::{Length, RunTimeLength};
use tfe::prelude::*;
use tfe::sensitivity::Loss;
use tfe::{AtError, Model};

/// The chain of the tests of gradients, with six masses.
#[dynamics(
    coordinates(q[6]),
    lagrangian = sum(i in 0..6, m[i]/2*dot(q[i])^2) - sum(i in 0..5, k[i]*((q[i+1] - q[i])^2/2 + b*(q[i+1] - q[i])^4/4)),
    dissipation = sum(i in 0..5, c*q[i]^2*(dot(q[i+1]) - dot(q[i]))^2/2),
    force(q[0]) = f*sin(omega*t)*k[1],
    output(middle) = q[2]*k[1] + c*dot(q[3])^2,
)]
struct Six {
    m: [f64; 6],
    k: [f64; 5],
    b: f64,
    c: f64,
    f: f64,
    omega: f64,
}

/// The largest difference of two runs relative to the largest derivative: between the nodes, and for the gradient of an
/// integral plus a value at a node.
fn off<M: family::Model, F: Model<N>, const N: usize>(
    long: &Simulation<'_, M, 0, RunTimeLength>,
    fixed: &Simulation<'_, F, N>,
    start: State<N>,
    output: &str,
) -> f64 {
    let mut seen = Seen::NOTHING;
    let span = 0.0..1.0;
    let ours = long.run_sensitive(of_heap(&start), span.clone());
    let theirs = fixed.run_sensitive(start, span.clone());
    let (ours, theirs) = (ours.expect("derivatives"), theirs.expect("derivatives"));
    seen.see_inside(&ours, &theirs, &[0.013, 0.26, 0.5, 0.777, 0.98]);
    let ours = long.gradient(of_heap(&start), span.clone(), &loss(output));
    let theirs = fixed.gradient(start, span, &loss(output));
    let (ours, theirs) = (ours.expect("a gradient"), theirs.expect("a gradient"));
    seen.see_gradients(&ours, &theirs);
    seen.part()
}

/// An integral and the value at the end.
fn loss<'l, const N: usize, L: Length<N>>(output: &str) -> Loss<'l, N, L> {
    let integral = Loss::integral(output).times(0.7);
    integral.and(Loss::output_at_end(output))
}

#[test]
fn between_the_nodes_and_of_integrals() {
    // The rounding errors of twenty steps and of both solutions.
    const ROUNDING: f64 = 1e-12;
    let elements = [
        Element::mixed(3),
        Element::mixed(4),
        Element::mixed(9),
        Element::radau(3),
        Element::primal(3),
        Element::primal(4).lobatto(),
    ];
    let (long, start) = chain(6);
    let start = State {
        q: std::array::from_fn(|a| start.q[a]),
        p: std::array::from_fn(|a| start.p[a]),
    };
    let six = Six {
        m: std::array::from_fn(|a| long.m[a]),
        k: std::array::from_fn(|a| long.k[a]),
        b: long.b,
        c: long.c,
        f: long.f,
        omega: long.omega,
    };
    for element in elements {
        let ours = Simulation::new(&long).element(element).step(0.05);
        let theirs = Simulation::new(&six).element(element).step(0.05);
        let off = off(&ours, &theirs, start, "middle");
        assert!(off < ROUNDING, "{element}: {off:.1e}");
    }
    // So stiff that the matrix is factorised.
    let (b, c, f) = (0.0, 1e-3, 1e-3);
    let k = [700.0; 5];
    let stiff = Chain {
        k: k.to_vec(),
        b,
        c,
        f,
        ..long
    };
    let six = Six { k, b, c, f, ..six };
    let ours = Simulation::new(&stiff).step(0.05);
    let theirs = Simulation::new(&six).step(0.05);
    let off_stiff = off(&ours, &theirs, start, "middle");
    assert!(off_stiff < 10.0 * ROUNDING, "{off_stiff:.1e}");
    // Masses that depend on coordinates, and products of velocities.
    let (long, five, start) = pair();
    for element in elements {
        let ours = Simulation::new(&long).element(element).step(0.05);
        let theirs = Simulation::new(&five).element(element).step(0.05);
        let off = off(&ours, &theirs, start, "power");
        assert!(off < ROUNDING, "{element}: {off:.1e}");
    }
    // A Hamiltonian with momentum-dependent friction.
    let (long, three, start) = pendula();
    for element in [Element::mixed(4), Element::mixed(9), Element::radau(4)] {
        let ours = Simulation::new(&long).element(element).step(0.05);
        let theirs = Simulation::new(&three).element(element).step(0.05);
        let off = off(&ours, &theirs, start, "energy");
        assert!(off < ROUNDING, "{element}: {off:.1e}");
    }
}

#[test]
fn derivatives_between_nodes_that_were_not_kept_are_told() {
    let (long, _, start) = pair();
    let run = Simulation::new(&long).step(0.1).record_every(2);
    let s = run.run_sensitive(of_heap(&start), 0.0..1.0);
    let s = s.expect("derivatives");
    assert!(s.by("c").at(0.4).is_ok());
    let told = s.by("c").at(0.45).expect_err("not kept");
    assert!(matches!(told, AtError::NotRecorded { .. }), "{told}");
}
