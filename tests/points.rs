//! Steps that evaluate all quadrature points of an element at once give the same results as Newton's method with one
//! point after the other.

use tfe::prelude::*;
use tfe::runtime::Form;
use tfe::runtime::step::{Control, Stepper};

/// Second order, without forces.
#[dynamics(coordinates(theta), lagrangian = m*l^2/2*dot(theta)^2 + m*g*l*cos(theta))]
struct Pendulum {
    m: f64,
    l: f64,
    g: f64,
}

/// Second order, with a velocity-dependent force and a mass matrix that is not diagonal.
#[dynamics(
    coordinates(x, y),
    lagrangian = dot(x)^2 + dot(x)*dot(y)/2 + dot(y)^2/2 - cos(x - y) - x^4/4 - y^2,
    force(x) = -c*dot(x)^3,
    force(y) = -c*dot(y),
)]
struct Coupled {
    c: f64,
}

/// Second order as a Hamiltonian, with a momentum-dependent force.
#[dynamics(
    coordinates(x, y), momenta(px, py), hamiltonian = (px^2 + py^2/4)/2 - 1/sqrt(x^2 + y^2),
    force(x) = -c*px, force(y) = -c*py,
)]
struct Drag {
    c: f64,
}

/// A constant mass matrix and a time-dependent force.
#[dynamics(coordinates(x), lagrangian = dot(x)^2/2 + x^2/2 - x^4/4, force(x) = f*cos(t) - c*dot(x))]
struct Duffing {
    f: f64,
    c: f64,
}

/// A mass matrix that depends on the coordinates.
#[dynamics(
    coordinates(a, b),
    lagrangian = dot(a)^2 + dot(b)^2/2 + dot(a)*dot(b)*cos(a - b) + g*(2*cos(a) + cos(b)),
)]
struct Double {
    g: f64,
}

/// A Hamiltonian whose mass matrix depends on the coordinates.
#[dynamics(coordinates(theta, phi), momenta(p, j), hamiltonian = (p^2 + j^2/sin(theta)^2)/2 + cos(theta))]
struct Spherical {}

/// A constant mass matrix, and a term linear in the velocities with coordinate-dependent factor.
#[dynamics(
    coordinates(x, y),
    lagrangian = (dot(x)^2 + dot(y)^2)/2 + b*(1 + x^2)*(x*dot(y) - y*dot(x)) - (x^4 + y^4)/4,
)]
struct Charge {
    b: f64,
}

/// Momenta that are not proportional to velocities although the mass is constant.
#[dynamics(coordinates(x), lagrangian = dot(x)^2/2 + 3*dot(x) - cos(x))]
struct Shifted {}

/// Lagrange's top: two of the three coordinates are cyclic; a Lagrangian.
#[dynamics(
    coordinates(phi, theta, psi),
    lagrangian = a/2*(dot(theta)^2 + sin(theta)^2*dot(phi)^2) + c/2*(dot(psi) + cos(theta)*dot(phi))^2 - w*cos(theta),
)]
struct Top {
    a: f64,
    c: f64,
    w: f64,
}

/// A cart below a spring: the position of the cart is cyclic; equations of second order with a mass matrix that is not
/// diagonal.
#[dynamics(
    coordinates(cart, spring),
    lagrangian = m*dot(cart)^2/2 + dot(cart)*dot(spring) + dot(spring)^2/2 - spring^2/2 - spring^4,
    force(spring) = -c*dot(spring),
)]
struct Cart {
    m: f64,
    c: f64,
}

/// The same without the coupling.
#[dynamics(
    coordinates(spring, cart), momenta(p, j),
    hamiltonian = p^2/2 + j^2/(2*m) + spring^2/2 + spring^4,
)]
struct Loose {
    m: f64,
}

const STEPS: usize = 30;

/// The end after some steps, and the polynomial and the matrix of the last one.
fn run<M: Model<N>, const N: usize>(
    model: &M,
    element: Element,
    solve: Solve,
    start: State<N>,
) -> (Vec<f64>, u64) {
    let control = Control {
        solve,
        ..Control::default()
    };
    let mut stepper = Stepper::new(model, element, control).expect("an element");
    let mut state = start;
    let mut t = 0.0;
    for step in 0..STEPS {
        // Steps of several lengths, one of them backwards.
        let h = [0.1, 0.1, 0.05, 0.08, -0.03][step % 5];
        stepper
            .advance(t, h, &mut state, &[])
            .unwrap_or_else(|error| panic!("{element} {solve:?}: {error}"));
        t += h;
    }
    let mut seen = [&state.q[..], &state.p[..]].concat();
    let dense = stepper.dense(t + 0.03, t);
    let inside = dense.at_time(t + 0.01);
    seen.extend([&inside.q[..], &inside.p[..]].concat());
    let mut matrix = vec![0.0; 4 * N * N];
    stepper.transition(&mut matrix).expect("a regular tangent");
    seen.extend(matrix);
    (seen, stepper.statistics().newton_iterations)
}

