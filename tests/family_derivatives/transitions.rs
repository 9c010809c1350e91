//! The transition operator of a model of run-time length: the derivative of a step.

use crate::common::larger;
use crate::differences::{difference, difference_over};
use crate::hybrid::OnCircles;
use crate::lengths::of_both_lengths;
use tfe::family::{self, FamilyState};
use tfe::length::RunTimeLength;
use tfe::prelude::*;
use tfe::runtime::step::Control;
use tfe::stability::{
    DominantError, Iteration, OperatorError, dominant, spectral_radius, symplecticity_defect,
    transition, transition_matrix,
};

/// Springs with a cubic part, velocity-dependent forces, a potential that mixes velocities and coordinates, and
/// different masses.
#[dynamics(
    coordinates(q[n]),
    lagrangian = sum(i in 0..n, m[i]/2*dot(q[i])^2 + g*q[i]^2*dot(q[i])^2) + sum(i in 0..n-1, b*dot(q[i])*dot(q[i+1]) + b*dot(q[i])*q[i+1])
        - sum(i in 0..n-1, (q[i+1]-q[i])^2/2 + a/3*(q[i+1]-q[i])^3),
    force(q[i]) = -c*dot(q[i]) + c*q[i]*sin(t),
    force(q[0]) = -c*dot(q[0])*q[1]^2,
)]
struct Web {
    n: usize,
    m: Vec<f64>,
    a: f64,
    b: f64,
    c: f64,
    g: f64,
}

#[dynamics(
    coordinates(q[5]),
    lagrangian = sum(i in 0..5, m[i]/2*dot(q[i])^2 + g*q[i]^2*dot(q[i])^2) + sum(i in 0..4, b*dot(q[i])*dot(q[i+1]) + b*dot(q[i])*q[i+1])
        - sum(i in 0..4, (q[i+1]-q[i])^2/2 + a/3*(q[i+1]-q[i])^3),
    force(q[i]) = -c*dot(q[i]) + c*q[i]*sin(t),
    force(q[0]) = -c*dot(q[0])*q[1]^2,
)]
struct WebOfFive {
    m: [f64; 5],
    a: f64,
    b: f64,
    c: f64,
    g: f64,
}

/// Masses on springs as a Hamiltonian, damped.
#[dynamics(
    coordinates(q[n]), momenta(p[n]),
    hamiltonian = sum(i in 0..n, p[i]^2/2/m[i] + q[i]^4/4) + sum(i in 0..n-1, (q[i+1]-q[i])^2/2),
    force(q[i]) = -c*p[i]*q[i]^2,
)]
struct ByMomenta {
    n: usize,
    m: Vec<f64>,
    c: f64,
}

#[dynamics(
    coordinates(q[5]), momenta(p[5]),
    hamiltonian = sum(i in 0..5, p[i]^2/2/m[i] + q[i]^4/4) + sum(i in 0..4, (q[i+1]-q[i])^2/2),
    force(q[i]) = -c*p[i]*q[i]^2,
)]
struct FiveByMomenta {
    m: [f64; 5],
    c: f64,
}

const MASSES: [f64; 5] = [1.0, 0.5, 2.0, 1.5, 0.7];
const Q: [f64; 5] = [0.3, -0.2, 0.4, 0.1, -0.5];
const V: [f64; 5] = [0.1, 0.5, -0.3, 0.2, 0.4];

fn webs() -> (Web, WebOfFive) {
    let (m, a, b, c, g) = (MASSES, 0.3, 0.2, 0.15, 0.1);
    of_both_lengths!(Web(5), WebOfFive: m, a, b, c, g)
}

