//! The number of arithmetic operations in the kernels, for models whose counts are published for other symbolic tools.
//!
//! Counted are L, its gradient and the upper half of its Hessian together, by x = (q, q̇), with all constants as
//! numbers. A cell of the table shows additions and subtractions / multiplications / divisions / evaluations of sine or
//! cosine (weighted sum). Negations are not counted. A sine and a cosine of the same argument are two evaluations, as
//! in the published columns. In the weighted sum an addition counts 1, a multiplication 1, a division 6 and a pair of
//! sine and cosine 25; the kernels here evaluate such a pair at once.
//!
//! The kernels here compute the sine and cosine of a difference of angles from those of the angles, with four products
//! and two sums. This is why the chains of links need more products than with the other tools, but far fewer
//! evaluations of sine and cosine.

use std::error::Error;
use tfe_symbolic::compile::declare;
use tfe_symbolic::derive::derivation::Derivation;
use tfe_symbolic::program::Request;
use tfe_symbolic::syntax::context::Context;

/// A model: its name, its declaration, and the counts of SymPy (`cse`, the better result with and without basic
/// optimisations), CasADi (SX with `cse`) and SymForce (`cse`).
pub struct Model {
    /// The name in the table.
    pub name: &'static str,
    /// The arguments of `#[dynamics(…)]`.
    pub declaration: &'static str,
    /// Additions, multiplications, divisions, and evaluations of sine or cosine, for each tool.
    pub published: [[usize; 4]; 3],
}

/// The models of the comparison.
pub const MODELS: [Model; 5] = [
    Model {
        name: "double pendulum",
        declaration: "coordinates(a, b), lagrangian = dot(a)^2 + dot(b)^2/2 + dot(a)*dot(b)*cos(a - b) + 9.81*(2*cos(a) + cos(b))",
        published: [[10, 14, 0, 6], [11, 16, 1, 6], [11, 16, 0, 6]],
    },
    Model {
        name: "three links",
        declaration: "coordinates(q[3]), lagrangian = sum(i in 0..3, (3 - i)/2*dot(q[i])^2) \
            + sum(i in 0..2, sum(j in i+1..3, (3 - j)*dot(q[i])*dot(q[j])*cos(q[i] - q[j]))) \
            + sum(i in 0..3, 9.81*(3 - i)*cos(q[i]))",
        published: [[29, 39, 0, 12], [33, 36, 0, 12], [32, 39, 0, 12]],
    },
    Model {
        name: "five links",
        declaration: "coordinates(q[5]), lagrangian = sum(i in 0..5, (5 - i)/2*dot(q[i])^2) \
            + sum(i in 0..4, sum(j in i+1..5, (5 - j)*dot(q[i])*dot(q[j])*cos(q[i] - q[j]))) \
            + sum(i in 0..5, 9.81*(5 - i)*cos(q[i]))",
        published: [[94, 105, 0, 30], [107, 109, 0, 30], [104, 105, 0, 30]],
    },
    Model {
        name: "heavy top",
        declaration: "coordinates(phi, theta, psi), lagrangian = 1/2*(dot(theta)^2 + (dot(phi)*sin(theta))^2) \
            + 0.5/2*(dot(psi) + dot(phi)*cos(theta))^2 - 2*cos(theta)",
        published: [[12, 28, 0, 2], [14, 33, 0, 2], [12, 31, 0, 2]],
    },
    Model {
        name: "6-DOF body",
        declaration: "coordinates(x, y, z, phi, theta, psi), \
            let o1 = dot(phi)*sin(theta)*sin(psi) + dot(theta)*cos(psi), \
            let o2 = dot(phi)*sin(theta)*cos(psi) - dot(theta)*sin(psi), \
            let o3 = dot(phi)*cos(theta) + dot(psi), \
            lagrangian = 0.7*(dot(x)^2 + dot(y)^2 + dot(z)^2) + (o1^2 + 2*o2^2 + 3.5*o3^2)/2 - 13.734*z",
        published: [[28, 76, 0, 4], [54, 122, 1, 4], [39, 88, 0, 4]],
    },
];

/// Additions, multiplications, divisions, and evaluations of sine or cosine, where a pair counts as two, as in the
/// published columns.
pub fn counted(model: &Model) -> Result<[usize; 4], Box<dyn Error>> {
    let context = Context {
        struct_name: "Model".to_owned(),
        ..Context::default()
    };
    let declared = declare(model.declaration, &context).map_err(|diagnostics| {
        diagnostics
            .iter()
            .map(|d| d.render(model.declaration))
            .collect::<String>()
    })?;
    let request = Request {
        value: true,
        first: true,
        second: true,
        ..Request::default()
    };
    let counts = Derivation::of(&declared).counts(request);
    Ok([
        counts.additions,
        counts.multiplications,
        counts.divisions,
        counts.sine_cosine_evaluations(),
    ])
}

/// The weighted sum, in which a pair of sine and cosine counts 25.
pub fn weighted(counts: [usize; 4]) -> f64 {
    let [additions, multiplications, divisions, evaluations] = counts.map(|count| count as f64);
    additions + multiplications + 6.0 * divisions + 12.5 * evaluations
}

/// The smallest weighted sum of the other tools.
pub fn least_published(model: &Model) -> f64 {
    model
        .published
        .iter()
        .fold(f64::INFINITY, |least, counts| least.min(weighted(*counts)))
}

#[allow(dead_code)] // the test that pins the counts includes this file
fn main() -> Result<(), Box<dyn Error>> {
    let show = |c: [usize; 4]| format!("{}/{}/{}/{} ({:.0})", c[0], c[1], c[2], c[3], weighted(c));
    println!(
        "{:<16} {:>20} {:>20} {:>20} {:>20}",
        "model", "here", "SymPy", "CasADi", "SymForce"
    );
    for model in &MODELS {
        let here = counted(model)?;
        let [sympy, casadi, symforce] = model.published.map(show);
        println!(
            "{:<16} {:>20} {sympy:>20} {casadi:>20} {symforce:>20}",
            model.name,
            show(here)
        );
        assert!(
            weighted(here) < least_published(model),
            "{} needs more operations than the best published count",
            model.name
        );
    }
    Ok(())
}
