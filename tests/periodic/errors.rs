//! Invalid problems, and those without a solution, are typed errors.

use crate::common::larger;
use crate::models::{Duffing, FORCED, PENDULUM, Projectile, VanDerPol, response};
use std::f64::consts::{PI, TAU};
use tfe::boundary::{BoundaryError, Component};
use tfe::periodic::{OrbitError, Phase};
use tfe::prelude::*;
use tfe::{AssemblyError, MeshError};

#[test]
fn orbits_that_are_ill_posed() {
    let cycle = VanDerPol::unit(1.0);
    let forced = FORCED;
    let circle = |t: f64| ([2.0 * t.cos()], [-2.0 * t.sin()]);
    let problem = || PeriodicOrbit::of(&cycle).guess(circle);
    assert!(matches!(problem().solve(), Err(OrbitError::NoPeriod)));
    for period in [0.0, -1.0, 5e-324, f64::NAN, f64::INFINITY] {
        let told = problem().unknown_period(period).solve().err();
        let told = told.expect("no period");
        assert!(matches!(told, OrbitError::Period { .. }), "{told}");
        assert!(told.to_string().len() < 80, "{told}");
    }
    let error = PeriodicOrbit::of(&forced).unknown_period(4.0).solve();
    assert!(matches!(error, Err(OrbitError::ForcedPeriod)));
    for value in [f64::NAN, f64::INFINITY] {
        let of_phase = Phase::Coordinate { index: 0, value };
        for wrong in [
            problem().start_time(value),
            problem().energy(value),
            problem().phase(of_phase),
            problem().advance([value]),
        ] {
            let error = wrong.unknown_period(6.0).solve();
            assert!(matches!(error, Err(OrbitError::Number { .. })));
        }
        let hybrid = PeriodicOrbit::of_simulation(&Simulation::new(&cycle))
            .unknown_period(6.0)
            .advance([value])
            .solve();
        let what = "advance";
        assert!(
            matches!(hybrid.err(), Some(OrbitError::Number { what: told, .. }) if told == what)
        );
    }
    let error = problem().unknown_period(6.0).elements(0).solve();
    assert!(matches!(
        error,
        Err(OrbitError::Mesh(MeshError::NoElements))
    ));
    let error = problem().unknown_period(6.0).graded([1.0, 0.0]).solve();
    assert!(matches!(
        error,
        Err(OrbitError::Mesh(MeshError::Weight { element: 1, .. }))
    ));
    let phase = Phase::Coordinate {
        index: 1,
        value: 0.0,
    };
    let error = problem().unknown_period(6.0).phase(phase).solve();
    assert!(matches!(error, Err(OrbitError::Phase { index: 1 })));
    let error = problem()
        .unknown_period(6.0)
        .element(Element::mixed(1))
        .solve();
    assert!(matches!(
        error,
        Err(OrbitError::Assembly(AssemblyError::Element(_)))
    ));
    // A limit cycle has one period only: with a given period that differs, the equations would need an additional
    // force.
    let error = problem().period(7.5).solve();
    assert!(
        matches!(error, Err(OrbitError::NoFamily { .. })),
        "{:?}",
        error.map(|_| ())
    );
}

/// The energy is determined otherwise: by the period, or by forces.
#[test]
fn an_energy_that_does_not_decide_is_refused() {
    let (pendulum, cycle) = (PENDULUM, VanDerPol::unit(1.0));
    let known = PeriodicOrbit::of(&pendulum)
        .period(7.0)
        .energy(-0.5)
        .guess_from(pendulum.state([1.0], [0.0]))
        .solve();
    let forced = PeriodicOrbit::of(&cycle)
        .unknown_period(6.6)
        .energy(2.0)
        .guess(|t| ([2.0 * t.cos()], [-2.0 * t.sin()]))
        .solve();
    for error in [known.err(), forced.err()] {
        assert!(
            matches!(error, Some(OrbitError::Unsupported { call: "energy", .. })),
            "{error:?}"
        );
    }
}

