//! Models derived from models (linearised, truncated, reduced): motions compared with closed forms, with models
//! declared by hand, and with the original.

mod common;

use common::{distance, larger, observed_order};
use tfe::prelude::*;

/// A mathematical pendulum.
#[dynamics(
    coordinates(theta),
    lagrangian = m/2*l^2*dot(theta)^2 + m*g*l*cos(theta),
    output(height) = -l*cos(theta),
    model(Linear, truncated(2)),
    model(Cubic, truncated(4)),
)]
#[derive(Clone, Debug, PartialEq)]
struct Pendulum {
    /// Mass.
    m: f64,
    l: f64,
    g: f64,
}

/// A mass on a spring.
#[dynamics(
    coordinates(r, theta),
    lagrangian = m/2*(dot(r)^2 + r^2*dot(theta)^2) + m*g*r*cos(theta) - k/2*(r - l)^2,
    output(height) = -r*cos(theta),
    model(Rod, frozen(r = l)),
)]
struct SpringPendulum {
    m: f64,
    l: f64,
    g: f64,
    k: f64,
}

const PENDULUM: Pendulum = Pendulum {
    m: 1.3,
    l: 0.8,
    g: 9.81,
};

/// The state at the end of a run with nine nodes, whose error is rounding only.
fn end<M: Model<N>, const N: usize>(model: &M, start: State<N>, span: f64, steps: u32) -> State<N> {
    let step = span / f64::from(steps);
    let simulation = Simulation::new(model).element(Mixed::<9>).step(step);
    let motion = simulation.run(start, 0.0..span).expect("a smooth motion");
    let last = motion.last();
    State {
        q: last.q,
        p: last.p,
    }
}

#[test]
fn fields_and_derives_are_those_of_the_original() {
    let linear = Linear::of(&PENDULUM);
    assert_eq!(
        linear.clone(),
        Linear {
            m: 1.3,
            l: 0.8,
            g: 9.81
        }
    );
    assert!(format!("{linear:?}").starts_with("Linear { m"));
    // Outputs are not truncated.
    assert_eq!(
        linear.height(0.0, [1.0], [0.0]),
        PENDULUM.height(0.0, [1.0], [0.0])
    );
    let spring = SpringPendulum {
        m: 1.3,
        l: 0.8,
        g: 9.81,
        k: 1e4,
    };
    let Rod { m, l, g } = Rod::of(&spring);
    assert_eq!([m, l, g], [1.3, 0.8, 9.81]);
}

#[test]
fn the_linear_pendulum_is_harmonic() {
    let linear = Linear::of(&PENDULUM);
    let omega = (PENDULUM.g / PENDULUM.l).sqrt();
    let start = linear.state([0.9], [0.4]);
    let period = 2.0 * std::f64::consts::PI / omega;
    // The error is rounding: a hundred operations in each of 16 steps per period, on numbers of order one.
    let whole = end(&linear, start, period, 16);
    assert!(distance(&whole.q, &[0.9]) < 1e-13, "{:?}", whole.q);
    let third = end(&linear, start, period / 3.0, 8);
    let phase = 2.0 * std::f64::consts::PI / 3.0;
    let expected = 0.9 * phase.cos() + 0.4 / omega * phase.sin();
    assert!((third.q[0] - expected).abs() < 1e-14, "{:?}", third.q);
}

fn total(o: tfe::runtime::structure::Operations) -> u32 {
    o.additions + o.multiplications + o.divisions + o.sines + o.functions
}

#[test]
fn structure_tells_what_became_simpler() {
    let (linear, full) = (Linear::structure(), Pendulum::structure());
    assert!(linear.facts.linear && !full.facts.linear);
    assert_eq!((linear.first.sines, full.first.sines), (0, 1));
    assert!(total(linear.second) < total(full.second));
    assert!(linear.page.contains("Pendulum: truncated to degree 2"));
    assert_eq!(linear.name, "Linear");
}

