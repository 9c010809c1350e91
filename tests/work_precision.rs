//! Work–precision diagrams: slopes, rounding floors, failures, Pareto fronts, files.

mod common;

use common::{list, number, reference, word};
use std::time::Duration;
use tfe::RunErrorKind;
use tfe::prelude::*;
use tfe::work_precision::{
    Cost, Curve, Measurements, PeerRun, Point, Reference, SaveError, WorkPrecisionError,
};

/// A pendulum, H = p²/2 − cos q.
#[dynamics(coordinates(q), momenta(p), hamiltonian = p^2/2 - cos(q))]
struct Pendulum {}

#[dynamics(coordinates(x), lagrangian = dot(x)^2/2 - k/4*x^4)]
struct Quartic {
    k: f64,
}

#[dynamics(coordinates(x, y), lagrangian = m/2*(dot(x)^2 + dot(y)^2) - m*g*y, constraint(rod) = x^2 + y^2 - l^2)]
struct RodPendulum {
    m: f64,
    l: f64,
    g: f64,
}

/// The initial state of the pendulum in the table of references, and its state at t = 10 with 32 digits.
const START: State<1> = State { q: [2.0], p: [0.0] };

fn end_of_table() -> State<1> {
    let table = reference("trajectories");
    let cases = list(&table["cases"]);
    let case = cases
        .iter()
        .find(|case| word(&case["name"]) == "pendulum_unit");
    let states = list(&case.expect("the table has this pendulum")["states"]);
    let state = states.iter().find(|state| number(&state["t"]) == 10.0);
    let state = list(&state.expect("the table has t = 10")["state"]);
    State {
        q: [number(&state[0])],
        p: [number(&state[1])],
    }
}

fn pendulum(model: &Pendulum) -> WorkPrecision<'_, Pendulum, State<1>> {
    // The tests check counts and errors, not times.
    WorkPrecision::new(model, START, 0.0..10.0).repeat_for(Duration::ZERO)
}

fn halved(from: f64, count: i32) -> impl Iterator<Item = f64> {
    (0..count).map(move |k| from * 0.5_f64.powi(k))
}

/// One pendulum with two elements of order 4 and one of order 10.
fn measured() -> Measurements {
    let model = Pendulum {};
    let problem = pendulum(&model)
        .element(Primal::<3>)
        .element(Mixed::<3>)
        .element(Mixed::<6>);
    problem.steps(halved(0.4, 7)).run().unwrap()
}

#[test]
fn slopes_are_the_orders() {
    let measured = measured();
    for curve in &measured.curves()[..2] {
        assert_eq!(curve.element().order(), 4);
        for slope in [curve.slope_q(), curve.slope_p(), curve.slope()] {
            let slope = slope.unwrap();
            assert!((slope.exponent - 4.0).abs() < 0.3, "{slope:?}");
            assert!(slope.points >= 3, "{slope:?}");
        }
        // The error of the shortest step, 0.00625, is still far above rounding.
        assert_eq!(curve.floor(), None);
    }
    let model = Pendulum {};
    let problem = pendulum(&model).element(Mixed::<4>);
    let measured = problem.steps(halved(0.4, 5)).run().unwrap();
    let steep = measured.curves()[0].slope().unwrap();
    assert!((steep.exponent - 6.0).abs() < 0.3, "{steep:?}");
    assert!(steep.points >= 3, "{steep:?}");
}

#[test]
fn high_orders_end_at_a_floor_of_round_off() {
    let floor = measured().curves()[2].floor().unwrap();
    // The floor is a few rounding errors of up to 1600 steps.
    assert!(floor < 1e-13, "{floor:e}");
}

