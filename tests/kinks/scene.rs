//! Scenes with kinks and jumps: models, and how each is run.

use tfe::prelude::*;
use tfe::runtime::Model;
use tfe::runtime::length::{Declared, FixedLength};

/// A mass that bounces on a one-sided spring.
#[dynamics(coordinates(y), lagrangian = dot(y)^2/2 - g*y - k/2*min(y, 0)^2)]
pub struct Bounce {
    g: f64,
    k: f64,
}

/// A driven mass with Coulomb friction, which jumps with the direction of motion.
#[dynamics(coordinates(x), lagrangian = dot(x)^2/2 - x^2/2 - x^4/4, force(x) = -c*sign(dot(x)) + a*sin(w*t))]
pub struct Coulomb {
    pub c: f64,
    pub a: f64,
    pub w: f64,
}

/// The same with smoothed friction.
#[dynamics(coordinates(x), lagrangian = dot(x)^2/2 - x^2/2 - x^4/4, force(x) = -c*tanh(dot(x)/w) + a*sin(t))]
pub struct Smoothed {
    c: f64,
    a: f64,
    w: f64,
}

/// A gap on both sides.
#[dynamics(coordinates(x), lagrangian = dot(x)^2/2 - k/2*max(abs(x) - gap, 0)^2, force(x) = a*cos(t) - 0.1*dot(x))]
struct Backlash {
    k: f64,
    gap: f64,
    a: f64,
}

/// Thrust during some time.
#[dynamics(coordinates(x), lagrangian = dot(x)^2/2 - cos(x), force(x) = select(t < until, thrust, 0))]
struct ThrustInTime {
    until: f64,
    thrust: f64,
}

/// Thrust in some region.
#[dynamics(coordinates(x, y), lagrangian = (dot(x)^2 + dot(y)^2)/2 + 1/sqrt(x^2 + y^2), force(x) = select(x > y + 0.1, thrust, 0))]
struct ThrustInPlace {
    thrust: f64,
}

/// An inverted pendulum stabilised by a limited torque.
#[dynamics(coordinates(a), lagrangian = dot(a)^2/2 - cos(a), force(a) = max(-m, min(m, -3*a - 2*dot(a))))]
struct Saturated {
    m: f64,
}

/// A charge on one of two capacitors, depending on its sign.
#[dynamics(coordinates(q), lagrangian = dot(q)^2/2 - q^2/(2*select(q > 0, c, 3*c)), force(q) = -0.05*dot(q) + sin(t))]
struct Capacitors {
    c: f64,
}

/// Driven against a stiff wall.
#[dynamics(coordinates(x), lagrangian = dot(x)^2/2 - x^2/2 - k/2*max(x - wall, 0)^2, force(x) = a*cos(w*t) - 0.05*dot(x))]
struct Impact {
    k: f64,
    wall: f64,
    a: f64,
    w: f64,
}

/// A potential with a kink at its top.
#[dynamics(coordinates(x, y), lagrangian = (dot(x)^2 + dot(y)^2)/2 - g*abs(x) - y^2/2 - x^2*y/4)]
struct Roof {
    g: f64,
}

/// A Hamiltonian: a magnet on one side.
#[dynamics(coordinates(q[2]), momenta(p[2]), hamiltonian = (p[0]^2 + p[1]^2)/2 + q[0]^2*q[1]^2/2 + b*max(q[0], 0)*q[0] + (q[0]^2 + q[1]^2)/2)]
struct HalfSpring {
    b: f64,
}

/// Quadratic drag, whose sign depends on the velocity: a kink in the second derivative of the force.
#[dynamics(coordinates(x), lagrangian = dot(x)^2/2 + cos(x), force(x) = -c*abs(dot(x))*dot(x) + 0.5*sin(1.3*t))]
struct Drag {
    c: f64,
}

/// A scene and how it is run.
pub struct Scene<'a> {
    pub name: &'static str,
    /// A step with which elements show their order.
    pub step: f64,
    pub run: Box<dyn Fn(Element, f64, bool) -> Ended + 'a>,
    /// Runs with an accuracy: returns the end and the estimate, or the error.
    pub accurate: Box<dyn Fn(f64) -> Result<Estimate, String> + 'a>,
}

/// The end state and its estimated error.
pub type Estimate = (Vec<f64>, f64);

pub struct Ended {
    pub end: Vec<f64>,
    pub kinks: u64,
}

