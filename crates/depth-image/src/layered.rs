//! Layered depth images: all surfaces on each line of a parallel camera, not only the first.

use glam::Vec3;

use crate::{MAX_LAYERS, ParallelCamera, SampleImageError, SpecularPlanes};

/// The samples of a parallel camera: line after line, from the first to the last surface of each (Lischinski §3.1). The planes are
/// samples long.
#[derive(Debug, Clone, PartialEq)]
pub struct LayeredDepthImage {
    /// The sample camera; its pixels are the lines.
    pub camera: ParallelCamera,
    /// The number of the first sample of each line, and after the last line the number of all samples.
    pub first: Vec<u32>,
    /// Metres from the reference plane; does not fall along a line.
    pub planar_depth_m: Vec<f32>,
    /// Normals of the triangles, octahedral in two signed bytes, on the side that is sampled.
    pub plane_normal_oct8: Vec<u16>,
    /// Radiance that a sample sends to all sides alike, linear RGB9E5.
    pub color_rgb9e5: Vec<u32>,
    /// Smooth normals, octahedral in two signed 16-bit numbers, where anything reflects.
    pub normal_oct16: Option<Vec<u32>>,
    /// Inputs of highlights and mirrors; requires `normal_oct16`.
    pub specular: Option<SpecularPlanes>,
    /// Some line met more surfaces than [`MAX_LAYERS`]: nothing is known behind its last sample.
    pub truncated: bool,
}

impl LayeredDepthImage {
    /// Checks the camera, the sizes of all planes, the prefix sums, and the order of depths.
    ///
    /// # Errors
    /// The first fault.
    pub fn validate(&self) -> Result<(), SampleImageError> {
        self.camera.validate()?;
        let samples = self.planar_depth_m.len();
        check_plane("first", self.first.len(), self.camera.pixel_count() + 1)?;
        check_plane("plane_normal", self.plane_normal_oct8.len(), samples)?;
        check_plane("color", self.color_rgb9e5.len(), samples)?;
        check_plane("normal", self.normal_oct16.as_ref().map_or(samples, Vec::len), samples)?;
        if let Some(specular) = &self.specular {
            check_plane("reflectance", specular.reflectance_srgb8_roughness8.len(), samples)?;
            specular.visibility8.iter().try_for_each(|plane| check_plane("visibility", plane.len(), samples))?;
        }
        check_lines(&self.first, &self.planar_depth_m, self.camera.range_m)
    }

    /// Number of samples.
    #[must_use]
    pub fn sample_count(&self) -> usize {
        self.planar_depth_m.len()
    }

    /// The most samples of a line.
    #[must_use]
    pub fn layer_count(&self) -> u32 {
        self.first.windows(2).map(|ends| ends[1] - ends[0]).max().unwrap_or(0)
    }

    /// The samples of a line.
    #[must_use]
    pub fn line(&self, line: usize) -> std::ops::Range<usize> {
        self.first[line] as usize..self.first[line + 1] as usize
    }

    /// The normal of a sample's triangle.
    #[must_use]
    pub fn plane_normal_in_world(&self, sample: usize) -> Vec3 {
        crate::unit_from_oct8(self.plane_normal_oct8[sample])
    }
}

pub(crate) fn check_plane(plane: &'static str, len: usize, expected: usize) -> Result<(), SampleImageError> {
    if len == expected { Ok(()) } else { Err(SampleImageError::Plane { plane, len, expected }) }
}

/// Checks the prefix sums of lines, and that depths rise along each.
pub(crate) fn check_lines(first: &[u32], planar_depth_m: &[f32], range_m: f32) -> Result<(), SampleImageError> {
    let samples = planar_depth_m.len();
    let ends = &first[1..];
    let mut least = 0;
    for (line, &first) in first.iter().enumerate() {
        if first < least || first as usize > samples || (line == 0 && first != 0) {
            return Err(SampleImageError::First { line, first, least, samples });
        }
        least = first;
    }
    if ends.last().is_some_and(|&end| end as usize != samples) {
        return Err(SampleImageError::First { line: ends.len(), first: least, least: samples as u32, samples });
    }
    (0..ends.len()).try_for_each(|line| check_line(line, [first[line], first[line + 1]], planar_depth_m, range_m))
}

