//! Inputs of models of run-time length: functions of time, tables, control loops.

use tfe::family::{self, Model as _, STRIDE};
use tfe::prelude::*;
use tfe::{Driven, InputError, Interpolation, RunErrorKind};

/// A chain on moving ground, with a force on all of its sites.
#[dynamics(
    coordinates(q[n]),
    lagrangian = sum(i in 0..n, m*dot(q[i])^2/2) - k/2*(q[0] - w)^2
               - sum(i in 0..n-1, k/2*(q[i+1] - q[i])^2 + a/4*(q[i+1] - q[i])^4),
    input(w, u),
    force(q[i]) = u - c*dot(q[i]),
    output(pull) = k*(w - q[0]),
    output(power[i in 0..n]) = u*dot(q[i]),
)]
struct Chain {
    n: usize,
    m: f64,
    k: f64,
    a: f64,
    c: f64,
}

/// The same with the motions written as formulas of t.
#[dynamics(
    coordinates(q[n]),
    let w = 0.3*cos(2*t),
    let u = 0.1*sin(t)*exp(-t/10),
    lagrangian = sum(i in 0..n, m*dot(q[i])^2/2) - k/2*(q[0] - w)^2
               - sum(i in 0..n-1, k/2*(q[i+1] - q[i])^2 + a/4*(q[i+1] - q[i])^4),
    force(q[i]) = u - c*dot(q[i]),
    output(pull) = k*(w - q[0]),
    output(power[i in 0..n]) = u*dot(q[i]),
)]
struct Written {
    n: usize,
    m: f64,
    k: f64,
    a: f64,
    c: f64,
}

/// Four sites, as a model of fixed size.
#[dynamics(
    coordinates(q[4]),
    lagrangian = sum(i in 0..4, m*dot(q[i])^2/2) - k/2*(q[0] - w)^2
               - sum(i in 0..3, k/2*(q[i+1] - q[i])^2 + a/4*(q[i+1] - q[i])^4),
    input(w, u),
    force(q[i]) = u - c*dot(q[i]),
    output(pull) = k*(w - q[0]),
)]
struct Four {
    m: f64,
    k: f64,
    a: f64,
    c: f64,
}

/// As a Hamiltonian, with an input that changes a stiffness.
#[dynamics(
    coordinates(q[n]),
    momenta(p[n]),
    hamiltonian = sum(i in 0..n, p[i]^2/2) + sum(i in 0..n-1, (1 + e)*(q[i+1] - q[i])^2/2 + (q[i+1] - q[i])^4/4),
    input(e),
)]
struct Stiffened {
    n: usize,
}

#[dynamics(
    coordinates(q[n]),
    momenta(p[n]),
    let e = 0.4*sin(3*t),
    hamiltonian = sum(i in 0..n, p[i]^2/2) + sum(i in 0..n-1, (1 + e)*(q[i+1] - q[i])^2/2 + (q[i+1] - q[i])^4/4),
)]
struct StiffenedWritten {
    n: usize,
}

fn chain(n: usize) -> Chain {
    let (m, k, a, c) = (1.3, 4.0, 0.7, 0.05);
    Chain { n, m, k, a, c }
}

fn written(n: usize) -> Written {
    let (m, k, a, c) = (1.3, 4.0, 0.7, 0.05);
    Written { n, m, k, a, c }
}

fn w(t: f64) -> f64 {
    0.3 * (2.0 * t).cos()
}

fn u(t: f64) -> f64 {
    0.1 * t.sin() * (-t / 10.0).exp()
}

fn wave(n: usize) -> Vec<f64> {
    (0..n).map(|i| 0.4 * (0.9 * i as f64).sin()).collect()
}

#[track_caller]
pub(super) fn assert_alike(a: &[f64], b: &[f64], tolerance: f64) {
    assert_eq!(a.len(), b.len());
    for (a, b) in a.iter().zip(b) {
        assert!((a - b).abs() <= tolerance, "{a} beside {b}");
    }
}

