//! Mistakes in a declaration: where, what, and the remedy. All wording lives in `diagnostic/wording.rs` and
//! `diagnostic/remedies.rs`. May import `expr` and
//! `vocabulary`.

pub mod kind;
mod remedies;
mod role;
pub mod span;
mod wording;

use std::fmt::Write as _;

use crate::expr::sorting::sort_by_key;

pub use kind::Kind;
pub use role::Role;
pub use span::Span;

/// One mistake.
#[derive(Clone, Debug, PartialEq)]
pub struct Diagnostic {
    /// The smallest guilty piece of the attribute's text.
    pub span: Span,
    /// What is wrong with it.
    pub kind: Kind,
}

impl Diagnostic {
    /// What is wrong: lower case, names in backticks, no full stop.
    pub fn message(&self) -> String {
        self.kind.message()
    }

    /// The remedy, where there is one to name.
    pub fn help(&self) -> Option<String> {
        self.kind.help()
    }

    /// The field of the struct that is to blame, to be underlined instead of the attribute's text.
    pub fn field(&self) -> Option<&str> {
        self.kind.field()
    }

    /// The message with the line of `text` it speaks of, a caret under the guilty piece, and the
    /// remedy.
    pub fn render(&self, text: &str) -> String {
        let start = floor_boundary(text, self.span.start);
        let end = floor_boundary(text, self.span.end).max(start);
        let line_start = text[..start].rfind('\n').map_or(0, |at| at + 1);
        let line_end = text[start..].find('\n').map_or(text.len(), |at| start + at);
        let number = text[..start].matches('\n').count() + 1;
        let margin = " ".repeat(number.to_string().len());
        // Characters, not bytes: Greek letters take two bytes and one column.
        let before = text[line_start..start].chars().count();
        let under = text[start..end.min(line_end)].chars().count().max(1);
        let mut out = format!("error: {}\n", self.message());
        let _ = writeln!(out, "{number} | {}", &text[line_start..line_end]);
        let _ = writeln!(
            out,
            "{margin} | {}{}",
            " ".repeat(before),
            "^".repeat(under)
        );
        if let Some(help) = self.help() {
            let _ = writeln!(out, "{margin} = help: {help}");
        }
        out
    }
}

/// The largest character boundary of `text` that is not past `at`.
fn floor_boundary(text: &str, at: usize) -> usize {
    let mut at = at.min(text.len());
    while !text.is_char_boundary(at) {
        at -= 1;
    }
    at
}

/// Collects diagnostics, so that all mistakes are told in one go.
///
/// # Panics
/// On drop, if nobody called [`Bag::finish`]: a forgotten bag would swallow mistakes.
#[derive(Debug, Default)]
pub struct Bag {
    diagnostics: Vec<Diagnostic>,
    finished: bool,
}

impl Bag {
    /// An empty bag.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a mistake, unless the same one is there already (a `let` may be looked at twice).
    pub fn push(&mut self, span: Span, kind: Kind) {
        let diagnostic = Diagnostic { span, kind };
        if !self.diagnostics.contains(&diagnostic) {
            self.diagnostics.push(diagnostic);
        }
    }

    /// How many mistakes there are so far.
    pub fn len(&self) -> usize {
        self.diagnostics.len()
    }

    /// Whether there is no mistake so far.
    pub fn is_empty(&self) -> bool {
        self.diagnostics.is_empty()
    }

    /// The mistakes so far.
    pub fn iter(&self) -> impl Iterator<Item = &Diagnostic> {
        self.diagnostics.iter()
    }

    /// `value` if nothing went wrong.
    ///
    /// # Errors
    /// All mistakes, in the order of the text.
    pub fn finish<T>(mut self, value: T) -> Result<T, Vec<Diagnostic>> {
        self.finished = true;
        let mut diagnostics = std::mem::take(&mut self.diagnostics);
        sort_by_key(&mut diagnostics, |diagnostic| diagnostic.span);
        if diagnostics.is_empty() {
            Ok(value)
        } else {
            Err(diagnostics)
        }
    }
}

impl Drop for Bag {
    fn drop(&mut self) {
        if !self.finished && !std::thread::panicking() {
            debug_assert!(false, "a bag of diagnostics was dropped without `finish`");
        }
    }
}

/// The candidate nearest to `name`, if it is near enough to be what was meant.
///
/// Near means: equal but for case and Greek letters written as words, or at most a third of the letters of the longer name (at least
/// one) inserted, deleted, replaced or swapped with their neighbour.
pub fn nearest<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<String> {
    let length = name.chars().count();
    let limit = |other: &str| (length.max(other.chars().count()) / 3).max(1);
    candidates
        .into_iter()
        .filter(|candidate| *candidate != name)
        .map(|candidate| {
            let is_same = spelled(candidate) == spelled(name);
            (
                if is_same {
                    0
                } else {
                    distance(name, candidate)
                },
                candidate,
            )
        })
        // One letter for another is no hint when the name is one letter.
        .filter(|(distance, candidate)| {
            *distance <= limit(candidate) && (length > 1 || *distance == 0)
        })
        .min()
        .map(|(_, candidate)| candidate.to_owned())
}

