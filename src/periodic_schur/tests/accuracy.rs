//! Spectra known by construction or from the explicit product.

use super::*;

#[test]
fn eigenvalues_of_very_different_size_keep_relative_accuracy() {
    use Part::{Pair, Real};
    let four = [
        Real(20.0, 1.0),
        Real(0.0, 1.0),
        Real(-3.0, -1.0),
        Real(-20.0, 1.0),
    ];
    let six = [
        Real(30.0, -1.0),
        Pair(0.0, 2.0),
        Real(-1.0, 1.0),
        Pair(-30.0, 1.0),
    ];
    // e^±1000, outside the range of `f64`.
    let huge = [Real(434.3, 1.0), Pair(100.0, 0.5), Real(-434.3, -1.0)];
    for seed in 0..5 {
        for (parts, m) in [(&four[..], 40), (&four, 1000), (&six, 60), (&huge, 1000)] {
            check_parts(parts, m, seed);
        }
    }
}

#[test]
fn pairs_and_signs_in_every_arrangement() {
    use Part::{Pair, Real};
    let lists: [&[Part]; 8] = [
        &[Real(0.3, -1.0)],
        &[Real(0.3, 1.0), Real(-0.2, -1.0)],
        &[Real(0.0, 1.0), Real(-1e-3, 1.0)],
        &[Pair(0.0, 1.0)],
        &[Pair(0.1, 3.0), Real(0.0, 1.0)],
        &[Real(0.2, 1.0), Pair(0.1, 1e-3), Pair(0.0, 1.5)],
        &[Pair(0.3, 0.5), Pair(0.2, 1.0), Pair(0.1, 2.0)],
        &[
            Real(0.9, 1.0),
            Pair(0.5, 1.0),
            Real(0.2, 1.0),
            Real(0.1, -1.0),
            Pair(-0.5, 3.1),
        ],
    ];
    for (seed, parts) in lists.iter().enumerate() {
        for m in [1, 2, 3, 10, 200] {
            // The closest eigenvalues are 1e-3 apart, which gives a condition number; it is shared by the m-th roots.
            let factors = chain_of(parts, m, &mut Random(seed as u64));
            let found = multipliers(&factors).expect("converges");
            check_order(&found);
            let error = distance(&found, parts);
            assert!(error < 1e3 * bound(m, 6), "list {seed}, m = {m}: {error:e}");
            check_schur(&factors);
        }
    }
}

#[test]
fn products_of_rotations_lie_on_the_unit_circle() {
    let mut random = Random(7);
    for (n, m) in [(2, 1), (2, 1000), (3, 100), (6, 50), (20, 10), (3, 10_000)] {
        let factors: Vec<_> = (0..m).map(|_| random.orthogonal(n)).collect();
        let found = multipliers(&factors).expect("converges");
        check_order(&found);
        // Orthogonal transformations of orthogonal factors: the condition number is one, and errors have random signs.
        let tolerance = 100.0 * n as f64 * (m as f64).sqrt() * f64::EPSILON;
        let most = found
            .iter()
            .map(|x| x.log_modulus.abs())
            .fold(0.0, crate::numbers::larger);
        assert!(most < tolerance, "n = {n}, m = {m}: {most:e}");
        // The determinant equals the sign of the product.
        let sign: f64 = factors
            .iter()
            .map(DMatrix::determinant)
            .map(f64::signum)
            .product();
        let angle: f64 = found.iter().map(|x| x.argument).sum();
        assert!((angle.cos() - sign).abs() < tolerance);
    }
}

#[test]
fn rotations_by_known_angles_add_up() {
    // The angles sum to one turn plus 0.3; each sine and cosine is rounded once.
    for m in [1, 7, 1000, 10_000] {
        let angle = (TAU + 0.3) / m as f64;
        let (s, c) = angle.sin_cos();
        let found = multipliers(&vec![DMatrix::from_row_slice(2, 2, &[c, -s, s, c]); m])
            .expect("converges");
        assert!(
            (found[0].argument - 0.3).abs() < 4.0 * m as f64 * f64::EPSILON + 4.0 * f64::EPSILON
        );
        assert!(found[0].log_modulus.abs() < 4.0 * m as f64 * f64::EPSILON);
        check_order(&found);
    }
}

/// The step of symplectic Euler for chained oscillators with springs k_i(t).
fn symplectic_step(n: usize, h: f64, springs: impl Fn(usize) -> f64) -> DMatrix<f64> {
    let (mut kick, mut drift) = (
        DMatrix::<f64>::identity(2 * n, 2 * n),
        DMatrix::<f64>::identity(2 * n, 2 * n),
    );
    for i in 0..n {
        drift[(n + i, i)] = h;
        kick[(i, n + i)] -= h * springs(i);
        if i + 1 < n {
            for (a, b, sign) in [
                (i, i, 1.0),
                (i, i + 1, -1.0),
                (i + 1, i, -1.0),
                (i + 1, i + 1, 1.0),
            ] {
                kick[(a, n + b)] -= h * sign;
            }
        }
    }
    drift * kick
}

