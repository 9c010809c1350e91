//! Bodies that attract each other, pair by pair.

use super::ByHand;
use crate::models::Planets;
use tfe::runtime::{First, Real, Second};

impl Planets {
    /// x_i − x_j, y_i − y_j, z_i − z_j.
    fn apart<R: Real>(q: &[R; 18], i: usize, j: usize) -> [R; 3] {
        [q[i] - q[j], q[i + 6] - q[j + 6], q[i + 12] - q[j + 12]]
    }
}

impl ByHand<18> for Planets {
    fn first<R: Real>(&self, _t: R, q: &[R; 18], v: &[R; 18], first: &mut First<R, 18>) {
        for i in 0..6 {
            let m = R::from_f64(self.m[i]);
            for k in 0..3 {
                first.z[6 * k + i] = m * v[6 * k + i];
            }
        }
        let mut force = [R::from_f64(0.0); 18];
        for i in 1..6 {
            let gm = self.g * self.m[i];
            for j in 0..i {
                let d = Self::apart(q, i, j);
                let square = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
                let pull = R::from_f64(gm * self.m[j]) / (square * square.sqrt());
                for k in 0..3 {
                    let component = pull * d[k];
                    force[6 * k + j] += component;
                    force[6 * k + i] -= component;
                }
            }
        }
        first.q = force;
    }

    fn second<R: Real>(
        &self,
        _t: R,
        q: &[R; 18],
        v: &[R; 18],
        first: &mut First<R, 18>,
        second: &mut Second<R, 18>,
    ) {
        let (zero, one, three) = (R::from_f64(0.0), R::from_f64(1.0), R::from_f64(3.0));
        for i in 0..6 {
            let m = R::from_f64(self.m[i]);
            for k in 0..3 {
                first.z[6 * k + i] = m * v[6 * k + i];
                second.zz[6 * k + i][6 * k + i] = m;
            }
        }
        let mut force = [zero; 18];
        for i in 1..6 {
            let gm = self.g * self.m[i];
            let mut own = [zero; 3];
            for j in 0..i {
                let [x, y, z] = Self::apart(q, i, j);
                let zz = z * z;
                let square = x * x + y * y + zz;
                let reciprocal = one / square;
                let pull = R::from_f64(gm * self.m[j]) * reciprocal * (reciprocal * square.sqrt());
                for (k, d) in [x, y, z].into_iter().enumerate() {
                    let component = pull * d;
                    force[6 * k + j] += component;
                    own[k] += component;
                }
                let steep = three * pull * reciprocal;
                let (sx, sy) = (steep * x, steep * y);
                let block = [
                    pull - sx * x,
                    -(sx * y),
                    -(sx * z),
                    pull - sy * y,
                    -(sy * z),
                    pull - steep * zz,
                ];
                place(&mut second.qq, i, j, block);
                place(&mut second.qq, j, i, block);
            }
            for k in 0..3 {
                force[6 * k + i] = -own[k];
            }
        }
        first.q = force;
        let qq = &mut second.qq;
        balance::<R, 0, 0>(qq);
        balance::<R, 0, 1>(qq);
        balance::<R, 0, 2>(qq);
        balance::<R, 1, 1>(qq);
        balance::<R, 1, 2>(qq);
        balance::<R, 2, 2>(qq);
    }
}

/// Nothing is felt when all bodies move alike: the rows of each 6 × 6 block add up to zero, which gives its diagonal.
fn balance<R: Real, const A: usize, const B: usize>(qq: &mut [[R; 18]; 18]) {
    let mut sums = [R::from_f64(0.0); 6];
    for i in 0..6 {
        qq[6 * A + i][6 * B + i] = R::from_f64(0.0);
        for j in 0..6 {
            sums[j] += qq[6 * A + i][6 * B + j];
        }
    }
    for i in 0..6 {
        qq[6 * A + i][6 * B + i] = -sums[i];
        if A != B {
            qq[6 * B + i][6 * A + i] = -sums[i];
        }
    }
}

/// Writes a symmetric block.
fn place<R: Real>(qq: &mut [[R; 18]; 18], i: usize, j: usize, [xx, xy, xz, yy, yz, zz]: [R; 6]) {
    qq[i][j] = xx;
    qq[i][j + 6] = xy;
    qq[i][j + 12] = xz;
    qq[i + 6][j] = xy;
    qq[i + 6][j + 6] = yy;
    qq[i + 6][j + 12] = yz;
    qq[i + 12][j] = xz;
    qq[i + 12][j + 6] = yz;
    qq[i + 12][j + 12] = zz;
}
