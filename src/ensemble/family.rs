//! Ensembles of models of run-time length.

use super::ends::Ends;
use super::error::EnsembleError;
use super::members::Models;
use super::plan::start_of;
use super::results::{Results, lock, unlock};
use super::setup::Ensemble;
use crate::error::RunErrorKind;
use crate::length::RunTimeLength;
use crate::motion::Node;
use crate::progress::Progress;
use crate::simulation::mesh::Mesh;
use std::ops::Range;
use std::sync::Mutex;
use tfe_runtime::Statistics;
use tfe_runtime::family::{self, FamilyState};

impl<'m, M, K> Ensemble<'m, M, 0, K, RunTimeLength>
where
    M: family::Model + Sync,
    K: Models<'m, M>,
{
    /// Runs all trajectories over the span, backwards in time if it ends before it starts. Each result is the node at
    /// the end, or the error of that run; a failure does not stop other runs.
    ///
    /// ```
    /// use tfe::prelude::*;
    ///
    /// #[dynamics(
    ///     coordinates(q[n]),
    ///     lagrangian = sum(i in 0..n, dot(q[i])^2/2 - q[i]^2/2) - sum(i in 0..n-1, c/4*(q[i+1] - q[i])^4),
    /// )]
    /// struct Chain { n: usize, c: f64 }
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// // Chains of other lengths and stiffnesses, each from a start of its own.
    /// let chains: Vec<_> = (1..=10).map(|n| Chain { n, c: 0.1 * n as f64 }).collect();
    /// let starts: Vec<_> = chains.iter().map(|chain| chain.state(vec![1.0; chain.n], vec![0.0; chain.n])).collect();
    /// let ends = Ensemble::of_models(&chains).step(0.1).run(&starts, 0.0..10.0)?;
    /// for end in ends.nodes() {
    ///     assert!(end.q.iter().all(|q| (q - 10.0_f64.cos()).abs() < 1e-8)); // all sites move alike
    /// }
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    /// If nothing can run: [`EnsembleError::Run`] if the element does not exist or the step size or the span is invalid,
    /// [`EnsembleError::Starts`] if the number of starts does not fit the number of models. An invalid start, or a model
    /// whose lengths do not fit each other, fails its own run only.
    pub fn run(
        &self,
        starts: &[FamilyState],
        span: Range<f64>,
    ) -> Result<Ends<0, RunTimeLength>, EnsembleError> {
        let count = self.models.count(starts.len())?;
        let results = Mutex::new(Results::new(count));
        let from = span.start;
        let statistics = self.for_each(starts, span, |index, result| {
            let model = self.models.model(index);
            let warnings = self.doubts(model, (from, start_of(starts, index)), &result);
            lock(&results).put(index, result, warnings);
        })?;
        Ok(unlock(results).into_ends(statistics))
    }

    /// Runs all trajectories, and hands over each result with the index of its run as soon as it is known: in no
    /// particular order, and with the feature `parallel` from several threads.
    ///
    /// Returns the cost of all runs together.
    ///
    /// # Errors
    /// As from [`run`](Self::run).
    pub fn for_each<F>(
        &self,
        starts: &[FamilyState],
        span: Range<f64>,
        finished: F,
    ) -> Result<Statistics, EnsembleError>
    where
        F: Fn(usize, Result<Node<0, RunTimeLength>, RunErrorKind>) + Send + Sync,
    {
        let count = self.models.count(starts.len())?;
        let step = self.step_over(&span);
        Mesh::<0>::new(&span, step, &self.breaks, &[])?;
        self.check_method()?;
        let progress = Progress::new(self.progress, count, "runs");
        Ok(self.run_one_by_one(starts, &span, (count, &progress), &finished))
    }
}
