//! Orbits of constrained models compared with those of equivalent models in minimal coordinates.

use crate::common::larger;
use crate::models::{Pendulum, agm};
use std::f64::consts::{PI, TAU};
use tfe::AssemblyError;
use tfe::boundary::BoundaryError;
use tfe::continuation::Branch;
use tfe::periodic::OrbitError;
use tfe::prelude::*;

const OMEGA: f64 = 2.3;

/// A pendulum with a pivot that moves up and down, air drag and a driving torque; φ is measured from the downward
/// vertical.
#[dynamics(
    coordinates(phi),
    let x = sin(phi),
    let y = a*cos(omega*t) - cos(phi),
    lagrangian = (dot(x)^2 + dot(y)^2)/2 - g*y,
    force(phi) = f*cos(omega*t) - c*dot(phi),
)]
#[derive(Clone)]
struct Angle {
    g: f64,
    a: f64,
    omega: f64,
    f: f64,
    c: f64,
}

/// The same as a mass on a rod. The torque acts as the force f cos ωt and −c φ̇ perpendicular to the rod.
#[dynamics(
    coordinates(x, y),
    lagrangian = (dot(x)^2 + dot(y)^2)/2 - g*y,
    let pivot = a*cos(omega*t),
    let rate = (pivot - y)*dot(x) + x*(dot(y) - dot(pivot)),
    force(x) = (pivot - y)*(f*cos(omega*t) - c*rate),
    force(y) = x*(f*cos(omega*t) - c*rate),
    constraint(rod) = x^2 + (y - pivot)^2 - 1,
)]
#[derive(Clone)]
struct Rod {
    g: f64,
    a: f64,
    omega: f64,
    f: f64,
    c: f64,
}

fn twins(a: f64, f: f64, c: f64) -> (Angle, Rod) {
    let (g, omega) = (1.0, OMEGA);
    (Angle { g, a, omega, f, c }, Rod { g, a, omega, f, c })
}

/// Position and velocity of the mass.
fn mass(model: &Angle, t: f64, phi: f64, rate: f64) -> ([f64; 2], [f64; 2]) {
    let pivot = model.a * (model.omega * t).cos();
    let speed = -model.a * model.omega * (model.omega * t).sin();
    (
        [phi.sin(), pivot - phi.cos()],
        [phi.cos() * rate, speed + phi.sin() * rate],
    )
}

/// The multipliers of both, each from 40 elements of six nodes; they agree to 1e-9.
#[test]
fn forced_orbits_have_the_multipliers_of_their_twins() {
    for (a, f, c) in [(0.1, 0.2, 0.1), (0.3, 0.0, 0.0), (0.0, 0.8, 0.05)] {
        let (angle, rod) = twins(a, f, c);
        // The linear response is the guess.
        let amplitude = f / (1.0 - OMEGA * OMEGA);
        let curve = |t: f64| {
            let (sin, cos) = (OMEGA * t).sin_cos();
            (amplitude * cos, -amplitude * OMEGA * sin)
        };
        let minimal = PeriodicOrbit::of(&angle)
            .element(Mixed::<6>)
            .elements(40)
            .period(TAU / OMEGA)
            .guess(|t| {
                let (phi, rate) = curve(t);
                ([phi], [rate])
            })
            .solve()
            .unwrap();
        let cartesian = PeriodicOrbit::of(&rod)
            .element(Mixed::<6>)
            .elements(40)
            .period(TAU / OMEGA)
            .guess(|t| {
                let (phi, rate) = curve(t);
                mass(&angle, t, phi, rate)
            })
            .solve()
            .unwrap();
        let (expected, found) = (minimal.multipliers(), cartesian.multipliers());
        assert_eq!(found.len(), 2, "no spurious multipliers");
        for (found, expected) in found.iter().zip(expected) {
            assert!((found - expected).norm() < 1e-9, "{found} {expected}");
        }
        let residual = cartesian.motion().constraint_residual();
        assert!(residual.position < 1e-13, "{residual:?}");
    }
}

