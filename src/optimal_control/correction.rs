//! The SQP correction of an iterate: the minimum of a quadratic model of the Lagrangian under the linearised equations.
//!
//! After condensation of interior variables and elimination of inputs it is a chain in (δy_e, λ_e), which `assembly`
//! solves by structured orthogonal elimination (theory.md, (T-144) to (T-148)).

use super::condensed::{Condensed, Quadratic};
use super::problem::{Iterate, Problem};
use super::transcription::Sizes;
use crate::assembly::Chain;
use nalgebra::{DMatrix, DVector};

/// The solution of a quadratic model.
pub(super) struct Step {
    pub(super) change: Iterate,
    /// The new multipliers of all rows, block by block: interior, then end.
    pub(super) rows: Vec<DVector<f64>>,
    /// The first derivative of the cost along the step.
    pub(super) slope: f64,
    /// The second derivative of the model along the part of the step that closes no gaps.
    pub(super) curvature: f64,
    /// The part of this second derivative that comes from the cost.
    pub(super) of_cost: f64,
}

/// An element whose inputs are eliminated: δy₊ = A δy − G λ₊ + r and λ = Q δy + Aᵀ λ₊ + g. There are two g and r: for
/// the whole step, and for its part that closes no gaps.
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

/// The right sides of the chain: the whole step, and the part of it that closes no gaps.
const SIDES: usize = 2;
const WHOLE: usize = 0;
const ALONG: usize = 1;

impl Problem<'_> {
    /// Creates the chain of the quadratic model.
    pub(super) fn chain(&self) -> Chain {
        Chain::with_right_sides(4 * self.sizes.dof, 0, self.blocks.len(), 0, SIDES)
    }

    /// The weights of changes of the inputs of an element: ∫ P_k² dt.
    pub(super) fn metric(&self, element: usize, weight: f64) -> impl Iterator<Item = (usize, f64)> {
        let Sizes { inputs, .. } = self.sizes;
        let h = self.lengths[element].abs();
        let first = self.sizes.interior + 2 * self.sizes.dof;
        (0..self.sizes.steering()).map(move |at| {
            let degree = at / inputs;
            (first + at, weight * h / (2 * degree + 1) as f64)
        })
    }

    /// The largest second derivative of the cost by an input, in the metric of the inputs.
    pub(super) fn scale(&self, condensed: &[Condensed]) -> f64 {
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

    /// The minimum of the quadratic model with a fraction of the curvature of the equations.
    pub(super) fn step(
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
        // The unknowns of the chain are y divided by its unit and λ multiplied by it: rows are scaled by the
        // reciprocals of the column scales.
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
            // Matrices of nalgebra are column-major.
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

    /// The conditions at both ends: a component is prescribed, or its costate is the derivative of the cost of the end.
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

    /// All unknowns of the step, from the nodes of the chain.
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
}

/// Units of the state in which the effect of the inputs is about one; those of the costate are their reciprocals times
/// a unit of the cost. They are powers of two, which cause no rounding. Without them, heavy bodies or weak inputs would
/// look like inputs without effect.
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
