//! Derivatives that are zero times infinity, or zero over zero, and have a limit: beside closed forms.

use crate::kernels::{derivation_of, environment_of, results_of};
use tfe_symbolic::program::interpret::interpret;
use tfe_symbolic::program::{By, Request};

const ALL: Request = Request {
    value: true,
    first: true,
    mass: true,
    second: true,
    observables: true,
    constraint_values: false,
    constraint_rows: false,
    constraint_second: false,
};

#[track_caller]
fn close(found: f64, expected: f64, what: &str) {
    assert!(
        (found - expected).abs() <= 1e-13 * expected.abs(),
        "{what}: {found}, {expected}"
    );
}

/// First and second derivative of a potential of one coordinate.
#[track_caller]
fn check_slopes(energy: &str, parameters: &[(&str, f64)], x: f64, (first, second): (f64, f64)) {
    let text = format!("coordinates(x), lagrangian = dot(x)^2/2 - {energy}");
    let found = results_of(&text, parameters, ALL, &[x], &[0.0]);
    let what = format!("{energy} at {x}");
    close(-found.q[0], first, &what);
    close(-found.qq[0][0], second, &what);
}

/// A slope that is infinite times a branch that is zero is zero.
#[test]
fn roots_and_powers_of_choices() {
    for (energy, x, expected) in [
        ("max(-x, 0)^1.5", 1.0, (0.0, 0.0)),
        ("max(-x, 0)^1.5", -4.0, (-3.0, 0.375)),
        ("max(0, -x)^1.5", 0.0, (0.0, 0.0)),
        ("max(-x, 0)^2.5", 0.0, (0.0, 0.0)),
        ("max(-x, 0)^2.5", -4.0, (-20.0, 7.5)),
        ("max(-x, 0)^1.3", 1.0, (0.0, 0.0)),
        ("max(-x, 0)^1.3", -1.0, (-1.3, 0.39)),
        ("sqrt(max(x, 0))", -1.0, (0.0, 0.0)),
        ("sqrt(max(x, 0))", 4.0, (0.25, -0.03125)),
        ("sqrt(max(x, 0)/3)", -1e300, (0.0, 0.0)),
        ("x*sqrt(max(x, 0))", -1.0, (0.0, 0.0)),
        ("x*sqrt(max(x, 0))", 4.0, (3.0, 0.375)),
        ("select(x > 0, x, 0)^1.5", -1.0, (0.0, 0.0)),
        ("select(x > 0, x, 0)^1.5", 4.0, (3.0, 0.375)),
        ("acosh(max(x, 1))", 0.0, (0.0, 0.0)),
        (
            "acosh(max(x, 1))",
            2.0,
            (1.0 / 3_f64.sqrt(), -2.0 / 27_f64.sqrt()),
        ),
    ] {
        check_slopes(energy, &[], x, expected);
    }
    for (x, expected) in [(1.0, (0.0, 0.0)), (-4.0, (-3.0, 0.375))] {
        check_slopes("max(-x, 0)^c", &[("c", 1.5)], x, expected);
    }
    for (x, expected) in [(0.0, (0.0, 0.0)), (-4.0, (-20.0, 7.5))] {
        check_slopes("max(-x, 0)^c", &[("c", 2.5)], x, expected);
    }
}

/// The force of a contact that is open, and its tangent.
#[test]
fn forces_of_open_contacts() {
    let text =
        "coordinates(y), lagrangian = dot(y)^2/2, force(y) = k*max(-y, 0)^1.5*(1 - c*dot(y))";
    let parameters = [("k", 2.0), ("c", 0.5)];
    for y in [1.0, 0.0] {
        let found = results_of(text, &parameters, ALL, &[y], &[-0.4]);
        assert_eq!(found.force[0], 0.0);
        assert_eq!((found.force_q[0][0], found.force_z[0][0]), (0.0, 0.0));
    }
    let found = results_of(text, &parameters, ALL, &[-4.0], &[-0.4]);
    close(found.force[0], 16.0 * 1.2, "force");
    close(found.force_q[0][0], -6.0 * 1.2, "by y");
    close(found.force_z[0][0], -8.0, "by the velocity");
}

