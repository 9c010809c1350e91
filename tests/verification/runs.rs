//! Runs: ends, dense output, files, impulses, failures.

use crate::common::{assert_close, larger, observed_order};
use crate::models::{DoublePendulum, Pendulum};
use tfe::prelude::*;
use tfe::runtime::ConstraintError;
use tfe::{AtError, RunErrorKind, StepError};

#[test]
fn the_end_is_the_end() {
    let model = Pendulum { k: 1.0 };
    let start = model.state([1.0], [0.0]);
    for (span, step) in [
        (0.0..1.0, 0.3),
        (0.0..10.0, 0.01),
        (-1.0..0.5, 0.2),
        (2.0..1.0, 0.3),
    ] {
        let motion = Simulation::new(&model)
            .step(step)
            .run(start, span.clone())
            .expect("a run");
        assert_eq!(motion.states()[0].t, span.start);
        assert_eq!(motion.last().t.to_bits(), span.end.to_bits());
    }
    let still = Simulation::new(&model)
        .step(0.1)
        .run(start, 3.0..3.0)
        .expect("an empty span");
    assert_eq!((still.states().len(), still.last().q), (1, start.q));
}

#[test]
fn dense_output_is_continuous_and_accurate() {
    let model = DoublePendulum::UNIT;
    let start = model.state([0.5, -0.3], [0.0, 0.0]);
    let fine = Simulation::new(&model)
        .element(Mixed::<8>)
        .step(0.005)
        .run(start, 0.0..1.0)
        .expect("the reference");
    for element in [
        Element::mixed(3),
        Element::mixed(4),
        Element::primal(3),
        Element::primal(4).lobatto(),
        Element::mixed(3).quadrature(4),
        Element::energy_conserving(3),
        Element::radau(4),
    ] {
        let error = |step: f64| {
            let motion = Simulation::new(&model)
                .element(element)
                .step(step)
                .run(start, 0.0..1.0)
                .expect("a motion");
            for node in &motion.states()[1..motion.states().len() - 1] {
                for side in [-1e-12, 1e-12] {
                    let near = motion.at(node.t + side).expect("inside");
                    // |q̇| < 4 and |ṗ| < 40 over 1e-12, and rounding errors of the sums of stages.
                    assert_close(
                        &near.q,
                        &node.q,
                        3e-11,
                        &format!("{element}: q at {}", node.t),
                    );
                    assert_close(
                        &near.p,
                        &node.p,
                        3e-10,
                        &format!("{element}: p at {}", node.t),
                    );
                }
            }
            (0..=37)
                .map(|k| f64::from(k) / 37.0)
                .map(|t| {
                    let (a, b) = (
                        motion.at(t).expect("inside").q,
                        fine.at(t).expect("inside").q,
                    );
                    (a[0] - b[0]).hypot(a[1] - b[1])
                })
                .fold(0.0, larger)
        };
        let points: Vec<_> = [0.1, 0.05, 0.025].map(|step| (step, error(step))).into();
        let order = observed_order(&points, 1e-13, "dense output");
        // A polynomial of degree n − 1 has the order n between nodes (one less for Radau elements and the projections).
        assert!(
            order > element.nodes() as f64 - 1.4,
            "{element}: dense output of order {order:.2}: {points:?}"
        );
    }
}

