//! A satellite by a quaternion: L = ½ Σ Jᵢ (ωᵢ² − k cᵢ²), k = 3n², with both ω and c bilinear.

use super::ByHand;
use crate::models::Satellite;
use tfe::runtime::{First, Real, Second};

/// G(e) in ω = 2 G(e) ė = −2 G(ė) e, row by row.
fn rows<R: Real>([e0, e1, e2, e3]: [R; 4]) -> [[R; 4]; 3] {
    [[-e1, e0, e3, -e2], [-e2, -e3, e0, e1], [-e3, e2, -e1, e0]]
}

/// Sum of products.
fn inner<R: Real, const L: usize>(a: [R; L], b: [R; L]) -> R {
    let mut sum = a[0] * b[0];
    for k in 1..L {
        sum += a[k] * b[k];
    }
    sum
}

/// The directions that the vertical c in the body depends on.
///
/// ```text
/// ½ ∂c₁/∂e = (α, β, γ, δ),  ½ ∂c₂/∂e = (δ, −γ, β, −α),  ½ ∂c₃/∂e = (−γ, −δ, α, β),  cᵢ = ½ e·∂cᵢ/∂e
/// ```
fn slopes<R: Real>([e0, e1, e2, e3]: [R; 4], (sin, cos): (R, R)) -> [R; 4] {
    [
        e0 * cos + e3 * sin,
        e1 * cos + e2 * sin,
        e1 * sin - e2 * cos,
        e0 * sin - e3 * cos,
    ]
}

/// c by its slopes.
fn vertical<R: Real>([e0, e1, e2, e3]: [R; 4], [al, be, ga, de]: [R; 4]) -> [R; 3] {
    [
        e0 * al + e1 * be + e2 * ga + e3 * de,
        e0 * de - e1 * ga + e2 * be - e3 * al,
        e2 * al + e3 * be - e0 * ga - e1 * de,
    ]
}

/// L_e: the momenta h of the body on the rate of e, and the pull f of the gradient.
fn forces<R: Real>(
    [r0, r1, r2, r3]: [R; 4],
    h: [R; 3],
    [al, be, ga, de]: [R; 4],
    f: [R; 3],
) -> [R; 4] {
    [
        h[0] * r1 + h[1] * r2 + h[2] * r3 - (f[0] * al + f[1] * de - f[2] * ga),
        h[1] * r3 - h[0] * r0 - h[2] * r2 - (f[0] * be - f[1] * ga - f[2] * de),
        h[2] * r1 - h[0] * r3 - h[1] * r0 - (f[0] * ga + f[1] * be + f[2] * al),
        h[0] * r2 - h[1] * r1 - h[2] * r0 - (f[0] * de - f[1] * al + f[2] * be),
    ]
}

/// p = G(e)ᵀ h.
fn momenta<R: Real>([e0, e1, e2, e3]: [R; 4], h: [R; 3]) -> [R; 4] {
    [
        -(h[0] * e1 + h[1] * e2 + h[2] * e3),
        h[0] * e0 - h[1] * e3 + h[2] * e2,
        h[0] * e3 + h[1] * e0 - h[2] * e1,
        h[1] * e1 + h[2] * e0 - h[0] * e2,
    ]
}

impl ByHand<4> for Satellite {
    fn first<R: Real>(&self, t: R, e: &[R; 4], v: &[R; 4], first: &mut First<R, 4>) {
        let inertia = [self.a, self.b, self.c];
        let n = R::from_f64(self.n);
        let slopes = slopes(*e, (n * t).sin_cos());
        let c = vertical(*e, slopes);
        let g = rows(*e);
        let pull = 6.0 * self.n * self.n;
        let h = [0, 1, 2].map(|i| R::from_f64(4.0 * inertia[i]) * inner(g[i], *v));
        let f = [0, 1, 2].map(|i| R::from_f64(pull * inertia[i]) * c[i]);
        first.z = momenta(*e, h);
        first.q = forces(*v, h, slopes, f);
    }

