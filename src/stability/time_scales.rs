//! The time scales of a linear model.

use super::eigenvalues::{EigenvalueError, backward_error, eigenvalues};
use super::sign_functions::Measure;
use crate::numbers::larger;
use nalgebra::{Complex, DMatrix};
use std::f64::consts::TAU;
use std::fmt;

/// The time scales of a linear model whose motions are sums of e^{λt}: its rates λ, its stiffness, and the step size
/// beyond which elements need Newton's method.
#[derive(Clone, Debug, PartialEq)]
pub struct TimeScales {
    rates: Vec<Complex<f64>>,
    /// The largest rate that is attributed to free coordinates and rounding.
    free: f64,
}

impl TimeScales {
    /// Rates below this fraction of the largest may belong to free coordinates: rounding splits their double zeros by
    /// √ε.
    const FREE: f64 = 1e-7;
    /// They do if the change by perturbations, times this safety factor, reaches their size: four random perturbations
    /// may miss the worst direction.
    const TRUST: f64 = 4.0;
    /// The ratio of rates from which on a model is called stiff.
    const STIFF: f64 = 100.0;

    /// The time scales of ẏ = S y.
    pub(super) fn of(generator: &DMatrix<f64>) -> Result<Self, EigenvalueError> {
        let rates = eigenvalues(generator)?;
        let sizes = ascending(&rates);
        let fastest = sizes.last().copied().unwrap_or(0.0);
        let scale = backward_error(generator);
        let is_rounding = |k: &usize| {
            let one = |s: &DMatrix<f64>| Some(ascending(&eigenvalues(s).ok()?)[*k]);
            sizes[*k] <= Self::TRUST * Measure::noise(generator, &scale, one)
        };
        let small = sizes.partition_point(|size| *size <= Self::FREE * fastest);
        let free = (0..small).rev().find(is_rounding);
        let free = free.map_or(0.0, |k| sizes[k]);
        Ok(Self { rates, free })
    }

    /// All rates λ (eigenvalues of the equations of motion), complex, inverse times.
    pub fn rates(&self) -> &[Complex<f64>] {
        &self.rates
    }

    /// The largest |λ|, in radians per unit of time; zero if all are zero.
    pub fn fastest(&self) -> f64 {
        self.rates.iter().map(|rate| rate.norm()).fold(0.0, larger)
    }

    /// The smallest nonzero |λ|, in radians per unit of time; zero if all are zero. Rounding gives free coordinates
    /// rates of about 10⁻⁸ of the largest: rates below 10⁻⁷ of the largest therefore count as zero, unless
    /// perturbations of the size of rounding errors leave them unchanged.
    pub fn slowest(&self) -> f64 {
        let sizes = self.rates.iter().map(|rate| rate.norm());
        let moving = sizes.filter(|size| *size > self.free);
        moving.reduce(f64::min).unwrap_or(0.0)
    }

    /// The stiffness ratio fastest/slowest; one if all rates are zero.
    pub fn stiffness(&self) -> f64 {
        if self.slowest() == 0.0 {
            1.0
        } else {
            self.fastest() / self.slowest()
        }
    }

    /// The step size 2/|λ| of the fastest rate from which on Newton's method is needed: the fixed-point iteration of
    /// an element of two nodes diverges there, and that of elements with more nodes contracts slowly at best.
    pub fn newton_from(&self) -> f64 {
        2.0 / self.fastest()
    }
}

/// The moduli in ascending order.
fn ascending(rates: &[Complex<f64>]) -> Vec<f64> {
    let mut sizes: Vec<f64> = rates.iter().map(|rate| rate.norm()).collect();
    sizes.sort_by(f64::total_cmp);
    sizes
}

