//! Events in ensembles, and in runs and ensembles that go on where a part of them ended.

use super::*;

/// Ensembles handle the events of each run separately.
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
    assert_eq!(ends.nodes().count(), starts.len());
    for (start, end) in starts.iter().zip(ends.nodes()) {
        let motion = single.run(*start, 0.0..1.5).expect("a run");
        // The search for the velocity of a momentum starts from that of another node, and may differ by a rounding
        // error.
        assert_eq!(
            (end.t, end.state()),
            (motion.last().t, motion.last().state())
        );
    }
    // Also as continued runs, with the same bits.
    let states = |ends: tfe::ensemble::Ends<1>| {
        let states = ends.nodes().map(|node| (node.t, node.state()));
        states.collect::<Vec<_>>()
    };
    let mut parts = ensemble.begin(&starts, 0.0).expect("starts");
    let cut = 9.0 * 0.07; // on the grid
    let middle = parts.run_to(cut).expect("runs");
    let expected = ensemble.run(&starts, 0.0..cut).expect("runs");
    assert_eq!(states(middle), states(expected));
    let mut checkpoint = parts.clone();
    for parts in [&mut parts, &mut checkpoint] {
        let end = parts.run_to(1.5).expect("runs");
        assert_eq!(states(end), states(ends.clone()));
    }
    // Runs that have stopped remain where they did.
    let stopped = ensemble.on("height", Crossing::Falling, |_| Act::Stop);
    let mut parts = stopped.begin(&starts, 0.0).expect("starts");
    let ends = stopped.run(&starts, 0.0..1.5).expect("runs");
    for end in [5.0 * 0.07, 10.0 * 0.07, 1.5] {
        let ends = ends.iter().flatten();
        let reached = parts.run_to(end).expect("runs").into_results();
        for (node, last) in reached.into_iter().flatten().zip(ends) {
            assert_eq!((node.t, &node == last), (end.min(last.t), last.t <= end));
        }
    }
    // Some come to rest: these are failures of their own runs only.
    let dull = |event: &tfe::Occurrence<'_, 1>| Act::Restart(event.after_impact(0.5));
    let ends = Ensemble::new(&BALL)
        .step(0.07)
        .on("height", Crossing::Falling, dull)
        .run(&starts, 0.0..1.5)
        .expect("runs");
    assert!(ends.failures().count() > 0 && ends.nodes().count() > 0);
}

/// One run compared with two halves of it: all nodes, events and their times have the same bits; with impacts, with
/// events that are only recorded, and with those that change nothing.
#[test]
fn halves_of_runs_with_events() {
    fn halves<M: tfe::Model<N> + Sync, const N: usize>(
        run: &Simulation<'_, M, N>,
        start: State<N>,
        h: f64,
    ) {
        let steps = 100;
        let whole = run.run(start, 0.0..f64::from(steps) * h).expect("a run");
        assert!(whole.events().len() > 4, "{}", whole.events().len());
        for cut in 1..steps {
            let time = f64::from(cut) * h;
            let first = run.run(start, 0.0..time).expect("a run");
            let checkpoint = first.checkpoint().expect("complete");
            let second = run.resume(checkpoint, f64::from(steps) * h).expect("a run");
            let number = whole.states().len() - second.states().len();
            assert_eq!(
                &whole.states()[number + 1..],
                &second.states()[1..],
                "{time}"
            );
            let both: Vec<_> = first.events().iter().chain(second.events()).collect();
            assert!(both.into_iter().eq(whole.events()), "{time}");
        }
    }
    let bounce = |event: &tfe::Occurrence<'_, 1>| Act::Restart(event.after_impact(0.9));
    let ball = Simulation::new(&BALL).on("height", Crossing::Falling, bounce);
    halves(&ball.clone().step(0.07), BALL.state([2.0], [0.0]), 0.07);
    let turns = ball.on("rate", Crossing::Either, |_| Act::Record);
    halves(&turns.step(0.03), BALL.state([0.3], [0.0]), 0.03);
    let links = TwoLinks { g: 9.81, w: 0.1 };
    let hit = |event: &tfe::Occurrence<'_, 2>| Act::Restart(event.after_impact(0.98));
    let wall = Simulation::new(&links).on("wall", Crossing::Falling, hit);
    let start = links.state([-1.0, -0.5], [0.0, 0.0]);
    halves(&wall.clone().step(0.1), start, 0.1);
    halves(&wall.solver(Solve::Newton).step(0.1), start, 0.1);
    let start = HenonHeiles.state([0.0, 0.1], [0.45, 0.0]);
    for act in [Act::Record, Act::Impulse([0.0, 0.0])] {
        let run =
            Simulation::new(&HenonHeiles).on("section", Crossing::Either, move |_| act.clone());
        halves(&run.step(0.4), start, 0.4);
    }
}

