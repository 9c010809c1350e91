//! Where the arguments of an attribute end: at commas outside all brackets, and where a comma was forgotten.

use std::ops::Range as Bytes;

use crate::diagnostic::{Bag, Kind, Span};
use crate::vocabulary::Argument;

/// The place between two arguments.
struct Boundary {
    /// Where the first one ends.
    end: usize,
    /// Where the next one begins: behind a comma or a semicolon, or right there.
    next: usize,
}

/// Splits the text of a whole attribute at its top-level commas, at semicolons there, and before an argument that follows without a comma.
///
/// A trailing comma adds no argument. The ranges are not trimmed.
pub fn split_arguments(text: &str) -> Vec<Bytes<usize>> {
    let mut ranges = Vec::new();
    let mut start = 0;
    for Boundary { end, next } in boundaries(text) {
        ranges.push(start..end);
        start = next;
    }
    if !text[start..].trim().is_empty() {
        ranges.push(start..text.len());
    }
    ranges
}

/// Reports semicolons for commas, and arguments that follow others without one.
pub(crate) fn missing_commas(text: &str, bag: &mut Bag) {
    for Boundary { end, next } in boundaries(text) {
        let found = match &text[end..next] {
            "," => continue,
            "" => word_at(text, next),
            semicolon => semicolon,
        };
        let span = Span::new(end, end + found.len());
        let found = found.to_owned();
        bag.push(span, Kind::MissingComma { found });
    }
}

fn boundaries(text: &str) -> Vec<Boundary> {
    let mut boundaries = Vec::new();
    let mut depth = 0usize;
    // Of the argument at hand: how many words outside of brackets it has so far, and whether it is a `let`, whose second word is a name.
    let (mut words, mut is_let) = (0usize, false);
    let mut after_operand = false;
    let mut before = ' ';
    for (at, letter) in text.char_indices() {
        let begins_word = is_word(letter) && !is_word(before);
        before = letter;
        match letter {
            '(' | '[' | '{' => {
                depth += 1;
                after_operand = false;
            }
            ')' | ']' | '}' => {
                depth = depth.saturating_sub(1);
                after_operand = true;
            }
            ',' | ';' if depth == 0 => {
                let next = at + letter.len_utf8();
                boundaries.push(Boundary { end: at, next });
                words = 0;
                after_operand = false;
            }
            _ if begins_word && depth == 0 => {
                let word = word_at(text, at);
                let in_head = words == 0 || (is_let && words == 1);
                // No formula has a word right behind an operand.
                if !in_head && after_operand && begins_argument(word, &text[at + word.len()..]) {
                    boundaries.push(Boundary { end: at, next: at });
                    words = 0;
                }
                if words == 0 {
                    is_let = word == Argument::Let.word();
                }
                words += 1;
                after_operand = true;
            }
            _ if is_word(letter) || letter.is_whitespace() => {}
            _ => after_operand = false,
        }
    }
    boundaries
}

/// Whether an argument begins with the word, by what stands behind it.
fn begins_argument(word: &str, rest: &str) -> bool {
    let rest = rest.trim_start();
    match Argument::of_word(word) {
        None => false,
        Some(Argument::Let) => rest.starts_with(is_word),
        Some(_) => match rest.strip_prefix('=') {
            // Not `==`.
            Some(value) => !value.trim_start().starts_with('='),
            None => rest.starts_with('('),
        },
    }
}

fn is_word(letter: char) -> bool {
    letter.is_alphanumeric() || letter == '_'
}

/// The word that begins at a place.
fn word_at(text: &str, at: usize) -> &str {
    let rest = &text[at..];
    let end = rest.find(|letter| !is_word(letter));
    &rest[..end.unwrap_or(rest.len())]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(text: &str, arguments: &[&str], found: &[&str]) {
        let ranges = split_arguments(text).into_iter();
        let parts: Vec<&str> = ranges.map(|range| text[range].trim()).collect();
        assert_eq!(parts, arguments);
        let mut bag = Bag::new();
        missing_commas(text, &mut bag);
        let reported: Vec<&str> = bag
            .iter()
            .map(|mistake| &text[mistake.span.start..mistake.span.end])
            .collect();
        assert_eq!(reported, found);
        // The mistakes have been read.
        let _ = bag.finish(());
    }

    #[test]
    fn forgotten_commas_are_found() {
        check(
            "coordinates(θ) let a = 2*θ lagrangian = a force(θ) = -θ solver(Fast, Mixed::<3>)",
            &[
                "coordinates(θ)",
                "let a = 2*θ",
                "lagrangian = a",
                "force(θ) = -θ",
                "solver(Fast, Mixed::<3>)",
            ],
            &["let", "lagrangian", "force", "solver"],
        );
        check(
            "let a = 1; let b = 2;",
            &["let a = 1", "let b = 2"],
            &[";", ";"],
        );
    }

    #[test]
    fn names_like_arguments_are_none() {
        for text in [
            "let force = 2*model + input",
            "lagrangian = output*(force + 2)",
            "output(model) = 2 * input(3)",
            "output(a) = 2 model",
            "constraint(a) = b event == c",
        ] {
            check(text, &[text], &[]);
        }
        check(
            "let output = 1, force(x) = (a; b)",
            &["let output = 1", "force(x) = (a; b)"],
            &[],
        );
    }
}
