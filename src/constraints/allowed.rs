//! Bases of the motions that constraints allow (T-78): the part for models of either kind of length, and that for
//! models of run-time length.

use crate::numbers::norm;
use nalgebra::{DMatrix, DVector};
use tfe_runtime::{ConstraintError, StepError};
#[cfg(feature = "sparse")]
use {
    tfe_runtime::dual::Dual,
    tfe_runtime::family::{self, Block, Entries, FamilyState, Gradient},
};

/// The constraints on motions (δq, δv) at a state, and the matrix that maps these to (δp, δq).
pub(super) struct ConstrainedMotions {
    /// Independent gradients in (q, v).
    pub(super) gradients: Vec<DVector<f64>>,
    /// ```text
    /// [ L_vq  L_vv ]
    /// [ 1     0    ]
    /// ```
    pub(super) to_momenta: DMatrix<f64>,
}

impl ConstrainedMotions {
    /// An orthonormal basis of the allowed motions, in the order (p, q).
    ///
    /// Momenta of light bodies are small relative to coordinates, those of heavy bodies large. Householder reflections
    /// keep the digits of small rows if the larger rows, and the columns with entries in them, come first.
    pub(super) fn basis(&self) -> DMatrix<f64> {
        let n = self.to_momenta.nrows() / 2;
        let [moved, at_rest] = self.motions().map(|motions| &self.to_momenta * motions);
        if moved.rows(0, n).amax() < moved.rows(n, n).amax() {
            let columns = side_by_side(&moved, &at_rest);
            halves_exchanged(&halves_exchanged(&columns).qr().q())
        } else {
            side_by_side(&at_rest, &moved).qr().q()
        }
    }

    /// Independent motions (δq, δv): changes of the coordinates with the least changes of velocities that they require,
    /// and changes of velocities alone.
    ///
    /// ```text
    /// A_V δq = 0 ,   δv = −A⁺ Ψ_q δq        and        A δv = 0
    /// ```
    fn motions(&self) -> [DMatrix<f64>; 2] {
        let n = self.to_momenta.nrows() / 2;
        let (mut holonomic, mut rows, mut rates) = (Vec::new(), Vec::new(), Vec::new());
        for gradient in &self.gradients {
            let by_q = gradient.rows(0, n).into_owned();
            let by_v = gradient.rows(n, n).into_owned();
            if by_v.iter().all(|entry| *entry == 0.0) {
                let length = norm(by_q.as_slice());
                holonomic.push(by_q / length);
            } else {
                let length = norm(by_v.as_slice());
                rates.push(by_q / length);
                rows.push(by_v / length);
            }
        }
        let [_, coordinates] = split(n, &holonomic);
        let [across, along] = split(n, &rows);
        let by_rows = |of: &[DVector<f64>]| DMatrix::from_fn(of.len(), n, |i, j| of[i][j]);
        let needed = by_rows(&rates) * &coordinates;
        // Without rows there is no equation; a factorisation takes no matrix of size zero.
        let least = match rows.is_empty() {
            true => Some(needed.clone()),
            false => (by_rows(&rows) * &across).lu().solve(&needed),
        };
        // With dependent rows the result would not be finite.
        let least = least.unwrap_or_else(|| needed.map(|_| f64::NAN));
        let velocities = across * -least;
        [
            stacked(&coordinates, &velocities),
            stacked(&DMatrix::zeros(n, along.ncols()), &along),
        ]
    }
}

/// Orthonormal bases of the span of independent unit vectors, and of its orthogonal complement.
fn split(size: usize, vectors: &[DVector<f64>]) -> [DMatrix<f64>; 2] {
    let rank = vectors.len();
    let mut square = DMatrix::zeros(size, size);
    for (k, vector) in vectors.iter().enumerate() {
        square.set_column(k, vector);
    }
    let all = square.qr().q();
    [
        all.columns(0, rank).into_owned(),
        all.columns(rank, size - rank).into_owned(),
    ]
}

/// Stacks one matrix above another.
fn stacked(above: &DMatrix<f64>, below: &DMatrix<f64>) -> DMatrix<f64> {
    let middle = above.nrows();
    DMatrix::from_fn(middle + below.nrows(), above.ncols(), |row, column| {
        if row < middle {
            above[(row, column)]
        } else {
            below[(row - middle, column)]
        }
    })
}

/// Puts one matrix beside another.
fn side_by_side(left: &DMatrix<f64>, right: &DMatrix<f64>) -> DMatrix<f64> {
    let middle = left.ncols();
    DMatrix::from_fn(left.nrows(), middle + right.ncols(), |row, column| {
        if column < middle {
            left[(row, column)]
        } else {
            right[(row, column - middle)]
        }
    })
}

