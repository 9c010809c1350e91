//! Derivatives of random expressions: against hyper-dual numbers, and by the laws that derivatives obey.

use num_dual::{DualNum, HyperDual64};
use proptest::prelude::*;
use tfe_symbolic::compile::declare;
use tfe_symbolic::derive::derivation::{Derivation, Model};
use tfe_symbolic::expr::differentiate::derivative;
use tfe_symbolic::expr::function::Function;
use tfe_symbolic::expr::graph::{ExprId, Graph};
use tfe_symbolic::expr::input::{Affine, Input};
use tfe_symbolic::model::declared::{Force, Form, Observable, Parameter};
use tfe_symbolic::program::interpret::{Environment, Results, interpret};
use tfe_symbolic::program::{By, Request};
use tfe_symbolic::syntax::context::{Context, Field, FieldKind};

const ALL: Request = Request {
    value: true,
    first: true,
    mass: true,
    second: true,
    observables: true,
    constraint_values: false,
    constraint_rows: false,
    constraint_second: false,
};

/// A random expression in q0, q1, v0, v1.
#[derive(Clone, Debug)]
enum Tree {
    Leaf(usize),
    Number(i64),
    Add(Box<Tree>, Box<Tree>),
    Subtract(Box<Tree>, Box<Tree>),
    Multiply(Box<Tree>, Box<Tree>),
    Divide(Box<Tree>, Box<Tree>),
    Power(Box<Tree>, i32),
    Call(Function, Box<Tree>),
}

impl Tree {
    fn build(&self, graph: &mut Graph) -> ExprId {
        self.build_on(graph, leaf)
    }

    /// The expression with other leaves.
    fn build_on(&self, graph: &mut Graph, leaf: fn(usize) -> Input) -> ExprId {
        let pair = |graph: &mut Graph, a: &Self, b: &Self| {
            (a.build_on(graph, leaf), b.build_on(graph, leaf))
        };
        match self {
            Self::Leaf(at) => graph.input(leaf(*at)),
            Self::Number(value) => graph.integer(*value),
            Self::Add(a, b) => {
                let (a, b) = pair(graph, a, b);
                graph.add(a, b)
            }
            Self::Subtract(a, b) => {
                let (a, b) = pair(graph, a, b);
                graph.subtract(a, b)
            }
            Self::Multiply(a, b) => {
                let (a, b) = pair(graph, a, b);
                graph.multiply(a, b)
            }
            Self::Divide(a, b) => {
                // 3 + b² keeps quotients away from their poles.
                let (a, b) = pair(graph, a, b);
                let (three, square) = (graph.integer(3), graph.multiply(b, b));
                let below = graph.add(three, square);
                graph.divide(a, below)
            }
            Self::Power(a, n) => {
                let (base, exponent) = (a.build_on(graph, leaf), graph.integer(i64::from(*n)));
                graph.power(base, exponent)
            }
            Self::Call(function, a) => {
                let a = a.build_on(graph, leaf);
                let a = self.guard(graph, a, *function);
                graph.call(*function, &[a])
            }
        }
    }

    /// Keeps arguments inside of the domain: 2 + a² for logarithms and roots, sin a for large growth.
    fn guard(&self, graph: &mut Graph, a: ExprId, function: Function) -> ExprId {
        match function {
            Function::Ln | Function::Sqrt | Function::Acosh => {
                let (two, square) = (graph.integer(2), graph.multiply(a, a));
                graph.add(two, square)
            }
            Function::Asin | Function::Acos | Function::Atanh => {
                let (two, sine) = (graph.integer(2), graph.call(Function::Sin, &[a]));
                graph.divide(sine, two)
            }
            Function::Exp | Function::Sinh | Function::Cosh | Function::Tan => {
                graph.call(Function::Sin, &[a])
            }
            _ => a,
        }
    }

