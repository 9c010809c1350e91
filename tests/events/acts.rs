//! The acts of events in all kinds of runs, and their misuse.

use super::*;
use crate::largest::larger;

#[test]
fn a_run_that_records_has_the_same_bits() {
    let model = oscillator(0.3);
    let start = model.state([1.0], [0.2]);
    let simulation = Simulation::new(&model).step(0.3);
    let plain = simulation.run(start, 0.0..20.0).expect("a run");
    let watched = simulation
        .on("above", Crossing::Rising, |_| Act::Record)
        .on("speed", Crossing::Falling, |_| Act::Record)
        .run(start, 0.0..20.0)
        .expect("a run");
    assert_eq!(plain.states(), watched.states());
    // Four maxima, and three upward crossings.
    assert_eq!(watched.events().len(), 7);
    let in_order = watched
        .events()
        .windows(2)
        .all(|pair| pair[0].t < pair[1].t);
    assert!(in_order);
}

#[test]
fn a_run_stops_at_an_event() {
    let model = oscillator(0.0);
    let motion = Simulation::new(&model)
        .element(Mixed::<8>)
        .step(0.4)
        .on("place", Crossing::Falling, |_| Act::Stop)
        .run(model.state([1.0], [0.0]), 0.0..20.0)
        .expect("a run");
    let last = motion.last();
    assert!((last.t - PI / 2.0).abs() < 1e-14 && last.q[0].abs() < 1e-15);
    assert_eq!(motion.events().len(), 1);
    assert!(motion.checkpoint().is_none());
    assert!((motion.at(1.5).expect("inside").q[0] - 1.5_f64.cos()).abs() < 1e-8);
}

/// An impulse that reverses the velocity at x = 0 turns the motion into |cos t|; the energy does not change.
#[test]
fn impulses_act_at_events() {
    let model = oscillator(0.0);
    let motion = Simulation::new(&model)
        .element(Mixed::<6>)
        .step(0.3)
        .on("place", Crossing::Falling, |event| {
            Act::Impulse([-2.0 * event.p[0]])
        })
        .run(model.state([1.0], [0.0]), 0.0..30.0)
        .expect("a run");
    assert_eq!(motion.events().len(), 10);
    for k in 0..300 {
        let t = 0.1 * f64::from(k);
        let node = motion.at(t).expect("inside");
        assert!(
            (node.q[0] - t.cos().abs()).abs() < 1e-7,
            "t = {t}: {node:?}"
        );
    }
    assert!((motion.last().q[0] - 30.0_f64.cos().abs()).abs() < 1e-10);
    // ∫₀³⁰ |cos t| dt: twenty quarter periods up to 19/2 π, and the rest of a sine.
    let covered = motion.integral(&model, "place").expect("an integral");
    let expected = 19.0 + (1.0 + 30.0_f64.sin());
    assert!(
        (covered[covered.len() - 1] - expected).abs() < 1e-9,
        "{covered:?}"
    );
}

#[test]
fn misuse_is_told() {
    let start = BALL.state([1.0], [0.0]);
    let watch = |name: &str| {
        Simulation::new(&BALL)
            .step(0.1)
            .on(name, Crossing::Either, |_| Act::Record)
    };
    let error = watch("heihgt").run(start, 0.0..1.0).expect_err("no output");
    assert_eq!(
        error.to_string(),
        "there is no event or output `heihgt`: the model declares height, rate"
    );
    // An invalid state.
    let error = Simulation::new(&BALL)
        .step(0.1)
        .on("height", Crossing::Falling, |_| {
            Act::Restart(State {
                q: [f64::NAN],
                p: [0.0],
            })
        })
        .run(start, 0.0..1.0)
        .expect_err("not finite");
    assert!(matches!(error.kind(), RunErrorKind::Start { .. }));
    assert!(error.partial().last().t > 0.4 && error.partial().events().len() == 1);
}

