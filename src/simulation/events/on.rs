//! The description of an event: what is watched, in which direction, and what happens there.

use super::act::{Act, Crossing, Occurrence};
use super::value::Function;
use super::watching::Settable;
use crate::length::Length;
use crate::simulation::setup::Simulation;
use std::sync::Arc;

impl<'m, M, const N: usize, L> Simulation<'m, M, N, L>
where
    M: Settable<'m, N, L>,
    L: Length<N>,
{
    /// Calls `act` whenever the event or output `name` of the model changes its sign in the direction of `crossing`,
    /// and does what it returns. [`Motion::events`](crate::Motion::events) lists all events found.
    ///
    /// The time of an event is that of the end of an element that ends at the event, so it is as accurate as the
    /// nodes. If the state or a parameter changes, an element really ends there, and two nodes have that time, with
    /// the states before and after.
    ///
    /// Events are handled in order of time. Events whose times cannot be told apart within rounding are all handled
    /// there, in the order of their declaration; the same holds for several calls of `on` for one event. Each `act`
    /// sees the state that the previous ones have left; after one that [stops](Act::Stop) the run no other is called.
    /// A change of sign that an act itself makes, by a new state or new parameters, is not an event.
    ///
    /// No event is missed, with two exceptions: interval arithmetic proves where a function cannot change its sign on
    /// the polynomial of an element, and the rest is searched (`docs/theory.md` §10.8). The exceptions are pairs of
    /// changes of sign closer than 10⁻⁶ of an element, and pairs that come from functions given to
    /// [inputs](Self::input), which are known at samples only.
    ///
    /// A value that touches zero without changing its sign is not an event, nor is a value that is zero at the start
    /// of the run. A value that is zero at the end of the run is an event of the [resumed](Self::resume) run, if it
    /// changes its sign then. If a value stays at zero for a while between two different signs, there is one event, at
    /// some time in between.
    ///
    /// The run returns [`RunErrorKind::NoEvent`](crate::RunErrorKind::NoEvent) if the model declares no event or output
    /// of this name, and [`RunErrorKind::EventsWithoutEnd`](crate::RunErrorKind::EventsWithoutEnd) if events follow
    /// each other ever faster without end.
    ///
    /// ```
    /// use tfe::prelude::*;
    ///
    /// /// A ball above the ground.
    /// #[dynamics(coordinates(y), lagrangian = m/2*dot(y)^2 - m*g*y, event(impact) = y)]
    /// struct Ball { m: f64, g: f64 }
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// let ball = Ball { m: 0.1, g: 9.81 };
    /// let motion = Simulation::new(&ball)
    ///     .step(0.01)
    ///     .on("impact", Crossing::Falling, |event| Act::Restart(event.state_with_velocity([-0.8 * event.v[0]])))
    ///     .run(ball.state([1.0], [0.0]), 0.0..2.0)?;
    /// let first = (2.0 / 9.81_f64).sqrt();
    /// assert!((motion.events()[0].t - first).abs() < 1e-15);
    /// assert!((motion.events()[1].t - 2.6 * first).abs() < 1e-14);
    /// assert!(motion.states().iter().all(|node| node.q[0] > -1e-15));
    /// # Ok(())
    /// # }
    /// ```
    #[must_use]
    pub fn on(
        mut self,
        name: impl Into<String>,
        crossing: Crossing,
        act: impl Fn(&Occurrence<'_, N, L>) -> Act<N, L> + Send + Sync + 'm,
    ) -> Self {
        self.events.push(name.into(), crossing, None, Arc::new(act));
        self
    }

    /// As [`on`](Self::on), for a function g(t, q, q̇) that the model does not declare; the events are called `name`.
    ///
    /// The function is known at samples only: at least eight in each element, more for elements of high degree. A pair
    /// of changes of sign between two samples is found if a parabola through three samples comes near zero, and may
    /// otherwise be missed. Declare an [event](Self::on) in the model if none may be missed.
    ///
    /// ```
    /// use tfe::prelude::*;
    ///
    /// #[dynamics(coordinates(x, y), lagrangian = (dot(x)^2 + dot(y)^2)/2 + 1/hypot(x, y))]
    /// struct Planet;
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// // Where the distance is largest, half a period 2π a^(3/2) after it was least.
    /// let radial = |_: f64, q: &[f64; 2], v: &[f64; 2]| q[0] * v[0] + q[1] * v[1];
    /// let motion = Simulation::new(&Planet)
    ///     .element(Mixed::<8>)
    ///     .step(0.05)
    ///     .on_function("apocentre", Crossing::Falling, radial, |_| Act::Stop)
    ///     .run(Planet.state([0.7, 0.0], [0.0, (13.0_f64 / 7.0).sqrt()]), 0.0..10.0)?;
    /// assert!((motion.last().t - std::f64::consts::PI).abs() < 1e-10); // a = 1
    /// assert!((motion.last().q[0] + 1.3).abs() < 1e-10);
    /// # Ok(())
    /// # }
    /// ```
    #[must_use]
    pub fn on_function(
        mut self,
        name: impl Into<String>,
        crossing: Crossing,
        function: impl Fn(f64, &L::Vector, &L::Vector) -> f64 + Send + Sync + 'm,
        act: impl Fn(&Occurrence<'_, N, L>) -> Act<N, L> + Send + Sync + 'm,
    ) -> Self {
        let function: Function<'m, L::Vector> = Arc::new(function);
        self.events
            .push(name.into(), crossing, Some(function), Arc::new(act));
        self
    }
}
