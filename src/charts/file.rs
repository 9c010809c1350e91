//! Writing of files; the format follows from the file name.

use super::error::ChartError;
use std::fs;
use std::path::Path;

/// The known ending (including the dot) with which the file name ends.
pub(super) fn ending(
    path: &Path,
    known: &'static [&'static str],
) -> Result<&'static str, ChartError> {
    let has = |ending: &str| {
        path.extension()
            .is_some_and(|extension| extension.eq_ignore_ascii_case(&ending[1..]))
    };
    known
        .iter()
        .find(|ending| has(ending))
        .copied()
        .ok_or_else(|| ChartError::UnknownEnding {
            path: path.to_owned(),
            known,
        })
}

/// Writes a file.
pub(super) fn write(path: &Path, contents: impl AsRef<[u8]>) -> Result<(), ChartError> {
    fs::write(path, contents).map_err(|source| ChartError::Io {
        path: path.to_owned(),
        source,
    })
}

/// A field of a CSV file, quoted if necessary.
pub(super) fn csv_field(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}

/// A number of a CSV file, in the shortest form that reads back exactly; empty if there is none.
pub(super) fn csv_number(value: Option<f64>) -> String {
    value
        .filter(|value| value.is_finite())
        .map_or_else(String::new, |value| format!("{value:?}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn endings() {
        let known: &[&str] = &[".svg", ".csv"];
        assert_eq!(ending(Path::new("a.b/c.SVG"), known).unwrap(), ".svg");
        let error = ending(Path::new("chart.pdf"), known).unwrap_err();
        assert!(
            matches!(&error, ChartError::UnknownEnding { path, .. } if path == Path::new("chart.pdf"))
        );
        let text = error.to_string();
        assert!(text.contains("chart.pdf") && text.contains(".svg or .csv"));
        assert!(ending(Path::new("svg"), known).is_err());
    }

    #[test]
    fn csv_fields() {
        assert_eq!(csv_field("plain"), "plain");
        assert_eq!(csv_field("a, \"b\""), "\"a, \"\"b\"\"\"");
        assert_eq!(csv_number(Some(0.1)), "0.1");
        assert_eq!(csv_number(Some(f64::NAN)), "");
        assert_eq!(csv_number(None), "");
    }
}
