//! Newton's method on assembled elements.
//!
//! The unknowns are the states of all nodes, the interior rates of all elements, and a few global unknowns γ, such as a
//! period. In each iteration every element is linearised and its interior unknowns are condensed,
//!
//! ```text
//! δy_{e+1} − A_e δy_e − C_e δγ = Y_e − y_{e+1}                                                     (theory.md, T-81)
//! ```
//!
//! with Y_e the end of the element after its own Newton step. The [`Problem`] supplies the equations that close the
//! chain.

use super::chain::{Chain, ClosureMut, DenseMut};
use super::constraints;
use super::control::Control;
use super::convergence::{Convergence, Size, sizes};
use super::error::AssemblyError;
use crate::numbers::larger;
use tfe_runtime::condenser::{Condensed, Condenser, Direction, Placed};
use tfe_runtime::{Element, ElementError, LegendreError, Model, State, Statistics};

/// A quantity by which a solution is differentiated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum By {
    /// A parameter of the model, by its index among all.
    Parameter(usize),
    /// The prescribed value of an equation at the ends, by its row.
    Row(usize),
    /// The length of the span, if it is prescribed.
    Length,
}

/// A problem: elements in time, and the equations that close their chain.
pub(crate) trait Problem<const N: usize> {
    /// The type of the model.
    type Model: Model<N>;
    /// The model at the current globals.
    fn model(&self) -> &Self::Model;
    /// Start time and length of an element at the current globals.
    fn place(&self, element: usize) -> (f64, f64);
    /// γ of an additional force γ v, at the current globals.
    fn damping(&self) -> f64 {
        0.0
    }
    /// The derivative of an element by each global.
    fn directions(&self, element: usize, directions: &mut [Direction]);
    /// The derivative of an element by the length of the span.
    fn stretched(&self, _element: usize) -> Direction {
        Direction::default()
    }
    /// The scale relative to which corrections of a global are measured.
    fn scale(&self, _global: usize) -> f64 {
        1.0
    }
    /// Sets the globals.
    fn set_globals(&mut self, globals: &[f64]);
    /// The equations at the ends: B₀ δy₀ + B_E δy_E + B_γ δγ = b.
    fn close(&self, iterate: &Iterate<N>, closure: ClosureMut<'_>) -> Result<(), LegendreError>;
    /// The derivative of the right side of the equations at the ends by a parameter, given by its index among all.
    fn close_by(&self, _: usize, _: &Iterate<N>, _: &mut [f64]) -> Result<(), LegendreError> {
        Ok(())
    }
    /// The k-th equation over all nodes.
    fn span(&self, _k: usize, _iterate: &Iterate<N>, _dense: DenseMut<'_>) {}
}

/// The unknowns of an assembled problem.
#[derive(Clone, Debug)]
pub(crate) struct Iterate<const N: usize> {
    /// The states of the nodes.
    pub(crate) nodes: Vec<State<N>>,
    /// The interior rates of the elements, concatenated.
    pub(crate) interiors: Vec<f64>,
    /// The global unknowns.
    pub(crate) globals: Vec<f64>,
}

impl<const N: usize> Iterate<N> {
    /// Multiplies all unknowns by a factor.
    pub(crate) fn scale(&mut self, factor: f64) {
        for node in &mut self.nodes {
            node.q = node.q.map(|q| factor * q);
            node.p = node.p.map(|p| factor * p);
        }
        for value in self.interiors.iter_mut().chain(&mut self.globals) {
            *value *= factor;
        }
    }

    /// The sum of this and `factor` times another.
    #[must_use]
    pub(crate) fn plus(&self, factor: f64, other: &Self) -> Self {
        let mut sum = self.clone();
        for (node, change) in sum.nodes.iter_mut().zip(&other.nodes) {
            for a in 0..N {
                node.q[a] += factor * change.q[a];
                node.p[a] += factor * change.p[a];
            }
        }
        let values = sum.interiors.iter_mut().chain(&mut sum.globals);
        let changes = other.interiors.iter().chain(&other.globals);
        for (value, change) in values.zip(changes) {
            *value += factor * change;
        }
        sum
    }
}

/// The workspace of the iteration: the linearised elements and the chain that they form.
#[derive(Debug)]
pub(crate) struct Assembly<const N: usize> {
    condenser: Condenser<N>,
    chain: Chain,
    /// [A | C | end] of each element, row by row; the columns of C are the globals, then the further directions.
    ends: Vec<f64>,
    responses: Vec<f64>,
    directions: Vec<Direction>,
    globals: usize,
    /// The index of the length of the span among the further directions.
    length: Option<usize>,
    elements: usize,
    dense: usize,
    /// The number of linearisations, of all solutions together.
    iterations: u32,
    /// The same before the current solution.
    before: u32,
}

impl<const N: usize> Assembly<N> {
    /// A workspace for a number of elements, of global unknowns, and of equations over all nodes.
    pub(crate) fn new<M: Model<N>>(
        element: Element,
        elements: usize,
        globals: usize,
        dense: usize,
    ) -> Result<Self, ElementError> {
        Self::by::<M>(element, elements, (globals, dense), (&[], None, 1))
    }

    /// The same with further directions, one of which may be the length of the span, and with a number of right sides.
    pub(super) fn by<M: Model<N>>(
        element: Element,
        elements: usize,
        (globals, dense): (usize, usize),
        (more, length, sides): (&[Direction], Option<usize>, usize),
    ) -> Result<Self, ElementError> {
        let condenser = Condenser::new::<M>(element)?;
        let mut directions = vec![Direction::default(); globals];
        directions.extend_from_slice(more);
        let columns = 2 * N + directions.len() + 1;
        let interior = condenser.interior();
        Ok(Self {
            chain: Chain::with_right_sides(2 * N, globals, elements, dense, sides),
            ends: vec![0.0; elements * 2 * N * columns],
            responses: vec![0.0; elements * interior * columns],
            directions,
            globals,
            length,
            condenser,
            elements,
            dense,
            iterations: 0,
            before: 0,
        })
    }

    /// Makes each linearisation also compute the tangent: the derivative of the solution by the right side of the last
    /// equation over all nodes.
    #[must_use]
    pub(crate) fn with_tangent(mut self) -> Self {
        let (globals, dense) = (self.globals, self.dense);
        self.chain = Chain::with_right_sides(2 * N, globals, self.elements, dense, 2);
        if let Some(right) = self.chain.right_side_mut(1).dense.last_mut() {
            *right = 1.0;
        }
        self
    }

    /// The tangent at the last linearisation; see [`with_tangent`](Self::with_tangent).
    pub(crate) fn tangent(&self) -> Iterate<N> {
        self.change(1)
    }

    /// The solution for one of the right sides.
    fn change(&self, side: usize) -> Iterate<N> {
        let (m, columns) = (self.condenser.interior(), self.columns());
        let globals = self.chain.globals_of(side);
        let mut interiors = vec![0.0; self.elements * m];
        let mut weights = Vec::with_capacity(columns);
        for element in 0..self.elements {
            let response = &self.responses[element * m * columns..(element + 1) * m * columns];
            let interior = &mut interiors[element * m..(element + 1) * m];
            weights.clear();
            weights.extend_from_slice(self.chain.node_of(side, element));
            weights.extend_from_slice(globals);
            for (x, row) in interior.iter_mut().zip(response.chunks_exact(columns)) {
                *x = inner(row, &weights);
            }
        }
        let nodes = (0..=self.elements).map(|e| {
            let (p, q) = self.chain.node_of(side, e).split_at(N);
            State {
                q: std::array::from_fn(|a| q[a]),
                p: std::array::from_fn(|a| p[a]),
            }
        });
        Iterate {
            nodes: nodes.collect(),
            interiors,
            globals: globals.to_vec(),
        }
    }

    /// The derivatives of the solution by several quantities, one right side each, after the last
    /// [linearisation](Self::link). Each quantity comes with the index of its further direction, if elements depend on
    /// it.
    pub(super) fn changes<P: Problem<N>>(
        &mut self,
        problem: &P,
        iterate: &Iterate<N>,
        by: &[(By, Option<usize>)],
    ) -> Result<Vec<Iterate<N>>, AssemblyError> {
        let columns = self.columns();
        for (side, (by, place)) in by.iter().enumerate() {
            let right = self.chain.right_side_mut(side);
            let column = place.map(|place| 2 * N + self.globals + place);
            for (right, end) in right.links.iter_mut().zip(self.ends.chunks_exact(columns)) {
                *right = column.map_or(0.0, |column| end[column]);
            }
            right.closure.fill(0.0);
            right.dense.fill(0.0);
            match by {
                By::Parameter(index) => problem.close_by(*index, iterate, &mut right.closure)?,
                By::Row(row) => right.closure[*row] = 1.0,
                By::Length => {}
            }
        }
        self.solve_chain()?;
        let change = |(side, (_, place)): (usize, &(By, Option<usize>))| {
            let mut change = self.change(side);
            if let Some(place) = place {
                let rows = self.responses.chunks_exact(columns);
                for (x, row) in change.interiors.iter_mut().zip(rows) {
                    *x += row[2 * N + self.globals + place];
                }
            }
            change
        };
        Ok(by.iter().enumerate().map(change).collect())
    }

    /// The number of columns of an element: its start, the globals and the further directions, its end.
    fn columns(&self) -> usize {
        2 * N + self.directions.len() + 1
    }

    /// Iterations so far.
    pub(crate) fn iterations(&self) -> u32 {
        self.iterations
    }

    /// Begins another solution.
    fn begin(&mut self) {
        self.before = self.iterations;
    }

    /// The number of corrections of this solution before the last linearisation, which is what a limit of iterations
    /// counts.
    pub(super) fn corrections(&self) -> u32 {
        self.iterations.saturating_sub(self.before + 1)
    }

    /// The work of the iterations.
    pub(crate) fn statistics(&self) -> Statistics {
        let mut statistics = *self.condenser.statistics();
        statistics.newton_iterations = u64::from(self.iterations);
        statistics.iterations = u64::from(self.iterations);
        statistics
    }

    /// The sign of the determinant of the last system.
    pub(crate) fn sign(&self) -> f64 {
        self.chain.sign()
    }

    /// The transition matrices A_e of the last linearisation, concatenated, row by row.
    pub(crate) fn transitions(&self) -> &[f64] {
        self.chain.matrices()
    }

    /// The iterate that follows a curve t ↦ (q, dq/dt).
    pub(crate) fn along<P: Problem<N>>(
        &self,
        problem: &P,
        mut curve: impl FnMut(f64) -> ([f64; N], [f64; N]),
        globals: Vec<f64>,
    ) -> Result<Iterate<N>, LegendreError> {
        let m = self.condenser.interior();
        let mut nodes = Vec::with_capacity(self.elements + 1);
        let mut interiors = vec![0.0; self.elements * m];
        let state = |t: f64, curve: &mut dyn FnMut(f64) -> ([f64; N], [f64; N])| {
            let (q, v) = curve(t);
            tfe_runtime::legendre::state(problem.model(), t, &q, &v)
        };
        for element in 0..self.elements {
            let (t, h) = problem.place(element);
            nodes.push(state(t, &mut curve)?);
            let interior = &mut interiors[element * m..(element + 1) * m];
            self.condenser
                .interpolate(problem.model(), t, h, &mut curve, interior)?;
            if element + 1 == self.elements {
                nodes.push(state(t + h, &mut curve)?);
            }
        }
        Ok(Iterate {
            nodes,
            interiors,
            globals,
        })
    }

    /// Linearises at the iterate and solves; the correction is then in the chain.
    pub(crate) fn linearise<P: Problem<N>>(
        &mut self,
        problem: &P,
        iterate: &Iterate<N>,
    ) -> Result<(), AssemblyError> {
        self.iterations += 1;
        self.link(problem, iterate)?;
        self.solve_chain()
    }

    /// Linearises at the iterate.
    pub(crate) fn link<P: Problem<N>>(
        &mut self,
        problem: &P,
        iterate: &Iterate<N>,
    ) -> Result<(), AssemblyError> {
        let globals = self.globals;
        let (m, columns) = (self.condenser.interior(), self.columns());
        for element in 0..self.elements {
            let (time, length) = problem.place(element);
            let (own, more) = self.directions.split_at_mut(globals);
            problem.directions(element, own);
            if let Some(length) = self.length.and_then(|place| more.get_mut(place)) {
                *length = problem.stretched(element);
            }
            let ends = &mut self.ends[element * 2 * N * columns..(element + 1) * 2 * N * columns];
            let placed = Placed {
                time,
                length,
                start: &iterate.nodes[element],
                interior: &iterate.interiors[element * m..(element + 1) * m],
                damping: problem.damping(),
            };
            let condensed = Condensed {
                ends,
                response: &mut self.responses[element * m * columns..(element + 1) * m * columns],
            };
            self.condenser
                .linearise(problem.model(), placed, &self.directions, condensed)
                .map_err(|source| AssemblyError::Linearise {
                    element,
                    time,
                    source,
                })?;
            let link = self.chain.link_mut(element);
            let next = &iterate.nodes[element + 1];
            for (row, end) in ends.chunks_exact(columns).enumerate() {
                link.matrix[row * 2 * N..(row + 1) * 2 * N].copy_from_slice(&end[..2 * N]);
                link.global[row * globals..(row + 1) * globals]
                    .copy_from_slice(&end[2 * N..2 * N + globals]);
                let reached = if row < N {
                    next.p[row]
                } else {
                    next.q[row - N]
                };
                link.right[row] = end[columns - 1] - reached;
            }
        }
        problem.close(iterate, self.chain.closure_mut())?;
        for k in 0..self.dense {
            problem.span(k, iterate, self.chain.dense_mut(k));
        }
        Ok(())
    }

    fn solve_chain(&mut self) -> Result<(), AssemblyError> {
        let iterations = self.corrections();
        (self.chain.solve()).map_err(|_| AssemblyError::Singular { iterations })
    }

    /// The last linear system.
    pub(super) fn chain(&self) -> &Chain {
        &self.chain
    }

    /// The size of the correction relative to the iterate.
    pub(super) fn size<P: Problem<N>>(&self, problem: &P, iterate: &Iterate<N>) -> Size {
        let nodes = iterate.nodes.iter().enumerate();
        let nodes = nodes.map(|(e, node)| (&node.p[..], &node.q[..], self.chain.node(e)));
        let globals = self.chain.globals().iter().enumerate();
        let globals = globals.map(|(k, correction)| correction / problem.scale(k));
        let size = sizes(nodes, self.chain.matrices(), globals);
        if const { P::Model::CONSTRAINTS.is_empty() } {
            return size;
        }
        // At rest, nodes do not depend on the reactions, but the matrices do.
        size.and(REACTIONS * self.interior_size(iterate))
    }

    /// The largest correction of interior unknowns relative to the largest of them.
    fn interior_size(&self, iterate: &Iterate<N>) -> f64 {
        let mut corrected = iterate.clone();
        self.correct(&mut corrected, 1.0);
        let (mut value, mut change) = (0.0_f64, 0.0_f64);
        for (new, old) in corrected.interiors.iter().zip(&iterate.interiors) {
            value = value.max(new.abs());
            // `f64::max` would ignore a NaN.
            change = larger(change, (new - old).abs());
        }
        if change == 0.0 { 0.0 } else { change / value }
    }

    /// Adds a fraction of the correction to the iterate.
    pub(crate) fn correct(&self, iterate: &mut Iterate<N>, fraction: f64) {
        let globals = self.chain.globals();
        let (m, columns) = (self.condenser.interior(), self.columns());
        let mut weights = Vec::with_capacity(columns);
        for element in 0..self.elements {
            let response = &self.responses[element * m * columns..(element + 1) * m * columns];
            let interior = &mut iterate.interiors[element * m..(element + 1) * m];
            weights.clear();
            weights.extend_from_slice(self.chain.node(element));
            weights.extend_from_slice(globals);
            weights.resize(columns - 1, 0.0);
            weights.push(1.0);
            for (x, row) in interior.iter_mut().zip(response.chunks_exact(columns)) {
                *x += fraction * inner(row, &weights);
            }
        }
        for (e, node) in iterate.nodes.iter_mut().enumerate() {
            let correction = self.chain.node(e);
            for a in 0..N {
                node.p[a] += fraction * correction[a];
                node.q[a] += fraction * correction[N + a];
            }
        }
        for (value, correction) in iterate.globals.iter_mut().zip(globals) {
            *value += fraction * correction;
        }
    }

    /// Iterates to a solution and checks that it satisfies all constraints. Afterwards the linearisation is that at the
    /// solution, up to the tolerance.
    pub(crate) fn solve<P: Problem<N>>(
        &mut self,
        problem: &mut P,
        iterate: &mut Iterate<N>,
        control: Control,
    ) -> Result<(), AssemblyError> {
        self.begin();
        problem.set_globals(&iterate.globals);
        self.linearise(problem, iterate)?;
        let mut convergence = Convergence::new(control, self.size(problem, iterate));
        loop {
            if convergence.is_done() {
                self.correct(iterate, 1.0);
                problem.set_globals(&iterate.globals);
                if const { P::Model::CONSTRAINTS.is_empty() } {
                    return Ok(());
                }
                let times = times(problem, iterate.nodes.len() - 1);
                let nodes = (&times[..], &iterate.nodes[..]);
                return constraints::check(problem.model(), nodes, control.tolerance);
            }
            convergence.go_on()?;
            let before = iterate.clone();
            self.correct(iterate, convergence.fraction());
            problem.set_globals(&iterate.globals);
            let tried = self.linearise(problem, iterate);
            let next = self.size(problem, iterate);
            if convergence.accepts(tried.is_ok(), next) {
                continue;
            }
            if let Err(stalled) = convergence.halve() {
                tried?;
                return Err(stalled);
            }
            *iterate = before;
            problem.set_globals(&iterate.globals);
            self.linearise(problem, iterate)?;
        }
    }
}

/// Σ a b over the shorter length.
fn inner(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// The weight of relative corrections of reactions, which contain the rounding errors of positions divided by h².
const REACTIONS: f64 = 1e-3;

/// The times of all nodes.
fn times<P: Problem<N>, const N: usize>(problem: &P, elements: usize) -> Vec<f64> {
    let start = problem.place(0).0;
    let ends = (0..elements).map(|element| {
        let (start, length) = problem.place(element);
        start + length
    });
    std::iter::once(start).chain(ends).collect()
}

#[cfg(test)]
mod tests {
    use super::{Assembly, Element};
    use crate::stability::LinearModel;

    /// A branch solves one orbit after the other in the same workspace.
    #[test]
    fn corrections_are_those_of_one_solution() {
        let assembly = Assembly::<1>::new::<LinearModel<1>>(Element::mixed(3), 2, 0, 0);
        let mut assembly = assembly.expect("an element");
        assert_eq!(assembly.corrections(), 0);
        for linearisations in [7, 1, 4] {
            assembly.begin();
            assembly.iterations += linearisations;
            assert_eq!(assembly.corrections(), linearisations - 1);
        }
        assert_eq!(assembly.iterations(), 12);
    }
}
