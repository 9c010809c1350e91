//! One step at the start against two of half its length: a step that is near.

use super::super::trace::difference;
use super::runs::{Asked, HIGH, LONGER, MANY_TO_PROBE, Runner, Way, largest};
use crate::error::RunErrorKind;

/// A step that is near, and by what factor it should be longer than the longest one that could be made, which stays in `way`: one step at the start against two of half its length.
pub(super) fn probe(
    asked: &Asked,
    way: &mut Way<'_>,
    longest: f64,
    run: &mut dyn Runner,
) -> Result<(f64, f64), RunErrorKind> {
    /// Halvings of the span: 2⁻⁶⁰ of it is nothing.
    const MOST: u32 = 60;
    /// A difference that tells the order.
    const CLEAR: f64 = 1e-3;
    /// Errors are not known to go on falling over a larger factor.
    const FAR: f64 = 0.6;
    /// Shorter steps that are tried only to know better.
    const MOST_HALVED: u32 = 1;
    /// A step that is to be longer by more is tried.
    const SHORT: f64 = 1.8;
    let Asked { accuracy, span, .. } = asked;
    let length = (span.end - span.start).abs();
    let direction = (span.end - span.start).signum();
    let order = way.element.order() as f64;
    let mut failure = None;
    // What is known, and that longer steps are no good.
    let mut known: Option<(f64, f64)> = None;
    let mut is_longest = false;
    let mut halved = 0;
    for _ in 0..MOST {
        let h = way.step;
        let cuts = [span.start, span.start + direction * h];
        let mut over = |step: f64| {
            run.run(&Way {
                step,
                cuts: &cuts,
                ..way.clone()
            })
        };
        let pair = over(h).and_then(|whole| Ok((whole, over(h / 2.0)?)));
        let apart = pair.map(|(whole, halves)| {
            largest(&difference(&whole.trace, &halves.trace)).max(f64::EPSILON)
        });
        let shorter = match apart {
            Ok(apart) if apart <= CLEAR => {
                // Steps whose local errors add up to what is asked, and drift as errors of a frequency do.
                let steps = length / h;
                let sum = apart * steps * (steps / 4.0).max(1.0);
                let wanted = (accuracy / sum).powf(1.0 / order) / guess(order);
                known = Some((h, wanted));
                let is_short = wanted > SHORT && h < longest;
                if is_short && !is_longest {
                    way.step = (2.0 * h).min(longest);
                    continue;
                }
                let is_near = wanted >= FAR || steps < MANY_TO_PROBE * wanted || order < HIGH;
                if is_near || halved == MOST_HALVED {
                    break;
                }
                halved += 1;
                is_longest = true;
                way.step = h / 2.0;
                continue;
            }
            Ok(apart) if apart > 1.0 => 4.0,
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
        way.step /= shorter;
    }
    if let Some((h, wanted)) = known {
        way.step = h;
        return Ok((h * wanted.clamp(1e-3, 2.0), wanted));
    }
    Err(failure.unwrap_or(RunErrorKind::Step { step: way.step }))
}

/// How much shorter than a probe says the second step is, so that it is mostly the last one: errors of high order fall with less than their power where steps are long, and
/// a motion meets what its start does not show. The sum that low orders go by is more than errors add up to.
pub(super) fn guess(order: f64) -> f64 {
    if order > HIGH { 1.3 * LONGER } else { 0.9 }
}
