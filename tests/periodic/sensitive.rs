//! Derivatives of periodic orbits and of boundary-value problems, compared with differences of solutions.

use crate::differences::{difference, difference_over};
use crate::hybrid::impacting;
use crate::models::{Duffing, Pendulum, VanDerPol, pendulum_period as period};
use nalgebra::Complex;
use std::f64::consts::TAU;
use tfe::boundary::Component::{Coordinate, Momentum};
use tfe::boundary::SensitiveBoundaryMotion;
use tfe::periodic::{HybridOrbit, HybridOrbits, OrbitSlopes};
use tfe::prelude::*;

#[track_caller]
fn close(found: f64, expected: f64, allowed: f64) {
    let error = (found - expected).abs() / expected.abs().max(1.0);
    assert!(
        error < allowed,
        "{found} instead of {expected}: {error:.1e}"
    );
}

/// The period, the initial state and one of the multipliers, as numbers.
fn row(period: f64, start: State<1>, multiplier: Complex<f64>) -> [f64; 5] {
    let (q, p) = (start.q[0], start.p[0]);
    [period, q, p, multiplier.re, multiplier.im]
}

fn of_orbit<M: Model<1>>(orbit: &PeriodicOrbit<'_, M, 1>, place: usize) -> [f64; 5] {
    let orbit = orbit.solve().expect("an orbit");
    row(orbit.period(), orbit.start(), orbit.multipliers()[place])
}

fn of_slopes(slopes: &OrbitSlopes<1>, place: usize) -> [f64; 5] {
    let multiplier = slopes.multipliers()[place].expect("it stands alone");
    row(slopes.period(), slopes.start(), multiplier)
}

fn of_hybrid(orbit: &HybridOrbit<1>, place: usize) -> [f64; 5] {
    row(orbit.period(), orbit.start(), orbit.multipliers()[place])
}

/// A tight tolerance, so that differences contain rounding errors only.
fn tight<'m, M: Model<1>>(model: &'m M, guess: State<1>) -> PeriodicOrbit<'m, M, 1> {
    PeriodicOrbit::of(model)
        .element(Mixed::<6>)
        .elements(40)
        .guess_from(guess)
        .tolerance(1e-13)
}

#[track_caller]
fn compare<const K: usize>(found: [f64; K], expected: [f64; K], allowed: f64) {
    for k in 0..K {
        close(found[k], expected[k], allowed);
    }
}

/// A limit cycle with unknown period whose start is a turning point: the phase condition contributes to the
/// derivatives.
#[test]
fn a_limit_cycle_by_its_damping() {
    fn cycle(model: &VanDerPol) -> PeriodicOrbit<'_, VanDerPol, 1> {
        let turning = tfe::periodic::Phase::Momentum {
            index: 0,
            value: 0.0,
        };
        tight(model, model.state([2.0], [0.0]))
            .unknown_period(6.7)
            .phase(turning)
    }
    let model = VanDerPol::unit(0.8);
    let s = cycle(&model).solve_sensitive().expect("an orbit");
    let trivial = s.orbit().trivial();
    assert_eq!(trivial.len(), 1);
    let other = 1 - trivial[0];
    let expected = difference(|mu| of_orbit(&cycle(&VanDerPol::unit(mu)), other), 0.8);
    compare(of_slopes(s.by("mu"), other), expected, 1e-10);
    let zero = s.by("mu").multipliers()[trivial[0]];
    assert_eq!(zero.map(Complex::norm), Some(0.0));
    assert!(s.by_period().is_none() && s.get("nu").is_none());
}

