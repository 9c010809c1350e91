//! Elements in closed form, and other maps with known intervals.

use super::*;
use std::convert::Infallible;

/// Σ c_k x^k.
fn polynomial(coefficients: &[f64], x: f64) -> f64 {
    coefficients.iter().rev().fold(0.0, |sum, c| sum * x + c)
}

fn two(a: f64, b: f64, c: f64, d: f64) -> DMatrix<f64> {
    DMatrix::from_row_slice(2, 2, &[a, b, c, d])
}

/// The primal element with exact quadrature for the oscillator of frequency ω, mass one, as a function of its length:
/// the closed forms of sdof_transition.json (polynomials in ρ² = (ωh)²) at ξ = 0.
fn primal(nodes: usize, omega: f64, h: f64) -> DMatrix<f64> {
    let r = (omega * h).powi(2);
    let (a11, a12, a21, d): (&[f64], &[f64], &[f64], &[f64]) = match nodes {
        2 => (&[12.0, -4.0], &[0.0, -12.0, 1.0], &[12.0], &[12.0, 2.0]),
        3 => (
            &[720.0, -312.0, 9.0],
            &[0.0, -720.0, 72.0, -1.0],
            &[720.0, -72.0],
            &[720.0, 48.0, 3.0],
        ),
        4 => (
            &[100800.0, -46080.0, 2160.0, -16.0],
            &[0.0, -100800.0, 12480.0, -240.0, 1.0],
            &[100800.0, -12480.0, 240.0],
            &[100800.0, 4320.0, 120.0, 4.0],
        ),
        _ => (
            &[25401600.0, -11894400.0, 670320.0, -9000.0, 25.0],
            &[0.0, -25401600.0, 3427200.0, -92400.0, 600.0, -1.0],
            &[25401600.0, -3427200.0, 92400.0, -600.0],
            &[25401600.0, 806400.0, 15120.0, 240.0, 5.0],
        ),
    };
    let diagonal = polynomial(a11, r) / polynomial(d, r);
    two(
        diagonal,
        polynomial(a12, r) / polynomial(d, r) / h,
        polynomial(a21, r) / polynomial(d, r) * h,
        diagonal,
    )
}

fn exact(matrix: impl Fn(f64) -> DMatrix<f64>) -> impl Fn(f64) -> Result<DMatrix<f64>, Infallible> {
    move |h| Ok(matrix(h))
}

/// The direct sum of two maps, in the order (p, q) of both.
fn beside(a: &DMatrix<f64>, b: &DMatrix<f64>) -> DMatrix<f64> {
    DMatrix::from_fn(4, 4, |row, column| match (row % 2, column % 2) {
        (0, 0) => a[(row / 2, column / 2)],
        (1, 1) => b[(row / 2, column / 2)],
        _ => 0.0,
    })
}

/// The same map in rotated and rescaled coordinates: no entry is zero, and units differ by 10³.
fn mixed(a: &DMatrix<f64>) -> DMatrix<f64> {
    let (sin, cos) = 0.6_f64.sin_cos();
    let rotation = two(cos, -sin, sin, cos);
    let units = |i: usize| if i < 2 { 1e3 } else { 1.0 };
    let t = DMatrix::from_fn(4, 4, |row, column| {
        if row / 2 == column / 2 {
            units(row) * rotation[(row % 2, column % 2)]
        } else {
            0.0
        }
    });
    let inverse = DMatrix::from_fn(4, 4, |row, column| {
        if row / 2 == column / 2 {
            rotation[(column % 2, row % 2)] / units(column)
        } else {
            0.0
        }
    });
    t * a * inverse
}

#[track_caller]
fn check(
    matrix: impl Fn(f64) -> DMatrix<f64>,
    range: Range<f64>,
    expected: &[(f64, f64)],
) -> Vec<UnstableInterval> {
    let found = unstable_intervals_of(exact(matrix), range).expect("the matrix is smooth");
    assert_eq!(found.len(), expected.len(), "{found:#?}");
    for (interval, &(start, end)) in found.iter().zip(expected) {
        // Ten digits, as the reference table guarantees; most ends are accurate to fifteen.
        assert!(
            (interval.start - start).abs() <= 1e-10 * start,
            "{interval:?}: start {start}"
        );
        assert!(
            (interval.end - end).abs() <= 1e-10 * end,
            "{interval:?}: end {end}"
        );
        assert!(
            interval.start <= interval.worst
                && interval.worst <= interval.end
                && interval.radius > 1.0
        );
    }
    found
}

