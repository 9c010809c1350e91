//! Convergence test and step control of Newton's method on a chain.

use super::control::Control;
use super::error::AssemblyError;
use crate::numbers::larger;

/// Corrections below this size that no longer decrease are rounding errors: one step of quadratic convergence would
/// reach the precision of the numbers.
const ROUND_OFF: f64 = 1e-9;

/// The shortest fraction of a Newton step that is tried.
const SHORTEST: f64 = 1.0 / 256.0;

/// After a correction below this relative size of a component, quadratic convergence leaves rounding error only, so no
/// further correction is needed.
const SQUARED: f64 = 1e-8;

/// A component with a relative correction above this is not converged, even if its corrections stagnate.
const SETTLED: f64 = 1e-3;

/// Components below this part of the largest of their kind may be rounding errors of it, as those that vanish by
/// symmetry; they are not tested individually. An angle beside a distance of 1.5·10¹¹ m is above it, at 10⁻¹¹.
const ROUNDINGS: f64 = 1e-12;

/// The largest number of iterations for small components after the large ones have converged.
const MAX_MORE: u32 = 6;

/// Components above this part of the largest of their kind are large: their corrections determine the level of rounding
/// errors.
const LARGE: f64 = 0.1;

/// If the correction of a small component exceeds those of the large ones by this factor, it is not due to their
/// rounding errors.
const AMPLIFIED: f64 = 16.0;

/// The size of a correction relative to the iterate.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Size {
    /// The largest of: coordinates relative to the largest coordinate, momenta relative to the largest momentum,
    /// globals relative to their scales.
    whole: f64,
    /// The largest correction of a single component relative to its own size.
    own: f64,
    /// The same over those components whose corrections exceed the rounding errors of the large ones.
    unsolved: f64,
}

impl Size {
    const UNKNOWN: Self = Self {
        whole: f64::INFINITY,
        own: f64::INFINITY,
        unsolved: f64::INFINITY,
    };

    /// The size relative to the whole iterate.
    pub(crate) fn whole(self) -> f64 {
        self.whole
    }

    /// The same including the relative correction of another quantity. NaN is kept.
    pub(crate) fn and(self, other: f64) -> Self {
        Self {
            whole: larger(self.whole, other),
            ..self
        }
    }
}

/// The history of the corrections.
///
/// A step is repeated with half its length if the next correction would be more than twice as large, or if the step
/// leaves the domain of the model. Once the corrections are small relative to the whole iterate, iterations continue
/// for components that are much smaller than the largest, as long as these improve.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Convergence {
    control: Control,
    size: Size,
    last: Size,
    fraction: f64,
    iterations: u32,
    /// The number of iterations since the correction has been small relative to the whole iterate.
    more: u32,
}

impl Convergence {
    /// Begins with the first correction.
    pub(crate) fn new(control: Control, size: Size) -> Self {
        Self {
            control,
            size,
            last: Size::UNKNOWN,
            fraction: 1.0,
            iterations: 0,
            more: 0,
        }
    }

    /// Whether the iteration has converged.
    pub(crate) fn is_done(&self) -> bool {
        self.has_arrived() && !self.is_unsettled()
    }

    /// Whether the correction is small relative to the whole iterate, or is rounding error; the latter is not concluded
    /// while a small component is still undetermined.
    fn has_arrived(&self) -> bool {
        let (size, last) = (self.size.whole, self.last.whole);
        let stagnates = last < ROUND_OFF && size >= 0.25 * last;
        size <= self.control.tolerance || (stagnates && self.size.unsolved < SETTLED)
    }

    /// Whether a small component still improves and iterations are left for it.
    fn is_unsettled(&self) -> bool {
        let (size, last) = (self.size.own, self.last.own);
        let stagnates = size < SETTLED && size >= 0.25 * last;
        let is_known = size <= SQUARED.max(self.control.tolerance) || stagnates;
        let may_follow = self.more < MAX_MORE && self.iterations < self.control.max_iterations;
        !is_known && may_follow
    }

    /// Checks that another iteration is permitted.
    pub(crate) fn go_on(&self) -> Result<(), AssemblyError> {
        if self.size.whole.is_finite() && self.iterations < self.control.max_iterations {
            return Ok(());
        }
        Err(self.stalled())
    }

    /// The fraction of the correction to apply.
    pub(crate) fn fraction(&self) -> f64 {
        self.fraction
    }

