//! The limits of a graph camera, and why one cannot be used.

use std::ops::RangeInclusive;

use depth_image::CameraError;

/// The root among them.
pub const MAX_FRUSTA: usize = 64;
pub const MAX_WALLS: usize = 8;
pub const FACE_CORNERS: RangeInclusive<usize> = 3..=6;

#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum GraphCameraError {
    #[error("the root: {0}")]
    Root(#[from] CameraError),
    #[error("{frusta} frusta, at most {MAX_FRUSTA}")]
    TooManyFrusta { frusta: usize },
    #[error("frustum {frustum} has no parent {parent}")]
    NoSuchParent { frustum: usize, parent: usize },
    #[error("frustum {frustum} is an ancestor of itself")]
    Cycle { frustum: usize },
    #[error("frustum {frustum} comes before its parent {parent}")]
    ParentAfterChild { frustum: usize, parent: usize },
    #[error("frustum {frustum}: {what} is not finite")]
    NotFinite { frustum: usize, what: &'static str },
    #[error("frustum {frustum}: {walls} walls, at most {MAX_WALLS}")]
    TooManyWalls { frustum: usize, walls: usize },
    #[error("frustum {frustum}: {corners} corners of its face, must be {} to {}", FACE_CORNERS.start(), FACE_CORNERS.end())]
    Corners { frustum: usize, corners: usize },
    #[error("frustum {frustum}: a corner of its face lies {off_m} m off the plane of the others")]
    NotPlanar { frustum: usize, off_m: f64 },
    #[error("frustum {frustum}: its face is not convex")]
    NotConvex { frustum: usize },
    #[error("frustum {frustum}: its eye lies in the plane of its face")]
    EyeInFace { frustum: usize },
    #[error("frustum {frustum}: its far end of {far_m} m does not lie beyond its face")]
    Far { frustum: usize, far_m: f64 },
    #[error("frustum {frustum}: its face leaves the region of its parent by {off_m} m")]
    NotInParent { frustum: usize, off_m: f64 },
    #[error("the region of frustum {frustum} is empty")]
    Empty { frustum: usize },
    #[error("the regions of frusta {first} and {second} overlap")]
    Overlap { first: usize, second: usize },
}
