//! The parser that pest generates from `grammar.pest`. It is part of the tree so that users compile neither the generator nor what it needs; a test holds it
//! equal to the grammar (`tests/grammar.rs`).

// The generated `enum Rule` is public and undocumented, so it stays behind a private module.
#![allow(missing_docs, unreachable_pub)]
#![allow(dead_code, clippy::all, clippy::pedantic, reason = "made by pest")]

pub struct TfeParser;

include!("grammar/parser.rs");
