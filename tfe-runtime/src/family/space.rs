//! The passes of the fixed-point iteration for M q̈ = f(q, q̇, t), for all points of an element, four points in a
//! register, and any number of coordinates.
//!
//! ```text
//! q_l = q₀ + h Σ A_lj v₀ + h² Σ (A²)_lj M⁻¹ f_j ,     unknown f
//! ```
//!
//! The equations are those of fixed-size models; the order in memory is another one, all coordinates for each group of
//! four points, so that loops run through memory once. The data of long chains do not fit into a cache. Therefore a
//! pass that compares forces with those before also places the next group of points while the data are at hand, and it
//! follows a kernel that runs through its sites in strides.

use super::inertia::Inertia;
use super::lanes::{Largest, at_points, product, rows};
use super::model::{FamilyState, Gradient, Model};
use crate::double_double::DoubleDouble;
use crate::model::Form;
use crate::points::end::moved;
use crate::points::tables::Tables;
use crate::precise::{add_exactly, exact_term};
use crate::registers::four::{Four, block, put};
use crate::registers::storage::Heap;
use crate::registers::storage::MAX_GROUPS;
use alloc::vec;
use alloc::vec::Vec;
use core::ops::Range;

/// Everything that does not depend on the kind of registers.
#[derive(Clone, Debug)]
pub(super) struct Problem {
    pub(super) tables: Tables<Heap>,
    pub(super) inertia: Inertia,
    pub(super) velocity: Vec<f64>,
    pub(super) velocity_low: Vec<f64>,
}

/// The properties of a model that the passes need.
#[derive(Clone, Copy, Debug)]
pub(super) struct Kind {
    form: Form,
    /// Whether there are forces Q, which may depend on velocities (momenta).
    forced: bool,
    /// Whether the kernel adds to its output, which then has to be zero before.
    adds: bool,
}

impl Kind {
    pub(super) fn of<M: Model>() -> Self {
        Self {
            form: M::FORM,
            forced: M::FACTS.forced,
            adds: !M::ASSIGNS,
        }
    }
}

/// The unknowns at all points: for each group of four points, all coordinates.
#[derive(Clone, Debug)]
pub(super) struct Space<V> {
    like: V,
    kind: Kind,
    n: usize,
    /// L_q + Q
    forces: Vec<V>,
    /// The displacement of the points from the start without forces: h c_l v₀, and the contributions of the low words
    /// of state and tables.
    drift: Vec<V>,
    /// Coordinates, velocities (momenta) and derivatives of one group of points.
    q: Vec<V>,
    z: Vec<V>,
    by_q: Vec<V>,
    force: Vec<V>,
}

/// The time, length and start of a step.
#[derive(Clone, Copy)]
pub(super) struct StepInput<'a> {
    pub(super) t: f64,
    pub(super) h: f64,
    pub(super) start: &'a FamilyState,
    pub(super) low: &'a FamilyState,
}

/// One pass through all coordinates.
pub(super) enum Pass<'a> {
    /// Places all points at the start.
    Stand,
    /// Uses the derivatives of the current group as the forces at all points.
    Spread,
    /// Sets the initial guess of the forces, from the current derivatives or by extrapolation of the last element's
    /// polynomial, and the contributions of low words; places the first group.
    Begin { is_warm: bool },
    /// Places the points of a group.
    #[cfg(feature = "sparse")]
    Place { group: usize },
    /// Uses the current derivatives as the forces of a group for some coordinates, and places these coordinates at the
    /// points of the next group.
    Settle { group: usize, range: Range<usize> },
    /// The difference between the current derivatives and the forces of a group, with the points of a coordinate next
    /// to each other.
    #[cfg(feature = "sparse")]
    Rest { group: usize, rest: &'a mut [f64] },
    /// Computes the end of the element.
    End {
        end: &'a mut FamilyState,
        low: &'a mut FamilyState,
    },
}

/// The largest change of an acceleration and the largest acceleration; NaN if a value is not finite.
#[derive(Clone, Copy)]
pub(super) struct Sizes {
    pub(super) changed: f64,
    pub(super) size: f64,
}

impl Sizes {
    pub(super) const NONE: Self = Self {
        changed: 0.0,
        size: 0.0,
    };

