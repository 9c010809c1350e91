//! How the time of a root of a switching function changes with the motion and with parameters.

use super::switches::deciding;
use super::watched::Log;
use crate::constrained::{VelocitySlope, velocity_of};
use crate::dual::{Dual, duals};
use crate::error::StepError;
use crate::model::{Form, Model, State};
use alloc::vec::Vec;

/// A change of a point of a motion.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Change<const N: usize> {
    pub(crate) t: f64,
    pub(crate) state: State<N>,
    /// The index of the parameter that changes by one.
    pub(crate) parameter: Option<usize>,
}

/// A root of a switching function at the end of an arc.
pub(crate) struct Root<'a, M, const N: usize> {
    model: &'a M,
    t: f64,
    state: State<N>,
    v: [f64; N],
    velocity: VelocitySlope<'a, M, N>,
    switch: usize,
}

impl<'a, M: Model<N>, const N: usize> Root<'a, M, N> {
    /// The root of a function, given by its index, at a state.
    ///
    /// # Errors
    /// [`StepError`] where there is no velocity.
    pub(crate) fn new(
        model: &'a M,
        (t, state): (f64, State<N>),
        switch: usize,
    ) -> Result<Self, StepError> {
        let (q, p) = (&state.q, &state.p);
        let v = match M::FORM {
            Form::Lagrangian => velocity_of(model, t, q, p, &[0.0; N])?,
            Form::Hamiltonian => [0.0; N],
        };
        Ok(Self {
            model,
            t,
            state,
            v,
            velocity: VelocitySlope::new(model, t, (q, p), &v),
            switch,
        })
    }

    /// The derivative of the function g(t, q, z) along a change; NaN if it has none.
    pub(crate) fn along(&self, change: &Change<N>) -> f64 {
        let t = Dual::new(self.t, change.t).by_parameter(change.parameter);
        let q = duals(&self.state.q, &change.state.q);
        let p = duals(&self.state.p, &change.state.p);
        let z = match M::FORM {
            Form::Lagrangian => duals(&self.v, &self.velocity.along(t, (&q, &p))),
            Form::Hamiltonian => p,
        };
        let log = Log::new(Vec::new());
        deciding(self.model, (t, &q, &z), &log);
        log.values()
            .get(self.switch)
            .map_or(f64::NAN, |value| value.slope)
    }
}
