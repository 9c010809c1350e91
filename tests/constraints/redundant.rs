//! Redundant constraints, of which some follow from others: the rank is reported, and the motion is the same.

use crate::common::distance;
use crate::models::{Pendulum, RodPendulum};
use crate::runs::{differences, run};
use crate::spatial_four_bar::SpatialFourBar;
use std::ops::RangeInclusive;
use tfe::prelude::*;

/// The rod declared twice, by the square of its length and by its length.
#[dynamics(
    coordinates(x, y),
    lagrangian = m/2*(dot(x)^2 + dot(y)^2) - m*g*y,
    constraint(rod) = (x^2 + y^2 - l^2)/2,
    constraint(length) = sqrt(x^2 + y^2) - l,
)]
struct TwiceHeld {
    m: f64,
    l: f64,
    g: f64,
}

/// A blade with its constraint and a multiple of it that depends on the heading.
#[dynamics(
    coordinates(x, y, phi),
    lagrangian = (dot(x)^2 + dot(y)^2 + dot(phi)^2)/2 + gs*x,
    constraint(blade) = dot(x)*sin(phi) - dot(y)*cos(phi),
    constraint(again) = (2 + cos(phi))*(dot(x)*sin(phi) - dot(y)*cos(phi)),
)]
struct TwoBlades {
    gs: f64,
}

/// The same beside a coordinate that is far away, but the second length grows.
#[dynamics(
    coordinates(x, y, z),
    lagrangian = (dot(x)^2 + dot(y)^2 + dot(z)^2)/2 - g*y,
    constraint(rod) = x^2 + y^2 - 1,
    constraint(length) = sqrt(x^2 + y^2) - 1 - c*t^2,
)]
struct Parting {
    g: f64,
    c: f64,
}

/// Ends of steps are compared with the size of each constraint: beside 1e9 these constraints parted without an error.
#[test]
fn constraints_that_part_are_told_in_mixed_units() {
    use tfe::runtime::ConstraintError;
    use tfe::{RunErrorKind, StepError};
    let run = |c: f64, far: f64| {
        let model = Parting { g: 9.81, c };
        let start = model.state([1.0, 0.0, far], [0.0, 0.5, 0.0]);
        let motion = Simulation::new(&model).step(0.1).run(start, 0.0..0.2);
        motion.map_err(|error| error.kind().clone())
    };
    for far in [0.0, 1e9] {
        assert!(run(0.0, far).is_ok(), "{far:e}");
        let kind = run(1.0, far).expect_err("constraints that contradict");
        let RunErrorKind::Solve { source, .. } = kind else {
            panic!("{far:e}: {kind}");
        };
        let is_told = matches!(
            source,
            StepError::Constraint(ConstraintError::Dependent { .. })
        );
        assert!(is_told, "{far:e}: {source}");
    }
}

/// Two cranks of lengths r and 2r on one slider.
#[dynamics(
    coordinates(x, a, b),
    lagrangian = m/2*dot(x)^2 + m*r^2/2*(dot(a)^2 + dot(b)^2),
    constraint(first) = x - r*cos(a),
    constraint(second) = x - 2*r*sin(b),
)]
struct Cranks {
    m: f64,
    r: f64,
}

/// Coordinates and velocities that satisfy the constraints of two cranks.
fn cranks_in_motion(r: f64) -> ([f64; 3], [f64; 3]) {
    let (a, rate) = (1.0_f64, 1.0);
    let b = (0.5 * a.cos()).asin();
    let v = [-r * a.sin() * rate, rate, -0.5 * a.sin() * rate / b.cos()];
    ([r * a.cos(), a, b], v)
}

