//! A constant mass matrix and its inverse, as the iterations with all points at once use them.

use super::forms::is_second_order;
use crate::double_double::DoubleDouble;
use crate::lu::Block;
use crate::model::{First, Form, Model, NO_TIME};
use crate::precise::Precise;
use crate::registers::four::{Four, block, put};
use crate::registers::side::Side;
use crate::registers::storage::{List, Storage};

/// A constant mass matrix.
#[derive(Clone, Debug)]
pub(crate) struct Inertia<const N: usize, S: Storage> {
    /// Whether it is diagonal.
    has_diagonal_alone: bool,
    /// The diagonal; without meaning if the matrix is not diagonal.
    pub(crate) masses: [f64; N],
    /// The diagonal of the inverse; ones if it is not constant.
    pub(crate) inverse_diagonal: [f64; N],
    /// The rounding error of the diagonal of the inverse.
    pub(crate) inverse_low: [f64; N],
    /// M⁻¹ (or H_pp), row by row; without meaning if it is not constant, or diagonal.
    pub(crate) inverse: S::Square<N>,
    /// The step length for which the next entries were computed: h²/m for a diagonal matrix, and its rounding error.
    step: f64,
    pub(super) reach: [f64; N],
    pub(super) reach_low: [f64; N],
}

impl<const N: usize, S: Storage> Inertia<N, S> {
    /// M⁻¹ of a model, empty unless its mass matrix is constant; `None` if that is singular, or if momenta are not
    /// multiples of velocities where they have to be.
    pub(crate) fn of<M>(model: &M) -> Option<Self>
    where
        M: Model<N>,
    {
        if !M::FACTS.constant_mass {
            return Some(Self {
                has_diagonal_alone: false,
                masses: [1.0; N],
                inverse_diagonal: [1.0; N],
                inverse_low: [0.0; N],
                inverse: List::filled([0.0; N], 0),
                step: 0.0,
                reach: [0.0; N],
                reach_low: [0.0; N],
            });
        }
        let (mut first, mut mass) = (First::ZERO, [[0.0; N]; N]);
        model.first_and_mass(NO_TIME, &[0.0; N], &[0.0; N], &mut first, &mut mass);
        if is_second_order::<M, N>() && first.z != [0.0; N] {
            return None;
        }
        if const { is_always_diagonal::<M, N>() } {
            return Self::of_diagonal(core::array::from_fn(|a| mass[a][a]), M::FORM);
        }
        if let Some(diagonal) = diagonal_of(&mass) {
            return Self::of_diagonal(diagonal, M::FORM);
        }
        let inverse = Block::of(&mass).ok()?.inverse();
        let inverse = match M::FORM {
            Form::Lagrangian => inverse,
            Form::Hamiltonian => mass,
        };
        let (mut inverse_diagonal, mut rows) = ([0.0; N], S::Square::filled([0.0; N], N));
        for a in 0..N {
            (inverse_diagonal[a], rows[a]) = (inverse[a][a], inverse[a]);
        }
        Some(Self {
            has_diagonal_alone: false,
            masses: [1.0; N],
            inverse_diagonal,
            inverse_low: [0.0; N],
            inverse: rows,
            step: 0.0,
            reach: [0.0; N],
            reach_low: [0.0; N],
        })
    }

    /// From the diagonal of L_vv or H_pp; `None` if a mass is zero or not finite.
    fn of_diagonal(given: [f64; N], form: Form) -> Option<Self> {
        let (mut masses, mut inverse, mut inverse_low) = ([0.0; N], [0.0; N], [0.0; N]);
        for a in 0..N {
            let reciprocal = 1.0 / given[a];
            if !(given[a].is_finite() && reciprocal.is_finite()) {
                return None;
            }
            (masses[a], inverse[a]) = match form {
                Form::Lagrangian => (given[a], reciprocal),
                Form::Hamiltonian => (reciprocal, given[a]),
            };
            let exact = DoubleDouble::ONE.over(DoubleDouble::new(masses[a]));
            inverse_low[a] = exact.minus(DoubleDouble::new(inverse[a])).high;
        }
        Some(Self {
            has_diagonal_alone: true,
            masses,
            inverse_diagonal: inverse,
            inverse_low,
            inverse: List::filled([0.0; N], 0),
            step: 0.0,
            reach: [0.0; N],
            reach_low: [0.0; N],
        })
    }

