//! Families in loops against the same models written out, and what the loops look like.

use tfe_symbolic::compile::declare;
use tfe_symbolic::derive::derivation::{Derivation, Model};
use tfe_symbolic::program::interpret::{Environment, Results, interpret};
use tfe_symbolic::program::{Program, Request};
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

/// A family of N coordinates, and those of the scalar parameters m, k, a, c that the text uses.
fn context(text: &str) -> Context {
    let words: Vec<&str> = text.split(|c: char| !c.is_alphanumeric()).collect();
    let names = ["m", "k", "a", "c"]
        .into_iter()
        .filter(|name| words.contains(name));
    Context {
        struct_name: "Model".to_owned(),
        fields: names
            .map(|name| Field {
                name: name.to_owned(),
                kind: FieldKind::Scalar,
            })
            .collect(),
        const_parameters: vec!["N".to_owned()],
    }
}

fn environment(n: usize) -> Environment {
    let parameters = [("m", 1.3), ("k", 0.7), ("a", 0.25), ("c", 0.1)];
    Environment {
        time: 0.4,
        q: (0..n).map(|i| (1.7 * i as f64 + 0.3).sin()).collect(),
        z: (0..n).map(|i| (0.9 * i as f64 - 0.2).cos()).collect(),
        parameters: parameters
            .map(|(name, value)| (name.to_owned(), value))
            .into(),
        sizes: [("N".to_owned(), n as i64)].into(),
        ..Environment::default()
    }
}

fn results(text: &str, n: usize, request: Request) -> Results {
    let declared =
        declare(text, &context(text)).unwrap_or_else(|problems| panic!("{text}\n{problems:?}"));
    let program = Derivation::of(&declared).program(request);
    let run = |program: &Program| {
        interpret(program, &environment(n)).unwrap_or_else(|error| panic!("{error}\n{program}"))
    };
    // Twice on the same results: the program must not need them to be zero.
    assert_same(&run(&twice(&program)), &run(&program));
    run(&program)
}

/// The program, and the same once more on its results.
fn twice(program: &Program) -> Program {
    Program {
        statements: [&program.statements[..], &program.statements[..]].concat(),
        ..program.clone()
    }
}

/// Sums of at most some hundred terms of size one in another order: 1e-12 leaves a factor of ten.
#[track_caller]
fn assert_same(a: &Results, b: &Results) {
    let vectors = |r: &Results| {
        [
            vec![r.value],
            r.z.clone(),
            r.q.clone(),
            r.force.clone(),
            r.observables.clone(),
        ]
        .concat()
    };
    let blocks = |r: &Results| {
        [&r.zz, &r.zq, &r.qq, &r.force_z, &r.force_q]
            .map(|block| block.concat())
            .concat()
    };
    for (x, y) in [(vectors(a), vectors(b)), (blocks(a), blocks(b))] {
        assert_eq!(x.len(), y.len());
        for (at, (x, y)) in x.iter().zip(&y).enumerate() {
            let size = 1f64.max(x.abs()).max(y.abs());
            assert!((x - y).abs() < 1e-12 * size, "{at}: {x} {y}");
        }
    }
}

fn joined(range: std::ops::Range<usize>, term: impl Fn(usize) -> String) -> String {
    range.map(term).collect::<Vec<_>>().join(" + ")
}

/// Compares a family in loops with the same model written out for n coordinates.
#[track_caller]
fn check_family(n: usize, looped: &str, written: &str) {
    let looped = format!("coordinates(q[N]), {looped}");
    let written = format!("coordinates(q[{n}]), {written}");
    assert_same(&results(&looped, n, ALL), &results(&written, n, ALL));
    let first = Request {
        first: true,
        ..Request::default()
    };
    assert_same(&results(&looped, n, first), &results(&written, n, first));
}

#[test]
fn a_chain_in_loops_equals_the_chain_written_out() {
    let spring = |i: usize| format!("k/2*(q[{0}]-q[{i}])^2 + a/3*(q[{0}]-q[{i}])^3", i + 1);
    check_family(
        10,
        "lagrangian = sum(i in 0..N, m/2*dot(q[i])^2) - sum(i in 0..N-1, k/2*(q[i+1]-q[i])^2 + a/3*(q[i+1]-q[i])^3) \
         - k/2*q[0]^2 - k/2*q[N-1]^2",
        &format!(
            "lagrangian = {} - ({}) - k/2*q[0]^2 - k/2*q[9]^2",
            joined(0..10, |i| format!("m/2*dot(q[{i}])^2")),
            joined(0..9, spring)
        ),
    );
}

