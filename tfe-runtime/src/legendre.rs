//! The pointwise Legendre transform: any model can be evaluated as a Lagrangian or as a Hamiltonian.
//!
//! From L(q, v, t), with v the solution of p = L_v:
//!
//! ```text
//! H_p = v ,  H_q = −L_q ,  H_pp = L_vv⁻¹ ,  H_pq = −L_vv⁻¹ L_vq ,
//! H_qq = −L_qq + L_qv L_vv⁻¹ L_vq ,  Q_p = Q_v H_pp ,  Q_q|p = Q_q|v + Q_v H_pq .
//! ```
//!
//! The inverse transform has the same formula with the letters exchanged, because the transform is its own inverse.
//! Nothing is inverted symbolically; the mass matrix is factored where it is needed.

#[cfg(feature = "std")]
use crate::enclosure::Enclosure;
use crate::error::LegendreError;
use crate::lu::{Block, Singular};
use crate::model::{First, Model, Second, State};

/// A model at one instant, seen as a Lagrangian: `first.z` is L_v, `second.zq` is L_vq.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LagrangianView<const N: usize> {
    /// The momentum p = L_v.
    pub p: [f64; N],
    /// L(q, v, t).
    pub lagrangian: f64,
    /// L_v, L_q and Q.
    pub first: First<f64, N>,
    /// L_vv, L_vq, L_qq, ∂Q/∂v and ∂Q/∂q at constant v.
    pub second: Second<f64, N>,
}

/// A model at one instant, seen as a Hamiltonian: `first.z` is H_p, `second.zq` is H_pq.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HamiltonianView<const N: usize> {
    /// The velocity v = H_p.
    pub v: [f64; N],
    /// H(q, p, t).
    pub hamiltonian: f64,
    /// H_p, H_q and Q.
    pub first: First<f64, N>,
    /// H_pp, H_pq, H_qq, ∂Q/∂p and ∂Q/∂q at constant p.
    pub second: Second<f64, N>,
}

/// The state (q, p) that belongs to given coordinates and velocities.
///
/// # Errors
/// If the model is a Hamiltonian: [`LegendreError::Singular`] if H_pp is singular, [`LegendreError::Stalled`] if the
/// iteration does not converge, [`LegendreError::NonFinite`] if a value is not finite.
pub fn state<M, const N: usize>(
    model: &M,
    t: f64,
    q: &[f64; N],
    v: &[f64; N],
) -> Result<State<N>, LegendreError>
where
    M: Model<N>,
{
    Ok(State {
        q: *q,
        p: momentum(model, t, q, v)?,
    })
}

/// The momentum p = L_v.
///
/// # Errors
/// If the model is a Hamiltonian: [`LegendreError::Singular`] if H_pp is singular, [`LegendreError::Stalled`] if the
/// iteration does not converge, [`LegendreError::NonFinite`] if a value is not finite.
pub fn momentum<M, const N: usize>(
    model: &M,
    t: f64,
    q: &[f64; N],
    v: &[f64; N],
) -> Result<[f64; N], LegendreError>
where
    M: Model<N>,
{
    if const { M::FORM.is_lagrangian() } {
        finite(derivative(model, t, q, v))
    } else {
        conjugate(model, t, q, v, &[0.0; N])
    }
}

/// The velocity v = H_p. For a Lagrangian it is found by Newton's method from `guess`, such as the last known velocity.
///
/// # Errors
/// If the model is a Lagrangian: [`LegendreError::Singular`] if L_vv is singular, [`LegendreError::Stalled`] if the
/// iteration does not converge, [`LegendreError::NonFinite`] if a value is not finite.
pub fn velocity<M, const N: usize>(
    model: &M,
    t: f64,
    q: &[f64; N],
    p: &[f64; N],
    guess: &[f64; N],
) -> Result<[f64; N], LegendreError>
where
    M: Model<N>,
{
    if const { M::FORM.is_lagrangian() } {
        conjugate(model, t, q, p, guess)
    } else {
        finite(derivative(model, t, q, p))
    }
}

