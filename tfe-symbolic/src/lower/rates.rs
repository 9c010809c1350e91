//! `dot()`: the total time derivative, by the chain rule.

use super::{DotRule, Lowerer, Value};
use crate::check::{Model, Symbol};
use crate::diagnostic::{Kind, Span};
use crate::expr::differentiate::{derivative, directional};
use crate::expr::graph::{ExprId, Node};
use crate::expr::input::{Affine, Input};
use crate::expr::rewrite::Mapping;
use crate::syntax::ast::{Expr, ExprKind};

/// What goes wrong in a total derivative.
#[derive(Default)]
struct Trouble {
    acceleration: bool,
    momentum: bool,
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
            Input::Multiplier(_)
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
        let mut mapping = Mapping::default();
        for id in self.graph.reachable(&[force]) {
            let node = self.graph.node(id).clone();
            let new = match &node {
                Node::Input(Input::Velocity(at)) => {
                    derivative(&mut self.graph, energy, &Input::Momentum(at.clone()))
                }
                node => self.graph.remake(node, &mapping),
            };
            mapping.set(id, new);
        }
        mapping.of(force)
    }
}

/// Which `let`s hold a `dot()`, themselves or by those before them.
pub(super) fn lets_with_rates(model: &Model) -> Vec<bool> {
    let mut rates = Vec::with_capacity(model.lets.len());
    for (_, value) in &model.lets {
        let found = holds_rate(value, model, &rates);
        rates.push(found);
    }
    rates
}

fn holds_rate(expr: &Expr, model: &Model, rates: &[bool]) -> bool {
    let mut stack = vec![expr];
    while let Some(expr) = stack.pop() {
        match &expr.node {
            ExprKind::Call { function, .. }
                if matches!(function.node.as_str(), "dot" | "body_rate") =>
            {
                return true;
            }
            ExprKind::Name(name) => {
                if let Some(Symbol::Let(at)) = model.symbols.get(name)
                    && rates.get(*at).copied().unwrap_or(false)
                {
                    return true;
                }
            }
            _ => {}
        }
        stack.extend(expr.children());
    }
    false
}
