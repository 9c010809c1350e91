//! Poincaré sections: the points where a motion crosses a surface.

use super::events::Severed;
use super::events::act::{Act, Crossing, Event, On};
use super::follow::{Follow, Passed};
use super::kind::{Chosen, Simulated};
use super::pieces::{Left, Observe, Side};
use super::sensitive::Tangents;
use super::sequence::ElementSequence;
use super::setup::Simulation;
use super::steps::EndlessRun;
use crate::error::RunErrorKind;
use crate::length::{FixedLength, Length, RunTimeLength};
use nalgebra::DMatrix;
use std::collections::VecDeque;
use std::convert::Infallible;
use std::fmt;
use std::ops::Deref;
use std::sync::Arc;
use tfe_runtime::Share;
use tfe_runtime::transition::TransitionError;
use tfe_runtime::{Model, family};

impl<'m, M, const N: usize, L> Simulation<'m, M, N, L>
where
    M: Sectioned<N, L>,
    L: Length<N>,
{
    /// A Poincaré section: an endless iterator, in constant memory, over the points at which the motion crosses the
    /// surface where an event or output of the model vanishes. Other [events](Self::on) are handled as in
    /// [`steps`](Self::steps).
    ///
    /// The points are as accurate as the nodes, and none is missed (see [`on`](Self::on) for the exceptions). The
    /// section does not change the motion. If the motion does not return to the surface within ten million elements, or
    /// within as many as [`within`](Section::within) says, the section ends with
    /// [`RunErrorKind::NoCrossing`](crate::RunErrorKind::NoCrossing); an event that [stops](Act::Stop) the motion, such
    /// as `event(late) = t - 1000`, ends it without an error.
    ///
    /// ```
    /// use tfe::prelude::*;
    ///
    /// #[dynamics(
    ///     coordinates(x, y),
    ///     momenta(px, py),
    ///     hamiltonian = (px^2 + py^2 + x^2 + y^2)/2 + x^2*y - y^3/3,
    ///     event(section) = x,
    /// )]
    /// struct HenonHeiles;
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// let simulation = Simulation::new(&HenonHeiles).element(Mixed::<8>).step(0.25);
    /// let start = State { q: [0.0, 0.1], p: [0.5, 0.0] };
    /// for point in simulation.section("section", Crossing::Rising, start, 0.0).take(100) {
    ///     let point = point?;
    ///     assert!(point.q[0].abs() < 1e-13 && point.p[0] > 0.0);
    ///     println!("{} {}", point.q[1], point.p[1]);
    /// }
    /// # Ok(())
    /// # }
    /// ```
    #[must_use]
    pub fn section(
        &self,
        name: impl Into<String>,
        crossing: Crossing,
        start: L::State,
        t0: f64,
    ) -> Section<'m, M, N, L> {
        let (mut run, name) = (self.clone(), name.into());
        run.events.watch_first(On {
            name: name.clone(),
            function: None,
            crossing,
            act: Arc::new(|_| Act::Record),
        });
        let beginning = (run.model.guarded(|| run.endless(&start, t0)))
            .unwrap_or_else(|| Err(RunErrorKind::panicked(t0)));
        Section {
            chosen: run.chosen(),
            model: run.model.clone(),
            search: Search {
                name,
                from: t0,
                elements: 0,
                most: MAX_ELEMENTS,
            },
            endless: EndlessRun::new(run.model.clone(), beginning, start, run.impulses),
            crossings: Crossings {
                tangents: None,
                points: VecDeque::new(),
            },
        }
    }
}

/// A point of a [Poincaré section](Simulation::section); dereferences to [`Event`].
#[derive(Clone, Debug, PartialEq)]
pub struct SectionPoint<const N: usize, L: Length<N> = FixedLength> {
    event: Event<N, L>,
    transition: Option<DMatrix<f64>>,
}

