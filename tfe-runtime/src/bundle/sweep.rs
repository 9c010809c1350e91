//! One iteration of the fixed point, for all lanes.

use super::equations::Equations;
use super::lanes::{Row, add, factor, moved, raise, replace, solve, weighted, zeros};
use crate::model::{First, Model};
use crate::real::{Lanes, Real};
use crate::scheme::SchemeRef;

/// One iteration: of which element, and what is to be done.
pub(super) struct Sweep<const W: usize> {
    pub(super) t: f64,
    pub(super) h: f64,
    pub(super) iteration: u32,
    /// Whether mass matrices are evaluated anew.
    pub(super) refresh: bool,
    pub(super) active: Active<W>,
}

/// Which lanes still iterate.
#[derive(Clone, Copy)]
pub(super) struct Active<const W: usize> {
    pub(super) lanes: [bool; W],
    /// One where a lane iterates, else zero.
    pub(super) gain: [f64; W],
    pub(super) all: bool,
}

impl<const W: usize> Active<W> {
    pub(super) fn of(lanes: [bool; W]) -> Self {
        let mut gain = [0.0; W];
        for lane in 0..W {
            gain[lane] = f64::from(u8::from(lanes[lane]));
        }
        Self {
            lanes,
            gain,
            all: lanes == [true; W],
        }
    }
}

/// The largest magnitudes of unknowns and of their increments, a lane each.
#[derive(Clone, Copy)]
pub(super) struct Sizes<const W: usize> {
    pub(super) rate: [f64; W],
    pub(super) rate_step: [f64; W],
    pub(super) force: [f64; W],
    pub(super) force_step: [f64; W],
}

impl<const W: usize> Sizes<W> {
    const NONE: Self = Self {
        rate: [0.0; W],
        rate_step: [0.0; W],
        force: [0.0; W],
        force_step: [0.0; W],
    };
}

impl<const N: usize, const W: usize> Equations<N, W> {
    /// The velocity form: momenta and forces at the velocities, then velocities that belong to the momenta asked for.
    pub(super) fn sweep_velocity<M>(
        &mut self,
        model: &M,
        scheme: &SchemeRef<'_>,
        sweep: &Sweep<W>,
    ) -> Sizes<W>
    where
        M: Model<N>,
    {
        let (points, h) = (self.points, sweep.h);
        let mut first = First::<Lanes<W>, N>::zero();
        for l in 0..points {
            let weights = &scheme.position[l * points..(l + 1) * points];
            let rate = weighted(weights, &self.rates);
            let q = moved(&self.start.q, &self.low_position[l], h, &rate);
            let t = Lanes::from_f64(sweep.t + scheme.nodes[l] * h);
            if sweep.refresh {
                let mass = &mut self.masses[l];
                model.first_and_mass(t, &q, &self.rates[l], &mut first, mass);
                factor(mass);
            } else {
                model.first(t, &q, &self.rates[l], &mut first);
            }
            self.momenta[l] = first.z;
            let mut force = first.q;
            add(&mut force, 1.0, &first.force);
            if sweep.active.all {
                self.forces[l] = force;
            } else {
                replace(&mut self.forces[l], &force, &sweep.active.lanes);
            }
        }
        if sweep.iteration == 0 {
            for l in 0..points {
                let weights = &scheme.force_low[l * points..(l + 1) * points];
                let mut low = self.low.p;
                add(&mut low, h, &weighted(weights, &self.forces));
                self.low_momentum[l] = low;
            }
        }
        let mut sizes = Sizes::NONE;
        for l in 0..points {
            let weights = &scheme.force[l * points..(l + 1) * points];
            let impulse = weighted(weights, &self.forces);
            let mut missing = zeros();
            for a in 0..N {
                for lane in 0..W {
                    missing[a].0[lane] = (h * impulse[a].0[lane] + self.low_momentum[l][a].0[lane])
                        - (self.momenta[l][a].0[lane] - self.start.p[a].0[lane]);
                }
            }
            let mut step = missing;
            if M::FACTS.constant_mass {
                step = times(&self.constant_mass, &missing);
            } else {
                solve(&self.masses[l], &mut step);
            }
            let rate = &mut self.rates[l];
            improve(rate, &step, &sweep.active.gain);
            raise(&mut sizes.rate, rate);
            raise(&mut sizes.rate_step, &step);
        }
        sizes
    }

    /// The phase form: momenta, the velocities that belong to them, coordinates, and then both rates anew.
    pub(super) fn sweep_phase<M>(
        &mut self,
        model: &M,
        scheme: &SchemeRef<'_>,
        sweep: &Sweep<W>,
    ) -> Sizes<W>
    where
        M: Model<N>,
    {
        let (points, h) = (self.points, sweep.h);
        for k in 0..points {
            let weights = &scheme.position[k * points..(k + 1) * points];
            let rate = weighted(weights, &self.forces);
            let p = moved(&self.start.p, &self.low_momentum[k], h, &rate);
            let mut velocity = self.rates[k];
            if sweep.iteration > 0 {
                let mut change = p;
                add(&mut change, -1.0, &self.momenta[k]);
                if M::FACTS.constant_mass {
                    add(&mut velocity, 1.0, &times(&self.constant_mass, &change));
                } else {
                    let mass = &self.masses[k];
                    for a in 0..N {
                        for b in 0..N {
                            velocity[a] += mass[a][b] * change[b];
                        }
                    }
                }
            }
            self.momenta[k] = p;
            self.velocities[k] = velocity;
        }
        let mut first = First::<Lanes<W>, N>::zero();
        let mut sizes = Sizes::NONE;
        for k in 0..points {
            let weights = &scheme.position[k * points..(k + 1) * points];
            let rate = weighted(weights, &self.velocities);
            let q = moved(&self.start.q, &self.low_position[k], h, &rate);
            let t = Lanes::from_f64(sweep.t + scheme.nodes[k] * h);
            if sweep.refresh {
                model.first_and_mass(t, &q, &self.momenta[k], &mut first, &mut self.masses[k]);
            } else {
                model.first(t, &q, &self.momenta[k], &mut first);
            }
            let (mut force_step, mut rate_step) = (first.force, first.z);
            add(&mut force_step, -1.0, &first.q);
            add(&mut force_step, -1.0, &self.forces[k]);
            add(&mut rate_step, -1.0, &self.rates[k]);
            improve(&mut self.forces[k], &force_step, &sweep.active.gain);
            improve(&mut self.rates[k], &rate_step, &sweep.active.gain);
            raise(&mut sizes.force, &self.forces[k]);
            raise(&mut sizes.force_step, &force_step);
            raise(&mut sizes.rate, &self.rates[k]);
            raise(&mut sizes.rate_step, &rate_step);
        }
        sizes
    }
}

/// The same matrix times the vector of every lane.
#[inline(always)]
fn times<const N: usize, const W: usize>(matrix: &[[f64; N]; N], vector: &Row<N, W>) -> Row<N, W> {
    let mut product = zeros();
    for a in 0..N {
        for b in 0..N {
            for lane in 0..W {
                product[a].0[lane] += matrix[a][b] * vector[b].0[lane];
            }
        }
    }
    product
}

/// Adds a step in the lanes that still iterate.
#[inline(always)]
fn improve<const N: usize, const W: usize>(
    rate: &mut Row<N, W>,
    step: &Row<N, W>,
    gain: &[f64; W],
) {
    for a in 0..N {
        for lane in 0..W {
            rate[a].0[lane] += gain[lane] * step[a].0[lane];
        }
    }
}
