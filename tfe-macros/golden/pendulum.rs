/// A mathematical pendulum.
///
/// # Derived model
/// ```text
/// L = ½ m l² θ̇² + m g l cos θ
/// coordinates: θ      parameters: m, l, g
/// operations, value: 1 +−, 6 ×, 0 ÷, 1 sin/cos, 0 other
/// operations, gradient: 0 +−, 5 ×, 0 ÷, 1 sin/cos, 0 other
/// operations, gradient and second derivatives: 0 +−, 6 ×, 0 ÷, 1 sin/cos, 0 other
/// declared by             Lagrangian, 1 coordinate
/// depends on time         no
/// forces                  no
/// linear                  no
/// quadratic in v          yes
/// constant L_vv           yes, diagonal
/// separable (L_vq = 0)    yes
/// smooth                  yes
/// cyclic coordinates      none
/// pattern L_vv            (0,0)
/// pattern L_vq            zero
/// pattern L_qq            (0,0)
/// ```
pub struct Pendulum {
    /// Mass.
    pub m: f64,
    /// Length.
    pub l: f64,
    /// Acceleration of gravity.
    pub g: f64,
}
const _: () = {
    use ::tfe::__private as __tfe;
    #[automatically_derived]
    #[allow(unused, non_snake_case)]
    impl __tfe::Model<1> for Pendulum {
        const FORM: __tfe::Form = __tfe::Form::Lagrangian;
        const FACTS: __tfe::Facts = __tfe::Facts {
            time_dependent: false,
            forced: false,
            quadratic_in_z: true,
            constant_mass: true,
            linear: false,
            separable: true,
            smooth: true,
        };
        /// L(q, v, t): 1 +−, 6 ×, 1 sin/cos
        fn energy_function<R: __tfe::Real>(&self, t: R, q: &[R; 1], z: &[R; 1]) -> R {
            let g = t.parameter(2, self.g);
            let l = t.parameter(1, self.l);
            let m = t.parameter(0, self.m);
            let cos_theta = q[0].cos();
            let t0 = g * cos_theta;
            let t1 = l * m;
            let t2 = t.like(0.5) * l;
            let t3 = z[0] * z[0];
            let t4 = t2 * t3;
            let t5 = t0 + t4;
            t1 * t5
        }
        const LANES: bool = true;
        /// L_v and L_q: 5 ×, 1 sin/cos
        #[inline(always)]
        fn first_inline<R: __tfe::Real>(
            &self,
            t: R,
            q: &[R; 1],
            z: &[R; 1],
            first: &mut __tfe::First<R, 1>,
        ) {
            let g = t.parameter(2, self.g);
            let l = t.parameter(1, self.l);
            let m = t.parameter(0, self.m);
            /// ∂L/∂θ̇, and parts of later results
            let sin_theta = q[0].sin();
            let t0 = g * sin_theta;
            let t1 = l * m;
            let t2 = l * z[0];
            first.z[0] = t1 * t2;
            /// ∂L/∂θ
            let t3 = t1 * t0;
            first.q[0] = -t3;
        }
        /// L_v and L_q, and L_vv: 5 ×, 1 sin/cos
        #[inline(always)]
        fn first_and_mass_inline<R: __tfe::Real>(
            &self,
            t: R,
            q: &[R; 1],
            z: &[R; 1],
            first: &mut __tfe::First<R, 1>,
            zz: &mut [[R; 1]; 1],
        ) {
            let g = t.parameter(2, self.g);
            let l = t.parameter(1, self.l);
            let m = t.parameter(0, self.m);
            /// ∂L/∂θ̇, ∂²L/∂θ̇², and parts of later results
            let sin_theta = q[0].sin();
            let t0 = g * sin_theta;
            let t1 = l * m;
            let t2 = l * t1;
            zz[0][0] = t2;
            first.z[0] = z[0] * t2;
            /// ∂L/∂θ
            let t3 = t1 * t0;
            first.q[0] = -t3;
        }
        fn first<R: __tfe::Real>(
            &self,
            t: R,
            q: &[R; 1],
            z: &[R; 1],
            first: &mut __tfe::First<R, 1>,
        ) {
            __tfe::Model::first_inline(self, t, q, z, first);
        }
        fn first_and_mass<R: __tfe::Real>(
            &self,
            t: R,
            q: &[R; 1],
            z: &[R; 1],
            first: &mut __tfe::First<R, 1>,
            zz: &mut [[R; 1]; 1],
        ) {
            __tfe::Model::first_and_mass_inline(self, t, q, z, first, zz);
        }
        /// L_v and L_q, L_vv, L_vq and L_qq: 6 ×, 1 sin/cos
        fn second<R: __tfe::Real>(
            &self,
            t: R,
            q: &[R; 1],
            z: &[R; 1],
            first: &mut __tfe::First<R, 1>,
            second: &mut __tfe::Second<R, 1>,
        ) {
            let g = t.parameter(2, self.g);
            let l = t.parameter(1, self.l);
            let m = t.parameter(0, self.m);
            /// ∂L/∂θ̇, ∂²L/∂θ̇², and parts of later results
            let (sin_theta, cos_theta) = q[0].sin_cos();
            let t0 = l * m;
            let t1 = l * t0;
            second.zz[0][0] = t1;
            first.z[0] = z[0] * t1;
            /// ∂L/∂θ, ∂²L/∂θ²
            let t2 = g * t0;
            let t3 = sin_theta * t2;
            let t4 = cos_theta * t2;
            first.q[0] = -t3;
            second.qq[0][0] = -t4;
        }
        fn coordinate_name(index: usize) -> __tfe::CoordinateName {
            match index {
                0 => __tfe::CoordinateName::single("theta"),
                _ => __tfe::CoordinateName::element("", index),
            }
        }
        fn parameters(&self) -> usize {
            3
        }
        fn parameter_name(&self, index: usize) -> __tfe::CoordinateName {
            if index < 1 {
                return __tfe::CoordinateName::single("m");
            }
            if index < 2 {
                return __tfe::CoordinateName::single("l");
            }
            if index < 3 {
                return __tfe::CoordinateName::single("g");
            }
            __tfe::CoordinateName::element("", index)
        }
        fn parameter(&self, index: usize) -> f64 {
            if index < 1 {
                return self.m;
            }
            if index < 2 {
                return self.l;
            }
            if index < 3 {
                return self.g;
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
                made.m = value;
            } else if index < 2 {
                made.l = value;
            } else if index < 3 {
                made.g = value;
            } else {
                return ::core::option::Option::None;
            }
            ::core::option::Option::Some(made)
        }
    }
};
#[automatically_derived]
#[allow(dead_code)]
impl Pendulum {
    /// The state with coordinates `q` and velocities `v` = dq/dt at time zero; its momenta are p = ∂L/∂v.
    ///
    /// Where no momentum belongs to the velocity (a Hamiltonian with singular ∂²H/∂p²) the momenta are NaN, and a run refuses them.
    pub fn state(&self, q: [f64; 1], v: [f64; 1]) -> ::tfe::__private::State<1> {
        ::tfe::__private::state(self, 0.0, q, v)
    }
    /// What was derived from the declaration: a page when printed.
    pub fn structure() -> ::tfe::__private::Structure {
        ::tfe::__private::Structure {
            name: "Pendulum",
            form: ::tfe::__private::Form::Lagrangian,
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
                additions: 1,
                multiplications: 6,
                divisions: 0,
                sines: 1,
                functions: 0,
            },
            first: ::tfe::__private::Operations {
                additions: 0,
                multiplications: 5,
                divisions: 0,
                sines: 1,
                functions: 0,
            },
            second: ::tfe::__private::Operations {
                additions: 0,
                multiplications: 6,
                divisions: 0,
                sines: 1,
                functions: 0,
            },
            page: ::core::concat!(
                "L = ½ m l² θ\u{307}² + m g l cos θ\n",
                "coordinates: θ      parameters: m, l, g\n",
                "operations, value: 1 +−, 6 ×, 0 ÷, 1 sin/cos, 0 other\n",
                "operations, gradient: 0 +−, 5 ×, 0 ÷, 1 sin/cos, 0 other\n",
                "operations, gradient and second derivatives: 0 +−, 6 ×, 0 ÷, 1 sin/cos, 0 other\n",
                "declared by             Lagrangian, 1 coordinate\n",
                "depends on time         no\n", "forces                  no\n",
                "linear                  no\n", "quadratic in v          yes\n",
                "constant L_vv           yes, diagonal\n",
                "separable (L_vq = 0)    yes\n", "smooth                  yes\n",
                "cyclic coordinates      none\n", "pattern L_vv            (0,0)\n",
                "pattern L_vq            zero\n", "pattern L_qq            (0,0)"
            ),
        }
    }
}
