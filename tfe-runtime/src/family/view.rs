//! A model of run-time length seen as a Lagrangian: its rates are solved for, whether it was declared by a Lagrangian
//! or by a Hamiltonian.

use super::inertia::Inertia;
use super::model::{Block, Entries, Gradient, Model};
use crate::consistency::ModelError;
use crate::dual::Dual;
use crate::length::{Declared, RunTimeLength};
use crate::model::{CoordinateName, Facts, Form};
use crate::real::Real;
use alloc::vec;
use alloc::vec::Vec;

/// A model seen as a Lagrangian, with an additional force γ v.
///
/// A Hamiltonian with a constant diagonal mass matrix has the Lagrangian
///
/// ```text
/// L(q, v) = v·Mv − H(q, Mv) ,     L_v = M v ,     L_q = −H_q(q, Mv) ,     ∂Q/∂v = Q_p M .
/// ```
#[derive(Clone, Debug)]
pub(super) struct View<'m, M> {
    model: &'m M,
    /// The masses of a Hamiltonian.
    mass: Vec<f64>,
    damping: f64,
}

impl<'m, M: Model> View<'m, M> {
    /// The view of a model that has been checked.
    ///
    /// # Errors
    /// [`ModelError`] for a Hamiltonian of another kind.
    pub(super) fn new(model: &'m M, damping: f64) -> Result<Self, ModelError> {
        let mass = match M::FORM {
            Form::Lagrangian => Vec::new(),
            Form::Hamiltonian => Inertia::of(model)?.mass,
        };
        Ok(Self {
            model,
            mass,
            damping,
        })
    }

    fn is_hamiltonian(&self) -> bool {
        M::FORM == Form::Hamiltonian
    }

    /// The model itself.
    pub(super) fn model(&self) -> &'m M {
        self.model
    }

    /// The constant masses of a Hamiltonian; `None` for a Lagrangian.
    pub(super) fn masses(&self) -> Option<&[f64]> {
        self.is_hamiltonian().then_some(&self.mass)
    }

    /// The momenta that the kernels of a Hamiltonian take; they are empty for a Lagrangian, whose kernels take
    /// velocities.
    fn momenta<R: Real>(&self, v: &[R]) -> Vec<R> {
        let masses = self.mass.iter().zip(v);
        masses.map(|(mass, v)| *v * v.like(*mass)).collect()
    }

    /// The effect of a parameter at a place.
    pub(super) fn by_parameter(
        &self,
        t: f64,
        q: &[f64],
        v: &[f64],
        parameter: usize,
    ) -> PointSlopes {
        let time = Dual::new(t, 0.0).by_parameter(Some(parameter));
        self.by_time(time, q, v)
    }

    /// The effect of the time at a place, if the time has a derivative, and of the parameter that it carries.
    pub(super) fn by_time(&self, time: Dual, q: &[f64], v: &[f64]) -> PointSlopes {
        let still = |values: &[f64]| -> Vec<Dual> {
            let duals = values.iter().map(|value| Dual::new(*value, 0.0));
            duals.collect()
        };
        let n = self.model.len();
        let (mut z, mut slope, mut force) = (
            vec![Dual::ZERO; n],
            vec![Dual::ZERO; n],
            vec![Dual::ZERO; n],
        );
        let first = Gradient {
            z: &mut z,
            q: &mut slope,
            force: &mut force,
        };
        let momenta = self.momenta(v);
        let (taken, sign) = match self.is_hamiltonian() {
            true => (&momenta[..], -1.0),
            false => (v, 1.0),
        };
        self.model.first(time, &still(q), &still(taken), first);
        let force = slope.iter().zip(&force).map(|(slope, force)| {
            let given = sign * slope.slope;
            if M::FACTS.forced {
                given + force.slope
            } else {
                given
            }
        });
        let force = force.collect();
        let by_z = z.iter().map(|one| sign * one.slope);
        if !self.is_hamiltonian() {
            return PointSlopes {
                velocity: vec![0.0; n],
                momentum: by_z.collect(),
                force,
            };
        }
        // v = H_p(q, p) is held fixed, so that the momentum changes: δp = −M ∂H_p/∂a.
        let velocity: Vec<f64> = by_z.collect();
        PointSlopes {
            momentum: self.momenta(&velocity),
            velocity,
            force,
        }
    }

    /// Converts derivatives of H into those of L, and adds the additional force.
    fn turn<R: Real>(&self, v: &[R], momenta: Vec<R>, first: Gradient<'_, R>) {
        if self.is_hamiltonian() {
            first.z.copy_from_slice(&momenta);
            for slope in first.q.iter_mut() {
                *slope = -*slope;
            }
        }
        for (force, v) in first.force.iter_mut().zip(v) {
            let push = *v * v.like(self.damping);
            *force = if M::FACTS.forced { *force + push } else { push };
        }
    }
}

