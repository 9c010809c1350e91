//! What iterations are allowed, and what is asked of them.

/// How the equations of an element are solved.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Solve {
    /// Fixed point while it contracts well, else Newton; straight Newton for linear models.
    #[default]
    Auto,
    /// Fixed point only: first derivatives suffice, but a stiff model fails.
    FixedPoint,
    /// Newton only.
    Newton,
    /// As [`Auto`](Self::Auto), but whatever an iteration converges to is taken. Elsewhere Newton's method has to contract from its first iteration on, so that
    /// what it finds lies near where it began; a step in which it does not is cut (`docs/theory.md` §10.6).
    Trusting,
}

impl Solve {
    /// Whether steps that fail are cut.
    pub(crate) fn cuts(self) -> bool {
        matches!(self, Self::Auto | Self::Newton)
    }

    /// The same, which takes whatever an iteration converges to, if it is to choose.
    #[cfg(feature = "alloc")]
    pub(crate) fn trusting(self, all: bool) -> Self {
        match (self, all) {
            (Self::Auto, true) => Self::Trusting,
            (solve, _) => solve,
        }
    }
}

/// What the iterations are allowed, and what is asked of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Control {
    /// The error that may be left, relative to the state, judged by the last increments. An
    /// iteration that has reached round-off is accepted in any case.
    pub tolerance: f64,
    /// The most iterations of one element.
    pub max_iterations: u32,
    /// Which iteration.
    pub solve: Solve,
}

/// Iterations with constraints leave no more, whatever is asked for: what violates constraints by much is no start of the next element.
const MOST_WITH_CONSTRAINTS: f64 = 0.1 * START_TOLERANCE;

impl Control {
    pub(crate) fn with_constraints(self) -> Self {
        Self {
            tolerance: self.tolerance.min(MOST_WITH_CONSTRAINTS),
            ..self
        }
    }
}

/// Steps whose iteration may end above it need no more than the working precision.
const ROUGH: f64 = 1e-14;

impl Control {
    pub(crate) fn is_rough(&self) -> bool {
        self.tolerance > ROUGH
    }
}

impl Control {
    pub(crate) const DEFAULT: Self = Self {
        // Well below one rounding: what a fixed point leaves has the same sign in element after element and adds up, roundings do not.
        tolerance: 0.05 * f64::EPSILON,
        max_iterations: 100,
        solve: Solve::Auto,
    };
}

impl Default for Control {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// Where Newton's method moves coordinates by less than that, relative to them, it is the rounding of constraints, summed over the points of an element.
pub(crate) const POSITION_ROUND_OFF: f64 = 64.0 * f64::EPSILON;

/// How far a start may be off, relative to the extent of the motion. The first element takes the rest away.
pub const START_TOLERANCE: f64 = 1e-8;
