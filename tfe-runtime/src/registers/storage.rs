//! Where the values of an element at its points are stored, and the tables that no step changes.

use core::fmt::Debug;
use core::ops::{Deref, DerefMut};

/// Memory for an element: on the heap, with any size, or inside the struct, with a size that is part of the type.
pub trait Storage: Clone + Debug + Sized {
    /// The number of groups of four points; zero if it is known only at run time.
    const GROUPS: usize;

    /// An entry for each group.
    type Groups<T: Copy + Debug>: List<T>;
    /// An entry for each group, for equations of first order; empty for others.
    type FirstOrder<T: Copy + Debug>: List<T>;
    /// An entry for each group, for mass matrices that vary; empty for others.
    type Varying<T: Copy + Debug>: List<T>;
    /// The rows of a table: an entry for each group of each point.
    type Lines: List<[f64; 4]>;
    /// The working memory of a step, if it is kept between steps.
    type Kept<T: Clone + Debug>: Keep<T>;
    /// The rows of a constant matrix that is not diagonal.
    type Square<const N: usize>: List<[f64; N]>;
    /// The additional tables of elements with more points than unknown rates, for equations of first order; empty for
    /// others.
    type Projected: Deref<Target = [Projection<Self>]> + Clone + Debug;
    /// The tables that no step changes.
    type Fixed: Deref<Target = Fixed<Self>> + Clone + Debug;
}

/// Up to 16 points are evaluated at once; elements with more evaluate one point after the other.
pub(crate) const MAX_GROUPS: usize = 4;

/// A number for every coordinate at each of four points.
pub(crate) type Row<const N: usize> = [[f64; 4]; N];

/// A K × K matrix by columns, with the rows in groups of four. Rows beyond the last are copies of it, so that no
/// exceptional values arise there.
#[derive(Clone, Debug)]
pub struct Matrix<S: Storage> {
    #[cfg(feature = "alloc")]
    pub(crate) groups: usize,
    pub(crate) columns: S::Lines,
}

/// The matrices for rates of degree n − 2 at more points than they have coefficients.
#[derive(Clone, Debug)]
pub struct Projection<S: Storage> {
    /// C P: from rates to coordinates.
    pub(crate) position: Matrix<S>,
    pub(crate) position_low: Matrix<S>,
    /// E P: from values at the points to the nearest rates, in the norm of the rule.
    pub(crate) onto_rates: Matrix<S>,
}

/// A weight for each point and its rounding error; zeros beyond the last point.
#[derive(Clone, Debug)]
pub(crate) struct Weights<S: Storage>(pub(crate) S::Groups<[[f64; 4]; 2]>);

/// The tables that no step changes; `low` parts are rounding errors.
#[derive(Clone, Debug)]
pub struct Fixed<S: Storage> {
    pub(crate) points: usize,
    pub(crate) groups: usize,
    /// c
    pub(crate) nodes: S::Groups<[f64; 4]>,
    /// C 1: the displacement for unit velocity. It is c for collocation methods and primal elements.
    pub(crate) reach: S::Groups<[f64; 4]>,
    pub(crate) reach_low: S::Groups<[f64; 4]>,
    /// E G, which is A for Runge–Kutta methods: from rates of momenta to momenta.
    pub(crate) once: Matrix<S>,
    pub(crate) once_low: Matrix<S>,
    /// C G, which is A² for Runge–Kutta methods: the double integral of accelerations.
    pub(crate) twice: Matrix<S>,
    pub(crate) twice_low: Matrix<S>,
    /// b
    pub(crate) weights: Weights<S>,
    /// βᵀG, which is bᵀA for Runge–Kutta methods.
    pub(crate) lever: Weights<S>,
    /// C P and E P, where they are not A and the unit matrix.
    pub(crate) projected: S::Projected,
    /// The extrapolation matrix to the next element of the same length.
    pub(crate) continued: Matrix<S>,
}

/// A list whose length is fixed when it is made.
pub trait List<T>: Deref<Target = [T]> + DerefMut + Clone + Debug {
    /// A list with `count` entries, or with as many as the type has.
    fn filled(value: T, count: usize) -> Self;

    /// Takes the values of a list of the same length, whose values are unspecified afterwards.
    #[inline(always)]
    fn take(&mut self, other: &mut Self)
    where
        T: Copy,
    {
        self.copy_from_slice(other);
    }
}

/// Memory that is either kept, or made anew where it is needed.
pub trait Keep<T>: Clone + Debug {
    /// Keeps the result of `make`, or nothing.
    fn keep(make: impl Fn() -> T) -> Self;

    /// The kept value.
    fn kept(&mut self) -> Option<&mut T>;
}

/// Memory on the heap.
#[cfg(feature = "alloc")]
#[derive(Clone, Debug)]
pub struct Heap;

