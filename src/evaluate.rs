//! The evaluations of a model that motions record, for both kinds of length.

use crate::constraints::{ConstraintResidual, rank_of};
use crate::length::{FixedLength, Length, RunTimeLength};
use crate::numbers::larger;
use tfe_runtime::family::{self, FamilyState};
use tfe_runtime::{
    Constraint, CoordinateName, Form, Model, ModelError, State, constrained, legendre,
};

/// Evaluates a model at points of phase space: every [`Model`] and every [`family::Model`], and nothing else.
pub trait Evaluate<const N: usize, L: Length<N>>: Sized {
    /// Checks that the model can be evaluated: its lengths and indices fit each other.
    ///
    /// # Errors
    /// [`ModelError`] for the first that does not fit.
    fn checked(&self) -> Result<(), ModelError>;

    /// The names of the coordinates.
    fn coordinate_names(&self) -> Vec<CoordinateName>;

    /// The names of the outputs, in the order of declaration and of sites.
    fn output_names(&self) -> Vec<CoordinateName>;

    /// The names of the constraints, in the order of declaration and of sites.
    fn constraint_names(&self) -> Vec<L::ConstraintName>;

    /// dq/dt, by iteration from `guess`; `None` if no velocity belongs to the momentum.
    fn velocity(&self, t: f64, state: &L::State, guess: &L::Vector) -> Option<L::Vector>;

    /// The energy H = p·v − L, from coordinates, momenta and velocities.
    fn energy(&self, t: f64, at: (&L::Vector, &L::Vector), velocity: &L::Vector) -> f64;

    /// The rounding error of the energy, if it is a difference of nearly equal numbers, and what rounding errors of
    /// positions change of it at rest in a time; zero if unknown.
    fn energy_rounding(
        &self,
        times: (f64, f64),
        at: (&L::Vector, &L::Vector),
        velocity: &L::Vector,
    ) -> f64;

    /// The rounding error of forces, if they are differences of nearly equal numbers; zero if unknown.
    fn force_rounding(&self, t: f64, at: (&L::Vector, &L::Vector), velocity: &L::Vector) -> f64;

    /// Writes the outputs, if the model has any.
    fn outputs(
        &self,
        t: f64,
        at: (&L::Vector, &L::Vector),
        velocity: &L::Vector,
        values: &mut [f64],
    );

    /// Whether the model has constraints.
    const IS_CONSTRAINED: bool;

    /// The violation of the constraints at a state.
    fn residual(&self, t: f64, q: &L::Vector, velocity: &L::Vector) -> ConstraintResidual;

    /// The reactions of the constraints; NaN if they cannot be computed.
    fn reactions(&self, t: f64, at: (&L::Vector, &L::Vector), velocity: &L::Vector) -> Vec<f64>;

    /// The same model with another value of a parameter, if its parameters can be set.
    fn with(&self, parameter: &str, value: f64) -> Option<Self>;

    /// Whether outputs need the velocity; for a Hamiltonian they are functions of the momentum.
    const NEEDS_VELOCITY: bool;
}

/// A list of names.
pub(crate) fn names(count: usize, name: &dyn Fn(usize) -> CoordinateName) -> Vec<CoordinateName> {
    (0..count).map(name).collect()
}

/// The largest residuals; `independent` tells which constraints are independent.
fn largest(residuals: &[constrained::Residual], independent: &[bool]) -> ConstraintResidual {
    let (mut position, mut rate) = (0.0, 0.0);
    for one in residuals {
        position = larger(position, one.position.abs());
        rate = larger(rate, one.velocity.abs());
    }
    ConstraintResidual {
        position,
        velocity: rate,
        rank: rank_of(independent),
    }
}

fn declared_names(constraints: &[Constraint]) -> Vec<&'static str> {
    constraints.iter().map(|one| one.name).collect()
}

impl<M: Model<N>, const N: usize> Evaluate<N, FixedLength> for M {
    const IS_CONSTRAINED: bool = !M::CONSTRAINTS.is_empty();
    const NEEDS_VELOCITY: bool = matches!(M::FORM, Form::Lagrangian);

    fn checked(&self) -> Result<(), ModelError> {
        self.check()
    }

    fn coordinate_names(&self) -> Vec<CoordinateName> {
        names(N, &M::coordinate_name)
    }

    fn output_names(&self) -> Vec<CoordinateName> {
        names(self.columns(), &|at| self.column_name(at))
    }

