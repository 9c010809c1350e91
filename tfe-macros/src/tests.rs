//! Golden expansions: what `#[dynamics]` writes for a few models, as readable Rust. `UPDATE_GOLDEN=1 cargo test -p tfe-macros` rewrites them.

mod checks;
mod mistakes;

use crate::expand::expand;
use proc_macro2::{TokenStream, TokenTree};
use quote::quote;
use std::collections::BTreeSet;
use std::path::Path;
use tfe_symbolic::syntax::parse;
use tfe_symbolic::{check, lower, vocabulary};

/// What the prelude of Rust defines, and a user may define otherwise.
const PRELUDE: &[&str] = &[
    "Some",
    "None",
    "Ok",
    "Err",
    "Option",
    "Result",
    "Vec",
    "String",
    "Box",
    "Default",
    "Clone",
    "Copy",
    "Debug",
    "PartialEq",
    "Into",
    "From",
    "Iterator",
    "Send",
    "Sync",
    "drop",
    "core",
    "std",
    "NAN",
    "INFINITY",
    "NEG_INFINITY",
    "assert",
    "cfg",
    "concat",
    "panic",
    "unimplemented",
    "vec",
    "format",
];

/// Names of the prelude that stand at the begin of a path.
fn relative_paths(tokens: TokenStream, found: &mut Vec<String>) {
    let mut colons = 0;
    for token in tokens {
        match token {
            TokenTree::Group(group) => relative_paths(group.stream(), found),
            TokenTree::Ident(ident) if colons < 2 && PRELUDE.contains(&&*ident.to_string()) => {
                found.push(ident.to_string());
            }
            TokenTree::Punct(punct) if punct.as_char() == ':' => {
                colons += 1;
                continue;
            }
            _ => {}
        }
        colons = 0;
    }
}

#[track_caller]
fn check(name: &str, arguments: TokenStream, item: TokenStream) {
    let expansion = expand(arguments, item.clone());
    let mut relative = Vec::new();
    relative_paths(expansion.clone(), &mut relative);
    // The user's own types and derives are written as they are; models made from this one repeat both.
    let (mut own, mut seen) = (Vec::new(), BTreeSet::new());
    relative_paths(item, &mut own);
    relative.retain(|path| !own.contains(path) && seen.insert(path.clone()));
    assert!(relative.is_empty(), "without absolute paths: {relative:?}");
    let file: syn::File = syn::parse2(expansion).expect("expansions are items");
    let actual = prettyplease::unparse(&file);
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("golden")
        .join(name)
        .with_extension("rs");
    if std::env::var_os("UPDATE_GOLDEN").is_some() {
        std::fs::write(&path, &actual).expect("the golden file can be written");
    }
    let golden = std::fs::read_to_string(&path)
        .expect("the golden file exists: UPDATE_GOLDEN=1 writes it")
        .replace("\r\n", "\n");
    if let Some((line, (golden, actual))) = golden
        .lines()
        .zip(actual.lines())
        .enumerate()
        .find(|(_, (golden, actual))| golden != actual)
    {
        panic!(
            "{name}.rs, line {}:\n  golden: {golden}\n  actual: {actual}",
            line + 1
        );
    }
    assert_eq!(
        golden, actual,
        "{name}.rs and the expansion differ in length"
    );
}

#[test]
fn the_double_pendulum_of_the_readme() {
    check(
        "double_pendulum",
        quote!(
            coordinates(theta1, theta2),
            let x1 = l1 * sin(theta1),
            let y1 = -l1 * cos(theta1),
            let x2 = x1 + l2 * sin(theta2),
            let y2 = y1 - l2 * cos(theta2),
            lagrangian = m1 / 2 * (dot(x1) ^ 2 + dot(y1) ^ 2)
                + m2 / 2 * (dot(x2) ^ 2 + dot(y2) ^ 2)
                - g * (m1 * y1 + m2 * y2),
            output(tip_x) = x2,
        ),
        quote! {
            struct DoublePendulum {
                m1: f64,
                m2: f64,
                l1: f64,
                l2: f64,
                g: f64,
            }
        },
    );
}

#[test]
fn a_lagrangian() {
    check(
        "pendulum",
        quote!(
            coordinates(theta),
            lagrangian = m / 2 * l ^ 2 * dot(theta) ^ 2 + m * g * l * cos(theta),
        ),
        quote! {
            /// A mathematical pendulum.
            pub struct Pendulum {
                /// Mass.
                pub m: f64,
                /// Length.
                pub l: f64,
                /// Acceleration of gravity.
                pub g: f64,
            }
        },
    );
}

