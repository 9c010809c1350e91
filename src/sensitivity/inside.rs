//! Derivatives of a motion between its nodes (T-154).

use nalgebra::{DMatrix, RowDVector};
use tfe_runtime::basis::{MAX_NODES, legendre, legendre_integrals, legendre_slopes};
use tfe_runtime::{InsideLoss, InsideSlopes};

/// The derivatives at the start of an element, with which its own derivatives are multiplied.
#[derive(Clone, Debug)]
pub(crate) struct Before {
    /// The derivatives of (p, q), a column for each component of the start of the run and for each parameter.
    pub(crate) state: DMatrix<f64>,
    /// The derivatives of the start time, if it is the time of an event.
    pub(crate) start: Option<Vec<f64>>,
}

impl Before {
    /// Transforms rows of derivatives by the start of an element and its directions (parameters, its start time, its
    /// end) into derivatives by the start of the run and by parameters; `ends` are the derivatives of the end time.
    pub(crate) fn through(&self, rows: &DMatrix<f64>, ends: Option<&[f64]>) -> DMatrix<f64> {
        let (size, columns) = self.state.shape();
        let parameters = columns - size;
        let mut next = rows.columns(0, size) * &self.state;
        let mut by_parameters = next.columns_mut(size, parameters);
        by_parameters += rows.columns(size, parameters);
        let starts = self.start.as_deref().map(|moved| (columns, moved));
        let ends = ends.map(|ends| (rows.ncols() - 1, ends));
        for (direction, times) in starts.into_iter().chain(ends) {
            for (mut column, dt) in next.column_iter_mut().zip(times) {
                column.axpy(*dt, &rows.column(direction), 1.0);
            }
        }
        next
    }
}

/// The derivatives along an element, or a piece of one that was cut.
#[derive(Clone, Debug)]
pub(crate) struct Inside {
    pub(crate) times: (f64, f64),
    /// The length, to the full digits of the step.
    pub(crate) length: f64,
    /// The derivatives by the start of the element and by its directions.
    pub(crate) slopes: InsideSlopes,
    pub(crate) before: Before,
    /// The derivatives of the end time of the element, if it is the time of an event.
    pub(crate) ends: Option<Vec<f64>>,
    /// The motion of the piece in time, if events move it.
    pub(crate) moved: Option<Moved>,
}

/// The motion of an element in time.
#[derive(Clone, Debug)]
pub(crate) struct Moved {
    /// The derivatives of its start time and of its end time.
    pub(crate) ends: [RowDVector<f64>; 2],
    /// The coefficients of the polynomial.
    pub(crate) values: Vec<f64>,
}

impl Moved {
    /// The derivative of the time at a fraction of the element.
    pub(crate) fn time(&self, tau: f64) -> RowDVector<f64> {
        &self.ends[0] * (1.0 - tau) + &self.ends[1] * tau
    }

    /// The derivative of the length.
    pub(crate) fn length(&self) -> RowDVector<f64> {
        &self.ends[1] - &self.ends[0]
    }
}

/// The derivatives at a time.
pub(crate) struct Between {
    /// The derivatives of (p, q).
    pub(crate) state: DMatrix<f64>,
    /// The derivatives of the time derivative of the polynomial of q.
    pub(crate) velocity: DMatrix<f64>,
}

impl Inside {
    fn coordinates(&self) -> usize {
        self.before.state.nrows() / 2
    }

    /// The number of columns before multiplication.
    fn width(&self) -> usize {
        self.slopes.start.len() / (2 * self.coordinates())
    }

    fn degree(&self) -> usize {
        self.slopes.coefficients.len() / (2 * self.coordinates() * self.width())
    }

    fn through(&self, rows: &DMatrix<f64>) -> DMatrix<f64> {
        self.before.through(rows, self.ends.as_deref())
    }

    /// Adds Σ weight_m C_m of the coordinates, or of the momenta, to rows from `first` on.
    fn add_weighted(
        &self,
        momenta: bool,
        weights: &[f64],
        (rows, first): (&mut DMatrix<f64>, usize),
    ) {
        let (n, width, degree) = (self.coordinates(), self.width(), self.degree());
        let skipped = if momenta { degree * n } else { 0 };
        let own = self.slopes.coefficients.chunks_exact(width).skip(skipped);
        for (number, row) in own.take(degree * n).enumerate() {
            let (m, a) = (number / n, number % n);
            for (column, slope) in row.iter().enumerate() {
                rows[(first + a, column)] += weights[m] * slope;
            }
        }
    }

    /// The derivatives of (p, q) at a fraction τ of the element, including the motion of the element in time.
    fn at_part(&self, tau: f64) -> DMatrix<f64> {
        let n = self.coordinates();
        let mut integrals = [0.0; MAX_NODES];
        legendre_integrals(tau, &mut integrals);
        let mut state = DMatrix::from_row_slice(2 * n, self.width(), &self.slopes.start);
        self.add_weighted(true, &integrals, (&mut state, 0));
        self.add_weighted(false, &integrals, (&mut state, n));
        self.through(&state)
    }

    /// The derivatives of a loss of the polynomial along the element: one number for each column.
    pub(crate) fn product(&self, loss: &InsideLoss) -> DMatrix<f64> {
        let mut row = DMatrix::zeros(1, self.width());
        self.slopes.add_to(loss, row.as_mut_slice());
        self.through(&row)
    }

    /// The derivatives of (p, q) and q̇ at a time.
    pub(crate) fn at(&self, t: f64) -> Between {
        let (n, length) = (self.coordinates(), self.length);
        let tau = (t - self.times.0) / (self.times.1 - self.times.0);
        let mut values = [0.0; MAX_NODES];
        legendre(tau, &mut values);
        let mut velocity = DMatrix::zeros(n, self.width());
        self.add_weighted(false, &values, (&mut velocity, 0));
        let mut between = Between {
            state: self.at_part(tau),
            velocity: self.through(&velocity) / length,
        };
        let Some(moved) = &self.moved else {
            return between;
        };
        // At a fixed time, δτ = −δt/h.
        let time = moved.time(tau) / -length;
        let stretch = moved.length() / length;
        let degree = self.degree();
        // By τ, that is twice those by the argument 2τ − 1.
        let slopes = legendre_slopes(tau, degree).map(|slope| 2.0 * slope);
        let along = |first: usize, a: usize, weights: &[f64]| -> f64 {
            let own = (0..degree).map(|m| weights[m] * moved.values[(first + m) * n + a]);
            own.sum()
        };
        for a in 0..n {
            let velocity = along(0, a, &values) / length;
            for column in 0..between.state.ncols() {
                let (tau, stretch) = (time[column], stretch[column]);
                between.state[(a, column)] += along(degree, a, &values) * tau;
                between.state[(n + a, column)] += velocity * length * tau;
                between.velocity[(a, column)] +=
                    along(0, a, &slopes) / length * tau - velocity * stretch;
            }
        }
        between
    }
}