fn elements() -> Vec<Element> {
    let mut elements = Vec::new();
    // One, two and three groups of four points, with and without unused lanes.
    for nodes in [2, 3, 5, 6, 9, 12] {
        elements.extend([
            Element::mixed(nodes),
            Element::primal(nodes),
            Element::primal(nodes).lobatto(),
            Element::three_field(nodes),
            Element::three_field(nodes).quadrature(nodes + 2),
            Element::energy_conserving(nodes),
        ]);
        if nodes > 2 {
            elements.push(Element::radau(nodes));
        }
    }
    elements
}

fn compare<M: Model<N>, const N: usize>(model: &M, start: State<N>) {
    for element in elements() {
        let (together, newton) = run(model, element, Solve::Auto, start);
        // For Hamiltonians, some elements have no such form and need Newton's method.
        let has_form =
            matches!(M::FORM, Form::Lagrangian) || element == Element::mixed(element.nodes());
        // With two Lobatto points the fixed point converges badly for such steps.
        let contracts = element != Element::primal(2).lobatto();
        assert!(newton == 0 || !has_form || !contracts, "{element}");
        let (one_by_one, _) = run(model, element, Solve::Newton, start);
        let scale = one_by_one.iter().fold(1.0_f64, |s, x| s.max(x.abs()));
        for (x, y) in together.iter().zip(&one_by_one) {
            // Rounding errors of thirty steps, and the errors left by either iteration.
            assert!((x - y).abs() < 2e-13 * scale, "{element}: {x} {y}");
        }
    }
}

#[test]
fn second_order() {
    let pendulum = Pendulum {
        m: 1.3,
        l: 0.7,
        g: 9.81,
    };
    compare(&pendulum, pendulum.state([1.5], [0.3]));
    let coupled = Coupled { c: 0.3 };
    compare(&coupled, coupled.state([0.7, -0.4], [0.1, 0.5]));
    let start = State {
        q: [0.9, 0.1],
        p: [0.1, 3.0],
    };
    compare(&Drag { c: 0.1 }, start);
}

#[test]
fn velocities_as_unknowns() {
    let duffing = Duffing { f: 0.4, c: 0.2 };
    compare(&duffing, duffing.state([1.0], [0.0]));
    let double = Double { g: 9.81 };
    compare(&double, double.state([0.5, -0.3], [0.2, 0.0]));
    let charge = Charge { b: 0.7 };
    compare(&charge, charge.state([0.5, -0.3], [0.2, 0.6]));
    let shifted = Shifted {};
    compare(&shifted, shifted.state([0.5], [0.2]));
}

#[test]
fn phase_space() {
    let start = State {
        q: [1.0, 0.0],
        p: [0.2, 0.5],
    };
    compare(&Spherical {}, start);
}

/// Eight trajectories in lanes compared with single ones.
fn compare_side_by_side<M: Model<N> + Sync, const N: usize>(model: &M, start: State<N>) {
    let starts: Vec<_> = (0..8)
        .map(|lane| {
            let mut start = start;
            start.p[0] += 0.01 * f64::from(lane);
            start
        })
        .collect();
    let few = |element: &Element| [3, 9].contains(&element.nodes());
    for element in elements().into_iter().filter(few) {
        let run = Ensemble::new(model).element(element).step(0.1);
        let ends = run.run(&starts, 0.0..3.0).expect("a good plan");
        for (start, end) in starts.iter().zip(&ends) {
            let alone = Simulation::new(model).element(element).step(0.1);
            let alone = alone.run(*start, 0.0..3.0).expect("a regular motion");
            let end = end.as_ref().expect("a regular motion");
            for a in 0..N {
                let differences = [end.q[a] - alone.last().q[a], end.p[a] - alone.last().p[a]];
                for difference in differences {
                    assert!(difference.abs() < 2e-13, "{element}: {difference:.1e}");
                }
            }
        }
    }
}

