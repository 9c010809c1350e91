//! Elements of assembled problems: each is linearised about the current iterate, and its interior is condensed to its
//! two nodes (T-81).
//!
//! Periodic orbits and boundary-value problems have as unknowns the nodes y₀ … y_E of all elements and the interior
//! rates x of each element. At the current iterate, Newton's method needs
//!
//! ```text
//! y_{e+1} − A_e y_e − C_e γ = r_e ,         γ: the period, a parameter, …
//! ```
//!
//! and the interior once the nodes are known. No element is solved by itself: nodes and interiors converge together.

use alloc::vec;
use alloc::vec::Vec;

use crate::condense::{EndForces, System, phase_ends, velocity_ends};
use crate::constrained::choose::choose;
use crate::constrained::element::ConstrainedForm;
use crate::constrained::layout::Layout;
use crate::constrained::rows::Rows;
use crate::constrained::{self, check_element, linearise};
use crate::dense::DenseElement;
use crate::element::{Element, ElementError};
use crate::equations::Span;
use crate::error::{LegendreError, StepError};
use crate::legendre;
use crate::method::{Interval, Last, Memory, end_of, may_be_phase};
use crate::model::{First, Model, State};
use crate::phase_form::PhaseForm;
use crate::scheme::{SchemeTable, Tables};
use crate::statistics::Statistics;
use crate::velocity_form::VelocityForm;
use crate::workspace::{Parts, Workspace, interior_len, numbers_len, pivots_len};

pub use crate::condense::{Direction, Parameter};

/// One element of an assembled problem at the current iterate.
#[derive(Clone, Copy, Debug)]
pub struct Placed<'a, const N: usize> {
    /// Time at the start.
    pub time: f64,
    /// Length h.
    pub length: f64,
    /// The state of the first node.
    pub start: &'a State<N>,
    /// The interior rates x, [`Condenser::interior`] numbers.
    pub interior: &'a [f64],
    /// The factor γ of an additional force γ v along the velocities, which unfolds the families of periodic orbits of a
    /// conservative model; zero otherwise.
    pub damping: f64,
}

/// The memory into which a condensed element is written.
#[derive(Debug)]
pub struct Condensed<'a> {
    /// A and C and, in the last column, the difference between the end of the Newton step and A δy₀ + C δγ: 2N rows of
    /// 2N + g + 1 columns, ordered (p, q).
    pub ends: &'a mut [f64],
    /// The interior as a linear function of the nodes: one row for each of the [`Condenser::interior`] numbers, with
    /// the same columns; the last column is the Newton step of the interior itself.
    pub response: &'a mut [f64],
}

