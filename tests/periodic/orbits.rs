//! Orbits and multipliers compared with `tests/reference/periodic.json` and closed forms.

use crate::common::{case, list, number, numbers};
use crate::models::{
    Blade, FORCED, HenonHeiles, Mathieu, PENDULUM, Shaft, TurningSaddle, VanDerPol, agm, response,
};
use nalgebra::Complex;
use serde_json::Value;
use std::f64::consts::{PI, TAU};
use tfe::periodic::{Orbit, Phase, Verdict};
use tfe::prelude::*;

/// Reference multipliers: that of largest modulus first, and of a pair the one with positive imaginary part.
fn expected(case: &Value) -> Vec<Complex<f64>> {
    let multipliers = list(&case["multipliers"]).iter();
    let mut multipliers: Vec<_> = multipliers
        .map(|m| Complex::new(number(&m["re"]), number(&m["im"])))
        .collect();
    multipliers.sort_by(|a, b| b.norm().total_cmp(&a.norm()).then(b.im.total_cmp(&a.im)));
    multipliers
}

#[track_caller]
fn assert_multipliers<M: Model<N>, const N: usize>(
    orbit: &Orbit<'_, M, N>,
    expected: &[Complex<f64>],
    tolerance: f64,
) {
    assert_eq!(orbit.multipliers().len(), expected.len());
    for (actual, expected) in orbit.multipliers().iter().zip(expected) {
        let error = (actual - expected).norm() / expected.norm();
        assert!(
            error <= tolerance,
            "{actual} instead of {expected}: {error:.1e}"
        );
    }
}

#[track_caller]
fn assert_relative(actual: f64, expected: f64, tolerance: f64) {
    let error = (actual / expected - 1.0).abs();
    assert!(
        error <= tolerance,
        "{actual} instead of {expected}: {error:.1e}"
    );
}

/// The limit cycle, with the circle of the linear oscillator as guess.
fn limit_cycle(model: &VanDerPol, element: Element, elements: usize) -> Orbit<'_, VanDerPol, 1> {
    PeriodicOrbit::of(model)
        .element(element)
        .elements(elements)
        .unknown_period(6.3)
        .phase(Phase::Momentum {
            index: 0,
            value: 0.0,
        })
        .guess(|t| ([2.0 * t.cos()], [-2.0 * t.sin()]))
        .solve()
        .expect("a limit cycle")
}

#[test]
fn van_der_pol() {
    let case = case("periodic", "van_der_pol_mu1");
    let model = VanDerPol::unit(1.0);
    for (element, elements) in [
        (Element::mixed(8), 40),
        (Element::primal(8), 40),
        (Element::energy_conserving(8), 40),
        (Element::radau(9), 60),
    ] {
        let orbit = limit_cycle(&model, element, elements);
        assert_relative(orbit.period(), number(&case["period"]), 1e-13);
        assert_relative(orbit.start().q[0], numbers(&case["initial"])[0], 1e-13);
        assert_relative(orbit.multipliers()[1].re, 8.596_950_636_038_052e-4, 1e-11);
        assert_multipliers(&orbit, &expected(&case), 1e-11);
        assert_eq!(orbit.trivial(), [0]);
        assert!(
            matches!(orbit.verdict(), Verdict::Stable { margin } if (margin - 0.99914).abs() < 1e-5)
        );
        assert_eq!(orbit.unfolding(), None);
    }
}

#[test]
fn the_phase_is_that_of_the_guess_unless_one_is_chosen() {
    let model = VanDerPol::unit(1.0);
    let chosen = limit_cycle(&model, Element::mixed(6), 60);
    let start = chosen.start();
    let free = PeriodicOrbit::of(&model)
        .element(Mixed::<6>)
        .elements(60)
        .unknown_period(6.3)
        .guess(|t| ([2.0 * t.cos()], [-2.0 * t.sin()]))
        .solve()
        .expect("a limit cycle");
    assert_relative(free.period(), chosen.period(), 1e-12);
    assert_relative(free.multipliers()[1].re, chosen.multipliers()[1].re, 1e-9);
    // The phase is slightly different, but the curve is the same.
    assert!((free.start().q[0] - start.q[0]).abs() < 0.5);
    let by_coordinate = PeriodicOrbit::of(&model)
        .element(Mixed::<6>)
        .elements(60)
        .unknown_period(6.3)
        .phase(Phase::Coordinate {
            index: 0,
            value: 0.0,
        })
        .guess(|t| ([-2.0 * t.sin()], [-2.0 * t.cos()]))
        .solve()
        .expect("a limit cycle");
    assert!(by_coordinate.start().q[0].abs() < 1e-15);
    assert_relative(by_coordinate.period(), chosen.period(), 1e-12);
}

