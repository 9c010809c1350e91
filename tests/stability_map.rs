//! Maps of Floquet multipliers compared with tabulated ones: Mathieu's equation.

mod common;

use common::{larger, list, number, reference, word};
use nalgebra::DMatrix;
use serde_json::Value;
use std::f64::consts::PI;
use tfe::prelude::*;
use tfe::stability::{FloquetError, MapError, PointError, StabilityMap, TransitionError};

/// Mathieu's equation y'' + (a − 2q cos 2t) y = 0.
#[dynamics(coordinates(y), lagrangian = dot(y)^2/2 - (a - 2*q*cos(2*t))*y^2/2)]
struct Mathieu {
    a: f64,
    q: f64,
}

/// The cases of the table whose names have this prefix.
fn cases(table: &Value, prefix: &str) -> Vec<Value> {
    let cases: Vec<_> = list(&table["cases"])
        .iter()
        .filter(|case| word(&case["name"]).starts_with(prefix))
        .cloned()
        .collect();
    assert!(!cases.is_empty(), "no case {prefix}");
    cases
}

/// A map of a single cell centred at the point.
fn radius(a: f64, q: f64, element: Element, elements: usize) -> f64 {
    let around = |x: f64| x - 0.5..x + 0.5;
    let map = StabilityMap::over(around(a), around(q))
        .resolution(1, 1)
        .floquet(|a, q| Mathieu { a, q }, PI, element, elements)
        .unwrap();
    map.value(0, 0).unwrap()
}

/// The trace of the transition matrix Φ over the period π.
fn trace(a: f64, q: f64, element: Element, elements: usize) -> Result<f64, TransitionError> {
    let model = Mathieu { a, q };
    let rest = model.state([0.0], [0.0]);
    let h = PI / elements as f64;
    let mut product = DMatrix::identity(2, 2);
    for k in 0..elements {
        let factor = stability::transition_matrix(&model, element, &rest, k as f64 * h, h)?;
        product = factor * product;
    }
    Ok(product.trace())
}

#[test]
fn multipliers_are_those_of_the_table() {
    let table = reference("periodic");
    for case in cases(&table, "mathieu_a") {
        let (a, q) = (number(&case["a"]), number(&case["q"]));
        let expected = list(&case["multipliers"])
            .iter()
            .map(|value| number(&value["re"]).hypot(number(&value["im"])))
            .fold(0.0, larger);
        // The tolerances are twice the measured errors, 1.5e-11 and 2.1e-14. In the stable case the modulus is one,
        // even if the phase has an error.
        for (element, tolerance) in [(Mixed::<5>.element(), 3e-11), (Mixed::<6>.element(), 5e-14)] {
            let error = (radius(a, q, element, 16) - expected).abs() / expected;
            println!("{element}, a = {a}, q = {q}: {error:.1e}");
            assert!(
                error < tolerance,
                "{element}, a = {a}, q = {q}: {error:.1e}"
            );
        }
    }
}

/// The root of f(a) = |tr Φ| − 2 by bisection between ends with different signs.
fn boundary(mut low: f64, mut high: f64, f: impl Fn(f64) -> f64) -> f64 {
    let sign = f(low) > 0.0;
    assert_ne!(sign, f(high) > 0.0, "no boundary from {low} to {high}");
    for _ in 0..45 {
        let middle = f64::midpoint(low, high);
        if (f(middle) > 0.0) == sign {
            low = middle;
        } else {
            high = middle;
        }
    }
    f64::midpoint(low, high)
}

/// The largest distance of a boundary of stability from a characteristic value below `below_a`, leaving out boundaries
/// that the trace cannot resolve.
fn largest_error(element: Element, elements: usize, below_a: f64) -> f64 {
    let table = reference("periodic");
    let (mut largest, mut compared): (f64, usize) = (0.0, 0);
    for case in cases(&table, "mathieu_characteristic") {
        let q = number(&case["q"]);
        let mut values: Vec<(String, f64)> = case["values"]
            .as_object()
            .unwrap()
            .iter()
            .map(|(name, value)| (name.clone(), number(value)))
            .collect();
        values.sort_by(|x, y| x.1.total_cmp(&y.1));
        // The other boundary of the gap above the last one is not in the table.
        for k in 0..values.len() - 1 {
            let (name, value) = &values[k];
            // Half way to the neighbouring boundaries: there is no other change of sign in between.
            let below = k.checked_sub(1).map_or(1.0, |k| value - values[k].1);
            let room = 0.5 * below.min(values[k + 1].1 - value).min(1.0);
            // Across a gap of width w, |tr Φ| − 2 is of the size w². In narrower gaps than this, rounding errors of the
            // trace exceed the effect of a change of a by 1e-6.
            if room < 1e-4 || *value > below_a {
                continue;
            }
            let f = |a: f64| trace(a, q, element, elements).unwrap().abs() - 2.0;
            let error = (boundary(value - room, value + room, f) - value).abs();
            println!("{element} q = {q}, {name}: {error:.1e}");
            largest = larger(largest, error);
            compared += 1;
        }
    }
    assert!(compared > 5, "{compared}");
    largest
}

