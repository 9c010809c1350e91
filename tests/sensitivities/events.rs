//! Derivatives across events.

use super::*;

#[test]
fn derivatives_go_through_bounces() {
    let ball = Ball {
        m: 1.0,
        g: 9.81,
        floor: 0.0,
    };
    let s = bouncing(&ball)
        .run_sensitive(ball.state([1.0], [0.0]), 0.0..1.5)
        .expect("derivatives");
    assert_eq!(s.motion().events().len(), 2);
    // From rest at height H: τ = √(2H/g), the second bounce is at 2.6 τ, then y = 0.64 g τ s − g s²/2 with s = t − 2.6
    // τ.
    let tau = |height: f64, g: f64| (2.0 * height / g).sqrt();
    let y = |height: f64, g: f64| {
        let s = 1.5 - 2.6 * tau(height, g);
        0.64 * g * tau(height, g) * s - g * s * s / 2.0
    };
    let [by_g] = difference(|g| [y(1.0, g)], 9.81);
    let [by_height] = difference(|height| [y(height, 9.81)], 1.0);
    assert!((s.motion().last().q[0] - y(1.0, 9.81)).abs() < 1e-14);
    assert!((s.by("g").last().q[0] - by_g).abs() < 1e-12);
    let found = s.by_start().last().q_by_q()[(0, 0)];
    assert!((found - by_height).abs() < 1e-11, "{found} {by_height}");
    // Raising the floor is the same as lowering the ball.
    let by_floor = s.by("floor").last().q[0];
    assert!((by_floor - (1.0 - by_height)).abs() < 1e-11, "{by_floor}");
    assert!(s.by("m").last().q[0].abs() < 1e-12);
    let times = [0, 1].map(|event| s.by("g").event_time(event).expect("a bounce"));
    assert!((times[0] + tau(1.0, 9.81) / (2.0 * 9.81)).abs() < 1e-14);
    assert!((times[1] + 2.6 * tau(1.0, 9.81) / (2.0 * 9.81)).abs() < 1e-13);
    assert_eq!(s.by("g").event_time(2), None);
    assert_eq!(s.by("g").states().len(), s.motion().states().len());
    // The velocity before the first bounce is −√(2gH); after it, 0.8 times the opposite.
    let nodes = s.motion().states();
    let at = nodes
        .windows(2)
        .position(|two| two[0].t == two[1].t)
        .expect("a bounce");
    let speeds = s.by("g").output("velocity").expect("declared");
    let rate = 0.5 * (2.0 / 9.81_f64).sqrt();
    assert!((speeds[at] + rate).abs() < 1e-13 && (speeds[at + 1] - 0.8 * rate).abs() < 1e-12);
}

/// A floor very close to zero has the derivatives of one at zero: its small effects on the motion, and on a restitution
/// that depends on it, must not be lost as rounding errors.
#[test]
fn derivatives_by_small_parameters_go_through_bounces() {
    let by_floor = |floor: f64, part: f64| {
        let ball = Ball {
            m: 1.0,
            g: 9.81,
            floor,
        };
        let run = Simulation::new(&ball).step(0.1);
        let run = run.on("impact", Crossing::Falling, move |event| {
            let floor = event.parameter("floor").unwrap_or(f64::NAN);
            let restitution = 0.8 + part * floor;
            Act::Restart(event.state_with_velocity([-restitution * event.v[0]]))
        });
        let s = run.run_sensitive(ball.state([1.0], [0.0]), 0.0..1.5);
        let last = s.expect("derivatives").by("floor").last();
        [last.q[0], last.p[0]]
    };
    for part in [0.0, 0.5] {
        let expected = by_floor(0.0, part);
        for floor in [1e-12, -1e-15, 1e-20, 1e-150] {
            // The derivatives themselves differ by about the size of the floor times ten.
            for (found, expected) in by_floor(floor, part).into_iter().zip(expected) {
                let error = (found - expected).abs();
                assert!(error < 1e-9, "{floor:e}: {found} instead of {expected}");
            }
        }
    }
}

