//! Derivatives between the nodes, and of integrals.

use super::*;

const SPAN: f64 = 1.0;
/// Times between nodes, within pieces of elements, and at nodes.
const TIMES: [f64; 6] = [0.013, 0.26, 0.5, 0.61, 0.777, 0.98];

/// The values of a motion at [`TIMES`], and its integral.
fn seen<M, const N: usize>(
    simulation: &Simulation<'_, M, N>,
    model: &M,
    start: State<N>,
    output: &str,
) -> ([[Vec<f64>; 3]; TIMES.len()], f64)
where
    M: Model<N> + Sync,
{
    let motion = simulation.run(start, 0.0..SPAN).expect("a run");
    let integral = motion.integral(model, output).expect("an integral");
    let at = TIMES.map(|t| {
        let node = motion.at(t).expect("in the span");
        [node.q.to_vec(), node.p.to_vec(), node.v.to_vec()]
    });
    (at, *integral.last().expect("from the start"))
}

/// Derivatives of all these values by one number, by differences.
fn differences<const N: usize>(
    of: impl Fn(f64) -> ([[Vec<f64>; 3]; TIMES.len()], f64),
    x: f64,
) -> ([[[f64; N]; 3]; TIMES.len()], f64) {
    let flat = |x: f64| -> Vec<f64> {
        let (at, integral) = of(x);
        let numbers = at.into_iter().flatten().flatten();
        numbers.chain([integral]).collect()
    };
    let mut sums = difference(flat, x);
    let integral = sums.pop().expect("the last");
    let mut rows = sums.chunks_exact(N);
    let mut row = || {
        let row = rows.next().expect("as many");
        std::array::from_fn(|a| row[a])
    };
    let at = std::array::from_fn(|_| [row(), row(), row()]);
    (at, integral)
}

#[track_caller]
fn compare<const N: usize>(
    what: &str,
    found: [[f64; N]; 3],
    expected: [[f64; N]; 3],
    allowed: f64,
) {
    for ((part, found), expected) in ["q", "p", "v"].iter().zip(found).zip(expected) {
        let scale = expected.iter().fold(1.0_f64, |m, x| m.max(x.abs()));
        for a in 0..N {
            let error = (found[a] - expected[a]).abs() / scale;
            assert!(
                error < allowed,
                "{what}, {part}[{a}]: {} instead of {}, off by {error:.1e}",
                found[a],
                expected[a]
            );
        }
    }
}

/// Derivatives between the nodes and gradients of an integral, compared with differences of runs.
#[track_caller]
fn check_inside<M: Model<N> + Sync, const N: usize>(
    model: &M,
    start: State<N>,
    simulation: impl for<'m> Fn(&'m M) -> Simulation<'m, M, N>,
    output: &str,
    by_start: bool,
) {
    // The errors of the differences; those of velocities are the largest.
    let allowed = 1e-9;
    let run = simulation(model);
    let s = run.run_sensitive(start, 0.0..SPAN).expect("derivatives");
    let loss = Loss::integral(output)
        .times(2.0)
        .and(Loss::output_at_end(output));
    let (value, gradient) = run.gradient(start, 0.0..SPAN, &loss).expect("a gradient");
    let (_, integral) = seen(&run, model, start, output);
    let outputs = s.motion().outputs().column(output).expect("declared");
    let last = outputs.len() - 1;
    assert!((value - 2.0 * integral - outputs[last]).abs() < 1e-13 * value.abs().max(1.0));
    for (index, name) in s.parameters().iter().enumerate() {
        let of = |value| {
            let other = model.with_parameter(index, value).expect("numbers alone");
            seen(&simulation(&other), &other, start, output)
        };
        let (at, integral) = differences::<N>(of, model.parameter(index));
        for (t, expected) in TIMES.into_iter().zip(at) {
            let node = s.by(name).at(t).expect("in the span");
            let what = format!("{name} at {t}");
            compare(&what, [node.q, node.p, node.v], expected, allowed);
        }
        let end = s.by(name).output(output).expect("declared")[last];
        let (found, expected) = (gradient.by(name), 2.0 * integral + end);
        assert!(
            (found - expected).abs() < allowed * expected.abs().max(1.0),
            "integral by {name}: {found} instead of {expected}"
        );
    }
    if !by_start {
        return;
    }
    for k in 0..2 * N {
        let changed = |x: f64| {
            let mut start = start;
            match k < N {
                true => start.q[k] = x,
                false => start.p[k - N] = x,
            }
            seen(&run, model, start, output)
        };
        let x = if k < N { start.q[k] } else { start.p[k - N] };
        let (at, integral) = differences::<N>(changed, x);
        let end = &s.by_start().output(output).expect("declared")[last];
        let own = |state: &State<N>| if k < N { state.q[k] } else { state.p[k - N] };
        let (found, expected) = (own(&gradient.by_start()), 2.0 * integral + own(end));
        assert!(
            (found - expected).abs() < allowed * expected.abs().max(1.0),
            "integral by start {k}: {found} instead of {expected}"
        );
        for (t, [q, p, _]) in TIMES.into_iter().zip(at) {
            let matrix = s.by_start().at(t).expect("in the span");
            let column = (k + N) % (2 * N);
            let found = |first: usize| std::array::from_fn(|a| matrix[(first + a, column)]);
            let what = format!("start {k} at {t}");
            compare(
                &what,
                [found(N), found(0), [0.0; N]],
                [q, p, [0.0; N]],
                allowed,
            );
        }
    }
}