/// A function given at run time gives the same as one written in the declaration: for chains of two sites, of four, of
/// slightly more than a register, and longer than a stride.
#[test]
fn an_input_is_what_a_formula_of_time_is() {
    for (n, end) in [(2, 10.0), (4, 10.0), (9, 10.0), (2 * STRIDE + 77, 1.0)] {
        let (given, written) = (chain(n), written(n));
        let start = || written.state(wave(n), vec![0.0; n]);
        for element in [
            Mixed::<4>.into(),
            Mixed::<7>.into(),
            Element::from(Radau::<3>),
        ] {
            let given = Simulation::new(&given)
                .element(element)
                .step(0.05)
                .input("u", u)
                .input("w", w);
            let written = Simulation::new(&written).element(element).step(0.05);
            let a = given.run(start(), 0.0..end).expect("a run");
            let b = written.run(start(), 0.0..end).expect("a run");
            assert_eq!(a.states().len(), b.states().len());
            for (a, b) in a.states().iter().zip(b.states()) {
                assert_alike(&a.q, &b.q, 1e-12);
                assert_alike(&a.v, &b.v, 1e-12);
            }
            let last = format!("power[{}]", n - 1);
            for name in ["pull", &last] {
                let columns = [&a, &b].map(|motion| motion.outputs().column(name).expect("named"));
                assert_alike(&columns[0], &columns[1], 1e-12);
            }
            assert_alike(a.energies(), b.energies(), 1e-9);
            assert!(a.warnings().is_empty() && b.warnings().is_empty());
            let steps = given.steps(start(), 0.0).zip(written.steps(start(), 0.0));
            for (a, b) in steps.take(10) {
                assert_alike(&a.expect("a step").q, &b.expect("a step").q, 1e-13);
            }
        }
    }
}

/// Models of both kinds of length: with accuracies, in ensembles, with tables, as Lagrangians and Hamiltonians.
#[test]
fn both_kinds_of_length_are_driven_alike() {
    let (long, (m, k, a, c)) = (chain(4), (1.3, 4.0, 0.7, 0.05));
    let four = Four { m, k, a, c };
    let q = [0.1, -0.2, 0.3, 0.0];
    let times = [0.0, 0.7, 1.1, 2.03, 4.0];
    let values = [1.0, -0.5, 0.25, 0.8, 0.0];
    for way in [
        Interpolation::Hold,
        Interpolation::Linear,
        Interpolation::Spline,
    ] {
        let long = Simulation::new(&long).step(0.04).input("w", w);
        let long = long.table("u", times, values, way);
        let long = long.run(chain(4).state(q, [0.0; 4]), 0.0..5.0);
        let four = Simulation::new(&four).step(0.04).input("w", w);
        let four = four.table("u", times, values, way);
        let four = four.run(State { q, p: [0.0; 4] }, 0.0..5.0);
        let (long, four) = (long.expect("a run"), four.expect("a run"));
        assert_eq!(long.states().len(), four.states().len());
        for (a, b) in long.states().iter().zip(four.states()) {
            assert_eq!(a.t, b.t);
            assert_alike(&a.q, &b.q, 1e-13);
        }
        for time in times {
            assert!(long.states().iter().any(|node| node.t == time));
        }
    }
    let run = Simulation::new(&long).input("w", w).input("u", u);
    let start = || chain(4).state(q, [0.0; 4]);
    let fine = run.clone().element(Mixed::<8>).step(0.01);
    let fine = fine.run(start(), 0.0..20.0).expect("a run");
    let accurate = run.accuracy(1e-9).run(start(), 0.0..20.0).expect("a run");
    assert!(accurate.error_estimate() < 1e-9);
    assert_alike(&accurate.last().q, &fine.last().q, 1e-9);
    let driven = Driven::new(&long).input("w", w).expect("a name");
    let driven = driven.input("u", u).expect("a name");
    let ends = Ensemble::new(&driven).element(Mixed::<8>).step(0.01);
    let ends = ends.run(&[start(), start()], 0.0..20.0).expect("runs");
    for end in ends.nodes() {
        assert_alike(&end.q, &fine.last().q, 1e-13);
    }
}

#[test]
fn inputs_change_stiffnesses_of_hamiltonians() {
    // The longer chain uses strides.
    for (n, end) in [(2 * STRIDE + 77, 1.0), (11, 20.0)] {
        let (given, written) = (Stiffened { n }, StiffenedWritten { n });
        let start = || given.state(wave(n), vec![0.0; n]);
        let a = Simulation::new(&given).step(0.05);
        let a = a.input("e", |t| 0.4 * (3.0 * t).sin());
        let a = a.run(start(), 0.0..end).expect("a run");
        let b = Simulation::new(&written).step(0.05);
        let b = b.run(start(), 0.0..end).expect("a run");
        assert_alike(&a.last().q, &b.last().q, 1e-12);
    }
    // An input that is not given is zero, and so are all inputs of the model itself.
    let given = Stiffened { n: 11 };
    let start = || given.state(wave(11), vec![0.0; 11]);
    let run = Simulation::new(&given).step(0.05);
    let zero = run.clone().input("e", |_| 0.0).run(start(), 0.0..20.0);
    let plain = run.run(start(), 0.0..20.0).expect("a run");
    assert_eq!(zero.expect("a run").states(), plain.states());
    assert!(plain.energy_error() < 1e-9);
}

