//! Mechanisms compared with minimal coordinates and with published results.

use crate::common::{assert_close, distance};
use crate::models::Andrews;
use crate::runs::{last_velocities, run};
use tfe::prelude::*;

/// The car axis: two masses on springs; the left wheel stands, the right one moves up and down.
#[dynamics(
    coordinates(xl, yl, xr, yr),
    let yb = r*sin(omega*t),
    let xb = sqrt(1 - yb^2),
    let left = sqrt(xl^2 + yl^2),
    let right = sqrt((xr - xb)^2 + (yr - yb)^2),
    lagrangian = k/2*(dot(xl)^2 + dot(yl)^2 + dot(xr)^2 + dot(yr)^2) - (left - l0)^2/2 - (right - l0)^2/2 - k*g*(yl + yr),
    constraint(square) = xl*xb + yl*yb,
    constraint(axis) = (xl - xr)^2 + (yl - yr)^2 - 1,
)]
struct CarAxis {
    k: f64,
    l0: f64,
    r: f64,
    omega: f64,
    g: f64,
}

/// A rod far above the origin is checked like one close to it: at heights of 1e9 a rod that was too long by a tenth
/// used to be accepted.
#[test]
fn a_rod_holds_at_any_height() {
    use tfe::runtime::constrained::{START_TOLERANCE, start_residuals};
    let model = CarAxis {
        k: 5e-4,
        l0: 0.5,
        r: 0.0,
        omega: 10.0,
        g: 1.0,
    };
    let at = |height: f64, right: f64| [0.0, height, right, height];
    let off = |height: f64, right: f64, speed: f64| {
        let v = [0.0, 0.0, speed, 0.0];
        start_residuals(&model, 0.0, &at(height, right), &v, 0.01)[1].relative()
    };
    for height in [0.5, 1e3, 1e9, 1.5e11] {
        for (right, speed) in [(1.1, 0.0), (1.0 - 1e-6, 0.0), (1.0, 0.01)] {
            let off = off(height, right, speed);
            assert!(off > START_TOLERANCE, "{height}, {right}, {speed}: {off:e}");
        }
        for right in [1.0, 1.0 + 1e-9, 1.0 - 1e-14] {
            let off = off(height, right, 0.0);
            assert!(off <= START_TOLERANCE, "{height}, {right}: {off:e}");
        }
    }
    let long = model.state(at(1e9, 1.1), [0.0; 4]);
    let run = Simulation::new(&model).step(0.01).run(long, 0.0..0.01);
    let text = run.expect_err("the rod is too long").to_string();
    // 1.1² − 1
    assert!(text.contains("`axis` = 2.100e-1"), "{text}");
    // Newton's method must end when the constraint of the rod holds, not when its steps are small relative to the
    // height: 1e-5 was left.
    let found = model
        .consistent_state(at(1e13, 1.1), [0.0; 4])
        .expect("a rod of length one is near");
    let [left, _, right, _] = found.state.q;
    assert!((right - left - 1.0).abs() < 1e-9, "{left} {right}");
}

#[test]
fn the_car_axis() {
    let model = CarAxis {
        k: 5e-4,
        l0: 0.5,
        r: 0.1,
        omega: 10.0,
        g: 1.0,
    };
    let start = model.state([0.0, 0.5, 1.0, 0.5], [-0.5, 0.0, -0.5, 0.0]);
    let motion = run(&model, Mixed::<5>, 0.01, start, 3.0);
    // The error of the element with this step is 1.1e-10 in positions and 6.9e-9 in velocities, by the table of the
    // theory.
    assert_close(
        &motion.last().q,
        &[
            0.049345578427524094,
            0.4969894602300081,
            1.0417425248854262,
            0.3739110272653658,
        ],
        1e-9,
        "positions",
    );
    assert_close(
        &last_velocities(&motion),
        &[
            -0.07705836840359208,
            0.007446866592068417,
            0.017556815753541736,
            0.7703410437796011,
        ],
        1e-8,
        "velocities",
    );
    let residual = motion.constraint_residual();
    assert!(residual.position <= 1e-13, "|φ| = {:e}", residual.position);
    // Velocities are up to 1, and entries of the constraint rows up to 2.
    assert!(residual.velocity <= 1e-13, "|ψ| = {:e}", residual.velocity);
    assert_eq!(residual.rank, 2);
}

