//! Chains against dense algebra and against manufactured solutions.

use super::*;
use crate::numbers::larger;
use nalgebra::{DMatrix, DVector, Matrix2};
use std::f64::consts::TAU;

/// A linear congruential generator: reproducible, and random enough for matrices.
struct Random(u64);

impl Random {
    /// Uniform in (−1, 1).
    fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    fn fill(&mut self, x: &mut [f64]) {
        x.fill_with(|| self.next());
    }
}

/// A chain with random coefficients and right sides.
fn random_chain(shape: Shape, random: &mut Random) -> Chain {
    let Shape {
        block,
        globals,
        links,
        dense,
        rights,
    } = shape;
    let mut chain = Chain::with_right_sides(block, globals, links, dense, rights);
    for e in 0..links {
        let link = chain.link_mut(e);
        random.fill(link.matrix);
        random.fill(link.global);
    }
    let closure = chain.closure_mut();
    random.fill(closure.first);
    random.fill(closure.last);
    random.fill(closure.global);
    for k in 0..dense {
        let dense = chain.dense_mut(k);
        random.fill(dense.nodes);
        random.fill(dense.global);
    }
    for side in 0..rights {
        let right = chain.right_side_mut(side);
        random.fill(&mut right.links);
        random.fill(&mut right.closure);
        random.fill(&mut right.dense);
    }
    chain
}

/// The matrix of all equations and one right side.
fn assembled(chain: &Chain, side: usize) -> (DMatrix<f64>, DVector<f64>) {
    let Shape {
        block: m,
        globals: g,
        links,
        dense,
        ..
    } = chain.shape;
    let (nodes, c) = (chain.shape.nodes(), chain.shape.closure());
    let eq = &chain.equations;
    let right = &eq.rights[side];
    let mut matrix = DMatrix::zeros(nodes + g, nodes + g);
    for row in 0..links * m {
        let e = row / m;
        matrix[(row, row + m)] = 1.0;
        for j in 0..m {
            matrix[(row, e * m + j)] = -eq.matrices[row * m + j];
        }
        for j in 0..g {
            matrix[(row, nodes + j)] = -eq.link_globals[row * g + j];
        }
    }
    for i in 0..c {
        let row = links * m + i;
        for j in 0..m {
            matrix[(row, j)] += eq.first[i * m + j];
            matrix[(row, links * m + j)] += eq.last[i * m + j];
        }
        for j in 0..g {
            matrix[(row, nodes + j)] = eq.closure_globals[i * g + j];
        }
    }
    for k in 0..dense {
        let row = links * m + c + k;
        for j in 0..nodes {
            matrix[(row, j)] = eq.dense_nodes[k * nodes + j];
        }
        for j in 0..g {
            matrix[(row, nodes + j)] = eq.dense_globals[k * g + j];
        }
    }
    let all = [&right.links[..], &right.closure, &right.dense].concat();
    (matrix, DVector::from_vec(all))
}

/// (y_0, …, y_E, γ) of one right side.
fn solution(chain: &Chain, side: usize) -> DVector<f64> {
    let mut all: Vec<f64> = (0..=chain.shape.links)
        .flat_map(|e| chain.node_of(side, e).to_vec())
        .collect();
    all.extend(chain.globals_of(side));
    DVector::from_vec(all)
}

/// Chooses the right sides so that the given values solve the first one.
fn manufacture(chain: &mut Chain, values: &[f64]) {
    let (matrix, _) = assembled(chain, 0);
    let product = matrix * DVector::from_column_slice(values);
    let c = chain.shape.closure();
    let right = chain.right_side_mut(0);
    let (links, rest) = product.as_slice().split_at(right.links.len());
    right.links.copy_from_slice(links);
    right.closure.copy_from_slice(&rest[..c]);
    right.dense.copy_from_slice(&rest[c..]);
}

/// The largest modulus.
fn largest(x: &DVector<f64>) -> f64 {
    x.amax()
}

#[track_caller]
fn assert_close(found: &[f64], expected: &[f64], tolerance: f64) {
    assert_eq!(found.len(), expected.len());
    let error = found
        .iter()
        .zip(expected)
        .fold(0.0, |most, (a, b)| larger(most, (a - b).abs()));
    assert!(error <= tolerance, "{found:?} ≠ {expected:?} by {error:e}");
}

