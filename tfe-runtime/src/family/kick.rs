//! The derivative of the momentum after an impulse under constraints (T-160).

use super::model::{FamilyState, Model};
use super::node::Node;
use super::pattern::Pattern;
use super::projection::{NodeWeights, Places, Projection};
use super::rows::Rows;
use super::transition::OperatorError;
use super::view::View;
use crate::consistency::ModelError;
use alloc::vec;
use alloc::vec::Vec;

/// The derivative of (p̃, q) ↦ (p, q) at an impulse, where the constraints at once take up the part of the momentum
/// that is against them:
///
/// ```text
/// p = p̃ − Aᵀη = L_v(q, v, t) ,     A v + a = 0                                                         (T-74)
/// ```
///
/// For n coordinates and m constraints, a square sparse matrix of size n + m is factored once; [`apply`](Self::apply)
/// is one solve with it. Runs with derivatives across impulses use it (`Simulation::run_sensitive` of the crate `tfe`).
#[derive(Clone, Debug)]
pub struct Kick {
    places: Places,
    projection: Projection,
    by_parameters: Vec<Vec<f64>>,
}

impl Kick {
    /// At a time, for coordinates and the momentum p̃, with the derivatives by the parameters of these indices. The
    /// model has constraints.
    ///
    /// # Errors
    /// [`OperatorError`] where no velocity belongs to the momentum.
    pub fn of<M: Model>(
        model: &M,
        t: f64,
        state: &FamilyState,
        parameters: &[usize],
    ) -> Result<Self, OperatorError> {
        let view = View::new(model, 0.0)?;
        let mut rows = Rows::new(model);
        let mut node = Node::new(model, &rows).ok_or(ModelError::TooLarge)?;
        rows.evaluate(model, t, &state.q);
        let mut v = vec![0.0; model.len()];
        node.solve(model, (t, &state.q), &state.p, &rows, &mut v)?;
        let (places, second) = (Places::of(model), Pattern::of(model));
        let at = (t, &state.q[..], &v[..]);
        let projection = Projection::of(model, (&places, &second), at, (&node, &rows))?;
        let by_parameters = parameters.iter().map(|parameter| {
            let momentum = view.by_parameter(t, &state.q, &v, *parameter).momentum;
            projection.by_parameter(model, &places, t, (*parameter, momentum))
        });
        Ok(Self {
            by_parameters: by_parameters.collect(),
            places,
            projection,
        })
    }

    /// Replaces (δp̃, δq) by (δp, δq), ordered (p, q).
    pub fn apply(&self, change: &mut [f64]) {
        let (p, q) = change.split_at_mut(self.projection.velocity().len());
        self.projection.apply(&self.places, p, q, None);
    }

    /// ∂p/∂a, one for each requested parameter.
    #[must_use]
    pub fn by_parameters(&self) -> &[Vec<f64>] {
        &self.by_parameters
    }

    /// Replaces a row of phase space by its product with the derivative.
    pub(super) fn pull(&self, lambda: &mut [f64]) -> NodeWeights {
        let (of_p, of_q) = lambda.split_at_mut(self.projection.velocity().len());
        self.projection.pull(&self.places, of_p, of_q)
    }
}
