//! M q̈ = f(q, q̇, t) for all points of an element, four to a register: the passes of the iteration over as many coordinates as there are.
//!
//! ```text
//! q_l = q₀ + h Σ A_lj v₀ + h² Σ (A²)_lj M⁻¹ f_j ,     unknown f
//! ```
//!
//! The same equations as those of fixed-size models, with another order in memory: for each group of four points all coordinates, so that
//! loops run through memory once. Long chains do not fit into a cache: a pass that compares forces with those before places the next
//! group of points too, while they are at hand, and follows a kernel that runs through its sites in strides.

use super::inertia::Inertia;
use super::lanes::{at_points, product, rows};
use super::model::{FamilyState, Gradient, Model};
use crate::double_double::DoubleDouble;
use crate::model::Form;
use crate::points::arrangement::Size;
use crate::points::end::moved;
use crate::points::sweep::Largest;
use crate::points::tables::Tables;
use crate::precise::{add_exactly, exact_term};
use crate::registers::four::{Four, block, put};
use crate::registers::storage::Heap;
use crate::registers::storage::MAX_GROUPS;
use alloc::vec;
use alloc::vec::Vec;
use core::ops::Range;

/// Everything that does not depend on the kind of register.
#[derive(Clone, Debug)]
pub(super) struct Problem {
    pub(super) tables: Tables<Heap>,
    pub(super) inertia: Inertia,
    pub(super) velocity: Vec<f64>,
    pub(super) velocity_low: Vec<f64>,
}

/// What the passes have to know about a model.
#[derive(Clone, Copy, Debug)]
pub(super) struct Kind {
    form: Form,
    /// Whether there are forces Q, which may depend on velocities (momenta).
    forced: bool,
    /// Whether the kernel adds to zeros.
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

/// The unknowns at all points: for each group of four all coordinates.
#[derive(Clone, Debug)]
pub(super) struct Space<V> {
    like: V,
    kind: Kind,
    n: usize,
    /// L_q + Q
    forces: Vec<V>,
    /// How far the points are from the start without forces: h c_l v₀, and what low words of state and tables add.
    drift: Vec<V>,
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

/// One run through all coordinates.
pub(super) enum Pass<'a> {
    /// Places all points at the start.
    Stand,
    /// Takes the derivatives at hand for the forces at all points.
    Spread,
    /// Forces to begin with, those at hand or where the last element's polynomial goes on; what low words add; places the first group.
    Begin { is_warm: bool },
    /// Places the points of a group.
    #[cfg(feature = "sparse")]
    Place { group: usize },
    /// Takes the derivatives at hand for the forces of a group at some coordinates, and places them at the points of the next one.
    Settle { group: usize, range: Range<usize> },
    /// What the derivatives at hand are beyond the forces of a group, the points of one coordinate next to each other.
    #[cfg(feature = "sparse")]
    Rest { group: usize, rest: &'a mut [f64] },
    /// The end of the element.
    End {
        end: &'a mut FamilyState,
        low: &'a mut FamilyState,
    },
}

/// The largest change of an acceleration and the largest one; NaN where something is not finite.
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

    /// Of both.
    pub(super) fn and(self, other: Self) -> Self {
        let larger = |a: f64, b: f64| a.max(b) + 0.0 * (a + b);
        Self {
            changed: larger(self.changed, other.changed),
            size: larger(self.size, other.size),
        }
    }
}

impl Pass<'_> {
    /// Runs, with the number of groups known to the compiler; only [`Pass::Settle`] and [`Pass::End`] have something to say.
    #[inline(always)]
    pub(super) fn run<V: Four>(
        self,
        space: &mut Space<V>,
        problem: &Problem,
        leg: Leg<'_>,
    ) -> Sizes {
        match problem.tables.groups {
            1 => self.run_for::<V, 1>(space, problem, leg),
            2 => self.run_for::<V, 2>(space, problem, leg),
            3 => self.run_for::<V, 3>(space, problem, leg),
            _ => self.run_for::<V, MAX_GROUPS>(space, problem, leg),
        }
    }

    #[inline(always)]
    fn run_for<V: Four, const G: usize>(
        self,
        space: &mut Space<V>,
        problem: &Problem,
        leg: Leg<'_>,
    ) -> Sizes {
        match self {
            Pass::Stand => space.stand(problem, leg),
            Pass::Spread => space.spread(),
            Pass::Begin { is_warm } => space.begin::<G>(problem, leg, is_warm),
            #[cfg(feature = "sparse")]
            Pass::Place { group } => space.place::<G>(problem, leg, group),
            Pass::Settle { group, range } if space.kind.forced => {
                return space.settle::<G, true>(problem, leg, group, range);
            }
            Pass::Settle { group, range } => {
                return space.settle::<G, false>(problem, leg, group, range);
            }
            #[cfg(feature = "sparse")]
            Pass::Rest { group, rest } => space.rest(&problem.tables, group, rest),
            Pass::End { end, low } => return space.end(problem, leg, end, low),
        }
        Sizes::NONE
    }
}

