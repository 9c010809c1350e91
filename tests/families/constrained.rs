//! Motions of models of run-time length with constraints.

use crate::common::larger;
use crate::lengths::of_both_lengths;
use tfe::error::RunErrorKind;
use tfe::prelude::*;
use tfe::runtime::ConstraintError;
use tfe::{StepError, family};

/// A chain of rods whose first one hangs from a moving support, with damping, and springs between second neighbours.
#[dynamics(
    coordinates(x[n], y[n]),
    lagrangian = sum(i in 0..n, m[i]/2*(dot(x[i])^2 + dot(y[i])^2) - m[i]*g*y[i])
        - sum(i in 0..n-2, k/2*((x[i+2] - x[i])^2 + (y[i+2] - y[i])^2)),
    constraint(first) = (x[0] - a*sin(t))^2 + y[0]^2 - 1,
    constraint(rod[i in 0..n-1]) = (x[i+1] - x[i])^2 + (y[i+1] - y[i])^2 - l[i]^2,
    force(x[i]) = -c*dot(x[i]),
)]
struct Rods {
    n: usize,
    m: Vec<f64>,
    l: Vec<f64>,
    g: f64,
    k: f64,
    c: f64,
    a: f64,
}

#[dynamics(
    coordinates(x[4], y[4]),
    lagrangian = sum(i in 0..4, m[i]/2*(dot(x[i])^2 + dot(y[i])^2) - m[i]*g*y[i])
        - sum(i in 0..2, k/2*((x[i+2] - x[i])^2 + (y[i+2] - y[i])^2)),
    constraint(first) = (x[0] - a*sin(t))^2 + y[0]^2 - 1,
    constraint(rod[i in 0..3]) = (x[i+1] - x[i])^2 + (y[i+1] - y[i])^2 - l[i]^2,
    force(x[0]) = -c*dot(x[0]),
    force(x[1]) = -c*dot(x[1]),
    force(x[2]) = -c*dot(x[2]),
    force(x[3]) = -c*dot(x[3]),
)]
struct FourRods {
    m: [f64; 4],
    l: [f64; 3],
    g: f64,
    k: f64,
    c: f64,
    a: f64,
}

const MASSES: [f64; 4] = [1.0, 0.5, 2.0, 1.5];
const LENGTHS: [f64; 3] = [0.8, 1.0, 0.6];
const A: f64 = 0.2;

fn both() -> (Rods, FourRods) {
    let (m, l, g, k, c, a) = (MASSES, LENGTHS, 9.81, 0.7, 0.1, A);
    of_both_lengths!(Rods(4), FourRods: m, l, g, k, c, a)
}

fn rods() -> Rods {
    both().0
}

/// A bent chain; the support moves with `a` to the right, and the chain with it.
fn start() -> ([f64; 8], [f64; 8]) {
    let (mut q, mut v) = ([0.0; 8], [0.0; 8]);
    let (mut x, mut y) = (0.0, 0.0);
    for i in 0..4 {
        let length = if i == 0 { 1.0 } else { LENGTHS[i - 1] };
        let angle = 0.4 + 0.3 * i as f64;
        x += length * f64::sin(angle);
        y -= length * f64::cos(angle);
        (q[i], q[4 + i], v[i]) = (x, y, A);
    }
    (q, v)
}

#[test]
fn rods_move_as_those_of_fixed_size() {
    let ((long, four), (q, v)) = (both(), start());
    for element in [
        Element::mixed(2),
        Element::mixed(3),
        Element::mixed(5),
        Element::primal(4).reduced(),
    ] {
        let run = Simulation::new(&long).element(element).step(0.02);
        let one = run
            .run(long.state(q, v), 0.0..1.0)
            .unwrap_or_else(|error| panic!("{element}: {error}"));
        let run = Simulation::new(&four).element(element).step(0.02);
        let other = run.run(four.state(q, v), 0.0..1.0).expect("a run");
        for time in [0.013, 0.5, 0.777, 1.0] {
            let (one, other) = (
                one.at(time).expect("inside"),
                other.at(time).expect("inside"),
            );
            for a in 0..8 {
                // The rounding errors of fifty steps.
                assert!((one.q[a] - other.q[a]).abs() < 1e-12, "{element} {time}");
                assert!((one.p[a] - other.p[a]).abs() < 1e-11, "{element} {time}");
            }
        }
        // The rounding errors of squares of order one, and of their rates.
        let residual = one.constraint_residual();
        assert!(residual.position < 1e-14, "{element}: {residual:?}");
        assert!(residual.velocity < 1e-13, "{element}: {residual:?}");
    }
}

