//! Runs of models of run-time length that continue from where others ended.

use crate::common::distance;
#[cfg(feature = "sparse")]
use crate::rods::Rods;
use tfe::error::RunErrorKind;
use tfe::family::{self, FamilyState};
use tfe::prelude::*;

#[dynamics(
    coordinates(q[n]),
    lagrangian = sum(i in 0..n, dot(q[i])^2/2) - sum(i in 0..n-1, k/2*(q[i+1]-q[i])^2 + k/4*(q[i+1]-q[i])^4),
    force(q[n-1]) = sin(t) - c*dot(q[n-1]),
)]
struct Chain {
    n: usize,
    k: f64,
    c: f64,
}

/// One run compared with two parts of it, interrupted at every node: all states, velocities and energies have the same
/// bits.
fn check<M: family::Model>(
    simulation: &family::Simulation<'_, M>,
    start: &FamilyState,
    (steps, h): (u32, f64),
) {
    let end = f64::from(steps) * h;
    let whole = simulation.run(start.clone(), 0.0..end).expect("a run");
    for cut in 1..steps {
        let first = simulation.run(start.clone(), 0.0..f64::from(cut) * h);
        let first = first.expect("a run");
        let checkpoint = first.checkpoint().expect("complete");
        let second = simulation.resume(checkpoint, end).expect("a run");
        let at = cut as usize;
        assert_eq!(first.states(), &whole.states()[..=at], "cut at {cut}");
        assert_eq!(second.states(), &whole.states()[at..], "cut at {cut}");
        assert_eq!(second.velocities(), &whole.velocities()[at..]);
        assert_eq!(second.energies(), &whole.energies()[at..]);
    }
}

fn wave(n: usize) -> FamilyState {
    FamilyState {
        q: (0..n).map(|i| (i as f64).sin()).collect(),
        p: (0..n).map(|i| (2.0 * i as f64).cos()).collect(),
    }
}

#[test]
fn two_halves_are_one_run_to_the_bit() {
    let chain = Chain {
        n: 7,
        k: 1.0,
        c: 0.1,
    };
    for element in [
        Element::mixed(4),
        Element::mixed(6),
        Element::primal(3).reduced(),
        Element::radau(4),
    ] {
        let h = 0.1;
        let simulation = Simulation::new(&chain).element(element).step(h);
        check(&simulation, &wave(7), (20, h));
    }
}

/// Newton's method keeps factors from step to step; the checkpoint has them, too.
#[cfg(feature = "sparse")]
#[test]
fn halves_of_stiff_runs() {
    let stiff = Chain {
        n: 7,
        k: 1e5,
        c: 10.0,
    };
    for element in [Element::mixed(4), Element::radau(3)] {
        let h = 0.05;
        let simulation = Simulation::new(&stiff).element(element).step(h);
        let start = FamilyState {
            q: (0..7).map(f64::from).collect(),
            p: vec![0.0; 7],
        };
        check(&simulation, &start, (6, h));
    }
}

#[cfg(feature = "sparse")]
#[test]
fn halves_of_constrained_runs() {
    let rods = Rods::of_unit_length(4);
    let start = FamilyState {
        q: vec![1.0, 2.0, 3.0, 4.0, 0.0, 0.0, 0.0, 0.0],
        p: vec![0.0; 8],
    };
    for nodes in [2, 4, 5] {
        let h = 0.02;
        let element = Element::mixed(nodes);
        let simulation = Simulation::new(&rods).element(element).step(h);
        check(&simulation, &start, (20, h));
    }
}

/// A model with other lists has other masses; nothing that depends on the former ones is carried over.
#[test]
fn other_lists_go_on_from_a_checkpoint() {
    #[dynamics(
        coordinates(q[n]),
        lagrangian = sum(i in 0..n, m[kind[i]]/2*dot(q[i])^2 - q[i]^2/2 - q[i]^4/4),
    )]
    struct Kinds {
        n: usize,
        m: Vec<f64>,
        kind: Vec<usize>,
    }
    let kinds = |kind: [usize; 3]| Kinds {
        n: 3,
        m: vec![1.0, 5.0],
        kind: kind.to_vec(),
    };
    let (light, heavy) = (kinds([0, 0, 1]), kinds([1, 0, 0]));
    let first = Simulation::new(&light).step(0.1);
    let first = first.run(wave(3), 0.0..2.0).expect("a run");
    let checkpoint = first.checkpoint().expect("complete");
    let second = Simulation::new(&heavy).step(0.1);
    let resumed = second.resume(checkpoint, 4.0).expect("a run");
    let anew = second.run(checkpoint.state().clone(), 2.0..4.0);
    let (one, other) = (resumed.last().state(), anew.expect("a run").last().state());
    // The rounding errors of twenty steps, whose times have rounding errors, too.
    assert!(distance(&one.q, &other.q) < 1e-13, "{one:?} {other:?}");
    assert!(distance(&one.p, &other.p) < 1e-13, "{one:?} {other:?}");
}

/// A checkpoint off the grid starts a new one; another element is possible, and another length is an error.
#[test]
fn checkpoints_of_other_runs() {
    let chain = |n| Chain { n, k: 1.0, c: 0.1 };
    let (seven, six) = (chain(7), chain(6));
    let run = Simulation::new(&seven).step(0.1);
    let whole = run.run(wave(7), 0.0..4.0).expect("a run");
    let first = run.run(wave(7), 0.0..1.23).expect("a run");
    let checkpoint = first.checkpoint().expect("complete");
    assert_eq!(
        (checkpoint.time(), checkpoint.state()),
        (1.23, &first.last().state())
    );
    let other = run.clone().element(Element::mixed(7));
    for run in [&run, &other] {
        let second = run.resume(checkpoint, 4.0).expect("a run");
        assert_eq!(second.states()[0].t, 1.23);
        for (q, expected) in second.last().q.iter().zip(&whole.last().q) {
            // Both have errors of the sixth power of the step.
            assert!((q - expected).abs() < 1e-6, "{q}, {expected}");
        }
    }
    let refused = Simulation::new(&six).resume(checkpoint, 4.0);
    let error = refused.expect_err("another length");
    let expected = family::ModelError::StateLength {
        vector: "q",
        length: 7,
        expected: 6,
    };
    assert!(
        matches!(error.kind(), RunErrorKind::Family(kind) if *kind == expected),
        "{error}"
    );
}
