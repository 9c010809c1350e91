//! Shows how a declaration becomes code, as text: the declaration as parsed, what was derived from it, and the
//! operations of each kernel.
//!
//! `cargo run --example show_kernel` shows a pendulum on a cart. Pass a declaration and the names of its parameters to
//! see another model: `cargo run --example show_kernel -- 'coordinates(x), lagrangian = m/2*dot(x)^2 - k/2*x^2' m k`.

use std::error::Error;
use tfe_symbolic::compile::declare;
use tfe_symbolic::derive::derivation::Derivation;
use tfe_symbolic::program::Request;
use tfe_symbolic::syntax::context::{Context, Field, FieldKind};

const CART: &str = "coordinates(x, theta),
let tip_x = x + l*sin(theta),
let tip_y = -l*cos(theta),
lagrangian = mc/2*dot(x)^2 + m/2*(dot(tip_x)^2 + dot(tip_y)^2) - m*g*tip_y";

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let text = arguments.next().unwrap_or_else(|| CART.to_owned());
    let mut parameters: Vec<String> = arguments.collect();
    if text == CART {
        parameters = ["mc", "m", "l", "g"].map(str::to_owned).into();
    }
    let context = Context {
        struct_name: "Model".to_owned(),
        fields: parameters
            .into_iter()
            .map(|name| Field {
                name,
                kind: FieldKind::Scalar,
            })
            .collect(),
        const_parameters: Vec::new(),
    };
    let declared = match declare(&text, &context) {
        Ok(declared) => declared,
        Err(diagnostics) => {
            for diagnostic in diagnostics {
                eprintln!("{}", diagnostic.render(&text));
            }
            return Err("the declaration has errors".into());
        }
    };
    println!("{declared}\n");
    let derivation = Derivation::of(&declared);
    println!("{}", derivation.structure());
    let kernels = [
        (
            "energy function",
            Request {
                value: true,
                ..Request::default()
            },
        ),
        (
            "first derivatives",
            Request {
                first: true,
                ..Request::default()
            },
        ),
        (
            "first and second derivatives",
            Request {
                first: true,
                second: true,
                ..Request::default()
            },
        ),
    ];
    let constraints = [
        (
            "constraints",
            Request {
                constraint_values: true,
                ..Request::default()
            },
        ),
        (
            "rows of the constraints",
            Request {
                constraint_rows: true,
                ..Request::default()
            },
        ),
        (
            "derivatives of the constraints",
            Request {
                constraint_second: true,
                ..Request::default()
            },
        ),
    ];
    let constraints = if declared.constraints.is_empty() {
        &[]
    } else {
        constraints.as_slice()
    };
    for (name, request) in kernels.iter().chain(constraints) {
        println!(
            "\n{name}: {}\n{}",
            derivation.counts(*request),
            derivation.program(*request)
        );
    }
    Ok(())
}