/// A stiffness of 4 to the right and of 1 to the left: half a period takes π/2 and π, respectively, with the same speed
/// in the middle.
#[test]
fn events_set_parameters() {
    let springs = spring(4.0);
    let side = |event: &tfe::Occurrence<'_, 1>| {
        let k = if event.rises { 4.0 } else { 1.0 };
        assert_eq!(event.parameter("k"), Some(5.0 - k));
        Act::Set(Settings::new("k", k))
    };
    let simulation = Simulation::new(&springs).element(Mixed::<8>).step(0.1).on(
        "middle",
        Crossing::Either,
        side,
    );
    let end = 40.0;
    let motion = simulation
        .run(springs.state([1.0], [0.0]), 0.0..end)
        .expect("a run");
    let exact = |t: f64| {
        let s = (t + PI / 4.0) % (1.5 * PI);
        if s < PI / 2.0 {
            (2.0 * s).sin()
        } else {
            -2.0 * (s - PI / 2.0).sin()
        }
    };
    for k in 0..=400 {
        let t = 0.1 * f64::from(k);
        let x = motion.at(t).expect("inside").q[0];
        assert!((x - exact(t)).abs() < 1e-9, "t = {t}: {x} for {}", exact(t));
    }
    // The outputs on each side of a node are those of its own arc; the energy does not change.
    let (nodes, outputs) = (motion.states(), motion.outputs());
    let stiffness = outputs.column("stiffness").expect("an output");
    for (node, pair) in nodes.windows(2).enumerate() {
        if pair[0].t == pair[1].t {
            assert_eq!(stiffness[node] + stiffness[node + 1], 5.0);
            assert_eq!(pair[0].state(), pair[1].state());
        } else {
            assert_eq!(stiffness[node], stiffness[node + 1]);
        }
    }
    assert!(
        motion
            .energies()
            .iter()
            .all(|energy| (energy - 2.0).abs() < 1e-12)
    );
    assert!(motion.energy_error() < 1e-12 && motion.checkpoint().is_none());
    // The number of arcs is 1 + the number of events; there are as many settings as were made, and statistics add up.
    let arcs: Vec<_> = motion.arcs().collect();
    assert_eq!(arcs.len(), motion.events().len() + 1);
    assert_eq!(motion.settings().len(), motion.events().len());
    let total: u64 = arcs.iter().map(|arc| arc.statistics.steps).sum();
    assert_eq!(total, motion.statistics().steps);
    for (arc, setting) in arcs[1..].iter().zip(motion.settings()) {
        assert_eq!(arc.nodes.start, setting.node);
        assert_eq!(stiffness[setting.node], setting.value);
    }
    // The integral of an output uses the parameters of each arc: over a period, each half has the mean energy 1.
    let integral = motion.integral(&springs, "potential").expect("an integral");
    let last = motion.last();
    let virial = integral[integral.len() - 1] - 0.5 * (2.0 * end);
    let boundary = -0.5 * last.q[0] * last.v[0] / 2.0;
    assert!((virial - boundary).abs() < 1e-9, "{virial} for {boundary}");
    // The caller's model is unchanged, and the next run gives the same.
    assert_eq!(springs.k, 4.0);
    let again = simulation.run(springs.state([1.0], [0.0]), 0.0..end);
    assert_eq!(again.expect("a run").states(), motion.states());
}

