//! Detects numerical instability of an element for a linear model: the unstable step sizes, as seen from a run.

use super::eigenvalues::{backward_error, balanced, eigenvalues_of_finite};
use super::linear_model::LinearModel;
use super::sign_functions::Measure;
use nalgebra::DMatrix;
use tfe_runtime::Element;

/// A mode that grows by the element although it does not grow in the linear model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Growth {
    /// The modulus of its eigenvalue in the transition matrix of the element.
    pub(crate) radius: f64,
    /// The modulus |e^{λh}| of its eigenvalue in the exact flow of the linear model.
    pub(crate) exact: f64,
}
impl<const N: usize> LinearModel<N> {
    /// The mode that one step of `element` amplifies most beyond its exact growth; `None` if there is no such mode or
    /// no transition matrix.
    ///
    /// The moduli of both spectra are compared in the order of size, so that a slow unstable mode of the model does not
    /// hide a fast mode that grows numerically. With μ the eigenvalues of the element, mode k counts if
    ///
    /// ```text
    /// ln |μ_k| > 1.5 max(0, Re λ_k h) + 10⁻⁷ .
    /// ```
    ///
    /// The factor allows for the discretisation error of growing modes. The summand allows for double eigenvalues in a
    /// Jordan block, as every free coordinate has: they are known to √ε = 1.5·10⁻⁸ in units of the matrix. Larger or
    /// worse conditioned blocks are detected by small perturbations of the matrix; the excess must also exceed their
    /// effect.
    ///
    /// A step that resolves all modes, ‖S‖ h < 1, is not examined: an oscillator is stable at least up to λh = 2 (two
    /// Lobatto points). Usual runs therefore compute neither eigenvalues nor a transition matrix here.
    pub(crate) fn growth(&self, element: Element, h: f64) -> Option<Growth> {
        const RATE: f64 = 1.5;
        const DEFECTIVE: f64 = 1e-7;
        /// A safety factor: four random perturbations may miss the worst direction.
        const TRUST: f64 = 4.0;
        let generator = self.generator() * h;
        if !(1.0..f64::INFINITY).contains(&row_sum_norm(&balanced(&generator).0)) {
            return None;
        }
        let matrix = self.transition(element, h)?;
        let logarithms = logarithms(&matrix)?;
        if !(logarithms.first()? > &DEFECTIVE) {
            return None;
        }
        let values = eigenvalues_of_finite(&generator)?;
        let rates = descending(values.iter().map(|value| value.re).collect());
        let excess = |k: usize| logarithms[k] - RATE * rates[k].max(0.0) - DEFECTIVE;
        let worst = (0..2 * N).max_by(|&i, &j| excess(i).total_cmp(&excess(j)))?;
        if !(excess(worst) > 0.0) {
            return None;
        }
        let noise = Measure::noise(&matrix, &backward_error(&matrix), |a| {
            Some(self::logarithms(a)?[worst])
        });
        (excess(worst) > TRUST * noise).then(|| Growth {
            radius: logarithms[worst].exp(),
            exact: rates[worst].exp(),
        })
    }
}

/// The logarithms of the moduli of all eigenvalues, in descending order.
fn logarithms(matrix: &DMatrix<f64>) -> Option<Vec<f64>> {
    let values = eigenvalues_of_finite(matrix)?;
    Some(descending(
        values.iter().map(|value| value.norm().ln()).collect(),
    ))
}

/// max_i Σ_j |a_ij|, a bound of every |λ|.
fn row_sum_norm(a: &DMatrix<f64>) -> f64 {
    a.row_iter().fold(0.0, |most: f64, row| {
        most.max(row.iter().map(|entry| entry.abs()).sum())
    })
}

