//! The kernels of constraints against hyper-dual numbers on formulas written by hand, up to third derivatives.

use num_dual::{DualNum, HyperHyperDual64};
use tfe_symbolic::compile::declare;
use tfe_symbolic::derive::derivation::Derivation;
use tfe_symbolic::model::declared::{Constraint, ConstraintKind};
use tfe_symbolic::program::Request;
use tfe_symbolic::program::interpret::{Environment, Results, interpret};
use tfe_symbolic::syntax::context::{Context, Field, FieldKind, Length};

/// A declaration and the same equations by hand.
trait System {
    const TEXT: &'static str;
    /// The coordinates.
    const DOF: usize;
    /// Parameters of the declaration.
    const PARAMETERS: &'static [(&'static str, f64)] = &[];
    /// Arrays of parameters.
    const ARRAYS: &'static [(&'static str, &'static [f64])] = &[];
    /// φ(q, t) or ψ(q, v, t) of each constraint.
    fn equations(t: Dual, q: &[Dual], v: &[Dual]) -> Vec<Dual>;
}

type Dual = HyperHyperDual64;

/// A direction in which time, coordinates and velocities change.
struct Direction {
    t: f64,
    q: Vec<f64>,
    v: Vec<f64>,
}

/// The point at which everything is compared.
struct Point {
    t: f64,
    q: Vec<f64>,
    v: Vec<f64>,
    mu: Vec<f64>,
}

impl Point {
    /// Numbers in (0.15, 0.85) that follow no pattern: multiples of the golden ratio modulo one.
    fn new(dof: usize, constraints: usize, start: f64) -> Self {
        let mut state = start;
        let mut next = || {
            state = (state + 0.618_033_988_749_894_9).fract();
            0.15 + 0.7 * state
        };
        let t = next();
        let q = (0..dof).map(|_| next()).collect();
        let v = (0..dof)
            .map(|k| if k % 2 == 0 { next() } else { -next() })
            .collect();
        let mu = (0..constraints).map(|_| next() - 0.5).collect();
        Self { t, q, v, mu }
    }

    fn along(&self, unit: impl Fn(usize) -> f64, velocities: bool) -> Direction {
        let units = (0..self.q.len()).map(unit).collect();
        let zeros = vec![0.0; self.q.len()];
        let (q, v) = if velocities {
            (zeros, units)
        } else {
            (units, zeros)
        };
        Direction { t: 0.0, q, v }
    }

    fn along_q(&self, at: usize) -> Direction {
        self.along(|k| f64::from(u8::from(k == at)), false)
    }

    fn along_v(&self, at: usize) -> Direction {
        self.along(|k| f64::from(u8::from(k == at)), true)
    }

    fn along_time(&self) -> Direction {
        let nothing = self.along(|_| 0.0, false);
        Direction { t: 1.0, ..nothing }
    }

    /// The motion itself, at fixed velocities.
    fn along_motion(&self) -> Direction {
        let (t, q, v) = (1.0, self.v.clone(), vec![0.0; self.v.len()]);
        Direction { t, q, v }
    }

    /// One equation and its derivatives along up to three directions.
    fn evaluate<S: System>(&self, equation: usize, directions: &[&Direction]) -> Dual {
        let seeded = |value: f64, pick: &dyn Fn(&Direction) -> f64| {
            let along = |at: usize| directions.get(at).map_or(0.0, |direction| pick(direction));
            let mut dual = Dual::from_re(value);
            (dual.eps1, dual.eps2, dual.eps3) = (along(0), along(1), along(2));
            dual
        };
        let t = seeded(self.t, &|direction| direction.t);
        let vector = |values: &[f64], pick: &dyn Fn(&Direction, usize) -> f64| -> Vec<Dual> {
            let values = values.iter().enumerate();
            values
                .map(|(k, value)| seeded(*value, &|direction| pick(direction, k)))
                .collect()
        };
        let q = vector(&self.q, &|direction, k| direction.q[k]);
        let v = vector(&self.v, &|direction, k| direction.v[k]);
        S::equations(t, &q, &v)[equation]
    }
}

