//! The tables of an element, with their rows in groups of four points.

use crate::basis::{MAX_NODES, MAX_RATES, exact_integrals, exact_legendre};
use crate::double_double::DoubleDouble;
use crate::element::Element;
use crate::method::{continued_ratio, set_extrapolation_at_points};
use crate::registers::storage::{
    Array, Fixed, Inline, Lines, MAX_GROUPS, Matrix, Projection, Storage, Weights,
};
use crate::scheme::{self, Scheme, SchemeRef};

/// Sets the columns of a matrix that is given row by row.
const fn set_columns(points: usize, row_by_row: &[f64], columns: &mut [[f64; 4]]) {
    let groups = points.div_ceil(4);
    let mut j = 0;
    while j < points {
        let mut i = 0;
        while i < 4 * groups {
            let row = if i < points { i } else { points - 1 };
            columns[j * groups + i / 4][i % 4] = row_by_row[row * points + j];
            i += 1;
        }
        j += 1;
    }
}

const fn set_weights(high: &[f64], low: &[f64], groups: &mut [[[f64; 4]; 2]]) {
    let mut l = 0;
    while l < high.len() {
        groups[l / 4][0][l % 4] = high[l];
        groups[l / 4][1][l % 4] = low[l];
        l += 1;
    }
}

/// The memory for these tables.
pub(super) struct Target<'a> {
    pub(super) nodes: &'a mut [[f64; 4]],
    pub(super) reach: &'a mut [[f64; 4]],
    pub(super) reach_low: &'a mut [[f64; 4]],
    pub(super) once: &'a mut [[f64; 4]],
    pub(super) once_low: &'a mut [[f64; 4]],
    pub(super) twice: &'a mut [[f64; 4]],
    pub(super) twice_low: &'a mut [[f64; 4]],
    pub(super) weights: &'a mut [[[f64; 4]; 2]],
    pub(super) lever: &'a mut [[[f64; 4]; 2]],
    pub(super) continued: &'a mut [[f64; 4]],
    pub(super) projection: Option<ProjectionTarget<'a>>,
}

/// The memory for those of a projection.
pub(super) struct ProjectionTarget<'a> {
    pub(super) position: &'a mut [[f64; 4]],
    pub(super) position_low: &'a mut [[f64; 4]],
    pub(super) onto_rates: &'a mut [[f64; 4]],
}

/// The largest number of points.
const MAX_POINTS: usize = 4 * MAX_GROUPS;

type Square = [[DoubleDouble; MAX_POINTS]; MAX_POINTS];
const NO_SQUARE: Square = [[DoubleDouble::ZERO; MAX_POINTS]; MAX_POINTS];

/// The matrices by which an element integrates values at its points, in twice the working precision.
struct Integration {
    points: usize,
    /// From rates to coordinates: C P.
    position: Square,
    /// From rates of momenta to momenta: E G.
    momentum: Square,
    /// From values to the nearest rates: E P; empty if that is the unit matrix.
    onto_rates: Square,
}

impl Integration {
    const fn of(scheme: &SchemeRef<'_>) -> Self {
        let points = scheme.nodes.len();
        let mut new = Self {
            points,
            position: NO_SQUARE,
            momentum: NO_SQUARE,
            onto_rates: NO_SQUARE,
        };
        if !scheme.collocated {
            new.project(&scheme.element);
            return new;
        }
        let mut i = 0;
        while i < points {
            let mut j = 0;
            while j < points {
                new.position[i][j] = DoubleDouble {
                    high: scheme.position[i * points + j],
                    low: scheme.position_low[i * points + j],
                };
                j += 1;
            }
            i += 1;
        }
        new.momentum = new.position;
        new
    }

