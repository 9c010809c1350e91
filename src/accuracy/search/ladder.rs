//! Runs with decreasing steps, each compared with the previous one.

use super::super::estimated::Attempt;
use super::super::trace::difference;
use super::runs::{
    AIM, COARSER, HIGH, LEFT, LONGER, LONGER_MEASURED, MAX_FACTOR, MAX_GAIN, MAX_GAIN_MEASURED,
    MAX_UNRESOLVED, MIN_FACTOR, RESOLVED, ROUNDINGS, Ran, SAME, largest,
};
use tfe_runtime::Element;

/// The results of runs with decreasing steps.
pub(super) struct Ladder {
    pub(super) order: f64,
    /// The order for graded meshes whose steps are long relative to fast time scales: one more than that of the
    /// solution inside an element.
    pub(super) reduced: f64,
    pub(super) accuracy: f64,
    pub(super) attempts: Vec<Attempt>,
    /// The last step and its run.
    pub(super) last: Option<(f64, Ran)>,
    /// The difference between the last two runs.
    pub(super) differences: Option<f64>,
    /// The error estimate of the last run, and whether it meets the accuracy.
    pub(super) errors: Option<(Vec<Vec<f64>>, bool)>,
    /// The number of successive comparisons without a meaningful result.
    pub(super) unresolved: u32,
}

pub(super) enum Verdict {
    Enough,
    /// The next step to try.
    Shorter(f64),
    /// Shorter steps do not help: the iteration or rounding errors dominate.
    Floor,
}

impl Ladder {
    pub(super) fn new(element: Element, accuracy: f64, is_graded: bool) -> Self {
        let order = element.order() as f64;
        let reduced = if is_graded {
            order.min(element.nodes() as f64)
        } else {
            order
        };
        Self {
            order,
            reduced,
            accuracy,
            attempts: Vec::new(),
            last: None,
            differences: None,
            errors: None,
            unresolved: 0,
        }
    }

    pub(super) fn fail(&mut self, step: f64) {
        self.attempts.push(Attempt {
            step,
            error_estimate: None,
        });
        (self.last, self.differences) = (None, None);
    }

    /// Compares a run with the previous one.
    pub(super) fn climb(&mut self, step: f64, ran: Ran) -> Verdict {
        let mut attempt = Attempt {
            step,
            error_estimate: None,
        };
        let Some((longer, before)) = self.last.replace((step, ran)) else {
            // If longer steps have failed, the accuracy was not what limits the step.
            let has_failed = !self.attempts.is_empty() && self.order > HIGH;
            self.attempts.push(attempt);
            return Verdict::Shorter(step / if has_failed { LONGER } else { COARSER });
        };
        let Some((_, ran)) = &self.last else {
            return Verdict::Enough;
        };
        let mut errors = difference(&before.trace, &ran.trace);
        let differences = largest(&errors);
        let contracts = before.contracts && ran.contracts;
        // The difference is the error of the previous run; together with that of the run before, it gives the order of
        // convergence.
        let ratio = longer / step;
        let power = match (self.differences, self.attempts.iter().rev().nth(1)) {
            (Some(earlier), Some(first)) if earlier <= RESOLVED => {
                // Two runs that agree to the last bit have no order either; they agree to rounding.
                let [earlier, now] = [earlier, differences].map(|found| found.max(f64::EPSILON));
                power_of(earlier / now, [first.step / longer, ratio])
            }
            _ => None,
        };
        if let Some(attempt) = self.attempts.last_mut() {
            attempt.error_estimate = Some(differences);
        }
        let at_floor = power.is_some_and(|power| power < 1.0) && differences < ROUNDINGS;
        let order = if contracts { self.order } else { self.reduced };
        let is_reduced = order < self.order;
        let (longer, most_gain) = if is_reduced {
            (LONGER, MAX_GAIN_MEASURED)
        } else if power.is_some() {
            (LONGER_MEASURED, MAX_GAIN_MEASURED)
        } else {
            (LONGER, MAX_GAIN)
        };
        // If the order was not measured, that of the element is used, which is only reliable where the fixed-point
        // iteration converges.
        let power = power.map(|power| power.clamp(1.0, order));
        let known = (power.is_some() || contracts) && ratio > SAME;
        let power = power.unwrap_or(order);
        let gain = if differences <= RESOLVED && ratio > SAME {
            (ratio.powf(power) - 1.0).min(most_gain)
        } else {
            1.0
        };
        let left = LEFT * self.accuracy;
        for error in errors.iter_mut().flatten() {
            *error = *error / gain + left;
        }
        let error = differences / gain;
        attempt.error_estimate = Some(error + left);
        self.attempts.push(attempt);
        self.differences = Some(differences);
        let margin = longer.powf(power);
        let is_met = known && differences <= RESOLVED && error * margin <= self.accuracy - left;
        self.errors = Some((errors, is_met));
        self.unresolved = if differences <= RESOLVED {
            0
        } else {
            self.unresolved + 1
        };
        if is_met || self.unresolved == MAX_UNRESOLVED {
            return Verdict::Enough;
        }
        if at_floor {
            return Verdict::Floor;
        }
        let factor = if differences <= RESOLVED {
            (self.accuracy / error).powf(1.0 / power) / AIM
        } else {
            0.0
        };
        Verdict::Shorter(step * factor.clamp(MIN_FACTOR, MAX_FACTOR))
    }
}

/// The power p of errors C hᵖ, from the ratio of the difference of a first and a second run to that of the second and a
/// third one: (aᵖ − 1)/(1 − b⁻ᵖ), with a and b the ratios of their steps. `None` where steps or
/// differences do not fall.
fn power_of(differences: f64, [a, b]: [f64; 2]) -> Option<f64> {
    /// Powers beyond these are not those of an element.
    const RANGE: [f64; 2] = [-40.0, 64.0];
    const HALVINGS: u32 = 60;
    let is_possible = differences > 0.0 && differences.is_finite() && a > 1.0 && b > 1.0;
    if !is_possible {
        return None;
    }
    let (a, b) = (a.ln(), b.ln());
    let ratio = |p: f64| match p == 0.0 {
        true => a / b,
        false => -(p * a).exp_m1() / (-p * b).exp_m1(),
    };
    let [mut low, mut high] = RANGE;
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if ratio(middle) < differences {
            low = middle;
        } else {
            high = middle;
        }
    }
    Some(high)
}

#[cfg(test)]
mod tests {
    use super::power_of;

    /// Errors h^p with steps in different ratios. By the first ratio alone, a power of two was 3.5.
    #[test]
    fn powers_are_measured_with_any_steps() {
        for (steps, power) in [
            ([1.5, 1.0, 1.0 / 1.2], 2.0_f64),
            ([1.5, 1.0, 0.4], 6.0),
            ([1.2, 1.0, 1.0 / 1.2], 14.0),
            ([1.2, 1.0, 0.9], 0.5),
            ([1.2, 1.0, 0.7], -1.0),
        ] {
            let [first, second, third] = steps.map(|h: f64| h.powf(power));
            let differences = (first - second) / (second - third);
            let found = power_of(differences, [steps[0], 1.0 / steps[2]]);
            let off = (found.expect("a power") - power).abs();
            assert!(off <= 1e-12 * power.abs().max(1.0), "{power}: {off}");
        }
        for nothing in [0.0, f64::INFINITY, f64::NAN] {
            assert_eq!(power_of(nothing, [1.5, 1.2]), None);
        }
    }
}
