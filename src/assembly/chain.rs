//! A chain of links with conditions at its ends, solved by structured orthogonal elimination.
//!
//! The unknowns are the values y₀, …, y_E of E + 1 nodes, m numbers each, and g global ones γ. They satisfy
//!
//! ```text
//! links     y_{e+1} − A_e y_e − C_e γ = r_e ,         e = 0, …, E − 1        (m rows each)
//! closure   B_0 y_0 + B_E y_E + B_γ γ = b             (m + g − k rows)
//! dense     Σ_e w_e · y_e + w_γ · γ = d               (k rows)
//! ```
//!
//! # Method
//! The nodes y₁, …, y_{E−1} are eliminated in turn. Two block rows hold y_e: its own link and the relation between y_0
//! and y_e that the elimination so far has left,
//!
//! ```text
//! ⎡  U_e   0   S_e   G_e ⎤                    ⎡ R   T        S        G       ⎤
//! ⎣ −A_e   I    0   −C_e ⎦   ──reflections──▶ ⎣ 0   U_{e+1}  S_{e+1}  G_{e+1} ⎦   on (y_e, y_{e+1}, y_0, γ) .
//! ```
//!
//! Householder reflections of the 2m rows leave R triangular: the upper half is kept for the back substitution, the
//! lower is the relation between y_0 and y_{e+1}. R also eliminates y_e from the dense rows. At the end a small system
//! in (y_0, y_E, γ) remains (`closing`).
//!
//! The recursion y_E = A_{E−1} ··· A_0 y_0 would keep the growing solutions only. The reflections weigh the two block
//! rows by size: a growing solution is represented by its value at the end, a decaying one by its value at the start. A
//! boundary-value problem is thus solved to the accuracy that its conditions allow. Conversely, for initial values and
//! solutions that grow by a factor of a billion, the recursion is the better method, and this one loses nine digits.
//!
//! The cost is E (m³ 23/3 + O(m² (g + k + 1))) multiplications, the storage E m (4m + 2g + 2).
//!
//! # Scaling
//! Coordinates and momenta have different units, which may make entries of A_e arbitrarily large; reflections mix rows
//! and would lose the digits of small entries. The nodes are therefore scaled by one diagonal matrix of powers of two,
//! ŷ_e = D⁻¹ y_e, which balances the links and causes no rounding errors.
//!
//! # Reference
//! S. J. Wright, *Stable parallel algorithms for two-point boundary value problems*, SIAM J. Sci. Stat. Comput. 13 (1992)
//! 742–764; U. M. Ascher, R. M. M. Mattheij, R. D. Russell, *Numerical Solution of Boundary Value Problems for Ordinary
//! Differential Equations*, SIAM 1995, chapter 7.

mod closing;
mod equations;
mod sweep;
#[cfg(test)]
mod tests;

use closing::Closing;
use equations::{Equations, RightSide, Shape};
use sweep::Sweep;

pub(crate) use equations::Singular;

/// The coefficients of one link, y_{e+1} − A y_e − C γ = r.
pub(crate) struct LinkMut<'a> {
    /// A, m × m.
    pub(crate) matrix: &'a mut [f64],
    /// C, m × g.
    pub(crate) global: &'a mut [f64],
    /// r, for the first right side.
    pub(crate) right: &'a mut [f64],
}

/// The coefficients of the closure, B_0 y_0 + B_E y_E + B_γ γ = b, of c = m + g − k rows.
pub(crate) struct ClosureMut<'a> {
    /// B_0, c × m.
    pub(crate) first: &'a mut [f64],
    /// B_E, c × m.
    pub(crate) last: &'a mut [f64],
    /// B_γ, c × g.
    pub(crate) global: &'a mut [f64],
    /// b, for the first right side.
    pub(crate) right: &'a mut [f64],
}

impl ClosureMut<'_> {
    /// Sets all coefficients to zero.
    pub(crate) fn clear(&mut self) {
        self.first.fill(0.0);
        self.last.fill(0.0);
        self.global.fill(0.0);
        self.right.fill(0.0);
    }
}

/// The coefficients of one dense row, Σ w_e · y_e + w_γ · γ = d.
pub(crate) struct DenseMut<'a> {
    /// w_0, …, w_E, concatenated.
    pub(crate) nodes: &'a mut [f64],
    /// w_γ.
    pub(crate) global: &'a mut [f64],
    /// d, for the first right side.
    pub(crate) right: &'a mut f64,
}

/// A chain of links, its storage and its solution.
///
/// All coefficients are zero at first and keep their values until they are written again: [`solve`](Self::solve) leaves
/// them as they are, and it does not allocate.
#[derive(Clone, Debug)]
pub(crate) struct Chain {
    shape: Shape,
    equations: Equations,
    sweep: Sweep,
    closing: Closing,
    /// y_0, …, y_E for each right side.
    nodes: Vec<f64>,
    /// γ for each right side.
    globals: Vec<f64>,
    sign: f64,
}

impl Chain {
    /// A chain of `links` ≥ 1 links between nodes of `block` unknowns, with `globals` global unknowns, `dense` ≤
    /// `block` + `globals` dense rows and one right side.
    #[cfg(any(test, feature = "sparse"))]
    pub(crate) fn new(block: usize, globals: usize, links: usize, dense: usize) -> Self {
        Self::with_right_sides(block, globals, links, dense, 1)
    }

