//! The places of results: entries of arrays.

use crate::expr::input::{Affine, LoopVariable};
use crate::expr::rewrite::substitute;
use crate::program::request::Request;

/// The arrays of results. `z` is the velocity of a Lagrangian, the momentum of a Hamiltonian.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Array {
    /// The energy function itself, L or H
    Value,
    /// ∂/∂z
    ByZ,
    /// ∂/∂q
    ByQ,
    /// Generalized forces
    Force,
    /// ∂²/∂z∂z
    ZZ,
    /// ∂²/∂z∂q (row z, column q)
    ZQ,
    /// ∂²/∂q∂q
    QQ,
    /// ∂Q/∂z (row: coordinate of the force)
    ForceZ,
    /// ∂Q/∂q
    ForceQ,
    /// The observable of this number
    Observable(usize),
    /// φ of the constraint of this number
    Phi(usize),
    /// A, the row of a constraint
    Row(usize),
    /// a of a constraint
    Drift(usize),
    /// ∂ψ/∂q with ψ = A v + a, the row of a constraint
    PsiQ(usize),
    /// Ȧ, the row of a constraint
    RowRate(usize),
    /// ∂(Aᵀμ)/∂q
    Bend,
    /// ∂(Ȧᵀμ)/∂q
    RateQ,
    /// ∂(Ȧᵀμ)/∂v
    RateV,
    /// φ of the constraints of a model of run-time length
    SitePhi,
    /// A of a model of run-time length (row: constraint, column: coordinate)
    SiteRow,
    /// a of the constraints of a model of run-time length
    SiteDrift,
    /// The observables of a model of run-time length that has some by site
    SiteObservable,
}

/// How many indices an entry of an array has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Shape {
    Number,
    Vector,
    Matrix,
}

/// One entry of an array of results; vectors and numbers leave indices unused, which are zero then.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Place {
    /// Which array
    pub array: Array,
    /// The row of a matrix, the index of a vector
    pub row: Affine,
    /// The column of a matrix
    pub column: Affine,
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

    /// How many indices its entries have.
    pub(crate) fn shape(self) -> Shape {
        match self {
            Self::Value | Self::Observable(_) | Self::Phi(_) | Self::Drift(_) => Shape::Number,
            Self::ByZ | Self::ByQ | Self::Force => Shape::Vector,
            Self::Row(_) | Self::PsiQ(_) | Self::RowRate(_) => Shape::Vector,
            Self::SitePhi | Self::SiteDrift | Self::SiteObservable => Shape::Vector,
            Self::ZZ | Self::ZQ | Self::QQ | Self::ForceZ | Self::ForceQ => Shape::Matrix,
            Self::Bend | Self::RateQ | Self::RateV | Self::SiteRow => Shape::Matrix,
        }
    }

    /// The number of the constraint or observable that it belongs to.
    pub(crate) fn number(self) -> Option<usize> {
        match self {
            Self::Observable(number)
            | Self::Phi(number)
            | Self::Row(number)
            | Self::Drift(number)
            | Self::PsiQ(number)
            | Self::RowRate(number) => Some(number),
            _ => None,
        }
    }
}

impl Place {
    /// A number.
    pub fn scalar(array: Array) -> Self {
        Self::vector(array, Affine::default())
    }

    /// An entry of a vector.
    pub fn vector(array: Array, row: Affine) -> Self {
        Self {
            array,
            row,
            column: Affine::default(),
        }
    }

    /// The entry so many rows and columns further.
    pub fn further(&self, rows: i64, columns: i64) -> Self {
        let sum = |index: &Affine, steps: i64| Affine {
            constant: index.constant.saturating_add(steps),
            ..index.clone()
        };
        Self {
            array: self.array,
            row: sum(&self.row, rows),
            column: sum(&self.column, columns),
        }
    }

    /// The entry on the other side of the diagonal of a square matrix.
    pub fn transposed(&self) -> Self {
        Self {
            array: self.array,
            row: self.column.clone(),
            column: self.row.clone(),
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
