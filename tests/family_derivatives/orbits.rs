//! Periodic orbits of models of run-time length.

use crate::common::larger;
use crate::differences::difference;
use crate::lengths::{of_both_lengths, states_apart};
use nalgebra::{Complex, DMatrix, DVector};
use std::f64::consts::{PI, TAU};
use tfe::AssemblyError;
use tfe::family::FamilyState;
use tfe::length::RunTimeLength;
use tfe::periodic::{OrbitError, OrbitSlopes, Phase, Verdict};
use tfe::prelude::*;

/// A chain with fixed ends, cubic forces, damping, and a driven end.
#[dynamics(
    coordinates(q[n]),
    lagrangian = sum(i in 0..n, dot(q[i])^2/2) - sum(i in 0..n-1, (q[i+1]-q[i])^2/2 + b/4*(q[i+1]-q[i])^4)
        - q[0]^2/2 - b/4*q[0]^4 - q[n-1]^2/2 - b/4*q[n-1]^4,
    dissipation = sum(i in 0..n, c/2*dot(q[i])^2),
    force(q[n-1]) = f*cos(omega*t),
)]
#[derive(Debug)]
struct Driven {
    n: usize,
    b: f64,
    c: f64,
    f: f64,
    omega: f64,
}

#[dynamics(
    coordinates(q[6]),
    lagrangian = sum(i in 0..6, dot(q[i])^2/2) - sum(i in 0..5, (q[i+1]-q[i])^2/2 + b/4*(q[i+1]-q[i])^4)
        - q[0]^2/2 - b/4*q[0]^4 - q[5]^2/2 - b/4*q[5]^4,
    dissipation = sum(i in 0..6, c/2*dot(q[i])^2),
    force(q[5]) = f*cos(omega*t),
)]
struct DrivenSix {
    b: f64,
    c: f64,
    f: f64,
    omega: f64,
}

/// Two masses have the frequencies 1 and √3. Forced at the first without damping, there is no periodic orbit. The
/// errors of elements in its period, 4e-6 (ten elements) to 9e-10 (forty), allow one with an amplitude as large as
/// these errors are small: it must be refused.
#[test]
fn resonance_without_damping_has_no_orbit() {
    let driven = Driven {
        n: 2,
        b: 0.0,
        c: 0.0,
        f: 0.3,
        omega: 1.0,
    };
    for elements in [10, 40] {
        let error = PeriodicOrbit::of(&driven)
            .elements(elements)
            .period(TAU)
            .solve();
        assert!(
            matches!(
                error,
                Err(OrbitError::Assembly(AssemblyError::Singular { .. }))
            ),
            "{elements}: {:?}",
            error.map(|orbit| orbit.start())
        );
    }
}

/// The same without a driving force: conservative.
#[dynamics(
    coordinates(q[n]),
    lagrangian = sum(i in 0..n, dot(q[i])^2/2) - sum(i in 0..n-1, (q[i+1]-q[i])^2/2 + b/4*(q[i+1]-q[i])^4)
        - q[0]^2/2 - b/4*q[0]^4 - q[n-1]^2/2 - b/4*q[n-1]^4,
)]
#[derive(Debug)]
struct Chain {
    n: usize,
    b: f64,
}

#[dynamics(
    coordinates(q[6]),
    lagrangian = sum(i in 0..6, dot(q[i])^2/2) - sum(i in 0..5, (q[i+1]-q[i])^2/2 + b/4*(q[i+1]-q[i])^4)
        - q[0]^2/2 - b/4*q[0]^4 - q[5]^2/2 - b/4*q[5]^4,
)]
struct Six {
    b: f64,
}

/// The distance of each number from the nearest of the others.
fn apart(ones: &[Complex<f64>], others: &[Complex<f64>]) -> f64 {
    let nearest = |one: &Complex<f64>| {
        let distances = others.iter().map(|other| (one - other).norm());
        distances.fold(f64::INFINITY, f64::min)
    };
    ones.iter().map(nearest).fold(0.0, larger)
}

