//! Lists of indices: gathers against the same model written out, where entries are equal too.

use tfe_symbolic::compile::declare;
use tfe_symbolic::derive::derivation::Derivation;
use tfe_symbolic::model::declared::{Declared, Requirement};
use tfe_symbolic::program::Request;
use tfe_symbolic::program::interpret::{Environment, Results, interpret};
use tfe_symbolic::syntax::context::{Context, Field, FieldKind};

const EVERYTHING: Request = Request {
    value: true,
    first: true,
    mass: true,
    second: true,
    observables: true,
    constraint_values: false,
    constraint_rows: false,
    constraint_second: false,
};

const CONSTRAINTS: Request = Request {
    value: false,
    first: false,
    mass: false,
    second: false,
    observables: false,
    constraint_values: true,
    constraint_rows: true,
    constraint_second: true,
};

const SITES: usize = 4;

/// A bond that is there twice, in both directions; one from a site to itself; one at the end.
const LEFT: [usize; 5] = [0, 2, 1, 2, 0];
const RIGHT: [usize; 5] = [2, 0, 1, 3, 2];

/// Goes through site 1 twice, and rests there.
const PATH: [usize; 5] = [0, 1, 1, 3, 1];

fn context(text: &str) -> Context {
    let kinds = [
        ("n", FieldKind::Length),
        ("w", FieldKind::Length),
        ("a", FieldKind::Scalar),
        ("m", FieldKind::Vector),
        ("c", FieldKind::Vector),
        ("left", FieldKind::Indices),
        ("right", FieldKind::Indices),
        ("path", FieldKind::Indices),
    ];
    let words: Vec<&str> = text.split(|c: char| !c.is_alphanumeric()).collect();
    let used = kinds.into_iter().filter(|(name, _)| words.contains(name));
    Context {
        struct_name: "Model".to_owned(),
        fields: used
            .map(|(name, kind)| Field {
                name: name.to_owned(),
                kind,
            })
            .collect(),
        const_parameters: Vec::new(),
    }
}

#[track_caller]
fn declared(text: &str) -> Declared {
    declare(text, &context(text)).unwrap_or_else(|problems| panic!("{text}\n{problems:?}"))
}

fn environment(rows: usize) -> Environment {
    let list = |scale: f64| (0..5).map(|i| 1.0 + scale * i as f64).collect::<Vec<f64>>();
    Environment {
        time: 0.4,
        q: (0..SITES).map(|i| (1.7 * i as f64 + 0.3).sin()).collect(),
        z: (0..SITES).map(|i| (0.9 * i as f64 - 0.2).cos()).collect(),
        mu: (0..rows).map(|i| (1.3 * i as f64 + 0.1).cos()).collect(),
        parameters: [("a".to_owned(), 0.25)].into(),
        arrays: [("m".to_owned(), list(0.1)), ("c".to_owned(), list(0.3))].into(),
        sizes: [("n".to_owned(), SITES as i64), ("w".to_owned(), 5)].into(),
        lists: [("left", LEFT), ("right", RIGHT), ("path", PATH)]
            .map(|(name, list)| (name.to_owned(), list.to_vec()))
            .into(),
    }
}

/// Everything that a program computes, in one list.
fn numbers(results: &Results) -> Vec<f64> {
    let r = results;
    let blocks = [
        &r.zz, &r.zq, &r.qq, &r.force_z, &r.force_q, &r.rows, &r.bend,
    ];
    let blocks: Vec<Vec<f64>> = blocks.map(|block| block.concat()).to_vec();
    let lists = [&r.z, &r.q, &r.force, &r.observables, &r.phi, &r.drift];
    let lists: Vec<f64> = lists.into_iter().flatten().copied().collect();
    [vec![r.value], lists, blocks.concat()].concat()
}

#[track_caller]
fn check(request: Request, rows: usize, listed: &str, written: &str) {
    let run = |text: &str| {
        let program = Derivation::of(&declared(text)).program(request);
        let results = interpret(&program, &environment(rows));
        numbers(&results.unwrap_or_else(|e| panic!("{e}\n{program}")))
    };
    let (listed, written) = (run(listed), run(written));
    assert_eq!(listed.len(), written.len());
    for (at, (x, y)) in listed.iter().zip(&written).enumerate() {
        // Sums of some ten terms of size one in another order.
        assert!((x - y).abs() < 1e-13 * 1f64.max(y.abs()), "{at}: {x} {y}");
    }
}

fn joined(range: std::ops::Range<usize>, term: impl Fn(usize) -> String) -> String {
    range.map(term).collect::<Vec<_>>().join(" + ")
}

