//! Eigenvalues of a product of matrices, without forming the product.
//!
//! The monodromy matrix of a periodic motion is a product of many transition matrices,
//!
//! ```text
//! P = A_m ··· A_2 A_1 ,
//! ```
//!
//! and its eigenvalues are the Floquet multipliers. If some of these are large and others small, the explicit product
//! keeps only the large ones: a multiplier of 1e-20 beside one of 1e+20 is lost in the rounding error of the larger
//! one, and a long product overflows or underflows. The periodic Schur decomposition works on the factors instead. It
//! finds orthogonal matrices Q₁, …, Q_m, with Q_{m+1} = Q₁, such that
//!
//! ```text
//! T_k = Q_{k+1}ᵀ A_k Q_k
//! ```
//!
//! is upper triangular for k < m and upper quasi-triangular (1 × 1 and 2 × 2 diagonal blocks) for k = m. The
//! eigenvalues are then products of diagonal entries and are accumulated with an exponent of their own.
//!
//! # Accuracy
//! What is computed is exact for factors A_k + E_k with ‖E_k‖ of the order of n ε ‖A_k‖, *each factor for itself*.
//! Hence every eigenvalue keeps its relative accuracy, however far the others are from it, as long as no single factor
//! is ill conditioned. The relative error grows no faster than in proportion to m. An eigenvalue of multiplicity r in
//! one Jordan block is known to about the r-th root of that error only: no method on these data can do better.
//!
//! # Method
//! 1. Each factor is scaled by a power of two, if it is close to over- or underflow; for [`multipliers`], all factors
//!    are then balanced by one diagonal similarity of powers of two.
//! 2. Householder reflections make A₁, …, A_{m−1} triangular and A_m a Hessenberg matrix.
//! 3. Implicitly shifted periodic QR steps, two shifts at a time, make the subdiagonal of the last factor vanish. A
//!    diagonal entry of a triangular factor that is zero to round-off is set to zero and split off by one or two steps
//!    without shift.
//! 4. The 2 × 2 blocks that remain are made triangular by complex rotations, again factor by factor.
//!
//! The cost is of the order of m n³, the storage m n².
//!
//! # Reference
//! A. Bojanczyk, G. H. Golub, P. Van Dooren, *The periodic Schur decomposition: algorithms and applications*, Proc.
//! SPIE 1770 (1992); D. Kressner, *Numerical Methods for General and Structured Eigenvalue Problems*, Springer 2005.

mod arithmetic;
mod chain;
mod error;
mod pair;
mod sweep;
#[cfg(test)]
mod tests;

pub use error::PeriodicSchurError;

pub(crate) use arithmetic::{exponent, power_of_two, reflection, times_power_of_two};
pub(crate) use chain::balancing;

use arithmetic::Scaled;
use chain::{Chain, Wanted};
use nalgebra::{Complex, DMatrix};
use std::f64::consts::PI;

/// An eigenvalue of a product, as modulus and argument.
///
/// The modulus is stored as its natural logarithm, so that e^±1000 is represented as well as 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Multiplier {
    /// The natural logarithm of the modulus; −∞ for the eigenvalue zero.
    pub log_modulus: f64,
    /// The argument in (−π, π]: exactly 0 or π for a real eigenvalue, and 0 for the eigenvalue zero.
    pub argument: f64,
}

impl Multiplier {
    /// The modulus |μ|; infinite or zero if it is too large or too small for an `f64`.
    ///
    /// The exponential function costs a relative error of |`log_modulus`| ε.
    pub fn modulus(&self) -> f64 {
        self.log_modulus.exp()
    }

    /// The eigenvalue as a complex number; its imaginary part is exactly zero if the eigenvalue is real.
    ///
    /// The parts are infinite if [`modulus`](Self::modulus) is.
    pub fn to_complex(&self) -> Complex<f64> {
        let modulus = self.modulus();
        if self.argument == 0.0 {
            Complex::new(modulus, 0.0)
        } else if self.argument == PI {
            Complex::new(-modulus, 0.0)
        } else {
            Complex::from_polar(modulus, self.argument)
        }
    }

