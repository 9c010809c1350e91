//! The adjoint of a step of a model of run-time length: the product of a row of phase space with its derivative (T-127,
//! T-160).

use super::TransitionOperator;
use crate::condense::add_multiple;
use crate::family::held::Weights;
use crate::family::model::Block;
use crate::inside::{InsideLoss, Seeds as Within};
use crate::scheme::Tables as _;
use alloc::vec;
use alloc::vec::Vec;

/// The weights that a row of phase space gives to the points of an element, a row of n for each point.
pub(in crate::family) struct Seeds {
    /// The weights of L_v and of F.
    pub(in crate::family) momenta: Vec<f64>,
    pub(in crate::family) forces: Vec<f64>,
    /// Their contributions to the weights of velocities.
    pub(in crate::family) by_velocities: Vec<f64>,
    /// The weights of constraints.
    pub(in crate::family) held: Option<Weights>,
}

/// The weights that a loss gives to the momenta at the points, and to that at the start.
struct Jumps {
    momenta: Vec<f64>,
    start: Vec<f64>,
}

impl TransitionOperator {
    /// Replaces the row λ of phase space by its product with the derivative, including the derivatives of a loss by the
    /// inside of the element, and returns the weights of the points (T-127).
    pub(in crate::family) fn pull(&self, inside: Option<&InsideLoss>, lambda: &mut [f64]) -> Seeds {
        let scheme = self.table.view();
        let (n, h) = (self.end.q.len(), self.h);
        let within = Within::of(inside, &scheme, h);
        let held = self.held.as_ref();
        let (of_p, of_q) = lambda.split_at_mut(n);
        let jumps = self.pull_jumps(inside.filter(|_| held.is_some()), of_p);
        let mut weights = held.map(|held| held.pull_projection(of_p, of_q));
        let mut mu = self.pull_end(&within, &jumps.momenta, (of_p, of_q));
        self.matrix.solve_transposed(&mut mu);
        let (rates, multipliers) = mu.split_at(n * scheme.unknowns());
        let mut by_q = vec![0.0; n];
        let mut seeds = self.seeds(&within, jumps.momenta, rates, of_p);
        for l in 0..scheme.points() {
            let own = l * n..(l + 1) * n;
            let (momentum, force) = (&seeds.momenta[own.clone()], &seeds.forces[own.clone()]);
            if let (Some(held), Some(weights)) = (held, &mut weights) {
                held.bend(l, force, &mut by_q);
                let scale = (scheme.weights[l], h);
                held.pull_constraint_sides(l, multipliers, scale, &mut by_q, weights);
            }
            let by_v = &mut seeds.by_velocities[own];
            self.bend_back(l, (momentum, force), &mut by_q, by_v);
        }
        for (a, mu) in rates.chunks_exact(scheme.unknowns()).enumerate() {
            of_p[a] += mu.iter().sum::<f64>();
        }
        if let (Some(held), Some(weights)) = (held, &mut weights) {
            held.pull_end_sides(multipliers, h, &mut by_q, weights);
            held.pull_impulse(of_p, &mut by_q);
            held.weigh_rows(of_p, &seeds.forces, weights);
        }
        add_multiple(of_p, 1.0, &jumps.start);
        add_multiple(of_q, 1.0, &by_q);
        seeds.held = weights;
        seeds
    }

    /// The weights that a loss inside an element with constraints gives to the momenta through which its polynomial
    /// passes with jumps; that of the momentum at the end is added to `of_p`.
    fn pull_jumps(&self, inside: Option<&InsideLoss>, of_p: &mut [f64]) -> Jumps {
        let scheme = self.table.view();
        let (n, points) = (self.end.q.len(), scheme.points());
        let mut jumps = Jumps {
            momenta: vec![0.0; points * n],
            start: vec![0.0; n],
        };
        let Some(inside) = inside else { return jumps };
        let rows = inside.coefficients.chunks_exact(n.max(1));
        let rows = rows.skip(scheme.rates());
        for (weights, row) in self.jumps.chunks_exact(points + 2).zip(rows) {
            for (momentum, weight) in jumps.momenta.chunks_exact_mut(n.max(1)).zip(weights) {
                add_multiple(momentum, *weight, row);
            }
            add_multiple(&mut jumps.start, weights[points], row);
            add_multiple(of_p, weights[points + 1], row);
        }
        jumps
    }

