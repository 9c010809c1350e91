//! The tangent of Newton's method for [rates](super::rates) and multipliers, by blocks.
//!
//! ```text
//! ∂r_i/∂ν_j = Σ_l P_il (L_vv E_lj + h L_vq C_lj) − h G_il (F_v E_lj + h F_q C_lj)
//! ∂r_i/∂m₀ = h A₀ᵀ ,     ∂r_i/∂m_k = h Σ_l G_il P_k′ A_lᵀ ,     and of the constraints   β_j A₁ ,     Σ_l b_l P_k′ C_lj A_l
//! ```

use super::blocked::{Blocked, Place};
use super::model::{Block, Gradient, Model};
use super::pattern::Pattern;
use super::point::Point;
use super::rows::Rows;
use crate::scheme::SchemeRef;
use alloc::vec;
use alloc::vec::Vec;

/// The role of a second derivative, which determines its weights.
#[derive(Clone, Copy, Debug)]
enum Role {
    /// L_vv
    Mass,
    /// L_vq
    Turn,
    /// F_v
    Damping,
    /// F_q
    Stiffness,
}

/// The places in the tangent of all second derivatives.
#[derive(Clone, Debug)]
pub(super) struct Parts {
    second: Pattern,
    bends: Pattern,
    /// (number of the derivative, role, place)
    parts: Vec<(usize, Role, Place)>,
    bend_places: Vec<Place>,
    /// The places of A and of Aᵀ.
    row_places: Vec<(Place, Place)>,
    values: Vec<f64>,
    bend_values: Vec<f64>,
    gradient: [Vec<f64>; 3],
}

/// The element at its present rates.
pub(super) struct Element<'a> {
    pub(super) scheme: &'a SchemeRef<'a>,
    pub(super) t: f64,
    pub(super) h: f64,
    pub(super) points: &'a [Point],
    pub(super) start_rows: &'a [f64],
    pub(super) end_rows: &'a [f64],
}

impl Parts {
    /// Finds all places; `None` where memory does not suffice.
    pub(super) fn new<M: Model>(model: &M, rows: &Rows, block: usize) -> Option<(Self, Blocked)> {
        Self::of(
            Pattern::of(model),
            Pattern::of_bends(model),
            rows,
            (model.len(), block),
        )
    }

    fn of(
        second: Pattern,
        bends: Pattern,
        rows: &Rows,
        (n, block): (usize, usize),
    ) -> Option<(Self, Blocked)> {
        let m = rows.phi.len();
        let entries: Vec<(usize, Role, usize, usize)> = second
            .places()
            .iter()
            .enumerate()
            .flat_map(|(number, (kind, row, column))| {
                let (row, column) = (*row, *column);
                let (first, mirrored) = match kind {
                    Block::ZZ => (Role::Mass, None),
                    // L_vq appears in d/dt L_v, and its transpose in L_q.
                    Block::ZQ => (Role::Turn, Some((number, Role::Damping, column, row))),
                    Block::ForceZ => (Role::Damping, None),
                    _ => (Role::Stiffness, None),
                };
                [Some((number, first, row, column)), mirrored]
            })
            .flatten()
            .collect();
        let bent = || {
            bends
                .places()
                .iter()
                .map(|(_, row, column)| (*row, *column))
        };
        let borders = rows.places().flat_map(|(c, a)| [(n + c, a), (a, n + c)]);
        let places = entries.iter().map(|(_, _, row, column)| (*row, *column));
        let places: Vec<(usize, usize)> = places.chain(bent()).chain(borders).collect();
        let matrix = Blocked::new(n + m, block, &places)?.bordered(n);
        let parts = entries
            .iter()
            .map(|(number, role, row, column)| (*number, *role, matrix.place(*row, *column)))
            .collect();
        let bend_places = bent()
            .map(|(row, column)| matrix.place(row, column))
            .collect();
        let row_places = rows
            .places()
            .map(|(c, a)| (matrix.place(n + c, a), matrix.place(a, n + c)))
            .collect();
        let parts = Self {
            values: vec![0.0; second.places().len()],
            bend_values: vec![0.0; bends.places().len()],
            second,
            bends,
            parts,
            bend_places,
            row_places,
            gradient: [vec![0.0; n], vec![0.0; n], vec![0.0; n]],
        };
        Some((parts, matrix))
    }