fn numbers<const N: usize>(state: &State<N>) -> Vec<f64> {
    state.q.iter().chain(&state.p).copied().collect()
}

fn scene<'a, M, const N: usize>(
    (name, step): (&'static str, f64),
    model: &'a M,
    start: State<N>,
    end: f64,
) -> Scene<'a>
where
    M: Model<N> + Declared<N, Length = FixedLength>,
{
    let run = move |element: Element, step: f64, at_kinks: bool| {
        let simulation: Simulation<'_, M, N> = Simulation::new(model);
        let motion = simulation
            .element(element)
            .step(step)
            .at_kinks(at_kinks)
            .run(start, 0.0..end);
        let motion = motion.unwrap_or_else(|error| panic!("{name} {element} {step}: {error}"));
        Ended {
            end: numbers(&motion.last().state()),
            kinks: motion.statistics().kinks,
        }
    };
    let accurate = move |accuracy: f64| {
        let simulation: Simulation<'_, M, N> = Simulation::new(model);
        match simulation.accuracy(accuracy).run(start, 0.0..end) {
            Ok(motion) => Ok((numbers(&motion.last().state()), motion.error_estimate())),
            Err(error) => Err(error.to_string()),
        }
    };
    Scene {
        name,
        step,
        run: Box::new(run),
        accurate: Box::new(accurate),
    }
}

pub const BOUNCE: Bounce = Bounce { g: 10.0, k: 1e4 };
const COULOMB: Coulomb = Coulomb {
    c: 0.3,
    a: 2.0,
    w: 1.3,
};
pub const SMOOTHED: Smoothed = Smoothed {
    c: 0.3,
    a: 2.0,
    w: 0.05,
};
const BACKLASH: Backlash = Backlash {
    k: 50.0,
    gap: 0.3,
    a: 1.0,
};
const IN_TIME: ThrustInTime = ThrustInTime {
    until: 0.777,
    thrust: 3.0,
};
const IN_PLACE: ThrustInPlace = ThrustInPlace { thrust: 0.02 };
const SATURATED: Saturated = Saturated { m: 1.2 };
const CAPACITORS: Capacitors = Capacitors { c: 0.7 };
const IMPACT: Impact = Impact {
    k: 1e3,
    wall: 0.5,
    a: 1.0,
    w: 1.7,
};
const ROOF: Roof = Roof { g: 1.0 };
const HALF: HalfSpring = HalfSpring { b: 2.0 };
const DRAG: Drag = Drag { c: 0.4 };

pub fn scenes() -> Vec<Scene<'static>> {
    vec![
        scene(("bounce", 0.004), &BOUNCE, BOUNCE.state([0.3], [0.0]), 2.0),
        scene(
            ("dry friction", 0.1),
            &COULOMB,
            COULOMB.state([1.0], [0.0]),
            6.0,
        ),
        scene(
            ("smoothed friction", 0.01),
            &SMOOTHED,
            SMOOTHED.state([1.0], [0.0]),
            6.0,
        ),
        scene(
            ("backlash", 0.1),
            &BACKLASH,
            BACKLASH.state([0.0], [0.5]),
            8.0,
        ),
        scene(
            ("thrust in time", 0.2),
            &IN_TIME,
            IN_TIME.state([0.5], [0.1]),
            3.0,
        ),
        scene(
            ("thrust in place", 0.2),
            &IN_PLACE,
            IN_PLACE.state([1.0, 0.0], [0.0, 1.0]),
            10.0,
        ),
        scene(
            ("saturated", 0.2),
            &SATURATED,
            SATURATED.state([0.8], [0.0]),
            6.0,
        ),
        scene(
            ("capacitors", 0.2),
            &CAPACITORS,
            CAPACITORS.state([0.4], [0.0]),
            8.0,
        ),
        scene(("impact", 0.01), &IMPACT, IMPACT.state([0.0], [0.8]), 8.0),
        scene(
            ("roof", 0.1),
            &ROOF,
            ROOF.state([0.6, 0.2], [0.1, 0.0]),
            8.0,
        ),
        scene(
            ("half spring", 0.1),
            &HALF,
            State {
                q: [0.5, -0.3],
                p: [0.2, 0.4],
            },
            6.0,
        ),
        scene(("drag", 0.2), &DRAG, DRAG.state([0.3], [1.0]), 8.0),
    ]
}
