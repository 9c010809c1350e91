//! Steps of families that are cut at kinks and jumps of forces (T-119).

use super::{Stepper, Way};
use crate::error::StepError;
use crate::family::dense::DenseElement;
use crate::family::model::{Block, Entries, FamilyState, Gradient, Model};
use crate::kinks::{Kinked, Log, Origin, Watched, in_arcs};
use crate::model::Form;
use crate::real::Real as _;
use crate::scheme::Tables as _;
use alloc::vec;
use alloc::vec::Vec;

impl<M: Model> Stepper<'_, M> {
    /// The same stepper, with steps that end where a force has a kink or a jump, and continue behind it. `abs`, `sign`,
    /// `min`, `max` and `select` choose by the signs of functions of the state, different ones at each site; elements
    /// in which none changes its sign have their full order. [`Statistics::kinks`](crate::Statistics::kinks) counts the
    /// crossings. Models without such functions are stepped as before.
    #[must_use]
    pub fn at_kinks(self) -> Self {
        Self {
            at_kinks: true,
            ..self
        }
    }

    /// Whether kernels have branches that depend on a sign; if they have none, this is not evaluated again. At a start
    /// without velocity the answer is unknown: the step reports the reason.
    pub(super) fn has_kinks(&mut self, t: f64, state: &FamilyState) -> bool {
        let is_right = state.q.len() == self.length && state.p.len() == self.length;
        let mut switches = Vec::new();
        if !(is_right && self.switches(t, state, &mut switches)) {
            return false;
        }
        self.at_kinks = !switches.is_empty();
        self.has_constraint_kinks = self.are_constraints_chosen(t, state);
        self.at_kinks
    }

    /// Whether constraints have branches.
    fn are_constraints_chosen(&self, t: f64, state: &FamilyState) -> bool {
        let log = Log::new(Vec::new());
        let q = watch(&state.q, &log);
        deciding_constraints(&*self.model, Watched::new(t, &log), &q, &log);
        drop(q);
        !log.values().is_empty()
    }

    #[cold]
    pub(super) fn advance_in_arcs(
        &mut self,
        t: f64,
        h: f64,
        state: &mut FamilyState,
    ) -> Result<(), StepError> {
        let (start, steps) = (state.clone(), self.statistics().steps);
        let outcome = in_arcs(self, (t, h), state, &[]);
        self.trust(false);
        self.statistics_mut().steps = steps + u64::from(outcome.is_ok());
        if outcome.is_err() {
            *state = start;
            self.forget();
            self.pieces.clear();
        }
        outcome
    }
}

impl<M: Model> Kinked for Stepper<'_, M> {
    type Inside = DenseElement;

    fn inside(&self) -> DenseElement {
        self.dense_of_last(0.0, 1.0)
    }

    fn at(&self, inside: &DenseElement, tau: f64) -> FamilyState {
        inside.at(tau)
    }

    fn forget(&mut self) {
        match &mut self.way {
            Way::Forces(forces) => forces.forget(),
            #[cfg(feature = "sparse")]
            Way::Rates(rates) => rates.forget(),
        }
    }

    fn switches(&mut self, t: f64, state: &FamilyState, values: &mut Vec<f64>) -> bool {
        let velocity = match M::FORM {
            Form::Lagrangian => match self.legendre.velocity(&*self.model, t, state) {
                Ok(velocity) => Some(velocity),
                Err(_) => return false,
            },
            Form::Hamiltonian => None,
        };
        let log = Log::new(core::mem::take(values));
        let (q, z) = (
            watch(&state.q, &log),
            watch(velocity.as_ref().unwrap_or(&state.p), &log),
        );
        let zeros = || vec![Watched::from_f64(0.0); self.length];
        let (mut by_z, mut by_q, mut force) = (zeros(), zeros(), zeros());
        let first = Gradient {
            z: &mut by_z,
            q: &mut by_q,
            force: &mut force,
        };
        self.model.first(Watched::new(t, &log), &q, &z, first);
        let forces = log.deciding(by_z.iter().chain(&by_q).chain(&force));
        let constraints = deciding_constraints(&*self.model, Watched::new(t, &log), &q, &log);
        let origin = log.both(forces, constraints);
        drop((q, z, by_z, by_q, force));
        *values = log.decisive(origin);
        true
    }

    fn points(&self) -> (usize, bool) {
        let scheme = match &self.way {
            Way::Forces(forces) => forces.table().view(),
            #[cfg(feature = "sparse")]
            Way::Rates(rates) => rates.table().view(),
        };
        // Constraints are evaluated at the ends of every element.
        (
            scheme.points(),
            scheme.has_ends() || self.has_constraint_kinks,
        )
    }

    fn crossed(&mut self, _: usize) {
        self.statistics_mut().kinks += 1;
    }

    fn has_constraint_kinks(&self) -> bool {
        self.has_constraint_kinks
    }

    fn ahead(&self, inside: &DenseElement, part: f64, end: &FamilyState) -> FamilyState {
        let (here, there) = (inside.at(1.0), inside.at(1.0 + part));
        let moved = |end: &[f64], here: &[f64], there: &[f64]| {
            let ends = end.iter().zip(here).zip(there);
            ends.map(|((end, here), there)| end + (there - here))
                .collect()
        };
        FamilyState {
            q: moved(&end.q, &here.q, &there.q),
            p: moved(&end.p, &here.p, &there.p),
        }
    }

    fn begin_behind(&mut self, _is_behind: bool) {
        #[cfg(feature = "sparse")]
        if let Way::Rates(rates) = &mut self.way {
            rates.is_behind_kink = _is_behind;
        }
    }

    fn cuts(&self) -> bool {
        self.control.solve.cuts()
    }

    fn trust(&mut self, all: bool) {
        self.way.control_mut().solve = self.control.solve.trusting(all);
    }
}

/// The switching functions that have decided the constraints, their gradients and their drift.
fn deciding_constraints<'a, M: Model>(
    model: &M,
    t: Watched<'a>,
    q: &[Watched<'a>],
    log: &Log,
) -> Origin {
    let zeros = || vec![Watched::from_f64(0.0); model.constraints()];
    let (mut values, mut drift) = (zeros(), zeros());
    let mut rows = Collected(Vec::new());
    model.constraint_values(t, q, &mut values);
    model.constraint_rows(t, q, &mut drift, &mut rows);
    log.deciding(values.iter().chain(&drift).chain(&rows.0))
}

/// The contributions to a matrix.
struct Collected<'a>(Vec<Watched<'a>>);

impl<'a> Entries<Watched<'a>> for Collected<'a> {
    fn add(&mut self, _: Block, _: usize, _: usize, value: Watched<'a>) {
        self.0.push(value);
    }
}

/// The numbers, with a log of their comparisons.
fn watch<'a>(numbers: &[f64], log: &'a Log) -> Vec<Watched<'a>> {
    let all = numbers.iter().map(|number| Watched::new(*number, log));
    all.collect()
}
