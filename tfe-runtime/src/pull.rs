//! Pull-back of the derivatives of a loss by outputs and velocities to states and parameters, with one backward
//! evaluation for all of them (T-127, T-149).

use crate::constrained::HeldVelocity;
use crate::error::{ConstraintError, StepError, TransitionError};
use crate::lu::Block;
use crate::model::{First, Form, Model, State};
use crate::tape::{LANES, Operations, Row, Tape, Taped};
use alloc::vec;
use alloc::vec::Vec;
use core::cell::RefCell;

/// The direct partial derivatives of a loss ℓ at one place of a motion.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Partials {
    /// ∂ℓ/∂q; this and the next two have one number for each coordinate of the model.
    pub q: Vec<f64>,
    /// ∂ℓ/∂p
    pub p: Vec<f64>,
    /// ∂ℓ/∂v
    pub v: Vec<f64>,
    /// By the outputs, one number for each column.
    pub outputs: Vec<f64>,
}

impl Partials {
    /// Zero derivatives, for a model with this number of coordinates and of columns of outputs.
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

    /// Whether the loss depends on outputs.
    pub(crate) fn sees_outputs(&self) -> bool {
        self.outputs.iter().any(|weight| *weight != 0.0)
    }
}

/// A place of a motion, with the direct derivatives of a loss there.
#[derive(Clone, Copy, Debug)]
pub struct Sight<'a, S, V> {
    /// The time.
    pub t: f64,
    /// Coordinates and momenta.
    pub state: &'a S,
    /// The velocity that belongs to the momentum.
    pub v: &'a V,
    /// The derivatives of the loss.
    pub partials: &'a Partials,
}

/// Converts derivatives of a loss by outputs and velocities into derivatives by states and by all parameters of a
/// model; it accumulates the latter.
///
/// ```text
/// w = L_vv⁻¹ (∂ℓ/∂v + y_vᵀ ∂ℓ/∂y) ,     λ_p += ∂ℓ/∂p + w ,     λ_q += ∂ℓ/∂q + y_qᵀ ∂ℓ/∂y − L_vqᵀ w ,     dℓ/da += y_aᵀ ∂ℓ/∂y − L_vaᵀ w
/// ```
///
/// for a Lagrangian; for a Hamiltonian, whose outputs are functions of momenta, v = H_p.
#[derive(Clone, Debug)]
pub struct Pull<'m, M, const N: usize> {
    model: &'m M,
    /// The variables of the tape: parameters, then coordinates, then velocities (momenta).
    tape: Tape,
    parameters: usize,
}

/// The kernel results that are differentiated.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Results {
    /// L_v, or H_p.
    Slopes,
    Observables,
}

impl<'m, M: Model<N>, const N: usize> Pull<'m, M, N> {
    /// Zero sums for all parameters.
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

    /// Adds the derivatives by the parameters at a state with its velocity to their sums, and returns the derivatives
    /// by the state.
    ///
    /// # Errors
    /// [`TransitionError`] where L_vv is singular and the loss depends on the velocity, and for vectors of other
    /// lengths.
    pub fn see(
        &mut self,
        t: f64,
        (state, v): (&State<N>, &[f64; N]),
        partials: &Partials,
    ) -> Result<State<N>, TransitionError> {
        let mut by_state = State::ZERO;
        let place = Sight {
            t,
            state,
            v,
            partials,
        };
        self.see_all(&[place], |one| by_state = one)?;
        Ok(by_state)
    }

