//! Periodic orbits with events of models with constraints, compared with the same motion in a minimal coordinate.

use std::f64::consts::TAU;
use tfe::periodic::HybridOrbits;
use tfe::prelude::*;

/// Orbits of a model that hits a wall, after which 0.8 of the speed is left.
pub(crate) fn impacting<'m, M, const N: usize>(
    model: &'m M,
    period: f64,
    guess: State<N>,
) -> HybridOrbits<'m, M, N>
where
    M: Model<N> + Send + Sync,
{
    let run: Simulation<'m, M, N> = Simulation::new(model);
    let run = run.element(Mixed::<8>);
    let run = run.on("wall", Crossing::Falling, |event| {
        Act::Restart(event.after_impact(0.8))
    });
    PeriodicOrbit::of_simulation(&run)
        .start_time(0.9)
        .period(period)
        .guess_from(guess)
}

/// A driven bead on a circle that hits a wall once per period, by its place and by its angle.
#[dynamics(
    coordinates(x, y),
    lagrangian = m/2*(dot(x)^2 + dot(y)^2) - k/2*x^2 + f*cos(omega*t)*x,
    constraint(circle) = x^2 + y^2 - r^2,
    force(x) = -c*dot(x),
    force(y) = -c*dot(y),
    event(wall) = w - x,
)]
struct Bead {
    m: f64,
    k: f64,
    c: f64,
    f: f64,
    w: f64,
    r: f64,
    omega: f64,
}

#[dynamics(
    coordinates(a),
    lagrangian = m/2*r^2*dot(a)^2 - k/2*r^2*sin(a)^2 + f*cos(omega*t)*r*sin(a),
    force(a) = -c*r^2*dot(a),
    event(wall) = w - r*sin(a),
)]
struct Angle {
    m: f64,
    k: f64,
    c: f64,
    f: f64,
    w: f64,
    r: f64,
    omega: f64,
}

#[test]
fn orbits_with_impacts_and_constraints_are_those_of_a_minimal_coordinate() {
    let (m, k, c, f, w, r, omega) = (1.1, 1.2, 0.1, 1.0, 0.05, 5.0_f64, 2.6);
    let bead = Bead {
        m,
        k,
        c,
        f,
        w,
        r,
        omega,
    };
    let angle = Angle {
        m,
        k,
        c,
        f,
        w,
        r,
        omega,
    };
    // Near the circle, and not on it.
    let start = bead.state([-0.07, -4.99], [0.58, 0.0]);
    let found = impacting(&bead, TAU / omega, start).solve_sensitive();
    let start = angle.state([-0.014], [0.117]);
    let expected = impacting(&angle, TAU / omega, start).solve_sensitive();
    let (found, expected) = (found.expect("an orbit"), expected.expect("an orbit"));
    let (orbit, other) = (found.orbit(), expected.orbit());
    assert_eq!(orbit.motion().events().len(), 1);
    assert_eq!(other.motion().events().len(), 1);
    assert!(orbit.motion().constraint_residual().position <= 1e-13);
    let (sin, cos) = other.start().q[0].sin_cos();
    let place = orbit.start().q;
    let off = [place[0] - r * sin, place[1] + r * cos].map(f64::abs);
    assert!(off[0] <= 1e-10 && off[1] <= 1e-10, "{off:?}");
    assert_eq!(orbit.multipliers().len(), 2, "no zeros");
    for (found, expected) in orbit.multipliers().iter().zip(other.multipliers()) {
        assert!((found - expected).norm() <= 1e-8, "{found} {expected}");
    }
    for name in found.parameters() {
        let (found, expected) = (found.by(name), expected.by(name));
        let turn = expected.start().q[0];
        let grown = if name == "r" { sin } else { 0.0 };
        let off = found.start().q[0] - (r * cos * turn + grown);
        assert!(off.abs() <= 1e-8, "{name}: {off:e}");
        // Differences, which are given where two orders agree to 1e-7.
        for (found, expected) in found.multipliers().iter().zip(expected.multipliers()) {
            if let (Some(found), Some(expected)) = (found, expected) {
                let off = (found - expected).norm();
                let size = expected.norm().max(1.0);
                assert!(off <= 1e-5 * size, "{name}: {found} {expected}");
            }
        }
    }
}

#[dynamics(
    coordinates(x),
    lagrangian = dot(x)^2/2 - x^2/2,
    force(x) = cos(omega*t) - c*dot(x),
    event(wall) = 10 - x,
)]
struct Far {
    omega: f64,
    c: f64,
}

/// Steps that are too long close another motion: the orbit has a warning. The motion is known in closed form.
#[test]
fn orbits_that_steps_do_not_resolve_are_told() {
    let model = Far { omega: 1.4, c: 0.2 };
    let run = Simulation::new(&model).on("wall", Crossing::Falling, |_| Act::Stop);
    let of = |periods: f64, elements: usize| {
        let orbit = PeriodicOrbit::of_simulation(&run).elements(elements);
        let orbit = orbit.period(periods * TAU / model.omega);
        orbit.solve().expect("an orbit")
    };
    // The real part of e^{iωt}/(1 − ω² + icω) at t = 0.
    let (real, imaginary) = (1.0 - model.omega.powi(2), model.c * model.omega);
    let (start, size) = (
        real / (real * real + imaginary * imaginary),
        1.0 / real.hypot(imaginary),
    );
    let near = of(1.0, 40);
    assert_eq!(near.warnings(), []);
    assert!((near.start().q[0] - start).abs() <= 1e-6);
    let far = of(100.0, 40);
    let off = (far.start().q[0] - start).abs();
    assert!(off > 0.1 * size, "{off}");
    assert_eq!(far.warnings().len(), 1);
    let told = far.warnings()[0].to_string();
    assert!(
        told.starts_with("40 elements do not resolve the motion"),
        "{told}"
    );
}
