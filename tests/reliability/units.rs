//! A coordinate that is small beside another one moves as it does alone: its iteration goes on until it has its own
//! digits, not only those of the largest coordinate.

use super::*;
use tfe::runtime::bundle::Bundle;

/// The length of steps in which an iteration that ends too early leaves errors above 1e-9.
const STEP: f64 = 0.25;

/// The velocity of what moves freely beside the pendulums.
const FAST: f64 = 1e9;

#[dynamics(coordinates(theta), lagrangian = dot(theta)^2/2 + cos(theta))]
struct Alone {}

#[dynamics(coordinates(x, theta), lagrangian = (dot(x)^2 + dot(theta)^2)/2 + cos(theta))]
struct Beside {}

#[dynamics(coordinates(theta), lagrangian = (2 + cos(theta))/2*dot(theta)^2 + cos(theta))]
struct VariedAlone {}

#[dynamics(coordinates(x, theta), lagrangian = dot(x)^2/2 + (2 + cos(theta))/2*dot(theta)^2 + cos(theta))]
struct VariedBeside {}

#[dynamics(coordinates(theta), momenta(p), hamiltonian = p^2/(2*(2 + cos(theta))) - cos(theta))]
struct PhaseAlone {}

#[dynamics(coordinates(x, theta), momenta(px, p), hamiltonian = px^2/2 + p^2/(2*(2 + cos(theta))) - cos(theta))]
struct PhaseBeside {}

/// The state after a number of steps.
fn end<M: Model<N>, const N: usize>(
    model: &M,
    (element, solve): (Element, Solve),
    start: State<N>,
    (h, steps): (f64, u32),
) -> State<N> {
    let control = Control {
        solve,
        ..Control::default()
    };
    let mut stepper = Stepper::new(model, element, control).expect("a stepper");
    let mut state = start;
    for step in 0..steps {
        let done = stepper.advance(h * f64::from(step), h, &mut state, &[]);
        done.unwrap_or_else(|error| panic!("{element}, {solve:?}: {error}"));
    }
    state
}

/// The difference of a small coordinate and its momentum from those that move alone.
fn apart(beside: &State<2>, alone: &State<1>) -> f64 {
    larger(
        (beside.q[1] - alone.q[0]).abs(),
        (beside.p[1] - alone.p[0]).abs(),
    )
}

#[track_caller]
fn moves_as_alone<M: Model<2>, A: Model<1>>(beside: &M, alone: &A, elements: &[Element]) {
    for element in elements {
        for solve in [Solve::Auto, Solve::FixedPoint, Solve::Newton] {
            let way = (*element, solve);
            let start = State {
                q: [0.0, 1.2],
                p: [FAST, 0.3],
            };
            let small = State { q: [1.2], p: [0.3] };
            let one = end(beside, way, start, (STEP, 40));
            let other = end(alone, way, small, (STEP, 40));
            let off = apart(&one, &other);
            // Rounding errors of forty steps.
            assert!(off <= 1e-13, "{element}, {solve:?}: {off:.1e}");
        }
    }
}

#[test]
fn small_coordinates_converge_by_forces() {
    let elements = [Element::mixed(3), Element::mixed(6), Element::radau(3)];
    moves_as_alone(&Beside {}, &Alone {}, &elements);
}

/// Also where rates are projected.
#[test]
fn small_coordinates_converge_by_velocities() {
    let elements = [
        Element::mixed(3),
        Element::radau(3),
        Element::primal(4).lobatto(),
        Element::three_field(3),
    ];
    moves_as_alone(&VariedBeside {}, &VariedAlone {}, &elements);
}

/// In phase space, point by point, and by way of the Legendre transform.
#[test]
fn small_coordinates_converge_by_rates_of_phase_space() {
    let elements = [
        Element::mixed(3),
        Element::radau(3),
        Element::three_field(3),
    ];
    moves_as_alone(&PhaseBeside {}, &PhaseAlone {}, &elements);
}

/// Side by side, and each as alone, also where nothing moves beside it.
#[test]
fn small_coordinates_converge_in_lanes() {
    let element = Element::mixed(3);
    let control = Control::default();
    let model = Beside {};
    let mut bundle = Bundle::<_, 2, 8>::new(&model, element, control).expect("a bundle");
    let lanes = [0.0, FAST, 0.0, -FAST, 1e7, 1.0, 1e5, FAST];
    let mut starts = [State {
        q: [0.0; 2],
        p: [0.0; 2],
    }; 8];
    for (k, fast) in lanes.into_iter().enumerate() {
        let angle = 0.4 + 0.2 * k as f64;
        (starts[k].q, starts[k].p) = ([0.0, angle], [fast, 0.3]);
    }
    bundle.start(&starts);
    for step in 0..40 {
        let has_failed = bundle.advance(STEP * f64::from(step), STEP);
        assert!(!has_failed, "step {step}");
    }
    for (lane, start) in starts.iter().enumerate() {
        let small = State {
            q: [start.q[1]],
            p: [start.p[1]],
        };
        let alone = end(&Alone {}, (element, Solve::Auto), small, (STEP, 40));
        let off = apart(&bundle.state(lane).expect("a state"), &alone);
        assert!(off <= 1e-13, "lane {lane}: {off:.1e}");
    }
}

