//! The two kinds of bundles: one model in all lanes, or a model for each lane.

use crate::model::{Model, State};
use crate::points::constant_rates;
use crate::registers::pair::Eight;

/// The kernels, and the scalar type, with which eight trajectories are computed side by side.
pub trait Together<const N: usize>: Clone {
    /// The kernels of all lanes.
    type Kernels: Model<N>;
    /// The scalar type of their arguments.
    type Number<'a, V: Eight>: Eight
    where
        Self: 'a;

    /// The kernels of all lanes.
    fn kernels(&self) -> &Self::Kernels;
    /// Converts a number to the scalar type of the kernels.
    fn number<V: Eight>(&self, like: V) -> Self::Number<'_, V>;
    /// The rates of momenta and coordinates of one lane at a start.
    fn constant_rates(&self, lane: usize, t: f64, start: &State<N>) -> ([f64; N], [f64; N]);
}

/// Gives the model of each lane.
pub trait Trajectories<'m, M: Model<N>, const N: usize>: Together<N> {
    /// The model of one lane.
    fn model(&self, lane: usize) -> &'m M;
}

/// One model in all lanes.
#[derive(Debug)]
pub struct One<'m, M>(pub(super) &'m M);

// Not derived: the model is borrowed and need not be `Clone`.
impl<M> Clone for One<'_, M> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<M> Copy for One<'_, M> {}

impl<M: Model<N>, const N: usize> Together<N> for One<'_, M> {
    type Kernels = M;
    type Number<'a, V: Eight>
        = V
    where
        Self: 'a;

    fn kernels(&self) -> &M {
        self.0
    }

    #[inline(always)]
    fn number<V: Eight>(&self, like: V) -> V {
        like
    }

    fn constant_rates(&self, _lane: usize, t: f64, start: &State<N>) -> ([f64; N], [f64; N]) {
        constant_rates(self.0, t, start)
    }
}

impl<'m, M: Model<N>, const N: usize> Trajectories<'m, M, N> for One<'m, M> {
    fn model(&self, _lane: usize) -> &'m M {
        self.0
    }
}