#[test]
fn orbits_that_do_not_exist() {
    let pendulum = PENDULUM;
    let rest = PeriodicOrbit::of(&pendulum).unknown_period(6.0).solve();
    // Every time is a period of an equilibrium, so that no period is distinguished.
    assert!(matches!(rest, Err(OrbitError::AtRest)));
    let far = VanDerPol::unit(1.0);
    let error = PeriodicOrbit::of(&far)
        .unknown_period(6.0)
        .guess(|t| ([2.0 * t.cos()], [-2.0 * t.sin()]))
        .max_iterations(2)
        .solve();
    match error {
        Err(OrbitError::Assembly(AssemblyError::Stalled {
            iterations: 2,
            correction,
            ..
        })) => {
            assert!(correction > 1e-13);
        }
        other => panic!("{:?}", other.map(|_| ())),
    }
    let not_a_number = PeriodicOrbit::of(&far)
        .unknown_period(6.0)
        .guess(|_| ([f64::NAN], [0.0]))
        .solve();
    assert!(matches!(
        not_a_number,
        Err(OrbitError::Assembly(AssemblyError::Linearise {
            element: 0,
            ..
        }))
    ));
    for error in [
        OrbitError::NoPeriod,
        OrbitError::ForcedPeriod,
        OrbitError::AtRest,
        OrbitError::NoFamily { unfolding: 0.3 },
        OrbitError::Phase { index: 3 },
    ] {
        assert!(error.to_string().len() > 20);
    }
    let stalled = OrbitError::Stalled {
        residual: 0.1,
        iterations: 50,
    };
    for (error, remedy) in [
        (OrbitError::Phase { index: 3 }, "indices begin with 0"),
        (OrbitError::Stopped { time: 0.5 }, "`Act::Restart`"),
        (stalled, "begin nearer to the orbit"),
        (
            AssemblyError::Singular { iterations: 7 }.into(),
            "after 7 iterations",
        ),
        (
            AssemblyError::Singular { iterations: 0 }.into(),
            "singular at the guess",
        ),
        (
            AssemblyError::Singular { iterations: 1 }.into(),
            "another guess",
        ),
    ] {
        let told = error.to_string();
        assert!(told.contains(remedy), "{told}");
    }
}

/// If an orbit is found it is the limit cycle, whose amplitude is 2. The equilibrium must not be returned, whether the
/// guess is there or the search leads there.
#[test]
fn a_state_of_rest_is_no_orbit_of_an_unknown_period() {
    let pendulum = PENDULUM;
    let turning = Phase::Momentum {
        index: 0,
        value: 0.0,
    };
    for angle in [0.0, PI] {
        for phase in [Phase::Orthogonal, turning] {
            let rest = PeriodicOrbit::of(&pendulum)
                .unknown_period(6.0)
                .guess(move |_| ([angle], [0.0]))
                .phase(phase)
                .solve();
            assert_eq!(rest.err(), Some(OrbitError::AtRest), "{angle} {phase:?}");
        }
        let nothing = PeriodicOrbit::of_simulation(&Simulation::new(&pendulum))
            .unknown_period(6.0)
            .elements(0)
            .solve();
        assert_eq!(nothing.err(), Some(OrbitError::Mesh(MeshError::NoElements)));
        let rest = PeriodicOrbit::of_simulation(&Simulation::new(&pendulum))
            .unknown_period(6.0)
            .guess_from(pendulum.state([angle], [0.0]))
            .solve();
        assert_eq!(rest.err(), Some(OrbitError::AtRest), "{angle}");
    }
    for mu in [1.0, -0.2] {
        let oscillator = VanDerPol::unit(mu);
        let simulation = Simulation::new(&oscillator);
        let near = |amplitude: f64, period: f64| {
            PeriodicOrbit::of_simulation(&simulation)
                .unknown_period(period)
                .guess_from(oscillator.state([amplitude], [0.0]))
                .solve()
        };
        assert_eq!(near(0.0, 6.3).err(), Some(OrbitError::AtRest));
        for (amplitude, period) in [(1e-100, 6.3), (1e-6, 6.3), (1e-3, 9.0), (0.1, 3.0)] {
            match near(amplitude, period) {
                Ok(orbit) => {
                    let nodes = orbit.motion().states().iter();
                    let largest = nodes.map(|node| node.q[0].abs()).fold(0.0, larger);
                    assert!(largest > 1.9, "{mu} {amplitude:e}: {largest:e}");
                }
                Err(error) => assert_eq!(error, OrbitError::AtRest, "{mu} {amplitude:e}"),
            }
            let orbit = PeriodicOrbit::of(&oscillator)
                .unknown_period(period)
                .guess_from(oscillator.state([amplitude], [0.0]))
                .solve();
            if let Ok(orbit) = orbit {
                let nodes = orbit.nodes();
                let largest = nodes.iter().map(|node| node.q[0].abs());
                let largest = largest.fold(0.0, larger);
                assert!(largest > 1.9, "{mu} {amplitude:e}: {largest:e}");
            }
        }
    }
}

