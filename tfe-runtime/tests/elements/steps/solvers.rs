//! How the equations of a step are solved: fixed point and Newton's method, factors that are kept, stiff models.

use super::{duffing, families};
use crate::common::*;
use tfe_runtime::step::{Control, Stepper};
use tfe_runtime::{Element, Solve, State, StepError};

#[test]
fn the_solvers_agree_and_count() {
    let (model, start) = duffing();
    for element in families(4) {
        let end = |solve| {
            let control = Control {
                solve,
                ..Control::default()
            };
            run_with(&model, element, control, start, 0.1, 30)
        };
        let (auto, statistics) = end(Solve::Auto);
        let (fixed, _) = end(Solve::FixedPoint);
        let (newton, newton_statistics) = end(Solve::Newton);
        // Thirty steps of a few roundings each.
        assert_close(
            &vector(&fixed),
            &vector(&newton),
            2e-14,
            &format!("{element}"),
        );
        assert_close(
            &vector(&auto),
            &vector(&newton),
            2e-14,
            &format!("{element}"),
        );
        assert_eq!(
            (statistics.steps, statistics.fallbacks),
            (30, 0),
            "{element}"
        );
        assert_eq!(statistics.iterations, statistics.fixed_point_iterations);
        // A larger matrix is kept from step to step while it serves, at the price of an iteration here and there.
        assert!(newton_statistics.factorizations >= 1, "{newton_statistics}");
        assert!(newton_statistics.iterations < 30 * 9, "{newton_statistics}");
    }
}

#[test]
fn a_linear_autonomous_model_is_factored_once() {
    let l = OscillatorL {
        m: 1.3,
        d: 0.1,
        k: 50.0,
    };
    let h = OscillatorH {
        m: 1.3,
        d: 0.1,
        k: 50.0,
    };
    let start = State { q: [0.4], p: [1.0] };
    for element in families(4) {
        let (from_l, counts) = run_with(&l, element, Control::default(), start, 0.3, 50);
        assert_eq!(
            (counts.factorizations, counts.fixed_point_iterations),
            (1, 0),
            "{element}"
        );
        // Two a step, and one more for the first, which starts from nothing.
        assert!(counts.iterations <= 2 * 50 + 1, "{element}: {counts}");
        let (from_h, counts) = run_with(&h, element, Control::default(), start, 0.3, 50);
        assert_eq!(
            (counts.factorizations, counts.fixed_point_iterations),
            (1, 0),
            "{element}"
        );
        assert_close(
            &vector(&from_l),
            &vector(&from_h),
            1e-12,
            &format!("{element}"),
        );
    }
}

#[test]
fn a_stiff_model_falls_back_and_remembers() {
    let model = Stiff { k: 1e8 };
    let start = State {
        q: [1e-5, 1.0],
        p: [0.0, 0.5],
    };
    let (end, statistics) = run_with(
        &model,
        Element::mixed(4),
        Control::default(),
        start,
        0.1,
        100,
    );
    let control = Control {
        solve: Solve::Newton,
        ..Control::default()
    };
    let (newton, _) = run_with(&model, Element::mixed(4), control, start, 0.1, 100);
    assert!(
        statistics.fallbacks >= 1 && statistics.fallbacks <= 10,
        "{statistics}"
    );
    assert_close(&end.q, &newton.q, 1e-12, "coordinates");
    let control = Control {
        solve: Solve::FixedPoint,
        ..Control::default()
    };
    let mut stepper = Stepper::new(&model, Element::mixed(4), control).expect("valid");
    let mut state = start;
    let error = stepper
        .advance(0.0, 0.1, &mut state, &[])
        .expect_err("no contraction");
    assert!(
        matches!(
            error,
            StepError::FixedPointStalled { .. } | StepError::NonFinite
        ),
        "{error}"
    );
    assert_eq!(state, start);
}
