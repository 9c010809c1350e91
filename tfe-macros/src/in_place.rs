//! Results that are written directly to their places, without a temporary.

use tfe_symbolic::expr::ordered::SortedMap;
use tfe_symbolic::program::{Operand, Statement, Temporary};

/// Whether the first statement computes a value that the next one writes, and that nothing else needs.
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
