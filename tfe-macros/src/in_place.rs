//! Results that are written where they belong, without a temporary.

use tfe_symbolic::expr::ordered::SortedMap;
use tfe_symbolic::program::{Operand, Statement, Temporary};

/// Whether the first statement computes what the next one writes, and nothing else needs that.
pub(crate) fn is_written_in_place(
    statements: &[Statement],
    reads: &SortedMap<Temporary, usize>,
) -> bool {
    matches!(statements, [Statement::Let { target, .. }, next, ..]
        if reads.get(target) == Some(&1) && written(next) == Some(&Operand::Temporary(*target)))
}

/// What a store, an accumulation or an assignment writes.
fn written(statement: &Statement) -> Option<&Operand> {
    match statement {
        Statement::Store { value, .. }
        | Statement::Accumulate { value, .. }
        | Statement::Assign { value, .. } => Some(value),
        _ => None,
    }
}
