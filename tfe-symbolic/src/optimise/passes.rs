//! The passes: what each reads and makes, the limits of its time, and what it leaves unchanged.

/// A pass of the optimiser. [`crate::derive::derivation::Derivation::without`] gives programs without one of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Pass {
    /// Derivatives of an energy quadratic in z by its matrix.
    QuadraticForm,
    /// Second derivatives on the diagonals of blocks as negative sums of those off them, for forces between pairs.
    Balance,
    /// Sums used once become part of the sum that uses them.
    OpenSums,
    /// Sines and cosines of sums from those of their parts.
    AngleSums,
    /// l sin θ and l cos θ as variables.
    ScaledTrig,
    /// a b + a c as a (b + c).
    CommonFactors,
    /// Results as sums and products of other results.
    Identities,
    /// Similar operations in the same form, so that compilers compute two by one instruction.
    CanonicalOrder,
    /// Differences reversed so that few results are negated.
    Signs,
    /// Statements ordered so that few values are live at a time.
    StatementOrder,
}

impl Pass {
    /// All of them, in the order in which they run.
    pub const ALL: [Self; 10] = [
        Self::QuadraticForm,
        Self::Balance,
        Self::OpenSums,
        Self::AngleSums,
        Self::ScaledTrig,
        Self::CommonFactors,
        Self::Identities,
        Self::CanonicalOrder,
        Self::Signs,
        Self::StatementOrder,
    ];

    /// What it reads and what it makes.
    pub const fn contract(self) -> &'static str {
        match self {
            Self::QuadraticForm => "derivatives to derivatives",
            Self::Balance => "derivatives to fewer derivatives and a rule for the others",
            Self::OpenSums | Self::AngleSums | Self::ScaledTrig | Self::CommonFactors => {
                "expressions to expressions"
            }
            Self::Identities | Self::CanonicalOrder | Self::Signs => "plan to plan",
            Self::StatementOrder => "statements to statements",
        }
    }

    /// What its time depends on, and where it stops.
    pub const fn limit(self) -> &'static str {
        match self {
            Self::QuadraticForm => "linear in the derivatives",
            Self::Balance | Self::OpenSums | Self::Signs => "linear",
            Self::AngleSums => "angles of up to 8 parts; 64 known angles tried for each",
            Self::ScaledTrig => "linear; drafts without loops up to a cost of 300",
            Self::CommonFactors => {
                "8 rounds over all sums, and 20 000 operations arranged in trials"
            }
            Self::Identities => "plans up to 130 operations, 240 altogether; 4 rounds of 32 trials",
            Self::CanonicalOrder => "near-linear; plans up to 1000 operations",
            Self::StatementOrder => "near-linear",
        }
    }

    /// What it leaves as it is.
    pub const fn keeps(self) -> &'static str {
        match self {
            Self::QuadraticForm => "entries that are no derivatives of the energy",
            Self::Balance => "all entries off the diagonal",
            Self::OpenSums => "sums whose exact terms may cancel",
            Self::AngleSums => "arguments that are no sums of angles with small whole coefficients",
            Self::ScaledTrig => "sines without a length beside each of them",
            Self::CommonFactors => "terms that something else uses",
            Self::Identities => "operations that something else needs",
            Self::CanonicalOrder | Self::Signs | Self::StatementOrder => "the number of operations",
        }
    }
}

/// The passes that run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Passes(u32);

impl Passes {
    /// All of them.
    pub(crate) const ALL: Self = Self(u32::MAX);

    /// All but one.
    pub(crate) const fn without(pass: Pass) -> Self {
        Self(!(1 << pass as u32))
    }

    /// Whether this one runs.
    pub(crate) const fn run(self, pass: Pass) -> bool {
        self.0 & (1 << pass as u32) != 0
    }
}
