//! Storage of a cube beside that of a light field and of a volume, and six images beside three.

use depth_image::LayeredDepthImage;
use reconstruction::SampleSet;
use study::{Cell, Table};

use super::paper::{self, Layers, MB};
use super::subject::{Cube, Subject};
use super::views;

pub fn table() -> Table {
    let columns = [
        ("scene", ""),
        ("samples", ""),
        ("on the device", "MB"),
        ("sent", "MB"),
        ("light field slab", "MB"),
        ("volume", "MB"),
        ("mean layers of all surfaces", ""),
        ("layers from which a volume has fewer values", ""),
        ("layers from which it has fewer bytes", ""),
        ("six images: mean layers", ""),
        ("six images: most layers", ""),
        ("six images, all surfaces", "MB"),
        ("three images: most layers", ""),
        ("three images, all surfaces", "MB"),
    ];
    Table::new(
        "Storage: a cube beside a slab of 32×32×256², a volume of 512³, and six images (MB of 2²⁰ bytes)",
        &columns,
    )
}

/// A row of the table: a cube of all surfaces for the numbers of layers, and the one that is sampled and sent.
///
/// # Errors
/// Planes that do not belong together.
pub fn row(name: &str, all: &Cube, cube: &Cube, device_mb: Option<f64>) -> anyhow::Result<Vec<Cell>> {
    let (six, three) = (six_images(&all.images), three_images(&all.images));
    let lines = lines(&all.images);
    let side = cube.grid.size.max_element();
    let voxels_a_sample = device_mb.map(|mb| mb * MB / cube.samples() as f64);
    Ok(vec![
        Cell::from(name),
        Cell::from(cube.samples()),
        Cell::from(device_mb),
        Cell::from(cube.encoded_bytes()? as f64 / MB),
        Cell::from(paper::SLAB_BYTES / MB),
        Cell::from(paper::VOLUME_BYTES / MB),
        Cell::from(three.mean),
        Cell::from(paper::layers_of_a_volume(side)),
        Cell::from(voxels_a_sample.map(|voxels| paper::layers_of_a_volume(side) / voxels)),
        Cell::from(six.mean),
        Cell::from(six.most),
        Cell::from(paper::layered_bytes(2 * lines, all.samples()) / MB),
        Cell::from(three.most),
        Cell::from(paper::layered_bytes(lines, all.samples()) / MB),
    ])
}

/// Megabytes that a cube takes on the device; `None` where the device does not tell.
///
/// # Errors
/// The device fails.
pub fn device_mb(subject: &Subject<'_>, cube: &Cube) -> anyhow::Result<Option<f64>> {
    // The memory of an earlier set may serve the first one; the second takes its own.
    let _first = used(subject, cube)?;
    let before = allocated_bytes(subject);
    let _second = used(subject, cube)?;
    Ok(before.zip(allocated_bytes(subject)).map(|(before, after)| (after - before) / MB))
}

/// A cube on the device, from which a view has been made: no copy is under way.
fn used(subject: &Subject<'_>, cube: &Cube) -> anyhow::Result<SampleSet> {
    let (set, _) = subject.upload(cube)?;
    views::made(subject, &set, &subject.views, views::LAYERED)?;
    Ok(set)
}

fn allocated_bytes(subject: &Subject<'_>) -> Option<f64> {
    let report = subject.stand.engine().renderer.gpu().device.generate_allocator_report()?;
    Some(report.total_allocated_bytes as f64)
}

fn lines(images: &[LayeredDepthImage]) -> usize {
    images.iter().map(|image| image.camera.pixel_count()).sum()
}

/// As here: both sides of surfaces in three images.
fn three_images(images: &[LayeredDepthImage]) -> Layers {
    let samples: usize = images.iter().map(LayeredDepthImage::sample_count).sum();
    let most = images.iter().map(LayeredDepthImage::layer_count).max().unwrap_or(0);
    Layers { mean: samples as f64 / lines(images) as f64, most: most as usize }
}

/// As measured in the paper: two images an axis, each with the surfaces that face it.
pub fn six_images(images: &[LayeredDepthImage]) -> Layers {
    let facing = |image: &LayeredDepthImage, line: usize| {
        let forward = image.camera.axes_in_world()[2];
        let front = image.line(line).filter(|&sample| image.plane_normal_in_world(sample).dot(forward) < 0.0).count();
        [front, image.line(line).len() - front]
    };
    let each =
        images.iter().flat_map(|image| (0..image.camera.pixel_count()).flat_map(move |line| facing(image, line)));
    let (samples, most) = each.fold((0, 0), |(samples, most), layers| (samples + layers, layers.max(most)));
    Layers { mean: samples as f64 / (2 * lines(images)) as f64, most }
}

#[cfg(test)]
mod tests {
    use glam::{UVec2, Vec3};

    use super::*;
    use crate::layered::pyramid::tests::image;

    #[test]
    fn six_images_have_half_the_mean_layers_of_three() {
        let sides = [(1.0, Vec3::Z), (2.0, Vec3::NEG_Z), (3.0, Vec3::Z)];
        let images = [image(UVec2::new(8, 4), |_| sides.to_vec()), image(UVec2::new(8, 4), |_| vec![(5.0, Vec3::Z)])];
        assert_eq!(six_images(&images), Layers { mean: 1.0, most: 2 });
        assert_eq!(three_images(&images), Layers { mean: 2.0, most: 3 });
    }
}
