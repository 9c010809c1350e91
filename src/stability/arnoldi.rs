//! The eigenvalue of largest modulus of an operator given only by its products with vectors (restarted Arnoldi
//! iteration).

use super::schur_order::Ordered;
use crate::numbers::{Short, is_tolerance, norm};
use nalgebra::{Complex, DMatrix, DVector};
use std::error::Error;
use std::fmt;

/// The eigenvalue of largest modulus of an operator, as found by iteration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dominant {
    /// The eigenvalue; of a complex pair, the one with positive imaginary part.
    pub eigenvalue: Complex<f64>,
    /// The residual ‖A X − X B‖, with an orthonormal X of one column, or two for a complex pair, and the eigenvalue in
    /// B: the eigenvalue is exact for an operator that differs from A by this much.
    pub residual: f64,
    /// The number of products with the operator.
    pub products: usize,
}

impl Dominant {
    /// The modulus |λ|: the spectral radius of the operator.
    pub fn radius(&self) -> f64 {
        self.eigenvalue.norm()
    }
}

/// Why the eigenvalue of largest modulus was not found.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum DominantError {
    /// The operator has size zero.
    Empty,
    /// The tolerance is not a number from 0 to below 1.
    Tolerance {
        /// The tolerance given.
        tolerance: f64,
    },
    /// A product with the operator is not finite.
    NotFinite,
    /// The eigenvalues of a small projected matrix did not converge.
    Projected,
    /// No eigenvalue converged, for example because many have the same modulus, as for a step that conserves energy
    /// about a stable equilibrium.
    NotConverged {
        /// The best value so far.
        best: Dominant,
        /// The tolerance, relative to the modulus of the eigenvalue.
        tolerance: f64,
    },
}

impl fmt::Display for DominantError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Empty => f.write_str("the operator has no rows"),
            Self::Tolerance { tolerance } => write!(
                f,
                "the tolerance is {}, but it must be at least 0 and less than 1",
                Short(*tolerance)
            ),
            Self::NotFinite => f.write_str("a product of the operator is not finite"),
            Self::Projected => f.write_str("the eigenvalues of the projection did not converge"),
            Self::NotConverged { best, tolerance } => write!(
                f,
                "no eigenvalue of largest modulus after {} products: the best has modulus {} with the residual {:.1e}, {tolerance:.1e} of it was asked for; \
                 many eigenvalues of nearly the same modulus separate slowly or never; allow more `products`, or more `vectors`",
                best.products,
                Short(best.radius()),
                best.residual
            ),
        }
    }
}

impl Error for DominantError {}

/// The limits of the iteration for an eigenvalue.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Iteration {
    /// The residual at which the iteration ends, relative to the modulus of the eigenvalue.
    pub tolerance: f64,
    /// The largest number of products.
    pub products: usize,
    /// The number of orthogonal vectors kept, which determines the memory; at least 6.
    pub vectors: usize,
}

impl Default for Iteration {
    /// 10⁻¹¹, 10 000 products, 100 vectors.
    fn default() -> Self {
        Self {
            tolerance: 1e-11,
            products: 10_000,
            vectors: 100,
        }
    }
}

/// The eigenvalue of largest modulus of a linear operator A on `size` numbers that is given by its products: `apply`
/// receives x and writes A x.
///
/// The method is Arnoldi's with thick restarts: an orthonormal basis of a Krylov space and the Schur form of the
/// projection on it, restarted with the half that belongs to the largest eigenvalues.
///
/// # Not guaranteed
/// That no eigenvalue is larger: one that the start vector (pseudo-random, always the same) does not contain is not
/// found. Eigenvalues of nearly equal modulus converge slowly: with a relative gap g after the largest, some g^(−½)
/// products at best. About a stable equilibrium, all eigenvalues of a symplectic step have modulus one, and the
/// iteration can converge only to one that is separated from the others on the unit circle.
/// # Errors
/// [`DominantError::Empty`] for size zero, [`Tolerance`](DominantError::Tolerance) for a tolerance that is none,
/// [`NotFinite`](DominantError::NotFinite) for a product that is not finite,
/// [`Projected`](DominantError::Projected) if the eigenvalues of the projection are not found,
/// [`NotConverged`](DominantError::NotConverged), with the best value and its residual, if no eigenvalue converges.
/// # Reference
/// G. W. Stewart, *A Krylov–Schur algorithm for large eigenproblems*, SIAM J. Matrix Anal. Appl. 23 (2001) 601–614.
///
/// ```
/// use tfe::stability::{self, Iteration};
///
/// // Triangular, with the eigenvalues ½ + ½/(1 + i).
/// let apply = |x: &[f64], y: &mut [f64]| {
///     for i in 0..500 {
///         y[i] = x[i] * (0.5 + 0.5 / (1.0 + i as f64)) + if i > 0 { 0.1 * x[i - 1] } else { 0.0 };
///     }
/// };
/// let found = stability::dominant_of(500, apply, Iteration::default())?;
/// assert!((found.radius() - 1.0).abs() < 1e-10);
/// assert!(found.residual < 1e-10 && found.products < 200);
/// # Ok::<(), stability::DominantError>(())
/// ```
pub fn dominant_of(
    size: usize,
    mut apply: impl FnMut(&[f64], &mut [f64]),
    control: Iteration,
) -> Result<Dominant, DominantError> {
    iterate(size, &mut apply, control)
}

