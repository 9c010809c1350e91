//! Difficult runs: what ends with `Ok` is right, or has a warning.

mod checkpoints;
mod encounters;
mod indices;
#[path = "../common/largest.rs"]
mod largest;
mod masses;
mod models;
mod steppers;
mod units;

use largest::larger;
use models::{Coupled, Damped};
use tfe::prelude::*;
use tfe::runtime::step::{Control, Stepper};
use tfe::{RunErrorKind, Warning};

/// A double pendulum with equal masses and unit lengths.
#[dynamics(
    coordinates(a, b),
    lagrangian = dot(a)^2 + dot(b)^2/2 + cos(a - b)*dot(a)*dot(b) + 2*g*cos(a) + g*cos(b)
)]
struct DoublePendulum {
    g: f64,
}

const PENDULUM: DoublePendulum = DoublePendulum { g: 9.81 };

/// The Hamiltonian of the double pendulum.
fn energy(state: &State<2>) -> f64 {
    let ([a, b], [p, r]) = (state.q, state.p);
    let c = (a - b).cos();
    let kinetic = (p * p / 2.0 - c * p * r + r * r) / (2.0 - c * c);
    kinetic - 2.0 * PENDULUM.g * a.cos() - PENDULUM.g * b.cos()
}

fn starts() -> Vec<State<2>> {
    let start = |k: u32| {
        let (a, b) = (f64::from(k) / 50.0, f64::from(k * 7 % 50) / 50.0);
        PENDULUM.state([0.5 + 2.4 * a, -1.0 + 3.9 * b], [0.0, 0.0])
    };
    (0..50).map(start).collect()
}

/// Six states from each of fifty motions.
fn visited() -> Vec<State<2>> {
    let simulation = Simulation::new(&PENDULUM).element(Mixed::<6>).step(0.01);
    let mut states = Vec::new();
    for start in starts() {
        let motion = simulation.run(start, 0.0..6.0).expect("a run");
        let every = motion.states().iter().skip(100).step_by(100);
        states.extend(every.map(tfe::Node::state));
    }
    states
}

#[test]
fn a_long_step_continues_the_motion() {
    let states = visited();
    assert_eq!(states.len(), 300);
    // (step size, largest energy change in one of 300 steps, with kinetic energies up to 59). Formerly these were up to
    // 2e8 at 0.2 and 1e12 at 0.4.
    for (h, most) in [
        (0.1, 2.0),
        (0.15, 4.0),
        (0.2, 6.0),
        (0.3, 6.0),
        (0.4, 6.0),
        (0.5, 6.0),
    ] {
        let mut cuts = 0;
        for state in &states {
            let mut stepper =
                Stepper::new(&PENDULUM, Mixed::<4>.into(), Control::default()).expect("a stepper");
            let mut end = *state;
            stepper.advance(0.0, h, &mut end, &[]).expect("a step");
            let change = (energy(&end) - energy(state)).abs();
            assert!(
                change < most,
                "h = {h}: energy off by {change:.1e} from {state:?}"
            );
            cuts += stepper.statistics().cuts;
        }
        assert!(cuts < 150 || h > 0.2, "h = {h}: {cuts} of 300 cut");
    }
}

#[test]
fn steps_that_are_cut_stay_on_the_grid() {
    let simulation = Simulation::new(&PENDULUM).element(Mixed::<4>).step(0.5);
    let (mut cuts, mut doubtful) = (0, 0);
    for start in starts() {
        let motion = simulation.run_linearised(start, 0.0..10.0).expect("a run");
        let run = motion.motion();
        assert_eq!((run.states().len(), run.statistics().steps), (21, 20));
        cuts += run.statistics().cuts;
        doubtful += usize::from(!run.warnings().is_empty());
        // Dense output interpolates all nodes, and its pieces belong to one curve.
        for (k, node) in run.states().iter().enumerate() {
            let near = run.at((node.t + 1e-9).min(10.0)).expect("inside");
            let apart = (near.q[0] - node.q[0]).abs() + (near.q[1] - node.q[1]).abs();
            assert!(apart < 1e-6, "node {k}: {apart:.1e}");
        }
        // The product of the matrices of the pieces is symplectic, as is each of them.
        for matrix in motion.transitions() {
            let determinant = matrix.determinant();
            assert!((determinant - 1.0).abs() < 1e-6, "{determinant}");
        }
        let back = run.last().state();
        let ended = energy(&back) - energy(&start);
        let is_warned = run
            .warnings()
            .iter()
            .any(|one| matches!(one, Warning::EnergyJump { .. }));
        assert!(
            ended.abs() < 30.0 || is_warned,
            "energy off by {ended:.1e} without a warning"
        );
    }
    assert!(
        cuts > 100 && doubtful > 0,
        "{cuts} cuts, {doubtful} with warnings"
    );
}