/// Compares literal ranges with the model written out. The program runs twice on the same results: it must not need them to be zero.
#[track_caller]
fn check_literal(n: usize, looped: &str, written: &str) -> Program {
    let declared = |text: &str| {
        let text = format!("coordinates(q[{n}]), lagrangian = {text}");
        let declared = declare(&text, &context(&text));
        declared.unwrap_or_else(|problems| panic!("{text}\n{problems:?}"))
    };
    let run = |program: &Program| {
        interpret(program, &environment(n)).unwrap_or_else(|error| panic!("{error}\n{program}"))
    };
    let program = Derivation::of(&declared(looped)).program(ALL);
    let written = run(&Derivation::of(&declared(written)).program(ALL));
    assert_same(&run(&program), &written);
    assert_same(&run(&twice(&program)), &written);
    program
}

#[test]
fn a_literal_chain_is_stored_once() {
    let spring = |i: usize| format!("k/2*(q[{0}]-q[{i}])^2 + a/3*(q[{0}]-q[{i}])^3", i + 1);
    let program = check_literal(
        40,
        "sum(i in 0..40, m/2*dot(q[i])^2) - sum(i in 0..39, k/2*(q[i+1]-q[i])^2 + a/3*(q[i+1]-q[i])^3) - k/2*q[0]^2 - k/2*q[39]^2",
        &format!(
            "{} - ({}) - k/2*q[0]^2 - k/2*q[39]^2",
            joined(0..40, |i| format!("m/2*dot(q[{i}])^2")),
            joined(0..39, spring)
        ),
    );
    // Each place is complete when it is written, and the energy is a variable.
    let text = program.to_string();
    let onto_results = text.lines().filter(|line| line.contains("] +="));
    assert_eq!(
        onto_results.count() + text.matches("clear").count(),
        0,
        "{text}"
    );
}

#[test]
fn neighbours_of_neighbours_and_rings() {
    let pull = |i: usize| {
        let [j, k] = [i + 1, i + 2];
        format!("k*q[{i}]*q[{j}]^2*q[{k}] + a*cos(q[{k}] - q[{i}])")
    };
    check_literal(
        40,
        "sum(i in 0..40, m/2*dot(q[i])^2) - sum(i in 0..38, k*q[i]*q[i+1]^2*q[i+2] + a*cos(q[i+2] - q[i])) - c*q[0]*q[39]^2*q[1]",
        &format!(
            "{} - ({}) - c*q[0]*q[39]^2*q[1]",
            joined(0..40, |i| format!("m/2*dot(q[{i}])^2")),
            joined(0..38, pull)
        ),
    );
}

#[test]
fn what_pairs_feel_of_their_differences_is_balanced() {
    let pairs = || (1..7).flat_map(|i| (0..i).map(move |j| (i, j)));
    let pull = |i: usize, j: usize| {
        let (k, l) = (i + 7, j + 7);
        format!("k/sqrt(1 + (q[{i}] - q[{j}])^2 + (q[{k}] - q[{l}])^2)")
    };
    let attraction: Vec<String> = pairs().map(|(i, j)| pull(i, j)).collect();
    let written = format!(
        "{} + {}",
        joined(0..14, |i| format!("m/2*dot(q[{i}])^2")),
        attraction.join(" + ")
    );
    let mass = "sum(i in 0..14, m/2*dot(q[i])^2)";
    let f = "k/sqrt(1 + (q[i] - q[j])^2 + (q[i+7] - q[j+7])^2)";
    for loops in [
        format!("sum(i in 1..7, sum(j in 0..i, {f}))"),
        format!("sum(i in 0..7, sum(j in 0..i, {f}))"),
        format!("sum(i in 0..7, sum(j in i+1..7, {f}))"),
        format!("sum(i in 0..6, sum(j in i+1..7, {f}))"),
    ] {
        let program = check_literal(14, &format!("{mass} + {loops}"), &written).to_string();
        for entry in ["[0, 0]", "[0, 7]", "[7, 7]"] {
            let balance = format!("balance E_qq{entry}, 7 entries");
            assert!(program.contains(&balance), "{program}");
        }
        assert!(!program.contains("E_qq[j, j]"), "{program}");
    }
    // Not all pairs; and what else stands on the diagonal would be balanced as well.
    for loops in [
        format!("sum(i in 2..7, sum(j in 0..i, {f}))"),
        format!("sum(i in 1..7, sum(j in 0..i, {f})) + k*q[2]^2"),
    ] {
        let text = format!("coordinates(q[14]), lagrangian = {mass} + {loops}");
        let declared = declare(&text, &context(&text)).expect("a model of the test");
        let program = Derivation::of(&declared).program(ALL).to_string();
        assert!(!program.contains("balance"), "{program}");
    }
}

