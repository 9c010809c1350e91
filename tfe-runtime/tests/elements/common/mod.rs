//! Models written by hand, and the reference tables.
#![allow(dead_code, reason = "each test takes the models it needs")]

use tfe_runtime::{CoordinateName, Facts, First, Form, Model, Real, Second, State};

/// A model from two functions: its energy function, and all of its derivatives.
macro_rules! model {
    (
        $(#[$doc:meta])* $name:ident[$n:literal] { $($field:ident),* }
        $form:ident $facts:expr;
        value($s:ident, $t:ident, $q:ident, $z:ident) $value:block
        derivatives($first:ident, $second:ident) $derivatives:block
    ) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug)]
        pub(crate) struct $name { $(pub(crate) $field: f64),* }

        impl Model<$n> for $name {
            const FORM: Form = Form::$form;
            const FACTS: Facts = $facts;

            fn energy_function<R: Real>(&$s, $t: R, $q: &[R; $n], $z: &[R; $n]) -> R {
                let _ = $t;
                $value
            }

            fn first<R: Real>(&self, t: R, q: &[R; $n], z: &[R; $n], first: &mut First<R, $n>) {
                self.second(t, q, z, first, &mut Second::zero());
            }

            fn first_and_mass<R: Real>(
                &self,
                t: R,
                q: &[R; $n],
                z: &[R; $n],
                first: &mut First<R, $n>,
                zz: &mut [[R; $n]; $n],
            ) {
                let mut second = Second::zero();
                self.second(t, q, z, first, &mut second);
                *zz = second.zz;
            }

            fn second<R: Real>(
                &$s,
                $t: R,
                $q: &[R; $n],
                $z: &[R; $n],
                $first: &mut First<R, $n>,
                $second: &mut Second<R, $n>,
            ) {
                let _ = $t;
                $derivatives
            }

            fn coordinate_name(index: usize) -> CoordinateName {
                CoordinateName { name: "q", index: Some(index) }
            }
        }
    };
}

fn c<R: Real>(value: f64) -> R {
    R::from_f64(value)
}

const SIMPLE: Facts = Facts {
    time_dependent: false,
    forced: false,
    quadratic_in_z: true,
    constant_mass: true,
    linear: false,
    separable: true,
    smooth: true,
};

model! {
    /// L = v²/2 + cos q
    PendulumL[1] {} Lagrangian SIMPLE;
    value(self, t, q, v) { v[0] * v[0] * c(0.5) + q[0].cos() }
    derivatives(first, second) {
        let (sin, cos) = q[0].sin_cos();
        (first.z[0], first.q[0]) = (v[0], -sin);
        (second.zz[0][0], second.qq[0][0]) = (c(1.0), -cos);
    }
}

model! {
    /// H = p²/2 − cos q
    PendulumH[1] {} Hamiltonian SIMPLE;
    value(self, t, q, p) { p[0] * p[0] * c(0.5) - q[0].cos() }
    derivatives(first, second) {
        let (sin, cos) = q[0].sin_cos();
        (first.z[0], first.q[0]) = (p[0], sin);
        (second.zz[0][0], second.qq[0][0]) = (c(1.0), cos);
    }
}

model! {
    /// m q̈ + c q̇ + k q = 0, from L
    OscillatorL[1] { m, d, k } Lagrangian Facts { forced: true, linear: true, ..SIMPLE };
    value(self, t, q, v) {
        v[0] * v[0] * c(0.5 * self.m) - q[0] * q[0] * c(0.5 * self.k)
    }
    derivatives(first, second) {
        (first.z[0], first.q[0]) = (v[0] * c(self.m), -q[0] * c(self.k));
        first.force[0] = -v[0] * c(self.d);
        (second.zz[0][0], second.qq[0][0]) = (c(self.m), c(-self.k));
        second.force_z[0][0] = c(-self.d);
    }
}

model! {
    /// The same from H
    OscillatorH[1] { m, d, k } Hamiltonian Facts { forced: true, linear: true, ..SIMPLE };
    value(self, t, q, p) {
        p[0] * p[0] * c(0.5 / self.m) + q[0] * q[0] * c(0.5 * self.k)
    }
    derivatives(first, second) {
        (first.z[0], first.q[0]) = (p[0] * c(1.0 / self.m), q[0] * c(self.k));
        first.force[0] = -p[0] * c(self.d / self.m);
        (second.zz[0][0], second.qq[0][0]) = (c(1.0 / self.m), c(self.k));
        second.force_z[0][0] = c(-self.d / self.m);
    }
}