    fn dual(&self, x: &[HyperDual64; 4]) -> HyperDual64 {
        match self {
            Self::Leaf(at) => x[*at],
            Self::Number(value) => HyperDual64::from_re(*value as f64),
            Self::Add(a, b) => a.dual(x) + b.dual(x),
            Self::Subtract(a, b) => a.dual(x) - b.dual(x),
            Self::Multiply(a, b) => a.dual(x) * b.dual(x),
            Self::Divide(a, b) => {
                let b = b.dual(x);
                a.dual(x) / (b * b + 3.0)
            }
            Self::Power(a, n) => a.dual(x).powi(*n),
            Self::Call(function, a) => {
                let a = a.dual(x);
                match function {
                    Function::Sin => a.sin(),
                    Function::Cos => a.cos(),
                    Function::Atan => a.atan(),
                    Function::Tanh => a.tanh(),
                    Function::Asinh => a.asinh(),
                    Function::Tan => a.sin().tan(),
                    Function::Exp => a.sin().exp(),
                    Function::Sinh => a.sin().sinh(),
                    Function::Cosh => a.sin().cosh(),
                    Function::Ln => (a * a + 2.0).ln(),
                    Function::Sqrt => (a * a + 2.0).sqrt(),
                    Function::Acosh => (a * a + 2.0).acosh(),
                    Function::Asin => (a.sin() / 2.0).asin(),
                    Function::Acos => (a.sin() / 2.0).acos(),
                    Function::Atanh => (a.sin() / 2.0).atanh(),
                    function => unreachable!("{function} is not generated"),
                }
            }
        }
    }
}

fn leaf(at: usize) -> Input {
    let index = Affine::constant((at % 2) as i64);
    if at < 2 {
        Input::Coordinate(index)
    } else {
        Input::Velocity(index)
    }
}

fn trees() -> impl Strategy<Value = Tree> {
    let unary = prop::sample::select(vec![
        Function::Sin,
        Function::Cos,
        Function::Atan,
        Function::Tanh,
        Function::Asinh,
        Function::Tan,
        Function::Exp,
        Function::Sinh,
        Function::Cosh,
        Function::Ln,
        Function::Sqrt,
        Function::Acosh,
        Function::Asin,
        Function::Acos,
        Function::Atanh,
    ]);
    let leaf =
        prop_oneof![3 => (0..4usize).prop_map(Tree::Leaf), 1 => (-3..4i64).prop_map(Tree::Number)];
    leaf.prop_recursive(5, 40, 2, move |inner| {
        let two = || {
            (
                inner.clone().prop_map(Box::new),
                inner.clone().prop_map(Box::new),
            )
        };
        prop_oneof![
            3 => two().prop_map(|(a, b)| Tree::Add(a, b)),
            2 => two().prop_map(|(a, b)| Tree::Subtract(a, b)),
            4 => two().prop_map(|(a, b)| Tree::Multiply(a, b)),
            1 => two().prop_map(|(a, b)| Tree::Divide(a, b)),
            1 => (inner.clone().prop_map(Box::new), 2..5i32).prop_map(|(a, n)| Tree::Power(a, n)),
            3 => (unary.clone(), inner.prop_map(Box::new)).prop_map(|(f, a)| Tree::Call(f, a)),
        ]
    })
}

fn model(graph: Graph, energy: ExprId) -> Model {
    Model {
        form: Form::Lagrangian,
        dof: Affine::constant(2),
        graph,
        energy,
        dissipation: None,
        forces: Vec::new(),
        constraints: Vec::new(),
        observables: Vec::new(),
        sensitivities: Vec::new(),
    }
}

/// |a − b| relative to the larger of 1 and their size.
fn distance(a: f64, b: f64) -> f64 {
    (a - b).abs() / 1f64.max(a.abs()).max(b.abs())
}

/// Nested powers and differences of the random expressions lose up to seven of the sixteen digits, in every evaluation.
const DIGITS: f64 = 1e-9;

