//! The kernels of constraints at sites: compared with those of the same model of fixed size; their names; and the
//! conditions on lengths.

use std::collections::BTreeMap;
use tfe::family::{self, Block, Entries, Model as _};
use tfe::prelude::*;
use tfe::runtime::{ConstraintSecond, Model};

#[dynamics(
    coordinates(x[n], y[n]),
    lagrangian = sum(i in 0..n, m/2*(dot(x[i])^2 + dot(y[i])^2) - m*g*y[i]),
    constraint(rod[i in 0..n-1]) = (x[i+1]-x[i])^2 + (y[i+1]-y[i])^2 - l[i]^2,
    constraint(pin) = [x[0] - sin(t), y[n-1]*x[0]^2],
    constraint(rail[i in 1..n]) = y[i]*cos(g*x[i]) - t*x[i-1]*x[0],
)]
struct Long {
    n: usize,
    m: f64,
    g: f64,
    l: Vec<f64>,
}

#[dynamics(
    coordinates(x[3], y[3]),
    lagrangian = sum(i in 0..3, m/2*(dot(x[i])^2 + dot(y[i])^2) - m*g*y[i]),
    constraint(rod[i in 0..2]) = (x[i+1]-x[i])^2 + (y[i+1]-y[i])^2 - l[i]^2,
    constraint(pin) = [x[0] - sin(t), y[2]*x[0]^2],
    constraint(rail[i in 1..3]) = y[i]*cos(g*x[i]) - t*x[i-1]*x[0],
)]
struct Three {
    m: f64,
    g: f64,
    l: [f64; 2],
}

const LENGTHS: [f64; 2] = [1.0, 0.8];
const Q: [f64; 6] = [0.3, -0.2, 0.8, 0.1, -0.6, 0.5];
const MU: [f64; 6] = [0.7, -1.1, 0.4, 0.9, -0.3, 1.3];
const T: f64 = 0.35;

fn long() -> Long {
    let (n, m, g, l) = (3, 1.2, 0.9, LENGTHS.to_vec());
    Long { n, m, g, l }
}

/// Dense blocks, and the places in the order of the kernel.
#[derive(Default)]
struct Dense {
    values: BTreeMap<(Block, usize, usize), f64>,
    order: Vec<(Block, usize, usize)>,
}

impl Dense {
    fn entry(&self, block: Block, row: usize, column: usize) -> f64 {
        let value = self.values.get(&(block, row, column));
        value.copied().unwrap_or(0.0)
    }
}

impl Entries<f64> for Dense {
    fn add(&mut self, block: Block, row: usize, column: usize, value: f64) {
        *self.values.entry((block, row, column)).or_default() += value;
        self.order.push((block, row, column));
    }
}

/// About ten operations on numbers of order one, in a different order.
#[track_caller]
fn close(a: f64, b: f64) {
    assert!((a - b).abs() <= 1e-14 * b.abs().max(1.0), "{a} {b}");
}

#[test]
fn kernels_are_those_of_the_fixed_size() {
    let (long, three) = (
        long(),
        Three {
            m: 1.2,
            g: 0.9,
            l: LENGTHS,
        },
    );
    assert_eq!(long.check(), Ok(()));
    assert_eq!(long.constraints(), 6);
    let (mut values, mut expected) = ([f64::NAN; 6], [f64::NAN; 6]);
    long.constraint_values(T, &Q, &mut values);
    Model::constraint_values(&three, T, &Q, &mut expected);
    let (mut drift, mut expected_drift) = ([f64::NAN; 6], [0.0; 6]);
    let mut rows = [[0.0; 6]; 6];
    let mut dense = Dense::default();
    long.constraint_rows(T, &Q, &mut drift, &mut dense);
    Model::constraint_rows(&three, T, &Q, &mut rows, &mut expected_drift);
    let (mut psi_q, mut row_rates) = ([[0.0; 6]; 6], [[0.0; 6]; 6]);
    let mut second = ConstraintSecond {
        psi_q: &mut psi_q,
        row_rates: &mut row_rates,
        bend: [[0.0; 6]; 6],
        rate_q: [[0.0; 6]; 6],
        rate_v: [[0.0; 6]; 6],
    };
    long.constraint_second(T, &Q, &MU, &mut dense);
    Model::constraint_second(&three, T, &Q, &[0.0; 6], &MU, &mut second);
    for r in 0..6 {
        close(values[r], expected[r]);
        close(drift[r], expected_drift[r]);
        for a in 0..6 {
            close(dense.entry(Block::Row, r, a), rows[r][a]);
            close(dense.entry(Block::Bend, r, a), second.bend[r][a]);
        }
    }
    let inside = |(_, row, column): &(Block, usize, usize)| *row < 6 && *column < 6;
    assert!(dense.order.iter().all(inside));
}