/// A control loop gives the same as a table of the same values, and as a model of fixed size.
#[test]
fn a_loop_holds_what_was_set() {
    let long = chain(4);
    let start = || chain(4).state([0.1, -0.2, 0.3, 0.0], [0.0; 4]);
    let run = Simulation::new(&long).step(0.02).input("w", w);
    let mut held = run.clone().hold(start(), 0.0).expect("a run");
    let (mut times, mut values) = (Vec::new(), Vec::new());
    for _ in 0..200 {
        let node = held.node();
        let push = -2.0 * node.q[3] - 0.5 * node.v[3];
        times.push(node.t);
        values.push(push);
        held.set("u", push);
        held.advance().expect("a step");
        let node = held.node();
        assert_eq!(node.output("power[3]"), Some(push * node.v[3]));
        assert_eq!(node.output("pull"), Some(4.0 * (w(node.t) - node.q[0])));
        assert_eq!((node.outputs().len(), node.output("power[4]")), (5, None));
    }
    let table = run.clone().table("u", times, values, Interpolation::Hold);
    let table = table.run(start(), 0.0..4.0).expect("a run");
    assert_alike(&held.node().q, &table.last().q, 1e-12);
    // The same feedback law, sampled every fifth step.
    let mut long = run.hold(start(), 0.0).expect("a run");
    let four = Four {
        m: 1.3,
        k: 4.0,
        a: 0.7,
        c: 0.05,
    };
    let start = four.state([0.1, -0.2, 0.3, 0.0], [0.0; 4]);
    let four = Simulation::new(&four).step(0.02).input("w", w);
    let mut four = four.hold(start, 0.0).expect("a run");
    long.sample("u", 0.1, |node| -node.q[3]).expect("a name");
    four.sample("u", 0.1, |node| -node.q[3]).expect("a name");
    for _ in 0..200 {
        long.advance().expect("a step");
        four.advance().expect("a step");
        assert_alike(&long.node().q, &four.node().q, 1e-12);
        let (pull, others) = (long.node().output("pull"), four.node().outputs());
        assert_alike(pull.as_slice(), others, 1e-12);
    }
}

/// Possible mistakes of functions and callers: the errors are as for models of fixed size.
#[test]
fn what_is_wrong_with_inputs_is_told() {
    let model = chain(3);
    let start = || chain(3).state([0.0; 3], [0.0; 3]);
    let run = || Simulation::new(&model).step(0.1);
    let kind = |run: family::Simulation<'_, family::Driven<'_, Chain>>| {
        run.run(start(), 0.0..2.0).err().map(|error| {
            let last = error.partial().last().t;
            (error.kind().clone(), last)
        })
    };
    let unknown = kind(run().input("x", |t| t));
    let is_unknown = |kind: &RunErrorKind| matches!(kind, RunErrorKind::Input(InputError::Unknown { known, .. }) if known[..] == ["w", "u"]);
    assert!(unknown.is_some_and(|(kind, t)| is_unknown(&kind) && t == 0.0));
    let nan = kind(run().input("u", |t| if t > 1.05 { f64::NAN } else { t }));
    let (nan, t) = nan.expect("an error");
    let RunErrorKind::Input(InputError::Value { name, time, value }) = nan else {
        panic!("{nan}")
    };
    assert!(name == "u" && (1.0..1.2).contains(&time) && value.is_nan() && (t - 1.0).abs() < 1e-12);
    let panics = kind(run().input("u", |t| match t > 1.05 {
        true => panic!("a panic that is meant"),
        false => t,
    }));
    let (panics, t) = panics.expect("an error");
    assert!(
        matches!(panics, RunErrorKind::Input(InputError::Panicked { time }) if (time - 1.0).abs() < 1e-12)
    );
    assert!((t - 1.0).abs() < 1e-12);
    let table = kind(run().table("u", [0.0, 0.0], [1.0, 2.0], Interpolation::Hold));
    assert!(matches!(
        table,
        Some((RunErrorKind::Input(InputError::Table { .. }), _))
    ));
    let mut held = run().hold(start(), 0.0).expect("a run");
    held.set("u", f64::INFINITY);
    let refused = held.advance();
    assert!(matches!(
        refused,
        Err(RunErrorKind::Input(InputError::NotFinite { .. }))
    ));
    held.set("v", 1.0);
    let refused = held.advance();
    assert!(matches!(
        refused,
        Err(RunErrorKind::Input(InputError::Unknown { .. }))
    ));
    held.advance().expect("a step");
    assert!(held.sample("u", 0.0, |_| 0.0).is_err());
    let wrong = Simulation::new(&model)
        .step(0.1)
        .hold(chain(2).state([0.0; 2], [0.0; 2]), 0.0);
    assert!(matches!(wrong, Err(RunErrorKind::Family(_))));
}

