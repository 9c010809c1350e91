//! Constraints on positions that become springs, (T-107).
//!
//! ```text
//! L , φ_j = 0  ⟶  L − ½ k Σ φ_j²          (of a Hamiltonian, H + ½ k Σ φ_j²)
//! ```

use super::{Mistake, Reduction, Spring, Target};
use crate::diagnostic::{Kind, nearest};
use crate::expr::constant::Constant;
use crate::expr::graph::{ExprId, Graph};
use crate::expr::input::{Affine, Input};
use crate::model::declared::{Constraint, ConstraintKind, Form};

impl Reduction {
    pub(super) fn soften(&mut self, spring: &Spring) -> Result<(), Mistake> {
        let at_name = |kind| (spring.span, kind);
        let softened = self.released(&spring.constraint).map_err(at_name)?;
        let field = &spring.stiffness.node;
        let graph = &mut self.model.graph;
        let squares: Vec<_> = softened
            .iter()
            .map(|constraint| (Constant::ONE, square(graph, constraint)))
            .collect();
        let squares = graph.linear(Constant::ZERO, &squares);
        let stiffness = graph.input(Input::Parameter(field.clone()));
        let twice = graph.multiply(stiffness, squares);
        let half = Constant::integer(2).reciprocal().unwrap_or(Constant::ONE);
        let elastic = graph.scale(half, twice);
        let energy = self.model.energy;
        self.model.energy = match self.model.form {
            Form::Lagrangian => graph.subtract(energy, elastic),
            Form::Hamiltonian => graph.add(energy, elastic),
        };
        let of = format!("`{}`", spring.constraint);
        match self.added.iter_mut().find(|(name, _)| name == field) {
            Some((_, doc)) => *doc = format!("{doc}, {of}"),
            None => self
                .added
                .push((field.clone(), format!("Stiffness in place of {of}"))),
        }
        Ok(())
    }

    /// Removes the constraints of this name; the others move up.
    fn released(&mut self, target: &Target) -> Result<Vec<Constraint>, Kind> {
        let name = target.to_string();
        let family = format!("{name}[");
        let is_meant = |constraint: &Constraint| {
            constraint.name == name || constraint.name.starts_with(&family)
        };
        let constraints = std::mem::take(&mut self.model.constraints);
        if !constraints.iter().any(is_meant) {
            let names = constraints
                .iter()
                .map(|constraint| constraint.name.as_str());
            return Err(Kind::UnknownConstraint {
                nearest: nearest(&name, names),
                name,
            });
        }
        let mut softened = Vec::new();
        let mut gone = Affine::default();
        for mut constraint in constraints {
            let large = || Kind::PassOfLength { pass: "elastic" };
            if is_meant(&constraint) {
                if matches!(constraint.kind, ConstraintKind::Velocity { .. }) {
                    let name = constraint.name;
                    return Err(Kind::ElasticVelocity { name });
                }
                gone = plus_rows(&gone, &constraint).ok_or_else(large)?;
                softened.push(constraint);
            } else {
                let row = constraint.row.plus_scaled(&gone, -1);
                constraint.row = row.ok_or_else(large)?;
                self.model.constraints.push(constraint);
            }
        }
        Ok(softened)
    }
}

/// φ², summed over the sites.
fn square(graph: &mut Graph, constraint: &Constraint) -> ExprId {
    let own = graph.multiply(constraint.value, constraint.value);
    let outwards = constraint.ranges.iter().rev();
    outwards.fold(own, |body, range| graph.sum(range.clone(), body))
}

/// The number of equations with those of one more constraint.
fn plus_rows(rows: &Affine, constraint: &Constraint) -> Option<Affine> {
    match constraint.ranges.first() {
        None => rows.plus_scaled(&Affine::constant(1), 1),
        Some(sites) => rows
            .plus_scaled(&sites.end, 1)?
            .plus_scaled(&sites.start, -1),
    }
}
