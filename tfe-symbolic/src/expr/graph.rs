//! Expressions as a hash-consed arena: equal expressions are one node, children come before their parents.
//!
//! Nodes are made only by the constructors of [`Graph`], which simplify locally; the rewrites are listed in `simplify.rs`. Every walk is a
//! forward loop or an explicit stack, so a sum of a million terms cannot overflow the call stack.

use std::fmt;

use crate::expr::comparison::Comparison;
use crate::expr::constant::Constant;
use crate::expr::function::Function;
use crate::expr::hash::Map;
use crate::expr::input::{Affine, Input, LoopVariable};

/// If there are at most this many marks for each reachable node, reachable nodes are put in order by scanning the marks
/// of all nodes, which takes no longer than sorting; otherwise they are sorted.
const MARKS_PER_FOUND_NODE: usize = 32;

/// An expression of a [`Graph`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ExprId(u32);

/// `variable in start..end`
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct SumRange {
    /// The index.
    pub variable: LoopVariable,
    /// Its first value.
    pub start: Affine,
    /// One past its last value.
    pub end: Affine,
}

/// One node. Invariants are kept by the constructors in `simplify.rs`.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Node {
    Constant(Constant),
    Input(Input),
    /// `constant + Σ c x`: terms sorted, none of them constant. With several terms (counting the constant), the first
    /// coefficient is positive and the coefficients are not all of equal magnitude other than 1. With one term it is a
    /// multiple `c x`, c ≠ 1, of an x that is not a multiple, unless the product of both constants would leave the
    /// range of `f64`.
    Sum {
        constant: Constant,
        terms: Vec<(Constant, ExprId)>,
    },
    /// `Π x^n`: factors sorted, n ≠ 0, none a short product. A factor is a multiple only where the power of its
    /// constant would leave the range of `f64`, and constant only where it is 0 to a negative power.
    Product(Vec<(ExprId, i32)>),
    Power {
        base: ExprId,
        exponent: ExprId,
    },
    Call {
        function: Function,
        arguments: Vec<ExprId>,
    },
    Select {
        comparison: Comparison,
        left: ExprId,
        right: ExprId,
        then: ExprId,
        otherwise: ExprId,
    },
    /// `Σ body` over the range.
    Loop {
        range: SumRange,
        body: ExprId,
    },
}

/// Properties of a node that are kept, so that its children need not be visited.
#[derive(Clone, Copy, Debug, Default)]
struct Facts {
    /// Free loop variables, one bit for each depth.
    loops: u64,
    /// Whether there is a [`Node::Loop`] in it.
    contains_sum: bool,
}

/// A hash table without iteration, so that no order can depend on hashes.
#[derive(Clone, Debug, Default)]
struct Interner(Map<Node, ExprId>);

/// The arena.
#[derive(Clone, Debug, Default)]
pub struct Graph {
    nodes: Vec<Node>,
    facts: Vec<Facts>,
    known: Interner,
    /// Whether ranges whose bounds do not depend on outer loops may be assumed not to end below their start: models of
    /// run-time length are checked for that, and for places of what empty ones leave after their loops.
    pub(crate) ranges_are_checked: bool,
}

/// The error that a sum is too long to be written out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TooLong {
    /// The number of terms it would need.
    pub terms: u64,
    /// The largest number that is allowed.
    pub limit: u64,
}

impl ExprId {
    pub(crate) fn index(self) -> usize {
        self.0 as usize
    }
}

impl Node {
    /// The children, in order, repeated as often as they are used.
    pub(crate) fn children(&self) -> Vec<ExprId> {
        let mut children = Vec::new();
        self.for_each_child(|child| children.push(child));
        children
    }

    /// Visits the children, in order, as often as they are used, without memory for a list of them.
    pub(crate) fn for_each_child(&self, mut visit: impl FnMut(ExprId)) {
        match self {
            Self::Constant(_) | Self::Input(_) => {}
            Self::Sum { terms, .. } => {
                for (_, x) in terms {
                    visit(*x);
                }
            }
            Self::Product(factors) => {
                for (x, _) in factors {
                    visit(*x);
                }
            }
            Self::Power { base, exponent } => {
                visit(*base);
                visit(*exponent);
            }
            Self::Call { arguments, .. } => {
                for x in arguments {
                    visit(*x);
                }
            }
            Self::Select {
                left,
                right,
                then,
                otherwise,
                ..
            } => {
                for x in [left, right, then, otherwise] {
                    visit(*x);
                }
            }
            Self::Loop { body, .. } => visit(*body),
        }
    }
}

