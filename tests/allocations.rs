//! No allocation per step, in every way a step can be done.

use allocation_counter::measure;
use tfe::prelude::*;
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

/// Allocations of so many steps after the first few.
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
    // The matrix of a linear model is made after 2N + 1 steps.
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

/// The emitted solver, which has no allocator to ask.
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

/// A loop of control: what is set before every step, and the node after it.
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