/// Everything that the kernels give, by hyper-dual numbers.
fn expected<S: System>(point: &Point, constraints: &[Constraint]) -> Results {
    let n = S::DOF;
    let block = || vec![vec![0.0; n]; n];
    let mut results = Results {
        bend: block(),
        rate_q: block(),
        rate_v: block(),
        ..Results::default()
    };
    let motion = point.along_motion();
    for (c, constraint) in constraints.iter().enumerate() {
        let holonomic = matches!(constraint.kind, ConstraintKind::Holonomic { .. });
        let value = |directions: &[&Direction]| point.evaluate::<S>(c, directions);
        // A_i is the derivative along this.
        let row = |i: usize| {
            if holonomic {
                point.along_q(i)
            } else {
                point.along_v(i)
            }
        };
        let drift = if holonomic {
            value(&[&point.along_time()]).eps1
        } else {
            let rest = Point {
                t: point.t,
                q: point.q.clone(),
                v: vec![0.0; n],
                mu: Vec::new(),
            };
            rest.evaluate::<S>(c, &[]).re
        };
        results
            .phi
            .push(if holonomic { value(&[]).re } else { 0.0 });
        results.drift.push(drift);
        let over = |entry: &dyn Fn(usize) -> f64| -> Vec<f64> { (0..n).map(entry).collect() };
        results.rows.push(over(&|i| value(&[&row(i)]).eps1));
        results
            .row_rates
            .push(over(&|i| value(&[&row(i), &motion]).eps1eps2));
        results.psi_q.push(over(&|j| {
            if holonomic {
                value(&[&motion, &point.along_q(j)]).eps1eps2
            } else {
                value(&[&point.along_q(j)]).eps1
            }
        }));
        for i in 0..n {
            for j in 0..n {
                let dual = value(&[&row(i), &point.along_q(j), &motion]);
                let mu = point.mu[c];
                results.bend[i][j] += mu * dual.eps1eps2;
                results.rate_v[i][j] += mu * dual.eps1eps2;
                results.rate_q[i][j] += mu * dual.eps1eps2eps3;
            }
        }
    }
    results
}

fn context<S: System>() -> Context {
    let scalars = S::PARAMETERS
        .iter()
        .map(|(name, _)| (*name, FieldKind::Scalar));
    let arrays = S::ARRAYS.iter().map(|(name, values)| {
        let length = Length::Literal(values.len());
        (*name, FieldKind::Array(length))
    });
    let field = |(name, kind): (&str, FieldKind)| Field {
        name: name.to_owned(),
        kind,
    };
    Context {
        struct_name: "Model".to_owned(),
        fields: scalars.chain(arrays).map(field).collect(),
        ..Context::default()
    }
}

#[track_caller]
fn compare<S: System>(kinds: &[ConstraintKind]) {
    let declared = declare(S::TEXT, &context::<S>()).expect("a model of the test");
    let found: Vec<ConstraintKind> = declared.constraints.iter().map(|c| c.kind).collect();
    assert_eq!(found, kinds);
    let derivation = Derivation::of(&declared);
    let all = Request {
        constraint_values: true,
        constraint_rows: true,
        constraint_second: true,
        ..Request::default()
    };
    let program = derivation.program(all);
    for start in [0.5, 0.1, 0.77] {
        let point = Point::new(S::DOF, kinds.len(), start);
        let environment = Environment {
            time: point.t,
            q: point.q.clone(),
            z: point.v.clone(),
            mu: point.mu.clone(),
            parameters: S::PARAMETERS
                .iter()
                .map(|(name, value)| ((*name).to_owned(), *value))
                .collect(),
            arrays: S::ARRAYS
                .iter()
                .map(|(name, values)| ((*name).to_owned(), values.to_vec()))
                .collect(),
            ..Environment::default()
        };
        let results = interpret(&program, &environment).expect("a complete environment");
        let expected = expected::<S>(&point, &declared.constraints);
        same("phi", &results.phi, &expected.phi);
        same("drift", &results.drift, &expected.drift);
        for (name, found, expected) in [
            ("rows", &results.rows, &expected.rows),
            ("psi_q", &results.psi_q, &expected.psi_q),
            ("row_rates", &results.row_rates, &expected.row_rates),
            ("bend", &results.bend, &expected.bend),
            ("rate_q", &results.rate_q, &expected.rate_q),
            ("rate_v", &results.rate_v, &expected.rate_v),
        ] {
            same(name, &found.concat(), &expected.concat());
        }
    }
}

#[track_caller]
fn same(name: &str, found: &[f64], expected: &[f64]) {
    assert_eq!(found.len(), expected.len(), "{name}");
    for (found, expected) in found.iter().zip(expected) {
        // Sums of a few dozen terms of size ten at most, rounded in another order.
        let tolerance = 100.0 * 10.0 * f64::EPSILON;
        assert!(
            (found - expected).abs() <= tolerance,
            "{name}: {found} and {expected}"
        );
    }
}

