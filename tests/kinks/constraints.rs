//! Constraints with kinks: steps end there as at kinks of forces, momenta jump where a gradient or a prescribed velocity
//! does, and a jump of a constrained position is an error.

use crate::apart;
use crate::differences::difference_over;
use crate::largest::larger;
use tfe::prelude::*;
use tfe::runtime::{ConstraintError, StepError};
use tfe::sensitivity::Loss;
use tfe::{RunError, RunErrorKind};

/// A bead on a wire that is level for x < 0 and has slope r for x > 0.
#[dynamics(
    coordinates(x, y),
    lagrangian = m/2*(dot(x)^2 + dot(y)^2) - m*g*y,
    constraint(wire) = y - r*max(x, 0),
    output(place) = x,
)]
#[derive(Clone)]
struct Ramp {
    m: f64,
    g: f64,
    r: f64,
}

/// x at the time t > −x₀/v₀, and its derivatives by x₀ and r: at the bend the velocity loses its part across the wire.
fn on_ramp(ramp: &Ramp, (x0, v0): (f64, f64), t: f64) -> [f64; 3] {
    let (g, r) = (ramp.g, ramp.r);
    let tau = t + x0 / v0;
    let square = 1.0 + r * r;
    // The velocity along the wire is v₀/√(1 + r²), its deceleration g r/√(1 + r²).
    let x = (v0 * tau - g * r * tau * tau / 2.0) / square;
    let by_start = (1.0 - g * r * tau / v0) / square;
    let by_slope = -g * tau * tau / 2.0 / square - 2.0 * r * x / square;
    [x, by_start, by_slope]
}

const ELEMENTS: [Element; 5] = [
    Element::mixed(3),
    Element::mixed(4),
    Element::mixed(7),
    Element::primal(4),
    Element::three_field(4),
];

#[test]
fn beads_lose_the_velocity_across_a_bend_of_their_wire() {
    for (r, mass) in [(0.4, 1.0), (-0.7, 1.0), (2.0, 1e-6), (1e-3, 1e6)] {
        let ramp = Ramp {
            m: mass,
            g: 9.81,
            r,
        };
        for element in ELEMENTS {
            for step in [0.3, 0.11, 0.01] {
                let run = Simulation::new(&ramp)
                    .element(element)
                    .step(step)
                    .at_kinks(true);
                let (start, t) = ((-0.5, 2.0), 0.33);
                let motion = run.run(ramp.state([start.0, 0.0], [start.1, 0.0]), 0.0..t);
                let motion = motion.unwrap_or_else(|error| panic!("{element} {step}: {error}"));
                assert_eq!(motion.statistics().kinks, 1, "{element} {step}");
                let [exact, ..] = on_ramp(&ramp, start, t);
                let off = apart(&motion.last().q, &[exact, r * exact]);
                // The motion behind a bend begins some roundings of the time late.
                assert!(off <= 1e-14, "{r} {element} {step}: {off:.1e}");
            }
        }
    }
}

#[test]
fn derivatives_across_a_bend_are_those_of_the_closed_form() {
    let ramp = Ramp {
        m: 1.3,
        g: 9.81,
        r: 0.4,
    };
    let ((x0, v0), t) = ((-0.5, 2.0), 0.33);
    let [_, by_start, by_slope] = on_ramp(&ramp, (x0, v0), t);
    for element in ELEMENTS {
        let run = Simulation::new(&ramp).element(element).step(0.1);
        let start = ramp.state([x0, 0.0], [v0, 0.0]);
        let sensitive = run.run_sensitive(start, 0.0..t).expect("derivatives");
        let loss = Loss::output_at_end("place");
        let (_, gradient) = run.gradient(start, 0.0..t, &loss).expect("a gradient");
        for (found, exact) in [
            (sensitive.by("r").last().q[0], by_slope),
            (sensitive.by_start().last()[(2, 2)], by_start),
            (gradient.by("r"), by_slope),
            (gradient.by_start().q[0], by_start),
        ] {
            let off = (found - exact).abs();
            assert!(off <= 1e-12, "{element}: {found} {exact}");
        }
    }
}

/// A bead on a wire whose curvature jumps at x = 0, and the same with x alone.
#[dynamics(
    coordinates(x, y),
    lagrangian = (dot(x)^2 + dot(y)^2)/2 - g*y,
    constraint(wire) = y - max(x, 0)^2 - x^2/4,
)]
struct Wire {
    g: f64,
}