/// At t = 1e9, differences of times have errors of 6e-5 relative to a step of 0.001. Velocities between nodes and
/// integrals must not be affected.
#[test]
fn far_from_zero_elements_are_as_long_as_their_steps() {
    let pendulum = Pendulum { k: 1.0 };
    let motion = Simulation::new(&pendulum)
        .element(Mixed::<6>)
        .step(1e-3)
        .run(pendulum.state([2.0], [0.5]), 1e9..1e9 + 0.5)
        .expect("a run");
    let mut worst = 0.0;
    for pair in motion.states().windows(2) {
        let middle = pair[0].t + 0.5 * (pair[1].t - pair[0].t);
        // The mass is one. The polynomials of q and of p have errors of h⁵ and less.
        let node = motion.at(middle).expect("inside");
        worst = larger(worst, (node.v[0] - node.p[0]).abs());
    }
    assert!(worst < 1e-12, "{worst:e}");

    let double = DoublePendulum::UNIT;
    let start = double.state([0.5, -0.3], [0.0, 0.0]);
    let integral = |span| {
        let run = Simulation::new(&double).step(1e-3).run(start, span);
        let motion = run.expect("a run");
        let values = motion.integral(&double, "tip_x").expect("an output");
        values.last().copied().expect("the end")
    };
    // The same steps, and sums of 2000 numbers below 0.001.
    let (far, near) = (integral(1e9..1e9 + 2.0), integral(0.0..2.0));
    assert!((far - near).abs() < 1e-13, "{far:e} {near:e}");
}

#[test]
fn outside_the_motion_and_between_recorded_nodes() {
    let model = Pendulum { k: 1.0 };
    let start = model.state([1.0], [0.0]);
    let motion = Simulation::new(&model)
        .step(0.1)
        .run(start, 0.0..1.0)
        .expect("a run");
    assert!(matches!(motion.at(1.5), Err(AtError::Outside { .. })));
    assert!(matches!(motion.at(f64::NAN), Err(AtError::Outside { .. })));
    let sparse = Simulation::new(&model)
        .step(0.1)
        .record_every(4)
        .run(start, 0.0..1.0)
        .expect("a run");
    let times: Vec<f64> = sparse.states().iter().map(|node| node.t).collect();
    assert_close(&times, &[0.0, 0.4, 0.8, 1.0], 1e-15, "recorded times");
    assert_eq!(
        sparse.at(0.4).expect("recorded").q,
        motion.at(0.4).expect("recorded").q
    );
    assert!(matches!(sparse.at(0.5), Err(AtError::NotRecorded { .. })));
    let back = Simulation::new(&model)
        .step(0.1)
        .run(motion.last().state(), 1.0..0.0)
        .expect("backward");
    assert_close(
        &back.at(0.55).expect("inside").q,
        &motion.at(0.55).expect("inside").q,
        1e-7,
        "backward dense output",
    );
}

#[test]
fn csv_reads_back_exactly() {
    let model = DoublePendulum::UNIT;
    let motion = Simulation::new(&model)
        .step(0.1)
        .run(model.state([0.5, -0.3], [0.0, 0.0]), 0.0..1.0)
        .expect("a run");
    let path = std::env::temp_dir().join(format!("tfe-csv-{}.csv", std::process::id()));
    motion.write_csv(&path).expect("a writable folder");
    let text = std::fs::read_to_string(&path).expect("the file just written");
    std::fs::remove_file(&path).expect("the file just read");
    let mut lines = text.lines();
    assert_eq!(
        lines.next(),
        Some("t,theta1,theta2,theta1_dot,theta2_dot,p_theta1,p_theta2,energy,tip_x,tip_y")
    );
    let rows: Vec<Vec<f64>> = lines
        .map(|line| {
            line.split(',')
                .map(|cell| cell.parse().expect("a number"))
                .collect()
        })
        .collect();
    assert_eq!(rows.len(), 11);
    for (row, node) in rows.iter().zip(motion.states()) {
        assert_eq!(
            (row[0], &row[1..3], &row[5..7]),
            (node.t, &node.q[..], &node.p[..])
        );
        assert_eq!(row[8], model.tip_x(node.t, node.q, [row[3], row[4]]));
    }
    assert_eq!(
        motion.outputs().column("tip_y").expect("declared").len(),
        11
    );
    assert!(motion.outputs().column("tip_z").is_none());
}