#[test]
fn boundaries_are_characteristic_values() {
    // The order is 2n − 2 for n nodes. The largest error is that of the highest boundary, a₅ = 25.5, where a step of
    // π/16 turns the oscillator by one radian. Measured: 3.5e-6, 1.4e-8 and, with half the step, 1.4e-8.
    let five = largest_error(Mixed::<5>.element(), 16, 30.0);
    assert!(five < 4e-6, "{five:.1e}");
    let half = largest_error(Mixed::<5>.element(), 32, 30.0);
    assert!((7.5..8.5).contains(&(five / half).log2()), "{half:.1e}");
    let six = largest_error(Mixed::<6>.element(), 16, 30.0);
    assert!(six < 2e-8, "{six:.1e}");
    // The boundaries below a = 20, as in the usual diagram: measured 8.5e-7.
    let lower = largest_error(Mixed::<5>.element(), 16, 20.0);
    assert!(lower < 1e-6, "{lower:.1e}");
}

#[test]
fn the_map_knows_the_tongues() {
    let map = StabilityMap::over(-1.0..5.0, 0.0..2.0)
        .resolution(120, 40)
        .floquet(|a, q| Mathieu { a, q }, PI, Mixed::<5>, 16)
        .unwrap();
    assert_eq!((map.failed(), map.first_failure()), (0, None));
    let table = reference("periodic");
    for case in cases(&table, "mathieu_characteristic_q1") {
        let value = |name: &str| number(&case["values"][name]);
        let row = (0..40).find(|j| map.y(*j) > 1.0).unwrap();
        for column in 0..120 {
            // The row is at q = 1.025. Cells further from the boundaries at q = 1 than the boundaries move between both
            // values are compared.
            let a = map.x(column);
            let boundaries = ["a0", "b1", "a1", "b2", "a2"].map(value);
            if boundaries.iter().any(|boundary| (a - boundary).abs() < 0.1) {
                continue;
            }
            // Unstable below the first boundary, and with a change at each one.
            let passed = boundaries.iter().filter(|boundary| **boundary < a).count();
            let is_unstable = map.value(column, row).unwrap() > 1.0 + 1e-6;
            assert_eq!(is_unstable, passed % 2 == 0, "a = {a}");
        }
    }
    // In stable cells the modulus is one up to rounding errors of the product, or their square root close to a
    // boundary.
    let stable = (0..120)
        .filter_map(|i| map.value(i, 0))
        .filter(|value| *value < 1.0 + 1e-6);
    assert!(stable.clone().count() > 80);
    assert!(stable.into_iter().all(|value| (value - 1.0).abs() < 1e-7));
}

/// Two uncoupled Mathieu oscillators: the larger multiplier counts.
#[dynamics(
    coordinates(x, y),
    lagrangian = dot(x)^2/2 + dot(y)^2/2 - (a - 2*q*cos(2*t))*x^2/2 - b*y^2/2
)]
struct Two {
    a: f64,
    b: f64,
    q: f64,
}

#[test]
fn more_coordinates_have_more_multipliers() {
    // y'' = y/4 grows by e^{π/2} over the period π; the other multipliers are those of one oscillator. The tolerance is
    // a few hundred ε, for a matrix with entries of about 5.
    let plan = StabilityMap::over(0.5..1.5, 0.0..1.0).resolution(3, 3);
    let two = |b: f64| {
        plan.floquet(|a, q| Two { a, b, q }, PI, Mixed::<6>, 16)
            .unwrap()
    };
    let one = plan
        .floquet(|a, q| Mathieu { a, q }, PI, Mixed::<6>, 16)
        .unwrap();
    let (growing, resting) = (two(-0.25), two(0.3));
    for (i, j) in [(0, 0), (1, 1), (2, 2), (0, 2)] {
        let alone = one.value(i, j).unwrap();
        let tolerance = if alone > 1.0 + 1e-6 { 1e-12 } else { 1e-7 };
        assert!((resting.value(i, j).unwrap() - alone).abs() < tolerance);
        let expected = alone.max((PI / 2.0).exp());
        assert!((growing.value(i, j).unwrap() - expected).abs() < 1e-12);
    }
}

