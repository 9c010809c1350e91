//! Operation counts, pinned: a change of the engine shows here.

#[path = "../examples/operation_counts.rs"]
mod example;

use example::{MODELS, counted, least_published, weighted};

/// Additions, multiplications, divisions, sine and cosine evaluations.
const PINNED: [[usize; 4]; 5] = [
    [11, 18, 0, 4],
    [32, 45, 0, 6],
    [104, 134, 0, 10],
    [10, 17, 0, 2],
    [23, 44, 0, 4],
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
    // 5 pairs of sine and cosine instead of 15: the 10 differences of angles follow from the angles.
    let model = &MODELS[2];
    let counts = counted(model).expect("the declaration is right");
    assert!(3.0 * weighted(counts) <= 2.0 * least_published(model));
}
