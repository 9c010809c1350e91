//! Maps of the largest Floquet multiplier about the rest state.

use super::{FloquetError, MapError, MapPlan, StabilityMap};
use crate::numbers::{larger, largest};
use crate::stability::{eigenvalues, largest_modulus};
use nalgebra::DMatrix;
use tfe_runtime::scheme::{SchemeTable, Tables};
use tfe_runtime::step::{Control, Interval, Memory, Method, Solve};
use tfe_runtime::workspace::{Workspace, numbers_len, pivots_len, transition_len};
use tfe_runtime::{Element, Model, State, StepError};

impl MapPlan {
    /// The map of the largest modulus of the Floquet multipliers about the rest state q = 0, p = 0; rest is unstable
    /// where it is greater than one (as in the Ince–Strutt diagram of Mathieu's equation).
    ///
    /// `model` makes the model for a point (x, y); its coefficients have the period T. With A_k the transition matrix
    /// of the k-th of the elements, each of length T/`elements`, the multipliers are the eigenvalues λ of the
    /// monodromy matrix,
    ///
    /// ```text
    /// Φ = A_K … A_2 A_1 ,     ρ = max |λ(Φ)| .                    (theory.md (T-83))
    /// ```
    ///
    /// For a model whose coefficients are constant, any T will do: ρ is then e^{σT}, with σ the largest growth rate.
    /// Rest must be an equilibrium of the model; if a force moves it, the point fails with
    /// [`FloquetError::NotAtRest`]. If Φ has an entry beyond 10³⁰⁸, the point fails with
    /// [`FloquetError::Eigenvalues`].
    ///
    /// # Errors
    /// [`MapError::Element`] or [`MapError::Period`] for an element or a period that is invalid, and those of
    /// [`MapPlan::run`].
    ///
    /// ```
    /// use tfe::prelude::*;
    /// use tfe::stability::StabilityMap;
    ///
    /// // Mathieu: y'' + (a − 2q cos 2t) y = 0.
    /// #[dynamics(coordinates(y), lagrangian = dot(y)^2/2 - (a - 2*q*cos(2*t))*y^2/2)]
    /// struct Mathieu { a: f64, q: f64 }
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// let map = StabilityMap::over(0.0..5.0, 0.0..2.0)
    ///     .resolution(50, 20)
    ///     .labels("a", "q")
    ///     .title("Ince–Strutt diagram")
    ///     .floquet(|a, q| Mathieu { a, q }, std::f64::consts::PI, Mixed::<4>, 8)?;
    /// assert!(map.radius_at(1.0, 0.5).unwrap() > 2.0); // in the first tongue, from 0.47 to 1.47
    /// assert!(map.radius_at(2.0, 0.5).unwrap() < 1.0 + 1e-9);
    /// # Ok(())
    /// # }
    /// ```
    pub fn floquet<M, F, const N: usize>(
        &self,
        model: F,
        period: f64,
        element: impl Into<Element>,
        elements: usize,
    ) -> Result<StabilityMap<FloquetError>, MapError>
    where
        M: Model<N>,
        F: Fn(f64, f64) -> M + Sync,
    {
        self.check()?;
        let tables = SchemeTable::new(element.into()).map_err(MapError::Element)?;
        let is_length = period > 0.0 && (period / elements as f64).is_normal();
        if !(is_length && (1..=MAX_ELEMENTS).contains(&elements)) {
            return Err(MapError::Period { period, elements });
        }
        let period = Period { period, elements };
        Ok(self.computed(
            || Monodromy::new::<M>(&tables),
            |monodromy, x, y| monodromy.radius(&model(x, y), period),
        ))
    }
}

/// The largest number of elements of a period: with more, a single cell would take minutes.
const MAX_ELEMENTS: usize = 10_000_000;

/// Stops after the first increment, which solves the equations linearised at rest.
const ONCE: Control = Control {
    tolerance: f64::INFINITY,
    max_iterations: 1,
    solve: Solve::Newton,
};

#[derive(Clone, Copy)]
struct Period {
    period: f64,
    elements: usize,
}

impl Period {
    fn time(self, element: usize) -> f64 {
        self.period * (element as f64 / self.elements as f64)
    }
}

/// The workspace of monodromy matrices.
struct Monodromy<'a, const N: usize> {
    tables: &'a SchemeTable,
    numbers: Vec<f64>,
    pivots: Vec<usize>,
    extra: Vec<f64>,
    /// The transition matrix of one element, row by row.
    factor: Vec<f64>,
    /// The product of the matrices so far, row by row.
    product: Vec<f64>,
    /// One column of the product.
    column: Vec<f64>,
}