#[test]
fn driven_orbits_are_those_of_fixed_size() {
    let (b, c, f, omega) = (0.8, 0.1, 0.4, 0.9);
    let (long, six) = of_both_lengths!(Driven(6), DrivenSix: b, c, f, omega);
    let one = PeriodicOrbit::of(&long).elements(24).period(TAU / omega);
    let one = one.solve().expect("an orbit");
    let other = PeriodicOrbit::of(&six).elements(24).period(TAU / omega);
    let other = other.solve().expect("an orbit");
    let off = states_apart(&one.start(), &other.start());
    assert!(off < 1e-12, "{off:e}");
    let off = apart(one.multipliers(), other.multipliers());
    assert!(off < 1e-10, "{off:e}");
    assert!(one.is_stable() && one.trivial().is_empty() && one.unfolding().is_none());
    let off = (one.monodromy() - other.monodromy()).amax();
    assert!(off < 1e-11, "{off:e}");
    let (motion, fixed) = (one.motion(), other.motion());
    for time in [0.0, 1.234, 5.0, motion.last().t] {
        let (one, other) = (
            motion.at(time).expect("inside"),
            fixed.at(time).expect("inside"),
        );
        let off = states_apart(&one.state(), &other.state());
        assert!(off < 1e-11, "{time}: {off:e}");
    }
    assert_eq!(motion.states().len(), 25);
    assert_eq!(one.nodes().len(), 25);
}

#[test]
fn conservative_orbits_are_those_of_fixed_size() {
    let (long, six) = (Chain { n: 6, b: 0.5 }, Six { b: 0.5 });
    let q: [f64; 6] = std::array::from_fn(|i| 0.8 * (2.0 * PI * (i + 1) as f64 / 7.0).sin());
    let (start, fixed) = (long.state(q, [0.0; 6]), six.state(q, [0.0; 6]));
    for phase in [
        Phase::Orthogonal,
        Phase::Momentum {
            index: 1,
            value: 0.0,
        },
    ] {
        let one = PeriodicOrbit::of(&long)
            .unknown_period(6.8)
            .guess_from(start.clone())
            .energy(0.9)
            .phase(phase)
            .solve()
            .expect("an orbit");
        let other = PeriodicOrbit::of(&six)
            .unknown_period(6.8)
            .guess_from(fixed)
            .energy(0.9)
            .phase(phase)
            .solve()
            .expect("an orbit");
        assert!((one.period() - other.period()).abs() < 1e-10);
        if phase != Phase::Orthogonal {
            // Otherwise the phases may differ, since the corrections do.
            for a in 0..6 {
                assert!((one.start().q[a] - other.start().q[a]).abs() < 1e-10);
            }
        }
        assert_eq!(one.trivial().len(), 2);
        let others = |multipliers: &[Complex<f64>], trivial: &[usize]| -> Vec<Complex<f64>> {
            let all = multipliers.iter().enumerate();
            let others = all.filter(|(place, _)| !trivial.contains(place));
            others.map(|(_, multiplier)| *multiplier).collect()
        };
        let one_others = others(one.multipliers(), &one.trivial());
        let off = apart(&one_others, &others(other.multipliers(), &other.trivial()));
        assert!(off < 1e-10, "{off:e}");
        let unfolding = one.unfolding().expect("unfolded");
        assert!(unfolding.abs() < 1e-8, "{unfolding:e}");
    }
    // With a given period instead of a given energy.
    let one = PeriodicOrbit::of(&long)
        .period(6.6)
        .guess_from(start)
        .solve();
    let other = PeriodicOrbit::of(&six)
        .period(6.6)
        .guess_from(fixed)
        .solve();
    let (one, other) = (one.expect("an orbit"), other.expect("an orbit"));
    let energy = |p: &[f64], q: &[f64]| -> f64 {
        let stretch = |from: f64, to: f64| (to - from).powi(2) / 2.0 + 0.125 * (to - from).powi(4);
        let kinetic: f64 = p.iter().map(|p| p * p / 2.0).sum();
        let inside: f64 = q.windows(2).map(|pair| stretch(pair[0], pair[1])).sum();
        kinetic + inside + stretch(0.0, q[0]) + stretch(0.0, q[5])
    };
    let (one, other) = (one.start().clone(), other.start());
    let off = energy(&one.p, &one.q) - energy(&other.p, &other.q);
    assert!(off.abs() < 1e-10, "{off:e}");
}

