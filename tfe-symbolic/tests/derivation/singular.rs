//! Values and derivatives at singular points of the functions in a formula, where what it describes is not singular:
//! beside closed forms.

use crate::kernels::results_of;
use tfe_symbolic::program::Request;

pub const ALL: Request = Request {
    value: true,
    first: true,
    mass: true,
    second: true,
    observables: true,
    constraint_values: false,
    constraint_rows: false,
    constraint_second: false,
};

/// Up to some hundred roundings: sums cancel little where these are evaluated.
#[track_caller]
pub fn close(found: f64, expected: f64, what: &str) {
    assert!(
        (found - expected).abs() <= 1e-13 * expected.abs(),
        "{what}: {found}, {expected}"
    );
}

/// Value, first and second derivative of a potential of one coordinate, as many as are given.
#[track_caller]
pub fn check(energy: &str, parameters: &[(&str, f64)], x: f64, expected: &[f64]) {
    let text = format!("coordinates(x), lagrangian = dot(x)^2/2 - ({energy})");
    let found = results_of(&text, parameters, ALL, &[x], &[0.0]);
    let found = [-found.value, -found.q[0], -found.qq[0][0]];
    for (found, expected) in found.into_iter().zip(expected) {
        close(found, *expected, &format!("{energy} at {x}"));
    }
}

/// A logarithm times something that vanishes with its argument. The slope of x ln |x| is infinite at zero.
#[test]
fn logarithms_of_one_coordinate_at_zero() {
    let l = 2_f64.ln();
    let cases: &[(&str, f64, &[f64])] = &[
        ("x*ln(abs(x))", 0.0, &[0.0]),
        ("x*ln(abs(x))", -2.0, &[-2.0 * l, l + 1.0, -0.5]),
        ("x^2*ln(abs(x))", 0.0, &[0.0, 0.0]),
        (
            "x^2*ln(abs(x))",
            -2.0,
            &[4.0 * l, -4.0 * l - 2.0, 2.0 * l + 3.0],
        ),
        ("x^2*ln(x^2)", 0.0, &[0.0, 0.0]),
        ("x^2*ln(x)^2", 0.0, &[0.0, 0.0]),
        ("x^3*ln(x)", 0.0, &[0.0, 0.0, 0.0]),
        ("x^3*ln(abs(x))", 0.0, &[0.0, 0.0, 0.0]),
        (
            "x^3*ln(abs(x))",
            -2.0,
            &[-8.0 * l, 12.0 * l + 4.0, -12.0 * l - 10.0],
        ),
        ("x^3*(ln(abs(x)/3) - 1)", 0.0, &[0.0, 0.0, 0.0]),
        ("(x - 1)^3*ln(abs(x - 1)/2)", 1.0, &[0.0, 0.0, 0.0]),
        ("(1 - x)^3*ln(1 - x)", 1.0, &[0.0, 0.0, 0.0]),
        (
            "(1 - x)^3*ln(1 - x)",
            -1.0,
            &[8.0 * l, -12.0 * l - 4.0, 12.0 * l + 10.0],
        ),
        ("sin(x)^3*ln(abs(sin(x)))", 0.0, &[0.0, 0.0, 0.0]),
        ("max(x, 0)^3*ln(max(x, 0))", 0.0, &[0.0, 0.0, 0.0]),
        ("max(x, 0)^3*ln(max(x, 0))", -1.0, &[0.0, 0.0, 0.0]),
        ("x^3/abs(x)", 0.0, &[0.0, 0.0]),
    ];
    for (energy, x, expected) in cases {
        check(energy, &[], *x, expected);
    }
    // What has no value keeps none.
    let text = "coordinates(x), lagrangian = dot(x)^2/2 - x*ln(x)";
    let found = results_of(text, &[], ALL, &[-1.0], &[0.0]);
    assert!(found.value.is_nan() && found.q[0].is_nan());
    let text = "coordinates(x), lagrangian = dot(x)^2/2, force(x) = -dot(x)*ln(dot(x)^2 + x^2), output(entropy) = x*ln(abs(x))";
    let found = results_of(text, &[], ALL, &[0.0], &[0.0]);
    assert_eq!((found.force[0], found.observables[0]), (0.0, 0.0));
}

