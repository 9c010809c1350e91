//! Second-order test of a stationary point: searches for directions of negative curvature (theory.md, (T-163)).
//!
//! A backward sweep (Riccati recursion) from the end examines, in each element, the inputs of that element at fixed
//! start, with optimal feedback by the later inputs. A direction of negative curvature is corrected to satisfy the
//! prescribed components of the end, and then judged by its own second derivative.

use super::condensed::Condensed;
use super::problem::{Iterate, Problem};
use nalgebra::{DMatrix, DVector, Dyn, LU, SymmetricEigen};

/// The penalty for missing the prescribed end by the reach of the inputs at unit cost. It influences which directions
/// are examined, but not their curvature.
const MISS: f64 = 1e8;

/// The number of corrections to the prescribed end; the second one removes the rounding errors of the first.
const PASSES: usize = 2;

/// A direction of negative curvature that satisfies the linearised equations and keeps the prescribed components of the
/// ends.
pub(super) struct Descent {
    pub(super) change: Iterate,
    /// The curvature δwᵀ H δw.
    pub(super) curvature: f64,
    /// The element in which the change begins.
    pub(super) element: usize,
}

/// The nodes and the inputs of a direction.
struct Motion {
    nodes: Vec<DVector<f64>>,
    steering: Vec<DVector<f64>>,
}

impl Motion {
    /// δw of a block.
    fn outer(&self, block: usize) -> DVector<f64> {
        let inputs = self.steering.get(block).map(DVector::as_slice);
        stacked(&self.nodes[block], inputs.unwrap_or(&[]))
    }
}

/// A direction of negative curvature.
struct Candidate {
    motion: Motion,
    element: usize,
    curvature: f64,
    /// The curvature relative to the sizes of its summands.
    share: f64,
}

/// The least-norm correction that satisfies the prescribed components of the end, by the inputs and the free components
/// of the start.
struct Closing {
    given: Vec<usize>,
    /// The changes of the start and of the inputs for one unit of each component.
    start: DMatrix<f64>,
    inputs: Vec<DMatrix<f64>>,
    factors: LU<f64, Dyn, Dyn>,
}

/// The quadratic problem at a stationary point.
struct Neighbourhood<'a> {
    problem: &'a Problem<'a>,
    condensed: &'a [Condensed],
    /// The matrix H of each block.
    second: Vec<DMatrix<f64>>,
    /// The reach of the inputs of all elements at unit cost, for each component of the state.
    units: DVector<f64>,
    /// The feedback matrices K: the optimal inputs are −K δy.
    feedback: Vec<DMatrix<f64>>,
    closing: Option<Closing>,
}

impl Problem<'_> {
    /// The direction of most negative curvature, relative to the sizes of its summands; `None` at a minimum.
    ///
    /// `flat` is the relative curvature below which a direction counts as flat.
    pub(super) fn descent(&self, condensed: &[Condensed], flat: f64) -> Option<Descent> {
        let mut neighbourhood = Neighbourhood::new(self, condensed);
        let lowest = neighbourhood.lowest(flat)?;
        Some(Descent {
            curvature: lowest.curvature,
            element: lowest.element,
            change: neighbourhood.change(lowest.motion),
        })
    }
}

impl<'a> Neighbourhood<'a> {
    fn new(problem: &'a Problem<'a>, condensed: &'a [Condensed]) -> Self {
        let (n, c) = (2 * problem.sizes.dof, problem.sizes.steering());
        let elements = problem.blocks.len();
        let scale = problem.scale(condensed);
        let metrics: Vec<Vec<f64>> = (0..elements)
            .map(|element| problem.metric(element, scale).map(|(_, m)| m).collect())
            .collect();
        let mut squares = DVector::<f64>::zeros(n);
        for (one, metric) in condensed.iter().zip(&metrics) {
            for (k, weight) in metric.iter().enumerate() {
                for at in 0..n {
                    squares[at] += one.ends[(at, n + k)].powi(2) / weight;
                }
            }
        }
        let units = squares.map(|square| {
            let unit = square.sqrt();
            if unit > 0.0 && unit.is_finite() {
                unit
            } else {
                1.0
            }
        });
        let second = condensed
            .iter()
            .map(|one| one.quadratic(&one.hessian(1.0)).matrix);
        Self {
            second: second.collect(),
            feedback: vec![DMatrix::zeros(c, n); elements],
            closing: Closing::new(problem, condensed, &metrics, &units),
            problem,
            condensed,
            units,
        }
    }

