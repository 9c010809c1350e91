/// # Derived model
/// ```text
/// gap = x − r cos θ
/// L = ½ m (ẋ² + r² θ̇²) − m g x − (½ k gap² if gap < 0 else 0)
/// D = ½ c θ̇²
/// coordinates: x, θ      parameters: m, r, g, k, c
/// operations, value: 4 +−, 10 ×, 0 ÷, 1 sin/cos, 1 other
/// operations, gradient: 2 +−, 10 ×, 0 ÷, 1 sin/cos, 2 other
/// operations, gradient and second derivatives: 3 +−, 13 ×, 0 ÷, 1 sin/cos, 5 other
/// declared by             Lagrangian, 2 coordinates
/// depends on time         no
/// forces                  yes
/// linear                  no
/// quadratic in v          yes
/// constant L_vv           yes, diagonal
/// separable (L_vq = 0)    yes
/// smooth                  no
/// cyclic coordinates      none
/// pattern L_vv            (0,0) (1,1)
/// pattern L_vq            zero
/// pattern L_qq            (0,0) (0,1) (1,0) (1,1)
/// pattern Q_v             (1,1)
/// pattern Q_q             zero
/// ```
struct Contact {
    m: f64,
    r: f64,
    g: f64,
    k: f64,
    c: f64,
}
const _: () = {
    use ::tfe::__private as __tfe;
    #[automatically_derived]
    #[allow(unused, non_snake_case)]
    impl __tfe::Model<2> for Contact {
        const FORM: __tfe::Form = __tfe::Form::Lagrangian;
        const FACTS: __tfe::Facts = __tfe::Facts {
            time_dependent: false,
            forced: true,
            quadratic_in_z: true,
            constant_mass: true,
            linear: false,
            separable: true,
            smooth: false,
        };
        const DIAGONAL_MASS: bool = true;
        /// L(q, v, t): 4 +−, 10 ×, 1 sin/cos, 1 other
        fn energy_function<R: __tfe::Real>(&self, t: R, q: &[R; 2], z: &[R; 2]) -> R {
            let g = t.parameter(2, self.g);
            let k = t.parameter(3, self.k);
            let m = t.parameter(0, self.m);
            let r = t.parameter(1, self.r);
            let cos_theta = q[1].cos();
            let t0 = z[0] * z[0];
            let t1 = r * z[1];
            let t2 = r * cos_theta;
            let t3 = t1 * t1;
            let t4 = t0 + t3;
            let t5 = t.like(0.5) * t4;
            let t6 = g * q[0];
            let t7 = t5 - t6;
            let t8 = m * t7;
            let t9 = q[0] - t2;
            let t10 = t9 * t9;
            let t11 = t.like(0.5) * t10;
            let t12 = k * t11;
            let t13 = R::select(t9.less(t.like(0.0)), t12, t.like(0.0));
            t8 - t13
        }
        const LANES: bool = true;
        /// L_v, L_q and Q: 2 +−, 10 ×, 1 sin/cos, 2 other
        #[inline(always)]
        fn first_inline<R: __tfe::Real>(
            &self,
            t: R,
            q: &[R; 2],
            z: &[R; 2],
            first: &mut __tfe::First<R, 2>,
        ) {
            let c = t.parameter(4, self.c);
            let g = t.parameter(2, self.g);
            let k = t.parameter(3, self.k);
            let m = t.parameter(0, self.m);
            let r = t.parameter(1, self.r);
            /// ∂L/∂ẋ, and parts of later results
            let (sin_theta, cos_theta) = q[1].sin_cos();
            first.z[0] = m * z[0];
            /// ∂L/∂θ̇, and parts of later results
            let t0 = g * m;
            let t1 = r * cos_theta;
            let t2 = q[0] - t1;
            let t3 = k * t2;
            let t4 = r * sin_theta;
            let t5 = r * r;
            let t6 = m * t5;
            first.z[1] = z[1] * t6;
            /// ∂L/∂x, ∂L/∂θ, Q_θ
            let t7 = c * z[1];
            let t8 = t4 * t3;
            let t9 = R::select(t2.less(t.like(0.0)), t3, t.like(0.0));
            let t10 = t0 + t9;
            let t11 = R::select(t2.less(t.like(0.0)), t8, t.like(0.0));
            first.q[0] = -t10;
            first.q[1] = -t11;
            first.force[1] = -t7;
        }
        /// L_v, L_q and Q, and L_vv: 2 +−, 10 ×, 1 sin/cos, 2 other
        #[inline(always)]
        fn first_and_mass_inline<R: __tfe::Real>(
            &self,
            t: R,
            q: &[R; 2],
            z: &[R; 2],
            first: &mut __tfe::First<R, 2>,
            zz: &mut [[R; 2]; 2],
        ) {
            let c = t.parameter(4, self.c);
            let g = t.parameter(2, self.g);
            let k = t.parameter(3, self.k);
            let m = t.parameter(0, self.m);
            let r = t.parameter(1, self.r);
            /// ∂L/∂ẋ, ∂²L/∂ẋ², and parts of later results
            let (sin_theta, cos_theta) = q[1].sin_cos();
            zz[0][0] = m;
            first.z[0] = m * z[0];
            /// ∂L/∂θ̇, ∂²L/∂θ̇², and parts of later results
            let t0 = g * m;
            let t1 = m * r;
            let t2 = r * t1;
            zz[1][1] = t2;
            first.z[1] = z[1] * t2;
            /// ∂L/∂x, ∂L/∂θ, Q_θ
            let t3 = c * z[1];
            let t4 = r * cos_theta;
            let t5 = q[0] - t4;
            let t6 = r * sin_theta;
            let t7 = k * t5;
            let t8 = t6 * t7;
            let t9 = R::select(t5.less(t.like(0.0)), t7, t.like(0.0));
            let t10 = t0 + t9;
            let t11 = R::select(t5.less(t.like(0.0)), t8, t.like(0.0));
            first.q[0] = -t10;
            first.q[1] = -t11;
            first.force[1] = -t3;
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
        /// L_v, L_q and Q, L_vv, L_vq, L_qq, Q_v and Q_q: 3 +−, 13 ×, 1 sin/cos, 5 other
        fn second<R: __tfe::Real>(
            &self,
            t: R,
            q: &[R; 2],
            z: &[R; 2],
            first: &mut __tfe::First<R, 2>,
            second: &mut __tfe::Second<R, 2>,
        ) {
            let c = t.parameter(4, self.c);
            let g = t.parameter(2, self.g);
            let k = t.parameter(3, self.k);
            let m = t.parameter(0, self.m);
            let r = t.parameter(1, self.r);
            /// ∂L/∂ẋ, ∂²L/∂ẋ², and parts of later results
            let (sin_theta, cos_theta) = q[1].sin_cos();
            second.zz[0][0] = m;
            first.z[0] = m * z[0];
            /// ∂L/∂θ̇, ∂²L/∂θ̇², and parts of later results
            let t0 = g * m;
            let t1 = m * r;
            let t2 = r * t1;
            second.zz[1][1] = t2;
            first.z[1] = z[1] * t2;
            /// Q_θ, ∂Q_θ/∂θ̇, and parts of later results
            let t3 = r * cos_theta;
            let t4 = r * sin_theta;
            let t5 = q[0] - t3;
            let t6 = c * z[1];
            first.force[1] = -t6;
            second.force_z[1][1] = -c;
            /// ∂L/∂x, and parts of later results
            let t7 = k * t5;
            let t8 = t3 * t7;
            let t9 = R::select(t5.less(t.like(0.0)), t7, t.like(0.0));
            let t10 = t0 + t9;
            first.q[0] = -t10;
            /// ∂L/∂θ
            let t11 = t4 * t7;
            let t12 = R::select(t5.less(t.like(0.0)), t11, t.like(0.0));
            first.q[1] = -t12;
            /// ∂²L/∂x²
            let t13 = R::select(t5.less(t.like(0.0)), k, t.like(0.0));
            second.qq[0][0] = -t13;
            /// ∂²L/∂x∂θ, ∂²L/∂θ²
            let t14 = k * t4;
            let t15 = t4 * t14;
            let t16 = t8 + t15;
            let t17 = R::select(t5.less(t.like(0.0)), t14, t.like(0.0));
            let t18 = R::select(t5.less(t.like(0.0)), t16, t.like(0.0));
            let t19 = -t17;
            second.qq[0][1] = t19;
            second.qq[1][0] = t19;
            second.qq[1][1] = -t18;
        }
        fn observables<R: __tfe::Real>(
            &self,
            t: R,
            q: &[R; 2],
            z: &[R; 2],
            values: &mut [R],
        ) {
            let r = t.parameter(1, self.r);
            let cos_theta = q[1].cos();
            let t0 = r * cos_theta;
            values[0] = q[0] - t0;
            let t1 = r * z[1];
            let t2 = z[0] * z[0];
            let t3 = t1 * t1;
            let t4 = t2 + t3;
            values[1] = t4.sqrt();
        }
        fn coordinate_name(index: usize) -> __tfe::CoordinateName {
            match index {
                0 => __tfe::CoordinateName::single("x"),
                1 => __tfe::CoordinateName::single("theta"),
                _ => __tfe::CoordinateName::element("", index),
            }
        }
        const OBSERVABLES: &'static [&'static str] = &["height", "speed"];
        fn parameters(&self) -> usize {
            5
        }
        fn parameter_name(&self, index: usize) -> __tfe::CoordinateName {
            if index < 1 {
                return __tfe::CoordinateName::single("m");
            }
            if index < 2 {
                return __tfe::CoordinateName::single("r");
            }
            if index < 3 {
                return __tfe::CoordinateName::single("g");
            }
            if index < 4 {
                return __tfe::CoordinateName::single("k");
            }
            if index < 5 {
                return __tfe::CoordinateName::single("c");
            }
            __tfe::CoordinateName::element("", index)
        }
        fn parameter(&self, index: usize) -> f64 {
            if index < 1 {
                return self.m;
            }
            if index < 2 {
                return self.r;
            }
            if index < 3 {
                return self.g;
            }
            if index < 4 {
                return self.k;
            }
            if index < 5 {
                return self.c;
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
                made.r = value;
            } else if index < 3 {
                made.g = value;
            } else if index < 4 {
                made.k = value;
            } else if index < 5 {
                made.c = value;
            } else {
                return ::core::option::Option::None;
            }
            ::core::option::Option::Some(made)
        }
    }
};
#[automatically_derived]
#[allow(dead_code)]
impl Contact {
    /// The state with coordinates `q` and velocities `v` = dq/dt at time zero; its momenta are p = ∂L/∂v.
    ///
    /// Where no momentum belongs to the velocity (a Hamiltonian with singular ∂²H/∂p²) the momenta are NaN, and a run refuses them.
    fn state(&self, q: [f64; 2], v: [f64; 2]) -> ::tfe::__private::State<2> {
        ::tfe::__private::state(self, 0.0, q, v)
    }
    /// What was derived from the declaration: a page when printed.
    fn structure() -> ::tfe::__private::Structure {
        ::tfe::__private::Structure {
            name: "Contact",
            form: ::tfe::__private::Form::Lagrangian,
            facts: ::tfe::__private::Facts {
                time_dependent: false,
                forced: true,
                quadratic_in_z: true,
                constant_mass: true,
                linear: false,
                separable: true,
                smooth: false,
            },
            cyclic: &[],
            conserved: &[],
            diagonal_mass: true,
            value: ::tfe::__private::Operations {
                additions: 4,
                multiplications: 10,
                divisions: 0,
                sines: 1,
                functions: 1,
            },
            first: ::tfe::__private::Operations {
                additions: 2,
                multiplications: 10,
                divisions: 0,
                sines: 1,
                functions: 2,
            },
            second: ::tfe::__private::Operations {
                additions: 3,
                multiplications: 13,
                divisions: 0,
                sines: 1,
                functions: 5,
            },
            page: ::core::concat!(
                "gap = x − r cos θ\n",
                "L = ½ m (x\u{307}² + r² θ\u{307}²) − m g x − (½ k gap² if gap < 0 else 0)\n",
                "D = ½ c θ\u{307}²\n",
                "coordinates: x, θ      parameters: m, r, g, k, c\n",
                "operations, value: 4 +−, 10 ×, 0 ÷, 1 sin/cos, 1 other\n",
                "operations, gradient: 2 +−, 10 ×, 0 ÷, 1 sin/cos, 2 other\n",
                "operations, gradient and second derivatives: 3 +−, 13 ×, 0 ÷, 1 sin/cos, 5 other\n",
                "declared by             Lagrangian, 2 coordinates\n",
                "depends on time         no\n", "forces                  yes\n",
                "linear                  no\n", "quadratic in v          yes\n",
                "constant L_vv           yes, diagonal\n",
                "separable (L_vq = 0)    yes\n", "smooth                  no\n",
                "cyclic coordinates      none\n",
                "pattern L_vv            (0,0) (1,1)\n",
                "pattern L_vq            zero\n",
                "pattern L_qq            (0,0) (0,1) (1,0) (1,1)\n",
                "pattern Q_v             (1,1)\n", "pattern Q_q             zero"
            ),
        }
    }
    /// The observable `height` at time `t`, coordinates `q` and velocities `v`.
    fn height(&self, t: f64, q: [f64; 2], v: [f64; 2]) -> f64 {
        let mut values = [0.0; 2];
        ::tfe::__private::Model::observables(self, t, &q, &v, &mut values);
        values[0]
    }
    /// The observable `speed` at time `t`, coordinates `q` and velocities `v`.
    fn speed(&self, t: f64, q: [f64; 2], v: [f64; 2]) -> f64 {
        let mut values = [0.0; 2];
        ::tfe::__private::Model::observables(self, t, &q, &v, &mut values);
        values[1]
    }
}
/// Steps [`Contact`] with one element, `Primal::<3>.reduced()`: no generics, no allocation, tables and sizes constant.
struct Fast {
    model: Contact,
    engine: ::tfe::__private::Specialised<
        2,
        ::tfe::__private::Inline<
            { Fast::SIZES[0usize] },
            { Fast::SIZES[1usize] },
            { Fast::SIZES[2usize] },
            { Fast::SIZES[3usize] },
            { Fast::SIZES[4usize] },
            { Fast::SIZES[5usize] },
            { Fast::SIZES[6usize] },
        >,
        {
            ::tfe::__private::numbers_len(
                Fast::ELEMENT,
                ::tfe::__private::Form::Lagrangian,
                2,
                0,
            )
        },
        {
            ::tfe::__private::pivots_len(
                Fast::ELEMENT,
                ::tfe::__private::Form::Lagrangian,
                2,
                0,
            )
        },
    >,
}
#[automatically_derived]
#[allow(dead_code)]
impl Fast {
    const ELEMENT: ::tfe::__private::Element = ::tfe::__private::Element::primal(3)
        .reduced();
    const SIZES: [usize; 7] = ::tfe::__private::sizes::<Contact, 2>(Fast::ELEMENT);
    const SCHEME: ::tfe::__private::Scheme<
        { Fast::ELEMENT.points() },
        { Fast::ELEMENT.unknowns() },
    > = ::tfe::__private::Scheme::new(Fast::ELEMENT);
    const TABLES: ::tfe::__private::Fixed<
        ::tfe::__private::Inline<
            { Fast::SIZES[0usize] },
            { Fast::SIZES[1usize] },
            { Fast::SIZES[2usize] },
            { Fast::SIZES[3usize] },
            { Fast::SIZES[4usize] },
            { Fast::SIZES[5usize] },
            { Fast::SIZES[6usize] },
        >,
    > = ::tfe::__private::Fixed::new(&Self::SCHEME);
    /// The size of the stepper, all its memory included.
    const BYTES: usize = ::core::mem::size_of::<Self>();
    /// A stepper of length `h` that begins at time zero. It keeps a copy of the parameters.
    fn new(model: &Contact, h: f64) -> Self {
        Self {
            model: Contact {
                m: model.m,
                r: model.r,
                g: model.g,
                k: model.k,
                c: model.c,
            },
            engine: ::tfe::__private::Specialised::new(model, &Self::TABLES, h),
        }
    }
    /// The time of the next step's start.
    fn time(&self) -> f64 {
        self.engine.time()
    }
    /// Makes the next step start at `time`.
    fn set_time(&mut self, time: f64) {
        self.engine.set_time(time);
    }
    /// What the steps so far have cost.
    fn statistics(&self) -> &::tfe::__private::Statistics {
        self.engine.statistics()
    }
    /// Moves `state` over one element.
    ///
    /// # Errors
    /// Says why the element could not be solved; `state` is unchanged then.
    fn advance(
        &mut self,
        state: &mut ::tfe::__private::State<2>,
    ) -> ::core::result::Result<(), ::tfe::__private::StepError> {
        self.engine.advance(&self.model, &Self::SCHEME, state)
    }
}
#[automatically_derived]
impl ::core::fmt::Debug for Fast {
    fn fmt(&self, f: &mut ::core::fmt::Formatter<'_>) -> ::core::fmt::Result {
        f.debug_struct("Fast")
            .field("time", &self.engine.time())
            .field("step", &self.engine.step())
            .field("statistics", self.engine.statistics())
            .finish_non_exhaustive()
    }
}
