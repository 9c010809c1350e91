//! A suspended stepper: its memory without the model.

use super::carried::Carried;
use super::common::{Common, Shape};
use super::setup::Stepper;
use crate::consistency::ModelError;
use crate::element::Element;
use crate::model::{First, Model, Second, State};
use crate::newton::Control;
use crate::scheme::{SchemeTable, Tables};
use crate::share::Share;
use crate::statistics::Statistics;
use alloc::vec::Vec;

/// Everything that a stepper carries from step to step, without its model: after [`Stepper::resume`] the next step is
/// the same to the last bit.
#[derive(Clone, Debug)]
pub struct Suspended<const N: usize> {
    element: Element,
    /// Time and state at the end of the last step.
    place: (f64, State<N>),
    /// The bits by which the model is recognised.
    tokens: Vec<u64>,
    carried: Carried<N>,
}

/// The bits that distinguish a model from others of its type: its parameters, and what its kernels read besides. If
/// there are none, as for kernels written by hand, these are the bits of its derivatives at one place, which for a
/// linear model determine it.
fn tokens<M, const N: usize>(model: &M, (t, place): &(f64, State<N>)) -> Vec<u64>
where
    M: Model<N>,
{
    let mut all = Vec::new();
    for index in 0..model.parameters() {
        all.push(model.parameter(index).to_bits());
    }
    model.unnumbered(&mut |value| all.push(value));
    // Input functions, which models of this kind may have, are not called again.
    if !all.is_empty() || M::FACTS.time_dependent {
        return all;
    }
    let (mut first, mut second) = (First::ZERO, Second::ZERO);
    model.second(*t, &place.q, &place.p, &mut first, &mut second);
    bits_of(&first, &second)
}

/// The bits of first and second derivatives.
fn bits_of<const N: usize>(first: &First<f64, N>, second: &Second<f64, N>) -> Vec<u64> {
    let Second {
        zz,
        zq,
        qq,
        force_z,
        force_q,
    } = second;
    let matrices = [zz, zq, qq, force_z, force_q].into_iter().flatten();
    let rows = [&first.z, &first.q, &first.force].into_iter();
    let numbers = rows.chain(matrices).flatten();
    // All NaNs count as equal.
    let bits = |number: &f64| match number.is_nan() {
        true => f64::NAN.to_bits(),
        false => number.to_bits(),
    };
    numbers.map(bits).collect()
}

impl<const N: usize> Suspended<N> {
    fn of(common: Common<N>, place: (f64, State<N>), tokens: Vec<u64>) -> Self {
        Self {
            element: common.table.element(),
            place,
            tokens,
            carried: common.carried,
        }
    }

    /// The stepper, but for its model, with all counts zero.
    fn resumed(self, shape: Shape, control: Control) -> Result<Common<N>, ModelError> {
        let mut carried = self.carried;
        carried.memory.statistics = Statistics::NONE;
        let table = SchemeTable::new(self.element)?;
        Ok(Common::new(shape, table, control, carried))
    }

    /// The element of the stepper.
    #[must_use]
    pub fn element(&self) -> Element {
        self.element
    }

    /// Whether the stepper had this model: one with the same parameters or, where none are numbered, with the same
    /// derivatives at the place where it ended.
    #[must_use]
    pub fn is_of<M: Model<N>>(&self, model: &M) -> bool {
        self.tokens == tokens(model, &self.place)
    }
}

impl<'m, M, const N: usize> Stepper<'m, M, N>
where
    M: Model<N>,
{
    /// Drops the model and keeps everything else.
    #[must_use]
    pub fn suspend(self) -> Suspended<N> {
        let place = self.common.carried.place();
        let tokens = tokens(&*self.model, &place);
        Suspended::of(self.common, place, tokens)
    }

    /// A stepper that continues where another one was [suspended](Self::suspend), with all counts zero. If that
    /// [had](Suspended::is_of) another model, the stepper starts anew.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn resume(
        model: Share<'m, M>,
        control: Control,
        suspended: Suspended<N>,
    ) -> Result<Self, ModelError> {
        model.check()?;
        if !suspended.is_of(&*model) {
            return Self::sharing(model, suspended.element, control);
        }
        let common = suspended.resumed(Shape::of::<M, N>(), control)?;
        Ok(Self { model, common })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Mixed;
    use crate::model::{CoordinateName, Facts, Form};
    use crate::real::Real;

    /// H = p²/2 + k q²/2, by hand and without numbered parameters.
    struct Oscillator {
        k: f64,
    }

    impl Model<1> for Oscillator {
        const FORM: Form = Form::Hamiltonian;
        const FACTS: Facts = Facts {
            time_dependent: false,
            forced: false,
            quadratic_in_z: true,
            constant_mass: true,
            linear: true,
            separable: true,
            smooth: true,
        };

        fn energy_function<R: Real>(&self, _: R, q: &[R; 1], p: &[R; 1]) -> R {
            (R::from_f64(self.k) * q[0] * q[0] + p[0] * p[0]) * R::from_f64(0.5)
        }

        fn first<R: Real>(&self, _: R, q: &[R; 1], p: &[R; 1], first: &mut First<R, 1>) {
            (first.z[0], first.q[0]) = (p[0], R::from_f64(self.k) * q[0]);
        }

        fn first_and_mass<R: Real>(
            &self,
            t: R,
            q: &[R; 1],
            p: &[R; 1],
            first: &mut First<R, 1>,
            zz: &mut [[R; 1]; 1],
        ) {
            self.first(t, q, p, first);
            zz[0][0] = R::from_f64(1.0);
        }

        fn second<R: Real>(
            &self,
            t: R,
            q: &[R; 1],
            p: &[R; 1],
            first: &mut First<R, 1>,
            second: &mut Second<R, 1>,
        ) {
            self.first_and_mass(t, q, p, first, &mut second.zz);
            second.qq[0][0] = R::from_f64(self.k);
        }

        fn coordinate_name(_: usize) -> CoordinateName {
            CoordinateName {
                name: "x",
                index: None,
            }
        }
    }

    fn begun(model: &Oscillator) -> Stepper<'_, Oscillator, 1> {
        let stepper = Stepper::new(model, Mixed::<4>.into(), Control::default());
        stepper.expect("an element").ends_only()
    }

    /// After so many steps of 0.1.
    fn moved(
        stepper: &mut Stepper<'_, Oscillator, 1>,
        steps: u32,
        mut state: State<1>,
    ) -> State<1> {
        for k in 0..steps {
            let t = 0.1 * f64::from(k);
            stepper.advance(t, 0.1, &mut state, &[]).expect("a step");
        }
        state
    }

    /// Also where the state is zero, so that forces of both models are alike.
    #[test]
    fn matrices_of_another_model_are_not_gone_on_with() {
        let (soft, stiff) = (Oscillator { k: 1.0 }, Oscillator { k: 9.0 });
        for amplitude in [1.0, 0.0] {
            let start = State {
                q: [amplitude],
                p: [0.0],
            };
            let mut first = begun(&soft);
            moved(&mut first, 40, start);
            let suspended = first.suspend();
            assert!(suspended.is_of(&soft) && !suspended.is_of(&stiff));
            let control = Control::default();
            let resumed = Stepper::resume(Share::Borrowed(&stiff), control, suspended);
            let start = State { q: [1.0], p: [0.0] };
            let on = moved(&mut resumed.expect("an element"), 40, start);
            let anew = moved(&mut begun(&stiff), 40, start);
            assert!((on.q[0] - anew.q[0]).abs() < 1e-12);
        }
    }
}