/// A rope that is slack has no force, and is slack where its ends meet.
#[test]
fn slack_ropes() {
    for length in ["norm([x, y])", "hypot(x, y)"] {
        let text = format!(
            "coordinates(x, y), lagrangian = (dot(x)^2 + dot(y)^2)/2 - k/2*max({length} - l, 0)^2"
        );
        let parameters = [("k", 3.0), ("l", 4.0)];
        for q in [[0.0, 0.0], [1.0, -2.0]] {
            let found = results_of(&text, &parameters, ALL, &q, &[0.0; 2]);
            assert!(found.q.iter().all(|x| *x == 0.0), "{length}: {:?}", found.q);
            let mut second = found.qq.iter().flatten();
            assert!(second.all(|x| *x == 0.0), "{length}: {:?}", found.qq);
        }
        let found = results_of(&text, &parameters, ALL, &[3.0, 4.0], &[0.0; 2]);
        close(found.q[0], -1.8, length);
        close(found.qq[0][0], -3.0 * (0.36 + 0.2 * 0.64), length);
        close(found.qq[0][1], -3.0 * (0.48 - 0.2 * 0.48), length);
    }
}

/// Drag with the norm of the velocity: forces hᵐ v and their tangents hᵐ δ + m hᵐ⁻² v v.
#[test]
fn drag_at_rest() {
    let force =
        |factor: &str| format!("force(x) = -c*{factor}*dot(x), force(y) = -c*{factor}*dot(y)");
    let h = "norm([dot(x), dot(y)])";
    let power = |text: &str| text.replace('h', h);
    for (parts, exponent, is_field) in [
        (force(h), 1.0, false),
        (force("hypot(dot(x), dot(y))"), 1.0, false),
        (force(&power("h^0.5")), 0.5, false),
        (force(&power("h^0.7")), 0.7, false),
        (force(&power("h^3")), 3.0, false),
        (force("hypot(dot(x), dot(y))^0.7"), 0.7, false),
        (force("(dot(x)^2 + dot(y)^2)^0.35"), 0.7, false),
        (force(&power("h^m")), 0.7, true),
        (force(&power("h^m")), 1.0, true),
        (force(&power("h^m")), 2.0, true),
        (force("hypot(dot(x), dot(y))^m"), 0.7, true),
        (force("(dot(x)^2 + dot(y)^2)^(m/2)"), 0.7, true),
        (power("dissipation = c*h^3/3"), 1.0, false),
        (power("dissipation = c*h^2.7/2.7"), 0.7, false),
        (power("dissipation = c*h^1.5/1.5"), -0.5, false),
    ] {
        let text = format!("coordinates(x, y), lagrangian = (dot(x)^2 + dot(y)^2)/2, {parts}");
        let mut parameters = vec![("c", 0.3)];
        if is_field {
            parameters.push(("m", exponent));
        }
        // The exponent −1/2 has a force at rest, and no tangent.
        let found = results_of(&text, &parameters, ALL, &[0.0; 2], &[0.0; 2]);
        assert_eq!(found.force, [0.0; 2], "{parts}");
        if exponent > 0.0 {
            assert_eq!(found.force_z.concat(), [0.0; 4], "{parts}");
        }
        for v in [[3.0, 4.0], [3e-9, -4e-9], [3e30, 4e30]] {
            let found = results_of(&text, &parameters, ALL, &[0.0; 2], &v);
            let h = v[0].hypot(v[1]);
            for i in 0..2 {
                let expected = -0.3 * h.powf(exponent) * v[i];
                close(found.force[i], expected, &parts);
                for j in 0..2 {
                    let delta = f64::from(u8::from(i == j));
                    let expected = delta + exponent * (v[i] / h) * (v[j] / h);
                    close(
                        found.force_z[i][j],
                        -0.3 * h.powf(exponent) * expected,
                        &parts,
                    );
                }
            }
        }
    }
}

