//! Scalars of four numbers side by side, one for each of four points.

use super::side::Side;
use super::storage::{Matrix, Row, Storage};
use crate::double_double::DoubleDouble;
use crate::lanes::Lanes;
use crate::model::{First, Model};
use crate::precise::Precise;
use crate::real::{Real, fused};

/// Work in a function of its own, which is compiled for the instruction set of the numbers with which it computes.
pub(crate) trait OutOfLine {
    fn run<V: Four>(self, like: V);
}

/// Four numbers, one for each of four points.
pub(crate) trait Four: Side<4> {
    /// Runs the work with numbers of this kind.
    #[cfg_attr(
        not(feature = "alloc"),
        allow(dead_code, reason = "bundles of trajectories and registers need it")
    )]
    fn out_of_line<W: OutOfLine>(self, work: W);

    /// sin and cos of `self`, and of `other`.
    #[cfg(feature = "alloc")]
    #[inline(always)]
    fn sin_cos_of_two(self, other: Self) -> ((Self, Self), (Self, Self)) {
        (self.sin_cos(), other.sin_cos())
    }

    /// sin of `self`, and of `other`.
    #[cfg(feature = "alloc")]
    #[inline(always)]
    fn sin_of_two(self, other: Self) -> (Self, Self) {
        (self.sin(), other.sin())
    }

    /// cos of `self`, and of `other`.
    #[cfg(feature = "alloc")]
    #[inline(always)]
    fn cos_of_two(self, other: Self) -> (Self, Self) {
        (self.cos(), other.cos())
    }

    /// The product of a table with a vector over the points, for every coordinate that is requested.
    fn apply<S: Storage, const N: usize>(
        self,
        matrix: &Matrix<S>,
        wanted: &[bool; N],
        rows: &[Row<N>],
        products: &mut [Row<N>],
    );

    /// The transposed 4 × 4 matrix.
    #[inline(always)]
    fn transposed(rows: [Self; 4]) -> [Self; 4] {
        let (mut lanes, mut columns) = ([[0.0; 4]; 4], rows);
        for i in 0..4 {
            lanes[i] = rows[i].lanes();
        }
        for i in 0..4 {
            columns[i] = rows[i].with([lanes[0][i], lanes[1][i], lanes[2][i], lanes[3][i]]);
        }
        columns
    }

    /// The kernel of first derivatives at four points.
    fn first<M, const N: usize>(
        model: &M,
        t: Self,
        q: &[Self; N],
        z: &[Self; N],
        first: &mut First<Self, N>,
    ) where
        M: Model<N>;

    /// The kernel of first derivatives and ∂²/∂z∂z at four points.
    fn first_and_mass<M, const N: usize>(
        model: &M,
        t: Self,
        q: &[Self; N],
        z: &[Self; N],
        first: &mut First<Self, N>,
        mass: &mut [[Self; N]; N],
    ) where
        M: Model<N>;
}

/// Four of the numbers; beyond the last zeros, or copies of a single one.
#[inline(always)]
pub(crate) fn block<V: Four>(like: V, numbers: &[f64], at: usize) -> V {
    if let Some(four) = numbers[at..].first_chunk() {
        return like.with(*four);
    }
    if let [single] = numbers[at..] {
        return like.like(single);
    }
    let mut four = [0.0; 4];
    four[..numbers.len() - at].copy_from_slice(&numbers[at..]);
    like.with(four)
}

/// Writes four numbers back, or as many as there are.
#[inline(always)]
pub(crate) fn put<V: Four>(four: V, numbers: &mut [f64], at: usize) {
    if let Some(place) = numbers[at..].first_chunk_mut() {
        *place = four.lanes();
        return;
    }
    let end = numbers.len();
    numbers[at..end].copy_from_slice(&four.lanes()[..end - at]);
}

impl Precise for Lanes<4> {
    #[inline(always)]
    fn product(self, other: Self) -> (Self, Self) {
        let (mut high, mut low, mut sum) = (self, self, 0.0);
        for lane in 0..4 {
            let product = DoubleDouble::split_product(self.0[lane], other.0[lane]);
            (high.0[lane], low.0[lane]) = (product.high, product.low);
            // Zero, or NaN if a number is too large to be split.
            sum += 0.0 * product.low;
        }
        if sum == 0.0 {
            return (high, low);
        }
        for lane in 0..4 {
            let product = DoubleDouble::product(self.0[lane], other.0[lane]);
            (high.0[lane], low.0[lane]) = (product.high, product.low);
        }
        (high, low)
    }

