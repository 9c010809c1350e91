//! A model that is either borrowed or owned by those that use it.

use alloc::boxed::Box;
use alloc::sync::Arc;
use core::fmt;
use core::ops::Deref;

/// A model that steppers use: borrowed from the caller, or made for a run and owned by it.
///
/// An owned model may be sent to other threads although nothing is known about M: where it is made, it is required to
/// be `Send + Sync`.
pub enum Share<'m, M> {
    /// Borrowed from the caller.
    Borrowed(&'m M),
    /// Made for a run.
    Owned(Owned<'m, M>),
}

/// A model shared by all who hold it.
type Owned<'m, M> = Arc<dyn Deref<Target = M> + Send + Sync + 'm>;

impl<'m, M: Send + Sync + 'm> Share<'m, M> {
    /// A model that belongs to those that use it.
    pub fn own(model: M) -> Self {
        Self::Owned(Arc::new(Box::new(model)))
    }
}

impl<'m, M> From<&'m M> for Share<'m, M> {
    fn from(model: &'m M) -> Self {
        Self::Borrowed(model)
    }
}

impl<M> Clone for Share<'_, M> {
    fn clone(&self) -> Self {
        match self {
            Self::Borrowed(model) => Self::Borrowed(model),
            Self::Owned(model) => Self::Owned(Arc::clone(model)),
        }
    }
}

impl<M> Deref for Share<'_, M> {
    type Target = M;

    #[inline]
    fn deref(&self) -> &M {
        match self {
            Self::Borrowed(model) => model,
            Self::Owned(model) => model,
        }
    }
}

impl<M: fmt::Debug> fmt::Debug for Share<'_, M> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        (**self).fmt(f)
    }
}
