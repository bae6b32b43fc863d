//! Twin of `smooth.wgsl`: the light of all positions within a pixel, from the first position.

use depth_image::{Antialias, ProvenanceKind};
use glam::{UVec2, Vec2, Vec3, Vec3Swizzles};

use super::{
    pixel::Pixel,
    sample_camera::{CORNERS, SampleCamera},
    surface::bilinear_shares,
    view_ray::{ViewRay, ViewRays},
};
use crate::methods::joint_carve::smooth::{FAINT_HIGHLIGHT, OPEN_SHARE, SMOOTH_FOOTPRINTS, from_first_px};
use crate::{set_description::SetDescription, view_work::CELL_MARGIN_PX};

/// What the first position found, and how further ones follow from it.
pub(super) struct First<'f> {
    pub pixels: &'f [Pixel],
    pub cameras: &'f [SampleCamera],
    pub rays: &'f ViewRays,
    /// See [`super::tile_start`].
    pub starts: &'f [f32],
    pub set: &'f SetDescription<'f>,
    pub antialias: Antialias,
}

impl First<'_> {
    /// The light of all further positions of a pixel that shows one smooth surface, or only background.
    pub fn further(&self, index: usize, shown_linear: Vec3) -> Option<Vec3> {
        let size_px = self.rays.size_px();
        let place = UVec2::new(index as u32 % size_px.x, index as u32 / size_px.x);
        let is_inner = place.cmpgt(UVec2::ZERO).all() && (place + 1).cmplt(size_px).all();
        match self.pixels[index].provenance.kind() {
            ProvenanceKind::Hit if is_inner => self.surface(index, place, shown_linear),
            ProvenanceKind::Empty if is_inner => self.background(index, place),
            _ => None,
        }
    }

    /// Inverse depths to the left and above, and to the right and below.
    fn around(&self, index: usize) -> [Vec2; 2] {
        let row = self.rays.size_px().x as usize;
        [[index - 1, index - row], [index + 1, index + row]]
            .map(|places| Vec2::from_array(places.map(|place| self.pixels[place].inverse_depth_per_m)))
    }

    fn background(&self, index: usize, place: UVec2) -> Option<Vec3> {
        let is_clear = self.starts[self.rays.tile_index(place)] >= self.rays.ray(place).far;
        let is_alone = is_clear && self.around(index).iter().all(|sides| sides.cmple(Vec2::ZERO).all());
        let radiances = from_first_px(self.antialias).map(|offset_px| {
            let ray = self.rays.ray_at(place.as_vec2() + 0.5 + offset_px);
            self.set.background.radiance_linear(ray.direction.normalize_or_zero())
        });
        is_alone.then(|| radiances.sum())
    }

    fn surface(&self, index: usize, place: UVec2, shown_linear: Vec3) -> Option<Vec3> {
        let pixel = &self.pixels[index];
        let share = pixel.lowest_share?;
        let center = pixel.inverse_depth_per_m;
        // Between two pixels that cameras show whole, the same cameras show the surface, too.
        let row = self.rays.size_px().x as usize;
        if [index - 1, index + 1, index - row, index + row].iter().any(|&i| self.pixels[i].lowest_share.is_none()) {
            return None;
        }
        let [before, after] = self.around(index);
        // Inverse depth is linear on the image of a plane. Depth is known to a code.
        let tolerance =
            (SMOOTH_FOOTPRINTS * center / self.rays.focal_px()).max(self.cameras[0].code_above(1.0).abs().recip());
        // Something thin may stand between the pixel's positions where its tile is not proven empty nearly up to the surface.
        if center * self.starts[self.rays.tile_index(place)] < OPEN_SHARE {
            return None;
        }
        if (before + after - 2.0 * center).abs().cmpgt(Vec2::splat(tolerance)).any() {
            return None;
        }
        let color = |offset_px: Vec2| {
            let inverse_depth = (center + (0.5 * (after - before)).dot(offset_px)).max(0.1 * center);
            let ray = self.rays.ray_at(place.as_vec2() + 0.5 + offset_px);
            self.color(pixel, &ray, inverse_depth.recip(), share)
        };
        // A highlight may be smaller than a pixel: a bright one is found at each position.
        let added = if self.set.highlight.is_some() { shown_linear - color(Vec2::ZERO) } else { Vec3::ZERO };
        let lights = from_first_px(self.antialias).map(|offset_px| color(offset_px) + added);
        added.abs().cmple(Vec3::splat(FAINT_HIGHLIGHT)).all().then(|| lights.sum())
    }

    fn color(&self, pixel: &Pixel, ray: &ViewRay, t: f32, share: f32) -> Vec3 {
        let mask = pixel.provenance.camera_mask();
        let lowest = mask & mask.wrapping_neg();
        let others = if mask == lowest { lowest } else { mask & !lowest };
        let [others, lowest] = [others, lowest].map(|mask| {
            let shown = self.cameras.iter().find(|camera| camera.mask & mask != 0);
            shown.map_or(Vec3::ZERO, |camera| color_in(camera, ray.at(t)))
        });
        others.lerp(lowest, share)
    }
}

fn color_in(camera: &SampleCamera, point_in_world: Vec3) -> Vec3 {
    let p = camera.homogeneous(point_in_world.extend(1.0));
    let uv = (p.xy() / p.z - 0.5).max(Vec2::ZERO).min(camera.cells - CELL_MARGIN_PX);
    let shares = CORNERS.into_iter().zip(bilinear_shares(uv - uv.floor()));
    shares.map(|(corner, share)| camera.color_linear(uv.as_uvec2() + corner) * share).sum()
}
