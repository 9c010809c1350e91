//! `dot()`: the total time derivative, by the chain rule.

use super::{DotRule, Lowerer, Value};
use crate::diagnostic::{Kind, Span};
use crate::expr::differentiate::{derivative, directional};
use crate::expr::graph::ExprId;
use crate::expr::input::{Affine, Input};
use crate::syntax::ast::Expr;

/// What goes wrong in a total derivative.
#[derive(Default)]
struct Trouble {
    acceleration: bool,
    momentum: bool,
    input: Option<String>,
    varying_index: bool,
}

impl Lowerer<'_> {
    pub(super) fn rate(&mut self, argument: &Expr, span: Span) -> Value {
        if self.setting.dot == DotRule::Forbidden {
            self.report(span, Kind::VelocityInHamiltonian { via: None });
            return Value::Error;
        }
        match self.value(argument) {
            Value::Scalar(id) => Value::from(self.total_derivative(id, span)),
            Value::Vector(components) => {
                self.each(components, |lowerer, id| lowerer.total_derivative(id, span))
            }
            Value::Error => Value::Error,
        }
    }

    /// d/dt, with q̇ = v in a Lagrangian model and q̇ = ∂H/∂p in a Hamiltonian one.
    fn total_derivative(&mut self, id: ExprId, span: Span) -> Option<ExprId> {
        let by_hamiltonian = self.setting.dot == DotRule::ByHamiltonian;
        let needs_velocity = |input: &Input| matches!(input, Input::Coordinate(_));
        let hamiltonian = if by_hamiltonian && self.graph.inputs_of(id).iter().any(needs_velocity) {
            // Without H there is a message already.
            let hamiltonian = self.hamiltonian?;
            let Some(hamiltonian) = self.written_out(hamiltonian) else {
                self.report(span, Kind::VelocityOfLoop);
                return None;
            };
            Some(hamiltonian)
        } else {
            None
        };
        let mut trouble = Trouble::default();
        let rate = directional(&mut self.graph, id, &mut |graph, input| match input {
            Input::Time => Some(graph.integer(1)),
            Input::Coordinate(at) => match hamiltonian {
                None => Some(graph.input(Input::Velocity(at.clone()))),
                Some(energy) if at.as_constant().is_some() => {
                    Some(derivative(graph, energy, &Input::Momentum(at.clone())))
                }
                Some(_) => {
                    trouble.varying_index = true;
                    None
                }
            },
            Input::Velocity(_) => {
                trouble.acceleration = true;
                None
            }
            Input::Momentum(_) => {
                trouble.momentum = true;
                None
            }
            Input::Control(name) => {
                trouble.input = Some(name.clone());
                None
            }
            Input::Multiplier(_)
            | Input::Placeholder(..)
            | Input::Parameter(_)
            | Input::ParameterElement(..)
            | Input::Integer(_) => None,
        });
        let kind = match trouble {
            Trouble {
                acceleration: true, ..
            } => Kind::Acceleration,
            Trouble { momentum: true, .. } => Kind::RateOfMomentum,
            Trouble {
                input: Some(name), ..
            } => Kind::RateOfInput { name },
            Trouble {
                varying_index: true,
                ..
            } => Kind::VelocityOfLoop,
            _ => return Some(rate),
        };
        self.report(span, kind);
        None
    }

    /// Q = −∂D/∂v for a coordinate of a Hamiltonian model, where D holds velocities v = ∂H/∂p.
    pub(super) fn damping(&mut self, dissipation: ExprId, at: i64, energy: ExprId) -> ExprId {
        let velocity = Input::Velocity(Affine::constant(at));
        let slope = derivative(&mut self.graph, dissipation, &velocity);
        let force = self.graph.negate(slope);
        self.graph
            .with_leaves(force, &mut |graph, input| match input {
                Input::Velocity(at) => {
                    Some(derivative(graph, energy, &Input::Momentum(at.clone())))
                }
                _ => None,
            })
    }
}
