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
            // Of tanh to the digits of one: 1/cosh² has all, and derivatives that are infinite times zero from |x| = 355 on.
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
                let rest = below_one(graph, x);
                let root = graph.call(Self::Sqrt, &[rest]);
                let slope = graph.divide(one, root);
                if self == Self::Asin {
                    slope
                } else {
                    graph.negate(slope)
                }
            }
            Self::Atan => {
                let square = graph.multiply(x, x);
                let below = graph.add(one, square);
                graph.divide(one, below)
            }
            Self::Atanh => {
                let below = below_one(graph, x);
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
                let below = if self == Self::Asinh {
                    let square = graph.multiply(x, x);
                    graph.add(square, one)
                } else {
                    let below = below_one(graph, x);
                    graph.negate(below)
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

/// (1 − x)(1 + x), which has all digits near ±1.
fn below_one(graph: &mut Graph, x: ExprId) -> ExprId {
    let one = graph.constant(Constant::ONE);
    let (less, more) = (graph.subtract(one, x), graph.add(one, x));
    graph.multiply(less, more)
}
