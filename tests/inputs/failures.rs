//! Invalid inputs, and functions that fail.

use crate::DRIVING;
use tfe::prelude::*;
use tfe::{InputError, RunErrorKind};

#[test]
fn misuse_is_told() {
    let start = DRIVING.state([1.0], [0.0]);
    let unknown = Simulation::new(&DRIVING)
        .input("torque", |_| 1.0)
        .run(start, 0.0..1.0)
        .unwrap_err();
    let InputError::Unknown { name, known } = (match unknown.kind() {
        RunErrorKind::Input(error) => error.clone(),
        other => panic!("{other}"),
    }) else {
        panic!("{unknown}");
    };
    assert_eq!((name.as_str(), &known[..]), ("torque", &["w", "u"][..]));
    assert_eq!(
        unknown.to_string(),
        "the model has no input `torque`, only `w`, `u`"
    );
    let table = |times: &[f64], values: &[f64]| {
        let run = Simulation::new(&DRIVING).table("u", times, values, Interpolation::Spline);
        run.steps(start, 0.0)
            .next()
            .unwrap()
            .unwrap_err()
            .to_string()
    };
    assert_eq!(
        table(&[0.0, 1.0], &[1.0]),
        "the table of input `u` is invalid: there must be as many values as times, and at least one, but there are 2 times and 1 values"
    );
    assert_eq!(
        table(&[0.0, 0.0], &[1.0, 2.0]),
        "the table of input `u` is invalid: the times must increase, but its time [1] is 0 after 0"
    );
    // Without a value of the input there is no state; the error says at which time and for which input.
    let nan = Simulation::new(&DRIVING)
        .step(0.1)
        .input("u", |t| if t < 0.5 { 0.0 } else { f64::NAN });
    let error = nan.run(start, 0.0..1.0).unwrap_err();
    let RunErrorKind::Input(InputError::Value { name, time, value }) = error.kind() else {
        panic!("{error}");
    };
    assert!(name == "u" && (0.5..0.6).contains(time) && value.is_nan());
    assert!(error.partial().last().q[0].is_finite());
    let mut run = Simulation::new(&DRIVING)
        .step(0.1)
        .hold(start, 0.0)
        .unwrap();
    run.set("u", f64::NAN);
    assert_eq!(
        run.advance().unwrap_err().to_string(),
        "input `u` was set to NaN, but it must be finite"
    );
    run.set("v", 1.0);
    assert!(matches!(
        run.advance(),
        Err(RunErrorKind::Input(InputError::Unknown { .. }))
    ));
    run.advance().unwrap();
    assert_eq!(run.node().t, 0.1);
    let without_step = Simulation::new(&DRIVING).hold(start, 0.0);
    let kind = without_step.map(|_| ()).unwrap_err();
    assert!(matches!(kind, RunErrorKind::Step { .. }));
    assert!(kind.to_string().contains("set it with `step(h)`"), "{kind}");
}

#[dynamics(coordinates(x), lagrangian = (dot(x)^2 - x^2)/2, input(u), force(x) = u, output(force) = u, event(middle) = x)]
struct Oscillator;