/// Lengths of 1e-11 m next to angles: both rows are nearly (1, 0, 0). One was silently left out as redundant, so that
/// the second crank moved freely.
#[test]
fn short_cranks_are_two_conditions() {
    let ends = [1.0, 1e-11].map(|r| {
        let model = Cranks { m: 1.0, r };
        let (q, v) = cranks_in_motion(r);
        let start = model.state(q, v);
        let run = Simulation::new(&model).element(Mixed::<4>).step(0.01);
        let motion = run.run(start, 0.0..2.0).expect("a run");
        assert_eq!(motion.constraint_residual().rank, 2, "{r:e}");
        for node in motion.states() {
            let off = node.q[1].cos() - 2.0 * node.q[2].sin();
            assert!(off.abs() < 1e-9, "{r:e}, t = {}: {off:e}", node.t);
        }
        motion.last().q
    });
    // The unit of length makes no difference except for the rounding errors of 200 steps.
    for k in 1..3 {
        let off = ends[1][k] - ends[0][k];
        assert!(off.abs() < 1e-9, "{off:e}");
    }
}

/// The same with a third condition that follows from the two.
#[dynamics(
    coordinates(x, a, b),
    lagrangian = m/2*dot(x)^2 + m*r^2/2*(dot(a)^2 + dot(b)^2),
    constraint(first) = x - r*cos(a),
    constraint(second) = x - 2*r*sin(b),
    constraint(both) = 3*x - r*cos(a) - 4*r*sin(b),
)]
struct CranksThrice {
    m: f64,
    r: f64,
}

/// Three rows that are nearly (1, 0, 0), of which two are independent, are combined in units of inertia: of the
/// combinations one was lost, so that the second crank moved freely.
#[test]
fn short_redundant_cranks_are_two_conditions() {
    let ends = [1.0, 1e-11].map(|r| {
        let model = CranksThrice { m: 1.0, r };
        let (q, v) = cranks_in_motion(r);
        let start = model.state(q, v);
        let run = Simulation::new(&model).element(Mixed::<4>).step(0.01);
        let motion = run.run(start, 0.0..2.0).expect("a run");
        assert_eq!(motion.constraint_residual().rank, 2, "{r:e}");
        for node in motion.states() {
            let off = node.q[1].cos() - 2.0 * node.q[2].sin();
            assert!(off.abs() <= 1e-8, "{r:e}, t = {}: {off:e}", node.t);
        }
        motion.last().q
    });
    for k in 1..3 {
        let off = ends[1][k] - ends[0][k];
        assert!(off.abs() <= 1e-8, "{off:e}");
    }
}

/// Starts near short cranks are found as those near long ones: the difference of both conditions was left out.
#[test]
fn starts_of_short_cranks_are_those_of_long_ones() {
    fn near<M: Model<3>>(model: &M, r: f64) -> [f64; 3] {
        let (q, v) = ([1.1 * r * 1.0_f64.cos(), 1.0, 0.3], [0.0, 1.0, 0.0]);
        let found = model.consistent_state(q, v);
        let found = found.unwrap_or_else(|error| panic!("{r:e}: {error}"));
        let [x, a, b] = found.state.q;
        assert_eq!(found.rank, 2, "{r:e}");
        for off in [x / r - a.cos(), x / r - 2.0 * b.sin()] {
            assert!(off.abs() <= 1e-13, "{r:e}: {off:e}");
        }
        [x / r, a, b]
    }
    let all = [1.0, 1e-11].map(|r| {
        let (m, thrice) = (1.0, CranksThrice { m: 1.0, r });
        [near(&Cranks { m, r }, r), near(&thrice, r)]
    });
    // The inertias of long cranks are one.
    for places in [all[0][1], all[1][0], all[1][1]] {
        for (found, expected) in places.iter().zip(&all[0][0]) {
            assert!((found - expected).abs() <= 1e-9, "{all:?}");
        }
    }
}

