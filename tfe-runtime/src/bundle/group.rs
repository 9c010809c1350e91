//! Eight trajectories side by side, and the working memory of their iteration.

use crate::model::State;
use crate::registers::pair::{Eight, LANES};
use alloc::vec;
use alloc::vec::Vec;

/// A number for every coordinate of each of eight trajectories.
pub(super) type Row<const N: usize> = [[f64; LANES]; N];

/// Coordinates and momenta at a node.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ends<const N: usize> {
    pub(super) q: Row<N>,
    pub(super) p: Row<N>,
}

/// The trajectories and the unknowns of their elements.
#[derive(Clone, Debug)]
pub(super) struct Group<const N: usize> {
    pub(super) start: Ends<N>,
    /// The rounding error of the state (compensated summation).
    pub(super) low: Ends<N>,
    /// Whether a lane continues its last step.
    pub(super) warm: [bool; LANES],
    /// L_q + Q, or π: rates of the momenta at the points.
    pub(super) forces: Vec<Row<N>>,
    /// ν, or κ: rates of the coordinates.
    pub(super) rates: Vec<Row<N>>,
}

/// The working memory of one step.
#[derive(Clone, Debug)]
pub(super) struct Work<const N: usize> {
    /// Momenta at the points.
    pub(super) momenta: Vec<Row<N>>,
    /// The velocities from which coordinates follow in phase space; the accelerations at the end in equations of second
    /// order.
    pub(super) velocities: Vec<Row<N>>,
    /// Products of the tables with the unknowns.
    pub(super) products: Vec<Row<N>>,
    pub(super) more_products: Vec<Row<N>>,
    /// The contribution of the velocities at the start, in equations of second order.
    pub(super) drift: Vec<Row<N>>,
    /// The contributions of the low words of state and tables at the points.
    pub(super) low_position: Vec<Row<N>>,
    pub(super) low_momentum: Vec<Row<N>>,
    /// The LU factors of L_vv, or H_pp, where they are not constant.
    pub(super) masses: Vec<[Row<N>; N]>,
    /// Velocities at the start.
    pub(super) velocity: Row<N>,
    pub(super) velocity_low: Row<N>,
}

impl<const N: usize> Group<N> {
    pub(super) fn new(points: usize) -> Self {
        let ends = Ends {
            q: [[0.0; LANES]; N],
            p: [[0.0; LANES]; N],
        };
        Self {
            start: ends,
            low: ends,
            warm: [false; LANES],
            forces: vec![[[0.0; LANES]; N]; points],
            rates: vec![[[0.0; LANES]; N]; points],
        }
    }

    /// Sets a trajectory to a state that continues no step.
    pub(super) fn place(&mut self, lane: usize, state: &State<N>) {
        for a in 0..N {
            self.start.q[a][lane] = state.q[a];
            self.start.p[a][lane] = state.p[a];
            self.low.q[a][lane] = 0.0;
            self.low.p[a][lane] = 0.0;
        }
        self.warm[lane] = false;
    }

    pub(super) fn state(&self, lane: usize) -> State<N> {
        let mut state = State::ZERO;
        for a in 0..N {
            state.q[a] = self.start.q[a][lane];
            state.p[a] = self.start.p[a][lane];
        }
        state
    }
}

impl<const N: usize> Work<N> {
    /// Memory for elements with this number of points; `varied` if the mass matrix is not constant.
    pub(super) fn new(points: usize, varied: bool) -> Self {
        let rows = || vec![[[0.0; LANES]; N]; points];
        Self {
            momenta: rows(),
            velocities: rows(),
            products: rows(),
            more_products: rows(),
            drift: rows(),
            low_position: rows(),
            low_momentum: rows(),
            masses: vec![[[[0.0; LANES]; N]; N]; if varied { points } else { 0 }],
            velocity: [[0.0; LANES]; N],
            velocity_low: [[0.0; LANES]; N],
        }
    }
}

/// A mask of the lanes that are written.
#[derive(Clone, Copy)]
pub(super) struct Written<V: Eight> {
    pub(super) mask: V::Mask,
    all: bool,
}

impl<V: Eight> Written<V> {
    /// The lanes whose flag is one; the flags of others are zero.
    #[inline(always)]
    pub(super) fn of(flags: V) -> Self {
        Self {
            mask: flags.like(0.0).less(flags),
            all: !(flags.like(1.0) - flags).any_positive(),
        }
    }

    /// Writes `new` in these lanes. Usually all lanes are written, which is tested first: masked stores, into which the
    /// compiler turns a selection, are many times slower on some processors.
    #[inline(always)]
    pub(super) fn put(self, old: &mut [f64; LANES], new: V) {
        if self.all {
            *old = new.lanes();
        } else {
            let kept = new.with(*old);
            *old = V::select(self.mask, new, kept).lanes();
        }
    }
}

/// One where a lane is chosen, else zero.
#[inline(always)]
pub(super) fn flags(lanes: &[bool]) -> [f64; LANES] {
    let mut flags = [0.0; LANES];
    for (flag, lane) in flags.iter_mut().zip(lanes) {
        *flag = f64::from(u8::from(*lane));
    }
    flags
}
