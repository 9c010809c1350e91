//! All events are found, at the right times and in order, and none that does not exist.

use super::*;

/// Fifty bounces, tₖ₊₁ = tₖ + 2 eᵏ⁺¹ v/g: hops become shorter than an element, and than the spacing of the samples in
/// it.
#[test]
fn a_ball_bounces_when_it_should() {
    for (step, e) in [(0.01, 0.9), (0.07, 0.9), (0.5, 0.8), (0.01, 0.8)] {
        for element in [Element::mixed(4), Element::radau(3), Element::primal(3)] {
            let bounce = move |event: &tfe::Occurrence<'_, 1>| {
                Act::Restart(event.state_with_velocity([-e * event.v[0]]))
            };
            let first = (2.0 / BALL.g).sqrt();
            let mut times = vec![first];
            let mut hop = 2.0 * first;
            for k in 0..49 {
                hop *= e;
                times.push(times[k] + hop);
            }
            let end = times[49] + 0.4 * e * hop;
            let motion = Simulation::new(&BALL)
                .element(element)
                .step(step)
                .on("height", Crossing::Falling, bounce)
                .run(BALL.state([1.0], [0.0]), 0.0..end)
                .expect("a run");
            let events = motion.events();
            assert_eq!(events.len(), 50, "{element}, h = {step}");
            for (event, time) in events.iter().zip(&times) {
                assert!(
                    (event.t - time).abs() < 1e-13,
                    "{element}: {} for {time}",
                    event.t
                );
                assert!(event.q[0].abs() < 1e-14 && !event.rises && event.v[0] < 0.0);
            }
            // Two nodes at each bounce, with the velocities before and after it; dense output stays above the ground.
            let doubled = motion
                .states()
                .windows(2)
                .filter(|pair| pair[0].t == pair[1].t);
            for pair in doubled {
                assert!((pair[1].v[0] + e * pair[0].v[0]).abs() < 1e-14);
            }
            for k in 0..1000 {
                let node = motion.at(end * f64::from(k) / 1000.0).expect("inside");
                assert!(node.q[0] > -1e-14, "{node:?}");
            }
            assert_eq!(motion.last().t, end);
        }
    }
}

/// The ball comes to rest after infinitely many bounces.
#[test]
fn bounces_without_end_are_told() {
    let error = Simulation::new(&BALL)
        .step(0.1)
        .on("height", Crossing::Falling, |event| {
            Act::Restart(event.state_with_velocity([-0.5 * event.v[0]]))
        })
        .run(BALL.state([1.0], [0.0]), 0.0..5.0)
        .expect_err("a ball at rest");
    let end = 3.0 * (2.0 / BALL.g).sqrt();
    match error.kind() {
        RunErrorKind::EventsWithoutEnd { name, time } => {
            assert_eq!(name, "height");
            assert!((time - end).abs() < 1e-6, "{time} for {end}");
        }
        other => panic!("{other:?}"),
    }
    assert!(error.partial().last().t > 1.0 && error.partial().events().len() > 20);
}

/// Impacts after which the velocity is zero, or too small to be detected: the ball used to fall through the ground
/// without an error.
#[test]
fn what_impacts_stop_does_not_fall_through() {
    for (e, step) in [(0.0, 0.1), (0.0, 0.01), (1e-11, 0.1), (0.005, 0.1)] {
        let error = Simulation::new(&BALL)
            .step(step)
            .on("height", Crossing::Falling, move |event| {
                Act::Restart(event.after_impact(e))
            })
            .run(BALL.state([1.0], [0.0]), 0.0..5.0)
            .expect_err("a ball at rest");
        let end = (2.0 / BALL.g).sqrt() * (1.0 + 2.0 * e / (1.0 - e));
        match error.kind() {
            RunErrorKind::EventsWithoutEnd { name, time } => {
                assert_eq!(name, "height");
                assert!((time - end).abs() < 1e-6, "{e}: {time} for {end}");
            }
            other => panic!("{other:?}"),
        }
        assert!(error.partial().last().q[0].abs() < 1e-9, "{e}");
    }
}

