//! No step allocates memory, in any of the ways to make one.

use allocation_counter::measure;
use tfe::family;
use tfe::prelude::*;
use tfe::runtime::bundle::Bundle;
use tfe::runtime::step::{Control, Stepper};

#[dynamics(coordinates(theta), lagrangian = l^2*dot(theta)^2/2 + g*l*cos(theta))]
struct Pendulum {
    l: f64,
    g: f64,
}

#[dynamics(coordinates(x, y), momenta(px, py), hamiltonian = (px^2 + py^2*(1 + x^2))/2 + x^4 + y^2)]
struct Curved {}

#[dynamics(coordinates(x), lagrangian = dot(x)^2/2 - x^2/2, force(x) = mu*(1 - x^2)*dot(x))]
struct VanDerPol {
    mu: f64,
}

#[dynamics(coordinates(x[8]), lagrangian = sum(i in 0..8, dot(x[i])^2/2 - x[i]^2) - sum(i in 0..7, (x[i] - x[i+1])^2))]
struct Row {}

#[dynamics(
    coordinates(x, y),
    lagrangian = (dot(x)^2 + dot(y)^2)/2 - g*y,
    constraint(rod) = x^2 + y^2 - 1,
)]
struct Rod {
    g: f64,
}

/// The number of allocations in a number of steps after the first few.
fn allocations<M: Model<N>, const N: usize>(
    model: &M,
    element: Element,
    solve: Solve,
    start: State<N>,
    steps: usize,
) -> u64 {
    let control = Control {
        solve,
        ..Control::default()
    };
    let mut stepper = Stepper::new(model, element, control)
        .expect("an element")
        .ends_only();
    let mut state = start;
    let mut walk = |from: usize, to: usize| {
        for step in from..to {
            let t = 0.01 * step as f64;
            stepper.advance(t, 0.01, &mut state, &[]).expect("a step");
        }
    };
    // The matrix of a linear model is computed once, after 2N + 1 steps.
    walk(0, 40);
    measure(|| walk(40, 40 + steps)).count_total
}

fn none<M: Model<N>, const N: usize>(model: &M, element: Element, start: State<N>) {
    for solve in [Solve::Auto, Solve::Newton] {
        for steps in [100, 1000] {
            let count = allocations(model, element, solve, start, steps);
            assert_eq!(count, 0, "{element} {solve:?}: {steps} steps");
        }
    }
}

#[test]
fn steps_do_not_allocate() {
    let pendulum = Pendulum { l: 1.0, g: 9.81 };
    let start = pendulum.state([1.0], [0.2]);
    for element in [
        Element::mixed(5),
        Element::primal(4).lobatto(),
        Element::energy_conserving(4),
        Element::radau(4),
        Element::three_field(3),
    ] {
        none(&pendulum, element, start);
    }
    let start = State {
        q: [0.3, 0.4],
        p: [0.5, 0.1],
    };
    none(&Curved {}, Element::mixed(6), start);
    none(&Curved {}, Element::primal(4).lobatto(), start);
    let stiff = VanDerPol { mu: 1000.0 };
    none(&stiff, Element::radau(4), stiff.state([2.0], [0.0]));
    none(&Row {}, Element::mixed(4), Row {}.state([0.1; 8], [0.0; 8]));
    let rod = Rod { g: 9.81 };
    none(&rod, Element::mixed(4), rod.state([1.0, 0.0], [0.0, 0.0]));
}

/// Emitted solvers, which have no allocator.
#[test]
fn specialised_solvers_do_not_allocate() {
    #[dynamics(
        coordinates(theta),
        lagrangian = dot(theta)^2/2 + g*cos(theta),
        solver(Swing, Mixed::<4>),
    )]
    struct Model {
        g: f64,
    }
    let model = Model { g: 9.81 };
    let mut state = model.state([1.0], [0.0]);
    let count = measure(|| {
        let mut solver = Swing::new(&model, 0.01);
        for _ in 0..1000 {
            solver.advance(&mut state).expect("a step");
        }
    });
    assert_eq!(count.count_total, 0);
}

