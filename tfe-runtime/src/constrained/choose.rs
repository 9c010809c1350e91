//! Which rows are independent, in the units that the kinetic energy gives to coordinates where their lengths do not
//! tell.

use super::constrains::Constrains;
use super::node::is_regular;
use super::rows::{DEPENDENT, Rows, in_units, norm, scaled, subtract_part, unit};
use crate::model::{Constraint, Form};

/// Below it what a dependent row has of its own is rounding.
const NOISE: f64 = 1e-13;

/// A row left out counts as independent after all if its orthogonal part in units of inertia is larger than this,
/// relative to the row.
const CLEAR: f64 = 1e-6;

/// As [`Rows::choose`], but independent of units. Beside angles, the lengths of 1e-11 m in `x - r*cos(a)` and
/// `x - l*cos(b)` are so small that both rows seem to be equal. So if rows were left out whose orthogonal parts are
/// more than rounding errors, coordinates are measured in the square roots of their inertias.
///
/// Returns the units in which all marked rows are independent; ones unless more rows were found in other units.
pub(crate) fn choose<const N: usize>(
    rows: &mut Rows<'_, N>,
    model: &dyn Constrains<N>,
    (t, q): (f64, &[f64; N]),
    active: &mut [usize],
) -> [f64; N] {
    let plain = [1.0; N];
    let rank = rows.choose(model.declared(), active);
    match rank < active.len() && rows.has_left(active) {
        true => choose_more(rows, model, (t, q), active).unwrap_or(plain),
        false => plain,
    }
}

#[cold]
#[inline(never)]
fn choose_more<const N: usize>(
    rows: &mut Rows<'_, N>,
    model: &dyn Constrains<N>,
    (t, q): (f64, &[f64; N]),
    active: &mut [usize],
) -> Option<[f64; N]> {
    let zz = model.mass_at(t, q, &[0.0; N]);
    // Coordinates without an inertia of their own have no such unit.
    if !is_regular(zz) {
        return None;
    }
    let mut units = [0.0; N];
    for a in 0..N {
        let root = crate::real::Real::sqrt(zz[a][a].abs());
        units[a] = match model.form() {
            Form::Lagrangian => 1.0 / root,
            Form::Hamiltonian => root,
        };
    }
    if !units.iter().all(|unit| unit.is_finite() && *unit > 0.0) {
        return None;
    }
    let rank = |active: &[usize]| active.iter().filter(|mark| **mark != 0).count();
    let before = rank(active);
    rows.choose_in_units(model.declared(), &units, active);
    (rank(active) > before).then_some(units)
}

impl<const N: usize> Rows<'_, N> {
    /// Whether a row that was left out by the last choice has more of its own than roundings.
    fn has_left(&self, active: &[usize]) -> bool {
        let mut rows = self.spare.iter().zip(active);
        rows.any(|(row, mark)| *mark == 0 && norm(row) > NOISE)
    }

    /// Marks more rows, those that are independent of the marked ones beyond doubt.
    fn choose_in_units(&mut self, declared: &[Constraint], units: &[f64; N], active: &mut [usize]) {
        for (spare, row) in self.spare.iter_mut().zip(&*self.rows) {
            *spare = in_units(row, units);
            let length = norm(spare);
            *spare = if length > 0.0 {
                scaled(spare, length)
            } else {
                [0.0; N]
            };
        }
        // Marks: 0 left out, 1 chosen before, 2 taken away from the others.
        for (open, holonomic, least) in [
            (1, true, DEPENDENT),
            (1, false, DEPENDENT),
            (0, true, CLEAR),
            (0, false, CLEAR),
        ] {
            loop {
                let mut best = (least, None);
                for (c, constraint) in declared.iter().enumerate() {
                    let own = norm(&self.spare[c]);
                    let is_open = active[c] == open && constraint.kind.is_holonomic() == holonomic;
                    if is_open && own > best.0 {
                        best = (own, Some(c));
                    }
                }
                let Some(c) = best.1 else { break };
                active[c] = 2;
                let direction = unit(&self.spare[c]);
                for other in self.spare.iter_mut() {
                    subtract_part(other, &direction);
                }
            }
        }
        for mark in active.iter_mut() {
            *mark = usize::from(*mark != 0);
        }
    }
}