#[test]
fn ensembles_cut_the_same_steps() {
    let starts = starts();
    let ends = Ensemble::new(&PENDULUM)
        .element(Mixed::<4>)
        .step(0.2)
        .run(&starts, 0.0..2.0)
        .expect("an ensemble");
    let simulation = Simulation::new(&PENDULUM).element(Mixed::<4>).step(0.2);
    for (start, end) in starts.iter().zip(ends.iter()) {
        let alone = simulation.run(*start, 0.0..2.0).expect("a run");
        let end = end.as_ref().expect("an end");
        let apart = (alone.last().q[0] - end.q[0]).abs() + (alone.last().q[1] - end.q[1]).abs();
        // A lane that leaves a step to Newton's method starts it anew, and a run continues from its last element, so
        // that different steps may be cut. The difference is then the error of the step, whereas wrong roots differed
        // by a factor of 10⁶.
        assert!(apart < 1.0, "{apart:.1e} apart");
    }
}

#[dynamics(coordinates(x, y), lagrangian = (dot(x)^2 + dot(y)^2)/2 + 1/sqrt(x^2 + y^2))]
struct Kepler;

#[dynamics(coordinates(x), lagrangian = dot(x)^2/2 - ln(x))]
struct Logarithm;

#[dynamics(coordinates(x), lagrangian = m/2*dot(x)^2 - x^2/2 - x^4)]
struct Anharmonic {
    m: f64,
}

/// An error, a warning, or a conserved energy.
fn is_told<const N: usize>(run: Result<tfe::Motion<N>, tfe::RunError<N>>) -> bool {
    match run {
        Err(_) => true,
        Ok(motion) => !motion.warnings().is_empty() || motion.energy_error() < 0.2,
    }
}

#[dynamics(
    coordinates(x),
    lagrangian = dot(x)^2/2 + x^2/2 - x^4/4,
    force(x) = 0.3*cos(1.2*t) - 0.2*dot(x)
)]
struct DrivenDuffing;

fn is_unresolved<const N: usize>(motion: &tfe::Motion<N>) -> bool {
    let told = |one: &Warning| matches!(one, Warning::Unresolved { .. });
    motion.warnings().iter().any(told)
}

/// Without a conserved energy: a driven, damped oscillator, two steps of 1 to 3 from 200 states. An end whose error is
/// a fifth of the path must have a warning.
#[test]
fn steps_that_do_not_resolve_a_driven_motion_are_told() {
    let (mut wrong, mut told) = (0, 0);
    for k in 0..200 {
        let part = |factor: u32| f64::from(k * factor % 200) / 200.0;
        let start = DrivenDuffing.state([3.0 * part(7) - 1.5], [3.0 * part(31) - 1.5]);
        let h = 1.0 + 2.0 * part(1);
        let fine = Simulation::new(&DrivenDuffing)
            .element(Mixed::<8>)
            .step(0.01);
        let fine = fine.run(start, 0.0..2.0 * h).expect("a fine run");
        assert!(fine.warnings().is_empty(), "{:?}", fine.warnings());
        let way: f64 = fine
            .states()
            .windows(2)
            .map(|pair| (pair[1].q[0] - pair[0].q[0]).abs())
            .sum();
        for element in [Element::mixed(3), Element::primal(3), Element::radau(3)] {
            let long = Simulation::new(&DrivenDuffing).element(element).step(h);
            let Ok(motion) = long.run(start, 0.0..2.0 * h) else {
                continue;
            };
            let off = (motion.last().q[0] - fine.last().q[0]).abs();
            told += u32::from(is_unresolved(&motion));
            if !(off <= way / 5.0) {
                wrong += 1;
                assert!(
                    !motion.warnings().is_empty(),
                    "{element}, h = {h}: off by {off:.2} of {way:.2} from {start:?}"
                );
            }
        }
    }
    assert!(told > wrong && wrong > 5, "{wrong} wrong, {told} told");
}

