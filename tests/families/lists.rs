//! Lists of indices: networks known at run time only.

use crate::impulses::Chain;
use crate::kernels::Dense;
use tfe::RunErrorKind;
use tfe::family::{self, Block, Gradient, Model as _};
use tfe::prelude::*;

#[dynamics(
    coordinates(q[n]),
    lagrangian = sum(i in 0..n, m[i]/2*dot(q[i])^2)
        - sum(b in 0..bonds, k[b]/2*(q[left[b]] - q[right[b]])^2 + k[b]*q[left[b]]^2*sin(q[right[b]])),
    output(stretch[b in 0..bonds]) = q[left[b]] - q[right[b]],
)]
struct Network {
    n: usize,
    bonds: usize,
    m: Vec<f64>,
    k: Vec<f64>,
    left: Vec<usize>,
    right: Vec<usize>,
}

/// A bond in both directions, one from a site to itself, and one that occurs twice.
fn network() -> Network {
    Network {
        n: 4,
        bonds: 6,
        m: vec![1.0, 1.5, 0.7, 2.0],
        k: vec![0.8, 0.5, 0.9, 0.4, 0.6, 0.3],
        left: vec![0, 2, 1, 2, 0, 0],
        right: vec![2, 0, 1, 3, 3, 3],
    }
}

const Q: [f64; 4] = [0.3, -0.2, 0.8, 0.1];
const V: [f64; 4] = [0.1, 0.5, -0.4, 0.2];

/// L_q and the entries of all second derivatives.
fn derivatives(model: &Network, q: &[f64]) -> ([f64; 4], Dense) {
    let [mut z, mut by_q] = [[f64::NAN; 4]; 2];
    let mut dense = Dense::default();
    let first = Gradient {
        z: &mut z,
        q: &mut by_q,
        force: &mut [],
    };
    model.second(0.0, q, &V, first, &mut dense);
    (by_q, dense)
}

/// By hand: each bond adds to both of its ends, and twice to the same site if these are equal.
#[test]
fn kernels_add_up_over_bonds() {
    let model = network();
    assert_eq!(model.check(), Ok(()));
    let (by_q, dense) = derivatives(&model, &Q);
    let (mut slope, mut bend) = ([0.0; 4], [[0.0; 4]; 4]);
    for b in 0..model.bonds {
        let (l, r, k) = (model.left[b], model.right[b], model.k[b]);
        let (x, y) = (Q[l], Q[r]);
        slope[l] -= k * (x - y) + 2.0 * k * x * y.sin();
        slope[r] -= k * (y - x) + k * x * x * y.cos();
        bend[l][l] -= k + 2.0 * k * y.sin();
        bend[r][r] -= k - k * x * x * y.sin();
        bend[l][r] -= 2.0 * k * x * y.cos() - k;
        bend[r][l] -= 2.0 * k * x * y.cos() - k;
    }
    for i in 0..4 {
        // About ten terms of order one.
        assert!((by_q[i] - slope[i]).abs() < 1e-14);
        for j in 0..4 {
            let value = dense.0.get(&(Block::QQ, i, j)).copied().unwrap_or(0.0);
            assert!((value - bend[i][j]).abs() < 1e-14, "{i} {j}");
        }
    }
    let stretch = model.stretch(0.0, &Q, &V).expect("lengths that fit");
    let ends = model.left.iter().zip(&model.right);
    let expected: Vec<f64> = ends.map(|(l, r)| Q[*l] - Q[*r]).collect();
    assert_eq!(stretch, expected);
}

/// The error of a central difference with a spacing of 2e-5: 1e-10 of third derivatives and 1e-11 from rounding.
#[test]
fn second_derivatives_are_those_of_the_first() {
    let model = network();
    let (_, dense) = derivatives(&model, &Q);
    let step = 1e-5;
    for j in 0..4 {
        let (mut up, mut down) = (Q, Q);
        up[j] += step;
        down[j] -= step;
        let ((up, _), (down, _)) = (derivatives(&model, &up), derivatives(&model, &down));
        for i in 0..4 {
            let slope = (up[i] - down[i]) / (2.0 * step);
            let value = dense.0.get(&(Block::QQ, i, j)).copied().unwrap_or(0.0);
            assert!((value - slope).abs() < 1e-8, "{i} {j}: {value} {slope}");
        }
    }
}

/// The same chain with neighbours and with a list, whose bonds have another order and direction.
#[test]
fn a_listed_chain_moves_like_a_chain() {
    #[dynamics(
        coordinates(q[n]),
        lagrangian = sum(i in 0..n, dot(q[i])^2/2)
            - sum(b in 0..bonds, (q[end[b]]-q[begin[b]])^2/2 + (q[end[b]]-q[begin[b]])^4/4),
    )]
    struct Listed {
        n: usize,
        bonds: usize,
        begin: Vec<usize>,
        end: Vec<usize>,
    }
    let n = 20;
    let shuffled = (0..n - 1).map(|b| 7 * b % (n - 1));
    let (begin, end) = shuffled
        .map(|b| if b % 3 == 0 { (b + 1, b) } else { (b, b + 1) })
        .unzip();
    let listed = Listed {
        n,
        bonds: n - 1,
        begin,
        end,
    };
    let chain = Chain { n, a: 1.0 };
    let q: Vec<f64> = (0..n).map(|i| (0.4 * i as f64).sin()).collect();
    let v = vec![0.0; n];
    let one = Simulation::new(&chain).step(0.05);
    let one = one.run(chain.state(q.clone(), v.clone()), 0.0..5.0);
    let other = Simulation::new(&listed).step(0.05);
    let other = other.run(listed.state(q, v), 0.0..5.0);
    let (one, other) = (one.expect("a motion"), other.expect("a motion"));
    for (a, b) in one.last().q.iter().zip(&other.last().q) {
        // The rounding errors of a hundred steps with sums in another order.
        assert!((a - b).abs() < 1e-12, "{a} {b}");
    }
}

