//! One step of eight trajectories: initial guess, iteration, end.

use super::convergence::{ConvergenceMonitor, Increments, larger};
use super::group::{Group, Row, Work, Written, flags};
use super::products::apply;
use super::together::Together;
use crate::model::Model;
use crate::newton::{Control, PATIENCE, Solve};
use crate::points::evaluation::Evaluation;
use crate::points::forms::{is_phase, is_second_order};
use crate::points::inertia::Inertia;
use crate::points::tables::Tables;
use crate::registers::pair::{Eight, LANES};
use crate::registers::storage::Heap;
use crate::statistics::{Contraction, Statistics};
use crate::unlike::Declarations;
use alloc::vec::Vec;

/// What is common to all trajectories.
pub(super) struct Step<'a, M, const N: usize> {
    pub(super) model: &'a M,
    pub(super) tables: &'a Tables<Heap>,
    pub(super) inertia: &'a Inertia<N, Heap>,
    pub(super) control: &'a Control,
    pub(super) t: f64,
    pub(super) h: f64,
    pub(super) declarations: Declarations<N>,
}

/// The iterations after which mass matrices are evaluated anew. The initial guess is accurate to a few digits, so that
/// one evaluation usually suffices. The schedule does not depend on the progress of the iteration, which keeps lanes
/// independent of one another.
const REFRESHED: [u32; 4] = [0, 4, 8, 14];

