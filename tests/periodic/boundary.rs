//! Boundary-value problems compared with closed forms, and assembled initial-value problems compared with steps.

use crate::models::{Duffing, HenonHeiles, Mathieu, PENDULUM, Projectile, agm};
use std::f64::consts::PI;
use tfe::AssemblyError;
use tfe::boundary::{BoundaryError, Component};
use tfe::prelude::*;

#[test]
fn a_projectile_between_two_points() {
    let projectile = Projectile { g: 9.81 };
    for element in [
        Element::mixed(3),
        Element::primal(3),
        Element::energy_conserving(3),
        Element::radau(4),
    ] {
        let arc = BoundaryValue::of(&projectile)
            .element(element)
            .elements(7)
            .from_to([1.0, 2.0], [13.0, -4.0], 0.5..2.0)
            .solve()
            .expect("an arc");
        // y = 2 + v (t − ½) − g (t − ½)²/2 with y(2) = −4.
        let (vx, vy) = (8.0, (-6.0 + 0.5 * 9.81 * 1.5 * 1.5) / 1.5);
        let start = arc.start();
        assert!((start.p[0] - vx).abs() < 1e-13 && (start.p[1] - vy).abs() < 1e-13);
        let motion = arc.motion();
        for k in 0..=30 {
            let s = 0.05 * f64::from(k);
            let node = motion.at(0.5 + s).expect("inside");
            let y = 2.0 + vy * s - 0.5 * 9.81 * s * s;
            assert!((node.q[0] - (1.0 + vx * s)).abs() < 1e-13 && (node.q[1] - y).abs() < 1e-13);
        }
        // A linear problem: the first correction is the solution, and the second one confirms it.
        assert!(arc.statistics().newton_iterations <= 3);
    }
}

/// The elliptic function sn(u, k) by descending Landen transformations.
fn sn(u: f64, k: f64) -> f64 {
    if k < 1e-9 {
        return u.sin();
    }
    let kc = (1.0 - k * k).sqrt();
    let k1 = (1.0 - kc) / (1.0 + kc);
    let s = sn(u / (1.0 + k1), k1);
    (1.0 + k1) * s / (1.0 + k1 * s * s)
}

/// The motion from rest at the bottom to the top would take an infinite time (heteroclinic orbit). To reach θ = π in a
/// finite time, an initial momentum is needed: p₀ = 2/k, and θ(t) = 2 asin sn(t/k, k) reaches π at t = k K(k).
#[test]
fn a_pendulum_swings_up() {
    let pendulum = PENDULUM;
    let k: f64 = 0.999;
    let time = k * PI / (2.0 * agm(1.0, (1.0 - k * k).sqrt()));
    let arc = BoundaryValue::of(&pendulum)
        .element(Mixed::<8>)
        .elements(30)
        .from_to([0.0], [PI], 0.0..time)
        .solve()
        .expect("a swing up");
    assert!((arc.start().p[0] - 2.0 / k).abs() < 1e-12);
    assert!((arc.end().p[0] - 2.0 / k * (1.0 - k * k).sqrt()).abs() < 1e-12);
    let motion = arc.motion();
    for part in 1..10 {
        let t = time * f64::from(part) / 10.0;
        let node = arc.nodes()[3 * part as usize];
        assert!((node.t - t).abs() < 1e-14);
        assert!((node.q[0] - 2.0 * sn(t / k, k).asin()).abs() < 1e-12);
        assert!((motion.at(t).expect("inside").q[0] - node.q[0]).abs() < 1e-10);
    }
    // Swinging back first is another solution of the same problem for a longer time; the guess determines which one is
    // found.
    let long = |guess: f64| {
        BoundaryValue::of(&pendulum)
            .element(Mixed::<6>)
            .elements(60)
            .from_to([0.0], [1.0], 0.0..7.0)
            .guess(move |t| ([guess * t.sin()], [guess * t.cos()]))
            .solve()
            .expect("a swing")
    };
    let (one, other) = (long(1.5), long(-1.5));
    assert!((one.start().p[0] - other.start().p[0]).abs() > 0.1);
    for arc in [&one, &other] {
        assert!((arc.end().q[0] - 1.0).abs() < 1e-13);
        let run = Simulation::new(&pendulum)
            .element(Mixed::<6>)
            .step(7.0 / 60.0)
            .run(arc.start(), 0.0..7.0)
            .expect("a run");
        assert!((run.last().q[0] - 1.0).abs() < 1e-12);
    }
}