    /// The maximum of both.
    pub(super) fn and(self, other: Self) -> Self {
        let larger = |a: f64, b: f64| a.max(b) + 0.0 * (a + b);
        Self {
            changed: larger(self.changed, other.changed),
            size: larger(self.size, other.size),
        }
    }
}

impl Pass<'_> {
    /// Runs a pass, with the number of groups known to the compiler; only [`Pass::Settle`] and [`Pass::End`] return
    /// sizes.
    #[inline(always)]
    pub(super) fn run<V: Four>(
        self,
        space: &mut Space<V>,
        problem: &Problem,
        input: StepInput<'_>,
    ) -> Sizes {
        match problem.tables.groups {
            1 => self.run_for::<V, 1>(space, problem, input),
            2 => self.run_for::<V, 2>(space, problem, input),
            3 => self.run_for::<V, 3>(space, problem, input),
            _ => self.run_for::<V, MAX_GROUPS>(space, problem, input),
        }
    }

    #[inline(always)]
    fn run_for<V: Four, const G: usize>(
        self,
        space: &mut Space<V>,
        problem: &Problem,
        input: StepInput<'_>,
    ) -> Sizes {
        match self {
            Pass::Stand => space.stand(problem, input),
            Pass::Spread => space.spread(),
            Pass::Begin { is_warm } => space.begin::<G>(problem, input, is_warm),
            #[cfg(feature = "sparse")]
            Pass::Place { group } => space.place::<G>(problem, input, group),
            Pass::Settle { group, range } if space.kind.forced => {
                return space.settle::<G, true>(problem, input, group, range);
            }
            Pass::Settle { group, range } => {
                return space.settle::<G, false>(problem, input, group, range);
            }
            #[cfg(feature = "sparse")]
            Pass::Rest { group, rest } => space.rest(&problem.tables, group, rest),
            Pass::End { end, low } => return space.end(problem, input, end, low),
        }
        Sizes::NONE
    }
}

/// How the coordinates at the points of one group follow from the forces at all points.
#[derive(Clone, Copy)]
struct Placement<V, const G: usize> {
    h: V,
    /// h²
    square: V,
    /// A
    once: [[V; 4]; G],
    /// A²
    twice: [[V; 4]; G],
}

impl<V: Four, const G: usize> Placement<V, G> {
    #[inline(always)]
    fn of(like: V, tables: &Tables<Heap>, h: f64, group: usize) -> Self {
        Self {
            h: like.like(h),
            square: like.like(h * h),
            once: rows::<V, G>(like, &tables.once)[group],
            twice: rows::<V, G>(like, &tables.twice)[group],
        }
    }

    #[inline(always)]
    fn position(&self, start: f64, drift: V, accelerations: &[[f64; 4]; G]) -> V {
        let reach = product(self.h, &self.twice, accelerations);
        self.h.like(start) + self.square.times_plus(reach, drift)
    }

    /// Velocity, or momentum.
    #[inline(always)]
    fn rate(&self, start: f64, rates: &[[f64; 4]; G]) -> V {
        let change = product(self.h, &self.once, rates);
        self.h.times_plus(change, self.h.like(start))
    }
}

impl<V: Four> Space<V> {
    pub(super) fn new(like: V, kind: Kind, n: usize, groups: usize) -> Self {
        let zeros = |count: usize| vec![like.like(0.0); count];
        Self {
            like,
            kind,
            n,
            forces: zeros(n * groups),
            drift: zeros(n * groups),
            q: zeros(n),
            // Without forces Q no kernel reads it.
            z: zeros(n),
            by_q: zeros(n),
            force: zeros(if kind.forced { n } else { 0 }),
        }
    }

    /// The slices lent to a kernel.
    #[inline(always)]
    pub(super) fn slices(&mut self) -> (&[V], &[V], Gradient<'_, V>) {
        let first = Gradient {
            z: &mut [],
            q: &mut self.by_q,
            force: &mut self.force,
        };
        (&self.q, &self.z, first)
    }

    /// The number of coordinates.
    pub(super) fn len(&self) -> usize {
        self.n
    }