/// A linear chain: the steady state from a linear system, multipliers e^λT with λ² + cλ + ω_k² = 0.
#[test]
fn linear_chains_have_a_closed_form() {
    let (n, c, f, omega) = (20, 0.1, 1.0, 0.7);
    let (b, period) = (0.0, TAU / omega);
    let chain = Driven { n, b, c, f, omega };
    let orbit = PeriodicOrbit::of(&chain).element(Mixed::<6>).period(period);
    let orbit = orbit.solve().expect("an orbit");
    let stiffness = DMatrix::from_fn(n, n, |i, j| match i.abs_diff(j) {
        0 => Complex::new(2.0 - omega * omega, c * omega),
        1 => Complex::new(-1.0, 0.0),
        _ => Complex::new(0.0, 0.0),
    });
    let mut force = DVector::from_element(n, Complex::new(0.0, 0.0));
    force[n - 1] = Complex::new(f, 0.0);
    let amplitude = stiffness.lu().solve(&force).expect("regular");
    for a in 0..n {
        let (q, p) = (amplitude[a].re, -omega * amplitude[a].im);
        let off = larger(
            (orbit.start().q[a] - q).abs(),
            (orbit.start().p[a] - p).abs(),
        );
        // Order ten: (ω_max h)¹⁰ is 10⁻⁵, with a small factor, for the fastest modes, whose amplitudes are small.
        assert!(off < 1e-10, "{a}: {off:e}");
    }
    let mut expected = Vec::new();
    for k in 1..=n {
        let frequency = 2.0 * (k as f64 * PI / (2.0 * (n + 1) as f64)).sin();
        let imaginary = (frequency * frequency - c * c / 4.0).sqrt();
        for sign in [1.0, -1.0] {
            let exponent = Complex::new(-c / 2.0, sign * imaginary) * period;
            expected.push(exponent.exp());
        }
    }
    let off = apart(orbit.multipliers(), &expected);
    assert!(off < 1e-8, "{off:e}");
    assert!(matches!(orbit.verdict(), Verdict::Stable { .. }));
    // A linear problem: one correction, and one that confirms it.
    assert!(orbit.statistics().newton_iterations <= 3);
}

/// The period T = 2π / agm(√(1 + b a²), √(1 + b a²/2)) of a'' = −a − b a³ for an amplitude.
fn duffing_period(b: f64, a: f64) -> f64 {
    let (mut mean, mut geometric) = ((1.0 + b * a * a).sqrt(), (1.0 + b * a * a / 2.0).sqrt());
    for _ in 0..6 {
        (mean, geometric) = (f64::midpoint(mean, geometric), (mean * geometric).sqrt());
    }
    TAU / mean
}

/// The seventh mode of 20 masses is exact: (a, a, 0, −a, −a, 0, …) moves as a Duffing oscillator, a'' = −a − b a³.
#[test]
fn a_mode_of_twenty_masses_has_a_closed_form() {
    let (b, a) = (1.0, 0.6);
    let chain = Chain { n: 20, b };
    let pattern = [1.0, 1.0, 0.0, -1.0, -1.0, 0.0];
    let q: Vec<f64> = (0..20).map(|i| a * pattern[i % 6]).collect();
    let start = chain.state(q, vec![0.0; 20]);
    let orbit = PeriodicOrbit::of(&chain)
        .element(Mixed::<6>)
        .unknown_period(5.5)
        .guess_from(start.clone())
        .phase(Phase::Momentum {
            index: 0,
            value: 0.0,
        })
        .solve()
        .expect("an orbit");
    let off = orbit.period() - duffing_period(b, a);
    assert!(off.abs() < 1e-10, "{off:e}");
    for (found, given) in orbit.start().q.iter().zip(&start.q) {
        assert!((found - given).abs() < 1e-8, "{found} {given}");
    }
    // Symplectic: multipliers come in pairs μ, 1/μ.
    let logs: f64 = orbit.floquet().iter().map(|one| one.log_modulus).sum();
    assert!(logs.abs() < 1e-9, "{logs:e}");
    let inverses: Vec<Complex<f64>> = orbit.multipliers().iter().map(Complex::inv).collect();
    let off = apart(orbit.multipliers(), &inverses);
    assert!(off < 1e-6, "{off:e}");
    // The exact mode is unstable against other modes.
    assert!(matches!(orbit.verdict(), Verdict::Unstable { .. }));
    assert_eq!(orbit.multipliers().len(), 40);
}

