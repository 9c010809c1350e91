//! Changes of points of motions, and parameters as directions.

use crate::length::{FixedLength, Length};
use nalgebra::{DMatrix, DVector};
use tfe_runtime::dual::{Dual, duals};
use tfe_runtime::{CoordinateName, Direction, First, Form, Model, Parameter};

/// A change of a point of a motion, for models of either kind of length.
#[derive(Clone)]
pub(crate) struct Change<const N: usize, L: Length<N> = FixedLength> {
    pub(crate) t: f64,
    pub(crate) q: L::Vector,
    pub(crate) p: L::Vector,
    /// The index of the parameter that changes by one.
    pub(crate) parameter: Option<usize>,
}

impl<const N: usize, L: Length<N>> Change<N, L> {
    /// The change of a parameter alone, or no change for `None`; `like` is a vector of the length of the coordinates.
    pub(crate) fn by(parameter: Option<usize>, like: &L::Vector) -> Self {
        Self {
            t: 0.0,
            q: L::zero(like),
            p: L::zero(like),
            parameter,
        }
    }

    /// The change from a column of a matrix with rows in the order (p, q); `like` is a vector of the length of the
    /// coordinates.
    pub(crate) fn of_column(like: &L::Vector, matrix: &DMatrix<f64>, column: usize) -> Self {
        let n = matrix.nrows() / 2;
        Self {
            t: 0.0,
            q: L::from_fn(like, |a| matrix[(n + a, column)]),
            p: L::from_fn(like, |a| matrix[(a, column)]),
            parameter: None,
        }
    }
}

fn square<const N: usize>(entries: &[[f64; N]; N]) -> DMatrix<f64> {
    DMatrix::from_fn(N, N, |a, b| entries[a][b])
}

/// Numbers that do not change.
fn still<const N: usize>(values: &[f64; N]) -> [Dual; N] {
    duals(values, &[0.0; N])
}

fn slopes<const N: usize>(duals: &[Dual; N]) -> [f64; N] {
    duals.map(|one| one.slope)
}

/// Parameters, given by their indices, as directions; with special kernels if the model has them.
pub(crate) fn directions<M: Model<N>, const N: usize>(
    model: &M,
    indices: &[usize],
) -> Vec<Direction> {
    let mut directions = Vec::with_capacity(indices.len());
    for index in indices {
        let name = model.parameter_name(*index);
        directions.push(direction(*index, &name, M::SENSITIVITIES));
    }
    directions
}

/// The direction of a parameter, one of those with special kernels if its name is among these.
fn direction(index: usize, name: &CoordinateName, special: &[&str]) -> Direction {
    let named = special.iter().position(|own| name.is(own));
    Direction {
        parameter: Some(named.map_or(Parameter::Any(index), Parameter::Named)),
        ..Direction::default()
    }
}

/// The derivative of the momentum by a parameter, at fixed coordinates and velocities; NaN if the mass matrix is
/// singular.
pub(crate) fn momentum_by<M: Model<N>, const N: usize>(
    model: &M,
    t: f64,
    (q, v, p): (&[f64; N], &[f64; N], &[f64; N]),
    parameter: usize,
) -> [f64; N] {
    let time = Dual::new(t, 0.0).by_parameter(Some(parameter));
    let mut first = First::zero();
    if const { matches!(M::FORM, Form::Lagrangian) } {
        model.first(time, &still(q), &still(v), &mut first);
        slopes(&first.z)
    } else {
        // The velocity v = H_p is fixed: H_pp δp = −∂H_p/∂a.
        model.first(time, &still(q), &still(p), &mut first);
        let (mut plain, mut zz) = (First::ZERO, [[0.0; N]; N]);
        model.first_and_mass(t, q, p, &mut plain, &mut zz);
        balancing(&zz, &slopes(&first.z))
    }
}

/// The change of momenta that balances a change of velocities; NaN if the second derivative by the momenta is singular.
fn balancing<const N: usize>(zz: &[[f64; N]; N], change: &[f64; N]) -> [f64; N] {
    let right = DVector::from_fn(N, |a, _| -change[a]);
    let found = square(zz).lu().solve(&right);
    found.map_or([f64::NAN; N], |found| std::array::from_fn(|a| found[a]))
}
