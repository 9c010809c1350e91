/// # Derived model
/// ```text
/// L = ½ m (ẋ² + ẏ²) + ½ j φ̇² + m g sin(α) x
/// 0 = ẋ sin φ − ẏ cos φ      (blade)
/// coordinates: x, y, φ      parameters: m, j, g, α
/// operations, value: 3 +−, 9 ×, 0 ÷, 1 sin/cos, 0 other
/// operations, gradient: 0 +−, 5 ×, 0 ÷, 1 sin/cos, 0 other
/// operations, gradient and second derivatives: 0 +−, 5 ×, 0 ÷, 1 sin/cos, 0 other
/// declared by             Lagrangian, 3 coordinates
/// depends on time         no
/// forces                  no
/// linear                  no
/// quadratic in v          yes
/// constant L_vv           yes, diagonal
/// separable (L_vq = 0)    yes
/// smooth                  yes
/// cyclic coordinates      q[2]
/// conserved momenta       p[2]
/// pattern L_vv            (0,0) (1,1) (2,2)
/// pattern L_vq            zero
/// pattern L_qq            zero
/// constraints             blade (velocity)
/// ```
struct KnifeEdge {
    m: f64,
    j: f64,
    g: f64,
    alpha: f64,
}
const _: () = {
    use ::tfe::__private as __tfe;
    #[automatically_derived]
    #[allow(unused, non_snake_case)]
    impl __tfe::Model<3> for KnifeEdge {
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
        const DIAGONAL_MASS: bool = true;
        /// L(q, v, t): 3 +−, 9 ×, 1 sin/cos
        fn energy_function<R: __tfe::Real>(&self, t: R, q: &[R; 3], z: &[R; 3]) -> R {
            let alpha = t.parameter(3, self.alpha);
            let g = t.parameter(2, self.g);
            let j = t.parameter(1, self.j);
            let m = t.parameter(0, self.m);
            let t0 = alpha.sin();
            let t1 = z[2] * z[2];
            let t2 = j * t1;
            let t3 = z[0] * z[0];
            let t4 = z[1] * z[1];
            let t5 = t3 + t4;
            let t6 = m * t5;
            let t7 = t2 + t6;
            let t8 = m * q[0];
            let t9 = g * t8;
            let t10 = t0 * t9;
            let t11 = t.like(0.5) * t7;
            t11 + t10
        }
        /// L_v and L_q: 5 ×, 1 sin/cos
        fn first<R: __tfe::Real>(
            &self,
            t: R,
            q: &[R; 3],
            z: &[R; 3],
            first: &mut __tfe::First<R, 3>,
        ) {
            let alpha = t.parameter(3, self.alpha);
            let g = t.parameter(2, self.g);
            let j = t.parameter(1, self.j);
            let m = t.parameter(0, self.m);
            /// ∂L/∂ẋ, ∂L/∂ẏ, ∂L/∂φ̇, and parts of later results
            let t0 = alpha.sin();
            first.z[2] = j * z[2];
            first.z[0] = m * z[0];
            first.z[1] = m * z[1];
            /// ∂L/∂x
            let t1 = g * m;
            first.q[0] = t0 * t1;
        }
        /// L_v and L_q, and L_vv: 5 ×, 1 sin/cos
        fn first_and_mass<R: __tfe::Real>(
            &self,
            t: R,
            q: &[R; 3],
            z: &[R; 3],
            first: &mut __tfe::First<R, 3>,
            zz: &mut [[R; 3]; 3],
        ) {
            let alpha = t.parameter(3, self.alpha);
            let g = t.parameter(2, self.g);
            let j = t.parameter(1, self.j);
            let m = t.parameter(0, self.m);
            /// L_v, L_vv, and parts of later results
            let t0 = alpha.sin();
            zz[0][0] = m;
            zz[1][1] = m;
            zz[2][2] = j;
            first.z[2] = j * z[2];
            first.z[0] = m * z[0];
            first.z[1] = m * z[1];
            /// ∂L/∂x
            let t1 = g * m;
            first.q[0] = t0 * t1;
        }
        /// L_v and L_q, L_vv, L_vq and L_qq: 5 ×, 1 sin/cos
        fn second<R: __tfe::Real>(
            &self,
            t: R,
            q: &[R; 3],
            z: &[R; 3],
            first: &mut __tfe::First<R, 3>,
            second: &mut __tfe::Second<R, 3>,
        ) {
            let alpha = t.parameter(3, self.alpha);
            let g = t.parameter(2, self.g);
            let j = t.parameter(1, self.j);
            let m = t.parameter(0, self.m);
            /// L_v, L_vv, and parts of later results
            let t0 = alpha.sin();
            second.zz[0][0] = m;
            second.zz[1][1] = m;
            second.zz[2][2] = j;
            first.z[2] = j * z[2];
            first.z[0] = m * z[0];
            first.z[1] = m * z[1];
            /// ∂L/∂x
            let t1 = g * m;
            first.q[0] = t0 * t1;
        }
        fn coordinate_name(index: usize) -> __tfe::CoordinateName {
            match index {
                0 => __tfe::CoordinateName::single("x"),
                1 => __tfe::CoordinateName::single("y"),
                2 => __tfe::CoordinateName::single("phi"),
                _ => __tfe::CoordinateName::element("", index),
            }
        }
        const CONSTRAINTS: &'static [__tfe::Constraint] = &[
            __tfe::Constraint {
                name: "blade",
                kind: __tfe::ConstraintKind::Velocity {
                    integrable: false,
                },
            },
        ];
        /// A and a of ψ = A v + a: 1 sin/cos
        fn constraint_rows<R: __tfe::Real>(
            &self,
            t: R,
            q: &[R; 3],
            rows: &mut [[R; 3]],
            drift: &mut [R],
        ) {
            let ::core::option::Option::Some(rows) = rows.first_chunk_mut::<1>() else {
                return;
            };
            let (sin_phi, cos_phi) = q[2].sin_cos();
            rows[0][0] = sin_phi;
            rows[0][1] = -cos_phi;
        }
        /// ∂ψ/∂q, Ȧ, ∂(Aᵀμ)/∂q, ∂(Ȧᵀμ)/∂q and ∂(Ȧᵀμ)/∂v: 1 +−, 8 ×, 1 sin/cos
        fn constraint_second<R: __tfe::Real>(
            &self,
            t: R,
            q: &[R; 3],
            v: &[R; 3],
            mu: &[R],
            second: &mut __tfe::ConstraintSecond<'_, R, 3>,
        ) {
            let ::core::option::Option::Some(mu) = mu.first_chunk::<1>() else {
                return;
            };
            let ::core::option::Option::Some(psi_q) = second.psi_q.first_chunk_mut::<1>()
            else {
                return;
            };
            let ::core::option::Option::Some(row_rates) = second
                .row_rates
                .first_chunk_mut::<1>() else {
                return;
            };
            /// ∂ψ/∂q
            let (sin_phi, cos_phi) = q[2].sin_cos();
            let t0 = v[0] * cos_phi;
            let t1 = v[1] * sin_phi;
            psi_q[0][2] = t0 + t1;
            /// Ȧ
            let t2 = v[2] * cos_phi;
            row_rates[0][0] = t2;
            /// Ȧ
            let t3 = v[2] * sin_phi;
            row_rates[0][1] = t3;
            /// ∂(Aᵀμ)/∂q, ∂(Ȧᵀμ)/∂v
            let t4 = mu[0] * cos_phi;
            second.bend[0][2] = t4;
            second.rate_v[0][2] = t4;
            /// ∂(Aᵀμ)/∂q, ∂(Ȧᵀμ)/∂v
            let t5 = mu[0] * sin_phi;
            second.bend[1][2] = t5;
            second.rate_v[1][2] = t5;
            /// ∂(Ȧᵀμ)/∂q
            let t6 = mu[0] * t3;
            second.rate_q[1][2] = mu[0] * t2;
            second.rate_q[0][2] = -t6;
        }
        fn parameters(&self) -> usize {
            4
        }
        fn parameter_name(&self, index: usize) -> __tfe::CoordinateName {
            if index < 1 {
                return __tfe::CoordinateName::single("m");
            }
            if index < 2 {
                return __tfe::CoordinateName::single("j");
            }
            if index < 3 {
                return __tfe::CoordinateName::single("g");
            }
            if index < 4 {
                return __tfe::CoordinateName::single("alpha");
            }
            __tfe::CoordinateName::element("", index)
        }
        fn parameter(&self, index: usize) -> f64 {
            if index < 1 {
                return self.m;
            }
            if index < 2 {
                return self.j;
            }
            if index < 3 {
                return self.g;
            }
            if index < 4 {
                return self.alpha;
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
                made.j = value;
            } else if index < 3 {
                made.g = value;
            } else if index < 4 {
                made.alpha = value;
            } else {
                return ::core::option::Option::None;
            }
            ::core::option::Option::Some(made)
        }
    }
};
#[automatically_derived]
#[allow(dead_code)]
impl KnifeEdge {
    /// The state with coordinates `q` and velocities `v` = dq/dt at time zero; its momenta are p = ∂L/∂v.
    ///
    /// Where no momentum belongs to the velocity (a Hamiltonian with singular ∂²H/∂p²) the momenta are NaN, and a run refuses them.
    fn state(&self, q: [f64; 3], v: [f64; 3]) -> ::tfe::__private::State<3> {
        ::tfe::__private::state(self, 0.0, q, v)
    }
    /// What was derived from the declaration: a page when printed.
    fn structure() -> ::tfe::__private::Structure {
        ::tfe::__private::Structure {
            name: "KnifeEdge",
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
            cyclic: &["phi"],
            conserved: &["phi"],
            diagonal_mass: true,
            value: ::tfe::__private::Operations {
                additions: 3,
                multiplications: 9,
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
                multiplications: 5,
                divisions: 0,
                sines: 1,
                functions: 0,
            },
            page: ::core::concat!(
                "L = ½ m (x\u{307}² + y\u{307}²) + ½ j φ\u{307}² + m g sin(α) x\n",
                "0 = x\u{307} sin φ − y\u{307} cos φ      (blade)\n",
                "coordinates: x, y, φ      parameters: m, j, g, α\n",
                "operations, value: 3 +−, 9 ×, 0 ÷, 1 sin/cos, 0 other\n",
                "operations, gradient: 0 +−, 5 ×, 0 ÷, 1 sin/cos, 0 other\n",
                "operations, gradient and second derivatives: 0 +−, 5 ×, 0 ÷, 1 sin/cos, 0 other\n",
                "declared by             Lagrangian, 3 coordinates\n",
                "depends on time         no\n", "forces                  no\n",
                "linear                  no\n", "quadratic in v          yes\n",
                "constant L_vv           yes, diagonal\n",
                "separable (L_vq = 0)    yes\n", "smooth                  yes\n",
                "cyclic coordinates      q[2]\n", "conserved momenta       p[2]\n",
                "pattern L_vv            (0,0) (1,1) (2,2)\n",
                "pattern L_vq            zero\n", "pattern L_qq            zero\n",
                "constraints             blade (velocity)"
            ),
        }
    }
}
/// Steps [`KnifeEdge`] with one element, `Mixed::<3>`: no generics, no allocation, tables and sizes constant.
struct Fast {
    model: KnifeEdge,
    engine: ::tfe::__private::Specialised<
        3,
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
                3,
                1,
            )
        },
        {
            ::tfe::__private::pivots_len(
                Fast::ELEMENT,
                ::tfe::__private::Form::Lagrangian,
                3,
                1,
            )
        },
    >,
}
#[automatically_derived]
#[allow(dead_code)]
impl Fast {
    const ELEMENT: ::tfe::__private::Element = ::tfe::__private::Element::mixed(3);
    const SIZES: [usize; 7] = ::tfe::__private::sizes::<KnifeEdge, 3>(Fast::ELEMENT);
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
    fn new(model: &KnifeEdge, h: f64) -> Self {
        Self {
            model: KnifeEdge {
                m: model.m,
                j: model.j,
                g: model.g,
                alpha: model.alpha,
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
        state: &mut ::tfe::__private::State<3>,
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
