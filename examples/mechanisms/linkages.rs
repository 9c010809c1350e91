//! Linkages: closed loops of rods and joints.

use crate::Outcome;
use crate::runs::{Energy, Run, Scene, distance};
use crate::stroboscope::{Part, Point, Stroboscope, seen};
use std::f64::consts::TAU;
use tfe::prelude::*;

/// A crank, a connecting rod, and a slider on a horizontal line; the angles of crank (upwards) and rod (downwards) are
/// measured from the line; SI units.
#[dynamics(
    coordinates(crank, rod, x),
    let rod_x = r*cos(crank) + l/2*cos(rod),
    let rod_y = r*sin(crank) - l/2*sin(rod),
    lagrangian = j_crank/2*dot(crank)^2 + m_rod/2*(dot(rod_x)^2 + dot(rod_y)^2) + m_rod*l^2/24*dot(rod)^2
        + m_slider/2*dot(x)^2 - m_rod*g*rod_y,
    constraint(pin_x) = r*cos(crank) + l*cos(rod) - x,
    constraint(pin_y) = r*sin(crank) - l*sin(rod),
)]
struct SliderCrank {
    r: f64,
    l: f64,
    j_crank: f64,
    m_rod: f64,
    m_slider: f64,
    g: f64,
}

/// The same mechanism with one coordinate: the loop is solved for the angle of the crank.
#[dynamics(
    coordinates(crank),
    let rod = asin(r/l*sin(crank)),
    let rod_x = r*cos(crank) + l/2*cos(rod),
    let rod_y = r*sin(crank) - l/2*sin(rod),
    let x = r*cos(crank) + l*cos(rod),
    lagrangian = j_crank/2*dot(crank)^2 + m_rod/2*(dot(rod_x)^2 + dot(rod_y)^2) + m_rod*l^2/24*dot(rod)^2
        + m_slider/2*dot(x)^2 - m_rod*g*rod_y,
)]
struct MinimalSliderCrank {
    r: f64,
    l: f64,
    j_crank: f64,
    m_rod: f64,
    m_slider: f64,
    g: f64,
}

pub fn slider_crank() -> Outcome {
    let (r, l, j_crank, m_rod, m_slider, g) = (0.3, 0.8, 0.05, 1.0, 0.5, 9.81);
    let model = SliderCrank {
        r,
        l,
        j_crank,
        m_rod,
        m_slider,
        g,
    };
    let minimal = MinimalSliderCrank {
        r,
        l,
        j_crank,
        m_rod,
        m_slider,
        g,
    };
    let (rate, end) = (8.0, 3.0);
    // At the dead centre the slider is at rest, and the rod rotates at r rate/l.
    let start = model.state([0.0, 0.0, r + l], [rate, r * rate / l, 0.0]);
    let run = Run::of(&model, Mixed::<6>, 0.01, start, end)?;
    let same = Run::of(
        &minimal,
        Mixed::<6>,
        0.01,
        minimal.state([0.0], [rate]),
        end,
    )?;
    let crank = same.motion.last().q[0];
    let rod = (r / l * crank.sin()).asin();
    let error = run.error(&[crank, rod, r * crank.cos() + l * rod.cos()]);
    let row = run.row(
        "slider–crank",
        Energy::Conserved,
        error,
        "one-coordinate model",
    );
    let shot = |q: &[f64; 3]| {
        let (pin, slider) = ((r * q[0].cos(), r * q[0].sin()), (q[2], 0.0));
        vec![
            Part::rod((0.0, 0.0), pin),
            Part::rod(pin, slider),
            Part::Mass(pin),
            Part::block(slider, 0.0, 0.12, 0.08),
        ]
    };
    let middle = |q: &[f64; 3]| {
        (
            r * q[0].cos() + l / 2.0 * q[1].cos(),
            r * q[0].sin() - l / 2.0 * q[1].sin(),
        )
    };
    let turn = run.first(|q| q[0] >= TAU).ok_or("less than a turn")?;
    let picture = Stroboscope::new("Slider–crank", "x (m)", "y (m)")
        .ground([
            Part::Line(vec![(-0.35, 0.0), (1.2, 0.0)]),
            Part::Pivot((0.0, 0.0)),
        ])
        .path(
            "middle of the rod",
            run.samples_until(turn, 240)?.iter().map(middle),
        )
        .shots(run.samples_until(turn, 16)?.iter().map(shot))
        .to_svg()?;
    let text = "Three coordinates and a loop of two equations, compared with the model in which the loop is solved by hand.";
    Ok(Scene::new("A slider–crank", text).row(row).picture(
        "slider_crank",
        picture,
        "One turn of the crank, 16 equally spaced times.",
    ))
}

