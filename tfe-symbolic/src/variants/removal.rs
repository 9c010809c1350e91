//! Removal of coordinates from a model: the others move up.

use super::Reduction;
use crate::diagnostic::Kind;
use crate::expr::graph::{ExprId, Graph};
use crate::expr::input::{Affine, Input};
use crate::model::declared::{CoordinateArray, Declared, Force};

impl Reduction {
    /// Every formula rewritten, where `rewritten` may refuse.
    pub(super) fn each_formula(
        &mut self,
        rewritten: &mut dyn FnMut(&mut Graph, ExprId) -> Result<ExprId, Kind>,
    ) -> Result<(), Kind> {
        let Declared {
            graph,
            energy,
            dissipation,
            forces,
            constraints,
            observables,
            ..
        } = &mut self.model;
        let values = [energy]
            .into_iter()
            .chain(dissipation)
            .chain(forces.iter_mut().map(|force| &mut force.value))
            .chain(
                constraints
                    .iter_mut()
                    .map(|constraint| &mut constraint.value),
            )
            .chain(observables.iter_mut().map(|one| &mut one.value));
        for value in values {
            *value = rewritten(graph, *value)?;
        }
        Ok(())
    }

    /// Writes sums out until all indices of coordinates are numbers.
    pub(super) fn write_out(&mut self, pass: &'static str) -> Result<(), Kind> {
        self.model.forces = written_out_forces(&mut self.model, pass)?;
        self.each_formula(&mut |graph, id| {
            if !graph.holds_varying_index(id) {
                return Ok(id);
            }
            match graph.unroll(id) {
                Ok(id) if !graph.holds_varying_index(id) => Ok(id),
                _ => Err(Kind::PassOfLength { pass }),
            }
        })
    }

    /// Removes coordinates that no formula contains any more; indices of coordinates are constants.
    ///
    /// `removed` is sorted. Forces on them are removed as well.
    pub(super) fn remove(&mut self, removed: &[i64], pass: &'static str) -> Result<(), Kind> {
        let shifted = |at: i64| at - removed.partition_point(|gone| *gone < at) as i64;
        let moved = |at: &Affine| {
            at.as_constant()
                .map_or(at.clone(), |at| Affine::constant(shifted(at)))
        };
        let is_removed = |at: &Affine| {
            let at = at.as_constant();
            at.is_some_and(|at| removed.binary_search(&at).is_ok())
        };
        let model = &mut self.model;
        model.forces.retain(|force| !is_removed(&force.target));
        for force in &mut model.forces {
            force.target = moved(&force.target);
        }
        model.coordinates = left(&model.coordinates, removed, pass)?;
        model.momenta = left(&model.momenta, removed, pass)?;
        if model.coordinates.is_empty() {
            return Err(Kind::NothingLeft { pass });
        }
        model.dof = moved(&model.dof);
        self.each_formula(&mut |graph, id| {
            Ok(graph.with_leaves(id, &mut |graph, input| match input {
                Input::Coordinate(at) | Input::Velocity(at) | Input::Momentum(at) => {
                    Some(graph.input(input.with_index(moved(at))))
                }
                _ => None,
            }))
        })
    }
}

/// The arrays without some of their elements; what is left of an array that lost some is named one by one.
fn left(
    arrays: &[CoordinateArray],
    removed: &[i64],
    pass: &'static str,
) -> Result<Vec<CoordinateArray>, Kind> {
    let mut left = Vec::new();
    let mut next = 0;
    for array in arrays {
        let unknown = || Kind::PassOfLength { pass };
        let first = array.first.as_constant().ok_or_else(unknown)?;
        let length = match &array.length {
            None => 1,
            Some(length) => length.as_constant().ok_or_else(unknown)?,
        };
        let stays: Vec<i64> = (0..length)
            .filter(|at| removed.binary_search(&(first + at)).is_err())
            .collect();
        let whole = stays.len() as i64 == length;
        let names = stays.iter().map(|at| match whole {
            true => array.name.clone(),
            false => format!("{}[{at}]", array.name),
        });
        let count = if whole { 1 } else { stays.len() };
        for name in names.take(count) {
            left.push(CoordinateArray {
                name,
                first: Affine::constant(next),
                length: array.length.clone().filter(|_| whole),
            });
            next += if whole { length } else { 1 };
        }
    }
    Ok(left)
}

/// The forces, one for each coordinate that they act on.
pub(super) fn written_out_forces(
    model: &mut Declared,
    pass: &'static str,
) -> Result<Vec<Force>, Kind> {
    let mut forces = Vec::new();
    for force in &model.forces {
        let is_literal = |bound: &Affine| bound.as_constant().is_some();
        let literal = |range: &crate::expr::graph::SumRange| {
            is_literal(&range.start) && is_literal(&range.end)
        };
        if !force.ranges.iter().all(literal) {
            return Err(Kind::PassOfLength { pass });
        }
        for (target, value) in force.written_out(&mut model.graph) {
            if target.as_constant().is_none() {
                return Err(Kind::PassOfLength { pass });
            }
            forces.push(Force {
                ranges: Vec::new(),
                target,
                value,
            });
        }
    }
    Ok(forces)
}
