//! Arms of robots, by the positions of their links; sums of parameters that can cancel are not multiplied out.

use super::ByHand;
use crate::models::{ElasticArm, SpatialArm};
use tfe::runtime::{First, Real, Second};

/// ```text
/// d = b + c,  elbow (x, y) = l₂ (cos b, sin b),  hand (u, w) = s₃ (cos d, sin d),  (ρ, z) = (x + u, y + w)
/// Θ = j₁ + i₂ sin²b + e₂ cos²b + i₃ sin²d + j₃ cos²d + m₃ ρ²,  e₂ = j₂ + m₂ s₂²
/// ½ Θ_b = (i₂ − e₂) sin b cos b + (i₃ − j₃) sin d cos d − m₃ ρ z,  ½ Θ_c = (i₃ − j₃) sin d cos d − m₃ ρ w
/// ```
impl ByHand<3> for SpatialArm {
    fn first<R: Real>(&self, _t: R, q: &[R; 3], v: &[R; 3], first: &mut First<R, 3>) {
        let [j1, i2, i3, j3] = [self.j1, self.i2, self.i3, self.j3].map(R::from_f64);
        let [l2, s2, m2, m3] = [self.l2, self.s2, self.m2, self.m3].map(R::from_f64);
        let [s3, j2, g] = [self.s3, self.j2, self.g].map(R::from_f64);
        let m2_s2 = m2 * s2;
        let e2 = j2 + m2_s2 * s2;
        let ((sin, cos), (sin_d, cos_d)) = (q[1].sin_cos(), (q[1] + q[2]).sin_cos());
        let (x, y, u, w) = (l2 * cos, l2 * sin, s3 * cos_d, s3 * sin_d);
        let (rho, z) = (x + u, y + w);
        let (turn, d_dot) = (v[0] * v[0], v[1] + v[2]);
        let (rho_dot, z_dot) = (y * v[1] + w * d_dot, x * v[1] + u * d_dot);
        let m_rho = m3 * rho;
        let fore = j3 * d_dot;
        let theta = j1
            + (i2 * (sin * sin) + e2 * (cos * cos))
            + (i3 * (sin_d * sin_d) + j3 * (cos_d * cos_d))
            + m_rho * rho;
        let twist = (i3 - j3) * (sin_d * cos_d);
        let swing = m3 * (x * w - y * u);
        first.z[0] = theta * v[0];
        first.z[1] = e2 * v[1] + fore + m3 * (rho * z_dot + z * rho_dot);
        first.z[2] = fore + m3 * (u * z_dot + w * rho_dot);
        first.q[1] =
            turn * ((i2 - e2) * (sin * cos) + twist - m_rho * z) - g * (m2_s2 * cos + m_rho);
        first.q[2] = turn * (twist - m_rho * w) - g * (m3 * u) - swing * (v[1] * d_dot);
    }

    fn second<R: Real>(
        &self,
        _t: R,
        q: &[R; 3],
        v: &[R; 3],
        first: &mut First<R, 3>,
        second: &mut Second<R, 3>,
    ) {
        let [j1, i2, i3, j3] = [self.j1, self.i2, self.i3, self.j3].map(R::from_f64);
        let [l2, s2, m2, m3] = [self.l2, self.s2, self.m2, self.m3].map(R::from_f64);
        let [s3, j2, g] = [self.s3, self.j2, self.g].map(R::from_f64);
        let m2_s2 = m2 * s2;
        let e2 = j2 + m2_s2 * s2;
        let ((sin, cos), (sin_d, cos_d)) = (q[1].sin_cos(), (q[1] + q[2]).sin_cos());
        let (x, y, u, w) = (l2 * cos, l2 * sin, s3 * cos_d, s3 * sin_d);
        let (rho, z) = (x + u, y + w);
        let (m_rho, m_z, m_u, m_w) = (m3 * rho, m3 * z, m3 * u, m3 * w);
        let (sin2, cos2, sin2_d, cos2_d) = (sin * sin, cos * cos, sin_d * sin_d, cos_d * cos_d);
        let (rho2, z2) = (m_rho * rho, m_z * z);
        let theta = j1 + (i2 * sin2 + e2 * cos2) + (i3 * sin2_d + j3 * cos2_d) + rho2;
        let bending = x * m_u + y * m_w;
        let swing = x * m_w - y * m_u;
        let fore = j3 + m3 * s3 * s3;
        let both = fore + bending;
        let upper = e2 + j3 + (rho2 + z2);
        let (excess2, excess3) = (i2 - e2, i3 - j3);
        let twist = excess3 * (sin_d * cos_d);
        let h_b = excess2 * (sin * cos) + twist - rho * m_z;
        let h_c = twist - rho * m_w;
        let wide = excess3 * (cos2_d - sin2_d);
        let rho_u = rho * m_u;
        let (turn, d_dot) = (v[0] * v[0], v[1] + v[2]);
        let twice = v[0] + v[0];
        let swing_b = swing * v[1];
        let mixed = turn * (wide + (z * m_w - rho_u)) + g * m_w;
        first.z[0] = theta * v[0];
        first.z[1] = upper * v[1] + both * v[2];
        first.z[2] = both * v[1] + fore * v[2];
        first.q[1] = turn * h_b - g * (m2_s2 * cos + m_rho);
        first.q[2] = turn * h_c - g * m_u - swing_b * d_dot;
        second.zz[0][0] = theta;
        second.zz[1][1] = upper;
        second.zz[1][2] = both;
        second.zz[2][1] = both;
        second.zz[2][2] = fore;
        second.zq[0][1] = twice * h_b;
        second.zq[0][2] = twice * h_c;
        second.zq[1][2] = -(swing_b + swing * d_dot);
        second.zq[2][2] = -swing_b;
        second.qq[1][1] =
            turn * (excess2 * (cos2 - sin2) + wide + (z2 - rho2)) + g * (m2_s2 * sin + m_z);
        second.qq[1][2] = mixed;
        second.qq[2][1] = mixed;
        second.qq[2][2] = turn * (wide + (w * m_w - rho_u)) + g * m_w - bending * (v[1] * d_dot);
    }
}

