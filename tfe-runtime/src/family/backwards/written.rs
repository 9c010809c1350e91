//! Reverse-mode differentiation of kernels of run-time length by a tape (T-149).

use crate::family::model::{Gradient, Model};
use crate::family::pattern::Pattern;
use crate::lanes::Lanes;
use crate::pull::Results;
use crate::tape::{LANES, Operations, Row, Tape, Taped};
use alloc::vec;
use alloc::vec::Vec;
use core::cell::RefCell;

/// Values at several points.
pub(super) type Points = Lanes<LANES>;

/// Adds Σ weights · ∂(first derivatives and forces)/∂a at several points to the sum of every parameter a. The weights
/// are those of the derivatives by z, by q, and of the forces.
pub(super) fn add_of_points<M: Model>(
    tape: &mut Tape,
    model: &M,
    (t, q, z): (Points, &[Points], &[Points]),
    weights: [&[Points]; 3],
) {
    let ends = tape.record(|operations| {
        let still = |values: &[Points]| -> Vec<Taped> {
            values.iter().map(|value| Taped::of(value.0)).collect()
        };
        first(model, Taped::time(t.0, operations), &still(q), &still(z))
    });
    let weights = weights.into_iter().flatten().map(|weights| &weights.0);
    tape.read(ends.into_iter().zip(weights));
}

/// Adds Σ weights · ∂y/∂(a, q, z) of results y at one place to the sums of the parameters a, and of the variables after
/// them: coordinates, then velocities (momenta).
pub(super) fn add_of_place<M: Model>(
    tape: &mut Tape,
    model: &M,
    (t, q, z): (f64, &[f64], &[f64]),
    results: Results,
    weights: &[f64],
) {
    let parameters = model.parameters();
    let ends = tape.record(|operations| {
        let q = variables(q, parameters, operations);
        let z = variables(z, parameters + q.len(), operations);
        let time = Taped::time([t; LANES], operations);
        match results {
            Results::Slopes => first(model, time, &q, &z),
            Results::Observables => {
                let mut values = vec![Taped::of([0.0; LANES]); model.columns()];
                model.observables(time, &q, &z, &mut values);
                values.iter().map(Taped::place).collect()
            }
        }
    });
    let weights = weights.iter().map(|weight| [*weight, 0.0, 0.0, 0.0]);
    let weights: Vec<Row> = weights.collect();
    tape.read(ends.into_iter().zip(&weights));
}

/// Adds Σ weights · ∂(φ, a, A)/∂a at several points to the sum of every parameter a; A in the order of its sparsity
/// pattern.
pub(super) fn add_of_rows<M: Model>(
    tape: &mut Tape,
    model: &M,
    (t, q): (Points, &[Points]),
    pattern: &Pattern,
    weights: [&[Points]; 3],
) {
    let ends = tape.record(|operations| {
        let q: Vec<Taped> = q.iter().map(|value| Taped::of(value.0)).collect();
        rows(model, Taped::time(t.0, operations), &q, pattern)
    });
    let weights = weights.into_iter().flatten().map(|weights| &weights.0);
    tape.read(ends.into_iter().zip(weights));
}

/// The same at one place, without φ; the derivatives by coordinates are in the places after those of the parameters.
pub(super) fn add_of_rows_at<M: Model>(
    tape: &mut Tape,
    model: &M,
    (t, q): (f64, &[f64]),
    pattern: &Pattern,
    (drift, entries): (&[f64], &[f64]),
) {
    let ends = tape.record(|operations| {
        let q = variables(q, model.parameters(), operations);
        rows(model, Taped::time([t; LANES], operations), &q, pattern)
    });
    let weights = drift.iter().map(|_| &0.0).chain(drift).chain(entries);
    let weights: Vec<Row> = weights.map(|weight| [*weight, 0.0, 0.0, 0.0]).collect();
    tape.read(ends.into_iter().zip(&weights));
}

/// The places on the tape of φ, a and A.
fn rows<M: Model>(model: &M, time: Taped<'_>, q: &[Taped<'_>], pattern: &Pattern) -> Vec<u32> {
    let (m, zero) = (model.constraints(), Taped::of([0.0; LANES]));
    let (mut phi, mut drift) = (vec![zero; m], vec![zero; m]);
    let mut entries = vec![zero; pattern.places().len()];
    model.constraint_values(time, q, &mut phi);
    model.constraint_rows(time, q, &mut drift, &mut pattern.add_to(&mut entries));
    let all = phi.iter().chain(&drift).chain(&entries);
    all.map(Taped::place).collect()
}

fn variables<'t>(
    values: &[f64],
    first: usize,
    operations: &'t RefCell<Operations>,
) -> Vec<Taped<'t>> {
    let all = values.iter().enumerate();
    all.map(|(a, value)| Taped::variable([*value; LANES], first + a, operations))
        .collect()
}

/// The places on the tape of the first derivatives and forces.
fn first<M: Model>(model: &M, time: Taped<'_>, q: &[Taped<'_>], z: &[Taped<'_>]) -> Vec<u32> {
    let mut results = vec![Taped::of([0.0; LANES]); 3 * q.len()];
    let (by_z, others) = results.split_at_mut(q.len());
    let (by_q, force) = others.split_at_mut(q.len());
    let first = Gradient {
        z: by_z,
        q: by_q,
        force,
    };
    model.first(time, q, z, first);
    results.iter().map(Taped::place).collect()
}