/// An oscillator with a force that prevents an equilibrium at the given state for f ≠ 0.
#[dynamics(coordinates(x), lagrangian = dot(x)^2/2 - k*x^2/2 + f*x)]
struct Forced {
    k: f64,
    f: f64,
}

#[test]
fn motion_is_not_rest() {
    let map = StabilityMap::over(0.0..1.0, -1.0..1.0)
        .resolution(1, 3)
        .floquet(|k, f| Forced { k, f }, 1.0, Mixed::<3>, 4)
        .unwrap();
    assert_eq!(map.failed(), 2);
    // The middle row has f = 0: a stable oscillator.
    assert!(map.value(0, 1).unwrap() < 1.0 + 1e-12);
    let first = map.first_failure().unwrap();
    assert_eq!((first.column, first.row), (0, 0));
    assert!(matches!(
        first.error,
        PointError::Failed(FloquetError::NotAtRest { element: 0, distance }) if distance > 0.1
    ));
}

/// A body on a spring, in its position of equilibrium.
#[dynamics(coordinates(x), lagrangian = m/2*dot(x)^2 - k/2*(x - sag)^2 - m*g*x)]
struct Hanging {
    m: f64,
    k: f64,
    sag: f64,
    g: f64,
}

#[test]
fn heavy_bodies_are_at_rest_up_to_roundings_of_their_weight() {
    let (g, k) = (9.81, 7e7);
    // The number of the seven masses that are refused because they move, and the number that fail.
    let refused = |part: f64| {
        let (mut moving, mut failed) = (0, 0);
        for mass in 0..7 {
            let hanging = |m: f64, _: f64| Hanging {
                m,
                k,
                sag: m * g / k * (1.0 + part),
                g,
            };
            let mass = 2e6 + 3e5 * f64::from(mass);
            let map = StabilityMap::over(mass..mass + 1e5, 0.0..1.0)
                .resolution(1, 1)
                .floquet(hanging, 1.0, Mixed::<3>, 4)
                .unwrap();
            let largest = map.largest().unwrap_or(1.0);
            assert!(largest < 1.0 + 1e-12, "{largest}");
            let error = map.first_failure().map(|failure| &failure.error);
            moving += u32::from(matches!(
                error,
                Some(PointError::Failed(FloquetError::NotAtRest { .. }))
            ));
            failed += u32::from(error.is_some());
        }
        (moving, failed)
    };
    // A rounding error of the weight, 4e-9 N, leads to a momentum of 1e-9 and a displacement of 1e-16. If that is about
    // one unit in the last place of the sag, Newton's method alternates between two values: at 2.35e6 kg.
    assert_eq!(refused(f64::EPSILON), (0, 0));
    // A displacement of a billionth of the sag, some 4e-10, is not a rounding error and must be refused.
    assert_eq!(refused(1e-9).1, 7);
}

#[test]
fn models_that_break_are_failures() {
    let map = StabilityMap::over(0.0..2.0, 0.0..1.0)
        .resolution(2, 1)
        .floquet(
            |a, q| Mathieu {
                a: if a < 1.0 { f64::NAN } else { a },
                q,
            },
            PI,
            Mixed::<4>,
            8,
        )
        .unwrap();
    assert_eq!((map.failed(), map.value(0, 0)), (1, None));
    assert!(map.value(1, 0).is_some());
}

#[test]
fn plans_that_cannot_be() {
    let plan = StabilityMap::over(0.0..1.0, 0.0..1.0).resolution(2, 2);
    let model = |a, q| Mathieu { a, q };
    for (period, elements) in [
        (0.0, 4),
        (-1.0, 4),
        (f64::NAN, 4),
        (f64::INFINITY, 4),
        (1.0, 0),
        // Lengths below all normal numbers, and cells without end.
        (5e-324, 4),
        (1.0, usize::MAX),
    ] {
        let map = plan.floquet(model, period, Mixed::<4>, elements);
        assert!(matches!(map, Err(MapError::Period { .. })));
    }
    let map = plan.floquet(model, 1.0, Element::mixed(99), 4);
    assert!(matches!(map, Err(MapError::Element(_))));
}
