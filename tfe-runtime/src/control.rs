//! The choice of iteration, its tolerance, and the limit on the number of iterations.

/// How the equations of an element are solved: `docs/theory.md` §10.2 (fixed point) and §10.3 (Newton's method).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Solve {
    /// Fixed-point iteration while it contracts well, otherwise Newton's method; Newton's method from the start for
    /// linear models.
    #[default]
    Auto,
    /// Fixed-point iteration only: needs first derivatives only, but fails for stiff models.
    FixedPoint,
    /// Newton's method only.
    Newton,
    /// As [`Auto`](Self::Auto), but any converged iteration is accepted. With the other choices, Newton's method must
    /// contract from its first iteration on, so that the root lies near the initial guess; a step in which it does not
    /// is cut (`docs/theory.md` §10.6).
    Trusting,
}

impl Solve {
    /// Whether steps that fail are divided into shorter ones.
    pub(crate) fn cuts(self) -> bool {
        matches!(self, Self::Auto | Self::Newton)
    }

    /// With `all`, the choice that accepts any converged iteration, if the method is chosen automatically.
    #[cfg(feature = "alloc")]
    pub(crate) fn trusting(self, all: bool) -> Self {
        match (self, all) {
            (Self::Auto, true) => Self::Trusting,
            (solve, _) => solve,
        }
    }
}

/// How the equations of an element are solved: tolerance, limit of iterations, and kind of iteration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Control {
    /// The error that may remain, relative to the largest coordinate, estimated from the last increments. With at most
    /// 10⁻¹⁴, as by default, it is also relative to the own size of a coordinate below a 1024th of the largest one, as
    /// an angle beside a distance of 10⁹ m; the elements of an array count as one coordinate. An iteration that has
    /// reached round-off is accepted in any case.
    pub tolerance: f64,
    /// The largest number of iterations for one element.
    pub max_iterations: u32,
    /// The kind of iteration.
    pub solve: Solve,
}

/// An upper bound of the tolerance for models with constraints: a larger violation would make the end of an element an
/// inadmissible start of the next one.
const MAX_WITH_CONSTRAINTS: f64 = 0.1 * START_TOLERANCE;

impl Control {
    pub(crate) fn with_constraints(self) -> Self {
        Self {
            tolerance: self.tolerance.min(MAX_WITH_CONSTRAINTS),
            ..self
        }
    }
}

/// Above this tolerance, the end of a step needs no more than working precision.
const ROUGH: f64 = 1e-14;

impl Control {
    pub(crate) fn is_rough(&self) -> bool {
        self.tolerance > ROUGH
    }
}

impl Control {
    pub(crate) const DEFAULT: Self = Self {
        // Well below one rounding error: the remainder of a fixed-point iteration has the same sign in one element
        // after the other and accumulates, whereas rounding errors do not.
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

/// Below this, relative to the coordinates, a correction of Newton's method is the rounding error of the constraints,
/// summed over the points of an element.
pub(crate) const POSITION_ROUND_OFF: f64 = 64.0 * f64::EPSILON;

/// Increments below this size are rounding errors of ill-conditioned equations, if they have not decreased for some
/// time.
pub(crate) const ROUGH_ROUND_OFF: f64 = 1e-10;

/// How much a start may violate the constraints, relative to the extent of the motion. The first element removes the
/// rest.
pub const START_TOLERANCE: f64 = 1e-8;
