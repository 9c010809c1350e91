//! The calls of the library for models of run-time length: those that work give the same as for a model of fixed size,
//! and the others are a typed error.

use crate::chain::{CHAIN, Chain, THREE};
use crate::common::{distance, larger};
use tfe::Warning;
use tfe::family;
use tfe::prelude::*;

fn start() -> family::FamilyState {
    CHAIN.state([1.0, -0.5, 0.25], [0.0, 0.5, 0.0])
}

fn start_of_three() -> State<3> {
    THREE.state([1.0, -0.5, 0.25], [0.0, 0.5, 0.0])
}

#[test]
fn integrals_of_outputs() {
    let motion = Simulation::new(&CHAIN).step(0.1).run(start(), 0.0..5.0);
    let motion = motion.expect("a run");
    let fixed = Simulation::new(&THREE)
        .step(0.1)
        .run(start_of_three(), 0.0..5.0);
    let fixed = fixed.expect("a run");
    for name in ["first", "power"] {
        let here = motion.integral(&CHAIN, name).expect("an integral");
        let there = fixed.integral(&THREE, name).expect("an integral");
        assert!(distance(&here, &there) < 1e-13, "{name}");
    }
    // ∫ q q̇ dt = q²/2.
    let power = motion.integral(&CHAIN, "power").expect("an integral");
    let q = motion.last().q[0];
    assert!((power[50] - (q * q - 1.0) / 2.0).abs() < 1e-7); // order 6 at this step
    let error = motion
        .integral(&CHAIN, "second")
        .expect_err("no such output");
    assert!(matches!(error, tfe::error::AtError::NoOutput { .. }));
}

#[test]
fn steps_tell_costs_and_doubts() {
    let simulation = Simulation::new(&CHAIN).step(0.1);
    let mut steps = simulation.steps(start(), 0.0);
    let node = steps
        .by_ref()
        .take(50)
        .last()
        .expect("steps")
        .expect("good ones");
    let motion = simulation.run(start(), 0.0..5.0).expect("a run");
    assert_eq!(node, *motion.last());
    assert_eq!(steps.statistics(), *motion.statistics());
    assert_eq!(steps.warnings(), []);
}

/// A driven, damped model without a conserved energy: two steps of 1 to 3 from 100 states. An end with an error of a
/// fifth of the path must have a warning, as for models of fixed size.
#[test]
fn steps_that_do_not_resolve_a_driven_motion_are_told() {
    #[dynamics(
        coordinates(x[n]),
        lagrangian = sum(i in 0..n, dot(x[i])^2/2 + x[i]^2/2 - x[i]^4/4),
        force(x[i]) = 0.3*cos(1.2*t) - 0.2*dot(x[i]),
    )]
    struct Duffing {
        n: usize,
    }
    let model = Duffing { n: 1 };
    let (mut wrong, mut told) = (0, 0);
    for k in 0..100 {
        let part = |factor: u32| f64::from(k * factor % 100) / 100.0;
        let start = model.state([3.0 * part(7) - 1.5], [3.0 * part(31) - 1.5]);
        let h = 1.0 + 2.0 * part(1);
        let fine = Simulation::new(&model).element(Mixed::<8>).step(0.01);
        let fine = fine.run(start.clone(), 0.0..2.0 * h).expect("a fine run");
        assert!(fine.warnings().is_empty(), "{:?}", fine.warnings());
        let ways = fine.states().windows(2);
        let way: f64 = ways.map(|pair| (pair[1].q[0] - pair[0].q[0]).abs()).sum();
        for element in [Element::mixed(3), Element::radau(3)] {
            let long = Simulation::new(&model).element(element).step(h);
            let Ok(motion) = long.run(start.clone(), 0.0..2.0 * h) else {
                continue;
            };
            let is_told =
                (motion.warnings().iter()).any(|one| matches!(one, Warning::Unresolved { .. }));
            told += u32::from(is_told);
            let off = (motion.last().q[0] - fine.last().q[0]).abs();
            if !(off <= way / 5.0) {
                wrong += 1;
                assert!(is_told, "{element}, h = {h}: off by {off:.2} of {way:.2}");
            }
        }
    }
    assert!(told > wrong && wrong > 1, "{wrong} wrong, {told} told");
}

