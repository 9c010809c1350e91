//! A model with the start of its motion, as a trait object: what is shown of many mechanisms is compiled once for each
//! number of coordinates, and not for each mechanism.

use tfe::RunError;
use tfe::accuracy::Estimated;
use tfe::prelude::*;
use tfe::runtime::constrained::Trail;
use tfe::runtime::length::{Declared, FixedLength};
use tfe::runtime::step::{Control, Stepper};

/// A mechanism whose motion starts at the time zero.
pub trait Moves<const N: usize> {
    /// The motion over `0..time` in equal steps.
    fn run(&self, element: Element, step: f64, time: f64) -> Result<Motion<N>, RunError<N>>;

    /// The same, with element and step, and with a tolerance of the iterations.
    fn run_within(
        &self,
        tolerance: f64,
        how: (Element, f64),
        time: f64,
    ) -> Result<Motion<N>, RunError<N>>;

    /// The motion over `0..time` with an accuracy.
    fn run_accurately(&self, accuracy: f64, time: f64)
    -> Result<Estimated<Motion<N>>, RunError<N>>;

    /// The second step of length `h`, for which the trail may have a guess.
    fn second_step(&self, nodes: usize, h: f64, trail: &Trail) -> SecondStep<N>;
}

pub struct SecondStep<const N: usize> {
    pub end: State<N>,
    pub iterations: u64,
    /// What it leaves to other elements.
    pub trail: Trail,
}

/// A model of any type with its start.
pub struct Scene<'m, M, const N: usize> {
    pub model: &'m M,
    pub start: State<N>,
}

impl<M, const N: usize> Scene<'_, M, N>
where
    M: Model<N> + Declared<N, Length = FixedLength>,
{
    /// The scene without the type of its model.
    pub fn moves(&self) -> &dyn Moves<N> {
        self
    }

    fn simulation(&self) -> Simulation<'_, M, N> {
        Simulation::new(self.model)
    }
}

impl<M, const N: usize> Moves<N> for Scene<'_, M, N>
where
    M: Model<N> + Declared<N, Length = FixedLength>,
{
    fn run(&self, element: Element, step: f64, time: f64) -> Result<Motion<N>, RunError<N>> {
        let run = self.simulation().element(element).step(step);
        run.run(self.start, 0.0..time)
    }

    fn run_within(
        &self,
        tolerance: f64,
        (element, step): (Element, f64),
        time: f64,
    ) -> Result<Motion<N>, RunError<N>> {
        let run = self.simulation().element(element).step(step);
        run.tolerance(tolerance).run(self.start, 0.0..time)
    }

    fn run_accurately(
        &self,
        accuracy: f64,
        time: f64,
    ) -> Result<Estimated<Motion<N>>, RunError<N>> {
        let run = self.simulation().accuracy(accuracy);
        run.run(self.start, 0.0..time)
    }

    fn second_step(&self, nodes: usize, h: f64, trail: &Trail) -> SecondStep<N> {
        // Rounding errors may take a few more iterations.
        let control = Control {
            tolerance: 1e-11,
            ..Control::default()
        };
        let stepper = Stepper::new(self.model, Element::mixed(nodes), control);
        let (mut stepper, mut end) = (stepper.expect("an element"), self.start);
        stepper.advance(0.0, h, &mut end, &[]).expect("a step");
        let before = stepper.statistics().iterations;
        stepper.foresee(trail, (h, h));
        stepper.advance(h, h, &mut end, &[]).expect("a step");
        let iterations = stepper.statistics().iterations - before;
        let mut trail = Trail::new();
        stepper.leave(&mut trail);
        SecondStep {
            end,
            iterations,
            trail,
        }
    }
}

/// What is shown of each of several mechanisms, with a span in which it moves.
pub trait Shown {
    fn of<const N: usize>(&self, name: &str, mechanism: &dyn Moves<N>, span: f64);
}

/// Shows it of one mechanism.
pub fn show<M, const N: usize>(
    shown: &impl Shown,
    name: &str,
    (model, start): (&M, State<N>),
    span: f64,
) where
    M: Model<N> + Declared<N, Length = FixedLength>,
{
    shown.of(name, Scene { model, start }.moves(), span);
}
