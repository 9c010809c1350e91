//! The data of a chain: its shape, its equations, and the error if they cannot be solved.

use std::error::Error;
use std::fmt;

/// The numbers of unknowns and equations.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shape {
    /// m, the unknowns of a node.
    pub(super) block: usize,
    /// g, the global unknowns.
    pub(super) globals: usize,
    /// E, at least one.
    pub(super) links: usize,
    /// k, at most m + g.
    pub(super) dense: usize,
    /// The number of right sides that are solved for together.
    pub(super) rights: usize,
}

impl Shape {
    /// The number of rows of the closure, m + g − k.
    pub(super) fn closure(&self) -> usize {
        self.block + self.globals - self.dense
    }

    /// The number of unknowns of all nodes.
    pub(super) fn nodes(&self) -> usize {
        (self.links + 1) * self.block
    }

    /// The number of unknowns of the closing system, (y_0, y_E, γ).
    pub(super) fn closing(&self) -> usize {
        2 * self.block + self.globals
    }
}

/// The equations as given; all matrices row by row.
#[derive(Clone, Debug)]
pub(super) struct Equations {
    pub(super) matrices: Vec<f64>,
    pub(super) link_globals: Vec<f64>,
    pub(super) first: Vec<f64>,
    pub(super) last: Vec<f64>,
    pub(super) closure_globals: Vec<f64>,
    pub(super) dense_nodes: Vec<f64>,
    pub(super) dense_globals: Vec<f64>,
    pub(super) rights: Vec<RightSide>,
}

impl Equations {
    pub(super) fn new(shape: &Shape) -> Self {
        let (m, g, c) = (shape.block, shape.globals, shape.closure());
        let right = RightSide {
            links: vec![0.0; shape.links * m],
            closure: vec![0.0; c],
            dense: vec![0.0; shape.dense],
        };
        Self {
            matrices: vec![0.0; shape.links * m * m],
            link_globals: vec![0.0; shape.links * m * g],
            first: vec![0.0; c * m],
            last: vec![0.0; c * m],
            closure_globals: vec![0.0; c * g],
            dense_nodes: vec![0.0; shape.dense * shape.nodes()],
            dense_globals: vec![0.0; shape.dense * g],
            rights: vec![right; shape.rights],
        }
    }
}

/// One right side of all equations.
#[derive(Clone, Debug)]
pub(crate) struct RightSide {
    /// r_0, …, r_{E−1}, concatenated.
    pub(crate) links: Vec<f64>,
    /// b.
    pub(crate) closure: Vec<f64>,
    /// d, one number for each dense row.
    pub(crate) dense: Vec<f64>,
}

/// Why the equations of a chain were not solved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Singular {
    /// The conditions do not determine the unknowns up to rounding errors.
    Rank {
        /// The number of independent equations found among those that remain for the two ends and the global unknowns.
        rank: usize,
        /// The number of these equations, 2m + g.
        size: usize,
        /// The size of the first pivot that is taken for zero, relative to the largest.
        pivot: f64,
    },
    /// A coefficient or a component of the solution is infinite or NaN.
    NotFinite,
}

impl fmt::Display for Singular {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Rank { rank, size, pivot } => write!(
                f,
                "the linear equations are singular: the conditions at the ends have rank {rank} of {size} (relative pivot {pivot:.1e})"
            ),
            Self::NotFinite => write!(
                f,
                "the linear equations or their solution hold a number that is not finite"
            ),
        }
    }
}

impl Error for Singular {}
