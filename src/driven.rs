//! Models whose inputs are given: functions of the time, tables, or numbers held between steps.

mod table;

use std::error::Error;
use std::fmt;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use table::Table;
use tfe_runtime::{
    By, Constraint, ConstraintSecond, Controlled, CoordinateName, Facts, First, Form, InputFailure,
    InputPanicked, MAX_INPUTS, Model, Real, Second, Share,
};

pub use table::Interpolation;

/// A model with its inputs: a model itself, of the same coordinates and states.
///
/// [`Simulation::input`](crate::Simulation::input) makes one for a run. By itself it is for what takes models: orbits, boundary values, ensembles, work-precision diagrams.
///
/// ```
/// use tfe::Driven;
/// use tfe::prelude::*;
///
/// #[dynamics(coordinates(x), lagrangian = (dot(x)^2 - x^2)/2, input(u), force(x) = u)]
/// struct Oscillator;
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// // x″ + x = sin 2t, from x = 0, x′ = −2/3: x = −⅓ sin 2t.
/// let driven = Driven::new(&Oscillator).input("u", |t| (2.0 * t).sin())?;
/// let motion = Simulation::new(&driven).element(Mixed::<6>).step(0.05).run(Oscillator.state([0.0], [-2.0 / 3.0]), 0.0..10.0)?;
/// assert!((motion.last().q[0] + 20.0_f64.sin() / 3.0).abs() < 1e-13);
/// # Ok(())
/// # }
/// ```
pub struct Driven<'m, M> {
    model: Share<'m, M>,
    sources: Vec<Source<'m>>,
    /// Numbers set between steps, which go before sources.
    held: Option<Arc<Cells>>,
    /// The last number of a function that was not finite.
    failed: Arc<Mutex<Option<(usize, f64, f64)>>>,
}

/// Where an input comes from.
#[derive(Clone)]
enum Source<'m> {
    Zero,
    Function(Arc<dyn Fn(f64) -> f64 + Send + Sync + 'm>),
    Table(Arc<Table>),
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

impl<M> Clone for Driven<'_, M> {
    fn clone(&self) -> Self {
        Self {
            model: self.model.clone(),
            sources: self.sources.clone(),
            held: self.held.clone(),
            failed: Arc::clone(&self.failed),
        }
    }
}

impl<M: fmt::Debug> fmt::Debug for Driven<'_, M> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let kinds = self.sources.iter().map(|source| match source {
            Source::Zero => "zero",
            Source::Function(_) => "function",
            Source::Table(_) => "table",
        });
        f.debug_struct("Driven")
            .field("model", &self.model)
            .field("inputs", &kinds.collect::<Vec<_>>())
            .finish_non_exhaustive()
    }
}