#[test]
fn ensembles() {
    let starts: Vec<_> = (0..20)
        .map(|k| CHAIN.state([0.1 * f64::from(k), 0.0, 0.5], [0.0; 3]))
        .collect();
    let ensemble = Ensemble::new(&CHAIN).element(Mixed::<5>).step(0.1);
    let ends = ensemble.run(&starts, 0.0..10.0).expect("an ensemble");
    assert_eq!(
        (ends.nodes().count(), ends.warnings().is_empty()),
        (20, true)
    );
    let one = Simulation::new(&CHAIN).element(Mixed::<5>).step(0.1);
    let one = one.run(starts[7].clone(), 0.0..10.0).expect("a run");
    assert_eq!(ends[7].as_ref(), Ok(one.last()));

    // Parameter sets; an invalid initial state fails on its own.
    let chains: Vec<_> = (0..4)
        .map(|k| Chain {
            n: 3,
            a: f64::from(k),
        })
        .collect();
    let ends = Ensemble::of_models(&chains)
        .step(0.1)
        .run(&starts[..4], 0.0..2.0);
    assert_eq!(ends.expect("an ensemble").nodes().count(), 4);
    let mut bad = starts[..4].to_vec();
    bad[2].q.pop();
    let ends = Ensemble::of_models(&chains).step(0.1).run(&bad, 0.0..2.0);
    let ends = ends.expect("an ensemble");
    let failures: Vec<_> = ends.failures().map(|failure| failure.index).collect();
    assert_eq!(failures, [2]);
    // As continued runs, with the same bits; the same initial states, and an invalid one.
    let many = Ensemble::of_models(&chains).step(0.1);
    let mut parts = many.begin(&bad, 0.0).expect("starts");
    for steps in [0.0, 7.0, 20.0, 23.5] {
        let end = steps * 0.1; // on the grid, but for the last one
        let mut checkpoint = parts.clone();
        let reached = parts.run_to(end).expect("runs");
        let again = checkpoint.run_to(end).expect("runs");
        assert_eq!((parts.time(), &reached), (end, &again));
        assert_eq!(reached.failures().count(), 1, "{end}");
        let expected = many.run(&bad, 0.0..end).expect("runs");
        assert_eq!(reached.into_results(), expected.into_results(), "{end}");
    }
}

/// Without neighbours, q̈ = −q.
#[test]
fn a_chain_of_one_site_is_an_oscillator() {
    let single = Chain { n: 1, ..CHAIN };
    let (q, v, end) = (0.7, 0.2, 3.0_f64);
    let (sin, cos) = end.sin_cos();
    let start = single.state([q], [v]);
    let run = Simulation::new(&single).element(Mixed::<6>).step(0.1);
    let motion = run.run(start.clone(), 0.0..end).expect("a run");
    let last = motion.last();
    let off = larger(
        (last.q[0] - (q * cos + v * sin)).abs(),
        (last.v[0] - (v * cos - q * sin)).abs(),
    );
    // Six nodes leave rounding errors of thirty steps.
    assert!(off <= 1e-12, "{off:e}");
    assert_eq!(motion.outputs().names().len(), 4);
    let ensemble = Ensemble::new(&single).element(Mixed::<6>).step(0.1);
    let ends = ensemble.run(std::slice::from_ref(&start), 0.0..end);
    let ends = ends.expect("an ensemble");
    assert_eq!(ends.nodes().count(), 1);
    let off = ends.nodes().map(|node| (node.q[0] - last.q[0]).abs());
    assert!(off.fold(0.0, larger) <= 1e-13);
    #[cfg(feature = "sparse")]
    {
        let linearised = run.run_linearised(start.clone(), 0.0..end);
        let matrix = linearised.expect("a run").product();
        // By columns, of (p, q).
        let off = distance(matrix.as_slice(), &[cos, sin, -sin, cos]);
        assert!(off <= 1e-12, "{off:e}");
        let loss = family::Loss::output_at_end("first");
        let (_, gradient) = run.gradient(start, 0.0..end, &loss).expect("a gradient");
        let by_start = gradient.by_start();
        let off = distance(&[by_start.p[0], by_start.q[0]], &[sin, cos]);
        assert!(off <= 1e-12 && gradient.by("a") == 0.0, "{off:e}");
        let rest = single.state([0.0], [0.0]);
        let orbit = PeriodicOrbit::of(&single)
            .elements(10)
            .period(1.0)
            .guess_from(rest);
        assert!(orbit.solve().expect("a rest").is_stable());
    }
}