    /// The second derivative of the cost of the end, including the penalty for missing it.
    fn at_end(&self) -> DMatrix<f64> {
        let n = self.units.len();
        let end = self.second.get(self.problem.blocks.len());
        let mut worth = end.cloned().unwrap_or_else(|| DMatrix::zeros(n, n));
        for (at, given) in self.problem.ends.last.iter().enumerate() {
            if *given {
                worth[(at, at)] += MISS / self.units[at].powi(2);
            }
        }
        worth
    }

    /// The direction of most negative curvature.
    fn lowest(&mut self, flat: f64) -> Option<Candidate> {
        let n = self.units.len();
        let mut lowest: Option<Candidate> = None;
        let mut worth = self.at_end();
        for element in (0..self.problem.blocks.len()).rev() {
            let one = &self.condensed[element];
            let reached = &one.ends;
            let c = reached.ncols() - n;
            let total = &self.second[element] + reached.tr_mul(&(&worth * reached));
            // Each input is scaled by the sizes of the summands of its diagonal entry.
            let by_inputs = reached.columns(n, c).abs();
            let sizes = self.second[element].view((n, n), (c, c)).abs()
                + by_inputs.tr_mul(&(worth.abs() * &by_inputs));
            let units = DVector::from_fn(c, |k, _| {
                let size: f64 = sizes[(k, k)];
                if size > 0.0 { size.sqrt().recip() } else { 1.0 }
            });
            let scaled = |matrix: &DMatrix<f64>| {
                matrix.map_with_location(|i, j, entry| units[i] * entry * units[j])
            };
            let own = scaled(&symmetric(&total.view((n, n), (c, c)).into_owned()));
            let terms = (one.linear.jacobian.ncols() + 2 * n) as f64;
            let rounding = terms * f64::EPSILON * scaled(&sizes).amax();
            let Some((pivots, vectors)) = eigen(own) else {
                return lowest;
            };
            if let Some((at, pivot)) = smallest(&pivots)
                && pivot < -rounding
            {
                let push = units.component_mul(&vectors.column(at));
                let motion = self.motion(element, DVector::zeros(n), Some(&push));
                lowest = self.lower(lowest, motion, element, flat);
            }
            // Inputs without significant curvature are left unchanged by the feedback.
            let coupling = total.view((n, 0), (c, n)).into_owned();
            let mut feedback = DMatrix::<f64>::zeros(c, n);
            for (pivot, vector) in pivots.iter().zip(vectors.column_iter()) {
                if *pivot > rounding {
                    let inputs = units.component_mul(&vector);
                    let answer = inputs.tr_mul(&coupling) / *pivot;
                    feedback += &inputs * answer;
                }
            }
            let mut answer = DMatrix::<f64>::zeros(n + c, n);
            answer.view_mut((0, 0), (n, n)).fill_with_identity();
            answer.view_mut((n, 0), (c, n)).copy_from(&-&feedback);
            let carried = reached * &answer;
            let further = answer.tr_mul(&(&self.second[element] * &answer))
                + carried.tr_mul(&(&worth * &carried));
            worth = symmetric(&further);
            self.feedback[element] = feedback;
        }
        self.beside_start(lowest, &worth, flat)
    }

