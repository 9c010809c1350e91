//! A spherical pendulum on a cart.

use super::ByHand;
use crate::models::SphericalPendulumOnCart;
use tfe::runtime::{First, Real, Second};

impl ByHand<3> for SphericalPendulumOnCart {
    /// By the velocities of the mass along θ and φ, lθ̇ + ẋ cos θ cos φ and lφ̇ sin θ − ẋ sin φ.
    fn first<R: Real>(&self, _t: R, q: &[R; 3], v: &[R; 3], first: &mut First<R, 3>) {
        let [m, l, g] = [self.m, self.l, self.g].map(R::from_f64);
        let total = R::from_f64(self.mc + self.m);
        let ((sin, cos), (sin_phi, cos_phi)) = (q[1].sin_cos(), q[2].sin_cos());
        let ml = m * l;
        let (across, along) = (v[0] * sin_phi, v[0] * cos_phi);
        let (w, forward) = (v[2] * sin, v[1] * cos);
        let by_phi = l * w - across;
        first.z[0] = total * v[0] + ml * (cos_phi * forward - sin_phi * w);
        first.z[1] = ml * (l * v[1] + along * cos);
        first.z[2] = ml * (sin * by_phi);
        first.q[1] = ml * (v[2] * cos * by_phi - sin * (along * v[1] + g));
        first.q[2] = -(ml * (across * forward + along * w));
    }

    fn second<R: Real>(
        &self,
        _t: R,
        q: &[R; 3],
        v: &[R; 3],
        first: &mut First<R, 3>,
        second: &mut Second<R, 3>,
    ) {
        let [m, l, g] = [self.m, self.l, self.g].map(R::from_f64);
        let total = R::from_f64(self.mc + self.m);
        let ((sin, cos), (sin_phi, cos_phi)) = (q[1].sin_cos(), q[2].sin_cos());
        let ml = m * l;
        let (ml_sin, ml_cos) = (ml * sin, ml * cos);
        let (cc, cs) = (ml_cos * cos_phi, ml_cos * sin_phi);
        let (sc, ss) = (ml_sin * cos_phi, ml_sin * sin_phi);
        let inertia = ml * l;
        let lever = l * ml_sin;
        let inertia_phi = lever * sin;
        let turn = lever * cos * v[2];
        let turning = inertia_phi * v[2];
        let (x_sc, x_cs) = (v[0] * sc, v[0] * cs);
        let by_theta = sc * v[1] + cs * v[2];
        let by_phi = cs * v[1] + sc * v[2];
        let rate = cc * v[1] - ss * v[2];
        let x_rate = v[0] * rate;
        let bend = v[0] * (ss * v[1] - cc * v[2]);
        first.z[0] = total * v[0] + rate;
        first.z[1] = inertia * v[1] + cc * v[0];
        first.z[2] = turning - ss * v[0];
        first.q[1] = turn * v[2] - v[0] * by_theta - g * ml_sin;
        first.q[2] = -(v[0] * by_phi);
        second.zz[0] = [total, cc, -ss];
        second.zz[1][0] = cc;
        second.zz[1][1] = inertia;
        second.zz[2][0] = -ss;
        second.zz[2][2] = inertia_phi;
        second.zq[0][1] = -by_theta;
        second.zq[0][2] = -by_phi;
        second.zq[1][1] = -x_sc;
        second.zq[1][2] = -x_cs;
        second.zq[2][1] = turn + turn - x_cs;
        second.zq[2][2] = -x_sc;
        // cos²θ − sin²θ, times the inertia.
        let difference = inertia * v[2] - (turning + turning);
        second.qq[1][1] = difference * v[2] - x_rate - g * ml_cos;
        second.qq[1][2] = bend;
        second.qq[2][1] = bend;
        second.qq[2][2] = -x_rate;
    }
}
