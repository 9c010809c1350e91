//! Compile errors for mistakes in a declaration: the whole message of each, with the underlined token.
//! `TRYBUILD=overwrite cargo test` rewrites the expected messages.

use std::process::Command;

/// The environment variable with flags for rustc that takes precedence over all others.
const FLAGS: &str = "CARGO_ENCODED_RUSTFLAGS";

/// `trybuild` compiles the crates on which the cases depend with one set of flags, and again with another one for the
/// cases. With the flags from the environment, which are these, they are compiled only once.
const OF_CASES: &str = "--cfg\x1ftrybuild\x1f-A\x1fdead_code\x1f--diagnostic-width=140";

#[test]
fn messages() {
    if std::env::var(FLAGS).is_ok_and(|flags| flags == OF_CASES) {
        let cases = trybuild::TestCases::new();
        cases.compile_fail("*/*.rs");
        return;
    }
    let itself = std::env::current_exe().expect("a path of this test");
    let status = Command::new(itself)
        .args(["--exact", "messages", "--nocapture"])
        .env(FLAGS, OF_CASES)
        .status()
        .expect("this test once more");
    assert!(status.success(), "messages differ, see above");
}

/// The engine's own test corpus has a case for every kind of diagnostic. Here are those that users are likely to meet,
/// with the place that rustc underlines.
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
