//! The computation of the tables of an element: the weak form is solved in twice the working precision.

use crate::basis::{MAX_NODES, MAX_RATES, exact_integrals, exact_legendre};
use crate::double_double::DoubleDouble;
use crate::element::{Element, Spaces};
use crate::quadrature::{MAX_POINTS, Quadrature};

/// The memory into which the tables are written; the same parts as in [`SchemeRef`].
pub(crate) struct Target<'a> {
    pub(crate) nodes: &'a mut [f64],
    pub(crate) weights: &'a mut [f64],
    pub(crate) weights_low: &'a mut [f64],
    pub(crate) unknown_nodes: &'a mut [f64],
    pub(crate) velocity: &'a mut [f64],
    pub(crate) position: &'a mut [f64],
    pub(crate) position_low: &'a mut [f64],
    pub(crate) momentum: &'a mut [f64],
    pub(crate) force: &'a mut [f64],
    pub(crate) force_low: &'a mut [f64],
    pub(crate) advance: &'a mut [f64],
    pub(crate) advance_low: &'a mut [f64],
    pub(crate) impulse: &'a mut [f64],
    pub(crate) rate: &'a mut [f64],
    pub(crate) force_rate: &'a mut [f64],
}

/// The values of P_0 … P_{n−1} at one place.
type Values = [DoubleDouble; MAX_NODES];
const NO_VALUES: Values = [DoubleDouble::ZERO; MAX_NODES];

impl Target<'_> {
    /// Computes all tables; the slices have the lengths that the element requires.
    pub(crate) const fn fill(&mut self, element: Element) {
        let rule = element.quadrature_rule();
        let (k, s) = (element.points(), element.degree());
        let mut l = 0;
        while l < k {
            self.nodes[l] = rule.node(l);
            self.weights[l] = rule.weight(l);
            self.weights_low[l] = rule.weight_correction(l);
            l += 1;
        }
        project(&rule, s, self.force_rate);
        if element.family().is_by_displacements() {
            self.primal(element, &rule);
        } else {
            self.two_field(element, &rule);
        }
    }

    /// The tables of a two-field family: the stages follow from the weak form.
    const fn two_field(&mut self, element: Element, rule: &Quadrature) {
        let k = element.points();
        let weak = element.family().spaces(element.degree());
        let inverse = weak.inverse();
        let mut l = 0;
        while l < k {
            self.unknown_nodes[l] = rule.node(l);
            self.velocity[l * k + l] = 1.0;
            self.momentum[l * k + l] = 1.0;
            self.advance[l] = rule.weight(l);
            self.advance_low[l] = rule.weight_correction(l);
            l += 1;
        }
        let mut stage = 0;
        while stage < k {
            let mut trial = NO_VALUES;
            exact_legendre(rule.exact_node(stage), &mut trial);
            // ω_stage(τ) = −Σ_i z_i P_i(τ) with z = (row of trial values) · inverse.
            let mut omega = NO_VALUES;
            let mut i = 0;
            while i < weak.tests {
                let mut sum = DoubleDouble::ZERO;
                let mut j = 0;
                while j < weak.trials {
                    sum = sum.plus(trial[j].times(inverse[j][i]));
                    j += 1;
                }
                omega[i] = sum.negated();
                self.impulse[stage * MAX_NODES + i] = omega[i].high;
                i += 1;
            }
            let mut l = 0;
            while l < k {
                let mut test = NO_VALUES;
                exact_legendre(rule.exact_node(l), &mut test);
                let mut sum = DoubleDouble::ZERO;
                let mut i = 0;
                while i < weak.tests {
                    sum = sum.plus(omega[i].times(test[i]));
                    i += 1;
                }
                let entry = sum.times(rule.exact_weight(l));
                self.position[stage * k + l] = entry.high;
                self.position_low[stage * k + l] = entry.low;
                self.force[stage * k + l] = entry.high;
                self.force_low[stage * k + l] = entry.low;
                l += 1;
            }
            stage += 1;
        }
        project(rule, element.degree(), self.rate);
    }

    /// The tables of a primal element: rates at the Gauss points, compatible coordinates.
    const fn primal(&mut self, element: Element, rule: &Quadrature) {
        let (k, s) = (element.points(), element.degree());
        let gauss = Quadrature::gauss(s);
        project(&gauss, s, self.rate);
        let collocated = element.is_collocated();
        let mut j = 0;
        while j < s {
            let beta = gauss.exact_weight(j);
            self.unknown_nodes[j] = gauss.node(j);
            self.advance[j] = beta.high;
            self.advance_low[j] = beta.low;
            // ψ_j = Σ_m (2m + 1) β_j P_m(g_j) P_m: exact, the products are of degree 2s − 2.
            let mut psi = NO_VALUES;
            exact_legendre(gauss.exact_node(j), &mut psi);
            let mut m = 0;
            while m < s {
                psi[m] = psi[m].times(beta).times(DoubleDouble::integer(2 * m + 1));
                m += 1;
            }
            self.primal_impulse(j, s, &psi, beta);
            let mut l = 0;
            while l < k {
                let mut values = NO_VALUES;
                exact_legendre(rule.exact_node(l), &mut values);
                let mut integrals = [DoubleDouble::ZERO; MAX_RATES];
                exact_integrals(&values, &mut integrals);
                let (mut value, mut integral) = (DoubleDouble::ZERO, DoubleDouble::ZERO);
                let mut m = 0;
                while m < s {
                    value = value.plus(psi[m].times(values[m]));
                    integral = integral.plus(psi[m].times(integrals[m]));
                    m += 1;
                }
                if collocated {
                    // At the same points it is a unit matrix, without rounding errors.
                    value = DoubleDouble::integer(if l == j { 1 } else { 0 });
                }
                let weight = rule.exact_weight(l);
                let momentum = weight.times(value).over(beta);
                let force = weight.times(DoubleDouble::ONE.minus(integral.over(beta)));
                self.velocity[l * s + j] = value.high;
                self.position[l * s + j] = integral.high;
                self.position_low[l * s + j] = integral.low;
                self.momentum[j * k + l] = momentum.high;
                self.force[j * k + l] = force.high;
                self.force_low[j * k + l] = force.low;
                l += 1;
            }
            j += 1;
        }
    }

    /// ω_i(τ) = 1 − ∫₀^τ ψ_i / β_i, in Legendre coefficients.
    const fn primal_impulse(&mut self, i: usize, s: usize, psi: &Values, beta: DoubleDouble) {
        let mut omega = NO_VALUES;
        omega[0] = DoubleDouble::ONE;
        let mut m = 0;
        while m < s {
            // ∫ P_m = (P_{m+1} − P_{m−1})/(2(2m + 1)), and −P_{−1} = P_0.
            let part = psi[m]
                .over(beta)
                .over(DoubleDouble::integer(2 * (2 * m + 1)));
            omega[m + 1] = omega[m + 1].minus(part);
            if m == 0 {
                omega[0] = omega[0].minus(part);
            } else {
                omega[m - 1] = omega[m - 1].plus(part);
            }
            m += 1;
        }
        let mut m = 0;
        while m <= s {
            self.impulse[i * MAX_NODES + m] = omega[m].high;
            m += 1;
        }
    }
}

