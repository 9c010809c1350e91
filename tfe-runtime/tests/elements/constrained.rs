//! Constrained elements on models written by hand: single steps, derivatives, dependent rows, starts.

use tfe_runtime::condenser::{Condensed, Condenser, Direction, Placed};
use tfe_runtime::step::{Control, Impulse, Stepper};
use tfe_runtime::{
    Constraint, ConstraintError, ConstraintKind, ConstraintSecond, CoordinateName, Element, Facts,
    First, Form, Mixed, Model, Primal, Radau, Real, Second, Solve, State, StepError, constrained,
    transition,
};

const GRAVITY: f64 = 9.81;

/// A point mass on the wire y = c(t) x⁴/4 with c = 1 + κ sin t, in gravity and a cross wind Q = (β ẏ, 0); the second row repeats the first.
struct Wire {
    kappa: f64,
    wind: f64,
}

impl Wire {
    fn shape<R: Real>(&self, t: R) -> (R, R, R) {
        let (sin, cos) = t.sin_cos();
        let kappa = R::from_f64(self.kappa);
        (R::from_f64(1.0) + kappa * sin, kappa * cos, -(kappa * sin))
    }
}

impl Model<2> for Wire {
    const FORM: Form = Form::Lagrangian;
    const FACTS: Facts = Facts::UNKNOWN;
    const CONSTRAINTS: &'static [Constraint] = &[
        Constraint {
            name: "wire",
            kind: ConstraintKind::Holonomic { quadratic: false },
        },
        Constraint {
            name: "again",
            kind: ConstraintKind::Holonomic { quadratic: false },
        },
    ];

    fn energy_function<R: Real>(&self, _: R, q: &[R; 2], v: &[R; 2]) -> R {
        (v[0] * v[0] + v[1] * v[1]) * R::from_f64(0.5) - R::from_f64(GRAVITY) * q[1]
    }
    fn first<R: Real>(&self, _: R, _: &[R; 2], v: &[R; 2], first: &mut First<R, 2>) {
        first.z = *v;
        first.q[1] = R::from_f64(-GRAVITY);
        first.force[0] = R::from_f64(self.wind) * v[1];
    }
    fn first_and_mass<R: Real>(
        &self,
        t: R,
        q: &[R; 2],
        v: &[R; 2],
        first: &mut First<R, 2>,
        zz: &mut [[R; 2]; 2],
    ) {
        self.first(t, q, v, first);
        zz[0][0] = R::from_f64(1.0);
        zz[1][1] = R::from_f64(1.0);
    }
    fn second<R: Real>(
        &self,
        t: R,
        q: &[R; 2],
        v: &[R; 2],
        first: &mut First<R, 2>,
        second: &mut Second<R, 2>,
    ) {
        self.first_and_mass(t, q, v, first, &mut second.zz);
        second.force_z[0][1] = R::from_f64(self.wind);
    }
    fn constraint_values<R: Real>(&self, t: R, q: &[R; 2], values: &mut [R]) {
        let (c, ..) = self.shape(t);
        values[0] = q[1] - c * q[0].powi(4) * R::from_f64(0.25);
        values[1] = values[0] * R::from_f64(2.0);
    }
    fn constraint_rows<R: Real>(&self, t: R, q: &[R; 2], rows: &mut [[R; 2]], drift: &mut [R]) {
        let (c, rate, _) = self.shape(t);
        for (k, factor) in [1.0, 2.0].into_iter().enumerate() {
            let factor = R::from_f64(factor);
            rows[k] = [-(factor * c * q[0].powi(3)), factor];
            drift[k] = -(factor * rate * q[0].powi(4) * R::from_f64(0.25));
        }
    }
    fn constraint_second<R: Real>(
        &self,
        t: R,
        q: &[R; 2],
        v: &[R; 2],
        mu: &[R],
        second: &mut ConstraintSecond<'_, R, 2>,
    ) {
        let (c, rate, _) = self.shape(t);
        let three = R::from_f64(3.0);
        let (square, cube) = (q[0] * q[0], q[0].powi(3));
        let row_rate = -(c * three * square * v[0]) - rate * cube;
        for (k, factor) in [1.0, 2.0].into_iter().enumerate() {
            let factor = R::from_f64(factor);
            second.psi_q[k][0] = factor * row_rate;
            second.row_rates[k][0] = factor * row_rate;
        }
        let mu = mu[0] + R::from_f64(2.0) * mu[1];
        second.bend[0][0] = -(three * c * square * mu);
        second.rate_q[0][0] =
            -(R::from_f64(6.0) * c * q[0] * v[0] * mu) - three * rate * square * mu;
        second.rate_v[0][0] = -(three * c * square * mu);
    }
    fn coordinate_name(index: usize) -> CoordinateName {
        CoordinateName::single(["x", "y"][index])
    }
}