/// The energy H(q, p, t), with the velocity given; NaN if the velocity is needed and NaN.
pub fn energy_at<M, const N: usize>(
    model: &M,
    t: f64,
    q: &[f64; N],
    p: &[f64; N],
    v: &[f64; N],
) -> f64
where
    M: Model<N>,
{
    if const { M::FORM.is_lagrangian() } {
        dot(p, v) - model.energy_function(t, q, v)
    } else {
        model.energy_function(t, q, p)
    }
}

/// The second argument of the energy function: v for a Lagrangian, p for a Hamiltonian.
#[cfg(feature = "std")]
fn argument<'a, M: Model<N>, const N: usize>(p: &'a [f64; N], v: &'a [f64; N]) -> &'a [f64; N] {
    if const { M::FORM.is_lagrangian() } {
        v
    } else {
        p
    }
}

/// A bound of the rounding error of [`energy_at`] where it is a difference of nearly equal numbers, as 1 − cos q is
/// near zero: the width of the enclosure of that function at (q, p). Zero where nothing is known.
#[cfg(feature = "std")]
#[cold]
pub fn energy_rounding<M, const N: usize>(
    model: &M,
    t: f64,
    q: &[f64; N],
    p: &[f64; N],
    v: &[f64; N],
) -> f64
where
    M: Model<N>,
{
    let z = argument::<M, N>(p, v);
    let exactly = |x: f64| Enclosure::between(x, x);
    let bounds = model.energy_function(exactly(t), &q.map(exactly), &z.map(exactly));
    bounds.width()
}

/// A bound of the rounding errors of forces where they are differences of nearly equal numbers, as in an equilibrium:
/// the largest width of the enclosures of L_q (or H_q) and Q at (q, p). Zero where nothing is known.
#[cfg(feature = "std")]
#[cold]
pub fn force_rounding<M, const N: usize>(
    model: &M,
    t: f64,
    q: &[f64; N],
    p: &[f64; N],
    v: &[f64; N],
) -> f64
where
    M: Model<N>,
{
    let z = argument::<M, N>(p, v);
    let exactly = |x: f64| Enclosure::between(x, x);
    let mut first = First::<Enclosure, N>::zero();
    model.first(exactly(t), &q.map(exactly), &z.map(exactly), &mut first);
    let bounds = first.q.iter().chain(&first.force);
    bounds.map(|bounds| bounds.width()).fold(0.0, f64::max)
}

/// The energy H(q, p, t); for a Lagrangian p·v − L.
///
/// # Errors
/// If the model is a Lagrangian: [`LegendreError::Singular`] if L_vv is singular, [`LegendreError::Stalled`] if the
/// iteration does not converge, [`LegendreError::NonFinite`] if a value is not finite.
pub fn energy<M, const N: usize>(
    model: &M,
    t: f64,
    q: &[f64; N],
    p: &[f64; N],
) -> Result<f64, LegendreError>
where
    M: Model<N>,
{
    if const { M::FORM.is_lagrangian() } {
        let v = conjugate(model, t, q, p, &[0.0; N])?;
        Ok(energy_at(model, t, q, p, &v))
    } else {
        Ok(model.energy_function(t, q, p))
    }
}

/// The model as a Lagrangian at (t, q, v).
///
/// # Errors
/// If the model is a Hamiltonian: [`LegendreError::Singular`] if H_pp is singular, [`LegendreError::Stalled`] if the
/// iteration does not converge, [`LegendreError::NonFinite`] if a value is not finite.
pub fn lagrangian_view<M, const N: usize>(
    model: &M,
    t: f64,
    q: &[f64; N],
    v: &[f64; N],
) -> Result<LagrangianView<N>, LegendreError>
where
    M: Model<N>,
{
    lagrangian_view_from(model, t, q, v, &[0.0; N])
}