    /// Coordinates and velocities (momenta) of the current group, a row of n for each point.
    #[cfg(feature = "sparse")]
    pub(super) fn positions(
        &self,
        tables: &Tables<Heap>,
        group: usize,
        q: &mut [f64],
        z: &mut [f64],
    ) {
        for lane in 0..4.min(tables.points - 4 * group) {
            let from = (4 * group + lane) * self.n;
            for a in 0..self.n {
                q[from + a] = self.q[a].lanes()[lane];
                z[from + a] = self.z[a].lanes()[lane];
            }
        }
    }

    /// Sets all forces to zero.
    #[cfg(feature = "sparse")]
    pub(super) fn release(&mut self) {
        self.forces.fill(self.like.like(0.0));
    }

    /// Adds an increment to the forces.
    #[cfg(feature = "sparse")]
    pub(super) fn correct(&mut self, problem: &Problem, steps: &[f64]) -> Sizes {
        let points = problem.tables.points;
        let (mut changed, mut size, mut zero) = (0.0_f64, 0.0_f64, 0.0);
        for group in 0..problem.tables.groups {
            for a in 0..self.n {
                let inverse = problem.inertia.inverse[a].abs();
                let force = &mut self.forces[group * self.n + a];
                let mut lanes = force.lanes();
                for (lane, value) in lanes.iter_mut().enumerate() {
                    // Lanes beyond the last point are copies of it.
                    let step = steps[a * points + (4 * group + lane).min(points - 1)];
                    *value += step;
                    changed = changed.max(inverse * step.abs());
                    size = size.max(inverse * value.abs());
                    zero += 0.0 * *value;
                }
                *force = force.with(lanes);
            }
        }
        Sizes {
            changed: changed + zero,
            size: size + zero,
        }
    }

    #[inline(always)]
    fn stand(&mut self, problem: &Problem, input: StepInput<'_>) {
        let like = self.like;
        let z = match self.kind.form {
            Form::Lagrangian => &problem.velocity,
            Form::Hamiltonian => &input.start.p,
        };
        for a in 0..self.n {
            self.q[a] = like.like(input.start.q[a]);
            self.z[a] = like.like(z[a]);
        }
    }

    #[inline(always)]
    fn spread(&mut self) {
        for a in 0..self.n {
            let force = self.take(a);
            for forces in self.forces.chunks_exact_mut(self.n) {
                forces[a] = force;
            }
        }
    }

    /// L_q + Q of the current evaluation; leaves zeros for the next one.
    #[inline(always)]
    fn take(&mut self, a: usize) -> V {
        let zero = self.like.like(0.0);
        let mut force = self.kind.signed(self.by_q[a]);
        self.by_q[a] = zero;
        if self.kind.forced {
            force += self.force[a];
            self.force[a] = zero;
        }
        force
    }

    #[cfg(feature = "sparse")]
    #[inline(always)]
    fn rest(&mut self, tables: &Tables<Heap>, group: usize, rest: &mut [f64]) {
        let here = 4.min(tables.points - 4 * group);
        for a in 0..self.n {
            let rest_here = self.take(a) - self.forces[group * self.n + a];
            let from = a * tables.points + 4 * group;
            rest[from..from + here].copy_from_slice(&rest_here.lanes()[..here]);
        }
    }

    #[inline(always)]
    fn begin<const G: usize>(&mut self, problem: &Problem, input: StepInput<'_>, is_warm: bool) {
        let (like, n) = (self.like, self.n);
        let h = like.like(input.h);
        let continued = rows::<V, G>(like, problem.tables.continued());
        let low_rows = rows::<V, G>(like, &problem.tables.twice_low);
        let rows = rows::<V, G>(like, &problem.tables.twice);
        let first = Placement::<V, G>::of(like, &problem.tables, input.h, 0);
        let forces = &mut self.forces[..G * n];
        let drift = &mut self.drift[..G * n];
        let (inverse, inverse_low) = (
            &problem.inertia.inverse[..n],
            &problem.inertia.inverse_low[..n],
        );
        let (velocity, velocity_low) = (&problem.velocity[..n], &problem.velocity_low[..n]);
        let (start, low_q) = (&input.start.q[..n], &input.low.q[..n]);
        let q = &mut self.q[..n];
        for a in 0..n {
            if is_warm {
                let old = at_points::<V, G>(forces, n, a, like.like(1.0));
                for (group, row) in continued.iter().enumerate() {
                    forces[group * n + a] = product(like, row, &old);
                }
            }
            let accelerations = at_points::<V, G>(forces, n, a, like.like(inverse[a]));
            // The effect of the rounding error of 1/m on all accelerations.
            let missing = at_points::<V, G>(forces, n, a, like.like(inverse_low[a]));
            let (low_q, low_v) = (like.like(low_q[a]), like.like(velocity_low[a]));
            let v = like.like(velocity[a]);
            for group in 0..G {
                let by_tables = product(like, &low_rows[group], &accelerations);
                let by_masses = product(like, &rows[group], &missing);
                let reach = like.with(problem.tables.reach[group]);
                let reach_low = like.with(problem.tables.reach_low[group]);
                let by_velocity = reach.times_plus(low_v, reach_low * v);
                let rate = h.times_plus(by_tables + by_masses, by_velocity);
                drift[group * n + a] = (h * reach).times_plus(v, h.times_plus(rate, low_q));
            }
            q[a] = first.position(start[a], drift[a], &accelerations);
        }
        if self.kind.forced {
            self.place_rates(problem, input, &first, 0..n);
        }
    }