/// A chain of van der Pol oscillators: an isolated orbit with unknown period.
#[dynamics(
    coordinates(x[n]), momenta(p[n]),
    hamiltonian = sum(i in 0..n, p[i]^2/2 + x[i]^2/2) + sum(i in 0..n-1, k/2*(x[i+1]-x[i])^2),
    force(x[i]) = mu*(1 - x[i]^2)*p[i],
)]
struct VanDerPol {
    n: usize,
    k: f64,
    mu: f64,
}

#[dynamics(
    coordinates(x[4]), momenta(p[4]),
    hamiltonian = sum(i in 0..4, p[i]^2/2 + x[i]^2/2) + sum(i in 0..3, k/2*(x[i+1]-x[i])^2),
    force(x[i]) = mu*(1 - x[i]^2)*p[i],
)]
struct FourVanDerPol {
    k: f64,
    mu: f64,
}

#[test]
fn isolated_orbits_of_unknown_period() {
    let (k, mu) = (0.3, 1.0);
    let (model, four) = of_both_lengths!(VanDerPol(4), FourVanDerPol: k, mu);
    let guess = model.state(vec![2.0; 4], vec![0.0; 4]);
    let orbit = PeriodicOrbit::of(&model)
        .element(Mixed::<6>)
        .elements(40)
        .unknown_period(6.66)
        .guess_from(guess)
        .solve()
        .expect("an orbit");
    // All move together with the period of a single oscillator, with any quadrature.
    assert!(
        (orbit.period() - 6.663_286_859_323_13).abs() < 1e-9,
        "{}",
        orbit.period()
    );
    assert_eq!(orbit.trivial().len(), 1);
    let trivial = orbit.multipliers()[orbit.trivial()[0]];
    assert!((trivial - 1.0).norm() < 1e-9, "{trivial}");
    let fixed = PeriodicOrbit::of(&four)
        .element(Mixed::<6>)
        .elements(40)
        .unknown_period(6.66)
        .guess_from(four.state([2.0; 4], [0.0; 4]))
        .solve()
        .expect("an orbit");
    assert!((orbit.period() - fixed.period()).abs() < 1e-11);
    let off = apart(orbit.multipliers(), fixed.multipliers());
    assert!(off < 1e-10, "{off:e}");
}

/// One or two elements of high degree: here too, the phase remains that of the guess.
#[test]
fn one_element_or_two_over_a_period() {
    let model = VanDerPol {
        n: 2,
        k: 0.3,
        mu: 0.2,
    };
    let turning = Phase::Momentum {
        index: 0,
        value: 0.0,
    };
    // With 11 Gauss points each, the periods are 6.300093 and 6.298876885.
    let period = 6.298_876_714;
    for (elements, tolerance) in [(1, 4e-4), (2, 1e-7)] {
        for phase in [Phase::Orthogonal, turning] {
            let few = PeriodicOrbit::of(&model)
                .element(Mixed::<12>)
                .elements(elements)
                .unknown_period(6.3)
                .phase(phase)
                .guess(|t| (vec![2.0 * t.cos(); 2], vec![-2.0 * t.sin(); 2]))
                .solve()
                .expect("a limit cycle");
            let off = few.period() / period - 1.0;
            assert!(off.abs() < tolerance, "{elements} {phase:?}: {off:e}");
            assert_eq!(few.trivial().len(), 1);
        }
    }
    // Both masses move alike as a Duffing oscillator: 0.59993 if one element has its turning point inside, with an
    // error of the period of 1.4e-5.
    let (chain, a) = (Chain { n: 2, b: 0.5 }, 0.6);
    let period = duffing_period(chain.b, a);
    let energy = a * a + chain.b * a.powi(4) / 2.0;
    for (elements, tolerance) in [(1, 5e-4), (2, 1e-8)] {
        let few = || {
            PeriodicOrbit::of(&chain)
                .element(Mixed::<12>)
                .elements(elements)
                .guess(move |t| {
                    let (sine, cosine) = (TAU / period * t).sin_cos();
                    (vec![a * cosine; 2], vec![-a * sine * TAU / period; 2])
                })
        };
        let by_period = few().period(period).solve().expect("a mode");
        let off = by_period.start().q[0] / a - 1.0;
        assert!(off.abs() < tolerance, "{elements}: {off:e}");
        let by_energy = few().unknown_period(0.99 * period).energy(energy);
        let off = by_energy.solve().expect("a mode").period() / period - 1.0;
        assert!(off.abs() < tolerance, "{elements}: {off:e}");
    }
}

