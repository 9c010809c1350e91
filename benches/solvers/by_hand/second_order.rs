//! Equations q̈ = a(q, q̇), with the accelerations as the only unknowns.

use super::lanes::Quad;
use super::tables::{Tables, largest, product, weighted};
use super::{MAX_ITERATIONS, add, is_converged};
use pulp::x86::V3;

/// The equations of a model.
pub trait SecondOrder<const N: usize> {
    /// Whether the accelerations depend on the velocities.
    const BY_VELOCITY: bool = false;

    fn acceleration(&self, q: &[Quad; N], v: &[Quad; N]) -> [Quad; N];
}

/// A stepper with constant step size.
pub struct SecondOrderStepper<F, const N: usize, const K: usize, const C: usize> {
    isa: V3,
    model: F,
    tables: Tables<K, C>,
    h: f64,
    pub q: [f64; N],
    v: [f64; N],
    q_low: [f64; N],
    v_low: [f64; N],
    /// The iterations of the last step.
    accelerations: [[[f64; 4]; C]; N],
    is_warm: bool,
    pub iterations: u64,
}

impl<F: SecondOrder<N>, const N: usize, const K: usize, const C: usize>
    SecondOrderStepper<F, N, K, C>
{
    pub fn new(isa: V3, model: F, h: f64, (q, v): ([f64; N], [f64; N])) -> Self {
        Self {
            isa,
            model,
            tables: Tables::new(),
            h,
            q,
            v,
            q_low: [0.0; N],
            v_low: [0.0; N],
            accelerations: [[[0.0; 4]; C]; N],
            is_warm: false,
            iterations: 0,
        }
    }

    /// The scale for changes of the accelerations δa: they change velocities by h |δa| and positions by h² |δa|/2, each
    /// relative to its size.
    #[inline(always)]
    fn scale(&self, accelerations: &[[Quad; C]; N], speed: f64, distance: f64) -> f64 {
        let h = self.h.abs();
        let speed = speed.max(h * largest(accelerations));
        (speed / h).min(2.0 * distance.max(h * speed) / (h * h))
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
        let (h, square) = (like.splat(self.h), like.splat(self.h * self.h));
        let mut accelerations = [[like; C]; N];
        for a in 0..N {
            for c in 0..C {
                accelerations[a][c] = like.load(self.accelerations[a][c]);
            }
        }
        let (mut drift, mut twice) = ([[like; C]; N], [[like; C]; N]);
        let (mut speed, mut distance) = (0.0, 0.0);
        for a in 0..N {
            for c in 0..C {
                let reach = h * like.load(tables.nodes[c]);
                drift[a][c] = reach.times_plus(like.splat(self.v[a]), like.splat(self.q[a]));
            }
            twice[a] = product(&tables.start_twice, &accelerations[a]);
            speed = self.v[a].abs().max(speed);
            distance = self.q[a].abs().max(distance);
        }
        if F::BY_VELOCITY {
            for a in 0..N {
                accelerations[a] = product(&tables.start, &accelerations[a]);
            }
        }
        if !self.is_warm {
            let (mut q, mut v) = ([like; N], [like; N]);
            for a in 0..N {
                (q[a], v[a]) = (like.splat(self.q[a]), like.splat(self.v[a]));
            }
            let start = self.model.acceleration(&q, &v);
            for a in 0..N {
                accelerations[a] = [start[a]; C];
                twice[a] = product(&tables.twice, &accelerations[a]);
            }
        }
        let scale = self.scale(&accelerations, speed, distance);
        let (mut last, mut iterations) = (f64::INFINITY, 0);
        loop {
            let mut once = [[like; C]; N];
            if F::BY_VELOCITY {
                for a in 0..N {
                    once[a] = product(&tables.once, &accelerations[a]);
                }
            }
            let mut changed = like.splat(0.0);
            for c in 0..C {
                let (mut q, mut v) = ([like; N], [like; N]);
                for a in 0..N {
                    q[a] = square.times_plus(twice[a][c], drift[a][c]);
                    if F::BY_VELOCITY {
                        v[a] = h.times_plus(once[a][c], like.splat(self.v[a]));
                    }
                }
                let new = self.model.acceleration(&q, &v);
                for a in 0..N {
                    changed = changed.larger((new[a] - accelerations[a][c]).abs());
                    accelerations[a][c] = new[a];
                }
            }
            iterations += 1;
            // Without velocities, the accelerations have not been extrapolated before the first iteration yet.
            if iterations > 1 {
                let changed = changed.largest_lane();
                if is_converged(changed, last, scale) {
                    break;
                }
                last = changed;
                if iterations >= MAX_ITERATIONS || !last.is_finite() {
                    return false;
                }
            }
            for a in 0..N {
                twice[a] = product(&tables.twice, &accelerations[a]);
            }
        }
        self.iterations += u64::from(iterations);
        let h = self.h;
        for a in 0..N {
            let moved = weighted(&tables.lever, &accelerations[a]);
            let change = h * h.mul_add(moved, self.v[a] + self.v_low[a]);
            add((&mut self.q[a], &mut self.q_low[a]), change);
            let change = h * weighted(&tables.weights, &accelerations[a]);
            add((&mut self.v[a], &mut self.v_low[a]), change);
            for c in 0..C {
                self.accelerations[a][c] = accelerations[a][c].lanes();
            }
        }
        self.is_warm = true;
        true
    }
}

struct Step<'a, F, const N: usize, const K: usize, const C: usize>(
    &'a mut SecondOrderStepper<F, N, K, C>,
);

impl<F: SecondOrder<N>, const N: usize, const K: usize, const C: usize> pulp::NullaryFnOnce
    for Step<'_, F, N, K, C>
{
    type Output = bool;
    #[inline(always)]
    fn call(self) -> bool {
        self.0.step()
    }
}