/// Impulses, events, checkpoints and parameters of a driven model.
#[test]
fn driven_models_are_models() {
    let (given, written) = (chain(5), written(5));
    let start = || chain(5).state(wave(5), vec![0.0; 5]);
    let driven = Driven::new(&given).input("w", w).expect("a name");
    let driven = driven.input("u", u).expect("a name");
    assert_eq!((driven.len(), driven.parameters()), (5, 4));
    macro_rules! met {
        ($model:expr) => {{
            let run = Simulation::new($model)
                .step(0.05)
                .impulse(0.5, vec![0.1; 5])
                .on("pull", Crossing::Either, |_| {
                    Act::Set(tfe::Settings::new("c", 0.5))
                });
            let motion = run.run(start(), 0.0..5.0).expect("a run");
            assert!(!motion.settings().is_empty());
            let times: Vec<f64> = motion.events().iter().map(|event| event.t).collect();
            let run = Simulation::new($model).step(0.05);
            let half = run.run(start(), 0.0..2.0).expect("a run");
            let rest = run.resume(half.checkpoint().expect("one"), 5.0);
            let whole = run.run(start(), 0.0..5.0).expect("a run");
            assert_eq!(rest.expect("a run").last(), whole.last());
            (motion.last().q.clone(), times)
        }};
    }
    let (a, b) = (met!(&driven), met!(&written));
    assert_alike(&a.0, &b.0, 1e-11);
    assert_alike(&a.1, &b.1, 1e-11);
}

/// With constraints, with masses that depend on an input, and derivatives.
#[cfg(feature = "sparse")]
mod sparse {
    use super::{assert_alike, chain, u, w, wave, written};
    use tfe::Driven;
    use tfe::prelude::*;
    use tfe::sensitivity::Loss;