/// Energy-conserving elements conserve it at wrong roots, too.
#[test]
fn long_steps_that_keep_the_energy_are_told() {
    let mut wrong = 0;
    for start in starts() {
        let fine = Simulation::new(&PENDULUM).element(Mixed::<8>).step(0.01);
        let fine = fine.run(start, 0.0..3.0).expect("a fine run");
        let element = Element::energy_conserving(3);
        let long = Simulation::new(&PENDULUM).element(element).step(1.5);
        let Ok(motion) = long.run(start, 0.0..3.0) else {
            continue;
        };
        let off = |a: usize| (motion.last().q[a] - fine.last().q[a]).abs();
        if !(off(0) + off(1) <= 2.0) {
            wrong += 1;
            assert!(is_unresolved(&motion), "from {start:?}");
        }
    }
    assert!(wrong > 5, "{wrong} wrong");
}

/// No unnecessary warnings: with elements of first order, from rest, past turning points, and in steps solved by
/// Newton's method.
#[test]
fn steps_that_resolve_are_not_warned_of() {
    let elements = [
        (Element::radau(2), 0.01),
        (Element::mixed(2), 0.03),
        (Element::mixed(4), 0.1),
        (Element::primal(3).reduced(), 0.03),
        (Element::energy_conserving(3), 0.05),
        (Element::mixed(8), 0.15),
    ];
    for (element, h) in elements {
        for solve in [Solve::Auto, Solve::Newton] {
            for start in starts().into_iter().step_by(5) {
                let run = Simulation::new(&PENDULUM).element(element).step(h);
                let motion = run.solver(solve).run(start, 0.0..3.0).expect("a run");
                let told = motion.warnings();
                assert!(!is_unresolved(&motion), "{element}, {start:?}: {told:?}");
            }
            let run = Simulation::new(&DrivenDuffing).element(element).step(h);
            for x in [0.1, 0.5, 1.0, 1.5] {
                let start = DrivenDuffing.state([x], [0.0]);
                let motion = run
                    .clone()
                    .solver(solve)
                    .run(start, 0.0..20.0)
                    .expect("a run");
                assert!(!is_unresolved(&motion), "{element}, {x}");
            }
        }
    }
}

#[test]
fn singular_points_are_told() {
    for nodes in 2..=8 {
        for step in [0.003, 0.01, 0.02, 0.05, 0.11] {
            let element = Element::mixed(nodes);
            let fall = Simulation::new(&Kepler).element(element).step(step);
            let run = fall.run(Kepler.state([1.0, 0.0], [0.0, 0.0]), 0.0..4.0);
            assert!(
                is_told(run),
                "falling into the centre, {element}, h = {step}"
            );
            let log = Simulation::new(&Logarithm).element(element).step(step);
            let run = log.run(Logarithm.state([-1.0], [0.5]), 0.0..4.0);
            assert!(is_told(run), "ln(-1), {element}, h = {step}");
        }
    }
}

#[test]
fn a_mass_of_zero_is_told() {
    let model = Anharmonic { m: 0.0 };
    let start = State { q: [0.5], p: [0.0] };
    let run = Simulation::new(&model).step(0.1).run(start, 0.0..1.0);
    let told = match &run {
        Err(_) => true,
        Ok(motion) => motion
            .warnings()
            .iter()
            .any(|one| matches!(one, Warning::EnergyNotFinite { time } if *time == 0.0)),
    };
    assert!(told, "{run:?}");
}

/// A matrix with the eigenvalues 1 − c and 1 + c.
fn coupled(c: f64) -> Coupled {
    let (m, k, l) = (1.0, 2.0, 2.0);
    Coupled { m, c, k, l }
}