#[cfg(feature = "alloc")]
impl Storage for Heap {
    const GROUPS: usize = 0;
    type Groups<T: Copy + Debug> = alloc::vec::Vec<T>;
    type FirstOrder<T: Copy + Debug> = alloc::vec::Vec<T>;
    type Varying<T: Copy + Debug> = alloc::vec::Vec<T>;
    type Lines = alloc::vec::Vec<[f64; 4]>;
    type Kept<T: Clone + Debug> = Always<T>;
    type Square<const N: usize> = alloc::vec::Vec<[f64; N]>;
    type Projected = alloc::vec::Vec<Projection<Self>>;
    type Fixed = alloc::sync::Arc<Fixed<Self>>;
}

#[cfg(feature = "alloc")]
impl<T: Clone + Debug> List<T> for alloc::vec::Vec<T> {
    fn filled(value: T, count: usize) -> Self {
        alloc::vec![value; count]
    }

    fn take(&mut self, other: &mut Self)
    where
        T: Copy,
    {
        core::mem::swap(self, other);
    }
}

/// Memory on the heap, which is always kept, so that it is allocated once.
#[cfg(feature = "alloc")]
#[derive(Clone, Debug)]
pub struct Always<T>(T);

#[cfg(feature = "alloc")]
impl<T: Clone + Debug> Keep<T> for Always<T> {
    fn keep(make: impl Fn() -> T) -> Self {
        Self(make())
    }

    #[inline(always)]
    fn kept(&mut self) -> Option<&mut T> {
        Some(&mut self.0)
    }
}

/// Kept if `KEPT` is one; otherwise it is made anew in each step, and is in registers if there are enough.
impl<T: Clone + Debug, const KEPT: usize> Keep<T> for Array<T, KEPT> {
    fn keep(make: impl Fn() -> T) -> Self {
        Self(core::array::from_fn(|_| make()))
    }

    #[inline(always)]
    fn kept(&mut self) -> Option<&mut T> {
        self.0.first_mut()
    }
}

/// Memory inside the struct, for K points in C groups. `FIRST`, `VARYING` and `SQUARE` are the lengths of the lists for
/// equations of first order, for mass matrices that vary, and for constant ones that are not diagonal: full length or
/// zero. `KEPT` is one for models so large that it takes time to make the working memory of a step anew, `PROJECTED`
/// for elements with more points than unknown rates.
#[derive(Clone, Debug)]
pub struct Inline<
    const K: usize,
    const C: usize,
    const FIRST: usize,
    const VARYING: usize,
    const SQUARE: usize,
    const KEPT: usize,
    const PROJECTED: usize,
>;

impl<
    const K: usize,
    const C: usize,
    const FIRST: usize,
    const VARYING: usize,
    const SQUARE: usize,
    const KEPT: usize,
    const PROJECTED: usize,
> Storage for Inline<K, C, FIRST, VARYING, SQUARE, KEPT, PROJECTED>
{
    const GROUPS: usize = C;
    type Groups<T: Copy + Debug> = Array<T, C>;
    type FirstOrder<T: Copy + Debug> = Array<T, FIRST>;
    type Varying<T: Copy + Debug> = Array<T, VARYING>;
    type Lines = Lines<K, C>;
    type Kept<T: Clone + Debug> = Array<T, KEPT>;
    type Square<const N: usize> = Array<[f64; N], SQUARE>;
    type Projected = Array<Projection<Self>, PROJECTED>;
    type Fixed = &'static Fixed<Self>;
}

/// An array as a list.
#[derive(Clone, Copy, Debug)]
pub struct Array<T, const C: usize>(pub(crate) [T; C]);

impl<T, const C: usize> Deref for Array<T, C> {
    type Target = [T];
    #[inline(always)]
    fn deref(&self) -> &[T] {
        &self.0
    }
}

impl<T, const C: usize> DerefMut for Array<T, C> {
    #[inline(always)]
    fn deref_mut(&mut self) -> &mut [T] {
        &mut self.0
    }
}

impl<T: Copy + Debug, const C: usize> List<T> for Array<T, C> {
    #[inline(always)]
    fn filled(value: T, _: usize) -> Self {
        Self([value; C])
    }
}

/// The lines of a table.
#[derive(Clone, Copy, Debug)]
pub struct Lines<const K: usize, const C: usize>(pub(crate) [[[f64; 4]; C]; K]);

impl<const K: usize, const C: usize> Deref for Lines<K, C> {
    type Target = [[f64; 4]];
    #[inline(always)]
    fn deref(&self) -> &[[f64; 4]] {
        self.0.as_flattened()
    }
}

impl<const K: usize, const C: usize> DerefMut for Lines<K, C> {
    #[inline(always)]
    fn deref_mut(&mut self) -> &mut [[f64; 4]] {
        self.0.as_flattened_mut()
    }
}

impl<const K: usize, const C: usize> List<[f64; 4]> for Lines<K, C> {
    #[inline(always)]
    fn filled(value: [f64; 4], _: usize) -> Self {
        Self([[value; C]; K])
    }
}
