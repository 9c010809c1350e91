//! The nodal forms of the paper, for verification and teaching.
//!
//! Steps are computed from the tables of [`scheme`](crate::scheme). Here the same elements are written with shape
//! functions: their tangents K and residuals F are integrated, and their interior nodes condensed, as in (17)–(38). N
//! are the shape functions of degree n − 1 on the nodes, M those of degree n − 2 on the trial nodes of the mixed form;
//! a dot is d/dt.

use alloc::vec;
use alloc::vec::Vec;
use core::fmt;

use nalgebra::{DMatrix, DVector};

use crate::basis::{shape_functions, shape_slopes};
use crate::error::LegendreError;
use crate::legendre::{hamiltonian_view, lagrangian_view};
use crate::model::{Model, State};
use crate::quadrature::Quadrature;

/// Why a nodal form has no solution.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum WeakFormError {
    /// The model has no value at a point of the rule.
    Legendre(LegendreError),
    /// A matrix of a linear system is singular.
    Singular,
    /// The numbers of nodes, unknowns or blocks of a matrix do not agree.
    Shape,
}

impl From<LegendreError> for WeakFormError {
    fn from(error: LegendreError) -> Self {
        Self::Legendre(error)
    }
}

impl fmt::Display for WeakFormError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Legendre(error) => error.fmt(f),
            Self::Singular => f.write_str("a matrix of the nodal form is singular"),
            Self::Shape => {
                f.write_str("the sizes of the matrices and vectors of the nodal form do not match")
            }
        }
    }
}

impl core::error::Error for WeakFormError {}

/// Tangent K and residual F of an element; Newton's method is K Δ = B − F.
#[derive(Clone, Debug, PartialEq)]
pub struct Assembled {
    /// K = ∂F/∂(unknowns).
    pub tangent: DMatrix<f64>,
    /// F, without the boundary terms.
    pub residual: DVector<f64>,
}

/// The displacement form (17)–(20) of one element.
#[derive(Clone, Debug)]
pub struct PrimalForm<'a, M> {
    /// The model.
    pub model: &'a M,
    /// The quadrature rule.
    pub rule: Quadrature,
    /// The nodes on \[0, 1\], both ends among them.
    pub nodes: Vec<f64>,
    /// Time at the start.
    pub t: f64,
    /// Length.
    pub h: f64,
}

impl<M> PrimalForm<'_, M> {
    /// K_p and F_p at the nodal coordinates q_1 … q_n:
    ///
    /// ```text
    /// K_p = ∫ (Ṅ, N)ᵀ T_p (Ṅ, N) dt ,    F_p = ∫ (Ṅ, N)ᵀ R_p dt
    /// ```
    ///
    /// with T_p = [[L_vv, L_vq], [L_qv + Q_v, L_qq + Q_q]] and R_p = (L_v, L_q + Q).
    ///
    /// # Shapes
    /// nN × nN and nN, node by node.
    /// # Errors
    /// [`WeakFormError::Legendre`] where a Hamiltonian model has no momentum.
    pub fn assemble<const N: usize>(&self, q: &[[f64; N]]) -> Result<Assembled, WeakFormError>
    where
        M: Model<N>,
    {
        let n = self.nodes.len();
        if q.len() != n || n < 2 {
            return Err(WeakFormError::Shape);
        }
        let mut tangent = DMatrix::zeros(n * N, n * N);
        let mut residual = DVector::zeros(n * N);
        let (mut shape, mut slope) = (vec![0.0; n], vec![0.0; n]);
        for l in 0..self.rule.len() {
            let tau = self.rule.node(l);
            shape_functions(&self.nodes, tau, &mut shape);
            shape_slopes(&self.nodes, tau, &mut slope);
            slope.iter_mut().for_each(|slope| *slope /= self.h);
            let weight = self.h * self.rule.weight(l);
            let (place, velocity) = (combine(&shape, q), combine(&slope, q));
            let view = lagrangian_view(self.model, self.t + tau * self.h, &place, &velocity)?;
            let (first, second) = (&view.first, &view.second);
            for r in 0..n {
                for a in 0..N {
                    residual[r * N + a] +=
                        weight * (slope[r] * first.z[a] + shape[r] * (first.q[a] + first.force[a]));
                    for s in 0..n {
                        for b in 0..N {
                            let by_v = slope[r] * second.zz[a][b]
                                + shape[r] * (second.zq[b][a] + second.force_z[a][b]);
                            let by_q = slope[r] * second.zq[a][b]
                                + shape[r] * (second.qq[a][b] + second.force_q[a][b]);
                            tangent[(r * N + a, s * N + b)] +=
                                weight * (by_v * slope[s] + by_q * shape[s]);
                        }
                    }
                }
            }
        }
        Ok(Assembled { tangent, residual })
    }

    /// B_p (p₀, p₁): −p₀ in the first block, +p₁ in the last.
    #[must_use]
    pub fn boundary<const N: usize>(&self, p0: &[f64; N], p1: &[f64; N]) -> DVector<f64> {
        let n = self.nodes.len();
        let mut boundary = DVector::zeros(n * N);
        for a in 0..N {
            boundary[a] -= p0[a];
            boundary[(n - 1) * N + a] += p1[a];
        }
        boundary
    }

    /// One step of Newton's method on the rows of nodes 1 … n − 1 for q_2 … q_n, given p₀; q_1 is
    /// the start and stays. Returns the largest increment.
    ///
    /// # Errors
    /// [`WeakFormError::Singular`] if the rows do not determine the unknowns.
    pub fn newton_step<const N: usize>(
        &self,
        p0: &[f64; N],
        q: &mut [[f64; N]],
    ) -> Result<f64, WeakFormError>
    where
        M: Model<N>,
    {
        let Assembled { tangent, residual } = self.assemble(q)?;
        let size = (q.len() - 1) * N;
        let right = self.boundary(p0, &[0.0; N]) - residual;
        let step = tangent
            .view((0, N), (size, size))
            .into_owned()
            .lu()
            .solve(&right.rows(0, size))
            .ok_or(WeakFormError::Singular)?;
        for (value, step) in q[1..].as_flattened_mut().iter_mut().zip(step.iter()) {
            *value += step;
        }
        Ok(step.amax())
    }

    /// The momentum at the end, from the last row: p₁ = F_n.
    ///
    /// # Errors
    /// As [`assemble`](Self::assemble).
    pub fn end_momentum<const N: usize>(&self, q: &[[f64; N]]) -> Result<[f64; N], WeakFormError>
    where
        M: Model<N>,
    {
        let residual = self.assemble(q)?.residual;
        let mut p = [0.0; N];
        p.copy_from_slice(&residual.as_slice()[(q.len() - 1) * N..]);
        Ok(p)
    }
}

