//! Derivatives between the nodes and of integrals of outputs: compared with models of fixed size.

use super::gradient::{Chain, chain};
use super::sensitive::{Five, LongPendula, ThreePendula, pair};
use tfe::family::{self, FamilyState};
use tfe::length::RunTimeLength;
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
    let (mut off, mut size) = (0.0_f64, 0.0_f64);
    let mut see = |a: f64, b: f64| {
        assert!(a.is_finite() && b.is_finite());
        (off, size) = (off.max((a - b).abs()), size.max(b.abs()));
    };
    let long_start = || FamilyState {
        q: start.q.to_vec(),
        p: start.p.to_vec(),
    };
    let span = 0.0..1.0;
    let ours = long.run_sensitive(long_start(), span.clone());
    let theirs = fixed.run_sensitive(start, span.clone());
    let (ours, theirs) = (ours.expect("derivatives"), theirs.expect("derivatives"));
    for t in [0.013, 0.26, 0.5, 0.777, 0.98] {
        for name in theirs.parameters() {
            let a = ours.by(name).at(t).expect("in the span");
            let b = theirs.by(name).at(t).expect("in the span");
            for k in 0..N {
                see(a.q[k], b.q[k]);
                see(a.p[k], b.p[k]);
                see(a.v[k], b.v[k]);
            }
        }
        let a = ours.by_start().at(t).expect("in the span");
        let b = theirs.by_start().at(t).expect("in the span");
        for (a, b) in a.iter().zip(b.iter()) {
            see(*a, *b);
        }
    }
    let loss = family::Loss::integral(output)
        .times(0.7)
        .and(family::Loss::output_at_end(output));
    let (a, ours) = long
        .gradient(long_start(), span.clone(), &loss)
        .expect("a gradient");
    let loss = Loss::integral(output)
        .times(0.7)
        .and(Loss::output_at_end(output));
    let (b, theirs) = fixed.gradient(start, span, &loss).expect("a gradient");
    see(a, b);
    for (a, b) in ours.by_parameters().iter().zip(theirs.by_parameters()) {
        see(*a, *b);
    }
    let (a, b) = (ours.by_start(), theirs.by_start());
    for k in 0..N {
        see(a.q[k], b.q[k]);
        see(a.p[k], b.p[k]);
    }
    off / size
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
    let (long, five): (_, Five) = pair();
    let start = five.state([0.3, -0.2, 0.8, 0.1, -0.6], [0.1, 0.5, -0.4, 0.2, 0.9]);
    for element in elements {
        let ours = Simulation::new(&long).element(element).step(0.05);
        let theirs = Simulation::new(&five).element(element).step(0.05);
        let off = off(&ours, &theirs, start, "power");
        assert!(off < ROUNDING, "{element}: {off:.1e}");
    }
    // A Hamiltonian with momentum-dependent friction.
    let (m, k, b, c) = (0.7, [1.3, 2.1], 0.2, 0.15);
    let long = LongPendula {
        n: 3,
        m,
        k: k.to_vec(),
        b,
        c,
    };
    let three = ThreePendula { m, k, b, c };
    let start = State {
        q: [0.4, -0.3, 0.9],
        p: [0.2, 0.5, -0.1],
    };
    for element in [Element::mixed(4), Element::mixed(9), Element::radau(4)] {
        let ours = Simulation::new(&long).element(element).step(0.05);
        let theirs = Simulation::new(&three).element(element).step(0.05);
        let off = off(&ours, &theirs, start, "energy");
        assert!(off < ROUNDING, "{element}: {off:.1e}");
    }
}

#[test]
fn derivatives_between_nodes_that_were_not_kept_are_told() {
    let (long, _) = pair();
    let start = long.state([0.3, -0.2, 0.8, 0.1, -0.6], [0.1, 0.5, -0.4, 0.2, 0.9]);
    let run = Simulation::new(&long).step(0.1).record_every(2);
    let s = run.run_sensitive(start, 0.0..1.0).expect("derivatives");
    assert!(s.by("c").at(0.4).is_ok());
    let told = s.by("c").at(0.45).expect_err("not kept");
    assert!(matches!(told, AtError::NotRecorded { .. }), "{told}");
}
