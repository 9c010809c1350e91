//! Elements backwards: products of one row with the derivative of an element, and derivatives by many parameters at once (T-127).
//!
//! Where the element's own iteration contracts, so does the transposed one, and no tangent is set up and factored. With the seeds φ of forces at the points of a collocated element,
//!
//! ```text
//! φ_l = h b_l λ_p + h Σ_i A_il μ_i ,     F_l = (L_qq + Q_q)ᵀ φ_l − L_vqᵀ μ_l ,
//! L_vv μ_j = h b_j λ_q + h Σ_l A_lj F_l + (L_qv + Q_v)ᵀ φ_j ;     λ_p += Σ μ_i ,     λ_q += Σ F_l .                  (T-150)
//! ```

use crate::condense::Direction;
use crate::error::StepError;
use crate::lu::Block;
use crate::model::{First, Form, Model, Second};
use crate::phase_form::PhaseForm;
use crate::tape::Tape;
use crate::velocity_form::{PointDerivatives, VelocityForm};
use alloc::{vec, vec::Vec};

/// Whether directions are parameters and nothing else, and so many that all parameters are differentiated at once.
pub(crate) fn are_parameters<M: Model<N>, const N: usize>(
    model: &M,
    directions: &[Direction],
) -> bool {
    /// With fewer, dual numbers take less.
    const LEAST: usize = 4;
    let is_one = |direction: &Direction| {
        let alone = Direction {
            parameter: direction.parameter,
            ..Direction::default()
        };
        let index = direction.parameter.and_then(|one| one.any(model));
        *direction == alone && index.is_some_and(|index| index < model.parameters())
    };
    M::CONSTRAINTS.is_empty() && directions.len() >= LEAST && directions.iter().all(is_one)
}

/// What weights of first derivatives at points have of parameters, into the sums of directions.
pub(crate) struct Backwards<'a, M, const N: usize> {
    model: &'a M,
    tape: Tape,
    sums: Vec<f64>,
}

impl<'a, M: Model<N>, const N: usize> Backwards<'a, M, N> {
    pub(crate) fn new(model: &'a M) -> Self {
        Self {
            model,
            tape: Tape::default(),
            sums: vec![0.0; model.parameters()],
        }
    }

    /// Of an element in phase space, with μ of (T-127).
    pub(crate) fn of_phase(&mut self, equations: &PhaseForm<'_, M, N>, x: &[f64], mu: &[f64]) {
        let (forces, velocities) = mu.as_chunks::<N>().0.split_at(equations.scheme.points());
        for (k, (force, velocity)) in forces.iter().zip(velocities).enumerate() {
            let (t, q, p) = equations.place(k, x);
            let weights = First {
                z: *velocity,
                q: force.map(|weight| -weight),
                force: *force,
            };
            (self.tape).add_derivatives(self.model, (t, &q, &p), &weights, &mut self.sums);
        }
    }

    /// Of an element in velocities, with λ of the momenta at its end.
    pub(crate) fn of_velocities(
        &mut self,
        equations: &mut VelocityForm<'_, M, N>,
        x: &[f64],
        (lambda, mu): (&[f64; N], &[f64]),
    ) -> Result<(), StepError> {
        let (rates, mu) = (x.as_chunks::<N>().0, mu.as_chunks::<N>().0);
        let (scheme, h) = (equations.scheme, equations.span.h);
        let points = scheme.points();
        for l in 0..points {
            let (mut momentum, mut force) = ([0.0; N], [0.0; N]);
            for a in 0..N {
                force[a] = h * scheme.weights[l] * lambda[a];
                for (i, mu) in mu.iter().enumerate() {
                    momentum[a] -= scheme.momentum[i * points + l] * mu[a];
                    force[a] += h * scheme.force[i * points + l] * mu[a];
                }
            }
            let (t, q, v) = equations.place(l, rates);
            let (z, weights) = match M::FORM {
                Form::Lagrangian => {
                    let weights = First {
                        z: momentum,
                        q: force,
                        force,
                    };
                    (v, weights)
                }
                // At fixed v the momentum moves: H_pp δp = −H_pa, and with it H_q and Q.
                Form::Hamiltonian => {
                    let mut point = PointDerivatives {
                        p: [0.0; N],
                        force: [0.0; N],
                        second: Second::ZERO,
                    };
                    equations.derivatives(l, rates, &mut point)?;
                    let second = &point.second;
                    let mut of_z = [0.0; N];
                    for a in 0..N {
                        for b in 0..N {
                            of_z[b] -= momentum[a] * second.zz[a][b]
                                + force[a] * (second.zq[b][a] + second.force_z[a][b]);
                        }
                    }
                    let weights = First {
                        z: of_z,
                        q: force.map(|weight| -weight),
                        force,
                    };
                    (point.p, weights)
                }
            };
            (self.tape).add_derivatives(self.model, (t, &q, &z), &weights, &mut self.sums);
        }
        Ok(())
    }

    /// Adds what was found to the sums of directions.
    pub(crate) fn add_to(&self, directions: &[Direction], by_direction: &mut [f64]) {
        for (direction, sum) in directions.iter().zip(by_direction) {
            let index = direction.parameter.and_then(|one| one.any(self.model));
            *sum += index.map_or(0.0, |index| self.sums[index]);
        }
    }
}

/// What (T-150) needs of a point.
struct Backward<const N: usize> {
    force_q: [[f64; N]; N],
    force_v: [[f64; N]; N],
    momentum_q: [[f64; N]; N],
}

/// L_vv, as it is divided by.
enum Mass<const N: usize> {
    Diagonal([f64; N]),
    Full(Block<N>),
}