/// Linearises and condenses elements, on memory of its own. It holds no model, so that parameters may change between
/// two calls.
///
/// # Example
/// One element, solved by Newton's method, and the derivative of its end by its start.
/// ```
/// # use tfe_runtime::{CoordinateName, Facts, First, Form, Mixed, Model, Real, Second, State};
/// use tfe_runtime::condenser::{Condensed, Condenser, Placed};
///
/// # struct Oscillator;
/// # impl Model<1> for Oscillator {
/// #     const FORM: Form = Form::Lagrangian;
/// #     const FACTS: Facts = Facts::UNKNOWN;
/// #     fn energy_function<R: Real>(&self, _: R, q: &[R; 1], v: &[R; 1]) -> R {
/// #         (v[0] * v[0] - q[0] * q[0]) * R::from_f64(0.5)
/// #     }
/// #     fn first<R: Real>(&self, _: R, q: &[R; 1], v: &[R; 1], first: &mut First<R, 1>) {
/// #         (first.z, first.q) = (*v, [-q[0]]);
/// #     }
/// #     fn first_and_mass<R: Real>(
/// #         &self, t: R, q: &[R; 1], v: &[R; 1], first: &mut First<R, 1>, zz: &mut [[R; 1]; 1],
/// #     ) {
/// #         self.first(t, q, v, first);
/// #         zz[0][0] = R::from_f64(1.0);
/// #     }
/// #     fn second<R: Real>(
/// #         &self, t: R, q: &[R; 1], v: &[R; 1], first: &mut First<R, 1>, second: &mut Second<R, 1>,
/// #     ) {
/// #         self.first_and_mass(t, q, v, first, &mut second.zz);
/// #         second.qq[0][0] = R::from_f64(-1.0);
/// #     }
/// #     fn coordinate_name(_: usize) -> CoordinateName {
/// #         CoordinateName { name: "x", index: None }
/// #     }
/// # }
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let mut condenser = Condenser::<1>::new::<Oscillator>(Mixed::<4>.into())?;
/// let interior = vec![0.0; condenser.interior()];
/// let (mut ends, mut response) = ([0.0; 2 * 3], vec![0.0; 3 * interior.len()]);
/// let start = State { q: [1.0], p: [0.0] };
/// condenser.linearise(
///     &Oscillator,
///     Placed { time: 0.0, length: 0.1, start: &start, interior: &interior, damping: 0.0 },
///     &[],
///     Condensed { ends: &mut ends, response: &mut response },
/// )?;
/// // A linear model needs one step: the last column is the end, the others are A in the order (p, q).
/// let [p_by_p, _, p, _, q_by_q, q] = ends;
/// assert!((p + 0.1_f64.sin()).abs() < 1e-9 && (q - 0.1_f64.cos()).abs() < 1e-9);
/// assert!((p_by_p - 0.1_f64.cos()).abs() < 1e-9 && (q_by_q - 0.1_f64.cos()).abs() < 1e-9);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug)]
pub struct Condenser<const N: usize> {
    table: SchemeTable,
    interior: usize,
    memory: Memory<N>,
    numbers: Vec<f64>,
    pivots: Vec<usize>,
    forces: Vec<f64>,
}

impl<const N: usize> Condenser<N> {
    /// A condenser for models of one type and elements of one kind, of any length in time.
    ///
    /// # Errors
    /// [`ElementError`] if the element is invalid.
    pub fn new<M: Model<N>>(element: Element) -> Result<Self, ElementError> {
        let table = SchemeTable::new(element)?;
        Ok(Self {
            table,
            interior: interior_len(&element, M::FORM, N, M::CONSTRAINTS.len()),
            memory: Memory::new(),
            numbers: vec![0.0; numbers_len(element, M::FORM, N, M::CONSTRAINTS.len())],
            pivots: vec![0; pivots_len(element, M::FORM, N, M::CONSTRAINTS.len())],
            forces: Vec::new(),
        })
    }

    /// The number of interior unknowns of an element.
    #[must_use]
    pub fn interior(&self) -> usize {
        self.interior
    }

    /// The cost of all linearisations so far.
    #[must_use]
    pub fn statistics(&self) -> &Statistics {
        self.memory.statistics()
    }

    /// The interior rates of an element that follows a given curve, t ↦ (q, dq/dt).
    ///
    /// # Errors
    /// [`LegendreError`] where a Hamiltonian model has no momentum for a velocity.
    pub fn interpolate<M: Model<N>>(
        &self,
        model: &M,
        time: f64,
        length: f64,
        mut curve: impl FnMut(f64) -> ([f64; N], [f64; N]),
        interior: &mut [f64],
    ) -> Result<(), LegendreError> {
        let scheme = self.table.view();
        let interior = if const { M::CONSTRAINTS.is_empty() } {
            interior
        } else {
            let layout = Layout::new(&scheme.element, N, M::CONSTRAINTS.len());
            let (_, v) = curve(time + length);
            interior[layout.end(0)..layout.node(0)].copy_from_slice(&v);
            // A rod without tension exerts no force: the reactions along the curve are part of the initial guess.
            let middle = time + 0.5 * length;
            let (q, v) = curve(middle);
            let state = legendre::state(model, middle, &q, &v)?;
            let reactions = constrained::reactions(model, middle, &state, &v);
            layout.guess(
                M::CONSTRAINTS,
                scheme.nodes,
                reactions.ok().as_deref(),
                interior,
            );
            &mut interior[..layout.rates()]
        };
        let rates = interior.as_chunks_mut::<N>().0;
        if const { may_be_phase::<M, N>() } && scheme.element.has_phase_form() {
            let (forces, velocities) = rates.split_at_mut(scheme.points());
            for (k, node) in scheme.nodes.iter().enumerate() {
                let t = time + node * length;
                let (q, v) = curve(t);
                let p = legendre::momentum(model, t, &q, &v)?;
                let mut first = First::ZERO;
                model.first(t, &q, &p, &mut first);
                velocities[k] = v;
                for a in 0..N {
                    forces[k][a] = first.force[a] - first.q[a];
                }
            }
        } else {
            for (rate, node) in rates.iter_mut().zip(scheme.unknown_nodes) {
                *rate = curve(time + node * length).1;
            }
        }
        Ok(())
    }