/// A name in lower case, with Greek letters written as words: `theta1` for `θ1` and `Theta1`.
fn spelled(name: &str) -> String {
    let letters = name.chars().flat_map(char::to_lowercase);
    let word = |letter: char| {
        let (_, word) = GREEK.iter().find(|(greek, _)| greek.contains(letter))?;
        Some((*word).to_owned())
    };
    letters
        .map(|letter| word(letter).unwrap_or_else(|| letter.to_string()))
        .collect()
}

/// The Greek letters with their variants, and their names.
const GREEK: [(&str, &str); 24] = [
    ("α", "alpha"),
    ("β", "beta"),
    ("γ", "gamma"),
    ("δ", "delta"),
    ("εϵ", "epsilon"),
    ("ζ", "zeta"),
    ("η", "eta"),
    ("θϑ", "theta"),
    ("ι", "iota"),
    ("κ", "kappa"),
    ("λ", "lambda"),
    ("μµ", "mu"),
    ("ν", "nu"),
    ("ξ", "xi"),
    ("ο", "omicron"),
    ("π", "pi"),
    ("ρ", "rho"),
    ("σς", "sigma"),
    ("τ", "tau"),
    ("υ", "upsilon"),
    ("φϕ", "phi"),
    ("χ", "chi"),
    ("ψ", "psi"),
    ("ω", "omega"),
];

/// Edit distance with swaps of neighbours (optimal string alignment).
fn distance(a: &str, b: &str) -> usize {
    let a: Vec<char> = a.chars().collect();
    let b: Vec<char> = b.chars().collect();
    let mut before = vec![0; b.len() + 1];
    let mut last: Vec<usize> = (0..=b.len()).collect();
    for i in 1..=a.len() {
        let mut row = vec![i; b.len() + 1];
        for j in 1..=b.len() {
            let replaced = last[j - 1] + usize::from(a[i - 1] != b[j - 1]);
            row[j] = replaced.min(last[j] + 1).min(row[j - 1] + 1);
            if i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] {
                row[j] = row[j].min(before[j - 2] + 1);
            }
        }
        before = std::mem::replace(&mut last, row);
    }
    last[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nearest_name_tolerates_one_slip_in_three_letters() {
        let names = ["theta1", "theta2", "mass", "x"];
        assert_eq!(nearest("thata1", names).as_deref(), Some("theta1"));
        assert_eq!(nearest("amss", names).as_deref(), Some("mass"));
        assert_eq!(nearest("MASS", names).as_deref(), Some("mass"));
        assert_eq!(nearest("X", names).as_deref(), Some("x"));
        assert_eq!(
            nearest("lagrange", ["lagrangian", "let"]).as_deref(),
            Some("lagrangian")
        );
        assert_eq!(nearest("y", names), None);
        assert_eq!(nearest("velocity", names), None);
    }

    #[test]
    fn carets_count_letters_not_bytes() {
        let text = "let θ =\n θ + φψ";
        let start = text.find('φ').expect("the letter is there");
        let kind = Kind::UnknownSymbol {
            name: "φψ".into(),
            nearest: None,
        };
        let diagnostic = Diagnostic {
            span: Span::new(start, text.len()),
            kind,
        };
        let rendered = diagnostic.render(text);
        assert!(
            rendered.contains("2 |  θ + φψ\n  |      ^^\n"),
            "{rendered}"
        );
    }

    #[test]
    fn rendering_survives_spans_outside_the_text() {
        let diagnostic = Diagnostic {
            span: Span::new(1, 99),
            kind: Kind::NoCoordinates,
        };
        assert!(diagnostic.render("θ").contains("error: "));
        assert!(diagnostic.render("").contains("error: "));
    }

    #[test]
    fn bag_gives_mistakes_in_the_order_of_the_text_and_once() {
        let mut bag = Bag::new();
        bag.push(Span::new(5, 6), Kind::NoCoordinates);
        bag.push(Span::new(1, 2), Kind::DivisionByZero);
        bag.push(Span::new(5, 6), Kind::NoCoordinates);
        let found: Vec<usize> = bag
            .finish(())
            .unwrap_err()
            .iter()
            .map(|diagnostic| diagnostic.span.start)
            .collect();
        assert_eq!(found, [1, 5]);
    }
}
