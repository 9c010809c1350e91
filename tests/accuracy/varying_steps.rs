//! Variable step sizes, short where the motion is fast, and runs over given nodes.

use super::{PENDULUM_END, Pendulum, larger};
use tfe::prelude::*;
use tfe::{RunErrorKind, accuracy::Estimated};

#[dynamics(coordinates(x), lagrangian = dot(x)^2/2 - x^2/2, force(x) = mu*(1 - x^2)*dot(x))]
struct VanDerPol {
    mu: f64,
}

const STIFF: VanDerPol = VanDerPol { mu: 1000.0 };

/// Reference at t = 2000 from (2, 0), from the test set for initial value problems (problem `vdpol`, in units of μ),
/// computed there by Radau 5.
const STIFF_END: (f64, f64) = (1.706_167_732_170_483, -0.892_809_701_024_797_5e-3);

fn largest(numbers: impl Iterator<Item = f64>) -> f64 {
    numbers.fold(0.0, |most, x| larger(most, x.abs()))
}

/// The error at the end in the norm of the estimates: relative to the largest coordinate and the largest momentum of
/// the motion.
fn true_error(motion: &Motion<1>, (q, p): (f64, f64)) -> f64 {
    let states = || motion.states().iter();
    let off_q = (motion.last().q[0] - q).abs() / largest(states().map(|node| node.q[0]));
    let off_p = (motion.last().p[0] - p).abs() / largest(states().map(|node| node.p[0]));
    larger(off_q, off_p)
}

fn steps(motion: &Motion<1>) -> usize {
    motion.states().len() - 1
}

/// The shortest and the longest step size.
fn extremes(motion: &Motion<1>) -> (f64, f64) {
    let nodes = motion.states().windows(2);
    let lengths = nodes.map(|pair| (pair[1].t - pair[0].t).abs());
    lengths.fold((f64::INFINITY, 0.0), |(least, most), length| {
        (f64::min(least, length), larger(most, length))
    })
}

fn relaxation(accuracy: f64) -> Estimated<Motion<1>> {
    Simulation::new(&STIFF)
        .accuracy(accuracy)
        .run(STIFF.state([2.0], [0.0]), 0.0..2000.0)
        .expect("two jumps")
}

/// Step sizes are a ten-thousandth in the jumps and hundreds between them; with equal steps there would be millions.
#[test]
fn relaxation_oscillations_are_met() {
    for digits in [2, 4, 6, 8, 10] {
        let accuracy = 10_f64.powi(-digits);
        let motion = relaxation(accuracy);
        let picked = motion.picked().expect("picked");
        let error = true_error(&motion, STIFF_END);
        println!(
            "{accuracy:.0e}: {error:.1e}, {} steps, {picked}",
            steps(&motion)
        );
        let estimate = motion.error_estimate();
        assert!(
            error <= estimate && estimate <= accuracy,
            "{accuracy}: {error}, {estimate}"
        );
        let (shortest, longest) = extremes(&motion);
        // Step sizes are differences of nodes, with their rounding errors.
        assert!((picked.shortest - shortest).abs() < 1e-6 * shortest && picked.varies());
        assert!((picked.step - longest).abs() < 1e-6 * longest);
        assert!(longest > 1e5 * shortest, "{shortest}, {longest}");
        assert!((steps(&motion) as f64) < 0.01 * 2000.0 / shortest);
        // The momentum at the end is a millionth of that in the jumps; it is accurate relative to its own size as well.
        let (_, p) = STIFF_END;
        assert!((motion.last().p[0] / p - 1.0).abs() < 10.0 * accuracy);
    }
}

/// The same as equations of first order, declared by H = p·f. That a model is a Hamiltonian one must not be taken for a
/// reason to use equal steps.
#[dynamics(
    coordinates(x, v), momenta(px, pv),
    hamiltonian = px*v + pv*(mu*(1 - x^2)*v - x),
)]
struct FirstOrder {
    mu: f64,
}

#[test]
fn equations_of_first_order_have_them_too() {
    let model = FirstOrder { mu: STIFF.mu };
    let start = State {
        q: [2.0, 0.0],
        p: [0.0, 0.0],
    };
    for accuracy in [1e-3, 1e-6, 1e-9] {
        let motion = Simulation::new(&model).accuracy(accuracy);
        let motion = motion.run(start, 0.0..2000.0).expect("two jumps");
        let largest = largest(
            motion
                .states()
                .iter()
                .map(|node| larger(node.q[0].abs(), node.q[1].abs())),
        );
        let off = (motion.last().q[0] - STIFF_END.0).abs() / largest;
        assert!(off <= accuracy, "{accuracy:e}: {off:.1e}");
        assert!(motion.states().len() < 10_000, "{}", motion.states().len());
    }
}

