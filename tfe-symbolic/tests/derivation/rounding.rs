//! Formulas in differences keep their digits: kernels beside closed forms at states where rewritten formulas would lose them.

use crate::kernels::results_of;
use tfe_symbolic::program::Request;

const UP_TO_FIRST: Request = Request {
    value: true,
    ..Request::FIRST
};

#[track_caller]
fn close(found: f64, expected: f64) {
    // A dozen roundings.
    let tolerance = 12.0 * f64::EPSILON * expected.abs();
    assert!(
        (found - expected).abs() <= tolerance,
        "{found} instead of {expected}"
    );
}

#[test]
fn powers_of_differences_are_not_multiplied_out() {
    let text =
        "coordinates(x, y), lagrangian = (dot(x)^2 + dot(y)^2)/2 - k*(abs(y) - l)^2 - c*(x - y)^4";
    let parameters = [("k", 0.0), ("l", 1.0), ("c", 0.3)];
    let second = Request {
        second: true,
        ..UP_TO_FIRST
    };
    for s in [1.0, 1e3, 1e4, 1e5, 1e6, 1e9] {
        for request in [UP_TO_FIRST, second] {
            let found = results_of(text, &parameters, request, &[s, s + 0.5], &[0.0; 2]);
            close(found.q[0], 0.15);
            close(found.q[1], -0.15);
            close(found.value, -0.3 / 16.0);
        }
        let found = results_of(text, &parameters, second, &[s, s + 0.5], &[0.0; 2]);
        close(found.qq[0][0], -0.9);
        close(found.qq[0][1], 0.9);
    }
}

#[test]
fn masses_that_are_squares_of_differences_keep_their_digits() {
    let text = "coordinates(x, y), lagrangian = m*(x - y)^2*dot(x)^2/2 + dot(y)^2/2";
    let request = Request {
        mass: true,
        second: true,
        ..UP_TO_FIRST
    };
    for s in [1.0, 1e4, 1e8] {
        let found = results_of(text, &[("m", 3.0)], request, &[s, s + 0.25], &[2.0, 1.0]);
        close(found.zz[0][0], 0.1875);
        close(found.z[0], 0.375);
        close(found.q[0], -3.0);
        close(found.zq[0][1], 3.0);
    }
}

#[test]
fn springs_agree_in_all_kernels() {
    let text =
        "coordinates(q, r), lagrangian = dot(q)^2/2 + dot(r)^2/2 - k/2*(l - q)^2 - k/2*(q - r)^2";
    for (l, q, r) in [
        (1.0, 1.0 - 1e-9, 1.0),
        (1e6, 1e6 + 0.125, 1e6 - 0.5),
        (0.3, 0.1, 1e8),
    ] {
        let parameters = [("k", 7.0), ("l", l)];
        for request in [
            UP_TO_FIRST,
            Request {
                second: true,
                ..UP_TO_FIRST
            },
            Request {
                mass: true,
                ..UP_TO_FIRST
            },
        ] {
            let found = results_of(text, &parameters, request, &[q, r], &[0.0; 2]);
            close(found.q[0], 7.0 * (l - q) - 7.0 * (q - r));
            close(found.q[1], 7.0 * (q - r));
        }
    }
}

#[test]
fn sums_of_large_offsets_keep_their_order() {
    // (x − y) + (l − m), both exact.
    let text = "coordinates(x, y), lagrangian = dot(x)^2/2 + dot(y)^2/2 - k*((x - y) + (l - m))^2";
    let parameters = [("k", 1.0), ("l", 1e9 + 0.25), ("m", 1e9)];
    let found = results_of(
        text,
        &parameters,
        UP_TO_FIRST,
        &[1e12 + 0.5, 1e12],
        &[0.0; 2],
    );
    close(found.q[0], -1.5);
    close(found.value, -0.5625);
}

#[test]
fn second_derivatives_of_distances_do_not_cancel() {
    let second = Request {
        second: true,
        ..UP_TO_FIRST
    };
    // ∂²h/∂x² = y²/h³, and 1/l² of it in x/l; h is x, or x/l, to the last digit.
    let (y, l) = (1e-9, 4.0);
    for (distance, share) in [
        ("norm([x, y])", 1.0),
        ("hypot(x, y)", 1.0),
        ("hypot(y, -x)", 1.0),
        ("norm([x/l, y])", 1.0 / l),
        ("hypot(x/l, y)", 1.0 / l),
        ("hypot(x/4, y)", 1.0 / l),
    ] {
        let text =
            format!("coordinates(x, y), lagrangian = (dot(x)^2 + dot(y)^2)/2 - k*({distance} - l)");
        let parameters = [("k", 3.0), ("l", l)];
        let found = results_of(&text, &parameters, second, &[2.0, y], &[0.0; 2]);
        let h = 2.0 * share;
        let slope = share * y / h;
        close(found.qq[0][0], -3.0 * slope * slope / h);
        close(found.qq[0][1], 3.0 * slope * share * 2.0 / (h * h));
        close(found.qq[1][1], -3.0 / h);
    }
}
