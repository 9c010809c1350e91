//! The equations of one element for W trajectories, and their fixed-point iteration.
//!
//! The same equations as for one trajectory (velocity form for a Lagrangian, phase form for a Hamiltonian), with two differences that save
//! work and change results by less than rounding does: what rounding took from the tables is summed once a step, at the start of the
//! iteration; and mass matrices are refreshed after fixed numbers of iterations.

use super::lanes::{Row, add, raise, replace, sum, weighted, zeros};
use super::sweep::{Active, Sweep};
use crate::equations::Increment;
use crate::lu::Block;
use crate::model::{First, Form, Model, State};
use crate::newton::{Control, Monitor, PATIENCE, Solve, Verdict};
use crate::scheme::SchemeRef;
use crate::statistics::Statistics;
use crate::step::{cold_phase, cold_velocity, set_extrapolation};
use alloc::vec;
use alloc::vec::Vec;
use core::array::from_fn;

/// States of W trajectories and the unknowns of their elements.
#[derive(Debug)]
pub(super) struct Equations<const N: usize, const W: usize> {
    pub(super) start: Ends<N, W>,
    pub(super) low: Ends<N, W>,
    /// Whether a lane continues its last step.
    warm: [bool; W],
    pub(super) points: usize,
    /// ν, or κ: rates of the coordinates.
    pub(super) rates: Vec<Row<N, W>>,
    /// L_q + Q, or π: rates of the momenta.
    pub(super) forces: Vec<Row<N, W>>,
    /// Momenta at the stages.
    pub(super) momenta: Vec<Row<N, W>>,
    /// Velocities from which coordinates follow in phase form; scratch elsewhere.
    pub(super) velocities: Vec<Row<N, W>>,
    /// What the low words of state and tables add to coordinates and momenta at the stages.
    pub(super) low_position: Vec<Row<N, W>>,
    pub(super) low_momentum: Vec<Row<N, W>>,
    /// Factors of L_vv, or H_pp, where they are not constant.
    pub(super) masses: Vec<[Row<N, W>; N]>,
    /// The inverse of L_vv, or H_pp, where it is.
    pub(super) constant_mass: [[f64; N]; N],
    extrapolation: Vec<f64>,
    last_step: f64,
    ratio: Option<f64>,
}

/// Coordinates and momenta at a node.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ends<const N: usize, const W: usize> {
    pub(super) q: Row<N, W>,
    pub(super) p: Row<N, W>,
}

/// After these iterations mass matrices are evaluated anew. The start is good to a few digits, so that one evaluation mostly serves; that
/// they do not depend on how the iteration goes keeps lanes independent of one another.
const REFRESHED: [u32; 4] = [0, 4, 8, 14];

impl<const N: usize, const W: usize> Equations<N, W> {
    pub(super) fn new(points: usize) -> Self {
        let rows = || vec![zeros(); points];
        let ends = Ends {
            q: zeros(),
            p: zeros(),
        };
        Self {
            start: ends,
            low: ends,
            warm: [false; W],
            points,
            rates: rows(),
            forces: rows(),
            momenta: rows(),
            velocities: rows(),
            low_position: rows(),
            low_momentum: rows(),
            masses: Vec::new(),
            constant_mass: [[0.0; N]; N],
            extrapolation: vec![0.0; points * points],
            last_step: 0.0,
            ratio: None,
        }
    }

    /// Sets a trajectory to a state that continues no step.
    pub(super) fn place(&mut self, lane: usize, state: &State<N>) {
        for a in 0..N {
            self.start.q[a].0[lane] = state.q[a];
            self.start.p[a].0[lane] = state.p[a];
            self.low.q[a].0[lane] = 0.0;
            self.low.p[a].0[lane] = 0.0;
        }
        self.warm[lane] = false;
    }

    pub(super) fn state(&self, lane: usize) -> State<N> {
        let mut state = State::ZERO;
        for a in 0..N {
            state.q[a] = self.start.q[a].0[lane];
            state.p[a] = self.start.p[a].0[lane];
        }
        state
    }

    /// Makes room for mass matrices, or computes the one there is; false if that is singular.
    pub(super) fn set_constant_mass<M>(&mut self, model: &M) -> bool
    where
        M: Model<N>,
    {
        if !M::FACTS.constant_mass {
            self.masses.resize(self.points, [zeros(); N]);
            return true;
        }
        let state = self.state(0);
        let (mut first, mut mass) = (First::ZERO, [[0.0; N]; N]);
        model.first_and_mass(0.0, &state.q, &[0.0; N], &mut first, &mut mass);
        self.constant_mass = match M::FORM {
            Form::Hamiltonian => mass,
            Form::Lagrangian => match Block::of(&mass) {
                Ok(block) => block.inverse(),
                Err(_) => return false,
            },
        };
        self.constant_mass
            .as_flattened()
            .iter()
            .all(|m| m.is_finite())
    }