    fn new(value: Scaled) -> Self {
        let z = value.mantissa;
        let argument = if z.im == 0.0 {
            if z.re < 0.0 { PI } else { 0.0 }
        } else {
            // A pair so close to the negative axis that its argument rounds to ±π is a double real eigenvalue.
            let argument = z.im.atan2(z.re);
            if argument <= -PI { PI } else { argument }
        };
        Self {
            log_modulus: value.ln_modulus(),
            argument,
        }
    }
}

/// Returns the eigenvalues of the product `factors[m − 1] ··· factors[1] factors[0]`, which is never formed.
///
/// The first factor acts first, as the transition matrix of the first element does. The list is ordered by decreasing
/// modulus; complex pairs are adjacent and exact conjugates, positive argument first. Among eigenvalues whose moduli
/// agree to round-off the order is not guaranteed, and a double real eigenvalue may come as a complex pair or as two
/// real eigenvalues, each within its conditioning. A factor that is singular to round-off gives the eigenvalue zero,
/// `log_modulus` = −∞, as far as rounding allows to decide: a second zero may come out as a rounding error of the
/// largest eigenvalue. Factors of size 0 × 0 give the empty list.
///
/// # Errors
/// [`PeriodicSchurError::Empty`] for an empty list; [`NotSquare`](PeriodicSchurError::NotSquare) and
/// [`SizeMismatch`](PeriodicSchurError::SizeMismatch) for sizes that do not match;
/// [`NonFinite`](PeriodicSchurError::NonFinite) for entries that are not finite;
/// [`NoConvergence`](PeriodicSchurError::NoConvergence), which has been seen only if the entries of one factor span the
/// whole range of `f64`.
///
/// # Example
/// A product whose explicit form loses its small eigenvalue:
/// ```
/// use nalgebra::DMatrix;
/// use tfe::periodic_schur::multipliers;
///
/// // Each factor has the eigenvalues 2 and ½, with the eigenvectors (1, 1) and (1, 2).
/// let factor = DMatrix::from_row_slice(2, 2, &[3.5, -1.5, 3.0, -1.0]);
/// let multipliers = multipliers(&vec![factor; 2000])?;
///
/// let log = 2000.0 * 2f64.ln(); // 2²⁰⁰⁰ overflows
/// assert!((multipliers[0].log_modulus - log).abs() < 1e-9);
/// assert!((multipliers[1].log_modulus + log).abs() < 1e-9);
/// # Ok::<(), tfe::periodic_schur::PeriodicSchurError>(())
/// ```
pub fn multipliers(factors: &[DMatrix<f64>]) -> Result<Vec<Multiplier>, PeriodicSchurError> {
    eigenvalues_of_product(factors.to_vec())
}

/// As [`multipliers`], for factors of `order` rows stored in one slice, one factor after the other, each row by row.
///
/// # Errors
/// As [`multipliers`]; [`PeriodicSchurError::Length`] if the slice does not hold a whole number of factors.
///
/// # Example
/// ```
/// use tfe::periodic_schur::multipliers_of;
///
/// let factors = [2.0, 1.0, 0.0, 3.0, /* then */ 5.0, 1.0, 0.0, 7.0];
/// let multipliers = multipliers_of(2, &factors)?;
/// assert!((multipliers[0].modulus() - 21.0).abs() < 1e-12);
/// assert!((multipliers[1].modulus() - 10.0).abs() < 1e-12);
/// # Ok::<(), tfe::periodic_schur::PeriodicSchurError>(())
/// ```
pub fn multipliers_of(
    order: usize,
    entries: &[f64],
) -> Result<Vec<Multiplier>, PeriodicSchurError> {
    if entries.is_empty() {
        return Err(PeriodicSchurError::Empty);
    }
    let size = order.checked_mul(order).filter(|&size| size > 0);
    let size = size.filter(|size| entries.len().is_multiple_of(*size));
    let size = size.ok_or(PeriodicSchurError::Length {
        order,
        found: entries.len(),
    })?;
    let factors = entries.chunks_exact(size);
    eigenvalues_of_product(
        factors
            .map(|factor| DMatrix::from_row_slice(order, order, factor))
            .collect(),
    )
}

fn eigenvalues_of_product(
    factors: Vec<DMatrix<f64>>,
) -> Result<Vec<Multiplier>, PeriodicSchurError> {
    let mut chain = Chain::new(factors, Wanted::Multipliers)?;
    chain.reduce();
    chain.iterate()?;
    eigenvalues(&chain)
}

