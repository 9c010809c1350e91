//! What a loss has of outputs and velocities goes on to states and parameters: by one evaluation backwards for all of them (T-127, T-149).

use crate::error::{ConstraintError, StepError, TransitionError};
use crate::lu::Block;
use crate::model::{First, Form, Model, State};
use crate::tape::{LANES, Operations, Tape, Taped};
use alloc::vec;
use alloc::vec::Vec;
use core::cell::RefCell;

/// What a loss ℓ has directly of a place of a motion.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Partials {
    /// ∂ℓ/∂q; as many numbers as the model has coordinates, as of the next two.
    pub q: Vec<f64>,
    /// ∂ℓ/∂p
    pub p: Vec<f64>,
    /// ∂ℓ/∂v
    pub v: Vec<f64>,
    /// By the outputs, one number a column.
    pub outputs: Vec<f64>,
}

impl Partials {
    /// Nothing, of a model with so many coordinates and columns of outputs.
    #[must_use]
    pub fn none(coordinates: usize, columns: usize) -> Self {
        let zeros = || vec![0.0; coordinates];
        Self {
            q: zeros(),
            p: zeros(),
            v: zeros(),
            outputs: vec![0.0; columns],
        }
    }

    /// Whether it has anything of outputs.
    pub(crate) fn sees_outputs(&self) -> bool {
        self.outputs.iter().any(|weight| *weight != 0.0)
    }
}

/// Takes derivatives of a loss from outputs and velocities to states and to all parameters of a model, whose sums it keeps.
///
/// ```text
/// w = L_vv⁻¹ (∂ℓ/∂v + y_vᵀ ∂ℓ/∂y) ,     λ_p += ∂ℓ/∂p + w ,     λ_q += ∂ℓ/∂q + y_qᵀ ∂ℓ/∂y − L_vqᵀ w ,     dℓ/da += y_aᵀ ∂ℓ/∂y − L_vaᵀ w
/// ```
///
/// of a Lagrangian; of a Hamiltonian, whose outputs are functions of momenta, v = H_p.
#[derive(Clone, Debug)]
pub struct Pull<'m, M, const N: usize> {
    model: &'m M,
    /// Parameters, then coordinates, then velocities (momenta).
    tape: Tape,
    parameters: usize,
}

/// Which results of a kernel.
#[derive(Clone, Copy, Debug)]
enum Results {
    /// L_v, or H_p.
    Slopes,
    Observables,
}

impl<'m, M: Model<N>, const N: usize> Pull<'m, M, N> {
    /// Sums of all parameters, zeros.
    #[must_use]
    pub fn new(model: &'m M) -> Self {
        let parameters = model.parameters();
        let mut tape = Tape::default();
        tape.begin(parameters + 2 * N);
        Self {
            model,
            tape,
            parameters,
        }
    }

    /// The sum of a parameter, by its index among all.
    #[must_use]
    pub fn by_parameter(&self, index: usize) -> f64 {
        self.tape.sum(index)
    }

    /// Adds what the loss has of a state with its velocity to the sums of the parameters; gives what it has of the state.
    ///
    /// # Errors
    /// [`TransitionError`] where L_vv is singular and the loss has anything of the velocity, and for vectors of other lengths.
    pub fn see(
        &mut self,
        t: f64,
        (state, v): (&State<N>, &[f64; N]),
        partials: &Partials,
    ) -> Result<State<N>, TransitionError> {
        let Partials {
            q,
            p,
            v: by_v,
            outputs,
        } = partials;
        let lengths = [q.len(), p.len(), by_v.len(), outputs.len()];
        let expected = [N, N, N, self.model.columns()];
        for (given, needed) in lengths.into_iter().zip(expected) {
            if given != needed {
                return Err(TransitionError::Shape { needed, given });
            }
        }
        let row = |values: &[f64]| core::array::from_fn(|a| values[a]);
        let mut by_state: State<N> = State {
            q: row(q),
            p: row(p),
        };
        let mut by_v: [f64; N] = row(by_v);
        let z = match M::FORM {
            Form::Lagrangian => v,
            Form::Hamiltonian => &state.p,
        };
        let place = (t, &state.q, z);
        if partials.sees_outputs() {
            let (by_q, by_z) = self.pulled(place, Results::Observables, outputs);
            let of_z = match M::FORM {
                Form::Lagrangian => &mut by_v,
                Form::Hamiltonian => &mut by_state.p,
            };
            for a in 0..N {
                by_state.q[a] += by_q[a];
                of_z[a] += by_z[a];
            }
        }
        if by_v == [0.0; N] {
            return Ok(by_state);
        }
        if M::FORM == Form::Lagrangian {
            // p = L_v(q, v): δv = L_vv⁻¹ (δp − ∂L_v/∂(q, a)).
            let (mut first, mut zz) = (First::ZERO, [[0.0; N]; N]);
            (self.model).first_and_mass(t, &state.q, v, &mut first, &mut zz);
            let singular = |_| StepError::from(ConstraintError::SingularMass);
            Block::of(&zz).map_err(singular)?.solve(&mut by_v);
            for a in 0..N {
                by_state.p[a] += by_v[a];
                by_v[a] = -by_v[a];
            }
        }
        let (by_q, by_z) = self.pulled(place, Results::Slopes, &by_v);
        for a in 0..N {
            by_state.q[a] += by_q[a];
            if M::FORM == Form::Hamiltonian {
                by_state.p[a] += by_z[a];
            }
        }
        Ok(by_state)
    }

    /// Weights of results to q and z, and to the sums of parameters.
    fn pulled(
        &mut self,
        (t, q, z): (f64, &[f64; N], &[f64; N]),
        results: Results,
        weights: &[f64],
    ) -> ([f64; N], [f64; N]) {
        let (model, parameters) = (self.model, self.parameters);
        let ends: Vec<u32> = self.tape.record(|operations| {
            let q = variables(q, parameters, operations);
            let z = variables(z, parameters + N, operations);
            let time = Taped::time([t; LANES], operations);
            match results {
                Results::Slopes => {
                    let mut first = First::zero();
                    model.first(time, &q, &z, &mut first);
                    first.z.iter().map(Taped::place).collect()
                }
                Results::Observables => {
                    let mut values = vec![Taped::of([0.0; LANES]); model.columns()];
                    model.observables(time, &q, &z, &mut values);
                    values.iter().map(Taped::place).collect()
                }
            }
        });
        let weights: Vec<_> = weights.iter().map(|one| [*one, 0.0, 0.0, 0.0]).collect();
        self.tape.read(ends.into_iter().zip(&weights));
        let mut taken = |first: usize| core::array::from_fn(|a| self.tape.take(first + a));
        (taken(parameters), taken(parameters + N))
    }
}

fn variables<'t, const N: usize>(
    values: &[f64; N],
    first: usize,
    operations: &'t RefCell<Operations>,
) -> [Taped<'t>; N] {
    core::array::from_fn(|a| Taped::variable(values[a], first + a, operations))
}
