//! A first estimate of the step size, from one step at the start compared with two of half its length.

use super::super::trace::difference;
use super::runs::{Asked, HIGH, LONGER, MANY_TO_PROBE, RunSettings, Runner, largest};
use crate::error::RunErrorKind;

/// Returns an estimated step size, and its ratio to the longest step that could be solved, which is left in `settings`.
pub(super) fn probe(
    asked: &Asked,
    settings: &mut RunSettings<'_>,
    longest: f64,
    run: &mut dyn Runner,
) -> Result<(f64, f64), RunErrorKind> {
    /// The largest number of halvings of the span.
    const MAX: u32 = 60;
    /// The largest difference that shows the order of the element.
    const CLEAR: f64 = 1e-3;
    /// The smallest factor by which the step may be reduced without another probe.
    const FAR: f64 = 0.6;
    /// The largest number of shorter probes made only to improve the estimate.
    const MAX_HALVED: u32 = 1;
    /// A longer step is tried if the estimate exceeds the present one by this factor.
    const SHORT: f64 = 1.8;
    let Asked { accuracy, span, .. } = asked;
    let length = (span.end - span.start).abs();
    let direction = (span.end - span.start).signum();
    let order = settings.element.order() as f64;
    let mut failure = None;
    // The best estimate so far, and whether longer steps have failed.
    let mut known: Option<(f64, f64)> = None;
    let mut is_longest = false;
    let mut halved = 0;
    for _ in 0..MAX {
        let h = settings.step;
        let cuts = [span.start, span.start + direction * h];
        let mut over = |step: f64| {
            run.run(&RunSettings {
                step,
                cuts: &cuts,
                ..settings.clone()
            })
        };
        let pair = over(h).and_then(|whole| Ok((whole, over(h / 2.0)?)));
        let differences = pair.map(|(whole, halves)| {
            largest(&difference(&whole.trace, &halves.trace)).max(f64::EPSILON)
        });
        let shorter = match differences {
            Ok(differences) if differences <= CLEAR => {
                // Local errors add up, and those of frequencies grow quadratically with time.
                let steps = length / h;
                let sum = differences * steps * (steps / 4.0).max(1.0);
                let wanted = (accuracy / sum).powf(1.0 / order) / guess(order);
                known = Some((h, wanted));
                let is_short = wanted > SHORT && h < longest;
                if is_short && !is_longest {
                    settings.step = (2.0 * h).min(longest);
                    continue;
                }
                let is_near = wanted >= FAR || steps < MANY_TO_PROBE * wanted || order < HIGH;
                if is_near || halved == MAX_HALVED {
                    break;
                }
                halved += 1;
                is_longest = true;
                settings.step = h / 2.0;
                continue;
            }
            Ok(differences) if differences > 1.0 => 4.0,
            Ok(_) => 2.0,
            Err(failed) if failure.is_some() && failed.is_unresolved() => break,
            Err(failed) => {
                failure = Some(failed.kind);
                3.0
            }
        };
        if known.is_some() {
            break;
        }
        is_longest = true;
        settings.step /= shorter;
    }
    if let Some((h, wanted)) = known {
        settings.step = h;
        return Ok((h * wanted.clamp(1e-3, 2.0), wanted));
    }
    // Without a failure all steps differ, down to those that no time resolves.
    Err(failure.unwrap_or(RunErrorKind::TooManySteps {
        span: span.end - span.start,
        step: settings.step,
    }))
}

/// A safety factor of the estimate, so that the second run is usually the last one: errors of high order decrease more
/// slowly than their order says where steps are long, and the start does not show all phases of the motion. For low
/// orders the sum of local errors overestimates the error.
pub(super) fn guess(order: f64) -> f64 {
    if order > HIGH { 1.3 * LONGER } else { 0.9 }
}