/// The periodic Schur decomposition of a product, with its orthogonal bases.
///
/// With the factors A₀, …, A_{m−1} as given and Q_m = Q₀,
///
/// ```text
/// A_k Q_k = Q_{k+1} T_k ,        k = 0, …, m − 1 .
/// ```
///
/// The first j columns of Q₀ span an invariant subspace of the product A_{m−1} ··· A₀ wherever j does not cut a 2 × 2
/// block, and those of Q_k the subspace that it is carried to by A_{k−1} ··· A₀: the subspace along the orbit. The
/// eigenvalues come in no particular order along the diagonal.
///
/// # Example
/// ```
/// use nalgebra::DMatrix;
/// use tfe::periodic_schur::PeriodicSchur;
///
/// let factors = [[1.0, 2.0, 3.0, 4.0], [0.0, 1.0, 1.0, 1.0]].map(|a| DMatrix::from_row_slice(2, 2, &a));
/// let schur = PeriodicSchur::new(&factors)?;
///
/// let (q, t) = (schur.orthogonal(), schur.triangular());
/// assert!((&factors[0] * &q[0] - &q[1] * &t[0]).norm() < 1e-14);
/// assert!((&factors[1] * &q[1] - &q[0] * &t[1]).norm() < 1e-14);
/// # Ok::<(), tfe::periodic_schur::PeriodicSchurError>(())
/// ```
#[derive(Clone, Debug)]
pub struct PeriodicSchur {
    orthogonal: Vec<DMatrix<f64>>,
    triangular: Vec<DMatrix<f64>>,
    multipliers: Vec<Multiplier>,
}

impl PeriodicSchur {
    /// Decomposes the product `factors[m − 1] ··· factors[1] factors[0]`.
    ///
    /// Unlike [`multipliers`] it does not balance, which is not an orthogonal transformation: badly scaled coordinates
    /// are better scaled beforehand.
    ///
    /// # Errors
    /// As [`multipliers`]; [`PeriodicSchurError::NonFinite`] too if an entry of a triangular factor overflows.
    pub fn new(factors: &[DMatrix<f64>]) -> Result<Self, PeriodicSchurError> {
        let mut chain = Chain::new(factors.to_vec(), Wanted::SchurForm)?;
        chain.reduce();
        chain.iterate()?;
        let multipliers = eigenvalues(&chain)?;
        let (orthogonal, triangular) = chain.into_parts()?;
        Ok(Self {
            orthogonal,
            triangular,
            multipliers,
        })
    }

    /// The orthogonal matrices Q₀, …, Q_{m−1}.
    pub fn orthogonal(&self) -> &[DMatrix<f64>] {
        &self.orthogonal
    }

    /// The factors T₀, …, T_{m−1}: upper triangular, and the last one quasi-triangular.
    pub fn triangular(&self) -> &[DMatrix<f64>] {
        &self.triangular
    }

    /// The eigenvalues of the product, ordered as by the function [`multipliers`].
    pub fn multipliers(&self) -> &[Multiplier] {
        &self.multipliers
    }
}

/// The eigenvalues of a chain whose last factor is quasi-triangular, by decreasing modulus.
fn eigenvalues(chain: &Chain) -> Result<Vec<Multiplier>, PeriodicSchurError> {
    // A complex pair is one item, so that sorting cannot part it.
    let mut items: Vec<(Multiplier, Option<Multiplier>)> = Vec::new();
    let mut row = 0;
    while row < chain.order() {
        if chain.splits_after(row) {
            items.push((Multiplier::new(chain.diagonal_product(row)), None));
            row += 1;
            continue;
        }
        let [first, second] = pair::eigenvalues(chain, row)?.map(Multiplier::new);
        if first.argument == -second.argument {
            items.push((first, Some(second)));
        } else {
            items.extend([(first, None), (second, None)]);
        }
        row += 2;
    }
    items.sort_by(|(a, _), (b, _)| {
        b.log_modulus
            .total_cmp(&a.log_modulus)
            .then(a.argument.total_cmp(&b.argument))
    });
    Ok(items
        .into_iter()
        .flat_map(|(first, second)| std::iter::once(first).chain(second))
        .collect())
}
