//! Work–precision diagrams for models of run-time length: the same calls and figures as for models of fixed size.

mod constrained;

use crate::motions::Toda;
use std::time::Duration;
use tfe::RunErrorKind;
use tfe::family::{self, FamilyState};
use tfe::prelude::*;
use tfe::work_precision::{
    Measurements, PeerRun, PhasePoint, Reference, Subject, WorkPrecisionError,
};

/// Springs with a cubic and a quartic term (Fermi, Pasta, Ulam, Tsingou); the ends are joined to walls.
#[dynamics(
    coordinates(q[n]),
    lagrangian = sum(i in 0..n, m[i]/2*dot(q[i])^2)
        - sum(i in 0..n-1, (q[i+1]-q[i])^2/2 + a/3*(q[i+1]-q[i])^3 + b/4*(q[i+1]-q[i])^4)
        - q[0]^2/2 - q[n-1]^2/2,
)]
struct Chain {
    n: usize,
    m: Vec<f64>,
    a: f64,
    b: f64,
}

#[dynamics(
    coordinates(q[4]),
    lagrangian = sum(i in 0..4, m[i]/2*dot(q[i])^2)
        - sum(i in 0..3, (q[i+1]-q[i])^2/2 + a/3*(q[i+1]-q[i])^3 + b/4*(q[i+1]-q[i])^4)
        - q[0]^2/2 - q[3]^2/2,
)]
struct ChainOfFour {
    m: [f64; 4],
    a: f64,
    b: f64,
}

const MASSES: [f64; 4] = [1.0, 0.5, 2.0, 1.5];
const A: f64 = 0.25;
const B: f64 = 0.3;

fn chain(n: usize) -> Chain {
    Chain {
        n,
        m: (0..n).map(|i| MASSES[i % 4]).collect(),
        a: A,
        b: B,
    }
}

/// A wave with a length of a few sites.
fn wave(n: usize) -> (Vec<f64>, Vec<f64>) {
    let q = (0..n).map(|i| 0.6 * (0.5 * i as f64).sin());
    let v = (0..n).map(|i| 0.3 * (0.7 * i as f64).cos());
    (q.collect(), v.collect())
}

fn halved(from: f64, count: i32) -> impl Iterator<Item = f64> {
    (0..count).map(move |k| from * 0.5_f64.powi(k))
}

/// The tests check counts and errors, not times.
fn measure<M: Subject<S>, S: PhasePoint>(problem: WorkPrecision<'_, M, S>) -> Measurements {
    problem.repeat_for(Duration::ZERO).run().expect("a chart")
}

#[test]
fn a_family_measures_as_the_same_model_of_fixed_size() {
    let (long, four) = (
        chain(4),
        ChainOfFour {
            m: MASSES,
            a: A,
            b: B,
        },
    );
    let (q, v) = ([0.5, -0.2, 0.1, 0.4], [0.1, 0.2, -0.3, 0.0]);
    let elements = [2, 3, 5].map(Element::mixed);
    // The span of 3 is not a multiple of 0.13: the last step is shorter. With fixed-point iteration for both, and a
    // tolerance far above rounding, both take the same number of iterations.
    let steps = [0.25, 0.13, 0.06];
    let family = WorkPrecision::new(&long, long.state(q, v), 0.0..3.0)
        .elements(elements)
        .steps(steps)
        .solver(Solve::FixedPoint)
        .tolerance(1e-10);
    let fixed = WorkPrecision::new(&four, four.state(q, v), 0.0..3.0)
        .elements(elements)
        .steps(steps)
        .solver(Solve::FixedPoint)
        .tolerance(1e-10);
    let (family, fixed) = (measure(family), measure(fixed));
    assert!(matches!(family.reference(), Reference::Computed { .. }));
    assert!(family.reference().uncertainty() < 1e-14);
    assert_eq!(family.failures().count() + fixed.failures().count(), 0);
    for (one, other) in family.points().zip(fixed.points()) {
        assert_eq!(
            (one.element, one.solve, one.step, one.tolerance),
            (other.element, other.solve, other.step, other.tolerance)
        );
        let (one, other) = (one.measured().unwrap(), other.measured().unwrap());
        for (a, b) in [
            (one.error_q, other.error_q),
            (one.error_p, other.error_p),
            (one.max_error_q, other.max_error_q),
            (one.max_error_p, other.max_error_p),
            (one.energy_error, other.energy_error),
        ] {
            // The rounding errors of about ten steps, and of a reference of some hundred, for numbers of order one.
            assert!((a - b).abs() < 1e-13, "{one:?} {other:?}");
        }
        assert_eq!(
            (one.constraint_position, one.constraint_velocity),
            (0.0, 0.0)
        );
        let (one, other) = (one.statistics, other.statistics);
        assert_eq!(one.steps, other.steps);
        assert_eq!(one.iterations, other.iterations);
        assert_eq!(one.residual_evaluations, other.residual_evaluations);
    }
    assert_eq!(family.points().count(), 9);
}

