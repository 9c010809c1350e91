//! What each pass of the optimiser saves on the models of `benches/kernels`: operations with it left out, over operations with all of them.
//!
//! `cargo run --release -p tfe-symbolic --example passes` prints a table; an operation weighs as in `Counts::weighted`. Instructions are those of
//! `cargo bench --bench kernels`.

use std::process::ExitCode;
use std::time::Instant;

use tfe_symbolic::compile::declare;
use tfe_symbolic::derive::derivation::Derivation;
use tfe_symbolic::model::declared::Declared;
use tfe_symbolic::pipeline::Pass;
use tfe_symbolic::program::Request;
use tfe_symbolic::syntax::context::{Context, Field, FieldKind, Length};

/// The declarations are read from the bench, so that both are always the same.
const MODELS: &str = include_str!("../../benches/kernels/models.rs");

/// The name of a struct and its declaration.
fn models() -> Vec<(String, Declared)> {
    let mut found = Vec::new();
    for part in MODELS.split("#[dynamics(").skip(1) {
        let Some((text, rest)) = part.split_once("\n)]") else {
            continue;
        };
        let Some((name, body)) = rest
            .split_once("pub struct ")
            .and_then(|(_, rest)| rest.split_once('{'))
        else {
            continue;
        };
        let fields = body
            .split('}')
            .next()
            .unwrap_or_default()
            .split(";\n")
            .next()
            .unwrap_or_default()
            .split('\n')
            .filter_map(|line| line.trim().strip_prefix("pub ")?.split_once(": "));
        let fields = fields.map(|(name, kind)| Field {
            name: name.to_owned(),
            kind: match kind.trim_end_matches(',').split_once("; ") {
                Some((_, length)) => {
                    let length = length.trim_end_matches(']').parse().unwrap_or(0);
                    FieldKind::Array(Length::Literal(length))
                }
                None => FieldKind::Scalar,
            },
        });
        let context = Context {
            fields: fields.collect(),
            ..Context::default()
        };
        match declare(text, &context) {
            Ok(declared) => found.push((name.trim().to_owned(), declared)),
            Err(mistakes) => eprintln!("{name}: {mistakes:?}"),
        }
    }
    found
}

/// Weighted operations of the first derivatives, and of the second ones.
fn operations(derivation: &Derivation) -> [usize; 2] {
    [Request::FIRST, Request::SECOND].map(|request| derivation.counts(request).weighted())
}

fn main() -> ExitCode {
    let models = models();
    if models.is_empty() {
        eprintln!("no model was found");
        return ExitCode::FAILURE;
    }
    let all: Vec<[usize; 2]> = models
        .iter()
        .map(|(_, declared)| operations(&Derivation::of(declared)))
        .collect();
    let total: usize = all.iter().flatten().sum();
    println!(
        "{total} operations of {} kernels with all passes\n",
        2 * all.len()
    );
    println!(
        "{:<16} {:>7} {:>8}  kernels that change, without the pass over with it",
        "without", "total", "time"
    );
    for pass in Pass::ALL {
        let start = Instant::now();
        let mut changed = Vec::new();
        let mut sum = 0;
        for ((name, declared), with) in models.iter().zip(&all) {
            let without = operations(&Derivation::without(declared, pass));
            sum += without.iter().sum::<usize>();
            for ((kind, without), with) in ["first", "second"].iter().zip(without).zip(with) {
                if without != *with {
                    let ratio = without as f64 / *with as f64;
                    changed.push((ratio, format!("{name} {kind} {ratio:.2}")));
                }
            }
        }
        changed.sort_by(|a, b| b.0.total_cmp(&a.0));
        let changed: Vec<String> = changed.into_iter().map(|(_, text)| text).collect();
        let ratio = sum as f64 / total as f64;
        let seconds = start.elapsed().as_secs_f64();
        println!(
            "{:<16} {ratio:>7.3} {seconds:>6.1} s  {}",
            format!("{pass:?}"),
            changed.join(", ")
        );
    }
    ExitCode::SUCCESS
}
