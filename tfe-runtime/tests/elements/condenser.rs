//! Linearised elements against differences of steps: by their start, by time, by length and by parameters.

use tfe_runtime::condenser::{Condensed, Condenser, Direction, Parameter, Placed};
use tfe_runtime::model::By;
use tfe_runtime::{
    CoordinateName, Element, Facts, First, Form, Model, Real, Second, State, transition,
};

/// L = ½(1 + b q²) v² + b t q v − cos q, Q = a cos(ω t) − b v³; parameters a and b.
#[derive(Clone)]
struct Driven {
    a: f64,
    b: f64,
}

const OMEGA: f64 = 1.3;

impl Model<1> for Driven {
    const FORM: Form = Form::Lagrangian;
    const FACTS: Facts = Facts::UNKNOWN;
    const SENSITIVITIES: &'static [&'static str] = &["a", "b"];

    fn energy_function<R: Real>(&self, t: R, q: &[R; 1], v: &[R; 1]) -> R {
        let (q, v, b) = (q[0], v[0], R::from_f64(self.b));
        R::from_f64(0.5) * (R::from_f64(1.0) + b * q * q) * v * v + b * t * q * v - q.cos()
    }

    fn first<R: Real>(&self, t: R, q: &[R; 1], v: &[R; 1], first: &mut First<R, 1>) {
        let (q, v, a, b) = (q[0], v[0], R::from_f64(self.a), R::from_f64(self.b));
        first.z[0] = (R::from_f64(1.0) + b * q * q) * v + b * t * q;
        first.q[0] = b * q * v * v + b * t * v + q.sin();
        first.force[0] = a * (R::from_f64(OMEGA) * t).cos() - b * v * v * v;
    }

    fn first_and_mass<R: Real>(
        &self,
        t: R,
        q: &[R; 1],
        v: &[R; 1],
        first: &mut First<R, 1>,
        zz: &mut [[R; 1]; 1],
    ) {
        self.first(t, q, v, first);
        zz[0][0] = R::from_f64(1.0) + R::from_f64(self.b) * q[0] * q[0];
    }

    fn second<R: Real>(
        &self,
        t: R,
        q: &[R; 1],
        v: &[R; 1],
        first: &mut First<R, 1>,
        second: &mut Second<R, 1>,
    ) {
        self.first_and_mass(t, q, v, first, &mut second.zz);
        let (q, v, b, two) = (q[0], v[0], R::from_f64(self.b), R::from_f64(2.0));
        second.zq[0][0] = two * b * q * v + b * t;
        second.qq[0][0] = b * v * v + q.cos();
        second.force_z[0][0] = -(R::from_f64(3.0) * b * v * v);
    }

    fn sensitivity_parameter(&self, index: usize) -> f64 {
        [self.a, self.b][index]
    }

    fn first_by<R: Real>(&self, by: By, t: R, q: &[R; 1], v: &[R; 1], first: &mut First<R, 1>) {
        let (q, v, a, b) = (q[0], v[0], R::from_f64(self.a), R::from_f64(self.b));
        let omega = R::from_f64(OMEGA);
        match by {
            By::Time => {
                first.z[0] = b * q;
                first.q[0] = b * v;
                first.force[0] = -(a * omega * (omega * t).sin());
            }
            By::Parameter(0) => first.force[0] = (omega * t).cos(),
            _ => {
                first.z[0] = q * q * v + t * q;
                first.q[0] = q * v * v + t * v;
                first.force[0] = -(v * v * v);
            }
        }
    }

    fn coordinate_name(_: usize) -> CoordinateName {
        CoordinateName::single("q")
    }
}

/// H = ½ p²/(1 + b q²) + t b p q + cos q, Q = a cos(ω t) − b p³.
#[derive(Clone)]
struct DrivenHamiltonian {
    a: f64,
    b: f64,
}