#[test]
fn matrices_are_those_of_fixed_size() {
    let (web, five) = webs();
    let (start, fixed) = (web.state(Q, V), five.state(Q, V));
    for element in [
        Element::mixed(3),
        Element::mixed(6),
        Element::primal(4),
        Element::primal(3).reduced(),
        Element::mixed(3).quadrature(4),
        Element::radau(3),
        Element::energy_conserving(3),
    ] {
        let one = transition_matrix(&web, element, &start, 0.7, 0.2).expect("from the family");
        let other = transition_matrix(&five, element, &fixed, 0.7, 0.2).expect("of fixed size");
        let off = (&one - &other).amax();
        // Entries between one and three, some hundred operations.
        assert!(off < 1e-12, "{element}: {off:e}");
        let operator = transition(&web, element, &start, 0.7, 0.2).expect("an operator");
        let (x, mut y): (Vec<f64>, _) = ((0..10).map(|k| f64::from(k).cos()).collect(), [0.0; 10]);
        operator.apply(&x, &mut y).expect("ten numbers");
        for (row, y) in y.iter().enumerate() {
            let product: f64 = (0..10).map(|k| one[(row, k)] * x[k]).sum();
            assert!((product - y).abs() < 1e-13);
        }
    }
    let (m, c) = (MASSES, 0.3);
    let (chain, five) = of_both_lengths!(ByMomenta(5), FiveByMomenta: m, c);
    let (start, fixed) = (chain.state(Q, V), five.state(Q, V));
    for element in [Element::mixed(3), Element::mixed(5), Element::radau(3)] {
        let one = transition_matrix(&chain, element, &start, 0.0, 0.2).expect("from the family");
        let other = transition_matrix(&five, element, &fixed, 0.0, 0.2).expect("of fixed size");
        let off = (&one - &other).amax();
        assert!(off < 1e-12, "{element}: {off:e}");
    }
}

/// The end of one step from a state shifted by `shift` in the direction `k`.
fn end<M: family::Model>(
    model: &M,
    element: Element,
    state: &FamilyState,
    (t, h): (f64, f64),
    (k, shift): (usize, f64),
) -> Vec<f64> {
    let n = state.q.len();
    let mut state = state.clone();
    match k {
        _ if k < n => state.p[k] += shift,
        _ if k < 2 * n => state.q[k - n] += shift,
        _ => {}
    }
    let h = if k < 2 * n { h } else { h + shift };
    let mut stepper = family::Stepper::new(model, element, Control::default()).expect("a stepper");
    stepper.advance(t, h, &mut state).expect("a step");
    [state.p, state.q].concat()
}

#[test]
fn operators_are_derivatives_of_the_step() {
    let (web, _) = webs();
    let chain = ByMomenta {
        n: 5,
        m: MASSES.to_vec(),
        c: 0.3,
    };
    check_derivatives(&web, &web.state(Q, V), Element::primal(4));
    check_derivatives(&web, &web.state(Q, V), Element::mixed(4));
    check_derivatives(&chain, &chain.state(Q, V), Element::mixed(4));
}

#[track_caller]
fn check_derivatives<M: family::Model>(model: &M, start: &FamilyState, element: Element) {
    let by_shift = |end: &dyn Fn(f64) -> Vec<f64>| difference_over(1e-3, end, 0.0);
    let leg = (0.4, 0.2);
    let operator = transition(model, element, start, leg.0, leg.1).expect("an operator");
    let matrix = operator.matrix();
    for k in 0..10 {
        let by_steps = by_shift(&|d| end(model, element, start, leg, (k, d)));
        for (row, by_steps) in by_steps.iter().enumerate() {
            let off = (matrix[(row, k)] - by_steps).abs();
            assert!(off < 1e-9, "{element} ({row}, {k}): {off:e}");
        }
    }
    if !M::FACTS.time_dependent {
        let by_steps = by_shift(&|d| end(model, element, start, leg, (10, d)));
        for (by_length, by_steps) in operator.by_length().iter().zip(&by_steps) {
            assert!((by_length - by_steps).abs() < 1e-9);
        }
    }
    let ends = end(model, element, start, leg, (10, 0.0));
    for (one, other) in [&operator.end().p[..], &operator.end().q]
        .concat()
        .iter()
        .zip(&ends)
    {
        // Two iterations, and the same solution.
        assert!((one - other).abs() < 1e-13);
    }
}

/// Masses on springs, fixed at both ends: ω_k = 2 √(k/m) sin(kπ/(2(n + 1))).
#[dynamics(
    coordinates(q[n]),
    lagrangian = sum(i in 0..n, m/2*dot(q[i])^2) - sum(i in 0..n-1, k/2*(q[i+1]-q[i])^2) - k/2*q[0]^2 - k/2*q[n-1]^2,
    dissipation = sum(i in 0..n, c/2*dot(q[i])^2),
)]
struct Harmonic {
    n: usize,
    m: f64,
    k: f64,
    c: f64,
}

#[dynamics(coordinates(x), lagrangian = m/2*dot(x)^2 - k/2*x^2, dissipation = c/2*dot(x)^2)]
struct Oscillator {
    m: f64,
    k: f64,
    c: f64,
}