#[test]
fn steps_are_the_nodes_of_a_run() {
    let model = Pendulum { k: 1.0 };
    let start = model.state([1.0], [0.0]);
    let simulation = Simulation::new(&model).step(0.25);
    let motion = simulation.run(start, 0.0..25.0).expect("a run");
    let mut steps = simulation.steps(start, 0.0);
    for node in &motion.states()[1..] {
        assert_eq!(steps.next().expect("endless").expect("a good step"), *node);
    }
    assert_eq!(steps.statistics().steps, motion.statistics().steps);
    let mut broken = Simulation::new(&model).step(f64::NAN).steps(start, 0.0);
    assert!(matches!(
        broken.next(),
        Some(Err(RunErrorKind::Step { .. }))
    ));
    assert!(broken.next().is_none());
}

#[test]
fn nodes_have_velocities() {
    let model = Pendulum { k: 1.0 };
    let start = model.state([1.0], [0.5]);
    let simulation = Simulation::new(&model).element(Mixed::<6>).step(0.25);
    let motion = simulation.run(start, 0.0..5.0).expect("a run");
    for (node, v) in motion.states().iter().zip(motion.velocities()) {
        assert_eq!(node.v, *v);
        assert_eq!(model.velocity(node.t, &node.state()), *v);
    }
    // Between nodes, the derivative of a polynomial of degree five has an error of h⁵; at the points where the
    // equations hold, only a rounding error.
    for k in 1..200 {
        let between = motion.at(0.025 * f64::from(k)).expect("inside");
        let [v] = model.velocity(between.t, &between.state());
        let [found] = between.v;
        assert!((v - found).abs() < 1e-6, "{found} for {v}");
    }
    let ends = Ensemble::new(&model).step(0.25).run(&[start], 0.0..5.0);
    let ends = ends.expect("an ensemble");
    let end = ends.iter().next().expect("one").as_ref().expect("an end");
    assert_eq!(end.v, model.velocity(5.0, &end.state()));
}

/// A free particle and a linear force as the limit of a sum of impulses: an impulse in the middle of an element has the
/// exact weight.
#[dynamics(coordinates(x), lagrangian = m/2*dot(x)^2, output(kinetic) = m/2*dot(x)^2)]
struct Free {
    m: f64,
}

/// Backwards in time an impulse is subtracted again: at nodes, inside elements, with constraints, and for a linear
/// model.
#[test]
fn impulses_back_in_time_are_undone() {
    #[dynamics(coordinates(x), lagrangian = dot(x)^2/2 - x^2/2)]
    struct Linear;
    #[dynamics(coordinates(x, y), lagrangian = (dot(x)^2 + dot(y)^2)/2 - y, constraint(rod) = x^2 + y^2 - 1)]
    struct Rod;
    fn check<M: Model<N>, const N: usize>(model: &M, start: State<N>, impulse: [f64; N], by: f64) {
        for (element, inside) in [
            (Mixed::<8>.into(), false),
            (Mixed::<8>.into(), true),
            (Element::primal(6), false),
        ] {
            let run = Simulation::new(model).element(element).step(0.05);
            let run = run.impulse(0.4 + if inside { 0.02 } else { 0.0 }, impulse);
            let run = if inside {
                run.impulse(0.42, impulse)
            } else {
                run.break_at(0.4)
            };
            let forth = run.run(start, 0.0..1.0).expect("a run");
            let back = run.run(forth.last().state(), 1.0..0.0).expect("a run");
            let end = back.last();
            for a in 0..N {
                let off = larger((end.q[a] - start.q[a]).abs(), (end.p[a] - start.p[a]).abs());
                assert!(off < by, "{element} {inside}: {off:e}");
            }
        }
    }
    // Symmetric elements return to the same state.
    let pendulum = Pendulum { k: 1.0 };
    check(&pendulum, pendulum.state([0.3], [0.7]), [1.5], 1e-12);
    check(&Linear, Linear.state([0.3], [0.7]), [1.5], 1e-12);
    let on_rod = Rod.state([0.6, -0.8], [0.8, 0.6]);
    check(&Rod, on_rod, [0.8, 0.6], 1e-11);
    // Along the constraint the impulse acts in full, and the first element starts from the state after it.
    let run = Simulation::new(&Rod).step(0.05);
    let kicked = run.clone().impulse(0.0, [0.8, 0.6]);
    let kicked = kicked.run(on_rod, 0.0..0.1).expect("a run");
    let behind = Rod.state([0.6, -0.8], [1.6, 1.2]);
    let behind = run.run(behind, 0.0..0.1).expect("a run");
    for t in [1e-6, 0.01, 0.03, 0.049] {
        let (a, b) = (kicked.at(t), behind.at(t));
        let (a, b) = (a.expect("inside"), b.expect("inside"));
        assert_close(&a.p, &b.p, 1e-11, "behind an impulse on a rod");
        assert_close(&a.q, &b.q, 1e-11, "behind an impulse on a rod");
    }
    let chain = Chain { n: 3 };
    let start = chain.state([0.1, 0.2, 0.4], [0.0; 3]);
    let run = Simulation::new(&chain)
        .step(0.05)
        .impulse(0.4, [1.0, 0.0, -2.0]);
    let forth = run.run(start.clone(), 0.0..1.0).expect("a run");
    let back = run.run(forth.last().state(), 1.0..0.0).expect("a run");
    for a in 0..3 {
        assert!((back.last().p[a] - start.p[a]).abs() < 1e-12);
    }
}

