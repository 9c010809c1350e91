//! Estimated errors compared with true ones, and runs with a given accuracy, which choose their element and step size.

#[path = "../common/largest.rs"]
mod largest;
mod refused;
mod varying_steps;

use largest::larger;
use tfe::accuracy::Estimated;
use tfe::prelude::*;
use tfe::{Consistent, RunErrorKind};

#[dynamics(coordinates(q), lagrangian = dot(q)^2/2 + cos(q), output(height) = -cos(q))]
struct Pendulum;

#[dynamics(coordinates(x, y), momenta(px, py), hamiltonian = (px^2 + py^2)/2 - 1/sqrt(x^2 + y^2))]
struct Kepler;

/// The state of a pendulum at t = 10 from rest at two radians, computed with 32 digits.
const PENDULUM_END: ([f64; 1], [f64; 1]) = ([0.7131481806013794], [-1.5313085041358347]);
/// The state at t = 20 on a Kepler orbit of eccentricity 0.6 from its pericentre, computed with 32 digits.
const KEPLER_END: ([f64; 2], [f64; 2]) = (
    [-0.770_075_578_411_240_4, 0.788_344_816_994_424_4],
    [-0.894_183_731_988_691_5, -0.123_461_764_158_440_96],
);

fn kepler_start() -> State<2> {
    State {
        q: [0.4, 0.0],
        p: [0.0, 2.0],
    }
}

/// The error at the end in the norm of the estimates: relative to the largest coordinate and the largest momentum of
/// the motion.
fn true_error<const N: usize>(motion: &Motion<N>, (q, p): ([f64; N], [f64; N])) -> f64 {
    let of = |exact: &[f64; N], part: fn(&tfe::Node<N>) -> &[f64; N]| {
        let size = motion
            .states()
            .iter()
            .flat_map(part)
            .map(|x| x.abs())
            .fold(0.0, larger);
        let off = exact
            .iter()
            .zip(part(motion.last()))
            .map(|(a, b)| (a - b).abs());
        off.fold(0.0, larger) / size
    };
    larger(of(&q, |node| &node.q), of(&p, |node| &node.p))
}

fn at_end<T>(motion: &Estimated<T>) -> f64 {
    motion.error_estimates().last().expect("an estimate").1
}

/// Ratios of estimated to true errors for a grid of elements and steps, where the true error is between `floor` and a
/// hundredth.
fn ratios<M: Model<N>, const N: usize>(
    model: &M,
    start: State<N>,
    span: f64,
    exact: ([f64; N], [f64; N]),
    steps: &[f64],
) -> Vec<(Element, f64, f64)> {
    let elements = [
        Element::primal(3),
        Element::primal(4).lobatto(),
        Element::mixed(2),
        Element::mixed(4),
        Element::mixed(7),
        Element::mixed(12),
        Element::energy_conserving(3),
        Element::radau(4),
        Element::three_field(5),
    ];
    let mut ratios = Vec::new();
    for element in elements {
        for &step in steps {
            let simulation = Simulation::new(model).element(element).step(step);
            // Some steps are too long to be solved.
            let Ok(motion) = simulation.run(start, 0.0..span) else {
                continue;
            };
            let error = true_error(&motion, exact);
            if (1e-12..1e-2).contains(&error) {
                let estimated = simulation.run_estimated(start, 0.0..span);
                let ratio = estimated.map_or(f64::INFINITY, |motion| at_end(&motion) / error);
                ratios.push((element, step, ratio));
            }
        }
    }
    ratios
}

/// For nine elements, eleven step sizes and two motions the estimate is close to the true error: the element with one
/// node more is so much more accurate that the difference is the error of the first one.
#[test]
fn estimates_are_true_errors_within_a_factor_of_two() {
    let steps = [
        1.0, 0.7, 0.5, 0.35, 0.25, 0.18, 0.12, 0.08, 0.05, 0.03, 0.02,
    ];
    let pendulum = Pendulum.state([2.0], [0.0]);
    let mut all = ratios(&Pendulum, pendulum, 10.0, PENDULUM_END, &steps);
    all.extend(ratios(
        &Kepler,
        kepler_start(),
        20.0,
        KEPLER_END,
        &steps.map(|h| h / 2.0),
    ));
    let good = all
        .iter()
        .filter(|(.., ratio)| (0.5..=2.0).contains(ratio))
        .count();
    for (element, step, ratio) in &all {
        if !(0.5..=2.0).contains(ratio) {
            println!("{element} {step}: {ratio:.2}");
        }
    }
    println!("{good} of {}", all.len());
    assert!(all.len() > 100, "only {} points", all.len());
    assert!(100 * good >= 95 * all.len(), "{good} of {}", all.len());
}

