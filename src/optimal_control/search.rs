//! Sequential quadratic programming on a chain of elements.
//!
//! Every iteration minimises a quadratic model of the Lagrangian of the problem under the linearised equations. Without interiors and inputs it is a chain in
//! (δy_e, λ_e), which `assembly` solves by structured orthogonal elimination (theory.md, (T-144) to (T-148)).

use super::block::{Block, Values};
use super::condensed::{Condensed, Quadratic};
use super::transcription::Sizes;
use crate::assembly::{Chain, size};
use nalgebra::{DMatrix, DVector};
use tfe_runtime::Controlled;

/// The unknowns, or a change of them.
#[derive(Clone, Debug)]
pub(super) struct Iterate {
    /// (p, q) of the nodes.
    pub(super) nodes: Vec<DVector<f64>>,
    /// The interiors of the elements, and then of the block of the end.
    pub(super) interiors: Vec<DVector<f64>>,
    /// The coefficients of the inputs.
    pub(super) steering: Vec<DVector<f64>>,
    /// The multipliers of the rows of the interiors.
    pub(super) multipliers: Vec<DVector<f64>>,
    /// λ: what a change of each node is worth.
    pub(super) costates: Vec<DVector<f64>>,
}

impl Iterate {
    fn add(&mut self, factor: f64, step: &Self) {
        let own = [
            &mut self.nodes,
            &mut self.interiors,
            &mut self.steering,
            &mut self.multipliers,
            &mut self.costates,
        ];
        let steps = [
            &step.nodes,
            &step.interiors,
            &step.steering,
            &step.multipliers,
            &step.costates,
        ];
        for (own, step) in own.into_iter().zip(steps) {
            for (value, change) in own.iter_mut().zip(step) {
                value.axpy(factor, change, 1.0);
            }
        }
    }
}

/// What a node at an end of the chain is held by.
#[derive(Clone, Debug)]
pub(super) struct Ends {
    /// Which components (p, q) of the first node are given.
    pub(super) first: Vec<bool>,
    /// Which of the last.
    pub(super) last: Vec<bool>,
}

/// What is to be minimised.
pub(super) struct Problem<'a, M> {
    pub(super) model: &'a M,
    pub(super) sizes: Sizes,
    /// One for each element.
    pub(super) blocks: Vec<Block>,
    /// What the end costs.
    pub(super) end: Option<Block>,
    /// Lengths of the elements.
    pub(super) lengths: Vec<f64>,
    pub(super) ends: Ends,
}

/// One iteration, as it went.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Iteration {
    /// The cost before it.
    pub cost: f64,
    /// The largest gap between an element's end and the node that follows, beside the largest number of the nodes.
    pub gap: f64,
    /// The size of the correction beside the solution.
    pub correction: f64,
    /// The part of the correction that was taken.
    pub fraction: f64,
    /// The share of the curvature of the equations that the quadratic model had: 1 makes it Newton's method.
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
}

/// How it is searched.
#[derive(Clone, Copy, Debug)]
pub(super) struct Control {
    pub(super) tolerance: f64,
    pub(super) max_iterations: usize,
    pub(super) progress: bool,
}

/// The solution of a quadratic model.
struct Step {
    change: Iterate,
    /// The new multipliers of all rows, block by block: interior, then end.
    rows: Vec<DVector<f64>>,
    /// The first derivative of the cost along the step.
    slope: f64,
    /// The second derivative of the model along the part of the step that closes no gaps.
    curvature: f64,
    /// What the cost has of it.
    of_cost: f64,
}

/// An element without inputs: δy₊ = A δy − G λ₊ + r and λ = Q δy + Aᵀ λ₊ + g. There are two g and r: those of the step, and those of its part that closes no gaps.
struct Link {
    by_inputs: Factored,
    a: DMatrix<f64>,
    q: DMatrix<f64>,
    g: DMatrix<f64>,
    gradients: DMatrix<f64>,
    rights: DMatrix<f64>,
}

/// R⁻¹ Sᵀ, R⁻¹ Bᵀ and R⁻¹ g of the inputs.
struct Factored {
    state: DMatrix<f64>,
    end: DMatrix<f64>,
    own: DMatrix<f64>,
}

impl Factored {
    fn inputs(&self, side: usize, node: &DVector<f64>, end: &DVector<f64>) -> DVector<f64> {
        -(&self.state * node + self.own.column(side) + &self.end * end)
    }
}

/// The steps that a chain is solved for: the whole one, and the part that closes no gaps.
const SIDES: usize = 2;
const WHOLE: usize = 0;
const ALONG: usize = 1;

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

