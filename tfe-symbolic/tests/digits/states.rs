//! States at which rounding hurts: equal and nearly equal inputs, large offsets, small numbers, parameters of very different sizes.

use super::formula::State;
use super::random::Random;
use super::writer::Model;

/// At how many states of a regime kernels run.
const STATES: usize = 8;

/// At how many more the rounding of the formula is looked at, where a kernel is worse than at the others.
const FURTHER: usize = 24;

/// So many states with equal inputs have exactly equal ones.
const EXACT: usize = 2;

/// States of one kind and one scale.
pub struct Regime {
    pub name: String,
    pub states: Vec<State>,
    pub further: Vec<State>,
}

/// A vector in which all inputs are alike.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Spread {
    /// ±(1/2 … 2) S
    Generic,
    /// Equal, and in most states equal but for some ulps.
    Equal,
    /// S u (1 + δ r), with u of the state and r of the input.
    Near(f64),
    /// As before, but every other one of the other sign; for δ = 0 equal but for some ulps.
    Opposite(f64),
}

/// A vector of a scale S.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Shape {
    spread: Spread,
    scale: f64,
}

const GENERIC: Shape = Shape {
    spread: Spread::Generic,
    scale: 1.0,
};

/// The shapes of coordinates, velocities and parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Plan {
    q: Shape,
    z: Shape,
    parameters: Shape,
    /// The same u for coordinates and parameters.
    tied: bool,
    time: f64,
}

const PLAIN: Plan = Plan {
    q: GENERIC,
    z: GENERIC,
    parameters: GENERIC,
    tied: false,
    time: 1.0,
};

const fn shape(spread: Spread, scale: f64) -> Shape {
    Shape { spread, scale }
}

/// The number of ulps that nearly equal inputs are apart, at most.
const ULPS: f64 = 4.0;

fn vector(random: &mut Random, shape: Shape, length: usize, base: f64, exact: bool) -> Vec<f64> {
    let Shape { spread, scale } = shape;
    let center = scale * base;
    let mut entry = |at: usize| match spread {
        Spread::Generic => scale * random.signed(0.5, 2.0),
        Spread::Equal if exact => center,
        Spread::Equal => center * (1.0 + random.signed(0.5, ULPS) * f64::EPSILON),
        Spread::Near(delta) => center * (1.0 + delta * random.signed(0.5, 1.0)),
        Spread::Opposite(delta) => {
            let delta = if delta == 0.0 && !exact {
                ULPS * f64::EPSILON
            } else {
                delta
            };
            let sign = if at.is_multiple_of(2) { 1.0 } else { -1.0 };
            sign * center * (1.0 + delta * random.signed(0.5, 1.0))
        }
    };
    (0..length).map(&mut entry).collect()
}

fn state(random: &mut Random, plan: Plan, model: &Model, number: usize) -> State {
    let exact = number < EXACT;
    // Less than an octave, so that powers of all states are of one size.
    let base = random.between(0.8, 1.25);
    let own = |random: &mut Random| random.between(0.8, 1.25);
    let (z_base, parameter_base) = (own(random), own(random));
    let parameter_base = if plan.tied { base } else { parameter_base };
    let mut parameters = vector(
        random,
        plan.parameters,
        model.parameters.len(),
        parameter_base,
        exact,
    );
    for parameter in &mut parameters {
        *parameter = parameter.abs();
    }
    State {
        time: plan.time * random.between(0.5, 2.0),
        q: vector(random, plan.q, model.dof, base, exact),
        z: vector(random, plan.z, model.dof, z_base, exact),
        mu: vector(random, GENERIC, model.constraints.len(), 1.0, exact),
        parameters,
    }
}

