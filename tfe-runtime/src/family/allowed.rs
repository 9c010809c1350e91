//! The changes of a state that constraints allow, as a projection of all changes (T-78, T-160).

use super::blocked::Blocked;
use super::error::ModelError;
use super::kick::Kick;
use super::model::{FamilyState, Model};
use super::projection::Places;
use super::rows::Rows;
use super::transition::OperatorError;
use alloc::vec;
use alloc::vec::Vec;

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
    matrix: Blocked,
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
        let (n, m) = (model.len(), model.constraints());
        let mut rows = Rows::new(model);
        rows.evaluate(model, t, &state.q);
        let borders = rows.places().flat_map(|(c, a)| [(n + c, a), (a, n + c)]);
        let places: Vec<(usize, usize)> = (0..n).map(|a| (a, a)).chain(borders).collect();
        let mut matrix = Blocked::new(n + m, 1, &places).ok_or(ModelError::TooLarge)?;
        for a in 0..n {
            let place = matrix.place(a, a);
            matrix.values[place.first] = 1.0;
        }
        for ((c, a), value) in rows.places().zip(&rows.values) {
            for place in [matrix.place(n + c, a), matrix.place(a, n + c)] {
                matrix.values[place.first] = *value;
            }
        }
        matrix.factor()?;
        let mut allowed = Self {
            kick,
            matrix,
            by_parameters: Vec::with_capacity(parameters.len()),
        };
        let constraints = Places::of(model);
        for (number, parameter) in parameters.iter().enumerate() {
            let slopes = constraints.by_parameter(model, (t, &state.q), *parameter);
            let mut change = vec![0.0; 2 * n];
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
        let mut sides = vec![0.0; self.matrix.size()];
        sides[..n].copy_from_slice(q);
        for (side, phi) in sides[n..].iter_mut().zip(phi) {
            *side = -phi;
        }
        self.matrix.solve(&mut sides);
        q.copy_from_slice(&sides[..n]);
        self.kick.apply(change);
    }
}
