//! The list of events that a run watches.

use super::act::{Action, Crossing, On};
use super::clear::Clear;
use super::remodel::{Remodel, remodel};
use super::value::{Function, Value};
use super::{Buffers, Events, Watched};
use crate::error::RunErrorKind;
use crate::length::{FixedLength, Length};
use crate::motion::{Seen, Warning};
use crate::simulation::kind::Simulated;
use crate::simulation::pieces::{Pieces, Search};
use std::collections::VecDeque;
use std::fmt;
use tfe_runtime::CoordinateName;

/// The list of events of a run, with the function that searches for them.
pub(crate) struct Watching<'m, M: 'm, const N: usize, L: Length<N> = FixedLength> {
    on: Vec<On<'m, N, L>>,
    /// Creates models with changed parameters, if an event can ask for it.
    remodel: Option<Remodel<'m, M>>,
    /// The search itself, if there are events.
    search: Option<Search<'m, M, N, L>>,
}

impl<M, const N: usize, L: Length<N>> fmt::Debug for Watching<'_, M, N, L> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_list().entries(&self.on).finish()
    }
}

// Not derived: models need not be `Clone`.
impl<M, const N: usize, L: Length<N>> Clone for Watching<'_, M, N, L> {
    fn clone(&self) -> Self {
        Self {
            on: self.on.clone(),
            ..*self
        }
    }
}

impl<'m, M, const N: usize, L: Length<N>> Watching<'m, M, N, L> {
    /// No events.
    pub(crate) const NOTHING: Self = Self {
        on: Vec::new(),
        remodel: None,
        search: None,
    };

    pub(crate) fn is_empty(&self) -> bool {
        self.on.is_empty()
    }

    pub(in crate::simulation) fn search(&self) -> Option<Search<'m, M, N, L>> {
        self.search
    }

    pub(in crate::simulation) fn remodel(&self) -> Option<Remodel<'m, M>> {
        self.remodel
    }

    /// Adds an event that sets no parameters.
    pub(in crate::simulation) fn watch(&mut self, on: On<'m, N, L>)
    where
        M: Simulated<N, L>,
    {
        self.on.push(on);
        self.search = Some(Pieces::pass_searching);
    }

    /// Adds an event before all others; it is the first of simultaneous events.
    pub(in crate::simulation) fn watch_first(&mut self, on: On<'m, N, L>)
    where
        M: Simulated<N, L>,
    {
        self.watch(on);
        self.on.rotate_right(1);
    }

    /// Adds an event of an output or of a function.
    pub(crate) fn push(
        &mut self,
        name: String,
        crossing: Crossing,
        function: Option<Function<'m, L::Vector>>,
        act: Action<'m, N, L>,
    ) where
        M: Settable<'m, N, L>,
    {
        self.watch(On {
            name,
            function,
            crossing,
            act,
        });
        self.remodel = Some(remodel);
    }
}

impl<'m, M, const N: usize, L: Length<N>> Watching<'m, M, N, L> {
    /// The same events for another model.
    pub(in crate::simulation) fn of<T>(self) -> Watching<'m, T, N, L>
    where
        T: Simulated<N, L> + Send + Sync + 'm,
    {
        let mut watching = Watching::NOTHING;
        for on in self.on {
            watching.watch(on);
        }
        watching.remodel = self.remodel.map(|_| remodel as Remodel<'m, T>);
        watching
    }
}

/// Resolves the events, given the names of the outputs.
fn watched<'m, const N: usize, L: Length<N>>(
    on: &[On<'m, N, L>],
    names: &[CoordinateName],
) -> Result<Vec<Watched<'m, N, L>>, RunErrorKind> {
    let known = || names.iter().map(ToString::to_string);
    let watched = |one: &On<'m, N, L>| {
        let value = match &one.function {
            Some(function) => Value::Function(function.clone()),
            None => match known().position(|name| name == one.name) {
                Some(column) => Value::Column(column),
                None => {
                    return Err(RunErrorKind::NoEvent {
                        name: one.name.clone(),
                        known: known().collect(),
                    });
                }
            },
        };
        let on = one.clone();
        Ok(Watched { on, value })
    };
    on.iter().map(watched).collect()
}

/// The record of events before a run.
fn unseen<const N: usize, L: Length<N>>(watched: &[Watched<'_, N, L>]) -> Seen {
    Seen::nothing(watched.iter().map(|one| one.on.name.clone()).collect())
}

/// A model whose events may set parameters; it can be shared between threads.
pub trait Settable<'m, const N: usize, L: Length<N>>: Simulated<N, L> + Send + Sync + 'm {}

impl<'m, M, const N: usize, L: Length<N>> Settable<'m, N, L> for M where
    M: Simulated<N, L> + Send + Sync + 'm
{
}

impl<'m, const N: usize, L: Length<N>> Events<'m, N, L> {
    /// Prepares the events of a run.
    pub(in crate::simulation) fn new<M: Simulated<N, L>>(
        model: &M,
        watching: &Watching<'m, M, N, L>,
    ) -> Result<Self, RunErrorKind> {
        let names = match watching.is_empty() {
            true => Vec::new(),
            false => model.output_names(),
        };
        Self::of(&watching.on, &names, M::NEEDS_VELOCITY)
    }

    /// The events `on`, given the names of the outputs and whether these need the velocity.
    fn of(
        on: &[On<'m, N, L>],
        names: &[CoordinateName],
        needs_velocity: bool,
    ) -> Result<Self, RunErrorKind> {
        let watched = watched(on, names)?;
        Ok(Self {
            undefined: vec![None; watched.len()],
            needs_velocity: needs_velocity || watched.iter().any(Watched::is_function),
            seen: unseen(&watched),
            due: VecDeque::new(),
            watched,
            clear: Clear::default(),
            rooms: Buffers::new(names.len()),
            met: Vec::new(),
            recorded: Vec::new(),
            cuts: 0,
            since: 0.0,
            step: 0.0,
        })
    }

    /// Remembers which functions are NaN from a position of an element on, whose time is `at`; beyond a cut they may be
    /// so without harm.
    pub(super) fn note_undefined(&mut self, undefined: &[Option<f64>], at: impl Fn(f64) -> f64) {
        for (known, tau) in self.undefined.iter_mut().zip(undefined) {
            *known = known.or(tau.map(&at));
        }
    }

    /// Warnings of events that could not happen, because their functions were NaN.
    pub(in crate::simulation) fn warnings(&self) -> impl Iterator<Item = Warning> {
        let watched = self.watched.iter().zip(&self.undefined);
        watched.filter_map(|(watched, time)| {
            let event = watched.on.name.clone();
            time.map(|time| Warning::EventUndefined { event, time })
        })
    }
}