/// A control loop: inputs set before every step, and the node read after it.
#[test]
fn loops_of_control_do_not_allocate() {
    #[dynamics(
        coordinates(x, theta),
        lagrangian = dot(x)^2/2 + l*dot(x)*dot(theta)*cos(theta)/2 + l^2*dot(theta)^2/2 - 9.81*l*cos(theta),
        input(u),
        force(x) = u,
        output(tip) = x + l*sin(theta),
    )]
    struct Cart {
        l: f64,
    }
    let cart = Cart { l: 0.5 };
    let start = cart.state([0.0, 0.05], [0.0; 2]);
    let run = Simulation::new(&cart).step(0.005).hold(start, 0.0);
    let mut run = run.expect("a loop");
    let mut steps = |count: u32| {
        for _ in 0..count {
            let node = run.node();
            let u = 2.0 * node.q[0] + 3.0 * node.v[0] + 60.0 * node.q[1] + 12.0 * node.v[1];
            run.set("u", u);
            run.advance().expect("a step");
        }
        run.node().q[1]
    };
    steps(10);
    let mut angle = f64::NAN;
    let used = measure(|| angle = steps(1000));
    assert!(angle.abs() < 0.05, "{angle}");
    assert_eq!(used.count_total, 0);
}

#[dynamics(
    coordinates(q[n]),
    lagrangian = sum(i in 0..n, dot(q[i])^2/2) - sum(i in 0..n-1, (q[i+1]-q[i])^2/2 + (q[i+1]-q[i])^4/4),
)]
struct Chain {
    n: usize,
}

/// A model of run-time length, whose vectors have the length of the model: all memory is allocated in the first steps.
#[test]
fn steps_of_families_do_not_allocate() {
    for n in [3, 40, 2000] {
        let chain = Chain { n };
        let q: Vec<f64> = (0..n).map(|i| (0.3 * i as f64).sin()).collect();
        let mut state = chain.state(q, vec![0.0; n]);
        for element in [Element::mixed(4), Element::mixed(7)] {
            let mut stepper =
                family::Stepper::new(&chain, element, Control::default()).expect("an element");
            let mut walk = |from: u32, to: u32| {
                for step in from..to {
                    let t = 0.01 * f64::from(step);
                    stepper.advance(t, 0.01, &mut state).expect("a step");
                }
            };
            walk(0, 10);
            let count = measure(|| walk(10, 60)).count_total;
            assert_eq!(count, 0, "{element}, {n} sites");
        }
    }
}

/// Eight trajectories, and eight parameter sets, in lanes.
#[test]
fn steps_in_lanes_do_not_allocate() {
    let models: Vec<_> = (1..=8)
        .map(|k| Pendulum {
            l: 0.3 * f64::from(k),
            g: 9.81,
        })
        .collect();
    let starts: Vec<_> = (models.iter().zip(1..=8))
        .map(|(model, k)| model.state([0.1 * f64::from(k)], [0.2]))
        .collect();
    let (element, control) = (Element::mixed(6), Control::default());
    let mut same = Bundle::<_, 1, 8>::new(&models[0], element, control).expect("an element");
    same.start(&starts);
    let mut varied = Bundle::of_models(&models[0], element, control).expect("an element");
    varied.start_with(&models, &starts);
    let mut walk = |from: u32, to: u32| {
        for step in from..to {
            let t = 0.01 * f64::from(step);
            assert!(!same.advance(t, 0.01) && !varied.advance(t, 0.01));
        }
    };
    walk(0, 10);
    assert_eq!(measure(|| walk(10, 500)).count_total, 0);
}

/// Dense output allocates only the memory in which it is kept: a run with twice as many steps makes twice as many
/// allocations.
#[test]
fn dense_output_allocates_what_it_keeps() {
    let pendulum = Pendulum { l: 1.0, g: 9.81 };
    let simulation = Simulation::new(&pendulum).step(0.01);
    let start = pendulum.state([1.0], [0.2]);
    let count = |steps: u32| {
        let end = 0.01 * f64::from(steps);
        let used = measure(|| {
            simulation.run(start, 0.0..end).expect("a motion");
        });
        used.count_total
    };
    let (once, twice) = (count(1000), count(2000));
    // A few more, because the vectors of nodes double their capacity once more.
    let a_step = (twice - once) as f64 / 1000.0;
    assert!(a_step <= 2.1, "{a_step} allocations a step");
    let motion = simulation.run(start, 0.0..1.0).expect("a motion");
    let mut sum = 0.0;
    let used = measure(|| {
        for k in 0..1000 {
            sum += motion
                .at(0.001 * f64::from(k))
                .map_or(f64::NAN, |node| node.q[0]);
        }
    });
    assert!(sum.is_finite());
    assert_eq!(used.count_total, 0);
}
