//! One pendulum, and the potential of Hénon and Heiles.

use super::ByHand;
use crate::models::{HenonHeiles, Pendulum};
use tfe::runtime::{First, Real, Second};

impl ByHand<1> for Pendulum {
    fn first<R: Real>(&self, _t: R, [theta]: &[R; 1], [v]: &[R; 1], first: &mut First<R, 1>) {
        let [m, l, g] = [self.m, self.l, self.g].map(R::from_f64);
        let ml = m * l;
        first.z[0] = ml * (l * *v);
        first.q[0] = -(ml * (g * theta.sin()));
    }

    fn second<R: Real>(
        &self,
        _t: R,
        [theta]: &[R; 1],
        [v]: &[R; 1],
        first: &mut First<R, 1>,
        second: &mut Second<R, 1>,
    ) {
        let [m, l, g] = [self.m, self.l, self.g].map(R::from_f64);
        let (sin, cos) = theta.sin_cos();
        let ml = m * l;
        let inertia = ml * l;
        let weight = -(ml * g);
        first.z[0] = inertia * *v;
        first.q[0] = weight * sin;
        second.zz[0][0] = inertia;
        second.qq[0][0] = weight * cos;
    }
}

impl ByHand<2> for HenonHeiles {
    fn first<R: Real>(&self, _t: R, [x, y]: &[R; 2], p: &[R; 2], first: &mut First<R, 2>) {
        let (x, y, lambda) = (*x, *y, R::from_f64(self.lambda));
        first.z = *p;
        // H_y = y + λ (x² − y²)
        first.q[0] = x + (lambda + lambda) * (x * y);
        first.q[1] = y + lambda * (x * x - y * y);
    }

    fn second<R: Real>(
        &self,
        _t: R,
        [x, y]: &[R; 2],
        p: &[R; 2],
        first: &mut First<R, 2>,
        second: &mut Second<R, 2>,
    ) {
        let (x, y, lambda) = (*x, *y, R::from_f64(self.lambda));
        let one = R::from_f64(1.0);
        let twice = lambda + lambda;
        let (by_x, by_y) = (twice * x, twice * y);
        let stiffness = one + by_y;
        first.z = *p;
        first.q[0] = x * stiffness;
        first.q[1] = y + lambda * (x * x - y * y);
        second.zz[0][0] = one;
        second.zz[1][1] = one;
        second.qq[0][0] = stiffness;
        second.qq[0][1] = by_x;
        second.qq[1][0] = by_x;
        second.qq[1][1] = one - by_y;
    }
}
