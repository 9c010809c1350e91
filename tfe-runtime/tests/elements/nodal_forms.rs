//! The nodal forms of the paper against the steps.

use crate::common::*;
use nalgebra::DMatrix;
use tfe_runtime::quadrature::Quadrature;
use tfe_runtime::weak_form::{
    MixedForm, PrimalForm, WeakFormError, condense, mixed_transition, primal_transition,
};
use tfe_runtime::{Element, Model, State, legendre, transition};

/// Not the points of any rule: the element must not depend on its nodes.
fn nodes(count: usize) -> Vec<f64> {
    (0..count)
        .map(|i| (i as f64 / (count - 1) as f64).powf(1.2))
        .collect()
}

#[track_caller]
fn primal<M, const N: usize>(model: &M, element: Element, start: &State<N>, t: f64, h: f64)
where
    M: Model<N>,
{
    let form = PrimalForm {
        model,
        rule: element.quadrature_rule(),
        nodes: nodes(element.nodes()),
        t,
        h,
    };
    let mut q = vec![start.q; element.nodes()];
    let mut increment = f64::INFINITY;
    for _ in 0..20 {
        increment = form.newton_step(&start.p, &mut q).expect("a Newton step");
    }
    assert!(increment < 1e-13, "{element}: {increment:e}");
    let p = form.end_momentum(&q).expect("the last row");
    let mut matrix = vec![0.0; 4 * N * N];
    let end = transition::of_step(model, element, start, t, h, &mut matrix).expect("a step");
    let what = format!("{element} from {:?}", M::FORM);
    let state = State {
        q: q[q.len() - 1],
        p,
    };
    assert_close(&vector(&state), &vector(&end), 1e-13, &what);
    let assembled = form.assemble(&q).expect("the tangent");
    let boundary = form.boundary(&start.p, &p);
    assert!((boundary - &assembled.residual).amax() < 1e-13, "{what}");
    // The last row cancels by n²: its blocks are L_vv n²/h, their sum is of the order h.
    let actual = primal_transition(&assembled.tangent, N).expect("a transition matrix");
    assert_close(actual.transpose().as_slice(), &matrix, 1e-12, &what);
    // (33) by static condensation, where the interior block is regular.
    let condensed = condense(&assembled, N).expect("a regular interior").tangent;
    let actual = primal_transition(&condensed, N).expect("a transition matrix");
    assert_close(actual.transpose().as_slice(), &matrix, 1e-12, &what);
}

#[track_caller]
fn mixed<M, const N: usize>(model: &M, element: Element, start: &State<N>, t: f64, h: f64)
where
    M: Model<N>,
{
    let n = element.nodes();
    let trial = Quadrature::gauss(n - 1);
    let form = MixedForm {
        model,
        rule: element.quadrature_rule(),
        nodes: nodes(n),
        trial_nodes: (0..n - 1).map(|i| 0.9 * trial.node(i)).collect(),
        t,
        h,
    };
    let mut y = vec![*start; n - 1];
    let mut increment = f64::INFINITY;
    for _ in 0..20 {
        increment = form.newton_step(start, &mut y).expect("a Newton step");
    }
    assert!(increment < 1e-12, "{element}: {increment:e}");
    let mut matrix = vec![0.0; 4 * N * N];
    let end = transition::of_step(model, element, start, t, h, &mut matrix).expect("a step");
    let what = format!("{element} from {:?}", M::FORM);
    assert_close(
        &vector(&form.end(&y).expect("the last rows")),
        &vector(&end),
        1e-13,
        &what,
    );
    let assembled = form.assemble(&y).expect("the tangent");
    assert!(
        (form.boundary(start, &end) - &assembled.residual).amax() < 1e-12,
        "{what}"
    );
    let actual = mixed_transition(&assembled.tangent, N).expect("a transition matrix");
    assert_close(actual.transpose().as_slice(), &matrix, 1e-12, &what);
}