/// The same, with an initial guess of the momentum.
pub(crate) fn lagrangian_view_from<M, const N: usize>(
    model: &M,
    t: f64,
    q: &[f64; N],
    v: &[f64; N],
    guess: &[f64; N],
) -> Result<LagrangianView<N>, LegendreError>
where
    M: Model<N>,
{
    let (mut first, mut second) = (First::ZERO, Second::ZERO);
    if const { M::FORM.is_lagrangian() } {
        model.second(t, q, v, &mut first, &mut second);
        let lagrangian = model.energy_function(t, q, v);
        Ok(LagrangianView {
            p: first.z,
            lagrangian,
            first,
            second,
        })
    } else {
        let p = conjugate(model, t, q, v, guess)?;
        model.second(t, q, &p, &mut first, &mut second);
        let lagrangian = dot(&p, v) - model.energy_function(t, q, &p);
        let (first, second) = transform(&p, &first, &second)?;
        Ok(LagrangianView {
            p,
            lagrangian,
            first,
            second,
        })
    }
}

/// The model as a Hamiltonian at (t, q, p).
///
/// # Errors
/// If the model is a Lagrangian: [`LegendreError::Singular`] if L_vv is singular, [`LegendreError::Stalled`] if the
/// iteration does not converge, [`LegendreError::NonFinite`] if a value is not finite.
pub fn hamiltonian_view<M, const N: usize>(
    model: &M,
    t: f64,
    q: &[f64; N],
    p: &[f64; N],
) -> Result<HamiltonianView<N>, LegendreError>
where
    M: Model<N>,
{
    let (mut first, mut second) = (First::ZERO, Second::ZERO);
    if const { M::FORM.is_lagrangian() } {
        let v = conjugate(model, t, q, p, &[0.0; N])?;
        model.second(t, q, &v, &mut first, &mut second);
        let hamiltonian = dot(p, &v) - model.energy_function(t, q, &v);
        let (first, second) = transform(&v, &first, &second)?;
        Ok(HamiltonianView {
            v,
            hamiltonian,
            first,
            second,
        })
    } else {
        model.second(t, q, p, &mut first, &mut second);
        let hamiltonian = model.energy_function(t, q, p);
        Ok(HamiltonianView {
            v: first.z,
            hamiltonian,
            first,
            second,
        })
    }
}

/// The derivatives of the conjugate function, given those of the declared one at z.
///
/// With F*(y) = y·z − F(z): F*_y = z, F*_q = −F_q, F*_yy = F_zz⁻¹, and so on as above.
fn transform<const N: usize>(
    z: &[f64; N],
    first: &First<f64, N>,
    second: &Second<f64, N>,
) -> Result<(First<f64, N>, Second<f64, N>), LegendreError> {
    let zz = Block::of(&second.zz)
        .map_err(|singular| LegendreError::Singular {
            coordinate: singular.column,
        })?
        .inverse();
    let mut conjugate_first = First { z: *z, ..*first };
    let mut conjugate = Second { zz, ..Second::ZERO };
    for a in 0..N {
        conjugate_first.q[a] = -first.q[a];
        for b in 0..N {
            for c in 0..N {
                conjugate.zq[a][b] -= zz[a][c] * second.zq[c][b];
                conjugate.force_z[a][b] += second.force_z[a][c] * zz[c][b];
            }
        }
    }
    for a in 0..N {
        for b in 0..N {
            // F_qz F_zz⁻¹ F_zq = −F_qz F*_yq
            let (mut qq, mut force_q) = (-second.qq[a][b], second.force_q[a][b]);
            for c in 0..N {
                qq -= second.zq[c][a] * conjugate.zq[c][b];
                force_q += second.force_z[a][c] * conjugate.zq[c][b];
            }
            conjugate.qq[a][b] = qq;
            conjugate.force_q[a][b] = force_q;
        }
    }
    Ok((conjugate_first, conjugate))
}

