//! Norms, the degrees of expressions in them, and expressions with one in place of a norm.

use super::facts::{argument_of_logarithm, factors_of, is_field};
use super::forms::{Part, part, parts_of_form};
use crate::expr::comparison::Comparison;
use crate::expr::constant::Constant;
use crate::expr::function::Function;
use crate::expr::graph::{ExprId, Graph, Node};
use crate::expr::input::Input;
use crate::expr::rewrite::Mapping;

/// The depth to which roots, powers and sums are searched.
pub(super) const MAX_DEPTH: usize = 6;

/// The depth to which sums are searched for terms that are infinite.
pub(super) const MAX_SUMS: usize = 3;

/// The depth to which norms of norms are opened.
const MAX_NESTING: usize = 3;

/// √(Σ c xᵢ²) with c > 0, also of one square, or of another form that is positive definite; hypot(x₁, x₂) or |x|; or
/// anything of which the logarithm is taken.
#[derive(Clone)]
pub(super) struct Norm {
    pub(super) root: Option<ExprId>,
    /// The argument of the root without a constant factor.
    pub(super) square: Option<ExprId>,
    /// The same without parameters as factors, if there are some.
    bare: Option<ExprId>,
    /// Whether there is no constant factor.
    pub(super) is_plain: bool,
    /// Whether it may be negative.
    is_signed: bool,
    /// The xᵢ. Those that are norms have their own parts behind them.
    parts: Vec<Part>,
}

/// The sum in a product of parameters with one sum.
fn without_parameters(graph: &Graph, square: ExprId) -> Option<ExprId> {
    let Node::Product(factors) = graph.node(square) else {
        return None;
    };
    let mut others = factors.iter().filter(|(x, _)| !is_field(graph, *x));
    match (others.next(), others.next()) {
        (Some((sum, 1)), None) if matches!(graph.node(*sum), Node::Sum { .. }) => Some(*sum),
        _ => None,
    }
}

/// The parts of a norm, and behind each that is a norm its own parts: |x| ≤ hypot(x, y) ≤ hypot(hypot(x, y), z).
fn with_parts_of_norms(graph: &Graph, parts: Vec<Part>, depth: usize) -> Vec<Part> {
    let Some(depth) = depth.checked_sub(1) else {
        return parts;
    };
    let mut all = Vec::with_capacity(parts.len());
    for part in parts {
        let norm = match part[..] {
            [(x, 1)] if matches!(graph.node(x), Node::Call { .. }) => {
                Norm::nested(graph, x, depth).filter(|norm| norm.root == Some(x))
            }
            _ => None,
        };
        all.push(part);
        all.extend(norm.into_iter().flat_map(|norm| norm.parts));
    }
    all
}

/// The terms of a sum, or the values between which is chosen; none for anything else.
pub(super) fn terms_or_branches(graph: &Graph, x: ExprId) -> Vec<ExprId> {
    match graph.node(x) {
        Node::Sum { terms, .. } => terms.iter().map(|(_, term)| *term).collect(),
        Node::Select {
            then, otherwise, ..
        } => vec![*then, *otherwise],
        _ => Vec::new(),
    }
}

/// Whether f(x)/x is one at x = 0.
pub(super) fn is_small_with_its_argument(function: Function) -> bool {
    matches!(
        function,
        Function::Sin
            | Function::Tan
            | Function::Asin
            | Function::Atan
            | Function::Sinh
            | Function::Tanh
            | Function::Asinh
            | Function::Atanh
    )
}

impl Norm {
    /// The norm of which an expression is a root, a power or the square, or which it is itself.
    pub(super) fn of(graph: &Graph, x: ExprId) -> Option<Self> {
        Self::nested(graph, x, MAX_NESTING)
    }

    fn nested(graph: &Graph, x: ExprId, depth: usize) -> Option<Self> {
        let mut x = x;
        for _ in 0..MAX_DEPTH {
            x = graph.as_multiple(x).1;
            match graph.node(x) {
                Node::Power { base, .. } => x = *base,
                Node::Call {
                    function: Function::Sqrt,
                    arguments,
                } => {
                    let argument = *arguments.first()?;
                    let square = graph.as_multiple(argument).1;
                    if !matches!(graph.node(square), Node::Call { .. }) {
                        return Some(Self {
                            root: Some(x),
                            is_plain: square == argument,
                            ..Self::of_square(graph, square, depth)?
                        });
                    }
                    x = square;
                }
                Node::Call {
                    function: Function::Hypot | Function::Abs,
                    arguments,
                } => {
                    let parts = arguments.iter().map(|y| part(graph, *y, 1));
                    let parts = parts.collect::<Option<Vec<Part>>>()?;
                    return Some(Self {
                        root: Some(x),
                        square: None,
                        bare: None,
                        is_plain: true,
                        is_signed: false,
                        parts: with_parts_of_norms(graph, parts, depth),
                    });
                }
                Node::Sum { .. } | Node::Product(_) => return Self::of_square(graph, x, depth),
                _ => return None,
            }
        }
        None
    }

