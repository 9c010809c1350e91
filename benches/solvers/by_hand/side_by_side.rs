//! Equations q̈ = a(q) for eight trajectories at once, in two registers of four.

use super::lanes::Quad;
use super::second_order::SecondOrder;
use super::tables::Coefficients;
use super::{MAX_ITERATIONS, TOLERANCE, is_converged};
use pulp::x86::V3;

/// One number for each trajectory.
type Eight = [[f64; 4]; 2];

/// The number of trajectories.
pub const LANES: usize = 8;

/// A stepper with constant step size for accelerations that do not depend on velocities.
pub struct SideBySide<F, const N: usize, const K: usize> {
    isa: V3,
    model: F,
    coefficients: Coefficients<K>,
    h: f64,
    q: [Eight; N],
    v: [Eight; N],
    q_low: [Eight; N],
    v_low: [Eight; N],
    /// The iterations of the last step.
    accelerations: [[Eight; N]; K],
    is_warm: bool,
}

impl<F: SecondOrder<N>, const N: usize, const K: usize> SideBySide<F, N, K> {
    /// All trajectories at rest at zero.
    pub fn new(isa: V3, model: F, h: f64) -> Self {
        let zero = [[[0.0; 4]; 2]; N];
        Self {
            isa,
            model,
            coefficients: Coefficients::new(),
            h,
            q: zero,
            v: zero,
            q_low: zero,
            v_low: zero,
            accelerations: [zero; K],
            is_warm: false,
        }
    }

    /// Restarts with coordinates and velocities of each trajectory.
    pub fn start(&mut self, starts: &[([f64; N], [f64; N]); LANES]) {
        for (lane, (q, v)) in starts.iter().enumerate() {
            for a in 0..N {
                self.q[a][lane / 4][lane % 4] = q[a];
                self.v[a][lane / 4][lane % 4] = v[a];
            }
        }
        let zero = [[[0.0; 4]; 2]; N];
        (self.q_low, self.v_low, self.is_warm) = (zero, zero, false);
    }

    /// The coordinates of one trajectory.
    pub fn coordinates(&self, lane: usize) -> [f64; N] {
        self.q.map(|q| q[lane / 4][lane % 4])
    }

    /// Makes one step; returns false if it failed for one of the trajectories.
    pub fn advance(&mut self) -> bool {
        let isa = self.isa;
        isa.vectorize(Step(self))
    }

    /// The scale for changes of the accelerations, as for a single trajectory.
    #[inline(always)]
    fn scale(&self, like: Quad, half: usize) -> Quad {
        let (h, mut size) = (like.splat(self.h.abs()), like.splat(0.0));
        let (mut speed, mut distance) = (size, size);
        for a in 0..N {
            speed = like.load(self.v[a][half]).abs().larger(speed);
            distance = like.load(self.q[a][half]).abs().larger(distance);
            for row in &self.accelerations {
                size = like.load(row[a][half]).abs().larger(size);
            }
        }
        let speed = speed.larger(h * size);
        let position = like.splat(2.0) * distance.larger(h * speed) / (h * h);
        (speed / h).smaller(position)
    }

    /// The products of a matrix with the accelerations.
    #[inline(always)]
    fn product(&self, like: Quad, matrix: &[[f64; K]; K], products: &mut [[[Quad; 2]; N]; K]) {
        for a in 0..N {
            // As many rows at once as have room for their sums in registers.
            for from in (0..K).step_by(4) {
                let mut sums = [[like.splat(0.0); 2]; 4];
                for j in 0..K {
                    let value = self.accelerations[j][a].map(|value| like.load(value));
                    for line in 0..4.min(K - from) {
                        let factor = like.splat(matrix[from + line][j]);
                        for half in 0..2 {
                            sums[line][half] = factor.times_plus(value[half], sums[line][half]);
                        }
                    }
                }
                for line in 0..4.min(K - from) {
                    products[from + line][a] = sums[line];
                }
            }
        }
    }

