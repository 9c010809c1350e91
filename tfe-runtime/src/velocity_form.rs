//! The element equations in velocity form (three fields), with velocities as unknowns; no mass matrix is inverted.
//!
//! ```text
//! r_i = Σ_l P_il L_v,l − p₀ − h Σ_l G_il (L_q + Q)_l − Σ ω_i(τ*) J = 0
//! ```
//!
//! with v_l = Σ_j E_lj ν_j and q_l = q₀ + h Σ_j C_lj ν_j. Every element solves a Lagrangian in this form, and a
//! Hamiltonian by way of the pointwise Legendre transform where it has no phase-space form.

use crate::equations::{Equations, Increment, Kept, Span};
use crate::error::{LegendreError, StepError};
use crate::legendre::{conjugate, lagrangian_view_from};
use crate::lu::{Block, factor_block, solve};
use crate::model::{First, Model, Second};
use crate::scheme::SchemeRef;
use crate::statistics::Statistics;
use crate::unlike::{by_coordinate, own_increment};

pub(crate) struct VelocityForm<'a, M, const N: usize> {
    pub(crate) model: &'a M,
    pub(crate) scheme: SchemeRef<'a>,
    pub(crate) span: Span<'a, N>,
    pub(crate) forces: &'a mut [[f64; N]],
    pub(crate) momenta: &'a mut [[f64; N]],
    pub(crate) masses: &'a mut [f64],
    pub(crate) mass_pivots: &'a mut [usize],
    /// The LU factors of the mass matrix, where it is constant.
    pub(crate) constant_mass: &'a mut Option<Block<N>>,
    pub(crate) statistics: &'a mut Statistics,
}

impl<'a, M, const N: usize> VelocityForm<'a, M, N> {
    /// The equations of one element, on memory of the element and on memory that lasts from step to step.
    #[inline(always)]
    pub(crate) fn new(
        model: &'a M,
        (scheme, span): (SchemeRef<'a>, Span<'a, N>),
        kept: Kept<'a, N>,
        (constant_mass, statistics): (&'a mut Option<Block<N>>, &'a mut Statistics),
    ) -> Self {
        Self {
            model,
            scheme,
            span,
            forces: kept.forces,
            momenta: kept.momenta,
            masses: kept.masses,
            mass_pivots: kept.mass_pivots,
            constant_mass,
            statistics,
        }
    }
}

/// The derivatives of a Lagrangian that enter the tangent; `force` is L_q + Q.
pub(crate) struct PointDerivatives<const N: usize> {
    pub(crate) p: [f64; N],
    pub(crate) force: [f64; N],
    pub(crate) second: Second<f64, N>,
}

impl<const N: usize> PointDerivatives<N> {
    pub(crate) const ZERO: Self = Self {
        p: [0.0; N],
        force: [0.0; N],
        second: Second::ZERO,
    };
}

/// The derivatives of momentum and force at a point by its velocity and by h times the rate of its coordinates.
pub(crate) struct PointTangent<const N: usize> {
    pub(crate) momentum_v: [[f64; N]; N],
    pub(crate) momentum_q: [[f64; N]; N],
    pub(crate) force_v: [[f64; N]; N],
    pub(crate) force_q: [[f64; N]; N],
}

impl<const N: usize> PointTangent<N> {
    #[inline(always)]
    pub(crate) fn of(h: f64, second: &Second<f64, N>) -> Self {
        let mut by = Self {
            momentum_v: second.zz,
            momentum_q: second.zq,
            force_v: second.force_z,
            force_q: second.qq,
        };
        for a in 0..N {
            for b in 0..N {
                by.momentum_q[a][b] *= h;
                // L_qv is the transpose of L_vq; forces need not be symmetric.
                by.force_v[a][b] += second.zq[b][a];
                by.force_q[a][b] = h * (by.force_q[a][b] + second.force_q[a][b]);
            }
        }
        by
    }
}

