//! Functions of vectors, in components.

use super::{Lowerer, Value};
use crate::diagnostic::{Kind, Span};
use crate::expr::function::Function;
use crate::expr::graph::ExprId;
use crate::syntax::ast::Expr;

type Vector3 = [ExprId; 3];

impl Lowerer<'_> {
    /// The functions that are no elementary ones; the number of arguments has been checked.
    pub(super) fn special(&mut self, name: &str, arguments: &[Expr], span: Span) -> Value {
        match (name, arguments) {
            ("dot", [argument]) => self.rate(argument, span),
            ("norm", [argument]) => Value::from(self.norm(argument)),
            ("inner", [a, b]) => Value::from(self.inner(a, b, span)),
            ("cross", [a, b]) => {
                let operands = (self.sized::<3>(a), self.sized::<3>(b));
                let (Some(a), Some(b)) = operands else {
                    return Value::Error;
                };
                self.cross(a, b, span)
                    .map_or(Value::Error, |cross| Value::Vector(cross.into()))
            }
            ("rotate", [quaternion, vector]) => {
                let operands = (self.sized::<4>(quaternion), self.sized::<3>(vector));
                let (Some(e), Some(r)) = operands else {
                    return Value::Error;
                };
                self.rotate(e, r, span)
                    .map_or(Value::Error, |r| Value::Vector(r.into()))
            }
            ("body_rate", [quaternion]) => {
                let e = self.sized::<4>(quaternion);
                let rate = self.rate(quaternion, span);
                let (Some(e), Value::Vector(rate)) = (e, rate) else {
                    return Value::Error;
                };
                let Ok(rate) = <[ExprId; 4]>::try_from(rate) else {
                    return Value::Error;
                };
                self.body_rate(e, rate, span)
                    .map_or(Value::Error, |w| Value::Vector(w.into()))
            }
            // `sum(…)` and `select(…)` are syntax of their own.
            _ => Value::Error,
        }
    }

    /// A vector of exactly `N` components.
    fn sized<const N: usize>(&mut self, expr: &Expr) -> Option<[ExprId; N]> {
        let components = self.vector(expr)?;
        let found = components.len();
        match <[ExprId; N]>::try_from(components) {
            Ok(components) => Some(components),
            Err(_) => {
                self.report(expr.span, Kind::WrongLength { expected: N, found });
                None
            }
        }
    }

    fn inner(&mut self, a: &Expr, b: &Expr, span: Span) -> Option<ExprId> {
        let operands = (self.vector(a), self.vector(b));
        let (Some(left), Some(right)) = operands else {
            return None;
        };
        if left.len() != right.len() {
            let kind = Kind::WrongLength {
                expected: left.len(),
                found: right.len(),
            };
            self.report(b.span, kind);
            return None;
        }
        self.scalar_product(&left, &right, span)
    }

    fn norm(&mut self, argument: &Expr) -> Option<ExprId> {
        let components = self.vector(argument)?;
        let square = self.scalar_product(&components, &components, argument.span)?;
        let square = self.no_loop(square, argument.span)?;
        Some(self.graph.call(Function::Sqrt, &[square]))
    }

    fn scalar_product(&mut self, a: &[ExprId], b: &[ExprId], span: Span) -> Option<ExprId> {
        let mut sum = self.graph.integer(0);
        for (a, b) in a.iter().zip(b) {
            let product = self.multiply(*a, *b, span)?;
            sum = self.graph.add(sum, product);
        }
        Some(sum)
    }

    /// a × b
    fn cross(&mut self, a: Vector3, b: Vector3, span: Span) -> Option<Vector3> {
        let mut minor = |i: usize, j: usize| {
            let plus = self.multiply(a[i], b[j], span)?;
            let minus = self.multiply(a[j], b[i], span)?;
            Some(self.graph.subtract(plus, minus))
        };
        Some([minor(1, 2)?, minor(2, 0)?, minor(0, 1)?])
    }

    /// R(e) r with R = (e₀² − |e⃗|²) I + 2 e⃗ e⃗ᵀ + 2 e₀ e⃗×, e = (e₀, e⃗) from body to space.
    ///
    /// For a unit quaternion this is e ∘ r ∘ ē; for others it scales by |e|² as that product does.
    fn rotate(&mut self, e: [ExprId; 4], r: Vector3, span: Span) -> Option<Vector3> {
        let axis = [e[1], e[2], e[3]];
        let square = self.multiply(e[0], e[0], span)?;
        let axis_square = self.scalar_product(&axis, &axis, span)?;
        let along = self.graph.subtract(square, axis_square);
        let projection = self.scalar_product(&axis, &r, span)?;
        let turned = self.cross(axis, r, span)?;
        let mut component = |k: usize| {
            let plain = self.multiply(along, r[k], span)?;
            let projected = self.multiply(projection, axis[k], span)?;
            let turned = self.multiply(e[0], turned[k], span)?;
            let both = self.graph.add(projected, turned);
            let two = self.graph.integer(2);
            let twice = self.graph.multiply(two, both);
            Some(self.graph.add(plain, twice))
        };
        Some([component(0)?, component(1)?, component(2)?])
    }

    /// The vector part of 2 ē ∘ ė, that is 2 (e₀ ė⃗ − ė₀ e⃗ − e⃗ × ė⃗).
    fn body_rate(&mut self, e: [ExprId; 4], rate: [ExprId; 4], span: Span) -> Option<Vector3> {
        let cross = self.cross([e[1], e[2], e[3]], [rate[1], rate[2], rate[3]], span)?;
        let mut component = |k: usize| {
            let forward = self.multiply(e[0], rate[k + 1], span)?;
            let backward = self.multiply(rate[0], e[k + 1], span)?;
            let difference = self.graph.subtract(forward, backward);
            let difference = self.graph.subtract(difference, cross[k]);
            let two = self.graph.integer(2);
            Some(self.graph.multiply(two, difference))
        };
        Some([component(0)?, component(1)?, component(2)?])
    }
}