    /// Decides whether to accept a step from the correction that follows it.
    pub(crate) fn accepts(&mut self, is_defined: bool, next: Size) -> bool {
        self.iterations += 1;
        let is_smaller = next.whole <= 2.0 * self.size.whole || next.whole < ROUND_OFF;
        let accepted = is_defined && is_smaller;
        if accepted {
            self.more += u32::from(self.has_arrived());
            (self.last, self.size) = (self.size, next);
            self.fraction = (2.0 * self.fraction).min(1.0);
        }
        accepted
    }

    /// Halves a step that was not accepted, down to [`SHORTEST`].
    pub(crate) fn halve(&mut self) -> Result<(), AssemblyError> {
        self.fraction *= 0.5;
        if self.fraction < SHORTEST {
            // The failed trial does not count.
            self.iterations -= 1;
            return Err(self.stalled());
        }
        self.iterations += 1;
        Ok(())
    }

    fn stalled(&self) -> AssemblyError {
        AssemblyError::Stalled {
            // A step that is refused counts twice, and may exceed the limit.
            iterations: self.iterations.min(self.control.max_iterations),
            correction: self.size.whole,
            tolerance: self.control.tolerance,
        }
    }
}

/// The largest magnitudes of several values and of their corrections.
#[derive(Clone, Copy, Default)]
struct Largest {
    value: f64,
    correction: f64,
    /// Zero, or NaN if a correction is not finite.
    sum: f64,
}

impl Largest {
    fn take(&mut self, value: f64, correction: f64) {
        self.value = self.value.max(value.abs());
        self.correction = self.correction.max(correction.abs());
        self.sum += 0.0 * correction;
    }

    /// The largest of all components.
    fn of(components: &[Self]) -> Self {
        let with = |all: Self, one: &Self| Self {
            value: all.value.max(one.value),
            correction: all.correction.max(one.correction),
            sum: all.sum + one.sum,
        };
        components.iter().fold(Self::default(), with)
    }

    /// The correction relative to the larger one of value and scale; at most one.
    fn beside(&self, scale: f64) -> f64 {
        if self.correction == 0.0 {
            0.0
        } else {
            self.correction / self.value.max(scale).max(self.correction)
        }
    }
}

/// The size of a correction relative to the whole iterate. Nodes are (p, q, correction); globals are relative
/// corrections.
pub(crate) fn size<'a>(
    nodes: impl Iterator<Item = (&'a [f64], &'a [f64], &'a [f64])>,
    matrices: &[f64],
    globals: impl Iterator<Item = f64>,
) -> f64 {
    sizes(nodes, matrices, globals).whole
}

/// The same with the largest relative corrections of single components.
///
/// Near an equilibrium an orbit may have no momenta to compare with. The matrices of the elements give the scale then:
/// momenta are compared with max |∂p₁/∂q₀| max |q|, and coordinates correspondingly. A single component is compared
/// with itself and with the contributions max |∂y₁/∂z₀| max |z| of the others over an element.
pub(crate) fn sizes<'a>(
    nodes: impl Iterator<Item = (&'a [f64], &'a [f64], &'a [f64])>,
    matrices: &[f64],
    globals: impl Iterator<Item = f64>,
) -> Size {
    let mut components: Vec<Largest> = Vec::new();
    for (p, q, correction) in nodes {
        components.resize(correction.len(), Largest::default());
        let pairs = p.iter().chain(q).zip(correction);
        for (component, (value, correction)) in components.iter_mut().zip(pairs) {
            component.take(*value, *correction);
        }
    }
    let width = components.len();
    let n = width / 2;
    let largest = largest_entries(width, matrices);
    let block = |rows: std::ops::Range<usize>, columns: std::ops::Range<usize>| {
        let entries = rows.flat_map(|row| &largest[row * width..][columns.clone()]);
        entries.fold(0.0_f64, |most, entry| most.max(*entry))
    };
    let (p, q) = (Largest::of(&components[..n]), Largest::of(&components[n..]));
    let (p_by_q, q_by_p) = (block(0..n, n..width), block(n..width, 0..n));
    let mut size = p.beside(p_by_q * q.value).max(q.beside(q_by_p * p.value));
    let mut sum = p.sum + q.sum;
    for correction in globals {
        size = size.max(correction.abs());
        sum += 0.0 * correction;
    }
    let [own, unsolved] = own_sizes(&components, &largest);
    Size {
        // `f64::max` ignores NaN; the sum does not.
        whole: size + sum,
        own,
        unsolved,
    }
}