/// Potentials u ln u of u = x² + y², with the forces −2 x (ln u + 1), and others.
#[test]
fn logarithms_of_distances_at_zero() {
    let of = |energy: &str, q: [f64; 2]| {
        let text = format!("coordinates(x, y), lagrangian = (dot(x)^2 + dot(y)^2)/2 - {energy}");
        let parameters: &[_] = match energy.contains('a') {
            true => &[("a", 2.0)],
            false => &[],
        };
        results_of(&text, parameters, ALL, &q, &[0.0; 2])
    };
    for (energy, has_tangent) in [
        ("x^2*ln(x^2 + y^2)", false),
        ("(x^2 + y^2)*ln(x^2 + y^2)", false),
        ("(x^2 + y^2)*(ln((x^2 + y^2)/a^2) - 1)", false),
        ("hypot(x, y)^2*ln(hypot(x, y)/a)", false),
        ("(x^2 + y^2)*ln(hypot(x, y))", false),
        ("x^4*ln(x^2 + y^2)", true),
        ("(x^2 + y^2)^2*ln(x^2 + y^2)", true),
        ("norm([x, y])^3*ln(norm([x, y])/a)", true),
        ("norm([x, y])^4*(ln(norm([x, y])/a) - 1/4)", true),
    ] {
        let found = of(energy, [0.0; 2]);
        assert_eq!(found.value, 0.0, "{energy}");
        assert_eq!(found.q, [0.0; 2], "{energy}");
        if has_tangent {
            assert_eq!(found.qq.concat(), [0.0; 4], "{energy}");
        }
    }
    let l = 25_f64.ln();
    for energy in [
        "(x^2 + y^2)*ln(x^2 + y^2)",
        "2*hypot(x, y)^2*ln(hypot(x, y))",
    ] {
        let found = of(energy, [3.0, 4.0]);
        close(-found.value, 25.0 * l, energy);
        close(-found.q[0], 6.0 * (l + 1.0), energy);
        close(-found.qq[0][0], 2.0 * (l + 1.0) + 36.0 / 25.0, energy);
        close(-found.qq[0][1], 48.0 / 25.0, energy);
    }
}

/// xᶜ ln x and its slope xᶜ⁻¹ (c ln x + 1) are zero at zero where the power is.
#[test]
fn logarithms_beside_fields_as_exponents() {
    for (energy, c, x) in [
        ("x^c*ln(x)", 3.0, 0.0),
        ("x^c*ln(x/3)", 3.0, 0.0),
        ("x^c*(ln(x) - 1)", 3.0, 0.0),
        ("(x - 1)^c*ln(x - 1)", 3.0, 1.0),
        ("abs(x)^c*ln(abs(x))", 3.0, 0.0),
        ("max(x, 0)^c*ln(max(x, 0))", 3.0, 0.0),
        ("max(x, 0)^c*ln(max(x, 0))", 3.0, -1.0),
    ] {
        check(energy, &[("c", c)], x, &[0.0, 0.0, 0.0]);
    }
    let l = 4_f64.ln();
    let (value, slope) = (32.0 * l, 8.0 * (2.5 * l + 1.0));
    let second = 2.0 * (3.75 * l + 4.0);
    let parameters = [("c", 2.5)];
    check("x^c*ln(x)", &parameters, 4.0, &[value, slope, second]);
    let expected = [value, -slope, second];
    check("abs(x)^c*ln(abs(x))", &parameters, -4.0, &expected);
    // The second derivative 2 ln x + 3 with c = 2, and the first with c = 1, are infinite.
    let text = "coordinates(x), lagrangian = dot(x)^2/2 - x^c*ln(x)";
    let of = |c: f64, x: f64| results_of(text, &[("c", c)], ALL, &[x], &[0.0]);
    let found = of(2.0, 0.0);
    assert_eq!((found.value, found.q[0]), (0.0, 0.0));
    assert_eq!(found.qq[0][0], f64::INFINITY);
    let found = of(1.0, 0.0);
    assert_eq!((found.value, found.q[0]), (0.0, f64::INFINITY));
    // What has no value keeps none.
    let found = of(3.0, -1.0);
    assert!(found.value.is_nan() && found.q[0].is_nan() && found.qq[0][0].is_nan());
}

