//! Normals and corner depths of sample images, from which corners of quads are made.

use depth_image::{DepthImage, HOLE_INVERSE_DEPTH};
use gpu::{Table, TablePool, Turn};
use wgpu::TextureFormat;

use crate::error::ReconstructionError;

/// Normals and inverse depths of samples and texel corners: a texel for each corner of each image.
pub(crate) struct CornerPlanes {
    pub texels: Table,
    /// The first texel of each image.
    pub first_corners: Vec<u32>,
}

impl CornerPlanes {
    /// The first image that lacks a plane, and the plane's name in [`depth_image::SampleImageError`].
    pub fn missing(images: &[DepthImage]) -> Option<(usize, &'static str)> {
        images.iter().enumerate().find_map(|(index, image)| {
            let normal = image.normal_oct16.is_none().then_some("normal");
            let corners = image.corner_inverse_depth_per_m.is_none().then_some("corner_inverse_depth");
            Some((index, normal.or(corners)?))
        })
    }

    /// Uploads images that have all planes.
    pub fn upload(tables: &TablePool, images: &[DepthImage], turn: Turn) -> Result<Self, ReconstructionError> {
        let count = images.iter().map(|image| (image.size_px() + 1).element_product() as usize).sum();
        tables.gpu.check_table("corners", count)?;
        let mut texels: Vec<[u32; 4]> = Vec::with_capacity(count);
        let mut first_corners = Vec::with_capacity(images.len());
        for image in images {
            first_corners.push(texels.len() as u32);
            texels.extend(corner_texels(image));
        }
        Ok(Self { texels: tables.upload("corners", TextureFormat::Rgba32Uint, &texels, turn)?, first_corners })
    }
}

/// For each corner, row by row, the sample to its lower right and its own inverse depth.
fn corner_texels(image: &DepthImage) -> impl Iterator<Item = [u32; 4]> {
    let size_px = image.size_px();
    let normals = image.normal_oct16.as_deref().unwrap_or_default();
    let corners = image.corner_inverse_depth_per_m.as_deref().unwrap_or_default();
    let places = (0..=size_px.y).flat_map(move |y| (0..=size_px.x).map(move |x| (x, y)));
    places.zip(corners).map(move |((x, y), corner)| {
        let sample = (x < size_px.x && y < size_px.y).then_some((y * size_px.x + x) as usize);
        let inverse_depth = sample.map_or(HOLE_INVERSE_DEPTH, |sample| image.inverse_depth_per_m[sample]);
        let normal = sample.and_then(|sample| normals.get(sample)).copied().unwrap_or_default();
        [inverse_depth.to_bits(), normal, corner.to_bits(), 0]
    })
}