    /// The same for several places, four side by side; `each` receives the derivatives by their states, in their order.
    ///
    /// # Errors
    /// As [`see`](Self::see).
    pub fn see_all(
        &mut self,
        places: &[Sight<'_, State<N>, [f64; N]>],
        mut each: impl FnMut(State<N>),
    ) -> Result<(), TransitionError> {
        let expected = [N, N, N, self.model.columns()];
        for places in places.chunks(LANES) {
            for place in places {
                let Partials { q, p, v, outputs } = place.partials;
                let lengths = [q.len(), p.len(), v.len(), outputs.len()];
                for (given, needed) in lengths.into_iter().zip(expected) {
                    if given != needed {
                        return Err(TransitionError::Shape { needed, given });
                    }
                }
            }
            for by_state in &self.see_some(places)?[..places.len()] {
                each(*by_state);
            }
        }
        Ok(())
    }

    fn see_some(
        &mut self,
        places: &[Sight<'_, State<N>, [f64; N]>],
    ) -> Result<[State<N>; LANES], StepError> {
        // Unused lanes repeat the first place with zero weights.
        let at = |lane: usize| &places[if lane < places.len() { lane } else { 0 }];
        let weight = |number: &dyn Fn(&Partials) -> f64| -> Row {
            core::array::from_fn(|lane| {
                places.get(lane).map_or(0.0, |place| number(place.partials))
            })
        };
        let rows = |number: &dyn Fn(&Partials, usize) -> f64| -> [Row; N] {
            core::array::from_fn(|a| weight(&|partials| number(partials, a)))
        };
        let mut by_q = rows(&|partials, a| partials.q[a]);
        let mut by_p = rows(&|partials, a| partials.p[a]);
        let mut by_v = rows(&|partials, a| partials.v[a]);
        let t = core::array::from_fn(|lane| at(lane).t);
        let z = |lane: usize| match M::FORM {
            Form::Lagrangian => at(lane).v,
            Form::Hamiltonian => &at(lane).state.p,
        };
        let q = core::array::from_fn(|a| core::array::from_fn(|lane| at(lane).state.q[a]));
        let z = core::array::from_fn(|a| core::array::from_fn(|lane| z(lane)[a]));
        if places.iter().any(|place| place.partials.sees_outputs()) {
            let columns = 0..self.model.columns();
            let outputs: Vec<Row> = columns
                .map(|column| weight(&|partials| partials.outputs[column]))
                .collect();
            let (of_q, of_z) = self.pulled((t, &q, &z), Results::Observables, &outputs);
            add(&mut by_q, &of_q);
            match M::FORM {
                Form::Lagrangian => add(&mut by_v, &of_z),
                Form::Hamiltonian => add(&mut by_p, &of_z),
            }
        }
        if by_v.as_flattened().iter().any(|weight| *weight != 0.0) {
            if M::FORM == Form::Lagrangian {
                // p = L_v(q, v): δv = L_vv⁻¹ (δp − ∂L_v/∂(q, a)).
                for (lane, place) in places.iter().enumerate() {
                    let mut own: [f64; N] = core::array::from_fn(|a| by_v[a][lane]);
                    let of_q = self.divide_by_mass(place, &mut own)?;
                    for a in 0..N {
                        by_p[a][lane] += own[a];
                        by_q[a][lane] += of_q[a];
                        by_v[a][lane] = -own[a];
                    }
                }
            }
            let (of_q, of_z) = self.pulled((t, &q, &z), Results::Slopes, &by_v);
            add(&mut by_q, &of_q);
            if M::FORM == Form::Hamiltonian {
                add(&mut by_p, &of_z);
            }
        }
        Ok(core::array::from_fn(|lane| State {
            q: core::array::from_fn(|a| by_q[a][lane]),
            p: core::array::from_fn(|a| by_p[a][lane]),
        }))
    }

    /// Converts weights of a velocity to weights of its momentum. Where constraints are needed for that, adds their
    /// contributions to the sums of parameters, and returns those to the derivatives by q (else zeros).
    fn divide_by_mass(
        &mut self,
        place: &Sight<'_, State<N>, [f64; N]>,
        weights: &mut [f64; N],
    ) -> Result<[f64; N], StepError> {
        let Sight { t, state, v, .. } = place;
        if const { !M::CONSTRAINTS.is_empty() } {
            let held = HeldVelocity::of(self.model, *t, (&state.q, &state.p), v)?;
            if let Some(held) = held {
                let (rows, drift) = held.pull(v, weights);
                return Ok(self.pulled_rows(*t, &state.q, &rows, &drift));
            }
        }
        let (mut first, mut zz) = (First::ZERO, [[0.0; N]; N]);
        (self.model).first_and_mass(*t, &state.q, v, &mut first, &mut zz);
        let mass = Block::of(&zz).map_err(|_| ConstraintError::SingularMass)?;
        mass.solve(weights);
        Ok([0.0; N])
    }

    /// Adds the contributions of the weights of A and a at one place to those of q, and to the sums of parameters.
    fn pulled_rows(
        &mut self,
        t: f64,
        q: &[f64; N],
        of_rows: &[[f64; N]],
        of_drift: &[f64],
    ) -> [f64; N] {
        let (model, parameters) = (self.model, self.parameters);
        let ends: Vec<u32> = self.tape.record(|operations| {
            let q = variables(&q.map(|q| [q; LANES]), parameters, operations);
            let zero = Taped::of([0.0; LANES]);
            let mut rows = vec![[zero; N]; of_rows.len()];
            let mut drift = vec![zero; of_drift.len()];
            model.constraint_rows(
                Taped::time([t; LANES], operations),
                &q,
                &mut rows,
                &mut drift,
            );
            let all = rows.as_flattened().iter().chain(&drift);
            all.map(Taped::place).collect()
        });
        let weights = of_rows.as_flattened().iter().chain(of_drift);
        let weights: Vec<Row> = weights.map(|weight| [*weight, 0.0, 0.0, 0.0]).collect();
        self.tape.read(ends.into_iter().zip(&weights));
        core::array::from_fn(|a| self.tape.take_row(parameters + a)[0])
    }

    /// Adds the contributions of the weights of kernel results to those of q and z, and to the sums of parameters.
    fn pulled(
        &mut self,
        (t, q, z): (Row, &[Row; N], &[Row; N]),
        results: Results,
        weights: &[Row],
    ) -> ([Row; N], [Row; N]) {
        let (model, parameters) = (self.model, self.parameters);
        let ends: Vec<u32> = self.tape.record(|operations| {
            let q = variables(q, parameters, operations);
            let z = variables(z, parameters + N, operations);
            let time = Taped::time(t, operations);
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
        self.tape.read(ends.into_iter().zip(weights));
        let mut taken = |first: usize| core::array::from_fn(|a| self.tape.take_row(first + a));
        (taken(parameters), taken(parameters + N))
    }
}

fn add<const N: usize>(sums: &mut [Row; N], rows: &[Row; N]) {
    for (sum, row) in sums.as_flattened_mut().iter_mut().zip(rows.as_flattened()) {
        *sum += row;
    }
}

fn variables<'t, const N: usize>(
    values: &[Row; N],
    first: usize,
    operations: &'t RefCell<Operations>,
) -> [Taped<'t>; N] {
    core::array::from_fn(|a| Taped::variable(values[a], first + a, operations))
}
