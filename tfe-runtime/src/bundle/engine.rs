//! The engine of a bundle: what all trajectories share, and the choice of the instruction set.

use super::group::{Group, Work};
use super::step::Step;
use super::together::Together;
use crate::lanes::Lanes;
use crate::model::Model;
use crate::newton::Control;
use crate::points::inertia::Inertia;
use crate::points::tables::Tables;
use crate::registers::pair::{Eight, LANES, Pair};
use crate::registers::storage::Heap;
use crate::scheme::{SchemeTable, Tables as _};
use crate::statistics::{Contraction, Statistics};
use crate::unlike::Declarations;

/// The tables and the working memory of steps side by side.
#[derive(Clone, Debug)]
pub(super) struct Engine<const N: usize> {
    tables: Tables<Heap>,
    inertia: Inertia<N, Heap>,
    work: Work<N>,
    last_step: f64,
    declarations: Declarations<N>,
    #[cfg(all(feature = "simd", target_arch = "x86_64"))]
    pub(super) registers: Registers,
}

/// The registers in which eight numbers are held.
#[cfg(all(feature = "simd", target_arch = "x86_64"))]
#[derive(Clone, Copy, Debug)]
pub(super) enum Registers {
    /// Arrays, vectorised by the compiler.
    Any,
    /// Two AVX2 registers.
    Two(pulp::x86::V3),
    /// One AVX-512 register.
    One(pulp::x86::V4),
}

#[cfg(all(feature = "simd", target_arch = "x86_64"))]
impl Registers {
    fn of_processor() -> Self {
        match (pulp::x86::V4::try_new(), pulp::x86::V3::try_new()) {
            (Some(isa), _) => Self::One(isa),
            (None, Some(isa)) => Self::Two(isa),
            (None, None) => Self::Any,
        }
    }
}

/// All steps of a bundle from one time to the next.
struct Job<'a, T: Together<N>, const N: usize> {
    models: &'a T,
    step: Step<'a, T::Kernels, N>,
    groups: &'a mut [Group<N>],
    work: &'a mut Work<N>,
    lanes: &'a mut [bool],
    statistics: &'a mut Statistics,
}

impl<T: Together<N>, const N: usize> Job<'_, T, N> {
    #[inline(always)]
    fn run<V: Eight>(self, like: V) {
        let like = self.models.number(like);
        for (group, lanes) in self.groups.iter_mut().zip(self.lanes.chunks_mut(LANES)) {
            if lanes.contains(&true) {
                (self.step).advance(like, group, self.work, lanes, self.statistics);
            }
        }
    }
}

impl<const N: usize> Engine<N> {
    /// An engine for an element with at most 16 points; `None` if a constant mass matrix is singular.
    pub(super) fn new<M>(model: &M, table: &SchemeTable) -> Option<Self>
    where
        M: Model<N>,
    {
        let inertia = Inertia::of(model)?;
        let tables = Tables::of(&table.view());
        let work = Work::new(tables.points, !M::FACTS.constant_mass);
        Some(Self {
            tables,
            inertia,
            work,
            last_step: 0.0,
            declarations: Declarations::of::<M>(),
            #[cfg(all(feature = "simd", target_arch = "x86_64"))]
            registers: if M::LANES {
                Registers::of_processor()
            } else {
                Registers::Any
            },
        })
    }

    /// Declares that no trajectory continues the last step.
    pub(super) fn forget(&mut self) {
        self.last_step = 0.0;
    }

