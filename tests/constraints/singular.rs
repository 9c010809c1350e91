//! Singular positions, in which constraints lose rank but which the motion passes smoothly, at nodes and close to them;
//! and a linkage whose constraints are redundant throughout.

use crate::linkages::{LINKAGE, ONE_ANGLE, error, parallel};
use crate::models::Pendulum;
use crate::overconstrained::{energies_off, long_steps};
use crate::spatial_four_bar::SpatialFourBar;
use tfe::prelude::*;

/// Differences in time between a node and a singular position.
const BESIDE: [f64; 12] = [
    0.0, 1e-13, 1e-12, 1e-11, 1e-10, 1e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3,
];

/// The time at which a coordinate of a run passes zero.
fn root(motion: &Motion<1>) -> f64 {
    let of = |t: f64| motion.at(t).expect("within").q[0];
    let (mut early, mut late) = (0.0, motion.last().t);
    assert!(of(early) * of(late) < 0.0);
    for _ in 0..60 {
        let middle = 0.5 * (early + late);
        if of(early) * of(middle) > 0.0 {
            early = middle;
        } else {
            late = middle;
        }
    }
    0.5 * (early + late)
}

/// Steps such that node `node` lies close to a given time.
fn steps(when: f64, node: f64) -> impl Iterator<Item = f64> {
    let after = BESIDE.into_iter();
    let before = after.clone().skip(1).map(|beside| -beside);
    after
        .chain(before)
        .map(move |beside| (when + beside) / node)
}

/// Rows that vanish: a parallelogram in angles.
#[test]
fn nodes_in_the_flat_position() {
    let (angle, rate) = (0.6, -14.0);
    let run = Simulation::new(&ONE_ANGLE).element(Mixed::<10>).step(0.001);
    let start = ONE_ANGLE.state([angle], [rate]);
    let when = root(&run.run(start, 0.0..0.1).expect("a pendulum"));
    for (nodes, most) in [(3, 7e-10), (4, 1e-13), (6, 1e-13)] {
        for step in steps(when, 10.0) {
            let what = format!("{nodes} nodes, h = {step:e}");
            let run = Simulation::new(&LINKAGE).element(Element::mixed(nodes));
            let motion = run
                .step(step)
                .run(parallel(angle, rate), 0.0..20.0 * step)
                .unwrap_or_else(|error| panic!("{what}: {error}"));
            let off = error(&motion, step, angle, rate);
            assert!(off < most, "{what}: {off:e}");
            assert!(motion.statistics().cuts <= 1, "{what}");
        }
    }
}

/// A chain of two four-bar linkages with equal bars, in natural coordinates (a benchmark for singular positions).
#[dynamics(
    coordinates(x[3], y[3]),
    lagrangian = sum(i in 0..3, dot(x[i])^2 + dot(y[i])^2)/6
        + sum(i in 0..2, dot(x[i])^2 + dot(x[i])*dot(x[i+1]) + dot(x[i+1])^2 + dot(y[i])^2 + dot(y[i])*dot(y[i+1]) + dot(y[i+1])^2)/6
        - g*(y[0] + y[1] + y[2])/2 - g*(y[0] + 2*y[1] + y[2])/2,
    constraint(rod0) = x[0]^2 + y[0]^2 - 1,
    constraint(rod1) = (x[1] - 1)^2 + y[1]^2 - 1,
    constraint(rod2) = (x[2] - 2)^2 + y[2]^2 - 1,
    constraint(bar0) = (x[1] - x[0])^2 + (y[1] - y[0])^2 - 1,
    constraint(bar1) = (x[2] - x[1])^2 + (y[2] - y[1])^2 - 1,
)]
struct Windows {
    g: f64,
}