/// A function that vanishes together with the only coordinate, next to numbers that do not.
#[test]
fn functions_of_a_coordinate_that_vanishes_have_their_derivatives() {
    let ball = Ball {
        m: 1.0,
        g: 9.81,
        floor: 0.0,
    };
    let start = ball.state([1.0], [0.0]);
    let expected = bouncing(&ball).run_sensitive(start, 0.0..1.5);
    let expected = expected.expect("derivatives").by("g").last();
    let acts: [fn(&tfe::simulation::Occurrence<'_, 1>) -> Act<1>; 2] = [
        |event| Act::Restart(event.state_with_velocity([-0.8 * event.v[0]])),
        |event| Act::Restart(event.after_impact(0.8)),
    ];
    for act in acts {
        let run = Simulation::new(&ball).step(0.1).on_function(
            "above",
            Crossing::Falling,
            |_, q, _| (q[0] + 2.0) - 2.0,
            act,
        );
        let found = run.run_sensitive(start, 0.0..1.5).expect("derivatives");
        assert_eq!(found.motion().events().len(), 2);
        let found = found.by("g").last();
        // The function has rounding errors of 4e-16.
        assert!((found.q[0] - expected.q[0]).abs() < 1e-9, "{found:?}");
        assert!((found.p[0] - expected.p[0]).abs() < 1e-9, "{found:?}");
    }
}

/// The same ball with an input, whose model belongs to the run; and as a Hamiltonian with a mass, on which the momentum
/// after the bounce depends.
#[test]
fn derivatives_go_through_events_of_other_models() {
    #[dynamics(
        coordinates(y),
        lagrangian = m/2*dot(y)^2 - m*g*y,
        input(u),
        force(y) = u,
        event(impact) = y,
    )]
    struct Pushed {
        m: f64,
        g: f64,
    }
    #[dynamics(
        coordinates(y),
        momenta(p),
        hamiltonian = p^2/(2*m) + m*g*y,
        event(impact) = y,
    )]
    struct Canonical {
        m: f64,
        g: f64,
    }
    fn bounce<const N: usize>(event: &tfe::simulation::Occurrence<'_, N>) -> Act<N> {
        // The restitution depends on the speed: a nonlinear act.
        Act::Restart(event.state_with_velocity(event.v.map(|v| -0.8 * v - 0.02 * v * v)))
    }
    fn pushed(model: &Pushed) -> Simulation<'_, tfe::Driven<'_, Pushed>, 1> {
        Simulation::new(model)
            .step(0.1)
            .on("impact", Crossing::Falling, bounce)
            .input("u", |t| 0.3 * t)
    }
    fn canonical(model: &Canonical) -> Simulation<'_, Canonical, 1> {
        Simulation::new(model)
            .step(0.1)
            .on("impact", Crossing::Falling, bounce)
    }
    let start = State { q: [1.0], p: [0.4] };
    let ends = |motion: &Motion<1>| [motion.last().q[0], motion.last().p[0]];
    let model = Pushed { m: 1.3, g: 9.81 };
    let s = pushed(&model)
        .run_sensitive(start, 0.0..1.1)
        .expect("derivatives");
    assert_eq!(s.motion().events().len(), 1);
    let other = Canonical { m: 1.3, g: 9.81 };
    let h = canonical(&other)
        .run_sensitive(start, 0.0..1.1)
        .expect("derivatives");
    for (name, by) in [("m", 1.3), ("g", 9.81)] {
        let with = |x: f64| if name == "m" { (x, 9.81) } else { (1.3, x) };
        let expected = difference(
            |x| {
                let (m, g) = with(x);
                ends(
                    &pushed(&Pushed { m, g })
                        .run(start, 0.0..1.1)
                        .expect("a run"),
                )
            },
            by,
        );
        let found = s.by(name).last();
        assert!((found.q[0] - expected[0]).abs() < 1e-11, "{name}");
        assert!((found.p[0] - expected[1]).abs() < 1e-10, "{name}");
        let expected = difference(
            |x| {
                let (m, g) = with(x);
                ends(
                    &canonical(&Canonical { m, g })
                        .run(start, 0.0..1.1)
                        .expect("a run"),
                )
            },
            by,
        );
        let found = h.by(name).last();
        assert!((found.q[0] - expected[0]).abs() < 1e-11, "{name}");
        assert!((found.p[0] - expected[1]).abs() < 1e-10, "{name}");
    }
}

/// Two pendulums that hit a wall several times, with an impulse along the normal of the wall; and the derivatives if
/// the run stops at the next impact.
#[test]
fn derivatives_go_through_impacts() {
    #[dynamics(
        coordinates(a, b),
        lagrangian = m/2*dot(a)^2 + dot(b)^2/2 + dot(a)*dot(b)*cos(a - b)/2 + g*(cos(a) + cos(b)/2),
        event(wall) = a - w,
    )]
    struct Hitting {
        m: f64,
        g: f64,
        w: f64,
    }
    fn simulation(model: &Hitting) -> Simulation<'_, Hitting, 2> {
        Simulation::new(model).step(0.05).element(Mixed::<5>).on(
            "wall",
            Crossing::Rising,
            |event| {
                let cos = (event.q[0] - event.q[1]).cos() / 2.0;
                let mass = 1.3 - cos * cos;
                Act::Impulse([-1.7 * mass * event.v[0], 0.0])
            },
        )
    }
    let model = Hitting {
        m: 1.3,
        g: 9.81,
        w: 0.1,
    };
    let start = model.state([-0.8, 0.2], [0.0, 0.3]);
    let s = check::<_, 2, 4>(&model, start, 2.5, 1e-10, simulation, true);
    assert_eq!(s.motion().events().len(), 2);
}

