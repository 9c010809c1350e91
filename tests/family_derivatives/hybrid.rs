//! Periodic orbits with events of models of run-time length: compared with those of the same model of fixed size.

use crate::events::{apart, bounce};
use crate::lengths::{of_both_lengths, of_heap};
use std::f64::consts::TAU;
use tfe::family::FamilyState;
use tfe::length::{Length, RunTimeLength};
use tfe::periodic::{HybridOrbits, OrbitError, SensitiveOrbit};
use tfe::prelude::*;
use tfe::{HybridOrbit, Model, Occurrence, family};

/// Oscillators coupled by springs, of which the first is driven and hits a wall.
#[dynamics(
    coordinates(x[n]),
    lagrangian = sum(i in 0..n, m/2*dot(x[i])^2 - k/2*x[i]^2) - sum(i in 0..n-1, s/2*(x[i+1] - x[i])^2)
        + f*cos(omega*t)*x[0],
    force(x[i]) = -c*dot(x[i]),
    event(wall) = w - x[0],
)]
struct Row {
    n: usize,
    m: f64,
    k: f64,
    s: f64,
    c: f64,
    f: f64,
    w: f64,
    omega: f64,
}

#[dynamics(
    coordinates(x[2]),
    lagrangian = sum(i in 0..2, m/2*dot(x[i])^2 - k/2*x[i]^2) - s/2*(x[1] - x[0])^2 + f*cos(omega*t)*x[0],
    force(x[i]) = -c*dot(x[i]),
    event(wall) = w - x[0],
)]
struct Pair {
    m: f64,
    k: f64,
    s: f64,
    c: f64,
    f: f64,
    w: f64,
    omega: f64,
}

/// The same oscillators on circles.
#[dynamics(
    coordinates(x[n], y[n]),
    lagrangian = sum(i in 0..n, m/2*(dot(x[i])^2 + dot(y[i])^2) - k/2*x[i]^2)
        - sum(i in 0..n-1, s/2*(x[i+1] - x[i])^2) + f*cos(omega*t)*x[0],
    constraint(circle[i in 0..n]) = x[i]^2 + y[i]^2 - r^2,
    force(x[i]) = -c*dot(x[i]),
    force(y[i]) = -c*dot(y[i]),
    event(wall) = w - x[0],
)]
pub(super) struct OnCircles {
    pub(super) n: usize,
    pub(super) m: f64,
    pub(super) k: f64,
    pub(super) s: f64,
    pub(super) c: f64,
    pub(super) f: f64,
    pub(super) w: f64,
    pub(super) r: f64,
    pub(super) omega: f64,
}

#[dynamics(
    coordinates(x[2], y[2]),
    lagrangian = sum(i in 0..2, m/2*(dot(x[i])^2 + dot(y[i])^2) - k/2*x[i]^2)
        - s/2*(x[1] - x[0])^2 + f*cos(omega*t)*x[0],
    constraint(circle[i in 0..2]) = x[i]^2 + y[i]^2 - r^2,
    force(x[i]) = -c*dot(x[i]),
    force(y[i]) = -c*dot(y[i]),
    event(wall) = w - x[0],
)]
struct PairOnCircles {
    m: f64,
    k: f64,
    s: f64,
    c: f64,
    f: f64,
    w: f64,
    r: f64,
    omega: f64,
}

/// Clocks, of which the first gets an impulse at each swing upwards through the middle.
#[dynamics(
    coordinates(x[n]),
    lagrangian = sum(i in 0..n, m/2*dot(x[i])^2 - k/2*x[i]^2 - b/4*x[i]^4),
    force(x[i]) = -c*dot(x[i]),
    event(middle) = x[0],
)]
struct Clocks {
    n: usize,
    m: f64,
    k: f64,
    b: f64,
    c: f64,
}

#[dynamics(coordinates(x), lagrangian = m/2*dot(x)^2 - k/2*x^2 - b/4*x^4, force(x) = -c*dot(x), event(middle) = x)]
struct Clock {
    m: f64,
    k: f64,
    b: f64,
    c: f64,
}

/// Compares two orbits with their derivatives. Both are solutions of the same equations, to 1e-12 of the state times
/// the condition of the equations.
#[track_caller]
fn check_same<const N: usize>(
    long: &SensitiveOrbit<HybridOrbit<0, RunTimeLength>, 0, RunTimeLength>,
    fixed: &SensitiveOrbit<HybridOrbit<N>, N>,
) {
    let (a, b) = (long.orbit(), fixed.orbit());
    assert!((a.period() - b.period()).abs() <= 1e-10);
    assert_eq!(a.motion().events().len(), b.motion().events().len());
    assert!(!a.motion().events().is_empty());
    let off = [
        apart(&a.start().q, &b.start().q),
        apart(&a.start().p, &b.start().p),
    ];
    assert!(off[0] <= 1e-10 && off[1] <= 1e-10, "{off:?}");
    assert_eq!(a.trivial(), b.trivial());
    assert_eq!(a.multipliers().len(), b.multipliers().len());
    for (a, b) in a.multipliers().iter().zip(b.multipliers()) {
        assert!((a - b).norm() <= 1e-8, "{a} {b}");
    }
    let off = apart(&a.monodromy(), &b.monodromy());
    assert!(off <= 1e-8, "{off:e}");
    assert_eq!(long.parameters(), fixed.parameters());
    for name in long.parameters() {
        let (a, b) = (long.by(name), fixed.by(name));
        assert!((a.period() - b.period()).abs() <= 1e-8, "{name}");
        let off = [
            apart(&a.start().q, &b.start().q),
            apart(&a.start().p, &b.start().p),
        ];
        assert!(off[0] <= 1e-8 && off[1] <= 1e-8, "{name}: {off:?}");
        // Differences, which are given where two orders agree to 1e-7.
        for (a, b) in a.multipliers().iter().zip(b.multipliers()) {
            if let (Some(a), Some(b)) = (a, b) {
                assert!(
                    (a - b).norm() <= 1e-5 * b.norm().max(1.0),
                    "{name}: {a} {b}"
                );
            }
        }
    }
}