/// x = cos t: pairs of events between two samples of an element, roots at nodes, backwards in time; all are found, in
/// order and with their directions.
#[test]
fn all_crossings_of_an_oscillator_are_met() {
    for level in [0.0, 0.5, 0.99, 0.9999, 1.0 - 1e-10, -0.9999, 1.0001] {
        for (h, sign) in [(0.1, 1.0), (1.0, 1.0), (PI / 4.0, 1.0), (0.3, -1.0)] {
            let model = oscillator(level);
            let end = sign * 20.0;
            let motion = Simulation::new(&model)
                .element(Mixed::<10>)
                .step(h)
                .on("above", Crossing::Either, |_| Act::Record)
                .run(model.state([1.0], [0.0]), 0.0..end)
                .expect("a run");
            let mut expected = Vec::new();
            if level < 1.0 {
                let angle = level.acos();
                for k in 0..4 {
                    let turn = 2.0 * PI * f64::from(k);
                    expected.extend([turn + angle, turn + 2.0 * PI - angle]);
                }
                expected.retain(|time| *time < 20.0);
            }
            let found: Vec<_> = motion.events().iter().map(|event| sign * event.t).collect();
            assert_eq!(found.len(), expected.len(), "{level}, h = {h}: {found:?}");
            // Near its maximum x is flat: a rounding error of x corresponds to a larger error of the time.
            let most = 1e-13 / (1.0 - level * level).abs().sqrt();
            for (k, (time, expected)) in found.iter().zip(&expected).enumerate() {
                assert!(
                    (time - expected).abs() < most,
                    "{level}, h = {h}: {time} for {expected}"
                );
                assert_eq!(motion.events()[k].rises, k % 2 == 1);
            }
        }
    }
}

fn section(start: State<2>, element: Element, step: f64, end: f64) -> Vec<[f64; 3]> {
    let motion = Simulation::new(&HenonHeiles)
        .element(element)
        .step(step)
        .record_every(1000)
        .on("section", Crossing::Rising, |_| Act::Record)
        .run(start, 0.0..end)
        .expect("a run");
    let point = |event: &tfe::Event<2>| [event.t, event.q[1], event.p[1]];
    motion.events().iter().map(point).collect()
}

/// A regular motion, whose errors grow only linearly: a section compared with one computed with a tenth of the step.
#[test]
fn a_thousand_points_of_a_section_are_those_of_finer_runs() {
    let start = State {
        q: [0.0, 0.1],
        p: [0.25, 0.1],
    };
    let points = section(start, Element::mixed(9), 0.25, 6400.0);
    let finer = section(start, Element::mixed(9), 0.025, 6400.0);
    assert!(
        points.len() >= 1000 && points.len() == finer.len(),
        "{}",
        points.len()
    );
    for (point, fine) in points.iter().zip(&finer) {
        // Two rounding errors of the time, which is known to 9e-13 at the end.
        let most = [2.0 * fine[0] * f64::EPSILON, 1e-12, 1e-12];
        for ((a, b), most) in point.iter().zip(fine).zip(most) {
            assert!((a - b).abs() <= most, "{point:?} for {fine:?}");
        }
    }
}

/// Random events of random motions, compared with scans at 8000 times; among them are pairs closer than the scan
/// resolves, products, waves, jumps and functions of the time. `cargo run --release --example events_beside_scans --
/// 100000` makes more of them.
#[test]
fn events_are_those_of_a_scan() {
    let (mut random, mut tally) = (scans::Random(7), scans::Tally::default());
    for number in 0..600 {
        scans::run(number, &mut random, &mut tally).expect("a run");
    }
    assert!(tally.events > 2000 && tally.pairs > 5, "{tally:?}");
    assert_eq!((tally.missed, tally.invented), (0, 0), "{tally:?}");
}