/// Robertson's reaction, whose rate constants differ by nine orders of magnitude, declared by H = p·f.
#[dynamics(
    coordinates(a, b, c), momenta(pa, pb, pc),
    hamiltonian = pa*(1e4*b*c - 0.04*a) + pb*(0.04*a - 1e4*b*c - 3e7*b^2) + pc*3e7*b^2,
)]
struct Robertson;

#[test]
fn a_stiff_reaction_takes_few_steps() {
    let start = State {
        q: [1.0, 0.0, 0.0],
        p: [0.0; 3],
    };
    let by_mesh = |count: u32| {
        let nodes = (0..=count).map(|k| 40.0 * (f64::from(k) / f64::from(count)).powi(5));
        let run = Simulation::new(&Robertson).element(Radau::<7>);
        let motion = run.nodes(nodes).run(start, 0.0..40.0).expect("a mesh");
        motion.last().q
    };
    let off = |one: [f64; 3], other: [f64; 3]| {
        largest(one.iter().zip(other).map(|(one, other)| one - other))
    };
    let exact = by_mesh(400);
    assert!(off(by_mesh(300), exact) < 1e-12);
    for accuracy in [1e-3, 1e-6, 1e-9] {
        let motion = Simulation::new(&Robertson).accuracy(accuracy);
        let motion = motion.run(start, 0.0..40.0).expect("a reaction");
        let (off, count) = (off(motion.last().q, exact), motion.states().len());
        println!("{accuracy:e}: off by {off:.1e}, {count} nodes");
        assert!(off <= accuracy, "{accuracy:e}: {off:.1e}");
        assert!(count < 500, "{count}");
    }
}

/// The recorded motion can be used like any other: evaluated between nodes, and as the mesh of another run.
#[test]
fn nodes_of_one_run_serve_another() {
    let motion = relaxation(1e-6);
    let nodes: Vec<f64> = motion.states().iter().map(|node| node.t).collect();
    let start = STIFF.state([2.0], [0.0]);
    for element in [Element::radau(6), Element::radau(8)] {
        let again = Simulation::new(&STIFF)
            .element(element)
            .nodes(nodes.iter().copied())
            .run(start, 0.0..2000.0)
            .expect("the same steps");
        assert_eq!(again.states().len(), nodes.len());
        assert!(
            again
                .states()
                .iter()
                .zip(&nodes)
                .all(|(node, t)| node.t == *t)
        );
        let error = true_error(&again, STIFF_END);
        assert!(error < 1e-6, "{element}: {error}");
    }
    // On the slow branches the velocity is v = x/(μ (1 − x²)), with an error of the order of 1/μ³.
    for t in [100.0, 500.0, 1000.0, 1900.0] {
        let node = motion.at(t).expect("inside");
        let [x] = node.q;
        let slow = x / (1000.0 * (1.0 - x * x));
        assert!(
            (node.p[0] / slow - 1.0).abs() < 1e-3,
            "{t}: {} {slow}",
            node.p[0]
        );
    }
}

/// From nonstiff to stiff, compared with steps so short that only rounding errors are left.
#[test]
fn less_stiff_ones_are_met_too() {
    for (mu, end) in [(1.0, 20.0), (5.0, 60.0), (30.0, 120.0)] {
        let model = VanDerPol { mu };
        let start = model.state([2.0], [0.0]);
        let fine = Simulation::new(&model)
            .element(Mixed::<8>)
            .step(end / 4000.0 / mu)
            .record_every(1000)
            .run(start, 0.0..end)
            .expect("short steps");
        let truth = (fine.last().q[0], fine.last().p[0]);
        for accuracy in [1e-4, 1e-6, 1e-8, 1e-10] {
            let asked = Simulation::new(&model).accuracy(accuracy);
            let motion = asked.clone().run(start, 0.0..end).expect("runs");
            let error = true_error(&motion, truth);
            let estimate = motion.error_estimate();
            println!(
                "{mu} {accuracy:.0e}: {error:.1e}, {}",
                motion.picked().expect("picked")
            );
            assert!(
                error <= accuracy && estimate <= accuracy,
                "{mu} {accuracy}: {error}, {estimate}"
            );
            if mu > 20.0 {
                let equal = asked.equal_steps().run(start, 0.0..end).expect("runs");
                assert!(
                    4 * steps(&motion) < steps(&equal),
                    "{} {}",
                    steps(&motion),
                    steps(&equal)
                );
                assert!(!equal.picked().expect("picked").varies());
            }
        }
    }
}

