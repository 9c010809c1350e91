//! Reverse-mode differentiation: numbers that record their operations on a tape. One kernel call, read backwards, gives
//! the derivatives of a weighted sum of its results by all parameters.
//!
//! Dual numbers give the derivatives of all results by one parameter. The adjoint of an element (T-127) needs the
//! opposite, the derivatives of one number by all parameters: with weights w of the results r,
//!
//! ```text
//! ∂(w·r)/∂a = Σ over operations from the last to the first: adjoint of an operand += adjoint of the result × ∂result/∂operand .        (T-149)
//! ```
//!
//! Only operations that depend on a parameter are recorded; coordinates, velocities and the time are plain numbers.
//! Several points are evaluated side by side, as the operations are the same at all of them.

mod functions;
mod number;
mod operations;

pub(crate) use number::Taped;
pub(crate) use operations::{LANES, Operations, Row};

use crate::model::{First, Model};
use alloc::vec::Vec;
use core::cell::RefCell;
use operations::{ZERO, read_backwards};

/// The arguments of kernels at several points, and the weights of the results.
pub(crate) struct Places<const N: usize> {
    count: usize,
    t: Row,
    q: [Row; N],
    z: [Row; N],
    /// The weights of the derivatives by z, of those by q, and of the forces.
    weights: [[Row; N]; 3],
}

impl<const N: usize> Places<N> {
    pub(crate) const NONE: Self = Self {
        count: 0,
        t: ZERO,
        q: [ZERO; N],
        z: [ZERO; N],
        weights: [[ZERO; N]; 3],
    };

    /// Whether all lanes are in use.
    pub(crate) fn is_full(&self) -> bool {
        self.count == LANES
    }

    /// Adds a point, if there is room.
    pub(crate) fn push(&mut self, (t, q, z): (f64, &[f64; N], &[f64; N]), weights: &First<f64, N>) {
        // Unused lanes repeat the first point with zero weights.
        let lanes = match self.count {
            0 => 0..LANES,
            count => count..count + 1,
        };
        self.t[lanes.clone()].fill(t);
        for a in 0..N {
            self.q[a][lanes.clone()].fill(q[a]);
            self.z[a][lanes.clone()].fill(z[a]);
            for (rows, part) in
                (self.weights.iter_mut()).zip([&weights.z, &weights.q, &weights.force])
            {
                rows[a][self.count] = part[a];
            }
        }
        self.count += 1;
    }
}

/// The operations of one kernel call, and the accumulated adjoints of all calls.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tape {
    operations: Operations,
    /// The adjoints of the parameters, summed over all calls, then those of the operations, which are zero between
    /// calls.
    adjoints: Vec<Row>,
}

impl Tape {
    /// Sets the sums of this many parameters to zero.
    pub(crate) fn begin(&mut self, parameters: usize) {
        let operations = &mut self.operations;
        if operations.parameters != parameters {
            self.adjoints.clear();
            operations.parameters = parameters;
        }
        let missing = parameters.saturating_sub(self.adjoints.len());
        self.adjoints.extend(core::iter::repeat_n(ZERO, missing));
        self.adjoints[..parameters].fill(ZERO);
    }

    /// The number of parameters.
    pub(crate) fn parameters(&self) -> usize {
        self.operations.parameters
    }

    /// The sum of a parameter, by its index.
    pub(crate) fn sum(&self, parameter: usize) -> f64 {
        self.adjoints[parameter].iter().sum()
    }

    /// Adds Σ weights · ∂(first derivatives and forces)/∂a over the points to the sum of every parameter a, and clears
    /// the list of points.
    pub(crate) fn take_derivatives<M: Model<N>, const N: usize>(
        &mut self,
        model: &M,
        places: &mut Places<N>,
    ) {
        let ends = self.record(|operations| {
            let time = Taped::time(places.t, operations);
            let mut first = First::zero();
            model.first(
                time,
                &places.q.map(Taped::of),
                &places.z.map(Taped::of),
                &mut first,
            );
            let parts = [first.z, first.q, first.force];
            parts.map(|part| part.map(|result| result.place))
        });
        let weights = places.weights.as_flattened();
        self.read(ends.as_flattened().iter().copied().zip(weights));
        *places = Places::NONE;
    }

    /// Returns a sum and sets it to zero.
    #[cfg(feature = "sparse")]
    pub(crate) fn take(&mut self, place: usize) -> f64 {
        self.take_row(place).iter().sum()
    }

    /// Returns the parts of a sum, one for each point, and sets them to zero.
    pub(crate) fn take_row(&mut self, place: usize) -> Row {
        core::mem::replace(&mut self.adjoints[place], ZERO)
    }

    /// Runs a kernel whose numbers record their operations.
    pub(crate) fn record<P>(&mut self, kernel: impl FnOnce(&RefCell<Operations>) -> P) -> P {
        self.operations.list.clear();
        self.operations.slopes.clear();
        // The numbers share the tape for as long as the kernel runs.
        let operations = RefCell::new(core::mem::take(&mut self.operations));
        let ends = kernel(&operations);
        self.operations = operations.into_inner();
        ends
    }

    /// Reads the tape backwards, from the places of the results with their weights.
    pub(crate) fn read<'w>(&mut self, ends: impl Iterator<Item = (u32, &'w Row)>) {
        let operations = &self.operations;
        let count = operations.parameters + operations.list.len();
        if self.adjoints.len() < count {
            self.adjoints.resize(count, ZERO);
        }
        for (place, weights) in ends {
            if let Some(adjoint) = self.adjoints.get_mut(place as usize) {
                for lane in 0..LANES {
                    adjoint[lane] += weights[lane];
                }
            }
        }
        read_backwards(operations, &mut self.adjoints);
    }
}