/// The two-field form (22)–(26) of one element.
#[derive(Clone, Debug)]
pub struct MixedForm<'a, M> {
    /// The model.
    pub model: &'a M,
    /// The quadrature rule.
    pub rule: Quadrature,
    /// The nodes of the test functions on \[0, 1\], both ends among them.
    pub nodes: Vec<f64>,
    /// The nodes of the trial functions, one fewer, anywhere in \[0, 1\].
    pub trial_nodes: Vec<f64>,
    /// Time at the start.
    pub t: f64,
    /// Length.
    pub h: f64,
}

impl<M> MixedForm<'_, M> {
    /// K_m and F_m at the nodal values y_1 … y_{n−1}:
    ///
    /// ```text
    /// K_m = ∫ { Ṅᵀ I_m M + Nᵀ T_m M } dt ,    F_m = ∫ { Ṅᵀ I_m M y + Nᵀ R_m } dt
    /// ```
    ///
    /// with T_m = [[−H_pp, −H_pq], [−H_qp + Q_p, −H_qq + Q_q]], R_m = (−H_p, Q − H_q) and
    /// I_m = [[0, −1], [1, 0]].
    ///
    /// # Shapes
    /// 2nN × 2(n − 1)N and 2nN; rows (δp₁, δq₁, δp₂, …), columns (p₁, q₁, p₂, …).
    /// # Errors
    /// [`WeakFormError::Legendre`] where a Lagrangian model has no velocity.
    pub fn assemble<const N: usize>(&self, y: &[State<N>]) -> Result<Assembled, WeakFormError>
    where
        M: Model<N>,
    {
        let (n, s) = (self.nodes.len(), self.trial_nodes.len());
        if y.len() != s || n != s + 1 || s == 0 {
            return Err(WeakFormError::Shape);
        }
        let p: Vec<_> = y.iter().map(|state| state.p).collect();
        let q: Vec<_> = y.iter().map(|state| state.q).collect();
        let mut tangent = DMatrix::zeros(2 * n * N, 2 * s * N);
        let mut residual = DVector::zeros(2 * n * N);
        let (mut shape, mut slope, mut trial) = (vec![0.0; n], vec![0.0; n], vec![0.0; s]);
        for l in 0..self.rule.len() {
            let tau = self.rule.node(l);
            shape_functions(&self.nodes, tau, &mut shape);
            shape_slopes(&self.nodes, tau, &mut slope);
            slope.iter_mut().for_each(|slope| *slope /= self.h);
            shape_functions(&self.trial_nodes, tau, &mut trial);
            let weight = self.h * self.rule.weight(l);
            let (p, q) = (combine(&trial, &p), combine(&trial, &q));
            let view = hamiltonian_view(self.model, self.t + tau * self.h, &q, &p)?;
            let (first, second) = (&view.first, &view.second);
            for r in 0..n {
                let (dp, dq) = (2 * r * N, (2 * r + 1) * N);
                for a in 0..N {
                    residual[dp + a] -= weight * (slope[r] * q[a] + shape[r] * first.z[a]);
                    residual[dq + a] +=
                        weight * (slope[r] * p[a] + shape[r] * (first.force[a] - first.q[a]));
                    for c in 0..s {
                        let (column_p, column_q) = (2 * c * N, (2 * c + 1) * N);
                        let trial = weight * trial[c];
                        tangent[(dp + a, column_q + a)] -= slope[r] * trial;
                        tangent[(dq + a, column_p + a)] += slope[r] * trial;
                        let trial = shape[r] * trial;
                        for b in 0..N {
                            tangent[(dp + a, column_p + b)] -= trial * second.zz[a][b];
                            tangent[(dp + a, column_q + b)] -= trial * second.zq[a][b];
                            tangent[(dq + a, column_p + b)] +=
                                trial * (second.force_z[a][b] - second.zq[b][a]);
                            tangent[(dq + a, column_q + b)] +=
                                trial * (second.force_q[a][b] - second.qq[a][b]);
                        }
                    }
                }
            }
        }
        Ok(Assembled { tangent, residual })
    }

    /// B_m (y₀, y₁): −I_m y₀ in the block rows of the first node, +I_m y₁ in those of the last.
    #[must_use]
    pub fn boundary<const N: usize>(&self, y0: &State<N>, y1: &State<N>) -> DVector<f64> {
        let last = 2 * (self.nodes.len() - 1) * N;
        let mut boundary = DVector::zeros(last + 2 * N);
        for a in 0..N {
            // I_m (p, q) = (−q, p)
            boundary[a] += y0.q[a];
            boundary[N + a] -= y0.p[a];
            boundary[last + a] -= y1.q[a];
            boundary[last + N + a] += y1.p[a];
        }
        boundary
    }

    /// One step of Newton's method on the rows of nodes 1 … n − 1, given y₀. Returns the largest
    /// increment.
    ///
    /// # Errors
    /// [`WeakFormError::Singular`] if the rows do not determine the unknowns.
    pub fn newton_step<const N: usize>(
        &self,
        y0: &State<N>,
        y: &mut [State<N>],
    ) -> Result<f64, WeakFormError>
    where
        M: Model<N>,
    {
        let Assembled { tangent, residual } = self.assemble(y)?;
        let size = 2 * y.len() * N;
        let right = self.boundary(
            y0,
            &State {
                q: [0.0; N],
                p: [0.0; N],
            },
        ) - residual;
        let step = tangent
            .rows(0, size)
            .into_owned()
            .lu()
            .solve(&right.rows(0, size))
            .ok_or(WeakFormError::Singular)?;
        for (state, step) in y.iter_mut().zip(step.as_slice().chunks_exact(2 * N)) {
            for a in 0..N {
                state.p[a] += step[a];
                state.q[a] += step[N + a];
            }
        }
        Ok(step.amax())
    }

    /// The state at the end, from the last rows: y₁ = −I_m F_n.
    ///
    /// # Errors
    /// As [`assemble`](Self::assemble).
    pub fn end<const N: usize>(&self, y: &[State<N>]) -> Result<State<N>, WeakFormError>
    where
        M: Model<N>,
    {
        let residual = self.assemble(y)?.residual;
        let last = &residual.as_slice()[2 * y.len() * N..];
        let mut end = State {
            q: [0.0; N],
            p: [0.0; N],
        };
        for a in 0..N {
            end.q[a] = -last[a];
            end.p[a] = last[N + a];
        }
        Ok(end)
    }
}