/// Drag of one coordinate: forces |v|ᵐ v and their slope (m + 1) |v|ᵐ, and springs |x|ᶜ⁺¹/(c + 1), of which that with c = 1 is stiff at zero.
#[test]
fn powers_of_one_velocity_at_rest() {
    for (force, scale, m, is_field) in [
        ("abs(dot(x))^0.7*dot(x)", 1.0, 0.7, false),
        ("abs(2*dot(x))^0.7*dot(x)", 2.0, 0.7, false),
        ("abs(dot(x)/2)^0.3*dot(x)", 0.5, 0.3, false),
        ("abs(dot(x))^(m-1)*dot(x)", 1.0, 0.0, true),
        ("abs(dot(x))^(m-1)*dot(x)", 1.0, 0.5, true),
        ("abs(dot(x))^(m-1)*dot(x)", 1.0, 1.0, true),
        ("abs(dot(x))^(m-1)*dot(x)", 1.0, 2.0, true),
    ] {
        let text = format!("coordinates(x), lagrangian = dot(x)^2/2, force(x) = -c*{force}");
        let mut parameters = vec![("c", 0.3)];
        if is_field {
            parameters.push(("m", m + 1.0));
        }
        let of = |v: f64| results_of(&text, &parameters, ALL, &[0.0], &[v]);
        let slope = |v: f64| -0.3 * (m + 1.0) * (scale * v.abs()).powf(m);
        for v in [3.0, -4.0, 2e-9] {
            let found = of(v);
            close(found.force[0], slope(v) / (m + 1.0) * v, force);
            close(found.force_z[0][0], slope(v), force);
        }
        assert_eq!(of(0.0).force[0], 0.0, "{force}");
        assert_eq!(of(0.0).force_z[0][0], slope(0.0), "{force} at rest");
    }
    for (c, x, expected) in [
        (1.0, 0.0, (0.0, 1.0)),
        (1.0, -4.0, (-4.0, 1.0)),
        (2.0, 0.0, (0.0, 0.0)),
        (2.0, -4.0, (-16.0, 8.0)),
    ] {
        check_slopes("abs(x)^(c+1)/(c+1)", &[("c", c)], x, expected);
    }
}

/// What moves against a stream, and a point on an arm: norms of sums and of products.
#[test]
fn drag_of_relative_velocities() {
    let text = "coordinates(x, y), let s = norm([dot(x) - w, dot(y)]), \
        lagrangian = (dot(x)^2 + dot(y)^2)/2, \
        force(x) = -c*s*(dot(x) - w), force(y) = -c*s*dot(y)";
    let parameters = [("c", 0.3), ("w", 2.0)];
    let found = results_of(text, &parameters, ALL, &[0.0; 2], &[2.0, 0.0]);
    assert_eq!(found.force_z.concat(), [0.0; 4]);
    let found = results_of(text, &parameters, ALL, &[0.0; 2], &[5.0, 4.0]);
    close(found.force_z[0][0], -0.3 * 6.8, "against a stream");
    close(found.force_z[0][1], -0.3 * 2.4, "against a stream");
    // With parameters under the root, or in the power.
    for (factor, size, exponent) in [
        ("sqrt(w*(dot(x)^2 + dot(y)^2))", 10.0, 1.0),
        ("(w*(dot(x)^2 + dot(y)^2))^0.35", 100_f64.powf(0.35), 0.7),
    ] {
        let text = format!(
            "coordinates(x, y), lagrangian = (dot(x)^2 + dot(y)^2)/2, force(x) = -c*{factor}*dot(x)"
        );
        let of = |v: [f64; 2]| results_of(&text, &[("c", 0.3), ("w", 4.0)], ALL, &[0.0; 2], &v);
        assert_eq!(of([0.0; 2]).force_z.concat(), [0.0; 4], "{factor}");
        let found = of([3.0, 4.0]);
        close(
            found.force_z[0][0],
            -0.3 * size * (1.0 + exponent * 0.36),
            factor,
        );
        close(found.force_z[0][1], -0.3 * size * exponent * 0.48, factor);
    }
    let text = "coordinates(r, a), let s = norm([dot(r), r*dot(a)]), \
        lagrangian = (dot(r)^2 + r^2*dot(a)^2)/2, \
        force(r) = -c*s*dot(r), force(a) = -c*s*r^2*dot(a)";
    let found = results_of(text, &[("c", 0.3)], ALL, &[2.0, 0.5], &[0.0; 2]);
    assert_eq!(found.force_z.concat(), [0.0; 4]);
    assert_eq!(found.force_q.concat(), [0.0; 4]);
    let found = results_of(text, &[("c", 0.3)], ALL, &[2.0, 0.5], &[3.0, 2.0]);
    // s = 5: ∂(s r² ȧ)/∂ȧ = r² (s + r² ȧ²/s)
    close(found.force_z[1][1], -0.3 * 4.0 * (5.0 + 3.2), "on an arm");
    close(found.force_z[1][0], -0.3 * 8.0 * 0.6, "on an arm");
    // ∂(s r² ȧ)/∂r = ȧ (2 r s + r³ ȧ²/s)
    close(found.force_q[1][0], -0.3 * 2.0 * (20.0 + 6.4), "on an arm");
}

