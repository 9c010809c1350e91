//! Ensembles give the same as single runs for every initial state, whatever happens to the others.

mod going_on;
#[path = "../common/largest.rs"]
mod largest;
mod parameter_sets;

use largest::larger;
use std::sync::Mutex;
use tfe::ensemble::EnsembleError;
use tfe::prelude::*;
use tfe::{RunErrorKind, StepError, Warning};

#[dynamics(coordinates(theta), lagrangian = m/2*(l*dot(theta))^2 + m*g*l*cos(theta))]
struct Pendulum {
    m: f64,
    l: f64,
    g: f64,
}

#[dynamics(coordinates(theta), momenta(p), hamiltonian = p^2/(2*m*l^2) - m*g*l*cos(theta))]
struct PendulumH {
    m: f64,
    l: f64,
    g: f64,
}

#[dynamics(
    coordinates(x, y), momenta(px, py),
    hamiltonian = (px^2 + py^2)/2 + (x^2 + y^2)/2 + lambda*(x^2*y - y^3/3),
)]
struct HenonHeiles {
    lambda: f64,
}

#[dynamics(
    coordinates(theta1, theta2),
    lagrangian = dot(theta1)^2 + dot(theta2)^2/2 + dot(theta1)*dot(theta2)*cos(theta1 - theta2)
               + g*(2*cos(theta1) + cos(theta2)),
)]
struct DoublePendulum {
    g: f64,
}

/// Driven and damped, with a mass that depends on the position.
#[dynamics(
    coordinates(x),
    lagrangian = (1 + x^2/4)*dot(x)^2/2 - x^2/2 - x^4/4,
    force(x) = -c*dot(x)*(1 + x^2) + cos(2*t),
)]
struct Driven {
    c: f64,
}

/// A Hamiltonian that rotates by mixed terms: neither separable nor with a constant mass.
#[dynamics(
    coordinates(x, y), momenta(px, py),
    hamiltonian = (px^2 + py^2)*(1 + x^2/10)/2 + (x*py - y*px)*(1 + sin(t)/5) + (x^2 + y^2)/2 + x^4/8,
)]
struct Turning;

/// A single run solves it by Newton's method, lanes by fixed-point iteration.
#[dynamics(coordinates(x), lagrangian = dot(x)^2/2 - k/2*x^2, dissipation = c/2*dot(x)^2)]
struct Oscillator {
    k: f64,
    c: f64,
}

/// There is no force, and no motion, for negative x.
#[dynamics(coordinates(x), lagrangian = dot(x)^2/2 - x^(3/2))]
struct HalfLine;

#[dynamics(coordinates(x), lagrangian = dot(x)^2/2 - x^4/4)]
struct Quartic;

#[dynamics(coordinates(x, y), lagrangian = (dot(x)^2 + dot(y)^2)/2 - g*y, constraint(rod) = x^2 + y^2 - 1)]
struct Rod {
    g: f64,
}

/// `count` numbers from 0 to 1.
fn fractions(count: usize) -> impl Iterator<Item = f64> {
    (0..count).map(move |k| k as f64 / count as f64)
}

fn distance<const N: usize>(a: &Node<N>, b: &Node<N>) -> f64 {
    let (mut worst, mut scale) = (0.0_f64, 0.0_f64);
    for (x, y) in a.q.iter().chain(&a.p).zip(b.q.iter().chain(&b.p)) {
        worst = larger(worst, (x - y).abs());
        scale = scale.max(y.abs());
    }
    worst / scale
}

/// An ensemble compared with single runs, over a span that is not a whole number of steps.
#[track_caller]
fn agree<M, const N: usize>(model: &M, element: impl Into<Element> + Copy, starts: &[State<N>])
where
    M: Model<N> + Sync,
{
    let span = 0.0..10.03;
    let ensemble = Ensemble::new(model).element(element).step(0.05);
    let ends = ensemble.run(starts, span.clone()).expect("a good plan");
    assert_eq!(ends.len(), starts.len());
    let mut steps = 0;
    for (start, end) in starts.iter().zip(&ends) {
        let simulation = Simulation::new(model).element(element).step(0.05);
        let motion = simulation
            .run(*start, span.clone())
            .expect("a regular motion");
        steps += motion.statistics().steps;
        let end = end.as_ref().expect("a regular motion");
        assert_eq!(end.t, 10.03);
        // The rounding errors of two hundred steps, in motions that hardly amplify them.
        let error = distance(end, motion.last());
        assert!(error <= 1e-13, "{error:.1e} from {start:?}");
    }
    assert_eq!(ends.statistics().steps, steps);
}