impl Model<1> for DrivenHamiltonian {
    const FORM: Form = Form::Hamiltonian;
    const FACTS: Facts = Facts::UNKNOWN;
    const SENSITIVITIES: &'static [&'static str] = &["a", "b"];

    fn energy_function<R: Real>(&self, t: R, q: &[R; 1], p: &[R; 1]) -> R {
        let (q, p, b) = (q[0], p[0], R::from_f64(self.b));
        let mass = R::from_f64(1.0) + b * q * q;
        R::from_f64(0.5) * p * p / mass + t * b * p * q + q.cos()
    }

    fn first<R: Real>(&self, t: R, q: &[R; 1], p: &[R; 1], first: &mut First<R, 1>) {
        let (q, p, a, b) = (q[0], p[0], R::from_f64(self.a), R::from_f64(self.b));
        let mass = R::from_f64(1.0) + b * q * q;
        first.z[0] = p / mass + t * b * q;
        first.q[0] = -(b * q * p * p / (mass * mass)) + t * b * p - q.sin();
        first.force[0] = a * (R::from_f64(OMEGA) * t).cos() - b * p * p * p;
    }

    fn first_and_mass<R: Real>(
        &self,
        t: R,
        q: &[R; 1],
        p: &[R; 1],
        first: &mut First<R, 1>,
        zz: &mut [[R; 1]; 1],
    ) {
        self.first(t, q, p, first);
        zz[0][0] = R::from_f64(1.0) / (R::from_f64(1.0) + R::from_f64(self.b) * q[0] * q[0]);
    }

    fn second<R: Real>(
        &self,
        t: R,
        q: &[R; 1],
        p: &[R; 1],
        first: &mut First<R, 1>,
        second: &mut Second<R, 1>,
    ) {
        self.first_and_mass(t, q, p, first, &mut second.zz);
        let (q, p, b) = (q[0], p[0], R::from_f64(self.b));
        let number = R::from_f64;
        let mass = number(1.0) + b * q * q;
        second.zq[0][0] = -(number(2.0) * b * q * p / (mass * mass)) + t * b;
        second.qq[0][0] = -(b * p * p / (mass * mass))
            + number(4.0) * b * b * q * q * p * p / (mass * mass * mass)
            - q.cos();
        second.force_z[0][0] = -(number(3.0) * b * p * p);
    }

    fn sensitivity_parameter(&self, index: usize) -> f64 {
        [self.a, self.b][index]
    }

    fn first_by<R: Real>(&self, by: By, t: R, q: &[R; 1], p: &[R; 1], first: &mut First<R, 1>) {
        let (q, p, a, b) = (q[0], p[0], R::from_f64(self.a), R::from_f64(self.b));
        let omega = R::from_f64(OMEGA);
        let mass = R::from_f64(1.0) + b * q * q;
        match by {
            By::Time => {
                first.z[0] = b * q;
                first.q[0] = b * p;
                first.force[0] = -(a * omega * (omega * t).sin());
            }
            By::Parameter(0) => first.force[0] = (omega * t).cos(),
            _ => {
                first.z[0] = -(p * q * q / (mass * mass)) + t * q;
                first.q[0] = -(q * p * p / (mass * mass))
                    + R::from_f64(2.0) * b * q * q * q * p * p / (mass * mass * mass)
                    + t * p;
                first.force[0] = -(p * p * p);
            }
        }
    }

    fn coordinate_name(_: usize) -> CoordinateName {
        CoordinateName::single("q")
    }
}

/// A model of which a and b can be moved.
trait Movable: Model<1> {
    fn moved(&self, parameter: usize, by: f64) -> Self;
}

impl Movable for Driven {
    fn moved(&self, parameter: usize, by: f64) -> Self {
        let mut parameters = [self.a, self.b];
        parameters[parameter] += by;
        let [a, b] = parameters;
        Self { a, b }
    }
}

impl Movable for DrivenHamiltonian {
    fn moved(&self, parameter: usize, by: f64) -> Self {
        let mut parameters = [self.a, self.b];
        parameters[parameter] += by;
        let [a, b] = parameters;
        Self { a, b }
    }
}

const START: State<1> = State {
    q: [0.7],
    p: [-0.4],
};
const TIME: f64 = 0.35;
const LENGTH: f64 = 0.4;

fn elements() -> Vec<Element> {
    let mut elements = Vec::new();
    for nodes in 2..=5 {
        elements.push(Element::mixed(nodes));
        elements.push(Element::mixed(nodes).quadrature(nodes + 1));
        elements.push(Element::primal(nodes));
        elements.push(Element::primal(nodes).reduced());
        elements.push(Element::primal(nodes).lobatto());
        elements.push(Element::energy_conserving(nodes));
        elements.push(Element::energy_conserving(nodes).quadrature(nodes + 1));
        elements.push(Element::radau(nodes));
    }
    elements
}

