//! Trajectories in lanes do what they do alone, and nothing about the others beside them.

use crate::common::{DuffingL, PendulumH, PendulumL};
use tfe_runtime::bundle::Bundle;
use tfe_runtime::step::{Control, Stepper};
use tfe_runtime::{
    Element, Lanes, Mixed, Model, Primal, Radau, Real, Solve, State, Statistics, StepError,
};

const STEP: f64 = 0.1;

fn alone<M: Model<N>, const N: usize>(
    model: &M,
    element: Element,
    start: &State<N>,
    steps: usize,
) -> Result<(State<N>, Statistics), StepError> {
    let mut stepper =
        Stepper::new(model, element, Control::default()).expect("the element is good");
    let mut state = *start;
    for step in 0..steps {
        stepper.advance(step as f64 * STEP, STEP, &mut state, &[])?;
    }
    Ok((state, *stepper.statistics()))
}

fn together<M: Model<N>, const N: usize, const W: usize>(
    model: &M,
    element: Element,
    starts: &[State<N>],
    steps: usize,
) -> (Vec<Result<State<N>, StepError>>, Statistics) {
    let mut bundle =
        Bundle::<M, N, W>::new(model, element, Control::default()).expect("the element is good");
    let mut ends = Vec::new();
    for starts in starts.chunks(W) {
        bundle.start(starts);
        for step in 0..steps {
            bundle.advance(step as f64 * STEP, STEP);
        }
        ends.extend((0..starts.len()).map(|lane| bundle.state(lane)));
    }
    (ends, bundle.statistics())
}

/// The largest difference of two states beside the larger one of the components.
fn difference<const N: usize>(a: &State<N>, b: &State<N>) -> f64 {
    let (mut worst, mut scale) = (0.0_f64, 0.0_f64);
    for (x, y) in a.q.iter().chain(&a.p).zip(b.q.iter().chain(&b.p)) {
        assert!(!x.is_nan() && !y.is_nan(), "{a:?} {b:?}");
        worst = worst.max((x - y).abs());
        scale = scale.max(y.abs());
    }
    worst / scale
}

#[track_caller]
fn agree<M: Model<N>, const N: usize>(model: &M, element: Element, starts: &[State<N>]) {
    assert!(Bundle::<M, N, 4>::uses_lanes(&element, &Control::default()));
    let (ends, statistics) = together::<M, N, 4>(model, element, starts, 200);
    let mut expected_statistics = Statistics::default();
    for (start, end) in starts.iter().zip(&ends) {
        let (expected, cost) = alone(model, element, start, 200).expect("a regular motion");
        expected_statistics.merge(&cost);
        let end = end.as_ref().expect("a regular motion");
        // Roundings of 200 steps, magnified by nothing: these motions are regular.
        let error = difference(end, &expected);
        assert!(error <= 1e-13, "{element}: {error:.1e}");
    }
    assert_eq!(statistics.steps, expected_statistics.steps);
    // The same iteration, but for when mass matrices are evaluated and for sines, which may differ by a unit in the last place.
    let ratio = statistics.iterations as f64 / expected_statistics.iterations as f64;
    assert!((0.95..1.1).contains(&ratio), "{element}: {ratio}");
    assert_eq!(statistics.fallbacks, 0);
}

fn pendulums(count: usize) -> Vec<State<1>> {
    let angle = |k: usize| 0.05 + 2.4 * k as f64 / count as f64;
    (0..count)
        .map(|k| State {
            q: [angle(k)],
            p: [0.1],
        })
        .collect()
}

#[test]
fn lagrangian_in_lanes() {
    // Ten starts: the last bundle is not full.
    for element in [
        Element::from(Mixed::<2>),
        Mixed::<6>.into(),
        Radau::<4>.into(),
        Primal::<4>.reduced(),
        Primal::<3>.into(),
        Primal::<6>.lobatto(),
        Element::energy_conserving(8),
    ] {
        agree(&PendulumL {}, element, &pendulums(10));
    }
}

#[test]
fn hamiltonian_in_lanes() {
    for element in [
        Element::from(Mixed::<3>),
        Mixed::<6>.into(),
        Primal::<4>.into(),
    ] {
        agree(&PendulumH {}, element, &pendulums(10));
    }
}

#[test]
fn time_and_position_dependent_masses_in_lanes() {
    for element in [
        Element::from(Mixed::<5>),
        Primal::<4>.into(),
        Primal::<9>.lobatto(),
    ] {
        agree(&DuffingL { d: 0.1 }, element, &pendulums(7));
    }
}

