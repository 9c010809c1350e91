//! Modes from the eigenvalues of a transition matrix: growth rates, frequencies, damping ratios.

use super::eigenvalues::{EigenvalueError, eigenvalues};
use crate::numbers::Short;
use nalgebra::{Complex, DMatrix};
use std::error::Error;
use std::f64::consts::TAU;
use std::fmt;

/// Why the modes of a transition matrix could not be computed.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum ModeError {
    /// The eigenvalues of the matrix could not be computed.
    Eigenvalues(EigenvalueError),
    /// The step is zero, infinite or not a number.
    Step {
        /// The step given.
        step: f64,
    },
}

impl From<EigenvalueError> for ModeError {
    fn from(error: EigenvalueError) -> Self {
        Self::Eigenvalues(error)
    }
}

impl fmt::Display for ModeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Eigenvalues(error) => error.fmt(f),
            Self::Step { step } => {
                write!(
                    f,
                    "the step is {step}, but it must be finite and not zero",
                    step = Short(*step)
                )
            }
        }
    }
}

impl Error for ModeError {
    fn source(&self) -> Option<&(dyn Error + 'static)> {
        match self {
            Self::Eigenvalues(error) => Some(error),
            Self::Step { .. } => None,
        }
    }
}

/// The number of eigenvalues that make a mode.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ModeKind {
    /// One real eigenvalue.
    Real,
    /// Two conjugate complex eigenvalues.
    Pair,
}

/// A mode of a transition matrix over the time h: a real eigenvalue λ or a conjugate pair, with its growth rate,
/// frequency and damping ratio.
///
/// With λ = e^{(σ + iω) h}, a motion in this mode alone is multiplied by e^{σt} in the time t, and its phase turns by
/// ωt.
///
/// # The frequency is ambiguous
/// A matrix tells where a motion is after the time h, not how many turns it has made: ω and ω + 2πk/h, for any integer
/// k, have the same λ. [`Mode::frequency`] is the principal value, at most π/h, and is the true one if the step is
/// shorter than half a period of the mode. For a monodromy matrix, where h is a whole period of the coefficients, this
/// is rarely so: see [`Mode::frequencies`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mode {
    multiplier: Complex<f64>,
    step: f64,
    kind: ModeKind,
}

/// The largest number of frequencies that are made for one mode.
const MOST_FREQUENCIES: usize = 10_000_000;

impl Mode {
    /// The eigenvalue λ; of a pair, the one with positive imaginary part.
    pub fn multiplier(&self) -> Complex<f64> {
        self.multiplier
    }

    /// Whether the mode is a real eigenvalue or a conjugate pair.
    pub fn kind(&self) -> ModeKind {
        self.kind
    }

    /// The modulus |λ|, by which a step multiplies the amplitude.
    pub fn modulus(&self) -> f64 {
        self.multiplier.norm()
    }

    /// The growth rate σ = ln |λ| / h, an inverse time, negative if the mode decays; −∞ for λ = 0 (+∞ if the step goes
    /// back in time).
    pub fn growth_rate(&self) -> f64 {
        self.modulus().ln() / self.step
    }

    /// The principal frequency ω = |arg λ| / |h|, in radians per unit of time, from 0 to π/|h|. Zero for positive λ,
    /// π/|h| for negative λ.
    pub fn frequency(&self) -> f64 {
        self.multiplier.arg().abs() / self.step.abs()
    }

    /// The `count` lowest of the frequencies |ω + 2πk/h|, k = 0, −1, 1, −2, …, that have this multiplier; ascending,
    /// each once. No more than ten million are made.
    pub fn frequencies(&self, count: usize) -> Vec<f64> {
        let angle = self.multiplier.arg().abs();
        let step = self.step.abs();
        let is_double = angle == 0.0 || self.multiplier.re < 0.0 && self.multiplier.im == 0.0;
        let nth = |n: usize| {
            let angle = match (is_double, n % 2) {
                // ω and −ω have the same aliases.
                (true, _) => angle + TAU * n as f64,
                (false, 0) => angle + TAU * (n / 2) as f64,
                (false, _) => TAU * n.div_ceil(2) as f64 - angle,
            };
            angle / step
        };
        (0..count.min(MOST_FREQUENCIES)).map(nth).collect()
    }

