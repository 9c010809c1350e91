//! Derivatives of runs whose steps are cut at kinks and jumps of forces, the times of which change (T-167).

use crate::differences::difference_over;
use crate::largest::larger;
use tfe::continuation::BranchWarning;
use tfe::nalgebra::{Complex, DMatrix};
use tfe::prelude::*;
use tfe::runtime::{Family, Rule};
use tfe::sensitivity::Loss;
use tfe::{MeshWarning, Warning};

#[dynamics(coordinates(x), lagrangian = dot(x)^2/2 - g*abs(x), output(place) = x)]
#[derive(Clone)]
struct Valley {
    g: f64,
}

const VALLEY: Valley = Valley { g: 1.3 };

/// From x₀ > 0 at rest, the motion crosses x = 0 at s = √(2 x₀/g) and is x = −g s τ + g τ²/2 at τ = t − s < 2 s.
#[test]
fn derivatives_across_a_jump_are_those_of_the_closed_form() {
    let (g, x0, t) = (VALLEY.g, 0.6, 2.0);
    let s = (2.0 * x0 / g).sqrt();
    let (s_x, s_g, tau) = (s / (2.0 * x0), -s / (2.0 * g), t - s);
    let by_s = g * s - 2.0 * g * tau;
    let (of_x, of_g) = (by_s * s_x, by_s * s_g - s * tau + tau * tau / 2.0);
    let start = VALLEY.state([x0], [0.0]);
    for element in ELEMENTS {
        let run = Simulation::new(&VALLEY)
            .element(element)
            .step(0.3)
            .at_kinks(true);
        let close = |found: f64, exact: f64, name: &str| {
            let off = (found - exact).abs();
            // Elements with points at their ends stop four roundings of the time before the kink.
            assert!(off <= 1e-13, "{element} {name}: {found} {exact}");
        };
        let sensitive = run.run_sensitive(start, 0.0..t).expect("derivatives");
        close(sensitive.by("g").last().q[0], of_g, "by g");
        close(sensitive.by_start().last()[(1, 1)], of_x, "by the start");
        let linearised = run.run_linearised(start, 0.0..t).expect("matrices");
        close(linearised.product()[(1, 1)], of_x, "matrix");
        let loss = Loss::output_at_end("place");
        let (_, gradient) = run.gradient(start, 0.0..t, &loss).expect("a gradient");
        close(gradient.by("g"), of_g, "gradient");
        close(gradient.by_start().q[0], of_x, "gradient by the start");
    }
}

const ELEMENTS: [Element; 5] = [
    Element::mixed(4),
    Element::primal(3),
    Element::radau(4),
    Element::mixed(2),
    Element::mixed(6),
];

/// Derivatives without the change of the time of a jump are wrong: steps are cut there unless that is refused.
#[test]
fn steps_are_cut_at_kinks_by_default() {
    let start = VALLEY.state([0.6], [0.0]);
    let by_g = |run: Simulation<'_, Valley, 1>, is_across: bool| {
        let run = run.step(0.3);
        let sensitive = run.run_sensitive(start, 0.0..2.0);
        let loss = Loss::output_at_end("place");
        let (_, gradient) = run.gradient(start, 0.0..2.0, &loss).expect("a gradient");
        let sensitive = sensitive.expect("derivatives");
        let found = sensitive.by("g").last().q[0];
        let is_told = |motion: &Motion<1>| motion.warnings().contains(&Warning::KinksCrossed);
        let are_told = [sensitive.motion(), gradient.motion()].map(is_told);
        assert_eq!(are_told, [is_across; 2]);
        assert!((gradient.by("g") - found).abs() <= 1e-13);
        found
    };
    let cut = by_g(Simulation::new(&VALLEY).at_kinks(true), false);
    assert_eq!(by_g(Simulation::new(&VALLEY), false), cut);
    assert!((by_g(Simulation::new(&VALLEY).at_kinks(false), true) - cut).abs() > 0.1);
}

/// Two coordinates with a gap, a jump of a force by place and time, and dry friction; velocities depend on both.
#[dynamics(
    coordinates(x, y),
    lagrangian = (1 + y^2/4)/2*dot(x)^2 + dot(y)^2/2 - k/2*(x^2 + y^2) - s/2*max(x - gap, 0)^2
        + b*abs(y - x/2 - a*sin(2*t)),
    force(x) = -f*sign(dot(x) - c*y),
    output(effort) = x*dot(y) + y^2,
    event(level) = y - level,
)]
#[derive(Clone)]
pub struct Rattle {
    k: f64,
    s: f64,
    gap: f64,
    b: f64,
    a: f64,
    f: f64,
    c: f64,
    level: f64,
}

