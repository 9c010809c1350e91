//! Whole runs in dual numbers, by a solver of their own: the oracle of derivatives, without differences.

use super::*;
use tfe::runtime::dual::Dual;
use tfe::runtime::scheme::{SchemeTable, Tables as _};
use tfe::runtime::{First, Form};

/// Enough for steps that contract by a factor of four; derivatives converge as values do.
const ITERATIONS: usize = 40;

/// A⁻¹ r, by elimination with a choice of rows, where r carries derivatives.
fn solved<const N: usize>(mut matrix: [[f64; N]; N], mut right: [Dual; N]) -> [Dual; N] {
    for column in 0..N {
        let size = |row: usize| matrix[row][column].abs();
        let pivot = (column..N).max_by(|a, b| size(*a).total_cmp(&size(*b)));
        let pivot = pivot.expect("a row");
        matrix.swap(column, pivot);
        right.swap(column, pivot);
        for row in column + 1..N {
            let factor = matrix[row][column] / matrix[column][column];
            for k in column..N {
                matrix[row][k] -= factor * matrix[column][k];
            }
            right[row] -= right[column] * number(factor);
        }
    }
    for row in (0..N).rev() {
        for k in row + 1..N {
            right[row] -= right[k] * number(matrix[row][k]);
        }
        right[row] = right[row] / number(matrix[row][row]);
    }
    right
}

fn number(value: f64) -> Dual {
    Dual::new(value, 0.0)
}

/// start + h Σ weight · rate
fn moved<const N: usize>(
    start: &[Dual; N],
    h: f64,
    weights: &[f64],
    rates: &[[Dual; N]],
) -> [Dual; N] {
    let mut sum = *start;
    for (weight, rate) in weights.iter().zip(rates) {
        for a in 0..N {
            sum[a] += rate[a] * number(h * weight);
        }
    }
    sum
}

/// The end of a run of a Gauss element in dual numbers, q then p, with the derivative by a parameter, or by what the slopes of the start say.
fn end_in_duals<M: Model<N>, const N: usize>(
    model: &M,
    element: Element,
    (mut q, mut p): ([Dual; N], [Dual; N]),
    (steps, h): (u32, f64),
    parameter: Option<usize>,
) -> ([Dual; N], [Dual; N]) {
    let table = SchemeTable::new(element).expect("an element");
    let scheme = table.view();
    let points = scheme.points();
    for step in 0..steps {
        let begin = f64::from(step) * h;
        let zero = [number(0.0); N];
        let (mut rates, mut forces) = (vec![zero; points], vec![zero; points]);
        for _ in 0..ITERATIONS {
            for l in 0..points {
                let row = &scheme.position[l * points..(l + 1) * points];
                let time = Dual::new(begin + scheme.nodes[l] * h, 0.0).by_parameter(parameter);
                let (here, momentum) = (moved(&q, h, row, &rates), moved(&p, h, row, &forces));
                let mut first = First::zero();
                match M::FORM {
                    Form::Hamiltonian => {
                        model.first(time, &here, &momentum, &mut first);
                        rates[l] = first.z;
                    }
                    // L_v(q, v) = p by Newton's method with the mass matrix in mere numbers.
                    Form::Lagrangian => {
                        model.first(time, &here, &rates[l], &mut first);
                        let mut left = first.z;
                        for a in 0..N {
                            left[a] -= momentum[a];
                        }
                        let (mut plain, mut mass) = (First::ZERO, [[0.0; N]; N]);
                        let (at, v) = (here.map(|x| x.value), rates[l].map(|x| x.value));
                        model.first_and_mass(time.value, &at, &v, &mut plain, &mut mass);
                        let change = solved(mass, left);
                        for a in 0..N {
                            rates[l][a] -= change[a];
                        }
                        model.first(time, &here, &rates[l], &mut first);
                    }
                }
                for a in 0..N {
                    forces[l][a] = match M::FORM {
                        Form::Hamiltonian => first.force[a] - first.q[a],
                        Form::Lagrangian => first.q[a] + first.force[a],
                    };
                }
            }
        }
        q = moved(&q, h, scheme.weights, &rates);
        p = moved(&p, h, scheme.weights, &forces);
    }
    (q, p)
}

/// The largest difference over the largest derivative, by all parameters and by the start.
fn off<M: Model<N> + Sync, const N: usize>(
    model: &M,
    start: State<N>,
    element: Element,
    (steps, h): (u32, f64),
) -> f64 {
    let run = Simulation::new(model).element(element).step(h);
    let s = run.run_sensitive(start, 0.0..f64::from(steps) * h);
    let s = s.expect("derivatives");
    assert_eq!(s.motion().states().len(), steps as usize + 1);
    let (mut off, mut size) = (0.0_f64, 0.0_f64);
    let mut see = |found: f64, expected: f64| {
        assert!(found.is_finite() && expected.is_finite());
        (off, size) = (off.max((found - expected).abs()), size.max(expected.abs()));
    };
    let still = (start.q.map(number), start.p.map(number));
    for (index, name) in s.parameters().iter().enumerate() {
        let (q, p) = end_in_duals(model, element, still, (steps, h), Some(index));
        let found = s.by(name).last();
        for a in 0..N {
            see(found.q[a], q[a].slope);
            see(found.p[a], p[a].slope);
        }
    }
    let matrix = s.by_start().last();
    for column in 0..2 * N {
        let (mut from_q, mut from_p) = still;
        // Ordered (p, q).
        match column.checked_sub(N) {
            None => from_p[column].slope = 1.0,
            Some(a) => from_q[a].slope = 1.0,
        }
        let (q, p) = end_in_duals(model, element, (from_q, from_p), (steps, h), None);
        for a in 0..N {
            see(matrix[(a, column)], p[a].slope);
            see(matrix[(N + a, column)], q[a].slope);
        }
    }
    off / size
}