    /// As [`new`](Self::new), with several right sides of the same equations: see
    /// [`right_side_mut`](Self::right_side_mut).
    pub(crate) fn with_right_sides(
        block: usize,
        globals: usize,
        links: usize,
        dense: usize,
        rights: usize,
    ) -> Self {
        debug_assert!(links > 0, "a chain has a link");
        debug_assert!(dense <= block + globals, "more equations than unknowns");
        let shape = Shape {
            block,
            globals,
            links,
            dense,
            rights,
        };
        Self {
            equations: Equations::new(&shape),
            sweep: Sweep::new(&shape),
            closing: Closing::new(&shape),
            nodes: vec![0.0; rights * shape.nodes()],
            globals: vec![0.0; rights * globals],
            sign: 0.0,
            shape,
        }
    }

    /// The link from node `e` to node `e` + 1.
    pub(crate) fn link_mut(&mut self, e: usize) -> LinkMut<'_> {
        let (m, g) = (self.shape.block, self.shape.globals);
        let equations = &mut self.equations;
        LinkMut {
            matrix: &mut equations.matrices[e * m * m..(e + 1) * m * m],
            global: &mut equations.link_globals[e * m * g..(e + 1) * m * g],
            right: &mut equations.rights[0].links[e * m..(e + 1) * m],
        }
    }

    /// The closure.
    pub(crate) fn closure_mut(&mut self) -> ClosureMut<'_> {
        let equations = &mut self.equations;
        ClosureMut {
            first: &mut equations.first,
            last: &mut equations.last,
            global: &mut equations.closure_globals,
            right: &mut equations.rights[0].closure,
        }
    }

    /// The dense row `k`, from 0.
    pub(crate) fn dense_mut(&mut self, k: usize) -> DenseMut<'_> {
        let (g, nodes) = (self.shape.globals, self.shape.nodes());
        let equations = &mut self.equations;
        DenseMut {
            nodes: &mut equations.dense_nodes[k * nodes..(k + 1) * nodes],
            global: &mut equations.dense_globals[k * g..(k + 1) * g],
            right: &mut equations.rights[0].dense[k],
        }
    }

    /// One right side, by its index from 0; the first is the one that the other accessors give.
    ///
    /// Newton's step and the tangent of a branch have the same matrix: the tangent's right side is zero but for the
    /// last dense row, which is one.
    pub(crate) fn right_side_mut(&mut self, side: usize) -> &mut RightSide {
        &mut self.equations.rights[side]
    }

    /// The matrices A_0, …, A_{E−1}, concatenated, each row by row.
    pub(crate) fn matrices(&self) -> &[f64] {
        &self.equations.matrices
    }

    /// Solves for all right sides.
    ///
    /// The coefficients are kept; the solution is what [`node`](Self::node) and [`globals`](Self::globals) return.
    /// After an error it has no meaning.
    ///
    /// # Errors
    /// [`Singular`] if the equations do not determine the unknowns up to rounding errors, or a number is not finite.
    pub(crate) fn solve(&mut self) -> Result<(), Singular> {
        let shape = self.shape;
        let m = shape.block;
        self.sign = 0.0;
        let mut swept = self.sweep.eliminate(&shape, &self.equations);
        self.closing.load(&shape, &self.equations, &self.sweep);
        let mut closed = self.closing.solve();
        if let Err(Singular::Rank { .. }) = closed
            && let Some(again) = self.sweep.eliminate_again(&shape, &self.equations)
        {
            swept = again;
            self.closing.load(&shape, &self.equations, &self.sweep);
            closed = self.closing.solve();
        }
        let closed = closed?;
        for side in 0..shape.rights {
            let nodes = &mut self.nodes[side * shape.nodes()..(side + 1) * shape.nodes()];
            let globals = &mut self.globals[side * shape.globals..(side + 1) * shape.globals];
            for (i, x) in self.closing.solution(side).enumerate() {
                match i {
                    _ if i < m => nodes[i] = x,
                    _ if i < 2 * m => nodes[(shape.links - 1) * m + i] = x,
                    _ => globals[i - 2 * m] = x,
                }
            }
            self.sweep.substitute(&shape, side, nodes, globals);
            if !nodes.iter().chain(&*globals).all(|x| x.is_finite()) {
                return Err(Singular::NotFinite);
            }
        }
        self.sign = swept * closed;
        Ok(())
    }

    /// The value y_e of a node.
    pub(crate) fn node(&self, e: usize) -> &[f64] {
        self.node_of(0, e)
    }

    /// The global unknowns γ.
    pub(crate) fn globals(&self) -> &[f64] {
        self.globals_of(0)
    }

    /// The value y_e of a node, for one of several right sides.
    pub(crate) fn node_of(&self, side: usize, e: usize) -> &[f64] {
        let m = self.shape.block;
        let start = side * self.shape.nodes() + e * m;
        &self.nodes[start..start + m]
    }

    /// The global unknowns γ, for one of several right sides.
    pub(crate) fn globals_of(&self, side: usize) -> &[f64] {
        let g = self.shape.globals;
        &self.globals[side * g..(side + 1) * g]
    }

    /// The distance from singular equations, after a successful [`solve`](Self::solve): the ratio of the smallest to
    /// the largest pivot of the closing system.
    pub(super) fn smallest_pivot(&self) -> f64 {
        self.closing.smallest()
    }

    /// The sign of the determinant of all equations: 1 or −1 after a successful [`solve`](Self::solve), otherwise 0.
    ///
    /// The rows are those of the links, the closure and the dense rows, the columns y_0, …, y_E, γ, in these orders.
    /// Along a branch of solutions it changes where another branch crosses.
    pub(crate) fn sign(&self) -> f64 {
        self.sign
    }
}