/// The values of some expressions.
fn evaluate(mut graph: Graph, roots: &[ExprId], x: &[f64; 4]) -> Vec<f64> {
    let energy = graph.integer(0);
    let observable = |(number, root): (usize, &ExprId)| Observable {
        name: String::new(),
        ranges: Vec::new(),
        column: Affine::constant(number as i64),
        value: *root,
    };
    let observables = roots.iter().enumerate().map(observable).collect();
    let derivation = Derivation::of_model(Model {
        observables,
        ..model(graph, energy)
    });
    let environment = Environment {
        q: x[..2].to_vec(),
        z: x[2..].to_vec(),
        ..Environment::default()
    };
    let mut values = interpret(&derivation.program(ALL), &environment)
        .expect("a complete environment")
        .observables;
    // A root that vanishes is not stored.
    values.resize(roots.len(), 0.0);
    values
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn derivatives_agree_with_hyper_dual_numbers(tree in trees(), x in prop::array::uniform4(-1.5..1.5f64)) {
        let mut graph = Graph::default();
        let energy = tree.build(&mut graph);
        let derivation = Derivation::of_model(model(graph, energy));
        let environment = Environment { q: x[..2].to_vec(), z: x[2..].to_vec(), ..Environment::default() };
        let results = interpret(&derivation.program(ALL), &environment).expect("a complete environment");
        let block = |results: &Results, i: usize, j: usize| match (i < 2, j < 2) {
            (true, true) => results.qq[i][j],
            (false, false) => results.zz[i - 2][j - 2],
            (false, true) => results.zq[i - 2][j],
            (true, false) => results.zq[j - 2][i],
        };
        for i in 0..4 {
            for j in 0..4 {
                let mut seeded = x.map(HyperDual64::from_re);
                seeded[i].eps1 = 1.0;
                seeded[j].eps2 = 1.0;
                let dual = tree.dual(&seeded);
                prop_assume!(dual.re.abs() < 1e6 && dual.eps1eps2.abs() < 1e6);
                prop_assert!(distance(results.value, dual.re) < DIGITS);
                let first = if i < 2 { results.q[i] } else { results.z[i - 2] };
                prop_assert!(distance(first, dual.eps1) < DIGITS, "{} {}", first, dual.eps1);
                let second = block(&results, i, j);
                prop_assert!(distance(second, dual.eps1eps2) < DIGITS, "({i},{j}) {} {}", second, dual.eps1eps2);
            }
        }
    }

    /// The second coordinate of the expression is a parameter here, and its second velocity the time.
    #[test]
    fn derivatives_by_a_parameter_and_by_the_time_agree_with_hyper_dual_numbers(
        tree in trees(), x in prop::array::uniform4(-1.5..1.5f64)
    ) {
        let mut graph = Graph::default();
        let energy = tree.build_on(&mut graph, |at| match at {
            1 => Input::Parameter("a".to_owned()),
            3 => Input::Time,
            at => leaf(at),
        });
        let force = Force { ranges: Vec::new(), target: Affine::constant(1), value: energy };
        let derivation = Derivation::of_model(Model {
            forces: vec![force],
            sensitivities: vec![Parameter { field: "a".to_owned(), element: None }],
            ..model(graph, energy)
        });
        let environment = Environment {
            time: x[3],
            q: vec![x[0], 0.0],
            z: vec![x[2], 0.0],
            parameters: [("a".to_owned(), x[1])].into(),
            ..Environment::default()
        };
        for (by, at) in [(By::Parameter(0), 1), (By::Time, 3)] {
            let results = interpret(&derivation.program_by(by), &environment).expect("a complete environment");
            for (first, found) in [(0, results.q[0]), (2, results.z[0])] {
                let mut seeded = x.map(HyperDual64::from_re);
                seeded[first].eps1 = 1.0;
                seeded[at].eps2 = 1.0;
                let dual = tree.dual(&seeded);
                prop_assume!(dual.re.abs() < 1e6 && dual.eps1eps2.abs() < 1e6);
                prop_assert!(distance(found, dual.eps1eps2) < DIGITS, "{by:?} {} {}", found, dual.eps1eps2);
                prop_assert!(distance(results.force[1], dual.eps2) < DIGITS, "{by:?} {} {}", results.force[1], dual.eps2);
            }
        }
    }

    #[test]
    fn mixed_partial_derivatives_commute(tree in trees(), x in prop::array::uniform4(-1.5..1.5f64)) {
        let mut graph = Graph::default();
        let f = tree.build(&mut graph);
        let by_first = derivative(&mut graph, f, &leaf(0));
        let by_second = derivative(&mut graph, f, &leaf(3));
        let (a, b) = (derivative(&mut graph, by_first, &leaf(3)), derivative(&mut graph, by_second, &leaf(0)));
        let values = evaluate(graph, &[a, b], &x);
        prop_assume!(values.iter().all(|value| value.abs() < 1e6));
        prop_assert!(distance(values[0], values[1]) < DIGITS, "{values:?}");
    }

    #[test]
    fn derivatives_are_linear_and_obey_the_product_rule(f in trees(), g in trees(), x in prop::array::uniform4(-1.5..1.5f64)) {
        let mut graph = Graph::default();
        let (f, g) = (f.build(&mut graph), g.build(&mut graph));
        let (two, three) = (graph.integer(2), graph.integer(3));
        let (twice, thrice) = (graph.multiply(two, f), graph.multiply(three, g));
        let (sum, product) = (graph.add(twice, thrice), graph.multiply(f, g));
        let roots = [f, g, sum, product].map(|root| (root, derivative(&mut graph, root, &leaf(1))));
        let [(f, df), (g, dg), (_, dsum), (_, dproduct)] = roots;
        let values = evaluate(graph, &[f, df, g, dg, dsum, dproduct], &x);
        prop_assume!(values.iter().all(|value| value.abs() < 1e6));
        let [f, df, g, dg, dsum, dproduct] = values[..] else { unreachable!("six roots") };
        prop_assert!((dsum - (2.0 * df + 3.0 * dg)).abs() < DIGITS * (1.0 + df.abs() + dg.abs()));
        prop_assert!((dproduct - (df * g + f * dg)).abs() < DIGITS * (1.0 + (df * g).abs() + (f * dg).abs()));
    }
}