    fn constraint_names(&self) -> Vec<&'static str> {
        declared_names(M::CONSTRAINTS)
    }

    fn velocity(&self, t: f64, state: &State<N>, guess: &[f64; N]) -> Option<[f64; N]> {
        constrained::velocity_of(self, t, &state.q, &state.p, guess).ok()
    }

    fn energy(&self, t: f64, (q, p): (&[f64; N], &[f64; N]), velocity: &[f64; N]) -> f64 {
        legendre::energy_at(self, t, q, p, velocity)
    }

    fn energy_rounding(
        &self,
        (t, time): (f64, f64),
        (q, p): (&[f64; N], &[f64; N]),
        velocity: &[f64; N],
    ) -> f64 {
        legendre::energy_rounding(self, t, q, p, velocity)
            + constrained::work_of_roundings(self, (t, time), q, velocity)
    }

    fn force_rounding(&self, t: f64, (q, p): (&[f64; N], &[f64; N]), velocity: &[f64; N]) -> f64 {
        legendre::force_rounding(self, t, q, p, velocity)
            + constrained::reaction_rounding(self, t, q, velocity)
    }

    fn outputs(
        &self,
        t: f64,
        (q, p): (&[f64; N], &[f64; N]),
        velocity: &[f64; N],
        values: &mut [f64],
    ) {
        let z = match M::FORM {
            Form::Lagrangian => velocity,
            Form::Hamiltonian => p,
        };
        self.observables(t, q, z, values);
    }

    fn residual(&self, t: f64, q: &[f64; N], velocity: &[f64; N]) -> ConstraintResidual {
        let residuals = constrained::residuals(self, t, q, velocity, 1.0);
        largest(&residuals, &constrained::independent(self, t, q))
    }

    fn reactions(&self, t: f64, (q, p): (&[f64; N], &[f64; N]), velocity: &[f64; N]) -> Vec<f64> {
        let (q, p) = (*q, *p);
        match constrained::reactions(self, t, &State { q, p }, velocity) {
            Ok(reactions) => reactions,
            Err(_) => vec![f64::NAN; M::CONSTRAINTS.len()],
        }
    }

    fn with(&self, parameter: &str, value: f64) -> Option<Self> {
        self.with_parameter(self.find_parameter(parameter)?, value)
    }
}

impl<M: family::Model> Evaluate<0, RunTimeLength> for M {
    const IS_CONSTRAINED: bool = M::CONSTRAINED;
    const NEEDS_VELOCITY: bool = matches!(M::FORM, Form::Lagrangian);

    fn checked(&self) -> Result<(), ModelError> {
        self.check()
    }

    fn coordinate_names(&self) -> Vec<CoordinateName> {
        names(self.len(), &|a| self.coordinate_name(a))
    }

    fn output_names(&self) -> Vec<CoordinateName> {
        names(self.columns(), &|at| self.column_name(at))
    }

    fn constraint_names(&self) -> Vec<CoordinateName> {
        names(self.constraints(), &|row| self.constraint_name(row))
    }

    fn velocity(&self, t: f64, state: &FamilyState, _: &Vec<f64>) -> Option<Vec<f64>> {
        family::velocity(self, t, state).ok()
    }

    fn energy(&self, t: f64, (q, p): (&Vec<f64>, &Vec<f64>), velocity: &Vec<f64>) -> f64 {
        family::energy_at(self, t, (q, p), velocity)
    }

    fn energy_rounding(
        &self,
        (t, time): (f64, f64),
        (q, p): (&Vec<f64>, &Vec<f64>),
        velocity: &Vec<f64>,
    ) -> f64 {
        family::energy_rounding(self, t, (q, p), velocity)
            + family::work_of_roundings(self, (t, time), q, velocity)
    }

    fn force_rounding(&self, t: f64, (q, p): (&Vec<f64>, &Vec<f64>), velocity: &Vec<f64>) -> f64 {
        family::force_rounding(self, t, (q, p), velocity)
            + family::reaction_rounding(self, t, q, velocity)
    }

    fn outputs(
        &self,
        t: f64,
        (q, p): (&Vec<f64>, &Vec<f64>),
        velocity: &Vec<f64>,
        values: &mut [f64],
    ) {
        let z = match M::FORM {
            Form::Lagrangian => velocity,
            Form::Hamiltonian => p,
        };
        self.observables(t, q, z, values);
    }

    fn residual(&self, t: f64, q: &Vec<f64>, velocity: &Vec<f64>) -> ConstraintResidual {
        let (position, rate) = family::constraint_residual(self, t, q, velocity);
        ConstraintResidual {
            position,
            velocity: rate,
            rank: self.constraints(),
        }
    }

    fn reactions(&self, t: f64, (q, _): (&Vec<f64>, &Vec<f64>), velocity: &Vec<f64>) -> Vec<f64> {
        let reactions = family::reactions(self, t, q, velocity);
        reactions.unwrap_or_else(|| vec![f64::NAN; self.constraints()])
    }

    fn with(&self, parameter: &str, value: f64) -> Option<Self> {
        let mut names = (0..self.parameters()).map(|index| self.parameter_name(index));
        let index = names.position(|name| name.is(parameter))?;
        self.with_parameter(index, value)
    }
}
