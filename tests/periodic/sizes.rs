//! The units of mass, length and time must not matter.

use crate::common::larger;
use crate::models::{PENDULUM, VanDerPol};
use std::f64::consts::{PI, TAU};
use tfe::AssemblyError;
use tfe::boundary::BoundaryError;
use tfe::periodic::OrbitError;
use tfe::prelude::*;

/// A particle in a plane, between hardening springs.
#[dynamics(
    coordinates(x, y),
    lagrangian = m/2*(dot(x)^2 + dot(y)^2) - k/2*(x^2 + 2*y^2) - b*k/l^2*x^2*y^2,
)]
struct Plane {
    m: f64,
    k: f64,
    b: f64,
    l: f64,
}

/// A pendulum in a viscous fluid that moves to and fro.
#[dynamics(
    coordinates(theta),
    lagrangian = m*l^2/2*dot(theta)^2 + m*g*l*cos(theta),
    force(theta) = m*g*l*f*cos(w*t) - c*m*l^2*dot(theta),
)]
struct Pushed {
    m: f64,
    l: f64,
    g: f64,
    f: f64,
    w: f64,
    c: f64,
}

/// A pendulum in a vehicle that is far away and moves on.
#[dynamics(
    coordinates(x, theta),
    lagrangian = m*dot(x)^2/2 + dot(theta)^2/2 + cos(theta),
)]
struct Carried {
    m: f64,
}

/// Van der Pol's oscillator in a vehicle that is far away.
#[dynamics(
    coordinates(x, y),
    lagrangian = dot(x)^2/2 + (dot(y)^2 - y^2)/2,
    force(y) = (1 - y^2)*dot(y),
)]
struct FarVanDerPol {}

/// Units of mass, length and time, with one of them changed.
fn units() -> impl Iterator<Item = [f64; 3]> {
    let sizes = [1e-100, 1e-30, 1e-9, 1e-4, 1.0, 1e4, 1e9, 1e30, 1e100];
    sizes
        .into_iter()
        .flat_map(|size| [[size, 1.0, 1.0], [1.0, size, 1.0], [1.0, 1.0, size]])
}

#[test]
fn conservative_orbits_have_the_same_period() {
    for [m, l, t] in units() {
        let k = m / t / t;
        let plane = Plane { m, k, b: 0.3, l };
        let orbit = PeriodicOrbit::of(&plane)
            .elements(12)
            .guess(|at| {
                let phase = 2.0_f64.sqrt() * at / t;
                let (q, v) = (
                    0.4 * l * phase.cos(),
                    -0.4 * l * 2.0_f64.sqrt() / t * phase.sin(),
                );
                ([0.0, q], [0.0, v])
            })
            .unknown_period(4.5 * t)
            .solve();
        let orbit = orbit.unwrap_or_else(|error| panic!("{m:e} {l:e} {t:e}: {error}"));
        // Along the axis the spring is linear; the error of twelve elements is 9e-7.
        let period = orbit.period() / t;
        assert!(
            (period - TAU / 2.0_f64.sqrt()).abs() < 1e-6,
            "{m:e} {l:e} {t:e}: {period}"
        );
        // With all digits, and not with rows of zeros.
        let shown = orbit.to_string().replace('.', "");
        assert!(shown.contains("T = 4442"), "{orbit}");
        assert!(
            orbit.is_stable(),
            "{m:e} {l:e} {t:e} {:?} {:?}",
            orbit.verdict(),
            orbit.multipliers()
        );
    }
}

#[test]
fn forced_orbits_have_the_same_multipliers() {
    let found = |[m, l, t]: [f64; 3]| {
        let pushed = Pushed {
            m,
            l,
            g: l / t / t,
            f: 0.2,
            w: 0.7 / t,
            c: 0.1 / t,
        };
        let orbit = PeriodicOrbit::of(&pushed)
            .period(TAU / 0.7 * t)
            .elements(20)
            .solve();
        let orbit = orbit.unwrap_or_else(|error| panic!("{m:e} {l:e} {t:e}: {error}"));
        let moduli: Vec<f64> = orbit.multipliers().iter().map(|one| one.norm()).collect();
        (orbit.start().q[0], moduli)
    };
    let (angle, moduli) = found([1.0; 3]);
    // By the formula of Abel, Jacobi and Liouville, a damping of 0.1 reduces every area over the period by the same
    // factor.
    let product = (-0.1 * TAU / 0.7_f64).exp();
    let off = moduli.iter().product::<f64>() - product;
    assert!(off.abs() < 1e-5, "{off:e}");
    for of in units() {
        let (other, others) = found(of);
        assert!((other - angle).abs() < 1e-11, "{of:?}: {other} {angle}");
        for (one, other) in moduli.iter().zip(&others) {
            assert!((one - other).abs() < 1e-11, "{of:?}: {moduli:?} {others:?}");
        }
    }
}

