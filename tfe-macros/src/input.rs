//! The annotated struct: its fields are the parameters of the model.

use crate::emit::LOCALS;
use proc_macro2::{Ident, Span, TokenStream};
use quote::quote;
use syn::{
    Attribute, DeriveInput, Expr, ExprLit, Fields, GenericArgument, GenericParam, ItemStruct, Lit,
    PathArguments, Type, Visibility,
};
use tfe_symbolic::syntax::context::{Context, Field, FieldKind, Length};

/// The struct under the attribute.
///
/// # Errors
/// An error for anything other than a struct.
pub(crate) fn parse(item: TokenStream) -> syn::Result<ItemStruct> {
    let span = name_span(item.clone());
    syn::parse2(item).map_err(|error| {
        syn::Error::new(
            span.unwrap_or_else(|| error.span()),
            "`#[dynamics]` can only be applied to a struct, whose fields are the parameters",
        )
    })
}

/// The name of the item, where it is a type.
fn name_span(item: TokenStream) -> Option<Span> {
    let item: DeriveInput = syn::parse2(item).ok()?;
    Some(item.ident.span())
}

/// Checks that the struct can hold parameters.
///
/// # Errors
/// All of these at once: fields without names or under a `cfg`; generic parameters other than const parameters.
pub(crate) fn check(item: &ItemStruct) -> syn::Result<()> {
    if let Fields::Unnamed(fields) = &item.fields {
        return Err(syn::Error::new_spanned(
            fields,
            "the parameters of a model need names\nhelp: write `struct Name { m: f64, g: f64 }`",
        ));
    }
    let parameters = item.generics.params.iter().filter_map(unusable);
    let attributes = item.fields.iter().flat_map(|field| &field.attrs);
    let configured = attributes.filter(|one| one.path().is_ident("cfg"));
    let configured = configured.map(|attribute| {
        syn::Error::new_spanned(
            attribute,
            "a parameter cannot have a `cfg` attribute: the model is derived with all parameters\nhelp: put the `cfg` on the whole struct, and declare it once for each configuration",
        )
    });
    let all = parameters.chain(configured).reduce(|mut all, one| {
        all.combine(one);
        all
    });
    all.map_or(Ok(()), Err)
}

/// Why a model cannot have this generic parameter.
fn unusable(parameter: &GenericParam) -> Option<syn::Error> {
    let message = match parameter {
        GenericParam::Const(parameter) => {
            let message = taken_by_generated_code(&parameter.ident)?;
            return Some(syn::Error::new_spanned(&parameter.ident, message));
        }
        GenericParam::Lifetime(_) => {
            "a model cannot have generic parameters other than const parameters\nhelp: let the struct own its parameters: `f64`, `[f64; N]` or `Vec<f64>`"
        }
        _ => {
            "a model cannot have generic parameters other than const parameters\nhelp: use `const N: usize` for a length, and `f64` for numbers"
        }
    };
    Some(syn::Error::new_spanned(parameter, message))
}

/// Variables of generated code outside kernels: arguments of methods, their variables, and indices of loops.
const VARIABLES: [&str; 15] = [
    "by", "end", "i", "index", "j", "k", "l", "left", "made", "model", "original", "p", "state",
    "tau", "value",
];

/// Whether a temporary may have this name: `t12`, `sin_x`.
fn is_temporary(name: &str) -> bool {
    let number = name.strip_prefix('t');
    let is_numbered = number.is_some_and(|rest| rest.bytes().all(|byte| byte.is_ascii_digit()));
    is_numbered || name.starts_with("sin_") || name.starts_with("cos_")
}

/// Why a const parameter cannot have this name. No variable can have the name of a const parameter.
fn taken_by_generated_code(name: &Ident) -> Option<String> {
    let name = plain(name);
    let what = match name.as_str() {
        "R" => "a type",
        "t" => "a variable",
        other if LOCALS.contains(&other) || VARIABLES.contains(&other) => "a variable",
        other if is_temporary(other) || other.starts_with("__") => "a variable",
        _ => return None,
    };
    Some(format!(
        "the name `{name}` is taken by {what} of the generated code\nhelp: choose another name, such as `N`"
    ))
}

/// Removes further `#[dynamics]` attributes from the struct, with a message for each: the implementations would
/// conflict.
pub(crate) fn take_repeated(item: &mut ItemStruct) -> TokenStream {
    let (repeated, others) = std::mem::take(&mut item.attrs)
        .into_iter()
        .partition::<Vec<_>, _>(is_dynamics);
    item.attrs = others;
    repeated
        .iter()
        .map(|attribute| {
            syn::Error::new_spanned(
                attribute.path(),
                "a struct can declare only one model\nhelp: declare the other model on a struct of its own, or derive it with `model(Name, …)`",
            )
            .to_compile_error()
        })
        .collect()
}

/// Whether the attribute is `#[dynamics(…)]` or `#[tfe::dynamics(…)]`.
fn is_dynamics(attribute: &Attribute) -> bool {
    let segments: Vec<&Ident> = (attribute.path().segments.iter())
        .map(|segment| &segment.ident)
        .collect();
    match segments[..] {
        [name] => name == "dynamics",
        [path, name] => path == "tfe" && name == "dynamics",
        _ => false,
    }
}