/// The order is 2 (n − 1) in coordinates and momenta, for a nonlinear problem.
#[test]
fn the_order_on_constraints_is_that_of_the_element() {
    let (model, (q, v)) = (rods(), start());
    let end = |element: Element, step: f64| {
        let run = Simulation::new(&model).element(element).step(step);
        run.run(model.state(q, v), 0.0..0.5)
            .expect("a run")
            .last()
            .state()
    };
    let exact = end(Element::mixed(8), 0.01);
    let error = |element: Element, step: f64| {
        let state = end(element, step);
        let off = |one: &[f64], other: &[f64]| {
            let all = one
                .iter()
                .zip(other)
                .map(|(one, other)| (one - other).abs());
            all.fold(0.0, larger)
        };
        (off(&state.q, &exact.q), off(&state.p, &exact.p))
    };
    for (n, step) in [(2, 0.01), (3, 0.05), (4, 0.05)] {
        let (coarse, fine) = (
            error(Element::mixed(n), step),
            error(Element::mixed(n), 0.5 * step),
        );
        let expected = 2.0 * (n as f64 - 1.0);
        for order in [(coarse.0 / fine.0).log2(), (coarse.1 / fine.1).log2()] {
            assert!((order - expected).abs() < 0.5, "{n}: {order}");
        }
    }
}

#[test]
fn starts_off_the_constraints_are_refused() {
    let (model, (mut q, mut v)) = (rods(), start());
    q[3] += 1e-3;
    let error = Simulation::new(&model)
        .step(0.01)
        .run(model.state(q, v), 0.0..1.0);
    let error = error.expect_err("a rod too long");
    assert!(
        matches!(
            error.kind(),
            RunErrorKind::Solve {
                element: 0,
                source: StepError::Constraint(ConstraintError::Start {
                    constraint,
                    position: true,
                    ..
                }),
                ..
            } if constraint.to_string() == "rod[2]"
        ),
        "{error}"
    );
    let (q, _) = start();
    v[0] += 1e-3;
    let error = Simulation::new(&model)
        .step(0.01)
        .run(model.state(q, v), 0.0..1.0);
    let error = error.expect_err("rods that grow");
    assert!(
        matches!(
            error.kind(),
            RunErrorKind::Solve {
                element: 0,
                source: StepError::Constraint(ConstraintError::Start {
                    position: false,
                    ..
                }),
                ..
            }
        ),
        "{error}"
    );
}

/// Close to a support at 1e9 m, rods of one metre were accepted with errors of up to ten metres.
#[test]
fn rods_far_from_the_origin_have_their_lengths() {
    let far = 1e9;
    let model = Rods { a: far, ..rods() };
    let (mut q, _) = start();
    for x in &mut q[..4] {
        *x += far;
    }
    // The support is at rest there, at its maximum.
    let begin = std::f64::consts::FRAC_PI_2;
    let outcome = |q: [f64; 8]| {
        let run = Simulation::new(&model).step(1e-6);
        let motion = run.run(model.state(q, [0.0; 8]), begin..begin + 1e-6);
        motion.map_or_else(|error| error.to_string(), |_| String::new())
    };
    // The rounding error of the initial state is not a violation.
    let text = outcome(q);
    assert!(!text.contains("violates"), "{text}");
    q[3] += 0.1;
    let text = outcome(q);
    assert!(text.contains("`rod[2]`: position off by"), "{text}");
}

