//! The cameras of a sample set: those of views, or the lines of a cube and of a light field.

use glam::UVec2;
use serde::{Deserialize, Serialize};

use crate::{Camera, CameraError, LightFieldCamera, ParallelCamera, PinholeCamera};

/// The camera of a sample image.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum SampleCamera {
    /// Sees the first surface of each pixel.
    Depth(Camera),
    /// Meets all surfaces on each of its lines.
    Layered(ParallelCamera),
    /// Meets all light on the lines of many directions.
    LightField(LightFieldCamera),
}

impl From<Camera> for SampleCamera {
    fn from(camera: Camera) -> Self {
        Self::Depth(camera)
    }
}

impl From<PinholeCamera> for SampleCamera {
    fn from(camera: PinholeCamera) -> Self {
        Self::Depth(camera.into())
    }
}

impl From<ParallelCamera> for SampleCamera {
    fn from(camera: ParallelCamera) -> Self {
        Self::Layered(camera)
    }
}

impl From<LightFieldCamera> for SampleCamera {
    fn from(camera: LightFieldCamera) -> Self {
        Self::LightField(camera)
    }
}

impl SampleCamera {
    /// The camera of a depth image; `None` of others.
    #[must_use]
    pub fn depth(&self) -> Option<&Camera> {
        if let Self::Depth(camera) = self { Some(camera) } else { None }
    }

    /// The camera of a layered image; `None` of others.
    #[must_use]
    pub fn layered(&self) -> Option<&ParallelCamera> {
        if let Self::Layered(camera) = self { Some(camera) } else { None }
    }

    /// The camera of a light field; `None` of others.
    #[must_use]
    pub fn light_field(&self) -> Option<&LightFieldCamera> {
        if let Self::LightField(camera) = self { Some(camera) } else { None }
    }

    /// The pinholes by which cameras of depth images are placed.
    #[must_use]
    pub fn references(cameras: &[Self]) -> Vec<PinholeCamera> {
        cameras.iter().filter_map(Self::depth).map(|camera| *camera.reference()).collect()
    }

    /// The model, as it is named everywhere.
    #[must_use]
    pub fn model_name(&self) -> &'static str {
        match self {
            Self::Depth(camera) => camera.model_name(),
            Self::Layered(_) => "parallel",
            Self::LightField(_) => "light_field",
        }
    }

    /// Whether both are of one model.
    #[must_use]
    pub fn is_of_model(&self, other: &Self) -> bool {
        self.model_name() == other.model_name()
    }

    /// Columns and rows.
    #[must_use]
    pub fn size_px(&self) -> UVec2 {
        match self {
            Self::Depth(camera) => camera.size_px(),
            Self::Layered(camera) => camera.size_px,
            Self::LightField(camera) => camera.size_px(),
        }
    }

    /// Number of pixels.
    #[must_use]
    pub fn pixel_count(&self) -> usize {
        let [columns, rows] = self.size_px().to_array().map(|side| side as usize);
        columns * rows
    }

    /// Checks every field.
    ///
    /// # Errors
    /// The first field that is not finite or out of range.
    pub fn validate(&self) -> Result<(), CameraError> {
        match self {
            Self::Depth(camera) => camera.validate(),
            Self::Layered(camera) => camera.validate(),
            Self::LightField(camera) => camera.validate(),
        }
    }

    /// The same field of view in another size. Lines of a cube or of a light field stay.
    #[must_use]
    pub fn resized(&self, size_px: UVec2) -> Self {
        if let Self::Depth(camera) = self { Self::Depth(camera.resized(size_px)) } else { *self }
    }
}
