//! Coordinates, velocities and fields that the energy does not contain.

use super::Lowerer;
use crate::diagnostic::{Kind, Span};
use crate::expr::differentiate::derivative;
use crate::expr::graph::ExprId;
use crate::expr::input::{Affine, IndexSymbol, Input};
use crate::model::declared::{Constraint, Force, Form};
use crate::syntax::context::FieldKind;

/// Which elements of a flat vector occur.
struct Coverage(Vec<bool>);

impl Coverage {
    fn of(lowerer: &Lowerer<'_>, inputs: &[Input], pick: fn(&Input) -> Option<&Affine>) -> Self {
        let generic = lowerer.model.dof.as_constant().is_none();
        let size = lowerer
            .model
            .dof
            .as_constant()
            .and_then(|dof| usize::try_from(dof).ok());
        let mut covered = vec![false; size.unwrap_or(1)];
        for index in inputs.iter().filter_map(pick) {
            // An index that varies covers its extent; where that is not known, everything.
            let extent = match index.as_constant() {
                _ if generic => None,
                Some(at) => Some((at, at)),
                None => lowerer.extents.get(index).copied().flatten(),
            };
            for (at, covered) in covered.iter_mut().enumerate() {
                *covered |= extent.is_none_or(|(low, high)| (low..=high).contains(&(at as i64)));
            }
        }
        Self(covered)
    }

    fn has(&self, at: usize) -> bool {
        self.0.get(at).copied().unwrap_or(true)
    }
}