/// The slope 2 x uᶜ⁻¹ (c ln u + 1) of uᶜ ln u with u = x² + y² is zero at zero where c is more than one half.
#[test]
fn logarithms_of_distances_beside_fields_as_exponents() {
    let text =
        "coordinates(x, y), lagrangian = (dot(x)^2 + dot(y)^2)/2 - (x^2 + y^2)^c*ln(x^2 + y^2)";
    let of = |c: f64, q: [f64; 2]| results_of(text, &[("c", c)], ALL, &q, &[0.0; 2]);
    for c in [0.75, 1.0, 1.5, 2.0, 3.0] {
        let found = of(c, [0.0; 2]);
        assert_eq!((found.value, &found.q[..]), (0.0, &[0.0; 2][..]), "{c}");
        if c > 1.0 {
            assert_eq!(found.qq.concat(), [0.0; 4], "{c}");
        }
        let u = 25_f64;
        let slope = 2.0 * u.powf(c - 1.0) * (c * u.ln() + 1.0);
        let found = of(c, [3.0, 4.0]);
        close(-found.q[0], 3.0 * slope, "slope by x");
        close(-found.q[1], 4.0 * slope, "slope by y");
    }
    // There the slope is infinite in each direction.
    assert!(of(0.5, [0.0; 2]).q[0].is_nan());
}

/// Powers with a field as exponent: derivatives with the factors e, e − 1, … are zero at zero where these are.
#[test]
fn fields_as_exponents_at_zero() {
    for (energy, e, expected) in [
        ("x^e", 0.0, [1.0, 0.0, 0.0]),
        ("x^e", 1.0, [0.0, 1.0, 0.0]),
        ("x^e", 2.0, [0.0, 0.0, 2.0]),
        ("x^e", 3.0, [0.0, 0.0, 0.0]),
        ("3*x^e/e", 1.0, [0.0, 3.0, 0.0]),
        ("(x/4)^e", 1.0, [0.0, 0.25, 0.0]),
        ("x^(2*e)", 0.5, [0.0, 1.0, 0.0]),
        ("x^(e + 1)/(e + 1)", 0.0, [0.0, 1.0, 0.0]),
        ("sin(x)^e*cos(x)", 1.0, [0.0, 1.0, 0.0]),
        ("max(x, 0)^e", 1.0, [0.0, 1.0, 0.0]),
        ("abs(x)^e*x", 0.0, [0.0, 1.0, 0.0]),
    ] {
        check(energy, &[("e", e)], 0.0, &expected);
    }
    for (energy, x, expected) in [
        ("x^e", 4.0, [8.0, 3.0, 0.375]),
        ("max(x, 0)^e", 4.0, [8.0, 3.0, 0.375]),
        ("max(x, 0)^e", -1.0, [0.0, 0.0, 0.0]),
    ] {
        check(energy, &[("e", 1.5)], x, &expected);
    }
    // The force of a contact with e = 1, a linear spring, and its tangent where it closes.
    let text = "coordinates(y), lagrangian = dot(y)^2/2, force(y) = max(-y, 0)^e*(1 - dot(y)/2)";
    let found = results_of(text, &[("e", 1.0)], ALL, &[0.0], &[-0.4]);
    assert_eq!((found.force[0], found.force_z[0][0]), (0.0, 0.0));
    close(found.force_q[0][0], -1.2, "by y");
    let found = results_of(text, &[("e", 1.5)], ALL, &[1.0], &[-0.4]);
    assert_eq!((found.force[0], found.force_q[0][0]), (0.0, 0.0));
}