#[dynamics(
    coordinates(x, y),
    lagrangian = m/2*(dot(x)^2 + dot(y)^2) + mu*m/sqrt(x^2 + y^2) + b/2*(x*dot(y) - y*dot(x)),
)]
struct Charged {
    m: f64,
    mu: f64,
    b: f64,
}

#[dynamics(coordinates(x), lagrangian = dot(x)^2/2 - k*x^2/2, force(x) = mu*(a - x^2)*dot(x) + f*cos(omega*t))]
struct VanDerPol {
    k: f64,
    mu: f64,
    a: f64,
    f: f64,
    omega: f64,
}

#[dynamics(
    coordinates(q[8]),
    lagrangian = sum(i in 0..8, m[i]/2*dot(q[i])^2) - sum(i in 0..7, k[i]*((q[i+1] - q[i])^2/2 + e*(q[i+1] - q[i])^4/4)) - q[0]^2/2,
    force(q[i]) = -c*dot(q[i]),
)]
struct Row {
    m: [f64; 8],
    k: [f64; 7],
    e: f64,
    c: f64,
}

#[dynamics(
    coordinates(r, theta, z),
    lagrangian = m/2*(dot(r)^2 + r^2*dot(theta)^2 + (1 + s*r^2)*dot(z)^2 + 2*s*dot(r)*dot(z)) - k*(r - l)^2/2 - m*g*z - exp(-s*z),
)]
struct Coil {
    m: f64,
    s: f64,
    k: f64,
    l: f64,
    g: f64,
}

#[dynamics(
    coordinates(x, y),
    momenta(px, py),
    hamiltonian = px^2/(2*(a + x^2)) + py^2/(2*b) + c*px*py*tanh(x)/4 + d*ln(1 + x^2 + y^2),
)]
struct Bent {
    a: f64,
    b: f64,
    c: f64,
    d: f64,
}

/// Eight models, two elements: what is differentiated is every operation of the run.
#[test]
fn derivatives_are_those_of_runs_in_dual_numbers() {
    // Roundings of ten steps of both, relative to the largest derivative.
    const ROUNDING: f64 = 1e-12;
    let charged = Charged {
        m: 1.3,
        mu: 1.1,
        b: 0.4,
    };
    let van_der_pol = VanDerPol {
        k: 1.1,
        mu: 0.7,
        a: 0.9,
        f: 0.3,
        omega: 1.4,
    };
    let swing = |a: usize| (a as f64).sin();
    let row = Row {
        m: std::array::from_fn(|a| 1.0 + 0.3 * swing(a)),
        k: std::array::from_fn(|a| 1.5 + 0.5 * swing(2 * a)),
        e: 0.3,
        c: 0.05,
    };
    let coil = Coil {
        m: 1.1,
        s: 0.4,
        k: 6.0,
        l: 0.8,
        g: 1.2,
    };
    let bent = Bent {
        a: 1.2,
        b: 0.8,
        c: 0.5,
        d: 0.7,
    };
    let ball = Ball {
        m: 0.7,
        g: 9.81,
        floor: -1e3,
    };
    let span = (10, 0.05);
    for element in [Element::mixed(3), Element::mixed(6)] {
        let starts = PENDULUMS.state([0.7, -0.4], [0.2, 0.5]);
        let swaying = row.state(std::array::from_fn(|a| 0.5 * swing(3 * a)), [0.1; 8]);
        let found = [
            ("pendulums", off(&PENDULUMS, starts, element, span)),
            ("driven", off(&DRIVEN, PHASE, element, span)),
            (
                "charged",
                off(
                    &charged,
                    charged.state([1.0, 0.1], [0.1, 1.1]),
                    element,
                    span,
                ),
            ),
            (
                "van der Pol",
                off(&van_der_pol, van_der_pol.state([0.5], [0.2]), element, span),
            ),
            ("row", off(&row, swaying, element, span)),
            (
                "coil",
                off(
                    &coil,
                    coil.state([1.0, 0.2, 0.1], [0.1, 0.9, -0.2]),
                    element,
                    span,
                ),
            ),
            ("bent", off(&bent, PHASE, element, span)),
            ("ball", off(&ball, ball.state([1.0], [4.0]), element, span)),
        ];
        for (name, off) in found {
            assert!(off < ROUNDING, "{name}, {element}: {off:.1e}");
        }
    }
}
