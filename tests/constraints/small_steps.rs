//! Steps down to the resolution of positions: an iteration that has reached the roundings of its constraints is done.

use crate::common::distance;
use crate::models::{
    Andrews, Bead, BeadRates, KnifeEdge, MovingGround, MovingWire, ON_WIRE, QuaternionTop,
    RodPendulum, RodPendulumRates,
};
use crate::overconstrained::plate;
use tfe::prelude::*;

#[dynamics(
    coordinates(x, y),
    lagrangian = m/2*(dot(x)^2 + dot(y)^2) - m*g*y,
    constraint(rod) = x^2 + y^2 - l^2,
)]
struct Rod {
    m: f64,
    g: f64,
    l: f64,
}

#[dynamics(
    coordinates(a, b, x),
    lagrangian = j/2*dot(a)^2 + k/2*dot(b)^2 + m/2*dot(x)^2 - g*sin(a),
    constraint(cx) = cos(a) + 2*cos(b) - x,
    constraint(cy) = sin(a) - 2*sin(b),
)]
struct SliderCrank {
    j: f64,
    k: f64,
    m: f64,
    g: f64,
}

const STEPS: [f64; 9] = [1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9];

/// Runs with three to eight nodes; before, eight nodes stalled below 1e-5 and took more than a hundred iterations a step where they did not.
fn runs<M, const N: usize>(model: &M, start: State<N>)
where
    M: tfe::runtime::Model<N>
        + tfe::runtime::length::Declared<N, Length = tfe::runtime::length::FixedLength>,
{
    for nodes in 3..=8 {
        for step in STEPS {
            let simulation: Simulation<'_, M, N> = Simulation::new(model);
            let run = simulation.element(Element::mixed(nodes)).step(step);
            let motion = run.run(start, 0.0..40.0 * step);
            let motion = motion.unwrap_or_else(|error| panic!("{nodes} {step:e}: {error}"));
            let iterations = motion.statistics().newton_iterations;
            assert!(iterations <= 16 * 40, "{nodes} {step:e}: {iterations}");
            let energies = motion.energies();
            let off = energies[40] - energies[0];
            // Of order 2(n − 1) where it is not rounding.
            let most = 1e-13 + (2.0 * step).powi(2 * nodes as i32 - 2);
            assert!(
                off.abs() < most,
                "{nodes} {step:e}: energy off by {off:.1e}"
            );
        }
    }
}

#[test]
fn a_rod_takes_steps_of_any_size() {
    let rod = Rod {
        m: 1.0,
        g: 9.81,
        l: 1.0,
    };
    runs(&rod, rod.state([0.6, -0.8], [0.4, 0.3]));
}

#[test]
fn a_slider_crank_takes_steps_of_any_size() {
    let crank = SliderCrank {
        j: 0.5,
        k: 0.2,
        m: 1.0,
        g: 3.0,
    };
    let (a, va) = (0.7_f64, 1.3);
    let b = (a.sin() / 2.0).asin();
    let vb = va * a.cos() / (2.0 * b.cos());
    let vx = -a.sin() * va - 2.0 * b.sin() * vb;
    runs(
        &crank,
        crank.state([a, b, a.cos() + 2.0 * b.cos()], [va, vb, vx]),
    );
}

/// Elements of three to seven nodes against eight: errors fall with the order 2(n − 1) of the element until they are roundings, and stay there.
fn falls<M, const N: usize>(name: &str, model: &M, start: State<N>, largest: f64)
where
    M: tfe::runtime::Model<N>
        + tfe::runtime::length::Declared<N, Length = tfe::runtime::length::FixedLength>,
{
    const COUNT: u32 = 20;
    const ROUNDINGS: f64 = 4e-15;
    let mut before = [f64::INFINITY; 5];
    for step in STEPS.into_iter().skip_while(|step| *step > largest) {
        let end = |nodes: usize| {
            let simulation: Simulation<'_, M, N> = Simulation::new(model);
            let run = simulation.element(Element::mixed(nodes)).step(step);
            let motion = run.run(start, 0.0..f64::from(COUNT) * step);
            let motion = motion.unwrap_or_else(|error| panic!("{name}, {nodes} {step:e}: {error}"));
            let iterations = motion.statistics().newton_iterations;
            assert!(
                iterations <= 64 * u64::from(COUNT),
                "{name}, {nodes} {step:e}: {iterations}"
            );
            motion.last().q
        };
        let exact = end(8);
        let size = exact.iter().fold(1.0, |size: f64, q| size.max(q.abs()));
        for (before, nodes) in before.iter_mut().zip(3..) {
            let off = distance(&end(nodes), &exact) / size;
            // The time is shorter, too.
            let expected = *before * 0.1_f64.powi(2 * nodes as i32 - 3);
            assert!(
                off <= expected + ROUNDINGS,
                "{name}, {nodes} {step:e}: {off:.1e} after {before:.1e}"
            );
            *before = off;
        }
    }
}

#[test]
fn errors_fall_until_they_are_roundings() {
    falls(
        "rod",
        &RodPendulum::UNIT,
        RodPendulum::UNIT.horizontal(),
        0.1,
    );
    let rates = RodPendulumRates::UNIT;
    falls("rod by rates", &rates, rates.horizontal(), 0.1);
    let bead = Bead { g: 9.81 };
    falls("bead", &bead, bead.state(ON_WIRE, [0.0; 2]), 0.1);
    let bead = BeadRates { g: 9.81 };
    falls("bead by rates", &bead, bead.state(ON_WIRE, [0.0; 2]), 0.1);
    let wire = MovingWire { g: 9.81, c: 0.3 };
    let v = [0.1, 0.1 * 1.2_f64.powi(3) + 1.2_f64.powi(4) / 20.0];
    falls("moving wire", &wire, wire.state(ON_WIRE, v), 0.1);
    let top = QuaternionTop::TABLE;
    falls("top", &top, top.tilted(), 0.1);
    let blade = KnifeEdge::TABLE;
    falls("blade", &blade, blade.turning(1.0), 0.1);
    let ground = MovingGround { c: 0.1 };
    falls(
        "ground",
        &ground,
        ground.state([0.0; 3], [1.0, 0.0, 0.5]),
        0.1,
    );
    let (plate, start) = plate();
    falls("plate", &plate, start, 0.1);
    falls("Andrews", &Andrews, Andrews.at_rest(), 1e-4);
}
