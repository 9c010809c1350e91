//! Bounds that prove that an event cannot happen in an element: they must cost less than evaluating its polynomial.

use super::*;
use tfe::runtime::step::{Control, Stepper};
use tfe::runtime::{Form, Model};

/// Masses that depend on coordinates: velocities are the unknowns.
const LINKS: TwoLinks = TwoLinks { g: 9.81, w: 0.6 };

/// A constant mass matrix that is not diagonal.
#[dynamics(
    coordinates(a, b),
    lagrangian = dot(a)^2 + dot(b)^2/2 + dot(a)*dot(b)/2 + 9.81*(2*cos(a) + cos(b)),
    output(line) = dot(a) + b - 1,
)]
struct Coupled;

/// A Hamiltonian with time-dependent terms and friction.
#[dynamics(
    coordinates(x, y),
    momenta(px, py),
    hamiltonian = (px^2 + py^2)/(2*(1 + x^2)) + x^2 + y^2/2 + x*cos(t),
    force(y) = -0.1*py,
    output(line) = x + py - 0.5,
)]
struct Swaying;

fn elements() -> Vec<Element> {
    let mixed = (2..=9).map(Element::mixed);
    let others = [
        Element::radau(3),
        Element::radau(5),
        Element::primal(4).reduced(),
        Element::energy_conserving(4),
        Element::mixed(4).lobatto(),
    ];
    mixed.chain(others).collect()
}

/// How often there was a bound on the state within a step, for steps that evaluate all points at once.
fn boxes<M: Model<N>, const N: usize>(model: &M, start: State<N>, h: f64) -> usize {
    const STEPS: i32 = 40;
    let mut count = 0;
    for element in elements() {
        let mut stepper = Stepper::new(model, element, Control::default()).expect("an element");
        let mut state = start;
        for step in 0..STEPS {
            let t = f64::from(step) * h;
            if stepper.advance(t, h, &mut state, &[]).is_err() {
                break;
            }
            let dense = stepper.dense(t, t + h);
            let Some(reach) = stepper.reach() else {
                continue;
            };
            count += 1;
            for sample in 0..=100 {
                let t = t + h * f64::from(sample) / 100.0;
                let here = dense.at_time(t);
                let z = match M::FORM {
                    Form::Lagrangian => dense.velocity_at_time(t),
                    Form::Hamiltonian => here.p,
                };
                for a in 0..N {
                    for (what, value, (low, high)) in
                        [("q", here.q[a], reach.q[a]), ("z", z[a], reach.z[a])]
                    {
                        assert!(
                            low <= value && value <= high,
                            "{element}, h = {h}, {what}[{a}] = {value} beyond {low} … {high}"
                        );
                    }
                }
            }
        }
    }
    count
}

#[test]
fn polynomials_stay_in_their_boxes() {
    for h in [1e-6, 0.01, 0.05, 0.2, -0.1] {
        let start = LINKS.state([0.9, -1.3], [0.4, 2.0]);
        assert!(boxes(&LINKS, start, h) > 100, "h = {h}");
        let start = Coupled.state([0.9, -1.3], [0.4, 2.0]);
        assert!(boxes(&Coupled, start, h) > 100, "h = {h}");
        let start = State {
            q: [0.3, 0.1],
            p: [0.2, -0.3],
        };
        assert!(boxes(&HenonHeiles, start, h) > 100, "h = {h}");
        assert!(boxes(&Swaying, start, h) > 100, "h = {h}");
    }
    // Far from zero, and at rest.
    let far = State {
        q: [1e6, 0.1],
        p: [0.0, 0.0],
    };
    assert!(boxes(&Coupled, far, 0.01) > 100);
}

/// Whether nodes are recorded has no effect on a motion and its events.
#[test]
fn events_are_those_of_runs_that_keep_all_nodes() {
    fn compare<M: Model<N> + Send + Sync, const N: usize>(
        model: &M,
        start: State<N>,
        output: &str,
    ) -> usize {
        let mut met = 0;
        for h in [0.05, 0.013, 0.1] {
            let run = Simulation::new(model)
                .step(h)
                .on(output, Crossing::Either, |event| {
                    // Every other event is a bounce.
                    match event.rises {
                        true => Act::Record,
                        false => Act::Restart(event.state()),
                    }
                });
            let all = run.run(start, 0.0..60.0).expect("a run");
            let some = run
                .clone()
                .record_every(100)
                .run(start, 0.0..60.0)
                .expect("a run");
            assert_eq!(all.events(), some.events(), "h = {h}");
            assert_eq!(all.last().q, some.last().q, "h = {h}");
            met += all.events().len();
            // A restart that changes nothing must not lead to another event.
            let recorded = Simulation::new(model)
                .step(h)
                .on(output, Crossing::Either, |_| Act::Record);
            let [a, b] = [&run, &recorded]
                .map(|run| run.run(start, 0.0..8.0).expect("a run").events().len());
            assert_eq!(a, b, "h = {h}");
            // The same as without the event.
            let never = Simulation::new(model).step(h).record_every(100);
            let watched = never.clone().on(output, Crossing::Either, |_| Act::Record);
            let [a, b] = [never, watched].map(|run| run.run(start, 0.0..60.0).expect("a run"));
            assert_eq!(a.last(), b.last(), "h = {h}");
        }
        met
    }
    let start = LINKS.state([0.9, -0.3], [0.4, 1.0]);
    assert!(compare(&LINKS, start, "line") > 10);
    let start = Coupled.state([0.9, -0.3], [0.4, 1.0]);
    assert!(compare(&Coupled, start, "line") > 10);
    let start = State {
        q: [0.3, 0.1],
        p: [0.2, -0.3],
    };
    assert!(compare(&HenonHeiles, start, "section") > 10);
    assert!(compare(&Swaying, start, "line") > 10);
}
