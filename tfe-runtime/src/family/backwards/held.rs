//! What constraints have of parameters, backwards (T-160).

use super::Backwards;
use super::written::{Points, add_of_points, add_of_rows};
use crate::family::held::Weights;
use crate::family::model::Model;
use crate::lanes::Lanes;
use crate::scheme::Tables as _;
use alloc::vec;
use alloc::vec::Vec;
use core::ops::Range;

impl<M: Model> Backwards<'_, M> {
    /// Adds what constraints of an element have of parameters.
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
        // Both ends in one group.
        let (q, v) = &weights.end;
        let both = |start: &[f64], end: &[f64]| -> Vec<Points> {
            let pairs = start.iter().zip(end);
            pairs.map(|(a, b)| Lanes([*a, *b, *b, *b])).collect()
        };
        let of_both = |start: &[f64], end: &[f64]| -> Vec<Points> {
            let pairs = start.iter().zip(end);
            pairs.map(|(a, b)| Lanes([*a, *b, 0.0, 0.0])).collect()
        };
        let still = vec![0.0; m];
        let times = Lanes([start, end, end, end]);
        let q_of_both = both(&weights.start, q);
        let of_phi = of_both(&still, &weights.end_phi);
        let of_drift = of_both(&still, &weights.end_drift);
        let of_rows = of_both(&weights.start_rows, &weights.end_rows);
        let place = (times, &q_of_both[..]);
        let all = [&of_phi[..], &of_drift, &of_rows];
        add_of_rows(&mut self.tape, model, place, rows, all);
        let momentum = of_both(&vec![0.0; n], &weights.end_momentum);
        let zeros = vec![Lanes([0.0; 4]); n];
        let place = (times, &q_of_both[..], &both(v, v)[..]);
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