/// The bit of a loop variable in [`Graph::loops_of`]. Depths beyond 63 share the last bit, which only prevents some
/// hoisting.
pub(crate) fn loop_bit(variable: LoopVariable) -> u64 {
    1 << variable.0.min(63)
}

/// The bits of all loop variables in an index.
pub(crate) fn loops_in(affine: &Affine) -> u64 {
    let variables = affine.variables().into_iter();
    variables.fold(0, |mask, variable| mask | loop_bit(variable))
}

impl Graph {
    /// The node itself; for identifiers of this graph only.
    pub(crate) fn node(&self, id: ExprId) -> &Node {
        &self.nodes[id.index()]
    }

    /// Free loop variables of an expression, one bit a depth.
    pub(crate) fn loops_of(&self, id: ExprId) -> u64 {
        self.facts[id.index()].loops
    }

    /// The number of nodes made so far.
    pub fn len(&self) -> usize {
        self.nodes.len()
    }

    /// Whether nothing has been made yet.
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// Finds or makes the node. Children must exist.
    pub(crate) fn intern(&mut self, node: Node) -> ExprId {
        if let Some(id) = self.known.0.get(&node) {
            return *id;
        }
        let mut facts = node
            .children()
            .iter()
            .fold(Facts::default(), |facts, child| {
                let child = self.facts[child.index()];
                Facts {
                    loops: facts.loops | child.loops,
                    contains_sum: facts.contains_sum | child.contains_sum,
                }
            });
        match &node {
            Node::Input(input) => facts.loops |= input.index().map_or(0, loops_in),
            Node::Loop { range, .. } => {
                facts.loops &= !loop_bit(range.variable);
                facts.loops |= loops_in(&range.start) | loops_in(&range.end);
                facts.contains_sum = true;
            }
            _ => {}
        }
        let id = ExprId(
            u32::try_from(self.nodes.len()).expect("fewer than 2³² nodes: memory ends earlier"),
        );
        self.nodes.push(node.clone());
        self.facts.push(facts);
        self.known.0.insert(node, id);
        id
    }

    /// The node if it has been made already.
    pub(crate) fn find(&self, node: &Node) -> Option<ExprId> {
        self.known.0.get(node).copied()
    }

    /// A number.
    pub fn constant(&mut self, value: Constant) -> ExprId {
        self.intern(Node::Constant(value))
    }

    /// A whole number.
    pub fn integer(&mut self, value: i64) -> ExprId {
        self.constant(Constant::integer(value))
    }

    /// A leaf. An [`Input::Integer`] without symbols is a number.
    pub fn input(&mut self, input: Input) -> ExprId {
        match &input {
            Input::Integer(value) if value.terms.is_empty() => self.integer(value.constant),
            _ => self.intern(Node::Input(input)),
        }
    }

    /// Its value where it is a number.
    pub fn as_constant(&self, id: ExprId) -> Option<Constant> {
        match self.node(id) {
            Node::Constant(value) => Some(*value),
            _ => None,
        }
    }

    /// Whether a sum over a range occurs in it.
    pub fn contains_sum(&self, id: ExprId) -> bool {
        self.facts[id.index()].contains_sum
    }

    /// The nodes of which the roots consist, children before parents, without repetition.
    pub(crate) fn reachable(&self, roots: &[ExprId]) -> Vec<ExprId> {
        self.reached(roots, |_| true)
    }

    /// The same without the bodies of sums over ranges.
    pub(crate) fn reachable_outside_sums(&self, roots: &[ExprId]) -> Vec<ExprId> {
        self.reached(roots, |node| !matches!(node, Node::Loop { .. }))
    }