/// As for models of fixed size: if an orbit is found it is the limit cycle, whose amplitude is 2.
#[test]
fn a_state_of_rest_is_no_orbit_of_an_unknown_period() {
    let chain = Chain { n: 3, b: 0.1 };
    let model = VanDerPol {
        n: 2,
        k: 0.3,
        mu: 1.0,
    };
    let turning = Phase::Momentum {
        index: 0,
        value: 0.0,
    };
    for elements in [1, 2, 40] {
        for phase in [Phase::Orthogonal, turning] {
            let rest = PeriodicOrbit::of(&chain)
                .elements(elements)
                .unknown_period(6.0)
                .phase(phase);
            let rest = rest.solve().map(|_| ());
            assert_eq!(rest, Err(OrbitError::AtRest), "{elements} {phase:?}");
            let rest = PeriodicOrbit::of(&model)
                .elements(elements)
                .unknown_period(6.0)
                .phase(phase);
            let rest = rest.solve().map(|_| ());
            assert_eq!(rest, Err(OrbitError::AtRest), "{elements} {phase:?}");
        }
    }
    for (amplitude, period) in [(1e-100, 6.3), (1e-6, 6.3), (1e-3, 9.0), (0.1, 3.0)] {
        let orbit = PeriodicOrbit::of(&model)
            .unknown_period(period)
            .guess_from(model.state([amplitude; 2], [0.0; 2]))
            .solve();
        if let Ok(orbit) = orbit {
            let nodes = orbit.nodes();
            let largest = nodes.iter().map(|node| node.q[0].abs());
            let largest = largest.fold(0.0, larger);
            assert!(largest > 1.9, "{amplitude:e}: {largest:e}");
        }
    }
}

/// The derivatives of two orbits, one of them of run-time length, by a parameter or by the period; multipliers in the
/// same order.
#[track_caller]
fn compare_slopes<const N: usize>(
    long: &OrbitSlopes<0, RunTimeLength>,
    fixed: &OrbitSlopes<N>,
    allowed: f64,
) {
    assert!((long.period() - fixed.period()).abs() < allowed);
    let off = states_apart(&long.start(), &fixed.start());
    assert!(off < allowed, "{off:e}");
    let pairs = long.multipliers().iter().zip(fixed.multipliers());
    for (one, other) in pairs {
        let off = one.zip(*other).map(|(one, other)| (one - other).norm());
        assert!(off.is_some_and(|off| off < 100.0 * allowed), "{off:?}");
    }
}

