//! One model declared both ways: the views of each are the other.

use crate::common::{DoublePendulum, DuffingH, DuffingL, Relativistic, assert_close};
use tfe_runtime::legendre::{
    energy, energy_at, hamiltonian_view, lagrangian_view, momentum, state, velocity,
};
use tfe_runtime::{First, Form, LegendreError, Second};

fn entries<const N: usize>(first: &First<f64, N>, second: &Second<f64, N>) -> Vec<f64> {
    let matrices = [
        second.zz,
        second.zq,
        second.qq,
        second.force_z,
        second.force_q,
    ];
    let vectors = [first.z, first.q, first.force];
    vectors
        .iter()
        .flatten()
        .chain(matrices.iter().flatten().flatten())
        .copied()
        .collect()
}

/// A few roundings of terms of order ten.
const TOLERANCE: f64 = 1e-14;

#[test]
fn views_of_a_forced_model_with_variable_mass() {
    let (l, h) = (DuffingL { d: 0.3 }, DuffingH { d: 0.3 });
    for (t, q, v) in [(0.0, 0.8, -0.4), (1.3, -2.0, 1.5), (2.0, 0.0, 0.0)] {
        let p = momentum(&l, t, &[q], &[v]).expect("p");
        assert_close(
            &momentum(&h, t, &[q], &[v]).expect("p"),
            &p,
            TOLERANCE,
            "momentum",
        );
        let back = velocity(&l, t, &[q], &p, &[0.0]).expect("v");
        assert_close(&back, &[v], TOLERANCE, "velocity");

        let (a, b) = (
            lagrangian_view(&l, t, &[q], &[v]),
            lagrangian_view(&h, t, &[q], &[v]),
        );
        let (a, b) = (a.expect("L of L"), b.expect("L of H"));
        assert_close(&[b.lagrangian], &[a.lagrangian], TOLERANCE, "L");
        let (a, b) = (entries(&a.first, &a.second), entries(&b.first, &b.second));
        assert_close(&b, &a, TOLERANCE, "the Lagrangian view");

        let (a, b) = (
            hamiltonian_view(&l, t, &[q], &p),
            hamiltonian_view(&h, t, &[q], &p),
        );
        let (a, b) = (a.expect("H of L"), b.expect("H of H"));
        assert_close(&[a.hamiltonian], &[b.hamiltonian], TOLERANCE, "H");
        let (a, b) = (entries(&a.first, &a.second), entries(&b.first, &b.second));
        assert_close(&a, &b, TOLERANCE, "the Hamiltonian view");
        assert_close(
            &[energy(&l, t, &[q], &p).expect("H")],
            &[energy_at(&h, t, &[q], &p, &[v])],
            TOLERANCE,
            "energy",
        );
    }
}

#[test]
fn the_hamiltonian_view_of_two_coordinates_is_a_derivative() {
    let model = DoublePendulum { g: 9.81 };
    let start = state(&model, 0.0, &[1.2, -0.4], &[0.5, 1.5]).expect("p");
    let view = hamiltonian_view(&model, 0.0, &start.q, &start.p).expect("H");
    let delta = 1e-3;
    for b in 0..2 {
        // Central differences of order four: truncation 1e-12 times derivatives of order 10².
        let slope = |direction: fn(&mut tfe_runtime::State<2>, usize, f64)| {
            let at = |offset| {
                let mut moved = start;
                direction(&mut moved, b, offset);
                let view = hamiltonian_view(&model, 0.0, &moved.q, &moved.p).expect("H");
                [
                    view.first.z[0],
                    view.first.z[1],
                    view.first.q[0],
                    view.first.q[1],
                ]
            };
            let (a, b, c, d) = (at(delta), at(-delta), at(2.0 * delta), at(-2.0 * delta));
            [0, 1, 2, 3].map(|i| (8.0 * (a[i] - b[i]) - (c[i] - d[i])) / (12.0 * delta))
        };
        let by_p = slope(|state, b, offset| state.p[b] += offset);
        let by_q = slope(|state, b, offset| state.q[b] += offset);
        let second = &view.second;
        let expected = [
            second.zz[0][b],
            second.zz[1][b],
            second.zq[b][0],
            second.zq[b][1],
        ];
        assert_close(&by_p, &expected, 1e-9, "by p");
        let expected = [
            second.zq[0][b],
            second.zq[1][b],
            second.qq[0][b],
            second.qq[1][b],
        ];
        assert_close(&by_q, &expected, 1e-9, "by q");
    }
}

#[test]
fn damping_finds_velocities_below_the_speed_of_light() {
    for p in [0.1, 3.0, 1e3, -1e5] {
        let v = velocity(&Relativistic {}, 0.0, &[0.0], &[p], &[0.0]).expect("v");
        // v = p/√(1 + p²); close to one the inverse function is flat.
        assert_close(&v, &[p / (1.0 + p * p).sqrt()], 1e-14, "v");
    }
    let lost = velocity(&Relativistic {}, 0.0, &[0.0], &[f64::NAN], &[0.0]);
    assert_eq!(lost, Err(LegendreError::NonFinite));
    let outside = velocity(&Relativistic {}, 0.0, &[0.0], &[1.0], &[2.0]);
    assert_eq!(outside, Err(LegendreError::NonFinite));
    assert_eq!(
        <Relativistic as tfe_runtime::Model<1>>::FORM,
        Form::Lagrangian
    );
}
