//! The constraints of a model of run-time length: how many there are, their names, and their kernels.

use super::sites::{self, Sites};
use crate::constraint::{ROWS, VALUES};
use crate::emit::Emitter;
use crate::headings::Headings;
use crate::page;
use crate::parameters::RunTimeParameters;
use proc_macro2::TokenStream;
use quote::quote;
use tfe_symbolic::derive::derivation::Derivation;
use tfe_symbolic::model::declared::Declared;
use tfe_symbolic::program::{Program, Request};

/// The members for constraints in an implementation of `FamilyModel`; none if there are no constraints.
pub(super) fn members(
    declared: &Declared,
    derivation: &Derivation,
    parameters: &RunTimeParameters,
    dof: &TokenStream,
) -> TokenStream {
    let constraints = &declared.constraints;
    if constraints.is_empty() {
        return TokenStream::new();
    }
    let sites: Vec<Sites> = constraints
        .iter()
        .map(|constraint| (constraint.name.as_str(), constraint.ranges.as_slice()))
        .collect();
    let (count, name) = (sites::count(&sites), sites::name(&sites, &quote!(row)));
    let kernels = Kernels {
        declared,
        derivation,
        parameters,
        dof,
    };
    let (values, rows_and_drift, second) = (kernels.values(), kernels.rows(), kernels.second());
    quote! {
        const CONSTRAINED: bool = true;

        fn constraints(&self) -> usize {
            #count
        }

        fn constraint_name(&self, row: usize) -> __tfe::CoordinateName {
            #name
        }

        #values
        #rows_and_drift
        #second
    }
}

struct Kernels<'a> {
    declared: &'a Declared,
    derivation: &'a Derivation,
    parameters: &'a RunTimeParameters,
    /// The number of coordinates.
    dof: &'a TokenStream,
}

impl Kernels<'_> {
    fn program(&self, request: Request) -> Program {
        self.derivation.program(request)
    }

    /// The body of a kernel, with its slices cut to their lengths, so that the compiler knows them.
    fn body(&self, program: &Program) -> TokenStream {
        self.body_by(self.emitter(), program)
    }

    /// The same for a kernel that can be differentiated by parameters.
    fn sensitive_body(&self, program: &Program) -> TokenStream {
        let places = self.parameters.places();
        self.body_by(self.emitter().with_run_time_parameters(places), program)
    }

    fn emitter(&self) -> Emitter<'_> {
        Emitter::new(&[], TokenStream::new())
            .by_entries()
            .with_headings(Headings::of(self.declared))
    }

    fn body_by(&self, emitter: Emitter<'_>, program: &Program) -> TokenStream {
        let dof = self.dof;
        let statements = emitter.body(program).statements;
        quote! {
            let q = &q[..#dof];
            #statements
        }
    }

    fn values(&self) -> TokenStream {
        let program = self.program(Request {
            constraint_values: true,
            ..Request::default()
        });
        let (body, doc) = (
            self.sensitive_body(&program),
            page::kernel(VALUES, &program),
        );
        quote! {
            #[doc = #doc]
            fn constraint_values<R: __tfe::Real>(&self, t: R, q: &[R], values: &mut [R]) {
                let values = &mut values[..__tfe::FamilyModel::constraints(self)];
                #body
            }
        }
    }

    fn rows(&self) -> TokenStream {
        let program = self.program(Request {
            constraint_rows: true,
            ..Request::default()
        });
        let (body, doc) = (self.sensitive_body(&program), page::kernel(ROWS, &program));
        quote! {
            #[doc = #doc]
            fn constraint_rows<R: __tfe::Real, __E: __tfe::Entries<R>>(
                &self,
                t: R,
                q: &[R],
                drift: &mut [R],
                entries: &mut __E,
            ) {
                let drift = &mut drift[..__tfe::FamilyModel::constraints(self)];
                // Rows without the time write nothing.
                drift.fill(t.like(0.0));
                #body
            }
        }
    }

    /// `constraint_second`, unless all constraints are affine.
    fn second(&self) -> TokenStream {
        let program = self.program(Request {
            constraint_second: true,
            ..Request::default()
        });
        if program.statements.is_empty() {
            return TokenStream::new();
        }
        let (body, doc) = (self.body(&program), page::kernel("∂(Aᵀμ)/∂q", &program));
        quote! {
            #[doc = #doc]
            fn constraint_second<R: __tfe::Real, __E: __tfe::Entries<R>>(
                &self,
                t: R,
                q: &[R],
                mu: &[R],
                entries: &mut __E,
            ) {
                let mu = &mu[..__tfe::FamilyModel::constraints(self)];
                #body
            }
        }
    }
}