/// With a given period, the equilibrium is an orbit: see `a_saddle_of_a_simulation_is_unstable`, too.
#[test]
fn multipliers_of_an_equilibrium() {
    let pendulum = PENDULUM;
    let hanging = PeriodicOrbit::of(&pendulum)
        .element(Mixed::<6>)
        .elements(10)
        .period(1.0)
        .solve();
    let hanging = hanging.expect("rest");
    assert!((hanging.multipliers()[0].re - 1.0_f64.cos()).abs() < 1e-12);
    assert!(hanging.is_stable() && hanging.trivial().is_empty());
    let standing = PeriodicOrbit::of(&pendulum)
        .element(Mixed::<6>)
        .elements(10)
        .period(1.0)
        .guess(|_| ([PI], [0.0]))
        .solve()
        .expect("rest");
    assert!((standing.multipliers()[0].re - 1.0_f64.exp()).abs() < 1e-11);
    assert!(!standing.is_stable());
}

#[test]
fn boundary_values_that_are_ill_posed() {
    let projectile = Projectile { g: 9.81 };
    let problem = || BoundaryValue::of(&projectile);
    assert!(matches!(problem().solve(), Err(BoundaryError::Span { .. })));
    let error = problem().from_to([0.0; 2], [1.0; 2], 1.0..1.0).solve();
    assert!(matches!(error, Err(BoundaryError::Span { .. })));
    // An infinite span has a length: the message does not say otherwise.
    let error = problem()
        .from_to([0.0; 2], [1.0; 2], 0.0..f64::INFINITY)
        .solve();
    let told = error.err().map(|error| error.to_string());
    let told = told.unwrap_or_default();
    assert!(
        told.contains("0..inf is missing, empty or not finite"),
        "{told}"
    );
    let error = problem()
        .span(0.0..1.0)
        .start(Component::Coordinate(0), 0.0)
        .solve();
    assert!(matches!(
        error,
        Err(BoundaryError::Count {
            needed: 4,
            given: 1
        })
    ));
    let three = || {
        let three = problem()
            .span(0.0..1.0)
            .start(Component::Coordinate(0), 0.0);
        three
            .start(Component::Momentum(0), 1.0)
            .end(Component::Coordinate(1), 0.0)
    };
    let error = three().end(Component::Coordinate(2), 0.0).solve();
    assert!(matches!(
        error,
        Err(BoundaryError::Component {
            component: Component::Coordinate(2)
        })
    ));
    let error = three().end(Component::Coordinate(1), 0.0).solve();
    assert!(matches!(
        error,
        Err(BoundaryError::Twice {
            component: Component::Coordinate(1)
        })
    ));
    let error = three().end(Component::Momentum(1), f64::NAN).solve();
    assert!(matches!(error, Err(BoundaryError::Value { .. })));
    let error = problem()
        .elements(0)
        .from_to([0.0; 2], [1.0; 2], 0.0..1.0)
        .solve();
    assert!(matches!(
        error,
        Err(BoundaryError::Mesh(MeshError::NoElements))
    ));
    // px is conserved: giving it at both ends does not determine x, whatever the guess and the limit.
    let error = problem()
        .max_iterations(0)
        .span(0.0..1.0)
        .start(Component::Momentum(0), 1.0)
        .end(Component::Momentum(0), 1.0)
        .start(Component::Coordinate(1), 0.0)
        .end(Component::Coordinate(1), 0.0)
        .solve();
    assert!(matches!(
        error,
        Err(BoundaryError::Assembly(AssemblyError::Singular {
            iterations: 0
        }))
    ));
    let solved = three()
        .end(Component::Momentum(1), 2.0)
        .solve()
        .expect("an arc");
    assert!((solved.start().q[1] + 2.0 + 0.5 * 9.81).abs() < 1e-13);
}

