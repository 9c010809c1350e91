//! Proofs that results never share a place, for ranges that are known only at run time.

use crate::expr::graph::SumRange;
use crate::expr::input::Affine;
use crate::expr::rewrite::substitute;
use crate::program::Place;

/// Results and the loops that they are written in.
type Written<'a> = (&'a [SumRange], &'a Place);

/// Whether it can be proved that no place of an array is written to twice.
pub(super) fn all_apart(all: &[Written]) -> bool {
    all.iter().all(new_on_every_turn)
        && all
            .iter()
            .enumerate()
            .all(|(at, one)| all[..at].iter().all(|other| apart(one, other)))
}

/// Whether the place is a different one on every turn: each variable appears alone in some index.
fn new_on_every_turn((nest, place): &Written) -> bool {
    nest.iter().all(|range| {
        // Two entries of a list may be equal.
        let shows = |index: &Affine| {
            index.depends_on(range.variable)
                && !index.holds_entry()
                && nest.iter().all(|other| {
                    other.variable == range.variable || !index.depends_on(other.variable)
                })
        };
        shows(&place.row) || shows(&place.column)
    })
}

/// Whether two results never share a place.
fn apart(one: &Written, other: &Written) -> bool {
    let indices = |(_, place): &Written| [place.row.clone(), place.column.clone()];
    let ([row, column], [other_row, other_column]) = (indices(one), indices(other));
    // The differences row − column are two different constants.
    let difference = |row: &Affine, column: &Affine| row.plus_scaled(column, -1);
    let both = difference(&row, &column).zip(difference(&other_row, &other_column));
    let off = both.and_then(|(a, b)| a.as_constant().zip(b.as_constant()));
    off.is_some_and(|(a, b)| a != b)
        || beyond(one.0, &row, other.0, &other_row)
        || beyond(other.0, &other_row, one.0, &row)
        || beyond(one.0, &column, other.0, &other_column)
        || beyond(other.0, &other_column, one.0, &column)
}

/// Whether the first index is larger than the second on all turns of both.
fn beyond(nest: &[SumRange], index: &Affine, other_nest: &[SumRange], other: &Affine) -> bool {
    let least = extreme(nest, index, false);
    let largest = extreme(other_nest, other, true);
    let difference = least.zip(largest).and_then(|(a, b)| a.plus_scaled(&b, -1));
    difference.is_some_and(|difference| difference.as_constant().is_some_and(|d| d > 0))
}

/// The largest or the least value of an index, inner loops first, as their bounds may depend on outer ones.
fn extreme(nest: &[SumRange], index: &Affine, largest: bool) -> Option<Affine> {
    let mut index = index.clone();
    if index.holds_entry() {
        return None;
    }
    for range in nest.iter().rev() {
        let factor = index.factor_of(range.variable);
        let end = range.end.plus_scaled(&Affine::constant(1), -1)?;
        let bound = if (factor > 0) == largest {
            &end
        } else {
            &range.start
        };
        index = substitute(&index, range.variable, bound);
    }
    Some(index)
}