/// The free pendulum.
#[dynamics(
    coordinates(x, y),
    lagrangian = (dot(x)^2 + dot(y)^2)/2 - g*y,
    constraint(rod) = x^2 + y^2 - 1,
)]
#[derive(Clone)]
struct Free {
    g: f64,
}

/// A conservative swing: the period follows from the energy, and the two trivial multipliers are one.
#[test]
fn a_free_swing() {
    let (angle, rod) = (twins(0.0, 0.0, 0.0).0, Free { g: 1.0 });
    let amplitude = 1.2_f64;
    // 4 K(sin(0.6)) by the arithmetic-geometric mean.
    let period = TAU / agm(1.0, 0.6_f64.cos());
    let orbit = PeriodicOrbit::of(&rod)
        .element(Mixed::<6>)
        .elements(30)
        .period(period)
        .guess(|t| {
            let (sin, cos) = (TAU * t / period).sin_cos();
            mass(&angle, t, amplitude * cos, -amplitude * TAU / period * sin)
        })
        .solve()
        .unwrap();
    let motion = orbit.motion();
    let highest = motion
        .states()
        .iter()
        .map(|node| node.q[1])
        .fold(-1.0, larger);
    assert!((highest + amplitude.cos()).abs() < 1e-6, "{highest}");
    assert_eq!(orbit.multipliers().len(), 2);
    for multiplier in orbit.multipliers() {
        // A double, defective eigenvalue: its error is the square root of that of the matrix.
        assert!((multiplier - 1.0).norm() < 1e-5, "{multiplier}");
    }
}

/// A pendulum with two constraints: with l = 1 the second equation follows from the first.
#[dynamics(
    coordinates(x, y),
    lagrangian = (dot(x)^2 + dot(y)^2)/2 - g*y,
    constraint(rod) = x^2 + y^2 - 1,
    constraint(length) = sqrt(x^2 + y^2) - l,
)]
struct Twice {
    g: f64,
    l: f64,
}

/// A swing of a pendulum of length one through the bottom, where the rows of both constraints have equal lengths to the
/// last bit.
fn swing(amplitude: f64, omega: f64, t: f64) -> ([f64; 2], [f64; 2]) {
    let angle = twins(0.0, 0.0, 0.0).0;
    let (sin, cos) = (omega * t).sin_cos();
    mass(&angle, t, amplitude * sin, amplitude * omega * cos)
}

/// If two rows are equal, elements use the first: here the other constraint is violated by a tenth of the length.
#[track_caller]
fn assert_violated(error: &AssemblyError) {
    let AssemblyError::Violated {
        constraint,
        position,
        residual,
        ..
    } = error
    else {
        panic!("{error}");
    };
    assert_eq!((*constraint, *position), ("length", true));
    assert!((residual - 0.1).abs() < 1e-9, "{residual}");
    assert!(error.to_string().contains("`length`"), "{error}");
}

#[test]
fn constraints_that_contradict_have_no_orbit() {
    const PERIOD: f64 = 6.5;
    fn swings<M: Model<2>>(model: &M) -> PeriodicOrbit<'_, M, 2> {
        PeriodicOrbit::of(model)
            .element(Mixed::<6>)
            .elements(20)
            .period(PERIOD)
            .guess(|t| swing(0.7, TAU / PERIOD, t))
    }
    let (rod, agreed) = (Free { g: 1.0 }, Twice { g: 1.0, l: 1.0 });
    let alone = swings(&rod).solve().expect("a swing").start();
    let twice = swings(&agreed)
        .solve()
        .unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(twice.multipliers().len(), 2);
    let start = twice.start();
    for a in 0..2 {
        assert!((start.q[a] - alone.q[a]).abs() < 1e-11);
        assert!((start.p[a] - alone.p[a]).abs() < 1e-11);
    }
    let contradicting = Twice { g: 1.0, l: 1.1 };
    match swings(&contradicting).solve().map(|orbit| orbit.period()) {
        Err(OrbitError::Assembly(error)) => assert_violated(&error),
        other => panic!("{other:?}"),
    }
}