/// A knife edge on an incline whose blade is pushed sideways: sin θ ẋ − cos θ ẏ = s sin t. Given by its Hamiltonian.
struct Edge {
    slope: f64,
    push: f64,
}

impl Model<3> for Edge {
    const FORM: Form = Form::Hamiltonian;
    const FACTS: Facts = Facts::UNKNOWN;
    const CONSTRAINTS: &'static [Constraint] = &[Constraint {
        name: "blade",
        kind: ConstraintKind::Velocity { integrable: false },
    }];

    fn energy_function<R: Real>(&self, _: R, q: &[R; 3], p: &[R; 3]) -> R {
        (p[0] * p[0] + p[1] * p[1] + p[2] * p[2]) * R::from_f64(0.5)
            - R::from_f64(self.slope) * q[0]
    }
    fn first<R: Real>(&self, _: R, _: &[R; 3], p: &[R; 3], first: &mut First<R, 3>) {
        first.z = *p;
        first.q[0] = R::from_f64(-self.slope);
    }
    fn first_and_mass<R: Real>(
        &self,
        t: R,
        q: &[R; 3],
        p: &[R; 3],
        first: &mut First<R, 3>,
        zz: &mut [[R; 3]; 3],
    ) {
        self.first(t, q, p, first);
        for (a, row) in zz.iter_mut().enumerate() {
            row[a] = R::from_f64(1.0);
        }
    }
    fn second<R: Real>(
        &self,
        t: R,
        q: &[R; 3],
        p: &[R; 3],
        first: &mut First<R, 3>,
        second: &mut Second<R, 3>,
    ) {
        self.first_and_mass(t, q, p, first, &mut second.zz);
    }
    fn constraint_rows<R: Real>(&self, t: R, q: &[R; 3], rows: &mut [[R; 3]], drift: &mut [R]) {
        let (sin, cos) = q[2].sin_cos();
        (rows[0][0], rows[0][1]) = (sin, -cos);
        drift[0] = -(R::from_f64(self.push) * t.sin());
    }
    fn constraint_second<R: Real>(
        &self,
        _: R,
        q: &[R; 3],
        v: &[R; 3],
        mu: &[R],
        second: &mut ConstraintSecond<'_, R, 3>,
    ) {
        let (sin, cos) = q[2].sin_cos();
        second.psi_q[0][2] = cos * v[0] + sin * v[1];
        (second.row_rates[0][0], second.row_rates[0][1]) = (cos * v[2], sin * v[2]);
        (second.bend[0][2], second.bend[1][2]) = (cos * mu[0], sin * mu[0]);
        (second.rate_q[0][2], second.rate_q[1][2]) = (-(sin * v[2] * mu[0]), cos * v[2] * mu[0]);
        (second.rate_v[0][2], second.rate_v[1][2]) = (cos * mu[0], sin * mu[0]);
    }
    fn coordinate_name(index: usize) -> CoordinateName {
        CoordinateName::single(["x", "y", "theta"][index])
    }
}

const STILL: Wire = Wire {
    kappa: 0.0,
    wind: 0.0,
};
const MOVING: Wire = Wire {
    kappa: 0.2,
    wind: 0.7,
};
const PLAIN: Edge = Edge {
    slope: 0.5 * GRAVITY,
    push: 0.0,
};
const PUSHED: Edge = Edge {
    slope: 0.5 * GRAVITY,
    push: 0.3,
};

fn step<M: Model<N>, const N: usize>(
    model: &M,
    element: Element,
    t: f64,
    h: f64,
    start: &State<N>,
) -> Result<State<N>, StepError> {
    let mut stepper = Stepper::new(model, element, Control::default()).unwrap();
    let mut state = *start;
    stepper.advance(t, h, &mut state, &[])?;
    Ok(state)
}