/// Rows that become parallel.
#[test]
fn nodes_where_all_bars_are_in_line() {
    let chain = Windows { g: 9.81 };
    // The motion as long as the bars stay parallel.
    let one = Pendulum {
        inertia: 3.0,
        weight: 3.5 * chain.g,
    };
    let (angle, rate) = (0.5 * std::f64::consts::PI, -1.0);
    let exact = Simulation::new(&one)
        .element(Mixed::<10>)
        .step(0.002)
        .run(one.state([angle], [rate]), 0.0..1.5)
        .expect("a pendulum");
    let when = root(&exact);
    // Twelve steps before the position and fifty behind it.
    let begin = (exact.states().iter()).rfind(|node| node.t < 0.76 * when);
    let &Node {
        t: begin,
        q: [angle],
        v: [rate],
        ..
    } = begin.expect("a node of the pendulum");
    let (c, s) = (angle.cos(), angle.sin());
    let (x, y) = (-s * rate, c * rate);
    let start = chain.state([c, 1.0 + c, 2.0 + c, s, s, s], [x, x, x, y, y, y]);
    // The order is 2(n − 1), as at other nodes.
    for (nodes, most) in [(3, 2e-6), (4, 3e-10), (6, 2e-12)] {
        for step in steps(when - begin, 12.0) {
            let what = format!("{nodes} nodes, h = {step:e}");
            let run = Simulation::new(&chain).element(Element::mixed(nodes));
            let motion = run
                .step(step)
                .run(start, begin..begin + 62.0 * step)
                .unwrap_or_else(|error| panic!("{what}: {error}"));
            for node in motion.states() {
                let angle = exact.at(node.t).expect("within").q[0];
                let off = (node.q[0] - angle.cos()).hypot(node.q[5] - angle.sin());
                assert!(off < most, "{what}, t = {}: {off:e}", node.t);
            }
            assert!(motion.statistics().cuts <= 2, "{what}");
            // Between the nodes, too.
            let between = motion.at(when + 0.3 * step).expect("within");
            let angle = exact.at(when + 0.3 * step).expect("within").q[0];
            let off = (between.q[0] - angle.cos()).hypot(between.q[5] - angle.sin());
            assert!(off < 100.0 * most, "{what}: {off:e}");
        }
    }
}

/// A node that was stepped over does not prevent continuing from a checkpoint.
#[test]
fn checkpoints_at_singular_nodes() {
    let (angle, rate) = (0.6, -14.0);
    let run = Simulation::new(&ONE_ANGLE).element(Mixed::<10>).step(0.001);
    let start = ONE_ANGLE.state([angle], [rate]);
    let step = root(&run.run(start, 0.0..0.1).expect("a pendulum")) / 8.0;
    let run = Simulation::new(&LINKAGE).element(Mixed::<4>).step(step);
    let whole = run.run(parallel(angle, rate), 0.0..16.0 * step);
    let first = run.run(parallel(angle, rate), 0.0..8.0 * step);
    let first = first.expect("to the flat position");
    let second = run.resume(first.checkpoint().expect("kept"), 16.0 * step);
    let (whole, second) = (whole.expect("a run"), second.expect("a run"));
    assert_eq!(whole.last(), second.last());
    assert_eq!(first.statistics().cuts, 1);
}

type Quaternion = [f64; 4];

fn times(a: Quaternion, b: Quaternion) -> Quaternion {
    [
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
        a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    ]
}

fn turned(e: Quaternion, x: [f64; 3]) -> [f64; 3] {
    let back = [e[0], -e[1], -e[2], -e[3]];
    let [_, rest @ ..] = times(times(e, [0.0, x[0], x[1], x[2]]), back);
    rest
}

