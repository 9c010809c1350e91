//! Operation counts of the kernels are pinned: a change of the optimiser shows here.

#[path = "../examples/operation_counts.rs"]
mod example;

use example::{MODELS, counted, least_published, weighted};

/// Additions, multiplications, divisions, and evaluations of sine or cosine.
const PINNED: [[usize; 4]; 5] = [
    [11, 18, 0, 4],
    [32, 45, 0, 6],
    [104, 134, 0, 10],
    [10, 17, 0, 2],
    [23, 45, 0, 4],
];

#[test]
fn counts_are_pinned_and_below_all_published() {
    for (model, pinned) in MODELS.iter().zip(PINNED) {
        let counts = counted(model).expect("the declaration is right");
        assert_eq!(counts, pinned, "{}", model.name);
        let best = least_published(model);
        let own = weighted(counts);
        assert!(own < best, "{}: {own} against {best}", model.name);
    }
}

#[test]
fn five_links_save_a_third() {
    // 5 pairs of sine and cosine instead of 15: those of the 10 differences of angles follow from those of the angles.
    let model = &MODELS[2];
    let counts = counted(model).expect("the declaration is right");
    assert!(3.0 * weighted(counts) <= 2.0 * least_published(model));
}

/// The size of the code generated for a pendulum with gravity, mass and length, in characters without spaces: all
/// kernels, and nothing that the model does not need (no forces, constraints or outputs). About six hundred characters
/// are for derivatives by the three parameters, and fifty are quotation marks and commas of documentation lines.
#[test]
fn emitted_code_keeps_to_a_budget() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/tfe-macros/golden/pendulum.rs");
    let golden = std::fs::read_to_string(path).expect("a golden file");
    let code = golden
        .lines()
        .filter(|line| !line.trim_start().starts_with("///"));
    let characters: usize = code
        .flat_map(str::chars)
        .filter(|c| !c.is_whitespace())
        .count();
    println!("{characters} characters");
    assert!(characters <= 4080, "{characters} characters");
    for absent in ["first.force[", "fn constraint", "fn observables"] {
        assert!(
            !golden.contains(absent),
            "`{absent}` is emitted for a model that has none"
        );
    }
}