#[test]
fn bonds_that_are_listed() {
    let listed = "coordinates(q[n]), lagrangian = sum(i in 0..n, m[i]/2*dot(q[i])^2) \
        - sum(b in 0..w, c[b]/2*(q[left[b]] - q[right[b]])^2 + a*q[left[b]]^2*sin(q[right[b]]) + a*dot(q[left[b]])^2*q[right[b]]), \
        force(q[i]) = -a*q[left[i]]*dot(q[i]), force(q[right[3]]) = q[left[0]]^2, \
        output(stretch[b in 0..w]) = q[left[b]] - q[right[b]], output(first) = q[left[1]]*left[3]";
    let mass = joined(0..SITES, |i| format!("m[{i}]/2*dot(q[{i}])^2"));
    let bonds = joined(0..5, |b| {
        let (l, r) = (LEFT[b], RIGHT[b]);
        format!("c[{b}]/2*(q[{l}] - q[{r}])^2 + a*q[{l}]^2*sin(q[{r}]) + a*dot(q[{l}])^2*q[{r}]")
    });
    let forces: Vec<String> = (0..SITES)
        .map(|i| format!("force(q[{i}]) = -a*q[{}]*dot(q[{i}])", LEFT[i]))
        .collect();
    let outputs: Vec<String> = (0..5)
        .map(|b| format!("output(stretch{b}) = q[{}] - q[{}]", LEFT[b], RIGHT[b]))
        .collect();
    let written = format!(
        "coordinates(q[{SITES}]), lagrangian = {mass} - ({bonds}), {}, force(q[{}]) = q[{}]^2, {}, output(first) = q[{}]*{}",
        forces.join(", "),
        RIGHT[3],
        LEFT[0],
        outputs.join(", "),
        LEFT[1],
        LEFT[3],
    );
    // The stretch of a site to itself vanishes, and a zero is not stored: the interpreter fills it in.
    check(EVERYTHING, 0, listed, &written);
}

/// Neighbours in a list look like neighbours in space, but places come again.
#[test]
fn a_path_through_sites() {
    let listed = "coordinates(q[n]), lagrangian = sum(i in 0..n, m[i]/2*dot(q[i])^2) \
        - sum(k in 0..w-1, c[k]*q[path[k]]*q[path[k+1]]^2) - a*q[path[w-1]]^4 - a*q[0]^3";
    let mass = joined(0..SITES, |i| format!("m[{i}]/2*dot(q[{i}])^2"));
    let steps = joined(0..4, |k| {
        format!("c[{k}]*q[{}]*q[{}]^2", PATH[k], PATH[k + 1])
    });
    let written = format!(
        "coordinates(q[{SITES}]), lagrangian = {mass} - ({steps}) - a*q[{}]^4 - a*q[0]^3",
        PATH[4]
    );
    check(EVERYTHING, 0, listed, &written);
}

#[test]
fn constraints_between_listed_sites() {
    let listed = "coordinates(q[n]), lagrangian = sum(i in 0..n, m[i]/2*dot(q[i])^2), \
        constraint(rod[b in 0..w]) = (q[left[b]] - 2*q[right[b]])^2 - c[b]^2 + t*q[left[b]]";
    let mass = joined(0..SITES, |i| format!("m[{i}]/2*dot(q[{i}])^2"));
    let rods: Vec<String> = (0..5)
        .map(|b| {
            let (l, r) = (LEFT[b], RIGHT[b]);
            format!("constraint(rod{b}) = (q[{l}] - 2*q[{r}])^2 - c[{b}]^2 + t*q[{l}]")
        })
        .collect();
    let written = format!(
        "coordinates(q[{SITES}]), lagrangian = {mass}, {}",
        rods.join(", ")
    );
    let (listed, written) = (declared(listed), declared(&written));
    let run = |declared: &Declared| {
        let program = Derivation::of(declared).program(CONSTRAINTS);
        let results = interpret(&program, &environment(5));
        results.unwrap_or_else(|e| panic!("{e}\n{program}"))
    };
    let (listed, written) = (run(&listed), run(&written));
    for (x, y) in numbers(&listed).iter().zip(&numbers(&written)) {
        assert!((x - y).abs() < 1e-13 * 1f64.max(y.abs()), "{x} {y}");
    }
}

#[test]
fn requirements_of_lists() {
    let text = "coordinates(q[n]), lagrangian = sum(i in 0..n, dot(q[i])^2/2) \
        - sum(b in 0..w, c[left[b]]*(q[left[b]+1] - q[right[b]])^2)";
    let told = |requirement: &Requirement| match requirement {
        Requirement::Index {
            array,
            text,
            ranges,
            nest,
            ..
        } => {
            format!("{array}[{text}] for {ranges}, {} loops", nest.len())
        }
        Requirement::FieldLength { field, length, .. } => format!("{field}: {length}"),
        Requirement::Turns { ranges, .. } => format!("turns of {ranges}"),
    };
    let mut all: Vec<String> = declared(text).requirements.iter().map(told).collect();
    all.sort();
    assert_eq!(
        all,
        [
            "c[left[b]] for b in 0..w, 1 loops",
            "left: w",
            "q[left[b]+1] for b in 0..w, 1 loops",
            "q[right[b]] for b in 0..w, 1 loops",
            "right: w",
            "turns of b in 0..w",
            "turns of i in 0..n",
        ]
    );
}
