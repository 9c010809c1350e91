//! The iteration for equations of first order: the unknowns are the velocities, or the rates of phase space.

use super::convergence::{Increments, larger};
use super::group::{Group, Work, Written};
use super::products::sum;
use super::second_order::largest;
use super::step::Step;
use crate::model::Model;
use crate::points::end::moved;
use crate::points::evaluation::Evaluation;
use crate::registers::pair::Eight;
use crate::registers::side::load;

impl<M, const N: usize> Step<'_, M, N>
where
    M: Model<N>,
{
    /// Computes the contributions of the low words (rounding errors) of the start and of the tables at the points.
    #[inline(always)]
    pub(super) fn begin<V: Eight>(
        &self,
        like: V,
        group: &mut Group<N>,
        work: &mut Work<N>,
        written: Written<V>,
    ) {
        let (at, rows) = self.rows::<V>(group, work, written);
        rows.set_low::<_, _, M>(like, &at);
    }

    /// One iteration for the velocities of a Lagrangian.
    #[inline(always)]
    pub(super) fn sweep_velocity<V: Eight>(
        &self,
        like: V,
        group: &mut Group<N>,
        work: &mut Work<N>,
        written: Written<V>,
        evaluation: &mut Evaluation<V, N>,
        refresh: bool,
    ) -> Increments<V> {
        let (at, rows) = self.rows::<V>(group, work, written);
        let (changed, size) = rows.sweep_velocity(like, self.model, &at, evaluation, refresh);
        let (changed, size) = (changed.by_lane(), size.by_lane());
        let start = largest(like, &load(like, &group.start.q));
        let position = self.relative(start, size, changed);
        // The momentum at the end is as accurate as the velocities, whatever the step. The rest of an increment affects
        // it through the forces only, hence the factor.
        let velocity = changed / larger(size, like.like(f64::MIN_POSITIVE));
        let velocity = like.like(0.25) * velocity;
        Increments::new(larger(velocity, position), position)
    }

    /// One iteration for the rates of a Hamiltonian.
    #[inline(always)]
    pub(super) fn sweep_phase<V: Eight>(
        &self,
        like: V,
        group: &mut Group<N>,
        work: &mut Work<N>,
        written: Written<V>,
        evaluation: &mut Evaluation<V, N>,
        which: (bool, bool),
    ) -> Increments<V> {
        let (at, rows) = self.rows::<V>(group, work, written);
        let [of_rates, of_forces] = rows.sweep_phase(like, self.model, &at, evaluation, which);
        let (changed, size) = (of_rates.0.by_lane(), of_rates.1.by_lane());
        let start = largest(like, &load(like, &group.start.q));
        let position = self.relative(start, size, changed);
        let (changed, size) = (of_forces.0.by_lane(), of_forces.1.by_lane());
        let start = largest(like, &load(like, &group.start.p));
        let momentum = self.relative(start, size, changed);
        // A NaN in one of them must not be lost.
        let relative = larger(position, momentum) + like.like(0.0) * (position + momentum);
        Increments::new(relative, position)
    }

    /// The start plus h times the integrals of the rates, for coordinate `a`.
    #[inline(always)]
    pub(super) fn end<V: Eight, const EXACT: bool>(
        &self,
        like: V,
        group: &Group<N>,
        a: usize,
    ) -> ((V, V), (V, V)) {
        let h = like.like(self.h);
        let velocity = sum::<_, N, EXACT>(like, &self.tables.weights, &group.rates, a);
        let force = sum::<_, N, EXACT>(like, &self.tables.weights, &group.forces, a);
        let q = (like.with(group.start.q[a]), like.with(group.low.q[a]));
        let p = (like.with(group.start.p[a]), like.with(group.low.p[a]));
        (
            moved::<_, EXACT>(h, velocity, q),
            moved::<_, EXACT>(h, force, p),
        )
    }
}