#[test]
fn ensembles_are_single_runs() {
    let model = Pendulum {
        m: 1.3,
        l: 0.8,
        g: 9.81,
    };
    let starts: Vec<_> = fractions(21)
        .map(|f| model.state([2.0 * f], [0.1]))
        .collect();
    agree(&model, Mixed::<6>, &starts);
    agree(&model, Radau::<3>, &starts);
    // Elements with full quadrature do not support lanes.
    agree(&model, Primal::<3>, &starts[..3]);

    let model = PendulumH {
        m: 1.3,
        l: 0.8,
        g: 9.81,
    };
    agree(&model, Mixed::<6>, &starts);

    let model = HenonHeiles { lambda: 1.0 };
    let starts: Vec<_> = fractions(13)
        .map(|f| model.state([0.2 * f, 0.1], [0.1, 0.1]))
        .collect();
    agree(&model, Mixed::<5>, &starts);

    let model = DoublePendulum { g: 9.81 };
    let starts: Vec<_> = fractions(9)
        .map(|f| model.state([0.4 * f, 0.1], [0.0, 0.2]))
        .collect();
    agree(&model, Mixed::<4>, &starts);

    let model = Driven { c: 0.1 };
    let starts: Vec<_> = fractions(10).map(|f| model.state([f], [0.3])).collect();
    agree(&model, Mixed::<5>, &starts);

    let starts: Vec<_> = fractions(10)
        .map(|f| State {
            q: [f, 0.1],
            p: [0.0, 0.3],
        })
        .collect();
    agree(&Turning, Mixed::<4>, &starts);

    let model = Oscillator { k: 2.0, c: 0.1 };
    let starts: Vec<_> = fractions(5).map(|f| model.state([f], [1.0])).collect();
    agree(&model, Mixed::<4>, &starts);
}

#[dynamics(
    coordinates(x, y),
    lagrangian = m/2*(dot(x)^2 + dot(y)^2) - m*k*((x^2 + y^2)/2 + x^2*y/l),
)]
struct Scaled {
    m: f64,
    k: f64,
    l: f64,
}

/// The same motion in units of mass, length and time that are powers of two, which do not change any digit.
#[test]
fn units_of_all_sizes_are_alike() {
    let end = |[mass, length, time]: [i32; 3]| {
        let [mass, length, time] = [mass, length, time].map(|power| 2.0_f64.powi(power));
        let model = Scaled {
            m: mass,
            k: 1.0 / (time * time),
            l: length,
        };
        let (h, speed) = (0.25 * time, length / time);
        let start = model.state([0.3 * length, -0.2 * length], [0.1 * speed, 0.3 * speed]);
        let span = 0.0..200.0 * h;
        let motion = Simulation::new(&model).step(h).run(start, span.clone());
        let single = motion.expect("a regular motion").last().q;
        let ends = Ensemble::new(&model).step(h).run(&[start; 9], span);
        let several = ends.expect("a good plan").into_results().swap_remove(8);
        let several = several.expect("a regular motion").q;
        [single, several].map(|q| q.map(|x| x / length))
    };
    let expected = end([0, 0, 0]);
    for units in [
        [900, 0, 0],
        [-900, 0, 0],
        [100, 100, -100],
        [-300, 200, 100],
        [930, -80, -40],
    ] {
        for (end, expected) in end(units).iter().zip(&expected) {
            for a in 0..2 {
                let error = (end[a] - expected[a]).abs();
                // The rounding errors of two hundred steps.
                assert!(error <= 1e-13, "{units:?}: {error:.1e}");
            }
        }
    }
}

