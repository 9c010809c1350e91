//! Warnings of a run about itself.

use crate::numbers::Short;
use std::fmt;
use tfe_runtime::Element;

/// A sign that a motion may be wrong although it was computed without an error.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Warning {
    /// The step size lies in an unstable interval of the element for the linearised model: the numerical solution
    /// grows where the exact one does not.
    ///
    /// The model is linearised at a state of the motion (its second derivatives are held constant). The transition
    /// matrix of the element for this linear model has an eigenvalue of modulus `radius`, whereas the linear model
    /// itself multiplies the mode by `exact` in the same time. A nonlinear motion leaves such a neighbourhood sooner
    /// or later, and then its amplitude or its energy is wrong.
    ///
    /// Checked at the start, in elements 1, 2, 4, 8, … and where a run fails, so that the cost in a long run is small;
    /// several findings in a row make one warning. Not checked for elements that are stable at every step size
    /// ([`Element::is_a_stable`]), for models with constraints, and for models of run-time length.
    UnstableStep {
        /// The time at the start of the first such element.
        time: f64,
        /// The length of the element whose mode grows most; negative in a run backwards.
        step: f64,
        /// The element.
        element: Element,
        /// The factor by which a step with that element multiplies the amplitude of the mode: the modulus of an
        /// eigenvalue of its transition matrix, the largest one unless the model itself has modes that grow.
        radius: f64,
        /// The factor |e^{λh}| by which the linear model multiplies it in the same time, with λ its eigenvalue.
        exact: f64,
    },
    /// The mass matrix ∂²L/∂v² at the start has eigenvalues of both signs, so that some forces accelerate against
    /// their direction; usually because of a wrong sign in the kinetic energy.
    ///
    /// Checked at the start of a run, for Lagrangians without constraints, with each coordinate scaled such that its
    /// own mass is one. For models of run-time length with more than 64 coordinates that are coupled by their masses,
    /// only single coordinates and coupled pairs are checked.
    MassIndefinite {
        /// The time at the start of the run.
        time: f64,
        /// The smallest eigenvalue of the mass matrix M, negative. If rounding hides it, or only coordinates and pairs
        /// were checked, a value below zero that v·M v / v·v takes for some velocities v.
        least: f64,
        /// The largest eigenvalue, positive; in the same cases a value above zero that v·M v / v·v takes.
        largest: f64,
    },
    /// The energy at a node is not finite: no velocity belongs to the momentum there (the mass matrix is singular), or
    /// the model has a singular point.
    EnergyNotFinite {
        /// The time of the first such node.
        time: f64,
    },
    /// The model conserves the energy, but between two nodes it changes by more than a tenth of the largest kinetic
    /// energy so far, or, over a time in which the kinetic energy was above its mean so far, by more than a tenth of
    /// this mean, or of the kinetic energy after that time: the step is too long for the motion, as in a close encounter,
    /// or the motion has passed a singular point.
    ///
    /// Checked at every recorded node, except across impulses, and unless the model is linear, forced, damped, depends
    /// on time or has constraints.
    EnergyJump {
        /// The time of the node after the largest jump.
        time: f64,
        /// The energy at the node before that jump.
        before: f64,
        /// The energy at the node after it.
        after: f64,
        /// The number of such jumps.
        count: usize,
    },
    /// Forces or constraints of the model have kinks or jumps, and steps do not [end](crate::Simulation::at_kinks) there. Elements
    /// that cross one lose their order of accuracy, and so do both runs that an error estimate compares. Derivatives across
    /// a jump are wrong: the change of the time at which the motion crosses it is missing.
    ///
    /// Given by runs with an error estimate or with derivatives only.
    KinksCrossed,
    /// The step is too long to resolve the motion: an element was solved again as three elements of a third of its
    /// length (nine of a ninth if the element had been cut), and the two results differ, at its end or, continued, at
    /// the end of the next element (`docs/theory.md`, (T-121)).
    ///
    /// Checked in elements whose iteration did not contract quickly or that made none, as linear models do with constant
    /// coefficients: the 0th, 1st, 2nd, 4th, 8th, … of these. Not with [`Solve::Trusting`](crate::Solve::Trusting).
    Unresolved {
        /// The time at the start of the first such element.
        time: f64,
        /// The length of that element; negative in a run backwards.
        step: f64,
        /// The largest difference between the two results, relative to the extent of the motion (largest minus smallest
        /// value of coordinates and of momenta); infinite if shorter elements fail.
        distance: f64,
        /// The number of such elements that were found.
        count: usize,
    },
    /// The function of an [event](crate::Simulation::on) is not a number (NaN), as the square root or the logarithm of
    /// a negative number: it has no sign there, so that the event cannot happen.
    ///
    /// Checked in every element that no event cuts. A single point without a number, and one at which the function is
    /// infinite, are no reason for a warning.
    EventUndefined {
        /// The event.
        event: String,
        /// The first time at which the function was found not to be a number.
        time: f64,
    },
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::UnstableStep {
                time,
                step,
                element,
                radius,
                exact,
            } => write!(
                f,
                "from t = {} on, the step {} lies in an unstable interval of `{element}` for the linearised model: \
                 a step multiplies a mode by {} that the model multiplies by {}; take a shorter step, \
                 or an element that is stable at every step, `{}` or `{}`",
                Short(*time),
                Short(*step),
                factor(*radius),
                factor(*exact),
                Element::mixed(element.nodes()),
                element.reduced(),
            ),
            Self::MassIndefinite {
                time,
                least,
                largest,
            } => write!(
                f,
                "the mass matrix at t = {} has eigenvalues of both signs, {least:.3e} and {largest:.3e}: look for a wrong sign in the kinetic energy",
                Short(*time)
            ),
            Self::EnergyNotFinite { time } => write!(
                f,
                "the energy at t = {} is not finite: the mass matrix is singular there, or the model has a singular point",
                Short(*time)
            ),
            Self::EnergyJump {
                time,
                before,
                after,
                count,
            } => {
                write!(
                    f,
                    "the energy, which the model conserves, jumps from {before:.6e} to {after:.6e} at t = {}",
                    Short(*time)
                )?;
                match count {
                    0 | 1 => {}
                    2 => f.write_str(" and once more")?,
                    _ => write!(f, " and at {} other nodes", count - 1)?,
                }
                f.write_str(": take a shorter step, or look for a singular point of the model")
            }
            Self::KinksCrossed => f.write_str(
                "forces or constraints of the model have kinks or jumps inside steps: elements lose their order of accuracy there, and errors fall more slowly with the step size than for smooth forces; derivatives across a jump are wrong; `at_kinks(true)` ends steps there",
            ),
            Self::Unresolved {
                time,
                step,
                distance,
                ..
            } => {
                let (step, time) = (Short(*step), Short(*time));
                write!(
                    f,
                    "the step {step} at t = {time} does not resolve the motion: "
                )?;
                if distance.is_infinite() {
                    f.write_str("shorter steps fail there")?;
                } else {
                    let part = part(*distance);
                    write!(
                        f,
                        "shorter steps end elsewhere by {part} of the extent of the motion"
                    )?;
                }
                f.write_str("; take a shorter step or an element with more nodes")
            }
            Self::EventUndefined { event, time } => write!(
                f,
                "the function of the event `{event}` is not a number (NaN) at t = {}, so that the event cannot happen there: look for a root or a logarithm of a negative number, or for a parameter that is not a number",
                Short(*time)
            ),
        }
    }
}

