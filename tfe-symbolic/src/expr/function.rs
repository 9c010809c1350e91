//! The one table of elementary functions: name, arity, domain, derivative, emitted method, evaluation.

use std::fmt;

use crate::expr::constant::Constant;
use crate::expr::graph::{ExprId, Graph};
use crate::syntax::ast::Comparison;

/// An elementary function.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Function {
    /// sin x
    Sin,
    /// cos x
    Cos,
    /// tan x
    Tan,
    /// arcsin x
    Asin,
    /// arccos x
    Acos,
    /// arctan x
    Atan,
    /// Angle of the point (x, y), written `atan2(y, x)`
    Atan2,
    /// sinh x
    Sinh,
    /// cosh x
    Cosh,
    /// tanh x
    Tanh,
    /// arsinh x
    Asinh,
    /// arcosh x
    Acosh,
    /// artanh x
    Atanh,
    /// eˣ
    Exp,
    /// Natural logarithm
    Ln,
    /// √x
    Sqrt,
    /// |x|
    Abs,
    /// −1, 0 or 1
    Sign,
    /// The smaller one
    Min,
    /// The larger one
    Max,
    /// √(x² + y²)
    Hypot,
}

/// Where a function is defined on the reals.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Domain {
    /// Everywhere
    Everywhere,
    /// Everywhere but at odd multiples of π/2
    NotOddQuarterTurns,
    /// x ≥ 0
    NonNegative,
    /// x > 0
    Positive,
    /// −1 ≤ x ≤ 1
    UnitInterval,
    /// −1 < x < 1
    OpenUnitInterval,
    /// x ≥ 1
    AtLeastOne,
}

/// What f(−x) is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Parity {
    Even,
    Odd,
    Neither,
}

impl Function {
    /// All of them.
    pub const ALL: [Self; 21] = [
        Self::Sin,
        Self::Cos,
        Self::Tan,
        Self::Asin,
        Self::Acos,
        Self::Atan,
        Self::Atan2,
        Self::Sinh,
        Self::Cosh,
        Self::Tanh,
        Self::Asinh,
        Self::Acosh,
        Self::Atanh,
        Self::Exp,
        Self::Ln,
        Self::Sqrt,
        Self::Abs,
        Self::Sign,
        Self::Min,
        Self::Max,
        Self::Hypot,
    ];

