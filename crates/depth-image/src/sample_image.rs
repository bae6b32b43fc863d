//! The images of a sample set: depth images of views, or layered images of a cube.

use crate::{
    CubeGrid, DepthImage, LayeredDepthImage, LayeredError, ParallelCamera, SampleCamera, SpecularPlanes, TileError,
};

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
    #[error("depth images and layered images do not go together")]
    Mixed,
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
            Self::Layered(_) => Err(SampleImageError::Mixed),
        };
        images.into_iter().map(depth).collect()
    }

    fn layered_images(images: Vec<Self>) -> Result<Vec<LayeredDepthImage>, SampleImageError> {
        let layered = |image| match image {
            Self::Layered(image) => Ok(image),
            Self::Depth(_) => Err(SampleImageError::Mixed),
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
