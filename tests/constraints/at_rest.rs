//! Mechanisms at rest at the origin of their coordinates under loads, and locked mechanisms.

use crate::common::{distance, larger};
use crate::models::RodPendulum;
use crate::runs::run;
use tfe::constraints::tangent_basis;
use tfe::prelude::*;

fn worst(errors: impl IntoIterator<Item = f64>) -> f64 {
    errors.into_iter().fold(0.0, larger)
}

/// A triangle of two supports and a redundant third, under weight.
#[dynamics(
    coordinates(x, y),
    lagrangian = 1.3*(dot(x)^2 + dot(y)^2)/2 - 9.81*y - 0.3*x,
    constraint(floor) = y - 0.3*x,
    constraint(wall) = x + 0.7*y,
    constraint(third) = x - y,
)]
struct Supported;

/// A frame of three rods, statically determinate.
#[dynamics(
    coordinates(x, y, z),
    lagrangian = 1.3*(dot(x)^2 + dot(y)^2 + 3*dot(z)^2)/2 - 9.81*y - 0.3*x - 0.7*z,
    constraint(a) = y - 0.3*x + 0.1*z,
    constraint(b) = x + 0.7*y - 0.3*z,
    constraint(c) = z - 0.11*y,
)]
struct Frame;

/// A body on three blades that leave no motion.
#[dynamics(
    coordinates(x, y, a),
    lagrangian = (dot(x)^2 + dot(y)^2 + 0.4*dot(a)^2)/2 - 0.3*x - 0.7*y,
    constraint(b1) = 0.3*dot(x) - 0.9*dot(y) + 0.1*dot(a),
    constraint(b2) = dot(x)*cos(a) + 0.33*dot(a),
    constraint(b3) = 1.1*dot(a) - 0.7*dot(x),
)]
struct Blades;

/// Two wheels in mesh, with loads that balance.
#[dynamics(coordinates(a, b), lagrangian = (dot(a)^2 + 2*dot(b)^2)/2 - 0.3*a + 0.9*b, constraint(mesh) = a - 3*b)]
struct Balanced;

/// The same as a Hamiltonian.
#[dynamics(
    coordinates(a, b),
    momenta(pa, pb),
    hamiltonian = (pa^2 + pb^2/2)/2 + 0.3*a - 0.9*b,
    constraint(mesh) = a - 3*b,
)]
struct BalancedMomenta;

/// Three wheels in a ring, of which none can turn; a torque on the first.
#[dynamics(
    coordinates(a, b, c),
    lagrangian = (dot(a)^2 + 2*dot(b)^2 + 3*dot(c)^2)/2,
    constraint(ab) = a + 2*b,
    constraint(bc) = 2*b + 0.5*c,
    constraint(ca) = 0.5*c + a,
    force(a) = 3,
)]
struct Ring;

/// A wheel without inertia between two others, a wheel without loads, and a large one that turns the other way.
#[dynamics(
    coordinates(a, b, c, d, e),
    lagrangian = (dot(a)^2 + 2*dot(c)^2 + dot(d)^2 + dot(e)^2)/2 - 0.3*a + 1.8*c,
    constraint(ab) = a - 3*b,
    constraint(bc) = b - 2*c,
    constraint(cd) = c - 7*d,
    constraint(de) = d + 1000*e,
)]
struct Idle;

/// Loads of at most ten on inertias of about one move nothing by more than rounding errors of what they would move
/// without reactions, 5 t², with a margin for the factorisation of up to 40 equations. The reactions are those of
/// statics.
fn stays<M: Model<N>, const N: usize>(model: &M, reactions: &[f64]) {
    let start = State {
        q: [0.0; N],
        p: [0.0; N],
    };
    let elements: [Element; 3] = [Mixed::<2>.into(), Mixed::<4>.into(), Mixed::<7>.into()];
    for element in elements {
        for h in [1.0, 0.1, 0.001] {
            let simulation = Simulation::new(model).element(element).step(h);
            let motion = simulation.run(start, 0.0..10.0 * h).expect("it stays");
            let end = motion.last();
            let moved = worst(end.q.iter().map(|q| q.abs()));
            let moves = worst(end.v.iter().map(|v| v.abs()));
            assert!(moved <= 1e-12 * h * h, "{h}: {moved:e}");
            assert!(moves <= 1e-12 * h, "{h}: {moves:e}");
            assert!(motion.warnings().is_empty(), "{:?}", motion.warnings());
            let found = motion.reactions().row(7).expect("a node");
            let off = worst(
                found
                    .iter()
                    .zip(reactions)
                    .map(|(one, other)| (one - other).abs()),
            );
            assert!(off <= 1e-12, "{h}: {found:?}");
            assert!(
                motion.statistics().iterations <= 400,
                "{:?}",
                motion.statistics()
            );
        }
    }
}

