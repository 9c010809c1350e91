//! The language: its syntax tree, the grammar and the parser, and syntax as text. May import `expr`,
//! `vocabulary` and `diagnostic`.

pub mod ast;
pub mod context;
mod grammar;
pub mod parse;
mod print;
