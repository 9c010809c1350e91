//! Lanes that have converged relative to their largest coordinate, but perhaps not to others that are small beside it.

use super::group::{Group, Row, Work};
use super::step::Step;
use crate::model::Model;
use crate::points::weigh::Sizing;
use crate::registers::pair::{Eight, LANES};
use crate::unlike::{ALIKE, raise};

impl<M, const N: usize> Step<'_, M, N>
where
    M: Model<N>,
{
    /// The lanes that have arrived, without those in which a coordinate is small beside the largest one. Their
    /// iteration would have to go on, which that of a stepper of their own does.
    #[inline(always)]
    pub(super) fn settled<V: Eight>(
        &self,
        like: V,
        group: &Group<N>,
        work: &Work<N>,
        arrived: V,
    ) -> V {
        let (Some(forces), Some(rates)) = (group.forces.first(), group.rates.first()) else {
            return arrived;
        };
        let (zero, infinity) = (like.like(0.0), like.like(f64::INFINITY));
        let (mut least, mut most) = ((infinity, infinity), (zero, zero));
        for a in 0..N {
            let sizing = Sizing {
                velocity: like.with(work.velocity[a]),
                q: like.with(group.start.q[a]),
                p: like.with(group.start.p[a]),
                inverse: like.like(self.inertia.inverse_diagonal[a]),
                force: like.with(forces[a]),
                rate: like.with(rates[a]),
            };
            let (size, of_momentum) = sizing.sizes::<M, N>(like.like(self.h), a);
            least.0 = V::select(size.less(least.0), size, least.0);
            least.1 = V::select(of_momentum.less(least.1), of_momentum, least.1);
            most.0 = size.larger(most.0);
            most.1 = of_momentum.larger(most.1);
        }
        let alike = like.like(ALIKE);
        let is_unlike = V::select(least.0.less(alike * most.0), arrived, zero);
        let is_unlike = V::select(least.1.less(alike * most.1), arrived, is_unlike);
        if !is_unlike.any_positive() {
            return arrived;
        }
        let (mut lanes, doubtful) = (arrived.lanes(), is_unlike.lanes());
        self.drop_unlike(group, work, (&mut lanes, &doubtful));
        like.with(lanes)
    }

    /// Sets the marks of those of the doubtful lanes to zero that have small coordinates.
    #[cold]
    #[inline(never)]
    fn drop_unlike(
        &self,
        group: &Group<N>,
        work: &Work<N>,
        (lanes, doubtful): (&mut [f64; LANES], &[f64; LANES]),
    ) {
        for lane in 0..LANES {
            if doubtful[lane] > 0.0 && self.is_unlike(group, work, lane) {
                lanes[lane] = 0.0;
            }
        }
    }

    /// Whether a coordinate of a lane is small beside its largest one.
    fn is_unlike(&self, group: &Group<N>, work: &Work<N>, lane: usize) -> bool {
        let (mut sizes, mut of_momenta) = ([0.0; N], [0.0; N]);
        for a in 0..N {
            let sizing = Sizing {
                velocity: work.velocity[a][lane],
                q: group.start.q[a][lane],
                p: group.start.p[a][lane],
                inverse: self.inertia.inverse_diagonal[a],
                force: largest_of(&group.forces, a, lane),
                rate: largest_of(&group.rates, a, lane),
            };
            (sizes[a], of_momenta[a]) = sizing.sizes::<M, N>(self.h, a);
        }
        self.declarations.is_small(&sizes) || self.declarations.is_small(&of_momenta)
    }
}

/// The largest magnitude of a coordinate of a lane at all points.
fn largest_of<const N: usize>(rows: &[Row<N>], a: usize, lane: usize) -> f64 {
    let mut largest = 0.0;
    for row in rows {
        raise(&mut largest, row[a][lane].abs());
    }
    largest
}
