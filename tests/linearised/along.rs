//! Transition matrices along a motion.

use crate::common::assert_close;
use crate::derivative::difference;
use nalgebra::DMatrix;
use tfe::RunErrorKind;
use tfe::periodic_schur::Multiplier;
use tfe::prelude::*;

#[dynamics(
    coordinates(x, y),
    lagrangian = (1 + x^2/4)*dot(x)^2/2 + dot(y)^2/2 - x^4/4 - cos(y)*(1 + sin(t)/5) - x*y/3,
    force(x) = -c*dot(x)*(1 + y^2),
)]
struct Driven {
    c: f64,
}

const SPAN: std::ops::Range<f64> = 0.0..2.0;

fn elements() -> [Element; 6] {
    [
        Element::primal(3),
        Element::primal(4).lobatto(),
        Element::mixed(4),
        Element::mixed(3).quadrature(4),
        Element::energy_conserving(3),
        Element::radau(3),
    ]
}

#[test]
fn the_product_is_the_derivative_of_the_run() {
    let model = Driven { c: 0.2 };
    let start = model.state([0.4, 0.9], [0.5, -0.2]);
    // Impulses at the start, at a node, inside an element and at the end; a break leads to elements of two lengths.
    for element in elements() {
        let simulation = Simulation::new(&model)
            .element(element)
            .step(0.1)
            .break_at(0.77)
            .impulse(0.0, [0.1, 0.2])
            .impulse(0.5, [0.4, -0.3])
            .impulse(1.23, [-0.5, 0.2])
            .impulse(2.0, [0.3, 0.3]);
        let run = simulation.run_linearised(start, SPAN).expect("a run");
        assert_eq!(run.transitions().len(), run.motion().states().len() - 1);
        let error = (run.product() - difference(&simulation, start, SPAN)).amax();
        // The rounding error of the differences is 1e-15/δ.
        assert!(error <= 1e-10, "{element}: {error:.1e}");
    }
}

#[test]
fn an_impulse_inside_an_element_changes_its_matrix() {
    // This shows that the test above has an effect to detect: the impulse changes the matrix through the motion.
    let model = Driven { c: 0.2 };
    let start = model.state([0.4, 0.9], [0.5, -0.2]);
    let simulation = Simulation::new(&model).element(Mixed::<3>).step(0.1);
    let with = simulation.clone().impulse(0.55, [0.4, -0.3]);
    let (a, b) = (
        simulation.run_linearised(start, 0.0..0.6).expect("a run"),
        with.run_linearised(start, 0.0..0.6).expect("a run"),
    );
    let change = |k: usize| (&a.transitions()[k] - &b.transitions()[k]).amax();
    assert_eq!(change(4), 0.0);
    assert!(change(5) > 1e-4, "{:e}", change(5));
}

#[test]
fn the_motion_is_that_of_run() {
    let model = Driven { c: 0.2 };
    let start = model.state([0.4, 0.9], [0.5, -0.2]);
    for element in elements() {
        for every in [1, 3] {
            let simulation = Simulation::new(&model)
                .element(element)
                .step(0.1)
                .record_every(every);
            let motion = simulation.run(start, SPAN).expect("a run");
            let run = simulation.run_linearised(start, SPAN).expect("a run");
            assert_eq!(run.transitions().len(), 20, "{element}");
            assert_eq!(run.motion().states(), motion.states(), "{element}");
            if every == 1 {
                let at = |motion: &Motion<2>| motion.at(1.234).expect("inside").q;
                assert_eq!(at(run.motion()), at(&motion), "{element}");
            }
            let (inner, transitions) = run.into_parts();
            assert_eq!(
                (inner.states().len(), transitions.len()),
                (motion.states().len(), 20)
            );
        }
    }
}

