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
pub(crate) mod sweep;
pub(crate) mod tables;

use crate::double_double::DoubleDouble;
use crate::element::Element;
use crate::lu::Block;
use crate::model::{First, Form, Model, State};
use crate::newton::{Control, Monitor, PATIENCE, Verdict};
use crate::scheme::{SchemeRef, SchemeTable, Tables as _};
use crate::step::{cold_phase, cold_velocity};
use alloc::vec;
use alloc::vec::Vec;
use four::Four;
use tables::Tables;

/// Values at all points: for each coordinate a row of groups of four points.
type Rows = Vec<[f64; 4]>;

/// The unknowns of an element and everything that their iteration needs.
#[derive(Clone, Debug)]
pub(crate) struct Points<const N: usize> {
    tables: Tables,
    /// L_q + Q, or π: rates of the momenta.
    forces: Rows,
    /// ν, or κ: rates of the coordinates.
    rates: Rows,
    /// Momenta; accelerations in the equations of second order.
    momenta: Rows,
    velocities: Rows,
    /// Products with the tables.
    products: Rows,
    more_products: Rows,
    /// What low words of state and tables add at the points.
    low_position: Rows,
    low_momentum: Rows,
    /// Factors of L_vv, or H_pp, a group each, where they are not constant.
    masses: Vec<[[[f64; 4]; N]; N]>,
    inertia: Inertia<N>,
    velocity_low: [f64; N],
    velocity: [f64; N],
    /// Scratch of cold starts.
    cold: Vec<f64>,
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
    /// What rounding took from the inverse of the diagonal.
    pub(crate) inverse_low: [f64; N],
    /// M⁻¹ (or H_pp), row by row; nothing where it is not constant.
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
pub(crate) struct Outcome<const N: usize> {
    /// End and what rounding took from it, if the iteration has converged.
    pub(crate) end: Option<(State<N>, State<N>)>,
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
        let tables = Tables::new(scheme);
        let groups = tables.groups;
        let rows = || vec![[0.0; 4]; N * groups];
        let varied = if M::FACTS.constant_mass { 0 } else { groups };
        Some(Self {
            tables,
            forces: rows(),
            rates: rows(),
            momenta: rows(),
            velocities: rows(),
            products: rows(),
            more_products: rows(),
            low_position: rows(),
            low_momentum: rows(),
            masses: vec![[[[0.0; 4]; N]; N]; varied],
            inertia,
            velocity_low: [0.0; N],
            velocity: [0.0; N],
            cold: vec![0.0; 2 * scheme.points() * N],
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
    ) -> Outcome<N>
    where
        M: Model<N>,
    {
        if self.is_warm {
            self.tables.set_ratio(table, leg.h / self.last_step);
        } else {
            self.start_cold(model, &table.view(), &leg);
        }
        self.last_step = leg.h;
        let outcome = self.dispatch(model, control, leg, yielding);
        self.is_warm = outcome.end.is_some();
        outcome
    }

    #[cfg(all(feature = "simd", target_arch = "x86_64"))]
    fn dispatch<M>(
        &mut self,
        model: &M,
        control: &Control,
        leg: Leg<'_, N>,
        yielding: bool,
    ) -> Outcome<N>
    where
        M: Model<N>,
    {
        struct Job<'a, M, const N: usize> {
            points: &'a mut Points<N>,
            model: &'a M,
            control: &'a Control,
            leg: Leg<'a, N>,
            yielding: bool,
            isa: pulp::x86::V3,
        }
        impl<M: Model<N>, const N: usize> pulp::NullaryFnOnce for Job<'_, M, N> {
            type Output = Outcome<N>;
            #[inline(always)]
            fn call(self) -> Outcome<N> {
                let like = crate::quad::Quad::of(self.isa, [0.0; 4]);
                let Self { model, control, .. } = self;
                (self.points).step(like, model, control, self.leg, self.yielding)
            }
        }
        match self.isa {
            // Without kernels for lanes the constant is false, and the compiler drops the call.
            Some(isa) if M::LANES => isa.vectorize(Job {
                points: self,
                model,
                control,
                leg,
                yielding,
                isa,
            }),
            _ => self.step(crate::Lanes([0.0; 4]), model, control, leg, yielding),
        }
    }

    #[cfg(not(all(feature = "simd", target_arch = "x86_64")))]
    fn dispatch<M>(
        &mut self,
        model: &M,
        control: &Control,
        leg: Leg<'_, N>,
        yielding: bool,
    ) -> Outcome<N>
    where
        M: Model<N>,
    {
        self.step(crate::Lanes([0.0; 4]), model, control, leg, yielding)
    }

