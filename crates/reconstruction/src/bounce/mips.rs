//! Coarser levels of a sample image's colours, for mirrored rays that cover several texels.

use depth_image::{BACKGROUND_INVERSE_DEPTH, DepthImage, linear_from_rgb9e5, rgb9e5_from_linear};
use glam::{UVec2, Vec3};

/// One level: means over squares of texels, and the share of each square that shows a surface.
struct Level {
    size_px: UVec2,
    means: Vec<(Vec3, f32)>,
}

/// The levels above an image's own texels. The shorter side of the last has two texels, so that each level has cells.
pub(crate) fn mip_count(size_px: UVec2) -> u32 {
    (size_px.min_element() - 1).max(1).ilog2()
}

/// The texels of all levels together.
pub(crate) fn mip_texels(size_px: UVec2) -> usize {
    let levels = (1..=mip_count(size_px)).map(|level| size_px.map(|side| side.div_ceil(1 << level)));
    levels.map(|size_px| size_px.element_product() as usize).sum()
}

/// The colours of all levels, the finest first, row by row, as RGB9E5, and the sizes of levels. A texel is the mean over the
/// samples of its square that show a surface. Where none does, it has the colour of the coarser texel around it, and on the
/// coarsest level the mean of all: interpolation meets no black.
pub(crate) fn mips(image: &DepthImage) -> Vec<(UVec2, Vec<u32>)> {
    let own = Level::of(image);
    let mut levels: Vec<Level> = Vec::new();
    for _ in 0..mip_count(own.size_px) {
        levels.push(levels.last().unwrap_or(&own).coarser());
    }
    fill_from_coarser(&mut levels);
    levels.into_iter().map(Level::packed).collect()
}

impl Level {
    fn of(image: &DepthImage) -> Self {
        let samples = image.color_rgb9e5.iter().zip(&image.inverse_depth_per_m);
        let means = samples.map(|(&color, &inverse_depth)| match inverse_depth > BACKGROUND_INVERSE_DEPTH {
            true => (linear_from_rgb9e5(color), 1.0),
            false => (Vec3::ZERO, 0.0),
        });
        Self { size_px: image.size_px(), means: means.collect() }
    }

    fn coarser(&self) -> Self {
        let size_px = self.size_px.map(|side| side.div_ceil(2));
        let means = (0..size_px.element_product()).map(|index| self.mean(place_of(index, size_px) * 2));
        Self { size_px, means: means.collect() }
    }

    /// Over two rows and two columns, as far as there are any.
    fn mean(&self, first: UVec2) -> (Vec3, f32) {
        let end = (first + 2).min(self.size_px);
        let texels = (first.y..end.y).flat_map(|y| (first.x..end.x).map(move |x| UVec2::new(x, y)));
        let (mean, shares) = weighted_mean(texels.map(|texel| self.means[index_of(texel, self.size_px)]));
        (mean, shares / (end - first).element_product() as f32)
    }

    fn packed(self) -> (UVec2, Vec<u32>) {
        (self.size_px, self.means.into_iter().map(|(color, _)| rgb9e5_from_linear(color)).collect())
    }
}

/// The mean of colours by their shares, and the sum of these.
fn weighted_mean(means: impl Iterator<Item = (Vec3, f32)>) -> (Vec3, f32) {
    let (sum, shares) =
        means.fold((Vec3::ZERO, 0.0), |(sum, shares), (color, share)| (sum + color * share, shares + share));
    (sum / f32::max(shares, f32::MIN_POSITIVE), shares)
}

fn fill_from_coarser(levels: &mut [Level]) {
    if let Some(coarsest) = levels.last_mut() {
        let (mean, _) = weighted_mean(coarsest.means.iter().copied());
        coarsest.means.iter_mut().filter(|(_, share)| *share == 0.0).for_each(|(color, _)| *color = mean);
    }
    for number in (1..levels.len()).rev() {
        let (finer, coarser) = levels.split_at_mut(number);
        let finer = &mut finer[number - 1];
        let coarser = &coarser[0];
        let empty = finer.means.iter_mut().enumerate().filter(|(_, (_, share))| *share == 0.0);
        for (index, (color, _)) in empty {
            *color = coarser.means[index_of(place_of(index as u32, finer.size_px) / 2, coarser.size_px)].0;
        }
    }
}

fn place_of(index: u32, size_px: UVec2) -> UVec2 {
    UVec2::new(index % size_px.x, index / size_px.x)
}

fn index_of(place: UVec2, size_px: UVec2) -> usize {
    (place.y * size_px.x + place.x) as usize
}

#[cfg(test)]
mod tests {
    use depth_image::{Camera, HOLE_INVERSE_DEPTH, PinholeCamera};

    use super::*;

    fn image(size_px: UVec2, color: impl Fn(UVec2) -> Option<Vec3>) -> DepthImage {
        let camera = PinholeCamera::looking_at(Vec3::ZERO, Vec3::Z, Vec3::Y, 1.0, size_px);
        let texels = (0..size_px.element_product()).map(|index| color(place_of(index, size_px)));
        DepthImage {
            camera: Camera::Pinhole(camera),
            inverse_depth_per_m: texels.clone().map(|color| color.map_or(HOLE_INVERSE_DEPTH, |_| 0.5)).collect(),
            color_rgb9e5: texels.map(|color| rgb9e5_from_linear(color.unwrap_or(Vec3::ONE))).collect(),
            normal_oct16: None,
            surface_id: None,
            specular: None,
            passed: None,
            corner_inverse_depth_per_m: None,
            light: None,
        }
    }

    #[test]
    fn levels_halve_down_to_two_texels() {
        let size_px = UVec2::new(13, 9);
        let levels = mips(&image(size_px, |_| Some(Vec3::splat(0.5))));
        let sizes: Vec<UVec2> = levels.iter().map(|(size_px, _)| *size_px).collect();
        assert_eq!(sizes, [UVec2::new(7, 5), UVec2::new(4, 3), UVec2::new(2, 2)]);
        assert_eq!(levels.iter().map(|(_, colors)| colors.len()).sum::<usize>(), mip_texels(size_px));
        for side in 2..40 {
            let size_px = UVec2::new(side, 50);
            assert!(mip_count(size_px) == 0 || side.div_ceil(1 << mip_count(size_px)) == 2, "{side}");
        }
        let same = |color: &u32| (linear_from_rgb9e5(*color) - 0.5).abs().max_element() < 1e-3;
        assert!(levels.iter().flat_map(|(_, colors)| colors).all(same));
    }

    #[test]
    fn checks_become_their_mean() {
        let check = |at: UVec2| Some(Vec3::new(((at.x + at.y) % 2) as f32, 0.25, 0.0));
        for (_, colors) in mips(&image(UVec2::splat(16), check)) {
            assert!(colors.iter().all(|&color| linear_from_rgb9e5(color) == Vec3::new(0.5, 0.25, 0.0)));
        }
    }

    /// The left half has no surface, on no level.
    #[test]
    fn what_shows_no_surface_adds_no_light() {
        let red = Vec3::new(0.75, 0.0, 0.0);
        let levels = mips(&image(UVec2::splat(16), |at| (at.x >= 8).then_some(red)));
        assert!(levels.iter().flat_map(|(_, colors)| colors).all(|&color| linear_from_rgb9e5(color) == red));
    }
}
