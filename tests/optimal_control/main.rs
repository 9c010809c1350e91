//! Optimal control: inputs with the lowest cost.

mod errors;
mod minima;

use std::f64::consts::{PI, TAU};
use tfe::boundary::{BoundaryError, Component};
use tfe::optimal_control::OptimalControlErrorKind;
use tfe::prelude::*;
use tfe::runtime::Controlled;
use tfe::{InputError, MeshError};

/// A pole on a cart, hanging at θ = 0 (M. Kelly, *An introduction to trajectory optimization*, SIAM Review 59 (2017),
/// section 6).
#[dynamics(
    coordinates(x, theta),
    lagrangian = (cart + m)/2*dot(x)^2 + m*l*dot(x)*dot(theta)*cos(theta) + m*l^2/2*dot(theta)^2 + m*g*l*cos(theta),
    input(u),
    force(x) = u,
    output(effort) = u^2,
    output(power) = u*dot(x),
    output(force) = u,
)]
struct CartPole {
    cart: f64,
    m: f64,
    l: f64,
    g: f64,
}

const CART: CartPole = CartPole {
    cart: 1.0,
    m: 0.3,
    l: 0.5,
    g: 9.81,
};

fn swing_up<'m>() -> OptimalControl<'m, CartPole, 2> {
    let (start, end) = (
        CART.state([0.0, 0.0], [0.0, 0.0]),
        CART.state([1.0, PI], [0.0, 0.0]),
    );
    OptimalControl::of(&CART)
        .from_to(start, end, 0.0..2.0)
        .running_cost("effort")
}

/// An arm of two equal links on a horizontal plane, with torques at the shoulder and the elbow; θ₂ is relative to the
/// first link.
#[dynamics(
    coordinates(theta1, theta2),
    let x1 = cos(theta1)/2,
    let y1 = sin(theta1)/2,
    let x2 = cos(theta1) + cos(theta1 + theta2)/2,
    let y2 = sin(theta1) + sin(theta1 + theta2)/2,
    lagrangian = m/2*(dot(x1)^2 + dot(y1)^2 + dot(x2)^2 + dot(y2)^2) + m/24*(dot(theta1)^2 + (dot(theta1) + dot(theta2))^2),
    input(shoulder),
    input(elbow),
    force(theta1) = shoulder,
    force(theta2) = elbow,
    output(effort) = shoulder^2 + elbow^2,
    output(power) = shoulder*dot(theta1) + elbow*dot(theta2),
    output(moment) = shoulder,
)]
struct Arm {
    m: f64,
}

const ARM: Arm = Arm { m: 1.0 };

fn reach<'m>() -> OptimalControl<'m, Arm, 2> {
    let (start, end) = (
        ARM.state([0.2, 1.9], [0.0, 0.0]),
        ARM.state([1.4, 0.4], [0.0, 0.0]),
    );
    OptimalControl::of(&ARM)
        .from_to(start, end, 0.0..1.5)
        .running_cost("effort")
}

/// A spacecraft in the plane, in polar coordinates and units of its first orbit, with radial and tangential thrust.
#[dynamics(
    coordinates(r, phi),
    momenta(pr, pphi),
    hamiltonian = (pr^2 + pphi^2/r^2)/2 - 1/r,
    input(radial),
    input(tangential),
    force(r) = radial,
    force(phi) = r*tangential,
    output(effort) = radial^2 + tangential^2,
    output(power) = radial*pr + tangential*pphi/r,
    output(moment) = r*tangential,
)]
struct Spacecraft;

/// The same as a Lagrangian.
#[dynamics(
    coordinates(r, phi),
    lagrangian = (dot(r)^2 + r^2*dot(phi)^2)/2 + 1/r,
    input(radial),
    input(tangential),
    force(r) = radial,
    force(phi) = r*tangential,
    output(effort) = radial^2 + tangential^2,
)]
struct Spaceship;

/// From a circular orbit to one with a radius half as large again, in the time of one and a half revolutions on the
/// first; the position on the second is free.
fn transfer<M: Controlled<2>>(model: &M) -> OptimalControl<'_, M, 2> {
    let circle = |r: f64| (r.sqrt(), r.powf(-1.5));
    let (start, end) = (circle(1.0), circle(1.5));
    OptimalControl::of(model)
        .span(0.0..1.5 * TAU)
        .from(State {
            q: [1.0, 0.0],
            p: [0.0, start.0],
        })
        .end(Component::Coordinate(0), 1.5)
        .end(Component::Momentum(0), 0.0)
        .end(Component::Momentum(1), end.0)
        .guess(move |t| {
            let part = t / (1.5 * TAU);
            let rate = start.1 + (end.1 - start.1) * part;
            ([1.0 + 0.5 * part, 0.8 * t], [0.0, rate])
        })
        .running_cost("effort")
}

