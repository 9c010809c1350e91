//! The parser that pest generates from `grammar.pest`.

// The generated `enum Rule` is public and undocumented, so it stays behind a private module.
#![allow(missing_docs, unreachable_pub)]

#[derive(pest_derive::Parser)]
#[grammar = "syntax/grammar.pest"]
pub struct TfeParser;