/// If a function panics or returns a number that is not finite, the run ends with an error that says when; what was
/// recorded before is kept.
#[test]
fn functions_that_fail_are_told() {
    let start = Oscillator.state([1.0], [0.0]);
    let simulation = Simulation::new(&Oscillator).step(0.1);
    let nan = |t: f64| if t > 2.0 { f64::NAN } else { 0.1 };
    let panics = |t: f64| {
        assert!(t < 2.0, "no wind beyond two seconds");
        0.1
    };
    let is_value = |kind: &RunErrorKind| match kind {
        RunErrorKind::Input(InputError::Value { name, time, value }) => {
            name == "u" && (2.0..2.1).contains(time) && value.is_nan()
        }
        _ => false,
    };
    let is_panic = |kind: &RunErrorKind| match kind {
        RunErrorKind::Input(InputError::Panicked { time }) => (1.89..2.01).contains(time),
        _ => false,
    };
    let error = simulation
        .clone()
        .input("u", nan)
        .run(start, 0.0..5.0)
        .expect_err("NaN");
    assert!(is_value(error.kind()), "{error}");
    assert!((error.partial().last().t - 2.0).abs() < 1e-12);
    let error = simulation
        .clone()
        .input("u", panics)
        .run(start, 0.0..5.0)
        .expect_err("a panic");
    assert!(is_panic(error.kind()), "{error}");
    assert!(error.partial().states().len() >= 19);
    // At the very start.
    let at_once = |_: f64| -> f64 { panic!("at once") };
    let error = simulation
        .clone()
        .input("u", at_once)
        .run(start, 1.0..5.0)
        .expect_err("a panic");
    assert_eq!(
        error.kind(),
        &RunErrorKind::Input(InputError::Panicked { time: 1.0 })
    );
    let mut steps = simulation.clone().input("u", at_once).steps(start, 1.0);
    assert!(steps.next().is_some_and(|step| step.is_err()) && steps.next().is_none());
    // In single steps, with an accuracy, and while events are searched.
    let mut steps = simulation.clone().input("u", panics).steps(start, 0.0);
    let error = steps.find_map(Result::err).expect("it ends");
    assert!(is_panic(&error) && steps.next().is_none());
    let mut steps = simulation.clone().input("u", nan).steps(start, 0.0);
    assert!(is_value(&steps.find_map(Result::err).expect("it ends")));
    let accurate = simulation
        .clone()
        .input("u", nan)
        .accuracy(1e-6)
        .run(start, 0.0..5.0);
    let error = accurate.expect_err("NaN");
    assert!(
        matches!(error.kind(), RunErrorKind::Input(InputError::Value { .. })),
        "{error}"
    );
    let watched = simulation
        .clone()
        .input("u", panics)
        .on("middle", Crossing::Either, |_| Act::Record)
        .run(start, 0.0..5.0)
        .expect_err("a panic");
    assert!(is_panic(watched.kind()) && watched.partial().events().len() == 1);
    // A failure does not affect the next run.
    let good = simulation.clone().input("u", nan).run(start, 0.0..1.9);
    assert_eq!(good.expect("before it fails").states().len(), 20);
}

/// If a function panics at the very start of a run with an accuracy, with an estimate, or of a continued run, the error
/// is as in any other run.
#[test]
fn functions_that_panic_at_once_are_told() {
    let start = Oscillator.state([1.0], [0.0]);
    let simulation = Simulation::new(&Oscillator).step(0.1);
    let panics = |_: f64| -> f64 { panic!("at once") };
    let broken = simulation.clone().input("u", panics);
    let check = |kind: &RunErrorKind| {
        let told = RunErrorKind::Input(InputError::Panicked { time: 1.0 });
        assert_eq!(kind, &told);
    };
    let accurate = broken.clone().accuracy(1e-6).run(start, 1.0..5.0);
    check(accurate.expect_err("a panic").kind());
    let estimated = broken.run_estimated(start, 1.0..5.0);
    check(estimated.expect_err("a panic").kind());
    let good = simulation.input("u", |_| 0.0).run(start, 0.0..1.0);
    let good = good.expect("a run");
    let resumed = broken.resume(good.checkpoint().expect("complete"), 5.0);
    check(resumed.expect_err("a panic").kind());
}

/// Functions are called for times within the span of a run only; outside they may be undefined.
#[test]
fn functions_are_not_asked_beyond_the_span() {
    // Without outputs of the input, which would be asked at nodes.
    #[dynamics(coordinates(x), lagrangian = (dot(x)^2 - x^2)/2, input(u), force(x) = u)]
    struct Silent;

    let wind = |t: f64| {
        assert!((2.0..=3.0).contains(&t), "no wind at {t}");
        t
    };
    let start = Silent.state([1.0], [0.0]);
    let run = Simulation::new(&Silent).step(0.1).input("u", wind);
    run.run(start, 2.0..3.0).expect("a run");
    for step in run.steps(start, 2.0).take(10) {
        step.expect("a step");
    }
}