/// As the record of a pattern needs it.
#[test]
fn entries_come_in_one_order_whatever_the_state_is() {
    let model = long();
    let order = |q: &[f64], mu: &[f64]| {
        let mut dense = Dense::default();
        model.constraint_rows(T, q, &mut [0.0; 6], &mut dense);
        model.constraint_second(T, q, mu, &mut dense);
        dense.order
    };
    assert_eq!(order(&Q, &MU), order(&[0.0; 6], &[0.0; 6]));
}

#[test]
fn rows_have_the_names_of_the_fixed_size() {
    let model = long();
    let names = (0..6).map(|row| model.constraint_name(row).to_string());
    let expected = ["rod[0]", "rod[1]", "pin[0]", "pin[1]", "rail[1]", "rail[2]"];
    assert!(names.eq(expected));
    let fixed = Three::CONSTRAINTS.iter().map(|constraint| constraint.name);
    assert!(fixed.eq(expected));
    const { assert!(Long::CONSTRAINED) };
}

#[test]
fn lengths_of_constraints_are_checked() {
    let check = |n: usize, l: usize| {
        let model = Long {
            n,
            l: vec![1.0; l],
            ..long()
        };
        model.check().map_err(|error| error.to_string())
    };
    assert_eq!(check(4, 3), Ok(()));
    let message = "`constraint(rod[i in 0..n-1])` is empty: its range is 0..0";
    assert_eq!(check(1, 0), Err(message.to_owned()));
    let message = "`l` has 4 elements, but `l[i]` in `constraint(rod[i in 0..n-1])` needs 3";
    assert_eq!(check(4, 4), Err(message.to_owned()));
}

#[test]
fn indices_of_constraints_are_checked() {
    #[dynamics(
        coordinates(x[n], y[w]),
        lagrangian = sum(i in 0..n, dot(x[i])^2/2) + sum(i in 0..w, dot(y[i])^2/2),
        constraint(tie[i in 0..n]) = x[i] - y[i]^2,
        constraint(last) = x[3] - 1,
    )]
    struct Ties {
        n: usize,
        w: usize,
    }
    assert_eq!(Ties { n: 4, w: 5 }.check(), Ok(()));
    assert_eq!(Ties { n: 4, w: 5 }.constraints(), 5);
    let error = Ties { n: 4, w: 3 }.check().expect_err("a missing tie");
    let expected = family::ModelError::Index {
        array: "y",
        index: "i",
        ranges: "constraint(tie[i in 0..n])",
        value: 3,
        length: 3,
    };
    assert_eq!(error, expected);
    let message =
        "the index of `y[i]` in `constraint(tie[i in 0..n])` becomes 3, but `y` has 3 elements";
    assert_eq!(error.to_string(), message);
    let error = Ties { n: 3, w: 3 }.check().expect_err("no fourth");
    let message = "the index of `x[3]` in `constraint(last)` becomes 3, but `x` has 3 elements";
    assert_eq!(error.to_string(), message);
    // Lengths that exceed any memory are refused before anything is counted.
    for n in [1 << 60, usize::MAX] {
        assert!(Ties { n, w: 3 }.check().is_err());
        assert!(Ties { n, w: n }.check().is_err());
    }
}

/// Affine constraints have no second derivatives, and models without constraints have no rows.
#[test]
fn what_is_not_there_is_empty() {
    #[dynamics(coordinates(x[n]), momenta(p[n]), hamiltonian = sum(i in 0..n, p[i]^2/2), constraint(gap[i in 0..n-1]) = x[i+1] - x[i] - 1)]
    struct Comb {
        n: usize,
    }
    #[dynamics(coordinates(x[n]), lagrangian = sum(i in 0..n, dot(x[i])^2/2 - x[i]^2))]
    struct Free {
        n: usize,
    }
    let (comb, free) = (Comb { n: 3 }, Free { n: 3 });
    let mut dense = Dense::default();
    comb.constraint_second(T, &Q[..3], &MU[..2], &mut dense);
    assert_eq!(dense.order, []);
    let mut drift = [f64::NAN; 2];
    comb.constraint_rows(T, &Q[..3], &mut drift, &mut dense);
    assert_eq!(drift, [0.0; 2]);
    assert_eq!(dense.order.len(), 4);
    assert_eq!((comb.constraints(), free.constraints()), (2, 0));
    const { assert!(Comb::CONSTRAINED && !Free::CONSTRAINED) };
}

#[test]
#[cfg(not(feature = "sparse"))]
fn without_sparse_factorisations_there_is_no_motion() {
    let model = long();
    let start = model.state(Q, [0.0; 6]);
    let error = Simulation::new(&model).run(start, 0.0..1.0);
    let error = error.expect_err("not supported");
    let expected = tfe::RunErrorKind::Family(family::ModelError::ConstraintsNotSupported);
    assert_eq!(error.kind(), &expected);
}
