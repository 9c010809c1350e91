//! M q̈ = f(q, q̇) for all points of an element, four to a register: the iteration for as many coordinates as there are.
//!
//! ```text
//! q_l = q₀ + h Σ A_lj v₀ + h² Σ (A²)_lj M⁻¹ f_j ,     unknown f
//! ```
//!
//! The same equations as those of fixed-size models, with another order in memory: for each group of four points all coordinates, so that the
//! loops of a kernel run through memory once.

use super::inertia::Inertia;
use super::lanes::{Scale, add_exactly, alone, at_points, product, rows, total};
use super::{FamilyModel, FamilyState, Gradient};
use crate::double_double::DoubleDouble;
use crate::model::Form;
use crate::newton::{Control, Monitor, PATIENCE, Verdict};
use crate::points::end::moved;
use crate::points::four::{Four, block, put};
use crate::points::sweep::Largest;
use crate::points::tables::{MAX_GROUPS, Tables};
use alloc::vec;
use alloc::vec::Vec;

/// Everything that does not depend on the kind of register.
#[derive(Clone, Debug)]
pub(super) struct Problem {
    pub(super) tables: Tables,
    pub(super) inertia: Inertia,
    pub(super) velocity: Vec<f64>,
    pub(super) velocity_low: Vec<f64>,
}

/// The unknowns at all points: for each group of four all coordinates.
#[derive(Clone, Debug)]
pub(super) struct Space<V> {
    like: V,
    n: usize,
    /// L_q + Q
    forces: Vec<V>,
    /// What low words of state and tables add at the points.
    low_position: Vec<V>,
    /// Coordinates, velocities (momenta) and derivatives of one group.
    q: Vec<V>,
    z: Vec<V>,
    by_q: Vec<V>,
    force: Vec<V>,
}

/// Where and from where.
#[derive(Clone, Copy)]
pub(super) struct Leg<'a> {
    pub(super) t: f64,
    pub(super) h: f64,
    pub(super) start: &'a FamilyState,
    pub(super) low: &'a FamilyState,
}

/// What has come of the iteration of a step.
pub(super) struct Outcome {
    pub(super) converged: bool,
    pub(super) iterations: u32,
    /// The last increment, relative, and its ratio to that before.
    pub(super) residual: f64,
    pub(super) contraction: f64,
}

impl<V: Four> Space<V> {
    pub(super) fn new<M: FamilyModel>(like: V, n: usize, groups: usize) -> Self {
        let zeros = |count: usize| vec![like.like(0.0); count];
        let forced = if M::FACTS.forced { n } else { 0 };
        Self {
            like,
            n,
            forces: zeros(n * groups),
            low_position: zeros(n * groups),
            q: zeros(n),
            // Without forces no kernel reads it.
            z: zeros(n),
            by_q: zeros(n),
            force: zeros(forced),
        }
    }

    /// Forces to begin with, and what low words add at the points.
    #[inline(always)]
    pub(super) fn prepare<M: FamilyModel>(
        &mut self,
        model: &M,
        problem: &mut Problem,
        leg: Leg<'_>,
        is_warm: bool,
    ) {
        let groups = problem.tables.groups;
        problem.begin(&leg);
        if is_warm {
            match groups {
                1 => self.apply_continued::<1>(problem),
                2 => self.apply_continued::<2>(problem),
                3 => self.apply_continued::<3>(problem),
                _ => self.apply_continued::<MAX_GROUPS>(problem),
            }
        } else {
            self.start_cold(model, problem, &leg);
        }
        match groups {
            1 => self.begin::<1>(problem, &leg),
            2 => self.begin::<2>(problem, &leg),
            3 => self.begin::<3>(problem, &leg),
            _ => self.begin::<MAX_GROUPS>(problem, &leg),
        }
    }

