//! Blocks of equations that are affine in what a model says at points, with first and second derivatives.
//!
//! With the variables s = (x, w) of a block, (q, z, u)_l = P_l s at its points and g = (momentum or velocity, force) there,
//!
//! ```text
//! c(s) = L s + Σ_l W_l g(P_l s) ,     f(s) = Σ_l w_l ℓ(P_l s) .
//! ```
//!
//! Derivatives of g and ℓ at a point are those of the kernels, evaluated with dual numbers over dual numbers; all else is linear.

use nalgebra::{DMatrix, DVector};
use tfe_runtime::dual::Dual;
use tfe_runtime::{Controlled, First, Form, MAX_INPUTS, Real};

/// Numbers with two directions: f, ∂f by one, ∂f by the other, and ∂²f by both.
type Twice = Dual<Dual>;

/// A point of a block.
#[derive(Clone, Debug)]
pub(super) struct Point {
    /// The time.
    pub(super) t: f64,
    /// w: what ℓ counts here.
    pub(super) weight: f64,
    /// P: (q, z, u) from s.
    pub(super) map: DMatrix<f64>,
    /// W: g to the rows of c.
    pub(super) into: DMatrix<f64>,
}

/// One block.
#[derive(Clone, Debug)]
pub(super) struct Block {
    /// How many of the variables are inside: x, for which the first rows of c are solved.
    pub(super) interior: usize,
    /// L.
    pub(super) linear: DMatrix<f64>,
    pub(super) points: Vec<Point>,
    /// The columns of the outputs whose sum is ℓ.
    pub(super) costs: Vec<usize>,
}

/// c and f, and what the model says at the points.
#[derive(Clone, Debug)]
pub(super) struct Values {
    pub(super) rows: DVector<f64>,
    pub(super) cost: f64,
    /// g, point by point.
    pub(super) said: Vec<DVector<f64>>,
}

/// A block about some s, for some multipliers of its rows.
#[derive(Clone, Debug)]
pub(super) struct Linear {
    pub(super) values: Values,
    /// ∂c/∂s.
    pub(super) jacobian: DMatrix<f64>,
    /// ∂f/∂s.
    pub(super) gradient: DVector<f64>,
    /// ∂²f/∂s².
    pub(super) of_cost: DMatrix<f64>,
    /// Σ multiplier ∂²c/∂s².
    pub(super) of_rows: DMatrix<f64>,
}

/// What a model says at one point, in any numbers: g, then ℓ.
fn said<M: Controlled<N>, R: Real, const N: usize>(
    model: &M,
    t: f64,
    arguments: &[R],
    costs: &[usize],
    columns: &mut Vec<R>,
    answer: &mut Vec<R>,
) {
    let zero = R::from_f64(0.0);
    let t = R::from_f64(t);
    let (q, rest) = arguments.split_at(N);
    let (z, u) = rest.split_at(N);
    let (q, z): ([R; N], [R; N]) = (std::array::from_fn(|a| q[a]), std::array::from_fn(|a| z[a]));
    let mut inputs = [zero; MAX_INPUTS];
    inputs[..u.len()].copy_from_slice(u);
    let mut first = First::zero();
    model.first_with(&inputs, t, &q, &z, &mut first);
    answer.clear();
    answer.extend_from_slice(&first.z);
    for a in 0..N {
        answer.push(match M::FORM {
            Form::Lagrangian => first.q[a] + first.force[a],
            Form::Hamiltonian => first.force[a] - first.q[a],
        });
    }
    let mut cost = zero;
    if !costs.is_empty() {
        columns.clear();
        columns.resize(model.columns(), zero);
        model.observables_with(&inputs, t, &q, &z, columns);
        for column in costs {
            cost += columns[*column];
        }
    }
    answer.push(cost);
}

impl Block {
    /// c and f at s.
    pub(super) fn values<M: Controlled<N>, const N: usize>(
        &self,
        model: &M,
        s: &DVector<f64>,
    ) -> Values {
        let mut values = Values {
            rows: &self.linear * s,
            cost: 0.0,
            said: Vec::with_capacity(self.points.len()),
        };
        let (mut columns, mut answer) = (Vec::new(), Vec::new());
        for point in &self.points {
            let arguments = &point.map * s;
            said(
                model,
                point.t,
                arguments.as_slice(),
                &self.costs,
                &mut columns,
                &mut answer,
            );
            let g = DVector::from_column_slice(&answer[..2 * N]);
            values.rows += &point.into * &g;
            values.cost += point.weight * answer[2 * N];
            values.said.push(g);
        }
        values
    }

    /// Everything at s, with the second derivatives of the rows summed with `multipliers`.
    pub(super) fn linearise<M: Controlled<N>, const N: usize>(
        &self,
        model: &M,
        s: &DVector<f64>,
        multipliers: &DVector<f64>,
    ) -> Linear {
        let variables = s.len();
        let mut linear = Linear {
            values: Values {
                rows: &self.linear * s,
                cost: 0.0,
                said: Vec::with_capacity(self.points.len()),
            },
            jacobian: self.linear.clone(),
            gradient: DVector::zeros(variables),
            of_cost: DMatrix::zeros(variables, variables),
            of_rows: DMatrix::zeros(variables, variables),
        };
        let (mut columns, mut answer) = (Vec::new(), Vec::new());
        for point in &self.points {
            let arguments = &point.map * s;
            let n = arguments.len();
            let weights = point.into.tr_mul(multipliers);
            let mut g = DVector::zeros(2 * N);
            let mut g_by = DMatrix::zeros(2 * N, n);
            let mut cost_by = DVector::zeros(n);
            let mut cost_second = DMatrix::zeros(n, n);
            let mut rows_second = DMatrix::zeros(n, n);
            let mut cost = 0.0;
            let unit = |k: usize, at: usize| f64::from(u8::from(k == at));
            for i in 0..n {
                for j in 0..=i {
                    let twice: Vec<Twice> = (arguments.iter().enumerate())
                        .map(|(k, value)| {
                            Twice::new(Dual::new(*value, unit(k, i)), Dual::new(unit(k, j), 0.0))
                        })
                        .collect();
                    said(
                        model,
                        point.t,
                        &twice,
                        &self.costs,
                        &mut columns,
                        &mut answer,
                    );
                    let mut second = 0.0;
                    for (component, number) in answer[..2 * N].iter().enumerate() {
                        g[component] = number.value.value;
                        g_by[(component, i)] = number.value.slope;
                        second += weights[component] * number.slope.slope;
                    }
                    let number = answer[2 * N];
                    cost = number.value.value;
                    cost_by[i] = number.value.slope;
                    for (row, column) in [(i, j), (j, i)] {
                        rows_second[(row, column)] = second;
                        cost_second[(row, column)] = number.slope.slope;
                    }
                }
            }
            linear.values.rows += &point.into * &g;
            linear.values.cost += point.weight * cost;
            linear.values.said.push(g);
            linear.jacobian += &point.into * g_by * &point.map;
            linear.gradient += point.weight * point.map.tr_mul(&cost_by);
            linear.of_cost += point.weight * point.map.tr_mul(&(cost_second * &point.map));
            linear.of_rows += point.map.tr_mul(&(rows_second * &point.map));
        }
        linear
    }
}