/// Rods beside a coordinate that is far away: their lengths may not change, in whatever units.
#[test]
fn rods_keep_their_lengths_in_mixed_units() {
    #[dynamics(
        coordinates(x[n], y[n], z[n]),
        lagrangian = sum(i in 0..n, (dot(x[i])^2 + dot(y[i])^2 + dot(z[i])^2)/2 - g*y[i]),
        constraint(rod[i in 0..n]) = x[i]^2 + y[i]^2 - 1,
    )]
    struct Hanging {
        n: usize,
        g: f64,
    }
    let model = Hanging { n: 2, g: 9.81 };
    for far in [0.0, 1e9, 1.5e11] {
        let q = [1.0, 0.0, 0.0, -1.0, far, 0.0];
        let run = |along: f64| {
            // The second component is along the second rod.
            let start = model.state(q, [0.0, 0.3, 0.5, along, 0.0, 0.0]);
            Simulation::new(&model).step(0.01).run(start, 0.0..0.01)
        };
        let good = run(0.0);
        assert!(good.is_ok(), "{far:e}: {:?}", good.err());
        let error = run(1e-3).expect_err("a rod that grows");
        assert!(
            matches!(
                error.kind(),
                RunErrorKind::Solve {
                    source: StepError::Constraint(ConstraintError::Start {
                        constraint,
                        position: false,
                        ..
                    }),
                    ..
                } if constraint.is("rod[1]")
            ),
            "{far:e}: {error}"
        );
    }
}

#[test]
fn what_cannot_hold_constraints_is_refused() {
    let (model, (q, v)) = (rods(), start());
    let kind = |simulation: tfe::family::Simulation<'_, Rods>| {
        let run = simulation.run(model.state(q, v), 0.0..1.0);
        run.expect_err("no constraints").kind().clone()
    };
    for element in [Element::radau(3), Element::mixed(3).quadrature(4)] {
        let run = Simulation::new(&model).element(element);
        assert_eq!(
            kind(run),
            RunErrorKind::Family(family::ModelError::ElementNotSupported { element })
        );
    }
    let run = Simulation::new(&model).solver(Solve::FixedPoint);
    assert_eq!(
        kind(run),
        RunErrorKind::Family(family::ModelError::NeedsNewton)
    );
}

/// A closed ring has a constraint for each rod and two pins: more than a chain, and none of them is redundant.
#[test]
fn a_hanging_ring_keeps_its_energy() {
    #[dynamics(
        coordinates(x[n], y[n]),
        lagrangian = sum(i in 0..n, (dot(x[i])^2 + dot(y[i])^2)/2 - g*y[i]),
        constraint(rod[i in 0..n-1]) = (x[i+1] - x[i])^2 + (y[i+1] - y[i])^2 - l^2,
        constraint(last) = (x[0] - x[n-1])^2 + (y[0] - y[n-1])^2 - l^2,
        constraint(pin) = [x[0], y[0]],
    )]
    struct Ring {
        n: usize,
        g: f64,
        l: f64,
    }
    let n = 12;
    let turn = |i: usize| std::f64::consts::TAU * i as f64 / n as f64;
    let l = 2.0 * (0.5 * turn(1)).sin();
    let model = Ring { n, g: 9.81, l };
    let q = (0..n)
        .map(|i| turn(i).sin())
        .chain((0..n).map(|i| turn(i).cos() - 1.0));
    let start = model.state(q.collect::<Vec<_>>(), vec![0.0; 2 * n]);
    let motion = Simulation::new(&model)
        .element(Mixed::<4>)
        .step(0.005)
        .run(start, 0.0..1.0)
        .expect("a run");
    assert!(motion.energy_error() < 1e-7, "{:e}", motion.energy_error());
    assert!(motion.constraint_residual().position < 1e-13);
}

