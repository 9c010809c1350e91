//! When Newton's method on a chain has arrived, and how far it dares to go.

use super::control::Control;
use super::error::AssemblyError;

/// Corrections below this one that no longer fall are round-off: a step from here would square them.
const ROUND_OFF: f64 = 1e-9;

/// The shortest part of a step that is tried.
const SHORTEST: f64 = 1.0 / 256.0;

/// The course of the corrections.
///
/// A step after which the next correction would be more than twice as large, or which leaves where the model is defined, is tried again
/// at half its length.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Convergence {
    control: Control,
    size: f64,
    last: f64,
    fraction: f64,
    iterations: u32,
}

impl Convergence {
    /// From the size of the first correction.
    pub(crate) fn new(control: Control, size: f64) -> Self {
        Self {
            control,
            size,
            last: f64::INFINITY,
            fraction: 1.0,
            iterations: 0,
        }
    }

    /// Whether the present correction is the last.
    pub(crate) fn is_done(&self) -> bool {
        let stagnates = self.last < ROUND_OFF && self.size >= 0.25 * self.last;
        self.size <= self.control.tolerance || stagnates
    }

    /// Whether another iteration may follow.
    pub(crate) fn go_on(&self) -> Result<(), AssemblyError> {
        if self.size.is_finite() && self.iterations < self.control.max_iterations {
            return Ok(());
        }
        Err(self.stalled())
    }

    /// Which part of the correction to apply.
    pub(crate) fn fraction(&self) -> f64 {
        self.fraction
    }

    /// Judges the correction that follows a step.
    pub(crate) fn accepts(&mut self, is_defined: bool, next: f64) -> bool {
        self.iterations += 1;
        let accepted = is_defined && (next <= 2.0 * self.size || next < ROUND_OFF);
        if accepted {
            (self.last, self.size) = (self.size, next);
            self.fraction = (2.0 * self.fraction).min(1.0);
        }
        accepted
    }

    /// Takes half of the step that was not accepted, as long as that is something.
    pub(crate) fn halve(&mut self) -> Result<(), AssemblyError> {
        self.fraction *= 0.5;
        if self.fraction < SHORTEST {
            // The one that was tried does not count.
            self.iterations -= 1;
            return Err(self.stalled());
        }
        self.iterations += 1;
        Ok(())
    }

    fn stalled(&self) -> AssemblyError {
        AssemblyError::Stalled {
            iterations: self.iterations,
            correction: self.size,
            tolerance: self.control.tolerance,
        }
    }
}

/// The largest of some values and of their corrections.
#[derive(Clone, Copy, Default)]
struct Largest {
    value: f64,
    correction: f64,
    /// Zero, or not a number where a correction is none.
    sum: f64,
}

impl Largest {
    fn take(&mut self, values: &[f64], corrections: &[f64]) {
        for (value, correction) in values.iter().zip(corrections) {
            self.value = self.value.max(value.abs());
            self.correction = self.correction.max(correction.abs());
            self.sum += 0.0 * correction;
        }
    }

    /// The correction beside the value or beside another scale, whichever is larger; one at most.
    fn beside(&self, scale: f64) -> f64 {
        if self.correction == 0.0 {
            0.0
        } else {
            self.correction / self.value.max(scale).max(self.correction)
        }
    }
}

/// The correction beside the iterate: the largest of those of coordinates, momenta and (already beside their scales) globals. Nodes are (p, q, correction).
///
/// An orbit near an equilibrium may have no momenta to compare with. The matrices of the elements tell what its coordinates are
/// worth: momenta count as small beside max |∂p₁/∂q₀| max |q|, and coordinates the other way round.
pub(crate) fn size<'a>(
    nodes: impl Iterator<Item = (&'a [f64], &'a [f64], &'a [f64])>,
    matrices: &[f64],
    globals: impl Iterator<Item = f64>,
) -> f64 {
    let [mut p, mut q] = [Largest::default(); 2];
    let mut n = 0;
    for (node_p, node_q, correction) in nodes {
        n = node_p.len();
        let (by_p, by_q) = correction.split_at(n);
        p.take(node_p, by_p);
        q.take(node_q, by_q);
    }
    let (mut p_by_q, mut q_by_p) = (0.0_f64, 0.0_f64);
    for (row, entries) in matrices.chunks_exact((2 * n).max(1)).enumerate() {
        let (by_p, by_q) = entries.split_at(n);
        let (entries, largest) = if row % (2 * n) < n {
            (by_q, &mut p_by_q)
        } else {
            (by_p, &mut q_by_p)
        };
        *largest = entries
            .iter()
            .fold(*largest, |largest, entry| largest.max(entry.abs()));
    }
    let mut size = p.beside(p_by_q * q.value).max(q.beside(q_by_p * p.value));
    let mut sum = p.sum + q.sum;
    for correction in globals {
        size = size.max(correction.abs());
        sum += 0.0 * correction;
    }
    // Maxima ignore what is not a number; the sum does not.
    size + sum
}