/// Energies hᵉ with e = 2 are quadratic, and drag hᵉ⁻² v with e = 2 is linear.
#[test]
fn fields_as_exponents_of_distances() {
    for (square, [xx, xy, yy]) in [
        ("norm([x, y])", [2.0, 0.0, 2.0]),
        ("hypot(x, y)", [2.0, 0.0, 2.0]),
        ("norm([2*x, y])", [8.0, 0.0, 2.0]),
        ("norm([x, y, 3*x])", [20.0, 0.0, 2.0]),
        ("hypot(x + y, x - 2*y)", [4.0, -2.0, 10.0]),
    ] {
        let text = format!("coordinates(x, y), lagrangian = (dot(x)^2 + dot(y)^2)/2 - {square}^e");
        for q in [[0.0, 0.0], [3.0, 4.0]] {
            let found = results_of(&text, &[("e", 2.0)], ALL, &q, &[0.0; 2]);
            close(-found.qq[0][0], xx, square);
            close(-found.qq[1][1], yy, square);
            // The terms of the entry that is zero cancel.
            assert!((-found.qq[0][1] - xy).abs() <= 1e-14 * xx, "{square}");
        }
        let found = results_of(&text, &[("e", 3.0)], ALL, &[0.0; 2], &[0.0; 2]);
        assert_eq!(found.qq.concat(), [0.0; 4], "{square}");
    }
    let h = "norm([dot(x), dot(y)])";
    for (parts, e) in [
        (format!("dissipation = c*{h}^e/e"), 2.0),
        (
            format!("force(x) = -c*{h}^e*dot(x), force(y) = -c*{h}^e*dot(y)"),
            0.0,
        ),
    ] {
        let text = format!("coordinates(x, y), lagrangian = (dot(x)^2 + dot(y)^2)/2, {parts}");
        let found = results_of(&text, &[("c", 0.3), ("e", e)], ALL, &[0.0; 2], &[0.0; 2]);
        assert_eq!(found.force, [0.0; 2], "{parts}");
        assert_eq!(found.force_z.concat(), [-0.3, 0.0, 0.0, -0.3], "{parts}");
    }
}

/// Smooth functions of |x| have the derivatives at zero that they have beside it.
#[test]
fn smooth_functions_of_absolute_values() {
    for (energy, expected) in [
        ("cosh(abs(x))", [1.0, 0.0, 1.0]),
        ("cos(abs(x)/2)", [1.0, 0.0, -0.25]),
        ("sign(x)*sin(abs(x))", [0.0, 1.0, 0.0]),
        ("exp(-abs(x/2)^2)", [1.0, 0.0, -0.5]),
        ("sqrt(x^4)", [0.0, 0.0, 2.0]),
        ("abs(3*x^2)", [0.0, 0.0, 6.0]),
        ("norm([x^2])", [0.0, 0.0, 2.0]),
    ] {
        check(energy, &[], 0.0, &expected);
    }
    check("exp(-abs(x/2)^e)", &[("e", 2.0)], 0.0, &[1.0, 0.0, -0.5]);
    let text = "coordinates(x), lagrangian = dot(x)^2/2, force(x) = -sign(dot(x))*(1 - exp(-abs(dot(x))/2)) + sign(x)^2";
    let found = results_of(text, &[], ALL, &[0.0], &[0.0]);
    // The square of a sign that is declared is zero at zero.
    assert_eq!((found.force[0], found.force_z[0][0]), (0.0, -0.5));
}

/// acos² x = 2 (1 − x) + …, acosh² x = 2 (x − 1) + … at x = 1, where the functions themselves are vertical.
#[test]
fn slopes_of_squared_inverse_functions_at_their_ends() {
    for (energy, x, first) in [
        ("acos(x)^2", 1.0, -2.0),
        ("acosh(x)^2", 1.0, 2.0),
        ("acos(x/2)^2", 2.0, -1.0),
        ("x*acos(x)^2", 1.0, -2.0),
        ("acos(x)^4", 1.0, 0.0),
    ] {
        check(energy, &[], x, &[0.0, first]);
    }
    let (angle, root) = (0.5_f64.acos(), 0.75_f64.sqrt());
    let second = 2.0 / 0.75 - angle / (0.75 * root);
    let expected = [angle * angle, -2.0 * angle / root, second];
    check("acos(x)^2", &[], 0.5, &expected);
    // At the other end the slope is infinite, and beyond the ends there is none.
    let text = "coordinates(x), lagrangian = dot(x)^2/2 - acos(x)^2";
    let found = results_of(text, &[], ALL, &[-1.0], &[0.0]);
    assert_eq!(found.q[0], f64::INFINITY);
    let found = results_of(text, &[], ALL, &[1.5], &[0.0]);
    assert!(found.q[0].is_nan());
}

