//! Layers and further images: walls that are seen edge-on, and meadows.

use depth_image::{DepthImage, PinholeCamera};
use fixtures::quad;
use glam::{Affine3A, Vec3};
use sampling::{Redundancy, SamplingMethod};
use scene::Instance;
use scene::procedural::{GrassDensity, grass};

use crate::failures::curve::{Curve, Rows, Series, X, rows};
use crate::failures::measures::{mean, samples};
use crate::failures::shape::Shape;
use crate::failures::stand::Stand;

const VISIBILITY: SamplingMethod = SamplingMethod::NonRedundant(Redundancy::Visibility);

pub const CURVES: [Curve; 2] = [
    Curve {
        name: "A wall peeled from near its plane",
        subject: "a wall before another, four layers from one place",
        x: X::linear("distance from the wall's plane", "m", &[0.0, 0.05, 0.1, 0.2, 0.4, 0.8]),
        y: ["samples of the wall, of a layer's texels", ""],
        series: &[Series::new(
            "depth_peeling:4",
            &[Shape::rises(0.01, 0.0), Shape::EqualAt { x: 0.0, y: 0.0, tolerance: 0.0 }],
        )],
        why: "Layers from one place share its blind spots: a wall that is seen edge-on is in none of them.",
        measure: by_distance,
    },
    Curve {
        name: "New samples of a further image",
        subject: "a meadow, images by visibility",
        x: X::log("images", "", &[1.0, 2.0, 4.0, 8.0, 16.0]),
        y: ["samples an image, of those since half as many, over the first's", ""],
        series: &[Series::new("non_redundant:visibility", &[Shape::falls(0.3, 0.05)])],
        why: "Each further image finds less that is new.",
        measure: by_images,
    },
];

fn by_distance(stand: &Stand, distances_m: &[f64]) -> anyhow::Result<Rows> {
    let mut scene = quad(Vec3::new(0.0, 0.0, -4.0), 2.0, Vec3::Z, [200; 3]);
    scene.meshes.extend(quad(Vec3::new(0.0, 0.0, -2.0), 0.8, Vec3::X, [200, 40, 40]).meshes);
    scene.instances.push(Instance { mesh: 1, world_from_mesh: Affine3A::IDENTITY });
    let scene = stand.upload(&scene)?;
    let of_wall = |image: &DepthImage| {
        let ids = image.surface_id.iter().flatten();
        image.inverse_depth_per_m.iter().zip(ids).filter(|(depth, id)| **depth > 0.0 && id.instance == 1).count()
    };
    rows(distances_m, |x| {
        let eye = Vec3::new(x as f32, 0.0, 3.0);
        let camera = PinholeCamera::looking_at(eye, Vec3::NEG_Z * 2.0, Vec3::Y, 0.9, stand.sample_px);
        let images = stand.sample(&scene, &[camera; 4], SamplingMethod::DepthPeeling { layers: 4 })?;
        Ok([images.iter().map(of_wall).sum::<usize>() as f64 / camera.pixel_count() as f64])
    })
}

fn by_images(stand: &Stand, counts: &[f64]) -> anyhow::Result<Rows> {
    let scene = grass(GrassDensity::new(if stand.is_small { 0.2 } else { 1.0 }).unwrap_or(GrassDensity::ONE));
    let (center, reach) = (scene.bounds().center(), scene.bounds().size().length());
    let camera = |i: usize| {
        let angle = 2.4 * i as f32;
        let aside =
            Vec3::new(angle.cos(), 0.3 * angle.sin(), 0.5 * angle.sin()) * (0.12 * reach * (i as f32 / 8.0).sqrt());
        let eye = center + Vec3::new(0.2, 0.6, 0.7) * reach + aside;
        PinholeCamera::looking_at(eye, center, Vec3::Y, 0.7, stand.sample_px)
    };
    let most = counts.iter().fold(1.0, |most: f64, count| most.max(*count)) as usize;
    let cameras: Vec<PinholeCamera> = (0..most).map(camera).collect();
    let images = stand.sample(&stand.upload(&scene)?, &cameras, VISIBILITY)?;
    let first = samples(&images[0]) as f64;
    rows(counts, |count| {
        let since = &images[(count / 2.0) as usize..count as usize];
        Ok([mean(since.iter().map(|image| samples(image) as f64)).unwrap_or(f64::NAN) / first])
    })
}