#[test]
fn one_failure_leaves_the_others() {
    let mut starts: Vec<_> = fractions(12)
        .map(|f| HalfLine.state([1.0 + f], [20.0]))
        .collect();
    let alone = Ensemble::new(&HalfLine)
        .step(0.1)
        .run(&starts, 0.0..2.0)
        .expect("a good plan");
    assert_eq!(alone.failures().count(), 0);
    // One motion reaches the singularity, and one starts outside the domain.
    starts[5] = HalfLine.state([1.0], [-5.0]);
    starts[9].q[0] = f64::INFINITY;
    let ends = Ensemble::new(&HalfLine)
        .step(0.1)
        .run(&starts, 0.0..2.0)
        .expect("a good plan");
    let failures: Vec<_> = ends.failures().map(|failure| failure.index).collect();
    assert_eq!(failures, [5, 9]);
    assert_eq!(ends.nodes().count(), 10);
    let single = Simulation::new(&HalfLine)
        .step(0.1)
        .run(starts[5], 0.0..2.0);
    let single = single.expect_err("it falls off");
    let (
        Err(RunErrorKind::Solve {
            element,
            time,
            source,
            ..
        }),
        RunErrorKind::Solve {
            element: expected, ..
        },
    ) = (&ends[5], single.kind())
    else {
        panic!("{:?} instead of {:?}", ends[5], single.kind());
    };
    assert_eq!((element, *time), (expected, *element as f64 * 0.1));
    assert_eq!(*source, StepError::NonFinite);
    assert!(matches!(
        ends[9],
        Err(RunErrorKind::Start { coordinate: 0, .. })
    ));
    for k in (0..12).filter(|k| ![5, 9].contains(k)) {
        assert_eq!(ends[k], alone[k], "start {k} has seen its neighbours");
    }
}

#[test]
fn a_stiff_start_goes_its_own_way() {
    // Its frequency is proportional to the amplitude: at 60 the fixed-point iteration does not contract.
    let mut starts: Vec<_> = fractions(8)
        .map(|f| Quartic.state([1.0 + f], [0.0]))
        .collect();
    starts[3] = Quartic.state([60.0], [0.0]);
    let ensemble = Ensemble::new(&Quartic).element(Mixed::<4>).step(0.05);
    let ends = ensemble.run(&starts, 0.0..1.0).expect("a good plan");
    assert!(ends.statistics().fallbacks > 0 && ends.statistics().newton_iterations > 0);
    for (start, end) in starts.iter().zip(&ends) {
        let simulation = Simulation::new(&Quartic).element(Mixed::<4>).step(0.05);
        let motion = simulation
            .run(*start, 0.0..1.0)
            .expect("Newton's method does it");
        let error = distance(
            end.as_ref().expect("Newton's method does it"),
            motion.last(),
        );
        // Twenty steps, each with a phase of about three radians at the large amplitude.
        assert!(error <= 1e-11, "{error:.1e} from {start:?}");
    }
    // If only fixed-point iteration is allowed, this run fails in its first element, and no other does.
    let ensemble = ensemble.solver(Solve::FixedPoint);
    let ends = ensemble.run(&starts, 0.0..1.0).expect("a good plan");
    let failed = matches!(ends[3], Err(RunErrorKind::Solve { element: 0, .. }));
    assert!(failed && ends.failures().count() == 1, "{:?}", ends[3]);
}

#[test]
fn constrained_models_run_one_by_one() {
    let model = Rod { g: 9.81 };
    let starts: Vec<_> = fractions(3)
        .map(|f| model.state([f.sin(), -f.cos()], [0.0, 0.0]))
        .chain([model.state([2.0, 0.0], [0.0, 0.0])])
        .collect();
    let ends = Ensemble::new(&model)
        .step(0.02)
        .run(&starts, 0.0..1.0)
        .expect("a good plan");
    for (start, end) in starts[..3].iter().zip(&ends) {
        let motion = Simulation::new(&model)
            .step(0.02)
            .run(*start, 0.0..1.0)
            .expect("a regular motion");
        assert_eq!(end.as_ref(), Ok(motion.last()));
    }
    assert!(matches!(ends[3], Err(RunErrorKind::Inconsistent { .. })));
}

#[test]
fn results_come_once_each_in_batches() {
    let starts: Vec<_> = fractions(50)
        .map(|f| Quartic.state([1.0 + f], [0.0]))
        .collect();
    let ensemble = Ensemble::new(&Quartic).step(0.1);
    let ends = ensemble.run(&starts, 0.0..3.0).expect("a good plan");
    let seen = Mutex::new(vec![Vec::new(); 50]);
    let statistics = ensemble
        .for_each(&starts, 0.0..3.0, |index, result| {
            seen.lock().expect("no thread panics")[index].push(result);
        })
        .expect("a good plan");
    assert_eq!(statistics, *ends.statistics());
    let seen = seen.into_inner().expect("no thread panics");
    for (index, results) in seen.iter().enumerate() {
        assert_eq!(results[..], [ends[index].clone()]);
    }
}

