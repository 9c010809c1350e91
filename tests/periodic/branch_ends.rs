//! Branches of periodic orbits that end where asked, those that stop, and questions without an answer.

use crate::continuation::{HARDENING, close};
use crate::models::Duffing;
use std::f64::consts::TAU;
use tfe::continuation::{ContinuationErrorKind, End};
use tfe::periodic::OrbitError;
use tfe::prelude::*;

#[test]
fn branches_run_backwards_and_end_where_asked() {
    let duffing = Duffing {
        alpha: 1.0,
        beta: 0.0,
        delta: 0.1,
        f: 0.5,
        omega: 2.0,
    };
    let continuation = || {
        Continuation::of(&duffing)
            .parameter(|duffing| &mut duffing.omega)
            .period(|duffing| TAU / duffing.omega)
    };
    let branch = continuation().range(2.0..0.5).run().expect("a branch");
    assert_eq!(branch.end(), Some(End::Range));
    assert!(branch.events().is_empty());
    for point in branch.points() {
        let omega = point.parameter;
        let exact = 0.5 / (1.0 - omega * omega).hypot(0.1 * omega);
        // The maximum of a parabola through three of 160 samples; the orbit itself has an error of 1e-8.
        close(point.amplitudes[0] / exact, 1.0, 1e-6);
    }
    let last = branch.points().last().expect("points");
    assert_eq!(last.parameter, 0.5);
    let short = continuation()
        .range(2.0..0.5)
        .max_points(5)
        .run()
        .expect("a branch");
    assert_eq!(short.points().len(), 5);
    assert_eq!(short.end(), Some(End::Points));
    let step = short.points()[0].parameter - short.points()[1].parameter;
    // The first step is a step of the parameter, up to the curvature of the branch.
    close(step, 0.01 * 1.5, 1e-3);
}

#[test]
fn questions_without_an_answer() {
    let duffing = HARDENING;
    let period = |duffing: &Duffing| TAU / duffing.omega;
    let plain = || Continuation::of(&duffing).period(period);
    let omega = || plain().parameter(|duffing| &mut duffing.omega);
    let kind = |continuation: Continuation<'_, Duffing, 1>| {
        let error = continuation.run().expect_err("no branch");
        assert!(error.partial().points().is_empty());
        error.kind().clone()
    };
    assert_eq!(kind(plain()), ContinuationErrorKind::NoParameter);
    assert_eq!(kind(omega()), ContinuationErrorKind::NoRange);
    let error = plain()
        .parameter(|duffing| &mut duffing.delta)
        .range(0.1..0.2)
        .run()
        .expect_err("no branch");
    assert_eq!(
        error.to_string(),
        "the model has no derivative with respect to this parameter: add `sensitivity(name)` to its `#[dynamics(...)]`; it has derivatives with respect to omega, f"
    );
    for range in [1.0..2.0, 0.5..0.8, 0.8..f64::INFINITY, f64::NAN..1.0] {
        assert!(matches!(
            kind(omega().range(range)),
            ContinuationErrorKind::Range { .. }
        ));
    }
    for step in [0.0, -0.1, f64::NAN] {
        assert!(matches!(
            kind(omega().range(0.8..2.0).step(step)),
            ContinuationErrorKind::Steps { .. }
        ));
    }
    let nothing = omega().range(0.8..2.0).elements(0);
    assert!(matches!(kind(nothing), ContinuationErrorKind::Start(_)));
    let unknown = omega().range(0.8..2.0).unknown_period(7.0);
    assert!(matches!(
        kind(unknown),
        ContinuationErrorKind::Start(OrbitError::ForcedPeriod)
    ));
}

#[test]
fn a_branch_that_stops_is_kept_so_far() {
    let duffing = HARDENING;
    let continuation = || {
        Continuation::of(&duffing)
            .parameter(|duffing| &mut duffing.omega)
            .range(0.8..3.5)
    };
    let stopped = |continuation: Continuation<'_, Duffing, 1>| {
        let error = continuation.run().expect_err("no branch");
        assert!(error.to_string().contains("`partial()`"));
        let ContinuationErrorKind::Step { parameter, .. } = *error.kind() else {
            panic!("{error}");
        };
        let partial = error.into_partial();
        let last = partial.points().last().expect("points");
        assert_eq!(last.parameter, parameter);
        assert_eq!(partial.end(), None);
        parameter
    };
    // Steps that are too long to turn around at the fold.
    let long = continuation()
        .period(|duffing| TAU / duffing.omega)
        .step(0.6)
        .smallest_step(0.6)
        .largest_step(0.6);
    assert!(stopped(long) < 2.3);
    // A given period that is no longer one of the equations.
    let broken = continuation().period(|duffing| {
        if duffing.omega < 1.5 {
            TAU / duffing.omega
        } else {
            f64::NAN
        }
    });
    assert!(stopped(broken) < 1.5);
}