    /// The matrices for rates of degree s − 1 at more than s points. By way of the Legendre coefficients, (2m + 1) Σ_l
    /// b_l P_m(c_l) v_l, the matrices of the scheme are not needed.
    const fn project(&mut self, element: &Element) {
        let (rule, rates) = (element.quadrature_rule(), element.degree());
        let mut values = [[DoubleDouble::ZERO; MAX_NODES]; MAX_POINTS];
        let mut integrals = [[DoubleDouble::ZERO; MAX_RATES]; MAX_POINTS];
        let mut l = 0;
        while l < self.points {
            exact_legendre(rule.exact_node(l), &mut values[l]);
            exact_integrals(&values[l], &mut integrals[l]);
            l += 1;
        }
        let mut k = 0;
        while k < self.points {
            let mut l = 0;
            while l < self.points {
                let (mut onto, mut position) = (DoubleDouble::ZERO, DoubleDouble::ZERO);
                let (mut momentum, mut m) = (DoubleDouble::ONE, 0);
                while m < rates {
                    let factor = DoubleDouble::integer(2 * m + 1);
                    let here = factor.times(values[k][m]);
                    let there = factor.times(values[l][m]);
                    onto = onto.plus(here.times(values[l][m]));
                    position = position.plus(integrals[k][m].times(there));
                    momentum = momentum.minus(here.times(integrals[l][m]));
                    m += 1;
                }
                let weight = rule.exact_weight(l);
                self.onto_rates[k][l] = weight.times(onto);
                self.position[k][l] = weight.times(position);
                self.momentum[k][l] = weight.times(momentum);
                l += 1;
            }
            k += 1;
        }
    }

    /// C G: the double integral of accelerations.
    const fn twice(&self) -> Square {
        let mut product = NO_SQUARE;
        let mut i = 0;
        while i < self.points {
            let mut j = 0;
            while j < self.points {
                let (mut sum, mut k) = (DoubleDouble::ZERO, 0);
                while k < self.points {
                    sum = sum.plus(self.position[i][k].times(self.momentum[k][j]));
                    k += 1;
                }
                product[i][j] = sum;
                j += 1;
            }
            i += 1;
        }
        product
    }

    /// Writes a matrix, and its rounding error if that is requested.
    const fn write(&self, matrix: &Square, high: &mut [[f64; 4]], low: Option<&mut [[f64; 4]]>) {
        let mut rows = [[0.0; MAX_POINTS * MAX_POINTS]; 2];
        let mut i = 0;
        while i < self.points {
            let mut j = 0;
            while j < self.points {
                rows[0][i * self.points + j] = matrix[i][j].high;
                rows[1][i * self.points + j] = matrix[i][j].low;
                j += 1;
            }
            i += 1;
        }
        set_columns(self.points, &rows[0], high);
        if let Some(low) = low {
            set_columns(self.points, &rows[1], low);
        }
    }
}

impl Target<'_> {
    pub(super) const fn fill(&mut self, scheme: &SchemeRef<'_>) {
        let points = scheme.nodes.len();
        let integration = Integration::of(scheme);
        integration.write(&integration.twice(), self.twice, Some(&mut *self.twice_low));
        integration.write(&integration.momentum, self.once, Some(&mut *self.once_low));
        if let Some(to) = &mut self.projection {
            let low = Some(&mut *to.position_low);
            integration.write(&integration.position, to.position, low);
            integration.write(&integration.onto_rates, to.onto_rates, None);
        }
        let mut matrix = [0.0; MAX_POINTS * MAX_POINTS];
        // Most steps are as long as the one before.
        set_extrapolation_at_points(scheme, 1.0, &mut matrix);
        set_columns(points, &matrix, self.continued);
        set_weights(scheme.weights, scheme.weights_low, self.weights);
        let (mut lever, mut lever_low) = ([0.0; MAX_POINTS], [0.0; MAX_POINTS]);
        let mut j = 0;
        while j < points {
            let (mut sum, mut k) = (DoubleDouble::ZERO, 0);
            while k < points {
                let weight = DoubleDouble {
                    high: scheme.weights[k],
                    low: scheme.weights_low[k],
                };
                sum = sum.plus(weight.times(integration.momentum[k][j]));
                k += 1;
            }
            (lever[j], lever_low[j]) = (sum.high, sum.low);
            j += 1;
        }
        let (lever, lever_low) = (lever.split_at(points).0, lever_low.split_at(points).0);
        set_weights(lever, lever_low, self.lever);
        let mut i = 0;
        while i < 4 * self.nodes.len() {
            let l = if i < points { i } else { points - 1 };
            let (mut sum, mut j) = (DoubleDouble::ZERO, 0);
            while j < points {
                sum = sum.plus(integration.position[l][j]);
                j += 1;
            }
            self.nodes[i / 4][i % 4] = scheme.nodes[l];
            self.reach[i / 4][i % 4] = sum.high;
            self.reach_low[i / 4][i % 4] = sum.low;
            i += 1;
        }
    }
}

