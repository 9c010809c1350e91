//! Stability maps over a plane of two parameters.

mod error;
mod floquet;

pub use error::{FloquetError, MapError, PointError, PointFailure};

use crate::progress::Progress;
use std::convert::Infallible;
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::ops::Range;
use std::path::Path;
use std::sync::{Mutex, PoisonError};

/// A stability map: the spectral radius, or another measure of instability, over a rectangle of two parameters x and
/// y.
///
/// The rectangle is divided into equal cells; the value of a cell is that at its centre. Column 0 is at the smallest
/// x, row 0 at the smallest y. A cell whose value could not be computed has none; such cells are counted, and the
/// first is kept with its error.
///
/// ```
/// use tfe::prelude::*;
/// use tfe::stability::StabilityMap;
///
/// // The spectral radius of one step of an oscillator, over its frequency and the step.
/// #[dynamics(coordinates(x), lagrangian = dot(x)^2/2 - omega^2/2*x^2)]
/// struct Oscillator { omega: f64 }
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let map = StabilityMap::over(0.5..2.0, 0.0..4.0)
///     .resolution(30, 40)
///     .labels("ω", "h")
///     .run(|omega, h| {
///         let oscillator = Oscillator { omega };
///         let rest = oscillator.state([0.0], [0.0]);
///         stability::transition_matrix(&oscillator, Primal::<2>, &rest, 0.0, h)
///             .map(|matrix| stability::spectral_radius(&matrix))
///     })?;
/// assert_eq!(map.failed(), 0);
/// // The limit is ωh = √12.
/// assert!(map.radius_at(1.0, 3.0).unwrap() < 1.0 + 1e-9);
/// assert!(map.radius_at(1.8, 3.0).unwrap() > 1.5);
/// # let path = std::env::temp_dir().join(format!("tfe-map-{}.csv", std::process::id()));
/// map.save(&path)?; // .csv; .svg and .png with the feature `charts`
/// # std::fs::remove_file(&path)?;
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug)]
pub struct StabilityMap<E> {
    plan: MapPlan,
    values: Vec<Option<f64>>,
    failed: usize,
    first_failure: Option<PointFailure<E>>,
}

/// The settings of a map: its rectangle, the number of cells, labels. Made by [`StabilityMap::over`].
///
/// Defaults: 200 × 200 cells, labels “x” and “y”, no title, no progress, unstable above 1 + 10⁻⁶.
#[derive(Clone, Debug)]
pub struct MapPlan {
    x: Range<f64>,
    y: Range<f64>,
    columns: usize,
    rows: usize,
    labels: [String; 2],
    title: String,
    limit: f64,
    progress: bool,
}

impl StabilityMap<Infallible> {
    /// Begins a map over the rectangle of these ranges (the outer edges of the cells).
    pub fn over(x: Range<f64>, y: Range<f64>) -> MapPlan {
        MapPlan {
            x,
            y,
            columns: 200,
            rows: 200,
            labels: ["x".to_owned(), "y".to_owned()],
            title: String::new(),
            limit: 1.0 + 1e-6,
            progress: false,
        }
    }
}

impl MapPlan {
    /// Sets the number of cells in the directions of x and of y; at most 2²⁸ in all.
    #[must_use]
    pub fn resolution(mut self, columns: usize, rows: usize) -> Self {
        (self.columns, self.rows) = (columns, rows);
        self
    }

    /// Sets the names of the parameters, for pictures and messages.
    #[must_use]
    pub fn labels(mut self, x: impl Into<String>, y: impl Into<String>) -> Self {
        self.labels = [x.into(), y.into()];
        self
    }

    /// Sets the title of pictures.
    #[must_use]
    pub fn title(mut self, title: impl Into<String>) -> Self {
        self.title = title.into();
        self
    }

    /// Sets the value above which a cell counts as unstable; 1 + 10⁻⁶ by default. It is not exactly 1 because rounding
    /// splits multipliers of modulus one that meet, by the square root of the rounding unit.
    #[must_use]
    pub fn limit(mut self, limit: f64) -> Self {
        self.limit = limit;
        self
    }

    /// Shows the progress of long maps on standard error, once a second.
    #[must_use]
    pub fn progress(mut self) -> Self {
        self.progress = true;
        self
    }

    /// Computes the value of every cell, on all processors with the feature `parallel`. The result does not depend on
    /// their number.
    ///
    /// A cell whose value is not finite counts as failed, with [`PointError::NotFinite`].
    ///
    /// # Errors
    /// [`MapError::Resolution`], [`MapError::Range`] or [`MapError::Limit`] for an invalid number of cells, range or
    /// limit. Failures of single cells are part of the map.
    pub fn run<E, F>(&self, radius: F) -> Result<StabilityMap<E>, MapError>
    where
        E: Send,
        F: Fn(f64, f64) -> Result<f64, E> + Sync,
    {
        self.check()?;
        Ok(self.computed(|| (), |(), x, y| radius(x, y)))
    }

