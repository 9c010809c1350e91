//! Sequential quadratic programming on a chain of elements: corrections until they are small, each as far as a merit falls.

use super::condensed::Condensed;
use super::correction::Step;
use super::curvature::Descent;
use super::problem::{Evaluation, Iterate, Problem};
use crate::assembly::size;
use nalgebra::DVector;

/// One iteration of the search.
///
/// If further iterations follow one whose correction is below the tolerance, it had reached a stationary point that is
/// not a minimum, and the search has left it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Iteration {
    /// The cost before the iteration.
    pub cost: f64,
    /// The largest gap between the end of an element and the node that follows, relative to the largest number of the
    /// nodes.
    pub gap: f64,
    /// The size of the correction, relative to the solution.
    pub correction: f64,
    /// The fraction of the correction that was applied (line search).
    pub fraction: f64,
    /// The weight of the curvature of the equations of motion in the quadratic model; with 1 the iteration is Newton's
    /// method.
    pub curvature: f64,
}

/// Why a search ended without a solution.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Failure {
    /// An element has no linearisation.
    Undefined {
        element: usize,
    },
    /// No quadratic model has a minimum.
    Singular,
    Stalled {
        correction: f64,
    },
    /// A stationary point from which the cost falls, along changes that begin in an element.
    NoMinimum {
        element: usize,
    },
}

/// How it is searched.
#[derive(Clone, Copy, Debug)]
pub(super) struct Control {
    pub(super) tolerance: f64,
    pub(super) max_iterations: usize,
    pub(super) progress: bool,
}

/// Shares of the curvature of the equations that are tried, and with the last one a weight on the changes of the inputs.
const MODELS: [(f64, f64); 11] = [
    (1.0, 0.0),
    (0.5, 0.0),
    (0.25, 0.0),
    (0.1, 0.0),
    (0.0, 0.0),
    (0.0, 1e-3),
    (0.0, 1e-2),
    (0.0, 0.1),
    (0.0, 1.0),
    (0.0, 10.0),
    (0.0, 100.0),
];

/// The least curvature of a model along its step, beside what the cost alone has there.
const LEAST_CURVATURE: f64 = 1e-3;

/// The weights of violated equations beside their multipliers, and the most that they may be.
const MARGIN: f64 = 1.1;
const LARGEST_MARGIN: f64 = 10.0;

/// How much of the decrease that the slope promises a step must bring.
const DECREASE: f64 = 1e-4;

/// The shortest part of a step that is tried: before another model is, and of the last ones.
const SHORT: f64 = 1.0 / 16.0;
const SHORTEST: f64 = 1.0 / 1024.0;

/// So many of the last merits are looked at: the merit of an iterate need only fall below the largest of them, because it may rise along steps of Newton's method near a solution (Maratos).
const MEMORY: usize = 4;

/// Corrections below this one are taken whole: what the merit tells there is rounding.
const NEAR: f64 = 1e-7;

/// Corrections below this one that no longer fall are round-off.
const ROUND_OFF: f64 = 1e-9;

/// The least share of a downward curvature in the sizes of what it is the sum of. At best the cost falls by some square of it along such a change, which below some 10⁻⁸ is lost in the roundings of the
/// cost; and where a search comes near slowly, as where inputs cost nothing, second derivatives are known to some hundred of its last corrections.
const FLAT: f64 = 1e-7;

/// How often a search leaves stationary points that are no minima.
const DEPARTURES: usize = 8;

/// The share of what the curvature promises by which the Lagrangian must fall for a stationary point to be left so far: a half, as it does at the minimum of a polynomial of fourth degree.
const PROMISED: f64 = 0.5;

/// How often the distance to which a point is left is halved or doubled.
const DISTANCES: usize = 128;