model! {
    /// Damped, with a mass that depends on q and a force that depends on time:
    /// L = (1 + q²/4) v²/2 − q²/2 − q⁴/4, Q = −d v (1 + q²) + sin 2t
    DuffingL[1] { d } Lagrangian
        Facts { time_dependent: true, forced: true, constant_mass: false, separable: false, ..SIMPLE };
    value(self, t, q, v) {
        let (x, x2) = (q[0], q[0] * q[0]);
        (c::<R>(1.0) + x2 * c(0.25)) * v[0] * v[0] * c(0.5) - x2 * c(0.5) - x2 * x * x * c(0.25)
    }
    derivatives(first, second) {
        let (x, x2, v) = (q[0], q[0] * q[0], v[0]);
        let mass = c::<R>(1.0) + x2 * c(0.25);
        first.z[0] = mass * v;
        first.q[0] = x * v * v * c(0.25) - x - x2 * x;
        first.force[0] = -v * c(self.d) * (c::<R>(1.0) + x2) + (t * c(2.0)).sin();
        second.zz[0][0] = mass;
        second.zq[0][0] = x * v * c(0.5);
        second.qq[0][0] = v * v * c(0.25) - c(1.0) - x2 * c(3.0);
        second.force_z[0][0] = -c::<R>(self.d) * (c::<R>(1.0) + x2);
        second.force_q[0][0] = -v * x * c(2.0 * self.d);
    }
}

model! {
    /// The same from H = p²/2(1 + q²/4) + q²/2 + q⁴/4, v = p/(1 + q²/4)
    DuffingH[1] { d } Hamiltonian
        Facts { time_dependent: true, forced: true, constant_mass: false, separable: false, ..SIMPLE };
    value(self, t, q, p) {
        let (x, x2) = (q[0], q[0] * q[0]);
        p[0] * p[0] * c(0.5) / (c::<R>(1.0) + x2 * c(0.25)) + x2 * c(0.5) + x2 * x * x * c(0.25)
    }
    derivatives(first, second) {
        let (x, x2, p) = (q[0], q[0] * q[0], p[0]);
        let one = c::<R>(1.0);
        let g = one / (one + x2 * c(0.25));
        let dg = -g * g * x * c(0.5);
        let ddg = -g * g * c(0.5) - g * dg * x;
        let (damping, slope) = ((one + x2) * c(self.d), x * c(2.0 * self.d));
        first.z[0] = p * g;
        first.q[0] = p * p * dg * c(0.5) + x + x2 * x;
        first.force[0] = -damping * p * g + (t * c(2.0)).sin();
        second.zz[0][0] = g;
        second.zq[0][0] = p * dg;
        second.qq[0][0] = p * p * ddg * c(0.5) + one + x2 * c(3.0);
        second.force_z[0][0] = -damping * g;
        second.force_q[0][0] = -slope * p * g - damping * p * dg;
    }
}

model! {
    /// Two point masses 1 on massless rods 1, gravity g, absolute angles
    DoublePendulum[2] { g } Lagrangian Facts { constant_mass: false, separable: false, ..SIMPLE };
    value(self, t, q, v) {
        v[0] * v[0] + v[1] * v[1] * c(0.5) + v[0] * v[1] * (q[0] - q[1]).cos()
            + (q[0].cos() * c(2.0) + q[1].cos()) * c(self.g)
    }
    derivatives(first, second) {
        let (sin, cos) = (q[0] - q[1]).sin_cos();
        let (sin1, cos1) = q[0].sin_cos();
        let (sin2, cos2) = q[1].sin_cos();
        let g = c::<R>(self.g);
        first.z = [v[0] * c(2.0) + v[1] * cos, v[1] + v[0] * cos];
        let coupling = v[0] * v[1] * sin;
        first.q = [-coupling - sin1 * g * c(2.0), coupling - sin2 * g];
        second.zz = [[c(2.0), cos], [cos, c(1.0)]];
        second.zq = [[-v[1] * sin, v[1] * sin], [-v[0] * sin, v[0] * sin]];
        let bend = v[0] * v[1] * cos;
        second.qq = [[-bend - cos1 * g * c(2.0), bend], [bend, -bend - cos2 * g]];
    }
}

model! {
    /// H = (p_x² + p_y²)/2 + (x² + y²)/2 + x² y − y³/3
    HenonHeiles[2] {} Hamiltonian SIMPLE;
    value(self, t, q, p) {
        let (x, y) = (q[0], q[1]);
        (p[0] * p[0] + p[1] * p[1] + x * x + y * y) * c(0.5) + x * x * y - y * y * y * c(1.0 / 3.0)
    }
    derivatives(first, second) {
        let (x, y, two) = (q[0], q[1], c::<R>(2.0));
        first.z = *p;
        first.q = [x + two * x * y, y + x * x - y * y];
        second.zz = [[c(1.0), c(0.0)], [c(0.0), c(1.0)]];
        second.qq = [[c::<R>(1.0) + two * y, two * x], [two * x, c::<R>(1.0) - two * y]];
    }
}