#[test]
fn constraints_that_contradict_have_no_motion_between_ends() {
    let between = |l: f64| {
        let twice = Twice { g: 1.0, l };
        let (q, v) = swing(0.5, 1.0, 0.0);
        let arc = BoundaryValue::of(&twice)
            .elements(10)
            .initial(twice.state(q, v), 0.0..1.0)
            .guess(|t| swing(0.5, 1.0, t))
            .solve();
        arc.map(|arc| arc.end())
    };
    let end = between(1.0).expect("an arc");
    assert!((end.q[0].hypot(end.q[1]) - 1.0).abs() < 1e-12);
    match between(1.1) {
        Err(BoundaryError::Assembly(error)) => assert_violated(&error),
        other => panic!("{other:?}"),
    }
}

/// Beside a coordinate of 1e9 a contradiction of a tenth is as large as without it.
#[test]
fn contradictions_are_found_in_mixed_units() {
    #[dynamics(
        coordinates(x, y, z),
        lagrangian = (dot(x)^2 + dot(y)^2 + dot(z)^2)/2 - g*y,
        constraint(rod) = x^2 + y^2 - 1,
        constraint(length) = sqrt(x^2 + y^2) - l,
    )]
    struct TwiceBeside {
        g: f64,
        l: f64,
    }
    let far = 1e9;
    let beside = move |t: f64| {
        let ([x, y], [vx, vy]) = swing(0.5, 1.0, t);
        ([x, y, far], [vx, vy, 0.0])
    };
    let twice = TwiceBeside { g: 1.0, l: 1.1 };
    let (q, v) = beside(0.0);
    let arc = BoundaryValue::of(&twice)
        .elements(10)
        .initial(twice.state(q, v), 0.0..1.0)
        .guess(beside)
        .solve();
    let error = arc.map(|arc| arc.end()).expect_err("a contradiction");
    let BoundaryError::Assembly(AssemblyError::Violated { constraint, .. }) = error else {
        panic!("{error}");
    };
    assert_eq!(constraint, "length");
}

/// With two elements per period, their nodes do not determine the direction of the flow, and reactions are part of it.
#[test]
fn a_free_swing_of_two_elements() {
    let rod = Free { g: 1.0 };
    let energy = |elements: usize, nodes: usize| {
        let orbit = PeriodicOrbit::of(&rod)
            .element(Element::mixed(nodes))
            .elements(elements)
            .period(6.5)
            .guess(|t| swing(0.7, TAU / 6.5, t))
            .solve()
            .unwrap_or_else(|error| panic!("{elements}: {error}"));
        orbit.motion().energies()[0]
    };
    let off = energy(2, 12) - energy(30, 6);
    assert!(off.abs() < 1e-4, "{off:e}");
}