/// Cyclic coordinates are left out of the iterations, and must still be right at the ends, inside elements and in
/// matrices.
#[test]
fn ignorable_coordinates() {
    let top = Top {
        a: 1.2,
        c: 0.3,
        w: 1.0,
    };
    assert_eq!(<Top as Model<3>>::IGNORABLE, [true, false, true]);
    let start = top.state([0.3, 1.1, -0.2], [0.2, 0.1, 0.5]);
    compare(&top, start);
    compare_side_by_side(&top, start);
    let cart = Cart { m: 3.0, c: 0.1 };
    assert_eq!(<Cart as Model<2>>::IGNORABLE, [true, false]);
    let start = cart.state([0.3, 0.9], [0.4, 0.1]);
    compare(&cart, start);
    compare_side_by_side(&cart, start);
    let loose = Loose { m: 3.0 };
    assert_eq!(<Loose as Model<2>>::IGNORABLE, [false, true]);
    let start = State {
        q: [0.9, 0.3],
        p: [0.1, 0.4],
    };
    compare(&loose, start);
    compare_side_by_side(&loose, start);
    let start = State {
        q: [1.0, 0.0],
        p: [0.2, 0.5],
    };
    assert_eq!(<Spherical as Model<2>>::IGNORABLE, [false, true]);
    compare_side_by_side(&Spherical {}, start);
}

/// Steppers of these models have no code for other mass matrices; `second_order` and `velocities_as_unknowns` step them.
#[test]
fn diagonal_mass_matrices_are_known_when_steppers_are_compiled() {
    const {
        assert!(<Drag as Model<2>>::DIAGONAL_MASS && <Charge as Model<2>>::DIAGONAL_MASS);
        assert!(<Loose as Model<2>>::DIAGONAL_MASS);
        // Coupled, dependent on the coordinates, and both.
        assert!(!(<Coupled as Model<2>>::DIAGONAL_MASS || <Spherical as Model<2>>::DIAGONAL_MASS));
        assert!(!(<Cart as Model<2>>::DIAGONAL_MASS || <Double as Model<2>>::DIAGONAL_MASS));
    }
}

/// The results of a run must not depend on whether the inside of its elements is evaluated.
#[test]
fn the_inside_of_elements_costs_no_digit() {
    let double = Double { g: 9.81 };
    let start = double.state([0.5, -0.3], [0.2, 0.0]);
    let control = Control::default();
    let mut watched = Stepper::new(&double, Mixed::<6>.into(), control).expect("an element");
    let mut alone = watched.clone().ends_only();
    let (mut seen, mut unseen) = (start, start);
    for step in 0..100 {
        let t = 0.05 * f64::from(step);
        watched.advance(t, 0.05, &mut seen, &[]).expect("smooth");
        alone.advance(t, 0.05, &mut unseen, &[]).expect("smooth");
        let _ = watched.dense(t, t + 0.05);
    }
    assert_eq!(seen, unseen);
    // The inside can still be evaluated afterwards.
    let (one, other) = (watched.dense(4.95, 5.0), alone.dense(4.95, 5.0));
    let (one, other) = (one.at_time(4.97), other.at_time(4.97));
    for a in 0..2 {
        assert!((one.q[a] - other.q[a]).abs() < 1e-13);
        assert!((one.p[a] - other.p[a]).abs() < 1e-12);
    }
}

/// Stiff steps change to Newton's method and back, with and without the inside of elements.
#[test]
fn stiff_steps_are_left_to_newton() {
    /// A stiff spring that acts only at large distances.
    #[dynamics(coordinates(x), lagrangian = dot(x)^2/2 - k*exp(8*(x - 1)) - x^2/2)]
    struct Wall {
        k: f64,
    }
    let wall = Wall { k: 0.01 };
    for ends_only in [false, true] {
        let control = Control::default();
        let mut stepper = Stepper::new(&wall, Mixed::<3>.into(), control).expect("an element");
        if ends_only {
            stepper = stepper.ends_only();
        }
        let mut state = wall.state([0.0], [8.0]);
        for step in 0..400 {
            let t = 0.05 * f64::from(step);
            stepper.advance(t, 0.05, &mut state, &[]).expect("a step");
        }
        let statistics = stepper.statistics();
        assert!(statistics.fallbacks > 0, "{statistics}");
        assert!(statistics.fixed_point_iterations > 400, "{statistics}");
        assert!(statistics.newton_iterations > 0, "{statistics}");
        assert_eq!(statistics.steps, 400);
        assert_eq!(statistics.choice(), tfe::runtime::Choice::Both);
        let reason = statistics.reason().to_string();
        assert!(reason.contains("given up"), "{reason}");
    }
}

#[test]
fn what_is_no_number_is_told() {
    let pendulum = Pendulum {
        m: 1.0,
        l: 1.0,
        g: f64::NAN,
    };
    for solve in [Solve::Auto, Solve::FixedPoint] {
        let control = Control {
            solve,
            ..Control::default()
        };
        let mut stepper = Stepper::new(&pendulum, Mixed::<6>.into(), control).expect("an element");
        let start = State { q: [1.0], p: [0.0] };
        let mut state = start;
        let error = stepper.advance(0.0, 0.1, &mut state, &[]);
        assert!(
            matches!(error, Err(tfe::runtime::StepError::NonFinite)),
            "{error:?}"
        );
        assert_eq!(state, start);
    }
}