#[test]
fn what_loads_cannot_move_stays_at_the_origin() {
    // Each λ solves Aᵀλ = load.
    stays(&Balanced, &[0.3]);
    stays(&BalancedMomenta, &[0.3]);
    stays(&Idle, &[0.3, 0.9, 0.0, 0.0]);
    // λ₁ + λ₃ = −3 , 2 (λ₁ + λ₂) = 0 , (λ₂ + λ₃)/2 = 0
    stays(&Ring, &[-1.5, 1.5, -1.5]);
    // By Cramer's rule, with the rows of the constraints as columns.
    stays(
        &Frame,
        &solved(
            [[-0.3, 1.0, 0.1], [1.0, 0.7, -0.3], [0.0, -0.11, 1.0]],
            [0.3, 9.81, 0.7],
        ),
    );
    stays(
        &Blades,
        &solved(
            [[0.3, -0.9, 0.1], [1.0, 0.0, 0.33], [-0.7, 0.0, 1.1]],
            [0.3, 0.7, 0.0],
        ),
    );
    // Three rows in a plane: the reactions are not unique, their forces are.
    let start = Supported.state([0.0; 2], [0.0; 2]);
    for h in [1.0, 0.1, 0.001] {
        let run = Simulation::new(&Supported)
            .step(h)
            .run(start, 0.0..10.0 * h);
        let motion = run.expect("it stays");
        let moved = worst(motion.last().q.iter().map(|q| q.abs()));
        assert!(moved <= 1e-12 * h * h, "{h}: {moved:e}");
        let [floor, wall, third] = motion.reactions().row(5).expect("a node") else {
            panic!("three constraints");
        };
        let along_x = -0.3 * floor + wall + third - 0.3;
        let along_y = floor + 0.7 * wall - third - 9.81;
        assert!(worst([along_x.abs(), along_y.abs()]) <= 1e-12);
    }
}

/// A pendulum in space that hangs at rest: the momentum that its weight gives and its rod takes is all rounding errors,
/// in runs whose elements are compared with shorter ones.
#[test]
fn what_hangs_at_rest_has_no_warning() {
    #[dynamics(
        coordinates(x, y, z),
        lagrangian = (dot(x)^2 + dot(y)^2 + dot(z)^2)/2 - g*z,
        constraint(rod) = x^2 + y^2 + z^2 - l^2,
    )]
    struct Hanging {
        g: f64,
        l: f64,
    }
    for l in [0.7, 1.0 / 3.0, 1e-6] {
        let hanging = Hanging { g: 9.81, l };
        let start = hanging.state([0.0, 0.0, -l], [0.0; 3]);
        for part in [0.003, 0.01, 0.1] {
            // The frequency is √(g/l).
            let h = part * (l / 0.7).sqrt();
            let simulation = Simulation::new(&hanging).step(h);
            let run = simulation.run_linearised(start, 0.0..100.0 * h);
            let (motion, _) = run.expect("it hangs").into_parts();
            assert!(
                motion.warnings().is_empty(),
                "{l} {h}: {:?}",
                motion.warnings()
            );
            let off = (motion.last().q[2] + l).abs().max(motion.last().q[0].abs());
            assert!(off <= 1e-15 * l, "{l} {h}: {off:e}");
        }
    }
}

/// The momenta that weights give and rods take were divided by each other, down to 1e-120, until a run failed with numbers
/// that are not finite.
#[test]
fn chains_hang_at_rest() {
    #[dynamics(
        coordinates(x, y, u, v),
        lagrangian = m/2*(dot(x)^2 + dot(y)^2 + dot(u)^2 + dot(v)^2) - m*g*(y + v),
        constraint(upper) = (x^2 + y^2 - l^2)/2,
        constraint(lower) = (u - x)^2 + (v - y)^2 - l^2,
    )]
    struct Chain {
        m: f64,
        l: f64,
        g: f64,
    }
    for l in [1.0, 0.7, 0.3, 2.1] {
        let (m, g) = (1.3, 9.81);
        let (rod, chain) = (RodPendulum { m, l, g }, Chain { m, l, g });
        let rod_start = rod.state([0.0, -l], [0.0; 2]);
        let chain_start = chain.state([0.0, -l, 0.0, -2.0 * l], [0.0; 4]);
        for element in [3, 4, 6].map(Element::mixed) {
            for step in [0.1, 0.05, 0.01, 0.003] {
                let one = run(&rod, element, step, rod_start, 100.0 * step);
                let other = run(&chain, element, step, chain_start, 100.0 * step);
                let warnings = [one.warnings(), other.warnings()].concat();
                assert!(warnings.is_empty(), "{l} {element} {step}: {warnings:?}");
                let off = [
                    distance(&one.last().q, &rod_start.q),
                    distance(&other.last().q, &chain_start.q),
                ];
                assert!(worst(off) <= 4e-15 * l, "{l} {element} {step}: {off:?}");
            }
        }
    }
}

/// The solution of Aᵀ λ = b by Cramer's rule.
fn solved(rows: [[f64; 3]; 3], b: [f64; 3]) -> [f64; 3] {
    let det = |[x, y, z]: [[f64; 3]; 3]| {
        x[0] * (y[1] * z[2] - y[2] * z[1]) - x[1] * (y[0] * z[2] - y[2] * z[0])
            + x[2] * (y[0] * z[1] - y[1] * z[0])
    };
    std::array::from_fn(|k| {
        let mut other = rows;
        other[k] = b;
        det(other) / det(rows)
    })
}

/// Starts of which the constraints leave nothing but zeros.
#[test]
fn locked_mechanisms_have_a_consistent_start() {
    for (q, v) in [
        ([0.0; 3], [0.3, 0.2, 0.1]),
        ([0.0; 3], [1.0, 0.0, 0.0]),
        ([1.0, -0.5, -2.0], [0.0; 3]),
        ([1.0, 0.3, -2.0], [0.3, 0.2, 0.1]),
    ] {
        let start = Ring.consistent_state(q, v).expect("the origin at rest");
        let numbers = start.state.q.iter().chain(&start.velocities);
        assert!(worst(numbers.map(|number| number.abs())) <= 1e-15);
        assert_eq!(start.rank, 3);
        let basis = tangent_basis(&Ring, 0.0, &start.state).expect("a basis");
        assert_eq!(basis.shape(), (6, 0));
    }
}
