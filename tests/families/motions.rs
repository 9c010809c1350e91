//! Motions of models of run-time length compared with models of fixed size and with their known properties.

use crate::common::{larger, list, number, reference};
use crate::lengths::{of_both_lengths, states_apart};
use nalgebra::DMatrix;
use tfe::Warning;
use tfe::family::FamilyState;
use tfe::prelude::*;

#[dynamics(
    coordinates(q[n]),
    lagrangian = sum(i in 0..n, m/2*dot(q[i])^2) - sum(i in 0..n-1, k/2*(q[i+1]-q[i])^2 + a/3*(q[i+1]-q[i])^3),
)]
struct Chain {
    n: usize,
    m: f64,
    k: f64,
    a: f64,
}

#[dynamics(
    coordinates(q[5]),
    lagrangian = sum(i in 0..5, m/2*dot(q[i])^2) - sum(i in 0..4, k/2*(q[i+1]-q[i])^2 + a/3*(q[i+1]-q[i])^3),
)]
struct FiveMasses {
    m: f64,
    k: f64,
    a: f64,
}

const START: [f64; 5] = [0.4, -0.1, 0.3, 0.0, -0.5];
const PUSH: [f64; 5] = [0.1, 0.2, -0.3, 0.4, 0.0];

/// Elements with one, two and four groups of points; forwards and backwards in time.
#[test]
fn a_chain_moves_as_the_same_model_of_fixed_size() {
    let (m, k, a) = (1.3, 0.9, 0.25);
    let (chain, five) = (Chain { n: 5, m, k, a }, FiveMasses { m, k, a });
    for element in [
        Element::mixed(3),
        Element::mixed(4),
        Element::mixed(7),
        Element::mixed(12),
    ] {
        for end in [20.0, -20.0] {
            let start = chain.state(START, PUSH);
            let simulation = Simulation::new(&chain).element(element).step(0.1);
            let family = simulation.run(start, 0.0..end).expect("a run");
            let simulation = Simulation::new(&five).element(element).step(0.1);
            let fixed = simulation
                .run(five.state(START, PUSH), 0.0..end)
                .expect("a run");
            assert_eq!(family.states().len(), fixed.states().len());
            for (one, other) in family.states().iter().zip(fixed.states()) {
                // About a hundred rounding errors of numbers of order one.
                let off = states_apart(&one.state(), &other.state());
                assert!(off < 1e-13, "{element} t = {}: {off:e}", one.t);
            }
            assert_eq!(family.states().len(), fixed.states().len());
            assert!((family.energy_error() - fixed.energy_error()).abs() < 1e-14);
            let time = 0.377 * end;
            let (one, other) = (
                family.at(time).expect("inside"),
                fixed.at(time).expect("inside"),
            );
            let off = states_apart(&one.state(), &other.state());
            assert!(off < 1e-12, "{element}: {off:e}");
        }
    }
}

/// Flaschka's variables a_i = ½ e^((q_i − q_{i+1})/2), b_i = −½ p_i: the eigenvalues of the tridiagonal matrix with the
/// diagonal b and the off-diagonal a are constant.
#[dynamics(
    coordinates(q[n]), momenta(p[n]),
    hamiltonian = sum(i in 0..n, p[i]^2/2) + sum(i in 0..n-1, exp(q[i]-q[i+1])),
)]
pub struct Toda {
    pub n: usize,
}

/// Steps of very different lengths: an iteration starts from the polynomial of the previous element, whose
/// extrapolation far beyond its end is useless.
#[test]
fn a_long_step_after_a_short_one_starts_as_that_of_fixed_size() {
    let (m, k, a) = (1.3, 0.9, 0.25);
    let (chain, five) = (Chain { n: 5, m, k, a }, FiveMasses { m, k, a });
    for shortest in [1e-2, 1e-4, 1e-7] {
        // Long, short, long, …
        let mut times = vec![0.0_f64];
        while times.len() < 60 {
            let last = times[times.len() - 1];
            times.push(last + 0.4);
            times.push(last + 0.4 + shortest);
        }
        let end = times[times.len() - 1];
        for element in [Element::mixed(4), Element::mixed(7), Element::radau(5)] {
            let start = chain.state(START, PUSH);
            let simulation = Simulation::new(&chain).element(element);
            let family = simulation.nodes(times.iter().copied()).run(start, 0.0..end);
            let family = family.expect("a run");
            let simulation = Simulation::new(&five).element(element);
            let fixed = simulation
                .nodes(times.iter().copied())
                .run(five.state(START, PUSH), 0.0..end);
            let fixed = fixed.expect("a run");
            assert_eq!(family.states().len(), fixed.states().len());
            for (one, other) in family.states().iter().zip(fixed.states()) {
                let off = (0..5).map(|j| (one.q[j] - other.q[j]).abs());
                let off = off.fold(0.0, larger);
                assert!(off < 1e-13, "{element} {shortest} t = {}: {off:e}", one.t);
            }
            let (one, other) = (family.statistics(), fixed.statistics());
            assert!(
                one.iterations <= other.iterations + 2 * other.steps,
                "{element} {shortest}: {} iterations, {}",
                one.iterations,
                other.iterations
            );
        }
    }
}

