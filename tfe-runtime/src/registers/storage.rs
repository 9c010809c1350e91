//! Where the numbers of an element at its points are kept, and what of its tables no step changes.

use core::fmt::Debug;
use core::ops::{Deref, DerefMut};

/// Memory for an element: on the heap, of any size, or in place, of a size that is part of the type.
pub trait Storage: Clone + Debug + Sized {
    /// The number of groups of four points; zero where it is known at run time only.
    const GROUPS: usize;

    /// An entry for each group.
    type Groups<T: Copy + Debug>: List<T>;
    /// An entry for each group, of equations of first order; empty of others.
    type FirstOrder<T: Copy + Debug>: List<T>;
    /// An entry for each group, of mass matrices that vary; empty of others.
    type Varying<T: Copy + Debug>: List<T>;
    /// The lines of a table: an entry for each group of each point.
    type Lines: List<[f64; 4]>;
    /// What is needed during a step only, if it is kept between steps.
    type Kept<T: Clone + Debug>: Keep<T>;
    /// The rows of a constant matrix that is not diagonal.
    type Square<const N: usize>: List<[f64; N]>;
    /// What elements with more points than unknown rates need besides, of equations of first order; empty of others.
    type Projected: Deref<Target = [Projection<Self>]> + Clone + Debug;
    /// The tables that no step changes.
    type Fixed: Deref<Target = Fixed<Self>> + Clone + Debug;
}

/// Elements have up to 16 points at once; beyond, one point after the other.
pub(crate) const MAX_GROUPS: usize = 4;

/// A number for every coordinate at each of four points.
pub(crate) type Row<const N: usize> = [[f64; 4]; N];

/// A K × K matrix by columns, the rows in groups of four. Rows beyond the last are copies of it, so that nothing extraordinary happens there.
#[derive(Clone, Debug)]
pub struct Matrix<S: Storage> {
    #[cfg(feature = "alloc")]
    pub(crate) groups: usize,
    pub(crate) columns: S::Lines,
}

/// Rates of degree n − 2 at more points than they have coefficients.
#[derive(Clone, Debug)]
pub struct Projection<S: Storage> {
    /// C P: rates to coordinates.
    pub(crate) position: Matrix<S>,
    pub(crate) position_low: Matrix<S>,
    /// E P: numbers at the points to the nearest rates, in the norm of the rule.
    pub(crate) onto_rates: Matrix<S>,
}

/// A weight for each point and what rounding took from it; zeros beyond the last.
#[derive(Clone, Debug)]
pub(crate) struct Weights<S: Storage>(pub(crate) S::Groups<[[f64; 4]; 2]>);

/// What no step changes; `low` is what rounding took.
#[derive(Clone, Debug)]
pub struct Fixed<S: Storage> {
    pub(crate) points: usize,
    pub(crate) groups: usize,
    /// c
    pub(crate) nodes: S::Groups<[f64; 4]>,
    /// C 1: how far a constant velocity reaches. It is c for collocation methods and primal elements.
    pub(crate) reach: S::Groups<[f64; 4]>,
    pub(crate) reach_low: S::Groups<[f64; 4]>,
    /// E G, which is A for Runge–Kutta methods: rates of momenta to momenta.
    pub(crate) once: Matrix<S>,
    pub(crate) once_low: Matrix<S>,
    /// C G, which is A² for Runge–Kutta methods: what two integrations make of accelerations.
    pub(crate) twice: Matrix<S>,
    pub(crate) twice_low: Matrix<S>,
    /// b
    pub(crate) weights: Weights<S>,
    /// βᵀG, which is bᵀA for Runge–Kutta methods.
    pub(crate) lever: Weights<S>,
    /// C P and E P where they are neither A nor one.
    pub(crate) projected: S::Projected,
    /// From one element to the next that is as long.
    pub(crate) continued: Matrix<S>,
}

/// A list whose length was decided when it was made.
pub trait List<T>: Deref<Target = [T]> + DerefMut + Clone + Debug {
    /// As many entries as asked for, or as many as the type has.
    fn filled(value: T, count: usize) -> Self;

    /// Takes the numbers of another as long, which may hold any afterwards.
    #[inline(always)]
    fn take(&mut self, other: &mut Self)
    where
        T: Copy,
    {
        self.copy_from_slice(other);
    }
}

/// Room for something that may be made anew where it is needed.
pub trait Keep<T>: Clone + Debug {
    /// Keeps it, or not.
    fn keep(make: impl Fn() -> T) -> Self;

    /// What is kept.
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

/// What is on the heap is asked for once.
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

/// Kept if there is room (`KEPT` is one); otherwise it is made anew in each step, and lives in registers if there are enough.
impl<T: Clone + Debug, const KEPT: usize> Keep<T> for Array<T, KEPT> {
    fn keep(make: impl Fn() -> T) -> Self {
        Self(core::array::from_fn(|_| make()))
    }

    #[inline(always)]
    fn kept(&mut self) -> Option<&mut T> {
        self.0.first_mut()
    }
}

/// Memory in place, for K points in C groups; `FIRST`, `VARYING` and `SQUARE` are how many of the lists for equations of first order, for mass matrices that vary, and for
/// one that does not are there: all or none. `KEPT` is one for models so large that making the memory of a step anew takes time, `PROJECTED` for elements with more
/// points than unknown rates.
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