    /// The nodes of which the roots consist; nodes for which `is_entered` is false are included without their children.
    fn reached(&self, roots: &[ExprId], is_entered: impl Fn(&Node) -> bool) -> Vec<ExprId> {
        let mut seen = vec![false; roots.iter().map(|root| root.index() + 1).max().unwrap_or(0)];
        let mut stack = roots.to_vec();
        let mut found = Vec::new();
        while let Some(id) = stack.pop() {
            if !seen[id.index()] {
                seen[id.index()] = true;
                found.push(id);
                let node = self.node(id);
                if is_entered(node) {
                    node.for_each_child(|child| {
                        if !seen[child.index()] {
                            stack.push(child);
                        }
                    });
                }
            }
        }
        // Going through all marks is faster than sorting, unless few are set.
        if seen.len() <= MARKS_PER_FOUND_NODE * found.len() {
            found.clear();
            for (at, is_reached) in seen.iter().enumerate() {
                if *is_reached {
                    found.push(ExprId(at as u32));
                }
            }
        } else {
            found.sort_unstable();
        }
        found
    }

    /// The distinct leaves of an expression, in order of first making; inside sums their indices mention the loop variable.
    pub fn inputs_of(&self, id: ExprId) -> Vec<Input> {
        let leaf = |id: ExprId| match self.node(id) {
            Node::Input(input) => Some(input.clone()),
            _ => None,
        };
        self.reachable(&[id]).into_iter().filter_map(leaf).collect()
    }

    /// Whether an index of a coordinate, velocity or momentum in an expression depends on a loop.
    pub(crate) fn holds_varying_index(&self, id: ExprId) -> bool {
        self.inputs_of(id).iter().any(|input| match input {
            Input::Coordinate(at) | Input::Velocity(at) | Input::Momentum(at) => {
                at.as_constant().is_none()
            }
            _ => false,
        })
    }

    /// `c` and `x` with `id` = c x, where x is not a multiple (for the exception see [`Node::Sum`]).
    pub(crate) fn as_multiple(&self, id: ExprId) -> (Constant, ExprId) {
        match self.node(id) {
            Node::Sum { constant, terms } if constant.is_zero() && terms.len() == 1 => terms[0],
            _ => (Constant::ONE, id),
        }
    }

    /// `c` times `id` as such a number and expression; as they are where the product of the numbers would leave the range of `f64`.
    pub(crate) fn as_multiple_times(&self, c: Constant, id: ExprId) -> (Constant, ExprId) {
        let (own, x) = self.as_multiple(id);
        match c.product_in_range(own) {
            Some(product) => (product, x),
            None => (c, id),
        }
    }

    /// The terms of a sum of several terms.
    pub(crate) fn as_sum(&self, id: ExprId) -> Option<(Constant, &[(Constant, ExprId)])> {
        match self.node(id) {
            Node::Sum { constant, terms } if !constant.is_zero() || terms.len() > 1 => {
                Some((*constant, terms))
            }
            _ => None,
        }
    }

    /// Prints an expression in the notation of the language.
    pub fn display(&self, id: ExprId) -> Display<'_> {
        Display { graph: self, id }
    }
}

impl Input {
    /// The index of an element, or the number itself.
    pub(crate) fn index(&self) -> Option<&Affine> {
        match self {
            Self::Time | Self::Control(_) | Self::Parameter(_) => None,
            Self::Coordinate(index)
            | Self::Velocity(index)
            | Self::Momentum(index)
            | Self::Multiplier(index)
            | Self::Placeholder(_, index)
            | Self::ParameterElement(_, index)
            | Self::Integer(index) => Some(index),
        }
    }

    /// The same leaf with another index.
    pub(crate) fn with_index(&self, index: Affine) -> Self {
        match self {
            Self::Time | Self::Control(_) | Self::Parameter(_) => self.clone(),
            Self::Coordinate(_) => Self::Coordinate(index),
            Self::Velocity(_) => Self::Velocity(index),
            Self::Momentum(_) => Self::Momentum(index),
            Self::Multiplier(_) => Self::Multiplier(index),
            Self::Placeholder(number, _) => Self::Placeholder(*number, index),
            Self::ParameterElement(name, _) => Self::ParameterElement(name.clone(), index),
            Self::Integer(_) => Self::Integer(index),
        }
    }
}

