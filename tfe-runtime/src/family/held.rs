//! The contributions of constraints to the derivative of an element of run-time length: by its start, by parameters,
//! and of its adjoint (T-160).

use super::model::Model;
use super::node::Node;
use super::pattern::Pattern;
use super::point;
use super::projection::{Explicit, NodeWeights, Places, Projection};
use super::rows::Rows;
use crate::condense::add_multiple;
use crate::dual::Dual;
use crate::error::StepError;
use crate::scheme::{MAX_RATES, SchemeRef};
use alloc::sync::Arc;
use alloc::vec;
use alloc::vec::Vec;

/// Constraints at a point: A, μ̇, Σ μ̇ φ_qq, and P_j′.
#[derive(Clone, Debug)]
struct Point {
    rows: Vec<f64>,
    mu_rate: Vec<f64>,
    bend: Vec<f64>,
    slopes: [f64; MAX_RATES],
}

/// The constraints of an element at the solution of its equations.
#[derive(Clone, Debug)]
pub(super) struct Held {
    places: Arc<Places>,
    points: Vec<Point>,
    /// At the start: coordinates, h m₀, A, and Σ h m₀ φ_qq.
    start: Vec<f64>,
    first: Vec<f64>,
    start_rows: Vec<f64>,
    start_bend: Vec<f64>,
    end: Projection,
}

/// The parts of a solved step that the constraints need.
pub(super) struct Solved<'a> {
    pub(super) scheme: &'a SchemeRef<'a>,
    /// The sparsity pattern of the second derivatives of the model.
    pub(super) second: &'a Pattern,
    pub(super) t: f64,
    pub(super) h: f64,
    pub(super) points: &'a [point::Point],
    /// The multipliers of each constraint, one for each unknown rate.
    pub(super) multipliers: &'a [f64],
    /// Coordinates at the start.
    pub(super) start: &'a [f64],
    /// The coordinates and velocities at the end, after the solution at the node.
    pub(super) end: (&'a [f64], &'a [f64]),
    /// A at the start, and the rows at the end.
    pub(super) start_rows: &'a [f64],
    pub(super) end_rows: &'a Rows,
    pub(super) node: &'a Node,
}

impl Solved<'_> {
    /// h m₀
    fn first_multipliers(&self) -> Vec<f64> {
        let multipliers = self.multipliers.chunks_exact(self.scheme.unknowns());
        multipliers.map(|own| self.h * own[0]).collect()
    }
}

/// The weights that a row λ of phase space gives to the constraints; multiplied by the derivatives of these by
/// parameters, they are added to the sums.
#[derive(Clone, Debug)]
pub(super) struct Weights {
    /// φ at the points, a row for each.
    pub(super) phi: Vec<f64>,
    /// A₀, and A at the points, a row for each, in the order of the pattern.
    pub(super) start_rows: Vec<f64>,
    pub(super) rows: Vec<f64>,
    /// Coordinates at the start.
    pub(super) start: Vec<f64>,
    pub(super) end: NodeWeights,
}

impl Held {
    /// For the step that was solved last; the rows are those at its end.
    ///
    /// # Errors
    /// [`StepError`] if the matrix of the node is singular.
    pub(super) fn of<M: Model>(
        model: &M,
        places: &Arc<Places>,
        solved: &Solved<'_>,
    ) -> Result<Self, StepError> {
        let point = |(l, point): (usize, &point::Point)| {
            let time = solved.t + solved.h * solved.scheme.nodes[l];
            Point {
                rows: point.rows.clone(),
                mu_rate: point.mu_rate.clone(),
                bend: places.bend(model, (time, &point.q), &point.mu_rate),
                slopes: point.slopes,
            }
        };
        let start = (solved.t, solved.start);
        let end = (solved.t + solved.h, solved.end.0, solved.end.1);
        let node = (solved.node, solved.end_rows);
        let first = solved.first_multipliers();
        Ok(Self {
            points: solved.points.iter().enumerate().map(point).collect(),
            start: solved.start.to_vec(),
            start_rows: solved.start_rows.to_vec(),
            start_bend: places.bend(model, start, &first),
            first,
            end: Projection::of(model, (places, solved.second), end, node)?,
            places: Arc::clone(places),
        })
    }

