//! Entries of results: what is added where, on every turn of which loops; and their order in a program.

use std::collections::BTreeMap;

use crate::constant::Constant;
use crate::graph::{ExprId, Graph, SumRange};
use crate::input::Affine;
use crate::program::{Output, Request};
use crate::schedule::{Block, Sink, Target};

/// The arrays of results.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Array {
    Value,
    ByZ,
    ByQ,
    Force,
    ZZ,
    ZQ,
    QQ,
    ForceZ,
    ForceQ,
    Observable(usize),
    Phi(usize),
    Row(usize),
    Drift(usize),
    PsiQ(usize),
    RowRate(usize),
    Bend,
    RateQ,
    RateV,
}

/// One entry of an array of results; vectors and numbers leave indices unused.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Place {
    pub(crate) array: Array,
    pub(crate) row: Affine,
    pub(crate) column: Affine,
}

impl Array {
    /// Whether a kernel computes it.
    pub(crate) fn is_wanted(self, request: Request) -> bool {
        match self {
            Self::Value => request.value,
            Self::ByZ | Self::ByQ | Self::Force => request.first,
            Self::ZZ => request.mass || request.second,
            Self::ZQ | Self::QQ | Self::ForceZ | Self::ForceQ => request.second,
            Self::Observable(_) => request.observables,
            Self::Phi(_) => request.constraint_values,
            Self::Row(_) | Self::Drift(_) => request.constraint_rows,
            Self::PsiQ(_) | Self::RowRate(_) | Self::Bend | Self::RateQ | Self::RateV => {
                request.constraint_second
            }
        }
    }
}

impl Place {
    /// A number.
    pub(crate) fn scalar(array: Array) -> Self {
        Self::vector(array, Affine::default())
    }

    /// An entry of a vector.
    pub(crate) fn vector(array: Array, row: Affine) -> Self {
        Self {
            array,
            row,
            column: Affine::default(),
        }
    }

    fn output(&self) -> Output {
        let (row, column) = (self.row.clone(), self.column.clone());
        match self.array {
            Array::Value => Output::Value,
            Array::ByZ => Output::ByZ(row),
            Array::ByQ => Output::ByQ(row),
            Array::Force => Output::Force(row),
            Array::ZZ => Output::ZZ(row, column),
            Array::ZQ => Output::ZQ(row, column),
            Array::QQ => Output::QQ(row, column),
            Array::ForceZ => Output::ForceZ(row, column),
            Array::ForceQ => Output::ForceQ(row, column),
            Array::Observable(number) => Output::Observable(number),
            Array::Phi(number) => Output::Phi(number),
            Array::Row(number) => Output::Row(number, row),
            Array::Drift(number) => Output::Drift(number),
            Array::PsiQ(number) => Output::PsiQ(number, row),
            Array::RowRate(number) => Output::RowRate(number, row),
            Array::Bend => Output::Bend(row, column),
            Array::RateQ => Output::RateQ(row, column),
            Array::RateV => Output::RateV(row, column),
        }
    }

    /// Whether it is the same entry in every run and on every turn of a loop.
    fn is_literal(&self) -> bool {
        self.row.terms.is_empty() && self.column.terms.is_empty()
    }
}

/// What is added to one place, on every turn of a nest of loops.
#[derive(Clone, Debug)]
pub(crate) struct Entry {
    pub(crate) nest: Vec<SumRange>,
    pub(crate) place: Place,
    pub(crate) value: ExprId,
}

/// `Σ c x`
type Terms = Vec<(Constant, ExprId)>;

/// Orders entries into nested loops; arrays that loops add to are cleared first.
pub(crate) fn blocks(graph: &mut Graph, entries: Vec<Entry>) -> (Vec<Output>, Block) {
    let adds = |entry: &Entry| !entry.nest.is_empty() || !entry.place.is_literal();
    let mut added: Vec<Array> = entries
        .iter()
        .filter(|entry| adds(entry))
        .map(|entry| entry.place.array)
        .collect();
    added.sort_unstable();
    added.dedup();
    let mut merged: BTreeMap<(Vec<SumRange>, Place), Terms> = BTreeMap::new();
    for Entry { nest, place, value } in entries {
        merged
            .entry((nest, place))
            .or_default()
            .push((Constant::ONE, value));
    }
    let mut cleared = Vec::new();
    let mut root = Block::default();
    for ((nest, place), values) in merged {
        let value = graph.linear(Constant::ZERO, &values);
        let accumulate = added.contains(&place.array);
        let target = match place.array {
            Array::Value => Target::Value,
            _ => Target::Store {
                output: place.output(),
                accumulate,
            },
        };
        if accumulate && place.array != Array::Value {
            let output = Place::vector(place.array, Affine::default()).output();
            if !cleared.contains(&output) {
                cleared.push(output);
            }
        }
        let mut block = &mut root;
        for range in nest {
            let at = block
                .inner
                .iter()
                .position(|(known, _)| *known == range)
                .unwrap_or_else(|| {
                    block.inner.push((range.clone(), Block::default()));
                    block.inner.len() - 1
                });
            block = &mut block.inner[at].1;
        }
        block.sinks.push(Sink { target, value });
    }
    (cleared, root)
}

/// The sinks of a block and of the loops inside, in the order of the program.
pub(crate) fn for_each_sink(root: &mut Block, visit: &mut dyn FnMut(&mut Sink)) {
    for sink in &mut root.sinks {
        visit(sink);
    }
    for (_, inner) in &mut root.inner {
        for_each_sink(inner, visit);
    }
}