/// The factor of an amplitude, with enough digits to distinguish it from one, or in scientific notation if it is very
/// small or large.
fn factor(value: f64) -> String {
    let from_one = (value - 1.0).abs();
    if (1e-12..1e-4).contains(&from_one) {
        format!("{value:.9}")
    } else if value == 0.0 || (1e-3..1e6).contains(&value) {
        format!("{value:.6}")
    } else {
        format!("{value:.3e}")
    }
}

/// A ratio, of any size.
fn part(value: f64) -> String {
    if value < 1e3 {
        format!("{value:.2}")
    } else {
        format!("{value:.1e}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_told_as_short_as_they_can_be_told_apart() {
        let unstable = |time, radius, exact| {
            let warning = Warning::UnstableStep {
                time,
                step: 0.5,
                element: Element::primal(3),
                radius,
                exact,
            };
            warning.to_string()
        };
        let usual = unstable(2.5, 1.25, 1.0);
        assert!(usual.starts_with("from t = 2.5 on, the step 0.5 lies"));
        let factors = "multiplies a mode by 1.250000 that the model multiplies by 1.000000;";
        assert!(usual.contains(factors), "{usual}");
        let slow = unstable(0.0, 1.0 + 2e-7, 1.0);
        let factors = "multiplies a mode by 1.000000200 that the model multiplies by 1.000000;";
        assert!(slow.contains(factors), "{slow}");
        let fast = unstable(1e300, 1e30, 1e-30);
        assert!(fast.starts_with("from t = 1e300 on"), "{fast}");
        let factors = "multiplies a mode by 1.000e30 that the model multiplies by 1.000e-30;";
        assert!(fast.contains(factors), "{fast}");
        let unresolved = |distance| {
            let warning = Warning::Unresolved {
                time: 1e-9,
                step: 0.1,
                distance,
                count: 1,
            };
            warning.to_string()
        };
        assert!(unresolved(0.051).contains("at t = 1e-9 does not"));
        assert!(unresolved(0.051).contains("elsewhere by 0.05 of"));
        assert!(unresolved(1e40).contains("elsewhere by 1.0e40 of"));
        assert!(unresolved(f64::INFINITY).contains("shorter steps fail there; take"));
    }
}