impl<const N: usize, L: Length<N>> SectionPoint<N, L> {
    /// The derivative of this point with respect to the one before (of the first point: with respect to the start): 2N
    /// × 2N, ordered (p, q). `None` unless the section is [linearised](Section::linearised).
    ///
    /// It includes the change of the time at which a neighbouring motion crosses the surface,
    ///
    /// ```text
    /// δy_{k+1} = (1 − ẏ ∇gᵀ/ġ) Φ(t_{k+1}, t_k) δy_k                                           (T-141)
    /// ```
    ///
    /// Here Φ is the transition matrix of the motion, g the function of the section. In models that do not depend on
    /// time, products of these matrices are derivatives of the return map (Poincaré map): their eigenvalues are its
    /// multipliers, and a zero for the normal of the surface.
    pub fn transition(&self) -> Option<&DMatrix<f64>> {
        self.transition.as_ref()
    }
}

impl<const N: usize, L: Length<N>> Deref for SectionPoint<N, L> {
    type Target = Event<N, L>;

    fn deref(&self) -> &Event<N, L> {
        &self.event
    }
}

/// The iterator over the points of a Poincaré section; made by [`Simulation::section`]. Each item is a
/// [`SectionPoint`], or the [`RunErrorKind`] after which it ends. It also ends where an event stops the motion.
pub struct Section<'m, M, const N: usize, L = FixedLength>
where
    M: Sectioned<N, L> + 'm,
    L: Length<N>,
{
    chosen: Chosen,
    model: Share<'m, M>,
    search: Search,
    endless: EndlessRun<'m, M, N, L>,
    crossings: Crossings<'m, M, N, L>,
}

/// The number of elements between two points of a section, unless another one is asked for.
const MAX_ELEMENTS: usize = 10_000_000;

/// The search for the next point.
struct Search {
    /// The name of the event.
    name: String,
    /// The time of the last point, or of the start.
    from: f64,
    /// The number of elements since.
    elements: usize,
    /// The largest such number.
    most: usize,
}

impl Search {
    /// Counts an element that ends at a time; the error of a search that has come to its end.
    fn count(&mut self, time: f64) -> Result<(), RunErrorKind> {
        self.elements += 1;
        if self.elements < self.most {
            return Ok(());
        }
        Err(RunErrorKind::NoCrossing {
            name: self.name.clone(),
            from: self.from,
            time,
        })
    }
}

impl<M, const N: usize, L> Section<'_, M, N, L>
where
    M: Sectioned<N, L>,
    L: Length<N>,
{
    /// Looks for each point in at most so many elements from the one before, or from the start, instead of ten million.
    #[must_use]
    pub fn within(mut self, elements: usize) -> Self {
        self.search.most = elements;
        self
    }
}

impl<M, const N: usize, L> fmt::Debug for Section<'_, M, N, L>
where
    M: Sectioned<N, L>,
    L: Length<N>,
{
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Section")
            .field("time", &self.endless.sequence.time())
            .field("state", &self.endless.state)
            .finish_non_exhaustive()
    }
}

/// A model that has Poincaré sections; points of models of fixed size can have transition matrices.
pub trait Sectioned<const N: usize, L: Length<N>>: Simulated<N, L> {
    /// The type that carries the derivatives along.
    type Tangents<'m>: Carry<'m, Self, N, L>
    where
        Self: 'm;
}

impl<M: Model<N>, const N: usize> Sectioned<N, FixedLength> for M {
    type Tangents<'m>
        = Tangents<'m, M, N>
    where
        M: 'm;
}

impl<M: family::Model> Sectioned<0, RunTimeLength> for M {
    type Tangents<'m>
        = Infallible
    where
        M: 'm;
}

/// Propagates transition matrices from point to point.
pub trait Carry<'m, M: 'm, const N: usize, L: Length<N>>: Follow<'m, M, N, L> {
    /// The transition matrix up to a crossing.
    fn crossed(&mut self, severed: &Severed<'_, 'm, N, L>)
    -> Result<DMatrix<f64>, TransitionError>;
}

impl<'m, M: Model<N> + 'm, const N: usize> Carry<'m, M, N, FixedLength> for Tangents<'m, M, N> {
    fn crossed(&mut self, severed: &Severed<'_, 'm, N>) -> Result<DMatrix<f64>, TransitionError> {
        self.crossed(severed)
    }
}

impl<'m, M: family::Model + 'm> Follow<'m, M, 0, RunTimeLength> for Infallible {
    fn passed(
        &mut self,
        _: &mut family::Stepper<'m, M>,
        _: &Passed<'_, 0, RunTimeLength>,
    ) -> Result<(), TransitionError> {
        match *self {}
    }
}

