//! Derivatives of constrained models of run-time length: compared with models of fixed size, column by column.

use crate::common::larger;
use crate::differences::difference;
use crate::lengths::{Seen, of_both_lengths, of_heap};
use nalgebra::Complex;
use tfe::length::{Length, RunTimeLength};
use tfe::periodic_schur::Multiplier;
use tfe::prelude::*;
use tfe::sensitivity::Loss;
use tfe::{Model, family};

/// A chain of rods on a moving support, with masses that grow to the sides, damping, and springs between second
/// neighbours.
#[dynamics(
    coordinates(x[n], y[n]),
    lagrangian = sum(i in 0..n, m[i]/2*(1 + s*x[i]^2)*(dot(x[i])^2 + dot(y[i])^2) - m[i]*g*y[i])
        - sum(i in 0..n-2, k/2*((x[i+2] - x[i])^2 + (y[i+2] - y[i])^2)),
    constraint(first) = (x[0] - a*sin(w*t))^2 + y[0]^2 - 1,
    constraint(rod[i in 0..n-1]) = (x[i+1] - x[i])^2 + (y[i+1] - y[i])^2 - l[i]^2,
    force(x[i]) = -c*dot(x[i]),
    output(height) = y[n-1] + b*dot(x[0])^2,
)]
#[derive(Clone)]
pub(super) struct Rods {
    n: usize,
    m: Vec<f64>,
    l: Vec<f64>,
    g: f64,
    k: f64,
    c: f64,
    a: f64,
    w: f64,
    s: f64,
    b: f64,
}

#[dynamics(
    coordinates(x[3], y[3]),
    lagrangian = sum(i in 0..3, m[i]/2*(1 + s*x[i]^2)*(dot(x[i])^2 + dot(y[i])^2) - m[i]*g*y[i])
        - k/2*((x[2] - x[0])^2 + (y[2] - y[0])^2),
    constraint(first) = (x[0] - a*sin(w*t))^2 + y[0]^2 - 1,
    constraint(rod[i in 0..2]) = (x[i+1] - x[i])^2 + (y[i+1] - y[i])^2 - l[i]^2,
    force(x[0]) = -c*dot(x[0]),
    force(x[1]) = -c*dot(x[1]),
    force(x[2]) = -c*dot(x[2]),
    output(height) = y[2] + b*dot(x[0])^2,
)]
#[derive(Clone)]
pub(super) struct ThreeRods {
    m: [f64; 3],
    l: [f64; 2],
    g: f64,
    k: f64,
    c: f64,
    a: f64,
    w: f64,
    s: f64,
    b: f64,
}

pub(super) fn rods() -> (Rods, ThreeRods) {
    let (m, l) = ([1.0, 0.5, 2.0], [0.8, 0.6]);
    let (g, k, c, a, w, s, b) = (9.81, 0.7, 0.1, 0.2, 3.0, 0.3, 0.25);
    of_both_lengths!(Rods(3), ThreeRods: m, l, g, k, c, a, w, s, b)
}

/// An initial state on the constraints at time 0, where the support moves at a ω.
pub(super) fn start(fixed: &ThreeRods) -> State<6> {
    let angles = [0.4_f64, -0.3, 1.1];
    let lengths = [1.0, fixed.l[0], fixed.l[1]];
    let (mut x, mut y) = ([0.0; 3], [0.0; 3]);
    let (mut vx, mut vy) = ([0.0; 3], [0.0; 3]);
    let (mut at, mut moves) = ([0.0, 0.0], [fixed.a * fixed.w, 0.0]);
    for i in 0..3 {
        let (sin, cos) = angles[i].sin_cos();
        let (length, rate) = (lengths[i], 0.5 - 0.3 * i as f64);
        at = [at[0] + length * sin, at[1] - length * cos];
        moves = [
            moves[0] + length * cos * rate,
            moves[1] + length * sin * rate,
        ];
        (x[i], y[i]) = (at[0], at[1]);
        (vx[i], vy[i]) = (moves[0], moves[1]);
    }
    fixed.state(
        [x[0], x[1], x[2], y[0], y[1], y[2]],
        [vx[0], vx[1], vx[2], vy[0], vy[1], vy[2]],
    )
}