#[test]
fn pairs_of_a_family_are_balanced() {
    let pairs = || (1..4).flat_map(|i| (0..i).map(move |j| (i, j)));
    let attraction: Vec<String> = pairs()
        .map(|(i, j)| format!("k*cos(q[{i}] - q[{j}])"))
        .collect();
    check_family(
        4,
        "lagrangian = sum(i in 0..N, m/2*dot(q[i])^2) + sum(i in 0..N, sum(j in 0..i, k*cos(q[i] - q[j])))",
        &format!(
            "lagrangian = {} + {}",
            joined(0..4, |i| format!("m/2*dot(q[{i}])^2")),
            attraction.join(" + ")
        ),
    );
}

#[test]
fn pairs_are_stored_off_the_diagonal_and_added_on_it() {
    let pairs = || (1..7).flat_map(|i| (0..i).map(move |j| (i, j)));
    let attraction: Vec<String> = pairs()
        .map(|(i, j)| format!("{i}*k/sqrt(1 + (q[{i}] - q[{j}])^2)"))
        .collect();
    let program = check_literal(
        7,
        "sum(i in 0..7, m/2*dot(q[i])^2) - k*q[3]^2 + sum(i in 1..7, sum(j in 0..i, i*k/sqrt(1 + (q[i] - q[j])^2)))",
        &format!(
            "{} - k*q[3]^2 + {}",
            joined(0..7, |i| format!("m/2*dot(q[{i}])^2")),
            attraction.join(" + ")
        ),
    );
    let text = program.to_string();
    assert!(!text.contains("clear"), "{text}");
    assert!(text.contains("E_qq[i, j] = "), "{text}");
    assert!(text.contains("E_qq[j, j] += "), "{text}");
    assert!(text.contains("E_qq[i, i] += "), "{text}");
}

#[test]
fn a_force_between_two_bodies_divides_once() {
    let text = "coordinates(x[2], y[2]), lagrangian = dot(x[0])^2 + dot(x[1])^2 + dot(y[0])^2 + dot(y[1])^2 \
         + k/sqrt((x[0] - x[1])^2 + (y[0] - y[1])^2)";
    let declared = declare(text, &context(text)).expect("a model of the test");
    let first = Request {
        first: true,
        ..Request::default()
    };
    let counts = Derivation::of(&declared).counts(first);
    // k x/(r √r) and k y/(r √r): four doubled velocities, two squares, r √r, and one product each.
    assert_eq!(
        (counts.divisions, counts.multiplications),
        (1, 9),
        "{counts}"
    );
}

#[test]
fn slots_that_coincide_add_up() {
    // With one coordinate, q[0] and q[N-1] are the same.
    check_family(
        1,
        "lagrangian = sum(i in 0..N, m/2*dot(q[i])^2) - k*q[0]*sin(q[N-1])*dot(q[0])",
        "lagrangian = m/2*dot(q[0])^2 - k*q[0]*sin(q[0])*dot(q[0])",
    );
}

#[test]
fn nested_sums_with_dependent_ranges() {
    let pairs = || (0..5).flat_map(|i| (i + 1..5).map(move |j| (i, j)));
    let coupling: Vec<String> = pairs()
        .map(|(i, j)| format!("k*cos(q[{i}]-q[{j}])*dot(q[{j}])"))
        .collect();
    check_family(
        5,
        "lagrangian = sum(i in 0..N, m/2*dot(q[i])^2 + i*q[i]^2 + sum(j in i+1..N, k*cos(q[i]-q[j])*dot(q[j])))",
        &format!(
            "lagrangian = {} + {}",
            joined(0..5, |i| format!("m/2*dot(q[{i}])^2 + {i}*q[{i}]^2")),
            coupling.join(" + ")
        ),
    );
}