/// Cost and residuals of all blocks.
struct Evaluation {
    cost: f64,
    rows: Vec<DVector<f64>>,
}

impl Evaluation {
    fn merit(&self, weights: &[DVector<f64>]) -> f64 {
        self.cost + self.violation(weights)
    }

    fn violation(&self, weights: &[DVector<f64>]) -> f64 {
        let blocks = self.rows.iter().zip(weights);
        blocks.map(|(rows, weights)| rows.abs().dot(weights)).sum()
    }
}

impl<M> Problem<'_, M> {
    fn blocks(&self) -> impl Iterator<Item = &Block> {
        self.blocks.iter().chain(&self.end)
    }

    /// s of a block.
    pub(super) fn variables(&self, iterate: &Iterate, block: usize) -> DVector<f64> {
        let steering = iterate.steering.get(block).map(DVector::as_slice);
        let parts = [
            iterate.interiors[block].as_slice(),
            iterate.nodes[block].as_slice(),
            steering.unwrap_or(&[]),
        ];
        DVector::from_vec(parts.concat())
    }

    /// The residuals of a block, of which the last are gaps to the node that follows.
    fn residuals(&self, values: &Values, iterate: &Iterate, block: usize) -> DVector<f64> {
        let mut rows = values.rows.clone();
        if block < self.blocks.len() {
            let x = self.sizes.interior;
            let mut end = rows.rows_mut(x, 2 * self.sizes.dof);
            end -= &iterate.nodes[block + 1];
        }
        rows
    }

    fn evaluate<const N: usize>(&self, iterate: &Iterate) -> Evaluation
    where
        M: Controlled<N>,
    {
        let mut evaluation = Evaluation {
            cost: 0.0,
            rows: Vec::new(),
        };
        for (at, block) in self.blocks().enumerate() {
            let values = block.values(self.model, &self.variables(iterate, at));
            evaluation.cost += values.cost;
            evaluation.rows.push(self.residuals(&values, iterate, at));
        }
        evaluation
    }

    /// The cost of an iterate.
    pub(super) fn cost<const N: usize>(&self, iterate: &Iterate) -> f64
    where
        M: Controlled<N>,
    {
        self.evaluate(iterate).cost
    }

    fn linearise<const N: usize>(&self, iterate: &Iterate) -> Result<Vec<Condensed>, Failure>
    where
        M: Controlled<N>,
    {
        let blocks = self.blocks().enumerate().map(|(at, block)| {
            let inner = iterate.multipliers[at].as_slice();
            let end = match at < self.blocks.len() {
                true => iterate.costates[at + 1].as_slice(),
                false => &[],
            };
            let multipliers = DVector::from_vec([inner, end].concat());
            let linear = block.linearise(self.model, &self.variables(iterate, at), &multipliers);
            Condensed::new(block, linear).ok_or(Failure::Undefined { element: at })
        });
        blocks.collect()
    }

    /// The weights of changes of the inputs of an element: ∫ P_k² dt.
    fn metric(&self, element: usize, weight: f64) -> impl Iterator<Item = (usize, f64)> {
        let Sizes { inputs, .. } = self.sizes;
        let h = self.lengths[element].abs();
        let first = self.sizes.interior + 2 * self.sizes.dof;
        (0..self.sizes.steering()).map(move |at| {
            let degree = at / inputs;
            (first + at, weight * h / (2 * degree + 1) as f64)
        })
    }

    /// The largest second derivative of the cost by an input, in the metric of the inputs.
    fn scale(&self, condensed: &[Condensed]) -> f64 {
        let mut largest = 0.0_f64;
        for element in 0..self.blocks.len() {
            for (at, metric) in self.metric(element, 1.0) {
                let entry = condensed[element].linear.of_cost[(at, at)].abs();
                largest = largest.max(entry / metric);
            }
        }
        if largest > 0.0 { largest } else { 1.0 }
    }

    fn link(
        &self,
        condensed: &Condensed,
        quadratic: &Quadratic,
        next: &DVector<f64>,
    ) -> Option<Link> {
        let n = 2 * self.sizes.dof;
        let c = self.sizes.steering();
        let matrix = &quadratic.matrix;
        let factors = matrix.view((n, n), (c, c)).into_owned().lu();
        let coupling = matrix.view((0, n), (n, c)).into_owned();
        let (a, b) = (
            condensed.ends.columns(0, n).into_owned(),
            condensed.ends.columns(n, c).into_owned(),
        );
        let by_inputs = Factored {
            state: factors.solve(&coupling.transpose())?,
            end: factors.solve(&b.transpose())?,
            own: factors.solve(&quadratic.gradients.rows(n, c).into_owned())?,
        };
        let mut rights = -(&b * &by_inputs.own);
        let mut whole = rights.column_mut(WHOLE);
        whole += &condensed.reached - next;
        Some(Link {
            a: a - &b * &by_inputs.state,
            q: matrix.view((0, 0), (n, n)) - &coupling * &by_inputs.state,
            g: &b * &by_inputs.end,
            gradients: quadratic.gradients.rows(0, n) - &coupling * &by_inputs.own,
            rights,
            by_inputs,
        })
    }

    /// The minimum of the quadratic model with this share of the curvature of the equations.
    fn step(
        &self,
        chain: &mut Chain,
        condensed: &[Condensed],
        iterate: &Iterate,
        (share, weight): (f64, f64),
    ) -> Option<Step> {
        let n = 2 * self.sizes.dof;
        let elements = self.blocks.len();
        let mut hessians: Vec<_> = condensed.iter().map(|one| one.hessian(share)).collect();
        if weight > 0.0 {
            for element in 0..elements {
                for (at, metric) in self.metric(element, weight) {
                    hessians[element][(at, at)] += metric;
                }
            }
        }
        let mut links = Vec::with_capacity(elements);
        for element in 0..elements {
            let quadratic = condensed[element].quadratic(&hessians[element]);
            links.push(self.link(&condensed[element], &quadratic, &iterate.nodes[element + 1])?);
        }
        let units = units(&links, n);
        // The numbers of the chain are y over its unit and λ times it: rows are scaled by the reciprocals of what columns are.
        let (state, costate) = (&units, &units.map(f64::recip));
        for (element, link) in links.iter().enumerate() {
            let backward = link.a.transpose().lu().try_inverse()?;
            let carried = &link.g * &backward;
            let mut matrix = DMatrix::zeros(2 * n, 2 * n);
            let blocks = [
                (0, 0, &link.a + &carried * &link.q),
                (0, n, -&carried),
                (n, 0, -(&backward * &link.q)),
                (n, n, backward.clone()),
            ];
            for (row, column, block) in blocks {
                let of_rows = if row == 0 { costate } else { state };
                let of_columns = if column == 0 { state } else { costate };
                let scaled = block.map_with_location(|i, j, x| of_rows[i] * x * of_columns[j]);
                matrix.view_mut((row, column), (n, n)).copy_from(&scaled);
            }
            // The storage of nalgebra goes by columns.
            let rows = matrix.transpose();
            (chain.link_mut(element).matrix).copy_from_slice(rows.as_slice());
            let upper = &link.rights + &carried * &link.gradients;
            let lower = -(&backward * &link.gradients);
            for side in 0..SIDES {
                let right = &mut chain.right_side_mut(side).links;
                let right = &mut right[element * 2 * n..(element + 1) * 2 * n];
                let upper = upper.column(side).component_mul(costate);
                let lower = lower.column(side).component_mul(state);
                right[..n].copy_from_slice(upper.as_slice());
                right[n..].copy_from_slice(lower.as_slice());
            }
        }
        self.close(chain, condensed, &hessians, &units);
        chain.solve().ok()?;
        self.solution((chain, &units), condensed, &hessians, &links, iterate)
    }

    /// The conditions at both ends: a component is given, or its costate is that of the cost of the end.
    fn close(
        &self,
        chain: &mut Chain,
        condensed: &[Condensed],
        hessians: &[DMatrix<f64>],
        units: &DVector<f64>,
    ) {
        let n = 2 * self.sizes.dof;
        let closure = chain.closure_mut();
        closure.first.fill(0.0);
        closure.last.fill(0.0);
        let row = |at: usize| at * 2 * n..(at + 1) * 2 * n;
        let end = condensed.get(self.blocks.len());
        let end = end.map(|end| end.quadratic(&hessians[self.blocks.len()]));
        for at in 0..n {
            closure.first[row(at)][at + if self.ends.first[at] { 0 } else { n }] = 1.0;
            let last = &mut closure.last[row(n + at)];
            if self.ends.last[at] {
                last[at] = 1.0;
                continue;
            }
            last[n + at] = 1.0;
            if let Some(end) = &end {
                for (j, entry) in last[..n].iter_mut().enumerate() {
                    *entry = -units[at] * end.matrix[(at, j)] * units[j];
                }
            }
        }
        for side in 0..SIDES {
            let right = &mut chain.right_side_mut(side).closure;
            right.fill(0.0);
            for at in (0..n).filter(|at| !self.ends.last[*at]) {
                if let Some(end) = &end {
                    right[n + at] = units[at] * end.gradients[(at, side)];
                }
            }
        }
    }

    /// All unknowns from the nodes of the chain.
    fn solution(
        &self,
        (chain, units): (&Chain, &DVector<f64>),
        condensed: &[Condensed],
        hessians: &[DMatrix<f64>],
        links: &[Link],
        iterate: &Iterate,
    ) -> Option<Step> {
        let n = 2 * self.sizes.dof;
        let elements = self.blocks.len();
        let solved = |side: usize, e: usize| chain.node_of(side, e).split_at(n);
        let state_of = |side: usize, e: usize| {
            DVector::from_column_slice(solved(side, e).0).component_mul(units)
        };
        let costate_of = |side: usize, e: usize| {
            DVector::from_column_slice(solved(side, e).1).component_div(units)
        };
        let (node, costate) = (|e| state_of(WHOLE, e), |e| costate_of(WHOLE, e));
        let mut step = Step {
            change: Iterate {
                nodes: (0..=elements).map(node).collect(),
                interiors: Vec::new(),
                steering: Vec::new(),
                multipliers: Vec::new(),
                costates: (0..=elements)
                    .map(|e| costate(e) - &iterate.costates[e])
                    .collect(),
            },
            rows: Vec::new(),
            slope: 0.0,
            curvature: 0.0,
            of_cost: 0.0,
        };
        for (at, one) in condensed.iter().enumerate() {
            let change = &step.change.nodes[at];
            let along = state_of(ALONG, at);
            let (outer, along, end) = if let Some(link) = links.get(at) {
                let end = costate(at + 1);
                let inputs = link.by_inputs.inputs(WHOLE, change, &end);
                let outer = DVector::from_vec([change.as_slice(), inputs.as_slice()].concat());
                step.change.steering.push(inputs);
                let other = costate_of(ALONG, at + 1);
                let inputs = link.by_inputs.inputs(ALONG, &along, &other);
                let along = DVector::from_vec([along.as_slice(), inputs.as_slice()].concat());
                (outer, along, end)
            } else {
                (change.clone(), along, DVector::zeros(0))
            };
            let all = one.step(&outer);
            let inner = one.multipliers(&hessians[at], &all, &end)?;
            step.slope += one.linear.gradient.dot(&all);
            let along = one.along(&along);
            step.curvature += along.dot(&(&hessians[at] * &along));
            step.of_cost += along.dot(&(&one.linear.of_cost * &along));
            let interior = all.rows(0, all.len() - outer.len()).into_owned();
            step.change.interiors.push(interior);
            step.change
                .multipliers
                .push(&inner - &iterate.multipliers[at]);
            step.rows.push(DVector::from_vec(
                [inner.as_slice(), end.as_slice()].concat(),
            ));
        }
        (step.slope + step.curvature).is_finite().then_some(step)
    }

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
    pub(super) fn solve<const N: usize>(
        &self,
        iterate: &mut Iterate,
        control: Control,
        history: &mut Vec<Iteration>,
    ) -> Result<(), Failure>
    where
        M: Controlled<N>,
    {
        let mut chain = Chain::with_right_sides(4 * self.sizes.dof, 0, self.blocks.len(), 0, SIDES);
        let mut evaluation = self.evaluate(iterate);
        let mut weights: Vec<DVector<f64>> = Vec::new();
        let mut past: Vec<Evaluation> = Vec::new();
        let mut last = f64::INFINITY;
        loop {
            let condensed = self.linearise(iterate)?;
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
                    return Ok(());
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
            outcome?;
        }
    }

    /// Takes a part of a step with which the merit falls; the part, and what is then.
    fn shortened<const N: usize>(
        &self,
        iterate: &mut Iterate,
        step: &Step,
        (now, past): (&Evaluation, &[Evaluation]),
        weights: &[DVector<f64>],
        (correction, shortest): (f64, f64),
    ) -> Option<(f64, Evaluation)>
    where
        M: Controlled<N>,
    {
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

/// Units of the state in which the inputs reach about one; those of the costate are their reciprocals, times one of the cost. Powers of two, so that nothing is rounded. Without them a problem
/// of heavy bodies, or of weak inputs, would look like one whose inputs move nothing.
fn units(links: &[Link], n: usize) -> DVector<f64> {
    DVector::from_fn(n, |at, _| {
        let reached: f64 = links.iter().map(|link| link.g[(at, at)].abs()).sum();
        let exponent = 0.5 * reached.log2();
        if exponent.is_finite() {
            exponent.round().exp2()
        } else {
            1.0
        }
    })
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