    #[inline(always)]
    fn settle<const G: usize, const FORCED: bool>(
        &mut self,
        problem: &Problem,
        input: StepInput<'_>,
        group: usize,
        range: Range<usize>,
    ) -> Sizes {
        let (like, n, kind) = (self.like, self.n, self.kind);
        let zero = like.like(0.0);
        let (mut changed, mut size) = (Largest::none(like), Largest::none(like));
        // With several groups, later ones use the forces of this iteration at the points of earlier ones
        // (Gauss–Seidel); the fixed point is the same.
        let next = (group + 1) % G;
        let placement = Placement::<V, G>::of(like, &problem.tables, input.h, next);
        let start = &input.start.q[..n];
        let inverse = &problem.inertia.inverse[..n];
        let by_q = &mut self.by_q[..n];
        let forced = &mut self.force[..if FORCED { n } else { 0 }];
        let drift = &self.drift[next * n..][..n];
        let forces = &mut self.forces[..G * n];
        let q = &mut self.q[..n];
        let range = range.start..range.end.min(n);
        for a in range.clone() {
            let mut force = kind.signed(by_q[a]);
            if kind.adds {
                by_q[a] = zero;
            }
            if FORCED {
                force += forced[a];
                forced[a] = zero;
            }
            // Compared as accelerations: momenta of light and heavy bodies are not comparable.
            let factor = like.like(inverse[a]);
            changed.raise(factor * (force - forces[group * n + a]));
            size.raise(factor * force);
            forces[group * n + a] = force;
            let accelerations = at_points::<V, G>(forces, n, a, factor);
            q[a] = placement.position(start[a], drift[a], &accelerations);
        }
        if FORCED {
            self.place_rates(problem, input, &placement, range);
        }
        Sizes {
            changed: changed.get(),
            size: size.get(),
        }
    }

    #[cfg(feature = "sparse")]
    #[inline(always)]
    fn place<const G: usize>(&mut self, problem: &Problem, input: StepInput<'_>, group: usize) {
        let (like, n) = (self.like, self.n);
        let placement = Placement::<V, G>::of(like, &problem.tables, input.h, group);
        let start = &input.start.q[..n];
        let inverse = &problem.inertia.inverse[..n];
        let drift = &self.drift[group * n..][..n];
        let forces = &self.forces[..G * n];
        for a in 0..n {
            let accelerations = at_points::<V, G>(forces, n, a, like.like(inverse[a]));
            self.q[a] = placement.position(start[a], drift[a], &accelerations);
        }
        if self.kind.forced {
            self.place_rates(problem, input, &placement, 0..n);
        }
    }

    /// Computes velocities or momenta at the points of a group.
    #[inline(always)]
    fn place_rates<const G: usize>(
        &mut self,
        problem: &Problem,
        input: StepInput<'_>,
        placement: &Placement<V, G>,
        range: Range<usize>,
    ) {
        let (like, n) = (self.like, self.n);
        let forces = &self.forces[..G * n];
        let z = &mut self.z[..n];
        match self.kind.form {
            Form::Lagrangian => {
                let (start, inverse) = (&problem.velocity[..n], &problem.inertia.inverse[..n]);
                for a in range {
                    let rates = at_points::<V, G>(forces, n, a, like.like(inverse[a]));
                    z[a] = placement.rate(start[a], &rates);
                }
            }
            Form::Hamiltonian => {
                let start = &input.start.p[..n];
                for a in range {
                    let rates = at_points::<V, G>(forces, n, a, like.like(1.0));
                    z[a] = placement.rate(start[a], &rates);
                }
            }
        }
    }