/// The order 2 (n − 1), fitted over the points where the error is asymptotic.
#[test]
fn slopes_are_the_orders() {
    let (model, (q, v)) = (chain(32), wave(32));
    let toda = Toda { n: 32 };
    let starts = (model.state(q.clone(), v.clone()), toda.state(q, v));
    for nodes in [2, 3, 4] {
        let element = Element::mixed(nodes);
        let of_chain = WorkPrecision::new(&model, starts.0.clone(), 0.0..4.0);
        let of_toda = WorkPrecision::new(&toda, starts.1.clone(), 0.0..4.0);
        for measured in [
            measure(of_chain.element(element).steps(halved(0.4, 6))),
            measure(of_toda.element(element).steps(halved(0.4, 6))),
        ] {
            let curve = &measured.curves()[0];
            let expected = 2.0 * (nodes as f64 - 1.0);
            for slope in [curve.slope(), curve.slope_q(), curve.slope_p()] {
                let slope = slope.expect("a power");
                assert!(
                    (slope.exponent - expected).abs() < 0.15 && slope.points >= 3,
                    "{element}: {slope:?}"
                );
            }
        }
    }
}

/// The chain without nonlinear terms and with equal masses, in its modes sin(π k (i+1)/(n+1)).
#[test]
fn a_reference_of_ones_own_is_taken() {
    let n = 6;
    let model = Chain {
        m: vec![1.0; n],
        a: 0.0,
        b: 0.0,
        ..chain(n)
    };
    let turn = std::f64::consts::PI / (n as f64 + 1.0);
    let shape: Vec<f64> = (0..n)
        .map(|i| (2.0 * turn * (i as f64 + 1.0)).sin())
        .collect();
    let frequency = 2.0 * turn.sin();
    let exact = |t: f64| {
        let times = |factor: f64| shape.iter().map(|x| factor * x).collect::<Vec<_>>();
        let angle = frequency * t;
        (times(angle.cos()), times(-frequency * angle.sin()))
    };
    let problem = || {
        WorkPrecision::new(&model, model.state(shape.clone(), vec![0.0; n]), 0.0..5.5)
            .element(Mixed::<3>)
            .steps([0.5, 0.1])
    };
    let (q, p) = exact(5.5);
    let computed = measure(problem());
    let function = measure(problem().reference(exact));
    let end = measure(problem().reference_end(q, p));
    for given in [&function, &end] {
        assert!(matches!(given.reference(), Reference::Given { .. }));
        assert_eq!(computed.points().count(), given.points().count());
        for (one, other) in computed.points().zip(given.points()) {
            let (one, other) = (one.error().unwrap(), other.error().unwrap());
            // At three quarters of a period the momentum is at its maximum; the scales are those of start and end.
            assert!(
                one > 1e-8 && one < 1.1 * other && other < 1.1 * one,
                "{one:e} {other:e}"
            );
        }
    }
    assert_eq!(computed.points().count(), function.points().count());
    for (one, other) in computed.points().zip(function.points()) {
        let (one, other) = (one.measured().unwrap(), other.measured().unwrap());
        // Some hundred rounding errors.
        assert!((one.max_error_q - other.max_error_q).abs() < 1e-13);
        assert!((one.max_error_p - other.max_error_p).abs() < 1e-13);
    }
}