const ELEMENTS: [Element; 3] = [Element::mixed(2), Element::mixed(4), Element::mixed(6)];

#[test]
fn transition_matrices_are_those_of_fixed_size() {
    let (long, fixed) = rods();
    let state = start(&fixed);
    for element in ELEMENTS {
        for h in [0.05, -0.02, 1e-4] {
            let ours = stability::transition_matrix(&long, element, &of_heap(&state), 0.0, h);
            let theirs = stability::transition_matrix(&fixed, element, &state, 0.0, h);
            let (ours, theirs) = (ours.expect("a matrix"), theirs.expect("a matrix"));
            let off = (&ours - &theirs).amax() / theirs.amax();
            let ours = stability::on_constraints(&long, element, &of_heap(&state), 0.0, h);
            let theirs = stability::on_constraints(&fixed, element, &state, 0.0, h);
            let singular = [ours.expect("a matrix"), theirs.expect("a matrix")];
            let [ours, theirs] = singular.map(|matrix| matrix.singular_values());
            // The bases of the tangent space may differ: compare singular values.
            let apart = (ours - theirs).amax();
            assert!(apart < 1e-13 / h.abs(), "{element}, {h}: {apart:e}");
            // Rounding errors divided by h: constraints are satisfied by h times their multipliers.
            assert!(off < 1e-14 / h.abs(), "{element}, {h}: {off:e}");
        }
    }
}

/// A loss with momenta, velocities and an output at the end, and an integral.
fn loss<'l, const N: usize, L: Length<N>>(integral: f64) -> Loss<'l, N, L> {
    Loss::of_end(|q, p, v| q[1] * v[0] + p[q.len() - 1] * v[2])
        .and(Loss::output_at_end("height"))
        .and(Loss::integral("height").times(integral))
}

/// Derivatives along a run, at nodes and between them, by the initial state and all parameters; gradients of a loss
/// with velocities, outputs and an integral.
fn off<M: family::Model, F: Model<N>, const N: usize>(
    long: &Simulation<'_, M, 0, RunTimeLength>,
    fixed: &Simulation<'_, F, N>,
    start: &State<N>,
) -> [f64; 3] {
    off_at(
        long,
        fixed,
        start,
        (&[0.0, 0.013, 0.26, 0.5, 0.777, 0.8], 2.0),
    )
}

/// The same at given times, with a factor for the integral.
fn off_at<M: family::Model, F: Model<N>, const N: usize>(
    long: &Simulation<'_, M, 0, RunTimeLength>,
    fixed: &Simulation<'_, F, N>,
    start: &State<N>,
    (times, integral): (&[f64], f64),
) -> [f64; 3] {
    let span = 0.0..0.8;
    let theirs = fixed.run_linearised(*start, span.clone()).expect("a run");
    let ours = long.run_linearised(of_heap(start), span.clone());
    let ours = ours.expect("a run");
    let mut linearised = Seen::NOTHING;
    linearised.see(ours.product().as_slice(), theirs.product().as_slice());

    let theirs = fixed.run_sensitive(*start, span.clone()).expect("a run");
    let ours = long.run_sensitive(of_heap(start), span.clone());
    let ours = ours.expect("a run");
    let mut sensitive = Seen::NOTHING;
    sensitive.see_inside(&ours, &theirs, times);

    let mut gradient = Seen::NOTHING;
    let (theirs, ours) = (loss(integral), loss(integral));
    let theirs = fixed.gradient(*start, span.clone(), &theirs).expect("one");
    let ours = long.gradient(of_heap(start), span.clone(), &ours);
    gradient.see_gradients(&ours.expect("a gradient"), &theirs);
    [linearised.part(), sensitive.part(), gradient.part()]
}

#[test]
fn derivatives_of_runs_are_those_of_fixed_size() {
    let (long, fixed) = rods();
    let state = start(&fixed);
    for element in ELEMENTS {
        let ours = Simulation::new(&long).element(element).step(0.02);
        let theirs = Simulation::new(&fixed).element(element).step(0.02);
        let off = off(&ours, &theirs, &state);
        // 1e-13 of the largest derivative: the rounding errors of forty steps.
        assert!(off.iter().all(|off| *off < 2e-12), "{element}: {off:?}");
    }
}

