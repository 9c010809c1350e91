//! Formulas in mathematical notation, for the documentation of a model.

use crate::syntax::ast::{BinaryOperator, Expr, ExprKind};

/// The formulas of a model as the user wrote them: `L = ½ m l² θ̇² + m g l cos θ`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Notation {
    /// One formula a line: `let`s, energy, dissipation, forces, constraints.
    pub formulas: Vec<String>,
}

const GREEK: &[(&str, &str)] = &[
    ("alpha", "α"),
    ("beta", "β"),
    ("gamma", "γ"),
    ("delta", "δ"),
    ("epsilon", "ε"),
    ("zeta", "ζ"),
    ("eta", "η"),
    ("theta", "θ"),
    ("kappa", "κ"),
    ("lambda", "λ"),
    ("mu", "μ"),
    ("nu", "ν"),
    ("xi", "ξ"),
    ("rho", "ρ"),
    ("sigma", "σ"),
    ("tau", "τ"),
    ("phi", "φ"),
    ("chi", "χ"),
    ("psi", "ψ"),
    ("omega", "ω"),
    ("pi", "π"),
];

/// A name as printed in a formula: Greek letters, trailing digits as subscripts.
pub fn symbol(name: &str) -> String {
    let name = name.strip_prefix("r#").unwrap_or(name);
    let stem = name.trim_end_matches(|c: char| c.is_ascii_digit());
    let digits = &name[stem.len()..];
    let greek = GREEK
        .iter()
        .find(|(word, _)| *word == stem)
        .map_or(stem, |(_, letter)| letter);
    if stem.is_empty() {
        name.to_owned()
    } else {
        format!("{greek}{}", shifted(digits, '₀'))
    }
}

/// Digits as sub- or superscripts, which are neither in one block nor in order for 1 to 3.
fn shifted(digits: &str, zero: char) -> String {
    digits
        .chars()
        .map(|digit| match (digit, zero) {
            ('1', '⁰') => '¹',
            ('2', '⁰') => '²',
            ('3', '⁰') => '³',
            _ => digit
                .to_digit(10)
                .and_then(|value| char::from_u32(u32::from(zero) + value))
                .unwrap_or(digit),
        })
        .collect()
}

/// How strongly the parts of a printed formula are bound together.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Tight {
    Sum,
    /// A product with a leading minus: it may begin a product, but not follow another factor.
    Signed,
    Product,
    Atom,
}

/// An expression in mathematical notation.
pub fn formula(expr: &Expr) -> String {
    printed(expr).0
}

fn at_least(expr: &Expr, tight: Tight) -> String {
    let (text, own) = printed(expr);
    if own < tight {
        format!("({text})")
    } else {
        text
    }
}

fn printed(expr: &Expr) -> (String, Tight) {
    match &expr.node {
        ExprKind::Number(text) => (text.clone(), Tight::Atom),
        ExprKind::Name(name) => (symbol(name), Tight::Atom),
        ExprKind::Index { value, index } => (
            format!("{}[{}]", at_least(value, Tight::Atom), formula(index)),
            Tight::Atom,
        ),
        ExprKind::Negate(value) => (
            format!("−{}", at_least(value, Tight::Product)),
            Tight::Signed,
        ),
        ExprKind::Binary { .. } => chain(expr),
        ExprKind::Call {
            function,
            arguments,
        } => called(&function.node, arguments),
        ExprKind::Select {
            comparison,
            left,
            right,
            then,
            otherwise,
        } => {
            let sign = comparison.symbol();
            let (left, right) = (formula(left), formula(right));
            let (then, otherwise) = (formula(then), formula(otherwise));
            (
                format!("({then} if {left} {sign} {right} else {otherwise})"),
                Tight::Atom,
            )
        }
        ExprKind::Sum { range, body } => {
            let (start, end) = (formula(&range.start), formula(&range.end));
            let body = at_least(body, Tight::Product);
            (
                format!(
                    "Σ_{{{} = {start}..{end}}} {body}",
                    symbol(&range.variable.node)
                ),
                Tight::Sum,
            )
        }
        ExprKind::Vector(components) => {
            let components: Vec<String> = components.iter().map(formula).collect();
            (format!("[{}]", components.join(", ")), Tight::Atom)
        }
        ExprKind::Error => ("…".into(), Tight::Atom),
    }
}

