//! Steps on nonlinear models: orders, equivalences, structure, solvers, failures.

mod failures;
mod solvers;

use crate::common::*;
use tfe_runtime::step::{Control, Impulse, Stepper};
use tfe_runtime::{Element, Model, Solve, State, legendre, transition};

fn families(nodes: usize) -> [Element; 6] {
    [
        Element::primal(nodes),
        Element::primal(nodes).reduced(),
        Element::primal(nodes).lobatto(),
        Element::mixed(nodes),
        Element::energy_conserving(nodes),
        Element::radau(nodes),
    ]
}

fn duffing() -> (DuffingL, State<1>) {
    let model = DuffingL { d: 0.3 };
    (
        model,
        legendre::state(&model, 0.0, &[0.8], &[-0.4]).expect("a momentum"),
    )
}

/// The slope of log error over log h between two steps, for q and p: root mean square over several
/// ends, because an error may vanish at one of them by accident.
fn orders(
    model: &DuffingL,
    element: Element,
    start: State<1>,
    steps: [usize; 2],
    exact: &[(f64, State<1>)],
) -> [f64; 2] {
    let errors = steps.map(|steps| {
        let mut errors = [0.0; 2];
        for (time, exact) in exact {
            let end = run(model, element, start, time / steps as f64, steps);
            errors[0] += (end.q[0] - exact.q[0]).powi(2);
            errors[1] += (end.p[0] - exact.p[0]).powi(2);
        }
        errors
    });
    let ratio = (steps[1] as f64 / steps[0] as f64).ln();
    [0, 1].map(|field| 0.5 * (errors[0][field] / errors[1][field]).ln() / ratio)
}

#[test]
fn orders_are_as_declared() {
    let model = DuffingL { d: 0.05 };
    let start = legendre::state(&model, 0.0, &[1.5], &[0.0]).expect("a momentum");
    let exact: Vec<_> = (0..9)
        .map(|i| 3.0 + 0.25 * f64::from(i))
        .map(|time| {
            (
                time,
                run(&model, Element::mixed(12), start, time / 60.0, 60),
            )
        })
        .collect();
    for (nodes, steps) in [
        (2, [200, 400]),
        (3, [60, 200]),
        (4, [40, 100]),
        (5, [22, 50]),
        (6, [14, 28]),
    ] {
        for element in families(nodes) {
            let measured = orders(&model, element, start, steps, &exact);
            for (field, order) in ["q", "p"].iter().zip(measured) {
                // The steps are as small as round-off allows; the next term of the error still
                // shows, mostly upwards.
                let declared = element.order() as f64;
                let what = format!("{element}, {field}: {order:.2}");
                assert!(
                    order > 0.96 * declared - 0.1 && order < declared + 1.5,
                    "{what}"
                );
            }
        }
    }
}

#[test]
fn mixed_reduced_primal_and_both_declarations_are_one_method() {
    let (from_l, start) = duffing();
    let from_h = DuffingH { d: from_l.d };
    for nodes in 2..=7 {
        let reference = run(&from_l, Element::mixed(nodes), start, 0.1, 20);
        for element in [Element::mixed(nodes), Element::primal(nodes).reduced()] {
            let what = format!("{element}");
            // Twenty steps of a few roundings each.
            let l = run(&from_l, element, start, 0.1, 20);
            assert_close(&vector(&l), &vector(&reference), 1e-14, &what);
            let h = run(&from_h, element, start, 0.1, 20);
            assert_close(&vector(&h), &vector(&reference), 1e-14, &what);
        }
    }
}

#[test]
fn every_element_runs_both_declarations() {
    let (from_l, start) = duffing();
    let from_h = DuffingH { d: from_l.d };
    for nodes in 2..=5 {
        for element in families(nodes) {
            let (mut a, mut b) = ([0.0; 4], [0.0; 4]);
            let l =
                transition::of_step(&from_l, element, &start, 0.3, 0.2, &mut a).expect("from L");
            let h =
                transition::of_step(&from_h, element, &start, 0.3, 0.2, &mut b).expect("from H");
            let what = format!("{element}");
            assert_close(&vector(&l), &vector(&h), 1e-14, &what);
            assert_close(&a, &b, 1e-14, &what);
        }
    }
}

/// Central differences of the step map, of order four.
fn difference<M, const N: usize>(model: &M, element: Element, state: &State<N>, h: f64) -> Vec<f64>
where
    M: Model<N>,
{
    let delta = 1e-3;
    let mut matrix = vec![0.0; 4 * N * N];
    for column in 0..2 * N {
        let at = |offset: f64| {
            let mut start = *state;
            if column < N {
                start.p[column] += offset;
            } else {
                start.q[column - N] += offset;
            }
            let mut end = start;
            let mut stepper = Stepper::new(model, element, Control::default()).expect("valid");
            stepper.advance(0.7, h, &mut end, &[]).expect("a step");
            vector(&end)
        };
        let (near, far) = ((at(delta), at(-delta)), (at(2.0 * delta), at(-2.0 * delta)));
        for row in 0..2 * N {
            matrix[row * 2 * N + column] =
                (8.0 * (near.0[row] - near.1[row]) - (far.0[row] - far.1[row])) / (12.0 * delta);
        }
    }
    matrix
}