/// The costs with E and 2 E elements and with many: the errors of the first two, and the cost.
fn errors<'m, M: Controlled<2> + 'm>(
    problem: impl Fn() -> OptimalControl<'m, M, 2>,
    elements: usize,
    many: usize,
) -> (f64, [f64; 2]) {
    let cost = |elements| {
        let best = problem().elements(elements).solve().expect("a minimum");
        let last = best.history().last().copied().expect("iterations");
        assert!(last.gap < 1e-9 && last.correction < 1e-10, "{last:?}");
        assert!(best.iterations() < 25, "{} iterations", best.iterations());
        best.cost()
    };
    let finest = cost(many);
    let beside = |elements| ((cost(elements) - finest) / finest).abs();
    (finest, [beside(elements), beside(2 * elements)])
}

#[test]
fn costs_are_those_of_finer_elements() {
    let (swing, [coarse, fine]) = errors(swing_up, 40, 160);
    assert!(coarse < 1e-6, "{coarse:e}");
    // Order 6: halving the elements reduces the error by a factor of 64.
    assert!(
        (40.0..110.0).contains(&(coarse / fine)),
        "{coarse:e} {fine:e}"
    );
    let (arm, [coarse, fine]) = errors(reach, 10, 40);
    assert!(coarse < 1e-5 && fine < 1e-6, "{coarse:e} {fine:e}");
    let (space, [coarse, fine]) = errors(|| transfer(&Spacecraft), 20, 80);
    assert!(coarse < 1e-6 && fine < 1e-7, "{coarse:e} {fine:e}");
    let (by_lagrangian, _) = errors(|| transfer(&Spaceship), 20, 80);
    assert!((by_lagrangian / space - 1.0).abs() < 1e-11);
    // Values from the first computation; there are no published values with these digits.
    for (cost, known) in [
        (swing, 58.807667461),
        (arm, 5.960635913),
        (space, 0.003745281275),
    ] {
        assert!((cost / known - 1.0).abs() < 1e-9, "{cost}");
    }
}

#[test]
fn work_is_energy_and_impulse_is_momentum_all_along() {
    let best = swing_up().elements(80).solve().expect("a minimum");
    let motion = best.motion();
    let driven = best.steered(&CART);
    let integral = |output| motion.integral(&driven, output).expect("an output");
    let (work, impulse) = (integral("power"), integral("force"));
    let pushed = integral("effort");
    assert!((pushed[80] / best.cost() - 1.0).abs() < 1e-12);
    let energies = motion.energies();
    let range = energies
        .iter()
        .fold(0.0_f64, |most, e| most.max((e - energies[0]).abs()));
    for (node, state) in motion.states().iter().enumerate() {
        let gained = energies[node] - energies[0];
        assert!(
            (gained - work[node]).abs() < 1e-6 * range,
            "{node}: {gained} {}",
            work[node]
        );
        // Gravity has no horizontal component: only the force changes the momentum, up to rounding.
        assert!((state.p[0] - impulse[node]).abs() < 1e-12, "{node}");
    }

    let best = reach().elements(40).solve().expect("a minimum");
    let (motion, driven) = (best.motion(), best.steered(&ARM));
    let moment = motion.integral(&driven, "moment").expect("an output");
    let work = motion.integral(&driven, "power").expect("an output");
    for (node, state) in motion.states().iter().enumerate() {
        assert!((state.p[0] - moment[node]).abs() < 1e-12, "{node}");
        assert!(
            (motion.energies()[node] - work[node]).abs() < 1e-6,
            "{node}"
        );
    }

    let best = transfer(&Spacecraft)
        .elements(40)
        .solve()
        .expect("a minimum");
    let (motion, driven) = (best.motion(), best.steered(&Spacecraft));
    let moment = motion.integral(&driven, "moment").expect("an output");
    let work = motion.integral(&driven, "power").expect("an output");
    for (node, state) in motion.states().iter().enumerate() {
        assert!((state.p[1] - 1.0 - moment[node]).abs() < 1e-12, "{node}");
        let gained = motion.energies()[node] - motion.energies()[0];
        assert!((gained - work[node]).abs() < 1e-8, "{node}");
    }
}

