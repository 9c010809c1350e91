//! Elements between the times of a table are as long as the time between these, whatever is evaluated at their ends.

use tfe::Interpolation;
use tfe::prelude::*;

/// A mass that is pushed.
#[dynamics(coordinates(x), lagrangian = dot(x)^2/2, input(u), force(x) = u)]
struct Free;

/// The same on a rail.
#[dynamics(
    coordinates(x, y),
    lagrangian = (dot(x)^2 + dot(y)^2)/2,
    input(u),
    force(x) = u,
    constraint(rail) = y,
)]
struct OnRail;

/// The same of run-time length.
#[dynamics(
    coordinates(q[n]),
    lagrangian = sum(i in 0..n, dot(q[i])^2/2),
    input(u),
    force(q[i]) = u,
)]
struct Many {
    n: usize,
}

/// A step of a held force, and the number of steps.
const SHORT: f64 = 0.015625;
const COUNT: u32 = 1000;

/// The times of a table of held forces, these forces, and how far a mass comes with a velocity of one at the start. All
/// numbers are sums of powers of two, so that nothing is rounded.
fn pushed(start: f64) -> (Vec<f64>, Vec<f64>, [f64; 2]) {
    let times = (0..=COUNT).map(|k| start + SHORT * f64::from(k)).collect();
    let forces: Vec<f64> = (0..=COUNT).map(|k| f64::from(k % 7) - 3.0).collect();
    let (mut x, mut v) = (0.0, 1.0);
    for force in &forces[..COUNT as usize] {
        x += SHORT * (v + 0.5 * SHORT * force);
        v += SHORT * force;
    }
    (times, forces, [x, v])
}

/// At t = 1.7e9, where a rounding of the time is 2.4e-7, eight of them a step would be 1.9e-4 of the way; a force on the
/// wrong side of a time of the table would change the way by some tenths. 1e-12 are the roundings of 1000 steps.
#[track_caller]
fn check(found: [f64; 2], exact: [f64; 2], what: &str) {
    let off = (found[0] - exact[0]).abs() / exact[0].abs().max(1.0);
    assert!(off <= 1e-12, "{what}: {found:?} for {exact:?}");
    assert!(
        (found[1] - exact[1]).abs() <= 1e-12,
        "{what}: {found:?} for {exact:?}"
    );
}

#[test]
fn elements_with_points_at_their_ends_are_whole() {
    for start in [0.0, 1e6, 1.7e9] {
        let (times, forces, exact) = pushed(start);
        let span = start..times[COUNT as usize];
        let run = Simulation::new(&Free).table("u", &times, forces, Interpolation::Hold);
        let begin = Free.state([0.0], [1.0]);
        // Points at both ends need at least two elements between the times of a table.
        for (element, step) in [
            (Element::radau(3), 0.25),
            (Element::radau(3), SHORT / 2.0),
            (Element::mixed(3).lobatto(), SHORT / 2.0),
            (Element::primal(3).lobatto(), SHORT / 4.0),
        ] {
            let what = format!("{element} in steps of {step} from {start}");
            let run = run.clone().element(element).step(step);
            let there = run.run(begin, span.clone()).expect("a run");
            let last = there.last();
            check([last.q[0], last.v[0]], exact, &what);
            let back = run.run(last.state(), span.end..start).expect("a run");
            check([back.last().q[0], back.last().v[0]], [0.0, 1.0], &what);
            let linearised = run.run_linearised(begin, span.clone()).expect("a run");
            // Ordered (p, q): the way is the velocity at the start times the time.
            check([linearised.product()[(1, 0)], 1.0], [15.625, 1.0], &what);
            let count = (there.states().len() - 1).max(1);
            let node = run.steps(begin, start).nth(count - 1);
            let node = node.expect("a node").expect("a step");
            check([node.q[0], node.v[0]], exact, &what);
        }
    }
}

#[test]
fn elements_with_constraints_are_whole() {
    for start in [0.0, 1e6, 1.7e9] {
        let (times, forces, exact) = pushed(start);
        let span = start..times[COUNT as usize];
        let run = Simulation::new(&OnRail).table("u", &times, forces, Interpolation::Hold);
        let begin = OnRail.state([0.0, 0.0], [1.0, 0.0]);
        for (element, step) in [
            (Element::mixed(3), SHORT / 2.0),
            (Element::primal(3), SHORT / 4.0),
            (Element::three_field(3), SHORT / 2.0),
        ] {
            let what = format!("{element} in steps of {step} from {start}");
            let run = run.clone().element(element).step(step);
            let there = run.run(begin, span.clone()).expect("a run");
            check([there.last().q[0], there.last().v[0]], exact, &what);
        }
    }
}

#[test]
fn elements_of_run_time_length_are_whole() {
    let model = Many { n: 3 };
    for start in [0.0, 1e6, 1.7e9] {
        let (times, forces, exact) = pushed(start);
        let span = start..times[COUNT as usize];
        let begin = model.state([0.0; 3], [1.0; 3]);
        let run = Simulation::new(&model).table("u", &times, forces, Interpolation::Hold);
        let run = run.element(Element::radau(3)).step(0.25);
        let there = run.run(begin, span).expect("a run");
        let last = there.last();
        check([last.q[2], last.v[2]], exact, &format!("from {start}"));
    }
}