    /// The fixed-point iteration; with `yielding` it gives up as soon as Newton's method is the better way.
    #[inline(always)]
    pub(super) fn iterate<M: FamilyModel>(
        &mut self,
        model: &M,
        problem: &Problem,
        control: &Control,
        leg: Leg<'_>,
        yielding: bool,
    ) -> Outcome {
        let mut monitor = Monitor::new(control.tolerance);
        let (mut iterations, mut converged) = (0, false);
        let most = if yielding {
            control.max_iterations.min(PATIENCE)
        } else {
            control.max_iterations
        };
        let scale = Scale::of(problem, &leg);
        while iterations < most {
            let (changed, size) = self.sweep(model, problem, &leg);
            iterations += 1;
            match monitor.judge(scale.increment(changed, size)) {
                Ok(Verdict::Converged) => {
                    converged = true;
                    break;
                }
                Ok(Verdict::GoOn) => {}
                Err(_) => break,
            }
            if yielding && iterations > 2 && monitor.is_hopeless(most - iterations + 1) {
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

    /// f(q, z) − f at the points, the points of one coordinate next to each other.
    #[inline(always)]
    pub(super) fn rest<M: FamilyModel>(
        &mut self,
        model: &M,
        problem: &Problem,
        leg: Leg<'_>,
        rest: &mut [f64],
    ) {
        let (like, points) = (self.like, problem.tables.points);
        for group in 0..problem.tables.groups {
            self.set_group::<M>(problem, &leg, group);
            let t = like.like(leg.t) + like.like(leg.h) * like.with(problem.tables.nodes[group]);
            self.evaluate(model, t);
            let here = 4.min(points - 4 * group);
            for a in 0..self.n {
                let rest_here = self.new_force::<M>(a) - self.forces[group * self.n + a];
                let from = a * points + 4 * group;
                rest[from..from + here].copy_from_slice(&rest_here.lanes()[..here]);
            }
        }
    }

    /// Coordinates and velocities (momenta) at all points, a row of n for each.
    pub(super) fn positions<M: FamilyModel>(
        &mut self,
        problem: &Problem,
        leg: Leg<'_>,
        q: &mut [f64],
        z: &mut [f64],
    ) {
        let (n, points) = (self.n, problem.tables.points);
        for group in 0..problem.tables.groups {
            self.set_group::<M>(problem, &leg, group);
            for lane in 0..4.min(points - 4 * group) {
                let from = (4 * group + lane) * n;
                for a in 0..n {
                    q[from + a] = self.q[a].lanes()[lane];
                    z[from + a] = self.z[a].lanes()[lane];
                }
            }
        }
    }

    /// Adds to the forces; the largest change of an acceleration and the largest one.
    #[cfg(feature = "sparse")]
    pub(super) fn correct(&mut self, problem: &Problem, steps: &[f64]) -> (f64, f64) {
        let points = problem.tables.points;
        let (mut changed, mut size, mut zero) = (0.0_f64, 0.0_f64, 0.0);
        for group in 0..problem.tables.groups {
            for a in 0..self.n {
                let inverse = problem.inertia.inverse[a].abs();
                let force = &mut self.forces[group * self.n + a];
                let mut lanes = force.lanes();
                for (lane, value) in lanes.iter_mut().enumerate() {
                    // Beyond the last point there are copies of it.
                    let step = steps[a * points + (4 * group + lane).min(points - 1)];
                    *value += step;
                    changed = changed.max(inverse * step.abs());
                    size = size.max(inverse * value.abs());
                    zero += 0.0 * *value;
                }
                *force = force.with(lanes);
            }
        }
        (changed + zero, size + zero)
    }

    /// The forces at the start, at all points.
    #[inline(always)]
    fn start_cold<M: FamilyModel>(&mut self, model: &M, problem: &Problem, leg: &Leg<'_>) {
        let like = self.like;
        for a in 0..self.n {
            self.q[a] = like.like(leg.start.q[a]);
            self.z[a] = like.like(match M::FORM {
                Form::Lagrangian => problem.velocity[a],
                Form::Hamiltonian => leg.start.p[a],
            });
        }
        self.evaluate(model, like.like(leg.t));
        for group in 0..problem.tables.groups {
            for a in 0..self.n {
                self.forces[group * self.n + a] = self.new_force::<M>(a);
            }
        }
    }

    /// L_q and Q at the coordinates and velocities of one group.
    #[inline(always)]
    fn evaluate<M: FamilyModel>(&mut self, model: &M, t: V) {
        // Not read where there are no forces: the kernel wants slices of full length all the same.
        let first = Gradient {
            z: &mut [],
            q: &mut self.by_q,
            force: &mut self.force,
        };
        model.forces_inline(t, &self.q, &self.z, first);
    }

    #[inline(always)]
    fn new_force<M: FamilyModel>(&self, a: usize) -> V {
        if M::FACTS.forced {
            total::<V, M>(self.by_q[a], self.force[a])
        } else {
            alone::<V, M>(self.by_q[a])
        }
    }

    /// Forces where the last element's polynomial goes on.
    #[inline(always)]
    fn apply_continued<const G: usize>(&mut self, problem: &Problem) {
        let rows = rows::<V, G>(self.like, &problem.tables.continued);
        let forces = &mut self.forces[..G * self.n];
        for a in 0..self.n {
            let old = at_points::<V, G>(forces, self.n, a, self.like.like(1.0));
            for (group, row) in rows.iter().enumerate() {
                forces[group * self.n + a] = product(self.like, row, &old);
            }
        }
    }

    /// What low words of the start and of the tables add at the points.
    #[inline(always)]
    fn begin<const G: usize>(&mut self, problem: &Problem, leg: &Leg<'_>) {
        let (like, n) = (self.like, self.n);
        let h = like.like(leg.h);
        let low_rows = rows::<V, G>(like, &problem.tables.twice_low);
        let rows = rows::<V, G>(like, &problem.tables.twice);
        let (forces, low_position) = (&self.forces[..G * n], &mut self.low_position[..G * n]);
        let (inverse, inverse_low) = (
            &problem.inertia.inverse[..n],
            &problem.inertia.inverse_low[..n],
        );
        let (velocity, velocity_low) = (&problem.velocity[..n], &problem.velocity_low[..n]);
        let low_q = &leg.low.q[..n];
        for a in 0..n {
            let accelerations = at_points::<V, G>(forces, n, a, like.like(inverse[a]));
            // What the one rounding of 1/m takes from all accelerations.
            let missing = at_points::<V, G>(forces, n, a, like.like(inverse_low[a]));
            let (low_q, low_v) = (like.like(low_q[a]), like.like(velocity_low[a]));
            let velocity = like.like(velocity[a]);
            for group in 0..G {
                let by_tables = product(like, &low_rows[group], &accelerations);
                let by_masses = product(like, &rows[group], &missing);
                let reach = like.with(problem.tables.reach[group]);
                let reach_low = like.with(problem.tables.reach_low[group]);
                let drift = reach * low_v + reach_low * velocity;
                let moved = h * (drift + h * (by_tables + by_masses));
                low_position[group * n + a] = low_q + moved;
            }
        }
    }

    /// One iteration; the largest change of an acceleration and the largest one.
    #[inline(always)]
    fn sweep<M: FamilyModel>(&mut self, model: &M, problem: &Problem, leg: &Leg<'_>) -> (f64, f64) {
        let like = self.like;
        let (mut changed, mut size) = (Largest::none(like), Largest::none(like));
        // Of several groups, later ones see forces of this iteration at the points of earlier ones: the fixed point is the same.
        for group in 0..problem.tables.groups {
            self.set_group::<M>(problem, leg, group);
            let t = like.like(leg.t) + like.like(leg.h) * like.with(problem.tables.nodes[group]);
            self.evaluate(model, t);
            let n = self.n;
            let inverse = &problem.inertia.inverse[..n];
            let by_q = &self.by_q[..n];
            let forced = &self.force[..if M::FACTS.forced { n } else { 0 }];
            let forces = &mut self.forces[group * n..][..n];
            for a in 0..n {
                let force = if M::FACTS.forced {
                    total::<V, M>(by_q[a], forced[a])
                } else {
                    alone::<V, M>(by_q[a])
                };
                // As accelerations: momenta of light and heavy bodies say nothing beside each other.
                let inverse = like.like(inverse[a]);
                changed.raise(inverse * (force - forces[a]));
                size.raise(inverse * force);
                forces[a] = force;
            }
        }
        (changed.get(), size.get())
    }

    #[inline(always)]
    fn set_group<M: FamilyModel>(&mut self, problem: &Problem, leg: &Leg<'_>, group: usize) {
        match problem.tables.groups {
            1 => self.set_points::<M, 1>(problem, leg, group),
            2 => self.set_points::<M, 2>(problem, leg, group),
            3 => self.set_points::<M, 3>(problem, leg, group),
            _ => self.set_points::<M, MAX_GROUPS>(problem, leg, group),
        }
    }

    /// Coordinates (and velocities or momenta, where forces depend on them) at the points of one group.
    #[inline(always)]
    fn set_points<M: FamilyModel, const G: usize>(
        &mut self,
        problem: &Problem,
        leg: &Leg<'_>,
        group: usize,
    ) {
        let (like, n) = (self.like, self.n);
        let h = like.like(leg.h);
        let reach = like.with(problem.tables.reach[group]);
        let row = rows::<V, G>(like, &problem.tables.twice)[group];
        let (start, velocity) = (&leg.start.q[..n], &problem.velocity[..n]);
        let inverse = &problem.inertia.inverse[..n];
        let forces = &self.forces[..G * n];
        let low = &self.low_position[group * n..][..n];
        let q = &mut self.q[..n];
        for a in 0..n {
            let accelerations = at_points::<V, G>(forces, n, a, like.like(inverse[a]));
            let by_forces = product(like, &row, &accelerations);
            let moved = h * (reach * like.like(velocity[a]) + h * by_forces);
            q[a] = like.like(start[a]) + (moved + low[a]);
        }
        if !M::FACTS.forced {
            return;
        }
        let row = rows::<V, G>(like, &problem.tables.once)[group];
        let (momentum, z) = (&leg.start.p[..n], &mut self.z[..n]);
        for a in 0..n {
            let (start, factor) = match M::FORM {
                Form::Lagrangian => (velocity[a], inverse[a]),
                Form::Hamiltonian => (momentum[a], 1.0),
            };
            let rates = at_points::<V, G>(forces, n, a, like.like(factor));
            z[a] = like.like(start) + h * product(like, &row, &rates);
        }
    }

    /// p₁ = p₀ + h Σ b f and q₁ = q₀ + h (v₀ + h M⁻¹ Σ (bᵀA) f), to more than the working precision, four coordinates at once; false where that is
    /// not finite.
    #[inline(always)]
    pub(super) fn end(
        &self,
        problem: &Problem,
        leg: Leg<'_>,
        end: &mut FamilyState,
        low: &mut FamilyState,
    ) -> bool {
        let (like, n) = (self.like, self.n);
        let h = like.like(leg.h);
        let inertia = &problem.inertia;
        let mut zero = like.like(0.0);
        for at in (0..n).step_by(4) {
            let (force, lever) = self.integrals(&problem.tables, at);
            // Times 1/m, which has a low word of its own: one rounding of it would be the same in every step.
            let inverse = block(like, &inertia.inverse, at);
            let inverse_low = block(like, &inertia.inverse_low, at);
            let (acceleration, rest) = inverse.product(lever.0);
            let rest = rest + (inverse * lever.1 + inverse_low * lever.0);
            let start = (
                block(like, &problem.velocity, at),
                block(like, &problem.velocity_low, at),
            );
            let velocity = moved::<_, true>(h, (acceleration, rest), start);
            let start = (block(like, &leg.start.q, at), block(like, &leg.low.q, at));
            let (q, q_low) = moved::<_, true>(h, velocity, start);
            let start = (block(like, &leg.start.p, at), block(like, &leg.low.p, at));
            let (p, p_low) = moved::<_, true>(h, force, start);
            // Zero times what is not finite is a NaN.
            zero += (q + p) * like.like(0.0);
            put(q, &mut end.q, at);
            put(p, &mut end.p, at);
            put(q_low, &mut low.q, at);
            put(p_low, &mut low.p, at);
        }
        let [a, b, c, d] = zero.lanes();
        (a + b) + (c + d) == 0.0
    }

    /// Σ b f and Σ (bᵀA) f at four coordinates, each a number and what rounding took from it: weights and step are the same numbers in every
    /// step, and what their products lose is no chance.
    #[inline(always)]
    fn integrals(&self, tables: &Tables, at: usize) -> ((V, V), (V, V)) {
        let none = self.like.like(0.0);
        let (mut force, mut lever) = ((none, none), (none, none));
        let last = self.n.min(at + 4);
        for group in 0..tables.groups {
            // From a register for each coordinate to one for each point; zeros beyond the last coordinate.
            let mut by_point = [[0.0; 4]; 4];
            let row = &self.forces[group * self.n..(group + 1) * self.n];
            for (k, value) in row[at..last].iter().enumerate() {
                let value = value.lanes();
                for l in 0..4 {
                    by_point[l][k] = value[l];
                }
            }
            for l in 0..4.min(tables.points - 4 * group) {
                let value = self.like.with(by_point[l]);
                add_exactly(&mut force, tables.weights.of(4 * group + l), value);
                add_exactly(&mut lever, tables.lever.of(4 * group + l), value);
            }
        }
        (force, lever)
    }

    /// L_q + Q at one point of the last step.
    pub(super) fn force_at(&self, point: usize, a: usize) -> f64 {
        self.forces[point / 4 * self.n + a].lanes()[point % 4]
    }
}

impl Problem {
    /// Velocity at the start, and what low words add.
    fn begin(&mut self, leg: &Leg<'_>) {
        for (a, mass) in self.inertia.mass.iter().enumerate() {
            let p = leg.start.p[a];
            // The momentum belongs to no rounded velocity; the rest counts as low word.
            let v = p / mass;
            let rest = DoubleDouble::product(v, *mass);
            let missing = leg.low.p[a] + DoubleDouble::new(p).minus(rest).high;
            self.velocity[a] = v;
            self.velocity_low[a] = missing / mass;
        }
    }
}