/// A forced oscillation with complex multipliers, by all parameters; the frequency also changes the period.
#[test]
fn a_forced_oscillation_by_all_parameters() {
    fn response(model: &Duffing) -> PeriodicOrbit<'_, Duffing, 1> {
        tight(model, model.state([0.1], [0.2])).period(TAU / model.omega)
    }
    let model = Duffing {
        alpha: 1.0,
        beta: 0.7,
        delta: 0.2,
        f: 0.4,
        omega: 1.6,
    };
    let s = response(&model).solve_sensitive().expect("an orbit");
    assert!(s.orbit().multipliers()[0].im != 0.0);
    assert_eq!(s.parameters(), ["alpha", "beta", "delta", "f", "omega"]);
    let with = |index: usize, value: f64| model.with_parameter(index, value).expect("numbers");
    for (index, name) in s.parameters().iter().enumerate().take(4) {
        let expected = difference(
            |x| of_orbit(&response(&with(index, x)), 0),
            model.parameter(index),
        );
        compare(of_slopes(s.by(name), 0), expected, 1e-10);
        assert_eq!(s.by(name).period(), 0.0);
    }
    let expected = difference(|x| of_orbit(&response(&with(4, x)), 0), 1.6);
    let direct = of_slopes(s.by("omega"), 0);
    let stretched = of_slopes(s.by_period().expect("it is given"), 0);
    assert_eq!(stretched[0], 1.0);
    let rate = -TAU / (1.6 * 1.6);
    compare(
        std::array::from_fn(|k| direct[k] + rate * stretched[k]),
        expected,
        1e-10,
    );
}

/// A drag close to zero must give the same derivatives of multipliers as one that is zero.
#[test]
fn multipliers_by_a_parameter_next_to_zero() {
    let found = |delta: f64| {
        let model = Duffing {
            alpha: 1.0,
            beta: 0.7,
            delta,
            f: 0.4,
            omega: 1.6,
        };
        let orbit = tight(&model, model.state([-0.25], [0.0])).period(TAU / model.omega);
        let s = orbit.solve_sensitive().expect("an orbit");
        let mut multipliers = s.orbit().multipliers().iter();
        let place = multipliers.position(|one| one.im > 0.0).expect("a pair");
        of_slopes(s.by("delta"), place)
    };
    let expected = found(0.0);
    for delta in [1e-10, 1e-14, -1e-20, 1e-200] {
        compare(found(delta), expected, 1e-8);
    }
}

/// Orbits of a conservative model form families: with given energy the period changes, with given period the energy.
#[test]
fn a_free_swing_at_one_energy_and_at_one_period() {
    let (m, k, energy) = (1.1, 1.3, -0.5);
    let model = Pendulum { m, k };
    let swing = || tight(&model, model.state([1.2], [0.0]));
    let at_energy = swing().energy(energy).unknown_period(7.0);
    let s = at_energy.solve_sensitive().expect("an orbit");
    close(s.orbit().period(), period([m, k], energy), 1e-12);
    let [by_m] = difference(|m| [period([m, k], energy)], m);
    let [by_k] = difference(|k| [period([m, k], energy)], k);
    close(s.by("m").period(), by_m, 1e-10);
    close(s.by("k").period(), by_k, 1e-10);
    // With a given period the amplitude is A(T), and the initial state does not move along the flow.
    let period_then = s.orbit().period();
    let at_period = swing().period(period_then).solve_sensitive();
    let at_period = at_period.expect("an orbit");
    let energy_of = |start: State<1>, slope: State<1>| {
        k * start.q[0].sin() * slope.q[0] + start.p[0] / m * slope.p[0]
    };
    let start = at_period.orbit().start();
    // E changes with k by what keeps T constant, and by −cos θ at fixed initial state.
    let by_energy = {
        let [slope] = difference(|energy| [period([m, k], energy)], energy);
        -by_k / slope
    };
    let found = energy_of(start, at_period.by("k").start()) - start.q[0].cos();
    close(found, by_energy, 1e-9);
    let by_period = at_period.by_period().expect("it is given");
    let [slope] = difference(|energy| [period([m, k], energy)], energy);
    close(energy_of(start, by_period.start()), 1.0 / slope, 1e-9);
}