/// Describes the consequences for step sizes in one sentence.
impl fmt::Display for TimeScales {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (fastest, slowest) = (self.fastest(), self.slowest());
        if fastest == 0.0 {
            return f.write_str("nothing swings, grows or decays");
        }
        write!(
            f,
            "times from {:.3e} to {:.3e} (2π/|λ|), ratio {:.3e}: ",
            TAU / fastest,
            TAU / slowest,
            self.stiffness()
        )?;
        if self.stiffness() > Self::STIFF {
            write!(
                f,
                "stiff; steps beyond {:.3e} need Newton's method, and serve where the fast motion need not be seen",
                self.newton_from()
            )
        } else {
            write!(
                f,
                "not stiff; steps up to {:.3e} contract",
                self.newton_from()
            )
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::stability::linear_model::LinearModel;
    use tfe_runtime::Second;

    #[test]
    fn free_coordinates_have_no_time_scale() {
        let mut model = LinearModel::<2> {
            second: Second::ZERO,
        };
        model.second.zz = [[1.0, 0.0], [0.0, 1.0]];
        let scales = model.time_scales().expect("eigenvalues");
        assert_eq!((scales.fastest(), scales.stiffness()), (0.0, 1.0));
        assert_eq!(scales.to_string(), "nothing swings, grows or decays");
        model.second.qq = [[0.0, 0.0], [0.0, 4.0]];
        let scales = model.time_scales().expect("eigenvalues");
        // A frequency of two, and a free coordinate.
        assert!((scales.fastest() - 2.0).abs() < 1e-14 && (scales.slowest() - 2.0).abs() < 1e-14);
        assert!((scales.newton_from() - 1.0).abs() < 1e-14);
        model.second.qq = [[1e-6, 0.0], [0.0, 4.0]];
        let scales = model.time_scales().expect("eigenvalues");
        assert!((scales.stiffness() / 2e3 - 1.0).abs() < 1e-9);
        assert!(scales.to_string().contains("ratio 2.000e3: stiff"));
    }

    #[test]
    fn free_coordinates_of_light_bodies_have_no_time_scale() {
        let mut model = LinearModel::<2> {
            second: Second::ZERO,
        };
        // An electron in a trap, held along one axis.
        let mass = 9.1e-31;
        model.second.zz = [[1.0 / mass, 0.0], [0.0, 1.0 / mass]];
        model.second.qq = [[4.0 * mass, 0.0], [0.0, 0.0]];
        let scales = model.time_scales().expect("eigenvalues");
        // The error is the rounding error of the balanced matrix, whose entries are about 2.
        assert!((scales.fastest() - 2.0).abs() < 1e-12, "{scales}");
        assert!((scales.slowest() - 2.0).abs() < 1e-12, "{scales}");
    }

    #[test]
    fn rates_far_apart_are_stiff() {
        let mut model = LinearModel::<2> {
            second: Second::ZERO,
        };
        model.second.zz = [[1.0, 0.0], [0.0, 1.0]];
        for fastest in [1e7, 1e10, 1e12] {
            model.second.qq = [[9.0, 0.0], [0.0, fastest * fastest]];
            let scales = model.time_scales().expect("eigenvalues");
            assert!((scales.slowest() / 3.0 - 1.0).abs() < 1e-6, "{scales}");
            let ratio = scales.stiffness() * 3.0 / fastest;
            assert!((ratio - 1.0).abs() < 1e-6, "{scales}");
        }
    }

    #[test]
    fn slow_motions_are_told_from_free_ones() {
        let mut model = LinearModel::<3> {
            second: Second::ZERO,
        };
        for (a, square) in [0.0, 9.0, 1e20].into_iter().enumerate() {
            (model.second.zz[a][a], model.second.qq[a][a]) = (1.0, square);
        }
        let scales = model.time_scales().expect("eigenvalues");
        assert!((scales.slowest() / 3.0 - 1.0).abs() < 1e-6, "{scales}");
        assert!((scales.fastest() / 1e10 - 1.0).abs() < 1e-6, "{scales}");
    }
}
