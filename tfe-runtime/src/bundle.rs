//! Several trajectories of one model side by side: each kernel call serves eight of them.
//!
//! The trajectories of a [`Bundle`] take the same steps at the same times. Eight of them share the registers of the
//! processor, and the fixed-point iteration of an element runs for all eight at once. Each lane has its own convergence
//! test, that of a [`Stepper`], and the equations are those of a stepper, of second order where the model allows it. A
//! converged lane is held while the others go on, so that the result of a trajectory does not depend, not even in one
//! bit, on the trajectories beside it. A lane whose iteration does not contract is given a stepper of its own, which
//! takes this step and some that follow by Newton's method; if that fails as well, the trajectory ends there.
//! So is a lane in which a coordinate is small beside the largest one, as an angle beside a distance: its iteration
//! takes longer than those of the others.
//!
//! Lanes are used for models without constraints: for every Lagrangian; for Hamiltonians with two-field elements, and
//! with all other elements if their equations have the form M q̈ = f. Everything else is stepped lane by lane.

mod convergence;
mod engine;
mod first_order;
mod group;
mod products;
mod second_order;
mod settled;
mod step;
mod together;
mod trajectories;
mod varied;

use crate::consistency::ModelError;
use crate::element::Element;
use crate::error::StepError;
use crate::model::{Model, State};
use crate::newton::{Control, Preference, Solve};
use crate::points::forms::has_form;
use crate::registers::pair::LANES;
use crate::registers::storage::MAX_GROUPS;
use crate::scheme::{SchemeTable, Tables};
use crate::statistics::Statistics;
use crate::stepper::Stepper;
use alloc::boxed::Box;
use alloc::vec;
use alloc::vec::Vec;
use engine::Engine;
#[cfg(all(test, feature = "simd", target_arch = "x86_64"))]
pub(crate) use engine::tests::Pendulums;
use group::Group;
pub use together::{One, Together, Trajectories};
pub use varied::Varied;

/// Up to W trajectories that take the same steps.
///
/// # Example
/// ```
/// # use tfe_runtime::{CoordinateName, Facts, First, Form, Mixed, Model, Real, Second, State};
/// use tfe_runtime::bundle::Bundle;
/// use tfe_runtime::step::Control;
///
/// # struct Pendulum;
/// # impl Model<1> for Pendulum {
/// #     const FORM: Form = Form::Hamiltonian;
/// #     const FACTS: Facts = Facts::UNKNOWN;
/// #     fn energy_function<R: Real>(&self, _: R, q: &[R; 1], p: &[R; 1]) -> R {
/// #         p[0] * p[0] * R::from_f64(0.5) - q[0].cos()
/// #     }
/// #     fn first<R: Real>(&self, _: R, q: &[R; 1], p: &[R; 1], first: &mut First<R, 1>) {
/// #         (first.z[0], first.q[0]) = (p[0], q[0].sin());
/// #     }
/// #     fn first_and_mass<R: Real>(
/// #         &self, t: R, q: &[R; 1], p: &[R; 1], first: &mut First<R, 1>, zz: &mut [[R; 1]; 1],
/// #     ) {
/// #         self.first(t, q, p, first);
/// #         zz[0][0] = R::from_f64(1.0);
/// #     }
/// #     fn second<R: Real>(
/// #         &self, t: R, q: &[R; 1], p: &[R; 1], first: &mut First<R, 1>, second: &mut Second<R, 1>,
/// #     ) {
/// #         self.first_and_mass(t, q, p, first, &mut second.zz);
/// #         second.qq[0][0] = q[0].cos();
/// #     }
/// #     fn coordinate_name(_: usize) -> CoordinateName {
/// #         CoordinateName { name: "theta", index: None }
/// #     }
/// # }
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let starts = [0.1, 0.2, 0.3].map(|angle| State { q: [angle], p: [0.0] });
/// let mut bundle = Bundle::<_, 1, 4>::new(&Pendulum, Mixed::<4>.into(), Control::default())?;
/// bundle.start(&starts);
/// for step in 0..10 {
///     bundle.advance(0.1 * step as f64, 0.1);
/// }
/// let energy = |state: &State<1>| 0.5 * state.p[0] * state.p[0] - state.q[0].cos();
/// for (lane, start) in starts.iter().enumerate() {
///     let end = bundle.state(lane)?;
///     println!("{:.6}", end.q[0]);
///     assert!((energy(&end) - energy(start)).abs() < 1e-10);
/// }
/// # Ok(())
/// # }
/// ```
///
/// All trajectories belong to one model or, with [`of_models`](Self::of_models), to up to eight that differ in their
/// parameters.
#[derive(Debug)]
pub struct Bundle<'m, M, const N: usize, const W: usize, T = One<'m, M>> {
    models: T,
    table: SchemeTable,
    control: Control,
    /// Steps the lanes side by side; `None` for models and elements that do not allow it.
    engine: Option<Engine<N>>,
    groups: Vec<Group<N>>,
    fates: [Fate<'m, M, N>; W],
    /// The lanes that hold a trajectory; `None` once one of them has left the common iteration.
    calm: Option<[bool; W]>,
    /// The counts of steps taken side by side.
    together: Statistics,
    /// The counts of individual steppers that have been dropped.
    past: Statistics,
}

/// The state of one trajectory, and how it is stepped.
#[derive(Debug)]
struct Fate<'m, M, const N: usize> {
    failure: Option<StepError>,
    is_used: bool,
    /// Whether it is stepped on its own, and for how many more steps.
    preference: Preference,
    /// Boxed, because few trajectories need one and it is large.
    stepper: Option<Box<Stepper<'m, M, N>>>,
}