/// Impulses, to a part of which constraints react at once; one of them at the start.
#[test]
fn derivatives_across_impulses_are_those_of_fixed_size() {
    let (long, fixed) = rods();
    let state = start(&fixed);
    let blows = [
        (0.0, [0.1, -0.2, 0.3, 0.2, 0.0, 0.1]),
        (0.3, [-0.3, 0.2, 0.1, 0.1, 0.4, -0.2]),
        (0.3, [0.1, 0.0, 0.0, 0.2, 0.0, 0.0]),
        (0.52, [0.2, 0.0, -0.1, 0.0, 0.3, 0.1]),
    ];
    for element in ELEMENTS {
        let mut ours = Simulation::new(&long).element(element).step(0.02);
        let mut theirs = Simulation::new(&fixed).element(element).step(0.02);
        for (t, blow) in blows {
            ours = ours.impulse(t, blow.to_vec());
            theirs = theirs.impulse(t, blow);
        }
        // In elements that begin with impulses, the polynomials of momenta differ; nodes agree.
        let looks = (&[0.26, 0.5, 0.777, 0.8][..], 0.0);
        let apart = off_at(&ours, &theirs, &state, looks);
        assert!(apart.iter().all(|off| *off < 2e-12), "{element}: {apart:?}");
        // By the weight, whose change keeps the initial state admissible: an integral compared with differences of
        // runs.
        let integral = |g: f64| {
            let other = Rods { g, ..long.clone() };
            let mut run = Simulation::new(&other).element(element).step(0.02);
            for (t, blow) in blows {
                run = run.impulse(t, blow.to_vec());
            }
            let motion = run.run(of_heap(&state), 0.0..0.8).expect("a run");
            let all = motion.integral(&other, "height").expect("an integral");
            [all[all.len() - 1]]
        };
        let [expected] = difference(integral, long.g);
        for run in [ours.clone(), ours.record_every(7)] {
            let loss = Loss::integral("height");
            let (_, found) = run.gradient(of_heap(&state), 0.0..0.8, &loss).expect("one");
            let found = found.by("g");
            assert!(
                (found - expected).abs() < 1e-10,
                "{element}: {found} {expected}"
            );
        }
    }
}

/// Tops described by unit quaternions, with a singular mass matrix: constraints determine the velocity of a momentum.
#[dynamics(
    coordinates(a[n], b[n], c[n], d[n]),
    lagrangian = sum(i in 0..n,
        2*i1*(a[i]*dot(b[i]) - b[i]*dot(a[i]) + d[i]*dot(c[i]) - c[i]*dot(d[i]))^2
        + 2*i2*(a[i]*dot(c[i]) - c[i]*dot(a[i]) + b[i]*dot(d[i]) - d[i]*dot(b[i]))^2
        + 2*i3*(a[i]*dot(d[i]) - d[i]*dot(a[i]) + c[i]*dot(b[i]) - b[i]*dot(c[i]))^2
        - mgd*(a[i]^2 - b[i]^2 - c[i]^2 + d[i]^2)),
    constraint(unit[i in 0..n]) = (a[i]^2 + b[i]^2 + c[i]^2 + d[i]^2 - r)/2,
    output(height) = a[0]*dot(b[0]) - b[0]*dot(a[0]) + d[0]*dot(c[0]) - c[0]*dot(d[0]),
)]
struct Tops {
    n: usize,
    i1: f64,
    i2: f64,
    i3: f64,
    mgd: f64,
    r: f64,
}

#[dynamics(
    coordinates(e[4]),
    let w = body_rate(e),
    lagrangian = (i1*w[0]^2 + i2*w[1]^2 + i3*w[2]^2)/2 - mgd*(e[0]^2 - e[1]^2 - e[2]^2 + e[3]^2),
    constraint(unit) = (inner(e, e) - r)/2,
    output(height) = w[0]/2,
)]
struct Top {
    i1: f64,
    i2: f64,
    i3: f64,
    mgd: f64,
    r: f64,
}

