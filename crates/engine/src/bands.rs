//! Views with more pixels than a device's buffers hold, made in bands of rows, one after another.

use std::ops::Range;

use depth_image::{PinholeCamera, VIEW_REACH_PX, View, ViewPart};
use glam::UVec2;

/// The pixels of a band. Twelve times as many words fit the smallest buffers that are in use, of 128 MiB.
pub(crate) const BAND_PIXELS: usize = 1 << 21;

/// Some rows of a view, and the camera that sees them and those around that they depend on.
#[derive(Debug, Clone, PartialEq)]
struct Band {
    camera: PinholeCamera,
    /// Among the rows that the camera sees.
    rows: Range<u32>,
}

/// Views of any size, by a function that makes those of at most `most_pixels`. Only very wide views have larger bands.
pub(crate) fn views_in_bands<E>(
    cameras: &[PinholeCamera],
    most_pixels: usize,
    mut views_of: impl FnMut(&[PinholeCamera]) -> Result<Vec<View>, E>,
) -> Result<Vec<View>, E> {
    let is_large = |camera: &PinholeCamera| camera.pixel_count() > most_pixels;
    let mut views = Vec::with_capacity(cameras.len());
    for run in cameras.chunk_by(|a, b| is_large(a) == is_large(b)) {
        if !is_large(&run[0]) {
            views.extend(views_of(run)?);
            continue;
        }
        for camera in run {
            views.push(joined(camera, most_pixels, &mut views_of)?);
        }
    }
    Ok(views)
}

fn joined<E>(
    camera: &PinholeCamera,
    most_pixels: usize,
    views_of: &mut impl FnMut(&[PinholeCamera]) -> Result<Vec<View>, E>,
) -> Result<View, E> {
    let srgb8 = Vec::with_capacity(3 * camera.pixel_count());
    let mut whole = View { size_px: camera.size_px, srgb8, inverse_depth_per_m: None, provenance: None };
    for band in bands(camera, most_pixels) {
        for view in views_of(&[band.camera])? {
            append(&mut whole, view, &band.rows);
        }
    }
    Ok(whole)
}

fn append(whole: &mut View, band: View, rows: &Range<u32>) {
    let all = whole.size_px.element_product() as usize;
    let row = band.size_px.x as usize;
    let pixels = rows.start as usize * row..rows.end as usize * row;
    whole.srgb8.extend_from_slice(&band.srgb8[3 * pixels.start..3 * pixels.end]);
    if let Some(plane) = band.inverse_depth_per_m {
        let whole = whole.inverse_depth_per_m.get_or_insert_with(|| Vec::with_capacity(all));
        whole.extend_from_slice(&plane[pixels.clone()]);
    }
    if let Some(plane) = band.provenance {
        whole.provenance.get_or_insert_with(|| Vec::with_capacity(all)).extend_from_slice(&plane[pixels]);
    }
}

/// From the top. Bands begin with whole tiles, of 8 rows; a pixel depends on those up to [`VIEW_REACH_PX`] away.
fn bands(camera: &PinholeCamera, most_pixels: usize) -> Vec<Band> {
    let UVec2 { x: columns, y: height } = camera.size_px;
    let rows_seen = (most_pixels as u32 / columns.max(1)).next_multiple_of(8);
    let rows = rows_seen.saturating_sub(2 * VIEW_REACH_PX).max(VIEW_REACH_PX);
    let bands = (0..height).step_by(rows as usize).map(|first| {
        let end = (first + rows).min(height);
        let top = first.saturating_sub(VIEW_REACH_PX);
        let bottom = (end + VIEW_REACH_PX).min(height);
        let part = ViewPart { first_px: UVec2::new(0, top), size_px: UVec2::new(columns, bottom - top) };
        Band { camera: camera.part(&part), rows: first - top..end - top }
    });
    bands.collect()
}

#[cfg(test)]
mod tests {
    use std::convert::Infallible;

    use depth_image::Provenance;
    use glam::Vec2;
    use glam::Vec3;

    use super::*;

    fn camera(size_px: UVec2) -> PinholeCamera {
        PinholeCamera::looking_at(Vec3::Z, Vec3::ZERO, Vec3::Y, 0.8, size_px)
    }

    /// A view whose planes say where the principal point is from each pixel.
    fn from_axis(camera: &PinholeCamera) -> View {
        let UVec2 { x, y } = camera.size_px;
        let places = (0..y).flat_map(|row| (0..x).map(move |column| Vec2::new(column as f32, row as f32)));
        let depths: Vec<f32> = places.map(|place| (place - camera.principal_px).dot(Vec2::new(1.0, 4096.0))).collect();
        View {
            size_px: camera.size_px,
            srgb8: depths.iter().flat_map(|depth| depth.to_le_bytes()[..3].to_vec()).collect(),
            provenance: Some(depths.iter().map(|depth| Provenance(depth.to_bits())).collect()),
            inverse_depth_per_m: Some(depths),
        }
    }

    #[test]
    fn a_view_in_bands_is_the_whole_view() {
        let cameras = [[64, 64], [300, 700], [300, 700], [40, 90], [64, 1024]].map(|size| camera(UVec2::from(size)));
        let mut most = 0;
        let views = views_in_bands::<Infallible>(&cameras, 64 * 1024 / 2, |cameras| {
            most = cameras.iter().map(PinholeCamera::pixel_count).fold(most, usize::max);
            Ok(cameras.iter().map(from_axis).collect())
        });
        assert_eq!(views, Ok(cameras.iter().map(from_axis).collect()));
        assert!(most < 300 * 3 * VIEW_REACH_PX as usize + 300 * 8, "{most}");
    }

    #[test]
    fn an_error_ends_a_view() {
        let camera = camera(UVec2::new(8192, 8192));
        let mut calls = 0;
        let result = views_in_bands(&[camera], BAND_PIXELS, |_| {
            calls += 1;
            if calls < 3 { Ok(Vec::new()) } else { Err("the device") }
        });
        assert_eq!((result, calls), (Err("the device"), 3));
        let seen: Vec<usize> = bands(&camera, BAND_PIXELS).iter().map(|band| band.camera.pixel_count()).collect();
        assert!(seen.iter().all(|&pixels| pixels <= BAND_PIXELS + 8 * 8192), "{seen:?}");
    }
}
