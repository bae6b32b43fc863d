//! Storage of a cube beside that of a light field and of a volume, and six images beside three.

use depth_image::{LayeredDepthImage, LayeredLightField};
use report::{Cell, Table};

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
pub fn row(name: &str, all: &Cube, cube: &Cube, device_mb: f64) -> anyhow::Result<Vec<Cell>> {
    let (six, three) = (six_images(&all.images), three_images(&all.images));
    let lines = lines(&all.images);
    let side = cube.grid.size.max_element();
    let voxels_a_sample = device_mb * MB / cube.samples() as f64;
    Ok(vec![
        Cell::from(name),
        Cell::from(cube.samples()),
        Cell::from(device_mb),
        Cell::from(cube.encoded_bytes()? as f64 / MB),
        Cell::from(paper::SLAB_BYTES / MB),
        Cell::from(paper::VOLUME_BYTES / MB),
        Cell::from(three.mean),
        Cell::from(paper::layers_of_a_volume(side)),
        Cell::from(paper::layers_of_a_volume(side) / voxels_a_sample),
        Cell::from(six.mean),
        Cell::from(six.most),
        Cell::from(paper::layered_bytes(2 * lines, all.samples()) / MB),
        Cell::from(three.most),
        Cell::from(paper::layered_bytes(lines, all.samples()) / MB),
    ])
}

/// Megabytes on the device of a cube, and of a light field beside it; not numbers where the device does not tell.
///
/// # Errors
/// The device fails.
pub fn device_mb(subject: &Subject<'_>, cube: &Cube, field: &LayeredLightField) -> anyhow::Result<[f64; 2]> {
    // After a view has been made from a set no copy is under way.
    let used = |with_field: bool| {
        let set = if with_field { subject.upload_with(cube, field.clone())?.0 } else { subject.upload(cube)?.0 };
        views::made(subject, &set, &subject.views, views::LAYERED)?;
        anyhow::Ok(set)
    };
    // The memory of earlier sets may serve the first ones. All are kept, so that the others take their own.
    let _first = [used(false)?, used(true)?];
    let none = allocated_bytes(subject);
    let _second = used(false)?;
    let one = allocated_bytes(subject);
    let _third = used(true)?;
    let both = allocated_bytes(subject);
    Ok([one - none, both - one - (one - none)].map(|bytes| bytes / MB))
}

fn allocated_bytes(subject: &Subject<'_>) -> f64 {
    let report = subject.stand.engine().renderer.gpu().device.generate_allocator_report();
    report.map_or(f64::NAN, |report| report.total_allocated_bytes as f64)
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
