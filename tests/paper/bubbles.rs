//! The unstable intervals of the step size, the "bubbles" of Figure 1: ends by root finding compared with the roots of
//! (T-57) to 20 digits.

use crate::Oscillator;
use crate::common::{assert_close, count, list, number, reference, word};
use tfe::prelude::*;
use tfe::stability::{UnstableInterval, unstable_intervals};

/// Twice the last stability limit of five nodes.
const FAR: f64 = 40.0;

/// The accuracy of the table.
const ENDS: f64 = 1e-10;

#[track_caller]
fn assert_interval(actual: &UnstableInterval, start: f64, end: f64, what: &str) {
    assert!(
        (actual.start - start).abs() <= ENDS * start && (actual.end - end).abs() <= ENDS * end,
        "{what}: {actual:?}, expected {start} .. {end}"
    );
}

#[test]
fn bubbles_of_the_primal_element() {
    let table = reference("stability_bubbles");
    let cases = list(&table["cases"]);
    assert_eq!(cases.len(), 4, "2 to 5 nodes");
    // ρ itself, and ρ in units that make the entries of A differ by ten orders of magnitude.
    for (omega, m) in [(1.0, 1.0), (3e3, 1e-3)] {
        let oscillator = Oscillator {
            m,
            c: 0.0,
            k: m * omega * omega,
        };
        let rest = oscillator.state([0.0], [0.0]);
        for case in cases {
            let nodes = count(&case["n"]);
            let what = format!("{nodes} nodes, ω = {omega}");
            let found =
                unstable_intervals(&oscillator, Element::primal(nodes), &rest, 0.0..FAR / omega)
                    .unwrap_or_else(|error| panic!("{what}: {error}"));
            let bubbles = list(&case["bubbles"]);
            assert_eq!(found.len(), bubbles.len() + 1, "{what}: {found:#?}");
            for (interval, bubble) in found.iter().zip(bubbles) {
                let (low, high) = (number(&bubble["rho_lo"]), number(&bubble["rho_hi"]));
                assert_interval(interval, low / omega, high / omega, &what);
                let (worst, radius) = (number(&bubble["rho_max"]), number(&bubble["max_radius"]));
                assert!(
                    (interval.radius - radius).abs() <= 1e-12,
                    "{what}: {interval:?}, expected radius {radius}"
                );
                // At a maximum, the position is known to the square root of the rounding unit only.
                assert!(
                    (interval.worst * omega - worst).abs() <= 1e-7 * worst,
                    "{what}: {interval:?}, expected the worst at {worst}"
                );
            }
            let last = &found[bubbles.len()];
            assert_interval(
                last,
                number(&case["final_limit"]) / omega,
                FAR / omega,
                &what,
            );
        }
    }
}

#[test]
fn beyond_the_last_limit_the_radius_tends_to_its_value_at_infinity() {
    let oscillator = Oscillator::scaled(1.0, 0.0, 1.0);
    let rest = oscillator.state([0.0], [0.0]);
    for case in list(&reference("stability_bubbles")["cases"]) {
        let (nodes, far) = (count(&case["n"]), 1e6);
        let found = unstable_intervals(&oscillator, Element::primal(nodes), &rest, 0.0..far)
            .expect("the element is smooth");
        let last = found.last().expect("unstable beyond the last limit");
        let radius = number(&case["radius_at_infinity"]);
        assert_eq!(last.end, far);
        // The next term of the expansion is of the order of 1/ρ².
        assert!(
            (last.radius - radius).abs() <= 1e-6 * radius,
            "{nodes} nodes: {last:?}, expected {radius}"
        );
    }
}

/// Σ c ρᵏ, written as `-4*rho**6 + 540*rho**4 - 25200` in the table.
fn polynomial(text: &str, rho: f64) -> f64 {
    let value = |term: &str| {
        let (coefficient, power) = match term.split_once("rho**") {
            Some((coefficient, power)) => (coefficient.trim_end_matches('*'), power),
            None => (term, "0"),
        };
        let power: i32 = power.parse().expect("a power");
        let coefficient = match coefficient {
            "" => 1.0,
            "-" => -1.0,
            number => number.parse().expect("a coefficient"),
        };
        coefficient * rho.powi(power)
    };
    text.replace(" - ", " + -").split(" + ").map(value).sum()
}

