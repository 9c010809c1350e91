//! Equations p = M(q) q̇, ṗ = f(q, q̇), with the velocities as the unknowns.

use super::lanes::Quad;
use super::tables::{Tables, largest, product, weighted};
use super::{MAX_ITERATIONS, add, is_converged};
use pulp::x86::V3;

/// The equations of a model.
pub trait Coupled<const N: usize> {
    /// What is computed from the positions once and needed for the velocities.
    type Masses: Copy;

    /// The coordinates on which the equations depend.
    const NEEDED: [bool; N] = [true; N];

    /// The momenta that are not constant.
    const FORCED: [bool; N] = [true; N];

    /// The forces and the mass matrix.
    fn forces(&self, q: &[Quad; N], v: &[Quad; N]) -> ([Quad; N], Self::Masses);

    fn velocities(&self, masses: &Self::Masses, p: &[Quad; N]) -> [Quad; N];
}

/// A stepper with constant step size.
pub struct CoupledStepper<F, const N: usize, const K: usize, const C: usize> {
    isa: V3,
    model: F,
    tables: Tables<K, C>,
    h: f64,
    pub q: [f64; N],
    p: [f64; N],
    q_low: [f64; N],
    p_low: [f64; N],
    /// The iterations of the last step.
    velocities: [[[f64; 4]; C]; N],
    is_warm: bool,
    pub iterations: u64,
}

impl<F: Coupled<N>, const N: usize, const K: usize, const C: usize> CoupledStepper<F, N, K, C> {
    /// Starts from positions and momenta.
    pub fn new(isa: V3, model: F, h: f64, (q, p): ([f64; N], [f64; N])) -> Self {
        Self {
            isa,
            model,
            tables: Tables::new(),
            h,
            q,
            p,
            q_low: [0.0; N],
            p_low: [0.0; N],
            velocities: [[[0.0; 4]; C]; N],
            is_warm: false,
            iterations: 0,
        }
    }

    /// Makes one step; returns false if it failed.
    pub fn advance(&mut self) -> bool {
        let isa = self.isa;
        isa.vectorize(Step(self))
    }

    #[inline(always)]
    fn step(&mut self) -> bool {
        let like = Quad::of(self.isa, [0.0; 4]);
        let tables = &self.tables;
        let h = like.splat(self.h);
        let (mut velocities, mut forces) = ([[like; C]; N], [[like; C]; N]);
        let mut distance = 0.0;
        for a in 0..N {
            for c in 0..C {
                velocities[a][c] = like.load(self.velocities[a][c]);
            }
            velocities[a] = product(&tables.start, &velocities[a]);
            distance = self.q[a].abs().max(distance);
        }
        if !self.is_warm {
            let (mut q, mut p) = ([like; N], [like; N]);
            for a in 0..N {
                (q[a], p[a]) = (like.splat(self.q[a]), like.splat(self.p[a]));
            }
            let (_, masses) = self.model.forces(&q, &p);
            let start = self.model.velocities(&masses, &p);
            for a in 0..N {
                velocities[a] = [start[a]; C];
            }
        }
        // Changes of velocities, relative to their size, weighted by a quarter, and of positions by h.
        let (step, size) = (self.h.abs(), largest(&velocities));
        let scale = (distance / step).max(size).min(4.0 * size);
        let (mut last, mut iterations) = (f64::INFINITY, 0);
        loop {
            let (mut moved, mut pushed) = ([[like; C]; N], [[like; C]; N]);
            for a in 0..N {
                if F::NEEDED[a] {
                    moved[a] = product(&tables.once, &velocities[a]);
                }
            }
            let mut masses = None;
            let mut of_groups = [masses; C];
            for c in 0..C {
                let (mut q, mut v) = ([like; N], [like; N]);
                for a in 0..N {
                    if F::NEEDED[a] {
                        q[a] = h.times_plus(moved[a][c], like.splat(self.q[a]));
                    }
                    v[a] = velocities[a][c];
                }
                let (force, mass) = self.model.forces(&q, &v);
                masses = Some(mass);
                of_groups[c] = masses;
                for a in 0..N {
                    forces[a][c] = force[a];
                }
            }
            for a in 0..N {
                if F::FORCED[a] {
                    pushed[a] = product(&tables.once, &forces[a]);
                }
            }
            let mut changed = like.splat(0.0);
            for c in 0..C {
                let mut p = [like; N];
                for a in 0..N {
                    p[a] = like.splat(self.p[a]);
                    if F::FORCED[a] {
                        p[a] = h.times_plus(pushed[a][c], p[a]);
                    }
                }
                let Some(masses) = &of_groups[c] else {
                    return false;
                };
                let new = self.model.velocities(masses, &p);
                for a in 0..N {
                    changed = changed.larger((new[a] - velocities[a][c]).abs());
                    velocities[a][c] = new[a];
                }
            }
            iterations += 1;
            let changed = changed.largest_lane();
            if is_converged(changed, last, scale) {
                break;
            }
            last = changed;
            if iterations >= MAX_ITERATIONS || !last.is_finite() {
                return false;
            }
        }
        self.iterations += u64::from(iterations);
        for a in 0..N {
            let change = self.h * weighted(&tables.weights, &velocities[a]);
            add((&mut self.q[a], &mut self.q_low[a]), change);
            if F::FORCED[a] {
                let change = self.h * weighted(&tables.weights, &forces[a]);
                add((&mut self.p[a], &mut self.p_low[a]), change);
            }
            for c in 0..C {
                self.velocities[a][c] = velocities[a][c].lanes();
            }
        }
        self.is_warm = true;
        true
    }
}

struct Step<'a, F, const N: usize, const K: usize, const C: usize>(
    &'a mut CoupledStepper<F, N, K, C>,
);

impl<F: Coupled<N>, const N: usize, const K: usize, const C: usize> pulp::NullaryFnOnce
    for Step<'_, F, N, K, C>
{
    type Output = bool;
    #[inline(always)]
    fn call(self) -> bool {
        self.0.step()
    }
}