impl<
    const K: usize,
    const C: usize,
    const FIRST: usize,
    const VARYING: usize,
    const SQUARE: usize,
    const KEPT: usize,
    const PROJECTED: usize,
> Fixed<Inline<K, C, FIRST, VARYING, SQUARE, KEPT, PROJECTED>>
{
    const NO_PROJECTION: Projection<Inline<K, C, FIRST, VARYING, SQUARE, KEPT, PROJECTED>> =
        Projection {
            position: Matrix::of([[[0.0; 4]; C]; K]),
            position_low: Matrix::of([[[0.0; 4]; C]; K]),
            onto_rates: Matrix::of([[[0.0; 4]; C]; K]),
        };

    /// The tables of an element with K points; without use where K is zero.
    #[must_use]
    pub const fn new<const POINTS: usize, const U: usize>(scheme: &Scheme<POINTS, U>) -> Self {
        let (table, row) = ([[[0.0; 4]; C]; K], [[0.0; 4]; C]);
        let (mut nodes, mut reach, mut reach_low) = (row, row, row);
        let (mut once, mut once_low) = (table, table);
        let (mut twice, mut twice_low, mut continued) = (table, table, table);
        let (mut weights, mut lever) = ([[[0.0; 4]; 2]; C], [[[0.0; 4]; 2]; C]);
        let mut projected = [Self::NO_PROJECTION; PROJECTED];
        if K > 0 {
            let mut target = Target {
                nodes: &mut nodes,
                reach: &mut reach,
                reach_low: &mut reach_low,
                once: once.as_flattened_mut(),
                once_low: once_low.as_flattened_mut(),
                twice: twice.as_flattened_mut(),
                twice_low: twice_low.as_flattened_mut(),
                weights: &mut weights,
                lever: &mut lever,
                continued: continued.as_flattened_mut(),
                projection: match projected.first_mut() {
                    Some(one) => Some(ProjectionTarget {
                        position: one.position.columns.0.as_flattened_mut(),
                        position_low: one.position_low.columns.0.as_flattened_mut(),
                        onto_rates: one.onto_rates.columns.0.as_flattened_mut(),
                    }),
                    None => None,
                },
            };
            target.fill(&scheme.as_view());
        }
        Self {
            points: K,
            groups: C,
            nodes: Array(nodes),
            reach: Array(reach),
            reach_low: Array(reach_low),
            once: Matrix::of(once),
            once_low: Matrix::of(once_low),
            twice: Matrix::of(twice),
            twice_low: Matrix::of(twice_low),
            weights: Weights(Array(weights)),
            lever: Weights(Array(lever)),
            projected: Array(projected),
            continued: Matrix::of(continued),
        }
    }
}

impl<
    const K: usize,
    const C: usize,
    const FIRST: usize,
    const VARYING: usize,
    const SQUARE: usize,
    const KEPT: usize,
    const PROJECTED: usize,
> Matrix<Inline<K, C, FIRST, VARYING, SQUARE, KEPT, PROJECTED>>
{
    const fn of(columns: [[[f64; 4]; C]; K]) -> Self {
        Self {
            #[cfg(feature = "alloc")]
            groups: C,
            columns: Lines(columns),
        }
    }
}

/// All tables of an element, and the extrapolation matrix from the last element.
#[derive(Clone, Debug)]
pub struct Tables<S: Storage> {
    fixed: S::Fixed,
    /// The extrapolation matrix for steps of the ratio in the next field; that for ratio one is among the fixed tables.
    other: Option<Matrix<S>>,
    ratio: f64,
}

impl<S: Storage> Tables<S> {
    pub(crate) fn new(fixed: S::Fixed) -> Self {
        Self {
            fixed,
            other: None,
            ratio: 1.0,
        }
    }

