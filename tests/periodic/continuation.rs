//! Branches of periodic orbits: folds, period doublings, torus bifurcations, and agreement with orbits that are solved
//! one by one.

use crate::common::larger;
use crate::models::{Duffing, HenonHeiles, PENDULUM, VanDerPol, pendulum_period};
use nalgebra::Complex;
use std::f64::consts::TAU;
use tfe::continuation::{Branch, End, EventKind, Point};
use tfe::periodic::Verdict;
use tfe::prelude::*;

#[dynamics(coordinates(x), lagrangian = dot(x)^2/2 - x^2/2,
           force(x) = mu*(1 - x^2)*dot(x) + f*cos(omega*t), sensitivity(omega, f))]
#[derive(Clone)]
struct ForcedVanDerPol {
    mu: f64,
    f: f64,
    omega: f64,
}

/// A hardening oscillator on one side of its resonance.
pub(crate) const HARDENING: Duffing = Duffing {
    alpha: 1.0,
    beta: 1.0,
    delta: 0.1,
    f: 0.5,
    omega: 0.8,
};

/// The response of the hardening oscillator over ω, from one side of the resonance to the other.
fn response(elements: usize) -> Branch<Duffing, 1> {
    Continuation::of(&HARDENING)
        .parameter(|duffing| &mut duffing.omega)
        .range(0.8..3.5)
        .element(Mixed::<5>)
        .elements(elements)
        .period(|duffing| TAU / duffing.omega)
        .guess(|t| ([(0.8 * t).cos()], [-0.8 * (0.8 * t).sin()]))
        .run()
        .expect("a branch")
}

pub(crate) fn kinds<M: Model<N>, const N: usize>(branch: &Branch<M, N>) -> Vec<EventKind> {
    branch.events().iter().map(|event| event.kind).collect()
}

/// The kinds of the events of a branch that finer elements confirm as a whole.
#[track_caller]
pub(crate) fn resolved<M: Model<N>, const N: usize>(branch: &Branch<M, N>) -> Vec<EventKind> {
    assert!(branch.warnings().is_empty(), "{:?}", branch.warnings());
    assert!(branch.events().iter().all(|event| event.resolved));
    kinds(branch)
}

#[track_caller]
pub(crate) fn close(value: f64, expected: f64, tolerance: f64) {
    assert!(
        (value - expected).abs() <= tolerance,
        "{value:e} instead of {expected:e}"
    );
}

#[test]
fn both_folds_of_a_hardening_resonance() {
    let (coarse, fine) = (response(40), response(80));
    assert_eq!(resolved(&coarse), [EventKind::Fold, EventKind::Fold]);
    assert_eq!(coarse.end(), Some(End::Range));
    assert_eq!(kinds(&fine), kinds(&coarse));
    for (coarse, fine) in coarse.events().iter().zip(fine.events()) {
        // Eighth order: (2π/40)⁸ is 4e-7, and with the small constant of five nodes the error is below 1e-11.
        close(coarse.point.parameter, fine.point.parameter, 1e-10);
        // The fold is found as the zero of dλ/ds, which is linear there, as is 1 − μ. From λ alone, which has an
        // extremum there, it would be known to the square root of the rounding unit only.
        close(fine.point.multipliers[0].re, 1.0, 1e-11);
        close(fine.point.tangent.parameter, 0.0, 1e-11);
        assert!(fine.width < 1e-12);
    }
    let [upper, lower] = [0, 1].map(|k| coarse.events()[k].point.parameter);
    assert!(upper > lower);
    for (k, point) in coarse.points().iter().enumerate() {
        let between = (coarse.events()[0].after + 1..=coarse.events()[1].after).contains(&k);
        assert_eq!(point.is_stable(), !between, "point {k}");
    }
    let [first, last] = [coarse.points().first(), coarse.points().last()].map(|end| {
        let end = end.expect("points");
        end.parameter
    });
    assert_eq!([first, last], [0.8, 3.5]);
}