fn lax_eigenvalues(state: &FamilyState) -> Vec<f64> {
    let n = state.q.len();
    let mut lax = DMatrix::zeros(n, n);
    for i in 0..n {
        lax[(i, i)] = -0.5 * state.p[i];
        if i + 1 < n {
            let a = 0.5 * (0.5 * (state.q[i] - state.q[i + 1])).exp();
            (lax[(i, i + 1)], lax[(i + 1, i)]) = (a, a);
        }
    }
    let mut values: Vec<f64> = lax.symmetric_eigenvalues().iter().copied().collect();
    values.sort_by(f64::total_cmp);
    values
}

#[test]
fn the_invariants_of_a_toda_chain_stay() {
    let toda = Toda { n: 200 };
    let q: Vec<f64> = (0..200).map(|i| 0.3 * (0.2 * f64::from(i)).sin()).collect();
    let v: Vec<f64> = (0..200).map(|i| 0.5 * (0.7 * f64::from(i)).cos()).collect();
    let start = toda.state(q, v);
    let before = lax_eigenvalues(&start);
    let simulation = Simulation::new(&toda)
        .element(Mixed::<8>)
        .step(0.25)
        .record_every(100);
    let motion = simulation.run(start, 0.0..250.0).expect("a run");
    let after = lax_eigenvalues(&motion.last().state());
    let change = before.iter().zip(&after).map(|(a, b)| (a - b).abs());
    let change = change.fold(0.0, larger);
    // After a thousand steps. By then sites have flown apart: a hundredth of the energy is left between them.
    assert!(change < 2.5e-11, "{change:e}");
    assert!(
        motion.energy_error() < 2.5e-13,
        "{:e}",
        motion.energy_error()
    );
}

/// Six bodies in space with x, y and z of each, masses as a list, and all pairs.
#[dynamics(
    coordinates(x[n], y[n], z[n]),
    lagrangian = sum(i in 0..n, m[i]/2*(dot(x[i])^2 + dot(y[i])^2 + dot(z[i])^2))
        + sum(i in 0..n, sum(j in 0..i, g*m[i]*m[j]/sqrt((x[i]-x[j])^2 + (y[i]-y[j])^2 + (z[i]-z[j])^2))),
    output(middle) = sum(i in 0..n, m[i]*x[i]),
)]
struct Bodies {
    n: usize,
    m: Vec<f64>,
    g: f64,
}

#[dynamics(
    coordinates(x[6], y[6], z[6]),
    lagrangian = sum(i in 0..6, m[i]/2*(dot(x[i])^2 + dot(y[i])^2 + dot(z[i])^2))
        + sum(i in 0..6, sum(j in 0..i, g*m[i]*m[j]/sqrt((x[i]-x[j])^2 + (y[i]-y[j])^2 + (z[i]-z[j])^2))),
)]
struct SixBodies {
    m: [f64; 6],
    g: f64,
}

/// Bodies on circles about the first one, which has nearly all of the mass.
fn planets(n: usize) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
    let (mut m, mut q, mut v) = (vec![1.0], vec![0.0; 3 * n], vec![0.0; 3 * n]);
    for i in 1..n {
        m.push(1e-4 / i as f64);
        let (radius, angle) = (1.0 + 0.7 * i as f64, 2.1 * i as f64);
        let speed = radius.sqrt().recip();
        (q[i], q[n + i], q[2 * n + i]) = (
            radius * angle.cos(),
            radius * angle.sin(),
            0.02 * angle.sin(),
        );
        (v[i], v[n + i]) = (-speed * angle.sin(), speed * angle.cos());
    }
    (m, q, v)
}

/// The outer solar system: masses, coordinates and velocities, all x first.
fn solar_system(table: &serde_json::Value) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
    let bodies = list(&table["bodies"]);
    let masses = bodies.iter().map(|body| number(&body["m"])).collect();
    let by_axis = |key: &str| -> Vec<f64> {
        (0..3)
            .flat_map(|k| bodies.iter().map(move |body| number(&body[key][k])))
            .collect()
    };
    (masses, by_axis("x"), by_axis("v"))
}