/// Every shape of a small chain.
fn shapes() -> impl Iterator<Item = Shape> {
    (1..=5).flat_map(|block| {
        (0..=2).flat_map(move |globals| {
            [1, 2, 3, 8].into_iter().flat_map(move |links| {
                (0..=(block + globals).min(3)).map(move |dense| Shape {
                    block,
                    globals,
                    links,
                    dense,
                    rights: 2,
                })
            })
        })
    })
}

#[test]
fn random_chains_agree_with_a_dense_solve() {
    let mut random = Random(1);
    for shape in shapes() {
        let mut chain = random_chain(shape, &mut random);
        chain.solve().expect("random equations are regular");
        let singular = assembled(&chain, 0).0.singular_values();
        let condition = singular.max() / singular.min();
        for side in 0..2 {
            let (matrix, right) = assembled(&chain, side);
            let expected = matrix.clone().lu().solve(&right).expect("regular");
            let found = solution(&chain, side);
            // Both are backward stable; the condition number is below 100 in most of the draws, which gives 1e-12.
            let error = (&found - &expected).amax() / largest(&expected);
            assert!(
                error <= 1e-14 * condition.max(100.0),
                "{shape:?}: {error:e}, condition {condition:e}"
            );
            let residual = (&matrix * &found - right).amax();
            // Entries are below one: the error is ε times the number of terms and the size of the solution, with a
            // margin.
            assert!(
                residual <= 1e-14 * found.len() as f64 * largest(&found).max(1.0),
                "{shape:?}: residual {residual:e}"
            );
        }
    }
}

#[test]
fn sign_is_that_of_the_determinant() {
    let mut random = Random(2);
    let mut seen = [0, 0];
    for shape in shapes() {
        let mut chain = random_chain(shape, &mut random);
        assert_eq!(chain.sign(), 0.0, "not solved yet");
        chain.solve().expect("random equations are regular");
        let determinant = assembled(&chain, 0).0.determinant();
        assert_eq!(chain.sign(), determinant.signum(), "{shape:?}");
        seen[usize::from(determinant > 0.0)] += 1;
    }
    assert!(
        seen[0] > 50 && seen[1] > 50,
        "both signs are tested: {seen:?}"
    );
}

#[test]
fn coefficients_are_kept_and_may_be_written_again() {
    let shape = Shape {
        block: 2,
        globals: 1,
        links: 4,
        dense: 1,
        rights: 1,
    };
    let mut random = Random(3);
    let mut chain = random_chain(shape, &mut random);
    let before = assembled(&chain, 0);
    chain.solve().expect("regular");
    assert_eq!(assembled(&chain, 0), before);
    assert_eq!(chain.matrices().len(), 16);
    let first = solution(&chain, 0);
    for x in chain.link_mut(2).matrix {
        *x *= 1.5;
    }
    chain.solve().expect("regular");
    assert_ne!(solution(&chain, 0), first);
    for x in chain.link_mut(2).matrix {
        *x /= 1.5;
    }
    chain.solve().expect("regular");
    // The solution in between leaves no trace; multiplying and dividing by 3/2 may cost one rounding.
    assert_close(solution(&chain, 0).as_slice(), first.as_slice(), 1e-12);
}

/// A_e = S_{e+1} diag(ρ, 1/ρ) S_e⁻¹ with bases that turn once along the chain; S_E = S_0.
fn dichotomic(links: usize, rate: f64, dense: usize) -> Chain {
    let basis = |e: usize| {
        let (s, c) = (TAU * (e % links) as f64 / links as f64).sin_cos();
        Matrix2::new(c, 0.5 * c - s, s, 0.5 * s + c)
    };
    let mut chain = Chain::new(2, dense, links, dense);
    for e in 0..links {
        let inverse = basis(e).try_inverse().expect("regular");
        let a = basis(e + 1) * Matrix2::from_diagonal(&[rate, 1.0 / rate].into()) * inverse;
        let link = chain.link_mut(e);
        link.matrix.copy_from_slice(a.transpose().as_slice());
        for (i, c) in link.global.iter_mut().enumerate() {
            *c = ((e + i) as f64).cos();
        }
    }
    for k in 0..dense {
        let dense = chain.dense_mut(k);
        for (j, w) in dense.nodes.iter_mut().enumerate() {
            *w = (0.3 * j as f64).sin() / links as f64;
        }
        dense.global.fill(0.5);
    }
    chain
}