/// If an event stops a run, the time of its end changes, and with it a loss that depends on the time: y = 1 + v t − g
/// t²/2 from rest.
#[test]
fn losses_of_the_time_of_an_event_move_with_it() {
    let ball = Ball {
        m: 1.0,
        g: 10.0,
        floor: 0.0,
    };
    let start = ball.state([1.0], [0.0]);
    let run = Simulation::new(&ball)
        .step(0.1)
        .on("impact", Crossing::Falling, |_| Act::Stop);
    let end = 0.2_f64.sqrt();
    let of_time: [Loss<'_, 1>; 2] = [
        Loss::output_at_end("clock"),
        Loss::at_end(|node: &tfe::Node<1>| node.t),
    ];
    for loss in of_time {
        let found = run.gradient(start, 0.0..2.0, &loss);
        let (value, gradient) = found.expect("a gradient");
        assert!((value - end).abs() < 1e-13);
        let by_start = gradient.by_start();
        assert!((by_start.q[0] - 0.1 / end).abs() < 1e-9, "{by_start:?}");
        assert!((by_start.p[0] - 0.1).abs() < 1e-9, "{by_start:?}");
        assert!((gradient.by("g") + end / 20.0).abs() < 1e-9);
    }
    // With a distant origin of time, so that the time has only 22 bits after the point.
    let ago = 1.7e9;
    let loss = Loss::at_end(|node: &tfe::Node<1>| (node.t - ago).powi(2));
    let found = run.gradient(start, ago..ago + 2.0, &loss);
    let (_, gradient) = found.expect("a gradient");
    let by_start = gradient.by_start().q[0];
    assert!((by_start - 0.2).abs() < 1e-5, "{by_start}");
    // t v = −2 y₀ at the end.
    let loss = Loss::at_end(|node: &tfe::Node<1>| node.t * node.v[0]);
    let found = run.gradient(start, 0.0..2.0, &loss);
    let (_, gradient) = found.expect("a gradient");
    assert!((gradient.by_start().q[0] + 2.0).abs() < 1e-9);
    assert!(gradient.by("g").abs() < 1e-9);
    // An end that does not move is needed nowhere else.
    let loss = Loss::at_end(|node: &tfe::Node<1>| {
        assert_eq!(node.t, 0.4);
        node.q[0]
    });
    let found = run.gradient(start, 0.0..0.4, &loss);
    let (_, gradient) = found.expect("a gradient");
    assert!((gradient.by_start().q[0] - 1.0).abs() < 1e-9);
    // Times after the end are ignored.
    let squares = |t: f64| run.gradient(start, 0.0..2.0, &Loss::squares("height", [t], [0.5]));
    squares(0.3).expect("before the end");
    let error = squares(1.9).expect_err("behind the end");
    let kind = error.kind();
    assert!(matches!(kind, RunErrorKind::Loss { .. }), "{kind}");
}

/// A mass without forces before a wall.
#[dynamics(coordinates(x), lagrangian = dot(x)^2/2, event(wall) = x - 0.12)]
struct Free;

/// If an event decides where an element ends, an impulse inside the element moves relative to it: this is refused, and
/// with a node at the impulse the derivatives are right.
#[test]
fn impulses_beside_events_are_at_nodes() {
    let start = Free.state([0.0], [1.0]);
    let run =
        Simulation::new(&Free)
            .step(0.1)
            .impulse(0.05, [1.0])
            .on("wall", Crossing::Either, |_| Act::Stop);
    let told = run.run_sensitive(start, 0.0..1.0).expect_err("refused");
    assert!(told.to_string().contains("break_at(0.05)"), "{told}");
    // t* = 0.05 + (0.12 − x₀ − 0.05)/2
    let s = run.break_at(0.05).run_sensitive(start, 0.0..1.0);
    let s = s.expect("derivatives");
    assert!((s.motion().last().t - 0.085).abs() < 1e-14);
    let by_start = s.motion().last();
    assert!((by_start.q[0] - 0.12).abs() < 1e-14);
}