#[test]
fn two_equations_for_one_rod() {
    let (one, two) = (
        RodPendulum::UNIT,
        TwiceHeld {
            m: 1.0,
            l: 1.0,
            g: 9.81,
        },
    );
    for nodes in 2..=5 {
        let element = Element::mixed(nodes);
        let (a, b) = (
            run(&one, element, 0.02, one.horizontal(), 5.0),
            run(&two, element, 0.02, one.horizontal(), 5.0),
        );
        assert_eq!(a.constraint_residual().rank, 1);
        assert_eq!(b.constraint_residual().rank, 1);
        assert!(b.constraint_residual().position < 1e-12);
        if nodes >= 4 {
            // The two equations differ off the circle, within elements: the discrete motions agree up to the accuracy
            // of both.
            let (q, p) = differences(&a, &b);
            let error = if nodes == 4 { 1e-7 } else { 1e-10 };
            assert!(q < error && p < 5.0 * error, "{nodes}: {q:e}, {p:e}");
        }
        // The sum of the multipliers, each times the length of its row (both 1 at l = 1), is the reaction; that of
        // least norm has equal parts.
        let (rod, first, second) = (
            a.reactions().column("rod").expect("declared"),
            b.reactions().column("rod").expect("declared"),
            b.reactions().column("length").expect("declared"),
        );
        let k = rod.len() - 1;
        let (q, v) = (b.last().q, b.velocities()[k]);
        let pull = 9.81 * q[1] - v[0] * v[0] - v[1] * v[1];
        assert!((first[k] + second[k] - pull).abs() < 1e-11);
        assert!((first[k] - second[k]).abs() < 1e-11, "of least norm");
    }
}

#[test]
fn two_equations_for_one_blade() {
    let gs = 9.81 / 2.0;
    let two = TwoBlades { gs };
    let w = 1.3;
    let start = two.state([0.0; 3], [0.0, 0.0, w]);
    let motion = run(&two, Mixed::<6>, 0.05, start, 5.0);
    assert_eq!(motion.constraint_residual().rank, 1);
    let end = motion.last();
    let expected = [
        gs / (2.0 * w * w) * (w * end.t).sin().powi(2),
        gs / (2.0 * w * w) * (w * end.t - (2.0 * w * end.t).sin() / 2.0),
        w * end.t,
    ];
    assert!(distance(&end.q, &expected) < 1e-10, "{end:?}");
}

/// A four-bar linkage in the plane: three angles, two equations. The first and the last bar begin on the ground.
#[dynamics(
    coordinates(a1, a2, a3),
    let x1 = l1/2*cos(a1), let y1 = l1/2*sin(a1),
    let x2 = l1*cos(a1) + l2/2*cos(a2), let y2 = l1*sin(a1) + l2/2*sin(a2),
    let x3 = ground + l3/2*cos(a3), let y3 = l3/2*sin(a3),
    lagrangian = m1/2*(dot(x1)^2 + dot(y1)^2) + m2/2*(dot(x2)^2 + dot(y2)^2) + m3/2*(dot(x3)^2 + dot(y3)^2)
        + m1*l1^2/24*dot(a1)^2 + m2*l2^2/24*dot(a2)^2 + m3*l3^2/24*dot(a3)^2 - g*(m1*y1 + m2*y2 + m3*y3),
    constraint(loop_x) = l1*cos(a1) + l2*cos(a2) - ground - l3*cos(a3),
    constraint(loop_y) = l1*sin(a1) + l2*sin(a2) - l3*sin(a3),
)]
struct PlanarFourBar {
    l1: f64,
    l2: f64,
    l3: f64,
    ground: f64,
    m1: f64,
    m2: f64,
    m3: f64,
    g: f64,
}

