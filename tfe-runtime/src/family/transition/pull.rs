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

impl TransitionOperator {
    /// Replaces the row λ of phase space by its product with the derivative, including the derivatives of a loss by the
    /// inside of the element, and returns the weights of the points (T-127).
    pub(in crate::family) fn pull(&self, inside: Option<&InsideLoss>, lambda: &mut [f64]) -> Seeds {
        let scheme = self.table.view();
        let (n, h) = (self.end.q.len(), self.h);
        let (count, points) = (scheme.unknowns(), scheme.points());
        let within = Within::of(inside, &scheme, h);
        let held = self.held.as_ref();
        let (of_p, of_q) = lambda.split_at_mut(n);
        // The weights of L_v at the points and of the momentum at the start, through which the polynomial of momenta
        // with jumps passes.
        let mut through = vec![0.0; points * n];
        let mut of_start = vec![0.0; n];
        if let (Some(_), Some(inside)) = (held, inside) {
            let rows = inside.coefficients.chunks_exact(n.max(1));
            let rows = rows.skip(scheme.rates());
            for (weights, row) in self.jumps.chunks_exact(points + 2).zip(rows) {
                for (through, weight) in through.chunks_exact_mut(n.max(1)).zip(weights) {
                    add_multiple(through, *weight, row);
                }
                add_multiple(&mut of_start, weights[points], row);
                add_multiple(of_p, weights[points + 1], row);
            }
        }
        let mut held_weights = held.map(|held| held.pull_projection(of_p, of_q));
        let mut mu = vec![0.0; self.matrix.size()];
        let (rates, multipliers) = mu.split_at_mut(n * count);
        let (mut by_q, mut by_v) = (vec![0.0; n], vec![0.0; n]);
        for (rates, of_q) in rates.chunks_exact_mut(count).zip(&*of_q) {
            for (rate, advance) in rates.iter_mut().zip(scheme.advance) {
                *rate = h * advance * of_q;
            }
        }
        for (j, seeds) in within.rates.chunks_exact(n.max(1)).enumerate() {
            for (rates, seed) in rates.chunks_exact_mut(count).zip(seeds) {
                rates[j] += seed;
            }
        }
        for l in 0..points {
            by_q.fill(0.0);
            by_v.fill(0.0);
            let momentum = &through[l * n..(l + 1) * n];
            let mut force: Vec<f64> = of_p.iter().map(|p| h * scheme.weights[l] * p).collect();
            match held {
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
        if let Some(held) = held {
            held.pull_first_multipliers(h, of_p, multipliers);
        }
        self.matrix.solve_transposed(&mut mu);
        let (rates, multipliers) = mu.split_at(n * count);
        by_q.fill(0.0);
        let zeros = || vec![0.0; points * n];
        let mut seeds = Seeds {
            momenta: through,
            forces: zeros(),
            by_velocities: zeros(),
            held: None,
        };
        for l in 0..points {
            let own = l * n..(l + 1) * n;
            let momentum = &mut seeds.momenta[own.clone()];
            let force = &mut seeds.forces[own.clone()];
            for (a, mu) in rates.chunks_exact(count).enumerate() {
                force[a] = h * scheme.weights[l] * of_p[a];
                for (i, mu) in mu.iter().enumerate() {
                    momentum[a] -= scheme.momentum[i * points + l] * mu;
                    force[a] += h * scheme.force[i * points + l] * mu;
                }
            }
            let by_v = &mut seeds.by_velocities[own];
            match (held, &mut held_weights) {
                (Some(held), Some(weights)) => {
                    held.bend(l, force, &mut by_q);
                    let scale = (scheme.weights[l], h);
                    held.pull_constraint_sides(l, multipliers, scale, &mut by_q, weights);
                }
                _ => within.add_forces(l, force),
            }
            self.bend_back(l, (momentum, force), &mut by_q, by_v);
        }
        for (a, mu) in rates.chunks_exact(count).enumerate() {
            of_p[a] += mu.iter().sum::<f64>();
        }
        if let (Some(held), Some(weights)) = (held, &mut held_weights) {
            held.pull_end_sides(multipliers, h, &mut by_q, weights);
            held.pull_impulse(of_p, &mut by_q);
            held.weigh_rows(of_p, &seeds.forces, weights);
        }
        add_multiple(of_p, 1.0, &of_start);
        add_multiple(of_q, 1.0, &by_q);
        seeds.held = held_weights;
        seeds
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
