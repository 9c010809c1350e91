//! Operation counts, pinned: a change of the engine shows here.

#[path = "../examples/operation_counts.rs"]
mod example;

use example::{MODELS, counted, weighted};

/// Additions, multiplications, divisions, sine and cosine evaluations.
const PINNED: [[usize; 4]; 5] = [
    [10, 14, 0, 6],
    [29, 33, 0, 12],
    [94, 94, 0, 30],
    [11, 24, 0, 2],
    [34, 70, 0, 4],
];

#[test]
fn counts_are_pinned_and_no_worse_than_published() {
    for (model, pinned) in MODELS.iter().zip(PINNED) {
        let counts = counted(model).expect("the declaration is right");
        assert_eq!(counts, pinned, "{}", model.name);
        for published in &model.published[1..] {
            assert!(weighted(counts) <= weighted(*published), "{}", model.name);
            let sum = |c: [usize; 4]| c[0] + c[1] + c[2];
            assert!(
                sum(counts) <= sum(*published),
                "{}: {counts:?} against {published:?}",
                model.name
            );
        }
    }
}
