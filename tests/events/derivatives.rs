//! Transition matrices, sections and orbits across events.

use super::*;

/// The product of the matrices is the derivative of the end of whole runs, across six impacts of the tip of a double
/// pendulum on a wall.
#[test]
fn matrices_go_across_impacts() {
    let pendulum = TwoLinks { g: 9.81, w: 0.6 };
    let simulation = Simulation::new(&pendulum)
        .element(Mixed::<6>)
        .step(0.02)
        .on("wall", Crossing::Falling, |event| {
            Act::Restart(event.after_impact(0.8))
        });
    let start = pendulum.state([-0.9, -1.2], [0.0, 0.0]);
    let span = 0.0..6.0;
    let run = simulation
        .run_linearised(start, span.clone())
        .expect("a run");
    let count = run.motion().events().len();
    assert!(count >= 2, "{count}");
    assert_eq!(run.transitions().len(), 300);
    // The same bits as without matrices.
    let plain = simulation.run(start, span.clone()).expect("a run");
    assert_eq!(plain.states(), run.motion().states());
    let product = run.product();
    let end = |start: State<2>| {
        let motion = simulation.run(start, span.clone()).expect("a run");
        assert_eq!(motion.events().len(), plain.events().len());
        motion.last().state()
    };
    check_columns(&product, 0..4, (start, 1e-5), end);
    // Without losses, impacts are symplectic.
    let elastic = Simulation::new(&pendulum)
        .element(Mixed::<6>)
        .step(0.02)
        .on("wall", Crossing::Falling, |event| {
            Act::Restart(event.after_impact(1.0))
        });
    let run = elastic.run_linearised(start, span).expect("a run");
    let product = run.product();
    let defect = stability::symplecticity_defect(&product) / product.amax().powi(2);
    assert!(
        run.motion().events().len() >= 3 && defect < 1e-9,
        "{defect:e}"
    );
    assert!(run.motion().energy_error() < 1e-9);
}

/// Parameters that change during the run: x from rest at 1 with k = 4, then k = 1. The force vanishes at x = 0, where k
/// changes, so that there is no jump in the matrix (saltation): it is the product of two rotations.
#[test]
fn matrices_go_across_settings() {
    let springs = spring(4.0);
    let simulation = Simulation::new(&springs).element(Mixed::<8>).step(0.1).on(
        "middle",
        Crossing::Either,
        |event| Act::Set(Settings::new("k", if event.rises { 4.0 } else { 1.0 })),
    );
    // A whole period: all motions have the same period, so that the matrix is the identity.
    let run = simulation
        .run_linearised(springs.state([1.0], [0.0]), 0.0..1.5 * PI)
        .expect("a run");
    let product = run.product();
    for row in 0..2 {
        for column in 0..2 {
            let expected = if row == column { 1.0 } else { 0.0 };
            assert!(
                (product[(row, column)] - expected).abs() < 1e-9,
                "{product}"
            );
        }
    }
}

/// The iterator returns the events of a run, with the derivatives of the return map as matrices.
#[test]
fn sections_are_events_with_matrices() {
    let start = State {
        q: [0.0, 0.1],
        p: [0.4, 0.1],
    };
    let simulation = Simulation::new(&HenonHeiles).element(Mixed::<8>).step(0.3);
    let motion = simulation
        .clone()
        .on("section", Crossing::Rising, |_| Act::Record)
        .run(start, 0.0..150.0)
        .expect("a run");
    let points = |start: State<2>| {
        let section = simulation.section("section", Crossing::Rising, start, 0.0);
        section.map(|point| point.expect("a point"))
    };
    let of_run = motion.events();
    assert!(of_run.len() > 20);
    for (point, event) in points(start).zip(of_run) {
        assert!((point.t - event.t).abs() < 1e-12 && point.transition().is_none());
        assert!((point.q[1] - event.q[1]).abs() < 1e-12);
    }
    // Five returns, by the initial state.
    let mut product = nalgebra::DMatrix::identity(4, 4);
    let section = simulation.section("section", Crossing::Rising, start, 0.0);
    for point in section.linearised().take(5) {
        let point = point.expect("a point");
        product = point.transition().expect("linearised") * product;
    }
    // The initial state lies on the section: after a change normal to it, the first crossing may be before the start,
    // or the start itself.
    let fifth = |start: State<2>| points(start).nth(4).expect("endless").state();
    check_columns(&product, [0, 1, 3], (start, 5e-5), fifth);
    // In the coordinates y, p_y of the section the return map preserves the area at constant energy, and g remains
    // zero.
    assert!((0..4).all(|column| product[(2, column)].abs() < 1e-9 * product.amax()));
    let error = simulation
        .section("sektion", Crossing::Rising, start, 0.0)
        .next()
        .expect("one")
        .expect_err("no output");
    assert!(matches!(error, RunErrorKind::NoEvent { .. }));
}

