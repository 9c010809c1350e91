//! Bodies that turn, in Euler's angles φ, θ, ψ.

use super::ByHand;
use crate::models::{FreeBody, HeavyTop};
use tfe::runtime::{First, Real, Second};

impl ByHand<3> for HeavyTop {
    fn first<R: Real>(&self, _t: R, q: &[R; 3], v: &[R; 3], first: &mut First<R, 3>) {
        let [a, c] = [self.a, self.c].map(R::from_f64);
        let weight = R::from_f64(self.m * self.g * self.l);
        let (sin, cos) = q[1].sin_cos();
        let spin = c * (v[2] + v[0] * cos);
        let turn = a * v[0];
        first.z[0] = turn * sin * sin + spin * cos;
        first.z[1] = a * v[1];
        first.z[2] = spin;
        first.q[1] = sin * (weight + v[0] * (turn * cos - spin));
    }

    fn second<R: Real>(
        &self,
        _t: R,
        q: &[R; 3],
        v: &[R; 3],
        first: &mut First<R, 3>,
        second: &mut Second<R, 3>,
    ) {
        let [a, c] = [self.a, self.c].map(R::from_f64);
        let weight = R::from_f64(self.m * self.g * self.l);
        let (sin, cos) = q[1].sin_cos();
        // The spin n = C (ψ̇ + φ̇ cos θ) has ∂n/∂θ = −C φ̇ sin θ.
        let spin = c * (v[2] + v[0] * cos);
        let turn = a * v[0];
        let rate = c * v[0];
        let difference = turn - rate;
        let square = sin * sin;
        let coupling = c * cos;
        let h = turn * cos - spin;
        let torque = weight + v[0] * h;
        first.z[0] = turn * square + spin * cos;
        first.z[1] = a * v[1];
        first.z[2] = spin;
        first.q[1] = sin * torque;
        second.zz[0][0] = a * square + coupling * cos;
        second.zz[0][2] = coupling;
        second.zz[1][1] = a;
        second.zz[2][0] = coupling;
        second.zz[2][2] = c;
        second.zq[0][1] = sin * (h + difference * cos);
        second.zq[2][1] = -(rate * sin);
        second.qq[1][1] = cos * torque - v[0] * difference * square;
    }
}

/// ```text
/// L = ½ K w² + D w θ̇ + ½ M θ̇² + ½ C (ψ̇ + φ̇ cos θ)²,  w = φ̇ sin θ
/// K = A sin²ψ + B cos²ψ,  M = A cos²ψ + B sin²ψ,  D = (A − B) sin ψ cos ψ
/// K_ψ = 2 D,  M_ψ = −2 D,  D_ψ = M − K
/// ```
impl ByHand<3> for FreeBody {
    fn first<R: Real>(&self, _t: R, q: &[R; 3], v: &[R; 3], first: &mut First<R, 3>) {
        let [a, b, c] = [self.a, self.b, self.c].map(R::from_f64);
        let (sin, cos) = q[1].sin_cos();
        let (sin_psi, cos_psi) = q[2].sin_cos();
        let part = (a - b) * sin_psi;
        let excess = part * sin_psi;
        let (k, m, d) = (b + excess, a - excess, part * cos_psi);
        let w = v[0] * sin;
        let by_w = k * w + d * v[1];
        let by_theta = d * w + m * v[1];
        let spin = c * (v[2] + v[0] * cos);
        first.z[0] = sin * by_w + cos * spin;
        first.z[1] = by_theta;
        first.z[2] = spin;
        first.q[1] = v[0] * (cos * by_w - sin * spin);
        // Euler: (A − B) ω₁ ω₂
        first.q[2] = w * by_theta - v[1] * by_w;
    }

    fn second<R: Real>(
        &self,
        _t: R,
        q: &[R; 3],
        v: &[R; 3],
        first: &mut First<R, 3>,
        second: &mut Second<R, 3>,
    ) {
        let [a, b, c] = [self.a, self.b, self.c].map(R::from_f64);
        let (sin, cos) = q[1].sin_cos();
        let (sin_psi, cos_psi) = q[2].sin_cos();
        let part = (a - b) * sin_psi;
        let (k, d) = (b + part * sin_psi, part * cos_psi);
        // A second derivative as it stands: A − (A − B) sin²ψ would lose the digits of a small B.
        let m = a * (cos_psi * cos_psi) + b * (sin_psi * sin_psi);
        let w = v[0] * sin;
        let (kw, dw, d_theta) = (k * w, d * w, d * v[1]);
        let by_w = kw + d_theta;
        let by_theta = dw + m * v[1];
        let along = v[0] * cos;
        let spin = c * (v[2] + along);
        let coupling = c * cos;
        let spin_theta = c * w;
        let h = cos * by_w - sin * spin;
        let turn = sin * by_w + cos * spin;
        // The derivatives of L_w and L_θ̇ by ψ.
        let twist = m - k;
        let by_w_psi = (dw + dw) + twist * v[1];
        let by_theta_psi = twist * w - (d_theta + d_theta);
        let inertia = sin * (sin * k) + cos * coupling;
        let sin_d = sin * d;
        let along_psi = along * by_w_psi;
        first.z[0] = turn;
        first.z[1] = by_theta;
        first.z[2] = spin;
        first.q[1] = v[0] * h;
        // Euler: w L_θ̇ − θ̇ L_w, which has no digits of a small A − B.
        let (rate_1, rate_2) = (w * sin_psi + v[1] * cos_psi, w * cos_psi - v[1] * sin_psi);
        first.q[2] = (a - b) * (rate_1 * rate_2);
        second.zz[0][0] = inertia;
        second.zz[0][1] = sin_d;
        second.zz[1][0] = sin_d;
        second.zz[0][2] = coupling;
        second.zz[2][0] = coupling;
        second.zz[1][1] = m;
        second.zz[2][2] = c;
        second.zq[0][1] = h + cos * (kw - spin_theta);
        second.zq[0][2] = sin * by_w_psi;
        second.zq[1][1] = d * along;
        second.zq[1][2] = by_theta_psi;
        second.zq[2][1] = -spin_theta;
        // K cos²θ + C sin²θ = K + C − L_φ̇φ̇
        second.qq[1][1] = v[0] * (v[0] * (k + c - inertia) - turn);
        second.qq[1][2] = along_psi;
        second.qq[2][1] = along_psi;
        second.qq[2][2] = w * by_theta_psi - v[1] * by_w_psi;
    }
}