/// The results of the model whose energy is the first output of the declared one.
fn results_of_output(text: &str, n: usize) -> Results {
    let declared =
        declare(text, &context(text)).unwrap_or_else(|problems| panic!("{text}\n{problems:?}"));
    let mut model = Model::from(&declared);
    model.energy = model.observables.remove(0).value;
    let program = Derivation::of_model(model).program(ALL);
    interpret(&program, &environment(n)).unwrap_or_else(|error| panic!("{error}\n{program}"))
}

#[test]
fn functions_of_sums_couple_all_with_all() {
    let squares = joined(0..4, |i| format!("q[{i}]^2"));
    let sines = joined(0..4, |i| format!("sin(q[{i}])*dot(q[{i}])"));
    let outer = joined(0..4, |i| format!("q[{i}]*sin(q[{i}] + {squares})"));
    let kinetic = joined(0..4, |i| format!("m/2*dot(q[{i}])^2"));
    let looped = "coordinates(q[N]), lagrangian = sum(i in 0..N, m/2*dot(q[i])^2), \
         output(e) = k*sqrt(1 + sum(i in 0..N, q[i]^2))*(q[1]*t - 1) - a*sum(i in 0..N, sin(q[i])*dot(q[i]))^2 \
         + sum(i in 0..N, q[i]*sin(q[i] + sum(j in 0..N, q[j]^2)))";
    let written = format!(
        "coordinates(q[4]), lagrangian = {kinetic}, output(e) = k*sqrt(1 + {squares})*(q[1]*t - 1) - a*({sines})^2 + {outer}"
    );
    assert_same(
        &results_of_output(looped, 4),
        &results_of_output(&written, 4),
    );
}

#[test]
fn forces_dissipation_and_outputs_in_loops() {
    let kinetic = joined(0..4, |i| format!("m/2*dot(q[{i}])^2"));
    let forces: Vec<String> = (0..4)
        .map(|i| {
            format!(
                "force(q[{i}]) = -c*dot(q[{i}])^3 + t*q[{i}]*({})",
                joined(0..4, |j| format!("q[{j}]^2"))
            )
        })
        .collect();
    check_family(
        4,
        "lagrangian = sum(i in 0..N, m/2*dot(q[i])^2), \
         dissipation = sum(i in 0..N-1, a*(dot(q[i+1])-dot(q[i]))^2*q[i]^2), \
         force(q[i]) = -c*dot(q[i])^3 + t*q[i]*sum(j in 0..N, q[j]^2), force(q[0]) = k*q[1], \
         output(energy) = sum(i in 0..N, m/2*dot(q[i])^2), output(both) = sqrt(sum(i in 0..N, q[i]^2)) + sum(i in 0..N, q[i])",
        &format!(
            "lagrangian = {kinetic}, dissipation = {}, {}, force(q[0]) = k*q[1], output(energy) = {kinetic}, output(both) = sqrt({}) + {}",
            joined(0..3, |i| format!(
                "a*(dot(q[{0}])-dot(q[{i}]))^2*q[{i}]^2",
                i + 1
            )),
            forces.join(", "),
            joined(0..4, |i| format!("q[{i}]^2")),
            joined(0..4, |i| format!("q[{i}]")),
        ),
    );
}

#[test]
fn a_loop_shares_its_body_and_hoists_what_does_not_vary() {
    let text =
        "coordinates(q[N]), lagrangian = sum(i in 0..N, m/2*dot(q[i])^2 - sqrt(k/m)*cos(q[i]))";
    let declared = declare(text, &context(text)).expect("a model of the test");
    let program = Derivation::of(&declared).program(Request {
        first: true,
        second: true,
        value: true,
        ..Request::default()
    });
    let text = program.to_string();
    assert_eq!(text.matches("for i").count(), 1, "{text}");
    assert_eq!(text.matches("sin_cos").count(), 1, "{text}");
    let (before, _) = text.split_once("for i").expect("one loop");
    assert!(before.contains("sqrt("), "{text}");
}

