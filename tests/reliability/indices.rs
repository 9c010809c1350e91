//! Fields that are indices in models of fixed size: they choose elements, and are checked before anything is evaluated.

use tfe::boundary::BoundaryError;
use tfe::periodic::OrbitError;
use tfe::prelude::*;
use tfe::runtime::First;
use tfe::runtime::step::{Control, Stepper};
use tfe::sensitivity::Loss;
use tfe::stability::{LinearModel, LinearModelError, TransitionError};
use tfe::{AssemblyError, AtError, ConsistentError, ModelError, RunErrorKind, StepError};

/// Three masses in a row. One is tied to a wall, by a spring like one of the row, and damped.
#[dynamics(
    coordinates(x[3]),
    lagrangian = sum(i in 0..3, m/2*dot(x[i])^2) - sum(i in 0..2, c[i]/2*(x[i+1] - x[i])^2) - c[tie]/2*x[held]^2,
    force(x[held]) = -d*dot(x[held]),
    output(shown) = x[held],
    solver(Fast, Mixed::<3>),
)]
#[derive(Clone, Copy)]
struct Tied {
    m: f64,
    c: [f64; 3],
    d: f64,
    tie: usize,
    held: usize,
}

/// The same with the indices as numbers.
#[dynamics(
    coordinates(x[3]),
    lagrangian = sum(i in 0..3, m/2*dot(x[i])^2) - sum(i in 0..2, c[i]/2*(x[i+1] - x[i])^2) - c[2]/2*x[1]^2,
    force(x[1]) = -d*dot(x[1]),
)]
struct Written {
    m: f64,
    c: [f64; 3],
    d: f64,
}

const C: [f64; 3] = [2.0, 3.0, 5.0];
const START: State<3> = State {
    q: [0.5, -0.25, 1.0],
    p: [0.125, 0.5, -0.75],
};

fn tied(tie: usize, held: usize) -> Tied {
    Tied {
        m: 1.5,
        c: C,
        d: 0.25,
        tie,
        held,
    }
}

#[test]
fn fields_choose_the_elements() {
    let (q, v) = (START.q, START.p);
    for (tie, held) in (0..3).flat_map(|tie| (0..3).map(move |held| (tie, held))) {
        let model = tied(tie, held);
        assert_eq!(model.check(), Ok(()));
        let mut by_q = [0.0; 3];
        for i in 0..2 {
            let pull = C[i] * (q[i + 1] - q[i]);
            by_q[i] += pull;
            by_q[i + 1] -= pull;
        }
        by_q[held] -= C[tie] * q[held];
        let mut force = [0.0; 3];
        force[held] = -0.25 * v[held];
        let mut first = First::ZERO;
        model.first(0.0, &q, &v, &mut first);
        for i in 0..3 {
            // All numbers have few bits.
            assert_eq!(first.q[i], by_q[i], "{tie}, {held}: {i}");
            assert_eq!(first.force[i], force[i], "{tie}, {held}: {i}");
        }
        assert_eq!(model.shown(0.0, q, v), q[held]);
    }
    let chosen = tied(2, 1);
    let written = Written {
        m: 1.5,
        c: C,
        d: 0.25,
    };
    let run = Simulation::new(&chosen).step(0.05).run(START, 0.0..5.0);
    let expected = Simulation::new(&written).step(0.05).run(START, 0.0..5.0);
    let (run, expected) = (run.expect("a run"), expected.expect("a run"));
    for (one, other) in run.last().q.iter().zip(&expected.last().q) {
        // Roundings of a hundred steps.
        assert!((one - other).abs() <= 1e-12, "{one} {other}");
    }
    let mut state = START;
    let mut fast = Fast::new(&chosen, 0.05);
    for _ in 0..100 {
        fast.advance(&mut state).expect("a step");
    }
    for (one, other) in state.q.iter().zip(&expected.last().q) {
        // Mixed::<3>: order 4 at a step of 0.05, with frequencies up to 3.
        assert!((one - other).abs() <= 1e-4, "{one} {other}");
    }
}

fn outside() -> (Tied, ModelError, RunErrorKind) {
    let error = ModelError::Index {
        array: "x",
        index: "held",
        ranges: "",
        value: 3,
        length: 3,
    };
    (tied(2, 3), error, RunErrorKind::Family(error))
}

