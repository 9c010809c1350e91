//! Orders of approximation and of convergence, Tables I to III, measured with the elements.

use crate::common::{count, list, reference, word};
use crate::{Oscillator, element};
use nalgebra::DMatrix;

/// The evolution operator exp(h S), corrected (55): order (p, q), m = 1.
fn evolution(oscillator: &Oscillator, h: f64) -> DMatrix<f64> {
    let omega = oscillator.k.sqrt();
    let alpha = oscillator.c / 2.0;
    let damped = (omega * omega - alpha * alpha).sqrt();
    let (sine, cosine) = (damped * h).sin_cos();
    let decay = (-alpha * h).exp();
    DMatrix::from_row_slice(
        2,
        2,
        &[
            cosine - alpha / damped * sine,
            -(damped + alpha * alpha / damped) * sine,
            sine / damped,
            cosine + alpha / damped * sine,
        ],
    ) * decay
}

/// The leading power of h of the error: the slope between successive step sizes, after eliminating the next power
/// (`gap` higher) by comparing two slopes. At `from` the error is well above rounding.
fn leading_power(error: impl Fn(f64) -> f64, from: f64, gap: i32) -> i32 {
    const RATIO: f64 = 1.25;
    let slope = |h: f64| (error(RATIO * h).abs() / error(h).abs()).ln() / RATIO.ln();
    let (first, second) = (slope(from), slope(RATIO * from));
    let measured = first - (second - first) / (RATIO.powi(gap) - 1.0);
    let power = measured.round();
    assert!(
        (measured - power).abs() < 0.4,
        "slope {measured} ({first}, {second}) at {from} is no power"
    );
    power as i32
}

#[test]
fn tables_one_to_three_and_on_to_six_nodes() {
    let table = reference("orders");
    let mut seen = 0;
    for row in list(&table["rows"]) {
        let (form, quadrature, nodes) = (
            word(&row["form"]),
            word(&row["quadrature"]),
            count(&row["n"]),
        );
        let damped = word(&row["damping"]) == "damped";
        // Leading coefficients are Chebyshev polynomials U_m(ξ) with m about 2s + 1; these ξ are not close to their
        // zeros.
        let xi = [0.3, 0.2, 0.15, 0.12, 0.1][nodes - 2];
        let c = if damped { 2.0 * xi } else { 0.0 };
        let oscillator = Oscillator { m: 1.0, c, k: 1.0 };
        let difference = |h: f64| {
            oscillator.transition(element(form, quadrature, nodes), h) - evolution(&oscillator, h)
        };
        let what = format!("{form} {quadrature}, {nodes} nodes, damped: {damped}");
        // Errors are about (h/4n)^power: elements with more nodes are measured with larger steps.
        let from = [0.04, 0.12, 0.25, 0.35, 0.5][nodes - 2];
        let gap = if damped { 1 } else { 2 };
        let kappa = [0, 1].map(|i| leading_power(|h| difference(h).row(i).norm(), from, gap) - 1);
        let expected = [count(&row["kappa_p"]) as i32, count(&row["kappa_q"]) as i32];
        assert_eq!(kappa, expected, "{what}");
        assert_eq!(
            kappa[0].min(kappa[1]),
            count(&row["kappa"]) as i32,
            "{what}"
        );
        seen += 1;
        if damped {
            // Single entries change their sign between these steps and rounding.
            continue;
        }
        for (i, row) in list(&row["err"]).iter().enumerate() {
            for (j, power) in list(row).iter().enumerate() {
                let measured = leading_power(|h| difference(h)[(i, j)], from, gap);
                assert_eq!(measured, count(power) as i32, "{what}: entry ({i}, {j})");
            }
        }
    }
    assert_eq!(seen, 26);
}
