//! The language: its syntax tree, the grammar and the parser, and syntax as text. May import `expr` and `diagnostic` only.

pub mod ast;
pub mod context;
pub mod parse;
mod print;