/// Σ N_r x_r.
fn combine<const N: usize>(shape: &[f64], values: &[[f64; N]]) -> [f64; N] {
    let mut sum = [0.0; N];
    for (weight, value) in shape.iter().zip(values) {
        for a in 0..N {
            sum[a] += weight * value[a];
        }
    }
    sum
}

/// The transition matrix of a primal element, ordered (p, q), from its tangent at the solution.
///
/// The rows of nodes 1 … n − 1 are solved for dq_2 … dq_n, the last row gives dp₁. The interior block
/// is not inverted: it is singular at isolated steps where the transition matrix is finite.
///
/// # Errors
/// [`WeakFormError::Singular`] if the step itself is singular, [`WeakFormError::Shape`] if the
/// matrix has not at least two blocks of size `coordinates`.
pub fn primal_transition(
    tangent: &DMatrix<f64>,
    coordinates: usize,
) -> Result<DMatrix<f64>, WeakFormError> {
    let d = coordinates;
    if d == 0
        || !tangent.is_square()
        || !tangent.nrows().is_multiple_of(d)
        || tangent.nrows() < 2 * d
    {
        return Err(WeakFormError::Shape);
    }
    let size = tangent.nrows() - d;
    // K dq = B (dp₀, dp₁): in the first block row −dp₀, and the column of dq₀ on the other side.
    let mut right = DMatrix::zeros(size, 2 * d);
    right.view_mut((0, 0), (d, d)).fill_diagonal(-1.0);
    right
        .view_mut((0, d), (size, d))
        .copy_from(&-tangent.view((0, 0), (size, d)));
    let solved = tangent
        .view((0, d), (size, size))
        .into_owned()
        .lu()
        .solve(&right)
        .ok_or(WeakFormError::Singular)?;
    let mut end_p = tangent.view((size, d), (d, size)) * &solved;
    let mut own = end_p.columns_mut(d, d);
    own += tangent.view((size, 0), (d, d));
    let mut matrix = DMatrix::zeros(2 * d, 2 * d);
    matrix.rows_mut(0, d).copy_from(&end_p);
    matrix.rows_mut(d, d).copy_from(&solved.rows(size - d, d));
    Ok(matrix)
}