/// Newton's iteration on the interior of one element, from rest; (p, q) at its end, A and C.
fn solve<M: Model<1>>(
    model: &M,
    element: Element,
    (time, length, damping): (f64, f64, f64),
    directions: &[Direction],
) -> ([f64; 2], Vec<[f64; 2]>) {
    let mut condenser = Condenser::new::<M>(element).expect("an element");
    let m = condenser.interior();
    let columns = 2 + directions.len() + 1;
    let mut interior = vec![0.0; m];
    condenser
        .interpolate(model, time, length, |_| ([0.7], [-0.3]), &mut interior)
        .expect("momenta");
    let (mut ends, mut response) = (vec![0.0; 2 * columns], vec![0.0; columns * m]);
    for _ in 0..12 {
        let placed = Placed {
            time,
            length,
            start: &START,
            interior: &interior,
            damping,
        };
        let condensed = Condensed {
            ends: &mut ends,
            response: &mut response,
        };
        condenser
            .linearise(model, placed, directions, condensed)
            .expect("a regular element");
        for (x, row) in interior.iter_mut().zip(response.chunks_exact(columns)) {
            *x += row[columns - 1];
        }
    }
    let end = [ends[columns - 1], ends[2 * columns - 1]];
    let derivatives = (0..columns - 1)
        .map(|column| [ends[column], ends[columns + column]])
        .collect();
    (end, derivatives)
}

#[track_caller]
fn close(value: f64, expected: f64, tolerance: f64) {
    assert!(
        (value - expected).abs() <= tolerance,
        "{value:e} instead of {expected:e}"
    );
}

fn check<M: Movable>(model: &M) {
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
            parameter: Some(Parameter::Named(0)),
            ..Direction::default()
        },
        Direction {
            parameter: Some(Parameter::Named(1)),
            time: 0.5,
            ..Direction::default()
        },
        Direction {
            damping: 1.0,
            ..Direction::default()
        },
    ];
    for element in elements() {
        let (end, derivatives) = solve(model, element, (TIME, LENGTH, 0.0), &directions[..0]);
        let mut matrix = [0.0; 4];
        let stepped =
            transition::of_step(model, element, &START, TIME, LENGTH, &mut matrix).expect("a step");
        // Both solve the same equations to round-off.
        close(end[0], stepped.p[0], 1e-14);
        close(end[1], stepped.q[0], 1e-14);
        for column in 0..2 {
            for row in 0..2 {
                let entry = matrix[2 * row + column];
                close(derivatives[column][row], entry, 1e-13);
            }
        }
        // From here on with the additional force 0.3 v.
        let (_, derivatives) = solve(model, element, (TIME, LENGTH, 0.3), &directions);
        let at = |model: &M, time: f64, length: f64, damping: f64| {
            solve(model, element, (time, length, damping), &[]).0
        };
        // A difference of fourth order at δ = 10⁻³: δ⁴ times a fifth derivative, and round-off over δ.
        let difference = |end: &dyn Fn(f64) -> [f64; 2], row: usize| {
            let delta = 1e-3;
            let central = |delta: f64| (end(delta)[row] - end(-delta)[row]) / (2.0 * delta);
            (4.0 * central(delta / 2.0) - central(delta)) / 3.0
        };
        for row in 0..2 {
            let expected = [
                difference(&|x| at(model, TIME + x, LENGTH, 0.3), row),
                difference(&|x| at(model, TIME, LENGTH + x, 0.3), row),
                difference(&|x| at(&model.moved(0, x), TIME, LENGTH, 0.3), row),
                difference(
                    &|x| at(&model.moved(1, x), TIME + 0.5 * x, LENGTH, 0.3),
                    row,
                ),
                difference(&|x| at(model, TIME, LENGTH, 0.3 + x), row),
            ];
            for (derivative, expected) in derivatives[2..].iter().zip(expected) {
                close(derivative[row], expected, 1e-10);
            }
        }
    }
}

#[test]
fn a_lagrangian_model_by_start_time_length_and_parameters() {
    check(&Driven { a: 0.8, b: 0.6 });
}

#[test]
fn a_hamiltonian_model_by_start_time_length_and_parameters() {
    check(&DrivenHamiltonian { a: 0.8, b: 0.6 });
}

#[test]
fn wrong_lengths_and_broken_values_are_errors() {
    let model = Driven { a: 0.8, b: 0.6 };
    let mut condenser = Condenser::new::<Driven>(Element::mixed(3)).expect("an element");
    let m = condenser.interior();
    let mut call = |length: f64, q: f64, size: usize| {
        condenser.linearise(
            &model,
            Placed {
                time: 0.0,
                length,
                start: &State { q: [q], p: [0.0] },
                interior: &vec![0.0; m],
                damping: 0.0,
            },
            &[],
            Condensed {
                ends: &mut [0.0; 6],
                response: &mut vec![0.0; size],
            },
        )
    };
    assert!(call(0.1, 0.5, 3 * m).is_ok());
    assert!(call(0.0, 0.5, 3 * m).is_err());
    assert!(call(0.1, f64::NAN, 3 * m).is_err());
    assert!(call(0.1, 0.5, 3 * m - 1).is_err());
}
