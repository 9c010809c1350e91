//! Masses in a row.

use super::ByHand;
use crate::models::Fput;
use tfe::runtime::{First, Real, Second};

/// The tension of the spring on the left is that of the spring on the right, one mass before.
impl ByHand<32> for Fput {
    fn first<R: Real>(&self, _t: R, q: &[R; 32], p: &[R; 32], first: &mut First<R, 32>) {
        let a = R::from_f64(self.a);
        let tension = |stretch: R| stretch + a * (stretch * stretch);
        first.z = *p;
        let mut left = tension(q[0]);
        for i in 0..31 {
            let right = tension(q[i + 1] - q[i]);
            first.q[i] = left - right;
            left = right;
        }
        first.q[31] = left - tension(-q[31]);
    }

    fn second<R: Real>(
        &self,
        _t: R,
        q: &[R; 32],
        p: &[R; 32],
        first: &mut First<R, 32>,
        second: &mut Second<R, 32>,
    ) {
        let (a, one) = (R::from_f64(self.a), R::from_f64(1.0));
        // V′ = δ (1 + a δ), V″ = 1 + 2 a δ
        let spring = |stretch: R| {
            let bend = a * stretch;
            (stretch + stretch * bend, one + (bend + bend))
        };
        first.z = *p;
        for i in 0..32 {
            second.zz[i][i] = one;
        }
        let mut left = spring(q[0]);
        for i in 0..31 {
            let right = spring(q[i + 1] - q[i]);
            first.q[i] = left.0 - right.0;
            second.qq[i][i] = left.1 + right.1;
            second.qq[i][i + 1] = -right.1;
            second.qq[i + 1][i] = -right.1;
            left = right;
        }
        let right = spring(-q[31]);
        first.q[31] = left.0 - right.0;
        second.qq[31][31] = left.1 + right.1;
    }
}
