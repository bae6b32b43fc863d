//! The regular grid of places on a lamp: `grid.wgsl`.

use glam::Vec2;

/// The stride of a grid's rays is near this share of their number: the golden section.
const GOLDEN: f64 = 0.618_033_988_749_895;

/// Words of the bits of a pixel.
pub(crate) fn words_a_pixel(side: u32, light_count: usize) -> usize {
    (side * side).div_ceil(32) as usize * light_count
}

/// How far the rays of a grid are apart among its places: a whole number without a common divisor with their number.
pub(crate) fn grid_stride(side: u32) -> u32 {
    let count = side * side;
    let first = (f64::from(count) * GOLDEN) as u32;
    (first..).find(|&stride| common_divisor(stride, count) == 1).unwrap_or(1)
}

fn common_divisor(a: u32, b: u32) -> u32 {
    if b == 0 { a } else { common_divisor(b, a % b) }
}

/// The place on a lamp of a ray of a grid, as `grid.wgsl` has it.
#[must_use]
pub fn grid_place(side: u32, number: u32) -> Vec2 {
    let point = number.wrapping_mul(grid_stride(side)) % (side * side);
    (Vec2::new((point % side) as f32, (point / side) as f32) + 0.5) / side as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rays_of_a_grid_go_to_each_place_once_and_spread_early() {
        for side in 1..=32 {
            let mut places: Vec<[u32; 2]> =
                (0..side * side).map(|number| grid_place(side, number).to_array().map(f32::to_bits)).collect();
            places.sort_unstable();
            places.dedup();
            assert_eq!(places.len(), (side * side) as usize, "{side}");
        }
        let mean: Vec2 = (0..16).map(|number| grid_place(16, number)).sum::<Vec2>() / 16.0;
        assert!((mean - 0.5).abs().max_element() < 0.1, "{mean}");
        let beyond = grid_place(4, 16);
        assert_eq!(beyond, grid_place(4, 0), "numbers beyond the grid begin again");
    }
}
