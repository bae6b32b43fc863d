//! Views whose mirrors do not follow the viewer: they are part of the samples of one camera's image.

use anyhow::Context as _;
use depth_image::{DepthImage, PinholeCamera, View, linear_from_srgb8, rgb9e5_from_linear};
use glam::Vec3;
use gpu::Turn;
use reconstruction::ReconstructRequest;

use super::subject::Subject;
use crate::failures::stage::CARVE;

/// What another camera sees in the image of one camera: surfaces have the colours that `view` shows there, mirrors included.
///
/// # Errors
/// The subject has no view of this number, or the device fails.
pub fn seen_from(subject: &Subject<'_>, number: usize, view: &View, camera: PinholeCamera) -> anyhow::Result<View> {
    let own = subject.views.get(number).zip(subject.truths.get(number)).context("a view")?;
    let color = |rgb: &[u8]| rgb9e5_from_linear(Vec3::from_array([0, 1, 2].map(|part| linear_from_srgb8(rgb[part]))));
    let image = DepthImage {
        camera: (*own.0).into(),
        inverse_depth_per_m: own.1.inverse_depth_per_m.clone().context("a view with depth")?,
        color_rgb9e5: view.srgb8.chunks_exact(3).map(color).collect(),
        normal_oct16: None,
        surface_id: None,
        specular: None,
        passed: None,
        corner_inverse_depth_per_m: None,
        light: None,
    };
    let reconstructor = subject.stand.reconstructor();
    let set = reconstructor.upload(&[image], &subject.description(), Turn::default())?;
    reconstructor.reconstruct(ReconstructRequest::new(&set, &[camera], CARVE))?.pop().context("a view")
}