    /// Moves the requested lanes from t to t + h and returns which of them succeeded; the others are unchanged.
    pub(super) fn advance<T>(
        &mut self,
        (models, table, control): (&T, &SchemeTable, &Control),
        (t, h): (f64, f64),
        groups: &mut [Group<N>],
        lanes: &mut [bool],
        statistics: &mut Statistics,
    ) where
        T: Together<N>,
    {
        // Without a last step there is nothing to continue, and the table for equal steps stays as it is.
        if self.last_step != 0.0 {
            self.tables.set_ratio(table, h / self.last_step);
        }
        self.last_step = h;
        // The slowest contraction of this step.
        statistics.contraction = Contraction::NONE;
        self.inertia.set_step::<T::Kernels, _>(Lanes([0.0; 4]), h);
        let step = Step {
            model: models.kernels(),
            tables: &self.tables,
            inertia: &self.inertia,
            control,
            t,
            h,
            declarations: self.declarations,
        };
        for (group, lanes) in groups.iter_mut().zip(lanes.chunks(LANES)) {
            if group.warm != [true; LANES] {
                step.start_cold(models, group, lanes);
            }
        }
        let job = Job {
            models,
            step,
            groups,
            work: &mut self.work,
            lanes,
            statistics,
        };
        // Without kernels for lanes the constant is false, and the compiler drops the calls.
        #[cfg(all(feature = "simd", target_arch = "x86_64"))]
        match self.registers {
            Registers::One(isa) if T::Kernels::LANES => return isa.vectorize(OfEight { job, isa }),
            Registers::Two(isa) if T::Kernels::LANES => return isa.vectorize(OfFour { job, isa }),
            _ => {}
        }
        let like = crate::Lanes([0.0; 4]);
        job.run(Pair(like, like));
    }
}

/// The same in registers of four.
#[cfg(all(feature = "simd", target_arch = "x86_64"))]
struct OfFour<'a, T: Together<N>, const N: usize> {
    job: Job<'a, T, N>,
    isa: pulp::x86::V3,
}

#[cfg(all(feature = "simd", target_arch = "x86_64"))]
impl<T: Together<N>, const N: usize> pulp::NullaryFnOnce for OfFour<'_, T, N> {
    type Output = ();
    #[inline(always)]
    fn call(self) {
        let like = crate::registers::quad::Quad::of(self.isa, [0.0; 4]);
        self.job.run(Pair(like, like));
    }
}

/// The same in registers of eight.
#[cfg(all(feature = "simd", target_arch = "x86_64"))]
struct OfEight<'a, T: Together<N>, const N: usize> {
    job: Job<'a, T, N>,
    isa: pulp::x86::V4,
}

#[cfg(all(feature = "simd", target_arch = "x86_64"))]
impl<T: Together<N>, const N: usize> pulp::NullaryFnOnce for OfEight<'_, T, N> {
    type Output = ();
    #[inline(always)]
    fn call(self) {
        self.job
            .run(crate::registers::octet::Octet::of(self.isa, [0.0; LANES]));
    }
}

#[cfg(all(test, feature = "simd", target_arch = "x86_64"))]
pub(crate) mod tests {
    use super::Registers;
    use crate::bundle::Bundle;
    use crate::element::Element;
    use crate::model::{CoordinateName, Facts, First, Form, Model, Second, State};
    use crate::points::tests::Planet;
    use crate::real::Real;
    use crate::step::Control;
    use crate::{Mixed, Radau};
    use alloc::vec::Vec;

    /// Two damped pendulums of masses 3 and 7: equations of second order.
    pub(crate) struct Pendulums;

    impl Model<2> for Pendulums {
        const FORM: Form = Form::Lagrangian;
        const FACTS: Facts = Facts {
            time_dependent: false,
            forced: true,
            quadratic_in_z: true,
            constant_mass: true,
            linear: false,
            separable: true,
            smooth: true,
        };
        const LANES: bool = true;

        fn energy_function<R: Real>(&self, _: R, _: &[R; 2], v: &[R; 2]) -> R {
            v[0]
        }

        fn first<R: Real>(&self, t: R, q: &[R; 2], v: &[R; 2], first: &mut First<R, 2>) {
            self.first_inline(t, q, v, first);
        }

        #[inline(always)]
        fn first_inline<R: Real>(&self, t: R, q: &[R; 2], v: &[R; 2], first: &mut First<R, 2>) {
            first.z = [v[0] * t.like(3.0), v[1] * t.like(7.0)];
            first.q = [-q[0].sin(), -(q[1] - q[0]).sin()];
            first.force = [-v[0] * t.like(0.01), -v[1] * t.like(0.02)];
        }