/// A body with a fixed point, described by a unit quaternion, with a singular mass matrix: it swings about its first
/// axis like a pendulum in one angle. A spring prevents rotation about the vertical.
#[test]
fn a_swing_of_a_unit_quaternion() {
    #[dynamics(
        coordinates(e[4]),
        let w = body_rate(e),
        let axis = rotate(e, [0, 0, 1]),
        lagrangian = (i1*w[0]^2 + i2*w[1]^2 + i3*w[2]^2)/2 - mgd*axis[2] - s/2*axis[0]^2,
        constraint(unit) = (inner(e, e) - 1)/2,
    )]
    struct Body {
        i1: f64,
        i2: f64,
        i3: f64,
        mgd: f64,
        s: f64,
    }
    let (i1, i2, i3, mgd, s) = (1.2, 1.0, 0.9, 1.1, 0.7);
    let body = Body { i1, i2, i3, mgd, s };
    let plane = Pendulum { m: i1, k: mgd };
    // About the lower position, while attitudes are about the upper one.
    let angle = 1.0;
    let half = (PI + angle) / 2.0;
    let start = body.state([half.cos(), half.sin(), 0.0, 0.0], [0.0; 4]);
    let guess = 6.7 * (i1 / mgd).sqrt();
    let ours = PeriodicOrbit::of(&body).element(Mixed::<6>).elements(40);
    let ours = ours.unknown_period(guess).guess_from(start);
    let theirs = PeriodicOrbit::of(&plane).element(Mixed::<6>).elements(40);
    let theirs = theirs.unknown_period(guess);
    let theirs = theirs.guess_from(plane.state([angle], [0.0]));
    let (ours, theirs) = (ours.solve_sensitive(), theirs.solve_sensitive());
    let (ours, theirs) = (ours.expect("an orbit"), theirs.expect("an orbit"));
    // The elements differ, since the coordinates do: errors of tenth order.
    let (one, other) = (ours.orbit(), theirs.orbit());
    assert!((one.period() - other.period()).abs() < 1e-7);
    assert_eq!((one.multipliers().len(), one.trivial().len()), (6, 2));
    for (name, other) in [("i1", "m"), ("mgd", "k")] {
        let (ours, theirs) = (ours.by(name).period(), theirs.by(other).period());
        assert!((ours - theirs).abs() < 1e-6, "{name}: {ours} {theirs}");
    }
}

/// A driven pendulum with a different mass in the vertical direction: the momenta that the rod allows depend on m.
#[dynamics(
    coordinates(x, y),
    lagrangian = (dot(x)^2 + m*dot(y)^2)/2 - y,
    let torque = f*cos(2*t) - c*(x*dot(y) - y*dot(x)),
    force(x) = -y*torque,
    force(y) = x*torque,
    constraint(rod) = x^2 + y^2 - 1,
    sensitivity(m),
)]
#[derive(Clone)]
struct Sway {
    m: f64,
    f: f64,
    c: f64,
}

fn sways() -> Branch<Sway, 2> {
    let sway = Sway {
        m: 2.0,
        f: 0.9,
        c: 0.2,
    };
    Continuation::of(&sway)
        .parameter(|sway| &mut sway.m)
        .range(2.0..4.0)
        .largest_step(0.5)
        .elements(20)
        .period(|_| PI)
        .guess(|t| {
            let (sin, cos) = (-0.3 * (2.0 * t).cos()).sin_cos();
            let rate = 0.6 * (2.0 * t).sin();
            ([sin, -cos], [cos * rate, sin * rate])
        })
        .run()
        .expect("a branch")
}

#[test]
fn a_branch_has_the_multipliers_of_its_orbits() {
    let branch = sways();
    let end = branch.points().len() - 1;
    let (point, model) = (&branch.points()[end], branch.model(end).expect("a model"));
    assert_eq!(point.parameter, 4.0);
    let alone = PeriodicOrbit::of(model)
        .elements(20)
        .period(PI)
        .guess_from(point.start)
        .solve()
        .expect("an orbit");
    assert_eq!(point.multipliers.len(), 2);
    for (found, expected) in point.multipliers.iter().zip(alone.multipliers()) {
        assert!((found - expected).norm() < 1e-9, "{found} {expected}");
    }
}

#[test]
fn a_table_of_a_branch_has_a_column_for_each_multiplier() {
    let branch = sways();
    let name = format!("tfe-constrained-branch-{}.csv", std::process::id());
    let path = std::env::temp_dir().join(name);
    branch.write_csv(&path).expect("written");
    let text = std::fs::read_to_string(&path).expect("read");
    std::fs::remove_file(&path).expect("removed");
    // The parameter, the period, two amplitudes, two multipliers, and the stability.
    for line in text.lines() {
        assert_eq!(line.split(',').count(), 9, "{line}");
    }
}

