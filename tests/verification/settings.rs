//! Settings of absurd sizes: what makes no sense is refused, and what is only small gives no false warning.

use crate::models::Pendulum;
use std::error::Error;
use std::time::Duration;
use tfe::boundary::{BoundaryError, Component};
use tfe::continuation::ContinuationErrorKind;
use tfe::ensemble::EnsembleError;
use tfe::fidelity::FidelityError;
use tfe::periodic::OrbitError;
use tfe::prelude::*;
use tfe::work_precision::WorkPrecisionError;
use tfe::{AtError, InputError, MeshError, RunErrorKind};

const PENDULUM: Pendulum = Pendulum { k: 1.0 };

fn measured() -> WorkPrecision<'static, Pendulum, State<1>> {
    let start = PENDULUM.state([1.0], [0.0]);
    WorkPrecision::new(&PENDULUM, start, 0.0..1.0)
        .element(Mixed::<3>)
        .steps([0.1])
        .repeat_for(Duration::ZERO)
}

/// A tolerance that is not a number accepts nothing, one of a whole any guess; an uncertainty below zero counted as its
/// magnitude.
#[test]
fn diagrams_refuse_tolerances_and_uncertainties_that_are_none() {
    use WorkPrecisionError as E;
    for wrong in [f64::NAN, f64::INFINITY, -1.0, 1.0] {
        for problem in [
            measured().tolerance(wrong),
            measured().tolerances([1e-6, wrong]),
        ] {
            let told = problem.run().unwrap_err();
            assert!(matches!(told, E::Tolerance { .. }), "{told}");
        }
    }
    for wrong in [f64::NAN, f64::INFINITY, -1.0] {
        let told = measured().reference_uncertainty(wrong).run().unwrap_err();
        assert!(matches!(told, E::Uncertainty { .. }), "{told}");
    }
    let start = PENDULUM.state([1.0], [0.0]);
    let long = WorkPrecision::new(&PENDULUM, start, 0.0..1e300)
        .element(Mixed::<3>)
        .steps([1e-300]);
    let told = long.run().unwrap_err().to_string();
    assert!(
        told.contains("a span of 1e300 holds too many steps of 1e-300"),
        "{told}"
    );
}

/// Thirds of the shortest step that there is are of length zero: that shorter steps fail says nothing about the motion.
#[test]
fn the_shortest_steps_do_not_fail_to_resolve_a_motion() {
    for step in [5e-324, 1e-310, 1e-300] {
        let motion = Simulation::new(&PENDULUM)
            .step(step)
            .run(PENDULUM.state([1.0], [0.5]), 0.0..8.0 * step)
            .expect("a run");
        let warnings = motion.warnings();
        assert!(warnings.is_empty(), "{step:e}: {}", warnings[0]);
    }
}

/// 1e308 has 309 digits, and 5e-324 as many decimals.
#[test]
fn numbers_of_any_size_are_short_in_messages() {
    let name = String::from("k");
    let errors = |value: f64| -> Vec<Box<dyn Error>> {
        let (name, component) = (name.clone(), Component::Momentum(0));
        vec![
            Box::new(RunErrorKind::Parameter {
                name: name.clone(),
                value,
            }),
            Box::new(InputError::Value {
                name,
                time: value,
                value,
            }),
            Box::new(AtError::Outside {
                time: value,
                start: value,
                end: value,
            }),
            Box::new(BoundaryError::Value { component, value }),
            Box::new(MeshError::Weight {
                element: 1,
                weight: value,
            }),
            Box::new(OrbitError::Number {
                what: "energy",
                value,
            }),
            Box::new(OrbitError::Stopped { time: value }),
            Box::new(ContinuationErrorKind::Range {
                start: value,
                end: value,
                value,
            }),
            Box::new(ContinuationErrorKind::Steps {
                step: value,
                smallest: value,
                largest: value,
            }),
            Box::new(FidelityError::Accuracy { accuracy: value }),
            Box::new(WorkPrecisionError::Span {
                start: value,
                end: value,
            }),
            Box::new(stability::ModeError::Step { step: value }),
        ]
    };
    for (value, short) in [(1e308, "1e308"), (-1e308, "-1e308"), (5e-324, "5e-324")] {
        for error in errors(value) {
            let told = error.to_string();
            assert!(told.contains(short) && told.len() < 240, "{told}");
        }
    }
}

/// No element ends at a break at NaN, so that a jump of a force there would be stepped over without a warning.
#[test]
fn breaks_at_no_time_are_refused() {
    let start = PENDULUM.state([1.0], [0.0]);
    let broken = Simulation::new(&PENDULUM).step(0.1).break_at(f64::NAN);
    let run = broken.run(start, 0.0..1.0).expect_err("no time");
    assert_eq!(*run.kind(), RunErrorKind::Break);
    let step = broken.steps(start, 0.0).next().expect("an error");
    assert_eq!(step.err(), Some(RunErrorKind::Break));
    let accurate = broken.accuracy(1e-6).run(start, 0.0..1.0);
    assert_eq!(*accurate.expect_err("no time").kind(), RunErrorKind::Break);
    let ensemble = Ensemble::new(&PENDULUM).step(0.1).break_at(f64::NAN);
    let ends = ensemble.run(&[start], 0.0..1.0).err();
    assert_eq!(ends, Some(EnsembleError::Run(RunErrorKind::Break)));
    let never = Simulation::new(&PENDULUM).step(0.1).break_at(f64::INFINITY);
    assert!(never.run(start, 0.0..1.0).is_ok());
}

/// The user has given no step: an error that names one explains nothing.
#[test]
fn spans_of_absurd_lengths() {
    let start = PENDULUM.state([1.0], [0.0]);
    let run = |run: Simulation<'_, Pendulum, 1>| run.run(start, -1e308..1e308).err();
    for long in [
        run(Simulation::new(&PENDULUM)),
        run(Simulation::new(&PENDULUM).step(1e300)),
    ] {
        let long = long.expect("no length");
        assert!(matches!(long.kind(), RunErrorKind::Span { .. }), "{long}");
    }
    let accurate = Simulation::new(&PENDULUM).accuracy(1e-3);
    let long = accurate.run(start, -1e308..1e308).expect_err("no length");
    assert!(matches!(long.kind(), RunErrorKind::Span { .. }), "{long}");
    let short = Simulation::new(&PENDULUM).run(start, 0.0..5e-324);
    let short = short.expect("one step");
    assert_eq!((short.states().len(), short.last().t), (2, 5e-324));
}
