//! Habits from Rust and from other notations at which the grammar stops: each has a message of its own.

use std::ops::Range as Bytes;

use crate::diagnostic::{Kind, nearest};
use crate::vocabulary::{PASSES, is_function};

/// The habit behind a syntax error at a place of the text of an argument, and what to underline.
pub(super) fn slip(argument: &str, text: &str, at: usize) -> Option<(Bytes<usize>, Kind)> {
    let at = at + (text[at..].len() - text[at..].trim_start().len());
    condition(text, at).or_else(|| match text[at..].chars().next()? {
        '=' => equals_sign(argument, text, at),
        '.' => point(text, at),
        ':' if !matches!(argument, "solver" | "crate") => path(text, at),
        '|' => Some((at..at + 1, Kind::Bars)),
        ',' | ')' if argument == "model" => bare_pass(text, at),
        _ => None,
    })
}

/// `model(Linear, linearised)`: a word that is no pass, without the parentheses of one.
fn bare_pass(text: &str, at: usize) -> Option<(Bytes<usize>, Kind)> {
    let word = words(&text[..at]).last()?;
    let before = text[..word.start].trim_end();
    let name = &text[word.clone()];
    if !before.ends_with(',') || !text[word.end..at].trim().is_empty() || PASSES.contains(&name) {
        return None;
    }
    let kind = Kind::UnknownPass {
        name: name.to_owned(),
        nearest: nearest(name, PASSES.iter().copied()),
    };
    Some((word, kind))
}

/// The text of tokens without the blanks inside brackets, between a name and its brackets, and before commas.
pub(super) fn tidy(text: &str) -> String {
    let mut tidy = String::new();
    for letter in text.chars() {
        let end = tidy.trim_end().len();
        let follows_name = tidy[..end].ends_with(|last: char| last.is_alphanumeric());
        if matches!(letter, ')' | ']' | ',') || (matches!(letter, '(' | '[') && follows_name) {
            tidy.truncate(end);
        }
        if !(letter.is_whitespace() && tidy.ends_with(['(', '['])) {
            tidy.push(letter);
        }
    }
    tidy
}

/// `if a < b { x } else { y }`: the grammar reads `if` as a name and stops further on.
fn condition(text: &str, at: usize) -> Option<(Bytes<usize>, Kind)> {
    let word_before = words(&text[..at]).find_map(|word| match &text[word.clone()] {
        "if" => Some((word, "if")),
        "match" => Some((word, "match")),
        _ => None,
    });
    let word_here = words(&text[at..]).next().filter(|word| word.start == 0);
    let (place, word) = word_before.or_else(|| match &text[at..][word_here?] {
        "if" => Some((at..at + "if".len(), "if")),
        "match" => Some((at..at + "match".len(), "match")),
        _ => None,
    })?;
    Some((place, Kind::Condition { word }))
}

/// `x^2 + y^2 = l^2`, `a == b`
fn equals_sign(argument: &str, text: &str, at: usize) -> Option<(Bytes<usize>, Kind)> {
    // The first `=` separates the name of the argument from its formula.
    let first = text.find('=').filter(|first| *first < at)?;
    let rest = text[at + 1..].trim_start();
    let (is_doubled, right) = match rest.strip_prefix('=') {
        Some(right) => (true, right),
        None => (false, rest),
    };
    let (left, right) = (text[first + 1..at].trim(), right.trim().to_owned());
    let is_equation = argument == "constraint" && is_balanced(left) && !right.contains('=');
    if is_doubled && !is_equation {
        // A comparison inside `select`.
        return None;
    }
    let left = is_equation.then(|| left.to_owned());
    Some((at..at + 1, Kind::EqualsSign { left, right }))
}

/// `link.m`, `x.sin()`, `dot(x).powi(2)`
fn point(text: &str, at: usize) -> Option<(Bytes<usize>, Kind)> {
    let object = operand_before(text, at)?;
    let is_word = is_name(&text[object.clone()]);
    let blanks = text[at + 1..].len() - text[at + 1..].trim_start().len();
    let start = at + 1 + blanks;
    let field = words(&text[start..])
        .next()
        .filter(|word| word.start == 0)?;
    let end = start + field.end;
    let (name, field) = (tidy(&text[object.clone()]), text[start..end].to_owned());
    let called = text[end..].trim_start().starts_with('(');
    let is_method = is_function(&field) || matches!(field.as_str(), "powi" | "powf");
    let kind = if called && is_method {
        Kind::MethodCall {
            object: name,
            method: field,
        }
    } else if !is_word {
        return None;
    } else {
        Kind::FieldAccess {
            object: name,
            field,
        }
    };
    Some((object.start..end, kind))
}

