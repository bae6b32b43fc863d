//! The errors of frames, and of their changes.

use depth_image::{DepthImage, PinholeCamera, View};
use metrics::{
    MetricsError, PixelClass, Rgb8Image, ScoreMap, change_error_map, class_mask, classify, flip_map, foreground,
};

/// The classes of which errors are shown.
pub const CLASSES: [(PixelClass, &str); 3] = [
    (PixelClass::Covered, "covered"),
    (PixelClass::Silhouette, "silhouette"),
    (PixelClass::Disoccluded, "disoccluded"),
];

/// A frame as it is delivered, and the same view drawn from the scene, with depth.
pub struct Compared<'a> {
    pub camera: PinholeCamera,
    pub truth: &'a View,
    pub view: &'a View,
    pub sample_images: &'a [DepthImage],
}

/// The error of a frame, and of its change from the frame before, over the foreground.
#[derive(Debug, Clone)]
pub struct Figures {
    pub flip: f64,
    /// In shares of full scale.
    pub change_error: f64,
    /// The same over the pixels of each class; `None` without such pixels.
    pub change_error_by_class: [Option<f64>; CLASSES.len()],
    pub change_error_map: ScoreMap,
}

impl Figures {
    /// The figures of a frame, compared with the one before.
    ///
    /// # Errors
    /// The views differ in size.
    pub fn of(before: &Compared<'_>, frame: &Compared<'_>) -> Result<Self, MetricsError> {
        let [r0, r1] = [Rgb8Image::of_view(before.truth)?, Rgb8Image::of_view(frame.truth)?];
        let [t0, t1] = [Rgb8Image::of_view(before.view)?, Rgb8Image::of_view(frame.view)?];
        let mask = foreground(frame.truth, &t1)?;
        let map = change_error_map([&r0, &r1], [&t0, &t1])?;
        let depth = frame.truth.inverse_depth_per_m.as_deref().unwrap_or_default();
        let classes = classify(&frame.camera, depth, frame.sample_images)?;
        let mut by_class = [None; CLASSES.len()];
        for ((class, _), error) in CLASSES.iter().zip(&mut by_class) {
            *error = map.mean(Some(&class_mask(&classes, *class)))?;
        }
        Ok(Self {
            flip: flip_map(&r1, &t1)?.mean(Some(&mask))?.unwrap_or(0.0),
            change_error: map.mean(Some(&mask))?.unwrap_or(0.0),
            change_error_by_class: by_class,
            change_error_map: map,
        })
    }
}
