//! The corpus of declarations: what is accepted, with the model that comes out, and what is rejected,
//! with the messages that the user reads.
//!
//! Each file of `tests/corpus` holds cases of the form
//!
//! ```text
//! === name of the case
//! struct: <N> m, k: [3], c: [N], w: Vec, n: usize, left: indices, label: String
//! --- declaration
//! coordinates(x), lagrangian = …
//! --- result
//! the model, or the messages
//! ```
//!
//! `UPDATE_GOLDEN=1 cargo test` rewrites the results.

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use tfe_symbolic::compile::declare;
use tfe_symbolic::diagnostic::{Diagnostic, Kind};
use tfe_symbolic::model::declared::{Declared, Requirement};
use tfe_symbolic::syntax::context::{Context, Field, FieldKind, Length};

struct Case {
    name: String,
    fields: String,
    declaration: String,
    result: String,
}

fn corpus(folder: &str) -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/corpus")
        .join(folder);
    let entries = std::fs::read_dir(&folder).expect("the corpus is part of the repository");
    let mut files: Vec<PathBuf> = entries
        .map(|entry| entry.expect("a readable entry").path())
        .collect();
    files.sort();
    assert!(!files.is_empty(), "no cases in {}", folder.display());
    files
}

fn cases(text: &str) -> Vec<Case> {
    text.split("=== ")
        .skip(1)
        .map(|case| {
            let (name, rest) = case.split_once('\n').expect("a case has a name");
            let (fields, rest) = rest
                .split_once("--- declaration\n")
                .expect("a case has a declaration");
            let (declaration, result) = match rest.split_once("\n--- result\n") {
                Some((declaration, result)) => (declaration, result),
                None => (rest.trim_end(), ""),
            };
            Case {
                name: name.to_owned(),
                fields: fields
                    .trim()
                    .trim_start_matches("struct:")
                    .trim()
                    .to_owned(),
                declaration: declaration.to_owned(),
                result: result.trim_end().to_owned(),
            }
        })
        .collect()
}

/// `<N> m, k: [3], c: [N], w: Vec, n: usize, left: indices, label: String`
fn context(text: &str) -> Context {
    let mut context = Context {
        struct_name: "Model".into(),
        ..Context::default()
    };
    let mut fields = text;
    if let Some(rest) = text.strip_prefix('<') {
        let (parameters, rest) = rest.split_once('>').expect("a closed list of parameters");
        context.const_parameters = parameters
            .split(',')
            .map(|name| name.trim().into())
            .collect();
        fields = rest;
    }
    for field in fields
        .split(',')
        .map(str::trim)
        .filter(|field| !field.is_empty())
    {
        let (name, kind) = match field.split_once(':') {
            None => (field, FieldKind::Scalar),
            Some((name, kind)) => {
                let kind = kind.trim();
                let length = kind
                    .strip_prefix('[')
                    .and_then(|kind| kind.strip_suffix(']'));
                let kind = match (kind, length) {
                    (_, Some(length)) => FieldKind::Array(match length.parse() {
                        Ok(length) => Length::Literal(length),
                        Err(_) => Length::ConstParameter(length.to_owned()),
                    }),
                    ("Vec", _) => FieldKind::Vector,
                    ("usize", _) => FieldKind::Length,
                    ("indices", _) => FieldKind::Indices,
                    (other, _) => FieldKind::Other(other.to_owned()),
                };
                (name.trim(), kind)
            }
        };
        context.fields.push(Field {
            name: name.to_owned(),
            kind,
        });
    }
    context
}

fn shown(model: &Declared) -> String {
    let mut out = format!("{model}\n");
    let graph = &model.graph;
    let _ = writeln!(
        out,
        "{} = {}",
        model.form.letter(),
        graph.display(model.energy)
    );
    if let Some(dissipation) = model.dissipation {
        let _ = writeln!(out, "D = {}", graph.display(dissipation));
    }
    for force in &model.forces {
        let value = graph.display(force.value);
        let _ = write!(out, "Q[{}] = {value}", force.target);
        for range in &force.ranges {
            let _ = write!(
                out,
                " for {} in {}..{}",
                range.variable, range.start, range.end
            );
        }
        out.push('\n');
    }
    for constraint in &model.constraints {
        let value = graph.display(constraint.value);
        let _ = writeln!(
            out,
            "0 = {value} ({}: {})",
            constraint.name, constraint.kind
        );
    }
    for one in &model.observables {
        let _ = write!(out, "{} = {}", one.name, graph.display(one.value));
        for range in &one.ranges {
            let _ = write!(out, " for i in {}..{}", range.start, range.end);
        }
        out.push('\n');
    }
    if !model.sensitivities.is_empty() {
        let _ = writeln!(out, "{:?}", model.sensitivities);
    }
    for solver in &model.solvers {
        let _ = writeln!(out, "solver {}: {}", solver.name, solver.element);
    }
    if let Some(path) = &model.crate_path {
        let _ = writeln!(out, "crate {path}");
    }
    for remark in &model.remarks {
        let _ = writeln!(out, "remark: {remark}");
    }
    for requirement in &model.requirements {
        if let Requirement::Index { text, ranges, .. } = requirement {
            let separator = if ranges.is_empty() { "" } else { " for " };
            let _ = writeln!(out, "to be checked: {text}{separator}{ranges}");
        }
    }
    out.trim_end().to_owned()
}

