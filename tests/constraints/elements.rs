//! Which elements support constrained models, as Lagrangians and Hamiltonians, and the motion between nodes.

use crate::common::{distance, larger, observed_order};
use crate::models::{KnifeEdge, RodPendulum};
use crate::runs::{differences, run};
use tfe::prelude::*;
use tfe::runtime::ConstraintError;
use tfe::{RunErrorKind, StepError};

/// The rod as a Hamiltonian.
#[dynamics(coordinates(x, y), momenta(px, py), hamiltonian = (px^2 + py^2)/(2*m) + m*g*y, constraint(rod) = (x^2 + y^2 - l^2)/2)]
struct RodHamiltonian {
    m: f64,
    l: f64,
    g: f64,
}

/// The blade as a Hamiltonian.
#[dynamics(
    coordinates(x, y, phi), momenta(px, py, pphi),
    hamiltonian = (px^2 + py^2)/(2*m) + pphi^2/(2*j) - m*gs*x,
    constraint(blade) = dot(x)*sin(phi) - dot(y)*cos(phi),
)]
struct BladeHamiltonian {
    m: f64,
    j: f64,
    gs: f64,
}

#[test]
fn a_hamiltonian_moves_as_its_lagrangian() {
    let (a, b) = (
        RodPendulum::UNIT,
        RodHamiltonian {
            m: 1.0,
            l: 1.0,
            g: 9.81,
        },
    );
    let start = a.horizontal();
    for nodes in [2, 4] {
        let (q, p) = differences(
            &run(&a, Element::mixed(nodes), 0.05, start, 5.0),
            &run(&b, Element::mixed(nodes), 0.05, start, 5.0),
        );
        assert!(q < 1e-12 && p < 1e-11, "{nodes} nodes: {q:e}, {p:e}");
    }
    let a = KnifeEdge::TABLE;
    let b = BladeHamiltonian {
        m: 1.0,
        j: 1.0,
        gs: a.g * a.alpha.sin(),
    };
    let start = a.turning(1.3);
    for nodes in [2, 4] {
        let (q, p) = differences(
            &run(&a, Element::mixed(nodes), 0.05, start, 5.0),
            &run(&b, Element::mixed(nodes), 0.05, start, 5.0),
        );
        assert!(q < 1e-12 && p < 1e-12, "{nodes} nodes: {q:e}, {p:e}");
    }
}

/// Primal elements with n − 1 Gauss points are the mixed ones, with and without constraints.
#[test]
fn reduced_primal_elements_are_mixed_ones() {
    let rod = RodPendulum::UNIT;
    let blade = KnifeEdge::TABLE;
    for nodes in 2..=5 {
        let (mixed, primal) = (Element::mixed(nodes), Element::primal(nodes).reduced());
        let (q, p) = differences(
            &run(&rod, mixed, 0.05, rod.horizontal(), 2.0),
            &run(&rod, primal, 0.05, rod.horizontal(), 2.0),
        );
        assert!(q < 1e-13 && p < 1e-12, "{nodes} nodes: {q:e}, {p:e}");
        let (q, p) = differences(
            &run(&blade, mixed, 0.05, blade.turning(1.3), 2.0),
            &run(&blade, primal, 0.05, blade.turning(1.3), 2.0),
        );
        assert!(q < 1e-13 && p < 1e-13, "{nodes} nodes: {q:e}, {p:e}");
    }
}

/// A run that must fail before its first step.
#[track_caller]
fn refuse<M: Model<N>, const N: usize>(
    model: &M,
    start: State<N>,
    element: Element,
) -> RunErrorKind {
    let error = Simulation::new(model)
        .element(element)
        .step(0.05)
        .run(start, 0.0..1.0)
        .expect_err("the element has no place for the constraints");
    assert_eq!(error.partial().states().len(), 1, "{element}: {error}");
    error.kind().clone()
}

/// The error names the constraint and says which element to use instead.
#[track_caller]
fn assert_no_place(kind: &RunErrorKind, element: Element) {
    let source = match kind {
        RunErrorKind::Solve { source, .. } => source,
        _ => panic!("{element}: {kind:?}"),
    };
    assert!(
        matches!(
            source,
            StepError::Constraint(ConstraintError::Element { .. })
        ),
        "{element}: {kind:?}"
    );
    let text = kind.to_string();
    assert!(
        text.contains("`rod`") || text.contains("`blade`"),
        "{element}: {text}"
    );
    assert!(text.contains("`Mixed::<"), "{element}: {text}");
}

#[test]
fn elements_without_a_place_for_multipliers_are_refused() {
    let rod = RodPendulum::UNIT;
    let blade = KnifeEdge::TABLE;
    for element in [
        Element::radau(3),
        Element::energy_conserving(3),
        Element::mixed(3).quadrature(4),
    ] {
        for kind in [
            refuse(&rod, rod.horizontal(), element),
            refuse(&blade, blade.turning(1.3), element),
        ] {
            assert_no_place(&kind, element);
        }
    }
    for element in [Element::primal(3).lobatto(), Element::primal(3)] {
        let kind = refuse(&blade, blade.turning(1.3), element);
        assert_no_place(&kind, element);
    }
}

/// Dense output agrees with the nodes, and between them the constraint holds up to the accuracy of the polynomial.
#[test]
fn between_nodes() {
    let rod = RodPendulum::UNIT;
    let fine = run(&rod, Mixed::<8>, 0.01, rod.horizontal(), 1.0);
    for nodes in 2..=5_usize {
        let error = |step: f64| {
            let motion = run(&rod, Element::mixed(nodes), step, rod.horizontal(), 1.0);
            for node in &motion.states()[1..motion.states().len() - 1] {
                for side in [-1e-12, 1e-12] {
                    let near = motion.at(node.t + side).expect("inside");
                    // |q̇| < 5 and |ṗ| < 30 over 1e-12, and rounding errors of the sums of stages.
                    assert!(distance(&near.q, &node.q) < 3e-11, "q at {}", node.t);
                    assert!(distance(&near.p, &node.p) < 3e-10, "p at {}", node.t);
                }
            }
            let mut worst = (0.0_f64, 0.0_f64);
            for k in 0..=37 {
                let t = f64::from(k) / 37.0;
                let (a, b) = (motion.at(t).expect("inside"), fine.at(t).expect("inside"));
                worst = (
                    larger(worst.0, distance(&a.q, &b.q)),
                    larger(worst.1, distance(&a.p, &b.p)),
                );
            }
            worst
        };
        let steps = [0.1, 0.05, 0.025];
        let errors = steps.map(error);
        let q: Vec<_> = (0..3).map(|k| (steps[k], errors[k].0)).collect();
        let p: Vec<_> = (0..3).map(|k| (steps[k], errors[k].1)).collect();
        let claimed = nodes as f64;
        let order = observed_order(&q, 1e-13, "q between nodes");
        assert!(order > claimed - 0.4, "{nodes} nodes: q {order:.2}, {q:?}");
        let order = observed_order(&p, 1e-13, "p between nodes");
        assert!(order > claimed - 1.4, "{nodes} nodes: p {order:.2}, {p:?}");
    }
}