/// The optimum is a motion of the model: a run with these inputs, by steps and independent of the search.
#[test]
fn an_optimum_is_a_run() {
    let best = swing_up().elements(50).solve().expect("a minimum");
    let run = Simulation::new(&CART)
        .element(Mixed::<4>)
        .step(0.04)
        .input("u", |t| best.input("u", t).expect("an input"))
        .run(CART.state([0.0, 0.0], [0.0, 0.0]), 0.0..2.0)
        .expect("a run");
    assert_eq!(run.states().len(), best.motion().states().len());
    for (own, other) in run.states().iter().zip(best.motion().states()) {
        for a in 0..2 {
            assert!((own.q[a] - other.q[a]).abs() < 1e-10 && (own.p[a] - other.p[a]).abs() < 1e-10);
        }
    }
    let (a, b) = (
        run.at(0.731).expect("inside"),
        best.motion().at(0.731).expect("inside"),
    );
    assert!((a.q[1] - b.q[1]).abs() < 1e-10 && (a.v[0] - b.v[0]).abs() < 1e-10);
    let craft = transfer(&Spacecraft)
        .elements(30)
        .solve()
        .expect("a minimum");
    let driven = craft.steered(&Spacecraft);
    let run = Simulation::new(&driven)
        .element(Mixed::<4>)
        .step(1.5 * TAU / 30.0)
        .run(
            State {
                q: [1.0, 0.0],
                p: [0.0, 1.0],
            },
            0.0..1.5 * TAU,
        )
        .expect("a run");
    let last = run.last();
    assert!((last.q[0] - 1.5).abs() < 1e-11 && last.p[0].abs() < 1e-11);
    let (a, b) = (
        run.at(2.9).expect("inside"),
        craft.motion().at(2.9).expect("inside"),
    );
    assert!((a.q[1] - b.q[1]).abs() < 1e-11 && (a.p[0] - b.p[0]).abs() < 1e-11);
}

/// The multipliers are the derivatives of the lowest cost.
#[test]
fn multipliers_are_what_states_are_worth() {
    let best = swing_up().elements(30).solve().expect("a minimum");
    let worth = best.multipliers()[0];
    let last = best.multipliers()[30];
    let cost = |change: [f64; 4], at_end: bool| {
        let (mut start, mut end) = (
            CART.state([0.0, 0.0], [0.0, 0.0]),
            CART.state([1.0, PI], [0.0, 0.0]),
        );
        // A shift of the state at the end is equivalent to the opposite shift of the state required there.
        let (state, sign) = if at_end {
            (&mut end, -1.0)
        } else {
            (&mut start, 1.0)
        };
        for a in 0..2 {
            state.q[a] += sign * change[a];
            state.p[a] += sign * change[2 + a];
        }
        OptimalControl::of(&CART)
            .elements(30)
            .from_to(start, end, 0.0..2.0)
            .running_cost("effort")
            .solve()
            .expect("a minimum")
            .cost()
    };
    for (at_end, worth) in [(false, worth), (true, last)] {
        let worth = [worth.q[0], worth.q[1], worth.p[0], worth.p[1]];
        for at in 0..4 {
            let moved = |distance: f64| {
                let mut change = [0.0; 4];
                change[at] = distance;
                cost(change, at_end)
            };
            let h = 1e-4;
            let difference =
                (8.0 * (moved(h) - moved(-h)) - (moved(2.0 * h) - moved(-2.0 * h))) / (12.0 * h);
            assert!(
                (difference - worth[at]).abs() < 1e-6 * worth[at].abs().max(1.0),
                "{at_end} {at}: {difference} {}",
                worth[at]
            );
        }
    }
}

/// Units of mass, length and time do not matter: the cost has the unit of a force squared, times a time.
#[test]
fn sizes_do_not_matter() {
    let plain = swing_up().elements(20).solve().expect("an optimum");
    for size in [1e-30, 1e-9, 1e-4, 1e4, 1e9, 1e30] {
        for (mass, length, time) in [(size, 1.0, 1.0), (1.0, size, 1.0), (1.0, 1.0, size)] {
            let cart = CartPole {
                cart: mass * CART.cart,
                m: mass * CART.m,
                l: length * CART.l,
                g: CART.g * length / (time * time),
            };
            let start = cart.state([0.0, 0.0], [0.0, 0.0]);
            let end = cart.state([length, PI], [0.0, 0.0]);
            let best = OptimalControl::of(&cart)
                .elements(20)
                .from_to(start, end, 0.0..2.0 * time)
                .running_cost("effort")
                .solve();
            let best = best.unwrap_or_else(|error| panic!("{mass:e} {length:e} {time:e}: {error}"));
            let force = mass * length / (time * time);
            let cost = best.cost() / force / force / time;
            assert!(
                (cost / plain.cost() - 1.0).abs() < 1e-9,
                "{mass:e} {length:e} {time:e}: {cost} {}",
                plain.cost()
            );
        }
    }
}

