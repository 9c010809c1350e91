//! The derivative of the momentum at a node by the arriving momentum, under constraints (T-160).

use super::blocked::Blocked;
use super::model::{Block, Gradient, Model};
use super::node::Node;
use super::pattern::Pattern;
use super::rows::Rows;
use crate::condense::add_multiple;
use crate::dual::Dual;
use crate::error::StepError;
use alloc::vec;
use alloc::vec::Vec;

/// The sparsity patterns of A and of Σ μ φ_qq.
#[derive(Clone, Debug, Default)]
pub(super) struct Places {
    pub(super) rows: Pattern,
    pub(super) bends: Pattern,
    /// The number of constraints.
    pub(super) count: usize,
}

impl Places {
    /// The patterns of a model that has been checked.
    pub(super) fn of<M: Model>(model: &M) -> Self {
        match M::CONSTRAINED {
            true => Self {
                rows: Pattern::of_rows(model),
                bends: Pattern::of_bends(model),
                count: model.constraints(),
            },
            false => Self::default(),
        }
    }

    /// Σ μ φ_qq
    pub(super) fn bend<M: Model>(&self, model: &M, (t, q): (f64, &[f64]), mu: &[f64]) -> Vec<f64> {
        let mut values = vec![0.0; self.bends.places().len()];
        let mut entries = self.bends.scatter(&mut values);
        model.constraint_second(t, q, mu, &mut entries);
        values
    }

    /// The derivatives of φ, A and a by a parameter.
    pub(super) fn by_parameter<M: Model>(
        &self,
        model: &M,
        (t, q): (f64, &[f64]),
        parameter: usize,
    ) -> RowSlopes {
        let time = Dual::new(t, 0.0).by_parameter(Some(parameter));
        let still: Vec<Dual> = q.iter().map(|q| Dual::new(*q, 0.0)).collect();
        self.slopes(model, time, &still)
    }

    /// The derivatives of φ, A and a along the slopes of time and coordinates, and by the parameter that the time
    /// carries.
    pub(super) fn slopes<M: Model>(&self, model: &M, t: Dual, q: &[Dual]) -> RowSlopes {
        let zeros = |count: usize| vec![Dual::ZERO; count];
        let mut phi = zeros(self.count);
        let mut drift = zeros(self.count);
        let mut rows = zeros(self.rows.places().len());
        model.constraint_values(t, q, &mut phi);
        model.constraint_rows(t, q, &mut drift, &mut self.rows.add_to(&mut rows));
        let slopes = |values: &[Dual]| values.iter().map(|value| value.slope).collect();
        RowSlopes {
            phi: slopes(&phi),
            drift: slopes(&drift),
            rows: slopes(&rows),
        }
    }
}

/// The slopes of φ, a and A.
pub(super) struct RowSlopes {
    pub(super) phi: Vec<f64>,
    pub(super) drift: Vec<f64>,
    pub(super) rows: Vec<f64>,
}

/// The direct effect of a parameter at fixed unknowns; for a change of the start only the effect on the impulse.
#[derive(Clone, Debug, Default)]
pub(super) struct Explicit {
    /// h A₀ᵀ m₀, one entry for each coordinate.
    pub(super) impulse: Vec<f64>,
    /// φ at the points, a row for each, and at the end.
    pub(super) phi: Vec<f64>,
    pub(super) end_phi: Vec<f64>,
    /// At the end: L_v, Aᵀη and A v + a.
    pub(super) momentum: Vec<f64>,
    pub(super) reaction: Vec<f64>,
    pub(super) rate: Vec<f64>,
}

impl Explicit {
    /// The effect of a change of the impulse at the start alone.
    pub(super) fn impulse(impulse: Vec<f64>) -> Self {
        Self {
            impulse,
            ..Self::default()
        }
    }
}

/// The weights that a row λ of phase space gives to the equations of a node; multiplied by the derivatives of these by
/// parameters, they are added to the sums.
#[derive(Clone, Debug)]
pub(super) struct NodeWeights {
    pub(super) q: Vec<f64>,
    pub(super) v: Vec<f64>,
    /// φ, a, and A in the order of its pattern.
    pub(super) phi: Vec<f64>,
    pub(super) drift: Vec<f64>,
    pub(super) rows: Vec<f64>,
    /// L_v
    pub(super) momentum: Vec<f64>,
}

/// The derivative of the momentum at a node by the arriving momentum p̃ and by the coordinates.
///
/// ```text
/// p = p̃ − Aᵀη ,     L_v(q, v, t) + Aᵀη = p̃ ,     A v + a = 0                                          (T-74)
/// ```
#[derive(Clone, Debug)]
pub(super) struct Projection {
    /// [ L_vv Aᵀ ; A 0 ], factored.
    matrix: Blocked,
    pub(super) rows: Vec<f64>,
    /// ∂(A v + a)/∂q
    pub(super) rates: Vec<f64>,
    /// L_vq
    turn: Vec<(usize, usize, f64)>,
    /// Σ η φ_qq
    pub(super) bend: Vec<f64>,
    q: Vec<f64>,
    v: Vec<f64>,
    pub(super) eta: Vec<f64>,
}

