//! The parser that pest generates from `grammar.pest`. It is part of the tree so that users compile neither the generator nor what it needs; a test holds it
//! equal to the grammar (`tests/grammar.rs`).

// The generated `enum Rule` is public and undocumented, so it stays behind a private module.
#![allow(missing_docs, unreachable_pub)]
#![allow(dead_code, clippy::all, clippy::pedantic, reason = "made by pest")]

use pest::{Atomicity, ParseResult, ParserState};

pub struct TfeParser;

type State<'i> = Box<ParserState<'i, Rule>>;

/// A part of the grammar.
type Part<'i> = fn(State<'i>) -> ParseResult<State<'i>>;

/// What pest combines parts of a grammar with, compiled once: its own methods, of the same names without `_of`, would be for each of 250 closures.
trait Combine<'i> {
    fn rule_of(self, rule: Rule, part: Part<'i>) -> ParseResult<State<'i>>;
    fn sequence_of(self, part: Part<'i>) -> ParseResult<State<'i>>;
    fn repeat_of(self, part: Part<'i>) -> ParseResult<State<'i>>;
    fn optional_of(self, part: Part<'i>) -> ParseResult<State<'i>>;
    fn lookahead_of(self, is_positive: bool, part: Part<'i>) -> ParseResult<State<'i>>;
    fn atomic_of(self, atomicity: Atomicity, part: Part<'i>) -> ParseResult<State<'i>>;
}

impl<'i> Combine<'i> for State<'i> {
    fn rule_of(self, rule: Rule, part: Part<'i>) -> ParseResult<State<'i>> {
        self.rule(rule, part)
    }

    fn sequence_of(self, part: Part<'i>) -> ParseResult<State<'i>> {
        self.sequence(part)
    }

    fn repeat_of(self, part: Part<'i>) -> ParseResult<State<'i>> {
        self.repeat(part)
    }

    fn optional_of(self, part: Part<'i>) -> ParseResult<State<'i>> {
        self.optional(part)
    }

    fn lookahead_of(self, is_positive: bool, part: Part<'i>) -> ParseResult<State<'i>> {
        self.lookahead(is_positive, part)
    }

    fn atomic_of(self, atomicity: Atomicity, part: Part<'i>) -> ParseResult<State<'i>> {
        self.atomic(atomicity, part)
    }
}

include!("grammar/parser.rs");
