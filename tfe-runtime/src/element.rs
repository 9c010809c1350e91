//! The elements: family, number of nodes, quadrature rule.

use core::fmt;

use crate::basis::MAX_NODES;
use crate::quadrature::{MAX_POINTS, Quadrature};

/// The spaces on which an element is built; s = nodes − 1.
///
/// | family | trial | test | boundary jumps |
/// |---|---|---|---|
/// | `Primal` | q of degree s, v = dq/dt | the same | p on both sides |
/// | `Mixed` | (p, q) of degree s − 1 | degree s, continuous | both sides |
/// | `ThreeField` | q of degree s, v and p of degree s − 1 | the same | p on both sides |
/// | `EnergyConserving` | (p, q) of degree s, continuous | degree s − 1 | none |
/// | `Radau` | (p, q) of degree s − 1 | degree s − 1 | left side |
///
/// `docs/theory.md` §6 puts them into one frame, (T-31), and §7 has the table of their properties.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Family {
    /// Displacement form: Hamilton's law of varying action (T-4), the paper's (9).
    Primal,
    /// Two-field form (T-5), the paper's (10).
    Mixed,
    /// Three-field form (T-3), the paper's (6): coordinates, velocities and momenta are unknowns of their own.
    ThreeField,
    /// Two-field form with trial and test spaces exchanged.
    EnergyConserving,
    /// Two-field form with a jump on the left side only.
    Radau,
}

/// The trial and test spaces of a two-field family, and its boundary jumps.
pub(crate) struct Spaces {
    /// Number of trial polynomials.
    pub(crate) trials: usize,
    /// Number of test polynomials.
    pub(crate) tests: usize,
    pub(crate) left_jump: bool,
    pub(crate) right_jump: bool,
}

impl Family {
    /// Whether the unknowns are coordinates of degree s and their derivatives.
    pub(crate) const fn is_by_displacements(self) -> bool {
        matches!(self, Self::Primal | Self::ThreeField)
    }

    /// Whether energy that the model conserves may be lost.
    pub(crate) const fn damps(self) -> bool {
        matches!(self, Self::Radau)
    }

    /// The spaces of degree s.
    pub(crate) const fn spaces(self, s: usize) -> Spaces {
        let (trials, tests, left_jump, right_jump) = match self {
            Self::Mixed => (s, s + 1, true, true),
            Self::Radau => (s, s, true, false),
            // A primal element is not a two-field form; only its q is continuous in this way.
            Self::EnergyConserving | Self::Primal | Self::ThreeField => (s + 1, s, false, false),
        };
        Spaces {
            trials,
            tests,
            left_jump,
            right_jump,
        }
    }

    /// The name of the marker type.
    const fn name(self) -> &'static str {
        match self {
            Self::Primal => "Primal",
            Self::Mixed => "Mixed",
            Self::ThreeField => "ThreeField",
            Self::EnergyConserving => "EnergyConserving",
            Self::Radau => "Radau",
        }
    }
}

/// The quadrature rule: the points of an element at which the model is evaluated, and their weights.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Rule {
    /// The rule that suits the family: `Primal` n Gauss points, `Mixed` and `ThreeField` n − 1 Gauss points,
    /// `EnergyConserving` 2n Gauss points, `Radau` n − 1 right Radau points.
    Default,
    /// This many Gauss points.
    Gauss(usize),
    /// This many Lobatto points, the ends included.
    Lobatto(usize),
}

/// A finite element in time: family, number of nodes, quadrature rule.
///
/// Any combination can be constructed; [`validate`](Self::validate) tells whether it is a valid element.
///
/// # Example
/// ```
/// use tfe_runtime::{Element, Mixed};
///
/// let element = Element::mixed(4);
/// assert_eq!(element, Mixed::<4>.into());
/// assert_eq!(element.order(), 6);
/// assert_eq!(element.quadrature(5).to_string(), "Mixed::<4>.quadrature(5)");
/// assert!(Element::mixed(1).validate().is_err());
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Element {
    family: Family,
    nodes: usize,
    rule: Rule,
}

