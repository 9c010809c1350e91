//! Runs that continue from a checkpoint equal runs without interruption.

use tfe::prelude::*;
use tfe::{RunErrorKind, Warning};

use super::models::{Coupled, Damped, Rod};
use super::{Kepler, Oscillator, PENDULUM};

fn rod(l: f64) -> Rod {
    let (g, s) = (9.81, 1.0);
    Rod { g, l, s }
}

#[dynamics(coordinates(x), lagrangian = dot(x)^2/2 - 1e6*(x - cos(t))^2/2, force(x) = -1e3*dot(x))]
struct Stiff;

/// One run compared with two parts of it, interrupted anywhere: all states, velocities and energies have the same bits.
#[test]
fn two_halves_are_one_run_to_the_bit() {
    fn check<M: tfe::Model<N>, const N: usize>(
        simulation: &Simulation<'_, M, N>,
        start: State<N>,
        (steps, h): (u32, f64),
        cuts: u32,
        seed: &mut u64,
    ) {
        let end = f64::from(steps) * h;
        let whole = simulation.run(start, 0.0..end).expect("a run");
        for _ in 0..cuts {
            *seed = seed
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            let cut = 1 + (*seed >> 33) as u32 % (steps - 1);
            let first = simulation
                .run(start, 0.0..f64::from(cut) * h)
                .expect("a run");
            let checkpoint = first.checkpoint().expect("complete");
            let second = simulation.resume(checkpoint, end).expect("a run");
            let at = cut as usize;
            assert_eq!(first.states(), &whole.states()[..=at], "cut at {cut}");
            assert_eq!(second.states(), &whole.states()[at..], "cut at {cut}");
            assert_eq!(
                second.velocities(),
                &whole.velocities()[at..],
                "cut at {cut}"
            );
            assert_eq!(second.energies(), &whole.energies()[at..], "cut at {cut}");
        }
    }
    let mut seed = 1;
    let kepler = Kepler.state([1.0, 0.0], [0.0, 1.2]);
    for element in [
        Element::mixed(4),
        Element::mixed(8),
        Element::primal(3),
        Element::radau(4),
    ] {
        let h = 0.1;
        check(
            &Simulation::new(&Kepler).element(element).step(h),
            kepler,
            (200, h),
            50,
            &mut seed,
        );
        let stiff = Simulation::new(&Stiff).element(element).step(h);
        check(
            &stiff,
            State { q: [2.0], p: [0.0] },
            (100, h),
            50,
            &mut seed,
        );
        let damped = Damped {
            m: 1.0,
            k: 1.0,
            g: 0.0,
            c: 0.1,
        };
        let damped = Simulation::new(&damped).element(element).step(0.07);
        check(
            &damped,
            State { q: [2.0], p: [0.0] },
            (100, 0.07),
            50,
            &mut seed,
        );
        // Also if steps are cut into pieces.
        let double = Simulation::new(&PENDULUM).element(element).step(0.15);
        check(
            &double,
            PENDULUM.state([1.0, 2.0], [0.0, 0.0]),
            (50, 0.15),
            50,
            &mut seed,
        );
    }
    let rod = rod(1.0);
    for nodes in [2, 3, 4, 5] {
        let simulation = Simulation::new(&rod)
            .element(Element::mixed(nodes))
            .step(0.02);
        check(
            &simulation,
            rod.state([1.0, 0.0], [0.0, 0.0]),
            (150, 0.02),
            50,
            &mut seed,
        );
    }
}

/// A continued run checks for unstable steps like one from the start.
#[test]
fn runs_that_go_on_are_watched() {
    let simulation = Simulation::new(&Oscillator).element(Primal::<3>).step(3.3);
    let first = simulation.run(Oscillator.state([1.0], [0.0]), 0.0..33.0);
    let first = first.expect("ten steps");
    let checkpoint = first.checkpoint().expect("complete");
    let second = simulation.resume(checkpoint, 330.0).expect("a run");
    let told = second.warnings();
    let is_unstable = |warning: &Warning| matches!(warning, Warning::UnstableStep { .. });
    assert!(told.iter().any(is_unstable), "{told:?}");
}

/// Before the first element no impulse has acted; afterwards it has acted exactly once.
#[test]
fn an_impulse_where_a_run_begins_waits_for_its_first_element() {
    let run = Simulation::new(&Oscillator).step(0.1).impulse(0.0, [1.5]);
    let start = Oscillator.state([0.0], [0.0]);
    let resumed = |motion: &Motion<1>, end: f64| {
        let checkpoint = motion.checkpoint().expect("complete");
        run.resume(checkpoint, end).expect("a run")
    };
    let whole = run.run(start, 0.0..2.0).expect("a run");
    let empty = run.run(start, 0.0..0.0).expect("nothing to do");
    let first = resumed(&resumed(&empty, 0.0), 1.0);
    let second = resumed(&resumed(&first, 1.0), 2.0);
    assert_eq!(first.states(), &whole.states()[..=10]);
    assert_eq!(second.states(), &whole.states()[10..]);
}

/// A run that continues from a checkpoint of another model, compared with one that starts there.
fn check_handing_over<M: tfe::Model<N>, const N: usize>(
    first: &Simulation<'_, M, N>,
    second: &Simulation<'_, M, N>,
    start: State<N>,
) {
    let first = first.run(start, 0.0..5.0).expect("a run");
    let checkpoint = first.checkpoint().expect("complete");
    let resumed = second.resume(checkpoint, 10.0).expect("a run");
    let anew = second.run(*checkpoint.state(), 5.0..10.0).expect("a run");
    let (one, other) = (resumed.last(), anew.last());
    for a in 0..N {
        assert!((one.q[a] - other.q[a]).abs() < 1e-13);
        assert!((one.p[a] - other.p[a]).abs() < 1e-13);
    }
}

