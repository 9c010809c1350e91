//! The tables of an element: one set of matrices behind all families.
//!
//! With nodes c_l and weights b_l of the rule, every element is, in velocity form,
//!
//! ```text
//! v_l = Σ_j E_lj ν_j ,     q_l = q₀ + h Σ_j C_lj ν_j ,
//! Σ_l P_il L_v,l − p₀ − h Σ_l G_il (L_q + Q)_l = 0 ,
//! q₁ = q₀ + h Σ_j β_j ν_j ,     p₁ = p₀ + h Σ_l b_l (L_q + Q)_l .
//! ```
//!
//! **Two-field families** are Runge–Kutta methods: E and P are unit matrices, C = G is the tableau,
//! β = b. The tableau comes from the weak form itself, for all φ of the test space
//!
//! ```text
//! ∫ y φ' dτ + h Σ_l b_l f_l φ(c_l) = ŷ₁ φ(1) − ŷ₀ φ(0) ,
//! ```
//!
//! where a side with a jump has ŷ = the value at the node, one without has ŷ = the trace of y.
//! **Primal elements** have ν on the s Gauss points with the Lagrange basis ψ_j of degree s − 1:
//! E_lj = ψ_j(c_l), C_lj = ∫₀^{c_l} ψ_j, β_j = ∫₀¹ ψ_j; testing with δq' = −ψ_i/β_i, δq(1) = 0 gives
//! P_il = b_l E_li/β_i and G_il = b_l (1 − C_li/β_i) (`docs/theory.md` §6.4).
//!
//! Everything is computed in twice the working precision and rounded once; where sums over many
//! steps feel the rounding (C, G, β, b), what it took is kept as a correction.

use crate::basis::MAX_NODES;
use crate::element::Element;
#[cfg(feature = "alloc")]
use crate::element::ElementError;
use crate::tableau::Target;

pub use crate::basis::MAX_RATES;

/// Borrowed tables of an element with K points and U unknown rates; matrices are flat, row by row.
#[derive(Clone, Copy, Debug)]
pub struct SchemeRef<'a> {
    /// The element to which the tables belong.
    pub element: Element,
    /// E = P = 1 and C = G: a Runge–Kutta method with its points as stages.
    pub collocated: bool,
    /// c_l: the points at which the model is evaluated; K.
    pub nodes: &'a [f64],
    /// b_l; K.
    pub weights: &'a [f64],
    /// The rounding error of b; K.
    pub weights_low: &'a [f64],
    /// The places of the unknown rates; U.
    pub unknown_nodes: &'a [f64],
    /// E_lj: from unknown rates to velocities; K × U.
    pub velocity: &'a [f64],
    /// C_lj: from unknown rates to coordinates; K × U.
    pub position: &'a [f64],
    /// The rounding error of C; K × U.
    pub position_low: &'a [f64],
    /// P_il: from momenta to rows; U × K.
    pub momentum: &'a [f64],
    /// G_il: from forces to rows; U × K.
    pub force: &'a [f64],
    /// The rounding error of G; U × K.
    pub force_low: &'a [f64],
    /// β_j: from unknown rates to the coordinates at the end; U.
    pub advance: &'a [f64],
    /// The rounding error of β; U.
    pub advance_low: &'a [f64],
    /// Legendre coefficients of ω_i(τ), the weight of an impulse at τ in row i; U × 12.
    pub impulse: &'a [f64],
    /// From unknown rates to the Legendre coefficients of dq/dτ / h; (n − 1) × U.
    pub rate: &'a [f64],
    /// From forces to the Legendre coefficients of dp/dτ / h; (n − 1) × K.
    pub force_rate: &'a [f64],
}

impl SchemeRef<'_> {
    /// Whether there are points at the ends of the element.
    #[cfg(feature = "alloc")]
    #[must_use]
    pub(crate) fn has_ends(&self) -> bool {
        self.nodes.first() == Some(&0.0) || self.nodes.last() == Some(&1.0)
    }

    /// The number K of points at which the model is evaluated.
    #[inline]
    #[must_use]
    pub fn points(&self) -> usize {
        self.nodes.len()
    }

    /// The number U of unknown rates of each coordinate.
    #[inline]
    #[must_use]
    pub fn unknowns(&self) -> usize {
        self.unknown_nodes.len()
    }

    /// The number s = n − 1 of coefficients of a rate.
    #[inline]
    #[must_use]
    pub fn rates(&self) -> usize {
        self.element.degree()
    }

    /// ω_i(τ): the weight of an impulse at τ in row i; in the momentum at the end its weight is one.
    #[must_use]
    pub fn impulse_weight(&self, row: usize, tau: f64) -> f64 {
        let mut values = [0.0; MAX_NODES];
        crate::basis::legendre(tau, &mut values);
        let row = &self.impulse[row * MAX_NODES..(row + 1) * MAX_NODES];
        row.iter()
            .zip(&values)
            .map(|(coefficient, value)| coefficient * value)
            .sum()
    }
}

