///
/// * `let stretch`:
/// Half of the spring's energy goes to each end.
///
/// # Derived model
/// ```text
/// stretch = x − l
/// L = ½ m ẋ² − ½ k stretch²
/// coordinates: x      parameters: m, k, l
/// operations, value: 2 +−, 5 ×, 0 ÷, 0 sin/cos, 0 other
/// operations, gradient: 1 +−, 2 ×, 0 ÷, 0 sin/cos, 0 other
/// operations, gradient and second derivatives: 1 +−, 2 ×, 0 ÷, 0 sin/cos, 0 other
/// declared by             Lagrangian, 1 coordinate
/// depends on time         no
/// forces                  no
/// linear                  yes
/// quadratic in v          yes
/// constant L_vv           yes, diagonal
/// separable (L_vq = 0)    yes
/// smooth                  yes
/// cyclic coordinates      none
/// pattern L_vv            (0,0)
/// pattern L_vq            zero
/// pattern L_qq            (0,0)
/// ```
struct Spring {
    m: f64,
    k: f64,
    l: f64,
}
const _: () = {
    use ::tfe::__private as __tfe;
    #[automatically_derived]
    #[allow(unused, non_snake_case)]
    impl __tfe::Model<1> for Spring {
        const FORM: __tfe::Form = __tfe::Form::Lagrangian;
        const FACTS: __tfe::Facts = __tfe::Facts {
            time_dependent: false,
            forced: false,
            quadratic_in_z: true,
            constant_mass: true,
            linear: true,
            separable: true,
            smooth: true,
        };
        /// L(q, v, t): 2 +−, 5 ×
        fn energy_function<R: __tfe::Real>(&self, t: R, q: &[R; 1], z: &[R; 1]) -> R {
            let k = t.parameter(1, self.k);
            let l = t.parameter(2, self.l);
            let m = t.parameter(0, self.m);
            let t0 = q[0] - l;
            let t1 = z[0] * z[0];
            let t2 = m * t1;
            let t3 = t0 * t0;
            let t4 = k * t3;
            let t5 = t2 - t4;
            t.like(0.5) * t5
        }
        /// L_v and L_q: 1 +−, 2 ×
        fn first<R: __tfe::Real>(
            &self,
            t: R,
            q: &[R; 1],
            z: &[R; 1],
            first: &mut __tfe::First<R, 1>,
        ) {
            let k = t.parameter(1, self.k);
            let l = t.parameter(2, self.l);
            let m = t.parameter(0, self.m);
            first.z[0] = m * z[0];
            let t0 = l - q[0];
            first.q[0] = k * t0;
        }
        /// L_v and L_q, and L_vv: 1 +−, 2 ×
        fn first_and_mass<R: __tfe::Real>(
            &self,
            t: R,
            q: &[R; 1],
            z: &[R; 1],
            first: &mut __tfe::First<R, 1>,
            zz: &mut [[R; 1]; 1],
        ) {
            let k = t.parameter(1, self.k);
            let l = t.parameter(2, self.l);
            let m = t.parameter(0, self.m);
            zz[0][0] = m;
            first.z[0] = m * z[0];
            let t0 = l - q[0];
            first.q[0] = k * t0;
        }
        /// L_v and L_q, L_vv, L_vq and L_qq: 1 +−, 2 ×
        fn second<R: __tfe::Real>(
            &self,
            t: R,
            q: &[R; 1],
            z: &[R; 1],
            first: &mut __tfe::First<R, 1>,
            second: &mut __tfe::Second<R, 1>,
        ) {
            let k = t.parameter(1, self.k);
            let l = t.parameter(2, self.l);
            let m = t.parameter(0, self.m);
            second.zz[0][0] = m;
            first.z[0] = m * z[0];
            let t0 = l - q[0];
            first.q[0] = k * t0;
            second.qq[0][0] = -k;
        }
        fn observables<R: __tfe::Real>(
            &self,
            t: R,
            q: &[R; 1],
            z: &[R; 1],
            values: &mut [R],
        ) {
            values[0] = -q[0];
        }
        fn coordinate_name(index: usize) -> __tfe::CoordinateName {
            match index {
                0 => __tfe::CoordinateName::single("x"),
                _ => __tfe::CoordinateName::element("", index),
            }
        }
        const OBSERVABLES: &'static [&'static str] = &["height"];
        fn parameters(&self) -> usize {
            3
        }
        fn parameter_name(&self, index: usize) -> __tfe::CoordinateName {
            if index < 1 {
                return __tfe::CoordinateName::single("m");
            }
            if index < 2 {
                return __tfe::CoordinateName::single("k");
            }
            if index < 3 {
                return __tfe::CoordinateName::single("l");
            }
            __tfe::CoordinateName::element("", index)
        }
        fn parameter(&self, index: usize) -> f64 {
            if index < 1 {
                return self.m;
            }
            if index < 2 {
                return self.k;
            }
            if index < 3 {
                return self.l;
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
                made.k = value;
            } else if index < 3 {
                made.l = value;
            } else {
                return ::core::option::Option::None;
            }
            ::core::option::Option::Some(made)
        }
    }
};
#[automatically_derived]
#[allow(dead_code)]
impl Spring {
    /// The state with coordinates `q` and velocities `v` = dq/dt at time zero; its momenta are p = ∂L/∂v.
    ///
    /// Where no momentum belongs to the velocity (a Hamiltonian with singular ∂²H/∂p²) the momenta are NaN, and a run refuses them.
    fn state(&self, q: [f64; 1], v: [f64; 1]) -> ::tfe::__private::State<1> {
        ::tfe::__private::state(self, 0.0, q, v)
    }
    /// What was derived from the declaration: a page when printed.
    fn structure() -> ::tfe::__private::Structure {
        ::tfe::__private::Structure {
            name: "Spring",
            form: ::tfe::__private::Form::Lagrangian,
            facts: ::tfe::__private::Facts {
                time_dependent: false,
                forced: false,
                quadratic_in_z: true,
                constant_mass: true,
                linear: true,
                separable: true,
                smooth: true,
            },
            cyclic: &[],
            conserved: &[],
            diagonal_mass: true,
            value: ::tfe::__private::Operations {
                additions: 2,
                multiplications: 5,
                divisions: 0,
                sines: 0,
                functions: 0,
            },
            first: ::tfe::__private::Operations {
                additions: 1,
                multiplications: 2,
                divisions: 0,
                sines: 0,
                functions: 0,
            },
            second: ::tfe::__private::Operations {
                additions: 1,
                multiplications: 2,
                divisions: 0,
                sines: 0,
                functions: 0,
            },
            page: ::core::concat!(
                "stretch = x − l\n", "L = ½ m x\u{307}² − ½ k stretch²\n",
                "coordinates: x      parameters: m, k, l\n",
                "operations, value: 2 +−, 5 ×, 0 ÷, 0 sin/cos, 0 other\n",
                "operations, gradient: 1 +−, 2 ×, 0 ÷, 0 sin/cos, 0 other\n",
                "operations, gradient and second derivatives: 1 +−, 2 ×, 0 ÷, 0 sin/cos, 0 other\n",
                "declared by             Lagrangian, 1 coordinate\n",
                "depends on time         no\n", "forces                  no\n",
                "linear                  yes\n", "quadratic in v          yes\n",
                "constant L_vv           yes, diagonal\n",
                "separable (L_vq = 0)    yes\n", "smooth                  yes\n",
                "cyclic coordinates      none\n", "pattern L_vv            (0,0)\n",
                "pattern L_vq            zero\n", "pattern L_qq            (0,0)"
            ),
        }
    }
    /// Above the support, in metres.
    ///
    /// The observable `height` at time `t`, coordinates `q` and velocities `v`.
    fn height(&self, t: f64, q: [f64; 1], v: [f64; 1]) -> f64 {
        let mut values = [0.0; 1];
        ::tfe::__private::Model::observables(self, t, &q, &v, &mut values);
        values[0]
    }
}
/// For the controller.
///
/// Steps [`Spring`] with one element, `Mixed::<2>`: no generics, no allocation, tables and sizes constant.
struct Fast {
    model: Spring,
    engine: ::tfe::__private::Specialised<
        1,
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
                1,
                0,
            )
        },
        {
            ::tfe::__private::pivots_len(
                Fast::ELEMENT,
                ::tfe::__private::Form::Lagrangian,
                1,
                0,
            )
        },
    >,
}
#[automatically_derived]
#[allow(dead_code)]
impl Fast {
    const ELEMENT: ::tfe::__private::Element = ::tfe::__private::Element::mixed(2);
    const SIZES: [usize; 7] = ::tfe::__private::sizes::<Spring, 1>(Fast::ELEMENT);
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
    fn new(model: &Spring, h: f64) -> Self {
        Self {
            model: Spring {
                m: model.m,
                k: model.k,
                l: model.l,
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
        state: &mut ::tfe::__private::State<1>,
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
/// Without the spring.
///
/// `Rigid` from [`Spring`]: truncated to degree 2 about `x = l`.
///
/// # Derived model
/// ```text
/// Spring: truncated to degree 2 about x = l
/// L = 0.5 (m ẋ² − k (x − l)²)
/// coordinates: x      parameters: m, k, l
/// operations, value: 2 +−, 5 ×, 0 ÷, 0 sin/cos, 0 other
/// operations, gradient: 1 +−, 2 ×, 0 ÷, 0 sin/cos, 0 other
/// operations, gradient and second derivatives: 1 +−, 2 ×, 0 ÷, 0 sin/cos, 0 other
/// declared by             Lagrangian, 1 coordinate
/// depends on time         no
/// forces                  no
/// linear                  yes
/// quadratic in v          yes
/// constant L_vv           yes, diagonal
/// separable (L_vq = 0)    yes
/// smooth                  yes
/// cyclic coordinates      none
/// pattern L_vv            (0,0)
/// pattern L_vq            zero
/// pattern L_qq            (0,0)
/// ```
struct Rigid {
    m: f64,
    k: f64,
    l: f64,
}
const _: () = {
    use ::tfe::__private as __tfe;
    #[automatically_derived]
    #[allow(unused, non_snake_case)]
    impl __tfe::Model<1> for Rigid {
        const FORM: __tfe::Form = __tfe::Form::Lagrangian;
        const FACTS: __tfe::Facts = __tfe::Facts {
            time_dependent: false,
            forced: false,
            quadratic_in_z: true,
            constant_mass: true,
            linear: true,
            separable: true,
            smooth: true,
        };
        /// L(q, v, t): 2 +−, 5 ×
        fn energy_function<R: __tfe::Real>(&self, t: R, q: &[R; 1], z: &[R; 1]) -> R {
            let k = t.parameter(1, self.k);
            let l = t.parameter(2, self.l);
            let m = t.parameter(0, self.m);
            let t0 = q[0] - l;
            let t1 = z[0] * z[0];
            let t2 = m * t1;
            let t3 = t0 * t0;
            let t4 = k * t3;
            let t5 = t2 - t4;
            t.like(0.5) * t5
        }
        /// L_v and L_q: 1 +−, 2 ×
        fn first<R: __tfe::Real>(
            &self,
            t: R,
            q: &[R; 1],
            z: &[R; 1],
            first: &mut __tfe::First<R, 1>,
        ) {
            let k = t.parameter(1, self.k);
            let l = t.parameter(2, self.l);
            let m = t.parameter(0, self.m);
            first.z[0] = m * z[0];
            let t0 = l - q[0];
            first.q[0] = k * t0;
        }
        /// L_v and L_q, and L_vv: 1 +−, 2 ×
        fn first_and_mass<R: __tfe::Real>(
            &self,
            t: R,
            q: &[R; 1],
            z: &[R; 1],
            first: &mut __tfe::First<R, 1>,
            zz: &mut [[R; 1]; 1],
        ) {
            let k = t.parameter(1, self.k);
            let l = t.parameter(2, self.l);
            let m = t.parameter(0, self.m);
            zz[0][0] = m;
            first.z[0] = m * z[0];
            let t0 = l - q[0];
            first.q[0] = k * t0;
        }
        /// L_v and L_q, L_vv, L_vq and L_qq: 1 +−, 2 ×
        fn second<R: __tfe::Real>(
            &self,
            t: R,
            q: &[R; 1],
            z: &[R; 1],
            first: &mut __tfe::First<R, 1>,
            second: &mut __tfe::Second<R, 1>,
        ) {
            let k = t.parameter(1, self.k);
            let l = t.parameter(2, self.l);
            let m = t.parameter(0, self.m);
            second.zz[0][0] = m;
            first.z[0] = m * z[0];
            let t0 = l - q[0];
            first.q[0] = k * t0;
            second.qq[0][0] = -k;
        }
        fn observables<R: __tfe::Real>(
            &self,
            t: R,
            q: &[R; 1],
            z: &[R; 1],
            values: &mut [R],
        ) {
            values[0] = -q[0];
        }
        fn coordinate_name(index: usize) -> __tfe::CoordinateName {
            match index {
                0 => __tfe::CoordinateName::single("x"),
                _ => __tfe::CoordinateName::element("", index),
            }
        }
        const OBSERVABLES: &'static [&'static str] = &["height"];
        fn parameters(&self) -> usize {
            3
        }
        fn parameter_name(&self, index: usize) -> __tfe::CoordinateName {
            if index < 1 {
                return __tfe::CoordinateName::single("m");
            }
            if index < 2 {
                return __tfe::CoordinateName::single("k");
            }
            if index < 3 {
                return __tfe::CoordinateName::single("l");
            }
            __tfe::CoordinateName::element("", index)
        }
        fn parameter(&self, index: usize) -> f64 {
            if index < 1 {
                return self.m;
            }
            if index < 2 {
                return self.k;
            }
            if index < 3 {
                return self.l;
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
                made.k = value;
            } else if index < 3 {
                made.l = value;
            } else {
                return ::core::option::Option::None;
            }
            ::core::option::Option::Some(made)
        }
    }
};
#[automatically_derived]
#[allow(dead_code)]
impl Rigid {
    /// The state with coordinates `q` and velocities `v` = dq/dt at time zero; its momenta are p = ∂L/∂v.
    ///
    /// Where no momentum belongs to the velocity (a Hamiltonian with singular ∂²H/∂p²) the momenta are NaN, and a run refuses them.
    fn state(&self, q: [f64; 1], v: [f64; 1]) -> ::tfe::__private::State<1> {
        ::tfe::__private::state(self, 0.0, q, v)
    }
    /// What was derived from the declaration: a page when printed.
    fn structure() -> ::tfe::__private::Structure {
        ::tfe::__private::Structure {
            name: "Rigid",
            form: ::tfe::__private::Form::Lagrangian,
            facts: ::tfe::__private::Facts {
                time_dependent: false,
                forced: false,
                quadratic_in_z: true,
                constant_mass: true,
                linear: true,
                separable: true,
                smooth: true,
            },
            cyclic: &[],
            conserved: &[],
            diagonal_mass: true,
            value: ::tfe::__private::Operations {
                additions: 2,
                multiplications: 5,
                divisions: 0,
                sines: 0,
                functions: 0,
            },
            first: ::tfe::__private::Operations {
                additions: 1,
                multiplications: 2,
                divisions: 0,
                sines: 0,
                functions: 0,
            },
            second: ::tfe::__private::Operations {
                additions: 1,
                multiplications: 2,
                divisions: 0,
                sines: 0,
                functions: 0,
            },
            page: ::core::concat!(
                "Spring: truncated to degree 2 about x = l\n",
                "L = 0.5 (m x\u{307}² − k (x − l)²)\n",
                "coordinates: x      parameters: m, k, l\n",
                "operations, value: 2 +−, 5 ×, 0 ÷, 0 sin/cos, 0 other\n",
                "operations, gradient: 1 +−, 2 ×, 0 ÷, 0 sin/cos, 0 other\n",
                "operations, gradient and second derivatives: 1 +−, 2 ×, 0 ÷, 0 sin/cos, 0 other\n",
                "declared by             Lagrangian, 1 coordinate\n",
                "depends on time         no\n", "forces                  no\n",
                "linear                  yes\n", "quadratic in v          yes\n",
                "constant L_vv           yes, diagonal\n",
                "separable (L_vq = 0)    yes\n", "smooth                  yes\n",
                "cyclic coordinates      none\n", "pattern L_vv            (0,0)\n",
                "pattern L_vq            zero\n", "pattern L_qq            (0,0)"
            ),
        }
    }
    /// Above the support, in metres.
    ///
    /// The observable `height` at time `t`, coordinates `q` and velocities `v`.
    fn height(&self, t: f64, q: [f64; 1], v: [f64; 1]) -> f64 {
        let mut values = [0.0; 1];
        ::tfe::__private::Model::observables(self, t, &q, &v, &mut values);
        values[0]
    }
}
#[automatically_derived]
#[allow(dead_code)]
impl Rigid {
    /// The model with the parameters of a [`Spring`].
    fn of(original: &Spring) -> Self {
        Self {
            m: original.m,
            k: original.k,
            l: original.l,
        }
    }
}