    /// Fills the matrix.
    pub(super) fn fill<M: Model>(
        &mut self,
        model: &M,
        element: &Element<'_>,
        matrix: &mut Blocked,
    ) {
        matrix.values.fill(0.0);
        for l in 0..element.points.len() {
            self.add_motion(model, element, l, &mut matrix.values);
            self.add_rows(element, l, &mut matrix.values);
        }
        self.add_ends(element, &mut matrix.values);
    }

    /// Adds the second derivatives at one point.
    fn add_motion<M: Model>(
        &mut self,
        model: &M,
        element: &Element<'_>,
        l: usize,
        values: &mut [f64],
    ) {
        let Element { scheme, t, h, .. } = *element;
        let point = &element.points[l];
        let time = t + h * scheme.nodes[l];
        let [z, q, force] = &mut self.gradient;
        let mut entries = self.second.scatter(&mut self.values);
        let first = Gradient { z, q, force };
        model.second(time, &point.q, &point.v, first, &mut entries);
        let weights = |role: Role| weights(scheme, h, l, role);
        let all = [
            weights(Role::Mass),
            weights(Role::Turn),
            weights(Role::Damping),
            weights(Role::Stiffness),
        ];
        let block = scheme.unknowns();
        for (number, role, place) in &self.parts {
            let value = self.values[*number];
            if value != 0.0 {
                add(values, *place, block, &all[*role as usize], value);
            }
        }
        if !self.bend_places.is_empty() {
            let mut entries = self.bends.scatter(&mut self.bend_values);
            model.constraint_second(time, &point.q, &point.mu_rate, &mut entries);
            for (place, value) in self.bend_places.iter().zip(&self.bend_values) {
                add(
                    values,
                    *place,
                    block,
                    &all[Role::Stiffness as usize],
                    -value,
                );
            }
        }
    }

    /// Adds the constraints at one point.
    fn add_rows(&self, element: &Element<'_>, l: usize, values: &mut [f64]) {
        let Element { scheme, h, .. } = *element;
        let (points, block) = (scheme.points(), scheme.unknowns());
        let point = &element.points[l];
        for ((row, transposed), value) in self.row_places.iter().zip(&point.rows) {
            for k in 1..block {
                for i in 0..block {
                    let force = h * scheme.force[i * points + l] * point.slopes[k];
                    values[transposed.first + k * transposed.stride + i] += force * value;
                    let position =
                        scheme.weights[l] * point.slopes[k] * scheme.position[l * block + i];
                    values[row.first + i * row.stride + k] += position * value;
                }
            }
        }
    }

    /// Adds the constraints at both ends.
    fn add_ends(&self, element: &Element<'_>, values: &mut [f64]) {
        let block = element.scheme.unknowns();
        let places = self.row_places.iter();
        let both = element.start_rows.iter().zip(element.end_rows);
        for ((row, transposed), (start, end)) in places.zip(both) {
            for i in 0..block {
                values[transposed.first + i] += element.h * start;
                values[row.first + i * row.stride] += element.scheme.advance[i] * end;
            }
        }
    }
}

/// The weights of a derivative at point l in a block, row by row.
fn weights(scheme: &SchemeRef<'_>, h: f64, l: usize, role: Role) -> Vec<f64> {
    let (points, block) = (scheme.points(), scheme.unknowns());
    let mut weights = Vec::with_capacity(block * block);
    for i in 0..block {
        for j in 0..block {
            let row = match role {
                Role::Mass | Role::Turn => scheme.momentum[i * points + l],
                Role::Damping | Role::Stiffness => -h * scheme.force[i * points + l],
            };
            let column = match role {
                Role::Mass | Role::Damping => scheme.velocity[l * block + j],
                Role::Turn | Role::Stiffness => h * scheme.position[l * block + j],
            };
            weights.push(row * column);
        }
    }
    weights
}

/// Adds value · weights to a block.
fn add(values: &mut [f64], place: Place, block: usize, weights: &[f64], value: f64) {
    for i in 0..block {
        for j in 0..block {
            values[place.first + j * place.stride + i] += weights[i * block + j] * value;
        }
    }
}
