//! The kernels of a model, run by the interpreter.

use tfe_symbolic::derive::derivation::Derivation;
use tfe_symbolic::program::interpret::{Environment, Results, interpret};
use tfe_symbolic::program::{Program, Request};

use super::entries::Array;
use super::formula::State;
use super::writer::Model;

/// One program and the arrays that it computes.
pub struct Kernel {
    pub name: &'static str,
    pub arrays: &'static [Array],
    program: Program,
}

const NOTHING: Request = Request::NOTHING;

const FIRST: Request = Request::FIRST;

/// All requests for which code is emitted.
const REQUESTS: [(&str, Request, &[Array]); 8] = [
    (
        "value",
        Request {
            value: true,
            ..NOTHING
        },
        &[Array::Value],
    ),
    ("first", FIRST, &[Array::ByZ, Array::ByQ, Array::Force]),
    (
        "first+mass",
        Request {
            mass: true,
            ..FIRST
        },
        &[Array::ByZ, Array::ByQ, Array::Force, Array::ZZ],
    ),
    (
        "first+second",
        Request {
            second: true,
            ..FIRST
        },
        &[
            Array::ByZ,
            Array::ByQ,
            Array::Force,
            Array::ZZ,
            Array::ZQ,
            Array::QQ,
            Array::ForceZ,
            Array::ForceQ,
        ],
    ),
    (
        "observables",
        Request {
            observables: true,
            ..NOTHING
        },
        &[Array::Observable],
    ),
    (
        "constraint values",
        Request {
            constraint_values: true,
            ..NOTHING
        },
        &[Array::Phi],
    ),
    (
        "constraint rows",
        Request {
            constraint_rows: true,
            ..NOTHING
        },
        &[Array::Row, Array::Drift],
    ),
    (
        "constraint second",
        Request {
            constraint_second: true,
            ..NOTHING
        },
        &[
            Array::PsiQ,
            Array::RowRate,
            Array::Bend,
            Array::RateQ,
            Array::RateV,
        ],
    ),
];

/// All kernels that compute anything.
pub fn kernels(derivation: &Derivation) -> Vec<Kernel> {
    let by_request = REQUESTS.map(|(name, request, arrays)| Kernel {
        name,
        arrays,
        program: derivation.program(request),
    });
    let forces = Kernel {
        name: "forces",
        arrays: &[Array::ByQ, Array::Force],
        program: derivation.forces(),
    };
    let mut kernels: Vec<Kernel> = by_request.into_iter().chain([forces]).collect();
    kernels.retain(|kernel| !kernel.program.statements.is_empty());
    kernels
}

/// The results of all kernels at a state; nothing where a program cannot run.
pub fn run(kernels: &[Kernel], model: &Model, state: &State) -> Vec<Option<Results>> {
    let parameters = model.parameters.iter().cloned();
    let environment = Environment {
        time: state.time,
        q: state.q.clone(),
        z: state.z.clone(),
        mu: state.mu.clone(),
        parameters: parameters.zip(state.parameters.iter().copied()).collect(),
        ..Environment::default()
    };
    let run = |kernel: &Kernel| interpret(&kernel.program, &environment).ok();
    kernels.iter().map(run).collect()
}
