//! The unknowns of models of run-time length in the widest registers of the processor, and their fixed-point iteration.

use super::kernel::Kernel;
use super::model::FamilyState;
use super::running::{Passes, Place, Running};
use super::scale::Scale;
use super::settling::{Settling, in_velocity};
use super::space::{Kind, Pass, Problem, Sizes, Space, StepInput};
use crate::lanes::Lanes;
use crate::newton::{Control, Monitor, PATIENCE, Verdict};
#[cfg(all(feature = "simd", target_arch = "x86_64"))]
use crate::registers::quad::Quad;
use crate::unlike::raise;
use alloc::vec::Vec;

/// The unknowns of a step.
#[derive(Clone, Debug)]
pub(super) enum Registers {
    #[cfg(all(feature = "simd", target_arch = "x86_64"))]
    Quads(Space<Quad>, pulp::x86::V3),
    Lanes(Space<Lanes<4>>),
}

/// The outcome of the iteration of a step.
pub(super) struct Outcome {
    pub(super) converged: bool,
    pub(super) iterations: u32,
    /// The last increment, relative to the state, and its ratio to the one before.
    pub(super) residual: f64,
    pub(super) contraction: f64,
}

impl Registers {
    pub(super) fn new(kind: Kind, n: usize, groups: usize) -> Self {
        #[cfg(all(feature = "simd", target_arch = "x86_64"))]
        if let Some(isa) = pulp::x86::V3::try_new() {
            return Self::Quads(Space::new(Quad::of(isa, [0.0; 4]), kind, n, groups), isa);
        }
        Self::Lanes(Space::new(Lanes([0.0; 4]), kind, n, groups))
    }

    /// Sets the initial guess of the forces and the contributions of the low words, and places the first group of
    /// points.
    pub(super) fn prepare(
        &mut self,
        kernel: &dyn Kernel,
        problem: &mut Problem,
        input: StepInput<'_>,
        is_warm: bool,
    ) {
        problem.begin(input);
        if !is_warm {
            self.run(Pass::Stand, problem, input);
            // The forces at the start, at all points.
            let standing = StepInput { h: 0.0, ..input };
            self.evaluate(kernel, problem, standing, 0, false);
            self.run(Pass::Spread, problem, input);
        }
        self.run(Pass::Begin { is_warm }, problem, input);
    }

    /// The fixed-point iteration; with `yielding` it gives up as soon as Newton's method is cheaper.
    pub(super) fn iterate(
        &mut self,
        kernel: &dyn Kernel,
        problem: &Problem,
        (control, yielding): (&Control, bool),
        input: StepInput<'_>,
        settling: &mut Settling,
    ) -> Outcome {
        let mut monitor = Monitor::of_fixed_point(control.tolerance);
        let (mut iterations, mut converged, mut settles) = (0, false, false);
        let most = if yielding {
            control.max_iterations.min(PATIENCE)
        } else {
            control.max_iterations
        };
        let scale = Scale::of(problem, input);
        while iterations < most {
            if settles {
                self.copy_forces(problem, &mut settling.before);
            }
            let mut sizes = Sizes::NONE;
            for group in 0..problem.tables.groups {
                sizes = sizes.and(self.evaluate(kernel, problem, input, group, true));
            }
            iterations += 1;
            let verdict = if settles {
                let own = self.own_increment(problem, input.h, settling);
                own.map_or(Ok(Verdict::Converged), |own| monitor.settle(own))
            } else {
                monitor.judge(scale.increment(sizes))
            };
            match verdict {
                Ok(Verdict::Converged)
                    if !settles
                        && !control.is_rough()
                        && self.has_small(problem, input.h, settling) =>
                {
                    settles = true;
                    monitor.begin_to_settle();
                }
                Ok(Verdict::Converged) => {
                    // Without Newton's method there is no alternative.
                    converged = !yielding || monitor.evidence(true).check(control.solve).is_ok();
                    break;
                }
                Ok(Verdict::GoOn) => {}
                Err(_) => break,
            }
            let may_be_hopeless = yielding && iterations > 2 && !settles;
            let is_hopeless = may_be_hopeless && monitor.is_hopeless(most - iterations + 1);
            if is_hopeless || monitor.is_stuck() {
                break;
            }
        }
        Outcome {
            converged,
            iterations,
            residual: monitor.last(),
            contraction: monitor.rate(),
        }
    }

    /// Whether a declaration of coordinates is small beside the largest one.
    fn has_small(&self, problem: &Problem, h: f64, settling: &mut Settling) -> bool {
        if !settling.declarations.may_be_unlike(&problem.velocity) {
            return false;
        }
        self.copy_forces(problem, &mut settling.before);
        self.own_increment(problem, h, settling).is_some()
    }