/// A four-bar linkage of massless rods with point masses at its joints, pivots at (0, 0) and (d, 0); SI units.
#[dynamics(
    coordinates(x1, y1, x2, y2),
    lagrangian = m/2*(dot(x1)^2 + dot(y1)^2 + dot(x2)^2 + dot(y2)^2) - m*g*(y1 + y2),
    constraint(crank) = x1^2 + y1^2 - a^2,
    constraint(coupler) = (x2 - x1)^2 + (y2 - y1)^2 - b^2,
    constraint(rocker) = (x2 - d)^2 + y2^2 - c^2,
)]
struct FourBar {
    a: f64,
    b: f64,
    c: f64,
    d: f64,
    m: f64,
    g: f64,
}

/// The positions of the joints of a four-bar linkage for an angle of the crank, with the coupler to the left of the
/// crank.
fn assembled(model: &FourBar, angle: f64) -> [f64; 4] {
    let (x1, y1) = (model.a * angle.cos(), model.a * angle.sin());
    let (dx, dy) = (model.d - x1, -y1);
    let distance = dx.hypot(dy);
    let along = (model.b.powi(2) - model.c.powi(2) + distance.powi(2)) / (2.0 * distance);
    let aside = (model.b.powi(2) - along.powi(2)).sqrt();
    [
        x1,
        y1,
        x1 + (along * dx - aside * dy) / distance,
        y1 + (along * dy + aside * dx) / distance,
    ]
}

/// The parallelogram linkage with one coordinate.
#[dynamics(coordinates(theta), lagrangian = m*a^2*dot(theta)^2 - 2*m*g*a*sin(theta))]
struct Parallelogram {
    a: f64,
    m: f64,
    g: f64,
}

pub fn parallelogram() -> Outcome {
    let (a, d, m, g) = (0.5, 1.0, 1.0, 9.81);
    let model = FourBar {
        a,
        b: d,
        c: a,
        d,
        m,
        g,
    };
    let minimal = Parallelogram { a, m, g };
    let (angle, rate, end) = (0.3_f64, 12.0, 3.0);
    let (sin, cos) = angle.sin_cos();
    let speed = [-a * sin * rate, a * cos * rate];
    let start = model.state(
        [a * cos, a * sin, d + a * cos, a * sin],
        [speed[0], speed[1], speed[0], speed[1]],
    );
    let run = Run::of(&model, Mixed::<6>, 0.01, start, end)?;
    let same = Run::of(
        &minimal,
        Mixed::<6>,
        0.01,
        minimal.state([angle], [rate]),
        end,
    )?;
    let theta = same.motion.last().q[0];
    let (x, y) = (a * theta.cos(), a * theta.sin());
    let error = run.error(&[x, y, d + x, y]);
    let row = run.row(
        "four-bar through flat",
        Energy::Conserved,
        error,
        "one-coordinate model",
    );
    let flat = (theta / (TAU / 2.0)).floor();
    let turn = same
        .first(|q| q[0] >= TAU + angle)
        .ok_or("less than a turn")?;
    let picture = Stroboscope::new(
        "Parallelogram linkage through its flat positions",
        "x (m)",
        "y (m)",
    )
    .ground([Part::Pivot((0.0, 0.0)), Part::Pivot((d, 0.0))])
    .shots(
        run.samples_until(turn, 17)?
            .iter()
            .map(|q| bars((0.0, 0.0), (q[0], q[1]), (q[2], q[3]), (d, 0.0))),
    )
    .to_svg()?;
    let text = "With opposite bars of equal length, the linkage can be folded flat. In this position its constraints are dependent and two motions \
                branch off, the parallelogram and the crossed one. The elements step over the flat positions, since no node lies exactly in them.";
    let caption = format!(
        "One turn. In the whole run the linkage passes {flat} times through a flat position and remains a parallelogram."
    );
    Ok(
        Scene::new("A four-bar linkage through its flat position", text)
            .row(row)
            .picture("parallelogram", picture, caption),
    )
}

fn bars(start: Point, first: Point, second: Point, end: Point) -> Vec<Part> {
    vec![
        Part::Line(vec![start, first, second, end]),
        Part::Mass(first),
        Part::Mass(second),
    ]
}

