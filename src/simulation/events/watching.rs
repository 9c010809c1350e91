//! What runs are asked to look for, and what looks for it.

use super::act::{Act, Crossing, Occurrence, On};
use super::remodel::{Remodel, remodel};
use super::value::{Function, Value};
use super::{Events, Look, Rooms, Watched};
use crate::error::RunErrorKind;
use std::sync::Arc;
use tfe_runtime::step::Control;
use tfe_runtime::{Element, Model, Share};

/// What runs are asked to look for.
#[derive(Debug)]
pub(crate) struct Watching<'m, M, const N: usize> {
    on: Vec<On<'m, N>>,
    /// Makes models with other parameters, where events may ask for them.
    remodel: Option<Remodel<'m, M>>,
    /// Called where there is anything to look for, and so compiled for models with events only.
    look: Look<'m, M, N>,
}

// Not derived: models need not be `Clone`.
impl<M, const N: usize> Clone for Watching<'_, M, N> {
    fn clone(&self) -> Self {
        Self {
            on: self.on.clone(),
            ..*self
        }
    }
}

impl<'m, M, const N: usize> Watching<'m, M, N> {
    /// No events.
    pub(crate) const NOTHING: Self = Self {
        on: Vec::new(),
        remodel: None,
        look: |_, _| Ok(None),
    };

    pub(crate) fn is_empty(&self) -> bool {
        self.on.is_empty()
    }

    pub(in crate::simulation) fn len(&self) -> usize {
        self.on.len()
    }

    /// The same of another model.
    pub(in crate::simulation) fn of<T>(self) -> Watching<'m, T, N>
    where
        T: Model<N> + Send + Sync + 'm,
    {
        let mut watching = Watching::NOTHING;
        for on in self.on {
            watching.watch(on);
        }
        watching.remodel = self.remodel.map(|_| remodel as Remodel<'m, T>);
        watching
    }
}

impl<'m, M: Model<N>, const N: usize> Watching<'m, M, N> {
    /// One event more, that sets no parameters.
    pub(in crate::simulation) fn watch(&mut self, on: On<'m, N>) {
        self.on.push(on);
        self.look = Events::look;
    }

    /// One event more: of an output, or of a function.
    pub(crate) fn push(
        &mut self,
        name: impl Into<String>,
        crossing: Crossing,
        function: Option<Function<'m, N>>,
        act: impl Fn(&Occurrence<'_, N>) -> Act<N> + Send + Sync + 'm,
    ) where
        M: Send + Sync + 'm,
    {
        self.watch(On {
            name: name.into(),
            function,
            crossing,
            act: Arc::new(act),
        });
        self.remodel = Some(remodel);
    }
}

impl<'m, M: Model<N>, const N: usize> Events<'m, M, N> {
    /// Those of a run.
    pub(in crate::simulation) fn new(
        model: Share<'m, M>,
        watching: &Watching<'m, M, N>,
        (element, control, at_kinks): (Element, Control, bool),
    ) -> Result<Self, RunErrorKind> {
        let known = || (0..model.columns()).map(|at| model.column_name(at).to_string());
        let watched = |one: &On<'m, N>| {
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
        let watched: Vec<_> = watching.on.iter().map(watched).collect::<Result<_, _>>()?;
        let columns = model.columns();
        Ok(Self {
            model,
            remodel: watching.remodel,
            look: watching.look,
            sides: vec![0.0; watched.len()],
            watched,
            element,
            control,
            at_kinks,
            rooms: Rooms::new(columns),
            probe: None,
            met: Vec::new(),
            recorded: Vec::new(),
            cuts: 0,
            step: 0.0,
            last: None,
        })
    }
}
