//! Parameters that are set by events: estimates of runs, and transition matrices if the values depend on the state.

use super::*;
use crate::largest::larger;
use tfe::periodic::OrbitError;
use tfe::sensitivity::Loss;

type Sets = fn(&tfe::Occurrence<'_, 1>) -> Settings<1>;

const SPRINGS: Oscillator = spring(4.0);

fn setting(sets: Sets) -> Simulation<'static, Oscillator, 1> {
    Simulation::new(&SPRINGS).element(Mixed::<8>).step(0.1).on(
        "middle",
        Crossing::Either,
        move |event| Act::Set(sets(event)),
    )
}

/// A mass moves freely until an event sets the stiffness of a spring. Outputs, here the energy of the spring, and their
/// estimates must use the parameters after the event, also if the run stops there.
#[test]
fn estimates_of_outputs_are_those_of_the_parameters_set() {
    let free = spring(0.0);
    let (speed, end): (f64, f64) = (1.03, 4.0);
    let potential = |t: f64| match t - 1.0 / speed {
        past if past > 0.0 => speed * speed / 2.0 * (2.0 * past).sin().powi(2),
        _ => 0.0,
    };
    for stops in [false, true] {
        let motion = Simulation::new(&free)
            .element(Mixed::<2>)
            .step(0.1)
            .on("middle", Crossing::Either, move |event| {
                if stops && !event.rises {
                    return Act::Stop;
                }
                Act::Set(Settings::new("k", 4.0))
            })
            .run_estimated(free.state([-1.0], [speed]), 0.0..end)
            .expect("a run");
        assert_eq!(motion.last().t < end, stops);
        let outputs = motion.outputs();
        let found = outputs.column("potential").expect("an output");
        let mut off = 0.0;
        assert_eq!(motion.states().len(), found.len());
        for (node, found) in motion.states().iter().zip(&found) {
            off = larger(off, (found - potential(node.t)).abs());
        }
        let off = off / (speed * speed / 2.0);
        let estimate = motion.error_estimate_of("potential").expect("an output");
        assert!(
            off > 1e-7 && 0.5 * off < estimate && estimate < 2.0 * off,
            "stops: {stops}: {estimate:e} for {off:e}"
        );
    }
}

/// A value that depends on the state affects the motion after the event, but matrices from state to state do not
/// contain this dependence: they are refused.
#[test]
fn matrices_refuse_settings_by_the_state() {
    #[track_caller]
    fn check(kind: &RunErrorKind) {
        let (event, parameter) = match kind {
            RunErrorKind::SetByState {
                event, parameter, ..
            } => (event.as_str(), parameter.as_str()),
            other => panic!("{other}"),
        };
        assert_eq!((event, parameter), ("middle", "k"));
    }

    let by_state: [Sets; 3] = [
        |event| Settings::new("k", 3.0 + event.v[0].abs()),
        |event| Settings::new("k", 3.0 + event.t),
        |event| Settings::new("m", 1.0).and("k", 4.0 + event.p[0] / 2.0),
    ];
    let start = SPRINGS.state([1.0], [0.0]);
    for sets in by_state {
        let simulation = setting(sets);
        simulation.run(start, 0.0..3.0).expect("a run");
        let error = simulation.run_linearised(start, 0.0..3.0);
        let error = error.expect_err("it depends on the state");
        check(error.kind());
        assert!((error.partial().last().t - PI / 4.0).abs() < 1e-9);
        let section = simulation.section("middle", Crossing::Rising, start, 0.0);
        let told = section.linearised().take(4).find_map(Result::err);
        check(&told.expect("it depends on the state"));
        let orbit = PeriodicOrbit::of_simulation(&simulation)
            .unknown_period(4.5)
            .guess_from(start)
            .solve();
        match orbit.map(|orbit| orbit.period()) {
            Err(OrbitError::Run(kind)) => check(&kind),
            other => panic!("{other:?}"),
        }
        // Derivatives by parameters are refused whatever is set.
        let error = simulation.run_sensitive(start, 0.0..3.0);
        let error = error.expect_err("it depends on parameters");
        assert!(matches!(error.kind(), RunErrorKind::SetUnsupported { .. }));
    }
}

/// The message names the caller's function, and not an internal one.
#[test]
fn refused_derivatives_name_their_call() {
    let (start, span) = (SPRINGS.state([1.0], [0.0]), 0.0..3.0);
    let simulation = setting(|_| Settings::new("k", 3.0));
    let told = |error: &tfe::RunError<1>, call: &str| {
        let text = error.kind().to_string();
        assert!(text.starts_with(&format!("`{call}`")), "{text}");
    };
    let error = simulation.run_sensitive(start, span.clone());
    told(&error.expect_err("it sets"), "run_sensitive");
    for loss in [
        Loss::output_at_end("potential"),
        Loss::integral("potential"),
    ] {
        let error = simulation.gradient(start, span.clone(), &loss);
        told(&error.expect_err("it sets"), "gradient");
        let error = simulation.hessian(start, span.clone(), &loss, ["k"]);
        told(&error.expect_err("it sets"), "hessian");
    }
}