impl Element {
    /// The fewest nodes.
    pub const MIN_NODES: usize = 2;
    /// The most nodes.
    pub const MAX_NODES: usize = MAX_NODES;

    /// An element with the default rule of its family.
    #[must_use]
    pub const fn new(family: Family, nodes: usize) -> Self {
        Self {
            family,
            nodes,
            rule: Rule::Default,
        }
    }

    /// Displacement form (theory.md (T-4), the paper's (9)) with n Gauss points; see [`Primal`](markers::Primal).
    #[must_use]
    pub const fn primal(nodes: usize) -> Self {
        Self::new(Family::Primal, nodes)
    }

    /// Two-field form (theory.md (T-5), the paper's (10)); with n − 1 Gauss points, the default, it is Gauss
    /// collocation. See [`Mixed`](markers::Mixed).
    #[must_use]
    pub const fn mixed(nodes: usize) -> Self {
        Self::new(Family::Mixed, nodes)
    }

    /// Three-field form, the counterpart of Hu and Washizu's in statics (theory.md (T-3), the paper's (6)).
    ///
    /// The velocities are unknowns whether the model is declared by a Lagrangian or by a Hamiltonian, and no mass
    /// matrix is inverted, so that it may be singular where constraints determine the motion. With n − 1 Gauss points
    /// (the default) the element is equivalent to the mixed form where the Legendre transform exists; with any rule it
    /// is equivalent to the primal form with that rule, because the velocity that it finds is the rate of the
    /// coordinates.
    #[must_use]
    pub const fn three_field(nodes: usize) -> Self {
        Self::new(Family::ThreeField, nodes)
    }

    /// Continuous trial and discontinuous test functions: conserves the energy as far as the rule integrates it exactly
    /// (theory.md (T-52)); see [`EnergyConserving`](markers::EnergyConserving).
    #[must_use]
    pub const fn energy_conserving(nodes: usize) -> Self {
        Self::new(Family::EnergyConserving, nodes)
    }

    /// One-sided jump, Radau IIA: L-stable, dissipative; see [`Radau`](markers::Radau).
    #[must_use]
    pub const fn radau(nodes: usize) -> Self {
        Self::new(Family::Radau, nodes)
    }

    /// The same with n − 1 Gauss points (reduced integration), by which a primal element becomes A-stable and the same
    /// map as the mixed one.
    #[must_use]
    pub const fn reduced(self) -> Self {
        self.quadrature(self.nodes.saturating_sub(1))
    }

    /// The same with n Lobatto points.
    #[must_use]
    pub const fn lobatto(self) -> Self {
        self.with_rule(Rule::Lobatto(self.nodes))
    }

    /// The same with this number of Gauss points.
    #[must_use]
    pub const fn quadrature(self, points: usize) -> Self {
        self.with_rule(Rule::Gauss(points))
    }

    /// The same with another rule.
    #[must_use]
    pub const fn with_rule(self, rule: Rule) -> Self {
        Self { rule, ..self }
    }

    /// The family.
    #[must_use]
    pub const fn family(&self) -> Family {
        self.family
    }

    /// The number of nodes n.
    #[must_use]
    pub const fn nodes(&self) -> usize {
        self.nodes
    }

    /// The rule as it was requested.
    #[must_use]
    pub const fn rule(&self) -> Rule {
        self.rule
    }

    /// s = n − 1.
    #[must_use]
    pub const fn degree(&self) -> usize {
        self.nodes.saturating_sub(1)
    }

    /// The number of points at which the model is evaluated.
    #[must_use]
    pub const fn points(&self) -> usize {
        match (self.rule, self.family) {
            (Rule::Gauss(points) | Rule::Lobatto(points), _) => points,
            (Rule::Default, Family::Primal) => self.nodes,
            (Rule::Default, Family::Mixed | Family::ThreeField | Family::Radau) => self.degree(),
            (Rule::Default, Family::EnergyConserving) => self.nodes.saturating_mul(2),
        }
    }