/// Closes a chain periodically, y_0 = y_E.
fn close_periodically(chain: &mut Chain) {
    let m = chain.shape.block;
    let closure = chain.closure_mut();
    for i in 0..m {
        closure.first[i * m + i] = 1.0;
        closure.last[i * m + i] = -1.0;
    }
}

/// Prescribes the first coordinate at both ends.
fn close_at_two_points(chain: &mut Chain) {
    let closure = chain.closure_mut();
    closure.first.copy_from_slice(&[1.0, 0.0, 0.0, 0.0]);
    closure.last.copy_from_slice(&[0.0, 0.0, 1.0, 0.0]);
}

#[track_caller]
fn check_dichotomic(links: usize, total: f64, dense: usize, close: fn(&mut Chain)) {
    let rate = 10f64.powf(total / links as f64);
    let mut chain = dichotomic(links, rate, dense);
    close(&mut chain);
    let count = chain.shape.nodes() + dense;
    let values: Vec<f64> = (0..count).map(|i| (0.7 * i as f64).cos()).collect();
    manufacture(&mut chain, &values);
    chain.solve().expect("well conditioned");
    let found = solution(&chain, 0);
    // The equations are well conditioned: about E where the rate is close to one. The right side alone has an error of
    // ε ρ.
    assert_close(
        found.as_slice(),
        &values,
        1e-10_f64.min(1e-13 * rate * links as f64),
    );
    let (matrix, right) = assembled(&chain, 0);
    let residual = (matrix * found - right).amax();
    assert!(residual <= 1e-14 * rate, "residual {residual:e}");
}

#[test]
fn growth_and_decay_in_one_chain_cost_no_digits() {
    for dense in [0, 1] {
        for close in [close_periodically as fn(&mut Chain), close_at_two_points] {
            check_dichotomic(40, 14.0, dense, close);
            check_dichotomic(8, 14.0, dense, close);
            check_dichotomic(200, 300.0, dense, close);
            check_dichotomic(100, 400.0, dense, close);
        }
    }
}

#[test]
fn initial_values_give_the_forward_recursion() {
    let mut random = Random(4);
    let shape = Shape {
        block: 4,
        globals: 0,
        links: 12,
        dense: 0,
        rights: 1,
    };
    let mut chain = random_chain(shape, &mut random);
    let closure = chain.closure_mut();
    closure.last.fill(0.0);
    closure.first.fill(0.0);
    for i in 0..4 {
        closure.first[i * 5] = 1.0;
    }
    chain.solve().expect("initial values determine everything");
    let eq = chain.equations.clone();
    let mut y = eq.rights[0].closure.clone();
    for e in 0..=12 {
        // The recursion grows by less than 10⁴ here, and so does the loss of digits.
        assert_close(chain.node(e), &y, 1e-12 * (1.0 + 1e4 * f64::from(e > 0)));
        if e < 12 {
            let a = DMatrix::from_row_slice(4, 4, &eq.matrices[16 * e..16 * (e + 1)]);
            let r = DVector::from_column_slice(&eq.rights[0].links[4 * e..4 * (e + 1)]);
            y = (a * DVector::from_vec(y) + r).as_slice().to_vec();
        }
    }
}