/// With constraints the matrices are singular: their products with admissible directions are derivatives of the
/// positions and velocities of the points.
#[test]
fn sections_with_constraints_have_matrices_of_the_motions_allowed() {
    #[dynamics(
        coordinates(x[2], y[2]),
        lagrangian = sum(i in 0..2, m/2*(dot(x[i])^2 + dot(y[i])^2) - m*g*y[i]),
        constraint(first) = x[0]^2 + y[0]^2 - 1,
        constraint(rod) = (x[1] - x[0])^2 + (y[1] - y[0])^2 - 1,
        event(place) = x[0] - 0.1,
        event(turn) = dot(x[0]),
    )]
    struct Rods {
        m: f64,
        g: f64,
    }
    let rods = Rods { m: 0.8, g: 1.3 };
    let start = |angles: [f64; 2], rates: [f64; 2]| {
        let (x, y) = (angles.map(f64::sin), angles.map(|a| -a.cos()));
        let vx = [0, 1].map(|i| angles[i].cos() * rates[i]);
        let vy = [0, 1].map(|i| angles[i].sin() * rates[i]);
        rods.state(
            [x[0], x[0] + x[1], y[0], y[0] + y[1]],
            [vx[0], vx[0] + vx[1], vy[0], vy[0] + vy[1]],
        )
    };
    // The directions of one angle, and of its rate.
    let moved = |which: usize, s: f64| {
        let (mut angles, mut rates) = ([0.9, -0.4], [0.2, 0.1]);
        match which.checked_sub(2) {
            None => angles[which] += s,
            Some(rate) => rates[rate] += s,
        }
        start(angles, rates)
    };
    for (name, element) in [("place", Mixed::<6>.into()), ("turn", Element::mixed(8))] {
        let run = Simulation::new(&rods).element(element).step(0.04);
        let section = run.section(name, Crossing::Rising, moved(0, 0.0), 0.0);
        let mut product = nalgebra::DMatrix::identity(8, 8);
        for point in section.linearised().take(3) {
            let point = point.expect("a point");
            product = point.transition().expect("linearised") * product;
        }
        for which in 0..4 {
            let third = |s: f64| {
                let mut section = run.section(name, Crossing::Rising, moved(which, s), 0.0);
                let point = section.nth(2).expect("endless").expect("a point");
                numbers(&point.state())
            };
            let expected = difference_over(5e-4, third, 0.0);
            let begun = difference_over(5e-4, |s| numbers(&moved(which, s)), 0.0);
            let found = &product * nalgebra::DVector::from_vec(begun);
            let size = expected.iter().fold(0.0_f64, |size, x| size.max(x.abs()));
            for (row, (found, expected)) in found.iter().zip(&expected).enumerate() {
                let off = (found - expected).abs();
                assert!(
                    off < 1e-7 * size,
                    "{name}, {which}, {row}: {found} for {expected}"
                );
            }
        }
    }
}

