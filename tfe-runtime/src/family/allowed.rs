//! The changes of a state that constraints allow, as a projection of all changes (T-78, T-160), and the nearest state
//! that satisfies them (T-96).

use super::blocked::{Blocked, Place};
use super::instant::Instant;
use super::kick::Kick;
use super::model::{FamilyState, Model, slope};
use super::projection::Places;
use super::rows::Rows;
use super::transition::OperatorError;
use crate::consistency::ModelError;
use crate::constrained::node::{MAX, is_settled};
use crate::error::{LegendreError, StepError};
use crate::legendre::largest;
use alloc::vec;
use alloc::vec::Vec;

/// The matrix of the nearest change of the coordinates,
///
/// ```text
/// [ 1  Aᵀ ]
/// [ A  0  ]
/// ```
#[derive(Clone, Debug)]
struct Bordered {
    matrix: Blocked,
    diagonal: Vec<Place>,
    /// The places of A and of Aᵀ.
    rows: Vec<(Place, Place)>,
}

impl Bordered {
    /// Finds the places; `None` where memory does not suffice.
    fn new(n: usize, rows: &Rows) -> Option<Self> {
        let borders = rows.places().flat_map(|(c, a)| [(n + c, a), (a, n + c)]);
        let places: Vec<(usize, usize)> = (0..n).map(|a| (a, a)).chain(borders).collect();
        let matrix = Blocked::new(n + rows.phi.len(), 1, &places)?.bordered(n);
        let pair = |(c, a)| (matrix.place(n + c, a), matrix.place(a, n + c));
        Some(Self {
            diagonal: (0..n).map(|a| matrix.place(a, a)).collect(),
            rows: rows.places().map(pair).collect(),
            matrix,
        })
    }

    /// Factors the matrix of these rows.
    fn factor(&mut self, rows: &Rows) -> Result<(), StepError> {
        for place in &self.diagonal {
            self.matrix.values[place.first] = 1.0;
        }
        for ((row, transposed), value) in self.rows.iter().zip(&rows.values) {
            self.matrix.values[row.first] = *value;
            self.matrix.values[transposed.first] = *value;
        }
        self.matrix.factor()
    }
}

/// The projection of changes (δp, δq) of a state that satisfies the constraints onto those that the constraints allow:
/// the nearest change of the coordinates, then that of the momentum as at an impulse ([`Kick`]).
///
/// ```text
/// [ 1  Aᵀ ] [ δq ]   [ δq given ]
/// [ A  0  ] [ ·  ] = [ −φ_a δa  ]
/// ```
///
/// Changes that are allowed stay what they are. For n coordinates and m constraints, two square sparse matrices of size
/// n + m are factored once; [`apply`](Self::apply) is one solve with each. Gradients across events use it
/// (`Simulation::gradient` of the crate `tfe`).
#[derive(Clone, Debug)]
pub struct Allowed {
    kick: Kick,
    matrix: Bordered,
    by_parameters: Vec<Vec<f64>>,
}

impl Allowed {
    /// At a time and a state, with the changes by the parameters of these indices. The model has constraints.
    ///
    /// # Errors
    /// [`OperatorError`] where no velocity belongs to the momentum, or constraints depend on each other.
    pub fn of<M: Model>(
        model: &M,
        t: f64,
        state: &FamilyState,
        parameters: &[usize],
    ) -> Result<Self, OperatorError> {
        let kick = Kick::of(model, t, state, parameters)?;
        let mut rows = Rows::new(model);
        rows.evaluate(model, t, &state.q);
        let mut matrix = Bordered::new(model.len(), &rows).ok_or(ModelError::TooLarge)?;
        matrix.factor(&rows)?;
        let mut allowed = Self {
            kick,
            matrix,
            by_parameters: Vec::with_capacity(parameters.len()),
        };
        let constraints = Places::of(model);
        for (number, parameter) in parameters.iter().enumerate() {
            let slopes = constraints.by_parameter(model, (t, &state.q), *parameter);
            let mut change = vec![0.0; 2 * model.len()];
            allowed.project(&mut change, &slopes.phi);
            let own = &allowed.kick.by_parameters()[number];
            for (p, own) in change.iter_mut().zip(own) {
                *p += own;
            }
            allowed.by_parameters.push(change);
        }
        Ok(allowed)
    }

    /// Replaces a change by one that the constraints allow, ordered (p, q).
    pub fn apply(&self, change: &mut [f64]) {
        self.project(change, &[]);
    }

    /// For each requested parameter a change of the state, ordered (p, q), with which the constraints stay satisfied if
    /// the parameter changes by one.
    #[must_use]
    pub fn by_parameters(&self) -> &[Vec<f64>] {
        &self.by_parameters
    }

    /// The same as [`apply`](Self::apply) where φ changes by `phi` besides; nothing for an empty slice.
    fn project(&self, change: &mut [f64], phi: &[f64]) {
        let n = change.len() / 2;
        let q = &mut change[n..];
        let mut sides = vec![0.0; self.matrix.matrix.size()];
        sides[..n].copy_from_slice(q);
        for (side, phi) in sides[n..].iter_mut().zip(phi) {
            *side = -phi;
        }
        self.matrix.matrix.solve(&mut sides);
        q.copy_from_slice(&sides[..n]);
        self.kick.apply(change);
    }
}

/// The nearest state that satisfies the constraints of a model that has some: the coordinates by Newton's method for
/// the least |δq|, then the momentum that the constraints leave of the given one.
///
/// # Errors
/// [`OperatorError`] if the constraints are not reached, depend on each other, or allow no velocity.
pub fn nearest<M: Model>(
    model: &M,
    t: f64,
    state: &FamilyState,
) -> Result<FamilyState, OperatorError> {
    let n = model.len();
    let mut rows = Rows::new(model);
    let mut matrix = Bordered::new(n, &rows).ok_or(ModelError::TooLarge)?;
    let (mut q, mut last, mut is_found) = (state.q.clone(), f64::INFINITY, false);
    for _ in 0..MAX {
        rows.evaluate(model, t, &q);
        matrix.factor(&rows)?;
        let back = state.q.iter().zip(&q).map(|(given, q)| given - q);
        let mut step: Vec<f64> = back.chain(rows.phi.iter().map(|phi| -phi)).collect();
        matrix.matrix.solve(&mut step);
        for (q, step) in q.iter_mut().zip(&step) {
            *q += step;
        }
        let (size, scale) = (largest(&step[..n]), largest(&q));
        if !(size + scale).is_finite() {
            return Err(StepError::NonFinite.into());
        }
        is_found = is_settled(size, last, scale);
        last = size;
        if is_found {
            break;
        }
    }
    if !is_found {
        let stalled = LegendreError::Stalled {
            iterations: MAX,
            residual: last,
        };
        return Err(StepError::from(stalled).into());
    }
    let mut instant = Instant::new(model).ok_or(ModelError::TooLarge)?;
    let p = state.p.clone();
    let mut nearest = FamilyState { q, p };
    let v = instant.velocity(model, t, &nearest)?;
    nearest.p = slope(model, t, &nearest.q, &v);
    Ok(nearest)
}