/// A rod pendulum, and the same beside what moves freely.
#[test]
fn small_coordinates_converge_under_constraints() {
    #[dynamics(
        coordinates(a, b),
        lagrangian = (dot(a)^2 + dot(b)^2)/2 - g*b,
        constraint(rod) = (a^2 + b^2 - 1)/2
    )]
    struct Rod {
        g: f64,
    }
    #[dynamics(
        coordinates(x, a, b),
        lagrangian = (dot(x)^2 + dot(a)^2 + dot(b)^2)/2 - g*b,
        constraint(rod) = (a^2 + b^2 - 1)/2
    )]
    struct RodBeside {
        g: f64,
    }
    let way = (Element::mixed(3), Solve::Auto);
    let start = State {
        q: [-5e9, 1.0, 0.0],
        p: [1e10, 0.0, 0.0],
    };
    let one = end(&RodBeside { g: 9.81 }, way, start, (0.1, 10));
    let start = State {
        q: [1.0, 0.0],
        p: [0.0, 0.0],
    };
    let other = end(&Rod { g: 9.81 }, way, start, (0.1, 10));
    for k in 0..2 {
        let (q, p) = (one.q[k + 1] - other.q[k], one.p[k + 1] - other.p[k]);
        // Rounding errors of positions, divided by the step, in ten steps.
        assert!(q.abs() <= 1e-12 && p.abs() <= 1e-12, "{k}: {q:.1e} {p:.1e}");
    }
}

/// The force on a small coordinate may have the rounding errors of a large one: its increments then end above its own
/// digits, and the iteration ends with them.
#[test]
fn roundings_of_large_coordinates_prolong_nothing() {
    #[dynamics(
        coordinates(x, y),
        lagrangian = (dot(x)^2 + dot(y)^2)/2 - ((x + y)^4 + (x - y)^4)/8
    )]
    struct Coupled {}
    let (model, control) = (Coupled {}, Control::default());
    for element in [Element::mixed(4), Element::mixed(7)] {
        let mut stepper = Stepper::new(&model, element, control).expect("a stepper");
        let mut state = State {
            q: [1.0, 1e-6],
            p: [0.3, 0.0],
        };
        for step in 0..400 {
            let t = 0.05 * f64::from(step);
            stepper.advance(t, 0.05, &mut state, &[]).expect("a step");
        }
        let statistics = stepper.statistics();
        assert_eq!(statistics.fallbacks, 0, "{element}");
        // Half of what may be tried before Newton's method takes over.
        assert!(statistics.iterations <= 12 * 400, "{element}: {statistics}");
    }
}

/// An arm whose joint angle and tip are coordinates, joined by constraints of the size of one.
#[dynamics(
    coordinates(theta, tip[2]),
    lagrangian = j/2*dot(theta)^2 + m/2*inner(dot(tip), dot(tip)) - m*g*tip[1],
    constraint(joint) = tip - l*[cos(theta), sin(theta)]
)]
struct LightArm {
    j: f64,
    m: f64,
    l: f64,
    g: f64,
}

/// The angle at the end and its derivatives by the length and by gravity, for masses in this unit.
fn angle_of_an_arm(mass: f64, element: Element) -> [f64; 3] {
    let arm = LightArm {
        j: 0.5 * mass,
        m: mass,
        l: 1.0,
        g: 9.81,
    };
    let start = arm.state([0.0, 1.0, 0.0], [0.0; 3]);
    let simulation = Simulation::new(&arm).element(element).step(0.01);
    let sensitive = simulation.run_sensitive(start, 0.0..2.0).expect("a run");
    let by_length = sensitive.by("l").last().q[0];
    let by_gravity = sensitive.by("g").last().q[0];
    [sensitive.motion().last().q[0], by_length, by_gravity]
}

/// A single mass that swings on an arm does so at any unit of its mass. In small units the inertias are far below the
/// rounding errors of the constraints: those of moulded or etched mechanisms are 1e-20 kg m² and less.
#[test]
fn light_mechanisms_move_as_heavy_ones() {
    for element in [Element::mixed(5), Element::primal(5)] {
        let wanted = angle_of_an_arm(1.0, element);
        for mass in [1e-60, 1e-27, 1e-18, 1e-9, 1e9, 1e30] {
            let found = angle_of_an_arm(mass, element);
            for (found, wanted) in found.iter().zip(wanted) {
                let off = (found / wanted - 1.0).abs();
                // Rounding errors of 200 steps; formerly no step was found below 1e-20.
                assert!(off <= 1e-12, "{element}, {mass:e}: {off:.1e}");
            }
        }
    }
}