    /// A chain of rods with a moved end.
    #[dynamics(
        coordinates(x[n], y[n]),
        lagrangian = sum(i in 0..n, ((dot(x[i]) + s)^2 + dot(y[i])^2)/2 - 9.81*y[i]),
        constraint(first) = x[0]^2 + y[0]^2 - 1,
        constraint(rod[i in 0..n-1]) = (x[i+1] - x[i])^2 + (y[i+1] - y[i])^2 - 1,
        input(s, u),
        force(y[n-1]) = u,
    )]
    struct Rods {
        n: usize,
    }

    #[dynamics(
        coordinates(x[n], y[n]),
        let s = 0.3*cos(2*t),
        let u = 0.1*sin(t)*exp(-t/10),
        lagrangian = sum(i in 0..n, ((dot(x[i]) + s)^2 + dot(y[i])^2)/2 - 9.81*y[i]),
        constraint(first) = x[0]^2 + y[0]^2 - 1,
        constraint(rod[i in 0..n-1]) = (x[i+1] - x[i])^2 + (y[i+1] - y[i])^2 - 1,
        force(y[n-1]) = u,
    )]
    struct RodsWritten {
        n: usize,
    }

    /// Bodies that lose mass, coupled by their mass matrix.
    #[dynamics(
        coordinates(q[n]),
        lagrangian = sum(i in 0..n, (2 - r)*dot(q[i])^2/2 + cos(q[i])) + sum(i in 0..n-1, b*dot(q[i])*dot(q[i+1])),
        input(r),
    )]
    struct Losing {
        n: usize,
        b: f64,
    }

    #[dynamics(
        coordinates(q[n]),
        let r = t/10,
        lagrangian = sum(i in 0..n, (2 - r)*dot(q[i])^2/2 + cos(q[i])) + sum(i in 0..n-1, b*dot(q[i])*dot(q[i+1])),
    )]
    struct LosingWritten {
        n: usize,
        b: f64,
    }

    #[test]
    fn inputs_push_constrained_models_and_move_masses() {
        let (given, written) = (Rods { n: 3 }, RodsWritten { n: 3 });
        let start = || given.state([1.0, 2.0, 3.0, 0.0, 0.0, 0.0], [0.0; 6]);
        // The momenta on moving ground are those at the start.
        let moved = |mut state: tfe::family::FamilyState| {
            state.p[..3].iter_mut().for_each(|p| *p = w(0.0));
            state
        };
        let run = Simulation::new(&given).step(0.01).input("s", w);
        let run = run.input("u", u);
        let a = run.run(moved(start()), 0.0..2.0).expect("a run");
        let b = Simulation::new(&written).step(0.01);
        let b = b.run(moved(start()), 0.0..2.0).expect("a run");
        assert_alike(&a.last().q, &b.last().q, 1e-11);
        assert_alike(&a.last().v, &b.last().v, 1e-11);
        assert!(a.constraint_residual().position < 1e-13);

        let (given, written) = (Losing { n: 4, b: 0.2 }, LosingWritten { n: 4, b: 0.2 });
        let start = || written.state([0.3, -0.2, 0.5, 0.1], [0.1; 4]);
        let a = Simulation::new(&given).step(0.05).input("r", |t| t / 10.0);
        let a = a.run(start(), 0.0..5.0).expect("a run");
        let b = Simulation::new(&written).step(0.05);
        let b = b.run(start(), 0.0..5.0).expect("a run");
        assert_alike(&a.last().q, &b.last().q, 1e-12);
        assert_alike(&a.last().p, &b.last().p, 1e-12);
    }

    #[test]
    fn derivatives_of_driven_models_are_those_of_written_ones() {
        let (given, written) = (chain(6), written(6));
        let driven = Driven::new(&given).input("w", w).expect("a name");
        let driven = driven.input("u", u).expect("a name");
        let start = || written.state(wave(6), vec![0.0; 6]);
        let loss = Loss::of_end(|q, _, _| q[5] * q[5]).and(Loss::integral("pull"));
        let given = Simulation::new(&driven).step(0.05);
        let other = Simulation::new(&written).step(0.05);
        let a = given
            .gradient(start(), 0.0..3.0, &loss)
            .expect("a gradient");
        let b = other
            .gradient(start(), 0.0..3.0, &loss)
            .expect("a gradient");
        assert!((a.0 - b.0).abs() < 1e-12);
        assert_alike(a.1.by_parameters(), b.1.by_parameters(), 1e-11);
        let a = given.run_linearised(start(), 0.0..3.0).expect("a run");
        let b = other.run_linearised(start(), 0.0..3.0).expect("a run");
        assert_alike(a.product().as_slice(), b.product().as_slice(), 1e-11);
        let a = given.run_sensitive(start(), 0.0..3.0).expect("a run");
        let b = other.run_sensitive(start(), 0.0..3.0).expect("a run");
        let at = |s: &tfe::family::Sensitive| s.by_start().at(1.23).expect("within");
        assert_alike(at(&a).as_slice(), at(&b).as_slice(), 1e-10);
    }
}

/// Functions are called for times within the span of a run only; outside they may be undefined.
#[test]
fn functions_are_not_asked_beyond_the_span() {
    let wind = |t: f64| {
        assert!((2.0..=3.0).contains(&t), "no wind at {t}");
        t
    };
    let chain = Chain {
        n: 3,
        m: 1.0,
        k: 1.0,
        a: 0.1,
        c: 0.1,
    };
    let start = chain.state([0.1, 0.0, -0.1], [0.0; 3]);
    let run = Simulation::new(&chain).step(0.1).input("u", wind);
    let by_newton = cfg!(feature = "sparse").then_some(Solve::Newton);
    for solve in [Some(Solve::Auto), by_newton].into_iter().flatten() {
        let run = run.clone().solver(solve).run(start.clone(), 2.0..3.0);
        run.expect("a run");
    }
}