const QUADRATIC: ConstraintKind = ConstraintKind::Holonomic { quadratic: true };
const CURVED: ConstraintKind = ConstraintKind::Holonomic { quadratic: false };
const VELOCITY: ConstraintKind = ConstraintKind::Velocity { integrable: false };
const INTEGRABLE: ConstraintKind = ConstraintKind::Velocity { integrable: true };

struct Rod;

impl System for Rod {
    const TEXT: &'static str = "coordinates(x, y), lagrangian = m/2*(dot(x)^2 + dot(y)^2) - m*9.81*y, constraint(rod) = x^2 + y^2 - l^2";
    const DOF: usize = 2;
    const PARAMETERS: &'static [(&'static str, f64)] = &[("m", 1.3), ("l", 0.9)];
    fn equations(_: Dual, q: &[Dual], _: &[Dual]) -> Vec<Dual> {
        vec![q[0] * q[0] + q[1] * q[1] - 0.9 * 0.9]
    }
}

#[test]
fn rod_pendulum() {
    compare::<Rod>(&[QUADRATIC]);
}

struct KnifeEdge;

impl System for KnifeEdge {
    const TEXT: &'static str = "coordinates(x, y, phi), lagrangian = (dot(x)^2 + dot(y)^2 + dot(phi)^2)/2 + x, constraint(blade) = dot(x)*sin(phi) - dot(y)*cos(phi)";
    const DOF: usize = 3;
    fn equations(_: Dual, q: &[Dual], v: &[Dual]) -> Vec<Dual> {
        vec![v[0] * q[2].sin() - v[1] * q[2].cos()]
    }
}

#[test]
fn knife_edge() {
    compare::<KnifeEdge>(&[VELOCITY]);
}

struct Wire;

impl System for Wire {
    const TEXT: &'static str = "coordinates(x, y), lagrangian = (dot(x)^2 + dot(y)^2)/2 - 9.81*y, constraint(wire) = y - x^4/4*(1 + sin(t)/5)";
    const DOF: usize = 2;
    fn equations(t: Dual, q: &[Dual], _: &[Dual]) -> Vec<Dual> {
        vec![q[1] - q[0].powi(4) / 4.0 * (t.sin() / 5.0 + 1.0)]
    }
}

#[test]
fn moving_wire() {
    compare::<Wire>(&[CURVED]);
}

struct Sleigh;

impl System for Sleigh {
    const TEXT: &'static str = "coordinates(x, y, phi), lagrangian = (dot(x)^2 + dot(y)^2 + dot(phi)^2)/2, constraint(blade) = dot(y)*cos(phi) - dot(x)*sin(phi) - a*dot(phi)";
    const DOF: usize = 3;
    const PARAMETERS: &'static [(&'static str, f64)] = &[("a", 0.4)];
    fn equations(_: Dual, q: &[Dual], v: &[Dual]) -> Vec<Dual> {
        vec![v[1] * q[2].cos() - v[0] * q[2].sin() - v[2] * 0.4]
    }
}

#[test]
fn chaplygin_sleigh() {
    compare::<Sleigh>(&[VELOCITY]);
}

/// A ball on a table that turns and swings.
struct Ball;

impl System for Ball {
    const TEXT: &'static str =
        "coordinates(r[3], e[4]), let w = body_rate(e), let ws = rotate(e, w),
        lagrangian = inner(dot(r), dot(r))/2 + inner(w, w)/5,
        constraint(unit) = inner(e, e) - 1,
        constraint(roll) = dot(r) - cross(ws, [0, 0, a]) - t*r,
        constraint(hinge) = inner(rotate(e, [1, 0, 0]), [0, 0, 1]),
        constraint(arm) = norm(r + rotate(e, d)) - 1";
    const DOF: usize = 7;
    const PARAMETERS: &'static [(&'static str, f64)] = &[("a", 0.3)];
    const ARRAYS: &'static [(&'static str, &'static [f64])] = &[("d", &[0.2, -0.1, 0.4])];
    fn equations(t: Dual, q: &[Dual], v: &[Dual]) -> Vec<Dual> {
        let (r, e, rate) = (&q[..3], [q[3], q[4], q[5], q[6]], [v[3], v[4], v[5], v[6]]);
        // The angular velocity in space is the vector part of 2 ė ∘ ē, scaled by |e|² where the quaternion is no unit.
        let square = e.iter().fold(Dual::from_re(0.0), |sum, x| sum + *x * *x);
        let w = product(rate, conjugate(e));
        let w = [w[1], w[2], w[3]].map(|x| x * square * 2.0);
        let turned = |d: [f64; 3]| {
            let d = [
                Dual::from_re(0.0),
                Dual::from_re(d[0]),
                Dual::from_re(d[1]),
                Dual::from_re(d[2]),
            ];
            let turned = product(product(e, d), conjugate(e));
            [turned[1], turned[2], turned[3]]
        };
        let arm = turned([0.2, -0.1, 0.4]);
        let ends = [r[0] + arm[0], r[1] + arm[1], r[2] + arm[2]];
        let length = ends
            .iter()
            .fold(Dual::from_re(0.0), |sum, x| sum + *x * *x)
            .sqrt();
        vec![
            square - 1.0,
            // w × (0, 0, a) = (w₂ a, −w₁ a, 0)
            v[0] - w[1] * 0.3 - t * r[0],
            v[1] + w[0] * 0.3 - t * r[1],
            v[2] - t * r[2],
            turned([1.0, 0.0, 0.0])[2],
            length - 1.0,
        ]
    }
}