    /// Whether a constant mass matrix is diagonal; with one coordinate it always is.
    #[inline(always)]
    pub(crate) fn is_diagonal<M: Model<N>>(&self) -> bool {
        (const { is_always_diagonal::<M, N>() }) || self.has_diagonal_alone
    }

    /// The constant M⁻¹ (or H_pp) times a vector, in each lane.
    #[inline(always)]
    pub(crate) fn times<M: Model<N>, V: Precise>(&self, like: V, vector: &[V; N]) -> [V; N] {
        let mut product = [like.like(0.0); N];
        if self.is_diagonal::<M>() {
            for a in 0..N {
                product[a] = like.like(self.inverse_diagonal[a]) * vector[a];
            }
            return product;
        }
        for (a, row) in self.inverse.iter().enumerate() {
            for b in 0..N {
                product[a] = like.like(row[b]).times_plus(vector[b], product[a]);
            }
        }
        product
    }

    /// Computes h²/m for steps of length h.
    #[inline(always)]
    pub(crate) fn set_step<M: Model<N>, V: Four>(&mut self, like: V, h: f64) {
        if !self.is_diagonal::<M>() || self.step == h {
            return;
        }
        self.step = h;
        let (square, square_low) = like.like(h).product(like.like(h));
        for at in (0..N).step_by(4) {
            let inverse = block(like, &self.inverse_diagonal, at);
            let inverse_low = block(like, &self.inverse_low, at);
            let (product, rest) = square.product(inverse);
            let rest = rest + (square * inverse_low + square_low * inverse);
            let (high, low) = product.exact_sum(rest);
            put(high, &mut self.reach, at);
            put(low, &mut self.reach_low, at);
        }
    }

    /// One row of M⁻¹ times a vector.
    #[inline(always)]
    pub(crate) fn row<M: Model<N>, V: Side<L>, const L: usize>(
        &self,
        like: V,
        row: &[[f64; L]; N],
        a: usize,
    ) -> V {
        if self.is_diagonal::<M>() {
            return like.like(self.inverse_diagonal[a]) * like.with(row[a]);
        }
        let mut sum = like.like(0.0);
        for b in 0..N {
            sum = like
                .like(self.inverse[a][b])
                .times_plus(like.with(row[b]), sum);
        }
        sum
    }

    /// The same for a vector with its rounding error.
    #[inline(always)]
    pub(super) fn of_both(&self, high: &[f64; N], low: &[f64; N]) -> ([f64; N], [f64; N]) {
        let (mut of_high, mut of_low) = ([0.0; N], [0.0; N]);
        for (a, row) in self.inverse.iter().enumerate() {
            let mut sum = DoubleDouble::ZERO;
            for b in 0..N {
                let product = DoubleDouble::product(row[b], high[b]);
                sum = sum.plus(product).plus(DoubleDouble::new(row[b] * low[b]));
            }
            (of_high[a], of_low[a]) = (sum.high, sum.low);
        }
        (of_high, of_low)
    }
}

/// Whether the mass matrix is diagonal whatever the parameters: then what serves others is not compiled.
pub(crate) const fn is_always_diagonal<M: Model<N>, const N: usize>() -> bool {
    N == 1 || M::DIAGONAL_MASS
}

/// The diagonal of a matrix, if it is diagonal.
fn diagonal_of<const N: usize>(matrix: &[[f64; N]; N]) -> Option<[f64; N]> {
    let mut diagonal = [0.0; N];
    for a in 0..N {
        diagonal[a] = matrix[a][a];
        for b in 0..N {
            if a != b && matrix[a][b] != 0.0 {
                return None;
            }
        }
    }
    Some(diagonal)
}