#[test]
fn forced_duffing() {
    let case = case("periodic", "duffing_forced");
    let model = FORCED;
    let orbit = PeriodicOrbit::of(&model)
        .element(Mixed::<8>)
        .elements(24)
        .period(TAU / 1.4)
        .guess(response)
        .solve()
        .expect("an orbit");
    let initial = numbers(&case["initial"]);
    assert_relative(orbit.start().q[0], initial[0], 1e-13);
    assert_relative(orbit.start().p[0], initial[1], 1e-13);
    assert_multipliers(&orbit, &expected(&case), 1e-12);
    assert!(orbit.is_stable() && orbit.trivial().is_empty());
    let text = orbit.to_string();
    assert!(
        text.starts_with("periodic orbit: T = 4.4879895051, 24 elements"),
        "{text}"
    );
    assert!(
        text.contains("μ = 6.6539330e-2 − 6.3491730e-1 i")
            && text.ends_with("stable, margin 3.6e-1"),
        "{text}"
    );
    // e^{−δT} is the product of both.
    let exponents = orbit.exponents();
    assert!((exponents[0].growth + 0.1).abs() < 1e-13);
    assert!(
        (exponents[0].damping_ratio() - 0.1 / 0.1_f64.hypot(exponents[0].frequency)).abs() < 1e-12
    );
}

#[test]
fn flapping_blades() {
    for (name, blade) in [
        (
            "flapping_mu0.3",
            Blade {
                lock: 8.0,
                nu2: 1.0,
                mu: 0.3,
                th0: 0.1,
                lam: 0.05,
            },
        ),
        (
            "flapping_mu0.5",
            Blade {
                lock: 12.0,
                nu2: 1.2,
                mu: 0.5,
                th0: 0.1,
                lam: 0.02,
            },
        ),
    ] {
        let case = case("periodic", name);
        let orbit = PeriodicOrbit::of(&blade)
            .element(Mixed::<8>)
            .elements(32)
            .period(TAU)
            .solve()
            .expect("the response");
        let initial = numbers(&case["initial"]);
        assert_relative(orbit.start().q[0], initial[0], 1e-12);
        assert_relative(orbit.start().p[0], initial[1], 1e-12);
        assert_multipliers(&orbit, &expected(&case), 1e-11);
        // A linear model is solved at once; the second iteration confirms it.
        assert!(orbit.statistics().newton_iterations <= 3);
    }
}

#[test]
fn mathieu() {
    for (name, a) in [("mathieu_a1_q0.5", 1.0), ("mathieu_a2_q0.5", 2.0)] {
        let model = Mathieu { a, q: 0.5 };
        let orbit = PeriodicOrbit::of(&model)
            .element(Mixed::<8>)
            .elements(16)
            .period(PI)
            .solve()
            .expect("the zero solution");
        assert_eq!(orbit.start(), model.state([0.0], [0.0]));
        assert_multipliers(&orbit, &expected(&case("periodic", name)), 1e-12);
        assert_eq!(orbit.is_stable(), a == 2.0);
        assert!(stability::symplecticity_defect(&orbit.monodromy()) < 1e-12);
    }
}

/// The multipliers −e^{sT} with s⁴ + s²(2Ω² + ω1² + ω2²) + (ω1² − Ω²)(ω2² − Ω²) = 0.
fn shaft_multipliers(w1: f64, w2: f64, omega: f64) -> Vec<Complex<f64>> {
    let half = omega * omega + 0.5 * (w1 * w1 + w2 * w2);
    let product = (w1 * w1 - omega * omega) * (w2 * w2 - omega * omega);
    let root = Complex::new(half * half - product, 0.0).sqrt();
    let mut multipliers = Vec::new();
    for square in [-half + root, -half - root] {
        for s in [square.sqrt(), -square.sqrt()] {
            multipliers.push(-(s * (PI / omega)).exp());
        }
    }
    multipliers
}

