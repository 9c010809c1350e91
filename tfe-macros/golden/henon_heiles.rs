/// # Derived model
/// ```text
/// H = ½ (px² + py²) + ½ (x² + y²) + λ (x² y − y³/3)
/// coordinates: x, y      momenta: px, py      parameters: λ
/// operations, value: 5 +−, 7 ×, 1 ÷, 0 sin/cos, 0 other
/// operations, gradient: 3 +−, 6 ×, 0 ÷, 0 sin/cos, 0 other
/// operations, gradient and second derivatives: 4 +−, 7 ×, 0 ÷, 0 sin/cos, 0 other
/// declared by             Hamiltonian, 2 coordinates
/// depends on time         no
/// forces                  no
/// linear                  no
/// quadratic in p          yes
/// constant H_pp           yes, diagonal
/// separable (H_pq = 0)    yes
/// smooth                  yes
/// cyclic coordinates      none
/// pattern H_pp            (0,0) (1,1)
/// pattern H_pq            zero
/// pattern H_qq            (0,0) (0,1) (1,0) (1,1)
/// ```
struct HenonHeiles {
    lambda: f64,
}
const _: () = {
    use ::tfe::__private as __tfe;
    #[automatically_derived]
    #[allow(unused, non_snake_case)]
    impl __tfe::Model<2> for HenonHeiles {
        const FORM: __tfe::Form = __tfe::Form::Hamiltonian;
        const FACTS: __tfe::Facts = __tfe::Facts {
            time_dependent: false,
            forced: false,
            quadratic_in_z: true,
            constant_mass: true,
            linear: false,
            separable: true,
            smooth: true,
        };
        const DIAGONAL_MASS: bool = true;
        /// H(q, p, t): 5 +−, 7 ×, 1 ÷
        fn energy_function<R: __tfe::Real>(&self, t: R, q: &[R; 2], z: &[R; 2]) -> R {
            let lambda = t.parameter(0, self.lambda);
            let t0 = q[0] * q[0];
            let t1 = z[0] * z[0];
            let t2 = z[1] * z[1];
            let t3 = t1 + t2;
            let t4 = lambda * q[1];
            let t5 = q[1] * q[1];
            let t6 = t5 + t0;
            let t7 = t6 + t3;
            let t8 = t.like(0.5) * t7;
            let t9 = t5 / t.like(3.0);
            let t10 = t0 - t9;
            let t11 = t4 * t10;
            t8 + t11
        }
        const LANES: bool = true;
        /// H_p and H_q: 3 +−, 6 ×
        #[inline(always)]
        fn first_inline<R: __tfe::Real>(
            &self,
            t: R,
            q: &[R; 2],
            z: &[R; 2],
            first: &mut __tfe::First<R, 2>,
        ) {
            let lambda = t.parameter(0, self.lambda);
            first.z[0] = z[0];
            first.z[1] = z[1];
            /// ∂H/∂x
            let t0 = q[0] * q[1];
            let t1 = t.like(2.0) * t0;
            let t2 = lambda * t1;
            first.q[0] = q[0] + t2;
            /// ∂H/∂y
            let t3 = q[0] * q[0];
            let t4 = q[1] * q[1];
            let t5 = t3 - t4;
            let t6 = lambda * t5;
            first.q[1] = q[1] + t6;
        }
        /// H_p and H_q, and H_pp: 3 +−, 6 ×
        #[inline(always)]
        fn first_and_mass_inline<R: __tfe::Real>(
            &self,
            t: R,
            q: &[R; 2],
            z: &[R; 2],
            first: &mut __tfe::First<R, 2>,
            zz: &mut [[R; 2]; 2],
        ) {
            let lambda = t.parameter(0, self.lambda);
            first.z[0] = z[0];
            first.z[1] = z[1];
            zz[0][0] = t.like(1.0);
            zz[1][1] = t.like(1.0);
            /// ∂H/∂x
            let t0 = q[0] * q[1];
            let t1 = t.like(2.0) * t0;
            let t2 = lambda * t1;
            first.q[0] = q[0] + t2;
            /// ∂H/∂y
            let t3 = q[0] * q[0];
            let t4 = q[1] * q[1];
            let t5 = t3 - t4;
            let t6 = lambda * t5;
            first.q[1] = q[1] + t6;
        }
        fn first<R: __tfe::Real>(
            &self,
            t: R,
            q: &[R; 2],
            z: &[R; 2],
            first: &mut __tfe::First<R, 2>,
        ) {
            __tfe::Model::first_inline(self, t, q, z, first);
        }
        fn first_and_mass<R: __tfe::Real>(
            &self,
            t: R,
            q: &[R; 2],
            z: &[R; 2],
            first: &mut __tfe::First<R, 2>,
            zz: &mut [[R; 2]; 2],
        ) {
            __tfe::Model::first_and_mass_inline(self, t, q, z, first, zz);
        }
        /// H_p and H_q, H_pp, H_pq and H_qq: 4 +−, 7 ×
        fn second<R: __tfe::Real>(
            &self,
            t: R,
            q: &[R; 2],
            z: &[R; 2],
            first: &mut __tfe::First<R, 2>,
            second: &mut __tfe::Second<R, 2>,
        ) {
            let lambda = t.parameter(0, self.lambda);
            first.z[0] = z[0];
            first.z[1] = z[1];
            second.zz[0][0] = t.like(1.0);
            second.zz[1][1] = t.like(1.0);
            /// ∂²H/∂x∂y, and parts of later results
            let t0 = t.like(2.0) * lambda;
            let t1 = q[1] * t0;
            let t2 = q[0] * t0;
            second.qq[0][1] = t2;
            second.qq[1][0] = t2;
            /// ∂H/∂x, ∂²H/∂x²
            let t3 = t.like(1.0) + t1;
            second.qq[0][0] = t3;
            first.q[0] = q[0] * t3;
            /// ∂²H/∂y², and parts of later results
            let t4 = q[0] * q[0];
            second.qq[1][1] = t.like(1.0) - t1;
            /// ∂H/∂y
            let t5 = q[1] * q[1];
            let t6 = t4 - t5;
            let t7 = lambda * t6;
            first.q[1] = q[1] + t7;
        }
        fn coordinate_name(index: usize) -> __tfe::CoordinateName {
            match index {
                0 => __tfe::CoordinateName::single("x"),
                1 => __tfe::CoordinateName::single("y"),
                _ => __tfe::CoordinateName::element("", index),
            }
        }
        fn parameters(&self) -> usize {
            1
        }
        fn parameter_name(&self, index: usize) -> __tfe::CoordinateName {
            if index < 1 {
                return __tfe::CoordinateName::single("lambda");
            }
            __tfe::CoordinateName::element("", index)
        }
        fn parameter(&self, index: usize) -> f64 {
            if index < 1 {
                return self.lambda;
            }
            ::core::primitive::f64::NAN
        }
        fn with_parameter(
            &self,
            index: usize,
            value: f64,
        ) -> ::core::option::Option<Self> {
            let mut made = Self { ..*self };
            if index < 1 {
                made.lambda = value;
            } else {
                return ::core::option::Option::None;
            }
            ::core::option::Option::Some(made)
        }
    }
};
#[automatically_derived]
#[allow(dead_code)]
impl HenonHeiles {
    /// The state with coordinates `q` and velocities `v` = dq/dt at time zero; its momenta are p = ∂L/∂v.
    ///
    /// Where no momentum belongs to the velocity (a Hamiltonian with singular ∂²H/∂p²) the momenta are NaN, and a run refuses them.
    fn state(&self, q: [f64; 2], v: [f64; 2]) -> ::tfe::__private::State<2> {
        ::tfe::__private::state(self, 0.0, q, v)
    }
    /// What was derived from the declaration: a page when printed.
    fn structure() -> ::tfe::__private::Structure {
        ::tfe::__private::Structure {
            name: "HenonHeiles",
            form: ::tfe::__private::Form::Hamiltonian,
            facts: ::tfe::__private::Facts {
                time_dependent: false,
                forced: false,
                quadratic_in_z: true,
                constant_mass: true,
                linear: false,
                separable: true,
                smooth: true,
            },
            cyclic: &[],
            conserved: &[],
            diagonal_mass: true,
            value: ::tfe::__private::Operations {
                additions: 5,
                multiplications: 7,
                divisions: 1,
                sines: 0,
                functions: 0,
            },
            first: ::tfe::__private::Operations {
                additions: 3,
                multiplications: 6,
                divisions: 0,
                sines: 0,
                functions: 0,
            },
            second: ::tfe::__private::Operations {
                additions: 4,
                multiplications: 7,
                divisions: 0,
                sines: 0,
                functions: 0,
            },
            page: ::core::concat!(
                "H = ½ (px² + py²) + ½ (x² + y²) + λ (x² y − y³/3)\n",
                "coordinates: x, y      momenta: px, py      parameters: λ\n",
                "operations, value: 5 +−, 7 ×, 1 ÷, 0 sin/cos, 0 other\n",
                "operations, gradient: 3 +−, 6 ×, 0 ÷, 0 sin/cos, 0 other\n",
                "operations, gradient and second derivatives: 4 +−, 7 ×, 0 ÷, 0 sin/cos, 0 other\n",
                "declared by             Hamiltonian, 2 coordinates\n",
                "depends on time         no\n", "forces                  no\n",
                "linear                  no\n", "quadratic in p          yes\n",
                "constant H_pp           yes, diagonal\n",
                "separable (H_pq = 0)    yes\n", "smooth                  yes\n",
                "cyclic coordinates      none\n",
                "pattern H_pp            (0,0) (1,1)\n",
                "pattern H_pq            zero\n",
                "pattern H_qq            (0,0) (0,1) (1,0) (1,1)"
            ),
        }
    }
}