/// Roots of x⁴ + x⁶ = x⁴ (1 + x²), of 1 − cos x = 2 sin²(x/2) and of cosh x − 1 = 2 sinh²(x/2).
#[test]
fn roots_of_even_powers_at_zero() {
    check("sqrt(x^4 + x^6)", &[], 0.0, &[0.0, 0.0, 2.0]);
    let r = 5_f64.sqrt();
    let second = 2.0 * r + 20.0 / r - 16.0 / (5.0 * r);
    let expected = [4.0 * r, 4.0 * r + 8.0 / r, second];
    check("sqrt(x^4 + x^6)", &[], 2.0, &expected);
    for energy in [
        "sqrt(1 - cos(x))^3",
        "(1 - cos(x))^1.5",
        "sqrt(k*(1 - cos(x)))^3",
        "(cosh(x) - 1)^1.5",
    ] {
        let parameters: &[_] = match energy.contains('k') {
            true => &[("k", 1.0)],
            false => &[],
        };
        check(energy, parameters, 0.0, &[0.0, 0.0, 0.0]);
        let ((s, c), sign) = match energy.contains("cosh") {
            true => ((0.25_f64.sinh(), 0.25_f64.cosh()), 1.0),
            false => (0.25_f64.sin_cos(), -1.0),
        };
        let eight = 8_f64.sqrt();
        let first = 1.5 * eight * s * s * c;
        let second = 1.5 * eight * (s * c * c + sign * s.powi(3) / 2.0);
        let value = eight * s.powi(3);
        check(energy, parameters, 0.5, &[value, first, second]);
        check(energy, parameters, -0.5, &[value, -first, second]);
    }
    // 1 − cos x is rounded to zero here.
    check("sqrt(1 - cos(x))", &[], 1e-9, &[1e-9 * 0.5_f64.sqrt()]);
}