    #[inline(always)]
    fn times_plus(self, factor: Self, mut term: Self) -> Self {
        for lane in 0..4 {
            term.0[lane] = fused(self.0[lane], factor.0[lane], term.0[lane]);
        }
        term
    }
}

impl Side<4> for Lanes<4> {
    #[inline(always)]
    fn with(self, lanes: [f64; 4]) -> Self {
        Self(lanes)
    }

    #[inline(always)]
    fn lanes(self) -> [f64; 4] {
        self.0
    }
}

/// For every processor: the compiler vectorises the arithmetic, and the kernel is called for one point after the other.
impl Four for Lanes<4> {
    /// Not inlined: code that few processors run need not be compiled for every caller in every model.
    #[inline(never)]
    fn apply<S: Storage, const N: usize>(
        self,
        matrix: &Matrix<S>,
        wanted: &[bool; N],
        rows: &[Row<N>],
        products: &mut [Row<N>],
    ) {
        matrix.apply_inline(self, wanted, rows, products);
    }

    #[inline(never)]
    fn out_of_line<W: OutOfLine>(self, work: W) {
        work.run(self);
    }

    #[inline(always)]
    fn first<M, const N: usize>(
        model: &M,
        t: Self,
        q: &[Self; N],
        z: &[Self; N],
        first: &mut First<Self, N>,
    ) where
        M: Model<N>,
    {
        // A number in a lane has our own sines; a plain number has those of the system, which differ in the last digit.
        if M::LANES {
            each_point::<Lanes<1>, M, N>(model, t, q, z, first, None);
        } else {
            each_point::<f64, M, N>(model, t, q, z, first, None);
        }
    }

    #[inline(always)]
    fn first_and_mass<M, const N: usize>(
        model: &M,
        t: Self,
        q: &[Self; N],
        z: &[Self; N],
        first: &mut First<Self, N>,
        mass: &mut [[Self; N]; N],
    ) where
        M: Model<N>,
    {
        if M::LANES {
            each_point::<Lanes<1>, M, N>(model, t, q, z, first, Some(mass));
        } else {
            each_point::<f64, M, N>(model, t, q, z, first, Some(mass));
        }
    }
}

/// A single number.
pub(super) trait One: Real {
    fn value(self) -> f64;
}

impl One for f64 {
    fn value(self) -> f64 {
        self
    }
}

impl One for Lanes<1> {
    fn value(self) -> f64 {
        self.0[0]
    }
}

/// The kernel for one point after the other.
pub(super) fn each_point<R: One, M, const N: usize>(
    model: &M,
    t: Lanes<4>,
    q: &[Lanes<4>; N],
    z: &[Lanes<4>; N],
    first: &mut First<Lanes<4>, N>,
    mut mass: Option<&mut [[Lanes<4>; N]; N]>,
) where
    M: Model<N>,
{
    let (mut one, mut mass_of_one) = (First::<R, N>::zero(), [[R::from_f64(0.0); N]; N]);
    for lane in 0..4 {
        let t = R::from_f64(t.0[lane]);
        let (mut q_of_one, mut z_of_one) = ([t; N], [t; N]);
        for a in 0..N {
            q_of_one[a] = R::from_f64(q[a].0[lane]);
            z_of_one[a] = R::from_f64(z[a].0[lane]);
        }
        if let Some(mass) = &mut mass {
            model.first_and_mass(t, &q_of_one, &z_of_one, &mut one, &mut mass_of_one);
            for a in 0..N {
                for b in 0..N {
                    mass[a][b].0[lane] = mass_of_one[a][b].value();
                }
            }
        } else {
            model.first(t, &q_of_one, &z_of_one, &mut one);
        }
        for a in 0..N {
            first.z[a].0[lane] = one.z[a].value();
            first.q[a].0[lane] = one.q[a].value();
            first.force[a].0[lane] = one.force[a].value();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One number too large to be split, beside others; each lane as the number alone.
    #[test]
    fn products_beside_large_numbers_are_exact() {
        let (a, b) = ([1.1, 1.5e305, -0.3, 7.0], [1.3, 1.1, 0.7, 1e-3]);
        let (high, low) = Lanes(a).product(Lanes(b));
        for lane in 0..4 {
            let alone = DoubleDouble::product(a[lane], b[lane]);
            assert!(low.0[lane].is_finite(), "{lane}");
            assert_eq!((high.0[lane], low.0[lane]), (alone.high, alone.low));
        }
    }
}