#[dynamics(
    coordinates(q[n]),
    lagrangian = sum(i in 0..n, dot(q[i])^2/2 + cos(q[i])) - sum(i in 0..n-1, (q[i+1]-q[i])^2/2),
)]
struct Chain {
    n: usize,
}

#[test]
fn impulses_change_momentum_and_are_weighted_inside_elements() {
    let model = Free { m: 2.0 };
    let start = model.state([1.0], [0.5]);
    for element in [
        Element::primal(2),
        Element::primal(3),
        Element::primal(4).lobatto(),
        Element::mixed(2),
        Element::mixed(4),
        Element::energy_conserving(3),
        Element::radau(3),
    ] {
        for time in [0.0, 0.1, 0.25, 0.3, 0.4, 1.0] {
            let motion = Simulation::new(&model)
                .element(element)
                .step(0.1)
                .impulse(time, [0.7])
                .run(start, 0.0..1.0)
                .expect("a run");
            let end = motion.last();
            assert!(
                (end.p[0] - 1.7).abs() < 1e-14,
                "{element}, impulse at {time}: p = {}",
                end.p[0]
            );
            let exact = 1.0 + 0.5 + 0.7 / 2.0 * (1.0 - time);
            let error = end.q[0] - exact;
            // If the test functions contain the linear ones, the position is exactly where the motion with the jump
            // ends. In the two-node mixed element, and in elements with fewer test functions, the impulse is spread
            // over the element: q has an error of up to J h / 2m.
            let exact_weights =
                matches!(element.family(), tfe::Family::Primal | tfe::Family::Mixed);
            let allowed = if exact_weights {
                1e-14
            } else {
                0.7 * 0.1 / 2.0
            };
            assert!(
                error.abs() < allowed,
                "{element}, impulse at {time}: q off by {error:e}"
            );
        }
    }
}

/// Momenta jump at nodes, also if the node and the impulse differ by a rounding error (0.3). Inside elements they are
/// those before or after the impulse, and integrals have the accuracy of the nodes.
#[test]
fn momenta_jump_where_impulses_act_at_nodes() {
    let model = Free { m: 2.0 };
    let start = model.state([1.0], [0.5]);
    for element in [
        Element::primal(3),
        Element::primal(4).lobatto(),
        Element::mixed(2),
        Element::mixed(4),
        Element::energy_conserving(3),
        Element::radau(3),
    ] {
        for time in [0.0, 0.3, 0.5, 1.0] {
            let run = Simulation::new(&model).element(element).step(0.1);
            let run = run.impulse(time, [0.7]);
            let motion = run.run(start, 0.0..1.0).expect("a run");
            for k in 0..100 {
                let t = 0.005 + 0.01 * f64::from(k);
                let p = motion.at(t).expect("inside").p[0];
                let expected = if t < time { 1.0 } else { 1.7 };
                assert!((p - expected).abs() < 1e-14, "{element}: {p} at {t}");
            }
            // The kinetic energy p²/(2m).
            let kinetic = motion.integral(&model, "kinetic").expect("an output");
            let exact = 0.25 * time + 1.7 * 1.7 / 4.0 * (1.0 - time);
            let found = kinetic[kinetic.len() - 1];
            assert!((found - exact).abs() < 1e-14, "{element}: {found}");
        }
    }
}

