//! Derivatives across events that change the state or end the run: compared with those of the same model of fixed size,
//! and with differences of runs.

use crate::common::larger;
use crate::differences::difference_over;
use crate::lengths::{of_both_lengths, of_heap};
use tfe::error::RunErrorKind;
use tfe::family::FamilyState;
use tfe::length::{Length, RunTimeLength};
use tfe::prelude::*;
use tfe::sensitivity::Sensitive;
use tfe::{Linearised, Occurrence, family};

/// Balls coupled by springs above a ground that moves up and down, in a wind that changes with time.
#[dynamics(
    coordinates(y[n]),
    lagrangian = sum(i in 0..n, m[i]/2*dot(y[i])^2 - m[i]*g*y[i])
        - sum(i in 0..n-1, (y[i+1] - y[i] - 1)^2*k/2 + (y[i+1] - y[i] - 1)^4/4),
    force(y[i]) = -c*dot(y[i]) + sin(3*t),
    event(ground) = y[0] - a*sin(t),
    output(speed) = dot(y[0]) + g,
    output(clock) = t,
)]
pub(super) struct Balls {
    n: usize,
    m: Vec<f64>,
    g: f64,
    k: f64,
    c: f64,
    a: f64,
}

#[dynamics(
    coordinates(y[3]),
    lagrangian = sum(i in 0..3, m[i]/2*dot(y[i])^2 - m[i]*g*y[i])
        - sum(i in 0..2, (y[i+1] - y[i] - 1)^2*k/2 + (y[i+1] - y[i] - 1)^4/4),
    force(y[i]) = -c*dot(y[i]) + sin(3*t),
    event(ground) = y[0] - a*sin(t),
    output(speed) = dot(y[0]) + g,
    output(clock) = t,
)]
pub(super) struct ThreeBalls {
    m: [f64; 3],
    g: f64,
    k: f64,
    c: f64,
    a: f64,
}

/// A model declared by a Hamiltonian, with an event of a momentum.
#[dynamics(
    coordinates(q[n]), momenta(p[n]),
    hamiltonian = sum(i in 0..n, p[i]^2/2/m + k*q[i]^4/4) + sum(i in 0..n-1, (q[i+1]-q[i])^2/2),
    event(fast) = p[0] - limit,
)]
pub(super) struct ByMomenta {
    n: usize,
    m: f64,
    k: f64,
    limit: f64,
}

#[dynamics(
    coordinates(q[2]), momenta(p[2]),
    hamiltonian = sum(i in 0..2, p[i]^2/2/m + k*q[i]^4/4) + (q[1]-q[0])^2/2,
    event(fast) = p[0] - limit,
)]
pub(super) struct TwoByMomenta {
    m: f64,
    k: f64,
    limit: f64,
}

pub(super) const Y: [f64; 3] = [0.6, 1.5, 2.7];
pub(super) const V: [f64; 3] = [0.1, -0.2, 0.3];
pub(super) const G: f64 = 9.81;

pub(super) const THREE: ThreeBalls = ThreeBalls {
    m: [1.0, 0.5, 0.8],
    g: G,
    k: 40.0,
    c: 0.2,
    a: 0.1,
};

pub(super) fn balls(g: f64) -> Balls {
    let ThreeBalls { m, k, c, a, .. } = THREE;
    let m = m.to_vec();
    Balls {
        n: 3,
        m,
        g,
        k,
        c,
        a,
    }
}

pub(super) fn long(balls: &Balls) -> family::Simulation<'_, Balls> {
    Simulation::new(balls).element(Mixed::<6>).step(0.05)
}

pub(super) fn fixed() -> Simulation<'static, ThreeBalls, 3> {
    Simulation::new(&THREE).element(Mixed::<6>).step(0.05)
}

/// The same model by momenta with both kinds of length, and a start.
pub(super) fn by_momenta(limit: f64) -> (ByMomenta, TwoByMomenta, State<2>) {
    let (m, k) = (1.5, 2.0);
    let (q, p) = ([-0.9, 0.4], [0.0, 0.1]);
    let (long, two) = of_both_lengths!(ByMomenta(2), TwoByMomenta: m, k, limit);
    (long, two, State { q, p })
}

