//! Derivatives of velocities and outputs by states, times and parameters, for models of fixed size.

use crate::length::{FixedLength, Length};
use nalgebra::{DMatrix, DVector};
use tfe_runtime::constrained::HeldVelocity;
use tfe_runtime::dual::{Dual, duals};
use tfe_runtime::{Direction, First, Form, Model, Parameter};

/// A point of a motion with its velocity.
#[derive(Clone, Copy)]
pub(crate) struct Place<'a, const N: usize> {
    pub(crate) t: f64,
    pub(crate) q: &'a [f64; N],
    pub(crate) p: &'a [f64; N],
    pub(crate) v: &'a [f64; N],
}

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

/// The derivatives of the velocities and outputs of a model at a point.
pub(crate) struct Along<'a, M, const N: usize> {
    model: &'a M,
    place: Place<'a, N>,
    /// The inverse of L_vv of a Lagrangian.
    inverse: Option<DMatrix<f64>>,
    /// Used if L_vv is singular, and the constraints determine the velocity.
    held: Option<HeldVelocity<N>>,
}

impl<'a, M: Model<N>, const N: usize> Along<'a, M, N> {
    pub(crate) fn new(model: &'a M, place: Place<'a, N>) -> Self {
        let Place { t, q, p, v } = place;
        let unknown = || DMatrix::from_element(N, N, f64::NAN);
        let held = HeldVelocity::of(model, t, (q, p), v);
        let inverse = match (M::FORM, &held) {
            (Form::Hamiltonian, _) => None,
            // The constraints do not determine the velocity either.
            (Form::Lagrangian, Err(_)) => Some(unknown()),
            (Form::Lagrangian, Ok(_)) => {
                let (mut first, mut zz) = (First::ZERO, [[0.0; N]; N]);
                model.first_and_mass(t, q, v, &mut first, &mut zz);
                let mass = DMatrix::from_fn(N, N, |a, b| zz[a][b]);
                // By factorisation: for two to four coordinates, nalgebra would divide by the determinant, a product of
                // as many masses, which may overflow or underflow.
                Some(mass.lu().try_inverse().unwrap_or_else(unknown))
            }
        };
        Self {
            model,
            place,
            inverse,
            held: held.unwrap_or_default(),
        }
    }

    /// δv; NaN if the mass matrix is singular. With constraints, for changes that these allow.
    pub(crate) fn velocity(&self, change: &Change<N>) -> [f64; N] {
        let Place { t, q, p, v } = self.place;
        let time = Dual::new(t, change.t).by_parameter(change.parameter);
        let q = duals(q, &change.q);
        let mut first = First::zero();
        let Some(inverse) = &self.inverse else {
            let p = duals(p, &change.p);
            self.model.first(time, &q, &p, &mut first);
            return first.z.map(|one| one.slope);
        };
        // p = L_v(q, v, t): L_vv δv = δp − ∂L_v/∂(t, q, a).
        self.model.first(time, &q, &duals(v, &[0.0; N]), &mut first);
        let right = std::array::from_fn(|a| change.p[a] - first.z[a].slope);
        if let Some(held) = &self.held {
            return held.slope(self.model, (time, &q), v, &right);
        }
        let found = inverse * DVector::from_column_slice(&right);
        std::array::from_fn(|a| found[a])
    }
}

/// Parameters, given by their indices, as directions; with special kernels if the model has them.
pub(crate) fn directions<M: Model<N>, const N: usize>(
    model: &M,
    indices: &[usize],
) -> Vec<Direction> {
    let parameter = |&index: &usize| {
        let name = model.parameter_name(index);
        let named = M::SENSITIVITIES.iter().position(|own| name.is(own));
        Direction {
            parameter: Some(named.map_or(Parameter::Any(index), Parameter::Named)),
            ..Direction::default()
        }
    };
    indices.iter().map(parameter).collect()
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
    let still = |values| duals(values, &[0.0; N]);
    let mut first = First::zero();
    match M::FORM {
        Form::Lagrangian => {
            model.first(time, &still(q), &still(v), &mut first);
            first.z.map(|one| one.slope)
        }
        // The velocity v = H_p is fixed: H_pp δp = −∂H_p/∂a.
        Form::Hamiltonian => {
            model.first(time, &still(q), &still(p), &mut first);
            let (mut plain, mut zz) = (First::ZERO, [[0.0; N]; N]);
            model.first_and_mass(t, q, p, &mut plain, &mut zz);
            let right = DVector::from_fn(N, |a, _| -first.z[a].slope);
            let found = DMatrix::from_fn(N, N, |a, b| zz[a][b]).lu().solve(&right);
            found.map_or([f64::NAN; N], |found| std::array::from_fn(|a| found[a]))
        }
    }
}