    /// Linearises an element; with g directions the slices of `condensed` have (2N + g + 1) columns.
    ///
    /// # Errors
    /// [`StepError`] if the length is zero or not finite, a value is not finite, memory is short, or the tangent is
    /// singular.
    pub fn linearise<M: Model<N>>(
        &mut self,
        model: &M,
        placed: Placed<'_, N>,
        directions: &[Direction],
        condensed: Condensed<'_>,
    ) -> Result<(), StepError> {
        self.check(&placed, directions.len(), &condensed)?;
        let Placed {
            time,
            length,
            start,
            interior,
            damping,
        } = placed;
        let (scheme, m) = (self.table.view(), self.interior());
        self.forces
            .resize(EndForces::<N>::length(m, directions.len()), 0.0);
        let workspace = Workspace {
            numbers: &mut self.numbers,
            pivots: &mut self.pivots,
        };
        let parts = Parts::of(workspace, &scheme.element, M::FORM, M::CONSTRAINTS.len())?;
        parts.kicks.fill([0.0; N]);
        let low = State::ZERO;
        let span = Span {
            t: time,
            h: length,
            start,
            low: &low,
            kicks: &*parts.kicks,
            damping,
        };
        let mut system = System {
            tangent: parts.tangent,
            pivots: parts.tangent_pivots,
            residual: parts.step,
            sides: condensed.response,
        };
        let ends = condensed.ends;
        let end = if const { !M::CONSTRAINTS.is_empty() } {
            let element = scheme.element;
            check_element(M::CONSTRAINTS, element)?;
            parts.kept.momenta.fill(start.p);
            let mut rows = Rows::at_start(parts.rows, model, time, &start.q);
            let layout = Layout::new(&element, N, M::CONSTRAINTS.len());
            layout.mark_used(interior, parts.active);
            choose(&mut rows, model, (time, &start.q), parts.active);
            let mut form = ConstrainedForm::new(
                VelocityForm::new(
                    model,
                    (scheme, span),
                    parts.kept,
                    (&mut self.memory.mass, &mut self.memory.statistics),
                ),
                layout,
                rows,
                parts.active,
                [0.0; N],
            );
            linearise(&mut form, interior, directions, true, system, ends)?;
            form.end_state(interior)?.0
        } else if const { may_be_phase::<M, N>() } && scheme.element.has_phase_form() {
            let mut equations = PhaseForm::new(
                model,
                (scheme, span),
                parts.kept,
                &mut self.memory.statistics,
            );
            system.of_phase(&mut equations, interior, directions);
            let sides = system.with_newton_step().solve()?.sides;
            phase_ends::<N>(&scheme, length, interior, directions, sides, ends);
            let (forces, velocities) = interior.as_chunks().0.split_at(scheme.points());
            end_of(&scheme, &span, velocities, forces, &[]).0
        } else {
            parts.kept.momenta.fill(start.p);
            let mut equations = VelocityForm::new(
                model,
                (scheme, span),
                parts.kept,
                (&mut self.memory.mass, &mut self.memory.statistics),
            );
            let mut forces = EndForces::of(&mut self.forces, m);
            system.of_velocities(&mut equations, interior, directions, &mut forces)?;
            let sides = system.with_newton_step().solve()?.sides;
            velocity_ends(&scheme, length, interior, directions, &forces, sides, ends);
            end_of(
                &scheme,
                &span,
                interior.as_chunks().0,
                equations.forces,
                &[],
            )
            .0
        };
        self.memory.statistics.factorizations += 1;
        add_end(&end, ends)
    }