/// The same run of balls with both kinds of length.
type RunsOfBalls<'m> = (
    family::Simulation<'m, Balls>,
    Simulation<'static, ThreeBalls, 3>,
);

/// Balls of which the first bounces off the ground.
pub(super) fn bouncing(balls: &Balls) -> RunsOfBalls<'_> {
    (
        long(balls).on("ground", Crossing::Falling, bounce),
        fixed().on("ground", Crossing::Falling, bounce),
    )
}

/// Impulses at the ground, and an end where the last ball is high after half a unit of time.
pub(super) fn ending(balls: &Balls) -> RunsOfBalls<'_> {
    fn blow<const N: usize, L: Length<N>>(event: &Occurrence<'_, N, L>) -> Act<N, L>
    where
        L::Vector: From<[f64; 3]>,
    {
        let (p, v) = (event.p.as_ref(), event.v.as_ref());
        Act::Impulse([-1.8 * p[0], 0.1 * v[1], 0.0].into())
    }
    fn high<V: AsRef<[f64]>>(_: f64, y: &V, v: &V) -> f64 {
        v.as_ref()[2] + 0.1 * y.as_ref()[0]
    }
    fn end<const N: usize, L: Length<N>>(event: &Occurrence<'_, N, L>) -> Act<N, L> {
        match event.t > 0.5 {
            true => Act::Stop,
            false => Act::Record,
        }
    }
    (
        long(balls)
            .on("ground", Crossing::Falling, blow)
            .on_function("high", Crossing::Falling, high, end),
        fixed().on("ground", Crossing::Falling, blow).on_function(
            "high",
            Crossing::Falling,
            high,
            end,
        ),
    )
}

/// The same run by momenta with both kinds of length.
type RunsByMomenta<'m> = (
    family::Simulation<'m, ByMomenta>,
    Simulation<'m, TwoByMomenta, 2>,
);

