//! Derivatives of the elementary functions, as expressions.

use crate::expr::constant::Constant;
use crate::expr::function::Function;
use crate::expr::graph::{ExprId, Graph};

impl Function {
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
}
