//! The cost of a run, in counts of evaluations and iterations.

use core::fmt;

/// Counts over all steps so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Statistics {
    /// Accepted steps.
    pub steps: u64,
    /// Iterations of both kinds.
    pub iterations: u64,
    /// Fixed-point iterations.
    pub fixed_point_iterations: u64,
    /// Iterations of Newton's method.
    pub newton_iterations: u64,
    /// Calls of the kernel of first derivatives (with or without the mass matrix).
    pub residual_evaluations: u64,
    /// Calls of the kernel of second derivatives.
    pub tangent_evaluations: u64,
    /// LU factorisations of the tangent of an element.
    pub factorizations: u64,
    /// Steps in which the fixed-point iteration was given up for Newton's method.
    pub fallbacks: u64,
    /// Steps that were cut into pieces, because Newton's method did not prove that the root of the whole step is the
    /// one that continues the motion.
    pub cuts: u64,
    /// Crossings of a kink or a jump of a force at which a step was cut: sign changes of the argument by which an
    /// `abs`, `sign`, `min`, `max` or `select` chooses.
    pub kinks: u64,
    /// Steps of a linear model that were made by one product with its propagator.
    pub products: u64,
    /// The contraction ratio of the fixed-point iteration when it was last measured.
    pub contraction: Contraction,
}

/// The ratio of two successive increments, to seven digits. It is kept as the bits of a non-negative number, which have
/// the same order as the numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Contraction(u32);

impl Contraction {
    /// Nothing measured.
    pub const NONE: Self = Self(0);

    /// From a ratio; a NaN counts as no contraction.
    pub(crate) fn of(ratio: f64) -> Self {
        #[allow(clippy::cast_possible_truncation, reason = "seven digits do")]
        Self((ratio as f32).to_bits())
    }

    /// The ratio.
    #[must_use]
    pub fn ratio(self) -> f64 {
        let ratio = f64::from(f32::from_bits(self.0));
        if ratio.is_nan() {
            1.0
        } else {
            ratio.min(1000.0)
        }
    }
}

/// How the equations were solved, and why: what [`Solve::Auto`](crate::Solve::Auto) chose. `Display` writes a sentence.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Choice {
    /// No step was made.
    None,
    /// The fixed-point iteration contracted in all steps.
    FixedPoint,
    /// The fixed-point iteration was given up in some steps, and Newton's method was used for these and some that
    /// followed.
    Both,
    /// Newton's method only: the equations are linear, or it was requested, or the form of the equations has no
    /// fixed-point iteration.
    Newton,
    /// A linear model: one product with a matrix for each step.
    Product,
}

impl Statistics {
    /// All counts zero.
    pub const NONE: Self = Self {
        steps: 0,
        iterations: 0,
        fixed_point_iterations: 0,
        newton_iterations: 0,
        residual_evaluations: 0,
        tangent_evaluations: 0,
        factorizations: 0,
        fallbacks: 0,
        cuts: 0,
        kinks: 0,
        products: 0,
        contraction: Contraction::NONE,
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
        self.cuts += other.cuts;
        self.kinks += other.kinks;
        self.products += other.products;
        self.contraction = self.contraction.max(other.contraction);
    }

    /// The counts that were added since `before`, which is an earlier state of these counts.
    #[must_use]
    pub fn since(&self, before: &Self) -> Self {
        Self {
            steps: self.steps - before.steps,
            iterations: self.iterations - before.iterations,
            fixed_point_iterations: self.fixed_point_iterations - before.fixed_point_iterations,
            newton_iterations: self.newton_iterations - before.newton_iterations,
            residual_evaluations: self.residual_evaluations - before.residual_evaluations,
            tangent_evaluations: self.tangent_evaluations - before.tangent_evaluations,
            factorizations: self.factorizations - before.factorizations,
            fallbacks: self.fallbacks - before.fallbacks,
            cuts: self.cuts - before.cuts,
            kinks: self.kinks - before.kinks,
            products: self.products - before.products,
            contraction: self.contraction,
        }
    }

    /// How the equations were solved.
    #[must_use]
    pub fn choice(&self) -> Choice {
        if self.steps == 0 {
            Choice::None
        } else if self.products > 0 {
            Choice::Product
        } else if self.fixed_point_iterations == 0 {
            Choice::Newton
        } else if self.newton_iterations == 0 {
            Choice::FixedPoint
        } else {
            Choice::Both
        }
    }

    /// The same as a sentence, with the reason.
    #[must_use]
    pub fn reason(&self) -> impl fmt::Display + use<> {
        Reason(*self)
    }
}

impl fmt::Display for Statistics {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} steps, {} iterations ({} fixed-point, {} Newton), {} residual and {} tangent \
             evaluations, {} factorisations, {} fallbacks, {} cuts",
            self.steps,
            self.iterations,
            self.fixed_point_iterations,
            self.newton_iterations,
            self.residual_evaluations,
            self.tangent_evaluations,
            self.factorizations,
            self.fallbacks,
            self.cuts
        )
    }
}

struct Reason(Statistics);

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Statistics {
            steps,
            fallbacks,
            products,
            contraction,
            factorizations,
            newton_iterations,
            ..
        } = self.0;
        let ratio = contraction.ratio();
        match self.0.choice() {
            Choice::None => f.write_str("no step was done"),
            Choice::FixedPoint => write!(
                f,
                "fixed point: increments shrank by a factor of {ratio:.1e} an iteration"
            ),
            Choice::Both => write!(
                f,
                "fixed point given up at {fallbacks} of {steps} steps, Newton's method for some after each ({factorizations} factorisations \
                 for {newton_iterations} iterations); last ratio of increments {ratio:.1e}"
            ),
            Choice::Newton => write!(
                f,
                "Newton's method throughout: {factorizations} factorisations for {newton_iterations} iterations"
            ),
            Choice::Product => write!(
                f,
                "a linear model: {products} of {steps} steps by one product with its matrix"
            ),
        }
    }
}

#[cfg(all(test, feature = "alloc"))]
mod tests {
    use super::*;
    use alloc::string::ToString;

    #[test]
    fn the_reason_names_what_was_measured() {
        let mut statistics = Statistics {
            steps: 10,
            fixed_point_iterations: 40,
            contraction: Contraction::of(0.0123),
            ..Statistics::NONE
        };
        let told = statistics.reason().to_string();
        assert!(told.contains("1.2e-2"), "{told}");
        (statistics.newton_iterations, statistics.fallbacks) = (5, 1);
        assert_eq!(statistics.choice(), Choice::Both);
        assert!(statistics.reason().to_string().contains("1 of 10 steps"));
        assert!((Contraction::of(f64::NAN).ratio() - 1.0).abs() < 1e-12);
        assert!((Contraction::of(f64::INFINITY).ratio() - 1e3).abs() < 1e-12);
    }
}