#[test]
fn files_have_the_same_columns() {
    let four = ChainOfFour {
        m: MASSES,
        a: A,
        b: B,
    };
    let start = four.state([0.1; 4], [0.0; 4]);
    let fixed = WorkPrecision::new(&four, start, 0.0..1.0)
        .element(Mixed::<3>)
        .steps([0.1]);
    let (long, (q, v)) = (chain(12), wave(12));
    let family = WorkPrecision::new(&long, long.state(q, v), 0.0..1.0)
        .element(Mixed::<3>)
        .element(Mixed::<4>)
        .steps([0.2, 0.1, 0.05]);
    let (fixed, family) = (measure(fixed).to_csv(), measure(family));
    let name = format!("tfe-family-work-precision-{}", std::process::id());
    let folder = std::env::temp_dir().join(name);
    std::fs::create_dir_all(&folder).unwrap();
    family.save(folder.join("chain.csv")).unwrap();
    let text = std::fs::read_to_string(folder.join("chain.csv")).unwrap();
    let mut lines = text.lines();
    let header = lines.next().unwrap();
    assert_eq!(Some(header), fixed.lines().next());
    let column = |name: &str| header.split(',').position(|one| one == name).unwrap();
    let mut count = 0;
    for (line, point) in lines.zip(family.points()) {
        let fields: Vec<&str> = line.split(',').collect();
        assert_eq!(fields.len(), header.split(',').count());
        let read = |name: &str| fields[column(name)].parse::<f64>().unwrap();
        let one = point.measured().unwrap();
        assert_eq!(fields[column("element")], point.element.to_string());
        assert_eq!(read("step"), point.step);
        assert_eq!(read("error_q"), one.error_q);
        assert_eq!(read("seconds"), one.seconds);
        assert_eq!(read("iterations"), one.statistics.iterations as f64);
        assert!(one.seconds > 0.0 && one.statistics.iterations > 0);
        count += 1;
    }
    assert_eq!(count, 6);
    if cfg!(feature = "charts") {
        family.save(folder.join("chain.svg")).unwrap();
        let svg = std::fs::read_to_string(folder.join("chain.svg")).unwrap();
        assert!(svg.contains("Mixed::&lt;4&gt;") && svg.contains("time of the run"));
    }
    std::fs::remove_dir_all(&folder).unwrap();
}

fn toda_problem(toda: &Toda) -> WorkPrecision<'_, Toda, FamilyState> {
    let (q, v) = wave(toda.n);
    WorkPrecision::new(toda, toda.state(q, v), 0.0..2.0).steps([0.1, 0.05])
}

#[test]
fn a_reference_of_another_length_is_an_error() {
    let toda = Toda { n: 5 };
    let problem = || toda_problem(&toda).element(Mixed::<3>);
    let (five, four) = ([0.0; 5], [0.0; 4]);
    let error = problem().reference_end(five, four).run().unwrap_err();
    let expected = |vector, time, length| WorkPrecisionError::ReferenceLength {
        vector,
        time,
        length,
        expected: 5,
    };
    assert_eq!(error, expected("p", 2.0, 4));
    let message =
        "the vector p of the reference at t = 2 has 4 elements, but the model has 5 coordinates";
    assert_eq!(error.to_string(), message);
    let exact = |t: f64| (vec![0.0; if t < 1.5 { 5 } else { 0 }], vec![0.0; 5]);
    let error = problem().reference(exact).run().unwrap_err();
    assert!(
        matches!(error, WorkPrecisionError::ReferenceLength { vector: "q", time, length: 0, .. } if time >= 1.5),
        "{error}"
    );
    let error = problem().reference_end([f64::NAN; 5], five).run();
    let error = error.unwrap_err();
    assert!(matches!(error, WorkPrecisionError::ReferenceValue { .. }));
}

#[test]
fn starts_and_models_that_do_not_fit_are_errors() {
    let toda = Toda { n: 5 };
    let error = |model: &Toda, q: &[f64], p: &[f64]| {
        let (q, p) = (q.to_vec(), p.to_vec());
        let problem = WorkPrecision::new(model, FamilyState { q, p }, 0.0..1.0);
        match problem.element(Mixed::<3>).steps([0.1]).run() {
            Err(WorkPrecisionError::Start(kind)) => kind,
            other => panic!("{other:?}"),
        }
    };
    let length = |vector, length, expected| {
        RunErrorKind::Family(family::ModelError::StateLength {
            vector,
            length,
            expected,
        })
    };
    assert_eq!(error(&toda, &[0.0; 4], &[0.0; 5]), length("q", 4, 5));
    assert_eq!(error(&toda, &[0.0; 5], &[0.0; 6]), length("p", 6, 5));
    // Lengths that exceed any memory are refused before any is allocated.
    let absurd = Toda { n: 1 << 40 };
    assert_eq!(
        error(&absurd, &[0.0; 2], &[0.0; 2]),
        length("q", 2, 1 << 40)
    );
    assert!(matches!(
        error(&Toda { n: 1 << 60 }, &[0.0; 2], &[0.0; 2]),
        RunErrorKind::Family(family::ModelError::Length { field: "n", .. })
    ));
    assert!(matches!(
        error(&Toda { n: 0 }, &[], &[]),
        RunErrorKind::Family(family::ModelError::NoElements { array: "q[n]" })
    ));
    let lost = error(&toda, &[0.0, 0.0, f64::NAN, 0.0, 0.0], &[0.0; 5]);
    assert!(matches!(lost, RunErrorKind::Start { coordinate: 2, .. }));
}

