//! The derivatives of a step by its start time, its length, parameters and damping.

use super::super::model::Model;
use super::super::projection::Explicit;
use super::super::rates::Rates;
use super::super::view::View;
use super::{Change, OperatorError, TransitionOperator};
use crate::condense::{Direction, Parameter, add_multiple};
use crate::dual::Dual;
use crate::scheme::Tables as _;
use alloc::vec;
use alloc::vec::Vec;

impl TransitionOperator {
    /// Computes the derivatives by the length and by the damping.
    pub(super) fn differentiate<V: Model>(&mut self, rates: &Rates<&V>) {
        let scheme = self.table.view();
        let count = scheme.unknowns();
        let sum = |weights: &[f64], a: usize| -> f64 {
            let rates = &rates.unknowns()[a * count..(a + 1) * count];
            weights.iter().zip(rates).map(|(w, rate)| w * rate).sum()
        };
        let h = self.h;
        let impulse = rates.impulse_of_start().iter().map(|impulse| impulse / h);
        let stretched = Explicit::impulse(impulse.collect());
        let by_length = self.respond(&Change {
            shift: |l: usize, a: usize| sum(&scheme.position[l * count..(l + 1) * count], a),
            lift: |_, _| 0.0,
            push: |l: usize, a: usize| rates.points[l].force[a] / h,
            impulse: |_| 0.0,
            advance: |a| sum(scheme.advance, a),
            explicit: self.held.as_ref().map(|_| &stretched),
        });
        let by_damping = self.respond(&Change {
            shift: |_, _| 0.0,
            lift: |_, _| 0.0,
            push: |l: usize, a: usize| rates.points[l].v[a],
            impulse: |_| 0.0,
            advance: |_| 0.0,
            explicit: None,
        });
        (self.by_length, self.by_damping) = (by_length, by_damping);
    }

    /// Computes the derivatives along directions.
    pub(in crate::family) fn answer<M: Model>(
        &mut self,
        view: &View<'_, M>,
        rates: &Rates<&View<'_, M>>,
        (t, h): (f64, f64),
        directions: &[Direction],
    ) -> Result<(), OperatorError> {
        let n = self.end.q.len();
        let (still, mut unused) = (vec![0.0; n], vec![0.0; n]);
        let count = self.table.view().unknowns();
        let sum = |weights: &[f64], a: usize| -> f64 {
            let rates = &rates.unknowns()[a * count..(a + 1) * count];
            weights.iter().zip(rates).map(|(w, rate)| w * rate).sum()
        };
        for direction in directions {
            let Direction {
                time,
                length,
                damping,
                ..
            } = *direction;
            let parameter = direction.parameter.map(|parameter| match parameter {
                Parameter::Named(index) | Parameter::Any(index) => index,
            });
            let stretch = |weights: &[f64], a: usize| match length == 0.0 {
                true => 0.0,
                false => length * sum(weights, a),
            };
            // The time at a fraction of the element.
            let moved = |part: f64| {
                let time = Dual::new(t + h * part, time + length * part);
                time.by_parameter(parameter)
            };
            let (mut momenta, mut forces) = (Vec::new(), Vec::new());
            for (l, point) in rates.points.iter().enumerate() {
                let node = self.table.view().nodes[l];
                let mut by = view.answer(moved(node), &point.q, &point.v);
                self.bend(l, &still, &by.velocity, &mut unused, &mut by.force);
                // The change of h F by that of h, divided by h; and the additional force γ v.
                let own = by.force.iter_mut().zip(&point.force).zip(&point.v);
                for ((by, force), v) in own {
                    *by += length * force / h + damping * v;
                }
                momenta.push(by.momentum);
                forces.push(by.force);
            }
            let explicit = self.held.as_ref().map(|held| {
                let scheme = self.table.view();
                let solved = rates.solved(&scheme, (t, h), &self.pattern);
                let (q, v) = solved.end;
                let end = view.answer(moved(1.0), q, v).momentum;
                let mut explicit = held.explicit(view, &moved, &solved, end, &mut forces);
                // The change of h A₀ᵀ m₀ by that of h.
                add_multiple(&mut explicit.impulse, length / h, rates.impulse_of_start());
                explicit
            });
            let scheme = self.table.view();
            let mut inside = Vec::new();
            let change = Change {
                shift: |l: usize, a: usize| {
                    stretch(&scheme.position[l * count..(l + 1) * count], a)
                },
                lift: |l: usize, a: usize| momenta[l][a],
                push: |l: usize, a: usize| forces[l][a],
                impulse: |_| 0.0,
                advance: |a| stretch(scheme.advance, a),
                explicit: explicit.as_ref(),
            };
            let end = self.respond_inside(&change, Some(&mut inside));
            // The coefficients of dq/dτ are h times those of the rates, and so change with h.
            let rows = inside.chunks_exact_mut(n.max(1));
            for (row, weights) in rows.zip(scheme.rate.chunks_exact(count)) {
                for (a, slope) in row.iter_mut().enumerate() {
                    *slope += stretch(weights, a);
                }
            }
            self.by_parameters.push(end);
            self.inside_by_parameters.push(inside);
        }
        Ok(())
    }
}