/// A mass with a force.
#[dynamics(
    coordinates(x),
    lagrangian = dot(x)^2/2,
    input(u),
    force(x) = u,
    output(effort) = u^2,
    output(miss) = 4*x^2,
    output(energy) = dot(x)^2/2,
)]
struct Sled;

#[test]
fn ends_are_given_free_or_cost_something() {
    // u = −w x₁ (1 − t) with x₁ = 1/(1 + w/3): the cost is w x₁, here with w = 4.
    let best = OptimalControl::of(&Sled)
        .elements(3)
        .from(Sled.state([1.0], [0.0]))
        .span(0.0..1.0)
        .running_cost("effort")
        .end_cost("miss")
        .solve()
        .expect("a minimum");
    assert!((best.cost() - 12.0 / 7.0).abs() < 1e-12);
    assert!((best.motion().last().q[0] - 3.0 / 7.0).abs() < 1e-12);
    assert!((best.input("u", 0.25).expect("an input") + 12.0 / 7.0 * 0.75).abs() < 1e-12);
    assert_eq!(
        best.iterations(),
        2,
        "a quadratic problem, and the look that it is solved"
    );
    // The multiplier of the state at the end is the derivative of the cost of the end.
    assert!((best.multipliers()[3].q[0] - 8.0 * 3.0 / 7.0).abs() < 1e-11);
    assert!(best.multipliers()[3].p[0].abs() < 1e-12);

    // A free initial state is where it costs nothing: here v = 1 throughout.
    let best = OptimalControl::of(&Sled)
        .elements(2)
        .start(Component::Coordinate(0), 0.0)
        .end(Component::Coordinate(0), 1.0)
        .span(0.0..1.0)
        .running_cost("effort")
        .solve()
        .expect("a minimum");
    assert!(best.cost().abs() < 1e-20 && (best.motion().states()[0].p[0] - 1.0).abs() < 1e-12);

    // The end costs by its velocity: ∫ u² + ½ v₁² from v = 1 gives u = −v₁/2 throughout, v₁ = 2/3, and the cost 1/9 +
    // 2/9.
    let best = OptimalControl::of(&Sled)
        .elements(2)
        .from(Sled.state([0.0], [1.0]))
        .span(0.0..1.0)
        .running_cost("effort")
        .end_cost("energy")
        .solve()
        .expect("a minimum");
    // ½ v₁² has the derivative v₁ = −2 u, thus u = −v₁/2 and v₁ = 1 − v₁/2.
    assert!((best.cost() - 1.0 / 3.0).abs() < 1e-12, "{}", best.cost());
}

#[test]
fn inputs_that_are_held_cost_more() {
    let with_degree = |degree| {
        let best = reach().elements(20).input_degree(degree).solve();
        best.expect("a minimum")
    };
    let (held, linear, full) = (with_degree(0), with_degree(1), with_degree(2));
    assert!(held.cost() > linear.cost() && linear.cost() > full.cost());
    assert!(held.cost() / full.cost() < 1.01);
    let (a, b) = (held.input("elbow", 0.301), held.input("elbow", 0.374));
    assert_eq!(a, b, "one element from 0.3 to 0.375");
    assert_ne!(a, held.input("elbow", 0.376));
}

#[test]
fn every_element_finds_the_same() {
    let known = 5.960635913;
    let elements: [(Element, f64); 7] = [
        (Mixed::<2>.into(), 1e-2),
        (Mixed::<5>.into(), 1e-7),
        (Primal::<4>.into(), 1e-4),
        (Primal::<4>.reduced(), 1e-4),
        (ThreeField::<4>.into(), 1e-4),
        (EnergyConserving::<4>.into(), 1e-4),
        (Radau::<4>.into(), 1e-4),
    ];
    for (element, error) in elements {
        let best = reach().element(element).elements(20).solve();
        let best = best.unwrap_or_else(|error| panic!("{element:?}: {error}"));
        assert!(
            (best.cost() / known - 1.0).abs() < error,
            "{element:?}: {}",
            best.cost()
        );
        let craft = transfer(&Spacecraft).element(element).elements(40).solve();
        let craft = craft.unwrap_or_else(|error| panic!("{element:?}: {error}"));
        assert!(
            (craft.cost() / 0.003745281275 - 1.0).abs() < error,
            "{element:?}: {}",
            craft.cost()
        );
    }
}

