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
    let good = watch("height");
    let unsupported = |kind: &RunErrorKind| matches!(kind, RunErrorKind::EventsUnsupported { .. });
    let linearised = good.run_linearised(start, 0.0..1.0).expect_err("refused");
    let estimated = good.run_estimated(start, 0.0..1.0).expect_err("refused");
    let accurate = good.clone().accuracy(1e-6).run(start, 0.0..1.0);
    let step = good
        .steps(start, 0.0)
        .next()
        .expect("one")
        .expect_err("refused");
    assert!(unsupported(linearised.kind()) && unsupported(estimated.kind()) && unsupported(&step));
    assert!(unsupported(accurate.expect_err("refused").kind()));
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