    /// Copies the forces at all points.
    fn copy_forces(&self, problem: &Problem, forces: &mut Vec<f64>) {
        let points = problem.tables.points;
        let count = problem.velocity.len() * points;
        forces.clear();
        forces.extend((0..count).map(|k| self.force_at(k % points, k / points)));
    }

    /// The change of the forces since they were copied, relative to the size of each declaration of coordinates.
    fn own_increment(&self, problem: &Problem, h: f64, settling: &Settling) -> Option<f64> {
        let points = problem.tables.points;
        let Settling {
            declarations,
            before,
        } = settling;
        declarations.own_increment(0.0, |a| {
            let (mut largest, mut change) = (0.0, 0.0);
            for l in 0..points {
                let force = self.force_at(l, a);
                raise(&mut largest, force.abs());
                raise(&mut change, (force - before[a * points + l]).abs());
            }
            in_velocity(problem, (h, a), (largest, change))
        })
    }

    /// The residual f(q, z) − f at the points, with the points of a coordinate next to each other.
    #[cfg(feature = "sparse")]
    pub(super) fn rest(
        &mut self,
        kernel: &dyn Kernel,
        problem: &Problem,
        input: StepInput<'_>,
        rest: &mut [f64],
    ) {
        for group in 0..problem.tables.groups {
            self.run(Pass::Place { group }, problem, input);
            self.evaluate(kernel, problem, input, group, false);
            self.run(Pass::Rest { group, rest }, problem, input);
        }
    }

    /// Coordinates and velocities (momenta) at all points, a row of n for each.
    #[cfg(feature = "sparse")]
    pub(super) fn positions(
        &mut self,
        problem: &Problem,
        input: StepInput<'_>,
        q: &mut [f64],
        z: &mut [f64],
    ) {
        for group in 0..problem.tables.groups {
            self.run(Pass::Place { group }, problem, input);
            match self {
                #[cfg(all(feature = "simd", target_arch = "x86_64"))]
                Self::Quads(space, _) => space.positions(&problem.tables, group, q, z),
                Self::Lanes(space) => space.positions(&problem.tables, group, q, z),
            }
        }
    }

    /// Starts from uniform motion, without forces: the forces at the start, applied at all points of a long step, may
    /// lead far away from the motion.
    #[cfg(feature = "sparse")]
    pub(super) fn release(&mut self) {
        match self {
            #[cfg(all(feature = "simd", target_arch = "x86_64"))]
            Self::Quads(space, _) => space.release(),
            Self::Lanes(space) => space.release(),
        }
    }

    /// Adds an increment to the forces.
    #[cfg(feature = "sparse")]
    pub(super) fn correct(&mut self, problem: &Problem, steps: &[f64]) -> Sizes {
        match self {
            #[cfg(all(feature = "simd", target_arch = "x86_64"))]
            Self::Quads(space, _) => space.correct(problem, steps),
            Self::Lanes(space) => space.correct(problem, steps),
        }
    }

    /// Computes the end of the element; false where it is not finite.
    pub(super) fn end(
        &mut self,
        problem: &Problem,
        input: StepInput<'_>,
        end: &mut FamilyState,
        low: &mut FamilyState,
    ) -> bool {
        self.run(Pass::End { end, low }, problem, input).size == 0.0
    }

    /// L_q + Q at one point of the last step.
    pub(super) fn force_at(&self, point: usize, a: usize) -> f64 {
        match self {
            #[cfg(all(feature = "simd", target_arch = "x86_64"))]
            Self::Quads(space, _) => space.force_at(point, a),
            Self::Lanes(space) => space.force_at(point, a),
        }
    }

    /// Evaluates L_q and Q at the points of the group that has been placed. With `settles` they become its forces as
    /// soon as they are computed, and the next group is placed.
    fn evaluate(
        &mut self,
        kernel: &dyn Kernel,
        problem: &Problem,
        input: StepInput<'_>,
        group: usize,
        settles: bool,
    ) -> Sizes {
        let times = problem.tables.nodes[group].map(|node| input.t + input.h * node);
        let place = Place {
            problem,
            input,
            group,
            settles,
        };
        match self {
            #[cfg(all(feature = "simd", target_arch = "x86_64"))]
            Self::Quads(space, isa) => {
                let mut running = Running::new(space, *isa, place);
                kernel.in_quads(*isa, Quad::of(*isa, times), &mut running);
                running.finish()
            }
            Self::Lanes(space) => {
                let mut running = Running::new(space, (), place);
                kernel.in_lanes(Lanes(times), &mut running);
                running.finish()
            }
        }
    }

    fn run(&mut self, pass: Pass<'_>, problem: &Problem, input: StepInput<'_>) -> Sizes {
        match self {
            #[cfg(all(feature = "simd", target_arch = "x86_64"))]
            Self::Quads(space, isa) => isa.run(pass, space, problem, input),
            Self::Lanes(space) => ().run(pass, space, problem, input),
        }
    }
}
