//! Coordinates that follow given functions of parameters and the time, (T-105).
//!
//! ```text
//! q_i = e(t) ,     v_i = ∂e/∂t
//! ```
//!
//! The force that holds the coordinate on this motion also takes up the forces on it.

use super::target::Places;
use super::{Assignment, Mistake, Reduction};
use crate::derive::constraint::{holds_state, holds_velocity, kind};
use crate::diagnostic::Kind;
use crate::expr::differentiate::derivative;
use crate::expr::graph::ExprId;
use crate::expr::input::Input;
use crate::expr::ordered::SortedMap;
use crate::model::declared::Form;

const PASS: &str = "frozen";

impl Reduction {
    pub(super) fn freeze(
        &mut self,
        held: &[Assignment],
        place: impl Fn(Kind) -> Mistake,
    ) -> Result<(), Mistake> {
        if self.model.form == Form::Hamiltonian {
            return Err(place(Kind::FrozenHamiltonian));
        }
        if self.model.dof.as_constant().is_none() {
            return Err(place(Kind::PassOfLength { pass: PASS }));
        }
        let positions = self.positions(held)?;
        self.write_out(PASS).map_err(&place)?;
        self.substitute(&positions).map_err(&place)?;
        let removed: Vec<i64> = positions.into_keys().collect();
        self.remove(&removed, PASS).map_err(&place)?;
        self.judge_constraints().map_err(&place)?;
        let graph = &self.model.graph;
        self.model.dissipation = (self.model.dissipation).filter(|id| holds_velocity(graph, *id));
        Ok(())
    }

    /// The functions by number of coordinate.
    fn positions(&self, held: &[Assignment]) -> Result<SortedMap<i64, ExprId>, Mistake> {
        let mut positions = SortedMap::new();
        for Assignment {
            target,
            span,
            value,
        } in held
        {
            let places = target.places(&self.model.coordinates, PASS);
            let places = match places.map_err(|kind| (*span, kind))? {
                Places::Numbers(places) => places,
                Places::All => return Err((*span, Kind::PassOfLength { pass: PASS })),
            };
            for at in places {
                if positions.insert(at, *value).is_some() {
                    let name = target.to_string();
                    return Err((*span, Kind::RepeatedEntry { name }));
                }
            }
        }
        Ok(positions)
    }

    fn substitute(&mut self, positions: &SortedMap<i64, ExprId>) -> Result<(), Kind> {
        let rates: SortedMap<i64, ExprId> = positions
            .iter()
            .map(|(at, value)| {
                let rate = derivative(&mut self.model.graph, *value, &Input::Time);
                (*at, rate)
            })
            .collect();
        self.each_formula(&mut |graph, id| {
            Ok(graph.with_leaves(id, &mut |_, input| match input {
                Input::Coordinate(at) => positions.get(&at.as_constant()?).copied(),
                Input::Velocity(at) => rates.get(&at.as_constant()?).copied(),
                _ => None,
            }))
        })
    }

    /// Checks that the remaining constraints still constrain something.
    fn judge_constraints(&mut self) -> Result<(), Kind> {
        let graph = &mut self.model.graph;
        for constraint in &mut self.model.constraints {
            let left = holds_state(graph, constraint.value);
            let Some(kind) = kind(graph, constraint.value).filter(|_| left) else {
                let name = constraint.name.clone();
                return Err(Kind::ConstraintLeft { name });
            };
            constraint.kind = kind;
        }
        Ok(())
    }
}