impl Projection {
    /// For the node that was solved last, with its rows.
    ///
    /// # Errors
    /// [`StepError`] if the matrix is singular.
    pub(super) fn of<M: Model>(
        model: &M,
        (places, second): (&Places, &Pattern),
        (t, q, v): (f64, &[f64], &[f64]),
        (node, rows): (&Node, &Rows),
    ) -> Result<Self, StepError> {
        let eta = node.multipliers().to_vec();
        // φ is a function of coordinates and time: ∂(A v + a)/∂q is dA/dt along the motion.
        let moving: Vec<Dual> = q.iter().zip(v).map(|(q, v)| Dual::new(*q, *v)).collect();
        let along = places.slopes(model, Dual::new(t, 1.0), &moving);
        Ok(Self {
            matrix: node.clone().linearised(model, (t, q, v), rows)?,
            rows: rows.values.clone(),
            rates: along.rows,
            turn: turn(model, second, (t, q, v)),
            bend: places.bend(model, (t, q), &eta),
            q: q.to_vec(),
            v: v.to_vec(),
            eta,
        })
    }

    /// The effect of a parameter at the node, from its effects on the rows and on L_v there.
    pub(super) fn explicit(
        &self,
        places: &Places,
        slopes: RowSlopes,
        momentum: Vec<f64>,
    ) -> Explicit {
        let (mut reaction, mut rate) = (vec![0.0; momentum.len()], slopes.drift);
        places
            .rows
            .add_transposed(&slopes.rows, 1.0, &self.eta, &mut reaction);
        places
            .rows
            .add_product(&slopes.rows, 1.0, &self.v, &mut rate);
        Explicit {
            end_phi: slopes.phi,
            momentum,
            reaction,
            rate,
            ..Explicit::default()
        }
    }

    /// ∂p/∂a of a parameter at a fixed p̃.
    pub(super) fn by_parameter<M: Model>(
        &self,
        model: &M,
        places: &Places,
        t: f64,
        (parameter, momentum): (usize, Vec<f64>),
    ) -> Vec<f64> {
        let n = momentum.len();
        let slopes = places.by_parameter(model, (t, &self.q), parameter);
        let explicit = self.explicit(places, slopes, momentum);
        let mut p = vec![0.0; n];
        self.apply(places, &mut p, &vec![0.0; n], Some(&explicit));
        p
    }

    /// The velocities at the node.
    pub(super) fn velocity(&self) -> &[f64] {
        &self.v
    }

    /// Replaces δp̃ by δp.
    pub(super) fn apply(
        &self,
        places: &Places,
        p: &mut [f64],
        q: &[f64],
        explicit: Option<&Explicit>,
    ) {
        let (n, m) = (p.len(), places.count);
        places.bends.add_product(&self.bend, -1.0, q, p);
        let mut side = vec![0.0; n + m];
        if let Some(explicit) = explicit {
            add_multiple(p, -1.0, &explicit.reaction);
            add_multiple(&mut side[..n], 1.0, &explicit.momentum);
            add_multiple(&mut side[n..], 1.0, &explicit.rate);
        }
        for (row, column, value) in &self.turn {
            side[*row] += value * q[*column];
        }
        places.rows.add_product(&self.rates, 1.0, q, &mut side[n..]);
        add_multiple(&mut side, -1.0, p);
        // So far it has the opposite sign, and so has the solution.
        self.matrix.solve(&mut side);
        places.rows.add_transposed(&self.rows, 1.0, &side[n..], p);
    }

    /// The adjoint: takes λ back over the node, and returns the weights of L_v, A v + a and −Aᵀη.
    pub(super) fn pull(&self, places: &Places, of_p: &mut [f64], of_q: &mut [f64]) -> NodeWeights {
        let (n, m) = (of_p.len(), places.count);
        let mut w = vec![0.0; n + m];
        places.rows.add_product(&self.rows, 1.0, of_p, &mut w[n..]);
        // The matrix is symmetric.
        self.matrix.solve(&mut w);
        add_multiple(of_p, -1.0, &w);
        for (row, column, value) in &self.turn {
            of_q[*column] += value * w[*row];
        }
        places.bends.add_product(&self.bend, -1.0, of_p, of_q);
        places.rows.add_transposed(&self.rates, 1.0, &w[n..], of_q);
        let rows = places.rows.places().iter();
        let rows = rows.map(|(_, c, a)| w[n + c] * self.v[*a] - of_p[*a] * self.eta[*c]);
        NodeWeights {
            rows: rows.collect(),
            q: self.q.clone(),
            v: self.v.clone(),
            phi: vec![0.0; m],
            drift: w[n..].to_vec(),
            momentum: w[..n].to_vec(),
        }
    }
}

/// L_vq
fn turn<M: Model>(
    model: &M,
    pattern: &Pattern,
    (t, q, v): (f64, &[f64], &[f64]),
) -> Vec<(usize, usize, f64)> {
    let mut values = vec![0.0; pattern.places().len()];
    let mut unused = [(); 3].map(|()| vec![0.0; q.len()]);
    let [z, by_q, force] = &mut unused;
    let first = Gradient { z, q: by_q, force };
    model.second(t, q, v, first, &mut pattern.scatter(&mut values));
    let entries = pattern.places().iter().zip(values);
    let turned = entries.filter(|((block, ..), value)| *block == Block::ZQ && *value != 0.0);
    turned
        .map(|((_, row, column), value)| (*row, *column, value))
        .collect()
}
