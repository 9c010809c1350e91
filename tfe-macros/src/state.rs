//! The methods that make states: `state`, and `state_at` of models with a time transformation.

use crate::checks;
use crate::emit::Emitter;
use crate::indices::index;
use proc_macro2::{Literal, TokenStream};
use quote::quote;
use tfe_symbolic::derive::derivation::Derivation;
use tfe_symbolic::model::declared::{Declared, TimeTransformation, names};

/// `state`; with a time transformation also `state_at`, and H as declared, which both need.
pub(crate) fn methods(declared: &Declared, vis: &TokenStream, path: &TokenStream) -> TokenStream {
    let transformed = declared
        .time_transformation
        .zip(Derivation::hamiltonian(declared));
    if let Some((TimeTransformation { clock, .. }, hamiltonian)) = transformed {
        let all = names(&declared.coordinates);
        let body = Emitter::new(&all, TokenStream::new()).body(&hamiltonian);
        let hamiltonian = body.value.unwrap_or_else(|| quote!(t.like(0.0)));
        let statements = body.statements;
        let dof = index(&declared.dof);
        let clock = Literal::usize_unsuffixed(clock);
        let unknown = quote! {
            state.p[#clock] = ::core::primitive::f64::NAN;
            return state;
        };
        let (guard, _) = checks::guard(declared, path, &unknown);
        return quote! {
            /// The state with coordinates `q` and momenta `p` at the time t = 0 of the model: t and p_t = −H(q, p, t) come last.
            #vis fn state(&self, q: [f64; #clock], p: [f64; #clock]) -> #path::__private::State<#dof> {
                self.state_at(0.0, q, p)
            }

            /// The state with coordinates `q` and momenta `p` at the time `t` of the model: t and p_t = −H(q, p, t) come last.
            #vis fn state_at(&self, t: f64, q: [f64; #clock], p: [f64; #clock]) -> #path::__private::State<#dof> {
                let mut state = #path::__private::State { q: [t; #dof], p: [0.0; #dof] };
                state.q[..#clock].copy_from_slice(&q);
                state.p[..#clock].copy_from_slice(&p);
                #guard
                state.p[#clock] = -self.__tfe_hamiltonian(t, &state.q, &state.p);
                state
            }

            #[allow(unused_variables, non_snake_case)]
            fn __tfe_hamiltonian<R: #path::__private::Real>(&self, t: R, q: &[R; #dof], z: &[R; #dof]) -> R {
                #statements
                #hamiltonian
            }
        };
    }
    let dof = index(&declared.dof);
    quote! {
        /// The state with coordinates `q` and velocities `v` = dq/dt at time zero; its momenta are p = ∂L/∂v.
        ///
        /// Where no momentum belongs to the velocity (a Hamiltonian with singular ∂²H/∂p²) the momenta are NaN, and a run refuses them.
        #vis fn state(&self, q: [f64; #dof], v: [f64; #dof]) -> #path::__private::State<#dof> {
            #path::__private::state(self, 0.0, q, v)
        }
    }
}
