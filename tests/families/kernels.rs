//! The kernels of models of run-time length: compared with those of the same model of fixed size and with differences;
//! and their sparsity patterns.

use std::collections::BTreeMap;
use tfe::Model;
use tfe::family::{self, Block, Entries, Gradient, Model as _, Pattern};
use tfe::prelude::dynamics;
use tfe::runtime::{First, Second};

#[dynamics(
    coordinates(q[n]),
    lagrangian = sum(i in 0..n, m[i]/2*(1 + q[i]^2)*dot(q[i])^2) + sum(i in 0..n-1, a*dot(q[i])*dot(q[i+1])*sin(q[i]))
        - sum(i in 0..n-1, k/2*(q[i+1]-q[i])^2 + a/3*(q[i+1]-q[i])^3) - sum(i in 2..n, sum(j in 0..i-1, a*cos(q[i]-q[j]))),
    force(q[i]) = -k*dot(q[i])*q[0] + t,
)]
struct Long {
    n: usize,
    m: Vec<f64>,
    k: f64,
    a: f64,
}

#[dynamics(
    coordinates(q[5]),
    lagrangian = sum(i in 0..5, m[i]/2*(1 + q[i]^2)*dot(q[i])^2) + sum(i in 0..4, a*dot(q[i])*dot(q[i+1])*sin(q[i]))
        - sum(i in 0..4, k/2*(q[i+1]-q[i])^2 + a/3*(q[i+1]-q[i])^3) - sum(i in 2..5, sum(j in 0..i-1, a*cos(q[i]-q[j]))),
    force(q[i]) = -k*dot(q[i])*q[0] + t,
)]
struct Five {
    m: [f64; 5],
    k: f64,
    a: f64,
}

const MASSES: [f64; 5] = [1.0, 1.5, 0.7, 2.0, 0.4];
const Q: [f64; 5] = [0.3, -0.2, 0.8, 0.1, -0.6];
const V: [f64; 5] = [0.1, 0.5, -0.4, 0.2, 0.9];
const T: f64 = 0.35;

fn models() -> (Long, Five) {
    let (k, a) = (0.8, 0.3);
    let (n, m) = (5, MASSES.to_vec());
    (Long { n, m, k, a }, Five { m: MASSES, k, a })
}

/// Dense blocks, for comparison.
#[derive(Default)]
pub(crate) struct Dense(pub(crate) BTreeMap<(Block, usize, usize), f64>);

impl Entries<f64> for Dense {
    fn add(&mut self, block: Block, row: usize, column: usize, value: f64) {
        *self.0.entry((block, row, column)).or_default() += value;
    }
}

/// First derivatives: L_v, L_q, Q, one after the other.
fn first(model: &Long, q: &[f64], v: &[f64]) -> [[f64; 5]; 3] {
    let [mut z, mut by_q, mut force] = [[f64::NAN; 5]; 3];
    let gradient = Gradient {
        z: &mut z,
        q: &mut by_q,
        force: &mut force,
    };
    model.first(T, q, v, gradient);
    [z, by_q, force]
}

#[track_caller]
fn close(a: f64, b: f64, tolerance: f64) {
    assert!((a - b).abs() <= tolerance * b.abs().max(1.0), "{a} {b}");
}

/// Sums of about ten terms of order one, in a different order.
const ORDER: f64 = 1e-14;

#[test]
fn kernels_are_those_of_the_fixed_size() {
    let (long, five) = models();
    close(
        long.energy_function(T, &Q, &V),
        five.energy_function(T, &Q, &V),
        ORDER,
    );
    let (mut expected, mut second) = (First::ZERO, Second::ZERO);
    Model::second(&five, T, &Q, &V, &mut expected, &mut second);
    let [z, by_q, force] = first(&long, &Q, &V);
    let [mut forces_q, mut forces] = [[0.0; 5]; 2];
    let gradient = Gradient {
        z: &mut [],
        q: &mut forces_q,
        force: &mut forces,
    };
    long.forces_inline(T, &Q, &V, gradient);
    for j in 0..5 {
        close(z[j], expected.z[j], ORDER);
        close(by_q[j], expected.q[j], ORDER);
        close(force[j], expected.force[j], ORDER);
        close(forces_q[j], expected.q[j], ORDER);
        close(forces[j], expected.force[j], ORDER);
    }
    let (mut dense, mut mass) = (Dense::default(), Dense::default());
    let [mut z, mut by_q, mut force] = [[0.0; 5]; 3];
    let gradient = Gradient {
        z: &mut z,
        q: &mut by_q,
        force: &mut force,
    };
    family::Model::second(&long, T, &Q, &V, gradient, &mut dense);
    long.mass(T, &Q, &V, &mut mass);
    let blocks = [
        (Block::ZZ, &second.zz),
        (Block::ZQ, &second.zq),
        (Block::QQ, &second.qq),
        (Block::ForceZ, &second.force_z),
        (Block::ForceQ, &second.force_q),
    ];
    for (block, expected) in blocks {
        for row in 0..5 {
            for column in 0..5 {
                let at = (block, row, column);
                let value = |entries: &Dense| entries.0.get(&at).copied().unwrap_or(0.0);
                close(value(&dense), expected[row][column], ORDER);
                if block == Block::ZZ {
                    close(value(&mass), expected[row][column], ORDER);
                }
            }
        }
    }
}