/// The effect of a parameter, or of the time, at fixed coordinates and velocities.
pub(super) struct PointSlopes {
    /// ∂L_v/∂a
    pub(super) momentum: Vec<f64>,
    /// ∂F/∂a at fixed momenta for a Hamiltonian, else at fixed velocities; F = L_q + Q.
    pub(super) force: Vec<f64>,
    /// For a Hamiltonian, the velocity M⁻¹δp of the change of momenta, through which F changes as well; otherwise zero.
    pub(super) velocity: Vec<f64>,
}

/// A temporary borrow of the parts of a gradient.
fn lend<'a, R>(first: &'a mut Gradient<'_, R>) -> Gradient<'a, R> {
    Gradient {
        z: &mut *first.z,
        q: &mut *first.q,
        force: &mut *first.force,
    }
}

/// Converts second derivatives of H into those of L.
struct Turned<'a, E> {
    mass: &'a [f64],
    entries: &'a mut E,
}

impl<R: Real, E: Entries<R>> Entries<R> for Turned<'_, E> {
    fn add(&mut self, block: Block, row: usize, column: usize, value: R) {
        match block {
            // M is constant and known to the view; mixed derivatives vanish.
            Block::ZZ | Block::ZQ => {}
            Block::QQ => self.entries.add(block, row, column, -value),
            Block::ForceZ => {
                let mass = value.like(self.mass[column]);
                self.entries.add(block, row, column, value * mass);
            }
            // Of forces by coordinates.
            _ => self.entries.add(block, row, column, value),
        }
    }
}

impl<M> Declared<0> for View<'_, M> {
    type Length = RunTimeLength;
}

impl<M: Model> Model for View<'_, M> {
    const FORM: Form = Form::Lagrangian;
    const FACTS: Facts = Facts {
        forced: true,
        ..M::FACTS
    };
    const MOMENTA_MOVE: bool = M::MOMENTA_MOVE;
    const CONSTRAINED: bool = M::CONSTRAINED;

    fn len(&self) -> usize {
        self.model.len()
    }

    fn check(&self) -> Result<(), ModelError> {
        self.model.check()
    }

    fn energy_function<R: Real>(&self, t: R, q: &[R], z: &[R]) -> R {
        if !self.is_hamiltonian() {
            return self.model.energy_function(t, q, z);
        }
        let momenta = self.momenta(z);
        let negative = -self.model.energy_function(t, q, &momenta);
        let parts = momenta.iter().zip(z);
        parts.fold(negative, |sum, (p, v)| sum + *p * *v)
    }

    fn first<R: Real>(&self, t: R, q: &[R], z: &[R], mut first: Gradient<'_, R>) {
        let momenta = self.momenta(z);
        let taken = if self.is_hamiltonian() { &momenta } else { z };
        self.model.first(t, q, taken, lend(&mut first));
        self.turn(z, momenta, first);
    }

    fn forces_inline<R: Real>(&self, t: R, q: &[R], z: &[R], first: Gradient<'_, R>) {
        self.first(t, q, z, first);
    }

    fn mass<R: Real, E: Entries<R>>(&self, t: R, q: &[R], z: &[R], entries: &mut E) {
        if !self.is_hamiltonian() {
            return self.model.mass(t, q, z, entries);
        }
        for (a, mass) in self.mass.iter().enumerate() {
            entries.add(Block::ZZ, a, a, t.like(*mass));
        }
    }

    fn second<R: Real, E: Entries<R>>(
        &self,
        t: R,
        q: &[R],
        z: &[R],
        mut first: Gradient<'_, R>,
        entries: &mut E,
    ) {
        if self.damping != 0.0 {
            for a in 0..self.len() {
                entries.add(Block::ForceZ, a, a, t.like(self.damping));
            }
        }
        if !self.is_hamiltonian() {
            self.model.second(t, q, z, lend(&mut first), entries);
            return self.turn(z, Vec::new(), first);
        }
        let momenta = self.momenta(z);
        self.mass(t, q, z, entries);
        let mut turned = Turned {
            mass: &self.mass,
            entries,
        };
        self.model
            .second(t, q, &momenta, lend(&mut first), &mut turned);
        self.turn(z, momenta, first);
    }

    fn coordinate_name(&self, index: usize) -> CoordinateName {
        self.model.coordinate_name(index)
    }

    fn constraints(&self) -> usize {
        self.model.constraints()
    }

    fn constraint_name(&self, row: usize) -> CoordinateName {
        self.model.constraint_name(row)
    }

    fn constraint_values<R: Real>(&self, t: R, q: &[R], values: &mut [R]) {
        self.model.constraint_values(t, q, values);
    }

    fn constraint_rows<R: Real, E: Entries<R>>(
        &self,
        t: R,
        q: &[R],
        drift: &mut [R],
        entries: &mut E,
    ) {
        self.model.constraint_rows(t, q, drift, entries);
    }

    fn constraint_second<R: Real, E: Entries<R>>(&self, t: R, q: &[R], mu: &[R], entries: &mut E) {
        self.model.constraint_second(t, q, mu, entries);
    }
}