#[test]
fn what_is_set_goes_together() {
    let springs = spring(1.0);
    let run = |settings: Settings<1>| {
        Simulation::new(&springs)
            .element(Mixed::<8>)
            .step(0.1)
            .on("middle", Crossing::Falling, move |_| {
                Act::Set(settings.clone())
            })
            .run(springs.state([1.0], [0.0]), 0.0..4.0)
    };
    // Mass and stiffness are set: the momentum remains −1, so that the speed is halved.
    let motion = run(Settings::new("m", 2.0).and("k", 8.0)).expect("a run");
    let x = |t: f64| -0.25 * (2.0 * (t - PI / 2.0)).sin();
    assert!((motion.at(2.0).expect("inside").q[0] - x(2.0)).abs() < 1e-12);
    let node = motion.states()[motion.settings()[0].node];
    assert!((node.v[0] + 0.5).abs() < 1e-13 && (node.p[0] + 1.0).abs() < 1e-13);
    // If the velocity is given, its momentum is that with the new mass.
    let motion = run(Settings::new("m", 2.0).and_velocity([-1.0])).expect("a run");
    let node = motion.states()[motion.settings()[0].node];
    assert!((node.v[0] + 1.0).abs() < 1e-13 && (node.p[0] + 2.0).abs() < 1e-13);
    let state = State {
        q: [0.5],
        p: [0.25],
    };
    let motion = run(Settings::new("k", 2.0).and_state(state)).expect("a run");
    assert_eq!(motion.states()[motion.settings()[0].node].state(), state);
    // Misuse.
    let error = run(Settings::new("kk", 1.0)).expect_err("no parameter");
    assert_eq!(
        error.kind().to_string(),
        "there is no parameter `kk`: the model has m, k, level"
    );
    let error = run(Settings::new("k", f64::NAN)).expect_err("not finite");
    assert!(matches!(error.kind(), RunErrorKind::Parameter { .. }));
    assert!(error.partial().last().t > 1.0);
    let set = Simulation::new(&springs)
        .step(0.1)
        .on("middle", Crossing::Falling, |_| {
            Act::Set(Settings::new("k", 2.0))
        })
        .run_sensitive(springs.state([1.0], [0.0]), 0.0..4.0);
    let error = set.expect_err("it cannot know");
    assert!(matches!(error.kind(), RunErrorKind::SetUnsupported { .. }));
}

/// The nodes of `steps` are those of a run, with two at each event.
#[test]
fn steps_meet_the_events_of_a_run() {
    let bounce = |event: &tfe::Occurrence<'_, 1>| Act::Restart(event.after_impact(0.9));
    let simulation = Simulation::new(&BALL)
        .step(0.07)
        .on("height", Crossing::Falling, bounce)
        .on("rate", Crossing::Falling, |_| Act::Record);
    let start = BALL.state([1.0], [0.0]);
    let motion = simulation.run(start, 0.0..3.5).expect("a run");
    let mut steps = simulation.steps(start, 0.0);
    let mut events = Vec::new();
    let mut met = 0.0;
    for node in &motion.states()[1..] {
        let step = steps.next().expect("endless").expect("a step");
        assert_eq!((step.q, step.p), (node.q, node.p), "t = {}", node.t);
        assert!((step.t - node.t).abs() < 1e-15);
        for event in steps.events() {
            if event.t > met {
                met = event.t;
                events.push(event.clone());
            }
        }
    }
    assert_eq!(events.len(), motion.events().len());
    assert_eq!(events, motion.events());
    // A stop ends the sequence.
    let stopping = Simulation::new(&BALL)
        .step(0.07)
        .on("height", Crossing::Falling, |_| Act::Stop);
    let nodes: Result<Vec<_>, _> = stopping.steps(start, 0.0).collect();
    let last = *nodes.expect("no error").last().expect("some");
    assert!((last.t - (2.0 / BALL.g).sqrt()).abs() < 1e-14);
}

/// A pendulum beside a wall.
#[dynamics(
    coordinates(theta),
    lagrangian = m*l^2/2*dot(theta)^2 + m*g*l*cos(theta),
    event(wall) = 0.3 - l*sin(theta),
)]
struct Angle {
    m: f64,
    l: f64,
    g: f64,
}

