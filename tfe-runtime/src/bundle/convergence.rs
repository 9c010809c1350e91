//! The convergence monitor of single trajectories for several lanes at once, without branches.

use crate::control::ROUGH_ROUND_OFF;
use crate::evidence::Evidence;
use crate::newton::{IDLE, MAX_IDLE, ROUND_OFF, Solve, of_fixed_point};
use crate::real::Real;
use crate::registers::pair::Eight;

/// Monitors the increments of several trajectories as [`Monitor`](crate::newton::Monitor) does those of one. Truth
/// values are the numbers one and zero.
#[derive(Clone, Copy)]
pub(super) struct ConvergenceMonitor<V> {
    tolerance: V,
    /// The weight of the previous rate.
    memory: V,
    is_first: bool,
    last: V,
    rate: V,
    risen: V,
    best: V,
    idle: V,
    /// The largest ratio among increments far above round-off, for [`Evidence`].
    worst: V,
    proven: V,
}

/// Increments, relative to the state.
#[derive(Clone, Copy)]
pub(super) struct Increments<V> {
    relative: V,
    /// Whether the coordinates no longer change.
    settled: V,
}

/// Below this increment, relative to them, the coordinates no longer change.
const SETTLED: f64 = 4.0 * f64::EPSILON;

impl<V: Real> Increments<V> {
    /// From the increments relative to the state, and those of the coordinates alone.
    #[inline(always)]
    pub(super) fn new(relative: V, position: V) -> Self {
        let (zero, one) = (relative.like(0.0), relative.like(1.0));
        let settled = position.less_or_equal(relative.like(SETTLED));
        Self {
            relative,
            settled: V::select(settled, one, zero),
        }
    }

    /// The larger of two quotients, where the numerator of the second is `factor` times that of the first. Only the
    /// larger quotient is computed. 0/0 is zero, and NaN stays NaN.
    #[inline(always)]
    pub(super) fn larger_quotient(velocity: (V, V), position: (V, V), factor: V) -> Self {
        let (zero, one) = (factor.like(0.0), factor.like(1.0));
        let is_position = position.1.less(factor * velocity.1);
        let above = V::select(is_position, position.0, velocity.0);
        let below = V::select(is_position, position.1, velocity.1);
        let relative = V::select(above.less_or_equal(zero), zero, above / below);
        let settled = (position.0).less_or_equal(factor.like(SETTLED) * position.1);
        Self {
            relative,
            settled: V::select(settled, one, zero),
        }
    }
}

impl<V: Eight> ConvergenceMonitor<V> {
    #[inline(always)]
    pub(super) fn new(like: V, tolerance: f64, solve: Solve) -> Self {
        let (tolerance, memory) = of_fixed_point(tolerance);
        Self {
            memory: like.like(memory),
            is_first: true,
            worst: like.like(0.0),
            proven: like.like(match solve {
                Solve::Trusting => f64::INFINITY,
                Solve::FixedPoint => Evidence::CONTRACTS_ALONE,
                Solve::Auto | Solve::Newton => Evidence::CONTRACTS,
            }),
            tolerance: like.like(tolerance),
            last: like.like(f64::INFINITY),
            rate: like.like(1.0),
            risen: like.like(0.0),
            best: like.like(f64::INFINITY),
            idle: like.like(0.0),
        }
    }

    /// The ratios of the last increments to those before.
    #[inline(always)]
    pub(super) fn rates(&self) -> V {
        self.rate
    }

    /// Which of the `active` lanes have converged, and which continue; lanes in neither set have values that are not
    /// finite.
    #[inline(always)]
    pub(super) fn judge(&mut self, increments: Increments<V>, active: V) -> (V, V) {
        let is_ordinary = !self.extraordinary(increments, active).any_positive();
        let is_first = core::mem::take(&mut self.is_first);
        if !is_ordinary {
            return self.judge_all(increments, active);
        }
        let (size, zero) = (increments.relative, active.like(0.0));
        if !is_first {
            self.rate = size / self.last;
            self.see_rate(size, self.rate);
            (self.idle, self.risen) = (zero, zero);
        }
        (self.last, self.best) = (size, size);
        (zero, active)
    }

