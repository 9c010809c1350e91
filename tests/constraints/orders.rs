//! Orders 2(n − 1) in q and in p, with constraints on positions and on velocities.

use crate::common::{distance, larger, observed_order};
use crate::models::{
    Bead, BeadRates, KnifeEdge, MovingGround, MovingWire, ON_WIRE, QuaternionTop, RodPendulum,
    RodPendulumRates,
};
use tfe::prelude::*;

/// The states at t = ½, 1, 1½, 2 of a run with `divisor` steps in each half unit.
fn quarters<M: Model<N>, const N: usize>(
    model: &M,
    element: Element,
    start: State<N>,
    divisor: usize,
) -> Vec<Node<N>> {
    let motion = Simulation::new(model)
        .element(element)
        .step(0.5 / divisor as f64)
        .record_every(divisor)
        .run(start, 0.0..2.0)
        .unwrap_or_else(|error| panic!("{element}, {divisor} steps: {error}"));
    assert_eq!(motion.states().len(), 5);
    motion.states()[1..].to_vec()
}

/// The range of steps per half time unit in which the error is asymptotic and above rounding, for 2 to 5 nodes.
type Divisors = [[usize; 4]; 4];

/// For the rod and the bead, which fall: their errors are large.
const FAST: Divisors = [
    [80, 160, 320, 640],
    [20, 40, 80, 160],
    [14, 20, 28, 40],
    [12, 14, 17, 20],
];

/// For the others, since their errors reach rounding with larger steps.
const SLOW: Divisors = [
    [80, 160, 320, 640],
    [20, 40, 80, 160],
    [6, 8, 11, 16],
    [5, 6, 7, 8],
];

/// [`assert_falling`] for runs of a model.
#[track_caller]
fn assert_orders<M: Model<N>, const N: usize>(
    model: &M,
    start: State<N>,
    divisors: &Divisors,
    elements: fn(usize) -> Element,
) {
    let quarters = |element: Element, divisor: usize| quarters(model, element, start, divisor);
    assert_falling(divisors, elements, &quarters);
}

/// The largest error at four times falls with order 2(n − 1). At a single time, an error that happens to change its
/// sign could show any order.
#[track_caller]
fn assert_falling<const N: usize>(
    divisors: &Divisors,
    elements: fn(usize) -> Element,
    quarters: &dyn Fn(Element, usize) -> Vec<Node<N>>,
) {
    let exact = quarters(Element::mixed(8), 50);
    for nodes in 2..=5 {
        let element = elements(nodes);
        let claimed = element.order() as f64;
        assert_eq!(element.order(), 2 * (nodes - 1));
        let mut curves = [Vec::new(), Vec::new()];
        for divisor in divisors[nodes - 2] {
            let ends = quarters(element, divisor);
            let worst = |part: fn(&Node<N>) -> &[f64; N]| {
                ends.iter()
                    .zip(&exact)
                    .map(|(a, b)| distance(part(a), part(b)))
                    .fold(0.0, larger)
            };
            let h = 0.5 / divisor as f64;
            curves[0].push((h, worst(|node| &node.q)));
            curves[1].push((h, worst(|node| &node.p)));
        }
        for (what, points) in ["q", "p"].iter().zip(curves) {
            // Values are about 1, momenta up to 6: a few hundred rounding errors.
            let order = observed_order(&points, 1e-13, &format!("{element}, {what}"));
            assert!(
                (order - claimed).abs() <= 0.35,
                "{element}: order {order:.2} in {what}, claimed {claimed}: {points:?}"
            );
        }
    }
}

#[test]
fn the_rod() {
    let model = RodPendulum::UNIT;
    assert_orders(&model, model.horizontal(), &FAST, Element::mixed);
}

#[test]
fn the_rod_with_every_rule_of_the_primal_element() {
    let model = RodPendulum::UNIT;
    assert_orders(&model, model.horizontal(), &FAST, Element::primal);
    assert_orders(&model, model.horizontal(), &FAST, |n| {
        Element::primal(n).reduced()
    });
    assert_orders(&model, model.horizontal(), &FAST, |n| {
        Element::primal(n).lobatto()
    });
}

#[test]
fn the_rod_at_velocity_level() {
    let model = RodPendulumRates::UNIT;
    assert_orders(&model, model.horizontal(), &FAST, Element::mixed);
}

#[test]
fn the_bead() {
    let model = Bead { g: 9.81 };
    assert_orders(
        &model,
        model.state(ON_WIRE, [0.0; 2]),
        &FAST,
        Element::mixed,
    );
}

#[test]
fn the_bead_at_velocity_level() {
    let model = BeadRates { g: 9.81 };
    assert_orders(
        &model,
        model.state(ON_WIRE, [0.0; 2]),
        &FAST,
        Element::mixed,
    );
}

#[test]
fn the_bead_on_a_moving_wire() {
    let model = MovingWire { g: 2.0, c: 0.3 };
    // d/dt of x⁴/4 (1 + sin(t)/5) at t = 0, ẋ = 0.
    let start = model.state(ON_WIRE, [0.0, ON_WIRE[1] / 5.0]);
    assert_orders(&model, start, &SLOW, Element::mixed);
    assert_orders(&model, start, &SLOW, Element::primal);
}

#[test]
fn the_quaternion_top() {
    let model = QuaternionTop::TABLE;
    assert_orders(&model, model.tilted(), &SLOW, Element::mixed);
}

#[test]
fn the_knife_edge() {
    let model = KnifeEdge::TABLE;
    assert_orders(&model, model.turning(3.0), &SLOW, Element::mixed);
    assert_orders(&model, model.turning(3.0), &SLOW, |n| {
        Element::primal(n).reduced()
    });
}

#[test]
fn the_blade_on_moving_ground() {
    let model = MovingGround { c: 0.2 };
    // At t = 0 and x = 0: ẋ sin φ = ẏ cos φ.
    let heading = 0.4_f64;
    let start = model.state([0.0, 0.0, heading], [heading.cos(), heading.sin(), 2.0]);
    assert_orders(&model, start, &SLOW, Element::mixed);
}
