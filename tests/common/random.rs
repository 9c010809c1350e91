//! Random numbers of the sizes that users pass, and of some that they should not.

use tfe::Element;

/// A number from an environment variable.
pub fn setting(name: &str) -> Option<u32> {
    let text = std::env::var(name).ok()?;
    Some(text.parse().expect("a number"))
}

/// A generator that returns the same numbers in every run.
#[derive(Clone, Copy, Debug)]
pub struct Random(pub u64);

impl Random {
    pub fn unit(&mut self) -> f64 {
        let Self(state) = self;
        *state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (*state >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub fn between(&mut self, from: f64, to: f64) -> f64 {
        from + (to - from) * self.unit()
    }

    pub fn below(&mut self, count: u32) -> u32 {
        (self.unit() * f64::from(count)) as u32
    }

    /// Mostly of order one; now and then zero, tiny, huge or negative.
    pub fn number(&mut self) -> f64 {
        match self.below(20) {
            0 => 0.0,
            1 => 10_f64.powf(self.between(-300.0, 300.0)),
            2 => -10_f64.powf(self.between(-10.0, 10.0)),
            3 | 4 => 10_f64.powf(self.between(-8.0, 8.0)),
            _ => self.between(-2.0, 2.0),
        }
    }

    pub fn element(&mut self) -> Element {
        let nodes = 2 + self.below(6) as usize;
        match self.below(8) {
            0 => Element::primal(nodes),
            1 => Element::primal(nodes).reduced(),
            2 => Element::primal(nodes).lobatto(),
            3 => Element::radau(nodes),
            4 => Element::three_field(nodes),
            5 => Element::energy_conserving(nodes),
            _ => Element::mixed(nodes),
        }
    }
}