#[test]
fn the_cubic_pendulum_errs_by_the_fourth_power_of_the_amplitude() {
    let cubic = Cubic::of(&PENDULUM);
    let relative = |amplitude: f64| {
        let ends = (
            end(&cubic, cubic.state([amplitude], [0.0]), 3.0, 60),
            end(&PENDULUM, PENDULUM.state([amplitude], [0.0]), 3.0, 60),
        );
        (amplitude, distance(&ends.0.q, &ends.1.q) / amplitude)
    };
    let points = [0.4, 0.2, 0.1, 0.05].map(relative);
    let order = observed_order(&points, 1e-11, "cubic against full");
    assert!((order - 4.0).abs() < 0.1, "{order} {points:?}");
}

#[test]
fn a_frozen_spring_is_a_rod() {
    let spring = SpringPendulum {
        m: 1.3,
        l: 0.8,
        g: 9.81,
        k: 1e4,
    };
    let rod = Rod::of(&spring);
    let one = end(&rod, rod.state([1.1], [0.3]), 5.0, 50);
    let other = end(&PENDULUM, PENDULUM.state([1.1], [0.3]), 5.0, 50);
    assert!(distance(&one.q, &other.q) < 1e-14, "{one:?} {other:?}");
    assert!(distance(&one.p, &other.p) < 1e-14, "{one:?} {other:?}");
    assert_eq!(
        rod.height(0.0, [0.5], [0.0]),
        PENDULUM.height(0.0, [0.5], [0.0])
    );
}

/// A heavy symmetric top in Euler angles; precession φ and spin ψ are cyclic.
#[dynamics(
    coordinates(phi, theta, psi),
    lagrangian = a/2*(dot(theta)^2 + dot(phi)^2*sin(theta)^2) + c/2*(dot(psi) + dot(phi)*cos(theta))^2 - mgl*cos(theta),
    output(height) = cos(theta),
    output(east) = sin(theta)*sin(phi),
    output(spin) = dot(psi) + dot(phi)*cos(theta),
    model(Nutation, routh(psi, phi)),
)]
#[derive(Clone, Debug)]
struct Top {
    a: f64,
    c: f64,
    mgl: f64,
}

/// The same as a Hamiltonian.
#[dynamics(
    coordinates(phi, theta, psi),
    momenta(p_phi, p_theta, p_psi),
    hamiltonian = p_theta^2/(2*a) + (p_phi - p_psi*cos(theta))^2/(2*a*sin(theta)^2) + p_psi^2/(2*c) + mgl*cos(theta),
    model(Nodding, routh(phi, psi)),
)]
struct CanonicalTop {
    a: f64,
    c: f64,
    mgl: f64,
}

const TOP: Top = Top {
    a: 1.2,
    c: 0.7,
    mgl: 2.0,
};