#[test]
fn units_of_coordinates_momenta_and_globals_do_not_matter() {
    // A spacecraft in SI units: powers of two, so that the scaled chain has the same digits.
    let units = [2f64.powi(37), 2f64.powi(37), 2f64.powi(-90), 2f64.powi(-90)];
    let unit_of_global = 2f64.powi(80);
    let shape = Shape {
        block: 4,
        globals: 1,
        links: 10,
        dense: 1,
        rights: 1,
    };
    let mut plain = random_chain(shape, &mut Random(5));
    let mut scaled = plain.clone();
    let eq = &mut scaled.equations;
    for (at, a) in eq.matrices.iter_mut().enumerate() {
        *a *= units[at / 4 % 4] / units[at % 4];
    }
    for (i, c) in eq.link_globals.iter_mut().enumerate() {
        *c *= units[i % 4] / unit_of_global;
    }
    for (i, r) in eq.rights[0].links.iter_mut().enumerate() {
        *r *= units[i % 4];
    }
    let by_units = |(j, w): (usize, &mut f64)| *w /= units[j % 4];
    eq.first.iter_mut().enumerate().for_each(by_units);
    eq.last.iter_mut().enumerate().for_each(by_units);
    eq.dense_nodes.iter_mut().enumerate().for_each(by_units);
    for c in eq.closure_globals.iter_mut().chain(&mut eq.dense_globals) {
        *c /= unit_of_global;
    }
    plain.solve().expect("regular");
    scaled.solve().expect("regular");
    let expected = solution(&plain, 0);
    let mut found = solution(&scaled, 0);
    let count = found.len();
    for (j, x) in found.iter_mut().enumerate() {
        *x /= if j + 1 == count {
            unit_of_global
        } else {
            units[j % 4]
        };
    }
    // Balancing may choose scales that differ from the units by powers of two: other rounding errors of the same size.
    let singular = assembled(&plain, 0).0.singular_values();
    let tolerance = 1e-14 * singular.max() / singular.min() * largest(&expected);
    assert_close(found.as_slice(), expected.as_slice(), tolerance);
}

/// Equal links between nodes of two unknowns, by rows.
fn uniform(links: usize, globals: usize, dense: usize, matrix: [f64; 4]) -> Chain {
    let mut chain = Chain::new(2, globals, links, dense);
    for e in 0..links {
        chain.link_mut(e).matrix.copy_from_slice(&matrix);
    }
    chain
}

fn rotation(angle: f64) -> [f64; 4] {
    let (s, c) = angle.sin_cos();
    [c, s, -s, c]
}

#[test]
fn cost_and_storage_are_linear() {
    // An oscillator over 100 000 elements, from a position at the start to one at the end.
    let links = 100_000;
    let angle = 1e-3;
    let mut chain = uniform(links, 0, 0, rotation(angle));
    close_at_two_points(&mut chain);
    chain.closure_mut().right[0] = 1.0;
    let end = (angle * links as f64).cos();
    chain.closure_mut().right[1] = end;
    chain.solve().expect("sin 100 is not zero");
    let middle = chain.node(links / 2);
    // y = (cos t, −sin t). The rounding errors of E links, a few ε each, add up at worst; they are divided by
    // sin 100 = −0.51.
    let t = angle * (links / 2) as f64;
    assert_close(middle, &[t.cos(), -t.sin()], 2e-15 * links as f64);
    assert_eq!(chain.sweep.length(), (links - 1) * 2 * 7);
}

#[test]
fn an_undetermined_chain_is_an_error_with_its_rank() {
    let rank = |chain: &mut Chain| match chain.solve() {
        Err(Singular::Rank { rank, size, pivot }) => {
            assert!(pivot <= 1e-14, "{pivot:e}");
            (rank, size)
        }
        other => panic!("{other:?}"),
    };
    // A period of an oscillator: every solution is periodic.
    let mut circle = uniform(12, 0, 0, rotation(TAU / 12.0));
    close_periodically(&mut circle);
    assert_eq!(rank(&mut circle), (2, 4));
    assert_eq!(circle.sign(), 0.0);
    // Free motion: the position is not determined by periodicity.
    let mut free = uniform(5, 0, 0, [1.0, 0.1, 0.0, 1.0]);
    close_periodically(&mut free);
    assert_eq!(rank(&mut free), (3, 4));
    // A global unknown that nothing depends on, and conditions that are missing.
    let mut unused = uniform(5, 1, 1, [2.0, 0.1, 0.0, 0.5]);
    close_periodically(&mut unused);
    unused.dense_mut(0).nodes.fill(1.0);
    assert_eq!(rank(&mut unused), (4, 5));
    assert_eq!(rank(&mut uniform(1, 0, 0, [1.0; 4])), (2, 4));
    // A dense row that the links imply: y_1 − A y_0 again.
    let mut implied = uniform(3, 0, 1, [2.0, 0.0, 0.0, 0.5]);
    implied.closure_mut().first[0] = 1.0;
    let nodes = implied.dense_mut(0).nodes;
    (nodes[0], nodes[2]) = (-2.0, 1.0);
    assert_eq!(rank(&mut implied), (3, 4));
    let message = implied.solve().unwrap_err().to_string();
    assert!(message.contains("rank 3 of 4"), "{message}");
}

