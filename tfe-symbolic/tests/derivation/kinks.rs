//! Second derivatives of products of functions with kinks at the same place, where the product is smooth: beside closed forms.

use crate::kernels::results_of;
use crate::singular::{ALL, check, close};

/// Products of functions with kinks at the same place: |x| |sin x| is x sin x near zero. Signs are zero there, and so were products of two.
#[test]
fn kinks_that_make_a_smooth_product() {
    for (energy, second) in [
        ("abs(x)*abs(sin(x))", 2.0),
        ("abs(x)*tanh(abs(x))", 2.0),
        ("abs(x)*abs(2*x)", 4.0),
        ("abs(x)*sqrt(x^2)", 2.0),
        ("hypot(x, 0)*abs(x)", 2.0),
        ("abs(sin(x))^2", 2.0),
        ("abs(x)*abs(x)*cos(x)", 2.0),
        ("abs(x)*min(x, -x)", -2.0),
        ("abs(x)*select(x > 0, x, -x)", 2.0),
        ("select(x > 0, x, -x)*select(x < 0, -x, x)", 2.0),
        ("max(x, 0)*min(x, 0)", 0.0),
        ("max(x, 0)*max(-sin(x), 0)", 0.0),
        ("(abs(x) + x)*(abs(x) - x)", 0.0),
        ("abs(sin(x))*abs(sin(2*x))", 4.0),
        ("abs(x)*abs(sin(abs(x)))", 2.0),
        ("abs(x)*abs(x + x^3)", 2.0),
        ("abs(x)*(1 - exp(-abs(x)))", 2.0),
    ] {
        check(energy, &[], 0.0, &[0.0, 0.0, second]);
    }
    // Inside other functions.
    for (energy, value, second) in [
        ("cos(abs(x) + sinh(abs(x)))", 1.0, -4.0),
        ("cos(abs(x) + sin(x)^2)", 1.0, -1.0),
        ("sqrt(1 + abs(x)*abs(sin(x)))", 1.0, 1.0),
        ("exp(-abs(x)*abs(tanh(x)))", 1.0, -2.0),
    ] {
        check(energy, &[], 0.0, &[value, 0.0, second]);
    }
    check("abs(x - 1)*abs(x^2 - 1)", &[], 1.0, &[0.0, 0.0, 4.0]);
    check("abs(x)*abs(c*x)", &[("c", -3.0)], 0.0, &[0.0, 0.0, 6.0]);
    check(
        "abs(x - c)*tanh(abs(x - c))",
        &[("c", 3.0)],
        3.0,
        &[0.0, 0.0, 2.0],
    );
    let (s, c) = 0.3_f64.sin_cos();
    for x in [0.3_f64, -0.3] {
        let expected = [0.3 * s, x.signum() * (s + 0.3 * c), 2.0 * c - 0.3 * s];
        check("abs(x)*abs(sin(x))", &[], x, &expected);
    }
}

/// arccos(cos x) = |x| for |x| ≤ π, with all digits where the cosine is rounded to one.
#[test]
fn angles_of_cosines() {
    for x in [0.0, 1e-8, -1e-8, 1e-160, 2.5, -3.0] {
        check("acos(cos(x))^2", &[], x, &[x * x, 2.0 * x, 2.0]);
    }
    check("acos(cos(x))", &[], -1e-8, &[1e-8, -1.0, 0.0]);
    // Beyond π the angle is 2 π − x.
    let angle = std::f64::consts::TAU - 4.0;
    check(
        "acos(cos(x))^2",
        &[],
        4.0,
        &[angle * angle, -2.0 * angle, 2.0],
    );
    check(
        "acos(cos(c*x))^2/c^2",
        &[("c", 3.0)],
        1e-9,
        &[1e-18, 2e-9, 2.0],
    );
}

/// The same beside powers with a field as exponent: |x|ᶜ |sin x| with c = 1, and |x|ᶜ g(x) with c = 2, in which the sign of x is squared.
#[test]
fn powers_of_fields_that_make_a_smooth_product() {
    for (energy, c, second) in [
        ("abs(x)^c*abs(sin(x))", 1.0, 2.0),
        ("abs(x)^c*abs(sin(x))", 2.0, 0.0),
        ("abs(x)^c*abs(sin(x))", 3.0, 0.0),
        ("select(x > 0, x, -x)*abs(x)^c", 1.0, 2.0),
        ("abs(x)^c*(abs(x) + abs(sin(x)))", 1.0, 4.0),
        ("abs(x)^c*(1 + x)", 2.0, 2.0),
        ("abs(x)^c*(1 + x)", 3.0, 0.0),
    ] {
        check(energy, &[("c", c)], 0.0, &[0.0, 0.0, second]);
    }
    let (s, c) = 0.3_f64.sin_cos();
    for x in [0.3_f64, -0.3] {
        let expected = [0.3 * s, x.signum() * (s + 0.3 * c), 2.0 * c - 0.3 * s];
        check("abs(x)^c*abs(sin(x))", &[("c", 1.0)], x, &expected);
    }
}

