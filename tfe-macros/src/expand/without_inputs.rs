//! The kernels of a model with inputs when no inputs are given.

use super::Kernels;
use crate::controls;
use proc_macro2::TokenStream;
use quote::quote;

impl Kernels<'_> {
    /// The kernels of `Model`, which call those of `Controlled` with all inputs zero. `lanes` tells whether the first
    /// derivatives are available for several points at once.
    pub(super) fn without_inputs(&self, lanes: Option<TokenStream>) -> TokenStream {
        let dof = &self.dof;
        let trait_name = quote!(<Self as __tfe::Controlled<#dof>>);
        let zeros = controls::zeros();
        let observables = (!self.declared.observables.is_empty()).then(|| {
            quote! {
                fn observables<R: __tfe::Real>(&self, t: R, q: &[R; #dof], z: &[R; #dof], values: &mut [R]) {
                    #trait_name::observables_with(self, #zeros, t, q, z, values);
                }
            }
        });
        let first_by = (!self.declared.sensitivities.is_empty()).then(|| {
            quote! {
                fn first_by<R: __tfe::Real>(
                    &self,
                    by: __tfe::By,
                    t: R,
                    q: &[R; #dof],
                    z: &[R; #dof],
                    first: &mut __tfe::First<R, #dof>,
                ) {
                    #trait_name::first_by_with(self, by, #zeros, t, q, z, first);
                }
            }
        });
        let lanes = lanes.map(|lanes| {
            quote! {
                const LANES: bool = #lanes;

                #[inline(always)]
                fn first_inline<R: __tfe::Real>(&self, t: R, q: &[R; #dof], z: &[R; #dof], first: &mut __tfe::First<R, #dof>) {
                    #trait_name::first_with(self, #zeros, t, q, z, first);
                }

                #[inline(always)]
                fn first_and_mass_inline<R: __tfe::Real>(
                    &self,
                    t: R,
                    q: &[R; #dof],
                    z: &[R; #dof],
                    first: &mut __tfe::First<R, #dof>,
                    zz: &mut [[R; #dof]; #dof],
                ) {
                    #trait_name::first_and_mass_with(self, #zeros, t, q, z, first, zz);
                }
            }
        });
        quote! {
            fn energy_function<R: __tfe::Real>(&self, t: R, q: &[R; #dof], z: &[R; #dof]) -> R {
                #trait_name::energy_function_with(self, #zeros, t, q, z)
            }

            #lanes

            fn first<R: __tfe::Real>(&self, t: R, q: &[R; #dof], z: &[R; #dof], first: &mut __tfe::First<R, #dof>) {
                #trait_name::first_with(self, #zeros, t, q, z, first);
            }

            fn first_and_mass<R: __tfe::Real>(
                &self,
                t: R,
                q: &[R; #dof],
                z: &[R; #dof],
                first: &mut __tfe::First<R, #dof>,
                zz: &mut [[R; #dof]; #dof],
            ) {
                #trait_name::first_and_mass_with(self, #zeros, t, q, z, first, zz);
            }

            fn second<R: __tfe::Real>(
                &self,
                t: R,
                q: &[R; #dof],
                z: &[R; #dof],
                first: &mut __tfe::First<R, #dof>,
                second: &mut __tfe::Second<R, #dof>,
            ) {
                #trait_name::second_with(self, #zeros, t, q, z, first, second);
            }

            #observables
            #first_by
        }
    }
}