    /// Moves the wanted lanes from t to t + h; true for those that have arrived, the others are where they were.
    pub(super) fn advance<M>(
        &mut self,
        method: (&M, &SchemeRef<'_>, &Control),
        (t, h): (f64, f64),
        wanted: [bool; W],
        statistics: &mut Statistics,
    ) -> [bool; W]
    where
        M: Model<N>,
    {
        let (model, scheme, _) = method;
        self.prepare(model, scheme, (t, h), &wanted);
        let mut arrived = self.iterate(method, (t, h), wanted, statistics);

        let mut velocity = weighted(scheme.advance, &self.rates);
        let correction = weighted(scheme.advance_low, &self.rates);
        add(&mut velocity, 1.0, &correction);
        let mut force = weighted(scheme.weights, &self.forces);
        let correction = weighted(scheme.weights_low, &self.forces);
        add(&mut force, 1.0, &correction);
        let (mut dq, mut dp) = (self.low.q, self.low.p);
        add(&mut dq, h, &velocity);
        add(&mut dp, h, &force);
        let (q, low_q) = sum(&self.start.q, &dq);
        let (p, low_p) = sum(&self.start.p, &dp);

        let mut finite = [0.0; W];
        for a in 0..N {
            for lane in 0..W {
                // Zero times what is not finite is a NaN.
                finite[lane] += 0.0 * q[a].0[lane] + 0.0 * p[a].0[lane];
            }
        }
        let mut count = 0;
        for lane in 0..W {
            arrived[lane] &= finite[lane] == 0.0;
            count += u64::from(arrived[lane]);
        }
        statistics.steps += count;
        if arrived == [true; W] {
            self.start = Ends { q, p };
            self.low = Ends { q: low_q, p: low_p };
        } else {
            replace(&mut self.start.q, &q, &arrived);
            replace(&mut self.start.p, &p, &arrived);
            replace(&mut self.low.q, &low_q, &arrived);
            replace(&mut self.low.p, &low_p, &arrived);
        }
        self.warm = arrived;
        self.last_step = h;
        arrived
    }

    /// Sets the unknowns to where the iteration starts: the polynomial of the last element, continued, or constant rates.
    fn prepare<M>(
        &mut self,
        model: &M,
        scheme: &SchemeRef<'_>,
        (t, h): (f64, f64),
        wanted: &[bool; W],
    ) where
        M: Model<N>,
    {
        let phase = matches!(M::FORM, Form::Hamiltonian);
        if self.warm.contains(&true) {
            let ratio = h / self.last_step;
            // Far outside the last element its polynomial says nothing; backwards it may be reused.
            let near = (-1.5..=3.0).contains(&ratio);
            let fraction = if near { ratio } else { 0.0 };
            if self.ratio != Some(fraction) {
                set_extrapolation(scheme, fraction, &mut self.extrapolation);
                self.ratio = Some(fraction);
            }
            continued(&self.extrapolation, &mut self.rates, &mut self.velocities);
            if phase {
                continued(&self.extrapolation, &mut self.forces, &mut self.velocities);
            }
        }
        for lane in 0..W {
            if wanted[lane] && !self.warm[lane] {
                self.start_cold(model, scheme, t, lane);
            }
        }
        for k in 0..self.points {
            let row = k * self.points..(k + 1) * self.points;
            let mut low = self.low.q;
            add(
                &mut low,
                h,
                &weighted(&scheme.position_low[row.clone()], &self.rates),
            );
            self.low_position[k] = low;
            if phase {
                let mut low = self.low.p;
                add(
                    &mut low,
                    h,
                    &weighted(&scheme.position_low[row], &self.forces),
                );
                self.low_momentum[k] = low;
            }
        }
    }

    #[cold]
    fn start_cold<M>(&mut self, model: &M, scheme: &SchemeRef<'_>, t: f64, lane: usize)
    where
        M: Model<N>,
    {
        let state = self.state(lane);
        let mut unknowns = vec![0.0; 2 * self.points * N];
        if matches!(M::FORM, Form::Hamiltonian) {
            cold_phase(model, scheme, t, &state, &mut unknowns);
            let (pi, kappa) = unknowns.as_chunks::<N>().0.split_at(self.points);
            set_lane(&mut self.forces, pi, lane);
            set_lane(&mut self.rates, kappa, lane);
        } else {
            cold_velocity(model, t, &state, &mut unknowns);
            set_lane(&mut self.rates, unknowns.as_chunks::<N>().0, lane);
        }
    }

    /// The fixed-point iteration; true for lanes that have converged.
    fn iterate<M>(
        &mut self,
        method: (&M, &SchemeRef<'_>, &Control),
        (t, h): (f64, f64),
        wanted: [bool; W],
        statistics: &mut Statistics,
    ) -> [bool; W]
    where
        M: Model<N>,
    {
        let (model, scheme, control) = method;
        // Where Newton's method may follow, the iteration gives up early.
        let yielding = control.solve == Solve::Auto;
        let most = if yielding {
            control.max_iterations.min(PATIENCE)
        } else {
            control.max_iterations
        };
        let mut monitors: [Monitor; W] = from_fn(|_| Monitor::new(control.tolerance));
        let (mut start_q, mut start_p) = ([0.0; W], [0.0; W]);
        raise(&mut start_q, &self.start.q);
        raise(&mut start_p, &self.start.p);
        let (mut arrived, mut lanes) = ([false; W], wanted);
        for iteration in 0..most {
            let sweep = Sweep {
                t,
                h,
                iteration,
                refresh: !M::FACTS.constant_mass && REFRESHED.contains(&iteration),
                active: Active::of(lanes),
            };
            let (size, position) = match M::FORM {
                Form::Hamiltonian => {
                    let sizes = self.sweep_phase(model, scheme, &sweep);
                    let position = relative(h, &start_q, &sizes.rate, &sizes.rate_step);
                    let momentum = relative(h, &start_p, &sizes.force, &sizes.force_step);
                    (larger(&position, &momentum), position)
                }
                Form::Lagrangian => {
                    let sizes = self.sweep_velocity(model, scheme, &sweep);
                    let position = relative(h, &start_q, &sizes.rate, &sizes.rate_step);
                    // The momentum at the end is as good as the velocities, whatever the step; what
                    // is left of an increment reaches it through forces only, hence the factor.
                    let mut velocity = relative(1.0, &[0.0; W], &sizes.rate, &sizes.rate_step);
                    for lane in 0..W {
                        velocity[lane] *= 0.25;
                    }
                    (larger(&position, &velocity), position)
                }
            };
            let mut count = 0;
            for lane in 0..W {
                if !lanes[lane] {
                    continue;
                }
                count += 1;
                let monitor = &mut monitors[lane];
                let increment = Increment {
                    relative: size[lane],
                    position: position[lane],
                };
                match monitor.judge(increment) {
                    Ok(Verdict::Converged) => (arrived[lane], lanes[lane]) = (true, false),
                    Ok(Verdict::GoOn) => {
                        let hopeless = || monitor.is_hopeless(most - iteration);
                        lanes[lane] = !(yielding && iteration >= 2 && hopeless());
                    }
                    Err(_) => lanes[lane] = false,
                }
            }
            statistics.iterations += count;
            statistics.fixed_point_iterations += count;
            statistics.residual_evaluations += count * self.points as u64;
            if lanes == [false; W] {
                break;
            }
        }
        arrived
    }
}

/// Old unknown rates to new ones.
fn continued<const N: usize, const W: usize>(
    extrapolation: &[f64],
    rates: &mut [Row<N, W>],
    scratch: &mut [Row<N, W>],
) {
    for (row, weights) in scratch
        .iter_mut()
        .zip(extrapolation.chunks_exact(rates.len()))
    {
        *row = weighted(weights, rates);
    }
    rates.copy_from_slice(scratch);
}

fn set_lane<const N: usize, const W: usize>(
    rows: &mut [Row<N, W>],
    values: &[[f64; N]],
    lane: usize,
) {
    for (row, values) in rows.iter_mut().zip(values) {
        for a in 0..N {
            row[a].0[lane] = values[a];
        }
    }
}

/// |h δ| over the larger one of start and |h x|; zero over zero is zero.
#[inline(always)]
fn relative<const W: usize>(
    h: f64,
    start: &[f64; W],
    rate: &[f64; W],
    step: &[f64; W],
) -> [f64; W] {
    let h = h.abs();
    let mut size = [0.0; W];
    for lane in 0..W {
        let moved = h * rate[lane];
        let scale = if moved > start[lane] {
            moved
        } else {
            start[lane]
        };
        // Something to divide by where both are zero.
        let scale = if scale > f64::MIN_POSITIVE {
            scale
        } else {
            f64::MIN_POSITIVE
        };
        size[lane] = h * step[lane] / scale;
    }
    size
}

#[inline(always)]
fn larger<const W: usize>(x: &[f64; W], y: &[f64; W]) -> [f64; W] {
    let mut larger = *x;
    for lane in 0..W {
        larger[lane] = if y[lane] > x[lane] { y[lane] } else { x[lane] };
    }
    larger
}