/// A consistent state near (q, v) of the wire.
fn on_wire(model: &Wire, t: f64, x: f64, speed: f64) -> State<2> {
    let (c, rate, _) = model.shape(t);
    let v = [speed, c * x.powi(3) * speed + 0.25 * rate * x.powi(4)];
    State {
        q: [x, 0.25 * c * x.powi(4)],
        p: v,
    }
}

fn largest_difference<const N: usize>(a: &State<N>, b: &State<N>) -> f64 {
    let mut largest = 0.0_f64;
    for i in 0..N {
        for off in [a.q[i] - b.q[i], a.p[i] - b.p[i]] {
            assert!(!off.is_nan(), "{a:?} {b:?}");
            largest = largest.max(off.abs());
        }
    }
    largest
}

/// constraints.json, `one_step_V` of the bead and `one_step_S` of the knife edge, h = 0.1, two to four nodes.
#[test]
fn one_step() {
    let bead = on_wire(&STILL, 0.0, 1.2, 0.0);
    let values = [
        (
            [1.178300250383953, 0.48190772547224936],
            [-0.43968575419988054, -0.7193004046632996],
        ),
        (
            [1.1783517141194377, 0.4819919226760031],
            [-0.4407493711813122, -0.7211349015354623],
        ),
        (
            [1.1783527541637664, 0.4819936243534336],
            [-0.4407476972791067, -0.7211340722422015],
        ),
    ];
    for (n, (q, p)) in (2..).zip(values) {
        let end = step(&STILL, Element::mixed(n), 0.0, 0.1, &bead).unwrap();
        let error = largest_difference(&end, &State { q, p });
        assert!(error < 1e-13, "{n} nodes: {error:e}");
    }
    let start = State {
        q: [0.0; 3],
        p: [0.0, 0.0, 1.3],
    };
    let values = [
        (
            [0.024525145150395052, 0.001596383308110402, 0.13],
            [0.4843120040143082, 0.0633176524821962, 1.3],
        ),
        (
            [0.02438716617251325, 0.002119027316672137, 0.13],
            [0.4849924777614188, 0.06340661579486559, 1.3],
        ),
        (
            [0.024387153466511616, 0.0021183276384056427, 0.13],
            [0.484992348932418, 0.06340659895210765, 1.3],
        ),
    ];
    for (n, (q, p)) in (2..).zip(values) {
        let end = step(&PLAIN, Element::mixed(n), 0.0, 0.1, &start).unwrap();
        let error = largest_difference(&end, &State { q, p });
        assert!(error < 1e-13, "{n} nodes: {error:e}");
    }
}