/// How the points of one group follow from forces at all of them.
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
            // Without forces no kernel reads it.
            z: zeros(n),
            by_q: zeros(n),
            force: zeros(if kind.forced { n } else { 0 }),
        }
    }

    /// What a kernel is lent.
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

    /// Coordinates and velocities (momenta) of the group at hand, a row of n for each point.
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

    /// No forces.
    #[cfg(feature = "sparse")]
    pub(super) fn release(&mut self) {
        self.forces.fill(self.like.like(0.0));
    }

    /// Adds to the forces.
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
        Sizes {
            changed: changed + zero,
            size: size + zero,
        }
    }

    #[inline(always)]
    fn stand(&mut self, problem: &Problem, leg: Leg<'_>) {
        let like = self.like;
        let z = match self.kind.form {
            Form::Lagrangian => &problem.velocity,
            Form::Hamiltonian => &leg.start.p,
        };
        for a in 0..self.n {
            self.q[a] = like.like(leg.start.q[a]);
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

    /// L_q + Q of the evaluation at hand; leaves zeros for the next one.
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
    fn begin<const G: usize>(&mut self, problem: &Problem, leg: Leg<'_>, is_warm: bool) {
        let (like, n) = (self.like, self.n);
        let h = like.like(leg.h);
        let continued = rows::<V, G>(like, problem.tables.continued());
        let low_rows = rows::<V, G>(like, &problem.tables.twice_low);
        let rows = rows::<V, G>(like, &problem.tables.twice);
        let first = Placement::<V, G>::of(like, &problem.tables, leg.h, 0);
        let forces = &mut self.forces[..G * n];
        let drift = &mut self.drift[..G * n];
        let (inverse, inverse_low) = (
            &problem.inertia.inverse[..n],
            &problem.inertia.inverse_low[..n],
        );
        let (velocity, velocity_low) = (&problem.velocity[..n], &problem.velocity_low[..n]);
        let (start, low_q) = (&leg.start.q[..n], &leg.low.q[..n]);
        let q = &mut self.q[..n];
        for a in 0..n {
            if is_warm {
                let old = at_points::<V, G>(forces, n, a, like.like(1.0));
                for (group, row) in continued.iter().enumerate() {
                    forces[group * n + a] = product(like, row, &old);
                }
            }
            let accelerations = at_points::<V, G>(forces, n, a, like.like(inverse[a]));
            // What the one rounding of 1/m takes from all accelerations.
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
            self.place_rates(problem, leg, &first, 0..n);
        }
    }

    #[inline(always)]
    fn settle<const G: usize, const FORCED: bool>(
        &mut self,
        problem: &Problem,
        leg: Leg<'_>,
        group: usize,
        range: Range<usize>,
    ) -> Sizes {
        let (like, n, kind) = (self.like, self.n, self.kind);
        let zero = like.like(0.0);
        let (mut changed, mut size) = (Largest::none(like), Largest::none(like));
        // Of several groups, later ones see forces of this iteration at the points of earlier ones: the fixed point is the same.
        let next = (group + 1) % G;
        let placement = Placement::<V, G>::of(like, &problem.tables, leg.h, next);
        let start = &leg.start.q[..n];
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
            // As accelerations: momenta of light and heavy bodies say nothing beside each other.
            let factor = like.like(inverse[a]);
            changed.raise(factor * (force - forces[group * n + a]));
            size.raise(factor * force);
            forces[group * n + a] = force;
            let accelerations = at_points::<V, G>(forces, n, a, factor);
            q[a] = placement.position(start[a], drift[a], &accelerations);
        }
        if FORCED {
            self.place_rates(problem, leg, &placement, range);
        }
        Sizes {
            changed: changed.get(),
            size: size.get(),
        }
    }

    #[cfg(feature = "sparse")]
    #[inline(always)]
    fn place<const G: usize>(&mut self, problem: &Problem, leg: Leg<'_>, group: usize) {
        let (like, n) = (self.like, self.n);
        let placement = Placement::<V, G>::of(like, &problem.tables, leg.h, group);
        let start = &leg.start.q[..n];
        let inverse = &problem.inertia.inverse[..n];
        let drift = &self.drift[group * n..][..n];
        let forces = &self.forces[..G * n];
        for a in 0..n {
            let accelerations = at_points::<V, G>(forces, n, a, like.like(inverse[a]));
            self.q[a] = placement.position(start[a], drift[a], &accelerations);
        }
        if self.kind.forced {
            self.place_rates(problem, leg, &placement, 0..n);
        }
    }

    /// Velocities or momenta at the points of a group.
    #[inline(always)]
    fn place_rates<const G: usize>(
        &mut self,
        problem: &Problem,
        leg: Leg<'_>,
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
                let start = &leg.start.p[..n];
                for a in range {
                    let rates = at_points::<V, G>(forces, n, a, like.like(1.0));
                    z[a] = placement.rate(start[a], &rates);
                }
            }
        }
    }

    /// p₁ = p₀ + h Σ b f and q₁ = q₀ + h (v₀ + h M⁻¹ Σ (bᵀA) f), to more than the working precision, four coordinates at once; sizes are NaN
    /// where that is not finite.
    #[inline(always)]
    fn end(
        &self,
        problem: &Problem,
        leg: Leg<'_>,
        end: &mut FamilyState,
        low: &mut FamilyState,
    ) -> Sizes {
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
            let rest = inverse.times_plus(lever.1, inverse_low.times_plus(lever.0, rest));
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
        let zero = (a + b) + (c + d);
        Sizes {
            changed: zero,
            size: zero,
        }
    }

    /// Σ b f and Σ (bᵀA) f at four coordinates, each a number and what rounding took from it: weights and step are the same numbers in every
    /// step, and what their products lose is no chance.
    #[inline(always)]
    fn integrals(&self, tables: &Tables<Heap>, at: usize) -> ((V, V), (V, V)) {
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
    /// Velocity at the start, and what low words add.
    pub(super) fn begin(&mut self, leg: Leg<'_>) {
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
