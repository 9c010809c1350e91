//! Access to tables of reference values, and comparisons with messages that say what differs.

#![allow(dead_code)] // each test target uses its part

mod largest;

pub use largest::larger;

use nalgebra::DMatrix;
use serde_json::Value;
use std::path::Path;

/// The folder of the workspace: tests belong to the package there or to one in a folder below.
fn root() -> &'static Path {
    let mut above = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors();
    let is_root = |folder: &&Path| folder.join("tests/reference").is_dir();
    above.find(is_root).expect("tests/reference")
}

/// Reads a table of `tests/reference`.
pub fn reference(name: &str) -> Value {
    let path = root().join(format!("tests/reference/{name}.json"));
    let at = path.display();
    let text = std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{at}: {error}"));
    serde_json::from_str(&text).unwrap_or_else(|error| panic!("{at}: {error}"))
}

/// A number from a table.
pub fn number(value: &Value) -> f64 {
    value
        .as_f64()
        .unwrap_or_else(|| panic!("{value} is not a number"))
}

/// A list from a table.
pub fn list(value: &Value) -> &[Value] {
    value
        .as_array()
        .unwrap_or_else(|| panic!("{value} is not a list"))
}

/// A list of numbers from a table.
pub fn numbers(value: &Value) -> Vec<f64> {
    list(value).iter().map(number).collect()
}

/// A count from a table.
pub fn count(value: &Value) -> usize {
    value
        .as_u64()
        .and_then(|n| usize::try_from(n).ok())
        .unwrap_or_else(|| panic!("{value} is not a count"))
}

/// A string from a table.
pub fn word(value: &Value) -> &str {
    value
        .as_str()
        .unwrap_or_else(|| panic!("{value} is not a word"))
}

/// The case of this name in a table.
pub fn case(table: &str, name: &str) -> Value {
    let cases = reference(table);
    let mut cases = list(&cases["cases"]).iter();
    let found = cases.find(|case| word(&case["name"]) == name);
    found
        .unwrap_or_else(|| panic!("{table} has no case {name}"))
        .clone()
}

/// A matrix given by its rows.
pub fn matrix(value: &Value) -> DMatrix<f64> {
    let rows: Vec<Vec<f64>> = list(value).iter().map(numbers).collect();
    DMatrix::from_fn(rows.len(), rows[0].len(), |i, j| rows[i][j])
}

/// Asserts that every entry is within `tolerance · max(1, |expected|)` of the expected one.
#[track_caller]
pub fn assert_matrix(actual: &DMatrix<f64>, expected: &DMatrix<f64>, tolerance: f64, what: &str) {
    assert_eq!(actual.shape(), expected.shape(), "{what}");
    for i in 0..expected.nrows() {
        for j in 0..expected.ncols() {
            let (a, e) = (actual[(i, j)], expected[(i, j)]);
            let error = (a - e).abs() / e.abs().max(1.0);
            assert!(
                error <= tolerance,
                "{what}: entry ({i}, {j}) is {a:e}, expected {e:e}, error {error:.1e}"
            );
        }
    }
}

/// Asserts that every entry is within `tolerance` of the expected one, absolutely.
#[track_caller]
pub fn assert_close(actual: &[f64], expected: &[f64], tolerance: f64, what: &str) {
    assert_eq!(actual.len(), expected.len(), "{what}");
    for (k, (a, e)) in actual.iter().zip(expected).enumerate() {
        assert!(
            (a - e).abs() <= tolerance,
            "{what}: entry {k} is {a:e}, expected {e:e}, error {:.1e}",
            (a - e).abs()
        );
    }
}

/// The largest difference of corresponding entries of two lists of equal length.
#[track_caller]
pub fn distance(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len(), "{a:?} {b:?}");
    a.iter()
        .zip(b)
        .map(|(a, b)| (a - b).abs())
        .fold(0.0, larger)
}

/// The observed order: the slope of log(error) against log(step) by least squares, over the points above `floor`.
///
/// # Panics
/// If fewer than three points are above the floor, which is too few to determine an order, or if an error is NaN.
#[track_caller]
pub fn observed_order(points: &[(f64, f64)], floor: f64, what: &str) -> f64 {
    assert!(
        points.iter().all(|(_, error)| error.is_finite()),
        "{what}: {points:?}"
    );
    let usable: Vec<(f64, f64)> = points
        .iter()
        .filter(|(_, error)| *error > floor)
        .map(|(h, error)| (h.ln(), error.ln()))
        .collect();
    assert!(
        usable.len() >= 3,
        "{what}: only {} points above {floor:e}: {points:?}",
        usable.len()
    );
    let n = usable.len() as f64;
    let mean = |f: &dyn Fn(&(f64, f64)) -> f64| usable.iter().map(f).sum::<f64>() / n;
    let (x, y) = (mean(&|p| p.0), mean(&|p| p.1));
    let covariance = mean(&|p| (p.0 - x) * (p.1 - y));
    covariance / mean(&|p| (p.0 - x).powi(2))
}