/// The name, call, element or group that ends at a place, except for blanks.
fn operand_before(text: &str, at: usize) -> Option<Bytes<usize>> {
    let end = text[..at].trim_end().len();
    let mut start = end;
    if text[..end].ends_with([')', ']']) {
        let mut depth = 0i64;
        let opening = text[..end].char_indices().rev().find(|(_, letter)| {
            match letter {
                ')' | ']' => depth += 1,
                '(' | '[' => depth -= 1,
                _ => {}
            }
            depth == 0
        });
        start = opening?.0;
    }
    let before = text[..start].trim_end().len();
    match words(&text[..before]).last() {
        Some(word) if word.end == before => Some(word.start..end),
        _ if start < end => Some(start..end),
        _ => None,
    }
}

fn is_name(text: &str) -> bool {
    words(text)
        .next()
        .is_some_and(|word| word == (0..text.len()))
}

/// `std::f64::consts::PI`
fn path(text: &str, at: usize) -> Option<(Bytes<usize>, Kind)> {
    let first = words(&text[..at]).last()?;
    if !text[first.end..at].trim().is_empty() {
        return None;
    }
    let (mut path, mut end) = (text[first.clone()].to_owned(), at);
    while let Some(word) = behind_colons(&text[end..]) {
        path += "::";
        path += &text[end..][word.clone()];
        end += word.end;
    }
    (end > at).then_some((first.start..end, Kind::Path { path }))
}

/// The place of the word behind `::`.
fn behind_colons(text: &str) -> Option<Bytes<usize>> {
    let rest = text.trim_start().strip_prefix(':')?;
    let rest = rest.trim_start().strip_prefix(':')?.trim_start();
    let start = text.len() - rest.len();
    let word = words(rest).next().filter(|word| word.start == 0)?;
    Some(start..start + word.end)
}

/// The places of names, in order.
fn words(text: &str) -> impl Iterator<Item = Bytes<usize>> {
    let is_word = |letter: char| letter.is_alphanumeric() || letter == '_';
    let mut from = 0;
    std::iter::from_fn(move || {
        loop {
            let start = from + text[from..].find(is_word)?;
            let length = text[start..].find(|letter| !is_word(letter));
            from = length.map_or(text.len(), |length| start + length);
            if !text[start..].starts_with(|letter: char| letter.is_ascii_digit()) {
                return Some(start..from);
            }
        }
    })
}

/// Whether brackets are closed in the text.
fn is_balanced(text: &str) -> bool {
    let mut depth = 0i64;
    for letter in text.chars() {
        match letter {
            '(' | '[' => depth += 1,
            ')' | ']' => depth -= 1,
            _ => {}
        }
        if depth < 0 {
            return false;
        }
    }
    depth == 0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(text: &str, underlined: &str, expected: &str) {
        let at = text.find('§').expect("the place of the error");
        let text = text.replace('§', "");
        let argument = words(&text).next().map_or("", |word| &text[word]);
        let (place, kind) = slip(argument, &text, at).expect("a known habit");
        assert_eq!((&text[place], kind.name()), (underlined, expected));
    }

    #[test]
    fn habits_are_recognised() {
        check("output(a) = if x § < 0 {1} else {2}", "if", "Condition");
        check("output(a) = §match x {}", "match", "Condition");
        check("constraint(rod) = x^2 §= l^2", "=", "EqualsSign");
        check("output(a) = link §. m", "link . m", "FieldAccess");
        check("output(a) = x§.sin()", "x.sin", "MethodCall");
        check("output(a) = x§.powi(2)", "x.powi", "MethodCall");
        check("output(a) = x§.powi", "x.powi", "FieldAccess");
        check(
            "output(a) = 2*dot( x )§.powi(2)",
            "dot( x ).powi",
            "MethodCall",
        );
        check("output(a) = q[0]§.sin()", "q[0].sin", "MethodCall");
        check(
            "output(a) = 2*(x + (y))§.sqrt()",
            "(x + (y)).sqrt",
            "MethodCall",
        );
        check("model(Linear, linearised§)", "linearised", "UnknownPass");
        check("output(a) = §|x| x^2", "|", "Bars");
        check(
            "output(a) = 2*std §:: f64::consts::PI*t",
            "std :: f64::consts::PI",
            "Path",
        );
        check("output(a) = f64§::sin(x)", "f64::sin", "Path");
    }

    #[test]
    fn texts_of_tokens_are_tidied() {
        assert_eq!(tidy("( x + q [ i ] , 1 )"), "(x + q[i], 1)");
        assert_eq!(tidy("2 * (dot ( x ) + 1)"), "2 * (dot(x) + 1)");
    }

    #[test]
    fn other_places_are_left_to_the_grammar() {
        for text in [
            "output(a) = x + §)",
            "output(a) = 2 §.5",
            "output(a) = (x + y)§.x",
            "model(Linear, truncated§)",
            "let a§: f64 = 2",
            "§= 3",
            "constraint(a) = select(x §== y, 1, 2)",
        ] {
            let at = text.find('§').expect("the place of the error");
            assert_eq!(
                slip("constraint", &text.replace('§', ""), at),
                None,
                "{text}"
            );
        }
    }
}