/// `a + b - c …`, from the left without recursion along the chain.
fn chain(expr: &Expr) -> (String, Tight) {
    let mut steps = Vec::new();
    let mut first = expr;
    while let ExprKind::Binary {
        operator,
        left,
        right,
    } = &first.node
    {
        steps.push((*operator, left.as_ref(), right.as_ref()));
        first = left;
    }
    let (mut text, mut own) = printed(first);
    for (operator, left, right) in steps.into_iter().rev() {
        let bracketed = |text: String, own, tight| {
            if own < tight {
                format!("({text})")
            } else {
                text
            }
        };
        (text, own) = match operator {
            BinaryOperator::Add => {
                let right = match printed(right) {
                    (text, Tight::Signed) => format!("({text})"),
                    (text, _) => text,
                };
                (format!("{text} + {right}"), Tight::Sum)
            }
            BinaryOperator::Subtract => (
                format!("{text} − {}", at_least(right, Tight::Product)),
                Tight::Sum,
            ),
            BinaryOperator::Multiply => {
                let right_text = at_least(right, Tight::Product);
                let left = closed(bracketed(text, own, Tight::Signed), left);
                // Two numbers side by side would read as one.
                let digit = |c: char| c.is_ascii_digit();
                let digits = right_text.starts_with(digit)
                    || (right_text.starts_with('½') && left.ends_with(digit));
                let product = format!("{left}{}{right_text}", if digits { "·" } else { " " });
                (
                    product,
                    if own == Tight::Signed {
                        own
                    } else {
                        Tight::Product
                    },
                )
            }
            BinaryOperator::Divide => match (&left.node, &right.node) {
                (ExprKind::Number(one), ExprKind::Number(two)) if one == "1" && two == "2" => {
                    ("½".into(), Tight::Product)
                }
                // `½ 3 x` would read as 3½ x.
                (_, ExprKind::Number(two)) if two == "2" && !text.starts_with(char::is_numeric) => {
                    (
                        format!("½ {}", bracketed(text, own, Tight::Product)),
                        Tight::Product,
                    )
                }
                _ => {
                    let left = closed(bracketed(text, own, Tight::Signed), left);
                    let quotient = format!("{left}/{}", at_least(right, Tight::Atom));
                    (
                        quotient,
                        if own == Tight::Signed {
                            own
                        } else {
                            Tight::Product
                        },
                    )
                }
            },
            BinaryOperator::Power => {
                let left = if is_call(left) || is_power(left) || own < Tight::Atom {
                    format!("({text})")
                } else {
                    text
                };
                let exponent = match &right.node {
                    ExprKind::Number(digits) if digits.bytes().all(|b| b.is_ascii_digit()) => {
                        shifted(digits, '⁰')
                    }
                    _ => format!("^{}", at_least(right, Tight::Atom)),
                };
                (format!("{left}{exponent}"), Tight::Atom)
            }
        };
    }
    (text, own)
}

/// `sin θ` before another factor would be read as the sine of both: `sin(θ) x`.
fn closed(text: String, expr: &Expr) -> String {
    let Some((function, argument)) = last_call(expr) else {
        return text;
    };
    let argument = formula(argument);
    match text.strip_suffix(&format!("{function} {argument}")) {
        Some(front) => format!("{front}{function}({argument})"),
        None => text,
    }
}