/// Released from rest (p = 0) at an unknown angle, and at the bottom after a quarter period 1.8 > π/2.
#[test]
fn coordinates_and_momenta_mixed() {
    let pendulum = PENDULUM;
    let arc = BoundaryValue::of(&pendulum)
        .element(Mixed::<6>)
        .elements(40)
        .span(0.0..1.8)
        .start(Component::Momentum(0), 0.0)
        .end(Component::Coordinate(0), 0.0)
        .guess(|t| ([1.5 * (0.87 * t).cos()], [-1.3 * (0.87 * t).sin()]))
        .solve()
        .expect("a quarter of a swing");
    let amplitude = arc.start().q[0];
    // K(sin θ₀/2) = 1.8, by the arithmetic–geometric mean.
    let quarter = PI / (2.0 * agm(1.0, (0.5 * amplitude).cos()));
    assert!(amplitude > 0.5 && (quarter - 1.8).abs() < 1e-12);
}

#[test]
fn an_assembled_initial_value_problem_is_stepping() {
    let model = HenonHeiles { a: 1.0 };
    let start = tfe::State {
        q: [0.1, -0.2],
        p: [0.3, 0.15],
    };
    let duffing = Duffing {
        alpha: -1.0,
        beta: 1.0,
        delta: 0.1,
        f: 0.2,
        omega: 1.2,
    };
    let at = duffing.state([0.3], [-0.2]);
    for nodes in 2..=5 {
        for element in [
            Element::mixed(nodes),
            Element::mixed(nodes).quadrature(nodes),
            Element::primal(nodes),
            Element::primal(nodes).lobatto(),
            Element::energy_conserving(nodes),
            Element::radau(nodes),
        ] {
            let assembled = BoundaryValue::of(&model)
                .element(element)
                .elements(50)
                .initial(start, 0.0..10.0)
                .solve()
                .expect("a motion");
            let stepped = Simulation::new(&model)
                .element(element)
                .step(0.2)
                .run(start, 0.0..10.0)
                .expect("a run");
            assert_eq!(assembled.nodes().len(), stepped.states().len());
            for (one, other) in assembled.nodes().iter().zip(stepped.states()) {
                for a in 0..2 {
                    assert!((one.q[a] - other.q[a]).abs() < 5e-14, "{element:?}");
                    assert!((one.p[a] - other.p[a]).abs() < 5e-14, "{element:?}");
                }
            }
            let assembled = BoundaryValue::of(&duffing)
                .element(element)
                .elements(40)
                .initial(at, 1.0..9.0)
                .solve()
                .expect("a motion");
            let stepped = Simulation::new(&duffing)
                .element(element)
                .step(0.2)
                .run(at, 1.0..9.0)
                .expect("a run");
            assert!(
                (assembled.end().q[0] - stepped.last().q[0]).abs() < 5e-14,
                "{element:?}"
            );
            assert!(
                (assembled.end().p[0] - stepped.last().p[0]).abs() < 5e-14,
                "{element:?}"
            );
        }
    }
}

/// If weights and a number of elements are both given, the last call counts.
#[test]
fn a_number_of_elements_takes_the_place_of_weights() {
    let (projectile, pendulum) = (Projectile { g: 9.81 }, PENDULUM);
    for (weights, elements) in [([1.0, 2.0, 0.7], 10), ([1.0, 1.0, 1.0], 2)] {
        let arc = BoundaryValue::of(&projectile)
            .graded(weights)
            .elements(elements)
            .from_to([0.0, 0.0], [10.0, 0.0], 0.0..2.0)
            .solve()
            .expect("an arc");
        let nodes = arc.nodes();
        assert_eq!(nodes.len(), elements + 1);
        for pair in nodes.windows(2) {
            let length = pair[1].t - pair[0].t;
            assert!((length - 2.0 / elements as f64).abs() < 1e-14);
        }
        let rest = PeriodicOrbit::of(&pendulum)
            .graded(weights)
            .elements(elements)
            .period(1.0)
            .solve()
            .expect("rest");
        assert_eq!(rest.transitions().len(), elements);
    }
}

