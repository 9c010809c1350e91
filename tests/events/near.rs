//! Events close to each other, close to nodes, and simultaneous ones: each is found once, in order.

use super::*;

/// Distances between events, below and above the resolution of the time.
const DISTANCES: [f64; 9] = [1e-15, 1e-14, 1e-13, 1e-12, 1e-11, 1e-10, 1e-9, 1e-8, 1e-7];

/// The node at a time, from an element that ends there.
fn node_at(
    simulation: &Simulation<'_, HenonHeiles, 2>,
    start: State<2>,
    time: f64,
    end: f64,
) -> tfe::Node<2> {
    let clock = simulation.clone().on_function(
        "clock",
        Crossing::Either,
        move |t, _, _| t - time,
        |_| Act::Stop,
    );
    *clock.run(start, 0.0..end).expect("a run").last()
}

fn dot(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

fn turned([x, y]: [f64; 2], angle: f64) -> [f64; 2] {
    let (sine, cosine) = angle.sin_cos();
    [cosine * x - sine * y, sine * x + cosine * y]
}

/// Asserts that each event occurs once, in the order of the run and close to the time that belongs to its name.
#[track_caller]
fn check(motion: &Motion<2>, expected: &[(&str, f64)], error: f64, what: &str) {
    let sign = motion.last().t.signum();
    let events = motion.events();
    assert_eq!(events.len(), expected.len(), "{what}: {events:?}");
    for (name, time) in expected {
        let mut found = events.iter().filter(|event| event.name == *name);
        let event = found.next();
        let event = event.unwrap_or_else(|| panic!("{what}: {name} is lost: {events:?}"));
        assert!(
            (event.t - time).abs() <= error,
            "{what}: {event:?} for {time}"
        );
        assert!(found.next().is_none(), "{what}: {events:?}");
    }
    for pair in events.windows(2) {
        assert!(sign * (pair[1].t - pair[0].t) >= 0.0, "{what}: {pair:?}");
    }
}

/// Three lines that a curved motion crosses at times 1e-15 to 1e-7 apart, in all orders. Polynomials of low degree have
/// slightly different crossing times. If they have another order, the element that ends at the first event is already
/// past the second one, which used to be lost, or found twice if the first was only recorded.
#[test]
fn near_events_are_met_once_each() {
    let elements = [
        (Element::mixed(2), 0.2),
        (Element::mixed(3), 0.3),
        (Element::primal(3), 0.2),
        (Element::radau(3), 0.3),
    ];
    let starts = [
        ([0.1, 0.2], [0.4, 0.1]),
        ([-0.1, 0.15], [0.3, -0.3]),
        ([0.05, -0.2], [-0.2, 0.4]),
    ];
    let acts: [fn(&tfe::Occurrence<'_, 2>) -> Act<2>; 3] = [
        |_| Act::Record,
        |event| Act::Restart(event.state()),
        |_| Act::Impulse([1e-3, -1e-3]),
    ];
    for (element, h) in elements {
        let simulation = Simulation::new(&HenonHeiles).element(element).step(h);
        for number in 0..2 * starts.len() {
            let sign: f64 = if number < starts.len() { 1.0 } else { -1.0 };
            let (q, p) = starts[number % starts.len()];
            let start = State { q, p };
            let (time, end) = (sign * 1.37 * h, sign * 2.0 * h);
            let at = node_at(&simulation, start, time, end);
            // Vanishes a given time after the motion has passed the node.
            let line = |angle: f64, later: f64| {
                let normal = turned(at.v, angle);
                let value = dot(normal, at.q) + later * dot(normal, at.v);
                move |_: f64, q: &[f64; 2], _: &[f64; 2]| dot(normal, *q) - value
            };
            for distance in DISTANCES.into_iter().flat_map(|d| [d, -d]) {
                let later = -0.7 * distance;
                let (two, three) = (time + distance, time + later);
                let expected = [("one", time), ("two", two), ("three", three)];
                for pair in 0..acts.len() * acts.len() {
                    let (first, second) = (acts[pair % acts.len()], acts[pair / acts.len()]);
                    let run = simulation
                        .clone()
                        .on_function("one", Crossing::Either, line(0.3, 0.0), first)
                        .on_function("two", Crossing::Either, line(-0.4, distance), second)
                        .on_function("three", Crossing::Either, line(0.1, later), acts[0]);
                    let what = format!("{element}, to {end}, {q:?}, {distance:e}, {pair}");
                    let motion = run.run(start, 0.0..end);
                    let motion = motion.unwrap_or_else(|error| panic!("{what}: {error}"));
                    let error = 0.2 * distance.abs() + 2e-13;
                    check(&motion, &expected, error, &what);
                }
            }
        }
    }
}

/// The same for positions and velocities: the velocity of a polynomial is not that of its nodes, so that after an event
/// the value may be back on the side from where it came.
#[test]
fn near_events_of_velocities_are_met_once_each() {
    let starts = [
        ([0.2, 0.2], [0.3, 0.2]),
        ([-0.15, 0.25], [-0.3, 0.2]),
        ([0.3, -0.1], [0.2, -0.3]),
    ];
    let acts: [fn(&tfe::Occurrence<'_, 2>) -> Act<2>; 2] =
        [|_| Act::Record, |event| Act::Restart(event.state())];
    let h = 0.2;
    for element in [Element::mixed(4), Element::mixed(6)] {
        for (q, p) in starts {
            let start = State { q, p };
            let simulation = Simulation::new(&HenonHeiles).element(element).step(h);
            let (time, end) = (1.37 * h, 2.0 * h);
            let at = node_at(&simulation, start, time, end);
            let later = node_at(&simulation, start, time + 1e-3, end);
            let normal = [later.v[0] - at.v[0], later.v[1] - at.v[1]];
            let along = at.v;
            let from = dot(along, at.q);
            for distance in DISTANCES.into_iter().flat_map(|d| [d, -d]) {
                let there = node_at(&simulation, start, time + distance, end);
                let rate = dot(normal, there.v);
                let expected = [("place", time), ("speed", time + distance)];
                let place = move |_: f64, q: &[f64; 2], _: &[f64; 2]| dot(along, *q) - from;
                let speed = move |_: f64, _: &[f64; 2], v: &[f64; 2]| dot(normal, *v) - rate;
                let either = Crossing::Either;
                for number in 0..8 {
                    let (first, second) = (acts[number % 2], acts[number / 2 % 2]);
                    let run = simulation.clone();
                    let run = match number < 4 {
                        true => run
                            .on_function("place", either, place, first)
                            .on_function("speed", either, speed, second),
                        false => run
                            .on_function("speed", either, speed, second)
                            .on_function("place", either, place, first),
                    };
                    let what = format!("{element}, {q:?}, {distance:e}, {number}");
                    let motion = run.run(start, 0.0..end);
                    let motion = motion.unwrap_or_else(|error| panic!("{what}: {error}"));
                    check(&motion, &expected, 0.2 * distance.abs() + 1e-12, &what);
                }
            }
        }
    }
}

/// Three calls of `on` for each impact, on whichever side of the ground the ball is by rounding: the second and the
/// third are given the state that the first has made.
#[test]
fn calls_for_one_event_act_in_the_order_of_their_declaration() {
    const E: f64 = 0.7;
    let bounce =
        |event: &tfe::Occurrence<'_, 1>| Act::Restart(event.state_with_velocity([-E * event.v[0]]));
    for number in 0..60 {
        let height = 0.3 + 0.037 * f64::from(number);
        let first = (2.0 * height / BALL.g).sqrt();
        let end = first * (1.0 + 2.0 * E + E * E);
        for step in [0.03, 0.1] {
            let record = |_: &tfe::Occurrence<'_, 1>| Act::Record;
            let start = BALL.state([height], [0.0]);
            let simulation = Simulation::new(&BALL).step(step);
            let after = simulation
                .clone()
                .on("height", Crossing::Falling, bounce)
                .on("height", Crossing::Falling, record)
                .on("height", Crossing::Either, record);
            let motion = after.run(start, 0.0..end).expect("a run");
            assert_eq!(motion.events().len(), 6, "{height}, {step}");
            for (met, time) in motion.events().chunks(3).zip([1.0, 1.0 + 2.0 * E]) {
                let [one, two, three] = met else {
                    panic!("{met:?}");
                };
                assert!((one.t - time * first).abs() < 1e-13, "{one:?}");
                assert!(two.t == one.t && three.t == one.t, "{met:?}");
                assert!(!(one.rises || two.rises || three.rises), "{met:?}");
                assert!(one.v[0] < 0.0, "{one:?}");
                assert!((two.v[0] + E * one.v[0]).abs() < 1e-14, "{two:?}");
                assert_eq!(two.v, three.v);
            }
            // Those before it are given the state without its act.
            let before = simulation.on("height", Crossing::Either, record).on(
                "height",
                Crossing::Falling,
                bounce,
            );
            let motion = before.run(start, 0.0..end).expect("a run");
            assert_eq!(motion.events().len(), 4, "{height}, {step}");
            for met in motion.events().chunks(2) {
                assert_eq!((met[0].t, met[0].v), (met[1].t, met[1].v), "{height}");
            }
            // The act that stops the run is the last one.
            let stopped = Simulation::new(&BALL)
                .step(step)
                .on("height", Crossing::Falling, record)
                .on("height", Crossing::Falling, |_| Act::Stop)
                .on("height", Crossing::Falling, bounce);
            let motion = stopped.run(start, 0.0..end).expect("a run");
            assert_eq!(motion.events().len(), 2, "{height}, {step}");
            assert!(motion.last().v[0] < 0.0);
        }
    }
}

/// An impact exactly at the end of a run: there is nothing to continue, but all acts that belong to it are done.
#[test]
fn events_at_the_very_end_are_all_met() {
    let bounce = |event: &tfe::Occurrence<'_, 1>| {
        Act::Restart(event.state_with_velocity([-0.5 * event.v[0]]))
    };
    let simulation = Simulation::new(&BALL)
        .step(0.05)
        .on("height", Crossing::Falling, bounce)
        .on("height", Crossing::Falling, |_| Act::Record);
    let start = BALL.state([1.0], [0.0]);
    let impact = (2.0 / BALL.g).sqrt();
    let mut counts = [0; 3];
    for k in -8..=8 {
        let end = impact * (1.0 + f64::from(k) * f64::EPSILON);
        let motion = simulation.run(start, 0.0..end).expect("a run");
        let (events, last) = (motion.events(), motion.last());
        assert!(matches!(events.len(), 0 | 2), "{k}: {events:?}");
        counts[events.len()] += 1;
        assert_eq!(last.t, end);
        assert_eq!(last.v[0] > 0.0, events.len() == 2, "{k}: {last:?}");
    }
    assert!(counts[0] > 0 && counts[2] > 0, "{counts:?}");
}

/// If an act moves the value of another event function across zero, this is not an event; if the motion does so, it is.
#[test]
fn acts_that_jump_over_zero_make_no_events() {
    let model = oscillator(0.0);
    let start = model.state([1.0], [0.0]);
    let names = |place: State<1>| {
        let run = Simulation::new(&model)
            .element(Mixed::<6>)
            .step(0.3)
            .on("place", Crossing::Falling, move |_| Act::Restart(place))
            .on_function(
                "beyond",
                Crossing::Falling,
                |_, q, _| q[0] + 0.25,
                |_| Act::Record,
            );
        let motion = run.run(start, 0.0..2.0).expect("a run");
        let names = motion.events().iter().map(|event| event.name.clone());
        names.collect::<Vec<_>>()
    };
    let state = |q: f64| State { q: [q], p: [-1.0] };
    assert_eq!(names(state(0.0)), ["place", "beyond"]);
    assert_eq!(names(state(-0.24)), ["place", "beyond"]);
    assert_eq!(names(state(-0.5)), ["place"]);
}

/// A stiffness that changes whenever the velocity vanishes. After such an event, polynomials begin with a velocity that
/// may not have vanished yet: this must not lead to another event, or to events without end.
#[test]
fn parameters_are_set_where_velocities_vanish() {
    let springs = spring(4.0);
    let start = springs.state([0.5], [1.0]);
    for degree in [2, 3, 4, 6] {
        for step in [0.03, 0.05, 0.1] {
            let run = Simulation::new(&springs)
                .element(Element::mixed(degree))
                .step(step)
                .on_function(
                    "turn",
                    Crossing::Either,
                    |_, _, v| v[0],
                    |event| {
                        let is_stiff = event.parameter("k") == Some(4.0);
                        Act::Set(Settings::new("k", if is_stiff { 1.0 } else { 4.0 }))
                    },
                );
            let motion = run.run(start, 0.0..12.0);
            let motion = motion.unwrap_or_else(|error| panic!("{degree}, {step}: {error}"));
            // An eighth of a period, then half a period with each stiffness.
            let mut time = PI / 8.0;
            let halves = [PI, 0.5 * PI].into_iter().cycle();
            assert_eq!(motion.events().len(), 5, "{degree}, {step}");
            for (event, half) in motion.events().iter().zip(halves) {
                assert!((event.t - time).abs() < 0.1, "{degree}, {step}: {event:?}");
                time += half;
            }
        }
    }
}

/// A value that is zero for a while between two signs, with and without another event in that interval.
#[test]
fn values_that_stay_at_zero_have_one_event() {
    fn flat(_: f64, q: &[f64; 1], _: &[f64; 1]) -> f64 {
        let x = q[0];
        if x.abs() < 0.2 {
            0.0
        } else {
            x - 0.2 * x.signum()
        }
    }
    let model = oscillator(0.0);
    let start = model.state([1.0], [0.0]);
    let acts: [fn(&tfe::Occurrence<'_, 1>) -> Act<1>; 2] =
        [|_| Act::Record, |event| Act::Restart(event.state())];
    for step in [0.07, 0.3, 1.0] {
        for (number, act) in acts.into_iter().enumerate() {
            for other in acts {
                let run = Simulation::new(&model)
                    .element(Mixed::<8>)
                    .step(step)
                    .on_function("flat", Crossing::Falling, flat, act)
                    .on("place", Crossing::Falling, other);
                let motion = run.run(start, 0.0..3.0).expect("a run");
                let events = motion.events();
                assert_eq!(events.len(), 2, "{step}, {number}: {events:?}");
                let flat = events.iter().find(|event| event.name == "flat");
                let flat = flat.expect("an event");
                assert!(flat.q[0].abs() < 0.2 + 1e-9, "{step}, {number}: {flat:?}");
            }
        }
    }
}

/// Events within rounding errors of a node leave a consistent motion: its elements end at its nodes.
#[test]
fn events_beside_nodes_leave_motions_whole() {
    let model = oscillator(0.0);
    let start = model.state([1.0], [0.0]);
    let simulation = Simulation::new(&model).element(Mixed::<6>).step(0.1);
    let plain = simulation.run(start, 0.0..1.0).expect("a run");
    for node in [1, 3, 7] {
        let time = plain.states()[node].t;
        for k in -10..=10 {
            let time = time * (1.0 + 0.5 * f64::from(k) * f64::EPSILON);
            let run = simulation.clone().on_function(
                "clock",
                Crossing::Rising,
                move |t, _, _| t - time,
                |event| Act::Restart(event.state()),
            );
            let motion = run.run(start, 0.0..1.0).expect("a run");
            let events = motion.events();
            assert_eq!(events.len(), 1, "{node}, {k}: {events:?}");
            assert!((events[0].t - time).abs() <= 4.0 * f64::EPSILON);
            let integral = motion.integral(&model, "place");
            let integral = integral.unwrap_or_else(|error| panic!("{node}, {k}: {error}"));
            let all = integral[integral.len() - 1];
            assert!((all - 1.0_f64.sin()).abs() < 1e-10, "{node}, {k}: {all}");
            for offset in -10..=10 {
                let near = time * (1.0 + f64::from(offset) * f64::EPSILON);
                let x = motion.at(near).expect("inside").q[0];
                assert!((x - near.cos()).abs() < 1e-8, "{node}, {k}: {x}");
            }
        }
    }
}

/// An impulse at the time of an event that shortens its element acts once, before or after the event.
#[test]
fn impulses_at_the_times_of_events_act_once() {
    let model = oscillator(0.0);
    let start = model.state([1.0], [0.0]);
    for number in 0..200 {
        let time = 0.1 + 0.8 * (f64::from(number) * 0.618_033_988_749_895).fract();
        for sign in [1.0, -1.0] {
            let run = Simulation::new(&model)
                .element(Mixed::<6>)
                .step(0.1)
                .impulse(sign * time, [0.5])
                .on_function(
                    "clock",
                    Crossing::Either,
                    move |t, _, _| t - sign * time,
                    |event| Act::Restart(event.state()),
                );
            let motion = run.run(start, 0.0..sign * 1.5).expect("a run");
            assert_eq!(motion.events().len(), 1, "{}", sign * time);
            let x = 1.5_f64.cos() + 0.5 * (1.5 - time).sin();
            let last = motion.last().q[0];
            assert!((last - x).abs() < 1e-8, "{}: {last} for {x}", sign * time);
        }
    }
}

/// A value whose sign an impulse at a node changes has its event there, after the impulse, as in models of run-time
/// length. An impulse at the end of a run acts also if an event is there.
#[test]
fn impulses_at_nodes_are_events_at_nodes() {
    let model = oscillator(0.0);
    let start = model.state([1.0], [0.0]);
    let acts: [fn(&tfe::Occurrence<'_, 1>) -> Act<1>; 4] = [
        |_| Act::Record,
        |event| Act::Restart(event.state()),
        |_| Act::Impulse([0.1]),
        |_| Act::Stop,
    ];
    // v = −sin t up to there.
    let behind = 1.0 - 0.5_f64.sin();
    for element in [Element::mixed(6), Element::primal(4), Element::radau(4)] {
        let run = Simulation::new(&model).element(element).step(0.1);
        let run = run.impulse(0.5, [1.0]);
        for (number, act) in acts.into_iter().enumerate() {
            let run = run.clone().on("speed", Crossing::Either, act);
            let motion = run.run(start, 0.0..0.9).expect("a run");
            let [event] = motion.events() else {
                panic!("{element}, {number}: {:?}", motion.events());
            };
            assert_eq!(event.t, 0.5, "{element}, {number}");
            let off = (event.v[0] - behind).abs();
            assert!(off < 1e-6 && event.rises, "{element}, {number}: {event:?}");
            if number == 3 {
                // The node before the impulse, and the one at which the run stops.
                let [.., before, last] = motion.states() else {
                    panic!("{element}: {motion:?}");
                };
                assert_eq!((before.t, last.t), (0.5, 0.5));
                assert!((before.p[0] - (behind - 1.0)).abs() < 1e-6, "{before:?}");
                assert_eq!(last.p, event.p, "{element}");
                assert!((last.v[0] - event.v[0]).abs() < 1e-14, "{last:?}");
                let stopped = run.steps(start, 0.0).last().expect("a step");
                assert_eq!(stopped.expect("a step").p, event.p, "{element}");
                let sensitive = run.run_sensitive(start, 0.0..0.9).expect("derivatives");
                assert_eq!(sensitive.motion().last().p, event.p, "{element}");
                // The time of the impulse does not depend on the start: ∂p/∂q = −sin t.
                let slope = sensitive.by_start().last()[(0, 1)];
                assert!((slope + 0.5_f64.sin()).abs() < 1e-6, "{slope}");
                continue;
            }
            if number == 2 {
                let run = run.run_linearised(start, 0.0..0.9).expect("matrices");
                let (sin, cos) = 0.9_f64.sin_cos();
                let product = run.product();
                for (place, expected) in [cos, -sin, sin, cos].into_iter().enumerate() {
                    let off = (product[(place / 2, place % 2)] - expected).abs();
                    assert!(off < 1e-6, "{element}: {product}");
                }
            }
            let kicks = if number == 2 { 1.1 } else { 1.0 };
            let x = 0.9_f64.cos() + kicks * 0.4_f64.sin();
            let off = (motion.last().q[0] - x).abs();
            assert!(off < 1e-6, "{element}, {number}: {off:e}");
        }
        let ending = run.on("speed", Crossing::Either, |_| Act::Impulse([0.0]));
        let motion = ending.run(start, 0.0..0.5).expect("a run");
        let off = (motion.last().v[0] - behind).abs();
        assert!(off < 1e-6, "{element}: {off:e}");
    }
}

/// Directions are those of the run.
#[test]
fn what_falls_in_a_run_back_in_time_is_falling() {
    let model = oscillator(0.0);
    let start = model.state([1.0], [0.0]);
    for (crossing, expected) in [
        (Crossing::Falling, vec![-0.5 * PI]),
        (Crossing::Rising, vec![-1.5 * PI]),
        (Crossing::Either, vec![-0.5 * PI, -1.5 * PI]),
    ] {
        for act in [Act::Record, Act::Impulse([0.0])] {
            let run = Simulation::new(&model).element(Mixed::<8>).step(0.3).on(
                "place",
                crossing,
                move |_| act.clone(),
            );
            let motion = run.run(start, 0.0..-6.0).expect("a run");
            assert_eq!(motion.events().len(), expected.len(), "{crossing:?}");
            for (event, time) in motion.events().iter().zip(&expected) {
                assert!((event.t - time).abs() < 1e-10, "{event:?} for {time}");
                assert_eq!(event.rises, event.t < -PI);
            }
        }
    }
}

/// A run that begins or ends where a value is zero has not seen its sign change; a run that continues from there does.
#[test]
fn zeros_at_the_ends_of_runs() {
    let model = oscillator(0.0);
    let start = model.state([1.0], [0.0]);
    let simulation = Simulation::new(&model).element(Mixed::<6>).step(0.1);
    let plain = simulation.run(start, 0.0..1.0).expect("a run");
    let node = plain.states()[5].t;
    for is_cut in [false, true] {
        let act = move |event: &tfe::Occurrence<'_, 1>| match is_cut {
            false => Act::Record,
            true => Act::Restart(event.state()),
        };
        let run = simulation.clone().on_function(
            "clock",
            Crossing::Either,
            move |t, _, _| t * (t - node),
            act,
        );
        let first = run.run(start, 0.0..node).expect("a run");
        assert!(first.events().is_empty());
        let checkpoint = first.checkpoint().expect("complete");
        let second = run.resume(checkpoint, 1.0).expect("a run");
        assert_eq!(second.events().len(), 1);
        assert_eq!(second.events()[0].t, node);
        let whole = run.run(start, 0.0..1.0).expect("a run");
        assert_eq!(whole.events(), second.events());
    }
}

/// A run that continues from an event takes account of all acts that were done there, not only of the last: none is
/// repeated if the polynomial after the event begins with another velocity than the node.
#[test]
fn calls_at_the_end_of_a_run_are_not_made_again_behind_it() {
    let model = oscillator(0.0);
    let start = model.state([1.0], [0.3]);
    let again = |event: &tfe::Occurrence<'_, 1>| Act::Restart(event.state());
    for nodes in [3, 4, 6] {
        for step in [0.1, 0.17, 0.23, 0.3] {
            let run = Simulation::new(&model)
                .element(Element::mixed(nodes))
                .step(step)
                .on("speed", Crossing::Either, again)
                .on("speed", Crossing::Either, again)
                .on("speed", Crossing::Either, again);
            let whole = run.run(start, 0.0..20.0).expect("a run");
            // −sin t + 0.3 cos t has seven zeros.
            assert_eq!(whole.events().len(), 21, "{nodes}, {step}");
            for event in whole.events().iter().step_by(3) {
                let first = run.run(start, 0.0..event.t).expect("a run");
                let checkpoint = first.checkpoint().expect("complete");
                let second = run.resume(checkpoint, 20.0).expect("a run");
                let met = first.events().len() + second.events().len();
                assert_eq!(met, 21, "{nodes}, {step}, {}", event.t);
            }
        }
    }
}

/// A run that begins at a zero of a function has no event there, whatever sign the polynomial of the first element has
/// within its error.
#[test]
fn zeros_at_the_start_are_no_events() {
    let model = oscillator(0.0);
    // The velocity is −sin t.
    let start = model.state([1.0], [0.0]);
    for element in [
        Element::mixed(4),
        Element::mixed(6),
        Element::primal(4),
        Element::three_field(4),
        Element::radau(4),
    ] {
        for span in [0.0..3.5, 0.0..-3.5] {
            let run = Simulation::new(&model).element(element).step(0.1).on(
                "speed",
                Crossing::Either,
                |_| Act::Stop,
            );
            let end = run.run(start, span).expect("a run").last().t;
            let off = (end.abs() - std::f64::consts::PI).abs();
            assert!(off < 1e-5, "{element}: {end}");
        }
    }
}
