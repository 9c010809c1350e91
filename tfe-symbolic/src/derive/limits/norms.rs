//! Quotients by a norm that vanish with it.
//!
//! ```text
//! h = √(x² + y²)       ∂(h x)/∂y = x y/h        |x y/h| ≤ h
//! ```
//!
//! A product of higher degree in x and y than its divisor is zero where they are zero: there 0/0 becomes 0/1, by
//! replacing the norm by one. A product of the same degree, such as the direction x/h, or of a lower one, such as the
//! attraction x/h³, has no limit and is unchanged.

use crate::expr::comparison::Comparison;
use crate::expr::constant::Constant;
use crate::expr::function::Function;
use crate::expr::graph::{ExprId, Graph, Node};
use crate::expr::hash::Map;
use crate::expr::input::Input;

/// The depth to which roots, powers and sums are searched.
const MAX_DEPTH: usize = 6;

/// Degrees are sums of exponents, which may have rounding errors.
const ROUNDING: f64 = 1e-6;

/// √(Σ c xᵢ²) with c > 0, also of one square, or hypot(x₁, x₂).
#[derive(Clone)]
struct Norm {
    root: Option<ExprId>,
    /// The argument of the root without a constant factor.
    square: Option<ExprId>,
    /// The same without parameters as factors, if there are some.
    bare: Option<ExprId>,
    /// Whether there is no constant factor.
    is_plain: bool,
    /// The xᵢ as products, without the parameters among their factors.
    parts: Vec<Vec<(ExprId, i32)>>,
}

/// The expressions examined so far; `None` for those that are not norms.
#[derive(Default)]
pub(super) struct Norms(Map<ExprId, Option<Norm>>);

impl Norms {
    /// A product in which norms in the denominator are replaced by one where the product vanishes with them.
    pub(super) fn limit(&mut self, graph: &mut Graph, x: ExprId) -> ExprId {
        let mut found: Vec<Norm> = Vec::new();
        for (y, n) in factors_of(graph, x) {
            if may_be_divided_by(graph, y, n) {
                let norm = self.0.entry(y).or_insert_with(|| Norm::of(graph, y));
                let is_new = |norm: &&Norm| !found.iter().any(|known| known.is(norm));
                if let Some(norm) = norm.as_ref().filter(is_new) {
                    found.push(norm.clone());
                }
            }
        }
        found.iter().fold(x, |x, norm| {
            let coefficient = graph.as_multiple(x).0;
            let factors = factors_of(graph, x);
            match norm.limit(graph, &factors) {
                Some(product) => graph.scale(coefficient, product),
                None => x,
            }
        })
    }
}

/// Whether a factor is of a kind that may be a norm below, or a power of one.
fn may_be_divided_by(graph: &Graph, x: ExprId, n: i32) -> bool {
    match graph.node(x) {
        Node::Power { .. } => true,
        Node::Call {
            function: Function::Sqrt | Function::Hypot,
            ..
        }
        | Node::Sum { .. } => n < 0,
        _ => false,
    }
}

/// The factors of an expression without its number.
fn factors_of(graph: &Graph, x: ExprId) -> Vec<(ExprId, i32)> {
    let x = graph.as_multiple(x).1;
    match graph.node(x) {
        Node::Product(factors) => factors.clone(),
        _ => vec![(x, 1)],
    }
}

/// The root of the factors of an expression without parameters, if they have one and it can vanish.
fn part(graph: &Graph, x: ExprId, root: i32) -> Option<Vec<(ExprId, i32)>> {
    let mut part = Vec::new();
    for (y, n) in factors_of(graph, x) {
        match graph.node(y) {
            Node::Input(Input::Parameter(_) | Input::ParameterElement(..)) => {}
            Node::Constant(_) => return None,
            _ if n > 0 && n % root == 0 => part.push((y, n / root)),
            _ => return None,
        }
    }
    (!part.is_empty()).then_some(part)
}

/// The sum in a product of parameters with one sum.
fn without_parameters(graph: &Graph, square: ExprId) -> Option<ExprId> {
    let Node::Product(factors) = graph.node(square) else {
        return None;
    };
    let is_parameter = |x: ExprId| {
        matches!(
            graph.node(x),
            Node::Input(Input::Parameter(_) | Input::ParameterElement(..))
        )
    };
    let mut others = factors.iter().filter(|(x, _)| !is_parameter(*x));
    match (others.next(), others.next()) {
        (Some((sum, 1)), None) if matches!(graph.node(*sum), Node::Sum { .. }) => Some(*sum),
        _ => None,
    }
}