#[test]
fn impacts_are_consistent_with_constraints() {
    #[dynamics(
        coordinates(x, y),
        lagrangian = m/2*(dot(x)^2 + dot(y)^2) - m*g*y,
        constraint(rod) = x^2 + y^2 - l^2,
        event(wall) = 0.3 - x,
    )]
    struct Rod {
        m: f64,
        l: f64,
        g: f64,
    }

    let (m, l, g) = (0.7, 1.3, 9.81);
    let (rod, angle) = (Rod { m, l, g }, Angle { m, l, g });
    let motion = Simulation::new(&rod)
        .element(Mixed::<6>)
        .step(0.01)
        .on("wall", Crossing::Falling, |event| {
            Act::Restart(event.after_impact(0.7))
        })
        .run(rod.state([0.0, -l], [1.9, 0.0]), 0.0..2.0)
        .expect("a run");
    let reference = Simulation::new(&angle)
        .element(Mixed::<6>)
        .step(0.01)
        .on("wall", Crossing::Falling, |event| {
            Act::Restart(event.state_with_velocity([-0.7 * event.v[0]]))
        })
        .run(angle.state([0.0], [1.9 / l]), 0.0..2.0)
        .expect("a run");
    assert!(motion.events().len() >= 2);
    assert_eq!(motion.events().len(), reference.events().len());
    for (event, expected) in motion.events().iter().zip(reference.events()) {
        assert!((event.t - expected.t).abs() < 1e-9, "{event:?}");
    }
    let theta = reference.last().q[0];
    assert!((motion.last().q[0] - l * theta.sin()).abs() < 1e-8);
    assert!(motion.constraint_residual().velocity < 1e-10);
    // The rod takes up the part of an impulse against it; along the circle, the impulse acts in full.
    let kick = Simulation::new(&rod)
        .element(Mixed::<6>)
        .step(0.01)
        .on("wall", Crossing::Falling, |event| {
            let (x, y) = (event.q[0] / 1.3, event.q[1] / 1.3);
            // An impulse of 5 along the rod, and one along the circle that reverses the velocity.
            let along = -2.0 * (event.p[1] * x - event.p[0] * y);
            Act::Impulse([5.0 * x - along * y, 5.0 * y + along * x])
        })
        .run(rod.state([0.0, -l], [1.9, 0.0]), 0.0..2.0)
        .expect("a run");
    let elastic = Simulation::new(&angle)
        .element(Mixed::<6>)
        .step(0.01)
        .on("wall", Crossing::Falling, |event| {
            Act::Restart(event.after_impact(1.0))
        })
        .run(angle.state([0.0], [1.9 / l]), 0.0..2.0)
        .expect("a run");
    assert_eq!(kick.events().len(), elastic.events().len());
    let theta = elastic.last().q[0];
    assert!((kick.last().q[0] - l * theta.sin()).abs() < 1e-8);
}