/// Potentials hⁿ of a distance: −n hⁿ⁻² x and −n hⁿ⁻² (δ + (n − 2) x x/h²).
#[test]
fn powers_of_distances_at_zero() {
    for (energy, n) in [
        ("norm([x, y])^3", 3.0),
        ("hypot(x, y)^3", 3.0),
        ("norm([x, y])^2.5", 2.5),
        ("hypot(x, y)^2.5", 2.5),
        ("norm([x, y])^2.3", 2.3),
        ("hypot(x, y)^2.3", 2.3),
        ("norm([x, y])^1.7", 1.7),
        ("hypot(x, y)^1.7", 1.7),
        ("hypot(x, y)^2", 2.0),
    ] {
        let text = format!("coordinates(x, y), lagrangian = (dot(x)^2 + dot(y)^2)/2 - {energy}");
        let found = results_of(&text, &[], ALL, &[0.0; 2], &[0.0; 2]);
        assert_eq!(found.q, [0.0; 2], "{energy}");
        if n > 2.0 {
            assert!(found.qq.iter().flatten().all(|x| *x == 0.0), "{energy}");
        }
        let found = results_of(&text, &[], ALL, &[3.0, 4.0], &[0.0; 2]);
        let factor = -n * 5_f64.powf(n - 2.0);
        close(found.q[0], 3.0 * factor, energy);
        close(found.qq[0][0], factor * (1.0 + (n - 2.0) * 0.36), energy);
        close(
            found.qq[1][0] + factor,
            factor * (1.0 + (n - 2.0) * 0.48),
            energy,
        );
    }
    // With an exponent that is a field, also where the force is as large near zero as elsewhere.
    let text = "coordinates(x, y), lagrangian = (dot(x)^2 + dot(y)^2)/2 - norm([x, y])^c";
    for c in [1.0, 1.5, 2.0, 3.0] {
        let found = results_of(text, &[("c", c)], ALL, &[0.0; 2], &[0.0; 2]);
        assert_eq!(found.q, [0.0; 2], "{c}");
        if c > 2.0 {
            assert_eq!(found.qq.concat(), [0.0; 4], "{c}");
        }
        let found = results_of(text, &[("c", c)], ALL, &[3.0, 4.0], &[0.0; 2]);
        let factor = -c * 5_f64.powf(c - 2.0);
        close(found.q[0], 3.0 * factor, text);
        close(found.qq[0][0], factor * (1.0 + (c - 2.0) * 0.36), text);
    }
}

