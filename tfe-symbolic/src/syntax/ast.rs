//! The syntax tree of one `#[dynamics(...)]` attribute: what the user wrote, and nothing else.

use crate::diagnostic::span::Span;
use crate::expr::comparison::Comparison;
use crate::vocabulary::Argument;

/// A piece of syntax with the range of attribute text it came from.
#[derive(Clone, Debug, PartialEq)]
pub struct Spanned<T> {
    /// The piece of syntax.
    pub node: T,
    /// Where it stands in the attribute's text.
    pub span: Span,
}

impl<T> Spanned<T> {
    /// Attaches `span` to `node`.
    pub fn new(node: T, span: Span) -> Self {
        Self { node, span }
    }
}

/// A name with its place.
pub type Name = Spanned<String>;

/// An expression with its place.
pub type Expr = Spanned<ExprKind>;

/// One argument of the attribute.
#[derive(Clone, Debug, PartialEq)]
pub enum Item {
    /// `coordinates(a, q[3], r[n])`
    Coordinates(Vec<Array>),
    /// `momenta(pa, p[3])`
    Momenta(Vec<Array>),
    /// `input(u, w)`: numbers given at run time
    Input(Vec<Name>),
    /// `let name = value`
    Let {
        /// The name bound.
        name: Name,
        /// Its meaning.
        value: Expr,
    },
    /// `lagrangian = value`
    Lagrangian(Expr),
    /// `hamiltonian = value`
    Hamiltonian(Expr),
    /// `force(target) = value`; the target is `a` or `q[i]`
    Force {
        /// The coordinate that the force acts on.
        target: Expr,
        /// The generalized force.
        value: Expr,
    },
    /// `dissipation = value`
    Dissipation(Expr),
    /// `time_transformation = rate`: dt = rate dτ
    TimeTransformation(Expr),
    /// `constraint(name) = value` or `constraint(name[i in a..b]) = value`
    Constraint {
        /// The name of the constraint.
        name: Name,
        /// The range of a family of constraints.
        range: Option<Range>,
        /// The expression that vanishes.
        value: Expr,
    },
    /// `output(name) = value` or `output(name[i in a..b]) = value`; `event` for `output` means the same
    Output {
        /// The name of the observable.
        name: Name,
        /// The range of a family of observables.
        range: Option<Range>,
        /// The observable.
        value: Expr,
    },
    /// `sensitivity(a, k[2])`: the parameters by which derivatives are wanted
    Sensitivity(Vec<Expr>),
    /// `solver(Name, Mixed::<4>)`, with an optional `.reduced()`, `.lobatto()`, `.quadrature(k)`
    Solver {
        /// The name of the emitted struct.
        name: Name,
        /// The element it is specialised for.
        element: Spanned<ElementSyntax>,
    },
    /// `model(Name, truncated(2), frozen(r = l))`: another model, made from this one
    Model {
        /// The name of the emitted struct.
        name: Name,
        /// What is done to the model, from left to right.
        passes: Vec<Pass>,
    },
    /// `crate = path`: where the emitted code finds `tfe` (for renamed dependencies)
    Crate(Spanned<String>),
}

impl Item {
    /// Which argument it is.
    pub fn argument(&self) -> Argument {
        match self {
            Self::Coordinates(_) => Argument::Coordinates,
            Self::Momenta(_) => Argument::Momenta,
            Self::Input(_) => Argument::Input,
            Self::Let { .. } => Argument::Let,
            Self::Lagrangian(_) => Argument::Lagrangian,
            Self::Hamiltonian(_) => Argument::Hamiltonian,
            Self::Force { .. } => Argument::Force,
            Self::Dissipation(_) => Argument::Dissipation,
            Self::TimeTransformation(_) => Argument::TimeTransformation,
            Self::Constraint { .. } => Argument::Constraint,
            Self::Output { .. } => Argument::Output,
            Self::Sensitivity(_) => Argument::Sensitivity,
            Self::Solver { .. } => Argument::Solver,
            Self::Model { .. } => Argument::Model,
            Self::Crate(_) => Argument::Crate,
        }
    }
}

