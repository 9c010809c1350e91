//! Operators and functions.

use super::{Lowerer, Value};
use crate::diagnostic::{Kind, Span};
use crate::expr::comparison::Comparison;
use crate::expr::constant::Constant;
use crate::expr::function::{Domain, Function};
use crate::expr::graph::ExprId;
use crate::expr::input::Input;
use crate::syntax::ast::{BinaryOperator, Expr, ExprKind, Name};
use crate::vocabulary::SPECIAL_FUNCTIONS;

impl Lowerer<'_> {
    /// `a + b - c …`: a chain leans left, so that its length must not use stack.
    pub(super) fn chain(&mut self, expr: &Expr) -> Value {
        let mut steps = Vec::new();
        let mut first = expr;
        while let ExprKind::Binary {
            operator,
            left,
            right,
        } = &first.node
        {
            steps.push((*operator, left.as_ref(), right.as_ref(), first));
            first = left;
        }
        let mut value = self.value(first);
        for (operator, left, right, whole) in steps.into_iter().rev() {
            let other = self.value(right);
            value = self.binary(operator, (left, value), (right, other), whole.span);
            self.finite(&value, whole);
        }
        value
    }

    fn binary(
        &mut self,
        operator: BinaryOperator,
        (left, a): (&Expr, Value),
        (right, b): (&Expr, Value),
        span: Span,
    ) -> Value {
        use BinaryOperator::{Add, Divide, Multiply, Power, Subtract};
        if matches!(a, Value::Error) || matches!(b, Value::Error) {
            return Value::Error;
        }
        match (operator, a, b) {
            (Add, Value::Scalar(a), Value::Scalar(b)) => Value::Scalar(self.graph.add(a, b)),
            (Subtract, Value::Scalar(a), Value::Scalar(b)) => {
                Value::Scalar(self.graph.subtract(a, b))
            }
            (Multiply, Value::Scalar(a), Value::Scalar(b)) => {
                Value::from(self.multiply(a, b, span))
            }
            (Divide, Value::Scalar(a), Value::Scalar(b)) => {
                Value::from(self.quotient(a, b, right.span))
            }
            (Power, Value::Scalar(a), Value::Scalar(b)) => {
                Value::from(self.power((left, a), (right, b)))
            }
            (Add | Subtract, Value::Vector(a), Value::Vector(b)) => {
                if a.len() != b.len() {
                    let kind = Kind::WrongLength {
                        expected: a.len(),
                        found: b.len(),
                    };
                    self.report(right.span, kind);
                    return Value::Error;
                }
                let pairs = a.into_iter().zip(b);
                Value::Vector(match operator {
                    Add => pairs.map(|(a, b)| self.graph.add(a, b)).collect(),
                    _ => pairs.map(|(a, b)| self.graph.subtract(a, b)).collect(),
                })
            }
            (Multiply, Value::Scalar(a), Value::Vector(b))
            | (Multiply, Value::Vector(b), Value::Scalar(a)) => {
                self.each(b, |lowerer, b| lowerer.multiply(a, b, span))
            }
            (Divide, Value::Vector(a), Value::Scalar(b)) => {
                self.each(a, |lowerer, a| lowerer.quotient(a, b, right.span))
            }
            (operator, a, _) => {
                let (kind, at) = match operator {
                    Add | Subtract => (Kind::ScalarPlusVector, span),
                    Multiply => (Kind::ProductOfVectors, span),
                    Divide => (Kind::DivisionByVector, right.span),
                    Power if matches!(a, Value::Vector(_)) => (Kind::PowerOfVector, left.span),
                    Power => (Kind::PowerOfVector, right.span),
                };
                self.report(at, kind);
                Value::Error
            }
        }
    }

    /// Component by component.
    pub(super) fn each(
        &mut self,
        components: Vec<ExprId>,
        mut work: impl FnMut(&mut Self, ExprId) -> Option<ExprId>,
    ) -> Value {
        let parts: Option<Vec<ExprId>> = components
            .into_iter()
            .map(|component| work(self, component))
            .collect();
        parts.map_or(Value::Error, Value::Vector)
    }

    pub(super) fn multiply(&mut self, a: ExprId, b: ExprId, span: Span) -> Option<ExprId> {
        let loops = self.graph.contains_sum(a) && self.graph.contains_sum(b);
        if !(loops && self.setting.linear_loops) {
            return Some(self.graph.multiply(a, b));
        }
        // A product with a single loop is still linear.
        match (self.written_out(a), self.written_out(b)) {
            (None, None) => {
                self.cannot_be_written_out(&[a, b], span);
                None
            }
            (left, right) => {
                let (a, b) = (left.unwrap_or(a), right.unwrap_or(b));
                Some(self.graph.multiply(a, b))
            }
        }
    }

    pub(super) fn quotient(&mut self, a: ExprId, b: ExprId, divisor: Span) -> Option<ExprId> {
        if self.graph.as_constant(b).is_some_and(Constant::is_zero) {
            self.report(divisor, Kind::DivisionByZero);
            return None;
        }
        let b = self.no_loop(b, divisor)?;
        Some(self.graph.divide(a, b))
    }

    fn power(
        &mut self,
        (base, a): (&Expr, ExprId),
        (exponent, b): (&Expr, ExprId),
    ) -> Option<ExprId> {
        let a = self.no_loop(a, base.span)?;
        let b = self.no_loop(b, exponent.span)?;
        let (base_value, exponent_value) = (self.graph.as_constant(a), self.graph.as_constant(b));
        if base_value.is_some_and(Constant::is_zero)
            && exponent_value.is_some_and(Constant::is_negative)
        {
            self.report(base.span, Kind::DivisionByZero);
            return None;
        }
        let is_fraction = exponent_value.is_some_and(|value| value.to_f64().fract() != 0.0);
        if is_fraction && base_value.is_some_and(Constant::is_negative) {
            self.report(base.span, Kind::RootOfNegative);
            return None;
        }
        let positive = base_value.is_some_and(|value| value.to_f64() > 0.0);
        if exponent_value.is_none() && !positive && self.varies(b) {
            let (base, text) = (base.to_string(), exponent.to_string());
            self.report(
                exponent.span,
                Kind::VariableExponent {
                    base,
                    exponent: text,
                },
            );
            return None;
        }
        Some(self.graph.power(a, b))
    }

    /// Whether a value changes along a motion.
    fn varies(&self, id: ExprId) -> bool {
        let varying = |input: &Input| {
            matches!(
                input,
                Input::Time
                    | Input::Control(_)
                    | Input::Coordinate(_)
                    | Input::Velocity(_)
                    | Input::Momentum(_)
            )
        };
        self.graph.inputs_of(id).iter().any(varying)
    }

    /// Reports constants that overflow when they are folded.
    pub(super) fn finite(&mut self, value: &Value, expr: &Expr) {
        let parts = match value {
            Value::Scalar(id) => std::slice::from_ref(id),
            Value::Vector(components) => components.as_slice(),
            Value::Error => &[],
        };
        let is_infinite = |id: &ExprId| {
            let number = self.graph.as_constant(*id);
            number.is_some_and(|number| !number.to_f64().is_finite())
        };
        if parts.iter().any(is_infinite) {
            self.report(
                expr.span,
                Kind::NumberTooLarge {
                    number: expr.to_string(),
                },
            );
        }
    }

    pub(super) fn call(&mut self, name: &Name, arguments: &[Expr], whole: &Expr) -> Value {
        let special = SPECIAL_FUNCTIONS
            .iter()
            .find(|(special, _)| *special == name.node);
        let function = Function::parse(&name.node);
        let arity = special
            .map(|(_, arity)| *arity)
            .or(function.map(Function::arity));
        let Some(expected) = arity else {
            self.not_a_function(&name.node, name.span);
            // Mistakes inside are reported whatever is around them.
            for argument in arguments {
                self.value(argument);
            }
            return Value::Error;
        };
        if arguments.len() != expected {
            let (function, found) = (name.node.clone(), arguments.len());
            self.report(
                name.span,
                Kind::WrongArity {
                    function,
                    expected,
                    found,
                },
            );
            for argument in arguments {
                self.value(argument);
            }
            return Value::Error;
        }
        let value = match function {
            Some(function) => Value::from(self.elementary(function, arguments)),
            None => self.special(&name.node, arguments, whole.span),
        };
        self.finite(&value, whole);
        value
    }

    fn elementary(&mut self, function: Function, arguments: &[Expr]) -> Option<ExprId> {
        let values: Vec<Option<ExprId>> = arguments
            .iter()
            .map(|argument| {
                let value = self.scalar(argument)?;
                self.no_loop(value, argument.span)
            })
            .collect();
        let values: Vec<ExprId> = values.into_iter().collect::<Option<_>>()?;
        if let (Some(&value), Some(argument)) = (values.first(), arguments.first())
            && let Some(constant) = self.graph.as_constant(value)
            && !defined(function.domain(), constant.to_f64())
        {
            self.report(argument.span, Kind::OutsideDomain { function });
            return None;
        }
        Some(self.graph.call(function, &values))
    }

    pub(super) fn select(
        &mut self,
        comparison: Comparison,
        sides: [&Expr; 2],
        values: [&Expr; 2],
    ) -> Value {
        let [left, right, then, otherwise] = [sides[0], sides[1], values[0], values[1]];
        let condition = [left, right].map(|side| {
            let value = self.scalar(side)?;
            self.no_loop(value, side.span)
        });
        let branches = (self.value(then), self.value(otherwise));
        let [Some(left), Some(right)] = condition else {
            return Value::Error;
        };
        match branches {
            (Value::Error, _) | (_, Value::Error) => Value::Error,
            (Value::Scalar(a), Value::Scalar(b)) => {
                let a = self.no_loop(a, then.span);
                let b = self.no_loop(b, otherwise.span);
                let (Some(a), Some(b)) = (a, b) else {
                    return Value::Error;
                };
                Value::Scalar(self.graph.select(comparison, left, right, a, b))
            }
            (Value::Vector(a), Value::Vector(b)) if a.len() == b.len() => {
                let mut others = b.into_iter();
                self.each(a, |lowerer, a| {
                    let a = lowerer.no_loop(a, then.span)?;
                    let b = lowerer.no_loop(others.next()?, otherwise.span)?;
                    Some(lowerer.graph.select(comparison, left, right, a, b))
                })
            }
            (Value::Vector(a), Value::Vector(b)) => {
                let kind = Kind::WrongLength {
                    expected: a.len(),
                    found: b.len(),
                };
                self.report(otherwise.span, kind);
                Value::Error
            }
            (Value::Scalar(_), Value::Vector(b)) => {
                self.report(otherwise.span, Kind::ScalarExpected { length: b.len() });
                Value::Error
            }
            (Value::Vector(_), Value::Scalar(_)) => {
                self.report(otherwise.span, Kind::VectorExpected);
                Value::Error
            }
        }
    }
}

/// Whether a function of this domain is defined at a number.
fn defined(domain: Domain, x: f64) -> bool {
    match domain {
        // Odd quarter turns are no rationals, hence never hit exactly.
        Domain::Everywhere | Domain::NotOddQuarterTurns => true,
        Domain::NonNegative => x >= 0.0,
        Domain::Positive => x > 0.0,
        Domain::UnitInterval => x.abs() <= 1.0,
        Domain::OpenUnitInterval => x.abs() < 1.0,
        Domain::AtLeastOne => x >= 1.0,
    }
}