#[test]
fn the_anisotropic_shaft_at_five_speeds() {
    for omega in [0.5, 0.9, 1.05, 1.1, 1.7] {
        let shaft = Shaft {
            w1: 1.0,
            w2: 1.2,
            omega,
        };
        let orbit = PeriodicOrbit::of(&shaft)
            .element(Mixed::<8>)
            .elements(40)
            .period(PI / omega)
            .solve()
            .expect("rest");
        let expected = shaft_multipliers(1.0, 1.2, omega);
        for multiplier in orbit.multipliers() {
            let error = expected
                .iter()
                .map(|e| (e - multiplier).norm())
                .fold(f64::INFINITY, f64::min);
            assert!(
                error < 1e-11,
                "Ω = {omega}: {multiplier} is off by {error:.1e}"
            );
        }
        for value in &expected {
            let multipliers = orbit.multipliers().iter();
            let error = multipliers
                .map(|m| (m - value).norm())
                .fold(f64::INFINITY, f64::min);
            assert!(
                error < 1e-11,
                "Ω = {omega}: {value} is missing, {error:.1e}"
            );
        }
        assert_eq!(orbit.is_stable(), !(1.0 < omega && omega < 1.2));
        if omega == 1.1 {
            assert!((orbit.multipliers()[0].norm() - 1.328_999_52).abs() < 1e-8);
        }
    }
}

#[test]
fn tiny_and_huge_multipliers_in_one_orbit() {
    // e^{±2πa} and e^{−2πc}: 6e15 … 2e−16, and the modulus 8e−14.
    let model = TurningSaddle {
        a: 5.8,
        c: 4.8,
        w: 0.3,
    };
    let orbit = PeriodicOrbit::of(&model)
        .element(Mixed::<8>)
        .elements(120)
        .period(TAU)
        .solve()
        .expect("rest");
    let multipliers = orbit.multipliers();
    assert!(multipliers[0].norm() > 1e12 && multipliers[3].norm() < 1e-12);
    let expected = [TAU * 5.8, -TAU * 4.8, -TAU * 4.8, -TAU * 5.8];
    for (floquet, expected) in orbit.floquet().iter().zip(expected) {
        // The absolute error of the logarithm is the relative error of the modulus.
        let error = (floquet.log_modulus - expected).abs();
        assert!(error < 1e-9, "e^{expected}: relative error {error:.1e}");
    }
    // The product of the matrices determines the largest one only.
    let product = stability::eigenvalues(&orbit.monodromy()).expect("eigenvalues");
    let smallest = product
        .iter()
        .map(|value| value.norm())
        .fold(f64::INFINITY, f64::min);
    assert!((smallest / expected[3].exp() - 1.0).abs() > 0.5);
}

/// 4 K(k), by the arithmetic–geometric mean.
fn pendulum_period(amplitude: f64) -> f64 {
    TAU / agm(1.0, (amplitude / 2.0).cos())
}

#[test]
fn conservative_orbits_by_energy_and_by_period() {
    let pendulum = PENDULUM;
    for amplitude in [0.5_f64, 2.0, 3.0] {
        let period = pendulum_period(amplitude);
        let guess = move |t: f64| {
            let (s, c) = (TAU / period * t).sin_cos();
            ([amplitude * c], [-amplitude * s * TAU / period])
        };
        let problem = || {
            PeriodicOrbit::of(&pendulum)
                .element(Mixed::<8>)
                .elements(60)
        };
        let by_energy = problem()
            .unknown_period(0.97 * period)
            .energy(-amplitude.cos())
            .guess_from(pendulum.state([amplitude], [0.0]))
            .solve()
            .expect("a swing of this energy");
        assert_relative(by_energy.period(), period, 1e-11);
        let by_period = problem()
            .period(period)
            .guess(guess)
            .solve()
            .expect("a swing of this period");
        let energy = by_period.motion().energies()[0];
        assert!((energy + amplitude.cos()).abs() < 1e-10 * period);
        for orbit in [&by_energy, &by_period] {
            assert!(
                orbit
                    .unfolding()
                    .is_some_and(|unfolding| unfolding.abs() < 1e-12)
            );
            assert_eq!(orbit.trivial(), [0, 1]);
            // A defective pair: accurate to the square root.
            assert!(orbit.multipliers().iter().all(|m| (m - 1.0).norm() < 1e-4));
            assert!(orbit.is_stable());
        }
    }
}