/// The motion reaches the end of its span to the last bit, forwards and backwards in time, although 0.2 + (0.9 − 0.2)
/// does not in floating-point arithmetic.
#[test]
fn motions_end_where_they_were_asked_to() {
    let projectile = Projectile { g: 9.81 };
    for (start, end) in [(0.2, 0.9), (0.9, 0.2), (0.8, 2.9), (-2.0, -0.6)] {
        let arc = BoundaryValue::of(&projectile)
            .elements(3)
            .from_to([0.0, 0.0], [1.0, 2.0], start..end)
            .solve()
            .expect("an arc");
        let (nodes, motion) = (arc.nodes(), arc.motion());
        assert_eq!((nodes[0].t, nodes[3].t), (start, end));
        let last = motion.at(end).expect("inside");
        assert_eq!((last.t, last.q), (end, arc.end().q));
        let free = 1.0 / (end - start);
        assert!((last.p[0] - free).abs() < 1e-13 * free.abs());
    }
}

/// All motions of an oscillator from 0 return after half a period, so that no motion ends elsewhere. The errors of
/// elements, 6e-5 (two nodes) to 7e-12 (four nodes, forty elements), allow solutions that end at 1 with amplitudes as
/// large as these errors are small: they must be refused. With six nodes, errors are rounding errors.
#[test]
fn conjugate_points_have_no_motion_between_them() {
    let oscillator = Mathieu { a: 1.0, q: 0.0 };
    let between = |element: Element, elements: usize, end: f64| {
        BoundaryValue::of(&oscillator)
            .element(element)
            .elements(elements)
            .from_to([0.0], [1.0], 0.0..end)
            .solve()
    };
    for (nodes, elements) in [(2, 200), (3, 12), (3, 60), (4, 8), (4, 40), (6, 40)] {
        let error = between(Element::mixed(nodes), elements, PI);
        assert!(
            matches!(
                error,
                Err(BoundaryError::Assembly(AssemblyError::Singular { .. }))
            ),
            "{nodes} nodes, {elements} elements: {:?}",
            error.map(|arc| arc.start())
        );
    }
    // At a nearby time amplitudes are large, and as accurate as elements are: 7e-12 relative to the distance of 1e-4
    // from half a period.
    let end = PI - 1e-4;
    let arc = between(Element::mixed(4), 40, end).expect("an arc");
    let off = arc.start().p[0] * end.sin() - 1.0;
    assert!(off.abs() < 3e-7, "{off:e}");
}

/// Within a short time momenta hardly move a body, and even less a heavy one: the solution has large momenta all the
/// same.
#[test]
fn a_projectile_in_a_short_time() {
    let projectile = Projectile { g: 9.81 };
    for time in [1e-12, 1e-16, 1e-30] {
        let arc = BoundaryValue::of(&projectile)
            .elements(7)
            .from_to([0.0, 1.0], [10.0, 3.0], 0.0..time)
            .solve()
            .unwrap_or_else(|error| panic!("{time:e}: {error}"));
        let State { p: [vx, vy], .. } = arc.start();
        // Compared with these, the weight is negligible.
        assert!((vx * time / 10.0 - 1.0).abs() < 1e-13, "{time:e}: {vx:e}");
        assert!((vy * time / 2.0 - 1.0).abs() < 1e-13, "{time:e}: {vy:e}");
    }
}

/// Elements that are too long give another solution: it has a warning, and those that are short enough have none.
#[test]
fn solutions_that_the_elements_do_not_resolve_are_told() {
    // x = A cos t + B sin t with x(0) = 0, x(T) = 1 has the momentum 1/sin T at the start.
    let oscillator = Mathieu { a: 1.0, q: 0.0 };
    let between = |end: f64| {
        let arc = BoundaryValue::of(&oscillator).from_to([0.0], [1.0], 0.0..end);
        arc.solve().expect("an arc")
    };
    for end in [1.0_f64, 10.0, 20.0, 100.0, 160.0, 1000.0] {
        let arc = between(end);
        let off = (arc.start().p[0] * end.sin() - 1.0).abs();
        let told = arc.warnings();
        assert!(off <= 0.03 || !told.is_empty(), "{end}: {off}");
        assert!(off > 1e-3 || told.is_empty(), "{end}: {off}, {told:?}");
    }
    let told = between(1000.0).warnings()[0].to_string();
    assert!(
        told.starts_with("40 elements do not resolve the motion"),
        "{told}"
    );
    // All conditions at the start: a run of a single element.
    let start = PENDULUM.state([2.0], [0.0]);
    let single = BoundaryValue::of(&PENDULUM).elements(1);
    let single = single.initial(start, 0.0..20.0).solve().expect("a motion");
    assert_eq!(single.warnings().len(), 1);
}