/// The largest spectral radius of all modes.
fn largest_of_modes(chain: &Harmonic, element: Element, h: f64) -> f64 {
    let radius = |mode: usize| {
        let angle = mode as f64 * std::f64::consts::PI / (2.0 * (chain.n + 1) as f64);
        let omega = 2.0 * (chain.k / chain.m).sqrt() * angle.sin();
        let one = Oscillator {
            m: chain.m,
            k: chain.m * omega * omega,
            c: chain.c,
        };
        let matrix = transition_matrix(&one, element, &one.state([0.0], [0.0]), 0.0, h);
        spectral_radius(&matrix.expect("a matrix"))
    };
    (1..=chain.n).map(radius).fold(0.0, larger)
}

/// The spectral radius of a step of `n` sites is the largest of those of their modes.
fn check_radius(n: usize, c: f64, element: Element, h: f64) {
    let chain = Harmonic {
        n,
        m: 2.0,
        k: 8.0,
        c,
    };
    let rest = chain.state(vec![0.0; n], vec![0.0; n]);
    let expected = largest_of_modes(&chain, element, h);
    let step = transition(&chain, element, &rest, 0.0, h).expect("an operator");
    let found = dominant(&step, Iteration::default())
        .unwrap_or_else(|error| panic!("{element} {h}: {error}, expected {expected}"));
    let off = found.radius() - expected;
    assert!(off.abs() < 1e-9, "{element} {h}: {off:e}, {found:?}");
    assert!((expected > 1.0) == (c == 0.0));
}

/// ω h up to 3.4, unstable from √10 to √12: the most unstable modes are close together at the end of the spectrum.
#[test]
fn the_radius_of_the_fastest_modes() {
    check_radius(400, 0.0, Element::primal(3), 0.85);
}

/// One site, which has both walls as neighbours, and two.
#[test]
fn the_radii_of_the_shortest_chains() {
    check_radius(1, 0.0, Element::primal(3), 1.15);
    check_radius(1, 0.3, Element::mixed(4), 0.3);
    check_radius(2, 0.0, Element::primal(3), 0.95);
    check_radius(2, 0.3, Element::mixed(4), 0.3);
}

/// About eighty modes around ω h = 3.3, with frequencies up to ω h = 4.8.
#[test]
fn the_radius_of_one_mode_among_eighty() {
    check_radius(1000, 0.0, Element::primal(3), 1.2);
}

#[test]
fn the_radii_of_damped_modes() {
    for h in [0.3, 2.0] {
        check_radius(1000, 0.3, Element::mixed(4), h);
    }
}

/// All eigenvalues of a stable symplectic step lie on the unit circle: the computed ones lie there up to their
/// residuals, or there is an error that none were found.
#[test]
fn stable_symplectic_steps_have_no_largest_eigenvalue() {
    let chain = Harmonic {
        n: 400,
        m: 1.0,
        k: 1.0,
        c: 0.0,
    };
    let rest = chain.state(vec![0.0; 400], vec![0.0; 400]);
    let step = transition(&chain, Mixed::<4>, &rest, 0.0, 0.5).expect("an operator");
    let control = Iteration {
        products: 2000,
        ..Iteration::default()
    };
    let (best, converged) = match dominant(&step, control) {
        Ok(found) => (found, true),
        Err(DominantError::NotConverged { best, .. }) => (best, false),
        Err(other) => panic!("{other}"),
    };
    if converged {
        assert!((best.radius() - 1.0).abs() < 1e-9);
    } else {
        assert!(best.residual > 1e-11);
    }
    let short = Harmonic { n: 20, ..chain };
    let rest = short.state(vec![0.0; 20], vec![0.0; 20]);
    let matrix = transition_matrix(&short, Mixed::<4>, &rest, 0.0, 0.5).expect("a matrix");
    assert!(symplecticity_defect(&matrix) < 1e-14);
    // For a short chain the Krylov space is exhausted.
    let step = transition(&short, Mixed::<4>, &rest, 0.0, 0.5).expect("an operator");
    let found = dominant(&step, Iteration::default()).expect("forty eigenvalues");
    assert!((found.radius() - 1.0).abs() < 1e-12, "{found:?}");
}

