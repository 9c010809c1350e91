//! The requirements of a time transformation on the other arguments.

use super::Model;
use crate::diagnostic::{Bag, Kind, Role};
use crate::expr::input::IndexSymbol;
use crate::model::declared::{CLOCK_MOMENTUM, Form};

impl Model {
    /// Requires a Hamiltonian, a number of coordinates that is known here, and that nothing conflicts with p_t = −H.
    pub(super) fn transformation(&self, bag: &mut Bag) {
        let Some((_, span)) = self.time_transformation else {
            return;
        };
        if let Some((Form::Lagrangian, _)) = self.energy {
            bag.push(span, Kind::TransformationOfLagrangian);
        }
        if let Some(length) = self.unknown_size() {
            bag.push(span, Kind::TransformationOfFamily { length });
        }
        for (argument, is_there) in [
            ("constraint", !self.constraints.is_empty()),
            ("sensitivity", !self.sensitivities.is_empty()),
            ("model", !self.variants.is_empty()),
            ("input", !self.inputs.is_empty()),
        ] {
            if is_there {
                bag.push(span, Kind::TransformationWith { argument });
            }
        }
        for (solver, (element, span)) in self.solvers.iter().zip(&self.solver_elements) {
            if solver.element.needs_velocities() {
                let (element, nodes) = (element.clone(), solver.element.nodes);
                bag.push(*span, Kind::SolverOfTransformation { element, nodes });
            }
        }
    }

    /// The name of the length of an array of coordinates, where that is no number.
    fn unknown_size(&self) -> Option<String> {
        // A length with a mistake looks like a field, too.
        if self.coordinates.iter().any(super::Slots::has_wrong_length) {
            return None;
        }
        match self.dof.terms.first() {
            Some((IndexSymbol::ConstParameter(length) | IndexSymbol::Field(length), _)) => {
                Some(length.clone())
            }
            _ => None,
        }
    }

    /// The momentum of the time, if there is one, has reserved its name.
    pub(super) fn clock_momentum(&self, name: &str) -> Option<Kind> {
        let is_taken = self.time_transformation.is_some() && name == CLOCK_MOMENTUM;
        is_taken.then(|| Kind::NameClash {
            name: name.to_owned(),
            taken: Role::Momentum,
        })
    }
}