// stability_bubbles.json
const BUBBLES: [&[(f64, f64)]; 4] = [
    &[(3.4641016151377544, 1e3)],
    &[
        (3.1622776601683795, 3.4641016151377544),
        (7.745966692414834, 1e3),
    ],
    &[
        (3.1424667864528786, 3.1622776601683795),
        (6.48074069840786, 7.745966692414834),
        (13.0431937230128, 1e3),
    ],
    &[
        (3.141615766021812, 3.1424667864528786),
        (6.3059391442248085, 6.48074069840786),
        (10.105951235716665, 13.0431937230128),
        (19.499618752922665, 1e3),
    ],
];
/// (ρ, spectral radius) at the maximum of each bounded interval.
const WORST: [&[(f64, f64)]; 4] = [
    &[],
    &[(3.3112897574651194, 1.129817690854696)],
    &[
        (3.152370555141983, 1.0097426683284882),
        (7.080846266771171, 1.4569235446417232),
    ],
    &[
        (3.142041275983485, 1.0004250877275802),
        (6.3930125082357385, 1.0810743601745418),
        (11.439582675512534, 1.8827297247791923),
    ],
];

#[test]
fn every_bubble_of_the_primal_elements() {
    for (i, nodes) in (2..=5).enumerate() {
        let found = check(|h| primal(nodes, 1.0, h), 0.0..1e3, BUBBLES[i]);
        for (interval, &(worst, radius)) in found.iter().zip(WORST[i]) {
            assert!((interval.radius - radius).abs() <= 1e-13, "{interval:?}");
            // At the flat maximum the position is known to the square root of the rounding error, relative to the
            // width.
            assert!(
                (interval.worst - worst).abs() <= 1e-7 * worst,
                "{interval:?}"
            );
        }
        assert_eq!(found[found.len() - 1].worst, 1e3);
    }
}

#[test]
fn changes_are_the_ends() {
    let changes = stability_changes_of(exact(|h| primal(4, 1.0, h)), 0.0..1e3).expect("smooth");
    let ends: Vec<f64> = BUBBLES[2]
        .iter()
        .flat_map(|&(start, end)| [start, end])
        .filter(|&end| end < 1e3)
        .collect();
    assert_eq!(changes.len(), ends.len());
    for (change, end) in changes.iter().zip(ends) {
        assert!((change - end).abs() <= 1e-13 * end);
    }
}

#[test]
fn physical_units_do_not_matter() {
    // ω = 3·10⁵, m = 10⁻³: the entries differ by ten orders of magnitude.
    let (omega, mass) = (3e5, 1e-3);
    let expected: Vec<(f64, f64)> = BUBBLES[3]
        .iter()
        .map(|&(a, b)| (a / omega, (b / omega).min(1e-4)))
        .collect();
    let matrix = |h| {
        let a = primal(5, omega, h);
        two(a[(0, 0)], a[(0, 1)] * mass, a[(1, 0)] / mass, a[(1, 1)])
    };
    check(matrix, 0.0..1e-4, &expected);
}

#[test]
fn bubbles_of_two_modes_merge_where_they_overlap() {
    let slow: &[(f64, f64)] = BUBBLES[2];
    let mut all: Vec<(f64, f64)> = slow
        .iter()
        .copied()
        .chain(slow.iter().map(|&(a, b)| (a / 1.7, b / 1.7)))
        .collect();
    all.iter_mut()
        .for_each(|interval| interval.1 = interval.1.min(20.0));
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut expected: Vec<(f64, f64)> = Vec::new();
    for (start, end) in all {
        match expected.last_mut() {
            Some(last) if start <= last.1 => last.1 = last.1.max(end),
            _ => expected.push((start, end)),
        }
    }
    let pair = |h| beside(&primal(4, 1.0, h), &primal(4, 1.7, h));
    check(pair, 0.0..20.0, &expected);
    check(|h| mixed(&pair(h)), 0.0..20.0, &expected);
}

#[test]
fn bubbles_of_identical_modes() {
    // Every function has only double zeros and never changes its sign.
    let expected = [
        (BUBBLES[3][0].0, BUBBLES[3][0].1),
        (BUBBLES[3][1].0, BUBBLES[3][1].1),
        (BUBBLES[3][2].0, 12.0),
    ];
    let pair = |h| beside(&primal(5, 1.0, h), &primal(5, 1.0, h));
    check(pair, 0.0..12.0, &expected);
    check(|h| mixed(&pair(h)), 0.0..12.0, &expected);
}

