//! Twin of `specular.wgsl`: the light that depends on the viewer, on pixels that show a surface.

use depth_image::{DepthImage, Highlight, ProvenanceKind, Reflector, highlight_linear, unit_from_oct16};
use glam::{UVec2, Vec2, Vec3, Vec3Swizzles};

use super::{
    pixel::Pixel,
    sample_camera::{CORNERS, SampleCamera},
    surface::{bilinear, bilinear_shares},
    view_ray::{ViewRay, ViewRays},
};
use crate::{set_description::SetDescription, surface::THICKNESS_FOOTPRINTS, view_work::CELL_MARGIN_PX};

/// The mean of the samples around a point.
struct Gathered {
    normal_in_world: Vec3,
    /// Bytes, as in the images.
    reflector: [f32; 4],
    /// Bytes, of the environment, then of each light.
    visibility: Vec<f32>,
    /// The share of the samples that reflects.
    reflecting: f32,
}

pub(super) fn add_highlights(
    pixels: &mut [Pixel],
    images: &[DepthImage],
    set: &SetDescription<'_>,
    cameras: &[SampleCamera],
    rays: &ViewRays,
) {
    let Some(highlight) = set.highlight else { return };
    for (pixel, place) in pixels.iter_mut().zip(rays.places()) {
        pixel.color_linear += added_linear(pixel, images, set, highlight, cameras, &rays.ray(place));
    }
}

fn added_linear(
    pixel: &Pixel,
    images: &[DepthImage],
    set: &SetDescription<'_>,
    highlight: Highlight,
    cameras: &[SampleCamera],
    ray: &ViewRay,
) -> Vec3 {
    if pixel.provenance.kind() != ProvenanceKind::Hit {
        return Vec3::ZERO;
    }
    let contributed = pixel.provenance.camera_mask();
    let Some(nearest) = cameras.iter().find(|camera| camera.mask & contributed != 0) else { return Vec3::ZERO };
    let point = ray.at(pixel.inverse_depth_per_m.recip());
    let image = &images[nearest.mask.trailing_zeros() as usize];
    let Some(around) = gathered(image, nearest, point, set.illumination.lights.len()) else { return Vec3::ZERO };
    let visibility = |place: usize| around.visibility[place] / 255.0;
    let word = u32::from_le_bytes(around.reflector.map(|byte| byte as u8));
    let Some(reflector) = Reflector::unpack(word) else { return Vec3::ZERO };
    let towards_eye = -ray.direction.normalize_or_zero();
    let normal = around.normal_in_world;
    highlight_linear(highlight, set.illumination, &visibility, point, normal, towards_eye, &reflector)
        * around.reflecting
}

/// By the bilinear shares of the samples on the point's surface; `None` where none reflects.
fn gathered(image: &DepthImage, camera: &SampleCamera, point_in_world: Vec3, lights: usize) -> Option<Gathered> {
    let (cell, shares) = shares_on_surface(camera, point_in_world);
    let all: f32 = shares.iter().sum();
    let mut sum = Gathered {
        normal_in_world: Vec3::ZERO,
        reflector: [0.0; 4],
        visibility: vec![0.0; lights + 1],
        reflecting: 0.0,
    };
    for (i, share) in shares.into_iter().enumerate() {
        let texel = cell + CORNERS[i];
        sum.add(image, (texel.y * image.size_px().x + texel.x) as usize, share);
    }
    (sum.reflecting > 0.0).then(|| sum.divided_by(all))
}

/// A cell of the camera's image, and of each of its samples how much it counts.
fn shares_on_surface(camera: &SampleCamera, point_in_world: Vec3) -> (UVec2, [f32; 4]) {
    let p = camera.homogeneous(point_in_world.extend(1.0));
    let inverse_w = p.z.recip();
    let uv = (p.xy() * inverse_w - 0.5).max(Vec2::ZERO).min(camera.cells - CELL_MARGIN_PX);
    let cell = uv.as_uvec2();
    let at = uv - uv.floor();
    let corners = camera.corners(cell);
    let surfaces = if corners.connected { [bilinear(corners.codes, at); 4] } else { corners.codes };
    let reach = THICKNESS_FOOTPRINTS * camera.code_above(inverse_w) / camera.focal_px;
    let mut shares = bilinear_shares(at);
    for i in 0..4 {
        let on_surface = (camera.code(inverse_w) - surfaces[i]).abs() < reach && corners.codes[i] > 1.5;
        shares[i] = if on_surface { shares[i] } else { 0.0 };
    }
    (cell, shares)
}

impl Gathered {
    fn add(&mut self, image: &DepthImage, index: usize, share: f32) {
        let (Some(planes), Some(normals)) = (&image.specular, &image.normal_oct16) else { return };
        let reflector = planes.reflectance_srgb8_roughness8[index];
        if reflector == 0 {
            return;
        }
        self.reflecting += share;
        // On the octahedron.
        let normal = unit_from_oct16(normals[index]);
        self.normal_in_world += normal / normal.abs().element_sum() * share;
        for (sum, byte) in self.reflector.iter_mut().zip(reflector.to_le_bytes()) {
            *sum += f32::from(byte) * share;
        }
        for (place, sum) in self.visibility.iter_mut().enumerate() {
            let byte = planes.visibility8.get(place / 4).map_or(255, |plane| plane[index] >> (8 * (place % 4)) & 0xff);
            *sum += byte as f32 * share;
        }
    }

    /// Sums to means; `all` is the share of the samples that lie on the surface.
    fn divided_by(mut self, all: f32) -> Self {
        let inverse = self.reflecting.recip();
        self.normal_in_world = self.normal_in_world.normalize_or_zero();
        self.reflector.iter_mut().chain(&mut self.visibility).for_each(|byte| *byte = (*byte * inverse).round());
        self.reflecting /= all;
        self
    }
}