/// The largest magnitudes of the entries over several square matrices.
fn largest_entries(width: usize, matrices: &[f64]) -> Vec<f64> {
    let mut largest = vec![0.0_f64; width * width];
    for matrix in matrices.chunks_exact((width * width).max(1)) {
        for (most, entry) in largest.iter_mut().zip(matrix) {
            *most = most.max(entry.abs());
        }
    }
    largest
}

/// The largest correction of a component relative to its own size: over all components above rounding error, and over
/// those whose corrections are also above it.
fn own_sizes(components: &[Largest], matrix: &[f64]) -> [f64; 2] {
    let width = components.len();
    let n = width / 2;
    let scales: Vec<f64> = (matrix.chunks_exact(width.max(1)))
        .zip(components)
        .map(|(row, component)| {
            let parts = row.iter().zip(components);
            parts.fold(component.value, |most, (entry, other)| {
                most.max(entry * other.value)
            })
        })
        .collect();
    let largest = |kind: &[f64]| kind.iter().fold(0.0_f64, |most, scale| most.max(*scale));
    let kinds = [largest(&scales[..n]), largest(&scales[n..])];
    let parts = || {
        let parts = components.iter().zip(&scales).enumerate();
        parts.map(move |(place, (component, scale))| (usize::from(place >= n), component, *scale))
    };
    let mut of_large = [0.0_f64; 2];
    for (kind, component, scale) in parts() {
        if scale >= LARGE * kinds[kind] {
            of_large[kind] = of_large[kind].max(component.correction);
        }
    }
    let (mut own, mut unsolved) = (0.0_f64, 0.0_f64);
    for (kind, component, scale) in parts() {
        if scale > ROUNDINGS * kinds[kind] {
            let size = component.beside(scale);
            own = own.max(size);
            if component.correction > AMPLIFIED * of_large[kind] {
                unsolved = unsolved.max(size);
            }
        }
    }
    [own, unsolved]
}

#[cfg(test)]
mod tests {
    use super::{AssemblyError, Control, Convergence, Size, sizes};

    /// Two coordinates with their corrections.
    fn size(q: [f64; 2], [first, second]: [f64; 2]) -> Size {
        let (p, correction) = ([0.0; 2], [0.0, 0.0, first, second]);
        let node = (&p[..], &q[..], &correction[..]);
        sizes([node].into_iter(), &[], std::iter::empty())
    }

    /// Checks the number of iterations after a first correction that is small relative to the larger coordinate.
    #[track_caller]
    fn check(q: [f64; 2], corrections: impl IntoIterator<Item = f64>, expected: usize) {
        let mut corrections = corrections.into_iter().map(|second| size(q, [0.0, second]));
        let first = corrections.next().expect("one at least");
        let mut convergence = Convergence::new(Control::default(), first);
        let mut more = 0;
        while !convergence.is_done() {
            let next = corrections.next().expect("too many iterations");
            assert!(convergence.accepts(true, next));
            more += 1;
        }
        assert_eq!(more, expected);
    }

    #[test]
    fn a_small_coordinate_is_corrected_for_as_long_as_it_becomes_better() {
        let beside = [1e11, 1.0];
        check(beside, [1e-3, 1e-6, 1e-12], 2);
        check(beside, [1e-9], 0);
        // Rounding errors, which do not decrease.
        check(beside, [1e-4, 1e-5, 1e-5], 2);
        // No improvement: the iteration ends.
        check(beside, [5e-3; 10], 6);
        // Zero by symmetry.
        check([1.0, 1e-17], [1e-17], 0);
    }

    #[test]
    fn a_small_coordinate_that_is_not_known_at_all_is_no_round_off() {
        let wild = [0.9, 0.8, 0.7, 0.9, 0.8, 0.7, 0.9, 0.8, 0.7];
        let solved = [5e-3, 1e-4, 1e-9];
        check([1e11, 1.0], wild.into_iter().chain(solved), 11);
    }

    /// The limit is what the message says, also where the last step was refused.
    #[test]
    fn no_more_iterations_are_told_than_the_limit() {
        let control = Control {
            max_iterations: 3,
            ..Control::default()
        };
        let far = size([1.0, 1.0], [0.5, 0.5]);
        let mut convergence = Convergence::new(control, far);
        for _ in 0..2 {
            assert!(convergence.accepts(true, far));
        }
        assert!(!convergence.accepts(false, far));
        convergence.halve().expect("a shorter step");
        let told = convergence.go_on().expect_err("the limit");
        assert!(
            matches!(told, AssemblyError::Stalled { iterations: 3, .. }),
            "{told}"
        );
    }
}