#[test]
fn transition_matrices_are_derivatives_of_the_step() {
    let double = DoublePendulum { g: 9.81 };
    let start = legendre::state(&double, 0.0, &[1.2, -0.4], &[0.5, 1.5]).expect("a momentum");
    let duffing = duffing();
    for nodes in 2..=4 {
        for element in families(nodes) {
            let mut matrix = [0.0; 16];
            transition::of_step(&double, element, &start, 0.7, 0.1, &mut matrix).expect("a matrix");
            // Truncation 1e-12 times fifth derivatives of order 10², round-off 1e-16/1e-3.
            assert_close(
                &matrix,
                &difference(&double, element, &start, 0.1),
                1e-9,
                "two angles",
            );
            let mut matrix = [0.0; 4];
            transition::of_step(&duffing.0, element, &duffing.1, 0.7, 0.1, &mut matrix)
                .expect("a matrix");
            let expected = difference(&duffing.0, element, &duffing.1, 0.1);
            assert_close(&matrix, &expected, 1e-10, "time and damping");
        }
    }
}

#[test]
fn symplectic_elements_are_symplectic() {
    let double = DoublePendulum { g: 1.0 };
    let start = legendre::state(&double, 0.0, &[1.2, -0.4], &[0.5, 1.5]).expect("a momentum");
    let henon = State {
        q: [0.1, 0.3],
        p: [0.4, -0.1],
    };
    for nodes in 2..=6 {
        for element in [
            Element::primal(nodes),
            Element::primal(nodes).lobatto(),
            Element::primal(nodes).quadrature(nodes + 3),
            Element::mixed(nodes),
        ] {
            let mut a = [0.0; 16];
            transition::of_step(&double, element, &start, 0.0, 0.2, &mut a).expect("a matrix");
            assert!(defect(&a) < 1e-13, "{element}: {:e}", defect(&a));
            transition::of_step(&HenonHeiles {}, element, &henon, 0.0, 0.2, &mut a).expect("one");
            assert!(defect(&a) < 1e-13, "{element}: {:e}", defect(&a));
        }
    }
}

/// The largest entry of AᵀJA − J for two coordinates.
fn defect(a: &[f64; 16]) -> f64 {
    let skew = |i: usize, j: usize| f64::from(i == j + 2) - f64::from(j == i + 2);
    let mut worst = 0.0_f64;
    for i in 0..4 {
        for j in 0..4 {
            let mut sum = -skew(i, j);
            for k in 0..4 {
                for l in 0..4 {
                    sum += a[k * 4 + i] * skew(k, l) * a[l * 4 + j];
                }
            }
            assert!(!sum.is_nan(), "entry ({i}, {j})");
            worst = worst.max(sum.abs());
        }
    }
    worst
}

#[test]
fn energy_is_kept_by_the_element_named_after_it() {
    let model = DoublePendulum { g: 1.0 };
    let start = legendre::state(&model, 0.0, &[1.5, -0.4], &[0.5, 0.5]).expect("a momentum");
    let energy =
        |state: &State<2>| legendre::energy(&model, 0.0, &state.q, &state.p).expect("a velocity");
    let end = run(&model, Element::energy_conserving(4), start, 0.05, 1000);
    // Quadrature error below round-off, and a random walk of a thousand roundings.
    let error = energy(&end) / energy(&start) - 1.0;
    assert!(error.abs() < 1e-13, "{error:e}");
}

#[test]
fn a_function_that_is_not_quadratic_in_velocities() {
    let model = Relativistic {};
    let start = State { q: [0.0], p: [3.0] };
    let energy =
        |state: &State<1>| legendre::energy(&model, 0.0, &state.q, &state.p).expect("a velocity");
    for element in families(5) {
        let end = run(&model, element, start, 0.05, 100);
        // Radau dissipates a little; all are of order seven or more.
        assert!((energy(&end) - energy(&start)).abs() < 1e-6, "{element}");
    }
    let v = legendre::velocity(&model, 0.0, &[0.0], &[1e3], &[0.0]).expect("below light");
    assert!((1.0 - v[0] - 5e-7).abs() < 1e-10);
}

#[test]
fn dense_output_joins_the_nodes() {
    let double = DoublePendulum { g: 9.81 };
    let start = legendre::state(&double, 0.0, &[1.2, -0.4], &[0.5, 1.5]).expect("a momentum");
    let henon = State {
        q: [0.1, 0.3],
        p: [0.4, -0.1],
    };
    for nodes in 2..=6 {
        for element in families(nodes) {
            joins(&double, element, start, nodes);
            joins(&HenonHeiles {}, element, henon, nodes);
        }
    }
}