    /// The damping ratio ζ = −σ/√(σ² + ω²), with the principal frequency: 1 for a mode that decays without
    /// oscillation, 0 for one that keeps its amplitude, negative for one that grows. `None` for λ = 1, which neither
    /// decays nor oscillates, such as a rigid-body motion.
    pub fn damping_ratio(&self) -> Option<f64> {
        let (sigma, omega) = (self.growth_rate(), self.frequency());
        if sigma.is_infinite() {
            return Some(-sigma.signum());
        }
        let size = sigma.hypot(omega);
        (size > 0.0).then(|| -sigma / size)
    }
}

/// The modes of a transition matrix over a step h (or of a monodromy matrix over a period h), in the order of
/// ascending frequency, then modulus; each conjugate pair is one mode.
///
/// # Errors
/// [`ModeError::Step`] for a step that is zero or not finite; otherwise those of [`eigenvalues()`].
/// # Reference
/// theory.md (T-30) for the matrix of a step, (T-83) for a monodromy matrix and its exponents.
///
/// # Example
/// ```
/// use tfe::prelude::*;
///
/// #[dynamics(coordinates(x), lagrangian = m/2*dot(x)^2 - k/2*x^2, dissipation = c/2*dot(x)^2)]
/// struct Oscillator { m: f64, c: f64, k: f64 }
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let oscillator = Oscillator { m: 1.0, c: 0.2, k: 4.0 }; // ω₀ = 2, ζ = 0.05
/// let rest = oscillator.state([0.0], [0.0]);
/// let h = 0.5;
/// let step = stability::transition_matrix(&oscillator, Mixed::<6>, &rest, 0.0, h)?;
/// let modes = stability::modes(&step, h)?;
/// assert_eq!(modes.len(), 1); // one conjugate pair
/// assert!((modes[0].damping_ratio().unwrap() - 0.05).abs() < 1e-9);
/// assert!((modes[0].growth_rate() + 0.1).abs() < 1e-9);
/// # Ok(())
/// # }
/// ```
pub fn modes(transition_matrix: &DMatrix<f64>, h: f64) -> Result<Vec<Mode>, ModeError> {
    if !(h.is_finite() && h != 0.0) {
        return Err(ModeError::Step { step: h });
    }
    let mode = |multiplier: Complex<f64>| Mode {
        multiplier,
        step: h,
        kind: if multiplier.im == 0.0 {
            ModeKind::Real
        } else {
            ModeKind::Pair
        },
    };
    // Its conjugate with positive imaginary part is also in the list.
    let mut modes: Vec<_> = eigenvalues(transition_matrix)?
        .into_iter()
        .filter(|value| value.im >= 0.0)
        .map(mode)
        .collect();
    modes.sort_by(|a, b| {
        let by_frequency = a.frequency().total_cmp(&b.frequency());
        by_frequency.then(a.modulus().total_cmp(&b.modulus()))
    });
    Ok(modes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stability::transition_matrix;
    use crate::{Mixed, State, dynamics};
    use std::f64::consts::PI;

    #[dynamics(coordinates(x), lagrangian = dot(x)^2/2 - omega^2/2*x^2, dissipation = xi*omega*dot(x)^2)]
    struct Oscillator {
        omega: f64,
        xi: f64,
    }

    const REST: State<1> = State { q: [0.0], p: [0.0] };

    fn diagonal(entries: &[f64]) -> DMatrix<f64> {
        DMatrix::from_diagonal(&entries.to_vec().into())
    }

    #[test]
    fn damped_oscillators() {
        for (omega, xi, h) in [
            (1.0, 0.0, 0.4_f64),
            (3.0, 0.02, 0.2),
            (3.0, -0.02, 0.2),
            (2.0, 0.5, 0.5),
            (2.0, 0.95, 0.5),
        ] {
            let model = Oscillator { omega, xi };
            let matrix = transition_matrix(&model, Mixed::<6>, &REST, 0.0, h).unwrap();
            let modes = modes(&matrix, h).unwrap();
            assert_eq!(modes.len(), 1);
            let mode = modes[0];
            assert_eq!(mode.kind(), ModeKind::Pair);
            // The element with six nodes is the Padé approximant (5, 5) of e^z with the error (5!)²/(10! 11!) |z|¹¹
            // (T-53), |z| = ωh ≤ 1; divided by z, like the rates.
            let error = 14400.0 / (3_628_800.0 * 39_916_800.0) * (omega * h).powi(10);
            let tolerance = 2.0 * error + 20.0 * f64::EPSILON / (omega * h);
            let damped = omega * (1.0 - xi * xi).sqrt();
            assert!((mode.frequency() - damped).abs() <= tolerance * omega);
            assert!((mode.growth_rate() + xi * omega).abs() <= tolerance * omega);
            assert!((mode.damping_ratio().unwrap() - xi).abs() <= 2.0 * tolerance);
        }
    }

    #[test]
    fn aperiodic_modes_are_real() {
        let model = Oscillator {
            omega: 1.0,
            xi: 1.25,
        };
        let matrix = transition_matrix(&model, Mixed::<6>, &REST, 0.0, 0.5).unwrap();
        let modes = modes(&matrix, 0.5).unwrap();
        // −ξω ± ω√(ξ² − 1) = −2 and −½; the larger modulus last. |z| = 1 and the error of the Padé approximant 1e-10 of
        // e^z.
        let rates: Vec<_> = modes.iter().map(Mode::growth_rate).collect();
        assert!((rates[0] + 2.0).abs() < 1e-9 && (rates[1] + 0.5).abs() < 1e-9);
        for mode in modes {
            assert_eq!(mode.kind(), ModeKind::Real);
            assert_eq!((mode.frequency(), mode.damping_ratio()), (0.0, Some(1.0)));
        }
    }

    #[test]
    fn frequencies_that_a_step_cannot_tell_apart() {
        // ω = 8 makes more than one turn in h = 1: the principal frequency is 8 − 2π, and 8 is among its aliases.
        let rotation = |angle: f64| {
            let (sin, cos) = angle.sin_cos();
            DMatrix::from_row_slice(2, 2, &[cos, -sin, sin, cos])
        };
        let mode = modes(&rotation(8.0), 1.0).unwrap()[0];
        let expected = [8.0 - TAU, 2.0 * TAU - 8.0, 8.0, 3.0 * TAU - 8.0];
        for (found, expected) in mode.frequencies(4).iter().zip(expected) {
            // Angles from sines and cosines: a few ulps of 8.
            assert!((found - expected).abs() < 50.0 * f64::EPSILON);
        }
        assert!(mode.frequency() <= PI);
        assert!(mode.frequencies(0).is_empty());
        // There was not the memory for all of them.
        assert_eq!(mode.frequencies(usize::MAX).len(), MOST_FREQUENCIES);
        let all = modes(&diagonal(&[1.0, -1.0]), 0.5).unwrap();
        assert_eq!(all[0].frequencies(3), [0.0, 2.0 * TAU, 4.0 * TAU]);
        assert_eq!(all[1].frequencies(2), [TAU, 3.0 * TAU]);
    }

    #[test]
    fn real_multipliers() {
        let all = modes(&diagonal(&[0.0, 1.0, 2.0, -0.5]), 1.0).unwrap();
        let multipliers: Vec<_> = all.iter().map(|mode| mode.multiplier().re).collect();
        assert_eq!(multipliers, [0.0, 1.0, 2.0, -0.5]);
        assert_eq!(all[0].growth_rate(), f64::NEG_INFINITY);
        let ratios: Vec<_> = all.iter().map(Mode::damping_ratio).collect();
        assert_eq!(ratios[..3], [Some(1.0), None, Some(-1.0)]);
        let size = 2.0_f64.ln().hypot(PI);
        assert!((ratios[3].unwrap() - 2.0_f64.ln() / size).abs() < 4.0 * f64::EPSILON);
        // Backward in time, growth is decay.
        let back = modes(&diagonal(&[2.0]), -1.0).unwrap()[0];
        assert_eq!(back.growth_rate(), -(2.0_f64.ln()));
    }

    #[test]
    fn bad_input() {
        for step in [0.0, f64::NAN, f64::INFINITY] {
            let error = modes(&diagonal(&[1.0]), step).unwrap_err();
            assert!(matches!(error, ModeError::Step { .. }));
        }
        assert!(matches!(
            modes(&DMatrix::zeros(1, 2), 1.0),
            Err(ModeError::Eigenvalues(EigenvalueError::NotSquare { .. }))
        ));
        assert!(modes(&DMatrix::zeros(0, 0), 1.0).unwrap().is_empty());
    }
}
