//! Emitted solvers compared with the general stepper: they give the same numbers.

use tfe::prelude::*;
use tfe::runtime::step::{Control, Stepper};

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

/// A stiff joint: equations of second order with friction.
#[dynamics(
    coordinates(a, b),
    lagrangian = (dot(a)^2 + dot(b)^2)/2 - k/2*(a - b)^2 - k/4*(a - b)^4 + cos(a),
    force(a) = -c*dot(a),
    solver(BladeByFive, Mixed::<5>),
)]
struct Blade {
    k: f64,
    c: f64,
}

/// Fields that do not occur in formulas: the solver keeps a copy of them.
#[dynamics(coordinates(x), lagrangian = m/2*dot(x)^2 - k/4*x^4, solver(OfNamed, Mixed::<3>))]
struct Named {
    m: f64,
    k: f64,
    _name: String,
    _parts: Vec<usize>,
    _note: Option<&'static str>,
}

/// A hundred steps with both: all coordinates and momenta must agree to the last bit.
macro_rules! same {
    ($model:expr, $start:expr, $solver:ident, $element:expr, $h:expr) => {{
        let (model, start, h): (_, _, f64) = (&$model, $start, $h);
        let mut stepper = Stepper::new(model, $element, Control::default()).expect("an element");
        let mut solver = $solver::new(model, h);
        let (mut general, mut emitted) = (start, start);
        for step in 0..100 {
            let t = f64::from(step) * h;
            stepper
                .advance(t, h, &mut general, &[])
                .expect("the generic path");
            solver.advance(&mut emitted).expect("the emitted solver");
            let bits = |state: &State<_>| (state.q.map(f64::to_bits), state.p.map(f64::to_bits));
            assert_eq!(
                bits(&general),
                bits(&emitted),
                "{}, step {step}",
                stringify!($solver)
            );
        }
        assert!((solver.time() - 100.0 * h).abs() < 1e-12 * h.max(1.0) * 100.0);
        assert_eq!(stepper.statistics(), solver.statistics());
        assert_eq!(solver.statistics().steps, 100);
        assert_eq!($solver::BYTES, std::mem::size_of::<$solver>());
        (
            solver.statistics().newton_iterations,
            solver.statistics().cuts,
        )
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
fn the_same_numbers_where_the_model_has_other_fields() {
    let named = Named {
        m: 2.0,
        k: 3.0,
        _name: "spring".to_owned(),
        _parts: vec![1, 2],
        _note: None,
    };
    let start = named.state([1.0], [0.5]);
    same!(named, start, OfNamed, Element::mixed(3), 0.05);
}

/// Steps so long that the fixed-point iteration is replaced by Newton's method, and later tried again.
#[test]
fn the_same_numbers_where_the_fixed_point_does_not_contract() {
    let links = Links { g: 9.81, c: 0.2 };
    let start = links.state([2.1, -0.4], [0.2, 0.5]);
    let four = same!(links, start, FourNodes, Element::mixed(4), 0.17);
    let two = same!(links, start, TwoNodes, Element::mixed(2), 0.2);
    let by_primal = same!(links, start, Displacement, Element::primal(3), 0.2);
    let lobatto = same!(links, start, Lobatto, Element::primal(4).lobatto(), 0.2);
    for (newton, cuts) in [four, two, by_primal, lobatto] {
        assert!(newton > 0 && cuts > 0, "{newton} {cuts}");
    }
    let stiff = Blade { k: 1e4, c: 0.1 };
    let start = stiff.state([0.3, 0.1], [0.0, 1.0]);
    for (h, is_newton) in [(0.01, false), (0.02, true), (0.1, true)] {
        let (newton, _) = same!(stiff, start, BladeByFive, Element::mixed(5), h);
        assert_eq!(newton > 0, is_newton, "{h}");
    }
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