/// Potentials hⁿ of h = hypot(u, v), u = x + y, v = x − 2 y: with w = u u′ + v v′, forces −n hⁿ⁻² w and tangents
/// −n hⁿ⁻² (u′ u′ + v′ v′ + (n − 2) w w/h²).
#[test]
fn powers_of_hypot_of_sums_at_zero() {
    let slopes = [[1.0, 1.0], [1.0, -2.0]];
    let product = |i: usize, j: usize| slopes[0][i] * slopes[0][j] + slopes[1][i] * slopes[1][j];
    for (exponent, n) in [
        ("2", 2.0),
        ("2.3", 2.3),
        ("2.5", 2.5),
        ("3", 3.0),
        ("5", 5.0),
    ] {
        let energy = format!("hypot(x + y, x - 2*y)^{exponent}");
        let text = format!("coordinates(x, y), lagrangian = (dot(x)^2 + dot(y)^2)/2 - {energy}");
        let found = results_of(&text, &[], ALL, &[0.0; 2], &[0.0; 2]);
        assert_eq!(found.q, [0.0; 2], "{energy}");
        for i in 0..2 {
            for j in 0..2 {
                // A quadratic energy has the same tangent everywhere.
                let expected = if n > 2.0 { 0.0 } else { -2.0 * product(i, j) };
                assert_eq!(found.qq[i][j], expected, "{energy}");
            }
        }
        let found = results_of(&text, &[], ALL, &[3.0, 1.0], &[0.0; 2]);
        let (u, v) = (4.0, 1.0);
        let h = f64::hypot(u, v);
        let w = [0, 1].map(|i| u * slopes[0][i] + v * slopes[1][i]);
        let factor = -n * h.powf(n - 2.0);
        for i in 0..2 {
            close(found.q[i], factor * w[i], &energy);
            for j in 0..2 {
                let tangent = product(i, j) + (n - 2.0) * w[i] * w[j] / (h * h);
                close(found.qq[i][j], factor * tangent, &energy);
            }
        }
    }
}

/// Cubes of the root of q = a (x² + y²) + b x y: slopes 3 √q q′/2 and curvatures 3 √q q″/2 + 3 q′ q′/(4 √q).
#[test]
fn norms_of_other_quadratic_forms_at_zero() {
    for (energy, a, b) in [
        ("sqrt(x^2 + x*y + y^2)^3", 1.0, 1.0),
        ("sqrt(x^2 - x*y + y^2)^3", 1.0, -1.0),
        ("(2*x^2 + 3*x*y + 2*y^2)^1.5", 2.0, 3.0),
        ("hypot(hypot(x, y), x - y)^3", 2.0, -2.0),
        ("norm([norm([x, y]), x - y])^3", 2.0, -2.0),
    ] {
        let text = format!("coordinates(x, y), lagrangian = (dot(x)^2 + dot(y)^2)/2 - {energy}");
        let found = results_of(&text, &[], ALL, &[0.0; 2], &[0.0; 2]);
        assert_eq!(found.q, [0.0; 2], "{energy}");
        assert_eq!(found.qq.concat(), [0.0; 4], "{energy}");
        let found = results_of(&text, &[], ALL, &[1.0, 3.0], &[0.0; 2]);
        let root = f64::sqrt(10.0 * a + 3.0 * b);
        let slopes = [2.0 * a + 3.0 * b, 6.0 * a + b];
        close(-found.q[0], 1.5 * root * slopes[0], energy);
        close(-found.q[1], 1.5 * root * slopes[1], energy);
        let curvature = |second: f64, i: usize, j: usize| {
            1.5 * root * second + 0.75 * slopes[i] * slopes[j] / root
        };
        close(-found.qq[0][0], curvature(2.0 * a, 0, 0), energy);
        close(-found.qq[0][1], curvature(b, 0, 1), energy);
    }
}