impl<const N: usize> Mass<N> {
    /// None of a singular one.
    fn of(matrix: &[[f64; N]; N]) -> Option<Self> {
        let mut rows = matrix.iter().enumerate();
        let is_diagonal = rows.all(|(a, row)| {
            let mut entries = row.iter().enumerate();
            entries.all(|(b, entry)| (*entry == 0.0) != (a == b))
        });
        if !is_diagonal {
            return Block::of(matrix).ok().map(Self::Full);
        }
        let mut diagonal = [0.0; N];
        for a in 0..N {
            diagonal[a] = matrix[a][a];
        }
        Some(Self::Diagonal(diagonal))
    }

    fn solve(&self, row: &mut [f64; N]) {
        match self {
            Self::Diagonal(diagonal) => {
                for (entry, mass) in row.iter_mut().zip(diagonal) {
                    *entry /= mass;
                }
            }
            Self::Full(block) => block.solve(row),
        }
    }
}

/// sum += matrixᵀ row
fn add_transposed<const N: usize>(matrix: &[[f64; N]; N], row: &[f64; N], sum: &mut [f64; N]) {
    for (entries, factor) in matrix.iter().zip(row) {
        for (sum, entry) in sum.iter_mut().zip(entries) {
            *sum += factor * entry;
        }
    }
}

/// μ and the new λ by iteration; nothing where that does not contract, and λ stays.
pub(crate) fn iterated<M: Model<N>, const N: usize>(
    equations: &mut VelocityForm<'_, M, N>,
    x: &[f64],
    lambda: &mut [f64],
) -> Result<Option<Vec<[f64; N]>>, StepError> {
    /// Each increment is at most this part of the one before, or factors cost less.
    const CONTRACTION: f64 = 0.2;
    /// Increments beside μ that are roundings.
    const ROUNDING: f64 = 1e-16;

    let scheme = equations.scheme;
    if M::FORM != Form::Lagrangian || !scheme.collocated || !M::CONSTRAINTS.is_empty() {
        return Ok(None);
    }
    let (rates, h, points) = (x.as_chunks::<N>().0, equations.span.h, scheme.points());
    let mut at_points = Vec::with_capacity(points);
    let mut masses: Vec<Mass<N>> = Vec::with_capacity(points);
    let mut point = PointDerivatives {
        p: [0.0; N],
        force: [0.0; N],
        second: Second::ZERO,
    };
    for l in 0..points {
        equations.derivatives(l, rates, &mut point)?;
        let second = &point.second;
        let mut own = Backward {
            force_q: second.qq,
            force_v: second.force_z,
            momentum_q: second.zq,
        };
        for a in 0..N {
            for b in 0..N {
                own.force_q[a][b] += second.force_q[a][b];
                own.force_v[a][b] += second.zq[b][a];
            }
        }
        if masses.is_empty() || !M::FACTS.constant_mass {
            let Some(mass) = Mass::of(&second.zz) else {
                return Ok(None);
            };
            masses.push(mass);
        }
        at_points.push(own);
    }
    let (mut of_p, mut of_q) = ([0.0; N], [0.0; N]);
    of_p.copy_from_slice(&lambda[..N]);
    of_q.copy_from_slice(&lambda[N..]);
    let mut mu = vec![[0.0; N]; points];
    let mut pulled = vec![[0.0; N]; points];
    let mut rows = vec![[0.0; N]; points];
    let mut before = f64::INFINITY;
    loop {
        for (l, at) in at_points.iter().enumerate() {
            let mut seed = of_p.map(|of_p| h * scheme.weights[l] * of_p);
            for (i, mu) in mu.iter().enumerate() {
                let weight = h * scheme.force[i * points + l];
                for (seed, mu) in seed.iter_mut().zip(mu) {
                    *seed += weight * mu;
                }
            }
            pulled[l] = [0.0; N];
            add_transposed(&at.force_q, &seed, &mut pulled[l]);
            rows[l] = of_q.map(|of_q| h * scheme.advance[l] * of_q);
            if M::FACTS.forced || !M::FACTS.separable {
                add_transposed(&at.force_v, &seed, &mut rows[l]);
            }
            if !M::FACTS.separable {
                add_transposed(&at.momentum_q, &mu[l].map(|mu| -mu), &mut pulled[l]);
            }
        }
        let (mut increment, mut size) = (0.0_f64, 0.0_f64);
        for j in 0..points {
            let mut row = rows[j];
            for (l, pulled) in pulled.iter().enumerate() {
                let weight = h * scheme.position[l * points + j];
                for (row, pulled) in row.iter_mut().zip(pulled) {
                    *row += weight * pulled;
                }
            }
            masses[j.min(masses.len() - 1)].solve(&mut row);
            for (mu, row) in mu[j].iter_mut().zip(row) {
                let change = (row - *mu).abs();
                // A maximum would ignore what is not a number.
                increment = if change > increment || change.is_nan() {
                    change
                } else {
                    increment
                };
                size = size.max(row.abs());
                *mu = row;
            }
        }
        if increment <= ROUNDING * size {
            break;
        }
        // Roundings do not shrink.
        let is_round_off = increment <= 64.0 * ROUNDING * size;
        if !(increment <= CONTRACTION * before) {
            if is_round_off {
                break;
            }
            return Ok(None);
        }
        before = increment;
    }
    for (mu, pulled) in mu.iter().zip(&pulled) {
        for a in 0..N {
            lambda[a] += mu[a];
            lambda[N + a] += pulled[a];
        }
    }
    Ok(Some(mu))
}
