//! Masses seen from a frame that turns: Foucault's pendulum, a bead on an ellipse.

use super::ByHand;
use crate::models::{Foucault, SpinningEllipse};
use tfe::runtime::{First, Real, Second};

/// ```text
/// Ω = (α, 0, β),  z = −s,  s = √(l² − x² − y²),  σ = z_x = x/s,  τ = z_y = y/s
/// ż = σẋ + τẏ,  ż_x = (ẋ + σż)/s,  ż_y = (ẏ + τż)/s
/// velocity (u, v, w) = (ẋ − βy, ẏ + βx + αs, ż + αy),  G = g + αv
/// ```
impl ByHand<2> for Foucault {
    fn first<R: Real>(&self, _t: R, [x, y]: &[R; 2], v: &[R; 2], first: &mut First<R, 2>) {
        let (x, y, [x_dot, y_dot]) = (*x, *y, *v);
        let [m, l, g] = [self.m, self.l, self.g].map(R::from_f64);
        let (sin, cos) = self.latitude.sin_cos();
        let [alpha, beta] = [self.omega * cos, self.omega * sin].map(R::from_f64);
        let s = (l * l - x * x - y * y).sqrt();
        let reciprocal = R::from_f64(1.0) / s;
        let (sigma, tau) = (x * reciprocal, y * reciprocal);
        let z_dot = sigma * x_dot + tau * y_dot;
        let u = x_dot - beta * y;
        let v = y_dot + beta * x + alpha * s;
        let w = z_dot + alpha * y;
        let weight = g + alpha * v;
        let steep = w * reciprocal;
        first.z[0] = m * (u + sigma * w);
        first.z[1] = m * (v + tau * w);
        first.q[0] = m * (beta * v + steep * (x_dot + sigma * z_dot) - sigma * weight);
        first.q[1] = m * (alpha * w + steep * (y_dot + tau * z_dot) - (beta * u + tau * weight));
    }

    fn second<R: Real>(
        &self,
        _t: R,
        [x, y]: &[R; 2],
        v: &[R; 2],
        first: &mut First<R, 2>,
        second: &mut Second<R, 2>,
    ) {
        let (x, y, [x_dot, y_dot]) = (*x, *y, *v);
        let [m, l, g] = [self.m, self.l, self.g].map(R::from_f64);
        let (sin, cos) = self.latitude.sin_cos();
        let [alpha, beta] = [self.omega * cos, self.omega * sin].map(R::from_f64);
        let s = (l * l - x * x - y * y).sqrt();
        let reciprocal = R::from_f64(1.0) / s;
        let (sigma, tau) = (x * reciprocal, y * reciprocal);
        let z_dot = sigma * x_dot + tau * y_dot;
        let z_dot_x = (x_dot + sigma * z_dot) * reciprocal;
        let z_dot_y = (y_dot + tau * z_dot) * reciprocal;
        let u = x_dot - beta * y;
        let v = y_dot + beta * x + alpha * s;
        let w = z_dot + alpha * y;
        let w_y = z_dot_y + alpha;
        let weight = g + alpha * v;
        // z_xx = (1 + σ²)/s and so on: the masses times the slope h = w/s, or times the bend f.
        let (m_sigma, m_tau) = (m * sigma, m * tau);
        let m_xx = m + m_sigma * sigma;
        let m_xy = m_sigma * tau;
        let m_yy = m + m_tau * tau;
        let h = w * reciprocal;
        let f = (h * z_dot - weight) * reciprocal;
        let v_x = beta - alpha * sigma;
        let alpha_tau = alpha * tau;
        let m_v_x = m * v_x;
        let (xx, xy) = (m_sigma * z_dot_x, m_sigma * z_dot_y);
        let (yx, yy) = (m_tau * z_dot_x, m_tau * z_dot_y);
        let slope = m_xy * h;
        let twice = h + h;
        let cross = m_xy * f + h * (xy + yx) + m * (w_y * z_dot_x) - m_v_x * alpha_tau;
        first.z[0] = m * u + m_sigma * w;
        first.z[1] = m * v + m_tau * w;
        first.q[0] = m * (beta * v + w * z_dot_x) - m_sigma * weight;
        first.q[1] = m * (w * w_y - beta * u) - m_tau * weight;
        second.zz = [[m_xx, m_xy], [m_xy, m_yy]];
        second.zq[0][0] = m_xx * h + xx;
        second.zq[0][1] = slope + xy - m_v_x;
        second.zq[1][0] = slope + yx + m_v_x;
        second.zq[1][1] = m_yy * h + yy;
        second.qq[0][0] = m_xx * f + twice * xx + m_v_x * v_x + m * (z_dot_x * z_dot_x);
        second.qq[0][1] = cross;
        second.qq[1][0] = cross;
        second.qq[1][1] =
            m_yy * f + twice * yy + m * (beta * beta + alpha_tau * alpha_tau + w_y * w_y);
    }
}

/// L_s = m (sin s cos s (e ṡ² + ω²a²) − g b sin s) with e = b² − a².
impl ByHand<1> for SpinningEllipse {
    fn first<R: Real>(&self, _t: R, [s]: &[R; 1], [v]: &[R; 1], first: &mut First<R, 1>) {
        let v = *v;
        let [m, a, b, g] = [self.m, self.a, self.b, self.g].map(R::from_f64);
        let omega = R::from_f64(self.omega);
        let (sin, cos) = s.sin_cos();
        let (x, y) = (a * cos, b * sin);
        let excess = (b - a) * (b + a);
        let outward = omega * a;
        first.z[0] = m * v * (x * x + y * y);
        first.q[0] = m * sin * (cos * (excess * (v * v) + outward * outward) - g * b);
    }

    fn second<R: Real>(
        &self,
        _t: R,
        [s]: &[R; 1],
        [v]: &[R; 1],
        first: &mut First<R, 1>,
        second: &mut Second<R, 1>,
    ) {
        let v = *v;
        let [m, a, b, g] = [self.m, self.a, self.b, self.g].map(R::from_f64);
        let omega = R::from_f64(self.omega);
        let (sin, cos) = s.sin_cos();
        let (cos2, sin2) = (cos * cos, sin * sin);
        let inertia = m * (a * a * cos2 + b * b * sin2);
        let excess = m * ((b - a) * (b + a)) * v;
        let outward = omega * a;
        let stiffness = excess * v + m * outward * outward;
        let weight = m * g * b;
        let product = excess * (sin * cos);
        first.z[0] = inertia * v;
        first.q[0] = sin * (cos * stiffness - weight);
        second.zz[0][0] = inertia;
        second.zq[0][0] = product + product;
        second.qq[0][0] = (cos2 - sin2) * stiffness - weight * cos;
    }
}