const RATTLE: Rattle = Rattle {
    k: 3.0,
    s: 40.0,
    gap: 0.35,
    b: 0.4,
    a: 0.3,
    f: 0.2,
    c: 0.3,
    level: 0.25,
};
const NAMES: [&str; 7] = ["k", "s", "gap", "b", "a", "f", "c"];
const START: ([f64; 2], [f64; 2]) = ([0.5, -0.2], [0.3, 0.9]);
const SPAN: f64 = 3.0;

impl Rattle {
    /// With a force that pulls towards the line where it jumps.
    pub fn with_valley() -> Self {
        Self { b: -0.4, ..RATTLE }
    }

    fn with(name: &str, value: f64) -> Self {
        let mut model = RATTLE;
        *match name {
            "k" => &mut model.k,
            "s" => &mut model.s,
            "gap" => &mut model.gap,
            "b" => &mut model.b,
            "a" => &mut model.a,
            "f" => &mut model.f,
            "c" => &mut model.c,
            _ => &mut model.level,
        } = value;
        model
    }

    fn value(name: &str) -> f64 {
        let Rattle {
            k,
            s,
            gap,
            b,
            a,
            f,
            c,
            level,
        } = RATTLE;
        match name {
            "k" => k,
            "s" => s,
            "gap" => gap,
            "b" => b,
            "a" => a,
            "f" => f,
            "c" => c,
            _ => level,
        }
    }
}

fn run(model: &Rattle, element: Element) -> Simulation<'_, Rattle, 2> {
    Simulation::new(model)
        .element(element)
        .step(0.1)
        .at_kinks(true)
}

/// Spacing of differences of eighth order: a few kinks cross nodes of the grid, where the motion has steps of the size of
/// the errors of elements, if it is longer.
const DISTANCE: f64 = 1e-4;

/// What is differentiated: the end, a state between nodes, and a sum.
fn numbers(end: &Node<2>, inside: &Node<2>, sum: f64) -> [f64; 8] {
    let ([x, y], [p, r], [a, b]) = (end.q, end.p, inside.q);
    [x, y, p, r, a, b, inside.v[0], sum]
}

/// Derivatives by parameters at the end, between the nodes, and of integrals, beside differences of whole runs.
#[test]
fn derivatives_across_kinks_are_those_of_the_run() {
    let between = 1.234;
    let losses = || Loss::integral("effort").and(Loss::output_at_end("effort"));
    for element in [
        Element::mixed(4),
        Element::mixed(3),
        Element::radau(4),
        Primal::<4>.lobatto(),
    ] {
        let start = RATTLE.state(START.0, START.1);
        let simulation = run(&RATTLE, element);
        let sensitive = simulation
            .run_sensitive(start, 0.0..SPAN)
            .expect("derivatives");
        let kinks = sensitive.motion().statistics().kinks;
        assert!(kinks >= 5, "{element}: {kinks}");
        let (_, gradient) = simulation
            .gradient(start, 0.0..SPAN, &losses())
            .expect("a gradient");
        // Elements with points at their ends take many trials to a kink.
        let names = match element.rule() {
            Rule::Gauss(_) if element.family() != Family::Radau => &NAMES[..],
            _ => &["gap", "f"],
        };
        for &name in names {
            let at = |value: f64| {
                let model = Rattle::with(name, value);
                let motion = run(&model, element).run(model.state(START.0, START.1), 0.0..SPAN);
                let motion = motion.expect("runs");
                let (end, inside) = (motion.last(), motion.at(between).expect("inside"));
                let integrals = motion.integral(&model, "effort").expect("an integral");
                let sum = integrals[integrals.len() - 1] + end.q[0] * end.v[1] + end.q[1].powi(2);
                numbers(end, &inside, sum)
            };
            let exact = difference_over(DISTANCE, at, Rattle::value(name));
            let by = sensitive.by(name);
            let (end, inside) = (by.last(), by.at(between).expect("inside"));
            let found = numbers(&end, &inside, gradient.by(name));
            let most = exact.iter().fold(1.0, |most, one| larger(most, one.abs()));
            for (at, (found, exact)) in found.iter().zip(&exact).enumerate() {
                let off = (found - exact).abs() / most;
                assert!(
                    off <= 1e-9,
                    "{element} {name} {at}: {found} {exact} {off:.1e}"
                );
            }
        }
    }
}

