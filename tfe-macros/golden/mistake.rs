struct Oscillator {
    m: f64,
    k: f64,
}
const _: () = {
    use ::tfe::__private as __tfe;
    #[automatically_derived]
    #[allow(clippy::all)]
    impl __tfe::Model<1> for Oscillator {
        const FORM: __tfe::Form = __tfe::Form::Lagrangian;
        const FACTS: __tfe::Facts = __tfe::Facts::UNKNOWN;
        const OBSERVABLES: &'static [&'static str] = &["pull"];
        fn energy_function<__R: __tfe::Real>(
            &self,
            __tfe_t: __R,
            _: &[__R; 1],
            _: &[__R; 1],
        ) -> __R {
            __tfe_t
        }
        fn first<__R: __tfe::Real>(
            &self,
            _: __R,
            _: &[__R; 1],
            _: &[__R; 1],
            _: &mut __tfe::First<__R, 1>,
        ) {}
        fn first_and_mass<__R: __tfe::Real>(
            &self,
            _: __R,
            _: &[__R; 1],
            _: &[__R; 1],
            _: &mut __tfe::First<__R, 1>,
            _: &mut [[__R; 1]; 1],
        ) {}
        fn second<__R: __tfe::Real>(
            &self,
            _: __R,
            _: &[__R; 1],
            _: &[__R; 1],
            _: &mut __tfe::First<__R, 1>,
            _: &mut __tfe::Second<__R, 1>,
        ) {}
        fn coordinate_name(_: usize) -> __tfe::CoordinateName {
            __tfe::CoordinateName::single("")
        }
    }
    #[automatically_derived]
    #[allow(clippy::all)]
    impl __tfe::Controlled<1> for Oscillator
    where
        Self: ::core::marker::Send + ::core::marker::Sync,
    {
        const INPUTS: &'static [&'static str] = &[];
        fn energy_function_with<__R: __tfe::Real>(
            &self,
            _: &[__R; __tfe::MAX_INPUTS],
            __tfe_t: __R,
            _: &[__R; 1],
            _: &[__R; 1],
        ) -> __R {
            __tfe_t
        }
        fn first_with<__R: __tfe::Real>(
            &self,
            _: &[__R; __tfe::MAX_INPUTS],
            _: __R,
            _: &[__R; 1],
            _: &[__R; 1],
            _: &mut __tfe::First<__R, 1>,
        ) {}
        fn first_and_mass_with<__R: __tfe::Real>(
            &self,
            _: &[__R; __tfe::MAX_INPUTS],
            _: __R,
            _: &[__R; 1],
            _: &[__R; 1],
            _: &mut __tfe::First<__R, 1>,
            _: &mut [[__R; 1]; 1],
        ) {}
        fn second_with<__R: __tfe::Real>(
            &self,
            _: &[__R; __tfe::MAX_INPUTS],
            _: __R,
            _: &[__R; 1],
            _: &[__R; 1],
            _: &mut __tfe::First<__R, 1>,
            _: &mut __tfe::Second<__R, 1>,
        ) {}
    }
};
#[automatically_derived]
#[allow(dead_code, missing_docs, clippy::all)]
impl Oscillator {
    fn state(&self, __tfe_q: [f64; 1], _: [f64; 1]) -> ::tfe::__private::State<1> {
        ::tfe::__private::State {
            q: __tfe_q,
            p: __tfe_q,
        }
    }
    fn structure() -> ::tfe::__private::Structure {
        ::tfe::__private::Structure::UNKNOWN
    }
    fn pull(&self, _: f64, _: [f64; 1], _: [f64; 1]) -> f64 {
        0.0
    }
}
#[derive(::core::fmt::Debug)]
#[allow(dead_code, missing_docs)]
struct Fast;
#[automatically_derived]
#[allow(dead_code, missing_docs, clippy::all)]
impl Fast {
    const BYTES: usize = 0;
    fn new(_: &Oscillator, _: f64) -> Self {
        Self
    }
    fn time(&self) -> f64 {
        0.0
    }
    fn set_time(&mut self, _: f64) {}
    fn statistics(&self) -> &::tfe::__private::Statistics {
        &::tfe::__private::Statistics::NONE
    }
    fn advance<const __DOF: usize>(
        &mut self,
        _: &mut ::tfe::__private::State<__DOF>,
    ) -> ::core::result::Result<(), ::tfe::__private::StepError> {
        ::core::result::Result::Ok(())
    }
}
::core::compile_error! {
    "unknown name `kk`\nhelp: did you mean `k`?"
}
