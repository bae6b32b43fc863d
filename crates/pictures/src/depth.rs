//! Depth as grey for files, and in false colours for people.

use depth_image::View;
use image::{ImageBuffer, Luma, RgbImage};

use crate::provenance::Legend;

/// 16-bit grey.
pub type Grey16 = ImageBuffer<Luma<u16>, Vec<u16>>;

/// Entries of a legend.
const STEPS: usize = 5;

/// The inverse planar depth of a view as 16-bit grey, and the inverse depth that 65535 stands for, per metre; 0 is
/// background.
#[must_use]
pub fn inverse_depth_16(view: &View) -> Option<(Grey16, f32)> {
    let plane = view.inverse_depth_per_m.as_ref()?;
    let greatest = plane.iter().copied().fold(0.0, f32::max);
    let scale = if greatest > 0.0 { 65_535.0 / greatest } else { 0.0 };
    // A surface is never background, however far away it is.
    let codes = plane.iter().map(|&inverse| if inverse > 0.0 { ((inverse * scale + 0.5) as u16).max(1) } else { 0 });
    let image = Grey16::from_raw(view.size_px.x, view.size_px.y, codes.collect())?;
    Some((image, greatest))
}

/// The inverse planar depth of a view in false colours, and the planar depths of some of them; background is black. `None` for
/// a view without depth.
#[must_use]
pub fn depth(view: &View) -> Option<(RgbImage, Legend)> {
    let plane = view.inverse_depth_per_m.as_ref()?;
    let surfaces = plane.iter().copied().filter(|&inverse| inverse > 0.0);
    let least = surfaces.clone().fold(f32::INFINITY, f32::min);
    let greatest = surfaces.fold(0.0, f32::max);
    let range = (greatest - least).max(f32::MIN_POSITIVE);
    let color = |inverse: f32| colorous::VIRIDIS.eval_continuous(f64::from((inverse - least) / range)).as_array();
    let pixels = plane.iter().flat_map(|&inverse| if inverse > 0.0 { color(inverse) } else { [0; 3] });
    let image = RgbImage::from_raw(view.size_px.x, view.size_px.y, pixels.collect())?;
    let steps = (0..STEPS).map(|step| greatest - (greatest - least) * step as f32 / (STEPS - 1) as f32);
    let legend = steps.map(|inverse| (format!("{:.3}", 1.0 / inverse), color(inverse)));
    Some((image, if greatest > 0.0 { legend.collect() } else { Vec::new() }))
}

#[cfg(test)]
mod tests {
    use glam::UVec2;

    use super::*;

    fn view(plane: Vec<f32>) -> View {
        View { size_px: UVec2::new(2, 2), srgb8: vec![0; 12], inverse_depth_per_m: Some(plane), provenance: None }
    }

    #[test]
    fn depth_is_scaled_to_its_greatest_and_surfaces_are_never_background() {
        let view = view(vec![2.0, 1.0, 1e-9, 0.0]);
        let (image, greatest) = inverse_depth_16(&view).unwrap();
        assert_eq!((image.into_raw(), greatest), (vec![65_535, 32_768, 1, 0], 2.0));
        assert!(crate::rgb(&view).is_some());
    }

    #[test]
    fn a_legend_goes_from_the_nearest_to_the_farthest_surface() {
        let (image, legend) = depth(&view(vec![2.0, 0.5, 1.0, 0.0])).unwrap();
        let depths: Vec<&str> = legend.iter().map(|(depth, _)| depth.as_str()).collect();
        assert_eq!((depths[0], depths[STEPS - 1]), ("0.500", "2.000"));
        assert_eq!([image[(0, 0)].0, image[(1, 0)].0], [legend[0].1, legend[STEPS - 1].1]);
        assert_eq!(image[(1, 1)].0, [0; 3]);
    }

    #[test]
    fn equal_depths_and_no_surface_are_no_fault() {
        assert_eq!(depth(&view(vec![1.0; 4])).unwrap().1[0].0, "1.000");
        assert!(depth(&view(vec![0.0; 4])).unwrap().1.is_empty());
    }
}