    /// The number of unknown rates for each coordinate: one for each point, or n − 1 for a primal element.
    #[must_use]
    pub const fn unknowns(&self) -> usize {
        if self.family.is_by_displacements() {
            self.degree()
        } else {
            self.points()
        }
    }

    /// Whether the element is a Runge–Kutta method with its points as stages.
    ///
    /// True for all elements except primal and three-field ones with a rule other than n − 1 Gauss points.
    #[must_use]
    pub const fn is_collocated(&self) -> bool {
        match (self.family, self.rule) {
            (Family::Primal | Family::ThreeField, Rule::Gauss(points)) => points == self.degree(),
            (Family::Primal, _) | (Family::ThreeField, Rule::Lobatto(_)) => false,
            _ => true,
        }
    }

    /// Whether the element is A-stable: the solution of a linear model with constant coefficients whose exact solution
    /// does not grow does not grow at any step.
    ///
    /// Mixed and energy-conserving elements integrate such models exactly with every rule that they accept, and then
    /// are the diagonal Padé approximant (T-53), and so are reduced primal elements. Radau elements are the subdiagonal
    /// one of degrees (s − 1, s), with s Lobatto points that of degrees (s − 2, s). All of these map the left half
    /// plane of λh into the unit disk. Only primal elements with other rules do not.
    #[must_use]
    pub const fn is_a_stable(&self) -> bool {
        match (self.family, self.rule) {
            (Family::Mixed | Family::EnergyConserving | Family::Radau, _) => true,
            (Family::ThreeField, Rule::Default) => true,
            (Family::Primal | Family::ThreeField, Rule::Gauss(points)) => points == self.degree(),
            (Family::Primal, Rule::Default) | (_, Rule::Lobatto(_)) => false,
        }
    }

    /// Whether the element can be used with constraints (T-75), of positions or of velocities: the spaces of the
    /// multipliers have to match the trial functions.
    pub(crate) const fn holds(&self, are_holonomic: bool) -> bool {
        let gauss = match self.rule {
            Rule::Default => matches!(self.family, Family::Mixed | Family::ThreeField),
            Rule::Gauss(points) => points == self.degree(),
            Rule::Lobatto(_) => false,
        };
        match self.family {
            Family::Mixed => gauss,
            Family::Primal | Family::ThreeField => gauss || are_holonomic,
            Family::EnergyConserving | Family::Radau => false,
        }
    }

    /// Whether a Hamiltonian model is solved in phase space; otherwise its velocities are the unknowns.
    pub(crate) const fn has_phase_form(&self) -> bool {
        self.is_collocated() && !matches!(self.family, Family::ThreeField)
    }

    /// The nodes and weights of the rule.
    #[must_use]
    pub const fn quadrature_rule(&self) -> Quadrature {
        match (self.rule, self.family) {
            (Rule::Lobatto(points), _) => Quadrature::lobatto(points),
            (Rule::Default, Family::Radau) => Quadrature::radau(self.points()),
            _ => Quadrature::gauss(self.points()),
        }
    }

    /// The order of accuracy in the states at the nodes, for smooth models: their error is O(h^order). With n nodes and
    /// the default rule it is
    ///
    /// ```text
    /// 2(n − 1) ,     Radau: 2n − 3 ,
    /// ```
    ///
    /// and the order of the rule, its degree of exactness plus one, if that is lower.
    #[must_use]
    pub const fn order(&self) -> usize {
        let s = self.degree();
        let spaces = match self.family {
            Family::Radau => s.saturating_mul(2).saturating_sub(1),
            _ => s.saturating_mul(2),
        };
        // Order of the rule = its degree of exactness plus one.
        let rule = match (self.rule, self.family) {
            (Rule::Lobatto(points), _) => points.saturating_mul(2).saturating_sub(2),
            (Rule::Default, Family::Radau) => s.saturating_mul(2).saturating_sub(1),
            _ => self.points().saturating_mul(2),
        };
        if rule < spaces { rule } else { spaces }
    }

