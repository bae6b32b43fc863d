//! Sample images as quads on the device: cut once for each set and cut, and drawn for every view.

use std::{fmt, sync::Arc};

use depth_image::{DepthImage, PinholeCamera};
use glam::Vec3;
use gpu::{TablePool, Turn};
use minijinja::{Value, context};
use parking_lot::Mutex;

use super::corner_planes::CornerPlanes;
use crate::error::ReconstructionError;

pub(crate) const INDICES_A_QUAD: u32 = 6;
/// Meshes kept with a set, the last that were asked for: bounds are free to choose, memory is not.
pub(super) const MAX_MESHES: usize = 3;

/// Where the vertices of quads lie.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum QuadVertices {
    /// A vertex at each sample; quads lie between samples.
    AtSamples,
    /// Four vertices for each sample, at the corners of its texel.
    AtTexelCorners,
}

impl QuadVertices {
    pub fn per_sample(self) -> u32 {
        if self == Self::AtTexelCorners { 4 } else { 1 }
    }

    /// The switch of shaders that know vertices.
    pub fn context(self) -> Value {
        context! { at_texel_corners => self == Self::AtTexelCorners }
    }

    pub fn all() -> [Self; 2] {
        [Self::AtSamples, Self::AtTexelCorners]
    }
}

/// The greatest error of merged quads, as seen from the side at the sample's distance: in hundredths of a sample pixel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ErrorBound(u16);

impl ErrorBound {
    const GREATEST: u16 = 10_000;

    /// From 0.01 to 100 pixels; `None` beyond, and for fractions of a hundredth.
    #[must_use]
    pub fn from_px(px: f64) -> Option<Self> {
        let hundredths = (px * 100.0).round();
        let fits = (1.0..=f64::from(Self::GREATEST)).contains(&hundredths) && (px * 100.0 - hundredths).abs() < 1e-6;
        fits.then_some(Self(hundredths as u16))
    }

    /// In pixels.
    #[must_use]
    pub fn px(self) -> f32 {
        f32::from(self.0) / 100.0
    }
}

impl fmt::Display for ErrorBound {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", f64::from(self.0) / 100.0)
    }
}

/// How images are cut.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Cut {
    pub vertices: QuadVertices,
    pub merged: Option<ErrorBound>,
}

/// Statistics of a set's quads.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct MeshStatistics {
    /// Quads before any were merged.
    pub quads_before: u64,
    /// Quads that are drawn.
    pub quads: u64,
    /// The greatest distance of a merged quad from what it replaces: in sample pixels, as seen from the side.
    pub greatest_error_px: f32,
    /// Seconds on the device, once a set.
    pub device_s: f64,
}

/// Two triangles: its first three corners, and its last three.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quad {
    /// The sample image it was cut from.
    pub image: usize,
    /// Upper left, upper right, lower left, lower right.
    pub corners_in_world: [Vec3; 4],
    /// For each of its triangles the sample it stands for where no camera knows better, row by row in the image.
    pub samples: [u32; 2],
}

/// A set's images, cut.
pub(crate) struct Mesh {
    pub cut: Cut,
    pub images: Vec<ImageQuads>,
    pub statistics: MeshStatistics,
}

/// The quads of one image. Buffers of their own: those of all images may exceed what a device binds at once.
pub(crate) struct ImageQuads {
    /// On the rays of the vertices, see `draw.wgsl`.
    pub inverse_depths: wgpu::Buffer,
    pub indices: wgpu::Buffer,
    /// Arguments of the indirect draw.
    pub draw: wgpu::Buffer,
}

/// A set's planes and meshes for methods that draw quads.
pub(crate) struct SetMeshes {
    pub cameras: Vec<PinholeCamera>,
    /// Or the image that lacks a plane, and the plane.
    pub planes: Result<CornerPlanes, (usize, &'static str)>,
    /// The one first asked for is the first.
    pub(super) meshes: Mutex<Vec<Arc<Mesh>>>,
}

impl SetMeshes {
    /// Planes go to the device where every image has them.
    pub fn upload(tables: &TablePool, images: &[DepthImage], turn: Turn) -> Result<Self, ReconstructionError> {
        let planes = match CornerPlanes::missing(images) {
            Some(missing) => Err(missing),
            None => Ok(CornerPlanes::upload(tables, images, turn)?),
        };
        let cameras = images.iter().map(|image| *image.camera.reference());
        Ok(Self { cameras: cameras.collect(), planes, meshes: Mutex::default() })
    }
}
