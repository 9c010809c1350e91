//! Models with constraints: a body described by a unit quaternion, whose mass matrix is singular, and a rod whose
//! length is a parameter of its constraint.

use super::*;
use crate::duals::{array, moved, root};
use tfe::runtime::First;
use tfe::runtime::dual::Dual;
use tfe::runtime::scheme::{SchemeTable, Tables as _};

/// P_j′(2c − 1) for j = 1, 2, 3.
fn legendre_slopes(c: f64) -> [f64; 3] {
    let x = 2.0 * c - 1.0;
    [1.0, 3.0 * x, (15.0 * x * x - 3.0) / 2.0]
}

/// The end of one constrained element: the equations (T-72), (T-73) and (T-80) as in the theory, for holonomic
/// constraints.
fn constrained_end<M: Model<N>, const N: usize, const R: usize>(
    model: &M,
    element: Element,
    start: &Phase,
    (t, h): (f64, f64),
    parameter: Option<usize>,
) -> Phase {
    let table = SchemeTable::new(element).expect("an element");
    let scheme = table.view();
    let s = scheme.points();
    let time = |c: f64| number(t + c * h).by_parameter(parameter);
    let first = |c: f64, q: &[Dual], v: &[Dual]| {
        let mut first = First::zero();
        model.first(time(c), &array::<N>(q), &array(v), &mut first);
        first
    };
    let values = |c: f64, q: &[Dual]| {
        let mut values = [number(0.0); R];
        model.constraint_values(time(c), &array::<N>(q), &mut values);
        values
    };
    // A and the sum Aᵀ μ.
    let rows = |c: f64, q: &[Dual]| {
        let (mut rows, mut drift) = ([[number(0.0); N]; R], [number(0.0); R]);
        model.constraint_rows(time(c), &array::<N>(q), &mut rows, &mut drift);
        rows
    };
    let along = |rows: &[[Dual; N]; R], mu: &[Dual], a: usize| {
        let terms = rows.iter().zip(mu);
        terms.fold(number(0.0), |sum, (row, mu)| sum + row[a] * *mu)
    };
    let span = number(h);
    // From the rates and multipliers of an element: the residual, and the state at its end.
    let made = |x: &[Dual]| {
        let (rates, x) = x.split_at(s * N);
        let (multipliers, x) = x.split_at(s * R);
        let (last_v, eta) = x.split_at(N);
        let rates: Vec<Vec<Dual>> = rates.chunks(N).map(<[Dual]>::to_vec).collect();
        let (mut z, mut forces) = (vec![], vec![]);
        let mut inside = vec![[number(0.0); R]; s - 1];
        for l in 0..s {
            let c = scheme.nodes[l];
            let q = moved(&start.q, span, &scheme.position[l * s..(l + 1) * s], &rates);
            let first = first(c, &q, &rates[l]);
            let slopes = legendre_slopes(c);
            let mut mu_rate = [number(0.0); R];
            let phi = values(c, &q);
            for j in 1..s {
                for k in 0..R {
                    mu_rate[k] += multipliers[j * R + k] * number(slopes[j - 1]);
                    inside[j - 1][k] += phi[k] * number(scheme.weights[l] * slopes[j - 1] / h);
                }
            }
            let rows = rows(c, &q);
            let force = (0..N).map(|a| first.q[a] + first.force[a] - along(&rows, &mu_rate, a));
            forces.push(force.collect::<Vec<_>>());
            z.push(first.z);
        }
        let at_start = rows(0.0, &start.q);
        let begun: Vec<Dual> = (0..N)
            .map(|a| start.p[a] - along(&at_start, &multipliers[..R], a))
            .collect();
        let end_q = moved(&start.q, span, scheme.weights, &rates);
        let end_starred = moved(&begun, span, scheme.weights, &forces);
        let last = first(1.0, &end_q, last_v);
        let at_end = rows(1.0, &end_q);
        let mut residual = vec![];
        for i in 0..s {
            let row = &scheme.position[i * s..(i + 1) * s];
            let momentum = moved(&begun, span, row, &forces);
            residual.extend((0..N).map(|a| z[i][a] - momentum[a]));
        }
        residual.extend(inside.into_iter().flatten());
        residual.extend(values(1.0, &end_q).map(|phi| phi / span));
        residual.extend((0..N).map(|a| last.z[a] + along(&at_end, eta, a) - end_starred[a]));
        residual.extend(at_end.map(|row| {
            let terms = row.iter().zip(last_v);
            terms.fold(number(0.0), |sum, (a, v)| sum + *a * *v)
        }));
        let end = Phase {
            q: end_q,
            p: last.z.to_vec(),
        };
        (residual, end)
    };
    let unknowns = (s + 1) * (N + R);
    let x = root(vec![number(0.0); unknowns], |x| made(x).0);
    made(&x).1
}