#[test]
fn an_angle_that_turns() {
    let pendulum = PENDULUM;
    // p²/2 − cos θ = 2: T = ∫ dθ / √(2(2 + cos θ)); the trapezoidal rule converges geometrically.
    let points = 64;
    let sum: f64 = (0..points)
        .map(|k| 1.0 / (2.0 * (2.0 + (TAU * f64::from(k) / f64::from(points)).cos())).sqrt())
        .sum();
    let period = TAU * sum / f64::from(points);
    let orbit = PeriodicOrbit::of(&pendulum)
        .element(Mixed::<8>)
        .elements(30)
        .unknown_period(3.0)
        .energy(2.0)
        .advance([TAU])
        .solve()
        .expect("a turning pendulum");
    assert_relative(orbit.period(), period, 1e-12);
    assert!((orbit.motion().last().q[0] - orbit.start().q[0] - TAU).abs() < 1e-13);
}

#[test]
fn a_hamiltonian_orbit_with_an_elliptic_neighbourhood() {
    // A symmetric orbit of the Hénon–Heiles system on the axis x = 0 with E = 1/12; the variation in x obeys a Hill
    // equation.
    let model = HenonHeiles { a: 1.0 };
    let orbit = PeriodicOrbit::of(&model)
        .element(Mixed::<8>)
        .elements(40)
        .unknown_period(6.6)
        .energy(1.0 / 12.0)
        .guess(|t| ([0.0, 0.4 * t.sin()], [0.0, 0.4 * t.cos()]))
        .solve()
        .expect("an orbit on the axis");
    // The variation in x is decoupled; its multipliers are those of a Hill equation with the motion of y.
    let y = orbit.motion();
    let hill = Hill { motion: &y };
    let trace = hill.trace(orbit.period());
    let others: Vec<_> = (0..4).filter(|k| !orbit.trivial().contains(k)).collect();
    let sum = orbit.multipliers()[others[0]] + orbit.multipliers()[others[1]];
    assert!(
        (sum.re - trace).abs() < 1e-8 && sum.im.abs() < 1e-12,
        "{sum} instead of {trace}"
    );
    assert!(orbit.is_stable());
    let product: Complex<f64> = orbit.multipliers().iter().product();
    assert!((product - 1.0).norm() < 1e-10);
}

/// The Hill equation ξ̈ = −(1 + 2y(t)) ξ along a motion of the Hénon–Heiles system on the axis x = 0.
struct Hill<'a> {
    motion: &'a Motion<2>,
}

impl Hill<'_> {
    /// The trace of the monodromy matrix, by the classical Runge–Kutta method with 8000 steps.
    fn trace(&self, period: f64) -> f64 {
        let steps = 8000;
        let h = period / f64::from(steps);
        let rate = |t: f64, [x, v]: [f64; 2]| {
            let y = self.motion.at(t.min(period)).expect("within the period").q[1];
            [v, -(1.0 + 2.0 * y) * x]
        };
        let mut trace = 0.0;
        for column in 0..2 {
            let mut state = [0.0; 2];
            state[column] = 1.0;
            for k in 0..steps {
                let t = f64::from(k) * h;
                let moved =
                    |rate: [f64; 2], h: f64| [state[0] + h * rate[0], state[1] + h * rate[1]];
                let a = rate(t, state);
                let b = rate(t + h / 2.0, moved(a, h / 2.0));
                let c = rate(t + h / 2.0, moved(b, h / 2.0));
                let d = rate(t + h, moved(c, h));
                for i in 0..2 {
                    state[i] += h / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]);
                }
            }
            trace += state[column];
        }
        trace
    }
}

/// One or two elements of high degree: here too, the phase remains that of the guess.
#[test]
fn one_element_or_two_over_a_period() {
    let model = VanDerPol::unit(0.2);
    let many = limit_cycle(&model, Element::mixed(8), 40);
    // With 11 Gauss points each, the periods are 6.300093 and 6.298876885.
    for (elements, tolerance) in [(1, 4e-4), (2, 1e-7)] {
        for phase in [
            Phase::Orthogonal,
            Phase::Momentum {
                index: 0,
                value: 0.0,
            },
        ] {
            let few = PeriodicOrbit::of(&model)
                .element(Mixed::<12>)
                .elements(elements)
                .unknown_period(6.3)
                .phase(phase)
                .guess(|t| ([2.0 * t.cos()], [-2.0 * t.sin()]))
                .solve()
                .expect("a limit cycle");
            assert_relative(few.period(), many.period(), tolerance);
            assert_eq!(few.trivial(), [0]);
        }
    }
    let pendulum = PENDULUM;
    let amplitude = 0.5_f64;
    let period = pendulum_period(amplitude);
    let guess = move |t: f64| {
        let (s, c) = (TAU / period * t).sin_cos();
        ([amplitude * c], [-amplitude * s * TAU / period])
    };
    for (elements, tolerance) in [(1, 1e-4), (2, 1e-8)] {
        let few = || {
            PeriodicOrbit::of(&pendulum)
                .element(Mixed::<12>)
                .elements(elements)
                .guess(guess)
        };
        let by_period = few().period(period).solve().expect("a swing");
        assert_relative(by_period.start().q[0], amplitude, tolerance);
        let by_energy = few()
            .unknown_period(0.99 * period)
            .energy(-amplitude.cos())
            .solve()
            .expect("a swing");
        assert_relative(by_energy.period(), period, tolerance);
    }
}

