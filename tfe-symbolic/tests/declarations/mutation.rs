//! Small changes of declarations: tokens and arguments left out, repeated, exchanged, replaced.

use tfe_symbolic::syntax::context::{FieldKind, Length};

use super::random::Random;
use super::{Declaration, names};

/// Functions of one argument.
pub const ONE: &[&str] = &[
    "sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh", "asinh", "acosh", "atanh",
    "exp", "ln", "sqrt", "abs", "sign",
];
/// Functions of two arguments.
pub const TWO: &[&str] = &["atan2", "min", "max", "hypot"];
const OPERATORS: &[&str] = &["+", "-", "*", "/", "^"];
const COMPARISONS: &[&str] = &["<", ">", "<=", ">="];
const ELEMENTS: &[&str] = &["Primal", "Mixed", "ThreeField", "EnergyConserving", "Radau"];

/// Words, numbers and marks; blanks between them are lost.
pub fn tokens(text: &str) -> Vec<String> {
    let mut tokens: Vec<String> = Vec::new();
    let letters: Vec<char> = text.chars().collect();
    let is_word = |letter: char| letter.is_alphanumeric() || letter == '_' || !letter.is_ascii();
    let mut at = 0;
    while at < letters.len() {
        let start = at;
        let letter = letters[at];
        at += 1;
        if letter.is_whitespace() {
            continue;
        }
        if letter.is_ascii_digit() {
            while at < letters.len()
                && (is_word(letters[at])
                    || (letters[at] == '.' && letters.get(at + 1) != Some(&'.'))
                    || (matches!(letters[at], '+' | '-') && matches!(letters[at - 1], 'e' | 'E')))
            {
                at += 1;
            }
        } else if is_word(letter) {
            while at < letters.len() && (is_word(letters[at]) || letters[at] == '#') {
                at += 1;
            }
        } else {
            let pair: String = letters[start..(start + 2).min(letters.len())]
                .iter()
                .collect();
            if ["..", "::", "<=", ">="].contains(&pair.as_str()) {
                at += 1;
            }
        }
        tokens.push(letters[start..at].iter().collect());
    }
    tokens
}

/// Tokens as text.
pub fn joined(tokens: &[String]) -> String {
    tokens.join(" ")
}

/// A declaration of the corpus with one to four changes; those at its beginning are taken more often.
pub fn mutated(random: &mut Random, corpus: &[Declaration]) -> Declaration {
    let at = (0..8).map(|_| random.below(corpus.len())).min();
    let mut declaration = corpus[at.unwrap_or(0)].clone();
    let changes = [1, 1, 2, 2, 2, 3, 4];
    for _ in 0..*random.pick(&changes) {
        change(random, &mut declaration, corpus);
    }
    declaration
}

/// One small change.
pub fn change(random: &mut Random, declaration: &mut Declaration, corpus: &[Declaration]) {
    let other = random.pick(corpus);
    if random.per_mille(60) {
        change_field(random, declaration, other);
        return;
    }
    if random.per_mille(170) {
        change_argument(random, declaration, other);
        return;
    }
    let mut words = tokens(&declaration.arguments);
    let donor = tokens(&other.arguments);
    if words.is_empty() || donor.is_empty() {
        return;
    }
    let at = random.below(words.len());
    match random.weighted(&[4, 4, 4, 4, 66, 8, 5, 5]) {
        0 => {
            words.remove(at);
        }
        1 => words.insert(at, words[at].clone()),
        2 => {
            let next = (at + 1) % words.len();
            words.swap(at, next);
        }
        3 => words[at] = random.pick(&donor).clone(),
        4 => words[at] = like(random, &words, at),
        5 => exchange_groups(random, &mut words, &donor),
        6 => wrap(random, &mut words),
        _ => {
            // Twice the same change in one place, where numbers and names belong together.
            let with = like(random, &words, at);
            let word = words[at].clone();
            for one in words.iter_mut().filter(|one| **one == word) {
                one.clone_from(&with);
            }
        }
    }
    declaration.arguments = joined(&words);
}

/// A word of the same kind as the one there.
fn like(random: &mut Random, words: &[String], at: usize) -> String {
    let word = words[at].as_str();
    let lists = [ONE, TWO, OPERATORS, COMPARISONS, ELEMENTS];
    if let Some(list) = lists.into_iter().find(|list| list.contains(&word)) {
        return (*random.pick(list)).to_owned();
    }
    let is_number = |word: &str| word.starts_with(|letter: char| letter.is_ascii_digit());
    if is_number(word) {
        return match words.get(at.wrapping_sub(1)).map(String::as_str) {
            Some("^") => names::exponent(random),
            _ => names::number(random),
        };
    }
    if word.starts_with(|letter: char| letter.is_alphabetic()) {
        let is_call = |at: usize| {
            words
                .get(at + 1)
                .is_some_and(|next| next == "(" || next == "=")
        };
        let is_name = |at: &usize| {
            words[*at].starts_with(|letter: char| letter.is_alphabetic()) && !is_call(*at)
        };
        let others: Vec<usize> = (0..words.len()).filter(is_name).collect();
        if !is_call(at) && !others.is_empty() && !random.per_mille(50) {
            return words[*random.pick(&others)].clone();
        }
        if random.per_mille(100) {
            return names::name(random, names::PARAMETERS);
        }
    }
    word.to_owned()
}

