//! Emitted solvers beside the generic path: the same numbers.

use tfe::prelude::*;

#[dynamics(
    coordinates(theta1, theta2),
    lagrangian = dot(theta1)^2 + dot(theta2)^2/2 + dot(theta1)*dot(theta2)*cos(theta1 - theta2)
               + g*(2*cos(theta1) + cos(theta2)),
    force(theta1) = -c*dot(theta1) + sin(t),
    solver(TwoNodes, Mixed::<2>),
    solver(FourNodes, Mixed::<4>),
    solver(Displacement, Primal::<3>),
    solver(Lobatto, Primal::<4>.lobatto()),
    solver(Conserving, EnergyConserving::<3>),
    solver(Dissipative, Radau::<4>),
)]
struct Links {
    g: f64,
    c: f64,
}

#[dynamics(
    coordinates(x, y), momenta(px, py),
    hamiltonian = (px^2 + py^2)/2 + (x^2 + y^2)/2 + x^2*y - y^3/3,
    solver(Galaxy, Mixed::<5>),
    solver(GalaxyByPrimal, Primal::<3>),
)]
struct HenonHeiles {}

#[dynamics(
    coordinates(x), lagrangian = m/2*dot(x)^2 - k/2*x^2, dissipation = c/2*dot(x)^2,
    solver(Linear, Mixed::<4>),
)]
struct Oscillator {
    m: f64,
    k: f64,
    c: f64,
}

/// A hundred steps both ways, every coordinate and momentum within 1e-15 of its size.
macro_rules! same {
    ($model:expr, $start:expr, $solver:ident, $element:expr, $h:expr) => {{
        let (model, start, element) = (&$model, $start, $element);
        let motion = Simulation::new(model)
            .element(element)
            .step($h)
            .run(start, 0.0..100.0 * $h)
            .expect("the generic path");
        let mut solver = $solver::new(model, $h);
        let mut state = start;
        for node in &motion.states()[1..] {
            solver.advance(&mut state).expect("the emitted solver");
            for (a, b) in state
                .q
                .iter()
                .chain(&state.p)
                .zip(node.q.iter().chain(&node.p))
            {
                let scale = b.abs().max(1.0);
                assert!(
                    (a - b).abs() <= 1e-15 * scale,
                    "{}: {a:e} {b:e}",
                    stringify!($solver)
                );
            }
        }
        assert!((solver.time() - 100.0 * $h).abs() < 1e-12);
        assert_eq!(solver.statistics().steps, 100);
        assert_eq!($solver::BYTES, std::mem::size_of::<$solver>());
    }};
}

#[test]
fn the_same_numbers_as_the_generic_path() {
    let links = Links { g: 9.81, c: 0.2 };
    let start = links.state([0.7, -0.4], [0.2, 0.5]);
    same!(links, start, TwoNodes, Element::mixed(2), 0.01);
    same!(links, start, FourNodes, Element::mixed(4), 0.02);
    same!(links, start, Displacement, Element::primal(3), 0.02);
    same!(links, start, Lobatto, Element::primal(4).lobatto(), 0.02);
    same!(
        links,
        start,
        Conserving,
        Element::energy_conserving(3),
        0.02
    );
    same!(links, start, Dissipative, Element::radau(4), 0.02);
    let galaxy = HenonHeiles {};
    let start = State {
        q: [0.1, 0.0],
        p: [0.0, 0.5],
    };
    same!(galaxy, start, Galaxy, Element::mixed(5), 0.2);
    same!(galaxy, start, GalaxyByPrimal, Element::primal(3), 0.1);
    let oscillator = Oscillator {
        m: 2.0,
        k: 3.0,
        c: 0.1,
    };
    same!(
        oscillator,
        oscillator.state([1.0], [0.0]),
        Linear,
        Element::mixed(4),
        0.1
    );
}

#[test]
fn a_failed_step_leaves_the_state() {
    let mut solver = FourNodes::new(&Links { g: 9.81, c: 0.2 }, f64::NAN);
    let mut state = State {
        q: [0.7, -0.4],
        p: [0.2, 0.5],
    };
    assert!(solver.advance(&mut state).is_err());
    assert_eq!(
        state,
        State {
            q: [0.7, -0.4],
            p: [0.2, 0.5]
        }
    );
    let mut solver = FourNodes::new(
        &Links {
            g: f64::NAN,
            c: 0.2,
        },
        0.1,
    );
    assert!(solver.advance(&mut state).is_err());
    assert_eq!(
        state,
        State {
            q: [0.7, -0.4],
            p: [0.2, 0.5]
        }
    );
}
