//! Views as pictures.

use depth_image::View;
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
}