impl<'m, M: family::Model + 'm> Carry<'m, M, 0, RunTimeLength> for Infallible {
    fn crossed(
        &mut self,
        _: &Severed<'_, 'm, 0, RunTimeLength>,
    ) -> Result<DMatrix<f64>, TransitionError> {
        match *self {}
    }
}

impl<M: Model<N>, const N: usize> Section<'_, M, N> {
    /// Computes the [transition matrix](SectionPoint::transition) of each point from now on, for the cost of a
    /// factorisation and 2N solutions in each step, and as much again at each point.
    ///
    /// Where forces jump, matrices are right after [`at_kinks(true)`](Simulation::at_kinks) only. If an event sets a parameter
    /// to a value that depends on the state, the iterator ends with [`RunErrorKind::SetByState`].
    #[must_use]
    pub fn linearised(mut self) -> Self {
        let tangents = Tangents::new(self.model.clone(), self.chosen, &[]);
        self.crossings.tangents = Some(tangents);
        self
    }
}

impl<M, const N: usize, L> Iterator for Section<'_, M, N, L>
where
    M: Sectioned<N, L>,
    L: Length<N>,
{
    type Item = Result<SectionPoint<N, L>, RunErrorKind>;

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            if let Some(point) = self.crossings.points.pop_front() {
                if let Ok(point) = &point {
                    (self.search.from, self.search.elements) = (point.t, 0);
                }
                return Some(point);
            }
            match self.endless.pass(&mut self.crossings)? {
                Ok((Left::Done, _)) if !self.crossings.points.is_empty() => {}
                Ok((Left::Done, time)) => {
                    if let Err(kind) = self.search.count(time) {
                        self.endless.sequence = ElementSequence::new(Err(kind));
                    }
                }
                // Points before the end may still be in the queue.
                Ok((Left::Stopped, _)) => return self.crossings.points.pop_front(),
                Err(kind) => self.crossings.points.push_back(Err(kind)),
            }
        }
    }
}

/// The index of the section among the events: it comes first, so that the actions of other events on the surface come
/// after the point.
const SECTION: usize = 0;

/// Collects the crossings of an element.
struct Crossings<'m, M: Sectioned<N, L> + 'm, const N: usize, L: Length<N>> {
    /// The derivatives since the last crossing.
    tangents: Option<M::Tangents<'m>>,
    points: VecDeque<Result<SectionPoint<N, L>, RunErrorKind>>,
}

impl<'m, M, const N: usize, L> Follow<'m, M, N, L> for Crossings<'m, M, N, L>
where
    M: Sectioned<N, L>,
    L: Length<N>,
{
    fn passed(
        &mut self,
        stepper: &mut L::Stepper<'m, M>,
        passed: &Passed<'_, N, L>,
    ) -> Result<(), TransitionError> {
        match &mut self.tangents {
            Some(tangents) => tangents.passed(stepper, passed),
            None => Ok(()),
        }
    }

    fn met(&mut self, severed: &Severed<'_, 'm, N, L>) -> Result<(), TransitionError> {
        if severed.which != SECTION {
            return Ok(());
        }
        let matrix = self.tangents.as_mut().map(|one| one.crossed(severed));
        self.points.push_back(Ok(SectionPoint {
            event: severed.event.clone(),
            transition: matrix.transpose()?,
        }));
        Ok(())
    }

    fn cut(&mut self, severed: &Severed<'_, 'm, N, L>) -> Result<(), TransitionError> {
        match &mut self.tangents {
            Some(tangents) => tangents.cut(severed),
            None => Ok(()),
        }
    }

    fn acted(&mut self) {
        if let Some(tangents) = &mut self.tangents {
            tangents.acted();
        }
    }

    fn set(&mut self, model: &Share<'m, M>) -> Result<(), RunErrorKind> {
        match &mut self.tangents {
            Some(tangents) => tangents.set(model),
            None => Ok(()),
        }
    }
}

impl<'m, M, const N: usize, L> Observe<'m, M, N, L> for Crossings<'m, M, N, L>
where
    M: Sectioned<N, L>,
    L: Length<N>,
{
    fn keeps(&self) -> bool {
        false
    }

    fn at_event(&mut self, _: &mut L::Stepper<'m, M>, _: &M, _: Side, _: (f64, &L::State)) {}
}
