//! Constraints of a model of run-time length at one instant: admissible velocities, and reactions.

use super::model::{Block, Entries, FamilyState, Gradient, Model};
use super::node::Node;
use super::rows::Rows;
use crate::consistency::ModelError;
use crate::dual::Dual;
use crate::error::StepError;
use alloc::vec;
use alloc::vec::Vec;

/// The bordered matrix of one instant, whose elimination ordering is computed once.
#[derive(Clone, Debug)]
pub(super) struct Instant {
    pub(super) rows: Rows,
    node: Node,
}

impl Instant {
    /// `None` where memory does not suffice; the model has been checked.
    pub(super) fn new<M: Model>(model: &M) -> Option<Self> {
        let rows = Rows::new(model);
        let node = Node::new(model, &rows)?;
        Some(Self { rows, node })
    }

    /// The velocity that belongs to a momentum (T-74).
    pub(super) fn velocity<M: Model>(
        &mut self,
        model: &M,
        t: f64,
        state: &FamilyState,
    ) -> Result<Vec<f64>, ModelError> {
        self.rows.evaluate(model, t, &state.q);
        let mut v = vec![0.0; model.len()];
        let at = (t, &state.q[..]);
        let solved = (self.node).solve(model, at, &state.p, &self.rows, &mut v);
        solved.map_err(|_| ModelError::NoVelocity)?;
        Ok(v)
    }

    /// The reactions λ of a Lagrangian (T-77),
    ///
    /// ```text
    /// L_vv a + d L_v/dt|_v = L_q + Q + Aᵀλ ,     A a + d(A v + a)/dt|_v = 0 .
    /// ```
    pub(super) fn reactions<M: Model>(
        &mut self,
        model: &M,
        (t, q): (f64, &[f64]),
        v: &[f64],
    ) -> Result<Vec<f64>, StepError> {
        let n = model.len();
        let along = Dual::new(t, 1.0);
        let moving: Vec<Dual<f64>> = q.iter().zip(v).map(|(q, v)| Dual::new(*q, *v)).collect();
        let still: Vec<Dual<f64>> = v.iter().map(|v| Dual::new(*v, 0.0)).collect();
        let mut first = [(); 3].map(|()| vec![Dual::ZERO; n]);
        let [by_v, by_q, force] = &mut first;
        let gradient = Gradient {
            z: by_v,
            q: by_q,
            force,
        };
        model.first(along, &moving, &still, gradient);
        let forces = (0..n).map(|a| {
            let force = if M::FACTS.forced { force[a].value } else { 0.0 };
            by_q[a].value + force - by_v[a].slope
        });
        let mut rates = Rates::new(model.constraints(), &still);
        let mut drift = vec![Dual::ZERO; model.constraints()];
        model.constraint_rows(along, &moving, &mut drift, &mut rates);
        let accelerations = rates.values.iter().zip(&drift);
        let sides = forces.chain(accelerations.map(|(rate, drift)| -(rate.slope + drift.slope)));
        self.rows.evaluate(model, t, q);
        let solution = self
            .node
            .solve_linear(model, (t, q, v), &self.rows, sides)?;
        Ok(solution[n..].iter().map(|lambda| -lambda).collect())
    }
}

/// A v, for numbers of any kind.
pub(super) struct Rates<'a, R> {
    v: &'a [R],
    pub(super) values: Vec<R>,
}

impl<'a> Rates<'a, Dual<f64>> {
    fn new(count: usize, v: &'a [Dual<f64>]) -> Self {
        Self {
            v,
            values: vec![Dual::ZERO; count],
        }
    }
}

impl Entries<Dual<f64>> for Rates<'_, Dual<f64>> {
    fn add(&mut self, _: Block, row: usize, column: usize, value: Dual<f64>) {
        self.values[row] += value * self.v[column];
    }
}