#[dynamics(
    coordinates(x),
    lagrangian = dot(x)^2/2 - x^2/2 - x^4/4,
    dissipation = c/2*dot(x)^2,
    force(x) = select(t < 30, a*cos(w*t), 0),
)]
struct Duffing {
    c: f64,
    a: f64,
    w: f64,
}

/// A force that ends at t = 30 and an impulse at t = 40: both times are nodes, and the accuracy is met after them,
/// forwards and backwards in time.
#[test]
fn breaks_and_impulses_stay_nodes() {
    let model = Duffing {
        c: 0.1,
        a: 20.0,
        w: 1.2,
    };
    let start = model.state([0.5], [0.0]);
    let simulation = Simulation::new(&model).break_at(30.0).impulse(40.0, [10.0]);
    let fine = simulation.clone().element(Mixed::<8>).step(0.002);
    let fine = fine.run(start, 0.0..60.0).expect("short steps");
    let truth = (fine.last().q[0], fine.last().p[0]);
    for accuracy in [1e-4, 1e-7, 1e-10] {
        let motion = simulation.clone().accuracy(accuracy);
        let motion = motion.run(start, 0.0..60.0).expect("a Duffing oscillator");
        let error = true_error(&motion, truth);
        println!(
            "{accuracy:.0e}: {error:.1e}, {}",
            motion.picked().expect("picked")
        );
        assert!(error <= accuracy, "{accuracy}: {error}");
        // There are no tiny steps next to them.
        assert!(motion.picked().expect("picked").shortest > 1e-3);
        for time in [30.0, 40.0] {
            assert!(motion.states().iter().any(|node| node.t == time), "{time}");
        }
    }
}

/// For conservative motions steps are equal, whether variable ones are forbidden or not.
#[test]
fn conservative_models_keep_equal_steps() {
    let start = Pendulum.state([3.1], [0.0]);
    for accuracy in [1e-4, 1e-8] {
        let asked = Simulation::new(&Pendulum).accuracy(accuracy);
        let motion = asked.clone().run(start, 0.0..500.0).expect("a pendulum");
        let equal = asked
            .equal_steps()
            .run(start, 0.0..500.0)
            .expect("a pendulum");
        assert_eq!(motion.states(), equal.states());
        assert_eq!(motion.picked(), equal.picked());
        assert!(!motion.picked().expect("picked").varies());
    }
}

/// Nodes given by hand: equal ones give the same as a step size, others end where they should, with breaks among them;
/// they also serve as the first mesh of a run with an accuracy.
#[test]
fn nodes_are_what_they_are_told() {
    let start = Pendulum.state([2.0], [0.0]);
    let simulation = Simulation::new(&Pendulum).element(Mixed::<5>);
    let equal = simulation
        .clone()
        .step(0.125)
        .run(start, 0.0..10.0)
        .expect("runs");
    let nodes = (0..=80).map(|k| 0.125 * f64::from(k));
    let same = simulation
        .clone()
        .nodes(nodes)
        .run(start, 0.0..10.0)
        .expect("runs");
    assert_eq!(equal.states(), same.states());
    let uneven = [10.0, 9.5, 6.0, 5.75, 0.0];
    let back = simulation.clone().nodes(uneven).break_at(7.0);
    let back = back.run(start, 10.0..0.0).expect("runs");
    let times: Vec<f64> = back.states().iter().map(|node| node.t).collect();
    assert_eq!(times, [10.0, 9.5, 7.0, 6.0, 5.75, 0.0]);
    let asked = Simulation::new(&Pendulum)
        .nodes([0.0, 1.0, 4.0, 10.0])
        .accuracy(1e-9);
    let motion = asked.run(start, 0.0..10.0).expect("runs");
    let ([q], [p]) = PENDULUM_END;
    assert!(true_error(&motion, (q, p)) <= 1e-9);
    let (shortest, longest) = extremes(&motion);
    assert!(longest <= 6.0 && longest > 2.0 * shortest);
}