/// A type that holds the tables of an element.
///
/// Algorithms are generic over it, so that for a [`Scheme`] every length is a constant.
pub trait Tables {
    /// The tables.
    fn view(&self) -> SchemeRef<'_>;

    /// The element.
    #[inline(always)]
    fn element(&self) -> Element {
        self.view().element
    }
}

impl Tables for SchemeRef<'_> {
    #[inline(always)]
    fn view(&self) -> SchemeRef<'_> {
        *self
    }
}

impl<T: Tables> Tables for &T {
    #[inline(always)]
    fn view(&self) -> SchemeRef<'_> {
        (*self).view()
    }
}

/// Tables of an element with K points and U unknown rates, as a constant.
///
/// # Example
/// ```
/// use tfe_runtime::scheme::Scheme;
/// use tfe_runtime::{Element, Mixed};
///
/// const ELEMENT: Element = Mixed::<3>.element();
/// const TABLES: Scheme<{ ELEMENT.points() }, { ELEMENT.unknowns() }> = Scheme::new(ELEMENT);
/// # use tfe_runtime::scheme::Tables;
/// assert_eq!(TABLES.view().weights, [0.5, 0.5]);
/// ```
#[derive(Clone, Debug)]
pub struct Scheme<const K: usize, const U: usize> {
    element: Element,
    nodes: [f64; K],
    weights: [f64; K],
    weights_low: [f64; K],
    unknown_nodes: [f64; U],
    velocity: [[f64; U]; K],
    position: [[f64; U]; K],
    position_low: [[f64; U]; K],
    momentum: [[f64; K]; U],
    force: [[f64; K]; U],
    force_low: [[f64; K]; U],
    advance: [f64; U],
    advance_low: [f64; U],
    impulse: [[f64; MAX_NODES]; U],
    rate: [[f64; U]; MAX_RATES],
    force_rate: [[f64; K]; MAX_RATES],
}

impl<const K: usize, const U: usize> Scheme<K, U> {
    /// The tables of `element`.
    ///
    /// # Panics
    /// If the element is not valid or K and U are not its [`points`](Element::points) and
    /// [`unknowns`](Element::unknowns); in a constant, that is an error of compilation.
    #[must_use]
    pub const fn new(element: Element) -> Self {
        assert!(element.validate().is_ok(), "not an element");
        assert!(
            K == element.points() && U == element.unknowns(),
            "sizes are not the element's"
        );
        let mut scheme = Self {
            element,
            nodes: [0.0; K],
            weights: [0.0; K],
            weights_low: [0.0; K],
            unknown_nodes: [0.0; U],
            velocity: [[0.0; U]; K],
            position: [[0.0; U]; K],
            position_low: [[0.0; U]; K],
            momentum: [[0.0; K]; U],
            force: [[0.0; K]; U],
            force_low: [[0.0; K]; U],
            advance: [0.0; U],
            advance_low: [0.0; U],
            impulse: [[0.0; MAX_NODES]; U],
            rate: [[0.0; U]; MAX_RATES],
            force_rate: [[0.0; K]; MAX_RATES],
        };
        let mut target = Target {
            nodes: &mut scheme.nodes,
            weights: &mut scheme.weights,
            weights_low: &mut scheme.weights_low,
            unknown_nodes: &mut scheme.unknown_nodes,
            velocity: scheme.velocity.as_flattened_mut(),
            position: scheme.position.as_flattened_mut(),
            position_low: scheme.position_low.as_flattened_mut(),
            momentum: scheme.momentum.as_flattened_mut(),
            force: scheme.force.as_flattened_mut(),
            force_low: scheme.force_low.as_flattened_mut(),
            advance: &mut scheme.advance,
            advance_low: &mut scheme.advance_low,
            impulse: scheme.impulse.as_flattened_mut(),
            rate: scheme.rate.as_flattened_mut(),
            force_rate: scheme.force_rate.as_flattened_mut(),
        };
        target.fill(element);
        scheme
    }

    /// The same as [`view`](Tables::view), in constants.
    #[inline(always)]
    pub(crate) const fn as_view(&self) -> SchemeRef<'_> {
        SchemeRef {
            element: self.element,
            collocated: self.element.is_collocated(),
            nodes: &self.nodes,
            weights: &self.weights,
            weights_low: &self.weights_low,
            unknown_nodes: &self.unknown_nodes,
            velocity: self.velocity.as_flattened(),
            position: self.position.as_flattened(),
            position_low: self.position_low.as_flattened(),
            momentum: self.momentum.as_flattened(),
            force: self.force.as_flattened(),
            force_low: self.force_low.as_flattened(),
            advance: &self.advance,
            advance_low: &self.advance_low,
            impulse: self.impulse.as_flattened(),
            rate: self.rate.as_flattened(),
            force_rate: self.force_rate.as_flattened(),
        }
    }
}