#[test]
fn the_computed_reference_is_that_of_the_table() {
    let model = Pendulum {};
    let end = end_of_table();
    let problem = || pendulum(&model).element(Mixed::<6>).steps([0.5, 0.2]);
    let computed = problem().run().unwrap();
    let Reference::Computed { uncertainty, .. } = *computed.reference() else {
        panic!("{:?}", computed.reference());
    };
    assert!(
        (f64::EPSILON..1e-13).contains(&uncertainty),
        "{uncertainty:e}"
    );
    let given = problem().reference_end(end.q, end.p).run().unwrap();
    assert!(matches!(given.reference(), Reference::Given { .. }));
    assert_eq!(computed.points().count(), given.points().count());
    for (a, b) in computed.points().zip(given.points()) {
        let (a, b) = (a.measured().unwrap(), b.measured().unwrap());
        // The scales differ: the largest state of ten, or of start and end. Both momenta are within a factor of two.
        assert!((a.error_q - b.error_q).abs() < 1e-13 + 0.2 * b.error_q);
        assert!(a.error_p < 2.0 * b.error_p && b.error_p < 2.0 * a.error_p);
    }
}

#[test]
fn a_reference_is_checked_by_steps_that_differ() {
    // Times to compare every 0.01: steps of 0.1, 0.05 and 0.025 would have no nodes at most of them, and equal runs
    // would prove nothing.
    let model = Quartic { k: 1e6 };
    let measured = WorkPrecision::new(&model, model.state([1.0], [0.0]), 0.0..0.1)
        .element(Mixed::<6>)
        .steps([0.1, 1e-4])
        .repeat_for(Duration::ZERO)
        .run()
        .unwrap();
    let Reference::Computed { step, .. } = *measured.reference() else {
        panic!("{:?}", measured.reference());
    };
    // The period is 0.0074.
    assert!(step < 0.007, "{step}");
    let fine = measured.points().last().and_then(Point::error);
    assert!(fine.unwrap() < 1e-8, "{measured:?}");
}

#[test]
fn errors_against_a_function_are_relative_and_include_those_on_the_way() {
    // The oscillator x'' = −x from (1, 0).
    #[dynamics(coordinates(x), lagrangian = dot(x)^2/2 - x^2/2)]
    struct Oscillator {}
    let model = Oscillator {};
    let measured = WorkPrecision::new(&model, model.state([1.0], [0.0]), 0.0..3.0)
        .element(Mixed::<2>)
        .steps([0.1])
        .reference(|t: f64| ([t.cos()], [-t.sin()]))
        .repeat_for(Duration::ZERO)
        .run()
        .unwrap();
    let point = measured.points().next().unwrap().measured().unwrap();
    // The midpoint rule rotates by 2 atan(h/2) per step: its phase error is h²/12 · t, here 0.0025 at the end.
    let behind = 3.0 - 30.0 * 2.0 * 0.05_f64.atan();
    // The scales: |q_ref| is one at the start, and |p_ref| is largest at t = 1.5 among the times compared.
    let scale = 1.5_f64.sin();
    let (q, p) = (
        (3.0 - behind).cos() - 3.0_f64.cos(),
        (3.0 - behind).sin() - 3.0_f64.sin(),
    );
    assert!((point.error_q - q.abs()).abs() < 1e-13);
    assert!((point.error_p - p.abs() / scale).abs() < 1e-13);
    // With the same phase error, the error of the coordinate is largest where it moves fastest.
    assert!(point.max_error_q > 2.0 * point.error_q);
    assert!(point.energy_error < 1e-13);
    assert_eq!((point.statistics.steps, point.repetitions), (30, 1));
}

#[test]
fn runs_that_fail_are_kept_and_the_others_made() {
    let model = Quartic { k: 1e6 };
    let measured = WorkPrecision::new(&model, model.state([1.0], [0.0]), 0.0..0.1)
        .element(Mixed::<3>)
        .steps([0.05, 1e-4])
        .solver(Solve::FixedPoint)
        .solver(Solve::Newton)
        .run()
        .unwrap();
    assert_eq!(measured.curves().len(), 2);
    let fixed_point = &measured.curves()[0];
    assert_eq!(
        (fixed_point.solve(), fixed_point.failed()),
        (Solve::FixedPoint, 1)
    );
    let [failed, good] = fixed_point.points() else {
        panic!("{:?}", fixed_point.points());
    };
    assert!(matches!(
        failed.outcome,
        Err(RunErrorKind::Solve { element: 0, .. })
    ));
    assert_eq!((failed.step, failed.error()), (0.05, None));
    // The frequency is 847 at this amplitude. An error of order 4 is below (hω)⁴ ωt = 4e-3.
    assert!(good.error().unwrap() < 4e-3, "{measured:?}");
    assert_eq!(
        measured.failures().count(),
        measured.curves().iter().map(Curve::failed).sum::<usize>()
    );
    let csv = measured.to_csv();
    let failure = csv
        .lines()
        .find(|line| line.contains("FixedPoint,0.05,"))
        .unwrap();
    assert!(failure.contains("element 0 (t = 0"), "{failure}");
}

