//! The parser: precedence, blanks, round trip through print, and texts that would exhaust the stack.

use proptest::prelude::*;
use tfe_symbolic::compile::declare;
use tfe_symbolic::diagnostic::{Bag, Span};
use tfe_symbolic::expr::comparison::Comparison;
use tfe_symbolic::model::notation::formula;
use tfe_symbolic::syntax::ast::{
    BinaryOperator, ElementSyntax, Entry, Expr, ExprKind, Item, Pass, Range, Spanned,
};
use tfe_symbolic::syntax::context::Context;
use tfe_symbolic::syntax::parse::{
    MAX_NESTING, MAX_OPERATORS, parse_expression, parse_item, split_arguments,
};

/// With all operators in brackets, to show the tree.
fn bracketed(expr: &Expr) -> String {
    match &expr.node {
        ExprKind::Negate(value) => format!("(-{})", bracketed(value)),
        ExprKind::Binary {
            operator,
            left,
            right,
        } => {
            format!(
                "({}{}{})",
                bracketed(left),
                operator.symbol(),
                bracketed(right)
            )
        }
        ExprKind::Index { value, index } => format!("{}[{}]", bracketed(value), bracketed(index)),
        _ => expr.to_string(),
    }
}

fn parsed(text: &str) -> Expr {
    let mut bag = Bag::new();
    let expr = parse_expression(text, &mut bag);
    let expr = bag
        .finish(expr)
        .unwrap_or_else(|mistakes| panic!("{text}: {mistakes:?}"));
    expr.expect("an expression without mistakes")
}

#[track_caller]
fn check(text: &str, tree: &str) {
    assert_eq!(bracketed(&parsed(text)), tree);
}

#[test]
fn precedence() {
    check("a + b*c", "(a+(b*c))");
    check("a - b - c", "((a-b)-c)");
    check("a/b/c", "((a/b)/c)");
    check("a/b*c", "((a/b)*c)");
    check("-x^2", "(-(x^2))");
    check("-x*y", "((-x)*y)");
    check("2*-x", "(2*(-x))");
    check("2*-x + y", "((2*(-x))+y)");
    check("x^-2", "(x^(-2))");
    check("x^-2*y", "((x^(-2))*y)");
    check("a^b^c", "(a^(b^c))");
    check("a^-b^c", "(a^(-(b^c)))");
    check("(a + b)^2", "((a+b)^2)");
    check("x[1]^2", "(x[1]^2)");
    check("-x[i+1]", "(-x[(i+1)])");
    check("a - -b", "(a-(-b))");
}

#[test]
fn formulas_are_written_as_they_are_meant() {
    for (text, expected) in [
        ("(x^2)^3", "(x²)³"),
        ("(x^n)^2", "(x^n)²"),
        ("((x + 1)^2)^n", "((x + 1)²)^n"),
        ("x^n^2", "x^n²"),
        ("sin(x)^2", "(sin x)²"),
        ("3*(1/2)", "3·½"),
        ("x*(1/2)*y", "x ½ y"),
        ("sin(x)*y", "sin(x) y"),
        ("m*exp(t)*y*cos(x)", "m exp(t) y cos x"),
        ("m*(g*sin(x))*y", "m g sin(x) y"),
        ("-sin(x)*y", "−sin(x) y"),
        ("sin(x)/x", "sin(x)/x"),
        ("sin(x)/2*y", "½ sin(x) y"),
        ("sin(x) + y", "sin x + y"),
        ("dot(speed)^2", "(d/dt(speed))²"),
        ("x/dot(speed)", "x/(d/dt(speed))"),
        ("dot(x)^2*dot(speed)", "x\u{307}² d/dt(speed)"),
        ("3/2*k*x^2", "3/2 k x²"),
        ("2*sin(x)/2", "2 sin(x)/2"),
        ("x/2/2", "½ x/2"),
        ("x/2*y", "½ x y"),
    ] {
        assert_eq!(formula(&parsed(text)), expected);
    }
}

#[test]
fn numbers_and_ranges_share_the_point() {
    check("1.*x", "(1.*x)");
    check("1e-3 - 2.5E+2", "(1e-3-2.5E+2)");
    check("1_000", "1_000");
    assert_eq!(
        parsed("sum(i in 0..3, q[i])").to_string(),
        "sum(i in 0..3, q[i])"
    );
    assert_eq!(
        parsed("sum(i in 1 .. n-1, 2.)").to_string(),
        "sum(i in 1..n - 1, 2.)"
    );
}

#[test]
fn words_of_the_language_may_begin_other_names() {
    check(
        "summary + index + letter + selected",
        "(((summary+index)+letter)+selected)",
    );
}