    /// Zero where a lane is inactive, and where its increment is an ordinary one: neither the first nor the last, and
    /// decreasing. If all lanes are so, only the rates need to be computed, in a tenth of the operations.
    #[inline(always)]
    fn extraordinary(&self, increments: Increments<V>, active: V) -> V {
        let (size, zero) = (increments.relative, active.like(0.0));
        // Comparisons with a NaN are false.
        if self.is_first {
            let far = V::select(self.tolerance.less(size), zero, active);
            return V::select(size.less(size.like(f64::INFINITY)), far, active);
        }
        let far = V::select((self.tolerance * self.last).less(size * size), zero, active);
        V::select(size.less(size.like(0.5) * self.best), far, active)
    }

    /// Records the largest rates that are evidence about the root.
    #[inline(always)]
    fn see_rate(&mut self, size: V, rate: V) {
        let seen = V::select(size.like(Evidence::FAR).less(size), rate, size.like(0.0));
        self.worst = V::select(self.worst.less(seen), seen, self.worst);
    }

    /// The same for all kinds of increments.
    #[inline(always)]
    fn judge_all(&mut self, increments: Increments<V>, active: V) -> (V, V) {
        let size = increments.relative;
        let (zero, one, infinity) = (size.like(0.0), size.like(1.0), size.like(f64::INFINITY));
        let is_first = infinity.less_or_equal(self.last);
        let rate = V::select(size.less_or_equal(zero), zero, size / self.last);
        // The rest of a geometric series, with a memory of the previous rate.
        let memory = self.memory * self.rate;
        let by_rate = size * size - self.tolerance * (self.last - size);
        let by_memory = size * memory - self.tolerance * (one - memory);
        let beyond = larger(by_rate, by_memory);
        let beyond = V::select(self.last.less_or_equal(size), size - self.tolerance, beyond);
        let beyond = V::select(is_first, size - self.tolerance, beyond);
        self.see_rate(size, rate);
        self.risen = V::select(self.last.less_or_equal(size), self.risen + one, zero);
        let is_better = size.less(size.like(0.5) * self.best);
        self.best = V::select(is_better, size, self.best);
        self.idle = V::select(is_better, zero, self.idle + one);
        self.last = size;
        self.rate = V::select(is_first, one, rate);
        // Comparisons with a NaN are false.
        let is_stuck = size.like(f64::from(MAX_IDLE)).less_or_equal(self.idle);
        let finite = V::select(size.less(infinity), active, zero);
        let done = V::select(beyond.less_or_equal(zero), finite, zero);
        let done = V::select(zero.less(self.stalled(increments)), finite, done);
        let proven = V::select(self.worst.less_or_equal(self.proven), done, zero);
        (proven, V::select(is_stuck, zero, finite - done))
    }

    /// The lanes whose increments are at round-off and no longer decrease.
    #[inline(always)]
    fn stalled(&self, increments: Increments<V>) -> V {
        let size = increments.relative;
        let (zero, one) = (size.like(0.0), size.like(1.0));
        let settled = increments.settled;
        let fine = V::select(size.less_or_equal(size.like(ROUND_OFF)), one, zero);
        let rough = V::select(size.less_or_equal(size.like(ROUGH_ROUND_OFF)), one, settled);
        let risen = V::select(one.less_or_equal(self.risen), fine, zero);
        let often = V::select(size.like(3.0).less_or_equal(self.risen), rough, zero);
        let idle = size.like(f64::from(IDLE)).less_or_equal(self.idle);
        risen + (often + V::select(idle, settled, zero))
    }

    /// The `active` lanes that may converge within the remaining iterations at their present rates.
    #[inline(always)]
    pub(super) fn hopeful(&self, active: V, remaining: u32) -> V {
        let (rate, zero) = (self.rate, active.like(0.0));
        if remaining >= 8 {
            // The case of most steps: the eighth power is less than half of the smallest target.
            let slow = V::select(rate.less(rate.like(0.05)), zero, active);
            let far = V::select(self.last.less_or_equal(rate.like(1e-4)), slow, active);
            if !far.any_positive() {
                return active;
            }
        }
        let target = larger(self.tolerance, active.like(64.0 * f64::EPSILON));
        let exponent = i32::try_from(remaining).unwrap_or(i32::MAX);
        // Either the power falls below the target or it never does. A loop with an exit would cost more, because its
        // end cannot be predicted.
        let projected = self.last * rate.powi(exponent);
        let hopeful = V::select(projected.less_or_equal(target), active, zero);
        V::select(self.last.less_or_equal(target), active, hopeful)
    }
}