/// Estimates hold across events: the accuracy asked for is met, and the estimate is within a factor of the true error.
#[test]
fn accuracy_is_met_across_events() {
    // A ball bounces from height 1 with e = 0.8: its height at the end is known in closed form.
    let e: f64 = 0.8;
    let bounce = move |event: &tfe::Occurrence<'_, 1>| Act::Restart(event.after_impact(e));
    let motion = Simulation::new(&BALL)
        .on("height", Crossing::Falling, bounce)
        .accuracy(1e-9)
        .run(BALL.state([1.0], [0.0]), 0.0..2.5)
        .expect("an accurate run");
    let (mut t, mut v) = ((2.0 / BALL.g).sqrt(), (2.0 * BALL.g).sqrt());
    let mut count = 1;
    loop {
        v *= e;
        if t + 2.0 * v / BALL.g > 2.5 {
            break;
        }
        t += 2.0 * v / BALL.g;
        count += 1;
    }
    let exact = v * (2.5 - t) - 0.5 * BALL.g * (2.5 - t).powi(2);
    assert_eq!(motion.events().len(), count);
    assert!((motion.last().q[0] - exact).abs() <= 1e-9);

    // A pendulum that hits a stop, without closed form: compared with a far more accurate run.
    #[dynamics(coordinates(theta), lagrangian = dot(theta)^2/2 + 4*cos(theta), event(stop) = theta + 0.3)]
    struct Stopped;
    let hit = |event: &tfe::Occurrence<'_, 1>| Act::Restart(event.after_impact(0.9));
    let simulation = Simulation::new(&Stopped).on("stop", Crossing::Falling, hit);
    let start = Stopped.state([1.5], [0.0]);
    let fine = simulation
        .clone()
        .element(Mixed::<8>)
        .step(0.01)
        .run(start, 0.0..20.0)
        .expect("a run");
    let error = |motion: &Motion<1>| {
        assert_eq!(motion.events().len(), fine.events().len());
        let (a, b) = (motion.last(), fine.last());
        let p = fine
            .states()
            .iter()
            .fold(0.0_f64, |m, node| m.max(node.p[0].abs()));
        larger((a.q[0] - b.q[0]).abs() / 1.5, (a.p[0] - b.p[0]).abs() / p)
    };
    for accuracy in [1e-4, 1e-6, 1e-9] {
        let motion = simulation
            .clone()
            .accuracy(accuracy)
            .run(start, 0.0..20.0)
            .expect("an accurate run");
        assert!(motion.error_estimate() <= accuracy);
        assert!(
            error(&motion) <= accuracy,
            "{accuracy:e}: {:e}",
            error(&motion)
        );
    }
    for step in [0.1, 0.05] {
        let motion = simulation
            .clone()
            .element(Mixed::<3>)
            .step(step)
            .run_estimated(start, 0.0..20.0)
            .expect("a run");
        let (_, estimate) = motion.error_estimates().last().expect("one a node");
        let error = error(&motion);
        assert!(
            error / 2.0 < estimate && estimate < 2.0 * error,
            "{estimate:e} for {error:e}"
        );
    }
    // If a run stops, the states at the event are compared.
    let motion = Simulation::new(&Stopped)
        .on("stop", Crossing::Falling, |_| Act::Stop)
        .accuracy(1e-8)
        .run(start, 0.0..20.0)
        .expect("an accurate run");
    let event = &fine.events()[0];
    assert!((motion.last().t - event.t).abs() < 1e-8 && motion.last().q[0] + 0.3 < 1e-12);
}

/// A particle in a magnetic field, whose momenta are not proportional to velocities: its impacts are found up to
/// rounding errors of these momenta, in the run and at neighbouring states, from which matrices are computed.
#[test]
fn impacts_with_momenta_of_a_field() {
    #[dynamics(
        coordinates(x, y),
        lagrangian = m/2*(dot(x)^2 + dot(y)^2) + b*(x*dot(y) - y*dot(x)) - k*hypot(x - 1, y)^3,
        event(line) = y - 0.1,
    )]
    struct Particle {
        m: f64,
        b: f64,
        k: f64,
    }
    let mut impacts = 0;
    for size in 0..40_i32 {
        let field = 0.1 * 1.3_f64.powi(size % 20);
        let particle = Particle {
            m: 1.0,
            b: if size < 20 { field } else { -field },
            k: 0.4,
        };
        let start = particle.state([0.1, 0.4], [0.5, -0.2]);
        let run = Simulation::new(&particle)
            .element(Mixed::<6>)
            .step(0.05)
            .on("line", Crossing::Either, |event| {
                Act::Restart(event.after_impact(0.8))
            });
        let matrices = run.run_linearised(start, 0.0..2.0);
        let matrices = matrices.unwrap_or_else(|error| panic!("{field}: {error}"));
        for pair in matrices.motion().states().windows(2) {
            if pair[0].t == pair[1].t {
                impacts += 1;
                let [before, after] = [pair[0].v, pair[1].v];
                let size = field.max(1.0);
                assert!(
                    (after[1] + 0.8 * before[1]).abs() < 1e-14 * size,
                    "{field}: {pair:?}"
                );
                assert!(
                    (after[0] - before[0]).abs() < 1e-14 * size,
                    "{field}: {pair:?}"
                );
            }
        }
    }
    assert!(impacts > 20, "{impacts}");
}