#[test]
fn a_top_without_its_cyclic_angles_nods_as_the_whole() {
    let start = TOP.state([0.3, 0.9, -0.2], [0.4, 0.1, 6.0]);
    let (nutation, left) = Nutation::of_state(&TOP, &start);
    assert_eq!((nutation.p_psi, nutation.p_phi), (start.p[2], start.p[0]));
    let span = 0.0..10.0;
    let whole = Simulation::new(&TOP).element(Mixed::<6>).step(0.1);
    let whole = whole.run(start, span.clone()).expect("a motion");
    let reduced = Simulation::new(&nutation).element(Mixed::<6>).step(0.1);
    let reduced = reduced.run(left, span).expect("a motion");
    let [phi, psi] =
        ["phi_rate", "psi_rate"].map(|rate| reduced.integral(&nutation, rate).expect("recorded"));
    assert_eq!(whole.states().len(), reduced.states().len());
    let energies = whole.energies().iter().zip(reduced.energies());
    for (whole, reduced) in energies {
        // The Routhian contains the whole energy.
        assert!((whole - reduced).abs() < 1e-12 * whole.abs());
    }
    for (at, (whole, reduced)) in whole.states().iter().zip(reduced.states()).enumerate() {
        // Momenta of cyclic coordinates are constant in all stages, so that both models give the same method. The
        // tolerance allows for a hundred steps of a hundred rounding errors each, and angles up to sixty.
        assert!((whole.q[1] - reduced.q[0]).abs() < 1e-12);
        assert!((whole.p[1] - reduced.p[0]).abs() < 1e-12);
        assert!((whole.q[0] - 0.3 - phi[at]).abs() < 1e-11);
        assert!((whole.q[2] + 0.2 - psi[at]).abs() < 1e-11);
    }
    let spin = |motion: &[f64]| motion.iter().copied().fold(0.0, larger);
    let spin = spin(&reduced.outputs().column("spin").expect("declared"));
    assert!((spin - (6.0 + 0.4 * 0.9_f64.cos())).abs() < 1e-13);
    // Outputs that contain an eliminated angle are gone, and the velocities of eliminated angles are outputs now.
    assert_eq!(
        Nutation::OBSERVABLES,
        ["height", "spin", "psi_rate", "phi_rate"]
    );
    let (whole, reduced) = (Top::structure(), Nutation::structure());
    assert_eq!(whole.conserved, ["phi", "psi"]);
    assert!(total(reduced.first) < total(whole.first));
    assert!(total(reduced.second) < total(whole.second));
}

#[test]
fn a_hamiltonian_loses_its_cyclic_coordinates_as_well() {
    let CanonicalTop { a, c, mgl } = CanonicalTop {
        a: TOP.a,
        c: TOP.c,
        mgl: TOP.mgl,
    };
    let canonical = CanonicalTop { a, c, mgl };
    let start = TOP.state([0.3, 0.9, -0.2], [0.4, 0.1, 6.0]);
    let (nodding, left) = Nodding::of_state(&canonical, &start);
    let (nutation, _) = Nutation::of_state(&TOP, &start);
    assert_eq!(left.q, [0.9]);
    let by_hamiltonian = end(&nodding, left, 2.0, 200);
    let by_lagrangian = end(&nutation, left, 2.0, 200);
    assert!(distance(&by_hamiltonian.q, &by_lagrangian.q) < 1e-12);
    assert!(distance(&by_hamiltonian.p, &by_lagrangian.p) < 1e-12);
    let rates = [
        nodding.phi_rate(0.0, [0.9], left.p),
        nodding.psi_rate(0.0, [0.9], left.p),
    ];
    assert!(distance(&rates, &[0.4, 6.0]) < 1e-14);
}

#[test]
fn an_integral_says_what_is_missing() {
    let (nutation, left) = Nutation::of_state(&TOP, &TOP.state([0.0, 0.9, 0.0], [0.4, 0.1, 6.0]));
    let simulation = Simulation::new(&nutation).step(0.1).record_every(2);
    let motion = simulation.run(left, 0.0..1.0).expect("a motion");
    let no_output = motion.integral(&nutation, "phi").expect_err("no output");
    assert!(
        no_output
            .to_string()
            .contains("`height`, `spin`, `psi_rate`")
    );
    assert!(matches!(
        motion.integral(&nutation, "spin"),
        Err(tfe::AtError::NotRecorded { .. })
    ));
}

/// A mass on a spring, x and y upwards from the pivot.
#[dynamics(
    coordinates(x, y),
    lagrangian = m/2*(dot(x)^2 + dot(y)^2) - m*g*y - k/2*(sqrt(x^2 + y^2) - l)^2,
    output(pull) = k*(sqrt(x^2 + y^2) - l),
    output(height) = y,
    model(Stiff, rigid(rod = k)),
)]
struct Elastic {
    m: f64,
    l: f64,
    g: f64,
    k: f64,
}