#[test]
fn masses_of_both_signs_are_told() {
    let found = |c: f64| {
        let model = coupled(c);
        let start = model.state([0.1, 0.2], [0.0, 0.0]);
        let motion = Simulation::new(&model).step(0.01).run(start, 0.0..0.1);
        let warnings = motion.expect("a run").warnings().to_vec();
        warnings.into_iter().find_map(|warning| match warning {
            Warning::MassIndefinite {
                time,
                least,
                largest,
            } => Some((time, least, largest)),
            _ => None,
        })
    };
    let (time, least, largest) = found(1.5).expect("told");
    assert!(time == 0.0 && (least + 0.5).abs() < 1e-15 && (largest - 2.5).abs() < 1e-15);
    assert_eq!((found(0.5), found(0.999)), (None, None));
}

#[dynamics(
    coordinates(x),
    lagrangian = dot(x)^2/2,
    force(x) = late*select(t < 0.5, 1, 0) + (1 - late)*select(t <= 0.5, 1, 0)
)]
struct Switched {
    /// One: at the break itself the force counts as after the break; zero: as before it.
    late: f64,
}

#[dynamics(coordinates(x), lagrangian = dot(x)^2/2 - x^2/2)]
struct Oscillator;

/// `steps` warn as runs do.
#[test]
fn endless_steps_are_watched() {
    fn check<M: tfe::Model<N>, const N: usize>(
        simulation: &Simulation<'_, M, N>,
        start: State<N>,
        span: std::ops::Range<f64>,
    ) -> Vec<Warning> {
        let motion = match simulation.run(start, span) {
            Ok(motion) => motion,
            Err(error) => error.into_partial(),
        };
        let mut steps = simulation.steps(start, motion.states()[0].t);
        // One more if the run has failed.
        let count = motion.statistics().steps as usize;
        assert_eq!(
            steps.by_ref().take(count).filter(Result::is_ok).count(),
            count
        );
        assert_eq!(steps.warnings(), motion.warnings());
        steps.warnings()
    }
    let start = DrivenDuffing.state([1.0], [0.0]);
    let duffing = Simulation::new(&DrivenDuffing).element(Mixed::<3>);
    let told = check(&duffing.clone().step(2.5), start, 0.0..10.0);
    assert!(matches!(told[..], [Warning::Unresolved { .. }]), "{told:?}");
    assert_eq!(check(&duffing.step(0.05), start, 0.0..10.0), []);
    let element = Element::energy_conserving(3);
    let pendulum = Simulation::new(&PENDULUM).element(element).step(1.5);
    let unresolved = |start| check(&pendulum, start, 0.0..6.0).len();
    assert!(starts().into_iter().map(unresolved).sum::<usize>() > 25);
    let primal = Simulation::new(&Oscillator).element(Primal::<3>).step(-3.3);
    let told = check(&primal, Oscillator.state([1.0], [0.0]), 0.0..-330.0);
    assert!(
        matches!(told[..], [Warning::UnstableStep { .. }]),
        "{told:?}"
    );
    let coupled = coupled(1.5);
    let indefinite = Simulation::new(&coupled).step(0.01);
    let told = check(&indefinite, coupled.state([0.1, 0.2], [0.0; 2]), 0.0..0.1);
    assert!(matches!(told[..], [Warning::MassIndefinite { .. }]));
    let fall = Simulation::new(&Kepler).element(Mixed::<2>).step(0.11);
    let told = check(&fall, Kepler.state([1.0, 0.0], [0.0, 0.0]), 0.0..4.0);
    assert!(!told.is_empty());
}

