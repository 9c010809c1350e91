//! Four points in one register of the processor.

use super::four::{Four, OutOfLine, each_point};
use super::side::Side;
use super::storage::{Matrix, Row, Storage};
use crate::lanes::Lanes;
use crate::model::{First, Model};
use crate::registers::quad::Quad;

impl Side<4> for Quad {
    #[inline(always)]
    fn with(self, lanes: [f64; 4]) -> Self {
        self.with(lanes)
    }

    #[inline(always)]
    fn lanes(self) -> [f64; 4] {
        self.lanes()
    }
}

/// In registers of the processor, the kernel is called for all four points at once.
impl Four for Quad {
    #[inline(always)]
    fn apply<S: Storage, const N: usize>(
        self,
        matrix: &Matrix<S>,
        wanted: &[bool; N],
        rows: &[Row<N>],
        products: &mut [Row<N>],
    ) {
        matrix.apply_inline(self, wanted, rows, products);
    }

    #[inline(always)]
    fn transposed(rows: [Self; 4]) -> [Self; 4] {
        Self::transposed(rows)
    }

    #[inline(always)]
    fn out_of_line<W: OutOfLine>(self, work: W) {
        self.out_of_line(work);
    }

    #[inline(always)]
    fn sin_cos_of_two(self, other: Self) -> ((Self, Self), (Self, Self)) {
        self.sin_cos_of_two(other)
    }

    #[inline(always)]
    fn sin_of_two(self, other: Self) -> (Self, Self) {
        self.sin_of_two(other)
    }

    #[inline(always)]
    fn cos_of_two(self, other: Self) -> (Self, Self) {
        self.cos_of_two(other)
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
        if M::LANES {
            model.first_inline(t, q, z, first);
        } else {
            in_turn(t, model, q, z, first, None);
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
            model.first_and_mass_inline(t, q, z, first, mass);
        } else {
            in_turn(t, model, q, z, first, Some(mass));
        }
    }
}

/// Calls a kernel that is not made for registers for one point after the other.
#[inline(always)]
fn in_turn<V: Four, M, const N: usize>(
    t: V,
    model: &M,
    q: &[V; N],
    z: &[V; N],
    first: &mut First<V, N>,
    mass: Option<&mut [[V; N]; N]>,
) where
    M: Model<N>,
{
    let none = Lanes([0.0; 4]);
    let (mut q_lanes, mut z_lanes) = ([none; N], [none; N]);
    for a in 0..N {
        (q_lanes[a], z_lanes[a]) = (Lanes(q[a].lanes()), Lanes(z[a].lanes()));
    }
    let mut first_lanes = First::zero();
    let (time, mut mass_lanes) = (Lanes(t.lanes()), [[none; N]; N]);
    let wanted = mass.is_some().then_some(&mut mass_lanes);
    each_point::<f64, M, N>(model, time, &q_lanes, &z_lanes, &mut first_lanes, wanted);
    for a in 0..N {
        first.z[a] = t.with(first_lanes.z[a].0);
        first.q[a] = t.with(first_lanes.q[a].0);
        first.force[a] = t.with(first_lanes.force[a].0);
    }
    if let Some(mass) = mass {
        for a in 0..N {
            for b in 0..N {
                mass[a][b] = t.with(mass_lanes[a][b].0);
            }
        }
    }
}