impl Lowerer<'_> {
    pub(super) fn check_usage(
        &mut self,
        form: Form,
        energy: Option<ExprId>,
        others: (&[Constraint], &[Force], Option<ExprId>),
    ) {
        // Without an energy, which has been reported, nothing can be called unused.
        if self.model.incomplete || self.model.energy.is_none() {
            return;
        }
        self.check_fields();
        self.check_inputs();
        if let Some(energy) = energy
            && !self.model.coordinates.is_empty()
        {
            self.check_energy(form, energy, others);
        }
    }

    fn check_fields(&mut self) {
        let context = self.context;
        // A field that a misspelt name may have meant, or one with another mistake, is not reported.
        let meant: Vec<String> =
            self.bag
                .iter()
                .filter_map(|diagnostic| match &diagnostic.kind {
                    Kind::UnknownSymbol { nearest, .. }
                    | Kind::UnknownParameter { nearest, .. } => nearest.clone(),
                    Kind::NameClash { name, .. }
                    | Kind::NotAFunction { name }
                    | Kind::ReservedName { name, field: true }
                    | Kind::ReservedPrefix { name, field: true } => Some(name.clone()),
                    _ => None,
                })
                .collect();
        for (field, used) in context.fields.iter().zip(self.fields.clone()) {
            let exempt = used
                || field.name.starts_with('_')
                || matches!(field.kind, FieldKind::Other(_))
                || meant.contains(&field.name);
            if !exempt {
                self.report(
                    Span::default(),
                    Kind::UnusedField {
                        name: field.name.clone(),
                    },
                );
            }
        }
    }

    fn check_inputs(&mut self) {
        let model = self.model;
        for (input, used) in model.inputs.iter().zip(self.inputs.clone()) {
            // A name with another mistake is not to blame.
            let is_wrong = self.bag.iter().any(|mistake| mistake.span == input.span);
            if !(used || is_wrong || input.node.starts_with('_')) {
                let name = input.node.clone();
                self.report(input.span, Kind::UnusedInput { name });
            }
        }
    }

    fn check_energy(
        &mut self,
        form: Form,
        energy: ExprId,
        (constraints, forces, dissipation): (&[Constraint], &[Force], Option<ExprId>),
    ) {
        let inputs = self.graph.inputs_of(energy);
        let model = self.model;
        let state = |input: &Input| {
            matches!(
                input,
                Input::Coordinate(_) | Input::Velocity(_) | Input::Momentum(_)
            )
        };
        // A coordinate with a mistake in its declaration is not missing from the energy.
        let wrong: Vec<bool> = model
            .coordinates
            .iter()
            .map(|slots| {
                let name = slots.name.span;
                slots.has_wrong_length() || self.bag.iter().any(|mistake| mistake.span == name)
            })
            .collect();
        if !inputs.iter().any(state) {
            if wrong.contains(&true) {
                return;
            }
            let span = model
                .energy
                .as_ref()
                .map_or(Span::default(), |(_, value)| value.span);
            self.report(
                span,
                Kind::ConstantEnergy {
                    energy: form.name(),
                },
            );
            return;
        }
        let coordinates = Coverage::of(self, &inputs, |input| match input {
            Input::Coordinate(at) => Some(at),
            _ => None,
        });
        let fibres = Coverage::of(self, &inputs, |input| match input {
            Input::Velocity(at) | Input::Momentum(at) => Some(at),
            _ => None,
        });
        let inputs: Vec<Input> = constraints
            .iter()
            .flat_map(|constraint| self.graph.inputs_of(constraint.value))
            .collect();
        let constrained = Coverage::of(self, &inputs, |input| match input {
            Input::Coordinate(at) | Input::Velocity(at) => Some(at),
            _ => None,
        });
        let moved = self.moved_by_forces(form, forces, dissipation);
        for (number, slots) in model.coordinates.iter().enumerate() {
            if wrong[number] {
                continue;
            }
            let length = slots.length.as_ref().and_then(Affine::as_constant);
            for at in 0..length.map_or(1, |length| length as usize) {
                // In a model of run-time length one place stands for all.
                let first = slots.first.as_constant();
                let flat = first
                    .and_then(|first| usize::try_from(first).ok())
                    .unwrap_or(0)
                    + at;
                // A constraint may determine what the Lagrangian leaves undetermined.
                if form == Form::Lagrangian && !inputs.is_empty() && constrained.has(flat) {
                    continue;
                }
                let element = |name: &str| match length {
                    Some(_) => format!("{name}[{at}]"),
                    None => name.to_owned(),
                };
                let name = element(&slots.name.node);
                let (span, kind) = match (coordinates.has(flat), fibres.has(flat), form) {
                    (false, false, _) if moved.has(flat) => {
                        self.remark_forces_only(&name, form);
                        break;
                    }
                    (false, false, _) => (
                        slots.name.span,
                        Kind::UnusedCoordinate {
                            name,
                            energy: form.name(),
                        },
                    ),
                    (true, false, Form::Lagrangian) => (slots.name.span, Kind::NoVelocity { name }),
                    (true, false, Form::Hamiltonian) => {
                        if let Some(momentum) = model.momenta.get(number) {
                            let momentum = element(&momentum.name.node);
                            self.remarks.push(format!(
                                "momentum `{momentum}` does not appear in the Hamiltonian: `{name}` is constant"
                            ));
                        }
                        break;
                    }
                    (_, true, Form::Lagrangian) if self.linear_velocity(energy, flat) => {
                        (slots.name.span, Kind::LinearVelocity { name })
                    }
                    _ => continue,
                };
                self.report(span, kind);
                // One message for each array is enough.
                break;
            }
        }
    }

    /// The coordinates whose motion is determined by forces: in a Lagrangian model those on which a force or the
    /// dissipation acts, in a Hamiltonian model also those on which forces depend.
    fn moved_by_forces(
        &self,
        form: Form,
        forces: &[Force],
        dissipation: Option<ExprId>,
    ) -> Coverage {
        let mut inputs: Vec<Input> = dissipation
            .iter()
            .flat_map(|dissipation| self.graph.inputs_of(*dissipation))
            .filter(|input| matches!(input, Input::Velocity(_)))
            .collect();
        for force in forces {
            inputs.extend(targets(force).into_iter().map(Input::Coordinate));
            if form == Form::Hamiltonian {
                inputs.extend(self.graph.inputs_of(force.value));
            }
        }
        Coverage::of(self, &inputs, |input| match input {
            Input::Coordinate(at) | Input::Velocity(at) | Input::Momentum(at) => Some(at),
            _ => None,
        })
    }

    fn remark_forces_only(&mut self, name: &str, form: Form) {
        let energy = form.name();
        let consequence = match form {
            Form::Lagrangian => "the forces on it must balance, and its momentum is zero",
            Form::Hamiltonian => "it is constant",
        };
        let remark =
            format!("coordinate `{name}` appears in forces, not in the {energy}: {consequence}");
        self.remarks.push(remark);
    }

    /// Whether ∂L/∂v of a coordinate depends on no velocity, so that the mass matrix has a zero row.
    fn linear_velocity(&mut self, energy: ExprId, at: usize) -> bool {
        if self.graph.contains_sum(energy) {
            return false;
        }
        let velocity = Input::Velocity(Affine::constant(at as i64));
        let momentum = derivative(&mut self.graph, energy, &velocity);
        let holds = |input: &Input| matches!(input, Input::Velocity(_));
        !self.graph.inputs_of(momentum).iter().any(holds)
    }
}

/// The coordinates that a force acts on, one by one where its range is literal.
fn targets(force: &Force) -> Vec<Affine> {
    let [range] = &force.ranges[..] else {
        return vec![force.target.clone()];
    };
    let (Some(start), Some(end)) = (range.start.as_constant(), range.end.as_constant()) else {
        return vec![force.target.clone()];
    };
    let factor = force.target.factor_of(range.variable);
    let index = Affine::symbol(IndexSymbol::Loop(range.variable));
    let fixed = force.target.plus_scaled(&index, factor.wrapping_neg());
    let target = |at| fixed.as_ref()?.plus_scaled(&Affine::constant(at), factor);
    (start..end).filter_map(target).collect()
}