/// An expression with its graph, for printing; made by [`Graph::display`].
#[derive(Clone, Copy, Debug)]
pub struct Display<'a> {
    graph: &'a Graph,
    id: ExprId,
}

/// Text still to be printed, innermost last.
enum Piece {
    Text(String),
    Expression { id: ExprId, parenthesised: bool },
}

impl fmt::Display for Display<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut stack = vec![Piece::Expression {
            id: self.id,
            parenthesised: false,
        }];
        while let Some(piece) = stack.pop() {
            match piece {
                Piece::Text(text) => f.write_str(&text)?,
                Piece::Expression { id, parenthesised } => {
                    let mut pieces = pieces(self.graph.node(id), parenthesised);
                    pieces.reverse();
                    stack.append(&mut pieces);
                }
            }
        }
        Ok(())
    }
}

fn pieces(node: &Node, parenthesised: bool) -> Vec<Piece> {
    let text = |text: &str| Piece::Text(text.to_owned());
    let whole = |id: &ExprId| Piece::Expression {
        id: *id,
        parenthesised: false,
    };
    let tight = |id: &ExprId| Piece::Expression {
        id: *id,
        parenthesised: true,
    };
    let mut pieces = Vec::new();
    match node {
        Node::Constant(value) => {
            let value = value.to_string();
            pieces.push(if parenthesised && value.contains(['-', '/']) {
                text(&format!("({value})"))
            } else {
                text(&value)
            });
            return pieces;
        }
        Node::Input(input) => pieces.push(text(&input.to_string())),
        Node::Sum { constant, terms } => {
            pieces.extend(parenthesised.then(|| text("(")));
            for (at, (coefficient, x)) in terms.iter().enumerate() {
                pieces.push(text(match (at, coefficient.is_negative()) {
                    (0, false) => "",
                    (0, true) => "-",
                    (_, false) => " + ",
                    (_, true) => " - ",
                }));
                if !coefficient.abs().is_one() {
                    pieces.push(text(&format!("{}*", coefficient.abs())));
                }
                pieces.push(tight(x));
            }
            if !constant.is_zero() {
                pieces.push(text(&format!(
                    " {} {}",
                    if constant.is_negative() { '-' } else { '+' },
                    constant.abs()
                )));
            }
            pieces.extend(parenthesised.then(|| text(")")));
        }
        Node::Product(factors) => {
            pieces.extend(parenthesised.then(|| text("(")));
            for (at, (x, exponent)) in factors.iter().enumerate() {
                pieces.extend((at > 0).then(|| text("*")));
                pieces.push(tight(x));
                match exponent {
                    1 => {}
                    0.. => pieces.push(text(&format!("^{exponent}"))),
                    _ => pieces.push(text(&format!("^({exponent})"))),
                }
            }
            pieces.extend(parenthesised.then(|| text(")")));
        }
        Node::Power { base, exponent } => pieces.extend([
            text("("),
            tight(base),
            text("^"),
            tight(exponent),
            text(")"),
        ]),
        Node::Call {
            function,
            arguments,
        } => {
            pieces.push(text(&format!("{function}(")));
            for (at, argument) in arguments.iter().enumerate() {
                pieces.extend((at > 0).then(|| text(", ")));
                pieces.push(whole(argument));
            }
            pieces.push(text(")"));
        }
        Node::Select {
            comparison,
            left,
            right,
            then,
            otherwise,
        } => {
            let sign = format!(" {} ", comparison.symbol());
            pieces.extend([
                text("select("),
                whole(left),
                text(&sign),
                whole(right),
                text(", "),
            ]);
            pieces.extend([whole(then), text(", "), whole(otherwise), text(")")]);
        }
        Node::Loop { range, body } => {
            let header = format!("sum({} in {}..{}, ", range.variable, range.start, range.end);
            pieces.extend([text(&header), whole(body), text(")")]);
        }
    }
    pieces
}

impl fmt::Display for TooLong {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "a sum of {} terms cannot be written out (at most {})",
            self.terms, self.limit
        )
    }
}

impl std::error::Error for TooLong {}