#[test]
fn symplectic_products_have_reciprocal_multipliers() {
    let m = 400;
    // Stable, parametrically excited, and inverted: multipliers from 1 to e^±60.
    for (amplitude, mean) in [(0.1, 3.0), (1.5, 1.0), (0.0, -2.0), (0.0, -40.0)] {
        let factors: Vec<_> = (0..m)
            .map(|k| {
                let t = TAU * k as f64 / m as f64;
                symplectic_step(3, TAU / m as f64, |i| mean + i as f64 + amplitude * t.cos())
            })
            .collect();
        let found = multipliers(&factors).expect("converges");
        check_order(&found);
        for i in 0..6 {
            let sum = found[i].log_modulus + found[5 - i].log_modulus;
            assert!(
                sum.abs() < bound(m, 6),
                "multipliers {i} and {}: {sum:e}",
                5 - i
            );
        }
    }
}

#[test]
fn the_double_multiplier_of_an_autonomous_orbit_is_known_to_the_root_of_round_off() {
    // (1 1; 0 1) in rotating coordinates: a double eigenvalue 1 in a Jordan block.
    let mut random = Random(3);
    let m = 100;
    let nodes: Vec<_> = (0..m).map(|_| random.well_conditioned(2)).collect();
    let shear = DMatrix::from_row_slice(2, 2, &[1.0, 1.0 / m as f64, 0.0, 1.0]);
    let factors: Vec<_> = (0..m)
        .map(|k| {
            &nodes[(k + 1) % m] * &shear * nodes[k].clone().try_inverse().expect("well conditioned")
        })
        .collect();
    for x in multipliers(&factors).expect("converges") {
        let error = (x.to_complex() - Complex::new(1.0, 0.0)).norm();
        assert!(error < bound(m, 2).sqrt(), "{error:e}");
    }
    // The exact shear needs no transformation.
    for x in multipliers(&vec![shear; m]).expect("converges") {
        assert_eq!(
            x,
            Multiplier {
                log_modulus: 0.0,
                argument: 0.0
            }
        );
    }
}

/// The largest distance in a pairing of two spectra, relative to the spectral radius; each eigenvalue in turn takes the
/// closest remaining one.
fn spectral_distance(found: &[Multiplier], mut expected: Vec<Complex<f64>>) -> f64 {
    let radius = expected.iter().fold(0.0f64, |most, z| most.max(z.norm()));
    found.iter().fold(0.0, |most, x| {
        let z = x.to_complex();
        let nearest = (0..expected.len()).min_by(|&i, &j| {
            (expected[i] - z)
                .norm()
                .total_cmp(&(expected[j] - z).norm())
        });
        most.max(nearest.map_or(f64::INFINITY, |i| {
            (expected.swap_remove(i) - z).norm() / radius
        }))
    })
}

#[test]
fn short_products_agree_with_the_explicit_product() {
    for seed in 0..600u64 {
        let mut random = Random(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15));
        let n = [1, 2, 3, 4, 6, 9][seed as usize % 6];
        let m = [1, 2, 3, 5][seed as usize / 6 % 4];
        let factors: Vec<_> = (0..m).map(|_| random.well_conditioned(n)).collect();
        let product = factors
            .iter()
            .fold(DMatrix::identity(n, n), |product, factor| factor * product);
        let found = multipliers(&factors).expect("converges");
        check_order(&found);
        check_schur(&factors);
        let error = spectral_distance(
            &found,
            product.complex_eigenvalues().iter().copied().collect(),
        );
        // Random eigenvalues may be nearly double: the bound allows for a condition number of 1e4.
        assert!(
            error < 1e4 * bound(m, n),
            "seed {seed}, n = {n}, m = {m}: {error:e}"
        );
        // The determinant is not affected by it.
        let determinant: f64 = factors
            .iter()
            .map(|factor| factor.determinant().abs().ln())
            .sum();
        let sum: f64 = found.iter().map(|x| x.log_modulus).sum();
        assert!(
            (determinant - sum).abs() < bound(m, n),
            "seed {seed}: {:e}",
            determinant - sum
        );
    }
}

#[test]
fn one_factor_has_its_plain_eigenvalues() {
    let mut random = Random(23);
    for n in [1, 2, 3, 6, 20, 50] {
        let matrix = random.matrix(n);
        let found = multipliers(std::slice::from_ref(&matrix)).expect("converges");
        let error = spectral_distance(
            &found,
            matrix.complex_eigenvalues().iter().copied().collect(),
        );
        assert!(error < 10.0 * bound(1, n), "n = {n}: {error:e}");
        check_schur(&[matrix]);
    }
}

#[test]
fn long_random_products_converge() {
    // Lyapunov exponents of random matrices: moduli from e^+hundreds to e^-hundreds, whose sum is given by the
    // determinant.
    let mut random = Random(29);
    for (n, m) in [(2, 10_000), (4, 1000), (6, 200), (20, 50), (50, 3)] {
        let factors: Vec<_> = (0..m).map(|_| random.matrix(n)).collect();
        let found = multipliers(&factors).expect("converges");
        check_order(&found);
        let determinant: f64 = factors
            .iter()
            .map(|factor| factor.determinant().abs().ln())
            .sum();
        let sum: f64 = found.iter().map(|x| x.log_modulus).sum();
        // Random factors have condition numbers of about n, and rarely of 1e4.
        assert!((determinant - sum).abs() < 100.0 * bound(m, n));
    }
}