/// Logistic functions and hyperbolic secants far from their step, where the exponentials in them are infinite.
#[test]
fn steps_of_exponentials_far_away() {
    for (energy, before, after) in [
        ("1/(1 + exp(-x/e))", [0.0, 0.0, 0.0], [1.0, 0.0, 0.0]),
        ("exp(x/e)/(1 + exp(x/e))", [0.0, 0.0, 0.0], [1.0, 0.0, 0.0]),
        ("2/(1 + exp(-2*x/e)) - 1", [-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]),
        ("x/(1 + exp(-x/e))", [0.0, 0.0, 0.0], [1.0, 1.0, 0.0]),
        ("1/cosh(x/e)^2", [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]),
        ("1/(exp(x/e) + exp(-x/e))", [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]),
        (
            "(exp(x/e) - exp(-x/e))/(exp(x/e) + exp(-x/e))",
            [-1.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
        ),
    ] {
        check(energy, &[("e", 1e-4)], -1.0, &before);
        check(energy, &[("e", 1e-4)], 1.0, &after);
    }
    // The slopes of functions that are infinite themselves.
    for energy in ["e*ln(cosh(x/e))", "e*ln(1 + exp(x/e))"] {
        let text = format!("coordinates(x), lagrangian = dot(x)^2/2 - {energy}");
        let found = results_of(&text, &[("e", 1e-4)], ALL, &[1.0], &[0.0]);
        assert_eq!((found.q[0], found.qq[0][0]), (-1.0, 0.0), "{energy}");
    }
    let text = "coordinates(x), lagrangian = dot(x)^2/2, force(x) = -2/(1 + exp(-dot(x)/e)) + 1";
    let found = results_of(text, &[("e", 1e-4)], ALL, &[0.0], &[-1.0]);
    assert_eq!((found.force[0], found.force_z[0][0]), (1.0, 0.0));
    // In the step.
    let s = 1.0 / (1.0 + (-0.3_f64).exp());
    let slope = s * (1.0 - s);
    let expected = [s, slope, slope * (1.0 - 2.0 * s)];
    check("1/(1 + exp(-x/e))", &[("e", 1.0)], 0.3, &expected);
    let (t, square) = (0.3_f64.tanh(), 0.3_f64.cosh().powi(-2));
    let expected = [square, -2.0 * t * square, (6.0 * t * t - 2.0) * square];
    check("1/cosh(x/e)^2", &[("e", 1.0)], 0.3, &expected);
    let value = 0.5 * square.sqrt();
    let expected = [value, -t * value, (2.0 * t * t - 1.0) * value];
    check("1/(exp(x) + exp(-x))", &[], 0.3, &expected);
    // The difference of the exponentials has no digits here.
    let expected = [1e-17 / 3.0, 1.0 / 3.0];
    check("(exp(x/3) - exp(-x/3))/2", &[], 1e-17, &expected);
}

/// ln cosh u = |u| − ln 2 and ln(r + d eᵘ) = u + ln d where the arguments are infinite.
#[test]
fn logarithms_of_exponentials_far_away() {
    let (two, three) = (2_f64.ln(), 3_f64.ln());
    let parameters = [("e", 1e-4), ("d", 3.0)];
    for (energy, x, expected) in [
        ("e*ln(cosh(x/e))", 1.0, [1.0 - 1e-4 * two, 1.0, 0.0]),
        ("e*ln(cosh(x/e))", -1.0, [1.0 - 1e-4 * two, -1.0, 0.0]),
        ("e*ln(exp(x/e) + exp(-x/e))", -1.0, [1.0, -1.0, 0.0]),
        ("e*ln(1 + exp(x/e))", 1.0, [1.0, 1.0, 0.0]),
        ("e*ln(1 + exp(x/e))", -1.0, [0.0, 0.0, 0.0]),
        ("e*ln(2 + 3*exp(x/e))", 1.0, [1.0 + 1e-4 * three, 1.0, 0.0]),
        ("e*ln(2 + d*exp(x/e))", 1.0, [1.0 + 1e-4 * three, 1.0, 0.0]),
        ("x*ln(cosh(x/e))", 1.0, [1e4 - two, 2e4 - two, 2e4]),
    ] {
        let parameters = &parameters[..1 + usize::from(energy.contains("d*"))];
        check(energy, parameters, x, &expected);
    }
    let (t, value) = (0.3_f64.tanh(), 0.3_f64.cosh().ln());
    check("ln(cosh(x))", &[], 0.3, &[value, t, 1.0 - t * t]);
    // What has no value keeps none.
    let text = "coordinates(x), lagrangian = dot(x)^2/2 - ln(1 - exp(x))";
    let found = results_of(text, &[], ALL, &[800.0], &[0.0]);
    assert!(found.value.is_nan());
}

/// An exponential vanishes faster than the poles in its exponent grow.
#[test]
fn exponentials_of_poles() {
    let bump = "select(abs(x) < 1, exp(-1/(1 - x^2)), 0)";
    for (energy, x) in [
        ("exp(-1/x^2)", 0.0),
        ("exp(-1/x^2)", 1e-200),
        ("x*exp(-1/x^2)", 0.0),
        ("exp(-1/abs(x))", 0.0),
        ("exp(-1/(3*abs(x)))", 0.0),
        // The quotient 1/(3 |x|), which is infinite, is computed for the exponent.
        ("x*exp(-1/(3*abs(x)))", 0.0),
        ("x^2*exp(-1/(3*abs(x)))", 0.0),
        (bump, 1.0),
        (bump, -1.0),
        (bump, 1.0 - 1e-9),
    ] {
        check(energy, &[], x, &[0.0, 0.0, 0.0]);
    }
    let e = (-4_f64).exp();
    check("exp(-1/x^2)", &[], 0.5, &[e, 16.0 * e, 160.0 * e]);
    for energy in [
        "exp(-1/hypot(x, y))",
        "exp(-1/(x^2 + y^2))",
        "exp(-1/norm([x, y]))",
    ] {
        let text = format!("coordinates(x, y), lagrangian = (dot(x)^2 + dot(y)^2)/2 - {energy}");
        for q in [[0.0; 2], [3e-9, 4e-9], [3e-160, 4e-160], [1e-300, 0.0]] {
            let found = results_of(&text, &[], ALL, &q, &[0.0; 2]);
            assert_eq!(found.q, [0.0; 2], "{energy}");
            assert_eq!(found.qq.concat(), [0.0; 4], "{energy}");
        }
    }
    // With h = 1/2: slopes E h⁻² x/h, and second derivatives from E (h⁻⁴ − 2 h⁻³) along x and E h⁻³ across.
    let text = "coordinates(x, y), lagrangian = (dot(x)^2 + dot(y)^2)/2 - exp(-1/hypot(x, y))";
    let found = results_of(text, &[], ALL, &[0.5, 0.0], &[0.0; 2]);
    let e = (-2_f64).exp();
    close(-found.q[0], 4.0 * e, "slope");
    assert!(found.qq[0][0].abs() <= 1e-14, "along x: {}", found.qq[0][0]);
    close(-found.qq[1][1], 8.0 * e, "across");
}

/// Friction −μ tanh(h/ε) v/h with h = |v|, and with other functions: zero at rest, where its slope is −μ/ε in each
/// direction.
#[test]
fn friction_in_the_plane_at_rest() {
    let parameters = [("mu", 0.6), ("eps", 0.125)];
    for function in ["tanh", "atan", "sin"] {
        for h in ["norm([dot(x), dot(y)])", "hypot(dot(x), dot(y))"] {
            let force = |v: &str| format!("force({v}) = -mu*{function}({h}/eps)*dot({v})/{h}");
            let (x, y) = (force("x"), force("y"));
            let text = format!("coordinates(x, y), lagrangian = (dot(x)^2 + dot(y)^2)/2, {x}, {y}");
            // A motion that comes to rest gets near enough that the third power of h is zero.
            for v in [[0.0; 2], [3e-110, 4e-110]] {
                let found = results_of(&text, &parameters, ALL, &[0.0; 2], &v);
                close(found.force[0], -4.8 * v[0], function);
                close(found.force[1], -4.8 * v[1], function);
                assert_eq!(found.force_z.concat(), [-4.8, 0.0, 0.0, -4.8], "{h}");
            }
        }
    }
    let h = "norm([dot(x), dot(y), dot(z)])";
    let text = format!(
        "coordinates(x, y, z), lagrangian = (dot(x)^2 + dot(y)^2 + dot(z)^2)/2, force(x) = -mu*tanh({h}/eps)*dot(x)/{h}"
    );
    let found = results_of(&text, &parameters, ALL, &[0.0; 3], &[0.0; 3]);
    assert_eq!(found.force_z[0], [-4.8, 0.0, 0.0]);
    // In motion, with h = 0.05.
    let h = "hypot(dot(x), dot(y))";
    let text = format!(
        "coordinates(x, y), lagrangian = (dot(x)^2 + dot(y)^2)/2, force(x) = -mu*tanh({h}/eps)*dot(x)/{h}"
    );
    let found = results_of(&text, &parameters, ALL, &[0.0; 2], &[0.03, 0.04]);
    let t = 0.4_f64.tanh();
    let (over, slope) = (t / 0.05, (1.0 - t * t) / 0.125);
    close(found.force[0], -0.6 * t * 0.6, "force");
    close(
        found.force_z[0][0],
        -0.6 * (0.64 * over + 0.36 * slope),
        "by x",
    );
    close(found.force_z[0][1], -0.6 * 0.48 * (slope - over), "by y");
}

/// Smooth functions of a distance have a tangent at zero.
#[test]
fn even_functions_of_distances_at_zero() {
    for (energy, tangent) in [
        ("cos(norm([x, y]))", -1.0),
        ("cosh(hypot(x, y)/l)", 4.0),
        ("l*ln(cosh(norm([x, y])/l))", 2.0),
        ("norm([x, y])*sin(norm([x, y]))", 2.0),
        ("norm([x, y])*abs(sin(norm([x, y])))", 2.0),
        ("sqrt(x^2 + y^2)*abs(tanh(sqrt(x^2 + y^2)))", 2.0),
        ("hypot(x, y)*max(sin(hypot(x, y)), 0)", 2.0),
        ("norm([x, y])*min(norm([x, y]), 3)", 2.0),
        ("abs(x^2 + y^2)", 2.0),
        ("abs(sin(hypot(x, y)))^2", 2.0),
        ("exp(-norm([x, y])^2)", -2.0),
    ] {
        let text = format!("coordinates(x, y), lagrangian = (dot(x)^2 + dot(y)^2)/2 - {energy}");
        let parameters: &[_] = match energy.contains('l') {
            true => &[("l", 0.5)],
            false => &[],
        };
        let found = results_of(&text, parameters, ALL, &[0.0; 2], &[0.0; 2]);
        assert_eq!(found.q, [0.0; 2], "{energy}");
        let expected = [-tangent, 0.0, 0.0, -tangent];
        assert_eq!(found.qq.concat(), expected, "{energy}");
    }
    // So near zero that the third power of the distance is zero.
    let text = "coordinates(x, y), lagrangian = (dot(x)^2 + dot(y)^2)/2 - hypot(x, y)*abs(sin(hypot(x, y)))";
    let found = results_of(text, &[], ALL, &[3e-160, 4e-160], &[0.0; 2]);
    close(-found.q[0], 6e-160, "slope");
    close(-found.qq[0][0], 2.0, "tangent");
    assert!(found.qq[0][1].abs() <= 1e-150);
}

/// Functions of powers of distances with a field as exponent: e^(−h²) has the tangent −2 at zero, and e^(−h³) none.
#[test]
fn functions_of_powers_of_distances_at_zero() {
    let of = |energy: &str, c: f64, q: [f64; 2]| {
        let text = format!("coordinates(x, y), lagrangian = (dot(x)^2 + dot(y)^2)/2 - {energy}");
        results_of(&text, &[("c", c)], ALL, &q, &[0.0; 2])
    };
    for (energy, c, tangent) in [
        ("exp(-norm([x, y])^c)", 2.0, -2.0),
        ("exp(-norm([x, y])^c)", 3.0, 0.0),
        ("exp(-hypot(x, y)^c)", 2.0, -2.0),
        ("exp(-(x^2 + y^2)^c)", 1.0, -2.0),
        ("cos(hypot(x, y)^c)", 2.0, 0.0),
    ] {
        let found = of(energy, c, [0.0; 2]);
        assert_eq!(found.q, [0.0; 2], "{energy}");
        let expected = [-tangent, 0.0, 0.0, -tangent];
        assert_eq!(found.qq.concat(), expected, "{energy}");
    }
    let found = of("exp(-norm([x, y])^c)", 2.0, [0.3, 0.4]);
    let e = (-0.25_f64).exp();
    close(-found.q[0], -0.6 * e, "slope");
    close(-found.qq[0][0], (0.36 - 2.0) * e, "tangent");
    close(-found.qq[0][1], 0.48 * e, "tangent");
}

/// What depends on the direction has no limit.
#[test]
fn directions_have_no_limit() {
    for (energy, q) in [
        ("norm([x, y, z])", [0.0; 3]),
        ("hypot(x, y)", [0.0; 3]),
        ("x*y/norm([x, y])", [0.0; 3]),
        ("x*y*z/norm([x, y, z])^2", [0.0; 3]),
        ("x^2*y^2/norm([x, y])^3", [0.0; 3]),
    ] {
        let text = format!(
            "coordinates(x, y, z), lagrangian = (dot(x)^2 + dot(y)^2 + dot(z)^2)/2 - z^2 - {energy}"
        );
        let found = results_of(&text, &[], ALL, &q, &[0.0; 3]);
        assert!(found.q[0].is_nan() && found.qq[0][1].is_nan(), "{energy}");
    }
}