impl<'a, const N: usize> Monodromy<'a, N> {
    fn new<M: Model<N>>(tables: &'a SchemeTable) -> Self {
        let element = tables.view().element;
        Self {
            tables,
            numbers: vec![0.0; numbers_len(element, M::FORM, N, M::CONSTRAINTS.len())],
            pivots: vec![0; pivots_len(element, M::FORM, N, M::CONSTRAINTS.len())],
            extra: vec![0.0; transition_len(element, M::FORM, N, M::CONSTRAINTS.len())],
            factor: vec![0.0; 4 * N * N],
            product: vec![0.0; 4 * N * N],
            column: vec![0.0; 2 * N],
        }
    }

    /// The largest multiplier, max |λ(Φ)|, of a model.
    fn radius<M: Model<N>>(&mut self, model: &M, period: Period) -> Result<f64, FloquetError> {
        self.compute(model, period)?;
        let matrix = DMatrix::from_row_slice(2 * N, 2 * N, &self.product);
        let multipliers = eigenvalues(&matrix).map_err(FloquetError::Eigenvalues)?;
        Ok(largest_modulus(&multipliers))
    }

    fn compute<M: Model<N>>(&mut self, model: &M, period: Period) -> Result<(), FloquetError> {
        if model.check().is_err() {
            let (element, source) = (0, StepError::Inconsistent);
            return Err(FloquetError::Step { element, source });
        }
        let method = Method {
            model,
            tables: self.tables,
            control: Control::default(),
        };
        let once = Method {
            model,
            tables: self.tables,
            control: ONCE,
        };
        let mut memory = Memory::new();
        self.set_identity();
        for element in 0..period.elements {
            let t = period.time(element);
            let interval = Interval {
                start: t,
                length: period.time(element + 1) - t,
                impulses: &[],
            };
            let mut state = State {
                q: [0.0; N],
                p: [0.0; N],
            };
            let mut advanced = method.advance(&mut memory, self.workspace(), interval, &mut state);
            if let Err(StepError::NewtonStalled { .. } | StepError::Unproven { .. }) = advanced {
                // Rounding errors of forces in balance may prevent convergence. A single linear solution then shows
                // their effect.
                let again = once.advance(&mut memory, self.workspace(), interval, &mut state);
                advanced = again.or(advanced);
            }
            advanced.map_err(|source| FloquetError::Step { element, source })?;
            let workspace = Workspace {
                numbers: &mut self.numbers,
                pivots: &mut self.pivots,
            };
            method
                .transition(
                    &mut memory,
                    workspace,
                    &mut self.extra,
                    &[],
                    &mut self.factor,
                )
                .map_err(|source| FloquetError::Transition { element, source })?;
            check_rest(element, &state, &self.factor)?;
            self.multiply();
        }
        Ok(())
    }

    fn workspace(&mut self) -> Workspace<'_> {
        Workspace {
            numbers: &mut self.numbers,
            pivots: &mut self.pivots,
        }
    }

    fn set_identity(&mut self) {
        self.product.fill(0.0);
        for entry in self.product.iter_mut().step_by(2 * N + 1) {
            *entry = 1.0;
        }
    }

    /// Multiplies from the left: product ← factor · product.
    fn multiply(&mut self) {
        let size = 2 * N;
        for j in 0..size {
            for (i, row) in self.factor.chunks_exact(size).enumerate() {
                self.column[i] = (0..size).map(|k| row[k] * self.product[k * size + j]).sum();
            }
            for i in 0..size {
                self.product[i * size + j] = self.column[i];
            }
        }
    }
}

/// Refuses the rest state if an element moves it by more than the rounding error of coordinates of order one.
///
/// Momenta have other units: they are measured by the displacements that they cause in another element, by its
/// transition matrix.
fn check_rest<const N: usize>(
    element: usize,
    state: &State<N>,
    transition: &[f64],
) -> Result<(), FloquetError> {
    const ROUNDING: f64 = 1e-12;
    let to_coordinates = transition.chunks_exact(2 * N).skip(N);
    let by_momenta = to_coordinates.map(|row| {
        let products = row.iter().zip(&state.p).map(|(entry, p)| entry * p);
        products.sum::<f64>()
    });
    let all = state.q.iter().copied().chain(by_momenta);
    let moved = all.fold(0.0, |most, x| larger(most, x.abs()));
    if moved <= ROUNDING {
        return Ok(());
    }
    let distance = larger(largest(&state.q), largest(&state.p));
    Err(FloquetError::NotAtRest { element, distance })
}
