//! Provenance in false colours.

use std::collections::BTreeSet;

use depth_image::{Provenance, ProvenanceKind, View};
use image::RgbImage;

/// Names of the colours of a picture.
pub type Legend = Vec<(String, [u8; 3])>;

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

/// Pixels that share a colour: their place in legends, name and colour.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Source {
    /// The number of the sample camera of the view cell; larger for other sources.
    place: usize,
    /// The name of a sample camera lacks its number.
    name: &'static str,
    color: [u8; 3],
}

/// The places of sources from here on are no sample cameras.
const FIRST_OTHER_PLACE: usize = 32;

impl Source {
    fn of(provenance: &Provenance) -> Self {
        let (order, name, color) = match (provenance.kind(), provenance.camera_mask()) {
            (ProvenanceKind::Hit, mask) if mask.is_power_of_two() => {
                let place = mask.trailing_zeros() as usize;
                return Self { place, name: "camera", color: CAMERAS[place % CAMERAS.len()] };
            }
            (ProvenanceKind::Hit, 0) => (1, "drawn directly", [150, 150, 160]),
            (ProvenanceKind::Hit, _) => (0, "blended", [255, 255, 255]),
            (ProvenanceKind::Base, _) => (2, "from the base", [120, 90, 220]),
            (ProvenanceKind::LitHere, _) => (3, "lit here", [150, 90, 40]),
            (ProvenanceKind::Filled, _) => (4, "filled", [255, 60, 60]),
            (ProvenanceKind::Guessed, _) => (5, "reflection, guessed", [255, 60, 220]),
            (ProvenanceKind::Empty, _) => (6, "background", [40, 44, 52]),
        };
        Self { place: FIRST_OTHER_PLACE + order, name, color }
    }
}

/// The provenance of a view in false colours, and the names of the colours that occur; `None` for a view without
/// provenance. The cameras of its view cell are numbered from `first_camera`.
#[must_use]
pub fn provenance(view: &View, first_camera: usize) -> Option<(RgbImage, Legend)> {
    let sources: Vec<Source> = view.provenance.as_ref()?.iter().map(Source::of).collect();
    let pixels = sources.iter().flat_map(|source| source.color).collect();
    let image = RgbImage::from_raw(view.size_px.x, view.size_px.y, pixels)?;
    let legend = BTreeSet::from_iter(sources).into_iter().map(|Source { place, name, color }| {
        let name = if place < FIRST_OTHER_PLACE { format!("{name} {}", first_camera + place) } else { name.to_owned() };
        (name, color)
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
        let [hit, base, guessed] = [ProvenanceKind::Hit, ProvenanceKind::Base, ProvenanceKind::Guessed];
        let [fill, empty] = [ProvenanceKind::Filled, ProvenanceKind::Empty];
        let others = [(hit, 3), (hit, 0), (base, 0), (fill, 0), (guessed, 0), (empty, 0)];
        let colors = others.map(|(kind, mask)| Source::of(&Provenance::new(kind, mask)).color);
        assert!(!CAMERAS.iter().chain(&colors).any(|color| *color == legend[1].1));
    }

    #[test]
    fn a_plane_of_another_size_gives_no_picture() {
        assert!(provenance(&view(vec![Provenance::new(ProvenanceKind::Filled, 0)]), 0).is_none());
    }
}
