//! A stepper that owns its memory.

use alloc::vec;
use alloc::vec::Vec;

use crate::dense::DenseElement;
use crate::element::{Element, ElementError};
use crate::error::StepError;
use crate::model::{Model, State};
use crate::newton::Control;
use crate::scheme::{SchemeTable, Tables};
use crate::statistics::Statistics;
use crate::step::{Impulse, Interval, Memory, Method, is_phase};
use crate::transition::TransitionError;
use crate::workspace::{Workspace, interior_len, numbers_len, pivots_len, transition_len, width};

/// Steps a model with one element, on memory of its own.
///
/// # Example
/// ```
/// # use tfe_runtime::{CoordinateName, Facts, First, Form, Mixed, Model, Real, Second, State};
/// use tfe_runtime::step::{Control, Stepper};
///
/// # struct Oscillator;
/// # impl Model<1> for Oscillator {
/// #     const FORM: Form = Form::Hamiltonian;
/// #     const FACTS: Facts = Facts::UNKNOWN;
/// #     fn energy_function<R: Real>(&self, _: R, q: &[R; 1], p: &[R; 1]) -> R {
/// #         (q[0] * q[0] + p[0] * p[0]) * R::from_f64(0.5)
/// #     }
/// #     fn first<R: Real>(&self, _: R, q: &[R; 1], p: &[R; 1], first: &mut First<R, 1>) {
/// #         (first.z, first.q) = (*p, *q);
/// #     }
/// #     fn first_and_mass<R: Real>(
/// #         &self, t: R, q: &[R; 1], p: &[R; 1], first: &mut First<R, 1>, zz: &mut [[R; 1]; 1],
/// #     ) {
/// #         self.first(t, q, p, first);
/// #         zz[0][0] = R::from_f64(1.0);
/// #     }
/// #     fn second<R: Real>(
/// #         &self, t: R, q: &[R; 1], p: &[R; 1], first: &mut First<R, 1>, second: &mut Second<R, 1>,
/// #     ) {
/// #         self.first_and_mass(t, q, p, first, &mut second.zz);
/// #         second.qq[0][0] = R::from_f64(1.0);
/// #     }
/// #     fn coordinate_name(_: usize) -> CoordinateName {
/// #         CoordinateName { name: "x", index: None }
/// #     }
/// # }
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let mut stepper = Stepper::new(&Oscillator, Mixed::<4>.into(), Control::default())?;
/// let mut state = State { q: [1.0], p: [0.0] };
/// for step in 0..10 {
///     stepper.advance(0.1 * step as f64, 0.1, &mut state, &[])?;
/// }
/// assert!((state.q[0] - 1.0_f64.cos()).abs() < 1e-9);
/// # Ok(())
/// # }
/// ```
#[derive(Debug)]
pub struct Stepper<'m, M, const N: usize> {
    model: &'m M,
    table: SchemeTable,
    control: Control,
    memory: Memory<N>,
    numbers: Vec<f64>,
    pivots: Vec<usize>,
    impulses: Vec<Impulse<N>>,
}

// Not derived: the model is borrowed, it need not be `Clone`.
impl<M, const N: usize> Clone for Stepper<'_, M, N> {
    fn clone(&self) -> Self {
        Self {
            model: self.model,
            table: self.table.clone(),
            control: self.control,
            memory: self.memory.clone(),
            numbers: self.numbers.clone(),
            pivots: self.pivots.clone(),
            impulses: self.impulses.clone(),
        }
    }
}

impl<'m, M, const N: usize> Stepper<'m, M, N>
where
    M: Model<N>,
{
    /// A stepper at rest.
    ///
    /// # Errors
    /// [`ElementError`] if the element is none.
    pub fn new(model: &'m M, element: Element, control: Control) -> Result<Self, ElementError> {
        let table = SchemeTable::new(element)?;
        let numbers = numbers_len(element, M::FORM, N, M::CONSTRAINTS.len());
        let pivots = pivots_len(element, M::FORM, N, M::CONSTRAINTS.len());
        Ok(Self {
            model,
            table,
            control,
            memory: Memory::new(),
            numbers: vec![0.0; numbers],
            pivots: vec![0; pivots],
            impulses: Vec::new(),
        })
    }

    /// Moves `state` from t to t + h. The first iterate continues the last step if `state` is
    /// where that ended; a state of one's own is as welcome.
    ///
    /// # Errors
    /// [`StepError`]; `state` is unchanged then.
    pub fn advance(
        &mut self,
        t: f64,
        h: f64,
        state: &mut State<N>,
        impulses: &[Impulse<N>],
    ) -> Result<(), StepError> {
        self.impulses.clear();
        self.impulses.extend_from_slice(impulses);
        let interval = Interval {
            start: t,
            length: h,
            impulses,
        };
        let workspace = Workspace {
            numbers: &mut self.numbers,
            pivots: &mut self.pivots,
        };
        let method = Method {
            model: self.model,
            tables: &self.table,
            control: self.control,
        };
        method.advance(&mut self.memory, workspace, interval, state)
    }

    /// The polynomial of the last step, from time `start` to time `end`.
    ///
    /// Before the first step, and after a failed one, it is the constant zero.
    #[must_use]
    pub fn dense(&self, start: f64, end: f64) -> DenseElement<N> {
        let scheme = self.table.view();
        let Some(last) = self.memory.last else {
            return DenseElement::constant(start, end, State::ZERO);
        };
        if !M::CONSTRAINTS.is_empty() {
            let m = interior_len(&scheme.element, M::FORM, N, M::CONSTRAINTS.len());
            let points = scheme.points() * N;
            let momenta = &self.numbers[3 * m + points..3 * m + 2 * points];
            let rates = &self.numbers[..scheme.unknowns() * N];
            let (rates, momenta) = (rates.as_chunks().0, momenta.as_chunks().0);
            let ends = (&last.start, &last.end);
            return DenseElement::constrained(&scheme, (start, end), last.h, ends, rates, momenta);
        }
        // The workspace begins with the unknowns, their start and the increments.
        let m = scheme.unknowns() * width(&scheme.element, M::FORM, N);
        let unknowns = self.numbers[..m].as_chunks().0;
        let (rates, forces) = if is_phase::<M, N>(&scheme) {
            let (pi, kappa) = unknowns.split_at(scheme.points());
            (kappa, pi)
        } else {
            (
                unknowns,
                self.numbers[3 * m..3 * m + scheme.points() * N]
                    .as_chunks()
                    .0,
            )
        };
        let interval = Interval {
            start: last.t,
            length: last.h,
            impulses: &self.impulses,
        };
        DenseElement::of(&scheme, (start, end), &last, rates, forces, &interval)
    }

    /// Writes the transition matrix of the last step, 2N × 2N, row by row, ordered (p, q).
    ///
    /// # Errors
    /// [`TransitionError`] if there is no last step, its tangent
    /// is singular, or `matrix` is too short.
    pub fn transition(&mut self, matrix: &mut [f64]) -> Result<(), TransitionError> {
        let element = self.table.view().element;
        let length = transition_len(element, M::FORM, N, M::CONSTRAINTS.len());
        let mut extra = vec![0.0; length];
        let workspace = Workspace {
            numbers: &mut self.numbers,
            pivots: &mut self.pivots,
        };
        let method = Method {
            model: self.model,
            tables: &self.table,
            control: self.control,
        };
        method.transition(
            &mut self.memory,
            workspace,
            &mut extra,
            &self.impulses,
            matrix,
        )
    }

    /// What the steps so far have cost.
    #[must_use]
    pub fn statistics(&self) -> &Statistics {
        &self.memory.statistics
    }
}
