//! Operations and their operands.

use super::Emitter;
use crate::indices::{identifier, index, number, real, signed};
use proc_macro2::{Literal, TokenStream};
use quote::{format_ident, quote};
use tfe_symbolic::expr::comparison::Comparison;
use tfe_symbolic::expr::input::Input;
use tfe_symbolic::program::{Operand, Operation};

impl Emitter<'_> {
    pub(super) fn operation(&mut self, operation: &Operation) -> TokenStream {
        match operation {
            Operation::Add(a, b) => self.binary(a, &quote!(+), b),
            Operation::Subtract(a, b) => self.binary(a, &quote!(-), b),
            Operation::Multiply(a, b) => self.binary(a, &quote!(*), b),
            Operation::Divide(a, b) => self.binary(a, &quote!(/), b),
            Operation::Negate(a) => {
                let a = self.operand(a);
                quote!(-#a)
            }
            Operation::IntegerPower(a, exponent) => {
                let (a, exponent) = (self.operand(a), Literal::i32_unsuffixed(*exponent));
                quote!(#a.powi(#exponent))
            }
            Operation::Power(a, b) => {
                let (a, b) = (self.operand(a), self.operand(b));
                quote!(#a.powf(#b))
            }
            Operation::Call(function, arguments) => {
                let method = format_ident!("{}", function.method());
                let mut arguments = arguments.iter();
                let receiver = arguments.next().map(|a| self.operand(a));
                let rest: Vec<_> = arguments.map(|a| self.operand(a)).collect();
                quote!(#receiver.#method(#(#rest),*))
            }
            Operation::Select {
                comparison,
                left,
                right,
                then,
                otherwise,
            } => {
                let (mut left, mut right) = (self.operand(left), self.operand(right));
                let (then, otherwise) = (self.operand(then), self.operand(otherwise));
                if matches!(comparison, Comparison::Greater | Comparison::GreaterOrEqual) {
                    std::mem::swap(&mut left, &mut right);
                }
                let method = match comparison {
                    Comparison::Less | Comparison::Greater => quote!(less),
                    Comparison::LessOrEqual | Comparison::GreaterOrEqual => quote!(less_or_equal),
                };
                quote!(R::select(#left.#method(#right), #then, #otherwise))
            }
        }
    }

    fn binary(&mut self, a: &Operand, operator: &TokenStream, b: &Operand) -> TokenStream {
        let (a, b) = (self.operand(a), self.operand(b));
        quote!(#a #operator #b)
    }

    pub(super) fn operand(&mut self, operand: &Operand) -> TokenStream {
        match operand {
            Operand::Temporary(temporary) => {
                let name = self.name(*temporary);
                quote!(#name)
            }
            Operand::Constant(value) => {
                let value = number(*value);
                quote!(t.like(#value))
            }
            Operand::Input(input) => self.input(input),
        }
    }

    fn input(&mut self, input: &Input) -> TokenStream {
        match input {
            Input::Time => quote!(t),
            Input::Coordinate(a) => self.at(&quote!(q), &[a]),
            Input::Velocity(a) | Input::Momentum(a) => {
                let z = &self.z;
                self.at(&quote!(#z), &[a])
            }
            Input::Multiplier(a) => self.at(&quote!(mu), &[a]),
            Input::Control(name) => {
                let place = self.inputs.iter().position(|own| own == name);
                let place = Literal::usize_unsuffixed(place.unwrap_or_default());
                quote!(inputs[#place])
            }
            Input::Parameter(name) => {
                let local = match self.parameters.get(name) {
                    Some(local) => local.clone(),
                    None => self.local_name(name),
                };
                self.parameters.insert(name.clone(), local.clone());
                quote!(#local)
            }
            Input::ParameterElement(name, a) => {
                let field = identifier(name);
                let element = self.at(&quote!(self.#field), &[a]);
                let first = self.places.get(name);
                match first.and_then(|first| first.plus_scaled(a, 1)) {
                    Some(place) => {
                        let place = index(&place);
                        quote!(t.parameter(#place, #element))
                    }
                    None => match self.run_time_places.get(name) {
                        Some(first) => {
                            let a = index(a);
                            let place = match first.to_string().as_str() {
                                "0" => quote!(#a),
                                _ => quote!(#first + #a),
                            };
                            quote!(t.parameter(#place, #element))
                        }
                        None => quote!(t.like(#element)),
                    },
                }
            }
            // Entries of lists may be any numbers.
            Input::Integer(a) if a.holds_entry() => {
                let value = real(a);
                quote!(t.like(#value))
            }
            Input::Integer(a) => {
                let value = signed(a);
                quote!(t.like((#value) as f64))
            }
            // Programs have none.
            Input::Placeholder(..) => TokenStream::new(),
        }
    }
}
