//! The product of the derivative of a step with a column: how its end, and its polynomials, change with what changes in
//! it directly.

use super::super::model::Block;
use super::super::projection::Explicit;
use super::super::rates::product;
use super::TransitionOperator;
use crate::condense::add_multiple;
use crate::scheme::Tables as _;
use alloc::vec;
use alloc::vec::Vec;

/// What changes in an element directly, at fixed rates and multipliers; zero by default.
pub(super) trait Change {
    /// The change of coordinate a at point l.
    fn position(&self, _l: usize, _a: usize) -> f64 {
        0.0
    }

    /// The change of L_v at point l.
    fn momentum(&self, _l: usize, _a: usize) -> f64 {
        0.0
    }

    /// The change of F = L_q + Q at point l.
    fn force(&self, _l: usize, _a: usize) -> f64 {
        0.0
    }

    /// The change of p₀.
    fn start_momentum(&self, _a: usize) -> f64 {
        0.0
    }

    /// The change of q₁.
    fn end_position(&self, _a: usize) -> f64 {
        0.0
    }

    /// The changes of what constraints add.
    fn explicit(&self) -> Option<&Explicit> {
        None
    }
}

/// The start changes: by (δp₀, δq₀).
struct OfStart<'a> {
    p: &'a [f64],
    q: &'a [f64],
    explicit: Option<Explicit>,
}

impl Change for OfStart<'_> {
    fn position(&self, _l: usize, a: usize) -> f64 {
        self.q[a]
    }

    fn start_momentum(&self, a: usize) -> f64 {
        self.p[a]
    }

    fn end_position(&self, a: usize) -> f64 {
        self.q[a]
    }

    fn explicit(&self) -> Option<&Explicit> {
        self.explicit.as_ref()
    }
}

/// Σ_j w_j ν_j for coordinate a. The rates ν of a coordinate lie together.
pub(super) fn combined(weights: &[f64], rates: &[f64], a: usize) -> f64 {
    let count = weights.len();
    product(weights, &rates[a * count..(a + 1) * count])
}

impl TransitionOperator {
    /// The change of the end of the step for a change of its start.
    pub(super) fn respond_to(
        &self,
        (p, q): (&[f64], &[f64]),
        inside: Option<&mut Vec<f64>>,
    ) -> Vec<f64> {
        let change = OfStart {
            p,
            q,
            explicit: self.held.as_ref().map(|held| held.impulse_of(q)),
        };
        self.respond_inside(&change, inside)
    }

    /// The change of the end of the step for direct changes in the element.
    pub(super) fn respond(&self, change: &impl Change) -> Vec<f64> {
        self.respond_inside(change, None)
    }

    /// The same, with the coefficients of the polynomials if they are requested: those of dq/dτ, a row of n each, then
    /// those of dp/dτ.
    pub(super) fn respond_inside(
        &self,
        change: &impl Change,
        mut inside: Option<&mut Vec<f64>>,
    ) -> Vec<f64> {
        let scheme = self.table.view();
        let (n, h) = (self.end.q.len(), self.h);
        let of_start = (0..n).map(|a| change.start_momentum(a));
        let of_end = (0..n).map(|a| change.end_position(a));
        let mut end: Vec<f64> = of_start.chain(of_end).collect();
        let (end_p, end_q) = end.split_at_mut(n);
        let mut unknowns = self.sides(change, end_p, end_q);
        self.matrix.solve(&mut unknowns);
        let (rates, multipliers) = unknowns.split_at(n * scheme.unknowns());
        if let Some(inside) = &mut inside {
            inside.clear();
            for weights in scheme.rate.chunks_exact(scheme.unknowns()) {
                inside.extend((0..n).map(|a| h * combined(weights, rates, a)));
            }
            inside.resize(2 * inside.len(), 0.0);
        }
        self.add_forces(change, (rates, multipliers), end_p, inside.as_deref_mut());
        for (a, end) in end_q.iter_mut().enumerate() {
            *end += h * combined(scheme.advance, rates, a);
        }
        let Some(held) = &self.held else { return end };
        held.add_first_multipliers(h, multipliers, end_p);
        held.project(end_p, end_q, change.explicit());
        if let Some(inside) = inside {
            let start: Vec<f64> = (0..n).map(|a| change.start_momentum(a)).collect();
            let points = scheme.points();
            self.add_jump(points, &start, inside);
            self.add_jump(points + 1, end_p, inside);
        }
        end
    }

