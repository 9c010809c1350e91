//! Runs with shorter and shorter steps, each compared with the one before.

use super::super::estimated::Attempt;
use super::super::trace::difference;
use super::runs::{
    AIM, COARSER, HIGH, LEAST_FACTOR, LEFT, LONGER, LONGER_MEASURED, MOST_FACTOR, MOST_GAIN,
    MOST_GAIN_MEASURED, MOST_UNRESOLVED, RESOLVED, ROUNDINGS, Ran, SAME, largest,
};
use tfe_runtime::Element;

/// Runs with shorter and shorter steps.
pub(super) struct Ladder {
    pub(super) order: f64,
    /// The same where steps vary and are long beside what is fast: there it is the error of the inside of an element that falls, with one power more.
    pub(super) reduced: f64,
    pub(super) accuracy: f64,
    pub(super) attempts: Vec<Attempt>,
    /// The step and what came of it.
    pub(super) last: Option<(f64, Ran)>,
    /// How far the last two runs were apart.
    pub(super) apart: Option<f64>,
    /// Of the last run, and whether that is enough.
    pub(super) errors: Option<(Vec<Vec<f64>>, bool)>,
    /// Comparisons in a row that have told nothing.
    pub(super) unresolved: u32,
}

pub(super) enum Verdict {
    Enough,
    /// The next step.
    Shorter(f64),
    /// Shorter steps do not help: errors of iterations or of roundings have grown.
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
            apart: None,
            errors: None,
            unresolved: 0,
        }
    }

    pub(super) fn fail(&mut self, step: f64) {
        self.attempts.push(Attempt {
            step,
            error_estimate: None,
        });
        (self.last, self.apart) = (None, None);
    }

    /// Compares a run with the one before.
    pub(super) fn climb(&mut self, step: f64, ran: Ran) -> Verdict {
        let mut attempt = Attempt {
            step,
            error_estimate: None,
        };
        let Some((longer, before)) = self.last.replace((step, ran)) else {
            // Where longer steps fail it is not accuracy that limits them.
            let has_failed = !self.attempts.is_empty() && self.order > HIGH;
            self.attempts.push(attempt);
            return Verdict::Shorter(step / if has_failed { LONGER } else { COARSER });
        };
        let Some((_, ran)) = &self.last else {
            return Verdict::Enough;
        };
        let mut errors = difference(&before.trace, &ran.trace);
        let apart = largest(&errors);
        let contracts = before.contracts && ran.contracts;
        // What the run before was off by is known now, and with what the one before that was off by, the power of the step.
        let ratio = longer / step;
        let power = match (self.apart, self.attempts.iter().rev().nth(1)) {
            (Some(earlier), Some(first)) if earlier <= RESOLVED => {
                let power = (earlier / apart).ln() / (first.step / longer).ln();
                Some(power).filter(|power| power.is_finite())
            }
            _ => None,
        };
        if let Some(attempt) = self.attempts.last_mut() {
            attempt.error_estimate = Some(apart);
        }
        let at_floor = power.is_some_and(|power| power < 1.0) && apart < ROUNDINGS;
        let order = if contracts { self.order } else { self.reduced };
        let is_reduced = order < self.order;
        let (longer, most_gain) = if is_reduced {
            (LONGER, MOST_GAIN_MEASURED)
        } else if power.is_some() {
            (LONGER_MEASURED, MOST_GAIN_MEASURED)
        } else {
            (LONGER, MOST_GAIN)
        };
        // A power that is not measured is that of the element only where errors are known to fall with it.
        let power = power.map(|power| power.clamp(1.0, order));
        let known = (power.is_some() || contracts) && ratio > SAME;
        let power = power.unwrap_or(order);
        let gain = if apart <= RESOLVED && ratio > SAME {
            (ratio.powf(power) - 1.0).min(most_gain)
        } else {
            1.0
        };
        let left = LEFT * self.accuracy;
        for error in errors.iter_mut().flatten() {
            *error = *error / gain + left;
        }
        let error = apart / gain;
        attempt.error_estimate = Some(error + left);
        self.attempts.push(attempt);
        self.apart = Some(apart);
        let margin = longer.powf(power);
        let is_met = known && apart <= RESOLVED && error * margin <= self.accuracy - left;
        self.errors = Some((errors, is_met));
        self.unresolved = if apart <= RESOLVED {
            0
        } else {
            self.unresolved + 1
        };
        if is_met || self.unresolved == MOST_UNRESOLVED {
            return Verdict::Enough;
        }
        if at_floor {
            return Verdict::Floor;
        }
        let factor = if apart <= RESOLVED {
            (self.accuracy / error).powf(1.0 / power) / AIM
        } else {
            0.0
        };
        Verdict::Shorter(step * factor.clamp(LEAST_FACTOR, MOST_FACTOR))
    }
}
