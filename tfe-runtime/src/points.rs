//! All points of an element at once, four to a register: the fixed-point iteration of smooth steps.
//!
//! The same equations as those of the other forms, for elements that are Runge–Kutta methods with K points, coefficients A, b, c:
//!
//! ```text
//! second order   M q̈ = f(q, t):   q_l = q₀ + h Σ A_lj v₀ + h² Σ (A²)_lj M⁻¹ f_j ,          unknown f
//! velocities     p = L_v:         q_l = q₀ + h Σ A_lj v_j ,  p_l = p₀ + h Σ A_lj f_j ,     unknown v
//! phase space    v = H_p:         the same with v_j = H_p(q_j, p_j),                       unknown v and f
//! ```
//!
//! Where kinetic energy is a constant quadratic form of the velocities alone, the first serves and one product with a matrix does for two. What
//! rounding took from the tables is summed once a step, at the start of the iteration. A step whose iteration contracts badly is left to
//! the other forms.

pub(crate) mod end;
pub(crate) mod four;
mod second_order;
mod step;
pub(crate) mod sweep;
pub(crate) mod tables;

use crate::double_double::DoubleDouble;
use crate::element::Element;
use crate::lu::Block;
use crate::model::{First, Form, Model, State};
use crate::newton::Control;
use crate::scheme::{SchemeRef, SchemeTable};
use crate::step::{cold_rate, cold_rates};
use alloc::vec;
use alloc::vec::Vec;
use step::Job;
use tables::Tables;

/// A number for every coordinate at each of four points.
type Row<const N: usize> = [[f64; 4]; N];

/// The unknowns of an element and everything that their iteration needs: rows for groups of four points.
#[derive(Clone, Debug)]
pub(crate) struct Points<const N: usize> {
    tables: Tables,
    /// L_q + Q, or π: rates of the momenta.
    forces: Vec<Row<N>>,
    /// ν, or κ: rates of the coordinates.
    /// In equations of second order only where somebody has asked for them.
    rates: Vec<Row<N>>,
    momenta: Vec<Row<N>>,
    velocities: Vec<Row<N>>,
    /// Products with the tables.
    products: Vec<Row<N>>,
    more_products: Vec<Row<N>>,
    /// How far the velocity at the start reaches, in equations of second order.
    drift: Vec<Row<N>>,
    /// What low words of state and tables add at the points.
    low_position: Vec<Row<N>>,
    low_momentum: Vec<Row<N>>,
    /// Factors of L_vv, or H_pp, where they are not constant.
    masses: Vec<[Row<N>; N]>,
    inertia: Inertia<N>,
    velocity_low: [f64; N],
    velocity: [f64; N],
    /// The largest coordinate at the start, and the largest velocity or momentum.
    distance: f64,
    speed: f64,
    /// The end of the last step, and what rounding took from it.
    pub(crate) end: State<N>,
    pub(crate) end_low: State<N>,
    is_warm: bool,
    last_step: f64,
    #[cfg(all(feature = "simd", target_arch = "x86_64"))]
    isa: Option<pulp::x86::V3>,
}

/// A constant mass matrix.
#[derive(Clone, Debug)]
pub(crate) struct Inertia<const N: usize> {
    /// Its diagonal, if it has nothing else.
    pub(crate) diagonal: Option<[f64; N]>,
    /// The diagonal of the inverse; ones where that is not constant.
    pub(crate) inverse_diagonal: [f64; N],
    /// What rounding took from the inverse of the diagonal.
    pub(crate) inverse_low: [f64; N],
    /// M⁻¹ (or H_pp), row by row; nothing where it is not constant, or diagonal.
    pub(crate) inverse: Vec<[f64; N]>,
}

/// Where and from where.
#[derive(Clone, Copy)]
pub(crate) struct Leg<'a, const N: usize> {
    pub(crate) t: f64,
    pub(crate) h: f64,
    pub(crate) start: &'a State<N>,
    pub(crate) low: &'a State<N>,
}

/// What has come of a step.
pub(crate) struct Outcome {
    /// The iteration has converged: the end of the step is there.
    pub(crate) arrived: bool,
    pub(crate) iterations: u32,
    /// The last increment, relative, and its ratio to that before.
    pub(crate) residual: f64,
    pub(crate) contraction: f64,
}

