//! Entries of results: an expression, the place to which it is added, and the loops around it.

use crate::expr::graph::{ExprId, SumRange};
use crate::program::Place;

/// What is added to one place, on every turn of a nest of loops.
#[derive(Clone, Debug)]
pub(crate) struct Entry {
    pub(crate) nest: Vec<SumRange>,
    pub(crate) place: Place,
    pub(crate) value: ExprId,
}
