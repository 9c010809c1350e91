//! The element equations in phase space, where the rates of momenta and coordinates are the unknowns.
//!
//! ```text
//! π_k = (Q − H_q)(t_k, q_k, p_k) ,   κ_k = H_p(t_k, q_k, p_k) ,
//! p_k = p₀ + h Σ_l A_kl π_l + Σ ω_k(τ*) J ,   q_k = q₀ + h Σ_l A_kl κ_l .
//! ```
//!
//! This form is used for Hamiltonian models on two-field families. The vector of unknowns contains all π, then all κ.

use crate::equations::{Equations, Increment, Kept, Span, moved, relative, weighted};
use crate::error::StepError;
use crate::model::{First, Model, Second};
use crate::scheme::SchemeRef;
use crate::statistics::Statistics;
use crate::unlike::{by_coordinate, larger_own, own_increment};

pub(crate) struct PhaseForm<'a, M, const N: usize> {
    pub(crate) model: &'a M,
    pub(crate) scheme: SchemeRef<'a>,
    pub(crate) span: Span<'a, N>,
    /// The momenta of the last sweep, and the velocities from which the next one starts.
    pub(crate) momenta: &'a mut [[f64; N]],
    pub(crate) velocities: &'a mut [[f64; N]],
    /// H_pp at the stages.
    pub(crate) masses: &'a mut [f64],
    /// Whether `momenta`, velocities and `masses` have been filled by a sweep.
    pub(crate) swept: bool,
    pub(crate) statistics: &'a mut Statistics,
}

impl<'a, M, const N: usize> PhaseForm<'a, M, N> {
    /// The equations of one element, on memory of the element.
    #[inline(always)]
    pub(crate) fn new(
        model: &'a M,
        (scheme, span): (SchemeRef<'a>, Span<'a, N>),
        kept: Kept<'a, N>,
        statistics: &'a mut Statistics,
    ) -> Self {
        Self {
            model,
            scheme,
            span,
            momenta: kept.momenta,
            velocities: kept.forces,
            masses: kept.masses,
            swept: false,
            statistics,
        }
    }
}

impl<M, const N: usize> PhaseForm<'_, M, N>
where
    M: Model<N>,
{
    /// Time and coordinates at a stage.
    #[inline(always)]
    fn coordinates(&self, k: usize, velocities: &[[f64; N]]) -> (f64, [f64; N]) {
        let Span {
            t, h, start, low, ..
        } = self.span;
        let row = k * velocities.len()..(k + 1) * velocities.len();
        let (high, correction) = (
            &self.scheme.position[row.clone()],
            &self.scheme.position_low[row],
        );
        let q = moved(&start.q, &low.q, h, &weighted(high, correction, velocities));
        (t + self.scheme.nodes[k] * h, q)
    }

    /// Momenta at a stage.
    #[inline(always)]
    fn momentum(&self, k: usize, forces: &[[f64; N]]) -> [f64; N] {
        let Span {
            h,
            start,
            low,
            kicks,
            ..
        } = self.span;
        let row = k * forces.len()..(k + 1) * forces.len();
        let (high, correction) = (
            &self.scheme.position[row.clone()],
            &self.scheme.position_low[row],
        );
        let mut low = low.p;
        for a in 0..N {
            low[a] += kicks[k][a];
        }
        moved(&start.p, &low, h, &weighted(high, correction, forces))
    }

    /// Time, coordinates and momenta at a stage.
    #[inline(always)]
    pub(crate) fn place(&self, k: usize, x: &[f64]) -> (f64, [f64; N], [f64; N]) {
        let (pi, kappa) = x.as_chunks::<N>().0.split_at(self.scheme.points());
        let (t, q) = self.coordinates(k, kappa);
        (t, q, self.momentum(k, pi))
    }

    /// Computes the momenta of the stages, and predicts the velocities that belong to them rather than to the previous
    /// momenta:
    ///
    /// ```text
    /// κ* = κ + H_pp (p − p_before)
    /// ```
    ///
    /// One evaluation then carries forces through momenta and velocities to coordinates, and the
    /// iteration contracts like h² ∂²V instead of h ∂f.
    fn predict(&mut self, x: &[f64]) {
        let points = self.scheme.points();
        let (pi, kappa) = x.as_chunks::<N>().0.split_at(points);
        for k in 0..points {
            let p = self.momentum(k, pi);
            let mut velocity = kappa[k];
            if self.swept {
                let mass = self.masses[k * N * N..(k + 1) * N * N].as_chunks::<N>().0;
                for a in 0..N {
                    for b in 0..N {
                        velocity[a] += mass[a][b] * (p[b] - self.momenta[k][b]);
                    }
                }
            }
            self.momenta[k] = p;
            self.velocities[k] = velocity;
        }
    }

    /// First and second derivatives of H at a stage.
    pub(crate) fn derivatives(
        &mut self,
        k: usize,
        x: &[f64],
        first: &mut First<f64, N>,
        second: &mut Second<f64, N>,
    ) {
        let (t, q, p) = self.place(k, x);
        let damping = self.span.damping;
        if damping == 0.0 {
            self.model.second(t, &q, &p, first, second);
        } else {
            // Kernels write only structurally non-zero entries: nothing of the last call may remain.
            (*first, *second) = (First::ZERO, Second::ZERO);
            self.model.second(t, &q, &p, first, second);
            for a in 0..N {
                first.force[a] += damping * first.z[a];
                for b in 0..N {
                    second.force_z[a][b] += damping * second.zz[a][b];
                    second.force_q[a][b] += damping * second.zq[a][b];
                }
            }
        }
        self.statistics.tangent_evaluations += 1;
    }

    /// Sets the rows of one stage of the tangent: 1 − h A ⊗ ∂f/∂(p, q).
    pub(crate) fn set_tangent(&self, k: usize, second: &Second<f64, N>, tangent: &mut [f64]) {
        let points = self.scheme.points();
        let (half, size) = (points * N, 2 * points * N);
        for a in 0..N {
            let (pi, kappa) = (k * N + a, half + k * N + a);
            for j in 0..points {
                let weight = -self.span.h * self.scheme.position[k * points + j];
                for b in 0..N {
                    let (p, q) = (j * N + b, half + j * N + b);
                    tangent[pi * size + p] = weight * (second.force_z[a][b] - second.zq[b][a]);
                    tangent[pi * size + q] = weight * (second.force_q[a][b] - second.qq[a][b]);
                    tangent[kappa * size + p] = weight * second.zz[a][b];
                    tangent[kappa * size + q] = weight * second.zq[a][b];
                }
            }
            tangent[pi * size + pi] += 1.0;
            tangent[kappa * size + kappa] += 1.0;
        }
    }
}

