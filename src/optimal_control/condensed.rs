//! Blocks whose interior variables are eliminated (condensed); they form the chain of the quadratic problem.

use super::block::{Block, Linear};
use nalgebra::{DMatrix, DVector, Dyn, LU};

/// A linearised block whose interior variables follow the outer ones: δs = Z δw + s₀ with Z = [−c_x⁻¹ c_w; 1] and s₀ =
/// [−c_x⁻¹ c; 0].
#[derive(Clone, Debug)]
pub(super) struct Condensed {
    pub(super) linear: Linear,
    interior: usize,
    /// The factorised transpose of c_x.
    transposed: Option<LU<f64, Dyn, Dyn>>,
    /// The matrix Z.
    follow: DMatrix<f64>,
    /// The vector s₀.
    own: DVector<f64>,
    /// The derivative of the end by w.
    pub(super) ends: DMatrix<f64>,
    /// The end for δw = 0.
    pub(super) reached: DVector<f64>,
}

/// The quadratic form δwᵀ H δw with the linear part g, after condensation.
pub(super) struct Quadratic {
    pub(super) matrix: DMatrix<f64>,
    /// The vector g, and g for steps that close no gaps.
    pub(super) gradients: DMatrix<f64>,
}

impl Condensed {
    /// `None` if the interior equations are singular or something is not finite.
    pub(super) fn new(block: &Block, linear: Linear) -> Option<Self> {
        let x = block.interior;
        let (rows, all) = linear.jacobian.shape();
        let outer = all - x;
        let parts = [&linear.of_cost, &linear.of_rows, &linear.jacobian];
        let is_finite = (parts.iter().flat_map(|part| part.iter())).all(|entry| entry.is_finite())
            && linear.values.rows.iter().all(|entry| entry.is_finite())
            && linear.gradient.iter().all(|entry| entry.is_finite())
            && linear.values.cost.is_finite();
        if !is_finite {
            return None;
        }
        let mut follow = DMatrix::zeros(all, outer);
        follow.view_mut((x, 0), (outer, outer)).fill_with_identity();
        let mut own = DVector::zeros(all);
        let mut transposed = None;
        if x > 0 {
            let inside = linear.jacobian.view((0, 0), (x, x)).into_owned();
            transposed = Some(inside.transpose().lu());
            let factors = inside.lu();
            let by_outer = factors.solve(&linear.jacobian.view((0, x), (x, outer)).into_owned())?;
            let newton = factors.solve(&linear.values.rows.rows(0, x).into_owned())?;
            follow.view_mut((0, 0), (x, outer)).copy_from(&-by_outer);
            own.rows_mut(0, x).copy_from(&-newton);
        }
        let ends = linear.jacobian.rows(x, rows - x) * &follow;
        let reached =
            linear.values.rows.rows(x, rows - x) + linear.jacobian.rows(x, rows - x) * &own;
        Some(Self {
            interior: x,
            transposed,
            follow,
            own,
            ends,
            reached,
            linear,
        })
    }

    /// The Hessian: the second derivatives of the cost plus a fraction of those of the equations.
    pub(super) fn hessian(&self, share: f64) -> DMatrix<f64> {
        &self.linear.of_cost + share * &self.linear.of_rows
    }

    /// Condenses the Hessian and the gradient to w.
    pub(super) fn quadratic(&self, hessian: &DMatrix<f64>) -> Quadratic {
        let own = &self.linear.gradient + hessian * &self.own;
        Quadratic {
            matrix: self.follow.tr_mul(&(hessian * &self.follow)),
            gradients: DMatrix::from_columns(&[
                self.follow.tr_mul(&own),
                self.follow.tr_mul(&self.linear.gradient),
            ]),
        }
    }

    /// δs for a step that closes no gaps.
    pub(super) fn along(&self, outer: &DVector<f64>) -> DVector<f64> {
        &self.follow * outer
    }

    /// δs for a step.
    pub(super) fn step(&self, outer: &DVector<f64>) -> DVector<f64> {
        &self.follow * outer + &self.own
    }

    /// The multipliers of the interior rows, given those of the end.
    pub(super) fn multipliers(
        &self,
        hessian: &DMatrix<f64>,
        step: &DVector<f64>,
        end: &DVector<f64>,
    ) -> Option<DVector<f64>> {
        let x = self.interior;
        let Some(transposed) = &self.transposed else {
            return Some(DVector::zeros(0));
        };
        let ends = self.linear.jacobian.rows(x, end.len());
        let right = &self.linear.gradient + hessian * step + ends.tr_mul(end);
        transposed.solve(&-right.rows(0, x).into_owned())
    }
}