/// Transition matrix and derivatives by time, length and damping, against central differences of the converged step.
fn derivatives<M: Model<N>, const N: usize>(model: &M, element: Element, start: &State<N>) {
    let (t, h) = (0.4, 0.1);
    let mut matrix = vec![0.0; 4 * N * N];
    transition::of_step(model, element, start, t, h, &mut matrix).unwrap();
    // The interior from the assembled path, by Newton's method.
    let mut condenser = Condenser::<N>::new::<M>(element).unwrap();
    let mut interior = vec![0.0; condenser.interior()];
    let directions = [
        Direction {
            time: 1.0,
            ..Direction::default()
        },
        Direction {
            length: 1.0,
            ..Direction::default()
        },
        Direction {
            damping: 1.0,
            ..Direction::default()
        },
    ];
    let columns = 2 * N + directions.len() + 1;
    let mut solve = |start: &State<N>, t: f64, h: f64, damping: f64, ends: &mut Vec<f64>| {
        for _ in 0..30 {
            ends.resize(2 * N * columns, 0.0);
            let mut response = vec![0.0; columns * interior.len()];
            let placed = Placed {
                time: t,
                length: h,
                start,
                interior: &interior,
                damping,
            };
            let condensed = Condensed {
                ends,
                response: &mut response,
            };
            condenser
                .linearise(model, placed, &directions, condensed)
                .unwrap();
            for (x, row) in interior.iter_mut().zip(response.chunks_exact(columns)) {
                *x += row[columns - 1];
            }
        }
        let mut end = State {
            q: [0.0; N],
            p: [0.0; N],
        };
        for a in 0..N {
            end.p[a] = ends[a * columns + columns - 1];
            end.q[a] = ends[(N + a) * columns + columns - 1];
        }
        end
    };
    let mut ends = Vec::new();
    let end = solve(start, t, h, 0.0, &mut ends);
    let stepped = step(model, element, t, h, start).unwrap();
    assert!(largest_difference(&end, &stepped) < 1e-13, "{element}");
    for row in 0..2 * N {
        for column in 0..2 * N {
            let difference = ends[row * columns + column] - matrix[row * 2 * N + column];
            assert!(difference.abs() < 1e-11, "{element} {row} {column}");
        }
    }
    let (exact, step) = (ends.clone(), 1e-5);
    for column in 0..2 * N + 3 {
        let mut moved = |sign: f64| {
            let (mut start, mut t, mut h, mut damping) = (*start, t, h, 0.0);
            let change = sign * step;
            match column {
                c if c < N => start.p[c] += change,
                c if c < 2 * N => start.q[c - N] += change,
                c if c == 2 * N => t += change,
                c if c == 2 * N + 1 => h += change,
                _ => damping = change,
            }
            solve(&start, t, h, damping, &mut ends)
        };
        let (plus, minus) = (moved(1.0), moved(-1.0));
        for row in 0..2 * N {
            let of = |state: &State<N>| {
                if row < N {
                    state.p[row]
                } else {
                    state.q[row - N]
                }
            };
            let difference = (of(&plus) - of(&minus)) / (2.0 * step);
            let error = (difference - exact[row * columns + column]).abs();
            // Third derivatives of size 1e2 and rounding 1e-15 / 1e-5.
            assert!(
                error < 3e-8 * difference.abs().max(1.0),
                "{element} {row} {column}: {error:e}"
            );
        }
    }
}

#[test]
fn derivatives_are_those_of_the_step() {
    let start = on_wire(&MOVING, 0.4, 0.9, 1.1);
    for n in 2..=5 {
        for element in [
            Element::mixed(n),
            Element::primal(n),
            Element::primal(n).lobatto(),
        ] {
            derivatives(&MOVING, element, &start);
        }
    }
    let theta = 0.3_f64;
    let drift = PUSHED.push * 0.4_f64.sin();
    let start = State {
        q: [0.1, -0.2, theta],
        p: [
            0.7 * theta.cos() + drift * theta.sin(),
            0.7 * theta.sin() - drift * theta.cos(),
            1.3,
        ],
    };
    for n in 2..=5 {
        derivatives(&PUSHED, Element::mixed(n), &start);
        derivatives(&PUSHED, Element::primal(n).reduced(), &start);
    }
}

/// Orders 2(n − 1) on the moving wire with a force that is not conservative, and φ at every node.
#[test]
fn orders_on_a_moving_wire() {
    let start = on_wire(&MOVING, 0.0, 1.2, 0.0);
    let run = |element: Element, steps: u32| {
        let mut stepper = Stepper::new(&MOVING, element, Control::default()).unwrap();
        let (mut state, h) = (start, 1.0 / f64::from(steps));
        for k in 0..steps {
            stepper
                .advance(f64::from(k) * h, h, &mut state, &[])
                .unwrap();
            let t = f64::from(k + 1) * h;
            let mut phi = [0.0; 2];
            MOVING.constraint_values(t, &state.q, &mut phi);
            assert!(phi[0].abs() < 1e-15, "{element} at {t}: {:e}", phi[0]);
        }
        state
    };
    let exact = run(Element::mixed(8), 50);
    for (n, steps) in [(2, 80), (3, 40), (4, 20), (5, 28)] {
        for element in [
            Element::mixed(n),
            Element::primal(n),
            Element::primal(n).lobatto(),
        ] {
            let error = |steps| largest_difference(&run(element, steps), &exact);
            let order = (error(steps) / error(2 * steps)).log2();
            let expected = (2 * n - 2) as f64;
            assert!((order - expected).abs() < 0.35, "{element}: order {order}");
        }
    }
}