fn bounced(model: &Rattle) -> Simulation<'_, Rattle, 2> {
    run(model, Element::mixed(4)).on("level", Crossing::Either, |event| {
        Act::Restart(event.state_with_velocity([0.9 * event.v[0], -0.8 * event.v[1]]))
    })
}

/// Events happen between kinks, and kinks between events.
#[test]
fn derivatives_across_kinks_and_events_are_those_of_the_run() {
    let start = RATTLE.state(START.0, START.1);
    let sensitive = bounced(&RATTLE).run_sensitive(start, 0.0..SPAN);
    let sensitive = sensitive.expect("derivatives");
    let motion = sensitive.motion();
    let counts = (motion.events().len(), motion.statistics().kinks);
    assert!(counts.0 >= 1 && counts.1 >= 4, "{counts:?}");
    for name in ["k", "gap", "b", "f", "level"] {
        let value = Rattle::value(name);
        let numbers = |value: f64| {
            let model = Rattle::with(name, value);
            let motion = bounced(&model).run(model.state(START.0, START.1), 0.0..SPAN);
            let node = *motion.expect("runs").last();
            [node.q[0], node.q[1], node.p[0], node.p[1]]
        };
        let exact = difference_over(DISTANCE, numbers, value);
        let found = sensitive.by(name).last();
        let found = [found.q[0], found.q[1], found.p[0], found.p[1]];
        let most = exact.iter().fold(1.0, |most, one| larger(most, one.abs()));
        for (found, exact) in found.iter().zip(&exact) {
            let off = (found - exact).abs() / most;
            assert!(off <= 1e-9, "{name}: {found} {exact} {off:.1e}");
        }
    }
}

/// Products of matrices across kinks of a conservative model are symplectic, and those of a section have determinant one.
#[test]
fn matrices_across_kinks_are_symplectic() {
    let model = Rattle {
        f: 0.0,
        a: 0.0,
        ..RATTLE
    };
    let start = model.state(START.0, START.1);
    let linearised = run(&model, Element::mixed(4)).run_linearised(start, 0.0..SPAN);
    let linearised = linearised.expect("matrices");
    assert!(linearised.motion().statistics().kinks >= 4);
    let a = linearised.product();
    let j = DMatrix::from_fn(4, 4, |row, column| match (row, column) {
        (row, column) if row + 2 == column => 1.0,
        (row, column) if row == column + 2 => -1.0,
        _ => 0.0,
    });
    let off = (a.transpose() * &j * &a - &j).amax() / a.amax().powi(2);
    assert!(off <= 1e-9, "{off:.1e}");
}

/// At points of a section that lies on the kink, speeds are those of the start; the time between them grows with the speed.
#[test]
fn sections_on_a_kink_have_matrices() {
    let start = VALLEY.state([0.6], [0.0]);
    let run = Simulation::new(&VALLEY).step(0.1).at_kinks(true);
    let section = run
        .section("place", Crossing::Either, start, 0.0)
        .linearised();
    for (number, point) in section.take(6).enumerate() {
        let point = point.expect("a point");
        let matrix = point.transition().expect("a matrix");
        let speed = (2.0 * VALLEY.g * 0.6_f64).sqrt();
        // From the start the speed grows with the place, v² = 2 g x₀; at all points x = 0.
        let found = match number {
            0 => matrix[(0, 1)].abs() - VALLEY.g / speed,
            _ => matrix[(0, 0)] + 1.0,
        };
        let stays = matrix[(1, 0)].abs().max(matrix[(1, 1)].abs());
        assert!(found.abs() <= 1e-12 && stays <= 1e-12, "{number}: {matrix}");
    }
}

/// A pendulum, by its angle and by two coordinates with a rod, against a spring beside it.
#[dynamics(
    coordinates(angle),
    lagrangian = dot(angle)^2/2 + g*cos(angle) - k/2*max(sin(angle) - a, 0)^2 - f*abs(sin(angle)),
)]
struct Angle {
    g: f64,
    k: f64,
    a: f64,
    f: f64,
}

#[dynamics(
    coordinates(x, y),
    lagrangian = (dot(x)^2 + dot(y)^2)/2 - g*y - k/2*max(x - a, 0)^2 - f*abs(x),
    constraint(rod) = x^2 + y^2 - 1,
)]
struct Rod {
    g: f64,
    k: f64,
    a: f64,
    f: f64,
}

/// The same motion by H, with a kink in the momentum: its velocity is not the momentum.
#[dynamics(
    coordinates(x),
    momenta(p),
    hamiltonian = p^2/2 + c/2*abs(p)*p + k/2*x^2 - a*abs(x - b),
)]
struct Fast {
    c: f64,
    k: f64,
    a: f64,
    b: f64,
}

