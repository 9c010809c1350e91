//! The constraints of a model: their names and kinds, and their kernels.

use crate::emit::Emitter;
use crate::headings::Headings;
use crate::indices;
use crate::page;
use proc_macro2::{Literal, TokenStream};
use quote::quote;
use tfe_symbolic::derive::derivation::Derivation;
use tfe_symbolic::expr::input::Affine;
use tfe_symbolic::expr::ordered::SortedMap;
use tfe_symbolic::model::declared::{Constraint, ConstraintKind, Declared};
use tfe_symbolic::program::{Array, Program, Request, Statement};

/// The quantities that the kernels compute: φ(q, t), ψ(q, v, t) = A(q, t) v + a(q, t), and the derivatives that
/// Newton's method needs.
pub(crate) const VALUES: &str = "φ(q, t)";
pub(crate) const ROWS: &str = "A and a of ψ = A v + a";
const SECOND: &str = "∂ψ/∂q, Ȧ, ∂(Aᵀμ)/∂q, ∂(Ȧᵀμ)/∂q and ∂(Ȧᵀμ)/∂v";

/// The members for constraints in an implementation of `Model`; none if there are no constraints.
pub(crate) fn members(
    declared: &Declared,
    derivation: &Derivation,
    (coordinates, places): (&[String], &SortedMap<String, Affine>),
) -> TokenStream {
    if declared.constraints.is_empty() {
        return TokenStream::new();
    }
    let kernels = Kernels {
        declared,
        derivation,
        coordinates,
        places,
        dof: indices::index(&declared.dof),
        count: Literal::usize_unsuffixed(declared.constraints.len()),
    };
    let constraints = declared.constraints.iter().map(constant);
    let (values, rows, second) = (kernels.values(), kernels.rows(), kernels.second());
    quote! {
        const CONSTRAINTS: &'static [__tfe::Constraint] = &[#(#constraints),*];

        #values
        #rows
        #second
    }
}

fn constant(constraint: &Constraint) -> TokenStream {
    let name = &constraint.name;
    let kind = match constraint.kind {
        ConstraintKind::Holonomic { quadratic } => quote!(Holonomic { quadratic: #quadratic }),
        ConstraintKind::Velocity { integrable } => quote!(Velocity { integrable: #integrable }),
    };
    quote!(__tfe::Constraint { name: #name, kind: __tfe::ConstraintKind::#kind })
}

struct Kernels<'a> {
    declared: &'a Declared,
    derivation: &'a Derivation,
    coordinates: &'a [String],
    /// The indices of the parameters.
    places: &'a SortedMap<String, Affine>,
    dof: TokenStream,
    count: Literal,
}

impl Kernels<'_> {
    fn emitted(&self, program: &Program) -> TokenStream {
        Emitter::new(self.coordinates, quote!(second.))
            .with_velocity()
            .with_parameters(self.places)
            .with_headings(Headings::of(self.declared))
            .body(program)
            .statements
    }

    /// The first elements of a slice as an array: one check of the length instead of one for each index, and none that
    /// can panic.
    fn chunk(&self, name: &TokenStream, slice: &TokenStream) -> TokenStream {
        let count = &self.count;
        quote! {
            let ::core::option::Option::Some(#name) = #slice.first_chunk_mut::<#count>() else {
                return;
            };
        }
    }

    /// `constraint_values`, where a constraint is holonomic.
    fn values(&self) -> TokenStream {
        let program = self.derivation.program(Request {
            constraint_values: true,
            ..Request::default()
        });
        if program.statements.is_empty() {
            return TokenStream::new();
        }
        let dof = &self.dof;
        let (values, body) = (quote!(values), self.emitted(&program));
        let values = self.chunk(&values, &values);
        let doc = page::kernel(VALUES, &program);
        quote! {
            #[doc = #doc]
            fn constraint_values<R: __tfe::Real>(&self, t: R, q: &[R; #dof], values: &mut [R]) {
                #values
                #body
            }
        }
    }

    fn rows(&self) -> TokenStream {
        let program = self.derivation.program(Request {
            constraint_rows: true,
            ..Request::default()
        });
        let dof = &self.dof;
        let body = self.emitted(&program);
        let (rows, drift) = (quote!(rows), quote!(drift));
        let rows = writes(&program, |array| matches!(array, Array::Row(_)))
            .then(|| self.chunk(&rows, &rows));
        let drift = writes(&program, |array| matches!(array, Array::Drift(_)))
            .then(|| self.chunk(&drift, &drift));
        let doc = page::kernel(ROWS, &program);
        quote! {
            #[doc = #doc]
            fn constraint_rows<R: __tfe::Real>(
                &self,
                t: R,
                q: &[R; #dof],
                rows: &mut [[R; #dof]],
                drift: &mut [R],
            ) {
                #rows
                #drift
                #body
            }
        }
    }

    /// `constraint_second`, unless all constraints are affine with constant coefficients.
    fn second(&self) -> TokenStream {
        let program = self.derivation.program(Request {
            constraint_second: true,
            ..Request::default()
        });
        if program.statements.is_empty() {
            return TokenStream::new();
        }
        let (dof, count) = (&self.dof, &self.count);
        let body = self.emitted(&program);
        let bends = writes(&program, |array| {
            matches!(array, Array::Bend | Array::RateQ | Array::RateV)
        });
        let mu = bends.then(|| {
            quote! {
                let ::core::option::Option::Some(mu) = mu.first_chunk::<#count>() else {
                    return;
                };
            }
        });
        let psi_q = writes(&program, |array| matches!(array, Array::PsiQ(_)))
            .then(|| self.chunk(&quote!(psi_q), &quote!(second.psi_q)));
        let row_rates = writes(&program, |array| matches!(array, Array::RowRate(_)))
            .then(|| self.chunk(&quote!(row_rates), &quote!(second.row_rates)));
        let doc = page::kernel(SECOND, &program);
        quote! {
            #[doc = #doc]
            fn constraint_second<R: __tfe::Real>(
                &self,
                t: R,
                q: &[R; #dof],
                v: &[R; #dof],
                mu: &[R],
                second: &mut __tfe::ConstraintSecond<'_, R, #dof>,
            ) {
                #mu
                #psi_q
                #row_rates
                #body
            }
        }
    }
}

/// Whether a program writes a result of this kind. Constraints hold no loops.
fn writes(program: &Program, kind: fn(Array) -> bool) -> bool {
    program.statements.iter().any(|statement| match statement {
        Statement::Store { output, .. } | Statement::Balance { output, .. } => kind(output.array),
        Statement::Clear { array } => kind(*array),
        _ => false,
    })
}
