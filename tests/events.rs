//! Events: when they are met, and what is done there.

#[path = "../examples/events_beside_scans.rs"]
mod scans;

use std::f64::consts::PI;
use tfe::RunErrorKind;
use tfe::prelude::*;

#[dynamics(coordinates(y), lagrangian = m/2*dot(y)^2 - m*g*y, event(height) = y, output(rate) = dot(y))]
struct Ball {
    m: f64,
    g: f64,
}

const BALL: Ball = Ball { m: 0.3, g: 9.81 };

/// Fifty bounces, tₖ₊₁ = tₖ + 2 eᵏ⁺¹ v/g: hops become shorter than an element, and than a sample of it.
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
            // Two nodes at each bounce, one with either velocity; dense output stays above the ground.
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

/// It comes to rest by infinitely many bounces.
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

#[dynamics(
    coordinates(x),
    lagrangian = dot(x)^2/2 - x^2/2,
    output(above) = x - level,
    output(place) = x,
    output(speed) = dot(x),
)]
struct Oscillator {
    level: f64,
}

/// x = cos t: pairs within one element and one sample, roots at nodes, backwards, all in order and with their directions.
#[test]
fn all_crossings_of_an_oscillator_are_met() {
    for level in [0.0, 0.5, 0.99, 0.9999, 1.0 - 1e-10, -0.9999, 1.0001] {
        for (h, sign) in [(0.1, 1.0), (1.0, 1.0), (PI / 4.0, 1.0), (0.3, -1.0)] {
            let model = Oscillator { level };
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
            // Near the top x is flat: roundings of x are larger ones of the time.
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

#[test]
fn a_run_that_records_has_the_same_bits() {
    let model = Oscillator { level: 0.3 };
    let start = model.state([1.0], [0.2]);
    let simulation = Simulation::new(&model).step(0.3);
    let plain = simulation.run(start, 0.0..20.0).expect("a run");
    let watched = simulation
        .on("above", Crossing::Rising, |_| Act::Record)
        .on("speed", Crossing::Falling, |_| Act::Record)
        .run(start, 0.0..20.0)
        .expect("a run");
    assert_eq!(plain.states(), watched.states());
    // Four maxima, three ways up.
    assert_eq!(watched.events().len(), 7);
    let in_order = watched
        .events()
        .windows(2)
        .all(|pair| pair[0].t < pair[1].t);
    assert!(in_order);
}

#[test]
fn a_run_stops_at_an_event() {
    let model = Oscillator { level: 0.0 };
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

/// A kick that turns the velocity round at x = 0 makes |cos t|; energies stay.
#[test]
fn impulses_act_at_events() {
    let model = Oscillator { level: 0.0 };
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
    // ∫₀³⁰ |cos t| dt: twenty quarters, from 19/2 π on the sine again.
    let covered = motion.integral(&model, "place").expect("an integral");
    let expected = 19.0 + (1.0 + 30.0_f64.sin());
    assert!(
        (covered[covered.len() - 1] - expected).abs() < 1e-9,
        "{covered:?}"
    );
}

#[dynamics(
    coordinates(x, y),
    momenta(px, py),
    hamiltonian = (px^2 + py^2 + x^2 + y^2)/2 + x^2*y - y^3/3,
    output(section) = x,
)]
struct HenonHeiles;

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

/// Regular motion, so that errors grow with the time alone: a section against one of a tenth of the step.
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
        // Two roundings of the time, which is 9e-13 apart at the end.
        let most = [2.0 * fine[0] * f64::EPSILON, 1e-12, 1e-12];
        for ((a, b), most) in point.iter().zip(fine).zip(most) {
            assert!((a - b).abs() <= most, "{point:?} for {fine:?}");
        }
    }
}

/// Random events of random motions, among them pairs closer than a scan sees, products, waves, jumps and functions of the time, beside scans in 8000 places.
/// `cargo run --release --example events_beside_scans -- 100000` does the same with more of them.
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
    // A state that is none.
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

#[dynamics(
    coordinates(x),
    lagrangian = m/2*dot(x)^2 - k/2*x^2,
    event(middle) = x,
    output(stiffness) = k,
    output(potential) = k/2*x^2,
)]
struct Springs {
    m: f64,
    k: f64,
}