#[test]
fn graded_meshes_and_guesses_are_taken() {
    let best = swing_up()
        .graded((0..40).map(|e| 1.0 + f64::from(e) / 40.0))
        .guess(|t| ([t / 2.0, PI * t / 2.0], [0.5, PI / 2.0]))
        .guess_input("u", |t| if t < 1.0 { 1.0 } else { -1.0 })
        .tolerance(1e-9)
        .solve()
        .expect("a minimum");
    assert!(
        (best.cost() / 58.807667461 - 1.0).abs() < 1e-5,
        "{}",
        best.cost()
    );
    assert_eq!(best.motion().states().len(), 41);
}

/// The end of the span is a node, although 0.2 + (0.9 − 0.2) is less than it in floating-point arithmetic.
#[test]
fn motions_end_where_they_were_asked_to() {
    let best = OptimalControl::of(&Sled)
        .elements(4)
        .from_to(Sled.state([0.0], [0.0]), Sled.state([1.0], [0.0]), 0.2..0.9)
        .running_cost("effort")
        .solve()
        .expect("a minimum");
    let last = best.motion().at(0.9).expect("inside");
    assert!((last.q[0] - 1.0).abs() < 1e-13);
    let costates = best.multipliers();
    assert_eq!(costates[costates.len() - 1].t, 0.9);
}

#[test]
fn of_guesses_for_an_input_the_last_one_counts() {
    let best = OptimalControl::of(&Sled)
        .elements(4)
        .from(Sled.state([0.0], [0.0]))
        .to(Sled.state([1.0], [0.0]))
        .span(0.0..1.0)
        .running_cost("effort")
        .guess_input("u", |_| 1.0)
        .guess_input("u", |_| 2.0)
        .solve()
        .expect("a minimum");
    // ∫ 2² dt.
    assert!((best.history()[0].cost - 4.0).abs() < 1e-12);
}

#[dynamics(coordinates(x), lagrangian = dot(x)^2/2 - k/2*x^2, input(u), force(x) = u, output(effort) = u^2)]
struct Swing {
    k: f64,
}

/// Optima on elements that do not resolve the motion have a warning: a swing of ten periods on five elements, and on a
/// hundred, and the cart on forty.
#[test]
fn optima_that_the_elements_do_not_resolve_are_told() {
    let swing = Swing { k: 100.0 };
    let of = |elements: usize| {
        let best = OptimalControl::of(&swing).elements(elements);
        let (start, end) = (swing.state([0.0], [0.0]), swing.state([1.0], [0.0]));
        let best = best.from_to(start, end, 0.0..6.0).running_cost("effort");
        best.solve().expect("an optimum")
    };
    let (coarse, fine) = (of(5), of(100));
    assert_eq!(fine.warnings(), []);
    // By the controllability Gramian of x'' = −100 x + u: λᵀ y with W λ = y, y = (1, 0), W = ∫ Φ B Bᵀ Φᵀ dt.
    let (w, t) = (10.0_f64, 6.0_f64);
    let wqq = (t / 2.0 - (2.0 * w * t).sin() / (4.0 * w)) / (w * w);
    let wvv = t / 2.0 + (2.0 * w * t).sin() / (4.0 * w);
    let wqv = (1.0 - (2.0 * w * t).cos()) / (4.0 * w * w);
    let cost = wvv / (wqq * wvv - wqv * wqv);
    assert!(
        (fine.cost() / cost - 1.0).abs() <= 1e-4,
        "{} {cost}",
        fine.cost()
    );
    assert!(
        (coarse.cost() / cost - 1.0).abs() > 0.1,
        "{}",
        coarse.cost()
    );
    let [warning] = coarse.warnings() else {
        panic!("{:?}", coarse.warnings());
    };
    assert!(
        warning
            .to_string()
            .starts_with("5 elements do not resolve the motion")
    );
    let cart = swing_up().solve().expect("an optimum");
    assert_eq!(cart.warnings(), []);
}
