//! Planes for tests and the bench of the codec: a tree of thousands of small leaves over
//! rolling ground, under a sky that meets nothing.

/// SplitMix64: small, seeded, good enough for tests.
pub struct Random(u64);

impl Random {
    /// The same seed gives the same numbers.
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// 32 random bits.
    pub fn next_u32(&mut self) -> u32 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mixed = (self.0 ^ self.0 >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let mixed = (mixed ^ mixed >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
        (mixed ^ mixed >> 31) as u32
    }

    /// From 0 to 1, exclusive.
    pub fn unit(&mut self) -> f32 {
        (self.next_u32() >> 8) as f32 / (1 << 24) as f32
    }

    /// From 0 to `bound`, exclusive.
    pub fn below(&mut self, bound: usize) -> usize {
        self.next_u32() as usize % bound
    }
}

/// Inverse depths per metre of the scene, rows top-down.
pub fn tree_over_terrain(width: usize, height: usize, seed: u64) -> Vec<f32> {
    let mut plane = terrain(width, height);
    let mut random = Random::new(seed);
    for _ in 0..3000 {
        draw_leaf(&mut plane, width, height, &mut random);
    }
    plane
}

/// Ground 3 m below the eye, seen to the horizon at a third of the height.
fn terrain(width: usize, height: usize) -> Vec<f32> {
    let focal_px = height as f32;
    let horizon_px = height as f32 / 3.0;
    let texel = |index: usize| {
        let right = (index % width) as f32 + 0.5 - width as f32 * 0.5;
        let down = (index / width) as f32 + 0.5 - horizon_px;
        if down <= 0.0 {
            return 0.0;
        }
        let depth_m = focal_px * 3.0 / down;
        let across_m = right / focal_px * depth_m;
        let hill_m =
            0.4 * (across_m * 0.3).sin() * (depth_m * 0.21).cos() + 0.05 * (across_m * 1.9 + depth_m * 1.3).sin();
        down / (focal_px * (3.0 - hill_m))
    };
    (0..width * height).map(texel).collect()
}

/// A tilted quad within the crown, nearest wins.
fn draw_leaf(plane: &mut [f32], width: usize, height: usize, random: &mut Random) {
    let angle = random.unit() * std::f32::consts::TAU;
    let radius = random.unit().sqrt() * 0.3;
    let center = [
        (0.5 + radius * angle.cos() * height as f32 / width as f32) * width as f32,
        (0.4 + radius * angle.sin()) * height as f32,
    ];
    let depth_m = 9.0 + 5.0 * (random.unit() - 0.5);
    let half_px = 0.12 * height as f32 / depth_m * (0.6 + random.unit());
    let turn = random.unit() * std::f32::consts::TAU;
    let slope = [(random.unit() - 0.5) * 0.4, (random.unit() - 0.5) * 0.4].map(|s| s / (height as f32 * depth_m));
    let reach = half_px * 1.5;
    let rows = (center[1] - reach).max(0.0) as usize..((center[1] + reach).max(0.0) as usize + 1).min(height);
    for y in rows {
        for x in (center[0] - reach).max(0.0) as usize..((center[0] + reach).max(0.0) as usize + 1).min(width) {
            let dx = x as f32 + 0.5 - center[0];
            let dy = y as f32 + 0.5 - center[1];
            let u = dx * turn.cos() + dy * turn.sin();
            let v = dy * turn.cos() - dx * turn.sin();
            let inverse = depth_m.recip() + slope[0] * dx + slope[1] * dy;
            let texel = &mut plane[y * width + x];
            if u.abs() <= half_px && v.abs() <= half_px * 0.6 && inverse > *texel {
                *texel = inverse;
            }
        }
    }
}