    /// The extrapolation matrix from the last element to this one.
    #[inline(always)]
    pub(crate) fn continued(&self) -> &Matrix<S> {
        self.other.as_ref().unwrap_or(&self.fixed.continued)
    }

    /// Makes `continued` the matrix for a step of length `h` after one of length `last`.
    #[inline(always)]
    pub(crate) fn continue_with(&mut self, scheme: &impl scheme::Tables, h: f64, last: f64) {
        // Usually no division is needed.
        if h != last || self.ratio != 1.0 {
            self.set_ratio(scheme, h / last);
        }
    }

    /// Makes `continued` the matrix for steps of this ratio.
    #[inline]
    pub(crate) fn set_ratio(&mut self, scheme: &impl scheme::Tables, ratio: f64) {
        // Far outside the last element its polynomial is useless; backwards in time it may be reused.
        let ratio = continued_ratio(ratio);
        if self.ratio != ratio {
            self.continue_by(&scheme.view(), ratio);
        }
    }

    #[cold]
    fn continue_by(&mut self, scheme: &SchemeRef<'_>, ratio: f64) {
        let mut matrix = [0.0; MAX_POINTS * MAX_POINTS];
        set_extrapolation_at_points(scheme, ratio, &mut matrix);
        let empty = || self.fixed.continued.clone();
        let other = self.other.get_or_insert_with(empty);
        set_columns(self.fixed.points, &matrix, &mut other.columns);
        self.ratio = ratio;
    }
}

impl<S: Storage> core::ops::Deref for Tables<S> {
    type Target = Fixed<S>;
    #[inline(always)]
    fn deref(&self) -> &Fixed<S> {
        &self.fixed
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Element;
    use crate::scheme::{SchemeTable, Tables as _};

    /// b_i a_ij + b_j ā_ji = b_i b_j, a of momenta and ā of coordinates: no drift comes from the tables.
    #[test]
    fn coefficients_are_symplectic_beyond_double_precision() {
        for nodes in 2..=12 {
            for element in [
                Element::mixed(nodes),
                Element::primal(nodes),
                Element::primal(nodes).lobatto(),
                Element::primal(nodes).quadrature(nodes + 3),
            ] {
                let table = SchemeTable::new(element).unwrap();
                let scheme = table.view();
                let integration = Integration::of(&scheme);
                let b = |i: usize| DoubleDouble {
                    high: scheme.weights[i],
                    low: scheme.weights_low[i],
                };
                for i in 0..scheme.points() {
                    for j in 0..scheme.points() {
                        let momentum = b(i).times(integration.momentum[i][j]);
                        let position = b(j).times(integration.position[j][i]);
                        let sum = momentum.plus(position);
                        let defect = sum.minus(b(i).times(b(j))).magnitude();
                        // The last digits of double-double numbers below one.
                        assert!(defect < 1e-31, "{element}: {defect:.1e}");
                    }
                }
            }
        }
    }

    /// The matrices of the scheme, multiplied.
    #[test]
    fn projections_are_products_of_the_matrices_of_the_scheme() {
        for element in [
            Element::primal(2).lobatto(),
            Element::primal(5),
            Element::primal(9).quadrature(16),
        ] {
            let table = SchemeTable::new(element).unwrap();
            let scheme = table.view();
            let (points, unknowns) = (scheme.points(), scheme.unknowns());
            let integration = Integration::of(&scheme);
            for (matrix, left, right) in [
                (&integration.position, scheme.position, scheme.momentum),
                (&integration.momentum, scheme.velocity, scheme.force),
                (&integration.onto_rates, scheme.velocity, scheme.momentum),
            ] {
                for i in 0..points {
                    for j in 0..points {
                        let terms =
                            (0..unknowns).map(|k| left[i * unknowns + k] * right[k * points + j]);
                        let expected: f64 = terms.sum();
                        // Rounded factors of some units.
                        let error = (matrix[i][j].high - expected).abs();
                        assert!(error < 1e-14, "{element}: {error:.1e}");
                    }
                }
            }
        }
    }
}