#[test]
fn a_free_mode_beside_a_bubble() {
    // det(A − 1) vanishes identically, and 1 is a defective eigenvalue.
    let pair = |h| beside(&two(1.0, 0.0, h, 1.0), &primal(5, 1.0, h));
    check(
        |h| mixed(&pair(h)),
        0.0..6.4,
        &[BUBBLES[3][0], (BUBBLES[3][1].0, 6.4)],
    );
}

#[test]
fn narrow_bubbles() {
    // a₁₂ and a₂₁ vanish at 3 and 3 + w, and the determinant is one: the interval lies between, with its maximum in the
    // middle.
    for width in [1e-2, 1e-5, 1e-8] {
        let start = 3.0;
        let bubble = move |h: f64| {
            let (b, c) = (h - start, start + width - h);
            let diagonal = -(1.0 + b * c).sqrt();
            two(diagonal, b, c, diagonal)
        };
        let found = unstable_intervals_of(exact(bubble), 2.5..3.5).expect("smooth");
        assert_eq!(found.len(), 1, "{found:?}");
        // The error of the ends is the rounding error of 3 + w − h.
        assert!((found[0].start - start).abs() <= 4.0 * f64::EPSILON * start);
        assert!((found[0].end - start - width).abs() <= 4.0 * f64::EPSILON * start);
        let radius = 0.5 * width + (1.0 + 0.25 * width * width).sqrt();
        assert!((found[0].radius - radius).abs() <= 4.0 * f64::EPSILON);
    }
}

#[test]
fn touching_is_not_unstable() {
    // The mixed element with two nodes (48): the trapezoidal rule.
    let trapezoidal = |h: f64| {
        let d = 4.0 + h * h;
        two(
            (4.0 - h * h) / d,
            -4.0 * h / d,
            4.0 * h / d,
            (4.0 - h * h) / d,
        )
    };
    check(trapezoidal, 0.0..1e3, &[]);
    // The exact flow has eigenvalues −1 and 1 at all multiples of π, and the modes cross in between.
    let flow = |h: f64| two(h.cos(), -h.sin(), h.sin(), h.cos());
    check(flow, 0.0..100.0, &[]);
    check(|h| mixed(&beside(&flow(h), &flow(1.7 * h))), 0.0..50.0, &[]);
    // A defective double eigenvalue: a₂₁ has a double zero.
    let touch = |h: f64| {
        let b = -(h - 1.3) * (h - 1.3) / (3.0 + h * h);
        let diagonal = -(1.0 + b).sqrt();
        two(diagonal, 1.0, b, diagonal)
    };
    check(touch, 0.0..5.0, &[]);
}

#[test]
fn collisions_on_the_circle() {
    // A spinning top: H = ½p² + Ω (p₁q₂ − p₂q₁) + ½(Ω² − 1)q² has the eigenvalues ±i(Ω ± √(Ω² − 1)); its modes, of
    // opposite signature, collide at Ω = 1.
    let spin = |omega: f64| {
        let s = DMatrix::from_row_slice(
            4,
            4,
            &[
                0.0,
                omega,
                1.0 - omega * omega,
                0.0, //
                -omega,
                0.0,
                0.0,
                1.0 - omega * omega, //
                1.0,
                0.0,
                0.0,
                omega, //
                0.0,
                1.0,
                -omega,
                0.0,
            ],
        );
        // The Cayley map of a Hamiltonian matrix is symplectic and maps imaginary eigenvalues to the unit circle.
        let half = s * 0.05;
        let one = DMatrix::<f64>::identity(4, 4);
        (&one - &half).try_inverse().expect("regular") * (&one + &half)
    };
    let changes = stability_changes_of(exact(spin), 0.2..3.0).expect("smooth");
    assert_eq!(changes.len(), 1, "{changes:?}");
    assert!((changes[0] - 1.0).abs() < 1e-12, "{changes:?}");
}