impl<M, const N: usize> Step<'_, M, N>
where
    M: Model<N>,
{
    /// Moves the requested lanes from t to t + h and returns which of them succeeded; the others are unchanged.
    #[inline(always)]
    pub(super) fn advance<V: Eight>(
        &self,
        like: V,
        group: &mut Group<N>,
        work: &mut Work<N>,
        lanes: &mut [bool],
        statistics: &mut Statistics,
    ) {
        let wanted = like.with(flags(lanes));
        self.continue_last(like, group, work);
        if const { is_second_order::<M, N>() } {
            self.begin_second_order(like, group, work);
        } else if !self.control.is_rough() {
            self.begin(like, group, work, Written::of(wanted));
        }
        let mut arrived = self.iterate(like, group, work, wanted, statistics);
        if const { N > 1 } && self.declarations.are_several && !self.control.is_rough() {
            arrived = self.settled(like, group, work, arrived);
        }

        if const { is_second_order::<M, N>() } {
            self.prepare_end(like, group, work);
        }
        let (zero, mut ends) = (like.like(0.0), [((like, like), (like, like)); N]);
        for a in 0..N {
            ends[a] = if self.control.is_rough() {
                self.end_of::<V, false>(like, group, work, a)
            } else {
                self.end_of::<V, true>(like, group, work, a)
            };
            // Zero times a number that is not finite is NaN.
            let nothing = zero * (ends[a].0).0 + zero * (ends[a].1).0;
            arrived = V::select(nothing.less_or_equal(zero), arrived, zero);
        }
        let written = Written::of(arrived);
        for a in 0..N {
            let ((q, q_low), (p, p_low)) = ends[a];
            written.put(&mut group.start.q[a], q);
            written.put(&mut group.start.p[a], p);
            written.put(&mut group.low.q[a], q_low);
            written.put(&mut group.low.p[a], p_low);
        }
        let arrived = arrived.lanes();
        for lane in 0..LANES {
            group.warm[lane] = arrived[lane] > 0.0;
            statistics.steps += u64::from(group.warm[lane]);
        }
        for (lane, warm) in lanes.iter_mut().zip(&group.warm) {
            *lane = *warm;
        }
    }

    /// The coordinate and the momentum at the end.
    #[inline(always)]
    fn end_of<V: Eight, const EXACT: bool>(
        &self,
        like: V,
        group: &Group<N>,
        work: &Work<N>,
        a: usize,
    ) -> ((V, V), (V, V)) {
        if const { is_second_order::<M, N>() } {
            self.end_second_order::<V, EXACT>(like, group, work, a)
        } else {
            self.end::<V, EXACT>(like, group, a)
        }
    }

    /// Sets the unknowns of lanes that continue a step by extrapolating the polynomial of that step.
    #[inline(always)]
    fn continue_last<V: Eight>(&self, like: V, group: &mut Group<N>, work: &mut Work<N>) {
        if group.warm == [false; LANES] {
            return;
        }
        if const { is_second_order::<M, N>() || is_phase::<M, N>() } {
            self.continue_one(like, &group.warm, &mut group.forces, &mut work.products);
        }
        if const { !is_second_order::<M, N>() } {
            self.continue_one(like, &group.warm, &mut group.rates, &mut work.products);
        }
    }

    /// The same for one kind of unknowns.
    #[inline(always)]
    fn continue_one<V: Eight>(
        &self,
        like: V,
        warm: &[bool; LANES],
        unknowns: &mut Vec<Row<N>>,
        products: &mut Vec<Row<N>>,
    ) {
        apply(
            like,
            self.tables.continued(),
            &[true; N],
            unknowns,
            products,
        );
        if *warm == [true; LANES] {
            core::mem::swap(unknowns, products);
            return;
        }
        let written = Written::of(like.with(flags(warm)));
        for (old, new) in unknowns.iter_mut().zip(products) {
            for a in 0..N {
                written.put(&mut old[a], like.with(new[a]));
            }
        }
    }

    /// The fixed-point iteration; the result has a one for each lane that has converged.
    #[inline(always)]
    fn iterate<V: Eight>(
        &self,
        like: V,
        group: &mut Group<N>,
        work: &mut Work<N>,
        wanted: V,
        statistics: &mut Statistics,
    ) -> V {
        // Where Newton's method can take over, the iteration gives up early.
        let yielding = self.control.solve != Solve::FixedPoint;
        let most = if yielding {
            self.control.max_iterations.min(PATIENCE)
        } else {
            self.control.max_iterations
        };
        let zero = like.like(0.0);
        let mut monitor = ConvergenceMonitor::new(like, self.control.tolerance, self.control.solve);
        let (mut active, mut arrived, mut count, mut rates) = (wanted, zero, zero, zero);
        let (mut evaluation, mut iteration) = (Evaluation::zero(like), 0);
        while iteration < most {
            let written = Written::of(active);
            let increments = self.sweep(like, group, work, written, &mut evaluation, iteration);
            count += active;
            let (done, going) = monitor.judge(increments, active);
            // Lanes that converged earlier keep their last rate.
            rates = V::select(written.mask, monitor.rates(), rates);
            arrived += done;
            active = going;
            if yielding && iteration >= 2 {
                active = monitor.hopeful(active, most - iteration);
            }
            iteration += 1;
            if !active.any_positive() {
                break;
            }
        }
        let mut sum = 0.0;
        for count in count.lanes() {
            sum += count;
        }
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a small whole number"
        )]
        let count = sum as u64;
        statistics.iterations += count;
        statistics.fixed_point_iterations += count;
        statistics.residual_evaluations += count * self.tables.points as u64;
        let mut slowest = 0.0_f64;
        for rate in rates.lanes() {
            slowest = slowest.max(rate);
        }
        statistics.contraction = statistics.contraction.max(Contraction::of(slowest));
        arrived
    }

    /// One iteration of the lanes in `written`.
    #[inline(always)]
    fn sweep<V: Eight>(
        &self,
        like: V,
        group: &mut Group<N>,
        work: &mut Work<N>,
        written: Written<V>,
        at: &mut Evaluation<V, N>,
        iteration: u32,
    ) -> Increments<V> {
        // The conditions are constants, so that only one of the three iterations is compiled.
        if const { is_second_order::<M, N>() } {
            return self.sweep_second_order(like, group, work, written, at, iteration);
        }
        let refresh = const { !M::FACTS.constant_mass } && REFRESHED.contains(&iteration);
        if const { is_phase::<M, N>() } {
            self.sweep_phase(like, group, work, written, at, (iteration == 0, refresh))
        } else {
            self.sweep_velocity(like, group, work, written, at, refresh)
        }
    }

    /// |h δ| divided by the larger of |start| and |h x|; 0/0 is zero, and NaN stays NaN.
    #[inline(always)]
    pub(super) fn relative<V: Eight>(&self, start: V, x: V, step: V) -> V {
        let (h, zero) = (start.like(self.h.abs()), start.like(0.0));
        let quotient = h * step / larger(start, h * x);
        V::select(step.less_or_equal(zero), zero, quotient)
    }

    /// Sets constant rates as initial guess for those of the requested lanes that do not continue a step.
    #[cold]
    pub(super) fn start_cold<T>(&self, models: &T, group: &mut Group<N>, lanes: &[bool])
    where
        T: Together<N>,
    {
        for (lane, wanted) in lanes.iter().enumerate() {
            if !wanted || group.warm[lane] {
                continue;
            }
            let (force, rate) = models.constant_rates(lane, self.t, &group.state(lane));
            for l in 0..self.tables.points {
                for a in 0..N {
                    group.forces[l][a][lane] = force[a];
                    group.rates[l][a][lane] = rate[a];
                }
            }
        }
    }
}
