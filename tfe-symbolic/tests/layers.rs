//! The plan of the workspace by its imports: no circles among the files of any crate, nor among their folders, folders of the engine in layers, a line in `ARCHITECTURE.md` for
//! every module, in whose order they import each other, and every file of tests in a manifest.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

/// The folders of the engine: each may import those before it.
const LAYERS: [&str; 14] = [
    "expr",
    "vocabulary",
    "diagnostic",
    "syntax",
    "model",
    "program",
    "optimise",
    "derive",
    "schedule",
    "check",
    "variants",
    "lower",
    "pipeline",
    "compile",
];

/// By module path, such as `expr::graph`, the modules imported.
type Imports = BTreeMap<String, BTreeSet<String>>;

#[test]
fn the_files_of_the_engine_import_each_other_without_circles() {
    assert_eq!(circle(&imports(&engine())), Vec::<String>::new());
}

#[test]
fn the_files_of_the_macros_import_each_other_without_circles() {
    let imports = imports(&sources("../tfe-macros/src"));
    assert_eq!(circle(&imports), Vec::<String>::new());
    assert_eq!(circle(&by_folder(&imports)), Vec::<String>::new());
}

#[test]
fn folders_import_lower_layers_only() {
    let folders = by_folder(&imports(&engine()));
    assert_eq!(circle(&folders), Vec::<String>::new());
    let layer = |folder: &str| {
        let found = LAYERS.iter().position(|name| *name == folder);
        found.unwrap_or_else(|| panic!("`{folder}` stands in no layer"))
    };
    for (folder, imported) in &folders {
        for other in imported {
            let is_lower = layer(other) < layer(folder);
            assert!(
                is_lower,
                "`{folder}` imports `{other}`, which is no lower layer"
            );
        }
    }
}

#[test]
fn the_files_of_the_library_and_of_the_runtime_import_each_other_without_circles() {
    for root in ["../src", "../tfe-runtime/src"] {
        let imports = imports(&sources(root));
        assert_eq!(circles(&imports), [[""; 0]; 0], "{root}");
        assert_eq!(circles(&by_folder(&imports)), [[""; 0]; 0], "{root}");
    }
}

/// In the tables, so that who looks for something finds where it is.
#[test]
fn every_module_has_a_line_in_the_tables() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let text = fs::read_to_string(root.join("../ARCHITECTURE.md")).expect("the file can be read");
    let rows: Vec<&str> = text
        .lines()
        .filter(|line| line.starts_with("| `"))
        .collect();
    for crate_sources in ["src", "../tfe-runtime/src", "../src"] {
        let modules = sources(crate_sources).into_keys();
        let modules: BTreeSet<String> = modules
            .map(|module| module.split("::").next().unwrap_or(&module).to_owned())
            .collect();
        for module in modules {
            let name = format!("`{module}`");
            let has_line = rows.iter().any(|row| {
                let first = row.split('|').nth(1).unwrap_or_default();
                first.contains(&name)
            });
            assert!(has_line, "{crate_sources}: no line for {name}");
        }
    }
}

/// In the order of their tables.
#[test]
fn lower_rows_of_the_tables_import_upper_ones() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let text = fs::read_to_string(root.join("../ARCHITECTURE.md")).expect("the file can be read");
    for (heading, crate_sources) in [
        ("## `tfe-runtime`", "../tfe-runtime/src"),
        ("## `tfe`", "../src"),
    ] {
        let (_, section) = text.split_once(heading).expect("a section of the crate");
        let section = section.split("\n## ").next().unwrap_or(section);
        let rows: Vec<&str> = section
            .lines()
            .filter(|line| line.starts_with("| `"))
            .collect();
        let row = |module: &str| {
            let name = format!("`{module}`");
            let holds = |line: &&str| line.split('|').nth(1).unwrap_or_default().contains(&name);
            rows.iter().position(holds)
        };
        for (module, imported) in by_folder(&imports(&sources(crate_sources))) {
            for other in imported {
                let is_upper = row(&other) <= row(&module);
                assert!(
                    is_upper,
                    "{crate_sources}: `{module}` imports `{other}`, which stands in a lower row"
                );
            }
        }
    }
}