#[test]
fn derivatives_across_kinks_with_constraints_are_those_of_the_angle() {
    let (g, k, a, f) = (9.81, 300.0, 0.3, 0.7);
    let (angle, rod) = (Angle { g, k, a, f }, Rod { g, k, a, f });
    let (theta, omega) = (-0.8_f64, 1.0);
    let of_angle = Simulation::new(&angle)
        .element(Element::mixed(6))
        .step(0.02)
        .at_kinks(true);
    let of_rod = Simulation::new(&rod)
        .element(Element::mixed(6))
        .step(0.02)
        .at_kinks(true);
    let by_angle = of_angle.run_sensitive(angle.state([theta], [omega]), 0.0..2.0);
    let start = rod.state(
        [theta.sin(), -theta.cos()],
        [omega * theta.cos(), omega * theta.sin()],
    );
    let (by_angle, by_rod) = (
        by_angle.expect("derivatives"),
        of_rod.run_sensitive(start, 0.0..2.0).expect("derivatives"),
    );
    assert!(by_rod.motion().statistics().kinks >= 6);
    let theta = by_angle.motion().last().q[0];
    for name in ["g", "k", "a", "f"] {
        let (one, other) = (by_angle.by(name).last().q[0], by_rod.by(name).last().q);
        let scale = by_angle.by("a").last().q[0].abs();
        for (found, exact) in other.iter().zip([theta.cos() * one, theta.sin() * one]) {
            // The errors of the elements, of order 10 and 9.
            assert!(
                (found - exact).abs() <= 1e-9 * scale,
                "{name}: {found} {exact}"
            );
        }
    }
}

#[test]
fn derivatives_across_kinks_of_a_hamiltonian_are_those_of_the_run() {
    let fast = |c, b| Fast {
        c,
        k: 2.0,
        a: 0.3,
        b,
    };
    let run = |model: &Fast| {
        let run = Simulation::new(model)
            .element(Element::mixed(4))
            .step(0.1)
            .at_kinks(true);
        let sensitive = run.run_sensitive(State { q: [0.7], p: [0.4] }, 0.0..6.0);
        sensitive.expect("derivatives")
    };
    let model = fast(0.3, 0.2);
    let sensitive = run(&model);
    assert!(sensitive.motion().statistics().kinks >= 4);
    let end = |model: &Fast| {
        let motion = Simulation::new(model)
            .element(Element::mixed(4))
            .step(0.1)
            .at_kinks(true);
        let motion = motion.run(State { q: [0.7], p: [0.4] }, 0.0..6.0);
        let node = *motion.expect("runs").last();
        [node.q[0], node.p[0]]
    };
    let by_c = difference_over(DISTANCE, |c| end(&fast(c, 0.2)), 0.3);
    let by_b = difference_over(DISTANCE, |b| end(&fast(0.3, b)), 0.2);
    for (name, exact) in [("c", by_c), ("b", by_b)] {
        let found = sensitive.by(name).last();
        let off = larger((found.q[0] - exact[0]).abs(), (found.p[0] - exact[1]).abs());
        assert!(off <= 1e-9, "{name}: {off:.1e}");
    }
}

/// An oscillator with a stop and dry friction that is driven so that it never sticks.
#[dynamics(
    coordinates(x),
    lagrangian = dot(x)^2/2 - k/2*x^2 - s/2*max(x - gap, 0)^2 + a*x*cos(w*t),
    force(x) = -c*dot(x) - f*sign(dot(x)),
    output(place) = x,
)]
struct Driven {
    k: f64,
    s: f64,
    gap: f64,
    a: f64,
    w: f64,
    c: f64,
    f: f64,
}

const DRIVEN: Driven = Driven {
    k: 1.0,
    s: 5.0,
    gap: 0.2,
    a: 0.8,
    w: 1.1,
    c: 0.15,
    f: 0.05,
};

