//! Periodic orbits with events of models of run-time length: compared with those of the same model of fixed size.

use crate::constrained::of_heap;
use crate::events::apart;
use std::f64::consts::TAU;
use tfe::length::RunTimeLength;
use tfe::periodic::{OrbitError, SensitiveOrbit};
use tfe::prelude::*;
use tfe::{HybridOrbit, family};

/// Oscillators coupled by springs, of which the first is driven and hits a wall.
#[dynamics(
    coordinates(x[n]),
    lagrangian = sum(i in 0..n, m/2*dot(x[i])^2 - k/2*x[i]^2) - sum(i in 0..n-1, s/2*(x[i+1] - x[i])^2)
        + f*cos(omega*t)*x[0],
    force(x[i]) = -c*dot(x[i]),
    event(wall) = w - x[0],
)]
struct Row {
    n: usize,
    m: f64,
    k: f64,
    s: f64,
    c: f64,
    f: f64,
    w: f64,
    omega: f64,
}

#[dynamics(
    coordinates(x[2]),
    lagrangian = sum(i in 0..2, m/2*dot(x[i])^2 - k/2*x[i]^2) - s/2*(x[1] - x[0])^2 + f*cos(omega*t)*x[0],
    force(x[i]) = -c*dot(x[i]),
    event(wall) = w - x[0],
)]
struct Pair {
    m: f64,
    k: f64,
    s: f64,
    c: f64,
    f: f64,
    w: f64,
    omega: f64,
}

/// The same oscillators on circles.
#[dynamics(
    coordinates(x[n], y[n]),
    lagrangian = sum(i in 0..n, m/2*(dot(x[i])^2 + dot(y[i])^2) - k/2*x[i]^2)
        - sum(i in 0..n-1, s/2*(x[i+1] - x[i])^2) + f*cos(omega*t)*x[0],
    constraint(circle[i in 0..n]) = x[i]^2 + y[i]^2 - r^2,
    force(x[i]) = -c*dot(x[i]),
    force(y[i]) = -c*dot(y[i]),
    event(wall) = w - x[0],
)]
struct OnCircles {
    n: usize,
    m: f64,
    k: f64,
    s: f64,
    c: f64,
    f: f64,
    w: f64,
    r: f64,
    omega: f64,
}

#[dynamics(
    coordinates(x[2], y[2]),
    lagrangian = sum(i in 0..2, m/2*(dot(x[i])^2 + dot(y[i])^2) - k/2*x[i]^2)
        - s/2*(x[1] - x[0])^2 + f*cos(omega*t)*x[0],
    constraint(circle[i in 0..2]) = x[i]^2 + y[i]^2 - r^2,
    force(x[i]) = -c*dot(x[i]),
    force(y[i]) = -c*dot(y[i]),
    event(wall) = w - x[0],
)]
struct PairOnCircles {
    m: f64,
    k: f64,
    s: f64,
    c: f64,
    f: f64,
    w: f64,
    r: f64,
    omega: f64,
}

/// Clocks, of which the first gets an impulse at each swing upwards through the middle.
#[dynamics(
    coordinates(x[n]),
    lagrangian = sum(i in 0..n, m/2*dot(x[i])^2 - k/2*x[i]^2 - b/4*x[i]^4),
    force(x[i]) = -c*dot(x[i]),
    event(middle) = x[0],
)]
struct Clocks {
    n: usize,
    m: f64,
    k: f64,
    b: f64,
    c: f64,
}

#[dynamics(coordinates(x), lagrangian = m/2*dot(x)^2 - k/2*x^2 - b/4*x^4, force(x) = -c*dot(x), event(middle) = x)]
struct Clock {
    m: f64,
    k: f64,
    b: f64,
    c: f64,
}

/// Compares two orbits with their derivatives. Both are solutions of the same equations, to 1e-12 of the state times
/// the condition of the equations.
#[track_caller]
fn check_same<const N: usize>(
    long: &SensitiveOrbit<HybridOrbit<0, RunTimeLength>, 0, RunTimeLength>,
    fixed: &SensitiveOrbit<HybridOrbit<N>, N>,
) {
    let (a, b) = (long.orbit(), fixed.orbit());
    assert!((a.period() - b.period()).abs() <= 1e-10);
    assert_eq!(a.motion().events().len(), b.motion().events().len());
    assert!(!a.motion().events().is_empty());
    let off = [
        apart(&a.start().q, &b.start().q),
        apart(&a.start().p, &b.start().p),
    ];
    assert!(off[0] <= 1e-10 && off[1] <= 1e-10, "{off:?}");
    assert_eq!(a.trivial(), b.trivial());
    assert_eq!(a.multipliers().len(), b.multipliers().len());
    for (a, b) in a.multipliers().iter().zip(b.multipliers()) {
        assert!((a - b).norm() <= 1e-8, "{a} {b}");
    }
    let off = apart(&a.monodromy(), &b.monodromy());
    assert!(off <= 1e-8, "{off:e}");
    assert_eq!(long.parameters(), fixed.parameters());
    for name in long.parameters() {
        let (a, b) = (long.by(name), fixed.by(name));
        assert!((a.period() - b.period()).abs() <= 1e-8, "{name}");
        let off = [
            apart(&a.start().q, &b.start().q),
            apart(&a.start().p, &b.start().p),
        ];
        assert!(off[0] <= 1e-8 && off[1] <= 1e-8, "{name}: {off:?}");
        // Differences, which are given where two orders agree to 1e-7.
        for (a, b) in a.multipliers().iter().zip(b.multipliers()) {
            if let (Some(a), Some(b)) = (a, b) {
                assert!(
                    (a - b).norm() <= 1e-5 * b.norm().max(1.0),
                    "{name}: {a} {b}"
                );
            }
        }
    }
}

