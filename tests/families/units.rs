//! Coordinates that are small beside another one move as they do alone.

use crate::common::larger;
use tfe::prelude::*;

#[dynamics(
    coordinates(theta[n]),
    lagrangian = sum(i in 0..n, dot(theta[i])^2/2 + cos(theta[i])),
)]
struct Alone {
    n: usize,
}

#[dynamics(
    coordinates(x, theta[n]),
    lagrangian = dot(x)^2/2 + sum(i in 0..n, dot(theta[i])^2/2 + cos(theta[i])),
)]
struct Beside {
    n: usize,
}

/// The velocity of what moves freely beside the pendulums.
const FAST: f64 = 1e9;

const ANGLES: [f64; 5] = [1.2, -0.4, 0.8, 0.1, -1.0];

/// What is shorter by one coordinate, behind another one.
fn behind(first: f64, rest: [f64; 5]) -> Vec<f64> {
    [&[first][..], &rest[..]].concat()
}

/// The largest difference from pendulums without the first coordinate.
fn apart(beside: &[f64], alone: &[f64]) -> f64 {
    assert_eq!(beside.len(), alone.len() + 1);
    let pairs = beside[1..].iter().zip(alone);
    pairs.map(|(a, b)| (a - b).abs()).fold(0.0, larger)
}

#[test]
fn small_coordinates_converge_by_forces() {
    let (alone, beside) = (Alone { n: 5 }, Beside { n: 5 });
    let mut ways = vec![Solve::Auto, Solve::FixedPoint];
    if cfg!(feature = "sparse") {
        ways.push(Solve::Newton);
    }
    for element in [Element::mixed(3), Element::mixed(6)] {
        for solve in &ways {
            let run = Simulation::new(&alone).element(element).step(0.25);
            let start = alone.state(ANGLES, [0.3; 5]);
            let one = run.solver(*solve).run(start, 0.0..10.0).expect("a run");
            let run = Simulation::new(&beside).element(element).step(0.25);
            let start = beside.state(behind(0.0, ANGLES), behind(FAST, [0.3; 5]));
            let other = run.solver(*solve).run(start, 0.0..10.0).expect("a run");
            let (one, other) = (one.last(), other.last());
            let off = larger(apart(&other.q, &one.q), apart(&other.p, &one.p));
            // Rounding errors of forty steps; alone it takes the same steps.
            assert!(off <= 1e-12, "{element}, {solve:?}: {off:.1e}");
        }
    }
}

/// With masses that vary, rates are the unknowns.
#[cfg(feature = "sparse")]
#[test]
fn small_coordinates_converge_by_rates() {
    #[dynamics(
        coordinates(theta[n]),
        lagrangian = sum(i in 0..n, (2 + cos(theta[i]))/2*dot(theta[i])^2 + cos(theta[i])),
    )]
    struct VariedAlone {
        n: usize,
    }
    #[dynamics(
        coordinates(x, theta[n]),
        lagrangian = dot(x)^2/2 + sum(i in 0..n, (2 + cos(theta[i]))/2*dot(theta[i])^2 + cos(theta[i])),
    )]
    struct VariedBeside {
        n: usize,
    }
    let (alone, beside) = (VariedAlone { n: 5 }, VariedBeside { n: 5 });
    let element = Element::mixed(3);
    let run = Simulation::new(&alone).element(element).step(0.25);
    let start = alone.state(ANGLES, [0.3; 5]);
    let one = run.run(start, 0.0..10.0).expect("a run");
    let run = Simulation::new(&beside).element(element).step(0.25);
    let start = beside.state(behind(0.0, ANGLES), behind(FAST, [0.3; 5]));
    let other = run.run(start, 0.0..10.0).expect("a run");
    let (one, other) = (one.last(), other.last());
    let off = larger(apart(&other.q, &one.q), apart(&other.p, &one.p));
    assert!(off <= 1e-12, "{off:.1e}");
}