/// Tests are named in manifests, and a file that none names would be run by nobody.
#[test]
fn every_file_of_tests_is_run() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests");
    let manifests = ["../Cargo.toml", "light/Cargo.toml"].map(|path| {
        let path = folder.join(path);
        fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
    });
    let entries = fs::read_dir(&folder).expect("a folder of tests");
    let mut tests = Vec::new();
    for entry in entries {
        let path = entry.expect("an entry").path();
        let is_test =
            path.extension().is_some_and(|kind| kind == "rs") || path.join("main.rs").exists();
        if is_test && let Some(name) = path.file_stem() {
            tests.push(name.to_string_lossy().into_owned());
        }
    }
    assert!(tests.len() > 30, "{tests:?}");
    for test in tests {
        let line = format!("\n[[test]]\nname = \"{test}\"\n");
        let named: usize = manifests
            .iter()
            .map(|text| text.matches(&line).count())
            .sum();
        assert_eq!(named, 1, "{test} is named {named} times");
    }
}

#[test]
fn imports_are_found() {
    let text = "use crate::a::{self, b::C, d}; // crate::x::y\npub(in crate::x::y) fn f() { super::e::g(); child::h::<crate::i::J>() }";
    let sources = ["m", "m::child", "a", "a::b", "a::d", "e", "i", "x::y"];
    let mut sources: BTreeMap<String, String> = sources
        .into_iter()
        .map(|name| (name.to_owned(), String::new()))
        .collect();
    sources.insert("m".to_owned(), without_tests(text));
    let expected = ["a", "a::b", "a::d", "e", "i", "m::child"];
    let found: Vec<String> = imports(&sources)["m"].iter().cloned().collect();
    assert_eq!(found, expected);
}

#[test]
fn circles_are_found() {
    let one = |from: &str, to: &[&str]| {
        let to = to.iter().map(|name| (*name).to_owned()).collect();
        (from.to_owned(), to)
    };
    let tree = Imports::from([one("a", &["b", "c"]), one("b", &["c"]), one("c", &[])]);
    assert_eq!(circle(&tree), Vec::<String>::new());
    let ring = Imports::from([one("a", &["b"]), one("b", &["c"]), one("c", &["b"])]);
    assert_eq!(circle(&ring), ["b", "c"]);
    assert_eq!(circles(&ring), [["b", "c"]]);
    let two = Imports::from([
        one("a", &["b"]),
        one("b", &["a", "c"]),
        one("c", &["d"]),
        one("d", &["c"]),
    ]);
    assert_eq!(circles(&two), [["a", "b"], ["c", "d"]]);
}

fn engine() -> BTreeMap<String, String> {
    sources("src")
}

/// The code of each module, without comments and tests; `lib.rs` only declares modules.
fn sources(root: &str) -> BTreeMap<String, String> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join(root);
    let mut sources = BTreeMap::new();
    let mut folders = vec![(root, String::new())];
    while let Some((folder, module)) = folders.pop() {
        for entry in fs::read_dir(&folder).expect("the folder can be listed") {
            let path = entry.expect("the entry can be read").path();
            let stem = path.file_stem().and_then(|stem| stem.to_str());
            let stem = stem.expect("names of files are UTF-8");
            let own = format!("{module}{stem}");
            if path.is_dir() {
                folders.push((path, format!("{own}::")));
            } else if path.extension().is_some_and(|end| end == "rs")
                && !["lib", "tests"].contains(&stem)
            {
                let text = fs::read_to_string(&path).expect("the file can be read");
                sources.insert(own, without_tests(&text));
            }
        }
    }
    assert!(sources.len() > 10, "these are not the sources");
    sources
}

/// The code before the tests of a file, without comments, and without the places from which something may be seen: they are no imports.
fn without_tests(text: &str) -> String {
    let text = text.split("mod tests {").next();
    let lines = text.unwrap_or_default().lines();
    let code = lines.map(|line| line.split("//").next().unwrap_or_default());
    let code = code.collect::<Vec<_>>().join("\n");
    let mut parts = code.split("pub(in ");
    let first = parts.next().unwrap_or_default().to_owned();
    parts.fold(first, |code, part| {
        code + part.split_once(')').map_or(part, |(_, seen)| seen)
    })
}

/// The modules that paths in the code lead to; the declaration of a child leads nowhere.
fn imports(sources: &BTreeMap<String, String>) -> Imports {
    let modules: BTreeSet<&str> = sources.keys().map(String::as_str).collect();
    let of = |(module, text): (&String, &String)| {
        let found = paths(text).into_iter();
        let found = found.filter_map(|path| resolved(module, &path, &modules));
        let others = found.filter(|other| other != module).collect();
        (module.clone(), others)
    };
    sources.iter().map(of).collect()
}