#[test]
fn a_phase_condition_and_a_period_make_a_periodic_chain_regular() {
    // As the circle above, with the angular frequency as an unknown and the phase fixed by an integral.
    let links = 12;
    let angle = TAU / links as f64;
    let mut chain = Chain::with_right_sides(2, 1, links, 1, 2);
    for e in 0..links {
        let (s, c) = (angle * (e + 1) as f64).sin_cos();
        let link = chain.link_mut(e);
        // A limit cycle: the radial part of a perturbation decays over the element.
        let (s0, c0) = (angle * e as f64).sin_cos();
        let decay = 0.7;
        link.matrix.copy_from_slice(&[
            decay * c * c0 + s * s0,
            decay * c * s0 - s * c0,
            decay * s * c0 - c * s0,
            decay * s * s0 + c * c0,
        ]);
        link.global.copy_from_slice(&[-s, c]);
        let dense = chain.dense_mut(0);
        dense.nodes[2 * e..2 * e + 2].copy_from_slice(&[-s0, c0]);
    }
    close_periodically(&mut chain);
    let values: Vec<f64> = (0..27).map(|i| (1.3 * f64::from(i)).sin()).collect();
    manufacture(&mut chain, &values);
    let only_dense = chain.right_side_mut(1);
    only_dense.dense[0] = 1.0;
    chain.solve().expect("regular");
    // The condition number is about 100.
    assert_close(solution(&chain, 0).as_slice(), &values, 1e-13);
    // The null vector of the other rows, normalised by the dense row: the phase, 1/E of the tangent at each node.
    for e in 0..=links {
        let (s, c) = (angle * e as f64).sin_cos();
        let unit = 1.0 / links as f64;
        assert_close(chain.node_of(1, e), &[-s * unit, c * unit], 1e-14);
    }
    assert_close(chain.globals_of(1), &[0.0], 1e-14);
}

#[test]
fn no_coefficient_makes_it_panic_or_return_nonsense() {
    let shape = Shape {
        block: 2,
        globals: 1,
        links: 3,
        dense: 1,
        rights: 1,
    };
    let regular = random_chain(shape, &mut Random(6));
    let fields: [fn(&mut Equations) -> &mut Vec<f64>; 10] = [
        |eq| &mut eq.matrices,
        |eq| &mut eq.link_globals,
        |eq| &mut eq.first,
        |eq| &mut eq.last,
        |eq| &mut eq.closure_globals,
        |eq| &mut eq.dense_nodes,
        |eq| &mut eq.dense_globals,
        |eq| &mut eq.rights[0].links,
        |eq| &mut eq.rights[0].closure,
        |eq| &mut eq.rights[0].dense,
    ];
    for field in fields {
        for value in [f64::NAN, f64::INFINITY, f64::MAX, 1e160, 5e-324, -0.0] {
            let mut chain = regular.clone();
            for at in 0..field(&mut chain.equations).len() {
                let kept = field(&mut chain.equations)[at];
                field(&mut chain.equations)[at] = value;
                let result = chain.solve();
                field(&mut chain.equations)[at] = kept;
                if !value.is_finite() {
                    assert_eq!(result, Err(Singular::NotFinite));
                } else if result.is_ok() {
                    assert!(solution(&chain, 0).iter().all(|x| x.is_finite()));
                    assert_eq!(chain.sign().abs(), 1.0);
                }
            }
        }
    }
    let message = Singular::NotFinite.to_string();
    assert!(message.contains("not finite"), "{message}");
}

#[test]
fn a_chain_without_unknowns_at_the_nodes_is_its_dense_rows() {
    let mut chain = Chain::new(0, 1, 3, 1);
    let dense = chain.dense_mut(0);
    dense.global[0] = 4.0;
    *dense.right = 2.0;
    chain.solve().expect("one equation");
    assert_eq!(chain.globals(), [0.5]);
    assert_eq!(chain.node(3), [0.0; 0]);
}