/// The error of a central difference with a spacing of 2e-5: 1e-10 of third derivatives and 1e-11 from rounding.
#[test]
fn kernels_are_derivatives() {
    let (long, _) = models();
    let step = 1e-5;
    let moved = |vector: &[f64; 5], j: usize, by: f64| {
        let mut moved = *vector;
        moved[j] += by;
        moved
    };
    let mut dense = Dense::default();
    let [mut z, mut by_q, mut force] = [[0.0; 5]; 3];
    let gradient = Gradient {
        z: &mut z,
        q: &mut by_q,
        force: &mut force,
    };
    family::Model::second(&long, T, &Q, &V, gradient, &mut dense);
    let entry = |block, row, column| dense.0.get(&(block, row, column)).copied().unwrap_or(0.0);
    for j in 0..5 {
        let energy = |q: &[f64; 5], v: &[f64; 5]| long.energy_function(T, q, v);
        let (q_up, q_down) = (moved(&Q, j, step), moved(&Q, j, -step));
        let (v_up, v_down) = (moved(&V, j, step), moved(&V, j, -step));
        close(
            by_q[j],
            (energy(&q_up, &V) - energy(&q_down, &V)) / (2.0 * step),
            1e-8,
        );
        close(
            z[j],
            (energy(&Q, &v_up) - energy(&Q, &v_down)) / (2.0 * step),
            1e-8,
        );
        let (up, down) = (first(&long, &q_up, &V), first(&long, &q_down, &V));
        let (faster, slower) = (first(&long, &Q, &v_up), first(&long, &Q, &v_down));
        for i in 0..5 {
            let by_q = |of: usize| (up[of][i] - down[of][i]) / (2.0 * step);
            let by_v = |of: usize| (faster[of][i] - slower[of][i]) / (2.0 * step);
            close(entry(Block::ZZ, i, j), by_v(0), 1e-8);
            close(entry(Block::ZQ, i, j), by_q(0), 1e-8);
            close(entry(Block::QQ, i, j), by_q(1), 1e-8);
            close(entry(Block::ForceZ, i, j), by_v(2), 1e-8);
            close(entry(Block::ForceQ, i, j), by_q(2), 1e-8);
        }
    }
}

#[dynamics(
    coordinates(q[n]),
    lagrangian = sum(i in 0..n, 1/2*dot(q[i])^2) - sum(i in 0..n-1, k/2*(q[i+1]-q[i])^2 + (q[i+1]-q[i])^4),
)]
struct Chain {
    n: usize,
    k: f64,
}

/// A chain of n bodies has n masses and 3n − 2 entries of stiffness, and scattering the values by the record of places
/// gives the matrix of the kernel.
#[test]
fn the_pattern_of_a_chain_is_a_band() {
    for n in [2, 5, 1000] {
        let chain = Chain { n, k: 0.5 };
        assert_eq!(chain.check(), Ok(()));
        let pattern = Pattern::of(&chain);
        let places = pattern.places();
        assert_eq!(places.len(), n + 3 * n - 2);
        let banded = |(block, row, column): &(Block, usize, usize)| match block {
            Block::ZZ => row == column,
            Block::QQ => row.abs_diff(*column) <= 1,
            _ => false,
        };
        assert!(places.iter().all(banded));
        let q: Vec<f64> = (0..n).map(|i| (0.7 * i as f64).sin()).collect();
        let mut values = vec![f64::NAN; places.len()];
        let (mut z, mut by_q) = (vec![0.0; n], vec![0.0; n]);
        let mut dense = Dense::default();
        let gradient = Gradient {
            z: &mut z,
            q: &mut by_q,
            force: &mut [],
        };
        family::Model::second(
            &chain,
            0.0,
            &q,
            &q,
            gradient,
            &mut pattern.scatter(&mut values),
        );
        let gradient = Gradient {
            z: &mut z,
            q: &mut by_q,
            force: &mut [],
        };
        family::Model::second(&chain, 0.0, &q, &q, gradient, &mut dense);
        for (place, value) in places.iter().zip(&values) {
            assert_eq!(dense.0.get(place), Some(value));
        }
    }
}

