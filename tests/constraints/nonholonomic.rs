//! Rolling and sliding: closed forms, and the different motion from the equations without the correction force.

use crate::common::{assert_close, distance, larger};
use crate::models::KnifeEdge;
use crate::runs::run;
use tfe::prelude::*;

#[test]
fn the_knife_edge() {
    let model = KnifeEdge::TABLE;
    let gs = model.g * model.alpha.sin();
    for w in [0.4, 1.3, 3.0] {
        let motion = run(&model, Mixed::<6>, 0.02, model.turning(w), 10.0);
        for node in motion.states() {
            let (t, scale) = (node.t, gs / (2.0 * w * w));
            let expected = [
                scale * (w * t).sin().powi(2),
                scale * (w * t - (2.0 * w * t).sin() / 2.0),
                w * t,
            ];
            // Coordinates up to 60.
            assert_close(&node.q, &expected, 1e-11, &format!("w = {w}, t = {t}"));
        }
        assert!(motion.constraint_residual().velocity < 1e-13);
    }
}

/// The Chaplygin sleigh: a blade behind the centre of mass, in the plane.
#[test]
fn the_chaplygin_sleigh() {
    let model = KnifeEdge {
        m: 1.5,
        j: 0.4,
        a: 0.3,
        g: 0.0,
        alpha: 0.0,
    };
    let c = 1.1;
    let k2 = (model.j + model.m * model.a * model.a) / model.m;
    let k = k2.sqrt();
    // From τ = −2, where it still slides backwards, through its turn until it slides straight ahead.
    let (start_time, rate) = (-2.0_f64, model.a * c / k2);
    let exact = |tau: f64| {
        let (v, w) = (c * tau.tanh(), c / k / tau.cosh());
        (v, w, 2.0 * k / model.a * (tau / 2.0).tanh().atan())
    };
    let (v, w, theta) = exact(start_time);
    let (sin, cos) = theta.sin_cos();
    let start = model.state(
        [0.0, 0.0, theta],
        [v * cos - model.a * w * sin, v * sin + model.a * w * cos, w],
    );
    let motion = run(&model, Mixed::<6>, 0.02 / rate, start, 6.0 / rate);
    for (node, velocity) in motion.states().iter().zip(motion.velocities()) {
        let (v, w, theta) = exact(start_time + rate * node.t);
        let (sin, cos) = theta.sin_cos();
        let expected = [theta, w, v];
        let actual = [
            node.q[2],
            velocity[2],
            velocity[0] * cos + velocity[1] * sin,
        ];
        assert_close(&actual, &expected, 1e-10, &format!("t = {}", node.t));
    }
    // The energy is ½ m c² at every node; order 10 has an error of 1e-12.
    let energy = 0.5 * model.m * c * c;
    assert!(
        motion.energies().iter().all(|e| (e - energy).abs() < 1e-11),
        "energy error {:e}",
        motion.energy_error()
    );
}

/// A coin that rolls upright on an incline: contact point, heading and roll. x points downhill.
#[dynamics(
    coordinates(x, y, phi, psi),
    lagrangian = m/2*(dot(x)^2 + dot(y)^2) + jd/2*dot(phi)^2 + ja/2*dot(psi)^2 + m*gs*x,
    constraint(roll_x) = dot(x) - r*dot(psi)*cos(phi),
    constraint(roll_y) = dot(y) - r*dot(psi)*sin(phi),
)]
struct Coin {
    m: f64,
    r: f64,
    jd: f64,
    ja: f64,
    gs: f64,
}

/// The equations from varying L + μ Ψ without the correction force: the Hamiltonian of an optimal control problem, the
/// extremum over all velocities that roll, with u along the heading,
///
/// ```text
/// H = ½ (p_x cos φ + p_y sin φ + p_ψ/r)² / (m + J_a/r²) + p_φ²/2J_d − m gs x ,   p = L_v + Aᵀμ
/// ```
#[dynamics(
    coordinates(x, y, phi, psi), momenta(px, py, pphi, ppsi),
    hamiltonian = (px*cos(phi) + py*sin(phi) + ppsi/r)^2/(2*(m + ja/r^2)) + pphi^2/(2*jd) - m*gs*x,
)]
struct VakonomicCoin {
    m: f64,
    r: f64,
    jd: f64,
    ja: f64,
    gs: f64,
}

#[test]
fn the_rolling_coin_and_its_vakonomic_double() {
    let (m, r, gs) = (0.3, 0.2, 2.0);
    let (jd, ja) = (m * r * r / 4.0, m * r * r / 2.0);
    let coin = Coin { m, r, jd, ja, gs };
    let w = 0.9;
    let end = 4.0;
    let start = coin.state([0.0; 4], [0.0, 0.0, w, 0.0]);
    let motion = run(&coin, Mixed::<6>, 0.02, start, end);
    // (m + J_a/r²) u̇ = m gs cos wt: the knife edge with two thirds of the slope.
    let slope = gs / (1.0 + ja / (m * r * r));
    let closed = |t: f64| {
        let scale = slope / (2.0 * w * w);
        [
            scale * (w * t).sin().powi(2),
            scale * (w * t - (2.0 * w * t).sin() / 2.0),
            w * t,
            slope / (r * w * w) * (1.0 - (w * t).cos()),
        ]
    };
    for node in motion.states() {
        assert_close(&node.q, &closed(node.t), 1e-11, &format!("t = {}", node.t));
    }
    // The same Lagrangian, initial position and velocities; the initial μ is arbitrary. For all of its values the
    // motion is a different one.
    let double = VakonomicCoin { m, r, jd, ja, gs };
    let mut nearest = f64::INFINITY;
    for i in -8..=8 {
        for j in -8..=8 {
            let (a, b) = (f64::from(i) / 8.0, f64::from(j) / 8.0);
            // p = L_v + Aᵀ μ with the rows (1, 0, 0, −r), (0, 1, 0, 0) at φ = 0.
            let mut start = start;
            start.p[0] += a;
            start.p[1] += b;
            start.p[3] -= r * a;
            let other = run(&double, Mixed::<5>, 0.02, start, end);
            let away = other
                .states()
                .iter()
                .map(|node| distance(&node.q[..3], &closed(node.t)[..3]))
                .fold(0.0, larger);
            nearest = nearest.min(away);
        }
    }
    assert!(nearest > 0.1, "a vakonomic motion comes within {nearest}");
}
