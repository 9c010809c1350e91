//! The adjoint of constraints: derivatives by their parameters (T-160).

use super::Backwards;
use super::written::{Points, add_of_points, add_of_rows};
use crate::family::held::Weights;
use crate::family::model::Model;
use crate::family::projection::NodeWeights;
use crate::lanes::Lanes;
use crate::scheme::Tables as _;
use alloc::vec;
use alloc::vec::Vec;
use core::ops::Range;

impl<M: Model> Backwards<'_, M> {
    /// Adds the derivatives by parameters of the constraints of an element.
    pub(super) fn take_derivatives_of_constraints(
        &mut self,
        (start, end): (f64, f64),
        weights: &Weights,
    ) {
        let model = self.view.model();
        if model.parameters() == 0 {
            return;
        }
        let (n, places) = (model.len(), &self.places);
        let rows = &self.ground.places.rows;
        let (m, entries) = (model.constraints(), rows.places().len());
        let points = self.ground.table.view().points();
        let none = vec![Lanes([0.0; 4]); m];
        for (group, t) in places.times.iter().enumerate() {
            let own = 4 * group..points.min(4 * group + 4);
            let phi = grouped(&weights.phi, m, own.clone());
            let of_rows = grouped(&weights.rows, entries, own);
            let q = &places.q[group * n..(group + 1) * n];
            add_of_rows(
                &mut self.tape,
                model,
                (*t, q),
                rows,
                [&phi, &none, &of_rows],
            );
        }
        let fours = |values: &[f64]| -> Vec<Points> {
            values.iter().map(|value| Lanes([*value; 4])).collect()
        };
        let place = (Lanes([start; 4]), &fours(&weights.start)[..]);
        let of_start = grouped(&weights.start_rows, entries, 0..1);
        let all = [&none[..], &none, &of_start];
        add_of_rows(&mut self.tape, model, place, rows, all);
        self.take_derivatives_of_node(end, &weights.end);
    }

    /// The same for the constraints at a node.
    pub(super) fn take_derivatives_of_node(&mut self, t: f64, weights: &NodeWeights) {
        let model = self.view.model();
        let fours = |values: &[f64]| -> Vec<Points> {
            values.iter().map(|value| Lanes([*value; 4])).collect()
        };
        let first = |values: &[f64]| grouped(values, values.len(), 0..1);
        let (t, q) = (Lanes([t; 4]), fours(&weights.q));
        let of_rows = [&weights.phi, &weights.drift, &weights.rows].map(|own| first(own));
        let all = [&of_rows[0][..], &of_rows[1], &of_rows[2]];
        let rows = &self.ground.places.rows;
        add_of_rows(&mut self.tape, model, (t, &q), rows, all);
        let momentum = first(&weights.momentum);
        let zeros = vec![Lanes([0.0; 4]); q.len()];
        let place = (t, &q[..], &fours(&weights.v)[..]);
        add_of_points(&mut self.tape, model, place, [&momentum, &zeros, &zeros]);
    }
}

/// Some rows as lanes, `width` numbers each.
fn grouped(rows: &[f64], width: usize, own: Range<usize>) -> Vec<Points> {
    let mut grouped = vec![Lanes([0.0; 4]); width];
    for (lane, row) in own.enumerate() {
        for (entry, value) in grouped.iter_mut().zip(&rows[row * width..]) {
            entry.0[lane] = *value;
        }
    }
    grouped
}
