//! Mistakes in declarations: which messages there are, and which stubs.

use super::dense;
use crate::expand::expand;
use quote::quote;

#[test]
fn names_that_nothing_can_have_are_mistakes_without_a_panic() {
    for name in ["crate", "self", "super", "Self", "_"] {
        let name = proc_macro2::Ident::new(name, proc_macro2::Span::call_site());
        let declarations = [
            quote!(coordinates(x), lagrangian = dot(x)^2, output(#name) = x),
            quote!(coordinates(x, y), lagrangian = dot(x)^2 + dot(y)^2, constraint(#name) = x - y),
            quote!(coordinates(#name), lagrangian = dot(#name)^2),
            quote!(coordinates(x), let #name = x, lagrangian = dot(x)^2),
            quote!(coordinates(x), lagrangian = dot(x)^2, solver(#name, Mixed::<2>)),
            quote!(coordinates(x), lagrangian = dot(x)^2 + cos(x), model(#name, truncated(2))),
        ];
        for declaration in declarations {
            let expansion = expand(
                declaration.clone(),
                quote!(
                    struct Model {}
                ),
            )
            .to_string();
            assert!(expansion.contains("compile_error"), "{declaration}");
        }
    }
}

#[test]
fn const_parameters_are_not_called_like_variables_of_the_generated_code() {
    let expansion = |name: &str| {
        let name = proc_macro2::Ident::new(name, proc_macro2::Span::call_site());
        let declaration = quote!(
            coordinates(x[#name]),
            lagrangian = sum(a in 0..#name, dot(x[a])^2/2 - cos(x[a])),
        );
        let item = quote!(
            struct Model<const #name: usize> {}
        );
        expand(declaration, item).to_string()
    };
    for name in ["i", "index", "value", "p", "t7", "sin_x", "q"] {
        assert!(expansion(name).contains("is taken by a variable"), "{name}");
    }
    for name in ["N", "n", "links", "tip"] {
        assert!(!expansion(name).contains("compile_error"), "{name}");
    }
}

#[test]
fn what_a_forgotten_comma_loses_has_no_mistakes_of_its_own() {
    let expansion = |declaration| {
        let item = quote!(
            struct Model;
        );
        dense(&expand(declaration, item))
    };
    let between = expansion(quote!(
        coordinates(x, y)
        let height = y;
        lagrangian = dot(x)^2 + dot(y)^2 - height
        output(up) = height,
    ));
    // Before `let`, the semicolon, before `output`.
    assert_eq!(between.matches("compile_error").count(), 3);
    assert_eq!(between.matches("expectedacomma").count(), 3);
    assert!(between.contains("State<2>") && between.contains("fnup("));
    let inside = expansion(quote!(
        coordinates(x, y z),
        lagrangian = dot(x)^2 + dot(y)^2 + dot(z)^2,
    ));
    assert_eq!(inside.matches("compile_error").count(), 1);
    assert!(inside.contains("State<3>"));
}
