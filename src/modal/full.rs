//! The interface to the full model, of fixed size or of run-time length.

use super::eigen::Quadratic;
use super::error::ModalError;
use nalgebra::{DMatrix, DVector};
use tfe_runtime::family::{self, Block, Entries, FamilyState, Gradient};
use tfe_runtime::{CoordinateName, Facts, First, Form, Model, Real, Second, State};

/// A model with states of type `S` that can be reduced to modes: every [`Model`] with [`State`] and every
/// [`family::Model`] with [`FamilyState`]. Not to be implemented elsewhere.
pub trait Reducible<S> {
    /// Whether the model was declared by a Lagrangian or a Hamiltonian.
    const DECLARED: Form;

    /// The energy function as a quadratic form.
    #[doc(hidden)]
    fn quadratic(&self) -> Result<Quadratic, ModalError>;

    /// The energy at given coordinates and zero velocity; `offset` is the momentum that belongs to it.
    #[doc(hidden)]
    fn energy_at(&self, q: &[f64], offset: &[f64]) -> f64;

    /// Creates a state.
    #[doc(hidden)]
    fn state_of(q: Vec<f64>, p: Vec<f64>) -> S;

    /// The number of outputs.
    #[doc(hidden)]
    fn columns_of(&self) -> usize;

    /// The name of an output.
    #[doc(hidden)]
    fn column_name_of(&self, column: usize) -> CoordinateName;

    /// Writes the outputs.
    #[doc(hidden)]
    fn observables_of<T: Real>(&self, t: T, q: &[T], z: &[T], values: &mut [T]);
}

/// Refuses models that have no real modes of the supported kind.
fn admitted(facts: Facts, is_constrained: bool) -> Result<(), ModalError> {
    if is_constrained {
        return Err(ModalError::Constrained);
    }
    if facts.time_dependent {
        return Err(ModalError::TimeDependent);
    }
    if facts.forced {
        return Err(ModalError::Forced);
    }
    if !facts.linear {
        return Err(ModalError::NotLinear);
    }
    Ok(())
}

impl<M: Model<N>, const N: usize> Reducible<State<N>> for M {
    const DECLARED: Form = M::FORM;

    fn quadratic(&self) -> Result<Quadratic, ModalError> {
        self.check().map_err(ModalError::Family)?;
        admitted(M::FACTS, !M::CONSTRAINTS.is_empty())?;
        let (mut first, mut second) = (First::<f64, N>::ZERO, Second::<f64, N>::ZERO);
        let zero = [0.0; N];
        self.second(0.0, &zero, &zero, &mut first, &mut second);
        let matrix = |rows: &[[f64; N]; N]| DMatrix::from_fn(N, N, |i, j| rows[i][j]);
        Quadratic::new(
            M::FORM,
            [matrix(&second.zz), matrix(&second.zq), matrix(&second.qq)],
            [
                DVector::from_column_slice(&first.z),
                DVector::from_column_slice(&first.q),
            ],
        )
    }

    fn energy_at(&self, q: &[f64], offset: &[f64]) -> f64 {
        let (mut at, mut momenta) = ([0.0; N], [0.0; N]);
        at.iter_mut().zip(q).for_each(|(at, q)| *at = *q);
        momenta.iter_mut().zip(offset).for_each(|(at, p)| *at = *p);
        match M::FORM {
            Form::Lagrangian => -self.energy_function(0.0, &at, &[0.0; N]),
            Form::Hamiltonian => self.energy_function(0.0, &at, &momenta),
        }
    }

    fn state_of(q: Vec<f64>, p: Vec<f64>) -> State<N> {
        let array = |values: Vec<f64>| <[f64; N]>::try_from(values).unwrap_or([f64::NAN; N]);
        State {
            q: array(q),
            p: array(p),
        }
    }

    fn columns_of(&self) -> usize {
        self.columns()
    }

    fn column_name_of(&self, column: usize) -> CoordinateName {
        self.column_name(column)
    }

    fn observables_of<T: Real>(&self, t: T, q: &[T], z: &[T], values: &mut [T]) {
        // They have the length of the model, since they come from its own vectors.
        if let (Ok(q), Ok(z)) = (q.try_into(), z.try_into()) {
            self.observables(t, q, z, values);
        }
    }
}

impl<M: family::Model> Reducible<FamilyState> for M {
    const DECLARED: Form = <M as family::Model>::FORM;

    fn quadratic(&self) -> Result<Quadratic, ModalError> {
        self.check().map_err(ModalError::Family)?;
        admitted(
            <M as family::Model>::FACTS,
            <M as family::Model>::CONSTRAINED,
        )?;
        let n = self.len();
        let zero = vec![0.0; n];
        let (mut z, mut q, mut force) = (zero.clone(), zero.clone(), zero.clone());
        let mut dense = Dense(std::array::from_fn(|_| DMatrix::zeros(n, n)));
        let first = Gradient {
            z: &mut z,
            q: &mut q,
            force: &mut force,
        };
        family::Model::second(self, 0.0, &zero, &zero, first, &mut dense);
        Quadratic::new(
            <M as family::Model>::FORM,
            dense.0,
            [DVector::from_vec(z), DVector::from_vec(q)],
        )
    }

    fn energy_at(&self, q: &[f64], offset: &[f64]) -> f64 {
        match <M as family::Model>::FORM {
            Form::Lagrangian => {
                -family::Model::energy_function(self, 0.0, q, &vec![0.0; self.len()])
            }
            Form::Hamiltonian => family::Model::energy_function(self, 0.0, q, offset),
        }
    }

    fn state_of(q: Vec<f64>, p: Vec<f64>) -> FamilyState {
        FamilyState { q, p }
    }

    fn columns_of(&self) -> usize {
        family::Model::columns(self)
    }

    fn column_name_of(&self, column: usize) -> CoordinateName {
        family::Model::column_name(self, column)
    }

    fn observables_of<T: Real>(&self, t: T, q: &[T], z: &[T], values: &mut [T]) {
        family::Model::observables(self, t, q, z, values);
    }
}

/// ∂²/∂z∂z, ∂²/∂z∂q and ∂²/∂q∂q as dense matrices.
struct Dense([DMatrix<f64>; 3]);

impl Entries<f64> for Dense {
    fn add(&mut self, block: Block, row: usize, column: usize, value: f64) {
        let at = match block {
            Block::ZZ => 0,
            Block::ZQ => 1,
            Block::QQ => 2,
            // Forces and constraints have been refused.
            _ => return,
        };
        self.0[at][(row, column)] += value;
    }
}
