//! Provenance of a view as false colours.

use std::collections::BTreeSet;

use depth_image::{Provenance, ProvenanceKind, View};
use image::RgbImage;

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

/// A class of pixels that share a colour.
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

impl From<&Provenance> for Source {
    fn from(provenance: &Provenance) -> Self {
        match (provenance.kind(), provenance.camera_mask()) {
            (ProvenanceKind::Empty, _) => Self::Background,
            (ProvenanceKind::Filled, _) => Self::Fill,
            (ProvenanceKind::Hit, 0) => Self::Direct,
            (ProvenanceKind::Hit, mask) if mask.is_power_of_two() => Self::Sample(mask.trailing_zeros() as u8),
            (ProvenanceKind::Hit, _) => Self::Blend,
        }
    }
}

impl Source {
    fn color(self) -> [u8; 3] {
        match self {
            Self::Sample(camera) => CAMERAS[usize::from(camera) % CAMERAS.len()],
            Self::Blend => [255, 255, 255],
            Self::Direct => [150, 150, 160],
            Self::Fill => [255, 60, 60],
            Self::Background => [40, 44, 52],
        }
    }

    fn name(self) -> String {
        match self {
            Self::Sample(camera) => format!("sample {camera}"),
            Self::Blend => "blend".into(),
            Self::Direct => "direct".into(),
            Self::Fill => "fill".into(),
            Self::Background => "background".into(),
        }
    }
}

/// A picture whose colours have names.
#[derive(Debug, Clone)]
pub struct FalseColor {
    /// The picture.
    pub image: RgbImage,
    /// Names of the colours that occur.
    pub legend: Vec<(String, [u8; 3])>,
}

/// The provenance of a view in false colours; `None` for a view without provenance.
#[must_use]
pub fn false_color(view: &View) -> Option<FalseColor> {
    let sources: Vec<Source> = view.provenance.as_ref()?.iter().map(Source::from).collect();
    let pixels = sources.iter().flat_map(|source| source.color()).collect();
    let image = RgbImage::from_raw(view.size_px.x, view.size_px.y, pixels)?;
    let found: BTreeSet<Source> = sources.into_iter().collect();
    let legend = found.into_iter().map(|source| (source.name(), source.color())).collect();
    Some(FalseColor { image, legend })
}

#[cfg(test)]
mod tests {
    use glam::UVec2;

    use super::*;

    fn view(provenance: Vec<Provenance>) -> View {
        let size_px = UVec2::new(3, 1);
        View { size_px, srgb8: vec![0; 9], inverse_depth_per_m: None, provenance: Some(provenance) }
    }

    #[test]
    fn the_legend_names_each_source_once() {
        let [fill, sample] = [Provenance::new(ProvenanceKind::Filled, 0), Provenance::new(ProvenanceKind::Hit, 2)];
        let FalseColor { image, legend } = false_color(&view(vec![fill, sample, fill])).unwrap();
        assert_eq!(legend, [("sample 1".to_owned(), CAMERAS[1]), ("fill".to_owned(), [255, 60, 60])]);
        assert_eq!([0, 1, 2].map(|x| image[(x, 0)].0), [legend[1].1, legend[0].1, legend[1].1]);
    }

    #[test]
    fn a_plane_of_another_size_gives_no_picture() {
        assert!(false_color(&view(vec![Provenance::new(ProvenanceKind::Filled, 0)])).is_none());
    }
}
