//! SplitMix64 (Steele, Lea, Flood 2014): small, seedable, and the same on every platform.

use glam::Vec3;

#[derive(Clone)]
pub(super) struct Rng {
    state: u64,
}

impl Rng {
    /// Streams of different `purpose` are independent: more numbers from one do not change the others.
    pub(super) fn new(seed: u64, purpose: u64) -> Self {
        Self { state: mixed(seed ^ mixed(purpose)) }
    }

    /// A number from 0 up to, but not, 1.
    pub(super) fn unit(&mut self) -> f32 {
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        (mixed(self.state) >> 40) as f32 / (1u64 << 24) as f32
    }

    pub(super) fn between(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.unit()
    }

    /// A point in the cube from -1 to 1.
    pub(super) fn vector(&mut self) -> Vec3 {
        Vec3::new(self.between(-1.0, 1.0), self.between(-1.0, 1.0), self.between(-1.0, 1.0))
    }
}

/// The finaliser, a hash of 64 bits.
pub(super) fn mixed(value: u64) -> u64 {
    let value = (value ^ (value >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let value = (value ^ (value >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    value ^ (value >> 31)
}