    /// The whole step.
    #[inline(always)]
    fn step<V: Four, M>(
        &mut self,
        like: V,
        model: &M,
        control: &Control,
        leg: Leg<'_, N>,
        yielding: bool,
    ) -> Outcome<N>
    where
        M: Model<N>,
    {
        // Constant conditions, so that of the three iterations one is compiled.
        if self.is_warm {
            if const { is_second_order::<M, N>() || is_phase::<M, N>() } {
                self.tables
                    .continued
                    .apply(like, &self.forces, &mut self.products);
                core::mem::swap(&mut self.forces, &mut self.products);
            }
            if const { !is_second_order::<M, N>() } {
                self.tables
                    .continued
                    .apply(like, &self.rates, &mut self.products);
                core::mem::swap(&mut self.rates, &mut self.products);
            }
        }
        if const { is_second_order::<M, N>() } {
            self.begin_second_order(like, &leg);
        } else {
            self.begin(like, &leg);
        }
        let mut monitor = Monitor::new(control.tolerance);
        let most = if yielding {
            control.max_iterations.min(PATIENCE)
        } else {
            control.max_iterations
        };
        let (mut iterations, mut refresh, mut converged) = (0, true, false);
        while iterations < most {
            let increment = if const { is_second_order::<M, N>() } {
                self.sweep_second_order::<V, M>(like, model, &leg)
            } else if const { is_phase::<M, N>() } {
                self.sweep_phase::<V, M>(like, model, &leg, iterations == 0, refresh)
            } else {
                self.sweep_velocity::<V, M>(like, model, &leg, refresh)
            };
            iterations += 1;
            match monitor.judge(increment) {
                Ok(Verdict::Converged) => {
                    converged = true;
                    break;
                }
                Ok(Verdict::GoOn) => {}
                Err(_) => break,
            }
            // The start is good to a few digits, so one evaluation of mass matrices mostly serves.
            refresh = monitor.rate() > 0.1;
            if yielding && iterations > 2 && monitor.is_hopeless(most - iterations + 1) {
                break;
            }
        }
        // No closures here: they would be compiled for the instruction set of the crate, not for that of the place of the call.
        let mut end = None;
        if converged {
            let reached = if const { is_second_order::<M, N>() } {
                self.end_second_order(like, &leg)
            } else {
                self.end(like, &leg)
            };
            if is_finite(&reached.0) {
                end = Some(reached);
            }
        }
        Outcome {
            end,
            iterations,
            residual: monitor.last(),
            contraction: monitor.rate(),
        }
    }

    /// Constant rates.
    #[cold]
    fn start_cold<M>(&mut self, model: &M, scheme: &SchemeRef<'_>, leg: &Leg<'_, N>)
    where
        M: Model<N>,
    {
        let (points, groups) = (self.tables.points, self.tables.groups);
        let unknowns = &mut self.cold;
        let (mut force, mut rate) = ([0.0; N], [0.0; N]);
        if matches!(M::FORM, Form::Hamiltonian) {
            cold_phase(model, scheme, leg.t, leg.start, unknowns);
            force.copy_from_slice(&unknowns[..N]);
            rate.copy_from_slice(&unknowns[points * N..][..N]);
        } else {
            cold_velocity(model, leg.t, leg.start, unknowns);
            rate.copy_from_slice(&unknowns[..N]);
            if is_second_order::<M, N>() {
                let mut first = First::ZERO;
                model.first(leg.t, &leg.start.q, &rate, &mut first);
                for a in 0..N {
                    force[a] = first.q[a] + first.force[a];
                }
            }
        }
        for a in 0..N {
            self.forces[a * groups..(a + 1) * groups].fill([force[a]; 4]);
            self.rates[a * groups..(a + 1) * groups].fill([rate[a]; 4]);
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
        let groups = self.tables.groups;
        for a in 0..N {
            let row = a * groups..(a + 1) * groups;
            let both = self.rates[row.clone()].as_flattened().iter();
            let both = both.zip(self.forces[row].as_flattened());
            for (l, (rate, force)) in both.take(self.tables.points).enumerate() {
                rates[l * N + a] = *rate;
                forces[l * N + a] = *force;
            }
        }
    }
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
                inverse_low: [0.0; N],
                inverse: Vec::new(),
            });
        }
        let (mut first, mut mass) = (First::ZERO, [[0.0; N]; N]);
        model.first_and_mass(0.0, &[0.0; N], &[0.0; N], &mut first, &mut mass);
        if is_second_order::<M, N>() && first.z != [0.0; N] {
            return None;
        }
        let inverse = Block::of(&mass).ok()?.inverse();
        let (mass, inverse) = match M::FORM {
            Form::Lagrangian => (mass, inverse),
            Form::Hamiltonian => (inverse, mass),
        };
        let mut diagonal = Some([0.0; N]);
        for a in 0..N {
            for b in 0..N {
                if a == b {
                    if let Some(diagonal) = &mut diagonal {
                        diagonal[a] = mass[a][a];
                    }
                } else if mass[a][b] != 0.0 {
                    diagonal = None;
                }
            }
        }
        let mut inverse_low = [0.0; N];
        for a in 0..N {
            let exact = DoubleDouble::ONE.over(DoubleDouble::new(mass[a][a]));
            inverse_low[a] = exact.minus(DoubleDouble::new(inverse[a][a])).high;
        }
        Some(Self {
            diagonal,
            inverse_low,
            inverse: inverse.to_vec(),
        })
    }
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
    use crate::model::{CoordinateName, Facts, Second};
    use crate::real::Real;
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

    #[test]
    fn every_processor_gives_the_same_bits() {
        for element in [Mixed::<4>.into(), Mixed::<9>.into(), Radau::<11>.into()] {
            let table = SchemeTable::new(element).unwrap();
            let with = Points::new(&Planet, &table.view()).unwrap();
            if with.isa.is_none() {
                return; // Nothing to compare with on this processor.
            }
            let mut without = with.clone();
            without.isa = None;
            let mut ends = [with, without].map(|mut points| {
                let (mut state, mut low) = (
                    State {
                        q: [0.4, 0.0, 2e5],
                        p: [0.0, 2.0, 0.3],
                    },
                    State::ZERO,
                );
                for step in 0..200 {
                    let leg = Leg {
                        t: 0.02 * f64::from(step),
                        h: 0.02,
                        start: &state,
                        low: &low,
                    };
                    let outcome = points.advance(&Planet, &table, &Control::default(), leg, true);
                    (state, low) = outcome.end.unwrap();
                    // The angle begins where sines of the system are taken, and comes back.
                    state.q[2] = if step == 100 { 1.0 } else { state.q[2] };
                }
                state
            });
            let [with, without] = &mut ends;
            assert_eq!(with, without);
            assert!(with.q[0].is_finite());
        }
    }
}