/// `steps` end at breaks as runs do, on nodes with the same bits.
#[test]
fn endless_steps_end_at_breaks() {
    let model = Switched { late: 0.0 };
    let start = model.state([0.0], [0.0]);
    for element in [Element::radau(3), Element::mixed(3), Element::primal(3)] {
        for breaks in [&[0.5][..], &[0.0, 0.5], &[0.5, 0.77, -3.0, f64::INFINITY]] {
            for (h, end) in [(0.1, 1.2), (0.07, 1.2), (-0.1, -0.7)] {
                let mut simulation = Simulation::new(&model).element(element).step(h);
                for time in breaks {
                    simulation = simulation.break_at(*time);
                }
                let motion = simulation.run(start, 0.0..end).expect("a run");
                let nodes = &motion.states()[1..motion.states().len() - 1];
                let steps = simulation.steps(start, 0.0);
                for (node, step) in nodes.iter().zip(steps) {
                    assert_eq!(step.expect("a step"), *node, "{element}, h = {h}");
                }
            }
        }
        let simulation = Simulation::new(&model).element(element).step(0.1);
        let mut steps = simulation.break_at(0.5).steps(start, 0.0);
        let node = steps.find_map(|node| node.ok().filter(|node| node.t > 0.95));
        let node = node.expect("a node");
        assert!((node.v[0] - 0.5).abs() < 1e-14, "{}", node.v[0]);
    }
}

/// A force of 1 before t = 0.5 and none after: x(1) = 3/8, on whichever side the model counts the time of the break;
/// and the same backwards in time.
#[test]
fn forces_at_breaks_are_those_of_the_element() {
    let mut met = 0;
    for (h, late) in [
        (0.1, 0.0),
        (0.1, 1.0),
        (0.07, 0.0),
        (0.07, 1.0),
        (0.25, 0.0),
        (0.25, 1.0),
    ] {
        let model = Switched { late };
        for nodes in 2..=6 {
            for element in [
                Element::radau(nodes.max(3)),
                Element::mixed(nodes),
                Element::mixed(nodes).lobatto(),
                Element::primal(nodes).lobatto(),
            ] {
                let simulation = Simulation::new(&model)
                    .element(element)
                    .step(h)
                    .break_at(0.5);
                let there = simulation.run(model.state([0.0], [0.0]), 0.0..1.0);
                let Ok(there) = there else { continue };
                let end = there.last();
                let off = (end.q[0] - 0.375).abs();
                assert!(off < 1e-14, "{element}, h = {h}, {late}: {}", end.q[0]);
                let back = simulation.run(end.state(), 1.0..0.0).expect("a run");
                let off = back.last().q[0].abs() + back.last().p[0].abs();
                assert!(
                    off < 1e-14,
                    "{element}, h = {h}, {late}: back to {:?}",
                    back.last()
                );
                met += 1;
            }
        }
    }
    // Of 120, some of which may be invalid elements.
    assert!(met > 90, "{met}");
}

#[test]
fn an_iteration_that_cycles_ends() {
    let model = Anharmonic { m: 1.0 };
    for h in [0.1, 0.5, 1.0, 2.0, 5.0] {
        let simulation = Simulation::new(&model)
            .solver(Solve::FixedPoint)
            .max_iterations(u32::MAX)
            .tolerance(0.0)
            .step(h);
        // It must end, with a motion or an error.
        let _ = simulation.run(model.state([1.0], [0.3]), 0.0..10.0 * h);
    }
}

/// The iteration error of an element is at most the tolerance times the largest number of the state, for each of its
/// values: one step compared with one iterated down to rounding.
#[test]
fn a_tolerance_is_what_an_element_leaves() {
    /// The error of one step, with numbers between one and three.
    const ROUNDINGS: f64 = 2e-15;
    for solve in [Solve::FixedPoint, Solve::Newton] {
        for element in [Element::mixed(3), Element::mixed(6), Element::radau(4)] {
            for start in visited().into_iter().step_by(7) {
                let step = |tolerance: f64| {
                    let run = Simulation::new(&PENDULUM).element(element).step(0.02);
                    let run = run.solver(solve).tolerance(tolerance);
                    let motion = run.run(start, 0.0..0.02).expect("a step");
                    *motion.last()
                };
                let exact = step(0.0);
                let size =
                    |numbers: [f64; 2]| numbers.into_iter().fold(1.0, |a: f64, x| a.max(x.abs()));
                for tolerance in [1e-5, 1e-7, 1e-9, 1e-11, 1e-13, 1e-15] {
                    let node = step(tolerance);
                    let off = |one: [f64; 2], other: [f64; 2]| {
                        let off = larger((one[0] - other[0]).abs(), (one[1] - other[1]).abs());
                        off / size(other)
                    };
                    let off = larger(off(node.q, exact.q), off(node.p, exact.p));
                    assert!(
                        off <= tolerance + ROUNDINGS,
                        "{element} {solve:?} {tolerance:e}: {off:e}"
                    );
                }
            }
        }
    }
}