/// All calls say so before anything is computed.
#[test]
fn a_chain_without_sites_is_an_error() {
    let none = Chain { n: 0, ..CHAIN };
    let expected = family::ModelError::NoElements { array: "q[n]" };
    let kind = tfe::RunErrorKind::Family(expected);
    let empty: [f64; 0] = [];
    let start = none.state(empty, empty);
    let (run, span) = (Simulation::new(&none).step(0.1), || 0.0..1.0);
    let error = run.run(start.clone(), span()).expect_err("refused");
    assert_eq!(error.kind(), &kind);
    let mut steps = run.steps(start.clone(), 0.0);
    assert_eq!(steps.next(), Some(Err(kind.clone())));
    let mut section = run.section("first", Crossing::Rising, start.clone(), 0.0);
    assert_eq!(section.next(), Some(Err(kind.clone())));
    assert_eq!(none.speed(0.0, &[], &[]), Err(expected));
    assert_eq!(none.wall(0.0, &[], &[]), Err(expected));
    let ensemble = Ensemble::new(&none).step(0.1);
    let ends = ensemble.run(std::slice::from_ref(&start), span());
    let results = ends.expect("an ensemble").into_results();
    let first = results.first();
    assert_eq!((results.len(), first), (1, Some(&Err(kind.clone()))));
    #[cfg(feature = "sparse")]
    {
        let linearised = run.run_linearised(start.clone(), span()).map(|_| ());
        let sensitive = run.run_sensitive(start.clone(), span()).map(|_| ());
        let loss = family::Loss::output_at_end("first");
        let gradient = run.gradient(start.clone(), span(), &loss).map(|_| ());
        for outcome in [linearised, sensitive, gradient] {
            assert_eq!(outcome.expect_err("refused").kind(), &kind);
        }
        let matrix = tfe::stability::transition_matrix(&none, Mixed::<4>, &start, 0.0, 0.1);
        let message = matrix.expect_err("refused").to_string();
        assert_eq!(message, expected.to_string());
        let orbit = PeriodicOrbit::of(&none)
            .elements(10)
            .period(1.0)
            .guess_from(start);
        let error = orbit.solve().map(|_| ()).expect_err("refused");
        assert_eq!(error.to_string(), expected.to_string());
    }
}

#[cfg(feature = "sparse")]
#[test]
fn transition_matrices() {
    let run = Simulation::new(&CHAIN).element(Mixed::<5>).step(0.1);
    let run = run.run_linearised(start(), 0.0..5.0).expect("a run");
    let fixed = Simulation::new(&THREE).element(Mixed::<5>).step(0.1);
    let fixed = fixed
        .run_linearised(start_of_three(), 0.0..5.0)
        .expect("a run");
    assert_eq!(run.transitions().len(), 50);
    for (a, b) in run.transitions().iter().zip(fixed.transitions()) {
        assert!(distance(a.as_slice(), b.as_slice()) < 1e-13);
    }
    let (product, beside) = (run.product(), fixed.product());
    assert!(distance(product.as_slice(), beside.as_slice()) < 1e-12);
    let multipliers = run.multipliers().expect("multipliers");
    let beside = fixed.multipliers().expect("multipliers");
    for (a, b) in multipliers.iter().zip(&beside) {
        assert!((a.log_modulus - b.log_modulus).abs() < 1e-6); // of moduli near one, where they are multiple
    }
}