model! {
    /// A relativistic particle in a harmonic potential, L = −√(1 − v²) − q²/2: not quadratic in v
    Relativistic[1] {} Lagrangian Facts { quadratic_in_z: false, constant_mass: false, ..SIMPLE };
    value(self, t, q, v) { -(c::<R>(1.0) - v[0] * v[0]).sqrt() - q[0] * q[0] * c(0.5) }
    derivatives(first, second) {
        let root = (c::<R>(1.0) - v[0] * v[0]).sqrt();
        (first.z[0], first.q[0]) = (v[0] / root, -q[0]);
        (second.zz[0][0], second.qq[0][0]) = (c::<R>(1.0) / (root * root * root), c(-1.0));
    }
}

model! {
    /// Two wells, L = v²/2 − (q² − 2)²/4
    Wells[1] {} Lagrangian SIMPLE;
    value(self, t, q, v) {
        let depth = q[0] * q[0] - c(2.0);
        v[0] * v[0] * c(0.5) - depth * depth * c(0.25)
    }
    derivatives(first, second) {
        let square = q[0] * q[0];
        (first.z[0], first.q[0]) = (v[0], -(square - c(2.0)) * q[0]);
        (second.zz[0][0], second.qq[0][0]) = (c(1.0), c::<R>(2.0) - square * c(3.0));
    }
}

model! {
    /// A stiff spring beside a soft one, L = v·v/2 − k x²/2 − y⁴/4 − x² y²/2
    Stiff[2] { k } Lagrangian SIMPLE;
    value(self, t, q, v) {
        let (x2, y2) = (q[0] * q[0], q[1] * q[1]);
        (v[0] * v[0] + v[1] * v[1] - x2 * c(self.k) - y2 * y2 * c(0.5) - x2 * y2) * c(0.5)
    }
    derivatives(first, second) {
        let (x, y) = (q[0], q[1]);
        let cross = -x * y * c(2.0);
        first.z = *v;
        first.q = [-x * c(self.k) - x * y * y, -y * y * y - x * x * y];
        second.zz = [[c(1.0), c(0.0)], [c(0.0), c(1.0)]];
        second.qq = [
            [-y * y - c(self.k), cross],
            [cross, -y * y * c(3.0) - x * x],
        ];
    }
}

/// A reference table of the project.
pub(crate) fn reference(name: &str) -> serde_json::Value {
    let path = format!(
        "{}/../tests/reference/{name}.json",
        env!("CARGO_MANIFEST_DIR")
    );
    let text = std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{path}: {error}"));
    serde_json::from_str(&text).unwrap_or_else(|error| panic!("{path}: {error}"))
}

/// The numbers of a (nested) list, row by row.
pub(crate) fn numbers(value: &serde_json::Value) -> Vec<f64> {
    match value {
        serde_json::Value::Array(list) => list.iter().flat_map(numbers).collect(),
        _ => vec![value.as_f64().expect("a number")],
    }
}

/// p, then q: the order of transition matrices.
pub(crate) fn vector<const N: usize>(state: &State<N>) -> Vec<f64> {
    state.p.iter().chain(&state.q).copied().collect()
}

#[track_caller]
pub(crate) fn assert_close(actual: &[f64], expected: &[f64], tolerance: f64, what: &str) {
    assert_eq!(actual.len(), expected.len(), "{what}");
    for (actual, expected) in actual.iter().zip(expected) {
        let error = (actual - expected).abs() / expected.abs().max(1.0);
        // Written so that a NaN fails.
        assert!(
            error <= tolerance,
            "{what}: {actual} for {expected}, {error:.1e}"
        );
    }
}

/// The state after `steps` steps of length `h`, from t = 0.
pub(crate) fn run<M, const N: usize>(
    model: &M,
    element: tfe_runtime::Element,
    start: State<N>,
    h: f64,
    steps: usize,
) -> State<N>
where
    M: Model<N>,
{
    let control = tfe_runtime::step::Control::default();
    run_with(model, element, control, start, h, steps).0
}

/// The same with a choice of solver, and its counts.
pub(crate) fn run_with<M, const N: usize>(
    model: &M,
    element: tfe_runtime::Element,
    control: tfe_runtime::step::Control,
    start: State<N>,
    h: f64,
    steps: usize,
) -> (State<N>, tfe_runtime::Statistics)
where
    M: Model<N>,
{
    let mut stepper =
        tfe_runtime::step::Stepper::new(model, element, control).expect("a valid element");
    let mut state = start;
    for step in 0..steps {
        stepper
            .advance(step as f64 * h, h, &mut state, &[])
            .expect("a step");
    }
    (state, *stepper.statistics())
}