impl SpatialFourBar {
    /// Bennett's linkage, by the angle of its first joint.
    fn at(&self, theta: f64, rate: f64) -> State<21> {
        let ratio = (0.5 * (self.beta + self.alpha)).sin() / (0.5 * (self.beta - self.alpha)).sin();
        let second = 2.0 * (ratio / (0.5 * theta).tan()).atan();
        let angles = [theta, second, -theta];
        let lengths = [self.l1, self.l2, self.l3];
        let twists = [self.alpha, self.beta, self.alpha];
        let (mut place, mut e) = ([0.0; 3], [1.0, 0.0, 0.0, 0.0]);
        let mut q = [0.0; 21];
        for body in 0..3 {
            e = times(
                e,
                [
                    (0.5 * angles[body]).cos(),
                    0.0,
                    0.0,
                    (0.5 * angles[body]).sin(),
                ],
            );
            let along = turned(e, [lengths[body], 0.0, 0.0]);
            for k in 0..3 {
                q[7 * body + k] = place[k] + 0.5 * along[k];
                place[k] += along[k];
            }
            q[7 * body + 3..7 * body + 7].copy_from_slice(&e);
            e = times(
                e,
                [
                    (0.5 * twists[body]).cos(),
                    (0.5 * twists[body]).sin(),
                    0.0,
                    0.0,
                ],
            );
        }
        let mut v = [0.0; 21];
        // The spin of the first body; the others follow from it.
        let w = [0.0, 0.0, 0.0, 0.5 * rate];
        let spin = times(w, [q[3], q[4], q[5], q[6]]);
        v[3..7].copy_from_slice(&spin);
        self.project(q, v)
    }

    fn project(&self, q: [f64; 21], v: [f64; 21]) -> State<21> {
        let start = self.consistent_state(q, v).expect("consistent");
        assert!(start.position < 1e-14, "closed: {:e}", start.position);
        assert_eq!(start.rank, 20);
        start.state
    }
}

/// Bennett's linkage: 27 equations, of which 20 are independent, for 21 coordinates.
#[test]
fn bennett() {
    let alpha = 0.6_f64;
    let (bar, coupler) = (1.0, 1.4);
    let model = SpatialFourBar {
        l1: bar,
        l2: coupler,
        l3: bar,
        ground: -coupler,
        alpha,
        beta: (1.4 * alpha.sin()).asin(),
        m1: 1.0,
        m2: 1.0,
        m3: 1.0,
        g: 9.81,
    };
    let start = model.at(1.0, 1.0);
    let drift = |step: f64, span: f64| {
        let run = Simulation::new(&model).element(Mixed::<4>).step(step);
        let motion = run.run(start, 0.0..span).expect("a run");
        assert_eq!(motion.constraint_residual().rank, 20);
        energies_off(&motion)
    };
    let ((_, long), (_, short)) = (drift(0.08, 4.0), drift(0.04, 4.0));
    let order = (long / short).log2();
    assert!((order - 6.0).abs() < 0.3, "{order}: {long:e}, {short:e}");
    assert!(short < 5e-7, "{short:e}");
    let (jump, drift) = drift(0.04, 0.04 * f64::from(long_steps()));
    assert!(jump < 5e-7 && drift < 5e-7, "{jump:e}, {drift:e}");
}

/// The kinetic energy of a x′ + b y′ alone: the velocities of x and y are not determined.
#[dynamics(
    coordinates(x, y, z),
    lagrangian = (a*dot(x) + b*dot(y))^2/2 + dot(z)^2/2,
    constraint(level) = z,
)]
struct Undetermined {
    a: f64,
    b: f64,
}

/// The same where x and y move alike.
#[dynamics(
    coordinates(x, y, z),
    lagrangian = (a*dot(x) + b*dot(y))^2/2 + dot(z)^2/2,
    constraint(tied) = x - y,
)]
struct Tied {
    a: f64,
    b: f64,
}

/// The pivot of such a mass matrix is zero, or a rounding error.
#[test]
fn velocities_that_no_momentum_determines() {
    use tfe::runtime::ConstraintError;
    use tfe::{ConsistentError, StepError};
    for (a, b) in [(0.3, 0.7), (0.1, 0.7), (1.0 / 3.0, 0.1), (1.1, 0.3)] {
        let (q, v) = ([0.0; 3], [1.0, 1.0, 0.0]);
        let error = Undetermined { a, b }.consistent_state(q, v);
        let error = error.expect_err("many velocities have one momentum");
        let singular = StepError::Constraint(ConstraintError::SingularMass);
        assert_eq!(error, ConsistentError::Model(singular), "{a}, {b}");
        let tied = Tied { a, b }.consistent_state(q, v);
        let tied = tied.expect("one velocity of x and y");
        for (found, given) in tied.velocities.iter().zip(v) {
            assert!((found - given).abs() <= 1e-13, "{a}, {b}: {tied:?}");
        }
    }
}
