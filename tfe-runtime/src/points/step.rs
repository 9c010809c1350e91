//! A step of one trajectory: start of the iteration, the iteration, the end.

use super::four::Four;
use super::{Leg, Outcome, Points, is_finite, is_phase, is_second_order, largest};
use crate::model::Model;
use crate::newton::{Control, Monitor, PATIENCE, Verdict};

/// A step to be done.
pub(super) struct Job<'a, M, const N: usize> {
    pub(super) points: &'a mut Points<N>,
    pub(super) model: &'a M,
    pub(super) control: &'a Control,
    pub(super) leg: Leg<'a, N>,
    /// Newton's method may follow.
    pub(super) yielding: bool,
}

impl<M, const N: usize> Job<'_, M, N>
where
    M: Model<N>,
{
    /// In the registers of the processor.
    pub(super) fn run(self) -> Outcome {
        // Without kernels for lanes the constant is false, and the compiler drops the call.
        #[cfg(all(feature = "simd", target_arch = "x86_64"))]
        if let (Some(isa), true) = (self.points.isa, M::LANES) {
            return isa.vectorize(InRegisters { job: self, isa });
        }
        self.step(crate::Lanes([0.0; 4]))
    }

    /// The whole step.
    #[inline(always)]
    fn step<V: Four>(self, like: V) -> Outcome {
        let Self {
            points,
            model,
            control,
            leg,
            yielding,
        } = self;
        points.begin::<V, M>(like, &leg);
        let is_rough = control.is_rough();
        let mut monitor = Monitor::new(control.tolerance);
        let most = if yielding {
            control.max_iterations.min(PATIENCE)
        } else {
            control.max_iterations
        };
        let (mut iterations, mut refresh, mut converged) = (0, true, false);
        while iterations < most {
            // Constant conditions, so that of the three iterations one is compiled.
            let increment = if const { is_second_order::<M, N>() } {
                points.integrate_twice(like);
                if iterations == 0 {
                    if is_rough {
                        points.set_drift(like, &leg);
                    } else {
                        points.set_exact_drift(like, &leg);
                    }
                }
                points.sweep_second_order::<V, M>(like, model, &leg)
            } else {
                if iterations == 0 && !is_rough {
                    points.set_low(like, &leg);
                }
                if const { is_phase::<M, N>() } {
                    points.sweep_phase::<V, M>(like, model, &leg, iterations == 0, refresh)
                } else {
                    points.sweep_velocity::<V, M>(like, model, &leg, refresh)
                }
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
        }
        // No closures here: they would be compiled for the instruction set of the crate, not for that of the place of the call.
        let mut arrived = false;
        if converged && monitor.evidence(yielding).check(control.solve).is_ok() {
            if const { is_second_order::<M, N>() } {
                if is_rough {
                    points.finish_second_order::<V, false>(like, &leg);
                } else {
                    points.finish_second_order::<V, true>(like, &leg);
                }
            } else if is_rough {
                points.finish::<V, false>(like, &leg);
            } else {
                points.finish::<V, true>(like, &leg);
            }
            arrived = is_finite(&points.end);
        }
        Outcome {
            arrived,
            iterations,
            residual: monitor.last(),
            contraction: monitor.rate(),
        }
    }
}

#[cfg(all(feature = "simd", target_arch = "x86_64"))]
struct InRegisters<'a, M, const N: usize> {
    job: Job<'a, M, N>,
    isa: pulp::x86::V3,
}

#[cfg(all(feature = "simd", target_arch = "x86_64"))]
impl<M: Model<N>, const N: usize> pulp::NullaryFnOnce for InRegisters<'_, M, N> {
    type Output = Outcome;
    #[inline(always)]
    fn call(self) -> Outcome {
        self.job.step(crate::quad::Quad::of(self.isa, [0.0; 4]))
    }
}

impl<const N: usize> Points<N> {
    /// Start of the iteration: the last element continued.
    #[inline(always)]
    fn begin<V: Four, M>(&mut self, like: V, leg: &Leg<'_, N>)
    where
        M: Model<N>,
    {
        if self.is_warm {
            if const { is_second_order::<M, N>() || is_phase::<M, N>() } {
                (self.tables.continued()).apply(like, &self.forces, &mut self.products);
                core::mem::swap(&mut self.forces, &mut self.products);
            }
            if const { !is_second_order::<M, N>() } {
                (self.tables.continued()).apply(like, &self.rates, &mut self.products);
                core::mem::swap(&mut self.rates, &mut self.products);
            }
        }
        self.distance = largest(&leg.start.q);
        if const { is_second_order::<M, N>() } {
            self.begin_second_order(like, leg);
            self.speed = largest(&self.velocity);
        } else {
            self.speed = largest(&leg.start.p);
        }
    }
}
