//! The switching functions of a model: by their signs its kernels choose branches.

use super::watched::{Log, Origin, Signed, Watched};
use crate::constrained::velocity_of;
use crate::model::{First, Form, Model, State};
use crate::real::Real as _;
use alloc::vec;
use alloc::vec::Vec;

/// Appends the values of the switching functions of a model; false, with nothing appended, where there is no velocity.
pub(crate) fn switches<M, const N: usize>(
    model: &M,
    t: f64,
    state: &State<N>,
    values: &mut Vec<f64>,
) -> bool
where
    M: Model<N>,
{
    let z = match M::FORM {
        Form::Lagrangian => {
            let velocity = velocity_of(model, t, &state.q, &state.p, &[0.0; N]);
            let Ok(velocity) = velocity else {
                return false;
            };
            velocity
        }
        Form::Hamiltonian => state.p,
    };
    let log = Log::new(core::mem::take(values));
    let origin = deciding(model, (t, &state.q, &z), &log);
    *values = log.decisive(origin);
    true
}

/// The values of the functions g(t, q, z) by whose signs the kernels of a model choose branches at a state, with z = v for
/// a Lagrangian and z = p for a Hamiltonian, in an order that is always the same. One that decides nothing there is zero;
/// a model that is smooth has none. `None` where there is no velocity.
#[must_use]
pub fn switching_functions<M, const N: usize>(
    model: &M,
    t: f64,
    state: &State<N>,
) -> Option<Vec<f64>>
where
    M: Model<N>,
{
    let mut values = Vec::new();
    switches(model, t, state, &mut values).then_some(values)
}

/// Whether constraints have branches.
pub(crate) fn are_constraints_chosen<M, const N: usize>(model: &M, t: f64, q: &[f64; N]) -> bool
where
    M: Model<N>,
{
    let log = Log::new(Vec::new());
    deciding_constraints(model, Watched::new(t, &log), &watch(q, &log), &log);
    !log.values().is_empty()
}

/// Evaluates everything that may have branches, and returns the switching functions that have decided the derivatives of
/// the model and its constraints.
pub(super) fn deciding<M, R: Signed, const N: usize>(
    model: &M,
    (t, q, z): (R, &[R; N], &[R; N]),
    log: &Log<R>,
) -> Origin
where
    M: Model<N>,
{
    let (t, q, z) = (Watched::new(t, log), watch(q, log), watch(z, log));
    let mut first = First::zero();
    model.first(t, &q, &z, &mut first);
    let forces = log.deciding(first.z.iter().chain(&first.q).chain(&first.force));
    if const { M::CONSTRAINTS.is_empty() } {
        return forces;
    }
    let constraints = deciding_constraints(model, t, &q, log);
    log.both(forces, constraints)
}

/// The switching functions that have decided the constraints, their gradients and their drift.
fn deciding_constraints<'a, M, R: Signed, const N: usize>(
    model: &M,
    t: Watched<'a, R>,
    q: &[Watched<'a, R>; N],
    log: &Log<R>,
) -> Origin
where
    M: Model<N>,
{
    let zero = Watched::from_f64(0.0);
    let mut rows = vec![[zero; N]; M::CONSTRAINTS.len()];
    let mut values = vec![zero; M::CONSTRAINTS.len()];
    let mut drift = values.clone();
    model.constraint_values(t, q, &mut values);
    model.constraint_rows(t, q, &mut rows, &mut drift);
    log.deciding(rows.as_flattened().iter().chain(&values).chain(&drift))
}

/// The numbers, with a log of their comparisons.
fn watch<'a, R: Signed, const N: usize>(numbers: &[R; N], log: &'a Log<R>) -> [Watched<'a, R>; N] {
    numbers.map(|number| Watched::new(number, log))
}
