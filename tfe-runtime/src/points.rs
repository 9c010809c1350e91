//! The fixed-point iteration of smooth steps for all points of an element at once, four points in each register.
//!
//! The same equations as those of the other forms; for elements that are Runge–Kutta methods with K points, coefficients A, b, c:
//!
//! ```text
//! second order   M q̈ = f(q, t):   q_l = q₀ + h Σ A_lj v₀ + h² Σ (A²)_lj M⁻¹ f_j ,          unknown f
//! velocities     p = L_v:         q_l = q₀ + h Σ A_lj v_j ,  p_l = p₀ + h Σ A_lj f_j ,     unknown v
//! phase space    v = H_p:         the same with v_j = H_p(q_j, p_j),                       unknown v and f
//! ```
//!
//! Primal elements with more points than unknown rates keep rates at all points, too, as numbers that lie on a polynomial of degree n − 2. E P, the nearest
//! such polynomial in the norm of the rule, leaves them as they are, and the equations of `scheme` are, with its matrices:
//!
//! ```text
//! second order   q_l = q₀ + h Σ C_lj v₀ + h² Σ (C G)_lj M⁻¹ f_j ,                                        unknown f
//! velocities     q_l = q₀ + h Σ (C P)_lj v_j ,  Σ (E P)_lj (p_j − p₀) = h Σ (E G)_lj f_j ,               unknown v
//! ```
//!
//! Where kinetic energy is a constant quadratic form of the velocities alone, the first serves and one product with a matrix does for two. What
//! rounding took from the tables is summed once a step, at the start of the iteration. A step whose iteration contracts badly is left to
//! the other forms.

pub(crate) mod arrangement;
#[cfg(feature = "alloc")]
mod computed;
pub(crate) mod end;
pub(crate) mod evaluation;
pub(crate) mod first_order;
pub(crate) mod forms;
pub(crate) mod inertia;
#[cfg(feature = "alloc")]
pub(crate) mod reach;
pub(crate) mod second_order;
mod size;
mod step;
pub(crate) mod sweep;
pub(crate) mod tables;
pub(crate) mod weigh;

use crate::equations::weighted;
use crate::error::StepError;
use crate::lanes::Lanes;
use crate::method::{cold_rate, cold_rates, may_be_phase};
use crate::model::{First, Model, State};
use crate::registers::four::{Four, OutOfLine};
use crate::registers::storage::{Fixed, Keep, List, Row, Storage};
use crate::scheme::{SchemeRef, Tables};
use crate::unlike::Declarations;
use crate::workspace::width;
use core::marker::PhantomData;
use evaluation::Places;
use forms::{is_phase, is_second_order};
use inertia::Inertia;

/// What the stepper carries from one step to the next, in rows for groups of four points.
#[derive(Clone, Debug)]
pub(crate) struct Points<const N: usize, S: Storage> {
    tables: tables::Tables<S>,
    inertia: Inertia<N, S>,
    /// L_q + Q (or π) of the last step: the rates of the momenta.
    forces: S::Groups<Row<N>>,
    /// ν (or κ): the rates of the coordinates.
    rates: S::FirstOrder<Row<N>>,
    /// The velocity at its start, in equations of second order.
    velocity: [f64; N],
    work: S::Kept<Work<N, S>>,
    places: S::Kept<Places<N>>,
    is_warm: bool,
    last_step: f64,
    declarations: Declarations<N>,
    #[cfg(all(feature = "simd", target_arch = "x86_64"))]
    isa: Option<pulp::x86::V3>,
}