#[test]
fn an_index_outside_its_array_is_told() {
    let (wrong, error, _) = outside();
    assert_eq!(wrong.check(), Err(error));
    assert_eq!(
        error.to_string(),
        "the index of `x[held]` becomes 3, but `x` has 3 elements"
    );
    let error = tied(3, 0).check().expect_err("no fourth spring");
    assert_eq!(
        error.to_string(),
        "the index of `c[tie]` becomes 3, but `c` has 3 elements"
    );
    let length = usize::MAX;
    let error = ModelError::Length {
        field: "held",
        length,
    };
    assert_eq!(tied(0, length).check(), Err(error));
}

#[test]
fn runs_with_an_index_outside_do_not_begin() {
    let (wrong, _, kind) = outside();
    let run = || Simulation::new(&wrong).step(0.1);
    let span = || 0.0..1.0;
    let failed = run().run(START, span()).expect_err("no fourth mass");
    assert_eq!(failed.kind(), &kind);
    assert_eq!(failed.partial().states().len(), 1);
    assert_eq!(run().steps(START, 0.0).next(), Some(Err(kind.clone())));
    let found = run().accuracy(1e-6).run(START, span()).err();
    assert_eq!(found.as_ref().map(tfe::RunError::kind), Some(&kind));
    let found = run().run_estimated(START, span()).err();
    assert_eq!(found.as_ref().map(tfe::RunError::kind), Some(&kind));
    let found = run().run_linearised(START, span()).err();
    assert_eq!(found.as_ref().map(tfe::RunError::kind), Some(&kind));
    let found = run().run_sensitive(START, span()).err();
    assert_eq!(found.as_ref().map(tfe::RunError::kind), Some(&kind));
    let loss = Loss::at_end(|node| node.q[0]);
    let found = run().gradient(START, span(), &loss).err();
    assert_eq!(found.as_ref().map(tfe::RunError::kind), Some(&kind));
    let point = run()
        .section("shown", Crossing::Either, START, 0.0)
        .next()
        .and_then(Result::err);
    assert_eq!(point, Some(kind.clone()));
    // A motion of another model.
    let right = tied(2, 1);
    let motion = Simulation::new(&right).step(0.1).run(START, span());
    let motion = motion.expect("a run");
    let integral = motion.integral(&wrong, "shown");
    assert!(matches!(integral, Err(AtError::Model(_))), "{integral:?}");
    let checkpoint = motion.checkpoint().expect("complete");
    let failed = run().resume(checkpoint, 2.0).expect_err("no fourth mass");
    assert_eq!(failed.kind(), &kind);
}

#[test]
fn ensembles_fail_where_an_index_is_outside() {
    let (wrong, _, kind) = outside();
    let ends = Ensemble::new(&wrong).step(0.1).run(&[START; 9], 0.0..1.0);
    let ends = ends.expect("an ensemble");
    assert_eq!(ends.failures().count(), 9);
    assert!(ends.iter().all(|end| end.as_ref().err() == Some(&kind)));
    let models = [tied(2, 1), wrong];
    for span in [0.0..1.0, 0.0..0.0] {
        let ends = Ensemble::of_models(&models).step(0.1).run(&[START], span);
        let ends = ends.expect("an ensemble");
        assert!(ends[0].is_ok());
        assert_eq!(ends[1].as_ref().err(), Some(&kind));
    }
    let mut begun = Ensemble::new(&wrong).step(0.1).begin(&[START; 9], 0.0);
    let begun = begun.as_mut().expect("starts");
    let ends = begun.run_to(1.0).expect("an ensemble");
    assert!(ends.iter().all(|end| end.as_ref().err() == Some(&kind)));
}

#[test]
fn whatever_takes_a_model_refuses_an_index_outside() {
    let (wrong, error, _) = outside();
    let stepper = Stepper::new(&wrong, Mixed::<4>.into(), Control::default());
    assert_eq!(stepper.err(), Some(error));
    let mut solver = Fast::new(&wrong, 0.1);
    let mut state = START;
    assert_eq!(solver.advance(&mut state), Err(StepError::Inconsistent));
    assert_eq!(state, START);
    let inconsistent = TransitionError::Step(StepError::Inconsistent);
    let matrix = stability::transition_matrix(&wrong, Mixed::<4>, &START, 0.0, 0.1);
    assert_eq!(matrix.err(), Some(inconsistent));
    let linear = LinearModel::about(&wrong, 0.0, &START);
    assert_eq!(linear.err(), Some(LinearModelError::Model(error)));
    let consistent = wrong.consistent_state(START.q, [0.0; 3]);
    assert_eq!(consistent.err(), Some(ConsistentError::Check(error)));
    let arc = BoundaryValue::of(&wrong).from_to([0.0; 3], [1.0; 3], 0.0..1.0);
    let assembly = AssemblyError::Model(error);
    let arc = arc.solve().err();
    assert_eq!(arc, Some(BoundaryError::Assembly(assembly.clone())));
    let orbit = PeriodicOrbit::of(&wrong).period(1.0).solve().err();
    assert_eq!(orbit, Some(OrbitError::Assembly(assembly)));
}

