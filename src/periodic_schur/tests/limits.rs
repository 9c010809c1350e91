//! Factors at the limits: singular, nearly trivial, badly scaled, or a single one.

use super::*;

#[test]
fn identity_and_diagonal_factors_are_exact() {
    for (n, m) in [(1, 1), (2, 10_000), (3, 5), (20, 3)] {
        let found = multipliers(&vec![DMatrix::identity(n, n); m]).expect("converges");
        assert_eq!(
            found,
            vec![
                Multiplier {
                    log_modulus: 0.0,
                    argument: 0.0
                };
                n
            ]
        );
    }
    let diagonal = DMatrix::from_diagonal(&nalgebra::DVector::from_column_slice(&[
        1e300, -1.0, 1e-300,
    ]));
    let found = multipliers(&[diagonal.clone(), diagonal.clone(), diagonal]).expect("converges");
    for (x, expected) in found.iter().zip([900.0, 0.0, -900.0]) {
        assert!(
            (x.log_modulus - expected * 10f64.ln()).abs()
                <= 4.0 * 900.0 * 10f64.ln() * f64::EPSILON
        );
    }
    assert_eq!(found[1].argument, PI);
    assert_eq!(found[1].to_complex(), Complex::new(-1.0, 0.0));
}

#[test]
fn entries_at_the_ends_of_the_range_neither_overflow_nor_vanish() {
    let mut random = Random(11);
    for n in [2, 3, 6] {
        let factors: Vec<_> = (0..12).map(|_| random.matrix(n)).collect();
        let plain = multipliers(&factors).expect("converges");
        for (up, down) in [(1020, -1000), (1023, -1050), (600, 600), (-700, -900)] {
            let scaled: Vec<_> = (factors.iter().enumerate())
                .map(|(k, factor)| {
                    factor.map(|x| {
                        arithmetic::times_power_of_two(x, if k % 2 == 0 { up } else { down })
                    })
                })
                .collect();
            let shift = 6.0 * (up + down) as f64 * 2f64.ln();
            // 2^-1050 leaves 24 bits of each entry.
            let tolerance = if down < -1022 {
                1e-3
            } else {
                1e3 * bound(12, n)
            };
            for (x, y) in plain.iter().zip(multipliers(&scaled).expect("converges")) {
                assert!(
                    (x.log_modulus + shift - y.log_modulus).abs()
                        < tolerance + shift.abs() * f64::EPSILON
                );
            }
        }
    }
}

#[test]
fn badly_scaled_coordinates_are_balanced() {
    use Part::{Pair, Real};
    let parts = [Real(3.0, 1.0), Pair(0.0, 1.0), Real(-3.0, 1.0)];
    for m in [1, 10] {
        let units = [1e-9, 1.0, 1e7, 1e-3];
        let mut factors = chain_of(&parts, m, &mut Random(5));
        for factor in &mut factors {
            *factor = DMatrix::from_fn(4, 4, |i, j| factor[(i, j)] * units[i] / units[j]);
        }
        let error = distance(&multipliers(&factors).expect("converges"), &parts);
        // A single factor contains the whole range of the eigenvalues, which is its condition number.
        assert!(
            error < bound(m, 4) * 1e6f64.powf(1.0 / m as f64),
            "{error:e}"
        );
    }
}

#[test]
fn free_coordinates_of_any_mass() {
    // p₁ and q₁ turn by 0.3 and are damped; p₂ is conserved, nothing depends on q₂.
    let (sin, cos) = 0.3f64.sin_cos();
    for mass in [1e-150, 1e-20, 1e-10, 1.0, 1e20, 1e150] {
        let mut factor = DMatrix::identity(4, 4);
        for (row, column, x) in [
            (0, 0, 0.9 * cos),
            (0, 1, 0.1),
            (0, 2, -0.9 * mass * sin),
            (2, 0, 0.9 * sin / mass),
            (2, 1, 0.4 / mass),
            (2, 2, 0.9 * cos),
            (3, 0, 0.3 / mass),
            (3, 1, 1.0 / mass),
            (3, 2, 0.2),
        ] {
            factor[(row, column)] = x;
        }
        let found = multipliers(&vec![factor; 5]).expect("converges");
        for (x, argument) in found[2..].iter().zip([1.5, -1.5]) {
            assert!((x.log_modulus - 5.0 * 0.9f64.ln()).abs() < 1e-12, "{x:?}");
            assert!((x.argument - argument).abs() < 1e-12, "{x:?}");
        }
        // The double eigenvalue 1 belongs to a Jordan block and is known to √ε.
        for x in &found[..2] {
            let error = x.log_modulus.hypot(x.argument);
            assert!(error < 1e-6, "mass {mass}: {x:?}");
        }
    }
}