#[test]
fn of_elements_of_every_kind() {
    let start = PENDULUMS.state([0.7, -0.4], [0.2, 0.5]);
    let elements: [Element; 6] = [
        Mixed::<4>.into(),
        Primal::<3>.into(),
        Primal::<4>.reduced(),
        Radau::<3>.into(),
        Element::primal(4).lobatto(),
        Element::mixed(5),
    ];
    for element in elements {
        check_inside(
            &PENDULUMS,
            start,
            |model| Simulation::new(model).element(element).step(0.05),
            "speed",
            true,
        );
    }
    check_inside(
        &PENDULUMS,
        start,
        |model: &Pendulums| Simulation::new(model).step(0.05).impulse(0.42, [0.1, -0.2]),
        "speed",
        true,
    );
    check_inside(
        &PENDULUMS,
        start,
        |model| Simulation::new(model).step(0.05).solver(Solve::Newton),
        "height",
        true,
    );
}

#[test]
fn of_steps_that_are_cut() {
    let start = PENDULUMS.state([0.7, -0.4], [0.2, 0.5]);
    fn simulation(model: &Pendulums) -> Simulation<'_, Pendulums, 2> {
        Simulation::new(model).step(0.9).element(Mixed::<3>)
    }
    let motion = simulation(&PENDULUMS).run(start, 0.0..SPAN).expect("a run");
    assert!(motion.statistics().cuts > 0);
    check_inside(&PENDULUMS, start, simulation, "speed", true);
}

#[test]
fn of_hamiltonians() {
    let start = PHASE;
    for element in [Mixed::<4>.into(), Element::primal(3)] {
        check_inside(
            &DRIVEN,
            start,
            |model| Simulation::new(model).element(element).step(0.1),
            "moment",
            true,
        );
    }
}

#[test]
fn of_constrained_motions() {
    // Changes of the initial state violate the constraint, and so does a change of the length alone: these are left
    // out.
    let start = ROD.state([0.6, -0.8], [0.4, 0.3]);
    let s = Simulation::new(&ROD).step(0.02);
    let s = s.run_sensitive(start, 0.0..SPAN).expect("derivatives");
    let loss = Loss::integral("height");
    let (_, gradient) = Simulation::new(&ROD)
        .step(0.02)
        .gradient(start, 0.0..SPAN, &loss)
        .expect("a gradient");
    for (index, name) in ["m", "g", "c"].into_iter().enumerate() {
        let of = |value| {
            let other = ROD.with_parameter(index, value).expect("numbers alone");
            seen(&Simulation::new(&other).step(0.02), &other, start, "height")
        };
        let (at, integral) = differences::<2>(of, ROD.parameter(index));
        for (t, expected) in TIMES.into_iter().zip(at) {
            let node = s.by(name).at(t).expect("in the span");
            let what = format!("{name} at {t}");
            compare(&what, [node.q, node.p, node.v], expected, 1e-9);
        }
        let found = gradient.by(name);
        assert!(
            (found - integral).abs() < 1e-10,
            "{name}: {found} {integral}"
        );
    }
}

/// Pieces whose ends move: at bounces of a ball, between bounces and across them.
#[test]
fn of_motions_with_events() {
    let ball = Ball {
        m: 1.0,
        g: 9.81,
        floor: 0.0,
    };
    let start = ball.state([0.6], [0.2]);
    check_inside(&ball, start, bouncing, "velocity", true);
}

