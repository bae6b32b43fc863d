//! Camera models: a closed set. An operation that some pixels or points lack returns an `Option`.

use glam::{UVec2, Vec2, Vec3};
use serde::{Deserialize, Serialize};

use crate::{CameraError, MAX_IMAGE_SIDE_PX, PinholeCamera, PixelDepth, Ray, SinglePoleCamera, ViewPart};

/// The map from an image to rays. A model is one variant: a file here, and one of the same name in the shaders of `render` and of
/// `reconstruction`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Camera {
    /// Straight rays through one eye, with lens shift.
    Pinhole(PinholeCamera),
    /// Straight rays around a pole, which see the sides of what it shows.
    SinglePole(SinglePoleCamera),
}

impl From<PinholeCamera> for Camera {
    fn from(camera: PinholeCamera) -> Self {
        Self::Pinhole(camera)
    }
}

impl Camera {
    /// The pinhole by which the camera is placed: it has the same size, and its planar depth.
    #[must_use]
    pub fn reference(&self) -> &PinholeCamera {
        match self {
            Self::Pinhole(camera) => camera,
            Self::SinglePole(camera) => &camera.reference,
        }
    }

    /// `None` of another model.
    #[must_use]
    pub fn pinhole(&self) -> Option<&PinholeCamera> {
        if let Self::Pinhole(camera) = self { Some(camera) } else { None }
    }

    /// The model, as it is named everywhere.
    #[must_use]
    pub fn model_name(&self) -> &'static str {
        match self {
            Self::Pinhole(_) => "pinhole",
            Self::SinglePole(_) => "single_pole",
        }
    }

    /// Whether both are of one model.
    #[must_use]
    pub fn is_of_model(&self, other: &Self) -> bool {
        std::mem::discriminant(self) == std::mem::discriminant(other)
    }

    /// Columns and rows.
    #[must_use]
    pub fn size_px(&self) -> UVec2 {
        self.reference().size_px
    }

    /// Number of pixels.
    #[must_use]
    pub fn pixel_count(&self) -> usize {
        self.reference().pixel_count()
    }

    /// Checks every field.
    ///
    /// # Errors
    /// The first field that is not finite or out of range.
    pub fn validate(&self) -> Result<(), CameraError> {
        match self {
            Self::Pinhole(camera) => camera.validate(),
            Self::SinglePole(camera) => camera.validate(),
        }
    }

    /// The same field of view in another size.
    #[must_use]
    pub fn resized(&self, size_px: UVec2) -> Self {
        match self {
            Self::Pinhole(camera) => Self::Pinhole(camera.resized(size_px)),
            Self::SinglePole(camera) => Self::SinglePole(camera.resized(size_px)),
        }
    }

    /// The cameras at other sizes: their fields of view and the ratios of their sizes stay. All together have about `pixels`
    /// pixels, and each side has at least `least_px`.
    #[must_use]
    pub fn resized_together(cameras: &[Self], pixels: f32, least_px: u32) -> Vec<Self> {
        let all: usize = cameras.iter().map(Self::pixel_count).sum();
        let scale = (pixels / all.max(1) as f32).sqrt();
        let resized = cameras.iter().map(|camera| {
            let size_px = (camera.size_px().as_vec2() * scale).round().as_uvec2();
            camera.resized(size_px.clamp(UVec2::splat(least_px), UVec2::splat(MAX_IMAGE_SIDE_PX)))
        });
        resized.collect()
    }

    /// The camera whose pixels' centres are those points of this one's pixels, in pixels from their centres.
    #[must_use]
    pub fn with_offset(&self, offset_px: Vec2) -> Self {
        match self {
            Self::Pinhole(camera) => Self::Pinhole(camera.with_offset(offset_px)),
            Self::SinglePole(camera) => Self::SinglePole(camera.with_offset(offset_px)),
        }
    }

    /// The camera of a part of the image.
    #[must_use]
    pub fn part(&self, part: &ViewPart) -> Self {
        match self {
            Self::Pinhole(camera) => Self::Pinhole(camera.part(part)),
            Self::SinglePole(camera) => {
                let pole_px = camera.pole_px - part.first_px.as_vec2();
                Self::SinglePole(SinglePoleCamera { reference: camera.reference.part(part), pole_px, ..*camera })
            }
        }
    }

    /// The position and depth of a point; `None` where the camera does not look.
    #[must_use]
    pub fn project(&self, point_in_world: Vec3) -> Option<PixelDepth> {
        match self {
            Self::Pinhole(camera) => camera.project(point_in_world),
            Self::SinglePole(camera) => camera.project(point_in_world),
        }
    }

    /// The point at a position and depth: the inverse of [`Camera::project`].
    #[must_use]
    pub fn unproject(&self, at: PixelDepth) -> Vec3 {
        self.ray(at.pixel).at(at.planar_depth_m)
    }

    /// The ray of a pixel; its parameter is planar depth in metres.
    #[must_use]
    pub fn ray(&self, pixel: Vec2) -> Ray {
        match self {
            Self::Pinhole(camera) => camera.ray(pixel),
            Self::SinglePole(camera) => camera.ray(pixel),
        }
    }

    /// The planar depths between which a pixel sees, in metres; empty where the first is the greater.
    #[must_use]
    pub fn depths_m(&self, pixel: Vec2) -> [f32; 2] {
        match self {
            Self::Pinhole(camera) => [camera.near_m, f32::INFINITY],
            Self::SinglePole(camera) => camera.depths_m(pixel),
        }
    }
}