/// The derivative by z of the function by which the model is declared.
fn derivative<M, const N: usize>(model: &M, t: f64, q: &[f64; N], z: &[f64; N]) -> [f64; N]
where
    M: Model<N>,
{
    let mut first = First::ZERO;
    model.first(t, q, z, &mut first);
    first.z
}

/// The z for which ∂/∂z equals `target`: the momentum that belongs to a velocity, or the velocity that belongs to a
/// momentum.
#[cfg_attr(not(feature = "alloc"), inline(never))] // small programs
pub(crate) fn conjugate<M, const N: usize>(
    model: &M,
    t: f64,
    q: &[f64; N],
    target: &[f64; N],
    guess: &[f64; N],
) -> Result<[f64; N], LegendreError>
where
    M: Model<N>,
{
    const MAX: u32 = 60;
    let (mut first, mut zz) = (First::ZERO, [[0.0; N]; N]);
    let mut search = Search::new(guess, target);
    for iteration in 0..MAX {
        model.first_and_mass(t, q, &search.z, &mut first, &mut zz);
        // For a quadratic function one iteration suffices; a second one removes the rounding error of a long first one.
        let enough = match (M::FACTS.quadratic_in_z, iteration) {
            (true, 0) => 1e-6,
            (true, _) => f64::INFINITY,
            (false, _) => f64::EPSILON,
        };
        if search.ends(&first.z, &zz, enough)? {
            return Ok(search.z);
        }
        if const { M::FACTS.quadratic_in_z } {
            continue;
        }
        // Damped Newton steps, for functions such as −m√(1 − v²) that are undefined where a full step may lead.
        let mut fraction = 1.0;
        while search.residual > 1e-8 * search.scale
            && fraction > 1e-6
            && !search.is_improved(&derivative(model, t, q, &search.z))
        {
            fraction *= 0.5;
            search.advance(fraction);
        }
    }
    Err(LegendreError::Stalled {
        iterations: MAX,
        residual: search.residual,
    })
}

/// Newton's method for the z for which ∂/∂z equals a target. Inlined, so that the few numbers of a model with few
/// coordinates stay in registers: [`conjugate`] stands in the iteration of elements.
struct Search<'a, const N: usize> {
    target: &'a [f64; N],
    z: [f64; N],
    /// The z from which the last step was made, and that step.
    start: [f64; N],
    step: [f64; N],
    /// The residual there, and the size of its terms.
    residual: f64,
    scale: f64,
}

impl<'a, const N: usize> Search<'a, N> {
    #[cfg_attr(feature = "alloc", inline(always))]
    fn new(guess: &[f64; N], target: &'a [f64; N]) -> Self {
        Self {
            target,
            z: *guess,
            start: *guess,
            step: [0.0; N],
            residual: f64::INFINITY,
            scale: 0.0,
        }
    }

    /// Makes a step, given ∂/∂z and ∂²/∂z∂z. Whether z is the solution: before the step, or after a step of at most the
    /// fraction `enough` of z.
    #[cfg_attr(feature = "alloc", inline(always))]
    fn ends(
        &mut self,
        by_z: &[f64; N],
        zz: &[[f64; N]; N],
        enough: f64,
    ) -> Result<bool, LegendreError> {
        for a in 0..N {
            self.step[a] = by_z[a] - self.target[a];
        }
        let residual = largest(&self.step);
        if !residual.is_finite() {
            return Err(LegendreError::NonFinite);
        }
        // The residual of a regular problem cannot be smaller than the rounding error of ∂/∂z; this limit is reached
        // once the residual is small relative to its terms and no longer decreases.
        self.scale = largest(by_z).max(largest(self.target));
        if residual == 0.0
            || (residual >= 0.5 * self.residual && residual <= 64.0 * f64::EPSILON * self.scale)
        {
            return Ok(true);
        }
        self.residual = residual;
        solve(zz, &mut self.step).map_err(|singular| LegendreError::Singular {
            coordinate: singular.column,
        })?;
        self.start = self.z;
        self.advance(1.0);
        if !(largest(&self.step) <= enough * largest(&self.z)) {
            return Ok(false);
        }
        finite(self.z)?;
        Ok(true)
    }