/// The unknowns of an element, and scratch memory for their iteration.
#[derive(Clone, Debug)]
struct Work<const N: usize, S: Storage> {
    forces: S::Groups<Row<N>>,
    rates: S::FirstOrder<Row<N>>,
    momenta: S::FirstOrder<Row<N>>,
    velocities: S::FirstOrder<Row<N>>,
    /// Products of the tables with the unknowns.
    products: S::Groups<Row<N>>,
    more_products: S::Groups<Row<N>>,
    /// The contribution of the velocity at the start, in equations of second order.
    drift: S::Groups<Row<N>>,
    /// The contribution of the low words (rounding errors) of state and tables at the points.
    low_position: S::FirstOrder<Row<N>>,
    low_momentum: S::FirstOrder<Row<N>>,
    /// The LU factors of L_vv, or H_pp, where they are not constant.
    masses: S::Varying<[Row<N>; N]>,
    velocity: [f64; N],
    velocity_low: [f64; N],
    /// The largest coordinate at the start, and the largest velocity or momentum.
    distance: f64,
    speed: f64,
}

/// The input of one step: its start, length and time.
struct StepInput<'a, const N: usize, S: Storage> {
    t: f64,
    h: f64,
    start: &'a State<N>,
    low: &'a State<N>,
    tables: &'a Fixed<S>,
    inertia: &'a Inertia<N, S>,
    /// What changes of forces of second-order equations, or of rates of coordinates, are multiplied by before they are
    /// compared with each other.
    factors: [f64; N],
    /// The same for the rates of momenta in phase space.
    force_factors: [f64; N],
}

/// How a step with all points at once has ended.
pub(crate) enum Together {
    Arrived,
    Stalled(StepError),
    LeftToOthers,
}

/// The outcome of the iteration.
struct Outcome<const N: usize> {
    /// The end of the step and its rounding error, which have no meaning after a failure. They are not inside an enum
    /// variant, because the compiler would then take the numbers apart.
    end: (State<N>, State<N>),
    failure: Option<StepError>,
    iterations: u32,
    /// The ratio of the last increment to the one before.
    contraction: f64,
}

impl<const N: usize, S: Storage> Points<N, S> {
    /// `None` unless the model is nonlinear and without constraints, and the element has at most 16 points and one of
    /// these forms.
    pub(crate) fn new<M>(model: &M, tables: tables::Tables<S>) -> Option<Self>
    where
        M: Model<N>,
    {
        let inertia = Inertia::of(model)?;
        let groups = tables.groups;
        let first = if is_second_order::<M, N>() { 0 } else { groups };
        Some(Self {
            inertia,
            forces: List::filled([[0.0; 4]; N], groups),
            rates: List::filled([[0.0; 4]; N], first),
            velocity: [0.0; N],
            work: Keep::keep(|| Work::new(&Needed::by::<M, N>(groups))),
            places: Keep::keep(|| Places::None),
            tables,
            is_warm: false,
            last_step: 0.0,
            declarations: Declarations::of::<M>(),
            #[cfg(all(feature = "simd", target_arch = "x86_64"))]
            isa: pulp::x86::V3::try_new(),
        })
    }

    /// Declares that the next step does not continue the last one.
    pub(crate) fn forget(&mut self) {
        self.is_warm = false;
    }

    /// Copies rates and forces of the last step to where an ordinary step expects them; false if there is no last step.
    pub(crate) fn write_back<M>(&mut self, tables: &impl Tables, numbers: &mut [f64]) -> bool
    where
        M: Model<N>,
    {
        if !self.is_warm {
            return false;
        }
        let element = tables.element();
        let length = element.points() * N;
        let unknowns = element.unknowns() * width(&element, M::FORM, N);
        if const { may_be_phase::<M, N>() } && element.has_phase_form() {
            let (forces, rates) = numbers.split_at_mut(length);
            self.unknowns::<M>(&mut rates[..length], forces);
            return true;
        }
        let (rates, rest) = numbers.split_at_mut(unknowns);
        let forces = &mut rest[2 * unknowns..2 * unknowns + length];
        if element.is_collocated() {
            self.unknowns::<M>(rates, forces);
        } else {
            spread(&self.forces, forces);
            self.unknown_rates::<M>(&tables.view(), forces, rates);
        }
        true
    }

    /// Constant rates as initial guess.
    #[cold]
    fn start_cold<M>(&mut self, model: &M, t: f64, start: &State<N>)
    where
        M: Model<N>,
    {
        let (force, rate) = constant_rates(model, t, start);
        for a in 0..N {
            (self.forces.iter_mut()).for_each(|forces| forces[a] = [force[a]; 4]);
            (self.rates.iter_mut()).for_each(|rates| rates[a] = [rate[a]; 4]);
        }
    }

