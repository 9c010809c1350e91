//! Orders of periods and multipliers over the number of elements, for nonlinear orbits; and the cost.

use crate::models::{FORCED, VanDerPol, response};
use std::f64::consts::TAU;
use tfe::periodic::Phase;
use tfe::prelude::*;

/// The observed order of errors that fall as E^{−order}, each with its number of elements E.
#[track_caller]
fn assert_order(errors: &[(usize, f64)], order: f64, what: &str) {
    for pair in errors.windows(2) {
        let ((coarse, large), (fine, small)) = (pair[0], pair[1]);
        let measured = (large / small).ln() / (fine as f64 / coarse as f64).ln();
        assert!(
            (measured - order).abs() < 0.35,
            "{what}: order {measured:.2} instead of {order} from {large:.1e} with {coarse} to {small:.1e} with {fine} elements"
        );
    }
}

/// Numbers of elements for which the error with this number of nodes is asymptotic and well above rounding.
fn elements(nodes: usize) -> [usize; 3] {
    match nodes {
        2 => [160, 240, 360],
        3 => [60, 90, 135],
        4 => [48, 64, 88],
        _ => [40, 50, 64],
    }
}

fn families(nodes: usize) -> Vec<(Element, f64)> {
    let order = 2.0 * (nodes as f64 - 1.0);
    vec![
        (Element::mixed(nodes), order),
        (Element::primal(nodes), order),
        (Element::primal(nodes).lobatto(), order),
        (Element::energy_conserving(nodes), order),
    ]
}

#[test]
fn van_der_pol_period_and_multiplier() {
    let model = VanDerPol::unit(1.0);
    for nodes in 2..=5 {
        for (element, order) in families(nodes) {
            let (mut periods, mut multipliers) = (Vec::new(), Vec::new());
            for elements in elements(nodes) {
                let orbit = PeriodicOrbit::of(&model)
                    .element(element)
                    .elements(elements)
                    .unknown_period(6.6)
                    .phase(Phase::Momentum {
                        index: 0,
                        value: 0.0,
                    })
                    .guess(|t| ([2.0 * t.cos()], [-2.0 * t.sin()]))
                    .solve()
                    .expect("a limit cycle");
                periods.push((elements, (orbit.period() - 6.663_286_859_323_13).abs()));
                let multiplier = orbit.multipliers()[1].re / 8.596_950_636_038_052e-4;
                multipliers.push((elements, (multiplier - 1.0).abs()));
            }
            assert_order(&periods, order, &format!("period, {element:?}"));
            assert_order(&multipliers, order, &format!("multiplier, {element:?}"));
        }
    }
}

#[test]
fn forced_duffing_multipliers() {
    let model = FORCED;
    for nodes in 2..=5 {
        for (element, order) in families(nodes) {
            let mut errors = Vec::new();
            for elements in elements(nodes).map(|elements| elements / 3) {
                let orbit = PeriodicOrbit::of(&model)
                    .element(element)
                    .elements(elements)
                    .period(TAU / 1.4)
                    .guess(response)
                    .solve()
                    .expect("an orbit");
                let multiplier = orbit.multipliers()[0];
                let error = (multiplier.re - 0.066_539_330_128_492_03)
                    .hypot(multiplier.im - 0.634_917_295_211_510_1);
                errors.push((elements, error));
            }
            assert_order(&errors, order, &format!("{element:?}"));
        }
    }
}

/// The work of a solution is proportional to the number of elements: the same number of iterations, each with one
/// tangent per element and point.
#[test]
fn the_work_is_linear_in_the_number_of_elements() {
    let model = VanDerPol::unit(1.0);
    for elements in [10, 100, 1000, 10_000] {
        let orbit = PeriodicOrbit::of(&model)
            .element(Mixed::<5>)
            .elements(elements)
            .unknown_period(6.6)
            .guess(|t| ([2.0 * t.cos()], [-2.0 * t.sin()]))
            .solve()
            .expect("a limit cycle");
        let statistics = orbit.statistics();
        assert!(statistics.newton_iterations <= 8, "{statistics:?}");
        let work = statistics.newton_iterations * elements as u64;
        assert_eq!(statistics.tangent_evaluations, 4 * work);
        assert_eq!(statistics.factorizations, work);
        let tolerance = if elements == 10 { 1e-3 } else { 1e-9 };
        assert!((orbit.multipliers()[1].re / 8.596_950_636_038_052e-4 - 1.0).abs() < tolerance);
    }
}