    /// Also examines the free components of the start.
    fn beside_start(
        &self,
        lowest: Option<Candidate>,
        worth: &DMatrix<f64>,
        flat: f64,
    ) -> Option<Candidate> {
        let n = self.units.len();
        let free: Vec<usize> = (0..n).filter(|at| !self.problem.ends.first[*at]).collect();
        let own = DMatrix::from_fn(free.len(), free.len(), |i, j| {
            self.units[free[i]] * worth[(free[i], free[j])] * self.units[free[j]]
        });
        let rounding = n as f64 * f64::EPSILON * own.amax();
        if let Some((pivots, vectors)) = eigen(own)
            && let Some((column, pivot)) = smallest(&pivots)
            && pivot < -rounding
        {
            let mut start = DVector::<f64>::zeros(n);
            for (k, at) in free.iter().enumerate() {
                start[*at] = self.units[*at] * vectors[(k, column)];
            }
            let motion = self.motion(0, start, None);
            return self.lower(lowest, motion, 0, flat);
        }
        lowest
    }

    /// The direction that begins at a node: `push` is applied in the first element, and feedback in all others.
    fn motion(&self, first: usize, start: DVector<f64>, push: Option<&DVector<f64>>) -> Motion {
        let (n, c) = (self.units.len(), self.problem.sizes.steering());
        let mut motion = Motion {
            nodes: vec![DVector::zeros(n); first],
            steering: vec![DVector::zeros(c); first],
        };
        let mut node = start;
        for element in first..self.problem.blocks.len() {
            let inputs = match push {
                Some(push) if element == first => push.clone(),
                _ => -(&self.feedback[element] * &node),
            };
            let next = &self.condensed[element].ends * stacked(&node, inputs.as_slice());
            motion.nodes.push(node);
            motion.steering.push(inputs);
            node = next;
        }
        motion.nodes.push(node);
        motion
    }

    /// The more negative one of two directions, the second of which is still to be judged.
    fn lower(
        &self,
        lowest: Option<Candidate>,
        motion: Motion,
        element: usize,
        flat: f64,
    ) -> Option<Candidate> {
        let found = self.judged(motion, element, flat);
        match (lowest, found) {
            (Some(lowest), Some(found)) if found.share < lowest.share => Some(found),
            (lowest, found) => lowest.or(found),
        }
    }

    /// Corrects a direction at the ends, and returns it if its curvature is negative.
    fn judged(&self, mut motion: Motion, element: usize, flat: f64) -> Option<Candidate> {
        if let Some(closing) = &self.closing {
            closing.close(&mut motion, self.condensed, &self.units)?;
            let sizes = motion
                .nodes
                .iter()
                .map(|node| node.component_div(&self.units).amax());
            let largest = sizes.fold(0.0, f64::max);
            let missed = closing.missed(&motion, &self.units).amax();
            if !(missed <= flat * largest) {
                return None;
            }
        }
        let (mut curvature, mut sizes) = (0.0_f64, 0.0_f64);
        for (block, second) in self.second.iter().enumerate() {
            let outer = motion.outer(block);
            curvature += outer.dot(&(second * &outer));
            let outer = outer.abs();
            sizes += outer.dot(&(second.abs() * &outer));
        }
        let share = curvature / sizes;
        (share < -flat).then_some(Candidate {
            motion,
            element,
            curvature,
            share,
        })
    }

    /// The change of all unknowns in a direction; multipliers stay.
    fn change(&self, motion: Motion) -> Iterate {
        let n = self.units.len();
        let (mut interiors, mut multipliers) = (Vec::new(), Vec::new());
        for (block, one) in self.condensed.iter().enumerate() {
            let outer = motion.outer(block);
            let all = one.along(&outer);
            let interior = all.rows(0, all.len() - outer.len()).into_owned();
            multipliers.push(DVector::zeros(interior.len()));
            interiors.push(interior);
        }
        Iterate {
            interiors,
            multipliers,
            costates: vec![DVector::zeros(n); motion.nodes.len()],
            nodes: motion.nodes,
            steering: motion.steering,
        }
    }
}

