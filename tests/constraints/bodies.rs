//! Bodies in space: unit quaternions, Euler angles and rotation matrices give the same motion.

use crate::common::{assert_close, case, list, number, numbers};
use crate::models::{QuaternionTop, axes, rate};
use crate::runs::run;
use tfe::prelude::*;

/// The symmetric top in 3-1-3 Euler angles.
#[dynamics(
    coordinates(phi, theta, psi),
    lagrangian = jt/2*(dot(theta)^2 + (dot(phi)*sin(theta))^2) + ja/2*(dot(psi) + dot(phi)*cos(theta))^2 - mgd*cos(theta),
)]
struct EulerTop {
    jt: f64,
    ja: f64,
    mgd: f64,
}

/// The top in the nine entries of its rotation matrix with columns a, b, c, and the second moments d₁, d₂, d₃ of its
/// mass:
///
/// ```text
/// L = ½ Σ_k d_k |Ṙ_k|² − mgd c₃ ,   Rᵀ R = 1 ,   J₁ = d₂ + d₃, …
/// ```
#[dynamics(
    coordinates(a[3], b[3], c[3]),
    lagrangian = d1/2*inner(dot(a), dot(a)) + d2/2*inner(dot(b), dot(b)) + d3/2*inner(dot(c), dot(c)) - mgd*c[2],
    constraint(aa) = inner(a, a) - 1,
    constraint(bb) = inner(b, b) - 1,
    constraint(cc) = inner(c, c) - 1,
    constraint(ab) = inner(a, b),
    constraint(bc) = inner(b, c),
    constraint(ca) = inner(c, a),
)]
struct MatrixTop {
    d1: f64,
    d2: f64,
    d3: f64,
    mgd: f64,
}

/// A free body whose centre of mass is kept at the distance d from the origin along its third axis.
#[dynamics(
    coordinates(r[3], e[4]),
    let w = body_rate(e),
    lagrangian = m/2*inner(dot(r), dot(r)) + (i1*(w[0]^2 + w[1]^2) + i3*w[2]^2)/2 - m*g*r[2],
    constraint(unit) = inner(e, e) - 1,
    constraint(ball) = r - rotate(e, [0, 0, d]),
)]
struct HeldBody {
    m: f64,
    i1: f64,
    i3: f64,
    d: f64,
    g: f64,
}

/// The columns of the rotation matrix at 3-1-3 Euler angles.
fn euler_axes(phi: f64, theta: f64, psi: f64) -> [[f64; 3]; 3] {
    let ((sf, cf), (st, ct), (sp, cp)) = (phi.sin_cos(), theta.sin_cos(), psi.sin_cos());
    [
        [cf * cp - sf * ct * sp, sf * cp + cf * ct * sp, st * sp],
        [-cf * sp - sf * ct * cp, -sf * sp + cf * ct * cp, st * cp],
        [sf * st, -cf * st, ct],
    ]
}

#[test]
fn three_descriptions_of_one_top() {
    let quaternions = QuaternionTop::TABLE;
    let angles = EulerTop {
        jt: 1.0,
        ja: 0.5,
        mgd: 1.0,
    };
    let matrix = MatrixTop {
        d1: 0.25,
        d2: 0.25,
        d3: 0.75,
        mgd: 1.0,
    };
    let (element, step, time) = (Mixed::<7>, 0.05, 5.0);
    let start = quaternions.tilted();
    let [a, b, c] = axes(start.q);
    // Rotation about the third axis at 6: ȧ = 6 b, ḃ = −6 a.
    let flat =
        |columns: [[f64; 3]; 3]| -> [f64; 9] { std::array::from_fn(|k| columns[k / 3][k % 3]) };
    let spin = flat([b.map(|b| 6.0 * b), a.map(|a| -6.0 * a), [0.0; 3]]);
    let in_quaternions = run(&quaternions, element, step, start, time);
    let in_angles = run(
        &angles,
        element,
        step,
        angles.state([0.0, 0.5, 0.0], [0.0, 0.0, 6.0]),
        time,
    );
    let in_matrices = run(
        &matrix,
        element,
        step,
        matrix.state(flat([a, b, c]), spin),
        time,
    );
    for k in 0..in_quaternions.states().len() {
        let (e, f) = (in_quaternions.states()[k].q, in_angles.states()[k].q);
        let what = format!("t = {}", in_quaternions.states()[k].t);
        let expected = flat(euler_axes(f[0], f[1], f[2]));
        assert_close(&flat(axes(e)), &expected, 1e-9, &what);
        assert_close(&in_matrices.states()[k].q, &expected, 1e-9, &what);
    }
    let residuals = (
        in_quaternions.constraint_residual(),
        in_matrices.constraint_residual(),
    );
    assert_eq!((residuals.0.rank, residuals.1.rank), (1, 6));
    assert!(residuals.0.position < 1e-13 && residuals.1.position < 1e-13);
}

