//! Mechanisms that move although they have as many constraints as coordinates, or more.

use crate::common::{distance, larger};
use crate::runs::run;
use tfe::prelude::*;
use tfe::runtime::length::{Declared, FixedLength};

/// A door on three hinges: each fixes a point, the lowest one the direction as well. 12 equations of rank 6.
#[dynamics(
    coordinates(r[3], e[4]),
    let w = body_rate(e),
    let edge = rotate(e, [-b, 0, 0]),
    let up = rotate(e, [0, 0, 1]),
    lagrangian = m/2*inner(dot(r), dot(r)) + (0.3*w[0]^2 + 0.5*w[1]^2 + 0.8*w[2]^2)/2 - g*m*(r[0]*slope + r[2]),
    constraint(unit) = inner(e, e) - 1,
    constraint(lower) = r + edge - up + [0, 0, 1],
    constraint(middle) = r + edge,
    constraint(upper) = r + edge + up - [0, 0, 1],
    constraint(upright_x) = up[0],
    constraint(upright_y) = up[1],
)]
struct Door {
    m: f64,
    b: f64,
    g: f64,
    slope: f64,
}

/// A plate on parallel bars of length one.
#[dynamics(
    coordinates(x, y, th),
    let x2 = x + l*cos(th), let y2 = y + l*sin(th),
    let x3 = x + 2*l*cos(th), let y3 = y + 2*l*sin(th),
    lagrangian = m/2*(dot(x)^2 + dot(y)^2) + j/2*dot(th)^2 - m*g*y,
    constraint(one) = x^2 + y^2 - 1,
    constraint(two) = (x2 - l)^2 + y2^2 - 1,
    constraint(three) = (x3 - 2*l)^2 + y3^2 - 1,
)]
pub struct Plate {
    m: f64,
    j: f64,
    l: f64,
    g: f64,
}

/// The same with rows in any order and of any size, and the distances of the bars from the first one.
#[dynamics(
    coordinates(x, y, th),
    lagrangian = m/2*(dot(x)^2 + dot(y)^2) + j/2*dot(th)^2 - m*g*y,
    constraint(bar[i in 0..3]) = size[i]*((x + at[i]*cos(th) - at[i])^2 + (y + at[i]*sin(th))^2 - 1),
)]
struct PlateByRows {
    m: f64,
    j: f64,
    g: f64,
    at: [f64; 3],
    size: [f64; 3],
}

/// Bricard's orthogonal linkage, a closed chain of six revolute joints: six tetrahedra, each hinged to the next along
/// an edge, described by the ends a, b of the hinges. The first one is fixed. 24 equations of rank 23 for 24
/// coordinates.
/// 24 coordinates, rank 23.
#[dynamics(
    coordinates(a3[3], b3[3], a4[3], b4[3], a5[3], b5[3], a6[3], b6[3]),
    let a1 = [half, 0, 0], let b1 = [-half, 0, 0],
    let a2 = [0, half, 1], let b2 = [0, -half, 1],
    lagrangian = (inner(dot(a3), dot(a3)) + inner(dot(b3), dot(b3)) + inner(dot(a4), dot(a4)) + inner(dot(b4), dot(b4))
        + inner(dot(a5), dot(a5)) + inner(dot(b5), dot(b5)) + inner(dot(a6), dot(a6)) + inner(dot(b6), dot(b6)))/2
        - g*(a3[2] + b3[2] + a4[2] + b4[2] + a5[2] + b5[2] + a6[2] + b6[2]),
    let d = 1 + 2*half^2,
    constraint(hinge3) = inner(a3 - b3, a3 - b3) - 4*half^2, constraint(hinge4) = inner(a4 - b4, a4 - b4) - 4*half^2,
    constraint(hinge5) = inner(a5 - b5, a5 - b5) - 4*half^2, constraint(hinge6) = inner(a6 - b6, a6 - b6) - 4*half^2,
    constraint(aa23) = inner(a2 - a3, a2 - a3) - d, constraint(ab23) = inner(a2 - b3, a2 - b3) - d,
    constraint(ba23) = inner(b2 - a3, b2 - a3) - d, constraint(bb23) = inner(b2 - b3, b2 - b3) - d,
    constraint(aa34) = inner(a3 - a4, a3 - a4) - d, constraint(ab34) = inner(a3 - b4, a3 - b4) - d,
    constraint(ba34) = inner(b3 - a4, b3 - a4) - d, constraint(bb34) = inner(b3 - b4, b3 - b4) - d,
    constraint(aa45) = inner(a4 - a5, a4 - a5) - d, constraint(ab45) = inner(a4 - b5, a4 - b5) - d,
    constraint(ba45) = inner(b4 - a5, b4 - a5) - d, constraint(bb45) = inner(b4 - b5, b4 - b5) - d,
    constraint(aa56) = inner(a5 - a6, a5 - a6) - d, constraint(ab56) = inner(a5 - b6, a5 - b6) - d,
    constraint(ba56) = inner(b5 - a6, b5 - a6) - d, constraint(bb56) = inner(b5 - b6, b5 - b6) - d,
    constraint(aa61) = inner(a6 - a1, a6 - a1) - d, constraint(ab61) = inner(a6 - b1, a6 - b1) - d,
    constraint(ba61) = inner(b6 - a1, b6 - a1) - d, constraint(bb61) = inner(b6 - b1, b6 - b1) - d,
)]
struct Bricard {
    half: f64,
    g: f64,
}