#[test]
fn a_singular_factor_gives_the_eigenvalue_zero() {
    let mut random = Random(17);
    for n in [1, 2, 3, 6, 20] {
        for m in [1, 2, 7] {
            for at in 0..m {
                for rank in [n - 1, n / 2] {
                    let mut factors: Vec<_> = (0..m).map(|_| random.matrix(n)).collect();
                    factors[at] = {
                        let left = DMatrix::from_fn(n, rank, |_, _| random.next());
                        left * DMatrix::from_fn(rank, n, |_, _| random.next())
                    };
                    let found = multipliers(&factors).expect("converges");
                    check_order(&found);
                    let exact = found
                        .iter()
                        .filter(|x| x.log_modulus == f64::NEG_INFINITY)
                        .count();
                    // Only the first zero must be exact; the others are semisimple and vanish up to rounding error.
                    let floor = bound(m, n).ln()
                        + factors.iter().map(|factor| factor.norm().ln()).sum::<f64>();
                    let zeros = found
                        .iter()
                        .filter(|x| x.log_modulus < floor || x.modulus() == 0.0)
                        .count();
                    assert!(
                        exact >= 1 && exact <= n - rank,
                        "n = {n}, m = {m}, rank {rank} of factor {at}: {found:?}"
                    );
                    assert_eq!(
                        zeros,
                        n - rank,
                        "n = {n}, m = {m}, rank {rank} of factor {at}: {found:?}"
                    );
                    check_schur(&factors);
                }
            }
        }
    }
    let zero = Multiplier {
        log_modulus: f64::NEG_INFINITY,
        argument: 0.0,
    };
    assert_eq!(zero.to_complex(), Complex::new(0.0, 0.0));
    assert_eq!(
        multipliers(&[DMatrix::zeros(3, 3), random.matrix(3)]),
        Ok(vec![zero; 3])
    );
    // Nilpotent: zero is the only eigenvalue, though the factor is not zero.
    let shift = DMatrix::from_fn(5, 5, |i, j| if i == j + 1 { 1.0 } else { 0.0 });
    for m in [1, 2, 6] {
        assert_eq!(multipliers(&vec![shift.clone(); m]), Ok(vec![zero; 5]));
    }
}

#[test]
fn a_product_close_to_the_identity_separates() {
    // (P − σ)² is 1e-17 here: a start vector computed with σ² − 2 σ p₁₁ + p₁₁² would be rounding error.
    let mut random = Random(31);
    for _ in 0..100 {
        let factors: Vec<_> = (0..3)
            .map(|_| {
                DMatrix::from_fn(3, 3, |i, j| {
                    if i == (j + 1) % 3 {
                        1.0
                    } else {
                        1e-8 * random.next()
                    }
                })
            })
            .collect();
        for x in multipliers(&factors).expect("converges") {
            assert!((x.to_complex() - Complex::new(1.0, 0.0)).norm() < 1e-7);
        }
        check_schur(&factors);
    }
}

#[test]
fn sparse_factors_of_small_integers_converge() {
    // Singular, defective, reducible and cyclic products, all of them frequent here.
    let mut random = Random(37);
    for case in 0..600 {
        let (n, m) = (1 + case % 6, 1 + case / 6 % 4);
        let factors: Vec<_> = (0..m)
            .map(|_| random.matrix(n).map(|x| (1.7 * x).trunc()))
            .collect();
        check_order(&multipliers(&factors).expect("converges"));
        check_schur(&factors);
    }
}

#[test]
fn errors_name_the_factor() {
    use PeriodicSchurError::{Empty, NonFinite, NotSquare, SizeMismatch};
    let one = DMatrix::<f64>::identity(2, 2);
    let check = |factors: &[DMatrix<f64>], expected: PeriodicSchurError, text: &str| {
        assert_eq!(expected.to_string(), text);
        assert_eq!(PeriodicSchur::new(factors).err(), Some(expected.clone()));
        assert_eq!(multipliers(factors), Err(expected));
    };
    check(&[], Empty, "the product has no factor");
    check(
        &[one.clone(), DMatrix::zeros(2, 3)],
        NotSquare {
            index: 1,
            rows: 2,
            columns: 3,
        },
        "factor 1 is 2 × 3, but it must be square",
    );
    check(
        &[one.clone(), one.clone(), DMatrix::zeros(3, 3)],
        SizeMismatch {
            index: 2,
            found: 3,
            expected: 2,
        },
        "factor 2 is 3 × 3, but the first is 2 × 2",
    );
    for bad in [f64::NAN, f64::INFINITY] {
        let broken = DMatrix::from_row_slice(2, 2, &[1.0, 0.0, bad, 1.0]);
        check(
            &[one.clone(), broken],
            NonFinite { index: 1 },
            "factor 1 holds an entry that is not finite",
        );
    }
    assert_eq!(multipliers(&[DMatrix::zeros(0, 0)]), Ok(Vec::new()));
}

#[test]
fn factors_in_one_slice_are_taken_row_by_row() {
    let mut random = Random(31);
    let factors: Vec<_> = (0..7).map(|_| random.matrix(3)).collect();
    let entries: Vec<f64> = factors
        .iter()
        .flat_map(|factor| factor.transpose().as_slice().to_vec())
        .collect();
    assert_eq!(multipliers_of(3, &entries), multipliers(&factors));

    assert_eq!(multipliers_of(3, &[]), Err(PeriodicSchurError::Empty));
    let mut broken = entries.clone();
    broken[20] = f64::NAN;
    let expected = Err(PeriodicSchurError::NonFinite { index: 2 });
    assert_eq!(multipliers_of(3, &broken), expected);
    for order in [0, 2, 9, usize::MAX] {
        let found = entries.len();
        let expected = PeriodicSchurError::Length { order, found };
        assert_eq!(multipliers_of(order, &entries), Err(expected));
    }
    let text = "7 entries are not a whole number of 2 × 2 factors";
    let error = multipliers_of(2, &entries[..7]).unwrap_err();
    assert_eq!(error.to_string(), text);
}

#[test]
fn exponents_of_the_smallest_and_largest_numbers() {
    for (x, expected) in [
        (1.0, 0),
        (-1.9, 0),
        (0.5, -1),
        (5e-324, -1074),
        (f64::MIN_POSITIVE, -1022),
        (f64::MAX, 1023),
    ] {
        assert_eq!(arithmetic::exponent(x), expected);
        let normal = arithmetic::times_power_of_two(x, -expected).abs();
        assert!((1.0..2.0).contains(&normal), "{x:e} gives {normal}");
    }
}