/// A four-bar linkage in space. Its pivots lie at (0, 0, 0) and (d, 0, 0), with axes along n. The hinge of the coupler
/// adds a constraint that the others imply already (redundant). SI units.
#[dynamics(
    coordinates(r[3], s[3]),
    let n = [0, -sin(tilt), cos(tilt)],
    let pivot = [d, 0, 0],
    lagrangian = m/2*(inner(dot(r), dot(r)) + inner(dot(s), dot(s))) - m*g*(r[2] + s[2]),
    constraint(crank) = inner(r, r) - a^2,
    constraint(coupler) = inner(s - r, s - r) - b^2,
    constraint(rocker) = inner(s - pivot, s - pivot) - c^2,
    constraint(crank_hinge) = inner(n, r),
    constraint(rocker_hinge) = inner(n, s - pivot),
    constraint(coupler_hinge) = inner(n, s - r),
)]
struct SpatialFourBar {
    a: f64,
    b: f64,
    c: f64,
    d: f64,
    m: f64,
    g: f64,
    tilt: f64,
}

pub fn spatial_four_bar() -> Outcome {
    let (a, b, c, d, m, g, tilt) = (0.25, 0.75, 0.625, 0.875, 1.0, 9.81, 0.7_f64);
    let model = SpatialFourBar {
        a,
        b,
        c,
        d,
        m,
        g,
        tilt,
    };
    // The same linkage in its plane, with the component of gravity along the plane and without the redundant
    // constraint.
    let plane = FourBar {
        a,
        b,
        c,
        d,
        m,
        g: g * tilt.sin(),
    };
    let (angle, rate, end) = (1.0, 14.0, 2.0);
    let q = assembled(&plane, angle);
    let v = velocity(&plane, &q, rate);
    let in_space = |x: f64, y: f64| [x, y * tilt.cos(), y * tilt.sin()];
    let both = |q: &[f64; 4]| {
        let ([x1, y1, z1], [x2, y2, z2]) = (in_space(q[0], q[1]), in_space(q[2], q[3]));
        [x1, y1, z1, x2, y2, z2]
    };
    let start = model.consistent_state(both(&q), both(&v))?;
    let run = Run::of(&model, Mixed::<6>, 0.01, start.state, end)?;
    let same = Run::of(&plane, Mixed::<6>, 0.01, plane.state(q, v), end)?;
    let error = distance(&run.motion.last().q, &both(&same.motion.last().q));
    let row = run.row(
        "spatial four-bar",
        Energy::Conserved,
        error,
        "planar linkage",
    );
    let rank = run.motion.constraint_residual().rank;
    assert_eq!(rank, 5, "six coordinates with one degree of freedom");
    let joint = |q: &[f64; 6]| (seen([q[0], q[1], q[2]]), seen([q[3], q[4], q[5]]));
    let (start, end) = (seen([0.0; 3]), seen([d, 0.0, 0.0]));
    let samples = run.samples(81)?;
    let picture = Stroboscope::new("Spatial four-bar linkage", "across (m)", "up (m)")
        .ground([Part::Pivot(start), Part::Pivot(end)])
        .path(
            "joint of crank and coupler",
            run.samples(600)?.iter().map(|q| joint(q).0),
        )
        .path(
            "joint of coupler and rocker",
            run.samples(600)?.iter().map(|q| joint(q).1),
        )
        .shots(
            samples[..20]
                .iter()
                .map(|q| bars(start, joint(q).0, joint(q).1, end)),
        )
        .to_svg()?;
    let text = format!(
        "Six coordinates, six constraints, of which {rank} are independent, so that one degree of freedom remains. The redundant row is \
         found at the start of each element; among all possible reactions those of least norm are chosen."
    );
    Ok(
        Scene::new("A four-bar linkage in space, with a redundant hinge", &text)
            .row(row)
            .picture(
                "spatial_four_bar",
                picture,
                "A crank–rocker linkage in a tilted plane, seen from the right, the front and above.",
            ),
    )
}

/// The velocities of the joints for an angular velocity of the crank.
fn velocity(model: &FourBar, q: &[f64; 4], rate: f64) -> [f64; 4] {
    let [x1, y1, x2, y2] = *q;
    let (v1, w1) = (-rate * y1, rate * x1);
    // The second joint rotates about the right pivot, and its velocity along the coupler equals that of the first
    // joint.
    let (ex, ey) = (x2 - x1, y2 - y1);
    let turning = (ex * v1 + ey * w1) / (-ex * y2 + ey * (x2 - model.d));
    [v1, w1, -turning * y2, turning * (x2 - model.d)]
}
