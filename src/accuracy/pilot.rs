//! The pilot run: its steps are controlled by the local error, in order to find where steps must be short.

use super::grading::Grading;
use crate::motion::breaks_within;
use std::ops::Range;

/// Two elements of different order that solve the same steps.
pub(crate) trait Pair {
    /// Solves a step with both elements from the current state; false if one of them fails.
    fn attempt(&mut self, t: f64, h: f64) -> bool;
    /// Whether shorter steps would fail as well.
    fn is_stopped(&self) -> bool {
        false
    }
    /// The differences between the two elements after that step, one for each kind of quantity.
    fn differences(&self) -> &[f64];
    /// The largest magnitude of each kind so far, including that step.
    fn sizes(&self) -> &[f64];
    /// Accepts the step.
    fn keep(&mut self);
}

/// The specification of a pilot run.
#[derive(Clone, Debug)]
pub(crate) struct PilotSettings {
    pub(crate) span: Range<f64>,
    /// Times at which elements must end.
    pub(crate) breaks: Vec<f64>,
    /// The longest step allowed.
    pub(crate) longest: f64,
    /// The length of the first attempt.
    pub(crate) first: f64,
    /// The order p + 1 of the local error.
    pub(crate) power: f64,
    /// The tolerance of the local error, relative to the largest magnitude of its kind.
    pub(crate) local: f64,
}

/// Safety factor: steps are shorter than the error estimate asks for.
const SAFETY: f64 = 0.85;
/// Limits of the ratio of successive steps.
const MIN_FACTOR: f64 = 0.15;
const MAX_FACTOR: f64 = 5.0;
/// The reduction of a step that failed.
const FAILED: f64 = 0.25;
/// The largest number of attempts; a longer pilot run costs more than it can save.
const MAX_STEPS: usize = 200_000;
/// The shortest step, relative to the time.
const SHORTEST: f64 = 1e-14;
/// The ratio of the longest to the shortest step below which equal steps are used.
const VARIES: f64 = 3.0;

/// An accepted step.
struct AcceptedStep {
    h: f64,
    differences: Vec<f64>,
}

/// The grading whose steps have the local error [`PilotSettings::local`]; `None` if equal steps are as good, or if the pilot
/// run failed.
///
/// A step h with the error e asks for the step h (local/e)^{1/(p+1)} (T-103).
pub(crate) fn explore(settings: &PilotSettings, pair: &mut dyn Pair) -> Option<Grading> {
    let Range { start, end } = settings.span;
    let direction = (end - start).signum();
    let mut nodes = vec![start];
    let mut kept: Vec<AcceptedStep> = Vec::new();
    let mut t = start;
    let mut wanted = settings.first.min(settings.longest);
    let mut attempts = 0;
    for corner in corners(&settings.span, &settings.breaks) {
        while t != corner {
            attempts += 1;
            let left = (corner - t).abs();
            // No very short step before a break.
            let parts = (left / wanted).ceil().clamp(1.0, 2.0);
            let h = if parts == 1.0 {
                left
            } else {
                wanted.min(left / 2.0)
            };
            if attempts > MAX_STEPS || !(h > SHORTEST * t.abs().max(left * SHORTEST)) {
                return None;
            }
            let off = if pair.attempt(t, direction * h) {
                relative(pair.differences(), pair.sizes())
            } else {
                f64::NAN
            };
            if pair.is_stopped() {
                return None;
            }
            if !off.is_finite() {
                wanted = FAILED * h;
                continue;
            }
            let longer = SAFETY * settings.factor(off);
            wanted = (h * longer).min(settings.longest);
            if off > settings.local {
                continue;
            }
            kept.push(AcceptedStep {
                h,
                differences: pair.differences().to_vec(),
            });
            pair.keep();
            t = if h == left { corner } else { t + direction * h };
            nodes.push(t);
        }
    }
    // The scale of a kind may have been small at first.
    let sizes = pair.sizes();
    let steps = kept.iter().map(|one| {
        let step = one.h * settings.factor(relative(&one.differences, sizes));
        step.min(settings.longest)
    });
    let steps: Vec<f64> = steps.collect();
    if varies(settings, &kept, &steps) {
        Grading::new(&nodes, &steps)
    } else {
        None
    }
}