/// The larger of two numbers, neither of which is NaN.
#[inline(always)]
pub(super) fn larger<V: Real>(x: V, y: V) -> V {
    V::select(x.less(y), y, x)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Lanes;
    use crate::equations::Increment;
    use crate::newton::{Monitor, Verdict};
    use crate::registers::pair::Pair;

    /// Increments that fall, rise, stay, and stop being numbers.
    fn sequence(seed: u64) -> [(f64, f64); 24] {
        let mut random = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1;
        let mut next = || {
            random ^= random << 13;
            random ^= random >> 7;
            random ^= random << 17;
            (random >> 11) as f64 / (1_u64 << 53) as f64
        };
        let fall = [1.0, 3.0, 9.0, 30.0][seed as usize % 4];
        let (mut size, mut all) = (0.3, [(0.0, 0.0); 24]);
        for place in &mut all {
            size *= (fall * (0.3 - next())).exp();
            let lost = next() < 0.01;
            let relative = if lost { f64::NAN } else { size.max(1e-17) };
            *place = (relative, relative * next());
        }
        all
    }

    #[test]
    fn several_at_once_are_judged_as_one() {
        let (mut converged, mut failed, mut hopeless, mut short) = (0, 0, 0, 0);
        for seed in 0..4000 {
            let lanes = [0, 1, 2, 3].map(|lane| sequence(4 * seed + lane));
            // Both halves are the same.
            let twice = |four| Pair(Lanes(four), Lanes(four));
            let like = twice([0.0; 4]);
            let tolerance = if seed % 2 == 0 { 1e-17 } else { 1e-9 };
            let mut several = ConvergenceMonitor::new(like, tolerance, Solve::Auto);
            let mut monitors = [(); 4].map(|()| Monitor::of_fixed_point(tolerance));
            let mut active = [true; 4];
            for step in 0..24 {
                let increments = Increments::new(
                    twice([0, 1, 2, 3].map(|lane| lanes[lane][step].0)),
                    twice([0, 1, 2, 3].map(|lane| lanes[lane][step].1)),
                );
                let flags = twice(active.map(|lane| f64::from(u8::from(lane))));
                let rest = 24 - step as u32;
                short += u32::from(!several.extraordinary(increments, flags).any_positive());
                let (done, going) = several.judge(increments, flags);
                let hopeful = several.hopeful(going, rest).0;
                let (done, going) = (done.0, going.0);
                for lane in 0..4 {
                    if !active[lane] {
                        assert_eq!((done.0[lane], going.0[lane]), (0.0, 0.0));
                        continue;
                    }
                    let (relative, position) = lanes[lane][step];
                    let monitor = &mut monitors[lane];
                    let verdict = monitor.judge(Increment { relative, position });
                    let proven = monitor.evidence(true).check(Solve::Auto).is_ok();
                    let expected = match verdict {
                        Ok(Verdict::Converged) => (f64::from(u8::from(proven)), 0.0),
                        Ok(Verdict::GoOn) => (0.0, 1.0),
                        Err(_) => (0.0, 0.0),
                    };
                    assert_eq!((done.0[lane], going.0[lane]), expected);
                    converged += u32::from(expected.0 > 0.0);
                    failed += u32::from(expected == (0.0, 0.0));
                    active[lane] = expected.1 > 0.0;
                    if active[lane] {
                        assert_eq!(several.rates().0.0[lane], monitor.rate());
                        let lost = monitor.is_hopeless(rest);
                        assert_eq!(hopeful.0[lane] == 0.0, lost);
                        hopeless += u32::from(lost);
                    }
                }
            }
        }
        // All kinds have been there.
        assert!(converged > 1000 && failed > 100 && hopeless > 1000 && short > 1000);
    }
}