type Vector = [f64; 3];

fn inner(a: Vector, b: Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn minus(a: Vector, b: Vector) -> Vector {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

impl Bricard {
    /// The position with threefold symmetry in which the odd hinges are at the distance `radius` from the axis. Hinges
    /// lie in planes through the axis, the centres of odd and even ones at ±z. Neighbours are perpendicular, and their
    /// common normals have length one: r₁ r₂ = 2/3, 4 z² = 5/3 − r₁² − r₂².
    fn at(&self, radius: f64) -> [f64; 24] {
        let (r1, r2) = (radius, 2.0 / (3.0 * radius));
        let z = 0.5 * (5.0 / 3.0 - r1 * r1 - r2 * r2).sqrt();
        let slopes = [
            ((0.5 * r2 - r1) / (2.0 * z)).atan(),
            ((r2 - 0.5 * r1) / (2.0 * z)).atan(),
        ];
        let hinge = |i: usize| {
            let (sin, cos) = (std::f64::consts::FRAC_PI_3 * i as f64).sin_cos();
            let (r, z) = if i.is_multiple_of(2) {
                (r1, z)
            } else {
                (r2, -z)
            };
            let (up, out) = slopes[i % 2].sin_cos();
            ([r * cos, r * sin, z], [out * cos, out * sin, up])
        };
        let ((origin, x), (second, y)) = (hinge(0), hinge(1));
        let axes = [x, y, minus(second, origin)];
        let mut q = [0.0; 24];
        for i in 2..6 {
            let (centre, along) = hinge(i);
            for (end, half) in [self.half, -self.half].into_iter().enumerate() {
                let mut place = minus(centre, origin);
                for (entry, direction) in place.iter_mut().zip(along) {
                    *entry += half * direction;
                }
                for (k, axis) in axes.iter().enumerate() {
                    q[6 * (i - 2) + 3 * end + k] = inner(place, *axis);
                }
            }
        }
        q
    }

    /// Moving through that position.
    fn through(&self, radius: f64, rate: f64) -> State<24> {
        const SMALL: f64 = 1e-5;
        let (after, before) = (self.at(radius + SMALL), self.at(radius - SMALL));
        let v = std::array::from_fn(|k| rate * (after[k] - before[k]) / (2.0 * SMALL));
        consistent(self, self.at(radius), v, 23)
    }
}

fn consistent<M, const N: usize>(model: &M, q: [f64; N], v: [f64; N], rank: usize) -> State<N>
where
    M: Model<N> + Declared<N, Length = FixedLength>,
{
    let start = model.consistent_state(q, v).expect("consistent");
    assert!(start.position < 1e-14, "closed: {:e}", start.position);
    assert_eq!(start.rank, rank);
    start.state
}

/// The number of steps of runs for the energy; `LONG_STEPS=10000` makes as many.
pub fn long_steps() -> u32 {
    let asked = std::env::var("LONG_STEPS").ok();
    asked.and_then(|text| text.parse().ok()).unwrap_or(200)
}

/// The largest change of the energy in one step, and since the start.
pub fn energies_off<const N: usize>(motion: &Motion<N>) -> (f64, f64) {
    let energies = motion.energies();
    let jumps = energies.windows(2).map(|pair| (pair[1] - pair[0]).abs());
    let jump = jumps.fold(0.0, larger);
    let off = |energy: &f64| (energy - energies[0]).abs();
    let drift = energies.iter().map(off).fold(0.0, larger);
    println!(
        "{} steps: jumps up to {jump:.1e}, off by {drift:.1e}",
        energies.len() - 1
    );
    (jump, drift)
}

/// Errors at the end fall with the order of the element, and energies do not drift over many steps.
fn keeps_its_order<M, const N: usize>(model: &M, start: State<N>, (h, rank): (f64, usize))
where
    M: Model<N> + Declared<N, Length = FixedLength>,
{
    let run = |nodes: usize, h: f64, steps: u32| {
        let simulation: Simulation<'_, M, N> = Simulation::new(model);
        let run = simulation.element(Element::mixed(nodes)).step(h);
        let motion = run.run(start, 0.0..f64::from(steps) * h);
        let motion = motion.unwrap_or_else(|error| panic!("{nodes} {h}: {error}"));
        assert_eq!(motion.constraint_residual().rank, rank);
        assert!(motion.constraint_residual().position < 1e-14);
        motion
    };
    // The order is ten: a thousandth of the errors that are compared, or less.
    let exact = run(6, h, 20);
    for nodes in [3, 4] {
        let off = |steps: u32| {
            let motion = run(nodes, 20.0 * h / f64::from(steps), steps);
            distance(&motion.last().q, &exact.last().q)
        };
        let (long, short) = (off(20), off(40));
        let (order, expected) = ((long / short).log2(), 2.0 * (nodes as f64 - 1.0));
        assert!(
            (order - expected).abs() < 0.1,
            "{nodes}: {long:e}, {short:e}, order {order}"
        );
    }
    let (jump, drift) = energies_off(&run(4, h, long_steps()));
    assert!(jump < 1e-8 && drift < 5e-8, "{jump:e}, {drift:e}");
}

#[test]
fn a_door_on_three_hinges() {
    let door = Door {
        m: 2.0,
        b: 0.4,
        g: 9.81,
        slope: 0.2,
    };
    let (q, v) = (
        [0.4, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0],
        [0.0, 0.6, 0.0, 0.0, 0.0, 0.0, 0.75],
    );
    keeps_its_order(&door, consistent(&door, q, v, 6), (0.1, 6));
}

#[test]
fn six_revolutes() {
    let linkage = Bricard { half: 0.4, g: 1.0 };
    keeps_its_order(&linkage, linkage.through(0.7, 0.5), (0.05, 23));
}

/// A plate that swings.
pub fn plate() -> (Plate, State<3>) {
    let plate = Plate {
        m: 1.0,
        j: 0.3,
        l: 0.7,
        g: 9.81,
    };
    let start = consistent(&plate, [0.6, -0.8, 0.0], [0.8, 0.6, 0.0], 2);
    (plate, start)
}

/// The motion does not depend on how the constraints are written.
#[test]
fn a_plate_on_three_bars() {
    let (plate, start) = plate();
    keeps_its_order(&plate, start, (0.05, 2));
    let Plate { m, j, l, g } = plate;
    let by_rows = |at: [f64; 3], size: [f64; 3]| PlateByRows { m, j, g, at, size };
    let permuted = by_rows([2.0 * l, 0.0, l], [1.0; 3]);
    let scaled = by_rows([0.0, l, 2.0 * l], [1e6, 1.0, 1e-6]);
    for nodes in [2, 3, 4, 6] {
        let element = Element::mixed(nodes);
        let expected = run(&plate, element, 0.05, start, 5.0).last().q;
        for (rows, model) in [("permuted", &permuted), ("scaled", &scaled)] {
            let other = run(model, element, 0.05, start, 5.0).last().q;
            let off = distance(&expected, &other);
            assert!(off < 1e-12, "{nodes} nodes, {rows}: {off:e}");
        }
    }
}
