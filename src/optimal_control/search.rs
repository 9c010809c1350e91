//! Sequential quadratic programming on a chain of elements, with a line search on a merit function.

use super::condensed::Condensed;
use super::correction::Step;
use super::curvature::Descent;
use super::problem::{Evaluation, Iterate, Problem};
use crate::assembly::{Chain, size};
use crate::numbers::{larger, largest};
use nalgebra::DVector;
use std::mem;

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

/// The error of a search.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Failure {
    /// An element cannot be linearised.
    Undefined {
        element: usize,
    },
    /// No quadratic model has a minimum.
    Singular,
    Stalled {
        correction: f64,
    },
    /// A stationary point at which the cost has negative curvature, in a direction that begins in an element.
    NoMinimum {
        element: usize,
    },
}

/// The parameters of a search.
#[derive(Clone, Copy, Debug)]
pub(super) struct Control {
    pub(super) tolerance: f64,
    pub(super) max_iterations: usize,
    pub(super) progress: bool,
}

/// The quadratic models that are tried in turn: the fraction of the curvature of the equations, and a weight on the
/// changes of the inputs (regularisation).
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

/// The least curvature of a model along its step, relative to that of the cost alone.
const MIN_CURVATURE: f64 = 1e-3;

/// The weights of the merit function relative to the multipliers: the usual and the largest ratio.
const MARGIN: f64 = 1.1;
const LARGEST_MARGIN: f64 = 10.0;

/// The fraction of the predicted decrease that a step must achieve (Armijo condition).
const DECREASE: f64 = 1e-4;

/// The shortest fraction of a step before another model is tried, and the shortest for the last model.
const SHORT: f64 = 1.0 / 16.0;
const SHORTEST: f64 = 1.0 / 1024.0;

/// The number of past merits with the largest of which a step is compared (nonmonotone line search): near a solution,
/// Newton steps may increase the merit (Maratos effect).
const MEMORY: usize = 4;

/// Smaller corrections are applied completely: differences of the merit are rounding errors there.
const NEAR: f64 = 1e-7;

/// Smaller corrections that no longer decrease are rounding errors.
const ROUND_OFF: f64 = 1e-9;

/// The least relative size of a negative curvature that counts. The cost decreases by about its square along such a
/// direction, which for sizes below about 10⁻⁸ is lost in rounding errors. After slow convergence, as with inputs
/// without cost, second derivatives have errors of about a hundred times the last correction.
const FLAT: f64 = 1e-7;

/// The number of stationary points other than minima that a search may leave.
const DEPARTURES: usize = 8;

/// The fraction of the decrease predicted by the negative curvature that the Lagrangian must achieve: one half, as at
/// the minimum of a fourth-degree polynomial.
const PROMISED: f64 = 0.5;

/// The largest number of times that the distance from a stationary point is halved or doubled.
const DISTANCES: usize = 128;

/// What a search keeps from one iteration to the next.
struct Search {
    evaluation: Evaluation,
    /// The weights of the merit function.
    weights: Vec<DVector<f64>>,
    /// The evaluations before, with the largest merit of which a step is compared.
    past: Vec<Evaluation>,
    /// The last correction.
    last: f64,
    /// The number of stationary points that were left, and the element in which the change began that left the last one.
    departures: usize,
    left: Option<usize>,
}

impl Search {
    fn new(evaluation: Evaluation) -> Self {
        Self {
            evaluation,
            weights: Vec::new(),
            past: Vec::new(),
            last: f64::INFINITY,
            departures: 0,
            left: None,
        }
    }

    fn is_round_off(&self, correction: f64) -> bool {
        self.last < ROUND_OFF && correction >= 0.25 * self.last
    }

    /// Continues from the end of a step.
    fn pass(&mut self, correction: f64, next: Evaluation) {
        self.past.push(mem::replace(&mut self.evaluation, next));
        if self.past.len() > MEMORY {
            self.past.remove(0);
        }
        self.last = correction;
    }
}