/// At the time of an event, and close to it, derivatives are at fixed time: y = y₀ + v₀ t − g t²/2 up to there.
#[test]
fn at_the_time_of_an_event_it_stays() {
    let ball = Ball {
        m: 1.0,
        g: 9.81,
        floor: 0.0,
    };
    let start = ball.state([0.6], [0.2]);
    let stopped = Simulation::new(&ball)
        .step(0.1)
        .on("impact", Crossing::Falling, |_| Act::Stop);
    for run in [bouncing(&ball), stopped] {
        let s = run.run_sensitive(start, 0.0..SPAN).expect("derivatives");
        let t = s.motion().events()[0].t;
        for t in [t - 1e-9, t] {
            let node = s.by("g").at(t).expect("in the span");
            let expected = [[-t * t / 2.0], [-t], [-t]];
            compare(&format!("{t}"), [node.q, node.p, node.v], expected, 1e-12);
            let by_start = s.by_start().at(t).expect("in the span");
            assert!((by_start.q_by_p()[(0, 0)] - t).abs() < 1e-12, "{by_start}");
        }
        // Nodes belong to the event, at which the ball stays on the floor.
        let nodes = s.motion().states();
        let node = nodes.iter().position(|node| node.t == t).expect("an event");
        let of_event = s.by("g").states()[node].q[0];
        assert!(of_event.abs() < 1e-12, "{of_event}");
        let sparse = run.record_every(3).run_sensitive(start, 0.0..SPAN);
        assert!(sparse.expect("derivatives").by("g").at(t).is_err());
    }
}

#[test]
fn derivatives_between_nodes_that_were_not_kept_are_told() {
    let start = PENDULUMS.state([0.7, -0.4], [0.2, 0.5]);
    let s = Simulation::new(&PENDULUMS).step(0.1).record_every(2);
    let s = s.run_sensitive(start, 0.0..SPAN).expect("derivatives");
    assert!(s.by("g").at(0.4).is_ok());
    assert!(s.by("g").at(0.45).is_err());
    assert!(s.by("g").at(1.1).is_err());
    assert!(s.by_start().at(f64::NAN).is_err());
}

#[test]
fn integrals_of_what_is_no_output_are_told() {
    let start = PENDULUMS.state([0.7, -0.4], [0.2, 0.5]);
    let simulation = Simulation::new(&PENDULUMS).step(0.1);
    let kind = |loss: &Loss<2>| {
        let error = simulation.gradient(start, 0.0..SPAN, loss);
        error.expect_err("no loss").kind().clone()
    };
    let none = kind(&Loss::integral("weight"));
    assert!(matches!(none, RunErrorKind::NoOutput { .. }), "{none}");
    let infinite = kind(&Loss::integral("height").times(f64::INFINITY));
    assert!(matches!(infinite, RunErrorKind::Loss { .. }), "{infinite}");
}

/// Backwards in time, and forwards with an event that never happens.
#[test]
fn integrals_backwards_are_integrals_forwards() {
    #[track_caller]
    fn compare_ways<M: Model<N> + Send + Sync, const N: usize>(
        simulation: &Simulation<'_, M, N>,
        start: State<N>,
        output: &str,
    ) {
        let loss = Loss::integral(output).and(Loss::squares(output, [0.3, 0.7], [0.1, -0.2]));
        let forwards = simulation.clone().on_function(
            "never",
            Crossing::Either,
            |_, _, _| 1.0,
            |_| Act::Record,
        );
        let [backwards, forwards] =
            [simulation, &forwards].map(|run| gradient_of(run, start, 0.0..SPAN, &loss));
        compare_rows(&backwards, &forwards, output);
    }
    let start = PENDULUMS.state([0.7, -0.4], [0.2, 0.5]);
    for element in [Mixed::<4>.into(), Element::primal(3), Radau::<3>.into()] {
        let simulation = Simulation::new(&PENDULUMS).element(element).step(0.05);
        compare_ways(&simulation, start, "speed");
        compare_ways(&simulation.solver(Solve::Newton), start, "height");
    }
    let simulation = Simulation::new(&PENDULUMS).step(0.9).element(Mixed::<3>);
    compare_ways(&simulation, start, "speed");
    let start = ROD.state([0.6, -0.8], [0.4, 0.3]);
    compare_ways(&Simulation::new(&ROD).step(0.02), start, "height");
}

/// At t = 1e9, differences of times have errors of 6e-5 relative to a step of 0.001; derivatives of velocities must not
/// be affected.
#[test]
fn far_from_zero_elements_are_as_long_as_their_steps() {
    let ball = Ball {
        m: 2.0,
        g: 9.81,
        floor: 0.0,
    };
    let run = Simulation::new(&ball).step(1e-3);
    let s = run.run_sensitive(ball.state([1.0], [0.0]), 1e9..1e9 + 0.1);
    let s = s.expect("derivatives");
    for pair in s.motion().states().windows(2) {
        let middle = pair[0].t + 0.5 * (pair[1].t - pair[0].t);
        let node = s.by("g").at(middle).expect("in the span");
        // Both are polynomials at the same position in the element, of numbers below one.
        let off = (ball.m * node.v[0] - node.p[0]).abs();
        assert!(off < 1e-13, "{off:e} at {middle}");
    }
}