#[test]
fn nodal_forms_are_the_steps() {
    let duffing = DuffingL { d: 0.3 };
    let start = legendre::state(&duffing, 0.0, &[0.8], &[-0.4]).expect("a momentum");
    let double = DoublePendulum { g: 9.81 };
    let angles = legendre::state(&double, 0.0, &[1.2, -0.4], &[0.5, 1.5]).expect("a momentum");
    for n in 2..=5 {
        for element in [
            Element::primal(n),
            Element::primal(n).reduced(),
            Element::primal(n).lobatto(),
        ] {
            primal(&duffing, element, &start, 0.4, 0.2);
            primal(&DuffingH { d: 0.3 }, element, &start, 0.4, 0.2);
            primal(&double, element, &angles, 0.0, 0.1);
        }
        for element in [Element::mixed(n), Element::mixed(n).quadrature(n + 1)] {
            mixed(&duffing, element, &start, 0.4, 0.2);
            mixed(&DuffingH { d: 0.3 }, element, &start, 0.4, 0.2);
            mixed(&double, element, &angles, 0.0, 0.1);
        }
    }
}

#[test]
fn the_oscillator_where_the_interior_block_is_singular() {
    // Three nodes: ρ² = 10. Rows are solved, so the transition matrix does not notice.
    let model = OscillatorL {
        m: 1.0,
        d: 0.0,
        k: 10.0,
    };
    let rule = Quadrature::gauss(3);
    let form = PrimalForm {
        model: &model,
        rule,
        nodes: vec![0.0, 0.5, 1.0],
        t: 0.0,
        h: 1.0,
    };
    let assembled = form.assemble(&[[0.0]; 3]).expect("the tangent");
    let actual = primal_transition(&assembled.tangent, 1).expect("a transition matrix");
    // a₁₁ = (3ρ⁴ − 104ρ² + 240)/(ρ⁴ + 16ρ² + 240)
    assert!((actual[(0, 0)] - -1.0).abs() < 1e-13, "{actual}");
    assert!((actual.determinant() - 1.0).abs() < 1e-13);
    let mut matrix = [0.0; 4];
    let state = State { q: [1.0], p: [0.0] };
    transition::of_step(&model, Element::primal(3), &state, 0.0, 1.0, &mut matrix).expect("one");
    assert_close(actual.transpose().as_slice(), &matrix, 1e-13, "the step");
}

#[test]
fn equation_48_in_the_nodal_form() {
    let (rho, xi) = (0.7, 0.2);
    let model = OscillatorH {
        m: 1.0,
        d: 2.0 * xi * rho,
        k: rho * rho,
    };
    let form = MixedForm {
        model: &model,
        rule: Quadrature::gauss(1),
        nodes: vec![0.0, 1.0],
        trial_nodes: vec![0.5],
        t: 0.0,
        h: 1.0,
    };
    let tangent = form
        .assemble(&[State { q: [0.0], p: [0.0] }])
        .expect("K_m")
        .tangent;
    let half = 0.5;
    let damping = -xi * rho;
    let expected = DMatrix::from_row_slice(
        4,
        2,
        &[
            -half,
            1.0,
            -1.0 + damping,
            -half * rho * rho,
            -half,
            -1.0,
            1.0 + damping,
            -half * rho * rho,
        ],
    );
    assert!((tangent - expected).amax() < 1e-15);
}

#[test]
fn what_does_not_fit_is_told() {
    let model = PendulumL {};
    let rule = Quadrature::gauss(2);
    let form = PrimalForm {
        model: &model,
        rule,
        nodes: vec![0.0, 1.0],
        t: 0.0,
        h: 0.1,
    };
    assert_eq!(form.assemble(&[[0.0]; 3]), Err(WeakFormError::Shape));
    assert_eq!(
        primal_transition(&DMatrix::zeros(2, 3), 1),
        Err(WeakFormError::Shape)
    );
    assert_eq!(
        primal_transition(&DMatrix::zeros(4, 4), 1),
        Err(WeakFormError::Singular)
    );
    assert_eq!(
        mixed_transition(&DMatrix::zeros(4, 4), 1),
        Err(WeakFormError::Shape)
    );
}