/// A product of the operator.
type Apply<'a> = dyn FnMut(&[f64], &mut [f64]) + 'a;

/// The iteration, without type parameters, so that it is compiled only once.
fn iterate(
    size: usize,
    apply: &mut Apply<'_>,
    control: Iteration,
) -> Result<Dominant, DominantError> {
    if size == 0 {
        return Err(DominantError::Empty);
    }
    if !is_tolerance(control.tolerance) {
        let tolerance = control.tolerance;
        return Err(DominantError::Tolerance { tolerance });
    }
    let vectors = control.vectors.max(6).min(size);
    let mut krylov = Krylov::new(size, vectors);
    let mut products = 0;
    loop {
        let invariant = krylov.expand(apply, &mut products)?;
        let mut ordered =
            Ordered::new(krylov.projection()).map_err(|_| DominantError::Projected)?;
        ordered.lead(krylov.count.div_ceil(2));
        let coupling = krylov.coupling(&ordered);
        let best = Dominant {
            eigenvalue: ordered.leading(),
            residual: coupling[..ordered.block(0)]
                .iter()
                .fold(0.0, |norm: f64, b| norm.hypot(*b)),
            products,
        };
        let tolerance = control.tolerance;
        if !best.residual.is_finite() {
            return Err(DominantError::NotFinite);
        }
        if best.residual <= tolerance * best.radius() || invariant {
            return Ok(best);
        }
        if products >= control.products || krylov.count == size {
            return Err(DominantError::NotConverged { best, tolerance });
        }
        krylov.restart(&ordered, &coupling);
    }
}

/// A Krylov decomposition A V = V H + v bᵀ with orthonormal columns (V, v).
struct Krylov {
    /// (V, v), and unused columns.
    basis: DMatrix<f64>,
    /// H, and bᵀ in the row below it.
    projected: DMatrix<f64>,
    /// The number of columns of V.
    count: usize,
}

impl Krylov {
    /// Begins with a vector that has a component in every direction.
    fn new(size: usize, vectors: usize) -> Self {
        let mut basis = DMatrix::zeros(size, vectors + 1);
        let mut random = 0x2545_f491_4f6c_dd1d_u64;
        for entry in basis.column_mut(0).iter_mut() {
            // Marsaglia's xorshift.
            random ^= random << 13;
            random ^= random >> 7;
            random ^= random << 17;
            *entry = (random >> 11) as f64 / (1_u64 << 53) as f64 - 0.5;
        }
        let norm = basis.column(0).norm();
        if norm > 0.0 {
            basis.column_mut(0).unscale_mut(norm);
        }
        Self {
            basis,
            projected: DMatrix::zeros(vectors + 1, vectors),
            count: 0,
        }
    }

    /// Extends the basis to its full size; returns true if it spans an invariant space before that.
    fn expand(
        &mut self,
        apply: &mut Apply<'_>,
        products: &mut usize,
    ) -> Result<bool, DominantError> {
        let size = self.basis.nrows();
        let mut image = DVector::zeros(size);
        let mut start = DVector::zeros(size);
        while self.count < self.projected.ncols() {
            let column = self.count;
            start.copy_from(&self.basis.column(column));
            apply(start.as_slice(), image.as_mut_slice());
            *products += 1;
            let whole = norm(image.as_slice());
            if !whole.is_finite() {
                return Err(DominantError::NotFinite);
            }
            self.count += 1;
            let known = self.basis.columns(0, self.count);
            // Orthogonalise twice: the first pass leaves cancellation errors.
            for _ in 0..2 {
                let parts = known.tr_mul(&image);
                image.gemv(-1.0, &known, &parts, 1.0);
                for (row, part) in parts.iter().enumerate() {
                    self.projected[(row, column)] += part;
                }
            }
            let rest = norm(image.as_slice());
            self.projected[(self.count, column)] = rest;
            if rest <= 1e2 * f64::EPSILON * whole {
                self.basis.column_mut(self.count).fill(0.0);
                return Ok(true);
            }
            self.basis
                .column_mut(self.count)
                .copy_from(&(&image / rest));
        }
        Ok(false)
    }

    /// The matrix H.
    fn projection(&self) -> DMatrix<f64> {
        self.projected
            .view((0, 0), (self.count, self.count))
            .into_owned()
    }