#[test]
fn missing_names_and_wild_indices_are_errors() {
    let text = "coordinates(q[N]), lagrangian = sum(i in 0..N, m/2*dot(q[i])^2 - k*q[i]^2)";
    let declared = declare(text, &context(text)).expect("a model of the test");
    let program = Derivation::of(&declared).program(ALL);
    let short = Environment {
        sizes: [("N".to_owned(), 4)].into(),
        ..environment(3)
    };
    let error = interpret(&program, &short).expect_err("there is no fourth coordinate");
    assert_eq!(error.to_string(), "index 3 of `z` is outside of 0..3");
    let error = interpret(&program, &Environment::default()).expect_err("nothing is given");
    assert!(error.to_string().ends_with("has no value"), "{error}");
}

#[test]
fn a_long_chain_of_links_takes_seconds() {
    // 16 links with absolute angles and shared positions: the size at which exponential work or memory would show.
    let n = 16;
    let names: Vec<String> = (0..n).map(|i| format!("a{i}")).collect();
    let mut lets = Vec::new();
    let mut energy = Vec::new();
    for i in 0..n {
        let before = |axis: char| {
            if i == 0 {
                String::new()
            } else {
                format!("{axis}{} + ", i - 1)
            }
        };
        lets.push(format!(
            "let x{i} = {}sin(a{i}), let y{i} = {}cos(a{i})",
            before('x'),
            before('y')
        ));
        energy.push(format!("m/2*(dot(x{i})^2 + dot(y{i})^2) + m*k*y{i}"));
    }
    let text = format!(
        "coordinates({}), {}, lagrangian = {}",
        names.join(", "),
        lets.join(", "),
        energy.join(" + ")
    );
    let start = std::time::Instant::now();
    let declared =
        declare(&text, &context(&text)).unwrap_or_else(|problems| panic!("{problems:?}"));
    let derivation = Derivation::of(&declared);
    let counts = derivation.counts(ALL);
    println!("{counts}, {:?}", start.elapsed());
    assert!(counts.weighted() < 20_000, "{counts}");
    assert!(start.elapsed().as_secs() < 30, "{:?}", start.elapsed());
}

/// Each `let` is lowered once, however many paths lead to it: here 2²⁴ do.
#[test]
fn chains_of_lets_with_loops() {
    let chain: Vec<String> = (1..=24)
        .map(|k| format!("let a{k} = a{0} + a*a{0}", k - 1))
        .collect();
    let text = format!(
        "coordinates(q[N]), let a0 = sum(i in 0..N, q[i]^2), {}, lagrangian = sum(i in 0..N, dot(q[i])^2/2) - a24",
        chain.join(", ")
    );
    let found = results(&text, 3, ALL);
    let environment = environment(3);
    let factor = -2.0 * 1.25_f64.powi(24);
    for (slope, q) in found.q.iter().zip(&environment.q) {
        assert!((slope - factor * q).abs() < 1e-13 * slope.abs());
    }
}

/// Programs have no loops below zero, wherever the index begins.
#[test]
fn indices_that_begin_below_zero() {
    for (below, from_zero) in [
        (
            "sum(i in -2..N-2, k*q[i+2]^3*(i + 1))",
            "sum(i in 0..N, k*q[i]^3*(i - 1))",
        ),
        (
            "sum(i in 0..N-5, sum(j in i-5..i, k*q[i]*q[j+5]^2))",
            "sum(i in 0..N-5, sum(j in 0..5, k*q[i]*q[i+j]^2))",
        ),
        (
            "sum(i in -9..N-9, sum(j in -3..i-1, k*q[i+9]*q[j+3]))",
            "sum(i in 0..N, sum(j in 0..i-7, k*q[i]*q[j]))",
        ),
        (
            "sum(i in 5-N..3, k*q[i+N-5]^3*(i + 1))",
            "sum(i in 0..N-2, k*q[i]^3*(i + 6 - N))",
        ),
        (
            "sum(i in 0..N, sum(j in i-N..0, k*q[i]*q[j+N]*j))",
            "sum(i in 0..N, sum(j in i..N, k*q[i]*q[j]*(j - N)))",
        ),
    ] {
        let [below, from_zero] = [below, from_zero].map(|sum| {
            format!("coordinates(q[N]), lagrangian = sum(i in 0..N, m/2*dot(q[i])^2) - {sum}")
        });
        let declared = declare(&below, &context(&below)).expect("a model");
        let program = Derivation::of(&declared).program(ALL).to_string();
        assert!(
            !program.contains("in -") && !program.contains("in i-"),
            "{program}"
        );
        assert_same(&results(&below, 12, ALL), &results(&from_zero, 12, ALL));
    }
}