/// Elements of four to eight nodes agree to 2e-12, and two halvings of the step to rounding. The test set for initial
/// value problems has published 16 digits, which differ from them by 1.1e-9.
#[test]
fn andrews_squeezer() {
    let published = [
        15.81077119629904,
        -15.75637105984298,
        0.04082224013073101,
        -0.5347301163226948,
        0.5244099658805304,
        0.5347301163226948,
        1.048080741042263,
    ];
    let end = |nodes: usize, h: f64| {
        let motion = run(&Andrews, Element::mixed(nodes), h, Andrews.at_rest(), 0.03);
        let residual = motion.constraint_residual().position;
        assert!(residual <= 1e-15, "|φ| = {residual:e}");
        motion.last().q
    };
    let exact = end(6, 5e-5);
    assert_close(&exact, &published, 2e-9, "published angles");
    for (nodes, h, most) in [(4, 2.5e-5, 2e-12), (6, 2.5e-5, 2e-13), (8, 1e-4, 2e-13)] {
        let off = distance(&end(nodes, h), &exact);
        assert!(off < most, "{nodes} nodes, h = {h}: {off:e}");
    }
}

/// A slider–crank as a closed loop: the angles of crank and rod, and the position of the slider on the line y = 0.
#[dynamics(
    coordinates(crank, rod, slider),
    let x = r*cos(crank) + l/2*cos(rod),
    let y = r*sin(crank) + l/2*sin(rod),
    lagrangian = jc/2*dot(crank)^2 + mr/2*(dot(x)^2 + dot(y)^2) + jr/2*dot(rod)^2 + ms/2*dot(slider)^2 - mr*g*y - mc*g*r/2*sin(crank),
    force(slider) = -c*dot(slider),
    constraint(loop_x) = r*cos(crank) + l*cos(rod) - slider,
    constraint(loop_y) = r*sin(crank) + l*sin(rod),
)]
struct SliderCrank {
    r: f64,
    l: f64,
    jc: f64,
    jr: f64,
    mc: f64,
    mr: f64,
    ms: f64,
    g: f64,
    c: f64,
}

/// The same with the angle of the crank only.
#[dynamics(
    coordinates(crank),
    let rod = -asin(r/l*sin(crank)),
    let slider = r*cos(crank) + l*cos(rod),
    let x = r*cos(crank) + l/2*cos(rod),
    let y = r*sin(crank) + l/2*sin(rod),
    lagrangian = jc/2*dot(crank)^2 + mr/2*(dot(x)^2 + dot(y)^2) + jr/2*dot(rod)^2 + ms/2*dot(slider)^2 - mr*g*y - mc*g*r/2*sin(crank),
    force(crank) = c*dot(slider)*r*(sin(crank) - sin(rod)*cos(crank)/cos(rod)),
    output(rod_angle) = rod,
    output(slider_place) = slider,
    output(slider_speed) = dot(slider),
)]
struct CrankAlone {
    r: f64,
    l: f64,
    jc: f64,
    jr: f64,
    mc: f64,
    mr: f64,
    ms: f64,
    g: f64,
    c: f64,
}

#[test]
fn the_slider_crank() {
    let (r, l) = (0.5, 1.4);
    let (jc, jr, mc, mr, ms, g, c) = (0.05, 0.2, 0.6, 1.2, 0.9, 9.81, 0.3);
    let closed = SliderCrank {
        r,
        l,
        jc,
        jr,
        mc,
        mr,
        ms,
        g,
        c,
    };
    let alone = CrankAlone {
        r,
        l,
        jc,
        jr,
        mc,
        mr,
        ms,
        g,
        c,
    };
    let (crank, rate) = (0.8_f64, 11.0);
    let rod = -(r / l * crank.sin()).asin();
    let rod_rate = -r * crank.cos() * rate / (l * rod.cos());
    let slider = r * crank.cos() + l * rod.cos();
    let slider_rate = -r * crank.sin() * rate - l * rod.sin() * rod_rate;
    let start = closed.state([crank, rod, slider], [rate, rod_rate, slider_rate]);
    // Two turns.
    let motion = run(&closed, Mixed::<7>, 0.01, start, 1.2);
    let minimal = run(&alone, Mixed::<7>, 0.01, alone.state([crank], [rate]), 1.2);
    assert!(minimal.last().q[0] > 6.0, "it turns: {:?}", minimal.last());
    let nodes = motion.states().iter().zip(motion.velocities());
    for (k, (node, v)) in nodes.enumerate() {
        let (crank, outputs) = (
            &minimal.states()[k],
            minimal.outputs().row(k).expect("recorded"),
        );
        let expected = [crank.q[0], outputs[0], outputs[1]];
        // Both have order 12 and 60 steps per turn.
        assert_close(&node.q, &expected, 1e-10, &format!("t = {}", node.t));
        let rates = [minimal.velocities()[k][0], outputs[2]];
        assert_close(&[v[0], v[2]], &rates, 1e-8, &format!("t = {}", node.t));
    }
    assert!(motion.constraint_residual().position < 1e-14);
}