#[test]
fn orbits_of_a_branch_are_those_solved_one_by_one() {
    let branch = response(40);
    let steps = branch.points().len() / 10;
    for k in (0..branch.points().len()).step_by(steps) {
        let (point, model) = (&branch.points()[k], branch.model(k).expect("a model"));
        assert_eq!(model.omega, point.parameter);
        assert_eq!(point.period, TAU / point.parameter);
        let orbit = branch.orbit(k).expect("an orbit");
        let alone = PeriodicOrbit::of(model)
            .element(Mixed::<5>)
            .elements(40)
            .period(point.period)
            .guess_from(point.start)
            .solve()
            .expect("an orbit");
        // The tolerance of Newton's method, times the sensitivity near folds.
        close(alone.start().q[0], point.start.q[0], 1e-11);
        close(alone.start().p[0], point.start.p[0], 1e-11);
        assert_eq!(alone.multipliers().len(), orbit.multipliers().len());
        for (one, other) in alone.multipliers().iter().zip(orbit.multipliers()) {
            close((one - other).norm(), 0.0, 1e-10);
        }
        let largest = orbit.motion();
        let largest = (0..=2000).map(|k| {
            let t = point.period * f64::from(k) / 2000.0;
            largest.at(t).expect("in the period").q[0]
        });
        // The response is symmetric: half of the range is the maximum. The largest of 2000 samples misses it by
        // (2π/2000)²/8 of it.
        close(largest.fold(0.0, larger), point.amplitudes[0], 4e-6);
    }
    assert!(branch.orbit(branch.points().len()).is_none());
    assert!(branch.event_orbit(1).is_some() && branch.event_orbit(2).is_none());
}

#[test]
fn the_tangent_is_the_derivative_of_solved_orbits() {
    let branch = response(40);
    let point = &branch.points()[7];
    let at = |omega: f64| {
        let model = Duffing {
            omega,
            ..branch.model(7).expect("a model").clone()
        };
        let orbit = PeriodicOrbit::of(&model)
            .element(Mixed::<5>)
            .elements(40)
            .period(TAU / omega)
            .guess_from(point.start)
            .solve()
            .expect("an orbit");
        orbit.start()
    };
    let step = 1e-4;
    let (low, high) = (at(point.parameter - step), at(point.parameter + step));
    let slope = point.tangent.parameter;
    let by_omega = [
        point.tangent.start.q[0] / slope,
        point.tangent.start.p[0] / slope,
    ];
    // The error of a central difference: step² times a third derivative, and 1e-13 of the solution divided by the step.
    close(by_omega[0], (high.q[0] - low.q[0]) / (2.0 * step), 1e-6);
    close(by_omega[1], (high.p[0] - low.p[0]) / (2.0 * step), 1e-6);
    // The derivative of the period, by a central difference as well.
    let by_omega = -TAU / point.parameter.powi(2);
    close(point.tangent.period / slope, by_omega, 1e-7);
}

#[test]
fn a_period_doubles_in_one_well() {
    let well = Duffing {
        alpha: -1.0,
        beta: 1.0,
        delta: 0.3,
        f: 0.05,
        omega: 1.2,
    };
    let branch = Continuation::of(&well)
        .parameter(|well| &mut well.f)
        .range(0.05..0.3)
        .element(Mixed::<5>)
        .elements(60)
        .period(|well| TAU / well.omega)
        .guess(|_| ([1.0], [0.0]))
        .run()
        .expect("a branch");
    assert_eq!(resolved(&branch), [EventKind::PeriodDoubling]);
    let event = &branch.events()[0];
    close(event.point.multipliers[0].re, -1.0, 1e-11);
    assert!(event.width < 1e-12);
    // Beyond the event, the orbit with the period of the force has lost its stability to one of twice the period, to
    // which motions converge.
    let beyond = Duffing {
        f: event.point.parameter + 2e-3,
        ..well
    };
    let period = TAU / beyond.omega;
    let single = PeriodicOrbit::of(&beyond)
        .element(Mixed::<5>)
        .elements(60)
        .period(period)
        .guess_from(event.point.start)
        .solve()
        .expect("an orbit");
    assert!(!single.is_stable());
    let settled = Simulation::new(&beyond)
        .element(Mixed::<5>)
        .step(period / 40.0)
        .run(event.point.start, 0.0..600.0 * period)
        .expect("a motion");
    let double = PeriodicOrbit::of(&beyond)
        .element(Mixed::<5>)
        .elements(120)
        .period(2.0 * period)
        .guess_from(settled.last().state())
        .solve()
        .expect("an orbit");
    assert!(double.is_stable());
    let halfway = double.nodes()[60];
    let apart = (halfway.q[0] - double.start().q[0]).hypot(halfway.p[0] - double.start().p[0]);
    // The distance grows as the square root of 2e-3.
    assert!(apart > 1e-2, "{apart}");
}

