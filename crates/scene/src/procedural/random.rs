//! Random numbers by SplitMix64 (Steele, Lea, Flood 2014): small, seedable, and the same on every platform. Gradient
//! noise (Perlin 2002) from its hash, and sums of it.

use glam::{Vec2, Vec2Swizzles, Vec3};

/// A stream of random numbers.
#[derive(Clone)]
pub struct Rng {
    state: u64,
}

impl Rng {
    /// Streams of different `purpose` are independent: more numbers from one do not change the others.
    #[must_use]
    pub fn new(seed: u64, purpose: u64) -> Self {
        Self { state: mixed(seed ^ mixed(purpose)) }
    }

    /// A number from 0 up to, but not, 1.
    pub fn unit(&mut self) -> f32 {
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        (mixed(self.state) >> 40) as f32 / (1u64 << 24) as f32
    }

    /// A number from `low` up to `high`.
    pub fn between(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.unit()
    }

    /// A point in the cube from -1 to 1.
    pub(super) fn vector(&mut self) -> Vec3 {
        Vec3::new(self.between(-1.0, 1.0), self.between(-1.0, 1.0), self.between(-1.0, 1.0))
    }
}

/// The finaliser, a hash of 64 bits.
#[must_use]
pub fn mixed(value: u64) -> u64 {
    let value = (value ^ (value >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let value = (value ^ (value >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    value ^ (value >> 31)
}

/// Smooth noise, about -1 to 1, with features of size 1.
#[derive(Clone, Copy)]
pub struct Noise {
    seed: u64,
}

impl Noise {
    /// Noise of a seed.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        Self { seed: mixed(seed) }
    }

    /// The noise at a point.
    #[must_use]
    pub fn at(&self, point: Vec2) -> f32 {
        let cell = point.floor();
        let within = point - cell;
        let corner = |dx: f32, dy: f32| {
            let offset = Vec2::new(dx, dy);
            self.gradient(cell + offset).dot(within - offset)
        };
        let ease = within * within * within * (within * (within * 6.0 - 15.0) + 10.0);
        let low = lerp(corner(0.0, 0.0), corner(1.0, 0.0), ease.x);
        let high = lerp(corner(0.0, 1.0), corner(1.0, 1.0), ease.x);
        1.4 * lerp(low, high, ease.y)
    }

    /// Octaves of half the size and half the height each; about -1 to 1.
    #[must_use]
    pub fn fractal(&self, point: Vec2, octaves: u32) -> f32 {
        let mut sum = 0.0;
        let mut height = 1.0;
        let mut total = 0.0;
        for octave in 0..octaves {
            // An offset per octave keeps the zeros at lattice points from lining up.
            let shift = Vec2::splat(17.3 * octave as f32);
            sum += height * self.at(point * 2f32.powi(octave as i32) + shift);
            total += height;
            height *= 0.5;
        }
        sum / total
    }

    /// Noise over space, by three planes: good enough for a tint.
    #[must_use]
    pub fn in_space(&self, point: Vec3) -> f32 {
        (self.at(point.truncate()) + self.at(point.truncate().yx() + point.z) + self.at(Vec2::new(point.z, point.y)))
            / 2.0
    }

    fn gradient(&self, cell: Vec2) -> Vec2 {
        let key = (cell.x as i32 as u32 as u64) << 32 | cell.y as i32 as u32 as u64;
        let angle = (mixed(self.seed ^ key) >> 40) as f32 * (std::f32::consts::TAU / (1u64 << 24) as f32);
        Vec2::from_angle(angle)
    }
}

/// Linear interpolation: `a` at t = 0, `b` at t = 1.
#[must_use]
pub fn lerp(a: f32, b: f32, t: f32) -> f32 {
    a + (b - a) * t
}

/// 0 below `low`, 1 above `high`, smooth between.
pub(super) fn smoothstep(low: f32, high: f32, value: f32) -> f32 {
    let t = ((value - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Mixes colours by their sRGB codes.
#[must_use]
pub fn mix(a: Vec3, b: Vec3, t: f32) -> Vec3 {
    a + (b - a) * t.clamp(0.0, 1.0)
}
