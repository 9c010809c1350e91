//! A model that is borrowed, or that belongs to those that use it.

use alloc::boxed::Box;
use alloc::sync::Arc;
use core::fmt;
use core::ops::Deref;

/// A model that steppers use: the caller's, or one made for a run, which is theirs.
///
/// The latter goes to other threads though nothing is known of M: what cannot is refused where it is made.
pub enum Share<'m, M> {
    /// The caller's.
    Borrowed(&'m M),
    /// One made for a run.
    Owned(Owned<'m, M>),
}

/// A model that all who hold it own.
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