/// One where a non-negative expression is zero, and the expression elsewhere.
fn one_where_zero(graph: &mut Graph, x: ExprId) -> ExprId {
    let one = graph.constant(Constant::ONE);
    elsewhere(graph, x, one)
}

/// The same of a square below one of the xᵢ, as x (h²)ᵉ, whose product with that is zero with it: where the exponent is −½ or more.
fn one_where_root_vanishes(graph: &mut Graph, square: ExprId, exponent: ExprId) -> ExprId {
    let [zero, one, two] = [0, 1, 2].map(|number| graph.integer(number));
    let half = graph.divide(one, two);
    let least = graph.negate(half);
    let at_zero = graph.select(Comparison::LessOrEqual, least, exponent, one, zero);
    elsewhere(graph, square, at_zero)
}

/// Another value where a norm or its square is zero, and the norm elsewhere. A radicand that parameters make negative
/// is not a square, and stays NaN in a power.
fn elsewhere(graph: &mut Graph, x: ExprId, at_zero: ExprId) -> ExprId {
    let zero = graph.constant(Constant::ZERO);
    let is_parameter =
        |input: &Input| matches!(input, Input::Parameter(_) | Input::ParameterElement(..));
    let is_norm = matches!(graph.node(x), Node::Call { .. });
    let size = match !is_norm && graph.inputs_of(x).iter().any(is_parameter) {
        true => graph.call(Function::Abs, &[x]),
        false => x,
    };
    graph.select(Comparison::LessOrEqual, size, zero, at_zero, x)
}

