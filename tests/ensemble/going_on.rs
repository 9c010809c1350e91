//! Ensembles that continue from where they ended.

use super::{DoublePendulum, Driven, HalfLine, Pendulum, Quartic, Rod, distance, fractions};
use tfe::RunErrorKind;
use tfe::ensemble::{EnsembleError, Members};
use tfe::prelude::*;

/// One run compared with two parts, interrupted anywhere on the grid: all bits and all failures are the same.
fn halves<'m, M, K, const N: usize>(
    ensemble: &Ensemble<'m, M, N, K>,
    starts: &[State<N>],
    (steps, h): (u32, f64),
    seed: &mut u64,
) where
    M: Model<N> + Sync,
    K: Members<'m, M, N>,
{
    const CUTS: u32 = 20;
    let ensemble = ensemble.clone().step(h);
    let end = f64::from(steps) * h;
    let whole = ensemble.run(starts, 0.0..end).expect("runs");
    for _ in 0..CUTS {
        *seed = seed
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        let cut = f64::from(1 + (*seed >> 33) as u32 % (steps - 1)) * h;
        let mut run = ensemble.begin(starts, 0.0).expect("starts");
        let first = run.run_to(cut).expect("runs");
        let expected = ensemble.run(starts, 0.0..cut).expect("runs");
        assert_eq!(expected.into_results(), first.into_results());
        let checkpoint = run.clone();
        for mut run in [run, checkpoint] {
            assert_eq!(run.time(), cut);
            let second = run.run_to(end).expect("runs");
            assert!(
                whole.iter().eq(second.iter()),
                "cut at {cut}: {whole:?}, {second:?}"
            );
        }
    }
}

#[test]
fn two_halves_are_one_run_to_the_bit() {
    let mut seed = 4;
    let pendulum = Pendulum {
        m: 1.0,
        l: 1.0,
        g: 9.81,
    };
    let swings: Vec<_> = fractions(11)
        .map(|f| pendulum.state([3.0 * f], [0.2]))
        .collect();
    for element in [Element::mixed(4), Element::primal(3), Element::radau(3)] {
        let ensemble = Ensemble::new(&pendulum).element(element);
        halves(&ensemble, &swings, (30, 0.1), &mut seed);
    }
    // Some lanes leave the common iteration, some fail, some steps are cut.
    let quartic: Vec<_> = fractions(9)
        .map(|f| Quartic.state([60.0 * f], [0.0]))
        .collect();
    halves(&Ensemble::new(&Quartic), &quartic, (20, 0.1), &mut seed);
    let ends: Vec<_> = fractions(10)
        .map(|f| HalfLine.state([0.1 + f], [-f]))
        .collect();
    halves(&Ensemble::new(&HalfLine), &ends, (20, 0.1), &mut seed);
    let double = DoublePendulum { g: 9.81 };
    let wild: Vec<_> = fractions(9)
        .map(|f| double.state([3.0 * f, 2.0], [0.0; 2]))
        .collect();
    halves(&Ensemble::new(&double), &wild, (20, 0.15), &mut seed);
    // One run after the other.
    let rod = Rod { g: 9.81 };
    let falls: Vec<_> = fractions(3)
        .map(|f| rod.state([1.0, 0.0], [0.0, f]))
        .collect();
    halves(&Ensemble::new(&rod), &falls, (20, 0.05), &mut seed);
    let models: Vec<_> = fractions(5).map(|f| Driven { c: f }).collect();
    let start = [models[0].state([1.0], [0.0])];
    halves(&Ensemble::of_models(&models), &start, (20, 0.1), &mut seed);
}

/// An initial state that violates the constraints is refused by the first element, also after an empty span.
#[test]
fn starts_beside_constraints_are_refused_after_an_empty_span() {
    let rod = Rod { g: 9.81 };
    let starts = [1.1, 1.0].map(|x| rod.state([x, 0.0], [0.0, 0.3]));
    let is_refused = |kind: &RunErrorKind| matches!(kind, RunErrorKind::Inconsistent { .. });
    let ensemble = Ensemble::new(&rod).step(0.05);
    let mut run = ensemble.begin(&starts, 0.0).expect("starts");
    assert_eq!(run.run_to(0.0).expect("nothing to do").nodes().count(), 2);
    let ends = run.run_to(0.5).expect("runs");
    let whole = ensemble.run(&starts, 0.0..0.5).expect("runs");
    assert!(whole.iter().eq(ends.iter()), "{whole:?}, {ends:?}");
    assert!(ends[0].as_ref().is_err_and(is_refused), "{ends:?}");
    let simulation = Simulation::new(&rod).step(0.05);
    let still = simulation.run(starts[0], 0.0..0.0).expect("nothing to do");
    let checkpoint = still.checkpoint().expect("a whole run");
    let error = simulation.resume(checkpoint, 0.5).expect_err("no start");
    assert!(is_refused(error.kind()), "{error}");
}

/// If the time is off the grid, a new grid begins; an invalid end changes nothing.
#[test]
fn ensembles_stop_where_they_are_told() {
    let starts: Vec<_> = fractions(5)
        .map(|f| Quartic.state([1.0 + f], [0.0]))
        .collect();
    let ensemble = Ensemble::new(&Quartic).step(0.01);
    let whole = ensemble.run(&starts, 0.0..2.0).expect("runs");
    let mut run = ensemble.begin(&starts, 0.0).expect("starts");
    let error = run.run_to(f64::NAN).expect_err("no time");
    assert!(
        matches!(error, EnsembleError::Run(RunErrorKind::Span { .. })),
        "{error}"
    );
    for end in [0.503, 1.2345, 2.0] {
        let ends = run.run_to(end).expect("runs");
        assert!(ends.nodes().count() == 5 && ends.nodes().all(|node| node.t == end));
    }
    let end = run.run_to(2.0).expect("nothing to do");
    for (a, b) in end.nodes().zip(whole.nodes()) {
        assert!(distance(a, b) < 1e-12);
    }
    // Without a given step size, the first span that is not empty determines it; an invalid initial state is one
    // failure.
    let bad = [
        starts[0],
        State {
            q: [f64::NAN],
            p: [0.0],
        },
        starts[1],
    ];
    let mut default = Ensemble::new(&Quartic).begin(&bad, 0.0).expect("starts");
    let ends = default.run_to(0.0).expect("nothing to do");
    assert_eq!((ends.nodes().count(), ends.failures().count()), (2, 1));
    let ends = default.run_to(2.0).expect("runs");
    let [first, second] = [0, 2].map(|k| ends[k].clone().expect("arrives"));
    assert!(distance(&first, &whole[0].clone().expect("arrives")) < 1e-12);
    assert!(distance(&second, &whole[1].clone().expect("arrives")) < 1e-12);
    let back = run.run_to(0.0).expect("runs back");
    for (a, start) in back.nodes().zip(&starts) {
        assert!((a.q[0] - start.q[0]).abs() < 1e-12);
    }
}