/// Where there is no error to return, there are no numbers either.
#[test]
fn numbers_of_a_model_with_an_index_outside_are_unknown() {
    let (wrong, ..) = outside();
    let start = wrong.state(START.q, [0.0; 3]);
    assert!(start.q == START.q && start.p.iter().all(|p| p.is_nan()));
    let velocity = wrong.velocity(0.0, &START);
    assert!(velocity.iter().all(|v| v.is_nan()));
    assert!(wrong.shown(0.0, START.q, [0.0; 3]).is_nan());
}

/// The momentum of the time is an energy, which is evaluated for it.
#[test]
fn times_of_a_model_with_an_index_outside_are_unknown() {
    #[dynamics(
        coordinates(x, y),
        momenta(px, py),
        let r = hypot(x, y),
        hamiltonian = (px^2 + py^2)/2 - mu[body]/r,
        time_transformation = r,
    )]
    struct Planet {
        mu: [f64; 2],
        body: usize,
    }
    let planet = |body| Planet {
        mu: [1.0, 4.0],
        body,
    };
    let start = |body| planet(body).state([1.0, 0.0], [0.0, 1.0]);
    assert_eq!(start(1).p, [0.0, 1.0, 3.5]);
    assert!(start(2).p[2].is_nan());
    let run = Simulation::new(&planet(2))
        .step(0.1)
        .run(start(1), 0.0..1.0);
    let kind = run.expect_err("no third body").kind().clone();
    assert!(matches!(kind, RunErrorKind::Family(_)), "{kind}");
}

/// Vectors are as long as the ranges of their indices ask for; of which a field chooses an element, any length will do
/// that holds it.
#[test]
fn lengths_of_vectors_are_checked() {
    #[dynamics(
        coordinates(x[2]),
        lagrangian = sum(i in 0..2, m[i]/2*dot(x[i])^2) - sum(i in 0..terms, c[i]*x[0]^i) - w[k]/2*x[1]^2,
    )]
    struct Vectors {
        m: Vec<f64>,
        terms: usize,
        c: Vec<f64>,
        w: Vec<f64>,
        k: usize,
    }
    let vectors = |m: usize, c: usize, w: usize| Vectors {
        m: vec![1.0; m],
        terms: 3,
        c: vec![0.5; c],
        w: vec![2.0; w],
        k: 1,
    };
    for w in [2, 5] {
        assert_eq!(vectors(2, 3, w).check(), Ok(()));
    }
    let message = |m, c, w| {
        let error = vectors(m, c, w).check().expect_err("a wrong length");
        error.to_string()
    };
    for m in [1, 3] {
        let expected =
            format!("`m` has {m} elements, but `m[i]` in the sum over `i in 0..2` needs 2");
        assert_eq!(message(m, 3, 2), expected);
    }
    for c in [0, 2, 4] {
        let expected =
            format!("`c` has {c} elements, but `c[i]` in the sum over `i in 0..terms` needs 3");
        assert_eq!(message(2, c, 2), expected);
    }
    assert_eq!(
        message(2, 3, 1),
        "the index of `w[k]` becomes 1, but `w` has 1 elements"
    );
    // No terms need no elements.
    let none = Vectors {
        terms: 0,
        ..vectors(2, 0, 2)
    };
    assert_eq!(none.check(), Ok(()));
    let start = State {
        q: [0.5, 0.25],
        p: [0.0; 2],
    };
    let short = vectors(2, 2, 2);
    let error = ModelError::FieldLength {
        field: "c",
        length: 2,
        expected: 3,
        index: "i",
        ranges: "i in 0..terms",
    };
    let run = Simulation::new(&short).step(0.1).run(start, 0.0..1.0);
    let found = run.err();
    let kind = RunErrorKind::Family(error);
    assert_eq!(found.as_ref().map(tfe::RunError::kind), Some(&kind));
    let stepper = Stepper::new(&short, Mixed::<4>.into(), Control::default());
    assert_eq!(stepper.err(), Some(error));
}