/// With an accuracy ε, the true error is at most ε, after at most five runs.
#[test]
fn accuracy_is_met() {
    for digits in 2..=12 {
        let accuracy = 10_f64.powi(-digits);
        let start = Pendulum.state([2.0], [0.0]);
        let pendulum = Simulation::new(&Pendulum)
            .accuracy(accuracy)
            .run(start, 0.0..10.0);
        let pendulum = pendulum.expect("a pendulum");
        let kepler = Simulation::new(&Kepler)
            .accuracy(accuracy)
            .run(kepler_start(), 0.0..20.0);
        let kepler = kepler.expect("a planet");
        let errors = [
            true_error(pendulum.motion(), PENDULUM_END),
            true_error(kepler.motion(), KEPLER_END),
        ];
        for (error, (estimate, picked)) in errors.into_iter().zip([
            (pendulum.error_estimate(), pendulum.picked()),
            (kepler.error_estimate(), kepler.picked()),
        ]) {
            let picked = picked.expect("picked");
            println!("{accuracy:.0e}: {error:.1e} ({estimate:.1e}), {picked}");
            assert!(
                error <= accuracy && estimate <= accuracy,
                "{accuracy}: {error}, {estimate}"
            );
            assert_eq!(picked.error_estimate, estimate);
            assert!((2..=5).contains(&picked.attempts.len()), "{picked}");
        }
        let height = pendulum.error_estimate_of("height").expect("declared");
        assert!(height <= accuracy && pendulum.error_estimate_of("width").is_none());
    }
}

/// An element of twelve nodes is compared with two of half its length. This must hold for all steps, also if others are
/// more than twice as long: the estimates of the short ones were once exactly zero.
#[test]
fn all_steps_are_halved_where_there_is_no_higher_order() {
    let start = Pendulum.state([2.0], [0.0]);
    let simulation = Simulation::new(&Pendulum).element(Mixed::<12>);
    let nodes = (0..=20).map(|k| 1.2 * f64::from(k)).chain([26.5]);
    let run = simulation.clone().nodes(nodes);
    let motion = run.run_estimated(start, 0.0..26.5).expect("runs");
    let before = motion.error_estimates().take(20);
    let most = before.map(|(_, error)| error).fold(0.0, larger);
    // The singularities of the motion at ±1.7i limit the error of a step to about 1e-16.
    assert!(0.0 < most && most < 1e-6, "{most:e}");
    let empty = simulation.run_estimated(start, 1.0..1.0);
    assert_eq!(empty.expect("nothing to do").error_estimate(), 0.0);
}

#[test]
fn what_was_chosen_before_stays() {
    let start = Pendulum.state([2.0], [0.0]);
    let simulation = Simulation::new(&Pendulum).element(Primal::<4>).step(0.05);
    let motion = simulation
        .accuracy(1e-6)
        .run(start, 0.0..10.0)
        .expect("runs");
    let picked = motion.picked().expect("picked");
    assert_eq!(picked.element, Primal::<4>.into());
    assert!(picked.step <= 0.05);
    assert!(true_error(motion.motion(), PENDULUM_END) <= 1e-6);
    // Backwards in time, and the nodes recorded are those asked for.
    let (q, p) = PENDULUM_END;
    let back = Simulation::new(&Pendulum).record_every(2).accuracy(1e-9);
    let back = back.run(State { q, p }, 10.0..0.0).expect("runs");
    assert_eq!(back.last().t, 0.0);
    assert!(true_error(back.motion(), ([2.0], [0.0])) <= 1e-9);
    assert!((back.states().len() as u64) < back.statistics().steps);
}