#[test]
fn exponents_beyond_32_bits_are_differentiated() {
    let text = "coordinates(x, y), lagrangian = dot(x)^2/2 + dot(y)^2/2 \
        - (x^-2147483648)^2 - (x^2147483647*y)^-1 - sqrt(x)^-2147483648 - ((x + y - 1)^-2147483648)^-1";
    let declared = declare(text, &Context::default()).expect("a model");
    let program = Derivation::of(&declared).program(ALL);
    let x = 1.0 + 1e-10;
    let environment = Environment {
        q: vec![x, 1.0],
        z: vec![0.0; 2],
        ..Environment::default()
    };
    let results = interpret(&program, &environment).expect("a complete environment");
    let n = 2_f64.powi(31);
    let powers = [-2.0 * n, 1.0 - n, -n / 2.0, n].map(|exponent| (exponent, x.powf(exponent)));
    let value: f64 = powers.iter().map(|(_, power)| -power).sum();
    let slope: f64 = powers.iter().map(|(n, power)| -n * power / x).sum();
    // An exponent magnifies the rounding of its base, here that of the input.
    let digits = 4.0 * n * f64::EPSILON;
    assert!((results.value - value).abs() < digits * value.abs());
    assert!((results.q[0] - slope).abs() < digits * slope.abs());
}

/// First derivatives of a potential by the coordinates, at rest.
fn slopes(text: &str, q: &[f64]) -> Vec<f64> {
    let declared = declare(text, &Context::default()).expect("a model");
    let program = Derivation::of(&declared).program(ALL);
    let environment = Environment {
        q: q.to_vec(),
        z: vec![0.0; q.len()],
        ..Environment::default()
    };
    let results = interpret(&program, &environment).expect("a complete environment");
    let second = results.qq.iter().flatten();
    assert!(
        second.clone().all(|x| x.is_finite()),
        "{text}: {:?}",
        results.qq
    );
    results.q
}

/// A term that stands in several of the sums within a denominator.
#[test]
fn terms_in_several_sums_of_a_denominator() {
    let (x, y, z) = (0.3, 0.7, 0.2);
    let u = x + 2.0 * y + z;
    for (energy, expected) in [
        ("y/sqrt((x + y) + (y + z))", (x + y + z) / (u * u.sqrt())),
        ("y/((x + y) + (y + z))", (x + z) / (u * u)),
        (
            "y^2/sqrt((x + y) + (y + z))",
            2.0 * y / u.sqrt() - y * y / (u * u.sqrt()),
        ),
        ("y/sqrt((x + 2*y) + z)", (x + y + z) / (u * u.sqrt())),
    ] {
        let text = format!(
            "coordinates(x, y, z), lagrangian = (dot(x)^2 + dot(y)^2 + dot(z)^2)/2 - {energy}"
        );
        let found = -slopes(&text, &[x, y, z])[1];
        assert!(
            (found - expected).abs() < 1e-14,
            "{energy}: {found}, {expected}"
        );
    }
}

/// Half-integer powers have the derivatives zero where their base is.
#[test]
fn half_integer_powers_at_zero() {
    for (energy, x, expected) in [
        ("2/5*max(-x, 0)^2.5", 1.0, 0.0),
        ("2/5*max(-x, 0)^2.5", -4.0, -8.0),
        ("2/5*abs(x)^2.5", -4.0, -8.0),
        ("2/7*abs(x)^3.5", 4.0, 32.0),
        ("2/5*(x^2)^1.25*sqrt(abs(x))^0", 4.0, 8.0),
        ("2/5*(max(-x, 0)/4)^2.5", 1.0, 0.0),
        ("2/5*(max(-x, 0)/4)^2.5", -16.0, -2.0),
        ("2/5*(4*max(-x, 0))^2.5", 1.0, 0.0),
        ("2/5*(4*max(-x, 0))^2.5", -1.0, -32.0),
        ("2/3*(4*max(-x, 0))^1.5", -1.0, -8.0),
        ("2/3*(x^2/4)^0.75", 4.0, 0.5_f64.sqrt()),
        ("2/5*(abs(x)/4)^2.5", -16.0, -2.0),
        ("sqrt(4*x^2)", 0.0, 0.0),
        ("sqrt(4*x^2)", -3.0, -2.0),
        ("norm([x/5])", 2.0, 0.2),
    ] {
        let text = format!("coordinates(x), lagrangian = dot(x)^2/2 - {energy}");
        let found = -slopes(&text, &[x])[0];
        assert!(
            (found - expected).abs() < 1e-13,
            "{energy} at {x}: {found}, {expected}"
        );
    }
}

