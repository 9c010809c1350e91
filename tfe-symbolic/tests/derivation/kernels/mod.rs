//! Kernels of declarations that are text, with the values of parameters.

use tfe_symbolic::compile::declare;
use tfe_symbolic::derive::derivation::Derivation;
use tfe_symbolic::program::Request;
use tfe_symbolic::program::interpret::{Environment, Results, interpret};
use tfe_symbolic::syntax::context::{Context, Field, FieldKind};

/// The results of a model with these parameters that are asked for.
#[track_caller]
pub fn results_of(
    text: &str,
    parameters: &[(&str, f64)],
    request: Request,
    q: &[f64],
    z: &[f64],
) -> Results {
    let program = derivation_of(text, parameters).program(request);
    let environment = environment_of(parameters, q, z);
    interpret(&program, &environment).expect("a complete environment")
}

#[track_caller]
pub fn derivation_of(text: &str, parameters: &[(&str, f64)]) -> Derivation {
    let field = |(name, _): &(&str, f64)| Field {
        name: (*name).to_owned(),
        kind: FieldKind::Scalar,
    };
    let context = Context {
        fields: parameters.iter().map(field).collect(),
        ..Context::default()
    };
    let declared =
        declare(text, &context).unwrap_or_else(|problems| panic!("{text}: {problems:?}"));
    Derivation::of(&declared)
}

pub fn environment_of(parameters: &[(&str, f64)], q: &[f64], z: &[f64]) -> Environment {
    let parameter = |(name, value): &(&str, f64)| ((*name).to_owned(), *value);
    Environment {
        q: q.to_vec(),
        z: z.to_vec(),
        parameters: parameters.iter().map(parameter).collect(),
        ..Environment::default()
    }
}
