//! The leaves of expressions: what a kernel is given, and indices affine in loop variables.

use std::fmt;

/// Nesting depth of a loop: 0 is the outermost. Two sums at the same depth share the number, so equal sums are equal expressions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct LoopVariable(pub u32);

/// A name whose integer value is fixed for a model but not known to the macro.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum IndexSymbol {
    /// The index of a sum.
    Loop(LoopVariable),
    /// A const parameter of the struct.
    ConstParameter(String),
    /// A `usize` field of the struct.
    Field(String),
    /// An entry of a `Vec<usize>` field of the struct, by its place in the list.
    Entry(String, Affine),
    /// Zero. It keeps the index that it is added to inside this loop: where the loop has no turns, the index may be
    /// outside its array.
    Within(LoopVariable),
}

/// `constant + Σ coefficient · symbol`, sorted by symbol, without zero coefficients.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Affine {
    /// The constant part.
    pub constant: i64,
    /// The other parts.
    pub terms: Vec<(IndexSymbol, i64)>,
}

/// What a kernel is given.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Input {
    /// The time `t`.
    Time,
    /// A generalized coordinate, by its index in the flat vector `q`.
    Coordinate(Affine),
    /// Its velocity (models declared by a Lagrangian).
    Velocity(Affine),
    /// Its momentum (models declared by a Hamiltonian).
    Momentum(Affine),
    /// The multiplier of the constraint of this number.
    Multiplier(Affine),
    /// A placeholder for an expression while others are made, with a number and an index; it never appears in kernels.
    Placeholder(u32, Affine),
    /// An input, given at run time: it may change with the time, and nothing else is known about it.
    Control(String),
    /// A scalar field of the struct.
    Parameter(String),
    /// An element of an array field of the struct.
    ParameterElement(String, Affine),
    /// An integer as a number: a loop index, a length.
    Integer(Affine),
}

impl Affine {
    /// The constant `value`.
    pub fn constant(value: i64) -> Self {
        Self {
            constant: value,
            terms: Vec::new(),
        }
    }

    /// The symbol itself.
    pub fn symbol(symbol: IndexSymbol) -> Self {
        Self {
            constant: 0,
            terms: vec![(symbol, 1)],
        }
    }

    /// Its value where it holds no symbol.
    pub fn as_constant(&self) -> Option<i64> {
        self.terms.is_empty().then_some(self.constant)
    }

    /// `self + factor · other`, or `None` on overflow.
    pub fn plus_scaled(&self, other: &Self, factor: i64) -> Option<Self> {
        let mut sum = self.clone();
        sum.constant = sum
            .constant
            .checked_add(other.constant.checked_mul(factor)?)?;
        for (symbol, coefficient) in &other.terms {
            let added = coefficient.checked_mul(factor)?;
            match sum.terms.binary_search_by(|(s, _)| s.cmp(symbol)) {
                Ok(at) => sum.terms[at].1 = sum.terms[at].1.checked_add(added)?,
                Err(at) => sum.terms.insert(at, (symbol.clone(), added)),
            }
        }
        sum.terms.retain(|(_, coefficient)| *coefficient != 0);
        Some(sum)
    }

    /// The same without what keeps it inside loops.
    #[must_use]
    pub fn plain(&self) -> Self {
        let mut plain = self.clone();
        plain
            .terms
            .retain(|(symbol, _)| !matches!(symbol, IndexSymbol::Within(_)));
        plain
    }

    /// Whether it depends on a field of the struct, so that it is known at run time only.
    pub fn is_of_run_time(&self) -> bool {
        let field = |(symbol, _): &(IndexSymbol, i64)| matches!(symbol, IndexSymbol::Field(_));
        self.terms.iter().any(field)
    }

    /// The entries of lists in it: list and place.
    pub fn entries(&self) -> impl Iterator<Item = (&str, &Self)> {
        self.terms.iter().filter_map(|(symbol, _)| match symbol {
            IndexSymbol::Entry(list, place) => Some((list.as_str(), place)),
            _ => None,
        })
    }

    /// Whether it contains an entry of a list: then nothing is known about how it changes from turn to turn.
    pub fn holds_entry(&self) -> bool {
        self.entries().next().is_some()
    }

    /// All loop variables in it, those in places of lists and those of loops that it is kept in, too.
    pub(crate) fn variables(&self) -> Vec<LoopVariable> {
        let own = |(symbol, _): &(IndexSymbol, i64)| match symbol {
            IndexSymbol::Loop(variable) | IndexSymbol::Within(variable) => vec![*variable],
            IndexSymbol::Entry(_, place) => place.variables(),
            IndexSymbol::ConstParameter(_) | IndexSymbol::Field(_) => Vec::new(),
        };
        self.terms.iter().flat_map(own).collect()
    }

    /// The coefficient of the loop variable outside lists.
    pub(crate) fn factor_of(&self, variable: LoopVariable) -> i64 {
        let own = self
            .terms
            .iter()
            .find(|(symbol, _)| *symbol == IndexSymbol::Loop(variable));
        own.map_or(0, |(_, factor)| *factor)
    }

    /// Whether it depends on the loop variable, or is kept inside its loop.
    pub fn depends_on(&self, variable: LoopVariable) -> bool {
        self.terms.iter().any(|(symbol, _)| match symbol {
            IndexSymbol::Loop(own) | IndexSymbol::Within(own) => *own == variable,
            IndexSymbol::Entry(_, place) => place.depends_on(variable),
            IndexSymbol::ConstParameter(_) | IndexSymbol::Field(_) => false,
        })
    }
}

impl fmt::Display for LoopVariable {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            depth @ 0..=7 => write!(
                f,
                "{}",
                ["i", "j", "k", "l", "i4", "i5", "i6", "i7"][depth as usize]
            ),
            depth => write!(f, "i{depth}"),
        }
    }
}

impl fmt::Display for IndexSymbol {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Loop(variable) => variable.fmt(f),
            Self::ConstParameter(name) | Self::Field(name) => f.write_str(name),
            Self::Entry(list, place) => write!(f, "{list}[{place}]"),
            Self::Within(_) => f.write_str("0"),
        }
    }
}

impl fmt::Display for Affine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut first = true;
        let is_shown =
            |(symbol, _): &&(IndexSymbol, i64)| !matches!(symbol, IndexSymbol::Within(_));
        for (symbol, coefficient) in self.terms.iter().filter(is_shown) {
            let sign = if *coefficient < 0 {
                "-"
            } else if first {
                ""
            } else {
                "+"
            };
            match coefficient.unsigned_abs() {
                1 => write!(f, "{sign}{symbol}")?,
                size => write!(f, "{sign}{size}*{symbol}")?,
            }
            first = false;
        }
        match self.constant {
            0 if !first => Ok(()),
            value if first => write!(f, "{value}"),
            value => write!(f, "{value:+}"),
        }
    }
}

impl fmt::Display for Input {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Time => f.write_str("t"),
            Self::Coordinate(index) => write!(f, "q[{index}]"),
            Self::Velocity(index) => write!(f, "v[{index}]"),
            Self::Momentum(index) => write!(f, "p[{index}]"),
            Self::Multiplier(number) => write!(f, "mu[{number}]"),
            Self::Placeholder(number, index) => write!(f, "placeholder {number}[{index}]"),
            Self::Control(name) | Self::Parameter(name) => f.write_str(name),
            Self::ParameterElement(name, index) => write!(f, "{name}[{index}]"),
            Self::Integer(value) => write!(f, "({value})"),
        }
    }
}