/// Values that are the same for all neighbouring motions: they contain a coordinate that vanishes at the event, one
/// side of a jump, or a parameter.
#[test]
fn matrices_go_across_settings_that_stay() {
    let kept: [Sets; 4] = [
        |event| Settings::new("k", 2.0 + event.q[0]),
        |event| Settings::new("k", if event.v[0] < -1.99 { 1.0 } else { 3.0 }),
        |event| Settings::new("k", event.parameter("k").map_or(0.0, |k| 5.0 - k)),
        |event| Settings::new("k", 2.0).and_velocity([1.1 * event.v[0]]),
    ];
    let (start, span) = (SPRINGS.state([1.0], [0.0]), 0.0..3.0);
    for (number, sets) in kept.into_iter().enumerate() {
        let simulation = setting(sets);
        let run = simulation.run_linearised(start, span.clone());
        let run = run.unwrap_or_else(|error| panic!("{number}: {error}"));
        assert!(!run.motion().events().is_empty());
        let product = run.product();
        let end = |start: State<1>| {
            let motion = simulation.run(start, span.clone()).expect("a run");
            motion.last().state()
        };
        check_columns(&product, 0..2, (start, 5e-4), end);
    }
}

/// What has to depend on the state can be part of it: a coordinate whose momentum does not occur in the Hamiltonian is
/// constant between events, and is contained in the matrices.
#[test]
fn a_coordinate_takes_the_place_of_a_parameter() {
    #[dynamics(
        coordinates(x, k),
        momenta(p, s),
        hamiltonian = p^2/2 + k/2*x^2,
        event(middle) = x,
    )]
    struct Adapting;

    let simulation = Simulation::new(&Adapting).element(Mixed::<8>).step(0.1).on(
        "middle",
        Crossing::Either,
        |event| {
            Act::Restart(State {
                q: [event.q[0], 3.0 + event.v[0]],
                p: event.p,
            })
        },
    );
    let start = State {
        q: [1.0, 4.0],
        p: [0.1, 0.0],
    };
    let run = simulation.run_linearised(start, 0.0..5.0).expect("a run");
    assert_eq!(run.motion().events().len(), 2);
    let product = run.product();
    let end = |start: State<2>| {
        let motion = simulation.run(start, 0.0..5.0).expect("a run");
        motion.last().state()
    };
    check_columns(&product, 0..4, (start, 5e-4), end);
}

/// A pendulum with a rod whose bob drags a carriage along x; the carriage is loaded when it passes the bottom. With
/// another mass, constraints allow other momenta.
#[test]
fn what_constraints_allow_is_that_of_parameters_set() {
    #[dynamics(
        coordinates(x, y),
        lagrangian = ((1 + m)*dot(x)^2 + dot(y)^2)/2 - y,
        constraint(rod) = x^2 + y^2 - 1,
        event(bottom) = x,
        event(turn) = dot(x),
    )]
    struct Carriage {
        m: f64,
    }

    let model = Carriage { m: 0.5 };
    let simulation = Simulation::new(&model).element(Mixed::<8>).step(0.04).on(
        "bottom",
        Crossing::Either,
        |_| Act::Set(Settings::new("m", 4.0)),
    );
    let moved = |s: f64| {
        let (sin, cos) = (0.9 + s).sin_cos();
        model.state([sin, -cos], [0.2 * cos, 0.2 * sin])
    };
    let start = moved(0.0);
    let run = simulation.run_linearised(start, 0.0..4.0).expect("a run");
    assert!(!run.motion().events().is_empty());
    // Between the elements, nothing is lost in the directions that the constraint allows.
    let basis = tfe::constraints::tangent_basis(&model, 0.0, &start).expect("a basis");
    let whole = basis.tr_mul(&(run.product() * &basis));
    let mut product = nalgebra::DMatrix::identity(2, 2);
    for matrix in run.on_constraints().expect("bases") {
        product = matrix * product;
    }
    for (found, expected) in product.iter().zip(whole.iter()) {
        // Acts are differentiated by differences.
        let off = (found - expected).abs();
        assert!(off < 1e-8 * whole.amax(), "{product} for {whole}");
    }

    // Turning points before and after the carriage is loaded.
    let third = |s: f64| {
        let mut section = simulation.section("turn", Crossing::Either, moved(s), 0.0);
        let point = section.nth(2).expect("endless").expect("a point");
        numbers(&point.state())
    };
    let section = simulation.section("turn", Crossing::Either, start, 0.0);
    let mut product = nalgebra::DMatrix::identity(4, 4);
    for point in section.linearised().take(3) {
        let point = point.expect("a point");
        product = point.transition().expect("linearised") * product;
    }
    let begun = difference_over(5e-4, |s| numbers(&moved(s)), 0.0);
    let found = product * nalgebra::DVector::from_vec(begun);
    let expected = difference_over(5e-4, third, 0.0);
    let size = expected.iter().fold(0.0_f64, |size, x| size.max(x.abs()));
    for (found, expected) in found.iter().zip(&expected) {
        let off = (found - expected).abs();
        assert!(off < 1e-7 * size, "{found} for {expected}");
    }
}
