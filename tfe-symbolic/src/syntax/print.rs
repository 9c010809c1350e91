//! Syntax back to text that parses to the same syntax.

use std::fmt;

use crate::syntax::ast::{
    Array, BinaryOperator, ElementSyntax, Entry, Expr, ExprKind, Item, Pass, Range, Spanned,
};

impl BinaryOperator {
    /// The operator as written.
    pub fn symbol(self) -> char {
        match self {
            Self::Add => '+',
            Self::Subtract => '-',
            Self::Multiply => '*',
            Self::Divide => '/',
            Self::Power => '^',
        }
    }

    fn precedence(self) -> u8 {
        match self {
            Self::Add | Self::Subtract => 1,
            Self::Multiply | Self::Divide => 2,
            Self::Power => NEGATE + 1,
        }
    }
}

/// The precedence of unary minus.
const NEGATE: u8 = 3;
/// The precedence of everything that needs no parentheses.
const ATOM: u8 = 5;

impl ExprKind {
    fn precedence(&self) -> u8 {
        match self {
            Self::Binary { operator, .. } => operator.precedence(),
            Self::Negate(_) => NEGATE,
            _ => ATOM,
        }
    }
}

/// `expr`, in parentheses if it binds weaker than `at_least`.
struct Operand<'a> {
    expr: &'a Expr,
    at_least: u8,
}

impl fmt::Display for Operand<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.expr.node.precedence() < self.at_least {
            write!(f, "({})", self.expr)
        } else {
            write!(f, "{}", self.expr)
        }
    }
}

impl<T: fmt::Display> fmt::Display for Spanned<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.node.fmt(f)
    }
}

impl fmt::Display for ExprKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(text) | Self::Name(text) => f.write_str(text),
            Self::Index { value, index } => {
                write!(
                    f,
                    "{}[{index}]",
                    Operand {
                        expr: value,
                        at_least: ATOM
                    }
                )
            }
            // `--x` parses, but reads like a decrement.
            Self::Negate(value) => write!(
                f,
                "-{}",
                Operand {
                    expr: value,
                    at_least: NEGATE + 1
                }
            ),
            Self::Binary {
                operator,
                left,
                right,
            } => {
                let own = operator.precedence();
                // Left-associative operators need parentheses on the right at equal precedence,
                // the power on the left.
                let (at_left, at_right) = match operator {
                    BinaryOperator::Power => (own + 1, own),
                    _ => (own, own + 1),
                };
                let left = Operand {
                    expr: left,
                    at_least: at_left,
                };
                let right = Operand {
                    expr: right,
                    at_least: at_right,
                };
                match operator {
                    BinaryOperator::Add | BinaryOperator::Subtract => {
                        write!(f, "{left} {} {right}", operator.symbol())
                    }
                    _ => write!(f, "{left}{}{right}", operator.symbol()),
                }
            }
            Self::Call {
                function,
                arguments,
            } => write!(f, "{function}({})", Listed(arguments)),
            Self::Select {
                comparison,
                left,
                right,
                then,
                otherwise,
            } => {
                let sign = comparison.symbol();
                write!(f, "select({left} {sign} {right}, {then}, {otherwise})")
            }
            Self::Sum { range, body } => write!(f, "sum({range}, {body})"),
            Self::Vector(components) => write!(f, "[{}]", Listed(components)),
            Self::Error => f.write_str("…"),
        }
    }
}

/// Items with commas between them.
struct Listed<'a, T>(&'a [T]);

impl<T: fmt::Display> fmt::Display for Listed<'_, T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (at, item) in self.0.iter().enumerate() {
            if at > 0 {
                f.write_str(", ")?;
            }
            item.fmt(f)?;
        }
        Ok(())
    }
}

impl fmt::Display for Range {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let start = self.start.to_string();
        // `3...n` would not part into `3.` and `..`.
        let gap = if start.ends_with('.') { " " } else { "" };
        write!(f, "{} in {start}{gap}..{}", self.variable, self.end)
    }
}

impl fmt::Display for Array {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.length {
            Some(length) => write!(f, "{}[{length}]", self.name),
            None => self.name.fmt(f),
        }
    }
}

impl fmt::Display for ElementSyntax {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}::<{}>", self.family, self.nodes)?;
        match &self.rule {
            Some((rule, Some(argument))) => write!(f, ".{rule}({argument})"),
            Some((rule, None)) => write!(f, ".{rule}()"),
            None => Ok(()),
        }
    }
}

impl fmt::Display for Pass {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}({})", self.word, Listed(&self.entries))
    }
}

impl fmt::Display for Entry {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.target {
            Some(target) => write!(f, "{target} = {}", self.value),
            None => self.value.fmt(f),
        }
    }
}

impl fmt::Display for Item {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Coordinates(arrays) => write!(f, "coordinates({})", Listed(arrays)),
            Self::Momenta(arrays) => write!(f, "momenta({})", Listed(arrays)),
            Self::Input(names) => {
                let names: Vec<&str> = names.iter().map(|name| &*name.node).collect();
                write!(f, "input({})", names.join(", "))
            }
            Self::Let { name, value } => write!(f, "let {name} = {value}"),
            Self::Lagrangian(value) => write!(f, "lagrangian = {value}"),
            Self::Hamiltonian(value) => write!(f, "hamiltonian = {value}"),
            Self::Force { target, value } => write!(f, "force({target}) = {value}"),
            Self::Dissipation(value) => write!(f, "dissipation = {value}"),
            Self::TimeTransformation(rate) => write!(f, "time_transformation = {rate}"),
            Self::Constraint {
                name,
                range: Some(range),
                value,
            } => {
                write!(f, "constraint({name}[{range}]) = {value}")
            }
            Self::Constraint {
                name,
                range: None,
                value,
            } => {
                write!(f, "constraint({name}) = {value}")
            }
            Self::Output {
                name,
                range: Some(range),
                value,
            } => {
                write!(f, "output({name}[{range}]) = {value}")
            }
            Self::Output {
                name,
                range: None,
                value,
            } => write!(f, "output({name}) = {value}"),
            Self::Sensitivity(parameters) => {
                let parameters: Vec<String> = parameters.iter().map(ToString::to_string).collect();
                write!(f, "sensitivity({})", parameters.join(", "))
            }
            Self::Solver { name, element } => write!(f, "solver({name}, {element})"),
            Self::Model { name, passes } => {
                write!(f, "model({name}")?;
                passes.iter().try_for_each(|pass| write!(f, ", {pass}"))?;
                f.write_str(")")
            }
            Self::Crate(path) => write!(f, "crate = {path}"),
        }
    }
}