#[test]
fn breaks_restore_the_order_across_a_jump_of_the_force() {
    #[dynamics(coordinates(x), lagrangian = dot(x)^2/2 - x^2/2 - x^4/4, force(x) = select(t < 1/3, 1, -2))]
    struct Switched {}
    let model = Switched {};
    let start = model.state([0.2], [0.0]);
    let run = |step: f64, element: Element| {
        Simulation::new(&model)
            .element(element)
            .step(step)
            .break_at(1.0 / 3.0)
            .run(start, 0.0..1.0)
            .expect("a run")
            .last()
            .q[0]
    };
    let reference = run(0.01, Element::mixed(8));
    let points: Vec<_> = [0.2, 0.1, 0.05]
        .map(|h| (h, (run(h, Element::mixed(3)) - reference).abs()))
        .into();
    let order = observed_order(&points, 1e-14, "switched force");
    assert!(order > 3.4, "order {order:.2}: {points:?}");
}

#[test]
fn a_run_that_fails_says_where_and_keeps_the_motion() {
    // x falls from one, at rest, to zero at t = ∫ dx/√(4 − 4√x) = 4/3, where the square root ends.
    #[dynamics(coordinates(x), momenta(p), hamiltonian = p^2/2 + 2*sqrt(x))]
    struct Fall {}
    let error = Simulation::new(&Fall {})
        .element(Mixed::<3>)
        .step(0.01)
        .run(State { q: [1.0], p: [0.0] }, 0.0..3.0)
        .expect_err("there is nothing beyond zero");
    let RunErrorKind::Solve { element, time, .. } = error.kind() else {
        panic!("{error}")
    };
    let partial = error.partial();
    assert_eq!(partial.last().t, *time);
    assert_eq!(partial.states().len(), element + 1);
    assert!(*time > 1.3 && *time < 1.34, "{error}");
    assert!(
        partial
            .states()
            .iter()
            .all(|node| node.q[0].is_finite() && node.p[0].is_finite())
    );
    assert!(error.to_string().contains("t ="), "{error}");
}

/// Errors whose remedy does not follow from what happened name it.
#[test]
fn messages_of_runs_say_what_to_do() {
    let missed = |until| RunErrorKind::AccuracyMissed {
        asked: 1e-10,
        estimate: 3e-9,
        until,
    };
    let nowhere = RunErrorKind::NodeEnds {
        first: Some(0.0),
        last: Some(2.0),
        start: 0.0,
        end: 3.0,
    };
    let endless = RunErrorKind::Span {
        start: 0.0,
        end: f64::INFINITY,
    };
    for (told, remedy) in [
        (missed(Some(2.0)).to_string(), "; allow a larger error"),
        (missed(None).to_string(), "; allow a larger error"),
        (nowhere.to_string(), "must be the first and the last node"),
        (endless.to_string(), "`steps` needs no end"),
        (StepError::NonFinite.to_string(), "a singular point"),
        (
            StepError::SingularTangent { unknown: 3 }.to_string(),
            "without kinetic energy",
        ),
        (
            StepError::Constraint(ConstraintError::NeedsNewton).to_string(),
            "`Solve::Auto`",
        ),
    ] {
        assert!(told.contains(remedy), "{told}");
    }
}