/// Rods of any unit of mass, length and time swing alike. In the units of molecules the inertias are far below the
/// rounding errors of the constraints, in those of planets far above. The equation of the first rod is one site, and does not contain its index.
#[test]
fn light_chains_move_as_heavy_ones() {
    #[dynamics(
        coordinates(x[n], y[n]),
        lagrangian = sum(i in 0..n, m/2*(dot(x[i])^2 + dot(y[i])^2) - m*g*y[i]),
        constraint(first[i in 0..1]) = x[0]^2 + y[0]^2 - l^2,
        constraint(rod[i in 1..n]) = (x[i] - x[i-1])^2 + (y[i] - y[i-1])^2 - l^2,
    )]
    struct Hanging {
        n: usize,
        m: f64,
        l: f64,
        g: f64,
    }
    let end = |l: f64, m: f64, unit: f64| {
        let g = l / (unit * unit);
        let model = Hanging { n: 4, m, l, g };
        let q = [0.6, 1.2, 1.8, 2.4, -0.8, -1.6, -2.4, -3.2].map(|q| q * l);
        let simulation = Simulation::new(&model)
            .element(Mixed::<5>)
            .step(0.05 * unit);
        let motion = simulation.run(model.state(q, [0.0; 8]), 0.0..3.0 * unit);
        let end = motion.expect("a run").last().q.clone();
        end.into_iter().map(|q| q / l).collect::<Vec<f64>>()
    };
    let wanted = end(1.0, 1.0, 1.0);
    for (l, m, unit) in [
        (1e-10, 1e-27, 1e-14),
        (1e-6, 1e-15, 1.0),
        (1.0, 1e-18, 1.0),
        (1.0, 1e30, 1.0),
        (1e10, 1e27, 1e14),
    ] {
        let found = end(l, m, unit);
        let off = found.iter().zip(&wanted).map(|(a, b)| (a - b).abs());
        // Rounding errors of sixty steps.
        let off = off.fold(0.0, larger);
        assert!(off <= 1e-12, "{l:e} {m:e} {unit:e}: {off:.1e}");
    }
}

/// Beads on wires that bend at x = 0, with springs; the first wire is moved from a time on.
#[dynamics(
    coordinates(x[n], y[n]),
    lagrangian = sum(i in 0..n, m/2*(dot(x[i])^2 + dot(y[i])^2) - m*g*y[i]) - sum(i in 0..n-1, k/2*(x[i+1] - x[i])^2),
    constraint(wire[i in 0..n]) = y[i] - r*max(x[i], 0) - u*max(t - s, 0),
)]
struct Bends {
    n: usize,
    m: f64,
    g: f64,
    k: f64,
    r: f64,
    u: f64,
    s: f64,
}

#[dynamics(
    coordinates(x[3], y[3]),
    lagrangian = sum(i in 0..3, m/2*(dot(x[i])^2 + dot(y[i])^2) - m*g*y[i]) - sum(i in 0..2, k/2*(x[i+1] - x[i])^2),
    constraint(wire[i in 0..3]) = y[i] - r*max(x[i], 0) - u*max(t - s, 0),
)]
struct ThreeBends {
    m: f64,
    g: f64,
    k: f64,
    r: f64,
    u: f64,
    s: f64,
}

#[test]
fn beads_on_wires_that_bend_move_as_those_of_fixed_size() {
    let (m, g, k, r, u, s) = (0.7, 9.81, 3.0, 0.4, 0.6, 0.21);
    let (long, three) = of_both_lengths!(Bends(3), ThreeBends: m, g, k, r, u, s);
    let q = [-0.5, -0.7, -1.2, 0.0, 0.0, 0.0];
    let v = [2.0, 1.7, 1.9, 0.0, 0.0, 0.0];
    for element in [3, 4, 7].map(Element::mixed) {
        for step in [0.05, 0.13] {
            let one = Simulation::new(&long).element(element).step(step);
            let start = long.state(q, v);
            let one = one.at_kinks(true).run(start, 0.0..0.9);
            let other = Simulation::new(&three).element(element).step(step);
            let other = other.at_kinks(true).run(three.state(q, v), 0.0..0.9);
            let (one, other) = (one.expect("a run"), other.expect("a run of fixed size"));
            let kinks = [one.statistics().kinks, other.statistics().kinks];
            assert!(kinks[0] >= 4 && kinks[0] == kinks[1], "{kinks:?}");
            let ends = one.last().q.iter().zip(&other.last().q);
            let off = ends.fold(0.0, |most, (a, b)| larger(most, (a - b).abs()));
            // Both cut their steps at the same roots, up to rounding.
            assert!(off <= 1e-12, "{element} {step}: {off:.1e}");
        }
    }
}