/// Dense output begins and ends at the nodes, and is of order hⁿ between.
#[test]
fn dense_output() {
    let start = on_wire(&STILL, 0.0, 1.2, 0.0);
    for n in 2..=5 {
        let error = |h: f64| {
            let mut stepper = Stepper::new(&STILL, Element::mixed(n), Control::default()).unwrap();
            let mut state = start;
            stepper.advance(0.0, h, &mut state, &[]).unwrap();
            let dense = stepper.dense(0.0, h);
            assert!(largest_difference(&dense.at(0.0), &start) == 0.0);
            assert!(largest_difference(&dense.at(1.0 - f64::EPSILON), &state) < 1e-13);
            let half = step(&STILL, Element::mixed(8), 0.0, 0.3 * h, &start).unwrap();
            largest_difference(&dense.at(0.3), &half)
        };
        let order = (error(0.1) / error(0.05)).log2();
        assert!(order > n as f64 - 0.4, "{n} nodes: order {order}");
    }
}

#[test]
fn impulses_act_inside() {
    // A blow at the start changes the velocity by J along the wire.
    let start = on_wire(&STILL, 0.0, 1.2, 0.0);
    let kicked = |time: f64| {
        let mut stepper = Stepper::new(&STILL, Mixed::<6>.into(), Control::default()).unwrap();
        let mut state = start;
        let impulse = Impulse {
            time,
            value: [0.3, -0.1],
        };
        stepper.advance(0.0, 0.01, &mut state, &[impulse]).unwrap();
        state
    };
    let slope = 1.2_f64.powi(3);
    let speed = (0.3 - 0.1 * slope) / (1.0 + slope * slope);
    let after = step(
        &STILL,
        Mixed::<6>.into(),
        0.0,
        0.01,
        &on_wire(&STILL, 0.0, 1.2, speed),
    )
    .unwrap();
    // The element sees a blow through polynomials: of order h² here, and never off the wire.
    assert!(largest_difference(&kicked(0.0), &after) < 1e-3);
    assert!(
        constrained::residuals(&STILL, 0.0, &kicked(0.004).q, &[0.0; 2], 1.0)[0]
            .position
            .abs()
            < 1e-15
    );
}

#[test]
fn what_cannot_be_is_told() {
    let bead = on_wire(&STILL, 0.0, 1.2, 0.0);
    let radau = step(&STILL, Radau::<3>.into(), 0.0, 0.1, &bead).unwrap_err();
    assert!(
        radau
            .to_string()
            .contains("`Radau::<3>` does not support the constraint `wire`"),
        "{radau}"
    );
    let full = step(
        &PLAIN,
        Primal::<3>.into(),
        0.0,
        0.1,
        &State {
            q: [0.0; 3],
            p: [0.0; 3],
        },
    );
    assert!(matches!(
        full,
        Err(StepError::Constraint(ConstraintError::Element { .. }))
    ));
    let off = State {
        q: [1.2, 0.6],
        p: [0.0; 2],
    };
    let error = step(&STILL, Mixed::<3>.into(), 0.0, 0.1, &off).unwrap_err();
    assert!(matches!(
        error,
        StepError::Constraint(ConstraintError::Start {
            constraint: CoordinateName {
                name: "wire",
                index: None
            },
            position: true,
            ..
        })
    ));
    let fast = State {
        p: [1.0, 0.0],
        ..bead
    };
    let error = step(&STILL, Mixed::<3>.into(), 0.0, 0.1, &fast).unwrap_err();
    assert!(matches!(
        error,
        StepError::Constraint(ConstraintError::Start {
            position: false,
            ..
        })
    ));
    let control = Control {
        solve: Solve::FixedPoint,
        ..Control::default()
    };
    let mut stepper = Stepper::new(&STILL, Mixed::<3>.into(), control).unwrap();
    let error = stepper.advance(0.0, 0.1, &mut bead.clone(), &[]);
    assert_eq!(
        error,
        Err(StepError::Constraint(ConstraintError::NeedsNewton))
    );
}

#[test]
fn one_of_two_equal_rows_counts() {
    let active = constrained::independent(&STILL, 0.0, &[1.2, 0.0]);
    assert_eq!(active.iter().filter(|active| **active).count(), 1);
}