// Not derived: the model is borrowed and need not be `Clone`.
impl<M, const N: usize> Clone for Fate<'_, M, N> {
    fn clone(&self) -> Self {
        Self {
            stepper: self.stepper.clone(),
            ..*self
        }
    }
}

impl<M, const N: usize, const W: usize, T: Clone> Clone for Bundle<'_, M, N, W, T> {
    fn clone(&self) -> Self {
        Self {
            models: self.models.clone(),
            table: self.table.clone(),
            engine: self.engine.clone(),
            groups: self.groups.clone(),
            fates: self.fates.clone(),
            ..*self
        }
    }
}

impl<M, const N: usize> Fate<'_, M, N> {
    const UNUSED: Self = Self {
        failure: None,
        is_used: false,
        preference: Preference::NONE,
        stepper: None,
    };

    fn is_alive(&self) -> bool {
        self.is_used && self.failure.is_none()
    }
}

impl<'m, M, const N: usize, const W: usize> Bundle<'m, M, N, W>
where
    M: Model<N>,
{
    /// An empty bundle.
    ///
    /// # Errors
    /// [`ModelError`] if the model does not pass its [check](Model::check), or the element is invalid.
    pub fn new(model: &'m M, element: Element, control: Control) -> Result<Self, ModelError> {
        Self::with(One(model), element, control)
    }

    /// The model that is stepped.
    pub fn model(&self) -> &'m M {
        self.models.0
    }
}

impl<'m, M, const N: usize> Bundle<'m, M, N, LANES, Varied<'m, M>>
where
    M: Model<N>,
{
    /// An empty bundle of models that may differ in their [parameters](Model::parameters), but in nothing
    /// [else](Model::unnumbered); all lanes begin with this one.
    ///
    /// # Errors
    /// [`ModelError`] if the model does not pass its [check](Model::check), or the element is invalid.
    pub fn of_models(model: &'m M, element: Element, control: Control) -> Result<Self, ModelError> {
        Self::with(Varied::new(model), element, control)
    }

    /// Starts again with these models and states, one for each lane; those beyond the eighth are ignored.
    pub fn start_with(&mut self, models: &'m [M], starts: &[State<N>]) {
        self.models.set(models);
        self.start(starts);
    }
}