#[test]
fn a_front_is_a_front() {
    let measured = measured();
    for cost in [Cost::Time, Cost::Evaluations, Cost::Iterations, Cost::Steps] {
        let measured = measured.clone().against(cost);
        let front = measured.front();
        assert!(!front.is_empty());
        let place = |point: &Point| {
            let error = point
                .error()
                .unwrap()
                .max(measured.reference().uncertainty());
            (point.cost(cost).unwrap(), error)
        };
        for pair in front.windows(2) {
            let (a, b) = (place(pair[0]), place(pair[1]));
            assert!(a.0 <= b.0 && a.1 > b.1, "{a:?} {b:?}");
        }
        for point in measured.points() {
            let (cost, error) = place(point);
            let beaten = front.iter().any(|one| {
                let (least, best) = place(one);
                least <= cost && best <= error
            });
            assert!(beaten, "{cost} {error}");
        }
    }
    // Of elements of order 4 and order 10 with the same numbers of steps, the second one reaches 1e-10 first.
    let best = measured
        .against(Cost::Steps)
        .fastest(1e-10)
        .cloned()
        .unwrap();
    assert_eq!(best.element, Element::mixed(6));
}

#[test]
fn points_at_the_floor_of_the_reference_are_marked() {
    let model = Pendulum {};
    let end = end_of_table();
    let measured = pendulum(&model)
        .element(Mixed::<3>)
        .steps(halved(0.4, 8))
        .reference_end(end.q, end.p)
        .reference_uncertainty(1e-6)
        .run()
        .unwrap();
    let curve = &measured.curves()[0];
    let marked: Vec<_> = curve
        .measured()
        .map(|(_, one)| one.at_reference_floor)
        .collect();
    assert!(!marked[0] && marked[7], "{marked:?}");
    for (_, one) in curve.measured() {
        assert_eq!(one.at_reference_floor, one.error() <= 1e-6);
    }
    // Errors below the accuracy of the reference are never reported as reached.
    assert!(curve.fastest(1e-7).is_none() && measured.fastest(1e-7).is_none());
    assert!(curve.fastest(1e-5).is_some());
}

/// A pendulum that starts horizontally and at rest has an energy of 6e-17 by rounding; relative to that, energy errors
/// of 1e-9 would be enormous.
#[test]
fn changes_beside_an_energy_that_is_a_rounding_are_absolute() {
    let model = Pendulum {};
    let start = State {
        q: [std::f64::consts::FRAC_PI_2],
        p: [0.0],
    };
    let measured = WorkPrecision::new(&model, start, 0.0..10.0)
        .element(Mixed::<4>)
        .steps([0.1])
        .repeat_for(Duration::ZERO)
        .run()
        .unwrap();
    let run = Simulation::new(&model).element(Mixed::<4>).step(0.1);
    let motion = run.run(start, 0.0..10.0).unwrap();
    assert!(motion.energies()[0] != 0.0 && motion.energy_error() < 1e-6);
    // The errors at all nodes: rounding errors of a hundred steps with energies of order one.
    let told = measured.curves()[0].points()[0].measured().unwrap();
    let off = (told.energy_error - motion.energy_error()).abs();
    assert!(off < 1e-13, "{off:e}");
}