#[test]
fn bad_arguments_are_errors() {
    let model = Pendulum { k: 1.0 };
    let start = model.state([1.0], [0.0]);
    let kind = |simulation: Simulation<'_, Pendulum, 1>, start, span| {
        simulation
            .run(start, span)
            .err()
            .map(|error| error.kind().clone())
    };
    let simulation = || Simulation::new(&model).step(0.1);
    assert!(matches!(
        kind(simulation().element(Element::mixed(1)), start, 0.0..1.0),
        Some(RunErrorKind::Element(_))
    ));
    assert!(matches!(
        kind(simulation().element(Element::mixed(13)), start, 0.0..1.0),
        Some(RunErrorKind::Element(_))
    ));
    assert!(matches!(
        kind(
            simulation().element(Element::primal(4).quadrature(1)),
            start,
            0.0..1.0
        ),
        Some(RunErrorKind::Element(_))
    ));
    assert!(matches!(
        kind(simulation().step(0.0), start, 0.0..1.0),
        Some(RunErrorKind::Step { .. })
    ));
    assert!(matches!(
        kind(simulation(), start, 0.0..f64::NAN),
        Some(RunErrorKind::Span { .. })
    ));
    let never = simulation()
        .step(0.0)
        .run(start, 0.0..1.0)
        .expect_err("no step");
    assert_eq!(
        (never.partial().states().len(), never.partial().last().q),
        (1, start.q)
    );
    for wrong in [f64::NAN, f64::INFINITY, -1e-13, 1.0, 1e308] {
        let told = kind(simulation().tolerance(wrong), start, 0.0..1.0);
        let told = told.expect("no tolerance");
        assert!(matches!(told, RunErrorKind::Tolerance { .. }), "{told}");
        let told = told.to_string();
        assert!(told.contains("at least 0 and less than 1") && told.len() < 150);
    }
    assert_eq!(kind(simulation().tolerance(0.0), start, 0.0..1.0), None);
    let nowhere = State {
        q: [f64::NAN],
        p: [0.0],
    };
    assert!(matches!(
        kind(simulation(), nowhere, 0.0..1.0),
        Some(RunErrorKind::Start { coordinate: 0, .. })
    ));
    assert!(matches!(
        kind(simulation().impulse(2.0, [1.0]), start, 0.0..1.0),
        Some(RunErrorKind::Impulse { .. })
    ));
    // Also if the run has no end.
    for (time, value) in [(f64::NAN, 1.0), (0.5, f64::INFINITY)] {
        let mut steps = simulation().impulse(time, [value]).steps(start, 0.0);
        let told = steps.next().expect("an error").expect_err("no impulse");
        assert!(matches!(told, RunErrorKind::Impulse { .. }), "{told}");
    }
}

#[test]
fn too_few_iterations_are_an_error_with_the_residual() {
    let model = DoublePendulum::UNIT;
    let start = model.state([2.0, 1.0], [1.0, 0.0]);
    let error = Simulation::new(&model)
        .element(Mixed::<4>)
        .step(0.1)
        .max_iterations(1)
        .run(start, 0.0..1.0)
        .expect_err("one iteration is not enough");
    let RunErrorKind::Solve {
        element: 0, source, ..
    } = error.kind()
    else {
        panic!("{error}")
    };
    assert!(
        matches!(source, StepError::NewtonStalled { .. }),
        "{source:?}"
    );
}

#[test]
fn a_singular_tangent_is_an_error() {
    // ∂²L/∂v² vanishes at v = 0.
    #[dynamics(coordinates(x), lagrangian = dot(x)^4/4 - x^2/2)]
    struct Degenerate {}
    let model = Degenerate {};
    let result = Simulation::new(&model)
        .step(0.1)
        .run(model.state([0.0], [0.0]), 0.0..1.0);
    // At rest in the equilibrium, the motion stays there or the tangent is found to be singular; it must never be a
    // NaN.
    match result {
        Ok(motion) => assert!(motion.states().iter().all(|node| node.q[0].is_finite())),
        Err(error) => assert!(
            matches!(error.kind(), RunErrorKind::Solve { .. }),
            "{error}"
        ),
    }
}