/// Both walls of a corner at once.
#[test]
fn simultaneous_events_are_all_met() {
    #[dynamics(coordinates(x, y), lagrangian = (dot(x)^2 + dot(y)^2)/2, output(right) = 1 - x, output(top) = 1 - y)]
    struct Corner;

    let back = |a: usize| {
        move |event: &tfe::Occurrence<'_, 2>| {
            let mut p = [0.0; 2];
            p[a] = -2.0 * event.p[a];
            Act::Impulse(p)
        }
    };
    let motion = Simulation::new(&Corner)
        .step(0.3)
        .on("right", Crossing::Falling, back(0))
        .on("top", Crossing::Falling, back(1))
        .run(Corner.state([0.0, 0.0], [1.0, 1.0]), 0.0..2.0)
        .expect("a run");
    assert_eq!(motion.events().len(), 2);
    let last = motion.last();
    assert!(
        last.q[0].abs() < 1e-14 && last.q[1].abs() < 1e-14,
        "{last:?}"
    );
    // After an impact without rebound, and without a force towards the wall, the mass slides along the wall.
    for start in [1.0, 0.05, 3.7] {
        let slide = Simulation::new(&Corner)
            .step(0.3)
            .on("right", Crossing::Falling, |event| {
                Act::Restart(event.after_impact(0.0))
            })
            .run(
                Corner.state([0.0, 0.0], [start, 0.1]),
                0.0..1.0 / start + 5.0,
            )
            .expect("a run");
        let last = slide.last();
        assert_eq!(slide.events().len(), 1);
        assert!((last.q[0] - 1.0).abs() < 1e-11, "{last:?}");
        assert!(
            (last.q[1] - 0.1 * last.t).abs() < 1e-11 * last.t,
            "{last:?}"
        );
    }
}

/// A pendulum in Cartesian coordinates that hits a wall: the same as a pendulum in an angle, with multipliers of its
/// rod that are right on both sides of impacts. At late times, the state after an impact differs from the wall by the
/// effect of a rounding error of the time. In a short remaining element this is large relative to the motion, and was
/// taken for another impact.
#[test]
fn impacts_at_late_times_happen_once() {
    let ball = Ball { m: 1.0, g: 1.0 };
    for start in [0.0, 1e3, 1e6, -1e6] {
        for step in [0.03, 0.1, 0.3] {
            let run = Simulation::new(&ball).element(Mixed::<3>).step(step);
            let run = run.on("height", Crossing::Either, |event| {
                Act::Restart(event.after_impact(0.9))
            });
            let run = run.run(ball.state([1.0], [0.0]), start..start + 12.0);
            let run = run.unwrap_or_else(|error| panic!("{start} {step}: {error}"));
            // Flights of √2 · 2 · 0.9ᵏ, k = 1, 2, …, after half of one.
            let flight = |k: i32| 8.0_f64.sqrt() * 0.9_f64.powi(k);
            let mut time = start + 0.5 * flight(0);
            assert_eq!(run.events().len(), 6, "{start} {step}");
            for (event, k) in run.events().iter().zip(1..) {
                assert!((event.t - time).abs() < 1e-12 + 1e-15 * start.abs() * 10.0);
                assert!(!event.rises);
                time += flight(k);
            }
        }
    }
}

/// Times far from zero have fewer digits than step sizes. After impacts, the motion must be that of a run from zero all
/// the same, also backwards in time.
#[test]
fn motions_behind_late_impacts_have_the_digits_of_the_step() {
    // The times of nodes, up to the end, are exact.
    let step = 1.0 / 128.0;
    for sign in [1.0, -1.0] {
        let last = |start: f64| {
            let run = Simulation::new(&BALL).step(step);
            let run = run.on("height", Crossing::Falling, |event| {
                Act::Restart(event.after_impact(0.9))
            });
            let run = run.run(BALL.state([1.0], [0.0]), start..start + 3.0 * sign);
            let run = run.expect("a run");
            assert_eq!(run.events().len(), 4, "{start}");
            (run.last().q[0], run.last().v[0])
        };
        let (q, v) = last(0.0);
        for start in [1e6, 1e9, -1e9] {
            let (late_q, late_v) = last(start);
            // Four impacts, each found to 1e-12 of a step.
            assert!((late_q - q).abs() < 1e-11, "{start}: {late_q} for {q}");
            assert!((late_v - v).abs() < 1e-11, "{start}: {late_v} for {v}");
        }
    }
}

