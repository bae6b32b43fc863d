//! The lightings that are compared.

use render::Lighting;

pub const SAMPLES_A_PIXEL: u32 = 4;

/// The kind of light that is compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Light {
    Occlusion,
    Indirect,
}

/// Rays of direct drawing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LightRays {
    /// Rays to each lamp.
    pub to_lamps: u32,
    /// Rays of occlusion or of indirect light.
    pub ambient: u32,
}

impl LightRays {
    pub const fn new(to_lamps: u32, ambient: u32) -> Self {
        Self { to_lamps, ambient }
    }

    /// Rays at a position, from the fewest up to `most`. More than four to a lamp change little.
    pub const fn up_to(most: Self) -> [Self; 7] {
        [Self::new(1, 1), Self::new(2, 2), Self::new(4, 4), Self::new(4, 8), Self::new(4, 16), Self::new(4, 32), most]
    }

    /// The rays of a pixel, if these are the rays of each of its positions.
    pub fn a_pixel(self) -> Self {
        self.times(SAMPLES_A_PIXEL)
    }

    fn times(self, factor: u32) -> Self {
        Self { to_lamps: self.to_lamps * factor, ambient: self.ambient * factor }
    }
}

impl Light {
    pub fn of(lighting: &Lighting) -> Self {
        if lighting.is_indirect() { Self::Indirect } else { Self::Occlusion }
    }

    /// The lighting with so many rays a pixel.
    pub fn lighting(self, LightRays { to_lamps, ambient }: LightRays) -> String {
        let term = if self == Self::Indirect { "indirect" } else { "occlusion" };
        format!("soft {to_lamps}, {term} {ambient}")
    }

    /// The lighting of true views: twice the rays, at each position, of the direct drawing with the most rays.
    pub fn truth(self, most_a_position: LightRays) -> String {
        self.lighting(most_a_position.a_pixel().times(2))
    }
}