/// `a` or `q[N]` in a list of coordinates or momenta.
#[derive(Clone, Debug, PartialEq)]
pub struct Array {
    /// The name.
    pub name: Name,
    /// The length between the brackets: a literal, or a name (const parameter or field).
    pub length: Option<Expr>,
}

/// `i in start..end`
#[derive(Clone, Debug, PartialEq)]
pub struct Range {
    /// The index.
    pub variable: Name,
    /// The first value.
    pub start: Box<Expr>,
    /// One past the last value.
    pub end: Box<Expr>,
}

/// `Mixed::<4>.quadrature(5)`
#[derive(Clone, Debug, PartialEq)]
pub struct ElementSyntax {
    /// `Primal`, `Mixed`, `EnergyConserving`, `Radau`.
    pub family: Name,
    /// The number of nodes.
    pub nodes: Spanned<u64>,
    /// `reduced`, `lobatto` or `quadrature` with its argument.
    pub rule: Option<(Name, Option<Spanned<u64>>)>,
}

/// `truncated(2, x = 1)`
#[derive(Clone, Debug, PartialEq)]
pub struct Pass {
    /// `truncated`, `frozen`, `rigid`, `elastic`.
    pub word: Name,
    /// What stands between the parentheses.
    pub entries: Vec<Entry>,
}

/// `value` or `target = value`
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// `x`, `q[2]`, `dot(x)`
    pub target: Option<Expr>,
    /// A formula or a name.
    pub value: Expr,
}

/// The kinds of expression.
#[derive(Clone, Debug, PartialEq)]
pub enum ExprKind {
    /// A number as written (`1`, `0.5`, `1e-3`).
    Number(String),
    /// A name: coordinate, parameter, `let`, index, `t`, `pi`.
    Name(String),
    /// `value[index]`
    Index {
        /// The array or vector.
        value: Box<Expr>,
        /// The index.
        index: Box<Expr>,
    },
    /// `-value`
    Negate(Box<Expr>),
    /// `left operator right`
    Binary {
        /// The operator.
        operator: BinaryOperator,
        /// The left operand.
        left: Box<Expr>,
        /// The right operand.
        right: Box<Expr>,
    },
    /// `function(arguments)`, `dot(e)`, `inner(a, b)` and the like.
    Call {
        /// The name of the function.
        function: Name,
        /// Its arguments.
        arguments: Vec<Expr>,
    },
    /// `select(left comparison right, then, otherwise)`
    Select {
        /// The comparison.
        comparison: Comparison,
        /// Left of it.
        left: Box<Expr>,
        /// Right of it.
        right: Box<Expr>,
        /// The value where it holds.
        then: Box<Expr>,
        /// The value elsewhere.
        otherwise: Box<Expr>,
    },
    /// `sum(i in a..b, body)`
    Sum {
        /// The index and its range.
        range: Range,
        /// The summand.
        body: Box<Expr>,
    },
    /// `[a, b, c]`
    Vector(Vec<Expr>),
    /// A placeholder after a mistake that has been reported.
    Error,
}

/// `+ - * / ^`
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum BinaryOperator {
    /// `+`
    Add,
    /// `-`
    Subtract,
    /// `*`
    Multiply,
    /// `/`
    Divide,
    /// `^`
    Power,
}

impl Spanned<ExprKind> {
    /// The expressions that this one is made of, in the order of the text.
    pub fn children(&self) -> Vec<&Self> {
        match &self.node {
            ExprKind::Number(_) | ExprKind::Name(_) | ExprKind::Error => Vec::new(),
            ExprKind::Index { value, index } => vec![value, index],
            ExprKind::Negate(value) => vec![value],
            ExprKind::Binary { left, right, .. } => vec![left, right],
            ExprKind::Call { arguments, .. } => arguments.iter().collect(),
            ExprKind::Select {
                left,
                right,
                then,
                otherwise,
                ..
            } => {
                vec![left, right, then, otherwise]
            }
            ExprKind::Sum { range, body } => vec![&range.start, &range.end, body],
            ExprKind::Vector(components) => components.iter().collect(),
        }
    }
}