impl<M, const N: usize> VelocityForm<'_, M, N>
where
    M: Model<N>,
{
    /// Time, coordinates and velocities at a point.
    #[inline(always)]
    pub(crate) fn place(&self, l: usize, rates: &[[f64; N]]) -> (f64, [f64; N], [f64; N]) {
        self.span.place(&self.scheme, l, rates)
    }

    /// Computes the residual and the forces, and on request the mass matrices of the rows.
    fn evaluate(&mut self, x: &[f64], r: &mut [f64], with_masses: bool) -> Result<(), StepError> {
        let rates = x.as_chunks::<N>().0;
        let rows = r.as_chunks_mut::<N>().0;
        let (points, unknowns) = (self.scheme.points(), rates.len());
        rows.fill([0.0; N]);
        if with_masses {
            self.masses.fill(0.0);
        }
        let (mut first, mut zz) = (First::ZERO, [[0.0; N]; N]);
        for l in 0..points {
            let (t, q, v) = self.place(l, rates);
            let p = if const { M::FORM.is_lagrangian() } {
                if with_masses {
                    self.model.first_and_mass(t, &q, &v, &mut first, &mut zz);
                } else {
                    self.model.first(t, &q, &v, &mut first);
                }
                for a in 0..N {
                    self.forces[l][a] = first.q[a] + first.force[a];
                }
                first.z
            } else {
                let p = conjugate(self.model, t, &q, &v, &self.momenta[l])?;
                self.model.first_and_mass(t, &q, &p, &mut first, &mut zz);
                if with_masses {
                    let inverse = Block::of(&zz).map_err(singular)?.inverse();
                    zz = inverse;
                }
                for a in 0..N {
                    self.forces[l][a] = first.force[a] - first.q[a];
                }
                self.momenta[l] = p;
                p
            };
            if self.scheme.collocated {
                rows[l] = p;
                if with_masses {
                    self.masses[l * N * N..(l + 1) * N * N].copy_from_slice(zz.as_flattened());
                }
                continue;
            }
            for (i, row) in rows.iter_mut().enumerate() {
                let weight = self.scheme.momentum[i * points + l];
                for a in 0..N {
                    row[a] += weight * p[a];
                }
                if with_masses {
                    let weight = weight * self.scheme.velocity[l * unknowns + i];
                    let mass = &mut self.masses[i * N * N..(i + 1) * N * N];
                    for (entry, part) in mass.iter_mut().zip(zz.as_flattened()) {
                        *entry += weight * part;
                    }
                }
            }
        }
        self.statistics.residual_evaluations += points as u64;
        self.subtract_impulse(rows);
        Ok(())
    }

    /// Subtracts p₀ and the impulse of forces and kicks from the rows.
    #[inline(always)]
    pub(crate) fn subtract_impulse(&self, rows: &mut [[f64; N]]) {
        self.span.subtract_impulse(&self.scheme, self.forces, rows);
    }

    /// Momentum and force at a point with this [place](Self::place).
    pub(crate) fn values_at(
        &mut self,
        l: usize,
        (t, q, v): (f64, &[f64; N], &[f64; N]),
        point: &mut PointDerivatives<N>,
    ) -> Result<(), StepError> {
        let mut first = First::ZERO;
        let sign = if const { M::FORM.is_lagrangian() } {
            self.model.first(t, q, v, &mut first);
            point.p = first.z;
            1.0
        } else {
            let p = conjugate(self.model, t, q, v, &self.momenta[l])?;
            self.model.first(t, q, &p, &mut first);
            self.momenta[l] = p;
            point.p = p;
            -1.0
        };
        for a in 0..N {
            point.force[a] = sign * first.q[a] + first.force[a] + self.span.damping * v[a];
        }
        self.statistics.residual_evaluations += 1;
        Ok(())
    }

    /// First and second derivatives at a point.
    pub(crate) fn derivatives(
        &mut self,
        l: usize,
        rates: &[[f64; N]],
        point: &mut PointDerivatives<N>,
    ) -> Result<(), StepError> {
        let (t, q, v) = self.place(l, rates);
        self.derivatives_at(l, (t, &q, &v), point)
    }

    /// The same at a point with this place.
    pub(crate) fn derivatives_at(
        &mut self,
        l: usize,
        (t, q, v): (f64, &[f64; N], &[f64; N]),
        point: &mut PointDerivatives<N>,
    ) -> Result<(), StepError> {
        let damping = self.span.damping;
        if damping != 0.0 {
            // Kernels write only structurally non-zero entries: nothing of the last call may remain.
            point.second = Second::ZERO;
        }
        if const { M::FORM.is_lagrangian() } {
            let mut first = First::ZERO;
            self.model.second(t, q, v, &mut first, &mut point.second);
            point.p = first.z;
            for a in 0..N {
                point.force[a] = first.q[a] + first.force[a];
            }
        } else {
            let view = lagrangian_view_from(self.model, t, q, v, &self.momenta[l])?;
            self.momenta[l] = view.p;
            point.p = view.p;
            point.second = view.second;
            for a in 0..N {
                point.force[a] = view.first.q[a] + view.first.force[a];
            }
        }
        if damping != 0.0 {
            for a in 0..N {
                point.force[a] += damping * v[a];
                point.second.force_z[a][a] += damping;
            }
        }
        self.statistics.tangent_evaluations += 1;
        Ok(())
    }

    /// Adds the contribution of one point to the tangent ∂r/∂ν.
    pub(crate) fn add_to_tangent(&self, l: usize, by: &PointTangent<N>, tangent: &mut [f64]) {
        let points = self.scheme.points();
        let size = self.scheme.unknowns() * N;
        for (i, rows) in tangent.chunks_exact_mut(N * size).enumerate() {
            let momentum = self.scheme.momentum[i * points + l];
            let force = -self.span.h * self.scheme.force[i * points + l];
            for (a, row) in rows.chunks_exact_mut(size).enumerate() {
                add_row(&self.scheme, l, by, a, momentum, force, row);
            }
        }
    }

    fn factor_masses(&mut self) -> Result<(), StepError> {
        if M::FACTS.constant_mass {
            let mut mass = [[0.0; N]; N];
            mass.as_flattened_mut()
                .copy_from_slice(&self.masses[..N * N]);
            *self.constant_mass = Some(Block::of(&mass).map_err(singular)?);
            return Ok(());
        }
        let blocks = self.masses.chunks_exact_mut(N * N);
        for (mass, pivots) in blocks.zip(self.mass_pivots.chunks_exact_mut(N)) {
            factor_block::<N>(mass, pivots).map_err(singular)?;
        }
        Ok(())
    }
}

