//! The arrangement of numbers in registers during an iteration: points of one trajectory, or several trajectories.

use super::inertia::Inertia;
use crate::model::{First, Model};
use crate::precise::Precise;
use crate::registers::side::Side;
use crate::registers::storage::{Fixed, Matrix, Storage};

/// A number for every coordinate of everything that is side by side.
pub(crate) type Row<const L: usize, const N: usize> = [[f64; L]; N];

/// The arrangement of numbers in registers: the lanes are points of one trajectory, or trajectories.
pub(crate) trait Arrangement<V: Side<L>, const L: usize, const N: usize> {
    type Memory: Storage;
    /// A number at the start of a step: one for all points, or one for each trajectory.
    type Number: Copy;
    /// An entry of a vector over the points, for one row.
    type Entry: Copy;

    fn tables(&self) -> &Fixed<Self::Memory>;
    fn inertia(&self) -> &Inertia<N, Self::Memory>;

    /// The length of the step.
    fn h(&self) -> f64;

    /// A number at the start, in registers.
    fn number(&self, like: V, number: Self::Number) -> V;

    /// The entries of a vector over the points, one for each row.
    fn entries(vector: &[[f64; 4]]) -> &[Self::Entry];

    /// An entry in registers.
    fn entry(like: V, entry: Self::Entry) -> V;

    /// t + h c
    fn time(&self, like: V, node: Self::Entry) -> V;

    /// Coordinate and momentum `a` at the start.
    fn start(&self, like: V, a: usize) -> (V, V);

    /// The rounding errors of both.
    fn low(&self, like: V, a: usize) -> (V, V);

    /// The product of a table with a vector over the points, for every coordinate that is requested.
    fn apply(
        &self,
        like: V,
        table: &Matrix<Self::Memory>,
        wanted: &[bool; N],
        rows: &[Row<L, N>],
        products: &mut [Row<L, N>],
    );

    /// What changes of the force on coordinate `a` are multiplied by before they are compared, in equations of second
    /// order: 1/m, since momenta of light and heavy bodies are not comparable.
    #[inline(always)]
    fn factor(&self, like: V, a: usize) -> V {
        like.like(self.inertia().inverse_diagonal[a])
    }

    /// A change of a rate of coordinate `a` as it is compared, in equations of first order.
    #[inline(always)]
    fn weighted(&self, _a: usize, change: V) -> V {
        change
    }

    /// The same for a rate of its momentum.
    #[inline(always)]
    fn weighted_force(&self, _a: usize, change: V) -> V {
        change
    }

    /// Writes an unknown in those lanes that are to be written.
    fn set(&self, place: &mut [f64; L], value: V);

    /// Calls the kernel of first derivatives at q and z, and that of ∂²/∂z∂z if it is requested.
    fn first<M: Model<N>>(
        model: &M,
        t: V,
        at: (&[V; N], &[V; N]),
        first: &mut First<V, N>,
        mass: Option<&mut [[V; N]; N]>,
    );
}

/// The largest magnitude so far in each lane. NaN is ignored: if a force is not finite, the end of the step is not
/// finite, which is checked once for each step.
#[derive(Clone, Copy)]
pub(crate) struct Magnitude<V>(pub(super) V);

impl<V: Precise> Magnitude<V> {
    #[inline(always)]
    pub(crate) fn none(like: V) -> Self {
        Self(like.like(0.0))
    }

    #[inline(always)]
    pub(crate) fn raise(&mut self, value: V) {
        self.0 = value.abs().larger(self.0);
    }

    /// One value for each lane.
    #[cfg(feature = "alloc")]
    #[inline(always)]
    pub(crate) fn by_lane(self) -> V {
        self.0
    }
}