/// The function and its argument with which the text of a product ends, where it is written without brackets.
fn last_call(expr: &Expr) -> Option<(&str, &Expr)> {
    let mut last = expr;
    loop {
        last = match &last.node {
            ExprKind::Negate(value) => value.as_ref(),
            ExprKind::Binary {
                operator: BinaryOperator::Multiply,
                right,
                ..
            } => right.as_ref(),
            // ½ stands in front.
            ExprKind::Binary {
                operator: BinaryOperator::Divide,
                left,
                ..
            } => left.as_ref(),
            ExprKind::Call {
                function,
                arguments,
            } => {
                return match &arguments[..] {
                    [argument] => Some((function.node.as_str(), argument)),
                    _ => None,
                };
            }
            _ => return None,
        };
    }
}

/// `cos θ` next to an exponent would be read as `cos(θ²)`.
fn is_call(expr: &Expr) -> bool {
    matches!(&expr.node, ExprKind::Call { function, .. } if function.node != "dot")
}

/// `x²` next to an exponent would be read as `x^(23)`.
fn is_power(expr: &Expr) -> bool {
    matches!(
        &expr.node,
        ExprKind::Binary {
            operator: BinaryOperator::Power,
            ..
        }
    )
}

fn called(function: &str, arguments: &[Expr]) -> (String, Tight) {
    match (function, arguments) {
        ("dot", [argument]) => rate(argument),
        ("norm", [argument]) => (format!("|{}|", formula(argument)), Tight::Atom),
        ("abs", [argument]) => (format!("|{}|", formula(argument)), Tight::Atom),
        ("inner", [a, b]) => (format!("⟨{}, {}⟩", formula(a), formula(b)), Tight::Atom),
        ("cross", [a, b]) => {
            let (a, b) = (at_least(a, Tight::Atom), at_least(b, Tight::Atom));
            (format!("({a} × {b})"), Tight::Atom)
        }
        (_, [argument]) if matches!(argument.node, ExprKind::Name(_)) => {
            (format!("{function} {}", formula(argument)), Tight::Product)
        }
        _ => {
            let arguments: Vec<String> = arguments.iter().map(formula).collect();
            (format!("{function}({})", arguments.join(", ")), Tight::Atom)
        }
    }
}

/// A dot above a letter or an element of an array of that letter; `d/dt` before all else, whose square is not that of the argument.
fn rate(argument: &Expr) -> (String, Tight) {
    let dotted = match &argument.node {
        ExprKind::Name(name) => dotted(name),
        ExprKind::Index { value, index } => match &value.node {
            ExprKind::Name(name) => dotted(name).map(|name| format!("{name}[{}]", formula(index))),
            _ => None,
        },
        _ => None,
    };
    match dotted {
        Some(dotted) => (dotted, Tight::Atom),
        None => (format!("d/dt({})", formula(argument)), Tight::Product),
    }
}

/// A coordinate or momentum by the name of [`names`](crate::model::declared::names): `θ₁`, `q[2]`.
///
/// ```
/// use tfe_symbolic::model::notation::{element, rate_of};
///
/// assert_eq!([element("theta1"), element("phi[2]")], ["θ₁", "φ[2]"]);
/// assert_eq!([rate_of("theta1"), rate_of("phi[2]"), rate_of("tip")], ["θ̇₁", "φ̇[2]", "d/dt(tip)"]);
/// ```
pub fn element(name: &str) -> String {
    let (array, index) = name.split_at(name.find('[').unwrap_or(name.len()));
    format!("{}{index}", symbol(array))
}

/// The rate of such a coordinate: `θ̇₁`, `q̇[2]`; `d/dt(tip)` of longer names.
pub fn rate_of(name: &str) -> String {
    let (array, index) = name.split_at(name.find('[').unwrap_or(name.len()));
    dotted(array).map_or_else(
        || format!("d/dt({})", element(name)),
        |letter| format!("{letter}{index}"),
    )
}

/// A dot above the letter of a one-letter symbol.
fn dotted(name: &str) -> Option<String> {
    let symbol = symbol(name);
    let mut letters = symbol.chars();
    let letter = letters.next()?;
    let rest = letters.as_str();
    let subscript = |c: char| ('₀'..='₉').contains(&c);
    rest.chars()
        .all(subscript)
        .then(|| format!("{letter}\u{307}{rest}"))
}
