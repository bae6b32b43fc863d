//! The images of a sample set: depth images of views, or layered images of a cube.

use glam::UVec2;
use serde::{Deserialize, Serialize};

use crate::{
    Camera, CameraError, CubeGrid, DepthImage, LayeredDepthImage, LayeredError, ParallelCamera, PinholeCamera,
    SpecularPlanes, TileError,
};

/// The camera of a sample image.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum SampleCamera {
    /// Sees the first surface of each pixel.
    Depth(Camera),
    /// Meets all surfaces on each of its lines.
    Layered(ParallelCamera),
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

impl SampleCamera {
    /// The camera of a depth image; `None` of a layered one.
    #[must_use]
    pub fn depth(&self) -> Option<&Camera> {
        match self {
            Self::Depth(camera) => Some(camera),
            Self::Layered(_) => None,
        }
    }

    /// The camera of a layered image; `None` of a depth image.
    #[must_use]
    pub fn layered(&self) -> Option<&ParallelCamera> {
        match self {
            Self::Depth(_) => None,
            Self::Layered(camera) => Some(camera),
        }
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
        }
    }

    /// The same field of view in another size. The lines of a layered image belong to a cube, and stay.
    #[must_use]
    pub fn resized(&self, size_px: UVec2) -> Self {
        match self {
            Self::Depth(camera) => Self::Depth(camera.resized(size_px)),
            Self::Layered(_) => *self,
        }
    }
}

/// An image of a sample set.
#[derive(Debug, Clone, PartialEq)]
#[allow(clippy::large_enum_variant, reason = "their planes are what is large")]
pub enum SampleImage {
    /// The first surface of each pixel.
    Depth(DepthImage),
    /// All surfaces on each line.
    Layered(LayeredDepthImage),
}

/// Why images do not form what they are for.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[allow(missing_docs, reason = "self-naming fields")]
pub enum SampleImageError {
    #[error(transparent)]
    Depth(#[from] TileError),
    #[error(transparent)]
    Layered(#[from] LayeredError),
    #[error("not all images are {expected} images")]
    Kind { expected: &'static str },
    #[error("{images} layered images are not the three of one cube")]
    NoCube { images: usize },
}

/// All images of a sample set.
#[derive(Debug, Clone, PartialEq)]
pub enum SampleImages {
    /// Those of cameras of views, in their order.
    Depth(Vec<DepthImage>),
    /// Those along the axes of a cube.
    Cube(CubeGrid, Box<[LayeredDepthImage; 3]>),
}

impl TryFrom<Vec<SampleImage>> for SampleImages {
    type Error = SampleImageError;

    fn try_from(images: Vec<SampleImage>) -> Result<Self, SampleImageError> {
        if matches!(images.first(), None | Some(SampleImage::Depth(_))) {
            return SampleImage::depth_images(images).map(Self::Depth);
        }
        let images = SampleImage::layered_images(images)?;
        let no_cube = SampleImageError::NoCube { images: images.len() };
        let cameras: Vec<ParallelCamera> = images.iter().map(|image| image.camera).collect();
        let cube = CubeGrid::of_cameras(&cameras).zip(images.try_into().ok());
        cube.map(|(grid, images)| Self::Cube(grid, Box::new(images))).ok_or(no_cube)
    }
}

impl SampleImages {
    /// The depth images; none of a cube.
    #[must_use]
    pub fn depth(&self) -> &[DepthImage] {
        match self {
            Self::Depth(images) => images,
            Self::Cube(..) => &[],
        }
    }
}

impl From<DepthImage> for SampleImage {
    fn from(image: DepthImage) -> Self {
        Self::Depth(image)
    }
}

impl From<LayeredDepthImage> for SampleImage {
    fn from(image: LayeredDepthImage) -> Self {
        Self::Layered(image)
    }
}

impl SampleImage {
    /// Joins the tiles of a camera, from the top, to one image.
    ///
    /// # Errors
    /// Tiles that do not form its image.
    pub fn from_tiles(camera: &SampleCamera, tiles: Vec<Self>) -> Result<Self, SampleImageError> {
        Ok(match camera {
            SampleCamera::Depth(camera) => Self::Depth(DepthImage::from_tiles(*camera, Self::depth_images(tiles)?)?),
            SampleCamera::Layered(camera) => {
                Self::Layered(LayeredDepthImage::from_tiles(*camera, &Self::layered_images(tiles)?)?)
            }
        })
    }

    /// The depth images, where all are.
    ///
    /// # Errors
    /// Some are layered.
    pub fn depth_images(images: Vec<Self>) -> Result<Vec<DepthImage>, SampleImageError> {
        let depth = |image| match image {
            Self::Depth(image) => Ok(image),
            Self::Layered(_) => Err(SampleImageError::Kind { expected: "depth" }),
        };
        images.into_iter().map(depth).collect()
    }

    fn layered_images(images: Vec<Self>) -> Result<Vec<LayeredDepthImage>, SampleImageError> {
        let layered = |image| match image {
            Self::Layered(image) => Ok(image),
            Self::Depth(_) => Err(SampleImageError::Kind { expected: "layered" }),
        };
        images.into_iter().map(layered).collect()
    }

    /// Inputs of highlights, where the image has them.
    #[must_use]
    pub fn specular(&self) -> Option<&SpecularPlanes> {
        match self {
            Self::Depth(image) => image.specular.as_ref(),
            Self::Layered(image) => image.specular.as_ref(),
        }
    }
}
