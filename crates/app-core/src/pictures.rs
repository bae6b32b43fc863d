//! Views as pictures: colour, depth as grey, and provenance as false colours.

use std::collections::BTreeSet;

use depth_image::{Provenance, ProvenanceKind, View};
use image::{ImageBuffer, Luma, RgbImage};

/// 16-bit grey.
pub type Grey16 = ImageBuffer<Luma<u16>, Vec<u16>>;

/// The colour of a view; `None` where its plane is not of its size.
#[must_use]
pub fn rgb(view: &View) -> Option<RgbImage> {
    RgbImage::from_raw(view.size_px.x, view.size_px.y, view.srgb8.clone())
}

/// The inverse planar depth of a view as 16-bit grey, and the inverse depth that 65535 stands for, per metre; 0 is
/// background.
#[must_use]
pub fn inverse_depth_16(view: &View) -> Option<(Grey16, f32)> {
    let plane = view.inverse_depth_per_m.as_ref()?;
    let greatest = plane.iter().copied().fold(0.0, f32::max);
    let scale = if greatest > 0.0 { 65_535.0 / greatest } else { 0.0 };
    // A surface is never background, however far away it is.
    let code = |&inverse: &f32| if inverse > 0.0 { ((inverse * scale + 0.5) as u16).max(1) } else { 0 };
    let image = Grey16::from_raw(view.size_px.x, view.size_px.y, plane.iter().map(code).collect())?;
    Some((image, greatest))
}

/// Colours of sample cameras; more cameras repeat them.
const CAMERAS: [[u8; 3]; 8] = [
    [86, 180, 233],
    [230, 159, 0],
    [0, 158, 115],
    [240, 228, 66],
    [0, 114, 178],
    [213, 94, 0],
    [204, 121, 167],
    [153, 213, 148],
];

/// A class of pixels that share a colour, in the order of legends.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Source {
    /// One sample camera, by number.
    Sample(u8),
    /// Several sample cameras.
    Blend,
    /// The scene.
    Direct,
    /// The surroundings of a hole.
    Fill,
    Background,
}

impl Source {
    fn of(provenance: &Provenance) -> Self {
        match (provenance.kind(), provenance.camera_mask()) {
            (ProvenanceKind::Empty, _) => Self::Background,
            (ProvenanceKind::Filled, _) => Self::Fill,
            (ProvenanceKind::Hit, 0) => Self::Direct,
            (ProvenanceKind::Hit, mask) if mask.is_power_of_two() => Self::Sample(mask.trailing_zeros() as u8),
            (ProvenanceKind::Hit, _) => Self::Blend,
        }
    }

    /// Name and colour; the name of a sample camera lacks its number.
    fn name_and_color(self) -> (&'static str, [u8; 3]) {
        match self {
            Self::Sample(camera) => ("sample", CAMERAS[usize::from(camera) % CAMERAS.len()]),
            Self::Blend => ("blend", [255, 255, 255]),
            Self::Direct => ("direct", [150, 150, 160]),
            Self::Fill => ("fill", [255, 60, 60]),
            Self::Background => ("background", [40, 44, 52]),
        }
    }
}

/// Names of the colours of a picture.
pub type Legend = Vec<(String, [u8; 3])>;

/// The provenance of a view in false colours, and the names of the colours that occur; `None` for a view without
/// provenance.
#[must_use]
pub fn provenance(view: &View) -> Option<(RgbImage, Legend)> {
    let sources: Vec<Source> = view.provenance.as_ref()?.iter().map(Source::of).collect();
    let pixels = sources.iter().flat_map(|source| source.name_and_color().1).collect();
    let image = RgbImage::from_raw(view.size_px.x, view.size_px.y, pixels)?;
    let named = |source: Source| match (source, source.name_and_color()) {
        (Source::Sample(camera), (name, color)) => (format!("{name} {camera}"), color),
        (_, (name, color)) => (name.to_owned(), color),
    };
    Some((image, BTreeSet::from_iter(sources).into_iter().map(named).collect()))
}

#[cfg(test)]
mod tests {
    use glam::UVec2;

    use super::*;

    #[test]
    fn depth_is_scaled_to_its_greatest_and_surfaces_are_never_background() {
        let plane = Some(vec![2.0, 1.0, 1e-9, 0.0]);
        let view = View { size_px: UVec2::new(2, 2), srgb8: vec![0; 12], inverse_depth_per_m: plane, provenance: None };
        let (image, greatest) = inverse_depth_16(&view).unwrap();
        assert_eq!((image.into_raw(), greatest), (vec![65_535, 32_768, 1, 0], 2.0));
        assert!(rgb(&view).is_some());
    }

    fn view(provenance: Vec<Provenance>) -> View {
        let size_px = UVec2::new(3, 1);
        View { size_px, srgb8: vec![0; 9], inverse_depth_per_m: None, provenance: Some(provenance) }
    }

    #[test]
    fn the_legend_names_each_source_once() {
        let [fill, sample] = [Provenance::new(ProvenanceKind::Filled, 0), Provenance::new(ProvenanceKind::Hit, 2)];
        let (image, legend) = provenance(&view(vec![fill, sample, fill])).unwrap();
        assert_eq!(legend, [("sample 1".to_owned(), CAMERAS[1]), ("fill".to_owned(), [255, 60, 60])]);
        assert_eq!([0, 1, 2].map(|x| image[(x, 0)].0), [legend[1].1, legend[0].1, legend[1].1]);
    }

    #[test]
    fn a_plane_of_another_size_gives_no_picture() {
        assert!(provenance(&view(vec![Provenance::new(ProvenanceKind::Filled, 0)])).is_none());
    }
}