/// Two multipliers that meet have no derivatives, and none are returned.
#[test]
fn multipliers_that_meet_are_left_out() {
    #[dynamics(coordinates(x), lagrangian = dot(x)^2/2 - k*x^2/2, force(x) = -c*dot(x) + cos(t))]
    struct Damped {
        k: f64,
        c: f64,
    }
    // At critical damping both are exp(−2π).
    let critical = Damped { k: 1.0, c: 2.0 };
    let s = tight(&critical, critical.state([0.0], [0.5])).period(TAU);
    let s = s.solve_sensitive().expect("an orbit");
    assert_eq!(s.by("c").multipliers(), [None, None]);
    // x = sin t / c
    assert!((s.by("c").start().p[0] + 0.25).abs() < 1e-10);
    let other = Damped { k: 1.0, c: 0.5 };
    let s = tight(&other, other.state([0.0], [2.0])).period(TAU);
    let s = s.solve_sensitive().expect("an orbit");
    // |μ| = exp(−cT/2)
    let (own, slope) = (s.orbit().multipliers()[0], s.by("c").multipliers()[0]);
    let relative = slope.expect("alone") / own;
    close(relative.re, -TAU / 2.0, 1e-9);
}

/// A model without parameters can be differentiated by the given quantities only.
#[test]
fn models_without_parameters() {
    #[dynamics(coordinates(x), lagrangian = dot(x)^2/2 - x^2/2 - x^4/4)]
    struct Bare;
    let start = Bare.state([1.0], [0.0]);
    let s = tight(&Bare, start).unknown_period(4.8).solve_sensitive();
    let s = s.expect("an orbit");
    assert!(s.parameters().is_empty() && s.by_period().is_none());
    let s = tight(&Bare, start).period(s.orbit().period());
    let s = s.solve_sensitive().expect("an orbit");
    assert!(s.by_period().is_some());
    let arc = BoundaryValue::of(&Bare).from_to([0.0], [1.0], 0.0..1.0);
    let arc = arc.solve_sensitive().expect("a motion");
    assert!(arc.parameters().is_empty() && arc.by_end(Coordinate(0)).is_some());
}

/// With a constraint, by parameters of forces, of the pivot and of the constraint; compared with the equivalent model
/// in one angle.
#[test]
fn a_constrained_orbit_beside_its_twin() {
    #[dynamics(
        coordinates(x, y),
        lagrangian = (dot(x)^2 + dot(y)^2)/2 - g*y,
        force(x) = f*cos(omega*t) - c*dot(x),
        force(y) = -c*dot(y),
        constraint(rod) = x^2 + y^2 - l^2,
    )]
    struct Rod {
        g: f64,
        f: f64,
        c: f64,
        l: f64,
        omega: f64,
    }
    #[dynamics(
        coordinates(phi),
        lagrangian = l^2*dot(phi)^2/2 + g*l*cos(phi),
        force(phi) = l*cos(phi)*f*cos(omega*t) - c*l^2*dot(phi),
    )]
    struct Angle {
        g: f64,
        f: f64,
        c: f64,
        l: f64,
        omega: f64,
    }
    let (g, f, c, l, omega) = (1.0, 0.3, 0.15, 1.2, 1.4);
    let angle = Angle { g, f, c, l, omega };
    let rod = Rod { g, f, c, l, omega };
    let twin = tight(&angle, angle.state([0.1], [0.3]))
        .period(TAU / omega)
        .solve_sensitive()
        .expect("an orbit");
    let start = twin.orbit().start();
    let (phi, rate) = (start.q[0], start.p[0] / (l * l));
    let guess = rod.state(
        [l * phi.sin(), -l * phi.cos()],
        [l * phi.cos() * rate, l * phi.sin() * rate],
    );
    let s = PeriodicOrbit::of(&rod)
        .element(Mixed::<6>)
        .elements(40)
        .tolerance(1e-13)
        .period(TAU / omega)
        .guess_from(guess)
        .solve_sensitive()
        .expect("an orbit");
    for name in ["g", "f", "c", "l"] {
        let (ours, theirs) = (s.by(name), twin.by(name));
        // φ = atan2(x, −y): elements of tenth order of different models agree to 1e-9.
        let (found, theirs_start) = (ours.start(), theirs.start());
        let along = (phi.cos() * found.q[0] + phi.sin() * found.q[1]) / l;
        close(along, theirs_start.q[0], 1e-8);
        let across = phi.sin() * found.q[0] - phi.cos() * found.q[1];
        close(across, f64::from(name == "l"), 1e-9);
        for place in 0..2 {
            let found = ours.multipliers()[place].expect("alone");
            let expected = theirs.multipliers()[place].expect("alone");
            let own = s.orbit().multipliers()[place];
            let same = own.im * twin.orbit().multipliers()[place].im >= 0.0;
            assert!(same && (found - expected).norm() < 1e-7 * expected.norm().max(1.0));
        }
    }
}