#[test]
fn constrained_models_have_their_residual() {
    let model = RodPendulum {
        m: 1.0,
        l: 1.0,
        g: 9.81,
    };
    let start = model
        .consistent_state([1.0, 0.0], [0.0, 0.0])
        .unwrap()
        .state;
    let measured = WorkPrecision::new(&model, start, 0.0..1.0)
        .element(Mixed::<3>)
        .element(Mixed::<4>)
        .steps([0.1, 0.05, 0.025])
        .repeat_for(Duration::ZERO)
        .run()
        .unwrap();
    for point in measured.points() {
        let one = point.measured().unwrap();
        // Solved up to rounding; lengths are one, and velocities below five.
        assert!((0.0..1e-12).contains(&one.constraint_position), "{one:?}");
        assert!((0.0..1e-11).contains(&one.constraint_velocity), "{one:?}");
        assert!(one.constraint_position + one.constraint_velocity > 0.0);
    }
    let slope = measured.curves()[0].slope().unwrap();
    assert!(slope.exponent > 3.0, "{slope:?}");
    let off = State {
        q: [1.1, 0.0],
        p: [0.0, 0.0],
    };
    let problem = WorkPrecision::new(&model, off, 0.0..1.0)
        .element(Mixed::<3>)
        .steps([0.1]);
    assert!(matches!(
        problem.run(),
        Err(WorkPrecisionError::Start(RunErrorKind::Inconsistent { .. }))
    ));
}

#[test]
fn what_cannot_be_measured_is_said() {
    use WorkPrecisionError as E;
    let model = Pendulum {};
    let of = |span, elements: &[Element], steps: &[f64]| {
        let problem = WorkPrecision::new(&model, START, span);
        let problem = problem.elements(elements.iter().copied());
        problem.steps(steps.iter().copied()).run().unwrap_err()
    };
    let mixed = &[Element::mixed(3)];
    assert_eq!(of(0.0..1.0, &[], &[0.1]), E::NoElements);
    assert_eq!(of(0.0..1.0, mixed, &[]), E::NoSteps);
    assert!(matches!(
        of(0.0..1.0, &[Element::mixed(1)], &[0.1]),
        E::Element(_)
    ));
    assert!(matches!(of(1.0..1.0, mixed, &[0.1]), E::Span { .. }));
    assert!(matches!(of(0.0..f64::NAN, mixed, &[0.1]), E::Span { .. }));
    assert!(matches!(of(0.0..1.0, mixed, &[0.1, 0.0]), E::Step { .. }));
    assert!(matches!(
        of(0.0..1e300, mixed, &[1e-300]),
        E::TooManySteps { .. }
    ));
    let lost = State {
        q: [f64::NAN],
        p: [0.0],
    };
    let problem = WorkPrecision::new(&model, lost, 0.0..1.0)
        .element(Mixed::<3>)
        .steps([0.1]);
    assert!(matches!(
        problem.run(),
        Err(E::Start(RunErrorKind::Start { .. }))
    ));
    let problem = pendulum(&model).element(Mixed::<3>).steps([0.1]);
    let problem = problem.reference(|_| ([f64::NAN], [0.0]));
    let error = problem.run().unwrap_err();
    assert!(matches!(error, E::ReferenceValue { .. }));
    assert!(error.to_string().contains("not finite"));
}