/// A mass on a rod.
#[dynamics(
    coordinates(x, y),
    lagrangian = m/2*(dot(x)^2 + dot(y)^2) - m*g*y,
    constraint(rod) = sqrt(x^2 + y^2) - l,
    output(height) = y,
    model(Soft, elastic(rod = k)),
)]
struct Rigid {
    m: f64,
    l: f64,
    g: f64,
}

const RIGID: Rigid = Rigid {
    m: 1.0,
    l: 1.0,
    g: 9.81,
};

/// The motion from the horizontal during one second.
fn fall<M: Model<2>>(model: &M, start: State<2>, steps: u32) -> Motion<2> {
    let step = 1.0 / f64::from(steps);
    let simulation = Simulation::new(model).element(Mixed::<5>).step(step);
    simulation.run(start, 0.0..1.0).expect("a smooth motion")
}

#[test]
fn a_rigid_spring_is_a_constraint() {
    let elastic = Elastic {
        m: 1.0,
        l: 1.0,
        g: 9.81,
        k: 300.0,
    };
    let stiff = Stiff::of(&elastic);
    assert_eq!([stiff.m, stiff.l, stiff.g], [1.0, 1.0, 9.81]);
    let one = fall(&stiff, stiff.state([1.0, 0.0], [0.0, 0.0]), 20);
    let other = fall(&RIGID, RIGID.state([1.0, 0.0], [0.0, 0.0]), 20);
    for (a, b) in one.states().iter().zip(other.states()) {
        assert!(distance(&a.q, &b.q) < 1e-13 && distance(&a.p, &b.p) < 1e-13);
    }
    assert!(one.constraint_residual().position < 1e-13);
    // The output `pull` depends on k, which the model no longer has.
    assert_eq!(one.outputs().names()[0].to_string(), "height");
    assert_eq!(one.outputs().names().len(), 1);
}

#[test]
fn an_elastic_rod_tends_to_the_rod() {
    let rod = fall(&RIGID, RIGID.state([1.0, 0.0], [0.0, 0.0]), 2000);
    let error = |k: f64| {
        let soft = Soft::of(&RIGID, k);
        let motion = fall(&soft, soft.state([1.0, 0.0], [0.0, 0.0]), 2000);
        let pairs = motion.states().iter().zip(rod.states());
        let errors = pairs.map(|(a, b)| distance(&a.q, &b.q));
        (1.0 / k, errors.fold(0.0, larger))
    };
    let points = [1e3, 4e3, 16e3, 64e3].map(error);
    let order = observed_order(&points, 1e-9, "elastic against rigid");
    assert!((order - 1.0).abs() < 0.05, "{order} {points:?}");
}

/// A chain of any length between walls, with hardening springs.
#[dynamics(
    coordinates(q[n]),
    lagrangian = sum(i in 0..n, m/2*dot(q[i])^2) - sum(i in 0..n-1, k/2*(q[i+1] - q[i])^2 + a/4*(q[i+1] - q[i])^4)
        - k/2*(q[0]^2 + q[n-1]^2),
    output(stretch) = q[n-1] - q[0],
    model(Harmonic, truncated(2)),
)]
struct Chain {
    n: usize,
    m: f64,
    k: f64,
    a: f64,
}

/// A chain of rods along a line, which may be springs as well.
#[dynamics(
    coordinates(q[n]),
    lagrangian = sum(i in 0..n, m/2*dot(q[i])^2) - k/2*q[0]^2,
    constraint(rod[i in 0..n-1]) = q[i+1] - q[i] - l,
    model(Springs, elastic(rod = stiffness)),
)]
struct Rods {
    n: usize,
    m: f64,
    k: f64,
    l: f64,
}

/// A lattice whose length is a const parameter.
#[dynamics(
    coordinates(q[N]),
    lagrangian = sum(i in 0..N, dot(q[i])^2/2 - w[i]*(1 - cos(q[i]))),
    sensitivity(w[0]),
    model(Small, truncated(2)),
)]
#[derive(Clone, Copy)]
struct Pendulums<const N: usize> {
    w: [f64; N],
}

