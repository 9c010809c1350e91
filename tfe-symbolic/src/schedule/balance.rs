//! Forces between pairs that depend on differences only: the total force on one body is the opposite of that on all
//! others.
//!
//! ```text
//! Σ over pairs f(x_i − x_j):        ∂²/∂x_k∂x_k = −Σ ∂²/∂x_k∂x_l over l ≠ k
//! ```
//!
//! The entries off the diagonals of the blocks are written once for each pair. Those on the diagonals would be
//! accumulated in memory, for both bodies of each pair; instead they are computed from the others after the loops.

use crate::derive::entry::Entry;
use crate::expr::graph::{ExprId, Graph, SumRange};
use crate::expr::input::{Affine, IndexSymbol, LoopVariable};
use crate::expr::ordered::SortedMap;
use crate::program::{Array, Place};

/// Entries (row + k, column + k) for k below the length, and (column + k, row + k), that make the sums over l of (row + l, column + k) vanish.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Balance {
    /// The first of the entries.
    pub(crate) first: Place,
    /// How many.
    pub(crate) length: Affine,
}

/// Removes the entries that follow from others. `entries` must be all entries of a kernel, each symmetric pair twice.
pub(crate) fn balances(graph: &mut Graph, entries: &mut Vec<Entry>) -> Vec<Balance> {
    let is_qq = |entry: &&Entry| entry.place.array == Array::QQ;
    let nests: Vec<&Entry> = entries.iter().filter(is_qq).collect();
    let Some(nest) = nests.iter().find_map(|entry| Pairs::of(&entry.nest)) else {
        return Vec::new();
    };
    let Some(found) = nest.balances(graph, &nests) else {
        return Vec::new();
    };
    entries.retain(|entry| {
        let own = entry.place.array == Array::QQ && entry.nest == nest.nest;
        !own || nest
            .offsets(&entry.place)
            .is_none_or(|(row, column)| row.of != column.of)
    });
    found
}

/// Two loops that run over all pairs of some bodies, each once.
struct Pairs {
    nest: Vec<SumRange>,
    variables: [LoopVariable; 2],
    start: Affine,
    length: Affine,
}

/// An index i + offset or j + offset.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Offset {
    /// Of the outer or of the inner variable.
    of: usize,
    offset: Affine,
}

fn minus(a: &Affine, b: &Affine) -> Option<Affine> {
    a.plus_scaled(b, -1)
}

fn difference(a: &Affine, b: &Affine) -> Option<i64> {
    minus(a, b)?.as_constant()
}

impl Pairs {
    fn of(nest: &[SumRange]) -> Option<Self> {
        let [outer, inner] = nest else { return None };
        let own = Affine::symbol(IndexSymbol::Loop(outer.variable));
        let next = own.plus_scaled(&Affine::constant(1), 1)?;
        // The inner index below the outer one, or above it; the outer one may leave out the body that has no partner there.
        let (start, end, spare) = if inner.end == own {
            let spare = difference(&outer.start, &inner.start)?;
            (&inner.start, &outer.end, spare)
        } else if inner.start == next {
            let spare = difference(&inner.end, &outer.end)?;
            (&outer.start, &inner.end, spare)
        } else {
            return None;
        };
        let length = minus(end, start)?;
        let free = |affine: &Affine| nest.iter().all(|range| !affine.depends_on(range.variable));
        ((0..=1).contains(&spare) && free(start) && free(&length)).then(|| Self {
            nest: nest.to_vec(),
            variables: [outer.variable, inner.variable],
            start: start.clone(),
            length,
        })
    }

    /// The row and the column of a place, where both are a variable and an offset.
    fn offsets(&self, place: &Place) -> Option<(Offset, Offset)> {
        let offset = |index: &Affine| {
            let factors = self.variables.map(|variable| index.factor_of(variable));
            let of = match factors {
                [1, 0] => 0,
                [0, 1] => 1,
                _ => return None,
            };
            let own = Affine::symbol(IndexSymbol::Loop(self.variables[of]));
            // The rest may hold entries of lists.
            let varies = |offset: &Affine| self.variables.iter().any(|x| offset.depends_on(*x));
            minus(index, &own)
                .filter(|offset| !varies(offset))
                .map(|offset| Offset { of, offset })
        };
        offset(&place.row).zip(offset(&place.column))
    }

    /// The diagonals of all blocks of the pairs; `None` if one of them does not follow, or is written to by others.
    fn balances(&self, graph: &mut Graph, all: &[&Entry]) -> Option<Vec<Balance>> {
        let mut values: SortedMap<(Offset, Offset), ExprId> = SortedMap::new();
        let mut others = Vec::new();
        for entry in all {
            if entry.nest == self.nest {
                let place = self.offsets(&entry.place)?;
                if values.insert(place, entry.value).is_some() {
                    return None;
                }
            } else {
                others.push(&entry.place);
            }
        }
        let mut found = Vec::new();
        for ((row, column), value) in &values {
            let at = |of: usize, offset: &Offset| Offset {
                of,
                offset: offset.offset.clone(),
            };
            let opposite = graph.negate(*value);
            let [apart, own] = if row.of == column.of {
                [opposite, *value]
            } else {
                [*value, opposite]
            };
            // All four of a block, and of the block on the other side of the diagonal.
            for (of, of_other, expected) in [(0, 0, own), (1, 1, own), (0, 1, apart), (1, 0, apart)]
            {
                for (a, b) in [(row, column), (column, row)] {
                    let known = values.get(&(at(of, a), at(of_other, b)));
                    known.filter(|known| **known == expected)?;
                }
            }
            if row.of == 0 && column.of == 0 && row.offset <= column.offset {
                let index = |offset: &Offset| offset.offset.plus_scaled(&self.start, 1);
                found.push(Balance {
                    first: Place {
                        array: Array::QQ,
                        row: index(row)?,
                        column: index(column)?,
                    },
                    length: self.length.clone(),
                });
            }
        }
        // If other results are added to the blocks, the sums do not vanish.
        (others.is_empty() && self.blocks_are_apart(&found)).then_some(found)
    }

    fn blocks_are_apart(&self, found: &[Balance]) -> bool {
        let firsts = || {
            found
                .iter()
                .flat_map(|balance| [&balance.first.row, &balance.first.column])
        };
        firsts().all(|a| {
            firsts().all(|b| {
                let beyond = |a: &Affine, b: &Affine| {
                    let gap = minus(a, b).and_then(|gap| difference(&gap, &self.length));
                    gap.is_some_and(|gap| gap >= 0)
                };
                a == b || beyond(a, b) || beyond(b, a)
            })
        })
    }
}
