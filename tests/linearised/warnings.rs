//! The warnings of a run whose steps make the method unstable.

use crate::along::Inverted;
use crate::stiff::ElasticPendulum;
use tfe::prelude::*;
use tfe::{Rule, RunError, Warning};

#[dynamics(coordinates(x), lagrangian = dot(x)^2/2 - k/2*x^2, dissipation = c/2*dot(x)^2)]
struct Oscillator {
    k: f64,
    c: f64,
}

const UNIT: Oscillator = Oscillator { k: 1.0, c: 0.0 };

/// The warnings about stability: that long steps do not resolve the motion, stable or not, is another one.
fn of_stability(warnings: &[Warning]) -> Vec<Warning> {
    let is_unstable = |one: &&Warning| matches!(one, Warning::UnstableStep { .. });
    warnings.iter().filter(is_unstable).cloned().collect()
}

/// The warnings about stability of a run of a hundred steps from x = 1.
fn warnings(model: &Oscillator, element: impl Into<Element>, h: f64) -> Vec<Warning> {
    let motion = Simulation::new(model)
        .element(element)
        .step(h)
        .run(model.state([1.0], [0.0]), 0.0..100.0 * h)
        .expect("a linear model");
    of_stability(motion.warnings())
}

#[test]
fn the_oscillator_in_the_bubble() {
    // From stability_bubbles.json: √10 < ρ < √12, with the largest radius at 3.3112897574651194.
    let worst = 3.3112897574651194;
    let found = warnings(&UNIT, Primal::<3>, worst);
    let [
        Warning::UnstableStep {
            time,
            step,
            element,
            radius,
            exact,
        },
    ] = found[..]
    else {
        panic!("{found:?}")
    };
    assert_eq!((time, element, exact), (0.0, Element::primal(3), 1.0));
    // The span is a hundred steps up to rounding.
    assert!((step - worst).abs() < 1e-14);
    assert!((radius - 1.129817690854696).abs() < 1e-12, "{radius}");
    for rho in [3.163, 3.464, 7.75, 20.0] {
        assert_eq!(warnings(&UNIT, Primal::<3>, rho).len(), 1, "ρ = {rho}");
    }
    for rho in [0.01, 1.0, 3.0, 3.162, 3.4642, 5.0, 7.745] {
        assert_eq!(warnings(&UNIT, Primal::<3>, rho), [], "ρ = {rho}");
    }
}

#[test]
fn other_elements_have_other_bubbles_or_none() {
    // Two Lobatto points are the Störmer–Verlet method, stable below 2; two nodes: √12; four nodes: 3.1425 … √10.
    for (element, stable, unstable) in [
        (Element::primal(2).lobatto(), 1.99, 2.01),
        (Element::primal(2), 3.46, 3.47),
        (Element::primal(4), 3.1424, 3.15),
    ] {
        assert_eq!(warnings(&UNIT, element, stable), [], "{element}");
        assert_eq!(warnings(&UNIT, element, unstable).len(), 1, "{element}");
    }
    for rho in [2.5, 3.15, 3.3, 8.0, 100.0] {
        for element in [
            Element::mixed(3),
            Element::mixed(3).quadrature(5),
            Element::primal(3).reduced(),
            Element::energy_conserving(3),
            Element::radau(3),
            Element::radau(3).with_rule(Rule::Lobatto(3)),
        ] {
            assert_eq!(warnings(&UNIT, element, rho), [], "{element}, ρ = {rho}");
        }
    }
}

#[test]
fn damping_may_outweigh_the_bubble() {
    let damped = |c: f64| warnings(&Oscillator { k: 1.0, c }, Primal::<3>, 3.3);
    let found = damped(1e-3);
    let [Warning::UnstableStep { radius, exact, .. }] = found[..] else {
        panic!("{found:?}")
    };
    // e^{−ch/2}.
    assert!((exact - (-0.5e-3 * 3.3_f64).exp()).abs() < 1e-12 && radius > 1.1);
    assert_eq!(damped(1.0), []);
}

#[test]
fn backwards_in_time_too() {
    let run = |model: &Oscillator, h: f64| {
        let motion = Simulation::new(model)
            .element(Primal::<3>)
            .step(h)
            .run(model.state([1.0], [0.0]), 0.0..-20.0 * h)
            .expect("a linear model");
        of_stability(motion.warnings())
    };
    let found = run(&UNIT, 3.3);
    let [Warning::UnstableStep { step, radius, .. }] = found[..] else {
        panic!("{found:?}")
    };
    assert!(step < 0.0 && radius > 1.1);
    assert_eq!(run(&UNIT, 3.0), []);
    // What is damped forwards in time grows backwards: this is a property of the model, and there is no warning.
    let damped = Oscillator { k: 1.0, c: 0.2 };
    for h in [0.1, 1.0, 2.0] {
        assert_eq!(run(&damped, h), [], "h = {h}");
    }
}

#[test]
fn a_model_that_grows_itself_is_no_warning() {
    let model = Inverted {};
    for nodes in 2..=5 {
        for element in [Element::primal(nodes), Element::primal(nodes).lobatto()] {
            for h in [0.01, 0.1, 0.5] {
                let motion = Simulation::new(&model)
                    .element(element)
                    .step(h)
                    .run(model.state([1e-3], [0.0]), 0.0..20.0)
                    .expect("a fall");
                assert_eq!(motion.warnings(), [], "{element}, h = {h}");
            }
        }
    }
}