/// The frequency of the force.
const OMEGA: f64 = 2.6;

/// Orbits of a driven model of run-time length that hits a wall.
fn long_orbits<'m, M>(model: &'m M, guess: FamilyState) -> HybridOrbits<'m, M, 0, RunTimeLength>
where
    M: family::Model + Send + Sync,
{
    let run: Simulation<'m, M, 0, RunTimeLength> = Simulation::new(model);
    let run = run
        .element(Mixed::<8>)
        .on("wall", Crossing::Falling, bounce);
    PeriodicOrbit::of_simulation(&run)
        .elements(12)
        .start_time(0.9)
        .period(TAU / OMEGA)
        .guess_from(guess)
}

/// The same of a model of fixed size.
fn fixed_orbits<'m, M, const N: usize>(model: &'m M, guess: State<N>) -> HybridOrbits<'m, M, N>
where
    M: Model<N> + Send + Sync,
{
    let run: Simulation<'m, M, N> = Simulation::new(model);
    let run = run
        .element(Mixed::<8>)
        .on("wall", Crossing::Falling, bounce);
    PeriodicOrbit::of_simulation(&run)
        .elements(12)
        .start_time(0.9)
        .period(TAU / OMEGA)
        .guess_from(guess)
}

#[test]
fn orbits_with_impacts_are_those_of_fixed_size() {
    let (m, k, s, c, f, w, omega) = (1.1, 1.2, 0.05, 0.1, 1.0, 0.05, OMEGA);
    let (row, pair) = of_both_lengths!(Row(2), Pair: m, k, s, c, f, w, omega);
    let start = pair.state([-0.08, -0.01], [0.6, 0.0]);
    let ours = long_orbits(&row, of_heap(&start));
    let found = ours.solve_sensitive().expect("an orbit");
    let expected = fixed_orbits(&pair, start).solve_sensitive();
    check_same(&found, &expected.expect("an orbit"));
    assert!(found.by_period().is_some());
    // A row of another length than the model.
    let error = ours.advance(vec![0.0; 3]).solve();
    let told = error
        .map(|orbit| orbit.period())
        .expect_err("three numbers");
    assert!(matches!(told, OrbitError::Run(_)), "{told}");
}

#[test]
fn orbits_with_impacts_and_constraints_are_those_of_fixed_size() {
    let (m, k, s, c, f, w, r, omega) = (1.1, 1.2, 0.05, 0.1, 1.0, 0.05, 5.0, OMEGA);
    let (row, pair) = of_both_lengths!(OnCircles(2), PairOnCircles: m, k, s, c, f, w, r, omega);
    // Near the circles, and not on them.
    let start = pair.state([-0.07, -0.01, -4.99, -5.0], [0.58, 0.0, 0.0, 0.0]);
    let found = long_orbits(&row, of_heap(&start)).solve_sensitive();
    let found = found.expect("an orbit");
    let expected = fixed_orbits(&pair, start).solve_sensitive();
    check_same(&found, &expected.expect("an orbit"));
    assert_eq!(found.orbit().multipliers().len(), 4, "no zeros");
    let residual = found.orbit().motion().constraint_residual();
    assert!(residual.position <= 1e-12, "{residual:?}");
}

#[test]
fn orbits_of_unknown_period_are_those_of_fixed_size() {
    fn kick<const N: usize, L: Length<N>>(event: &Occurrence<'_, N, L>) -> Act<N, L>
    where
        L::Vector: From<[f64; 1]>,
    {
        Act::Impulse([0.5 / (1.0 + event.v.as_ref()[0])].into())
    }
    let (m, k, b, c) = (1.1, 1.2, 0.3, 0.1);
    let (clocks, clock) = of_both_lengths!(Clocks(1), Clock: m, k, b, c);
    let start = clock.state([0.8], [0.1]);
    let run: family::Simulation<'_, Clocks> = Simulation::new(&clocks);
    let run = run.element(Mixed::<8>);
    let run = run.on("middle", Crossing::Rising, kick);
    let beside = Simulation::new(&clock).element(Mixed::<8>);
    let beside = beside.on("middle", Crossing::Rising, kick);
    let ours = PeriodicOrbit::of_simulation(&run)
        .unknown_period(6.0)
        .guess_from(of_heap(&start));
    let theirs = PeriodicOrbit::of_simulation(&beside)
        .unknown_period(6.0)
        .guess_from(start);
    let ours = ours.solve_sensitive().expect("an orbit");
    let theirs = theirs.solve_sensitive().expect("an orbit");
    check_same(&ours, &theirs);
    assert!(ours.by_period().is_none());
    assert_eq!(ours.orbit().trivial().len(), 1);
}
