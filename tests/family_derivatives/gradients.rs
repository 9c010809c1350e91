//! Gradients and second derivatives across events that change the state or end the run: compared with those of the same
//! model of fixed size, whose gradients are computed forwards, and with differences of runs.

use crate::differences::difference_over;
use crate::events::{
    G, SAME, THREE, V, Y, apart, balls, bouncing, by_momenta, ending, kicked, long, moved, throw,
    turning,
};
use crate::lengths::of_heap;
use tfe::error::RunErrorKind;
use tfe::length::{Length, RunTimeLength};
use tfe::prelude::*;
use tfe::sensitivity::Loss;
use tfe::{Model, Occurrence, family};

/// A function of coordinates, momenta and velocities at the end.
fn of_end<'l, const N: usize, L: Length<N>>() -> Loss<'l, N, L> {
    Loss::of_end(|q, p, v| {
        let last = q.len() - 1;
        q[0].sin() + 0.5 * p[last] * p[last] + q[last] * v[0] + v[1] * v[1]
    })
}

/// The same with outputs at the end and at times between bounces, and with an integral.
fn of_speeds<'l, const N: usize, L: Length<N>>() -> Loss<'l, N, L> {
    of_end()
        .and(Loss::output_at_end("speed"))
        .and(Loss::squares("speed", [0.31, 0.5, 0.77], [9.0, 8.5, 10.0]).times(0.1))
        .and(Loss::integral("speed").times(0.7))
}

/// The same with the time at the end, and with integrals.
fn of_clocks<'l, const N: usize, L: Length<N>>() -> Loss<'l, N, L> {
    of_end()
        .and(Loss::output_at_end("clock").times(2.0))
        .and(Loss::integral("clock"))
        .and(Loss::integral("speed"))
}

/// Compares losses and gradients, and returns the number of events.
#[track_caller]
pub(super) fn check_same<M: family::Model, F: Model<N>, const N: usize>(
    (long, fixed): (&Simulation<'_, M, 0, RunTimeLength>, &Simulation<'_, F, N>),
    losses: (&family::Loss<'_>, &Loss<'_, N>),
    (start, end): (&State<N>, f64),
) -> usize {
    let found = long.gradient(of_heap(start), 0.0..end, losses.0);
    let expected = fixed.gradient(*start, 0.0..end, losses.1);
    let (value, found) = found.expect("a gradient");
    let (expected_value, expected) = expected.expect("a gradient");
    assert!((value - expected_value).abs() <= 1e-11 * expected_value.abs().max(1.0));
    assert_eq!(found.parameters(), expected.parameters());
    let (own, other) = (found.motion().events(), expected.motion().events());
    assert_eq!(own.len(), other.len());
    let off = apart(found.by_parameters(), expected.by_parameters());
    assert!(off <= SAME, "by parameters: {off:e}");
    let (a, b) = (found.by_start(), expected.by_start());
    for (a, b) in [(&a.q[..], &b.q[..]), (&a.p, &b.p)] {
        let off = apart(a, b);
        assert!(off <= SAME, "by the start: {off:e}, {a:?} {b:?}");
    }
    own.len()
}

#[test]
fn gradients_go_through_impacts() {
    let balls = balls(G);
    let (run, beside) = bouncing(&balls);
    let start = THREE.state(Y, V);
    let events = check_same((&run, &beside), (&of_speeds(), &of_speeds()), (&start, 1.0));
    assert!(events > 1);
    // Backwards in time, and with fewer nodes.
    let (run, beside) = (run.record_every(7), beside.record_every(7));
    let losses = (
        &of_end().and(Loss::integral("clock")),
        &of_end().and(Loss::integral("clock")),
    );
    check_same((&run, &beside), losses, (&start, -0.7));
}

/// Compared with differences of whole runs, as in `derivatives_across_events_are_those_of_runs`.
#[test]
fn gradients_across_events_are_differences_of_runs() {
    const DISTANCE: f64 = 1e-3;
    let start = balls(G).state(Y, V);
    let value = |g: f64, start: &family::FamilyState| {
        let balls = balls(g);
        let run = long(&balls).on("ground", Crossing::Falling, throw);
        let motion = run.run(start.clone(), 0.0..1.0).expect("a run");
        let last = motion.last();
        [last.q[0] * last.v[2] + last.p[1] + last.q[1] * last.q[1]]
    };
    let own = balls(G);
    let run = long(&own).on("ground", Crossing::Falling, throw);
    let loss = family::Loss::of_end(|q, p, v| q[0] * v[2] + p[1] + q[1] * q[1]);
    let found = run.gradient(start.clone(), 0.0..1.0, &loss);
    let (_, found) = found.expect("a gradient");
    assert!(found.motion().events().len() > 1);
    let by_g = difference_over(DISTANCE, |g| value(g, &start), G);
    let off = apart(&[found.by("g")], &by_g);
    assert!(off <= 1e-8, "{off:e}: {} {by_g:?}", found.by("g"));
    let by_start = found.by_start();
    let by_start = [by_start.p, by_start.q].concat();
    let all = [&start.p[..], &start.q].concat();
    for column in 0..6 {
        let of = |x: f64| value(G, &moved(&start, column, x));
        let expected = difference_over(DISTANCE, of, all[column]);
        let found = by_start[column];
        let off = apart(&[found], &expected);
        assert!(off <= 1e-8, "{column}, {off:e}: {found} {expected:?}");
    }
}