#[test]
fn derivatives_of_orbits_are_those_of_fixed_size() {
    let (b, c, f, omega) = (0.8, 0.1, 0.4, 0.9);
    let (long, six) = of_both_lengths!(Driven(6), DrivenSix: b, c, f, omega);
    let one = PeriodicOrbit::of(&long).elements(24).period(TAU / omega);
    let one = one.solve_sensitive().expect("an orbit");
    let other = PeriodicOrbit::of(&six).elements(24).period(TAU / omega);
    let other = other.solve_sensitive().expect("an orbit");
    assert_eq!(one.parameters(), other.parameters());
    for name in other.parameters() {
        compare_slopes(one.by(name), other.by(name), 1e-9);
    }
    let (by_period, fixed) = (one.by_period(), other.by_period());
    compare_slopes(by_period.expect("given"), fixed.expect("given"), 1e-9);

    let (k, mu) = (0.3, 1.0);
    let (long, four) = of_both_lengths!(VanDerPol(4), FourVanDerPol: k, mu);
    let turning = Phase::Momentum {
        index: 0,
        value: 0.0,
    };
    let one = PeriodicOrbit::of(&long)
        .element(Mixed::<6>)
        .unknown_period(6.66)
        .phase(turning)
        .guess_from(long.state(vec![2.0; 4], vec![0.0; 4]));
    let one = one.solve_sensitive().expect("an orbit");
    let other = PeriodicOrbit::of(&four)
        .element(Mixed::<6>)
        .unknown_period(6.66)
        .phase(turning)
        .guess_from(four.state([2.0; 4], [0.0; 4]));
    let other = other.solve_sensitive().expect("an orbit");
    assert!(one.by_period().is_none());
    compare_slopes(one.by("mu"), other.by("mu"), 1e-9);
    // All move together: the springs between them have no effect on the orbit.
    assert!(one.by("k").period().abs() < 1e-10);
}

/// The period T = 2π / agm(√(1 + b a²), √(1 + b a²/2)) of the mode (a, a, 0, −a, −a, 0, …) with the energy of its 14
/// moving masses: 7 a² + 3.5 b a⁴ in all, for ä = −a − b a³.
#[test]
fn a_period_changes_at_one_energy_as_its_closed_form() {
    let chain = Chain { n: 20, b: 1.0 };
    let pattern = [1.0, 1.0, 0.0, -1.0, -1.0, 0.0];
    let q: Vec<f64> = (0..20).map(|i| 0.6 * pattern[i % 6]).collect();
    let start = chain.state(q, vec![0.0; 20]);
    let orbit = PeriodicOrbit::of(&chain)
        .element(Mixed::<6>)
        .unknown_period(5.5)
        .guess_from(start)
        .phase(Phase::Momentum {
            index: 0,
            value: 0.0,
        })
        .solve_sensitive()
        .expect("an orbit");
    // The energy of one oscillator, a²/2 + b a⁴/4, is constant: a² = (√(1 + 4 b E) − 1)/b.
    let energy = 0.18 + 0.36 * 0.36 / 4.0;
    let at_energy = |b: f64| {
        let square = ((1.0 + 4.0 * b * energy).sqrt() - 1.0) / b;
        duffing_period(b, square.sqrt())
    };
    let [expected] = difference(|b| [at_energy(b)], 1.0);
    let off = orbit.by("b").period() - expected;
    assert!(off.abs() < 1e-9, "{off:e}");
    // The initial state is a turning point with the amplitude a(b).
    let square = |b: f64| ((1.0 + 4.0 * b * energy).sqrt() - 1.0) / b;
    let by_b = (square(1.0 + 1e-5) - square(1.0 - 1e-5)) / (2e-5) / 1.2;
    let off = orbit.by("b").start().q[0] - by_b;
    assert!(off.abs() < 1e-8, "{off:e}");
}

