//! Pictures of a report: rows of labelled images, contact sheets, false colours.

mod contact_sheet;

use image::RgbImage;
use metrics::ScoreMap;
use pictures::error_map;
use serde::{Deserialize, Serialize};

pub use contact_sheet::contact_sheet;
pub use pictures::Legend;

/// One image, written as `pictures/{slug(name)}.png`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Picture {
    /// Unique in the report.
    pub name: String,
    /// The caption.
    pub caption: String,
    /// Names of the picture's colours, if they have a meaning.
    #[serde(default)]
    pub legend: Legend,
    /// Pixels, which are not in `report.json`: empty in a report that was read back.
    #[serde(skip)]
    pub image: RgbImage,
}

impl Picture {
    /// A picture without a legend.
    #[must_use]
    pub fn new(name: impl Into<String>, caption: impl Into<String>, image: RgbImage) -> Self {
        Self { name: name.into(), caption: caption.into(), legend: Vec::new(), image }
    }
}

/// Pictures side by side.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PictureRow {
    /// The title of the row.
    pub title: String,
    /// The pictures, left to right.
    pub pictures: Vec<Picture>,
}

/// The row *direct | reconstructed | error map | provenance*, the last only if given.
#[must_use]
pub fn comparison_row(
    title: &str,
    direct: RgbImage,
    reconstructed: RgbImage,
    flip: &ScoreMap,
    provenance: Option<(RgbImage, Legend)>,
) -> PictureRow {
    let [direct, reconstructed, errors] = [direct, reconstructed, error_map(flip)].map(|image| (image, Legend::new()));
    let images = [
        ("direct", Some(direct)),
        ("reconstructed", Some(reconstructed)),
        ("error map (FLIP, 0 to 1)", Some(errors)),
        ("provenance", provenance),
    ];
    let pictures = images.into_iter().filter_map(|(what, image)| {
        let (image, legend) = image?;
        Some(Picture { legend, ..Picture::new(format!("{title} {what}"), what, image) })
    });
    PictureRow { title: title.into(), pictures: pictures.collect() }
}