#[test]
fn entries_of_lists_are_checked() {
    let error = |change: fn(&mut Network)| {
        let mut model = network();
        change(&mut model);
        model.check().expect_err("a mistake")
    };
    let outside = error(|model| model.right[3] = 4);
    let expected = family::ModelError::ListEntry {
        list: "right",
        place: 3,
        entry: 4,
        array: "q",
        index: "right[b]",
        ranges: "b in 0..bonds",
        length: 4,
    };
    assert_eq!(outside, expected);
    let message = "`right[3]` is 4, so the index of `q[right[b]]` in the sum over `b in 0..bonds` is out of range: `q` has 4 elements";
    assert_eq!(outside.to_string(), message);
    let huge = error(|model| model.left[0] = usize::MAX);
    let expected = family::ModelError::ListEntry {
        list: "left",
        place: 0,
        entry: usize::MAX,
        array: "q",
        index: "left[b]",
        ranges: "b in 0..bonds",
        length: 4,
    };
    assert_eq!(huge, expected);
    let short = error(|model| model.left.truncate(5));
    let message =
        "`left` has 5 elements, but `left[b]` in `output(stretch[b in 0..bonds])` needs 6";
    assert_eq!(short.to_string(), message);
    // Without bonds, nothing is read and nothing is shown.
    let none = Network {
        bonds: 0,
        k: Vec::new(),
        left: Vec::new(),
        right: Vec::new(),
        ..network()
    };
    assert_eq!(none.check(), Ok(()));
    assert_eq!(none.stretch(0.0, &Q, &V), Ok(Vec::new()));
    let mut model = network();
    model.left[5] = 9;
    let run = Simulation::new(&model).run(model.state(Q, V), 0.0..1.0);
    let kind = run.expect_err("a mistake").kind().clone();
    assert!(matches!(
        kind,
        RunErrorKind::Family(family::ModelError::ListEntry {
            place: 5,
            entry: 9,
            ..
        })
    ));
}

/// Indices computed from entries, entries of lists of parameters, and forces and constraints by lists.
#[test]
fn entries_stand_wherever_indices_do() {
    #[dynamics(
        coordinates(x[n]),
        lagrangian = sum(i in 0..n, m[kind[i]]/2*dot(x[i])^2) - sum(b in 0..w, 2*(x[2*site[b]+1] - x[last[b]-site[b]])^2),
        force(x[site[0]]) = t,
        output(number[b in 0..w]) = site[b]*last[b] - kind[b],
        constraint(rod[b in 0..w]) = x[site[b]]^2 - kind[b],
    )]
    struct Mixed {
        n: usize,
        w: usize,
        m: Vec<f64>,
        kind: Vec<usize>,
        site: Vec<usize>,
        last: Vec<usize>,
    }
    let good = || Mixed {
        n: 6,
        w: 2,
        m: vec![1.0, 2.0],
        kind: vec![0, 1, 1, 0, 1, 0],
        site: vec![2, 1],
        last: vec![5, 5],
    };
    let model = good();
    assert_eq!(model.check(), Ok(()));
    let q = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6];
    let expected: f64 = -2.0 * ((q[5] - q[3]) * (q[5] - q[3]) + (q[3] - q[4]) * (q[3] - q[4]));
    let found = model.energy_function(0.0, &q, &[0.0; 6]);
    assert!((found - expected).abs() < 1e-15);
    let masses = model.state([0.0; 6], [1.0; 6]).p;
    assert_eq!(masses, [1.0, 2.0, 2.0, 1.0, 2.0, 1.0]);
    let mut phi = [0.0; 2];
    model.constraint_values(0.0, &q, &mut phi);
    assert_eq!(phi, [q[2] * q[2], q[1] * q[1] - 1.0]);
    assert_eq!(model.number(0.0, &q, &q), Ok(vec![10.0, 4.0]));
    let told = |change: fn(&mut Mixed)| {
        let mut model = good();
        change(&mut model);
        model.check().expect_err("a mistake").to_string()
    };
    let message = "`kind[2]` is 2, so the index of `m[kind[i]]` in the sum over `i in 0..n` is out of range: `m` has 2 elements";
    assert_eq!(told(|model| model.kind[2] = 2), message);
    let message = "`site[0]` is 3, so the index of `x[2*site[b]+1]` in the sum over `b in 0..w` is out of range: `x` has 6 elements";
    assert_eq!(told(|model| model.site[0] = 3), message);
    // For an index computed from two entries, the error has its value.
    let message = "the index of `x[last[b]-site[b]]` in the sum over `b in 0..w` becomes -1, but `x` has 6 elements";
    assert_eq!(told(|model| model.last[1] = 0), message);
}