/// 3 |x|ᶜ + |x|²ᶜ⁺¹ and the like as sums so large that they are differentiated backward, where a sign stands beside a sum with its square.
#[test]
fn squares_of_signs_in_backward_sweeps() {
    for (energy, first, second) in [
        ("abs(x)^c*(3 + abs(x)*abs(x)^c)", 0.0, 6.0),
        (
            "(1 + x)^2*exp(x)*(3 + abs(x)^c*(1 + x)^2*exp(x))",
            9.0,
            23.0,
        ),
    ] {
        const COUNT: usize = 16;
        let names: Vec<String> = (0..COUNT).map(|k| format!("x{k}")).collect();
        let energy = energy.replace("exp", "EXP");
        let terms = names
            .iter()
            .map(|x| format!("dot({x})^2/2 - {}", energy.replace('x', x)));
        let terms: Vec<String> = terms.collect();
        let (names, terms) = (names.join(", "), terms.join(" + ").replace("EXP", "exp"));
        let text = format!("coordinates({names}), lagrangian = {terms}");
        let found = results_of(&text, &[("c", 2.0)], ALL, &[0.0; COUNT], &[0.0; COUNT]);
        for k in 0..COUNT {
            close(-found.q[k], first, &energy);
            close(-found.qq[k][k], second, &energy);
        }
    }
}

/// Products of kinks whose places are the same for some values of parameters only, or two zeros of polynomials: |x − a| |x − b| with a = b.
#[test]
fn kinks_that_meet() {
    let equal = [("a", 2.0), ("b", 2.0)];
    for (energy, second) in [
        ("abs(x - a)*abs(x - b)", 2.0),
        ("abs(x - a)*abs(b - x)", 2.0),
        ("abs(x - a)*tanh(abs(x - b))", 2.0),
        ("abs(x - a)*abs(3*x - 3*b)", 6.0),
        ("max(x - a, 0)*max(b - x, 0)", 0.0),
        ("(max(x - a, 0) + max(b - x, 0))^2", 2.0),
    ] {
        check(energy, &equal, 2.0, &[0.0, 0.0, second]);
    }
    // Where they differ the potential has kinks: beside these, and at one of them.
    let apart = [("a", 2.0), ("b", 1.0)];
    check("abs(x - a)*abs(x - b)", &apart, 1.5, &[0.25, 0.0, -2.0]);
    check("abs(x - a)*abs(x - b)", &apart, 3.0, &[2.0, 3.0, 2.0]);
    check("abs(x - a)*abs(x - b)", &apart, 2.0, &[0.0, 0.0, 0.0]);
    for (energy, second) in [
        ("abs(x^2 - 1)*abs(x^4 - 1)", 16.0),
        ("abs(x^2 - 1)*abs(x^3 - 1)", 12.0),
    ] {
        check(energy, &[], 1.0, &[0.0, 0.0, second]);
    }
    check("abs(x^2 - 1)*abs(x^4 - 1)", &[], -1.0, &[0.0, 0.0, 16.0]);
    check("abs(x^2 - 1)*abs(x^4 - 1)", &[], 2.0, &[45.0, 156.0, 430.0]);
}

/// Sums of jumps at the same place: stops without a gap, and functions that are written by pieces. Each term has the value of one of its
/// sides there, and not all of them of the same.
#[test]
fn sums_of_kinks_that_meet() {
    for (energy, expected) in [
        ("max(x, 0) + min(x, 0)", [0.0, 1.0, 0.0]),
        ("max(x, 0) - max(-x, 0)", [0.0, 1.0, 0.0]),
        ("abs(x) - 2*max(x, 0)", [0.0, -1.0, 0.0]),
        ("max(x, 0)^2 + min(x, 0)^2", [0.0, 0.0, 2.0]),
        ("3*max(x, 0)^2 + 3*max(-x, 0)^2", [0.0, 0.0, 6.0]),
        (
            "select(x > 0, x^2, 0) + select(x < 0, x^2, 0)",
            [0.0, 0.0, 2.0],
        ),
    ] {
        check(energy, &[], 0.0, &expected);
    }
    // With and without a gap.
    let stops = "3*max(x - a, 0)^2 + 3*max(b - x, 0)^2";
    let closed = [("a", 2.0), ("b", 2.0)];
    check(stops, &closed, 2.0, &[0.0, 0.0, 6.0]);
    check(stops, &closed, 3.0, &[3.0, 6.0, 6.0]);
    let open = [("a", 2.0), ("b", 1.0)];
    check(stops, &open, 1.5, &[0.0, 0.0, 0.0]);
    check(stops, &open, 3.0, &[3.0, 6.0, 6.0]);
    let play = "3*max(abs(x) - a, 0)^2";
    check(play, &[("a", 0.0)], 0.0, &[0.0, 0.0, 6.0]);
    check(play, &[("a", 1.0)], 0.0, &[0.0, 0.0, 0.0]);
    check(play, &[("a", 1.0)], -2.0, &[3.0, -6.0, 6.0]);
}