/// The transition matrix of a mixed element, ordered (p, q): A_m = I_m K^f \[K^i; K^m\]⁻¹ \[I_m; 0\].
///
/// # Errors
/// [`WeakFormError::Singular`] if the step itself is singular, [`WeakFormError::Shape`] if the
/// matrix is not 2nN × 2(n − 1)N.
pub fn mixed_transition(
    tangent: &DMatrix<f64>,
    coordinates: usize,
) -> Result<DMatrix<f64>, WeakFormError> {
    let (d, size) = (coordinates, tangent.ncols());
    if d == 0 || size == 0 || !size.is_multiple_of(2 * d) || tangent.nrows() != size + 2 * d {
        return Err(WeakFormError::Shape);
    }
    let mut skew = DMatrix::zeros(2 * d, 2 * d);
    skew.view_mut((0, d), (d, d)).fill_diagonal(-1.0);
    skew.view_mut((d, 0), (d, d)).fill_diagonal(1.0);
    let mut right = DMatrix::zeros(size, 2 * d);
    right.rows_mut(0, 2 * d).copy_from(&skew);
    let solved = tangent
        .rows(0, size)
        .into_owned()
        .lu()
        .solve(&right)
        .ok_or(WeakFormError::Singular)?;
    Ok(skew * tangent.rows(size, 2 * d) * solved)
}

/// Condenses the interior nodes out of a primal element, (30) and (31):
///
/// ```text
/// K̂ = K_ee − K_ei K_ii⁻¹ K_ie ,    F̂ = F_e − K_ei K_ii⁻¹ F_i
/// ```
///
/// where e are the first and the last node.
///
/// # Errors
/// [`WeakFormError::Singular`] if K_ii has no inverse; the step may be regular all the same.
pub fn condense(element: &Assembled, coordinates: usize) -> Result<Assembled, WeakFormError> {
    let Assembled { tangent, residual } = element;
    let (d, size) = (coordinates, tangent.nrows());
    if d == 0 || !tangent.is_square() || size < 2 * d || residual.len() != size {
        return Err(WeakFormError::Shape);
    }
    if size == 2 * d {
        return Ok(element.clone());
    }
    let ends: Vec<usize> = (0..d).chain(size - d..size).collect();
    let interior: Vec<usize> = (d..size - d).collect();
    let to_ends = tangent.select_columns(&ends);
    let to_interior = tangent.select_columns(&interior);
    let factors = to_interior.select_rows(&interior).lu();
    let coupling = to_interior.select_rows(&ends);
    let k_ie = factors
        .solve(&to_ends.select_rows(&interior))
        .ok_or(WeakFormError::Singular)?;
    let f_i = factors
        .solve(&residual.rows(d, size - 2 * d))
        .ok_or(WeakFormError::Singular)?;
    Ok(Assembled {
        tangent: to_ends.select_rows(&ends) - &coupling * k_ie,
        residual: residual.select_rows(&ends) - coupling * f_i,
    })
}