/// Lengths that overflow or vanish, and more elements than any memory holds: panics, or a step of 0.
#[test]
fn spans_and_meshes_of_absurd_sizes() {
    let projectile = Projectile { g: 9.81 };
    let cycle = VanDerPol::unit(1.0);
    let arc = |span| BoundaryValue::of(&projectile).from_to([0.0; 2], [1.0; 2], span);
    for span in [-1e308..1e308, 0.0..5e-324, 0.0..f64::NAN] {
        let told = arc(span).solve().err().expect("no span");
        assert!(matches!(told, BoundaryError::Span { .. }), "{told}");
        assert!(told.to_string().len() < 140, "{told}");
    }
    let orbit = || PeriodicOrbit::of(&cycle).unknown_period(6.6);
    for elements in [usize::MAX, usize::MAX / 2, 1 << 40] {
        let arc = arc(0.0..1.0).elements(elements).solve().err();
        assert_eq!(
            arc,
            Some(BoundaryError::Mesh(MeshError::TooManyElements { elements }))
        );
        let orbit = orbit().elements(elements).solve().err();
        assert_eq!(
            orbit,
            Some(OrbitError::Mesh(MeshError::TooManyElements { elements }))
        );
    }
    let vanishing = MeshError::TooShort {
        element: 1,
        weight: 1e-20,
        total: 2.0,
    };
    let arc = arc(0.0..1.0).graded([1.0, 1e-20, 1.0]).solve().err();
    assert_eq!(arc, Some(BoundaryError::Mesh(vanishing)));
    let orbit = orbit().graded([1.0, 1e-20, 1.0]).solve().err();
    assert_eq!(orbit, Some(OrbitError::Mesh(vanishing)));
}

/// An undamped oscillator forced with its own period has no periodic orbit. The errors of elements in its period, 4e-6
/// (ten elements) to 9e-10 (forty), allow an orbit with an amplitude as large as these errors are small: it must be
/// refused. With a little damping there is one, x = f/δ sin t, which is as large, and right.
#[test]
fn resonance_without_damping_has_no_orbit() {
    let forced = |delta: f64| Duffing {
        alpha: 1.0,
        beta: 0.0,
        delta,
        f: 0.3,
        omega: 1.0,
    };
    let undamped = forced(0.0);
    for elements in [10, 40] {
        let error = PeriodicOrbit::of(&undamped)
            .elements(elements)
            .period(TAU)
            .solve();
        assert!(
            matches!(
                error,
                Err(OrbitError::Assembly(AssemblyError::Singular { .. }))
            ),
            "{elements}: {:?}",
            error.map(|orbit| orbit.start())
        );
    }
    let damped = forced(1e-4);
    let orbit = PeriodicOrbit::of(&damped).period(TAU).solve();
    let start = orbit.expect("an orbit").start();
    // The error of the phase is 9e-10, compared with 3e-4 by which damping reduces the amplitude.
    assert!((start.p[0] / 3000.0 - 1.0).abs() < 1e-5, "{start:?}");
}