    /// Computes p₁ = p₀ + h Σ b f and q₁ = q₀ + h (v₀ + h M⁻¹ Σ (bᵀA) f) in more than working precision, four
    /// coordinates at once; the sizes are NaN where the result is not finite.
    #[inline(always)]
    fn end(
        &self,
        problem: &Problem,
        input: StepInput<'_>,
        end: &mut FamilyState,
        low: &mut FamilyState,
    ) -> Sizes {
        let (like, n) = (self.like, self.n);
        let h = like.like(input.h);
        let inertia = &problem.inertia;
        let mut zero = like.like(0.0);
        for at in (0..n).step_by(4) {
            let (force, lever) = self.integrals(&problem.tables, at);
            // 1/m is used with its rounding error, which would otherwise be the same in every step.
            let inverse = block(like, &inertia.inverse, at);
            let inverse_low = block(like, &inertia.inverse_low, at);
            let (acceleration, rest) = inverse.product(lever.0);
            let rest = inverse.times_plus(lever.1, inverse_low.times_plus(lever.0, rest));
            let start = (
                block(like, &problem.velocity, at),
                block(like, &problem.velocity_low, at),
            );
            let velocity = moved::<_, true>(h, (acceleration, rest), start);
            let start = (
                block(like, &input.start.q, at),
                block(like, &input.low.q, at),
            );
            let (q, q_low) = moved::<_, true>(h, velocity, start);
            let start = (
                block(like, &input.start.p, at),
                block(like, &input.low.p, at),
            );
            let (p, p_low) = moved::<_, true>(h, force, start);
            // Zero times a number that is not finite is NaN.
            zero += (q + p) * like.like(0.0);
            put(q, &mut end.q, at);
            put(p, &mut end.p, at);
            put(q_low, &mut low.q, at);
            put(p_low, &mut low.p, at);
        }
        let [a, b, c, d] = zero.lanes();
        let zero = (a + b) + (c + d);
        Sizes {
            changed: zero,
            size: zero,
        }
    }

    /// Σ b f and Σ (bᵀA) f for four coordinates, each with its rounding error: weights and step are the same numbers in
    /// every step, so that the rounding errors of their products are systematic.
    #[inline(always)]
    fn integrals(&self, tables: &Tables<Heap>, at: usize) -> ((V, V), (V, V)) {
        let none = self.like.like(0.0);
        let (mut force, mut lever) = ((none, none), (none, none));
        let last = self.n.min(at + 4);
        for group in 0..tables.groups {
            // Transposes: from one register for each coordinate to one for each point; zeros beyond the last
            // coordinate.
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
                for (sum, weights) in [(&mut force, &tables.weights), (&mut lever, &tables.lever)] {
                    let (weight, low) = weights.of(4 * group + l);
                    let term = exact_term((value.like(weight), value.like(low)), value);
                    add_exactly(sum, term);
                }
            }
        }
        (force, lever)
    }

    /// L_q + Q at one point of the last step.
    pub(super) fn force_at(&self, point: usize, a: usize) -> f64 {
        self.forces[point / 4 * self.n + a].lanes()[point % 4]
    }
}

impl Kind {
    /// L_q, or −H_q.
    #[inline(always)]
    fn signed<V: Four>(self, by_q: V) -> V {
        match self.form {
            Form::Lagrangian => by_q,
            Form::Hamiltonian => -by_q,
        }
    }
}

impl Problem {
    /// Computes the velocity at the start, and the contributions of the low words.
    pub(super) fn begin(&mut self, input: StepInput<'_>) {
        for (a, mass) in self.inertia.mass.iter().enumerate() {
            let p = input.start.p[a];
            // No floating-point velocity belongs exactly to the momentum; the remainder becomes the low word.
            let v = p / mass;
            let rest = DoubleDouble::product(v, *mass);
            let missing = input.low.p[a] + DoubleDouble::new(p).minus(rest).high;
            self.velocity[a] = v;
            self.velocity_low[a] = missing / mass;
        }
    }
}
