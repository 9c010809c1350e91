//! The kernels of a model of run-time length all of whose inputs are zero.

use crate::controls;
use proc_macro2::TokenStream;
use quote::quote;

/// The kernels of `FamilyModel` where those of `FamilyControlled` are given inputs.
pub(super) fn kernels(in_strides: bool, observables: bool) -> TokenStream {
    let zeros = controls::zeros();
    let controlled = quote!(<Self as __tfe::FamilyControlled>);
    let in_strides = in_strides.then(|| {
        quote! {
            #[inline(always)]
            fn forces_in_strides<R: __tfe::Real, __S: __tfe::Sweep<R>>(&self, t: R, __sweep: &mut __S) {
                #controlled::forces_in_strides_with(self, #zeros, t, __sweep);
            }
        }
    });
    let observables = observables.then(|| {
        quote! {
            fn observables<R: __tfe::Real>(&self, t: R, q: &[R], z: &[R], values: &mut [R]) {
                #controlled::observables_with(self, #zeros, t, q, z, values);
            }
        }
    });
    quote! {
        fn energy_function<R: __tfe::Real>(&self, t: R, q: &[R], z: &[R]) -> R {
            #controlled::energy_function_with(self, #zeros, t, q, z)
        }

        fn first<R: __tfe::Real>(&self, t: R, q: &[R], z: &[R], first: __tfe::Gradient<'_, R>) {
            #controlled::first_with(self, #zeros, t, q, z, first);
        }

        #[inline(always)]
        fn forces_inline<R: __tfe::Real>(
            &self,
            t: R,
            q: &[R],
            z: &[R],
            first: __tfe::Gradient<'_, R>,
        ) {
            #controlled::forces_inline_with(self, #zeros, t, q, z, first);
        }

        #in_strides

        fn mass<R: __tfe::Real, __E: __tfe::Entries<R>>(
            &self,
            t: R,
            q: &[R],
            z: &[R],
            entries: &mut __E,
        ) {
            #controlled::mass_with(self, #zeros, t, q, z, entries);
        }

        fn second<R: __tfe::Real, __E: __tfe::Entries<R>>(
            &self,
            t: R,
            q: &[R],
            z: &[R],
            first: __tfe::Gradient<'_, R>,
            entries: &mut __E,
        ) {
            #controlled::second_with(self, #zeros, t, q, z, first, entries);
        }

        #observables
    }
}