        fn first_and_mass<R: Real>(
            &self,
            t: R,
            q: &[R; 2],
            v: &[R; 2],
            first: &mut First<R, 2>,
            zz: &mut [[R; 2]; 2],
        ) {
            self.first_inline(t, q, v, first);
            (zz[0][0], zz[1][1]) = (t.like(3.0), t.like(7.0));
        }

        fn second<R: Real>(
            &self,
            t: R,
            q: &[R; 2],
            v: &[R; 2],
            first: &mut First<R, 2>,
            second: &mut Second<R, 2>,
        ) {
            self.first_and_mass(t, q, v, first, &mut second.zz);
        }

        fn coordinate_name(_: usize) -> CoordinateName {
            CoordinateName::single("q")
        }
    }

    /// Runs thirteen lanes with and without wide registers.
    fn agree<M: Model<N>, const N: usize>(model: &M, element: Element, start: State<N>, h: f64) {
        let mut empty = Bundle::<_, N, 13>::new(model, element, Control::default()).unwrap();
        let mut starts = [start; 13];
        for (lane, start) in starts.iter_mut().enumerate() {
            start.p[0] *= 1.0 + 0.01 * lane as f64;
        }
        empty.start(&starts);
        let run = |registers| {
            let mut bundle = empty.clone();
            bundle.engine.as_mut().unwrap().registers = registers;
            for step in 0..200 {
                assert!(!bundle.advance(h * f64::from(step), h));
            }
            bundle
        };
        let without = run(Registers::Any);
        // As far as this processor has them.
        let two = pulp::x86::V3::try_new().map(Registers::Two);
        let one = pulp::x86::V4::try_new().map(Registers::One);
        for with in two.into_iter().chain(one).map(run) {
            for lane in 0..13 {
                let end = with.state(lane).unwrap();
                assert_eq!(end, without.state(lane).unwrap());
                assert!(end.q[0].is_finite() && end.q[0] != start.q[0]);
            }
            assert_eq!(with.statistics(), without.statistics());
        }
    }

    #[test]
    fn a_batch_leaves_nothing_to_the_next_one() {
        let element = Element::from(Mixed::<5>);
        let starts = |speed: f64, count: usize| {
            let lane = |lane: usize| State {
                q: [1.0, -0.5],
                p: [speed + 0.1 * lane as f64, 0.2],
            };
            (0..count).map(lane).collect::<Vec<_>>()
        };
        let run = |bundle: &mut Bundle<'_, Pendulums, 2, 13>, starts: &[State<2>], h: f64| {
            bundle.start(starts);
            for step in 0..20 {
                bundle.advance(h * f64::from(step), h);
            }
            let states: Vec<_> = (0..13).map(|lane| bundle.state(lane)).collect();
            (states, bundle.take_statistics())
        };
        let empty = Bundle::new(&Pendulums, element, Control::default()).unwrap();
        let mut used = empty.clone();
        // Steps so long that the fixed point does not contract; a start that is none; other steps; fewer lanes.
        let (_, statistics) = run(&mut used, &starts(1.0, 13), 6.0);
        assert!(statistics.newton_iterations > 0);
        let (states, _) = run(&mut used, &starts(f64::NAN, 2), 0.1);
        assert!(states.iter().all(Result::is_err));
        for (count, h) in [(9, 0.1), (13, 0.2), (3, 0.1)] {
            let starts = starts(0.3, count);
            assert_eq!(
                run(&mut used, &starts, h),
                run(&mut empty.clone(), &starts, h)
            );
        }
    }

    #[test]
    fn every_processor_gives_the_same_bits() {
        for element in [Mixed::<4>.into(), Mixed::<9>.into(), Radau::<11>.into()] {
            // The last angle is so large that sines of the system are taken.
            let start = State {
                q: [0.4, 0.0, 2e5],
                p: [0.0, 2.0, 0.3],
            };
            let moving = State {
                p: [0.1, 2.0, 0.3],
                ..start
            };
            agree(&Planet, element, start, 0.02);
            agree(&Planet, element, moving, 0.02);
            let start = State {
                q: [1.0, -0.5],
                p: [0.3, 0.2],
            };
            agree(&Pendulums, element, start, 0.1);
        }
    }
}