fn descending(mut values: Vec<f64>) -> Vec<f64> {
    values.sort_by(|a, b| b.total_cmp(a));
    values
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stability::{spectral_radius, transition_matrix};
    use tfe_runtime::Rule;
    use tfe_runtime::{Second, State};

    /// H = ½ p² + ½ ω² q² with the force −2ξω p.
    fn oscillator(omega: f64, xi: f64) -> LinearModel<1> {
        LinearModel {
            second: Second {
                zz: [[1.0]],
                zq: [[0.0]],
                qq: [[omega * omega]],
                force_z: [[-2.0 * xi * omega]],
                force_q: [[0.0]],
            },
        }
    }

    /// H = ½ p² − ½ q².
    fn saddle() -> LinearModel<1> {
        let mut frozen = oscillator(1.0, 0.0);
        frozen.second.qq = [[-1.0]];
        frozen
    }

    fn every_rule(nodes: usize) -> Vec<Element> {
        let mut all = vec![
            Element::primal(nodes),
            Element::primal(nodes).reduced(),
            Element::primal(nodes).lobatto(),
            Element::mixed(nodes),
            Element::energy_conserving(nodes),
            Element::radau(nodes),
            Element::radau(nodes).with_rule(Rule::Lobatto(nodes.max(3) - 1)),
        ];
        for points in nodes - 1..nodes + 3 {
            for element in [
                Element::mixed(nodes),
                Element::energy_conserving(nodes),
                Element::radau(nodes),
            ] {
                all.push(element.quadrature(points));
                all.push(element.with_rule(Rule::Lobatto(points + 1)));
            }
        }
        all
    }

    #[test]
    fn a_stable_elements_are() {
        let rest = State { q: [0.0], p: [0.0] };
        for element in (2..=6).flat_map(every_rule) {
            let mut largest = 0.0_f64;
            for xi in [0.0, 0.01, 1.0] {
                // The grid is coarser than the unstable intervals of six nodes, but one hit is enough.
                for rho in (1..80).map(|k| 0.5 * f64::from(k)) {
                    // Backward in time, a negative damping decays.
                    for (xi, h) in [(xi, rho), (-xi, -rho)] {
                        let a = transition_matrix(&oscillator(1.0, xi), element, &rest, 0.0, h)
                            .expect("a linear step");
                        largest = largest.max(spectral_radius(&a));
                    }
                }
            }
            // Without damping the spectral radius is one; the entries are of the size of ρ, times a few ulps.
            assert_eq!(
                largest <= 1.0 + 1e-11,
                element.is_a_stable(),
                "{element}: {largest}"
            );
        }
    }
    #[test]
    fn growth_is_seen_in_the_bubbles_and_only_there() {
        let at = |rho: f64| oscillator(1.0, 0.0).growth(Element::primal(3), rho);
        for rho in [1e-6, 0.1, 1.0, 3.16, 3.465, 7.74] {
            assert_eq!(at(rho), None, "ρ = {rho}");
        }
        // In both directions of time: √10 < ρ < √12, and beyond √60.
        for rho in [3.163, 3.3112897574651194, 3.464, 7.75, -3.3, -8.0] {
            let growth = at(rho).unwrap_or_else(|| panic!("ρ = {rho}"));
            assert!(growth.radius > 1.0 + 1e-3, "ρ = {rho}: {growth:?}");
            assert_eq!(growth.exact, 1.0);
        }
        // From stability_bubbles.json. The radius behaves like a square root at the ends of an interval, but is flat at
        // its maximum.
        let worst = at(3.3112897574651194).expect("the worst of the bubble");
        assert!((worst.radius - 1.129817690854696).abs() < 1e-12);
    }

    #[test]
    fn the_growth_of_the_model_is_not_the_methods() {
        for nodes in 2..=5 {
            for element in [Element::primal(nodes), Element::primal(nodes).lobatto()] {
                for h in [1e-4, 1e-2, 0.1, 1.0, -0.1, -1.0] {
                    assert_eq!(saddle().growth(element, h), None, "{element}, h = {h}");
                }
            }
        }
        // T-54 with ρ² → −h²: the matrix of two nodes has a pole at h = √6, and is not close to e^h near it.
        assert!(saddle().growth(Element::primal(2), 2.4).is_some());
    }

    #[test]
    fn an_unstable_model_does_not_hide_a_bubble() {
        // A saddle that grows by e^{0.33}, and an oscillator in an unstable interval where the radius is 1.13 <
        // e^{0.33}.
        let mut both = LinearModel::<2> {
            second: Second::ZERO,
        };
        both.second.zz = [[1.0, 0.0], [0.0, 1.0]];
        both.second.qq = [[-0.01, 0.0], [0.0, 1.0]];
        let growth = both
            .growth(Element::primal(3), 3.3)
            .expect("the oscillator is in its bubble");
        assert!(growth.radius > 1.12 && growth.radius < 1.13, "{growth:?}");
        both.second.qq[1][1] = 0.9;
        assert_eq!(both.growth(Element::primal(3), 3.3), None);
    }

    #[test]
    fn a_light_free_body_hides_no_bubble() {
        let mut both = LinearModel::<2> {
            second: Second::ZERO,
        };
        both.second.qq = [[0.0, 0.0], [0.0, 1.0]];
        for mass in [1.0, 1e-12, 1e-30] {
            both.second.zz = [[1.0 / mass, 0.0], [0.0, 1.0]];
            let growth = both
                .growth(Element::primal(3), 3.3)
                .unwrap_or_else(|| panic!("the oscillator is in its bubble, mass {mass}"));
            assert!(growth.radius > 1.12 && growth.radius < 1.13, "{growth:?}");
        }
    }

    #[test]
    fn free_coordinates_are_no_growth() {
        // Four eigenvalues in one Jordan block, H = ½ p₁² + q₁ p₂: rounding errors split them by ε^{1/4}.
        let mut chain = LinearModel::<2> {
            second: Second::ZERO,
        };
        chain.second.zz = [[1.0, 0.0], [0.0, 1e-3]];
        chain.second.zq = [[0.0, 0.0], [1.0, 0.0]];
        for nodes in 2..=6 {
            for h in [1e-3, 0.1, 10.0] {
                assert_eq!(
                    chain.growth(Element::primal(nodes), h),
                    None,
                    "{nodes}, {h}"
                );
            }
        }
    }
}
