//! What a run is asked to look for.

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
    /// Does `act` whenever the event or output `name` of the model changes its sign in the direction of `crossing`; [`Motion::events`](crate::Motion::events) lists what was met. Of several
    /// events the run does what is to be done in the order of time.
    ///
    /// Events at the same time, as far as roundings of the time can tell, are all met there, in the order in which they were declared. So are two calls of `on` for the same event. Each act is
    /// given the state that the acts before it have left; after one that [stops](Act::Stop) the run there are no others. A change of sign that an act itself makes, by another state or other
    /// parameters, is no event.
    ///
    /// Times are those of an element that ends at the event, so that they are as accurate as nodes. An element ends there too where the state or parameters change: two nodes have that
    /// time then, with the states before and after. None is missed: where an output cannot change its sign on an element's polynomial is proved by interval arithmetic, and what is left is
    /// searched (`docs/theory.md` §10.8). Pairs closer than 10⁻⁶ of an element may be, and those of functions given to [inputs](Self::input), which are known at samples. A value that
    /// touches zero without changing its sign is no event. Nor is one that is zero at the start of the run; one that is zero at the end has its event when the run is
    /// [resumed](Self::resume), if it changes its sign then. Where a value stays at zero for a while between two signs, there is one event, at a time in between.
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
        self.events.push(name, crossing, None, act);
        self
    }

    /// The same for a function g(t, q, q̇) that the model does not declare; `name` is how events are called.
    ///
    /// It is known at samples only, at least eight in an element and more for those of high degree: a pair of changes between two samples is found where a parabola through three of them
    /// comes near zero, and may be missed where it does not. An [event](Self::on) that is declared is proved not to be.
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
        self.events.push(name, crossing, Some(function), act);
        self
    }
}