impl Problem<'_> {
    /// The size of the correction relative to the iterate.
    pub(super) fn size(&self, step: &Step, condensed: &[Condensed], iterate: &Iterate) -> f64 {
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

    /// The largest gap between elements relative to the largest component of the nodes.
    fn gap(&self, evaluation: &Evaluation, iterate: &Iterate) -> f64 {
        let x = self.sizes.interior;
        let elements = &evaluation.rows[..self.blocks.len()];
        let gaps = elements.iter().map(|rows| largest(&rows.as_slice()[x..]));
        let nodes = iterate.nodes.iter().map(|node| largest(node.as_slice()));
        let (gap, largest) = (gaps.fold(0.0, larger), nodes.fold(0.0, larger));
        if gap == 0.0 { 0.0 } else { gap / largest }
    }

    /// Searches for the minimum from an iterate, which is updated to the final one.
    pub(super) fn solve(
        &self,
        iterate: &mut Iterate,
        control: Control,
        history: &mut Vec<Iteration>,
    ) -> Result<(), Failure> {
        let mut chain = self.chain();
        let mut search = Search::new(self.evaluate(iterate));
        loop {
            let done = self.improve(&mut search, &mut chain, iterate, (control, history));
            let is_minimum = done.map_err(|failure| match (failure, search.left) {
                (Failure::Singular, Some(element)) => Failure::NoMinimum { element },
                _ => failure,
            })?;
            if is_minimum {
                return Ok(());
            }
        }
    }

    /// One iteration: a step of the first quadratic model with which the merit decreases. Returns whether the iterate is
    /// a minimum.
    fn improve(
        &self,
        search: &mut Search,
        chain: &mut Chain,
        iterate: &mut Iterate,
        (control, history): (Control, &mut Vec<Iteration>),
    ) -> Result<bool, Failure> {
        let condensed = self.linearise(iterate);
        let condensed = condensed.map_err(|element| Failure::Undefined { element })?;
        let gap = self.gap(&search.evaluation, iterate);
        let scale = self.scale(&condensed);
        let mut failure = Failure::Singular;
        for (share, weight) in MODELS {
            let Some(step) = self.step(chain, &condensed, iterate, (share, weight * scale)) else {
                continue;
            };
            let correction = self.size(&step, &condensed, iterate);
            let mut note = Iteration {
                cost: search.evaluation.cost,
                gap,
                correction,
                fraction: 1.0,
                curvature: share,
            };
            if correction <= control.tolerance || search.is_round_off(correction) {
                iterate.add(1.0, &step.change);
                self.tell(control, history, note);
                let is_last = history.len() >= control.max_iterations;
                return self.is_minimum(search, iterate, correction, (control, is_last));
            }
            if !(step.curvature >= MIN_CURVATURE * step.of_cost.abs()) {
                continue;
            }
            let Some(margin) = margin(&step, &search.evaluation) else {
                continue;
            };
            failure = Failure::Stalled { correction };
            if history.len() >= control.max_iterations {
                break;
            }
            raise(&mut search.weights, &step.rows, margin);
            let shortest = if share > 0.0 { SHORT } else { SHORTEST };
            if let Some((fraction, next)) =
                self.shortened(iterate, &step, search, (correction, shortest))
            {
                note.fraction = fraction;
                self.tell(control, history, note);
                search.pass(correction, next);
                return Ok(false);
            }
        }
        Err(failure)
    }

    /// Whether a stationary point is a minimum. If it is not, the search begins anew beside it.
    fn is_minimum(
        &self,
        search: &mut Search,
        iterate: &mut Iterate,
        correction: f64,
        (control, is_last): (Control, bool),
    ) -> Result<bool, Failure> {
        let is_last = is_last || search.departures == DEPARTURES;
        let Some((element, evaluation)) = self.leave(iterate, correction, is_last)? else {
            return Ok(true);
        };
        if control.progress {
            eprintln!("no minimum: left along a change that begins in element {element}");
        }
        *search = Search {
            departures: search.departures + 1,
            left: Some(element),
            ..Search::new(evaluation)
        };
        Ok(false)
    }

    /// Leaves a stationary point that is not a minimum; returns the element in which the direction of descent begins.
    /// `None` at a minimum.
    ///
    /// `is_last`: no search would follow.
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

    /// Moves in a direction of negative curvature as far as the Lagrangian decreases as predicted; `None` if it nowhere
    /// does, or does at any distance.
    ///
    /// The Lagrangian is used instead of the merit function, which may increase along every straight line if the
    /// equations are nonlinear. Both signs of the direction are tried.
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

    /// Applies the largest fraction of a step that decreases the merit sufficiently; returns the fraction and the
    /// evaluation there.
    fn shortened(
        &self,
        iterate: &mut Iterate,
        step: &Step,
        search: &Search,
        (correction, shortest): (f64, f64),
    ) -> Option<(f64, Evaluation)> {
        let (now, weights) = (&search.evaluation, &search.weights);
        let slope = step.slope - now.violation(weights);
        let merits = search.past.iter().map(|past| past.merit(weights));
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

/// The ratio of weights to multipliers with which the merit decreases along a step; `None` if it would be too large.
fn margin(step: &Step, now: &Evaluation) -> Option<f64> {
    let gaps = now.violation(&step.rows.iter().map(DVector::abs).collect::<Vec<_>>());
    let needed = step.slope / gaps + MIN_CURVATURE;
    if step.slope - MARGIN * gaps < 0.0 {
        return Some(MARGIN);
    }
    (needed <= LARGEST_MARGIN).then_some(needed.max(MARGIN))
}

/// Raises the weights above the multipliers, and lowers those that are much larger gradually (Powell).
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
