//! Transcription of elements to blocks of equations.
//!
//! The interior variables of an element are the rates ν_j of the coordinates (and, for a Hamiltonian, the momenta p_l
//! at the points). The outer ones are the state (p, q) of its first node and the coefficients of its inputs, which are
//! polynomials in time. With the tables of the element (theory.md, section 6.4)
//!
//! ```text
//! q_l = q₀ + h Σ_j C_lj ν_j ,     v_l = Σ_j E_lj ν_j ,     u_l = Σ_k P_k(c_l) û_k ,
//! Σ_l P_il p_l − p₀ − h Σ_l G_il f_l = 0 ,     p₁ = p₀ + h Σ_l b_l f_l ,     q₁ = q₀ + h Σ_j β_j ν_j .
//! ```

use super::block::{Block, Point};
use nalgebra::DMatrix;
use tfe_runtime::Form;
use tfe_runtime::basis::{MAX_NODES, legendre};
use tfe_runtime::scheme::SchemeRef;

/// The numbers of variables of an element.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Sizes {
    /// The number N of coordinates.
    pub(super) dof: usize,
    /// The number of interior variables x.
    pub(super) interior: usize,
    /// The number of inputs.
    pub(super) inputs: usize,
    /// The number of coefficients of each input.
    pub(super) coefficients: usize,
}

impl Sizes {
    pub(super) fn new(
        form: Form,
        dof: usize,
        scheme: &SchemeRef<'_>,
        inputs: usize,
        coefficients: usize,
    ) -> Self {
        let momenta = match form {
            Form::Lagrangian => 0,
            Form::Hamiltonian => scheme.points(),
        };
        Self {
            dof,
            interior: dof * (scheme.unknowns() + momenta),
            inputs,
            coefficients,
        }
    }

    /// The number of coefficients of all inputs.
    pub(super) fn steering(&self) -> usize {
        self.inputs * self.coefficients
    }

    /// The number of outer variables: (p₀, q₀) and the coefficients of the inputs.
    pub(super) fn outer(&self) -> usize {
        2 * self.dof + self.steering()
    }

    /// The number of all variables s.
    pub(super) fn all(&self) -> usize {
        self.interior + self.outer()
    }
}

/// The block of an element. Its rows are the interior equations, then the end (p₁, q₁).
pub(super) fn element(
    form: Form,
    scheme: &SchemeRef<'_>,
    sizes: &Sizes,
    (time, h): (f64, f64),
    costs: &[usize],
) -> Block {
    let Sizes {
        dof: n,
        interior,
        inputs,
        coefficients,
    } = *sizes;
    let (points, unknowns) = (scheme.points(), scheme.unknowns());
    let (p0, q0, steering) = (interior, interior + n, interior + 2 * n);
    let rows = interior + 2 * n;
    let (end_p, end_q) = (interior, interior + n);
    let is_hamiltonian = form == Form::Hamiltonian;
    // The momenta at the points are variables, with the rows v_l = H_p.
    let momentum = |l: usize, a: usize| (unknowns + l) * n + a;
    let mut linear = DMatrix::zeros(rows, sizes.all());
    for a in 0..n {
        for i in 0..unknowns {
            linear[(i * n + a, p0 + a)] = -1.0;
            linear[(end_q + a, i * n + a)] = h * scheme.advance[i];
        }
        linear[(end_p + a, p0 + a)] = 1.0;
        linear[(end_q + a, q0 + a)] = 1.0;
        if is_hamiltonian {
            for l in 0..points {
                for i in 0..unknowns {
                    linear[(i * n + a, momentum(l, a))] = scheme.momentum[i * points + l];
                    linear[(momentum(l, a), i * n + a)] = scheme.velocity[l * unknowns + i];
                }
            }
        }
    }
    let mut basis = [0.0; MAX_NODES];
    let points = (0..points).map(|l| {
        legendre(scheme.nodes[l], &mut basis);
        let mut map = DMatrix::zeros(2 * n + inputs, sizes.all());
        let mut into = DMatrix::zeros(rows, 2 * n);
        for a in 0..n {
            map[(a, q0 + a)] = 1.0;
            for j in 0..unknowns {
                map[(a, j * n + a)] = h * scheme.position[l * unknowns + j];
            }
            if is_hamiltonian {
                map[(n + a, momentum(l, a))] = 1.0;
                into[(momentum(l, a), a)] = -1.0;
            } else {
                for j in 0..unknowns {
                    map[(n + a, j * n + a)] = scheme.velocity[l * unknowns + j];
                }
            }
            for i in 0..unknowns {
                if !is_hamiltonian {
                    into[(i * n + a, a)] = scheme.momentum[i * points + l];
                }
                into[(i * n + a, n + a)] = -h * scheme.force[i * points + l];
            }
            into[(end_p + a, n + a)] = h * scheme.weights[l];
        }
        for k in 0..coefficients {
            for input in 0..inputs {
                map[(2 * n + input, steering + k * inputs + input)] = basis[k];
            }
        }
        Point {
            t: time + scheme.nodes[l] * h,
            weight: h * scheme.weights[l],
            map,
            into,
        }
    });
    Block {
        interior,
        points: points.collect(),
        linear,
        costs: costs.to_vec(),
    }
}

/// The block of the cost of the end. For a Lagrangian, its interior variable is the velocity, with L_v − p = 0.
pub(super) fn end(form: Form, n: usize, time: f64, costs: &[usize]) -> Block {
    let interior = match form {
        Form::Lagrangian => n,
        Form::Hamiltonian => 0,
    };
    let mut linear = DMatrix::zeros(interior, interior + 2 * n);
    let mut map = DMatrix::zeros(2 * n, interior + 2 * n);
    let mut into = DMatrix::zeros(interior, 2 * n);
    for a in 0..n {
        map[(a, interior + n + a)] = 1.0;
        match form {
            Form::Lagrangian => {
                map[(n + a, a)] = 1.0;
                into[(a, a)] = 1.0;
                linear[(a, interior + a)] = -1.0;
            }
            Form::Hamiltonian => map[(n + a, interior + a)] = 1.0,
        }
    }
    Block {
        interior,
        linear,
        points: vec![Point {
            t: time,
            weight: 1.0,
            map,
            into,
        }],
        costs: costs.to_vec(),
    }
}