#[test]
fn matrices_along_a_motion_are_those_of_single_steps() {
    let model = Driven { c: 0.2 };
    let start = model.state([0.4, 0.9], [0.5, -0.2]);
    for (span, h) in [(0.0..1.0, 0.1), (1.0..0.0, -0.1)] {
        for element in elements() {
            let run = Simulation::new(&model)
                .element(element)
                .step(0.1)
                .run_linearised(start, span.clone())
                .expect("a run");
            assert_eq!(run.motion().states().len(), run.transitions().len() + 1);
            for (node, a) in run.motion().states().iter().zip(run.transitions()) {
                let single =
                    stability::transition_matrix(&model, element, &node.state(), node.t, h)
                        .expect("a matrix");
                // Iterations start from different values and stop within rounding errors of each other.
                assert_close(
                    a.as_slice(),
                    single.as_slice(),
                    1e-13,
                    &format!("{element} at {}", node.t),
                );
            }
        }
    }
}

#[test]
fn multipliers_are_the_eigenvalues_of_the_product() {
    let model = Driven { c: 0.2 };
    let start = model.state([0.4, 0.9], [0.5, -0.2]);
    let run = Simulation::new(&model)
        .element(Mixed::<4>)
        .step(0.1)
        .run_linearised(start, SPAN)
        .expect("a run");
    let multipliers = run.multipliers().expect("finite factors");
    let mut moduli: Vec<f64> = stability::eigenvalues(&run.product())
        .expect("finite")
        .iter()
        .map(|value| value.norm())
        .collect();
    moduli.sort_by(|a, b| b.total_cmp(a));
    let found: Vec<f64> = multipliers.iter().map(Multiplier::modulus).collect();
    assert_close(&found, &moduli, 1e-12, "multipliers");
    // For an empty span the matrix is the identity.
    let still = Simulation::new(&model)
        .step(0.1)
        .run_linearised(start, 1.0..1.0)
        .expect("an empty span");
    assert_eq!(still.product(), DMatrix::identity(4, 4));
    let one = still.multipliers().expect("the identity");
    assert!(one.len() == 4 && one.iter().all(|m| m.modulus() == 1.0));
}

/// A pendulum whose angle is measured from its upper position.
#[dynamics(coordinates(theta), lagrangian = dot(theta)^2/2 - cos(theta))]
pub(crate) struct Inverted {}

#[test]
fn multipliers_survive_where_the_product_does_not() {
    // For the upright pendulum at rest λ = ±1. After 40 units of time the factors are e^±40, whose ratio exceeds the
    // digits of a double.
    let model = Inverted {};
    let run = Simulation::new(&model)
        .element(Mixed::<6>)
        .step(0.1)
        .run_linearised(model.state([0.0], [0.0]), 0.0..40.0)
        .expect("a rest");
    let multipliers = run.multipliers().expect("finite factors");
    // Order 10: the error of one element is below 1e-17.
    assert!((multipliers[0].log_modulus - 40.0).abs() < 1e-12);
    assert!((multipliers[1].log_modulus + 40.0).abs() < 1e-12);
    let smallest = stability::eigenvalues(&run.product())
        .expect("finite")
        .iter()
        .map(|value| value.norm())
        .fold(f64::INFINITY, f64::min);
    let exact = (-40.0_f64).exp();
    assert!(
        (smallest - exact).abs() > 0.5 * exact,
        "the product would do: {smallest:e} for {exact:e}"
    );
}

#[test]
fn errors_are_those_of_a_run() {
    // x falls from one to zero at t = 4/3, where the square root ends.
    #[dynamics(coordinates(x), momenta(p), hamiltonian = p^2/2 + 2*sqrt(x))]
    struct Fall {}
    let start = State { q: [1.0], p: [0.0] };
    let error = Simulation::new(&Fall {})
        .element(Mixed::<3>)
        .step(0.01)
        .run_linearised(start, 0.0..3.0)
        .expect_err("there is nothing beyond zero");
    let RunErrorKind::Solve { element, time, .. } = error.kind() else {
        panic!("{error}")
    };
    assert_eq!(error.partial().states().len(), element + 1);
    assert_eq!(error.partial().last().t, *time);
    let error = Simulation::new(&Fall {})
        .step(f64::NAN)
        .run_linearised(start, 0.0..3.0)
        .expect_err("no step");
    assert!(matches!(error.kind(), RunErrorKind::Step { .. }));
}