/// The deepest module on a path that is written in `module`.
fn resolved(module: &str, path: &[String], modules: &BTreeSet<&str>) -> Option<String> {
    let mut at: Vec<&str> = module.split("::").collect();
    let mut rest = path.iter().map(String::as_str).peekable();
    match *rest.peek()? {
        "crate" => {
            rest.next();
            at.clear();
        }
        "self" => {
            rest.next();
        }
        "super" => {
            while rest.next_if_eq(&"super").is_some() {
                at.pop();
            }
        }
        // Any other path is one of this crate only if it begins with a child.
        child => {
            if !modules.contains(format!("{module}::{child}").as_str()) {
                return None;
            }
        }
    }
    at.extend(rest.filter(|name| *name != "self"));
    while !at.is_empty() && !modules.contains(at.join("::").as_str()) {
        at.pop();
    }
    (!at.is_empty()).then(|| at.join("::"))
}

/// All paths of two names or more, with groups in braces multiplied out.
fn paths(text: &str) -> Vec<Vec<String>> {
    let mut found = Vec::new();
    let mut rest = text;
    while let Some(start) = rest.find(|c: char| c.is_alphabetic() || c == '_') {
        rest = path(&rest[start..], &[], &mut found);
    }
    found.retain(|path| path.len() > 1);
    found
}

/// Reads one path or group after `before`, and returns what follows it.
fn path<'a>(text: &'a str, before: &[String], found: &mut Vec<Vec<String>>) -> &'a str {
    let mut text = text.trim_start();
    if let Some(group) = text.strip_prefix('{') {
        text = group.trim_start();
        while !text.is_empty() && !text.starts_with('}') {
            text = path(text, before, found).trim_start();
            text = text.trim_start_matches([',', '*']).trim_start();
        }
        return text.strip_prefix('}').unwrap_or(text);
    }
    let is_name = |c: char| c.is_alphanumeric() || c == '_';
    let end = text.find(|c| !is_name(c)).unwrap_or(text.len());
    let mut own = before.to_vec();
    own.push(text[..end].to_owned());
    let rest = text[end..].trim_start();
    if end == 0 {
        // Nothing that an import consists of: a character is skipped.
        let next = text.chars().next().map_or(0, char::len_utf8);
        return &text[next..];
    }
    match rest.strip_prefix("::") {
        Some(more) if !more.trim_start().starts_with(['<', '*']) => path(more, &own, found),
        _ => {
            found.push(own);
            rest
        }
    }
}

/// The imports between folders; a file beside the folders counts as one.
fn by_folder(imports: &Imports) -> Imports {
    let folder = |module: &str| module.split("::").next().unwrap_or(module).to_owned();
    let mut folders = Imports::new();
    for (module, imported) in imports {
        let own = folder(module);
        let others = imported.iter().map(|other| folder(other));
        let others: Vec<String> = others.filter(|other| *other != own).collect();
        folders.entry(own).or_default().extend(others);
    }
    folders
}

/// The modules that import each other in a circle, or lie between circles; none if there are no circles.
fn circle(imports: &Imports) -> Vec<String> {
    let mut left = imports.clone();
    loop {
        let before = left.len();
        let alive: BTreeSet<String> = left.keys().cloned().collect();
        let imported: BTreeSet<String> = left.values().flatten().cloned().collect();
        // What imports nothing that is left, or is imported by nothing that is left, lies on no circle.
        left.retain(|module, others| {
            others.iter().any(|other| alive.contains(other)) && imported.contains(module)
        });
        if left.len() == before {
            return left.into_keys().collect();
        }
    }
}

/// The groups of modules of which each leads to every other.
fn circles(imports: &Imports) -> Vec<Vec<String>> {
    let mut reached = imports.clone();
    loop {
        let before: usize = reached.values().map(BTreeSet::len).sum();
        let known = reached.clone();
        for others in reached.values_mut() {
            let further = others.iter().filter_map(|other| known.get(other));
            let further: Vec<String> = further.flatten().cloned().collect();
            others.extend(further);
        }
        if reached.values().map(BTreeSet::len).sum::<usize>() == before {
            break;
        }
    }
    let mut groups: Vec<Vec<String>> = Vec::new();
    for (module, others) in &reached {
        let back = |other: &&String| reached.get(*other).is_some_and(|own| own.contains(module));
        let group: Vec<String> = others.iter().filter(back).cloned().collect();
        if group.len() > 1 && !groups.contains(&group) {
            groups.push(group);
        }
    }
    groups
}