/// Exchanges the upper and the lower half of the rows.
fn halves_exchanged(matrix: &DMatrix<f64>) -> DMatrix<f64> {
    let (rows, columns) = matrix.shape();
    DMatrix::from_fn(rows, columns, |row, column| {
        matrix[((row + rows / 2) % rows, column)]
    })
}

/// The matrices of a chain in the bases at its nodes. The last one maps to the basis of the start, which is that of the
/// end of a periodic motion.
pub(crate) fn reduced<'a>(
    bases: &[DMatrix<f64>],
    matrices: impl Iterator<Item = &'a DMatrix<f64>>,
) -> Result<Vec<DMatrix<f64>>, StepError> {
    let elements = matrices.enumerate();
    let reduced = elements.map(|(element, matrix)| {
        let (before, after) = (&bases[element], &bases[(element + 1) % bases.len()]);
        if before.ncols() != after.ncols() {
            // The rank of the constraints changes along the motion.
            return Err(ConstraintError::RankChanged.into());
        }
        Ok(after.tr_mul(&(matrix * before)))
    });
    reduced.collect()
}

/// The reduced matrix of a motion without elements: the identity on the motions allowed at its start.
pub(crate) fn identity(
    start: Result<DMatrix<f64>, StepError>,
) -> Result<Vec<DMatrix<f64>>, StepError> {
    let size = start?.ncols();
    Ok(vec![DMatrix::identity(size, size)])
}

/// The basis of a model of run-time length at a state.
///
/// # Errors
/// [`StepError`] if the model has no velocity at the state.
#[cfg(feature = "sparse")]
pub(crate) fn basis_of<M: family::Model>(
    model: &M,
    t: f64,
    state: &FamilyState,
) -> Result<DMatrix<f64>, StepError> {
    let (n, m) = (model.len(), model.constraints());
    if m == 0 {
        return Ok(DMatrix::identity(2 * n, 2 * n));
    }
    let velocity = family::allowed_velocity(model, t, state);
    let v = velocity.map_err(|_| StepError::Constraint(ConstraintError::SingularMass))?;
    let mut parts = Parts {
        n,
        to_momenta: DMatrix::zeros(2 * n, 2 * n),
        rows: vec![DVector::zeros(n); m],
        rates: vec![DVector::zeros(n); m],
    };
    let mut unused = [vec![0.0; n], vec![0.0; n], vec![0.0; n]];
    let [z, q, force] = &mut unused;
    let first = Gradient { z, q, force };
    model.second(t, &state.q, &v, first, &mut parts);
    // φ depends on coordinates and time only, so ∂(A v + a)/∂q is dA/dt along the motion.
    let pairs = state.q.iter().zip(&v);
    let moving: Vec<Dual> = pairs.map(|(q, v)| Dual::new(*q, *v)).collect();
    let mut drift = vec![Dual::ZERO; m];
    model.constraint_rows(Dual::new(t, 1.0), &moving, &mut drift, &mut parts);
    for a in 0..n {
        parts.to_momenta[(n + a, a)] = 1.0;
    }
    let mut gradients = Vec::with_capacity(2 * m);
    for (row, rate) in parts.rows.iter().zip(&parts.rates) {
        let both = rate.iter().chain(row.iter()).copied();
        gradients.push(DVector::from_iterator(2 * n, both));
        let of_q = row.iter().copied().chain(std::iter::repeat_n(0.0, n));
        gradients.push(DVector::from_iterator(2 * n, of_q));
    }
    let held = ConstrainedMotions {
        gradients,
        to_momenta: parts.to_momenta,
    };
    Ok(held.basis())
}

/// Collects L_vv, L_vq, A and dA/dt.
#[cfg(feature = "sparse")]
struct Parts {
    n: usize,
    to_momenta: DMatrix<f64>,
    rows: Vec<DVector<f64>>,
    rates: Vec<DVector<f64>>,
}

#[cfg(feature = "sparse")]
impl Entries<f64> for Parts {
    fn add(&mut self, block: Block, row: usize, column: usize, value: f64) {
        match block {
            Block::ZZ => self.to_momenta[(row, self.n + column)] += value,
            Block::ZQ => self.to_momenta[(row, column)] += value,
            _ => {}
        }
    }
}

#[cfg(feature = "sparse")]
impl Entries<Dual> for Parts {
    fn add(&mut self, _: Block, row: usize, column: usize, value: Dual) {
        self.rows[row][column] += value.value;
        self.rates[row][column] += value.slope;
    }
}