#[dynamics(
    coordinates(x, y),
    lagrangian = m/2*(dot(x)^2 + dot(y)^2) + mu*m/sqrt(x^2 + y^2),
    force(x) = -c*dot(x),
)]
#[derive(Clone)]
struct Transfer {
    m: f64,
    mu: f64,
    c: f64,
}

fn transfer(
    model: &Transfer,
    [x, y, to, end]: [f64; 4],
    by_momentum: bool,
) -> SensitiveBoundaryMotion<'_, Transfer, 2> {
    let base = BoundaryValue::of(model)
        .element(Mixed::<6>)
        .elements(30)
        .tolerance(1e-13)
        .guess(|t| {
            let (sin, cos) = t.sin_cos();
            ([cos, sin], [-sin, cos])
        })
        .span(0.0..1.9)
        .start(Coordinate(0), x)
        .start(Coordinate(1), y)
        .end(Coordinate(0), to);
    match by_momentum {
        true => base.end(Momentum(1), end - 1.0),
        false => base.end(Coordinate(1), end),
    }
    .solve_sensitive()
    .expect("a motion")
}

/// From one position to another around a centre; and with a given momentum at the end.
#[test]
fn solutions_between_ends_by_parameters_and_by_their_ends() {
    let model = Transfer {
        m: 1.2,
        mu: 1.1,
        c: 0.05,
    };
    let ends = [1.0, 0.1, -0.4, 0.9];
    for by_momentum in [false, true] {
        let s = transfer(&model, ends, by_momentum);
        let nodes = |s: &SensitiveBoundaryMotion<'_, Transfer, 2>| {
            let nodes = s.solved().nodes();
            let [a, b, c] = [0, 13, 30].map(|at| nodes[at].state());
            let all = [a, b, c].map(|one| [one.q[0], one.q[1], one.p[0], one.p[1]]);
            all.concat().try_into().expect("twelve numbers")
        };
        let slopes = |all: &[State<2>]| -> [f64; 12] {
            let of = [0, 13, 30].map(|at| all[at]);
            let all = of.map(|one| [one.q[0], one.q[1], one.p[0], one.p[1]]);
            all.concat().try_into().expect("twelve numbers")
        };
        for (index, name) in s.parameters().iter().enumerate() {
            let expected: [f64; 12] = difference(
                |x| {
                    let other = model.with_parameter(index, x).expect("numbers");
                    nodes(&transfer(&other, ends, by_momentum))
                },
                model.parameter(index),
            );
            compare(slopes(s.by(name)), expected, 1e-9);
        }
        let last = if by_momentum {
            Momentum(1)
        } else {
            Coordinate(1)
        };
        let given = [
            s.by_start(Coordinate(0)),
            s.by_start(Coordinate(1)),
            s.by_end(Coordinate(0)),
            s.by_end(last),
        ];
        for (k, found) in given.into_iter().enumerate() {
            let expected: [f64; 12] = difference(
                |x| {
                    let mut ends = ends;
                    ends[k] = x;
                    nodes(&transfer(&model, ends, by_momentum))
                },
                ends[k],
            );
            compare(slopes(found.expect("it was given")), expected, 1e-9);
        }
        assert!(s.by_start(Momentum(0)).is_none() && s.get("mass").is_none());
    }
}

/// An oscillator that hits a wall once per period, with a parameter of the impact.
#[dynamics(
    coordinates(x),
    lagrangian = (m*dot(x)^2 - k*x^2)/2 + f*cos(omega*t)*x,
    force(x) = -c*dot(x),
    event(wall) = w - x,
)]
#[derive(Clone)]
struct Impacting {
    m: f64,
    k: f64,
    c: f64,
    f: f64,
    w: f64,
    omega: f64,
}

/// A clock: each swing upwards through the middle gets an impulse that depends on the speed.
#[dynamics(coordinates(x), lagrangian = (m*dot(x)^2 - k*x^2)/2 - b*x^4/4, force(x) = -c*dot(x), event(middle) = x)]
#[derive(Clone)]
struct Clock {
    m: f64,
    k: f64,
    b: f64,
    c: f64,
}

