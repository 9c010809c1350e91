//! Derivatives of constrained models of run-time length across events: compared with those of the same model of fixed
//! size, and with differences of runs.

use crate::constrained::{Rods, ThreeRods, rods, start};
use crate::differences::difference_over;
use crate::events::{SAME, apart, check_matrices, check_same};
use crate::gradients;
use crate::lengths::of_heap;
use nalgebra::DMatrix;
use tfe::Occurrence;
use tfe::family::{self, Model};
use tfe::length::Length;
use tfe::prelude::*;
use tfe::sensitivity::Loss;

/// The distance of the last rod's end from a wall.
fn distance<V: AsRef<[f64]>>(_: f64, q: &V, _: &V) -> f64 {
    0.75 - q.as_ref()[2]
}

/// A time that depends on where the rods are.
fn late<V: AsRef<[f64]>>(t: f64, q: &V, _: &V) -> f64 {
    t - 0.4 - 0.1 * q.as_ref()[1]
}

fn hit<const N: usize, L: Length<N>>(event: &Occurrence<'_, N, L>) -> Act<N, L> {
    Act::Restart(event.after_impact(0.7))
}

fn push<const N: usize, L: Length<N>>(event: &Occurrence<'_, N, L>) -> Act<N, L>
where
    L::Vector: From<[f64; 6]>,
{
    let (x, y) = (0.1 * event.v.as_ref()[0], -0.2 * event.q.as_ref()[4]);
    Act::Impulse([x, 0.0, 0.3 * event.t, 0.0, y, 0.1].into())
}

/// Rods whose end hits a wall, with a push whose time depends on where they are.
fn long(rods: &Rods) -> family::Simulation<'_, Rods> {
    let run = Simulation::new(rods).element(Mixed::<4>).step(0.02);
    run.on_function("wall", Crossing::Falling, distance, hit)
        .on_function("late", Crossing::Rising, late, push)
}

fn fixed(rods: &ThreeRods) -> Simulation<'_, ThreeRods, 6> {
    let run = Simulation::new(rods).element(Mixed::<4>).step(0.02);
    run.on_function("wall", Crossing::Falling, distance, hit)
        .on_function("late", Crossing::Rising, late, push)
}

/// A number of coordinates, momenta and velocities.
fn number(q: &[f64], p: &[f64], v: &[f64]) -> f64 {
    q[1] * v[0] + p[5] * v[2]
}

/// The same with an output at the end, with an output at two times, and with an integral.
fn loss<'l, const N: usize, L: Length<N>>() -> Loss<'l, N, L> {
    Loss::of_end(number)
        .and(Loss::output_at_end("height"))
        .and(Loss::squares("height", [0.2, 0.5], [-1.5, -1.0]))
        .and(Loss::integral("height").times(2.0))
}

/// Rods with an impulse that causes an event.
fn kicked(rods: &Rods) -> family::Simulation<'_, Rods> {
    let run = Simulation::new(rods).element(Mixed::<4>).step(0.02);
    let run = run.impulse(0.3, [6.0, 0.0, 8.0, 0.0, 1.0, 0.0]);
    run.on_function(
        "fast",
        Crossing::Rising,
        |_, _, v| v[2] - 2.0,
        |event| Act::Impulse(vec![0.0, 0.2 * event.v[2], 0.0, 0.1 * event.q[2], 0.0, 0.0]),
    )
}

/// The same model with another value of a parameter.
fn with(rods: &Rods, name: &str, value: f64) -> Rods {
    let mut indices = 0..rods.parameters();
    let index = indices.find(|index| rods.parameter_name(*index).is(name));
    let other = index.and_then(|index| rods.with_parameter(index, value));
    other.expect("a parameter")
}

#[test]
fn derivatives_are_those_of_fixed_size() {
    let (own, other) = rods();
    let start = start(&other);
    let (run, beside) = (long(&own), fixed(&other));
    let found = run.run_sensitive(of_heap(&start), 0.0..0.8);
    let found = found.expect("derivatives");
    let names = found.motion().events().iter().map(|event| &event.name[..]);
    let names: Vec<&str> = names.collect();
    assert!(names.contains(&"wall") && names.contains(&"late"));
    let expected = beside.run_sensitive(start, 0.0..0.8).expect("derivatives");
    let times: Vec<f64> = (1..40).map(|k| f64::from(k) * 0.0199).collect();
    check_same(&found, &expected, &times);
    let losses = (&loss(), &loss());
    gradients::check_same((&run, &beside), losses, (&start, 0.8));
}

#[test]
fn matrices_are_those_of_fixed_size() {
    let (own, other) = rods();
    let start = start(&other);
    let found = long(&own).run_linearised(of_heap(&start), 0.0..0.8);
    let expected = fixed(&other).run_linearised(start, 0.0..0.8);
    let (found, expected) = (found.expect("matrices"), expected.expect("matrices"));
    assert!(found.motion().events().len() > 1);
    check_matrices(&found, &expected);
    // The bases of the tangent space may differ: compare singular values.
    let stretches = |matrices: Option<&[DMatrix<f64>]>| {
        let matrices = matrices.expect("bases");
        let product = matrices[1..].iter();
        let product = product.fold(matrices[0].clone(), |product, one| one * product);
        product.singular_values()
    };
    let (a, b) = (
        stretches(found.on_constraints()),
        stretches(expected.on_constraints()),
    );
    assert_eq!(a.len(), 6);
    let off = apart(&a, &b);
    assert!(off <= SAME, "{off:e}");
}