/// Beads on wires with a stair.
#[dynamics(
    coordinates(x[n], y[n]),
    lagrangian = sum(i in 0..n, (dot(x[i])^2 + dot(y[i])^2)/2),
    constraint(wire[i in 0..n]) = y[i] - select(x[i] < 1, 0, d),
)]
struct Stairs {
    n: usize,
    d: f64,
}

#[test]
fn a_jump_of_a_constrained_position_is_an_error() {
    let stairs = Stairs { n: 2, d: 1e-5 };
    let start = stairs.state([0.0, 0.5, 0.0, 0.0], [1.0, 1.0, 0.0, 0.0]);
    let run = Simulation::new(&stairs).element(Mixed::<4>).step(0.1);
    let run = run.at_kinks(true).run(start, 0.0..2.0);
    let error = run.expect_err("no motion can jump");
    let RunErrorKind::Solve { source, .. } = error.kind() else {
        panic!("{error}");
    };
    let name = tfe::runtime::CoordinateName::element("wire", 1);
    let StepError::Constraint(ConstraintError::Discontinuous {
        constraint,
        distance,
    }) = source
    else {
        panic!("{error}");
    };
    assert_eq!(*constraint, name);
    assert!((distance - 1e-5).abs() <= 1e-12, "{distance:e}");
}

/// A train of wheels under loads that balance; the last two wheels are idle, one of them without inertia. Rounding
/// errors of loads up to about ten move nothing by more than 1e-12 of t².
#[test]
fn wheels_that_balance_stay_at_the_origin() {
    const RATIO: f64 = 3.0;

    #[dynamics(
        coordinates(a[n]),
        lagrangian = sum(i in 0..n, m[i]*dot(a[i])^2/2 - f[i]*a[i]),
        constraint(mesh[i in 0..n-1]) = a[i] - r*a[i+1],
    )]
    struct Train {
        n: usize,
        m: Vec<f64>,
        f: Vec<f64>,
        r: f64,
    }

    let m = vec![1.0, 2.0, 0.5, 1.5, 1.0, 1.0, 0.0];
    let mut f = vec![0.3, 0.7, -0.2, 0.45, 0.0, 0.0, 0.0];
    // Each wheel passes the loads before it on to the next one.
    let mut reactions: Vec<f64> = Vec::new();
    for load in &f[..4] {
        let before = reactions.last().unwrap_or(&0.0);
        reactions.push(load + RATIO * before);
    }
    f[4] = -RATIO * reactions[3];
    reactions.extend([0.0, 0.0]);
    let (n, r) = (m.len(), RATIO);
    let train = Train { n, m, f, r };
    let start = || train.state(vec![0.0; n], vec![0.0; n]);
    for element in [Element::mixed(2), Element::mixed(4), Element::mixed(7)] {
        for h in [1.0, 0.1, 0.001] {
            let simulation = Simulation::new(&train).element(element).step(h);
            let motion = simulation.run(start(), 0.0..10.0 * h).expect("it stays");
            let end = motion.last();
            let (moved, moves) = (worst(&end.q, &[]), worst(&end.v, &[]));
            assert!(
                moved <= 1e-12 * h * h && moves <= 1e-12 * h,
                "{h}: {moved:e} {moves:e}"
            );
            let found = motion.reactions().row(7).expect("a node");
            let off = worst(found, &reactions);
            assert!(off <= 1e-12, "{h}: {found:?}");
            assert!(motion.warnings().is_empty(), "{:?}", motion.warnings());
            let iterations = motion.statistics().iterations;
            assert!(iterations <= 400, "{iterations}");
        }
    }
}

/// The largest difference, from zeros where there are no others.
fn worst(found: &[f64], expected: &[f64]) -> f64 {
    let expected = expected.iter().copied().chain(std::iter::repeat(0.0));
    let off = found
        .iter()
        .zip(expected)
        .map(|(one, other)| (one - other).abs());
    off.fold(0.0, larger)
}