#[test]
fn orbits_with_impacts_are_those_of_fixed_size() {
    let (m, k, s, c, f, w, omega) = (1.1, 1.2, 0.05, 0.1, 1.0, 0.05, 2.6);
    let row = Row {
        n: 2,
        m,
        k,
        s,
        c,
        f,
        w,
        omega,
    };
    let pair = Pair {
        m,
        k,
        s,
        c,
        f,
        w,
        omega,
    };
    let start = pair.state([-0.08, -0.01], [0.6, 0.0]);
    let run = Simulation::new(&row).element(Mixed::<8>);
    let run = run.on("wall", Crossing::Falling, |event| {
        Act::Restart(event.after_impact(0.8))
    });
    let beside = Simulation::new(&pair).element(Mixed::<8>);
    let beside = beside.on("wall", Crossing::Falling, |event| {
        Act::Restart(event.after_impact(0.8))
    });
    let ours = PeriodicOrbit::of_simulation(&run)
        .start_time(0.9)
        .period(TAU / omega)
        .guess_from(of_heap(&start));
    let theirs = PeriodicOrbit::of_simulation(&beside)
        .start_time(0.9)
        .period(TAU / omega)
        .guess_from(start);
    let ours_found = ours.solve_sensitive().expect("an orbit");
    let theirs_found = theirs.solve_sensitive().expect("an orbit");
    check_same(&ours_found, &theirs_found);
    assert!(ours_found.by_period().is_some());
    // A row of another length than the model.
    let error = ours.advance(vec![0.0; 3]).solve();
    let told = error
        .map(|orbit| orbit.period())
        .expect_err("three numbers");
    assert!(matches!(told, OrbitError::Run(_)), "{told}");
}

#[test]
fn orbits_with_impacts_and_constraints_are_those_of_fixed_size() {
    let (m, k, s, c, f, w, r, omega) = (1.1, 1.2, 0.05, 0.1, 1.0, 0.05, 5.0, 2.6);
    let row = OnCircles {
        n: 2,
        m,
        k,
        s,
        c,
        f,
        w,
        r,
        omega,
    };
    let pair = PairOnCircles {
        m,
        k,
        s,
        c,
        f,
        w,
        r,
        omega,
    };
    // Near the circles, and not on them.
    let start = pair.state([-0.07, -0.01, -4.99, -5.0], [0.58, 0.0, 0.0, 0.0]);
    let run = Simulation::new(&row).element(Mixed::<8>);
    let run = run.on("wall", Crossing::Falling, |event| {
        Act::Restart(event.after_impact(0.8))
    });
    let beside = Simulation::new(&pair).element(Mixed::<8>);
    let beside = beside.on("wall", Crossing::Falling, |event| {
        Act::Restart(event.after_impact(0.8))
    });
    let ours = PeriodicOrbit::of_simulation(&run)
        .start_time(0.9)
        .period(TAU / omega)
        .guess_from(of_heap(&start));
    let theirs = PeriodicOrbit::of_simulation(&beside)
        .start_time(0.9)
        .period(TAU / omega)
        .guess_from(start);
    let ours = ours.solve_sensitive().expect("an orbit");
    let theirs = theirs.solve_sensitive().expect("an orbit");
    check_same(&ours, &theirs);
    assert_eq!(ours.orbit().multipliers().len(), 4, "no zeros");
    let residual = ours.orbit().motion().constraint_residual();
    assert!(residual.position <= 1e-12, "{residual:?}");
}

#[test]
fn orbits_of_unknown_period_are_those_of_fixed_size() {
    let (m, k, b, c) = (1.1, 1.2, 0.3, 0.1);
    let (clocks, clock) = (Clocks { n: 1, m, k, b, c }, Clock { m, k, b, c });
    let start = clock.state([0.8], [0.1]);
    let run = Simulation::new(&clocks).element(Mixed::<8>);
    let run: family::Simulation<'_, Clocks> = run.on("middle", Crossing::Rising, |event| {
        Act::Impulse(vec![0.5 / (1.0 + event.v[0])])
    });
    let beside = Simulation::new(&clock).element(Mixed::<8>);
    let beside = beside.on("middle", Crossing::Rising, |event| {
        Act::Impulse([0.5 / (1.0 + event.v[0])])
    });
    let ours = PeriodicOrbit::of_simulation(&run)
        .unknown_period(6.0)
        .guess_from(of_heap(&start));
    let theirs = PeriodicOrbit::of_simulation(&beside)
        .unknown_period(6.0)
        .guess_from(start);
    let ours = ours.solve_sensitive().expect("an orbit");
    let theirs = theirs.solve_sensitive().expect("an orbit");
    check_same(&ours, &theirs);
    assert!(ours.by_period().is_none());
    assert_eq!(ours.orbit().trivial().len(), 1);
}