/// The same linkage of bodies in space, with seven equations more than are independent.
#[test]
fn a_four_bar_linkage_in_space() {
    // The crank stands up at (0, ½), the coupler goes from there to (1, 0.9), the rocker from (1.2, 0).
    let (l1, l2, l3, ground) = (0.5, 1.0_f64.hypot(0.4), 0.2_f64.hypot(0.9), 1.2);
    let (m1, m2, m3, g) = (0.5, 1.0, 0.8, 9.81);
    let planar = PlanarFourBar {
        l1,
        l2,
        l3,
        ground,
        m1,
        m2,
        m3,
        g,
    };
    let spatial = SpatialFourBar {
        l1,
        l2,
        l3,
        ground,
        alpha: 0.0,
        beta: 0.0,
        m1,
        m2,
        m3,
        g,
    };
    let angles = [
        std::f64::consts::FRAC_PI_2,
        0.4_f64.atan2(1.0),
        0.9_f64.atan2(-0.2),
    ];
    // The end of the coupler moves with coupler and rocker: w₂ = −0.2 w₃ and −½ w₁ − 0.4 w₂ = −0.9 w₃.
    let w1 = 4.0;
    let w3 = 0.5 * w1 / 0.98;
    let rates = [w1, -0.2 * w3, w3];
    let middles = [[0.0, 0.25], [0.5, 0.7], [1.1, 0.45]];
    // The centres of crank and rocker move about their pivots on the ground; that of the coupler about the tip of the
    // crank.
    let speeds = [
        [-0.25 * w1, 0.0],
        [-0.5 * w1 - 0.2 * rates[1], 0.5 * rates[1]],
        [-0.45 * w3, -0.1 * w3],
    ];
    // In space, the last bar ends on the ground.
    let turned = [0.0, 0.0, -std::f64::consts::PI];
    let (mut q, mut v) = ([0.0; 21], [0.0; 21]);
    for body in 0..3 {
        let (half, at) = ((angles[body] + turned[body]) / 2.0, 7 * body);
        q[at..at + 2].copy_from_slice(&middles[body]);
        v[at..at + 2].copy_from_slice(&speeds[body]);
        (q[at + 3], q[at + 6]) = (half.cos(), half.sin());
        v[at + 3] = -0.5 * rates[body] * half.sin();
        v[at + 6] = 0.5 * rates[body] * half.cos();
    }
    let flat = run(&planar, Mixed::<6>, 0.01, planar.state(angles, rates), 0.5);
    let motion = run(&spatial, Mixed::<5>, 0.01, spatial.state(q, v), 0.5);
    assert_eq!(motion.reactions().names().len(), 27);
    assert_eq!(motion.constraint_residual().rank, 20);
    assert!(motion.constraint_residual().position < 1e-13);
    assert!(motion.constraint_residual().velocity < 1e-12);
    for (k, (a, b)) in motion.states().iter().zip(flat.states()).enumerate() {
        for body in 0..3 {
            let (half, at) = ((b.q[body] + turned[body]) / 2.0, 7 * body);
            // Order 8 with steps of 0.01.
            assert!(
                (a.q[at + 3] - half.cos()).abs() < 1e-9
                    && (a.q[at + 6] - half.sin()).abs() < 1e-9
                    && a.q[at + 2].abs() < 1e-12,
                "t = {}, body {body}: {:?}",
                b.t,
                &a.q[at..at + 7]
            );
        }
        let reactions = motion.reactions().row(k).expect("recorded");
        assert!(reactions.iter().all(|r| r.is_finite()));
    }
    assert!(motion.reactions().row(usize::MAX).is_none());
    // The mechanism has moved: the crank fell by more than a radian.
    assert!((flat.last().q[0] - angles[0]).abs() > 1.0);
}

/// Declares a bead on the unit circle, x = cos θ and y = sin θ, with a flywheel.
macro_rules! circle {
    ($name:ident, $($constraint:ident = $row:expr),+) => {
        #[dynamics(
            coordinates(x, y, th),
            lagrangian = (dot(x)^2 + dot(y)^2)/2 + j/2*dot(th)^2 - g*y,
            $(constraint($constraint) = $row),+
        )]
        pub struct $name {
            pub j: f64,
            pub g: f64,
        }
    };
}

circle!(TwoRows, cx = x - cos(th), cy = y - sin(th));
circle!(
    ThreeRows,
    cx = x - cos(th),
    cy = y - sin(th),
    c = x ^ 2 + y ^ 2 - 1
);
circle!(
    Doubled,
    cx = x - cos(th),
    c = x ^ 2 + y ^ 2 - 1,
    again = x ^ 2 + y ^ 2 - 1 + x - cos(th),
    cy = y - sin(th),
    more = y - sin(th) + x - cos(th)
);
/// The same with three rows, each a sum of the three conditions with any factors.
#[dynamics(
    coordinates(x, y, th),
    lagrangian = (dot(x)^2 + dot(y)^2)/2 + j/2*dot(th)^2 - g*y,
    constraint(held[i in 0..3]) = c[i]*(x^2 + y^2 - 1) + cx[i]*(x - cos(th)) + cy[i]*(y - sin(th)),
)]
struct Combined {
    j: f64,
    g: f64,
    c: [f64; 3],
    cx: [f64; 3],
    cy: [f64; 3],
}