#[dynamics(
    coordinates(x),
    lagrangian = (1 + (2*max(x, 0) + x/2)^2)*dot(x)^2/2 - g*(max(x, 0)^2 + x^2/4),
)]
struct AlongWire {
    g: f64,
}

#[test]
fn elements_keep_their_order_where_curvatures_jump() {
    let (wire, along) = (Wire { g: 9.81 }, AlongWire { g: 9.81 });
    let fine = Simulation::new(&along)
        .element(Mixed::<9>)
        .step(0.01)
        .at_kinks(true);
    let fine = fine.run(along.state([-0.7], [0.0]), 0.0..2.0);
    let exact = fine.expect("a motion along the wire").last().q[0];
    let start = wire.state([-0.7, 0.49 / 4.0], [0.0, 0.0]);
    let of = |element: Element, step: f64, are_cut: bool| {
        let run = Simulation::new(&wire).element(element).step(step);
        let motion = run.at_kinks(are_cut).run(start, 0.0..2.0);
        let motion = motion.unwrap_or_else(|error| panic!("{element} {step}: {error}"));
        assert_eq!(motion.statistics().kinks, if are_cut { 2 } else { 0 });
        (motion.last().q[0] - exact).abs()
    };
    for element in [
        Element::mixed(4),
        Element::primal(4),
        Element::three_field(4),
    ] {
        let errors = [0.05, 0.025, 0.0125].map(|step| of(element, step, true));
        let order = (errors[0] / errors[2]).log2() / 2.0;
        assert!(order >= 5.4, "{element}: {order:.2} {errors:?}");
        let across = of(element, 0.0125, false);
        assert!(across >= 100.0 * errors[2], "{element}: {across:.1e}");
    }
    let met = Simulation::new(&wire).accuracy(1e-9).run(start, 0.0..2.0);
    let off = (met.expect("an accuracy that is met").last().q[0] - exact).abs();
    assert!(off <= 1e-9, "{off:.1e}");
}

/// A pendulum below a carriage whose velocity is prescribed: u from the time s on.
#[dynamics(
    coordinates(x, a),
    let px = x + l*sin(a),
    let py = -l*cos(a),
    lagrangian = (dot(px)^2 + dot(py)^2)/2 - g*py,
    constraint(drive) = dot(x) - select(t < s, 0, u),
)]
struct Started {
    l: f64,
    g: f64,
    s: f64,
    u: f64,
}

/// The same by its position.
#[dynamics(
    coordinates(x, a),
    let px = x + l*sin(a),
    let py = -l*cos(a),
    lagrangian = (dot(px)^2 + dot(py)^2)/2 - g*py,
    constraint(drive) = x - u*max(t - s, 0),
)]
struct Placed {
    l: f64,
    g: f64,
    s: f64,
    u: f64,
}

/// The angle alone. An impulse u cos(a) l against the motion of the carriage changes its momentum.
#[dynamics(coordinates(a), lagrangian = l^2*dot(a)^2/2 + g*l*cos(a))]
struct Hanging {
    l: f64,
    g: f64,
}

#[test]
fn carriages_that_start_at_once_move_pendulums_as_impulses_do() {
    let (l, g, s, u) = (1.0, 9.81, 0.53, 1.5);
    let hanging = Hanging { l, g };
    let first = Simulation::new(&hanging)
        .element(Mixed::<8>)
        .step(0.01)
        .run(hanging.state([0.3], [0.0]), 0.0..s);
    let mut node = first.expect("the motion before the start").last().state();
    // The bob keeps its velocity: relative to the carriage it loses u cos(a) along its path.
    node.p[0] -= l * u * node.q[0].cos();
    let second = Simulation::new(&hanging)
        .element(Mixed::<8>)
        .step(0.01)
        .run(node, s..2.0);
    let exact = [
        u * (2.0 - s),
        second.expect("the motion behind it").last().q[0],
    ];
    let (started, placed) = (Started { l, g, s, u }, Placed { l, g, s, u });
    for step in [0.1, 0.053, 0.02] {
        for nodes in [6, 8] {
            let element = Element::mixed(nodes);
            let ends = [
                Simulation::new(&started)
                    .element(element)
                    .step(step)
                    .at_kinks(true)
                    .run(started.state([0.0, 0.3], [0.0, 0.0]), 0.0..2.0),
                Simulation::new(&placed)
                    .element(element)
                    .step(step)
                    .at_kinks(true)
                    .run(placed.state([0.0, 0.3], [0.0, 0.0]), 0.0..2.0),
            ];
            for end in ends {
                let motion = end.unwrap_or_else(|error| panic!("{element} {step}: {error}"));
                let off = apart(&motion.last().q, &exact);
                // Elements of six nodes in steps of 0.1 have errors of 5e-13.
                assert!(off <= 2e-12, "{element} {step}: {off:.1e}");
            }
        }
    }
    let start = started.state([0.0, 0.3], [0.0, 0.0]);
    let met = Simulation::new(&started)
        .accuracy(1e-9)
        .run(start, 0.0..2.0);
    let off = apart(&met.expect("an accuracy that is met").last().q, &exact);
    assert!(off <= 1e-9, "{off:.1e}");
}