/// The brackets that open, each with the one that closes it.
fn groups(words: &[String]) -> Vec<(usize, usize)> {
    let (mut open, mut found) = (Vec::new(), Vec::new());
    for (at, word) in words.iter().enumerate() {
        match word.as_str() {
            "(" | "[" => open.push(at),
            ")" | "]" => found.extend(open.pop().map(|start| (start, at))),
            _ => {}
        }
    }
    found
}

/// What stands between two brackets gives way to what stands between others.
fn exchange_groups(random: &mut Random, words: &mut Vec<String>, donor: &[String]) {
    let own = random.per_mille(600);
    let source = if own { words.clone() } else { donor.to_vec() };
    let (from, to) = (groups(&source), groups(words));
    if from.is_empty() || to.is_empty() {
        return;
    }
    let (start, end) = *random.pick(&from);
    let (first, last) = *random.pick(&to);
    words.splice(first..=last, source[start..=end].iter().cloned());
}

/// A group becomes the argument of a function, a base, a vector or a sum.
fn wrap(random: &mut Random, words: &mut Vec<String>) {
    let all = groups(words);
    if all.is_empty() {
        return;
    }
    let (start, end) = *random.pick(&all);
    if words[start] == "[" {
        return;
    }
    let (before, after) = match random.below(6) {
        0 => (vec![*random.pick(ONE)], vec![]),
        1 => (vec![], vec!["^", "2"]),
        2 => (vec!["("], vec!["*", "2", ")"]),
        3 => (vec!["dot", "("], vec![")"]),
        4 => (vec!["(", "-"], vec![")"]),
        _ => (vec!["sum", "(", "ii", "in", "0", "..", "3", ","], vec![")"]),
    };
    let owned = |words: Vec<&str>| words.into_iter().map(str::to_owned).collect::<Vec<_>>();
    words.splice(end + 1..end + 1, owned(after));
    words.splice(start..start, owned(before));
}

/// The arguments of a declaration.
pub fn arguments(text: &str) -> Vec<String> {
    let ranges = tfe_symbolic::syntax::parse::split_arguments(text);
    ranges
        .into_iter()
        .map(|range| text[range].trim().to_owned())
        .collect()
}

fn change_argument(random: &mut Random, declaration: &mut Declaration, other: &Declaration) {
    let mut own = arguments(&declaration.arguments);
    let donor = arguments(&other.arguments);
    if own.is_empty() || donor.is_empty() {
        return;
    }
    let at = random.below(own.len());
    match random.weighted(&[2, 2, 6, 2, 2, 8]) {
        0 => {
            own.remove(at);
        }
        1 => own.insert(at, own[at].clone()),
        2 => random.shuffle(&mut own),
        3 => own.insert(at, random.pick(&donor).clone()),
        4 => own[at] = random.pick(&donor).clone(),
        _ => own.insert(at, added(random, &own)),
    }
    declaration.arguments = own.join(", ");
}

/// An argument that goes with most declarations.
fn added(random: &mut Random, own: &[String]) -> String {
    let words = tokens(&own.join(","));
    let names: Vec<&String> = words
        .iter()
        .filter(|word| word.starts_with(|letter: char| letter.is_alphabetic()))
        .collect();
    let name = match names.is_empty() {
        true => "x".to_owned(),
        false => (*random.pick(&names)).clone(),
    };
    let element = *random.pick(ELEMENTS);
    match random.below(12) {
        0 => format!("solver(Added, {element}::<{}>)", random.below(14)),
        1 => format!("solver(Added, {element}::<{}>.reduced())", random.below(6)),
        2 => format!(
            "solver(Added, {element}::<3>.quadrature({}))",
            random.below(30)
        ),
        3 => format!("model(Made, truncated({}))", random.below(7)),
        4 => format!("model(Made, frozen({name} = {}))", names::number(random)),
        5 => format!("model(Made, routh({name}))"),
        6 => format!("model(Made, elastic({name} = stiffness), truncated(2))"),
        7 => format!("model(Made, rigid(stiff = {name}))"),
        8 => format!("output(added) = {name}"),
        9 => format!("force({name}) = cos(t)"),
        10 => format!("constraint(added) = {name} - 1"),
        _ => format!("sensitivity({name})"),
    }
}

fn change_field(random: &mut Random, declaration: &mut Declaration, other: &Declaration) {
    let fields = &mut declaration.context.fields;
    if fields.is_empty() {
        return;
    }
    let at = random.below(fields.len());
    match random.below(4) {
        0 => {
            fields.remove(at);
        }
        1 => fields.extend(other.context.fields.first().cloned()),
        2 => fields[at].name = names::name(random, names::PARAMETERS),
        _ => {
            fields[at].kind = match random.below(7) {
                0 => FieldKind::Scalar,
                1 => FieldKind::Array(Length::Literal(random.below(5))),
                2 => FieldKind::Array(Length::ConstParameter("N".to_owned())),
                3 => FieldKind::Vector,
                4 => FieldKind::Indices,
                5 => FieldKind::Length,
                _ => FieldKind::Other("String".to_owned()),
            };
        }
    }
}