    /// The vector bᵀ Z.
    fn coupling(&self, ordered: &Ordered) -> Vec<f64> {
        let row = self.projected.view((self.count, 0), (1, self.count));
        (row * ordered.vectors()).iter().copied().collect()
    }

    /// Reduces the basis to the space of the leading eigenvalues.
    fn restart(&mut self, ordered: &Ordered, coupling: &[f64]) {
        let kept = ordered.kept();
        let turned = self.basis.columns(0, self.count) * ordered.vectors().columns(0, kept);
        let last = self.basis.column(self.count).into_owned();
        self.basis.columns_mut(0, kept).copy_from(&turned);
        self.basis.set_column(kept, &last);
        self.projected.fill(0.0);
        self.projected
            .view_mut((0, 0), (kept, kept))
            .copy_from(&ordered.triangular().view((0, 0), (kept, kept)));
        for (column, value) in coupling[..kept].iter().enumerate() {
            self.projected[(kept, column)] = *value;
        }
        self.count = kept;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A block diagonal operator of rotations by angles, multiplied by moduli.
    fn turns(moduli: &[f64]) -> impl Fn(&[f64], &mut [f64]) {
        move |x, y| {
            for (k, modulus) in moduli.iter().enumerate() {
                let (sin, cos) = (0.3 + 0.01 * k as f64).sin_cos();
                y[2 * k] = modulus * (cos * x[2 * k] - 2.0 * sin * x[2 * k + 1]);
                y[2 * k + 1] = modulus * (0.5 * sin * x[2 * k] + cos * x[2 * k + 1]);
            }
        }
    }

    #[test]
    fn a_pair_outside_of_the_crowd() {
        let mut moduli = vec![1.0; 300];
        moduli[120] = 1.02;
        let found = dominant_of(600, turns(&moduli), Iteration::default()).expect("a pair");
        assert!((found.radius() - 1.02).abs() < 1e-10, "{found:?}");
        assert!((found.eigenvalue.arg() - 1.5).abs() < 1e-10, "{found:?}");
    }

    #[test]
    fn small_operators_are_exhausted() {
        for count in 1..8 {
            let moduli: Vec<f64> = (0..count).map(|k| 1.0 + 0.1 * f64::from(k)).collect();
            let size = 2 * moduli.len();
            let found = dominant_of(size, turns(&moduli), Iteration::default()).expect("a pair");
            let expected = moduli[moduli.len() - 1];
            assert!((found.radius() - expected).abs() < 1e-12, "{found:?}");
        }
        let same = dominant_of(50, |x, y| y.copy_from_slice(x), Iteration::default());
        let same = same.expect("one product shows it");
        assert!((same.radius() - 1.0).abs() < 1e-14 && same.products == 1);
    }

    #[test]
    fn operators_of_any_size() {
        // An eigenvalue pair outside the others, as of a step that grows or decays strongly.
        for size in [1e-200, 1e200] {
            let mut moduli = vec![size; 40];
            moduli[12] = 1.5 * size;
            let found = dominant_of(80, turns(&moduli), Iteration::default()).expect("a pair");
            assert!((found.radius() / size - 1.5).abs() < 1e-10, "{found:?}");
            assert!((found.eigenvalue.arg() - 0.42).abs() < 1e-10, "{found:?}");
        }
    }

    #[test]
    fn a_tolerance_that_is_none_is_refused() {
        for tolerance in [f64::NAN, f64::INFINITY, -1.0, 1.0] {
            let control = Iteration {
                tolerance,
                ..Iteration::default()
            };
            let told = dominant_of(4, turns(&[1.0, 2.0]), control).expect_err("no tolerance");
            assert!(matches!(told, DominantError::Tolerance { .. }), "{told}");
        }
    }

    #[test]
    fn what_does_not_converge_is_told() {
        let control = Iteration {
            products: 500,
            ..Iteration::default()
        };
        // Angles all around one circle: all eigenvalues have the same modulus.
        let apply = |x: &[f64], y: &mut [f64]| {
            for i in 0..2000 {
                y[i] = x[(i + 1) % 2000];
            }
        };
        match dominant_of(2000, apply, control) {
            Err(DominantError::NotConverged { best, .. }) => {
                assert!(best.products >= 500 && best.residual > 1e-6, "{best:?}");
            }
            other => panic!("{other:?}"),
        }
        let nothing = dominant_of(3, |_, y| y.fill(f64::NAN), control);
        assert_eq!(nothing, Err(DominantError::NotFinite));
        assert_eq!(
            dominant_of(0, |_, _| {}, control),
            Err(DominantError::Empty)
        );
        let zero = dominant_of(5, |_, y| y.fill(0.0), control).expect("zero");
        assert_eq!(zero.radius(), 0.0);
    }
}