/// 27 years of the outer solar system.
#[test]
fn pairs_of_bodies_move_as_those_of_fixed_size() {
    let table = reference("solar_system");
    let (m, q, v) = solar_system(&table);
    let (g, n) = (number(&table["g"]), m.len());
    let masses: [f64; 6] = m.clone().try_into().expect("six");
    let (bodies, six) = (Bodies { n, m, g }, SixBodies { m: masses, g });
    let fixed_start = six.state(
        q.clone().try_into().expect("18"),
        v.clone().try_into().expect("18"),
    );
    let start = bodies.state(q, v);
    assert_eq!(start.p, fixed_start.p);
    let simulation = Simulation::new(&bodies).element(Mixed::<6>).step(50.0);
    let family = simulation.run(start, 0.0..10_000.0).expect("a run");
    let fixed = Simulation::new(&six).element(Mixed::<6>).step(50.0);
    let fixed = fixed.run(fixed_start, 0.0..10_000.0).expect("a run");
    for a in 0..18 {
        // Coordinates up to 30 and 200 steps of one rounding error each; errors along the orbits grow with time.
        let off = family.last().q[a] - fixed.last().q[a];
        assert!(off.abs() < 2e-12, "{a}: {off:e}");
    }
    let middle = family.outputs().column("middle").expect("declared");
    let last = bodies.middle(10_000.0, &family.last().q, &family.velocities()[200]);
    assert_eq!(last, Ok(middle[200]));
}

#[test]
fn two_hundred_bodies_run() {
    let (m, q, v) = planets(200);
    let bodies = Bodies { n: 200, m, g: 1.0 };
    let start = bodies.state(q, v);
    let simulation = Simulation::new(&bodies).element(Mixed::<4>).step(0.02);
    let motion = simulation.run(start, 0.0..0.2).expect("a run");
    assert!(motion.energy_error() < 1e-12, "{:e}", motion.energy_error());
    assert_eq!(motion.last().q.len(), 600);
}

/// Forces at each site and at one site, depending on time and velocities, next to a coordinate of its own; as
/// Lagrangian and Hamiltonian.
#[dynamics(
    coordinates(s, q[n]),
    lagrangian = dot(s)^2/2 - s^4/4 + sum(i in 0..n, m[i]/2*dot(q[i])^2 - k/2*(q[i]-s)^2),
    force(q[i]) = -c[i]*dot(q[i]),
    force(q[n-1]) = f*cos(t),
    force(s) = -dot(q[0]),
)]
struct Driven {
    n: usize,
    m: Vec<f64>,
    c: Vec<f64>,
    k: f64,
    f: f64,
}

#[dynamics(
    coordinates(s, q[3]), momenta(ps, p[3]),
    hamiltonian = ps^2/2 + s^4/4 + sum(i in 0..3, p[i]^2/2/m[i] + k/2*(q[i]-s)^2),
    force(q[i]) = -c[i]*p[i]/m[i],
    force(q[2]) = f*cos(t),
    force(s) = -p[0]/m[0],
)]
struct DrivenOfFixedSize {
    m: [f64; 3],
    c: [f64; 3],
    k: f64,
    f: f64,
}

#[test]
fn forces_by_site_and_a_coordinate_of_its_own() {
    let (m, c, k, f) = ([1.0, 2.0, 0.5], [0.1, 0.2, 0.05], 0.7, 0.4);
    let (family, fixed) = of_both_lengths!(Driven(3), DrivenOfFixedSize: m, c, k, f);
    let (q, v) = ([0.3, 0.1, -0.4, 0.2], [0.0, 0.5, -0.1, 0.3]);
    for element in [Element::mixed(4), Element::mixed(9), Element::radau(3)] {
        let start = family.state(q, v);
        let run = Simulation::new(&family).element(element).step(0.05);
        let one = run.run(start, 0.0..5.0).expect("a run");
        let run = Simulation::new(&fixed).element(element).step(0.05);
        let other = run.run(fixed.state(q, v), 0.0..5.0).expect("a run");
        let off = states_apart(&one.last().state(), &other.last().state());
        assert!(off < 1e-13, "{element}: {off:e}");
    }
}

#[test]
fn states_are_made_of_arrays_slices_and_vectors() {
    let chain = Chain {
        n: 5,
        m: 2.0,
        k: 1.0,
        a: 0.2,
    };
    let (q, v) = (START.to_vec(), PUSH.to_vec());
    let expected = FamilyState {
        q: q.clone(),
        p: v.iter().map(|v| 2.0 * v).collect(),
    };
    assert_eq!(chain.state(START, PUSH), expected);
    assert_eq!(chain.state(&q, &v), expected);
    assert_eq!(chain.state(&q[..], &v[..]), expected);
    assert_eq!(chain.state(q, v), expected);
}