/// A run with explicit settings, all those that were chosen.
#[test]
fn what_was_picked_makes_the_same_motion() {
    let start = Pendulum.state([2.0], [0.0]);
    let simulation = Simulation::new(&Pendulum);
    let motion = simulation.clone().accuracy(1e-8).run(start, 0.0..10.0);
    let motion = motion.expect("runs");
    let picked = motion.picked().expect("picked");
    assert_eq!(picked.solve, Solve::FixedPoint);
    let again = simulation
        .element(picked.element)
        .step(picked.step)
        .tolerance(picked.tolerance)
        .solver(picked.solve)
        .run(start, 0.0..10.0)
        .expect("runs");
    assert_eq!(again.states().len(), motion.states().len());
    assert_eq!(again.statistics().newton_iterations, 0);
    let (first, second) = (again.last(), motion.last());
    let apart = larger(
        (first.q[0] - second.q[0]).abs(),
        (first.p[0] - second.p[0]).abs(),
    );
    // The error left by the iterations is far below the accuracy asked for.
    assert!(apart <= 1e-9, "{apart:e}");
    // A linear model needs no iteration and is solved as the simulation says.
    let linear = Simulation::new(&Oscillator).accuracy(1e-8);
    let linear = linear.run(Oscillator.state([1.0], [0.0]), 0.0..10.0);
    let linear = linear.expect("runs");
    assert_eq!(linear.picked().expect("picked").solve, Solve::Auto);
}

#[dynamics(coordinates(x), lagrangian = dot(x)^2/2 - x^2/2, force(x) = select(t < 1, 1, -1))]
struct Switched;

/// In closed form, x = 1 − cos t up to the switch at t = 1, then −1 + a cos(t − 1) + b sin(t − 1); an impulse at t = 3
/// adds to the momentum.
#[test]
fn breaks_and_impulses_are_ends_of_elements() {
    let (x, v) = (1.0 - 1.0_f64.cos(), 1.0_f64.sin());
    let until_three = |s: f64| {
        (
            -1.0 + (x + 1.0) * s.cos() + v * s.sin(),
            v * s.cos() - (x + 1.0) * s.sin(),
        )
    };
    let (x3, v3) = until_three(2.0);
    let v3 = v3 + 0.5;
    let exact = -1.0 + (x3 + 1.0) * 1.0_f64.cos() + v3 * 1.0_f64.sin();
    let simulation = Simulation::new(&Switched).break_at(1.0).impulse(3.0, [0.5]);
    let start = Switched.state([0.0], [0.0]);
    let motion = simulation
        .accuracy(1e-10)
        .run(start, 0.0..4.0)
        .expect("runs");
    assert!(
        (motion.last().q[0] - exact).abs() < 1e-10,
        "{}",
        motion.last().q[0] - exact
    );
    assert!(motion.states().iter().any(|node| node.t == 1.0));
}

#[dynamics(coordinates(x, y), lagrangian = m/2*(dot(x)^2 + dot(y)^2) - m*g*y, constraint(rod) = x^2 + y^2 - l^2)]
struct RodPendulum {
    m: f64,
    l: f64,
    g: f64,
}

/// The same pendulum in Cartesian coordinates with a constraint, from rest at two radians.
#[test]
fn constraints_are_no_obstacle() {
    let rod = RodPendulum {
        m: 1.0,
        l: 1.0,
        g: 1.0,
    };
    let start = rod
        .consistent_state([2.0_f64.sin(), -2.0_f64.cos()], [0.0, 0.0])
        .map(|Consistent { state, .. }| state)
        .expect("a start");
    let motion = Simulation::new(&rod)
        .accuracy(1e-8)
        .run(start, 0.0..10.0)
        .expect("runs");
    let angle = PENDULUM_END.0[0];
    let off = [
        motion.last().q[0] - angle.sin(),
        motion.last().q[1] + angle.cos(),
    ];
    assert!(off.iter().all(|x| x.abs() <= 1e-8), "{off:?}");
}

#[dynamics(coordinates(x), lagrangian = dot(x)^2/2 - x^2/2)]
struct Oscillator;

#[test]
fn linear_models_too() {
    let start = Oscillator.state([1.0], [0.0]);
    let motion = Simulation::new(&Oscillator)
        .accuracy(1e-9)
        .run(start, 0.0..100.0)
        .expect("runs");
    assert!((motion.last().q[0] - 100.0_f64.cos()).abs() <= 1e-9);
}

#[dynamics(coordinates(x), lagrangian = dot(x)^2/2 - k/2*x^2)]
struct Spring {
    k: f64,
}

