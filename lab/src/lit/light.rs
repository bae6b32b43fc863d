//! The lightings that are compared.

use render::Lighting;

pub const SAMPLES_A_PIXEL: u32 = 4;
/// Rays to a lamp that are as good as any.
const MOST_TO_LAMPS: u32 = 16;

/// Rays of direct drawing at each position, from the fewest on. More than four to a lamp change little.
pub const DIRECT_RAYS: [LightRays; 7] = [
    LightRays::new(1, 1),
    LightRays::new(2, 2),
    LightRays::new(4, 4),
    LightRays::new(4, 8),
    LightRays::new(4, 16),
    LightRays::new(4, 32),
    LightRays::new(4, 64),
];

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

    /// The rays of a pixel, if these are the rays of each of its positions.
    pub fn a_pixel(self) -> Self {
        Self { to_lamps: self.to_lamps * SAMPLES_A_PIXEL, ambient: self.ambient * SAMPLES_A_PIXEL }
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

    /// The lighting of true views: twice as many rays at each position as direct drawing has at most.
    pub fn truth(self, most_rays: LightRays) -> String {
        let LightRays { to_lamps, ambient } = most_rays;
        let rays = LightRays::new(2 * to_lamps.max(MOST_TO_LAMPS), 2 * ambient);
        self.lighting(rays.a_pixel())
    }
}
