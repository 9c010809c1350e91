//! Pictures of stability maps.

use super::StabilityMap;
use crate::charts::{Axis, Class, Colour, HeatMap, Scale};

impl<E> StabilityMap<E> {
    /// The map as a picture with colours for the values, to which curves can be added. Colours begin at the
    /// [limit](super::MapPlan::limit) if a value is above it, so that all stable cells are dark blue; failed cells are
    /// grey. The scale is logarithmic unless a value is zero or negative.
    pub fn heat_map(&self) -> HeatMap {
        let size = (self.columns(), self.rows());
        let map = HeatMap::new(&self.plan.title, size, |i, j| self.value(i, j));
        self.with_axes(map.values(self.colours()))
    }

    /// The map as a picture of two classes: “stable” in white, and “unstable”, above the
    /// [limit](super::MapPlan::limit), in blue.
    ///
    /// ```
    /// use tfe::stability::StabilityMap;
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// let map = StabilityMap::over(-1.0..1.0, 0.0..1.0).run(|x, y| Ok::<_, String>(x.exp() * y))?;
    /// let svg = map.classes().curve("y = e⁻ˣ", (0..=100).map(|k| (0.01 * f64::from(k), (-0.01 * f64::from(k)).exp()))).to_svg()?;
    /// assert!(svg.contains("unstable"));
    /// # Ok(())
    /// # }
    /// ```
    pub fn classes(&self) -> HeatMap {
        let classes = vec![
            Class::new("stable", Colour::WHITE),
            Class::new("unstable", Colour(86, 150, 200)),
        ];
        let class = |i, j| Some(usize::from(self.value(i, j)? > self.plan.limit));
        let size = (self.columns(), self.rows());
        self.with_axes(HeatMap::classes(&self.plan.title, size, classes, class))
    }

    fn with_axes(&self, map: HeatMap) -> HeatMap {
        let [x, y] = &self.plan.labels;
        map.x(Axis::new(x).range(self.plan.x.clone()))
            .y(Axis::new(y).range(self.plan.y.clone()))
    }

    fn colours(&self) -> Axis {
        let is_positive = self.values.iter().flatten().all(|value| *value > 0.0);
        let limit = self.plan.limit;
        let (scale, has_place) = if is_positive {
            (Scale::Logarithmic, limit > 0.0)
        } else {
            (Scale::Linear, true)
        };
        let axis = Axis::new("spectral radius").scale(scale);
        match self.largest() {
            Some(largest) if has_place && limit.is_finite() && largest > limit => {
                axis.range(limit..largest)
            }
            _ => axis,
        }
    }
}