fn check_line(
    line: usize,
    [first, end]: [u32; 2],
    planar_depth_m: &[f32],
    range_m: f32,
) -> Result<(), SampleImageError> {
    if end - first > MAX_LAYERS {
        return Err(SampleImageError::Layers { line, layers: end - first });
    }
    let mut nearest_m = 0.0;
    for (layer, &depth_m) in planar_depth_m[first as usize..end as usize].iter().enumerate() {
        if !(nearest_m..=range_m).contains(&depth_m) {
            return Err(SampleImageError::Depth { line, layer, depth_m, range_m });
        }
        nearest_m = depth_m;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use glam::{Quat, UVec2};

    use super::*;

    fn image() -> LayeredDepthImage {
        LayeredDepthImage {
            camera: ParallelCamera {
                corner_in_world: Vec3::ZERO,
                world_from_camera: Quat::IDENTITY,
                spacing_m: 0.5,
                size_px: UVec2::new(3, 1),
                range_m: 4.0,
            },
            first: vec![0, 2, 2, 3],
            planar_depth_m: vec![1.0, 1.5, 4.0],
            plane_normal_oct8: vec![0; 3],
            color_rgb9e5: vec![0; 3],
            normal_oct16: None,
            specular: None,
            truncated: false,
        }
    }

    #[test]
    fn lines_have_their_samples() {
        let image = image();
        assert_eq!(image.validate(), Ok(()));
        assert_eq!((image.line(0), image.line(1), image.line(2)), (0..2, 2..2, 2..3));
        assert_eq!((image.sample_count(), image.layer_count()), (3, 2));
    }

    #[test]
    fn faults_are_named() {
        let good = image();
        let first = |first: [u32; 4]| LayeredDepthImage { first: first.to_vec(), ..good.clone() }.validate();
        assert!(matches!(first([0, 2, 1, 3]), Err(SampleImageError::First { line: 2, first: 1, least: 2, .. })));
        assert!(matches!(first([0, 4, 4, 4]), Err(SampleImageError::First { line: 1, first: 4, samples: 3, .. })));
        assert!(matches!(first([1, 2, 2, 3]), Err(SampleImageError::First { line: 0, first: 1, .. })));
        assert!(matches!(first([0, 1, 1, 2]), Err(SampleImageError::First { line: 3, first: 2, .. })));
        let depths =
            |depths: [f32; 3]| LayeredDepthImage { planar_depth_m: depths.to_vec(), ..good.clone() }.validate();
        assert!(matches!(depths([1.5, 1.0, 2.0]), Err(SampleImageError::Depth { line: 0, layer: 1, .. })));
        assert!(matches!(depths([1.0, f32::NAN, 2.0]), Err(SampleImageError::Depth { line: 0, layer: 1, .. })));
        assert!(matches!(depths([1.0, 1.5, 4.1]), Err(SampleImageError::Depth { line: 2, layer: 0, .. })));
        let short = LayeredDepthImage { color_rgb9e5: vec![0; 2], ..good.clone() };
        assert!(matches!(short.validate(), Err(SampleImageError::Plane { plane: "color", len: 2, expected: 3 })));
        let short = LayeredDepthImage { first: vec![0, 3], ..good.clone() };
        assert!(matches!(short.validate(), Err(SampleImageError::Plane { plane: "first", len: 2, expected: 4 })));
        let deep = LayeredDepthImage {
            first: vec![0, 256, 256, 256],
            planar_depth_m: vec![1.0; 256],
            plane_normal_oct8: vec![0; 256],
            color_rgb9e5: vec![0; 256],
            ..good
        };
        assert!(matches!(deep.validate(), Err(SampleImageError::Layers { line: 0, layers: 256 })));
    }
}