/// Whether the steps that the errors ask for vary. Steps that could grow by more than the largest ratio are ignored:
/// their length is not known.
fn varies(settings: &PilotSettings, kept: &[AcceptedStep], steps: &[f64]) -> bool {
    let known = kept
        .iter()
        .zip(steps)
        .filter(|(one, step)| **step < 0.999 * MAX_FACTOR * one.h || **step == settings.longest);
    let (least, most) = known.fold((f64::INFINITY, 0.0), |(least, most), (_, step)| {
        (f64::min(least, *step), f64::max(most, *step))
    });
    most > VARIES * least
}

/// The breaks inside a span, in the order of the run, and its end.
pub(crate) fn corners(span: &Range<f64>, breaks: &[f64]) -> Vec<f64> {
    let mut corners = breaks_within(span, breaks);
    corners.push(span.end);
    corners
}

impl PilotSettings {
    /// The ratio of the next step to one with a given error.
    fn factor(&self, off: f64) -> f64 {
        let factor = (self.local / off).powf(1.0 / self.power);
        factor.clamp(MIN_FACTOR, MAX_FACTOR)
    }
}

/// The largest relative difference; a difference of zero counts as zero for any scale.
fn relative(differences: &[f64], sizes: &[f64]) -> f64 {
    let mut most = 0.0;
    for (differences, size) in differences.iter().zip(sizes) {
        if *differences == 0.0 {
            continue;
        }
        let off = differences / size;
        if !(off <= most) {
            most = off;
        }
    }
    most
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A law of errors for tests: a step has the error C(t) h⁵ with C = 1/w(t)⁵, and fails if it is longer than 2 w.
    struct Law<F> {
        wanted: F,
        differences: Vec<f64>,
        kept: usize,
    }

    impl<F: Fn(f64) -> f64> Pair for Law<F> {
        fn attempt(&mut self, t: f64, h: f64) -> bool {
            // The largest C within the step.
            let places = (0..=16).map(|k| t + h * f64::from(k) / 16.0);
            let wanted = places.map(&self.wanted).fold(f64::INFINITY, f64::min);
            self.differences = vec![LOCAL * (h.abs() / wanted).powi(5)];
            h.abs() < 2.0 * wanted
        }

        fn differences(&self) -> &[f64] {
            &self.differences
        }

        fn sizes(&self) -> &[f64] {
            &[1.0]
        }

        fn keep(&mut self) {
            self.kept += 1;
        }
    }

    const LOCAL: f64 = 1e-6;

    fn explored(span: Range<f64>, wanted: impl Fn(f64) -> f64) -> (Option<Grading>, usize) {
        let settings = PilotSettings {
            span,
            breaks: vec![3.0],
            longest: 1.0,
            first: 1e-3,
            power: 5.0,
            local: LOCAL,
        };
        let mut pair = Law {
            wanted,
            differences: Vec::new(),
            kept: 0,
        };
        (explore(&settings, &mut pair), pair.kept)
    }

    /// Where the step should be w(t), ρ is about 1/w, over four orders of magnitude.
    #[test]
    fn gradings_follow_the_errors() {
        let wanted = |t: f64| 1e-4 + 0.5 * (t - 5.0).abs().min(1.0);
        for span in [0.0..10.0, 10.0..0.0] {
            let (grading, kept) = explored(span.clone(), wanted);
            let grading = grading.expect("steps vary");
            let (first, last) = (span.start.min(span.end), span.start.max(span.end));
            let exact: f64 = (0..200_000)
                .map(|k| 5e-5 / wanted(first + (last - first) * (f64::from(k) + 0.5) / 2e5))
                .sum();
            let sum = grading.sum(span.end);
            // A step is determined by the most difficult time in it, and its ratio to the next one is limited.
            assert!(sum > 0.9 * exact && sum < 4.0 * exact, "{sum} {exact}");
            assert!((kept as f64) < 5.0 * exact, "{kept} {exact}");
            let nodes = grading.nodes(span.start, span.end, 1.0);
            let lengths = nodes.windows(2).map(|pair| (pair[1] - pair[0]).abs());
            let shortest = lengths.clone().fold(f64::INFINITY, f64::min);
            let longest = lengths.fold(0.0, f64::max);
            assert!(shortest < 4e-4 && longest > 0.2, "{shortest} {longest}");
        }
    }

    #[test]
    fn even_motions_and_dead_ends_have_none() {
        let gentle = |t: f64| 0.3 + 0.1 * t.sin();
        assert_eq!(explored(0.0..10.0, gentle).0, None);
        let wall = |t: f64| if t < 5.0 { 0.1 } else { 0.0 };
        assert_eq!(explored(0.0..10.0, wall).0, None);
        assert_eq!(explored(0.0..10.0, |_| f64::NAN).0, None);
    }
}