#[test]
fn unit_quaternions_have_the_velocities_and_derivatives_of_fixed_size() {
    let (i1, i2, i3, mgd, r) = (1.0, 1.3, 0.5, 1.0, 1.0);
    let (long, fixed) = of_both_lengths!(Tops(1), Top: i1, i2, i3, mgd, r);
    // e = (0.8, 0, 0.6, 0), with the body rates 0.3, −0.5 and 4.
    let start = fixed.state([0.8, 0.0, 0.6, 0.0], [0.15, 1.32, -0.2, 1.51]);
    for element in ELEMENTS {
        let ours = Simulation::new(&long).element(element).step(0.02);
        let theirs = Simulation::new(&fixed).element(element).step(0.02);
        let motion = ours.run(of_heap(&start), 0.0..0.8).expect("a run");
        let other = theirs.run(start, 0.0..0.8).expect("a run");
        let mut seen = Seen::NOTHING;
        assert_eq!(motion.states().len(), other.states().len());
        for (node, other) in motion.states().iter().zip(other.states()) {
            seen.see(&node.v, &other.v);
            seen.see(&long.velocity(node.t, &node.state()), &other.v);
        }
        seen.see(motion.energies(), other.energies());
        let heights = motion.integral(&long, "height").expect("an integral");
        seen.see(&heights, &other.integral(&fixed, "height").expect("one"));
        assert!(seen.part() < 1e-13, "{element}: {:e}", seen.off);
        let off = off(&ours, &theirs, &start);
        assert!(off.iter().all(|off| *off < 2e-12), "{element}: {off:?}");
    }
}

/// A long hanging chain: forward and backward derivatives agree, and so do those of the parts between recorded nodes.
#[test]
fn gradients_of_a_long_chain_are_its_derivatives() {
    let n = 25;
    let (three, _) = rods();
    let chain = Rods {
        n,
        m: (0..n).map(|i| 0.5 + 0.1 * (i % 4) as f64).collect(),
        l: (0..n - 1).map(|i| 0.3 + 0.05 * (i % 3) as f64).collect(),
        a: 0.0,
        ..three
    };
    let (mut x, mut y) = (vec![0.0; n], vec![0.0; n]);
    let (mut at, mut length) = ([0.0, 0.0], 1.0);
    for i in 0..n {
        let angle = 0.3 + 0.02 * i as f64;
        at = [at[0] + length * angle.sin(), at[1] - length * angle.cos()];
        (x[i], y[i]) = (at[0], at[1]);
        length = chain.l.get(i).copied().unwrap_or_default();
    }
    let q = [x, y].concat();
    let start = || chain.state(q.clone(), vec![0.0; 2 * n]);
    let run = Simulation::new(&chain).element(Mixed::<4>).step(0.02);
    let loss = || {
        let end = |q: &[f64], p: &[f64], v: &[f64]| q[n - 1] * v[2 * n - 1] + p[0];
        Loss::of_end(end).and(Loss::output_at_end("height"))
    };
    let (_, plain) = run.gradient(start(), 0.0..0.3, &loss()).expect("one");
    let run_in_parts = run.clone().record_every(5);
    let (_, parts) = run_in_parts
        .gradient(start(), 0.0..0.3, &loss())
        .expect("one");
    let mut seen = Seen::NOTHING;
    seen.see(parts.by_parameters(), plain.by_parameters());
    // The iterations of a part start from other values: their rounding errors, amplified a thousand times by 25 rods,
    // are about 1e-12.
    assert!(seen.part() < 1e-11, "{:e} of {:e}", seen.off, seen.size);
    let forwards = run.run_sensitive(start(), 0.0..0.3).expect("a run");
    let end = forwards.motion().last().clone();
    let mut seen = Seen::NOTHING;
    for (index, name) in forwards.parameters().iter().enumerate() {
        let by = forwards.by(name).at(end.t).expect("the end");
        let height = forwards.by(name).output("height").expect("an output");
        let height = height.last().expect("the end");
        let own = by.q[n - 1] * end.v[2 * n - 1] + end.q[n - 1] * by.v[2 * n - 1] + by.p[0];
        seen.see(&[plain.by_parameters()[index]], &[own + height]);
    }
    assert!(seen.part() < 1e-11, "{:e} of {:e}", seen.off, seen.size);
}