    #[inline(always)]
    fn step(&mut self) -> bool {
        let like = Quad::of(self.isa, [0.0; 4]);
        let (h, square) = (like.splat(self.h), like.splat(self.h * self.h));
        let mut twice = [[[like; 2]; N]; K];
        if self.is_warm {
            self.product(like, &self.coefficients.start_twice, &mut twice);
        } else {
            for half in 0..2 {
                let (mut q, v) = ([like; N], [like; N]);
                for a in 0..N {
                    q[a] = like.load(self.q[a][half]);
                }
                let start = self.model.acceleration(&q, &v);
                for row in &mut self.accelerations {
                    for a in 0..N {
                        row[a][half] = start[a].lanes();
                    }
                }
            }
            self.product(like, &self.coefficients.twice, &mut twice);
        }
        let scale = [self.scale(like, 0), self.scale(like, 1)];
        let (mut last, mut iterations) = ([like.splat(f64::INFINITY); 2], 0);
        loop {
            let mut changed = [like.splat(0.0); 2];
            for c in 0..K {
                let reach = h * like.splat(self.coefficients.nodes[c]);
                for half in 0..2 {
                    let (mut q, v) = ([like; N], [like; N]);
                    for a in 0..N {
                        let (start, speed) = (self.q[a][half], self.v[a][half]);
                        let drift = reach.times_plus(like.load(speed), like.load(start));
                        q[a] = square.times_plus(twice[c][a][half], drift);
                    }
                    let new = self.model.acceleration(&q, &v);
                    for a in 0..N {
                        let old = like.load(self.accelerations[c][a][half]);
                        changed[half] = changed[half].larger((new[a] - old).abs());
                        self.accelerations[c][a][half] = new[a].lanes();
                    }
                }
            }
            iterations += 1;
            // The accelerations have not been extrapolated before the first iteration yet.
            if iterations > 1 {
                if are_converged(changed, last, scale) {
                    break;
                }
                last = changed;
                if iterations >= MAX_ITERATIONS {
                    return false;
                }
            }
            self.product(like, &self.coefficients.twice, &mut twice);
        }
        for a in 0..N {
            for half in 0..2 {
                let (mut moved, mut pushed) = (like.splat(0.0), like.splat(0.0));
                for c in 0..K {
                    let value = like.load(self.accelerations[c][a][half]);
                    moved = like
                        .splat(self.coefficients.lever[c])
                        .times_plus(value, moved);
                    pushed = like
                        .splat(self.coefficients.weights[c])
                        .times_plus(value, pushed);
                }
                let speed = like.load(self.v[a][half]) + like.load(self.v_low[a][half]);
                let change = h * h.times_plus(moved, speed);
                add(like, (&mut self.q, &mut self.q_low), (a, half), change);
                add(like, (&mut self.v, &mut self.v_low), (a, half), h * pushed);
            }
        }
        self.is_warm = true;
        true
    }
}

/// Whether a condition holds for all eight.
#[inline(always)]
fn are_converged(size: [Quad; 2], last: [Quad; 2], scale: [Quad; 2]) -> bool {
    let like = size[0];
    let (mut excess, mut risen) = (like.splat(f64::NEG_INFINITY), false);
    for half in 0..2 {
        let (size, fallen) = (size[half], last[half] - size[half]);
        let allowed = like.splat(TOLERANCE) * scale[half] * fallen;
        excess = excess.larger(size * size - allowed);
        risen |= (-fallen).largest_lane() >= 0.0;
    }
    if !risen && last[0].lanes()[0].is_finite() {
        return excess.largest_lane() <= 0.0;
    }
    let mut all = true;
    for half in 0..2 {
        let (size, last, scale) = (size[half].lanes(), last[half].lanes(), scale[half].lanes());
        for lane in 0..4 {
            all &= is_converged(size[lane], last[lane], scale[lane]);
        }
    }
    all
}

/// Adds to numbers with compensation: the carries keep what rounding lost.
#[inline(always)]
fn add<const N: usize>(
    like: Quad,
    (numbers, low): (&mut [Eight; N], &mut [Eight; N]),
    (a, half): (usize, usize),
    change: Quad,
) {
    let (number, low) = (&mut numbers[a][half], &mut low[a][half]);
    let (start, change) = (like.load(*number), change + like.load(*low));
    let sum = start + change;
    *low = (change - (sum - start)).lanes();
    *number = sum.lanes();
}

struct Step<'a, F, const N: usize, const K: usize>(&'a mut SideBySide<F, N, K>);

impl<F: SecondOrder<N>, const N: usize, const K: usize> pulp::NullaryFnOnce for Step<'_, F, N, K> {
    type Output = bool;
    #[inline(always)]
    fn call(self) -> bool {
        self.0.step()
    }
}