/// Stops between two bodies, of which the quantities that vanish are multiples of each other; and two kinks of different directions,
/// which have no limit together.
#[test]
fn sums_of_kinks_of_several_coordinates() {
    let of = |energy: &str, q: [f64; 2]| {
        let text = format!("coordinates(x, y), lagrangian = (dot(x)^2 + dot(y)^2)/2 - {energy}");
        let parameters = [("a", 1.0), ("b", -1.0)];
        let found = results_of(&text, &parameters, ALL, &q, &[0.0; 2]);
        (found.q, found.qq.concat())
    };
    let stops = "(3*max(x - y - a, 0)^2 + 3*max(2*y - 2*x - 2*b, 0)^2/4)";
    let stiffness = vec![-6.0, 6.0, 6.0, -6.0];
    assert_eq!(of(stops, [2.0, 1.0]), (vec![0.0; 2], stiffness.clone()));
    assert_eq!(of(stops, [4.0, 1.0]), (vec![-12.0, 12.0], stiffness));
    let crossing = "(max(x - a, 0)^2 + max(-x - b, 0)^2 + max(y - a, 0)^2)";
    assert_eq!(of(crossing, [1.0; 2]).1, [-2.0, 0.0, 0.0, -2.0]);
}

/// Where both sides differ nothing is changed: the sign of zero is zero, and of equal arguments `max` takes the first.
#[test]
fn jumps_of_the_curvature_stay() {
    for (energy, second) in [
        ("abs(x)*abs(x - 1)", 0.0),
        ("(abs(x) + x)^2", 4.0),
        ("abs(x)*(abs(sin(x)) + x)", 0.0),
        ("max(x, 0)*max(sin(x), 0)", 2.0),
    ] {
        let text = format!("coordinates(x), lagrangian = dot(x)^2/2 - {energy}");
        let found = results_of(&text, &[], ALL, &[0.0], &[0.0]);
        assert_eq!(-found.qq[0][0], second, "{energy}");
    }
}

/// The same of differences of coordinates, of a dissipation, and of an energy that is differentiated backward, as large ones are.
#[test]
fn kinks_of_several_coordinates_that_make_a_smooth_product() {
    for energy in ["abs(x - y)*tanh(abs(x - y))", "abs(x - y)*abs(sin(x - y))"] {
        let text = format!("coordinates(x, y), lagrangian = (dot(x)^2 + dot(y)^2)/2 - {energy}");
        let found = results_of(&text, &[], ALL, &[2.0; 2], &[0.0; 2]);
        assert_eq!(found.q, [0.0; 2], "{energy}");
        assert_eq!(found.qq.concat(), [-2.0, 2.0, 2.0, -2.0], "{energy}");
    }
    let text = "coordinates(x, y), lagrangian = (dot(x)^2 + dot(y)^2)/2 - abs(x*y)*abs(x)";
    let found = results_of(text, &[], ALL, &[0.0, -3.0], &[0.0; 2]);
    assert_eq!(found.qq.concat(), [-6.0, 0.0, 0.0, 0.0]);
    let text = "coordinates(x), lagrangian = dot(x)^2/2, dissipation = mu*abs(dot(x))*tanh(abs(dot(x))/eps)";
    let parameters = [("mu", 0.6), ("eps", 0.125)];
    let found = results_of(text, &parameters, ALL, &[0.0], &[0.0]);
    assert_eq!((found.force[0], found.force_z[0][0]), (0.0, -9.6));
    const COUNT: usize = 20;
    let names: Vec<String> = (0..COUNT).map(|k| format!("x{k}")).collect();
    let terms = names
        .iter()
        .map(|x| format!("dot({x})^2/2 - abs({x})*tanh(abs({x}))"));
    let terms: Vec<String> = terms.collect();
    let text = format!(
        "coordinates({}), lagrangian = {}",
        names.join(", "),
        terms.join(" + ")
    );
    let found = results_of(&text, &[], ALL, &[0.0; COUNT], &[0.0; COUNT]);
    for k in 0..COUNT {
        assert_eq!((found.q[k], found.qq[k][k]), (0.0, -2.0), "{k}");
    }
}