    /// The rates of coordinates and momenta at the points of the last step, a row of N for each point.
    fn unknowns<M>(&mut self, rates: &mut [f64], forces: &mut [f64])
    where
        M: Model<N>,
    {
        if is_second_order::<M, N>() {
            self.set_rates::<M>(rates);
        } else {
            spread(&self.rates, rates);
        }
        spread(&self.forces, forces);
    }

    /// The unknown rates of an element with more points than unknown rates, a row of N for each.
    fn unknown_rates<M>(&self, scheme: &SchemeRef<'_>, forces: &[f64], rates: &mut [f64])
    where
        M: Model<N>,
    {
        let points = scheme.points();
        let forces = forces.as_chunks::<N>().0;
        for (i, rate) in rates.as_chunks_mut::<N>().0.iter_mut().enumerate() {
            let row = i * points..(i + 1) * points;
            if is_second_order::<M, N>() {
                // ν = v₀ + h M⁻¹ G f
                let impulse = weighted(&scheme.force[row.clone()], &scheme.force_low[row], forces);
                let change = self.inertia.times::<M, _>(0.0, &impulse);
                for a in 0..N {
                    rate[a] = self.velocity[a] + self.last_step * change[a];
                }
                continue;
            }
            *rate = [0.0; N];
            for (l, weight) in scheme.momentum[row].iter().enumerate() {
                for a in 0..N {
                    rate[a] += weight * self.rates[l / 4][a][l % 4];
                }
            }
        }
    }

    /// The velocities at the points, which the iteration of the equations of second order does not need; a row of N for
    /// each.
    fn set_rates<M>(&mut self, rates: &mut [f64])
    where
        M: Model<N>,
    {
        #[cfg(all(feature = "simd", target_arch = "x86_64"))]
        if let Some(isa) = self.isa {
            let like = crate::registers::quad::Quad::of(isa, [0.0; 4]);
            return like.out_of_line(Velocities::<M, S, N>::of(self, rates));
        }
        Velocities::<M, S, N>::of(self, rates).run(Lanes([0.0; 4]));
    }
}

/// Converts groups of four points to a row of N for each point.
fn spread<const N: usize>(groups: &[Row<N>], rows: &mut [f64]) {
    for (group, rows) in groups.iter().zip(rows.as_chunks_mut::<N>().0.chunks_mut(4)) {
        for (lane, row) in rows.iter_mut().enumerate() {
            for a in 0..N {
                row[a] = group[a][lane];
            }
        }
    }
}

/// Computes velocities at the points for equations of second order.
struct Velocities<'a, M, S: Storage, const N: usize> {
    points: &'a mut Points<N, S>,
    rates: &'a mut [f64],
    model: PhantomData<M>,
}

impl<'a, M, S: Storage, const N: usize> Velocities<'a, M, S, N> {
    fn of(points: &'a mut Points<N, S>, rates: &'a mut [f64]) -> Self {
        Self {
            points,
            rates,
            model: PhantomData,
        }
    }
}

impl<M: Model<N>, S: Storage, const N: usize> OutOfLine for Velocities<'_, M, S, N> {
    #[inline(always)]
    fn run<V: Four>(self, like: V) {
        let Self { points, rates, .. } = self;
        let mut local = None;
        let groups = points.tables.groups;
        let work = Work::<N, S>::of::<M>(&mut points.work, &mut local, groups);
        (points.tables.once).apply(like, &[true; N], &points.forces, &mut work.products);
        let (rows, step) = (rates.as_chunks_mut::<N>().0, like.like(points.last_step));
        for (products, rows) in work.products.iter().zip(rows.chunks_mut(4)) {
            for a in 0..N {
                let change = points.inertia.row::<M, _, 4>(like, products, a);
                let velocity = (like.like(points.velocity[a]) + step * change).lanes();
                for (row, velocity) in rows.iter_mut().zip(velocity) {
                    row[a] = velocity;
                }
            }
        }
    }
}

