//! Comparisons of all kernels of a model.

use crate::engine::{Oracle, STEP, flat};
use tfe::Model;
use tfe::runtime::{By, ConstraintKind, ConstraintSecond, First, Second};
use tfe_symbolic::model::declared;
use tfe_symbolic::program::interpret::Results;
use tfe_symbolic::program::{self, Request};

/// Compares all kernels of a model at a few points.
pub fn compare<M: Model<N>, const N: usize>(model: &M, mut oracle: Oracle) {
    // Numbers in (0.15, 0.85) without a pattern: multiples of the golden ratio modulo one.
    let mut state = 0.5_f64;
    let mut next = || {
        state = (state + 0.618_033_988_749_894_9).fract();
        0.15 + 0.7 * state
    };
    for sign in [1.0, -1.0, 1.0, -1.0, 1.0] {
        let t = next();
        let q: [f64; N] = std::array::from_fn(|_| sign * next());
        let z: [f64; N] = std::array::from_fn(|k| if k % 2 == 0 { next() } else { -next() });
        oracle.environment.time = t;
        oracle.environment.q = q.to_vec();
        oracle.environment.z = z.to_vec();

        let value = oracle
            .run(Request {
                value: true,
                ..Request::default()
            })
            .value;
        same("value", model.energy_function(t, &q, &z), value);

        let mut first = First::<f64, N>::ZERO;
        model.first(t, &q, &z, &mut first);
        let expected = oracle.run(Request {
            first: true,
            ..Request::default()
        });
        firsts(&first, &expected);

        let (mut first, mut mass) = (First::<f64, N>::ZERO, [[0.0; N]; N]);
        model.first_and_mass(t, &q, &z, &mut first, &mut mass);
        let expected = oracle.run(Request {
            first: true,
            mass: true,
            ..Request::default()
        });
        firsts(&first, &expected);
        block("mass", &mass, &expected.zz);

        let (mut first, mut second) = (First::<f64, N>::ZERO, Second::<f64, N>::ZERO);
        model.second(t, &q, &z, &mut first, &mut second);
        let expected = oracle.run(Request {
            first: true,
            second: true,
            ..Request::default()
        });
        firsts(&first, &expected);
        block("zz", &second.zz, &expected.zz);
        block("zq", &second.zq, &expected.zq);
        block("qq", &second.qq, &expected.qq);
        block("force_z", &second.force_z, &expected.force_z);
        block("force_q", &second.force_q, &expected.force_q);

        let mut values = vec![0.0; M::OBSERVABLES.len()];
        model.observables(t, &q, &z, &mut values);
        let expected = oracle.run(Request {
            observables: true,
            ..Request::default()
        });
        vector("observables", &values, &expected.observables);

        sensitivities(model, &mut oracle, t, &q, &z);

        oracle.environment.mu = oracle.constraints.iter().map(|_| next() - 0.5).collect();
        constraints(model, &oracle, t, &q, &z);
    }
}

/// Compares the derivatives by parameters and by time with the interpreter, to the last bit, and with difference
/// quotients.
fn sensitivities<M: Model<N>, const N: usize>(
    model: &M,
    oracle: &mut Oracle,
    t: f64,
    q: &[f64; N],
    z: &[f64; N],
) {
    let names: Vec<String> = oracle
        .sensitivities
        .iter()
        .map(ToString::to_string)
        .collect();
    assert_eq!(M::SENSITIVITIES, names);
    let beyond = names.len();
    let mut untouched = First::<f64, N>::ZERO;
    model.first_by(By::Parameter(beyond), t, q, z, &mut untouched);
    assert_eq!(untouched, First::ZERO);
    assert!(model.sensitivity_parameter(beyond).is_nan());
    if names.is_empty() {
        return;
    }
    let parameters = (0..beyond).map(|k| (By::Parameter(k), program::By::Parameter(k)));
    for (by, same_by) in parameters.chain([(By::Time, program::By::Time)]) {
        if let By::Parameter(k) = by {
            same(
                "parameter",
                model.sensitivity_parameter(k),
                *oracle.value(same_by),
            );
        }
        let mut first = First::<f64, N>::ZERO;
        model.first_by(by, t, q, z, &mut first);
        let expected = oracle.interpreted(&oracle.derivation.program_by(same_by));
        firsts(&first, &expected);
        let (quotient, size) = oracle.difference_quotient(same_by);
        for (derivative, quotient) in flat(&expected).into_iter().zip(quotient) {
            // Rounding: values have errors of about ten units in the last place of their largest term, which may be ten
            // times the largest result; the weights of the quotient sum up to 2, divided by the step. The truncation
            // error h⁸ f⁽⁹⁾/630 = 6e-22 f⁽⁹⁾ is smaller.
            let tolerance = 20.0 * f64::EPSILON * 10.0 * size.max(1.0) / STEP;
            assert!(
                (derivative - quotient).abs() <= tolerance,
                "{by:?}: {derivative} and {quotient}"
            );
        }
    }
}