#[test]
fn a_ball_joint_holds_a_body() {
    // About the joint: J = i1 + m d² = 1, ½, mgd = 1.
    let (m, d) = (2.0, 0.5);
    let held = HeldBody {
        m,
        i1: 1.0 - m * d * d,
        i3: 0.5,
        d,
        g: 1.0,
    };
    let top = QuaternionTop::TABLE;
    let e = top.tilted().q;
    let e_rate = rate(e, [0.0, 0.0, 6.0]);
    let r = axes(e)[2].map(|c| d * c);
    let start = held.state(
        [r[0], r[1], r[2], e[0], e[1], e[2], e[3]],
        [0.0, 0.0, 0.0, e_rate[0], e_rate[1], e_rate[2], e_rate[3]],
    );
    let (joined, fixed) = (
        run(&held, Mixed::<7>, 0.05, start, 5.0),
        run(&top, Mixed::<7>, 0.05, top.tilted(), 5.0),
    );
    assert_eq!(
        joined.reactions().names(),
        &["unit", "ball[0]", "ball[1]", "ball[2]"]
    );
    assert_eq!(joined.states().len(), fixed.states().len());
    for (a, b) in joined.states().iter().zip(fixed.states()) {
        assert_close(&a.q[3..], &b.q, 1e-9, &format!("t = {}", a.t));
    }
}

/// Body rates and attitude at the times of the table.
fn check_trajectory(name: &str, body: &QuaternionTop, element: Element, step: f64) {
    let case = case("trajectories", name);
    let initial = numbers(&case["initial"]);
    let start = body.moving(
        initial[3..].try_into().expect("a quaternion"),
        initial[..3].try_into().expect("three rates"),
    );
    for at in list(&case["states"]) {
        let time = number(&at["t"]);
        let motion = run(body, element, step, start, time);
        let rates = motion
            .outputs()
            .row(motion.states().len() - 1)
            .expect("outputs at the last node");
        let actual: Vec<f64> = rates.iter().copied().chain(motion.last().q).collect();
        // Order 12; rates up to 6 in up to 400 steps.
        assert_close(
            &actual,
            &numbers(&at["state"]),
            1e-11,
            &format!("{name}, {element}, t = {time}"),
        );
    }
}

#[test]
fn trajectories_of_the_tables() {
    for element in [Element::mixed(7), Element::primal(7).reduced()] {
        check_trajectory("heavy_top", &QuaternionTop::TABLE, element, 0.04);
        let free = QuaternionTop {
            i1: 1.0,
            i2: 2.0,
            i3: 3.0,
            mgd: 0.0,
        };
        check_trajectory("euler_rigid_body", &free, element, 0.1);
    }
}

/// A published top that spins at 150 about its second axis; moments of inertia about the fixed point. The axes of the
/// body are renumbered, 3, 1, 2, so that it is the third one.
#[test]
fn the_fast_heavy_top() {
    let top = QuaternionTop {
        i1: 15.234375,
        i2: 15.234375,
        i3: 0.46875,
        mgd: 15.0 * 9.81,
    };
    // The published axes are those of space.
    let e = [0.5, -0.5, -0.5, -0.5];
    assert_eq!(axes(e), [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    let start = top.moving(e, [-4.61538, 0.0, 150.0]);
    let motion = run(&top, Mixed::<8>, 0.005, start, 2.0);
    let rates = motion
        .outputs()
        .row(motion.states().len() - 1)
        .expect("outputs at the last node");
    let [_, _, centre] = axes(motion.last().q);
    let expected = [-0.150416822745642, -0.724165591636896, -0.673022269560444];
    // 48 turns: a rounding error of the spin, 3e-14, in one step leads to an angle of 6e-14 at the end.
    assert_close(&centre, &expected, 1e-9, "centre of mass");
    let expected = [0.122233219497394, 150.0, -5.855624589205458];
    let rates = [rates[1], rates[2], rates[0]];
    assert_close(&rates, &expected, 1e-8, "body rates");
    assert!(motion.constraint_residual().position < 1e-13);
}
