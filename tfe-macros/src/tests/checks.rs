//! What models of fixed size check at run time.

use super::dense;
use crate::expand::expand;
use proc_macro2::TokenStream;
use quote::quote;

fn expansion(lagrangian: &TokenStream, fields: &TokenStream) -> String {
    let declaration = quote!(
        coordinates(x[3]),
        lagrangian = sum(i in 0..3, m/2*dot(x[i])^2) - #lagrangian,
        output(last) = x[2],
        solver(Fast, Mixed::<3>),
    );
    let item = quote!(
        struct Model { m: f64, #fields }
    );
    dense(&expand(declaration, item))
}

/// Programs without an allocator are to stay small.
#[test]
fn only_fields_that_may_be_wrong_are_checked() {
    let numbers = quote!(k: f64, c: [f64; 3]);
    let plain = expansion(&quote!(sum(i in 0..3, k*c[i]*x[i]^2)), &numbers);
    let power = expansion(&quote!(k * x[0] ^ n), &quote!(k: f64, n: usize));
    for expansion in [plain, power] {
        assert!(!expansion.contains("check"), "{expansion}");
    }
    let chosen = expansion(&quote!(c[n] * x[1] ^ 2), &quote!(c: [f64; 3], n: usize));
    for expected in [
        "fncheck(&self)",
        "checks::length(\"n\",self.n)?;",
        "checks::index((\"c\",\"n\",\"\"),(self.nasi64),3)?;",
        "Model<3>>::check(self).is_err()",
        "NaNifthemodeldoesnotpassits`check`",
    ] {
        assert!(chosen.contains(expected), "{expected}\n{chosen}");
    }
}
