//! Finds parameters by their names.

/// The index of a parameter.
///
/// # Panics
/// If no parameter has this name.
#[track_caller]
pub(crate) fn place_of(name: &str, parameters: &[String]) -> usize {
    let place = parameters.iter().position(|own| own == name);
    place.unwrap_or_else(|| {
        panic!(
            "the model has no parameter `{name}`, only `{}`",
            parameters.join("`, `")
        )
    })
}