#[test]
fn maps_with_damping() {
    // Explicit Euler of the undamped oscillator: unstable everywhere, ρ = √(1 + h²).
    let euler = |h: f64| two(1.0, -h, h, 1.0);
    let found = check(euler, 0.0..10.0, &[(0.0, 10.0)]);
    assert!((found[0].radius - 101.0_f64.sqrt()).abs() < 1e-13 && found[0].worst == 10.0);
    // … and of the damped one: λ = 1 − h(ξ ± i√(1 − ξ²)), |λ|² = 1 − 2ξh + h²: stable below 2ξ.
    let damped = |xi: f64| move |h: f64| two(1.0 - 2.0 * xi * h, -h, h, 1.0);
    check(damped(0.2), 0.0..10.0, &[(0.4, 10.0)]);
    // Overdamped: λ = 1 − h(ξ + √(ξ² − 1)) = −1.
    check(
        damped(2.0),
        0.0..10.0,
        &[(2.0 / (2.0 + 3.0_f64.sqrt()), 10.0)],
    );
    // Two oscillators: the first to become unstable decides.
    check(
        |h| mixed(&beside(&damped(0.2)(h), &damped(0.1)(1.3 * h))),
        0.0..10.0,
        &[(0.2 / 1.3, 10.0)],
    );
    // The same oscillator twice: double zeros only.
    check(
        |h| mixed(&beside(&damped(0.2)(h), &damped(0.2)(h))),
        0.0..10.0,
        &[(0.4, 10.0)],
    );
    // One unknown: explicit Euler for exponential decay.
    check(
        |h| DMatrix::from_element(1, 1, 1.0 - h),
        0.0..10.0,
        &[(2.0, 10.0)],
    );
    // Three unknowns.
    let three = |h: f64| {
        DMatrix::from_diagonal(&nalgebra::DVector::from_vec(vec![
            1.0 - h,
            1.0 - 2.0 * h,
            0.5,
        ]))
    };
    check(three, 0.0..10.0, &[(1.0, 10.0)]);
}

#[test]
fn poles_are_infinite_radii() {
    let pole = |h: f64| {
        let d = 4.0 - h * h;
        two(
            (4.0 + h * h) / d,
            4.0 * h / d,
            4.0 * h / d,
            (4.0 + h * h) / d,
        )
    };
    let found = check(pole, 0.5..10.0, &[(0.5, 10.0)]);
    assert_eq!(found[0].radius, f64::INFINITY);
    assert!((found[0].worst - 2.0).abs() < 1e-8);
    // A pole at which no function changes its sign; the radius exceeds one from ½ on.
    let double = |h: f64| DMatrix::from_element(1, 1, ((1.0 + h) / (2.0 - h)).powi(2));
    let found = check(double, 0.1..10.0, &[(0.5, 10.0)]);
    assert_eq!(found[0].radius, f64::INFINITY);
}

#[test]
fn ranges_on_both_sides_of_zero() {
    let changes =
        stability_changes_of(exact(|h| DMatrix::from_element(1, 1, h)), -2.0..3.0).expect("smooth");
    assert_eq!(changes, [-1.0, 1.0]);
}

#[test]
fn bad_input_is_an_error() {
    let one = exact(|_| DMatrix::identity(2, 2));
    for (start, end) in [
        (1.0, 1.0),
        (2.0, 1.0),
        (f64::NAN, 1.0),
        (0.0, f64::INFINITY),
        (-f64::MAX, f64::MAX),
    ] {
        assert!(matches!(
            unstable_intervals_of(&one, start..end),
            Err(IntervalError::Range { .. })
        ));
    }
    assert_eq!(unstable_intervals_of(&one, 0.0..1.0), Ok(Vec::new()));
    assert_eq!(
        stability_changes_of(
            |h| if h > 0.7 {
                Err("singular")
            } else {
                Ok(DMatrix::identity(2, 2))
            },
            0.0..1.0
        ),
        Err(IntervalError::Matrix {
            at: 0.9043,
            source: "singular"
        })
    );
    let shapes = unstable_intervals_of(exact(|_| DMatrix::zeros(2, 3)), 0.0..1.0);
    assert!(matches!(
        shapes,
        Err(IntervalError::Shape {
            rows: 2,
            columns: 3,
            ..
        })
    ));
    let changing = unstable_intervals_of(
        exact(|h| DMatrix::identity(if h < 0.5 { 2 } else { 4 }, if h < 0.5 { 2 } else { 4 })),
        0.0..1.0,
    );
    assert!(matches!(
        changing,
        Err(IntervalError::Shape {
            rows: 4,
            columns: 4,
            ..
        })
    ));
    let empty = unstable_intervals_of(exact(|_| DMatrix::zeros(0, 0)), 0.0..1.0);
    assert!(matches!(
        empty,
        Err(IntervalError::Shape {
            rows: 0,
            columns: 0,
            ..
        })
    ));
    let broken = unstable_intervals_of(exact(|_| two(1.0, f64::NAN, 0.0, 1.0)), 0.0..1.0);
    assert!(matches!(broken, Err(IntervalError::NotFinite { .. })));
}