fn off_constrained<M: Model<N> + Sync, const N: usize, const R: usize>(
    model: &M,
    start: State<N>,
    element: Element,
    (steps, h): (u32, f64),
) -> f64 {
    let end = |start: &Phase, parameter: Option<usize>| {
        (0..steps).fold(start.clone(), |at, step| {
            let span = (f64::from(step) * h, h);
            constrained_end::<M, N, R>(model, element, &at, span, parameter)
        })
    };
    let run = Simulation::new(model).element(element).step(h);
    off(&run, start, f64::from(steps) * h, &end)
}

/// Two rods, the second hanging from the first: two constraints with parameters of their own.
#[dynamics(
    coordinates(x, y, u, w),
    lagrangian = m/2*(dot(x)^2 + dot(y)^2 + dot(u)^2 + dot(w)^2) - m*g*(y + w) - k*(u - x)^4/4,
    force(x) = -c*dot(x),
    constraint(upper) = x^2 + y^2 - a^2,
    constraint(lower) = (u - x)^2 + (w - y)^2 - b^2,
)]
struct Rods {
    m: f64,
    g: f64,
    k: f64,
    c: f64,
    a: f64,
    b: f64,
}

#[test]
fn derivatives_of_constrained_models_are_those_of_runs_in_dual_numbers() {
    let top = Top {
        i1: 1.1,
        i2: 0.9,
        i3: 0.5,
        mgd: 0.8,
        c: 0.1,
    };
    let rods = Rods {
        m: 1.2,
        g: 9.81,
        k: 0.7,
        c: 0.2,
        a: 1.0,
        b: 1.3,
    };
    let (sin, cos) = 0.4_f64.sin_cos();
    let attitude = [cos, sin * 0.6, 0.0, sin * 0.8];
    // ė = ½ e ∘ (0, w) for w = (0.3, −0.2, 2).
    let w = [0.3, -0.2, 2.0];
    let rate = [
        -attitude[1] * w[0] - attitude[2] * w[1] - attitude[3] * w[2],
        attitude[0] * w[0] + attitude[2] * w[2] - attitude[3] * w[1],
        attitude[0] * w[1] + attitude[3] * w[0] - attitude[1] * w[2],
        attitude[0] * w[2] + attitude[1] * w[1] - attitude[2] * w[0],
    ]
    .map(|twice| 0.5 * twice);
    let spinning = top.state(attitude, rate);
    // Both rods rotate about their upper ends: velocities are perpendicular to them.
    let hanging = rods.state(
        [0.6, -0.8, 0.6 + 0.5, -0.8 - 1.2],
        [0.8 * 0.5, 0.6 * 0.5, 0.4 - 1.2 * 0.7, 0.3 - 0.5 * 0.7],
    );
    for element in [Element::mixed(3), Element::mixed(4)] {
        let off = off_constrained::<_, 4, 1>(&top, spinning, element, (10, 0.05));
        assert!(off < ROUNDING, "top, {element}: {off:.1e}");
        let off = off_constrained::<_, 4, 2>(&rods, hanging, element, (10, 0.05));
        assert!(off < ROUNDING, "rods, {element}: {off:.1e}");
    }
}
