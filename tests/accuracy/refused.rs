//! Accuracies that cannot be met, and what is no accuracy: what the errors say.

use super::{PENDULUM_END, Pendulum, true_error};
use tfe::RunErrorKind;
use tfe::prelude::*;

#[dynamics(
    coordinates(a, b),
    lagrangian = dot(a)^2 + dot(b)^2/2 + dot(a)*dot(b)*cos(a - b) + 9.81*(2*cos(a) + cos(b)),
)]
struct DoublePendulum;

/// For a chaotic motion over too long a span the accuracy is refused; the error has the motion, its estimated error and
/// the time up to which it is accurate.
#[test]
fn what_cannot_be_met_is_an_error_with_a_horizon() {
    let start = DoublePendulum.state([3.0, 3.1], [0.0, 0.0]);
    let outcome = Simulation::new(&DoublePendulum)
        .accuracy(1e-9)
        .run(start, 0.0..60.0);
    let error = outcome.expect_err("errors grow by e every third of a second");
    let RunErrorKind::AccuracyMissed {
        asked,
        estimate,
        until,
    } = *error.kind()
    else {
        panic!("{error}");
    };
    assert!(asked == 1e-9 && estimate > 1e-9, "{error}");
    let until = until.expect("the beginning is good");
    assert!(1.0 < until && until < 40.0, "{until}");
    assert_eq!(error.partial().last().t, 60.0);
    // Up to that time, the accuracy is met.
    let shorter = Simulation::new(&DoublePendulum)
        .accuracy(1e-9)
        .run(start, 0.0..until / 2.0);
    let shorter = shorter.expect("a shorter motion");
    assert_eq!(shorter.horizon(1e-9), Some(until / 2.0));

    let round_off = Simulation::new(&Pendulum).accuracy(1e-18);
    let error = round_off
        .run(Pendulum.state([2.0], [0.0]), 0.0..10.0)
        .expect_err("roundings");
    assert!(
        matches!(error.kind(), RunErrorKind::AccuracyMissed { .. }),
        "{error}"
    );
    assert!(true_error(error.partial(), PENDULUM_END) < 1e-12);
}

/// For a pendulum at rest both runs agree to the last bit. Even so, an accuracy below the rounding unit must not be
/// promised.
#[test]
fn less_than_a_rounding_is_refused_at_once() {
    let start = Pendulum.state([2.0], [0.0]);
    let at_rest = Pendulum.state([0.0], [0.0]);
    for (start, asked) in [1e-17, 1e-20, 1e-100, 1e-300]
        .into_iter()
        .flat_map(|asked| [(start, asked), (at_rest, asked)])
    {
        let outcome = Simulation::new(&Pendulum)
            .accuracy(asked)
            .run(start, 0.0..1.0);
        let error = outcome.expect_err("roundings");
        let RunErrorKind::AccuracyMissed {
            asked: told,
            estimate,
            until,
        } = *error.kind()
        else {
            panic!("{error}");
        };
        assert!(
            told == asked && estimate > 1e-16 && until.is_none(),
            "{error}"
        );
        assert!(estimate < 1e-14, "{error}");
        assert!(error.partial().statistics().steps < 100);
    }
}

#[test]
fn what_is_no_accuracy_is_refused() {
    for accuracy in [0.0, -1e-3, 1.0, f64::NAN, f64::INFINITY] {
        for end in [0.0, 1.0] {
            let outcome = Simulation::new(&Pendulum)
                .accuracy(accuracy)
                .run(Pendulum.state([1.0], [0.0]), 0.0..end);
            let error = outcome.expect_err("no number between 0 and 1");
            assert!(
                matches!(error.kind(), RunErrorKind::Accuracy { .. }),
                "{error}"
            );
        }
    }
    let start = Pendulum.state([f64::NAN], [0.0]);
    let error = Simulation::new(&Pendulum)
        .accuracy(1e-3)
        .run(start, 0.0..1.0)
        .expect_err("no start");
    assert!(
        matches!(error.kind(), RunErrorKind::Start { .. }),
        "{error}"
    );
    let start = Pendulum.state([1.0], [0.0]);
    let error = Simulation::new(&Pendulum)
        .accuracy(1e-3)
        .run(start, 0.0..f64::NAN)
        .expect_err("no span");
    assert!(matches!(error.kind(), RunErrorKind::Span { .. }), "{error}");
    // An empty span: nothing to do, and no error.
    let motion = Simulation::new(&Pendulum)
        .accuracy(1e-3)
        .run(start, 2.0..2.0)
        .expect("an empty span");
    assert_eq!((motion.last().t, motion.error_estimate()), (2.0, 0.0));
    assert_eq!(motion.error_estimate_of("height"), Some(0.0));
}

#[dynamics(coordinates(x), lagrangian = dot(x)^2/2 + 1/x)]
struct Fall;

/// A fall into the centre ends at t = π/√8: for every accuracy there must be an error at that time, with the motion so
/// far, and not an endless search with shorter and shorter steps.
#[test]
fn a_motion_that_ends_keeps_what_there_is() {
    let start = Fall.state([1.0], [0.0]);
    let ends = std::f64::consts::PI / 8.0_f64.sqrt();
    for accuracy in [1e-3, 1e-6, 1e-9, 1e-12] {
        let error = Simulation::new(&Fall)
            .accuracy(accuracy)
            .run(start, 0.0..2.0)
            .expect_err("falls");
        println!("{error}");
        let RunErrorKind::Solve { time, step, .. } = *error.kind() else {
            panic!("{error}");
        };
        assert!((time - ends).abs() < 2.0 * step, "{time}, {step}");
        assert!(error.partial().states().len() > 1);
    }
}

