//! Where the inputs of a model come from.

use super::table::Table;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use tfe_runtime::{InputFailure, InputPanicked, MAX_INPUTS, Real};

/// Where an input comes from.
#[derive(Clone)]
pub(super) enum Source<'m> {
    Zero,
    Function(Arc<dyn Fn(f64) -> f64 + Send + Sync + 'm>),
    Table(Arc<Table>),
}

/// Where all inputs of a model come from.
#[derive(Clone)]
pub(super) struct Sources<'m> {
    pub(super) each: Vec<Source<'m>>,
    /// Numbers set between steps, which go before the others.
    pub(super) held: Option<Arc<Cells>>,
    /// The last number of a function that was not finite.
    failed: Arc<Mutex<Option<(usize, f64, f64)>>>,
}

/// Inputs that are set between steps.
#[derive(Debug)]
pub(crate) struct Cells([AtomicU64; MAX_INPUTS]);

/// No number was set: the bits of a NaN, which is none either.
const UNSET: u64 = u64::MAX;

impl Cells {
    pub(crate) fn new() -> Self {
        Self(std::array::from_fn(|_| AtomicU64::new(UNSET)))
    }

    /// Sets an input from now on.
    pub(crate) fn set(&self, input: usize, value: f64) {
        if let Some(cell) = self.0.get(input) {
            cell.store(value.to_bits(), Ordering::Relaxed);
        }
    }

    fn get(&self, input: usize) -> Option<f64> {
        let bits = self.0[input].load(Ordering::Relaxed);
        (bits != UNSET).then(|| f64::from_bits(bits))
    }
}

impl Source<'_> {
    fn is(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Zero, Self::Zero) => true,
            (Self::Function(own), Self::Function(other)) => {
                std::ptr::addr_eq(Arc::as_ptr(own), Arc::as_ptr(other))
            }
            (Self::Table(own), Self::Table(other)) => Arc::ptr_eq(own, other),
            _ => false,
        }
    }
}

impl Sources<'_> {
    /// So many inputs, all of them zero.
    pub(super) fn zero(count: usize) -> Self {
        Self {
            each: vec![Source::Zero; count.min(MAX_INPUTS)],
            held: None,
            failed: Arc::default(),
        }
    }

    #[inline(always)]
    pub(super) fn values<R: Real>(&self, t: R) -> [R; MAX_INPUTS] {
        let mut values = [t.like(0.0); MAX_INPUTS];
        for ((input, source), value) in self.each.iter().enumerate().zip(&mut values) {
            let held = self.held.as_ref().and_then(|cells| cells.get(input));
            *value = match (held, source) {
                (Some(held), _) => t.like(held),
                (None, Source::Zero) => continue,
                (None, Source::Function(function)) => t.map(&mut |t| {
                    let value = function(t);
                    if !value.is_finite() {
                        self.note(input, t, value);
                    }
                    value
                }),
                (None, Source::Table(table)) => t.map(&mut |t| table.at(t)),
            };
        }
        values
    }

    #[cold]
    fn note(&self, input: usize, time: f64, value: f64) {
        let mut failed = self.failed.lock().unwrap_or_else(PoisonError::into_inner);
        *failed = Some((input, time, value));
    }

    /// Whether both are the same functions and tables, not only such as give the same numbers.
    pub(super) fn are_those_of(&self, other: &Self) -> bool {
        let same = self.each.iter().zip(&other.each).all(|(a, b)| a.is(b));
        same && self.held.is_none() && other.held.is_none()
    }

    /// Whether no input changes with the time.
    pub(super) fn is_constant(&self) -> bool {
        (self.each.iter()).all(|source| matches!(source, Source::Zero))
    }

    /// What `f` gives, unless a function panics in it.
    pub(super) fn guarded<T>(&self, f: impl FnOnce() -> T) -> Result<T, InputPanicked> {
        if self.is_constant() {
            return Ok(f());
        }
        catch_unwind(AssertUnwindSafe(f)).map_err(|_| InputPanicked)
    }

    /// The last number that was not finite, of inputs of these names; it is forgotten then.
    pub(super) fn failure(&self, names: &[&'static str]) -> Option<InputFailure> {
        let mut failed = self.failed.lock().unwrap_or_else(PoisonError::into_inner);
        let (input, time, value) = failed.take()?;
        Some(InputFailure {
            input: names.get(input)?,
            time,
            value,
        })
    }
}