/// The numbers of a vector are not numbered parameters.
#[test]
fn other_vectors_go_on_from_a_checkpoint() {
    #[dynamics(coordinates(q[2]), lagrangian = sum(i in 0..2, m/2*dot(q[i])^2 - k[i]/2*q[i]^2))]
    struct Springs {
        m: f64,
        k: Vec<f64>,
    }
    let springs = |k: [f64; 2]| Springs {
        m: 1.0,
        k: k.to_vec(),
    };
    let (soft, stiff) = (springs([1.0, 2.0]), springs([4.0, 2.5]));
    let run = |model| {
        let run = Simulation::new(model).element(Element::mixed(6)).step(0.1);
        run.record_every(10)
    };
    let start = soft.state([1.0, 0.5], [0.0, 0.2]);
    check_handing_over(&run(&soft), &run(&stiff), start);
}

/// For a checkpoint of a model with other parameters, nothing that depends on these is carried over.
#[test]
fn other_parameters_go_on_from_a_checkpoint() {
    let springs = |m, k| {
        let (c, l) = (0.0, 1.0);
        Coupled { m, c, k, l }
    };
    let (soft, stiff) = (springs(1.0, 1.0), springs(2.0, 4.0));
    let run = |model| {
        let run = Simulation::new(model).element(Element::mixed(6)).step(0.1);
        run.record_every(10)
    };
    let start = soft.state([1.0, 0.5], [0.0, 0.2]);
    check_handing_over(&run(&soft), &run(&stiff), start);
    let first = run(&soft).run(start, 0.0..5.0);
    let first = first.expect("a run");
    let checkpoint = first.checkpoint().expect("complete");
    let second = run(&stiff).resume(checkpoint, 10.0).expect("a run");
    let anew = run(&stiff).run(*checkpoint.state(), 5.0..10.0);
    let anew = anew.expect("a run");
    // The energy at the start is that with the new parameters, too: all values belong to one model.
    for a in 0..2 {
        let (v, right) = (second.states()[0].v[a], anew.states()[0].v[a]);
        assert!((v - right).abs() < 1e-14);
    }
    assert!((second.energies()[0] - anew.energies()[0]).abs() < 1e-14);
    // Elements of collocation conserve a quadratic energy.
    let change = second.energy_error();
    assert!(change < 1e-12, "{change:e}");
    // A state that violates the constraints of the other model is refused, as in a run.
    let (short, long) = (rod(1.0), rod(2.0));
    let hanging = short.state([1.0, 0.0], [0.0, 0.0]);
    let first = Simulation::new(&short).step(0.02).run(hanging, 0.0..1.0);
    let first = first.expect("a run");
    let checkpoint = first.checkpoint().expect("complete");
    let refused = Simulation::new(&long).step(0.02).resume(checkpoint, 2.0);
    let refused = refused.expect_err("a rod of another length");
    let kind = refused.kind();
    assert!(
        matches!(kind, RunErrorKind::Inconsistent { .. }),
        "{refused}"
    );
    // An empty span does not start a new grid.
    let run = Simulation::new(&soft).step(0.1).element(Element::mixed(4));
    let whole = run.run(start, 0.0..2.0).expect("a run");
    let first = run.run(start, 0.0..1.0).expect("a run");
    let same = run.resume(first.checkpoint().expect("complete"), 1.0);
    let same = same.expect("nothing to do");
    let second = run.resume(same.checkpoint().expect("complete"), 2.0);
    assert_eq!(second.expect("a run").states(), &whole.states()[10..]);
}

/// An impulse at the time of a checkpoint acts once, in the last element before it. If there was no such element it is
/// still to act, and a run backwards in time subtracts it.
#[test]
fn impulses_at_a_checkpoint_act_once() {
    let start = Oscillator.state([1.0], [0.2]);
    let run = Simulation::new(&Oscillator).step(0.1).impulse(1.0, [0.7]);
    let apart = |one: &tfe::Motion<1>, other: State<1>| {
        let node = one.last();
        let (q, p) = (node.q[0] - other.q[0], node.p[0] - other.p[0]);
        assert!(q.abs() < 1e-13 && p.abs() < 1e-13, "{q:e} {p:e}");
    };
    let resumed = |motion: &tfe::Motion<1>, end| {
        let checkpoint = motion.checkpoint().expect("complete");
        run.resume(checkpoint, end).expect("a run")
    };
    let whole = run.run(start, 0.0..2.0).expect("a run").last().state();
    let first = run.run(start, 0.0..1.0).expect("a run");
    apart(&resumed(&first, 2.0), whole);
    let same = resumed(&first, 1.0);
    apart(&resumed(&same, 2.0), whole);
    // Elements of collocation are symmetric in time.
    apart(&resumed(&first, 0.0), start);
    let empty = run.run(start, 1.0..1.0).expect("nothing to do");
    let behind = run.run(start, 1.0..2.0).expect("a run").last().state();
    apart(&resumed(&empty, 2.0), behind);
}

/// Without a step of its own, a continued run uses that of the first part, and not the length of an element that a
/// break has shortened.
#[test]
fn steps_stay_where_a_break_cuts_the_first_one() {
    let run = Simulation::new(&Oscillator).break_at(1e-3);
    let first = run.run(Oscillator.state([1.0], [0.0]), 0.0..10.0);
    let first = first.expect("a thousand steps and one");
    let checkpoint = first.checkpoint().expect("complete");
    let second = run.resume(checkpoint, 20.0).expect("a thousand steps");
    assert_eq!(second.states().len(), 1001);
}