/// Runs that agree to the last bit although no iteration tells their order, as those of linear models do over short
/// spans, at rest, and with coordinates of any size.
#[test]
fn runs_without_a_difference_meet_an_accuracy() {
    let half = 0.5_f64;
    let cases = [
        (0.0, 1.0, 1.0),
        (-1.0, 1.0, half.cosh()),
        (1.0, 1e150, half.cos()),
        (1.0, 1e-300, half.cos()),
        (1.0, 0.0, 0.0),
    ];
    for (k, x, factor) in cases {
        for accuracy in [1e-3, 1e-6, 1e-8, 1e-10, 1e-12] {
            let spring = Spring { k };
            let simulation = Simulation::new(&spring).accuracy(accuracy);
            let motion = simulation.run(spring.state([x], [0.0]), 0.0..half);
            let motion = motion.unwrap_or_else(|error| panic!("{k} {x:e} {accuracy}: {error}"));
            let off = (motion.last().q[0] - factor * x).abs();
            assert!(off <= accuracy * x, "{k} {x:e} {accuracy}: {off}");
        }
    }
}

#[dynamics(
    coordinates(x),
    lagrangian = dot(x)^2/2 - x^2/2 - x^4/4,
    dissipation = c/2*dot(x)^2,
    force(x) = a*cos(w*t),
)]
struct DrivenDuffing {
    c: f64,
    a: f64,
    w: f64,
}

/// The evaluations of all runs of a search, divided by those of a run with the fewest equal steps of the same element
/// that meets the accuracy from there on, none of them cut.
#[test]
fn a_search_costs_a_few_runs() {
    let model = DrivenDuffing {
        c: 0.2,
        a: 0.5,
        w: 1.2,
    };
    let (start, span) = (model.state([0.5], [0.0]), 0.0..50.0);
    let simulation = Simulation::new(&model);
    let fine = simulation.clone().element(Mixed::<9>).step(0.05);
    let exact = fine.run(start, span.clone()).expect("short steps");
    // The error at all nodes, since the motion forgets its initial state.
    let off = |motion: &Motion<1>| {
        let largest = |part: fn(&tfe::Node<1>) -> f64| {
            let nodes = motion.states().iter();
            let off = nodes.clone().map(|node| {
                let there = exact.at(node.t).expect("in the span");
                (part(node) - part(&there)).abs()
            });
            let size = nodes.map(|node| part(node).abs()).fold(0.0, larger);
            off.fold(0.0, larger) / size
        };
        larger(largest(|node| node.q[0]), largest(|node| node.p[0]))
    };
    let work = |one: &tfe::Statistics| one.residual_evaluations + one.tangent_evaluations;
    for accuracy in [1e-3, 1e-5, 1e-7, 1e-9, 1e-11] {
        let motion = simulation.clone().accuracy(accuracy);
        let motion = motion.run(start, span.clone()).expect("an oscillator");
        assert!(off(&motion) <= accuracy, "{accuracy:e}");
        let picked = motion.picked().expect("picked");
        let made = |count: u32| {
            let run = simulation.clone().element(picked.element);
            let run = run.step(50.0 / f64::from(count)).tolerance(1e-3 * accuracy);
            let motion = run.run(start, span.clone()).ok()?;
            let is_by_hand = motion.statistics().cuts == 0;
            (is_by_hand && off(&motion) <= accuracy).then(|| work(motion.statistics()))
        };
        // The runs with more steps must meet it too: not only by chance.
        let meets = |count: u32| (count..count + 3).all(|count| made(count).is_some());
        let fewest = (1..5000).find(|count| meets(*count)).expect("enough");
        let least = made(fewest).expect("it was made");
        let ratio = work(&picked.work) as f64 / least as f64;
        println!(
            "{accuracy:e}: {} steps of {}, {ratio:.1} times {fewest} steps",
            motion.statistics().steps,
            picked.element
        );
        assert!(ratio < 6.0, "{accuracy:e}: {ratio}");
    }
}

#[dynamics(
    coordinates(q[n]),
    lagrangian = sum(i in 0..n, dot(q[i])^2/2) - sum(i in 0..n-1, (q[i+1]-q[i])^2/2 + a/3*(q[i+1]-q[i])^3),
    output(strain[i in 0..n-1]) = q[i+1] - q[i],
)]
struct Chain {
    n: usize,
    a: f64,
}

