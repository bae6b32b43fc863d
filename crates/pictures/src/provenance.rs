//! Provenance in false colours.

use std::collections::BTreeSet;

use depth_image::{Provenance, ProvenanceKind, View};
use image::RgbImage;

use crate::Legend;

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
    /// A layered depth cube of the whole scene.
    Base,
    /// A surface of the scene that was lit in this view.
    LitHere,
    /// The surroundings of a hole.
    Fill,
    /// A mirror of which some ray ends where no camera sees.
    Guess,
    Background,
}

impl Source {
    fn of(provenance: &Provenance) -> Self {
        match (provenance.kind(), provenance.camera_mask()) {
            (ProvenanceKind::Empty, _) => Self::Background,
            (ProvenanceKind::Filled, _) => Self::Fill,
            (ProvenanceKind::Guessed, _) => Self::Guess,
            (ProvenanceKind::Base, _) => Self::Base,
            (ProvenanceKind::LitHere, _) => Self::LitHere,
            (ProvenanceKind::Hit, 0) => Self::Direct,
            (ProvenanceKind::Hit, mask) if mask.is_power_of_two() => Self::Sample(mask.trailing_zeros() as u8),
            (ProvenanceKind::Hit, _) => Self::Blend,
        }
    }

    /// Name and colour; the name of a sample camera lacks its number.
    fn name_and_color(self) -> (&'static str, [u8; 3]) {
        match self {
            Self::Sample(camera) => ("camera", CAMERAS[usize::from(camera) % CAMERAS.len()]),
            Self::Blend => ("blended", [255, 255, 255]),
            Self::Direct => ("drawn directly", [150, 150, 160]),
            Self::Base => ("from the base", [120, 90, 220]),
            Self::LitHere => ("lit here", [150, 90, 40]),
            Self::Fill => ("filled", [255, 60, 60]),
            Self::Guess => ("reflection, guessed", [255, 60, 220]),
            Self::Background => ("background", [40, 44, 52]),
        }
    }
}

/// The provenance of a view in false colours, and the names of the colours that occur; `None` for a view without
/// provenance. The cameras of its view cell are numbered from `first_camera`.
#[must_use]
pub fn provenance(view: &View, first_camera: usize) -> Option<(RgbImage, Legend)> {
    let sources: Vec<Source> = view.provenance.as_ref()?.iter().map(Source::of).collect();
    let pixels = sources.iter().flat_map(|source| source.name_and_color().1).collect();
    let image = RgbImage::from_raw(view.size_px.x, view.size_px.y, pixels)?;
    let legend = BTreeSet::from_iter(sources).into_iter().map(|source| match (source, source.name_and_color()) {
        (Source::Sample(camera), (name, color)) => (format!("{name} {}", first_camera + usize::from(camera)), color),
        (_, (name, color)) => (name.to_owned(), color),
    });
    Some((image, legend.collect()))
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
        let (image, legend) = provenance(&view(vec![fill, sample, fill]), 4).unwrap();
        assert_eq!(legend, [("camera 5".to_owned(), CAMERAS[1]), ("filled".to_owned(), [255, 60, 60])]);
        assert_eq!([0, 1, 2].map(|x| image[(x, 0)].0), [legend[1].1, legend[0].1, legend[1].1]);
    }

    #[test]
    fn surfaces_that_were_lit_in_the_view_have_a_colour_of_their_own() {
        let [lit, sample] = [Provenance::new(ProvenanceKind::LitHere, 0), Provenance::new(ProvenanceKind::Hit, 1)];
        let (_, legend) = provenance(&view(vec![lit, sample, lit]), 0).unwrap();
        let names: Vec<&str> = legend.iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(names, ["camera 0", "lit here"]);
        let others = [Source::Blend, Source::Direct, Source::Base, Source::Fill, Source::Guess, Source::Background];
        let colors = others.map(|source| source.name_and_color().1);
        assert!(!CAMERAS.iter().chain(&colors).any(|color| *color == legend[1].1));
    }

    #[test]
    fn a_plane_of_another_size_gives_no_picture() {
        assert!(provenance(&view(vec![Provenance::new(ProvenanceKind::Filled, 0)]), 0).is_none());
    }
}
