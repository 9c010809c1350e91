//! Stiff models of run-time length by Newton's method with a sparse factorisation.

use crate::lengths::of_both_lengths;
use tfe::family::FamilyState;
use tfe::prelude::*;

/// A rod of masses: stiff springs, a soft anharmonic foundation, damping at sites and between neighbours, and a driven
/// end.
#[dynamics(
    coordinates(q[n]),
    lagrangian = sum(i in 0..n, m[i]/2*dot(q[i])^2 - b/4*q[i]^4) - sum(i in 0..n-1, k/2*(q[i+1]-q[i])^2 + k/4*(q[i+1]-q[i])^4),
    dissipation = sum(i in 0..n, c/2*dot(q[i])^2) + sum(i in 0..n-1, c*(dot(q[i+1]) - dot(q[i]))^2),
    force(q[n-1]) = sin(t),
)]
struct Rod {
    n: usize,
    m: Vec<f64>,
    b: f64,
    c: f64,
    k: f64,
}

#[dynamics(
    coordinates(q[4]),
    lagrangian = sum(i in 0..4, m[i]/2*dot(q[i])^2 - b/4*q[i]^4) - sum(i in 0..3, k/2*(q[i+1]-q[i])^2 + k/4*(q[i+1]-q[i])^4),
    dissipation = sum(i in 0..4, c/2*dot(q[i])^2) + sum(i in 0..3, c*(dot(q[i+1]) - dot(q[i]))^2),
    force(q[3]) = sin(t),
)]
struct RodOfFour {
    m: [f64; 4],
    b: f64,
    c: f64,
    k: f64,
}

/// The same as a Hamiltonian.
#[dynamics(
    coordinates(q[n]), momenta(p[n]),
    hamiltonian = sum(i in 0..n, p[i]^2/2/m[i] + b/4*q[i]^4) + sum(i in 0..n-1, k/2*(q[i+1]-q[i])^2 + k/4*(q[i+1]-q[i])^4),
    force(q[i]) = -c*p[i]/m[i],
)]
struct RodByMomenta {
    n: usize,
    m: Vec<f64>,
    b: f64,
    c: f64,
    k: f64,
}

const MASSES: [f64; 4] = [1.0, 0.5, 2.0, 1.5];

#[test]
fn stiff_rods_move_as_those_of_fixed_size() {
    for (k, solve, step) in [
        (1e6, Solve::Auto, 0.05),
        (1.0, Solve::Newton, 0.1),
        (1e6, Solve::Newton, 0.05),
    ] {
        let (b, c) = (0.3, 0.2);
        let m = MASSES;
        let (long, four) = of_both_lengths!(Rod(4), RodOfFour: m, b, c, k);
        let (q, v) = ([0.5, 0.5, 0.5, 0.501], [0.1; 4]);
        for element in [
            Element::mixed(3),
            Element::mixed(4),
            Element::mixed(6),
            Element::radau(3),
        ] {
            let start = long.state(q, v);
            let run = Simulation::new(&long)
                .element(element)
                .step(step)
                .solver(solve);
            let one = run
                .run(start, 0.0..3.0)
                .unwrap_or_else(|error| panic!("{element} {k:e}: {error}"));
            let run = Simulation::new(&four)
                .element(element)
                .step(step)
                .solver(solve);
            let other = run.run(four.state(q, v), 0.0..3.0).expect("a run");
            for a in 0..4 {
                let (q, p) = (
                    one.last().q[a] - other.last().q[a],
                    one.last().p[a] - other.last().p[a],
                );
                // The rounding errors of forces of the size k times an elongation, over 60 steps.
                assert!(
                    q.abs() < 1e-10 && p.abs() < 1e-7,
                    "{element} {k:e} {solve:?}: {q:e} {p:e}"
                );
            }
            assert!(one.statistics().newton_iterations > 0);
            // No step is so long that it has to be cut: the equations are nearly linear, so that both iterations find
            // the only solution nearby.
            assert_eq!((one.statistics().cuts, other.statistics().cuts), (0, 0));
        }
    }
}

