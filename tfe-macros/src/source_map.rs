//! Converts the tokens of the attribute to text, and places in the text back to tokens.
//!
//! The engine parses text. On stable Rust only whole tokens have precise spans, so the text of every token is appended
//! to a string together with a table of byte ranges; the range of a diagnostic is translated to the first and the last
//! token that it touches.

use proc_macro2::{Delimiter, Ident, Spacing, Span, TokenStream, TokenTree};
use quote::quote;
use std::ops::Range;

/// The text for `$crate`, which is not a word.
const DOLLAR_CRATE: &str = "__tfe_crate";

/// The text of an attribute, and where each part of it came from.
pub(crate) struct SourceMap {
    /// The text: tokens in order, separated by blanks where Rust separates them.
    pub(crate) text: String,
    entries: Vec<(Range<usize>, Span)>,
    end: Span,
    /// Doc comments between and inside arguments, which are not part of the text: their places, and the tokens to the
    /// right of `doc =`.
    pub(crate) docs: Vec<(usize, TokenStream)>,
    /// Other attributes there, which are mistakes and not part of the text either: their first and last tokens.
    pub(crate) attributes: Vec<(Span, Span)>,
    /// `$crate` of the `macro_rules!` macro that wrote `crate = $crate::path`.
    dollar_crate: Option<Ident>,
}

impl SourceMap {
    /// Walks the tokens.
    pub(crate) fn new(tokens: TokenStream) -> Self {
        let mut map = Self {
            text: String::new(),
            entries: Vec::new(),
            end: Span::call_site(),
            docs: Vec::new(),
            attributes: Vec::new(),
            dollar_crate: None,
        };
        map.walk(tokens);
        map.end = map
            .entries
            .last()
            .map_or_else(Span::call_site, |(_, span)| *span);
        map
    }

    fn walk(&mut self, tokens: TokenStream) {
        let mut tokens = tokens.into_iter().peekable();
        while let Some(token) = tokens.next() {
            if let Some(attribute) = attribute(&token, tokens.peek()) {
                tokens.next();
                match attribute {
                    Attribute::Doc(text) => self.docs.push((self.text.len(), text)),
                    Attribute::Other(spans) => self.attributes.push(spans),
                }
                continue;
            }
            match token {
                TokenTree::Group(group) => {
                    // An invisible group is an expression substituted by a `macro_rules!` macro: it binds like parentheses, and a
                    // single word needs none (a length such as `$n` must stay a number).
                    let (open, close) = match group.delimiter() {
                        Delimiter::None if is_word(group.stream()) || self.is_at_path() => {
                            self.walk(group.stream());
                            continue;
                        }
                        Delimiter::Parenthesis | Delimiter::None => ("(", ")"),
                        Delimiter::Bracket => ("[", "]"),
                        Delimiter::Brace => ("{", "}"),
                    };
                    self.push(open, group.span_open());
                    self.walk(group.stream());
                    self.push(close, group.span_close());
                }
                TokenTree::Ident(ident) if ident == "$crate" && self.is_at_path() => {
                    self.push_separated(DOLLAR_CRATE, ident.span());
                    self.dollar_crate = Some(ident);
                }
                TokenTree::Ident(ident) => {
                    let text = ident.to_string();
                    self.push_separated(text.strip_prefix("r#").unwrap_or(&text), ident.span());
                }
                TokenTree::Literal(literal) => {
                    self.push_separated(&literal.to_string(), literal.span());
                }
                TokenTree::Punct(punct) => {
                    self.push(punct.as_char().encode_utf8(&mut [0; 4]), punct.span());
                    if punct.spacing() == Spacing::Alone {
                        self.text.push(' ');
                    }
                }
            }
        }
    }

    fn push(&mut self, text: &str, span: Span) {
        let start = self.text.len();
        self.text.push_str(text);
        self.entries.push((start..self.text.len(), span));
    }

    /// Appends a word, followed by a blank, so that two words never run together.
    fn push_separated(&mut self, text: &str, span: Span) {
        self.push(text, span);
        self.text.push(' ');
    }

    /// Whether the path of `crate = path` comes next.
    fn is_at_path(&self) -> bool {
        let argument = self.text.rsplit(',').next().unwrap_or_default();
        let words: Vec<&str> = argument.split_whitespace().collect();
        words == ["crate", "="]
    }