#[test]
fn what_makes_no_sense_is_told() {
    let (n, b, c, f, omega) = (3, 0.1, 0.1, 0.3, 1.0);
    let driven = Driven { n, b, c, f, omega };
    let no_period = PeriodicOrbit::of(&driven).solve().expect_err("none given");
    assert_eq!(no_period, OrbitError::NoPeriod);
    let forced = PeriodicOrbit::of(&driven).unknown_period(6.0).solve();
    assert_eq!(forced.expect_err("forced"), OrbitError::ForcedPeriod);
    let negative = PeriodicOrbit::of(&driven)
        .period(-1.0)
        .solve()
        .expect_err("negative");
    assert_eq!(negative, OrbitError::Period { period: -1.0 });
    let short = PeriodicOrbit::of(&driven)
        .period(1.0)
        .guess(|_| (vec![0.0; 2], vec![0.0; 3]));
    let short = short.solve().expect_err("two of three");
    assert!(matches!(short, OrbitError::Family(_)), "{short}");
    let short = FamilyState {
        q: vec![0.0; 3],
        p: Vec::new(),
    };
    let short = PeriodicOrbit::of(&driven)
        .period(1.0)
        .guess_from(short)
        .solve();
    assert!(matches!(short, Err(OrbitError::Guess(_))));
    let none = PeriodicOrbit::of(&driven).period(1.0).elements(0).solve();
    assert!(matches!(none, Err(OrbitError::Mesh(_))));
    let chain = Chain { n: 3, b: 0.1 };
    let phase = Phase::Coordinate {
        index: 3,
        value: 0.0,
    };
    let guess = chain.state([0.1, 0.2, 0.1], [0.0; 3]);
    let orbit = PeriodicOrbit::of(&chain)
        .unknown_period(8.0)
        .guess_from(guess);
    let error = orbit.phase(phase).solve().expect_err("three coordinates");
    assert_eq!(error, OrbitError::Phase { index: 3 });
    let empty = Chain { n: 0, b: 0.1 };
    let error = PeriodicOrbit::of(&empty)
        .period(1.0)
        .solve()
        .expect_err("no sites");
    assert!(matches!(error, OrbitError::Family(_)), "{error}");
    // The equilibrium is an orbit with any period: its multipliers are those of the linear modes.
    let rest = PeriodicOrbit::of(&chain).period(1.0).solve().expect("rest");
    assert!(rest.unfolding().is_none() && rest.trivial().is_empty());
    assert!(matches!(rest.verdict(), Verdict::Neutral { .. }));
}

/// Elements that are too long close another motion: the orbit has a warning, as those of models of fixed size.
#[test]
fn orbits_that_the_elements_do_not_resolve_are_told() {
    let driven = Driven {
        n: 2,
        b: 0.0,
        c: 0.2,
        f: 0.3,
        omega: 1.4,
    };
    let of = |periods: f64, elements: usize| {
        let orbit = PeriodicOrbit::of(&driven).elements(elements);
        orbit.period(periods * TAU / driven.omega).solve()
    };
    let near = of(1.0, 40).expect("an orbit");
    assert!(near.warnings().is_empty(), "{near}");
    let far = of(20.0, 20).expect("an orbit");
    let off = (far.start().q[1] - near.start().q[1]).abs();
    assert!(off > 0.03 && far.warnings().len() == 1, "{off} {far}");
    assert!(far.to_string().contains("20 elements do not resolve"));
    // An unknown period, with an unfolding force.
    let chain = Chain { n: 2, b: 1.0 };
    let swing = PeriodicOrbit::of(&chain).unknown_period(5.0);
    let swing = swing.guess_from(chain.state(vec![1.0, 1.0], vec![0.0, 0.0]));
    let swing = swing.solve().expect("an orbit");
    assert!(swing.warnings().is_empty(), "{swing}");
}

/// A chain on springs that are at rest at r.
#[dynamics(
    coordinates(q[n]),
    lagrangian = sum(i in 0..n, dot(q[i])^2/2 - (q[i] - r)^2/2) - sum(i in 0..n-1, (q[i+1]-q[i])^2/2 + (q[i+1]-q[i])^4/8),
    dissipation = sum(i in 0..n, dot(q[i])^2/20),
    force(q[n-1]) = f*cos(1.4*t),
)]
struct Stretched {
    n: usize,
    r: f64,
    f: f64,
}

/// Where the amplitude of the force is zero, the momenta are rounding errors of no size of their own.
#[test]
fn rounding_errors_of_motions_at_rest_have_no_warning() {
    for (r, elements) in [(0.0, 3), (0.7, 3), (0.7, 10), (0.7, 40), (10.0 / 3.0, 10)] {
        let still = Stretched { n: 6, r, f: 0.0 };
        let orbit = PeriodicOrbit::of(&still)
            .elements(elements)
            .period(TAU / 1.4);
        let orbit = orbit.solve().expect("an orbit");
        assert!(orbit.warnings().is_empty(), "{r} {elements} {orbit}");
    }
}