/// All regimes of a model.
pub fn regimes(random: &mut Random, model: &Model) -> Vec<Regime> {
    let mut plans: Vec<(String, Plan)> = vec![("generic".to_owned(), PLAIN)];
    for scale in [1.0, 1e3, 1e5, 1e8] {
        let q = shape(Spread::Equal, scale);
        plans.push((format!("q equal at {scale:.0e}"), Plan { q, ..PLAIN }));
        let z = shape(Spread::Equal, scale);
        plans.push((format!("q, z equal at {scale:.0e}"), Plan { q, z, ..PLAIN }));
        for delta in [1e-3, 1e-6, 1e-9] {
            let near = shape(Spread::Near(delta), scale);
            let at = format!("near {delta:.0e} at {scale:.0e}");
            plans.push((format!("q {at}"), Plan { q: near, ..PLAIN }));
            plans.push((format!("z {at}"), Plan { z: near, ..PLAIN }));
            let both = Plan {
                q: near,
                parameters: near,
                tied: true,
                ..PLAIN
            };
            plans.push((format!("q, parameters {at}"), both));
        }
        let near = shape(Spread::Near(1e-6), scale);
        let both = Plan {
            q: near,
            z: near,
            ..PLAIN
        };
        plans.push((format!("q, z near 1e-6 at {scale:.0e}"), both));
    }
    for (delta, scale) in [(0.0, 1.0), (0.0, 1e5), (1e-6, 1.0), (1e-6, 1e3)] {
        let q = shape(Spread::Opposite(delta), scale);
        let name = format!("q opposite to {delta:.0e} at {scale:.0e}");
        plans.push((name, Plan { q, ..PLAIN }));
    }
    plans.push(("t at 1e5".to_owned(), Plan { time: 1e5, ..PLAIN }));
    for scale in [1e-3, 1e-8] {
        let small = shape(Spread::Generic, scale);
        plans.push((format!("q {scale:.0e}"), Plan { q: small, ..PLAIN }));
        plans.push((format!("z {scale:.0e}"), Plan { z: small, ..PLAIN }));
        let both = Plan {
            q: small,
            z: small,
            ..PLAIN
        };
        plans.push((format!("q, z {scale:.0e}"), both));
    }
    let mut regimes = Vec::new();
    for (name, plan) in plans {
        let sizes = vec![1.0; model.parameters.len()];
        regimes.push(regime(random, name, plan, model, &sizes));
    }
    let near = |scale: f64| Plan {
        q: shape(Spread::Near(1e-6), scale),
        ..PLAIN
    };
    let plans = [
        ("generic", PLAIN),
        ("q near 1e-6 at 1e3", near(1e3)),
        ("q near 1e-6 at 1e0", near(1.0)),
    ];
    for (name, plan) in plans {
        let name = format!("{name}, parameters 1e-6 … 1e6");
        let size = |_| 10f64.powf(random.between(-6.0, 6.0));
        let sizes: Vec<f64> = (0..model.parameters.len()).map(size).collect();
        regimes.push(regime(random, name, plan, model, &sizes));
    }
    regimes
}

/// By how much the states beside one differ from it, at most.
const BESIDE: f64 = 0.02;

/// States beside one, in each of which all inputs are larger or smaller by one factor.
pub fn beside(state: &State) -> Vec<State> {
    let scaled = |number: usize| {
        let part = (number as f64 + 0.5) / FURTHER as f64;
        let factor = 1.0 + BESIDE * (2.0 * part - 1.0);
        let all = |list: &[f64]| list.iter().map(|x| factor * x).collect();
        State {
            time: factor * state.time,
            q: all(&state.q),
            z: all(&state.z),
            mu: all(&state.mu),
            parameters: all(&state.parameters),
        }
    };
    (0..FURTHER).map(scaled).collect()
}

/// The states of a regime; parameters are so much larger than others, alike in all states.
fn regime(random: &mut Random, name: String, plan: Plan, model: &Model, sizes: &[f64]) -> Regime {
    let mut one = |number: usize| {
        let mut state = state(random, plan, model, number);
        for (parameter, size) in state.parameters.iter_mut().zip(sizes) {
            *parameter *= size;
        }
        state
    };
    let states = (0..STATES).map(&mut one).collect();
    let further = (STATES..STATES + FURTHER).map(one).collect();
    Regime {
        name,
        states,
        further,
    }
}