/// A falling body gains momentum: no correction changes that, and only the coordinate can be periodic.
#[test]
fn motions_that_do_not_close_are_no_orbits() {
    #[dynamics(coordinates(x), lagrangian = dot(x)^2/2 + g*x)]
    struct Fall {
        g: f64,
    }
    let fall = Fall { g: 0.01 };
    let error = PeriodicOrbit::of_simulation(&Simulation::new(&fall))
        .period(1.0)
        .guess_from(fall.state([0.0], [0.3]))
        .solve();
    assert!(
        matches!(error, Err(OrbitError::Stalled { .. })),
        "{:?}",
        error.map(|_| ())
    );
}

/// With a tolerance that is not a number no iteration ends, with one of a whole any guess is a solution.
#[test]
fn tolerances_that_are_none_are_refused() {
    let projectile = Projectile { g: 9.81 };
    let cycle = VanDerPol::unit(1.0);
    let simulation = Simulation::new(&cycle);
    for tolerance in [f64::NAN, f64::INFINITY, -1.0, 1.0, 1e308] {
        let arc = BoundaryValue::of(&projectile)
            .from_to([0.0; 2], [1.0; 2], 0.0..1.0)
            .tolerance(tolerance)
            .solve();
        let orbit = PeriodicOrbit::of(&cycle)
            .unknown_period(6.6)
            .guess(|t| ([2.0 * t.cos()], [-2.0 * t.sin()]))
            .tolerance(tolerance)
            .solve();
        let hybrid = PeriodicOrbit::of_simulation(&simulation)
            .unknown_period(6.6)
            .guess_from(cycle.state([2.0], [0.0]))
            .tolerance(tolerance)
            .solve();
        assert!(matches!(
            arc.err(),
            Some(BoundaryError::Assembly(AssemblyError::Tolerance { .. }))
        ));
        for error in [orbit.err(), hybrid.err()] {
            let error = error.expect("no tolerance");
            assert!(
                matches!(error, OrbitError::Assembly(AssemblyError::Tolerance { .. })),
                "{error}"
            );
            assert!(error.to_string().contains("leave `.tolerance(…)` out"));
        }
    }
}

/// A state that closes after some time is no orbit of a model whose forces have another period then, nor where the
/// growth of the coordinates changes the forces.
#[test]
fn models_that_do_not_repeat_have_no_orbit() {
    let period = TAU / FORCED.omega;
    for wrong in [2.0, 0.99 * period, 1.001 * period, 1.5 * period, 1e-6] {
        let error = PeriodicOrbit::of(&FORCED).period(wrong).solve().err();
        let error = error.expect("another period");
        assert!(matches!(error, OrbitError::NotRepeated { .. }), "{error}");
        assert!(
            error.to_string().contains("does not repeat after"),
            "{error}"
        );
    }
    let simulation = Simulation::new(&FORCED);
    let hybrid = PeriodicOrbit::of_simulation(&simulation).period(0.99 * period);
    let error = hybrid.solve().expect_err("another period");
    assert!(matches!(error, OrbitError::NotRepeated { .. }), "{error}");
    // Multiples, also late, where the phase of the forces is rounded, and a period with six digits.
    let six = (period * 1e6).round() / 1e6;
    for (start, right) in [
        (0.0, 2.0 * period),
        (1e8, period),
        (-0.3, 7.0 * period),
        (0.0, six),
    ] {
        let orbit = PeriodicOrbit::of(&FORCED).period(right).start_time(start);
        let told = orbit.elements(80).solve().err();
        assert!(told.is_none(), "{start} {right}: {told:?}");
    }
    // A pendulum turns by 2π, not by 6.
    let turning = |turn: f64| {
        let orbit = PeriodicOrbit::of(&PENDULUM).unknown_period(2.0);
        let orbit = orbit.advance([turn]).energy(4.0);
        let guess = move |t: f64| ([turn * t / 2.0], [turn / 2.0]);
        orbit.guess(guess).solve().err()
    };
    assert_eq!(turning(TAU), None);
    assert_eq!(turning(-2.0 * TAU), None);
    let error = turning(6.0).expect("another pendulum");
    assert!(matches!(error, OrbitError::NotRepeated { .. }), "{error}");
}

