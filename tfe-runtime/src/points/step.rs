//! A step of one trajectory: start of the iteration, the iteration, the end.

use super::four::Four;
use super::storage::Storage;
use super::{Leg, Outcome, Points, Work, is_finite, is_phase, is_second_order, largest};
use crate::model::{Model, State};
use crate::newton::{Control, Monitor, PATIENCE, Verdict};

/// A step to be done.
pub(super) struct Job<'a, M, S: Storage, const N: usize> {
    pub(super) points: &'a mut Points<N, S>,
    pub(super) model: &'a M,
    pub(super) control: &'a Control,
    /// Time and length.
    pub(super) place: (f64, f64),
    /// The start, and what it is more than its rounded numbers.
    pub(super) start: (&'a State<N>, &'a State<N>),
    /// Newton's method may follow.
    pub(super) yielding: bool,
}

impl<M, S: Storage, const N: usize> Job<'_, M, S, N>
where
    M: Model<N>,
{
    /// In the registers of the processor.
    pub(super) fn run(self) -> Outcome<N> {
        #[cfg(all(feature = "simd", target_arch = "x86_64"))]
        if let Some(isa) = self.points.isa {
            return isa.vectorize(InRegisters { job: self, isa });
        }
        self.step(crate::Lanes([0.0; 4]))
    }

    /// The whole step.
    #[inline(always)]
    fn step<V: Four>(self, like: V) -> Outcome<N> {
        let Self {
            points,
            model,
            control,
            yielding,
            ..
        } = self;
        let mut local = None;
        let groups = points.tables.groups;
        let work = Work::<N, S>::of::<M>(&mut points.work, &mut local, groups);
        if points.is_warm {
            if const { is_second_order::<M, N>() || is_phase::<M, N>() } {
                (points.tables.continued()).apply(like, &points.forces, &mut work.forces);
            } else {
                // The first iteration takes what low words of the tables make of them.
                work.forces.copy_from_slice(&points.forces);
            }
            if const { !is_second_order::<M, N>() } {
                (points.tables.continued()).apply(like, &points.rates, &mut work.rates);
            }
        } else {
            work.forces.copy_from_slice(&points.forces);
            work.rates.copy_from_slice(&points.rates);
        }
        let leg = Leg {
            t: self.place.0,
            h: self.place.1,
            start: self.start.0,
            low: self.start.1,
            tables: &points.tables,
            inertia: &points.inertia,
        };
        work.distance = largest(&leg.start.q);
        if const { is_second_order::<M, N>() } {
            work.begin_second_order(like, &leg);
            work.speed = largest(&work.velocity);
        } else {
            work.speed = largest(&leg.start.p);
        }
        let is_rough = control.is_rough();
        let mut monitor = Monitor::new(control.tolerance);
        let most = if yielding {
            control.max_iterations.min(PATIENCE)
        } else {
            control.max_iterations
        };
        let (mut iterations, mut refresh, mut converged) = (0, true, false);
        if const { is_second_order::<M, N>() } {
            work.integrate_twice(like, &leg);
            if is_rough {
                work.set_drift(like, &leg);
            } else {
                work.set_exact_drift(like, &leg);
            }
        } else if !is_rough {
            work.set_low(like, &leg);
        }
        while iterations < most {
            // Constant conditions, so that of the three iterations one is compiled.
            let increment = if const { is_second_order::<M, N>() } {
                work.sweep_second_order::<V, M>(like, model, &leg)
            } else if const { is_phase::<M, N>() } {
                work.sweep_phase::<V, M>(like, model, &leg, iterations == 0, refresh)
            } else {
                work.sweep_velocity::<V, M>(like, model, &leg, refresh)
            };
            iterations += 1;
            match monitor.judge(increment) {
                Ok(Verdict::Converged) => {
                    converged = true;
                    break;
                }
                Ok(Verdict::GoOn) => {}
                Err(_) => break,
            }
            // The start is good to a few digits, so one evaluation of mass matrices mostly serves.
            refresh = monitor.rate() > 0.1;
            let is_hopeless =
                yielding && iterations > 2 && monitor.is_hopeless(most - iterations + 1);
            if is_hopeless || monitor.is_stuck() {
                break;
            }
            if const { is_second_order::<M, N>() } {
                work.integrate_twice(like, &leg);
            }
        }
        converged |= monitor.is_at_round_off();
        // No closures here: they would be compiled for the instruction set of the crate, not for that of the place of the call.
        let mut end = None;
        if converged && monitor.evidence(yielding).check(control.solve).is_ok() {
            let (state, low) = if const { is_second_order::<M, N>() } {
                if is_rough {
                    work.finish_second_order::<V, false>(like, &leg)
                } else {
                    work.finish_second_order::<V, true>(like, &leg)
                }
            } else if is_rough {
                work.finish::<V, false>(like, &leg)
            } else {
                work.finish::<V, true>(like, &leg)
            };
            if is_finite(&state) {
                end = Some((state, low));
                // What a failed step would have to start from is kept until here.
                core::mem::swap(&mut points.forces, &mut work.forces);
                core::mem::swap(&mut points.rates, &mut work.rates);
                points.velocity = work.velocity;
            }
        }
        Outcome {
            end,
            iterations,
            residual: monitor.last(),
            contraction: monitor.rate(),
        }
    }
}

#[cfg(all(feature = "simd", target_arch = "x86_64"))]
struct InRegisters<'a, M, S: Storage, const N: usize> {
    job: Job<'a, M, S, N>,
    isa: pulp::x86::V3,
}

#[cfg(all(feature = "simd", target_arch = "x86_64"))]
impl<M: Model<N>, S: Storage, const N: usize> pulp::NullaryFnOnce for InRegisters<'_, M, S, N> {
    type Output = Outcome<N>;
    #[inline(always)]
    fn call(self) -> Outcome<N> {
        self.job.step(crate::quad::Quad::of(self.isa, [0.0; 4]))
    }
}