impl Norm {
    /// The norm of which an expression is a root, a power or the square, or which it is itself.
    fn of(graph: &Graph, x: ExprId) -> Option<Self> {
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
                            ..Self::of_square(graph, square)?
                        });
                    }
                    x = square;
                }
                Node::Call {
                    function: Function::Hypot,
                    arguments,
                } => {
                    let parts = arguments.iter().map(|y| part(graph, *y, 1));
                    return Some(Self {
                        root: Some(x),
                        square: None,
                        bare: None,
                        is_plain: true,
                        parts: parts.collect::<Option<_>>()?,
                    });
                }
                Node::Sum { .. } | Node::Product(_) => return Self::of_square(graph, x),
                _ => return None,
            }
        }
        None
    }

    fn of_square(graph: &Graph, square: ExprId) -> Option<Self> {
        let bare = without_parameters(graph, square);
        let (constant, terms) = graph.terms(bare.unwrap_or(square));
        let is_sum_of_squares =
            constant.is_zero() && terms.iter().all(|(c, _)| !c.is_negative() && !c.is_zero());
        if !is_sum_of_squares {
            return None;
        }
        let root = Node::Call {
            function: Function::Sqrt,
            arguments: vec![square],
        };
        let parts = terms.iter().map(|(_, y)| part(graph, *y, 2));
        Some(Self {
            root: graph.find(&root),
            square: Some(square),
            bare,
            is_plain: true,
            parts: parts.collect::<Option<_>>()?,
        })
    }

    fn is(&self, other: &Self) -> bool {
        (self.root, self.square) == (other.root, other.square)
    }

    /// The degree of the norm, or of a root or power of it.
    fn own_degree(&self, graph: &Graph, x: ExprId, depth: usize) -> Option<f64> {
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

    /// The lowest degree of the terms of an expression in the norm and its parts.
    fn degree(&self, graph: &Graph, x: ExprId, depth: usize) -> f64 {
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
            Node::Sum { constant, terms } if constant.is_zero() => {
                let degrees = terms.iter().map(|(_, y)| self.degree(graph, *y, depth));
                degrees.reduce(f64::min).unwrap_or(0.0)
            }
            _ => 0.0,
        }
    }

    /// The same of a product, of which other divisors do not count.
    fn degree_of_product(&self, graph: &Graph, factors: &[(ExprId, i32)], depth: usize) -> f64 {
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

    /// The product with this norm replaced by one where both vanish; `None` where the product is unchanged.
    fn limit(&self, graph: &mut Graph, factors: &[(ExprId, i32)]) -> Option<ExprId> {
        let unknown = |(x, n): &(ExprId, i32)| match graph.node(*x) {
            Node::Power { base, exponent } if *n == 1 => {
                let is_number = graph.as_constant(*exponent).is_some();
                let (coefficient, inner) = graph.as_multiple(*base);
                let is_own = Some(inner) == self.root || Some(inner) == self.square;
                let is_known = is_number || coefficient.is_negative();
                (is_own && !is_known).then_some((*x, *base, *exponent))
            }
            _ => None,
        };
        let mut unknown = factors.iter().filter_map(unknown);
        if let Some((power, base, exponent)) = unknown.next() {
            if unknown.next().is_some() {
                return None;
            }
            let rest: Vec<(ExprId, i32)> = factors
                .iter()
                .filter(|(x, _)| *x != power)
                .copied()
                .collect();
            return self.limit_of_power(graph, (base, exponent), &rest);
        }
        let is_below = |(x, n): &(ExprId, i32)| {
            let degree = self.own_degree(graph, *x, MAX_DEPTH);
            degree.is_some_and(|degree| degree * f64::from(*n) < 0.0)
        };
        let below: Vec<bool> = factors.iter().map(is_below).collect();
        let degree = self.degree_of_product(graph, factors, MAX_DEPTH);
        if !below.contains(&true) || degree <= ROUNDING {
            return None;
        }
        let mut limit = Vec::with_capacity(factors.len());
        for ((x, n), is_below) in factors.iter().zip(below) {
            limit.push(match is_below {
                true => (self.or_one(graph, *x), *n),
                false => (*x, *n),
            });
        }
        Some(graph.product(Constant::ONE, &limit))
    }

    /// t hᵉ with an exponent that is not known: (t/hᵐ) hᵉ⁺ᵐ with t/hᵐ of degree zero. That is zero, or infinite, with the power alone.
    ///
    /// Of t (h²)ᵉ with t of odd degree, where no root of h² is at hand, one degree is left beside the power.
    fn limit_of_power(
        &self,
        graph: &mut Graph,
        (base, exponent): (ExprId, ExprId),
        factors: &[(ExprId, i32)],
    ) -> Option<ExprId> {
        let inner = graph.as_multiple(base).1;
        let is_root = Some(inner) == self.root;
        let (mut rest, mut shift) = (Vec::new(), 0);
        for (x, n) in factors {
            // In units of the root.
            let unit = if Some(*x) == self.root {
                1
            } else if Some(*x) == self.square {
                2
            } else if self.own_degree(graph, *x, MAX_DEPTH).is_some() {
                return None;
            } else {
                rest.push((*x, *n));
                continue;
            };
            if *x != base && !(self.is_plain && inner == base) {
                return None;
            }
            shift += unit * i64::from(*n);
        }
        let degree = self.degree_of_product(graph, &rest, MAX_DEPTH);
        let above = degree as i64;
        let is_whole = degree == above as f64 && (0..=i64::from(u16::MAX)).contains(&above);
        let is_divided = shift < 0 || (shift == 0 && !is_root && above >= 1);
        if !is_whole || !is_divided {
            return None;
        }
        let is_single = shift == 0 && above == 1;
        if is_single && self.root.is_some() {
            // Beside a root of the norm, as of an attraction, zero is a singular point as a rule.
            return None;
        }
        let root = self.root.filter(|_| self.is_plain && inner == base);
        let (divisor, times, left) = match (is_root, root) {
            (true, _) => (base, above, 0),
            (false, Some(root)) if above % 2 == 1 => (root, above, 0),
            (false, _) => (base, above / 2, above % 2),
        };
        let units = if is_root { 1 } else { 2 };
        let added = Constant::rational(i128::from(shift + above - left), units)?;
        let (number, terms) = graph.terms(exponent);
        let number = number + added;
        let mut raised = base;
        if left == 1 {
            // A potential (h²)⁻ᵉ has no limit.
            let may_be_large = terms.iter().any(|(c, _)| !c.is_negative());
            if !may_be_large || (is_single && !number.is_negative()) {
                return None;
            }
        }
        let exponent = graph.linear(number, &terms);
        if left == 1 && number.is_negative() {
            raised = one_where_root_vanishes(graph, base, exponent);
        }
        rest.push((graph.power(raised, exponent), 1));
        if times > 0 {
            let divisor = one_where_zero(graph, divisor);
            rest.push((divisor, -i32::try_from(times).ok()?));
        }
        Some(graph.product(Constant::ONE, &rest))
    }

    /// The norm, or a root or power of it, with one in place of the norm where that vanishes.
    fn or_one(&self, graph: &mut Graph, x: ExprId) -> ExprId {
        let (coefficient, inner) = graph.as_multiple(x);
        let is_own = |x: ExprId| [self.root, self.square, self.bare].contains(&Some(x));
        let new = match (graph.node(inner).clone(), self.root) {
            // With one choice for the norm and its square.
            (_, Some(root)) if Some(inner) == self.square && self.is_plain => {
                let root = self.or_one(graph, root);
                graph.product(Constant::ONE, &[(root, 2)])
            }
            _ if is_own(inner) => one_where_zero(graph, inner),
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
            _ => inner,
        };
        graph.scale(coefficient, new)
    }
}