/// Compares the kernels of the constraints with the interpreter, to the last bit. The engine's own tests compare the
/// interpreter with dual numbers.
fn constraints<M: Model<N>, const N: usize>(
    model: &M,
    oracle: &Oracle,
    t: f64,
    q: &[f64; N],
    v: &[f64; N],
) {
    let kinds = oracle.constraints.iter().map(|constraint| {
        let kind = match constraint.kind {
            declared::ConstraintKind::Holonomic { quadratic } => {
                ConstraintKind::Holonomic { quadratic }
            }
            declared::ConstraintKind::Velocity { integrable } => {
                ConstraintKind::Velocity { integrable }
            }
        };
        (constraint.name.as_str(), kind)
    });
    let declared = M::CONSTRAINTS.iter().map(|c| (c.name, c.kind));
    assert!(declared.eq(kinds));
    let count = M::CONSTRAINTS.len();

    let mut values = vec![0.0; count];
    model.constraint_values(t, q, &mut values);
    let expected = oracle.run(Request {
        constraint_values: true,
        ..Request::default()
    });
    vector("phi", &values, &expected.phi);

    let (mut rows, mut drift) = (vec![[0.0; N]; count], vec![0.0; count]);
    model.constraint_rows(t, q, &mut rows, &mut drift);
    let expected = oracle.run(Request {
        constraint_rows: true,
        ..Request::default()
    });
    vector("drift", &drift, &expected.drift);
    vector("rows", rows.as_flattened(), &expected.rows.concat());

    let (mut psi_q, mut row_rates) = (vec![[0.0; N]; count], vec![[0.0; N]; count]);
    let mut second = ConstraintSecond {
        psi_q: &mut psi_q,
        row_rates: &mut row_rates,
        bend: [[0.0; N]; N],
        rate_q: [[0.0; N]; N],
        rate_v: [[0.0; N]; N],
    };
    model.constraint_second(t, q, v, &oracle.environment.mu, &mut second);
    let expected = oracle.run(Request {
        constraint_second: true,
        ..Request::default()
    });
    block("bend", &second.bend, &expected.bend);
    block("rate_q", &second.rate_q, &expected.rate_q);
    block("rate_v", &second.rate_v, &expected.rate_v);
    vector("psi_q", psi_q.as_flattened(), &expected.psi_q.concat());
    let expected = expected.row_rates.concat();
    vector("row_rates", row_rates.as_flattened(), &expected);
}

#[track_caller]
fn firsts<const N: usize>(first: &First<f64, N>, expected: &Results) {
    vector("z", &first.z, &expected.z);
    vector("q", &first.q, &expected.q);
    vector("force", &first.force, &expected.force);
}

#[track_caller]
fn block<const N: usize>(name: &str, block: &[[f64; N]; N], expected: &[Vec<f64>]) {
    assert_eq!(N, expected.len());
    for (row, expected) in block.iter().zip(expected) {
        vector(name, row, expected);
    }
}

#[track_caller]
fn vector(name: &str, vector: &[f64], expected: &[f64]) {
    assert_eq!(vector.len(), expected.len(), "{name}");
    for (compiled, interpreted) in vector.iter().zip(expected) {
        same(name, *compiled, *interpreted);
    }
}

/// Asserts that both are equal, and finite, since otherwise the comparison would say nothing.
#[track_caller]
fn same(name: &str, compiled: f64, interpreted: f64) {
    assert!(interpreted.is_finite(), "{name}: {interpreted}");
    assert_eq!(compiled, interpreted, "{name}");
}