/// An angle next to a distance is as accurate as alone, although it is small relative to the distance.
#[test]
fn small_coordinates_are_right_beside_large_ones() {
    let pendulum = PENDULUM;
    let alone = BoundaryValue::of(&pendulum)
        .element(Mixed::<8>)
        .elements(20)
        .from_to([0.0], [PI], 0.0..3.0)
        .solve()
        .expect("a swing up");
    for m in [1.0, 1e6] {
        let carried = Carried { m };
        let far = BoundaryValue::of(&carried)
            .element(Mixed::<8>)
            .elements(20)
            .from_to([0.0, 0.0], [1.5e11, PI], 0.0..3.0)
            .solve()
            .expect("a swing up");
        assert_eq!(far.nodes().len(), alone.nodes().len());
        for (far, alone) in far.nodes().iter().zip(alone.nodes()) {
            let off = larger((far.q[1] - alone.q[0]).abs(), (far.p[1] - alone.p[0]).abs());
            assert!(off < 1e-12, "{m:e}, t = {}: {off:e}", far.t);
        }
        let iterations = far.statistics().newton_iterations;
        assert!(
            iterations <= alone.statistics().newton_iterations,
            "{m:e}: {iterations}"
        );
    }
}

/// If the iteration for an angle does not converge, convergence of a distance next to it is no evidence: what is
/// returned must be a motion.
#[test]
fn small_coordinates_that_are_not_found_are_no_solution() {
    let (carried, pendulum) = (Carried { m: 1.0 }, PENDULUM);
    for (time, angle) in [(7.0, PI), (7.0, 4.0), (10.0, 0.5), (10.0, 1.0)] {
        let far = BoundaryValue::of(&carried)
            .element(Mixed::<8>)
            .from_to([0.0, 0.0], [1.5e11, angle], 0.0..time)
            .solve();
        match far {
            Ok(far) => {
                let State { q, p } = far.start();
                let start = State {
                    q: [q[1]],
                    p: [p[1]],
                };
                let run = Simulation::new(&pendulum)
                    .element(Mixed::<8>)
                    .step(time / 40.0)
                    .run(start, 0.0..time)
                    .expect("a run");
                // Ten units of time amplify rounding errors by about 1e4.
                let off = (run.last().q[0] - angle).abs();
                assert!(off < 1e-7, "{time}, {angle}: {off:e}");
            }
            Err(BoundaryError::Assembly(AssemblyError::Stalled { .. })) => {}
            Err(error) => panic!("{time}, {angle}: {error}"),
        }
    }
}

/// A limit cycle has one period only: with a small mass no other period may be accepted, and with a large one the right
/// period may not be refused.
#[test]
fn a_force_that_closes_an_orbit_is_measured_by_the_mass() {
    for m in [1e-12, 1e-6, 1.0, 1e6, 1e12] {
        let oscillator = VanDerPol { m, mu: 1.0 };
        let guess = |t: f64| ([2.0 * t.cos()], [-2.0 * t.sin()]);
        let of = || PeriodicOrbit::of(&oscillator).elements(40).guess(guess);
        let orbit = of().unknown_period(6.6).solve().expect("a limit cycle");
        // Reference: `tests/reference/periodic.json`.
        assert!(
            (orbit.period() - 6.663_286_859_3).abs() < 1e-6,
            "{m:e}: {}",
            orbit.period()
        );
        let forced = of().period(7.5).solve();
        assert!(matches!(forced, Err(OrbitError::NoFamily { .. })), "{m:e}");
    }
}

/// Orbits of simulations must close in each coordinate, however far from zero another one is.
#[test]
fn small_coordinates_of_orbits_with_events_close_beside_large_ones() {
    let oscillator = FarVanDerPol {};
    let simulation = Simulation::new(&oscillator);
    for far in [0.0, 1.0, 1e4, 1.5e11] {
        let orbit = PeriodicOrbit::of_simulation(&simulation)
            .unknown_period(6.6)
            .guess_from(oscillator.state([far, 2.0], [0.0, 0.0]))
            .solve()
            .unwrap_or_else(|error| panic!("{far:e}: {error}"));
        // Reference: `tests/reference/periodic.json`.
        let period = orbit.period();
        assert!((period - 6.663_286_859_3).abs() < 1e-6, "{far:e}: {period}");
    }
}