/// A branch whose period is not that of the forces ends where it ceases to be.
#[test]
fn branches_of_a_wrong_period_end() {
    let period = TAU / FORCED.omega;
    let branch = Continuation::of(&FORCED).parameter(|model: &mut Duffing| &mut model.omega);
    let branch = branch.range(FORCED.omega..2.0 * FORCED.omega);
    let error = branch.period(|_| period).run().expect_err("another period");
    let last = error.partial().points().last().expect("the first orbit");
    // The phase of the forces is off by less than the ten-thousandth that is accepted.
    assert!(
        (last.parameter - FORCED.omega).abs() * period <= 2e-4,
        "{last:?}"
    );
    let told = error.to_string();
    assert!(told.contains("does not repeat after"), "{told}");
}

/// Elements that are too long close another motion: the orbit has a warning, which its summary shows.
#[test]
fn orbits_that_the_elements_do_not_resolve_are_told() {
    let period = TAU / FORCED.omega;
    let of = |periods: f64, elements: usize| {
        let orbit = PeriodicOrbit::of(&FORCED).elements(elements);
        let orbit = orbit.period(periods * period);
        orbit.guess(response).solve().expect("an orbit")
    };
    let near = of(1.0, 40);
    assert!(near.warnings().is_empty(), "{near}");
    // Half a period in an element.
    let many = of(20.0, 400);
    assert!(many.warnings().is_empty(), "{many}");
    assert!((many.start().q[0] - near.start().q[0]).abs() <= 1e-5);
    let far = of(1000.0, 40);
    let off = (far.start().q[0] - near.start().q[0]).abs();
    assert!(off > 0.1 && far.warnings().len() == 1, "{off} {far}");
    assert!(far.to_string().contains("40 elements do not resolve"));
    // Unknown periods, with and without an unfolding force.
    let cycle = VanDerPol::unit(5.0);
    let coarse = PeriodicOrbit::of(&cycle).unknown_period(11.6).elements(400);
    let fine = coarse.guess_from(cycle.state([2.0], [0.0])).solve();
    let fine = fine.expect("an orbit");
    assert!(fine.warnings().is_empty(), "{fine}");
    let (start, found) = (PENDULUM.state([2.0], [0.0]), 8.349_752_926_918_493);
    for elements in [3, 4, 40] {
        let swing = PeriodicOrbit::of(&PENDULUM).unknown_period(8.0);
        let swing = swing.elements(elements).energy(-(2.0_f64.cos()));
        if let Ok(swing) = swing.guess_from(start).solve() {
            let off = (swing.period() / found - 1.0).abs();
            assert!(off <= 0.03 || !swing.warnings().is_empty(), "{off} {swing}");
        }
    }
}

/// Two masses on springs, with damping and a force of any amplitude.
#[dynamics(
    coordinates(x, y),
    lagrangian = (dot(x)^2 + dot(y)^2)/2 - (x - r)^2/2 - (y - x - r)^2/2 - (y - x)^4/8,
    dissipation = (dot(x)^2 + dot(y)^2)/20,
    force(y) = f*cos(t),
)]
struct Masses {
    r: f64,
    f: f64,
}

/// Where the amplitude of the force is zero, the momenta are rounding errors of no size of their own.
#[test]
fn rounding_errors_of_motions_at_rest_have_no_warning() {
    for r in [0.0, 0.7, 1.3, 10.0 / 3.0] {
        let still = Masses { r, f: 0.0 };
        for elements in [3, 10, 40] {
            let orbit = PeriodicOrbit::of(&still).elements(elements).period(TAU);
            let orbit = orbit.guess(move |_| ([r, 2.0 * r], [0.0; 2])).solve();
            let orbit = orbit.expect("an orbit");
            assert_eq!(orbit.warnings(), [], "{r} {elements}");
            let simulation = Simulation::new(&still);
            let hybrid = PeriodicOrbit::of_simulation(&simulation).elements(elements);
            let hybrid = hybrid.period(TAU).guess_from(orbit.start()).solve();
            let hybrid = hybrid.expect("an orbit");
            assert_eq!(hybrid.warnings(), [], "{r} {elements}");
        }
    }
}