#[test]
fn nodes_that_are_none_are_refused() {
    let start = Pendulum.state([2.0], [0.0]);
    let kind = |nodes: &[f64]| {
        let simulation = Simulation::new(&Pendulum).nodes(nodes.iter().copied());
        let error = simulation
            .run(start, 0.0..1.0)
            .expect_err("no nodes of the span");
        let asked = simulation.accuracy(1e-6).run(start, 0.0..1.0);
        let other = asked.expect_err("no nodes either");
        assert_eq!(error.kind().to_string(), other.kind().to_string());
        error.kind().clone()
    };
    for (nodes, wrong) in [
        (&[0.0, 0.5, 0.5, 1.0][..], 2),
        (&[0.0, 0.7, 0.5, 1.0], 2),
        (&[0.0, f64::NAN, 1.0], 1),
        (&[1.0, 0.5, 0.0], 1),
        (&[0.0, f64::INFINITY], 1),
    ] {
        let kind = kind(nodes);
        assert!(
            matches!(kind, RunErrorKind::NodeOrder { node, .. } if node == wrong),
            "{nodes:?}: {kind}"
        );
    }
    for nodes in [&[][..], &[0.0], &[0.0, 0.5], &[0.5, 1.0], &[0.0, 2.0]] {
        let kind = kind(nodes);
        assert!(
            matches!(kind, RunErrorKind::NodeEnds { .. }),
            "{nodes:?}: {kind}"
        );
    }
}

/// A step size set before is the largest one allowed, and an element set before is kept.
#[test]
fn what_was_chosen_before_stays() {
    let simulation = Simulation::new(&STIFF).element(Radau::<6>).step(20.0);
    let motion = simulation.accuracy(1e-5);
    let motion = motion
        .run(STIFF.state([2.0], [0.0]), 0.0..1000.0)
        .expect("a jump");
    let picked = motion.picked().expect("picked");
    assert_eq!(picked.element, Radau::<6>.into());
    assert!(
        picked.step <= 20.0 && extremes(&motion).1 <= 20.0,
        "{picked}"
    );
}

#[dynamics(
    coordinates(x[n]),
    lagrangian = sum(i in 0..n, dot(x[i])^2/2 - x[i]^2/2) - sum(i in 0..n-1, k/2*(x[i+1] - x[i])^2),
    force(x[i]) = mu*(1 - x[i]^2)*dot(x[i]),
)]
struct Row {
    n: usize,
    k: f64,
    mu: f64,
}

/// The same for a row of oscillators as a model of run-time length.
#[test]
fn families_have_them_too() {
    let row = Row {
        n: 6,
        k: 0.1,
        mu: 8.0,
    };
    let q: Vec<f64> = (0..row.n).map(|i| 1.5 + 0.1 * i as f64).collect();
    let start = row.state(q, vec![0.0; row.n]);
    let fine = Simulation::new(&row).element(Mixed::<8>).step(0.001);
    let fine = fine
        .record_every(100)
        .run(start.clone(), 0.0..40.0)
        .expect("short steps");
    let size = largest(fine.states().iter().flat_map(|node| node.q.iter().copied()));
    for accuracy in [1e-4, 1e-8] {
        let asked = Simulation::new(&row).accuracy(accuracy);
        let motion = asked.run(start.clone(), 0.0..40.0).expect("a row");
        let pairs = motion.last().q.iter().zip(&fine.last().q);
        let error = largest(pairs.map(|(a, b)| a - b)) / size;
        println!(
            "{accuracy:.0e}: {error:.1e}, {}",
            motion.picked().expect("picked")
        );
        assert!(
            error <= accuracy && motion.error_estimate() <= accuracy,
            "{error}"
        );
    }
    let nodes = Simulation::new(&row).nodes([0.0, 0.1, 0.15, 0.18]);
    let motion = nodes
        .clone()
        .run(start.clone(), 0.0..0.18)
        .expect("three steps");
    let times: Vec<f64> = motion.states().iter().map(|node| node.t).collect();
    assert_eq!(times, [0.0, 0.1, 0.15, 0.18]);
    let error = nodes.run(start, 0.0..1.0).expect_err("ends elsewhere");
    assert!(
        matches!(error.kind(), RunErrorKind::NodeEnds { .. }),
        "{error}"
    );
}
