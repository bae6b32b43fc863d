//! The rays of a view, and where they are inside the volume.

use depth_image::{Aabb, DepthImage, PinholeCamera};
use glam::{UVec2, Vec2, Vec3};

use super::sample_camera::SampleCamera;
use crate::{
    sample_set::searched_volume,
    view_work::{GpuViewCamera, TILE_PX, tiles_of},
};

/// All rays of a view.
pub(super) struct ViewRays {
    view: GpuViewCamera,
    /// Padded as on the device.
    pub volume: Aabb,
}

/// A ray; its parameter is planar depth in metres. It is inside the volume from `near` to `far`, nowhere
/// where `near > far`.
#[derive(Debug, Clone, Copy)]
pub(super) struct ViewRay {
    pub eye: Vec3,
    pub direction: Vec3,
    pub near: f32,
    pub far: f32,
    /// Off a mirror: images are taken amid what it meets, and before their background all is free.
    pub is_mirrored: bool,
}

impl ViewRay {
    pub fn at(&self, t: f32) -> Vec3 {
        self.eye + self.direction * t
    }

    /// The ray in a camera's homogeneous pixels: `a + b · t`.
    pub fn in_image_of(&self, camera: &SampleCamera) -> [Vec3; 2] {
        [camera.homogeneous(self.eye.extend(1.0)), camera.homogeneous(self.direction.extend(0.0))]
    }
}

impl ViewRays {
    pub fn of(camera: &PinholeCamera, volume: &Aabb, images: &[DepthImage]) -> Self {
        Self { view: GpuViewCamera::of(camera, 0), volume: searched_volume(volume, images) }
    }

    pub fn size_px(&self) -> UVec2 {
        self.view.size_px.into()
    }

    /// All pixels, row by row.
    pub fn places(&self) -> impl Iterator<Item = UVec2> + use<> {
        places(self.size_px())
    }

    /// The smaller focal length, in pixels.
    pub fn focal_px(&self) -> f32 {
        self.view.focal_px
    }

    pub fn eye(&self) -> Vec3 {
        self.view.eye_in_world.into()
    }

    pub fn near_m(&self) -> f32 {
        self.view.near_m
    }

    pub fn tiles(&self) -> UVec2 {
        tiles_of(self.size_px())
    }

    pub fn tile_index(&self, pixel: UVec2) -> usize {
        let tile = pixel / TILE_PX;
        (tile.y * self.tiles().x + tile.x) as usize
    }

    /// Through the middle of a pixel.
    pub fn ray(&self, pixel: UVec2) -> ViewRay {
        self.ray_at(pixel.as_vec2() + 0.5)
    }

    /// Through a position in the image.
    pub fn ray_at(&self, position_px: Vec2) -> ViewRay {
        let [column, row, corner] =
            [self.view.column_in_world, self.view.row_in_world, self.view.corner_in_world].map(Vec3::from);
        let direction = column * position_px.x + row * position_px.y + corner;
        let [near, far] = span_in(&self.volume, self.eye(), direction, self.near_m());
        ViewRay { eye: self.eye(), direction, near, far, is_mirrored: false }
    }
}

/// All places in a rectangle, row by row.
pub(super) fn places(size: UVec2) -> impl Iterator<Item = UVec2> + Clone {
    (0..size.y).flat_map(move |y| (0..size.x).map(move |x| UVec2::new(x, y)))
}

/// Where a ray is inside a volume; nowhere where the first is the greater.
pub(super) fn span_in(volume: &Aabb, origin: Vec3, direction: Vec3, near: f32) -> [f32; 2] {
    // No component may be 0: 0 · inf is NaN.
    let d = direction.map(|c| if c.abs() < 1e-20 { 1e-20 } else { c });
    let a = (volume.min - origin) / d;
    let b = (volume.max - origin) / d;
    [a.min(b).max_element().max(near), a.max(b).min_element()]
}