/// A function given by the caller, compared with an equal output of the model.
#[test]
fn functions_are_events() {
    let model = oscillator(0.3);
    let start = model.state([1.0], [0.2]);
    let simulation = Simulation::new(&model).element(Mixed::<8>).step(0.3);
    let declared = simulation
        .clone()
        .on("above", Crossing::Either, |_| Act::Record)
        .run(start, 0.0..20.0)
        .expect("a run");
    let function = simulation
        .clone()
        .on_function(
            "above",
            Crossing::Either,
            |_, q, _| q[0] - 0.3,
            |_| Act::Record,
        )
        .run(start, 0.0..20.0)
        .expect("a run");
    assert_eq!(declared.events().len(), 6);
    for (a, b) in declared.events().iter().zip(function.events()) {
        assert!((a.t - b.t).abs() < 1e-14 && a.rises == b.rises && a.name == b.name);
    }
    // Derivatives and impacts also use the function: the energy ½ (v² + x²) − ⅛, and a moving wall.
    let energy = simulation.clone().on_function(
        "wall",
        Crossing::Falling,
        |t, q, _| q[0] + 0.5 - 0.01 * t,
        |event| Act::Restart(event.after_impact(1.0)),
    );
    let run = energy.run_linearised(start, 0.0..12.0).expect("a run");
    let product = run.product();
    let end = |start: State<1>| {
        let motion = energy.run(start, 0.0..12.0).expect("a run");
        motion.last().state()
    };
    for column in 0..2 {
        let expected = by_start((start, 1e-5), column, end);
        for (row, expected) in expected.iter().enumerate() {
            assert!(
                (product[(row, column)] - expected).abs() < 1e-7,
                "{product}"
            );
        }
    }
    for event in run.motion().events() {
        let after = run
            .motion()
            .states()
            .iter()
            .rev()
            .find(|node| node.t == event.t);
        let rate = after.expect("a node").v[0] - 0.01;
        assert!((rate + (event.v[0] - 0.01)).abs() < 1e-12);
    }
}

/// A value that touches zero, and one with both crossings within a hundredth of an element.
#[test]
fn tangent_events() {
    for (over, count) in [(0.0, 0), (-1e-9, 0), (1e-6, 2), (1e-10, 2)] {
        let model = oscillator(1.0 - over);
        let motion = Simulation::new(&model)
            .element(Mixed::<10>)
            .step(0.7)
            .on("above", Crossing::Either, |_| Act::Record)
            .run(model.state([0.0], [1.0]), 0.0..3.0)
            .expect("a run");
        assert_eq!(motion.events().len(), count, "{over:e}");
        if let [up, down] = motion.events() {
            let half = (2.0 * over).sqrt();
            assert!((up.t - (PI / 2.0 - half)).abs() < 2e-2 * half && up.rises);
            assert!((down.t - (PI / 2.0 + half)).abs() < 2e-2 * half && !down.rises);
        }
    }
}

/// A ball that bounces on the surface of a section: the points of the section are the states before the bounces.
#[test]
fn sections_see_what_acts_on_their_surface() {
    let simulation = Simulation::new(&BALL)
        .step(0.1)
        .on("height", Crossing::Falling, |event| {
            Act::Restart(event.state_with_velocity([-event.v[0]]))
        });
    let start = BALL.state([1.0], [0.0]);
    let points = simulation.section("height", Crossing::Falling, start, 0.0);
    let fall = (2.0 / BALL.g).sqrt();
    let mut count = 0;
    for (point, falls) in points.zip([1.0, 3.0, 5.0]) {
        let point = point.expect("a point");
        assert!((point.t - falls * fall).abs() < 1e-12, "{point:?}");
        assert!(point.v[0] < 0.0, "{point:?}");
        count += 1;
    }
    assert_eq!(count, 3);
}