    /// Computes all cells with `point`, which may use memory that is created once for each row.
    fn computed<E, S>(
        &self,
        memory: impl Fn() -> S + Sync,
        point: impl Fn(&mut S, f64, f64) -> Result<f64, E> + Sync,
    ) -> StabilityMap<E>
    where
        E: Send,
    {
        let progress = Progress::new(self.progress, self.rows, "rows");
        let rows = each_row(self.rows, |row| {
            let mut memory = memory();
            let row = Row::of(self, row, |x, y| point(&mut memory, x, y));
            progress.advance(1);
            row
        });
        StabilityMap::of(self.clone(), rows)
    }

    fn check(&self) -> Result<(), MapError> {
        const MAX_CELLS: usize = 1 << 28;
        let (columns, rows) = (self.columns, self.rows);
        let cells = columns.checked_mul(rows);
        if !cells.is_some_and(|cells| (1..=MAX_CELLS).contains(&cells)) {
            return Err(MapError::Resolution { columns, rows });
        }
        for (label, range) in self.labels.iter().zip([&self.x, &self.y]) {
            let (start, end) = (range.start, range.end);
            if !(start.is_finite() && end.is_finite() && start < end) {
                let label = label.clone();
                return Err(MapError::Range { label, start, end });
            }
        }
        if self.limit.is_nan() {
            return Err(MapError::Limit);
        }
        Ok(())
    }

    fn x_of(&self, column: usize) -> f64 {
        centre(&self.x, column, self.columns)
    }

    fn y_of(&self, row: usize) -> f64 {
        centre(&self.y, row, self.rows)
    }
}

/// The centre of the k-th of equal cells.
fn centre(range: &Range<f64>, k: usize, count: usize) -> f64 {
    let fraction = (k as f64 + 0.5) / count as f64;
    range.start * (1.0 - fraction) + range.end * fraction
}

/// The index of the cell that contains a number.
fn cell(range: &Range<f64>, value: f64, count: usize) -> Option<usize> {
    if !(range.start..=range.end).contains(&value) {
        return None;
    }
    // Halved, since the difference of two finite numbers may overflow.
    let fraction = (0.5 * value - 0.5 * range.start) / (0.5 * range.end - 0.5 * range.start);
    Some(((fraction * count as f64) as usize).min(count - 1))
}

/// The results of a function of all rows.
fn each_row<T: Send>(rows: usize, row: impl Fn(usize) -> T + Sync) -> Vec<T> {
    let mut places = Vec::with_capacity(rows);
    places.resize_with(rows, || Mutex::new(None));
    for_each_row(rows, &|number| {
        let found = row(number);
        *places[number]
            .lock()
            .unwrap_or_else(PoisonError::into_inner) = Some(found);
    });
    let found =
        |place: Mutex<Option<T>>| place.into_inner().unwrap_or_else(PoisonError::into_inner);
    places.into_iter().filter_map(found).collect()
}

/// Solves all rows; compiled once, and not for every map.
#[cfg(feature = "parallel")]
fn for_each_row(rows: usize, solve: &(dyn Fn(usize) + Sync)) {
    use rayon::iter::{IntoParallelIterator, ParallelIterator};
    (0..rows).into_par_iter().for_each(solve);
}

#[cfg(not(feature = "parallel"))]
fn for_each_row(rows: usize, solve: &(dyn Fn(usize) + Sync)) {
    (0..rows).for_each(solve);
}

/// The cells of one row.
struct Row<E> {
    values: Vec<Option<f64>>,
    failed: usize,
    first_failure: Option<PointFailure<E>>,
}

impl<E> Row<E> {
    fn of(plan: &MapPlan, row: usize, mut point: impl FnMut(f64, f64) -> Result<f64, E>) -> Self {
        let y = plan.y_of(row);
        let mut cells = Self {
            values: Vec::with_capacity(plan.columns),
            failed: 0,
            first_failure: None,
        };
        for column in 0..plan.columns {
            let x = plan.x_of(column);
            let error = match point(x, y) {
                Ok(value) if value.is_finite() => {
                    cells.values.push(Some(value));
                    continue;
                }
                Ok(value) => PointError::NotFinite { value },
                Err(error) => PointError::Failed(error),
            };
            cells.values.push(None);
            cells.failed += 1;
            cells.first_failure.get_or_insert(PointFailure {
                column,
                row,
                x,
                y,
                error,
            });
        }
        cells
    }
}

