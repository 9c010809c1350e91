//! Runs of models with inputs.

use super::held::Held;
use super::setup::Simulation;
use crate::driven::{Cells, Driven, InputError, Interpolation};
use crate::error::RunErrorKind;
use std::sync::Arc;
use tfe_runtime::{Controlled, Model, Share, State};

impl<'m, M: Controlled<N> + 'm, const N: usize> Simulation<'m, M, N> {
    /// Gives an input of the model as a function of the time, as [`Driven::input`]. Inputs that are not given are zero.
    ///
    /// A name that the model does not declare stops the run before it begins. A function that gives a number that is not finite where it is needed, or panics, ends the run with an error,
    /// [`InputError::Value`] with the time, or [`InputError::Panicked`]. Panics are caught once for all that a step asks (a panic that aborts the program is not), by `run`, `steps`, `hold`,
    /// [`section`](Self::section), `run_linearised` and runs with an `accuracy`. Where the function jumps or has a kink, elements should [end](Self::break_at).
    ///
    /// ```
    /// use tfe::prelude::*;
    ///
    /// #[dynamics(coordinates(x), lagrangian = (dot(x)^2 - x^2)/2, input(u), force(x) = u)]
    /// struct Oscillator;
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// // x″ + x = cos t from rest: x = ½ t sin t.
    /// let simulation = Simulation::new(&Oscillator).element(Mixed::<6>).step(0.05).input("u", f64::cos);
    /// let motion = simulation.run(Oscillator.state([0.0], [0.0]), 0.0..10.0)?;
    /// assert!((motion.last().q[0] - 5.0 * 10.0_f64.sin()).abs() < 1e-13);
    /// # Ok(())
    /// # }
    /// ```
    #[must_use]
    pub fn input(
        self,
        name: &str,
        function: impl Fn(f64) -> f64 + Send + Sync + 'm,
    ) -> Simulation<'m, Driven<'m, M>, N> {
        self.driven().input(name, function)
    }

    /// Gives an input of the model by its values at given times, as [`Driven::table`]; elements end there.
    ///
    /// ```
    /// use tfe::Interpolation;
    /// use tfe::prelude::*;
    ///
    /// #[dynamics(coordinates(x), lagrangian = dot(x)^2/2, input(u), force(x) = u)]
    /// struct Mass;
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// // Pushed for a second, braked for a second.
    /// let simulation = Simulation::new(&Mass).step(0.3).table("u", &[0.0, 1.0, 2.0], &[1.0, -1.0, 0.0], Interpolation::Hold);
    /// let motion = simulation.run(Mass.state([0.0], [0.0]), 0.0..3.0)?;
    /// assert!((motion.last().q[0] - 1.0).abs() < 1e-14 && motion.last().v[0].abs() < 1e-14);
    /// # Ok(())
    /// # }
    /// ```
    #[must_use]
    pub fn table(
        self,
        name: &str,
        times: impl AsRef<[f64]>,
        values: impl AsRef<[f64]>,
        interpolation: Interpolation,
    ) -> Simulation<'m, Driven<'m, M>, N> {
        self.driven().table(name, times, values, interpolation)
    }

    /// A loop of control: steps one by one, between which inputs are [set](Held::set).
    ///
    /// # Errors
    /// As of [`steps`](Self::steps).
    ///
    /// ```
    /// use tfe::prelude::*;
    ///
    /// /// A cart that carries an upright pendulum.
    /// #[dynamics(
    ///     coordinates(x, theta),
    ///     lagrangian = (mc + m)/2*dot(x)^2 + m*l*dot(x)*dot(theta)*cos(theta) + m*l^2/2*dot(theta)^2 - m*g*l*cos(theta),
    ///     input(u),
    ///     force(x) = u,
    /// )]
    /// struct CartPole { mc: f64, m: f64, l: f64, g: f64 }
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// let cart = CartPole { mc: 1.0, m: 0.1, l: 0.5, g: 9.81 };
    /// let mut run = Simulation::new(&cart).step(0.01).hold(cart.state([0.0, 0.1], [0.0, 0.0]), 0.0)?;
    /// for _ in 0..1000 {
    ///     let node = run.node();
    ///     let u = node.q[0] + 2.4 * node.v[0] + 32.0 * node.q[1] + 7.2 * node.v[1];
    ///     run.set("u", u);
    ///     run.advance()?;
    /// }
    /// assert!(run.node().q[1].abs() < 1e-3);
    /// # Ok(())
    /// # }
    /// ```
    pub fn hold(self, start: State<N>, t0: f64) -> Result<Held<'m, M, N>, RunErrorKind> {
        self.driven().hold(start, t0)
    }

    /// The same run with all inputs zero.
    fn driven(self) -> Simulation<'m, Driven<'m, M>, N> {
        let driven = Driven::sharing(self.model.clone());
        self.of(Share::own(driven))
    }
}

impl<'m, M: Controlled<N> + 'm, const N: usize> Simulation<'m, Driven<'m, M>, N> {
    /// Gives another input, or the same anew.
    #[must_use]
    pub fn input(self, name: &str, function: impl Fn(f64) -> f64 + Send + Sync + 'm) -> Self {
        self.changed(|driven| driven.input(name, function))
    }

    /// Gives another input by a table, or the same anew.
    #[must_use]
    pub fn table(
        mut self,
        name: &str,
        times: impl AsRef<[f64]>,
        values: impl AsRef<[f64]>,
        interpolation: Interpolation,
    ) -> Self {
        self.breaks.extend(times.as_ref());
        self.changed(|driven| driven.table(name, times.as_ref(), values.as_ref(), interpolation))
    }

    /// A loop of control; inputs keep their functions until they are [set](Held::set).
    ///
    /// # Errors
    /// As of [`steps`](Self::steps).
    pub fn hold(self, start: State<N>, t0: f64) -> Result<Held<'m, M, N>, RunErrorKind> {
        let cells = Arc::new(Cells::new());
        let run = self.changed(|driven| Ok(driven.holding(Arc::clone(&cells))));
        Held::new(run.steps(start, t0), cells)
    }

    fn changed(
        self,
        change: impl FnOnce(Driven<'m, M>) -> Result<Driven<'m, M>, InputError>,
    ) -> Self {
        match change((*self.model).clone()) {
            Ok(driven) => self.of(Share::own(driven)),
            Err(error) => Self {
                refusal: Some(RunErrorKind::Input(error)),
                ..self
            },
        }
    }
}

impl<'m, M, const N: usize> Simulation<'m, M, N> {
    /// The same run of another model.
    fn of<T>(self, model: Share<'m, T>) -> Simulation<'m, T, N>
    where
        T: Model<N> + Send + Sync + 'm,
    {
        Simulation {
            model,
            element: self.element,
            step: self.step,
            nodes: self.nodes,
            control: self.control,
            record_every: self.record_every,
            impulses: self.impulses,
            breaks: self.breaks,
            events: self.events.of(),
            at_kinks: self.at_kinks,
            progress: self.progress,
            refusal: self.refusal,
        }
    }
}