#[test]
fn a_hamiltonian() {
    check(
        "henon_heiles",
        quote!(
            coordinates(x, y),
            momenta(px, py),
            hamiltonian =
                (px ^ 2 + py ^ 2) / 2 + (x ^ 2 + y ^ 2) / 2 + lambda * (x ^ 2 * y - y ^ 3 / 3),
        ),
        quote!(
            struct HenonHeiles {
                lambda: f64,
            }
        ),
    );
}

#[test]
fn steps_in_a_time_of_their_own() {
    check(
        "time_transformation",
        quote!(
            coordinates(q),
            momenta(p),
            hamiltonian = p ^ 2 / 2 - cos(q) - a * q * cos(omega * t),
            time_transformation = 1 / (1 + q ^ 2),
            force(q) = -c * p,
            output(energy) = p ^ 2 / 2 - cos(q),
        ),
        quote!(
            struct Forced {
                a: f64,
                omega: f64,
                c: f64,
            }
        ),
    );
}

#[test]
fn a_family_of_run_time_length() {
    check(
        "family",
        quote!(
            coordinates(s, q[n]),
            lagrangian = dot(s)^2/2 + sum(i in 0..n, m[i]/2*dot(q[i])^2)
                - sum(i in 0..w, k/2*(q[i+1] - q[i])^2 + a/3*(q[i+1] - q[i])^3) - k/2*(q[0] - s)^2,
            force(q[n-1]) = -dot(q[n-1]),
            output(extension) = q[n-1] - q[0],
        ),
        quote! {
            struct Family {
                n: usize,
                w: usize,
                m: Vec<f64>,
                k: f64,
                a: f64,
            }
        },
    );
}

#[test]
fn a_family_with_inputs() {
    check(
        "driven_family",
        quote!(
            coordinates(q[n]),
            lagrangian = sum(i in 0..n, dot(q[i])^2/2)
                - sum(i in 0..n-1, (q[i+1] - q[i])^2/2) - (q[0] - w)^2/2,
            input(w, u),
            force(q[i]) = u,
            output(power) = u*dot(q[0]),
        ),
        quote!(
            struct Chain {
                n: usize,
            }
        ),
    );
}

#[test]
fn loops_over_a_chain_of_any_length() {
    check(
        "chain",
        quote!(
            coordinates(q[N]),
            lagrangian = sum(i in 0..N, m[i] / 2 * dot(q[i]) ^ 2)
                - sum(i in 0..N - 1, k / 2 * (q[i + 1] - q[i]) ^ 2 + a / 4 * (q[i + 1] - q[i]) ^ 4),
            force(q[i]) = -c * dot(q[i]),
            force(q[N - 1]) = f * sin(omega * t),
            output(extension) = q[N - 1] - q[0],
        ),
        quote!(
            struct Chain<const N: usize> {
                m: [f64; N],
                k: f64,
                a: f64,
                c: f64,
                f: f64,
                omega: f64,
            }
        ),
    );
}

#[test]
fn contact_dissipation_outputs_and_a_solver() {
    check(
        "contact",
        quote!(
            coordinates(x, theta),
            let gap = x - r * cos(theta),
            lagrangian = m / 2 * (dot(x) ^ 2 + r ^ 2 * dot(theta) ^ 2) - m * g * x
                - select(gap < 0, k / 2 * gap ^ 2, 0),
            dissipation = c / 2 * dot(theta) ^ 2,
            output(height) = gap,
            output(speed) = sqrt(dot(x) ^ 2 + (r * dot(theta)) ^ 2),
            solver(Fast, Primal::<3>.reduced()),
        ),
        quote!(
            struct Contact {
                m: f64,
                r: f64,
                g: f64,
                k: f64,
                c: f64,
            }
        ),
    );
}

#[test]
fn derivatives_by_parameters() {
    check(
        "sensitivity",
        quote!(
            coordinates(x),
            lagrangian = m / 2 * dot(x) ^ 2 - k[0] / 2 * x ^ 2 - k[1] / 4 * x ^ 4,
            dissipation = c / 2 * dot(x) ^ 2,
            force(x) = amplitude * cos(omega * t),
            sensitivity(omega, k[1], c),
        ),
        quote!(
            struct Duffing {
                m: f64,
                k: [f64; 2],
                c: f64,
                amplitude: f64,
                omega: f64,
            }
        ),
    );
}