/// Five point masses on rods, in angles from the downward vertical.
#[dynamics(
    coordinates(a[5]),
    let x1 = l*sin(a[0]), let y1 = -l*cos(a[0]),
    let x2 = x1 + l*sin(a[1]), let y2 = y1 - l*cos(a[1]),
    let x3 = x2 + l*sin(a[2]), let y3 = y2 - l*cos(a[2]),
    let x4 = x3 + l*sin(a[3]), let y4 = y3 - l*cos(a[3]),
    let x5 = x4 + l*sin(a[4]), let y5 = y4 - l*cos(a[4]),
    lagrangian = m/2*(dot(x1)^2 + dot(y1)^2 + dot(x2)^2 + dot(y2)^2 + dot(x3)^2 + dot(y3)^2 + dot(x4)^2 + dot(y4)^2
        + dot(x5)^2 + dot(y5)^2) - m*g*(y1 + y2 + y3 + y4 + y5),
)]
struct ChainAngles {
    m: f64,
    l: f64,
    g: f64,
}

/// The same in Cartesian coordinates, with a constraint for each rod.
#[dynamics(
    coordinates(x[5], y[5]),
    lagrangian = sum(i in 0..5, m/2*(dot(x[i])^2 + dot(y[i])^2) - m*g*y[i]),
    constraint(hanger) = x[0]^2 + y[0]^2 - l^2,
    constraint(rod[i in 0..4]) = (x[i+1] - x[i])^2 + (y[i+1] - y[i])^2 - l^2,
)]
struct ChainPlaces {
    m: f64,
    l: f64,
    g: f64,
}

#[test]
fn five_links_in_angles_and_in_places() {
    let (m, l, g) = (0.4, 0.7, 9.81);
    let angles = ChainAngles { m, l, g };
    let places = ChainPlaces { m, l, g };
    let a = [0.5, 0.3, -0.2, 0.4, 0.6];
    let w = [0.0, 0.5, -0.3, 0.8, 0.0];
    let spread = |a: &[f64], w: &[f64]| {
        let (mut q, mut v) = ([0.0; 10], [0.0; 10]);
        let mut end = [0.0; 4];
        for i in 0..5 {
            end[0] += l * a[i].sin();
            end[1] -= l * a[i].cos();
            end[2] += l * a[i].cos() * w[i];
            end[3] += l * a[i].sin() * w[i];
            (q[i], q[5 + i], v[i], v[5 + i]) = (end[0], end[1], end[2], end[3]);
        }
        (q, v)
    };
    let (q, v) = spread(&a, &w);
    let in_angles = run(&angles, Mixed::<7>, 0.02, angles.state(a, w), 2.0);
    let in_places = run(&places, Mixed::<7>, 0.02, places.state(q, v), 2.0);
    assert_eq!(
        in_places.reactions().names(),
        &["hanger", "rod[0]", "rod[1]", "rod[2]", "rod[3]"]
    );
    for k in 0..in_angles.states().len() {
        let (q, v) = spread(&in_angles.states()[k].q, &in_angles.velocities()[k]);
        // Order 12 with steps of 0.02; the fastest mode has a period of 0.4.
        let what = format!("t = {}", in_angles.states()[k].t);
        assert_close(&in_places.states()[k].q, &q, 1e-10, &what);
        assert!(
            distance(&in_places.velocities()[k], &v) < 1e-9,
            "{what}: velocities"
        );
    }
    assert_eq!(in_places.constraint_residual().rank, 5);
    assert!(in_places.constraint_residual().position < 1e-13);
}
