//! Entries of results: what is added where, on every turn of which loops.

use crate::expr::graph::{ExprId, SumRange};
use crate::expr::input::{Affine, LoopVariable};
use crate::expr::rewrite::substitute;
use crate::program::{Output, Request};

/// The arrays of results.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
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
    SitePhi,
    SiteRow,
    SiteDrift,
    SiteObservable,
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
            Self::Observable(_) | Self::SiteObservable => request.observables,
            Self::Phi(_) | Self::SitePhi => request.constraint_values,
            Self::Row(_) | Self::Drift(_) | Self::SiteRow | Self::SiteDrift => {
                request.constraint_rows
            }
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

    /// The place in a program.
    pub(crate) fn output(&self) -> Output {
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
            Array::SitePhi => Output::SitePhi(row),
            Array::SiteRow => Output::SiteRow(row, column),
            Array::SiteDrift => Output::SiteDrift(row),
            Array::SiteObservable => Output::SiteObservable(row),
        }
    }

    /// Whether it is another entry on every turn of a loop.
    pub(crate) fn depends_on(&self, variable: LoopVariable) -> bool {
        self.row.depends_on(variable) || self.column.depends_on(variable)
    }

    /// The place where the variable has this value.
    pub(crate) fn at(&self, variable: LoopVariable, value: &Affine) -> Self {
        Self {
            array: self.array,
            row: substitute(&self.row, variable, value),
            column: substitute(&self.column, variable, value),
        }
    }
}

/// What is added to one place, on every turn of a nest of loops.
#[derive(Clone, Debug)]
pub(crate) struct Entry {
    pub(crate) nest: Vec<SumRange>,
    pub(crate) place: Place,
    pub(crate) value: ExprId,
}
