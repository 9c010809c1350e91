//! The sources of the inputs of a model: functions of time, tables, and numbers set between steps.

use super::table::Table;
use crate::differences::derivative_by_time;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, ThreadId};
use tfe_runtime::{InputFailure, InputPanicked, MAX_INPUTS, Real};

/// The source of an input.
#[derive(Clone)]
pub(super) enum Source<'m> {
    Zero,
    Function(Arc<dyn Fn(f64) -> f64 + Send + Sync + 'm>),
    Table(Arc<Table>),
}

/// The sources of all inputs of a model.
#[derive(Clone)]
pub(super) struct Sources<'m> {
    pub(super) each: Vec<Source<'m>>,
    /// Numbers set between steps, which take precedence.
    pub(super) held: Option<Arc<Cells>>,
    /// The last values of functions that were not finite. Several threads may run the same model at the same time, so
    /// each entry belongs to a thread.
    failed: Arc<Mutex<Vec<Failed>>>,
}

/// A value that was not finite.
#[derive(Clone, Copy)]
struct Failed {
    on: ThreadId,
    input: usize,
    time: f64,
    value: f64,
}

/// Numbers of inputs that are set between steps.
#[derive(Debug)]
pub(crate) struct Cells([AtomicU64; MAX_INPUTS]);

/// The bits of a NaN, which mark an input that was not set.
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

/// The derivative of a function of time of a given order; order 0 is the function itself.
#[cold]
fn derivative_of(function: &dyn Fn(f64) -> f64, order: u32, t: f64) -> f64 {
    /// The first step. It is not a simple fraction of common periods, and so short that functions are hardly evaluated
    /// outside of the span.
    const FIRST: f64 = 1.570_796e-4;
    match order {
        0 => function(t),
        _ => derivative_by_time(FIRST, t, &mut |t| derivative_of(function, order - 1, t)),
    }
}