/// A carriage whose position jumps by d.
#[dynamics(
    coordinates(x, y),
    lagrangian = (dot(x)^2 + dot(y)^2)/2 - g*y,
    constraint(drive) = x - select(t < s, 0, d),
)]
struct Leap {
    g: f64,
    s: f64,
    d: f64,
}

/// A wire with a step of height d.
#[dynamics(
    coordinates(x, y),
    lagrangian = (dot(x)^2 + dot(y)^2)/2 - g*y,
    constraint(wire) = y - select(x < 1, 0, d),
)]
struct Stair {
    g: f64,
    d: f64,
}

fn leaps<const N: usize>(outcome: Result<(), RunError<N>>, d: f64, name: &str) {
    let error = outcome.expect_err("no motion can jump");
    match error.kind() {
        RunErrorKind::Solve {
            source: StepError::Constraint(ConstraintError::Discontinuous { distance, .. }),
            ..
        } => assert!((distance - d).abs() <= 1e-9, "{name}: {distance} {d}"),
        other => panic!("{name} {d}: {other:?}"),
    }
}

#[test]
fn a_jump_of_a_constrained_position_is_an_error() {
    for d in [1.0, 1e-2, 1e-4, 1e-6] {
        let leap = Leap {
            g: 9.81,
            s: 0.53,
            d,
        };
        let start = leap.state([0.0, 2.0], [0.0, 0.0]);
        let run = Simulation::new(&leap).element(Mixed::<4>).step(0.1);
        let at_break = run.clone().break_at(0.53).run(start, 0.0..1.0);
        leaps(at_break.map(drop), d, "break");
        leaps(run.at_kinks(true).run(start, 0.0..1.0).map(drop), d, "kink");
        let stair = Stair { g: 9.81, d };
        let start = stair.state([0.0, 0.0], [2.3, 0.0]);
        let run = Simulation::new(&stair).element(Mixed::<4>).step(0.1);
        leaps(
            run.at_kinks(true).run(start, 0.0..1.0).map(drop),
            d,
            "stair",
        );
    }
}

/// A wire with a corner at its lowest point, where a bead without rebound stays.
#[dynamics(
    coordinates(x, y),
    lagrangian = (dot(x)^2 + dot(y)^2)/2 - g*y,
    constraint(wire) = y - abs(x),
)]
struct Corner {
    g: f64,
}

#[test]
fn a_bead_that_stays_at_a_corner_is_told() {
    let corner = Corner { g: 9.81 };
    let start = corner.state([-0.7, 0.7], [0.0, 0.0]);
    let run = Simulation::new(&corner).element(Mixed::<4>).step(0.01);
    let error = run
        .at_kinks(true)
        .run(start, 0.0..2.0)
        .expect_err("it stays");
    let slides = StepError::Slides;
    assert!(
        matches!(error.kind(), RunErrorKind::Solve { source, .. } if *source == slides),
        "{error}"
    );
    // It arrives after √(2·0.7·√2 / (g/√2)).
    let arrives = (4.0 * 0.7 / 9.81_f64).sqrt();
    let last = error.partial().last();
    let ahead = arrives - last.t;
    assert!((0.0..=0.01).contains(&ahead), "{ahead}");
    let worst = larger(0.0, (last.q[0] + 0.7 - 9.81 * last.t * last.t / 4.0).abs());
    assert!(worst <= 1e-13, "{worst:.1e}");
}