/// A force that jumps with the velocity, from rest, with quadrature points at the ends of elements: the error is
/// proportional to the step size, so that the accuracy asked for would take 10⁹ steps. It is refused.
#[test]
fn what_would_take_too_many_steps_is_refused() {
    #[dynamics(
        coordinates(y),
        lagrangian = m*dot(y)^2/2 - y - k/2*min(y, 0)^2,
        force(y) = -sign(dot(y))/10 + select(t < 1, 1, 0),
    )]
    struct Bounce {
        m: f64,
        k: f64,
    }
    let bounce = Bounce {
        m: 1.0,
        k: 1.098_412_768_435_865_8,
    };
    let run = Simulation::new(&bounce).element(Element::primal(3).lobatto());
    let start = State {
        q: [-1.831_333_406_300_542_4],
        p: [0.0],
    };
    let run = run.accuracy(3.446_593_853_243_537_3e-4);
    let error = run
        .run(start, 0.0..2.027_077_867_746_391_4)
        .expect_err("too many steps");
    assert!(
        matches!(error.kind(), RunErrorKind::TooManySteps { .. }),
        "{error}"
    );
}

/// A bead that slides into the cusp of a curve has no motion beyond it, though single steps may jump across. The step
/// size must not be halved without end, as it once was.
#[test]
fn a_motion_that_ends_in_a_cusp_is_refused() {
    #[dynamics(coordinates(x, y), lagrangian = (dot(x)^2 + dot(y)^2)/2 - g*y, constraint(cusp) = y^3 - x^2)]
    struct Bead {
        g: f64,
    }
    let bead = Bead {
        g: 4.852_910_093_804_8,
    };
    let start = State {
        q: [0.017_136_246_428_218_385, 0.066_467_671_673_985_12],
        p: [0.033_592_203_433_136_625, 0.086_864_435_100_663_77],
    };
    let run = Simulation::new(&bead).element(Element::three_field(7));
    let run = run.accuracy(1.318_782_783_078_634e-3);
    let error = run.run(start, 0.0..1.34).expect_err("a cusp");
    let RunErrorKind::Solve { time, step, .. } = *error.kind() else {
        panic!("{error}");
    };
    // The bead slides up a little and then back into the cusp.
    assert!((0.15..0.25).contains(&time), "{time}");
    // The steps have not become shorter and shorter.
    assert!(step > 1e-7, "{step}");
    assert!(error.partial().last().t <= time);
}

/// An invalid largest step size is refused.
#[test]
fn the_longest_step_is_checked() {
    for step in [0.0, f64::NAN] {
        let run = Simulation::new(&Pendulum).step(step).accuracy(1e-6);
        let run = run.run(Pendulum.state([2.0], [0.0]), 0.0..1.0);
        let error = run.expect_err("no step");
        assert!(matches!(error.kind(), RunErrorKind::Step { .. }), "{error}");
    }
}

#[dynamics(
    coordinates(x),
    lagrangian = dot(x)^2/2 - x^2/2,
    force(x) = -c*dot(x),
    output(height) = 1 - x^2,
    output(depth) = sqrt(x - level),
)]
struct Damped {
    c: f64,
    level: f64,
}

#[dynamics(
    coordinates(x, y),
    lagrangian = (dot(x)^2 + dot(y)^2)/2 - 9.81*y,
    constraint(rod) = x^2 + y^2 - 1,
    output(depth) = ln(y - level),
)]
struct Hanging {
    level: f64,
}

/// An output that has no value is told with its time; it was "the step is …, but it must be finite and not zero".
#[test]
fn outputs_without_a_value_are_told() {
    let lost = |kind: &RunErrorKind| match kind {
        RunErrorKind::OutputNotFinite { output, time } => (output.clone(), *time),
        kind => panic!("{kind}"),
    };
    // x = cos t for c = 0: it falls below the level 1/2 at π/3.
    for c in [0.0, 0.1] {
        for level in [2.0, 0.5] {
            let model = Damped { c, level };
            let run = Simulation::new(&model).accuracy(1e-6);
            let error = run.run(model.state([1.0], [0.0]), 0.0..3.0);
            let (output, time) = lost(error.expect_err("there is no root").kind());
            assert_eq!(output, "depth");
            // At one of the times at which runs are compared.
            let first = if level > 1.0 { 0.0 } else { 1.0 };
            assert!(time > first && time <= 3.0, "{c} {level}: {time}");
        }
    }
    let model = Hanging { level: 0.0 };
    let run = Simulation::new(&model).accuracy(1e-6);
    let error = run.run(model.state([0.0, -1.0], [1.0, 0.0]), 0.0..3.0);
    let error = error.expect_err("there is no logarithm");
    assert_eq!(lost(error.kind()).0, "depth");
    assert!(
        error
            .to_string()
            .contains("output `depth` is not finite at t = "),
        "{error}"
    );
}

/// Where steps of any length differ, as those of a body without a mass, the message is not about a step that nobody gave.
#[test]
fn steps_that_all_differ_are_too_many() {
    let body = Body { m: 0.0 };
    let run = Simulation::new(&body).accuracy(1e-6);
    let error = run.run(body.state([1.0], [0.0]), 0.0..1.0);
    let error = error.expect_err("there is no motion");
    assert!(
        matches!(error.kind(), RunErrorKind::TooManySteps { .. }),
        "{error}"
    );
}

#[dynamics(coordinates(x), lagrangian = m/2*dot(x)^2 - x^2/2)]
struct Body {
    m: f64,
}