/// The same for a chain of any length, compared with a run whose steps are so short that only rounding errors are left.
#[test]
fn families_know_their_errors_too() {
    let chain = Chain { n: 40, a: 0.25 };
    let q: Vec<f64> = (0..chain.n).map(|i| (0.7 * i as f64).cos()).collect();
    let start = chain.state(q, vec![0.0; chain.n]);
    let fine = Simulation::new(&chain).element(Mixed::<10>).step(0.01);
    let fine = fine
        .record_every(100)
        .run(start.clone(), 0.0..20.0)
        .expect("runs");
    let size = |part: fn(&tfe::family::Node) -> &Vec<f64>| {
        let numbers = fine.states().iter().flat_map(part);
        numbers.fold(0.0, |most: f64, x| most.max(x.abs()))
    };
    let (size_q, size_p) = (size(|node| &node.q), size(|node| &node.p));
    let error = |node: &tfe::family::Node| {
        let largest = |a: &[f64], b: &[f64]| {
            let pairs = a.iter().zip(b);
            pairs.fold(0.0, |most, (a, b)| larger(most, (a - b).abs()))
        };
        let q = largest(&node.q, &fine.last().q) / size_q;
        larger(q, largest(&node.p, &fine.last().p) / size_p)
    };
    for accuracy in [1e-4, 1e-8, 1e-11] {
        let motion = Simulation::new(&chain)
            .accuracy(accuracy)
            .run(start.clone(), 0.0..20.0);
        let motion = motion.expect("a chain");
        let (off, estimate) = (error(motion.last()), motion.error_estimate());
        println!(
            "{accuracy:.0e}: {off:.1e} ({estimate:.1e}), {}",
            motion.picked().expect("picked")
        );
        assert!(
            off <= accuracy && estimate <= accuracy,
            "{accuracy}: {off}, {estimate}"
        );
        assert!(motion.error_estimate_of("strain[7]").expect("declared") <= accuracy);
    }
    for (element, step) in [
        (Element::mixed(3), 0.1),
        (Element::mixed(5), 0.5),
        (Element::mixed(12), 2.0),
    ] {
        let simulation = Simulation::new(&chain).element(element).step(step);
        let motion = simulation
            .run_estimated(start.clone(), 0.0..20.0)
            .expect("a chain");
        let ratio = at_end(&motion) / error(motion.last());
        assert!((0.5..=2.0).contains(&ratio), "{element}: {ratio}");
    }
    let mut short = start.clone();
    short.q.pop();
    let error = Simulation::new(&chain)
        .accuracy(1e-6)
        .run(short, 0.0..1.0)
        .expect_err("a short vector");
    assert!(matches!(error.kind(), RunErrorKind::Family(_)), "{error}");
    let error = Simulation::new(&chain)
        .accuracy(2.0)
        .run(start, 0.0..1.0)
        .expect_err("no accuracy");
    assert!(
        matches!(error.kind(), RunErrorKind::Accuracy { .. }),
        "{error}"
    );
}

/// Breaks that are equal up to rounding, or equal to the end up to rounding, must not produce a tiny element between
/// them.
#[test]
fn breaks_a_rounding_apart_are_one() {
    let start = Pendulum.state([2.0], [0.0]);
    let late = 0.1 + 0.2;
    let run = Simulation::new(&Pendulum).break_at(0.3);
    let twice = run.clone().break_at(late).accuracy(1e-6);
    twice.run(start, 0.0..1.0).expect("a break");
    let at_end = run.accuracy(1e-6);
    at_end.run(start, 0.0..late).expect("a break");
}

/// Orbits that pass the centre closely, from the apocentre over two periods: the first runs of the search all fail at
/// the first pericentre, and longer steps across it lead to different motions, but the motion does not end there.
#[test]
fn close_encounters_are_no_end_of_a_motion() {
    for (eccentricity, accuracy) in [(0.98, 1e-3), (0.98, 1e-8), (0.99, 1e-6)] {
        let apart = 1.0 + eccentricity;
        let start = State {
            q: [-apart, 0.0],
            p: [0.0, -((1.0 - eccentricity) / apart).sqrt()],
        };
        let run = Simulation::new(&Kepler).accuracy(accuracy);
        let motion = run.run(start, 0.0..4.0 * std::f64::consts::PI);
        let motion = motion.unwrap_or_else(|error| panic!("e = {eccentricity}: {error}"));
        let q = motion.last().q;
        let off = (q[0] - start.q[0]).hypot(q[1]) / apart;
        assert!(
            off <= accuracy,
            "e = {eccentricity}: {off:e} of {accuracy:e}"
        );
        assert!(motion.error_estimate() <= accuracy);
    }
}