#[test]
fn what_is_impossible_is_told() {
    let (web, _) = webs();
    let start = web.state(Q, V);
    let short = FamilyState {
        q: vec![0.0; 3],
        p: vec![0.0; 5],
    };
    let error = transition(&web, Mixed::<4>, &short, 0.0, 0.1).expect_err("three of five");
    assert!(matches!(error, OperatorError::Family(_)), "{error}");
    for h in [0.0, f64::NAN] {
        let error = transition(&web, Mixed::<4>, &start, 0.0, h).expect_err("no step");
        assert!(matches!(error, OperatorError::Step(_)), "{error}");
    }
    let operator = transition(&web, Mixed::<4>, &start, 0.0, 0.1).expect("an operator");
    let error = operator.apply(&[0.0; 9], &mut [0.0; 10]).expect_err("nine");
    let (needed, given) = (10, 9);
    assert_eq!(error, OperatorError::Shape { needed, given });
    let chain = ByMomenta {
        n: 5,
        m: MASSES.to_vec(),
        c: 0.0,
    };
    let error = transition(&chain, Primal::<3>, &chain.state(Q, V), 0.0, 0.1).expect_err("phase");
    assert!(matches!(error, OperatorError::Family(_)), "{error}");
}

/// Backwards in time, an impulse is subtracted, and constraints react to the part of it that violates them.
#[test]
fn derivatives_go_back_across_impulses() {
    fn beads(k: f64) -> OnCircles {
        OnCircles {
            n: 2,
            m: 1.0,
            k,
            s: 0.5,
            c: 0.1,
            f: 0.3,
            w: 0.0,
            r: 1.0,
            omega: 2.6,
        }
    }
    fn run(beads: &OnCircles) -> Simulation<'_, OnCircles, 0, RunTimeLength> {
        let run = Simulation::new(beads).element(Mixed::<6>).step(0.05);
        run.impulse(-0.3, [0.7, 0.1, 0.5, 0.2])
    }
    // Along the circles.
    let start = FamilyState {
        q: vec![0.6, -0.6, -0.8, -0.8],
        p: vec![0.4, 0.4, 0.3, -0.3],
    };
    let span = 0.0..-0.6;
    let k = 9.81;
    let end = |k: f64| {
        let beads = beads(k);
        let motion = run(&beads).run(start.clone(), span.clone());
        let motion = motion.expect("a run");
        [&motion.last().q[..], &motion.last().p].concat()
    };
    let expected = difference(end, k);
    let beads = beads(k);
    let sensitive = run(&beads).run_sensitive(start.clone(), span.clone());
    let found = sensitive.expect("a run").by("k").last();
    let found = [found.q, found.p].concat();
    let apart = |(a, b): (&f64, &f64)| (a - b).abs();
    let off = found.iter().zip(&expected).map(apart).fold(0.0, larger);
    // Differences have errors of about 1e-13 of the largest derivative, which is about one.
    assert!(off < 1e-10, "{found:?} {expected:?}");
}

/// Where a motion comes to rest its momentum is a rounding error: this must not be taken for another root, in whatever
/// units.
#[test]
fn derivatives_end_where_a_motion_comes_to_rest() {
    use std::f64::consts::PI;

    #[dynamics(coordinates(q[n]), lagrangian = sum(i in 0..n, dot(q[i])^2/2 - k/2*q[i]^2))]
    struct Springs {
        n: usize,
        k: f64,
    }
    let springs = Springs { n: 1, k: 1.0 };
    let run = Simulation::new(&springs);
    let run = run.element(Mixed::<6>).step(PI / 50.0);
    for size in [1.0, 1e3, 1e6, 1e9] {
        let start = FamilyState {
            q: vec![size],
            p: vec![0.0],
        };
        // During half a period (p, q) becomes (−p, −q): the rounding errors of fifty steps remain.
        let linearised = run.run_linearised(start.clone(), 0.0..PI);
        let product = linearised.expect("a run").product();
        let off = [
            product[(0, 0)] + 1.0,
            product[(0, 1)],
            product[(1, 0)],
            product[(1, 1)] + 1.0,
        ];
        let off = off.iter().map(|entry| entry.abs()).fold(0.0, larger);
        assert!(off < 1e-12, "{size:e}: {off:e}");
        // p = −a √k sin √k t, whose derivative ∂p/∂k is a π/2 there.
        let sensitive = run.run_sensitive(start, 0.0..PI).expect("a run");
        let by = sensitive.by("k").last();
        let off = by.p[0] / size - PI / 2.0;
        assert!(off.abs() < 1e-12, "{size:e}: {off:e}");
    }
}