#[test]
fn a_model_made_from_another() {
    check(
        "frozen",
        quote!(
            coordinates(r, theta),
            lagrangian = m / 2 * (dot(r) ^ 2 + r ^ 2 * dot(theta) ^ 2) + m * g * r * cos(theta)
                - k / 2 * (r - l)
                ^ 2,
            output(height) = -r * cos(theta),
            model(Rod, frozen(r = l), truncated(4)),
        ),
        quote! {
            /// A mass on a spring.
            #[derive(Clone, Debug, PartialEq, PartialOrd)]
            pub struct SpringPendulum {
                /// Mass.
                pub m: f64,
                /// Length.
                pub l: f64,
                /// Acceleration of gravity.
                pub g: f64,
                /// Stiffness.
                pub k: f64,
            }
        },
    );
}

#[test]
fn a_holonomic_constraint() {
    check(
        "rod_pendulum",
        quote!(
            coordinates(x, y),
            lagrangian = m / 2 * (dot(x) ^ 2 + dot(y) ^ 2) - m * g * y,
            constraint(rod) = x ^ 2 + y ^ 2 - l ^ 2,
        ),
        quote!(
            struct RodPendulum {
                m: f64,
                l: f64,
                g: f64,
            }
        ),
    );
}

#[test]
fn a_nonholonomic_constraint_and_a_solver() {
    check(
        "knife_edge",
        quote!(
            coordinates(x, y, phi),
            lagrangian =
                m / 2 * (dot(x) ^ 2 + dot(y) ^ 2) + j / 2 * dot(phi) ^ 2 + m * g * sin(alpha) * x,
            constraint(blade) = dot(x) * sin(phi) - dot(y) * cos(phi),
            solver(Fast, Mixed::<3>),
        ),
        quote!(
            struct KnifeEdge {
                m: f64,
                j: f64,
                g: f64,
                alpha: f64,
            }
        ),
    );
}

#[test]
fn a_mistake_leaves_the_struct_and_stubs() {
    check(
        "mistake",
        quote!(
            coordinates(x),
            lagrangian = m / 2 * dot(x) ^ 2 - kk / 2 * x ^ 2,
            output(pull) = k * x,
            solver(Fast, Mixed::<3>),
        ),
        quote!(
            struct Oscillator {
                m: f64,
                k: f64,
            }
        ),
    );
}

#[test]
fn doc_comments_inside_the_attribute() {
    check(
        "documented",
        quote!(
            coordinates(x),
            /// Half of the spring's energy goes to each end.
            let stretch = x - l,
            lagrangian = m/2*dot(x)^2 - k/2*stretch^2,
            /// Above the support, in metres.
            output(height) = -x,
            /// For the controller.
            solver(Fast, Mixed::<2>),
            /// Without the spring.
            model(Rigid, truncated(2, x = l)),
        ),
        quote!(
            struct Spring {
                m: f64,
                k: f64,
                l: f64,
            }
        ),
    );
}

/// Without the blanks, which depend on who prints the tokens.
fn dense(tokens: &TokenStream) -> String {
    tokens.to_string().split_whitespace().collect()
}

#[test]
fn large_kernels_have_absolute_paths_too() {
    let expansion = expand(
        quote!(
            coordinates(angle[20]),
            lagrangian = sum(i in 0..20, m/2*sum(j in 0..i+1, cos(angle[j])*dot(angle[j]))^2
                + m/2*sum(j in 0..i+1, sin(angle[j])*dot(angle[j]))^2),
        ),
        quote!(
            struct Rope {
                m: f64,
            }
        ),
    );
    let text = dense(&expansion);
    let lanes = "constLANES:bool=::core::cfg!(not(debug_assertions))";
    assert!(text.contains(lanes), "the kernels are not large");
    let mut relative = Vec::new();
    relative_paths(expansion, &mut relative);
    assert!(relative.is_empty(), "without absolute paths: {relative:?}");
}

#[test]
fn lints_are_inherited_and_deprecated_structs_allowed() {
    let expansion = expand(
        quote!(
            coordinates(x),
            lagrangian = dot(x) ^ 2 / 2 - k * cos(x),
            solver(Fast, Mixed::<2>),
            model(Small, truncated(2)),
        ),
        quote!(
            #[allow(missing_docs)]
            #[deprecated]
            pub struct Model {
                #[expect(missing_docs)]
                pub k: f64,
            }
        ),
    );
    let text = dense(&expansion);
    // On both structs, and on the field of the one that is made.
    assert_eq!(text.matches("#[allow(missing_docs)]").count(), 3);
    assert_eq!(text.matches("#[expect(missing_docs)]").count(), 1);
    // Kernels, methods, the solver and its methods, `of`.
    assert_eq!(text.matches("#[allow(deprecated)]").count(), 5);
    assert!(!text.contains("__TfeKeep"));
}

