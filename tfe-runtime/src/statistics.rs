//! What a run cost.

use core::fmt;

/// Counts over all steps so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Statistics {
    /// Accepted steps.
    pub steps: u64,
    /// Iterations of either kind.
    pub iterations: u64,
    /// Iterations of the fixed-point kind.
    pub fixed_point_iterations: u64,
    /// Iterations of Newton's kind.
    pub newton_iterations: u64,
    /// Calls of the kernel of first derivatives (with or without the mass matrix).
    pub residual_evaluations: u64,
    /// Calls of the kernel of second derivatives.
    pub tangent_evaluations: u64,
    /// Factorisations of the tangent of an element.
    pub factorizations: u64,
    /// Steps at which the fixed-point iteration was given up for Newton's.
    pub fallbacks: u64,
}

impl Statistics {
    /// Nothing done.
    pub const NONE: Self = Self {
        steps: 0,
        iterations: 0,
        fixed_point_iterations: 0,
        newton_iterations: 0,
        residual_evaluations: 0,
        tangent_evaluations: 0,
        factorizations: 0,
        fallbacks: 0,
    };

    /// Adds the counts of another run, for instance of another trajectory.
    pub fn merge(&mut self, other: &Self) {
        self.steps += other.steps;
        self.iterations += other.iterations;
        self.fixed_point_iterations += other.fixed_point_iterations;
        self.newton_iterations += other.newton_iterations;
        self.residual_evaluations += other.residual_evaluations;
        self.tangent_evaluations += other.tangent_evaluations;
        self.factorizations += other.factorizations;
        self.fallbacks += other.fallbacks;
    }
}

impl fmt::Display for Statistics {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} steps, {} iterations ({} fixed-point, {} Newton), {} residual and {} tangent \
             evaluations, {} factorisations, {} fallbacks",
            self.steps,
            self.iterations,
            self.fixed_point_iterations,
            self.newton_iterations,
            self.residual_evaluations,
            self.tangent_evaluations,
            self.factorizations,
            self.fallbacks
        )
    }
}
