//! The nonlinear program: blocks of equations that nodes connect to a chain, and their values at an iterate.

use super::block::{Block, PointFunctions, Values};
use super::condensed::Condensed;
use super::transcription::Sizes;
use nalgebra::DVector;

/// The unknowns and multipliers, or a change of them.
#[derive(Clone, Debug)]
pub(super) struct Iterate {
    /// The states (p, q) of the nodes.
    pub(super) nodes: Vec<DVector<f64>>,
    /// The interior variables of the elements, then those of the block of the end.
    pub(super) interiors: Vec<DVector<f64>>,
    /// The coefficients of the inputs.
    pub(super) steering: Vec<DVector<f64>>,
    /// The multipliers of the rows of the interiors.
    pub(super) multipliers: Vec<DVector<f64>>,
    /// The costates λ: the derivatives of the cost by changes of the nodes.
    pub(super) costates: Vec<DVector<f64>>,
}

impl Iterate {
    /// Adds a fraction of a change.
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

/// The prescribed components at the ends of the chain.
#[derive(Clone, Debug)]
pub(super) struct Ends {
    /// Whether each component (p, q) of the first node is prescribed.
    pub(super) first: Vec<bool>,
    /// Whether each component of the last node is prescribed.
    pub(super) last: Vec<bool>,
}

/// An optimal control problem after transcription.
pub(super) struct Problem<'a> {
    pub(super) model: &'a dyn PointFunctions,
    pub(super) sizes: Sizes,
    /// The blocks of the elements.
    pub(super) blocks: Vec<Block>,
    /// The block of the cost of the end.
    pub(super) end: Option<Block>,
    /// The lengths of the elements.
    pub(super) lengths: Vec<f64>,
    pub(super) ends: Ends,
}

/// The cost and the residuals of all blocks.
pub(super) struct Evaluation {
    pub(super) cost: f64,
    pub(super) rows: Vec<DVector<f64>>,
}

impl Evaluation {
    /// The merit function: the cost plus weighted violations of the equations.
    pub(super) fn merit(&self, weights: &[DVector<f64>]) -> f64 {
        self.cost + self.violation(weights)
    }

    /// The weighted violations of the equations.
    pub(super) fn violation(&self, weights: &[DVector<f64>]) -> f64 {
        let blocks = self.rows.iter().zip(weights);
        blocks.map(|(rows, weights)| rows.abs().dot(weights)).sum()
    }
}

impl Problem<'_> {
    fn blocks(&self) -> impl Iterator<Item = &Block> {
        self.blocks.iter().chain(&self.end)
    }

    /// The variables s of a block.
    pub(super) fn variables(&self, iterate: &Iterate, block: usize) -> DVector<f64> {
        let steering = iterate.steering.get(block).map(DVector::as_slice);
        let parts = [
            iterate.interiors[block].as_slice(),
            iterate.nodes[block].as_slice(),
            steering.unwrap_or(&[]),
        ];
        DVector::from_vec(parts.concat())
    }

    /// The residuals of a block; the last ones are the gaps to the next node.
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

    /// The Lagrangian 𝓛: the cost plus the residuals weighted by the multipliers (theory.md, (T-145)).
    pub(super) fn lagrangian(&self, evaluation: &Evaluation, iterate: &Iterate) -> f64 {
        let blocks = evaluation.rows.iter().enumerate();
        let rows = blocks.map(|(at, rows)| rows.dot(&self.multipliers(iterate, at)));
        evaluation.cost + rows.sum::<f64>()
    }

    /// Linearises and condenses all blocks at an iterate; the error is the index of a block for which this fails.
    pub(super) fn linearise(&self, iterate: &Iterate) -> Result<Vec<Condensed>, usize> {
        let blocks = self.blocks().enumerate().map(|(at, block)| {
            let multipliers = self.multipliers(iterate, at);
            let linear = block.linearise(self.model, &self.variables(iterate, at), &multipliers);
            Condensed::new(block, linear).ok_or(at)
        });
        blocks.collect()
    }
}
