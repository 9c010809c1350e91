//! Holonomic constraints by site: the equations of all sites of a range are one template, which is differentiated once
//! by its slots.
//!
//! ```text
//! φ_r(q, t) = 0,   r = offset + (i − start)        A = ∂φ/∂q   a = ∂φ/∂t   Σ_r μ_r ∂²φ_r/∂q∂q
//! ```
//!
//! As for energies, a derivative by the slot `q[a]` adds to entry a, and one by two slots to (a, b) and (b, a): this holds where both indices
//! are equal, too.

use super::{by_leaf, coordinate, is_zero, leaves};
use crate::derive::entry::Entry;
use crate::expr::differentiate::{Forward, derivative, gradient};
use crate::expr::graph::{ExprId, Graph};
use crate::expr::input::{Affine, Input};
use crate::model::declared::Constraint;
use crate::program::{Array, Place};

/// The entries of all constraint arrays, on every turn of their ranges.
pub(crate) fn entries(graph: &mut Graph, constraints: &[Constraint]) -> Vec<Entry> {
    let mut entries = Vec::new();
    for constraint in constraints {
        let mut push = |graph: &Graph, place: Place, value: ExprId| {
            if !is_zero(graph, value) {
                let nest = constraint.ranges.clone();
                entries.push(Entry { nest, place, value });
            }
        };
        let own = |array| Place::vector(array, constraint.row.clone());
        let drift = derivative(graph, constraint.value, &Input::Time);
        push(graph, own(Array::SitePhi), constraint.value);
        push(graph, own(Array::SiteDrift), drift);
        let slots = leaves(graph, &[constraint.value], coordinate);
        let ids: Vec<ExprId> = slots.iter().map(|(_, leaf)| *leaf).collect();
        let slopes = gradient(graph, constraint.value, &ids);
        let mu = graph.input(Input::Multiplier(constraint.row.clone()));
        for (at, ((column, leaf), slope)) in slots.iter().zip(&slopes).enumerate() {
            let place = Place {
                column: column.clone(),
                ..own(Array::SiteRow)
            };
            push(graph, place, *slope);
            let mut along = Forward::default();
            for ((row, _), slope) in slots.iter().zip(&slopes).take(at + 1) {
                let bend = by_leaf(graph, &mut along, *slope, *leaf);
                let bend = graph.multiply(mu, bend);
                push(graph, bend_at(row, column), bend);
                if row != column {
                    push(graph, bend_at(column, row), bend);
                }
            }
        }
    }
    entries
}

fn bend_at(row: &Affine, column: &Affine) -> Place {
    Place {
        array: Array::Bend,
        row: row.clone(),
        column: column.clone(),
    }
}
