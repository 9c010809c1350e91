//! Constraints that a parameter switches off.

use crate::common::larger;
use tfe::Settings;
use tfe::constraints::tangent_basis;
use tfe::prelude::*;

fn worst(errors: impl IntoIterator<Item = f64>) -> f64 {
    errors.into_iter().fold(0.0, larger)
}

/// A ball on a sphere, which holds it while `on` is one.
#[dynamics(
    coordinates(x, y),
    let square = dot(x)^2 + dot(y)^2,
    lagrangian = m/2*square - m*g*y,
    constraint(sphere) = on*(x^2 + y^2 - 1)/2,
    event(leaves) = g*y - square,
)]
struct Ball {
    m: f64,
    g: f64,
    on: f64,
}

const BALL: Ball = Ball {
    m: 1.5,
    g: 9.81,
    on: 1.0,
};

/// A ball slides down a sphere from the top with the velocity v and leaves it where cos θ = 2/3 + v²/(3 g), where the
/// reaction is zero; then it falls freely.
#[test]
fn a_constraint_is_released_where_its_reaction_is_zero() {
    let v = 0.5;
    let start = BALL.state([0.0, 1.0], [v, 0.0]);
    let released = Simulation::new(&BALL).element(Mixed::<6>).step(0.02).on(
        "leaves",
        Crossing::Falling,
        |_| Act::Set(Settings::new("on", 0.0)),
    );
    let end = 1.0;
    let motion = released.clone().run(start, 0.0..end).expect("it flies");
    let leaves = &motion.events()[0];
    let height = 2.0 / 3.0 + v * v / (3.0 * BALL.g);
    assert!(
        (leaves.q[1] - height).abs() <= 1e-14,
        "{}",
        leaves.q[1] - height
    );
    let rest = end - leaves.t;
    let x = leaves.q[0] + leaves.v[0] * rest;
    let y = leaves.q[1] + leaves.v[1] * rest - BALL.g / 2.0 * rest * rest;
    let off = worst([
        (motion.last().q[0] - x).abs(),
        (motion.last().q[1] - y).abs(),
    ]);
    assert!(off <= 1e-14, "{off:e}");
    assert_eq!(motion.constraint_residual().rank, 0);

    // The matrices go across the event; along the sphere only such changes of the start count as it allows.
    let linearised = released.run_linearised(start, 0.0..end).expect("matrices");
    let mut change = nalgebra::DVector::from_vec(vec![BALL.m, 0.0, 0.0, 0.0]);
    for matrix in linearised.transitions() {
        change = matrix * change;
    }
    let d = 1e-3;
    let at = |v: f64| {
        let start = BALL.state([0.0, 1.0], [v, 0.0]);
        released.run(start, 0.0..end).expect("it flies").last().q
    };
    let [a, b, c, e] = [at(v + d), at(v - d), at(v + 2.0 * d), at(v - 2.0 * d)];
    for k in 0..2 {
        // A difference of fourth order: its error is about d⁴ times a derivative of about 10.
        let slope = (8.0 * (a[k] - b[k]) - (c[k] - e[k])) / (12.0 * d);
        assert!(
            (change[2 + k] - slope).abs() <= 1e-9,
            "{} {slope}",
            change[2 + k]
        );
    }
}

/// Without its constraint the ball is a free one, also for the motions that constraints allow: there was a panic.
#[test]
fn constraints_that_are_off_allow_every_motion() {
    let off = Ball { on: 0.0, ..BALL };
    let start = off.state([0.3, 1.0], [0.5, -0.2]);
    let basis = tangent_basis(&off, 0.0, &start).expect("a basis");
    assert_eq!(basis.shape(), (4, 4));
    let defect = basis.tr_mul(&basis) - nalgebra::DMatrix::identity(4, 4);
    assert!(defect.amax() <= 1e-15);
    let run = Simulation::new(&off)
        .step(0.1)
        .run_linearised(start, 0.0..0.5);
    let matrices = run.expect("matrices").on_constraints().map(<[_]>::to_vec);
    let mut product = nalgebra::DMatrix::identity(4, 4);
    for matrix in matrices.expect("as many at all nodes") {
        product = matrix * product;
    }
    // All multipliers of free motion are one: trace and determinant.
    assert!((product.trace() - 4.0).abs() <= 1e-13 && (product.determinant() - 1.0).abs() <= 1e-13);
}