/// Powers of squares with an exponent that is a field: the force −2 k c (k u)ᶜ⁻¹ x vanishes with u = x² + y² where c is one half or more.
#[test]
fn powers_of_squares_at_zero() {
    for (square, k) in [
        ("(x^2 + y^2)", 1.0),
        ("(3*x^2 + 3*y^2)", 3.0),
        ("(x^2)", 1.0),
        ("(x^2/4)", 0.25),
    ] {
        let text =
            format!("coordinates(x, y), lagrangian = (dot(x)^2 + dot(y)^2)/2 - y^2/2 - {square}^c");
        let of = |c: f64, q: &[f64]| results_of(&text, &[("c", c)], ALL, q, &[0.0; 2]);
        for c in [0.5, 0.6, 0.75, 1.0, 1.5, 2.0] {
            assert_eq!(of(c, &[0.0; 2]).q, [0.0; 2], "{square}^{c}");
            let (x, y) = (3.0_f64, if square.contains('y') { 4.0 } else { 0.0 });
            let found = of(c, &[x, y]);
            let u = x * x + y * y;
            let factor = -2.0 * c * k * (k * u).powf(c - 1.0);
            close(found.q[0], factor * x, square);
            let second = factor * (1.0 + 2.0 * (c - 1.0) * x * x / u);
            // Of |x| it is a rounding.
            if c > 0.5 {
                close(found.qq[0][0], second, square);
            }
        }
        // There the force is infinite.
        assert!(of(0.4, &[0.0; 2]).q[0].is_nan(), "{square}");
    }
    let text = "coordinates(x), lagrangian = dot(x)^2/2 - (k*x^2)^c";
    let of = |k: f64, x: f64| results_of(text, &[("k", k), ("c", 0.7)], ALL, &[x], &[0.0]).q[0];
    assert_eq!(of(2.0, 0.0), 0.0);
    assert!(of(-2.0, 1.0).is_nan());
    let text = "coordinates(x), lagrangian = dot(x)^2/2 - (k*x^2)^0.7";
    let of = |k: f64, x: f64| results_of(text, &[("k", k)], ALL, &[x], &[0.0]).q[0];
    assert_eq!(of(2.0, 0.0), 0.0);
    assert!(of(-2.0, 1.0).is_nan());
    // Derivatives of third degree beside a power.
    let text = "coordinates(x, y), lagrangian = (dot(x)^2 + dot(y)^2)/2 - x^2*(x^2 + y^2)^c";
    for c in [0.5, 2.0] {
        let found = results_of(text, &[("c", c)], ALL, &[0.0; 2], &[0.0; 2]);
        assert_eq!(found.q, [0.0; 2], "{c}");
    }
}

/// Sums each of which stands twice in the next: 2³⁸ paths lead through them, which nothing goes along one by one.
#[test]
fn nested_lets_are_read_once() {
    let mut lets = "let u0 = x, let v0 = y, ".to_owned();
    for next in 1..=38 {
        let known = next - 1;
        lets += &format!("let u{next} = u{known}/3 + 2*v{known}/3, ");
        lets += &format!("let v{next} = 2*u{known}/3 + v{known}/3, ");
    }
    let text = format!(
        "coordinates(x, y), {lets} lagrangian = (dot(x)^2 + dot(y)^2)/2 - (u38^2 + v38^2)^1.5 - cos(u20) - 1/(5 + u38)"
    );
    let found = results_of(&text, &[], ALL, &[0.0; 2], &[0.0; 2]);
    close(found.q[0], 0.02, "by x at zero");
    // uₙ = (x + y)/2 + 3⁻ⁿ (x − y)/2 for even n, vₙ with the other sign
    let found = results_of(&text, &[], ALL, &[3.0, 1.0], &[0.0; 2]);
    let small = 3_f64.powi(-20);
    let slope = (2.0 + small).sin() * (1.0 + small) / 2.0;
    let expected = -6.0 * 8_f64.sqrt() + slope + 0.5 / 49.0;
    close(found.q[0], expected, "by x");
}