impl<const N: usize, S: Storage> Work<N, S> {
    #[inline(always)]
    fn new(needed: &Needed) -> Self {
        let zero = [[0.0; 4]; N];
        let Needed {
            groups,
            first,
            phase,
            masses,
        } = *needed;
        Self {
            forces: List::filled(zero, groups),
            rates: List::filled(zero, first),
            momenta: List::filled(zero, first),
            velocities: List::filled(zero, phase),
            products: List::filled(zero, groups),
            more_products: List::filled(zero, groups),
            drift: List::filled(zero, groups - first),
            low_position: List::filled(zero, first),
            low_momentum: List::filled(zero, first),
            masses: List::filled([zero; N], masses),
            velocity: [0.0; N],
            velocity_low: [0.0; N],
            distance: 0.0,
            speed: 0.0,
        }
    }

    /// What is kept, or what is made here.
    #[inline(always)]
    fn of<'a, M>(
        kept: &'a mut S::Kept<Self>,
        local: &'a mut Option<Self>,
        groups: usize,
    ) -> &'a mut Self
    where
        M: Model<N>,
    {
        match kept.kept() {
            Some(work) => work,
            None => local.insert(Self::new(&Needed::by::<M, N>(groups))),
        }
    }
}

/// The number of groups of each kind that a model needs: in short runs the amount of memory matters.
struct Needed {
    groups: usize,
    /// For equations of first order.
    first: usize,
    /// For phase space.
    phase: usize,
    /// For mass matrices that vary.
    masses: usize,
}

impl Needed {
    #[inline(always)]
    fn by<M: Model<N>, const N: usize>(groups: usize) -> Self {
        let first = if is_second_order::<M, N>() { 0 } else { groups };
        Self {
            groups,
            first,
            phase: if is_phase::<M, N>() { first } else { 0 },
            masses: if M::FACTS.constant_mass { 0 } else { groups },
        }
    }
}

/// The rates of momenta and coordinates at the start, as a cold initial guess; those of momenta are zero where they are
/// not unknowns.
pub(crate) fn constant_rates<M, const N: usize>(
    model: &M,
    t: f64,
    start: &State<N>,
) -> ([f64; N], [f64; N])
where
    M: Model<N>,
{
    if const { is_phase::<M, N>() } {
        return cold_rates(model, t, start);
    }
    let (mut force, rate) = ([0.0; N], cold_rate(model, t, start));
    if const { is_second_order::<M, N>() } {
        let mut first = First::ZERO;
        model.first(t, &start.q, &rate, &mut first);
        for a in 0..N {
            force[a] = first.q[a] + first.force[a];
        }
    }
    (force, rate)
}

#[cfg(all(test, feature = "simd", target_arch = "x86_64"))]
pub(crate) mod tests {
    use super::forms::has_form;
    use super::*;
    use crate::bundle::Pendulums;
    use crate::method::Memory;
    use crate::model::{CoordinateName, Facts, Form, Second};
    use crate::newton::Control;
    use crate::real::Real;
    use crate::registers::storage::Heap;
    use crate::scheme::SchemeTable;
    use crate::{Mixed, Primal, Radau};

    /// Two bodies, an angle, a force: products, quotients, roots, sines.
    pub(crate) struct Planet;

    impl Model<3> for Planet {
        const FORM: Form = Form::Lagrangian;
        const FACTS: Facts = Facts {
            time_dependent: true,
            forced: true,
            quadratic_in_z: true,
            constant_mass: false,
            linear: false,
            separable: false,
            smooth: true,
        };
        const LANES: bool = true;

        fn energy_function<R: Real>(&self, _: R, _: &[R; 3], v: &[R; 3]) -> R {
            v[0]
        }

        fn first<R: Real>(&self, t: R, q: &[R; 3], v: &[R; 3], first: &mut First<R, 3>) {
            self.first_inline(t, q, v, first);
        }

