//! pest's errors in words of the language: what could have stood there, and what stands there.

use crate::expr::sorting::sort_by_key;
use crate::syntax::grammar::Rule;

/// What pest would have accepted, in words of the language.
pub(super) fn wanted(rules: &[Rule]) -> String {
    let operator = rules.contains(&Rule::add);
    let mut words: Vec<&str> = Vec::new();
    for rule in rules {
        let word = match rule {
            Rule::add
            | Rule::subtract
            | Rule::double_star
            | Rule::multiply
            | Rule::divide
            | Rule::power => "an operator",
            // After an operand an expression could only follow by mistake.
            _ if operator && starts_expression(*rule) => continue,
            Rule::open_index | Rule::index if operator => continue,
            Rule::name | Rule::array => "a name",
            // An expression could begin with a number, too.
            Rule::identifier if !rules.contains(&Rule::number) => "a name",
            _ if starts_expression(*rule) => "an expression",
            Rule::word_in => "`in`",
            Rule::dots => "`..`",
            Rule::comparison => "a comparison `<`, `<=`, `>` or `>=`",
            Rule::equals => "`=`",
            Rule::comma => "`,`",
            Rule::dot | Rule::method => "`.`",
            Rule::open => "`(`",
            Rule::close => "`)`",
            Rule::open_index => "`[`",
            Rule::close_index => "`]`",
            Rule::turbofish => "`::<`",
            Rule::close_angle => "`>`",
            Rule::integer | Rule::digits => "an integer",
            Rule::range => "a range such as `i in 0..3`",
            Rule::path => "a path",
            Rule::element => "an element such as `Mixed::<4>`",
            Rule::pass => "a pass such as `truncated(2)`",
            Rule::EOI => "the end of the argument",
            _ => continue,
        };
        if !words.contains(&word) {
            words.push(word);
        }
    }
    if words.contains(&"an expression") {
        // A parenthesis is one way to begin it.
        words.retain(|word| *word != "`(`");
    }
    sort_by_key(&mut words, |word| word.starts_with('`'));
    match words.pop() {
        None => "something else".into(),
        Some(last) if words.is_empty() => last.into(),
        Some(last) => format!("{} or {last}", words.join(", ")),
    }
}

fn starts_expression(rule: Rule) -> bool {
    matches!(
        rule,
        Rule::expression
            | Rule::sign
            | Rule::sum
            | Rule::select
            | Rule::call
            | Rule::number
            | Rule::variable
            | Rule::identifier
            | Rule::missing
            | Rule::group
            | Rule::vector
            | Rule::word_sum
            | Rule::word_select
    )
}

/// The token at a place, in words.
pub(super) struct Found {
    pub(super) start: usize,
    pub(super) end: usize,
    pub(super) words: String,
}

pub(super) fn found_at(text: &str, at: usize) -> Found {
    let start = at + (text[at..].len() - text[at..].trim_start().len());
    let Some(first) = text[start..].chars().next() else {
        // Point behind the last token, not behind the blanks after it.
        let end = text.trim_end().len();
        return Found {
            start: end,
            end,
            words: "the end of the argument".into(),
        };
    };
    let is_word = |c: char| c.is_alphanumeric() || c == '_';
    let length = if is_word(first) {
        text[start..]
            .find(|c| !is_word(c))
            .unwrap_or(text.len() - start)
    } else {
        first.len_utf8()
    };
    Found {
        start,
        end: start + length,
        words: format!("`{}`", &text[start..start + length]),
    }
}