    /// The direct effect of a change of the times and of a parameter: `moved` gives the time at a fraction of the
    /// element with its derivative, and with the parameter. Changes of the reactions are added to the forces at the
    /// points.
    pub(super) fn explicit<M: Model>(
        &self,
        model: &M,
        moved: &dyn Fn(f64) -> Dual,
        solved: &Solved<'_>,
        end_momentum: Vec<f64>,
        forces: &mut [Vec<f64>],
    ) -> Explicit {
        let at = |part: f64, q: &[f64]| {
            let still: Vec<Dual> = q.iter().map(|q| Dual::new(*q, 0.0)).collect();
            self.places.slopes(model, moved(part), &still)
        };
        let end = at(1.0, solved.end.0);
        let mut explicit = self.end.explicit(&self.places, end, end_momentum);
        for ((l, point), force) in solved.points.iter().enumerate().zip(forces) {
            let slopes = at(solved.scheme.nodes[l], &point.q);
            self.places
                .rows
                .add_transposed(&slopes.rows, -1.0, &point.mu_rate, force);
            explicit.phi.extend(slopes.phi);
        }
        let n = solved.start.len();
        explicit.impulse = vec![0.0; n];
        let start = at(0.0, solved.start);
        self.places
            .rows
            .add_transposed(&start.rows, 1.0, &self.first, &mut explicit.impulse);
        explicit
    }

    /// The effect of the coordinates at the start on the impulse there.
    pub(super) fn impulse_of(&self, q: &[f64]) -> Explicit {
        let mut impulse = vec![0.0; q.len()];
        self.places
            .bends
            .add_product(&self.start_bend, 1.0, q, &mut impulse);
        Explicit::impulse(impulse)
    }

    /// Subtracts from the momentum at the start the change of the impulse there at fixed multipliers.
    pub(super) fn subtract_impulse(&self, explicit: Option<&Explicit>, p: &mut [f64]) {
        if let Some(explicit) = explicit {
            add_multiple(p, -1.0, &explicit.impulse);
        }
    }

    /// Adds the effect of the coordinates at point l on the reactions there.
    pub(super) fn bend(&self, l: usize, q: &[f64], force: &mut [f64]) {
        self.places
            .bends
            .add_product(&self.points[l].bend, -1.0, q, force);
    }

    /// Adds the effect of the multipliers on the forces at point l.
    pub(super) fn add_reactions(&self, l: usize, multipliers: &[f64], force: &mut [f64]) {
        let point = &self.points[l];
        let count = multipliers.len() / self.places.count.max(1);
        let rates = multipliers.chunks_exact(count.max(1)).map(|own| {
            let pairs = own.iter().zip(point.slopes).skip(1);
            pairs.map(|(own, slope)| own * slope).sum()
        });
        let rates: Vec<f64> = rates.collect();
        self.places
            .rows
            .add_transposed(&point.rows, -1.0, &rates, force);
    }

    /// Adds the effect of the multipliers on the initial momentum of the element: h A₀ᵀ m₀.
    pub(super) fn add_first_multipliers(&self, h: f64, multipliers: &[f64], p: &mut [f64]) {
        let count = multipliers.len() / self.places.count.max(1);
        let first = multipliers.chunks_exact(count.max(1)).map(|own| own[0]);
        let first: Vec<f64> = first.collect();
        self.places
            .rows
            .add_transposed(&self.start_rows, -h, &first, p);
    }

    /// Adds the right-hand sides of the equations φ = 0 from the coordinates at point l, and from direct changes of φ.
    pub(super) fn add_constraint_sides(
        &self,
        l: usize,
        q: &[f64],
        explicit: Option<&Explicit>,
        (weight, h): (f64, f64),
        sides: &mut [f64],
    ) {
        let point = &self.points[l];
        let count = sides.len() / self.places.count.max(1);
        let mut off = vec![0.0; self.places.count];
        self.places.rows.add_product(&point.rows, 1.0, q, &mut off);
        if let Some(explicit) = explicit {
            let phi = explicit.phi.get(l * self.places.count..);
            add_multiple(&mut off, 1.0, phi.unwrap_or_default());
        }
        for (sides, off) in sides.chunks_exact_mut(count.max(1)).zip(off) {
            for (side, slope) in sides.iter_mut().zip(point.slopes).skip(1) {
                *side -= weight * slope * off / h;
            }
        }
    }

    /// The same at the end.
    pub(super) fn add_end_sides(
        &self,
        q: &[f64],
        explicit: Option<&Explicit>,
        h: f64,
        sides: &mut [f64],
    ) {
        let count = sides.len() / self.places.count.max(1);
        let mut off = vec![0.0; self.places.count];
        self.places
            .rows
            .add_product(&self.end.rows, 1.0, q, &mut off);
        if let Some(explicit) = explicit {
            add_multiple(&mut off, 1.0, &explicit.end_phi);
        }
        for (sides, off) in sides.chunks_exact_mut(count.max(1)).zip(off) {
            sides[0] -= off / h;
        }
    }

