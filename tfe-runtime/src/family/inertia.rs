//! Mass matrices of models of run-time length, and their Legendre transform.

use super::model::{Block, Entries, FamilyState, Model, slope};
#[cfg(feature = "sparse")]
use super::{instant::Instant, node::Node, rows::Rows};
use crate::consistency::ModelError;
use crate::double_double::DoubleDouble;
use crate::model::{Form, NO_TIME};
use alloc::vec;
use alloc::vec::Vec;

/// A constant diagonal mass matrix.
#[derive(Clone, Debug)]
pub(super) struct Inertia {
    /// m
    pub(super) mass: Vec<f64>,
    /// 1/m
    pub(super) inverse: Vec<f64>,
    /// The rounding error of 1/m.
    pub(super) inverse_low: Vec<f64>,
}

impl Inertia {
    /// The masses of a model whose equations are M q̈ = f.
    pub(super) fn of<M: Model>(model: &M) -> Result<Self, ModelError> {
        let facts = M::FACTS;
        if !(facts.constant_mass && facts.separable) || M::MOMENTA_MOVE {
            return Err(ModelError::NotSecondOrder);
        }
        let zero = vec![0.0; model.len()];
        // Momenta have to be multiples of velocities.
        if slope(model, NO_TIME, &zero, &zero)
            .iter()
            .any(|p| *p != 0.0)
        {
            return Err(ModelError::NotSecondOrder);
        }
        let second = diagonal(model, NO_TIME, &zero, &zero)?;
        let over = |x: f64| DoubleDouble::ONE.over(DoubleDouble::new(x));
        let (mass, inverse): (Vec<f64>, Vec<f64>) = match M::FORM {
            Form::Lagrangian => second.iter().map(|m| (*m, 1.0 / m)).unzip(),
            Form::Hamiltonian => second
                .iter()
                .map(|inverse| (1.0 / inverse, *inverse))
                .unzip(),
        };
        let low = |(m, inverse): (&f64, &f64)| over(*m).minus(DoubleDouble::new(*inverse)).high;
        let inverse_low = mass.iter().zip(&inverse).map(low).collect();
        Ok(Self {
            mass,
            inverse,
            inverse_low,
        })
    }
}

/// Converts velocities to momenta of a Hamiltonian, and momenta to velocities of a Lagrangian.
#[derive(Clone, Debug, Default)]
pub(super) struct Legendre {
    /// For mass matrices that are not diagonal; made on first use.
    #[cfg(feature = "sparse")]
    node: Option<Node>,
    /// For singular mass matrices with constraints.
    #[cfg(feature = "sparse")]
    instant: Option<Instant>,
}

impl Legendre {
    /// The velocity at a state.
    pub(super) fn velocity<M: Model>(
        &mut self,
        model: &M,
        t: f64,
        state: &FamilyState,
    ) -> Result<Vec<f64>, ModelError> {
        if M::FORM == Form::Hamiltonian {
            return Ok(slope(model, t, &state.q, &state.p));
        }
        let own = self.other(model, t, &state.q, &state.p);
        #[cfg(feature = "sparse")]
        if M::CONSTRAINED && own.is_err() {
            // The momentum alone does not determine the velocity, as for a unit quaternion: the constraints do.
            let instant = match &mut self.instant {
                Some(instant) => instant,
                empty => empty.insert(Instant::new(model).ok_or(ModelError::TooLarge)?),
            };
            return instant.velocity(model, t, state);
        }
        own
    }

    /// The momentum that belongs to a velocity of a Hamiltonian, or the velocity that belongs to a momentum of a
    /// Lagrangian. Where the energy is quadratic with a diagonal mass matrix, this is one step of Newton's method from
    /// zero; otherwise (with the feature `sparse`) as many as it takes.
    pub(super) fn other<M: Model>(
        &mut self,
        model: &M,
        t: f64,
        q: &[f64],
        wanted: &[f64],
    ) -> Result<Vec<f64>, ModelError> {
        let zero = vec![0.0; model.len()];
        let second = match M::FACTS.quadratic_in_z {
            true => diagonal(model, t, q, &zero),
            false => Err(ModelError::NotSecondOrder),
        };
        let second = match second {
            Err(ModelError::NotSecondOrder | ModelError::MassNotDiagonal { .. })
                if cfg!(feature = "sparse") =>
            {
                return self.by_newton(model, t, q, wanted);
            }
            second => second?,
        };
        let offset = slope(model, t, q, &zero);
        let all = wanted.iter().zip(&offset).zip(&second);
        Ok(all
            .map(|((wanted, offset), second)| (wanted - offset) / second)
            .collect())
    }

    #[cfg(feature = "sparse")]
    fn by_newton<M: Model>(
        &mut self,
        model: &M,
        t: f64,
        q: &[f64],
        wanted: &[f64],
    ) -> Result<Vec<f64>, ModelError> {
        let free = Rows::none();
        let node = match &mut self.node {
            Some(node) => node,
            empty => empty.insert(Node::new(model, &free).ok_or(ModelError::TooLarge)?),
        };
        let mut z = vec![0.0; model.len()];
        node.solve(model, (t, q), wanted, &free, &mut z)
            .map_err(|_| ModelError::NoVelocity)?;
        // Where constraints determine the motion, the matrix may be singular up to rounding.
        match M::CONSTRAINED && !node.is_regular() {
            true => Err(ModelError::NoVelocity),
            false => Ok(z),
        }
    }

    #[cfg(not(feature = "sparse"))]
    fn by_newton<M: Model>(
        &mut self,
        _: &M,
        _: f64,
        _: &[f64],
        _: &[f64],
    ) -> Result<Vec<f64>, ModelError> {
        Err(ModelError::NotSecondOrder)
    }
}

/// The diagonal of ∂²/∂z∂z; fails if one of its entries is zero, or if there are entries off the diagonal.
fn diagonal<M: Model>(model: &M, t: f64, q: &[f64], z: &[f64]) -> Result<Vec<f64>, ModelError> {
    let mut found = Diagonal::new(model.len());
    model.mass(t, q, z, &mut found);
    if let Some((row, column)) = found.off {
        return Err(ModelError::MassNotDiagonal { row, column });
    }
    match found.entries.iter().position(|m| !(m.abs() > 0.0)) {
        Some(coordinate) => Err(ModelError::SingularMass { coordinate }),
        None => Ok(found.entries),
    }
}

/// The diagonal of L_vv.
#[cfg(feature = "sparse")]
pub(super) fn masses<M: Model>(model: &M, t: f64, q: &[f64], v: &[f64]) -> Vec<f64> {
    let mut found = Diagonal::new(model.len());
    model.mass(t, q, v, &mut found);
    found.entries
}

struct Diagonal {
    entries: Vec<f64>,
    off: Option<(usize, usize)>,
}

impl Diagonal {
    fn new(len: usize) -> Self {
        Self {
            entries: vec![0.0; len],
            off: None,
        }
    }
}

impl Entries<f64> for Diagonal {
    fn add(&mut self, _: Block, row: usize, column: usize, value: f64) {
        if row == column {
            self.entries[row] += value;
        } else if value != 0.0 {
            self.off = self.off.or(Some((row, column)));
        }
    }
}
