//! Forces with kinks and jumps: elements keep their order of accuracy, and an accuracy asked for is met or refused.

mod constraints;
mod derivatives;
#[path = "../common/differences.rs"]
mod differences;
#[path = "../common/largest.rs"]
mod largest;
mod scene;

use derivatives::Rattle;
use largest::larger;
use scene::{BOUNCE, Coulomb, SMOOTHED, Scene, scenes};
use tfe::prelude::*;
use tfe::runtime::{Model, StepError};
use tfe::{RunErrorKind, Warning};

fn apart(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter()
        .zip(b)
        .fold(0.0, |most, (a, b)| larger(most, (a - b).abs()))
}

/// With steps cut at kinks, elements keep their order; with elements across kinks, all have order one or two.
fn elements_keep_their_order(which: impl Fn(&Scene<'_>) -> bool) {
    for scene in scenes().into_iter().filter(which) {
        let fine = (scene.run)(Element::mixed(8), scene.step / 4.0, true);
        for (element, order) in [
            (Element::mixed(4), 6.0),
            (Element::primal(4), 6.0),
            (Element::radau(4), 5.0),
            (Primal::<4>.lobatto(), 6.0),
        ] {
            // For a jump that depends on the velocity, quadrature points at the ends of an element see the velocity of
            // the polynomial, which may be on either side of the jump.
            if scene.name == "dry friction" && element == Primal::<4>.lobatto() {
                continue;
            }
            let steps = [1.0, 0.5, 0.25, 0.125].map(|part| part * scene.step);
            let runs = steps.map(|step| (scene.run)(element, step, true));
            let errors = runs.each_ref().map(|run| apart(&run.end, &fine.end));
            let name = scene.name;
            // The order over two halvings; the last errors may be rounding errors, which crossings amplify.
            let measured = (0..2).map(|k| (errors[k] / errors[k + 2]).log2() / 2.0);
            let most = measured.fold(0.0, larger);
            assert!(
                most > order - 0.6 || errors[3] < 1e-11,
                "{name} {element}: order {most:.2}, {errors:?}"
            );
            assert_eq!(runs[3].kinks, fine.kinks, "{name} {element}");
            // For the smooth scene both runs are the same, as another test shows.
            if fine.kinks == 0 {
                continue;
            }
            let across = (scene.run)(element, steps[3], false);
            assert_eq!(across.kinks, 0);
            // An element across a kink has order one or two.
            let ratio = apart(&across.end, &fine.end) / errors[3].max(1e-13);
            assert!(ratio > 3.0, "{name} {element}: {ratio:.1}");
        }
    }
}

// Parts of one test, so that they run in parallel.
#[test]
fn elements_keep_their_order_when_bouncing() {
    elements_keep_their_order(|scene| scene.step < 0.01);
}

#[test]
fn elements_keep_their_order_in_short_steps() {
    elements_keep_their_order(|scene| (0.01..0.05).contains(&scene.step));
}

#[test]
fn elements_keep_their_order_in_long_steps() {
    elements_keep_their_order(|scene| scene.step >= 0.05);
}

/// The accuracy asked for is met.
#[test]
fn an_accuracy_is_met() {
    for scene in scenes() {
        let fine = (scene.run)(Element::mixed(8), scene.step / 4.0, true);
        let largest = fine.end.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
        for accuracy in [1e-3, 1e-5, 1e-7, 1e-9, 1e-11] {
            let (end, estimate) = (scene.accurate)(accuracy)
                .unwrap_or_else(|error| panic!("{} {accuracy:e}: {error}", scene.name));
            let error = apart(&end, &fine.end);
            // The estimate is for the whole span, relative to its largest coordinate and momentum.
            assert!(
                error < accuracy * (1.0 + largest),
                "{} {accuracy:e}: {error:.1e}",
                scene.name
            );
            assert!(estimate <= accuracy);
        }
    }
}

/// Steps across the jump of a friction that holds the motion do not converge; the message says why.
#[test]
fn steps_across_a_jump_that_holds_the_motion_are_told_so() {
    let held = Coulomb {
        c: 3.0,
        a: 0.5,
        w: 1.3,
    };
    let run = Simulation::new(&held).element(Element::mixed(4)).step(0.1);
    let error = run.run(held.state([1.0], [1.0]), 0.0..10.0);
    let error = error.expect_err("no element holds the motion");
    let RunErrorKind::Solve { source, .. } = *error.kind() else {
        panic!("{error}");
    };
    assert!(
        matches!(source, StepError::StalledAcrossKinks { .. }),
        "{error}"
    );
    assert!(error.to_string().contains("at_kinks(true)"), "{error}");
    let kind = run
        .steps(held.state([1.0], [1.0]), 0.0)
        .find_map(Result::err);
    assert_eq!(kind.as_ref(), Some(error.kind()));
}

/// If friction sticks, the motion stays at v = 0, and the equations as declared do not define it.
#[test]
fn sliding_is_told() {
    let held = Coulomb {
        c: 3.0,
        a: 0.5,
        w: 1.3,
    };
    for element in [Element::mixed(4), Element::mixed(6), Element::radau(3)] {
        let run = Simulation::new(&held)
            .element(element)
            .step(0.1)
            .at_kinks(true);
        let error = run
            .run(held.state([1.0], [1.0]), 0.0..10.0)
            .expect_err("slides");
        let RunErrorKind::Solve { time, source, .. } = *error.kind() else {
            panic!("{element}: {error}");
        };
        assert_eq!(source, StepError::Slides, "{element}");
        // x'' = −x − x³ − 3 + 0.5 sin 1.3t from (1, 1) comes to rest after 0.2.
        assert!((0.1..0.3).contains(&time), "{element}: {time}");
        assert!(error.partial().last().t > 0.05);
    }
    let error = Simulation::new(&held)
        .accuracy(1e-6)
        .run(held.state([1.0], [1.0]), 0.0..10.0)
        .expect_err("slides");
    assert!(error.to_string().contains("slides"), "{error}");
}

/// A body that friction holds at rest from the start: −x − x³ = −2 is less than the friction 3. Only steps in which
/// nothing changes are solved, and that too many of these would be needed explains nothing.
#[test]
fn sticking_is_told() {
    let held = Coulomb {
        c: 3.0,
        a: 0.5,
        w: 1.3,
    };
    let error = Simulation::new(&held)
        .accuracy(1e-6)
        .run(held.state([1.0], [0.0]), 0.0..1.0)
        .expect_err("sticks");
    assert!(
        !matches!(error.kind(), RunErrorKind::TooManySteps { .. }),
        "{error}"
    );
}

/// A force that is switched off at a given time.
#[test]
fn jumps_in_time_are_found() {
    let free = Free { until: 0.55 };
    for element in [
        Element::mixed(2),
        Element::mixed(5),
        Element::radau(4),
        Primal::<3>.lobatto(),
    ] {
        for (from, to) in [(0.0, 1.0), (1.0, 0.0)] {
            let run = Simulation::new(&free)
                .element(element)
                .step(0.1)
                .at_kinks(true);
            let start = if from < to {
                State { q: [0.0], p: [0.0] }
            } else {
                State {
                    q: [0.55 * 0.45 + 0.55 * 0.55 / 2.0],
                    p: [0.55],
                }
            };
            let motion = run.run(start, from..to).expect("a run");
            let end = motion.last();
            let exact = if from < to {
                [0.55 * 0.45 + 0.55 * 0.55 / 2.0, 0.55]
            } else {
                [0.0, 0.0]
            };
            assert!(
                (end.q[0] - exact[0]).abs() < 1e-14 && (end.p[0] - exact[1]).abs() < 1e-14,
                "{element} {from}: {end:?}"
            );
            assert_eq!((motion.statistics().kinks, motion.states().len()), (1, 11));
            // Between the nodes, too.
            let inside = motion.at(0.5625).expect("inside");
            assert!((inside.p[0] - 0.55).abs() < 1e-14, "{inside:?}");
            let steps = run.steps(start, from);
            let last = steps.take(5).last().expect("steps").expect("a step");
            assert!(last.p[0] > 0.4);
        }
    }
}

/// A jump at a node of the grid does not lead to a step of length zero, and quadrature points at the ends of elements
/// see the force of their own element.
#[test]
fn jumps_at_nodes_are_passed() {
    fn check(what: &str, until: f64, run: Simulation<'_, impl Model<1>, 1>) {
        for element in [
            Element::mixed(4),
            Element::radau(4),
            Primal::<3>.lobatto(),
            Element::mixed(3).lobatto(),
        ] {
            let run = run.clone().element(element).at_kinks(true);
            let motion = run.run(tfe::State { q: [0.0], p: [0.0] }, 0.0..2.0);
            let motion = motion.unwrap_or_else(|error| panic!("{what} {element} {until}: {error}"));
            let off = motion.last().p[0] - until;
            assert!(off.abs() < 1e-14, "{what} {element} {until}: {off:e}");
        }
    }
    for until in [0.3, 0.5, 0.7, 1.0] {
        check("<", until, Simulation::new(&Free { until }).step(0.1));
        check("<=", until, Simulation::new(&Held { until }).step(0.1));
    }
}

/// A force during some time.
#[dynamics(coordinates(x), lagrangian = dot(x)^2/2, force(x) = select(t < until, 1, 0))]
struct Free {
    until: f64,
}

/// The same with the force at the boundaries of the interval.
#[dynamics(coordinates(x), lagrangian = dot(x)^2/2, force(x) = select(t <= until, 1, 0))]
struct Held {
    until: f64,
}

/// Models without kinks give the same bits with and without the option.
#[test]
fn smooth_models_are_not_touched() {
    let run = Simulation::new(&SMOOTHED).step(0.01);
    let start = SMOOTHED.state([1.0], [0.0]);
    let plain = run.clone().run(start, 0.0..1.0).expect("a run");
    let asked = run.at_kinks(true).run(start, 0.0..1.0).expect("a run");
    assert_eq!(plain.states(), asked.states());
    assert_eq!(plain.statistics(), asked.statistics());
}

/// The runs of an ensemble have the same bits as those of a simulation.
#[test]
fn ensembles_are_cut_at_kinks() {
    let starts: Vec<_> = (1..=20)
        .map(|k| BOUNCE.state([0.02 * f64::from(k)], [0.0]))
        .collect();
    let ensemble = Ensemble::new(&BOUNCE).element(Mixed::<5>).step(0.02);
    let cut = ensemble.clone().at_kinks(true);
    let ends = cut.run(&starts, 0.0..1.0).expect("runs");
    let simulation = Simulation::new(&BOUNCE).element(Mixed::<5>).step(0.02);
    let mut kinks = 0;
    for (start, end) in starts.iter().zip(ends.iter()) {
        let run = simulation.clone().at_kinks(true).run(*start, 0.0..1.0);
        let run = run.expect("a run");
        assert_eq!(end.as_ref().map(|node| node.q), Ok(run.last().q));
        kinks += run.statistics().kinks;
    }
    assert_eq!(ends.statistics().kinks, kinks);
    assert!(kinks > 40, "{kinks}");
    // Also as a continued run.
    let mut parts = cut.begin(&starts, 0.0).expect("starts");
    let middle = parts.run_to(0.4).expect("runs");
    let end = parts.run_to(1.0).expect("runs");
    let both = middle.statistics().kinks + end.statistics().kinks;
    assert_eq!((both, end.into_results()), (kinks, ends.into_results()));
    // And backwards, off the grid; an empty span changes nothing.
    assert!(parts.run_to(f64::NAN).is_err());
    let back = parts.run_to(-0.013).expect("runs back");
    let ahead = parts.run_to(0.0).expect("runs");
    assert_eq!((back.nodes().count(), ahead.nodes().count()), (20, 20));
    for (start, node) in starts.iter().zip(ahead.nodes()) {
        assert!((start.q[0] - node.q[0]).abs() < 1e-9, "{start:?} {node:?}");
    }
    let mut none = cut.begin(&[], 0.0).expect("no starts");
    assert!(none.run_to(1.0).expect("nothing").is_empty());
    let across = ensemble.run(&starts, 0.0..1.0).expect("runs");
    assert_eq!(across.statistics().kinks, 0);
    // A sliding motion is an error of its own run only.
    let held = Coulomb {
        c: 3.0,
        a: 0.5,
        w: 1.3,
    };
    let ends = Ensemble::new(&held).step(0.1).at_kinks(true);
    let ends = ends.run(&[held.state([0.1], [0.5])], 0.0..6.0);
    let ends = ends.expect("runs");
    assert_eq!((ends.nodes().count(), ends.failures().count()), (0, 1));
}

/// Steps have the right length at large times, too, where differences of times have few digits: at t = 1e9, steps of
/// 0.01 were too short by 1e-8.
#[test]
fn late_steps_beside_kinks_keep_their_length() {
    let end = |start: f64, h: f64| {
        let run = Simulation::new(&BOUNCE).step(h).at_kinks(true);
        let start = start..start + 50.0 * h;
        let run = run.run(BOUNCE.state([5.0], [0.0]), start).expect("a run");
        (run.last().q[0], run.last().v[0])
    };
    for start in [1e6, 1e9, -1e9] {
        // Falls by 1.25 m from 5 m, far above the spring; the same backwards in time.
        let (q, v) = end(start, 0.01);
        assert!(
            (q - 3.75).abs() < 1e-12 && (v + 5.0).abs() < 1e-12,
            "{start}: {q} {v}"
        );
        let (q, v) = end(start, -0.01);
        assert!(
            (q - 3.75).abs() < 1e-12 && (v - 5.0).abs() < 1e-12,
            "{start}: {q} {v}"
        );
    }
}

/// Beside a jump that depends on the velocity, the iteration of an arc with a point at its end converges in one trial and
/// not in the next one of the same length; such an arc ends a little earlier.
#[test]
fn arcs_with_points_at_their_ends_come_to_jumps_by_the_velocity() {
    let model = Rattle::with_valley();
    let end = |element, step| {
        let run = Simulation::new(&model)
            .element(element)
            .step(step)
            .at_kinks(true);
        let motion = run.run(model.state([0.5, -0.2], [0.3, 0.9]), 0.0..3.0);
        let motion = motion.unwrap_or_else(|error| panic!("{element} {step}: {error}"));
        (motion.last().q, motion.statistics().kinks)
    };
    let (exact, kinks) = end(Element::mixed(6), 0.03);
    let errors = [0.1, 0.05, 0.025].map(|step| {
        let (q, crossed) = end(Element::radau(3), step);
        assert_eq!(crossed, kinks, "{step}");
        apart(&q, &exact)
    });
    // Order three: 64, less where a step has more of the kinks.
    assert!(
        errors[0] <= 1e-3 && errors[2] <= errors[0] / 30.0,
        "{errors:?}"
    );
}

/// A structure at rest whose sites begin to move one after the other. Quantities that grow from zero as powers of a
/// small time are not kinks, as long as all gaps are open.
#[test]
fn what_decides_nothing_cuts_nothing() {
    #[dynamics(
        coordinates(x[12]),
        lagrangian = sum(i in 0..12, dot(x[i])^2/2 - s/2*max(abs(x[i]) - gap, 0)^2)
            - k/2*(x[0] - 0.05*sin(7*t))^2 - sum(i in 0..11, k/2*(x[i+1] - x[i])^2),
    )]
    struct Gaps {
        k: f64,
        s: f64,
        gap: f64,
    }
    let gaps = |gap| Gaps {
        k: 900.0,
        s: 2e4,
        gap,
    };
    let rest = State {
        q: [0.0; 12],
        p: [0.0; 12],
    };
    let open = gaps(1.0);
    for element in [Element::mixed(3), Element::mixed(6), Element::radau(4)] {
        let run = Simulation::new(&open).element(element).step(0.01);
        let cut = run.clone().at_kinks(true).run(rest, 0.0..2.0);
        let cut = cut.unwrap_or_else(|error| panic!("{element}: {error}"));
        assert_eq!(cut.statistics().kinks, 0, "{element}");
        let across = run.run(rest, 0.0..2.0).expect("a run");
        let off = cut.last().q.iter().zip(across.last().q);
        let off = off.map(|(a, b)| (a - b).abs()).fold(0.0, larger);
        assert!(off < 1e-13, "{element}: {off:e}");
    }
    let narrow = gaps(0.03);
    let run = |step| {
        let run = Simulation::new(&narrow).element(Mixed::<8>).step(step);
        run.at_kinks(true).run(rest, 0.0..2.0).expect("a run")
    };
    let (coarse, fine) = (run(0.01), run(0.005));
    assert_eq!(coarse.statistics().kinks, fine.statistics().kinks);
    let off = coarse.last().q.iter().zip(fine.last().q);
    let off = off.map(|(a, b)| (a - b).abs()).fold(0.0, larger);
    assert!(off < 1e-12, "{off:e}");
}