impl Sources<'_> {
    /// A number of inputs that are all zero.
    pub(super) fn zero(count: usize) -> Self {
        Self {
            each: vec![Source::Zero; count.min(MAX_INPUTS)],
            held: None,
            failed: Arc::default(),
        }
    }

    /// The times of all tables.
    pub(super) fn times_of_tables(&self) -> impl Iterator<Item = f64> {
        self.each.iter().flat_map(|source| match source {
            Source::Table(table) => table.times().iter().copied(),
            Source::Zero | Source::Function(_) => [].iter().copied(),
        })
    }

    #[inline(always)]
    pub(super) fn values<R: Real>(&self, t: R) -> [R; MAX_INPUTS] {
        let mut values = [t.like(0.0); MAX_INPUTS];
        for ((input, source), value) in self.each.iter().enumerate().zip(&mut values) {
            let held = self.held.as_ref().and_then(|cells| cells.get(input));
            *value = match (held, source) {
                (Some(held), _) => t.like(held),
                (None, Source::Zero) => continue,
                (None, Source::Function(function)) => {
                    t.map_with_derivatives(&mut |order, t| match order {
                        // Functions are not evaluated at a time that is not finite.
                        _ if t.is_nan() => t,
                        0 => self.checked(input, t, function(t)),
                        _ => derivative_of(&**function, order, t),
                    })
                }
                (None, Source::Table(table)) => {
                    t.map_with_derivatives(&mut |order, t| table.derivative(order, t))
                }
            };
        }
        values
    }

    /// The time derivatives of all inputs: of a table, that of its piece; of a function, by differences with a suitable
    /// step.
    pub(super) fn rates<R: Real>(&self, t: R) -> [R; MAX_INPUTS] {
        let mut rates = [t.like(0.0); MAX_INPUTS];
        for ((input, source), rate) in self.each.iter().enumerate().zip(&mut rates) {
            if self
                .held
                .as_ref()
                .is_some_and(|cells| cells.get(input).is_some())
            {
                continue;
            }
            *rate = match source {
                Source::Zero => continue,
                Source::Function(function) => {
                    t.map_with_derivatives(&mut |order, t| derivative_of(&**function, order + 1, t))
                }
                Source::Table(table) => {
                    t.map_with_derivatives(&mut |order, t| table.derivative(order + 1, t))
                }
            };
        }
        rates
    }

    /// The value of a function; it is recorded if it is not finite.
    #[inline(always)]
    fn checked(&self, input: usize, time: f64, value: f64) -> f64 {
        if !value.is_finite() {
            self.note(input, time, value);
        }
        value
    }

    #[cold]
    fn note(&self, input: usize, time: f64, value: f64) {
        let on = thread::current().id();
        let mut failed = self.failed.lock().unwrap_or_else(PoisonError::into_inner);
        failed.retain(|failed| failed.on != on);
        failed.push(Failed {
            on,
            input,
            time,
            value,
        });
    }

    /// Whether both have the same functions and tables, by identity, not by their values.
    pub(super) fn are_those_of(&self, other: &Self) -> bool {
        let same = self.each.iter().zip(&other.each).all(|(a, b)| a.is(b));
        same && self.held.is_none() && other.held.is_none()
    }

    /// Whether no input depends on time.
    pub(super) fn is_constant(&self) -> bool {
        (self.each.iter()).all(|source| matches!(source, Source::Zero))
    }

    /// The result of `f`, unless an input function panics in it.
    pub(super) fn guarded<T>(&self, f: impl FnOnce() -> T) -> Result<T, InputPanicked> {
        if self.is_constant() {
            return Ok(f());
        }
        catch_unwind(AssertUnwindSafe(f)).map_err(|_| InputPanicked)
    }

    /// Takes the last value on this thread that was not finite; `names` are the names of the inputs.
    pub(super) fn failure(&self, names: &[&'static str]) -> Option<InputFailure> {
        let mut failed = self.failed.lock().unwrap_or_else(PoisonError::into_inner);
        let on = thread::current().id();
        let place = failed.iter().position(|failed| failed.on == on)?;
        let Failed {
            input, time, value, ..
        } = failed.swap_remove(place);
        Some(InputFailure {
            input: names.get(input)?,
            time,
            value,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::table::Interpolation;
    use super::*;
    use tfe_runtime::dual::Dual;

    /// A function, a table with held values and one with linear interpolation, at times within a difference step of
    /// their kinks.
    #[test]
    fn slopes_of_tables_are_those_of_their_pieces() {
        let table = |way| {
            let table = Table::new(&[0.0, 1.0, 2.0], &[1.0, -1.0, 4.0], way);
            Source::Table(Arc::new(table.expect("a table")))
        };
        let mut sources = Sources::zero(4);
        sources.each = vec![
            Source::Function(Arc::new(f64::sin)),
            table(Interpolation::Hold),
            table(Interpolation::Linear),
            Source::Zero,
        ];
        for (t, slope) in [(1.0 - 1e-9, -2.0), (1.0, 5.0), (1.0 + 1e-9, 5.0)] {
            let values = sources.values(Dual::new(t, 3.0));
            let rates = sources.rates(t);
            assert_eq!(values.map(|one| one.value), sources.values(t));
            assert!((values[0].slope - 3.0 * t.cos()).abs() < 1e-9);
            assert!((rates[0] - t.cos()).abs() < 1e-9);
            assert_eq!([1, 2, 3].map(|k| values[k].slope), [0.0, 3.0 * slope, 0.0]);
            assert_eq!([1, 2, 3].map(|k| rates[k]), [0.0, slope, 0.0]);
        }
        // A failure on another thread is reported there.
        let broken = Source::Function(Arc::new(|t: f64| 1.0 / (t - 3.0)));
        sources.each[3] = broken;
        std::thread::scope(|scope| {
            let other = scope.spawn(|| {
                sources.values(3.0_f64);
                sources.failure(&["a", "b", "c", "d"])
            });
            let other = other.join().expect("a thread");
            assert!(other.is_some_and(|failure| failure.input == "d" && failure.time == 3.0));
            scope.spawn(|| sources.values(3.0_f64));
        });
        assert!(sources.failure(&["a", "b", "c", "d"]).is_none());
        sources.each[3] = Source::Zero;
        // At a time that is not finite, the values are not finite either.
        assert_eq!(
            sources.values(f64::NAN).map(f64::is_nan)[..4],
            [true, true, true, false]
        );
        // Numbers set between steps do not depend on time.
        let cells = Arc::new(Cells::new());
        cells.set(2, 7.0);
        sources.held = Some(cells);
        assert_eq!(sources.rates(1.5)[2], 0.0);
        assert_eq!(sources.values(Dual::new(1.5, 1.0))[2], Dual::new(7.0, 0.0));
    }
}