fn rendered(diagnostics: &[Diagnostic], text: &str) -> String {
    let messages: Vec<String> = diagnostics
        .iter()
        .map(|diagnostic| match diagnostic.field() {
            // A field is underlined in the struct, not in the attribute.
            Some(field) => {
                let help = diagnostic.help().map(|help| format!("\n = help: {help}"));
                let message = diagnostic.message();
                format!(
                    "error: {message}\n --> field {field}{}",
                    help.unwrap_or_default()
                )
            }
            None => diagnostic.render(text).trim_end().to_owned(),
        })
        .collect();
    messages.join("\n")
}

/// Runs all cases of a folder; `judge` gives the result, or says why there should be none.
fn run(folder: &str, judge: impl Fn(&Case) -> Result<String, String>) {
    let update = std::env::var_os("UPDATE_GOLDEN").is_some();
    let mut failures = String::new();
    for path in corpus(folder) {
        let text = std::fs::read_to_string(&path).expect("a readable file");
        let mut rewritten = String::new();
        for case in cases(&text) {
            let title = format!("{}: {}", path.display(), case.name);
            let result = judge(&case).unwrap_or_else(|reason| {
                let _ = writeln!(failures, "{title}: {reason}");
                case.result.clone()
            });
            if result != case.result && !update {
                let _ = writeln!(
                    failures,
                    "{title}\n--- expected\n{}\n--- found\n{result}\n",
                    case.result
                );
            }
            let Case {
                name,
                fields,
                declaration,
                ..
            } = case;
            let _ = writeln!(
                rewritten,
                "=== {name}\nstruct: {fields}\n--- declaration\n{declaration}\n--- result\n{result}\n"
            );
        }
        if update {
            std::fs::write(&path, rewritten.trim_end().to_owned() + "\n").expect("a writable file");
        }
    }
    assert!(failures.is_empty(), "{failures}");
}

#[test]
fn accepted_declarations_give_these_models() {
    run("accept", |case| {
        declare(&case.declaration, &context(&case.fields))
            .map(|model| shown(&model))
            .map_err(|diagnostics| rendered(&diagnostics, &case.declaration))
    });
}

#[test]
fn rejected_declarations_give_these_messages() {
    run("reject", |case| {
        match declare(&case.declaration, &context(&case.fields)) {
            Ok(model) => Err(format!("accepted: {model}")),
            Err(diagnostics) if diagnostics.is_empty() => Err("rejected without a message".into()),
            Err(diagnostics) => Ok(rendered(&diagnostics, &case.declaration)),
        }
    });
}

#[test]
fn each_kind_of_mistake_has_a_case() {
    let mut seen = BTreeSet::new();
    for path in corpus("reject") {
        let text = std::fs::read_to_string(&path).expect("a readable file");
        for case in cases(&text) {
            if let Err(diagnostics) = declare(&case.declaration, &context(&case.fields)) {
                seen.extend(diagnostics.iter().map(|diagnostic| diagnostic.kind.name()));
            }
        }
    }
    // Too long to be read in a corpus.
    let long = format!(
        "coordinates(x), lagrangian = dot(x)^2{}",
        " + x".repeat(3000)
    );
    let diagnostics = declare(&long, &context("")).expect_err("too long");
    seen.extend(diagnostics.iter().map(|diagnostic| diagnostic.kind.name()));
    let missing: Vec<_> = Kind::NAMES
        .iter()
        .filter(|name| !seen.contains(**name))
        .collect();
    assert!(missing.is_empty(), "no case for {missing:?}");
}

#[test]
fn blanks_mean_nothing() {
    // The compact texts with a blank at each place where a token may end.
    let context = context("m, g, n: usize, w: [3]");
    let compact = "coordinates(q[3]),let s=sum(i in 0..3,w[i]*q[i]),\
        lagrangian=sum(i in 0..3,m/2*dot(q[i])^2)-g*select(s<=1e-3,s,s^2)+n,\
        solver(Fast,Primal::<4>.quadrature(5)),crate=a::b";
    let spaced = " coordinates ( q [ 3 ] ) , let s = sum ( i in 0 .. 3 , w [ i ] * q [ i ] ) , \
        lagrangian = sum ( i in 0 . . 3 , m / 2 * dot ( q [ i ] ) ^ 2 ) - g * select ( s < = 1e-3 , \
        s , s ^ 2 ) + n , solver ( Fast , Primal : : < 4 > . quadrature ( 5 ) ) , crate = a :: b ";
    let models = [compact, spaced].map(|text| match declare(text, &context) {
        Ok(model) => shown(&model),
        Err(diagnostics) => panic!("{}", rendered(&diagnostics, text)),
    });
    assert_eq!(models[0], models[1]);
}

#[test]
fn three_mistakes_give_three_messages() {
    let text = "coordinates(x), let a = sin(x, x), lagrangian = m/2*dot(x)^2 - k*y, force(z) = a";
    let diagnostics = declare(text, &context("m, k")).expect_err("mistakes");
    let names: Vec<_> = diagnostics
        .iter()
        .map(|diagnostic| diagnostic.kind.name())
        .collect();
    assert_eq!(names, ["WrongArity", "UnknownSymbol", "ForceTarget"]);
}
