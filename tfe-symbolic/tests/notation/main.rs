//! Declarations as text: the grammar, the parser, and a corpus of what is accepted and what is refused.

mod corpus;
mod grammar;
mod parse;
