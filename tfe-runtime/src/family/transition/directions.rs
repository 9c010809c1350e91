//! The derivatives of a step by its start time, its length, parameters and damping.

use super::super::model::Model;
use super::super::projection::Explicit;
use super::super::rates::Rates;
use super::super::view::View;
use super::TransitionOperator;
use super::respond::{Change, combined};
use crate::condense::{Direction, Parameter, add_multiple};
use crate::dual::Dual;
use crate::scheme::{SchemeRef, Tables as _};
use alloc::vec;
use alloc::vec::Vec;

/// The element is stretched at fixed rates, and its momenta and forces change.
struct Along<'a> {
    scheme: SchemeRef<'a>,
    rates: &'a [f64],
    /// The change of the length.
    length: f64,
    /// The changes of L_v at the points; empty where there are none.
    momenta: &'a [Vec<f64>],
    /// Those of h F, divided by h.
    forces: &'a [Vec<f64>],
    explicit: Option<&'a Explicit>,
}

impl Along<'_> {
    /// The change of h Σ w ν by that of h.
    fn stretched(&self, weights: &[f64], a: usize) -> f64 {
        match self.length == 0.0 {
            true => 0.0,
            false => self.length * combined(weights, self.rates, a),
        }
    }
}

impl Change for Along<'_> {
    fn position(&self, l: usize, a: usize) -> f64 {
        let count = self.scheme.unknowns();
        self.stretched(&self.scheme.position[l * count..(l + 1) * count], a)
    }

    fn momentum(&self, l: usize, a: usize) -> f64 {
        self.momenta.get(l).map_or(0.0, |momentum| momentum[a])
    }

    fn force(&self, l: usize, a: usize) -> f64 {
        self.forces[l][a]
    }

    fn end_position(&self, a: usize) -> f64 {
        self.stretched(self.scheme.advance, a)
    }

    fn explicit(&self) -> Option<&Explicit> {
        self.explicit
    }
}

impl TransitionOperator {
    /// Computes the derivatives by the length and by the damping.
    pub(super) fn differentiate<V: Model>(&mut self, rates: &Rates<&V>) {
        let h = self.h;
        let per_length = |values: &[f64]| values.iter().map(|value| value / h).collect();
        let stretched = Explicit::impulse(per_length(rates.impulse_of_start()));
        let forces: Vec<_> = (rates.points.iter())
            .map(|point| per_length(&point.force))
            .collect();
        let by_length = self.respond(&Along {
            scheme: self.table.view(),
            rates: rates.unknowns(),
            length: 1.0,
            momenta: &[],
            forces: &forces,
            explicit: self.held.as_ref().map(|_| &stretched),
        });
        let velocities: Vec<_> = rates.points.iter().map(|point| point.v.clone()).collect();
        let by_damping = self.respond(&Along {
            scheme: self.table.view(),
            rates: rates.unknowns(),
            length: 0.0,
            momenta: &[],
            forces: &velocities,
            explicit: None,
        });
        (self.by_length, self.by_damping) = (by_length, by_damping);
    }

    /// Computes the derivatives along directions.
    pub(in crate::family) fn differentiate_along<M: Model>(
        &mut self,
        view: &View<'_, M>,
        rates: &Rates<&View<'_, M>>,
        times: (f64, f64),
        directions: &[Direction],
    ) {
        for direction in directions {
            let (end, inside) = self.along(view, rates, times, direction);
            self.by_parameters.push(end);
            self.inside_by_parameters.push(inside);
        }
    }

    /// The derivatives of the end and of the coefficients of the polynomials along one direction.
    fn along<M: Model>(
        &self,
        view: &View<'_, M>,
        rates: &Rates<&View<'_, M>>,
        (t, h): (f64, f64),
        direction: &Direction,
    ) -> (Vec<f64>, Vec<f64>) {
        let scheme = self.table.view();
        let Direction {
            time,
            length,
            damping,
            ..
        } = *direction;
        let parameter = direction.parameter.map(|parameter| match parameter {
            Parameter::Named(index) | Parameter::Any(index) => index,
        });
        // The time at a fraction of the element.
        let moved = |part: f64| {
            let time = Dual::new(t + h * part, time + length * part);
            time.by_parameter(parameter)
        };
        let n = self.end.q.len();
        let (still, mut unused) = (vec![0.0; n], vec![0.0; n]);
        let (mut momenta, mut forces) = (Vec::new(), Vec::new());
        for (l, point) in rates.points.iter().enumerate() {
            let mut by = view.by_time(moved(scheme.nodes[l]), &point.q, &point.v);
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
            let solved = rates.solved(&scheme, (t, h), &self.pattern);
            let (q, v) = solved.end;
            let end = view.by_time(moved(1.0), q, v).momentum;
            let mut explicit = held.explicit(view, &moved, &solved, end, &mut forces);
            // The change of h A₀ᵀ m₀ by that of h.
            add_multiple(&mut explicit.impulse, length / h, rates.impulse_of_start());
            explicit
        });
        let change = Along {
            scheme,
            rates: rates.unknowns(),
            length,
            momenta: &momenta,
            forces: &forces,
            explicit: explicit.as_ref(),
        };
        let mut inside = Vec::new();
        let end = self.respond_inside(&change, Some(&mut inside));
        // The coefficients of dq/dτ are h times those of the rates, and so change with h.
        let rows = inside.chunks_exact_mut(n.max(1));
        for (row, weights) in rows.zip(scheme.rate.chunks_exact(scheme.unknowns())) {
            for (a, slope) in row.iter_mut().enumerate() {
                *slope += change.stretched(weights, a);
            }
        }
        (end, inside)
    }
}
