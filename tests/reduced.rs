//! Models made from models: motions against closed forms, against models declared by hand, and against the original.

mod common;

use common::{distance, observed_order};
use tfe::prelude::*;

/// A mathematical pendulum.
#[dynamics(
    coordinates(theta),
    lagrangian = m/2*l^2*dot(theta)^2 + m*g*l*cos(theta),
    output(height) = -l*cos(theta),
    model(Linear, truncated(2)),
    model(Cubic, truncated(4)),
)]
#[derive(Clone, Debug, PartialEq)]
struct Pendulum {
    /// Mass.
    m: f64,
    l: f64,
    g: f64,
}

/// A mass on a spring.
#[dynamics(
    coordinates(r, theta),
    lagrangian = m/2*(dot(r)^2 + r^2*dot(theta)^2) + m*g*r*cos(theta) - k/2*(r - l)^2,
    output(height) = -r*cos(theta),
    model(Rod, frozen(r = l)),
)]
struct SpringPendulum {
    m: f64,
    l: f64,
    g: f64,
    k: f64,
}

const PENDULUM: Pendulum = Pendulum {
    m: 1.3,
    l: 0.8,
    g: 9.81,
};

/// The state at the end of a run of nine nodes, which leave rounding only.
fn end<M: Model<N>, const N: usize>(model: &M, start: State<N>, span: f64, steps: u32) -> State<N>
where
    M: Sync,
{
    let step = span / f64::from(steps);
    let simulation = Simulation::new(model).element(Mixed::<9>).step(step);
    let motion = simulation.run(start, 0.0..span).expect("a smooth motion");
    let last = motion.last();
    State {
        q: last.q,
        p: last.p,
    }
}

#[test]
fn fields_and_derives_are_those_of_the_original() {
    let linear = Linear::of(&PENDULUM);
    assert_eq!(
        linear.clone(),
        Linear {
            m: 1.3,
            l: 0.8,
            g: 9.81
        }
    );
    assert!(format!("{linear:?}").starts_with("Linear { m"));
    // Outputs are not truncated.
    assert_eq!(
        linear.height(0.0, [1.0], [0.0]),
        PENDULUM.height(0.0, [1.0], [0.0])
    );
    let spring = SpringPendulum {
        m: 1.3,
        l: 0.8,
        g: 9.81,
        k: 1e4,
    };
    let Rod { m, l, g } = Rod::of(&spring);
    assert_eq!([m, l, g], [1.3, 0.8, 9.81]);
}

#[test]
fn the_linear_pendulum_is_harmonic() {
    let linear = Linear::of(&PENDULUM);
    let omega = (PENDULUM.g / PENDULUM.l).sqrt();
    let start = linear.state([0.9], [0.4]);
    let period = 2.0 * std::f64::consts::PI / omega;
    // A hundred operations a period in each of 16 steps, on numbers of size one.
    let whole = end(&linear, start, period, 16);
    assert!(distance(&whole.q, &[0.9]) < 1e-13, "{:?}", whole.q);
    let third = end(&linear, start, period / 3.0, 8);
    let phase = 2.0 * std::f64::consts::PI / 3.0;
    let expected = 0.9 * phase.cos() + 0.4 / omega * phase.sin();
    assert!((third.q[0] - expected).abs() < 1e-14, "{:?}", third.q);
}

#[test]
fn structure_tells_what_became_simpler() {
    let (linear, full) = (Linear::structure(), Pendulum::structure());
    assert!(linear.facts.linear && !full.facts.linear);
    assert_eq!((linear.first.sines, full.first.sines), (0, 1));
    let total = |o: tfe::runtime::structure::Operations| {
        o.additions + o.multiplications + o.divisions + o.sines + o.functions
    };
    assert!(total(linear.second) < total(full.second));
    assert!(linear.page.contains("Pendulum: truncated to degree 2"));
    assert_eq!(linear.name, "Linear");
}

#[test]
fn the_cubic_pendulum_errs_by_the_fourth_power_of_the_amplitude() {
    let cubic = Cubic::of(&PENDULUM);
    let relative = |amplitude: f64| {
        let ends = (
            end(&cubic, cubic.state([amplitude], [0.0]), 3.0, 60),
            end(&PENDULUM, PENDULUM.state([amplitude], [0.0]), 3.0, 60),
        );
        (amplitude, distance(&ends.0.q, &ends.1.q) / amplitude)
    };
    let points = [0.4, 0.2, 0.1, 0.05].map(relative);
    let order = observed_order(&points, 1e-11, "cubic against full");
    assert!((order - 4.0).abs() < 0.1, "{order} {points:?}");
}

#[test]
fn a_frozen_spring_is_a_rod() {
    let spring = SpringPendulum {
        m: 1.3,
        l: 0.8,
        g: 9.81,
        k: 1e4,
    };
    let rod = Rod::of(&spring);
    let one = end(&rod, rod.state([1.1], [0.3]), 5.0, 50);
    let other = end(&PENDULUM, PENDULUM.state([1.1], [0.3]), 5.0, 50);
    assert!(distance(&one.q, &other.q) < 1e-14, "{one:?} {other:?}");
    assert!(distance(&one.p, &other.p) < 1e-14, "{one:?} {other:?}");
    assert_eq!(
        rod.height(0.0, [0.5], [0.0]),
        PENDULUM.height(0.0, [0.5], [0.0])
    );
}
