//! How deep and how long an expression may be.

use std::ops::Range as Bytes;

use crate::diagnostic::Kind;

/// Brackets, powers and signs inside each other; the recursive parser needs stack for each.
pub const MAX_NESTING: usize = 100;

/// Operators along one path of the tree; dropping and printing a tree recurse along it.
pub const MAX_OPERATORS: usize = 2000;

/// Checks the limits in one linear pass over the text, so that neither pest nor the tree can exhaust the stack.
pub(super) fn within_limits(text: &str) -> Result<(), (Bytes<usize>, Kind)> {
    // For each open bracket: (tight operators in a row, operators).
    let mut levels = vec![(0usize, 0usize)];
    let mut operators = 0usize;
    let mut tight = 0usize;
    let mut after_operand = false;
    let mut before = ' ';
    for (at, letter) in text.char_indices() {
        let Some(level) = levels.last_mut() else {
            return Ok(());
        };
        let is_word = |c: char| c.is_alphanumeric() || matches!(c, '_' | '#');
        let begins = match letter {
            '(' | '[' => true,
            '0'..='9' => !is_word(before) && before != '.',
            _ => is_word(letter) && !is_word(before),
        };
        if begins && after_operand {
            // An index, a call, or a missing operator.
            level.1 += 1;
            operators += 1;
        }
        before = letter;
        match letter {
            '(' | '[' => {
                levels.push((0, 0));
                after_operand = false;
            }
            ')' | ']' => {
                if levels.len() > 1
                    && let Some((row, count)) = levels.pop()
                {
                    tight -= row;
                    operators -= count;
                }
                after_operand = true;
            }
            ',' => {
                tight -= level.0;
                operators -= level.1;
                *level = (0, 0);
                after_operand = false;
            }
            '^' | '-' if letter == '^' || !after_operand => {
                level.0 += 1;
                level.1 += 1;
                tight += 1;
                operators += 1;
                after_operand = false;
            }
            '+' | '-' | '*' | '/' => {
                tight -= level.0;
                level.0 = 0;
                level.1 += 1;
                operators += 1;
                after_operand = false;
            }
            _ if letter.is_whitespace() => {}
            '.' => {}
            '<' | '>' | '=' => after_operand = false,
            _ => after_operand = true,
        }
        let place = at..at + letter.len_utf8();
        if levels.len() + tight > MAX_NESTING {
            return Err((place, Kind::NestedTooDeep { limit: MAX_NESTING }));
        }
        if operators > MAX_OPERATORS {
            return Err((
                place,
                Kind::TooLong {
                    limit: MAX_OPERATORS,
                },
            ));
        }
    }
    Ok(())
}
