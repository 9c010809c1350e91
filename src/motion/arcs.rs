//! The arcs of a motion, between events that changed its state or its parameters.

use crate::evaluate::Evaluate;
use crate::length::Length;
use std::ops::Range;
use tfe_runtime::Statistics;

/// A part of a motion between two changes of the state or of parameters by events; from
/// [`Motion::arcs`](crate::Motion::arcs).
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MotionArc {
    /// The indices of its recorded nodes. The first is the state after the event at which the arc begins, the last the
    /// state before the event at which it ends.
    pub nodes: Range<usize>,
    /// What the arc cost. Elements that end at an event are solved several times while the event is located; these
    /// solutions are not counted.
    pub statistics: Statistics,
}

/// A parameter that an event has set.
#[derive(Clone, Debug, PartialEq)]
pub struct Setting {
    /// The time of the event.
    pub t: f64,
    /// The index of the first recorded node with the new value: of the two nodes at this time, the second.
    pub node: usize,
    /// The parameter's name in the model.
    pub parameter: String,
    /// Its new value.
    pub value: f64,
}

/// The starts of the arcs, and the parameters that were set there.
#[derive(Clone, Debug, Default)]
pub(super) struct Arcs {
    /// The first node of each arc except the first, with the work up to there.
    begins: Vec<(usize, Statistics)>,
    settings: Vec<Setting>,
}

impl Arcs {
    pub(super) fn begin(&mut self, node: usize, so_far: Statistics) {
        self.begins.push((node, so_far));
    }

    pub(super) fn set(&mut self, setting: Setting) {
        self.settings.push(setting);
    }

    pub(super) fn settings(&self) -> &[Setting] {
        &self.settings
    }

    /// The ranges of nodes of all arcs of a motion with `count` nodes.
    pub(super) fn nodes(&self, count: usize) -> impl Iterator<Item = Range<usize>> {
        let begins = self.begins.iter().map(|(node, _)| *node);
        let starts = [0].into_iter().chain(begins.clone());
        starts
            .zip(begins.chain([count]))
            .map(|(start, end)| start..end)
    }

    pub(super) fn all(&self, count: usize, total: Statistics) -> impl Iterator<Item = MotionArc> {
        let costs = self.begins.iter().map(|(_, so_far)| *so_far);
        let before = [Statistics::NONE].into_iter().chain(costs.clone());
        let costs = before.zip(costs.chain([total]));
        self.nodes(count)
            .zip(costs)
            .map(|(nodes, (before, after))| MotionArc {
                nodes,
                statistics: after.since(&before),
            })
    }

    /// The model with the parameters that were set at a node; `None` if none were set.
    pub(super) fn model_from<M, L, const N: usize>(&self, model: &M, node: usize) -> Option<M>
    where
        M: Evaluate<N, L>,
        L: Length<N>,
    {
        let first = self.settings.partition_point(|one| one.node < node);
        let here = self.settings[first..]
            .iter()
            .take_while(|one| one.node == node);
        let mut made: Option<M> = None;
        for one in here {
            let now = made.as_ref().unwrap_or(model);
            made = Some(now.with(&one.parameter, one.value)?);
        }
        made
    }
}