impl<const N: usize> Points<N> {
    /// For a nonlinear model without constraints, and an element that is a Runge–Kutta method of no more than 16 points.
    pub(crate) fn new<M>(model: &M, scheme: &SchemeRef<'_>) -> Option<Self>
    where
        M: Model<N>,
    {
        let element = &scheme.element;
        let is_large = scheme.points() > 4 * tables::MAX_GROUPS;
        if N == 0 || is_large || !has_form::<M, N>(element) {
            return None;
        }
        let inertia = Inertia::of(model)?;
        let tables = Tables::of(scheme);
        let groups = tables.groups;
        // Short runs notice how much memory is asked for.
        let rows = |if_needed: bool| vec![[[0.0; 4]; N]; if if_needed { groups } else { 0 }];
        let is_second = is_second_order::<M, N>();
        let varied = if M::FACTS.constant_mass { 0 } else { groups };
        Some(Self {
            forces: rows(true),
            rates: rows(!is_second),
            momenta: rows(!is_second),
            velocities: rows(is_phase::<M, N>()),
            products: rows(true),
            more_products: rows(true),
            drift: rows(is_second),
            low_position: rows(!is_second),
            low_momentum: rows(!is_second),
            masses: vec![[[[0.0; 4]; N]; N]; varied],
            tables,
            inertia,
            velocity_low: [0.0; N],
            velocity: [0.0; N],
            distance: 0.0,
            speed: 0.0,
            end: State::ZERO,
            end_low: State::ZERO,
            is_warm: false,
            last_step: 0.0,
            #[cfg(all(feature = "simd", target_arch = "x86_64"))]
            isa: if M::LANES {
                pulp::x86::V3::try_new()
            } else {
                None
            },
        })
    }

    /// At how many points the model is evaluated.
    pub(crate) fn len(&self) -> usize {
        self.tables.points
    }

    /// Says that the next step does not continue the last one.
    pub(crate) fn forget(&mut self) {
        self.is_warm = false;
    }

    /// The end of a step.
    pub(crate) fn advance<M>(
        &mut self,
        model: &M,
        table: &SchemeTable,
        control: &Control,
        leg: Leg<'_, N>,
        yielding: bool,
    ) -> Outcome
    where
        M: Model<N>,
    {
        if self.is_warm {
            self.tables.set_ratio(table, leg.h / self.last_step);
        } else {
            self.start_cold(model, &leg);
        }
        self.last_step = leg.h;
        let job = Job {
            points: self,
            model,
            control,
            leg,
            yielding,
        };
        let outcome = job.run();
        self.is_warm = outcome.arrived;
        outcome
    }

    /// Constant rates.
    #[cold]
    fn start_cold<M>(&mut self, model: &M, leg: &Leg<'_, N>)
    where
        M: Model<N>,
    {
        let (force, rate) = constant_rates(model, leg.t, leg.start);
        for a in 0..N {
            (self.forces.iter_mut()).for_each(|forces| forces[a] = [force[a]; 4]);
            (self.rates.iter_mut()).for_each(|rates| rates[a] = [rate[a]; 4]);
        }
    }

    /// Rates of coordinates and momenta at the points of the last step, a row of N for each point.
    pub(crate) fn unknowns<M>(&mut self, h: f64, rates: &mut [f64], forces: &mut [f64])
    where
        M: Model<N>,
    {
        if is_second_order::<M, N>() {
            self.set_rates(h);
        }
        for l in 0..self.tables.points {
            let (group, lane) = (l / 4, l % 4);
            for a in 0..N {
                rates[l * N + a] = self.rates[group][a][lane];
                forces[l * N + a] = self.forces[group][a][lane];
            }
        }
    }
}

/// Rates of momenta and coordinates at the start, for a first iteration that continues nothing; those of momenta are zero where they are no unknowns.
pub(crate) fn constant_rates<M, const N: usize>(
    model: &M,
    t: f64,
    start: &State<N>,
) -> ([f64; N], [f64; N])
where
    M: Model<N>,
{
    if const { is_phase::<M, N>() } {
        return cold_rates(model, t, start);
    }
    let (mut force, rate) = ([0.0; N], cold_rate(model, t, start));
    if const { is_second_order::<M, N>() } {
        let mut first = First::ZERO;
        model.first(t, &start.q, &rate, &mut first);
        for a in 0..N {
            force[a] = first.q[a] + first.force[a];
        }
    }
    (force, rate)
}

impl<const N: usize> Inertia<N> {
    /// M⁻¹ of a model, empty unless its mass matrix is constant; nothing if that is singular, or if momenta are no multiples of velocities
    /// where they have to be.
    pub(crate) fn of<M>(model: &M) -> Option<Self>
    where
        M: Model<N>,
    {
        if !M::FACTS.constant_mass {
            return Some(Self {
                diagonal: None,
                inverse_diagonal: [1.0; N],
                inverse_low: [0.0; N],
                inverse: Vec::new(),
            });
        }
        let (mut first, mut mass) = (First::ZERO, [[0.0; N]; N]);
        model.first_and_mass(0.0, &[0.0; N], &[0.0; N], &mut first, &mut mass);
        if is_second_order::<M, N>() && first.z != [0.0; N] {
            return None;
        }
        if let Some(diagonal) = diagonal_of(&mass) {
            return Self::of_diagonal(diagonal, M::FORM);
        }
        let inverse = Block::of(&mass).ok()?.inverse();
        let inverse = match M::FORM {
            Form::Lagrangian => inverse,
            Form::Hamiltonian => mass,
        };
        let mut inverse_diagonal = [0.0; N];
        for a in 0..N {
            inverse_diagonal[a] = inverse[a][a];
        }
        Some(Self {
            diagonal: None,
            inverse_diagonal,
            inverse_low: [0.0; N],
            inverse: inverse.to_vec(),
        })
    }

    /// From the diagonal of L_vv or H_pp; nothing if a mass is zero, infinite or no number.
    fn of_diagonal(given: [f64; N], form: Form) -> Option<Self> {
        let (mut masses, mut inverse, mut inverse_low) = ([0.0; N], [0.0; N], [0.0; N]);
        for a in 0..N {
            let reciprocal = 1.0 / given[a];
            if !(given[a].is_finite() && reciprocal.is_finite()) {
                return None;
            }
            (masses[a], inverse[a]) = match form {
                Form::Lagrangian => (given[a], reciprocal),
                Form::Hamiltonian => (reciprocal, given[a]),
            };
            let exact = DoubleDouble::ONE.over(DoubleDouble::new(masses[a]));
            inverse_low[a] = exact.minus(DoubleDouble::new(inverse[a])).high;
        }
        Some(Self {
            diagonal: Some(masses),
            inverse_diagonal: inverse,
            inverse_low,
            inverse: Vec::new(),
        })
    }
}

/// The diagonal of a matrix that has nothing else.
fn diagonal_of<const N: usize>(matrix: &[[f64; N]; N]) -> Option<[f64; N]> {
    let mut diagonal = [0.0; N];
    for a in 0..N {
        diagonal[a] = matrix[a][a];
        for b in 0..N {
            if a != b && matrix[a][b] != 0.0 {
                return None;
            }
        }
    }
    Some(diagonal)
}

/// Whether the equations are M q̈ = f.
pub(crate) const fn is_second_order<M, const N: usize>() -> bool
where
    M: Model<N>,
{
    M::FACTS.constant_mass && M::FACTS.separable && !M::FACTS.time_dependent
}

/// Whether rates of momenta are unknowns as well.
pub(crate) const fn is_phase<M, const N: usize>() -> bool
where
    M: Model<N>,
{
    matches!(M::FORM, Form::Hamiltonian)
}

/// Whether the element is a Runge–Kutta method for the model as it was declared.
pub(crate) fn has_form<M, const N: usize>(element: &Element) -> bool
where
    M: Model<N>,
{
    match M::FORM {
        Form::Lagrangian => element.is_collocated(),
        Form::Hamiltonian => element.has_phase_form(),
    }
}

/// The largest magnitude.
#[inline(always)]
fn largest<const N: usize>(numbers: &[f64; N]) -> f64 {
    let mut largest = 0.0;
    for a in 0..N {
        let size = numbers[a].abs();
        largest = if largest < size { size } else { largest };
    }
    largest
}

fn is_finite<const N: usize>(state: &State<N>) -> bool {
    let mut zero = 0.0;
    for a in 0..N {
        // Zero times what is not finite is a NaN.
        zero += 0.0 * state.q[a] + 0.0 * state.p[a];
    }
    zero == 0.0
}

#[cfg(all(test, feature = "simd", target_arch = "x86_64"))]
pub(crate) mod tests {
    use super::*;
    use crate::bundle::Pendulums;
    use crate::model::{CoordinateName, Facts, Second};
    use crate::real::Real;
    use crate::scheme::Tables as _;
    use crate::{Mixed, Radau};

    /// Two bodies, an angle, a force: products, quotients, roots, sines.
    pub(crate) struct Planet;

    impl Model<3> for Planet {
        const FORM: Form = Form::Lagrangian;
        const FACTS: Facts = Facts {
            time_dependent: true,
            forced: true,
            quadratic_in_z: true,
            constant_mass: false,
            linear: false,
            separable: false,
            smooth: true,
        };
        const LANES: bool = true;

        fn energy_function<R: Real>(&self, _: R, _: &[R; 3], v: &[R; 3]) -> R {
            v[0]
        }

        fn first<R: Real>(&self, t: R, q: &[R; 3], v: &[R; 3], first: &mut First<R, 3>) {
            self.first_inline(t, q, v, first);
        }

        fn first_and_mass<R: Real>(
            &self,
            t: R,
            q: &[R; 3],
            v: &[R; 3],
            first: &mut First<R, 3>,
            zz: &mut [[R; 3]; 3],
        ) {
            self.first_and_mass_inline(t, q, v, first, zz);
        }

        #[inline(always)]
        fn first_inline<R: Real>(&self, t: R, q: &[R; 3], v: &[R; 3], first: &mut First<R, 3>) {
            let square = q[0] * q[0] + q[1] * q[1];
            let cube = square * square.sqrt();
            let (sin, cos) = q[2].sin_cos();
            let inertia = R::from_f64(2.0) + cos;
            first.z = [v[0], v[1], inertia * v[2]];
            first.q[0] = -(q[0] / cube);
            first.q[1] = -(q[1] / cube);
            first.q[2] = -(sin * v[2] * v[2] * t.like(0.5));
            first.force[2] = (t + q[0]).cos() - v[2].abs().min(q[1].powi(-2)) * t.like(0.1);
        }

        #[inline(always)]
        fn first_and_mass_inline<R: Real>(
            &self,
            t: R,
            q: &[R; 3],
            v: &[R; 3],
            first: &mut First<R, 3>,
            zz: &mut [[R; 3]; 3],
        ) {
            self.first_inline(t, q, v, first);
            (zz[0][0], zz[1][1]) = (t.like(1.0), t.like(1.0));
            zz[2][2] = t.like(2.0) + q[2].cos();
        }

        fn second<R: Real>(
            &self,
            t: R,
            q: &[R; 3],
            v: &[R; 3],
            first: &mut First<R, 3>,
            second: &mut Second<R, 3>,
        ) {
            self.first_and_mass(t, q, v, first, &mut second.zz);
        }

        fn coordinate_name(_: usize) -> CoordinateName {
            CoordinateName::single("q")
        }
    }

    /// Two hundred steps with and without registers; `turn` changes a state on the way.
    fn has_the_same_bits<M, const N: usize>(
        model: &M,
        start: State<N>,
        turn: impl Fn(i32, &mut State<N>),
    ) where
        M: Model<N>,
    {
        for element in [Mixed::<4>.into(), Mixed::<9>.into(), Radau::<11>.into()] {
            let table = SchemeTable::new(element).unwrap();
            let with = Points::new(model, &table.view()).unwrap();
            if with.isa.is_none() {
                return; // Nothing to compare with on this processor.
            }
            let mut without = with.clone();
            without.isa = None;
            for tolerance in [Control::default().tolerance, 1e-9] {
                let control = Control {
                    tolerance,
                    ..Control::default()
                };
                let ends = [&with, &without].map(|points| {
                    let (mut points, mut state, mut low) = (points.clone(), start, State::ZERO);
                    for step in 0..200 {
                        let leg = Leg {
                            t: 0.02 * f64::from(step),
                            h: 0.02,
                            start: &state,
                            low: &low,
                        };
                        let outcome = points.advance(model, &table, &control, leg, true);
                        assert!(outcome.arrived);
                        (state, low) = (points.end, points.end_low);
                        turn(step, &mut state);
                    }
                    (state, low)
                });
                assert_eq!(ends[0], ends[1], "{element}, {tolerance:.0e}");
                assert!(ends[0].0.q[0].is_finite());
            }
        }
    }

    #[test]
    fn every_processor_gives_the_same_bits() {
        let start = State {
            q: [0.4, 0.0, 2e5],
            p: [0.0, 2.0, 0.3],
        };
        // The angle begins where sines of the system are taken, and comes back.
        has_the_same_bits(&Planet, start, |step, state| {
            state.q[2] = if step == 100 { 1.0 } else { state.q[2] };
        });
        let start = State {
            q: [1.0, -2.0],
            p: [0.5, 4.0],
        };
        has_the_same_bits(&Pendulums, start, |_, _| {});
    }
}
