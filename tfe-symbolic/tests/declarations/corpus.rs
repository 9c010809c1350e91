//! Valid declarations: cases of the corpus, and models of examples and tests.

use std::path::{Path, PathBuf};

use tfe_symbolic::syntax::context::{Context, Field, FieldKind, Length};

use super::{Declaration, structs};

/// Longer declarations of examples and tests are left out: a mutation of them takes long and shows no more.
const MAX_LENGTH: usize = 500;

/// The cases of the corpus that are accepted, short ones first.
pub fn cases() -> Vec<Declaration> {
    let folder = workspace().join("tfe-symbolic/tests/corpus/accept");
    let mut declarations = Vec::new();
    for path in files(&folder, "txt") {
        declarations.extend(read(&path));
    }
    by_length(declarations)
}

/// The declarations of a file of the corpus; results are ignored.
pub fn read(path: &Path) -> Vec<Declaration> {
    let text = std::fs::read_to_string(path).unwrap_or_default();
    let case = |case: &str| {
        let fields = case.split_once("struct:").map_or("", |(_, rest)| rest);
        let fields = fields.lines().next().unwrap_or_default();
        let arguments = case.split_once("--- declaration\n");
        let arguments = arguments.map_or("", |(_, rest)| rest);
        let arguments = arguments.split("\n--- result").next().unwrap_or_default();
        Declaration {
            context: structs::context(fields),
            arguments: arguments.trim_end().to_owned(),
        }
    };
    text.split("=== ").skip(1).map(case).collect()
}

fn by_length(mut declarations: Vec<Declaration>) -> Vec<Declaration> {
    declarations.sort_by_key(|declaration| declaration.arguments.len());
    declarations
}

/// The cases of the corpus, and the models of the workspace's examples, tests and benches, short ones first.
pub fn all() -> Vec<Declaration> {
    let mut paths = Vec::new();
    for folder in ["examples", "tests", "benches"] {
        paths.extend(files(&workspace().join(folder), "rs"));
    }
    let mut declarations = cases();
    for path in paths {
        let text = std::fs::read_to_string(&path).unwrap_or_default();
        let text = without_comments(&text);
        for piece in text.split("#[dynamics").skip(1) {
            let Some(declaration) = model(piece) else {
                continue;
            };
            if declaration.arguments.len() <= MAX_LENGTH && !declarations.contains(&declaration) {
                declarations.push(declaration);
            }
        }
    }
    by_length(declarations)
}

/// The root of the workspace, seen from any of its crates.
fn workspace() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// The files below a folder with this ending, in the order of their names.
fn files(folder: &Path, ending: &str) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.path()).collect();
    paths.sort();
    for path in paths {
        // What must not compile belongs to other tests.
        if path.is_dir() && !path.ends_with("ui") && !path.ends_with("target") {
            found.extend(files(&path, ending));
        } else if path.extension().is_some_and(|own| own == ending) {
            found.push(path);
        }
    }
    found
}

fn without_comments(text: &str) -> String {
    let line = |line: &str| line.split("//").next().unwrap_or_default().to_owned();
    text.lines().map(line).collect::<Vec<_>>().join("\n")
}

/// `(arguments)] struct Name<const N: usize> { fields }`
fn model(text: &str) -> Option<Declaration> {
    let (arguments, rest) = bracketed(text.strip_prefix('(')?, ('(', ')'))?;
    let (_, rest) = rest.split_once("struct ")?;
    let end = rest.find(['{', ';', '(']).filter(|end| *end < 80)?;
    let (head, rest) = rest.split_at(end);
    let mut context = Context {
        struct_name: "Model".to_owned(),
        ..Context::default()
    };
    if let Some((_, parameters)) = head.split_once('<') {
        let names = parameters.split(',').filter_map(|one| {
            let (name, _) = one.split_once(':')?;
            Some(name.trim().strip_prefix("const")?.trim().to_owned())
        });
        context.const_parameters = names.collect();
    }
    if let Some(body) = rest.strip_prefix('{') {
        let (fields, _) = bracketed(body, ('{', '}'))?;
        for field in fields.split(',').filter(|field| !field.trim().is_empty()) {
            let (name, kind) = field.rsplit_once(": ")?;
            let name = name.split_whitespace().last()?.to_owned();
            let kind = kind_of(kind.trim());
            context.fields.push(Field { name, kind });
        }
    }
    let arguments = arguments.split_whitespace().collect::<Vec<_>>().join(" ");
    Some(Declaration { context, arguments })
}

/// What stands before the bracket that closes, and what behind it.
fn bracketed(text: &str, (open, close): (char, char)) -> Option<(&str, &str)> {
    let mut depth = 1;
    for (at, letter) in text.char_indices() {
        if letter == open {
            depth += 1;
        } else if letter == close {
            depth -= 1;
        }
        if depth == 0 {
            return Some((&text[..at], &text[at + close.len_utf8()..]));
        }
    }
    None
}

fn kind_of(text: &str) -> FieldKind {
    let length = text
        .strip_prefix("[f64;")
        .and_then(|text| text.strip_suffix(']'));
    match (text, length.map(str::trim)) {
        (_, Some(length)) => FieldKind::Array(match length.parse() {
            Ok(length) => Length::Literal(length),
            Err(_) => Length::ConstParameter(length.to_owned()),
        }),
        ("f64", _) => FieldKind::Scalar,
        ("usize", _) => FieldKind::Length,
        ("Vec<f64>", _) => FieldKind::Vector,
        ("Vec<usize>", _) => FieldKind::Indices,
        (other, _) => FieldKind::Other(other.to_owned()),
    }
}
