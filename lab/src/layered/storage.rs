//! What cubes and light fields take on a device, and the layers of the paper's six images.

use depth_image::{LayeredDepthImage, LayeredLightField};
use reconstruction::SampleSet;

use super::paper::{Layers, MB};
use super::subject::{Cube, Subject};
use super::views;

/// Megabytes on the device of a cube, and of a light field beside it; not numbers where the device does not tell.
///
/// # Errors
/// The device fails.
pub fn device_mb(subject: &Subject<'_>, cube: &Cube, field: &LayeredLightField) -> anyhow::Result<[f64; 2]> {
    // The memory of earlier sets may serve the first ones. All are kept, so that the others take their own.
    let _first = [used_set(subject, cube, None)?, used_set(subject, cube, Some(field))?];
    let none = allocated_bytes(subject);
    let _second = used_set(subject, cube, None)?;
    let one = allocated_bytes(subject);
    let _third = used_set(subject, cube, Some(field))?;
    let both = allocated_bytes(subject);
    Ok([one - none, both - one - (one - none)].map(|bytes| bytes / MB))
}

/// A set from which a view has been made: no copy is under way any more.
fn used_set(subject: &Subject<'_>, cube: &Cube, field: Option<&LayeredLightField>) -> anyhow::Result<SampleSet> {
    let (set, _) = subject.upload(cube, field.cloned())?;
    views::made(subject, &set)?;
    Ok(set)
}

fn allocated_bytes(subject: &Subject<'_>) -> f64 {
    let report = subject.stand.engine().renderer.gpu().device.generate_allocator_report();
    report.map_or(f64::NAN, |report| report.total_allocated_bytes as f64)
}

/// As measured in the paper: two images an axis, each with the surfaces that face it.
pub fn six_images(images: &[LayeredDepthImage]) -> Layers {
    let mut samples = 0;
    let mut lines = 0;
    let mut most = 0;
    for image in images {
        let forward = image.camera.axes_in_world()[2];
        lines += image.camera.pixel_count();
        for line in (0..image.camera.pixel_count()).map(|line| image.line(line)) {
            let all = line.len();
            let front = line.filter(|&sample| image.plane_normal_in_world(sample).dot(forward) < 0.0).count();
            samples += all;
            most = most.max(front).max(all - front);
        }
    }
    Layers { mean: samples as f64 / (2 * lines) as f64, most }
}

#[cfg(test)]
mod tests {
    use glam::{UVec2, Vec3};

    use super::*;
    use crate::layered::pyramid::tests::image;

    #[test]
    fn six_images_have_the_surfaces_that_face_them() {
        let sides = [(1.0, Vec3::Z), (2.0, Vec3::NEG_Z), (3.0, Vec3::Z)];
        let images = [image(UVec2::new(8, 4), |_| sides.to_vec()), image(UVec2::new(8, 4), |_| vec![(5.0, Vec3::Z)])];
        assert_eq!(six_images(&images), Layers { mean: 1.0, most: 2 });
    }
}