    /// Checks the number of nodes and of points.
    ///
    /// # Errors
    /// [`ElementError::Nodes`] unless 2 ≤ n ≤ 12; [`ElementError::Points`] if the rule has too few points to determine
    /// all unknowns, or more than 32.
    pub const fn validate(&self) -> Result<(), ElementError> {
        if self.nodes < Self::MIN_NODES || self.nodes > Self::MAX_NODES {
            return Err(ElementError::Nodes { element: *self });
        }
        let s = self.degree();
        let least = match (self.rule, self.family) {
            // A Lobatto rule of k points is exact to degree 2k − 3 only: it needs one point more, except for `Radau`,
            // whose test functions are of one degree less.
            (Rule::Lobatto(_), Family::Radau) => {
                if s < 2 {
                    2
                } else {
                    s
                }
            }
            (Rule::Lobatto(_), _) => s + 1,
            _ => s,
        };
        let points = self.points();
        if points < least || points > MAX_POINTS {
            return Err(ElementError::Points {
                element: *self,
                least,
            });
        }
        Ok(())
    }
}

impl fmt::Display for Element {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let family = self.family.name();
        write!(f, "{family}::<{}>", self.nodes)?;
        match self.rule {
            Rule::Default => Ok(()),
            Rule::Gauss(points) if points == self.degree() => f.write_str(".reduced()"),
            Rule::Gauss(points) => write!(f, ".quadrature({points})"),
            Rule::Lobatto(points) if points == self.nodes => f.write_str(".lobatto()"),
            Rule::Lobatto(points) => write!(f, ".with_rule(Rule::Lobatto({points}))"),
        }
    }
}

/// Why an [`Element`] is invalid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum ElementError {
    /// The number of nodes is not in 2..=12.
    Nodes {
        /// The element as it was requested.
        element: Element,
    },
    /// The rule has too few points for the spaces, or too many.
    Points {
        /// The element as it was requested.
        element: Element,
        /// The smallest sufficient number of points.
        least: usize,
    },
}

impl fmt::Display for ElementError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Nodes { element } => write!(
                f,
                "`{element}` has {} nodes, but an element must have {} to {}",
                element.nodes,
                Element::MIN_NODES,
                Element::MAX_NODES
            ),
            Self::Points { element, least } => write!(
                f,
                "the quadrature rule of `{element}` has {} points, but must have {least} to {MAX_POINTS}",
                element.points()
            ),
        }
    }
}

impl core::error::Error for ElementError {}

/// One unit struct for each family, with the number of nodes in the type: `Mixed::<4>`.
pub mod markers {
    use super::Element;