impl<'m, M, const N: usize, const W: usize, T> Bundle<'m, M, N, W, T>
where
    M: Model<N>,
    T: Trajectories<'m, M, N>,
{
    fn with(models: T, element: Element, control: Control) -> Result<Self, ModelError> {
        models.model(0).check()?;
        let table = SchemeTable::new(element)?;
        let engine = if Self::uses_lanes(&element, &control) {
            Engine::new(models.kernels(), &table)
        } else {
            None
        };
        let points = table.view().points();
        Ok(Self {
            models,
            table,
            control,
            engine,
            groups: vec![Group::new(points); W.div_ceil(LANES)],
            fates: [const { Fate::UNUSED }; W],
            calm: None,
            together: Statistics::NONE,
            past: Statistics::NONE,
        })
    }

    /// Whether this model is stepped in lanes with this element and control; if not, each lane is stepped by a
    /// [`Stepper`].
    #[must_use]
    pub fn uses_lanes(element: &Element, control: &Control) -> bool {
        element.points() <= 4 * MAX_GROUPS
            && has_form::<T::Kernels, N>(element)
            && M::CONSTRAINTS.is_empty()
            && control.solve != Solve::Newton
    }

    /// Starts again with these states, one for each lane; those beyond W are ignored. The statistics are kept.
    pub fn start(&mut self, starts: &[State<N>]) {
        let (mut lanes, mut is_calm) = ([false; W], true);
        for (lane, fate) in self.fates.iter_mut().enumerate() {
            if let Some(stepper) = &fate.stepper {
                self.past.merge(stepper.statistics());
            }
            *fate = Fate::UNUSED;
            if let Some(start) = starts.get(lane) {
                fate.is_used = true;
                lanes[lane] = true;
                if !start.is_finite() {
                    fate.failure = Some(StepError::NonFinite);
                    is_calm = false;
                }
            }
        }
        self.calm = is_calm.then_some(lanes);
        if let Some(engine) = &mut self.engine {
            engine.forget();
        }
        // Lanes without a trajectory compute a copy of the first one; its result is not used.
        let first = starts.first().unwrap_or(&State::ZERO);
        for (k, group) in self.groups.iter_mut().enumerate() {
            for lane in 0..LANES {
                group.place(lane, starts.get(LANES * k + lane).unwrap_or(first));
            }
        }
    }

    /// The model of a lane.
    pub fn model_of(&self, lane: usize) -> &'m M {
        self.models.model(lane)
    }

    /// Moves all trajectories from t to t + h; returns true if one of them failed in this step. A failed trajectory
    /// stays at its last valid state.
    pub fn advance(&mut self, t: f64, h: f64) -> bool {
        let mut lanes = [false; W];
        let is_step = h.is_finite() && h != 0.0;
        // A constant, so that nothing is compiled for models that are never stepped in lanes.
        if const { M::CONSTRAINTS.is_empty() }
            && is_step
            && let Some(engine) = &mut self.engine
        {
            if let Some(calm) = self.calm {
                lanes = calm;
            } else {
                for (lane, fate) in lanes.iter_mut().zip(&self.fates) {
                    *lane = fate.is_alive() && fate.preference.is_fixed_point();
                }
            }
            engine.advance(
                (&self.models, &self.table, &self.control),
                (t, h),
                &mut self.groups,
                &mut lanes,
                &mut self.together,
            );
        }
        if self.calm == Some(lanes) {
            return false;
        }
        self.calm = None;
        let mut has_failed = false;
        for (lane, arrived) in lanes.into_iter().enumerate() {
            let fate = &mut self.fates[lane];
            if !fate.is_alive() {
                continue;
            }
            if arrived {
                fate.preference.confirm_fixed_point();
                continue;
            }
            if self.engine.is_some() && fate.preference.is_fixed_point() {
                fate.preference.leave_fixed_point();
                self.together.fallbacks += 1;
            }
            if let Err(error) = self.advance_alone(lane, t, h) {
                self.fates[lane].failure = Some(error);
                has_failed = true;
            }
        }
        has_failed
    }

    /// One step of one trajectory with a stepper of its own.
    fn advance_alone(&mut self, lane: usize, t: f64, h: f64) -> Result<(), StepError> {
        let fate = &mut self.fates[lane];
        if fate.stepper.is_none() {
            let model = self.models.model(lane);
            let stepper = Stepper::new(model, self.table.view().element, self.control);
            // The element was validated when the bundle was made.
            fate.stepper = stepper.ok().map(Box::new);
        }
        if let Some(stepper) = &mut fate.stepper {
            let group = &mut self.groups[lane / LANES];
            let mut state = group.state(lane % LANES);
            stepper.advance(t, h, &mut state, &[])?;
            group.place(lane % LANES, &state);
        }
        fate.preference.count_newton();
        Ok(())
    }

    /// The present state of a trajectory.
    ///
    /// # Errors
    /// The reason why it stopped, if it did; [`StepError::NonFinite`] for a lane without a trajectory.
    pub fn state(&self, lane: usize) -> Result<State<N>, StepError> {
        match self.fates.get(lane) {
            Some(fate) if fate.is_used => match fate.failure {
                None => Ok(self.groups[lane / LANES].state(lane % LANES)),
                Some(error) => Err(error),
            },
            _ => Err(StepError::NonFinite),
        }
    }

    /// The cost of all steps so far; a step of W trajectories counts W times.
    #[must_use]
    pub fn statistics(&self) -> Statistics {
        let mut sum = self.together;
        sum.merge(&self.past);
        for fate in &self.fates {
            if let Some(stepper) = &fate.stepper {
                sum.merge(stepper.statistics());
            }
        }
        sum
    }

    /// The counts since the last call, or since the bundle was made.
    pub fn take_statistics(&mut self) -> Statistics {
        let mut sum = core::mem::take(&mut self.together);
        sum.merge(&core::mem::take(&mut self.past));
        for fate in &mut self.fates {
            if let Some(stepper) = &mut fate.stepper {
                sum.merge(&stepper.take_statistics());
            }
        }
        sum
    }
}