#[track_caller]
fn joins<M>(model: &M, element: Element, start: State<2>, nodes: usize)
where
    M: Model<2>,
{
    let (t, h) = (0.25, 0.01);
    let mut stepper = Stepper::new(model, element, Control::default()).expect("valid");
    let mut state = start;
    stepper.advance(t, h, &mut state, &[]).expect("a step");
    let dense = stepper.dense(t, t + h);
    assert_eq!((dense.start(), dense.end()), (t, t + h));
    assert_eq!((dense.at(0.0), dense.at(1.0)), (start, state));
    let what = format!("{element}");
    // The polynomial itself, not the exception for τ = 1.
    assert_close(
        &vector(&dense.at(1.0 - 1e-16)),
        &vector(&state),
        4e-15,
        &what,
    );
    let middle = dense.at_time(t + 0.4 * h);
    let exact = run(model, Element::mixed(8), start, 0.4 * h, 1);
    // Order n: hⁿ = 10⁻²ⁿ times derivatives that grow by a factor of about five.
    let allowed = 100.0 * (5.0 * h).powi(nodes as i32) + 1e-14;
    assert_close(&vector(&middle), &vector(&exact), allowed, &what);
}

#[test]
fn impulses_arrive_in_full() {
    let model = OscillatorL {
        m: 2.0,
        d: 0.0,
        k: 0.0,
    };
    let start = State { q: [1.0], p: [1.0] };
    for element in families(4) {
        for time in [0.0, 0.03, 0.1] {
            let mut state = start;
            let mut stepper = Stepper::new(&model, element, Control::default()).expect("valid");
            let impulse = Impulse { time, value: [0.7] };
            stepper
                .advance(0.0, 0.1, &mut state, &[impulse])
                .expect("a step");
            assert!((state.p[0] - 1.7).abs() < 1e-15, "{element}");
            let exact = 1.0 + 0.05 + 0.35 * (0.1 - time);
            if matches!(
                element.family(),
                tfe_runtime::Family::Primal | tfe_runtime::Family::Mixed
            ) {
                assert!(
                    (state.q[0] - exact).abs() < 1e-15,
                    "{element}: {}",
                    state.q[0] - exact
                );
            }
            // At nodes the momentum jumps: the polynomial begins behind an impulse there, and ends before one.
            let dense = stepper.dense(0.0, 0.1);
            let (begin, end) = (dense.at(1e-16), dense.at(1.0 - 1e-16));
            let before = if time == 0.0 { 1.7 } else { 1.0 };
            let behind = if time == 0.1 { 1.0 } else { 1.7 };
            assert!((begin.p[0] - before).abs() < 4e-15, "{element}");
            assert!((end.p[0] - behind).abs() < 4e-15, "{element}");
            assert_eq!(dense.at(1.0), state, "{element}");
        }
    }
}

#[test]
fn steps_of_changing_length_and_direction() {
    let (model, start) = duffing();
    let lengths = [0.1, 0.02, 0.3, 0.3, 0.05, -0.05, -0.3, -0.3, -0.02, -0.1];
    let lengths = [&lengths[..2], &[0.01; 3], &lengths[2..5]].concat();
    let mut stepper = Stepper::new(&model, Element::mixed(8), Control::default()).expect("valid");
    let (mut t, mut state) = (0.0, start);
    for h in &lengths {
        stepper.advance(t, *h, &mut state, &[]).expect("forwards");
        t += h;
    }
    for h in lengths.iter().rev() {
        t -= h;
        stepper
            .advance(t + h, -h, &mut state, &[])
            .expect("backwards");
    }
    // Gauss methods are symmetric: the way back is the way there.
    assert_close(&vector(&state), &vector(&start), 1e-13, "there and back");
}

#[test]
fn a_rest_stays_a_rest() {
    let model = DoublePendulum { g: 9.81 };
    let start = State {
        q: [0.0, 0.0],
        p: [0.0, 0.0],
    };
    for element in families(4) {
        assert_eq!(run(&model, element, start, 0.1, 10), start, "{element}");
    }
    // Upside down sin π is not zero, but as small.
    let start = State {
        q: [std::f64::consts::PI, 0.0],
        p: [0.0, 0.0],
    };
    let end = run(&model, Element::mixed(4), start, 0.01, 10);
    assert!((end.q[0] - start.q[0]).abs() < 1e-14);
}

/// In a well, where the energy is zero but for the rounding of √2: its changes are no jumps.
#[test]
fn a_rest_without_energy_stays_one() {
    let start = State {
        q: [std::f64::consts::SQRT_2],
        p: [0.0],
    };
    let control = Control {
        solve: Solve::Newton,
        ..Control::default()
    };
    for element in families(4) {
        let (end, statistics) = run_with(&Wells {}, element, control, start, 0.1, 10);
        assert!((end.q[0] - start.q[0]).abs() < 1e-14, "{element}");
        assert_eq!(statistics.cuts, 0, "{element}");
    }
}