    /// The weights of the rates and multipliers: the right-hand side of the transposed system.
    fn pull_end(
        &self,
        within: &Within,
        momenta: &[f64],
        (of_p, of_q): (&[f64], &[f64]),
    ) -> Vec<f64> {
        let scheme = self.table.view();
        let (n, h) = (self.end.q.len(), self.h);
        let count = scheme.unknowns();
        let mut sides = vec![0.0; self.matrix.size()];
        let (rates, multipliers) = sides.split_at_mut(n * count);
        for (rates, of_q) in rates.chunks_exact_mut(count).zip(of_q) {
            for (rate, advance) in rates.iter_mut().zip(scheme.advance) {
                *rate = h * advance * of_q;
            }
        }
        for (j, seeds) in within.rates.chunks_exact(n.max(1)).enumerate() {
            for (rates, seed) in rates.chunks_exact_mut(count).zip(seeds) {
                rates[j] += seed;
            }
        }
        let (mut by_q, mut by_v) = (vec![0.0; n], vec![0.0; n]);
        for l in 0..scheme.points() {
            by_q.fill(0.0);
            by_v.fill(0.0);
            let momentum = &momenta[l * n..(l + 1) * n];
            let mut force: Vec<f64> = of_p.iter().map(|p| h * scheme.weights[l] * p).collect();
            match &self.held {
                None => within.add_forces(l, &mut force),
                Some(held) => {
                    held.bend(l, &force, &mut by_q);
                    held.pull_reactions(l, &force, multipliers);
                    self.add_inertia(l, momentum, &mut by_v);
                }
            }
            self.bend_back(l, (momentum, &force), &mut by_q, &mut by_v);
            let row = l * count..(l + 1) * count;
            let (position, velocity) = (&scheme.position[row.clone()], &scheme.velocity[row]);
            for (a, rates) in rates.chunks_exact_mut(count).enumerate() {
                for (j, rate) in rates.iter_mut().enumerate() {
                    *rate += velocity[j] * by_v[a] + h * position[j] * by_q[a];
                }
            }
        }
        if let Some(held) = &self.held {
            held.pull_first_multipliers(h, of_p, multipliers);
        }
        sides
    }

    /// The weights of momenta and forces at the points, from those of the rows of the linear system; `momenta` are those
    /// that they have besides.
    fn seeds(&self, within: &Within, mut momenta: Vec<f64>, rows: &[f64], of_p: &[f64]) -> Seeds {
        let scheme = self.table.view();
        let (n, h, points) = (of_p.len(), self.h, scheme.points());
        let mut forces = vec![0.0; points * n];
        for l in 0..points {
            let own = l * n..(l + 1) * n;
            let (momentum, force) = (&mut momenta[own.clone()], &mut forces[own]);
            for (a, rows) in rows.chunks_exact(scheme.unknowns()).enumerate() {
                force[a] = h * scheme.weights[l] * of_p[a];
                for (i, row) in rows.iter().enumerate() {
                    momentum[a] -= scheme.momentum[i * points + l] * row;
                    force[a] += h * scheme.force[i * points + l] * row;
                }
            }
            if self.held.is_none() {
                within.add_forces(l, force);
            }
        }
        Seeds {
            momenta,
            forces,
            by_velocities: vec![0.0; points * n],
            held: None,
        }
    }

    /// Adds the contributions of the weights of L_v and F at one point to those of coordinates and of velocities.
    fn bend_back(
        &self,
        l: usize,
        (momentum, force): (&[f64], &[f64]),
        by_q: &mut [f64],
        by_v: &mut [f64],
    ) {
        for (block, row, column, value) in self.second(l) {
            match block {
                Block::ZZ => {}
                Block::ZQ => {
                    by_q[column] += value * momentum[row];
                    by_v[row] += value * force[column];
                }
                Block::ForceZ => by_v[column] += value * force[row],
                _ => by_q[column] += value * force[row],
            }
        }
    }
}