/// The matrix from values at the points of `rule` to the Legendre coefficients of their projection on degree s − 1.
///
/// Where the rule has s points that is interpolation, since its products are integrated exactly.
const fn project(rule: &Quadrature, s: usize, matrix: &mut [f64]) {
    let k = rule.len();
    let mut l = 0;
    while l < k {
        let mut values = NO_VALUES;
        exact_legendre(rule.exact_node(l), &mut values);
        let mut m = 0;
        while m < s {
            let entry = values[m].times(rule.exact_weight(l));
            matrix[m * k + l] = entry.times(DoubleDouble::integer(2 * m + 1)).high;
            m += 1;
        }
        l += 1;
    }
}

const MAX_ROWS: usize = MAX_NODES + 1;
type Square = [[DoubleDouble; MAX_ROWS]; MAX_ROWS];

impl Spaces {
    /// The inverse of the matrix of the weak form: unknowns are the trial coefficients and, with a
    /// right jump, y₁; rows are the test polynomials and, without a left jump, y(0) = y₀.
    ///
    /// Its entries are integers, as ∫ P_j P_i' dτ = 2 for j < i with i − j odd, else 0.
    const fn inverse(&self) -> Square {
        let mut matrix = [[DoubleDouble::ZERO; MAX_ROWS]; MAX_ROWS];
        let size = self.tests + if self.left_jump { 0 } else { 1 };
        let mut i = 0;
        while i < self.tests {
            let mut j = 0;
            while j < self.trials {
                let inertia = if j < i && (i - j) % 2 == 1 { 2.0 } else { 0.0 };
                let trace = if self.right_jump { 0.0 } else { 1.0 };
                matrix[i][j] = DoubleDouble::new(inertia - trace);
                j += 1;
            }
            if self.right_jump {
                matrix[i][self.trials] = DoubleDouble::new(-1.0);
            }
            i += 1;
        }
        if !self.left_jump {
            let mut j = 0;
            while j < self.trials {
                // P_j at the start
                matrix[self.tests][j] = DoubleDouble::new(if j % 2 == 0 { 1.0 } else { -1.0 });
                j += 1;
            }
        }
        invert(matrix, size)
    }
}

/// Gauss–Jordan elimination with partial pivoting; the matrices of all families are regular.
const fn invert(mut matrix: Square, size: usize) -> Square {
    let mut inverse = [[DoubleDouble::ZERO; MAX_ROWS]; MAX_ROWS];
    let mut i = 0;
    while i < size {
        inverse[i][i] = DoubleDouble::ONE;
        i += 1;
    }
    let mut column = 0;
    while column < size {
        let mut pivot = column;
        let mut row = column + 1;
        while row < size {
            if matrix[row][column].magnitude() > matrix[pivot][column].magnitude() {
                pivot = row;
            }
            row += 1;
        }
        let (a, b) = (matrix[pivot], inverse[pivot]);
        matrix[pivot] = matrix[column];
        inverse[pivot] = inverse[column];
        matrix[column] = a;
        inverse[column] = b;
        let scale = DoubleDouble::ONE.over(matrix[column][column]);
        let mut j = 0;
        while j < size {
            matrix[column][j] = matrix[column][j].times(scale);
            inverse[column][j] = inverse[column][j].times(scale);
            j += 1;
        }
        let mut row = 0;
        while row < size {
            let factor = matrix[row][column];
            if row != column && factor.magnitude() != 0.0 {
                let mut j = 0;
                while j < size {
                    matrix[row][j] = matrix[row][j].minus(factor.times(matrix[column][j]));
                    inverse[row][j] = inverse[row][j].minus(factor.times(inverse[column][j]));
                    j += 1;
                }
            }
            row += 1;
        }
        column += 1;
    }
    inverse
}

const _: () = assert!(MAX_POINTS >= 2 * MAX_NODES, "the default rules fit");
