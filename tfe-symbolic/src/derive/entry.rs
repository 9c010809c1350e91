//! Entries of results: what is added where, on every turn of which loops.

use crate::expr::graph::{ExprId, SumRange};
use crate::program::Place;

/// What is added to one place, on every turn of a nest of loops.
#[derive(Clone, Debug)]
pub(crate) struct Entry {
    pub(crate) nest: Vec<SumRange>,
    pub(crate) place: Place,
    pub(crate) value: ExprId,
}