    /// Refuses a length that is zero or not finite, and memory of other sizes than a number of directions needs.
    fn check(
        &self,
        placed: &Placed<'_, N>,
        directions: usize,
        condensed: &Condensed<'_>,
    ) -> Result<(), StepError> {
        let step = placed.length;
        if !(step.is_finite() && step != 0.0) {
            return Err(StepError::InvalidStep { step });
        }
        let m = self.interior();
        let columns = 2 * N + directions + 1;
        let Condensed { response, ends } = condensed;
        if placed.interior.len() == m
            && response.len() == columns * m
            && ends.len() == 2 * N * columns
        {
            return Ok(());
        }
        let given = response.len().min(ends.len() * m.max(2 * N) / (2 * N));
        let needed = columns * m.max(2 * N);
        Err(StepError::Workspace { needed, given })
    }

    /// The polynomial of the element linearised last, from its first node to the node at time `next` with the state
    /// `end`.
    #[must_use]
    pub fn dense<M: Model<N>>(
        &self,
        placed: Placed<'_, N>,
        next: f64,
        end: &State<N>,
    ) -> DenseElement<N> {
        let scheme = self.table.view();
        let m = self.interior;
        if const { !M::CONSTRAINTS.is_empty() } {
            let points = scheme.points() * N;
            // The workspace begins with the unknowns, their start, the increments and the forces.
            let momenta = &self.numbers[3 * m + points..3 * m + 2 * points];
            let rates = &placed.interior[..scheme.unknowns() * N];
            let ends = (placed.start, end);
            let (rates, momenta) = (rates.as_chunks().0, momenta.as_chunks().0);
            return DenseElement::constrained(
                &scheme,
                (placed.time, next),
                placed.length,
                ends,
                rates,
                momenta,
            );
        }
        let rates = placed.interior.as_chunks().0;
        let (rates, forces) = if const { may_be_phase::<M, N>() } && scheme.element.has_phase_form()
        {
            let (forces, velocities) = rates.split_at(scheme.points());
            (velocities, forces)
        } else {
            // The workspace begins with the unknowns, their start and the increments.
            let forces = &self.numbers[3 * m..3 * m + scheme.points() * N];
            (rates, forces.as_chunks().0)
        };
        let interval = Interval {
            start: placed.time,
            length: placed.length,
            impulses: &[],
        };
        let last = Last {
            t: placed.time,
            h: placed.length,
            start: *placed.start,
            start_low: State::ZERO,
            end: *end,
        };
        DenseElement::of(
            &scheme,
            (placed.time, next),
            &last,
            rates,
            forces,
            &interval,
            None,
        )
    }
}

/// Adds the end of the element to the last column.
///
/// # Errors
/// [`StepError::NonFinite`] if an entry is not finite.
fn add_end<const N: usize>(end: &State<N>, ends: &mut [f64]) -> Result<(), StepError> {
    let columns = ends.len() / (2 * N);
    let mut sum = 0.0;
    for (row, value) in ends
        .chunks_exact_mut(columns)
        .zip(end.p.iter().chain(&end.q))
    {
        row[columns - 1] += value;
        sum += row.iter().map(|entry| 0.0 * entry).sum::<f64>();
    }
    // Infinities and NaN do not sum to zero.
    if sum == 0.0 {
        Ok(())
    } else {
        Err(StepError::NonFinite)
    }
}

impl System<'_> {
    /// Replaces the last right-hand side by that of the Newton step of the interior.
    fn with_newton_step(self) -> Self {
        let rows = self
            .sides
            .chunks_exact_mut(self.sides.len() / self.residual.len());
        for (row, residual) in rows.zip(&*self.residual) {
            if let Some(last) = row.last_mut() {
                *last = -residual;
            }
        }
        self
    }
}