/// Nothing is chosen where nothing has a limit: distances that never vanish cost what they did.
#[test]
fn distances_without_limits_choose_nothing() {
    for parts in [
        "+ k/norm([x, y])",
        "+ k/norm([x, y]) + c*y^2/norm([x, y])^5",
        "- k/2*(norm([x, y]) - 2)^2",
        "- k/4*(hypot(x, y) - 2)^4",
        "- k*norm([x, y]) - c*sqrt(1 - x^2 - y^2)",
        "- k*sqrt(x^2 + y^2 + c^2)^3",
        ", force(x) = -k*dot(x)/sqrt(dot(x)^2 + dot(y)^2 + c^2)",
        ", force(x) = -k*dot(z)",
    ] {
        let lets = match parts.contains('z') {
            true => "let z = norm([x, y]), ",
            false => "",
        };
        let text = format!("coordinates(x, y), {lets}lagrangian = (dot(x)^2 + dot(y)^2)/2 {parts}");
        let mut parameters = vec![("k", 1.0)];
        if ["c*", "c)", "c^"].iter().any(|with| parts.contains(with)) {
            parameters.push(("c", 0.5));
        }
        let derivation = derivation_of(&text, &parameters);
        let program = derivation.program(ALL).to_string();
        assert!(!program.contains("select"), "{parts}\n{program}");
    }
    // What is chosen in a limit is no kink of the force.
    let text = "coordinates(x, y), lagrangian = (dot(x)^2 + dot(y)^2)/2, force(x) = -c*hypot(dot(x), dot(y))*dot(x)";
    let derivation = derivation_of(text, &[("c", 0.5)]);
    assert!(derivation.structure().smooth);
    assert!(!derivation.forces().to_string().contains("select"));
    let tangent = derivation.program(ALL).to_string();
    assert_eq!(tangent.matches("select").count(), 1, "{tangent}");
}

/// Derivatives by a parameter at rest.
#[test]
fn drag_by_a_parameter_at_rest() {
    let text = "coordinates(x, y), lagrangian = (dot(x)^2 + dot(y)^2)/2, \
        force(x) = -c*norm([dot(x), m*dot(y)])*dot(x), sensitivity(m)";
    let parameters = [("c", 0.3), ("m", 0.5)];
    let program = derivation_of(text, &parameters).program_by(By::Parameter(0));
    for (v, expected) in [([0.0, 0.0], 0.0), ([3.0, 8.0], -0.3 * 3.0 * 32.0 / 5.0)] {
        let environment = environment_of(&parameters, &[0.0; 2], &v);
        let found = interpret(&program, &environment).expect("a complete environment");
        close(found.force[0], expected, "by m");
    }
}