#[test]
fn spans_of_all_kinds() {
    let starts: Vec<_> = fractions(5)
        .map(|f| Quartic.state([1.0 + f], [0.0]))
        .collect();
    let ensemble = Ensemble::new(&Quartic)
        .element(Mixed::<6>)
        .step(0.02)
        .break_at(0.333);
    let ends = ensemble.run(&starts, 0.0..1.0).expect("a good plan");
    let there: Vec<_> = ends.nodes().map(Node::state).collect();
    let back = ensemble.run(&there, 1.0..0.0).expect("a good plan");
    assert_eq!(back.nodes().count(), starts.len());
    for (start, end) in starts.iter().zip(back.nodes()) {
        // The motion is reversible: only rounding errors of a hundred steps are left.
        assert!((start.q[0] - end.q[0]).abs() <= 1e-13 && end.p[0].abs() <= 1e-13);
    }
    let empty = ensemble
        .run(&starts, 2.0..2.0)
        .expect("an empty span is none to fail in");
    assert_eq!(empty.nodes().count(), starts.len());
    for (start, end) in starts.iter().zip(empty.nodes()) {
        assert_eq!((end.t, end.state()), (2.0, *start));
    }
    assert!(
        ensemble
            .run(&[], 0.0..1.0)
            .expect("no starts, no results")
            .is_empty()
    );

    let plan = |step: f64, span| Ensemble::new(&Quartic).step(step).run(&starts, span).err();
    assert!(matches!(
        plan(0.0, 0.0..1.0),
        Some(EnsembleError::Run(RunErrorKind::Step { .. }))
    ));
    assert!(matches!(
        plan(0.1, 0.0..f64::NAN),
        Some(EnsembleError::Run(RunErrorKind::Span { .. }))
    ));
    let element = Ensemble::new(&Quartic)
        .element(Element::mixed(99))
        .run(&starts, 0.0..1.0);
    assert!(matches!(
        element,
        Err(EnsembleError::Run(RunErrorKind::Element(_)))
    ));
    for wrong in [f64::NAN, f64::INFINITY, -1.0, 1.0] {
        let ensemble = Ensemble::new(&Quartic).step(0.1).tolerance(wrong);
        for error in [
            ensemble.run(&starts, 0.0..1.0).err(),
            ensemble.begin(&starts, 0.0).err(),
        ] {
            assert!(matches!(
                error,
                Some(EnsembleError::Run(RunErrorKind::Tolerance { .. }))
            ));
        }
    }
}

/// The warnings that single runs would have, counted by kind: double pendulums with steps that are far too long, whose
/// roots are accepted without checks.
#[test]
fn warnings_are_counted_by_kind() {
    let model = DoublePendulum { g: 9.81 };
    let starts: Vec<_> = fractions(40)
        .map(|f| model.state([3.0 * f, 2.0 - f], [f, 0.0]))
        .collect();
    let (h, end) = (0.6, 6.0);
    let ensemble = Ensemble::new(&model).step(h).solver(Solve::Trusting);
    let ends = ensemble.run(&starts, 0.0..end).expect("runs");
    let single = Simulation::new(&model).step(h).solver(Solve::Trusting);
    let single = single.record_every(10);
    let is_jump = |start: &State<2>| {
        let motion = single.run(*start, 0.0..end);
        let jump = |one: &Warning| matches!(one, Warning::EnergyJump { .. });
        motion.is_ok_and(|motion| motion.warnings().iter().any(jump))
    };
    let expected = starts.iter().filter(|start| is_jump(start)).count();
    let found = ends.warnings();
    assert_eq!(found.energy_jump, expected, "{found}");
    assert!(expected > 10 && expected < 40, "{expected}");
    let mut run = ensemble.begin(&starts, 0.0).expect("starts");
    assert_eq!(run.run_to(end).expect("runs").warnings(), found);
    // With a proper step size there are none.
    let ends = ensemble.step(0.01).run(&starts, 0.0..end).expect("runs");
    assert!(ends.warnings().is_empty(), "{}", ends.warnings());
}