/// Elements and solvers that do not support this model: points without figures, next to others that have some.
#[test]
fn what_a_family_cannot_run_is_a_failed_point() {
    let toda = Toda { n: 5 };
    let unfit = Element::primal(3);
    let measured = measure(toda_problem(&toda).element(unfit).element(Mixed::<3>));
    let [failed, good] = measured.curves() else {
        panic!("{measured:?}");
    };
    assert_eq!((failed.failed(), good.failed()), (2, 0));
    for point in failed.points() {
        let expected =
            RunErrorKind::Family(family::ModelError::ElementNotSupported { element: unfit });
        assert_eq!(point.outcome, Err(expected));
    }
    let csv = measured.to_csv();
    let line = csv.lines().nth(1).unwrap();
    assert!(
        line.contains("is not supported for this model of run-time length"),
        "{line}"
    );
    // No model has an element with one node: nothing is measured.
    let none = toda_problem(&toda).element(Element::mixed(1)).run();
    assert!(matches!(none, Err(WorkPrecisionError::Element(_))));
    if cfg!(not(feature = "sparse")) {
        let problem = toda_problem(&toda).element(Mixed::<3>);
        let measured = measure(problem.solver(Solve::Newton).solver(Solve::FixedPoint));
        let failed = |k: usize| measured.curves()[k].failed();
        assert_eq!((failed(0), failed(1)), (2, 0));
        let kind = RunErrorKind::Family(family::ModelError::NoNewton);
        assert_eq!(measured.points().next().unwrap().outcome, Err(kind));
    }
}

#[test]
fn other_integrators_stand_beside_families() {
    let toda = Toda { n: 5 };
    let (q, p) = wave(5);
    let start = FamilyState { q, p };
    let leapfrog = |step: f64| {
        let (mut end, steps) = (start.clone(), (2.0 / step).round() as u64);
        let kick = |end: &mut FamilyState| {
            for i in 0..4 {
                let pull = step / 2.0 * (end.q[i] - end.q[i + 1]).exp();
                end.p[i] -= pull;
                end.p[i + 1] += pull;
            }
        };
        for _ in 0..steps {
            kick(&mut end);
            for (q, p) in end.q.iter_mut().zip(&end.p) {
                *q += step * p;
            }
            kick(&mut end);
        }
        Ok(PeerRun {
            end,
            time: Duration::from_micros(steps),
            evaluations: steps,
        })
    };
    let short = |_: f64| {
        Ok(PeerRun {
            end: FamilyState::default(),
            time: Duration::ZERO,
            evaluations: 0,
        })
    };
    let problem = toda_problem(&toda).element(Mixed::<3>);
    let problem = problem.peer("leapfrog", [0.1, 0.05], leapfrog);
    let measured = measure(problem.peer("short", [1.0], short));
    let [peer, short] = measured.peers() else {
        panic!("{:?}", measured.peers());
    };
    let error = |k: usize| peer.points()[k].measured().unwrap().error();
    let ratio = error(0) / error(1);
    assert!((ratio - 4.0).abs() < 0.2, "order two: {ratio}");
    let message = short.points()[0].outcome.clone().unwrap_err();
    assert!(
        message.contains("0 elements") && message.contains("5 coordinates"),
        "{message}"
    );
}

/// If a few iterations do not meet a tolerance, runs with a looser one must not count as failed.
#[test]
fn tolerances_that_are_not_met_are_left_out() {
    let chain = chain(4);
    let (q, v) = wave(4);
    let with = |tolerances: &[f64]| {
        let problem = WorkPrecision::new(&chain, chain.state(q.clone(), v.clone()), 0.0..2.0)
            .element(Mixed::<4>)
            .steps([0.25])
            .solver(Solve::FixedPoint)
            .max_iterations(5)
            .tolerances(tolerances.iter().copied());
        measure(problem)
    };
    let (tight, both) = (with(&[1e-15]), with(&[1e-3, 1e-15]));
    assert!(tight.curves()[0].points()[0].outcome.is_err());
    let point = &both.curves()[0].points()[0];
    assert!(
        point.outcome.is_ok() && point.tolerance == 1e-3,
        "{point:?}"
    );
}
