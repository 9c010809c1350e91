//! Steps that fail.

use super::duffing;
use crate::common::*;
use tfe_runtime::step::{Control, Impulse, Stepper};
use tfe_runtime::{Element, LegendreError, Rule, Solve, State, StepError, legendre, transition};

#[test]
fn failures_are_typed_and_leave_the_state() {
    let (model, start) = duffing();
    let mut stepper = Stepper::new(&model, Element::mixed(4), Control::default()).expect("valid");
    let mut state = start;
    for h in [0.0, f64::NAN, f64::INFINITY] {
        let error = stepper
            .advance(0.0, h, &mut state, &[])
            .expect_err("no step");
        assert!(matches!(error, StepError::InvalidStep { .. }), "{error}");
    }
    let mut nowhere = State {
        q: [f64::NAN],
        p: [0.0],
    };
    assert_eq!(
        stepper.advance(0.0, 0.1, &mut nowhere, &[]),
        Err(StepError::NonFinite)
    );
    let endless = Impulse {
        time: 0.0,
        value: [f64::INFINITY],
    };
    assert_eq!(
        stepper.advance(0.0, 0.1, &mut state, &[endless]),
        Err(StepError::NonFinite)
    );
    assert_eq!(state, start);
    stepper
        .advance(0.0, 0.1, &mut state, &[])
        .expect("as good as new");
    let expected = run(&model, Element::mixed(4), start, 0.1, 1);
    assert_close(
        &vector(&state),
        &vector(&expected),
        2.0 * f64::EPSILON,
        "after failures",
    );

    let control = Control {
        max_iterations: 1,
        ..Control::default()
    };
    let mut stepper = Stepper::new(&model, Element::mixed(4), control).expect("valid");
    let error = stepper
        .advance(0.0, 0.1, &mut state, &[])
        .expect_err("one is too few");
    assert!(
        matches!(error, StepError::NewtonStalled { iterations: 1, .. }),
        "{error}"
    );

    let control = Control {
        max_iterations: 0,
        solve: Solve::FixedPoint,
        ..Control::default()
    };
    let mut stepper = Stepper::new(&model, Element::mixed(4), control).expect("valid");
    let error = stepper.advance(0.0, 0.1, &mut state, &[]);
    let error = error.expect_err("none is too few");
    assert!(
        matches!(error, StepError::FixedPointStalled { iterations: 0, .. }),
        "{error}"
    );

    let massless = OscillatorL {
        m: 0.0,
        d: 0.0,
        k: 1.0,
    };
    let singular = legendre::velocity(&massless, 0.0, &[1.0], &[1.0], &[0.0]);
    assert_eq!(singular, Err(LegendreError::Singular { coordinate: 0 }));

    let element = Element::mixed(4).with_rule(Rule::Gauss(2));
    assert!(Stepper::new(&model, element, Control::default()).is_err());
}

/// Neither the polynomial nor the matrix of a step that failed is that of the step before.
#[test]
fn a_failed_step_has_no_inside() {
    let (model, start) = duffing();
    let element = Element::mixed(4);
    let zero = State { q: [0.0], p: [0.0] };
    for ends_only in [false, true] {
        let mut stepper = Stepper::new(&model, element, Control::default()).expect("valid");
        if ends_only {
            stepper = stepper.ends_only();
        }
        let mut state = start;
        stepper.advance(0.0, 0.1, &mut state, &[]).expect("a step");
        let reached = state;
        for h in [0.0, f64::NAN] {
            let failed = stepper.advance(0.1, h, &mut state, &[]);
            failed.expect_err("no step");
            assert_eq!(state, reached);
            assert_eq!(stepper.dense(0.1, 0.2).at(0.5), zero);
            let matrix = stepper.transition(&mut [0.0; 4]);
            assert_eq!(matrix, Err(transition::TransitionError::NoStep));
        }
        let next = stepper.advance(0.1, 0.1, &mut state, &[]);
        next.expect("as good as new");
        let expected = run(&model, element, start, 0.1, 2);
        assert_close(&vector(&state), &vector(&expected), 1e-14, "after failures");
    }
}