    /// The tokens of a path in the text; nothing if it is none.
    pub(crate) fn path(&self, text: &str) -> Option<TokenStream> {
        let path: syn::Path = syn::parse_str(text).ok()?;
        match &self.dollar_crate {
            Some(own) if path.segments.first()?.ident == DOLLAR_CRATE => {
                let rest = path.segments.iter().skip(1);
                Some(quote!(#own #(::#rest)*))
            }
            _ => Some(quote!(#path)),
        }
    }

    /// The spans of the first and the last token that the byte range touches. A range after the last token, or between
    /// two tokens, is assigned to the token before it.
    pub(crate) fn spans(&self, range: Range<usize>) -> (Span, Span) {
        let end = range.end.max(range.start + 1);
        let mut touched = self
            .entries
            .iter()
            .filter(|(at, _)| at.start < end && at.end > range.start);
        match touched.next() {
            Some((_, first)) => (
                *first,
                touched.next_back().map_or(*first, |(_, span)| *span),
            ),
            None => {
                let before = self
                    .entries
                    .iter()
                    .rev()
                    .find(|(at, _)| at.end <= range.start);
                let span = before.map_or(self.end, |(_, span)| *span);
                (span, span)
            }
        }
    }
}

/// An attribute between or inside of arguments.
enum Attribute {
    /// What stands right of `doc =` in `#[doc = …]`, of which `///` is short for.
    Doc(TokenStream),
    /// The first and the last token of another one.
    Other((Span, Span)),
}

/// The attribute that begins with these tokens.
fn attribute(hash: &TokenTree, brackets: Option<&TokenTree>) -> Option<Attribute> {
    let (TokenTree::Punct(hash), Some(TokenTree::Group(group))) = (hash, brackets) else {
        return None;
    };
    if hash.as_char() != '#' || group.delimiter() != Delimiter::Bracket {
        return None;
    }
    let mut tokens = group.stream().into_iter();
    match (tokens.next(), tokens.next()) {
        (Some(TokenTree::Ident(word)), Some(TokenTree::Punct(equals)))
            if word == "doc" && equals.as_char() == '=' =>
        {
            Some(Attribute::Doc(tokens.collect()))
        }
        _ => Some(Attribute::Other((hash.span(), group.span_close()))),
    }
}

/// Whether the tokens are one name or one number, possibly in further invisible groups.
fn is_word(tokens: TokenStream) -> bool {
    let mut tokens = tokens.into_iter();
    match (tokens.next(), tokens.next()) {
        (Some(TokenTree::Ident(_) | TokenTree::Literal(_)), None) => true,
        (Some(TokenTree::Group(group)), None) => {
            group.delimiter() == Delimiter::None && is_word(group.stream())
        }
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(source: &str, expected: &str) {
        let map = SourceMap::new(source.parse().expect("test source is made of Rust tokens"));
        assert_eq!(map.text.trim_end(), expected);
        for (range, _) in &map.entries {
            assert!(
                map.text.get(range.clone()).is_some(),
                "{range:?} splits a character"
            );
        }
    }

    #[test]
    fn tokens_become_text_with_blanks_between_words() {
        check(
            "lagrangian = m/2*dot(x)^2",
            "lagrangian = m / 2 * dot (x )^ 2",
        );
        check(
            "sum(i in 0..n-1, q[i+1])",
            "sum (i in 0 .. n - 1 , q [i + 1 ])",
        );
        check("solver(Fast, Mixed::<4>)", "solver (Fast , Mixed ::< 4 > )");
    }

    #[test]
    fn what_a_macro_substitutes_binds_like_parentheses() {
        let substituted = |source: &str| {
            let tokens = source.parse().expect("tokens");
            let group = proc_macro2::Group::new(Delimiter::None, tokens);
            SourceMap::new(TokenTree::Group(group).into()).text
        };
        assert_eq!(substituted("a + b"), "(a + b )");
        assert_eq!(substituted("8").trim_end(), "8");
        assert_eq!(substituted("n").trim_end(), "n");
    }

    #[test]
    fn the_path_of_the_crate_is_no_expression() {
        let tokens: TokenStream = "a :: b".parse().expect("tokens");
        let group = proc_macro2::Group::new(Delimiter::None, tokens);
        let map = SourceMap::new(quote!(crate = #group, lagrangian = #group));
        assert_eq!(
            map.text.trim_end(),
            "crate = a :: b , lagrangian = (a :: b )"
        );
        let path = map.path("a::b").map(|path| path.to_string());
        assert_eq!(path.as_deref(), Some("a :: b"));
    }

    #[test]
    fn attributes_of_arguments_are_no_part_of_the_text() {
        let map = SourceMap::new(quote!(
            coordinates(x),
            #[cfg(test)]
            output(a) = x
        ));
        assert_eq!(map.text.trim_end(), "coordinates (x ), output (a )= x");
        assert_eq!(map.attributes.len(), 1);
        let inside = SourceMap::new(quote!(coordinates(
            /// An angle.
            x,
            #[cfg(test)]
            y
        )));
        assert_eq!(inside.text.trim_end(), "coordinates (x , y )");
        assert_eq!((inside.docs.len(), inside.attributes.len()), (1, 1));
    }

    #[test]
    fn greek_and_raw_identifiers() {
        check("θ1 + r#type", "θ1 + type");
    }

    #[test]
    fn ranges_translate_to_tokens() {
        let map = SourceMap::new("a + bc".parse().expect("tokens"));
        let places: Vec<_> = map.entries.iter().map(|(range, _)| range.clone()).collect();
        assert_eq!(places, [0..1, 2..3, 4..6]);
        let _ = map.spans(4..6);
        let _ = map.spans(100..100); // behind the end: the last token, not a panic
    }
}