#[test]
fn a_chain_of_any_length_becomes_harmonic() {
    let chain = Chain {
        n: 9,
        m: 1.3,
        k: 2.0,
        a: 5.0,
    };
    let harmonic = Harmonic::of(&chain);
    let Harmonic { n, m, k } = harmonic;
    assert!(Harmonic::structure().facts.linear);
    // Mode 2: q_i = sin(2π(i + 1)/(n + 1)) cos ωt, ω = 2 √(k/m) sin(π/(n + 1))
    let angle = 2.0 * std::f64::consts::PI / (n + 1) as f64;
    let omega = 2.0 * (k / m).sqrt() * (angle / 2.0).sin();
    let shape: Vec<f64> = (1..=n).map(|i| (angle * i as f64).sin()).collect();
    let start = harmonic.state(shape.clone(), vec![0.0; n]);
    let simulation = Simulation::new(&harmonic).element(Mixed::<9>).step(0.25);
    let motion = simulation.run(start, 0.0..10.0).expect("a linear motion");
    let last = motion.states().last().expect("the end");
    for (q, shape) in last.q.iter().zip(&shape) {
        assert!((q - shape * (omega * 10.0).cos()).abs() < 1e-13);
    }
}

#[test]
fn rods_of_any_length_become_springs() {
    let rods = Rods {
        n: 6,
        m: 1.0,
        k: 1.0,
        l: 0.5,
    };
    let springs = Springs::of(&rods, 7.0);
    assert_eq!((springs.n, springs.l, springs.stiffness), (6, 0.5, 7.0));
    let relaxed: Vec<f64> = (0..6).map(|i| 0.5 * f64::from(i)).collect();
    let start = springs.state(relaxed.clone(), vec![0.0; 6]);
    let simulation = Simulation::new(&springs).element(Mixed::<5>).step(0.1);
    let motion = simulation.run(start, 0.0..3.0).expect("springs");
    // In the relaxed state all forces vanish.
    let last = motion.states().last().expect("the end");
    assert!(distance(&last.q, &relaxed) < 1e-13, "{:?}", last.q);
}

#[test]
fn a_length_that_is_a_const_parameter() {
    let pendulums = Pendulums { w: [1.0, 4.0, 9.0] };
    let small = Small::of(&pendulums);
    let end = end(&small, small.state([0.5; 3], [0.0; 3]), 2.0, 20);
    let expected = [1.0, 2.0, 3.0].map(|omega: f64| 0.5 * (2.0 * omega).cos());
    assert!(distance(&end.q, &expected) < 1e-14, "{end:?}");
    assert_eq!(<Small<3> as Model<3>>::SENSITIVITIES, ["w[0]"]);
}

/// 1 − cos q with q = 1e-9 rounds to zero. Such rounding errors in an energy must not be taken for a jump of it,
/// neither for a run nor for an element solved by Newton's method.
#[test]
fn energies_that_are_roundings_do_not_jump() {
    let model = Pendulums { w: [1.0, 4.0] };
    let start = model.state([1e-9, 0.0], [0.0; 2]);
    let size = |solve| {
        let run = Simulation::new(&model).element(Mixed::<6>).step(0.3);
        let run = run.solver(solve);
        let ends = Ensemble::new(&model).element(Mixed::<6>).step(0.3);
        let ends = ends.solver(solve).run(&[start], 0.0..1.5).expect("runs");
        assert!(ends.warnings().is_empty(), "{}", ends.warnings());
        let motion = run.run(start, 0.0..6.0).expect("a run");
        assert_eq!(motion.warnings(), &[]);
        assert_eq!(motion.statistics().cuts, 0);
        motion.last().q[0]
    };
    for solve in [Solve::Auto, Solve::Newton] {
        let off = size(solve) - 1e-9 * 6.0_f64.cos();
        assert!(off.abs() < 1e-15, "{off:e}");
    }
}