/// A stiffness of 4 to the right and of 1 to the left: half a period of π/2 and one of π, with the same speed in the middle.
#[test]
fn events_set_parameters() {
    let springs = Springs { m: 1.0, k: 4.0 };
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
    // Each side of a node has the outputs of its own arc; the energy changes at no time.
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
    // Arcs: 1 + number of events; settings are those made, statistics add up.
    let arcs: Vec<_> = motion.arcs().collect();
    assert_eq!(arcs.len(), motion.events().len() + 1);
    assert_eq!(motion.settings().len(), motion.events().len());
    let total: u64 = arcs.iter().map(|arc| arc.statistics.steps).sum();
    assert_eq!(total, motion.statistics().steps);
    for (arc, setting) in arcs[1..].iter().zip(motion.settings()) {
        assert_eq!(arc.nodes.start, setting.node);
        assert_eq!(stiffness[setting.node], setting.value);
    }
    // The integral of an output takes the parameter of its arc: over a period, each half has the mean energy 1.
    let integral = motion.integral(&springs, "potential").expect("an integral");
    let last = motion.last();
    let virial = integral[integral.len() - 1] - 0.5 * (2.0 * end);
    let boundary = -0.5 * last.q[0] * last.v[0] / 2.0;
    assert!((virial - boundary).abs() < 1e-9, "{virial} for {boundary}");
    // The model is as it was, and so is the next run.
    assert_eq!(springs.k, 4.0);
    let again = simulation.run(springs.state([1.0], [0.0]), 0.0..end);
    assert_eq!(again.expect("a run").states(), motion.states());
}

#[test]
fn what_is_set_goes_together() {
    let springs = Springs { m: 1.0, k: 1.0 };
    let run = |settings: Settings<1>| {
        Simulation::new(&springs)
            .element(Mixed::<8>)
            .step(0.1)
            .on("middle", Crossing::Falling, move |_| {
                Act::Set(settings.clone())
            })
            .run(springs.state([1.0], [0.0]), 0.0..4.0)
    };
    // Mass and stiffness: the momentum stays, −1, so the speed is half of it.
    let motion = run(Settings::new("m", 2.0).and("k", 8.0)).expect("a run");
    let x = |t: f64| -0.25 * (2.0 * (t - PI / 2.0)).sin();
    assert!((motion.at(2.0).expect("inside").q[0] - x(2.0)).abs() < 1e-12);
    let node = motion.states()[motion.settings()[0].node];
    assert!((node.v[0] + 0.5).abs() < 1e-13 && (node.p[0] + 1.0).abs() < 1e-13);
    // With the velocity given its momentum is that of the new mass.
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
        "there is no parameter `kk` to set: the model has m, k"
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

/// Nodes of `steps` are those of a run, with two at each event.
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

#[dynamics(
    coordinates(a, b),
    let x1 = sin(a),
    let y1 = -cos(a),
    let x2 = x1 + sin(b),
    let y2 = y1 - cos(b),
    lagrangian = (dot(x1)^2 + dot(y1)^2 + dot(x2)^2 + dot(y2)^2)/2 - g*(y1 + y2),
    event(wall) = w - x2,
)]
struct TwoLinks {
    g: f64,
    w: f64,
}

/// The product of the matrices is the derivative of the end of whole runs, across six impacts of the tip of a double pendulum on a wall.
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
    let end = |change: [f64; 4]| {
        let moved = State {
            q: [start.q[0] + change[2], start.q[1] + change[3]],
            p: [start.p[0] + change[0], start.p[1] + change[1]],
        };
        let motion = simulation.run(moved, span.clone()).expect("a run");
        assert_eq!(motion.events().len(), plain.events().len());
        let last = *motion.last();
        [last.p[0], last.p[1], last.q[0], last.q[1]]
    };
    for column in 0..4 {
        let difference = |distance: f64| -> [f64; 4] {
            let moved = |s: f64| {
                let mut change = [0.0; 4];
                change[column] = s;
                end(change)
            };
            let (high, low) = (moved(distance), moved(-distance));
            std::array::from_fn(|row| (high[row] - low[row]) / (2.0 * distance))
        };
        // Extrapolated: of fourth order.
        let (far, near) = (difference(2e-5), difference(1e-5));
        for row in 0..4 {
            let expected = (4.0 * near[row] - far[row]) / 3.0;
            let off = (product[(row, column)] - expected).abs();
            assert!(
                off < 1e-8 * product.amax(),
                "({row}, {column}): {} for {expected}",
                product[(row, column)]
            );
        }
    }
    // Without losses impacts are symplectic.
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