/// A momentum that has grown to the limit is reversed.
pub(super) fn turning<'m>(long: &'m ByMomenta, two: &'m TwoByMomenta) -> RunsByMomenta<'m> {
    fn turn<const N: usize, L: Length<N>>(event: &Occurrence<'_, N, L>) -> Act<N, L>
    where
        L::Vector: From<[f64; 2]>,
    {
        let (q, p) = (event.q.as_ref(), event.p.as_ref());
        let turned = [-p[0], p[1] * q[0]];
        Act::Restart(L::state(event.q.clone(), turned.into()))
    }
    let run = Simulation::new(long).element(Mixed::<6>).step(0.1);
    let beside = Simulation::new(two).element(Mixed::<6>).step(0.1);
    (
        run.on("fast", Crossing::Rising, turn),
        beside.on("fast", Crossing::Rising, turn),
    )
}

/// An impulse that causes an event.
pub(super) fn kicked<'m>(long: &'m ByMomenta, two: &'m TwoByMomenta) -> RunsByMomenta<'m> {
    fn back<const N: usize, L: Length<N>>(event: &Occurrence<'_, N, L>) -> Act<N, L>
    where
        L::Vector: From<[f64; 2]>,
    {
        let (q, p) = (event.q.as_ref(), event.p.as_ref());
        Act::Impulse([-p[0], q[0]].into())
    }
    let run = Simulation::new(long).element(Mixed::<6>).step(0.1);
    let beside = Simulation::new(two).element(Mixed::<6>).step(0.1);
    (
        run.impulse(0.8, [4.0, 0.5])
            .on("fast", Crossing::Rising, back),
        beside
            .impulse(0.8, [4.0, 0.5])
            .on("fast", Crossing::Rising, back),
    )
}

/// A restitution that depends on a parameter, and a push that depends on the time.
pub(super) fn throw(event: &Occurrence<'_, 0, RunTimeLength>) -> Act<0, RunTimeLength> {
    let g = event.parameter("g").unwrap_or(f64::NAN);
    let mut v = event.v.clone();
    v[0] *= -0.08 * g;
    v[1] += 0.3 * event.t;
    Act::Restart(event.state_with_velocity(v))
}

/// A start with another value of one of its numbers, ordered (p, q).
pub(super) fn moved(start: &FamilyState, column: usize, x: f64) -> FamilyState {
    let mut moved = start.clone();
    match column.checked_sub(start.p.len()) {
        None => moved.p[column] = x,
        Some(a) => moved.q[a] = x,
    }
    moved
}

/// An impact that leaves 0.8 of the speed.
pub(super) fn bounce<const N: usize, L: Length<N>>(event: &Occurrence<'_, N, L>) -> Act<N, L> {
    Act::Restart(event.after_impact(0.8))
}

/// The largest difference of two lists of numbers, relative to the largest of these numbers, but at least to 1.
pub(super) fn apart<'a>(
    a: impl IntoIterator<Item = &'a f64>,
    b: impl IntoIterator<Item = &'a f64>,
) -> f64 {
    let (a, b): (Vec<f64>, Vec<f64>) = (
        a.into_iter().copied().collect(),
        b.into_iter().copied().collect(),
    );
    assert_eq!(a.len(), b.len());
    let size = a
        .iter()
        .chain(&b)
        .fold(1.0, |size, one| larger(size, one.abs()));
    let pairs = a.iter().zip(&b);
    pairs.fold(0.0, |most, (a, b)| larger(most, (a - b).abs() / size))
}

/// Both are derivatives of the same computed motion. Actions are differentiated by differences over 2e-3, with a
/// rounding error of some 1e-13 / 2e-3, which each bounce multiplies several times.
pub(super) const SAME: f64 = 1e-9;

/// Compares the matrices of all elements.
#[track_caller]
pub(super) fn check_matrices<const N: usize>(
    long: &Linearised<0, RunTimeLength>,
    fixed: &Linearised<N>,
) {
    assert_eq!(long.transitions().len(), fixed.transitions().len());
    for (a, b) in long.transitions().iter().zip(fixed.transitions()) {
        let off = apart(a, b);
        assert!(off < SAME, "{off:e}");
    }
}

#[track_caller]
pub(super) fn check_same<const N: usize>(
    long: &Sensitive<0, RunTimeLength>,
    fixed: &Sensitive<N>,
    times: &[f64],
) {
    assert_eq!(long.parameters(), fixed.parameters());
    assert_eq!(long.motion().events().len(), fixed.motion().events().len());
    for name in long.parameters() {
        let (a, b) = (long.by(name), fixed.by(name));
        assert_eq!(a.states().len(), b.states().len());
        for (a, b) in a.states().iter().zip(&b.states()) {
            for (a, b) in [(&a.q, &b.q), (&a.p, &b.p), (&a.v, &b.v)] {
                let off = apart(a, b);
                assert!(off < SAME, "{name}: {off:e}, {a:?} {b:?}");
            }
        }
        for event in 0..long.motion().events().len() {
            let both = (a.event_time(event), b.event_time(event));
            let both = both.0.as_slice().iter().zip(both.1.as_slice());
            assert!(both.fold(0.0, |most, (a, b)| larger(most, (a - b).abs())) < SAME);
        }
        assert_eq!(a.event_time(0).is_some(), b.event_time(0).is_some());
        for time in times {
            let (a, b) = (a.at(*time).expect("inside"), b.at(*time).expect("inside"));
            let off = [apart(&a.q, &b.q), apart(&a.p, &b.p), apart(&a.v, &b.v)];
            assert!(
                off.iter().all(|off| *off < SAME),
                "{name} at {time}: {off:?}"
            );
        }
        if let (Some(a), Some(b)) = (a.output("speed"), b.output("speed")) {
            assert!(apart(&a, &b) < SAME);
        }
    }
    let (a, b) = (long.by_start().matrices(), fixed.by_start().matrices());
    for (a, b) in a.iter().zip(&b) {
        let off = apart(a, b);
        assert!(off < SAME, "{off:e}");
    }
}

#[test]
fn derivatives_go_through_impacts() {
    let balls = balls(G);
    let (run, beside) = bouncing(&balls);
    let found = run.run_sensitive(balls.state(Y, V), 0.0..1.0);
    let found = found.expect("derivatives");
    assert!(found.motion().events().len() > 1);
    let expected = beside.run_sensitive(THREE.state(Y, V), 0.0..1.0);
    let times: Vec<f64> = (1..40).map(|k| f64::from(k) * 0.0251).collect();
    check_same(&found, &expected.expect("derivatives"), &times);
    // With fewer nodes, derivatives along elements are not kept.
    let few = run.clone().record_every(7);
    let few = few.run_sensitive(balls.state(Y, V), 0.0..1.0);
    let few = few.expect("derivatives");
    assert_eq!(few.by("g").last(), found.by("g").last());
    // Matrices from node to node, over the same bounces.
    let matrices = run.run_linearised(balls.state(Y, V), 0.0..1.0);
    let matrices = matrices.expect("matrices");
    assert_eq!(matrices.transitions().len(), 20);
    let product = matrices.product();
    let off = apart(&product, &found.by_start().last());
    assert!(off < SAME, "{off:e}");
    let expected = beside.run_linearised(THREE.state(Y, V), 0.0..1.0);
    check_matrices(&matrices, &expected.expect("matrices"));
}

/// Compared with differences of whole runs, which have fewer correct digits: the rounding errors of a run, some 1e-13
/// after its bounces, are divided by a step so short that all runs have the same number of bounces.
#[test]
fn derivatives_across_events_are_those_of_runs() {
    const DISTANCE: f64 = 1e-3;
    let start = balls(G).state(Y, V);
    let end = |g: f64| {
        let balls = balls(g);
        let run = long(&balls).on("ground", Crossing::Falling, throw);
        let motion = run.run(start.clone(), 0.0..1.0).expect("a run");
        let last = motion.last();
        [last.q.clone(), last.p.clone(), last.v.clone()].concat()
    };
    let expected = difference_over(DISTANCE, end, G);
    let own = balls(G);
    let run = long(&own).on("ground", Crossing::Falling, throw);
    let found = run.run_sensitive(start.clone(), 0.0..1.0);
    let found = found.expect("derivatives");
    let last = found.by("g").last();
    let last = [last.q, last.p, last.v].concat();
    let off = apart(&last, &expected);
    assert!(off < 1e-8, "{off:e}: {last:?} {expected:?}");
    // Derivatives by the start.
    let by_start = found.by_start().last();
    let all = [&start.p[..], &start.q].concat();
    for column in 0..6 {
        let end = |x: f64| {
            let motion = run.run(moved(&start, column, x), 0.0..1.0);
            let motion = motion.expect("a run");
            [motion.last().p.clone(), motion.last().q.clone()].concat()
        };
        let expected = difference_over(DISTANCE, end, all[column]);
        let found: Vec<f64> = by_start.column(column).iter().copied().collect();
        let off = apart(&found, &expected);
        assert!(off < 1e-8, "{column}, {off:e}: {found:?} {expected:?}");
    }
}

/// Impulses at events, and a run that ends at an event, whose time is that of the last node.
#[test]
fn derivatives_go_to_events_that_end_the_run() {
    let balls = balls(G);
    let (run, beside) = ending(&balls);
    let found = run.run_sensitive(balls.state(Y, V), 0.0..3.0);
    let found = found.expect("derivatives");
    assert!(found.motion().last().t < 2.9 && found.motion().events().len() > 1);
    let expected = beside.run_sensitive(THREE.state(Y, V), 0.0..3.0);
    check_same(&found, &expected.expect("derivatives"), &[0.1, 0.43]);
    let last = found.motion().events().len() - 1;
    assert!(found.by("g").event_time(last).is_some_and(|dt| dt != 0.0));
}

#[test]
fn derivatives_by_momenta_go_through_events() {
    let (long, two, start) = by_momenta(0.4);
    let (run, beside) = turning(&long, &two);
    let found = run.run_sensitive(of_heap(&start), 0.0..4.0);
    let found = found.expect("derivatives");
    assert!(found.motion().events().len() > 1);
    let expected = beside.run_sensitive(start, 0.0..4.0);
    check_same(&found, &expected.expect("derivatives"), &[0.37, 1.9, 3.05]);
}

/// Parameters that are set at events: there are matrices if the values do not depend on the state.
#[test]
fn matrices_go_through_parameters_that_are_set() {
    fn soften<const N: usize, L: Length<N>>(_: &Occurrence<'_, N, L>) -> Act<N, L> {
        Act::Set(Settings::new("k", 20.0))
    }
    fn stiffen<const N: usize, L: Length<N>>(_: &Occurrence<'_, N, L>) -> Act<N, L> {
        Act::Set(Settings::new("k", 60.0))
    }
    let balls = balls(G);
    let run = long(&balls).on("ground", Crossing::Falling, soften);
    let run = run.on("ground", Crossing::Rising, stiffen);
    let beside = fixed().on("ground", Crossing::Falling, soften);
    let beside = beside.on("ground", Crossing::Rising, stiffen);
    let start = balls.state([0.1, 1.2, 2.0], [3.0, 2.0, 3.5]);
    let found = run.run_linearised(start.clone(), 0.0..1.0);
    let found = found.expect("matrices");
    assert!(!found.motion().settings().is_empty());
    let expected = beside.run_linearised(THREE.state([0.1, 1.2, 2.0], [3.0, 2.0, 3.5]), 0.0..1.0);
    check_matrices(&found, &expected.expect("matrices"));
    let error = run.run_sensitive(start.clone(), 0.0..1.0);
    let error = error.expect_err("derivatives by what is set");
    let call = "run_sensitive";
    assert_eq!(error.kind(), &RunErrorKind::SetUnsupported { call });
    let run = long(&balls).on("ground", Crossing::Falling, |event| {
        Act::Set(Settings::new("k", 20.0 + event.v[1]))
    });
    let error = run.run_linearised(start, 0.0..1.0);
    let error = error.expect_err("a value that depends on the state");
    assert!(
        matches!(error.kind(), RunErrorKind::SetByState { parameter, .. } if parameter == "k"),
        "{error}"
    );
}

/// An impulse at a node on which an event falls: there is no derivative, since the impulse acts before the event or
/// after it.
#[test]
fn impulses_at_events_are_told() {
    let balls = ByMomenta {
        n: 2,
        m: 1.0,
        k: 0.0,
        limit: 0.5,
    };
    let run = Simulation::new(&balls).element(Mixed::<3>).step(0.5);
    let bounce = |event: &Occurrence<'_, 0, RunTimeLength>| {
        Act::Restart(FamilyState {
            q: event.q.clone(),
            p: vec![-event.p[0], event.p[1]],
        })
    };
    let run = run.on_function("wall", Crossing::Falling, |_, q, _| q[0], bounce);
    let run = run.impulse(1.0, [0.25, 0.0]);
    let mut refused = 0;
    // The wall is met at the node at t = 1, or before or after it by a few rounding errors.
    for k in 0..32 {
        let start = FamilyState {
            q: vec![1.0 - f64::from(k) * f64::EPSILON / 2.0, 1.0],
            p: vec![-1.0; 2],
        };
        let motion = run.run(start.clone(), 0.0..2.0).expect("a run");
        let [event] = motion.events() else {
            panic!("{:?}", motion.events());
        };
        // At the node, before the impulse has acted.
        let is_first = event.t == 1.0 && event.p[0] < -0.9;
        match run.run_sensitive(start, 0.0..2.0) {
            Ok(_) => assert!(!is_first, "{k}"),
            Err(error) => {
                let is_told = matches!(error.kind(), RunErrorKind::Transition { .. });
                assert!(is_told && is_first, "{k}: {error}");
                refused += 1;
            }
        }
    }
    assert!(refused > 0);
}

/// An impulse that causes an event: the time of the event is that of the impulse, and does not change.
#[test]
fn derivatives_go_through_events_of_impulses() {
    let (long, two, start) = by_momenta(3.0);
    let (run, beside) = kicked(&long, &two);
    let found = run.run_sensitive(of_heap(&start), 0.0..2.0);
    let found = found.expect("derivatives");
    assert_eq!(found.motion().events().len(), 1);
    assert!(found.by("m").event_time(0).is_some_and(|dt| dt == 0.0));
    let expected = beside.run_sensitive(start, 0.0..2.0);
    check_same(
        &found,
        &expected.expect("derivatives"),
        &[0.37, 0.79, 0.83, 1.9],
    );
}