impl<'m, M> Driven<'m, M> {
    /// The model with all its inputs zero.
    pub fn new<const N: usize>(model: &'m M) -> Self
    where
        M: Controlled<N>,
    {
        Self::sharing(Share::Borrowed(model))
    }

    pub(crate) fn sharing<const N: usize>(model: Share<'m, M>) -> Self
    where
        M: Controlled<N>,
    {
        Self {
            model,
            sources: vec![Source::Zero; M::INPUTS.len().min(MAX_INPUTS)],
            held: None,
            failed: Arc::default(),
        }
    }

    /// Gives an input as a function of the time; it is asked at the points of elements, several times each, in any order. What it may do wrong is told by
    /// [runs](crate::Simulation::input); elsewhere a panic goes on to the caller, and a number that is not finite is an element that cannot be solved.
    ///
    /// # Errors
    /// [`InputError::Unknown`].
    pub fn input<const N: usize>(
        mut self,
        name: &str,
        function: impl Fn(f64) -> f64 + Send + Sync + 'm,
    ) -> Result<Self, InputError>
    where
        M: Controlled<N>,
    {
        let place = place::<M, N>(name)?;
        self.sources[place] = Source::Function(Arc::new(function));
        Ok(self)
    }

    /// Gives an input by its values at given times; before the first and after the last it keeps theirs. Elements must end at the times to keep their order:
    /// [`Simulation::table`](crate::Simulation::table) sees to that.
    ///
    /// # Errors
    /// [`InputError::Unknown`], [`InputError::Table`].
    pub fn table<const N: usize>(
        mut self,
        name: &str,
        times: &[f64],
        values: &[f64],
        interpolation: Interpolation,
    ) -> Result<Self, InputError>
    where
        M: Controlled<N>,
    {
        let place = place::<M, N>(name)?;
        let table = Table::new(times, values, interpolation).map_err(|why| InputError::Table {
            name: name.to_owned(),
            why,
        })?;
        self.sources[place] = Source::Table(Arc::new(table));
        Ok(self)
    }

    /// The same model, which looks at `cells` first.
    pub(crate) fn holding(mut self, cells: Arc<Cells>) -> Self {
        self.held = Some(cells);
        self
    }

    #[inline(always)]
    fn values<R: Real>(&self, t: R) -> [R; MAX_INPUTS] {
        let mut values = [t.like(0.0); MAX_INPUTS];
        for ((input, source), value) in self.sources.iter().enumerate().zip(&mut values) {
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

    /// Whether no input changes with the time.
    fn is_constant(&self) -> bool {
        (self.sources.iter()).all(|source| matches!(source, Source::Zero))
    }
}

/// The place of an input.
pub(crate) fn place<M: Controlled<N>, const N: usize>(name: &str) -> Result<usize, InputError> {
    let mut inputs = M::INPUTS.iter().take(MAX_INPUTS);
    let place = inputs.position(|own| *own == name);
    place.ok_or_else(|| InputError::Unknown {
        name: name.to_owned(),
        known: M::INPUTS.to_vec(),
    })
}

impl<M: Controlled<N>, const N: usize> Model<N> for Driven<'_, M> {
    /// Once for all that a step asks, so that functions are called as fast as they are. What is half done is left alone by those who are told.
    fn guarded<T>(&self, f: impl FnOnce() -> T) -> Result<T, InputPanicked> {
        if self.is_constant() {
            return Ok(f());
        }
        catch_unwind(AssertUnwindSafe(f)).map_err(|_| InputPanicked)
    }

    fn failed_input(&self) -> Option<InputFailure> {
        let mut failed = self.failed.lock().unwrap_or_else(PoisonError::into_inner);
        let (input, time, value) = failed.take()?;
        Some(InputFailure {
            input: M::INPUTS.get(input)?,
            time,
            value,
        })
    }

    const FORM: Form = M::FORM;
    const FACTS: Facts = Facts {
        time_dependent: true,
        ..M::FACTS
    };

    fn energy_function<R: Real>(&self, t: R, q: &[R; N], z: &[R; N]) -> R {
        self.model.energy_function_with(&self.values(t), t, q, z)
    }

    const LANES: bool = M::LANES;

    #[inline(always)]
    fn first_inline<R: Real>(&self, t: R, q: &[R; N], z: &[R; N], first: &mut First<R, N>) {
        self.model.first_with(&self.values(t), t, q, z, first);
    }

    #[inline(always)]
    fn first_and_mass_inline<R: Real>(
        &self,
        t: R,
        q: &[R; N],
        z: &[R; N],
        first: &mut First<R, N>,
        zz: &mut [[R; N]; N],
    ) {
        let inputs = self.values(t);
        self.model.first_and_mass_with(&inputs, t, q, z, first, zz);
    }

    fn first<R: Real>(&self, t: R, q: &[R; N], z: &[R; N], first: &mut First<R, N>) {
        self.first_inline(t, q, z, first);
    }

    fn first_and_mass<R: Real>(
        &self,
        t: R,
        q: &[R; N],
        z: &[R; N],
        first: &mut First<R, N>,
        zz: &mut [[R; N]; N],
    ) {
        self.first_and_mass_inline(t, q, z, first, zz);
    }

    fn second<R: Real>(
        &self,
        t: R,
        q: &[R; N],
        z: &[R; N],
        first: &mut First<R, N>,
        second: &mut Second<R, N>,
    ) {
        let inputs = self.values(t);
        self.model.second_with(&inputs, t, q, z, first, second);
    }

    const SENSITIVITIES: &'static [&'static str] = M::SENSITIVITIES;

    fn sensitivity_parameter(&self, index: usize) -> f64 {
        self.model.sensitivity_parameter(index)
    }

    /// Derivatives by the time are differences where an input is a function or a table: good to some 1e-10 of what these do in a unit of time.
    fn first_by<R: Real>(&self, by: By, t: R, q: &[R; N], z: &[R; N], first: &mut First<R, N>) {
        const DISTANCE: f64 = 6e-6;
        let inputs = self.values(t);
        if by != By::Time || self.is_constant() {
            return self.model.first_by_with(by, &inputs, t, q, z, first);
        }
        let distance = t.map(&mut |t| DISTANCE * t.abs().max(1.0));
        let (early, late) = (t - distance, t + distance);
        let (mut before, mut after) = (First::zero(), First::zero());
        self.first(early, q, z, &mut before);
        self.first(late, q, z, &mut after);
        let rate = |before: R, after: R| (after - before) / (late - early);
        for a in 0..N {
            first.z[a] = rate(before.z[a], after.z[a]);
            first.q[a] = rate(before.q[a], after.q[a]);
            first.force[a] = rate(before.force[a], after.force[a]);
        }
    }

    fn parameters(&self) -> usize {
        self.model.parameters()
    }

    fn parameter_name(&self, index: usize) -> CoordinateName {
        self.model.parameter_name(index)
    }

    fn parameter(&self, index: usize) -> f64 {
        self.model.parameter(index)
    }

    fn with_parameter(&self, index: usize, value: f64) -> Option<Self> {
        let model = self.model.with_parameter(index, value)?;
        Some(Self {
            model: Share::own(model),
            ..self.clone()
        })
    }

    const CONSTRAINTS: &'static [Constraint] = M::CONSTRAINTS;

    fn constraint_values<R: Real>(&self, t: R, q: &[R; N], values: &mut [R]) {
        self.model.constraint_values(t, q, values);
    }

    fn constraint_rows<R: Real>(&self, t: R, q: &[R; N], rows: &mut [[R; N]], drift: &mut [R]) {
        self.model.constraint_rows(t, q, rows, drift);
    }

    fn constraint_second<R: Real>(
        &self,
        t: R,
        q: &[R; N],
        v: &[R; N],
        mu: &[R],
        second: &mut ConstraintSecond<'_, R, N>,
    ) {
        self.model.constraint_second(t, q, v, mu, second);
    }

    fn coordinate_name(index: usize) -> CoordinateName {
        M::coordinate_name(index)
    }

    const OBSERVABLES: &'static [&'static str] = M::OBSERVABLES;

    fn columns(&self) -> usize {
        self.model.columns()
    }

    fn column_name(&self, column: usize) -> CoordinateName {
        self.model.column_name(column)
    }

    fn observables<R: Real>(&self, t: R, q: &[R; N], z: &[R; N], values: &mut [R]) {
        let inputs = self.values(t);
        self.model.observables_with(&inputs, t, q, z, values);
    }
}

/// What is wrong with an input.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum InputError {
    /// The model declares no input of a name.
    Unknown {
        /// The name asked for.
        name: String,
        /// Those that there are.
        known: Vec<&'static str>,
    },
    /// A function that gave a number that is not finite, so that an element could not be solved.
    Value {
        /// The input.
        name: String,
        /// The time that the function was asked for.
        time: f64,
        /// What it gave.
        value: f64,
    },
    /// A function panicked. What it said is on standard error, or where the program's panic hook puts it.
    Panicked {
        /// Where the element begins that asked it, or the run.
        time: f64,
    },
    /// Sampled feedback that cannot be.
    Sampling {
        /// The input.
        name: String,
        /// A time at which it was to be sampled.
        time: f64,
        /// What is wrong with it.
        why: &'static str,
    },
    /// A number that is not finite.
    NotFinite {
        /// The input.
        name: String,
        /// What it was set to.
        value: f64,
    },
    /// A table that is none.
    Table {
        /// The input.
        name: String,
        /// What is wrong with it.
        why: &'static str,
    },
}

impl fmt::Display for InputError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unknown { name, known } => write!(
                f,
                "the model has no input `{name}`, only `{}`",
                known.join("`, `")
            ),
            Self::Value { name, time, value } => {
                write!(
                    f,
                    "the function of input `{name}` gives {value} at t = {time}"
                )
            }
            Self::Panicked { time } => write!(
                f,
                "a function of an input panicked in the element that begins at t = {time}"
            ),
            Self::Sampling { name, time, why } => {
                write!(f, "the feedback of input `{name}` at t = {time}: {why}")
            }
            Self::NotFinite { name, value } => write!(f, "input `{name}` was set to {value}"),
            Self::Table { name, why } => write!(f, "the table of input `{name}`: {why}"),
        }
    }
}

impl Error for InputError {}