impl Closing {
    /// `None` if no component of the end is prescribed.
    fn new(
        problem: &Problem<'_>,
        condensed: &[Condensed],
        metrics: &[Vec<f64>],
        units: &DVector<f64>,
    ) -> Option<Self> {
        let (n, c) = (2 * problem.sizes.dof, problem.sizes.steering());
        let given: Vec<usize> = (0..n).filter(|at| problem.ends.last[*at]).collect();
        if given.is_empty() {
            return None;
        }
        let mut reach = DMatrix::from_fn(given.len(), n, |row, at| {
            if at == given[row] {
                units[at].recip()
            } else {
                0.0
            }
        });
        let mut gram = DMatrix::<f64>::zeros(given.len(), given.len());
        let mut inputs = vec![DMatrix::<f64>::zeros(c, given.len()); metrics.len()];
        for (element, metric) in metrics.iter().enumerate().rev() {
            let ends = &condensed[element].ends;
            let by_inputs = &reach * ends.columns(n, c);
            inputs[element] =
                DMatrix::from_fn(c, given.len(), |k, row| by_inputs[(row, k)] / metric[k]);
            gram += &by_inputs * &inputs[element];
            reach = &reach * ends.columns(0, n);
        }
        let start = DMatrix::from_fn(n, given.len(), |at, row| {
            if problem.ends.first[at] {
                0.0
            } else {
                reach[(row, at)] * units[at].powi(2)
            }
        });
        gram += &reach * &start;
        Some(Self {
            given,
            start,
            inputs,
            factors: gram.lu(),
        })
    }

    /// The deviation from the prescribed end, in units of the reach of the inputs.
    fn missed(&self, motion: &Motion, units: &DVector<f64>) -> DVector<f64> {
        let last = &motion.nodes[self.inputs.len()];
        DVector::from_fn(self.given.len(), |row, _| {
            let at = self.given[row];
            last[at] / units[at]
        })
    }

    /// Corrects a direction to satisfy the prescribed end; `None` if the inputs cannot reach it.
    fn close(
        &self,
        motion: &mut Motion,
        condensed: &[Condensed],
        units: &DVector<f64>,
    ) -> Option<()> {
        for _ in 0..PASSES {
            let parts = self.factors.solve(&-self.missed(motion, units))?;
            let mut node = &self.start * &parts;
            for (element, inputs) in self.inputs.iter().enumerate() {
                let inputs = inputs * &parts;
                let next = &condensed[element].ends * stacked(&node, inputs.as_slice());
                motion.nodes[element] += &node;
                motion.steering[element] += inputs;
                node = next;
            }
            motion.nodes[self.inputs.len()] += node;
        }
        Some(())
    }
}

/// The vector δw of an element.
fn stacked(node: &DVector<f64>, inputs: &[f64]) -> DVector<f64> {
    DVector::from_vec([node.as_slice(), inputs].concat())
}

/// The symmetric part of a matrix.
fn symmetric(matrix: &DMatrix<f64>) -> DMatrix<f64> {
    (matrix + matrix.transpose()) * 0.5
}

/// Eigenvalues and eigenvectors of a symmetric matrix; `None` if it is not finite.
fn eigen(matrix: DMatrix<f64>) -> Option<(DVector<f64>, DMatrix<f64>)> {
    if matrix.nrows() == 0 {
        return Some((DVector::zeros(0), matrix));
    }
    if !matrix.iter().all(|entry| entry.is_finite()) {
        return None;
    }
    let most = 100 * (matrix.nrows() + 10);
    let eigen = SymmetricEigen::try_new(matrix, f64::EPSILON, most)?;
    Some((eigen.eigenvalues, eigen.eigenvectors))
}

/// The smallest number and its index.
fn smallest(values: &DVector<f64>) -> Option<(usize, f64)> {
    let values = values.iter().copied().enumerate();
    values.min_by(|(_, a), (_, b)| a.total_cmp(b))
}