/// Compared with differences of whole runs, whose rounding errors are divided by a step so short that all runs have the
/// same events.
#[test]
fn derivatives_across_events_are_those_of_runs() {
    const DISTANCE: f64 = 1e-3;
    let (own, other) = rods();
    let begin = of_heap(&start(&other));
    for name in ["g", "k", "m[1]"] {
        let index = own.parameters();
        let index = (0..index).find(|index| own.parameter_name(*index).is(name));
        let at = own.parameter(index.expect("a parameter"));
        let end = |x: f64| {
            let rods = with(&own, name, x);
            // A mass changes the momenta that belong to the velocities of the start.
            let v = own.velocity(0.0, &begin);
            let start = rods.state(begin.q.clone(), v);
            let motion = long(&rods).run(start, 0.0..0.6).expect("a run");
            let node = motion.last();
            [number(&node.q, &node.p, &node.v)]
        };
        let [expected] = difference_over(DISTANCE, end, at);
        let run = long(&own);
        let loss = family::Loss::of_end(number);
        let found = run.gradient(begin.clone(), 0.0..0.6, &loss);
        let (_, found) = found.expect("a gradient");
        // The change of the start with the mass, at fixed velocities.
        let more = match name {
            "m[1]" => {
                let heavier = with(&own, name, at + 1.0);
                let v = own.velocity(0.0, &begin);
                let moved = heavier.state(begin.q.clone(), v).p;
                let by_p = found.by_start().p;
                let pairs = moved.iter().zip(&begin.p).zip(&by_p);
                pairs.map(|((moved, p), by)| (moved - p) * by).sum::<f64>()
            }
            _ => 0.0,
        };
        let found = found.by(name) + more;
        let off = (found - expected).abs();
        assert!(
            off <= 1e-8 * expected.abs().max(1.0),
            "{name}: {found} {expected}"
        );
    }
}

/// An impulse that causes an event, whose time is that of the impulse; both act on constraints.
#[test]
fn derivatives_go_through_events_of_impulses() {
    let (own, other) = rods();
    let begin = of_heap(&start(&other));
    let loss = family::Loss::of_end(number);
    let found = kicked(&own).gradient(begin.clone(), 0.0..0.6, &loss);
    let (_, found) = found.expect("a gradient");
    assert!((found.motion().events()[0].t - 0.3).abs() <= 1e-12);
    let end = |g: f64| {
        let rods = with(&own, "g", g);
        let motion = kicked(&rods).run(begin.clone(), 0.0..0.6).expect("a run");
        let node = motion.last();
        [number(&node.q, &node.p, &node.v)]
    };
    let [expected] = difference_over(1e-3, end, 9.81);
    let found = found.by("g");
    let off = (found - expected).abs();
    assert!(off <= 1e-8 * expected.abs().max(1.0), "{found} {expected}");
    // Forwards.
    let s = kicked(&own).run_sensitive(begin.clone(), 0.0..0.6);
    let s = s.expect("derivatives");
    assert_eq!(s.by("g").event_time(0), Some(0.0));
    let (node, by) = (s.motion().last(), s.by("g").last());
    let forwards = by.q[1] * node.v[0] + node.q[1] * by.v[0];
    let forwards = forwards + by.p[5] * node.v[2] + node.p[5] * by.v[2];
    let off = (found - forwards).abs();
    assert!(off <= SAME * forwards.abs().max(1.0), "{found} {forwards}");
    let matrices = kicked(&own)
        .run_linearised(begin, 0.0..0.6)
        .expect("matrices");
    assert_eq!(matrices.transitions().len(), 30);
    let off = apart(&matrices.product(), &s.by_start().last());
    assert!(off <= SAME, "{off:e}");
}

/// Two events at one time: the second is at the start of an element, where reactions determine how the motion goes on.
#[test]
fn derivatives_go_through_events_at_one_time() {
    fn again<const N: usize, L: Length<N>>(event: &Occurrence<'_, N, L>) -> Act<N, L>
    where
        L::Vector: From<[f64; 6]>,
    {
        let (q, v) = (event.q.as_ref(), event.v.as_ref());
        Act::Impulse([0.2 * v[0], 0.0, 0.0, 0.1, 0.1 * q[2], 0.0].into())
    }
    let (own, other) = rods();
    let start = start(&other);
    let run = long(&own).on_function("again", Crossing::Falling, distance, again);
    let beside = fixed(&other).on_function("again", Crossing::Falling, distance, again);
    let found = run.run_sensitive(of_heap(&start), 0.0..0.3);
    let found = found.expect("derivatives");
    let mut pairs = found.motion().events().windows(2);
    assert!(pairs.any(|two| two[0].t == two[1].t));
    let expected = beside.run_sensitive(start, 0.0..0.3).expect("derivatives");
    check_same(&found, &expected, &[0.013, 0.2, 0.29]);
    let losses = (&Loss::of_end(number), &Loss::of_end(number));
    gradients::check_same((&run, &beside), losses, (&start, 0.3));
}