/// x″ + x = F cos ωt with a wall at x = 0 and the coefficient of restitution e: orbits with one impact in n periods of
/// the forcing, in closed form.
///
/// From an impact at t = 0 with the forcing F cos(ωt + ψ), γ = F/(1 − ω²), P = γ cos ψ, S = −γω sin ψ and T = 2πn/ω: x
/// = a cos t + b sin t + γ cos(ωt + ψ) with a = −P and b = a tan T/2, S = −b (1 − e)/(1 + e), so b² (cot² T/2 + ((1 −
/// e)/((1 + e) ω))²) = γ². The monodromy matrix has the determinant e² and the trace −2e cos T + (1 + e) f sin T/v₋,
/// where f = F cos ψ is the acceleration at the impact.
#[test]
fn orbits_with_impacts_are_those_of_closed_forms() {
    #[dynamics(
        coordinates(x),
        lagrangian = (dot(x)^2 - x^2)/2 + f*cos(omega*t)*x,
        event(wall) = -x,
    )]
    struct ImpactOscillator {
        f: f64,
        omega: f64,
    }

    let (f, e) = (1.0, 0.8_f64);
    for (n, omega) in [(1.0, 2.2), (2.0, 4.4), (1.0, 2.6), (2.0, 4.1)] {
        let period = 2.0 * PI * n / omega;
        let gamma = f / (1.0 - omega * omega);
        let loss = (1.0 - e) / (1.0 + e);
        let cot = 1.0 / (period / 2.0).tan();
        let b = -gamma.abs() / (cot * cot + (loss / omega).powi(2)).sqrt();
        let (a, s) = (b * cot, -b * loss);
        let psi = (-s / (gamma * omega)).atan2(-a / gamma);
        // The orbit starts in the middle of the flight.
        let model = ImpactOscillator { f, omega };
        let from = psi / omega + period / 2.0;
        let (half, angle) = (period / 2.0, omega * period / 2.0 + psi);
        let x = a * half.cos() + b * half.sin() + gamma * angle.cos();
        let v = -a * half.sin() + b * half.cos() - gamma * omega * angle.sin();
        let bounce = |event: &tfe::Occurrence<'_, 1>| Act::Restart(event.after_impact(0.8));
        let simulation =
            Simulation::new(&model)
                .element(Mixed::<8>)
                .on("wall", Crossing::Falling, bounce);
        let orbit = PeriodicOrbit::of_simulation(&simulation)
            .start_time(from)
            .period(period)
            .guess_from(model.state([1.01 * x], [v + 0.02]))
            .solve()
            .expect("an orbit");
        let start = orbit.start();
        assert!(
            (start.q[0] - x).abs() < 1e-11 && (start.p[0] - v).abs() < 1e-11,
            "n = {n}, ω = {omega}: {start:?} for {x}, {v}"
        );
        let [event] = orbit.motion().events() else {
            panic!("{:?}", orbit.motion().events());
        };
        assert!((event.t - psi / omega - period).abs() < 1e-11);
        let before = -(b + s) / e;
        assert!((event.v[0] - before).abs() < 1e-11);
        let trace = -2.0 * e * period.cos() + (1.0 + e) * f * psi.cos() * period.sin() / before;
        let root = nalgebra::Complex::new(trace * trace / 4.0 - e * e, 0.0).sqrt();
        let expected = [trace / 2.0 + root, trace / 2.0 - root];
        for multiplier in orbit.multipliers() {
            let off = expected.map(|one| (one - multiplier).norm());
            assert!(
                off[0].min(off[1]) < 1e-9,
                "{:?} for {expected:?}",
                orbit.multipliers()
            );
        }
        assert!((orbit.monodromy().determinant() - e * e).abs() < 1e-10);
        assert_eq!(
            orbit.is_stable(),
            expected[0].norm().max(expected[1].norm()) <= 1.0
        );
    }
}

/// Orbits that switch parameters, with unknown period: a spring that is stiffer on one side.
#[test]
fn orbits_with_settings_and_unknown_periods() {
    let springs = spring(4.0);
    let simulation =
        Simulation::new(&springs)
            .element(Mixed::<8>)
            .on("middle", Crossing::Either, |event| {
                Act::Set(Settings::new("k", if event.rises { 4.0 } else { 1.0 }))
            });
    let orbits = PeriodicOrbit::of_simulation(&simulation)
        .unknown_period(4.5)
        .guess_from(springs.state([1.0], [0.1]));
    let orbit = orbits.solve().expect("an orbit");
    assert!(
        (orbit.period() - 1.5 * PI).abs() < 1e-10,
        "{}",
        orbit.period()
    );
    assert!((orbit.multipliers()[orbit.trivial()[0]].re - 1.0).abs() < 1e-6);
    let stopping = Simulation::new(&springs).on("middle", Crossing::Either, |_| Act::Stop);
    let error = PeriodicOrbit::of_simulation(&stopping)
        .period(4.5)
        .guess_from(springs.state([1.0], [0.0]))
        .solve()
        .expect_err("it stops");
    assert!(matches!(error, tfe::periodic::OrbitError::Stopped { .. }));
}

/// The state returns, but with another spring: the next period is a different motion, so that this is not a periodic
/// orbit.
#[test]
fn orbits_bring_parameters_back() {
    let springs = spring(1.0);
    let simulation =
        Simulation::new(&springs)
            .element(Mixed::<8>)
            .on("middle", Crossing::Either, |event| {
                let fall = State {
                    q: event.q,
                    p: [-2.0_f64.sqrt()],
                };
                Act::Set(match event.rises {
                    true => Settings::new("k", 4.0),
                    false => Settings::new("k", 2.0).and_state(fall),
                })
            });
    let period = PI + PI / 8.0_f64.sqrt();
    let orbit = PeriodicOrbit::of_simulation(&simulation)
        .period(period)
        .guess_from(springs.state([-1.0], [0.0]))
        .solve();
    let told = orbit.map(|orbit| orbit.period()).expect_err("no orbit");
    assert!(told.to_string().contains("leave `k` at 2"), "{told}");
}