#[test]
fn orbits_with_impacts_by_all_parameters() {
    fn orbits(model: &Impacting) -> HybridOrbits<'_, Impacting, 1> {
        let guess = model.state([-0.41], [0.3]);
        impacting(model, TAU / model.omega, guess)
    }
    let model = Impacting {
        m: 1.1,
        k: 1.2,
        c: 0.1,
        f: 1.0,
        w: 0.05,
        omega: 2.6,
    };
    let s = orbits(&model).solve_sensitive().expect("an orbit");
    assert_eq!(s.orbit().motion().events().len(), 1);
    let with = |index: usize, value: f64| model.with_parameter(index, value).expect("numbers");
    let by_period = of_slopes(s.by_period().expect("it is given"), 0);
    for (index, name) in s.parameters().iter().enumerate() {
        // With a smaller spacing of differences: the multipliers are close to where they meet.
        let expected = difference_over(
            1e-3 * model.parameter(index),
            |x| of_hybrid(&orbits(&with(index, x)).solve().expect("an orbit"), 0),
            model.parameter(index),
        );
        let rate = if name == "omega" {
            -TAU / 2.6_f64.powi(2)
        } else {
            0.0
        };
        let direct = of_slopes(s.by(name), 0);
        let found: [f64; 5] = std::array::from_fn(|k| direct[k] + rate * by_period[k]);
        compare(found, expected, 1e-8);
    }
}

#[test]
fn a_clock_by_all_parameters() {
    fn orbits(model: &Clock) -> HybridOrbits<'_, Clock, 1> {
        let kick = |event: &tfe::Occurrence<'_, 1>| Act::Impulse([0.5 / (1.0 + event.v[0])]);
        let simulation =
            Simulation::new(model)
                .element(Mixed::<8>)
                .on("middle", Crossing::Rising, kick);
        PeriodicOrbit::of_simulation(&simulation)
            .unknown_period(6.0)
            .guess_from(model.state([0.8], [0.1]))
    }
    let model = Clock {
        m: 1.1,
        k: 1.2,
        b: 0.3,
        c: 0.1,
    };
    let s = orbits(&model).solve_sensitive().expect("an orbit");
    assert!(s.by_period().is_none());
    let other = 1 - s.orbit().trivial()[0];
    for (index, name) in s.parameters().iter().enumerate() {
        let with = |value: f64| model.with_parameter(index, value).expect("numbers");
        let expected = difference(
            |x| {
                let orbit = orbits(&with(x)).solve().expect("an orbit");
                let other = 1 - orbit.trivial()[0];
                of_hybrid(&orbit, other)
            },
            model.parameter(index),
        );
        // The starting point of an orbit is arbitrary: it may have moved along the orbit.
        let found = of_slopes(s.by(name), other);
        close(found[0], expected[0], 1e-9);
        close(found[3], expected[3], 1e-8);
    }
}

/// An orbit of forty periods of the force has forgotten its initial state at its end. The derivative of the initial
/// state by the period is therefore the velocity there, with ẍ = f cos 0 − δ ẋ − x.
#[test]
fn a_period_of_many_turns_changes_the_start_as_one_does() {
    let model = Duffing {
        alpha: 1.0,
        beta: 0.0,
        delta: 0.2,
        f: 0.3,
        omega: 1.4,
    };
    let simulation = Simulation::new(&model).element(Mixed::<6>);
    let s = PeriodicOrbit::of_simulation(&simulation)
        .elements(320)
        .period(40.0 * TAU / model.omega)
        .guess_from(model.state([-0.288], [0.1176]))
        .solve_sensitive()
        .expect("an orbit");
    let start = s.orbit().start();
    let by_period = s.by_period().expect("it is given").start();
    // Except for the remaining effect of the initial state, e^{−0.1 T} = 2e-8.
    close(by_period.q[0], start.p[0], 1e-6);
    let rate = 0.3 - 0.2 * start.p[0] - start.q[0];
    close(by_period.p[0], rate, 1e-6);
}
