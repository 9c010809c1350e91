//! Several trajectories of one model side by side: every kernel call serves W of them.
//!
//! The trajectories of a [`Bundle`] take the same steps at the same times. Their states lie in [`Lanes`](crate::Lanes), and the fixed-point iteration of an
//! element runs for all of them at once, each lane judged by the stopping rule of a [`Stepper`]. A lane that has converged is held while
//! others go on, so that what a trajectory does never depends, not by one bit, on which others are beside it. A lane whose iteration does not
//! contract takes this step and some that follow with a stepper of its own, by Newton's method; one that fails there is out.
//!
//! Lanes are used for two-field elements (and others that are Runge–Kutta methods in the form at hand) and models without constraints whose
//! kernels can be solved by a fixed point: any Lagrangian, and Hamiltonians in phase space. Everything else runs too, lane after lane.

mod equations;
mod lanes;
mod sweep;

use crate::element::{Element, ElementError};
use crate::error::StepError;
use crate::legendre::largest;
use crate::model::{Form, Model, State};
use crate::newton::{Control, Solve};
use crate::scheme::{SchemeTable, Tables};
use crate::statistics::Statistics;
use crate::step::Stepper;
use equations::Equations;

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
/// for lane in 0..3 {
///     let end = bundle.state(lane)?;
///     println!("{:.6}", end.q[0]);
/// }
/// # Ok(())
/// # }
/// ```
#[derive(Debug)]
pub struct Bundle<'m, M, const N: usize, const W: usize> {
    model: &'m M,
    table: SchemeTable,
    control: Control,
    equations: Equations<N, W>,
    fates: [Fate<'m, M, N>; W],
    /// Statistics of steps in lanes.
    together: Statistics,
    /// Of steppers that are no more.
    past: Statistics,
}

/// What has become of a trajectory.
#[derive(Debug)]
struct Fate<'m, M, const N: usize> {
    failure: Option<StepError>,
    is_used: bool,
    /// For how many steps it goes its own way.
    away: u32,
    /// How many it will be the next time.
    penalty: u32,
    stepper: Option<Stepper<'m, M, N>>,
}

impl<M, const N: usize> Fate<'_, M, N> {
    const UNUSED: Self = Self {
        failure: None,
        is_used: false,
        away: 0,
        penalty: 0,
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
    /// [`ElementError`] if the element is none.
    pub fn new(model: &'m M, element: Element, control: Control) -> Result<Self, ElementError> {
        let table = SchemeTable::new(element)?;
        let points = table.view().points();
        Ok(Self {
            model,
            table,
            control,
            equations: Equations::new(points),
            fates: [const { Fate::UNUSED }; W],
            together: Statistics::NONE,
            past: Statistics::NONE,
        })
    }

    /// Whether this model with this element and control is stepped in lanes; else lane after lane, as by a [`Stepper`].
    #[must_use]
    pub fn uses_lanes(element: &Element, control: &Control) -> bool {
        let has_form = match M::FORM {
            Form::Lagrangian => element.is_collocated(),
            Form::Hamiltonian => element.has_phase_form(),
        };
        has_form && M::CONSTRAINTS.is_empty() && control.solve != Solve::Newton
    }

    /// Begins anew with these states, one a lane; those beyond W are left out. Statistics go on.
    pub fn start(&mut self, starts: &[State<N>]) {
        for (lane, fate) in self.fates.iter_mut().enumerate() {
            if let Some(stepper) = &fate.stepper {
                self.past.merge(stepper.statistics());
            }
            *fate = Fate::UNUSED;
            if let Some(start) = starts.get(lane) {
                fate.is_used = true;
                if !(largest(&start.q).is_finite() && largest(&start.p).is_finite()) {
                    fate.failure = Some(StepError::NonFinite);
                }
            }
            // Lanes without a trajectory compute along with the first one; nobody looks at them.
            let state = starts.get(lane).or(starts.first());
            self.equations.place(lane, state.unwrap_or(&State::ZERO));
        }
        let element = self.table.view().element;
        let known = self.equations.set_constant_mass(self.model);
        if !Self::uses_lanes(&element, &self.control) || !known {
            for fate in &mut self.fates {
                fate.away = u32::MAX;
            }
        }
    }

    /// Moves all trajectories from t to t + h; true if one of them failed in this step. One that has failed stays at its last good state.
    pub fn advance(&mut self, t: f64, h: f64) -> bool {
        let mut wanted = [false; W];
        for (wanted, fate) in wanted.iter_mut().zip(&self.fates) {
            *wanted = fate.is_alive() && fate.away == 0;
        }
        let valid = h.is_finite() && h != 0.0;
        let mut arrived = [false; W];
        if valid && wanted.contains(&true) {
            let scheme = self.table.view();
            let control = &self.control;
            arrived = self.equations.advance(
                (self.model, &scheme, control),
                (t, h),
                wanted,
                &mut self.together,
            );
        }
        if arrived == [true; W] {
            for fate in &mut self.fates {
                fate.penalty /= 2;
            }
            return false;
        }
        let mut has_failed = false;
        for lane in 0..W {
            let fate = &mut self.fates[lane];
            if !fate.is_alive() {
                continue;
            }
            if arrived[lane] {
                fate.penalty /= 2;
                continue;
            }
            if fate.away == 0 {
                // Stiff steps come in rows: do not pay for two iterations in each of them.
                fate.penalty = (fate.penalty * 2).clamp(8, 1024);
                fate.away = fate.penalty;
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
            let stepper = Stepper::new(self.model, self.table.view().element, self.control);
            // The element was good when the bundle was made.
            fate.stepper = stepper.ok();
        }
        if let Some(stepper) = &mut fate.stepper {
            let mut state = self.equations.state(lane);
            stepper.advance(t, h, &mut state, &[])?;
            self.equations.place(lane, &state);
        }
        if fate.away != u32::MAX {
            fate.away -= 1;
        }
        Ok(())
    }

    /// Where a trajectory is now.
    ///
    /// # Errors
    /// Why it stopped, if it did; [`StepError::NonFinite`] for a lane without a trajectory.
    pub fn state(&self, lane: usize) -> Result<State<N>, StepError> {
        match self.fates.get(lane) {
            Some(fate) if fate.is_used => match fate.failure {
                None => Ok(self.equations.state(lane)),
                Some(error) => Err(error),
            },
            _ => Err(StepError::NonFinite),
        }
    }

    /// What the steps so far have cost; a step of W trajectories counts W times.
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
}