fn singular(error: crate::lu::Singular) -> StepError {
    StepError::Legendre(LegendreError::Singular {
        coordinate: error.column,
    })
}

impl<M, const N: usize> Equations for VelocityForm<'_, M, N>
where
    M: Model<N>,
{
    fn sweep(&mut self, x: &[f64], step: &mut [f64], refresh: bool) -> Result<(), StepError> {
        let known = M::FACTS.constant_mass && self.constant_mass.is_some();
        let with_masses = refresh && !known;
        self.evaluate(x, step, with_masses)?;
        if with_masses {
            self.factor_masses()?;
        }
        // Σ_l P_il E_li = 1 for every admissible rule: a constant mass matrix enters without a factor.
        for (i, row) in step.as_chunks_mut::<N>().0.iter_mut().enumerate() {
            match self.constant_mass {
                Some(mass) => mass.solve(row),
                None => solve(
                    N,
                    &self.masses[i * N * N..(i + 1) * N * N],
                    &self.mass_pivots[i * N..(i + 1) * N],
                    row,
                ),
            }
            for a in 0..N {
                row[a] = -row[a];
            }
        }
        Ok(())
    }

    fn residual(&mut self, x: &[f64], residual: &mut [f64]) -> Result<(), StepError> {
        self.evaluate(x, residual, false)
    }

    fn tangent(
        &mut self,
        x: &[f64],
        residual: &mut [f64],
        tangent: &mut [f64],
    ) -> Result<(), StepError> {
        let rates = x.as_chunks::<N>().0;
        let rows = residual.as_chunks_mut::<N>().0;
        let points = self.scheme.points();
        rows.fill([0.0; N]);
        tangent.fill(0.0);
        let mut point = PointDerivatives::ZERO;
        for l in 0..points {
            self.derivatives(l, rates, &mut point)?;
            let by = PointTangent::of(self.span.h, &point.second);
            self.add_to_tangent(l, &by, tangent);
            self.forces[l] = point.force;
            for (i, row) in rows.iter_mut().enumerate() {
                let weight = self.scheme.momentum[i * points + l];
                for a in 0..N {
                    row[a] += weight * point.p[a];
                }
            }
        }
        self.subtract_impulse(rows);
        Ok(())
    }

    fn measure(&self, x: &[f64], step: &[f64]) -> Increment {
        self.span.measure_rates(x, step)
    }

    fn measure_own(&self, x: &[f64], step: &[f64]) -> Option<f64> {
        if const { N == 1 } {
            return None;
        }
        own_increment::<M, N>(&by_coordinate(x), &by_coordinate(step), 0.0)
    }

    fn finish(&mut self, x: &[f64], scratch: &mut [f64]) -> Result<(), StepError> {
        // The end depends on the forces at the final velocities, not at the previous ones.
        self.evaluate(x, scratch, false)
    }

    fn statistics(&mut self) -> &mut Statistics {
        self.statistics
    }
}

/// Adds the derivative, by all unknown rates, of component a of a weighted sum of momentum and force at a point.
#[inline(always)]
pub(crate) fn add_row<const N: usize>(
    scheme: &SchemeRef<'_>,
    l: usize,
    by: &PointTangent<N>,
    a: usize,
    momentum: f64,
    force: f64,
    row: &mut [f64],
) {
    let unknowns = scheme.unknowns();
    let weights = l * unknowns..(l + 1) * unknowns;
    let (mut by_v, mut by_q) = ([0.0; N], [0.0; N]);
    for b in 0..N {
        by_v[b] = force * by.force_v[a][b];
        by_q[b] = force * by.force_q[a][b];
    }
    // In a collocation method, each row contains the momentum of one point only.
    if momentum != 0.0 {
        for b in 0..N {
            by_v[b] += momentum * by.momentum_v[a][b];
            by_q[b] += momentum * by.momentum_q[a][b];
        }
    }
    let blocks = row.as_chunks_mut::<N>().0;
    for (block, weight) in blocks.iter_mut().zip(&scheme.position[weights.clone()]) {
        for b in 0..N {
            block[b] += weight * by_q[b];
        }
    }
    if scheme.collocated {
        for b in 0..N {
            blocks[l][b] += by_v[b];
        }
    } else {
        for (block, weight) in blocks.iter_mut().zip(&scheme.velocity[weights]) {
            for b in 0..N {
                block[b] += weight * by_v[b];
            }
        }
    }
}