    fn second<R: Real>(
        &self,
        t: R,
        e: &[R; 4],
        v: &[R; 4],
        first: &mut First<R, 4>,
        second: &mut Second<R, 4>,
    ) {
        let n = R::from_f64(self.n);
        let (sin, cos) = (n * t).sin_cos();
        let slopes = slopes(*e, (sin, cos));
        let c = vertical(*e, slopes);
        let inertia = [self.a, self.b, self.c].map(|j| R::from_f64(4.0 * j));
        let k = R::from_f64(3.0 * self.n * self.n);
        let half = R::from_f64(1.5 * self.n * self.n);
        let g = rows(*e);
        let heavy = [0, 1, 2].map(|i| g[i].map(|entry| inertia[i] * entry));
        let h = [0, 1, 2].map(|i| inner(heavy[i], *v));
        let f = [0, 1, 2].map(|i| half * inertia[i] * c[i]);
        first.z = momenta(*e, h);
        first.q = forces(*v, h, slopes, f);
        // zz = 4 G(e)ᵀ J G(e)
        for i in 0..4 {
            for j in 0..=i {
                let entry = inner(
                    [g[0][i], g[1][i], g[2][i]],
                    [heavy[0][j], heavy[1][j], heavy[2][j]],
                );
                second.zz[i][j] = entry;
                second.zz[j][i] = entry;
            }
        }
        // zq = −4 G(e)ᵀ J G(ė) + ∂(G(e)ᵀ h)/∂e
        let rates = rows(*v);
        let mixed = |i: usize, j: usize| {
            inner(
                [heavy[0][i], heavy[1][i], heavy[2][i]],
                [rates[0][j], rates[1][j], rates[2][j]],
            )
        };
        let zero = R::from_f64(0.0);
        let [h0, h1, h2] = h;
        let turned = [
            [zero, -h0, -h1, -h2],
            [h0, zero, h2, -h1],
            [h1, -h2, zero, h0],
            [h2, h1, -h0, zero],
        ];
        for i in 0..4 {
            for j in 0..4 {
                second.zq[i][j] = if i == j {
                    -mixed(i, j)
                } else {
                    turned[i][j] - mixed(i, j)
                };
            }
        }
        // qq = 4 G(ė)ᵀ J G(ė) − k Σ Jᵢ (∂cᵢ/∂e ∂cᵢ/∂eᵀ + cᵢ ∂²cᵢ/∂e²). Both products have the pattern of G: each moment
        // multiplies a product of rates less one of slopes.
        let [r0, r1, r2, r3] = *v;
        let [al, be, ga, de] = slopes;
        let [k_al, k_be, k_ga, k_de] = slopes.map(|slope| k * slope);
        let (s0, s1) = (r0 * r0 - k_be * be, r1 * r1 - k_al * al);
        let (s2, s3) = (r2 * r2 - k_de * de, r3 * r3 - k_ga * ga);
        let (s01, s23) = (r0 * r1 + k_al * be, r2 * r3 + k_ga * de);
        let (s02, s13) = (r0 * r2 + k_be * de, r1 * r3 + k_al * ga);
        let (s03, s12) = (r0 * r3 - k_be * ga, r1 * r2 - k_al * de);
        let [a, b, c] = inertia;
        let (bc, ca, ab) = (b - c, c - a, a - b);
        let [f0, f1, f2] = f;
        let (f0_cos, f0_sin, f1_cos, f1_sin) = (f0 * cos, f0 * sin, f1 * cos, f1 * sin);
        let (f2_cos, f2_sin) = (f2 * cos, f2 * sin);
        let (plus, minus) = (f0_cos + f1_sin, f0_cos - f1_sin);
        let place = |qq: &mut [[R; 4]; 4], i: usize, j: usize, entry: R| {
            qq[i][j] = entry;
            qq[j][i] = entry;
        };
        let qq = &mut second.qq;
        qq[0][0] = a * s1 + b * s2 + c * s3 - plus;
        qq[1][1] = a * s0 + b * s3 + c * s2 - minus;
        qq[2][2] = a * s3 + b * s0 + c * s1 + minus;
        qq[3][3] = a * s2 + b * s1 + c * s0 + plus;
        place(qq, 0, 1, bc * s23 - a * s01 + f2_sin);
        place(qq, 0, 2, ca * s13 - b * s02 - f2_cos);
        place(qq, 0, 3, ab * s12 - c * s03 + (f1_cos - f0_sin));
        place(qq, 1, 2, ab * s03 - c * s12 - (f0_sin + f1_cos));
        place(qq, 1, 3, ca * s02 - b * s13 - f2_cos);
        place(qq, 2, 3, bc * s01 - a * s23 - f2_sin);
    }
}