#[test]
fn neighbours_and_order_change_no_bit() {
    let starts = pendulums(11);
    let model = DuffingL { d: 0.1 };
    let (expected, _) = together::<_, 1, 4>(&model, Mixed::<4>.into(), &starts, 100);
    let backwards: Vec<_> = starts.iter().rev().copied().collect();
    let (mut ends, _) = together::<_, 1, 8>(&model, Mixed::<4>.into(), &backwards, 100);
    ends.reverse();
    assert_eq!(ends, expected);
}

#[test]
fn what_has_no_lanes_runs_one_by_one() {
    let control = Control::default();
    // More than sixteen points.
    for element in [
        Element::energy_conserving(9),
        Element::primal(3).quadrature(32),
    ] {
        assert!(!Bundle::<PendulumL, 1, 4>::uses_lanes(&element, &control));
        let starts = pendulums(5);
        let (ends, _) = together::<_, 1, 4>(&PendulumL {}, element, &starts, 50);
        for (start, end) in starts.iter().zip(&ends) {
            let expected = alone(&PendulumL {}, element, start, 50).map(|(state, _)| state);
            assert_eq!(*end, expected);
        }
    }
    let newton = Control {
        solve: Solve::Newton,
        ..control
    };
    let element = Element::from(Mixed::<3>);
    assert!(!Bundle::<PendulumL, 1, 4>::uses_lanes(&element, &newton));
}

#[test]
fn a_step_that_is_none_fails_all_and_moves_nothing() {
    let starts = pendulums(3);
    let mut bundle = Bundle::<_, 1, 4>::new(&PendulumL {}, Mixed::<3>.into(), Control::default())
        .expect("the element is good");
    bundle.start(&starts);
    assert!(bundle.advance(0.0, f64::NAN));
    for lane in 0..3 {
        let state = bundle.state(lane);
        assert!(matches!(state, Err(StepError::InvalidStep { .. })));
    }
    // A lane without a trajectory, and one that does not exist.
    assert!(bundle.state(3).is_err() && bundle.state(9).is_err());
}

#[test]
fn a_start_that_is_not_finite_fails_alone() {
    let mut starts = pendulums(4);
    starts[0].q[0] = f64::NAN;
    let (ends, _) = together::<_, 1, 4>(&PendulumL {}, Mixed::<4>.into(), &starts, 100);
    assert_eq!(ends[0], Err(StepError::NonFinite));
    let (all, _) = together::<_, 1, 4>(&PendulumL {}, Mixed::<4>.into(), &starts[1..], 100);
    assert_eq!(ends[1..], all);
}

/// Steps between two numbers in the order of all numbers.
fn units(a: f64, b: f64) -> u64 {
    let place = |x: f64| {
        let bits = x.to_bits() as i64;
        if bits < 0 { i64::MIN - bits } else { bits }
    };
    place(a).abs_diff(place(b))
}

#[test]
fn sines_of_lanes_are_those_of_numbers() {
    let mut worst = 0;
    let mut different = 0_u32;
    let mut count = 0_u32;
    let mut check = |x: f64| {
        let (sin, cos) = Lanes([x, -x, 0.5 * x, 1.0]).sin_cos();
        for (lane, x) in [x, -x, 0.5 * x].into_iter().enumerate() {
            let error = units(sin.0[lane], x.sin()).max(units(cos.0[lane], x.cos()));
            different += u32::from(error > 0);
            count += 1;
            worst = worst.max(error);
        }
    };
    // Everywhere that is reduced in lanes, by a step that repeats nothing.
    for k in 0..400_000 {
        check(f64::from(k) * 0.249_999_373_1);
    }
    for k in 0..200_000 {
        check(f64::from(k) * 1.618_033_988e-5);
    }
    // Zeros of both, where all digits of the argument cancel.
    for k in 0..60_000 {
        let zero = f64::from(k) * core::f64::consts::FRAC_PI_2;
        check(zero);
        check(zero.next_up());
    }
    // Both functions are good to less than a unit, so that they differ by one at most; seldom by that.
    assert!(worst <= 1, "{worst} units in the last place");
    assert!(different < count / 5, "{different} of {count}");
    println!("{worst} units at most, {different} of {count} arguments differ");
}

#[test]
fn large_and_strange_arguments_are_those_of_numbers() {
    let x = Lanes([1e5 + 1.0, -1e300, f64::INFINITY, -0.0]);
    let (sin, cos) = x.sin_cos();
    for lane in [0, 1, 3] {
        assert_eq!(sin.0[lane].to_bits(), x.0[lane].sin().to_bits());
        assert_eq!(cos.0[lane].to_bits(), x.0[lane].cos().to_bits());
    }
    assert!(sin.0[2].is_nan() && cos.0[2].is_nan());
    let (sin, cos) = Lanes([f64::NAN, 1.0]).sin_cos();
    assert!(sin.0[0].is_nan() && cos.0[0].is_nan());
    assert!(units(sin.0[1], 1.0_f64.sin()) <= 1);
}