/// Impulses act in the order of time, in whatever order they were declared; also those before an event in its element.
#[test]
fn impulses_before_an_event_act_in_order() {
    #[dynamics(coordinates(x), lagrangian = dot(x)^2/2, event(place) = x - 0.05)]
    struct Free;

    let start = Free.state([0.0], [1.0]);
    let simulation = Simulation::new(&Free)
        .step(0.1)
        .impulse(0.08, [1.0])
        .impulse(0.02, [1.0])
        .on("place", Crossing::Rising, |event| {
            Act::Restart(event.state())
        });
    let motion = simulation.run(start, 0.0..0.2).expect("a run");
    let nodes = &motion.states()[1..];
    let steps: Vec<_> = simulation
        .steps(start, 0.0)
        .take(nodes.len())
        .map(|node| node.expect("a step"))
        .collect();
    assert!(nodes.len() >= 4, "{nodes:?}");
    for (step, node) in steps.iter().zip(nodes) {
        let is_near = |a: f64, b: f64| (a - b).abs() < 1e-13;
        assert!(
            is_near(step.t, node.t)
                && is_near(step.q[0], node.q[0])
                && is_near(step.p[0], node.p[0]),
            "{step:?} for {node:?}"
        );
    }
    // One of the two has acted, then x = 0.02 + 2 (t − 0.02).
    let at = steps[0];
    assert!((at.p[0] - 2.0).abs() < 1e-13, "{at:?}");
    assert!((at.t - 0.035).abs() < 1e-4 && (at.q[0] - 0.05).abs() < 1e-4);
    let last = steps[steps.len() - 1];
    assert!((last.p[0] - 3.0).abs() < 1e-13, "{last:?}");
    let mut points = simulation.section("place", Crossing::Rising, start, 0.0);
    let point = points.next().expect("a point").expect("a point");
    assert!((point.p[0] - 2.0).abs() < 1e-13, "{point:?}");
}

/// An element with a quadrature point at its start that begins at a break uses the force after the break, also if it is
/// shortened by an event.
#[test]
fn events_behind_a_break() {
    #[dynamics(
        coordinates(x),
        lagrangian = dot(x)^2/2,
        force(x) = select(t <= 0.5, 1, 0),
        event(place) = x - 0.14,
    )]
    struct Pushed;

    let start = Pushed.state([0.0], [0.0]);
    let simulation = Simulation::new(&Pushed)
        .element(Element::primal(3).lobatto())
        .step(0.1)
        .break_at(0.5)
        .on("place", Crossing::Rising, |_| Act::Stop);
    let is_there = |t: f64, x: f64, p: f64| {
        // x = 1/8 with the velocity 1/2 at the break.
        assert!(
            (t - 0.53).abs() < 1e-13 && (x - 0.14).abs() < 1e-13 && (p - 0.5).abs() < 1e-13,
            "t = {t}, x = {x}, p = {p}"
        );
    };
    let motion = simulation.run(start, 0.0..1.0).expect("a run");
    let last = motion.last();
    is_there(last.t, last.q[0], last.p[0]);
    let last = simulation.steps(start, 0.0).last();
    let last = last.expect("a step").expect("a step");
    is_there(last.t, last.q[0], last.p[0]);
    // The momentum there does not depend on the time of the event.
    let sensitive = simulation.run_sensitive(start, 0.0..1.0).expect("a run");
    let slopes = sensitive.by_start().last();
    let expected = [[1.0, 0.0], [0.0, 0.0]];
    for (a, row) in expected.iter().enumerate() {
        for (b, expected) in row.iter().enumerate() {
            let slope = slopes[(a, b)];
            assert!((slope - expected).abs() < 1e-11, "({a}, {b}): {slope}");
        }
    }
}
