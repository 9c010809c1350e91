//! Runs of models with inputs.

use super::held::Held;
use super::kind::Simulated;
use super::setup::Simulation;
use crate::driven::{Cells, Drivable, Driven, InputError, Interpolation};
use crate::error::RunErrorKind;
use crate::length::Length;
use std::sync::Arc;
use tfe_runtime::Share;

impl<'m, M, const N: usize, L> Simulation<'m, M, N, L>
where
    M: Drivable<'m, N, L, Declaring: 'm>,
    Driven<'m, M::Declaring, L>: Simulated<N, L> + Send + Sync,
    L: Length<N>,
{
    /// Gives an input of the model as a function of time, as [`Driven::input`] does; a second call for the same input
    /// replaces the first. Inputs that are not given are zero.
    ///
    /// If the model does not declare the name, the run ends before it begins. If the function returns a number that is
    /// not finite, the run ends with [`InputError::Value`], which holds the time; if it panics, with
    /// [`InputError::Panicked`]. Panics are caught (unless the program is compiled to abort) by `run`, `resume`,
    /// `steps`, `hold`, [`section`](Self::section), `run_linearised`, `run_estimated` and runs with an `accuracy`.
    ///
    /// Let elements [end](Self::break_at) where the function jumps or has a kink: otherwise they lose their order of
    /// accuracy there.
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
    ///
    /// Models of run-time length have inputs, too:
    ///
    /// ```
    /// use tfe::prelude::*;
    ///
    /// /// Floors on springs, the lowest on the ground.
    /// #[dynamics(
    ///     coordinates(x[floors]),
    ///     lagrangian = sum(i in 0..floors, dot(x[i])^2/2) - k/2*(x[0] - ground)^2 - sum(i in 0..floors-1, k/2*(x[i+1] - x[i])^2),
    ///     input(ground),
    /// )]
    /// struct Tower { floors: usize, k: f64 }
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// let tower = Tower { floors: 30, k: 100.0 };
    /// // A ship's deck, and the tower at rest on it.
    /// let simulation = Simulation::new(&tower).step(0.05).input("ground", |t| 0.5 * t);
    /// let motion = simulation.run(tower.state([0.0; 30], [0.5; 30]), 0.0..10.0)?;
    /// assert!((motion.last().q[29] - 5.0).abs() < 1e-12);
    /// # Ok(())
    /// # }
    /// ```
    #[must_use]
    pub fn input(
        self,
        name: &str,
        function: impl Fn(f64) -> f64 + Send + Sync + 'm,
    ) -> Simulation<'m, Driven<'m, M::Declaring, L>, N, L> {
        self.driven(|driven| driven.input(name, function))
    }

    /// Gives an input of the model as a table of values at given times, interpolated as [`Driven::table`] says;
    /// elements end at these times.
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
        mut self,
        name: &str,
        times: impl AsRef<[f64]>,
        values: impl AsRef<[f64]>,
        interpolation: Interpolation,
    ) -> Simulation<'m, Driven<'m, M::Declaring, L>, N, L> {
        let (times, values) = (times.as_ref(), values.as_ref());
        self.breaks.extend(times);
        self.driven(|driven| driven.table(name, times, values, interpolation))
    }

    /// Starts a control loop: a run step by step, with inputs that can be [set](Held::set) between steps. Inputs given
    /// before as functions or tables are used until they are set.
    ///
    /// # Errors
    /// [`RunErrorKind`], as from [`run`](Self::run) before its first element; [`RunErrorKind::Step`] if no step size was
    /// set.
    ///
    /// # Example
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
    pub fn hold(
        self,
        start: L::State,
        t0: f64,
    ) -> Result<Held<'m, M::Declaring, N, L>, RunErrorKind> {
        let cells = Arc::new(Cells::new());
        let run = self.driven(|driven| Ok(driven.holding(Arc::clone(&cells))));
        Held::new(run.steps(start, t0), cells)
    }

    /// The same run with changed inputs.
    fn driven(
        self,
        change: impl FnOnce(
            Driven<'m, M::Declaring, L>,
        ) -> Result<Driven<'m, M::Declaring, L>, InputError>,
    ) -> Simulation<'m, Driven<'m, M::Declaring, L>, N, L> {
        let unchanged = M::driven(self.model.clone());
        match change(unchanged.clone()) {
            Ok(driven) => self.of(Share::own(driven)),
            Err(error) => Simulation {
                refusal: Some(RunErrorKind::Input(error)),
                ..self.of(Share::own(unchanged))
            },
        }
    }
}

impl<'m, M, const N: usize, L: Length<N>> Simulation<'m, M, N, L> {
    /// The same run of another model.
    fn of<T>(self, model: Share<'m, T>) -> Simulation<'m, T, N, L>
    where
        T: Simulated<N, L> + Send + Sync + 'm,
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