/// Multipliers of an orbit with dry friction: trace and determinant are those of differences of the motion over a period.
#[test]
fn multipliers_of_an_orbit_with_dry_friction_are_those_of_its_motion() {
    let period = std::f64::consts::TAU / DRIVEN.w;
    let simulation = Simulation::new(&DRIVEN).step(period / 40.0).at_kinks(true);
    let orbit = PeriodicOrbit::of_simulation(&simulation).period(period);
    let orbit = orbit
        .guess_from(DRIVEN.state([0.5], [0.1]))
        .solve()
        .expect("an orbit");
    let start = orbit.start();
    let end = |q: f64, p: f64| {
        let motion = simulation
            .run(State { q: [q], p: [p] }, 0.0..period)
            .expect("runs");
        [motion.last().q[0], motion.last().p[0]]
    };
    let by_q = difference_over(DISTANCE, |q| end(q, start.p[0]), start.q[0]);
    let by_p = difference_over(DISTANCE, |p| end(start.q[0], p), start.p[0]);
    let [one, other] = orbit.multipliers() else {
        panic!("two multipliers");
    };
    let (trace, product) = (one.re + other.re, (one * other).re);
    assert!(
        (trace - by_q[0] - by_p[1]).abs() <= 1e-9,
        "{trace} {by_q:?} {by_p:?}"
    );
    let determinant = by_q[0] * by_p[1] - by_q[1] * by_p[0];
    assert!(
        (product - determinant).abs() <= 1e-9,
        "{product} {determinant}"
    );
    // Friction contracts more than the damper alone.
    let of_damper = (-DRIVEN.c * period).exp();
    assert!(product < of_damper - 0.05);
    // Elements of an assembled orbit do not end at kinks, and it has the product of the damper: this is told.
    let across = PeriodicOrbit::of(&DRIVEN).period(period).guess_from(start);
    let across = across.elements(400).solve().expect("an orbit");
    let product: Complex<f64> = across.multipliers().iter().product();
    assert!((product.re - of_damper).abs() <= 1e-9);
    let is_told = |one: &MeshWarning| matches!(one, MeshWarning::KinksCrossed { .. });
    assert!(across.warnings().iter().any(is_told));
    assert!(
        across
            .to_string()
            .contains("`PeriodicOrbit::of_simulation(&simulation)`")
    );
}

/// A driven oscillator with a stop.
#[dynamics(
    coordinates(x),
    lagrangian = dot(x)^2/2 - x^2/2 - s/2*max(x - gap, 0)^2 + a*x*cos(w*t),
    force(x) = -c*dot(x),
    sensitivity(a),
)]
#[derive(Clone)]
struct Stop {
    s: f64,
    gap: f64,
    a: f64,
    w: f64,
    c: f64,
}

/// Below the amplitude at which the stop is met, which is known in closed form, the motion is linear.
#[test]
fn branches_across_kinks_have_a_warning_where_they_begin() {
    let stop = Stop {
        s: 5.0,
        gap: 0.2,
        a: 0.05,
        w: 1.3,
        c: 0.15,
    };
    let branch = |range| {
        let branch = Continuation::of(&stop).parameter(|stop| &mut stop.a);
        let branch = branch.range(range).elements(60);
        let branch = branch.period(|stop| std::f64::consts::TAU / stop.w);
        branch.run().expect("a branch")
    };
    let met = stop.gap * (1.0 - stop.w * stop.w).hypot(stop.c * stop.w);
    assert!(branch(0.05..0.99 * met).warnings().is_empty());
    let across = branch(0.05..2.0 * met);
    let Some(BranchWarning::KinksCrossed { point, time, .. }) = across.warnings().first() else {
        panic!("{:?}", across.warnings());
    };
    // Between two nodes the motion exceeds the values there by 1/cos(π/60) at most.
    assert!(across.points()[*point].parameter > met);
    assert!(across.points()[point - 1].parameter <= 1.0015 * met);
    let orbit = across.orbit(*point).expect("an orbit");
    let place = |t: f64| orbit.motion().at(t).expect("inside").q[0] - stop.gap;
    assert!(place(*time) * place(time + orbit.period() / 60.0) < 0.0);
    let told = across.warnings()[0].to_string();
    assert!(
        told.contains("a kink or a jump inside an element"),
        "{told}"
    );
}

/// At one of two ends the stop is met; the velocity keeps its sign, which dry friction has a jump at.
#[test]
fn boundary_values_across_kinks_have_a_warning() {
    let between = |from: f64, to: f64| {
        let motion = BoundaryValue::of(&DRIVEN).elements(20);
        let motion = motion.from_to([from], [to], 0.0..0.4);
        motion.solve().expect("a motion")
    };
    assert_eq!(between(-0.3, 0.1).warnings(), []);
    let across = between(-0.3, 0.5);
    let [MeshWarning::KinksCrossed { time }] = across.warnings() else {
        panic!("{:?}", across.warnings());
    };
    let place = |t: f64| across.motion().at(t).expect("inside").q[0] - DRIVEN.gap;
    assert!(place(*time) < 0.0 && place(time + 0.02) > 0.0);
}