    fn of_square(graph: &Graph, square: ExprId, depth: usize) -> Option<Self> {
        let bare = without_parameters(graph, square);
        let parts = parts_of_form(graph, bare.unwrap_or(square))?;
        let root = Node::Call {
            function: Function::Sqrt,
            arguments: vec![square],
        };
        Some(Self {
            root: graph.find(&root),
            square: Some(square),
            bare,
            is_plain: true,
            is_signed: false,
            parts: with_parts_of_norms(graph, parts, depth),
        })
    }

    /// The argument of a logarithm, as a norm of one part.
    pub(super) fn of_argument(x: ExprId) -> Self {
        Self {
            root: Some(x),
            square: None,
            bare: None,
            is_plain: true,
            is_signed: true,
            parts: vec![vec![(x, 1)]],
        }
    }

    /// Whether it is a norm of parts, and not just an argument of a logarithm.
    pub(super) fn has_parts(&self) -> bool {
        !self.is_signed
    }

    pub(super) fn is(&self, other: &Self) -> bool {
        (self.root, self.square) == (other.root, other.square)
    }

    /// The degree of the norm, or of a root or power of it.
    pub(super) fn own_degree(&self, graph: &Graph, x: ExprId, depth: usize) -> Option<f64> {
        let depth = depth.checked_sub(1)?;
        let x = graph.as_multiple(x).1;
        if Some(x) == self.root {
            return Some(1.0);
        }
        if Some(x) == self.square || Some(x) == self.bare {
            return Some(2.0);
        }
        match graph.node(x) {
            Node::Power { base, exponent } => {
                let exponent = graph.as_constant(*exponent)?;
                Some(exponent.to_f64() * self.own_degree(graph, *base, depth)?)
            }
            Node::Call {
                function: Function::Sqrt,
                arguments,
            } => Some(self.own_degree(graph, *arguments.first()?, depth)? / 2.0),
            _ => None,
        }
    }

    /// A lower bound of the degree of an expression in the norm and its parts, of which other divisors do not count.
    pub(super) fn degree(&self, graph: &Graph, x: ExprId, depth: usize) -> f64 {
        let Some(depth) = depth.checked_sub(1) else {
            return 0.0;
        };
        let x = graph.as_multiple(x).1;
        if self.parts.iter().any(|part| part[..] == [(x, 1)]) {
            return 1.0;
        }
        if let Some(degree) = self.own_degree(graph, x, MAX_DEPTH) {
            return degree;
        }
        match graph.node(x) {
            Node::Product(factors) => self.degree_of_product(graph, factors, depth),
            Node::Sum { constant, terms } => {
                let degrees = terms.iter().map(|(_, y)| self.degree(graph, *y, depth));
                let least = degrees.reduce(f64::min).unwrap_or(0.0);
                match constant.is_zero() {
                    true => least,
                    false => least.min(0.0),
                }
            }
            Node::Call {
                function,
                arguments,
            } => {
                // min(u, 2) is u where that vanishes.
                let is_beyond = |y: &ExprId| match (function, graph.as_constant(*y)) {
                    (Function::Min, Some(c)) => !c.is_negative(),
                    (Function::Max, Some(c)) => c.is_negative(),
                    _ => false,
                };
                let near = arguments.iter().filter(|y| !is_beyond(y));
                let degrees = near.map(|y| self.degree(graph, *y, depth));
                let least = degrees.reduce(f64::min).unwrap_or(0.0).max(0.0);
                match function {
                    _ if is_small_with_its_argument(*function) => least,
                    Function::Abs | Function::Hypot | Function::Min | Function::Max => least,
                    Function::Sqrt => least / 2.0,
                    _ => 0.0,
                }
            }
            Node::Select {
                then, otherwise, ..
            } => {
                let [then, otherwise] = [*then, *otherwise].map(|y| self.degree(graph, y, depth));
                then.min(otherwise)
            }
            Node::Constant(number) if number.is_zero() => f64::INFINITY,
            _ => 0.0,
        }
    }

    /// The same of a product.
    pub(super) fn degree_of_product(
        &self,
        graph: &Graph,
        factors: &[(ExprId, i32)],
        depth: usize,
    ) -> f64 {
        let mut degree = 0.0;
        // What parts are made of.
        let mut left: Vec<(ExprId, i32)> = Vec::new();
        for (x, n) in factors {
            let is_in_part = self.parts.iter().flatten().any(|(y, _)| y == x);
            if let Some(own) = self.own_degree(graph, *x, MAX_DEPTH) {
                degree += f64::from(*n) * own;
            } else if *n > 0 && is_in_part {
                left.push((*x, *n));
            } else if *n > 0 {
                degree += f64::from(*n) * self.degree(graph, *x, depth);
            }
        }
        for part in &self.parts {
            let stands_in = |(x, n): &(ExprId, i32)| {
                let here = left.iter().find(|(y, _)| x == y);
                here.map_or(0, |(_, m)| m / n)
            };
            let times = part.iter().map(stands_in).min().unwrap_or(0);
            degree += f64::from(times);
            for (x, n) in part {
                for (_, m) in left.iter_mut().filter(|(y, _)| x == y) {
                    *m -= times * n;
                }
            }
        }
        degree
    }

