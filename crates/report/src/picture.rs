//! Pictures of a report: rows of labelled images.

use image::RgbImage;
pub use pictures::Legend;
use serde::{Deserialize, Serialize};

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