/// A disk that is driven from rest, and a second one that a brake holds until a clutch joins it to the first.
#[dynamics(
    coordinates(a, b),
    lagrangian = ja/2*dot(a)^2 + jb/2*dot(b)^2,
    force(a) = m,
    constraint(clutch) = select(t < s, dot(b), dot(a) - dot(b)),
)]
struct Clutch {
    ja: f64,
    jb: f64,
    m: f64,
    s: f64,
}

#[test]
fn a_clutch_joins_disks_in_a_moment() {
    let clutch = Clutch {
        ja: 1.0,
        jb: 2.0,
        m: 1.5,
        s: 0.5,
    };
    let Clutch { ja, jb, m, s } = clutch;
    let (until, start) = (1.2, clutch.state([0.0, 0.0], [0.0, 0.0]));
    let (both, tau) = (ja + jb, until - s);
    let speed = m * s / both;
    let angle = speed * tau + m / both * tau * tau / 2.0;
    let exact = [m / ja * s * s / 2.0 + angle, angle];
    for element in [3, 4, 7].map(Element::mixed) {
        for step in [0.1, 0.07, 0.03] {
            let run = Simulation::new(&clutch).element(element).step(step);
            let cut = run.clone().at_kinks(true).run(start, 0.0..until);
            let at_break = run.break_at(s).run(start, 0.0..until);
            for motion in [cut, at_break] {
                let motion = motion.unwrap_or_else(|error| panic!("{element} {step}: {error}"));
                let off = apart(&motion.last().q, &exact);
                // As above.
                assert!(off <= 1e-14, "{element} {step}: {off:.1e}");
            }
        }
    }
}

/// A flywheel that lifts a follower by a cam, against a spring, and the same with the angle alone.
#[dynamics(
    coordinates(phi, s),
    lagrangian = j/2*dot(phi)^2 + m/2*dot(s)^2 - k/2*(s + d)^2,
    constraint(cam) = s - e*max(sin(phi), 0)^2,
    force(phi) = 0.3,
)]
#[derive(Clone)]
struct Cam {
    j: f64,
    m: f64,
    k: f64,
    d: f64,
    e: f64,
}

#[dynamics(
    coordinates(phi),
    let s = e*max(sin(phi), 0)^2,
    lagrangian = j/2*dot(phi)^2 + m/2*dot(s)^2 - k/2*(s + d)^2,
    force(phi) = 0.3,
)]
struct CamAngle {
    j: f64,
    m: f64,
    k: f64,
    d: f64,
    e: f64,
}

#[test]
fn cams_move_as_their_angles() {
    let (j, m, k, d, e) = (0.1, 0.2, 50.0, 0.02, 0.05);
    let cam = Cam { j, m, k, d, e };
    let angle = CamAngle { j, m, k, d, e };
    let exact = Simulation::new(&angle)
        .element(Mixed::<8>)
        .step(0.01)
        .at_kinks(true)
        .run(angle.state([-0.3], [8.0]), 0.0..3.0)
        .expect("the motion of the angle");
    let run = |cam: &Cam| {
        let start = cam.state([-0.3, 0.0], [8.0, 0.0]);
        let run = Simulation::new(cam).element(Mixed::<8>).step(0.01);
        run.at_kinks(true).run(start, 0.0..3.0).expect("a motion")
    };
    let motion = run(&cam);
    assert_eq!(motion.statistics().kinks, 12);
    let off = (motion.last().q[0] - exact.last().q[0]).abs();
    assert!(off <= 1e-12 * exact.last().q[0].abs(), "{off:.1e}");
    let start = cam.state([-0.3, 0.0], [8.0, 0.0]);
    let simulation = Simulation::new(&cam).element(Mixed::<8>).step(0.01);
    let sensitive = simulation
        .run_sensitive(start, 0.0..3.0)
        .expect("derivatives");
    let at = |k: f64| [run(&Cam { k, ..cam.clone() }).last().q[0]];
    let [by_k] = difference_over(0.5, at, k);
    let off = (sensitive.by("k").last().q[0] - by_k).abs();
    assert!(off <= 1e-10, "{off:.1e}");
}