    /// Makes a fraction of the step.
    #[cfg_attr(feature = "alloc", inline(always))]
    fn advance(&mut self, fraction: f64) {
        for a in 0..N {
            self.z[a] = self.start[a] - fraction * self.step[a];
        }
    }

    /// Whether the residual is less with this ∂/∂z than it was before the step, and not NaN.
    #[cfg_attr(feature = "alloc", inline(always))]
    fn is_improved(&self, by_z: &[f64; N]) -> bool {
        distance(by_z, self.target) < self.residual
    }
}

/// Solves matrix · x = vector in place. With many coordinates the matrix is mostly diagonal, and then one division for
/// each replaces N³/3 operations.
fn solve<const N: usize>(matrix: &[[f64; N]; N], vector: &mut [f64; N]) -> Result<(), Singular> {
    if !is_diagonal(matrix) {
        Block::of(matrix)?.solve(vector);
        return Ok(());
    }
    for column in 0..N {
        let pivot = matrix[column][column];
        if pivot == 0.0 || !pivot.is_finite() {
            return Err(Singular { column });
        }
        vector[column] /= pivot;
    }
    Ok(())
}

fn is_diagonal<const N: usize>(matrix: &[[f64; N]; N]) -> bool {
    for a in 0..N {
        for b in 0..N {
            // A NaN counts as non-zero.
            if a != b && matrix[a][b] != 0.0 {
                return false;
            }
        }
    }
    true
}

fn dot<const N: usize>(x: &[f64; N], y: &[f64; N]) -> f64 {
    x.iter().zip(y).map(|(x, y)| x * y).sum()
}

fn distance<const N: usize>(x: &[f64; N], y: &[f64; N]) -> f64 {
    let mut difference = *x;
    for a in 0..N {
        difference[a] -= y[a];
    }
    largest(&difference)
}

/// The larger of two numbers, in one instruction. If the second is NaN, it is the first.
#[inline(always)]
pub(crate) fn larger(a: f64, b: f64) -> f64 {
    if a < b { b } else { a }
}

/// The largest magnitude; NaN if one of the numbers is NaN.
pub(crate) fn largest(values: &[f64]) -> f64 {
    let mut largest = 0.0_f64;
    for value in values {
        if value.is_nan() {
            return f64::NAN;
        }
        largest = larger(largest, value.abs());
    }
    largest
}

fn finite<const N: usize>(values: [f64; N]) -> Result<[f64; N], LegendreError> {
    if largest(&values).is_finite() {
        Ok(values)
    } else {
        Err(LegendreError::NonFinite)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn diagonal_matrices_are_solved_to_the_bit_as_others() {
        let full = [[3.0, 0.0, 0.0], [0.0, 0.7, 0.0], [0.0, 0.0, -11.0]];
        let (mut short, mut long) = ([1.0, 0.1, 7.0], [1.0, 0.1, 7.0]);
        solve(&full, &mut short).expect("regular");
        Block::of(&full).expect("regular").solve(&mut long);
        assert_eq!(short, long);
    }

    #[test]
    fn zeros_and_what_is_no_number_are_named() {
        for entry in [0.0, f64::NAN, f64::INFINITY] {
            let matrix = [[1.0, 0.0], [0.0, entry]];
            let outcome = solve(&matrix, &mut [1.0, 1.0]);
            assert_eq!(outcome, Err(Singular { column: 1 }));
        }
        // Beside the diagonal it is not passed over.
        let (beside, mut solution) = ([[1.0, f64::NAN], [0.0, 1.0]], [1.0, 1.0]);
        solve(&beside, &mut solution).expect("pivots");
        assert!(solution[0].is_nan());
    }
}