impl Combined {
    /// The rows of the matrix are those of the model, its columns the circle, x and y.
    fn of([one, two, three]: [[f64; 3]; 3]) -> Self {
        let column = |k: usize| [one[k], two[k], three[k]];
        Self {
            j: 0.1,
            g: 9.81,
            c: column(0),
            cx: column(1),
            cy: column(2),
        }
    }
}

/// The angle at t = 10.
#[track_caller]
fn last_angle<M: Model<3>>(model: &M, element: Element, h: f64) -> f64 {
    let start = State {
        q: [0.0, 1.0, std::f64::consts::FRAC_PI_2],
        p: [-1.0, 0.0, 0.1],
    };
    run(model, element, h, start, 10.0).last().q[2]
}

/// The choice of the rows used makes no difference. The rank is two in all positions, but every two of the three rows
/// are dependent somewhere, two of the pairs within the motion. Formerly, with the row of the circle first, six nodes
/// and h = 0.05 had an error of 2e-4, three nodes and h = 0.0037 one of 4e-2.
#[track_caller]
fn a_third_row_is_as_good_as_two(nodes: RangeInclusive<usize>) {
    let pendulum = Pendulum {
        inertia: 1.0 + 0.1,
        weight: 9.81,
    };
    let start = pendulum.state([std::f64::consts::FRAC_PI_2], [1.0]);
    let fine = Simulation::new(&pendulum).element(Mixed::<8>).step(0.002);
    let exact = fine.run(start, 0.0..10.0).expect("a run").last().q[0];
    let (j, g) = (0.1, 9.81);
    let (two_rows, three_rows, doubled) = (TwoRows { j, g }, ThreeRows { j, g }, Doubled { j, g });
    let first = Combined::of([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
    let scaled = Combined::of([[1e6, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1e-6]]);
    let summed = Combined::of([[0.0, 1.0, 1.0], [0.0, 0.0, 1.0], [1.0, 1.0, 0.0]]);
    for nodes in nodes {
        // Step sizes at which the error is asymptotic.
        let steps = [0.1, 0.07, 0.05, 0.03, 0.02, 0.01, 0.0037];
        // With shorter ones and many nodes, errors are rounding errors, whatever rows are used.
        let count = if nodes < 6 { 7 } else { 6 };
        for h in steps.into_iter().take(count).skip(usize::from(nodes < 4)) {
            let element = Element::mixed(nodes);
            let two = (last_angle(&two_rows, element, h) - exact).abs();
            let three = last_angle(&three_rows, element, h);
            assert!(
                (three - exact).abs() < 2.0 * two + 1e-12,
                "{element}, h = {h}: {three} for {exact}, {two:.1e}"
            );
            for (rows, other) in [
                ("circle first", last_angle(&first, element, h)),
                ("scaled", last_angle(&scaled, element, h)),
                ("doubled", last_angle(&doubled, element, h)),
                ("summed", last_angle(&summed, element, h)),
            ] {
                // The rounding errors of 10⁴ iterations.
                let difference = (other - three).abs();
                assert!(
                    difference < 1e-12,
                    "{rows}, {element}, h = {h}: {difference:.1e} beside {two:.1e}"
                );
            }
        }
    }
}

// Parts of one test, so that they run in parallel.
#[test]
fn a_third_row_is_as_good_as_two_with_few_nodes() {
    a_third_row_is_as_good_as_two(3..=5);
}

#[test]
fn a_third_row_is_as_good_as_two_with_some_nodes() {
    a_third_row_is_as_good_as_two(6..=7);
}

#[test]
fn a_third_row_is_as_good_as_two_with_many_nodes() {
    a_third_row_is_as_good_as_two(8..=8);
}