/// Losses in micrometres are equivalent to those in metres.
#[test]
fn losses_of_small_numbers_have_their_gradients() {
    for size in [1.0, 1e-6, 1e-12] {
        let run = Simulation::new(&Free).step(0.1);
        let loss = Loss::at_end(|node: &tfe::Node<1>| 1.0 / node.q[0]);
        let found = run.gradient(Free.state([size], [size]), 0.0..1.0, &loss);
        let (_, gradient) = found.expect("a gradient");
        let expected = -0.25 / (size * size);
        let q = gradient.by_start().q[0];
        assert!((q - expected).abs() < 1e-8 * expected.abs(), "{size}: {q}");
    }
    // Squares of small distances vanish next to those of large ones, and a small number next to a larger one at shorter
    // distances.
    for size in [1e-10, 1e-24, 1e-100] {
        let run = Simulation::new(&Free).step(0.1);
        let start = Free.state([size], [size]);
        let by_momentum = |loss: Loss<'_, 1>| {
            let found = run.gradient(start, 0.0..1.0, &loss);
            found.expect("a gradient").1.by_start().p[0]
        };
        let energy = by_momentum(Loss::at_end(|node: &tfe::Node<1>| {
            0.5 * node.p[0] * node.p[0] + 0.5 * node.q[0] * node.q[0]
        }));
        // p + q, q = x₀ + p
        let error = (energy - 3.0 * size).abs();
        assert!(error < 1e-8 * size, "{size:e}: {energy:e}");
        let far = by_momentum(Loss::at_end(|node: &tfe::Node<1>| {
            0.5 * (node.q[0] - 1.0).powi(2)
        }));
        assert!((far + 1.0).abs() < 1e-8, "{size:e}: {far}");
    }
}

/// Two events at one time: the second is at the start of an element. A pendulum by its place, whose reaction determines
/// how the motion goes on from there, is one by its angle.
#[test]
fn derivatives_with_constraints_go_through_events_at_one_time() {
    #[dynamics(coordinates(a), lagrangian = m/2*dot(a)^2 + m*g*cos(a))]
    struct Angle {
        m: f64,
        g: f64,
    }
    let (m, g) = (1.3, 9.81);
    let (c, l) = (0.0, 1.0);
    let (rod, angle) = (Rod { m, g, c, l }, Angle { m, g });
    // The wall, and at once a push along the circle that depends on the velocity.
    let run = Simulation::new(&rod).element(Mixed::<7>).step(0.02);
    let run = run
        .on_function(
            "wall",
            Crossing::Falling,
            |_, q, _| 0.3 - q[0],
            |event| Act::Restart(event.after_impact(0.8)),
        )
        .on_function(
            "again",
            Crossing::Falling,
            |_, q, _| 0.3 - q[0],
            |event| {
                let ([x, y], v) = (event.q, event.v);
                let push = 0.1 * (x * v[1] - y * v[0]);
                Act::Impulse([-y * push, x * push])
            },
        );
    let beside = Simulation::new(&angle).element(Mixed::<7>).step(0.02);
    let beside = beside
        .on_function(
            "wall",
            Crossing::Falling,
            |_, a, _| 0.3 - a[0].sin(),
            |event| Act::Restart(event.after_impact(0.8)),
        )
        .on_function(
            "again",
            Crossing::Falling,
            |_, a, _| 0.3 - a[0].sin(),
            |event| Act::Impulse([0.1 * event.v[0]]),
        );
    let found = run.run_sensitive(rod.state([0.0, -1.0], [1.5, 0.0]), 0.0..0.7);
    let found = found.expect("derivatives");
    let expected = beside.run_sensitive(angle.state([0.0], [1.5]), 0.0..0.7);
    let expected = expected.expect("derivatives");
    let times = |s: &Motion<2>| -> Vec<f64> { s.events().iter().map(|event| event.t).collect() };
    let times = times(found.motion());
    assert!(times.len() == 2 && times[0] == times[1], "{times:?}");
    let (sin, cos) = expected.motion().last().q[0].sin_cos();
    for name in ["m", "g"] {
        let (by, other) = (found.by(name), expected.by(name));
        let turn = other.last().q[0];
        let off = [by.last().q[0] - cos * turn, by.last().q[1] - sin * turn];
        let off = off.map(f64::abs);
        assert!(off[0] <= 1e-9 && off[1] <= 1e-9, "{name}: {off:?}");
        for event in 0..2 {
            let (dt, expected) = (by.event_time(event), other.event_time(event));
            let (dt, expected) = (dt.expect("an event"), expected.expect("an event"));
            assert!((dt - expected).abs() <= 1e-10, "{name}: {dt} {expected}");
        }
    }
}