impl<E> StabilityMap<E> {
    fn of(plan: MapPlan, rows: Vec<Row<E>>) -> Self {
        let mut map = Self {
            values: Vec::with_capacity(plan.columns * plan.rows),
            failed: 0,
            first_failure: None,
            plan,
        };
        for row in rows {
            map.values.extend(row.values);
            map.failed += row.failed;
            map.first_failure = map.first_failure.or(row.first_failure);
        }
        map
    }

    /// The number of cells in the direction of x.
    pub fn columns(&self) -> usize {
        self.plan.columns
    }

    /// The number of cells in the direction of y.
    pub fn rows(&self) -> usize {
        self.plan.rows
    }

    /// The value of x at the centres of the cells of a column.
    pub fn x(&self, column: usize) -> f64 {
        self.plan.x_of(column)
    }

    /// The value of y at the centres of the cells of a row.
    pub fn y(&self, row: usize) -> f64 {
        self.plan.y_of(row)
    }

    /// The value of a cell; `None` if it failed or lies outside the map.
    pub fn value(&self, column: usize, row: usize) -> Option<f64> {
        if column >= self.columns() || row >= self.rows() {
            return None;
        }
        self.values[row * self.columns() + column]
    }

    /// The value of the cell that contains the point (x, y), computed at its centre; `None` if it failed or the point
    /// lies outside the map.
    pub fn radius_at(&self, x: f64, y: f64) -> Option<f64> {
        let column = cell(&self.plan.x, x, self.columns())?;
        let row = cell(&self.plan.y, y, self.rows())?;
        self.value(column, row)
    }

    /// The largest value; `None` if all cells failed.
    pub fn largest(&self) -> Option<f64> {
        self.values.iter().flatten().copied().reduce(f64::max)
    }

    /// The fraction of unstable cells, those above the [limit](MapPlan::limit), among the cells with a value: from 0
    /// to 1; `None` if all cells failed.
    pub fn fraction_unstable(&self) -> Option<f64> {
        let known = self.values.len() - self.failed;
        let is_unstable = |value: &&f64| **value > self.plan.limit;
        let unstable = self.values.iter().flatten().filter(is_unstable).count();
        (known > 0).then(|| unstable as f64 / known as f64)
    }

    /// The number of cells without a value.
    pub fn failed(&self) -> usize {
        self.failed
    }

    /// The first cell without a value, counted from the lowest row.
    pub fn first_failure(&self) -> Option<&PointFailure<E>> {
        self.first_failure.as_ref()
    }

    /// Writes a file: the picture of [`StabilityMap::heat_map`] as `.svg`, its cells as `.png`, or the values as
    /// `.csv` with the columns x, y, value, where the value of a failed cell is empty. Without the feature `charts`
    /// only `.csv`.
    ///
    /// # Errors
    /// [`MapError::UnknownEnding`] for another ending, [`MapError::Io`] if the file cannot be written,
    /// [`MapError::Chart`] if there is no picture because all cells failed.
    pub fn save(&self, path: impl AsRef<Path>) -> Result<(), MapError> {
        let path = path.as_ref();
        let is = |ending| {
            path.extension()
                .is_some_and(|found| found.eq_ignore_ascii_case(ending))
        };
        if is("csv") {
            return self.write_csv(path).map_err(|source| MapError::Io {
                path: path.to_owned(),
                source,
            });
        }
        #[cfg(feature = "charts")]
        if is("svg") || is("png") {
            return Ok(self.heat_map().save(path)?);
        }
        Err(MapError::UnknownEnding {
            path: path.to_owned(),
            known: KNOWN_ENDINGS,
        })
    }

    fn write_csv(&self, path: &Path) -> io::Result<()> {
        let mut file = BufWriter::new(File::create(path)?);
        writeln!(file, "x,y,value")?;
        for (row, values) in self.values.chunks_exact(self.columns()).enumerate() {
            let y = self.y(row);
            for (column, value) in values.iter().enumerate() {
                write!(file, "{:?},{y:?},", self.x(column))?;
                match value {
                    Some(value) => writeln!(file, "{value:?}")?,
                    None => writeln!(file)?,
                }
            }
        }
        file.flush()
    }
}

#[cfg(feature = "charts")]
const KNOWN_ENDINGS: &[&str] = &[".svg", ".png", ".csv"];
#[cfg(not(feature = "charts"))]
const KNOWN_ENDINGS: &[&str] = &[".csv"];

#[cfg(feature = "charts")]
mod picture;

#[cfg(test)]
mod tests;