    /// Whether a factor is infinite where the norm vanishes: the norm below, its logarithm, or a sum or a choice with such a term.
    pub(super) fn diverges(&self, graph: &Graph, (x, n): (ExprId, i32), sums: usize) -> bool {
        if let Some(degree) = self.own_degree(graph, x, MAX_DEPTH) {
            return degree * f64::from(n) < 0.0;
        }
        if n < 0 {
            return false;
        }
        if let Some(argument) = argument_of_logarithm(graph, x) {
            let mut factors = factors_of(graph, argument).into_iter();
            return factors.any(|(y, _)| self.own_degree(graph, y, MAX_DEPTH).is_some());
        }
        let Some(sums) = sums.checked_sub(1) else {
            return false;
        };
        let mut factors = terms_or_branches(graph, x)
            .into_iter()
            .flat_map(|term| factors_of(graph, term));
        factors.any(|factor| self.diverges(graph, factor, sums))
    }

    /// Such a factor with one in place of the norm where that vanishes; another one as it is.
    pub(super) fn made_finite(
        &self,
        graph: &mut Graph,
        (x, n): (ExprId, i32),
        sums: usize,
    ) -> ExprId {
        if !self.diverges(graph, (x, n), sums) {
            return x;
        }
        if self.own_degree(graph, x, MAX_DEPTH).is_some() {
            return self.or_one(graph, x);
        }
        if let Some(argument) = argument_of_logarithm(graph, x) {
            let argument = self.or_one(graph, argument);
            return graph.call(Function::Ln, &[argument]);
        }
        let mut mapping = Mapping::default();
        for term in terms_or_branches(graph, x) {
            let number = graph.as_multiple(term).0;
            let mut factors = factors_of(graph, term);
            for (y, m) in &mut factors {
                *y = self.made_finite(graph, (*y, *m), sums.saturating_sub(1));
            }
            let finite = graph.product(number, &factors);
            mapping.set(term, finite);
        }
        let node = graph.node(x).clone();
        graph.remake(&node, &mapping)
    }

    /// The norm, or a root or power of it, with one in place of the norm where that vanishes. For a negative multiple of a norm that may be negative, minus one.
    fn or_one(&self, graph: &mut Graph, x: ExprId) -> ExprId {
        let (coefficient, inner) = graph.as_multiple(x);
        let one = match self.is_signed && coefficient.is_negative() {
            true => Constant::MINUS_ONE,
            false => Constant::ONE,
        };
        let new = self.or(graph, inner, one);
        graph.scale(coefficient, new)
    }

    fn or(&self, graph: &mut Graph, x: ExprId, at_zero: Constant) -> ExprId {
        let is_own = |x: ExprId| [self.root, self.square, self.bare].contains(&Some(x));
        match (graph.node(x).clone(), self.root) {
            // With one choice for the norm and its square.
            (_, Some(root)) if Some(x) == self.square && self.is_plain => {
                let root = self.or_one(graph, root);
                graph.product(Constant::ONE, &[(root, 2)])
            }
            _ if is_own(x) => {
                let at_zero = graph.constant(at_zero);
                self.elsewhere(graph, x, at_zero)
            }
            (Node::Product(mut factors), _) => {
                for (y, _) in &mut factors {
                    if self.own_degree(graph, *y, MAX_DEPTH).is_some() {
                        *y = self.or(graph, *y, at_zero);
                    }
                }
                graph.product(Constant::ONE, &factors)
            }
            (Node::Power { base, exponent }, _) => {
                let base = self.or_one(graph, base);
                graph.power(base, exponent)
            }
            (
                Node::Call {
                    function,
                    arguments,
                },
                _,
            ) => {
                let arguments: Vec<ExprId> = arguments
                    .iter()
                    .map(|argument| self.or_one(graph, *argument))
                    .collect();
                graph.call(function, &arguments)
            }
            _ => x,
        }
    }

    /// The norm, or its square, with one in its place where it is zero.
    pub(super) fn one_where_zero(&self, graph: &mut Graph, x: ExprId) -> ExprId {
        let one = graph.constant(Constant::ONE);
        self.elsewhere(graph, x, one)
    }

    /// Another value where the norm or its square is zero, and the norm elsewhere. A radicand that parameters make
    /// negative is not a square, and stays NaN in a power.
    pub(super) fn elsewhere(&self, graph: &mut Graph, x: ExprId, at_zero: ExprId) -> ExprId {
        let zero = graph.constant(Constant::ZERO);
        let is_parameter =
            |input: &Input| matches!(input, Input::Parameter(_) | Input::ParameterElement(..));
        let is_norm = matches!(graph.node(x), Node::Call { .. });
        let may_be_negative =
            self.is_signed || (!is_norm && graph.inputs_of(x).iter().any(is_parameter));
        let size = match may_be_negative {
            true => graph.call(Function::Abs, &[x]),
            false => x,
        };
        graph.select(Comparison::LessOrEqual, size, zero, at_zero, x)
    }
}