#[test]
fn graded_elements_serve_a_relaxation_oscillation() {
    let model = VanDerPol::unit(10.0);
    let start = Simulation::new(&model)
        .element(Mixed::<6>)
        .step(0.01)
        .run(model.state([2.0], [0.0]), 0.0..19.08)
        .expect("a run")
        .last()
        .state();
    let solve = |weights: Vec<f64>| {
        PeriodicOrbit::of(&model)
            .element(Mixed::<6>)
            .graded(weights)
            .unknown_period(19.08)
            .guess_from(start)
            .solve()
    };
    let fine = solve(vec![1.0; 2000]).expect("a limit cycle");
    // Elements with lengths proportional to the inverse speed of the accurate solution.
    let weights = fine.equidistributed(120);
    let graded = solve(weights).expect("a limit cycle");
    assert_relative(graded.period(), fine.period(), 1e-7);
    println!(
        "{:.15e} {:.3e}",
        fine.period(),
        graded.period() / fine.period() - 1.0
    );
    // The same number of equal elements has a large error, if it converges at all.
    let equal = solve(vec![1.0; 120]);
    if let Ok(equal) = equal {
        let error = (equal.period() / fine.period() - 1.0).abs();
        assert!(
            error > 100.0 * (graded.period() / fine.period() - 1.0).abs(),
            "{error:e}"
        );
    }
}

#[test]
fn the_motion_of_an_orbit_is_the_stepped_one() {
    let model = FORCED;
    for element in [
        Element::mixed(4),
        Element::primal(4),
        Element::radau(4),
        Element::energy_conserving(4),
    ] {
        let orbit = PeriodicOrbit::of(&model)
            .element(element)
            .elements(20)
            .period(TAU / 1.4)
            .guess(response)
            .solve()
            .expect("an orbit");
        let stepped = Simulation::new(&model)
            .element(element)
            .step(orbit.period() / 20.0)
            .run(orbit.start(), 0.0..orbit.period())
            .expect("a run");
        let motion = orbit.motion();
        assert_eq!(motion.states().len(), 21);
        for (orbit, stepped) in motion.states().iter().zip(stepped.states()) {
            assert!((orbit.q[0] - stepped.q[0]).abs() < 1e-13);
            assert!((orbit.p[0] - stepped.p[0]).abs() < 1e-13);
        }
        for k in 0..50 {
            let t = orbit.period() * (f64::from(k) + 0.5) / 50.0;
            let (a, b) = (
                motion.at(t).expect("inside"),
                stepped.at(t).expect("inside"),
            );
            assert!((a.q[0] - b.q[0]).abs() < 1e-13 && (a.p[0] - b.p[0]).abs() < 1e-13);
        }
    }
}

/// An equilibrium has no multiplier equal to one, although the model does not depend on time.
#[test]
fn a_saddle_of_a_simulation_is_unstable() {
    #[dynamics(coordinates(x), lagrangian = dot(x)^2/2 + x^2/2, force(x) = -3*dot(x))]
    struct Saddle {}
    let saddle = Saddle {};
    let orbit = PeriodicOrbit::of_simulation(&Simulation::new(&saddle))
        .period(1.0)
        .solve()
        .expect("rest");
    let rate = (13.0_f64.sqrt() - 3.0) / 2.0;
    // Order six with 40 elements.
    assert!((orbit.multipliers()[0].re - rate.exp()).abs() < 1e-9);
    assert!(!orbit.is_stable() && orbit.trivial().is_empty());
}