#[test]
fn locking_is_lost_to_a_torus() {
    let forced = ForcedVanDerPol {
        mu: 0.2,
        f: 1.0,
        omega: 1.0,
    };
    let at = |model: &ForcedVanDerPol| {
        let omega = model.omega;
        let orbit = PeriodicOrbit::of(model)
            .element(Mixed::<5>)
            .elements(40)
            .period(TAU / omega)
            .guess(|t| {
                (
                    [-1.4 * (omega * t).cos()],
                    [1.4 * omega * (omega * t).sin()],
                )
            })
            .solve()
            .expect("an orbit");
        orbit.verdict()
    };
    let branch = Continuation::of(&forced)
        .parameter(|forced| &mut forced.omega)
        .range(1.0..2.0)
        .element(Mixed::<5>)
        .elements(40)
        .period(|forced| TAU / forced.omega)
        .guess(|t| ([2.0 * t.sin()], [2.0 * t.cos()]))
        .run()
        .expect("a branch");
    assert_eq!(resolved(&branch), [EventKind::Torus]);
    let torus = &branch.events()[0].point;
    assert!(torus.multipliers[0].im != 0.0);
    close(torus.multipliers[0].norm(), 1.0, 1e-12);
    // By averaging for small μ, locking is lost where the amplitude is 2/√2; the correction is of order μ².
    close(torus.amplitudes[0], 2.0_f64.sqrt(), 0.2 * 0.2 * 0.1);
    let beside = |by: f64| {
        at(&ForcedVanDerPol {
            omega: torus.parameter + by,
            ..forced
        })
    };
    assert!(matches!(beside(-1e-3), Verdict::Stable { .. }));
    assert!(matches!(beside(1e-3), Verdict::Unstable { .. }));
}

#[test]
fn a_symmetric_response_meets_one_that_is_not() {
    let rest = Duffing {
        alpha: 1.0,
        beta: 1.0,
        delta: 0.1,
        f: 0.0,
        omega: 1.0,
    };
    let run = |step: f64| {
        Continuation::of(&rest)
            .parameter(|duffing| &mut duffing.f)
            .range(0.0..4.0)
            .element(Mixed::<5>)
            .elements(60)
            .period(|duffing| TAU / duffing.omega)
            .largest_step(step)
            .run()
            .expect("a branch")
    };
    let (branch, other) = (run(0.2), run(0.11));
    assert_eq!(resolved(&branch), [EventKind::Branch]);
    assert_eq!(kinds(&other), [EventKind::Branch]);
    let (event, again) = (&branch.events()[0], &other.events()[0]);
    // Interpolated between different points each time.
    close(event.point.parameter, again.point.parameter, 1e-9);
    assert!(event.width < 1e-7);
    close(event.point.multipliers[0].re, 1.0, 1e-9);
    let beyond = Duffing {
        f: event.point.parameter + 0.02,
        ..rest
    };
    let orbit = |shift: f64| {
        let start = event.point.start;
        let shifted = State {
            q: [start.q[0] + shift],
            p: [start.p[0] + shift],
        };
        let settled = Simulation::new(&beyond)
            .element(Mixed::<5>)
            .step(TAU / 40.0)
            .run(shifted, 0.0..400.0 * TAU)
            .expect("a motion");
        PeriodicOrbit::of(&beyond)
            .element(Mixed::<5>)
            .elements(60)
            .period(TAU)
            .guess_from(settled.last().state())
            .solve()
            .expect("an orbit")
    };
    let [one, mirrored] = [orbit(0.05), orbit(-0.05)];
    assert!(one.is_stable() && mirrored.is_stable());
    // A symmetric orbit is its own opposite after half a period; these two are the opposites of each other.
    let [one, half, mirrored] = [one.nodes()[0], one.nodes()[30], mirrored.nodes()[0]];
    assert!((one.q[0] + half.q[0]).hypot(one.p[0] + half.p[0]) > 0.05);
    let paired =
        (mirrored.q[0] + half.q[0]).abs() < 1e-9 || (mirrored.q[0] - one.q[0]).abs() < 1e-9;
    assert!(paired);
}

#[test]
fn a_limit_cycle_in_its_damping() {
    let cycle = VanDerPol::unit(1.0);
    let branch = Continuation::of(&cycle)
        .parameter(|cycle| &mut cycle.mu)
        .range(1.0..5.0)
        .element(Mixed::<6>)
        .elements(200)
        .unknown_period(6.6)
        .guess(|t| ([2.0 * t.cos()], [-2.0 * t.sin()]))
        .run()
        .expect("a branch");
    assert!(resolved(&branch).is_empty());
    assert!(branch.points().iter().all(Point::is_stable));
    let last = branch.points().last().expect("points");
    let stiff = VanDerPol::unit(5.0);
    let alone = PeriodicOrbit::of(&stiff)
        .element(Mixed::<6>)
        .elements(200)
        .unknown_period(11.6)
        .guess_from(last.start)
        .solve()
        .expect("an orbit");
    assert_eq!(last.parameter, 5.0);
    // The phases differ, and with them the positions of the elements: the difference is the error of the mesh.
    close(last.period, alone.period(), 1e-10);
    assert_eq!(last.trivial.len(), 1);
    // The derivative of the period of the first orbit by the parameter, compared with its neighbour.
    let near = VanDerPol::unit(1.0 + 1e-5);
    let near = PeriodicOrbit::of(&near)
        .element(Mixed::<6>)
        .elements(200)
        .unknown_period(6.6)
        .guess_from(branch.points()[0].start)
        .solve()
        .expect("an orbit");
    let tangent = branch.points()[0].tangent;
    let difference = (near.period() - branch.points()[0].period) / 1e-5;
    // A one-sided difference: 1e-5 times a second derivative.
    close(tangent.period / tangent.parameter, difference, 1e-5);
}