        fn first_and_mass<R: Real>(
            &self,
            t: R,
            q: &[R; 3],
            v: &[R; 3],
            first: &mut First<R, 3>,
            zz: &mut [[R; 3]; 3],
        ) {
            self.first_and_mass_inline(t, q, v, first, zz);
        }

        #[inline(always)]
        fn first_inline<R: Real>(&self, t: R, q: &[R; 3], v: &[R; 3], first: &mut First<R, 3>) {
            let square = q[0] * q[0] + q[1] * q[1];
            let cube = square * square.sqrt();
            let (sin, cos) = q[2].sin_cos();
            let inertia = R::from_f64(2.0) + cos;
            first.z = [v[0], v[1], inertia * v[2]];
            first.q[0] = -(q[0] / cube);
            first.q[1] = -(q[1] / cube);
            first.q[2] = -(sin * v[2] * v[2] * t.like(0.5));
            first.force[2] = (t + q[0]).cos() - v[2].abs().min(q[1].powi(-2)) * t.like(0.1);
        }

        #[inline(always)]
        fn first_and_mass_inline<R: Real>(
            &self,
            t: R,
            q: &[R; 3],
            v: &[R; 3],
            first: &mut First<R, 3>,
            zz: &mut [[R; 3]; 3],
        ) {
            self.first_inline(t, q, v, first);
            (zz[0][0], zz[1][1]) = (t.like(1.0), t.like(1.0));
            zz[2][2] = t.like(2.0) + q[2].cos();
        }

        fn second<R: Real>(
            &self,
            t: R,
            q: &[R; 3],
            v: &[R; 3],
            first: &mut First<R, 3>,
            second: &mut Second<R, 3>,
        ) {
            self.first_and_mass(t, q, v, first, &mut second.zz);
        }

        fn coordinate_name(_: usize) -> CoordinateName {
            CoordinateName::single("q")
        }
    }

    /// Two hundred steps with and without registers; `turn` changes a state on the way.
    fn has_the_same_bits<M, const N: usize>(
        model: &M,
        start: State<N>,
        turn: impl Fn(i32, &mut State<N>),
    ) where
        M: Model<N>,
    {
        let elements = [
            Mixed::<4>.into(),
            Mixed::<9>.into(),
            Radau::<11>.into(),
            Primal::<3>.into(),
            Primal::<7>.lobatto(),
        ];
        for element in elements {
            if !has_form::<M, N>(&element) {
                continue;
            }
            let table = SchemeTable::new(element).unwrap();
            let tables = tables::Tables::of(&table.view());
            let with = Points::<N, Heap>::new(model, tables).unwrap();
            if with.isa.is_none() {
                return; // Nothing to compare with on this processor.
            }
            let mut without = with.clone();
            without.isa = None;
            for tolerance in [Control::default().tolerance, 1e-9] {
                let control = Control {
                    tolerance,
                    ..Control::default()
                };
                let ends = [&with, &without].map(|points| {
                    let (mut points, mut state) = (points.clone(), start);
                    let mut memory = Memory::new();
                    for step in 0..200 {
                        let place = (0.02 * f64::from(step), 0.02);
                        let method = (model, &table, &control);
                        let outcome = points.step(method, &mut memory, place, &mut state);
                        assert!(matches!(outcome, Together::Arrived));
                        turn(step, &mut state);
                    }
                    (state, memory.low)
                });
                assert_eq!(ends[0], ends[1], "{element}, {tolerance:.0e}");
                assert!(ends[0].0.q[0].is_finite());
            }
        }
    }

    #[test]
    fn every_processor_gives_the_same_bits() {
        let start = State {
            q: [0.4, 0.0, 2e5],
            p: [0.0, 2.0, 0.3],
        };
        // The angle begins where sines of the system are taken, and comes back.
        has_the_same_bits(&Planet, start, |step, state| {
            state.q[2] = if step == 100 { 1.0 } else { state.q[2] };
        });
        let start = State {
            q: [1.0, -2.0],
            p: [0.5, 4.0],
        };
        has_the_same_bits(&Pendulums, start, |_, _| {});
    }
}