    /// The right-hand sides of the linear system for the rates and the multipliers. `p` is the change of the momentum at
    /// the start, from which that of the impulse there is subtracted; `q` that of the coordinates at the end.
    fn sides(&self, change: &impl Change, p: &mut [f64], q: &[f64]) -> Vec<f64> {
        let scheme = self.table.view();
        let (n, h) = (self.end.q.len(), self.h);
        let (count, points) = (scheme.unknowns(), scheme.points());
        let (held, explicit) = (self.held.as_ref(), change.explicit());
        let mut sides = vec![0.0; self.matrix.size()];
        let (rates, multipliers) = sides.split_at_mut(n * count);
        let still = vec![0.0; n];
        let mut place = Place::zero(n);
        for l in 0..points {
            for a in 0..n {
                place.q[a] = change.position(l, a);
                place.momentum[a] = change.momentum(l, a);
                place.force[a] = change.force(l, a);
            }
            self.bend(l, &place.q, &still, &mut place.momentum, &mut place.force);
            if let Some(held) = held {
                held.bend(l, &place.q, &mut place.force);
                let weight = (scheme.weights[l], h);
                held.add_constraint_sides(l, &place.q, explicit, weight, multipliers);
            }
            for (a, sides) in rates.chunks_exact_mut(count).enumerate() {
                for (i, side) in sides.iter_mut().enumerate() {
                    let at = i * points + l;
                    *side += h * scheme.force[at] * place.force[a]
                        - scheme.momentum[at] * place.momentum[a];
                }
            }
        }
        if let Some(held) = held {
            held.add_end_sides(q, explicit, h, multipliers);
            held.subtract_impulse(explicit, p);
        }
        for (sides, impulse) in rates.chunks_exact_mut(count).zip(p) {
            sides.iter_mut().for_each(|side| *side += *impulse);
        }
        sides
    }

    /// Adds the changes of the forces at the points to the momentum at the end, and those of forces or, with
    /// constraints, of momenta to the coefficients of dp/dτ.
    fn add_forces(
        &self,
        change: &impl Change,
        (rates, multipliers): (&[f64], &[f64]),
        end_p: &mut [f64],
        mut inside: Option<&mut Vec<f64>>,
    ) {
        let scheme = self.table.view();
        let (n, h) = (self.end.q.len(), self.h);
        let (count, points) = (scheme.unknowns(), scheme.points());
        let mut v = vec![0.0; n];
        let mut place = Place::zero(n);
        for l in 0..points {
            let row = l * count..(l + 1) * count;
            for a in 0..n {
                let moved = h * combined(&scheme.position[row.clone()], rates, a);
                place.q[a] = change.position(l, a) + moved;
                v[a] = combined(&scheme.velocity[row.clone()], rates, a);
                place.momentum[a] = change.momentum(l, a);
                place.force[a] = change.force(l, a);
            }
            self.bend(l, &place.q, &v, &mut place.momentum, &mut place.force);
            if let Some(held) = &self.held {
                held.bend(l, &place.q, &mut place.force);
                held.add_reactions(l, multipliers, &mut place.force);
            }
            add_multiple(end_p, h * scheme.weights[l], &place.force);
            let Some(inside) = &mut inside else { continue };
            if self.held.is_some() {
                self.add_inertia(l, &v, &mut place.momentum);
                self.add_jump(l, &place.momentum, inside);
                continue;
            }
            let half = inside.len() / 2;
            let rows = inside[half..].chunks_exact_mut(n.max(1));
            for (row, weights) in rows.zip(scheme.force_rate.chunks_exact(points)) {
                add_multiple(row, h * weights[l], &place.force);
            }
        }
    }

    /// Adds the contribution of a momentum to the coefficients of dp/dτ of an element with constraints: of that at a
    /// point, after the points of that at the start, and at last of that at the end.
    fn add_jump(&self, place: usize, momentum: &[f64], inside: &mut [f64]) {
        let places = self.table.view().points() + 2;
        let half = inside.len() / 2;
        let rows = inside[half..].chunks_exact_mut(momentum.len().max(1));
        for (row, weights) in rows.zip(self.jumps.chunks_exact(places)) {
            add_multiple(row, weights[place], momentum);
        }
    }

    /// Adds L_vv δv at one point.
    pub(super) fn add_inertia(&self, l: usize, v: &[f64], momentum: &mut [f64]) {
        for (block, row, column, value) in self.second(l) {
            if block == Block::ZZ {
                momentum[row] += value * v[column];
            }
        }
    }

    /// Adds L_vq δq to `momentum`, F_v δv + F_q δq to `force`, at one point.
    pub(super) fn bend(
        &self,
        l: usize,
        q: &[f64],
        v: &[f64],
        momentum: &mut [f64],
        force: &mut [f64],
    ) {
        for (block, row, column, value) in self.second(l) {
            match block {
                Block::ZZ => {}
                Block::ZQ => {
                    momentum[row] += value * q[column];
                    force[column] += value * v[row];
                }
                Block::ForceZ => force[row] += value * v[column],
                // From L_qq, and from forces by coordinates.
                _ => force[row] += value * q[column],
            }
        }
    }

    /// The second derivatives at one point.
    pub(super) fn second(&self, l: usize) -> impl Iterator<Item = (Block, usize, usize, f64)> {
        let places = self.pattern.places();
        let values = &self.values[l * places.len()..];
        let both = places.iter().zip(values);
        both.map(|((block, row, column), value)| (*block, *row, *column, *value))
    }
}

/// The changes at one point.
struct Place {
    q: Vec<f64>,
    momentum: Vec<f64>,
    force: Vec<f64>,
}

impl Place {
    fn zero(n: usize) -> Self {
        Self {
            q: vec![0.0; n],
            momentum: vec![0.0; n],
            force: vec![0.0; n],
        }
    }
}
