//! The speed below which an upright top is unstable, for the discretised equations: (T-87), (T-88), (T-89).

use crate::top::Top;
use std::convert::Infallible;
use tfe::prelude::*;
use tfe::stability::{stability_changes_of, unstable_intervals_of};

/// J_t = 2, J_a = 0.3, mgd = 5: Ω_c = 21.08, and σ = 2.5 h².
const TOP: Top = Top {
    jt: 2.0,
    ja: 0.3,
    mgd: 5.0,
    omega: 0.0,
};

/// From short steps to those during which the unstable top grows by a factor of 100.
const STEPS: [f64; 6] = [0.01, 0.03, 0.1, 0.3, 1.0, 3.0];

/// The only speed between ½ Ω_c and 2 Ω_c at which the stability of an element changes.
///
/// The double eigenvalue there is defective and known to half of the digits only. The root is found for a smooth
/// function of the matrix, ∏ (μᵢ − μⱼ)² with μ = λ + 1/λ, which has a simple zero.
#[track_caller]
fn limit_speed(element: Element, h: f64) -> f64 {
    let critical = TOP.critical_speed();
    let matrix = |omega: f64| {
        let top = Top { omega, ..TOP };
        Ok::<_, Infallible>(top.transition(element, h))
    };
    let changes = stability_changes_of(matrix, 0.5 * critical..2.0 * critical)
        .unwrap_or_else(|error| panic!("{element}, h = {h}: {error}"));
    assert_eq!(changes.len(), 1, "{element}, h = {h}: {changes:?}");
    changes[0]
}

#[test]
fn mixed_and_reduced_elements_have_the_exact_limit_at_every_step() {
    let critical = TOP.critical_speed();
    for nodes in 2..=6 {
        for element in [Element::mixed(nodes), Element::primal(nodes).reduced()] {
            for h in STEPS {
                let found = limit_speed(element, h);
                assert!(
                    (found / critical - 1.0).abs() <= 1e-12,
                    "{element}, h = {h}: {found}, expected {critical}, {:e}",
                    found / critical - 1.0
                );
            }
        }
    }
}

#[test]
fn the_limit_of_primal_elements_depends_on_the_step() {
    let critical = TOP.critical_speed();
    for h in STEPS {
        let sigma = TOP.sigma(h);
        let two = 1.0 + sigma / 12.0;
        let three = two * (1.0 + sigma / 60.0) / (1.0 + sigma / 10.0);
        for (nodes, ratio) in [(2, two), (3, three)] {
            // At h = 3 two nodes need more than twice Ω_c², still inside the range.
            let (found, expected) = (
                limit_speed(Element::primal(nodes), h),
                critical * ratio.sqrt(),
            );
            assert!(
                (found / expected - 1.0).abs() <= 1e-12,
                "{nodes} nodes, h = {h}: {found}, expected {expected}"
            );
        }
    }
}

#[test]
fn nothing_breaks_at_the_critical_speed() {
    let top = Top {
        omega: TOP.critical_speed(),
        ..TOP
    };
    for nodes in 2..=6 {
        for element in [Element::mixed(nodes), Element::primal(nodes).reduced()] {
            for h in STEPS {
                let a = top.transition(element, h);
                assert!(
                    a.iter().all(|entry| entry.is_finite()),
                    "{element}, h = {h}"
                );
                // A double eigenvalue in one Jordan block is known to the square root of the rounding unit, 1.5e-8, in
                // units of the size of the block.
                let radius = stability::spectral_radius(&a);
                assert!(
                    (radius - 1.0).abs() <= 2e-7,
                    "{element}, h = {h}: {:e}",
                    radius - 1.0
                );
            }
        }
        // The limit of primal elements is above Ω_c by (T-87), (T-88): unstable at Ω_c, but finite.
        let radius = stability::spectral_radius(&top.transition(Element::primal(nodes), 1.0));
        assert!(
            radius.is_finite() && radius > 1.0,
            "{nodes} nodes: {radius}"
        );
    }
}

/// J_t = 1, J_a = 2, mgd = 1 with steps of 6: four nodes have a narrow interval of instability within the stable
/// speeds, which must be found wherever the search begins.
#[test]
fn a_narrow_band_is_found_from_far_away() {
    let matrix = |omega: f64| {
        let top = Top {
            jt: 1.0,
            ja: 2.0,
            mgd: 1.0,
            omega,
        };
        Ok::<_, Infallible>(top.transition(Element::primal(4), 6.0))
    };
    for start in [0.01, 0.1, 0.3, 0.37, 0.5, 0.9, 1.3] {
        for end in [2.5, 4.0, 10.0] {
            let found = unstable_intervals_of(matrix, start..end).expect("smooth");
            let band = found
                .iter()
                .find(|interval| interval.start < 1.88 && interval.end > 1.88);
            let band = band.unwrap_or_else(|| panic!("{start}..{end}: {found:?}"));
            assert!((band.start - 1.866).abs() < 1e-3 && (band.end - 1.887).abs() < 1e-3);
            assert!((band.radius - 1.010).abs() < 1e-3, "{band:?}");
        }
    }
}

/// A search from far below, across poles of the element, finds the one limit at its closed form. At h = 2 the matrix
/// with two mixed nodes has a pole at Ω = 0.
#[test]
fn one_limit_from_far_below() {
    for (element, limit) in [
        (Element::primal(2), primal_2 as fn(f64) -> f64),
        (Element::primal(3), primal_3),
        (Element::mixed(2), exact),
        (Element::mixed(3), exact),
    ] {
        for k in 1..=30 {
            let h = 6.0 / 30.0 + (6.0 - 6.0 / 30.0) * (f64::from(k) - 1.0) / 29.0;
            let matrix = |omega: f64| {
                let top = Top {
                    jt: 1.0,
                    ja: 2.0,
                    mgd: 1.0,
                    omega,
                };
                Ok::<_, Infallible>(top.transition(element, h))
            };
            let found = unstable_intervals_of(matrix, 0.1..2.5).expect("smooth");
            assert_eq!(found.len(), 1, "{element}, h = {h}: {found:?}");
            let error = (found[0].end / limit(h * h).sqrt() - 1.0).abs();
            assert!(
                found[0].start == 0.1 && error < 1e-12,
                "{element}, h = {h}: {error:e}"
            );
        }
    }
}

/// (T-87), (T-88), (T-89) over σ: (Ω/Ω_c)².
fn primal_2(s: f64) -> f64 {
    1.0 + s / 12.0
}

fn primal_3(s: f64) -> f64 {
    (1.0 + s / 12.0) * (1.0 + s / 60.0) / (1.0 + s / 10.0)
}

fn exact(_: f64) -> f64 {
    1.0
}