    /// The name in the language, which is also the name of the emitted method.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Sin => "sin",
            Self::Cos => "cos",
            Self::Tan => "tan",
            Self::Asin => "asin",
            Self::Acos => "acos",
            Self::Atan => "atan",
            Self::Atan2 => "atan2",
            Self::Sinh => "sinh",
            Self::Cosh => "cosh",
            Self::Tanh => "tanh",
            Self::Asinh => "asinh",
            Self::Acosh => "acosh",
            Self::Atanh => "atanh",
            Self::Exp => "exp",
            Self::Ln => "ln",
            Self::Sqrt => "sqrt",
            Self::Abs => "abs",
            Self::Sign => "sign",
            Self::Min => "min",
            Self::Max => "max",
            Self::Hypot => "hypot",
        }
    }

    /// The method of the runtime's scalar that computes it: `first.method(second)`.
    pub const fn method(self) -> &'static str {
        self.name()
    }

    /// The function of this name.
    pub fn parse(name: &str) -> Option<Self> {
        Self::ALL
            .into_iter()
            .find(|function| function.name() == name)
    }

    /// The number of arguments.
    pub const fn arity(self) -> usize {
        match self {
            Self::Atan2 | Self::Min | Self::Max | Self::Hypot => 2,
            _ => 1,
        }
    }

    /// Where it is defined.
    pub const fn domain(self) -> Domain {
        match self {
            Self::Tan => Domain::NotOddQuarterTurns,
            Self::Asin | Self::Acos => Domain::UnitInterval,
            Self::Acosh => Domain::AtLeastOne,
            Self::Atanh => Domain::OpenUnitInterval,
            Self::Ln => Domain::Positive,
            Self::Sqrt => Domain::NonNegative,
            _ => Domain::Everywhere,
        }
    }

    /// What the sign of the argument does to the value.
    pub(crate) const fn parity(self) -> Parity {
        match self {
            Self::Cos | Self::Cosh | Self::Abs => Parity::Even,
            Self::Sin
            | Self::Tan
            | Self::Asin
            | Self::Atan
            | Self::Sinh
            | Self::Tanh
            | Self::Asinh
            | Self::Atanh
            | Self::Sign => Parity::Odd,
            _ => Parity::Neither,
        }
    }

    /// Whether it is defined and smooth for all numbers.
    pub(crate) fn is_entire(self) -> bool {
        matches!(
            self,
            Self::Sin
                | Self::Cos
                | Self::Atan
                | Self::Sinh
                | Self::Cosh
                | Self::Tanh
                | Self::Asinh
                | Self::Exp
        )
    }

    /// Its value, by the functions of the standard library that emitted kernels use for `f64`.
    ///
    /// Too few arguments count as NaN.
    pub fn evaluate(self, arguments: &[f64]) -> f64 {
        let x = arguments.first().copied().unwrap_or(f64::NAN);
        let y = arguments.get(1).copied().unwrap_or(f64::NAN);
        match self {
            Self::Sin => x.sin(),
            Self::Cos => x.cos(),
            Self::Tan => x.tan(),
            Self::Asin => x.asin(),
            Self::Acos => x.acos(),
            Self::Atan => x.atan(),
            Self::Atan2 => x.atan2(y),
            Self::Sinh => x.sinh(),
            Self::Cosh => x.cosh(),
            Self::Tanh => x.tanh(),
            Self::Asinh => x.asinh(),
            Self::Acosh => x.acosh(),
            Self::Atanh => x.atanh(),
            Self::Exp => x.exp(),
            Self::Ln => x.ln(),
            Self::Sqrt => x.sqrt(),
            Self::Abs => x.abs(),
            Self::Sign if x > 0.0 => 1.0,
            Self::Sign if x < 0.0 => -1.0,
            Self::Sign => 0.0,
            Self::Min => x.min(y),
            Self::Max => x.max(y),
            Self::Hypot => x.hypot(y),
        }
    }

    /// The partial derivative by the argument of this number, as nodes of `graph`.
    ///
    /// At kinks: |x|′ = sign x, which is 0 at 0; of `min` and `max` the first argument counts where both are equal.
    pub fn derivative(self, graph: &mut Graph, arguments: &[ExprId], by: usize) -> ExprId {
        let one = graph.constant(Constant::ONE);
        let zero = graph.constant(Constant::ZERO);
        let Some(&x) = arguments.first() else {
            return zero;
        };
        let y = arguments.get(1).copied().unwrap_or(x);
        match self {
            Self::Sin => graph.call(Self::Cos, &[x]),
            Self::Cos => {
                let sine = graph.call(Self::Sin, &[x]);
                graph.negate(sine)
            }
            Self::Tan | Self::Tanh => {
                let value = graph.call(self, &[x]);
                let square = graph.multiply(value, value);
                if self == Self::Tan {
                    graph.add(one, square)
                } else {
                    graph.subtract(one, square)
                }
            }
            Self::Asin | Self::Acos => {
                let square = graph.multiply(x, x);
                let rest = graph.subtract(one, square);
                let root = graph.call(Self::Sqrt, &[rest]);
                let slope = graph.divide(one, root);
                if self == Self::Asin {
                    slope
                } else {
                    graph.negate(slope)
                }
            }
            Self::Atan | Self::Atanh => {
                let square = graph.multiply(x, x);
                let below = if self == Self::Atan {
                    graph.add(one, square)
                } else {
                    graph.subtract(one, square)
                };
                graph.divide(one, below)
            }
            Self::Atan2 => {
                let (y, x) = (x, y);
                let (x2, y2) = (graph.multiply(x, x), graph.multiply(y, y));
                let below = graph.add(x2, y2);
                if by == 0 {
                    graph.divide(x, below)
                } else {
                    let slope = graph.divide(y, below);
                    graph.negate(slope)
                }
            }
            Self::Sinh => graph.call(Self::Cosh, &[x]),
            Self::Cosh => graph.call(Self::Sinh, &[x]),
            Self::Asinh | Self::Acosh => {
                let square = graph.multiply(x, x);
                let below = if self == Self::Asinh {
                    graph.add(square, one)
                } else {
                    graph.subtract(square, one)
                };
                let root = graph.call(Self::Sqrt, &[below]);
                graph.divide(one, root)
            }
            Self::Exp => graph.call(Self::Exp, &[x]),
            Self::Ln => graph.divide(one, x),
            Self::Sqrt => {
                let root = graph.call(Self::Sqrt, &[x]);
                let two = graph.integer(2);
                let below = graph.multiply(two, root);
                graph.divide(one, below)
            }
            Self::Abs => graph.call(Self::Sign, &[x]),
            Self::Sign => zero,
            Self::Min | Self::Max => {
                let (first, second) = if by == 0 { (one, zero) } else { (zero, one) };
                graph.select(self.takes_first(), x, y, first, second)
            }
            Self::Hypot => {
                let value = graph.call(Self::Hypot, &[x, y]);
                graph.divide(if by == 0 { x } else { y }, value)
            }
        }
    }

    /// For `min` and `max`: the comparison of the arguments under which the first is the value.
    pub(crate) const fn takes_first(self) -> Comparison {
        match self {
            Self::Max => Comparison::GreaterOrEqual,
            _ => Comparison::LessOrEqual,
        }
    }
}

impl fmt::Display for Function {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_unique_and_read_back() {
        for function in Function::ALL {
            assert_eq!(Function::parse(function.name()), Some(function));
        }
        assert_eq!(Function::parse("sine"), None);
    }

    #[test]
    fn parity_agrees_with_the_values() {
        // 0.3 lies in the domain of every function that has a parity.
        for function in Function::ALL
            .into_iter()
            .filter(|function| function.arity() == 1)
        {
            let (plus, minus) = (function.evaluate(&[0.3]), function.evaluate(&[-0.3]));
            // The inverse hyperbolic functions of the standard library are odd only to a rounding.
            match function.parity() {
                Parity::Even => assert!((plus - minus).abs() <= f64::EPSILON, "{function}"),
                Parity::Odd => assert!((plus + minus).abs() <= f64::EPSILON, "{function}"),
                Parity::Neither => assert_ne!(plus.abs(), minus.abs(), "{function}"),
            }
        }
    }

    #[test]
    fn sign_of_zero_is_zero() {
        assert_eq!(Function::Sign.evaluate(&[0.0]), 0.0);
        assert_eq!(Function::Sign.evaluate(&[-2.0]), -1.0);
    }
}