/// If both runs of an estimate have elements across a kink, the estimate is unreliable, and there is a warning; with
/// steps cut at kinks, and for smooth models, there is none.
#[test]
fn estimates_across_kinks_say_so() {
    let start = BOUNCE.state([1.0], [0.0]);
    let run = Simulation::new(&BOUNCE).step(0.02);
    let across = run.run_estimated(start, 0.0..2.0).expect("a run");
    assert!(across.warnings().contains(&Warning::KinksCrossed));
    let cut = run.at_kinks(true).run_estimated(start, 0.0..2.0);
    assert!(
        !cut.expect("a run")
            .warnings()
            .contains(&Warning::KinksCrossed)
    );
    let smooth = Simulation::new(&SMOOTHED).step(0.02);
    let start = SMOOTHED.state([1.0], [0.0]);
    let smooth = smooth.run_estimated(start, 0.0..2.0).expect("a run");
    assert!(!smooth.warnings().contains(&Warning::KinksCrossed));
}

/// An element that ends at an event is also cut at the kinks before it: a cord that goes slack, and a wall.
#[test]
fn times_of_events_behind_a_kink_are_as_accurate() {
    #[dynamics(
        coordinates(x, y),
        lagrangian = m/2*(dot(x)^2 + dot(y)^2) - m*g*y - k/2*max(hypot(x, y) - l, 0)^2,
        event(wall) = x - w,
    )]
    struct Cord {
        m: f64,
        g: f64,
        k: f64,
        l: f64,
        w: f64,
    }
    let cord = Cord {
        m: 1.0,
        g: 9.81,
        k: 50.0,
        l: 1.0,
        w: 0.8,
    };
    for step in [0.02, 0.01] {
        let simulation = Simulation::new(&cord)
            .element(Mixed::<6>)
            .step(step)
            .at_kinks(true)
            .on("wall", Crossing::Rising, |event| {
                Act::Restart(event.state_with_velocity([-event.v[0], event.v[1]]))
            });
        let run = simulation.run(cord.state([-0.9, 0.6], [0.0, 0.0]), 0.0..5.0);
        let run = run.expect("a good run");
        assert_eq!(run.events().len(), 3);
        assert!(run.energy_error() < 1e-13, "{:e}", run.energy_error());
    }
}
