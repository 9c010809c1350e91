//! What is to be minimised: blocks of equations that nodes join to a chain, and their numbers at an iterate.

use super::block::{Block, PointFunctions, Values};
use super::condensed::Condensed;
use super::transcription::Sizes;
use nalgebra::DVector;

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
    /// Adds a part of a change.
    pub(super) fn add(&mut self, factor: f64, step: &Self) {
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
pub(super) struct Problem<'a> {
    pub(super) model: &'a dyn PointFunctions,
    pub(super) sizes: Sizes,
    /// One for each element.
    pub(super) blocks: Vec<Block>,
    /// What the end costs.
    pub(super) end: Option<Block>,
    /// Lengths of the elements.
    pub(super) lengths: Vec<f64>,
    pub(super) ends: Ends,
}

/// Cost and residuals of all blocks.
pub(super) struct Evaluation {
    pub(super) cost: f64,
    pub(super) rows: Vec<DVector<f64>>,
}

impl Evaluation {
    /// The cost, with what violated equations count.
    pub(super) fn merit(&self, weights: &[DVector<f64>]) -> f64 {
        self.cost + self.violation(weights)
    }

    /// What violated equations count alone.
    pub(super) fn violation(&self, weights: &[DVector<f64>]) -> f64 {
        let blocks = self.rows.iter().zip(weights);
        blocks.map(|(rows, weights)| rows.abs().dot(weights)).sum()
    }
}

impl Problem<'_> {
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

    /// Cost and residuals of an iterate.
    pub(super) fn evaluate(&self, iterate: &Iterate) -> Evaluation {
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
    pub(super) fn cost(&self, iterate: &Iterate) -> f64 {
        self.evaluate(iterate).cost
    }

    /// The multipliers of the rows of a block: interior, then end.
    fn multipliers(&self, iterate: &Iterate, block: usize) -> DVector<f64> {
        let inner = iterate.multipliers[block].as_slice();
        let end = match block < self.blocks.len() {
            true => iterate.costates[block + 1].as_slice(),
            false => &[],
        };
        DVector::from_vec([inner, end].concat())
    }

    /// 𝓛: the cost of an iterate and its residuals, weighed with its multipliers (theory.md, (T-145)).
    pub(super) fn lagrangian(&self, evaluation: &Evaluation, iterate: &Iterate) -> f64 {
        let blocks = evaluation.rows.iter().enumerate();
        let rows = blocks.map(|(at, rows)| rows.dot(&self.multipliers(iterate, at)));
        evaluation.cost + rows.sum::<f64>()
    }

    /// All blocks about an iterate; the number of one that has no linearisation.
    pub(super) fn linearise(&self, iterate: &Iterate) -> Result<Vec<Condensed>, usize> {
        let blocks = self.blocks().enumerate().map(|(at, block)| {
            let multipliers = self.multipliers(iterate, at);
            let linear = block.linearise(self.model, &self.variables(iterate, at), &multipliers);
            Condensed::new(block, linear).ok_or(at)
        });
        blocks.collect()
    }
}
