//! The images of a sample set: depth images of views, or layered images of a cube and a light field.

use crate::{
    CubeGrid, DepthImage, LayeredDepthImage, LayeredLightField, ParallelCamera, SampleCamera, SampleImageError,
    SpecularPlanes,
};

/// An image of a sample set.
#[derive(Debug, Clone, PartialEq)]
#[allow(clippy::large_enum_variant, reason = "their planes are what is large")]
pub enum SampleImage {
    /// The first surface of each pixel.
    Depth(DepthImage),
    /// All surfaces on each line.
    Layered(LayeredDepthImage),
    /// All light on the lines of many directions.
    LightField(LayeredLightField),
}

/// All images of a sample set.
#[derive(Debug, Clone, PartialEq)]
pub enum SampleImages {
    /// Those of cameras of views, in their order.
    Depth(Vec<DepthImage>),
    /// Those along the axes of a cube, and a light field where mirrors are gathered in one.
    Cube(Box<CubeImages>),
}

/// The images of a cube.
#[derive(Debug, Clone, PartialEq)]
pub struct CubeImages {
    /// The lines of all three.
    pub grid: CubeGrid,
    /// Along the first axis, the second, and the third.
    pub images: [LayeredDepthImage; 3],
    /// The light of the same scene.
    pub light_field: Option<LayeredLightField>,
}

impl TryFrom<Vec<SampleImage>> for SampleImages {
    type Error = SampleImageError;

    fn try_from(images: Vec<SampleImage>) -> Result<Self, SampleImageError> {
        if matches!(images.first(), None | Some(SampleImage::Depth(_))) {
            return SampleImage::depth_images(images).map(Self::Depth);
        }
        let mut layered = Vec::new();
        let mut light_field = None;
        for image in images {
            match image {
                SampleImage::Layered(image) => layered.push(image),
                SampleImage::LightField(image) if light_field.is_none() => light_field = Some(image),
                SampleImage::LightField(_) | SampleImage::Depth(_) => return Err(SampleImageError::Mixed),
            }
        }
        let no_cube = SampleImageError::NoCube { images: layered.len() };
        let cameras: Vec<ParallelCamera> = layered.iter().map(|image| image.camera).collect();
        let cube = CubeGrid::of_cameras(&cameras).zip(layered.try_into().ok());
        cube.map(|(grid, images)| Self::Cube(Box::new(CubeImages { grid, images, light_field }))).ok_or(no_cube)
    }
}

impl SampleImages {
    /// The depth images; none of a cube.
    #[must_use]
    pub fn depth(&self) -> &[DepthImage] {
        if let Self::Depth(images) = self { images } else { &[] }
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
                let tiles = Self::all_of(tiles, |tile| if let Self::Layered(tile) = tile { Some(tile) } else { None })?;
                Self::Layered(LayeredDepthImage::from_tiles(*camera, &tiles)?)
            }
            SampleCamera::LightField(camera) => {
                let tiles =
                    Self::all_of(tiles, |tile| if let Self::LightField(tile) = tile { Some(tile) } else { None })?;
                Self::LightField(LayeredLightField::from_tiles(*camera, &tiles)?)
            }
        })
    }

    /// The depth images, where all are.
    ///
    /// # Errors
    /// Some are layered.
    pub fn depth_images(images: Vec<Self>) -> Result<Vec<DepthImage>, SampleImageError> {
        Self::all_of(images, |image| if let Self::Depth(image) = image { Some(image) } else { None })
    }

    /// The images of one kind, where all are.
    fn all_of<T>(images: Vec<Self>, kind: fn(Self) -> Option<T>) -> Result<Vec<T>, SampleImageError> {
        images.into_iter().map(kind).collect::<Option<_>>().ok_or(SampleImageError::Mixed)
    }

    /// Inputs of highlights, where the image has them.
    #[must_use]
    pub fn specular(&self) -> Option<&SpecularPlanes> {
        match self {
            Self::Depth(image) => image.specular.as_ref(),
            Self::Layered(image) => image.specular.as_ref(),
            Self::LightField(_) => None,
        }
    }
}
