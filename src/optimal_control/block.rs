//! Blocks of equations that are affine in the model functions at quadrature points, with first and second derivatives.
//!
//! With the variables s = (x, w) of a block, (q, z, u)_l = P_l s at its points and g = (momentum or velocity, force)
//! there,
//!
//! ```text
//! c(s) = L s + Σ_l W_l g(P_l s) ,     f(s) = Σ_l w_l ℓ(P_l s) .
//! ```
//!
//! Derivatives of g and ℓ at a point are computed by the kernels of the model with dual numbers of dual numbers;
//! everything else is linear.

use nalgebra::{DMatrix, DVector};
use tfe_runtime::dual::Dual;
use tfe_runtime::{Controlled, First, Form, MAX_INPUTS, Real};

/// Numbers with derivatives in two directions: f, both first derivatives, and the mixed second derivative.
type HyperDual = Dual<Dual>;

/// A quadrature point of a block.
#[derive(Clone, Debug)]
pub(super) struct Point {
    /// The time.
    pub(super) t: f64,
    /// The weight w_l of ℓ.
    pub(super) weight: f64,
    /// The matrix P_l, which maps s to (q, z, u).
    pub(super) map: DMatrix<f64>,
    /// The matrix W_l, which maps g to the rows of c.
    pub(super) into: DMatrix<f64>,
}

/// A block of equations.
#[derive(Clone, Debug)]
pub(super) struct Block {
    /// The number of interior variables x, for which the first rows of c are solved.
    pub(super) interior: usize,
    /// The matrix L.
    pub(super) linear: DMatrix<f64>,
    pub(super) points: Vec<Point>,
    /// The columns of the outputs whose sum is ℓ.
    pub(super) costs: Vec<usize>,
}

/// c and f, and the model functions at the points.
#[derive(Clone, Debug)]
pub(super) struct Values {
    pub(super) rows: DVector<f64>,
    pub(super) cost: f64,
    /// g at each point.
    pub(super) said: Vec<DVector<f64>>,
}

/// A block linearised about s, for given multipliers of its rows.
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

/// The functions of a model at a point: g, then the sum ℓ of the outputs in the columns `costs`.
///
/// The search uses only this interface, so that it is compiled only once for all models.
pub(super) trait PointFunctions {
    /// Evaluates them in `f64`.
    fn numbers(&self, t: f64, arguments: &[f64], costs: &[usize], answer: &mut Vec<f64>);

    /// Evaluates them with derivatives in two directions.
    fn derivatives(
        &self,
        t: f64,
        arguments: &[HyperDual],
        costs: &[usize],
        answer: &mut Vec<HyperDual>,
    );
}

/// The functions of a model with N coordinates.
pub(super) struct Said<'m, M, const N: usize>(pub(super) &'m M);

impl<M: Controlled<N>, const N: usize> PointFunctions for Said<'_, M, N> {
    fn numbers(&self, t: f64, arguments: &[f64], costs: &[usize], answer: &mut Vec<f64>) {
        said(self.0, t, arguments, costs, answer);
    }

    fn derivatives(
        &self,
        t: f64,
        arguments: &[HyperDual],
        costs: &[usize],
        answer: &mut Vec<HyperDual>,
    ) {
        said(self.0, t, arguments, costs, answer);
    }
}

/// Evaluates the functions in any number type. `answer` also serves as buffer for the outputs.
fn said<M: Controlled<N>, R: Real, const N: usize>(
    model: &M,
    t: f64,
    arguments: &[R],
    costs: &[usize],
    answer: &mut Vec<R>,
) {
    let zero = R::from_f64(0.0);
    let t = R::from_f64(t);
    let (q, rest) = arguments.split_at(N);
    let (z, u) = rest.split_at(N);
    let (q, z): ([R; N], [R; N]) = (std::array::from_fn(|a| q[a]), std::array::from_fn(|a| z[a]));
    let mut inputs = [zero; MAX_INPUTS];
    inputs[..u.len()].copy_from_slice(u);
    let mut cost = zero;
    if !costs.is_empty() {
        answer.clear();
        answer.resize(model.columns(), zero);
        model.observables_with(&inputs, t, &q, &z, answer);
        for column in costs {
            cost += answer[*column];
        }
    }
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
    answer.push(cost);
}

impl Block {
    /// c and f at s.
    pub(super) fn values(&self, model: &dyn PointFunctions, s: &DVector<f64>) -> Values {
        let mut values = Values {
            rows: &self.linear * s,
            cost: 0.0,
            said: Vec::with_capacity(self.points.len()),
        };
        let mut answer = Vec::new();
        for point in &self.points {
            let arguments = &point.map * s;
            model.numbers(point.t, arguments.as_slice(), &self.costs, &mut answer);
            let cost = answer.pop().unwrap_or(0.0);
            let g = DVector::from_column_slice(&answer);
            values.rows += &point.into * &g;
            values.cost += point.weight * cost;
            values.said.push(g);
        }
        values
    }

    /// Linearises at s, with the second derivatives of the rows summed with `multipliers`.
    pub(super) fn linearise(
        &self,
        model: &dyn PointFunctions,
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
        let mut answer = Vec::new();
        for point in &self.points {
            let arguments = &point.map * s;
            let n = arguments.len();
            let weights = point.into.tr_mul(multipliers);
            let said = point.into.ncols();
            let mut g = DVector::zeros(said);
            let mut g_by = DMatrix::zeros(said, n);
            let mut cost_by = DVector::zeros(n);
            let mut cost_second = DMatrix::zeros(n, n);
            let mut rows_second = DMatrix::zeros(n, n);
            let mut cost = 0.0;
            let unit = |k: usize, at: usize| f64::from(u8::from(k == at));
            for i in 0..n {
                for j in 0..=i {
                    let twice: Vec<HyperDual> = (arguments.iter().enumerate())
                        .map(|(k, value)| {
                            HyperDual::new(
                                Dual::new(*value, unit(k, i)),
                                Dual::new(unit(k, j), 0.0),
                            )
                        })
                        .collect();
                    model.derivatives(point.t, &twice, &self.costs, &mut answer);
                    let mut second = 0.0;
                    for (component, number) in answer[..said].iter().enumerate() {
                        g[component] = number.value.value;
                        g_by[(component, i)] = number.value.slope;
                        second += weights[component] * number.slope.slope;
                    }
                    let number = answer[said];
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
