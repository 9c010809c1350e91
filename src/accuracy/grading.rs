//! The density of steps along a motion, from which graded meshes are made.

/// The number of steps per unit of time, ρ(t) > 0, piecewise linear, and its integral (T-102):
///
/// ```text
/// s(t) = ∫ ρ dt from the start to t ,     s(t_{k+1}) − s(t_k) = c
/// ```
///
/// A factor c defines a mesh. Of the meshes with factors c and c/2, the second divides every element of the first in
/// two.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Grading {
    start: f64,
    /// 1, or −1 in backward integration.
    direction: f64,
    /// Measured from the start, increasing.
    times: Vec<f64>,
    rates: Vec<f64>,
    /// The values of s at these times.
    sums: Vec<f64>,
}

impl Grading {
    /// Takes the nodes of a mesh, in the order of the run, and the step that each of its elements asks for; at a node
    /// the shorter one of its two sides counts. `None` if the nodes form no mesh, or a step is not positive and finite.
    pub(crate) fn new(nodes: &[f64], steps: &[f64]) -> Option<Self> {
        let (start, end) = (*nodes.first()?, *nodes.last()?);
        let direction = (end - start).signum();
        let times: Vec<f64> = nodes.iter().map(|t| direction * (t - start)).collect();
        let rises = times.windows(2).all(|pair| pair[0] < pair[1]);
        let are_steps = steps.iter().all(|step| step.is_finite() && *step > 0.0);
        if !(rises && are_steps && steps.len() + 1 == nodes.len() && !steps.is_empty()) {
            return None;
        }
        let last = steps.len() - 1;
        let rates: Vec<f64> = (0..nodes.len())
            .map(|k| 1.0 / steps[k.saturating_sub(1)].min(steps[k.min(last)]))
            .collect();
        let mut sums = vec![0.0];
        let mut sum = 0.0;
        for (times, rates) in times.windows(2).zip(rates.windows(2)) {
            sum += 0.5 * (rates[0] + rates[1]) * (times[1] - times[0]);
            sums.push(sum);
        }
        Some(Self {
            start,
            direction,
            times,
            rates,
            sums,
        })
    }

    /// s(t), the number of steps up to a time.
    pub(crate) fn sum(&self, t: f64) -> f64 {
        let time = (self.direction * (t - self.start)).max(0.0);
        let k = self.piece(&self.times, time);
        let x = time - self.times[k];
        let bend = self.bend(k);
        self.sums[k] + x * (self.rates[k] + 0.5 * bend * x)
    }

    /// The time at which s has a given value.
    pub(crate) fn time(&self, sum: f64) -> f64 {
        let k = self.piece(&self.sums, sum);
        let (rate, rest) = (self.rates[k], sum - self.sums[k]);
        let root = (rate * rate + 2.0 * self.bend(k) * rest).max(0.0).sqrt();
        let x = 2.0 * rest / (rate + root);
        self.start + self.direction * (self.times[k] + x)
    }

    /// The nodes after `from` up to `to`, equally spaced in s, at most `step` apart.
    pub(crate) fn nodes(&self, from: f64, to: f64, step: f64) -> Vec<f64> {
        /// The largest number of steps; a longer run would take years.
        const MAX: f64 = 1e9;
        let (first, last) = (self.sum(from), self.sum(to));
        let parts = ((last - first) / step).ceil().clamp(1.0, MAX);
        let inner = (1..parts as usize).map(|k| {
            let t = self.time(first + (last - first) * (k as f64 / parts));
            self.between(from, t, to)
        });
        let mut nodes: Vec<f64> = inner.chain([to]).collect();
        // Steps below the resolution of floating-point numbers are dropped.
        nodes.dedup();
        nodes.retain(|t| *t != from);
        nodes
    }

    fn between(&self, from: f64, t: f64, to: f64) -> f64 {
        if self.direction > 0.0 {
            t.clamp(from.min(to), to)
        } else {
            t.clamp(to, from.max(to))
        }
    }

    /// The interval of a table that contains a number.
    fn piece(&self, table: &[f64], number: f64) -> usize {
        let after = table.partition_point(|entry| *entry <= number);
        after.saturating_sub(1).min(self.times.len() - 2)
    }

    /// dρ/dt in an interval.
    fn bend(&self, k: usize) -> f64 {
        (self.rates[k + 1] - self.rates[k]) / (self.times[k + 1] - self.times[k])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn graded() -> Grading {
        Grading::new(&[1.0, 2.0, 2.5, 2.51, 4.0], &[1.0, 0.5, 1e-3, 0.7]).expect("a mesh")
    }

    /// s and its inverse are consistent, forward and backward in time.
    #[test]
    fn sums_and_times_belong_together() {
        let backwards = Grading::new(&[4.0, 2.51, 2.5, 2.0, 1.0], &[0.7, 1e-3, 0.5, 1.0]);
        let backwards = backwards.expect("a mesh");
        let total = graded().sum(4.0);
        for k in 0..=1000 {
            let t = 1.0 + 3.0 * f64::from(k) / 1000.0;
            let (there, back) = (graded().sum(t), backwards.sum(t));
            // The density reaches a thousand and is nowhere below one.
            let rounding = 8.0 * f64::EPSILON * total;
            assert!((there + back - total).abs() < 1e3 * 8.0 * f64::EPSILON * t + rounding);
            assert!((graded().time(there) - t).abs() < rounding, "{t}");
            assert!((backwards.time(back) - t).abs() < rounding, "{t}");
        }
    }

    /// In s, every element of a mesh of factor c/2 is half an element of that of factor c.
    #[test]
    fn meshes_of_two_factors_are_one_refined() {
        let grading = graded();
        let total = grading.sum(4.0);
        let coarse = grading.nodes(1.0, 4.0, total / 10.0);
        let fine = grading.nodes(1.0, 4.0, total / 20.0);
        assert_eq!((coarse.len(), fine.len()), (10, 20));
        for (k, t) in coarse.iter().enumerate() {
            assert!((fine[2 * k + 1] - t).abs() < 1e-12 * t);
        }
        assert_eq!(fine.last(), Some(&4.0));
    }

    #[test]
    fn what_is_no_mesh_is_no_grading() {
        assert_eq!(Grading::new(&[0.0, 1.0, 1.0], &[1.0, 1.0]), None);
        assert_eq!(Grading::new(&[0.0, 1.0], &[f64::NAN]), None);
        assert_eq!(Grading::new(&[0.0, 1.0], &[0.0]), None);
        assert_eq!(Grading::new(&[0.0], &[]), None);
    }
}
