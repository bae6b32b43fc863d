//! Why values do not form a sample image, or images do not form a set.

use glam::UVec2;

use crate::CameraError;

/// The most samples of one line; what lies behind them is not held.
pub const MAX_LAYERS: u32 = 255;

/// Values that do not form a sample image, or images that do not form a set; `tile` counts from the top.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[allow(missing_docs, reason = "self-naming fields")]
pub enum SampleImageError {
    /// A plane of another size than the camera's; `len` is 0 for a required plane that is missing.
    #[error("depth image plane {plane} has {len} texels, the camera {expected}")]
    Size { plane: &'static str, len: usize, expected: usize },
    /// A plane of colour, highlights or corners in an image with light.
    #[error("a depth image with light has the plane {plane}, which belongs to images with colour")]
    BesideLight { plane: &'static str },
    #[error("the camera of a layered image: {0}")]
    Camera(#[from] CameraError),
    #[error("layered image plane {plane} has {len} values, must have {expected}")]
    Plane { plane: &'static str, len: usize, expected: usize },
    #[error(
        "line {line} of a layered image begins at sample {first}, must begin at {least} or later, the first line at 0, and none after {samples}"
    )]
    First { line: usize, first: u32, least: u32, samples: usize },
    #[error("line {line} of a layered image has {layers} layers, must have at most {MAX_LAYERS}")]
    Layers { line: usize, layers: u32 },
    #[error(
        "sample {layer} of line {line} of a layered image has depth {depth_m} m, must not be nearer than the one before, nor beyond {range_m} m"
    )]
    Depth { line: usize, layer: usize, depth_m: f32, range_m: f32 },
    #[error("tile {tile} has {given} pixels, the image's has {expected}")]
    TileSize { tile: usize, given: UVec2, expected: UVec2 },
    #[error("tile {tile}: {source}")]
    TilePlanes { tile: usize, source: Box<Self> },
    /// A plane without a default value for tiles that lack it.
    #[error("some tiles have the plane {plane}, and some have not")]
    MixedPlane { plane: &'static str },
    #[error("tile {tile} of a layered image has {given} lines, the image's has {expected}")]
    TileLines { tile: usize, given: UVec2, expected: UVec2 },
    #[error("tile {tile} of a light field has other lines than that part of the whole")]
    LightFieldTile { tile: usize },
    #[error("tiles of a layered image have visibility of different lamps")]
    MixedTiles,
    #[error("depth images and layered images do not go together, nor two light fields")]
    Mixed,
    #[error("{images} layered images are not the three of one cube")]
    NoCube { images: usize },
}