#[test]
fn files_by_their_ending() {
    let folder = std::env::temp_dir().join(format!("tfe-work-precision-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let measured = measured();
    let path = folder.join("table.csv");
    measured.save(&path).unwrap();
    let text = std::fs::read_to_string(&path).unwrap();
    let mut lines = text.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let header = lines.next().unwrap();
    let column = |name: &str| header.iter().position(|one| *one == name).unwrap();
    let front = measured.front();
    let mut count = 0;
    for (line, point) in lines.zip(measured.points()) {
        let one = point.measured().unwrap();
        let read = |name: &str| line[column(name)].parse::<f64>().unwrap();
        assert_eq!(line.len(), header.len());
        assert_eq!(line[column("element")], point.element.to_string());
        for (name, value) in [
            ("step", point.step),
            ("error_q", one.error_q),
            ("error_p", one.error_p),
            ("energy_error", one.energy_error),
            ("seconds", one.seconds),
            (
                "residual_evaluations",
                one.statistics.residual_evaluations as f64,
            ),
        ] {
            assert_eq!(read(name), value, "{name}");
        }
        let on_front = front.contains(&point);
        assert_eq!(line[column("on_front")], on_front.to_string());
        count += 1;
    }
    assert_eq!(count, 21);

    let svg = measured.save(folder.join("chart.svg"));
    let html = measured.save(folder.join("page.html"));
    if cfg!(feature = "charts") {
        svg.unwrap();
        html.unwrap();
        let svg = std::fs::read_to_string(folder.join("chart.svg")).unwrap();
        assert!(svg.contains("Mixed::&lt;6&gt;") && svg.contains("time of the run"));
        let html = std::fs::read_to_string(folder.join("page.html")).unwrap();
        assert!(html.contains("<svg") && html.contains("slope of q"));
    } else {
        assert!(matches!(svg, Err(SaveError::NoCharts { .. })));
        assert!(matches!(html, Err(SaveError::NoCharts { .. })));
    }
    assert!(matches!(
        measured.save(folder.join("chart.pdf")),
        Err(SaveError::UnknownEnding { .. })
    ));
    assert!(matches!(
        measured.save(folder.join("no/such/folder.csv")),
        Err(SaveError::Io { .. })
    ));
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn backwards_and_with_a_shorter_last_step() {
    let model = Pendulum {};
    let end = end_of_table();
    let measured = WorkPrecision::new(&model, end, 10.0..0.0)
        .element(Mixed::<4>)
        .steps([0.3, 0.07])
        .reference_end(START.q, START.p)
        .repeat_for(Duration::ZERO)
        .run()
        .unwrap();
    let errors: Vec<_> = measured.points().filter_map(Point::error).collect();
    assert_eq!(errors.len(), 2);
    // Order 6: the ratio of the step sizes to the power 6 is 6000.
    assert!(
        errors[0] < 1e-3 && errors[1] < errors[0] / 1000.0,
        "{errors:?}"
    );
    let steps: Vec<_> = measured
        .points()
        .map(|point| point.cost(Cost::Steps))
        .collect();
    assert_eq!(steps, [Some(34.0), Some(143.0)]);
}

/// Leapfrog for the pendulum of the table, with a clock that always returns the same time.
fn leapfrog(step: f64) -> PeerRun<State<1>> {
    let (mut end, steps) = (START, (10.0 / step).round() as u64);
    for _ in 0..steps {
        end.p[0] -= step / 2.0 * end.q[0].sin();
        end.q[0] += step * end.p[0];
        end.p[0] -= step / 2.0 * end.q[0].sin();
    }
    PeerRun {
        end,
        time: Duration::from_micros(steps),
        evaluations: steps,
    }
}

fn beside_leapfrog() -> Measurements {
    let model = Pendulum {};
    let end = end_of_table();
    pendulum(&model)
        .element(Mixed::<3>)
        .steps([0.2, 0.1])
        .reference_end(end.q, end.p)
        .peer("leapfrog, by hand", [0.1, 0.01, 0.001], |step| {
            Ok(leapfrog(step))
        })
        .peer("none", [1.0], |_| Err("it \"never\" runs".into()))
        .run()
        .unwrap()
}

#[test]
fn other_integrators_stand_beside_ours() {
    let measured = beside_leapfrog();
    let [peer, none] = measured.peers() else {
        panic!("{:?}", measured.peers());
    };
    assert_eq!((peer.name(), peer.failed()), ("leapfrog, by hand", 0));
    let errors: Vec<f64> = peer
        .points()
        .iter()
        .map(|point| point.measured().unwrap().error())
        .collect();
    // Order two, with step sizes a factor of ten apart; with the longest step the error is not quite asymptotic.
    for pair in errors.windows(2) {
        assert!((pair[0] / pair[1] / 100.0 - 1.0).abs() < 0.1, "{errors:?}");
    }
    // The error has the same definition as ours: compared with the table, relative to the larger of start and end.
    let (known, run) = (end_of_table(), leapfrog(0.01));
    let one = peer.points()[1].measured().unwrap();
    let expected = (run.end.p[0] - known.p[0]).abs() / known.p[0].abs();
    assert!((one.error_p - expected).abs() < 1e-14, "{one:?}");
    assert_eq!((one.evaluations, one.seconds), (1000, 1e-3));
    assert_eq!(none.failed(), 1);
    assert!(none.points()[0].outcome.is_err());
    // The cheapest run with an error at most that large, and none for smaller errors than it reaches.
    let (found, point) = measured.fastest_peer(errors[1]).unwrap();
    assert_eq!((found.name(), point.setting), (peer.name(), 0.01));
    assert!(measured.fastest_peer(errors[2] / 2.0).is_none());
    let front = measured.front_of_peers();
    assert_eq!(front.len(), 3);
    assert!(
        front
            .windows(2)
            .all(|pair| pair[0].0 < pair[1].0 && pair[0].1 > pair[1].1)
    );
    // Our results are the same with and without the peer.
    assert!(
        measured
            .front()
            .iter()
            .all(|point| point.element == Element::mixed(3))
    );
    assert!(measured.clone().without_peers().peers().is_empty());
    // The iterations of a peer are not counted.
    assert!(
        measured
            .against(Cost::Iterations)
            .fastest_peer(1.0)
            .is_none()
    );
}

#[test]
fn other_integrators_are_repeated_as_ours_are() {
    let model = Pendulum {};
    let measured = pendulum(&model)
        .element(Mixed::<3>)
        .steps([0.5])
        .repeat_for(Duration::from_millis(1))
        .peer("leapfrog", [0.1], |step| Ok(leapfrog(step)))
        .run()
        .unwrap();
    let one = *measured.peers()[0].points()[0].measured().unwrap();
    // The runs repeat for a millisecond, as each of them says that it takes a tenth of that.
    assert_eq!((one.repetitions, one.seconds), (10, 1e-4));
}

#[test]
fn other_integrators_are_in_the_files() {
    let measured = beside_leapfrog();
    let csv = measured.to_csv();
    let header: Vec<_> = csv.lines().next().unwrap().split(',').collect();
    // The name contains a comma and is quoted.
    let line = csv.lines().find(|line| line.contains(",0.01,")).unwrap();
    let rest = line.strip_prefix("\"leapfrog, by hand\",").unwrap();
    let fields: Vec<_> = rest.split(',').collect();
    assert_eq!(fields.len() + 1, header.len());
    let column = |name: &str| header.iter().position(|one| *one == name).unwrap() - 1;
    assert_eq!(fields[column("solver")], "peer");
    assert_eq!(fields[column("seconds")].parse(), Ok(1e-3));
    assert!(csv.contains("\"it \"\"never\"\" runs\""));
    #[cfg(feature = "charts")]
    {
        let svg = measured.chart().to_svg().unwrap();
        assert!(svg.contains("leapfrog, by hand") && !svg.contains("none, 1 failed"));
    }
}

#[test]
fn the_loosest_tolerance_that_does_not_show() {
    let model = Pendulum {};
    let end = end_of_table();
    let tightest = 1e-15;
    let with = |tolerances: &[f64]| {
        let problem = pendulum(&model).element(Mixed::<3>).element(Mixed::<6>);
        let problem = problem.steps([0.5, 0.1]).reference_end(end.q, end.p);
        let problem = problem.tolerances(tolerances.iter().copied());
        problem.run().unwrap()
    };
    let (swept, tight) = (with(&[1e-8, 1e-3, tightest]), with(&[tightest]));
    let mut looser = 0;
    for (point, other) in swept.points().zip(tight.points()) {
        assert_eq!(other.tolerance, tightest);
        let (one, other) = (point.measured().unwrap(), other.measured().unwrap());
        let least = other.error().max(swept.reference().uncertainty());
        assert!(one.error() <= 1.25 * least, "{point:?}");
        assert!(one.statistics.iterations <= other.statistics.iterations);
        looser += u32::from(point.tolerance > tightest);
    }
    // Errors of 1e-3 and 1e-6 do not require iterations down to rounding; one of 1e-13 does.
    assert!(looser >= 2, "{swept:?}");
    assert_eq!(swept.points().last().unwrap().tolerance, tightest);
}