#[test]
fn steps_below_the_resolution_of_the_time_are_refused() {
    let model = Anharmonic { m: 1.0 };
    let start = model.state([1.0], [0.0]);
    let simulation = Simulation::new(&model).step(0.01);
    let run = simulation.run(start, 1e15..1e15 + 10.0);
    let error = run.expect_err("nodes share times");
    assert!(
        matches!(error.kind(), RunErrorKind::StepUnresolved { .. }),
        "{error}"
    );
    // The origin of time does not matter as long as the time has enough digits.
    let far = simulation.run(start, 1e9..1e9 + 10.0).expect("a run");
    let near = simulation.run(start, 0.0..10.0).expect("a run");
    assert!((far.last().q[0] - near.last().q[0]).abs() < 1e-12);
    // An end that differs from the last node by a rounding error is that node.
    for steps in 1..40 {
        let length = f64::from(steps) * 0.01;
        let far = simulation.run(start, 1.7e9..1.7e9 + length).expect("a run");
        assert_eq!(far.states().len(), steps as usize + 1);
        let near = simulation.run(start, 0.0..length).expect("a run");
        assert!((far.last().q[0] - near.last().q[0]).abs() < 1e-12);
    }
}

/// A bead in a bowl that drives another mass and has almost no inertia left at the bottom, which it passes within a
/// thousandth of a second. A step that has to be cut there must be checked whatever its number.
#[test]
fn steps_that_are_cut_are_looked_at() {
    #[dynamics(
        coordinates(x, y, z),
        lagrangian = dot(x)^2/2 + j*dot(x)*dot(y) + dot(y)^2/2 + dot(z)^2/2 - z,
        constraint(bowl) = z - y^2/2,
    )]
    struct Bead {
        j: f64,
    }
    let bead = Bead { j: 0.999 };
    let start = bead.state([0.3, 0.5, 0.125], [0.2, 0.4, 0.2]);
    let run = |h: f64| {
        let run = Simulation::new(&bead).step(h).run(start, 0.0..1.0);
        run.expect("a run")
    };
    let fine = run(1e-3);
    assert_eq!(fine.warnings(), []);
    let coarse = run(0.05);
    let off = (coarse.last().q[1] - fine.last().q[1]).abs();
    assert!(off > 0.02 && coarse.statistics().cuts == 1, "{off}");
    let told = coarse.warnings();
    assert!(
        matches!(told, [Warning::Unresolved { time, .. }] if (time - 0.7).abs() < 1e-9),
        "{told:?}"
    );
}

/// Steps as small as rounding errors of the time are refused before the first one.
#[test]
fn endless_steps_below_the_resolution_of_the_time_are_refused() {
    let simulation = Simulation::new(&Oscillator).step(1.0);
    let mut steps = simulation.steps(Oscillator.state([1.0], [0.0]), 1e17);
    let first = steps.next().expect("an error");
    let kind = first.expect_err("nodes share times");
    assert!(
        matches!(kind, RunErrorKind::StepUnresolved { .. }),
        "{kind}"
    );
    assert!(steps.next().is_none());
}

/// Linear models under gravity with masses of all sizes: steps by one matrix agree with those that are solved by
/// iteration.
#[test]
fn heavy_linear_models_keep_their_motion() {
    let (k, g, c) = (0.0, 9.81, 0.5);
    for m in [1e-30, 1.0, 6e24, 1e30, 1e60] {
        let body = Damped { m, k, g, c };
        let run = Simulation::new(&body).element(Element::mixed(6)).step(0.01);
        let motion = run
            .record_every(100)
            .run(body.state([0.0], [3.0]), 0.0..4.0);
        let motion = motion.expect("a run");
        let (v_end, decay) = (-9.81 / 0.5, (-0.5 * 4.0_f64).exp());
        let y = v_end * 4.0 + (3.0 - v_end) * (1.0 - decay) / 0.5;
        let found = motion.last().q[0];
        assert!((found - y).abs() < 1e-11 * y.abs(), "{m}: {found} {y}");
    }
}