#[test]
fn nothing_is_lost_where_the_interior_block_is_singular() {
    // (T-25): ρ² = 10 for three nodes, 10 and 42 for four. All of them are ends of bubbles, where a₁₁ = ±1.
    let table = reference("stability_bubbles");
    for (nodes, square, end) in [(3, 10.0_f64, -1.0), (4, 10.0, -1.0), (4, 42.0, 1.0)] {
        let case = list(&table["cases"])
            .iter()
            .find(|case| count(&case["n"]) == nodes)
            .expect("a row for these nodes");
        let (above, below) = word(&case["a11"])
            .trim_matches(['(', ')'])
            .split_once(")/(")
            .expect("a quotient");
        let rho = square.sqrt();
        let a11 = polynomial(above, rho) / polynomial(below, rho);
        assert!((a11 - end).abs() < 1e-13, "{nodes} nodes: {a11}");
        let oscillator = Oscillator::scaled(rho, 0.0, 1.0);
        let a = oscillator.transition(Element::primal(nodes), 1.0);
        // Some rounding errors of entries of the size ρ² = 42.
        for diagonal in [a[(0, 0)], a[(1, 1)]] {
            assert!(
                (diagonal - a11).abs() < 1e-13,
                "{nodes} nodes at ρ² = {square}: {diagonal}, expected {a11}"
            );
        }
        assert!((a.determinant() - 1.0).abs() < 1e-13);
        // A step is the matrix times the state.
        let motion = Simulation::new(&oscillator)
            .element(Element::primal(nodes))
            .step(1.0)
            .run(State { q: [0.3], p: [0.7] }, 0.0..1.0)
            .expect("a linear step");
        let expected = &a * nalgebra::DVector::from_column_slice(&[0.7, 0.3]);
        let State { q, p } = motion.last().state();
        assert_close(&[p[0], q[0]], expected.as_slice(), 1e-13, "one step");
    }
}

#[test]
fn mixed_elements_have_no_bubbles() {
    let oscillator = Oscillator::scaled(1.0, 0.0, 1.0);
    let rest = oscillator.state([0.0], [0.0]);
    for nodes in 2..=6 {
        for element in [Element::mixed(nodes), Element::primal(nodes).reduced()] {
            let found = unstable_intervals(&oscillator, element, &rest, 0.0..1e3)
                .expect("the element is smooth");
            assert!(found.is_empty(), "{element:?}: {found:?}");
        }
    }
}

/// Two equal masses between walls, with springs k, c, k: ω² = k/m and (k + 2c)/m.
#[dynamics(coordinates(a, b),
    lagrangian = m/2*(dot(a)^2 + dot(b)^2) - k/2*(a^2 + b^2) - c/2*(b - a)^2)]
struct Masses {
    m: f64,
    k: f64,
    c: f64,
}

#[test]
fn every_mode_has_its_bubbles() {
    // ω = 1 and 1.3: the bubbles of the two modes do not overlap until the slow one is past its last limit.
    let (fast, far) = (1.3_f64, 6.4);
    let masses = Masses {
        m: 1.0,
        k: 1.0,
        c: 0.5 * (fast * fast - 1.0),
    };
    let rest = masses.state([0.0; 2], [0.0; 2]);
    let table = reference("stability_bubbles");
    let case = list(&table["cases"])
        .iter()
        .find(|case| count(&case["n"]) == 4)
        .expect("a row for four nodes");
    let mut expected: Vec<(f64, f64)> = Vec::new();
    for omega in [1.0, fast] {
        for bubble in list(&case["bubbles"]) {
            let (start, end) = (
                number(&bubble["rho_lo"]) / omega,
                number(&bubble["rho_hi"]) / omega,
            );
            if end < far {
                expected.push((start, end));
            }
        }
    }
    expected.sort_by(|a, b| a.0.total_cmp(&b.0));
    let found =
        unstable_intervals(&masses, Primal::<4>, &rest, 0.0..far).expect("the element is smooth");
    assert_eq!(found.len(), expected.len(), "{found:#?} {expected:?}");
    for (interval, &(start, end)) in found.iter().zip(&expected) {
        assert_interval(interval, start, end, "two modes");
    }
}

/// At zero step size there is no element; zeros there are not reported.
#[test]
fn steps_of_both_signs() {
    let oscillator = Oscillator {
        m: 1.0,
        c: 0.0,
        k: 1.0,
    };
    let rest = oscillator.state([0.0], [0.0]);
    let found = unstable_intervals(&oscillator, Primal::<2>, &rest, -4.0..4.0).expect("intervals");
    let [before, after] = &found[..] else {
        panic!("{found:#?}");
    };
    let limit = 12.0_f64.sqrt();
    assert_eq!((before.start, after.end), (-4.0, 4.0));
    assert!((before.end + limit).abs() < 1e-11 && (after.start - limit).abs() < 1e-11);
}