/// Impulses at events, and a run that ends at an event, whose time is that of the end.
#[test]
fn gradients_go_to_events_that_end_the_run() {
    let balls = balls(G);
    let (run, beside) = ending(&balls);
    let start = THREE.state(Y, V);
    let losses = (&of_clocks(), &of_clocks());
    let events = check_same((&run, &beside), losses, (&start, 3.0));
    assert!(events > 1);
}

/// Several events at one time: two with one zero, and one whose function jumps over zero by the action of the others.
#[test]
fn gradients_go_through_events_at_one_time() {
    fn slow<const N: usize, L: Length<N>>(event: &Occurrence<'_, N, L>) -> Act<N, L>
    where
        L::Vector: From<[f64; 3]>,
    {
        Act::Impulse([0.0, 0.1 * event.v.as_ref()[0], 0.05 * event.t].into())
    }
    fn lift<const N: usize, L: Length<N>>(event: &Occurrence<'_, N, L>) -> Act<N, L>
    where
        L::Vector: From<[f64; 3]>,
    {
        let (q, v) = (event.q.as_ref(), event.v.as_ref());
        Act::Impulse([0.1 * v[0], 0.0, 0.2 * q[1]].into())
    }
    fn above<V: AsRef<[f64]>>(t: f64, y: &V, _: &V) -> f64 {
        y.as_ref()[0] - 0.1 * t.sin()
    }
    fn rate<V: AsRef<[f64]>>(_: f64, _: &V, v: &V) -> f64 {
        v.as_ref()[0]
    }
    let balls = balls(G);
    let (run, beside) = bouncing(&balls);
    let run = run
        .on_function("again", Crossing::Falling, above, slow)
        .on_function("turn", Crossing::Rising, rate, lift);
    let beside = beside
        .on_function("again", Crossing::Falling, above, slow)
        .on_function("turn", Crossing::Rising, rate, lift);
    let start = THREE.state(Y, V);
    let motion = beside.run(start, 0.0..0.8).expect("a run");
    let pairs = motion.events().windows(2);
    assert!(pairs.filter(|two| two[0].t == two[1].t).count() > 1);
    let losses = (
        &of_end().and(Loss::integral("speed")),
        &of_end().and(Loss::integral("speed")),
    );
    check_same((&run, &beside), losses, (&start, 0.8));
}

#[test]
fn gradients_by_momenta_go_through_events() {
    let (long, two, start) = by_momenta(0.4);
    let (run, beside) = turning(&long, &two);
    let events = check_same((&run, &beside), (&of_end(), &of_end()), (&start, 4.0));
    assert!(events > 1);
    // An event that an impulse causes has the time of the impulse, which does not change.
    let (long, two, start) = by_momenta(3.0);
    let (run, beside) = kicked(&long, &two);
    let events = check_same((&run, &beside), (&of_end(), &of_end()), (&start, 2.0));
    assert_eq!(events, 1);
}

/// Second derivatives are differences over 4e-3 of gradients, whose errors of 1e-12 enter with the inverse of that.
#[test]
fn second_derivatives_go_through_impacts() {
    let balls = balls(G);
    let (run, beside) = bouncing(&balls);
    let start = THREE.state(Y, V);
    let names = ["g", "k", "a"];
    let found = run.hessian(of_heap(&start), 0.0..0.6, &of_end(), names);
    let expected = beside.hessian(start, 0.0..0.6, &of_end(), names);
    let (found, expected) = (found.expect("a matrix"), expected.expect("a matrix"));
    assert!(!found.gradient().motion().events().is_empty());
    let off = apart(found.matrix(), expected.matrix());
    assert!(
        off <= 1e-7,
        "{off:e}: {} {}",
        found.matrix(),
        expected.matrix()
    );
}

#[test]
fn gradients_refuse_parameters_that_are_set() {
    let balls = balls(G);
    let run = long(&balls).on("ground", Crossing::Falling, |_| {
        Act::Set(Settings::new("k", 20.0))
    });
    let start = balls.state([0.1, 1.2, 2.0], [3.0, 2.0, 3.5]);
    let error = run.gradient(start, 0.0..1.0, &of_end());
    let error = error.expect_err("derivatives by what is set");
    let call = "gradient";
    assert_eq!(error.kind(), &RunErrorKind::SetUnsupported { call });
}