/// After a run whose events have set parameters, the caller has no model with which to continue: this is an error.
#[test]
fn parts_of_ensembles_whose_events_set_parameters() {
    let springs = spring(4.0);
    let starts = [[1.0], [0.0]].map(|v| springs.state([0.5], v));
    let ensemble = Ensemble::new(&springs)
        .step(0.1)
        .on("middle", Crossing::Falling, |_| {
            Act::Set(Settings::new("k", 1.0))
        });
    let mut parts = ensemble.begin(&starts, 0.0).expect("starts");
    let whole = ensemble.run(&starts, 0.0..1.0).expect("runs");
    // One crosses the middle in the first part, the other in the second.
    let first = parts.run_to(1.0).expect("runs");
    assert_eq!(first.into_results(), whole.into_results());
    let second = parts.run_to(2.0).expect("runs");
    let failures: Vec<_> = second.failures().collect();
    assert!(
        failures.len() == 1 && matches!(failures[0].kind, RunErrorKind::Unsupported { .. }),
        "{failures:?}"
    );
    let third = parts.run_to(3.0).expect("runs");
    assert_eq!((third.nodes().count(), third.failures().count()), (0, 2));
}

/// A run that stops exactly at the end of a part does not continue in the next.
#[test]
fn parts_that_end_where_an_event_stops() {
    #[dynamics(coordinates(x), lagrangian = dot(x)^2/2 - x^4/4, event(alarm) = t - 0.3)]
    struct Timed;
    let start = Timed.state([1.0], [0.0]);
    let stop = |_: &tfe::Occurrence<'_, 1>| Act::Stop;
    let ensemble = Ensemble::new(&Timed)
        .step(0.1)
        .on("alarm", Crossing::Rising, stop);
    let single = Simulation::new(&Timed)
        .step(0.1)
        .on("alarm", Crossing::Rising, stop);
    let end = 3.0 * 0.1;
    assert!(
        single
            .run(start, 0.0..end)
            .expect("a run")
            .checkpoint()
            .is_none()
    );
    let whole = ensemble.run(&[start], 0.0..1.0).expect("runs");
    let mut parts = ensemble.begin(&[start], 0.0).expect("starts");
    assert_eq!(parts.run_to(0.1).expect("runs").nodes().count(), 1);
    for end in [end, 0.7, 1.0] {
        let ends = parts.run_to(end).expect("runs");
        assert_eq!(ends.into_results(), whole.clone().into_results());
    }
}

/// A part that ends where it begins does not change the grid.
#[test]
fn parts_without_a_length() {
    #[dynamics(coordinates(x), lagrangian = dot(x)^2/2 - x^4/4 + x*sin(3*t))]
    struct Pushed;

    let start = Pushed.state([1.0], [0.0]);
    let simulation = Simulation::new(&Pushed).step(0.1);
    let whole = simulation.run(start, 0.0..20.0).expect("a run");
    let mut part = simulation.run(start, 0.0..8.0).expect("a run");
    for _ in 0..2 {
        let checkpoint = part.checkpoint().expect("complete");
        part = simulation.resume(checkpoint, 8.0).expect("a run");
        assert_eq!(part.states(), &whole.states()[80..=80]);
    }
    let checkpoint = part.checkpoint().expect("complete");
    let rest = simulation.resume(checkpoint, 20.0).expect("a run");
    assert_eq!(rest.states(), &whole.states()[80..]);

    let starts = [1.0, 0.5, -0.3].map(|x| Pushed.state([x], [0.0]));
    let ensemble = Ensemble::new(&Pushed).step(0.1);
    let whole = ensemble.run(&starts, 0.0..20.0).expect("runs");
    let mut parts = ensemble.begin(&starts, 0.0).expect("starts");
    assert_eq!(parts.run_to(0.0).expect("runs").nodes().count(), 3);
    let first = parts.run_to(8.0).expect("runs").into_results();
    let again = parts.run_to(8.0).expect("runs").into_results();
    assert_eq!(first, again);
    let last = parts.run_to(20.0).expect("runs");
    assert_eq!(last.into_results(), whole.into_results());
}
