//! What elements conserve in long runs.

use crate::common::larger;
use crate::models::{DoublePendulum, EulerTop, HenonHeiles, Kepler, Pendulum};
use tfe::prelude::*;

#[test]
fn energy_conserving_keeps_the_double_pendulums_energy() {
    let model = DoublePendulum::UNIT;
    let start = model.state([0.5, -0.3], [0.0, 0.0]);
    for element in [
        Element::energy_conserving(2),
        Element::energy_conserving(3),
        Element::energy_conserving(4),
    ] {
        let motion = Simulation::new(&model)
            .element(element)
            .step(0.01)
            .record_every(10)
            .run(start, 0.0..100.0)
            .unwrap_or_else(|error| panic!("{element}: {error}"));
        // 10⁴ steps: a random walk of rounding errors reaches about 100 · 1e-16.
        assert!(
            motion.energy_error() < 1e-12,
            "{element}: {:.1e}",
            motion.energy_error()
        );
    }
}

/// The largest symplecticity defect along a motion.
fn defect<M: Model<N>, const N: usize>(
    model: &M,
    element: Element,
    start: State<N>,
    h: f64,
) -> f64 {
    let motion = Simulation::new(model)
        .element(element)
        .step(h)
        .run(start, 0.0..20.0 * h)
        .expect("a motion");
    motion
        .states()
        .iter()
        .map(|node| {
            let a = stability::transition_matrix(model, element, &node.state(), node.t, h)
                .expect("a transition matrix");
            stability::symplecticity_defect(&a)
        })
        .fold(0.0, larger)
}

#[test]
fn symplectic_elements_are_symplectic() {
    let pendulum = DoublePendulum::UNIT;
    let start = pendulum.state([1.2, 0.7], [0.5, -1.0]);
    let galaxy = HenonHeiles { lambda: 1.0 };
    for nodes in 2..=6 {
        for element in [
            Element::mixed(nodes),
            Element::primal(nodes),
            Element::primal(nodes).reduced(),
            Element::primal(nodes).lobatto(),
        ] {
            let defects = [
                defect(&pendulum, element, start, 0.02),
                defect(
                    &galaxy,
                    element,
                    State {
                        q: [0.1, 0.0],
                        p: [0.0, 0.5],
                    },
                    0.1,
                ),
            ];
            assert!(
                defects.iter().all(|defect| *defect <= 1e-12),
                "{element}: {defects:?}"
            );
        }
    }
}

#[test]
fn the_others_are_not() {
    // This shows that the test above has an effect to detect; theory.md: −7.9e-7 for the pendulum at h = 0.5 with three
    // nodes.
    let start = State { q: [1.7], p: [0.3] };
    let a = defect(
        &Pendulum { k: 1.0 },
        Element::energy_conserving(3),
        start,
        0.5,
    );
    assert!(a > 1e-8, "{a:e}");
    assert!(
        defect(
            &Pendulum { k: 1.0 },
            Element::mixed(3).quadrature(3),
            start,
            0.5
        ) > 1e-8
    );
    assert!(defect(&Pendulum { k: 1.0 }, Element::radau(3), start, 0.5) > 1e-6);
}

#[test]
fn momentum_maps_are_conserved() {
    // The angular momentum of the Kepler problem is quadratic and conserved by Gauss collocation; p_φ and p_ψ of the
    // top belong to cyclic coordinates and are conserved by every element.
    let motion = Simulation::new(&Kepler {})
        .element(Mixed::<3>)
        .step(0.05)
        .run(
            State {
                q: [0.4, 0.0],
                p: [0.0, 2.0],
            },
            0.0..100.0,
        )
        .expect("an orbit");
    for node in motion.states() {
        let angular = node.q[0] * node.p[1] - node.q[1] * node.p[0];
        assert!((angular - 0.8).abs() < 1e-13, "{angular}");
    }
    let top = EulerTop {
        jt: 1.0,
        ja: 0.5,
        mgd: 1.0,
    };
    let start = top.state([0.0, 0.5, 0.0], [0.0, 0.0, 6.0]);
    for element in [
        Element::mixed(3),
        Element::primal(3),
        Element::energy_conserving(3),
        Element::radau(3),
    ] {
        let motion = Simulation::new(&top)
            .element(element)
            .step(0.05)
            .run(start, 0.0..10.0)
            .expect("the top spins");
        for node in motion.states() {
            assert!(
                (node.p[0] - start.p[0]).abs() < 1e-13 && (node.p[2] - start.p[2]).abs() < 1e-13,
                "{element}"
            );
        }
    }
}

#[test]
fn no_energy_drift_of_symplectic_elements() {
    // 10⁴ steps of 0.2 from q = 2 at rest: the error oscillates, but its envelope does not grow.
    let model = Pendulum { k: 1.0 };
    for element in [Element::mixed(2), Element::mixed(3), Element::primal(3)] {
        let motion = Simulation::new(&model)
            .element(element)
            .step(0.2)
            .run(model.state([2.0], [0.0]), 0.0..2000.0)
            .expect("a long swing");
        let energies = motion.energies();
        let spread = |part: &[f64]| {
            part.iter()
                .map(|energy| (energy - energies[0]).abs())
                .fold(0.0, larger)
        };
        let (early, late) = (spread(&energies[..1000]), spread(&energies[9000..]));
        assert!(late < 1.1 * early, "{element}: {early:e} then {late:e}");
    }
}