    /// Subtracts from the momentum that arrives at the end the part that the constraints take up.
    pub(super) fn project(&self, p: &mut [f64], q: &[f64], explicit: Option<&Explicit>) {
        self.end.apply(&self.places, p, q, explicit);
    }
}

/// The adjoint operations.
impl Held {
    /// Takes λ from after the node at the end to before it.
    pub(super) fn pull_projection(&self, of_p: &mut [f64], of_q: &mut [f64]) -> Weights {
        let end = self.end.pull(&self.places, of_p, of_q);
        Weights {
            phi: vec![0.0; self.points.len() * self.places.count],
            start_rows: Vec::new(),
            rows: Vec::new(),
            start: Vec::new(),
            end,
        }
    }

    /// Adds the product of a row with the forces at point l, as a function of the multipliers.
    pub(super) fn pull_reactions(&self, l: usize, force: &[f64], sides: &mut [f64]) {
        let point = &self.points[l];
        let count = sides.len() / self.places.count.max(1);
        let mut of_rate = vec![0.0; self.places.count];
        self.places
            .rows
            .add_product(&point.rows, 1.0, force, &mut of_rate);
        for (sides, of_rate) in sides.chunks_exact_mut(count.max(1)).zip(of_rate) {
            for (side, slope) in sides.iter_mut().zip(point.slopes).skip(1) {
                *side -= slope * of_rate;
            }
        }
    }

    /// Adds the contribution of λ to the first multipliers.
    pub(super) fn pull_first_multipliers(&self, h: f64, of_p: &[f64], sides: &mut [f64]) {
        let count = sides.len() / self.places.count.max(1);
        let mut of_first = vec![0.0; self.places.count];
        self.places
            .rows
            .add_product(&self.start_rows, 1.0, of_p, &mut of_first);
        for (sides, of_first) in sides.chunks_exact_mut(count.max(1)).zip(of_first) {
            sides[0] -= h * of_first;
        }
    }

    /// Adds the weights that the solution `mu` of the adjoint equations gives to φ, and thereby to the coordinates at
    /// point l.
    pub(super) fn pull_constraint_sides(
        &self,
        l: usize,
        mu: &[f64],
        (weight, h): (f64, f64),
        by_q: &mut [f64],
        weights: &mut Weights,
    ) {
        let point = &self.points[l];
        let m = self.places.count;
        let count = mu.len() / m.max(1);
        let own = &mut weights.phi[l * m..(l + 1) * m];
        for (own, mu) in own.iter_mut().zip(mu.chunks_exact(count.max(1))) {
            let pairs = mu.iter().zip(point.slopes).skip(1);
            *own -= weight / h * pairs.map(|(mu, slope)| mu * slope).sum::<f64>();
        }
        self.places.rows.add_transposed(&point.rows, 1.0, own, by_q);
    }

    /// The same at the end.
    pub(super) fn pull_end_sides(
        &self,
        mu: &[f64],
        h: f64,
        by_q: &mut [f64],
        weights: &mut Weights,
    ) {
        let count = mu.len() / self.places.count.max(1);
        let own = &mut weights.end.phi;
        for (own, mu) in own.iter_mut().zip(mu.chunks_exact(count.max(1))) {
            *own -= mu[0] / h;
        }
        self.places
            .rows
            .add_transposed(&self.end.rows, 1.0, own, by_q);
    }

    /// Adds the contribution of λ before the impulse at the start to the coordinates there.
    pub(super) fn pull_impulse(&self, of_p: &[f64], by_q: &mut [f64]) {
        self.places
            .bends
            .add_product(&self.start_bend, -1.0, of_p, by_q);
    }

    /// Adds the weights that λ gives to the entries of A at the start and at the points, through h A₀ᵀm₀ and Aᵀμ̇.
    pub(super) fn weigh_rows(&self, of_p: &[f64], forces: &[f64], weights: &mut Weights) {
        let n = of_p.len();
        let places = || self.places.rows.places().iter();
        let start = places().map(|(_, c, a)| -of_p[*a] * self.first[*c]);
        weights.start_rows = start.collect();
        weights.start = self.start.clone();
        for (point, force) in self.points.iter().zip(forces.chunks_exact(n.max(1))) {
            let rows = places().map(|(_, c, a)| -force[*a] * point.mu_rate[*c]);
            weights.rows.extend(rows);
        }
    }
}