/// One factorisation is used for many steps, and one ordering for all of them.
#[test]
fn factors_serve_many_steps() {
    let n = 1000;
    let rod = RodByMomenta {
        n,
        m: vec![1.0; n],
        b: 0.1,
        c: 0.5,
        k: 1e6,
    };
    let q: Vec<f64> = (0..n).map(|i| 1e-3 * (0.01 * i as f64).sin()).collect();
    let start = rod.state(q, vec![0.0; n]);
    let run = Simulation::new(&rod)
        .element(Mixed::<3>)
        .step(0.1)
        .record_every(10);
    let motion = run.run(start, 0.0..10.0).expect("a run");
    let statistics = motion.statistics();
    assert_eq!(statistics.steps, 100);
    assert!(statistics.factorizations < 50, "{statistics:?}");
    // With damping the energy decreases.
    assert!(
        motion.energies().windows(2).all(|pair| pair[1] < pair[0]),
        "{:?}",
        motion.energies()
    );
}

/// Newton's method and fixed-point iteration find the same states.
#[test]
fn both_iterations_end_at_the_same_state() {
    let rod = RodByMomenta {
        n: 50,
        m: vec![1.0; 50],
        b: 1.0,
        c: 0.1,
        k: 2.0,
    };
    let q: Vec<f64> = (0..50).map(|i| (0.3 * f64::from(i)).sin()).collect();
    let start = rod.state(q, vec![0.2; 50]);
    let end = |solve: Solve| -> FamilyState {
        let run = Simulation::new(&rod).step(0.1).solver(solve);
        run.run(start.clone(), 0.0..5.0)
            .expect("a run")
            .last()
            .state()
    };
    let (one, other) = (end(Solve::FixedPoint), end(Solve::Newton));
    for a in 0..50 {
        // A few rounding errors in each of fifty steps.
        assert!((one.q[a] - other.q[a]).abs() < 1e-13 && (one.p[a] - other.p[a]).abs() < 1e-13);
    }
}

/// A cantilever that falls from a horizontal position: the geometrically exact planar beam, with strains at the
/// midpoints of straight elements.
#[dynamics(
    coordinates(x[n], y[n], phi[n]),
    let l = 1/n,
    lagrangian = sum(i in 0..n, l/2*(dot(x[i])^2 + dot(y[i])^2) + r*l/2*dot(phi[i])^2 - l*g*y[i])
        - l/2*(ea*((cos(phi[0]/2)*x[0] + sin(phi[0]/2)*y[0])/l - 1)^2 + ga*((cos(phi[0]/2)*y[0] - sin(phi[0]/2)*x[0])/l)^2 + (phi[0]/l)^2)
        - sum(i in 0..n-1, l/2*(
              ea*((cos((phi[i] + phi[i+1])/2)*(x[i+1] - x[i]) + sin((phi[i] + phi[i+1])/2)*(y[i+1] - y[i]))/l - 1)^2
            + ga*((cos((phi[i] + phi[i+1])/2)*(y[i+1] - y[i]) - sin((phi[i] + phi[i+1])/2)*(x[i+1] - x[i]))/l)^2
            + ((phi[i+1] - phi[i])/l)^2)),
)]
struct Cantilever {
    n: usize,
    ea: f64,
    ga: f64,
    r: f64,
    g: f64,
}

/// Two thousand nodes move like two hundred: the same energy, the same tip, and as many factorisations per step.
#[test]
fn a_long_cantilever_moves_as_a_short_one() {
    let run = |n: usize| {
        let beam = Cantilever {
            n,
            ea: 1e6,
            ga: 4e5,
            r: 1e-6,
            g: 9.81,
        };
        let level = (1..=n).map(|i| i as f64 / n as f64);
        let q: Vec<f64> = level.chain(std::iter::repeat_n(0.0, 2 * n)).collect();
        let run = Simulation::new(&beam).element(Mixed::<3>).step(0.005);
        let motion = run.run(beam.state(q, vec![0.0; 3 * n]), 0.0..0.03);
        let motion = motion.expect("a run");
        assert!(motion.warnings().is_empty(), "{:?}", motion.warnings());
        let tip = motion.last().q[2 * n - 1];
        (
            motion.energy_error(),
            tip,
            motion.statistics().factorizations,
        )
    };
    let (few, many) = (run(200), run(2_000));
    println!("{few:?}, {many:?}");
    // Relative to m g l = 9.81.
    assert!(few.0 < 1e-5 && many.0 < 1e-5, "{few:?}, {many:?}");
    assert!(
        (few.1 - many.1).abs() < 1e-3 * few.1.abs(),
        "{few:?}, {many:?}"
    );
    assert!(many.2 <= few.2 + 6, "{few:?}, {many:?}");
}