#[test]
fn spans_are_those_of_the_attribute() {
    let text = "coordinates(θ), lagrangian = dot(θ)^2 - (a + b)";
    let ranges = split_arguments(text);
    let mut bag = Bag::new();
    let item = parse_item(&text[ranges[1].clone()], ranges[1].start, &mut bag);
    let item = bag.finish(item).expect("no mistakes").expect("an item");
    let Item::Lagrangian(value) = item.node else {
        panic!("{item:?}")
    };
    let ExprKind::Binary { right, .. } = &value.node else {
        panic!("{value:?}")
    };
    assert_eq!(&text[right.span.start..right.span.end], "(a + b)");
}

#[test]
fn arguments_split_at_top_level_commas() {
    let text = "coordinates(a, b), let x = [1, 2][0], output(y) = f(x, {1, 2}),\n";
    let parts: Vec<_> = split_arguments(text)
        .into_iter()
        .map(|range| text[range].trim())
        .collect();
    assert_eq!(
        parts,
        [
            "coordinates(a, b)",
            "let x = [1, 2][0]",
            "output(y) = f(x, {1, 2})"
        ]
    );
    assert!(split_arguments(" \n ").is_empty());
    assert_eq!(split_arguments(")],a"), [0..2, 3..4]);
}

/// Whatever the user writes, the answer is a result: neither a panic nor an exhausted stack.
fn survives(text: &str) {
    let context = Context::default();
    let _ = declare(&format!("coordinates(x), lagrangian = {text}"), &context);
    let _ = declare(text, &context);
}

#[test]
fn deep_and_long_texts_do_not_exhaust_the_stack() {
    // Test threads have 2 MiB, less than the compiler gives a macro.
    let deep = MAX_NESTING - 2;
    let long = MAX_OPERATORS - 2;
    let cases = [
        format!("{}x{}", "(".repeat(deep), ")".repeat(deep)),
        format!("{}x{}", "sin(".repeat(deep), ")".repeat(deep)),
        format!("{}x{}", "[".repeat(deep), "]".repeat(deep)),
        format!("{}x", "-".repeat(deep)),
        format!("x{}", "^x".repeat(deep)),
        format!("x{}", "+x".repeat(long)),
        format!("x{}", "*x".repeat(long)),
        format!("{}x{}", "sum(i in 0..2,".repeat(deep), ")".repeat(deep)),
        format!("{}x{}", "select(x < 1, 0, ".repeat(deep), ")".repeat(deep)),
        format!("{}x{}", "(x+".repeat(deep), ")".repeat(deep)),
    ];
    for case in &cases {
        survives(case);
    }
    for piece in [
        "(",
        "[",
        "sin(",
        "-",
        "x^",
        "x+",
        "sum(i in 0..2,",
        "x[",
        "2 ",
        "x(",
        ")",
        "]",
        "x ",
        "1.x ",
        "[0]",
        "(x)",
    ] {
        survives(&piece.repeat(20_000));
    }
}

#[test]
fn mistakes_deep_inside_are_found_in_linear_time() {
    // Backtracking over alternatives would double the work at each level.
    for piece in [
        "f(",
        "(",
        "sum(i in 0..2, ",
        "select(x < 1, 0, ",
        "x[",
        "[",
        "2*f(-(",
    ] {
        survives(&format!("{}x y ] ?", piece.repeat(MAX_NESTING / 3)));
    }
}

fn spanned<T>(node: T) -> Spanned<T> {
    Spanned::new(node, Span::default())
}

fn boxed(expr: Expr) -> Box<Expr> {
    Box::new(expr)
}

fn name() -> impl Strategy<Value = String> {
    prop::sample::select(vec![
        "x", "theta1", "θ", "summ", "in_", "lets", "r#type", "_a", "ℓ₀x",
    ])
    .prop_map(|name| name.replace('₀', "0"))
}

fn range(expr: impl Strategy<Value = Expr> + Clone) -> impl Strategy<Value = Range> {
    (name(), expr.clone(), expr).prop_map(|(variable, start, end)| Range {
        variable: spanned(variable),
        start: boxed(start),
        end: boxed(end),
    })
}

