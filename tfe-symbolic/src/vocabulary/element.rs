//! The elements that solvers are specialised for: families and rules of quadrature.

use std::fmt;

/// The kinds of element.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Family {
    /// Displacement form.
    Primal,
    /// Two-field form.
    Mixed,
    /// Three-field form.
    ThreeField,
    /// Continuous trial, discontinuous test functions.
    EnergyConserving,
    /// One-sided jump.
    Radau,
}

impl Family {
    /// All of them.
    pub const ALL: [Self; 5] = [
        Self::Primal,
        Self::Mixed,
        Self::ThreeField,
        Self::EnergyConserving,
        Self::Radau,
    ];

    /// The name in `solver(Name, Mixed::<4>)`, and of the type of the runtime.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Primal => "Primal",
            Self::Mixed => "Mixed",
            Self::ThreeField => "ThreeField",
            Self::EnergyConserving => "EnergyConserving",
            Self::Radau => "Radau",
        }
    }

    /// The name of the runtime's function that makes it.
    pub const fn constructor(self) -> &'static str {
        match self {
            Self::Primal => "primal",
            Self::Mixed => "mixed",
            Self::ThreeField => "three_field",
            Self::EnergyConserving => "energy_conserving",
            Self::Radau => "radau",
        }
    }

    /// The one of that name.
    pub(crate) fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|family| family.name() == name)
    }

    /// Whether it holds more with one Gauss point less than nodes.
    pub(crate) const fn is_by_displacements(self) -> bool {
        matches!(self, Self::Primal | Self::ThreeField)
    }
}

/// The names of all.
pub const ELEMENTS: [&str; Family::ALL.len()] = {
    let mut names = [""; Family::ALL.len()];
    let mut k = 0;
    while k < names.len() {
        names[k] = Family::ALL[k].name();
        k += 1;
    }
    names
};

/// The rules of quadrature.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Rule {
    /// The rule that the element comes with.
    Default,
    /// One Gauss point less than nodes.
    Reduced,
    /// Lobatto points at the nodes.
    Lobatto,
    /// So many Gauss points.
    Gauss(u32),
}

/// An element: family, nodes, rule.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Element {
    /// The kind of element.
    pub family: Family,
    /// The number of nodes, 2 to 12.
    pub nodes: u32,
    /// The rule of quadrature.
    pub rule: Rule,
}

impl Element {
    fn is_reduced(&self) -> bool {
        match self.rule {
            Rule::Default | Rule::Lobatto => false,
            Rule::Reduced => true,
            Rule::Gauss(points) => points + 1 == self.nodes,
        }
    }

    /// Whether it holds constraints, of velocities too if there are such.
    pub(crate) fn holds(&self, of_velocities: bool) -> bool {
        let is_reduced = self.is_reduced();
        match self.family {
            Family::Mixed => is_reduced || self.rule == Rule::Default,
            Family::ThreeField => is_reduced || self.rule == Rule::Default || !of_velocities,
            Family::Primal => is_reduced || !of_velocities,
            Family::EnergyConserving | Family::Radau => false,
        }
    }

    /// Whether velocities are unknowns of it. The momentum of the time has none: a Hamiltonian with a time transformation is linear in it.
    pub(crate) fn needs_velocities(&self) -> bool {
        match self.family {
            Family::ThreeField => true,
            Family::Primal => !self.is_reduced(),
            Family::Mixed | Family::EnergyConserving | Family::Radau => false,
        }
    }
}

/// As it is written in Rust.
impl fmt::Display for Element {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}::<{}>", self.family.name(), self.nodes)?;
        match self.rule {
            Rule::Default => Ok(()),
            Rule::Reduced => f.write_str(".reduced()"),
            Rule::Lobatto => f.write_str(".lobatto()"),
            Rule::Gauss(points) => write!(f, ".quadrature({points})"),
        }
    }
}