#[test]
fn conservative_orbits_of_one_energy_or_one_period() {
    let pendulum = PENDULUM;
    let continuation = || {
        Continuation::of(&pendulum)
            .parameter(|pendulum| &mut pendulum.k)
            .range(1.0..2.0)
            .element(Mixed::<5>)
            .elements(40)
            .guess(|t| ([1.2 * (0.9 * t).cos()], [-1.08 * (0.9 * t).sin()]))
    };
    let energy = -1.2_f64.cos();
    let branch = continuation().unknown_period(7.0).run().expect("a branch");
    assert!(branch.events().is_empty());
    for point in branch.points() {
        let expected = pendulum_period([1.0, point.parameter], energy);
        // Eighth order with elements of length T/40.
        close(point.period, expected, 1e-9);
        assert_eq!(point.trivial.len(), 2);
        assert!(point.is_stable());
    }
    let branch = continuation().period(|_| 7.0).run().expect("a branch");
    for (k, point) in branch.points().iter().enumerate() {
        let orbit = branch.orbit(k).expect("an orbit");
        let energy = orbit.motion().energies()[0];
        close(pendulum_period([1.0, point.parameter], energy), 7.0, 1e-8);
        assert!(
            orbit
                .unfolding()
                .is_some_and(|unfolding| unfolding.abs() < 1e-9)
        );
    }
}

#[test]
fn a_conservative_period_doubles_at_one_energy_scaled() {
    // With x → x/a, all energies are a⁻² times those of a = 1: only a² H matters.
    let run = |size: f64, start: f64| {
        let model = HenonHeiles { a: start };
        let branch = Continuation::of(&model)
            .parameter(|model| &mut model.a)
            .range(start..1.15 * 0.4 / size)
            .element(Mixed::<6>)
            .elements(60)
            .unknown_period(6.3)
            .guess(move |t| {
                let (sin, cos) = t.sin_cos();
                ([size * cos, size * sin], [-size * sin, size * cos])
            })
            .run()
            .expect("a branch");
        assert_eq!(resolved(&branch), [EventKind::PeriodDoubling]);
        let motion = branch.event_orbit(0).expect("an orbit").motion();
        let event = &branch.events()[0].point;
        // Two multipliers meet at −1: each is known to the square root of the rounding unit.
        let distances = event.multipliers.iter();
        let distances = distances.map(|one| (one + Complex::new(1.0, 0.0)).norm());
        assert!(distances.fold(f64::INFINITY, f64::min) < 1e-6);
        event.parameter.powi(2) * motion.energies()[0]
    };
    let [one, other] = [run(0.4, 0.5), run(0.3, 0.7)];
    // ∏ (μ + 1) is known up to rounding, although each μ is not.
    close(one, other, 1e-9);
}

#[test]
fn a_branch_as_a_table() {
    let branch = response(40);
    let path = std::env::temp_dir().join(format!("tfe-branch-{}.csv", std::process::id()));
    branch.write_csv(&path).expect("written");
    let text = std::fs::read_to_string(&path).expect("read");
    std::fs::remove_file(&path).expect("removed");
    let mut lines = text.lines();
    assert_eq!(
        lines.next(),
        Some(
            "omega,period,amplitude_x,multiplier1_re,multiplier1_im,multiplier2_re,multiplier2_im,stable"
        )
    );
    for (line, point) in lines.by_ref().zip(branch.points()) {
        let row: Vec<f64> = line
            .split(',')
            .map(|number| number.parse().expect("a number"))
            .collect();
        assert_eq!(row[0], point.parameter);
        assert_eq!(row[3], point.multipliers[0].re);
        assert_eq!(row[7] == 1.0, point.is_stable());
    }
    assert_eq!(text.lines().count(), branch.points().len() + 1);
}
