//! The reach of a step: boxes that contain its polynomials, computed from the values at its points at much less cost
//! than the polynomials (T-155).

use crate::basis::{INTEGRAL_BOUNDS, MAX_RATES};
use crate::model::{Form, Model, State};
use crate::points::Points;
use crate::points::forms::is_second_order;
use crate::registers::storage::Heap;
use crate::scheme::SchemeRef;
use alloc::vec::Vec;

/// A box that contains the coordinates, and velocities (momenta of a Hamiltonian), during a whole step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reach<const N: usize> {
    /// Bounds of coordinates.
    pub q: [(f64, f64); N],
    /// Bounds of velocities, or of momenta.
    pub z: [(f64, f64); N],
}

/// The weights of the values at the points, four to a group; zeros beyond the last point.
#[derive(Clone, Debug)]
pub(crate) struct Weights {
    groups: Vec<Group>,
    /// Σ integral
    whole: f64,
    /// Σ value: a bound of the interpolating polynomial of values of magnitude at most one.
    most: f64,
}

#[derive(Clone, Copy, Debug, Default)]
struct Group {
    /// b_l
    mean: [f64; 4],
    /// Upper bounds of |∫₀^τ ℓ_l| and of |ℓ_l|, for the Lagrange polynomials ℓ_l of the points.
    integral: [f64; 4],
    value: [f64; 4],
    /// The largest |A_jl|.
    stage: [f64; 4],
}

/// An allowance for rounding errors, relative to the values.
const ROUNDING: f64 = 1e-13;

impl Weights {
    /// The weights of an element that is a Runge–Kutta method; `None` for others.
    pub(crate) fn of(scheme: &SchemeRef<'_>) -> Self {
        let points = if scheme.collocated {
            scheme.points()
        } else {
            0
        };
        let mut groups = alloc::vec![Group::default(); points.div_ceil(4)];
        let (mut whole, mut most) = (0.0, 0.0);
        for l in 0..points {
            let mut part = [0.0; 3];
            // Legendre coefficients of ℓ_l: where the points are the unknowns, they are the same for rates and forces.
            for m in 0..scheme.rates().min(MAX_RATES) {
                let at = m * points + l;
                let size = scheme.rate[at].abs().max(scheme.force_rate[at].abs());
                part[0] += size * INTEGRAL_BOUNDS[m];
                part[1] += size;
            }
            for row in scheme.position.chunks_exact(points) {
                part[2] = part[2].max(row[l].abs());
            }
            let [integral, value, stage] = part;
            let (group, lane) = (&mut groups[l / 4], l % 4);
            group.mean[lane] = scheme.weights[l];
            (group.integral[lane], group.value[lane]) = (integral, value);
            group.stage[lane] = stage;
            whole += integral;
            most += value;
        }
        Self {
            groups,
            whole,
            most,
        }
    }
}

/// Σ weight · |value|, of four.
#[inline(always)]
fn sizes(weights: &[f64; 4], values: &[f64; 4]) -> f64 {
    let mut sum = 0.0;
    for lane in 0..4 {
        sum += weights[lane] * values[lane].abs();
    }
    sum
}

#[inline(always)]
fn about(centre: f64, radius: f64) -> (f64, f64) {
    let radius = radius + ROUNDING * (radius + centre.abs());
    (centre - radius, centre + radius)
}

impl<const N: usize> Points<N, Heap> {
    /// The reach of the last step, of length h, from its start; `None` without weights.
    #[inline(always)]
    pub(crate) fn reach<M: Model<N>>(
        &self,
        weights: &Weights,
        h: f64,
        start: &State<N>,
    ) -> Option<Reach<N>> {
        if weights.groups.is_empty() {
            return None;
        }
        let size = h.abs();
        let mut reach = Reach {
            q: [(0.0, 0.0); N],
            z: [(0.0, 0.0); N],
        };
        // Bounds of |p − p₀| of the polynomial, divided by h, and of |p_l − p₀| at the points.
        let (mut forces, mut stages) = ([0.0; N], [0.0; N]);
        for (group, row) in weights.groups.iter().zip(&*self.forces) {
            for a in 0..N {
                forces[a] += sizes(&group.integral, &row[a]);
                stages[a] += sizes(&group.stage, &row[a]);
            }
        }
        if M::FORM == Form::Hamiltonian {
            for a in 0..N {
                reach.z[a] = about(start.p[a], size * forces[a]);
            }
        }
        if is_second_order::<M, N>() {
            for a in 0..N {
                let change = if self.inertia.is_diagonal::<M>() {
                    self.inertia.inverse_diagonal[a].abs() * stages[a]
                } else {
                    let row = self.inertia.inverse[a].iter().zip(&stages);
                    row.map(|(inverse, stage)| inverse.abs() * stage).sum()
                };
                let (velocity, change) = (self.velocity[a], size * change);
                let distance = size * weights.whole * (velocity.abs() + change);
                reach.q[a] = about(start.q[a], distance);
                if M::FORM == Form::Lagrangian {
                    reach.z[a] =
                        about(velocity, weights.most * change + ROUNDING * distance / size);
                }
            }
            return Some(reach);
        }
        for a in 0..N {
            let (mut distance, mut mean, mut off) = (0.0, 0.0, 0.0);
            for (group, row) in weights.groups.iter().zip(&*self.rates) {
                distance += sizes(&group.integral, &row[a]);
                for lane in 0..4 {
                    mean += group.mean[lane] * row[a][lane];
                }
            }
            reach.q[a] = about(start.q[a], size * distance);
            if M::FORM == Form::Lagrangian {
                for (group, row) in weights.groups.iter().zip(&*self.rates) {
                    let from_mean = row[a].map(|rate| rate - mean);
                    off += sizes(&group.value, &from_mean);
                }
                reach.z[a] = about(mean, off + ROUNDING * distance);
            }
        }
        Some(reach)
    }
}