/// Reciprocals that several products share, where the powers in some of them would merge with those of a root.
#[test]
fn reciprocals_are_shared_by_products_that_have_them() {
    const VALUES: [(&str, f64); 6] = [
        ("a", 3.0),
        ("b", 7.0),
        ("c", 0.5),
        ("d", 5.0),
        ("h", 1.3),
        ("m", 2.0),
    ];
    let (x, y) = (0.7_f64, 0.4);
    let s = x * x + 1.3 * 1.3;
    for (parts, fields) in [
        ("force(x) = b/(s*m), force(y) = -c*dot(y)/(s*m)", "abchm"),
        ("force(x) = b/(s*d), force(y) = -c*dot(y)/(s*d)", "abcdhm"),
        (
            "output(u) = b/s^(3/2), output(v) = x/(s*m), output(w) = y/(s*m)",
            "abhm",
        ),
        (
            "output(u) = b/s^(3/2), output(v) = x/(s*d), output(w) = y/(s*d)",
            "abdhm",
        ),
    ] {
        let text = format!(
            "coordinates(x, y), let s = x^2 + h^2, lagrangian = m/2*(dot(x)^2 + dot(y)^2) + a/sqrt(s), {parts}"
        );
        let field = |name: char| Field {
            name: name.to_string(),
            kind: FieldKind::Scalar,
        };
        let context = Context {
            struct_name: "Model".to_owned(),
            fields: fields.chars().map(field).collect(),
            const_parameters: Vec::new(),
        };
        let declared = declare(&text, &context).expect("a model");
        let environment = Environment {
            q: vec![x, y],
            z: vec![0.3, -0.9],
            parameters: VALUES.map(|(name, value)| (name.to_owned(), value)).into(),
            ..Environment::default()
        };
        let requests = [
            Request {
                second: false,
                mass: false,
                ..ALL
            },
            ALL,
            Request {
                observables: true,
                ..ALL
            },
        ];
        for request in requests {
            let program = Derivation::of(&declared).program(request);
            let found = interpret(&program, &environment).expect("a complete environment");
            let divisor = if parts.contains("s*m") { 2.0 } else { 5.0 };
            let mut numbers = vec![(found.q[0], -3.0 * x / (s * s.sqrt()))];
            if parts.contains("force") {
                numbers.push((found.force[0], 7.0 / (s * divisor)));
                numbers.push((found.force[1], 0.5 * 0.9 / (s * divisor)));
            }
            if request.observables && parts.contains("output") {
                let expected = [7.0 / (s * s.sqrt()), x / (s * divisor), y / (s * divisor)];
                numbers.extend(found.observables.iter().copied().zip(expected));
            }
            for (found, expected) in numbers {
                assert!(
                    (found - expected).abs() < 1e-14,
                    "{parts}: {found} {expected}\n{program}"
                );
            }
        }
    }
}

/// Slopes near the ends of the ranges of functions, to the last digits.
#[test]
fn slopes_at_the_ends_of_ranges_keep_their_digits() {
    let near = 1.0 - 2.0_f64.powi(-30);
    let beyond = 1.0 + 2.0_f64.powi(-30);
    let gap = |x: f64| ((1.0 - x) * (1.0 + x)).abs();
    for (energy, x, expected) in [
        ("tanh(x)", 800.0, 0.0),
        ("asin(x)", near, 1.0 / gap(near).sqrt()),
        ("acos(x)", near, -1.0 / gap(near).sqrt()),
        ("atanh(x)", near, 1.0 / gap(near)),
        ("acosh(x)", beyond, 1.0 / gap(beyond).sqrt()),
    ] {
        let text = format!("coordinates(x), lagrangian = dot(x)^2/2 - {energy}");
        let found = -slopes(&text, &[x])[0];
        assert!(
            (found - expected).abs() <= 4e-15 * expected.abs(),
            "{energy} at {x}: {found}, {expected}"
        );
    }
}
