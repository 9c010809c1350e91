//! The modes of ½ q̇ᵀ M q̇ − ½ qᵀ K q + f·q.

use super::diagonal::diagonal;
use super::error::ModalError;
use nalgebra::{Cholesky, DMatrix, DVector, Dyn, SymmetricEigen};
use tfe_runtime::Form;

/// A quadratic energy function, as a Lagrangian.
#[derive(Clone, Debug)]
pub struct Quadratic {
    /// The mass matrix M.
    mass: DMatrix<f64>,
    /// The stiffness matrix K.
    stiffness: DMatrix<f64>,
    /// f, the force at q = 0.
    pub(super) slope_q: DVector<f64>,
    /// The momentum at zero velocity, due to terms of L linear in velocities; it has no effect on the motion.
    pub(super) offset: Vec<f64>,
}

/// All modes, by ascending ω², and the equilibrium.
#[derive(Clone, Debug)]
pub(super) struct Modes {
    /// The squared frequencies ω².
    pub(super) squares: Vec<f64>,
    /// The mode shapes φ.
    pub(super) shapes: Vec<Vec<f64>>,
    /// The momenta M φ.
    pub(super) momenta: Vec<Vec<f64>>,
    /// The remaining modal forces: φ·f of modes with ω = 0.
    pub(super) load: Vec<f64>,
    /// The static solution q_s.
    pub(super) rest: Vec<f64>,
}

impl Quadratic {
    /// From the second derivatives by zz, zq, qq and the first ones by z and q, all at zero.
    pub(super) fn new(
        form: Form,
        [zz, zq, qq]: [DMatrix<f64>; 3],
        [slope_z, slope_q]: [DVector<f64>; 2],
    ) -> Result<Self, ModalError> {
        let numbers = zz
            .iter()
            .chain(&zq)
            .chain(&qq)
            .chain(&slope_z)
            .chain(&slope_q);
        if !numbers.copied().all(f64::is_finite) {
            return Err(ModalError::NotFinite);
        }
        let gyroscopic = &zq - zq.transpose();
        // Without these terms the rest is symmetric.
        for entries in [&gyroscopic, &zq] {
            if let Some(at) = entries.iter().position(|entry| *entry != 0.0) {
                return Err(ModalError::VelocityCoupling {
                    velocity: at % zq.nrows(),
                    coordinate: at / zq.nrows(),
                });
            }
        }
        Ok(match form {
            Form::Lagrangian => Self {
                mass: zz,
                stiffness: -qq,
                slope_q,
                offset: slope_z.as_slice().to_vec(),
            },
            Form::Hamiltonian => {
                // v = M⁻¹ p + b
                let mass = factors(zz)?.inverse();
                let offset = -(&mass * slope_z);
                Self {
                    mass,
                    stiffness: qq,
                    slope_q: -slope_q,
                    offset: offset.as_slice().to_vec(),
                }
            }
        })
    }

    /// With M = C Cᵀ, the eigenvectors u of C⁻¹ K C⁻ᵀ give φ = C⁻ᵀ u (T-112), up to rounding errors of the largest ω².
    pub(super) fn modes(&self) -> Result<Modes, ModalError> {
        let n = self.slope_q.len();
        let lower = factors(self.mass.clone())?.unpack();
        let half = lower.solve_lower_triangular(&self.stiffness);
        let scaled = half.and_then(|half| lower.solve_lower_triangular(&half.transpose()));
        let scaled = scaled.ok_or(ModalError::MassNotPositive)?;
        let symmetric = (&scaled + scaled.transpose()) * 0.5;
        let most = 100 * (n + 10);
        let eigen = SymmetricEigen::try_new(symmetric, f64::EPSILON, most);
        let eigen = eigen.ok_or(ModalError::NoEigenvalues)?;
        let shapes = lower.tr_solve_lower_triangular(&eigen.eigenvectors);
        let shapes = shapes.ok_or(ModalError::MassNotPositive)?;
        let (squares, shapes) = diagonal(&self.stiffness, shapes);
        let mut order: Vec<usize> = (0..n).collect();
        order.sort_by(|a, b| squares[*a].total_cmp(&squares[*b]));
        let mut modes = Modes {
            squares: Vec::with_capacity(n),
            shapes: Vec::with_capacity(n),
            momenta: Vec::with_capacity(n),
            load: Vec::with_capacity(n),
            rest: vec![0.0; n],
        };
        for k in order {
            modes.push(squares[k], positive(shapes.column(k).into_owned()), self);
        }
        Ok(modes)
    }
}

impl Modes {
    fn push(&mut self, square: f64, shape: DVector<f64>, of: &Quadratic) {
        let force = shape.dot(&of.slope_q);
        if square != 0.0 {
            for (rest, entry) in self.rest.iter_mut().zip(&shape) {
                *rest += entry * force / square;
            }
        }
        self.squares.push(square);
        self.load.push(if square == 0.0 { force } else { 0.0 });
        self.momenta.push((&of.mass * &shape).as_slice().to_vec());
        self.shapes.push(shape.as_slice().to_vec());
    }
}

/// The same mode with the sign for which its largest entry is positive.
fn positive(shape: DVector<f64>) -> DVector<f64> {
    if shape[shape.iamax()] < 0.0 {
        -shape
    } else {
        shape
    }
}

/// The Cholesky factors of a matrix that is positive definite beyond rounding errors, whatever its units.
fn factors(matrix: DMatrix<f64>) -> Result<Cholesky<f64, Dyn>, ModalError> {
    let roundings = matrix.diagonal() * (matrix.nrows() as f64 * f64::EPSILON);
    let factors = Cholesky::new(matrix).ok_or(ModalError::MassNotPositive)?;
    let roots = factors.l_dirty().diagonal();
    let mut pivots = roots.iter().zip(&roundings);
    if pivots.all(|(root, rounding)| root * root > *rounding) {
        Ok(factors)
    } else {
        Err(ModalError::MassNotPositive)
    }
}