/// Elbow (x, y), centre of the second link from there (u, w), both added (ρ, z).
impl ByHand<4> for ElasticArm {
    fn first<R: Real>(&self, _t: R, q: &[R; 4], v: &[R; 4], first: &mut First<R, 4>) {
        let [m1, l1, s1, i1] = [self.m1, self.l1, self.s1, self.i1].map(R::from_f64);
        let [m2, s2, i2, g] = [self.m2, self.s2, self.i2, self.g].map(R::from_f64);
        let [j1, j2, k1, k2] = [self.j1, self.j2, self.k1, self.k2].map(R::from_f64);
        let ((sin, cos), (sin_n, cos_n)) = (q[0].sin_cos(), (q[0] + q[1]).sin_cos());
        let (x, y, u, w) = (l1 * cos, l1 * sin, s2 * cos_n, s2 * sin_n);
        let (rho, z) = (x + u, y + w);
        let n = v[0] + v[1];
        let (back, up) = (y * v[0] + w * n, x * v[0] + u * n);
        let spin = i2 * n;
        let m1_s1 = m1 * s1;
        let (spring1, spring2) = (k1 * (q[0] - q[2]), k2 * (q[1] - q[3]));
        first.z[0] = (i1 + m1_s1 * s1) * v[0] + spin + m2 * (rho * up + z * back);
        first.z[1] = spin + m2 * (u * up + w * back);
        first.z[2] = j1 * v[2];
        first.z[3] = j2 * v[3];
        first.q[0] = -(g * (m1_s1 * cos + m2 * rho) + spring1);
        first.q[1] = -(m2 * (g * u + (x * w - y * u) * (v[0] * n)) + spring2);
        first.q[2] = spring1;
        first.q[3] = spring2;
    }

    fn second<R: Real>(
        &self,
        _t: R,
        q: &[R; 4],
        v: &[R; 4],
        first: &mut First<R, 4>,
        second: &mut Second<R, 4>,
    ) {
        let [m1, l1, s1, i1] = [self.m1, self.l1, self.s1, self.i1].map(R::from_f64);
        let [m2, s2, i2, g] = [self.m2, self.s2, self.i2, self.g].map(R::from_f64);
        let [j1, j2, k1, k2] = [self.j1, self.j2, self.k1, self.k2].map(R::from_f64);
        let ((sin, cos), (sin_n, cos_n)) = (q[0].sin_cos(), (q[0] + q[1]).sin_cos());
        let (x, y, u, w) = (l1 * cos, l1 * sin, s2 * cos_n, s2 * sin_n);
        let (m_u, m_w) = (m2 * u, m2 * w);
        let (rho, z) = (x + u, y + w);
        let n = v[0] + v[1];
        let m1_s1 = m1 * s1;
        let bending = x * m_u + y * m_w;
        let swing = x * m_w - y * m_u;
        let (m_rho, m_z) = (m2 * rho, m2 * z);
        let fore = i2 + m2 * s2 * s2;
        let both = fore + bending;
        let upper = i1 + m1_s1 * s1 + i2 + (m_rho * rho + m_z * z);
        let (spring1, spring2) = (k1 * (q[0] - q[2]), k2 * (q[1] - q[3]));
        let swing_a = swing * v[0];
        let (weight, hang) = (g * m_u, g * m_w);
        let stiffness = g * (m1_s1 * sin + m_z) - k1;
        first.z[0] = upper * v[0] + both * v[1];
        first.z[1] = both * v[0] + fore * v[1];
        first.z[2] = j1 * v[2];
        first.z[3] = j2 * v[3];
        first.q[0] = -(g * (m1_s1 * cos + m_rho) + spring1);
        first.q[1] = -(weight + swing_a * n + spring2);
        first.q[2] = spring1;
        first.q[3] = spring2;
        second.zz[0][0] = upper;
        second.zz[0][1] = both;
        second.zz[1][0] = both;
        second.zz[1][1] = fore;
        second.zz[2][2] = j1;
        second.zz[3][3] = j2;
        second.zq[0][1] = -(swing_a + swing * n);
        second.zq[1][1] = -swing_a;
        second.qq[0][0] = stiffness;
        second.qq[0][1] = hang;
        second.qq[1][0] = hang;
        second.qq[1][1] = hang - bending * (v[0] * n) - k2;
        second.qq[0][2] = k1;
        second.qq[2][0] = k1;
        second.qq[1][3] = k2;
        second.qq[3][1] = k2;
        second.qq[2][2] = -k1;
        second.qq[3][3] = -k2;
    }
}
