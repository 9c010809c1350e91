//! Names that declarations cannot have: keywords of Rust, and the reserved words of the language.

use crate::diagnostic::Kind;
use crate::vocabulary::is_function;

/// The keywords of Rust that cannot be written as raw identifiers, and therefore cannot be names in generated code.
const KEYWORDS_WITHOUT_RAW_FORM: &[&str] = &["crate", "self", "super", "Self"];

/// Whether Rust refuses the name even in its raw form.
fn keyword(name: &str) -> Option<Kind> {
    KEYWORDS_WITHOUT_RAW_FORM
        .contains(&name)
        .then(|| Kind::Keyword {
            name: name.to_owned(),
        })
}

/// Checks the name of a struct that will be generated: formulas do not see it.
pub(crate) fn unusable_type_name(name: &str) -> Option<Kind> {
    match name {
        "_" => Some(Kind::Keyword {
            name: name.to_owned(),
        }),
        name => keyword(name),
    }
}

/// Checks a new name against the reserved words of the language.
pub(crate) fn reserved(name: &str, field: bool) -> Option<Kind> {
    if let Some(kind) = keyword(name) {
        return Some(kind);
    }
    if name.starts_with("__tfe") {
        Some(Kind::ReservedPrefix {
            name: name.to_owned(),
            field,
        })
    } else if matches!(name, "t" | "pi" | "_") || is_function(name) {
        Some(Kind::ReservedName {
            name: name.to_owned(),
            field,
        })
    } else {
        None
    }
}
