//! Models in the engine, which derives their kernels at run time.

use tfe_symbolic::compile::declare;
use tfe_symbolic::derive::derivation::Derivation;
use tfe_symbolic::model::declared::{Constraint, Parameter};
use tfe_symbolic::program::interpret::{Environment, Results, interpret};
use tfe_symbolic::program::{self, Program, Request};
use tfe_symbolic::syntax::context::{Context, Field, FieldKind, Length};

/// The model in the engine: derived at run time from the text of the declaration.
pub struct Oracle {
    pub derivation: Derivation,
    pub sensitivities: Vec<Parameter>,
    pub constraints: Vec<Constraint>,
    pub environment: Environment,
}

impl Oracle {
    /// Fields as name, type and values; sizes as name and value.
    pub fn new(text: &str, fields: &[(&str, &str, &[f64])], sizes: &[(&str, i64)]) -> Self {
        let context = Context {
            struct_name: "Oracle".to_owned(),
            fields: fields
                .iter()
                .map(|(name, kind, _)| field(name, kind))
                .collect(),
            const_parameters: sizes.iter().map(|(name, _)| (*name).to_owned()).collect(),
        };
        let declared =
            declare(text, &context).unwrap_or_else(|mistakes| panic!("{text}\n{mistakes:#?}"));
        let mut environment = Environment::default();
        for (name, kind, values) in fields {
            if *kind == "f64" {
                environment.parameters.insert((*name).to_owned(), values[0]);
            } else {
                environment
                    .arrays
                    .insert((*name).to_owned(), values.to_vec());
            }
        }
        environment.sizes = sizes
            .iter()
            .map(|(name, size)| ((*name).to_owned(), *size))
            .collect();
        Self {
            derivation: Derivation::of(&declared),
            sensitivities: declared.sensitivities,
            constraints: declared.constraints,
            environment,
        }
    }

    pub fn run(&self, request: Request) -> Results {
        self.interpreted(&self.derivation.program(request))
    }

    pub fn interpreted(&self, program: &Program) -> Results {
        interpret(program, &self.environment).unwrap_or_else(|error| panic!("{error}\n{program}"))
    }

    /// The derivative by the time, or by the parameter of this number.
    pub fn value(&mut self, by: program::By) -> &mut f64 {
        let known = "a parameter with a value";
        match by {
            program::By::Time => &mut self.environment.time,
            program::By::Parameter(number) => {
                let Parameter { field, element } = &self.sensitivities[number];
                let environment = &mut self.environment;
                match element {
                    None => environment.parameters.get_mut(field).expect(known),
                    Some(element) => &mut environment.arrays.get_mut(field).expect(known)[*element],
                }
            }
        }
    }

    /// Difference quotients of eighth order of the first derivatives and forces, and the size of these.
    pub fn difference_quotient(&mut self, by: program::By) -> (Vec<f64>, f64) {
        let first = self.derivation.program(Request {
            first: true,
            ..Request::default()
        });
        let at = *self.value(by);
        let (mut quotient, mut size) = (vec![0.0; 3 * self.environment.q.len()], 0.0_f64);
        for (step, weight) in [
            (1.0, 4.0 / 5.0),
            (2.0, -1.0 / 5.0),
            (3.0, 4.0 / 105.0),
            (4.0, -1.0 / 280.0),
        ] {
            for sign in [1.0, -1.0] {
                *self.value(by) = at + sign * step * STEP;
                let values = flat(&self.interpreted(&first));
                for (sum, value) in quotient.iter_mut().zip(values) {
                    *sum += sign * weight / STEP * value;
                    size = size.max(value.abs());
                }
            }
        }
        *self.value(by) = at;
        (quotient, size)
    }
}

/// The step of difference quotients: the truncation error h⁸ is below the last digit, and the division by h costs two
/// digits.
pub const STEP: f64 = 5e-3;

/// The first derivatives, followed by the forces.
pub fn flat(results: &Results) -> Vec<f64> {
    [&results.z[..], &results.q, &results.force].concat()
}

/// The type: `f64`, `[f64; 3]` or `[f64; N]`.
fn field(name: &str, kind: &str) -> Field {
    let length = kind
        .strip_prefix("[f64;")
        .and_then(|rest| rest.strip_suffix(']'))
        .map(str::trim);
    let kind = match length {
        None => FieldKind::Scalar,
        Some(length) => FieldKind::Array(match length.parse() {
            Ok(number) => Length::Literal(number),
            Err(_) => Length::ConstParameter(length.to_owned()),
        }),
    };
    Field {
        name: name.to_owned(),
        kind,
    }
}