/// A negative mass, next to one that is much larger.
#[test]
fn masses_of_both_signs_are_told() {
    for (mass, is_told) in [(-2.0, true), (2.0, false)] {
        let model = Driven {
            n: 3,
            m: vec![1e9, mass, 0.5],
            c: vec![0.0; 3],
            k: 0.7,
            f: 0.4,
        };
        let start = model.state([0.3, 0.1, -0.4, 0.2], [0.0, 0.5, -0.1, 0.3]);
        let simulation = Simulation::new(&model).step(0.01);
        let warning = Warning::MassIndefinite {
            time: 0.0,
            least: -2.0,
            largest: 1e9,
        };
        let expected: Vec<Warning> = is_told.then_some(warning).into_iter().collect();
        let motion = simulation.run(start.clone(), 0.0..0.1).expect("a run");
        assert_eq!(motion.warnings(), expected);
        assert_eq!(simulation.steps(start, 0.0).warnings(), expected);
    }
}

/// The endless sequence of steps is the same motion, and so is a run across a break.
#[test]
fn steps_are_those_of_a_run() {
    let chain = Chain {
        n: 5,
        m: 1.0,
        k: 1.0,
        a: 0.2,
    };
    let start = chain.state(START, PUSH);
    let simulation = Simulation::new(&chain).step(0.1);
    let motion = simulation
        .clone()
        .run(start.clone(), 0.0..1.0)
        .expect("a run");
    for (node, other) in simulation
        .steps(start.clone(), 0.0)
        .zip(&motion.states()[1..])
    {
        let node = node.expect("a step");
        assert_eq!((node.q, node.p), (other.q.clone(), other.p.clone()));
    }
    let broken = simulation
        .break_at(0.55)
        .run(start, 0.0..1.0)
        .expect("a run");
    assert_eq!(broken.states().len(), 12);
    let off = broken.last().q[0] - motion.last().q[0];
    assert!(off.abs() < 1e-9, "{off:e}");
}

/// Velocities at nodes, between nodes and of states; steps that end at breaks.
#[test]
fn nodes_have_velocities() {
    let chain = Chain {
        n: 5,
        m: 1.0,
        k: 1.0,
        a: 0.2,
    };
    let simulation = Simulation::new(&chain).step(0.1).break_at(0.55);
    let start = chain.state(START, PUSH);
    let motion = simulation.run(start.clone(), 0.0..1.0).expect("a run");
    for (node, v) in motion.states().iter().zip(motion.velocities()) {
        assert_eq!(&node.v, v);
        assert_eq!(&chain.velocity(node.t, &node.state()), v);
    }
    for (node, other) in simulation.steps(start, 0.0).zip(&motion.states()[1..9]) {
        assert_eq!(node.expect("a step"), *other);
    }
    // Between nodes, the derivative of the polynomial has an error of h³.
    let between = motion.at(0.34).expect("inside");
    let exact = chain.velocity(0.34, &between.state());
    let apart = exact.iter().zip(&between.v).map(|(a, b)| (a - b).abs());
    assert!(apart.sum::<f64>() < 1e-3);
}

#[test]
fn a_motion_is_written_with_the_names_of_its_coordinates() {
    let (m, q, v) = planets(2);
    let bodies = Bodies { n: 2, m, g: 1.0 };
    let start = bodies.state(q, v);
    let motion = Simulation::new(&bodies)
        .step(0.1)
        .run(start, 0.0..0.2)
        .expect("a run");
    let path = std::env::temp_dir().join(format!("tfe-families-{}.csv", std::process::id()));
    motion.write_csv(&path).expect("a file");
    let text = std::fs::read_to_string(&path).expect("what was written");
    std::fs::remove_file(&path).expect("a file");
    let header = text.lines().next().expect("a header");
    assert!(
        header.starts_with("t,x[0],x[1],y[0],y[1],z[0],z[1],x[0]_dot,"),
        "{header}"
    );
    assert!(header.ends_with("p_z[1],energy,middle"), "{header}");
    let columns = |line: &str| line.split(',').count();
    assert_eq!(text.lines().map(columns).collect::<Vec<_>>(), [21; 4]);
}

#[dynamics(
    coordinates(x[n]),
    lagrangian = sum(i in 0..n, dot(x[i])^2/2 - x[i]^4/4 - select(x[i] < 0, step, 0)),
)]
struct Stairs {
    n: usize,
    step: f64,
}

/// A step of the potential, without its force.
#[test]
fn energies_that_jump_are_told() {
    for (step, told) in [(10.0, true), (0.0, false)] {
        let model = Stairs { n: 2, step };
        let start = model.state(vec![0.5, 0.7], vec![-1.0, 0.2]);
        let motion = Simulation::new(&model).step(0.02).run(start, 0.0..1.0);
        let motion = motion.expect("a run");
        let is_jump = |one: &Warning| matches!(one, Warning::EnergyJump { count: 1, .. });
        assert_eq!(motion.warnings().len(), usize::from(told));
        assert!(motion.warnings().iter().all(is_jump));
    }
}
