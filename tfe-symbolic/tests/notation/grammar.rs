//! The parser in the tree is what pest makes of `grammar.pest`; `UPDATE_GOLDEN=1 cargo test` writes it anew.

use quote::quote;
use std::path::Path;

#[test]
fn the_parser_is_that_of_the_grammar() {
    let parser = quote! {
        #[grammar = "syntax/grammar.pest"]
        pub struct TfeParser;
    };
    let tokens = pest_generator::derive_parser(parser, false);
    let file = syn::parse2(tokens).expect("items");
    let made = format!(
        "// Made by pest from grammar.pest: tests/grammar.rs.\n\n{}",
        of_function_pointers(prettyplease::unparse(&file))
    );
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/syntax/grammar/parser.rs");
    if std::env::var_os("UPDATE_GOLDEN").is_some() {
        std::fs::write(&path, &made).expect("a writable tree");
    }
    let kept = std::fs::read_to_string(&path).expect("the parser is part of the repository");
    assert!(
        kept == made,
        "grammar.pest has changed: UPDATE_GOLDEN=1 cargo test -p tfe-symbolic --test grammar"
    );
}

/// The parser with the methods of `Combine` instead of those of pest, which are compiled for every closure.
fn of_function_pointers(parser: String) -> String {
    let import = parser.replace(
        "use super::super::Rule;",
        "use super::super::{Combine, Rule};",
    );
    [
        "rule",
        "sequence",
        "repeat",
        "optional",
        "lookahead",
        "atomic",
    ]
    .into_iter()
    .fold(import, |parser, method| {
        parser.replace(&format!(".{method}("), &format!(".{method}_of("))
    })
}
