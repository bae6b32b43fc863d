//! The lamps that have a share of their own in samples of light.

use bytemuck::{Pod, Zeroable};
use depth_image::{Illumination, MAX_LAMP_SHARES};

/// `LampShares` of `lamp_shares.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(crate) struct GpuLampShares {
    pub lamps: [[u32; 4]; 4],
    pub lamp_count: u32,
    pub padding: [u32; 3],
}

impl GpuLampShares {
    /// The lamps of a scene that have a share.
    pub fn new(illumination: &Illumination) -> Self {
        let mut lamps = [[0; 4]; 4];
        for (place, lamp) in illumination.lamps_with_shares().into_iter().enumerate() {
            lamps[place / 4][place % 4] = lamp;
        }
        Self { lamps, lamp_count: shares_of_lamps(illumination.lights.len()) as u32, padding: [0; 3] }
    }
}

/// Shares of lamps: one for each, or else one for each of the strongest and one for all others.
pub(crate) fn shares_of_lamps(light_count: usize) -> usize {
    light_count.min(MAX_LAMP_SHARES + 1)
}