/// A pendulum with two constraints, of which the elements take either: which one, rounding errors decide.
#[test]
fn derivatives_of_orbits_do_not_depend_on_which_constraints_are_redundant() {
    #[dynamics(
        coordinates(x, y),
        lagrangian = m*(dot(x)^2 + dot(y)^2)/2 - m*g*y,
        constraint(rod) = k*(x^2 + y^2 - l^2),
        constraint(length) = sqrt(x^2 + y^2) - l,
    )]
    struct Twofold {
        m: f64,
        g: f64,
        l: f64,
        k: f64,
    }
    let minimal = Pendulum { m: 1.0, k: 9.81 };
    let angle = PeriodicOrbit::of(&minimal).element(Mixed::<8>);
    let angle = angle.elements(60).unknown_period(2.15);
    let angle = angle
        .guess_from(minimal.state([1.0], [0.0]))
        .solve_sensitive();
    // With m = l = 1 the energy is m l² φ̇²/2 − m g l cos φ, and k of the other model is m g l.
    let expected = angle.expect("an orbit").by("k").period();
    for k in [0.3, 0.49, 0.499, 0.6, 2.0] {
        let (m, g, l) = (1.0, 9.81, 1.0);
        let twofold = Twofold { m, g, l, k };
        let (sin, cos) = 1.0_f64.sin_cos();
        for elements in [40, 41, 80] {
            let orbit = PeriodicOrbit::of(&twofold).element(Mixed::<6>);
            let orbit = orbit.elements(elements).unknown_period(2.15);
            let orbit = orbit.guess_from(twofold.state([sin, -cos], [0.0; 2]));
            let found = orbit.solve_sensitive().expect("an orbit").by("g").period();
            // The elements differ, since the coordinates do: errors of tenth order.
            let off = (found - expected).abs();
            assert!(off <= 1e-8, "{k} {elements}: {found} {expected}");
        }
    }
}

/// The mass on a rod beside its angle, which has no inertia and on which the torque acts: the force on it and the
/// reactions cancel.
#[test]
fn coordinates_without_inertia_repeat() {
    #[dynamics(
        coordinates(x, y, phi),
        lagrangian = (dot(x)^2 + dot(y)^2)/2 - g*y,
        constraint(across) = x - sin(phi),
        constraint(along) = y + cos(phi),
        force(phi) = f*cos(omega*t) - c*dot(phi),
    )]
    struct Both {
        g: f64,
        omega: f64,
        f: f64,
        c: f64,
    }
    let (f, c) = (0.8, 0.05);
    let angle = twins(0.0, f, c).0;
    let both = Both {
        g: 1.0,
        omega: OMEGA,
        f,
        c,
    };
    let amplitude = f / (1.0 - OMEGA * OMEGA);
    let curve = |t: f64| {
        let (sin, cos) = (OMEGA * t).sin_cos();
        (amplitude * cos, -amplitude * OMEGA * sin)
    };
    for elements in [30, 40, 60] {
        let minimal = PeriodicOrbit::of(&angle).element(Mixed::<6>);
        let minimal = minimal.elements(elements).period(TAU / OMEGA);
        let minimal = minimal.guess(|t| {
            let (phi, rate) = curve(t);
            ([phi], [rate])
        });
        let minimal = minimal.solve().expect("an orbit");
        let orbit = PeriodicOrbit::of(&both).element(Mixed::<6>);
        let orbit = orbit.elements(elements).period(TAU / OMEGA);
        let orbit = orbit.guess(|t| {
            let (phi, rate) = curve(t);
            let ([x, y], [vx, vy]) = mass(&angle, t, phi, rate);
            ([x, y, phi], [vx, vy, rate])
        });
        let orbit = orbit
            .solve()
            .unwrap_or_else(|error| panic!("{elements}: {error}"));
        let (found, expected) = (orbit.multipliers(), minimal.multipliers());
        assert_eq!(found.len(), 2);
        for (found, expected) in found.iter().zip(expected) {
            // As those of the twins above.
            assert!((found - expected).norm() <= 1e-9, "{found} {expected}");
        }
    }
}
