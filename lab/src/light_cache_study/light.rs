//! The lightings that are compared.

use render::Lighting;

pub const SAMPLES_A_PIXEL: u32 = 4;

/// The kind of light that is compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Light {
    Occlusion,
    Indirect,
}

impl Light {
    pub fn of(lighting: &Lighting) -> Self {
        if lighting.is_indirect() { Self::Indirect } else { Self::Occlusion }
    }

    /// Rays to a lamp and of ambient light at each position, in direct drawing. The last is the reference. Lamps need few.
    pub fn direct_rays(self) -> &'static [[u32; 2]] {
        match self {
            Self::Occlusion => &[[1, 1], [2, 2], [4, 4], [8, 8], [16, 16]],
            Self::Indirect => &[[1, 1], [2, 2], [4, 4], [4, 8], [4, 16], [4, 32], [16, 64]],
        }
    }

    pub fn lighting(self, [to_lamps, ambient]: [u32; 2]) -> String {
        let term = if self == Self::Indirect { "indirect" } else { "occlusion" };
        format!("soft {to_lamps}, {term} {ambient}")
    }

    /// Of all positions, with as many rays again.
    pub fn truth(self) -> String {
        let reference = self.direct_rays().last().copied().unwrap_or([16, 16]);
        self.lighting(reference.map(|rays| 2 * SAMPLES_A_PIXEL * rays))
    }
}
