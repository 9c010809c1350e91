//! Springs whose length without a force is a field that is zero: tangents where their ends meet, beside closed forms.

use crate::kernels::{derivation_of, results_of};
use crate::singular::{ALL, close};

fn of(energy: &str, parameters: &[(&str, f64)], q: &[f64]) -> (Vec<f64>, Vec<Vec<f64>>) {
    let names = &["x", "y", "z", "w"][..q.len()];
    let kinetic: Vec<String> = names.iter().map(|x| format!("dot({x})^2/2")).collect();
    let (names, kinetic) = (names.join(", "), kinetic.join(" + "));
    let text = format!("coordinates({names}), lagrangian = {kinetic} - ({energy})");
    let used: Vec<_> = parameters
        .iter()
        .copied()
        .filter(|(name, _)| {
            let mut words = energy.split(|c: char| !c.is_alphanumeric());
            words.any(|word| word == *name)
        })
        .collect();
    let found = results_of(&text, &used, ALL, q, &vec![0.0; q.len()]);
    let slopes = found.q.iter().map(|slope| -slope).collect();
    let second = found.qq.iter().map(|row| row.iter().map(|x| -x).collect());
    (slopes, second.collect())
}

/// The energy is k/2 (x² + y²) where l = 0, or has this tangent at zero.
#[test]
fn springs_of_no_length() {
    let parameters = [("k", 3.0), ("l", 0.0), ("m", 0.0), ("a", 0.5), ("s", 2.0)];
    for energy in [
        "k/2*(sqrt(x^2 + y^2) - l)^2",
        "k/2*(hypot(x, y) - l)^2",
        "k/2*(norm([x, y]) - l)^2",
        "k/2*(l - norm([x, y]))^2",
        "k/2*(norm([x, y]) - s*l)^2",
        "k/2*(norm([x, y]) - l - m)^2",
        "k/2*max(norm([x, y]) - l, 0)^2",
        "k/2*(norm([x, y]) - l)^2*(1 + x)",
        "k/2/a^2*(1 - exp(-a*(hypot(x, y) - l)))^2",
        "k*s^2*(cosh((norm([x, y]) - l)/s) - 1)",
        "k*s^2*ln(cosh((norm([x, y]) - l)/s))",
    ] {
        for q in [[0.0; 2], [3e-110, 4e-110], [3e-160, -4e-160], [1e-300, 0.0]] {
            let (slopes, second) = of(energy, &parameters, &q);
            for i in 0..2 {
                let expected = 3.0 * q[i];
                // Squares are subnormal numbers here.
                let least = if energy.contains("exp") {
                    1e-100
                } else {
                    1e-160
                };
                let error = (slopes[i] - expected).abs();
                assert!(
                    error <= 1e-13 * expected.abs() + least,
                    "{energy}: {slopes:?}"
                );
                for j in 0..2 {
                    let expected = if i == j { 3.0 } else { 0.0 };
                    close(second[i][j], expected, energy);
                }
            }
        }
    }
    // Three coordinates, a fixed point elsewhere, and other springs beside it.
    let (slopes, second) = of("k/2*(norm([x, y, z]) - l)^2", &parameters, &[0.0; 3]);
    assert_eq!(slopes, [0.0; 3]);
    assert_eq!(
        second.concat(),
        [3.0, 0.0, 0.0, 0.0, 3.0, 0.0, 0.0, 0.0, 3.0]
    );
    let energy = "k/2*(norm([x - z, y - w]) - l)^2 + k*(hypot(x - a, y) - m)^2";
    let (slopes, second) = of(energy, &parameters, &[0.5, 0.0, 0.5, 0.0]);
    assert_eq!(slopes, [0.0; 4]);
    let expected = [
        [9.0, 0.0, -3.0, 0.0],
        [0.0, 9.0, 0.0, -3.0],
        [-3.0, 0.0, 3.0, 0.0],
        [0.0, -3.0, 0.0, 3.0],
    ];
    assert_eq!(second.concat(), expected.concat());
}

/// A spring with a length has no tangent where its ends meet, and elsewhere that which it had.
#[test]
fn springs_with_a_length() {
    let energy = "k/2*(norm([x, y]) - l)^2";
    for l in [1.0, -1.0, 1e-200] {
        let (slopes, second) = of(energy, &[("k", 3.0), ("l", l)], &[0.0; 2]);
        assert!(slopes[0].is_nan() && second[0][0].is_nan(), "{l}");
        let (slopes, second) = of(energy, &[("k", 3.0), ("l", l)], &[3.0, 4.0]);
        close(slopes[0], 1.8 * (5.0 - l), "slope");
        close(second[0][0], 3.0 * (1.0 - l / 5.0 * 0.64), "along x");
        assert!((second[0][1] - 0.6 * l * 0.48).abs() <= 1e-14, "across");
    }
    let (slopes, _) = of(
        "k/2*(norm([x, y]) - l)^2 + x",
        &[("k", 3.0), ("l", 0.0)],
        &[0.0; 2],
    );
    assert_eq!(slopes, [1.0, 0.0]);
}

/// Forces of springs and dampers, and springs between the sites of a chain.
#[test]
fn forces_of_springs_of_no_length() {
    let h = "norm([x, y])";
    let force = |x: &str| format!("force({x}) = -k*({h} - l)*{x}/{h}");
    let (x, y) = (force("x"), force("y"));
    let text = format!("coordinates(x, y), lagrangian = (dot(x)^2 + dot(y)^2)/2, {x}, {y}");
    let found = results_of(&text, &[("k", 3.0), ("l", 0.0)], ALL, &[0.0; 2], &[0.0; 2]);
    assert_eq!(found.force, [0.0; 2]);
    assert_eq!(found.force_q.concat(), [-3.0, 0.0, 0.0, -3.0]);
}

/// One choice for each entry, and one for all of them. Lengths that are numbers have none.
#[test]
fn choices_of_springs_are_few() {
    let text = "coordinates(x, y), lagrangian = (dot(x)^2 + dot(y)^2)/2 - k/2*(norm([x, y]) - l)^2";
    let derivation = derivation_of(text, &[("k", 3.0), ("l", 0.5)]);
    assert!(derivation.structure().smooth);
    let program = derivation.program(ALL).to_string();
    assert_eq!(program.matches("select").count(), 6, "{program}");
}