#[cfg(not(feature = "sparse"))]
#[test]
fn transition_matrices_need_a_feature() {
    let run = Simulation::new(&CHAIN).step(0.1);
    let error = run.run_linearised(start(), 0.0..5.0).expect_err("refused");
    let of = "models of run-time length without the feature `sparse`";
    let call = "run_linearised";
    assert_eq!(error.kind(), &tfe::RunErrorKind::Unsupported { call, of });
}

/// Two pendulums on rods, one hanging from the other; the upper one hangs from a moving hand.
#[cfg(feature = "sparse")]
mod rods {
    use super::*;

    #[dynamics(
        coordinates(x[n], y[n]),
        lagrangian = sum(i in 0..n, m*(dot(x[i])^2 + dot(y[i])^2)/2 - m*g*y[i]),
        constraint(top) = (x[0] - sin(t)/5)^2 + y[0]^2 - 1,
        constraint(rod[i in 0..n-1]) = (x[i+1] - x[i])^2 + (y[i+1] - y[i])^2 - 1,
        dissipation = sum(i in 0..n, c/2*(dot(x[i])^2 + dot(y[i])^2)),
    )]
    pub struct Rods {
        pub n: usize,
        pub m: f64,
        pub g: f64,
        pub c: f64,
    }

    #[dynamics(
        coordinates(x[2], y[2]),
        lagrangian = sum(i in 0..2, m*(dot(x[i])^2 + dot(y[i])^2)/2 - m*g*y[i]),
        constraint(top) = (x[0] - sin(t)/5)^2 + y[0]^2 - 1,
        constraint(rod) = (x[1] - x[0])^2 + (y[1] - y[0])^2 - 1,
        dissipation = sum(i in 0..2, c/2*(dot(x[i])^2 + dot(y[i])^2)),
    )]
    struct TwoRods {
        m: f64,
        g: f64,
        c: f64,
    }

    #[test]
    fn reactions_are_those_of_fixed_size() {
        let (m, g, c) = (0.7, 9.81, 0.3);
        let (rods, two) = (Rods { n: 2, m, g, c }, TwoRods { m, g, c });
        // The upper rod moves with the hand, whose initial velocity is 1/5.
        let (q, v) = ([0.0, 1.0, -1.0, -1.0], [0.2, 0.2, 0.0, 0.5]);
        let run = Simulation::new(&rods).element(Mixed::<5>).step(0.01);
        let run = run.run(rods.state(q, v), 0.0..2.0).expect("a run");
        let beside = Simulation::new(&two).element(Mixed::<5>).step(0.01);
        let beside = beside.run(two.state(q, v), 0.0..2.0).expect("a run");
        let names: Vec<String> = run
            .reactions()
            .names()
            .iter()
            .map(ToString::to_string)
            .collect();
        assert_eq!(names, ["top", "rod[0]"]);
        for (name, other) in [("top", "top"), ("rod[0]", "rod")] {
            let here = run.reactions().column(name).expect("a constraint");
            let there = beside.reactions().column(other).expect("a constraint");
            assert_eq!(here.len(), 201);
            assert!(distance(&here, &there) < 1e-9 * 20.0, "{name}");
        }
        // At rest in a line, the rods carry what hangs below; the force of (x² + y² − 1) λ is 2 λ.
        let (hanging, none) = ([0.0, 0.0, -1.0, -2.0], [0.2, 0.2, 0.0, 0.0]);
        let still = Rods { c: 0.0, ..rods };
        let run = Simulation::new(&still).step(0.01);
        let run = run
            .run(still.state(hanging, none), 0.0..0.01)
            .expect("a run");
        let rod = run.reactions().column("rod[0]").expect("a constraint");
        assert!((rod[0] + m * g / 2.0).abs() < 1e-12, "{}", rod[0]);
        let file = std::env::temp_dir().join(format!("tfe_rods_{}.csv", std::process::id()));
        run.write_csv(&file).expect("a file");
        let text = std::fs::read_to_string(&file).expect("a file");
        std::fs::remove_file(&file).expect("a file");
        let header = text.lines().next().expect("a header");
        assert!(
            header.ends_with("energy,lambda_top,lambda_rod[0]"),
            "{header}"
        );
    }
}
