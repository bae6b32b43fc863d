//! One submission's work: a few pictures of a scene.

use std::{ops::Range, sync::Arc};

use depth_image::PinholeCamera;

use crate::{
    GpuScene, Lighting, Rate,
    accumulation::{Key, Sums},
    finish::FinishVariant,
    image_sequence::ImageSequence,
    pixel_camera::PixelCamera,
    rays::Traced,
    work::DrawWork,
};

/// The share of the scene's diagonal within which occlusion is looked for, where a lighting names no radius.
const OCCLUSION_OF_DIAGONAL: f32 = 0.05;
/// Rays of each kind that one dispatch traces for a pixel: the software device ends all loops of an invocation after
/// 65,535 turns together, and a GPU may take a long dispatch for a hung one.
const RAYS_A_DISPATCH: u32 = 32;

/// One submission's work, once it is known how surfaces are found.
pub(crate) struct Batch<'a> {
    pub work: DrawWork<'a>,
    pub cameras: &'a [PinholeCamera],
    /// The tree, where rays are traced.
    pub traced: Option<Arc<Traced>>,
    /// The last pass, which also says whether surfaces are found by rays.
    pub finish: FinishVariant,
    pub sequence: Option<ImageSequence<'a>>,
}

impl Batch<'_> {
    pub fn scene(&self) -> &GpuScene {
        self.work.scene
    }

    pub fn lighting(&self) -> Lighting {
        self.work.lighting
    }

    /// The tree, where surfaces are found by rays.
    pub fn primary_rays(&self) -> Option<&Traced> {
        self.traced.as_deref().filter(|_| self.finish.by_rays)
    }

    /// The tree, where light is found by rays.
    pub fn light_rays(&self) -> Option<&Traced> {
        self.traced.as_deref().filter(|_| self.lighting().is_traced())
    }

    /// The greatest distance between viewpoints of an image sequence.
    pub fn view_cell_m(&self) -> f32 {
        self.sequence.map_or(0.0, |sequence| sequence.known.view_cell_m)
    }

    /// The bytes of sums and of finished planes.
    pub fn bytes(&self) -> [u64; 2] {
        let pixels: u64 = self.cameras.iter().map(|camera| camera.pixel_count() as u64).sum();
        let sum_planes = if self.lighting().is_lit() { self.finish.sums.count() } else { 0 };
        [sum_planes, self.finish.layout().count].map(|planes| 4 * pixels * planes as u64)
    }

    /// Equal keys are the same light of the same pixels.
    pub fn key(&self) -> Key {
        let DrawWork { scene, lighting, scene_time_s, .. } = self.work;
        // The samples of a sequence's image depend on all cameras of its set, and on its place among them.
        let set = self.sequence.map_or(&[][..], |sequence| &sequence.known.cameras);
        let redundancy = self.sequence.map(|sequence| sequence.known.variant(sequence.first));
        let cameras = [set, self.cameras].concat();
        Key { scene: scene.identity(), lighting, scene_time_s, cameras, finish: self.finish, redundancy }
    }

    /// The cameras as shaders see them, with their places in the batch's planes, for each part of the rays.
    pub fn parts(&self, sums: &Sums) -> Vec<Vec<PixelCamera>> {
        parts_of(sums.ranges()).into_iter().map(|part| self.pixel_cameras(sums, part)).collect()
    }

    /// The same for all rays together.
    pub fn pixel_cameras(&self, sums: &Sums, [shadow, occlusion]: [Range<u32>; 2]) -> Vec<PixelCamera> {
        let [all_shadow, all_occlusion] = sums.ranges();
        let tolerance = match self.lighting().rate {
            Rate::Full => 0.0,
            Rate::Adaptive { tolerance } => tolerance,
        };
        let [planes, sum_planes] = [self.finish.layout().count, self.finish.sums.count()].map(|count| count as u32);
        let (mut first_word, mut first_sum) = (0, 0);
        let place = |camera: &PinholeCamera| {
            let placed = PixelCamera {
                first_word,
                first_sum,
                first_shadow_ray: shadow.start,
                shadow_rays: shadow.end - shadow.start,
                first_occlusion_ray: occlusion.start,
                occlusion_rays: occlusion.end - occlusion.start,
                // Without rays, all light is known at once.
                shadow_rays_in_sum: all_shadow.end.max(1),
                occlusion_rays_in_sum: all_occlusion.end.max(1),
                occlusion_radius_m: self.occlusion_radius_m(),
                tolerance,
                ..PixelCamera::of(camera)
            };
            first_word += placed.pixel_count * planes;
            first_sum += placed.pixel_count * sum_planes;
            placed
        };
        self.cameras.iter().map(place).collect()
    }

    fn occlusion_radius_m(&self) -> f32 {
        let diagonal_m = self.scene().bounds_in_world().size().length();
        let named = self.lighting().occlusion.and_then(|occlusion| occlusion.radius_m);
        named.unwrap_or(diagonal_m * OCCLUSION_OF_DIAGONAL)
    }
}

/// Ranges of rays, cut into parts of [`RAYS_A_DISPATCH`].
fn parts_of(ranges: [Range<u32>; 2]) -> Vec<[Range<u32>; 2]> {
    let most = ranges.iter().map(|range| range.len().div_ceil(RAYS_A_DISPATCH as usize)).max().unwrap_or(0).max(1);
    let part = |range: &Range<u32>, number: u32| {
        let at = |number: u32| (range.start + number * RAYS_A_DISPATCH).min(range.end);
        at(number)..at(number + 1)
    };
    (0..most as u32).map(|number| ranges.each_ref().map(|range| part(range, number))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rays_are_traced_in_parts_that_cover_all_of_them() {
        assert_eq!(parts_of([0..0, 0..0]), [[0..0, 0..0]]);
        assert_eq!(parts_of([3..70, 0..16]), [[3..35, 0..16], [35..67, 16..16], [67..70, 16..16]]);
    }
}
