//! Mistakes in a declaration: the whole message of each, under the guilty token. `TRYBUILD=overwrite cargo test` rewrites the expectations.

#[test]
fn messages() {
    let cases = trybuild::TestCases::new();
    cases.compile_fail("*/*.rs");
}

/// The engine's own corpus has a case for every kind of diagnostic; here are those that a user meets, with the place that rustc underlines.
#[test]
fn there_are_many_cases() {
    let themes = std::fs::read_dir(env!("CARGO_MANIFEST_DIR")).expect("a folder of themes");
    let themes = themes.map(|theme| theme.expect("a readable folder").path());
    let cases: usize = themes
        .filter(|theme| theme.is_dir())
        .map(|theme| std::fs::read_dir(theme).expect("a folder of cases"))
        .map(|cases| {
            cases
                .filter(|case| {
                    case.as_ref()
                        .is_ok_and(|c| c.path().extension().is_some_and(|e| e == "stderr"))
                })
                .count()
        })
        .sum();
    assert!(cases >= 80, "only {cases} cases");
}
