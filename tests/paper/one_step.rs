//! One step of the pendulum and its derivative, for all forms and quadrature rules of the table, as Lagrangian and
//! Hamiltonian.

use crate::common::{
    assert_close, assert_matrix, count, list, matrix, number, numbers, reference, word,
};
use nalgebra::DMatrix;
use tfe::prelude::*;

#[dynamics(coordinates(theta), lagrangian = dot(theta)^2/2 + cos(theta))]
struct PendulumL {}

#[dynamics(coordinates(theta), momenta(p), hamiltonian = p^2/2 - cos(theta))]
struct PendulumH {}

fn element(form: &str, nodes: usize, rule: &str) -> Element {
    let element = match form {
        "mixed" => Element::mixed(nodes),
        "primal" => Element::primal(nodes),
        "cpg" => Element::energy_conserving(nodes),
        other => panic!("no form is called {other}"),
    };
    let points = rule[1..].parse().expect("a rule is a letter and a number");
    match &rule[..1] {
        "G" => element.quadrature(points),
        "L" => {
            assert_eq!(
                points, nodes,
                "the table has Lobatto rules at the nodes only"
            );
            element.lobatto()
        }
        other => panic!("no rule is called {other}"),
    }
}

/// State and transition matrix, order (p, q).
fn one_step<M: Model<1>>(
    model: &M,
    element: Element,
    y0: &[f64],
    h: f64,
) -> (Vec<f64>, DMatrix<f64>) {
    let start = State {
        q: [y0[1]],
        p: [y0[0]],
    };
    let motion = Simulation::new(model)
        .element(element)
        .step(h)
        .run(start, 0.0..h)
        .expect("one step of the pendulum");
    let a = stability::transition_matrix(model, element, &start, 0.0, h).expect("its derivative");
    (vec![motion.last().p[0], motion.last().q[0]], a)
}

#[test]
fn every_form_and_rule() {
    let table = reference("nonlinear");
    let mut compared = 0;
    for case in list(&table["cases"]) {
        let (form, nodes, rule) = (word(&case["form"]), count(&case["n"]), word(&case["rule"]));
        let (y0, h) = (numbers(&case["y0"]), number(&case["h"]));
        let element = element(form, nodes, rule);
        let declared = [
            ("L", one_step(&PendulumL {}, element, &y0, h)),
            ("H", one_step(&PendulumH {}, element, &y0, h)),
        ];
        for (by, (y1, a)) in declared {
            let what = format!("{element} ({form}, {rule}) declared by {by}");
            // A hundred rounding errors of numbers of size one.
            assert_close(&y1, &numbers(&case["y1"]), 2e-14, &what);
            assert_matrix(&a, &matrix(&case["A"]), 2e-14, &what);
            let determinant = number(&case["det_A_minus_1"]);
            assert!(
                (a.determinant() - 1.0 - determinant).abs() < 1e-13,
                "{what}: determinant"
            );
            compared += 1;
        }
    }
    assert_eq!(compared, 66);
}