/// Two rods on a support, the second one driven, with springs on the angles.
#[dynamics(
    coordinates(x[n], y[n]),
    lagrangian = sum(i in 0..n, m*(1 + s*x[i]^2)/2*(dot(x[i])^2 + dot(y[i])^2) - m*g*y[i]),
    constraint(first) = x[0]^2 + (y[0] - a*cos(omega*t))^2 - l^2,
    constraint(rod[i in 0..n-1]) = (x[i+1] - x[i])^2 + (y[i+1] - y[i])^2 - l^2,
    force(x[i]) = -c*dot(x[i]),
    force(x[n-1]) = f*cos(omega*t),
)]
struct DrivenRods {
    n: usize,
    m: f64,
    s: f64,
    g: f64,
    l: f64,
    a: f64,
    c: f64,
    f: f64,
    omega: f64,
}

#[dynamics(
    coordinates(x[2], y[2]),
    lagrangian = sum(i in 0..2, m*(1 + s*x[i]^2)/2*(dot(x[i])^2 + dot(y[i])^2) - m*g*y[i]),
    constraint(first) = x[0]^2 + (y[0] - a*cos(omega*t))^2 - l^2,
    constraint(rod) = (x[1] - x[0])^2 + (y[1] - y[0])^2 - l^2,
    force(x[0]) = -c*dot(x[0]),
    force(x[1]) = -c*dot(x[1]) + f*cos(omega*t),
)]
struct DrivenTwo {
    m: f64,
    s: f64,
    g: f64,
    l: f64,
    a: f64,
    c: f64,
    f: f64,
    omega: f64,
}

fn driven(f: f64, a: f64, c: f64) -> (DrivenRods, DrivenTwo) {
    let (m, s, g, l, omega) = (0.8, 0.1, 1.0, 1.1, 2.3);
    of_both_lengths!(DrivenRods(2), DrivenTwo: m, s, g, l, a, c, f, omega)
}

/// Two angles that swing with an amplitude and a phase, as coordinates and velocities.
fn swing(t: f64, omega: f64, amplitude: f64, l: f64) -> ([f64; 4], [f64; 4]) {
    let (sin, cos) = (omega * t).sin_cos();
    let angles = [amplitude * cos, 1.4 * amplitude * cos];
    let rates = [-amplitude * omega * sin, -1.4 * amplitude * omega * sin];
    let (x, y) = (angles.map(|a| l * a.sin()), angles.map(|a| -l * a.cos()));
    let vx = [0, 1].map(|i| l * angles[i].cos() * rates[i]);
    let vy = [0, 1].map(|i| l * angles[i].sin() * rates[i]);
    (
        [x[0], x[0] + x[1], y[0], y[0] + y[1]],
        [vx[0], vx[0] + vx[1], vy[0], vy[0] + vy[1]],
    )
}

fn heap<const N: usize>((q, v): ([f64; N], [f64; N])) -> (Vec<f64>, Vec<f64>) {
    (q.to_vec(), v.to_vec())
}

#[test]
fn driven_orbits_are_those_of_fixed_size() {
    for (f, a, c) in [(0.3, 0.0, 0.2), (0.2, 0.15, 0.1)] {
        let (long, fixed) = driven(f, a, c);
        let period = std::f64::consts::TAU / fixed.omega;
        let guess = move |t: f64| swing(t, 2.3, -0.05, 1.1);
        let ours = PeriodicOrbit::of(&long).element(Mixed::<5>).elements(30);
        let ours = ours.period(period).guess(move |t| heap(guess(t)));
        let theirs = PeriodicOrbit::of(&fixed).element(Mixed::<5>).elements(30);
        let theirs = theirs.period(period).guess(guess);
        let ours = ours.solve_sensitive().expect("an orbit");
        let theirs = theirs.solve_sensitive().expect("an orbit");
        let (one, other) = (ours.orbit(), theirs.orbit());
        let mut seen = Seen::NOTHING;
        seen.see(&one.start().q, &other.start().q);
        seen.see(&one.start().p, &other.start().p);
        assert!(seen.part() < 1e-11, "{:e}", seen.off);
        assert_eq!(one.multipliers().len(), 4, "no zeros");
        for (a, b) in one.multipliers().iter().zip(other.multipliers()) {
            assert!((a - b).norm() < 1e-9, "{a} {b}");
        }
        assert!(one.motion().constraint_residual().position < 1e-13);
        for name in ["m", "s", "g", "l", "a", "c", "f"] {
            let (one, other) = (ours.by(name), theirs.by(name));
            let mut seen = Seen::NOTHING;
            seen.see(&one.start().q, &other.start().q);
            seen.see(&one.start().p, &other.start().p);
            assert!(
                seen.off < 1e-9 * seen.size.max(1.0),
                "{name}: {:e}",
                seen.off
            );
        }
    }
}