impl<M, const N: usize> Equations for PhaseForm<'_, M, N>
where
    M: Model<N>,
{
    fn sweep(&mut self, x: &[f64], step: &mut [f64], refresh: bool) -> Result<(), StepError> {
        let points = self.scheme.points();
        let half = points * N;
        let mut first = First::ZERO;
        let mut zz = [[0.0; N]; N];
        self.predict(x);
        for k in 0..points {
            let (t, q) = self.coordinates(k, self.velocities);
            let p = self.momenta[k];
            if refresh {
                self.model.first_and_mass(t, &q, &p, &mut first, &mut zz);
                self.masses[k * N * N..(k + 1) * N * N].copy_from_slice(zz.as_flattened());
            } else {
                self.model.first(t, &q, &p, &mut first);
            }
            for a in 0..N {
                let (pi, kappa) = (k * N + a, half + k * N + a);
                step[pi] = first.force[a] - first.q[a] - x[pi];
                step[kappa] = first.z[a] - x[kappa];
            }
        }
        self.swept = true;
        self.statistics.residual_evaluations += points as u64;
        Ok(())
    }

    fn residual(&mut self, x: &[f64], residual: &mut [f64]) -> Result<(), StepError> {
        let points = self.scheme.points();
        let half = points * N;
        let mut first = First::ZERO;
        for k in 0..points {
            let (t, q, p) = self.place(k, x);
            self.model.first(t, &q, &p, &mut first);
            for a in 0..N {
                let (pi, kappa) = (k * N + a, half + k * N + a);
                residual[pi] = x[pi] - (first.force[a] - first.q[a]);
                residual[kappa] = x[kappa] - first.z[a];
            }
        }
        self.statistics.residual_evaluations += points as u64;
        Ok(())
    }

    fn tangent(
        &mut self,
        x: &[f64],
        residual: &mut [f64],
        tangent: &mut [f64],
    ) -> Result<(), StepError> {
        let points = self.scheme.points();
        let half = points * N;
        let (mut first, mut second) = (First::ZERO, Second::ZERO);
        for k in 0..points {
            self.derivatives(k, x, &mut first, &mut second);
            self.set_tangent(k, &second, tangent);
            for a in 0..N {
                let (pi, kappa) = (k * N + a, half + k * N + a);
                residual[pi] = x[pi] - (first.force[a] - first.q[a]);
                residual[kappa] = x[kappa] - first.z[a];
            }
        }
        Ok(())
    }

    fn measure(&self, x: &[f64], step: &[f64]) -> Increment {
        let half = x.len() / 2;
        let Span { h, start, .. } = self.span;
        let position = relative(h, &start.q, &x[half..], &step[half..]);
        let momentum = relative(h, &start.p, &x[..half], &step[..half]);
        // `f64::max` would ignore a NaN.
        let relative = if (momentum + position).is_nan() {
            f64::NAN
        } else {
            momentum.max(position)
        };
        Increment { relative, position }
    }

    fn measure_own(&self, x: &[f64], step: &[f64]) -> Option<f64> {
        if const { N == 1 } {
            return None;
        }
        let half = x.len() / 2;
        let Span { h, start, .. } = self.span;
        let own = |start: &[f64; N], rates: &[f64], step: &[f64]| {
            let (mut sizes, mut increments) = (by_coordinate::<N>(rates), by_coordinate::<N>(step));
            for a in 0..N {
                sizes[a] = start[a].abs().max(h.abs() * sizes[a]);
                increments[a] *= h.abs();
            }
            own_increment::<M, N>(&sizes, &increments, 0.0)
        };
        larger_own(
            own(&start.q, &x[half..], &step[half..]),
            own(&start.p, &x[..half], &step[..half]),
        )
    }

    fn finish(&mut self, _x: &[f64], _scratch: &mut [f64]) -> Result<(), StepError> {
        // The end is a sum of the unknowns themselves.
        Ok(())
    }

    fn statistics(&mut self) -> &mut Statistics {
        self.statistics
    }
}