/// The visibility of the struct, for generated items, as tokens of the generated code: with the user's own `pub` token,
/// lints would treat generated functions as the user's.
pub(crate) fn visibility(item: &ItemStruct) -> TokenStream {
    match &item.vis {
        Visibility::Inherited => TokenStream::new(),
        Visibility::Public(_) => quote!(pub),
        Visibility::Restricted(restricted) => {
            let word = restricted.path.get_ident().map(generated);
            match word.filter(|_| restricted.in_token.is_none()) {
                Some(word) => quote!(pub(#word)),
                None => {
                    let vis = &item.vis;
                    quote!(#vis)
                }
            }
        }
    }
}

/// The same name as a token of the generated code.
pub(crate) fn generated(name: &Ident) -> Ident {
    let mut name = name.clone();
    name.set_span(Span::call_site());
    name
}

/// Allows generated code to use a struct or a field that is deprecated; nothing if none is.
pub(crate) fn of_deprecated(item: &ItemStruct) -> Option<TokenStream> {
    let of_fields = item.fields.iter().flat_map(|field| &field.attrs);
    let mut attributes = item.attrs.iter().chain(of_fields);
    let is_deprecated = attributes.any(|one| one.path().is_ident("deprecated"));
    is_deprecated.then(|| quote!(#[allow(deprecated)]))
}

/// The description of the struct for the engine.
pub(crate) fn context(item: &ItemStruct) -> Context {
    let const_parameters: Vec<String> = item
        .generics
        .const_params()
        .filter(|parameter| is_named(&parameter.ty, "usize"))
        .map(|parameter| plain(&parameter.ident))
        .collect();
    let fields = item
        .fields
        .iter()
        .filter_map(|field| {
            let name = plain(field.ident.as_ref()?);
            Some(Field {
                name,
                kind: field_kind(&field.ty, &const_parameters),
            })
        })
        .collect();
    Context {
        struct_name: plain(&item.ident),
        fields,
        const_parameters,
    }
}

/// Whether this field is there and of type `usize`.
pub(crate) fn is_length(fields: &Fields, name: &str) -> bool {
    fields.iter().any(|field| {
        let named = field
            .ident
            .as_ref()
            .is_some_and(|ident| plain(ident) == name);
        named && is_named(&field.ty, "usize")
    })
}

/// An identifier without the `r#` of raw identifiers.
pub(crate) fn plain(ident: &syn::Ident) -> String {
    let text = ident.to_string();
    text.strip_prefix("r#")
        .map_or_else(|| text.clone(), str::to_owned)
}

fn field_kind(ty: &Type, const_parameters: &[String]) -> FieldKind {
    if is_named(ty, "f64") {
        return FieldKind::Scalar;
    }
    if is_named(ty, "usize") {
        return FieldKind::Length;
    }
    match ty {
        // A type substituted by a `macro_rules!` macro stands in an invisible group.
        Type::Group(group) => field_kind(&group.elem, const_parameters),
        Type::Paren(inner) => field_kind(&inner.elem, const_parameters),
        Type::Array(array) if is_named(&array.elem, "f64") => {
            match length(&array.len, const_parameters) {
                Some(length) => FieldKind::Array(length),
                None => other(ty),
            }
        }
        Type::Path(path) => match path.path.segments.last() {
            Some(last) if last.ident == "Vec" => match &last.arguments {
                PathArguments::AngleBracketed(arguments) => match arguments.args.first() {
                    Some(GenericArgument::Type(element)) if is_named(element, "f64") => {
                        FieldKind::Vector
                    }
                    Some(GenericArgument::Type(element)) if is_named(element, "usize") => {
                        FieldKind::Indices
                    }
                    _ => other(ty),
                },
                _ => other(ty),
            },
            _ => other(ty),
        },
        _ => other(ty),
    }
}

fn length(expression: &Expr, const_parameters: &[String]) -> Option<Length> {
    match expression {
        Expr::Group(group) => length(&group.expr, const_parameters),
        Expr::Paren(inner) => length(&inner.expr, const_parameters),
        Expr::Lit(ExprLit {
            lit: Lit::Int(literal),
            ..
        }) => literal.base10_parse().ok().map(Length::Literal),
        Expr::Path(path) => {
            let name = plain(path.path.get_ident()?);
            const_parameters
                .contains(&name)
                .then_some(Length::ConstParameter(name))
        }
        _ => None,
    }
}

fn other(ty: &Type) -> FieldKind {
    FieldKind::Other(quote::quote!(#ty).to_string())
}

fn is_named(ty: &Type, name: &str) -> bool {
    match ty {
        Type::Path(path) if path.qself.is_none() => path
            .path
            .segments
            .last()
            .is_some_and(|segment| segment.ident == name && segment.arguments.is_none()),
        Type::Group(group) => is_named(&group.elem, name),
        Type::Paren(inner) => is_named(&inner.elem, name),
        _ => false,
    }
}
