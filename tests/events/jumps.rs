//! Events at jumps, at the start of a run, and many of them in one step; sections that are not crossed.

use super::*;

#[dynamics(
    coordinates(x, y),
    lagrangian = (dot(x)^2 + dot(y)^2)/2 - x^2/2,
    input(u),
    output(switch) = u - 0.25,
    output(side) = select(x > level, 3, -1),
    output(beyond) = x - level,
)]
struct Switched {
    level: f64,
}

/// A function that jumps has no slope. Its event was met up to 5e-5 of a step beside the jump, and again after an action.
#[test]
fn events_at_jumps_are_met_at_their_times() {
    let model = Switched { level: 0.3 };
    let start = model.state([0.0, 0.0], [1.0, 0.0]);
    let acts: [fn(&tfe::Occurrence<'_, 2>) -> Act<2>; 2] =
        [|_| Act::Record, |event| Act::Restart(event.state())];
    for (h, act) in [0.02, 0.3, 0.7]
        .into_iter()
        .flat_map(|h| acts.map(|act| (h, act)))
    {
        let simulation = Simulation::new(&model).element(Mixed::<8>).step(h);
        let run = |simulation: Simulation<'_, tfe::Driven<'_, Switched>, 2>| {
            let both =
                simulation
                    .on("switch", Crossing::Either, act)
                    .on("side", Crossing::Rising, act);
            both.run(start, 0.0..3.0).expect("a run")
        };
        let times = [0.0, 1.0, 2.0];
        let table = run(simulation
            .clone()
            .table("u", times, [0.0, 1.0, 0.0], Interpolation::Hold));
        let pulse = |t: f64| if (1.0..2.0).contains(&t) { 1.0 } else { 0.0 };
        let function = run(simulation.input("u", pulse));
        for motion in [table, function] {
            let found: Vec<_> = motion
                .events()
                .iter()
                .map(|event| (&*event.name, event.t))
                .collect();
            // x = sin t, in steps whose errors at nodes are below 1e-10.
            let expected = [("side", 0.3_f64.asin()), ("switch", 1.0), ("switch", 2.0)];
            assert_eq!(found.len(), 3, "{h}: {found:?}");
            for (found, expected) in found.iter().zip(expected) {
                assert_eq!(found.0, expected.0);
                assert!(
                    (found.1 - expected.1).abs() <= 1e-10,
                    "{h}: {found:?} {expected:?}"
                );
            }
        }
    }
}

/// A motion that starts at rest on the surface: rounding errors, and those of the polynomial between nodes, made an event
/// of its leaving.
#[test]
fn leaving_the_surface_is_no_event() {
    for level in [0.3, 0.7, 1.0, 1e3] {
        let model = Switched { level };
        let start = model.state([level, 0.0], [0.0, 0.0]);
        for element in [
            Element::mixed(3),
            Element::mixed(4),
            Element::mixed(6),
            Element::radau(3),
        ] {
            for (crossing, h) in [(Crossing::Either, 0.1), (Crossing::Falling, 0.4)] {
                let run = Simulation::new(&model)
                    .element(element)
                    .step(h)
                    .input("u", |_| 0.0);
                let run = run.on("beyond", crossing, |_| Act::Stop);
                let motion = run.run(start, 0.0..3.0).expect("a run");
                assert!(
                    motion.events().is_empty(),
                    "{element}, {level}: {:?}",
                    motion.events()
                );
            }
        }
    }
}

/// A thousand events in one step were taken for events without an end.
#[test]
fn two_thousand_bounces_in_one_step_are_met() {
    #[dynamics(coordinates(y), lagrangian = dot(y)^2/2 - 10*y, event(ground) = y)]
    struct Ball {}
    let ball = Ball {};
    // From 5 to the ground in 1, and again every 2.
    let run = Simulation::new(&ball)
        .step(4000.0)
        .on("ground", Crossing::Falling, |event| {
            Act::Restart(event.after_impact(1.0))
        });
    let motion = run
        .run(ball.state([5.0], [0.0]), 0.0..4000.0)
        .expect("a run");
    assert_eq!(motion.events().len(), 2000);
    assert!((motion.last().q[0] - 5.0).abs() <= 1e-8);
}

/// The search for the first point did not end.
#[test]
fn a_section_that_is_never_crossed_is_an_error() {
    let simulation = Simulation::new(&HenonHeiles).element(Mixed::<4>).step(0.5);
    let start = State {
        q: [0.0, 0.1],
        p: [0.3, 0.0],
    };
    // The motion crosses x = 0 about every 6.
    let mut points = simulation
        .section("section", Crossing::Rising, start, 0.0)
        .within(100);
    assert!(points.by_ref().take(20).all(|point| point.is_ok()));
    let mut few = simulation
        .section("section", Crossing::Rising, start, 0.0)
        .within(3);
    let error = few.next().expect("an error").expect_err("no point");
    let RunErrorKind::NoCrossing { from, time, .. } = error else {
        panic!("{error}");
    };
    assert_eq!((from, time), (0.0, 1.5));
    assert!(few.next().is_none());
}