/// Without terms a sum is zero, and its vectors need no element, also where the range ends below its start.
#[test]
fn ranges_that_end_below_their_start_need_no_elements() {
    #[dynamics(
        coordinates(x),
        lagrangian = dot(x)^2/2 - x^2/2 - sum(i in 0..terms-1, c[i]*x^4),
    )]
    struct Series {
        terms: usize,
        c: Vec<f64>,
    }
    for terms in [0, 1] {
        let c = Vec::new();
        let series = Series { terms, c };
        assert_eq!(series.check(), Ok(()), "{terms}");
        let run = Simulation::new(&series).element(Mixed::<6>).step(0.1);
        let motion = run.run(series.state([0.5], [0.0]), 0.0..1.0);
        let end = motion.expect("a run").last().q[0];
        // Ten steps, with rounding errors only.
        assert!((end - 0.5 * 1.0_f64.cos()).abs() <= 1e-13, "{end}");
    }
    let c = vec![1.0];
    let error = Series { terms: 0, c }.check().expect_err("no terms");
    let message = "`c` has 1 elements, but `c[i]` in the sum over `i in 0..terms-1` needs 0";
    assert_eq!(error.to_string(), message);
}

/// Where an index is only a number, a sum has its terms below zero, too.
#[test]
fn sums_over_indices_that_stand_nowhere_have_all_their_terms() {
    #[dynamics(
        coordinates(x),
        lagrangian = dot(x)^2/2 - x^2/2,
        output(five) = sum(i in n-5..n, i*x),
        output(all) = sum(i in n-w..n, i*x),
    )]
    struct Last {
        n: usize,
        w: usize,
    }
    for (n, w) in [(0, 0), (0, 3), (2, 4), (3, 1), (7, 20)] {
        let last = Last { n, w };
        assert_eq!(last.check(), Ok(()));
        let sum = |terms: i64| (n as i64 - terms..n as i64).sum::<i64>() as f64;
        // Whole numbers.
        assert_eq!(last.five(0.0, [2.0], [0.0]), 2.0 * sum(5), "{n}");
        assert_eq!(last.all(0.0, [2.0], [0.0]), 2.0 * sum(w as i64), "{n} {w}");
    }
}

/// The last mass has no neighbour, and the sum over those after it no terms.
#[test]
fn nothing_is_read_for_sums_without_terms() {
    #[dynamics(
        coordinates(x[N]),
        lagrangian = sum(i in 0..N, dot(x[i])^2/2) - sum(i in 0..N, sum(j in i+1..N, k*x[i+1]*x[j])),
    )]
    struct Triangle<const N: usize> {
        k: f64,
    }
    let triangle = Triangle::<3> { k: 2.0 };
    let (x, v) = ([0.5, -0.25, 1.0], [0.0; 3]);
    let energy = triangle.energy_function(0.0, &x, &v);
    // Numbers of few bits.
    assert_eq!(energy, -2.0 * (x[1] * x[1] + x[1] * x[2] + x[2] * x[2]));
    let mut first = First::ZERO;
    triangle.first(0.0, &x, &v, &mut first);
    let pull = [0.0, 2.0 * x[1] + x[2], x[1] + 2.0 * x[2]];
    assert_eq!(first.q, pull.map(|pull| -2.0 * pull));
}

/// What a run drives with inputs, and the ends of a sum.
#[test]
fn ends_of_sums_are_checked_with_inputs_too() {
    #[dynamics(
        coordinates(x),
        lagrangian = dot(x)^2/2 - sum(i in begin..end, c[i]*x^i),
        input(u),
        force(x) = u,
    )]
    struct Series {
        c: [f64; 4],
        begin: usize,
        end: usize,
    }
    let series = |begin, end| Series {
        c: [1.0, 2.0, 3.0, 4.0],
        begin,
        end,
    };
    let value = |begin, end| -> f64 { series(begin, end).energy_function(0.0, &[0.5], &[0.0]) };
    // −2 x − 3 x², and nothing.
    assert!((value(1, 3) + 1.75).abs() <= 1e-14);
    assert_eq!(value(3, 1), 0.0);
    let start = State { q: [0.5], p: [0.0] };
    let wrong = series(1, 5);
    let error = ModelError::Index {
        array: "c",
        index: "i",
        ranges: "i in begin..end",
        value: 4,
        length: 4,
    };
    let kind = RunErrorKind::Family(error);
    let run = || Simulation::new(&wrong).step(0.1);
    let found = run().input("u", |t| t).run(start, 0.0..1.0).err();
    assert_eq!(found.as_ref().map(tfe::RunError::kind), Some(&kind));
    assert_eq!(run().hold(start, 0.0).err(), Some(kind));
}