/// Parameters that change on the way: x from rest at 1 with k = 4, then 1. The saltation of a force that jumps at x = 0, where it vanishes, is none: the matrix is the product of two rotations.
#[test]
fn matrices_go_across_settings() {
    let springs = Springs { m: 1.0, k: 4.0 };
    let simulation = Simulation::new(&springs).element(Mixed::<8>).step(0.1).on(
        "middle",
        Crossing::Either,
        |event| Act::Set(Settings::new("k", if event.rises { 4.0 } else { 1.0 })),
    );
    // A whole period: every motion is periodic with the same period, so the matrix is the identity.
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

/// A pendulum in Cartesian coordinates that hits a wall: the same as that of an angle, with multipliers of its rod that hold across.
/// At late times a state behind an impact is beside the wall by what a rounding of the time makes of it; in a short rest of its element that is much, and was taken for another impact.
#[test]
fn impacts_at_late_times_happen_once() {
    #[dynamics(coordinates(y), lagrangian = dot(y)^2/2 - y, event(impact) = y)]
    struct Ball;
    for start in [0.0, 1e3, 1e6, -1e6] {
        for step in [0.03, 0.1, 0.3] {
            let run = Simulation::new(&Ball).element(Mixed::<3>).step(step);
            let run = run.on("impact", Crossing::Either, |event| {
                Act::Restart(event.after_impact(0.9))
            });
            let run = run.run(Ball.state([1.0], [0.0]), start..start + 12.0);
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

    #[dynamics(coordinates(theta), lagrangian = m*l^2/2*dot(theta)^2 + m*g*l*cos(theta), event(wall) = 0.3 - l*sin(theta))]
    struct Angle {
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
    // An impulse against the rod is taken up by it; along it, it acts in full.
    let kick = Simulation::new(&rod)
        .element(Mixed::<6>)
        .step(0.01)
        .on("wall", Crossing::Falling, |event| {
            let (x, y) = (event.q[0] / 1.3, event.q[1] / 1.3);
            // Away from the pivot by 5, along the circle so that the velocity turns round.
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

/// The estimate goes across events: what is asked is met, and what is estimated is within a factor of what is wrong.
#[test]
fn accuracy_is_met_across_events() {
    // Bounces from 1, e = 0.8: the height at the end is known.
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

    // A pendulum that hits a stop, with nothing known in closed form: beside a run that is far better.
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
        ((a.q[0] - b.q[0]).abs() / 1.5).max((a.p[0] - b.p[0]).abs() / p)
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
    // Stopped: the state at the event is compared.
    let motion = Simulation::new(&Stopped)
        .on("stop", Crossing::Falling, |_| Act::Stop)
        .accuracy(1e-8)
        .run(start, 0.0..20.0)
        .expect("an accurate run");
    let event = &fine.events()[0];
    assert!((motion.last().t - event.t).abs() < 1e-8 && motion.last().q[0] + 0.3 < 1e-12);
}

/// A function that the model does not declare, beside the output that is the same.
#[test]
fn functions_are_events() {
    let model = Oscillator { level: 0.3 };
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
    // Derivatives, and impacts, know it as well: the energy ½ (v² + x²) − ⅛ and a moving wall.
    let energy = simulation.clone().on_function(
        "wall",
        Crossing::Falling,
        |t, q, _| q[0] + 0.5 - 0.01 * t,
        |event| Act::Restart(event.after_impact(1.0)),
    );
    let run = energy.run_linearised(start, 0.0..12.0).expect("a run");
    let product = run.product();
    let end = |x: f64, p: f64| {
        let last = *energy
            .run(State { q: [x], p: [p] }, 0.0..12.0)
            .expect("a run")
            .last();
        [last.p[0], last.q[0]]
    };
    for (column, (dx, dp)) in [(0.0, 1e-5), (1e-5, 0.0)].into_iter().enumerate() {
        let high = end(start.q[0] + dx, start.p[0] + dp);
        let low = end(start.q[0] - dx, start.p[0] - dp);
        for row in 0..2 {
            let expected = (high[row] - low[row]) / 2e-5;
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

/// A value that touches zero, and one that grazes it so that both crossings lie within a hundredth of an element.
#[test]
fn tangent_events() {
    for (over, count) in [(0.0, 0), (-1e-9, 0), (1e-6, 2), (1e-10, 2)] {
        let model = Oscillator { level: 1.0 - over };
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

/// The iterator gives the events of a run; its matrices are derivatives of the return map.
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
    // Five returns, by the start.
    let mut product = nalgebra::DMatrix::identity(4, 4);
    let section = simulation.section("section", Crossing::Rising, start, 0.0);
    for point in section.linearised().take(5) {
        let point = point.expect("a point");
        product = point.transition().expect("linearised") * product;
    }
    let end = |column: usize, s: f64| {
        let mut moved = start;
        match column.checked_sub(2) {
            None => moved.p[column] += s,
            Some(a) => moved.q[a] += s,
        }
        let point = points(moved).nth(4).expect("endless");
        [point.p[0], point.p[1], point.q[0], point.q[1]]
    };
    // The start lies on the section: a change along the normal moves the first crossing to before it, or is one itself.
    for column in [0, 1, 3] {
        let difference =
            |s: f64, row: usize| (end(column, s)[row] - end(column, -s)[row]) / (2.0 * s);
        for row in 0..4 {
            let expected = (4.0 * difference(1e-4, row) - difference(2e-4, row)) / 3.0;
            let found = product[(row, column)];
            assert!(
                (found - expected).abs() < 1e-8 * product.amax(),
                "({row}, {column}): {found} for {expected}"
            );
        }
    }
    // Section coordinates y, p_y: the return map keeps the area at constant energy, and g stays zero.
    assert!((0..4).all(|column| product[(2, column)].abs() < 1e-9 * product.amax()));
    let error = simulation
        .section("sektion", Crossing::Rising, start, 0.0)
        .next()
        .expect("one")
        .expect_err("no output");
    assert!(matches!(error, RunErrorKind::NoEvent { .. }));
}

/// x″ + x = F cos ωt against a wall at x = 0 with restitution e: orbits with one impact in n periods of the forcing, in closed form.
///
/// From an impact at t = 0 with the forcing F cos(ωt + ψ), γ = F/(1 − ω²), P = γ cos ψ, S = −γω sin ψ and T = 2πn/ω: x = a cos t + b sin t + γ cos(ωt + ψ) with a = −P and
/// b = a tan T/2, S = −b (1 − e)/(1 + e), so b² (cot² T/2 + ((1 − e)/((1 + e) ω))²) = γ². The monodromy matrix has the determinant e² and the trace −2e cos T + (1 + e) f sin T/v₋ with the
/// acceleration f = F cos ψ at the impact.
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
        // From the middle of the flight on.
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

/// Orbits that switch, with their period: a spring that is stiff on one side.
#[test]
fn orbits_with_settings_and_unknown_periods() {
    let springs = Springs { m: 1.0, k: 4.0 };
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

/// Ensembles look for events, run by run.
#[test]
fn ensembles_meet_the_events_of_single_runs() {
    let bounce = |event: &tfe::Occurrence<'_, 1>| Act::Restart(event.after_impact(0.9));
    let starts: Vec<_> = (1..=12)
        .map(|k| BALL.state([0.2 * f64::from(k)], [0.0]))
        .collect();
    let ensemble = Ensemble::new(&BALL)
        .step(0.07)
        .on("height", Crossing::Falling, bounce);
    let ends = ensemble.run(&starts, 0.0..1.5).expect("runs");
    let single = Simulation::new(&BALL)
        .step(0.07)
        .on("height", Crossing::Falling, bounce);
    for (start, end) in starts.iter().zip(ends.nodes()) {
        let motion = single.run(*start, 0.0..1.5).expect("a run");
        // Velocities are looked for from that of another node, and may differ by a rounding.
        assert_eq!(
            (end.t, end.state()),
            (motion.last().t, motion.last().state())
        );
    }
    assert!(ensemble.begin(&starts, 0.0).is_err());
    // Some come to rest: failures of their own.
    let dull = |event: &tfe::Occurrence<'_, 1>| Act::Restart(event.after_impact(0.5));
    let ends = Ensemble::new(&BALL)
        .step(0.07)
        .on("height", Crossing::Falling, dull)
        .run(&starts, 0.0..1.5)
        .expect("runs");
    assert!(ends.failures().count() > 0 && ends.nodes().count() > 0);
}