fn expression() -> impl Strategy<Value = Expr> {
    let number = prop::sample::select(vec!["0", "1", "12", "0.5", "3.", "1e-3", "2.5e10", "1_000"]);
    let leaf = prop_oneof![
        number.prop_map(|text| spanned(ExprKind::Number(text.into()))),
        name().prop_map(|name| spanned(ExprKind::Name(name))),
    ];
    leaf.prop_recursive(6, 60, 3, |inner| {
        let operators = vec![
            BinaryOperator::Add,
            BinaryOperator::Subtract,
            BinaryOperator::Multiply,
            BinaryOperator::Divide,
            BinaryOperator::Power,
        ];
        let comparisons = vec![
            Comparison::Less,
            Comparison::LessOrEqual,
            Comparison::Greater,
            Comparison::GreaterOrEqual,
        ];
        let list = prop::collection::vec(inner.clone(), 0..3);
        prop_oneof![
            (
                prop::sample::select(operators),
                inner.clone(),
                inner.clone()
            )
                .prop_map(|(operator, left, right)| {
                    let (left, right) = (boxed(left), boxed(right));
                    spanned(ExprKind::Binary {
                        operator,
                        left,
                        right,
                    })
                }),
            inner
                .clone()
                .prop_map(|value| spanned(ExprKind::Negate(boxed(value)))),
            (inner.clone(), inner.clone()).prop_map(|(value, index)| {
                spanned(ExprKind::Index {
                    value: boxed(value),
                    index: boxed(index),
                })
            }),
            (name(), list.clone()).prop_map(|(function, arguments)| {
                spanned(ExprKind::Call {
                    function: spanned(function),
                    arguments,
                })
            }),
            list.prop_map(|components| spanned(ExprKind::Vector(components))),
            (range(inner.clone()), inner.clone()).prop_map(|(range, body)| {
                spanned(ExprKind::Sum {
                    range,
                    body: boxed(body),
                })
            }),
            (
                prop::sample::select(comparisons),
                [inner.clone(), inner.clone(), inner.clone(), inner]
            )
                .prop_map(|(comparison, [left, right, then, otherwise])| {
                    spanned(ExprKind::Select {
                        comparison,
                        left: boxed(left),
                        right: boxed(right),
                        then: boxed(then),
                        otherwise: boxed(otherwise),
                    })
                }),
        ]
    })
}

fn item() -> impl Strategy<Value = Item> {
    let expr = || expression().boxed();
    let ranges = || prop::option::of(range(expr()));
    let rule = prop::option::of((name(), prop::option::of(0..100u64)))
        .prop_map(|rule| rule.map(|(name, argument)| (spanned(name), argument.map(spanned))));
    let entry = (prop::option::of(expr()), expr());
    let entry = entry.prop_map(|(target, value)| Entry { target, value });
    let pass = (name(), prop::collection::vec(entry, 0..3)).prop_map(|(word, entries)| Pass {
        word: spanned(word),
        entries,
    });
    prop_oneof![
        (name(), prop::collection::vec(pass, 0..3)).prop_map(|(name, passes)| Item::Model {
            name: spanned(name),
            passes,
        }),
        expr().prop_map(Item::Lagrangian),
        expr().prop_map(Item::Hamiltonian),
        expr().prop_map(Item::Dissipation),
        expr().prop_map(Item::TimeTransformation),
        (name(), expr()).prop_map(|(name, value)| Item::Let {
            name: spanned(name),
            value
        }),
        prop::collection::vec(expr(), 0..4).prop_map(Item::Sensitivity),
        (expr(), expr()).prop_map(|(target, value)| Item::Force { target, value }),
        (name(), ranges(), expr()).prop_map(|(name, range, value)| Item::Constraint {
            name: spanned(name),
            range,
            value
        }),
        (name(), ranges(), expr()).prop_map(|(name, range, value)| Item::Output {
            name: spanned(name),
            range,
            value
        }),
        (name(), name(), any::<u64>(), rule).prop_map(|(name, family, nodes, rule)| {
            let element = ElementSyntax {
                family: spanned(family),
                nodes: spanned(nodes),
                rule,
            };
            Item::Solver {
                name: spanned(name),
                element: spanned(element),
            }
        }),
    ]
}

proptest! {
    /// print ∘ parse ∘ print = print, and the printed text is bracketed like the tree: what is
    /// parsed from it has the same shape as what was printed, places aside.
    #[test]
    fn printed_expressions_parse_to_themselves(expr in expression()) {
        let text = expr.to_string();
        let again = parsed(&text);
        prop_assert_eq!(bracketed(&again), bracketed(&expr));
        prop_assert_eq!(without_places(&format!("{again:?}")), without_places(&format!("{expr:?}")));
    }

    #[test]
    fn printed_arguments_parse_to_themselves(item in item()) {
        let text = item.to_string();
        let mut bag = Bag::new();
        let again = parse_item(&text, 0, &mut bag);
        let again = bag.finish(again).map_err(|mistakes| TestCaseError::fail(format!("{text}: {mistakes:?}")))?;
        let again = again.expect("an item without mistakes");
        prop_assert_eq!(without_places(&format!("{:?}", again.node)), without_places(&format!("{item:?}")));
    }

    #[test]
    fn no_text_panics(text in "[-a-c0-3+*/^()\\[\\],.<>=:_ θsuminletdot]{0,60}") {
        survives(&text);
    }
}

/// The debug text of a tree without its spans.
fn without_places(debug: &str) -> String {
    let mut out = String::new();
    let mut rest = debug;
    while let Some(at) = rest.find("Span { start: ") {
        out.push_str(&rest[..at]);
        rest = &rest[at..];
        let end = rest.find('}').map_or(rest.len(), |end| end + 1);
        rest = &rest[end..];
    }
    out + rest
}