/// Rods with no forces except weight.
#[dynamics(
    coordinates(x[n], y[n]),
    lagrangian = sum(i in 0..n, m*(1 + s*x[i]^2)/2*(dot(x[i])^2 + dot(y[i])^2) - m*g*y[i]),
    constraint(first) = x[0]^2 + y[0]^2 - l^2,
    constraint(rod[i in 0..n-1]) = (x[i+1] - x[i])^2 + (y[i+1] - y[i])^2 - l^2,
)]
struct FreeRods {
    n: usize,
    m: f64,
    s: f64,
    g: f64,
    l: f64,
}

#[dynamics(
    coordinates(x[2], y[2]),
    lagrangian = sum(i in 0..2, m*(1 + s*x[i]^2)/2*(dot(x[i])^2 + dot(y[i])^2) - m*g*y[i]),
    constraint(first) = x[0]^2 + y[0]^2 - l^2,
    constraint(rod) = (x[1] - x[0])^2 + (y[1] - y[0])^2 - l^2,
)]
struct FreeTwo {
    m: f64,
    s: f64,
    g: f64,
    l: f64,
}

#[test]
fn conservative_orbits_are_those_of_fixed_size() {
    let (m, s, g, l) = (0.8, 0.1, 1.0, 1.1);
    let (long, fixed) = of_both_lengths!(FreeRods(2), FreeTwo: m, s, g, l);
    let guess = move |t: f64| swing(t, 0.73, 0.3, l);
    let ours = PeriodicOrbit::of(&long).element(Mixed::<5>).elements(40);
    let ours = ours.unknown_period(std::f64::consts::TAU / 0.73);
    let theirs = PeriodicOrbit::of(&fixed).element(Mixed::<5>).elements(40);
    let theirs = theirs.unknown_period(std::f64::consts::TAU / 0.73);
    let ours = ours.guess(move |t| heap(guess(t))).solve_sensitive();
    let theirs = theirs.guess(guess).solve_sensitive();
    let (ours, theirs) = (ours.expect("an orbit"), theirs.expect("an orbit"));
    let (one, other) = (ours.orbit(), theirs.orbit());
    assert!((one.period() - other.period()).abs() < 1e-10);
    assert!(one.motion().constraint_residual().position < 1e-13);
    // Two pairs, one of them trivial and known to the square root of the rounding unit.
    let angles = |orbit: &[Complex<f64>]| orbit.iter().map(|one| one.arg().abs()).fold(0.0, larger);
    assert_eq!((one.multipliers().len(), one.trivial().len()), (4, 2));
    assert!((angles(one.multipliers()) - angles(other.multipliers())).abs() < 1e-8);
    for name in ["m", "s", "g", "l"] {
        let (ours, theirs) = (ours.by(name).period(), theirs.by(name).period());
        assert!((ours - theirs).abs() < 1e-10, "{name}: {ours} {theirs}");
    }
    // Compared with a run over the period.
    let start = one.start();
    let run = Simulation::new(&long)
        .element(Mixed::<5>)
        .step(one.period() / 40.0);
    let run = run.run_linearised(start, 0.0..one.period()).expect("a run");
    let multipliers = run.multipliers().expect("multipliers");
    let multipliers: Vec<_> = multipliers.iter().map(Multiplier::to_complex).collect();
    assert!((angles(&multipliers) - angles(one.multipliers())).abs() < 1e-8);
    assert_eq!(run.on_constraints().expect("bases")[0].shape(), (4, 4));
    let still = Simulation::new(&long).step(0.1);
    let still = still.run_linearised(one.start(), 0.0..0.0);
    let identity = still.expect("an empty span").multipliers();
    assert_eq!(identity.expect("multipliers").len(), 4);
}