impl Problem<'_> {
    /// The correction beside the iterate.
    fn size(&self, step: &Step, condensed: &[Condensed], iterate: &Iterate) -> f64 {
        let n = self.sizes.dof;
        let nodes = iterate.nodes.iter().zip(&step.change.nodes);
        let nodes = nodes.map(|(node, change)| {
            let (p, q) = node.as_slice().split_at(n);
            (p, q, change.as_slice())
        });
        let mut matrices = Vec::new();
        for one in &condensed[..self.blocks.len()] {
            let by_state = one.ends.columns(0, 2 * n).transpose();
            matrices.extend_from_slice(by_state.as_slice());
        }
        let largest = |values: &[DVector<f64>]| {
            (values.iter().flat_map(|part| part.iter())).fold(0.0_f64, |most, x| most.max(x.abs()))
        };
        let scale = largest(&iterate.steering).max(largest(&step.change.steering));
        let inputs = step.change.steering.iter().flat_map(|part| part.iter());
        let inputs = inputs.map(|change| if *change == 0.0 { 0.0 } else { change / scale });
        size(nodes, &matrices, inputs)
    }

    /// The gap between elements, beside the largest number of the nodes.
    fn gap(&self, evaluation: &Evaluation, iterate: &Iterate) -> f64 {
        let x = self.sizes.interior;
        let elements = &evaluation.rows[..self.blocks.len()];
        let gaps = elements
            .iter()
            .map(|rows| rows.rows(x, rows.len() - x).amax());
        let nodes = iterate.nodes.iter().map(DVector::amax);
        let (gap, largest) = (gaps.fold(0.0, f64::max), nodes.fold(0.0, f64::max));
        if gap == 0.0 { 0.0 } else { gap / largest }
    }

    /// Looks for the minimum from an iterate on, which is left where the search ends.
    pub(super) fn solve(
        &self,
        iterate: &mut Iterate,
        control: Control,
        history: &mut Vec<Iteration>,
    ) -> Result<(), Failure> {
        let mut chain = self.chain();
        let mut evaluation = self.evaluate(iterate);
        let mut weights: Vec<DVector<f64>> = Vec::new();
        let mut past: Vec<Evaluation> = Vec::new();
        let mut last = f64::INFINITY;
        let (mut departures, mut left): (usize, Option<usize>) = (0, None);
        loop {
            let condensed = self.linearise(iterate);
            let condensed = condensed.map_err(|element| Failure::Undefined { element })?;
            let gap = self.gap(&evaluation, iterate);
            let mut outcome = Err(Failure::Singular);
            let scale = self.scale(&condensed);
            for (share, weight) in MODELS {
                let model = (share, weight * scale);
                let Some(step) = self.step(&mut chain, &condensed, iterate, model) else {
                    continue;
                };
                let correction = self.size(&step, &condensed, iterate);
                let mut note = Iteration {
                    cost: evaluation.cost,
                    gap,
                    correction,
                    fraction: 1.0,
                    curvature: share,
                };
                let is_round_off = last < ROUND_OFF && correction >= 0.25 * last;
                if correction <= control.tolerance || is_round_off {
                    iterate.add(1.0, &step.change);
                    self.tell(control, history, note);
                    let is_last =
                        departures == DEPARTURES || history.len() >= control.max_iterations;
                    let Some((element, there)) = self.leave(iterate, correction, is_last)? else {
                        return Ok(());
                    };
                    if control.progress {
                        eprintln!(
                            "no minimum: left along a change that begins in element {element}"
                        );
                    }
                    evaluation = there;
                    // The search begins anew: what counts is no longer whether the merit falls below that of the point that was left.
                    past.clear();
                    weights.clear();
                    last = f64::INFINITY;
                    departures += 1;
                    left = Some(element);
                    outcome = Ok(());
                    break;
                }
                if !(step.curvature >= LEAST_CURVATURE * step.of_cost.abs()) {
                    continue;
                }
                let Some(margin) = margin(&step, &evaluation) else {
                    continue;
                };
                outcome = Err(Failure::Stalled { correction });
                if history.len() >= control.max_iterations {
                    break;
                }
                raise(&mut weights, &step.rows, margin);
                let Some((fraction, next)) = self.shortened(
                    iterate,
                    &step,
                    (&evaluation, &past),
                    &weights,
                    (correction, if share > 0.0 { SHORT } else { SHORTEST }),
                ) else {
                    continue;
                };
                note.fraction = fraction;
                self.tell(control, history, note);
                past.push(std::mem::replace(&mut evaluation, next));
                if past.len() > MEMORY {
                    past.remove(0);
                }
                last = correction;
                outcome = Ok(());
                break;
            }
            outcome.map_err(|failure| match (failure, left) {
                (Failure::Singular, Some(element)) => Failure::NoMinimum { element },
                _ => failure,
            })?;
        }
    }

    /// Leaves a stationary point that is no minimum, with the element in which the change begins that leads away; none at a minimum.
    ///
    /// `is_last` says that no search would follow.
    fn leave(
        &self,
        iterate: &mut Iterate,
        correction: f64,
        is_last: bool,
    ) -> Result<Option<(usize, Evaluation)>, Failure> {
        let condensed = self.linearise(iterate);
        let condensed = condensed.map_err(|element| Failure::Undefined { element })?;
        let Some(descent) = self.descent(&condensed, correction.max(FLAT)) else {
            return Ok(None);
        };
        let element = descent.element;
        let no_minimum = Failure::NoMinimum { element };
        if is_last {
            return Err(no_minimum);
        }
        let (next, evaluation) = self.departed(iterate, &descent).ok_or(no_minimum)?;
        *iterate = next;
        Ok(Some((element, evaluation)))
    }

    /// As far along a change that curves down as the Lagrangian falls as the curvature promises; none where that is nowhere, or everywhere.
    ///
    /// The Lagrangian tells it rather than the merit, which may rise along every straight line from a point where equations are curved. The better one of both sides is taken.
    fn departed(&self, iterate: &Iterate, descent: &Descent) -> Option<(Iterate, Evaluation)> {
        let start = self.evaluate(iterate);
        let level = self.lagrangian(&start, iterate);
        let tried = |distance: f64| {
            let promised = 0.5 * distance * distance * descent.curvature;
            if !(-promised > f64::EPSILON * level.abs()) {
                return None;
            }
            let mut lowest = PROMISED * promised;
            let mut found: Option<(Iterate, Evaluation)> = None;
            for signed in [distance, -distance] {
                let mut next = iterate.clone();
                next.add(signed, &descent.change);
                let evaluation = self.evaluate(&next);
                let change = self.lagrangian(&evaluation, &next) - level;
                if change.is_finite() && change < lowest {
                    lowest = change;
                    found = Some((next, evaluation));
                }
            }
            found
        };
        let scale = if start.cost == 0.0 {
            1.0
        } else {
            start.cost.abs()
        };
        let mut distance = (2.0 * scale / -descent.curvature).sqrt();
        let Some(mut found) = tried(distance) else {
            return (0..DISTANCES).find_map(|_| {
                distance *= 0.5;
                tried(distance)
            });
        };
        for _ in 0..DISTANCES {
            distance *= 2.0;
            let Some(farther) = tried(distance) else {
                return Some(found);
            };
            found = farther;
        }
        None
    }

    /// Takes a part of a step with which the merit falls; the part, and what is then.
    fn shortened(
        &self,
        iterate: &mut Iterate,
        step: &Step,
        (now, past): (&Evaluation, &[Evaluation]),
        weights: &[DVector<f64>],
        (correction, shortest): (f64, f64),
    ) -> Option<(f64, Evaluation)> {
        let slope = step.slope - now.violation(weights);
        let merits = past.iter().map(|past| past.merit(weights));
        let reference = merits.fold(now.merit(weights), f64::max);
        let mut fraction = 1.0;
        while fraction >= shortest {
            let mut next = iterate.clone();
            next.add(fraction, &step.change);
            let evaluation = self.evaluate(&next);
            let merit = evaluation.merit(weights);
            let is_near = correction < NEAR && fraction == 1.0;
            if merit.is_finite() && (is_near || merit <= reference + DECREASE * fraction * slope) {
                *iterate = next;
                return Some((fraction, evaluation));
            }
            fraction *= 0.5;
        }
        None
    }

    fn tell(&self, control: Control, history: &mut Vec<Iteration>, note: Iteration) {
        if control.progress {
            let Iteration {
                cost,
                gap,
                correction,
                fraction,
                ..
            } = note;
            let number = history.len() + 1;
            eprintln!(
                "iteration {number}: cost {cost:.10e}, gap {gap:.1e}, correction {correction:.1e}, of which {fraction:.3} taken"
            );
        }
        history.push(note);
    }
}

/// How many times as large as their multipliers the weights of violated equations must be for the merit to fall along a step; none where they would have to be too large.
fn margin(step: &Step, now: &Evaluation) -> Option<f64> {
    let gaps = now.violation(&step.rows.iter().map(DVector::abs).collect::<Vec<_>>());
    let needed = step.slope / gaps + LEAST_CURVATURE;
    if step.slope - MARGIN * gaps < 0.0 {
        return Some(MARGIN);
    }
    (needed <= LARGEST_MARGIN).then_some(needed.max(MARGIN))
}

/// Makes the weights of violated equations larger than their multipliers, and lets those fall slowly that are much larger (Powell).
fn raise(weights: &mut Vec<DVector<f64>>, multipliers: &[DVector<f64>], margin: f64) {
    if weights.is_empty() {
        *weights = multipliers.iter().map(|rows| margin * rows.abs()).collect();
        return;
    }
    for (weights, multipliers) in weights.iter_mut().zip(multipliers) {
        for (weight, multiplier) in weights.iter_mut().zip(multipliers.iter()) {
            let least = margin * multiplier.abs();
            *weight = least.max(0.5 * (*weight + least));
        }
    }
}
