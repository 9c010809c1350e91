//! The whole way of a declaration: to messages where it is rejected, else to all programs of the model and of those made from it.

use tfe_symbolic::compile::declare;
use tfe_symbolic::derive::derivation::Derivation;
use tfe_symbolic::expr::ordered::SortedMap;
use tfe_symbolic::model::declared::{Declared, names};
use tfe_symbolic::program::count::Counts;
use tfe_symbolic::program::interpret::{Environment, InterpretError, interpret};
use tfe_symbolic::program::{By, Program, Request, Statement};
use tfe_symbolic::syntax::context::{Context, FieldKind, Length};

use super::Declaration;

/// Programs with more turns of loops are not run.
const MAX_TURNS: i64 = 10_000;

/// Whether a declaration is a model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// It is.
    Accepted,
    /// It has mistakes.
    Rejected,
}

/// Takes the whole way.
///
/// # Panics
/// If a rejected declaration has no message, and if a program uses a value before it is computed, or an entry that there is none of.
pub fn run(declaration: &Declaration) -> Outcome {
    let Declaration { context, arguments } = declaration;
    match declare(arguments, context) {
        Ok(declared) => {
            derive(&declared, context);
            Outcome::Accepted
        }
        Err(diagnostics) => {
            assert!(!diagnostics.is_empty(), "rejected without a message");
            for diagnostic in diagnostics {
                assert!(!diagnostic.message().is_empty(), "an empty message");
                let _ = diagnostic.help();
                if diagnostic.field().is_none() {
                    let _ = diagnostic.render(arguments);
                }
            }
            Outcome::Rejected
        }
    }
}

fn derive(declared: &Declared, context: &Context) {
    let _ = declared.to_string();
    let _ = names(&declared.coordinates);
    let derivation = Derivation::of(declared);
    let _ = derivation.structure().to_string();
    let _ = derivation.momenta_move();
    for program in programs(declared, &derivation) {
        let _ = Counts::of(&program).weighted();
        let _ = program.to_string();
        check(&program, declared, context);
    }
    for variant in &declared.variants {
        let mut context = context.clone();
        for (name, _) in &variant.added {
            let (name, kind) = (name.clone(), FieldKind::Scalar);
            let field = tfe_symbolic::syntax::context::Field { name, kind };
            context.fields.push(field);
        }
        derive(&variant.model, &context);
    }
}

/// All programs that the macro asks for.
fn programs(declared: &Declared, derivation: &Derivation) -> Vec<Program> {
    let nothing = Request::default();
    let first = Request {
        first: true,
        ..nothing
    };
    let mut requests = vec![
        Request {
            value: true,
            ..nothing
        },
        first,
        Request {
            mass: true,
            ..first
        },
        Request {
            second: true,
            ..first
        },
    ];
    if !declared.observables.is_empty() {
        requests.push(Request {
            observables: true,
            ..nothing
        });
    }
    if !declared.constraints.is_empty() {
        requests.extend([
            Request {
                constraint_values: true,
                ..nothing
            },
            Request {
                constraint_rows: true,
                ..nothing
            },
            Request {
                constraint_second: true,
                ..nothing
            },
        ]);
    }
    let mut programs: Vec<Program> = requests
        .into_iter()
        .map(|request| derivation.program(request))
        .collect();
    if declared.is_of_run_time_length() {
        programs.push(derivation.forces());
    }
    if !declared.sensitivities.is_empty() {
        programs.push(derivation.program_by(By::Time));
    }
    let parameters = 0..declared.sensitivities.len();
    programs.extend(parameters.map(|number| derivation.program_by(By::Parameter(number))));
    programs.extend(Derivation::hamiltonian(declared));
    programs
}

/// Where the number of coordinates is known, the program is run.
fn check(program: &Program, declared: &Declared, context: &Context) {
    let Some(dof) = declared.dof.as_constant() else {
        return;
    };
    let dof = usize::try_from(dof).unwrap_or(0);
    if dof > 100 || turns(&program.statements).is_none_or(|turns| turns > MAX_TURNS) {
        return;
    }
    let ramp = |length: usize| (0..length).map(|at| 0.3 + 0.1 * at as f64).collect();
    let mut environment = Environment {
        time: 0.7,
        q: ramp(dof),
        z: ramp(dof),
        mu: ramp(declared.constraints.len()),
        ..Environment::default()
    };
    for name in &context.const_parameters {
        environment.sizes.insert(name.clone(), 30);
    }
    for name in &declared.inputs {
        environment.parameters.insert(name.clone(), 0.9);
    }
    let mut arrays = SortedMap::new();
    for field in &context.fields {
        let name = field.name.clone();
        match &field.kind {
            FieldKind::Scalar => {
                environment.parameters.insert(name, 1.1);
            }
            FieldKind::Array(Length::Literal(length)) => {
                arrays.insert(name, ramp((*length).min(10_000)));
            }
            FieldKind::Array(Length::ConstParameter(_)) | FieldKind::Vector => {
                arrays.insert(name, ramp(30));
            }
            FieldKind::Length => {
                environment.sizes.insert(name, 30);
            }
            FieldKind::Indices | FieldKind::Other(_) => {}
        }
    }
    environment.arrays = arrays;
    match interpret(program, &environment) {
        Ok(_) => {}
        // Of a length that is known at run time only, or an index that is checked when the kernel is compiled for its parameters.
        Err(InterpretError::OutOfRange { array, .. })
            if context.field(&array).is_some() || !context.const_parameters.is_empty() => {}
        Err(error) => panic!("a program that cannot run: {error}\n{program}"),
    }
}

/// How many turns the loops take; nothing where that is not known.
fn turns(statements: &[Statement]) -> Option<i64> {
    let mut total: i64 = 0;
    for statement in statements {
        if let Statement::Loop {
            start, end, body, ..
        } = statement
        {
            let length = end.as_constant()?.checked_sub(start.as_constant()?)?;
            let inner = turns(body)?.checked_add(1)?;
            total = total.checked_add(length.checked_mul(inner)?)?;
        }
    }
    Some(total)
}