#[test]
fn powers_of_absolute_values_at_zero() {
    let half = 0.5_f64.sqrt();
    for (energy, x, expected) in [
        ("abs(x)^2.5", 0.0, (0.0, 0.0)),
        ("abs(x)^2.5", -4.0, (-20.0, 7.5)),
        ("abs(x)^3.5", 0.0, (0.0, 0.0)),
        ("abs(x)^2.3", 0.0, (0.0, 0.0)),
        ("abs(x)^3", -2.0, (-12.0, 12.0)),
        ("abs(x)^3", 0.0, (0.0, 0.0)),
        ("x*abs(x)", -2.0, (4.0, -2.0)),
        ("x*abs(x)^1.5", 0.0, (0.0, 0.0)),
        ("x*abs(x)^1.5", -4.0, (20.0, -7.5)),
        ("abs(2*x)^2.5", 0.0, (0.0, 0.0)),
        ("abs(-x/2)^2.5", 1.0, (1.25 * half / 2.0, 0.9375 * half)),
        ("(abs(x)/4)^2.5", 0.0, (0.0, 0.0)),
        ("(abs(x)/4)^2.5", -16.0, (-5.0, 0.46875)),
        ("abs(x)*sign(x)*x", -3.0, (-6.0, 2.0)),
        ("(x^2)^1.25", 0.0, (0.0, 0.0)),
        ("(x^2)^1.25", -4.0, (-20.0, 7.5)),
        ("(4*x^2)^1.25", 0.0, (0.0, 0.0)),
        ("(4*x^2)^1.25", -2.0, (-40.0, 30.0)),
        ("abs(x)^1.5", 0.0, (0.0, f64::NAN)),
        ("(x^2)^0.7", 0.0, (0.0, f64::NAN)),
        ("(3*x^2)^0.7", 0.0, (0.0, f64::NAN)),
    ] {
        match expected {
            (first, second) if second.is_nan() => {
                let text = format!("coordinates(x), lagrangian = dot(x)^2/2 - {energy}");
                let found = results_of(&text, &[], ALL, &[x], &[0.0]);
                close(-found.q[0], first, energy);
            }
            expected => check_slopes(energy, &[], x, expected),
        }
    }
    for (x, expected) in [(0.0, (0.0, 0.0)), (-8.0, (-10.0, 1.875))] {
        check_slopes("abs(x/l)^2.5", &[("l", 2.0)], x, expected);
        check_slopes("abs(x*l)^2.5", &[("l", 0.5)], x, expected);
        check_slopes("(x^2*l)^1.25", &[("l", 0.25)], x, expected);
    }
    // Of a coordinate that is never negative, without a choice.
    for (x, expected) in [(0.0, (0.0, 0.0)), (8.0, (10.0, 1.875))] {
        check_slopes("(x/2)^2.5", &[], x, expected);
        check_slopes("(x/l)^2.5", &[("l", 2.0)], x, expected);
        check_slopes("(x*l)^2.5", &[("l", 0.5)], x, expected);
    }
}

/// Polynomials as sums over exponents: 0 x⁻¹ is zero at zero.
#[test]
fn whole_exponents_at_zero() {
    let energy = "sum(i in 0..20, k*x^i)";
    for x in [0.0, 0.5, 1.5] {
        let (mut first, mut second) = (0.0, 0.0);
        for i in 1..20 {
            let n = f64::from(i);
            first += 0.7 * n * f64::powi(x, i - 1);
            if i > 1 {
                second += 0.7 * n * (n - 1.0) * f64::powi(x, i - 2);
            }
        }
        check_slopes(energy, &[("k", 0.7)], x, (first, second));
    }
    let text = format!("coordinates(x), lagrangian = dot(x)^2/2 - {energy}");
    assert!(derivation_of(&text, &[("k", 0.7)]).structure().smooth);
}

/// Numbers whose powers and products leave the range of `f64` stay beside what they multiply.
#[test]
fn numbers_out_of_range_are_not_folded() {
    for (energy, x, value, slope) in [
        ("(1e-200*x)^2", 1e200, 1.0, 2e-200),
        ("(-1e-200*x)^4", 2e200, 16.0, 3.2e-199),
        ("(1e200*x)^2*1e-300", 1e-100, 1e-100, 2.0),
        ("1e-300/(1e-200*x)^2", 1e200, 1e-300, 0.0),
        ("(1e-160*x)^2/3", 3e160, 3.0, 2e-160),
        ("1e-200*(x*1e-200 + 1)", 1e200, 2e-200, 0.0),
        ("sqrt((1e-200*x)^2)", 1e200, 1.0, 1e-200),
        ("cos(1e-200*(1e-200*x)^2)", 1e200, 1.0, 0.0),
    ] {
        let text = format!("coordinates(x), lagrangian = dot(x)^2/2 - {energy}");
        let found = results_of(&text, &[], ALL, &[x], &[0.0]);
        close(-found.value, value, energy);
        let apart = (-found.q[0] - slope).abs();
        assert!(
            apart <= 1e-13 * slope.abs() + f64::MIN_POSITIVE,
            "{energy}: {}",
            found.q[0]
        );
    }
}