    macro_rules! markers {
        ($($(#[$doc:meta])* $name:ident, $constructor:ident;)*) => {$(
            $(#[$doc])*
            #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
            pub struct $name<const NODES: usize>;

            impl<const NODES: usize> $name<NODES> {
                /// The element as a value; a number of nodes outside 2..=12 does not compile.
                #[must_use]
                pub const fn element(self) -> Element {
                    const {
                        assert!(
                            NODES >= Element::MIN_NODES && NODES <= Element::MAX_NODES,
                            "an element has 2 to 12 nodes"
                        );
                    }
                    Element::$constructor(NODES)
                }

                /// The same with n − 1 Gauss points.
                #[must_use]
                pub const fn reduced(self) -> Element {
                    self.element().reduced()
                }

                /// The same with n Lobatto points.
                #[must_use]
                pub const fn lobatto(self) -> Element {
                    self.element().lobatto()
                }

                /// The same with this number of Gauss points.
                #[must_use]
                pub const fn quadrature(self, points: usize) -> Element {
                    self.element().quadrature(points)
                }
            }

            impl<const NODES: usize> From<$name<NODES>> for Element {
                fn from(marker: $name<NODES>) -> Self {
                    marker.element()
                }
            }
        )*};
    }

    markers! {
        /// Displacement form with n = `NODES` nodes and n Gauss points: Hamilton's law of varying action,
        ///
        /// ```text
        /// ∫ { L_v·δq̇ + (L_q + Q)·δq } dt = p₁·δq₁ − p₀·δq₀ ,   v = q̇                    (theory.md (T-4), the paper's (9))
        /// ```
        ///
        /// Order 2(n − 1), symplectic. Stable up to a limit of the step only, with unstable intervals below it (T-57);
        /// with [`reduced`](Self::reduced) quadrature it is A-stable and the same map as [`Mixed`].
        Primal, primal;
        /// Two-field form with n = `NODES` nodes and n − 1 Gauss points,
        ///
        /// ```text
        /// ∫ { p·δq̇ − q·δṗ − H_p·δp + (Q − H_q)·δq } dt = [ p·δq − q·δp ]₀¹              (theory.md (T-5), the paper's (10))
        /// ```
        ///
        /// Order 2(n − 1), symplectic, A-stable; conserves quadratic first integrals. It is the collocation method with
        /// n − 1 Gauss points.
        Mixed, mixed;
        /// Three-field form with n = `NODES` nodes and n − 1 Gauss points: coordinates, velocities and momenta are
        /// independent,
        ///
        /// ```text
        /// ∫ { p·δq̇ − q·δṗ + (L_q + Q)·δq − v·δp + (L_v − p)·δv } dt = [ p·δq − q·δp ]₀¹    (theory.md (T-3), the paper's (6))
        /// ```
        ///
        /// The same map as [`Mixed`] where the mass matrix L_vv is regular; it may be singular where constraints
        /// determine the motion. Order 2(n − 1), symplectic, A-stable.
        ThreeField, three_field;
        /// Two-field form with n = `NODES` nodes, continuous trial and discontinuous test functions, and 2n Gauss
        /// points.
        ///
        /// Order 2(n − 1), A-stable. The energy of an autonomous model changes by the work of the forces, up to the
        /// error of the quadrature (theory.md (T-52)): exactly if H is a polynomial of degree at most 4n/(n − 1).
        /// Symplectic for linear models only.
        EnergyConserving, energy_conserving;
        /// Two-field form with n = `NODES` nodes, a jump on the left side only, and n − 1 right Radau points: the Radau
        /// IIA method (theory.md §6.9).
        ///
        /// Order 2n − 3, A- and L-stable, not symplectic: it damps fast oscillations. For stiff damped models.
        Radau, radau;
    }
}

#[cfg(test)]
mod tests {
    use super::markers::*;
    use super::*;

    #[test]
    fn every_default_from_2_to_12_nodes_is_valid() {
        for nodes in 2..=12 {
            for element in [
                Element::primal(nodes),
                Element::mixed(nodes),
                Element::three_field(nodes),
                Element::energy_conserving(nodes),
                Element::radau(nodes),
            ] {
                for element in [element, element.reduced(), element.lobatto()] {
                    assert_eq!(element.validate(), Ok(()), "{element:?}");
                }
            }
        }
    }

    #[test]
    fn what_is_no_element_is_refused() {
        for nodes in [0, 1, 13, usize::MAX] {
            let element = Element::mixed(nodes);
            assert_eq!(element.validate(), Err(ElementError::Nodes { element }));
            assert!(element.reduced().lobatto().validate().is_err());
            let _ = (
                element.order(),
                element.reduced().order(),
                element.is_collocated(),
            );
        }
        for (element, least) in [
            (Element::mixed(4).quadrature(2), 3),
            (Element::primal(3).quadrature(33), 2),
            (Element::primal(3).with_rule(Rule::Lobatto(2)), 3),
            (Element::radau(2).with_rule(Rule::Lobatto(1)), 2),
        ] {
            assert_eq!(
                element.validate(),
                Err(ElementError::Points { element, least })
            );
        }
    }

    #[test]
    fn orders() {
        assert_eq!(Primal::<2>.reduced().order(), 2);
        assert_eq!(Primal::<4>.lobatto().order(), 6);
        assert_eq!(Mixed::<6>.element().order(), 10);
        assert_eq!(EnergyConserving::<3>.element().order(), 4);
        assert_eq!(Radau::<3>.element().order(), 3);
    }
}