#[test]
fn the_stiff_mode_of_the_elastic_pendulum() {
    let model = ElasticPendulum { g: 1.0, k: 2500.0 };
    let start = model.state([1.0, 0.5], [0.0; 2]);
    let run = |element: Element, rho: f64| {
        let motion = Simulation::new(&model)
            .element(element)
            .step(rho / model.k.sqrt())
            .run(start, 0.0..2.0);
        motion.unwrap_or_else(RunError::into_partial)
    };
    let motion = run(Element::primal(3), 3.3);
    let Some(Warning::UnstableStep {
        time,
        radius,
        exact,
        ..
    }) = motion.warnings().first()
    else {
        panic!("no warning")
    };
    assert_eq!(*time, 0.0);
    assert!(*radius > 1.1 && *exact < 1.001, "{radius}, {exact}");
    assert_eq!(run(Element::primal(3), 3.0).warnings(), []);
    assert_eq!(run(Element::primal(3), 1.0).warnings(), []);
    assert_eq!(run(Element::mixed(3), 3.3).warnings(), []);
}

/// A hardening spring: H = ½p² + ½q² + ¼q⁴, ω² = 1 + 3q² for the linearised motion.
#[dynamics(coordinates(q), momenta(p), hamiltonian = p^2/2 + q^2/2 + q^4/4)]
struct Hardening {}

#[test]
fn several_in_a_row_are_one_warning() {
    // The stiffness grows from k = 1 by 10⁻³ per element: ρ² = 6.25 k passes 10 … 12 between elements 600 and 920.
    #[dynamics(coordinates(x), lagrangian = dot(x)^2/2 - (1 + t/2500)*x^2/2)]
    struct Stiffening {}
    let model = Stiffening {};
    let rest = model.state([0.0], [0.0]);
    let run = |span: std::ops::Range<f64>| {
        let motion = Simulation::new(&model)
            .element(Primal::<3>)
            .step(2.5)
            .run(rest, span)
            .expect("a rest");
        motion.warnings().to_vec()
    };
    // If checks begin at element 0, they are made at elements 512, 1024 and 2048, before and after the interval.
    assert_eq!(run(0.0..7000.0), []);
    // If they begin at element 620, those after 0, 1, 2, …, 128 further elements are inside, and the last is close to
    // the middle.
    let found = run(1550.0..2000.0);
    let [
        Warning::UnstableStep {
            time, step, radius, ..
        },
    ] = found[..]
    else {
        panic!("{found:?}")
    };
    assert_eq!((time, step), (1550.0, 2.5));
    // 1.1298 in the middle, 1.06 at the first check.
    assert!(radius > 1.125 && radius < 1.1299, "{radius}");
}

#[test]
fn apart_from_each_other_they_are_several() {
    // ρ² = 10.9 in elements 0 and 1 and from 16 on, and 6.25 in between.
    #[dynamics(coordinates(x), lagrangian = dot(x)^2/2 - select(t < 4, 1.75, select(t < 35, 1, 1.75))*x^2/2)]
    struct Switched {}
    let model = Switched {};
    let motion = Simulation::new(&model)
        .element(Primal::<3>)
        .step(2.5)
        .run(model.state([0.0], [0.0]), 0.0..250.0)
        .expect("a rest");
    let times: Vec<f64> = motion
        .warnings()
        .iter()
        .filter_map(|warning| match warning {
            Warning::UnstableStep { time, .. } => Some(*time),
            _ => None,
        })
        .collect();
    assert_eq!(times, [0.0, 40.0]);
}

#[test]
fn a_failed_run_says_what_was_noticed() {
    // The hardening spring is stable at rest (ρ = 3), and in an unstable interval or beyond at larger amplitudes.
    let model = Hardening {};
    let run = Simulation::new(&model)
        .element(Primal::<3>)
        .step(3.3)
        .max_iterations(8)
        // Otherwise steps that fail would be cut, and the run would end well.
        .solver(Solve::Trusting)
        .run(
            State {
                q: [1e-3],
                p: [0.0],
            },
            0.0..3300.0,
        );
    let error = run.expect_err("no eight iterations suffice once the motion is large");
    assert!(!error.partial().warnings().is_empty());
    let text = error.to_string();
    assert!(
        text.contains("unstable interval") && text.contains("t = 0"),
        "{text}"
    );
}

#[test]
fn a_warning_names_the_remedy() {
    let text = warnings(&UNIT, Primal::<3>, 3.3)[0].to_string();
    for part in [
        "t = 0",
        "3.3",
        "`Primal::<3>`",
        "1.129",
        "shorter step",
        "`Mixed::<3>`",
        "`Primal::<3>.reduced()`",
    ] {
        assert!(text.contains(part), "{part} is not in: {text}");
    }
}

#[test]
fn what_cannot_be_frozen_is_no_warning() {
    // ∂²L/∂v² = 3v² vanishes at rest.
    #[dynamics(coordinates(x), lagrangian = dot(x)^4/4 - x^2/2)]
    struct Degenerate {}
    let model = Degenerate {};
    let run = Simulation::new(&model)
        .element(Primal::<3>)
        .step(0.1)
        .run(model.state([1.0], [0.0]), 0.0..1.0);
    let motion = run.unwrap_or_else(RunError::into_partial);
    assert_eq!(motion.warnings(), []);
}