#[test]
fn keywords_of_the_edition_of_generated_code_are_raw() {
    let expansion = expand(
        quote!(
            coordinates(x),
            lagrangian = r#gen / 2 * dot(x) ^ 2 - x ^ 2 / 2
        ),
        quote!(
            struct Model {
                r#gen: f64,
            }
        ),
    );
    let text = dense(&expansion);
    assert!(text.contains("self.r#gen") && !text.contains("self.gen"));
}

#[test]
fn generated_functions_are_visible_as_the_struct_is() {
    for vis in [
        quote!(),
        quote!(pub),
        quote!(pub(crate)),
        quote!(pub(in crate::models)),
    ] {
        let expansion = expand(
            quote!(coordinates(x), lagrangian = dot(x) ^ 2 / 2 - x ^ 2 / 2),
            quote!(#vis struct Model;),
        );
        let state = format!("{}fnstate(", dense(&vis));
        assert!(dense(&expansion).contains(&state), "{vis}");
    }
}

/// The code of the page of the language, block by block, without the marks of hidden lines.
fn examples() -> Vec<String> {
    let shown = |line: &str| line.strip_prefix("# ").unwrap_or(line).to_owned();
    let block = |block: &str| block.lines().map(shown).collect::<Vec<_>>().join("\n");
    let parts = include_str!("../language.md").split("```");
    parts.skip(1).step_by(2).map(block).collect()
}

#[test]
fn the_page_of_the_language_holds_all_that_the_engine_knows() {
    let words: Vec<&str> = include_str!("../language.md").split_whitespace().collect();
    let page = words.join(" ");
    let code = examples().concat();
    for argument in vocabulary::Argument::all().map(vocabulary::Argument::word) {
        assert!(page.contains(&format!("| `{argument}")), "{argument}");
        assert!(code.contains(argument), "no example of {argument}");
    }
    for function in vocabulary::function_names() {
        assert!(page.contains(&format!("`{function}(")), "{function}");
        assert!(
            code.contains(&format!("{function}(")),
            "no example of {function}"
        );
    }
    for pass in vocabulary::PASSES {
        assert!(page.contains(&format!("* `{pass}(")), "{pass}");
        assert!(code.contains(&format!("{pass}(")), "no example of {pass}");
    }
    for element in vocabulary::ELEMENTS {
        assert!(page.contains(&format!("`{element}`")), "{element}");
    }
    for rule in vocabulary::RULES {
        assert!(page.contains(&format!("`.{rule}(")), "{rule}");
    }
    assert_eq!(check::MAX_COORDINATES, 10_000);
    for limit in [
        format!("{} levels", parse::MAX_NESTING),
        format!("{} operators", parse::MAX_OPERATORS),
        format!("{} Gauss points", vocabulary::MAX_POINTS),
        format!("at most {} terms is written out", lower::SHORT_SUM),
        format!("at most {} terms in all", lower::LONGEST_WRITTEN_OUT),
        "10 000 coordinates".to_owned(),
    ] {
        assert!(page.contains(&limit), "{limit}");
    }
}

#[test]
fn the_models_on_the_page_of_the_language_are_accepted() {
    let mut models = 0;
    for example in examples() {
        let wrapped = format!("fn main() {{ {example} }}");
        let function: syn::ItemFn = syn::parse_str(&wrapped).expect("an example is Rust");
        for statement in &function.block.stmts {
            let syn::Stmt::Item(syn::Item::Struct(item)) = statement else {
                continue;
            };
            let mut item = item.clone();
            let attribute = item.attrs.pop().expect("the attribute stands last");
            let arguments = attribute.meta.require_list().expect("arguments");
            let expansion = expand(arguments.tokens.clone(), quote!(#item)).to_string();
            let mistake = expansion.find("compile_error");
            let mistake = mistake.map(|at| expansion[at..].chars().take(200).collect::<String>());
            assert_eq!(mistake, None, "{}", item.ident);
            models += 1;
        }
    }
    assert!(models >= 14, "{models}");
}