/// The product of quaternions, scalar first.
fn product(a: [Dual; 4], b: [Dual; 4]) -> [Dual; 4] {
    [
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] + a[2] * b[0] + a[3] * b[1] - a[1] * b[3],
        a[0] * b[3] + a[3] * b[0] + a[1] * b[2] - a[2] * b[1],
    ]
}

fn conjugate(e: [Dual; 4]) -> [Dual; 4] {
    [e[0], -e[1], -e[2], -e[3]]
}

#[test]
fn bodies_in_space() {
    compare::<Ball>(&[QUADRATIC, VELOCITY, VELOCITY, VELOCITY, QUADRATIC, CURVED]);
}

/// Velocities are leaves of their own in a Hamiltonian model, and a family becomes one row a member.
struct Loop;

impl System for Loop {
    const TEXT: &'static str = "coordinates(x[3], y[3]), momenta(px[3], py[3]),
        hamiltonian = inner(px, px)/2 + inner(py, py)/3 + px[0]*x[1],
        constraint(rod[i in 0..2]) = (x[i+1] - x[i])^2 + (y[i+1] - y[i])^2 - l[i]^2*cosh(t),
        constraint(given) = exp(x[2])*dot(x[2]) - dot(cos(t)*y[0])";
    const DOF: usize = 6;
    const ARRAYS: &'static [(&'static str, &'static [f64])] = &[("l", &[0.7, 1.1])];
    fn equations(t: Dual, q: &[Dual], v: &[Dual]) -> Vec<Dual> {
        let rod = |i: usize, l: f64| {
            (q[i + 1] - q[i]).powi(2) + (q[i + 4] - q[i + 3]).powi(2) - t.cosh() * l * l
        };
        let given = q[2].exp() * v[2] - t.cos() * v[3] + t.sin() * q[3];
        vec![rod(0, 0.7), rod(1, 1.1), given]
    }
}

#[test]
fn rods_of_a_hamiltonian_model() {
    compare::<Loop>(&[QUADRATIC, QUADRATIC, INTEGRABLE]);
}

#[test]
fn nothing_is_computed_that_vanishes() {
    let text = "coordinates(x, y, z), lagrangian = (dot(x)^2 + dot(y)^2 + dot(z)^2)/2, constraint(plane) = x + 2*y, constraint(rod) = x^2 + z^2 - 1";
    let derivation = Derivation::of(&declare(text, &Context::default()).expect("a model"));
    let second = Request {
        constraint_second: true,
        ..Request::default()
    };
    assert_eq!(
        derivation.program(second).to_string(),
        "t0 = 2 * v[0]\n\
         psi_q[1, 0] = t0\n\
         A_rate[1, 0] = t0\n\
         t1 = 2 * v[2]\n\
         psi_q[1, 2] = t1\n\
         A_rate[1, 2] = t1\n\
         t2 = 2 * mu[1]\n\
         bend[0, 0] = t2\n\
         bend[2, 2] = t2\n\
         rate_v[0, 0] = t2\n\
         rate_v[2, 2] = t2\n"
    );
    assert!(!derivation.structure().linear);
    assert!(!derivation.structure().time_dependent);
    assert_eq!(derivation.structure().cyclic, []);
}

#[test]
fn the_time_in_a_constraint_is_the_time_in_the_model() {
    for text in [
        "constraint(a) = x - sin(t)",
        "constraint(a) = dot(x) - t*y",
        "constraint(a) = t*dot(x)",
    ] {
        let text = format!("coordinates(x, y), lagrangian = dot(x)^2 + dot(y)^2, {text}");
        let derivation = Derivation::of(&declare(&text, &Context::default()).expect("a model"));
        assert!(derivation.structure().time_dependent, "{text}");
    }
}