impl<const K: usize, const U: usize> Tables for Scheme<K, U> {
    #[inline(always)]
    fn view(&self) -> SchemeRef<'_> {
        self.as_view()
    }
}

/// Tables of an element chosen at run time; clones share them.
///
/// With the feature `std`, the tables of an element are computed once in a program: the double-double arithmetic costs
/// as much as a hundred steps.
#[cfg(feature = "alloc")]
#[derive(Clone, Debug)]
pub struct SchemeTable {
    element: Element,
    parts: alloc::sync::Arc<Parts>,
}

/// The numbers of all tables, each in a slice of its own, so that the parts of a view that are not used cost nothing.
#[cfg(feature = "alloc")]
#[derive(Debug)]
struct Parts {
    nodes: Numbers,
    weights: Numbers,
    weights_low: Numbers,
    unknown_nodes: Numbers,
    velocity: Numbers,
    position: Numbers,
    position_low: Numbers,
    momentum: Numbers,
    force: Numbers,
    force_low: Numbers,
    advance: Numbers,
    advance_low: Numbers,
    impulse: Numbers,
    rate: Numbers,
    force_rate: Numbers,
}

#[cfg(feature = "alloc")]
type Numbers = alloc::boxed::Box<[f64]>;

/// The tables computed so far. There are a few hundred different elements in all.
#[cfg(feature = "std")]
static KNOWN: std::sync::Mutex<std::vec::Vec<SchemeTable>> =
    std::sync::Mutex::new(std::vec::Vec::new());

#[cfg(feature = "alloc")]
impl SchemeTable {
    /// The tables of `element`.
    ///
    /// # Errors
    /// [`ElementError`] if the element is not valid.
    pub fn new(element: Element) -> Result<Self, ElementError> {
        element.validate()?;
        #[cfg(feature = "std")]
        {
            // The list is valid even if another thread has panicked.
            let mut known = KNOWN
                .lock()
                .unwrap_or_else(std::sync::PoisonError::into_inner);
            if let Some(table) = known.iter().find(|table| table.element == element) {
                return Ok(table.clone());
            }
            let table = Self::computed(element);
            known.push(table.clone());
            Ok(table)
        }
        #[cfg(not(feature = "std"))]
        Ok(Self::computed(element))
    }

    /// The tables of a valid element.
    fn computed(element: Element) -> Self {
        let (k, u, s) = (element.points(), element.unknowns(), element.degree());
        let zeros = |length| -> Numbers { alloc::vec![0.0; length].into_boxed_slice() };
        let mut parts = Parts {
            nodes: zeros(k),
            weights: zeros(k),
            weights_low: zeros(k),
            unknown_nodes: zeros(u),
            velocity: zeros(k * u),
            position: zeros(k * u),
            position_low: zeros(k * u),
            momentum: zeros(u * k),
            force: zeros(u * k),
            force_low: zeros(u * k),
            advance: zeros(u),
            advance_low: zeros(u),
            impulse: zeros(u * MAX_NODES),
            rate: zeros(s * u),
            force_rate: zeros(s * k),
        };
        let mut target = Target {
            nodes: &mut parts.nodes,
            weights: &mut parts.weights,
            weights_low: &mut parts.weights_low,
            unknown_nodes: &mut parts.unknown_nodes,
            velocity: &mut parts.velocity,
            position: &mut parts.position,
            position_low: &mut parts.position_low,
            momentum: &mut parts.momentum,
            force: &mut parts.force,
            force_low: &mut parts.force_low,
            advance: &mut parts.advance,
            advance_low: &mut parts.advance_low,
            impulse: &mut parts.impulse,
            rate: &mut parts.rate,
            force_rate: &mut parts.force_rate,
        };
        target.fill(element);
        Self {
            element,
            parts: alloc::sync::Arc::new(parts),
        }
    }
}

#[cfg(feature = "alloc")]
impl Tables for SchemeTable {
    #[inline]
    fn element(&self) -> Element {
        self.element
    }

    #[inline]
    fn view(&self) -> SchemeRef<'_> {
        let element = self.element;
        let parts = &*self.parts;
        SchemeRef {
            element,
            collocated: element.is_collocated(),
            nodes: &parts.nodes,
            weights: &parts.weights,
            weights_low: &parts.weights_low,
            unknown_nodes: &parts.unknown_nodes,
            velocity: &parts.velocity,
            position: &parts.position,
            position_low: &parts.position_low,
            momentum: &parts.momentum,
            force: &parts.force,
            force_low: &parts.force_low,
            advance: &parts.advance,
            advance_low: &parts.advance_low,
            impulse: &parts.impulse,
            rate: &parts.rate,
            force_rate: &parts.force_rate,
        }
    }
}