/// A potential with pairs only.
#[dynamics(
    coordinates(q[n]),
    lagrangian = sum(i in 0..n, dot(q[i])^2/2) + sum(i in 0..n, sum(j in 0..i, k*cos(q[i]-q[j]))),
)]
struct Pairs {
    n: usize,
    k: f64,
}

/// ∂²L/∂q_a∂q_b = k cos(q_a − q_b), and each row adds up to zero.
#[test]
fn pairs_of_differences_fill_their_diagonal() {
    let k = 0.7;
    for n in [1, 2, 5] {
        let mut dense = Dense::default();
        let (mut z, mut by_q) = ([0.0; 5], [0.0; 5]);
        let gradient = Gradient {
            z: &mut z,
            q: &mut by_q,
            force: &mut [],
        };
        family::Model::second(&Pairs { n, k }, T, &Q[..n], &V[..n], gradient, &mut dense);
        let entry = |a: usize, b: usize| {
            let found = dense.0.get(&(Block::QQ, a, b));
            found.copied().unwrap_or(0.0)
        };
        let pair = |a: usize, b: usize| k * (Q[a] - Q[b]).cos();
        for a in 0..n {
            let others = (0..n).filter(|b| *b != a);
            let diagonal: f64 = others.map(|b| pair(a, b)).sum();
            close(entry(a, a), -diagonal, ORDER);
            for b in (0..n).filter(|b| *b != a) {
                close(entry(a, b), pair(a, b), ORDER);
            }
        }
    }
}

/// Pairs of which the second is compared with the neighbour of the first: the last site has no neighbour, and no pairs.
#[dynamics(
    coordinates(q[n]),
    lagrangian = sum(i in 0..n, dot(q[i])^2/2) - sum(i in 0..n, sum(j in i+1..n, k*sin(q[i+1])*q[j])),
)]
struct Neighbours {
    n: usize,
    k: f64,
}

#[test]
fn nothing_is_read_for_sums_without_terms() {
    let k = 0.7;
    for n in [1, 2, 5] {
        let model = Neighbours { n, k };
        assert_eq!(model.check(), Ok(()));
        let (q, v) = (&Q[..n], &V[..n]);
        let (mut energy, mut slopes) = (0.0, [0.0; 5]);
        for i in 0..n {
            energy += v[i] * v[i] / 2.0;
            for j in i + 1..n {
                let next = q[i + 1];
                energy -= k * next.sin() * q[j];
                slopes[i + 1] -= k * next.cos() * q[j];
                slopes[j] -= k * next.sin();
            }
        }
        close(model.energy_function(T, q, v), energy, ORDER);
        let [mut z, mut by_q] = [[f64::NAN; 5]; 2];
        let gradient = Gradient {
            z: &mut z[..n],
            q: &mut by_q[..n],
            force: &mut [],
        };
        family::Model::first(&model, T, q, v, gradient);
        for a in 0..n {
            close(by_q[a], slopes[a], ORDER);
            close(z[a], v[a], ORDER);
        }
    }
}

/// With fixed size, whose kernels check nothing themselves.
#[dynamics(coordinates(x), lagrangian = dot(x)^2/2 - c[m-2]*x^2/2)]
struct LastButOne {
    m: usize,
    c: Vec<f64>,
}

#[test]
#[should_panic(expected = "index out of bounds")]
fn an_index_below_zero_is_not_the_first() {
    let energy = |m: usize| {
        let c = vec![3.0];
        LastButOne { m, c }.energy_function(T, &[2.0], &[0.0])
    };
    assert_eq!(energy(2), -6.0);
    let _ = energy(1);
}
