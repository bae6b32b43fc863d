//! The plan of the city: blocks, streets and kerbs.

use glam::Vec2;

pub(super) const SEED: u64 = 1950;

pub(super) const HALF_WIDTH_M: f32 = 200.0;
/// Number of blocks a side; each has streets on all sides.
pub(super) const BLOCKS: u32 = 3;
pub(super) const STREET_M: f32 = 19.0;
pub(super) const BLOCK_M: f32 = (2.0 * HALF_WIDTH_M - (BLOCKS + 1) as f32 * STREET_M) / BLOCKS as f32;
pub(super) const KERB_M: f32 = 0.2;

/// The corner of least x and z of each block.
pub(super) fn blocks() -> impl Iterator<Item = Vec2> {
    let along = |i: u32| -HALF_WIDTH_M + STREET_M + i as f32 * (BLOCK_M + STREET_M);
    (0..BLOCKS * BLOCKS).map(move |i| Vec2::new(along(i % BLOCKS), along(i / BLOCKS)))
}
